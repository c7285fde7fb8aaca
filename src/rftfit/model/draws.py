"""Random draws of an alpha table within its errors, intervals from draws, and names of the columns of intervals.

An alpha table has a row for each cell: ``beta_deg``, ``gamma_deg`` and for each component z and x the columns
``alpha_z_N_per_cm3``, its ends ``alpha_z_lo_...`` and ``alpha_z_hi_...``, its standard error ``alpha_z_se_...`` and a
part of that error for each source of `SOURCES`. Arrays of draws have the draws on their first axis.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.alpha import column, directions
from rftfit.measure.errors import SOURCES
from rftfit.measure.slopes import GIVEN_DOF, normal_quantile, student_quantile
from rftfit.model.common_errors import common_errors, equivalent_rows, error_sizes
from rftfit.model.profiles import TableProfile
from rftfit.model.symmetry import torus

if TYPE_CHECKING:
    from rftfit.campaign.config import Config

DRAWS = 1000
"""Draws behind an interval of a map, and of a prediction of a profile without draws; a campaign's own tables have
`fourier.draws` of the config."""

SEED_OF_MAPS, SEED_OF_MODEL_ERRORS, SEED_OF_SLIP_SINKAGE = 2013, 28, 73
"""Seeds of draws that a config states none for: `fourier.seed` is that of a campaign's own tables alone.

