"""Errors of alpha by name: of one log, from run to run, and common to many runs.

What a log shows of itself (noise, zero, clocks, start-up) is the business of `rftfit.measure.slopes`.
Here are the errors that no single log shows: the free surface, the angles, the bed, the tare.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.measure.repeats import (
    Repeats,
    RunScatter,
    along_and_across,
    scatter_of_repeats,
    usual_scatter,
)
from rftfit.measure.slopes import GIVEN_DOF, student_quantile

if TYPE_CHECKING:
    from rftfit.campaign.config import Config, ErrorSettings

Source = Literal[
    "noise", "startup", "surface", "angle", "bed", "curvature", "tare", "rod", "session", "turn"
]
"""Names of the errors, as in the columns of an alpha table.

noise: of the run's own log, with its zero and clocks; startup: what the start-up of a horizontal run
left; surface, angle: of a run; bed: from one prepared bed to the next; curvature: of a run whose
stress is no line; tare: noise and zero of the tares, common to the runs that share one; rod: of the bed that rods alone
are pushed into, common to all runs of a medium; session: of the surface
and of estimated clocks, common to all runs of a medium; turn: of the mount, likewise.
"""

SOURCES: tuple[str, ...] = get_args(Source)

LEAST_DOF = 5
"""With fewer repeats than this, their spread is not used for the runs of other cells."""

AS_PREPARED, REPEATS = "scatter between beds not included", "repeats"
STATED, ASSUMED = "stated", "assumed"
FEW_REPEATS = "few repeats"
"""Source of a spread that is assumed, moderated by the repeats of all cells."""

OF_CELL = "repeats of the cell"
"""Source of a spread that only the scatter of the few runs of this cell shows."""


@dataclass(frozen=True)
class Part:
    """One error of a number: its standard deviation, with the sign of a common cause, and its dof."""

    sd: float
    dof: float = GIVEN_DOF


def combined_half_width(parts: Iterable[Part], confidence: float) -> float:
    """Half width of an interval from independent errors of different degrees of freedom.

    Half widths, each with its own quantile, add in quadrature: never narrower for a larger error,
    and covering at least as often as stated (Banerjee, Sankhya 22, 357, 1960).
    """
    return math.sqrt(
        sum((_quantile(confidence, error.dof) * error.sd) ** 2 for error in parts if error.sd)
    )


@lru_cache(maxsize=512)
def _quantile(confidence: float, dof: float) -> float:
    return float(student_quantile(confidence, dof))


@dataclass(frozen=True)
class Spread:
    """How alpha differs from one prepared bed to the next, beyond what the errors of the single runs explain.

    Attributes
    ----------
    constant, relative : float
        Standard deviations of each component, N/cm^3 and relative to it, where they are stated or assumed.
    scatter : RunScatter or None
        How repeats scatter, where they tell it.
    largest : float
        Largest force of the medium, N/cm^3.
    source : str
        `REPEATS` of the run sheet, `STATED` in the config, `FEW_REPEATS`, `ASSUMED`: none of these, or `AS_PREPARED`: stated
        to be none.
    """

    constant: float = 0.0
    relative: float = 0.0
    scatter: RunScatter | None = None
    largest: float = 0.0
    source: str = AS_PREPARED

    def error_at(self, alpha: FloatArray, component: int) -> Part:
        """Error of a component, N/cm^3, of a bed whose alpha is `alpha`, shape (2,); x counts as 0 where it is NaN."""
        if math.isnan(alpha[component]):
            return Part(math.nan)
        if self.scatter is None:
            return Part(math.hypot(self.constant, self.relative * alpha[component]))
        variance, dof = self.scatter.variance_at(np.nan_to_num(alpha), component, self.largest)
        return Part(math.sqrt(variance), min(max(dof, _VAGUE_DOF), GIVEN_DOF))


_VAGUE_DOF = 2.0
"""Of a spread at an alpha that no repeat is near: it is a fit with an error, no sample variance, and
below so many degrees of freedom quantiles grow without limit while the coverage stays the same."""

USUAL_BED_SPREAD = 0.05
"""Relative standard deviation of the force from one bed to the next where nothing is known: beds poured or tapped by hand."""


def half_width_of_bed(spread: float, confidence: float) -> float:
    """Half the interval of a bed, relative, from the standard deviation between beds."""
    return NormalDist().inv_cdf(0.5 + confidence / 2) * spread


USUAL_BEDS = Spread(relative=USUAL_BED_SPREAD, source=ASSUMED)

_USUAL_ACROSS = 0.015
"""Relative standard deviation across the force that goes with `USUAL_BED_SPREAD`."""

ASSUMED_DOF = 2.0
"""Degrees of freedom that the assumed spread counts for: with them about 92 % or more of the cells are covered in beds that
differ by 3 to 8 %, Student's t with 3 degrees of freedom among them (``tests/trust/test_trust_repeats.py``)."""

Group = tuple["FloatArray", "FloatArray"]
"""alpha and standard error, N/cm^3, of the runs of one cell (and depth): z and x, shape (2, runs); NaN where not measured."""


