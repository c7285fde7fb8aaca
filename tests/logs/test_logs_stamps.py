"""Times written as text are read in seconds, and an unclear or damaged time is reported.

Also tested: packed text files, and how to export files of a format that is not read.
"""

import datetime as dt
import re
from importlib import import_module
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from log_files import refused
from makers import sentence_of
from numpy.testing import assert_allclose

import rftfit
from rftfit.logs.registry import dialect

N = 300
"""Rows of the log."""
START = dt.datetime(2026, 10, 25, 23, 59, 58, 500_000, dt.UTC)
TIMES = [START + dt.timedelta(milliseconds=10 * row) for row in range(N)]
"""Over midnight."""


def log_of(path, times, dates=""):
    """A text log whose first column holds these times."""
    rows = [f"{time};{row}.5" for row, time in enumerate(times)]
    path.write_text("\n".join(["Time;Fz [N]", *rows, ""]), "utf-8")
    return rftfit.read_log(path, text={"delimiter": ";"} | ({"dates": dates} if dates else {}))


@pytest.mark.parametrize(
    ("text", "order", "fields"),
    [
        ("23.11.2026 12:03:36,100", "", (2026, 11, 23, 12, 3, 36.1)),
        ("11/03/2026 1:00:36.100 PM", "", (2026, 11, 3, 13, 0, 36.1)),
        ("11/3/2026 12:00:36 AM", "", (2026, 11, 3, 0, 0, 36)),
        ("3/11/26 9:05", "day first", (2026, 11, 3, 9, 5, 0)),
        ("1:00:36.5 PM", "", (1970, 1, 1, 13, 0, 36.5)),
        ("31.02.2026 12:00:00", "", None),
        ("11/03/2026 13:00:00 PM", "", None),
        ("03/04/2026 12:00:00", "", None),
        ("3.4.26 12:00:00", "", None),
        # a year of one digit is a damaged one
        ("6-01-02T23:59:59", "year first", None),
        ("1/2/6 23:59:59", "month first", None),
    ],
)
def test_dates_of_other_countries(text, order, fields, tmp_path):
    log = log_of(tmp_path / "log.csv", [text] * 3, order)
    if fields is None:
        assert not np.isfinite(log.columns.get("Time", np.nan)).any()
        return
    *whole_fields, seconds = fields
    moment = dt.datetime(*whole_fields, tzinfo=dt.UTC).timestamp() + seconds
    assert_allclose(log.columns["Time"], [moment] * 3, atol=1e-6)


@given(
    st.lists(st.datetimes(dt.datetime(1970, 1, 2), dt.datetime(2100, 1, 1)), min_size=3),
    st.sampled_from(["T", " "]),
    st.sampled_from(["", "Z", "+02:00", "-0330"]),
)
def test_dates_are_those_of_python(tmp_path_factory, times, separator, zone):
    texts = [time.isoformat(separator) + zone for time in times]
    log = log_of(tmp_path_factory.getbasetemp() / "dates.csv", texts)
    moments = [dt.datetime.fromisoformat(text) for text in texts]
    seconds = [moment.replace(tzinfo=moment.tzinfo or dt.UTC).timestamp() for moment in moments]
    assert_allclose(log.columns["Time"], seconds, rtol=0, atol=1e-6)


def test_dates_of_a_spreadsheet(tmp_path):
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Date", "Clock", "Fz [N]"])
    for row, time in enumerate(TIMES[:60]):
        sheet.append([time.replace(tzinfo=None), (time - dt.timedelta(hours=1)).time(), row * 0.5])
    sheet["A9"] = "soon"
    book.create_sheet("settings").append(["gain", 3])
    book.save(tmp_path / "a.xlsx")
    log = dialect("xlsx").load(tmp_path / "a.xlsx")
    assert log.columns["Date"][0] == pytest.approx(START.timestamp(), abs=1e-3)
    assert_allclose(log.columns["Clock"][:3], 82798.5 + 0.01 * np.arange(3), atol=1e-3)
    assert log.units == {"Date": "s", "Clock": "s", "Fz": "N"}
    assert log.dropped == {sentence_of("time"): 1}
    assert "'settings'" in log.notes[0]
    log = dialect("xlsx").with_options({"sheet": "Sheet"}).load(tmp_path / "a.xlsx")
    assert [note.split()[0] for note in log.notes] == ["Date", "Clock"]


def test_a_cell_far_below_all_rows(tmp_path):
    openpyxl = import_module("openpyxl")
    book = openpyxl.Workbook()
    for row in (["time", "F3"], [0.0, 1.0], [0.1, 2.0]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    with ZipFile(tmp_path / "a.xlsx") as old, ZipFile(tmp_path / "b.xlsx", "w") as new:
        for name in old.namelist():
            text = old.read(name)
            if name.endswith("sheet1.xml"):
                text = re.sub(rb'"([AB]?)3"', rb'"\g<1>50000000"', text)
            new.writestr(name, text)
    error = refused(dialect("xlsx"), tmp_path / "b.xlsx", "too_large", "row 1048576")
    assert error.rows == 1048576
