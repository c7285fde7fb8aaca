"""Any delimited text, described in a few lines of the config."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

from rftfit.logs.layout import Layout, cells_of
from rftfit.logs.lines import lines_of
from rftfit.logs.sniff import kinds_of
from rftfit.logs.textlog import Plan, TextReader
from rftfit.logs.unitwords import split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from rftfit.campaign.sources import TextFormat
    from rftfit.logs.lines import Line

_CHARACTERS = {"tab": "\t", "blank": " ", "bar": "|"}


class DelimitedReader(TextReader):
    """Text as the section `text` of the config describes it; it claims no file by itself."""

    name = "delimited"
    evidence = "the section `text` of the config"

    def __init__(self) -> None:
        self._format: TextFormat | None = None

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "any delimited text, described by `text` in the config"

    def detect(self, head: bytes) -> bool:  # noqa: ARG002  # a description decides, not the file
        """Tell that no file is of this dialect by itself.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
            False.
        """
        return False

    def described(self, text: TextFormat) -> DelimitedReader:
        """Return a reader of the format that is described.

        Parameters
        ----------
        text : TextFormat

        Returns
        -------
        DelimitedReader
        """
        reader = copy(self)
        reader._format = text
        return reader

    def plan(self, head: bytes) -> Plan:
        """Find the header rows where the description says they are.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        Plan

        Raises
        ------
        ValueError
            If they are not there.
        """
        text = self._format
        if text is None:
            raise ValueError("the dialect delimited needs `text` in the config: the format")
        delimiter = _CHARACTERS.get(text.delimiter, text.delimiter)
        lines = [
            line
            for place, line in enumerate(lines_of(head, text.skip_lines + 400, text.encoding))
            if place >= text.skip_lines and _counts(line, text.comment)
        ]
        start = _start(head, text.skip_lines)
        names: tuple[str, ...] = ()
        units: list[str] = []
        given: list[str] = []
        if text.names:
            if not lines or not lines[0].whole:
                raise ValueError(
                    f"no row of names below the first {text.skip_lines} lines (skip_lines)"
                )
            first = lines.pop(0)
            given = _cells(first, delimiter)
            split = [split_unit(cell) for cell in given]
            names, units = unique([name for name, _ in split]), [unit for _, unit in split]
            start = first.stop
        if text.units:
            if not lines or not lines[0].whole:
                raise ValueError("no row of units below the row of names (units: true)")
            second = lines.pop(0)
            units = [unit_word(cell) for cell in _cells(second, delimiter)]
            start = second.stop
        rows = [_cells(line, delimiter) for line in lines[:40] if line.whole]
        width = _width(rows, len(names), len(names) - bool(given and not given[-1].strip()))
        names = unique([*names, *[""] * (width - len(names))][:width])
        units = [*units, *[""] * width][:width]
        rate = text.rate_Hz
        at = start

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            return {**columns, "time": index / rate} if rate else columns

        return Plan(
            Layout(
                names,
                kinds_of(head, at, width, delimiter, text.decimal),
                delimiter,
                text.decimal,
                quote=delimiter != " ",
                comment=text.comment,
            ),
            dict(zip(names, units, strict=True)),
            start,
            derive if rate else None,
            notes=(f"time is the row number / {rate:g} Hz (the config)",) if rate else (),
        )


def _counts(line: Line, comment: str) -> bool:
    text = line.text.strip()
    return bool(text) and not (comment and text.startswith(comment))


def _start(head: bytes, skip: int) -> int:
    lines = lines_of(head, skip) if skip else []
    return lines[-1].stop if lines else 0


def _cells(line: Line, delimiter: str) -> list[str]:
    return cells_of(line.text, delimiter, quote=delimiter != " ") or line.text.split(delimiter)


def _width(rows: Sequence[list[str]], most: int, least: int) -> int:
    """Cells of a row: as many as there are names, but for a delimiter at the end of either."""
    if not rows:
        return max(most, 1)
    widths = [len(cells) for cells in rows]
    usual = max(set(widths), key=lambda number: (widths.count(number), number))
    if not most or usual == most or most in widths:
        return most or usual
    blank = all(not cells[-1].strip() for cells in rows if len(cells) == most + 1)
    if usual == least or (usual == most + 1 and blank):
        return usual
    raise ValueError(f"{most} names, but {usual} cells in most rows")