def spread_of_beds(groups: Sequence[Group], stated: tuple[float, float] | None = None) -> Spread:
    """Find how beds differ from repeats, else from what is stated (N/cm^3, and relative), else from few repeats, else assume it.

    Repeats alone count if they have `LEAST_DOF` degrees of freedom. Fewer moderate an assumed scatter, whose prior is inverse
    chi-square, as in G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3, 3 (2004).
    """
    # a table may state no errors
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
            return USUAL_BEDS
    means = (np.nan_to_num(alpha.mean(axis=1)) for alpha, _ in groups)
    largest = max(float(np.hypot(*mean)) for mean in means)
    repeats = _repeats_of(repeated, largest)
    if dof < LEAST_DOF:
        usual = usual_scatter(USUAL_BED_SPREAD, _USUAL_ACROSS)
        scatter, source = scatter_of_repeats(repeats, usual, ASSUMED_DOF), FEW_REPEATS
    else:
        scatter, source = scatter_of_repeats(repeats), REPEATS
    return Spread(scatter=scatter, largest=largest, source=source)


def _repeats_of(groups: Sequence[Group], largest: float) -> Repeats:
    """Squares of the runs of each cell about their mean."""
    squares, sizes, x_known = [], [], []
    for alpha, se in groups:
        is_known = np.isfinite(alpha).all(axis=1).reshape(2, 1)
        # a component that one of the runs lacks tells nothing
        known_alpha = np.where(is_known, alpha, 0.0)
        squares.append(along_and_across(known_alpha, np.where(is_known, se**2, 0.0)))
        sizes.append(float(np.hypot(*known_alpha.mean(axis=1))))
        x_known.append(bool(is_known.all()))
    along, across, noise_along, noise_across = np.array(squares).T
    return Repeats(
        dof=np.array([alpha.shape[1] - 1.0 for alpha, _ in groups]),
        along=along,
        across=across,
        across_known=np.array(x_known),
        noise_along=noise_along,
        noise_across=noise_across,
        size=np.array(sizes),
        largest=np.full(len(groups), largest),
    )


def bed_of_mean(
    alpha: FloatArray,
    share: FloatArray,
    noise: Part,
    bed_error: Part,
    source: str,
    *,
    shown_by_runs: bool = True,
) -> tuple[Part, Part, str]:
    """Error of a mean of runs by how their beds differ: noise, bed, and where that is known from.

    Where the spread is not known, or from few repeats, the scatter of these runs (`shown_by_runs`: where they are repeats of one
    another) counts if it is larger than what is assumed and than their `noise`, which is then in it. `alpha`,
    `share` (n,): of the runs, N/cm^3, and their shares in the mean. `bed_error`: of one bed, known from `source`.
    """
    n = alpha.size
    expected = Part(bed_error.sd * math.sqrt(float(share @ share)), bed_error.dof)
    # a table may state no errors: then none is made up of rows that stand in it twice
    if source in (REPEATS, STATED) or n < 2 or not shown_by_runs or math.isnan(noise.sd):
        return noise, expected, source
    between = math.sqrt(float(alpha.var(ddof=1)) / n)
    if between <= math.hypot(noise.sd, expected.sd):
        return noise, expected, OF_CELL if source == AS_PREPARED else source
    return Part(0.0), Part(between, scatter_of_runs(alpha).dof), OF_CELL


def scatter_of_runs(alpha: FloatArray) -> Part:
    """Error of one run by the scatter of the few runs of a cell, `alpha` (n,), N/cm^3.

    Two runs have one degree of freedom, and an interval of 12.7 standard errors. What is known of the beds of other
    laboratories counts for `ASSUMED_DOF`: so many degrees of freedom the scatter has at least, and its size is its own.
    """
    return Part(float(alpha.std(ddof=1)), max(alpha.size - 1.0, ASSUMED_DOF))


def bed_of_next(alpha: FloatArray, bed_error: Part, confidence: float, *, scatter: bool) -> Part:
    """Error of one further prepared bed, where that of a bed is `bed_error`.

    `alpha` (n,): of the runs of the cell; `scatter`: whether what they show counts if it is larger, as in `bed_of_mean`.
    """
    if not scatter:
        return bed_error
    return max(
        scatter_of_runs(alpha),
        bed_error,
        key=lambda error: combined_half_width([error], confidence),
    )


PRIOR_CM, PRIOR_RUNS = 0.1, 5
"""A bed that is levelled by hand: 1 mm, as good as known from `PRIOR_RUNS` runs."""

_CLEAR_CM = 0.1
"""An offset with a larger error than this says nothing of the surface."""


@dataclass(frozen=True)
class SurfaceError:
    """Standard deviations of the free surface, cm: from run to run, with `dof`, and common to a medium's runs."""

    run: float = 0.0
    session: float = 0.0
    dof: float = GIVEN_DOF


