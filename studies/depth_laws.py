"""By which law stress grows with depth: what is told of natural sands and of media pushed in one direction.

    make laws                50 media of each law
    make laws ARGS=200       so many

Tables of stress, each a campaign in files, go through the program's stages. A surface is off by 0.5 mm, a bed is uneven by 3 %
over 1 cm, the transducer has noise of 1 % of the largest stress. Printed is how often the check of linearity fails, by
what it says, of sound media and of others, for one push and for thirty.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
from coverage_levels import measured

from rftfit.campaign.load import load_campaign
from rftfit.workflow.measure import checks

MEDIA, SAMPLES = 50, 240
SURFACE_CM, PATCHES, NOISE = 0.05, 0.03, 0.01
ENDS_CM = (2.0, 3.0, 5.0)
Law = Callable[[np.ndarray], np.ndarray]
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


def judge(job: tuple[str, int, float, int]) -> tuple[str, int, str, str]:
    """Verdict and words of the check of linearity."""
    law, pushes, end_cm, seed = job
    with TemporaryDirectory() as folder:
        config = write_campaign(Path(folder) / "lab", LAWS[law], pushes, end_cm, seed)
        results = measured(load_campaign(config), 0.0)
        verdicts = checks(results, "sand")[0].set_index("check")
    row = verdicts.loc["linearity"]
    words = str(row["found"])
    departure = "crust" if "peak" in words else "intercept" if "c + alpha" in words else "power"
    return law, pushes, str(row["verdict"]), departure


def main() -> int:
    """Print the counts; 1 where more than 1 in 50 sound media fail."""
    media = int(sys.argv[1]) if len(sys.argv) > 1 else MEDIA
    jobs = [
        (law, pushes, ENDS_CM[seed % len(ENDS_CM)], seed)
        for law in LAWS
        for pushes in (1, 30)
        for seed in range(media if pushes == 1 else max(media // 5, 1))
    ]
    with Pool() as pool:
        judged = pool.map(judge, jobs, chunksize=2)
    false_alarms = 0
    for law in LAWS:
        for pushes in (1, 30):
            of_law = [
                (verdict, departure)
                for name, count, verdict, departure in judged
                if (name, count) == (law, pushes)
            ]
            departures = Counter(departure for verdict, departure in of_law if verdict == "failed")
            opened = sum(verdict == "not checked" for verdict, _ in of_law)
            if law == "alpha z":
                false_alarms += departures.total()
            print(
                f"{law}, {pushes} pushes: of {len(of_law)} told {dict(departures)}, not checked {opened}"
            )
    return int(false_alarms > media / 50)


if __name__ == "__main__":
    sys.exit(main())
