"""National Instruments TDMS files: one channel a column, time from the waveform's step."""

from __future__ import annotations

import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.logs.base import Log, LogError, Reader, text_option
from rftfit.logs.channels import Clock, one_clock
from rftfit.logs.units import unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from rftfit.conventions import FloatArray

CUT = "cut in mid-segment"
INSTALL = 'pip install "rftfit[tdms]"'

_MAX_BYTES = 2 << 30
_TIME_NAMES = ("time", "t", "timestamp", "elapsed time", "zeit")


class TdmsReader(Reader):
    """LabVIEW and DAQmx recordings.

    `group`: Which group of channels; by default the only one.
    """

    name = "tdms"
    evidence = "the first bytes TDSm"

    def __init__(self, group: str = "") -> None:
        self.group = group

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "National Instruments TDMS, as LabVIEW and DAQmx write it"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return head.startswith(b"TDSm")

    def with_options(self, options: Mapping[str, object]) -> TdmsReader:
        """Return the reader of one group of channels.

        `options`: ``group``: which one, where a file has several.
        """
        return TdmsReader(text_option(options, "group", self.group))

    def load(self, path: Path) -> Log:
        """Read one group of channels.

        Returns columns by the channels' names; ``time`` from a channel of that name or from start
        and step of the waveform, where there is either.
        """
        try:
            from nptdms import TdmsFile
        except ImportError:
            raise LogError(
                "extra",
                f"{path}: TDMS files are read with the package npTDMS; install it: {INSTALL}",
            ) from None
        try:
            if path.stat().st_size > _MAX_BYTES:
                raise LogError("too_large", f"{path}: larger than {_MAX_BYTES >> 30} GB; split it")
            with _silent():
                # the index file beside it may be of another day
                with path.open("rb") as file:
                    content = TdmsFile.read(file)
                return _log(path, content, self.group, self.asked)
        except LogError:
            raise
        except FileNotFoundError:
            raise LogError("missing", f"{path}: log missing") from None
        except OSError as error:
            raise LogError("unreadable", f"{path}: cannot be read: {error.strerror}") from error
        except Exception as error:  # the library has no error class of its own
            raise LogError("damaged", f"{path}: damaged, or no TDMS file: {error}") from error


@contextmanager
def _silent() -> Iterator[None]:
    """Keep the library from printing what the ledger says better."""
    from nptdms.log import log_manager

    before = logging.getLogger("nptdms.reader").level
    log_manager.set_level(logging.CRITICAL)
    try:
        yield
    finally:
        log_manager.set_level(before)


def _log(path: Path, content: Any, wanted: str, asked: frozenset[str] | None) -> Log:
    groups = {
        group.name: [channel for channel in group.channels() if _is_number(channel)]
        for group in content.groups()
    }
    groups = {name: channels for name, channels in groups.items() if channels}
    if wanted and wanted not in groups:
        raise LogError("group", f"{path}: no group {wanted!r}; the file has: {', '.join(groups)}")
    if not groups:
        raise LogError("header_only", f"{path}: no channel of numbers with data in it")
    if not wanted and len(groups) > 1:
        raise LogError(
            "group",
            f"{path}: several groups of channels; say which in the config, options: {{group: ...}}; "
            f"the file has: {', '.join(groups)}",
        )
    channels = _chosen(groups[wanted or next(iter(groups))], asked)
    expected = _expected(content, channels)
    size = min(len(channel) for channel in channels)
    lengths = sorted({len(channel) for channel in channels})
    incomplete = content.file_status.incomplete_final_segment
    if lengths[-1] - lengths[0] > 0 and not incomplete:
        raise LogError(
            "lengths",
            f"{path}: channels of {lengths[0]} to {lengths[-1]} values in one group: they were not "
            "sampled together",
            lengths[-1],
        )
    rows = max(lengths[-1], expected, size + 1 if incomplete else 0)
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    time, note = _time(path, channels, size, rows)
    if time is not None:
        columns["time"], units["time"] = time, "s"
    for channel in channels:
        name = channel.name if channel.name != "time" or time is None else "time (channel)"
        columns[name] = _numbers(channel, size)
        units[name] = unit_word(str(channel.properties.get("unit_string", "")))
    dropped = {CUT: rows - size} if rows > size else {}
    return Log(path, columns, units, rows, dropped, {}, (note,))


def _is_number(channel: Any) -> bool:
    return (
        channel.dtype is not None and np.dtype(channel.dtype).kind in "fiubM" and len(channel) > 0
    )


def _numbers(channel: Any, size: int) -> FloatArray:
    values = np.asarray(channel[:])[:size]
    if values.dtype.kind == "M":
        return _epoch(values)
    return np.asarray(values, dtype=float)


def _epoch(stamps: np.ndarray) -> FloatArray:
    return np.asarray(stamps.astype("datetime64[ns]").astype(np.int64) / 1e9, dtype=float)


def _expected(content: Any, channels: list[Any]) -> int:
    """Values that the last segment should have brought the longest channel to."""
    most = 0
    for channel in channels:
        status = content.file_status.channel_statuses
        own = status.get(channel.path) if status else None
        lost = own.expected_length - own.read_length if own is not None else 0
        most = max(most, len(channel) + int(lost))
    return most


def _chosen(channels: list[Any], asked: frozenset[str] | None) -> list[Any]:
    """Return the channels that are asked for, and time; all where one of them is not there."""
    chosen = [c for c in channels if asked is None or c.name in asked]
    absent = (asked or frozenset()).difference((c.name for c in channels), QUANTITIES)
    if absent or not chosen:
        return channels
    return [c for c in channels if c in chosen or _is_time(c)]


def _is_time(channel: Any) -> bool:
    return channel.name.strip().casefold() in _TIME_NAMES


def _clock(channel: Any) -> Clock:
    """Start and step of a waveform; NaN where it states none."""
    start = float(channel.properties.get("wf_start_offset", 0.0))
    stamp = channel.properties.get("wf_start_time")
    if stamp is not None:
        start += float(_epoch(np.array([np.datetime64(stamp)]))[0])
    step = float(channel.properties.get("wf_increment", 0.0))
    return Clock(start, step if step > 0 else np.nan)


def _time(path: Path, channels: list[Any], size: int, rows: int) -> tuple[FloatArray | None, str]:
    """Time in s, and where it is from."""
    clocks = {c.name: _clock(c) for c in channels if not _is_time(c)}
    stated = {name: clock for name, clock in clocks.items() if clock.step > 0}
    if stated:
        clock = one_clock(path, stated, size, rows)
    for channel in channels:
        if _is_time(channel):
            values = np.asarray(channel[:size])
            unit = unit_word(str(channel.properties.get("unit_string", "")))
            if values.dtype.kind == "M":
                return _epoch(values), f"time is the channel {channel.name!r}"
            if unit in ("", "s"):
                return values.astype(float), f"time is the channel {channel.name!r}"
    if len(stated) < len(clocks) or not stated:
        return None, "no time: no channel of that name, and not every waveform states its step"
    time: FloatArray = clock.start + clock.step * np.arange(size, dtype=float)
    return time, "time is from the waveform's start and step"
