"""The one maker of text logs: columns of numbers written as programs write them, then damaged."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class TextLog:
    """Cells of a log, and how they are written.

    `columns`: Name to the cells of all data lines, numbers or texts. `units`: Of each column, by name.
    `unit_style`: ``brackets`` behind the name, ``row`` below the names, or ``none``. `decimals`: Digits of a number.
    `preamble`: Lines above the names.
    """

    columns: Mapping[str, Sequence[object]]
    units: Mapping[str, str]
    unit_style: str = "brackets"
    delimiter: str = ","
    decimal: str = "."
    decimals: int = 4
    preamble: Sequence[str] = ()
    end: str = "\n"

    def _cell(self, content: object) -> str:
        if isinstance(content, str):
            return content
        return f"{content:.{self.decimals}f}".replace(".", self.decimal)

    @property
    def header(self) -> list[str]:
        """Lines above the data."""
        names = [
            f"{name} [{self.units[name]}]"
            if self.unit_style == "brackets" and self.units.get(name)
            else name
            for name in self.columns
        ]
        lines = [*self.preamble, self.delimiter.join(names)]
        if self.unit_style == "row":
            lines.append(self.delimiter.join(self.units.get(name, "") for name in self.columns))
        return lines

    @property
    def rows(self) -> list[str]:
        """Data lines without their ends."""
        return [
            self.delimiter.join(map(self._cell, cells))
            for cells in zip(*self.columns.values(), strict=True)
        ]

    def text(self, rows: Sequence[str] | None = None) -> str:
        """The whole file; `rows`: data lines in place of its own, damaged ones for example."""
        lines = [*self.header, *(self.rows if rows is None else rows)]
        return "".join(f"{line}{self.end}" for line in lines)

    def write(self, path: Path, rows: Sequence[str] | None = None, encoding: str = "utf-8") -> Path:
        """Write the file and return its path."""
        path.write_bytes(self.text(rows).encode(encoding))
        return path


def replace_cell(row: str, delimiter: str, column: int, cell: str) -> str:
    """Put another cell into a data line."""
    cells = row.split(delimiter)
    cells[column] = cell
    return delimiter.join(cells)


def cut_last_line(text: str) -> str:
    """End a file in the middle of its last line, as a program does that is killed."""
    return re.sub(r".{3}\r?\n\Z", "", text)
