"""Strokes of 500 motions of machines and arms: found as they are, or refused for the true reason.

    make strokes                 all of them, how many rows came out right
    make strokes ARGS="2000"     more

No stroke may be wrong, and at most 5 % of them refused.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from motions import REFUSED, RIGHT, WRONG, any_pushes

LOGS = 500


def main():
    """Judge the rows of all logs; exit status 1 if one is wrong, or too many are refused."""
    told: Counter[str] = Counter()
    logs = int(sys.argv[1]) if len(sys.argv) > 1 else LOGS
    for seed in range(logs):
        for how, why in any_pushes(seed).judge():
            told[how] += 1
            if how != RIGHT:
                print(f"{how}, seed {seed}: {why}; {any_pushes(seed)}")
    print(
        f"{logs} logs, {told.total()} rows: {told[RIGHT]} right, {told[WRONG]} wrong, {told[REFUSED]} refused"
    )
    return told[WRONG] > 0 or told[REFUSED] > 0.05 * told.total()


if __name__ == "__main__":
    sys.exit(main())
