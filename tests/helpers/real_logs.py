"""A campaign around each real log of `../shared/data/logs`, from what `rftfit inspect` proposes for it."""

import csv
import gzip
import shutil
import textwrap
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from agreement import ALL, NOTHING
from campaigns import Folder
from paper import write_yaml
from shared_data import LOGS

PLATE_CM = 3.0
MEDIUM, RUN = "bed", "push"
NETFT, DAQ = "ati_netft/R2_2018_", "ati_daq/log_2023"
VOLTS = {"column": "First  Channel", "unit": "N"}
THROUGH = {"F1": "Fx", "F2": "Fy", "F3": "Fz"}


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


REAL_LOGS = [
    RealLog(
        f"{DAQ}1002_10inch1R_test2.csv",
        NOTHING,
        0,
        words="a header and no data",
        section={"dialect": "ati-daq", "columns": THROUGH},
    ),
    RealLog(f"{DAQ}1008_13inch_auto7.csv", ALL, 22512, speed_mm_per_s=1.0),
    RealLog(f"{NETFT}04_11_Thrust_Acro", ALL, 8412, 1961, words="lost packets"),
    RealLog(
        f"{NETFT}04_11_Thrust_Acro_actually",
        NOTHING,
        0,
        words="a header and no data",
        section={"dialect": "ati-netft", "columns": THROUGH},
    ),
    RealLog(
        f"{NETFT}07_20_manual01",
        NOTHING,
        0,
        words="Force Units: ?",
        section={"dialect": "ati-netft", "columns": THROUGH},
    ),
    RealLog(f"{NETFT}07_23_manual02_FT", ALL, 7344),
    # a tensile test: the crosshead goes up
    RealLog("instron/Tensile_test_PE.csv", NOTHING, 12660, words="surface not reached"),
    RealLog(
        "instron/Tensile_test_PE.csv",
        ALL,
        12660,
        words="digits regrouped",
        motion={"z": {"column": "Displacement", "unit": "mm", "factor": -1}},
        speed_mm_per_s=0.8,
    ),
    RealLog(
        "instron/Tensile_test_PE.csv",
        ALL,
        12660,
        speed_mm_per_s=0.8,
        motion={"z": {"constant": 0, "unit": "mm", "rate": -0.8}},
    ),
    # down and straight back, from contact on
    RealLog(
        "instron/cyclic_W27_PA_Cream.csv",
        ALL,
        239,
        speed_mm_per_s=5.0,
        motion={"z": {"column": "Extension", "unit": "mm", "factor": -1}},
    ),
    # over 2 mm: lengths are ten times as long here, for a stroke has 3 mm at least
    RealLog(
        "texture_analyser/frame_stiffness.tab.gz",
        ALL,
        80001,
        speed_mm_per_s=0.1,
        motion={"z": {"column": "Distance", "unit": "mm", "factor": -10}},
    ),
    RealLog("ur_rtde/record_2023-07-03.csv", ALL, 392),
    # a tensile test, over 1 mm: what pulls counts as a push here
    # and the specimen slips towards the end
    RealLog(
        "zwick/Traction-10.xlsx",
        ALL,
        3900,
        speed_mm_per_s=0.125,
        stroke="1",
        motion={"z": {"column": "Standard travel", "unit": "mm", "factor": -10}},
    ),
    RealLog(
        "zwick/Traction-10.xlsx",
        NOTHING,
        3900,
        words="surface not reached",
        motion={"z": {"column": "Standard travel", "unit": "mm", "factor": -1}},
    ),
    RealLog(
        "labview/short.lvm",
        NOTHING,
        10,
        words="surface not reached",
        section={"columns": {"F3": "Excitation"}},
    ),
    RealLog(
        "labview/with_comments.lvm",
        NOTHING,
        9,
        words="MPa is no unit of F3",
        section={"columns": {"F3": "Pressão ABS."}},
    ),
    RealLog("ros1/ur3_wrench.bag", ALL, 7718, zero_log="ros1/ur3_wrench_noforces.bag"),
    RealLog("ros1/ur3_wrench.csv", ALL, 7718, zero_log="ros1/ur3_wrench_noforces.csv"),
    RealLog(
        "ros1/ur3_wrench_noforces.bag", ALL, 2462, words="1 of 1 cells would push the plate along"
    ),
    RealLog(
        "ros1/ur3_wrench_noforces.csv", ALL, 2462, words="1 of 1 cells would push the plate along"
    ),
    RealLog(
        "tdms/raw1.tdms",
        NOTHING,
        2000,
        words="add `factor:`, so many N for each Volts",
        section={"columns": {"F3": VOLTS}},
    ),
    RealLog(
        "tdms/raw1.tdms",
        NOTHING,
        2000,
        words="surface not reached",
        section={"columns": {"F3": VOLTS | {"factor": 20}}},
    ),
]


