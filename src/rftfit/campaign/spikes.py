"""Readings that are none: alone, away and back within a second, held, at the end of an amplifier; and steps that stay.

A loose contact, a lost packet or a code for "no data" gives readings that are entered and left by a jump. A true step
stays on the other side, and a force that slips falls from a peak that it has risen to: both are close to the readings on
one of their sides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray

Mask = npt.NDArray[np.bool_]

TIMES_USUAL_STEP = 20.0
"""A reading is far from others by so many times a small step near it, or more: by 9 standard deviations of noise."""
FEWEST_ROWS = 3
"""Rows that readings may be away for in the slowest log."""
MOST_SHARE = 0.25
"""With a larger share of such readings, nobody knows which readings are the good ones."""
_SIDE = 5
"""Readings on each side whose median is the level there."""
_FEWEST = 2
"""Readings that there are on each side of those that are judged by both sides."""
_BLOCK = 50
"""Readings that one usual step is taken from."""


def find_spikes(
    values: FloatArray,
    most_rows: int = FEWEST_ROWS,
    times: float = TIMES_USUAL_STEP,
    *,
    ends_in_push: bool = False,
) -> Mask:
    """Mark the readings of one channel that stand alone, or that are away from the others for some rows.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    most_rows : int, optional
        Rows that readings may be away for; those that stay away longer may be right.
    times : float, optional
        Small steps by which a reading that stands alone is farther off, at least.
    ends_in_push : bool, optional
        Whether the first and the last reading are of a steady push, as in a table of stress, and no step.

    Returns
    -------
    ndarray of bool
        Shape (n,).
    """
    return _find_again(lambda left: _find_once(left, most_rows, times, ends_in_push), values)


def _find_again(find_once: Callable[[FloatArray], Mask], values: FloatArray) -> Mask:
    """Mark what is found in readings, shape (..., n), and in those that are left, until nothing is.

    Where many readings are bad, some are found only when others are out of the way.
    """
    is_bad = marked = find_once(values)
    left = np.arange(marked.size)
    while is_bad.any():
        left = left[~is_bad]
        is_bad = find_once(values[..., left])
        marked[left[is_bad]] = True
    return marked


def _find_once(values: FloatArray, most_rows: int, times: float, ends_in_push: bool) -> Mask:
    """Mark readings far from the level on both sides of them; equal readings in a row count as one."""
    nothing = np.zeros(values.size, dtype=bool)
    starts = _starts(values[1:] != values[:-1])
    level = values[starts]
    if level.size < 2 * _SIDE + 1:
        return nothing
    step = np.abs(level[1:] - level[:-1])
    far = times * _usual_steps(step)
    # most logs hold no jump at all: whatever is away is entered and left by one of about its size
    jumps = np.flatnonzero(step > np.minimum(far[1:], far[:-1]) / 2)
    if not jumps.size:
        return nothing
    ends = np.append(starts, values.size)
    spikes = np.zeros(level.size, dtype=bool)
    if _may_come_back(level, jumps, ends, most_rows):
        pairs = [*_pairs(values, level, jumps, far, ends, most_rows)]
        for first, stop in _choose_groups(pairs, level, ends):
            spikes[first:stop] = True
    lengths = np.diff(ends)
    for place in (0, -1):
        if (
            step[place] > far[place]
            and lengths[place] <= FEWEST_ROWS
            and _is_end_alone(level, far, at_start=place == 0, ends_in_push=ends_in_push)
        ):
            spikes[place] = True
    return np.repeat(spikes, lengths)


def _starts(changes: Mask) -> np.ndarray:
    """Places at which stretches of equal readings start; `changes`: whether each differs from the one before, but for the first."""
    return np.flatnonzero(np.concatenate([[True], changes]))


def _may_come_back(level: FloatArray, jumps: np.ndarray, ends: np.ndarray, most_rows: int) -> bool:
    """Look for a jump, and one the other way soon after it: most logs have none, and this is quick."""
    grows = level[jumps + 1] > level[jumps]
    turns = np.flatnonzero(grows[1:] != grows[:-1])
    return bool((ends[jumps[turns + 1] + 1] - ends[jumps[turns] + 1] <= most_rows).any())


def _pairs(
    values: FloatArray,
    level: FloatArray,
    jumps: np.ndarray,
    far: FloatArray,
    ends: np.ndarray,
    most_rows: int,
) -> Iterator[tuple[int, int]]:
    """Yield first and stop of levels between two jumps that lie far from the levels on both sides.

    `jumps`: Last level before each jump. `far`: How far each level is to be off. `ends`: First row of each level, and the
    number of rows.
    """
    # beside a reading near an end those that there are, as in a mirror
    sides = np.arange(_SIDE)
    last = level.size - 1
    before = np.median(level[np.abs(jumps[:, None] - sides)], axis=1)
    after = np.median(level[last - np.abs(last - jumps[:, None] - 1 - sides)], axis=1)
    tenths = np.quantile(values, [0.1, 0.9])
    least = _LEAST_OF_RANGE * float(tenths[1] - tenths[0])
    places = jumps.tolist()
    for index, place in enumerate(places):
        first = place + 1
        if first < _FEWEST:
            continue
        lowest, highest, least_far, seen = math.inf, -math.inf, math.inf, first
        for later in range(index + 1, len(places)):
            stop = places[later] + 1
            if ends[stop] - ends[first] > most_rows or stop > level.size - _FEWEST:
                break
            lowest = min(lowest, float(level[seen:stop].min()))
            highest = max(highest, float(level[seen:stop].max()))
            least_far = min(least_far, float(far[seen:stop].min()))
            seen = stop
            if lowest <= before[index] <= highest:
                # and so it stays, however many levels are added
                break
            # between the two levels lies what was read while the force changed from one to the other
            low, high = sorted((before[index], after[later]))
            off = max(lowest - high, low - highest)
            if off > least_far and (
                (stop == first + 1 and _turns(level, first))
                or (
                    off > least
                    and _is_sharp(level, (place, first), before[index])
                    and _is_sharp(level, (stop, stop - 1), after[later])
                )
            ):
                yield first, stop
                break


def _choose_groups(
    pairs: Sequence[tuple[int, int]], level: FloatArray, ends: np.ndarray
) -> Iterator[tuple[int, int]]:
    """Yield groups of bad readings: what lies between two of them is away from them as well, as they are from it.

    Of groups that touch one another the shortest are chosen first; or those in the order of time, or against it, where without
    them the readings go there and back by less than half as much. `pairs`: First and stop of each group, in the order of time. `ends`: First row of each level.
    """
    for chain in _chains(pairs):
        start, stop = max(chain[0][0] - _BLOCK, 0), max(stop for _, stop in chain) + _BLOCK
        shortest_first = sorted(chain, key=lambda pair: ends[pair[1]] - ends[pair[0]])
        least, chosen = math.inf, chain
        for order in (shortest_first, chain, chain[::-1]) if len(chain) > 1 else ():
            groups = _without_touching(order)
            is_left = np.ones(level.size, dtype=bool)
            for first, behind in groups:
                is_left[first:behind] = False
            left = level[start:stop][is_left[start:stop]]
            there_and_back = float(np.abs(np.diff(left)).sum()) - abs(float(left[-1] - left[0]))
            if there_and_back < least / 2:
                least, chosen = there_and_back, groups
        yield from chosen


def _chains(pairs: Sequence[tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
    """Part groups, in the order of time, into those of which each touches one before it."""
    chain: list[tuple[int, int]] = []
    for pair in pairs:
        if chain and pair[0] > max(stop for _, stop in chain):
            yield chain
            chain = []
        chain.append(pair)
    if chain:
        yield chain


def _without_touching(pairs: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Take the first of some groups, and each further one that touches none that is taken."""
    taken: list[tuple[int, int]] = []
    for first, stop in pairs:
        if all(stop < start or first > end for start, end in taken):
            taken.append((first, stop))
    return taken


