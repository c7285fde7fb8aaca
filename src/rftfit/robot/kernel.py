"""The compiled time-stepper: forces on a whole robot, and its motion over many steps (Eq. 3).

The force of an element is that of `rftfit.model.kernel`, called from here. The compiler's cache
watches a function's own file only, so the functions that are kept on disk carry a digest of that
other file (`SOURCE`), which is part of the key of the cache; their helpers are not kept at all.
`rftfit.robot.reference_kernel` says the same in plain numpy.

Most elements are in the air most of the time: a plate or leg whose box lies above the surface is
passed over, and of the others only elements that bear a load are looked up in a table.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numba
import numpy as np

from rftfit.model import kernel
from rftfit.model.profiles import FOURIER, TABLE

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Pack
    from rftfit.robot.body import IntArray

    Sum = tuple[float, float, float]

SOURCE = hashlib.sha256(Path(kernel.__file__).read_bytes()).hexdigest()
"""Digest of the file whose compiled functions are called from here."""

_LANES, _SIZE = kernel.LANES, kernel._SIZE
_X, _Z, _TX, _TZ = kernel._X, kernel._Z, kernel._TX, kernel._TZ
_HALF, _AREA, _VX, _VZ = kernel._HALF, kernel._AREA, kernel._VX, kernel._VZ
_LOAD, _XC, _ZC = kernel._LOAD, kernel._XC, kernel._ZC
_FZ, _FX = kernel._FZ, kernel._FX
_clip, _fourier, _table = kernel._clip, kernel._fourier, kernel._table
_depth_only, _sum = kernel._depth_only, kernel._sum
_ROWS = 6  # of a block of elements: x, z, tangent x, z, half-length, area, as `Parts.shape`

SAMPLE_HEAD = 9
"""Columns of a sample before those of the groups: state (6), turn, moment, drive moment."""

_F = TypeVar("_F", bound="Callable[..., Any]")


def _helper(function: _F) -> _F:
    """Compile as a part of whoever calls it: else references would be counted at every call."""
    compiler: Any = numba.njit
    result: _F = compiler(error_model="numpy", forceinline=True)(function)
    return result


def _kept(function: _F) -> _F:
    """Compile at the first call and keep on disk; other threads may run meanwhile."""
    compiler: Any = numba.njit
    try:
        result: _F = compiler(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no folder that the cache could be written to
        result = compiler(nogil=True, error_model="numpy")(function)
    return result


@_helper
def _by_lane(shape: FloatArray, groups: IntArray) -> tuple[FloatArray, IntArray]:
    """Elements in blocks, those of each group by themselves, and where each group begins.

    Lanes without an element have no length and no area.
    """
    begin = np.zeros(groups.shape[0] + 1, dtype=np.int64)
    for g in range(groups.shape[0]):
        begin[g + 1] = begin[g] + (groups[g, 1] + _LANES - 1) // _LANES
    blocks = np.zeros((begin[-1], _ROWS * _LANES))
    for g in range(groups.shape[0]):
        for e in range(groups[g, 1]):
            for row in range(_ROWS):
                blocks[begin[g] + e // _LANES, row * _LANES + e % _LANES] = shape[
                    row, groups[g, 0] + e
                ]
    return blocks, begin


@_helper
def _add(sums: FloatArray, w: FloatArray, x0: float, z0: float) -> None:
    """Add force z, x and moment about (x0, z0), lane by lane."""
    for i in range(_LANES):
        fz, fx = w[_FZ + i], w[_FX + i]
        sums[i] += fz
        sums[_LANES + i] += fx
        sums[2 * _LANES + i] += (w[_ZC + i] - z0) * fx - (w[_XC + i] - x0) * fz


@_helper
def _net(
    pack: Pack,
    corners: FloatArray,
    blocks: FloatArray,
    begin: IntArray,
    groups: IntArray,
    turns: FloatArray,
    places: FloatArray,
    state: FloatArray,
    turn: float,
    rate: float,
    only_group: int,
    only_member: int,
    w: FloatArray,
    v: FloatArray,
    sums: FloatArray,
) -> Sum:
    """Force z, x (N) and moment about the centre of mass (N cm), of all or of one member."""
    kind, values, beta, gamma, beta_bins, gamma_bins, _ = pack
    n = 0
    x0, z0, pitch = state[0], state[1], state[2]
    vx0, vz0, pitch_rate = state[3], state[4], state[5]
    cos_p, sin_p = math.cos(pitch), math.sin(pitch)
    cos_t, sin_t = math.cos(pitch + turn), math.sin(pitch + turn)
    sums[:] = 0.0
    for g in range(groups.shape[0]):
        if only_group not in (-1, g):
            continue
        c, s, spin = cos_p, sin_p, pitch_rate
        if turns[g, 0] != 0:
            c = cos_t * turns[g, 1] - sin_t * turns[g, 2]
            s = sin_t * turns[g, 1] + cos_t * turns[g, 2]
            spin = pitch_rate + rate
        lowest = turns[g, 4] * c - turns[g, 3] * s
        lowest -= turns[g, 5] * abs(s) + turns[g, 6] * abs(c)
        place = groups[g, 2]
        for member in range(groups[g, 3]):
            if only_member not in (-1, member):
                continue
            hip_x = places[place + member, 0] * cos_p + places[place + member, 1] * sin_p
            hip_z = places[place + member, 1] * cos_p - places[place + member, 0] * sin_p
            at_x, at_z = x0 + hip_x, z0 + hip_z
            if at_z + lowest > 0:
                continue
            vx, vz = vx0 + pitch_rate * hip_z, vz0 - pitch_rate * hip_x
            for block in range(begin[g], begin[g + 1]):
                for i in range(_LANES):
                    bx, bz = blocks[block, _X + i], blocks[block, _Z + i]
                    tx, tz = blocks[block, _TX + i], blocks[block, _TZ + i]
                    x, z = bx * c + bz * s, bz * c - bx * s
                    w[_X + i], w[_Z + i] = at_x + x, at_z + z
                    w[_TX + i], w[_TZ + i] = tx * c + tz * s, tz * c - tx * s
                    w[_HALF + i], w[_AREA + i] = blocks[block, _HALF + i], blocks[block, _AREA + i]
                    w[_VX + i], w[_VZ + i] = vx + spin * z, vz - spin * x
                _clip(w)
                if kind == TABLE:
                    # looking things up takes long: gather what bears a load into full blocks
                    for i in range(_LANES):
                        if w[_LOAD + i] != 0:
                            v[_LOAD + n], v[_XC + n], v[_ZC + n] = (
                                w[_LOAD + i], w[_XC + i], w[_ZC + i],
                            )  # fmt: skip
                            v[_TX + n], v[_TZ + n] = w[_TX + i], w[_TZ + i]
                            v[_VX + n], v[_VZ + n] = w[_VX + i], w[_VZ + i]
                            n += 1
                            if n == _LANES:
                                n = 0
                                _table(v, beta, gamma, beta_bins, gamma_bins, corners)
                                _add(sums, v, x0, z0)
                    continue
                if kind == FOURIER:
                    _fourier(w, values)
                else:
                    _depth_only(w, values)
                _add(sums, w, x0, z0)
    if n > 0:
        v[_LOAD + n : _LOAD + _LANES] = 0.0
        _table(v, beta, gamma, beta_bins, gamma_bins, corners)
        _add(sums, v, x0, z0)
    return _sum(sums, 0), _sum(sums, _LANES), _sum(sums, 2 * _LANES)


@_helper
def _apart(
    pack: Pack,
    corners: FloatArray,
    blocks: FloatArray,
    begin: IntArray,
    groups: IntArray,
    turns: FloatArray,
    places: FloatArray,
    state: FloatArray,
    turn: float,
    rate: float,
    w: FloatArray,
    v: FloatArray,
    sums: FloatArray,
    row: FloatArray,
) -> None:
    """Write a sample: state, turn, moment, drive moment, then force z, x of each group."""
    row[:6], row[6], row[7:] = state, turn, 0.0
    cos_p, sin_p = math.cos(state[2]), math.sin(state[2])
    for g in range(groups.shape[0]):
        for member in range(groups[g, 3]):
            force_z, force_x, moment = _net(
                pack, corners, blocks, begin, groups, turns, places, state, turn, rate, g, member,
                w, v, sums,
            )  # fmt: skip
            x, z = places[groups[g, 2] + member, 0], places[groups[g, 2] + member, 1]
            arm_x, arm_z = x * cos_p + z * sin_p, z * cos_p - x * sin_p
            row[7] += moment
            # about the hip: what the medium does on the leg, and the drive has to overcome
            row[8] += turns[g, 0] * (moment - arm_z * force_x + arm_x * force_z)
            row[SAMPLE_HEAD + 2 * g] += force_z
            row[SAMPLE_HEAD + 2 * g + 1] += force_x


def _make(source: str) -> Callable[..., None]:
    @_kept
    def advance(
        pack: Pack,
        shape: FloatArray,
        groups: IntArray,
        turns: FloatArray,
        places: FloatArray,
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
        if len(source) == 0:  # the digest has to be used to be part of the cache's key
            return
        blocks, begin = _by_lane(shape, groups)
        cells = pack[6]
        corners = cells.reshape(cells.shape[0] * cells.shape[1], 8)
        w, v, sums = np.zeros(_SIZE), np.zeros(_SIZE), np.empty(3 * _LANES)
        now, slope, total = state.copy(), np.empty(6), np.empty(6)
        for k in range(steps):
            at = turn + rate * step * k
            if every > 0 and k % every == 0:
                row = samples[k // every]
                _apart(
                    pack,
                    corners,
                    blocks,
                    begin,
                    groups,
                    turns,
                    places,
                    state,
                    at,
                    rate,
                    w,
                    v,
                    sums,
                    row,
                )
            for stage in range(4 if rk4 else 1):
                ahead = (0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)) * step
                for j in range(6):
                    now[j] = state[j] + (ahead * slope[j] if stage > 0 else 0.0)
                force_z, force_x, moment = _net(
                    pack, corners, blocks, begin, groups, turns, places, now, at + rate * ahead,
                    rate, -1, -1, w, v, sums,
                )  # fmt: skip
                slope[0], slope[1], slope[2] = now[3], now[4], now[5]
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

    return advance


_advance = _make(SOURCE)


def advance(*arguments: Any) -> None:
    """Step a robot through time; see `rftfit.robot.reference_kernel.advance` for the same in numpy.

    `*arguments`: In this order. Of a profile: ``pack`` (Pack). Of `rftfit.robot.body.Parts`:
    ``shape, groups, turns, places, inertia``. ``state`` (6,), changed in place: x, z (cm), pitch
    (rad), and their rates. ``turn`` (rad), of the leg of phase 0 relative to the body, and
    ``rate`` of it (rad/s). ``step`` (s), ``steps``. ``rk4``, else semi-implicit Euler. ``every``:
    a sample before every so many steps, 0 for none; ``samples`` (s, 9 + 2 g), written: state,
    turn, moment about the centre of mass, moment about the hips (N cm), and force z, x of each
    group (N).
    """
    _advance(*arguments)
