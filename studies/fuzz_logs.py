"""Feed random and mutated bytes to every reader: ``make fuzz``.

No crash, no hang, memory bounded; of text no row that stands in no line of the input. Files that libraries of other
people read take part, and two bags made to take time or memory without end. The first failure stops the run and
keeps its input.
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from log_files import (
    BINARIES,
    MANY_WITHOUT_BYTES,
    TEXTS,
    Score,
    fuzz,
    fuzz_binary,
    judge_binary,
    write_packed_zeros,
    write_ros1,
)

from rftfit.logs.registry import dialect

HOSTILE = {
    "bag of 1e9 empty messages": lambda folder: write_ros1(
        folder / "empty.bag", MANY_WITHOUT_BYTES, bytes(8)
    ),
    "bag of bz2 zeros, 600 MB": lambda folder: write_packed_zeros(folder / "zeros.bag", 600),
}


def judge_hostile(name, folder):
    """Read a file that is made to take time or memory without end; it has to be refused."""
    score, reader = Score(), dialect("ros-bag")
    path = write_ros1(folder / "sound.bag", "float64 y", bytes(8))
    reader.load(path)  # libraries loaded: not counted
    path = HOSTILE[name](folder)
    judge_binary(reader, path, score)
    if not score.refused:
        raise AssertionError(f"{path}: it was read")
    return score


def judge(name, seconds, seed, folder):
    """Score of one reader, or of one hostile file."""
    if name in HOSTILE:
        return judge_hostile(name, folder)
    if name in BINARIES:
        return fuzz_binary(name, seconds, seed, folder)
    return fuzz(name, seconds, seed, folder / "input")


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    every = [*HOSTILE, *BINARIES, *sorted(TEXTS)]
    parser.add_argument("--seconds", type=float, default=600, help="for each reader")
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument("--only", choices=every, nargs="+", help="these readers")
    chosen = parser.parse_args()
    print(f"{chosen.seconds:g} s each, seed {chosen.seed}")
    print("| reader | inputs | read | refused | rows | slowest, ms | memory, MB |")
    print("|---|---|---|---|---|---|---|")
    for name in chosen.only or every:
        folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
        try:
            score = judge(name, chosen.seconds, chosen.seed, folder)
        except BaseException:
            print(f"{name}: the input that did it is kept in {folder}", file=sys.stderr)
            raise
        shutil.rmtree(folder)
        print(
            f"| {name} | {score.inputs} | {score.read} | {score.refused} | {score.rows} "
            f"| {1e3 * score.slowest_s:.0f} | {score.memory / 1e6:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
