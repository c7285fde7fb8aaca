"""Reads times that are written as text, with a date or without one, as seconds."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.table.units import TIME_TO_S

NO_ZONE = "time has no time zone, taken as UTC"
CLOCK_TIME = "time is a clock time, in s from midnight; a day is added where it passes midnight"
MINUTES = "time is minutes and seconds, in s; an hour is added where it passes the full hour"
DAY_S = TIME_TO_S["d"]
PERIOD_S = {CLOCK_TIME: DAY_S, MINUTES: TIME_TO_S["h"]}
"""Note on a clock without a date, to the time after which this clock starts again at 0, s."""

ORDERS = {"year first": "ymd", "day first": "dmy", "month first": "mdy"}
"""Order of day, month and year as the config names it, to its name in this module."""
_WORDS_OF_ORDER = {order: word for word, order in ORDERS.items()}

_HALF = r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
_DATE = re.compile(
    r"(?P<d0>\d{4}|\d\d?)[-/.](?P<d1>\d\d?)[-/.](?P<d2>\d{4}|\d\d?)[T ] *(?P<hour>\d\d?):(?P<minute>[0-5]\d)"
    r"(?::(?P<second>[0-5]\d)(?:[.,](?P<part>\d{1,9}))?)?"
    + _HALF
    + r" ?(?P<zone>Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)?"
)
_MONTHS = {
    word: number
    for number, words in enumerate(
        [
            "jan/ene",
            "feb",
            "mar/mär/mrz",
            "apr/abr",
            "may/mai",
            "jun",
            "jul",
            "aug/ago",
            "sep",
            "oct/okt",
            "nov",
            "dec/dez/dic",
        ],
        start=1,
    )
    for word in words.split("/")
}
"""First three letters of a month in English, German or Spanish, to its number."""
_MONTH = r"(?P<month>[A-Za-zä]{3,10})\.?"
_DAY_FIRST = re.compile(rf"(?P<day>\d\d?)\.?[-/. ]{_MONTH}[-/. ,]+(?P<year>\d{{4}}|\d\d)(?=[T ])")
_MONTH_FIRST = re.compile(rf"{_MONTH}[- ](?P<day>\d\d?)(?:, ?|[- ])(?P<year>\d{{4}})(?=[T ])")
_YEAR_FIRST = re.compile(rf"(?P<year>\d{{4}})[-/. ]{_MONTH}[-/. ](?P<day>\d\d?)(?=[T ])")
_NAMED_MONTHS = (_DAY_FIRST, _MONTH_FIRST, _YEAR_FIRST)
_CLOCK = re.compile(r"(\d\d?:[0-5]\d:[0-5]\d(?:[.,:]\d{1,9})?|[0-5]?\d:[0-5]\d[.,]\d{1,9})" + _HALF)
_COLON_BEFORE_PART = re.compile(r"(\d\d?:[0-5]\d:[0-5]\d):(\d{1,9})")
"""A clock time with a colon before the fraction of a second."""
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:[^AaPp]*")


def is_stamp(text: str) -> bool:
    """Return whether a text is a date with a time of day, or a clock time such as 12:00:00.01 or 00:12.3."""
    if ":" not in text:
        return False
    return bool(_CLOCK.fullmatch(text) or _DATE.fullmatch(_with_month_number(text)))


def _named_month(text: str) -> re.Match[str] | None:
    """Find a date with the name of the month at the beginning of a text."""
    for pattern in _NAMED_MONTHS:
        date = pattern.match(text)
        if date and date["month"][:3].casefold() in _MONTHS:
            return date
    return None


def _with_month_number(text: str) -> str:
    """Return a text with 2026-02-03 in place of 03-Feb-2026; other texts come back unchanged."""
    date = _named_month(text)
    if date is None:
        return text
    year = date["year"] if len(date["year"]) == 4 else f"20{date['year']}"
    month = _MONTHS[date["month"][:3].casefold()]
    return f"{year}-{month:02}-{int(date['day']):02}{text[date.end() :]}"


def date_order(texts: Iterable[str]) -> str:
    """Return the order of day, month and year (``dmy``) of the dates in a column; empty: several orders fit.

    A date with points has the day first, a date with AM or PM the month first; a number above 12 is a day.
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
    """Return the note on how a column of times is read, by its first time; empty where the file leaves no doubt."""
    if _CLOCK.fullmatch(text):
        return CLOCK_TIME if is_clock_time(text) else MINUTES
    date = _DATE.fullmatch(_with_month_number(text))
    note = NO_ZONE if date and not date["zone"] else ""
    return note if order == "ymd" else f"{note}; dates: {_WORDS_OF_ORDER[order]}".removeprefix("; ")


def seconds_of(text: str, order: str = "") -> float:
    """Return a time in s since 1970, or since midnight where it has no date; NaN where the text is no time.

    `order`: Order of day, month and year (``dmy``); empty: the text must show the order, else NaN.
    """
    if clock := _CLOCK.fullmatch(text):
        text = _COLON_BEFORE_PART.sub(r"\1.\2", clock[0])
        hours = "" if text.count(":") == 2 else "00:"
        text, order = f"1970-01-01 {hours}{text}", "ymd"
    if _named_month(text):
        text, order = _with_month_number(text), "ymd"
    date = _DATE.fullmatch(text)
    order = order or date_order([text])
    if not date or not order or len(date[f"d{order.index('y')}"]) == 1:
        return np.nan
    year, month, day = (int(date[f"d{order.index(letter)}"]) for letter in "ymd")
    hour, half, zone = int(date["hour"]), date["half"], date["zone"] or "Z"
    if half:
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
    away = 0.0
    if zone[0] in "+-":
        digits = zone[1:].replace(":", "").ljust(4, "0")
        away = (int(digits[:2]) * 3600 + int(digits[2:]) * 60) * (-1.0 if zone[0] == "-" else 1.0)
    return moment.timestamp() - away + float(f"0.{date['part'] or 0}")


