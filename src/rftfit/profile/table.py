"""The measured table as a profile: completed by symmetry, interpolated between its nodes.

The reference path of every force: bilinear on the true, uneven grid of gamma, with period pi in
beta and 2 pi in gamma.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rftfit.conventions import wrap_beta, wrap_gamma
from rftfit.measure.alpha import column, grid
from rftfit.profile.base import NEGLIGIBLE, TABLE, Pack, make_pack
from rftfit.profile.symmetry import check_grid, extend, symmetrise
from rftfit.reference import BETA_DEG, GAMMA_DEG, alpha_grid

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray

    IndexArray = npt.NDArray[np.signedinteger]


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
        """See `rftfit.profile.base.Profile`: the completed table, one number a node."""
        shape = (*self.alpha_z.shape[:-2], -1)
        return self.alpha_z.reshape(shape), self.alpha_x.reshape(shape)

    @cached_property
    def pack(self) -> Pack:
        """See `rftfit.profile.base.Profile`."""
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
        """See `rftfit.profile.base.Profile`.

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
        """See `rftfit.profile.base.Profile`.

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
