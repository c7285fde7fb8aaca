"""Tables, counts and sizes as text, for a terminal or a notebook."""

from __future__ import annotations

from collections.abc import Sequence


def table(header: Sequence[str], rows: Sequence[Sequence[str]], indent: str = "  ") -> str:
    """Format a table: columns as wide as their content, aligned to the right where all cells are numbers or blank."""
    columns = []
    for head, *cells in zip(header, *rows, strict=True):
        width = max(map(len, (head, *cells)))
        align = str.rjust if cells and all(map(_is_number, cells)) else str.ljust
        columns.append([align(cell, width) for cell in (head, *cells)])
    return "\n".join((indent + "  ".join(row)).rstrip() for row in zip(*columns, strict=True))


def _is_number(cell: str) -> bool:
    """Return whether a cell is a number or blank."""
    try:
        float(cell or "0")
    except ValueError:
        return False
    return True


def count(number: int, noun: str, plural: str = "") -> str:
    """Write a number with its noun: ``1 run``, ``2 runs``; `plural`: where it is not the noun and an s."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def megabytes(size: int) -> str:
    """Write a number of bytes as kB or MB."""
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def first_of(lines: Sequence[str], most: int | None, rest_label: str = "more") -> list[str]:
    """Return at most the first `most` lines, and one that counts the rest as `rest_label`; all where `most` is None."""
    if most is None or len(lines) <= most:
        return [*lines]
    return [*lines[:most], f"and {len(lines) - most} {rest_label} (--all lists them)"]
