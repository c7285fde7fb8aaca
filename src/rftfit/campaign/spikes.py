"""Finds false readings: spikes, held readings, the end of an amplifier, lone positions of an arm; and steps that stay.

A loose contact, a lost packet or a code for "no data" gives readings with a jump before and a jump back behind them. A
true step stays on the other side, and a force that slips falls from a peak to which it has risen: such readings are
close to the readings on one of their sides.

Equal readings in a row are a *level*. Thresholds and their reasons stand in ``chosen.toml``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.store.chosen import chosen

Mask = npt.NDArray[np.bool_]

_SPIKES = chosen("campaign", "spikes")
_HELD = chosen("campaign", "held")
_STEPS = chosen("campaign", "steps")
_PLATEAU = chosen("campaign", "plateau")
_POSITIONS = chosen("campaign", "positions")

FEWEST_ROWS: int = _SPIKES.most_rows
"""Most rows in a row that may be a spike, in the slowest log."""
MOST_SHARE: float = _SPIKES.most_share
"""Largest share of spikes: with more of them, the good readings cannot be told from the bad ones."""


def find_spikes(
    values: FloatArray,
    most_rows: int = FEWEST_ROWS,
    times: float = _SPIKES.times_usual_step,
    *,
    ends_in_push: bool = False,
) -> Mask:
    """Mark the spikes of one channel: readings far from those before and behind them, alone or for some rows.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    most_rows : int, optional
        Most rows of a spike; readings that stay away longer may be right.
    times : float, optional
        Least distance of a spike from the readings beside it, in small steps near it.
    ends_in_push : bool, optional
        Whether the first and the last reading are from a steady push, as in a table of stress: then a reading far
        away at an end is a spike, and no true step.

    Returns
    -------
    ndarray of bool
        True for a spike, shape (n,).
    """
    return _find_repeatedly(
        lambda rest: _find_spikes_once(rest, most_rows, times, ends_in_push), values
    )


def _find_repeatedly(find_once: Callable[[FloatArray], Mask], values: FloatArray) -> Mask:
    """Mark the bad readings among `values`, shape (..., n): search again without those found, until no more are found.

    Where many readings are bad, some are found only after others have been removed.
    """
    is_bad = marked = find_once(values)
    unmarked = np.arange(marked.size)
    while is_bad.any():
        unmarked = unmarked[~is_bad]
        is_bad = find_once(values[..., unmarked])
        marked[unmarked[is_bad]] = True
    return marked


def _find_spikes_once(values: FloatArray, most_rows: int, times: float, ends_in_push: bool) -> Mask:
    """Mark readings far from the level on both sides; the arguments as in `find_spikes`."""
    nothing = np.zeros(values.size, dtype=bool)
    starts = _starts_of_levels(values[1:] != values[:-1])
    level = values[starts]
    if level.size < 2 * _SPIKES.side + 1:
        return nothing
    step = np.abs(level[1:] - level[:-1])
    far = times * _usual_steps(step)
    # a fast way out, as most logs have no jump: a spike has a jump of about its size at both ends
    jumps = np.flatnonzero(step > np.minimum(far[1:], far[:-1]) / 2)
    if not jumps.size:
        return nothing
    edges = np.append(starts, values.size)
    is_spike = np.zeros(level.size, dtype=bool)
    if _may_come_back(level, jumps, edges, most_rows):
        groups = [*_candidate_groups(values, level, jumps, far, edges, most_rows)]
        for first, stop in _choose_groups(groups, level, edges):
            is_spike[first:stop] = True
    lengths = np.diff(edges)
    for end in (0, -1):
        if (
            step[end] > far[end]
            and lengths[end] <= FEWEST_ROWS
            and _is_end_alone(level, far, at_start=end == 0, ends_in_push=ends_in_push)
        ):
            is_spike[end] = True
    return np.repeat(is_spike, lengths)


def _starts_of_levels(changes: Mask) -> np.ndarray:
    """Return the rows in which levels start.

    `changes`: True for each reading from the second on that differs from the one before, shape (n - 1,).
    """
    return np.flatnonzero(np.concatenate([[True], changes]))


def _may_come_back(level: FloatArray, jumps: np.ndarray, edges: np.ndarray, most_rows: int) -> bool:
    """Return whether a jump is soon followed by one the other way: a fast test, which most logs do not pass.

    `level`, `jumps`, `edges`: As in `_candidate_groups`.
    """
    grows = level[jumps + 1] > level[jumps]
    turns = np.flatnonzero(grows[1:] != grows[:-1])
    rows_away = edges[jumps[turns + 1] + 1] - edges[jumps[turns] + 1]
    return bool((rows_away <= most_rows).any())


def _candidate_groups(
    values: FloatArray,
    level: FloatArray,
    jumps: np.ndarray,
    far: FloatArray,
    edges: np.ndarray,
    most_rows: int,
) -> Iterator[tuple[int, int]]:
    """Yield groups of levels between two jumps that are far from the levels on both sides: first level, and stop.

    `level`: Readings of the levels. `jumps`: Last level before each jump. `far`: Least distance of each level that
    counts as far. `edges`: First row of each level, and the number of rows.
    """
    # levels on both sides of each jump; near an end of the log those that are missing are replaced by their mirror image
    sides = np.arange(_SPIKES.side)
    last = level.size - 1
    before = np.median(level[np.abs(jumps[:, None] - sides)], axis=1)
    after = np.median(level[last - np.abs(last - jumps[:, None] - 1 - sides)], axis=1)
    low, high = np.quantile(values, [0.1, 0.9])
    least = _SPIKES.least_of_range * float(high - low)
    firsts = (jumps + 1).tolist()
    for entry, first in enumerate(firsts):
        if first < _SPIKES.fewest:
            continue
        # of the levels of the group that are seen so far
        lowest, highest, least_far, seen = math.inf, -math.inf, math.inf, first
        for back in range(entry + 1, len(firsts)):
            stop = firsts[back]
            if edges[stop] - edges[first] > most_rows or stop > level.size - _SPIKES.fewest:
                break
            lowest = min(lowest, float(level[seen:stop].min()))
            highest = max(highest, float(level[seen:stop].max()))
            least_far = min(least_far, float(far[seen:stop].min()))
            seen = stop
            if lowest <= before[entry] <= highest:
                # some level is not outside, which further levels cannot change
                break
            # readings between the two levels may be right: the force was changing from one to the other
            low, high = sorted((before[entry], after[back]))
            distance = max(lowest - high, low - highest)
            is_peak = stop == first + 1 and _is_peak(level, first)
            if distance > least_far and (
                is_peak
                or (
                    distance > least
                    and _is_sharp(level, (first - 1, first), before[entry])
                    and _is_sharp(level, (stop, stop - 1), after[back])
                )
            ):
                yield first, stop
                break


def _choose_groups(
    groups: Sequence[tuple[int, int]], level: FloatArray, edges: np.ndarray
) -> Iterator[tuple[int, int]]:
    """Yield the groups that are spikes, where candidates touch: good readings between two spikes look like one, too.

    Among candidates that touch, the shortest are chosen first. They are chosen in the order of time, or against it, if
    the readings left then go there and back by less than half as much. `groups`: First level and stop of each
    candidate, in the order of time. `edges`: First row of each level.
    """
    for chain in _chains(groups):
        start = max(chain[0][0] - _SPIKES.block, 0)
        stop = max(stop for _, stop in chain) + _SPIKES.block
        shortest_first = sorted(chain, key=lambda group: edges[group[1]] - edges[group[0]])
        least, chosen = math.inf, chain
        for order in (shortest_first, chain, chain[::-1]) if len(chain) > 1 else ():
            apart = _without_touching(order)
            is_good = np.ones(level.size, dtype=bool)
            for first, behind in apart:
                is_good[first:behind] = False
            good = level[start:stop][is_good[start:stop]]
            there_and_back = float(np.abs(np.diff(good)).sum()) - abs(float(good[-1] - good[0]))
            if there_and_back < least / 2:
                least, chosen = there_and_back, apart
        yield from chosen


def _chains(groups: Sequence[tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
    """Split groups, in the order of time, into chains: each group of a chain touches an earlier one of it."""
    chain: list[tuple[int, int]] = []
    for group in groups:
        if chain and group[0] > max(stop for _, stop in chain):
            yield chain
            chain = []
        chain.append(group)
    if chain:
        yield chain


def _without_touching(groups: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the first group, and each further one that touches none of those chosen before it."""
    chosen: list[tuple[int, int]] = []
    for first, stop in groups:
        if all(stop < start or first > end for start, end in chosen):
            chosen.append((first, stop))
    return chosen


