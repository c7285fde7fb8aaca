"""What every reader returns, and what a reader is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rftfit.conventions import FloatArray


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
        Name without unit (``time``, ``F1``, ``x``...) to values, all of shape (n,), in file order.
    units : dict of str to str
        Unit of each column, as the file states it.
    rows : int
        Data lines in the file.
    dropped : dict of str to int
        Reason to number of lines left out; with n they add up to `rows`.
    """

    path: Path
    columns: dict[str, FloatArray]
    units: dict[str, str]
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kept = {values.size for values in self.columns.values()}
        if len(kept) != 1 or kept.pop() + sum(self.dropped.values()) != self.rows:
            raise AssertionError(f"{self.path}: rows do not add up")

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
        dropped = dict(self.dropped)
        dropped[reason] = dropped.get(reason, 0) + lost
        columns = {name: values[keep] for name, values in self.columns.items()}
        return Log(self.path, columns, self.units, self.rows, dropped)


class Dialect(Protocol):
    """A reader of one kind of log file.

    Attributes
    ----------
    name : str
        Under which the registry knows it.
    """

    name: str

    def describe(self) -> str:
        """Return one line on which program writes such files.

        Returns
        -------
        str
        """
        ...

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
        ...

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
        ...

    def load_many(self, paths: Sequence[Path]) -> list[Log | LogError]:
        """Read many files at once; an unusable one comes back as its error.

        Parameters
        ----------
        paths : sequence of Path

        Returns
        -------
        list of Log or LogError
            In the order of `paths`.
        """
        ...
