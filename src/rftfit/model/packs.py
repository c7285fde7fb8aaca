"""What the compiled kernel needs of a profile, as arrays of always the same types."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray

FOURIER, TABLE, DEPTH_ONLY = range(3)
"""Tags of `Pack.kind`."""

NEGLIGIBLE = 1e-9
"""Weights below this do not make an interpolated value depend on a missing cell."""


STILL = 1e-12
"""A velocity component below this part of the speed is none: rounding does not choose its side."""


class Pack(NamedTuple):
    """What the compiled kernel needs of a profile; the parts that a kind does not use are empty.

    `kind`: `FOURIER`, `TABLE` or `DEPTH_ONLY`.
    `values`: Nine coefficients, or the three values of the depth-only model; N/cm^3.
    `beta`, `gamma`: Nodes of the table, rad, from -pi/2 to pi/2 and from -pi to pi.
    `beta_bins`, `gamma_bins`: Interval in which each of many equal bins between the end nodes begins.
        A bin is narrower than any interval, so at most one step more leads to the right one.
    `cells`: shape (nb - 1, ng - 1, 8): alpha_z at the corners (beta, gamma) = 00, 01, 10, 11 of each
        cell, then alpha_x, N/cm^3.
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
    """Make a `Pack` whose parts always have the same types, so that one compilation serves all."""
    values, beta, gamma, cells = (
        np.ascontiguousarray(array, dtype=float) for array in (values, beta, gamma, cells)
    )
    return Pack(kind, values, beta, gamma, _bins(beta), _bins(gamma), cells)


def pack_values(kind: int, values: FloatArray) -> Pack:
    """Make the `Pack` of a profile without a table."""
    return make_pack(kind, values, np.zeros(0), np.zeros(0), np.zeros((0, 0, 8)))


def _bins(nodes: FloatArray) -> npt.NDArray[np.int64]:
    if nodes.size == 0:
        return np.zeros(0, dtype=np.int64)
    count = int(np.ceil(1.5 * (nodes[-1] - nodes[0]) / np.diff(nodes).min())) + 1
    starts = np.linspace(nodes[0], nodes[-1], count + 1)[:-1]
    return np.clip(np.searchsorted(nodes, starts, side="right") - 1, 0, nodes.size - 2)
