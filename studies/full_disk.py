"""Run the workflow on disks that are too small or read-only, and go on: ``make fulldisk``.

Every time the program has to say which file it could not write and what to do, with exit status 3 and
without a traceback, to leave nothing half-written, and to go on to the same bytes once there is room.
Needs Linux, and a system that lets anybody have a mount namespace (or root).
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from campaigns import make_campaign
from harm import change, compare_results, fresh, mount, on_own_disks, room, run, unmount, why_not

SHARES = (0.0, 0.002, 0.02, 0.1, 0.4, 0.7, 0.9, 0.98)
"""Of the room that all results need."""
AMPLE = "size=500m"
COMMANDS = (
    "scale --alpha 0.9 --output {}/sand.csv",
    "predict --leg c_leg --medium poppy_LP --output {}/leg.csv",
    "simulate --frequency 2 --curvature 1 --medium poppy_LP --output {}/robot",
    "inspect raw/paper/yuma/yuma_c_leg_force.csv --plot {}/log.png",
)
_HEAD = "| disk | exit status | said | complete files left | half-written | then |\n|---|---|---|---|---|---|"


class Trials:
    """One campaign, its undisturbed run, and the disks."""

    def __init__(self, place):
        self.place, self.faults = place, list[str]()
        self.folder = make_campaign(place / "campaign", ("yuma",))
        if run(self.folder, place / "said.txt"):
            sys.exit((place / "said.txt").read_text(encoding="utf-8"))
        self.results = self.folder.root / "results"
        self.whole = self.folder.digests()

    def row(self, name, disk, *cure):
        """Run on a disk that refuses, then on one that does not."""
        code = run(self.folder, self.place / "said.txt")
        output_text = (self.place / "said.txt").read_text(encoding="utf-8")
        leftovers = compare_results(self.folder, self.whole)
        faults = [f"partial {file_name}" for file_name in leftovers.partial]
        faults += ["rests"] if leftovers.rests else []
        if code != 3 or "Traceback" in output_text or "cannot write" not in output_text:
            faults.append(f"exit status {code}, said: {output_text[-400:]}")
        if "run again" not in output_text:
            faults.append("no advice")
        change(disk, *cure)
        resumed = run(self.folder, self.place / "resumed.txt")
        if resumed or self.folder.digests() != self.whole:
            faults.append(f"not resumed ({resumed}), or other bytes")
        lines = [line.strip() for line in output_text.splitlines() if "cannot write" in line]
        refused = (
            lines[0].partition(": cannot write")[0].rpartition("results/")[2] if lines else "-"
        )
        why = "Read-only" if "Read-only" in output_text else "No space left"
        print(
            f"| {name} | {code} | {refused}: {why} | {leftovers.complete} of {len(self.whole)} "
            f"| {leftovers.rests + len(leftovers.partial)} | {'; '.join(faults) or 'same bytes'} |",
            flush=True,
        )
        self.faults += [f"{name}: {fault}" for fault in faults]

    def command(self, words, disk):
        """One command that writes onto a full disk."""
        done = subprocess.run(
            [sys.executable, "-m", "rftfit", *words.format(disk).split()],
            cwd=self.folder.root,
            capture_output=True,
            text=True,
            check=False,
        )
        written_files = [
            path.name for path in disk.rglob("*") if path.is_file() and path.stat().st_size
        ]
        good = (
            done.returncode == 3 and "cannot write" in done.stderr and written_files == ["filled"]
        )
        good = good and "Traceback" not in done.stdout + done.stderr
        print(
            f"| `rftfit {words.format('full')}` | {done.returncode} | {'fine' if good else done.stderr} |"
        )
        self.faults += [] if good else [words]


def main():
    """Run it, print two tables."""
    if why_not():
        print(f"skipped: {why_not()}")
        return
    if sys.argv[1:] != ["inside"]:
        sys.exit(on_own_disks([sys.executable, __file__, "inside"]).returncode)
    with tempfile.TemporaryDirectory(prefix="rftfit_full_disk_") as folder:
        trials = Trials(Path(folder).resolve())
        root, results = trials.folder.root, trials.results
        needed = room(results)
        print(f"all results: {needed / 1e6:.1f} MB\n\n{_HEAD}", flush=True)
        for share in SHARES:
            fresh(trials.folder)
            mount(results, max(int(share * needed), 4096))
            trials.row(f"`results/`, {share:.1%} of the room", results, AMPLE)
            unmount(results)
        fresh(trials.folder)
        mount(results, needed)
        change(results, "ro")
        trials.row("`results/`, read-only", results, "rw", AMPLE)
        unmount(results)
        # what Snakemake itself keeps is on the same disk
        for name in ("results", ".snakemake"):
            shutil.rmtree(root / name)
        shutil.move(root, root.with_name("source"))
        mount(root, 4 * needed)
        shutil.copytree(root.with_name("source"), root, dirs_exist_ok=True)
        taken = room(root)
        for share in (0.003, 0.5):
            fresh(trials.folder)
            change(root, f"size={taken + int(share * needed)}")
            trials.row(f"the campaign's, {share:.1%} of the room", root, AMPLE)
        disk = trials.place / "full"
        mount(disk, 64 << 10)
        (disk / "filled").write_bytes(bytes(64 << 10))
        print("\n| command | exit status | |\n|---|---|---|")
        for words in COMMANDS:
            trials.command(words, disk)
        unmount(disk)
        unmount(root)
        if trials.faults:
            sys.exit("\n".join(trials.faults))


if __name__ == "__main__":
    main()
