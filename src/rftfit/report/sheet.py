"""Where each run stands on a quality sheet: rows of beta, columns of gamma, direction and depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import labels
from rftfit.report.runs import DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas as pd

MAX_COLUMNS = 15
"""Six extractions, three horizontal depths, six intrusions."""

MAX_ROWS = 7

_SAME_DEPTH_CM = 0.5


@dataclass(frozen=True)
class Page:
    """One sheet of paper.

    Attributes
    ----------
    row_labels, column_labels : list of str
    places : dict of str to (int, int)
        Row and column of each run.
    first : bool
        Whether an empty place means that nothing was measured there; on later pages, which hold
        repeated runs, it means nothing.
    """

    row_labels: list[str]
    column_labels: list[str]
    places: dict[str, tuple[int, int]]
    first: bool


def depth_levels(depth_cm: pd.Series[float]) -> pd.Series[float]:
    """Gather the depths of horizontal runs into the depths that were meant.

    Parameters
    ----------
    depth_cm : pandas.Series
        NaN where it is not known.

    Returns
    -------
    pandas.Series
        The mean of the depths less than half a centimetre from one another; NaN stays.
    """
    ordered = depth_cm.sort_values()
    group = (ordered.diff() > _SAME_DEPTH_CM).cumsum()
    means = ordered.groupby(group).transform("mean")
    return means.where(ordered.notna()).reindex(depth_cm.index)


def _column_label(gamma: float, direction: str, level: float) -> str:
    head = f"\N{GREEK SMALL LETTER GAMMA} = {labels.degrees(gamma)}\n{direction}"
    if direction == "horizontal":
        return head + (f"\n{level:.1f} cm deep" if level >= 0 else "\ndepth not known")
    return head


def _chunks(count: int, most: int) -> Iterator[range]:
    for start in range(0, count, most):
        yield range(start, min(start + most, count))


def lay_out(fits: pd.DataFrame, depth_cm: pd.Series[float]) -> list[Page]:
    """Order the runs of one medium on pages; the k-th repeat of a run stands on its own page.

    Parameters
    ----------
    fits : pandas.DataFrame
        Fit table of one medium, angles as filed.
    depth_cm : pandas.Series
        Depth of each horizontal run, by run id.

    Returns
    -------
    list of Page
    """
    runs = fits[["run_id", "beta_deg", "gamma_deg", "direction"]].copy()
    runs["beta_deg"] = runs["beta_deg"].astype(float).round(2) + 0.0
    runs["gamma_deg"] = runs["gamma_deg"].astype(float).round(2) + 0.0
    flat = runs["direction"] == "horizontal"
    depth = runs["run_id"].map(depth_cm).astype(float).where(flat)
    # -1: a horizontal run of which no depth is known; inf would hide in labels
    runs["level"] = np.where(flat, depth_levels(depth).fillna(-1.0), 0.0)
    runs["order"] = runs["direction"].map({name: i for i, name in enumerate(DIRECTIONS)})
    keys = ["gamma_deg", "order", "level", "direction"]
    runs = runs.sort_values(["beta_deg", *keys, "run_id"], kind="stable")
    runs["repeat"] = runs.groupby(["beta_deg", *keys]).cumcount()
    pages = []
    for repeat, part in runs.groupby("repeat"):
        columns = part[keys].drop_duplicates().sort_values(keys[:3])
        column_of = {key: i for i, key in enumerate(columns.itertuples(index=False, name=None))}
        betas = sorted(part["beta_deg"].unique())
        place = {
            str(run): (betas.index(beta), column_of[tuple(key)])
            for run, beta, *key in part[["run_id", "beta_deg", *keys]].itertuples(
                index=False, name=None
            )
        }
        heads = [_column_label(gamma, name, level) for gamma, _, level, name in column_of]
        for rows in _chunks(len(betas), MAX_ROWS):
            for across in _chunks(len(heads), MAX_COLUMNS):
                here = {
                    run: (i - rows.start, j - across.start)
                    for run, (i, j) in place.items()
                    if i in rows and j in across
                }
                if here:
                    names = [
                        f"\N{GREEK SMALL LETTER BETA} = {labels.degrees(betas[i])}" for i in rows
                    ]
                    above = [heads[j] for j in across]
                    pages.append(Page(names, above, here, repeat == 0))
    return pages
