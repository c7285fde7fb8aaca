"""`rftfit inspect` proposes columns, units and times that can be read, or names the next step.

Also tested: which last row counts as whole in a log that was cut.
"""

from importlib import import_module
from typing import Any

import numpy as np
import pytest
from makers import json_of
from numpy.testing import assert_allclose
from third_party import REPORTED, needs, proposal, read_by

from rftfit import RftfitError, read_log

ROWS = [f"{n / 50:.2f},{0.5 * n},{10 - 0.25 * n}" for n in range(60)]
"""Time in s, force and z of a push."""


def table(path, header, rows=ROWS):
    path.write_text("\n".join([header, *rows, ""]), "utf-8")
    return path


def read_force(path, **section):
    """Read a log by a section of the config."""
    return read_by(path, {"force_log": section})["force_log"]


@pytest.mark.parametrize("column", [2, "Force"])
def test_a_column_is_given_by_its_number_or_by_its_name(column, tmp_path):
    path = table(tmp_path / "log.csv", "Time (s),Force (N),z (mm)")
    log = read_force(path, text={}, columns={"time": "Time", "F3": column})
    assert_allclose(log.columns["F3"], 0.5 * np.arange(60))
    with pytest.raises(RftfitError, match="column: found 'column 4'; allowed: Time, Force, z"):
        read_force(path, text={}, columns={"F3": 4})


@needs(REPORTED)
def test_a_number_counts_the_columns_that_are_not_read():
    columns = {"time": {"column": 4, "unit": "s"}, "F3": {"column": 5, "unit": "N"}}
    text = {"delimiter": ",", "skip_lines": 7, "units": True}
    with pytest.raises(RftfitError, match="the file says m, which is no unit of time"):
        read_force(REPORTED / "m12_ags4.ags", text=text, columns=columns)
    columns = {name: chosen | {"factor": 1} for name, chosen in columns.items()}
    log = read_force(REPORTED / "m12_ags4.ags", text=text, columns=columns)
    assert_allclose(log.columns["time"][:3], [0, 0.02, 0.04])
    assert_allclose(log.columns["F3"][:3], [0, 0.031, 0.062])


def test_a_factor_of_one_declares_a_unit(tmp_path):
    path = table(tmp_path / "log.csv", "Time (s),Force (V),z (mm)")
    with pytest.raises(RftfitError, match="add `factor:`"):
        read_force(path, text={}, columns={"F3": {"column": "Force", "unit": "N"}})
    chosen = {"column": "Force", "unit": "N", "factor": 1}
    assert read_force(path, text={}, columns={"F3": chosen}).units["F3"] == "N"


@needs(REPORTED)
def test_a_folder_of_rosbag2_is_one_log(rftfit, refusal):
    folder = REPORTED / "c23_two_sensors"
    output = rftfit("inspect", folder, "--option topic=/tool")
    assert "ros-bag" in output.out
    assert "column header.frame_id says 'ft_other', 'ft_plate' in turn" in refusal(
        "inspect", folder, "--option topic=/wrench"
    )
    assert read_log(folder, options={"topic": "/tool"}).size > 0
    assert "this is a folder" in refusal("inspect", folder.parent)


@pytest.mark.parametrize(
    "header", ["Force (N), Sinkage (mm)", "Load [kN],Depth [mm]", "Pressure (kPa),Sinkage (cm)"]
)
def test_force_against_depth_leads_to_a_table(header, rftfit, tmp_path):
    path = table(tmp_path / "log.csv", header, [f"{n}.5,{n}.0" for n in range(30)])
    text = rftfit("inspect", path).out
    needed = text.partition("needed beside this file:\n")[2].splitlines()
    assert "without a time is no log but a table of stress" in needed[0]
    assert "rftfit init DIR --stress-table FILE" in needed[0]


def test_a_leg_leads_to_the_place_of_its_toe(tmp_path):
    """Not to the motor whose position is an angle."""
    header = "t (s),motor_position,toe_position_x,toe_position_y,toe_force_x,toe_force_y"
    rows = [f"{n / 100},{n},{n * 2}.5,{n}.25,0.5,1.5" for n in range(30)]
    columns = proposal(table(tmp_path / "log.csv", header, rows))["motion_log"]["columns"]
    assert (columns["x"]["column"], columns["z"]["column"]) == ("toe_position_x", "toe_position_y")


def test_a_column_of_seconds_that_grows_is_the_time(tmp_path):
    path = table(tmp_path / "log.csv", "t_midnight_s,Fz_N,z_mm")
    assert proposal(path)["force_log"]["columns"]["time"] == "t_midnight"
    path = table(tmp_path / "other.csv", "Fz_N,dwell_s,z_mm", ["1.0,5,2.0"] * 30)
    assert "time" not in proposal(path)["force_log"]["columns"]


