"""Put a link to a raw log or the config in the place of each file that a run writes: ``make links``.

A link is symbolic or hard, there before the first run or before a second, and met by `run`, `verify --again`, `watch` and
`reenact`. Not one byte of raw logs, run sheet and config may change, nor their times, but for what `reenact` writes there by itself. Symbolic
links are planted one by one; hard links, which end no run, at all places at once, to one file of the lab after the other.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from campaigns import Folder, make_campaign
from harm import lab_files, places_of, plant, victims_of

from rftfit.bench.watch import Watch

TIMES = ("before the first run", "before the second run")
_HEAD = "| command | link | when | places | refused | went on | bytes of the lab that differ |\n|---|---|---|---|---|---|---|"


class Trials:
    """A campaign that was never run and one that was, and what was found."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.faults = folder, list[str]()
        fresh = make_campaign(folder / "fresh", ("yuma",), plates_only=True)
        done = Folder(folder / "done")
        shutil.copytree(fresh.root, done.root)
        if code := self.start(done, "run"):
            sys.exit(f"the undisturbed run ended with exit status {code}")
        self.campaigns = dict(zip(TIMES, (fresh, done), strict=True))
        written = {
            path.relative_to(done.root).as_posix()
            for name in ("results", ".snakemake")
            for path in (done.root / name).rglob("*")
            if path.is_file() and path.parent.name != "log"
        }
        shutil.copytree(fresh.root, folder / "planned")
        self.places = places_of(folder / "planned" / "config" / "config.yaml")
        if unplanned := written.difference(self.places):
            self.faults.append(f"written and not among the places: {sorted(unplanned)}")

    def start(self, campaign: Folder, *words: str) -> int:
        """Run a command in a process of its own; its exit status."""
        command = [sys.executable, "-P", "-m", "rftfit", *words]
        done = subprocess.run(
            command, cwd=campaign.root, capture_output=True, text=True, check=False
        )
        if "Traceback" in done.stdout + done.stderr or done.returncode not in (0, 2, 5):
            self.faults.append(f"{words}: {done.stderr[-1000:]}")
        return done.returncode

    def copy(self, time: str) -> Folder:
        """Copy the campaign as it is at that time."""
        root = self.folder / "copy"
        shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(self.campaigns[time].root, root)
        return Folder(root)

    def changed(self, campaign: Folder, before: dict[str, tuple[bytes, int]]) -> int:
        """Count the bytes of the lab that are others now; a file with another time counts as one."""
        now, count = lab_files(campaign.root), 0
        for name in before.keys() | now.keys():
            was, seconds = before.get(name, (b"", 0))
            content, seconds_now = now.get(name, (b"", 0))
            differ = sum(a != b for a, b in zip(was, content, strict=False))
            count += differ + abs(len(was) - len(content)) or int(seconds != seconds_now)
        return count

    def symbolic(self, time: str, places: Sequence[str]) -> None:
        """`run` with a symbolic link in each place in turn, to each file of the lab."""
        campaign, refused, bytes_changed = self.copy(time), 0, 0
        before = lab_files(campaign.root)
        for place in places:
            path, kept = campaign.root / place, None
            if path.is_file():
                kept = path.read_bytes(), path.stat()
            for victim in victims_of(campaign.root):
                plant(campaign.root, place, "symbolic", victim)
                # in this process, which has imported what it needs
                done = campaign.rftfit("run")
                is_told = done.returncode == 2 and f"{path} -> " in done.stderr
                refused += is_told
                if not is_told:
                    self.faults.append(f"{place}, {time}: exit status {done.returncode}")
                bytes_changed += self.changed(campaign, before)
            path.unlink()
            if kept:
                path.write_bytes(kept[0])
        self.row("run", "symbolic", time, refused, 0, bytes_changed, len(places))

    def hard(self, time: str, turn: int) -> None:
        """`run` with hard links in all places, which are other names of one file of the lab after the other."""
        campaign = self.copy(time)
        victims = victims_of(campaign.root)
        for number, place in enumerate(self.places):
            plant(campaign.root, place, "hard", victims[(number + turn) % len(victims)])
        before = lab_files(campaign.root)
        code = self.start(campaign, "run")
        if code:
            self.faults.append(f"run with hard links, {time}: exit status {code}")
        if code == 0 and campaign.digests() != self.campaigns[TIMES[1]].digests():
            self.faults.append(f"run with hard links, {time}: other bytes of results")
        self.row("run", "hard", time, 0, int(code == 0), self.changed(campaign, before))

    def others(self, kind: str, time: str) -> None:
        """The other commands, with links in all places at once."""
        campaign = self.copy(time)
        victims = victims_of(campaign.root)
        for number, place in enumerate(self.places):
            plant(campaign.root, place, kind, victims[number % len(victims)])
        before = lab_files(campaign.root)
        watch = Watch(campaign.config, 0.0)
        for time_s in range(3):
            list(watch.step(float(time_s)))
        self.row("watch", kind, time, 0, 1, self.changed(campaign, before))
        code = self.start(campaign, "verify", "--again")
        # results that are links to logs are not what is made again
        if code != 5:
            self.faults.append(f"verify --again, {kind}, {time}: exit status {code}")
        self.row("verify --again", kind, time, 0, 1, self.changed(campaign, before))
        code = self.start(campaign, "reenact", "--no-legs")
        now = {name: (content, 0) for name, (content, _) in lab_files(campaign.root).items()}
        # what it made itself is made again, with the same bytes; the list of its files is one of them
        ours = {name for name in now if name.endswith("REENACTED.txt")}
        count = sum(
            now.get(name, (b"", 0))[0] != content
            for name, (content, _) in before.items()
            if name not in ours
        )
        self.row("reenact", kind, time, int(code != 0), int(code == 0), count)

    def row(
        self,
        command: str,
        kind: str,
        time: str,
        refused: int,
        went_on: int,
        changed: int,
        places: int | None = None,
    ) -> None:
        """Print a row of the table, and keep what is wrong."""
        print(
            f"| `{command}` | {kind} | {time} | {places or len(self.places)} | {refused} | {went_on} | {changed} |",
            flush=True,
        )
        if changed:
            self.faults.append(f"{command}, {kind}, {time}: {changed} bytes of the lab")


def main() -> None:
    """Plant the links; print a table, and what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--every", type=int, default=1, help="symbolic links in every so many places"
    )
    parser.add_argument(
        "--turns", type=int, default=3, help="hard links of each place to so many files of the lab"
    )
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rftfit_links_") as folder:
        trials = Trials(Path(folder).resolve())
        print(f"{len(trials.places)} places\n\n{_HEAD}", flush=True)
        for time in TIMES:
            trials.symbolic(time, trials.places[:: chosen.every])
            for turn in range(chosen.turns):
                trials.hard(time, turn)
        for kind in ("symbolic", "hard"):
            for time in TIMES:
                trials.others(kind, time)
    if trials.faults:
        sys.exit("\n".join(trials.faults))


if __name__ == "__main__":
    main()
