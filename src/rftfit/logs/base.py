"""What every reader returns, and what a reader is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.logs.ahead import in_order

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from rftfit.conventions import FloatArray

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
    """

    name = ""
    evidence = "its content"

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
    """Add up counts by reason.

    Parameters
    ----------
    *counts : mapping of str to int

    Returns
    -------
    dict of str to int
    """
    total: dict[str, int] = {}
    for count in counts:
        for reason, number in count.items():
            total[reason] = total.get(reason, 0) + number
    return total


def join(blocks: Iterable[Log]) -> Log:
    """Put the blocks of one file together.

    Parameters
    ----------
    blocks : iterable of Log
        At least one, with the same columns and units.

    Returns
    -------
    Log
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

    Parameters
    ----------
    options : mapping of str to object
    name : str
        Of that option.
    default : str
        Where it is not given.
    example : str, optional
        Of such a text, for the message.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If there is any other option, or it is no text.
    """
    others = sorted(set(options) - {name})
    if others:
        raise ValueError(f"found the option {others[0]!r}; allowed: {name}")
    value = options.get(name, default)
    if not isinstance(value, str):
        wanted = f"a text such as {example}" if example else "a text"
        raise ValueError(f"{name}: found {value!r}; allowed: {wanted}")  # noqa: TRY004
    return value
