"""What stands beside the numbers of a log is heeded: units in cells, a header that stands there again, attributes."""

import numpy as np
import pytest
from log_files import refused, text_reader

from rftfit.logs.registry import dialect

ARRAYS = dialect("arrays")

ROWS = 60
READER = text_reader(delimiter=",").only({"Time", "Load", "z"})


def log_of(path, header, rows):
    """Write lines of cells below a header."""
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "units", "found"),
    [("Load", ("mN", "N"), (" Unit ", "'mN', 'N'")), ("Load (N)", ("kgf",), (" Load ", "'kgf'"))],
)
def test_a_unit_in_rows_that_changes_or_contradicts_the_header(tmp_path, header, units, found):
    """The log is refused until the config chooses."""
    unit_of_row = [units[0]] * 40 + [units[-1]] * (ROWS - 40)
    rows = [f"{row / 50},{row},{unit},{row}" for row, unit in enumerate(unit_of_row)]
    path = log_of(tmp_path / "log.csv", f"Time (s),{header},Unit,z (mm)", rows)
    refused(READER, path, "unit_changes", *found)
    if len(units) > 1:
        log = READER.of_source({"Unit": ("N",)}).load(path)
        assert log.columns["Load"].tolist() == [*range(40, ROWS)]


HEADER = "Time (s),Load (N),z (mm),T (C)"


@pytest.mark.parametrize(
    ("again", "changes"),
    [
        (HEADER, ""),
        ("Time (s),Load (N),z (mm),T (F)", ""),
        ("a remark,on,what,follows", ""),
        ("Time (s),Load (kgf),z (mm),T (C)", "'Load'"),
        ("Time (s),z (mm),Load (N),T (C)", "column 2"),
        ("Zeit (s),Weg (mm),Kraft (N),T (C)", "column 2"),
    ],
    ids=["same", "of a column not read", "remark", "unit", "exchanged", "exchanged, other words"],
)
def test_a_header_that_stands_there_again_is_compared_with_the_first(tmp_path, again, changes):
    rows = [f"{row / 50},{row}.5,{row},20.{row}" for row in range(ROWS)]
    path = log_of(tmp_path / "log.csv", HEADER, [*rows[:40], again, *rows[40:]])
    if changes:
        refused(READER, path, "header_changes", " 41 ", changes)
    else:
        assert READER.load(path).size == ROWS


def test_a_header_that_stands_there_again_in_a_workbook(tmp_path):
    import pandas as pd

    head = HEADER.split(",")
    rows = [[row / 50, row, -row, 20.0] for row in range(ROWS)]
    table = pd.DataFrame([*rows, ["Time (s)", "Load (kN)", "z (mm)", "T (C)"], *rows], columns=head)
    table.to_excel(tmp_path / "log.xlsx", index=False)
    only = dialect("xlsx").only({"Time", "Load", "z"})
    refused(only, tmp_path / "log.xlsx", "header_changes", "'Load'", "kN")


def hdf5_log(path, force, **attributes):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(force.size) / 50
        file["force"] = force
        for name, value in attributes.items():
            file["force"].attrs[name] = value
    return path


@pytest.mark.parametrize(
    ("attributes", "is_scaling"),
    [
        ({"gain": 0.5}, True),
        ({"Skalierung": 2.0}, True),
        ({"zero_offset": -3.0}, True),
        ({"N_per_count": 0.01}, True),
        ({"gain": 1.0}, False),
        ({"offset": 0.0}, False),
        ({"serial": 1234}, False),
    ],
)
def test_a_scaling_in_words_of_a_lab_is_named(tmp_path, attributes, is_scaling):
    log = ARRAYS.load(hdf5_log(tmp_path / "log.h5", np.arange(50.0), **attributes))
    names = [name for name in attributes if name in log.unapplied.get("force", "")]
    assert names == [*attributes] * is_scaling
    assert bool(log.unapplied) == is_scaling


@pytest.mark.parametrize(
    "attributes",
    [
        {"valid_range": [-10.0, 120.0]},
        {"valid_min": -10.0},
        {"valid_min": -10.0, "valid_max": 99.0},
    ],
)
def test_values_outside_the_valid_range_are_no_values(tmp_path, attributes):
    force = np.arange(50.0)
    force[20:25] = -20
    log = ARRAYS.only({"t", "force"}).load(hdf5_log(tmp_path / "l.h5", force, **attributes))
    assert log.size == 45
    assert sum(log.dropped.values()) == 5


def test_whole_numbers_that_the_file_calls_unsigned_have_no_sign(tmp_path):
    force = np.arange(50, dtype=np.int16) - 25
    log = ARRAYS.load(hdf5_log(tmp_path / "log.h5", force, _Unsigned="true"))
    assert log.columns["force"].min() == 0
    assert log.columns["force"][0] == 2**16 - 25


def test_a_list_of_names_and_units_is_that_of_the_columns_of_a_table(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["data"] = np.arange(150.0).reshape(50, 3)
        file["data"].attrs["columns"] = ["time", "Fz", "z"]
        file["data"].attrs["units"] = ["s", "N", "mm"]
    log = ARRAYS.load(tmp_path / "log.h5")
    assert log.units == {"data.time": "s", "data.Fz": "N", "data.z": "mm"}


def test_rows_of_several_widths_are_those_of_the_chosen_source(tmp_path):
    rows = [f"F,{row},1,2,{row}" if row % 3 else f"P,{row},7,{row}" for row in range(90)]
    (tmp_path / "log.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    plain = text_reader(delimiter=",", names=False)
    sizes = {
        word: plain.of_source({"column 1": (word,)})
        .only({"column 2"})
        .load(tmp_path / "log.csv")
        .size
        for word in "FP"
    }
    assert sizes == {"F": 60, "P": 30}
