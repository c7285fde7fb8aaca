"""A campaign of one push around files of `../shared/data/reported`, or around made readings of the same push."""

import shutil
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from campaigns import Folder
from jobs import run_rules
from paper import write_yaml
from shared_data import REPORTED

ALPHA = 1.0186
"""Of the made push, N/cm^3: a disc of 5 cm, 20 N per cm of depth."""
MEDIUM, RUN = "bed", "push"
TEXT = {"delimiter": ","}
COLUMNS = {"time": "Time", "F3": "Force", "z": "z"}
NOT_MEASURED = {name: {"constant": 0, "unit": "N"} for name in ("F1", "F2")}


def campaign_around(
    root, log, columns=None, *, range_N=5000.0, text=None, row=None, reads=None, **sections
):
    """Write config and run sheet of one vertical push around a log: a file of reported, or a path.

    `columns`: Of time, F3 and z, as in the config. `row`: Cells of the sheet beside those of the push, or a list of them for several rows.
    `reads`: Further keys of both logs' sections. `sections`: Of
    the config, in place of its own.
    """
    path = REPORTED / log if isinstance(log, str) else log
    (root / "raw").mkdir(parents=True)
    shutil.copyfile(path, root / "raw" / path.name)
    chosen = {**COLUMNS, **(columns or {})}
    source: dict[str, Any] = {"text": text or TEXT}
    source |= reads or {}
    time = {"time": chosen["time"]} if chosen["time"] else {}
    config = {
        "title": "One push at home",
        "raw": "raw",
        "run_sheet": "config/runs.csv",
        "force_log": {
            **deepcopy(source),
            "columns": {**time, **deepcopy(NOT_MEASURED), "F3": chosen["F3"]},
        },
        "motion_log": {**deepcopy(source), "columns": {**deepcopy(time), "z": chosen["z"]}},
        "clock": {"method": "same_clock"},
        "transducer": {
            "name": "load cell",
            "range_N": [range_N] * 3,
            "precision_N": 0.02,
            "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
        },
        "arm": {"speed_cm_per_s": 0.5},
        "container": {"length_cm": 60, "width_cm": 60, "depth_cm": 40},
        "intruders": {"disc": {"shape": "disc", "diameter_cm": 5, "thickness_cm": 0.5}},
        "media": {MEDIUM: {"title": "a bed"}},
        "fit": {"missing_tare": "flag"},
    }
    write_yaml(root / "config" / "config.yaml", config | sections)
    push = {
        "run_id": RUN,
        "kind": "plate",
        "medium": MEDIUM,
        "intruder": "disc",
        "direction": "intrusion",
        "beta_deg": "0",
        "gamma_deg": "90",
        "force_log": path.name,
        "motion_log": path.name,
    }
    # several rows, each beside the cells of the push, or one
    rows = [push | cells for cells in (row if isinstance(row, list) else [row or {}])]
    sheet = "\n".join([",".join(rows[0]), *(",".join(cells.values()) for cells in rows), ""])
    (root / "config" / "runs.csv").write_text(sheet, encoding="utf-8")
    return Folder(root)


def write_table(path, names, rows):
    """Write a table of text with these lines of cells."""
    path.write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    return path


def measured(folder):
    """Fit of the push, and the flags of its run by code."""
    run_rules(folder.config, "ingest", "tare", "slopes", "checks")
    fit = folder.table(f"fits/{MEDIUM}.csv").iloc[0]
    flags = folder.table(f"flags/{MEDIUM}.csv")
    return fit, dict(zip(flags["code"], flags["words"], strict=True))


def truth():
    """Time (s), height (mm) and force (N) of the made push."""
    with np.load(REPORTED / "truth.npz") as arrays:
        return arrays["t"], arrays["z"], arrays["F"]


COUNTS = {
    "time": {"column": "millis", "unit": "ms"},
    "F3": {"column": "raw", "unit": "N", "factor": 1 / 4200, "offset": -81234 / 4200},
    "z": {"column": "pos", "unit": "mm"},
}
SECONDS = {"column": "sec", "unit": "s", "plus": {"column": "nanosec", "unit": "ns"}}
OF_LONG_TABLE = {"time": {"column": "time", "unit": "s"}, "F3": "Fz", "z": "z"}
OF_BEVAMETER = {
    "columns": {"z": {"column": "Sinkage", "unit": "mm", "factor": -1}, "time": "time"},
    "text": {"delimiter": ",", "skip_lines": 4, "rate_Hz": 10},
    "zero": {"method": "stated", "sd_N": 0.02},
    "intruders": {"disc": {"shape": "disc", "diameter_cm": 4, "thickness_cm": 0.5}},
    "media": {MEDIUM: {"title": "a bed", "role": "natural_sand", "linear_to_cm": 2.4}},
}


@dataclass(frozen=True)
class ReportedPush:
    """A file of reported, what its user writes for it, and what comes of it.

    `settings`: Arguments of `campaign_around`. `alpha`: N/cm^3; NaN where the push is refused. `code`: Of the flag of the run,
    "" for none. `words`: In the reason of a push that is refused.
    """

    log: str
    settings: dict[str, Any] = field(default_factory=dict)
    alpha: float = ALPHA
    code: str = ""
    words: str = ""

    def __str__(self):
        return self.log + "".join(f", {name}" for name in self.settings)


REPORTED_PUSHES = [
    ReportedPush("e1_zeros_0.1.csv", code="lone-readings"),
    ReportedPush("e3_pos_1.csv", code="lone-readings"),
    ReportedPush("m05_hx711.csv", {"columns": COUNTS}, code="lone-readings"),
    ReportedPush("m05_hx711.csv", {"columns": COUNTS, "range_N": 500.0}, code="lone-readings"),
    ReportedPush("m05_hx711_clean.csv", {"columns": COUNTS}),
    ReportedPush("g5_pos_noise_0.3mm.csv"),
    ReportedPush("g3_clock_step_0.5s.csv", code="gap"),
    ReportedPush(
        "m50_long_format.csv",
        {"columns": OF_LONG_TABLE, "reads": {"where": {"sensor": "ft_plate"}}},
    ),
    ReportedPush(
        "m50_long_format.csv",
        {"columns": OF_LONG_TABLE},
        np.nan,
        words="`where: {sensor: ft_other}`",
    ),
    ReportedPush("m51_bevameter_clean.txt", OF_BEVAMETER, 3.39716, code="cut-rows"),
    ReportedPush(
        "m51_bevameter_clean.txt",
        OF_BEVAMETER | {"arm": {"speed_cm_per_s": 0.5, "drive": "uneven"}},
        3.39716,
        code="cut-rows",
    ),
    ReportedPush(
        "m03_sec_nanosec.csv",
        {"columns": {"time": SECONDS, "F3": {"column": "force_z", "unit": "N"}, "z": "z"}},
    ),
]
