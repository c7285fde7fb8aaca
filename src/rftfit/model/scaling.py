"""Scaling between media by the paper's routine: zeta, chi, generic coefficients M0, nine terms of a further medium.

M are the nine coefficients of a medium, zeta is the alpha_z(0, 90 deg) that they give, and chi is measured alpha_z(0,
90 deg) over zeta. M0 is the mean of M / zeta over the reference media. A further medium is zeta M0, with zeta from one
push of a level plate straight down (the penetration test): alpha_z(0, 90 deg) over the mean chi. Coefficients are
arrays (..., 9) in the order of `fourier.TERMS`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import alpha_columns, cell_down, column, directions, flagged, rows_at
from rftfit.measure.flags import Remark, format_remarks, quoted, remark
from rftfit.measure.slopes import student_quantile
from rftfit.measure.verdict_words import is_usable
from rftfit.model import fourier
from rftfit.model.draws import (
    draw_as_configured,
    errors_behind,
    errors_known,
    interval_of_sum,
    typical_dof,
    widen,
)
from rftfit.model.profiles import (
    FourierProfile,
    KnownMedium,
    OneTest,
    Profile,
    TableProfile,
    scaled_generic,
)
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, alpha_columns_of, coefficients, load

if TYPE_CHECKING:
    from rftfit.campaign.config import Config

GENERIC = "generic"
"""Name of the generic coefficients where coefficients of media are listed by name."""

Interval = tuple["FloatArray", "FloatArray", "FloatArray"]
"""Value, lower and upper end, of the same shape."""

_TEST_DOF = 1e3
"""Degrees of freedom of the error of a penetration test: so many that the error counts as exactly known."""


def vertical_penetration(coefficients: FloatArray) -> FloatArray:
    """Return zeta, alpha_z of nine terms (..., 9) at (0, 90 deg): A00 + A10 + B11 + B01 + Bm1; shape (...), N/cm^3."""
    return np.asarray(coefficients[..., : len(fourier.TERMS_Z)].sum(axis=-1))


def chi_of(alpha_z: FloatArray | float, coefficients: FloatArray) -> FloatArray:
    """Return chi, alpha_z(0, 90 deg) as measured, `alpha_z`, over that of nine terms (..., 9); shape (...)."""
    return np.asarray(alpha_z / vertical_penetration(coefficients))


def generic(coefficients: FloatArray) -> FloatArray:
    """Average M / zeta over media: the generic coefficients M0, whose alpha_z(0, 90 deg) is 1.

    `coefficients`: shape (..., media, 9), N/cm^3. Returns shape (..., 9), dimensionless.
    """
    zeta = vertical_penetration(coefficients)
    return np.asarray((coefficients / zeta[..., None]).mean(axis=-2))


@dataclass(frozen=True)
class Scaled:
    """The scaling factor zeta of a new medium, and the mean chi by which it was calculated, with intervals.

    `confidence`: level of the intervals. Attributes as in `ScaledMedium`.
    """

    zeta: float
    zeta_lo: float
    zeta_hi: float
    chi: float
    chi_lo: float
    chi_hi: float
    confidence: float

    def with_interval(
        self, generic: FloatArray, of_media: FloatArray, *, measured: bool = False
    ) -> Interval:
        """Scale a quantity of the generic profile, with the interval for one further medium.

        The interval joins two independent errors: the error of zeta, and the difference of the profile of a medium
        from the generic profile, estimated by the scatter of the reference media (Student).

        Parameters
        ----------
        generic : numpy.ndarray, shape (...)
            Quantity of the generic profile, dimensionless.
        of_media : numpy.ndarray, shape (media, ...)
            Same quantity of each reference medium, divided by its zeta.
        measured : bool, optional
            True if `of_media` follow from measured alpha, not from nine terms: their mean error by nine terms then
            widens the interval too.

        Returns
        -------
        value, lo, hi : numpy.ndarray, shape (...)
        """
        media = of_media.shape[0]
        spread = of_media.std(axis=0, ddof=1) * np.sqrt(1 + 1 / media)
        if measured:
            spread = np.hypot(spread, of_media.mean(axis=0) - generic)
        half_of_shape = student_quantile(self.confidence, media - 1) * spread * self.zeta
        value = self.zeta * generic
        ends = np.stack([self.zeta_lo * generic, self.zeta_hi * generic])
        return value, *widen(value, (ends.min(axis=0), ends.max(axis=0)), half_of_shape)


def scale_new_medium(
    alpha: float, alpha_se: float, chi: FloatArray, confidence: float = 0.95
) -> Scaled:
    """Turn one vertical penetration of a flat plate into the scaling factor of a medium.

    zeta = alpha_z(0, 90 deg) / chi with the mean chi of the reference media (supplement, scaling
    routine). The interval joins the scatter of chi between the reference media (Student), which a further medium
    is assumed to have, with the error of the test: the half widths, each with its own quantile, add in quadrature.
    Such an interval is never narrower for a larger error, and covers at least as often as stated (Banerjee, Sankhya 22,
    357, 1960).

    `alpha`, `alpha_se`: measured slope and its standard error, N/cm^3; an error of NaN (not known)
    gives no interval. `chi`: of the reference media, at least two.
    """
    check_test(alpha, alpha_se)
    if not (np.isfinite(chi) & (chi > 0)).all():
        raise ValueError("every chi must be a positive number")
    if chi.size < 2:
        raise ValueError(f"the scatter of chi needs at least two reference media, found {chi.size}")
    # the interval on the logarithm keeps zeta positive, and is the same for chi as for 1 / chi
    mean_chi = float(chi.mean())
    spread = float(np.log(chi).std(ddof=1)) * np.sqrt(1 + 1 / chi.size)
    half_chi = float(student_quantile(confidence, chi.size - 1)) * spread
    half_alpha = float(student_quantile(confidence, _TEST_DOF)) * alpha_se / alpha
    half = float(np.hypot(half_chi, half_alpha))
    zeta = alpha / mean_chi
    return Scaled(
        zeta,
        zeta * np.exp(-half),
        zeta * np.exp(half),
        mean_chi,
        mean_chi * np.exp(-half_chi),
        mean_chi * np.exp(half_chi),
        confidence,
    )


def alpha_of_test(cell: pd.Series[Any], confidence: float) -> tuple[float, float]:
    """Return alpha_z of a penetration test and its standard error for `scale_new_medium`, N/cm^3.

    `cell`: row of an alpha table at (0, 90 deg); `confidence`: level of its interval. The standard error of few runs is
    poorly known, and their interval wider for this: the error is enlarged so that a nearly normal interval is as wide.
    """
    alpha, se, lo, hi = (float(cell[column("z", end)]) for end in ("", "_se", "_lo", "_hi"))
    se_by_interval = (hi - lo) / 2 / float(student_quantile(confidence, _TEST_DOF))
    return alpha, float(np.maximum(se, se_by_interval))


@dataclass(frozen=True)
class Reference:
    """The media from which a further medium is scaled.

    Parameters
    ----------
    name : str
        Description of the tables, for people.
    media : tuple of str
    chi : numpy.ndarray, shape (media,)
        Measured alpha_z(0, 90 deg) over zeta of the nine-term fit.
    m0 : numpy.ndarray, shape (9,)
        Generic coefficients, dimensionless.
    scaled : numpy.ndarray, shape (media, 9)
        M / zeta of each medium; their scatter about `m0` is assumed for a further medium.
    printed : bool, optional
        True if these are the published tables.
    tables : tuple of TableProfile, optional
        Measured alpha of each medium over its zeta, dimensionless, which shows the error of nine terms. Empty if not
        known.

    Examples
    --------
    >>> import rftfit
    >>> rftfit.published_reference().media[0]
    'poppy_LP'
    """

    name: str
    media: tuple[str, ...]
    chi: FloatArray
    m0: FloatArray
    scaled: FloatArray
    printed: bool = False
    tables: tuple[TableProfile, ...] = field(default=(), repr=False, compare=False)

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """Remark that a campaign scales from published media, for its tables; empty where it scales from its own media."""
        return (remark("published-media"),) if self.printed else ()


def reference_from(
    name: str,
    chi: Mapping[str, float],
    coefficients: Mapping[str, FloatArray],
    tables: Mapping[str, TableProfile],
    *,
    printed: bool = False,
) -> Reference:
    """Make a `Reference` from numbers of each medium, by its name.

    `name`: description, for people. `chi`: by medium. `coefficients`: of these media, N/cm^3, shape (9,), and M0 under
    `GENERIC`. `tables`: measured alpha, N/cm^3. `printed`: True for the published media.
    """
    coefficients_of_media = np.stack([coefficients[medium] for medium in chi])
    # not the printed zeta, which is rounded: with the sum alpha_z(0, 90 deg) of each scaled profile is exactly 1
    zetas = vertical_penetration(coefficients_of_media)
    tables_over_zeta = []
    for medium, zeta in zip(chi, zetas, strict=True):
        beta, gamma, alpha_z, alpha_x = tables[medium].cells
        tables_over_zeta.append(TableProfile(alpha_z / zeta, alpha_x / zeta, beta, gamma))
    return Reference(
        name,
        tuple(chi),
        np.array(list(chi.values())),
        coefficients[GENERIC],
        coefficients_of_media / zetas[:, None],
        printed,
        tuple(tables_over_zeta),
    )


PAPER_RULE = 0.05
"""Share of A00 above which a term of a published medium or of a map is kept; of a table, `fourier.threshold` of the config."""


def published(method: str = "lsq") -> Reference:
    """Return the reference media of Li, Zhang and Goldman (2013).

    Parameters
    ----------
    method : str, optional
        Method of the nine-term fits behind chi and M0. ``lsq``: least squares at the true
        angles of Table S5. Any other: the paper's transform as printed, with chi of Table S3 and the
        coefficients of Table S2.

    Returns
    -------
    Reference

    Examples
    --------
    >>> import rftfit
    >>> [round(float(rftfit.published_reference(m).chi.mean()), 2) for m in ("lsq", "dft-index")]
    [1.12, 1.24]
    """
    if method == "lsq":
        return _by_least_squares()
    rows = load("table_s3").query("quantity == 'chi'")
    chi = dict(zip(rows["medium"], rows["value"].astype(float), strict=True))
    printed = {name: fourier.as_array(coefficients(name)) for name in (*MEDIA, GENERIC)}
    name = "published Tables S2 and S3, method dft-index as printed"
    return reference_from(name, chi, printed, _published_tables(), printed=True)


@cache
def _by_least_squares() -> Reference:
    """Return the reference of the published media from nine terms fitted to Table S5 of each, as their M and chi."""
    chi, fits = {}, {}
    for medium in MEDIA:
        columns = alpha_columns_of(medium)
        angles, alpha = directions(columns), alpha_columns(columns)
        keep = fourier.kept_terms(fourier.fit_lsq(*angles, *alpha), PAPER_RULE)
        fits[medium] = fourier.fit_lsq(*angles, *alpha, keep)
        chi[medium] = float(
            chi_of(alpha[0][rows_at(columns, 0, 90, TOLERANCE_DEG)[0]], fits[medium])
        )
    m0 = generic(np.stack(list(fits.values())))
    return reference_from(
        "published Table S5, method lsq",
        chi,
        fits | {GENERIC: m0},
        printed=True,
        tables=_published_tables(),
    )


def _published_tables() -> dict[str, TableProfile]:
    """Return the profile of Table S5 of each published medium, by its name."""
    return {medium: TableProfile.published(medium) for medium in MEDIA}


@dataclass(frozen=True)
class ScaledMedium(Scaled, KnownMedium, OneTest):
    """A medium known by one vertical penetration test and the paper's scaling routine, returned by `scale_by_paper`.

    Parameters
    ----------
    zeta, zeta_lo, zeta_hi : float
        Scaling factor and its interval, dimensionless.
    chi, chi_lo, chi_hi : float
        Mean ratio of measured to fitted alpha_z(0, 90 deg) of the reference media, and its interval for one
        further medium.
    confidence : float
        Level of the intervals.
    alpha_z, alpha_z_se : float
        Result of the test: alpha_z(0, 90 deg) and its standard error, N/cm^3.
    reference : Reference
        The media from which it is scaled.

    Examples
    --------
    >>> import rftfit
    >>> sand = rftfit.scale_by_paper(0.9, se=0.02)
    >>> table = sand.table()
    >>> forces = rftfit.predict(sand, rftfit.model_leg("c_leg"))
    """

    alpha_z: float
    alpha_z_se: float
    reference: Reference = field(repr=False)

    @property
    def coefficients(self) -> FloatArray:
        """Zeta times M0, N/cm^3, in the order of Table S2."""
        return self.zeta * self.reference.m0

    @property
    def profile(self) -> FourierProfile:
        """Zeta times the generic profile; its `spread` is this medium."""
        name = (
            f"generic times zeta = {self.zeta:.4f} ({self.zeta_lo:.4f} to {self.zeta_hi:.4f}), from "
            f"alpha_z(0, 90 deg) = {self.alpha_z:g} N/cm^3 (se {self.alpha_z_se:g}) with "
            f"{self.reference.name}"
        )
        return scaled_generic(self.zeta, self.reference.m0, name, self)

    def at_confidence(self, confidence: float) -> ScaledMedium:
        """Return the same medium with intervals of another level.

        Parameters
        ----------
        confidence : float

        Returns
        -------
        ScaledMedium
        """
        return scale_by_paper(self.alpha_z, self.alpha_z_se, self.reference, confidence)

    def as_profile(self, is_enough: Callable[[Profile], bool] | None = None) -> Profile:  # noqa: ARG002
        """Return the generic profile times zeta.

        Parameters
        ----------
        is_enough : callable, optional
            Not used: the generic profile has a number in every direction.

        Returns
        -------
        Profile
        """
        return self.profile

    def coefficients_with_interval(self) -> Interval:
        """Return the nine coefficients with their intervals.

        Returns
        -------
        value, lo, hi : numpy.ndarray, shape (9,)
            N/cm^3.
        """
        return self.with_interval(self.reference.m0, self.reference.scaled)

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[Interval, Interval]:
        """Return alpha of the nine-term profile with intervals.

        Parameters
        ----------
        beta, gamma : array_like
            Angles in rad; shapes broadcast to (...).

        Returns
        -------
        alpha_z, alpha_x : tuple of numpy.ndarray, shape (...)
            Value, lower and upper end, N/cm^3.
        """
        reference = self.reference
        alpha_by_m0 = fourier.evaluate(reference.m0, beta, gamma)
        alpha_by_terms = [fourier.evaluate(terms, beta, gamma) for terms in reference.scaled]
        alpha_by_tables = [table.alpha(beta, gamma) for table in reference.tables]
        intervals = []
        for component, generic in enumerate(alpha_by_m0):
            of_media, measured = self.of_media(
                [alpha[component] for alpha in alpha_by_terms],
                [alpha[component] for alpha in alpha_by_tables],
            )
            intervals.append(self.with_interval(generic, of_media, measured=measured))
        return intervals[0], intervals[1]

    @staticmethod
    def of_media(
        fitted: Sequence[FloatArray] | FloatArray, tables: Sequence[FloatArray]
    ) -> tuple[FloatArray, bool]:
        """Choose a quantity of each reference medium: by its table, or by its nine terms where the table has no number.

        Parameters
        ----------
        fitted, tables : sequence of numpy.ndarray
            Quantity of each medium by its nine terms, and by its table; `tables` may be empty.

        Returns
        -------
        of_media : numpy.ndarray, shape (media, ...)
        measured : bool
            True if tables are known.
        """
        by_terms = np.asarray(fitted)
        if not tables:
            return by_terms, False
        by_table = np.stack(tables)
        return np.where(np.isnan(by_table), by_terms, by_table), True

    def table(self) -> pd.DataFrame:
        """Return alpha on the published grid of 7 x 13 angles.

        Returns
        -------
        pandas.DataFrame
            ``beta_deg, gamma_deg``, and ``alpha_z_N_per_cm3``, ``alpha_z_lo_N_per_cm3``,
            ``alpha_z_hi_N_per_cm3``, and the same of ``alpha_x``.
        """
        return pd.DataFrame(self.columns())

    def columns(self) -> dict[str, FloatArray]:
        """Return the columns of `table`, without pandas.

        Returns
        -------
        dict of str to numpy.ndarray, shape (91,)
        """
        beta, gamma = (angles.ravel() for angles in np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij"))
        columns = {"beta_deg": beta, "gamma_deg": gamma}
        intervals = self.alpha(np.radians(beta), np.radians(gamma))
        for component, interval in zip(COMPONENTS, intervals, strict=True):
            for end, alpha in zip(("", "_lo", "_hi"), interval, strict=True):
                columns[column(component, end)] = alpha
        return columns


def check_test(alpha: float, se: float) -> None:
    """Raise TypeError if alpha of a penetration test or its error is no number, ValueError if it is out of range.

    `alpha`: alpha_z(0, 90 deg), above 0; `se`: 0 or more; N/cm^3. An array of shape () is no number, either.
    """
    for what, value in (("alpha_z(0, 90 deg)", alpha), ("its standard error", se)):
        if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf":
            raise TypeError(f"{what} must be a number of N/cm^3, found {value!r}")
    if not (np.isfinite(alpha) and alpha > 0):
        raise ValueError(f"alpha_z(0, 90 deg) must be a positive number of N/cm^3, found {alpha:g}")
    if se < 0:
        raise ValueError(f"the standard error of alpha_z must be 0 or more N/cm^3, found {se:g}")


def check_level(confidence: float) -> None:
    """Raise ValueError if the level of intervals is not above 0.5 and below 1."""
    if not 0.5 < confidence < 1:
        raise ValueError(f"the level must be above 0.5 and below 1, found {confidence:g}")


def scale_by_paper(
    alpha: float, se: float = 0.0, reference: Reference | None = None, confidence: float = 0.95
) -> ScaledMedium:
    """Turn one vertical penetration test into nine terms by the scaling routine of the paper, S9.

    Use it to compare with the paper: forces by nine terms have no interval for the error of the force model. From the
    same push `rftfit.scale` estimates a map, whose forces have one.

    Parameters
    ----------
    alpha : float
        Slope of stress over depth of a horizontal plate pushed straight down, alpha_z(0, 90 deg),
        N/cm^3.
    se : float, optional
        Standard error of alpha, N/cm^3.
    reference : Reference, optional
        The media to scale from, for example those of a campaign (`Results.reference`); default: the five
        published media by least squares (`published_reference`).
    confidence : float, optional
        Level of the intervals, which include the error of the test, and the scatter of chi and of the profiles
        between the reference media.

    Returns
    -------
    ScaledMedium

    Raises
    ------
    TypeError
        If alpha or `se` is no number.
    ValueError
        If alpha is not positive, `se` is negative, or the level is not between 0.5 and 1.

    Examples
    --------
    >>> import rftfit
    >>> sand = rftfit.scale_by_paper(0.9, se=0.02)
    >>> round(sand.zeta, 2)
    0.8
    """
    check_test(alpha, se)
    check_level(confidence)
    reference = published() if reference is None else reference
    medium = scale_new_medium(alpha, se, reference.chi, confidence)
    return ScaledMedium(**vars(medium), alpha_z=alpha, alpha_z_se=se, reference=reference)


AS_PRINTED = "dft-index, printed terms"
"""Method: the transform with the terms that Table S2 prints as non-zero, a selection that the paper's rule of 0.05 A00
does not explain."""

ALL_METHODS = ("lsq", "dft-index", AS_PRINTED)
"""Methods of fits of a campaign: those of `fourier.METHODS`, and `AS_PRINTED`."""

FEWEST_MEDIA = 2
"""Fewest media of a campaign from which its natural sands are scaled."""


@dataclass(frozen=True)
class MediumFit:
    """Nine coefficients of one medium fitted by one method, N/cm^3, shape (9,): made by `fit_terms`.

    `method`: one of `ALL_METHODS`. `full`: with all nine terms. `keep`: True for the terms that are kept, (9,). `used`:
    fitted again with the kept terms alone, 0 for the others; NaN if there is no fit, with the reason in `why`.
    `without_flagged`: `used` if flagged cells are left out; NaN where no cell is flagged, or too few would be left.
    `alpha_z`: measured alpha_z(0, 90 deg), N/cm^3, NaN where it was not measured. `table`: the alpha table that was
    fitted, one row a cell.
    """

    medium: str
    method: str
    full: FloatArray
    keep: npt.NDArray[np.bool_]
    used: FloatArray
    alpha_z: float
    table: pd.DataFrame = field(repr=False)
    config: Config = field(repr=False)
    why: tuple[Remark, ...] = ()
    without_flagged: FloatArray = field(default_factory=lambda: np.full(len(fourier.TERMS), np.nan))

    @property
    def reason(self) -> str:
        """Reason why there are no coefficients, in words; empty if there are."""
        return format_remarks(self.why)

    @property
    def counts(self) -> bool:
        """True if the medium counts in means over media: it has coefficients, and no check says that it is unusable."""
        return not self.reason and is_usable(self.table)

    @property
    def zeta(self) -> float:
        """Alpha_z of the fit at (0, 90 deg), whose number in N/cm^3 is the scaling factor."""
        return float(vertical_penetration(self.used))

    @cached_property
    def _alpha_draws(self) -> tuple[FloatArray, FloatArray]:
        """Draws of alpha_z and alpha_x of the table within its errors, each of shape (draws, n)."""
        return draw_as_configured(self.table, self.config)

    @cached_property
    def draws(self) -> FloatArray:
        """Draws of `used` within the errors of alpha, with the same terms, shape (draws, 9)."""
        if self.reason or not errors_known(self.table):
            return np.full((self.config.fourier.draws, len(fourier.TERMS)), np.nan)
        return self._fit_draws(self._alpha_draws)

    def _fit_draws(self, alpha: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Return the kept terms fitted to each draw of the alpha table, (draws, 9); `alpha`: z and x, each (draws, n)."""
        if self.config.fit.flagged == "leave_out":
            is_flagged = flagged(self.table)
            alpha = np.where(is_flagged, np.nan, alpha[0]), np.where(is_flagged, np.nan, alpha[1])
        return _fit_coefficients(self.method, directions(self.table), alpha, self.keep)

    @property
    def alpha_z_draws(self) -> FloatArray:
        """Draws of `alpha_z` within its error, N/cm^3, shape (draws,); NaN without a fit or the cell (0, 90 deg)."""
        cell = cell_down(self.table, self.config.grid.angle_tolerance_deg)
        if self.reason or cell is None:
            return np.full(self.config.fourier.draws, np.nan)
        return self._alpha_draws[0][:, self.table.index.get_loc(cell.name)]

    @property
    def zeta_draws(self) -> FloatArray:
        """Draws of `zeta` within the errors of alpha, shape (draws,)."""
        return vertical_penetration(self.draws)

    @property
    def zeta_errors(self) -> dict[str, FloatArray]:
        """Standard deviation of `zeta` that each source of error causes, by its name in `errors.SOURCES`; empty if not known."""
        if self.reason or not errors_known(self.table):
            return {}
        return errors_behind(
            self.table, self.config, lambda alpha: vertical_penetration(self._fit_draws(alpha))
        )

    @cached_property
    def dof(self) -> float:
        """Degrees of freedom behind the errors of alpha, as `interval_of_sum` needs them."""
        return typical_dof(self.table, self.config.fit.confidence)


