"""Alpha of stated depths and the exponent of depth where stress is no line: coverage and width of their intervals.

    make curved              20 campaigns of each law
    make curved ARGS=5       so many

Campaigns of one medium of Table S5 are written as files and read from them, nothing is stated in their config, and each goes
through the program's stages. Stress follows a power of depth, or a layered bed, which is denser below 4 cm. Beds, surfaces
and patches differ as in a real lab. Printed is how often the intervals of `alpha_at_depth` contain the true stress over
depth, by which factor they are wider than 95 % of the errors need, and how often the exponents of single pushes are inside.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(threads, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from coverage_levels import alpha_cells, measured
from paper import DisturbedLab, paper_values, power_law, write_yaml

from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.lab.enact import prepare
from rftfit.measure.depths import steep_pushes
from rftfit.reference import MEDIA
from rftfit.workflow.measure import checks

CAMPAIGNS, SEED = 20, 66
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

ROWS = "CURVED_ROWS"
"""Environment variable that names a file for the errors of each campaign, over their half widths."""

DepthLaw = Callable[[np.ndarray], np.ndarray]


def layered(depth_cm: np.ndarray) -> np.ndarray:
    """Equivalent depth of a bed whose alpha is larger by a factor below a depth, cm."""
    depth_cm = np.maximum(depth_cm, 0.0)
    return depth_cm + (LAYER_FACTOR - 1) * np.maximum(depth_cm - LAYER_CM, 0.0)


def depth_law(name: str) -> DepthLaw:
    """Depth that takes the place of |z| in alpha |z|, cm."""
    if name in POWERS:
        return lambda depth_cm: power_law(depth_cm, POWERS[name])
    return layered


def judge(job: tuple[str, int]) -> tuple[str, str, pd.DataFrame, np.ndarray]:
    """Write and measure one campaign; code of its check, errors with half widths, and scaled errors of exponents."""
    law, number = job
    medium = MEDIA[number % len(MEDIA)]
    values = paper_values("robot", "errors")
    values["media"] = {medium: values["media"][medium]}
    with TemporaryDirectory() as folder:
        root = Path(folder) / "lab"
        write_yaml(root / "config" / "config.yaml", values)
        lab = DisturbedLab(SIZES, depth_law=depth_law(law))
        seed = SEED + 1000 * number
        logs = prepare(Config.model_validate(values), seed=seed, legs=False, lab=lab)
        logs.write(root / "raw" / "paper", root / "raw" / "paper" / "runs.csv")
        results = measured(load_campaign(root / "config" / "config.yaml"))
        verdicts, _, _, at_depths, *_ = checks(results, medium)
        pushes = steep_pushes(results.table(f"fits/{medium}.csv"))
    code = str(verdicts.set_index("check").loc["linearity", "code"])
    errors = []
    for depth_cm, table in at_depths.groupby("depth_cm"):
        low, truth, high = (ends.ravel() for ends in alpha_cells(table))
        truth = truth * float(depth_law(law)(np.array(depth_cm))) / depth_cm
        measured_cells = np.isfinite(low)
        errors.append(
            pd.DataFrame(
                {
                    "error": ((low + high) / 2 - truth)[measured_cells],
                    "half": ((high - low) / 2)[measured_cells],
                }
            )
        )
    table = pd.concat(errors) if errors else pd.DataFrame(columns=["error", "half"], dtype=float)
    departure = pushes["exponent_z"] - POWERS.get(law, np.nan)
    return law, code, table, (departure / pushes["exponent_z_se"]).dropna().to_numpy(float)


def main() -> int:
    """Print the table; 1 where a coverage or a width is not as promised."""
    campaigns = int(sys.argv[1]) if len(sys.argv) > 1 else CAMPAIGNS
    jobs = [(law, number) for number in range(campaigns) for law in (*POWERS, "layered")]
    judged: list[tuple[str, str, pd.DataFrame, np.ndarray]] = []
    with Pool() as pool:
        for result in pool.imap_unordered(judge, jobs):
            judged.append(result)
            law, code, table, exponents = result
            inside = np.mean(table["error"].abs() <= table["half"]) if len(table) else np.nan
            exponents_inside = np.mean(np.abs(exponents) <= 1.96) if exponents.size else np.nan
            print(
                f"{law}, {code}: inside {inside:.3f}, exponents {exponents_inside:.3f}", flush=True
            )
            if ROWS in os.environ:
                scaled_errors = (table["error"].abs() / table["half"]).round(4).to_list()
                record = {
                    "law": law,
                    "scaled": scaled_errors,
                    "exponents": exponents.round(3).tolist(),
                }
                with Path(os.environ[ROWS]).open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(record) + "\n")
    rows = []
    all_scaled = []
    for law in (*POWERS, "layered"):
        of_law = [campaign for campaign in judged if campaign[0] == law]
        table = pd.concat([errors for _, _, errors, _ in of_law])
        scaled = (table["error"].abs() / table["half"]).to_numpy(float)
        exponents = np.abs(np.concatenate([exponents for _, _, _, exponents in of_law]))
        all_scaled.append(scaled)
        rows.append(
            {
                "law": law,
                "campaigns": len(of_law),
                "curved": sum(len(errors) > 0 for _, _, errors, _ in of_law),
                "codes": " ".join(sorted({code for _, code, _, _ in of_law})),
                "intervals": scaled.size,
                "inside": np.mean(scaled <= 1) if scaled.size else np.nan,
                "half over needed": 1 / np.quantile(scaled, 0.95) if scaled.size else np.nan,
                "exponents": exponents.size,
                "exponents inside": np.mean(exponents <= 1.96) if exponents.size else np.nan,
            }
        )
    table = pd.DataFrame(rows)
    print(table.round(3).to_string(index=False))
    scaled = np.concatenate(all_scaled)
    inside, width = np.mean(scaled <= 1), 1 / np.quantile(scaled, 0.95)
    exponents = np.abs(np.concatenate([exponents for _, _, _, exponents in judged]))
    exponents_inside = float(np.mean(exponents <= 1.96))
    print(
        f"all laws: inside {inside:.3f}, half over needed {width:.2f}, exponents inside {exponents_inside:.3f}"
    )
    good = inside >= LEAST_COVERAGE and (table["inside"] >= LEAST_COVERAGE_OF_LAW).all()
    good &= bool(width <= MOST_WIDTH)
    good &= EXPONENTS_INSIDE[0] <= exponents_inside <= EXPONENTS_INSIDE[1]
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
