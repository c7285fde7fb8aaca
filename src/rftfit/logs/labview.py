"""LabVIEW measurement files (.lvm): a file header, then segments of text, each with a header.

A *channel* is a column of readings. Time is an *X column*, ``X_Value``, of which there may be one for all channels or
one for each; or there is none, and it follows from the start X0 and the step Delta_X of the header. The way: file
header (`_file_header`) -> blocks of the file, cut where a segment ends (`_blocks_of_segments`) -> header of a segment
(`_read_segment`) -> rows (`_log_of_rows`). A file with channels that do not share one clock is refused.
"""

from __future__ import annotations

import datetime as dt
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.logs import base
from rftfit.logs.quantities import units_by_name
from rftfit.logs.text import MAX_LINE, Block, TextFile
from rftfit.table.numbers import NO_VALUE, number_of
from rftfit.table.parse import Kind, Layout, ParsedRows, add_counts, parse
from rftfit.table.text import Line, decode_first_lines, each_line, text_head
from rftfit.table.units import canonical_unit

MAGIC = "LabVIEW Measurement"
OTHER_CHANNELS = "segment with other channels than the first"
"""Reason of the ledger for rows that are dropped."""

_END = "***End_of_Header***"
_SEGMENT = re.compile(rb"(?m)^[ \t]*Channels[\t,;]")
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


class LvmReader(base.Reader):
    """Text with a file header and segments; decimal comma or point; with or without X columns, which hold the time."""

    name = "lvm"
    description = (
        "LabVIEW .lvm text; time is X_Value, or the sample times Delta_X, from segment starts"
    )
    evidence = f"its first line, {MAGIC}"

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        return text_head(head[:256]).startswith(MAGIC.encode())

    def stream(self, path: Path) -> Iterator[base.Log]:
        """Read a file in blocks of some megabytes; whatever its headers lack is a `LogError`."""
        text = TextFile(path)
        try:
            lines = islice(each_line(text.head), base.FIRST.lvm_lines)
            file, start = _file_header(path, lines)
            file.asked = self.asked
            rows = 0

            def parse_block(segment_block: tuple[_Segment, Block]) -> tuple[_Segment, ParsedRows]:
                """Parse a block of rows; return it with its segment."""
                segment, block = segment_block
                return segment, parse(segment.layout, *block, keep_blanks=self.keeps_blanks)

            for segment, segment_rows in base.parallel_map(
                parse_block, _blocks_of_segments(file, text, start)
            ):
                log = _log_of_rows(file, segment, segment_rows)
                rows += log.rows
                if log.rows:
                    yield log
        except ValueError as error:
            raise base.LogError("header", f"{path}: {error}") from None
        if rows == 0:
            raise base.LogError("header_only", f"{path}: a header and no data")


@dataclass
class _Segment:
    """One segment: rows below a header.

    `layout`: How a row is split, and which columns are read. `units`: Column, to its unit. `x_of`: Channel, to its X
    column; "" where there are no X columns. `begins`: X column, to its start, s after the start of the file. `step`:
    Time between rows, s. `rows`: Number of rows parsed so far. `timed`: Whether X is a time: it may be a frequency.
    """

    layout: Layout
    units: dict[str, str]
    x_of: dict[str, str]
    begins: dict[str, float]
    step: float
    rows: int = 0
    timed: bool = True


@dataclass
class _File:
    """Settings that the segments of one file have in common.

    `x_columns`: "no", "one" or "multi". `asked`: Columns to be read, as in `Reader`; None: all. `first`: First segment,
    with which the others must agree. `began`: Start of its first channel, which counts as that of the file; None: not
    stated. `notes`: As in `Log`.
    """

    path: Path
    separator: str
    decimal: str
    x_columns: str
    asked: frozenset[str] | None = None
    first: _Segment | None = None
    began: dt.datetime | None = None
    notes: list[str] = field(default_factory=list)


