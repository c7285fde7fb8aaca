"""Finds false readings: spikes, held readings, end of an amplifier, lone positions of an arm; and steps that stay.

A loose contact, a lost packet or a code for "no data" gives readings with a jump before and a jump back behind them. A
true step stays on the other side, and a force that slips falls from a peak to which it has risen: such readings are
close to the readings on one of their sides.

Terms and arrays of all functions:

- `values`: n readings of one channel in the order of time, in any unit, finite; a mask (n,) is True for false readings
- a *level*: equal readings in a row, which count as one, since a channel slower than its logger repeats each reading;
  `level` (m,): the reading of each level; `starts` (m,): the row in which it begins
- a *step* is the size of the change from one level to the next; a *jump* is a step that is large beside those near it
- a *group*: neighbouring levels between two jumps, as the first level and the one behind the last; it may be a spike
- `far` (m,): distance from which other levels are far from a level

The attributes of `_SPIKES`, `_HELD`, `_STEPS`, `_PLATEAU` and `_POSITIONS` are thresholds; the tables of these names in
``chosen.toml`` give the reason of each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rftfit.conventions import BoolArray, FloatArray
from rftfit.store.chosen import chosen

Mask = BoolArray
"""True for the readings in question, shape (n,)."""

_SPIKES = chosen("campaign", "spikes")
_HELD = chosen("campaign", "held")
_STEPS = chosen("campaign", "steps")
_PLATEAU = chosen("campaign", "plateau")
_POSITIONS = chosen("campaign", "positions")

MOST_LONE_ROWS: int = _SPIKES.most_rows
"""Most rows of one spike or lone position in the slowest log; callers allow spikes of more rows in a faster log."""
MOST_SHARE: float = _SPIKES.most_share
"""Largest share of spikes: with more, good and bad readings cannot be told apart, and callers refuse the log."""


def find_spikes(
    values: FloatArray,
    most_rows: int = MOST_LONE_ROWS,
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
        Least distance of a spike from the readings beside it, in usual steps near it (`_usual_steps`).
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

    Where many readings are bad, some are found only after others have been removed. `find_once`: Returns the mask of
    one search. The mask that is returned has shape (n,).
    """
    is_bad = marked = find_once(values)
    # rows of the readings that are left
    unmarked = np.arange(marked.size)
    while is_bad.any():
        unmarked = unmarked[~is_bad]
        is_bad = find_once(values[..., unmarked])
        marked[unmarked[is_bad]] = True
    return marked


def _find_spikes_once(values: FloatArray, most_rows: int, times: float, ends_in_push: bool) -> Mask:
    """Mark groups far from the levels on both sides, or a first or last level far from all, as `find_spikes`."""
    nothing = np.zeros(values.size, dtype=bool)
    starts = _starts_of_levels(values[1:] != values[:-1])
    level = values[starts]
    if level.size < 2 * _SPIKES.side + 1:
        return nothing
    step = np.abs(level[1:] - level[:-1])
    far = times * _usual_steps(step)
    # a fast way out, as most logs have no jump; half, since a spike has one of about its size at both ends
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
    # the first and last level have neighbours on one side only, and are judged by stricter rules
    for end in (0, -1):
        if (
            step[end] > far[end]
            and lengths[end] <= MOST_LONE_ROWS
            and _is_end_alone(level, far, at_start=end == 0, ends_in_push=ends_in_push)
        ):
            is_spike[end] = True
    return np.repeat(is_spike, lengths)


def _starts_of_levels(changes: Mask) -> np.ndarray:
    """Return the rows in which levels start, shape (m,).

    `changes`: True for each reading from the second on that differs from the one before, shape (n - 1,).
    """
    return np.flatnonzero(np.concatenate([[True], changes]))


