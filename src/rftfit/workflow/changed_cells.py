"""Cells of two tables with the same rows that differ: `rftfit diff` and `rftfit verify --again` ask this."""

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
    """Divide the difference of two numbers by the larger one; NaN where a cell is no number."""
    try:
        numbers = float(was), float(now)
    except ValueError:
        return math.nan
    return abs(numbers[1] - numbers[0]) / max(*map(abs, numbers), 1e-300)


def find_changed_cells(
    before: pd.DataFrame, after: pd.DataFrame, tolerance: float = 0.0
) -> list[ChangedCell]:
    """List the cells that differ, column by column, in the columns that both tables have.

    `tolerance`: Relative difference up to which two numbers are equal. Two cells of NaN are equal, too.
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
