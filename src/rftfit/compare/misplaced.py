"""Evidence that runs stand in wrong rows of the run sheet, or have wrong axes in a part of the runs, by the known shape.

For each run alone, the shape of known media is fitted to its alpha at the stated angles, at those of a row nearby, and
with other axes. The error of a run includes the departure of its medium from the shape, and a run that fits nothing
counts little (Student). `make mixups` shows how often such mistakes are told.

A *mistake* is a name and a number of rows: `ROWS` or `BETA_ROWS` with 1 or -1, by how many rows of plates the angles
stand above their logs; or one of `AXES` with 0. n is the number of runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.sheet import Run
from rftfit.compare.axes import AXES
from rftfit.compare.joint import RunSlopes, prior_of_media
from rftfit.conventions import FloatArray
from rftfit.directions import number_directions
from rftfit.measure.fits import filed_under
from rftfit.measure.verdict_words import BETA_ROWS, ROWS
from rftfit.store.chosen import chosen

MISPLACED_COLUMNS = ["medium", "mistake", "rows", "log_bayes_factor", "n_runs", "run_ids"]

_CHOSEN, _AXES = chosen("compare", "misplaced"), chosen("compare", "axes")


def find_misplaced(
    runs: RunSlopes, run_ids: list[str], sheet: Mapping[str, Run], medium: str
) -> pd.DataFrame:
    """Weigh each mistake against the sheet as it is, and return a table of `MISPLACED_COLUMNS`, the likeliest first.

    Parameters
    ----------
    runs : RunSlopes
        Runs in the order of the run sheet.
    run_ids : list of str
        Their run_ids.
    sheet : mapping of str to Run
        All runs of the medium by run_id.

    Returns
    -------
    DataFrame
        A row for each mistake that explains three runs or more in three directions. `rows`: By how many rows of plates
        the angles stand above their logs, 0 for axes. `log_bayes_factor`: Logarithm of how many times better the mistake
        explains alpha than the sheet as it is. `run_ids`: Runs that the mistake explains better.
    """
    rows: list[tuple[object, ...]] = []
    if not runs.size:
        return pd.DataFrame(rows, columns=MISPLACED_COLUMNS)
    direction_of_run = number_directions(
        runs.beta_deg, runs.gamma_deg, tolerance_deg=runs.tolerance_deg
    )
    for (mistake, shift), log_ratio in _log_ratios(runs, run_ids, sheet).items():
        if shift:
            evidence, is_explained = _explain_stretch(log_ratio, direction_of_run)
        else:
            evidence, is_explained = _explain_scattered(log_ratio)
        n_directions = np.unique(direction_of_run[is_explained]).size
        names = np.array(run_ids)[is_explained]
        if names.size >= _CHOSEN.fewest_runs and n_directions >= _CHOSEN.fewest_directions:
            rows.append((medium, mistake, shift, evidence, names.size, " ".join(names)))
    table = pd.DataFrame(rows, columns=MISPLACED_COLUMNS)
    return table.sort_values("log_bayes_factor", ascending=False, ignore_index=True, kind="stable")


_Explained = tuple[float, npt.NDArray[np.bool_]]
"""Logarithm of the Bayes factor of a mistake, and whether it explains each run better, shape (n,)."""


def _explain_scattered(log_ratio: FloatArray) -> _Explained:
    """Find the evidence that a share of the runs, the one that fits best, has a mistake.

    Exchanged cables are a question of days, not of rows. `log_ratio`: from `_log_ratios`, (n,). A run has the mistake
    with probability p, a share of `_CHOSEN.shares`: its likelihood is 1 - p + p ratio.
    """
    evidence, best_share = 0.0, 0.0
    for share in _CHOSEN.shares:
        of_share = float(np.logaddexp(math.log1p(-share), math.log(share) + log_ratio).sum())
        if of_share > evidence:
            evidence, best_share = of_share, share
    if not evidence:
        return 0.0, np.zeros(log_ratio.size, dtype=bool)
    # runs that have the mistake more probably than not
    return evidence, log_ratio > math.log(1 / best_share - 1)


def _explain_stretch(log_ratio: FloatArray, direction_of_run: npt.NDArray[np.intp]) -> _Explained:
    """Find the evidence that a stretch of the sheet has a mistake: all of it, from a row on, or between two rows.

    Repeats share how their direction departs from the known shape, and together count as one run. `log_ratio`: from
    `_log_ratios`, (n,), in the order of the sheet. `direction_of_run`: from `number_directions`.
    """
    # runs of each direction that the mistake changes
    changed_of_direction = np.bincount(direction_of_run, log_ratio != 0)
    weighted = log_ratio / np.maximum(changed_of_direction, 1)[direction_of_run]
    # the stretch of consecutive runs with the largest sum: the largest rise of the running sum over its lowest point so
    # far
    sums = np.concatenate([[0.0], np.cumsum(weighted)])
    lowest = np.minimum.accumulate(sums)
    end = int((sums - lowest).argmax())
    first = int(sums[: end + 1].argmin())
    rank = np.arange(log_ratio.size)
    is_inside = (first <= rank) & (rank < end)
    return float(sums[end] - sums[first]), is_inside & (log_ratio != 0)


def _log_ratios(
    runs: RunSlopes, run_ids: list[str], sheet: Mapping[str, Run]
) -> dict[tuple[str, int], FloatArray]:
    """Calculate the log likelihood ratio of each run, shape (n,), with each mistake against the sheet as it is.

    By name and number of rows of the mistake. The ratio is 0 where a mistake changes nothing. Parameters: those of
    `find_misplaced`.
    """
    as_stated = runs.beta_deg, runs.gamma_deg
    angles_deg = _angles_of_rows(runs, run_ids, sheet)
    # beta and gamma of all runs as stated, then by each mistake: shape (2, sets n); the shape is found once for all
    all_angles_deg = np.concatenate(
        [np.stack(pair) for pair in (as_stated, *angles_deg.values())], 1
    )
    means, covariances = _shape_at(all_angles_deg[0], all_angles_deg[1])
    count = runs.size
    # as it was measured: alpha_x of pulls had got the other sign
    alpha = np.stack([runs.alpha[0], runs.side * runs.alpha[1]])
    level = np.hypot(*alpha)
    error = np.hypot(_AXES.scatter * level, _AXES.of_medium * level.max(initial=0.0))
    # neither another row nor other axes change how large alpha of all runs is
    size = float(level.sum() / np.hypot(*means[:, :count]).sum())

    def log_density(angle_set: int, turned_alpha: FloatArray) -> FloatArray:
        """Log density of each run, shape (n,), at one set of angles, by its number, up to a constant.

        `turned_alpha`: as measured by the axes of the mistake, (2, n).
        """
        of_set = slice(angle_set * count, (angle_set + 1) * count)
        # alpha_x of pulls gets the other sign, as the table has it
        side = np.where(all_angles_deg[1, of_set] < 0, -1.0, 1.0)
        off = np.stack([turned_alpha[0], side * turned_alpha[1]]) - size * means[:, of_set]
        covariance = size**2 * covariances[of_set] + error[:, None, None] ** 2 * np.eye(2)
        distance = np.einsum("in,nij,jn->n", off, np.linalg.inv(covariance), off)
        # Student's t of two components
        dof = _CHOSEN.t_dof
        log_det = np.log(np.linalg.det(covariance))
        return np.asarray(-0.5 * ((dof + 2) * np.log1p(distance / dof) + log_det))

    as_in_sheet = log_density(0, alpha)
    ratios = {
        (name, 0): log_density(0, np.array(matrix) @ alpha) - as_in_sheet
        for name, matrix in AXES.items()
        if name != "as-given"
    }
    for angle_set, (mistake, angles) in enumerate(angles_deg.items(), 1):
        differs = np.abs(np.subtract(angles, as_stated)).max(axis=0) > runs.tolerance_deg
        ratios[mistake] = np.where(differs, log_density(angle_set, alpha) - as_in_sheet, 0.0)
    return ratios


def _angles_of_rows(
    runs: RunSlopes, run_ids: list[str], sheet: Mapping[str, Run]
) -> dict[tuple[str, int], tuple[FloatArray, FloatArray]]:
    """Return beta and gamma of each run, deg, shape (n,), by each mistake: those of the next row, or beta of it alone.

    Only rows of plates count. A run keeps its stated angles where there is no such row. Parameters: those of
    `find_misplaced`.
    """
    plates = sorted((run for run in sheet.values() if run.kind == "plate"), key=lambda run: run.row)
    row_of_run = {run.run_id: row for row, run in enumerate(plates)}
    rows = np.array([row_of_run[run_id] for run_id in run_ids])
    stated_deg = np.array([filed_under(run)[:2] for run in plates]).T
    angles_deg = {}
    for shift in (1, -1):
        away = rows - shift
        is_there = (away >= 0) & (away < len(plates))
        # where there is no row, index 0 stands for it and is not used
        beta_deg, gamma_deg = np.where(
            is_there, stated_deg[:, away * is_there], (runs.beta_deg, runs.gamma_deg)
        )
        angles_deg[ROWS, shift] = beta_deg, gamma_deg
        angles_deg[BETA_ROWS, shift] = beta_deg, runs.gamma_deg
    return angles_deg


def _shape_at(beta_deg: FloatArray, gamma_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean (2, k) and covariance (k, 2, 2) of alpha, z and x, for a medium of size 1 in k directions.

    Each direction alone, without its covariance with the others.
    """
    directions, place = np.unique(np.stack([beta_deg, gamma_deg]), axis=1, return_inverse=True)
    # few at a time, as only the blocks of single directions are used
    at_once = 100
    means, covariances = [], []
    for first in range(0, directions.shape[1], at_once):
        beta_of_few, gamma_of_few = directions[:, first : first + at_once]
        mean, covariance = prior_of_media(beta_of_few, gamma_of_few, 0.0)
        count = beta_of_few.size
        means.append(mean.reshape(2, count))
        blocks = covariance.reshape(2, count, 2, count)
        covariances.append(np.einsum("injn->nij", blocks))
    place = place.ravel()
    return np.concatenate(means, axis=1)[:, place], np.concatenate(covariances)[place]
