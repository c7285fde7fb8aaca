"""Third-party files in `../shared/data`, which developers have beside their clone, and campaigns around them."""

import csv
import gzip
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import Folder, run_rules
from makers import NOT_MEASURED, bench_config, data_of, json_of, row_of_push, write_campaign
from mistakes import ALL

from rftfit.campaign.config import ForceLog, MotionLog
from rftfit.logs.inspect import recognised, recording, survey_file
from rftfit.logs.registry import source_reader
from rftfit.measure.log_columns import columns_asked, map_columns

# --- Third-party files in `../shared/data`, which developers have beside their clone and a stranger has not -------
# Third-party files in `../shared/data`, which developers have beside their clone and a stranger has not.

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CMU_SAND = SHARED_DATA / "cmu-sand"
LOGS = SHARED_DATA / "logs"
EDGES = SHARED_DATA / "edges"
REPORTED = SHARED_DATA / "reported"
YADE_WHEEL = SHARED_DATA / "yade-wheel"
ROBOT_LEG = SHARED_DATA / "robot-leg"
WHEELS_MEASURED = SHARED_DATA / "wheels-measured"


def needs(path):
    """Mark tests that are skipped where a file or folder of `../shared/data` is absent."""
    return pytest.mark.skipif(not path.exists(), reason=reason_absent(path))


def reason_absent(path):
    """Reason by which skipped tests are counted: the folder that is absent."""
    return f"../shared/data/{path.relative_to(SHARED_DATA).parts[0]} is absent"


# --- The files of `../shared/data/reported`, and a campaign of one push around one of them ------------------------

UNITS = {
    **dict.fromkeys(("F1", "F2", "F3"), "N"),
    **dict.fromkeys(("T1", "T2", "T3"), "N m"),
    **dict.fromkeys(("x", "z"), "mm"),
    "time": "s",
    "angle": "deg",
    "arm_moving": "",
}


def printed_proposal(path):
    """Return what `rftfit inspect` prints for the config, as YAML reads it."""
    lines = json_of("inspect", path)["config"]
    return yaml.load("\n".join(lines), Loader=yaml.CSafeLoader) or {}


def inspected(path):
    """Return what `rftfit inspect` finds in a log, and what it proposes for the config."""
    surveys, _ = survey_file(recognised(recording(path)).reader, recording(path))
    return surveys, printed_proposal(path)


def proposal(path):
    """Return what `rftfit inspect` proposes for the config."""
    return inspected(path)[1]


def read_by(path, proposed):
    """Read a log as `rftfit check` does, by the sections of a config: key to the log."""
    logs = {}
    for key, model in (("force_log", ForceLog), ("motion_log", MotionLog)):
        if key in proposed:
            source: Any = model.model_validate(proposed[key])
            reader = source_reader(source, "rig", key).only(columns_asked(source))
            log = logs[key] = map_columns(reader.load(recording(path)), source, UNITS, key)
            # a time that stays unnamed, since it is too coarse, has none
            names = {name for name in UNITS.keys() & log.columns.keys() if log.units[name]}
            assert {name: log.units[name] for name in names} == {
                name: UNITS[name] for name in names
            }
            assert names >= source.columns.keys() - {"arm_moving"}
    return logs


def truth():
    """Return the push that the files hold: t in s, z in mm, forces in N."""
    with np.load(REPORTED / "truth.npz") as arrays:
        return {name: arrays[name] for name in arrays}


# --- A campaign of one push around a file of `../shared/data/reported`, or around made readings of the same push --

ALPHA = 1.0186
"""Of the made push, N/cm^3: a disc of 5 cm, 20 N per cm of depth."""
MEDIUM, RUN = "bed", "push"
COLUMNS = {"time": "Time", "F3": "Force", "z": "z"}


def write_push(root, path, force_log, motion_log, cells=None, logs=None, **sections):
    """Write config and run sheet of one vertical push whose two logs are one file.

    `cells`: Of the sheet beside those of the push, or a list of them for several rows. `logs`: Further files.
    `sections`: Of the config, in place of its own.
    """
    bench = {
        "arm": {"speed_cm_per_s": 0.5},
        "intruders": {"disc": {"shape": "disc", "diameter_cm": 5, "thickness_cm": 0.5}},
        "media": {MEDIUM: {"title": "a bed"}},
    }
    config = bench_config(force_log, motion_log, **bench | sections)
    push = row_of_push(
        run_id=RUN, medium=MEDIUM, intruder="disc", force_log=path.name, motion_log=path.name
    )
    rows = [push | row for row in (cells if isinstance(cells, list) else [cells or {}])]
    write_campaign(root, config, rows=rows, logs={path.name: path.read_bytes()} | (logs or {}))
    return Folder(root)


