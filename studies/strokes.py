"""Strokes of 500 motions of machines and arms: found as they are, or refused for the true reason.

    make strokes                 all of them, with six noises of the position, a table
    make strokes ARGS="2000"     more

Every log has one to five lone readings of position, 5 to 30 mm off, and goes through the steps that `rftfit run` takes a
motion log through. No stroke may be wrong, and at most 3 % of the rows refused where the noise is 0.2 mm or less.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from pushes import REFUSED, RIGHT, WRONG, any_pushes

NOISE_MM = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5)
MOST_LONE = 5
MOST_REFUSED, UP_TO_MM = 0.03, 0.2
PROCESSES = 2


def judge(noise_mm, seed):
    """Judge the rows of one log: how many are right, wrong and refused, and the first reason of each kind that is not right."""
    pushes = any_pushes(seed, noise_mm / 10, 1 + seed % MOST_LONE)
    rows = pushes.judge()
    reasons = {
        verdict: f"{verdict}, seed {seed}: {why}; {pushes}"
        for verdict, why in rows
        if verdict != RIGHT
    }
    return Counter(verdict for verdict, _ in rows), reasons


def main():
    """Judge the rows of all logs; exit status 1 if one is wrong, or too many are refused."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("motions", nargs="?", type=int, default=500)
    parser.add_argument("--verbose", action="store_true", help="print why rows are refused, too")
    words = parser.parse_args()
    failed = False
    print("| noise, mm | motions | rows | right | wrong | refused |\n" + "|---" * 6 + "|")
    with ProcessPoolExecutor(PROCESSES) as pool:
        for noise_mm in NOISE_MM:
            rows: Counter[str] = Counter()
            for counts, reasons in pool.map(partial(judge, noise_mm), range(words.motions)):
                rows += counts
                for verdict, reason in reasons.items():
                    if verdict == WRONG or words.verbose:
                        print(reason, file=sys.stderr)
            share = rows[REFUSED] / rows.total()
            cells = noise_mm, words.motions, rows.total(), rows[RIGHT], rows[WRONG]
            print("| " + " | ".join(map(str, cells)) + f" | {share:.1%} |", flush=True)
            failed |= rows[WRONG] > 0 or (noise_mm <= UP_TO_MM and share > MOST_REFUSED)
    return failed


if __name__ == "__main__":
    sys.exit(main())
