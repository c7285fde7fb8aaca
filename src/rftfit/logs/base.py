"""What every reader returns, and what a reader is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Self

    from rftfit.conventions import FloatArray


# --- Blocks of a file worked on side by side, and handed on in their order.


Item = TypeVar("Item")
Done = TypeVar("Done")

MOST_WORKERS = 4
"""Beyond this, reading the file is what takes the time."""


def in_order(work: Callable[[Item], Done], items: Iterable[Item]) -> Iterator[Done]:
    """Do the work of some items at a time, on all processors; a single item needs no thread.

    Memory stays bounded: no more items are taken than there are processors to work on them, and
    one besides.

    `work`: Spends its time outside the interpreter's lock; no two calls may disturb each other.
    `items`: Taken one after the other by whoever asks for the results. Yields what `work` makes of
    each item, in the order of `items`.
    """
    items = iter(items)
    first = list(islice(items, 2))
    if len(first) < 2:
        yield from map(work, first)
        return
    from concurrent.futures import Future, ThreadPoolExecutor

    import pyarrow as pa

    workers = min(pa.cpu_count(), MOST_WORKERS)  # as many as OMP_NUM_THREADS allows
    waiting: deque[Future[Done]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for item in chain(first, items):
            waiting.append(pool.submit(work, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


# --- What every reader returns, and what a reader is.


HEAD_BYTES = 65536
"""How much of a file a reader sees when it is asked whether it knows it."""

NO_UNIT = ""
"""The file does not say in which unit a column is: the config has to."""


class LogError(InputError):
    """A log that cannot be used at all.

    Parameters
    ----------
    code : str
        Short stable name of the cause, for ledger and documentation.
    text : str
        What was found and what is allowed.
    rows : int
        Data lines in the file, so that the ledger can account for them.
    """

    def __init__(self, code: str, text: str, rows: int = 0) -> None:
        super().__init__(text)
        self.code = code
        self.rows = rows


@dataclass(frozen=True)
class Log:
    """One log as read: columns of numbers, and what became of every data line.

    Parameters
    ----------
    path : Path
    columns : dict of str to numpy.ndarray
        Name without unit (``time``, ``F1``, ``x``...; for foreign logs the file's own names) to
        values, all of shape (n,), in file order.
    units : dict of str to str
        Unit of each column, as the file states it; `NO_UNIT` where it does not.
    rows : int
        Data lines in the file.
    dropped : dict of str to int
        Reason to number of lines left out; with n they add up to `rows`.
    missing : dict of str to int
        Reason to number of samples that the instrument counted and the file lacks (lost packets).
        They are no lines of the file and not part of `rows`.
    notes : tuple of str
        What should be known of how the numbers came about: where the time is from, for example.
    """

    path: Path
    columns: dict[str, FloatArray]
    units: dict[str, str]
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)
    missing: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        kept = {values.size for values in self.columns.values()}
        if len(kept) != 1 or kept.pop() + sum(self.dropped.values()) != self.rows:
            raise AssertionError(f"{self.path}: rows do not add up")

    @property
    def size(self) -> int:
        """Number of usable rows."""
        return int(next(iter(self.columns.values())).size)

    def take(self, keep: np.ndarray, reason: str) -> Log:
        """Return the log without the rows where `keep` is False.

        Parameters
        ----------
        keep : numpy.ndarray of bool, shape (n,)
        reason : str
            Why the others go; counted in `dropped`.

        Returns
        -------
        Log
            The same object when nothing goes.
        """
        lost = int(keep.size - np.count_nonzero(keep))
        if lost == 0:
            return self
        dropped = added(self.dropped, {reason: lost})
        columns = {name: values[keep] for name, values in self.columns.items()}
        return replace(self, columns=columns, dropped=dropped)


class Reader(ABC):
    """Base of a dialect: give it a `name`, a `describe`, a `detect`, and `load` or `stream`.

    Attributes
    ----------
    name : str
        Under which the registry knows it.
    evidence : str
        By what it is recognised, to complete "recognised by ...".
    asked : frozenset of str or None
        Columns to be read, where a reader can choose; None: all.
    """

    name = ""
    evidence = "its content"
    asked: frozenset[str] | None = None

    def only(self, columns: Collection[str]) -> Self:
        """Return a reader of some columns only: damage to the others, or their clocks, cost nothing.

        Parameters
        ----------
        columns : collection of str

        Returns
        -------
        Reader
        """
        reader = copy(self)
        reader.asked = frozenset(columns)
        return reader

    @abstractmethod
    def describe(self) -> str:
        """Return one line on which program writes such files.

        Returns
        -------
        str
        """

    @abstractmethod
    def detect(self, head: bytes) -> bool:
        """Tell from the beginning of a file whether it is of this dialect.

        Parameters
        ----------
        head : bytes
            The first 64 kB, or all of a shorter file.

        Returns
        -------
        bool
        """

    def with_options(self, options: Mapping[str, object]) -> Reader:
        """Return the reader with the ``options`` of the config.

        Parameters
        ----------
        options : mapping of str to object
            Texts, numbers, true or false.

        Returns
        -------
        Reader
            A new one; this one stays as it is.

        Raises
        ------
        ValueError
            If the dialect has no such option, or not with that value.
        """
        if options:
            raise ValueError(f"the dialect {self.name} has no options, found {', '.join(options)}")
        return self

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in blocks, so that memory stays bounded however long it is.

        Parameters
        ----------
        path : Path

        Yields
        ------
        Log
            The next rows; the same columns and units in each; at least one block.

        Raises
        ------
        LogError
            If the file cannot be used at all.
        """
        yield self.load(path)

    def load(self, path: Path) -> Log:
        """Read a file.

        Parameters
        ----------
        path : Path

        Returns
        -------
        Log

        Raises
        ------
        LogError
            If the file cannot be used at all.
        """
        return join(self.stream(path))

    def load_many(self, paths: Sequence[Path]) -> list[Log | LogError]:
        """Read many files; an unusable one comes back as its error.

        Parameters
        ----------
        paths : sequence of Path

        Returns
        -------
        list of Log or LogError
            In the order of `paths`.
        """
        return [self._try(path) for path in paths]

    def _try(self, path: Path) -> Log | LogError:
        try:
            return self.load(path)
        except LogError as error:
            return error


def added(*counts: Mapping[str, int]) -> dict[str, int]:
    """Add up counts by reason."""
    total: dict[str, int] = {}
    for count in counts:
        for reason, number in count.items():
            total[reason] = total.get(reason, 0) + number
    return total


def join(blocks: Iterable[Log]) -> Log:
    """Put the blocks of one file together.

    `blocks`: At least one, with the same columns and units.
    """
    parts = list(blocks)
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    names = list(first.columns)

    def column(name: str) -> FloatArray:
        # the blocks of a column go as soon as it is joined
        return np.concatenate([part.columns.pop(name) for part in parts])

    columns = dict(zip(names, in_order(column, names), strict=True))
    return Log(
        first.path,
        columns,
        first.units,
        sum(part.rows for part in parts),
        added(*(part.dropped for part in parts)),
        added(*(part.missing for part in parts)),
        tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def text_option(options: Mapping[str, object], name: str, default: str, example: str = "") -> str:
    """Check the options of a dialect whose only one is a text.

    `name`: Of that option. `default`: Where it is not given. `example`: Of such a text, for the
    message.
    """
    others = sorted(set(options) - {name})
    if others:
        raise ValueError(f"found the option {others[0]!r}; allowed: {name}")
    value = options.get(name, default)
    if not isinstance(value, str):
        wanted = f"a text such as {example}" if example else "a text"
        raise ValueError(f"{name}: found {value!r}; allowed: {wanted}")  # noqa: TRY004
    return value


# --- Time where a log has none, or has it as a count: rows at a rate, packets, nanoseconds.


_NS = 1_000_000_000


def ns_to_s(stamps: np.ndarray) -> FloatArray:
    """Turn nanoseconds since 1970 into seconds.

    `stamps`: shape (n,). Returns shape (n,): s; float64 tells 0.2 microseconds apart at today's
    dates.
    """
    stamps = np.asarray(stamps, dtype=np.int64)
    whole = stamps // _NS
    seconds: FloatArray = whole + (stamps - whole * _NS) / _NS
    return seconds


class PacketCount:
    """Numbers that an instrument gives its packets, made continuous over a wrap at 2^32.

    `missing`: Numbers passed over so far that no line of the file can have had.
    """

    def __init__(self) -> None:
        self.missing = 0
        self._last: float | None = None
        self._place = 0
        self._count = 0.0
        self._highest = 0.0

    def follow(self, numbers: FloatArray, places: np.ndarray) -> FloatArray:
        """Go on with the next packets.

        `numbers`: shape (n,); Whole numbers, in the order in which they came. `places`: shape
        (n,); Of their lines among the data lines of the file: a line between them that could not
        be read had a number of its own. Returns shape (n,): Counted from the first packet of the
        file, which is 0.
        """
        if numbers.size == 0:
            return numbers
        if self._last is None:
            self._last, self._place = float(numbers[0]), int(places[0]) - 1
        steps = np.diff(numbers, prepend=self._last)
        if np.abs(steps).max() >= 2.0**31:
            # the shorter way round: 4294967295 is followed by 0
            steps = (steps + 2.0**31) % 2.0**32 - 2.0**31
        count: FloatArray = self._count + np.cumsum(steps)
        highest = np.maximum.accumulate(np.concatenate([[self._highest], count]))
        unread = np.diff(places, prepend=self._place) - 1
        passed = np.maximum(np.diff(highest) - 1 - unread, 0)
        # a packet that comes late was counted as missing when it was passed over
        late = int(np.count_nonzero(steps < 0))
        self.missing = max(self.missing + int(passed.sum()) - late, 0)
        self._last, self._count = float(numbers[-1]), float(count[-1])
        self._place = int(places[-1])
        self._highest = float(highest[-1])
        return count