def campaign_around(
    root, log, columns=None, *, range_N=5000.0, text=None, row=None, reads=None, **sections
):
    """Write a campaign of one push around a log: a file of reported, or a path.

    `columns`: Of time, F3 and z, as in the config. `row`: Cells, as of `write_push`. `reads`: Further keys of both logs'
    sections.
    """
    path = REPORTED / log if isinstance(log, str) else log
    chosen = COLUMNS | (columns or {})
    source: dict[str, Any] = dict(reads or {})
    if "dialect" not in source:
        source["text"] = text or {"delimiter": ","}
    time = {"time": chosen["time"]} if chosen["time"] else {}
    return write_push(
        root,
        path,
        source | {"columns": time | NOT_MEASURED | {"F3": chosen["F3"]}},
        source | {"columns": time | {"z": chosen["z"]}},
        row,
        transducer={"range_N": [range_N] * 3, "precision_N": 0.02},
        **sections,
    )


def alpha_of(root, path, proposed):
    """Return alpha_z of the push of a log that is read as proposed, and the codes of the flags of its run."""
    columns = NOT_MEASURED | {"F3": NOT_MEASURED["F1"]} | proposed["force_log"].get("columns", {})
    sections = {
        "arm": {"speed_cm_per_s": 0.5, "surface_z_mm": 0},
        "media": {MEDIUM: {"title": "a made sand", "role": "natural_sand", "linear_to_cm": 4}},
    }
    sections |= proposed | {"force_log": proposed["force_log"] | {"columns": columns}}
    fit, flags = measured(write_push(root, path, **sections))
    alpha = float(fit["alpha_z_N_per_cm3"])
    assert np.isfinite(alpha), fit["reason"]
    return alpha, [*flags]


def write_table(path, names, rows):
    """Write a table of text with these lines of cells."""
    path.write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    return path


def measured(folder):
    """Fit of the push, and the flags of its run by code."""
    stages = ("ingest", "tare", "slopes")
    run_rules(folder.config, *stages)
    fit = folder.table(f"fits/{MEDIUM}.csv").iloc[0]
    flags = pd.concat([folder.table(f"flags/{stage}/{MEDIUM}.csv") for stage in stages])
    return fit, dict(zip(flags["code"], flags["words"], strict=True))


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


REPORTED_PUSHES = [ReportedPush(**push) for push in data_of("reported_pushes")["push"]]


# --- A campaign around each real log of `../shared/data/logs`, from what `rftfit inspect` proposes for it ---------

PLATE_CM = 3.0


@dataclass(frozen=True)
class RealLog:
    """One log, what a user adds to the proposal, and what must come of it.

    `rows`: Data lines; `lost`: samples that the instrument counted and the file lacks.
    `section`: Columns of the force log, where the proposal names none, or its dialect, too.
    `motion`: Columns of the motion log beside or in place of those proposed; default: a steady push.
    `words`: What the reason says, or the flags.
    """

    file: str
    outcome: str
    rows: int
    lost: int = 0
    words: str = ""
    section: dict[str, Any] = field(default_factory=dict)
    motion: dict[str, Any] = field(default_factory=dict)
    zero_log: str = ""
    speed_mm_per_s: float = 2.0
    stroke: str = ""

    def __str__(self):
        z = self.motion.get("z", {})
        gain = self.section.get("columns", {}).get("F3", {})
        gain_text = ", gain" if isinstance(gain, dict) and "factor" in gain else ""
        motion_text = "".join(f", z {key} {z[key]}" for key in ("factor", "rate") if key in z)
        return self.file.replace("/", " ") + motion_text + gain_text


REAL_LOGS = [RealLog(**log) for log in data_of("real_logs")["log"]]


def campaign_around_log(log, root):
    """Write config, run sheet and log as a user of `inspect` would; what the log lacks is constant."""
    proposed = {} if "dialect" in log.section else printed_proposal(LOGS / log.file)
    force = {"columns": {}} | proposed.get("force_log", {}) | log.section
    force["columns"] = NOT_MEASURED | force["columns"]
    of_force = {name: column for name, column in force["columns"].items() if name == "time"}
    motion = proposed.get("motion_log", force | {"columns": of_force})
    steady = {
        "x": {"constant": 0, "unit": "mm"},
        "z": {"constant": 0, "unit": "mm", "rate": -log.speed_mm_per_s},
    }
    motion["columns"] = steady | motion["columns"] | log.motion
    plate = {"shape": "plate", "length_cm": PLATE_CM, "width_cm": PLATE_CM, "thickness_cm": 0.6}
    zero_log = LOGS / log.zero_log
    return write_push(
        root,
        LOGS / log.file,
        force,
        motion,
        {"intruder": "plate", "stroke": log.stroke}
        | ({"zero_log": zero_log.name} if log.zero_log else {}),
        logs={zero_log.name: zero_log.read_bytes()} if log.zero_log else {},
        transducer={"range_N": [10000, 10000, 10000]},
        zero={} if log.zero_log else {"method": "stated", "sd_N": 0.05},
        arm={"speed_cm_per_s": log.speed_mm_per_s / 10},
        intruders={"plate": plate},
        fourier={"draws": 200},
    )


