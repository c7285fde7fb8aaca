"""One interface for everything that answers alpha(beta, gamma): table, nine terms, depth-only.

Whoever needs forces takes a `Profile` and never asks which kind it is. Every kind is linear in its
parameters, so that draws of the parameters (bootstrap) can be carried through an integral at the
cost of one matrix product.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray

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
        Nine coefficients (order of `rftfit.profile.fourier.TERMS`), or alpha_z down, alpha_z up,
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

    Parameters
    ----------
    kind : int
    values, beta, gamma, cells : numpy.ndarray, optional
        See `Pack`.

    Returns
    -------
    Pack
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

    Parameters
    ----------
    profile : Profile
    beta, gamma : array_like
        rad; shapes broadcast.

    Returns
    -------
    alpha_z, alpha_x : numpy.ndarray
        As `Profile.alpha`.
    """
    beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
    (basis_z, basis_x), (values_z, values_x) = profile.basis(beta, gamma), profile.parameters
    return combine(values_z, basis_z), combine(values_x, basis_x)


def combine(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted sum of parameters; a missing one spoils only the sums that really contain it.

    Parameters
    ----------
    values : numpy.ndarray, shape (draws, ..., p)
        Parameters, NaN where missing.
    weights : numpy.ndarray, shape (n, ..., p)

    Returns
    -------
    numpy.ndarray, shape (draws, ..., n, ...)
    """
    missing = np.isnan(values)
    if not missing.any():
        return np.tensordot(values, weights, axes=(-1, -1))
    # relative, because a sum over elements carries a unit
    part = np.abs(weights) > NEGLIGIBLE * np.abs(weights).sum(axis=-1, keepdims=True)
    result = np.tensordot(np.where(missing, 0.0, values), weights, axes=(-1, -1))
    spoilt = np.tensordot(missing.astype(float), part.astype(float), axes=(-1, -1)) > 0
    return np.where(spoilt, np.nan, result)