def campaign_around(log, root):
    """Write config, run sheet and log as a user of `inspect` would; what the log lacks is constant."""
    (root / "raw").mkdir(parents=True)
    for name in filter(None, (log.file, log.zero_log)):
        shutil.copyfile(LOGS / name, root / "raw" / Path(name).name)
    name, zero_log = Path(log.file).name, Path(log.zero_log).name if log.zero_log else ""
    folder = Folder(root)
    inspected = folder.rftfit("inspect", f"raw/{name}")
    _, _, proposed = inspected.stdout.partition("for config.yaml")
    block: dict[str, Any] = yaml.safe_load(textwrap.dedent(proposed.partition("\n")[2])) or {}
    force = {"columns": {}, **block.get("force_log", {})}
    force |= log.section
    nobody_measured = {name: {"constant": 0, "unit": "N"} for name in ("F1", "F2")}
    force["columns"] = nobody_measured | force["columns"]
    of_force = {name: column for name, column in force["columns"].items() if name == "time"}
    motion = block.get("motion_log", deepcopy({**force, "columns": of_force}))
    steady = {
        "x": {"constant": 0, "unit": "mm"},
        "z": {"constant": 0, "unit": "mm", "rate": -log.speed_mm_per_s},
    }
    motion["columns"] = steady | motion["columns"] | log.motion
    config = {
        "title": f"A campaign around {name}",
        "raw": "raw",
        "run_sheet": "config/runs.csv",
        "force_log": force,
        "motion_log": motion,
        "clock": {"method": "same_clock"},
        "transducer": {
            "name": "as recorded",
            "range_N": [10000, 10000, 10000],
            "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
        },
        "zero": {} if zero_log else {"method": "stated", "sd_N": 0.05},
        "arm": {"speed_cm_per_s": log.speed_mm_per_s / 10},
        "container": {"length_cm": 60, "width_cm": 60, "depth_cm": 40},
        "intruders": {
            "plate": {
                "shape": "plate",
                "length_cm": PLATE_CM,
                "width_cm": PLATE_CM,
                "thickness_cm": 0.6,
            }
        },
        "media": {MEDIUM: {"title": "a bed"}},
        "fit": {"missing_tare": "flag"},
        "fourier": {"draws": 200},
    }
    write_yaml(folder.config, config)
    row = {
        "run_id": RUN,
        "kind": "plate",
        "medium": MEDIUM,
        "intruder": "plate",
        "direction": "intrusion",
        "beta_deg": "0",
        "gamma_deg": "90",
        "force_log": name,
        "motion_log": name,
        "zero_log": zero_log,
        "stroke": log.stroke,
    }
    sheet = "\n".join([",".join(row), ",".join(row.values())]) + "\n"
    (root / "config" / "runs.csv").write_text(sheet, encoding="utf-8")
    return folder


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


# --- The same numbers by other readers: Python's own of tables, and the library of workbooks as a whole


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
