"""Exports of testing machines: a row of names, a row of units in brackets, then numbers.

The two header rows, delimiter and decimal mark are found here; the rows are read as delimited text described by them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from rftfit.campaign.config import TextFormat
from rftfit.logs.delimited import DELIMITER_WORDS, DelimitedReader
from rftfit.logs.text import ReadingPlan, TextReader
from rftfit.table.text import Line, cells_of, decode_first_lines, text_head
from rftfit.table.units import is_units_row


class InstronReader(TextReader):
    """Cells between semicolons, commas or tabs; decimal points or commas; any lines may stand above the names."""

    name = "instron"
    description = "Instron-style export: names, a row of units in brackets, decimal comma or point"
    evidence = "a row of units in brackets below the row of names"

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        return _find_header(decode_first_lines(text_head(head), 60)) is not None

    def plan(self, head: bytes) -> ReadingPlan:
        """Find the two header rows, delimiter and decimal mark."""
        lines = decode_first_lines(head, 160)
        header = _find_header(lines)
        if header is None:
            raise ValueError("no row of units in brackets, like (s);(mm);(kN), below one of names")
        names_line, delimiter = header
        rows_text = "\n".join(line.text for line in lines[names_line + 2 :])
        # points between thousands are no decimal points: 1.442,21 has a decimal comma
        rows_text = re.sub(r"\.(?=\d{3}[.,])", "", rows_text)
        has_decimal_comma = (
            delimiter != ","
            and re.search(r"\d,\d", rows_text)
            and not re.search(r"\d\.\d", rows_text)
        )
        text = {
            "delimiter": DELIMITER_WORDS.get(delimiter, delimiter),
            "decimal": "," if has_decimal_comma else ".",
            "skip_lines": names_line,
            "units": True,
        }
        return DelimitedReader(TextFormat.model_validate(text)).plan(head)


def _find_header(lines: Sequence[Line]) -> tuple[int, str] | None:
    """Return the number of the line of names, from 0, and the delimiter; None where there is no such line.

    `lines`: First lines of the file. A table of results may stand above the table of readings: the header of the
    longest table is returned.
    """
    longest, header = -1, None
    for names_line, (upper, lower) in enumerate(pairwise(lines)):
        if lower.text.lstrip(' "\t;,')[:1] not in ("(", "["):
            continue
        for delimiter in (";", "\t", ","):
            names = cells_of(upper.text, delimiter) or []
            units = cells_of(lower.text, delimiter) or []
            if len(names) >= 2 and is_units_row(units, len(names)) and lower.whole:
                rows = _count_rows(lines[names_line + 2 :], delimiter, len(units))
                if rows > longest:
                    longest, header = rows, (names_line, delimiter)
                break
    return header


def _count_rows(lines: Sequence[Line], delimiter: str, width: int) -> int:
    """Count the lines with a digit below a header, up to the first line with another number of cells (`width`)."""
    rows = 0
    for line in lines:
        cells = cells_of(line.text, delimiter) or []
        if abs(len(cells) - width) > 1 or not any(map(str.isdigit, line.text)):
            break
        rows += 1
    return rows
