"""Reads times that are written as text (stamps), with a date or without one, as seconds; clocks that start again.

A stamp is read alone by `seconds_of`, or a whole Arrow column of stamps by `seconds_of_column`, which is many times
faster and must give the same. `order` is the order of year, month and day in a date of three numbers: ``ymd``, ``dmy``
or ``mdy``; empty: not known. Of a stamp without a date the seconds count from midnight, of minutes and seconds alone
from the full hour, of all others from 1970 in UTC.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.table.units import TIME_TO_S

# notes on how a column of times is read, which `rftfit inspect` and the ledger show
NO_ZONE = "time has no time zone, taken as UTC"
CLOCK_TIME = "time is a clock time, in s from midnight; a day is added where it passes midnight"
MINUTES = "time is minutes and seconds, in s; an hour is added where it passes the full hour"
DAY_S = TIME_TO_S["d"]
PERIOD_S = {CLOCK_TIME: DAY_S, MINUTES: TIME_TO_S["h"]}
"""Note on a clock without a date, to the time after which this clock starts again at 0, s."""

ORDERS = {"year first": "ymd", "day first": "dmy", "month first": "mdy"}
"""Order of day, month and year as the config names it, to its name in this module."""
_WORDS_OF_ORDER = {order: word for word, order in ORDERS.items()}

_AM_PM = r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
"""AM or PM behind a time: `half` is A or P, the half of the day."""
_DATE = re.compile(
    r"(?P<d0>\d{4}|\d\d?)[-/.](?P<d1>\d\d?)[-/.](?P<d2>\d{4}|\d\d?)[T ] *(?P<hour>\d\d?):(?P<minute>[0-5]\d)"
    r"(?::(?P<second>[0-5]\d)(?:[.,](?P<fraction>\d{1,9}))?)?"
    + _AM_PM
    + r" ?(?P<zone>Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)?"
)
"""A date of three numbers, d0 to d2 in any order, with a time of day."""
_MONTH_NAMES = "jan/ene feb mar/mär/mrz apr/abr may/mai jun jul aug/ago sep oct/okt nov dec/dez/dic"
_MONTHS = {
    name: number
    for number, names in enumerate(_MONTH_NAMES.split(), start=1)
    for name in names.split("/")
}
"""First three letters of a month in English, German or Spanish, to its number."""
# dates with the name of the month: 3. Feb 2026, Feb 3, 2026 and 2026-Feb-03
_MONTH = r"(?P<month>[A-Za-zä]{3,10})\.?"
_DAY_FIRST = re.compile(rf"(?P<day>\d\d?)\.?[-/. ]{_MONTH}[-/. ,]+(?P<year>\d{{4}}|\d\d)(?=[T ])")
_MONTH_FIRST = re.compile(rf"{_MONTH}[- ](?P<day>\d\d?)(?:, ?|[- ])(?P<year>\d{{4}})(?=[T ])")
_YEAR_FIRST = re.compile(rf"(?P<year>\d{{4}})[-/. ]{_MONTH}[-/. ](?P<day>\d\d?)(?=[T ])")
_NAMED_MONTHS = (_DAY_FIRST, _MONTH_FIRST, _YEAR_FIRST)
_CLOCK = re.compile(
    r"(\d\d?:[0-5]\d:[0-5]\d(?:[.,:]\d{1,9})?|[0-5]?\d:[0-5]\d[.,]\d{1,9})" + _AM_PM
)
"""A clock time, hours:minutes:seconds, or minutes and seconds with a fraction."""
_COLON_BEFORE_FRACTION = re.compile(r"(\d\d?:[0-5]\d:[0-5]\d):(\d{1,9})")
"""A clock time with a colon before the fraction of a second."""
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:[^AaPp]*")
"""A time that Arrow reads as it stands."""


def is_stamp(text: str) -> bool:
    """Return whether a text is a date with a time of day, or a clock time such as 12:00:00.01 or 00:12.3."""
    if ":" not in text:
        return False
    return bool(_CLOCK.fullmatch(text) or _DATE.fullmatch(_with_month_number(text)))


def _named_month(text: str) -> re.Match[str] | None:
    """Match a date with the name of the month at the beginning of a text; None where there is none.

    The match has the groups `day`, `month` and `year`, and ends before the time of day.
    """
    for pattern in _NAMED_MONTHS:
        date = pattern.match(text)
        if date and date["month"][:3].casefold() in _MONTHS:
            return date
    return None


def _with_month_number(text: str) -> str:
    """Return a text with 2026-02-03 in place of 03-Feb-2026 at its beginning; other texts come back unchanged."""
    date = _named_month(text)
    if date is None:
        return text
    year = date["year"] if len(date["year"]) == 4 else f"20{date['year']}"
    month = _MONTHS[date["month"][:3].casefold()]
    return f"{year}-{month:02}-{int(date['day']):02}{text[date.end() :]}"


def date_order(texts: Iterable[str]) -> str:
    """Return the order of day, month and year (``dmy``) of the dates in a column; empty: several orders fit.

    A date with points has the day first, a date with AM or PM the month first; a number above 12 is a day. Texts that
    are no dates do not count; without any date the order is ``ymd``.
    """
    dates = [date for date in map(_DATE.fullmatch, map(_with_month_number, texts)) if date]
    if all(len(date["d0"]) == 4 for date in dates):
        return "ymd"
    if any(len(date["d2"]) != 4 for date in dates):
        return ""
    if any(int(date["d0"]) > 12 or "." in date[0][:3] for date in dates):
        return "dmy"
    return "mdy" if any(int(date["d1"]) > 12 or date["half"] for date in dates) else ""


def is_clock_time(text: str) -> bool:
    """Return whether a text is a time of day without a date, such as 12:00:00.01, and not minutes and seconds."""
    return bool(_CLOCK.fullmatch(text)) and text.count(":") >= 2


def note_of(text: str, order: str) -> str:
    """Return the note on how a column of times is read, by its first time; empty where the file leaves no doubt.

    `text`: This time. `order`: As the config or the column states it, not empty for a date.
    """
    if _CLOCK.fullmatch(text):
        return CLOCK_TIME if is_clock_time(text) else MINUTES
    date = _DATE.fullmatch(_with_month_number(text))
    note = NO_ZONE if date and not date["zone"] else ""
    return note if order == "ymd" else f"{note}; dates: {_WORDS_OF_ORDER[order]}".removeprefix("; ")


def seconds_of(text: str, order: str) -> float:
    """Return a time in s, see the module for its zero; NaN where the text is no time.

    `order`: Order of day, month and year (``dmy``); empty: the text must show the order, else NaN.
    """
    if clock := _CLOCK.fullmatch(text):
        # read as a time of the first day of 1970, so that its seconds count from midnight
        text = _COLON_BEFORE_FRACTION.sub(r"\1.\2", clock[0])
        hours = "" if text.count(":") == 2 else "00:"
        text, order = f"1970-01-01 {hours}{text}", "ymd"
    if _named_month(text):
        text, order = _with_month_number(text), "ymd"
    date = _DATE.fullmatch(text)
    order = order or date_order([text])
    # group d0, d1 or d2 is the year, by its place in the order; it has four digits, or two
    if not date or not order or len(date[f"d{order.index('y')}"]) == 1:
        return np.nan
    year, month, day = (int(date[f"d{order.index(letter)}"]) for letter in "ymd")
    hour, half, zone = int(date["hour"]), date["half"], date["zone"] or "Z"
    if half:
        # 12 AM is 0 h and 12 PM is 12 h; hour 24 makes the date invalid below
        hour = hour % 12 + 12 * (half in "Pp") if 1 <= hour <= 12 else 24
    try:
        moment = dt.datetime(
            year + 2000 * (year < 100),
            month,
            day,
            hour,
            int(date["minute"]),
            int(date["second"] or 0),
            tzinfo=dt.UTC,
        )
    except ValueError:
        return np.nan
    ahead_of_utc_s = 0
    if zone[0] in "+-":
        hhmm = zone[1:].replace(":", "").ljust(4, "0")
        ahead_of_utc_s = int(f"{zone[0]}1") * (int(hhmm[:2]) * 3600 + int(hhmm[2:]) * 60)
    return moment.timestamp() - ahead_of_utc_s + float(f"0.{date['fraction'] or 0}")


def seconds_of_column(cells: Any, order: str) -> FloatArray | None:
    """Return the times of an Arrow column of text, s as of `seconds_of`, shape (n,); NaN where a cell is null.

    The first cell shows the form of all: all cells are rewritten to ISO 8601 by the same patterns, and Arrow reads them.
    None where Arrow cannot read each cell as `seconds_of` would: the caller then reads cell by cell.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    times = np.full(len(cells), np.nan)
    if cells.null_count == len(cells):
        return times
    if cells.null_count:
        # the times of the other cells, put back in their places
        times_stated = seconds_of_column(cells.drop_null(), order)
        if times_stated is None:
            return None
        times[np.asarray(cells.is_valid())] = times_stated
        return times
    try:
        cells = pc.utf8_trim(cells, " \t")
        first = cells[0].as_py()
        # each step rewrites all cells if the first has the form, and `first` follows
        if _CLOCK.fullmatch(first):
            if _COLON_BEFORE_FRACTION.fullmatch(first):
                cells = pc.replace_substring_regex(
                    cells, f"^{_COLON_BEFORE_FRACTION.pattern}$", r"\1.\2"
                )
                first = cells[0].as_py()
            # a time of the first day of 1970
            hours = "" if first.count(":") == 2 else "00:"
            cells = pc.binary_join_element_wise(f"1970-01-01T{hours}", cells, "")
            first, order = cells[0].as_py(), "ymd"
        if _named_month(first):
            cells = _with_month_numbers(cells)
            first, order = cells[0].as_py(), "ymd"
        if first.endswith(("UTC", "GMT", " Z")):
            cells = pc.replace_substring_regex(cells, r" ?(UTC|GMT|Z)$", "Z")
            first = cells[0].as_py()
        order = order or date_order([first])
        half_days: Any = 0
        if not _ISO.fullmatch(first):
            cells, half_days = _as_iso(cells, order)
        cells = pc.replace_substring(cells, ",", ".")
        # Arrow refuses a column in which some cells have a zone and some have none
        zoned = bool((date := _DATE.fullmatch(first)) and date["zone"])
        stamps = cells.cast(pa.timestamp("ns", "UTC" if zoned else None))
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError, UnicodeDecodeError, ValueError):
        return None  # a cell is no date: the caller finds out which
    seconds: FloatArray = ns_to_s(stamps.cast(pa.int64()).to_numpy()) + 43200.0 * half_days
    return seconds


