"""The compiled kernel (Eqs. 2 and 3): alpha of angles, forces on moving outlines, and the robot's steps in time.

F = alpha(beta, gamma) |z| A for each element. `rftfit.forces.reference_kernel` and the profiles calculate the same in
plain numpy. Functions are compiled at their first call and kept on disk. The compiler's cache compiles a function again
only if the file of this function changes, so all that is compiled, constants too, stands in this file.

Elements are handled in blocks of `LANES`. A block at rest, and the work array ``w`` of a block that moves, are flat
arrays of rows: row ``_X`` holds x of all elements of the block, element i at ``w[_X + i]``. The compiler then sees that
rows do not overlap, and calculates several elements at a time. Sums may be reordered; NaN stays NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.packs import Pack

IntArray = npt.NDArray[np.int64]
_F = TypeVar("_F", bound=Callable[..., Any])

# the same numbers as in `rftfit.model.packs`: a change of that file would not compile this one again
_FOURIER, _TABLE, _NEGLIGIBLE, _STILL = 0, 1, 1e-9, 1e-12
"""Kinds of `Pack`, the weight of a missing corner that does not count, and the relative velocity that counts as 0."""

SAMPLE_HEAD = 9
"""Columns of a sample before those of the groups: state (6), turn, moment, drive moment."""

LANES = 32
"""Elements of a block."""

# first index of each row of a block at rest: centre, unit tangent, half-length, area, beta; the row _BOX holds four
# numbers of the box around the block: x and z of its middle, and half of its width and height
_X, _Z, _TX, _TZ, _HALF, _AREA, _BETA, _BOX, _AT_REST = range(0, 9 * LANES, LANES)
# first index of each row of the work array: _X, _Z, _TX, _TZ are now the centre of the submerged part, relative to the
# reference point, and the unit tangent; then velocity, depth times area of the submerged part, and alpha
_VX, _VZ, _LOAD, _ALPHA_Z, _ALPHA_X, _PLACED = range(4 * LANES, 10 * LANES, LANES)
_TURN = 2 * math.pi
# the same number as in `rftfit.forces.leading`
_ALONG_ITSELF = 1e-4
_FAR_RAD = 64.0
"""Largest angle from which whole turns are subtracted without `fmod`, which is slow."""
# a quarter turn as the sum of two numbers: the first has 33 bits, so that its multiples up to `_FAR_RAD` are exact
_QUARTER_HIGH, _QUARTER_LOW = 0x1921FB544 / 2.0**32, 6.077100506506192e-11
# terms of the power series of sine and cosine
_S3, _S5, _S7, _S9, _S11, _S13, _S15 = ((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 8))
_C4, _C6, _C8, _C10, _C12, _C14, _C16 = ((-1) ** k / math.factorial(2 * k) for k in range(2, 9))
_OPTIONS = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "arcp", "nsz"}}


def _step(function: _F) -> _F:
    """Compile a function that becomes part of its caller.

    References to arrays are not counted (`_nrt`), which would take as long as the forces of a block: the function must
    not make an array.
    """
    compiler: Any = numba.njit
    compiled: _F = compiler(forceinline=True, _nrt=False, **_OPTIONS)(function)
    return compiled


def _compiled(function: _F) -> _F:
    """Compile a function that Python calls, at its first call, and keep it on disk where that is possible."""
    compiler: Any = numba.njit
    try:
        compiled: _F = compiler(cache=True, nogil=True, **_OPTIONS)(function)
    except RuntimeError:  # there is no folder that numba can write its cache to
        compiled = compiler(nogil=True, **_OPTIONS)(function)
    return compiled


def _exact_step(function: _F) -> _F:
    """Compile like `_step`, but keep the order of sums, on which the exactness of the function depends."""
    compiler: Any = numba.njit
    compiled: _F = compiler(forceinline=True, _nrt=False, error_model="numpy")(function)
    return compiled


@_step
def _place_block(
    w: FloatArray,
    block: FloatArray,
    z0: float,
    c: float,
    s: float,
    vx0: float,
    vz0: float,
    rate: float,
    solid: bool,
) -> None:
    """Turn a block by the angle of cosine `c` and sine `s`, clip it at the surface, and write it into `w`.

    Written are tangent, velocity, load and centre of the part below the surface. `w`: work array. `block`: a block at
    rest. `z0`, `vx0`, `vz0`: height (cm) and velocity (cm/s) of the reference point; `rate`: angular velocity, rad/s.
    `solid`: only elements that move outward, to the right of their tangent, bear a load.
    """
    for i in range(LANES):
        bx, bz, bt, bn = block[_X + i], block[_Z + i], block[_TX + i], block[_TZ + i]
        x, z = bx * c + bz * s, bz * c - bx * s
        tx, tz = bt * c + bn * s, bn * c - bt * s
        vx, vz = vx0 + rate * z, vz0 - rate * x
        half = block[_HALF + i]
        rise = half * abs(tz)
        low = rise - z - z0  # depth of the lower end of the element
        submerged = low - 2 * rise >= 0  # the upper end, too, is below the surface
        wet_share = 1.0 if submerged else low / (2 * rise)
        load = (low - rise if submerged else 0.5 * low) * wet_share * block[_AREA + i]
        load = 0.0 if low <= 0 else load
        speed = np.sqrt(vx * vx + vz * vz)
        load = 0.0 if speed == 0 else load
        if solid:  # the load goes from all to none where an element moves nearly along itself
            outward = (vx * tz - vz * tx) / (2 * _ALONG_ITSELF * speed)
            load = load * min(max(0.5 + outward, 0.0), 1.0) if speed > 0 else load
        # from the centre of the element, along its tangent, to the centre of its submerged part
        along = 0.0 if submerged | (low <= 0) else half * (1 - wet_share)
        along = -along if tz > 0 else along
        w[_LOAD + i], w[_X + i], w[_Z + i] = load, x + along * tx, z + along * tz
        w[_TX + i], w[_TZ + i], w[_VX + i], w[_VZ + i] = tx, tz, vx, vz


@_step
def _write_fourier_alpha(w: FloatArray, m: FloatArray) -> None:
    """Write alpha by nine terms `m`, in the order of `fourier.TERMS`, into the rows of alpha of `w`.

    Without trigonometry, from tangents and velocities: cos 2 beta = tx^2 - tz^2, cos gamma = -vx / |v|, ...
    """
    for i in range(LANES):
        tx, tz, vx, vz = w[_TX + i], w[_TZ + i], w[_VX + i], w[_VZ + i]
        scale = -1.0 / np.sqrt(vx * vx + vz * vz)
        cos_g, sin_g = scale * vx, scale * vz
        cos_2b, sin_2b = tx * tx - tz * tz, -2.0 * tx * tz
        z = m[0] + m[1] * cos_2b + sin_g * (m[3] + (m[2] + m[4]) * cos_2b)
        x = cos_g * (m[6] + (m[5] + m[7]) * cos_2b) + sin_2b * (m[8] + (m[7] - m[5]) * sin_g)
        w[_ALPHA_Z + i], w[_ALPHA_X + i] = z + cos_g * (m[2] - m[4]) * sin_2b, x


@_step
def _write_depth_only_alpha(w: FloatArray, values: FloatArray) -> None:
    """Write alpha of the depth-only model into the rows of alpha: each component opposes the velocity in its direction.

    `values`: alpha_z in motion down and up, alpha_x in motion toward -x, as in `DepthOnlyProfile`, N/cm^3.
    """
    down, up, side = values[0], values[1], values[2]
    for i in range(LANES):
        vx, vz = w[_VX + i], w[_VZ + i]
        least = _STILL * np.sqrt(vx * vx + vz * vz)
        zero = 0.0 * least  # NaN if a velocity component is NaN
        z = down if vz < -least else (up if vz > least else zero)
        x = side if vx < -least else (-side if vx > least else zero)
        w[_ALPHA_Z + i], w[_ALPHA_X + i] = abs(w[_TX + i]) * z, abs(w[_TZ + i]) * x


@_step
def _arctan2(y: float, x: float) -> float:
    """Return atan2(y, x), in [-pi, pi]: twice an arc tangent of at most tan(pi / 8), by a polynomial.

    The polynomial is interpolated at Chebyshev nodes; its error is below 1e-16.
    """
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    t: float = (ax if steep else ay) / ((ay if steep else ax) + np.sqrt(x * x + y * y))
    q = t * t
    p = (0.021134137915756773 * q - 0.043479536590052985) * q + 0.05688316096940551
    p = ((p * q - 0.0664022783641704) * q + 0.07689952829854219) * q - 0.0909077303076135
    p = ((p * q + 0.11111106178748203) * q - 0.14285714180940765) * q + 0.19999999998854776
    angle = 2.0 * (t + t * q * (p * q - 0.33333333333328435))
    angle = math.pi / 2 - angle if steep else angle
    angle = math.pi - angle if x < 0 else angle
    return -angle if y < 0 else angle


@_exact_step
def _sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle up to `_FAR_RAD`, by power series about the nearest quarter turn.

    The errors are below 3e-16.
    """
    quarters = np.floor(angle * (2 / math.pi) + 0.5)
    x = (angle - quarters * _QUARTER_HIGH) - quarters * _QUARTER_LOW
    q = x * x
    s = ((_S15 * q + _S13) * q + _S11) * q + _S9
    s = x + x * q * (((s * q + _S7) * q + _S5) * q + _S3)
    c = ((_C16 * q + _C14) * q + _C12) * q + _C10
    c = 1.0 + q * (((((c * q + _C8) * q + _C6) * q + _C4) * q) - 0.5)
    # odd: 1 in every second quarter of a turn, where sine and cosine change places; sign: -1 in the second half of a
    # turn
    odd = quarters - 2.0 * np.floor(0.5 * quarters)
    sign = 1.0 - 2.0 * (0.5 * (quarters - odd) - 2.0 * np.floor(0.25 * (quarters - odd)))
    sine, cosine = (c if odd == 1.0 else s), (-s if odd == 1.0 else c)
    return sign * sine, sign * cosine


