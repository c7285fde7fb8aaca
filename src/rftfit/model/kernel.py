"""The compiled element kernel (Eq. 2): force on thin elements, and on an outline that moves.

F = alpha(beta, gamma) |z| A for each element. Compiled at the first call, kept on disk, never
compiled on import. All compiled functions are in this one file on purpose: the compiler's cache
watches a function's own file only, so one that called into another file could be out of date.
`rftfit.model.reference_kernel` says the same in plain numpy.

The work is done in blocks of `LANES` elements, whose quantities lie one behind the other in one
short array (row r of lane i at ``w[r * LANES + i]``): so the compiler sees that they do not
overlap and handles several elements at a time. Every loop runs over all lanes, used or not: a
length known beforehand leaves no rest to be done one by one. A block all above the surface is left
early. There is no `fastmath`: NaN stays NaN.

Steps become part of their caller (`forceinline`), and which kind of profile it is, is asked in the
caller: a call with arrays would count references, which costs as much as a block's forces.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar

import numba
import numpy as np

from rftfit.model.profiles import FOURIER, NEGLIGIBLE, STILL, TABLE

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Pack

    IntArray = npt.NDArray[np.int64]


LANES = 32
# rows of a block: an element's centre, tangent, half-length, area and velocity ...
_X, _Z, _TX, _TZ, _HALF, _AREA, _VX, _VZ = (row * LANES for row in range(8))
# ... depth times area of its submerged part, where that part's centre lies, force, moment, angles
_LOAD, _XC, _ZC, _FZ, _FX, _MOMENT, _BETA, _GAMMA = (row * LANES for row in range(8, 16))
_SIZE = 16 * LANES
_GIVEN = (_FZ, _FX, _XC, _ZC)

# atan(t) / t as a polynomial in t^2 for |t| <= tan(pi / 8), by interpolation at Chebyshev nodes;
# error below 1e-16
_ATAN = (
    1.0, -0.33333333333328435, 0.19999999998854776, -0.14285714180940765, 0.11111106178748203,
    -0.0909077303076135, 0.07689952829854219, -0.0664022783641704, 0.05688316096940551,
    -0.043479536590052985, 0.021134137915756773,
)  # fmt: skip
_TAN_PI_8 = math.sqrt(2) - 1

_F = TypeVar("_F", bound="Callable[..., Any]")


def _compiled(function: _F) -> _F:
    """Compile at the first call, in IEEE arithmetic; steps of the work become part of their caller."""
    compiler: Any = numba.njit
    step = function.__name__.startswith("_")
    try:
        result: _F = compiler(cache=True, error_model="numpy", forceinline=step)(function)
    except RuntimeError:  # no folder that the cache could be written to
        result = compiler(error_model="numpy", forceinline=step)(function)
    return result


@_compiled
def _clip(w: FloatArray) -> None:
    """Depth times area of the part below the surface, and the centre of that part."""
    for i in range(LANES):
        z, half = w[_Z + i], w[_HALF + i]
        tx, tz = w[_TX + i], w[_TZ + i]
        rise = half * abs(tz)
        low = rise - z  # depth of the lower end
        whole = low - 2 * rise >= 0
        part = 1.0 if whole else low / (2 * rise)
        depth = -z if whole else 0.5 * low
        idle = (low <= 0) | (w[_VX + i] * w[_VX + i] + w[_VZ + i] * w[_VZ + i] == 0)
        w[_LOAD + i] = 0.0 if idle else depth * part * w[_AREA + i]
        along = 0.0 if whole | (low <= 0) else half * (1 - part)
        along = -along if tz > 0 else along
        w[_XC + i] = w[_X + i] + along * tx
        w[_ZC + i] = z + along * tz


@_compiled
def _fourier(w: FloatArray, m: FloatArray) -> None:
    """Nine terms without trigonometry: cos 2b = tx^2 - tz^2, and so on."""
    a00, a10, b01, c01, d10 = m[0], m[1], m[3], m[6], m[8]
    b_sum, b_difference, c_sum, c_difference = m[2] + m[4], m[2] - m[4], m[5] + m[7], m[7] - m[5]
    for i in range(LANES):
        load, tx, tz = w[_LOAD + i], w[_TX + i], w[_TZ + i]
        vx, vz = w[_VX + i], w[_VZ + i]
        scale = -1.0 / math.sqrt(vx * vx + vz * vz)
        cos_g, sin_g = scale * vx, scale * vz
        cos_2b, sin_2b = tx * tx - tz * tz, -2.0 * tx * tz
        alpha_z = a00 + a10 * cos_2b + sin_g * (b01 + b_sum * cos_2b)
        alpha_z += cos_g * (b_difference * sin_2b)
        alpha_x = cos_g * (c01 + c_sum * cos_2b) + sin_2b * (d10 + c_difference * sin_g)
        w[_FZ + i] = 0.0 if load == 0 else load * alpha_z
        w[_FX + i] = 0.0 if load == 0 else load * alpha_x


@_compiled
def _depth_only(w: FloatArray, values: FloatArray) -> None:
    """Each component opposes its own velocity component."""
    down, up, side = values[0], values[1], values[2]
    for i in range(LANES):
        load, vx, vz = w[_LOAD + i], w[_VX + i], w[_VZ + i]
        least = STILL * math.sqrt(vx * vx + vz * vz)
        none = 0.0 * least  # NaN where a component is
        alpha_z = abs(w[_TX + i]) * (down if vz < -least else (up if vz > least else none))
        alpha_x = abs(w[_TZ + i]) * (side if vx < -least else (-side if vx > least else none))
        w[_FZ + i] = 0.0 if load == 0 else load * alpha_z
        w[_FX + i] = 0.0 if load == 0 else load * alpha_x


@_compiled
def _atan2(y: float, x: float) -> float:
    """Angle of (x, y) in [-pi, pi], to rounding, in a form that runs on several at a time."""
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    num, den = (ax, ay) if steep else (ay, ax)
    wide = num > _TAN_PI_8 * den
    t = (num - den if wide else num) / (num + den if wide else den)
    square = t * t
    total = ((_ATAN[10] * square + _ATAN[9]) * square + _ATAN[8]) * square + _ATAN[7]
    total = ((total * square + _ATAN[6]) * square + _ATAN[5]) * square + _ATAN[4]
    total = ((total * square + _ATAN[3]) * square + _ATAN[2]) * square + _ATAN[1]
    total = total * square + _ATAN[0]
    angle = t * total + (math.pi / 4 if wide else 0.0)
    angle = math.pi / 2 - angle if steep else angle
    angle = math.pi - angle if x < 0 else angle
    return -angle if y < 0 else angle


@_compiled
def _below(angle: float, nodes: FloatArray, bins: IntArray, scale: float) -> int:
    """Find the node below an angle; any node where the angle is NaN."""
    guess = (angle - nodes[0]) * scale
    guess = guess if guess > 0 else 0.0
    node: int = bins[np.uint64(int(min(guess, bins.size - 1.0)))]
    node += (node + 2 < nodes.size) & (angle >= nodes[np.uint64(node + 1)])
    return node


@_compiled
def _without(w: FloatArray, i: int, first: int, u: float, v: float) -> float:
    """Bilinear value of a lane, leaving out missing corners (NaN) that have no weight."""
    total = 0.0
    for corner, weight in enumerate(((1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v)):
        value = w[(first + corner) * LANES + i]
        if not (weight < NEGLIGIBLE and math.isnan(value)):
            total += weight * value
    return total


@_compiled
def _table(
    w: FloatArray, beta: FloatArray, gamma: FloatArray, beta_bins: IntArray,
    gamma_bins: IntArray, cells: FloatArray,
) -> None:  # fmt: skip
    """Interpolate the table. Rows of the block no longer needed take the corners of the cells."""
    for i in range(LANES):
        tx, tz = w[_TX + i], w[_TZ + i]
        # the plate has two ends; take the one toward +x
        w[_BETA + i] = _atan2(tz if tx < 0 else -tz, abs(tx))
        w[_GAMMA + i] = _atan2(-w[_VZ + i], -w[_VX + i])
    beta_scale = beta_bins.size / (beta[-1] - beta[0])
    gamma_scale = gamma_bins.size / (gamma[-1] - gamma[0])
    for i in range(LANES):  # looking up goes one by one: nothing else is done here
        row = _below(w[_BETA + i], beta, beta_bins, beta_scale)
        col = _below(w[_GAMMA + i], gamma, gamma_bins, gamma_scale)
        cell = np.uint64(row * (gamma.size - 1) + col)
        b0, g0 = beta[np.uint64(row)], gamma[np.uint64(col)]
        w[_BETA + i] -= b0
        w[_GAMMA + i] -= g0
        w[_FZ + i] = beta[np.uint64(row + 1)] - b0
        w[_FX + i] = gamma[np.uint64(col + 1)] - g0
        for corner in range(8):
            w[corner * LANES + i] = cells[cell, corner]
    missing = False
    for i in range(LANES):
        load, u, v = w[_LOAD + i], w[_BETA + i] / w[_FZ + i], w[_GAMMA + i] / w[_FX + i]
        low = (1 - u) * w[i] + u * w[2 * LANES + i]
        high = (1 - u) * w[LANES + i] + u * w[3 * LANES + i]
        fz = (1 - v) * low + v * high
        low = (1 - u) * w[4 * LANES + i] + u * w[6 * LANES + i]
        high = (1 - u) * w[5 * LANES + i] + u * w[7 * LANES + i]
        fx = (1 - v) * low + v * high
        w[_BETA + i], w[_GAMMA + i] = u, v
        w[_FZ + i] = 0.0 if load == 0 else load * fz
        w[_FX + i] = 0.0 if load == 0 else load * fx
        missing |= math.isnan(fz + fx)
    for i in range(LANES if missing else 0):
        load, u, v = w[_LOAD + i], w[_BETA + i], w[_GAMMA + i]
        w[_FZ + i] = 0.0 if load == 0 else load * _without(w, i, 0, u, v)
        w[_FX + i] = 0.0 if load == 0 else load * _without(w, i, 4, u, v)


@_compiled
def _sum(w: FloatArray, row: int) -> float:
    """Sum of a row, in four parts that need not wait for one another."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(row, row + LANES, 4):
        a, b, c, d = a + w[i], b + w[i + 1], c + w[i + 2], d + w[i + 3]
    return (a + b) + (c + d)