def _turns(level: FloatArray, index: int) -> bool:
    """Tell whether a level is left by a jump the other way than it is entered: on the side of a bump it is not."""
    entered = level[index] - level[index - 1]
    return bool(entered * (level[index + 1] - level[index]) < 0)


def _is_sharp(level: FloatArray, edge: tuple[int, int], beside: float) -> bool:
    """Tell whether one jump leads from the level beside a group into it: a bump of the force begins and ends with steps.

    `edge`: Last level outside, first one inside.
    """
    outside, inside = edge
    jump = abs(float(level[inside] - level[outside]))
    return abs(float(level[outside]) - beside) < _MOST_OF_JUMP * jump


_LEAST_OF_RANGE = 0.05
"""Part of the range from the first to the last tenth of the readings by which several are off: a coarse bit may flicker."""
_MOST_OF_JUMP = 0.25
"""Part of the jump by which the last level outside of a group is off from those before it, at most."""


def _is_end_alone(
    level: FloatArray, far: FloatArray, *, at_start: bool, ends_in_push: bool
) -> bool:
    """Tell whether the first or the last level is far from those beside it, which are close to one another.

    A force may rise or fall at once where a log begins or ends; outside of all other readings it does not.
    """
    ordered = level if at_start else level[::-1]
    beside = ordered[1 : 1 + _SIDE]
    off = abs(float(ordered[0] - np.median(beside)))
    if off <= max(float(far[0 if at_start else -1]), float(np.ptp(beside))):
        return False
    others = ordered[1:]
    outside = max(float(others.min() - ordered[0]), float(ordered[0] - others.max()))
    return ends_in_push or outside > float(np.ptp(others))