@_step
def _write_angles_of_lookup(w: FloatArray, pack: Pack) -> None:
    """Turn beta and gamma of `alpha`, which stand in the rows of alpha of `w`, into what the kind of profile needs.

    A table needs angles in the range of its nodes, the other kinds the unit vectors of tangent and velocity.
    """
    # angles far from 0 lose whole turns first, which is slow and rarely needed
    far = 0
    for i in range(LANES):
        far += (abs(w[_ALPHA_Z + i]) > _FAR_RAD) | (abs(w[_ALPHA_X + i]) > _FAR_RAD)
    if far > 0:
        for i in range(LANES):
            w[_ALPHA_Z + i] = np.fmod(w[_ALPHA_Z + i], math.pi)
            w[_ALPHA_X + i] = np.fmod(w[_ALPHA_X + i], _TURN)
    if pack.kind == _TABLE:
        for i in range(LANES):
            beta, gamma = w[_ALPHA_Z + i], w[_ALPHA_X + i]
            w[_ALPHA_Z + i] = beta - math.pi * np.floor(beta / math.pi + 0.5)
            w[_ALPHA_X + i] = gamma - _TURN * np.floor(gamma / _TURN + 0.5)
        return
    for i in range(LANES):
        sin_b, cos_b = _sin_cos(w[_ALPHA_Z + i])
        sin_g, cos_g = _sin_cos(w[_ALPHA_X + i])
        unknown = 0.0 * (sin_b + sin_g)  # NaN if an angle is NaN, else 0
        w[_TX + i], w[_TZ + i] = cos_b + unknown, unknown - sin_b
        w[_VX + i], w[_VZ + i] = unknown - cos_g, unknown - sin_g


