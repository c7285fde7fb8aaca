"""A campaign of one push around files of `../shared/data/reported`, or around made readings of the same push."""

import shutil
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from campaigns import Folder
from jobs import run_rules
from paper import write_yaml

REPORTED = Path(__file__).parents[3] / "shared" / "data" / "reported"
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
