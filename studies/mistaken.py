"""Campaigns with mistakes in sheet, config and logs or in a table: the stages refuse nothing that `check` passed.

    make mutations                           200 campaigns, measured
    make mutations ARGS="--whole --count 50" with figures and pages
    make mutations ARGS="--seed 7 --count 1" that one again

The first campaign for which it does not hold is kept and ends the run.
"""

from __future__ import annotations

import argparse
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from campaigns import Folder
from mistakes import MEASURED, bases, compare, mutated


def main():
    """Try campaigns, print how many went which way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=2013, help="of the first campaign")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--base", choices=list(bases()), help="one campaign only, such as table")
    parser.add_argument("--whole", action="store_true", help="all stages, not those that measure")
    words = parser.parse_args()
    ways: Counter[str] = Counter()
    for seed in range(words.seed, words.seed + words.count):
        campaign = mutated(random.Random(seed), words.base)
        folder = Folder(Path(tempfile.mkdtemp(prefix="rftfit_mutation_")))
        try:
            campaign.write(folder.root)
            ways[compare(folder, () if words.whole else MEASURED)] += 1
        except BaseException:
            print(f"seed {seed}: {campaign.mistakes}; kept in {folder.root}", file=sys.stderr)
            raise
        shutil.rmtree(folder.root)
    print(", ".join(f"{count} {way}" for way, count in sorted(ways.items())))


if __name__ == "__main__":
    main()
