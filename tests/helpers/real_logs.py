"""A campaign around each real log of `../shared/data/logs`, from what `rftfit inspect` proposes for it."""

from __future__ import annotations

import shutil
import textwrap
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from agreement import ALL, NOTHING
from campaigns import Folder

LOGS = Path(__file__).parents[3] / "shared" / "data" / "logs"
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

    def __str__(self) -> str:
        z = self.motion.get("z", {})
        gain = self.section.get("columns", {}).get("F3", {})
        more = ", gain" if isinstance(gain, dict) and "factor" in gain else ""
        how = "".join(f", z {key} {z[key]}" for key in ("factor", "rate") if key in z)
        return self.file.replace("/", " ") + how + more


REAL_LOGS = [
    RealLog(f"{DAQ}1002_10inch1R_test2.csv", NOTHING, 0, words="a header and no data",
            section={"dialect": "ati-daq", "columns": THROUGH}),
    RealLog(f"{DAQ}1008_13inch_auto7.csv", ALL, 22512, speed_mm_per_s=1.0),
    RealLog(f"{NETFT}04_11_Thrust_Acro", ALL, 8412, 1961, words="lost packets"),
    RealLog(f"{NETFT}04_11_Thrust_Acro_actually", NOTHING, 0, words="a header and no data",
            section={"dialect": "ati-netft", "columns": THROUGH}),
    RealLog(f"{NETFT}07_20_manual01", NOTHING, 0, words="Force Units: ?",
            section={"dialect": "ati-netft", "columns": THROUGH}),
    RealLog(f"{NETFT}07_23_manual02_FT", ALL, 7344),
    # a tensile test: the crosshead goes up
    RealLog("instron/Tensile_test_PE.csv", NOTHING, 12660, words="surface not reached"),
    RealLog("instron/Tensile_test_PE.csv", ALL, 12660, words="digits regrouped",
            motion={"z": {"column": "Displacement", "unit": "mm", "factor": -1}}, speed_mm_per_s=0.8),
    RealLog("instron/Tensile_test_PE.csv", ALL, 12660, speed_mm_per_s=0.8,
            motion={"z": {"constant": 0, "unit": "mm", "rate": -0.8}}),
    RealLog("labview/short.lvm", NOTHING, 10, words="surface not reached",
            section={"columns": {"F3": "Excitation"}}),
    RealLog("labview/with_comments.lvm", NOTHING, 9, words="MPa is no unit of F3",
            section={"columns": {"F3": "Pressão ABS."}}),
    RealLog("ros1/ur3_wrench.bag", ALL, 7718, zero_log="ros1/ur3_wrench_noforces.bag"),
    RealLog("ros1/ur3_wrench.csv", ALL, 7718, zero_log="ros1/ur3_wrench_noforces.csv"),
    RealLog("ros1/ur3_wrench_noforces.bag", ALL, 2462, words="1 of 1 cells give energy back"),
    RealLog("ros1/ur3_wrench_noforces.csv", ALL, 2462, words="1 of 1 cells give energy back"),
    RealLog("tdms/raw1.tdms", NOTHING, 2000, words="add `factor:`, so many N for each Volts",
            section={"columns": {"F3": VOLTS}}),
    RealLog("tdms/raw1.tdms", NOTHING, 2000, words="surface not reached",
            section={"columns": {"F3": VOLTS | {"factor": 20}}}),
]  # fmt: skip


def campaign_around(log: RealLog, root: Path) -> Folder:
    """Write config, run sheet and log as a user of `inspect` would; what the log lacks is constant."""
    (root / "raw").mkdir(parents=True)
    for name in filter(None, (log.file, log.zero_log)):
        shutil.copyfile(LOGS / name, root / "raw" / Path(name).name)
    name, zero_log = Path(log.file).name, Path(log.zero_log).name if log.zero_log else ""
    folder = Folder(root)
    said = folder.rftfit("inspect", f"raw/{name}")
    _, _, proposed = said.stdout.partition("for config.yaml")
    block: dict[str, Any] = yaml.safe_load(textwrap.dedent(proposed.partition("\n")[2])) or {}
    force = {"columns": {}, **block.get("force_log", {})}
    force |= log.section
    nobody_measured = {name: {"constant": 0, "unit": "N"} for name in ("F1", "F2")}
    force["columns"] = nobody_measured | force["columns"]
    motion = block.get("motion_log", {"dialect": force["dialect"], "columns": {}})
    steady = {"x": {"constant": 0, "unit": "mm"},
              "z": {"constant": 0, "unit": "mm", "rate": -log.speed_mm_per_s}}  # fmt: skip
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
            "range_N": [500, 500, 500],
            "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
        },
        "zero": {} if zero_log else {"method": "stated", "sd_N": 0.05},
        "arm": {"speed_cm_per_s": log.speed_mm_per_s / 10},
        "container": {"length_cm": 60, "width_cm": 60, "depth_cm": 40},
        "intruders": {
            "plate": {"shape": "plate", "length_cm": 3, "width_cm": 3, "thickness_cm": 0.6}
        },
        "media": {MEDIUM: {"title": "a bed"}},
        "fit": {"missing_tare": "flag"},
        "fourier": {"draws": 200},
    }
    folder.config.parent.mkdir()
    text = yaml.safe_dump(config, sort_keys=False, allow_unicode=True)
    folder.config.write_text(text, encoding="utf-8")
    row = {"run_id": RUN, "kind": "plate", "medium": MEDIUM, "intruder": "plate",
           "direction": "intrusion", "beta_deg": "0", "gamma_deg": "90", "force_log": name,
           "motion_log": name, "zero_log": zero_log}  # fmt: skip
    sheet = "\n".join([",".join(row), ",".join(row.values())]) + "\n"
    (root / "config" / "runs.csv").write_text(sheet, encoding="utf-8")
    return folder


def judge(log: RealLog, folder: Folder, *, page: bool) -> list[str]:
    """Say what is wrong with the tables of such a campaign, and with its page."""
    wrong = []
    ledger = folder.table("ledger.csv")
    lost = ledger["fate"] == "lost"
    if (found := int(ledger.loc[~lost, "rows"].sum())) != log.rows:
        wrong.append(f"{found} rows in the ledger, {log.rows} in the file")
    if (found := int(ledger.loc[lost, "rows"].sum())) != log.lost:
        wrong.append(f"{found} lost samples in the ledger, not {log.lost}")
    fit = folder.table(f"fits/{MEDIUM}.csv").iloc[0]
    checks = folder.table(f"checks/{MEDIUM}.csv")["sentence"].dropna()
    said = "; ".join([str(fit["reason"]), str(fit["flags"]), *map(str, checks)])
    if log.words not in said:
        wrong.append(f"{log.words!r} is not in {said!r}")
    html = folder.root / "results" / "report.html"
    if page:
        text = " ".join(html.read_text(encoding="utf-8").split())
        untrue = ['id="reproduction"' in text, 'href="#viewer"' in text, "was fitted with" in text,
                  (log.outcome == ALL) == ("1 dropped." in text), "subtracted at the same" in text]  # fmt: skip
        if log.words not in text or any(untrue):
            wrong.append(f"the page lacks {log.words!r}, or says what is not so: {untrue}")
    if (log.outcome == ALL) != bool(np.isfinite(fit["alpha_z_N_per_cm3"])):
        wrong.append(f"alpha_z is {fit['alpha_z_N_per_cm3']!r}")
    return wrong
