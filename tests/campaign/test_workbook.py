"""A run sheet in xlsx gives the same runs as csv, or misleading cells and damage are named."""

import datetime as dt
import importlib
import io
import zipfile
from dataclasses import replace
from typing import Any

import pytest

from rftfit.campaign import sheet

NAME = "runs.xlsx"
"""Name of the run sheet."""


def book_of(room, **cells):
    """A workbook of the room's rows with numbers as numbers; `cells` by address."""
    openpyxl: Any = importlib.import_module("openpyxl")
    book, buffer = openpyxl.Workbook(), io.BytesIO()
    book.active.append(room.columns)
    for row in room.rows.values():
        book.active.append([_cell(row.get(name, "")) for name in room.columns])
    for address, value in cells.items():
        book.active[address] = value
    # a second sheet is not looked at
    book.create_sheet("other").append(["nonsense"])
    book.save(buffer)
    return buffer.getvalue()


def _cell(text):
    try:
        return float(text)
    except ValueError:
        return text or None


def address(room, column, row):
    return f"{'ABCDEFGHIJKLMNOPQR'[room.columns.index(column)]}{row}"


def test_a_workbook_gives_the_same_runs_as_csv(room):
    """It is known by its content."""
    plain = room.campaign().runs
    for name in (NAME, "runs.csv"):
        assert str(room.campaign(book_of(room), name).runs) == str(plain)


def test_merged_cells_are_told_and_not_left_blank(room):
    """A spreadsheet keeps the value in the first; the others would pass for blank, that is for none."""
    for row in room.rows.values():
        row["surface_z_mm"] = "5"
    first_cell, last_cell = (address(room, "surface_z_mm", row) for row in (2, 4))
    book = book_of(room, **{first_cell: 12.5})
    problems = room.check(
        edited(book, lambda sheet: sheet.merge_cells(f"{first_cell}:{last_cell}")), NAME
    )
    merged_cells = [
        (problem.code, problem.place.row, problem.found)
        for problem in problems
        if problem.severity == "error"
    ]
    assert merged_cells == [("sheet.merged-cell", row, "12.5") for row in (3, 4)]


def test_a_title_above_the_header_is_one_problem(room):
    def title(sheet):
        sheet.insert_rows(1, 2)
        sheet["A1"] = "Summer"

    (problem,) = room.check(edited(book_of(room), title), NAME)
    assert (problem.code, problem.found) == ("sheet.header-below", "Summer")
    assert "row 3" in problem.allowed


def test_row_numbers_are_those_of_the_spreadsheet(room):
    def lower(sheet):
        sheet.insert_rows(1, 2)
        sheet.insert_rows(4, 3)

    room.rows["p1"]["medium"] = "popy_LP"
    problems = room.check(edited(book_of(room), lower), NAME)
    errors = [problem.place for problem in problems if problem.severity == "error"]
    assert [(place.file, place.row, place.column) for place in errors] == [(NAME, 7, "medium")]


def test_numbers_and_truth_values_as_cells(room):
    room.rows["p1"]["run_id"] = "12"
    cells: dict[str, Any] = {
        address(room, "tare_shared", 2): True,
        address(room, "excluded", 3): False,
        address(room, "note", 2): dt.datetime(2024, 5, 2),
        address(room, "note", 3): 2.5,
        address(room, "surface_z_mm", 2): 150,
    }
    campaign = room.campaign(book_of(room, **cells), NAME)
    run = campaign.by_id["12"]
    assert (run.tare_shared, run.note, run.surface_z_mm) == (True, "2024-05-02T00:00:00", 150.0)
    assert campaign.by_id["t1"].note == "2.5"


@pytest.mark.parametrize(
    ("column", "value", "code", "text"),
    [
        ("beta_deg", dt.datetime(2024, 3, 1), "sheet.date", "found 'the date 2024-03-01T00:00:00'"),
        ("beta_deg", dt.time(3, 1), "sheet.date", "format to Text"),
        ("beta_deg", "#N/A", "sheet.cell-error", "the spreadsheet shows an error here"),
        (
            "beta_deg",
            "=15+15",
            "sheet.formula",
            "found '=15+15'; allowed: a value; this formula was",
        ),
        ("note", "=A1", "sheet.formula", "never calculated"),
        ("beta_deg", "30,5", "sheet.decimal-comma", "did you mean '30.5'?"),
        ("beta_deg", True, "sheet.not-a-number", "found 'yes'"),
    ],
)
def test_cells_that_are_not_what_they_look_like(room, column, value, code, text):
    problem = room.only(code, book_of(room, **{address(room, column, 2): value}), NAME)
    assert (problem.place.row, problem.place.column) == (2, column)
    assert text in str(problem)


def test_a_calculated_formula_is_its_value(room):
    data = book_of(room, **{address(room, "beta_deg", 2): "=15+15"})
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(buffer, "w") as new:
        for info in old.infolist():
            content = old.read(info)
            if info.filename == "xl/worksheets/sheet1.xml":
                assert content.count(b"<f>15+15</f><v") == 1
                content = content.replace(b"<f>15+15</f><v />", b"<f>15+15</f><v>30</v>")
                content = content.replace(b"<f>15+15</f><v></v>", b"<f>15+15</f><v>30</v>")
            new.writestr(info, content)
    assert room.campaign(buffer.getvalue(), NAME).by_id["p1"].beta_deg == 30.0


def test_a_damaged_workbook(room):
    data = book_of(room)
    for damaged in (data[: len(data) // 2], b"run_id,kind\n", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"):
        assert room.only("sheet.not-a-workbook", damaged, NAME).place.file == NAME


def test_too_many_rows(room, monkeypatch):
    monkeypatch.setattr(sheet, "SCHEMA", replace(sheet.SCHEMA, most_rows=4))
    for content, name in ((book_of(room), NAME), (room.text().encode(), "runs.csv")):
        assert " 4 rows" in room.only("sheet.too-many-rows", content, name).allowed
    # a single cell far below
    monkeypatch.setattr(sheet, "SCHEMA", replace(sheet.SCHEMA, most_rows=5000))
    problem = room.only("sheet.too-many-rows", book_of(room, A1048576="x"), NAME)
    assert (problem.place.file, problem.place.row) == (NAME, 5000)


def edited(data, change):
    """The workbook after a change of its first sheet."""
    openpyxl: Any = importlib.import_module("openpyxl")
    book, buffer = openpyxl.load_workbook(io.BytesIO(data)), io.BytesIO()
    change(book.worksheets[0])
    book.save(buffer)
    return buffer.getvalue()
