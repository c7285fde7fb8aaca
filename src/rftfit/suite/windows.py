"""Alpha of an example over every window of depth instead of one: no window was chosen before the answer was known.

Alpha is the slope of stress over depth, and depends on the depths (the window) that it is fitted over. A program could
be made to agree by choosing them; so all windows count, and the verdict is formed by the whole of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign, load_campaign
from rftfit.campaign.presence import CONFIG
from rftfit.conventions import FloatArray
from rftfit.measure.alpha import cell_at
from rftfit.measure.slopes import NORMAL_95
from rftfit.results import Results
from rftfit.suite.cells import read_number
from rftfit.suite.declared import NumberCells, Windows
from rftfit.workflow.measure import MEASURED, checks, slopes


@dataclass(frozen=True)
class OverWindows:
    """One number by each of n windows of depth; windows without a number are left out.

    `values`: shape (n,). `intervals`: ends of their 95 % intervals, shape (n, 2). Both in the unit of the answer.
    """

    values: FloatArray
    intervals: FloatArray

    def count_inside(self, number: float | str) -> int:
        """Count the windows whose interval contains a number; a word lies in none."""
        if isinstance(number, str):
            return 0
        low, high = self.intervals.T
        return int(((low <= number) & (number <= high)).sum())

    def quantile(self, share: float) -> float:
        """Return a quantile of the mixture of all windows: a random window, its number drawn within its error.

        It is the number x at which the mean of Phi((x - value) / sd) over the windows is `share`: Phi is the standard
        normal distribution function, sd the standard error of a window's number. NaN without a window.
        """
        from scipy.optimize import brentq
        from scipy.special import ndtr

        if not len(self.values):
            return math.nan
        # half the width of a 95 % interval is `NORMAL_95` times sd; without width brentq would find no root
        sd = np.maximum(np.ptp(self.intervals, axis=1) / 2 / NORMAL_95, 1e-12)
        # nothing of a normal distribution lies farther from its mean than 9 sd
        low = float((self.values - 9 * sd).min())
        high = float((self.values + 9 * sd).max())
        return float(brentq(lambda x: ndtr((x - self.values) / sd).mean() - share, low, high))


def over_windows(
    folder: Path, windows: Windows, key: Mapping[str, str], cells: NumberCells
) -> OverWindows:
    """Fit the slopes of a medium over every window of depth, and look up its alpha in one direction for each.

    Parameters
    ----------
    folder : Path
        Folder of the campaign, with its results.
    windows : Windows
    key : mapping of str to str
        The medium, and ``beta_deg`` and ``gamma_deg`` of the row in its table of alpha (default: 0 and 90).
    cells : NumberCells
        Columns of the number and its interval.

    Returns
    -------
    OverWindows
    """
    campaign = load_campaign(folder / CONFIG)
    results_of_run = Results(campaign)
    values, intervals = [], []
    for window in windows.ends:
        row = _alpha_in_window(campaign, results_of_run, window, key)
        if not row:
            continue
        number = read_number(cells, row)
        # without NaN, and no word
        if isinstance(number.value, float) and math.isfinite(number.value + number.lo + number.hi):
            values.append(number.value)
            intervals.append((number.lo, number.hi))
    return OverWindows(np.array(values), np.reshape(intervals, (-1, 2)))


def _alpha_in_window(
    campaign: Campaign, results_of_run: Results, window: tuple[float, float], key: Mapping[str, str]
) -> dict[str, str]:
    """Fit the slopes of a medium over one window of depth; return the row of its alpha table that `key` names, by column.

    Empty if there is no such row. `results_of_run`: Results of the example, whose forces are used as they are. `window`:
    Least and greatest depth, cm. `key`: As in `over_windows`.
    """
    first_cm, last_cm = window
    fit = campaign.config.fit.model_copy(
        update={"submergence_cm": first_cm, "max_depth_cm": last_cm}
    )
    config = campaign.config.model_copy(update={"fit": fit})
    results, medium = Results(replace(campaign, config=config)), key["medium"]
    # tables of the stages before the slopes do not depend on the window
    *earlier_stages, (_, names_of_slopes) = MEASURED
    for _, names in earlier_stages:
        for name in names:
            results.hold(name.format(medium), results_of_run.table(name.format(medium)))
    for name, table in zip(names_of_slopes, slopes(results, medium), strict=True):
        results.hold(name.format(medium), table)
    # of the seven tables of this stage the second
    alpha = checks(results, medium)[1]
    angles = float(key.get("beta_deg", 0)), float(key.get("gamma_deg", 90))
    row = cell_at(alpha, *angles, config.grid.angle_tolerance_deg)
    if row is None:
        return {}
    return {str(name): "" if pd.isna(cell) else str(cell) for name, cell in row.items()}
