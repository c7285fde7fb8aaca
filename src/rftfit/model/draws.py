"""Draws of the alpha table within its own errors, for the intervals of everything that follows."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.alpha import column, directions
from rftfit.measure.errors import SOURCES
from rftfit.model.common_errors import CommonError, common_errors, equivalent_rows, error_sizes
from rftfit.model.profiles import TableProfile
from rftfit.model.symmetry import torus

if TYPE_CHECKING:
    from rftfit.campaign.config import Config

DRAWS = 1000
"""Draws behind an interval where the config states no number."""

_MANY = 1e6


def alpha_draws(
    table: pd.DataFrame, draws: int, seed: int, confidence: float, only: str = ""
) -> tuple[FloatArray, FloatArray]:
    """Draw alpha tables of one medium from their errors (parametric bootstrap).

    Every run is its own experiment, so cells are independent but for what they share: a tare, the
    surface of the session, the turn of the mount. The rows beta = -90 and +90 degrees are one plate and
    move together. The same medium and seed give the same draws, so that stages which draw apart
    still agree.

    `only`: One of `SOURCES`, as if the others did not exist; default: all. Returns alpha_z and alpha_x
    by cell of the table, shape (draws, n); NaN in cells without a run.
    """
    from scipy.special import ndtri

    medium = str(table["medium"].iloc[0])
    random = np.random.default_rng([seed, zlib.crc32(medium.encode())])
    draws_by_component = []
    # by direction, so that the order of the rows does not choose the numbers
    order = table.reset_index().sort_values(["beta_deg", "gamma_deg"]).index.to_numpy()
    equivalent = equivalent_rows(table)
    shared = common_errors(table)
    normals = _common_normals(shared, draws, random.spawn(1)[0])
    for component in COMPONENTS:
        centre, low, high, se = (
            table[column(component, end)].to_numpy(float) for end in ("", "_lo", "_hi", "_se")
        )
        half = (high - low) / 2
        # from the interval, not from the standard error: it knows the degrees of freedom
        wide = np.divide(half / float(ndtri(0.5 + confidence / 2)), se, where=se > 0, out=0 * se)
        noise = np.empty((draws, centre.size))
        noise[:, order] = random.standard_normal(noise.shape)
        variance = se**2
        moved = np.zeros_like(noise)
        for source, error in shared.items():
            size = error.size[component]
            variance = variance - size**2
            if only in ("", source):
                moved += size * normals[source][component]
        if only and only not in shared:
            variance = error_sizes(table, only)[component] ** 2
        if only not in shared:
            moved += np.sqrt(np.maximum(variance, 0.0)) * noise[:, equivalent]
        draws_by_component.append(centre + wide * moved)
    return draws_by_component[0], draws_by_component[1]


def _common_normals(
    shared: dict[str, CommonError], draws: int, random: np.random.Generator
) -> dict[str, dict[str, FloatArray]]:
    """Normal numbers of the errors that cells share, by source and component, shape (draws, n)."""

    def drawn(error: CommonError) -> FloatArray:
        return random.standard_normal((draws, len(error.share))) @ error.share

    return {
        source: dict.fromkeys(COMPONENTS, drawn(error))
        if error.joint
        else {c: drawn(error) for c in COMPONENTS}
        for source, error in shared.items()
    }


def errors_behind(
    table: pd.DataFrame,
    config: Config,
    quantity: Callable[[tuple[FloatArray, FloatArray]], FloatArray],
) -> dict[str, FloatArray]:
    """Standard deviation of quantities that are linear in alpha, by the name of the error behind them.

    `quantity`: Makes numbers of shape (..., draws) of `alpha_draws`. Returns arrays of shape (...).
    """
    seed, level = config.fourier.seed, config.fit.confidence
    return {
        name: quantity(alpha_draws(table, _FEW, seed, level, only=name)).std(ddof=1, axis=-1)
        for name in SOURCES
        if any(size.any() for size in error_sizes(table, name).values())
    }


_FEW = 400
"""Draws that tell a share of a variance to some percent."""


def draws_of(table: pd.DataFrame, config: Config) -> tuple[FloatArray, FloatArray]:
    """`alpha_draws` with the settings of a campaign."""
    settings = config.fourier
    return alpha_draws(table, settings.draws, settings.seed, config.fit.confidence)


def measured_profile(
    table: pd.DataFrame, config: Config, name: str = "measured table", *, draws: bool = True
) -> TableProfile:
    """Interpolate an alpha table; its spread are draws within its errors, NaN where a cell has alpha and no error."""
    profile = TableProfile.from_table(table, name)
    errors = table[[column(c, "_hi") for c in COMPONENTS]].notna().to_numpy()
    # scattered directions are interpolated between all that have a number: draws of some are another table
    if not draws or not errors.any() or (profile.scattered and not errors_known(table)):
        return profile
    alpha = np.stack(draws_of(table, config))
    lacking = np.isnan(alpha).any(axis=(0, 1)) & table[column("z")].notna().to_numpy()
    # a direction and its mirror image are one: its mean has an error only where both have
    cells = torus(*directions(table)).cell
    of_lacking = cells[(lacking[cells] & (cells >= 0)).any(axis=1)]
    alpha[..., of_lacking[of_lacking >= 0]] = np.nan
    profile.spread = TableProfile(alpha[0], alpha[1], *directions(table))
    return profile


def errors_known(table: pd.DataFrame) -> bool:
    """Whether every alpha of a table has an interval: a table of others may state none."""
    return all(
        bool((table[column(c, "_hi")].notna() | table[column(c)].isna()).all()) for c in COMPONENTS
    )


def typical_dof(table: pd.DataFrame, confidence: float) -> float:
    """Degrees of freedom behind the intervals of an alpha table, median over the cells, at most 1e6."""
    from scipy.special import ndtri, stdtridf

    upper = 0.5 + confidence / 2
    ratios = []
    for component in COMPONENTS:
        half = table[column(component, "_hi")] - table[column(component, "_lo")]
        ratios.append((half / 2 / table[column(component, "_se")]).to_numpy(float))
    ratio = np.concatenate(ratios)
    ratio = ratio[np.isfinite(ratio)]
    if ratio.size == 0:
        return float("nan")
    middle = float(np.median(ratio))
    # a normal quantile has infinitely many, where the inverse of Student's t ends
    if middle <= 1.00001 * float(ndtri(upper)):
        return _MANY
    return float(min(stdtridf(upper, middle), _MANY))


def interval_of_sum(
    terms: Sequence[FloatArray], dofs: Sequence[float], confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Percentile interval of a sum of terms that were measured apart, each of shape (draws, ...).

    The draws of each term are as wide as the Student interval of its own few degrees of freedom
    (`typical_dof`). A sum has more of them (Welch and Satterthwaite), so its interval is narrowed.
    """
    from scipy.special import ndtri, stdtrit

    upper = 0.5 + confidence / 2
    normal = float(ndtri(upper))
    lo, hi = interval(sum(terms[1:]) + terms[0], confidence)
    dof = np.array(dofs)
    widened = np.array([float(stdtrit(dof, upper)) / normal for dof in dofs])
    drawn = np.stack([term.var(axis=0) for term in terms])
    shape = (-1, *[1] * (drawn.ndim - 1))
    variance = drawn / widened.reshape(shape) ** 2
    total = variance.sum(axis=0)
    safe = np.where(total > 0, total, 1.0)
    together = 1 / np.maximum(((variance / safe) ** 2 / dof.reshape(shape)).sum(axis=0), 1 / _MANY)
    reach = stdtrit(together, upper) / normal
    width_drawn = np.sqrt(np.where(total > 0, drawn.sum(axis=0) / safe, 1.0))
    middle = (lo + hi) / 2
    half = (hi - lo) / 2 * reach / width_drawn
    return middle - half, middle + half


