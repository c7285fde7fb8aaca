"""Every conflict between rows of a run sheet, as between run and tare, is named by row and column.

Tare: the run of the rod alone, or of the leg in air, whose force is subtracted.
"""

import pytest

from .conftest import cases_of

WARNINGS = {"tare-unused", "tare-missing", "tare-excluded", "depth-unlisted", "no-plate"}
"""Codes that are warnings; all others are errors."""


@pytest.mark.parametrize(("change", "config", "expected"), cases_of("rows_together"))
def test_rows_together(room, change, config, expected):
    room.put({name: None if cells == "gone" else cells for name, cells in change.items()})
    room.config += f"{config}\n"
    places, problems = room.list_problems()
    assert [[code[6:], row or 0, column or ""] for code, row, column in places] == expected
    for problem, (code, *_) in zip(problems, expected, strict=True):
        assert problem.severity == ("warning" if code in WARNINGS else "error")