def _with_month_numbers(cells: Any) -> Any:
    """Return an Arrow column with 2026-02-03 in place of dates such as 03-Feb-2026, as `_with_month_number` does.

    Month by month, as a pattern of Arrow cannot turn a name into a number. Raises ValueError for a month without a number.
    """
    import pyarrow.compute as pc

    first = cells[0].as_py()
    for pattern in filter(lambda pattern: pattern.match(first), _NAMED_MONTHS):
        # Arrow knows neither a look-ahead nor, where it replaces, groups with names: day, month and year are groups 1
        # to 3 in the order of the pattern, and group 4 is the T or blank behind the date
        by_number = re.sub(r"\?P<\w+>", "", pattern.pattern).replace("(?=[T ])", "([T ])")
        day, year = pattern.groupindex["day"], pattern.groupindex["year"]
        dates = pc.extract_regex(cells, pattern=f"^{pattern.pattern.replace('(?=[T ])', '')}")
        for word in filter(None, pc.unique(pc.struct_field(dates, "month")).to_pylist()):
            month = _MONTHS.get(word[:3].casefold())
            if month is None:
                raise ValueError(word)
            with_this_month = by_number.replace("([A-Za-zä]{3,10})", f"({word})")
            cells = pc.replace_substring_regex(
                cells, f"^{with_this_month}", rf"\{year}-{month:02}-\{day}\4"
            )
    return cells