def _usual_steps(step: FloatArray) -> FloatArray:
    """Lower quartile of the steps near each reading, the largest of three blocks, shape (n + 1,).

    Steps to and from bad readings are large: a quarter of such readings makes half of the steps.
    """
    size = min(_BLOCK, step.size)
    count = step.size // size
    blocks = step[: count * size].reshape(count, size)
    quarter = size // 4
    lower = np.partition(blocks, quarter, axis=1)[:, quarter]
    near = _largest_near(lower)
    usual = np.full(step.size + 1, near[-1])
    usual[: count * size] = np.repeat(near, size)
    return usual


def _largest_near(values: FloatArray) -> FloatArray:
    """Largest of each value and its two neighbours, shape (n,)."""
    largest = values.copy()
    np.maximum(largest[1:], values[:-1], out=largest[1:])
    np.maximum(largest[:-1], values[1:], out=largest[:-1])
    return largest


# --- Readings that are repeated until a jump makes up for it


_TIMES_USUAL_HOLD = 5.0
"""Equal readings in a row are held where they are so many times as many as elsewhere."""
_FEWEST_HELD = 4
_TIMES_MEAN_STEP = 2.0


def find_held(values: FloatArray, times: float = TIMES_USUAL_STEP) -> Mask:
    """Mark readings that repeat the one before until a jump, as a driver sends its last value when a new one lacks.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    times : float, optional
        Twice the small steps that the jump at the end of a hold has, at least.

    Returns
    -------
    ndarray of bool
        Shape (n,): all readings of a hold but its first.
    """
    held = np.zeros(values.size, dtype=bool)
    repeats = values[1:] == values[:-1]
    # most channels have no jump behind equal readings, and this is quick: a coarse sensor changes by its own step
    if np.count_nonzero(repeats) < _FEWEST_HELD - 1:
        return held
    ends_hold = repeats[2:-1] & repeats[1:-2] & repeats[:-3]
    if not ends_hold.any():
        return held
    ends_hold &= ~repeats[3:]
    change = values[1:] - values[:-1]
    jumps = np.abs(change[3:][ends_hold])
    if not jumps.size:
        return held
    steps = np.abs(change[~repeats])
    if steps.size < 2 * _SIDE or jumps.max() <= _TIMES_MEAN_STEP * steps.mean():
        return held
    starts = _starts(~repeats)
    lengths = np.diff(np.append(starts, values.size))
    level = values[starts]
    long = np.flatnonzero(lengths[:-1] >= _FEWEST_HELD)
    # as does one that is slower than its logger
    usual = float(np.quantile(lengths, _USUAL_SHARE))
    far = times * _usual_steps(steps) / 2
    for place in long[lengths[long] >= _TIMES_USUAL_HOLD * usual]:
        jump = abs(level[place + 1] - level[place])
        entered = abs(level[place] - level[max(place - 1, 0)])
        if jump > far[place] and entered < jump / 2:
            held[starts[place] + 1 : starts[place + 1]] = True
    return held


_USUAL_SHARE = 0.9


# --- Steps that stay


class LastingStep(NamedTuple):
    """A jump from the reading before `row` to that in it, which stays; `size` in the unit of the readings."""

    row: int
    size: float


_TIMES_USUAL_CHANGE = 10.0
"""A step is so many times as large as a usual departure from the trend near it, or more."""
_STAYING = 0.6, 1.6
"""Least and largest part of a jump that is left between the trends before and after it, of one that stays."""
_FEWEST_FOR_TREND = 5
_MOST_JUMPS = 200
"""Jumps beyond which they are what the readings usually do."""


