"""A campaign around each real log of ../shared/data/logs and each reported push of ../shared/data/reported, through `rftfit check` and `rftfit run`.

    make reallogs                        all of them, a table of what came out
    make reallogs ARGS="--only instron"  those whose name holds the word
    make reallogs ARGS="--keep FOLDER"   the campaigns stay there, with their pages

Each must end with exit status 0 and a page, drop what `check` said, and account for every row; a reported push gives the
alpha that is known of it, or the true reason.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from mistakes import compare
from third_party import MEDIUM, REAL_LOGS, REPORTED_PUSHES, campaign_around_log, judge
from third_party import campaign_around as campaign_of_push


def run_workflow(root):
    """Run the workflow: a line on the run, and what is wrong with its end."""
    start_s = time.perf_counter()
    command = [str(Path(sys.executable).parent / "rftfit"), "run"]
    process = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    line = f"{time.perf_counter() - start_s:3.0f} s, {process.stdout.strip().splitlines()[-1:]}"
    if process.returncode or "Traceback" in process.stdout + process.stderr:
        return line, [f"exit status {process.returncode}: {process.stderr[-500:]}"]
    return line, []


def run_real_log(log, root):
    """Make and run the campaign around a real log: a line on the run, and its faults."""
    folder = campaign_around_log(log, root)
    line, faults = run_workflow(root)
    if faults:
        return line, faults
    outcome = compare(folder)  # nothing is left for the stages to do
    faults = judge(log, folder, page=True)
    return line, faults if outcome == log.outcome else [f"{outcome}, not {log.outcome}", *faults]


def run_reported_push(push, root):
    """Make and run the campaign around a reported push: a line on the run, and its faults."""
    folder = campaign_of_push(root, push.log, **push.settings)
    line, faults = run_workflow(root)
    if faults:
        return line, faults
    compare(folder)
    fit = folder.table(f"fits/{MEDIUM}.csv").iloc[0]
    codes = set(folder.table(f"flags/{MEDIUM}.csv")["code"])
    html = (folder.root / "results" / "report.html").read_text(encoding="utf-8")
    alpha = fit["alpha_z_N_per_cm3"]
    if math.isnan(push.alpha):
        return f"{line} refused", [] if push.words in html else [
            f"{push.words!r} is not on the page"
        ]
    if not abs(alpha / push.alpha - 1) < 5e-3:
        faults.append(f"alpha {alpha}, not {push.alpha}: {fit['reason']}")
    if push.code and push.code not in codes:
        faults.append(f"no flag {push.code}")
    return f"{line} alpha {alpha / push.alpha - 1:+.2%} off", faults


def main():
    """Run the campaigns; exit status 1 if one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="logs whose name holds this")
    parser.add_argument("--keep", type=Path, help="folder for the campaigns")
    options = parser.parse_args()
    wrong_campaigns = 0
    campaigns = [
        *((run_real_log, log) for log in REAL_LOGS),
        *((run_reported_push, push) for push in REPORTED_PUSHES),
    ]
    with tempfile.TemporaryDirectory(prefix="rftfit_real_logs_") as temporary:
        place = options.keep or Path(temporary)
        for number, (run_campaign, log) in enumerate(campaigns):
            if options.only not in str(log):
                continue
            line, faults = run_campaign(log, place / str(number))
            wrong_campaigns += bool(faults)
            print(
                f"{log!s:60} {line}{''.join(f'; WRONG: {fault}' for fault in faults)}", flush=True
            )
    print(f"{wrong_campaigns} are wrong" if wrong_campaigns else "all as they should be")
    return 1 if wrong_campaigns else 0


if __name__ == "__main__":
    sys.exit(main())