def _is_peak(level: FloatArray, index: int) -> bool:
    """Return whether the steps before and behind a level have opposite signs; on the side of a bump they have not."""
    before, peak, behind = level[index - 1 : index + 2]
    return bool((peak - before) * (behind - peak) < 0)


def _is_sharp(level: FloatArray, edge: tuple[int, int], beside: float) -> bool:
    """Return whether a single jump leads from the level beside a group into the group.

    A bump of the force begins and ends with several steps. `edge`: Last level outside the group, first level inside.
    `beside`: Median of the levels beside the group.
    """
    outside, inside = edge
    jump = abs(float(level[inside] - level[outside]))
    return bool(abs(float(level[outside]) - beside) < _SPIKES.most_of_jump * jump)


def _is_end_alone(
    level: FloatArray, far: FloatArray, *, at_start: bool, ends_in_push: bool
) -> bool:
    """Return whether the first or last level is a spike: far from the levels beside it, which are close together.

    A force may rise or fall at once where a log begins or ends, but not to a value far outside all other readings.
    `far`: Least distance of each level that counts as far. `ends_in_push`: As in `find_spikes`.
    """
    ordered = level if at_start else level[::-1]
    beside = ordered[1 : 1 + _SPIKES.side]
    distance = abs(float(ordered[0] - np.median(beside)))
    if distance <= max(float(far[0 if at_start else -1]), float(np.ptp(beside))):
        return False
    others = ordered[1:]
    outside = max(float(others.min() - ordered[0]), float(ordered[0] - others.max()))
    return ends_in_push or outside > float(np.ptp(others))


