"""Scaling between media: zeta, chi, the generic M0, and the routine for a further medium."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column, grid
from rftfit.model.draws import Term, alpha_draws, interval_of_sum, typical_dof
from rftfit.model.fourier import TERMS, TERMS_Z, as_array, fit_dft_index, fit_lsq, kept_terms
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, coefficients

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from importlib.resources.abc import Traversable
    from pathlib import Path

    import numpy.typing as npt
    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.conventions import FloatArray


# --- Scaling between media: zeta, chi, the generic M0, and the routine for a new medium.


_TEST_DOF = 1e3
"""Degrees of freedom of the error of a penetration test, which is taken for known."""


def vertical_penetration(coefficients: FloatArray) -> FloatArray:
    """alpha_z of the fit at (beta, gamma) = (0, 90 deg): A00 + A10 + B11 + B01 + Bm1.

    Its number in N/cm^3 is the scaling factor zeta.

    `coefficients`: shape (..., 9); N/cm^3. Returns shape (...): N/cm^3.
    """
    result: FloatArray = coefficients[..., : len(TERMS_Z)].sum(axis=-1)
    return result


def generic(coefficients: FloatArray) -> FloatArray:
    """Average M_i / zeta_i over the media: the generic coefficients M0.

    `coefficients`: shape (..., media, 9); N/cm^3. Returns shape (..., 9): Dimensionless;
    alpha_z(0, 90 deg) is 1.
    """
    zeta = vertical_penetration(coefficients)
    result: FloatArray = (coefficients / zeta[..., None]).mean(axis=-2)
    return result


@dataclass(frozen=True)
class Scaled:
    """A new medium by the scaling routine; each quantity with its interval.

    `zeta`, `zeta_lo`, `zeta_hi`: Dimensionless.
    `chi`, `chi_lo`, `chi_hi`: The ratio that was used; its interval is that for one further
        medium.
    `coefficients`: shape (9,); zeta times M0, N/cm^3.
    """

    zeta: float
    zeta_lo: float
    zeta_hi: float
    chi: float
    chi_lo: float
    chi_hi: float
    coefficients: FloatArray


def scale_new_medium(
    alpha: float, alpha_se: float, chi: FloatArray, m0: FloatArray, confidence: float = 0.95
) -> Scaled:
    """Turn one vertical penetration of a flat plate into a whole medium.

    zeta = alpha_z(0, 90 deg) / chi with the mean chi of the reference media, alpha = zeta times the
    generic profile (supplement, scaling routine). The interval joins the scatter of chi between
    media, taken for that of a further medium (Student, sample of the reference media), with the
    error of the test itself: half widths, each with its own quantile, add in quadrature. So it is
    never narrower for more error, and covers at least as often as stated (Banerjee, Sankhya 22, 357, 1960).

    `alpha`: Measured slope, N/cm^3. `alpha_se`: Its standard error, N/cm^3; 0 if not known. `chi`:
    shape (media,); Of the reference media, at least two. `m0`: shape (9,); Generic coefficients.
    `confidence`: Level of the intervals.
    """
    from rftfit.measure.slopes import student_quantile

    if not (np.isfinite(alpha) and alpha > 0):
        raise ValueError(f"alpha_z(0, 90 deg) must be a positive number of N/cm^3, found {alpha:g}")
    if not alpha_se >= 0:
        raise ValueError(
            f"the standard error of alpha_z must be 0 or more N/cm^3, found {alpha_se:g}"
        )
    if not (np.isfinite(chi) & (chi > 0)).all():
        raise ValueError("every chi must be a positive number")
    if chi.size < 2:
        raise ValueError(f"the scatter of chi needs at least two reference media, found {chi.size}")
    # ratios: means and intervals on the logarithm keep zeta positive and treat 1/chi alike
    centre = float(chi.mean())
    spread = float(np.log(chi).std(ddof=1)) * np.sqrt(1 + 1 / chi.size)
    half_chi = float(student_quantile(confidence, chi.size - 1)) * spread
    half_alpha = float(student_quantile(confidence, _TEST_DOF)) * alpha_se / alpha
    half = float(np.hypot(half_chi, half_alpha))
    zeta = alpha / centre
    return Scaled(
        zeta, zeta * np.exp(-half), zeta * np.exp(half),
        centre, centre * np.exp(-half_chi), centre * np.exp(half_chi),
        zeta * m0,
    )  # fmt: skip


# --- Nine-term fits of all media by each method, with the draws that their intervals come from.


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

    `full`: shape (9,); With all nine terms, N/cm^3.
    `keep`: shape (9,); Terms that are used.
    `used`: shape (9,); Coefficients of the kept terms (refitted without the others), 0 elsewhere,
        N/cm^3.
    `draws`: shape (draws, 9); `used` under the errors of alpha, the selection of terms held fixed.
    `alpha_z`: Measured alpha_z(0, 90 deg), N/cm^3.
    `alpha_z_draws`: shape (draws,).
    `dof`: Degrees of freedom behind the errors of alpha.
    `reason`: Why there are no coefficients; empty if there are.
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

    `tables`: Alpha table of each medium. Returns by method, then in the order of the tables.
    `AS_PRINTED` only for published media.
    """
    return [
        fit
        for method in ALL_METHODS
        for table in tables
        if (fit := _fit_medium(table, config, method)) is not None
    ]


