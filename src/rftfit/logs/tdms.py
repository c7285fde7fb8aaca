"""National Instruments TDMS files: each channel is a column; the step of the waveform gives the time.

Channels stand in groups, and are objects of the library npTDMS. A *waveform* is a channel that states its start and the
step between its samples; a channel may also hold times. A file that was not closed breaks off in its last segment.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.logs import base
from rftfit.table.stamps import datetimes_to_s
from rftfit.table.units import canonical_unit

CUT = "cut in mid-segment"
"""Reason of the ledger for rows at the end that are not complete."""

_TIME_NAMES = ("time", "t", "timestamp", "elapsed time", "zeit")


class TdmsReader(base.Reader):
    """LabVIEW and DAQmx recordings.

    Options: `group`, the group of channels to read, if there are several; `rate_Hz`, if no channel states its step.
    """

    name = "tdms"
    description = "National Instruments TDMS, as LabVIEW and DAQmx write it"
    evidence = "the first bytes TDSm"
    marks = (b"TDSm",)
    takes = ("group", "rate_Hz")

    def load(self, path: Path) -> base.Log:
        """Read one group of channels, each a column of its name, and ``time`` where the file has a time."""
        with base.needed_package(path, "TDMS files", "npTDMS", "tdms"):
            from nptdms import TdmsFile
        with base.library_errors(path, "damaged, or no TDMS file"):
            base.refuse_large_file(path)
            # opened here, so that the library does not read the index file beside it, which may be of another day
            with _silent(), path.open("rb") as file:
                return self._log(path, TdmsFile.read(file))

    def _log(self, path: Path, content: Any) -> base.Log:
        """Make a log of a group; rows at the end that the file announces but lacks are dropped and counted.

        `content`: The file as the library has read it. Raises `LogError` where channels of a whole file differ in
        length.
        """
        channels = _channels_of_group(path, content, self.options.get("group", ""))
        names_in_file = tuple(channel.name for channel in channels)
        columns_to_read = self.choose_columns(names_in_file)
        if any(name in columns_to_read for name in names_in_file):
            channels = [c for c in channels if c.name in columns_to_read or _is_time(c)]
        lengths = sorted(len(channel) for channel in channels)
        incomplete = content.file_status.incomplete_final_segment
        if lengths[0] < lengths[-1] and not incomplete:
            raise base.LogError(
                "lengths",
                f"{path}: channels of {lengths[0]} to {lengths[-1]} values in one group: they were not "
                "sampled together",
                lengths[-1],
            )
        size = lengths[0]
        # a file that breaks off has lost a row at least
        rows = max(lengths[-1], _announced_values(content, channels), size + 1 if incomplete else 0)
        columns: dict[str, FloatArray] = {}
        units: dict[str, str] = {}
        time, note = _find_time(path, channels, size, rows)
        if time is None and self.rate:
            time = np.arange(size) / self.rate
            note = f"time is the sample / {self.rate:g} Hz (the config)"
        if time is not None:
            columns["time"], units["time"] = time, "s"
        for channel in channels:
            name = channel.name if channel.name != "time" or time is None else "time (channel)"
            values = np.asarray(channel[:])[:size]
            is_date = values.dtype.kind == "M"
            columns[name] = datetimes_to_s(values) if is_date else values.astype(float)
            units[name] = _unit(channel)
        dropped = {CUT: rows - size} if rows > size else {}
        return base.Log(
            path, columns, units, rows, dropped, notes=(note,), names_in_file=names_in_file
        )


@contextmanager
def _silent() -> Iterator[None]:
    """Silence the library in the block: its warnings of a cut file are in the ledger, too."""
    from nptdms.log import log_manager

    before = logging.getLogger("nptdms.reader").level
    log_manager.set_level(logging.CRITICAL)
    try:
        yield
    finally:
        log_manager.set_level(before)


def _channels_of_group(path: Path, content: Any, group_name: str) -> list[Any]:
    """Return the channels with numbers of the group `group_name`, or, where it is empty, of the only group.

    Raises `LogError` where there is no such group, or several could be meant.
    """
    channels_by_group = {
        group.name: [*filter(_has_numbers, group.channels())] for group in content.groups()
    }
    groups = {name: channels for name, channels in channels_by_group.items() if channels}
    if group_name and group_name not in groups:
        raise base.LogError(
            "group", f"{path}: no group {group_name!r}; the file has: {', '.join(groups)}"
        )
    if not groups:
        raise base.LogError("header_only", f"{path}: no channel of numbers with data in it")
    if not group_name and len(groups) > 1:
        raise base.LogError(
            "group",
            f"{path}: several groups of channels; say which in the config, options: {{group: ...}}; "
            f"the file has: {', '.join(groups)}",
        )
    return groups[group_name or next(iter(groups))]


def _has_numbers(channel: Any) -> bool:
    """Return whether a channel has values, which are numbers or times."""
    kind = "" if channel.dtype is None else np.dtype(channel.dtype).kind
    return kind in tuple("fiubM") and len(channel) > 0


def _announced_values(content: Any, channels: list[Any]) -> int:
    """Return how many values the longest channel would have if the last segment were complete."""
    statuses = content.file_status.channel_statuses or {}
    announced = [len(channel) for channel in channels]
    for channel in channels:
        if status := statuses.get(channel.path):
            announced.append(len(channel) + int(status.expected_length - status.read_length))
    return max(announced)


def _is_time(channel: Any) -> bool:
    """Return whether the name of a channel says that it holds times."""
    return channel.name.strip().casefold() in _TIME_NAMES


def _unit(channel: Any) -> str:
    """Return the unit of a channel; empty where it states none."""
    return canonical_unit(str(channel.properties.get("unit_string", "")))


def _waveform_clock(channel: Any) -> base.ChannelClock:
    """Return start (since 1970 if it states a date) and step of a waveform, s; the step is NaN where it states none."""
    start = float(channel.properties.get("wf_start_offset", 0.0))
    stamp = channel.properties.get("wf_start_time")
    if stamp is not None:
        start += float(datetimes_to_s(np.asarray(np.datetime64(stamp))))
    step = float(channel.properties.get("wf_increment", 0.0))
    return base.ChannelClock(start, step if step > 0 else np.nan)


def _find_time(
    path: Path, channels: list[Any], size: int, rows: int
) -> tuple[FloatArray | None, str]:
    """Return the time of each row, s, shape (size,), or None, and a note on where it is from.

    Refuses waveforms of several clocks. A channel of times goes before the step of the waveforms. `size`, `rows`:
    Number of complete rows, and of all.
    """
    clocks = {c.name: _waveform_clock(c) for c in channels if not _is_time(c)}
    stated = {name: clock for name, clock in clocks.items() if clock.step > 0}
    if stated:
        other_channels = [name for name in clocks if name not in stated]
        clock = base.common_clock(path, stated, size, other_channels=other_channels, rows=rows)
    for channel in filter(_is_time, channels):
        values = np.asarray(channel[:size])
        note = f"time is the channel {channel.name!r}"
        if values.dtype.kind == "M":
            return datetimes_to_s(values), note
        if _unit(channel) in ("", "s"):
            return values.astype(float), note
    if len(stated) < len(clocks) or not stated:
        return None, "no time: no channel of that name, and not every waveform states its step"
    time: FloatArray = clock.start + clock.step * np.arange(size, dtype=float)
    return time, "time is from the waveform's start and step"
