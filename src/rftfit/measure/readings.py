"""Leave out rows of a log: no data, time backwards, readings that stand alone, stay away or repeat the one before.

Each function returns the `Log` without the bad rows and counts them in it under a reason (`Log.take`), so that no row
is lost silently; where it says so, it also notes the times of such rows (``Log.stretches``: reason to start and end of
each stretch, in the unit of the log). `clean` makes the time increase first, then `without_spikes` looks at
forces, `without_lone_positions` and `without_holds` at positions. Masks are bool with an element for each row.

The columns of a log are arrays of shape (n,): time, F1, F2, F3 or time, x, z, angle, in the units that the log names.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rftfit.campaign.spikes import (
    MOST_LONE_ROWS,
    MOST_SHARE,
    find_held,
    find_lone_positions,
    find_spikes,
)
from rftfit.conventions import BoolArray, FloatArray, IndexArray
from rftfit.logs.base import Log, LogError
from rftfit.measure.clocks import HOUR_S
from rftfit.measure.flags import (
    AWAY,
    BACKWARDS,
    DUPLICATE,
    HELD,
    HELD_READING,
    LONE,
    NO_DATA,
    ON_ARRIVAL,
    SET_BACK,
)
from rftfit.measure.levels import find_equal_stretches, find_stretches
from rftfit.store.chosen import chosen
from rftfit.table.units import TIME_TO_S

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `readings`, says what each decides
_CHOSEN = chosen("measure", "readings")

AWAY_S = 1.0
"""Longest time for which readings away from the others count as wrong, s; readings that stay longer may be right."""


def rows_within(time: FloatArray, seconds: float) -> int:
    """Mean number of rows in some `seconds`, at least `MOST_LONE_ROWS`; `time`: increasing, in the unit of `seconds`."""
    if time.size < 2 or time[-1] == time[0]:
        return MOST_LONE_ROWS
    return max(MOST_LONE_ROWS, round(seconds * (time.size - 1) / float(time[-1] - time[0])))


def without_spikes(log: Log, limits: Mapping[str, float]) -> Log:
    """Leave out the rows in which a force stands alone, is away for up to a second or is held, and count them.

    Such readings come from a loose contact or a lost packet, and are no force. Raises `LogError` if more than
    `MOST_SHARE` of the readings of a quantity stand alone.

    `log`: In the order of time.
    `limits`: Columns that are searched, F1 to F3, each with the size at which its range ends: readings that stay there
    are kept, as they are saturated.
    """
    time = log.columns["time"]
    most_rows = rows_within(time, AWAY_S / TIME_TO_S.get(log.units.get("time", ""), 1.0))
    alone = np.zeros(log.size, dtype=bool)
    held = np.zeros(log.size, dtype=bool)
    for quantity, limit in limits.items():
        readings = log.columns[quantity]
        spikes = find_spikes(readings, most_rows)
        if spikes.any():
            spikes = _keep_saturated(spikes, readings, limit)
            _check_share(log, quantity, spikes)
            alone |= spikes
        held |= find_held(readings)
    if not (alone.any() or held.any()):
        return log
    # a long stretch is away, the rest stands alone; each row counts under one reason
    is_away = np.zeros(log.size, dtype=bool)
    for start, stop in find_stretches(alone).T:
        is_away[start:stop] = stop - start > MOST_LONE_ROWS
    log = _leave_out(log, is_away, AWAY)
    log = log.take(~alone[~is_away], LONE)
    return _leave_out(log, held[~alone], HELD_READING)


def _keep_saturated(spikes: BoolArray, readings: FloatArray, limit: float) -> BoolArray:
    """Unmark the stretches of spikes that stay at the end of the range, `limit`: these readings are saturated.

    Saturated readings are kept, as they say that the force was larger. Changes and returns the mask `spikes`.
    """
    is_saturated = np.abs(readings) >= limit
    for start, stop in find_stretches(spikes).T:
        if stop - start > MOST_LONE_ROWS and is_saturated[start:stop].all():
            spikes[start:stop] = False
    return spikes


def _leave_out(log: Log, is_bad: BoolArray, reason: str) -> Log:
    """Leave out bad rows, count them, and note the times of their stretches under `reason`."""
    time = log.columns["time"]
    when = tuple(
        (float(time[start]), float(time[stop - 1])) for start, stop in find_stretches(is_bad).T
    )
    log = log.take(~is_bad, reason)
    return replace(log, stretches={**log.stretches, reason: when}) if when else log


def without_lone_positions(log: Log) -> Log:
    """Leave out the rows of a motion log whose position or angle stands alone, and count them.

    Raises `LogError` if that is more than `MOST_SHARE` of the rows.
    """
    alone = np.zeros(log.size, dtype=bool)
    for quantities in (("x", "z"), ("angle",)):
        lone = find_lone_positions(*(log.columns[quantity] for quantity in quantities))
        if lone.any():
            _check_share(log, " and ".join(quantities), lone)
            alone |= lone
    return log.take(~alone, LONE)


def _check_share(log: Log, quantity: str, alone: BoolArray) -> None:
    """Refuse a log in which so many readings stand alone that the good ones are not known (more than `MOST_SHARE`).

    `quantity`: Name of the column, for the message. `alone`: True for readings that stand alone.
    """
    if np.count_nonzero(alone) > MOST_SHARE * alone.size:
        text = (
            f"{log.path}: {alone.sum()} of {alone.size} readings of {quantity} stand alone, far from "
            f"those before and after them; allowed: {MOST_SHARE:.0%} of them. Look at the cable and the "
            "logger, or name the values that mean no data under `missing`"
        )
        raise LogError("spikes", text, log.rows)


def without_missing(log: Log, missing: Sequence[float]) -> Log:
    """Leave out the rows in which a column holds one of the `missing` values, which mean no data, and count them."""
    if not missing:
        return log
    absent = np.zeros(log.size, dtype=bool)
    for values in log.columns.values():
        absent |= np.isin(values, missing)
    return log.take(~absent, NO_DATA)


# --- Held positions: written again and again until a slower program reads the arm anew.


class Holds(NamedTuple):
    """Held positions: rows that repeat a position while the arm moves.

    `rows`: Usual number of equal positions in sequence; 1 where each position is new.
    `step`: Usual change from one position to the next different one, in the unit of the position; 0 where each is new.
    `is_regular`: True if all positions are whole steps apart, which a coarse sensor could cause too.
    """

    rows: int
    step: float
    is_regular: bool


def find_holds(position: FloatArray) -> Holds:
    """Find how positions of one axis are held, by the stretches of equal positions.

    A program that asks the arm seldom writes the same position several times: its time is then that of the asking, not
    of the position. `position`: In the order of time, shape (n,), in any unit.
    """
    no_holds = Holds(1, 0.0, is_regular=True)
    repeats = np.count_nonzero(position[1:] == position[:-1])
    if 3 * repeats < position.size:
        # most positions occur once, wherever the repeats are
        return no_holds
    starts, lengths = find_equal_stretches(position)
    level = position[starts]
    if level.size < _CHOSEN.fewest_levels or 2 * np.count_nonzero(lengths > 1) < lengths.size:
        return no_holds
    # the first and the last hold may be cut by the ends of the log; an arm at rest stays much longer
    whole = lengths[1:-1]
    usual = float(np.median(whole[whole <= _CHOSEN.at_rest * np.median(whole)]))
    step = float(np.median(np.abs(np.diff(level))))
    in_steps = (level - level[level.size // 2]) / step
    departure = np.abs(in_steps - np.round(in_steps))
    is_regular = bool(np.mean(departure > _CHOSEN.regular) < _CHOSEN.regular)
    return Holds(round(usual), step, is_regular)


def without_holds(log: Log) -> Log:
    """Leave out the rows that repeat the position of an arm that moves, and count them.

    If positions are whole steps apart, nothing is left out: a coarse sensor makes them too, and then each row counts.
    """
    position = moving_axis(log)
    holds = find_holds(position)
    if holds.rows < 2 or holds.is_regular:
        return log
    starts, lengths = find_equal_stretches(position)
    # of each row: its number within its stretch, and the length of that stretch
    number = np.arange(position.size) - np.repeat(starts, lengths)
    length = np.repeat(lengths, lengths)
    # a rest is a long stretch, in which the first row of each hold counts; the arm starts during its last hold
    at_rest = (length > _CHOSEN.usual * holds.rows) & (number <= length - holds.rows)
    return log.take((number == 0) | (at_rest & (number % holds.rows == 0)), HELD)


def moving_axis(log: Log) -> FloatArray:
    """Position along the axis, x or z, with the larger range; the angle if neither moves (a leg on a fixed axle)."""
    x, z, angle = (log.columns[name] for name in ("x", "z", "angle"))
    ranges = [np.ptp(x), np.ptp(z)]
    if not max(ranges) > 0:
        return angle
    return x if ranges[0] > ranges[1] else z


# --- Time that grows from row to row


def clean(log: Log) -> Log:
    """Leave out duplicated rows and rows whose time does not increase, and count them: afterwards time increases.

    Before that, stamps of arrival are spread evenly and an hour set back is undone, which are no faults of the rows.
    Raises `LogError` for a log without rows, or whose time does not increase in half of them or from a second recording
    on.
    """
    time = log.columns["time"]
    if time.size == 0:
        why = ", ".join(log.dropped)
        text = f"{log.path}: no usable row among {log.rows}{why and f': {why}'}"
        raise LogError("no_good_row", text, log.rows)
    log = _with_even_stamps(log)
    time = log.columns["time"]
    if (time[1:] > time[:-1]).all():
        return log
    # rows that were written twice: all columns equal those of the row before
    values = np.stack(list(log.columns.values()))
    repeated = np.zeros(time.size, dtype=bool)
    repeated[1:] = (values[:, 1:] == values[:, :-1]).all(axis=0)
    log = log.take(~repeated, DUPLICATE)
    log = _without_hour_set_back(log)
    time = log.columns["time"]
    if (time[1:] > time[:-1]).all():
        return log
    # a row counts if its time is later than all times before it
    latest = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    forward = time > latest
    if np.count_nonzero(forward) * 2 <= forward.size or _has_second_recording(forward):
        text = f"{log.path}: time does not increase in {np.count_nonzero(~forward)} of {time.size} rows"
        raise LogError("time", f"{text}; {_why_time_stands(time)}", log.rows)
    return log.take(forward, BACKWARDS)


def _with_even_stamps(log: Log) -> Log:
    """Spread the times of rows evenly over each packet, if packets of rows were stamped on arrival, and note it.

    A computer that gets readings in packets over a cable stamps all rows of a packet with about the same time.

    A logger that takes several readings at once and then waits has similar stamps, which are kept: its readings change
    from packet to packet, but not within one.
    """
    time = log.columns["time"]
    steps = time[1:] - time[:-1]
    if not steps.size:
        return log
    usual_step = (time[-1] - time[0]) / steps.size
    # packets need many short steps and some long ones; this quick test sorts out most logs
    if steps.max() < 1.5 * usual_step or not 0 <= 2 * np.median(steps) < usual_step:
        return log
    # a long step ends a packet; most packets must have the same number of rows
    ends = np.flatnonzero(steps > usual_step)
    lengths = np.diff(ends)
    rows = int(np.median(lengths)) if ends.size > _CHOSEN.fewest_packets else 0
    if rows < 2 or np.mean(lengths == rows) < _CHOSEN.same_length:
        return log
    starts = np.concatenate([[0], ends + 1])
    arrivals = time[starts]
    interval = np.diff(arrivals)
    usual_interval = float(np.median(interval))
    packet_duration = time[ends] - time[starts[:-1]]
    readings = [values for name, values in log.columns.items() if name != "time"]
    if np.median(packet_duration) * 2 > usual_interval or not _changes_evenly(readings, starts):
        return log
    # the stamp is the time of the last row of a packet; the rows before lie evenly back to the packet before
    lengths = np.diff(starts, append=time.size)
    step = np.minimum(np.append(usual_interval, interval) / lengths, usual_interval / rows)
    rows_to_last = np.repeat(starts + lengths - 1, lengths) - np.arange(time.size)
    even = np.repeat(arrivals, lengths) - rows_to_last * np.repeat(step, lengths)
    when = ((float(even[0]), float(even[-1])),)
    columns = {**log.columns, "time": even}
    return replace(log, columns=columns, stretches={**log.stretches, ON_ARRIVAL: when})


def _changes_evenly(readings: Sequence[FloatArray], starts: IndexArray) -> bool:
    """Return True if readings change as fast within packets as from packet to packet.

    Then the change within a packet of n rows is 1 - 1 / n times that from packet to packet, and not 0. The column in
    which this slope has the smallest error decides.

    `readings`: Columns of shape (rows,). `starts`: First row of each packet.
    """
    best_error, is_even = math.inf, False
    # of each column: the changes within packets over those between them, by least squares through zero
    for values in readings:
        lengths = np.diff(starts, append=values.size)
        means = np.add.reduceat(values, starts) / lengths
        between = (means[2:] - means[:-2]) / 2
        within = (values[starts + lengths - 1] - values[starts])[1:-1]
        size = float(between @ between)
        if not size > 0:
            continue
        slope = float(within @ between) / size
        error = float(np.std(within - slope * between)) / math.sqrt(size)
        if error < best_error:
            even_slope = 1 - 1 / float(np.median(lengths))
            best_error = error
            is_even = abs(slope - even_slope) < even_slope / 2 - _CHOSEN.times_error * error
    return is_even


def _without_hour_set_back(log: Log) -> Log:
    """Undo one step back of the time by whole hours, as at the end of daylight saving time, and note it.

    The log is unchanged if time runs back more than once, or not by whole hours.
    """
    time = log.columns["time"]
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0)
    hour = HOUR_S / TIME_TO_S.get(log.units.get("time", ""), 1.0)
    if back.size != 1:
        return log
    row = int(back[0])
    hours = round(-float(steps[row]) / hour)
    usual_step = float(np.median(steps))
    # without the whole hours the step must be a usual one
    if not hours or abs(steps[row] + hours * hour - usual_step) > USUAL_STEPS * usual_step:
        return log
    corrected_time = time.copy()
    corrected_time[row + 1 :] += hours * hour
    when = ((float(time[row]), float(corrected_time[row + 1])),)
    columns = {**log.columns, "time": corrected_time}
    return replace(log, columns=columns, stretches={**log.stretches, SET_BACK: when})


def _why_time_stands(time: FloatArray) -> str:
    """Describe the probable cause of a time that does not increase, and the cure, as the end of a message."""
    steps = np.diff(time)
    n_backward = np.count_nonzero(steps < 0)
    if n_backward * 10 > np.count_nonzero(steps == 0):
        wraps = (
            "are several recordings in one file (force_where and motion_where in the run sheet, or `where` in the config, name "
            "the rows of one), or does a counter begin anew (micros() of Arduino)?"
        )
        return f"it runs backwards {n_backward} times: {wraps}"
    distinct = np.unique(time).size
    if distinct < 2:
        symptom = f"all rows have the time {time[0]:.10g}, as of a clock written with few digits"
    else:
        symptom = f"{time.size} rows share {distinct} times: the stamps are coarser than the rows"
    return (
        f"{symptom}; write them with more digits, or leave out the time and state the rate of the rows: "
        "rate_Hz, under text or options"
    )


_LONGEST_BACK = 0.1
"""Largest share of the rows that may lie behind an earlier time without being another recording."""


def _has_second_recording(forward: BoolArray) -> bool:
    """Return True if time goes back and runs on from there for many rows: another recording follows in the file.

    `forward`: True for rows later than all before them.
    """
    first, stop = find_stretches(~forward)
    lengths = stop - first
    return bool(lengths.max(initial=0) > max(_LONGEST_BACK * forward.size, 20))


USUAL_STEPS = 1.5
"""Number of usual steps above which a step of time is a gap, in which a reading was lost."""


def gaps(time: FloatArray, longest_s: float) -> FloatArray:
    """Return start and end of every gap in an increasing time, s, shape (k, 2).

    A gap is a step longer than `longest_s` and clearly longer than the usual step of this log: rounded times of a log
    of ten readings a second make no gaps.
    """
    steps = time[1:] - time[:-1]
    late = np.flatnonzero(steps > longest_s)
    if not late.size:
        return np.empty((0, 2))
    late = late[steps[late] > USUAL_STEPS * float(np.median(steps))]
    return np.stack([time[late], time[late + 1]], axis=1)