def _as_iso(cells: Any, order: str) -> tuple[Any, np.ndarray]:
    """Return an Arrow column with dates by ISO 8601, and how many half days to add to each time: -1, 0 or 1, shape (n,).

    Half days come of AM and PM, which Arrow does not read and which are removed. `order`: Order of day, month and year
    in `cells`. Raises ValueError for an hour that AM and PM cannot have.
    """
    import pyarrow.compute as pc

    def matches(pattern: str) -> np.ndarray:
        """Return 1 for each cell in which a pattern is found, else 0."""
        return np.asarray(pc.match_substring_regex(cells, pattern)).astype(int)

    # number of the group, from 1, in which the pattern below finds each of them
    year, month, day = (order.index(letter) + 1 for letter in "ymd")
    iso = rf"\{year}-\{month}-\{day}T"
    cells = pc.replace_substring_regex(cells, r"^(\d+)[-/.](\d+)[-/.](\d+)[T ] *", iso)
    # a 0 before a single digit; twice, as two neighbouring numbers of one digit share the character between them
    for _ in range(2):
        cells = pc.replace_substring_regex(cells, r"([-T:])(\d)([-T:])", r"\10\2\3")
    # a year of two digits
    cells = pc.replace_substring_regex(cells, r"^(\d\d)-", r"20\1-")
    is_pm, has_half = matches(r"[Pp]\.?[Mm]\.?$"), matches(r"[AaPp]\.?[Mm]\.?$")
    if (has_half > matches(r"T(0[1-9]|1[0-2]):")).any():
        raise ValueError  # an hour beyond 1 to 12
    cells_without_half = pc.replace_substring_regex(cells, r" ?[AaPp]\.?[Mm]\.?$", "")
    # 12 AM is 0 h and 12 PM is 12 h
    return cells_without_half, is_pm - has_half * matches("T12:")


