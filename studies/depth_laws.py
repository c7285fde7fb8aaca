"""Where stress is no line: which law is told, and coverage of alpha at stated depths and of exponents.

    make laws      media of each law, one push and thirty: the check of linearity
    make curved    campaigns of each law: intervals of `alpha_at_depth` and of the exponents of single pushes

`laws`: tables of stress; a surface is off by 0.5 mm, a bed is uneven by 3 % over 1 cm, the transducer has noise of 1 % of the
largest stress. `curved`: logs of one medium of Table S5 with nothing stated in the config; stress follows a power of depth, or a
bed that is denser below 4 cm; beds, surfaces and patches differ as in a real lab. All go through files and the program's stages.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import frame
import numpy as np
import pandas as pd
from coverage_levels import alpha_cells, measured
from frame import Part, Row, Tables, Unit
from paper import DisturbedLab, paper_values, power_law, write_yaml

from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.lab.enact import prepare
from rftfit.measure.depths import steep_pushes
from rftfit.reference import MEDIA
from rftfit.workflow.measure import checks

Law = Callable[[np.ndarray], np.ndarray]

# --- Which law is told


SAMPLES = 240
SURFACE_CM, PATCHES, NOISE = 0.05, 0.03, 0.01
ENDS_CM = (2.0, 3.0, 5.0)
LAWS: dict[str, Law] = {
    "alpha z": lambda depth: depth,
    "z^1.1": lambda depth: depth**1.1,
    "z^1.27": lambda depth: depth**1.27,
    "z^1.4": lambda depth: depth**1.4,
    "z^2": lambda depth: depth**2 / 3,
    "z^0.7": lambda depth: depth**0.7,
    "c + alpha z, c/alpha = 3.6 mm": lambda depth: 0.36 + depth,
    "c + alpha z, c/alpha = 10 mm": lambda depth: 1.0 + depth,
    "crust of 0.4 cm, breaks": lambda depth: depth + 1.2 * np.exp(-(((depth - 0.4) / 0.15) ** 2)),
}


def write_campaign(folder: Path, law: Law, pushes: int, end_cm: float, seed: int) -> Path:
    """Write a table of stress of pushes straight down, and its config."""
    random = np.random.default_rng(seed)
    depth = np.linspace(0.02, end_cm, SAMPLES)
    rows = ["beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,run_id"]
    for push in range(pushes):
        true_depth = np.maximum(depth + random.normal(0, SURFACE_CM), 0.0)
        knots = random.normal(0, PATCHES, int(end_cm) + 2)
        stress = 0.3 * law(true_depth) * (1 + np.interp(depth, np.arange(knots.size), knots))
        stress *= random.normal(1, 0.05)
        stress += random.normal(0, NOISE * float(np.abs(stress).max()), SAMPLES)
        rows += [
            f"0,90,{z:.4f},{stress_z:.6g},0,push{push}"
            for z, stress_z in zip(depth, stress, strict=True)
        ]
    (folder / "config").mkdir(parents=True)
    (folder / "raw").mkdir()
    (folder / "raw" / "stress.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    config = folder / "config" / "config.yaml"
    config.write_text(
        "title: depth laws\nraw: raw\nrun_sheet: raw/stress.csv\ntable: {holds: stress}\n"
        "media: {sand: {title: sand, role: natural_sand}}\n",
        encoding="utf-8",
    )
    return config


def grade_law(law: str, pushes: int, seed: int) -> list[Row]:
    """Verdict and code of the check of linearity."""
    end_cm = ENDS_CM[seed % len(ENDS_CM)]
    with TemporaryDirectory() as folder:
        config = write_campaign(Path(folder) / "lab", LAWS[law], pushes, end_cm, seed)
        verdicts = checks(measured(load_campaign(config), 0.0), "sand")[0].set_index("check")
    verdict, code = verdicts.loc["linearity", ["verdict", "code"]]
    return [{"law": law, "pushes": pushes, "verdict": verdict, "code": code}]


def report_laws(rows: pd.DataFrame) -> Tables:
    """Verdicts and codes by law and number of pushes."""
    words = rows["verdict"].where(rows["verdict"] != "failed", rows["code"])
    counts = pd.crosstab([rows["law"], rows["pushes"]], words)
    return [("Told", counts.reindex(pd.unique(rows["law"]), level=0).reset_index())]


def has_few_false_alarms(rows: pd.DataFrame) -> bool:
    """Whether at most 1 in 50 sound media fails."""
    sound = rows[rows["law"] == "alpha z"]
    return bool((sound["verdict"] == "failed").sum() <= len(sound) / 50)


def list_media(count: int, _seed: int) -> list[Unit]:
    """Media of each law: a fifth as many with thirty pushes."""
    return [
        (law, pushes, seed)
        for law in LAWS
        for pushes, seeds in ((1, count), (30, max(count // 5, 1)))
        for seed in range(seeds)
    ]


# --- Coverage


SIZES = {
    "surface": 0.5,
    "surface-session": 0.5,
    "spread-percent": 5.0,
    "patches": 3.0,
    "pink": 0.02,
}
"""Disturbances, of which no config states any; units as in `disturbances.DISTURBANCES`."""

LAYER_CM, LAYER_FACTOR = 4.0, 2.0
POWERS = {"depth^0.8": 0.8, "depth^1.2": 1.2, "depth^1.4": 1.4}
LEAST_COVERAGE, LEAST_COVERAGE_OF_LAW, MOST_WIDTH = 0.93, 0.90, 1.2
EXPONENTS_INSIDE = 0.90, 0.97


def layered(depth_cm: np.ndarray) -> np.ndarray:
    """Equivalent depth of a bed whose alpha is larger by a factor below a depth, cm."""
    depth_cm = np.maximum(depth_cm, 0.0)
    return depth_cm + (LAYER_FACTOR - 1) * np.maximum(depth_cm - LAYER_CM, 0.0)


def depth_law(name: str) -> Law:
    """Depth that takes the place of |z| in alpha |z|, cm."""
    return partial(power_law, power=POWERS[name]) if name in POWERS else layered


def grade_curved(law: str, number: int) -> list[Row]:
    """Write and measure one campaign: its code, and errors of alpha at depths and of exponents over their half widths."""
    medium = MEDIA[number % len(MEDIA)]
    values = paper_values("robot", "errors")
    values["media"] = {medium: values["media"][medium]}
    with TemporaryDirectory() as folder:
        root = Path(folder) / "lab"
        write_yaml(root / "config" / "config.yaml", values)
        lab = DisturbedLab(SIZES, depth_law=depth_law(law))
        config = Config.model_validate(values)
        logs = prepare(config, seed=66 + 1000 * number, legs=False, lab=lab)
        logs.write(root / "raw" / "paper", root / "raw" / "paper" / "runs.csv")
        results = measured(load_campaign(root / "config" / "config.yaml"))
        verdicts, _, _, at_depths, *_ = checks(results, medium)
        pushes = steep_pushes(results.table(f"fits/{medium}.csv"))
    code = str(verdicts.set_index("check").loc["linearity", "code"])
    answer: Row = {"law": law, "code": code}
    rows: list[Row] = [answer | {"of": "campaign"}]
    for depth_cm, table in at_depths.groupby("depth_cm"):
        low, truth, high = (ends.ravel() for ends in alpha_cells(table))
        truth = truth * float(depth_law(law)(np.array(depth_cm))) / depth_cm
        scaled = np.abs((low + high) / 2 - truth) / ((high - low) / 2)
        rows += [answer | {"of": "alpha", "scaled": x} for x in scaled[np.isfinite(low)]]
    departure = pushes["exponent_z"] - POWERS.get(law, np.nan)
    exponents = (departure / pushes["exponent_z_se"]).dropna().abs() / 1.96
    return [*rows, *(answer | {"of": "exponent", "scaled": x} for x in exponents)]


def summarize(rows: pd.DataFrame, law: str) -> Row:
    """Share inside the intervals of alpha, their width over what 95 % need, and exponents inside."""
    alpha, exponents = (rows.loc[rows["of"] == name, "scaled"] for name in ("alpha", "exponent"))
    return {
        "law": law,
        "campaigns": int((rows["of"] == "campaign").sum()),
        "codes": " ".join(sorted(set(rows["code"]))),
        "intervals": len(alpha),
        "inside": (alpha <= 1).mean(),
        "half over needed": 1 / alpha.quantile(0.95),
        "exponents": len(exponents),
        "exponents inside": (exponents <= 1).mean(),
    }


def report_curved(rows: pd.DataFrame) -> Tables:
    """Coverage and width of intervals by law."""
    lines = [summarize(of_law, str(law)) for law, of_law in rows.groupby("law", sort=False)]
    return [("Intervals", pd.DataFrame([*lines, summarize(rows, "all")]))]


def is_covered(rows: pd.DataFrame) -> bool:
    """Whether coverage and width are as promised."""
    table = report_curved(rows)[0][1].set_index("law")
    every = table.loc["all"]
    return bool(
        every["inside"] >= LEAST_COVERAGE
        and (table["inside"] >= LEAST_COVERAGE_OF_LAW).all()
        and every["half over needed"] <= MOST_WIDTH
        and EXPONENTS_INSIDE[0] <= every["exponents inside"] <= EXPONENTS_INSIDE[1]
    )


PARTS = {
    "laws": Part(list_media, grade_law, report_laws, 50, has_few_false_alarms),
    "curved": Part(
        lambda count, _seed: [*product((*POWERS, "layered"), range(count))],
        grade_curved,
        report_curved,
        20,
        is_covered,
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
