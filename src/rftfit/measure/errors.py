"""Errors of alpha by name: those that no log shows (surface, angles, beds), and the interval by all of them.

`rftfit.measure.slopes` estimates the errors that a log itself shows: noise, zero, clocks, start-up. This module adds
the errors that no single log shows: the free surface (`surface_error`), the angles (`gradient`), the bed
(`spread_of_beds`, `bed_of_mean`, `bed_of_next`), and joins errors to an interval (`combined_half_width`).

Alpha and its errors are in N/cm^3, with z, then x, where an array has two rows. A *cell* is the runs of one direction
(beta, gamma). *Beds* are prepared anew for each run and differ in density, so repeats differ by more than their logs
show.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.directions import beta_apart
from rftfit.measure.levels import sd_by_median
from rftfit.measure.repeats import (
    Repeats,
    RunScatter,
    along_and_across,
    scatter_of_repeats,
    usual_scatter,
)
from rftfit.measure.slopes import GIVEN_DOF, normal_quantile, student_quantile
from rftfit.store.chosen import chosen

if TYPE_CHECKING:
    from rftfit.campaign.config import Config, ErrorSettings

Source = Literal[
    "noise", "startup", "surface", "angle", "bed", "curvature", "tare", "rod", "session", "turn"
]
"""Names of the errors, as in the columns of an alpha table.

noise: noise of the run's log, with its zero and clocks
startup: remaining effect of the start-up of a horizontal run
surface, angle: error of the free surface and of the plate's angle in one run
bed: difference from one prepared bed to the next
curvature: stress that is no line of depth
tare: noise and zero of the tares, common to the runs that share a tare
rod: bed into which rods alone are pushed, common to all runs of a medium
session: surface and estimated clocks, common to all runs of a medium
turn: turn of the mount, common to all runs of a medium
"""

SOURCES: tuple[str, ...] = get_args(Source)

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `errors`, says what each decides
_CHOSEN = chosen("measure", "errors")

LEAST_DOF: int = _CHOSEN.least_dof
"""Fewest degrees of freedom with which the spread of repeats alone is used for all cells."""

AS_PREPARED, REPEATS = "scatter between beds not included", "repeats"
STATED, ASSUMED = "stated", "assumed"
FEW_REPEATS = "few repeats"
"""How the difference between beds is known: column `spread` of an alpha table, explained at `Spread.source`."""

OF_CELL = "repeats of the cell"
"""The same where it is the scatter of the few runs of this cell alone."""


@dataclass(frozen=True)
class ErrorTerm:
    """One independent error of a number: its standard deviation `sd`, and the degrees of freedom of that estimate.

    `sd` may be negative: errors with a common cause in several numbers have signs relative to each other.
    """

    sd: float
    dof: float = GIVEN_DOF


def combined_half_width(errors: Iterable[ErrorTerm], confidence: float) -> float:
    """Half width of the interval of a number with independent errors; `confidence`: 0 to 1.

    sqrt(sum (t sd)^2), with the quantile t of Student's t for the degrees of freedom of each error: never narrower for
    a larger error, and covering at least as often as stated (Banerjee, Sankhya 22, 357, 1960).
    """
    return math.sqrt(
        sum((_quantile(confidence, error.dof) * error.sd) ** 2 for error in errors if error.sd)
    )


def wider(first: ErrorTerm, second: ErrorTerm, confidence: float) -> ErrorTerm:
    """Return the error with the wider interval at this `confidence`; the first one if both are equal."""
    return max(first, second, key=lambda error: combined_half_width([error], confidence))


def without_included(
    error: ErrorTerm, included: Iterable[ErrorTerm], confidence: float
) -> ErrorTerm:
    """Subtract from an error others that its estimate includes, so that they do not count twice.

    With them it then has the half width of the wider of both: its own as estimated, or theirs alone.
    """
    quantile = _quantile(confidence, error.dof)
    square = (quantile * error.sd) ** 2 - combined_half_width(included, confidence) ** 2
    return ErrorTerm(math.sqrt(max(square, 0.0)) / quantile, error.dof)


@lru_cache(maxsize=512)
def _quantile(confidence: float, dof: float) -> float:
    """Half width of a two-sided interval of Student's t, in standard errors; cached, as many cells need the same."""
    return float(student_quantile(confidence, dof))