@_compiled
def _by_lane(body: FloatArray) -> FloatArray:
    """Elements of a body in blocks; lanes without one have no area."""
    blocks = np.zeros(((body.shape[0] + LANES - 1) // LANES, 5 * LANES))
    for element in range(body.shape[0]):
        for column in range(5):
            blocks[element // LANES, column * LANES + element % LANES] = body[element, column]
    return blocks


@_compiled
def _place(
    w: FloatArray, blocks: FloatArray, block: int, width_cm: float, poses: FloatArray, p: int
) -> None:
    """Turn and move a block of a body into a pose."""
    x0, z0, vx0, vz0, rate = poses[p, 0], poses[p, 1], poses[p, 3], poses[p, 4], poses[p, 5]
    cos_a, sin_a = math.cos(poses[p, 2]), math.sin(poses[p, 2])
    for i in range(LANES):
        bx, bz = blocks[block, _X + i], blocks[block, _Z + i]
        tx, tz = blocks[block, _TX + i], blocks[block, _TZ + i]
        half = blocks[block, _HALF + i]
        x, z = bx * cos_a + bz * sin_a, bz * cos_a - bx * sin_a
        w[_X + i], w[_Z + i] = x0 + x, z0 + z
        w[_TX + i], w[_TZ + i] = tx * cos_a + tz * sin_a, tz * cos_a - tx * sin_a
        w[_HALF + i], w[_AREA + i] = half, 2.0 * half * width_cm
        w[_VX + i], w[_VZ + i] = vx0 + rate * z, vz0 - rate * x


@_compiled
def _outward(w: FloatArray) -> None:
    """Leave out what does not move outward, to the right of its tangent."""
    for i in range(LANES):
        inward = w[_VX + i] * w[_TZ + i] - w[_VZ + i] * w[_TX + i] <= 0
        w[_LOAD + i] = 0.0 if inward else w[_LOAD + i]


@_compiled
def element_forces(pack: Pack, elements: FloatArray) -> FloatArray:
    """Force on each of any elements.

    `pack`: Of a profile. `elements`: shape (n, 8); Columns: centre x, z (cm), unit tangent x, z,
    half-length (cm), area (cm^2), velocity x, z (any one unit). C-contiguous. Returns shape (n,
    4): Columns: force z, x (N), and x, z (cm) of the submerged part's centre, where the force acts
    (the element's own centre where it does not cross the surface).
    """
    kind, values, beta, gamma, beta_bins, gamma_bins, cells = pack
    corners = cells.reshape(cells.shape[0] * cells.shape[1], 8)
    total = elements.shape[0]
    result = np.empty((total, 4))
    w = np.zeros(_SIZE)
    for start in range(0, total, LANES):
        n = min(LANES, total - start)
        for i in range(n):
            for column in range(8):
                w[column * LANES + i] = elements[start + i, column]
        _clip(w)
        if kind == FOURIER:
            _fourier(w, values)
        elif kind == TABLE:
            _table(w, beta, gamma, beta_bins, gamma_bins, corners)
        else:
            _depth_only(w, values)
        for i in range(n):
            for column, row in enumerate(_GIVEN):
                result[start + i, column] = w[row + i]
    return result


@_compiled
def pose_forces(
    pack: Pack, body: FloatArray, width_cm: float, solid: bool, poses: FloatArray, each: FloatArray
) -> FloatArray:
    """Net force and moment on an outline in each of several poses.

    `pack`: Of a profile. `body`: shape (n, 5); Elements at angle 0 about the reference point: x, z
    (cm), unit tangent x, z, half-length (cm). C-contiguous. `width_cm`: Across the plane. `solid`:
    Count only elements that move outward; the outline then runs counterclockwise. `poses`: shape
    (p, 6); Reference point x, z (cm), angle (rad, from z toward x), their rates (per s).
    C-contiguous. `each`: shape (p or 0, n, 4); Written where p: per element what `element_forces`
    gives. Returns shape (p, 3): Force z, force x (N), moment about the reference point (N cm, from
    z toward x).
    """
    kind, values, beta, gamma, beta_bins, gamma_bins, cells = pack
    corners = cells.reshape(cells.shape[0] * cells.shape[1], 8)
    blocks = _by_lane(body)
    result = np.empty((poses.shape[0], 3))
    w = np.zeros(_SIZE)
    for p in range(poses.shape[0]):
        x0, z0 = poses[p, 0], poses[p, 1]
        net_z, net_x, moment = 0.0, 0.0, 0.0 * x0  # no moment without a place, not even in the air
        for block in range(blocks.shape[0]):
            _place(w, blocks, block, width_cm, poses, p)
            _clip(w)
            if solid:
                _outward(w)
            idle = _sum(w, _LOAD) == 0
            if not idle:
                if kind == FOURIER:
                    _fourier(w, values)
                elif kind == TABLE:
                    _table(w, beta, gamma, beta_bins, gamma_bins, corners)
                else:
                    _depth_only(w, values)
                for i in range(LANES):
                    fz, fx = w[_FZ + i], w[_FX + i]
                    w[_MOMENT + i] = (w[_ZC + i] - z0) * fx - (w[_XC + i] - x0) * fz
                net_z, net_x = net_z + _sum(w, _FZ), net_x + _sum(w, _FX)
                moment += _sum(w, _MOMENT)
            if each.shape[0] > 0:
                start = block * LANES
                for i in range(min(LANES, body.shape[0] - start)):
                    for column, row in enumerate(_GIVEN):
                        each[p, start + i, column] = 0.0 if idle and column < 2 else w[row + i]
        result[p, 0], result[p, 1], result[p, 2] = net_z, net_x, moment
    return result
