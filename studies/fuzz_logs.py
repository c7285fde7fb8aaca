"""Feed random and mutated bytes to every reader of text: ``make fuzz``.

No crash, no hang, no row that stands in no line of the input, memory bounded. The first failure
stops the run and keeps its input.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from foreign_logs import TEXTS
from fuzzing import fuzz


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600, help="for each reader")
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument("--only", choices=sorted(TEXTS), help="one reader")
    chosen = parser.parse_args()
    print(f"{chosen.seconds:g} s each, seed {chosen.seed}")
    print("| reader | inputs | read | refused | rows | slowest, ms | memory, MB |")
    print("|---|---|---|---|---|---|---|")
    for name in [chosen.only] if chosen.only else sorted(TEXTS):
        handle, file = tempfile.mkstemp(prefix=f"fuzz_{name}_")
        os.close(handle)
        place = Path(file)
        try:
            score = fuzz(name, chosen.seconds, chosen.seed, place)
        except BaseException:
            print(f"{name}: the input that did it is kept in {place}", file=sys.stderr)
            raise
        place.unlink()
        print(
            f"| {name} | {score.inputs} | {score.read} | {score.refused} | {score.rows} "
            f"| {1e3 * score.slowest_s:.0f} | {score.memory / 1e6:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
