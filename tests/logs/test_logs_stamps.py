"""Times written as text are read in seconds, and an unclear or damaged time is reported.

Also tested: packed text files, and how to export files of a format that is not read.
"""

import datetime as dt
import gzip
import math
import re
from collections.abc import Callable
from importlib import import_module
from typing import Any
from zipfile import ZipFile

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import rftfit
from rftfit.logs.inspect import recognised, refusal
from rftfit.logs.registry import dialect, read_head
from rftfit.table.parse import NO_TIME
from rftfit.table.stamps import is_stamp, seconds_of, seconds_of_column

N = 300
"""Rows of the log."""
START = dt.datetime(2026, 10, 25, 23, 59, 58, 500_000, dt.UTC)
TIMES = [START + dt.timedelta(milliseconds=10 * row) for row in range(N)]
"""Over midnight."""


def clock(time):
    return time.strftime("%H:%M:%S.%f")[:-3]


FORMS: dict[str, Callable[[dt.datetime], str]] = {
    "ISO with Z": lambda t: t.strftime("%Y-%m-%dT%H:%M:%S.%fZ"),
    "ISO with a zone": lambda t: t.astimezone(dt.timezone(dt.timedelta(hours=2))).isoformat(
        timespec="milliseconds"
    ),
    "blank, no zone": lambda t: t.strftime("%Y-%m-%d %H:%M:%S.%f")[:-3],
    "slashes": lambda t: t.strftime("%Y/%m/%d %H:%M:%S.%f"),
    "clock": clock,
    "minutes": lambda t: clock(t)[3:],
    "decimal comma": lambda t: clock(t).replace(".", ","),
    "day first, comma": lambda t: f"{t:%d.%m.%Y} {clock(t)}",
    "day first, slashes": lambda t: f"{t:%d/%m/%Y} {clock(t)}",
    "month first": lambda t: f"{t:%m/%d/%Y} {t.hour % 12 or 12}:{clock(t)[3:]} {t:%p}",
}


def written(form, path, *, bad=False):
    """Write a log with times in this form; give its reader and its log."""
    comma = "comma" in form
    rows = [[FORMS[form](t), f"{k * 0.1:.2f}", f"{-k * 0.05:.2f}"] for k, t in enumerate(TIMES)]
    if bad:
        rows[40][0], rows[50][0] = "later", "2026-13-45T99:00:00Z"
    if comma:
        rows = [[re.sub(r"\.(?=\d+$)", ",", cell) for cell in row] for row in rows]
    lines = [(";" if comma else ",").join(row) for row in [["Time", "Fz (N)", "z (mm)"], *rows]]
    path.write_text("\n".join(lines) + "\n")
    reader = recognised(path)[0]
    return reader, reader.load(path)


@pytest.mark.parametrize("form", ["ISO with Z", "clock"])
def test_a_time_that_is_none_costs_its_row(form, tmp_path):
    path = tmp_path / "a.csv"
    reader, log = written(form, path, bad=True)
    assert (log.rows, log.dropped) == (N, {NO_TIME: 2})
    assert_allclose(log.columns["Time"][[0, -1]] - log.columns["Time"][0], [0, 2.99], atol=1e-6)
    for row in (1, 60):  # a byte that is no text, in the first row too
        lines = path.read_bytes().splitlines(keepends=True)
        lines[row] = b"12:00:0\xb0.0,1,2\n"
        path.write_bytes(b"".join(lines))
        assert reader.load(path).dropped == {NO_TIME: 3 + (row == 60)}


AMBIGUOUS = "03/04/2026 12:00:0"


def test_a_date_of_which_nobody_can_tell_the_day(tmp_path):
    """It stays listed with its first cell and the reason, is refused where it is asked for, and `dates` reads it."""
    path = tmp_path / "a.csv"
    rows = "".join(f"{AMBIGUOUS}{k};{k},5\n" for k in range(5))
    path.write_text(f"Zeit;Kraft [N]\n{rows}")
    text = {"delimiter": ";", "decimal": ","}
    log = rftfit.read_log(path, text=text)
    ((column, reason),) = log.unread.items()
    assert column == "Zeit"
    assert re.match(f"'{AMBIGUOUS}0' .*`dates`", reason)
    reader = recognised(path)[0].only(["Zeit", "Kraft"])
    refused(reader, path, "columns", "'Zeit': '03/04/2026")
    for dates, month in (("day first", 4), ("month first", 3)):
        log = rftfit.read_log(path, text=text, options={"dates": dates})
        start = dt.datetime(2026, month, 7 - month, 12, tzinfo=dt.UTC).timestamp()
        assert_array_equal(log.columns["Zeit"], start + np.arange(5))
        assert dates in log.notes[0]