def _file_header(path: Path, lines: Iterator[Line]) -> tuple[_File, int]:
    """Read the file header; also return the offset in bytes at which the segments begin.

    Raises ValueError where the header is not one of LabVIEW, or has no end.
    """
    settings: dict[str, str] = {}
    first_line = next(lines).text
    if not first_line.startswith(MAGIC):
        raise ValueError(f"found {first_line[:40]!r}; allowed: {MAGIC!r} first")
    for line in lines:
        if line.text.startswith(_END):
            separator = _SEPARATORS.get(settings.get("Separator", "Tab").casefold(), "\t")
            decimal = settings.get("Decimal_Separator", ".")[:1]
            x_columns = settings.get("X_Columns", "One").casefold()
            return _File(path, separator, "," if decimal == "," else ".", x_columns), line.stop
        # the header names the separator, but not in its first line: each of the three is accepted
        key, *value = re.split(r"[\t;,]", line.text, maxsplit=1)
        settings[key.strip()] = "".join(value).strip(" \t;")
    raise ValueError(f"the file header has no end ({_END}): cut short?")


def _blocks_of_segments(
    file: _File, text: TextFile, start: int
) -> Iterator[tuple[_Segment, Block]]:
    """Yield each segment with a block of its rows: blocks of the file are cut where a segment ends.

    `start`: Offset in the file at which the segments begin, bytes. A long segment has several blocks.
    """
    # `segment`: the one whose rows come next; None: its header comes first. `carry`: what is not yielded yet
    segment: _Segment | None = None
    carry = b""
    for body, last_line, before in text.blocks(start):
        carry += body
        while carry:
            if segment is None:
                stop = _header_end(carry)
                if stop is None:  # the rest of the header is in the next block
                    if len(carry) > MAX_LINE:
                        raise ValueError(f"a segment's header has no end ({_END})")
                    break
                segment = _read_segment(file, carry[:stop], carry[stop : stop + MAX_LINE])
                carry = carry[stop:]
            # a search for one letter is several times faster than one for a word
            next_header = _SEGMENT.search(carry) if b"C" in carry and b"Channels" in carry else None
            if next_header:
                yield segment, Block(carry[: next_header.start()], b"")
                carry, segment = carry[next_header.start() :], None
            else:
                yield segment, Block(carry, b"")
                carry = b""
        if segment is not None and last_line:
            yield segment, Block(b"", last_line, before)


def _header_end(content: bytes) -> int | None:
    """Return the offset at which the rows of a segment begin, behind the row of names below its header.

    None if that is not in the `content`, which begins with the header.
    """
    offset = content.find(_END.encode())
    if offset < 0:
        return None
    lines = decode_first_lines(content[offset : offset + MAX_LINE], 2)
    return offset + lines[1].stop if len(lines) == 2 and lines[1].whole else None


class _Settings(dict[str, list[str]]):
    """Settings in the header of a segment: key to a list with a cell for each channel."""

    def cell(self, key: str, channel: int) -> str:
        """Return the cell of a channel, by its index; where it is blank, that of the first channel holds for all."""
        cells = self.get(key, [])
        return (cells[channel] if channel < len(cells) else "") or next(iter(cells), "")

    def number(self, key: str, channel: int) -> float:
        """Return the cell of a channel as a number; 0 where it is none."""
        number = number_of(self.cell(key, channel).replace(",", "."))
        return number if math.isfinite(number) else 0.0

    def moment(self, channel: int) -> dt.datetime | None:
        """Return the start of a channel, None if not stated; the fraction may have more digits than strptime reads."""
        time = self.cell("Time", channel).replace(",", ".")
        whole, _, fraction = time.partition(".")
        try:
            start = dt.datetime.strptime(
                f"{self.cell('Date', channel)} {whole}", "%Y/%m/%d %H:%M:%S"
            )
            return start + dt.timedelta(seconds=float(f"0.{fraction or 0}"))
        except (ValueError, OverflowError):
            return None


def _blank_columns(file: _File, names: Sequence[str], first_rows: bytes) -> list[str]:
    """Return those `names` of columns that are blank in all of the first rows (text); none where there is no row."""
    blank_names = [*names]
    has_rows = False
    for line in each_line(first_rows):
        cells = line.text.split(file.separator)
        if not line.whole or len(cells) < len(names) - 1:
            continue
        has_rows = True
        filled = {name for name, cell in zip(names, cells, strict=False) if cell.strip()}
        blank_names = [name for name in blank_names if name not in filled]
        # in most files the first row fills all columns
        if not blank_names:
            break
    return blank_names if has_rows else []