def surface_error(
    offset: FloatArray, se: FloatArray, errors: ErrorSettings, *, is_given: bool = True
) -> SurfaceError:
    """Tell how far the free surface may be off, as stated, or else from lines with a free intercept.

    Such a line meets zero stress at an `offset` (cm, by run) from the surface that was used. The scatter
    of the offsets is the surface's error from run to run, their median the error that all runs share; a
    stress that is not linear moves them too, and then the intervals hold what that does to the line
    through zero. Fewer than `PRIOR_RUNS` runs are filled up with the prior. Without `is_given` the surface
    was found in each run, whose error has it already.
    """
    clear = np.isfinite(offset) & (se <= _CLEAR_CM)
    offset, noise = offset[clear], se[clear] ** 2
    n = int(offset.size)
    run, session, dof = 0.0, 0.0, GIVEN_DOF
    if is_given and n >= PRIOR_RUNS:
        median = float(np.median(offset))
        # as a robust standard deviation: some directions are curved for reasons of their own
        scatter = 1.4826 * float(np.median(np.abs(offset - median)))
        run = math.sqrt(max(scatter**2 - float(np.median(noise)), 0.0))
        common = math.pi / 2 * max(scatter**2, float(np.median(noise))) / n
        session = math.sqrt(max(median**2 - common, 0.0))
        dof = max(0.37 * (n - 1), 3.0)
    elif is_given:
        excess_square = float(np.maximum(offset**2 - noise, 0.0).sum())
        run = math.sqrt((excess_square + (PRIOR_RUNS - n) * PRIOR_CM**2) / PRIOR_RUNS)
        dof = PRIOR_RUNS
    if errors.surface_run_mm is not None:
        run, dof = errors.surface_run_mm / 10, GIVEN_DOF
    if errors.surface_session_mm is not None:
        session = errors.surface_session_mm / 10
    return SurfaceError(run, session, dof)


def errors_of(
    fits: pd.DataFrame, config: Config, explained_cm: FloatArray | float = 0.0
) -> tuple[ErrorSettings, SurfaceError]:
    """Errors that no log shows, for the runs of one medium (`fit_medium`).

    `explained_cm`: shape (runs,); Part of the offsets of the runs that no error of the surface has caused, cm.
    """
    if config.table is not None:
        # its depths and angles are what it says, and so are its errors
        no_errors = {"angle_deg": 0, "turn_deg": 0, "tare_percent": 0}
        if config.errors.bed is None:
            no_errors["bed_percent"] = 0
        return config.errors.model_copy(update=no_errors), SurfaceError()
    offset, se = (fits[name].to_numpy(float) for name in ("offset_cm", "offset_se_cm"))
    is_given = config.surface.method == "given"
    offset = offset - explained_cm
    return config.errors, surface_error(offset, se, config.errors, is_given=is_given)


NEAR_DEG = 45.0
"""Directions within this are neighbours."""

_ACROSS = 0.01
"""Neighbours that leave one line by less, in squares, tell nothing of what lies across it."""

Slopes = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Beta and gamma, (n,), degrees, to a known shape of z and x, (2, n), and its change per degree, (2, n, 2)."""


def scaled_slopes(
    shape: Slopes | None, beta_deg: FloatArray, gamma_deg: FloatArray, alpha: FloatArray
) -> FloatArray:
    """Slopes of a known shape, scaled to a medium's `alpha` (2, n), N/cm^3 per degree, (2, n, 2); 0 without one."""
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
    """Change of a quantity with beta and gamma, per degree, from neighbours: shape (n, 2).

    Least squares of the differences to all neighbours, nearer ones with more weight; along a way in
    which there is none, that of `elsewhere`, (n, 2).
    """
    step = np.stack(
        [(beta_deg - beta_deg[:, None] + 90) % 180 - 90, gamma_deg - gamma_deg[:, None]]
    )
    distance = np.hypot(*step)
    is_near = (distance > 0) & (distance <= NEAR_DEG) & np.isfinite(values)
    weight = np.where(is_near, 1 / np.maximum(distance, 1.0) ** 2, 0.0)
    rise = np.where(is_near, values - values[:, None], 0.0)
    square = np.einsum("nm,inm,jnm->nij", weight, step, step)
    target = np.einsum("nm,inm,nm->ni", weight, step, rise)
    inverse = np.linalg.pinv(square, rcond=_ACROSS, hermitian=True)
    elsewhere = np.broadcast_to(elsewhere, target.shape)
    residual = target - np.einsum("nij,nj->ni", square, elsewhere)
    return np.asarray(elsewhere + np.einsum("nij,nj->ni", inverse, residual))


def shares(parts: Mapping[str, float | FloatArray]) -> str:
    """Variance of each error relative to that of all, in words: ``surface 52 %, bed 31 %, noise 2 %``."""
    total = sum(float(sd) ** 2 for sd in parts.values())
    if not total > 0:
        return ""
    sizes = {name: 100 * float(sd) ** 2 / total for name, sd in parts.items()}
    by_size = sorted(sizes, key=lambda name: -sizes[name])
    return ", ".join(f"{name} {sizes[name]:.0f} %" for name in by_size if sizes[name] >= 0.5)
