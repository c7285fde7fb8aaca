"""Logs: what a file says does not depend on how it is written; damage costs what is damaged."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers import CENTIMETRES, NEWTONS, MadePush, TextLog, json_of, replace_cell
from numpy.testing import assert_allclose
from seeds import example_count

import rftfit

pytestmark = pytest.mark.statistics
law = settings(max_examples=example_count(60), derandomize=True)
PUSH = MadePush(readings_per_s=4.0)
ROWS = PUSH.time_s.size
TEXT = {"delimiter": ","}
NAMES = ("time", "Fx", "Fz", "x", "z")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("logs")


def columns_of(path, **words):
    return rftfit.read_log(path, **words).columns


def close(columns, expected, atol=1e-8):
    assert {*columns} == {*expected}
    for name, values in expected.items():
        assert_allclose(columns[name], values, atol=atol, err_msg=name)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"]
)
def test_neither_encoding_nor_line_ends_matter(folder, end, encoding):
    names = {"Größe": PUSH.time_s, "Kraft": PUSH.forces_N[0]}
    log = TextLog(names, {"Größe": "mm", "Kraft": "N"}, end=end, decimals=9)
    # a blank line costs nothing
    rows = [*log.rows[:9], "", *log.rows[9:]]
    read = rftfit.read_log(log.write(folder / "a.csv", rows, encoding), text=TEXT)
    assert (read.units, read.dropped) == ({"Größe": "mm", "Kraft": "N"}, {})
    close(read.columns, names)


@law
@given(
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", ".")]),
    st.sampled_from(["brackets", "row"]),
    st.lists(st.text("abc ", min_size=1, max_size=9).map(str.strip), max_size=3),
)
def test_a_table_is_the_same_in_any_layout(folder, marks, unit_style, preamble):
    delimiter, decimal = marks
    log = PUSH.log(delimiter=delimiter, decimal=decimal, unit_style=unit_style, preamble=preamble)
    read = rftfit.read_log(log.write(folder / "a.csv"))
    assert read.units == log.units
    close(read.columns, log.columns)


@law
@given(st.sampled_from([*NEWTONS]), st.sampled_from([*CENTIMETRES]))
def test_units_are_those_of_the_file(folder, force_unit, length_unit):
    push = MadePush(readings_per_s=4.0, force_unit=force_unit, length_unit=length_unit)
    read = rftfit.read_log(push.log().write(folder / "a.csv"))
    assert read.units == {"time": "s"} | dict.fromkeys(["Fx", "Fz"], force_unit) | dict.fromkeys(
        ["x", "z"], length_unit
    )
    newton = read.columns["Fz"] * NEWTONS[force_unit]
    assert_allclose(newton, PUSH.forces_N[0], atol=1e-6)


@law
@given(st.permutations(NAMES))
def test_the_order_of_columns_does_not_matter(folder, order):
    log = PUSH.log()
    shuffled = TextLog({name: log.columns[name] for name in order}, log.units, decimals=9)
    read = rftfit.read_log(shuffled.write(folder / "a.csv"))
    assert [*read.columns] == order
    close(read.columns, log.columns)


@law
@given(st.floats(-1e6, 1e6).map(lambda start: round(start, 3)))
def test_a_shift_of_the_clock_is_a_shift_of_the_time(folder, start):
    push = MadePush(readings_per_s=4.0, start_s=start)
    read = columns_of(push.log().write(folder / "a.csv"), text=TEXT)
    expected = PUSH.log().columns
    assert_allclose(read["time"] - start, expected["time"], atol=1e-7)
    assert_allclose(read["z"], expected["z"], atol=1e-6)


@law
@given(
    st.sets(st.integers(3, ROWS - 4), min_size=1, max_size=5),
    st.integers(0, 4),
    st.sampled_from(["off", "1-1", "1.2.3", "0x10"]),
)
def test_a_damaged_cell_costs_its_row_alone(folder, damaged, column, cell):
    log = PUSH.log()
    rows = log.rows
    for row in damaged:
        rows[row] = replace_cell(rows[row], ",", column, cell)
    read = rftfit.read_log(log.write(folder / "a.csv", rows), text=TEXT)
    assert (read.rows, sum(read.dropped.values())) == (ROWS, len(damaged))
    kept = np.setdiff1d(np.arange(ROWS), [*damaged])
    close(read.columns, {name: values[kept] for name, values in log.columns.items()})


@law
@given(st.floats(0.2, 1))
def test_a_file_that_was_cut_holds_the_rows_before_the_cut(folder, share):
    log = PUSH.log()
    text = log.text()
    (folder / "a.csv").write_text(text[: int(share * len(text))])
    read = rftfit.read_log(folder / "a.csv", text=TEXT)
    assert read.size + sum(read.dropped.values()) == read.rows <= ROWS
    close(read.columns, {name: values[: read.size] for name, values in log.columns.items()})


@law
@given(st.integers(1, 9))
def test_a_packed_file_is_the_file(folder, level):
    text = PUSH.log().text()
    (folder / "a.csv.gz").write_bytes(gzip.compress(text.encode(), level))
    close(columns_of(folder / "a.csv.gz"), PUSH.log().columns)


@law
@given(st.integers(0, 99), st.floats(0.01, 2))
def test_inspect_shows_the_numbers_that_are_read(folder, seed, noise):
    push = MadePush(readings_per_s=4.0, seed=seed, noise_N=noise)
    path = push.log().write(folder / "a.csv")
    read = columns_of(path)
    (clock,) = json_of("inspect", path)["clocks"]
    assert [column["name"] for column in clock["columns"]] == [*read]
    for column in clock["columns"]:
        values = read[column["name"]]
        assert (column["lowest"], column["highest"]) == (values.min(), values.max())
        steps = np.diff(np.unique(values))
        assert column["resolution"] == (steps.min() if steps.size else None)
