"""A run sheet gives the same runs in every form of csv, and each bad cell is named."""

import pytest

from .conftest import cases_of


def place(problem):
    """Code without its kind, row and column."""
    return problem.code.partition(".")[2], problem.place.row, problem.place.column


def test_the_encodings_of_spreadsheets_are_read_and_what_is_no_text_is_refused(room):
    room.rows["p1"]["note"] = "Körner"
    for encoding in ("utf-8", "utf-8-sig", "cp1252", "utf-16"):
        campaign = room.campaign(room.text().encode(encoding))
        assert campaign.by_id["p1"].note == "Körner"
    for data, code in ((bytes(range(256)) * 20, "not-text"), (b"<html><table>", "web-page")):
        assert room.only(f"sheet.{code}", data).place.file == "runs.csv"


@pytest.mark.parametrize("change", ["bom", "crlf", "cr", "semicolon", "tab", "quotes", "columns"])
def test_other_ways_to_write_the_same_sheet(room, change):
    room.rows["p1"]["note"] = "two\nlines"
    plain = room.campaign().runs
    if change == "columns":
        room.columns.reverse()
    text = room.text({"semicolon": ";", "tab": "\t"}.get(change, ","))
    text = text.replace("\n", {"crlf": "\r\n", "cr": "\r"}.get(change, "\n"))
    text = text.replace("p1,", '"p1",') if change == "quotes" else text
    data = text.encode("utf-8-sig" if change == "bom" else "utf-8")
    name = "runs.tsv" if change == "tab" else "runs.csv"
    # NaN is not itself: compare as text
    assert str(room.campaign(data, name).runs) == str(plain)


def test_blank_rows_are_skipped_but_counted(room):
    lines = room.text().splitlines()
    text = "\n".join([lines[0], "", ",,,", *lines[1:]]) + "\n\n"
    assert [run.row for run in room.campaign(text.encode()).runs] == [4, 5, 6, 7, 8, 9]


def test_a_cell_of_two_lines_is_one_row_of_the_spreadsheet(room):
    room.rows["p1"]["note"] = "two\nlines"
    room.rows["t1"]["kind"] = "rodd"
    assert ("unknown-word", 3, "kind") in map(place, room.check())


def test_a_stray_quote(room):
    lines = room.text().splitlines()
    lines[2] += 'x"y'
    lines[3] = lines[3].replace("h1", '"h1', 1)
    problem = room.only("sheet.not-csv", "\n".join(lines).encode())
    assert problem.place.row == 4
    assert "stray quote" in problem.allowed


def test_columns_missing_unknown_and_twice(room):
    names = {"medium": "mediun", "force_log": "note"}
    room.columns = [names.get(name, name) for name in room.columns]
    problem_by_column = {
        (problem.code[6:], problem.place.column): problem for problem in room.check()
    }
    assert set(problem_by_column) == {
        ("duplicate-column", "note"),
        ("unknown-column", "mediun"),
        ("missing-column", "medium"),
        ("missing-column", "force_log"),
    }
    assert {problem.place.row for problem in problem_by_column.values()} == {1}
    assert "column number 9" in problem_by_column["duplicate-column", "note"].allowed
    assert problem_by_column["unknown-column", "mediun"].nearest == "medium"


def test_a_horizontal_run_needs_the_depth_column(room):
    for name in ("tare_shared", "surface_z_mm", "excluded", "reason", "note"):
        room.columns.remove(name)
    assert room.check() == []
    room.columns.remove("depth_cm")
    assert [*map(place, room.check())] == [("required", row, "depth_cm") for row in (4, 5)]


def test_more_cells_than_columns(room):
    room.rows["p1"]["beta_deg"] = "30,5"
    codes = {problem.code for problem in room.check(room.text().replace('"', "").encode())}
    assert "sheet.decimal-comma" not in codes
    lines = room.text().splitlines()
    last_line = "p1" + lines[1][2:].replace('"30,5"', "30") + ",x"
    problem = room.only("sheet.no-header", "\n".join([lines[0], *lines[2:], last_line]).encode())
    assert (place(problem), problem.found) == (("no-header", 7, "number 27"), "x")
    assert "decimal comma" in problem.allowed


@pytest.mark.parametrize(
    "column",
    ["run_id", "kind", "medium", "intruder", "direction", "beta_deg", "gamma_deg", "force_log"],
)
def test_a_blank_cell_that_is_needed(room, column):
    room.add("p2", "p1", tare_run="")
    room.rows["p2"][column] = ""
    errors = [place(problem) for problem in room.check() if problem.severity == "error"]
    assert errors == [("required", 8, column)]


@pytest.mark.parametrize(("run", "column", "cell", "code", "value"), cases_of("sheet_cells"))
def test_one_bad_cell(room, run, column, cell, code, value):
    room.rows[run][column] = cell
    (problem,) = [problem for problem in room.check() if problem.code == f"sheet.{code}"]
    row = 2 + list(room.rows).index(run)
    assert place(problem)[1:] == (row, "reason" if code.startswith("excluded-") else column)
    assert value in str(problem)


@pytest.mark.parametrize(
    ("words", "flag"), [(["yes", "TRUE", "1"], True), (["no", "0", "False", ""], False)]
)
def test_flags(room, words, flag):
    for room.rows["p1"]["tare_shared"] in words:
        assert room.campaign().by_id["p1"].tare_shared is flag


def test_a_sheet_that_is_none(room, monkeypatch):
    assert {problem.code for problem in room.check(b"")} == {"sheet.empty", "sheet.missing-column"}
    problem = room.only("sheet.wrong-delimiter", room.text("|").encode())
    assert problem.place.row == 1
    assert str(problem.found).startswith("run_id|kind|medium")
    monkeypatch.setattr("rftfit.campaign.rows.MAX_BYTES", 100)
    room.only("sheet.too-large")
    monkeypatch.undo()
    room.rows.clear()
    room.only("sheet.empty")
    room.config = room.config.replace("runs.csv", "raw")
    assert room.only("sheet.not-a-file").place.file == "raw"
    room.config = room.config.replace("run_sheet: raw", "run_sheet: other.csv")
    assert room.only("sheet.missing").place.file == "other.csv"
