"""The symmetry of alpha under mirroring x, and the torus of all directions that it completes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray, mirror
from rftfit.directions import TOLERANCE_DEG

WIDEST_DEG = 70.0
"""Nothing is interpolated between lines of a grid that are farther apart."""

LEAST_FILL = 0.5
"""Part of the pairs of a grid that is known: with less, the directions are scattered."""

_PER_DEGREE = 1_000_000
"""Directions are the same where they agree to a millionth of a degree."""


class Torus(NamedTuple):
    """Directions that a table tells of, each once: of its cells, and of their mirror images where asked for.

    `beta`, `gamma`: shape (m,); rad, beta in [-pi/2, pi/2), gamma in [-pi, pi).
    `cell`: shape (m, k); the cells of the table that tell of a direction, -1 where there are fewer.
    `sign`: shape (m, k); -1 where a cell tells of it as its mirror image, which turns alpha_x.
    """

    beta: FloatArray
    gamma: FloatArray
    cell: npt.NDArray[np.intp]
    sign: FloatArray

    def complete(self, alpha_z: FloatArray, alpha_x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Alpha of every direction, shape (..., m): the mean of the cells (..., n) that are known of it."""
        return self._mean(alpha_z, np.ones_like(self.sign)), self._mean(alpha_x, self.sign)

    def _mean(self, alpha: FloatArray, sign: FloatArray) -> FloatArray:
        total = np.zeros((*alpha.shape[:-1], len(self.cell)))
        count = np.zeros(total.shape)
        # few cells tell of a direction: a whole row of directions at a time
        for cell, sign_of_cell in zip(self.cell.T, sign.T, strict=True):
            values = alpha[..., cell] * sign_of_cell
            is_finite = np.isfinite(values) & (cell >= 0)
            np.add(total, values, out=total, where=is_finite)
            count += is_finite
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def torus(beta: FloatArray, gamma: FloatArray, *, images: bool = True) -> Torus:
    """Complete the directions of a table by symmetry (supplement of the paper).

    The experiment at (beta, gamma) seen from behind is that at (-beta, pi - gamma): alpha_z is the
    same there, alpha_x has the other sign. Plates at beta = -90 and 90 degrees are one and the same.
    `beta`, `gamma`: shape (n,); rad, one a cell. `images`: False leaves out what is known only as a
    mirror image, and takes no mean of two that were both measured. Returns directions by beta, then gamma.
    """
    image_beta, image_gamma = mirror(beta, gamma) if images else (beta[:0], gamma[:0])
    beta_deg = np.degrees(np.concatenate([beta, image_beta]))
    gamma_deg = np.degrees(np.concatenate([gamma, image_gamma]))
    rows = np.round((beta_deg + 90) * _PER_DEGREE).astype(np.int64) % (180 * _PER_DEGREE)
    columns = np.round((gamma_deg + 180) * _PER_DEGREE).astype(np.int64) % (360 * _PER_DEGREE)
    key = rows * (360 * _PER_DEGREE) + columns
    _, first_cells, place = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(place, kind="stable")
    slot = np.arange(key.size) - np.searchsorted(place[order], place[order])
    cell = np.full((first_cells.size, int(slot.max(initial=-1)) + 1), -1)
    sign = np.ones(cell.shape)
    cell[place[order], slot] = order % beta.size if beta.size else 0
    sign[place[order], slot] = np.where(order < beta.size, 1.0, -1.0)
    return Torus(
        np.radians((beta_deg[first_cells] + 90) % 180 - 90) if first_cells.size else np.empty(0),
        np.radians((gamma_deg[first_cells] + 180) % 360 - 180) if first_cells.size else np.empty(0),
        cell,
        sign,
    )


def each_once(beta: FloatArray, gamma: FloatArray) -> tuple[npt.NDArray[np.intp], Torus]:
    """List the directions of a table once, without mirror images; |gamma| up to 90 degrees where there is a choice.

    Returns the cells whose directions are listed, and a torus of just these directions.
    """
    edge = np.pi / 2 + 1e-9
    order = np.lexsort((gamma, beta, beta < 1e-9 - np.pi / 2, np.abs(gamma) > edge))
    sorted_torus = torus(beta[order], gamma[order])
    cell = np.where(sorted_torus.cell < 0, beta.size, sorted_torus.cell)
    slot = cell.argmin(axis=1, keepdims=True)
    first_cells = np.take_along_axis(cell, slot, axis=1)[:, 0]
    # of a direction and its mirror image, which have the same cells, the one that the first cell has itself
    unmirrored = np.flatnonzero(np.take_along_axis(sorted_torus.sign, slot, axis=1)[:, 0] > 0)
    unmirrored = unmirrored[np.argsort(first_cells[unmirrored])]
    listed = Torus(
        sorted_torus.beta[unmirrored],
        sorted_torus.gamma[unmirrored],
        np.where(sorted_torus.cell[unmirrored] < 0, -1, order[sorted_torus.cell[unmirrored]]),
        sorted_torus.sign[unmirrored],
    )
    return order[first_cells[unmirrored]], listed