def interval(draws: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Percentile interval along the first axis: its lower and upper end, NaN where a draw has none.

    Linear between two draws, as `numpy.quantile`; to sort the draws of one number side by side is several times faster.
    """
    tail = (1 - confidence) / 2
    ordered = np.moveaxis(np.asarray(draws, dtype=float), 0, -1).copy()
    ordered.sort(axis=-1)
    unknown = np.isnan(ordered[..., -1])
    lo, hi = (
        np.where(unknown, np.nan, _between_draws(ordered, share)) for share in (tail, 1 - tail)
    )
    # of draws of one number the ends are numbers
    return lo[()], hi[()]


def _between_draws(ordered: FloatArray, share: float) -> FloatArray:
    """Quantile of draws in ascending order along the last axis."""
    last = ordered.shape[-1] - 1
    place = share * last
    below = math.floor(place)
    low, high = ordered[..., below], ordered[..., min(below + 1, last)]
    fraction = place - below
    # from the nearer end, so that equal draws give themselves
    gap = high - low
    return np.asarray(low + gap * fraction if fraction < 0.5 else high - gap * (1 - fraction))


def widen(value: Any, ends: tuple[Any, Any], half: Any) -> tuple[Any, Any]:
    """Interval with a further error, independent of the others, whose half width is given."""
    below, above = (np.hypot(end - value, half) for end in ends)
    return value - below, value + above


def end_names(quantity: str, of: str = "") -> tuple[str, str]:
    """Names of the columns of an interval: ``force_z_N`` to ``force_z_lo_N``, ``force_z_hi_N``; `of`: before the ends."""
    what, unit = quantity.rsplit("_N", maxsplit=1)
    return f"{what}_{of}lo_N{unit}", f"{what}_{of}hi_N{unit}"


next_end_names = partial(end_names, of="next_")
"""Names of the columns of the interval of the next bed: ``force_z_next_lo_N`` and ``force_z_next_hi_N``."""

model_end_names = partial(end_names, of="model_")
"""Names of the columns of the interval with the model's own error: ``force_z_model_lo_N`` and ``force_z_model_hi_N``."""


def beside_name(quantity: str) -> str:
    """Name of the column of a force by the table or the map of the same medium: ``force_z_beside_N``."""
    what, unit = quantity.rsplit("_N", maxsplit=1)
    return f"{what}_beside_N{unit}"
