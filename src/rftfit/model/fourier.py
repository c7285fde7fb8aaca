"""The nine-term Fourier model of alpha(beta, gamma), and the two ways of fitting it.

alpha_z = A00 + A10 cos 2b + B11 sin(2b + g) + B01 sin g + Bm1 sin(g - 2b) and alpha_x = C11 cos(2b + g) + C01 cos g +
Cm1 cos(g - 2b) + D10 sin 2b, with b = beta, g = gamma in rad (Table S2 of Li, Zhang and Goldman 2013).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.symmetry import WIDEST_DEG, DirectionGrid, find_grid, torus

TERMS_Z = ("A00", "A10", "B11", "B01", "Bm1")
"""Coefficients of alpha_z."""

TERMS_X = ("C11", "C01", "Cm1", "D10")
"""Coefficients of alpha_x."""

TERMS = TERMS_Z + TERMS_X
"""Order of the coefficients in every array and table (Table S2). The compiled kernel (`rftfit.model.kernel`), the page
(``kernel.js``) and the formulas of the workbook write out the same terms."""

METHODS = ("lsq", "dft-index")
"""Methods of fitting: `fit_lsq` and `fit_dft_index`."""


def basis(beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the functions that the coefficients multiply at angles (...) in rad.

    Those of `TERMS_Z`, shape (5, ...), and those of `TERMS_X`, shape (4, ...).
    """
    b, g = np.broadcast_arrays(2 * np.asarray(beta, dtype=float), np.asarray(gamma, dtype=float))
    terms_z = np.stack([np.ones_like(b), np.cos(b), np.sin(b + g), np.sin(g), np.sin(g - b)])
    terms_x = np.stack([np.cos(b + g), np.cos(g), np.cos(g - b), np.sin(b)])
    return terms_z, terms_x


def as_array(coefficients: Mapping[str, float]) -> FloatArray:
    """Return coefficients by name as an array in the order of `TERMS`, shape (9,)."""
    return np.array([coefficients[term] for term in TERMS], dtype=float)


