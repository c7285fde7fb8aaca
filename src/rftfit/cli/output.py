"""Lines, tables and sizes as they are shown in a terminal or written into a pipe."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence


def say(text: str = "") -> None:
    """Write a line to standard output.

    Parameters
    ----------
    text : str
    """
    typer.echo(text)


def warn(text: str) -> None:
    """Write a line to standard error.

    Parameters
    ----------
    text : str
    """
    typer.echo(text, err=True)


def table(header: Sequence[str], rows: Sequence[Sequence[str]], indent: str = "  ") -> str:
    """Align cells in columns; columns that hold only numbers are aligned to the right.

    The width is that of the content: a table in a pipe is never cut.

    Parameters
    ----------
    header : sequence of str
    rows : sequence of sequence of str
    indent : str, optional

    Returns
    -------
    str
        Lines without trailing blanks, the last one without a line end.
    """
    columns = list(zip(header, *rows, strict=True))
    widths = [max(len(cell) for cell in column) for column in columns]
    right = [bool(rows) and all(_is_number(cell) for cell in column[1:]) for column in columns]
    lines = []
    for row in (header, *rows):
        cells = [
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(row, widths, right, strict=True)
        ]
        lines.append((indent + "  ".join(cells)).rstrip())
    return "\n".join(lines)


def count(number: int, noun: str) -> str:
    """Write a number with its noun: ``1 run``, ``2 runs``.

    Parameters
    ----------
    number : int
    noun : str
        In the singular; the plural takes an s.

    Returns
    -------
    str
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def megabytes(size: int) -> str:
    """Write a number of bytes as kB or MB.

    Parameters
    ----------
    size : int

    Returns
    -------
    str
    """
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def _is_number(cell: str) -> bool:
    try:
        float(cell or "0")
    except ValueError:
        return False
    return True
