"""Workbooks, Parquet and described text are read with their units, and bad rows are counted."""

import datetime as dt
import random
from decimal import Decimal
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from log_files import instron, refused
from makers import sentence_of
from numpy.testing import assert_allclose

import rftfit
from rftfit.logs.registry import dialect

VALUES = np.random.default_rng(3).normal(size=(50, 3)).round(5)
FRAME = pd.DataFrame(VALUES, columns=["Fx [N]", "Fy (N)", "z_mm"])


@pytest.fixture(params=["xlsx", "parquet"])
def table(request, tmp_path):
    """A table of VALUES in a binary file."""
    path = tmp_path / f"log.{request.param}"
    if request.param == "xlsx":
        FRAME.to_excel(path, index=False, engine="xlsxwriter")
    else:
        FRAME.to_parquet(path)
    return path


def test_xlsx_with_a_preamble_a_row_of_units_and_a_bad_cell(tmp_path):
    path = tmp_path / "log.xlsx"
    rows: list[list[object]] = [["Test 12", None, None], [None] * 3]
    rows += [["Time", "Force", "Operator"], ["s", "kN", None]]
    rows += [[0.1 * n, 2.0 * n, "me"] for n in range(10)]
    rows[5][1] = "off"
    pd.DataFrame(rows).to_excel(path, index=False, header=False, engine="xlsxwriter")
    log = dialect("xlsx").load(path)
    assert log.units == {"Time": "s", "Force": "kN"}
    assert (log.rows, log.dropped) == (10, {sentence_of("number"): 1})


def test_parquet_with_stamps_and_units_in_the_metadata(tmp_path):
    stamps = pa.array([1_700_000_000_000_000, 1_700_000_000_008_000], type=pa.timestamp("us"))
    force = pa.field("force", pa.float32(), metadata={b"unit": b"Newton"})
    schema = pa.schema([pa.field("time", stamps.type), force])
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table([stamps, pa.array([1, 2], pa.float32())], schema=schema), path)
    log = dialect("parquet").load(path)
    assert log.units == {"time": "s", "force": "N"}
    assert np.diff(log.columns["time"]) == pytest.approx([0.008], abs=1e-6)


def test_cut_and_damaged_binaries(table):
    """Their list of contents stands at the end: cut, they hold nothing that can be trusted."""
    name, content, luck = table.suffix[1:], table.read_bytes(), random.Random(7)
    for stop in sorted(luck.sample(range(len(content)), 40)):
        table.write_bytes(content[:stop])
        assert refused(dialect(name), table, "damaged" if stop else "empty").rows == 0
    for _ in range(60):
        damaged = bytearray(content)
        for _ in range(luck.choice([1, 3, 20])):
            damaged[luck.randrange(len(content))] = luck.randrange(256)
        table.write_bytes(damaged)
        try:
            log = rftfit.read_log(table, name)
        except rftfit.RftfitError as error:
            message = str(error)
            assert str(table) in message
        else:
            assert log.size + sum(log.dropped.values()) == log.rows <= 50


def test_only_some_columns(tmp_path):
    path = tmp_path / "log"
    path.write_bytes(instron(5).content.replace(b"0,02;", b"0,02;x", 1))
    reader = instron(5).reader
    assert reader.load(path).size == 4
    log = reader.only({"Time", "Force"}).load(path)
    assert (list(log.columns), log.size) == (["Time", "Force"], 5)


@pytest.mark.parametrize(
    ("row", "units"),
    [
        ("g mm sec", "gf mm s"),
        ("N mm s", "N mm s"),
        ("kN*mm mm s", "kN*mm mm s"),
        ("N V s", "N V s"),
        ("mN nm s", "mN nm s"),
        ("N qq s", "N qq s"),
        ("kg mm/min s", "kgf mm/min s"),
        ("a b s", None),
    ],
)
def test_rows_of_units(row, units, tmp_path):
    path = tmp_path / "log.tab"
    lines = ["Force\tTravel\tTime\t", "\t".join(row.split()) + "\t"]
    path.write_text("\n".join([*lines, "", *(f"{k}.5\t{k}\t{k}" for k in range(4))]) + "\n")
    log = rftfit.read_log(path)
    if units is None:
        assert list(log.columns) == row.split()
    else:
        assert log.units == dict(zip(["Force", "Travel", "Time"], units.split(), strict=True))


Rows = list[list[Any]]
LOG: Rows = [["Time", "Force"], ["s", "kN"], *[[0.1 * k, 2.0 * k] for k in range(9)]]
RESULT: Rows = [["Date", "Fmax"], [None, "N"], [45000.5, 5286.0]]
PROSE: Rows = [["Speed", 5]]
TYPED: Rows = [["L?", 1, 1.32, 5.99, 6], ["gap", 3], ["me", "you"], *([None] for _ in range(9))]
BESIDE: Rows = [
    [*row, None, *typed] for row, typed in zip([["GLL", "Specimen 1"], *LOG], TYPED, strict=True)
]
BELOW: Rows = [*LOG, [None, None], [None, None, None, "sum", 72]]


