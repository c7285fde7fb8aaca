"""Times that are written as text or kept as dates: dates of ISO 8601 and clock times, as seconds."""

from __future__ import annotations

import datetime as dt
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import ns_to_s

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

NO_ZONE = "time is text without a time zone, taken as UTC"
CLOCK_TIME = "time is a clock time, in s from midnight; a day is added where it passes midnight"
MINUTES = "time is minutes and seconds, in s; an hour is added where it passes the full hour"
PERIOD_S = {CLOCK_TIME: 86400.0, MINUTES: 3600.0}
"""After how long a clock without a date begins anew, by its note."""

_DATE = re.compile(
    r"\d{4}([-/.])\d\d\1\d\d[T ]\d\d:[0-5]\d(:[0-5]\d([.,]\d{1,9})?)? ?(?P<zone>Z|[+-]\d\d(:?\d\d)?)?"
)
_CLOCK = re.compile(r"(\d\d?:[0-5]\d:[0-5]\d([.,]\d{1,9})?|[0-5]?\d:[0-5]\d[.,]\d{1,9})")
_EPOCH = dt.datetime(1970, 1, 1, tzinfo=dt.UTC)


def is_stamp(text: str) -> bool:
    """Tell a date with a time of day, or a clock time such as 12:00:00.01 or 00:12.3, from other text."""
    return bool(_DATE.fullmatch(text) or _CLOCK.fullmatch(text))


def note_of(text: str) -> str:
    """Say what a column of such times is counted from; empty where the file leaves no doubt."""
    if _CLOCK.fullmatch(text):
        return CLOCK_TIME if text.count(":") == 2 else MINUTES
    found = _DATE.fullmatch(text)
    return NO_ZONE if found and not found["zone"] else ""


def seconds_of(text: str) -> float:
    """Seconds since 1970, or since midnight where there is no date; NaN where it is no time at all."""
    if not is_stamp(text):
        return np.nan
    text = text.replace(",", ".")
    if _CLOCK.fullmatch(text):
        parts = [float(part) for part in text.split(":")]
        hours, minutes, seconds = parts if len(parts) == 3 else (0.0, *parts)
        return hours * 3600 + minutes * 60 + seconds
    date = text[:10].replace("/", "-").replace(".", "-")
    try:
        # Python keeps microseconds; what is below is added
        whole, point, rest = text[10:].partition(".")
        digits = re.match(r"\d*", rest)[0] if point else ""  # type: ignore[index]
        moment = dt.datetime.fromisoformat(date + whole + rest[len(digits) :].replace(" ", ""))
    except ValueError:
        return np.nan
    return of_moment(moment) + (float(f"0.{digits}") if digits else 0.0)


def of_moment(value: Any) -> float:
    """Seconds of a date, a time of day or a length of time, as spreadsheets keep them; else NaN."""
    if isinstance(value, dt.datetime):
        return ((value if value.tzinfo else value.replace(tzinfo=dt.UTC)) - _EPOCH).total_seconds()
    if isinstance(value, dt.time):
        return value.hour * 3600 + value.minute * 60 + value.second + value.microsecond / 1e6
    if isinstance(value, dt.timedelta):
        return value.total_seconds()
    return np.nan


def seconds_of_column(cells: Any) -> FloatArray | None:
    """Seconds of a column of an Arrow table of text; None where a cell has to be looked at by hand."""
    import pyarrow as pa
    import pyarrow.compute as pc

    try:
        first = cells[0].as_py().strip(" \t")
        cells = pc.utf8_trim(cells, " \t")
        if _CLOCK.fullmatch(first):
            hours = "" if first.count(":") == 2 else "00:"
            cells = pc.binary_join_element_wise(f"1970-01-01T{hours}", cells, "")
        elif first[4:5] in ("/", "."):
            cells = pc.replace_substring(cells, first[4], "-", max_replacements=2)
        cells = pc.replace_substring(cells, ",", ".")
        zoned = bool((found := _DATE.fullmatch(first)) and found["zone"])
        stamps = cells.cast(pa.timestamp("ns", "UTC" if zoned else None))
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError, UnicodeDecodeError):
        return None
    return ns_to_s(stamps.cast(pa.int64()).to_numpy())


class RestartingClock:
    """Times of a clock without a date that begins anew after `period`, s, made continuous by blocks."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._last = 0.0
        self._passed = 0.0

    def follow(self, times: FloatArray) -> FloatArray:
        """Return the next times; a step back by more than half a period is a new beginning."""
        if times.size == 0:
            return times
        steps = np.diff(times, prepend=self._last)
        passed = self._passed + self._period * np.cumsum(steps < -self._period / 2)
        self._last, self._passed = float(times[-1]), float(passed[-1])
        result: FloatArray = times + passed
        return result
