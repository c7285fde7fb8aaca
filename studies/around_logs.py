"""A campaign around each real log of ../shared/data/logs, through `rftfit check` and `rftfit run`.

    make reallogs                        all of them, a table of what came out
    make reallogs ARGS="--only instron"  those whose name holds the word
    make reallogs ARGS="--keep FOLDER"   the campaigns stay there, with their pages

Each must end with exit status 0 and a page, drop what `check` said, and account for every row.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from agreement import compare
from real_logs import REAL_LOGS, campaign_around, judge


def run(log, root):
    """Make and run one campaign: what came out, and what is wrong with it."""
    folder = campaign_around(log, root)
    began = time.perf_counter()
    command = [str(Path(sys.executable).parent / "rftfit"), "run"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    told = f"{time.perf_counter() - began:3.0f} s, {done.stdout.strip().splitlines()[-1:]}"
    if done.returncode or "Traceback" in done.stdout + done.stderr:
        return told, [f"exit status {done.returncode}: {done.stderr[-500:]}"]
    outcome = compare(folder)  # nothing is left for the stages to do
    wrong = judge(log, folder, page=True)
    return told, wrong if outcome == log.outcome else [f"{outcome}, not {log.outcome}", *wrong]


def main():
    """Run the campaigns; exit status 1 if one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="logs whose name holds this")
    parser.add_argument("--keep", type=Path, help="folder for the campaigns")
    words = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory(prefix="rftfit_real_logs_") as temporary:
        place = words.keep or Path(temporary)
        for number, log in enumerate(REAL_LOGS):
            if words.only not in str(log):
                continue
            told, wrong = run(log, place / str(number))
            bad += bool(wrong)
            print(f"{log!s:60} {told}{''.join(f'; WRONG: {one}' for one in wrong)}", flush=True)
    print(f"{bad} are wrong" if bad else "all as they should be")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