Errors that are added to one another have different seeds: with one seed their normal numbers would be the same.
"""


def alpha_draws(
    table: pd.DataFrame, draws: int, seed: int, confidence: float, only: str = ""
) -> tuple[FloatArray, FloatArray]:
    """Draw alpha tables of one medium from their errors (parametric bootstrap).

    Every run is a separate experiment, so the errors of cells are independent except for those that cells share
    (`common_errors`). The rows beta = -90 and +90 degrees are one plate and have the same error. The same
    medium and seed give the same draws, so that stages agree which draw separately.

    `confidence`: level of the intervals of the table. `only`: name of one error of `SOURCES`, which alone is drawn;
    empty: all errors. Returns alpha_z and alpha_x in the n cells of the table, each of shape (draws, n), N/cm^3; NaN in
    cells without a run or an error.
    """
    medium = str(table["medium"].iloc[0])
    random = np.random.default_rng([seed, zlib.crc32(medium.encode())])
    draws_by_component = []
    # random numbers are assigned in the order of directions, so that the order of the rows has no effect
    order = table.reset_index().sort_values(["beta_deg", "gamma_deg"]).index.to_numpy()
    equivalent = equivalent_rows(table)
    shared = common_errors(table)
    random_of_shared = random.spawn(1)[0]
    shared_draws = {source: error.draw(draws, random_of_shared) for source, error in shared.items()}
    for component in COMPONENTS:
        centre, low, high, se = (
            table[column(component, end)].to_numpy(float) for end in ("", "_lo", "_hi", "_se")
        )
        half = (high - low) / 2
        # Student's over the normal quantile: draws become as wide as the interval, which has few degrees of freedom
        normal_half = half / normal_quantile(confidence)
        student_factor = np.divide(normal_half, se, where=se > 0, out=0 * se)
        # what remains of the variance of a cell without the errors that it shares
        variance_alone = se**2
        for error in shared.values():
            variance_alone = variance_alone - error.size[component] ** 2
        if only:
            # a shared source is drawn below, with the others that are shared
            size = 0 * se if only in shared else error_sizes(table, only)[component]
            variance_alone = size**2
        noise = np.empty((draws, centre.size))
        noise[:, order] = random.standard_normal(noise.shape)
        error_drawn = np.sqrt(np.maximum(variance_alone, 0.0)) * noise[:, equivalent]
        for source, drawn in shared_draws.items():
            if only in ("", source):
                error_drawn += drawn[component]
        draws_by_component.append(centre + student_factor * error_drawn)
    return draws_by_component[0], draws_by_component[1]


def errors_behind(
    table: pd.DataFrame,
    config: Config,
    quantity: Callable[[tuple[FloatArray, FloatArray]], FloatArray],
) -> dict[str, FloatArray]:
    """Return the standard deviation of quantities linear in alpha that each source of error causes, by its name.

    So a report can say which error makes an interval wide. `quantity`: function that takes what `alpha_draws` returns
    and returns quantities of shape (..., draws). The standard deviations have shape (...). Sources of `SOURCES` that
    the table does not have are left out.
    """
    seed, level = config.fourier.seed, config.fit.confidence
    # enough for the share of a variance to some percent
    draws = 400
    return {
        name: quantity(alpha_draws(table, draws, seed, level, only=name)).std(ddof=1, axis=-1)
        for name in SOURCES
        if any(size.any() for size in error_sizes(table, name).values())
    }


def draw_as_configured(table: pd.DataFrame, config: Config) -> tuple[FloatArray, FloatArray]:
    """Return `alpha_draws` of a table with the number of draws, the seed and the confidence of a campaign."""
    settings = config.fourier
    return alpha_draws(table, settings.draws, settings.seed, config.fit.confidence)


def measured_profile(
    table: pd.DataFrame, config: Config, name: str = "measured table", *, draws: bool = True
) -> TableProfile:
    """Make the profile of an alpha table; its `spread` is draws within its errors, NaN where alpha has no error.

    `draws`: False leaves the spread out, which saves time. The spread is None, too, where no alpha has an error.
    """
    profile = TableProfile.from_table(table, name)
    errors = table[[column(c, "_hi") for c in COMPONENTS]].notna().to_numpy()
    # scattered directions are triangulated: if some had no draws, the triangles of draws and alpha would differ
    triangles_differ = profile.scattered and not errors_known(table)
    if not draws or not errors.any() or triangles_differ:
        return profile
    # shape (2, draws, n)
    alpha = np.stack(draw_as_configured(table, config))
    lacks_draws = np.isnan(alpha).any(axis=(0, 1)) & table[column("z")].notna().to_numpy()
    # the profile has the mean of a direction and its mirror image, whose error is known only if both have one
    cells = torus(*directions(table)).cell
    cells_without = cells[(lacks_draws[cells] & (cells >= 0)).any(axis=1)]
    alpha[..., cells_without[cells_without >= 0]] = np.nan
    profile.spread = TableProfile(alpha[0], alpha[1], *directions(table))
    return profile


def errors_known(table: pd.DataFrame) -> bool:
    """Return True if every alpha of a table has an interval: without them draws would know an alpha exactly.

    A table of another lab may lack some.
    """
    return all(
        bool((table[column(c, "_hi")].notna() | table[column(c)].isna()).all()) for c in COMPONENTS
    )


def typical_dof(table: pd.DataFrame, confidence: float) -> float:
    """Return the median degrees of freedom behind the intervals of an alpha table, at most 1e6; NaN without intervals.

    They follow from half an interval over its standard error, which is a quantile of Student's t. `confidence`: level
    of the intervals.
    """
    from scipy.special import stdtridf

    ratios = []
    for component in COMPONENTS:
        half = table[column(component, "_hi")] - table[column(component, "_lo")]
        ratios.append((half / 2 / table[column(component, "_se")]).to_numpy(float))
    ratio = np.concatenate(ratios)
    ratio = ratio[np.isfinite(ratio)]
    if ratio.size == 0:
        return float("nan")
    median = float(np.median(ratio))
    # the quantile of a normal distribution means infinitely many, for which `stdtridf` has no answer
    if median <= 1.00001 * normal_quantile(confidence):
        return GIVEN_DOF
    return float(min(stdtridf(0.5 + confidence / 2, median), GIVEN_DOF))


def interval_of_sum(
    terms: Sequence[FloatArray], dofs: Sequence[float], confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper end of the percentile interval of a sum of independent terms, each of shape (draws, ...).

    The draws of a term are as wide as the Student interval of its few degrees of freedom, in `dofs`, one for each term
    (`typical_dof`). The sum has more degrees of freedom, (sum v)^2 / sum(v^2 / dof) of the variances v of its terms
    (Welch and Satterthwaite), so its interval is narrowed about its middle.
    """
    normal = normal_quantile(confidence)
    lo, hi = interval(sum(terms[1:]) + terms[0], confidence)
    dof = np.array(dofs)
    student_factors = student_quantile(confidence, dof) / normal
    variance_drawn = np.stack([term.var(axis=0) for term in terms])
    # numbers of the terms stand along the first axis
    shape = (-1, *[1] * (variance_drawn.ndim - 1))
    # variances of the terms themselves, without Student's factor
    variance = variance_drawn / student_factors.reshape(shape) ** 2
    total = variance.sum(axis=0)
    safe_total = np.where(total > 0, total, 1.0)
    inverse_dof = ((variance / safe_total) ** 2 / dof.reshape(shape)).sum(axis=0)
    dof_of_sum = 1 / np.maximum(inverse_dof, 1 / GIVEN_DOF)
    student_factor_of_sum = student_quantile(confidence, dof_of_sum) / normal
    factor_drawn = np.sqrt(np.where(total > 0, variance_drawn.sum(axis=0) / safe_total, 1.0))
    middle = (lo + hi) / 2
    half = (hi - lo) / 2 * student_factor_of_sum / factor_drawn
    return middle - half, middle + half


