"""`Log`, which every reader returns; `Reader`, the base of all readers; and helpers that several readers share.

A *log* is a file in which a program recorded forces or positions of a run; its format is a *dialect*, and each dialect
has a `Reader`. A *data line* is a line (message, packet) of the file that should be a row: each one is either a row of
the `Log`, or counted in it with the reason why it was dropped. A long file is read in *blocks*: a `Log` of some of its
rows each. The *head* is the first 64 kB of a file.
"""

from __future__ import annotations

import errno
import math
import os
import pickle
import re
import signal
import sys
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from rftfit.campaign.config import QUANTITIES
from rftfit.campaign.problems import escaped
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.store.chosen import chosen
from rftfit.table.parse import BLANK, NAN_OR_INFINITE, add_counts, finite_rows

Item = TypeVar("Item")
Result = TypeVar("Result")


NO_VALUE_AT_ALL = "no value in any row"
"""Reason why a column is not read, in `Log.unread`."""

BOUNDS = chosen("logs", "bounds")
"""Largest files, and parts of files, that are read: table ``bounds`` of ``chosen.toml``."""

FIRST = chosen("logs", "first")
"""How many first lines of a file decide what it holds, and by which shares: table ``first`` of ``chosen.toml``."""

HEAD_BYTES = 65536
"""First bytes of a file, from which a reader decides whether the file is in its dialect."""

NO_HANDLE = "no_handle"
"""Code of an error that is no fault of the log: this process or machine has too many open files."""

MOST_UNPACKED: int = BOUNDS.unpacked_bytes
"""Most bytes of a log in memory."""


class LogError(InputError):
    """A log that cannot be used at all; the text says what was found and what is allowed.

    `code`: Short stable name of the cause. `rows`: Number of data lines in the file, for the ledger; 0 where unknown.
    """

    def __init__(self, code: str, text: str, rows: int = 0) -> None:
        # the text may quote names that a stranger has put into the file
        super().__init__(escaped(text))
        self.code = code
        self.rows = rows

    def __reduce__(self) -> tuple[type[LogError], tuple[str, str, int]]:
        """Return class and arguments for pickle, which would call the class with the text alone."""
        return LogError, (self.code, str(self), self.rows)


