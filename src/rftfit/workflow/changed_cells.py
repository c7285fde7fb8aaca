"""Cells of two tables with the same rows that differ: `rftfit diff` and `rftfit verify --again` ask this."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pandas as pd


class ChangedCell(NamedTuple):
    """A cell that differs: number of its row from 0, its column, and what both tables hold there."""

    row: int
    column: Any
    was: Any
    now: Any

    @property
    def share(self) -> float:
        """Change relative to the larger number; NaN where one is none."""
        return share_of_change(self.was, self.now)


def share_of_change(was: Any, now: Any) -> float:
    """Difference of two numbers relative to the larger; NaN where one is none."""
    try:
        numbers = float(was), float(now)
    except ValueError:
        return math.nan
    return abs(numbers[1] - numbers[0]) / max(*map(abs, numbers), 1e-300)


def find_changed_cells(
    before: pd.DataFrame, after: pd.DataFrame, tolerance: float = 0.0
) -> list[ChangedCell]:
    """List the cells that differ in the columns of both tables, column by column.

    `tolerance`: Numbers that differ by less, relative to them, are equal; so are two that are NaN.
    """
    cells = []
    for column in before.columns.intersection(after.columns):
        was, now = before[column].to_numpy(), after[column].to_numpy()
        differs = (was != now) & ~(pd.isna(was) & pd.isna(now))
        if tolerance:
            differs &= ~np.isclose(was, now, rtol=tolerance, atol=0)
        rows = np.flatnonzero(differs).tolist()
        cells += [ChangedCell(row, column, was[row], now[row]) for row in rows]
    return cells
