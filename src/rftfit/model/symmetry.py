"""The symmetry of alpha under a mirror image in x, and the completion of a table by it.

All directions (beta, gamma) form a torus, since both angles are periodic. The mirror image in x of the experiment at
(beta, gamma) is that at (-beta, 180 deg - gamma): alpha_z is the same there, alpha_x has the opposite sign. Where it
was not pushed, alpha is that of its mirror image. A table has n cells; angles are in rad unless a name says deg.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray, mirror
from rftfit.directions import TOLERANCE_DEG

WIDEST_DEG = 70.0
"""Largest distance of neighbouring lines of a grid between which alpha is interpolated."""

LEAST_FILL = 0.5
"""Least share of the crossings of a grid that have a direction; with less the directions count as scattered."""

_PER_DEGREE = 1_000_000
"""Steps of a degree to which angles are rounded before they are compared: a millionth of a degree."""


class Torus(NamedTuple):
    """m different directions of the cells of a table and, unless they are left out, of the mirror images of the cells.

    `beta`, `gamma`: shape (m,); rad, beta in [-pi/2, pi/2), gamma in [-pi, pi).
    `cell`: shape (m, k); indices of the cells of the table with this direction, filled up with -1.
    `sign`: shape (m, k); factor of alpha_x of the cell: -1 if the direction is that of the mirror image of the cell.
    """

    beta: FloatArray
    gamma: FloatArray
    cell: npt.NDArray[np.intp]
    sign: FloatArray

    def complete(self, alpha_z: FloatArray, alpha_x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return alpha_z and alpha_x in every direction, (..., m): means of the finite alpha of its cells (..., n)."""
        return self._mean(alpha_z, np.ones_like(self.sign)), self._mean(alpha_x, self.sign)

    def _mean(self, alpha: FloatArray, sign: FloatArray) -> FloatArray:
        """Return the mean over the cells of each direction of alpha times `sign`, (..., m); NaN without a finite alpha.

        `alpha`: in the cells, (..., n). `sign`: (m, k).
        """
        total = np.zeros((*alpha.shape[:-1], len(self.cell)))
        count = np.zeros(total.shape)
        # a direction has few cells: the loop goes over these, for all directions at a time
        for cell, sign_of_cell in zip(self.cell.T, sign.T, strict=True):
            signed_alpha = alpha[..., cell] * sign_of_cell
            is_finite = np.isfinite(signed_alpha) & (cell >= 0)
            np.add(total, signed_alpha, out=total, where=is_finite)
            count += is_finite
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def torus(beta: FloatArray, gamma: FloatArray, *, images: bool = True) -> Torus:
    """Complete the n directions of the cells of a table by symmetry (supplement of the paper).

    The experiment at (beta, gamma) seen from behind is the one at (-beta, pi - gamma): alpha_z is the
    same there, alpha_x has the opposite sign. Plates at beta = -90 and 90 degrees are the same plate.
    `beta`, `gamma`: shape (n,), rad. `images`: False adds no mirror images; measured directions that are mirror images
    of each other then stay apart. The directions are sorted by beta, then gamma.
    """
    image_beta, image_gamma = mirror(beta, gamma) if images else (beta[:0], gamma[:0])
    beta_deg = np.degrees(np.concatenate([beta, image_beta]))
    gamma_deg = np.degrees(np.concatenate([gamma, image_gamma]))
    # one whole number for each direction, equal for angles that agree to a millionth of a degree
    beta_steps = np.round((beta_deg + 90) * _PER_DEGREE).astype(np.int64) % (180 * _PER_DEGREE)
    gamma_steps = np.round((gamma_deg + 180) * _PER_DEGREE).astype(np.int64) % (360 * _PER_DEGREE)
    _, first, number = np.unique(
        beta_steps * (360 * _PER_DEGREE) + gamma_steps, return_index=True, return_inverse=True
    )
    # cells and images sorted by the number of their direction; slot: how many of the same direction come before
    order = np.argsort(number, kind="stable")
    number = number[order]
    slot = np.arange(number.size) - np.searchsorted(number, number)
    cell = np.full((first.size, int(slot.max(initial=-1)) + 1), -1)
    sign = np.ones(cell.shape)
    cell[number, slot] = order % max(beta.size, 1)
    sign[number, slot] = np.where(order < beta.size, 1.0, -1.0)
    return Torus(
        np.radians((beta_deg[first] + 90) % 180 - 90),
        np.radians((gamma_deg[first] + 180) % 360 - 180),
        cell,
        sign,
    )


def list_once(beta: FloatArray, gamma: FloatArray) -> tuple[npt.NDArray[np.intp], Torus]:
    """List the directions of a table, where a direction and its mirror image count as one.

    Of the two the one with |gamma| up to 90 degrees is listed, if the table has it. Returns indices of the cells whose
    directions are listed, (listed,), and a torus of these directions alone, whose `complete` is the mean of each
    direction and its mirror image.
    """
    # cells in the order of preference: those beyond |gamma| = 90 degrees, and of these at beta = -90 degrees, come last
    edge = np.pi / 2 + 1e-9
    order = np.lexsort((gamma, beta, beta < 1e-9 - np.pi / 2, np.abs(gamma) > edge))
    whole = torus(beta[order], gamma[order])
    # the best cell of each direction and its slot; empty slots rank last
    rank = np.where(whole.cell < 0, beta.size, whole.cell)
    best_slot = rank.argmin(axis=1, keepdims=True)
    best_rank = np.take_along_axis(rank, best_slot, axis=1)[:, 0]
    # a direction and its mirror image have the same cells: the one in which the best cell lies itself is listed
    listed = np.flatnonzero(np.take_along_axis(whole.sign, best_slot, axis=1)[:, 0] > 0)
    listed = listed[np.argsort(best_rank[listed])]
    cell = np.where(whole.cell < 0, -1, order[whole.cell])[listed]
    directions = Torus(whole.beta[listed], whole.gamma[listed], cell, whole.sign[listed])
    return order[best_rank[listed]], directions