def seconds_of_column(cells: Any, order: str = "") -> FloatArray | None:
    """Return the times of an Arrow column of text, s as of `seconds_of`, all at once.

    None where Arrow cannot read each cell as `seconds_of` would: the caller then reads cell by cell.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    try:
        first = cells[0].as_py().strip(" \t")
        cells = pc.utf8_trim(cells, " \t")
        if _CLOCK.fullmatch(first):
            if _COLON_BEFORE_PART.fullmatch(first):
                cells = pc.replace_substring_regex(
                    cells, f"^{_COLON_BEFORE_PART.pattern}$", r"\1.\2"
                )
                first = cells[0].as_py()
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
        zoned = bool((date := _DATE.fullmatch(first)) and date["zone"])
        stamps = cells.cast(pa.timestamp("ns", "UTC" if zoned else None))
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError, UnicodeDecodeError, ValueError):
        return None  # a cell is no date: the caller finds out which
    seconds: FloatArray = ns_to_s(stamps.cast(pa.int64()).to_numpy()) + 43200.0 * half_days
    return seconds


def _with_month_numbers(cells: Any) -> Any:
    """Return an Arrow column with 2026-02-03 in place of dates such as 03-Feb-2026."""
    import pyarrow.compute as pc

    first = cells[0].as_py()
    for pattern in _NAMED_MONTHS:
        if not pattern.match(first):
            continue
        places = {pattern.groupindex[name]: name for name in ("day", "month", "year")}
        order = [places[number] for number in sorted(places)]
        plain = re.sub(r"\?P<\w+>", "", pattern.pattern).replace("(?=[T ])", "([T ])")
        parts = pc.extract_regex(cells, pattern=f"^{pattern.pattern.replace('(?=[T ])', '')}")
        words = pc.unique(pc.struct_field(parts, "month")).to_pylist()
        day, year = order.index("day") + 1, order.index("year") + 1
        for word in filter(None, words):
            month = _MONTHS.get(word[:3].casefold())
            if month is None:
                raise ValueError(word)
            # group 4 is the T or blank behind the date
            pattern_of_month = plain.replace("([A-Za-zä]{3,10})", f"({word})")
            cells = pc.replace_substring_regex(
                cells, f"^{pattern_of_month}", rf"\{year}-{month:02}-\{day}\4"
            )
    return cells


def _as_iso(cells: Any, order: str) -> tuple[Any, np.ndarray]:
    """Return an Arrow column with dates by ISO 8601, and how many half days to add to each time, for AM and PM.

    `order`: Order of day, month and year in `cells`. Raises ValueError for an hour that AM and PM cannot have.
    """
    import pyarrow.compute as pc

    def matches(pattern: str) -> np.ndarray:
        """Return 1 for each cell in which a pattern is found, else 0."""
        return np.asarray(pc.match_substring_regex(cells, pattern)).astype(int)

    year, month, day = (order.index(letter) + 1 for letter in "ymd")
    iso = rf"\{year}-\{month}-\{day}T"
    cells = pc.replace_substring_regex(cells, r"^(\d+)[-/.](\d+)[-/.](\d+)[T ] *", iso)
    for _ in range(
        2
    ):  # twice, as two neighbouring numbers of one digit share the character between them
        cells = pc.replace_substring_regex(cells, r"([-T:])(\d)([-T:])", r"\10\2\3")
    cells = pc.replace_substring_regex(cells, r"^(\d\d)-", r"20\1-")
    is_pm, half = matches(r"[Pp]\.?[Mm]\.?$"), matches(r"[AaPp]\.?[Mm]\.?$")
    noon = half * matches("T12:")
    if (half * (1 - matches(r"T(0[1-9]|1[0-2]):"))).any():
        raise ValueError  # an hour beyond 1 to 12
    return pc.replace_substring_regex(cells, r" ?[AaPp]\.?[Mm]\.?$", ""), is_pm - noon


class RestartingClock:
    """Makes times of a clock without a date continuous, block by block; the clock starts again after `period`, s."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._last = 0.0
        self._passed = 0.0

    def follow(self, times: FloatArray) -> FloatArray:
        """Return the next times, s, shape (n,), made continuous: a step back by half a period is a new start."""
        is_finite = np.isfinite(times)
        if not is_finite.all():
            followed = times.copy()
            followed[is_finite] = self.follow(times[is_finite])
            return followed
        if times.size == 0:
            return times
        steps = np.diff(times, prepend=self._last)
        passed = self._passed + self._period * np.cumsum(steps < -self._period / 2)
        self._last, self._passed = float(times[-1]), float(passed[-1])
        continuous_times: FloatArray = times + passed
        return continuous_times


def ns_to_s(stamps: np.ndarray) -> FloatArray:
    """Convert nanoseconds since 1970 (whole numbers) to s; float64 resolves 0.2 microseconds at today's dates."""
    stamps = np.asarray(stamps, dtype=np.int64)
    whole = stamps // 10**9
    seconds: FloatArray = whole + (stamps - whole * 10**9) / 1e9
    return seconds


def datetimes_to_s(moments: np.ndarray) -> FloatArray:
    """Convert times of numpy (datetime64) to s since 1970."""
    return ns_to_s(moments.astype("datetime64[ns]").astype(np.int64))