def _may_come_back(level: FloatArray, jumps: np.ndarray, edges: np.ndarray, most_rows: int) -> bool:
    """Return whether a jump is followed by one the other way within `most_rows`: a fast test, which few logs pass.

    `jumps`, `edges`: As in `_candidate_groups`.
    """
    grows = level[jumps + 1] > level[jumps]
    # jumps whose next jump goes the other way, and the number of rows between the two
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

    For each jump in, the nearest jump out that makes such a group, of at most `most_rows` rows. `jumps`: Last level
    before each jump. `edges` (m + 1,): First row of each level, and the number of rows.
    """
    # medians beside each jump; indices beyond an end of the log are reflected there: -1 becomes 1
    sides = np.arange(_SPIKES.side)
    last = level.size - 1
    before = np.median(level[np.abs(jumps[:, None] - sides)], axis=1)
    after = np.median(level[last - np.abs(last - jumps[:, None] - 1 - sides)], axis=1)
    low, high = np.quantile(values, [0.1, 0.9])
    least = _SPIKES.least_of_range * float(high - low)
    levels_after_jumps = (jumps + 1).tolist()
    for jump_in, first in enumerate(levels_after_jumps):
        if first < _SPIKES.fewest:
            continue
        # extremes of the levels of the group that are seen so far: those from `first` to before `seen`
        lowest, highest, least_far, seen = math.inf, -math.inf, math.inf, first
        for jump_out in range(jump_in + 1, len(levels_after_jumps)):
            stop = levels_after_jumps[jump_out]
            if edges[stop] - edges[first] > most_rows or stop > level.size - _SPIKES.fewest:
                break
            lowest = min(lowest, float(level[seen:stop].min()))
            highest = max(highest, float(level[seen:stop].max()))
            least_far = min(least_far, float(far[seen:stop].min()))
            seen = stop
            if lowest <= before[jump_in] <= highest:
                # some level is not outside, which further levels cannot change
                break
            # readings between the two medians may be right: the force was changing from one to the other
            low, high = sorted((before[jump_in], after[jump_out]))
            distance = max(lowest - high, low - highest)
            # a single level that stands out is a spike by its distance; several must be no bump of the force
            is_peak = stop == first + 1 and _is_peak(level, first)
            if distance > least_far and (
                is_peak
                or (
                    distance > least
                    and _is_sharp(level, (first - 1, first), before[jump_in])
                    and _is_sharp(level, (stop, stop - 1), after[jump_out])
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
        # the levels by which choices are compared: those of the chain, and some on both sides
        start = max(chain[0][0] - _SPIKES.block, 0)
        stop = max(stop for _, stop in chain) + _SPIKES.block
        shortest_first = sorted(chain, key=lambda group: edges[group[1]] - edges[group[0]])
        least, best_choice = math.inf, chain
        for order in (shortest_first, chain, chain[::-1]) if len(chain) > 1 else ():
            choice = _without_touching(order)
            is_good = np.ones(level.size, dtype=bool)
            for first, behind in choice:
                is_good[first:behind] = False
            good = level[start:stop][is_good[start:stop]]
            # the whole way of the good readings, less the way that leads from the first to the last of them
            there_and_back = float(np.abs(np.diff(good)).sum()) - abs(float(good[-1] - good[0]))
            if there_and_back < least / 2:
                least, best_choice = there_and_back, choice
        yield from best_choice


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
    """Return the first group, and each further one that touches none of those taken before it."""
    apart: list[tuple[int, int]] = []
    for first, stop in groups:
        if all(stop < start or first > end for start, end in apart):
            apart.append((first, stop))
    return apart


def _is_peak(level: FloatArray, index: int) -> bool:
    """Return whether a level is above both its neighbours or below both; on the side of a bump it is between them."""
    before, peak, behind = level[index - 1 : index + 2]
    return bool((peak - before) * (behind - peak) < 0)


def _is_sharp(level: FloatArray, edge: tuple[int, int], beside: float) -> bool:
    """Return whether a single jump leads from the levels beside a group into the group: else it may be a true bump.

    A bump of the force begins and ends with several steps. `edge`: Index of the level outside the group, next to it,
    and of the level inside, next to that. `beside`: Median of the levels on this side of the group.
    """
    outside, inside = edge
    jump = abs(float(level[inside] - level[outside]))
    return bool(abs(float(level[outside]) - beside) < _SPIKES.most_of_jump * jump)


def _is_end_alone(
    level: FloatArray, far: FloatArray, *, at_start: bool, ends_in_push: bool
) -> bool:
    """Return whether the first or last level is a spike: far from the levels beside it, which are close together.

    A force may rise or fall at once where a log begins or ends, but not to a value far outside all other readings.
    `at_start`: Judge the first level, else the last. `ends_in_push`: As in `find_spikes`.
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
    """Return the usual step near each of m levels, from the m - 1 steps between them.

    It is the lower quartile of the steps of a block, and of three neighbouring blocks the largest. A quartile, since
    steps to and from bad readings are large: a quarter of bad readings makes half of the steps large.
    """
    size = min(_SPIKES.block, step.size)
    count = step.size // size
    # the steps behind the last whole block get the value of that block
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
    # three repeats, which are four equal readings, and then a change: the end of the shortest hold
    ends_hold = repeats[2:-1] & repeats[1:-2] & repeats[:-3]
    if not ends_hold.any():
        return held
    ends_hold &= ~repeats[3:]
    # the size of the change behind each
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
    usual_length = float(np.quantile(lengths, _SPIKES.usual_share))
    # half of what makes a spike, since there is a jump at one end alone
    far = _SPIKES.times_usual_step * _usual_steps(steps) / 2
    for index in long[lengths[long] >= _HELD.times_usual * usual_length]:
        jump = abs(level[index + 1] - level[index])
        jump_before = abs(level[index] - level[max(index - 1, 0)])
        # a reading that was new before it was held was reached by a small step
        if jump > far[index] and jump_before < jump / 2:
            held[starts[index] + 1 : starts[index + 1]] = True
    return held