def fit_media(tables: Sequence[pd.DataFrame], config: Config) -> list[MediumFit]:
    """Return fits of the alpha table of every laboratory medium by every method; by `AS_PRINTED` only of media of the paper.

    `tables`: one for each medium. Ordered by method, then as the tables.
    """
    return [
        fit_terms(table, config, method)
        for method in ALL_METHODS
        for table in tables
        if method != AS_PRINTED or config.media[_medium_of(table)].published_as in MEDIA
    ]


def _medium_of(table: pd.DataFrame) -> str:
    """Return the name of the medium of an alpha table."""
    return str(table["medium"].iloc[0])


def fit_terms(table: pd.DataFrame, config: Config, method: str) -> MediumFit:
    """Fit one alpha table by one method: all nine terms first, whose sizes decide which to keep, then the kept ones.

    Where no fit is possible the coefficients are NaN, and `MediumFit.why` says why: too few directions, empty cells, or
    an alpha_z(0, 90 deg) of 0, by which nothing can be scaled.
    """
    alpha, angles, is_flagged = alpha_columns(table), directions(table), flagged(table)
    unflagged_z, unflagged_x = np.where(is_flagged, np.nan, alpha)
    if config.fit.flagged == "leave_out":
        alpha = unflagged_z, unflagged_x
    full = used = without_flagged = np.full(len(fourier.TERMS), np.nan)
    keep, why = np.ones(len(fourier.TERMS), dtype=bool), tuple[Remark, ...]()
    try:
        full = _fit_coefficients(method, angles, alpha, None)
        # `used` is still NaN
        if not np.isfinite(full).all():
            empty = int(np.count_nonzero(np.isnan(alpha[0])))
            why = (remark("empty-cells", found=empty, wanted=alpha[0].size),)
            full = used
        elif not vertical_penetration(full):
            full = used
            why = (remark("zero-push"),)
    except ValueError as error:
        why = (quoted(error, "no-fit"),)
    if not why:
        keep = fourier.kept_terms(full, config.fourier.threshold)
        if method == AS_PRINTED:
            printed = coefficients(config.media[_medium_of(table)].published_as or "")
            keep = fourier.as_array(printed) != 0
        used = _fit_coefficients(method, angles, alpha, keep)
        if is_flagged.any() and method == "lsq":  # the transform needs every cell
            with contextlib.suppress(ValueError):  # too few cells are left
                unflagged = unflagged_z, unflagged_x
                without_flagged = _fit_coefficients(method, angles, unflagged, keep)
    cell = cell_down(table, config.grid.angle_tolerance_deg)
    measured = np.nan if cell is None else float(cell[column("z")])
    return MediumFit(
        _medium_of(table),
        method,
        full=full,
        keep=keep,
        used=used,
        alpha_z=measured,
        table=table,
        config=config,
        why=why,
        without_flagged=without_flagged,
    )