@dataclass(frozen=True)
class Spread:
    """Differences of alpha between prepared beds, beyond those that errors of single runs explain.

    Attributes
    ----------
    constant, relative : float
        Standard deviations of each component, in N/cm^3 and relative to the component, where they are stated or
        assumed; unused where there is `scatter`.
    scatter : RunScatter or None
        Scatter of repeats, where there are any.
    largest : float
        Largest alpha (length of z and x) of the medium, N/cm^3.
    source : str
        How the spread is known: `REPEATS` of the run sheet; `STATED` in the config; `FEW_REPEATS`, which an assumed spread
        supplements; `ASSUMED` without any of these; or `AS_PREPARED`, where the config states that no spread is included.
    """

    constant: float = 0.0
    relative: float = 0.0
    scatter: RunScatter | None = None
    largest: float = 0.0
    source: str = AS_PREPARED

    def error_at(self, alpha: FloatArray, component: int) -> ErrorTerm:
        """Error of a component by the bed, N/cm^3, where the medium has `alpha`, shape (2,): z and x.

        `component`: 0 for z, 1 for x. An unknown other component counts as 0.
        """
        if math.isnan(alpha[component]):
            return ErrorTerm(math.nan)
        if self.scatter is None:
            return ErrorTerm(math.hypot(self.constant, self.relative * alpha[component]))
        variance, dof = self.scatter.variance_at(np.nan_to_num(alpha), component, self.largest)
        return ErrorTerm(math.sqrt(variance), min(max(dof, _CHOSEN.vague_dof), GIVEN_DOF))


USUAL_BED_SPREAD: float = _CHOSEN.usual_bed_spread
"""Relative standard deviation of the force between beds poured or tapped by hand, assumed where nothing is known."""


def half_width_of_bed(spread: float, confidence: float) -> float:
    """Half width of the interval of a bed, relative, from the relative standard deviation between beds."""
    return normal_quantile(confidence) * spread


RepeatedRuns = tuple[FloatArray, FloatArray]
"""alpha and its standard error, N/cm^3, of the runs of one cell and depth; z and x, shape (2, runs), NaN if unknown."""


def spread_of_beds(
    groups: Sequence[RepeatedRuns], stated: tuple[float, float] | None = None
) -> Spread:
    """Estimate how alpha differs between beds, from the first of these that there is; `groups`: the runs of each cell.

    1. Repeats with at least `LEAST_DOF` degrees of freedom.
    2. `stated`: standard deviations of the config, N/cm^3 and relative.
    3. Fewer repeats, combined with an assumed scatter whose prior is inverse chi-square, as in G. K. Smyth, Stat. Appl.
       Genet. Mol. Biol. 3, 3 (2004).
    4. The assumed spread alone.
    """
    # a table may state no errors: repeats without errors do not count
    repeated = [
        (alpha, se)
        for alpha, se in groups
        if alpha.shape[1] > 1
        and np.isfinite(alpha).all(axis=1).any()
        and not np.isnan(se[np.isfinite(alpha)]).any()
    ]
    dof = sum(alpha.shape[1] - 1 for alpha, _ in repeated)
    if dof < LEAST_DOF:
        if stated:
            constant, relative = stated
            return Spread(constant, relative, source=STATED if any(stated) else AS_PREPARED)
        if not dof:
            return Spread(relative=USUAL_BED_SPREAD, source=ASSUMED)
    means = (np.nan_to_num(alpha.mean(axis=1)) for alpha, _ in groups)
    largest = max(float(np.hypot(*mean)) for mean in means)
    repeats = _make_repeats(repeated, largest)
    if dof < LEAST_DOF:
        usual = usual_scatter(USUAL_BED_SPREAD, _CHOSEN.usual_across)
        scatter, source = scatter_of_repeats(repeats, usual, _CHOSEN.assumed_dof), FEW_REPEATS
    else:
        scatter, source = scatter_of_repeats(repeats), REPEATS
    return Spread(scatter=scatter, largest=largest, source=source)


def _make_repeats(groups: Sequence[RepeatedRuns], largest: float) -> Repeats:
    """Make the `Repeats` of some cells: squares of the differences of their runs, along the mean force and across it.

    `largest`: Largest alpha of the medium, N/cm^3.
    """
    squares, sizes, has_both = [], [], []
    for alpha, se in groups:
        is_measured = np.isfinite(alpha).all(axis=1).reshape(2, 1)
        # a component that any of the runs lacks counts as 0
        measured_alpha = np.where(is_measured, alpha, 0.0)
        squares.append(along_and_across(measured_alpha, np.where(is_measured, se**2, 0.0)))
        sizes.append(float(np.hypot(*measured_alpha.mean(axis=1))))
        has_both.append(bool(is_measured.all()))
    along, across, noise_along, noise_across = np.array(squares).T
    return Repeats(
        dof=np.array([alpha.shape[1] - 1.0 for alpha, _ in groups]),
        along=along,
        across=across,
        across_known=np.array(has_both),
        noise_along=noise_along,
        noise_across=noise_across,
        size=np.array(sizes),
        largest=np.full(len(groups), largest),
    )