class Rectangle(NamedTuple):
    """A table whose directions lie on a grid.

    `beta`, `gamma`: shape (nb,), (ng,); lines of the grid, rad, increasing, in the ranges of `Torus`.
    `torus`: The directions, with the angles of the lines.
    `node`: shape (nb, ng); place of each crossing in the torus, -1: no cell tells of it.
    """

    beta: FloatArray
    gamma: FloatArray
    torus: Torus
    node: npt.NDArray[np.intp]

    def closed(self, alpha: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Grid from -90 to 90 degrees of beta and -180 to 180 of gamma, whose opposite ends are one.

        An end between two lines is interpolated; in a gap wider than `WIDEST_DEG` stands a line of
        NaN. `alpha`: shape (..., m), of the torus. Returns beta, gamma and values on them.
        """
        filled = np.where(self.node >= 0, alpha[..., self.node], np.nan)
        gamma, values = _close(self.gamma, filled, np.pi)
        beta, turned = _close(self.beta, np.swapaxes(values, -1, -2), np.pi / 2)
        # in the order of memory that tables have, so that `TableProfile.parameters` takes no copy
        return beta, gamma, np.ascontiguousarray(np.swapaxes(turned, -1, -2))


def _close(nodes: FloatArray, values: FloatArray, half: float) -> tuple[FloatArray, FloatArray]:
    """Close a period along the last axis; `nodes` lie in [-half, half)."""
    widest = np.radians(WIDEST_DEG)
    if np.isclose(nodes[0], -half):
        end = values[..., :1]
        nodes = np.append(nodes, half)
        values = np.concatenate([values, end], axis=-1)
    else:
        gap = nodes[0] + 2 * half - nodes[-1]
        share = (half - nodes[-1]) / gap if gap <= widest else np.nan
        end = (1 - share) * values[..., -1:] + share * values[..., :1]
        nodes = np.concatenate([[-half], nodes, [half]])
        values = np.concatenate([end, values, end], axis=-1)
    wide = np.flatnonzero(np.diff(nodes) > widest)
    middle = (nodes[wide] + nodes[wide + 1]) / 2
    return np.insert(nodes, wide + 1, middle), np.insert(values, wide + 1, np.nan, axis=-1)


def rectangle(beta: FloatArray, gamma: FloatArray) -> Rectangle | None:
    """Grid on which the directions of a table lie; None where they are scattered.

    Angles that differ by less than `rftfit.directions.TOLERANCE_DEG` share a line. A table with fewer than two
    lines in either angle, or with more holes than values, is no grid.
    """
    size = _lined_up(np.abs(np.degrees(beta)), (0.0, 90.0))
    return grid_of_directions(
        torus(np.radians(np.copysign(size, beta)), np.radians(_lined_up(np.degrees(gamma))))
    )


def grid_of_directions(directions: Torus) -> Rectangle | None:
    """Grid on which directions lie as they are, with no line moved; None where they are scattered."""
    rows, row = np.unique(directions.beta.round(9), return_inverse=True)
    columns, column = np.unique(directions.gamma.round(9), return_inverse=True)
    if min(rows.size, columns.size) < 2 or row.size < LEAST_FILL * rows.size * columns.size:
        return None
    node = np.full((rows.size, columns.size), -1)
    node[row, column] = np.arange(row.size)
    # the angles themselves, not the rounded ones
    rows[row], columns[column] = directions.beta, directions.gamma
    return Rectangle(rows, columns, directions, node)


def _lined_up(angles_deg: FloatArray, exact: tuple[float, ...] = ()) -> FloatArray:
    """Replace angles that are nearly the same by one of them; near an `exact` one by that."""
    values, place = np.unique(angles_deg, return_inverse=True)
    line = np.cumsum(np.diff(values, prepend=values[:1]) > TOLERANCE_DEG)
    for line_number in np.unique(line):
        angles_of_line = values[line == line_number]
        middle = float(angles_of_line[angles_of_line.size // 2])
        near = [e for e in exact if abs(angles_of_line - e).min() <= TOLERANCE_DEG / 2]
        values[line == line_number] = near[0] if near else middle
    return values[place]
