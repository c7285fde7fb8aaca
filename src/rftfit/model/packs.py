"""The numbers of a profile as the compiled kernel needs them: arrays whose types are always the same."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray

FOURIER, TABLE, DEPTH_ONLY = range(3)
"""Values of `Pack.kind`: nine terms, a table, the depth-only model."""

NEGLIGIBLE = 1e-9
"""Largest weight of a missing cell that an interpolated value ignores instead of being NaN."""

STILL = 1e-12
"""Velocity component, relative to the speed, below which it counts as 0, so that rounding does not choose its sign."""


class Pack(NamedTuple):
    """Numbers of a profile for the compiled kernel; fields that a kind does not use are empty.

    `kind`: `FOURIER`, `TABLE` or `DEPTH_ONLY`.
    `values`: Nine coefficients, or the three alphas of the depth-only model; N/cm^3.
    `beta`, `gamma`: Nodes of the table, rad, from -pi/2 to pi/2 and from -pi to pi.
    `beta_bins`, `gamma_bins`: The range of the nodes is divided into equal bins; for each bin the index of the interval
        between nodes in which the bin begins. A bin is narrower than any interval, so an angle of the bin lies in this
        interval or in the next one.
    `cells`: shape (nb - 1, ng - 1, 8): alpha_z at the corners (beta, gamma) = 00, 01, 10, 11 of each
        cell, then alpha_x at the same corners, N/cm^3.
    """

    kind: int
    values: FloatArray
    beta: FloatArray
    gamma: FloatArray
    beta_bins: npt.NDArray[np.int64]
    gamma_bins: npt.NDArray[np.int64]
    cells: FloatArray


def make_pack(
    kind: int, values: FloatArray, beta: FloatArray, gamma: FloatArray, cells: FloatArray
) -> Pack:
    """Make a `Pack` from its fields, whose arrays always have the same types, so that one compilation serves all."""
    values, beta, gamma, cells = (
        np.ascontiguousarray(array, dtype=float) for array in (values, beta, gamma, cells)
    )
    return Pack(
        kind, values, beta, gamma, _intervals_of_bins(beta), _intervals_of_bins(gamma), cells
    )


def pack_values(kind: int, values: FloatArray) -> Pack:
    """Make the `Pack` of a profile without a table; `kind`: `FOURIER` or `DEPTH_ONLY`. `values`: as in `Pack`."""
    return make_pack(kind, values, np.zeros(0), np.zeros(0), np.zeros((0, 0, 8)))


def _intervals_of_bins(nodes: FloatArray) -> npt.NDArray[np.int64]:
    """Return `beta_bins` or `gamma_bins` of a `Pack` for increasing nodes, rad; empty without nodes.

    With them the kernel finds the nodes around an angle without a search.
    """
    if nodes.size == 0:
        return np.zeros(0, dtype=np.int64)
    # more than one bin for the narrowest interval, so that no bin reaches into a third interval
    count = int(np.ceil(1.5 * (nodes[-1] - nodes[0]) / np.diff(nodes).min())) + 1
    starts = np.linspace(nodes[0], nodes[-1], count + 1)[:-1]
    return np.clip(np.searchsorted(nodes, starts, side="right") - 1, 0, nodes.size - 2)
