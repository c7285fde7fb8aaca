"""Kill the workflow at random moments and go on: ``make killed``.

A small campaign is run undisturbed once. Then, again and again from nothing, `rftfit run` is started
and after a random time something is killed with SIGKILL: a stage, Snakemake, `rftfit run`, or all of
them. Nothing may be left half-written, nobody may go on writing, and `rftfit run` has to go on by
itself to the same bytes.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from campaigns import make_campaign
from harm import KINDS, STAGE, compare_results, fresh, kill, run, seconds_until_quiet, start, state

SMALL, WHOLE = ("yuma",), ("poppy_LP", "yuma")
_QUIET_S = 15.0
_TRIES = 5


class Trial:
    """One campaign, its undisturbed run, and the kills."""

    def __init__(self, folder, place, seed):
        self.folder, self.place = folder, place
        self.random = random.Random(seed)
        self.faults: list[str] = []
        began = time.monotonic()
        code = run(folder, place / "undisturbed.txt")
        self.seconds = time.monotonic() - began
        if code:
            sys.exit((place / "undisturbed.txt").read_text(encoding="utf-8"))
        self.whole = folder.digests()

    def row(self, number, kind):
        """Kill once, look, go on; a row of the table."""
        killed_at_s, stages, child = self._killed(number, kind)
        faults = []
        # the other stages of a killed one go on, and then the run ends by itself
        quiet = seconds_until_quiet(
            self.folder.root, 10 * self.seconds if kind == STAGE else _QUIET_S
        )
        if quiet == float("inf"):
            faults.append("orphans")
        code = child.wait()
        before = state(self.folder)
        time.sleep(1)
        if state(self.folder) != before:
            faults.append("written after the end")
        leftovers = compare_results(self.folder, self.whole)
        faults += [f"partial {name}" for name in leftovers.partial]
        output_text = self._output_text(number)
        if kind == STAGE and (code != 4 or "killed (SIGKILL)" not in output_text):
            faults.append(f"exit status {code}, said: {output_text[-300:]}")
        lock = self._resume(number, faults)
        self.faults += [f"kill {number}: {fault}" for fault in faults]
        ended = "-" if kind == STAGE else f"{quiet:.1f}"
        return (
            f"| {number} | {kind} | {killed_at_s:.1f} | {', '.join(stages) or '-'} | {leftovers.complete} of "
            f"{len(self.whole)} | {leftovers.rests} | {ended} | {lock} | {'; '.join(faults) or 'same bytes'} |"
        )

    def _killed(self, number, kind):
        for _ in range(_TRIES):
            fresh(self.folder)
            killed_at_s = self.random.uniform(0.02, 0.98) * self.seconds
            child = start(self.folder, self.place / f"killed{number}.txt")
            began = time.monotonic()
            time.sleep(killed_at_s)
            hit, stages = kill(child, kind, self.random.random())
            if hit:
                return time.monotonic() - began, stages, child
            # a run that nobody killed: the machine has become quicker
            self.seconds = min(self.seconds, time.monotonic() - began)
        sys.exit("the run was over before it could be killed, again and again")

    def _output_text(self, number):
        return (self.place / f"killed{number}.txt").read_text(encoding="utf-8")

    def _resume(self, number, faults):
        """Run again; how the lock was dealt with."""
        output = self.place / f"resumed{number}.txt"
        code, lock = run(self.folder, output), "none"
        output_text = output.read_text(encoding="utf-8")
        if "its lock is cleared" in output_text:
            lock = "cleared by itself"
        elif "rftfit run --unlock" in output_text:
            lock = "after --unlock"
            if run(self.folder, output, "--unlock"):
                faults.append("--unlock failed")
            code = run(self.folder, output)
        if code:
            faults.append(f"not resumed: {output.read_text(encoding='utf-8')[-500:]}")
        if self.folder.digests() != self.whole:
            faults.append("other bytes")
        return lock


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=2013)
    parser.add_argument(
        "--whole", action="store_true", help="a grid of plates and the robot too: takes hours"
    )
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rftfit_killed_") as folder:
        place = Path(folder).resolve()
        campaign = make_campaign(place / "campaign", WHOLE if chosen.whole else SMALL)
        trial = Trial(campaign, place, chosen.seed)
        print(
            f"{chosen.kills} kills, seed {chosen.seed}; the undisturbed run: {trial.seconds:.0f} s, "
            f"{len(trial.whole)} files\n\n"
            "| | killed | after, s | stages then | complete files left | unfinished | others ended "
            "after, s | lock | after `rftfit run` |\n|---|---|---|---|---|---|---|---|---|",
            flush=True,
        )
        for number in range(1, chosen.kills + 1):
            print(trial.row(number, KINDS[(number - 1) % len(KINDS)]), flush=True)
        if trial.faults:
            sys.exit("\n".join(trial.faults))


if __name__ == "__main__":
    main()
