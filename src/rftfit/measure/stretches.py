"""Stretches of consecutive rows: where a condition holds, and where readings are equal."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def find_stretches(is_inside: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Return the first row of every stretch of True, and the row after its last one, shape (2, k)."""
    edges = np.flatnonzero(np.diff(is_inside, prepend=False, append=False))
    return edges.reshape(-1, 2).T


def find_equal_stretches(values: np.ndarray) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the first row and the length of every stretch of equal values, shape (k,) each; `values`: shape (n,)."""
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    return starts, np.diff(np.append(starts, values.size))
