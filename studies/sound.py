"""What all checks together say of sound campaigns of ten designs, through whole files without figures and pages.

    make sound                     200 campaigns
    make sound ARGS="50 --seed 7"  fewer, others

Published media and 3D-RFT of three frictions take turns; beds differ by 3 to 8 %, patches, surface, angles and noise are
those of an ordinary lab. Prints the verdicts, and every check that fails with its code.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from mistakes import enacted, judged
from paper import sizes_of
from slices import SLICES, lab_in

from rftfit.checks.verdict import verdict_on
from rftfit.measure.verdict_words import FAILED, NOT_CHECKED, SOUND
from rftfit.reference import MEDIA

BEDS = (*MEDIA, *SLICES)
GRID = [
    (float(b), float(g))
    for b in range(-75, 91, 15)
    for g in (-75, -60, -45, -30, 30, 45, 60, 75, 90)
]


class Design(NamedTuple):
    """How many directions are pushed how often, and whether the sheet is sorted by direction."""

    directions: int
    repeats: int
    is_sorted: bool

    def __str__(self) -> str:
        order = "sorted" if self.is_sorted else "random"
        return f"{self.directions} directions, {self.repeats} each, {order}"


DESIGNS = (
    Design(9, 1, False),
    Design(20, 1, False),
    Design(40, 1, True),
    Design(78, 1, False),
    Design(12, 2, False),
    Design(28, 2, False),
    Design(12, 3, True),
    Design(20, 3, False),
    Design(20, 4, True),
    Design(12, 5, False),
)


def judge(job: tuple[int, int]) -> dict[str, Any]:
    """Verdict on a sound campaign, and the codes of the checks that fail."""
    seed, number = job
    random = np.random.default_rng([seed, number])
    design = DESIGNS[number % len(DESIGNS)]
    bed = BEDS[int(random.integers(len(BEDS)))]
    chosen = random.choice(len(GRID), design.directions, replace=False)
    directions = [GRID[place] for place in chosen]
    if (0.0, 90.0) not in directions:
        directions[0] = (0.0, 90.0)
    beds_percent = random.uniform(3, 8)
    ordinary = ("surface=0.5", "surface-session=0.5", "patches=3", "pink=0.05")
    sizes = sizes_of([*ordinary, f"spread-percent={beds_percent:g}"])
    with lab_in(SLICES[bed]) if bed in SLICES else nullcontext():
        medium = bed if bed in MEDIA else str(random.choice(MEDIA))
        campaign = enacted(medium, 1000 * seed + number, None, directions, design.repeats, sizes)
    if design.is_sorted:
        campaign.rows.sort(
            key=lambda row: (row["kind"], float(row["beta_deg"]), float(row["gamma_deg"]))
        )
    else:
        order = random.permutation(len(campaign.rows))
        campaign.rows = [campaign.rows[place] for place in order]
    checks = judged(campaign).checks
    failed = checks[checks["verdict"] == FAILED]
    verdict = verdict_on(checks)
    return {
        "design": str(design),
        "bed": bed,
        "number": number,
        "word": verdict.word,
        "failed": ", ".join(failed["code"] + ": " + failed["found"]),
        "open": verdict.reason if verdict.word == NOT_CHECKED else "",
        "beds": beds_percent,
    }


def main() -> int:
    """Print a row of each design, and every failure."""
    parser = argparse.ArgumentParser(prog="make sound", description=__doc__)
    parser.add_argument("campaigns", type=int, nargs="?", default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    answers = []
    jobs = [(options.seed, number) for number in range(options.campaigns)]
    with Pool(options.processes) as pool:
        for answer in pool.imap(judge, jobs):
            answers.append(answer)
            if answer["failed"] or answer["open"]:
                reason = answer["failed"] or f"not checked: {answer['open']}"
                print(
                    f"{len(answers)}: {answer['design']}, {answer['bed']}, beds {answer['beds']:.1f} %: {reason}",
                    flush=True,
                )
    rows = pd.DataFrame(answers)
    is_failed = rows["failed"] != ""
    print(pd.crosstab(rows["design"], rows["word"]).to_string())
    has_repeats = ~rows["design"].str.contains(", 1 each")
    share = (rows.loc[has_repeats, "word"] == SOUND).mean()
    print(f"failed {is_failed.sum()} of {len(rows)}; sound {share:.0%} of those with repeats")
    return int(is_failed.sum() > 0.02 * len(rows))


if __name__ == "__main__":
    sys.exit(main())
