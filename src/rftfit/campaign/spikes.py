"""Readings that stand alone: far from all readings before and after them, as no force and no position can be.

A loose contact, a lost packet or a code for "no data" gives single readings. A true step stays on the other side, and
a force that slips falls from a peak that it has risen to: both are close to the readings on one of their sides.
"""

from __future__ import annotations

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
    change = np.diff(values)
    changes = change != 0
    if changes.all():
        starts = np.arange(values.size)
        level = values
    else:
        starts = np.flatnonzero(np.concatenate([[True], changes]))
        level = values[starts]
        change = np.diff(level)
    if level.size < 2 * _SIDE + 1:
        return nothing
    step = np.abs(change)
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
