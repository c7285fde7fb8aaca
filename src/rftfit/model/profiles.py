"""Everything that answers alpha(beta, gamma): measured table, nine terms, depth-only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from rftfit.conventions import wrap_beta, wrap_gamma
from rftfit.measure.alpha import column, grid
from rftfit.model.fourier import TERMS, TERMS_Z, basis
from rftfit.model.symmetry import check_grid, extend, symmetrise
from rftfit.reference import BETA_DEG, GAMMA_DEG, alpha_grid

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray

    IndexArray = npt.NDArray[np.signedinteger]


# --- One interface for everything that answers alpha(beta, gamma): table, nine terms, depth-only.


FOURIER, TABLE, DEPTH_ONLY = range(3)
"""Tags of `Pack.kind`."""

NEGLIGIBLE = 1e-9
"""Weights below this do not make an interpolated value depend on a missing cell."""


class Pack(NamedTuple):
    """What the compiled kernel needs of a profile; the parts that a kind does not use are empty.

    Parameters
    ----------
    kind : int
        `FOURIER`, `TABLE` or `DEPTH_ONLY`.
    values : numpy.ndarray, shape (9,) or (3,)
        Nine coefficients (order of `rftfit.model.fourier.TERMS`), or alpha_z down, alpha_z up,
        alpha_x of the depth-only model; N/cm^3.
    beta, gamma : numpy.ndarray, shape (nb,), (ng,)
        Nodes of the table, rad, from -pi/2 to pi/2 and from -pi to pi.
    beta_bins, gamma_bins : numpy.ndarray of int
        Interval in which each of many equal bins between the end nodes begins. A bin is narrower
        than any interval, so at most one step more leads to the right one.
    cells : numpy.ndarray, shape (nb - 1, ng - 1, 8)
        alpha_z at the corners (beta, gamma) = 00, 01, 10, 11 of each cell, then alpha_x, N/cm^3.
    """

    kind: int
    values: FloatArray
    beta: FloatArray
    gamma: FloatArray
    beta_bins: npt.NDArray[np.int64]
    gamma_bins: npt.NDArray[np.int64]
    cells: FloatArray


class Profile(Protocol):
    """What answers alpha(beta, gamma). A profile may be a stack of draws of one and the same kind.

    A stack has parameters with leading axes; `alpha` then has them in front too, and `pack` is
    refused.
    """

    @property
    def name(self) -> str:
        """What the profile is, for tables and captions."""

    @property
    def reason(self) -> str:
        """Why alpha is NaN somewhere; empty if it is nowhere."""

    @property
    def pack(self) -> Pack:
        """Parameters for the compiled kernel. Raises ValueError for a stack of draws."""

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """Parameters of alpha_z, shape (..., p), and of alpha_x, shape (..., q), N/cm^3."""

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Alpha at attack angle `beta` and intrusion angle `gamma`.

        Parameters
        ----------
        beta, gamma : array_like
            rad, any angle; shapes broadcast to (n, ...).

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray, shape (draws, ..., n, ...)
            N/cm^3; NaN where the profile does not know, and where an angle is NaN.
        """

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Functions whose sum, weighted with `parameters`, is alpha.

        Parameters
        ----------
        beta, gamma : numpy.ndarray, shape (...)
            rad; the same shape.

        Returns
        -------
        basis_z : numpy.ndarray, shape (..., p)
        basis_x : numpy.ndarray, shape (..., q)
        """


def make_pack(
    kind: int,
    values: FloatArray | None = None,
    beta: FloatArray | None = None,
    gamma: FloatArray | None = None,
    cells: FloatArray | None = None,
) -> Pack:
    """Make a `Pack` whose parts always have the same types, so that one compilation serves all.

    `values`, `beta`, `gamma`, `cells`: See `Pack`.
    """
    nothing = np.zeros(0)
    beta = nothing if beta is None else np.ascontiguousarray(beta, dtype=float)
    gamma = nothing if gamma is None else np.ascontiguousarray(gamma, dtype=float)
    return Pack(
        kind,
        nothing if values is None else np.ascontiguousarray(values, dtype=float),
        beta,
        gamma,
        _bins(beta),
        _bins(gamma),
        np.zeros((0, 0, 8)) if cells is None else np.ascontiguousarray(cells, dtype=float),
    )


def _bins(nodes: FloatArray) -> npt.NDArray[np.int64]:
    if nodes.size == 0:
        return np.zeros(0, dtype=np.int64)
    count = int(np.ceil(1.5 * (nodes[-1] - nodes[0]) / np.diff(nodes).min())) + 1
    starts = np.linspace(nodes[0], nodes[-1], count + 1)[:-1]
    return np.clip(np.searchsorted(nodes, starts, side="right") - 1, 0, nodes.size - 2)


def alpha_from_basis(
    profile: Profile, beta: npt.ArrayLike, gamma: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """`Profile.alpha` of any profile, as the weighted sum of its basis.

    `beta`, `gamma`: rad; shapes broadcast. Returns `alpha_z`, `alpha_x`: As `Profile.alpha`.
    """
    beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
    (basis_z, basis_x), (values_z, values_x) = profile.basis(beta, gamma), profile.parameters
    return combine(values_z, basis_z), combine(values_x, basis_x)


def combine(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted sum of parameters; a missing one spoils only the sums that really contain it.

    `values`: shape (draws, ..., p); Parameters, NaN where missing. `weights`: shape (n, ..., p).
    Returns shape (draws, ..., n, ...).
    """
    missing = np.isnan(values)
    if not missing.any():
        return np.tensordot(values, weights, axes=(-1, -1))
    # relative, because a sum over elements carries a unit
    part = np.abs(weights) > NEGLIGIBLE * np.abs(weights).sum(axis=-1, keepdims=True)
    result = np.tensordot(np.where(missing, 0.0, values), weights, axes=(-1, -1))
    spoilt = np.tensordot(missing.astype(float), part.astype(float), axes=(-1, -1)) > 0
    return np.where(spoilt, np.nan, result)


