"""Unit factors follow from their definitions, and a unit that is not stated is never guessed.

Also tested: the calibration of gauges, and positions that are stated by a rate.
"""

import math
from pathlib import Path

import numpy as np
import pytest

import rftfit
from rftfit.campaign.calibration import read_calibration
from rftfit.campaign.config import ForceLog, MotionLog
from rftfit.logs.base import Log, LogError
from rftfit.measure import log_columns
from rftfit.measure.flags import Refused, remark
from rftfit.table import units


def test_factors_are_those_of_the_definitions():
    inch_cm = 2.54
    pound_kg, standard_gravity = 0.45359237, 9.80665
    assert dict(units.FORCE_TO_N) == {
        "N": 1,
        "mN": 0.001,
        "cN": 0.01,
        "daN": 10,
        "kN": 1000,
        "lbf": pytest.approx(pound_kg * standard_gravity, abs=1e-13),
        "klbf": pytest.approx(1000 * pound_kg * standard_gravity, abs=1e-10),
        "kgf": standard_gravity,
        "gf": pytest.approx(standard_gravity / 1000),
    }
    assert dict(units.LENGTH_TO_CM) == {"um": 1e-4, "mm": 0.1, "cm": 1, "m": 100, "in": inch_cm}
    assert dict(log_columns.ANGLE_TO_RAD) == {"deg": pytest.approx(2 * math.pi / 360), "rad": 1}
    assert dict(units.TIME_TO_S) == {
        "s": 1,
        "ms": 1e-3,
        "us": 1e-6,
        "ns": 1e-9,
        "min": 60,
        "h": 60 * 60,
        "d": 24 * 60 * 60,
    }
    assert dict(units.TORQUE_TO_N_M) == {"N m": 1, "N mm": 1e-3}


def test_log_and_config_have_to_agree():
    assert log_columns.unit_factor(units.LENGTH_TO_CM, "in", "in", "depth") == 2.54
    for in_file, found in (("mm", "mm"), ("", "no unit")):
        with pytest.raises(Refused) as caught:
            log_columns.unit_factor(units.LENGTH_TO_CM, in_file, "in", "depth")
        assert caught.value.remark == remark(
            "other-unit", quantity="depth", found=found, declared="in"
        )
    with pytest.raises(Refused) as caught:
        log_columns.unit_factor(units.TORQUE_TO_N_M, "lbf in", "lbf in", "torque")
    assert caught.value.remark == remark(
        "unknown-unit", quantity="torque", found="lbf in", allowed="N m, N mm"
    )


def log_of(unit):
    columns = {"time": np.arange(3.0), "Fz": np.array([1.0, 2.0, 4.0])}
    return Log(Path("a.csv"), columns, {"time": "s", "Fz": unit}, 3)


@pytest.mark.parametrize("unit", ["V", "counts", "klb", ""])
@pytest.mark.parametrize(
    ("column", "force_N"),
    [
        ({"unit": "kN", "factor": 0.02, "offset": -0.01}, [10, 30, 70]),
        # an offset alone says that the unit is that of the config
        ({"unit": "N", "offset": 3}, [4, 5, 7]),
    ],
)
def test_gain_and_offset_of_a_unit_of_the_files_own(unit, column, force_N):
    column = {"column": "Fz"} | column
    source = ForceLog.model_validate({"columns": {"F3": column}})
    units = {"F3": "N", "time": "s"}
    log = log_columns.map_columns(log_of(unit), source, units, "force_log")
    np.testing.assert_allclose(log.columns["F3"], force_N)
    assert log.units["F3"] == "N"


@pytest.mark.parametrize(
    ("unit", "column", "why"),
    [
        ("V", {"unit": "N"}, "says V, which is no unit of F3: add `factor:`, so many N for"),
        ("V", {"factor": 2.0}, "V is no unit of F3; allowed: N, mN"),
        (
            "lbf",
            {"unit": "N", "factor": 2.0},
            "the file says lbf, the config N: change one of them",
        ),
    ],
)
def test_a_unit_is_never_guessed(unit, column, why):
    source = ForceLog.model_validate({"columns": {"F3": {"column": "Fz", **column}}})
    with pytest.raises(LogError, match=why):
        log_columns.map_columns(log_of(unit), source, {"F3": "N", "time": "s"}, "force_log")


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        (
            "load,unit,G0,G1\nF1,N,1,2\nF2,Nm,1,2\nF2,N,1\nF4,N,1,2\nF3,N,1,x\n",
            ("row 3, unit: found 'Nm'", "row 4: found 'F2'", "row 5: found 'F4'", "row 6: found"),
        ),
        ("load,unit,G0\nF1,N,1\nF2,N,2\n", ("no row for F3",)),
        ("F1,F2\n", ("row 1: found F1, F2; allowed: load, unit",)),
        ("load,unit,G0\n\nF4,N,1\n", ("row 3: found 'F4'",)),  # a blank row is counted
        (f"load,unit,G1\nF1,N,{'1' * 200_000}\n", ("cannot be split into cells",)),
        # a gauge that the log lacks
        ("load,unit,time,G7\nF1,N,0,1\nF2,N,0,1\nF3,N,0,1\n", ("force_log.calibration", "'G7'")),
    ],
)
def test_a_calibration_tells_all_that_is_wrong(tmp_path, text, sentences):
    path = tmp_path / "calibration.csv"
    path.write_text(text)
    with pytest.raises(rftfit.RftfitError) as error:
        log_columns.convert_gauges(log_of("V"), read_calibration(path), {"F1": "N", "F2": "N"})
    assert all(words in str(error.value) for words in sentences)


def test_a_rate_needs_a_time_of_the_log():
    """Of 20 mm at the first row and -1 mm/s, 3 s later 17 mm; time itself has no rate."""
    z = {"constant": 20, "rate": -1, "unit": "mm"}
    clock = {"constant": 0, "rate": 1, "unit": "s"}

    def positions(name_of_time, **columns):
        log = Log(Path("stage.csv"), {name_of_time: np.array([5.0, 6.0, 8.0])}, {"t": "s"}, 3)
        source = MotionLog.model_validate({"columns": columns})
        return log_columns.map_columns(log, source, {"time": "s", "z": "mm"}, "motion_log").columns

    path = positions("t", time={"column": "t"}, z=z)["z"]
    np.testing.assert_allclose(path, [20, 19, 17])
    for name_of_time, name, column in (
        ("t", "z", z),
        ("t", "time", clock),
        ("time", "time", clock),
    ):
        with pytest.raises(LogError, match=f"columns.{name}: ") as error:
            positions(name_of_time, **{name: column})
        assert error.value.code == "columns"
