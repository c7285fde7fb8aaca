"""What readers of text have in common: a header that tells the layout, then rows, block after block."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rftfit.campaign.sources import QUANTITIES
from rftfit.logs.ahead import in_order
from rftfit.logs.base import Log, LogError, Reader, join
from rftfit.logs.cells import Parser
from rftfit.logs.lines import TextFile
from rftfit.logs.regrouped import regrouped

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping
    from pathlib import Path
    from typing import Self

    import numpy as np

    from rftfit.logs.layout import Layout, Rows
    from rftfit.logs.timing import PacketCount

Derive = Callable[["dict[str, np.ndarray]", "np.ndarray"], "dict[str, np.ndarray]"]

_REGROUPED = (
    "{}: numbers with two decimal commas: a spreadsheet has regrouped the digits of this column, so "
    "most of its rows cannot be told; export it again with decimal points, or do not name the column"
)


@dataclass(frozen=True)
class Plan:
    """How one file is to be read, as its header says.

    Parameters
    ----------
    layout : Layout
    units : dict of str to str
        Of the columns that come out, as far as the file states them.
    start : int
        Where in the head the rows begin.
    derive : callable, optional
        Makes the columns that come out, ``time`` in s among them, of those of a block and of the
        place of each row among the data lines of the file.
    packets : PacketCount, optional
        Counts what was lost, for `missing`.
    lost : str
        What to call that.
    keep : frozenset of str
        Columns that are read even where nobody asks for them.
    drop : frozenset of str
        Columns that are read and not handed on.
    same : tuple of str
        Name of the column of kind "same", and the reason why a row where it is not goes; or empty.
    notes : tuple of str
    """

    layout: Layout
    units: dict[str, str]
    start: int
    derive: Derive | None = None
    packets: PacketCount | None = None
    lost: str = ""
    keep: frozenset[str] = frozenset()
    drop: frozenset[str] = frozenset()
    same: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())


class _RegroupedError(Exception):
    """Digits were regrouped: all of the file has to be seen before any row can be trusted."""


class TextReader(Reader):
    """Base of the dialects of text: a `plan` for each file is all they need.

    Attributes
    ----------
    asked : frozenset of str or None
        Columns to be read; None: all.
    """

    asked: frozenset[str] | None = None

    def only(self, columns: Collection[str]) -> Self:
        """Return a reader of some columns only: damage to the others costs no rows.

        Parameters
        ----------
        columns : collection of str

        Returns
        -------
        TextReader
        """
        reader = copy(self)
        reader.asked = frozenset(columns)
        return reader

    @abstractmethod
    def plan(self, head: bytes) -> Plan:
        """Find out how a file is to be read.

        Parameters
        ----------
        head : bytes
            The first 64 kB.

        Returns
        -------
        Plan

        Raises
        ------
        ValueError
            If it cannot be read that way; the message says what was found and what is allowed.
        """

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in blocks of some megabytes.

        Parameters
        ----------
        path : Path

        Yields
        ------
        Log

        Raises
        ------
        LogError
            If the file cannot be used at all.
        """
        yield from self._blocks(path, twice=True)

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
        try:
            return join(self._blocks(path, twice=False))
        except _RegroupedError:
            return join(self._blocks(path, twice=True))

    def _blocks(self, path: Path, *, twice: bool) -> Iterator[Log]:
        """Read block after block; `twice`: look through the whole file for regrouped digits first."""
        file = TextFile(path)
        try:
            plan = self.plan(file.head)
        except LogError as error:
            raise LogError(error.code, f"{path}: {error}", error.rows) from None
        except ValueError as error:
            raise LogError("header", f"{path}: {error}") from None
        layout = self._narrowed(plan)
        doubtful: frozenset[int] = frozenset()
        if twice and layout.decimal == ",":
            doubtful = regrouped(layout, (b for b, _ in TextFile(path).blocks(plan.start)))
        parser = Parser(layout, doubtful)
        notes = tuple(_REGROUPED.format(layout.names[place]) for place in sorted(doubtful))
        plan = replace(plan, notes=plan.notes + notes)
        first = 0
        blocks = file.blocks(plan.start)
        for rows in in_order(lambda block: parser.parse(block.body, block.rest), blocks):
            if parser.surprised and not twice:
                raise _RegroupedError
            if rows.rows:
                yield _log(path, plan, rows, first)
            first += rows.rows
        if first == 0:
            raise LogError("header_only", f"{path}: a header and no data")

    def _narrowed(self, plan: Plan) -> Layout:
        layout = plan.layout
        if self.asked is None:
            return layout
        kept = self.asked | plan.keep
        kinds = tuple(
            kind if name in kept else "skip"
            for name, kind in zip(layout.names, layout.kinds, strict=True)
        )
        narrow = replace(layout, kinds=kinds)
        # of a file that lacks one of them, all: whoever asked finds out which columns there are
        absent = self.asked.difference(layout.names, QUANTITIES)
        return layout if absent or not narrow.wanted else narrow


def _log(path: Path, plan: Plan, rows: Rows, first: int) -> Log:
    before = plan.packets.missing if plan.packets else 0
    index = rows.index + first if first else rows.index
    columns = plan.derive(rows.columns, index) if plan.derive else rows.columns
    missing = {}
    if plan.packets:
        lost = plan.packets.missing - before
        missing = {plan.lost: lost} if lost > 0 else {}
    good = replace(rows, columns=columns)
    if plan.same:
        name, reason = plan.same
        good = good.take(columns[name].astype(bool), reason)
    out = {
        name: c.astype(float, copy=False)
        for name, c in good.columns.items()
        if name not in plan.drop
    }
    derived = {"time": "s"} if plan.derive else {}
    units = {name: derived.get(name) or plan.units.get(name, "") for name in out}
    return Log(path, out, units, rows.rows, good.dropped, missing, plan.notes)


def rate_option(options: Mapping[str, object], name: str) -> float | None:
    """Check the options of a dialect that can be told its rate.

    Parameters
    ----------
    options : mapping of str to object
    name : str
        Of the dialect.

    Returns
    -------
    float or None
        Hz.

    Raises
    ------
    ValueError
        If there is any other option, or the rate is no positive number.
    """
    others = sorted(set(options) - {"rate_Hz"})
    if others:
        raise ValueError(f"the dialect {name} has the option rate_Hz only, found {others[0]}")
    rate = options.get("rate_Hz")
    if rate is None:
        return None
    if isinstance(rate, bool) or not isinstance(rate, int | float) or not 0 < rate < 1e9:
        raise ValueError(f"rate_Hz: found {rate!r}; allowed: a number above 0, in Hz")
    return float(rate)