@pytest.mark.parametrize(
    ("text", "order", "fields"),
    [
        ("23.11.2026 12:03:36,100", "", (2026, 11, 23, 12, 3, 36.1)),
        ("11/03/2026 1:00:36.100 PM", "", (2026, 11, 3, 13, 0, 36.1)),
        ("11/3/2026 12:00:36 AM", "", (2026, 11, 3, 0, 0, 36)),
        ("3/11/26 9:05", "dmy", (2026, 11, 3, 9, 5, 0)),
        ("1:00:36.5 PM", "", (1970, 1, 1, 13, 0, 36.5)),
        ("31.02.2026 12:00:00", "", None),
        ("11/03/2026 13:00:00 PM", "", None),
        ("03/04/2026 12:00:00", "", None),
        ("3.4.26 12:00:00", "", None),
    ],
)
def test_dates_of_other_countries(text, order, fields):
    """By hand and in a whole column alike."""
    column = seconds_of_column(pa.array([text] * 3), order)
    if fields is None:
        assert np.isnan(seconds_of(text, order))
        assert column is None
        return
    *whole_fields, seconds = fields
    moment = dt.datetime(*whole_fields, tzinfo=dt.UTC).timestamp() + seconds
    assert seconds_of(text, order) == pytest.approx(moment, abs=1e-6)
    assert column is not None
    assert_allclose(column, moment, atol=1e-6)


@given(
    st.datetimes(dt.datetime(1970, 1, 2), dt.datetime(2100, 1, 1)),
    st.sampled_from(["T", " "]),
    st.sampled_from(["", "Z", "+02:00", "-0330"]),
)
def test_dates_are_those_of_python(time, separator, zone):
    text = time.isoformat(separator) + zone
    moment = dt.datetime.fromisoformat(text)
    moment = moment if moment.tzinfo else moment.replace(tzinfo=dt.UTC)
    assert seconds_of(text) == pytest.approx(moment.timestamp(), abs=1e-6)


@pytest.mark.parametrize(
    ("text", "order"), [("6-01-02T23:59:59", "ymd"), ("1/2/6 23:59:59", "mdy")]
)
def test_a_year_of_one_digit_is_a_damaged_one(text, order):
    assert math.isnan(seconds_of(text, order))


@pytest.mark.parametrize("text", ["12", "12:30", "1.5", "2026-01-02", "12:60:00", "12-30-00", ""])
def test_other_texts_are_no_times(text):
    assert not is_stamp(text)
    assert np.isnan(seconds_of(text))


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
    assert log.dropped == {NO_TIME: 1}
    assert "'settings'" in log.notes[0]
    log = dialect("xlsx").with_options({"sheet": "Sheet"}).load(tmp_path / "a.xlsx")
    assert [note.split()[0] for note in log.notes] == ["Date", "Clock"]


def test_a_column_of_words_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t (s),remark,Fz (N)\n" + "".join(f"{k},still,{k}.5\n" for k in range(9)))
    reader = recognised(path)[0]
    ((column, reason),) = reader.load(path).unread.items()
    assert (column, reason.split()[0]) == ("remark", "'still'")
    refused(reader.only(["t", "remark"]), path, "columns", "'remark': 'still'")


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


def test_packed_text_is_the_text(tmp_path):
    _, plain = written("clock", tmp_path / "a.csv")
    packed = tmp_path / "a.csv.gz"
    packed.write_bytes(gzip.compress((tmp_path / "a.csv").read_bytes()))
    reader = recognised(packed)[0]
    log = reader.load(packed)
    for name, values in plain.columns.items():
        assert_array_equal(log.columns[name], values)
    packed.write_bytes(packed.read_bytes()[:-50])
    refused(reader, packed, "damaged", "gzip")


OPEN_DOCUMENT = b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet"


@pytest.mark.parametrize(
    ("content", "advice"),
    [
        (b"\xd0\xcf\x11\xe0" + bytes(600), "save it as .xlsx"),
        (b'{"time": [0, 1]}\n', "JSON"),
        (b"PK\x03\x04" + bytes(600), "unpack it"),
        (b"\x80\x04\x95" + bytes(80), "numpy.savez"),
        (b"\r\n<HTML>\n<table><tr><td>1</td><td>2</td></tr></table>", "save it as .xlsx or .csv"),
        (b"PK\x03\x04" + bytes(26) + OPEN_DOCUMENT + bytes(200), ".ods"),
    ],
)
def test_what_is_refused_says_how_to_export_it(content, advice, tmp_path):
    path = tmp_path / "a.dat"
    path.write_bytes(content)
    first_line = str(refusal(path, read_head(path))).splitlines()[0]
    assert advice in first_line