class RestartingClock:
    """Makes times of a clock without a date continuous, block by block; the clock starts again after `period`, s.

    Without this, a log that passes midnight would go back by a day. `period`: Of `PERIOD_S`.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        # of the blocks before: last time as it was written, and time that was added to it
        self._last = 0.0
        self._added = 0.0

    def follow(self, times: FloatArray) -> FloatArray:
        """Return the next times, s, shape (n,), made continuous: a step back by half a period is a new start.

        `times`: Those of the next block; NaN stays NaN. The object keeps the last of them for the block after it.
        """
        is_finite = np.isfinite(times)
        if not is_finite.all():
            with_gaps = times.copy()
            with_gaps[is_finite] = self.follow(times[is_finite])
            return with_gaps
        if times.size == 0:
            return times
        steps = np.diff(times, prepend=self._last)
        added = self._added + self._period * np.cumsum(steps < -self._period / 2)
        self._last, self._added = float(times[-1]), float(added[-1])
        continuous_times: FloatArray = times + added
        return continuous_times


def ns_to_s(stamps: np.ndarray) -> FloatArray:
    """Convert nanoseconds since 1970 (whole numbers) to s; float64 resolves 0.2 microseconds at today's dates."""
    whole_s, rest_ns = np.divmod(np.asarray(stamps, dtype=np.int64), 10**9)
    seconds: FloatArray = whole_s + rest_ns / 1e9
    return seconds


def datetimes_to_s(moments: np.ndarray) -> FloatArray:
    """Convert times of numpy (datetime64) to s since 1970."""
    return ns_to_s(moments.astype("datetime64[ns]").astype(np.int64))