def _usual_steps(step: FloatArray) -> FloatArray:
    """Return the usual step near each of n + 1 readings, from the n steps between them.

    It is the lower quartile of the steps of a block, and of three neighbouring blocks the largest. A quartile, since
    steps to and from bad readings are large: a quarter of bad readings makes half of the steps large.
    """
    size = min(_SPIKES.block, step.size)
    count = step.size // size
    blocks = step[: count * size].reshape(count, size)
    quarter = size // 4
    lower_quartile = np.partition(blocks, quarter, axis=1)[:, quarter]
    near = _largest_near(lower_quartile)
    usual = np.full(step.size + 1, near[-1])
    usual[: count * size] = np.repeat(near, size)
    return usual


def _largest_near(values: FloatArray) -> FloatArray:
    """Return the largest of each value and its two neighbours, shape (n,)."""
    largest = values.copy()
    np.maximum(largest[1:], values[:-1], out=largest[1:])
    np.maximum(largest[:-1], values[1:], out=largest[:-1])
    return largest


# --- Readings that are repeated until a jump to the true value


def find_held(values: FloatArray) -> Mask:
    """Mark held readings: equal readings until a jump, as a driver repeats its last value where a new one is missing.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.

    Returns
    -------
    ndarray of bool
        Shape (n,): all readings of a hold but its first.
    """
    held = np.zeros(values.size, dtype=bool)
    repeats = values[1:] == values[:-1]
    # a fast way out, as most channels have no jump behind equal readings: a coarse sensor changes by one bit
    if np.count_nonzero(repeats) < _HELD.fewest - 1:
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
    if steps.size < 2 * _SPIKES.side or jumps.max() <= _HELD.times_mean_step * steps.mean():
        return held
    starts = _starts_of_levels(~repeats)
    lengths = np.diff(np.append(starts, values.size))
    level = values[starts]
    long = np.flatnonzero(lengths[:-1] >= _HELD.fewest)
    # a channel that is slower than its logger repeats each reading
    usual = float(np.quantile(lengths, _SPIKES.usual_share))
    # half of what makes a spike, since there is a jump at one end alone
    far = _SPIKES.times_usual_step * _usual_steps(steps) / 2
    for index in long[lengths[long] >= _HELD.times_usual * usual]:
        jump = abs(level[index + 1] - level[index])
        jump_before = abs(level[index] - level[max(index - 1, 0)])
        if jump > far[index] and jump_before < jump / 2:
            held[starts[index] + 1 : starts[index + 1]] = True
    return held


# --- Steps that stay


