"""How often `compression` tells an amplifier that shows large forces too small, and sound campaigns, through whole files.

    make compressed                     10 campaigns of each kind
    make compressed ARGS="30 --seed 5"  others

20 directions three times in random order, in three published media, with ordinary errors; a law of stress over depth that is
no line bends all directions alike.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from disturbances import sizes_of
from mistakes import CHANNELS, change, enacted, judged, plates

MEDIA = ("poppy_LP", "glass0.3mm_CP", "glass3mm_CP")
DIRECTIONS = [(b, g) for b in (-60.0, -30.0, 0.0, 30.0, 60.0) for g in (-45.0, 30.0, 60.0, 90.0)]
ORDINARY = ("surface=0.5", "surface-session=0.5", "spread-percent=5", "patches=3", "pink=0.05")


@dataclass(frozen=True)
class Kind:
    """Share by which the largest force is shown too small, and disturbances beside the ordinary ones."""

    missing: float = 0.0
    disturbances: tuple[str, ...] = ()


KINDS = {
    "sound": Kind(),
    "depth^1.15": Kind(disturbances=("power=1.15",)),
    "largest force 10 % too small": Kind(0.10),
    "largest force 15 % too small": Kind(0.15),
    "largest force 20 % too small": Kind(0.20),
}


def compressed(largest_N: float, missing: float) -> Callable[[np.ndarray], None]:
    """Change of a log by an amplifier that shows F (1 - missing F / largest)."""

    def compress(log: np.ndarray) -> None:
        for channel in CHANNELS.values():
            zero = log[channel][:100].mean()
            force = log[channel] - zero
            log[channel] = zero + force * (1 - missing * np.abs(force) / largest_N)

    return compress


def judge(job: tuple[int, int, str]) -> dict[str, object]:
    """Verdict and code of the check in one campaign."""
    seed, number, name = job
    kind = KINDS[name]
    sizes = sizes_of([*ORDINARY, *kind.disturbances])
    campaign = enacted(MEDIA[number % len(MEDIA)], 1000 * seed + number, None, DIRECTIONS, 3, sizes)
    order = np.random.default_rng([seed, number]).permutation(len(campaign.rows))
    campaign.rows = [campaign.rows[place] for place in order]
    largest_N = 0.0

    def look(log: np.ndarray) -> None:
        nonlocal largest_N
        for channel in CHANNELS.values():
            force = np.abs(log[channel] - log[channel][:100].mean())
            largest_N = max(largest_N, float(np.quantile(force, 0.999)))

    for row in plates(campaign):
        change(campaign, row["force_log"], look)
    for row in campaign.rows if kind.missing else ():
        if row.get("force_log"):
            change(campaign, row["force_log"], compressed(largest_N, kind.missing))
    checks = judged(campaign).checks.set_index("check")
    return {"kind": name, "told": checks.loc["compression", "verdict"] == "failed"} | {
        "passed": checks.loc["compression", "verdict"] == "passed",
        "other checks that fail": " ".join(
            checks.index[(checks["verdict"] == "failed") & (checks.index != "compression")]
        ),
    }


def main() -> int:
    """Print a row a kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaigns", type=int, nargs="?", default=10)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    jobs = [(options.seed, number, name) for name in KINDS for number in range(options.campaigns)]
    with Pool(2) as pool:
        rows = pd.DataFrame(pool.map(judge, jobs, chunksize=1))
    for name, of_kind in rows.groupby("kind", sort=False):
        others = " ".join(of_kind["other checks that fail"]).split()
        print(
            f"{name:30} told {of_kind['told'].sum():3} passed {of_kind['passed'].sum():3} of {len(of_kind)}   others: "
            + (
                ", ".join(f"{check} {others.count(check)}" for check in dict.fromkeys(others))
                or "none"
            )
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