@_step
def _bin_of_angle(angle: float, low: float, per_rad: float, last: float) -> float:
    """Return the bin of an angle (see `Pack.beta_bins`), from 0 to `last`, with its fraction; 0 for NaN.

    `low`: first node. `per_rad`: bins per rad.
    """
    bin_number = (angle - low) * per_rad
    bin_number = bin_number if bin_number > 0 else 0.0
    return min(bin_number, last)


@_step
def _find_interval(
    angle: float, bin_number: float, nodes: FloatArray, bins: IntArray
) -> tuple[np.uint64, float]:
    """Return the index of the node below an angle, and how far the angle lies to the next node, from 0 to 1.

    `bin_number`: of the angle, by `_bin_of_angle`. `nodes`, `bins`: of the pack, of beta or of gamma.
    """
    node = bins[np.uint64(bin_number)]
    # one further if the angle lies in the next interval, which may begin within the bin
    node += (node + 2 < nodes.size) & (angle >= nodes[np.uint64(node + 1)])
    low = nodes[np.uint64(node)]
    return np.uint64(node), (angle - low) / (nodes[np.uint64(node + 1)] - low)


@_step
def _write_table_alpha(w: FloatArray, block: FloatArray, angle: float, pack: Pack) -> None:
    """Write alpha of elements that bear a load, interpolated in a table; overwrites their tangents.

    `angle`: by which the block is turned, rad.
    """
    for i in range(LANES):
        beta = block[_BETA + i] + angle
        w[_ALPHA_Z + i] = beta - math.pi * np.floor(beta / math.pi + 0.5)  # beta has the period pi
        w[_ALPHA_X + i] = _arctan2(-w[_VZ + i], -w[_VX + i])
    _interpolate_table(w, pack)


