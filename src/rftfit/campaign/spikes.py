"""Readings that stand alone: far from all readings before and after them, as no force and no position can be.

A loose contact, a lost packet or a code for "no data" gives single readings. A true step stays on the other side, and
a force that slips falls from a peak that it has risen to: both are close to the readings on one of their sides.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray

Mask = npt.NDArray[np.bool_]

TIMES_USUAL_STEP = 20.0
"""A reading is far from others by so many times a small step near it, or more: by 9 standard deviations of noise."""
LONGEST = 3
"""So many equal readings in a row may stand alone together; a channel that holds longer is told otherwise."""
MOST_SHARE = 0.25
"""With a larger share of such readings, nobody knows which readings are the good ones."""
_SIDE = 5
"""Readings on each side whose median is the level there."""
_FEWEST = 2
"""Readings that there are on each side of one that is judged."""
_BLOCK = 50
"""Readings that one usual step is taken from."""
_PASSES = 3
"""Where many readings are bad, some are found only when others are out of the way."""


def find_spikes(values: FloatArray, times: float = TIMES_USUAL_STEP) -> Mask:
    """Mark the readings of one channel that stand alone.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    times : float, optional
        Small steps by which a reading that stands alone is farther off, at least.

    Returns
    -------
    ndarray of bool
        Shape (n,).
    """
    alone = spikes = _find_once(values, times)
    for _ in range(_PASSES - 1):
        if not spikes.any():
            break
        left = np.flatnonzero(~alone)
        spikes = _find_once(values[left], times)
        alone[left[spikes]] = True
    return alone


def _find_once(values: FloatArray, times: float) -> Mask:
    """Mark readings far from the level on both sides of them; equal readings in a row count as one."""
    nothing = np.zeros(values.size, dtype=bool)
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    level = values[starts]
    if level.size < 2 * _SIDE + 1:
        return nothing
    step = np.abs(level[1:] - level[:-1])
    far = times * _usual_steps(step)
    # most logs hold no jump at all: whatever stands alone is entered and left by one of about its size
    least = far[1:-1] / 2
    inner = np.flatnonzero((step[:-1] > least) & (step[1:] > least)) + 1
    # beside the first and the last readings there is one side alone, and a log may begin with a step
    inner = inner[(inner >= _FEWEST) & (inner < level.size - _FEWEST)]
    if not inner.size:
        return nothing
    lengths = np.diff(np.append(starts, values.size))
    candidates = inner[lengths[inner] <= LONGEST]
    if not candidates.size:
        return nothing
    sides = np.arange(1, _SIDE + 1)
    # beside a reading near an end those that there are, as in a mirror
    last = level.size - 1
    places_before = np.abs(candidates[:, None] - sides)
    places_after = last - np.abs(last - candidates[:, None] - sides)
    before = np.median(level[places_before], axis=1)
    after = np.median(level[places_after], axis=1)
    # between the two levels lies what was read while the force changed from one to the other
    above = level[candidates] - np.maximum(before, after)
    below = np.minimum(before, after) - level[candidates]
    off = np.maximum(above, below)
    spikes = np.zeros(level.size, dtype=bool)
    spikes[candidates[off > far[candidates]]] = True
    return np.repeat(spikes, lengths)


def _usual_steps(step: FloatArray) -> FloatArray:
    """Lower quartile of the steps near each reading, the largest of three blocks, shape (n + 1,).

    Steps to and from bad readings are large: a quarter of such readings makes half of the steps.
    """
    size = min(_BLOCK, step.size)
    count = step.size // size
    blocks = step[: count * size].reshape(count, size)
    quarter = size // 4
    lower = np.partition(blocks, quarter, axis=1)[:, quarter]
    near = lower.copy()
    np.maximum(near[1:], lower[:-1], out=near[1:])
    np.maximum(near[:-1], lower[1:], out=near[:-1])
    usual = np.full(step.size + 1, near[-1])
    usual[: count * size] = np.repeat(near, size)
    return usual


# --- Positions of an arm


TIMES_USUAL_WAY = 2.0
"""A lone position is farther aside by so many ways from one reading to the next, or more: an arm that turns back is by one."""
_TIMES_NOISE = 7.0
"""A lone position is farther aside by so many standard deviations of one coordinate, or more."""
_LEAST_PART = 0.005
"""Part of the whole way below which a position is off by no more than what a coarse sensor flickers by."""
_FEWEST_POSITIONS = 7
_MOST_OF_NEIGHBOUR = 0.25
"""The position beside a lone one is aside by half as much, the next one not at all."""
_QUARTILE, _UPPER_FIFTH = 0.319 * math.sqrt(1.5), 1.282 * math.sqrt(1.5)
"""Lower quartile and 80 % quantile of how far a position is aside, in standard deviations of normal noise."""


def find_lone_positions(*axes: FloatArray) -> Mask:
    """Mark the positions that an arm cannot have been at between its positions just before and just after.

    A force may jump, an arm keeps its speed: it is near the middle of its neighbours, and outside of them only where it
    turns back, by its usual way from one reading to the next. An axis that does not move needs another one that does.

    Parameters
    ----------
    *axes : ndarray
        Coordinates of the arm in the order of time, in one unit, shape (n,) each, finite.

    Returns
    -------
    ndarray of bool
        Shape (n,).
    """
    path = np.stack(axes)
    alone = np.zeros(path.shape[1], dtype=bool)
    left = np.arange(path.shape[1])
    # beside a lone position others are seen only when it is out of the way
    while (lone := _find_lone_once(path[:, left])).any():
        alone[left[lone]] = True
        left = left[~lone]
    return alone


def _find_lone_once(path: FloatArray) -> Mask:
    """Mark the positions, shape (axes, n), farthest aside; equal positions in a row count as one."""
    nothing = np.zeros(path.shape[1], dtype=bool)
    moves = (path[:, 1:] != path[:, :-1]).any(axis=0)
    starts = np.flatnonzero(np.concatenate([[True], moves]))
    if starts.size < _FEWEST_POSITIONS:
        return nothing
    lengths = np.diff(np.append(starts, path.shape[1]))
    level = path.take(starts, axis=1)  # in rows, as all that follows goes along them
    aside = level[:, 1:-1] - (level[:, :-2] + level[:, 2:]) / 2
    inner = np.sqrt((aside**2).sum(axis=0))
    least = _LEAST_PART * float(np.ptp(level, axis=1).max())
    if 2 * inner.max() <= least:  # twice: so far may an end be aside
        return nothing
    off = np.concatenate([[_end_aside(inner)], inner, [_end_aside(inner[::-1])]])
    size = np.abs(aside)
    quartile = np.partition(size, inner.size // 4, axis=1)[:, inner.size // 4]
    far = max(_TIMES_NOISE * float(quartile.max()) / _QUARTILE, least)
    neighbour = np.maximum(np.append(off[1:], 0.0), np.append(0.0, off[:-1]))
    places = np.flatnonzero((off > far) & (off >= neighbour) & (lengths <= LONGEST))
    if not places.size:
        return nothing
    # the ways to and from the position itself are left out, and one of four others may be that of another lone position
    way = np.sqrt((np.diff(level) ** 2).sum(axis=0))
    last = way.size - 1
    beside = np.abs(places[:, None] + np.array([-3, -2, 1, 2]))
    usual = np.sort(way[last - np.abs(last - beside)], axis=1)[:, 1]
    # a position between its neighbours was read while the arm moved from one to the other, at whatever speed
    before = level[:, np.abs(places - 1)]
    after = level[:, last + 1 - np.abs(last - places)]
    above = level[:, places] - np.maximum(before, after)
    below = np.minimum(before, after) - level[:, places]
    outside = np.maximum(above, below).max(axis=0)
    far_aside = (off[places] > TIMES_USUAL_WAY * usual) & (outside > _LEAST_OUTSIDE * off[places])
    places = places[far_aside]
    if not places.size:
        return nothing
    # without those beside lone positions most tell the noise; where a log was interpolated, half of them are aside by nothing
    good = np.ones(starts.size + 2, dtype=bool)
    good[np.concatenate([places, places + 1, places + 2])] = False
    kept = size[:, good[2:-2]]
    if kept.shape[1]:
        far = _TIMES_NOISE * float(np.quantile(kept, 0.8, axis=1).max()) / _UPPER_FIFTH
    lone = np.zeros(starts.size, dtype=bool)
    lone[places[off[places] > far]] = True
    return np.repeat(lone, lengths)


_LEAST_OUTSIDE = 0.5
"""Part of the way aside by which a lone position is outside of its neighbours, at least."""


def _end_aside(inner: FloatArray) -> float:
    """How far the first position is off the line through the next two, if it is not the second that is aside."""
    second, third = inner[:2]
    return 2 * float(second) if third < _MOST_OF_NEIGHBOUR * second else 0.0
