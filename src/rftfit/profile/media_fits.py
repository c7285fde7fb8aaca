"""Nine-term fits of all media by each method, with the draws that their intervals come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column, grid
from rftfit.profile.bootstrap import Term, alpha_draws, interval_of_sum, typical_dof
from rftfit.profile.fourier import TERMS, as_array, fit_dft_index, fit_lsq, kept_terms
from rftfit.profile.reference_media import GENERIC, Reference, published, reference_from
from rftfit.profile.scaling import generic, vertical_penetration
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, coefficients

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.conventions import FloatArray

AS_PRINTED = "dft-index, printed terms"
"""The transform with just the terms that Table S2 prints as non-zero: the paper's own selection,
which its rule of 0.05 A00 does not explain."""

ALL_METHODS = ("lsq", "dft-index", AS_PRINTED)

FEWEST_MEDIA = 2
"""Of a campaign's own, for its natural sands to be scaled from them."""

_BETA, _GAMMA = np.radians(BETA_DEG), np.radians(GAMMA_DEG)
_VERTICAL = (int(np.flatnonzero(BETA_DEG == 0)[0]), GAMMA_DEG.size - 1)


@dataclass(frozen=True)
class MediumFit:
    """Coefficients of one medium by one method.

    Parameters
    ----------
    medium, method : str
    full : numpy.ndarray, shape (9,)
        With all nine terms, N/cm^3.
    keep : numpy.ndarray of bool, shape (9,)
        Terms that are used.
    used : numpy.ndarray, shape (9,)
        Coefficients of the kept terms (refitted without the others), 0 elsewhere, N/cm^3.
    draws : numpy.ndarray, shape (draws, 9)
        `used` under the errors of alpha, the selection of terms held fixed.
    alpha_z : float
        Measured alpha_z(0, 90 deg), N/cm^3.
    alpha_z_draws : numpy.ndarray, shape (draws,)
    dof : float
        Degrees of freedom behind the errors of alpha.
    reason : str
        Why there are no coefficients; empty if there are.
    """

    medium: str
    method: str
    full: FloatArray
    keep: npt.NDArray[np.bool_]
    used: FloatArray
    draws: FloatArray
    alpha_z: float
    alpha_z_draws: FloatArray
    dof: float = 1e6
    reason: str = ""

    @property
    def zeta(self) -> float:
        """alpha_z of the fit at (0, 90 deg); its number in N/cm^3."""
        return float(vertical_penetration(self.used))

    @property
    def zeta_draws(self) -> FloatArray:
        """`zeta` under the errors of alpha, shape (draws,)."""
        return vertical_penetration(self.draws)


def fit_media(tables: list[pd.DataFrame], config: Config) -> list[MediumFit]:
    """Fit every laboratory medium by every method.

    Parameters
    ----------
    tables : list of pandas.DataFrame
        Alpha table of each medium.
    config : Config

    Returns
    -------
    list of MediumFit
        By method, then in the order of the tables. `AS_PRINTED` only for published media.
    """
    return [
        fit
        for method in ALL_METHODS
        for table in tables
        if (fit := _fit_medium(table, config, method)) is not None
    ]


def reference_of(fits: Sequence[MediumFit], config: Config) -> Reference:
    """Choose what the natural sands of a campaign are scaled from.

    Parameters
    ----------
    fits : sequence of MediumFit
        Of the laboratory media; those by other methods than the config's do not count.
    config : Config

    Returns
    -------
    Reference
        The campaign's own media; the published five where fewer than two of them have a usable
        grid: the interval for a further medium is the scatter between media, and one has none.
    """
    method = config.fourier.method
    own = [fit for fit in fits if fit.method == method and not fit.reason]
    if len(own) < FEWEST_MEDIA:
        return published()
    values = {fit.medium: fit.used for fit in own}
    chi = {fit.medium: fit.alpha_z / fit.zeta for fit in own}
    m0 = generic(np.stack([fit.used for fit in own]))
    return reference_from(f"this campaign, method {method}", chi, values | {GENERIC: m0})


def generic_interval(fits: Sequence[MediumFit], confidence: float) -> tuple[FloatArray, FloatArray]:
    """Interval of M0, the mean over media that were measured apart.

    Parameters
    ----------
    fits : sequence of MediumFit
        Of all media by one method, each with coefficients.
    confidence : float

    Returns
    -------
    lo, hi : numpy.ndarray, shape (9,)
    """
    shares = [fit.draws / fit.zeta_draws[:, None] / len(fits) for fit in fits]
    return interval_of_sum(
        [Term(share, fit.dof) for share, fit in zip(shares, fits, strict=True)], confidence
    )


def _fit_medium(table: pd.DataFrame, config: Config, method: str) -> MediumFit | None:
    medium = str(table["medium"].iloc[0])
    published = config.media[medium].published_as
    if method == AS_PRINTED and published not in MEDIA:
        return None
    alpha_z, alpha_x = grid(table, column("z")), grid(table, column("x"))
    settings = config.fourier
    many_z, many_x = alpha_draws(table, settings.draws, settings.seed, config.fit.confidence)
    measured = float(alpha_z[_VERTICAL])
    try:
        full = _transform(method, alpha_z, alpha_x, None)
    except ValueError as error:
        return _nothing(medium, method, settings.draws, measured, str(error))
    if not np.isfinite(full).all():
        empty = int(np.count_nonzero(np.isnan(alpha_z)))
        reason = f"{empty} of {alpha_z.size} cells have no alpha; the transform needs all of them"
        return _nothing(medium, method, settings.draws, measured, reason)
    if method == AS_PRINTED:
        assert published is not None
        keep = as_array(coefficients(published)) != 0
    else:
        keep = kept_terms(full, settings.threshold)
    return MediumFit(
        medium, method, full, keep,
        _transform(method, alpha_z, alpha_x, keep),
        _transform(method, many_z, many_x, keep),
        measured,
        many_z[(slice(None), *_VERTICAL)],
        typical_dof(table, config.fit.confidence),
    )  # fmt: skip


def _transform(
    method: str, alpha_z: FloatArray, alpha_x: FloatArray, keep: npt.NDArray[np.bool_] | None
) -> FloatArray:
    if method == "lsq":
        return fit_lsq(_BETA, _GAMMA, alpha_z, alpha_x, keep)
    values = fit_dft_index(_GAMMA, alpha_z, alpha_x)
    return values if keep is None else np.where(keep, values, 0.0)


def _nothing(medium: str, method: str, draws: int, measured: float, reason: str) -> MediumFit:
    nan = np.full(len(TERMS), np.nan)
    many = np.full((draws, len(TERMS)), np.nan)
    keep = np.ones(len(TERMS), dtype=bool)
    return MediumFit(medium, method, nan, keep, nan, many, measured, many[:, 0], reason=reason)