def bed_of_mean(
    alpha: FloatArray,
    weights: FloatArray,
    noise: ErrorTerm,
    bed_error: ErrorTerm,
    source: str,
    *,
    shown_by_runs: bool = True,
) -> tuple[ErrorTerm, ErrorTerm, str]:
    """Return the errors of a mean of runs by noise and by beds, and the source of the latter (`OF_CELL` or `source`).

    Where the spread is assumed or comes from few repeats, the scatter of these runs counts instead, if it is larger
    than the assumed spread and the noise together. This scatter includes the noise, which is then returned as 0.

    `alpha`, `weights`: alpha of the n runs, N/cm^3, and their weights in the mean, shape (n,).
    `noise`: Error of the mean by the noise of the logs.
    `bed_error`, `source`: Error of a single bed, and how it is known, of a `Spread`.
    `shown_by_runs`: False where the runs are no repeats of one another, as level runs at several depths.
    """
    n = alpha.size
    expected = ErrorTerm(bed_error.sd * math.sqrt(float(weights @ weights)), bed_error.dof)
    # a table may state no errors: then rows that stand in it twice do not make one
    if source in (REPEATS, STATED) or n < 2 or not shown_by_runs or math.isnan(noise.sd):
        return noise, expected, source
    between = math.sqrt(float(alpha.var(ddof=1)) / n)
    if between <= math.hypot(noise.sd, expected.sd):
        return noise, expected, OF_CELL if source == AS_PREPARED else source
    return ErrorTerm(0.0), ErrorTerm(between, scatter_of_runs(alpha).dof), OF_CELL


def scatter_of_runs(alpha: FloatArray) -> ErrorTerm:
    """Error of one run, from the scatter of the few runs of a cell: `alpha` (n,), N/cm^3.

    Two runs have one degree of freedom, which makes an interval of 12.7 standard errors. Since beds of other
    laboratories are known, the scatter has at least two degrees of freedom; its size comes from these runs
    alone.
    """
    return ErrorTerm(float(alpha.std(ddof=1)), max(alpha.size - 1.0, _CHOSEN.assumed_dof))


def bed_of_next(
    alpha: FloatArray, bed_error: ErrorTerm, confidence: float, *, scatter: bool
) -> ErrorTerm:
    """Error of one further run by its bed: `bed_error`, or with `scatter` the scatter of the runs, if that is larger.

    `alpha`: Alpha of the runs of the cell, N/cm^3, shape (n,). `scatter`: True where their scatter counts as the error
    of the mean too.
    """
    if not scatter:
        return bed_error
    return wider(scatter_of_runs(alpha), bed_error, confidence)


@dataclass(frozen=True)
class SurfaceError:
    """Standard deviations of the free surface, cm.

    `run`: From run to run, with `dof` degrees of freedom.
    `session`: Common to all runs of a medium.
    """

    run: float = 0.0
    session: float = 0.0
    dof: float = GIVEN_DOF


def surface_error(
    offset: FloatArray, se: FloatArray, errors: ErrorSettings, *, is_given: bool = True
) -> SurfaceError:
    """Estimate how far the free surface may be off, from the config or else from lines with a free intercept.

    Such a line reaches zero stress at an `offset` (cm, shape (runs,), standard error `se`) from the surface that was
    used. The scatter of the offsets is the surface's error from run to run; their median is the error that all runs
    share. A stress that is not linear moves the offsets too: then the intervals include its effect on the line through
    zero. Fewer than five runs are filled up with the prior.

    `is_given`: False where each run found its own surface, so that the error of the run already includes that of the
    surface.
    """
    is_clear = np.isfinite(offset) & (se <= _CHOSEN.clear_cm)
    offset, noise = offset[is_clear], se[is_clear] ** 2
    n, prior_runs = int(offset.size), _CHOSEN.prior_runs
    # standard deviations, cm, from run to run and common to all
    run, session, dof = 0.0, 0.0, GIVEN_DOF
    if is_given and n >= prior_runs:
        median = float(np.median(offset))
        # a robust standard deviation, as stress of some directions is curved
        scatter = float(sd_by_median(offset - median))
        usual_noise = float(np.median(noise))
        run = math.sqrt(max(scatter**2 - usual_noise, 0.0))
        # variance of the median of n normal numbers: pi / 2 times that of their mean
        variance_of_median = math.pi / 2 * max(scatter**2, usual_noise) / n
        session = math.sqrt(max(median**2 - variance_of_median, 0.0))
        # a standard deviation by the median has 0.37 times the degrees of freedom of a usual one
        dof = max(0.37 * (n - 1), 3.0)
    elif is_given:
        excess_square = float(np.maximum(offset**2 - noise, 0.0).sum())
        run = math.sqrt((excess_square + (prior_runs - n) * _CHOSEN.prior_cm**2) / prior_runs)
        dof = prior_runs
    if errors.surface_run_mm is not None:
        run, dof = errors.surface_run_mm / 10, GIVEN_DOF
    if errors.surface_session_mm is not None:
        session = errors.surface_session_mm / 10
    return SurfaceError(run, session, dof)