@pytest.mark.parametrize(("step", "unit"), [(20, "ms"), (20_000, "us"), (0.02, "s")])
def test_the_unit_of_a_bare_time_is_that_of_a_usual_rate(step, unit, tmp_path):
    rows = [f"{n * step:g},{n}.5,{n}.25" for n in range(40)]
    path = table(tmp_path / "log.csv", "time,Force (N),z (mm)", rows)
    assert proposal(path)["force_log"]["columns"]["time"] == {"column": "time", "unit": unit}


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("03-Feb-2026 23:59:55.250", 1770163195.25),
        ("3 February 2026 23:59:55", 1770163195.0),
        ("Feb 3, 2026 11:59:55 PM", 1770163195.0),
        ("2026-Feb-03 23:59:55", 1770163195.0),
        ("2026-02-03 23:59:55.250 UTC", 1770163195.25),
        ("03-Dez-2026 00:00:00", 1796256000.0),
    ],
)
def test_dates_with_names_of_months_and_zones(text, seconds, tmp_path):
    path = table(tmp_path / "log.txt", "when;Fz (N)", [f"{text};{n}.5" for n in range(9)])
    for log in (
        read_log(path),
        read_log(table(path, "when;Fz (N)", [f"{text};1.5", f" {text} ;x", f"{text};2.5"] * 3)),
    ):
        assert_allclose(log.columns["when"], seconds, atol=1e-6)


def test_clock_times_of_a_workbook_pass_midnight(tmp_path):
    openpyxl: Any = import_module("openpyxl")
    dt: Any = import_module("datetime")
    book = openpyxl.Workbook()
    book.active.append(["Clock", "Fz [N]"])
    start = dt.datetime(2026, 2, 3, 23, 59, 58)
    for row in range(9):
        book.active.append([(start + dt.timedelta(seconds=row)).time(), row * 0.5])
    book.save(tmp_path / "a.xlsx")
    log = read_log(tmp_path / "a.xlsx")
    assert_allclose(log.columns["Clock"] - log.columns["Clock"][0], np.arange(9))
    assert "a day is added" in log.notes[0]


def test_numbers_of_names_are_no_numbers_of_a_table(tmp_path):
    """Names 1, 2, 3 of gauges are text, where the numbers below are none."""
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.Workbook()
    for row in (["1", "2", "3"], *([n / 2, n + 0.25, n * 3.0] for n in range(9))):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    log = read_log(tmp_path / "a.xlsx")
    assert list(log.columns) == ["1", "2", "3"]
    assert log.size == 9


