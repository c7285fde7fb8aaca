"""Campaigns of other labs: grids and protocols that are not the paper's, re-enacted."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from paper import enact, paper_values

from rftfit.lab.plan import parse_directions
from rftfit.lab.truth import table_s5

GRIDS = {
    "coarse": "-30,0,30,90 x -90,-60,-30,0,30,60,90",
    "other": "-75,-40,-10,20,55,80 x -70,-45,-25,25,45,70",
    "no-vertical": "-60,-20,20,60 x -75,-50,-20,20,50,75",
    "one-row": "0 x -90,-60,-30,30,60,90",
    "scattered": "scattered:25",
    "straight-down": "-60,-30,0,30,60 x 90",
    "one-push": "0:90",
}
SECTIONS = {
    "paper": {},
    "no-pause": {},
    "stroke-only": {"clock": {"method": "same_clock"}, "zero": {"method": "stated", "sd_N": 0.02}},
    "separate-zero": {"clock": {"method": "same_clock"}},
    "one-file": {"clock": {"method": "same_clock"}},
    "cyclic": {"clock": {"method": "same_clock"}},
    "constant-speed": {
        "clock": {"method": "same_clock"},
        "zero": {"method": "stated", "sd_N": 0.02},
        "motion_log": {
            "columns": {"time": "time", "z": {"constant": 150.2, "unit": "mm", "rate": -10}}
        },
    },
}
MEDIUM = "poppy_CP"
CELLS_OF_ONE = 0.8
"""Part of the numbers of one small campaign whose 95 % intervals must hold the truth."""


@dataclass(frozen=True)
class Case:
    """One campaign."""

    grid: str
    protocol: str
    tare: bool = True
    legs: bool = False
    dialect: str = "rig"

    def __str__(self):
        suffix = ("" if self.tare else ", no tare") + (", legs" if self.legs else "")
        suffix += "" if self.dialect == "rig" else f", {self.dialect}"
        return f"{self.grid}, {self.protocol}{suffix}"


CASES = [
    *(
        Case(grid, protocol)
        for grid in ("coarse", "other", "no-vertical", "one-row", "scattered")
        for protocol in ("paper", "no-pause", "stroke-only", "separate-zero", "one-file")
    ),
    Case("one-push", "paper"),
    Case("one-push", "stroke-only", tare=False),
    Case("coarse", "paper", tare=False),
    Case("coarse", "one-file", tare=False, legs=True),
    Case("scattered", "stroke-only", tare=False),
    Case("other", "paper", legs=True),
    Case("coarse", "separate-zero", legs=True),
    Case("coarse", "cyclic"),
    Case("scattered", "cyclic"),
    Case("straight-down", "constant-speed"),
    Case("straight-down", "cyclic", dialect="xlsx"),
    *(Case("coarse", "one-file", dialect=dialect) for dialect in ("instron", "lvm", "tdms")),
    *(Case("coarse", "paper", dialect=dialect) for dialect in ("delimited", "parquet", "arrays")),
]


def make(folder, case):
    """Write the campaign of a case: configuration, logs and run sheet."""
    values = paper_values("robot")
    values["media"] = {MEDIUM: {"title": "close poppy seeds", "published_as": MEDIUM}}
    values |= SECTIONS[case.protocol]
    values["fit"]["missing_tare"] = "flag"
    if case.dialect == "delimited":
        del values["dialect"]
        values |= {log: {"text": {"delimiter": ","}} for log in ("force_log", "motion_log")}
    else:
        values["dialect"] = case.dialect
    cells = parse_directions(GRIDS[case.grid], 2013)
    enact(folder, values, protocol=case.protocol, directions=cells, tare=case.tare, legs=case.legs)


def judge(folder, case, held):
    """What came out, in words, and what is wrong with it; `held` takes which numbers hold the truth."""
    planned_directions = set(parse_directions(GRIDS[case.grid], 2013))
    table = pd.read_csv(folder / "results" / "alpha" / f"{MEDIUM}.csv")
    measured_directions = set(zip(table["beta_deg"], table["gamma_deg"], strict=True))
    wrong = (
        []
        if measured_directions == planned_directions
        else [f"{len(planned_directions - measured_directions)} directions without a row"]
    )
    if not (folder / "results" / "report.html").is_file():
        wrong.append("no page")
    inside, off = [], []
    for row in table.to_dict("records"):
        for c, true in zip("zx", table_s5(MEDIUM, row["beta_deg"], row["gamma_deg"]), strict=True):
            name = f"alpha_{c}{{}}_N_per_cm3"
            inside.append(row[name.format("_lo")] <= true <= row[name.format("_hi")])
            off.append(abs(row[name.format("")] - true))
    share = float(np.mean(inside))
    held += inside if case.tare else []
    fits, flags = (
        pd.read_csv(folder / "results" / name / f"{MEDIUM}.csv") for name in ("fits", "flags")
    )
    bare = set(flags.loc[flags["code"] == "no-tare", "run_id"])
    if case.tare and share < CELLS_OF_ONE:
        wrong.append("too few cells hold the truth")
    if not case.tare and not bare.issuperset(fits["run_id"]):
        wrong.append("a run without a tare is not flagged")
    if np.isnan(off).any():
        wrong.append(f"{int(np.isnan(off).sum()) // 2} cells without alpha")
    return (
        f"{len(table)} cells, {100 * share:.0f} % hold the truth, worst off {max(off):.4f}",
        wrong,
    )