class LastingStep(NamedTuple):
    """A jump that stays, between the readings in `row` and the row before; `size`: in the unit of the readings."""

    row: int
    size: float


def find_steps(values: FloatArray, rows: int) -> list[LastingStep]:
    """Find the jumps after which readings continue at a distance from the trend before.

    Parameters
    ----------
    values : ndarray
        Readings in the order of time, shape (n,), finite.
    rows : int
        Rows before and after a jump that show the trend: those of a second.

    Returns
    -------
    list of LastingStep
        In the order of time.
    """
    change = np.diff(values)
    if change.size < 2 * _STEPS.fewest_for_trend:
        return []
    size = min(_SPIKES.block, change.size)
    count = change.size // size
    trend = np.median(change[: count * size].reshape(count, size), axis=1)
    away = np.abs(change - trend[np.minimum(np.arange(change.size) // size, count - 1)])
    far = _STEPS.times_usual_change * _usual_departures(away, size, count)
    # a change over several readings is no step: the changes beside a jump must be small
    padded = np.concatenate([[0.0, 0.0], away, [0.0, 0.0]])
    beside = np.maximum.reduce([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
    jumps = np.flatnonzero((away > far) & (beside <= _SPIKES.most_of_jump * away))
    if jumps.size > _STEPS.most_jumps:
        return []
    rows = max(rows, _STEPS.fewest_for_trend)
    steps = []
    for jump in jumps.tolist():  # between the rows `jump` and `jump + 1`
        before = values[max(jump + 1 - rows, 0) : jump + 1]
        after = values[jump + 1 : jump + 1 + rows]
        if min(before.size, after.size) < _STEPS.fewest_for_trend:
            continue
        gap = _start_of_line(after) - _start_of_line(before[::-1], beyond=1.0)
        stays = _STEPS.staying[0] < gap / change[jump] < _STEPS.staying[1]
        if stays and not _is_slip(change, np.flatnonzero(away > far), jump, rows):
            steps.append(LastingStep(jump + 1, float(gap)))
    return steps


def _is_slip(change: FloatArray, jumps: np.ndarray, jump: int, rows: int) -> bool:
    """Return whether a jump is a slip of the force: one of many jumps in the same direction.

    Between slips the force grows back. A zero that changes, or a loose cable, jumps seldom, or in both directions.
    `change`: Changes from reading to reading. `jumps`: Places of all large changes. `rows`: Rows in a second.
    """
    near = jumps[np.abs(jumps - jump) <= _STEPS.seconds_around * rows]
    ratios = change[near] / change[jump]
    same_way = np.count_nonzero(ratios >= _STEPS.comparable) - 1  # without the jump itself
    other_way = np.count_nonzero(ratios <= -_STEPS.comparable)
    return bool(same_way >= _STEPS.fewest_slips and 2 * other_way < same_way)


def may_step(channels: FloatArray) -> np.ndarray:
    """Return the numbers of the `channels`, shape (k, n), that may have a step: a fast test, which few channels pass.

    One change is far from the others near it.
    """
    change = channels[:, 1:] - channels[:, :-1]
    size = min(_SPIKES.block, change.shape[1])
    if size < 2 * _STEPS.fewest_for_trend:
        return np.arange(0)
    count = change.shape[1] // size
    # the last block ends with the last change
    blocks = np.concatenate([change[:, : count * size], change[:, -size:]], axis=1)
    away = blocks.reshape(-1, count + 1, size)
    away -= away.mean(axis=2, keepdims=True)
    np.abs(away, out=away)
    is_far = away.max(axis=2) > _STEPS.times_mean_change * away.mean(axis=2)
    return np.flatnonzero(is_far.any(axis=1))


def _usual_departures(away: FloatArray, size: int, count: int) -> FloatArray:
    """Return the usual departure from the trend near each change, shape (n,).

    It is the median in a block, and of three neighbouring blocks the largest. `away`: Departures, shape (n,). `size`,
    `count`: Changes in a block, and number of blocks.
    """
    usual = np.median(away[: count * size].reshape(count, size), axis=1)
    near = _largest_near(usual)
    # where most readings repeat the one before, the median is 0, and any change would be a step
    least = float(np.quantile(away, _SPIKES.usual_share) / _STEPS.times_usual_change)
    return np.maximum(near, least)[np.minimum(np.arange(away.size) // size, count - 1)]


def _start_of_line(values: FloatArray, beyond: float = 0.0) -> float:
    """Return the value of the straight line through some readings at the first one, or `beyond` rows before it."""
    return float(values.mean()) - _slope_by_row(values) * ((values.size - 1) / 2 + beyond)


# --- The end of an amplifier


def find_plateau(values: FloatArray) -> Mask:
    """Mark the readings at the end of an amplifier: the highest level, where growth stops at once and noise is left.

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
    if values.size < 2 * _PLATEAU.fewest:
        return nothing
    # a fast way out, as most channels have few readings near the highest
    noise = _estimate_noise(values[:: 1 + values.size // _PLATEAU.most_for_noise])
    highest = float(values.max())
    near = np.count_nonzero(values >= highest - _PLATEAU.times_noise * noise)
    if near < _PLATEAU.fewest or highest < 2 * _PLATEAU.times_noise * noise:
        return nothing
    first, last = _longest_at_top(values, noise)
    if last + 1 - first < _PLATEAU.fewest:
        return nothing
    # an amplifier cuts part of the noise at its end: readings below show the whole noise
    noise = max(_estimate_noise(values), _estimate_noise(values[:first]))
    first, last = _longest_at_top(values, noise)
    length = last + 1 - first
    # before the end: readings that are below it by more than their noise
    below = np.flatnonzero(values[:first] < highest - _PLATEAU.times_noise / 2 * noise)
    before = values[below[-min(max(length, _PLATEAU.fewest), _PLATEAU.most_before) :]]
    if before.size < _PLATEAU.fewest:
        return nothing
    growth_before = _slope_by_row(before)
    if growth_before <= 0:
        return nothing
    # in the first rows readings still grow to the end: they are left out
    entered = math.ceil(_PLATEAU.times_noise * noise / growth_before)
    inside = values[first + entered : last]
    if inside.size < _PLATEAU.fewest:
        return nothing
    white = float(np.diff(inside, n=2).std()) / math.sqrt(6)
    if np.ptp(inside) > 0 and float(inside.std()) > _PLATEAU.most_sway * white:
        return nothing
    growth = _slope_by_row(inside)
    # the growth of a curve that bends to its highest point becomes smaller before it
    quarter = int(np.argmax(values >= values[first] / 4))
    usual_growth = float(values[first] - values[quarter]) / max(first - quarter, 1)
    if growth_before * inside.size < _PLATEAU.least_lost * noise or not (
        abs(growth) < _PLATEAU.most_growth * growth_before
        and growth_before > _PLATEAU.least_growth * usual_growth
    ):
        return nothing
    nothing[first : last + 1] = True
    return nothing


def _estimate_noise(values: FloatArray) -> float:
    """Return the standard deviation of the noise of readings, by the median of their second differences.

    Where this is 0, as for a coarse sensor, a quarter of the least step.
    """
    steps = np.diff(values)
    second = np.abs(np.diff(steps))
    if second.size < _PLATEAU.fewest:
        return 0.0
    median = float(np.partition(second, second.size // 2)[second.size // 2])
    if median > 0:
        # of normal noise the median is 0.6745 standard deviations, and a second difference has the variance 1 + 4 + 1
        return median / (0.6745 * math.sqrt(6))
    sizes = np.abs(steps)
    return float(sizes[sizes > 0].min(initial=math.inf)) / 4 if sizes.any() else 0.0


def _longest_at_top(values: FloatArray, noise: float) -> tuple[int, int]:
    """Return first and last row of the longest stretch of readings within the noise of the highest one."""
    near = np.flatnonzero(values >= values.max() - _PLATEAU.times_noise * noise)
    breaks = np.flatnonzero(np.diff(near) > _PLATEAU.most_apart)
    firsts = near[np.append(0, breaks + 1)]
    lasts = near[np.append(breaks, near.size - 1)]
    longest = int(np.argmax(lasts - firsts))
    return int(firsts[longest]), int(lasts[longest])


def _slope_by_row(values: FloatArray) -> float:
    """Return the slope of the straight line through some readings, shape (n,), by row."""
    row = np.arange(values.size) - (values.size - 1) / 2
    return float(row @ values) / float(row @ row)


# --- Positions of an arm


_QUARTILE, _UPPER_FIFTH = 0.319 * math.sqrt(1.5), 1.282 * math.sqrt(1.5)
"""25 % and 80 % quantile of the distance aside, in standard deviations of normal noise of a coordinate.

The distance aside is that of a coordinate from the middle of its neighbours, with 1 + 1/4 + 1/4 of its variance.
"""


def find_lone_positions(*axes: FloatArray) -> Mask:
    """Mark lone positions: those where an arm cannot have been between its positions just before and just after.

    A force may jump, but an arm keeps its speed: each position is near the middle of its neighbours. It is outside of
    them only where the arm turns back, by a usual way from one reading to the next. An axis that rests can be judged
    only together with one that moves.

    Parameters
    ----------
    *axes : ndarray
        Coordinates of the arm in the order of time, in one unit, shape (n,) each, finite.

    Returns
    -------
    ndarray of bool
        True for a lone position, shape (n,).
    """
    return _find_repeatedly(_find_lone_once, np.array(axes))


def _find_lone_once(path: FloatArray) -> Mask:
    """Mark the positions farthest aside, in a path of shape (axes, n); equal positions in a row count as one."""
    nothing = np.zeros(path.shape[1], dtype=bool)
    moves = (path[:, 1:] != path[:, :-1]).any(axis=0)
    starts = _starts_of_levels(moves)
    if starts.size < _POSITIONS.fewest:
        return nothing
    lengths = np.diff(np.append(starts, path.shape[1]))
    level = path.take(starts, axis=1)  # contiguous along the rows, which is fast below
    aside = level[:, 1:-1] - (level[:, :-2] + level[:, 2:]) / 2
    inner = np.sqrt((aside**2).sum(axis=0))
    least = _POSITIONS.least_part * float(np.ptp(level, axis=1).max())
    if 2 * inner.max() <= least:  # twice, as an end may be that far aside (`_end_aside`)
        return nothing
    off = np.concatenate([[_end_aside(inner)], inner, [_end_aside(inner[::-1])]])
    size = np.abs(aside)
    quartile = np.partition(size, inner.size // 4, axis=1)[:, inner.size // 4]
    far = max(_POSITIONS.times_noise * float(quartile.max()) / _QUARTILE, least)
    largest_beside = np.maximum(np.append(off[1:], 0.0), np.append(0.0, off[:-1]))
    suspects = np.flatnonzero((off > far) & (off >= largest_beside) & (lengths <= FEWEST_ROWS))
    if not suspects.size:
        return nothing
    # usual way: the second smallest of the two ways before and the two behind, without those of the position itself
    way = np.sqrt((np.diff(level) ** 2).sum(axis=0))
    last = way.size - 1
    beside = np.abs(suspects[:, None] + np.array([-3, -2, 1, 2]))
    usual = np.sort(way[last - np.abs(last - beside)], axis=1)[:, 1]
    # a position between its neighbours may be right, at any speed of the arm
    before = level[:, np.abs(suspects - 1)]
    after = level[:, last + 1 - np.abs(last - suspects)]
    above = level[:, suspects] - np.maximum(before, after)
    below = np.minimum(before, after) - level[:, suspects]
    outside = np.maximum(above, below).max(axis=0)
    far_aside = (off[suspects] > _POSITIONS.times_usual_way * usual) & (
        outside > _POSITIONS.least_outside * off[suspects]
    )
    suspects = suspects[far_aside]
    if not suspects.size:
        return nothing
    # noise again, without the positions beside lone ones; 80 %, since half are 0 aside in an interpolated log
    good = np.ones(starts.size + 2, dtype=bool)
    good[np.concatenate([suspects, suspects + 1, suspects + 2])] = False
    kept = size[:, good[2:-2]]
    if kept.shape[1]:
        far = _POSITIONS.times_noise * float(np.quantile(kept, 0.8, axis=1).max()) / _UPPER_FIFTH
    is_lone = np.zeros(starts.size, dtype=bool)
    is_lone[suspects[off[suspects] > far]] = True
    return np.repeat(is_lone, lengths)


def _end_aside(inner: FloatArray) -> float:
    """Return how far the first position is off the line through the next two; 0 if the second one is aside.

    `inner`: Distances aside of the second position and of those behind it.
    """
    second, third = inner[:2]
    return 2 * float(second) if third < _POSITIONS.most_of_neighbour * second else 0.0