def _fit_coefficients(
    method: str,
    angles: tuple[FloatArray, FloatArray],
    alpha: tuple[FloatArray, FloatArray],
    keep: npt.NDArray[np.bool_] | None,
) -> FloatArray:
    """Fit the terms of `keep` (None: all nine) by one method; returns shape (..., 9), with 0 for the other terms.

    `angles`: beta and gamma, rad, (n,). `alpha`: z and x, each (..., n), N/cm^3. Raises ValueError as the fits do.
    """
    if method == "lsq":
        return fourier.fit_lsq(*angles, *alpha, keep)
    all_terms = fourier.fit_dft_index(*angles, *alpha)
    return all_terms if keep is None else np.where(keep, all_terms, 0.0)


def generic_interval(fits: Sequence[MediumFit], confidence: float) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the interval of M0, each (9,), the mean of M / zeta over media with independent errors.

    `fits`: of these media, each with coefficients.
    """
    terms = [fit.draws / fit.zeta_draws[:, None] / len(fits) for fit in fits]
    return interval_of_sum(terms, [fit.dof for fit in fits], confidence)


def reference_of(fits: Sequence[MediumFit], method: str) -> Reference:
    """Return the media from which the natural sands of a campaign are scaled.

    `fits`: fits of the laboratory media, of which only those by `method` count. They are the media of the campaign, or
    the five published media if fewer than `FEWEST_MEDIA` of the campaign have a usable grid: the interval for a further
    medium needs the scatter between media. A natural sand is a medium of which only few pushes were made.
    """
    fits_of_method = [
        fit for fit in fits if fit.method == method and fit.counts and np.isfinite(fit.alpha_z)
    ]
    if len(fits_of_method) < FEWEST_MEDIA:
        return published(method)
    coefficients_of_media = {fit.medium: fit.used for fit in fits_of_method}
    chi = {fit.medium: float(chi_of(fit.alpha_z, fit.used)) for fit in fits_of_method}
    m0 = generic(np.stack([*coefficients_of_media.values()]))
    tables = {fit.medium: TableProfile.from_table(fit.table) for fit in fits_of_method}
    name = f"this campaign, method {method}"
    return reference_from(name, chi, coefficients_of_media | {GENERIC: m0}, tables)


def routine(method: str, *, printed: bool = False) -> str:
    """Return the name of the method of a natural sand in tables; `printed`: True if scaled from the published media."""
    return f"scaling routine ({method}{', published media' if printed else ''})"


def routines(method: str) -> tuple[str, str]:
    """Return both names that the method of a natural sand may have: by media of the campaign, and by published media."""
    return routine(method), routine(method, printed=True)