def judge(log, folder, *, page):
    """Say what is wrong with the tables of such a campaign, and with its page."""
    wrong = []
    ledger = folder.table("ledger.csv")
    lost = ledger["fate"] == "lost"
    if (count := int(ledger.loc[~lost, "rows"].sum())) != log.rows:
        wrong.append(f"{count} rows in the ledger, {log.rows} in the file")
    if (count := int(ledger.loc[lost, "rows"].sum())) != log.lost:
        wrong.append(f"{count} lost samples in the ledger, not {log.lost}")
    fit = folder.table(f"fits/{MEDIUM}.csv").iloc[0]
    checks = folder.table(f"checks/{MEDIUM}.csv")["sentence"].dropna()
    flags = folder.table(f"flags/{MEDIUM}.csv")["words"]
    sentences = "; ".join([str(fit["reason"]), *flags, *map(str, checks)])
    if log.words not in sentences:
        wrong.append(f"{log.words!r} is not in {sentences!r}")
    html = folder.root / "results" / "report.html"
    if page:
        text = " ".join(html.read_text(encoding="utf-8").split())
        untrue = [
            'id="reproduction"' in text,
            'href="#viewer"' in text,
            "was fitted with" in text,
            (log.outcome == ALL) == ("1 dropped." in text),
            "subtracted at the same" in text,
        ]
        if log.words not in text or any(untrue):
            wrong.append(f"the page lacks {log.words!r}, or says what is not so: {untrue}")
    if log.outcome == ALL and log.file in OTHERWISE and "z" in log.motion:
        apart = slope_apart(log, fit)
        if not apart < 1e-3:
            wrong.append(f"alpha_z is {apart:.2%} off the slope of another reader's numbers")
    if (log.outcome == ALL) != bool(np.isfinite(fit["alpha_z_N_per_cm3"])):
        wrong.append(f"alpha_z is {fit['alpha_z_N_per_cm3']!r}")
    return wrong


def by_csv(path, delimiter, header):
    """Numbers of a text below so many rows."""
    content = path.read_bytes()
    lines = (gzip.decompress(content) if path.suffix == ".gz" else content).decode().splitlines()
    rows = [row for row in csv.reader(lines, delimiter=delimiter) if any(row)][header:]
    return np.array([[float(cell) for cell in row if cell] for row in rows])


def by_openpyxl(path, sheet, width, header):
    """Numbers of a sheet below so many rows."""
    book: Any = import_module("openpyxl").load_workbook(path, data_only=True)
    rows = book[sheet].iter_rows(min_row=header + 1, max_col=width, values_only=True)
    return np.array([row for row in rows if row[0] is not None], dtype=float)


WRENCH = dict(zip(["F1", "F2", "F3", "T1", "T2", "T3"], range(1, 7), strict=True))
OTHERWISE: dict[str, tuple[Callable[[Path], np.ndarray], dict[str, int], float]] = {
    "instron/cyclic_W27_PA_Cream.csv": (
        lambda path: by_csv(path, ",", 2),
        {"time": 0, "z": 1, "F3": 2},
        1.0,
    ),
    "texture_analyser/frame_stiffness.tab.gz": (
        lambda path: by_csv(path, "\t", 3),
        {"F3": 0, "z": 1, "time": 2},
        9.80665e-3,
    ),
    "ur_rtde/record_2023-07-03.csv": (
        lambda path: by_csv(path, ",", 1),
        {"time": 0, **WRENCH},
        1.0,
    ),
    "zwick/Traction-10.xlsx": (
        lambda path: by_openpyxl(path, "Values Specimen 10", 5, 3),
        {"time": 0, "F3": 1, "z": 3},
        1.0,
    ),
}
"""Of a file: another reader, the columns of the quantities, newtons of its unit of force."""


def slope_apart(log, fit):
    """How far the slope of a fit is from that of the numbers another reader finds within its window, relative."""
    reader, columns, newtons = OTHERWISE[log.file]
    table = reader(LOGS / log.file)
    depth = -log.motion["z"]["factor"] * table[:, columns["z"]] / 10
    stress = table[:, columns["F3"]] * newtons / PLATE_CM**2
    # where the stroke ends the fit says: it is not sought here once more
    inside = np.flatnonzero(depth >= fit["depth_from_cm"] - 1e-6)[: int(fit["n_points"])]
    slope = (stress * depth)[inside].sum() / (depth**2)[inside].sum()
    return float(abs(fit["alpha_z_N_per_cm3"] / slope - 1))