def _read_segment(file: _File, header: bytes, first_rows: bytes) -> _Segment:
    """Read the header of a segment; the first segment also sets start, notes and `first` of the file.

    `header`: Text of the header and the row of names. `first_rows`: Text that follows, by which blank columns are
    found.
    """
    lines = [line.text for line in decode_first_lines(header)]
    settings = _Settings()
    for line in lines[:-2]:  # but the mark of the end, and the names
        key, *values = (cell.strip() for cell in line.split(file.separator))
        settings[key] = values
    cells = lines[-1].split(file.separator)
    while cells and not cells[-1].strip():
        cells.pop()
    units = units_by_name(cells)
    names = tuple(units)
    stated_units = iter(settings.get("Y_Unit_Label", []))
    x_names = [n for n, cell in zip(names, cells, strict=True) if cell.startswith("X_Value")]
    if file.x_columns == "no":
        x_names = []  # the column is there, and empty
    # channel to its index in the lists of the header; and to its X column, which is the last one before it
    channels: dict[str, int] = {}
    x_of: dict[str, str] = {}
    x = next(iter(x_names), "")
    for name, cell in zip(names, cells, strict=True):
        if name in x_names:
            x = name
        elif cell != "Comment" and not cell.startswith("X_Value"):
            channels[name], x_of[name] = len(channels), x
            # the unit that LabVIEW states goes before a unit in the name, which a user has typed
            units[name] = canonical_unit(next(stated_units, "")) or units[name]
    asked = _columns_asked_for(file, names, channels, first_rows)
    channels = {name: index for name, index in channels.items() if name in asked}
    x_of = {name: x_of[name] for name in channels}
    x_names_read = tuple(dict.fromkeys(x_of.values())) or (x,)
    read = {*channels, *x_names_read, *asked.intersection(x_names)}
    kinds = tuple[Kind, ...]("number" if name in read else "skip" for name in names)
    if not read.intersection(names):
        raise ValueError(
            f"a segment names no column; found {lines[-1].strip()[:40]!r} where its names stand"
        )
    n_comments = int(cells[-1] == "Comment")
    layout = Layout(
        names, kinds, file.separator, file.decimal, optional=n_comments, no_value=NO_VALUE
    )
    if file.first is None:
        file.began = settings.moment(0)
    timed = all(settings.cell("X_Dimension", index) in ("Time", "") for index in channels.values())
    segment = _Segment(layout, units, x_of, {}, settings.number("Delta_X", 0), timed=timed)
    if timed:
        _read_clocks(file, settings, segment, channels, x_names_read)
    if file.first is None:
        file.first = segment
        when = file.began.isoformat(" ") if file.began else "at a time that is not stated"
        file.notes.append(f"recording started: {when}")
        time_source = "X_Value" if any(x_names_read) else f"X0 + row x Delta_X ({segment.step:g})"
        file.notes.append(f"time is {time_source}" if timed else "X_Value is no time")
    return segment


def _columns_asked_for(
    file: _File, names: Sequence[str], channels: Collection[str], first_rows: bytes
) -> frozenset[str]:
    """Return the columns of a segment that are asked for: by default the channels with a value in the first rows.

    `names`: Of all its columns. `channels`: Names of the channels. Blank channels of the first segment get a note.
    """
    if file.asked is None:
        blank_names = {*_blank_columns(file, names, first_rows)}.intersection(channels)
        if blank_names and file.first is None:
            listed = ", ".join(sorted(blank_names))
            file.notes.append(f"no value in the first rows, not read: {listed}")
        return frozenset({*channels} - blank_names or channels)
    if file.asked.difference(names, QUANTITIES) or not file.asked.intersection(channels):
        # with all channels, the caller can name those that the file has
        return frozenset(channels)
    return file.asked


