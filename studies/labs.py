"""Campaigns of other labs, through `rftfit run`: grids x protocols, with and without tares and legs.

    make labs                        all of them, a table of what came out
    make labs ARGS="--only one-file" those whose name holds the word

Each must end with exit status 0 and a page. With tares at least 90 % of all numbers hold the truth in
their 95 % intervals; without, every run is flagged, and alpha is off by the rod's force.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from mistakes import CASES, judge, make

CELLS_WITHIN = 0.9
"""Part of all numbers whose 95 % intervals must hold the truth."""


def run(case, folder, held):
    """Make and run one campaign."""
    make(folder, case)
    began = time.perf_counter()
    command = [str(Path(sys.executable).parent / "rftfit"), "run"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - began
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-3:]
        return f"exit status {done.returncode}", [" ".join(last)]
    summary, wrong = judge(folder, case, held)
    return f"{seconds:5.0f} s, {summary}", wrong


def main():
    """Run the cases; exit status 1 if one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    words = parser.parse_args()
    bad, held = 0, list[bool]()
    for case in [case for case in CASES if words.only in str(case)]:
        folder = Path(tempfile.mkdtemp(prefix="rftfit_labs_"))
        try:
            summary, wrong = run(case, folder / "campaign", held)
        finally:
            shutil.rmtree(folder)
        bad += bool(wrong)
        print(f"{case!s:45} {summary}{''.join(f'; WRONG: {fault}' for fault in wrong)}", flush=True)
    share = float(np.mean(held)) if held else 1.0
    bad += share < CELLS_WITHIN
    print(f"{100 * share:.1f} % of {len(held)} numbers measured with a tare hold the truth")
    print(f"{bad} of {len(CASES)} are wrong" if bad else "all as they should be")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
