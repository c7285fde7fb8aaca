"""A stage whose table has a false column: what mutants of columns put above its function."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.outputs.dictionary import outputs

SEEN = "RFTFIT_FALSE_COLUMN_SEEN"
"""Variable of the environment: the file that is left where the false column is not the true one."""
CHANGES: dict[str, Callable[[Any], Any]] = {
    "2 * p": lambda column: 2 * column,
    "3 * p": lambda column: 3 * column,
    "1 - p": lambda column: 1 - column,
    "-p": lambda column: -column,
    "~p": lambda column: ~column.astype(bool),
}


def change(
    file: str, column: str, change: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Change a column of one table that a stage returns.

    `file`: Of the table, as the dictionary of outputs names it.
    `change`: One of `CHANGES`, or the column whose values it takes.
    """
    (described,) = (table for table in outputs() if table.file == file)
    published = {name for column in described.columns for name in column.names}

    def decorate(stage: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(stage)
        def run_falsely(*arguments: Any, **options: Any) -> Any:
            output = stage(*arguments, **options)
            contents = list(output) if isinstance(output, tuple) else [output]
            tables = [
                index
                for index, table in enumerate(contents)
                if isinstance(table, pd.DataFrame) and column in table
            ]
            if not tables:
                return output
            index = min(tables, key=lambda index: len(published ^ set(contents[index])))
            contents[index] = _with_false(contents[index], column, change)
            return tuple(contents) if isinstance(output, tuple) else contents[0]

        return run_falsely

    return decorate


def _with_false(table: pd.DataFrame, column: str, change: str) -> pd.DataFrame:
    """Change the column of a table; leave the file where that gives another table."""
    numbers = table[column]
    if change not in CHANGES:
        false = table.get(change, numbers)
    elif numbers.dtype == object and change != "~p":
        false = CHANGES[change](pd.to_numeric(numbers, errors="coerce")).where(
            numbers.notna(), np.nan
        )
    else:
        false = CHANGES[change](numbers)
    if not false.equals(numbers) and SEEN in os.environ:
        Path(os.environ[SEEN]).touch()
    return table.assign(**{column: false})