def find_steps(values: FloatArray, rows: int) -> list[LastingStep]:
    """Find jumps after which readings go on beside their trend of before.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    rows : int
        Rows before and after a jump that show the trend, as of a second.

    Returns
    -------
    list of LastingStep
        In the order of time.
    """
    change = np.diff(values)
    if change.size < 2 * _FEWEST_FOR_TREND:
        return []
    size = min(_BLOCK, change.size)
    count = change.size // size
    trend = np.median(change[: count * size].reshape(count, size), axis=1)
    away = np.abs(change - trend[np.minimum(np.arange(change.size) // size, count - 1)])
    far = _TIMES_USUAL_CHANGE * _usual_departures(away, size, count)
    # what grows over several readings is no step
    padded = np.concatenate([[0.0, 0.0], away, [0.0, 0.0]])
    beside = np.maximum.reduce([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
    jumps = np.flatnonzero((away > far) & (beside <= _MOST_OF_JUMP * away))
    if jumps.size > _MOST_JUMPS:
        return []
    rows = max(rows, _FEWEST_FOR_TREND)
    steps = []
    for jump in jumps.tolist():
        before = values[max(jump + 1 - rows, 0) : jump + 1]
        after = values[jump + 1 : jump + 1 + rows]
        if min(before.size, after.size) < _FEWEST_FOR_TREND:
            continue
        gap = _start_of_line(after) - _start_of_line(before[::-1], beyond=1.0)
        stays = _STAYING[0] < gap / change[jump] < _STAYING[1]
        if stays and not _is_slip(change, np.flatnonzero(away > far), jump, rows):
            steps.append(LastingStep(jump + 1, float(gap)))
    return steps


def _is_slip(change: FloatArray, jumps: np.ndarray, jump: int, rows: int) -> bool:
    """Tell a jump that is one of many the same way from a step: between slips a force grows back, again and again.

    A zero that changes, or a cable that loosens and comes back, does so seldom or in both directions.
    """
    near = jumps[np.abs(jumps - jump) <= _SECONDS_AROUND * rows]
    parts = change[near] / change[jump]
    same_way = np.count_nonzero(parts >= _COMPARABLE) - 1
    other_way = np.count_nonzero(parts <= -_COMPARABLE)
    return bool(same_way >= _FEWEST_SLIPS and 2 * other_way < same_way)


_SECONDS_AROUND = 4
"""Seconds before and after a jump in which others like it make it one of many: of slips of 2 Hz these are 15."""
_COMPARABLE = 1 / 3
"""Part of a jump that another one has, at least, which is like it."""
_FEWEST_SLIPS = 3


def may_step(channels: FloatArray) -> np.ndarray:
    """Numbers of the channels, shape (k, n), of which one change is far from the others near it: few, and found quickly."""
    change = channels[:, 1:] - channels[:, :-1]
    size = min(_BLOCK, change.shape[1])
    if size < 2 * _FEWEST_FOR_TREND:
        return np.arange(0)
    count = change.shape[1] // size
    # the last block ends with the last change
    blocks = np.concatenate([change[:, : count * size], change[:, -size:]], axis=1)
    away = blocks.reshape(-1, count + 1, size)
    away -= away.mean(axis=2, keepdims=True)
    np.abs(away, out=away)
    is_far = away.max(axis=2) > _TIMES_MEAN_CHANGE * away.mean(axis=2)
    return np.flatnonzero(is_far.any(axis=1))


_TIMES_MEAN_CHANGE = 8.0
"""A step is so many times the mean departure in its block, itself among them: 9.5 standard deviations of noise are 9.6 times."""


def _usual_departures(away: FloatArray, size: int, count: int) -> FloatArray:
    """Median of the departures from the trend near each reading, the largest of three blocks, shape (n,)."""
    usual = np.median(away[: count * size].reshape(count, size), axis=1)
    near = _largest_near(usual)
    # where most readings repeat the one before there is no usual departure: any change would be one
    least = float(np.quantile(away, _USUAL_SHARE)) / _TIMES_USUAL_CHANGE
    return np.maximum(near, least)[np.minimum(np.arange(away.size) // size, count - 1)]


def _start_of_line(values: FloatArray, beyond: float = 0.0) -> float:
    """Value of the straight line through some readings at the first of them, or so many rows before it."""
    return float(values.mean()) - _growth(values) * ((values.size - 1) / 2 + beyond)


# --- The end of an amplifier


_FEWEST_AT_END = 10
_MOST_FOR_NOISE = 300
_TIMES_NOISE_AT_END = 7.0
"""Readings at the end of an amplifier lie within so many standard deviations of noise below the highest."""
_LEAST_LOST = 12.0
"""Standard deviations of noise by which readings would have grown meanwhile, at least."""
_MOST_SWAY = 1.5
"""At an end readings depart from their mean by so many times the noise that their second differences show, at most."""
_MOST_GROWTH, _LEAST_GROWTH = 0.2, 0.6
"""Part of the growth before that is left, at most; part of the usual growth just before, at least."""
_MOST_BEFORE = 50
_MOST_APART = 2


def find_plateau(values: FloatArray) -> Mask:
    """Mark the readings at the highest level of a channel, where it stops growing at once and shows noise alone.

    Parameters
    ----------
    values : ndarray
        Readings while the load grows, in the order of time, shape (n,), finite.

    Returns
    -------
    ndarray of bool
        Shape (n,).
    """
    nothing = np.zeros(values.size, dtype=bool)
    if values.size < 2 * _FEWEST_AT_END:
        return nothing
    # most channels have few readings there, and this is quick
    noise = _noise_of(values[:: 1 + values.size // _MOST_FOR_NOISE])
    highest = float(values.max())
    near = np.count_nonzero(values >= highest - _TIMES_NOISE_AT_END * noise)
    if near < _FEWEST_AT_END or highest < 2 * _TIMES_NOISE_AT_END * noise:
        return nothing
    first, last = _longest_at_top(values, noise)
    if last + 1 - first < _FEWEST_AT_END:
        return nothing
    # what is cut off at the end shows less noise than what is below it
    noise = max(_noise_of(values), _noise_of(values[:first]))
    first, last = _longest_at_top(values, noise)
    length = last + 1 - first
    # nor does it cut the readings that noise holds below it at first
    below = np.flatnonzero(values[:first] < highest - _TIMES_NOISE_AT_END / 2 * noise)
    before = values[below[-min(max(length, _FEWEST_AT_END), _MOST_BEFORE) :]]
    if before.size < _FEWEST_AT_END:
        return nothing
    growth_before = _growth(before)
    if growth_before <= 0:
        return nothing
    # the first rows are those in which the end is reached
    entered = math.ceil(_TIMES_NOISE_AT_END * noise / growth_before)
    inside = values[first + entered : last]
    if inside.size < _FEWEST_AT_END:
        return nothing
    white = float(np.diff(inside, n=2).std()) / math.sqrt(6)
    if np.ptp(inside) > 0 and float(inside.std()) > _MOST_SWAY * white:
        return nothing
    growth = _growth(inside)
    # a curve that bends to its highest point has grown less and less before it
    quarter = int(np.argmax(values >= values[first] / 4))
    usual_growth = float(values[first] - values[quarter]) / max(first - quarter, 1)
    if growth_before * inside.size < _LEAST_LOST * noise or not (
        abs(growth) < _MOST_GROWTH * growth_before and growth_before > _LEAST_GROWTH * usual_growth
    ):
        return nothing
    nothing[first : last + 1] = True
    return nothing


def _noise_of(values: FloatArray) -> float:
    """Standard deviation of the noise of readings by their second differences; not below a quarter of their least step."""
    steps = np.diff(values)
    second = np.abs(np.diff(steps))
    if second.size < _FEWEST_AT_END:
        return 0.0
    middle = float(np.partition(second, second.size // 2)[second.size // 2])
    if middle > 0:
        return middle / (0.6745 * math.sqrt(6))
    sizes = np.abs(steps)
    return float(sizes[sizes > 0].min(initial=math.inf)) / 4 if sizes.any() else 0.0


def _longest_at_top(values: FloatArray, noise: float) -> tuple[int, int]:
    """First and last of the longest stretch of readings within the noise of the highest."""
    near = np.flatnonzero(values >= values.max() - _TIMES_NOISE_AT_END * noise)
    breaks = np.flatnonzero(np.diff(near) > _MOST_APART)
    firsts = near[np.append(0, breaks + 1)]
    lasts = near[np.append(breaks, near.size - 1)]
    longest = int(np.argmax(lasts - firsts))
    return int(firsts[longest]), int(lasts[longest])


def _growth(values: FloatArray) -> float:
    """Slope of the straight line through some readings, for each row."""
    place = np.arange(values.size) - (values.size - 1) / 2
    return float(place @ values) / float(place @ place)


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
    return _find_again(_find_lone_once, np.array(axes))


def _find_lone_once(path: FloatArray) -> Mask:
    """Mark the positions, shape (axes, n), farthest aside; equal positions in a row count as one."""
    nothing = np.zeros(path.shape[1], dtype=bool)
    moves = (path[:, 1:] != path[:, :-1]).any(axis=0)
    starts = _starts(moves)
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
    places = np.flatnonzero((off > far) & (off >= neighbour) & (lengths <= FEWEST_ROWS))
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