class DirectionGrid(NamedTuple):
    """The grid on which the directions of a table and their mirror images lie.

    `beta`, `gamma`: shape (nb,), (ng,); lines of the grid, rad, increasing, in the ranges of `Torus`.
    `torus`: the directions, with the angles of the lines.
    `node`: shape (nb, ng); index of each crossing in the torus, -1 if no cell has this direction.
    """

    beta: FloatArray
    gamma: FloatArray
    torus: Torus
    node: npt.NDArray[np.intp]

    def complete(
        self, alpha_z: FloatArray, alpha_x: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Complete alpha of the cells by mirror images, and by periods to beta -90 to 90 and gamma -180 to 180 degrees.

        If no line lies at an end, alpha there is interpolated; opposite ends are equal. In a gap wider than
        `WIDEST_DEG` a line of NaN is added. `alpha_z`, `alpha_x`: shape (..., n), in the cells of the table. Returns
        the lines of the completed grid in beta and gamma (rad), and both alpha at its nodes, shape (..., lines of beta,
        lines of gamma).
        """
        completed = []
        for alpha in self.torus.complete(alpha_z, alpha_x):
            filled = np.where(self.node >= 0, alpha[..., self.node], np.nan)
            gamma, filled = _close(self.gamma, filled, np.pi)
            beta, filled = _close(self.beta, np.swapaxes(filled, -1, -2), np.pi / 2)
            # contiguous, so that `TableProfile.parameters` needs no copy
            completed.append(np.ascontiguousarray(np.swapaxes(filled, -1, -2)))
        return beta, gamma, completed[0], completed[1]


def _close(nodes: FloatArray, alpha: FloatArray, half: float) -> tuple[FloatArray, FloatArray]:
    """Return nodes of a periodic angle, and alpha (..., nodes) at them, extended to both ends -half and half of the period.

    Alpha at both ends is the same: that of a node there, or interpolated between the last and the first node. Gaps
    wider than `WIDEST_DEG` get a node of NaN in their middle.
    """
    widest = np.radians(WIDEST_DEG)
    if np.isclose(nodes[0], -half):
        nodes = np.append(nodes, half)
        alpha = np.concatenate([alpha, alpha[..., :1]], axis=-1)
    else:
        gap = nodes[0] + 2 * half - nodes[-1]
        share = (half - nodes[-1]) / gap if gap <= widest else np.nan
        end = (1 - share) * alpha[..., -1:] + share * alpha[..., :1]
        nodes = np.concatenate([[-half], nodes, [half]])
        alpha = np.concatenate([end, alpha, end], axis=-1)
    wide = np.flatnonzero(np.diff(nodes) > widest)
    middle = (nodes[wide] + nodes[wide + 1]) / 2
    return np.insert(nodes, wide + 1, middle), np.insert(alpha, wide + 1, np.nan, axis=-1)


def find_grid(beta: FloatArray, gamma: FloatArray) -> DirectionGrid | None:
    """Return the grid on which the directions of a table and their mirror images lie; None if they are scattered.

    Angles that differ by less than `rftfit.directions.TOLERANCE_DEG` share a line. A table with fewer than two
    lines in either angle, or with more holes than values, is no grid.
    """
    # by the size of beta, so that a direction and its mirror image share the lines beta and -beta
    size = _move_to_lines(np.abs(np.degrees(beta)), (0.0, 90.0))
    return find_exact_grid(
        torus(np.radians(np.copysign(size, beta)), np.radians(_move_to_lines(np.degrees(gamma))))
    )


def find_exact_grid(directions: Torus) -> DirectionGrid | None:
    """Return the grid on which directions lie exactly, without moving an angle to a line; None if they are scattered."""
    beta, row = np.unique(directions.beta.round(9), return_inverse=True)
    gamma, column = np.unique(directions.gamma.round(9), return_inverse=True)
    if min(beta.size, gamma.size) < 2 or row.size < LEAST_FILL * beta.size * gamma.size:
        return None
    node = np.full((beta.size, gamma.size), -1)
    node[row, column] = np.arange(row.size)
    # the lines have the exact angles, which were rounded for the search alone
    beta[row], gamma[column] = directions.beta, directions.gamma
    return DirectionGrid(beta, gamma, directions, node)


def _move_to_lines(angles_deg: FloatArray, exact: tuple[float, ...] = ()) -> FloatArray:
    """Return angles, those that are nearly equal replaced by their median, or by an angle of `exact` if one is near.

    Measured angles of one line of a grid differ by the play of a rig. `angles_deg`: shape (n,).
    """
    angles, number = np.unique(angles_deg, return_inverse=True)
    # a step wider than the tolerance begins a new line
    line = np.cumsum(np.diff(angles, prepend=angles[:1]) > TOLERANCE_DEG)
    for line_number in np.unique(line):
        line_angles = angles[line == line_number]
        near = [e for e in exact if abs(line_angles - e).min() <= TOLERANCE_DEG / 2]
        angles[line == line_number] = near[0] if near else line_angles[line_angles.size // 2]
    return angles[number]