def errors_of(
    fits: pd.DataFrame, config: Config, explained_cm: FloatArray | float = 0.0
) -> tuple[ErrorSettings, SurfaceError]:
    """Return the errors that no log shows, for the runs of one medium: those of the config, and that of the surface.

    `fits`: Table of `fit_medium`.
    `explained_cm`: Offsets of the runs that the law of depth causes and not the surface, cm, shape (runs,).
    """
    if config.table is not None:
        # depths, angles and errors of a table are those that it states
        no_errors = {"angle_deg": 0, "turn_deg": 0, "tare_percent": 0}
        if config.errors.bed is None:
            no_errors["bed_percent"] = 0
        return config.errors.model_copy(update=no_errors), SurfaceError()
    offset = fits["offset_cm"].to_numpy(float) - explained_cm
    se = fits["offset_se_cm"].to_numpy(float)
    is_given = config.surface.method == "given"
    return config.errors, surface_error(offset, se, config.errors, is_given=is_given)


# --- How alpha changes with the angles, by which an error of an angle becomes one of alpha


Slopes = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Function of beta and gamma, degrees, shape (n,), that returns alpha (z and x) of a known profile, shape (2, n), and
its changes per degree of beta and gamma, shape (2, n, 2)."""


def scaled_slopes(
    shape: Slopes | None, beta_deg: FloatArray, gamma_deg: FloatArray, alpha: FloatArray
) -> FloatArray:
    """Changes of a known profile with beta and gamma, as large as those of `alpha`, N/cm^3 per degree, shape (2, n, 2).

    They serve where a direction has no neighbours from which its own changes follow. `shape`: The profile; None: all 0.
    `alpha`: z and x of n directions, shape (2, n); the profile is scaled to the sum of its sizes.
    """
    measured = np.isfinite(alpha)
    if shape is None or not measured.any():
        return np.zeros((*alpha.shape, 2))
    mean, slopes = shape(beta_deg, gamma_deg)
    total = float(np.abs(mean[measured]).sum())
    return slopes * (float(np.abs(alpha[measured]).sum()) / total if total > 0 else 0.0)


def gradient(
    beta_deg: FloatArray,
    gamma_deg: FloatArray,
    values: FloatArray,
    elsewhere: FloatArray | float = 0.0,
) -> FloatArray:
    """Change of `values`, shape (n,), with beta and gamma, per degree, from neighbouring directions: shape (n, 2).

    Least squares of the differences to all neighbours, nearer ones with more weight. In a direction in which there is
    no neighbour, the slope is that of `elsewhere`, shape (n, 2).
    """
    # rows: the direction whose gradient is wanted; columns: its neighbours
    step = np.stack([beta_apart(beta_deg, beta_deg[:, None]), gamma_deg - gamma_deg[:, None]])
    distance = np.hypot(*step)
    is_near = (distance > 0) & (distance <= _CHOSEN.near_deg) & np.isfinite(values)
    weight = np.where(is_near, 1 / np.maximum(distance, 1.0) ** 2, 0.0)
    rise = np.where(is_near, values - values[:, None], 0.0)
    # normal equations of each direction: square x gradient = target
    square = np.einsum("nm,inm,jnm->nij", weight, step, step)
    target = np.einsum("nm,inm,nm->ni", weight, step, rise)
    # singular where all neighbours lie in one direction: there the pseudo-inverse keeps `elsewhere`
    inverse = np.linalg.pinv(square, rcond=_CHOSEN.least_across, hermitian=True)
    elsewhere = np.broadcast_to(elsewhere, target.shape)
    residual = target - np.einsum("nij,nj->ni", square, elsewhere)
    return np.asarray(elsewhere + np.einsum("nij,nj->ni", inverse, residual))


def shares(sd_by_name: Mapping[str, float | FloatArray]) -> str:
    """Format the share of each error in the variance, the largest first: ``surface 52 %, bed 31 %, noise 2 %``.

    `sd_by_name`: Standard deviation of each error, in one unit. Shares below half a percent are left out.
    """
    total = sum(float(sd) ** 2 for sd in sd_by_name.values())
    if not total > 0:
        return ""
    percent = {name: 100 * float(sd) ** 2 / total for name, sd in sd_by_name.items()}
    by_size = sorted(percent, key=lambda name: -percent[name])
    return ", ".join(f"{name} {percent[name]:.0f} %" for name in by_size if percent[name] >= 0.5)