def reference_of(fits: Sequence[MediumFit], config: Config) -> Reference:
    """Choose what the natural sands of a campaign are scaled from.

    `fits`: Of the laboratory media; those by other methods than the config's do not count. Returns
    the campaign's own media; the published five where fewer than two of them have a usable grid:
    the interval for a further medium is the scatter between media, and one has none.
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

    `fits`: Of all media by one method, each with coefficients. Returns `lo`, `hi` of shape (9,).
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


# --- Interval of anything that is scaled from the generic profile to one further medium.


Interval = tuple["FloatArray", "FloatArray", "FloatArray"]
"""Value, lower and upper end."""


def with_interval(
    scaled: Scaled, generic: FloatArray, of_media: FloatArray, confidence: float
) -> Interval:
    """Scale a quantity of the generic profile; its interval is that for one further medium.

    Two errors are joined as independent ones: that of zeta, and how far a medium's own profile lies
    from the generic one, taken from the scatter of the reference media (Student).

    `generic`: shape (...); Of the generic profile, dimensionless. `of_media`: shape (media, ...);
    The same of each reference medium, divided by its zeta. Returns `value`, `lo`, `hi` of shape
    (...): N/cm^3.
    """
    from rftfit.measure.slopes import student_quantile

    media = of_media.shape[0]
    spread = of_media.std(axis=0, ddof=1) * np.sqrt(1 + 1 / media)
    shape = student_quantile(confidence, media - 1) * spread * scaled.zeta
    value = scaled.zeta * generic
    ends = np.stack([scaled.zeta_lo * generic, scaled.zeta_hi * generic])
    below, above = value - ends.min(axis=0), ends.max(axis=0) - value
    return value, value - np.hypot(below, shape), value + np.hypot(above, shape)


# --- The media that a further medium is scaled from: their chi, generic coefficients and scatter.


GENERIC = "generic"

PRINTED_NOTE = (
    "fewer than two laboratory media with a usable grid: scaled with the published five media"
)
"""Reason in the tables of a campaign whose natural sands are scaled with the printed tables."""


@dataclass(frozen=True)
class Reference:
    """What a new medium is scaled from.

    `name`: For people: which tables.
    `chi`: shape (media,).
    `m0`: shape (9,); Generic coefficients.
    `scaled`: shape (media, 9); M / zeta of each medium: their scatter about `m0` is that of a
        further medium.
    `printed`: Whether these are the published tables.
    """

    name: str
    media: tuple[str, ...]
    chi: FloatArray
    m0: FloatArray
    scaled: FloatArray
    printed: bool = False

    @property
    def note(self) -> str:
        """What a table of a campaign says of it; empty for the campaign's own media."""
        return PRINTED_NOTE if self.printed else ""


def published() -> Reference:
    """Chi of Table S3 and coefficients of Table S2, as printed."""
    # read here, not as data frames: pandas alone takes longer to import than the scaling to run
    folder = files("rftfit.reference")
    chi = {
        row["medium"]: float(row["value"])
        for row in table_rows(folder.joinpath("table_s3.csv"))
        if row["quantity"] == "chi"
    }
    printed: dict[str, dict[str, float]] = {}
    for row in table_rows(folder.joinpath("table_s2.csv")):
        printed.setdefault(row["medium"], {})[row["coefficient"]] = float(row["value"])
    values = {
        medium: np.array([terms[term] for term in TERMS]) for medium, terms in printed.items()
    }
    return reference_from("published Tables S2 and S3", chi, values, printed=True)


def reference_from(
    name: str,
    chi: Mapping[str, float],
    coefficients: Mapping[str, FloatArray],
    *,
    printed: bool = False,
) -> Reference:
    """Put together chi and coefficients of media.

    `name`: For people: which tables. `chi`: By medium. `coefficients`: shape (9,); Of these media,
    N/cm^3, and of `GENERIC`. `printed`: Whether these are the published tables.
    """
    own = np.stack([coefficients[medium] for medium in chi])
    # the printed zeta is rounded on its own: the sum keeps alpha_z(0, 90 deg) of each profile at 1
    scaled = own / vertical_penetration(own)[:, None]
    values = np.array(list(chi.values()))
    return Reference(name, tuple(chi), values, coefficients[GENERIC], scaled, printed)


def routine(method: str, *, printed: bool = False) -> str:
    """Name the method of a natural sand in the tables.

    `method`: Of the fits, as the config has it. `printed`: Whether it is scaled with the published
    media, not with the campaign's own.
    """
    return f"scaling routine ({method}{', published media' if printed else ''})"


def routines(method: str) -> tuple[str, str]:
    """Name the methods that a natural sand may stand under.

    `method`: Of the fits, as the config has it. Returns with the campaign's own media, with the
    published ones.
    """
    return routine(method), routine(method, printed=True)


def table_rows(source: Path | Traversable) -> list[dict[str, str]]:
    """Read a csv table whose lines beginning with ``#`` are comments.

    Returns cells as text, by column.
    """
    lines = source.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
