"""LabVIEW measurement files (.lvm): segments of text, each with a header of its own."""

from __future__ import annotations

import datetime as dt
import math
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.logs.base import Log, LogError, Reader, added, in_order
from rftfit.logs.channels import SAME_S, Clock, one_clock, own_clocks
from rftfit.logs.text import MAX_LINE, Kind, Layout, Parser, TextFile, lines_of, readable
from rftfit.logs.units import split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rftfit.logs.text import Line, Rows


MAGIC = "LabVIEW Measurement"
OTHER_CHANNELS = "segment with other channels than the first"
_MANY = 10**9  # steps that differ at all do so after so many samples
_END = "***End_of_Header***"
_SEGMENT = re.compile(rb"(?m)^[ \t]*Channels[\t,;]")
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


@dataclass
class _Segment:
    """One stretch of rows, and when the X columns of its channels begin, s ("": there are none)."""

    parser: Parser
    units: dict[str, str]
    begins: dict[str, float]
    step: float
    rows: int = 0
    timed: bool = True


@dataclass
class _File:
    """What the segments of one file have in common."""

    path: Path
    separator: str
    decimal: str
    x_columns: str
    asked: frozenset[str] | None = None
    first: _Segment | None = None
    began: dt.datetime | None = None
    notes: list[str] = field(default_factory=list)