# --- Steps that stay


class LastingStep(NamedTuple):
    """A jump that stays, between the readings in `row` and the row before; `size`: signed, in their unit."""

    row: int
    size: float


def find_steps(values: FloatArray, rows: int) -> list[LastingStep]:
    """Find the jumps after which readings continue at a distance from the trend before, as when a zero shifts.

    A jump counts if lines through the readings before and after it are about as far apart as it is large, and it is no
    slip (`_is_slip`); in a log with very many jumps none counts.

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
    # the trend is the median change in each block; changes behind the last whole block have its trend
    trend = np.median(change[: count * size].reshape(count, size), axis=1)
    away = np.abs(change - trend[np.minimum(np.arange(change.size) // size, count - 1)])
    far = _STEPS.times_usual_change * _usual_departures(away, size, count)
    # a change over several readings is no step: the changes beside a jump must be small
    padded = np.concatenate([[0.0, 0.0], away, [0.0, 0.0]])
    # the largest of the two departures before and the two behind each change
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
        # both lines are taken in the row behind the jump; the readings before it are reversed, to end there
        gap = _start_of_line(after) - _start_of_line(before[::-1], beyond=1.0)
        stays = _STEPS.staying[0] < gap / change[jump] < _STEPS.staying[1]
        if stays and not _is_slip(change, np.flatnonzero(away > far), jump, rows):
            steps.append(LastingStep(jump + 1, float(gap)))
    return steps


def _is_slip(change: FloatArray, jumps: np.ndarray, jump: int, rows: int) -> bool:
    """Return whether a jump is a slip of the force: one of many jumps in the same direction.

    Between slips the force grows back. A zero that changes, or a loose cable, jumps seldom, or in both directions.
    `change`: Changes from reading to reading. `jumps`, `jump`: Indices in it of all large changes, and of the one in
    question. `rows`: Rows in a second.
    """
    near = jumps[np.abs(jumps - jump) <= _STEPS.seconds_around * rows]
    ratios = change[near] / change[jump]
    same_way = np.count_nonzero(ratios >= _STEPS.comparable) - 1  # without the jump itself
    other_way = np.count_nonzero(ratios <= -_STEPS.comparable)
    return bool(same_way >= _STEPS.fewest_slips and 2 * other_way < same_way)


def may_step(channels: FloatArray) -> np.ndarray:
    """Return the indices of the `channels`, shape (k, n), that may have a step: a fast test, which few channels pass.

    In them one change departs far from the mean of its block of changes. Callers search only these by `find_steps`.
    """
    change = channels[:, 1:] - channels[:, :-1]
    size = min(_SPIKES.block, change.shape[1])
    if size < 2 * _STEPS.fewest_for_trend:
        return np.arange(0)
    count = change.shape[1] // size
    # the last block ends with the last change, and may overlap the one before
    blocks = np.concatenate([change[:, : count * size], change[:, -size:]], axis=1)
    away = blocks.reshape(-1, count + 1, size)
    away -= away.mean(axis=2, keepdims=True)
    np.abs(away, out=away)
    is_far = away.max(axis=2) > _STEPS.times_mean_change * away.mean(axis=2)
    return np.flatnonzero(is_far.any(axis=1))


def _usual_departures(away: FloatArray, size: int, count: int) -> FloatArray:
    """Return the usual departure from the trend near each change, shape as `away`.

    It is the median in a block, and of three neighbouring blocks the largest. `away`: Size of the departure of each
    change. `size`, `count`: Changes in a block, and number of whole blocks.
    """
    usual = np.median(away[: count * size].reshape(count, size), axis=1)
    near = _largest_near(usual)  # by block
    # where most readings repeat the one before, the median is 0, and any change would be a step
    least = float(np.quantile(away, _SPIKES.usual_share) / _STEPS.times_usual_change)
    block_of_change = np.minimum(np.arange(away.size) // size, count - 1)
    return np.maximum(near, least)[block_of_change]


def _start_of_line(values: FloatArray, beyond: float = 0.0) -> float:
    """Return the value of the straight line through some readings at the first one, or `beyond` rows before that."""
    return float(values.mean()) - _slope_by_row(values) * ((values.size - 1) / 2 + beyond)


# --- The end of an amplifier


def find_plateau(values: FloatArray) -> Mask:
    """Mark the readings at the end of an amplifier: the highest level, where growth stops at once and noise is left.

    Such readings are false: the load grew on while the amplifier could not follow. The longest stretch near the highest
    reading counts if readings grew before it, hardly grow in it, and only scatter there.

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
    # few readings near the highest, or no load beyond the noise
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
    # as many as there are at the end, within limits
    count_before = min(max(length, _PLATEAU.fewest), _PLATEAU.most_before)
    before = values[below[-count_before:]]
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
    # readings that sway are a true force: they scatter by more than their white noise, which second differences show
    white_noise = float(np.diff(inside, n=2).std()) / math.sqrt(6)
    if np.ptp(inside) > 0 and float(inside.std()) > _PLATEAU.most_sway * white_noise:
        return nothing
    growth = _slope_by_row(inside)
    # growth by row from a quarter of the load on: a curve that bends to its highest point grows by less before it
    quarter = int(np.argmax(values >= values[first] / 4))
    usual_growth = float(values[first] - values[quarter]) / max(first - quarter, 1)
    lost_growth = growth_before * inside.size
    stops_at_once = (
        abs(growth) < _PLATEAU.most_growth * growth_before
        and growth_before > _PLATEAU.least_growth * usual_growth
    )
    if lost_growth < _PLATEAU.least_lost * noise or not stops_at_once:
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
    """Return first and last row of the longest stretch of readings within the noise of the highest one.

    `noise`: Its standard deviation. Single readings below the others may lie in the stretch.
    """
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