@pytest.mark.parametrize(
    ("sheets", "hidden", "option", "sheet_or_values"),
    [
        ({"Parameters": PROSE, "Results": RESULT, "Values 1": LOG}, "", None, "Values 1"),
        ({"Parameters": PROSE, "Values 1": LOG}, "", "Values *", "Values 1"),
        ({"Values 1": LOG, "Values 2": LOG}, "", 2, "Values 2"),
        ({"Values 1": LOG, "Values 2": LOG}, "Values 1", None, "Values 2"),
        ({"Values 1": LOG, "Values 2": LOG}, "Values 1", 1, "Values 2"),
        ({"Values 1": LOG, "Values 2": LOG}, "Values 1", "Values 1", "Values 1"),
        ({"Values 1": LOG, "Parameters": PROSE}, "Values 1", None, ["hidden: Values 1"]),
        (
            {"Values 1": LOG, "Parameters": PROSE},
            "Values 1",
            "Val*",
            [" 'Val*'", "allowed: Parameters; hidden: Values 1"],
        ),
        ({"Values 1": LOG}, "", 2, [" 2; allowed: Values 1"]),
        # a number is a name before it is a place
        ({"2": LOG, "Values 1": LOG}, "", 2, "2"),
        ({"Values 1": BESIDE}, "", None, "Values 1"),
        ({"Values 1": BELOW}, "", None, "Values 1"),
        ({"Values 1": [[1, 2], *LOG]}, "", None, "Values 1"),
    ],
)
def test_sheets_of_a_workbook(sheets, hidden, option, sheet_or_values, tmp_path):
    path, openpyxl = tmp_path / "a.xlsx", import_module("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for number, (name, rows) in enumerate(sheets.items()):
        sheet = book.create_sheet(name)
        for row in rows:
            # which sheet is read shows in its last number
            sheet.append([16.0 + number if cell == 16.0 else cell for cell in row])
        sheet.sheet_state = "hidden" if name == hidden else "visible"
    book.save(path)
    options = {} if option is None else {"sheet": option}
    if isinstance(sheet_or_values, list):
        refused(dialect("xlsx").with_options(options), path, "sheet", *sheet_or_values)
        return
    log = rftfit.read_log(path, options=options)
    assert log.units == {"Time": "s", "Force": "kN"}
    assert (log.rows, log.size) == (9, 9)
    assert log.columns["Force"][-1] == 16.0 + list(sheets).index(sheet_or_values)
    assert bool(log.notes) == (option is None and len(sheets) > 1)


def test_a_column_of_a_table_that_nobody_asks_for_costs_no_row(tmp_path):
    path = tmp_path / "a.parquet"
    FRAME.assign(dead=np.nan).to_parquet(path)
    log = dialect("parquet").load(path)
    assert (log.size, [*log.unread]) == (50, ["dead"])
    assert dialect("parquet").only({"Fx", "z"}).load(path).size == 50


def test_types_of_parquet_that_hold_numbers(tmp_path):
    start = dt.datetime(2026, 1, 1, 23, 59, 50)
    rows = range(20)
    lists: list[list[float] | None] = [[1.0 * row, 2.0 * row] for row in rows]
    lists[5] = None
    table = pa.table(
        {
            "clock": pa.array([(start + dt.timedelta(seconds=row)).time() for row in rows]),
            "since": pa.array([dt.timedelta(seconds=row / 2) for row in rows]),
            "exact": pa.array([Decimal(row) / 4 for row in rows]),
            "point": pa.array([{"x": row, "name": "a", "z": row / 8} for row in rows]),
            "kind": pa.array([str(row / 2) for row in rows]).dictionary_encode(),
            "word": pa.array(["a"] * 20),
            "half": pa.array(np.arange(20, dtype=np.float16)),
            "pair": pa.array(lists),
            "date": pa.array([f"2026-02-03 00:00:{row:02}" for row in rows]),
            "raw": pa.array([b"x"] * 20),
        }
    )
    path = tmp_path / "log.parquet"
    pq.write_table(table, path)
    log = dialect("parquet").load(path)
    for name, begin, step in (
        ("clock", 86390, 1),  # over midnight
        ("since", 0, 0.5),
        ("exact", 0, 0.25),
        ("point.x", 0, 1),
        ("point.z", 0, 0.125),
        ("kind", 0, 0.5),
        ("half", 0, 1),
        ("date", 1770076800, 1),
    ):
        assert_allclose(log.columns[name], begin + step * np.arange(20), err_msg=name)
    assert np.flatnonzero(np.isnan(log.columns["pair column 2"])).tolist() == [5]
    assert log.unread.keys() == {"word", "raw"}
    assert log.unread["word"].startswith("'a' ")
    assert log.unread["raw"].endswith(" binary")
    asked = dialect("parquet").only(["column 2", "pair column 2"]).load(path)
    assert [*asked.dropped.values()] == [1]
    assert list(asked.columns) == ["since", "pair column 2"]


def test_text_with_decimal_commas_in_a_workbook(tmp_path):
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["t", "F [N]", "counts", "z [mm]"])
    for row in range(9):
        book.active.append([row / 2, f"{row},25", f"{row + 1},125", f"\N{MINUS SIGN}{row}.5"])
    book.save(tmp_path / "a.xlsx")
    log = dialect("xlsx").load(tmp_path / "a.xlsx")
    assert_allclose(log.columns["F"], np.arange(9) + 0.25)
    assert_allclose(log.columns["z"], -0.5 - np.arange(9))
    assert log.unread.keys() == {"counts"}
    assert log.unread["counts"].startswith("'1,125' ")