def evaluate(
    coefficients: FloatArray, beta: npt.ArrayLike, gamma: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return alpha_z and alpha_x of nine coefficients (9,) at angles in rad, in the unit of the coefficients."""
    terms_z, terms_x = basis(beta, gamma)
    split = len(TERMS_Z)
    return (
        np.tensordot(coefficients[:split], terms_z, 1),
        np.tensordot(coefficients[split:], terms_x, 1),
    )


def fit_lsq(
    beta: FloatArray,
    gamma: FloatArray,
    alpha_z: FloatArray,
    alpha_x: FloatArray,
    keep: npt.NDArray[np.bool_] | None = None,
) -> FloatArray:
    """Fit the nine terms by least squares at the true angles; every measured direction has the same weight.

    Cells at beta = -90 and 90 degrees are one direction, with the mean of their alpha. A measured mirror image counts
    as a separate direction; none is added by symmetry, which would count the same measurement twice.

    `beta`, `gamma`: shape (n,), rad, any directions. `alpha_z`, `alpha_x`: shape (..., n), N/cm^3; a cell that is NaN
    in one leading index (draw) is left out of all. `keep`: shape (9,), True for each term to fit; the other
    coefficients are 0; None: all. Returns coefficients in the order of `TERMS`, N/cm^3, shape (..., 9). Raises
    ValueError where the measured directions do not determine the terms.
    """
    keep = np.ones(len(TERMS), dtype=bool) if keep is None else keep
    nodes = torus(beta, gamma, images=False)
    coefficients = np.zeros((*alpha_z.shape[:-1], len(TERMS)))
    alphas = nodes.complete(alpha_z, alpha_x)
    for first_term, alpha, terms in zip(
        (0, len(TERMS_Z)), alphas, basis(nodes.beta, nodes.gamma), strict=True
    ):
        # terms of this component to fit, and directions that have alpha in all draws
        used = np.flatnonzero(keep[first_term : first_term + len(terms)])
        has_alpha = np.isfinite(alpha).reshape(-1, alpha.shape[-1]).all(axis=0)
        measured = int(has_alpha.sum())
        if measured < used.size:
            what = "direction is" if measured == 1 else "directions are"
            raise ValueError(f"{measured} measured {what} too few for {used.size} terms")
        design = terms[used][:, has_alpha]
        if np.linalg.matrix_rank(design) < used.size:
            # `pinv` would return the smallest of many solutions, which would look like a measurement
            raise ValueError(
                f"the {measured} measured directions do not determine {used.size} separate terms: "
                "more directions of plate and motion are needed"
            )
        solution = np.einsum("ij,...j->...i", np.linalg.pinv(design.T), alpha[..., has_alpha])
        coefficients[..., first_term + used] = solution
    return coefficients


def fit_dft_index(
    beta: FloatArray, gamma: FloatArray, alpha_z: FloatArray, alpha_x: FloatArray
) -> FloatArray:
    """Fit the nine terms by a discrete Fourier transform on the index grid, which is how Table S2 was made.

    The table, completed by symmetry, is treated as a regular grid although its steps of gamma are uneven: in the
    paper's 7 x 25 directions beta index i stands for (i - 3) pi/7 and gamma index k for (k - 12) 2 pi/25, with both end
    rows and columns kept. The recipe is inferred: it gives all non-zero entries of Table S2 within 0.0013 N/cm^3, and
    Table S3; least squares does not.

    Shapes as in `fit_lsq`; the transform needs every cell, so NaN in any cell gives NaN. Raises ValueError where the
    directions are no such grid.
    """
    grid = find_grid(beta, gamma)
    if grid is None or not _transformable(grid):
        raise ValueError(
            "the transform on the index grid needs every direction of a grid that runs from -90 to 90 "
            "degrees in both angles in steps of at most "
            f"{WIDEST_DEG:g}, symmetric about 0 and with 0 in it; method lsq takes any directions"
        )
    _, _, alpha_z, alpha_x = grid.complete(alpha_z, alpha_x)
    rows, columns = alpha_z.shape[-2:]
    beta_index = (np.arange(rows) - rows // 2) * np.pi / rows
    gamma_index = (np.arange(columns) - columns // 2) * 2 * np.pi / columns
    terms_z, terms_x = basis(beta_index[:, None], gamma_index[None, :])
    mean_z = np.einsum("tij,...ij->...t", terms_z, alpha_z) / (rows * columns)
    mean_x = np.einsum("tij,...ij->...t", terms_x, alpha_x) / (rows * columns)
    # a harmonic's mean square over a period is one half, a constant's is one
    scale_z = np.array([1.0, 2.0, 2.0, 2.0, 2.0])
    return np.concatenate([mean_z * scale_z, mean_x * 2.0], axis=-1)


def _transformable(grid: DirectionGrid) -> bool:
    """Return True if a completed grid is full, symmetric, with lines at 0, 90 and 180 degrees, without wide steps.

    Only then an index of a line stands for the same angle as in the paper's table.
    """
    beta, gamma = np.degrees(grid.beta), np.degrees(grid.gamma)
    symmetric = np.allclose(beta[1:], -beta[:0:-1]) and np.allclose(gamma[1:], -gamma[:0:-1])
    lines = all(np.isclose(beta, angle).any() for angle in (-90, 0))
    lines &= all(np.isclose(gamma, angle).any() for angle in (-180, -90, 0, 90))
    lines &= max(np.diff(beta).max(), np.diff(gamma).max()) <= WIDEST_DEG
    return bool(symmetric and lines and (grid.node >= 0).all())


def kept_terms(coefficients: FloatArray, threshold: float) -> npt.NDArray[np.bool_]:
    """Return True for each term that is kept, (9,): A00, and those larger than `threshold` times A00 (in the paper 0.05).

    The paper drops small terms, since media then have the same terms.
    """
    keep: npt.NDArray[np.bool_] = np.abs(coefficients) > threshold * abs(coefficients[0])
    keep[0] = True
    return keep