The distance aside is that of a coordinate from the middle of its two neighbours, with 1 + 1/4 + 1/4 of its variance. A
quantile of the distances divided by one of these numbers is an estimate of the noise.
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
    """Mark the positions farthest aside, in a path of shape (k, n) with k axes; equal positions in a row are one level.

    A position is lone if it is farther aside than its neighbours in the path, the noise, and the usual way from level
    to level allow. `_find_repeatedly` calls this again without those found, which put their neighbours aside, too.
    """
    nothing = np.zeros(path.shape[1], dtype=bool)
    moves = (path[:, 1:] != path[:, :-1]).any(axis=0)
    starts = _starts_of_levels(moves)
    if starts.size < _POSITIONS.fewest:
        return nothing
    lengths = np.diff(np.append(starts, path.shape[1]))
    level = path.take(starts, axis=1)  # (k, m), contiguous along the rows, which is fast below
    # from the middle of the two neighbours: by axis (k, m - 2), and the distance of all inner levels (m - 2,)
    aside = level[:, 1:-1] - (level[:, :-2] + level[:, 2:]) / 2
    inner = np.sqrt((aside**2).sum(axis=0))
    least = _POSITIONS.least_part * float(np.ptp(level, axis=1).max())
    if 2 * inner.max() <= least:  # twice, as an end may be that far aside (`_end_aside`)
        return nothing
    distance = np.concatenate([[_end_aside(inner)], inner, [_end_aside(inner[::-1])]])  # (m,)
    aside_by_axis = np.abs(aside)
    quartile = np.partition(aside_by_axis, inner.size // 4, axis=1)[:, inner.size // 4]
    far = max(_POSITIONS.times_noise * float(quartile.max()) / _QUARTILE, least)
    largest_beside = np.maximum(np.append(distance[1:], 0.0), np.append(0.0, distance[:-1]))
    suspects = np.flatnonzero(
        (distance > far) & (distance >= largest_beside) & (lengths <= MOST_LONE_ROWS)
    )
    if not suspects.size:
        return nothing
    # usual way: the second smallest of the two ways before and the two behind, without those of the position itself;
    # way i leads from level i to level i + 1, and indices beyond an end are reflected there
    way = np.sqrt((np.diff(level) ** 2).sum(axis=0))
    last = way.size - 1
    beside = np.abs(suspects[:, None] + np.array([-3, -2, 1, 2]))
    usual_way = np.sort(way[last - np.abs(last - beside)], axis=1)[:, 1]
    # a position between its neighbours may be right, at any speed of the arm
    before = level[:, np.abs(suspects - 1)]
    after = level[:, last + 1 - np.abs(last - suspects)]
    above = level[:, suspects] - np.maximum(before, after)
    below = np.minimum(before, after) - level[:, suspects]
    outside = np.maximum(above, below).max(axis=0)
    far_aside = (distance[suspects] > _POSITIONS.times_usual_way * usual_way) & (
        outside > _POSITIONS.least_outside * distance[suspects]
    )
    suspects = suspects[far_aside]
    if not suspects.size:
        return nothing
    # noise again, without the positions beside lone ones; 80 %, since half are 0 aside in an interpolated log
    # `is_good` has one entry more at each end than there are levels, for neighbours of the first and last one
    is_good = np.ones(starts.size + 2, dtype=bool)
    is_good[np.concatenate([suspects, suspects + 1, suspects + 2])] = False
    good_aside = aside_by_axis[:, is_good[2:-2]]
    if good_aside.shape[1]:
        upper_fifth = float(np.quantile(good_aside, 0.8, axis=1).max())
        far = _POSITIONS.times_noise * upper_fifth / _UPPER_FIFTH
    is_lone = np.zeros(starts.size, dtype=bool)
    is_lone[suspects[distance[suspects] > far]] = True
    return np.repeat(is_lone, lengths)


def _end_aside(inner: FloatArray) -> float:
    """Return how far the first position is off the line through the next two; 0 if the second one is the lone one.

    `inner`: Distances aside of the second position and of those behind it. The first has no middle of two neighbours:
    it puts the second aside by half its own distance, and the third not at all.
    """
    second, third = inner[:2]
    return 2 * float(second) if third < _POSITIONS.most_of_neighbour * second else 0.0