# --- The measured table as a profile: completed by symmetry, interpolated between its nodes.


class TableProfile:
    """Alpha interpolated from a measured table.

    A missing cell makes alpha NaN between its neighbours (and at its mirror image), never a guess.

    Parameters
    ----------
    alpha_z, alpha_x : numpy.ndarray, shape (..., nb, ng)
        N/cm^3, rows by beta, columns by gamma, NaN where missing; leading axes are draws.
    beta, gamma : numpy.ndarray, shape (nb,), (ng,), optional
        rad, symmetric, from -pi/2 to pi/2, 0 among gamma; the grid of Table S5 by default.
    name : str, optional
    reasons : dict of (float, float) to str, optional
        Why a cell, named by (beta, gamma) in degrees, is missing.

    Raises
    ------
    ValueError
        If the grid is not such or does not fit the values.
    """

    def __init__(
        self,
        alpha_z: FloatArray,
        alpha_x: FloatArray,
        beta: FloatArray | None = None,
        gamma: FloatArray | None = None,
        name: str = "measured table",
        reasons: dict[tuple[float, float], str] | None = None,
    ) -> None:
        self.beta = np.radians(BETA_DEG) if beta is None else np.asarray(beta, dtype=float)
        measured_gamma = np.radians(GAMMA_DEG) if gamma is None else np.asarray(gamma, dtype=float)
        check_grid(self.beta, measured_gamma)
        alpha_z, alpha_x = np.asarray(alpha_z, dtype=float), np.asarray(alpha_x, dtype=float)
        shape = (self.beta.size, measured_gamma.size)
        if alpha_z.shape != alpha_x.shape or alpha_z.shape[-2:] != shape:
            raise ValueError(
                f"the grid has {shape[0]} x {shape[1]} cells, "
                f"the values have shapes {alpha_z.shape} and {alpha_x.shape}"
            )
        self.name = name
        # beta = -90 and +90 degrees are one plate: one row where the two differ or one is missing
        alpha_z, alpha_x = symmetrise(_join_ends(alpha_z), _join_ends(alpha_x))
        self.gamma, self.alpha_z, self.alpha_x = extend(measured_gamma, alpha_z, alpha_x)
        self.reason = self._why(measured_gamma, alpha_z, alpha_x, reasons or {})

    @classmethod
    def published(cls, medium: str) -> TableProfile:
        """Table S5 of one medium.

        Parameters
        ----------
        medium : str
            One of `rftfit.reference.MEDIA`.

        Returns
        -------
        TableProfile

        Raises
        ------
        KeyError
            If Table S5 has no such medium.
        """
        return cls(*alpha_grid(medium), name=f"Table S5, {medium}")

    @classmethod
    def from_table(cls, table: pd.DataFrame, name: str = "measured table") -> TableProfile:
        """Make the profile of one medium from its alpha table.

        Parameters
        ----------
        table : pandas.DataFrame
            As `rftfit.measure.alpha.alpha_table` makes it, also when read back from csv.
        name : str, optional

        Returns
        -------
        TableProfile
        """
        empty = table[~np.isfinite(table[column("z")].to_numpy(float))]
        reasons = {
            _place(row["beta_deg"], row["gamma_deg"]): row["reason"]
            for row in empty.to_dict("records")
            if isinstance(row.get("reason"), str)
        }
        alpha_z, alpha_x = grid(table, column("z")), grid(table, column("x"))
        return cls(alpha_z, alpha_x, name=name, reasons=reasons)

    def _why(
        self,
        gamma: FloatArray,
        alpha_z: FloatArray,
        alpha_x: FloatArray,
        reasons: dict[tuple[float, float], str],
    ) -> str:
        every = np.isnan(alpha_z) | np.isnan(alpha_x)
        missing = np.asarray(every.reshape(-1, *every.shape[-2:]).any(axis=0))

        def cells() -> Iterator[str]:
            for row, col in np.argwhere(missing):
                place = _place(np.degrees(self.beta[row]), np.degrees(gamma[col]))
                why = reasons.get(place)
                yield f"({place[0]:g}, {place[1]:g})" + (f": {why}" if why else "")

        if not missing.any():
            return ""
        return f"{self.name}: no alpha at (beta, gamma) in degrees " + "; ".join(cells())

    @property
    def nodes(self) -> tuple[int, int]:
        """Number of nodes in beta and in gamma, of the completed table."""
        return self.beta.size, self.gamma.size

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`: the completed table, one number a node."""
        shape = (*self.alpha_z.shape[:-2], -1)
        return self.alpha_z.reshape(shape), self.alpha_x.reshape(shape)

    @cached_property
    def pack(self) -> Pack:
        """See `rftfit.model.profiles.Profile`."""
        if self.alpha_z.ndim > 2:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        corners = [
            alpha[first : first + self.beta.size - 1, second : second + self.gamma.size - 1]
            for alpha in (self.alpha_z, self.alpha_x)
            for first in (0, 1)
            for second in (0, 1)
        ]
        return make_pack(TABLE, None, self.beta, self.gamma, np.stack(corners, axis=-1))

    def _corners(
        self, beta: FloatArray, gamma: FloatArray
    ) -> Iterator[tuple[IndexArray, IndexArray, FloatArray]]:
        """Row, column and weight of each of the four nodes around a point."""
        beta, gamma = wrap_beta(beta), wrap_gamma(gamma)
        row, u = _interval(self.beta, beta)
        col, v = _interval(self.gamma, gamma)
        for first, weight_u in ((0, 1 - u), (1, u)):
            for second, weight_v in ((0, 1 - v), (1, v)):
                yield row + first, col + second, weight_u * weight_v

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : numpy.ndarray

        Returns
        -------
        basis_z, basis_x : numpy.ndarray
            One and the same: both components are interpolated alike.
        """
        result = np.zeros((beta.size, self.beta.size * self.gamma.size))
        points = np.arange(beta.size)
        for row, col, weight in self._corners(beta.ravel(), gamma.ravel()):
            result[points, row * self.gamma.size + col] += weight
        result = result.reshape(*beta.shape, -1)
        return result, result

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : array_like

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray
        """
        beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
        corners = list(self._corners(beta, gamma))

        def total(values: FloatArray) -> FloatArray:
            result = np.zeros((*values.shape[:-2], *beta.shape))
            for row, col, weight in corners:
                there = values[..., row, col]
                # a node without weight may be missing
                idle = (weight < NEGLIGIBLE) & np.isnan(there)
                result += np.where(idle, 0.0, weight * there)
            return result

        return total(self.alpha_z), total(self.alpha_x)


def _place(beta_deg: float, gamma_deg: float) -> tuple[float, float]:
    """Name of a cell: its angles rounded, so that those of a file and of a grid agree."""
    return round(float(beta_deg), 1) + 0.0, round(float(gamma_deg), 1) + 0.0


def _join_ends(alpha: FloatArray) -> FloatArray:
    """Give the first and the last row their mean, or the one value that there is."""
    alpha = alpha.copy()
    first, last = alpha[..., 0, :], alpha[..., -1, :]
    joined = np.where(np.isnan(first), last, np.where(np.isnan(last), first, (first + last) / 2))
    alpha[..., 0, :] = alpha[..., -1, :] = joined
    return alpha


def _interval(nodes: FloatArray, at: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Interval between nodes, and the place inside it from 0 to 1 (NaN where `at` is)."""
    index = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, nodes.size - 2)
    return index, (at - nodes[index]) / (nodes[index + 1] - nodes[index])


# --- The nine-term Fourier profile, and the generic one scaled by zeta.


@dataclass(frozen=True)
class FourierProfile:
    """Alpha as a sum of nine terms (`rftfit.model.fourier`).

    Parameters
    ----------
    coefficients : numpy.ndarray, shape (..., 9)
        N/cm^3, in the order of `rftfit.model.fourier.TERMS`; leading axes are draws.
    name : str, optional
    reason : str, optional
        Why there are no coefficients, where they are NaN.

    Raises
    ------
    ValueError
        If there are not nine coefficients.
    """

    coefficients: FloatArray
    name: str = "nine terms"
    reason: str = ""

    def __post_init__(self) -> None:
        values = np.asarray(self.coefficients, dtype=float)
        if values.ndim == 0 or values.shape[-1] != len(TERMS):
            raise ValueError(f"nine coefficients wanted, found an array of shape {values.shape}")
        object.__setattr__(self, "coefficients", values)
        if not self.reason and np.isnan(values).any():
            object.__setattr__(self, "reason", f"{self.name}: a coefficient is missing")

    @property
    def pack(self) -> Pack:
        """See `rftfit.model.profiles.Profile`."""
        if self.coefficients.ndim > 1:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        return make_pack(FOURIER, self.coefficients)

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`."""
        split = len(TERMS_Z)
        return self.coefficients[..., :split], self.coefficients[..., split:]

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : numpy.ndarray

        Returns
        -------
        basis_z, basis_x : numpy.ndarray
        """
        terms_z, terms_x = basis(beta, gamma)
        unknown = np.isnan(beta) | np.isnan(gamma)  # the constant term would hide it
        terms_z = np.where(unknown, np.nan, terms_z)
        return np.moveaxis(terms_z, 0, -1), np.moveaxis(terms_x, 0, -1)

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : array_like

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray
        """
        return alpha_from_basis(self, beta, gamma)


def scaled_generic(zeta: npt.ArrayLike, m0: FloatArray, name: str = "generic") -> FourierProfile:
    """Make the profile of a medium known by its scaling factor alone: zeta times generic.

    Parameters
    ----------
    zeta : array_like, shape (...)
        Dimensionless; an array makes a stack of draws.
    m0 : numpy.ndarray, shape (..., 9)
        Generic coefficients; leading axes (draws) go with those of `zeta`.
    name : str, optional

    Returns
    -------
    FourierProfile

    Raises
    ------
    ValueError
        If there are not nine coefficients.
    """
    return FourierProfile(np.asarray(zeta, dtype=float)[..., None] * m0, name)


# --- The depth-only model: the baseline that knows depth and projected area, but no angles.


STILL = 1e-12
"""A velocity component below this part of the speed is none: rounding does not choose its side."""


@dataclass(frozen=True)
class DepthOnlyProfile:
    """Each component opposes its own velocity component, whatever the angles (design section 2).

    alpha_z = alpha_z(0, pi/2) |cos beta| going down, alpha_z(0, -pi/2) |cos beta| going up, 0 in
    purely horizontal motion; alpha_x = alpha_x(pi/2, 0) |sin beta| going toward -x, its negative
    going toward +x, 0 in purely vertical motion.

    Parameters
    ----------
    values : numpy.ndarray, shape (..., 3)
        alpha_z(0, pi/2), alpha_z(0, -pi/2) (negative: it pulls down what goes up) and
        alpha_x(pi/2, 0), N/cm^3; leading axes are draws.
    name : str, optional
    reason : str, optional
        Why a value is missing.

    Raises
    ------
    ValueError
        If there are not three values.
    """

    values: FloatArray
    name: str = "depth-only"
    reason: str = ""

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=float)
        if values.ndim == 0 or values.shape[-1] != 3:
            raise ValueError(f"three values wanted, found an array of shape {values.shape}")
        object.__setattr__(self, "values", values)

    @classmethod
    def of(cls, profile: Profile, name: str = "depth-only") -> DepthOnlyProfile:
        """Take the three values from another profile (measured: from the table).

        Parameters
        ----------
        profile : Profile
            One, or a stack of draws.
        name : str, optional

        Returns
        -------
        DepthOnlyProfile
        """
        alpha_z, alpha_x = profile.alpha([0.0, 0.0, np.pi / 2], [np.pi / 2, -np.pi / 2, 0.0])
        values = np.concatenate([alpha_z[..., :2], alpha_x[..., 2:]], axis=-1)
        return cls(values, name, profile.reason if np.isnan(values).any() else "")

    @property
    def pack(self) -> Pack:
        """See `rftfit.model.profiles.Profile`."""
        if self.values.ndim > 1:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        return make_pack(DEPTH_ONLY, self.values)

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`."""
        return self.values[..., :2], self.values[..., 2:]

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : numpy.ndarray

        Returns
        -------
        basis_z, basis_x : numpy.ndarray
        """
        down, left = np.sin(gamma), np.cos(gamma)  # parts of the velocity toward -z and -x
        level, upright = np.abs(np.cos(beta)), np.abs(np.sin(beta))
        unknown = np.isnan(beta) | np.isnan(gamma)
        basis_z = np.stack([level * (down > STILL), level * (down < -STILL)], axis=-1)
        basis_x = upright * ((left > STILL).astype(float) - (left < -STILL))
        basis_z, basis_x = (
            np.where(unknown[..., None], np.nan, part) for part in (basis_z, basis_x[..., None])
        )
        return basis_z, basis_x

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """See `rftfit.model.profiles.Profile`.

        Parameters
        ----------
        beta, gamma : array_like

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray
        """
        return alpha_from_basis(self, beta, gamma)