@_step
def _interpolate_table(w: FloatArray, pack: Pack) -> None:
    """Replace beta and gamma, in the rows of alpha, by alpha interpolated in a table; overwrites tangents.

    Elements without a load are left as they are.
    """
    beta0, beta_end, beta_bins = pack.beta[0], pack.beta[-1], float(pack.beta_bins.size)
    gamma0, gamma_end, gamma_bins = pack.gamma[0], pack.gamma[-1], float(pack.gamma_bins.size)
    beta_per_rad, gamma_per_rad = beta_bins / (beta_end - beta0), gamma_bins / (gamma_end - gamma0)
    # a loop of its own, since the compiler finds the bins of several elements at a time; the rows of tangents hold them
    for i in range(LANES):
        w[_TX + i] = _bin_of_angle(w[_ALPHA_Z + i], beta0, beta_per_rad, beta_bins - 1)
        w[_TZ + i] = _bin_of_angle(w[_ALPHA_X + i], gamma0, gamma_per_rad, gamma_bins - 1)
    for i in range(LANES):
        if w[_LOAD + i] == 0:
            continue
        row, u = _find_interval(w[_ALPHA_Z + i], w[_TX + i], pack.beta, pack.beta_bins)
        column, v = _find_interval(w[_ALPHA_X + i], w[_TZ + i], pack.gamma, pack.gamma_bins)
        # alpha_z at the corners (beta, gamma) low low, low high, high low, high high, then alpha_x
        corner = pack.cells[row, column]
        z1, z2 = corner[0] + v * (corner[1] - corner[0]), corner[2] + v * (corner[3] - corner[2])
        x1, x2 = corner[4] + v * (corner[5] - corner[4]), corner[6] + v * (corner[7] - corner[6])
        z, x = z1 + u * (z2 - z1), x1 + u * (x2 - x1)
        if math.isnan(z + x):  # sum again without the missing corners that have no weight
            z, x = 0.0, 0.0
            a, b, c, d = (1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v
            for k, weight in enumerate((a, b, c, d)):
                idle_z = weight < _NEGLIGIBLE and math.isnan(corner[k])
                idle_x = weight < _NEGLIGIBLE and math.isnan(corner[4 + k])
                z += 0.0 if idle_z else weight * corner[k]
                x += 0.0 if idle_x else weight * corner[4 + k]
        w[_ALPHA_Z + i], w[_ALPHA_X + i] = z, x


@_step
def _sum_forces(
    pack: Pack,
    blocks: FloatArray,
    solid: bool,
    z0: float,
    angle: float,
    c: float,
    s: float,
    vx0: float,
    vz0: float,
    rate: float,
    w: FloatArray,
) -> tuple[float, float, float]:
    """Return force z, force x (N) and moment about the reference point (N cm) of blocks that move as one rigid body.

    `angle` and its cosine `c` and sine `s`: of the body. `z0`, `vx0`, `vz0`, `rate`, `solid`: as for `_place_block`.
    `w`: work array, overwritten.
    """
    force_z, force_x, moment = 0.0, 0.0, 0.0
    for b in range(len(blocks)):
        block = blocks[b]
        x, z, wide, high = block[_BOX], block[_BOX + 1], block[_BOX + 2], block[_BOX + 3]
        if z0 + z * c - x * s - wide * abs(s) - high * abs(c) > 0:
            continue  # the box around the block is above the surface
        _place_block(w, block, z0, c, s, vx0, vz0, rate, solid)
        if pack.kind == _FOURIER:
            _write_fourier_alpha(w, pack.values)
        elif pack.kind == _TABLE:
            _write_table_alpha(w, block, angle, pack)
        else:
            _write_depth_only_alpha(w, pack.values)
        for i in range(LANES):
            load = w[_LOAD + i]
            up = 0.0 if load == 0 else load * w[_ALPHA_Z + i]
            ahead = 0.0 if load == 0 else load * w[_ALPHA_X + i]
            force_z += up
            force_x += ahead
            moment += w[_Z + i] * ahead - w[_X + i] * up
    return force_z, force_x, moment


@_step
def _fill_blocks(blocks: FloatArray, body: FloatArray, width_cm: float) -> None:
    """Write the elements `body` (n, 5) of `pose_forces` into blocks of zeros; spare places keep the area 0.

    Also the box around each block, by which a block above the surface is passed over at once.
    """
    for b in range(len(blocks)):
        block = blocks[b]
        left, right, low, high = math.inf, -math.inf, math.inf, -math.inf
        for i in range(min(LANES, len(body) - b * LANES)):
            element = body[b * LANES + i]
            for row in range(5):
                block[row * LANES + i] = element[row]
            x, z, half = element[0], element[1], element[4]
            block[_AREA + i] = 2.0 * half * width_cm
            block[_BETA + i] = -math.atan2(element[3], element[2])
            wide, tall = half * abs(element[2]), half * abs(element[3])
            left, right = min(left, x - wide), max(right, x + wide)
            low, high = min(low, z - tall), max(high, z + tall)
        block[_BOX], block[_BOX + 1] = (left + right) / 2, (low + high) / 2
        # a little wider, so that no rounding leaves an element outside
        block[_BOX + 2], block[_BOX + 3] = (right - left) / 2 + 1e-9, (high - low) / 2 + 1e-9


@_compiled
def pose_forces(
    pack: Pack, body: FloatArray, width_cm: float, solid: bool, poses: FloatArray
) -> FloatArray:
    """Calculate force z, x (N) and moment about the reference point (N cm) on an outline in each pose.

    `pack`: of the profile. `body`: shape (n, 5): elements at angle 0 about the reference point: x, z (cm), unit tangent
    x, z, half-length (cm). `solid`: count only elements that move outward; the outline then runs counterclockwise.
    `poses`: shape (p, 6): reference point x, z (cm), angle (rad, from z toward x), and their rates (per s). Returns
    shape (p, 3).
    """
    blocks, w = np.zeros((-(-len(body) // LANES), _AT_REST)), np.zeros(_PLACED)
    _fill_blocks(blocks, body, width_cm)
    forces = np.empty((len(poses), 3))
    for p in range(len(poses)):
        c, s = math.cos(poses[p, 2]), math.sin(poses[p, 2])
        force_z, force_x, moment = _sum_forces(
            pack,
            blocks,
            solid,
            poses[p, 1],
            poses[p, 2],
            c,
            s,
            poses[p, 3],
            poses[p, 4],
            poses[p, 5],
            w,
        )
        forces[p, 0], forces[p, 1] = force_z, force_x
        # NaN if x of the pose is NaN, even above the surface
        forces[p, 2] = moment + 0.0 * poses[p, 0]
    return forces


@_compiled
def alpha(pack: Pack, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Calculate alpha_z and alpha_x at attack and intrusion angles of shape (n,), rad; NaN if an angle is not finite.

    Returns shape (2, n), N/cm^3.
    """
    # the elements of a work array bear a load of 1, so that each gets alpha
    w, alpha_z_x = np.zeros(_PLACED), np.empty((2, len(beta)))
    for i in range(LANES):
        w[_LOAD + i] = 1.0
    for start in range(0, len(beta), LANES):
        lanes = min(LANES, len(beta) - start)
        for i in range(lanes):
            w[_ALPHA_Z + i], w[_ALPHA_X + i] = beta[start + i], gamma[start + i]
        _write_angles_of_lookup(w, pack)
        if pack.kind == _FOURIER:
            _write_fourier_alpha(w, pack.values)
        elif pack.kind == _TABLE:
            _interpolate_table(w, pack)
        else:
            _write_depth_only_alpha(w, pack.values)
        for i in range(lanes):
            alpha_z_x[0, start + i], alpha_z_x[1, start + i] = w[_ALPHA_Z + i], w[_ALPHA_X + i]
    return alpha_z_x


@_step
def _write_member_forces(
    pack: Pack,
    blocks: FloatArray,
    group: IntArray,
    hips: FloatArray,
    state: FloatArray,
    turn: float,
    rate: float,
    w: FloatArray,
    member_forces: FloatArray,
) -> None:
    """Write force z, x and moments about the centre of mass and about the hip of each member into `member_forces` (m, 4).

    Members are legs, and bodies that do not turn relative to the robot. `blocks`: of each group of members with the
    same outline; `group`: number of the group of each member. `hips`: x, z of the hip in the robot's frame (cm), and 1
    for a leg, which turns by `turn` (rad) at the `rate` (rad/s), or 0. `state`: of the robot, as in `advance`. `w`:
    work array.
    """
    pitch, pitch_rate = state[2], state[5]
    cos_p, sin_p = math.cos(pitch), math.sin(pitch)
    cos_t, sin_t = math.cos(pitch + turn), math.sin(pitch + turn)
    for m in range(len(hips)):
        x = hips[m, 0] * cos_p + hips[m, 1] * sin_p
        z = hips[m, 1] * cos_p - hips[m, 0] * sin_p
        c, s = (cos_t, sin_t) if hips[m, 2] else (cos_p, sin_p)
        force_z, force_x, moment = _sum_forces(
            pack,
            blocks[group[m]],
            False,
            state[1] + z,
            pitch + hips[m, 2] * turn,
            c,
            s,
            state[3] + pitch_rate * z,
            state[4] - pitch_rate * x,
            pitch_rate + hips[m, 2] * rate,
            w,
        )
        member_forces[m, 0], member_forces[m, 1], member_forces[m, 3] = force_z, force_x, moment
        member_forces[m, 2] = moment + z * force_x - x * force_z


@_compiled
def advance(
    pack: Pack,
    bodies: FloatArray,
    widths_cm: FloatArray,
    group: IntArray,
    hips: FloatArray,
    inertia: FloatArray,
    state: FloatArray,
    turn: float,
    rate: float,
    step: float,
    steps: int,
    rk4: bool,
    every: int,
    samples: FloatArray,
) -> None:
    """Step a robot through time by semi-implicit Euler, or by the fourth-order Runge-Kutta method (`rk4`).

    `bodies`, `widths_cm`, `group`, `hips`, `inertia`: of `rftfit.robot.body.Parts`; `inertia` is acceleration by 1 N
    (cm/s^2), angular acceleration by 1 N cm (rad/s^2) and gravity (cm/s^2). `state`: shape
    (6,), changed in place: x, z (cm), pitch (rad), and their rates. `turn`, `rate`: angle and angular velocity of the
    legs relative to the body (rad, rad/s). `step`: time of one step, s. `every`: steps from one sample to the next, 0
    for no samples. `samples`: shape (s, 9 + 2 groups), written: state, turn, moment about the centre of mass, moment
    about the hips (N cm), and force z, x of each group (N).
    """
    blocks = np.zeros((len(bodies), -(-bodies.shape[1] // LANES), _AT_REST))
    for g in range(len(bodies)):
        _fill_blocks(blocks[g], bodies[g], widths_cm[g])
    w, member_forces = np.zeros(_PLACED), np.empty((len(hips), 4))
    # the state at a stage of a step, its rate of change, and the weighted sum of these over the stages of Runge-Kutta
    now, slope, total = np.zeros(6), np.zeros(6), np.zeros(6)
    for k in range(steps):
        turned = turn + rate * step * k
        for stage in range(4 if rk4 else 1):
            # time of the stage behind the beginning of the step; its state follows from the slope of the stage before
            ahead = (0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)) * step
            for j in range(6):
                now[j] = state[j] + ahead * slope[j]
            _write_member_forces(
                pack, blocks, group, hips, now, turned + rate * ahead, rate, w, member_forces
            )
            if every > 0 and k % every == 0 and stage == 0:
                row = samples[k // every]
                for j in range(row.size):
                    row[j] = state[j] if j < 6 else 0.0
                row[6] = turned
                for m in range(len(hips)):
                    row[7] += member_forces[m, 2]
                    # moment of the medium about the hip of a leg, which the drive has to overcome
                    row[8] += hips[m, 2] * member_forces[m, 3]
                    row[SAMPLE_HEAD + 2 * group[m]] += member_forces[m, 0]
                    row[SAMPLE_HEAD + 2 * group[m] + 1] += member_forces[m, 1]
            force_z, force_x, moment = 0.0, 0.0, 0.0
            for m in range(len(hips)):
                force_z, force_x = force_z + member_forces[m, 0], force_x + member_forces[m, 1]
                moment += member_forces[m, 2]
            for j in range(3):
                slope[j] = now[3 + j]
            slope[3] = force_x * inertia[0]
            slope[4] = force_z * inertia[0] - inertia[2]
            slope[5] = moment * inertia[1]
            for j in range(6):
                share = 1.0 if stage in (0, 3) else 2.0
                total[j] = share * slope[j] + (total[j] if stage > 0 else 0.0)
        if rk4:
            for j in range(6):
                state[j] += step / 6.0 * total[j]
        else:
            for j in range(3):
                state[3 + j] += step * slope[3 + j]
                state[j] += step * state[3 + j]