class LvmReader(Reader):
    """Text with a file header and segments; decimal comma or point; with X columns or without."""

    name = "lvm"
    evidence = f"its first line, {MAGIC}"

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return (
            "LabVIEW .lvm text; time is X_Value, or the sample times Delta_X, from segment starts"
        )

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return readable(head[:256]).startswith(MAGIC.encode())

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in blocks of some megabytes."""
        text = TextFile(path)
        try:
            file, start = _file(path, lines_of(text.head))
            file.asked = self.asked
            rows = 0
            for segment, found in in_order(_parsed, _pieces(file, text, start)):
                log = _log(path, file, segment, found)
                rows += log.rows
                if log.rows:
                    yield log
        except ValueError as error:
            raise LogError("header", f"{path}: {error}") from None
        if rows == 0:
            raise LogError("header_only", f"{path}: a header and no data")


def _file(path: Path, lines: Sequence[Line]) -> tuple[_File, int]:
    """Read the file header; the segments begin at the place that comes with it."""
    settings: dict[str, str] = {}
    if not lines or not lines[0].text.startswith(MAGIC):
        raise ValueError(f"found {lines[0].text[:40] if lines else ''!r}; allowed: {MAGIC!r} first")
    for line in lines[1:]:
        if line.text.startswith(_END):
            separator = _SEPARATORS.get(settings.get("Separator", "Tab").casefold(), "\t")
            decimal = settings.get("Decimal_Separator", ".")[:1]
            x_columns = settings.get("X_Columns", "One").casefold()
            return _File(path, separator, "," if decimal == "," else ".", x_columns), line.stop
        # the separator itself is named in here: any of them will do
        key, _, value = re.sub(r"[\t;]", ",", line.text, count=1).partition(",")
        settings[key.strip()] = value.strip(" \t;")
    raise ValueError(f"the file header has no end ({_END}): cut short?")


def _parsed(piece: tuple[_Segment, bytes, bytes]) -> tuple[_Segment, Rows]:
    segment, body, rest = piece
    return segment, segment.parser.parse(body, rest)


def _pieces(file: _File, text: TextFile, start: int) -> Iterator[tuple[_Segment, bytes, bytes]]:
    """Cut blocks of the file where a segment ends."""
    segment: _Segment | None = None
    carry = b""
    for body, rest in text.blocks(start):
        carry += body
        while carry:
            if segment is None:
                place = _header_end(carry)
                if place is None:
                    if len(carry) > MAX_LINE:
                        raise ValueError(f"a segment's header has no end ({_END})")
                    break
                segment = _segment(file, carry[:place])
                carry = carry[place:]
            # one letter is looked for several times faster than a word
            found = _SEGMENT.search(carry) if b"C" in carry and b"Channels" in carry else None
            if found:
                yield segment, carry[: found.start()], b""
                carry, segment = carry[found.start() :], None
            else:
                yield segment, carry, b""
                carry = b""
        if segment is not None and rest:
            yield segment, b"", rest


def _header_end(text: bytes) -> int | None:
    """Where the rows begin: behind the row of names that follows the end of the header."""
    place = text.find(_END.encode())
    if place < 0:
        return None
    lines = [line for line in lines_of(text[place : place + MAX_LINE], 2) if line.whole]
    return place + lines[1].stop if len(lines) == 2 else None


def _segment(file: _File, header: bytes) -> _Segment:
    lines = [line.text for line in lines_of(header)]
    settings: dict[str, list[str]] = {}
    for line in lines[:-2]:
        key, *values = (cell.strip() for cell in line.split(file.separator))
        settings[key] = values
    given = lines[-1].split(file.separator)
    while given and not given[-1].strip():
        given.pop()
    split = [split_unit(cell) for cell in given]
    names = unique([name for name, _ in split])
    units = dict(zip(names, (unit for _, unit in split), strict=True))
    stated = iter(settings.get("Y_Unit_Label", []))
    own_x = [n for n, cell in zip(names, given, strict=True) if cell.startswith("X_Value")]
    if file.x_columns == "no":
        own_x = []  # the column is there, and empty
    x = next(iter(own_x), "")
    channels: dict[str, tuple[int, str]] = {}  # place in the lists of the header, X column
    for name, cell in zip(names, given, strict=True):
        if name in own_x:
            x = name
        elif cell != "Comment" and not cell.startswith("X_Value"):
            channels[name] = len(channels), x
            # as LabVIEW states it, and only then as somebody typed it into the name
            units[name] = unit_word(next(stated, "")) or units[name]
    asked = file.asked or frozenset(channels)
    if asked.difference(names, QUANTITIES) or not asked.intersection(channels):
        asked = frozenset(channels)  # whoever asks for others finds out which there are
    channels = {name: place for name, place in channels.items() if name in asked}
    xs = tuple(dict.fromkeys(x for _, x in channels.values())) or (x,)
    read = {*channels, *xs, *asked.intersection(own_x)}
    kinds = tuple[Kind, ...]("number" if name in read else "skip" for name in names)
    if file.first is None:
        file.began = _moment(settings, 0)
    timed = all(_of(settings, "X_Dimension", at) in ("Time", "") for at, _ in channels.values())
    begins: dict[str, float] = {}
    step = _number(_of(settings, "Delta_X", 0))
    for x in xs if timed else ():
        sharing = {name: at for name, (at, own) in channels.items() if own == x} or {x: 0}
        clocks = {name: _clock(file, settings, at) for name, at in sharing.items()}
        clock = one_clock(file.path, clocks, _MANY)
        # an X column counts from the segment's start and begins at X0
        start = _began(file, settings, min(sharing.values())) if x else clock.start
        begins[x], step = (0.0 if math.isnan(start) else start), clock.step
    if "" in begins and not step > 0:
        found = _of(settings, "Delta_X", 0) or "nothing"
        raise ValueError(f"found Delta_X {found}; allowed: a step above 0 for each channel")
    comments = given[-1:] == ["Comment"]
    layout = Layout(names, kinds, file.separator, file.decimal, quote=False, optional=int(comments))
    segment = _Segment(Parser(layout), units, begins, step, timed=timed)
    if file.first is None:
        file.first = segment
        when = file.began.isoformat(" ") if file.began else "at a time that is not stated"
        file.notes.append(f"recording started: {when}")
        how = "X_Value" if any(xs) else f"X0 + row x Delta_X ({segment.step:g})"
        file.notes.append(f"time is {how}" if timed else "X_Value is no time")
    return segment


def _of(settings: dict[str, list[str]], key: str, at: int) -> str:
    """Return what the header states for one channel; where it states nothing, what for the first."""
    cells = settings.get(key, [])
    return (cells[at] if at < len(cells) else "") or next(iter(cells), "")


def _clock(file: _File, settings: dict[str, list[str]], at: int) -> Clock:
    x0, step = (_number(_of(settings, key, at)) for key in ("X0", "Delta_X"))
    return Clock(_began(file, settings, at) + x0, step)


def _began(file: _File, settings: dict[str, list[str]], at: int) -> float:
    """Start of a channel after that of the file, s; NaN where only one of them is known."""
    began = _moment(settings, at)
    if began is None or file.began is None:
        return 0.0 if began is file.began else math.nan
    return (began - file.began).total_seconds()


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return 0.0


def _moment(settings: dict[str, list[str]], at: int) -> dt.datetime | None:
    """Start of a channel in a segment; the time may have more digits than any clock."""
    date = _of(settings, "Date", at)
    time = _of(settings, "Time", at).replace(",", ".")
    whole, _, part = time.partition(".")
    try:
        start = dt.datetime.strptime(f"{date} {whole}", "%Y/%m/%d %H:%M:%S")
        return start + dt.timedelta(seconds=float(f"0.{part or 0}"))
    except (ValueError, OverflowError):
        return None


def _log(path: Path, file: _File, segment: _Segment, rows: Rows) -> Log:
    first = file.first
    assert first is not None
    begin, segment.rows = segment.rows, segment.rows + rows.rows
    same = (segment.parser.layout, segment.units, segment.timed) == (
        first.parser.layout,
        first.units,
        first.timed,
    )
    if not same:
        lost = added(rows.dropped, {OTHER_CHANNELS: rows.index.size} if rows.index.size else {})
        rows = replace(first.parser.parse(b""), rows=rows.rows, dropped=lost)
    columns = _timed(file, segment if same else first, rows, begin)
    units = {name: "s" if name == "time" else first.units.get(name, "") for name in columns}
    return Log(path, columns, units, rows.rows, rows.dropped, notes=tuple(file.notes))


def _timed(file: _File, segment: _Segment, rows: Rows, begin: int) -> dict[str, np.ndarray]:
    if not segment.timed:
        return rows.columns
    if "" in segment.begins:
        times = [segment.begins[""] + (rows.index + begin) * segment.step]
    else:
        times = [start + rows.columns[x] for x, start in segment.begins.items()]
    apart = [np.abs(other - times[0]) > SAME_S for other in times[1:]]
    if np.any(apart):
        row = int(np.argmax(np.any(apart, axis=0)))
        seen = ", ".join(f"{time[row]:.9g} s" for time in times)
        raise own_clocks(file.path, f"{seen} in one row")
    return {"time": times[0], **rows.columns}
