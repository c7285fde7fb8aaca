"""A smooth function of depth with few degrees of freedom: cubic B-splines on even knots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

_FIRST_SHARE = 0.02


def smooth_basis(depth: FloatArray, knots: int, span: FloatArray | None = None) -> FloatArray:
    """Values of the basis functions at each depth.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        cm; depths outside the span count as its ends.
    knots : int
        Even knots over the span, at least 2.
    span : numpy.ndarray, optional
        Depths whose range the knots cover; `depth` itself if not given.

    Returns
    -------
    numpy.ndarray, shape (n, knots + 2)
    """
    other = depth if span is None else span
    low, high = float(other.min()), float(other.max())
    width = (high - low) / (knots - 1) or 1.0
    place = np.clip((depth - low) / width, 0, (knots - 1) * (1 - 1e-12))
    cell = place.astype(int)
    u = place - cell
    # the four cubic B-splines that reach into a cell
    parts = (
        (1 - u) ** 3,
        3 * u**3 - 6 * u**2 + 4,
        -3 * u**3 + 3 * u**2 + 3 * u + 1,
        u**3,
    )
    basis = np.zeros((depth.size, knots + 2))
    rows = np.arange(depth.size)
    for at, part in enumerate(parts):
        basis[rows, cell + at] = part / 6
    return basis


def contact_basis(depth: FloatArray, surface: float, deepest: float, knots: int) -> FloatArray:
    """Basis of a force that is constant above the surface, and smooth below with a bend at it.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        cm.
    surface, deepest : float
        Ends of the range below the surface, cm.
    knots : int

    Returns
    -------
    numpy.ndarray, shape (n, knots + 3)
    """
    under = np.maximum(depth - surface, 0.0)
    inner = smooth_basis(under, knots, np.array([0.0, max(deepest - surface, 1e-6)]))
    return np.column_stack([np.ones(depth.size), under[:, None] * inner])


def contact_depth(depth: FloatArray, force: FloatArray) -> float:
    """Depth at which the force begins to rise.

    Parameters
    ----------
    depth, force : numpy.ndarray, shape (n,)
        Readings in the order of time, the largest force last.

    Returns
    -------
    float
        Same unit as `depth`; of the last reading at which the force is below a fiftieth of its rise.
    """
    start = float(np.median(force[: max(8, force.size // 50)]))
    below = np.flatnonzero(force < start + _FIRST_SHARE * (force[-1] - start))
    first = int(below[-1]) if below.size else 0
    return float(depth[first])
