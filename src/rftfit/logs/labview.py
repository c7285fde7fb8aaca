"""LabVIEW measurement files (.lvm): segments of text, each with a header of its own."""

from __future__ import annotations

import datetime as dt
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rftfit.logs.base import Log, LogError, Reader, added, in_order
from rftfit.logs.text import MAX_LINE, Kind, Layout, Parser, TextFile, lines_of, readable
from rftfit.logs.units import split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    import numpy as np

    from rftfit.logs.text import Line, Rows


MAGIC = "LabVIEW Measurement"
OTHER_CHANNELS = "segment with other channels than the first"
_END = "***End_of_Header***"
_SEGMENT = re.compile(rb"(?m)^[ \t]*Channels[\t,;]")
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


@dataclass
class _Segment:
    """One stretch of rows, and how its time comes about."""

    parser: Parser
    units: dict[str, str]
    x: str
    start: float
    x0: float
    step: float
    rows: int = 0
    timed: bool = True


@dataclass
class _File:
    """What the segments of one file have in common."""

    separator: str
    decimal: str
    x_columns: str
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
            file, start = _file(lines_of(text.head))
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


def _file(lines: Sequence[Line]) -> tuple[_File, int]:
    """Read the file header; the segments begin at the place that comes with it."""
    settings: dict[str, str] = {}
    if not lines or not lines[0].text.startswith(MAGIC):
        raise ValueError(f"found {lines[0].text[:40] if lines else ''!r}; allowed: {MAGIC!r} first")
    for line in lines[1:]:
        if line.text.startswith(_END):
            separator = _SEPARATORS.get(settings.get("Separator", "Tab").casefold(), "\t")
            decimal = settings.get("Decimal_Separator", ".")[:1]
            x_columns = settings.get("X_Columns", "One").casefold()
            return _File(separator, "," if decimal == "," else ".", x_columns), line.stop
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
    kinds = [_kind(cell, file.x_columns) for cell in given]
    stated = iter(settings.get("Y_Unit_Label", []))
    units = dict(zip(names, (unit for _, unit in split), strict=True))
    for name, cell in zip(names, given, strict=True):
        if not cell.startswith("X_Value") and cell != "Comment":
            # as LabVIEW states it, and only then as somebody typed it into the name
            units[name] = unit_word(next(stated, "")) or units[name]
    x = next((n for n, k in zip(names, kinds, strict=True) if k == "number" and "X_Value" in n), "")
    began = _moment(settings)
    if file.first is None:
        file.began = began
        if file.x_columns == "multi":
            file.notes.append("time is the X_Value of the first channel")
    start = (began - file.began).total_seconds() if began and file.began else 0.0
    steps = [_number(cell) for cell in settings.get("Delta_X", []) if cell]
    if not x and (not steps or len(set(steps)) > 1 or not steps[0] > 0):
        raise ValueError(f"found Delta_X {steps or 'nothing'}; allowed: one step for all channels")
    comments = given[-1:] == ["Comment"]
    layout = Layout(
        names, tuple(kinds), file.separator, file.decimal, quote=False, optional=int(comments)
    )
    x0 = next((_number(cell) for cell in settings.get("X0", []) if cell), 0.0)
    timed = settings.get("X_Dimension", ["Time"])[:1] in (["Time"], [""], [])
    segment = _Segment(Parser(layout), units, x, start, x0, steps[0] if steps else 0.0, timed=timed)
    if file.first is None:
        file.first = segment
        when = began.isoformat(" ") if began else "at a time that is not stated"
        file.notes.append(f"recording started: {when}")
        how = "X_Value" if x else f"X0 + row x Delta_X ({segment.step:g})"
        file.notes.append(f"time is {how}" if timed else "X_Value is no time")
    return segment


def _kind(cell: str, x_columns: str) -> Kind:
    if cell.strip() == "Comment":
        return "skip"
    return "skip" if cell.startswith("X_Value") and x_columns == "no" else "number"


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return 0.0


def _moment(settings: dict[str, list[str]]) -> dt.datetime | None:
    """Start of a segment; the time may have more digits than any clock."""
    date = next(iter(settings.get("Date", [])), "")
    time = next(iter(settings.get("Time", [])), "").replace(",", ".")
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
    columns = _timed(segment, rows, begin)
    units = {name: "s" if name == "time" else first.units.get(name, "") for name in columns}
    return Log(path, columns, units, rows.rows, rows.dropped, notes=tuple(file.notes))


def _timed(segment: _Segment, rows: Rows, begin: int) -> dict[str, np.ndarray]:
    if not segment.timed:
        return rows.columns
    if segment.x:
        time = segment.start + rows.columns[segment.x]
    else:
        time = segment.start + segment.x0 + (rows.index + begin) * segment.step
    return {"time": time, **rows.columns}
