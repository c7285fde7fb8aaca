"""Rows of csv, tsv and xlsx tables are read in the units of the header; bad cells are named."""

import importlib
from typing import Any

import pytest

from rftfit.campaign.rows import Schema, TableColumn, read_rows, read_table_columns

SCHEMA = Schema(
    "table",
    (
        TableColumn("depth_cm", meaning="depth", unit="cm", names_with_unit=("z",), low=0, high=50),
        TableColumn("side", "choice", "which side", choices=("left", "right")),
        TableColumn("load_N", needed=False, above=0),
        TableColumn("used", "flag", needed=False),
    ),
    comments=True,
    others="ignored",
)
"""A table made up for these tests."""


def written(folder, text, name="t.csv"):
    path = folder / name
    path.write_text(text, "utf-8")
    return path


def test_a_range_is_in_the_columns_own_unit(tmp_path):
    rows, problems = read_rows(written(tmp_path, "depth_in,side\n10,left\n20,left\n"), SCHEMA)
    assert rows[0].number["depth_cm"] == pytest.approx(25.4)
    assert [(problem.place.row, problem.code) for problem in problems] == [
        (3, "table.out-of-range")
    ]


@pytest.mark.parametrize(
    ("cells", "column", "code"),
    [
        ("1,left,inf", "load_N", "not-finite"),
        ("1,left,nan", "load_N", "not-finite"),
        ("1,left,0", "load_N", "out-of-range"),
        ("-inf,left,1", "depth_cm", "not-finite"),
        ("51,left,1", "depth_cm", "out-of-range"),
        ("1,up,1", "side", "unknown-word"),
    ],
)
def test_a_bad_cell_far_down_a_long_table(tmp_path, cells, column, code):
    """Rows are read many at a time where all are valid."""
    rows = ["1,left,2"] * 1000 + [cells] + ["1,right,2"] * 5
    path = written(tmp_path, "\n".join(["depth_cm,side,load_N", *rows]))
    _, _, (problem,) = read_table_columns(path, SCHEMA, "t.csv")
    assert problem.code == f"table.{code}"
    assert (problem.place.row, problem.place.column) == (1002, column)


@pytest.mark.parametrize(
    ("header", "codes"),
    [
        ("depth_ft,side", {"unknown-unit"}),
        ("depth,side", {"missing-column"}),
        ("depth_cm,z_mm,side", {"duplicate-column"}),
        ("depth_cm", {"missing-column"}),
        ("depth_cm|side|load_N", {"wrong-delimiter"}),
    ],
)
def test_headers_that_cannot_be_used(tmp_path, header, codes):
    path = written(tmp_path, f"{header}\n1,left\n")
    _, problems = read_rows(path, SCHEMA)
    header_codes = [problem.code for problem in problems if problem.place.row == 1]
    assert {code.removeprefix("table.") for code in header_codes} == codes
    # a column without a known unit is one problem, not one of each row
    assert "unknown-unit" not in codes or len(problems) == 1


def test_a_lenient_table_marks_bad_cells_without_a_word(tmp_path):
    lenient = Schema("table", SCHEMA.columns, others="ignored", lenient=True)
    path = written(tmp_path, "depth_cm,side\n1,left\nx,left\n2,up\n")
    rows, problems = read_rows(path, lenient)
    assert problems == []
    assert [row.bad for row in rows] == [set(), {"depth_cm"}, {"side"}]


def test_any_table_may_be_a_workbook_or_tab_separated(tmp_path):
    openpyxl: Any = importlib.import_module("openpyxl")
    book = openpyxl.Workbook()
    for cells in (["depth (mm)", "side", "used"], [25, "right", True], [None, None, None]):
        book.active.append(cells)
    book.save(tmp_path / "t.xlsx")
    text = "depth (mm)\tside\tused\n25\tright\ttrue\n"
    for path in (tmp_path / "t.xlsx", written(tmp_path, text, "t.tsv")):
        (row,), problems = read_rows(path, SCHEMA)
        assert problems == []
        assert (row.number["depth_cm"], row.text["side"], row.yes("used")) == (2.5, "right", True)