def interval(draws: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper end of the percentile interval of draws (draws, ...), each (...); NaN where one is NaN.

    The quantiles are those of `numpy.quantile`, linear between two draws. This is several times faster, because the
    draws of one number are sorted where they lie side by side in memory.
    """
    tail = (1 - confidence) / 2
    ordered = np.moveaxis(np.asarray(draws, dtype=float), 0, -1).copy()
    ordered.sort(axis=-1)
    unknown = np.isnan(ordered[..., -1])
    lo, hi = (np.where(unknown, np.nan, _quantile(ordered, share)) for share in (tail, 1 - tail))
    # [()] makes a number of an array without axes
    return lo[()], hi[()]


def _quantile(ordered: FloatArray, share: float) -> FloatArray:
    """Return the quantile at a share of 0 to 1 of draws (..., draws) in ascending order along the last axis, (...)."""
    last = ordered.shape[-1] - 1
    below = math.floor(share * last)
    low, high = ordered[..., below], ordered[..., min(below + 1, last)]
    fraction = share * last - below
    # calculated from the nearer draw, so that between equal draws no rounding changes the value
    gap = high - low
    return np.asarray(low + gap * fraction if fraction < 0.5 else high - gap * (1 - fraction))


def widen(best: Any, ends: tuple[Any, Any], half: Any) -> tuple[Any, Any]:
    """Return the ends of an interval about a best number or array, widened by an independent error.

    Independent errors add in squares, to either side of `best`. `ends`: lower and upper end. `half`: half width of that
    error, or the distances of both its ends from `best`, (2, ...). NaN if one is NaN.
    """
    below, above = np.hypot(np.subtract(ends, best), half)
    return best - below, best + above


def end_names(quantity: str, of: str = "") -> tuple[str, str]:
    """Return the columns of the ends of an interval: of ``force_z_N`` ``force_z_lo_N`` and ``force_z_hi_N``.

    `of`: what the interval contains, before the ends: empty for alpha, ``next_`` for the next bed, ``model_`` for the
    model's own error.
    """
    # the unit begins with the last _N of the name, as in moment_N_cm, or with _cm
    what, newton_or_cm, unit = quantity.rpartition("_N" if "_N" in quantity else "_cm")
    return f"{what}_{of}lo{newton_or_cm}{unit}", f"{what}_{of}hi{newton_or_cm}{unit}"


next_end_names = partial(end_names, of="next_")
"""Names of the columns of the interval of the next bed: ``force_z_next_lo_N`` and ``force_z_next_hi_N``."""

model_end_names = partial(end_names, of="model_")
"""Names of the columns of the interval with the model's own error: ``force_z_model_lo_N`` and ``force_z_model_hi_N``."""


def beside_name(quantity: str) -> str:
    """Return the column of a force by table or map, beside that by nine terms: of ``force_z_N`` ``force_z_beside_N``."""
    what, unit = quantity.rsplit("_N", maxsplit=1)
    return f"{what}_beside_N{unit}"


def choose_evenly(count: int, most: int) -> npt.NDArray[np.intp]:
    """Return at most `most` of the indices below `count`, evenly spaced, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))