@dataclass(frozen=True)
class Log:
    """One log as read: columns of numbers, and what became of every data line.

    `columns`: Name without unit (``time``, ``F1``, ``x``...; for logs of other labs the names in the file)
        to values, all of shape (n,), in file order. NaN where the file has no value.
    `units`: Column to its unit as the file states it, in which its values are; empty where the file states none.
    `rows`: Number of data lines in the file.
    `dropped`: Reason to number of lines left out; these numbers and n add up to `rows`.
    `missing`: Reason to number of samples that the instrument counted and the file lacks (lost
        packets); such samples have no line in the file and are not part of `rows`.
    `notes`: Sentences on how the numbers were made: where the time is from, for example.
    `not_finite`: Column to the number of its lines with NaN or an infinite number.
    `unread`: Column of the file that holds no numbers, to its first cell and why it was not read.
    `names_in_file`: Names of all columns in the order of the file, also those that were not read; empty: as `columns`.
    `labels`: Further columns, of words or of whole numbers, which may say where a row is from: texts, shape (n,).
    `unapplied`: Column to a scaling that the file states and that was not applied to its numbers.
    `stretches`: Reason for which rows were left out, to the first and last time of each stretch of such rows.
    `clock_times`: Columns that hold a time of day without a date, in s from midnight.

    Each "X to Y" is a dictionary with X as its keys.
    """

    path: Path
    columns: dict[str, FloatArray]
    units: dict[str, str]
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)
    missing: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    not_finite: dict[str, int] = field(default_factory=dict)
    unread: Mapping[str, str] = field(default_factory=dict)
    names_in_file: tuple[str, ...] = ()
    labels: Mapping[str, np.ndarray] = field(default_factory=dict)
    unapplied: Mapping[str, str] = field(default_factory=dict)
    stretches: Mapping[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    clock_times: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Check that no data line is lost."""
        sizes = {values.size for values in self.columns.values()}
        if len(sizes) != 1 or sizes.pop() + sum(self.dropped.values()) != self.rows:
            raise AssertionError(f"{self.path}: rows do not add up")

    @property
    def size(self) -> int:
        """Number of usable rows."""
        return int(next(iter(self.columns.values())).size)

    def name_of(self, column: str) -> str:
        """Return the name of the third column of the file for ``column 3``; any other name comes back unchanged."""
        return by_number(column, self.names_in_file or self.columns)

    def take(self, keep: np.ndarray, reason: str) -> Log:
        """Return the rows where `keep`, bool of shape (n,), is True; the others are counted under `reason`."""
        lost = int(keep.size - np.count_nonzero(keep))
        if lost == 0:
            return self
        return replace(
            self,
            columns={name: values[keep] for name, values in self.columns.items()},
            dropped=add_counts(self.dropped, {reason: lost}),
            labels={name: labels[keep] for name, labels in self.labels.items()},
        )

    def without_blanks(self, blank: Mapping[str, np.ndarray], *, keeps_blanks: bool) -> Log:
        """Return the log without rows of NaN or infinite numbers, and without rows with a blank cell.

        `blank`: Column to an array of shape (n,), True where the file has no value and this log has NaN; NaN elsewhere
        is damage. `keeps_blanks`: Whether a row with a blank cell stays, with its NaN.
        """
        if blank and not keeps_blanks:
            is_whole = ~np.logical_or.reduce([*blank.values()])
            return self.take(is_whole, BLANK).without_blanks({}, keeps_blanks=True)
        is_good, not_finite = finite_rows(self.columns, blank)
        log = replace(self, not_finite=add_counts(self.not_finite, not_finite))
        return log.take(is_good, NAN_OR_INFINITE)

    def without_blank_columns(self) -> Log:
        """Return the log without the columns that have no value in any row; they are named as not read."""
        if not self.size:
            return self
        blank = {
            name
            for name, values in self.columns.items()
            # the first value alone rules out most columns, which is fast
            if np.isnan(values[0]) and np.isnan(values).all()
        }
        if not blank or blank == self.columns.keys():
            return self
        return replace(
            self,
            columns={name: values for name, values in self.columns.items() if name not in blank},
            units={name: unit for name, unit in self.units.items() if name not in blank},
            unread={**self.unread, **dict.fromkeys(sorted(blank), NO_VALUE_AT_ALL)},
        )


_OPTIONS: dict[str, tuple[Any, str]] = {
    "rate_Hz": (int | float, "a number above 0, in Hz"),
    "sheet": (str | int | float, "a name, a pattern or a number from 1"),
}
"""Option that is more than a text, to its types and what is allowed; all other options are texts."""


class Reader:
    """Base of a dialect: give it a `name`, a `description`, `marks` or a `detect`, and `load` or `stream`.

    `name`: Name of the dialect in the registry and the config.
    `description`: One line on which program writes such files.
    `evidence`: What identifies a file of the dialect, to complete "recognised by ...".
    `marks`: First bytes of its files, any of which is enough for the default of `detect`.
    `takes`: Names of its options, and `options`: the values that the config sets.
    `asked`: Columns to be read, where a reader can choose; None: all. The name of a column, its number (``column 3``),
        or the name of a quantity, which a file may lack.
    `where`: Column to the labels that it has in the rows to be read; other rows are of other sources, such as a
        second sensor.
    `selects`: Whether the dialect supports `where`.
    `keeps_blanks`: Whether rows with a cell that has no value are returned, with NaN there.

    A reader never changes: methods that set something return a changed copy.
    """

    name = ""
    description = ""
    evidence = "its content"
    marks: tuple[bytes, ...] = ()
    takes: tuple[str, ...] = ()
    options: Mapping[str, Any] = {}  # never changed, only replaced
    asked: frozenset[str] | None = None
    keeps_blanks = True
    where: Mapping[str, tuple[str, ...]] = {}
    selects = False

    def of_source(self, where: Mapping[str, tuple[str, ...]]) -> Self:
        """Return a reader of the rows that `where` chooses; raises ValueError if the dialect does not support it."""
        if where and not self.selects:
            raise ValueError(f"the dialect {self.name} has no rows of several sources")
        return self._changed(where=where)

    def only(self, columns: Collection[str], *, keeps_blanks: bool = False) -> Self:
        """Return a reader of these `columns` alone, so that damage or another clock in other columns does no harm.

        A row with a blank cell in one of the `columns` is left out, unless `keeps_blanks`.
        """
        return self._changed(asked=frozenset(columns), keeps_blanks=keeps_blanks)

    def choose_columns(self, names: Collection[str]) -> Collection[str]:
        """Return the columns to be read: those asked for, or all `names` where one asked for is not among them.

        With all columns, the caller can name in its message the columns that the file has.
        """
        if self.asked is None:
            return names
        asked = self.asked_among(names)
        # a quantity that the file lacks is no mistake in the config: it is asked for by default
        return names if asked.difference(names, QUANTITIES) else asked

    def asked_among(self, names: Collection[str]) -> set[str]:
        """Return the columns asked for, as a file with the columns `names` calls them; empty where all are wanted.

        Names that the file lacks are among them.
        """
        return {by_number(name, names) for name in self.asked or ()}

    def check_asked(
        self, path: Path, unread: Mapping[str, str], names: Collection[str] = ()
    ) -> None:
        """Raise `LogError` if a column that is asked for is `unread`: column to the reason; `names`: all columns."""
        asked = self.asked_among(names)
        # all quantities are asked for, even where the file lacks them; only the time is always needed
        asked.difference_update({*QUANTITIES} - {"time"})
        if lost := [f"{name!r}: {why}" for name, why in unread.items() if name in asked]:
            raise LogError("columns", f"{path}: found no numbers in the column {'; '.join(lost)}")

    def describe(self) -> str:
        """Return the description."""
        return self.description

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB, or by all of a shorter file."""
        return head.startswith(self.marks)

    def with_options(self, options: Mapping[str, object]) -> Self:
        """Return a new reader with the ``options`` of the config: texts, numbers, true or false.

        Raises ValueError if the dialect has no such option, or not with that value.
        """
        for name, value in options.items():
            if name not in self.takes:
                allowed = ", ".join(self.takes) or f"none: the dialect {self.name} has no options"
                raise ValueError(f"found the option {name!r}; allowed: {allowed}")
            types, allowed_values = _OPTIONS.get(name, (str, "a text"))
            if (
                isinstance(value, bool)  # which would count as an int
                or not isinstance(value, types)
                or (name == "rate_Hz" and not 0 < value < 1e9)
            ):
                raise ValueError(f"{name}: found {value!r}; allowed: {allowed_values}")
        return self._changed(options=options)

    def _changed(self, **attributes: object) -> Self:
        """Return a copy of this reader with other values of the named `attributes`."""
        reader = copy(self)
        vars(reader).update(attributes)
        return reader

    @property
    def rate(self) -> float | None:
        """Rows a second, Hz, as the config states it; None where it does not."""
        return self.options.get("rate_Hz")

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in blocks of the same columns and units, at least one, so that memory stays bounded.

        Raises `LogError` if the file cannot be used at all.
        """
        yield self.load(path)

    def load(self, path: Path) -> Log:
        """Read a file as a whole; raises `LogError` if it cannot be used at all."""
        log = join_blocks(self.stream(path))
        return log.without_blank_columns() if self.keeps_blanks else log


_BY_NUMBER = re.compile(r"(?:column )?([1-9]\d*)")
"""Name of a column by its number, from 1."""


def by_number(column: str, names: Collection[str]) -> str:
    """Return the third of the `names` for ``column 3`` or ``3``; one of them, or too large a number, unchanged."""
    number = None if column in names else _BY_NUMBER.fullmatch(column)
    if number is None or int(number[1]) > len(names):
        return column
    return [*names][int(number[1]) - 1]


def most_frequent(numbers: Sequence[int]) -> int:
    """Return the most frequent number, the larger one of several; 0 where there is none."""
    return max(set(numbers), key=lambda number: (numbers.count(number), number), default=0)


def join_blocks(blocks: Iterable[Log]) -> Log:
    """Join the blocks of one file, at least one, to one log; several blocks lose their columns, to save memory.

    Counts are added up; what all blocks have in common, as units and path, is taken from the first.
    """
    logs = list(blocks)
    first = logs[0]
    if len(logs) == 1:
        return first
    names = list(first.columns)
    # the blocks of a column are freed as soon as it is joined
    joined = parallel_map(
        lambda name: np.concatenate([log.columns.pop(name) for log in logs]), names
    )
    return replace(
        first,
        columns=dict(zip(names, joined, strict=True)),
        rows=sum(log.rows for log in logs),
        dropped=add_counts(*(log.dropped for log in logs)),
        missing=add_counts(*(log.missing for log in logs)),
        notes=tuple(dict.fromkeys(note for log in logs for note in log.notes)),
        not_finite=add_counts(*(log.not_finite for log in logs)),
        labels={name: np.concatenate([log.labels[name] for log in logs]) for name in first.labels},
    )


MOST_WORKERS: int = BOUNDS.threads
"""Most threads that parse at once."""


def parallel_map(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield `work` of each item in the order of the items, computed by several threads.

    Memory stays bounded: at most one item more than there are threads is held at a time. Threads are faster only
    where `work` releases the interpreter's lock; a single item is worked on without a thread.
    """
    items = iter(items)
    first_two = list(islice(items, 2))
    if len(first_two) < 2:
        yield from map(work, first_two)
        return
    from concurrent.futures import ThreadPoolExecutor

    import pyarrow as pa

    workers = min(pa.cpu_count(), MOST_WORKERS)  # as many as OMP_NUM_THREADS allows
    waiting: deque[Future[Result]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for item in chain(first_two, items):
            waiting.append(pool.submit(work, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


@contextmanager
def needed_package(path: Path, what: str, package: str, extra: str) -> Iterator[None]:
    """Turn an ImportError into a `LogError` that says how to install the package that reads `what`."""
    try:
        yield
    except ImportError:
        text = f"{path}: {what} are read with the package {package}; install it: "
        raise LogError("extra", f'{text}pip install "rftfit[{extra}]"') from None


_SYSTEM_ERRNOS = (
    errno.ENOENT,
    errno.EMFILE,
    errno.ENFILE,
    errno.EACCES,
    errno.EPERM,
    errno.EISDIR,
    errno.EIO,
)
"""Errors of the operating system that do not come from the content of a file: no file, no access, no handle, a bad disk."""


@contextmanager
def library_errors(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a library raises on a file in the block into a `LogError`; `what`: the words for a damaged file.

    An error of the operating system, as for a file without access, is reported as such.
    """
    try:
        yield
    except (LogError, GeneratorExit):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _SYSTEM_ERRNOS:
            raise system_refusal(path, error) from error
        raise LogError("damaged", f"{path}: {what}: {on_one_line(error)}") from error


def system_refusal(path: Path, error: OSError) -> LogError:
    """Make the error for a file that is not there, or that the operating system does not let us read.

    Too many open files get a code of their own, since they are no fault of the log.
    """
    if isinstance(error, FileNotFoundError):
        return LogError("missing", f"{path}: log missing")
    code = NO_HANDLE if error.errno in (errno.EMFILE, errno.ENFILE) else "unreadable"
    return LogError(code, f"{path}: cannot be read: {error.strerror}")


def on_one_line(error: Exception) -> str:
    """Return the text of an error on one line, escaped: it may quote control characters from a stranger's file."""
    return escaped(" ".join(str(error).split())[:300]) or type(error).__name__


@contextmanager
def file_errors(path: Path) -> Iterator[None]:
    """Turn errors of the file system in the block into a `LogError`."""
    try:
        yield
    except OSError as error:
        raise system_refusal(path, error) from error


def run_in_child(path: Path, work: Callable[[Path], Result]) -> Result:
    """Return what `work` returns for a file, computed in a child process, or raise what it raises.

    A damaged file may make a C library crash, which then ends the child alone. Results must be picklable. Where
    processes cannot be forked, this process does the work.

    Raises
    ------
    LogError
        If a signal ended the process, as after too much processor time.
    """
    if not hasattr(os, "fork"):
        return work(path)
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            _send_result(write_end, path, work)
        finally:
            os._exit(0)
    os.close(write_end)
    result: Result | Exception | None
    try:
        with os.fdopen(read_end, "rb") as results:
            result = pickle.load(results)  # noqa: S301  # of this program
    except (EOFError, pickle.UnpicklingError):
        result = None
    finally:
        _, status = os.waitpid(child, 0)
    if result is None:
        cause = f"status {status}"
        if os.WIFSIGNALED(status):
            cause = signal.Signals(os.WTERMSIG(status)).name
        result = LogError(
            "damaged", f"{path}: damaged: it ends the library that reads it ({cause})"
        )
    # errors are sent as results, too
    if isinstance(result, Exception):
        raise result
    return result


def _send_result(write_end: int, path: Path, work: Callable[[Path], object]) -> None:
    """Do the `work` in the child process, within a limit of processor time, and send its result or its error.

    `write_end`: File descriptor of a pipe, into which a pickle is written.
    """
    import resource

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (BOUNDS.cpu_s, resource.RLIM_INFINITY))
    try:
        result = work(path)
    except LogError as error:
        result = error
    except Exception as error:  # noqa: BLE001  # a library may raise anything, also what cannot be pickled
        result = ValueError(on_one_line(error))
    with os.fdopen(write_end, "wb") as results:
        pickle.dump(result, results, pickle.HIGHEST_PROTOCOL)


_MEMORY_LIMIT_LOCK = Lock()
"""Held while the memory limit of this process is changed: threads would restore the limits of each other."""


@contextmanager
def limited_memory(extra_bytes: int) -> Iterator[None]:
    """Limit this process to `extra_bytes` more memory than it has now; only on Linux.

    Some libraries allocate as much memory as a damaged file states. Use it briefly: all threads are limited.
    """
    if sys.platform != "linux":
        yield
        return
    import resource

    with _MEMORY_LIMIT_LOCK:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        limit = pages * resource.getpagesize() + extra_bytes
        before = resource.getrlimit(resource.RLIMIT_AS)
        if before[0] != resource.RLIM_INFINITY:
            limit = min(limit, before[0])
        resource.setrlimit(resource.RLIMIT_AS, (limit, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_AS, before)


def refuse_large_file(path: Path, most: int = BOUNDS.whole_file_bytes) -> None:
    """Raise `LogError` for a file of more than `most` bytes; the default is for files that are read as a whole."""
    if path.stat().st_size > most:
        raise LogError("too_large", f"{path}: larger than {most >> 20} MB; split it")


def check_unpacked(path: Path, size: float) -> None:
    """Raise `LogError` for more than `MOST_UNPACKED` bytes of content (`size`): a small file can unpack to any size."""
    if size > MOST_UNPACKED:
        sizes = f"{size / 1e6:.0f} MB or more when unpacked; allowed: {MOST_UNPACKED / 1e6:.0f} MB"
        raise LogError("too_large", f"{path}: {sizes}: export only the columns of one run")


class PacketCount:
    """Sequence numbers of an instrument's packets, made continuous over a wrap at 2^32.

    The number of a packet gives its time even after lost packets. `reason`: Key of the missing packets in
    `Log.missing`.
    `missing`: Number of packets lost so far: sequence numbers that were skipped and that no unreadable line of the file
    can have had. The state after one block of the file is kept for the next.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.missing = 0
        # of the last packet: sequence number, data line, and number from the first packet on; and the highest of these
        self._last: float | None = None
        self._line = 0
        self._count = 0.0
        self._highest = 0.0

    def follow(self, numbers: FloatArray, lines: np.ndarray) -> FloatArray:
        """Return the numbers of the next packets, counted from the first packet of the file, which has number 0.

        `numbers`, `lines`: Sequence number of each packet, and number of its data line in the file, shape (n,):
        an unreadable line in between had a packet, too, which is not lost. Adds lost packets to `missing`.
        """
        if numbers.size == 0:
            return numbers
        if self._last is None:
            self._last, self._line = float(numbers[0]), int(lines[0]) - 1
        # from packet to packet; a step of 2 is a lost packet, a negative one a late packet
        steps = np.diff(numbers, prepend=self._last)
        if np.abs(steps).max() >= 2.0**31:
            # the shorter way round: 4294967295 is followed by 0
            steps = (steps + 2.0**31) % 2.0**32 - 2.0**31
        count: FloatArray = self._count + np.cumsum(steps)
        # numbers above the highest so far count as missing, unless they are those of unreadable lines in between
        highest = np.maximum.accumulate(np.concatenate([[self._highest], count]))
        unreadable_lines = np.diff(lines, prepend=self._line) - 1
        skipped = np.maximum(np.diff(highest) - 1 - unreadable_lines, 0)
        # a late packet was counted as missing when a higher number came before it
        late = int(np.count_nonzero(steps < 0))
        self.missing = max(self.missing + int(skipped.sum()) - late, 0)
        self._last, self._count = float(numbers[-1]), float(count[-1])
        self._line, self._highest = int(lines[-1]), float(highest[-1])
        return count


# --- Whether the channels of a file were sampled at the same times, as the columns of one log must be


SAME_S = 1e-6
"""Times closer than this are the same, s: files state the start of a channel to the microsecond."""


class MixedClocksError(LogError):
    """A log with more than one clock, so that its rows have no common time.

    `listed_clocks`: The clocks, in words. `groups`: The names of the channels that share a clock, one group a clock.
    """

    def __init__(
        self, path: Path, listed_clocks: str, groups: Sequence[Sequence[str]], rows: int = 0
    ) -> None:
        super().__init__(
            "clocks",
            f"{path}: its channels were not sampled at the same times, and a log has one time: found "
            f"{listed_clocks}. Name those of one clock under force_log.columns and those of the other under "
            "motion_log.columns, or export them on one clock",
            rows,
        )
        self.groups = groups


class ChannelClock(NamedTuple):
    """When a channel was sampled: time of its first sample, and step between samples, s; NaN where not stated."""

    start: float
    step: float

    def same(self, other_clock: ChannelClock, samples: int) -> bool:
        """Return whether the first `samples` samples of two channels were taken at the same times."""
        both_unknown = math.isnan(self.start) and math.isnan(other_clock.start)
        start_difference = 0.0 if both_unknown else abs(self.start - other_clock.start)
        # false where one start is unknown, and the difference NaN
        return start_difference + samples * abs(self.step - other_clock.step) <= SAME_S


def common_clock(
    path: Path,
    clocks: Mapping[str, ChannelClock],
    samples: int,
    *,
    other_channels: Iterable[str] = (),
    rows: int = 0,
) -> ChannelClock:
    """Return the clock that all channels share over the first `samples` samples.

    Raises `MixedClocksError` if there are several. `clocks`: Channel to its clock. `other_channels`: Channels whose
    clock is not stated; a refused log names them as one more group. `rows`: Number of data lines, for the refusal.
    """
    # the first channel of each clock, to all channels of this clock
    channels_by_first: dict[str, list[str]] = {}
    for name, clock in clocks.items():
        same = (first for first in channels_by_first if clocks[first].same(clock, samples))
        channels_by_first.setdefault(next(same, name), []).append(name)
    groups = list(channels_by_first.values())
    if len(groups) == 1:
        return clocks[groups[0][0]]
    zero = min((c.start for c in clocks.values() if not math.isnan(c.start)), default=0.0)
    listed_clocks = "; ".join(
        f"{name!r} from {round(clock.start - zero, 6):.12g} s, every {clock.step:.9g} s"
        for name, clock in clocks.items()
    )
    unclear = [list(other_channels)] if other_channels else []
    raise MixedClocksError(path, listed_clocks, [*groups, *unclear], rows)
