"""Cells that differ between two tables with the same rows: asked by `rftfit diff` and `rftfit verify --again`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pandas as pd


class ChangedCell(NamedTuple):
    """A cell that differs: the number of its row, counted from 0, its column, and its content in both tables."""

    row: int
    column: Any
    was: Any
    now: Any

    @property
    def share(self) -> float:
        """Change relative to the larger of both numbers; NaN where a cell is no number."""
        return share_of_change(self.was, self.now)


def share_of_change(was: Any, now: Any) -> float:
    """Return the size of the difference of two numbers over the larger of their sizes, 0 to 2; NaN where one is no number."""
    try:
        numbers = float(was), float(now)
    except ValueError:
        return math.nan
    # two zeros: 0
    return abs(numbers[1] - numbers[0]) / max(*map(abs, numbers), 1e-300)


def find_changed_cells(
    before: pd.DataFrame, after: pd.DataFrame, tolerance: float = 0.0
) -> list[ChangedCell]:
    """List the cells that differ, column by column, in the columns that both tables have.

    Row i of one table is compared with row i of the other. `tolerance`: Relative difference up to which two numbers are
    equal; 0, for tables of text too: cells have to be the same. Two cells of NaN are equal.
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
