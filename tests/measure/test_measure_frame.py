"""Sensor readings become force and position in the lab frame as its definition says."""

from pathlib import Path

import numpy as np
import pytest
from pushes import plate_run

from rftfit.campaign.config import Arm, MotionLog
from rftfit.logs.base import Log, LogError
from rftfit.measure.lab_frame import path_in_lab_frame
from rftfit.measure.log_columns import complete_motion_log, map_columns


def test_a_rate_needs_a_time_of_the_log():
    """Of 20 mm at the first row and -1 mm/s, 3 s later 17 mm; time itself has no rate."""
    log = Log(Path("stage.csv"), {"t": np.array([5.0, 6.0, 8.0])}, {"t": "s"}, 3)
    units = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
    z = {"constant": 20, "rate": -1, "unit": "mm"}
    source = MotionLog.model_validate({"columns": {"time": {"column": "t"}, "z": z}})
    path = map_columns(log, source, units, "motion_log").columns["z"]
    np.testing.assert_allclose(path, [20, 19, 17])
    clock = {"constant": 0, "rate": 1, "unit": "s"}
    for columns, quantity in (({"z": z}, "z"), ({"time": clock}, "time")):
        source = MotionLog.model_validate({"columns": columns})
        with_time = Log(Path("stage.csv"), {"time": np.arange(3.0)}, {"time": "s"}, 3)
        for log_or_clock in (log, with_time)[: 1 + (quantity == "time")]:
            with pytest.raises(LogError, match=f"columns.{quantity}: ") as error:
                map_columns(log_or_clock, source, units, "motion_log")
            assert error.value.code == "columns"


def test_the_surface_is_stated_in_readings_after_factor_and_offset():
    """A stage that counts downward reads 60 mm at the surface and 100 mm at the end of the push."""
    position = {"column": "p", "unit": "mm", "factor": -1}
    source = MotionLog.model_validate({"columns": {"time": {"column": "t"}, "z": position}})
    readings = {"t": np.arange(3.0), "p": np.array([40.0, 60.0, 100.0])}
    log = Log(Path("stage.csv"), readings, {"t": "s", "p": "mm"}, 3)
    units = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
    run = plate_run("push", medium="sand")
    counted = complete_motion_log(map_columns(log, source, units, "motion_log"), run, units)
    path = path_in_lab_frame(counted, run, Arm(surface_z_mm=-60))
    np.testing.assert_allclose(path.z, [2.0, 0.0, -4.0])


def test_an_offset_alone_says_that_the_unit_is_that_of_the_quantity():
    height = np.array([1.0, 2.0])
    log = Log(Path("a.csv"), {"height": height}, {"height": "V"}, 2)
    entries = {"z": {"column": "height", "offset": 3, "unit": "mm"}}
    entries |= {name: {"constant": 0, "unit": "mm"} for name in ("x",)}
    source = MotionLog.model_validate({"columns": entries})
    mapped = map_columns(log, source, {"z": "mm", "x": "mm"}, "motion_log")
    assert mapped.columns["z"].tolist() == [4.0, 5.0]