def _read_clocks(
    file: _File,
    settings: _Settings,
    segment: _Segment,
    channels: Mapping[str, int],
    x_names: Sequence[str],
) -> None:
    """Set the start of each X column of a segment, and the step.

    Raises `LogError` for a segment whose channels have several clocks, ValueError without a step where it gives the
    time.
    `channels`: Channel to its index in the lists of the header. `x_names`: X columns; one empty name where there are none.
    """
    for x in x_names:
        # the channels of this X column; where it has none, it is read alone, as the first channel of the header
        sharing = {n: index for n, index in channels.items() if segment.x_of[n] == x} or {x: 0}
        clocks = {name: _clock(file, settings, index) for name, index in sharing.items()}
        other_channels = [name for name in channels if name not in sharing]
        # over so many samples that steps must be equal
        clock = base.common_clock(file.path, clocks, 10**9, other_channels=other_channels)
        # an X column holds times since the start of the segment, X0 included
        start = _seconds_after_file(file, settings, min(sharing.values())) if x else clock.start
        segment.begins[x] = 0.0 if math.isnan(start) else start
        segment.step = clock.step
    if "" in segment.begins and not segment.step > 0:
        step = settings.cell("Delta_X", 0) or "nothing"
        raise ValueError(f"found Delta_X {step}; allowed: a step above 0 for each channel")


def _clock(file: _File, settings: _Settings, channel: int) -> base.ChannelClock:
    """Return the clock of a channel by the header: start, s after the start of the file, and step, s."""
    start = _seconds_after_file(file, settings, channel) + settings.number("X0", channel)
    return base.ChannelClock(start, settings.number("Delta_X", channel))


def _seconds_after_file(file: _File, settings: _Settings, channel: int) -> float:
    """Return the start of a channel, s after the start of the file; NaN where only one of the two is known."""
    began = settings.moment(channel)
    if began is None or file.began is None:
        return 0.0 if began is file.began else math.nan  # 0: both are None
    return (began - file.began).total_seconds()


def _log_of_rows(file: _File, segment: _Segment, rows: ParsedRows) -> base.Log:
    """Make a log of parsed rows; rows of a segment with other channels than the first are dropped and counted.

    Adds the rows to the count of the segment.
    """
    first = file.first
    assert first is not None
    rows_before, segment.rows = segment.rows, segment.rows + rows.rows
    channels_of_first = (first.layout, first.units, first.timed)
    if (segment.layout, segment.units, segment.timed) != channels_of_first:
        lost = {OTHER_CHANNELS: rows.line_numbers.size} if rows.line_numbers.size else {}
        dropped = add_counts(rows.dropped, lost)
        # no row, with the columns of the first segment
        segment, rows = first, replace(parse(first.layout, b""), rows=rows.rows, dropped=dropped)
    columns = _with_time(file, segment, rows, rows_before)
    units = {name: "s" if name == "time" else first.units.get(name, "") for name in columns}
    return base.Log(file.path, columns, units, rows.rows, rows.dropped, notes=tuple(file.notes))


def _with_time(
    file: _File, segment: _Segment, rows: ParsedRows, rows_before: int
) -> dict[str, np.ndarray]:
    """Return the columns with the time, s, first; raises `MixedClocksError` if X columns differ within a row.

    `rows_before`: Number of rows of the segment in the blocks before.
    """
    if not segment.timed:
        return rows.columns
    # the time by each X column, shape (n,); without X columns by the number of the row
    if "" in segment.begins:
        times = [segment.begins[""] + (rows.line_numbers + rows_before) * segment.step]
    else:
        times = [start + rows.columns[x] for x, start in segment.begins.items()]
    differs = [np.abs(time - times[0]) > base.SAME_S for time in times[1:]]
    if np.any(differs):
        row = int(np.argmax(np.any(differs, axis=0)))
        times_of_row = ", ".join(f"{time[row]:.9g} s" for time in times)
        groups = [
            [name for name, x_column in segment.x_of.items() if x_column == x]
            for x in segment.begins
        ]
        raise base.MixedClocksError(file.path, f"{times_of_row} in one row", groups)
    time = times[0]
    for channel_time in times[1:]:
        # a channel without a value in a row has a blank X there
        time = np.where(np.isnan(time), channel_time, time)
    return {"time": time, **rows.columns}