@pytest.mark.parametrize(
    ("attributes", "unit", "value"),
    [
        ({"scale_factor": 0.5, "add_offset": 2.0, "units": "N"}, "N", 4.0),
        ({"scale_factor": np.array([0.5]), "unit": b"mN"}, "mN", 2.0),
        ({"unitSI": 1e-3, "unit": "mm"}, "mm", 4.0),
        ({"unitSI": 1e-3, "unitDimension": [1.0, 1, -2, 0, 0, 0, 0]}, "N", 4e-3),
        ({"unitSI": 2.0, "unit": "m"}, "m", 8.0),
    ],
)
def test_attributes_say_what_a_stored_number_is(attributes, unit, value, tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(9.0)
        file["F"] = np.array([4, -99, 4, 4, 4, 4, 4, 4, 4], dtype=np.int16)
        file["F"].attrs.update({**attributes, "_FillValue": np.int16(-99)})
    log = read_log(path)
    assert log.units["F"] == unit
    assert_allclose(log.columns["F"], [value, np.nan, *[value] * 7])
    assert "1 times -99, which stands for no value" in log.notes[0]
    with h5py.File(path, "a") as file:
        file["F"].attrs["scale_factor"] = "a lot"
    log = read_log(path)
    assert "F" not in log.columns
    assert "its attribute scale_factor is no number" in log.notes[0]


def test_a_stated_time_in_other_units_is_converted(tmp_path):
    """The names are those of the chain, the units are not; a rare value that stands for none is no damage."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        for name, unit, values in (
            ("time", "milliseconds since 2026-01-01", np.arange(40) * 20),
            ("F3", "kN", np.arange(40) / 1000),
            ("z", "m", -np.arange(40.0)),
        ):
            file[name] = values
            file[name].attrs["units"] = unit
        file["z"].attrs["missing_value"] = np.array([-3.0, -4.0])
        file["z"].attrs["gain"] = 7
    proposed = proposal(path)
    (clock,) = json_of("inspect", path)["clocks"]
    assert [column["values"] for column in clock["columns"]] == [40, 40, 38]
    assert "attributes that are not applied: gain 7" in clock["notes"][0]
    with pytest.raises(RftfitError, match="gain 7, which is not applied: add `factor:`"):
        read_by(path, proposed)
    with h5py.File(path, "a") as file:
        del file["z"].attrs["gain"]
    logs = read_by(path, proposed)
    assert_allclose(logs["force_log"].columns["time"], np.arange(40) / 50)
    assert_allclose(logs["force_log"].columns["F3"], np.arange(40))
    assert logs["motion_log"].dropped == {"no value in a cell": 2}


def test_fields_of_a_table_have_the_units_of_a_list(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    records = np.zeros(9, dtype=[("t", "f8"), ("F", "f4")])
    for units in (["s", "N"], "s,N"):
        with h5py.File(path, "w") as file:
            file["log"] = records
            file["log"].attrs["units"] = units
        assert read_log(path).units == {"log.t": "s", "log.F": "N"}


ROWS_OF_DECIMALS = [f"{n / 100:.2f},{n / 2:.1f},{10 - n / 4:.2f}" for n in range(60)]
ROWS_OF_COUNTS = [f"{n / 100:.2f},{1000 + n}" for n in range(60)]
ROWS_WITHOUT_ZEROS = [f"{n / 100:.2f},{n / 4:g}" for n in range(60)]
ROWS_OF_DATES = [f"{n}.5,2026-02-03 10:00:{n:02}.250" for n in range(50)]


@pytest.mark.parametrize(
    ("header", "rows", "last_line", "is_whole"),
    [
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0,-5.00", True),
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0,-5.0", False),
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0,-", False),
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0,", False),
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0", False),
        ("Time (s),Force (N),z (mm)", ROWS_OF_DECIMALS, "0.60,30.0,-5.00e", False),
        # a whole number is as near as those before
        ("Time (s),counts", ROWS_OF_COUNTS, "0.60,1060", True),
        ("Time (s),counts", ROWS_OF_COUNTS, "0.60,1059", True),
        ("Time (s),counts", ROWS_OF_COUNTS, "0.60,106", False),
        ("Time (s),counts", ROWS_OF_COUNTS, "0.60,9060", False),
        # without trailing zeros what a cut took away is less than what lies between two rows
        ("Time (s),Force (N)", ROWS_WITHOUT_ZEROS, "0.60,14.5", True),
        ("Time (s),Force (N)", ROWS_WITHOUT_ZEROS, "0.60,15", True),
        ("Time (s),Force (N)", ROWS_WITHOUT_ZEROS, "0.60,15.", False),
        ("Time (s),Force (N)", ROWS_WITHOUT_ZEROS, "0.60,1", False),
        # a time is as long as those before
        ("Force (N),when", ROWS_OF_DATES, "1.5,2026-02-03 10:00:50.250", True),
        ("Force (N),when", ROWS_OF_DATES, "1.5,2026-02-03 10:00:50.2", False),
    ],
)
def test_a_last_line_without_an_end_counts_where_it_is_whole(
    header, rows, last_line, is_whole, tmp_path
):
    path = table(tmp_path / "log.csv", header, rows)
    path.write_bytes(path.read_bytes() + last_line.encode())
    log = read_log(path)
    assert (log.rows, log.size) == (len(rows) + 1, len(rows) + is_whole)
    assert ("cut in mid-row" in log.dropped) != is_whole


@pytest.mark.parametrize("ending", ["csv", "npz", "txt"])
def test_a_coarse_time_is_proposed_as_a_rate(ending, tmp_path):
    """Whether the dialect takes one or not, the proposal names no time that would be refused."""
    path = tmp_path / f"log.{ending}"
    time, force, z = np.arange(400) // 4 * 0.04, np.arange(400) / 2, 10 - np.arange(400) / 8
    if ending == "npz":
        np.savez(path, time=time, Fz=force, z=z)
    else:
        header = "time (s),Force (N),z (mm)" if ending == "csv" else "time,Force,z\n(s),(N),(mm)"
        table(path, header, [f"{t:.2f},{f},{h}" for t, f, h in zip(time, force, z, strict=True)])
    proposed = proposal(path)
    for key in ("force_log", "motion_log"):
        assert "time" not in proposed[key]["columns"]
    if ending == "txt":  # of a testing machine: the dialect has no rate
        assert "options" not in proposed["force_log"]
        return
    for log in read_by(path, proposed).values():
        assert_allclose(log.columns["time"], np.arange(400) / 100)


def test_channels_of_any_name_in_a_unit_of_force_make_a_force_log(tmp_path):
    rows = [f"{20 * n};0,5{n % 10};-{n % 7},1;{n},5;{n},0" for n in range(60)]
    path = table(tmp_path / "push.csv", "t_ms;H_kgf;V_kgf;x_mm;z_mm", rows)
    config = proposal(path)
    assert config["force_log"]["columns"].keys() == {"time"}
    assert config["motion_log"]["columns"].keys() == {"time", "x", "z"}
    assert config["clock"] == {"method": "same_clock"}
    answer = json_of("inspect", path)
    assert "    # F1: no column looks like it; with such a unit: H, V" in answer["config"]
    assert any("names this file as both logs" in need for need in answer["needed"])
