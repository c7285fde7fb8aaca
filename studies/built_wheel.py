"""The built wheel, in an environment and a folder of its own, without clone, make and git: ``make wheel``.

Builds the wheel, installs it with the locked versions of what it needs, follows README's commands and runs a
small campaign. Its results must be those of the clone, byte for byte, but for the two files that name the commit.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import frame
from campaigns import FEW, Folder, make_campaign
from pages import Reader, blocks_of, fate

ABSENT = {"git", "make"}
SHIPPED = (
    "Snakefile",
    "workflow",
    "profiles/slurm/config.yaml",
    "examples/cmu-sand",
    "config/robot.yaml",
)
"""What a clone has at its top and the wheel inside the package."""
MOST_PACKAGES = 80
"""Packages of a plain install, the program itself among them."""
_OF_VENV = ("pip", "setuptools")
NAMES_COMMIT = {"provenance.json", "records/provenance.json"}
ASK = "import sys; from rftfit.store.environment import shipped; print(*map(shipped, sys.argv[1:]), sep='\\n')"


def build(place: Path) -> Path:
    """Build the wheel."""
    words = ["-m", "hatchling", "build", "--target", "wheel", "--directory"]
    command = [sys.executable, *words, str(place)]
    subprocess.run(command, cwd=frame.PROJECT, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = place.glob("*.whl")
    return wheel


def install(wheel: Path, place: Path, python: str) -> tuple[Path, str]:
    """Install it with the locked versions into a new environment; the folder of its commands, and what was installed."""
    lock = (frame.PROJECT / "requirements" / "lock.txt").read_text(encoding="utf-8")
    constraints = place / "constraints.txt"
    entries = re.findall(r"^([\w.-]+==[^\\\n]+?) *\\?$", lock, flags=re.MULTILINE)
    constraints.write_text("\n".join(entries) + "\n", encoding="utf-8")
    subprocess.run([python, "-m", "venv", str(place / "environment")], check=True)
    scripts = place / "environment" / "bin"
    words = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--constraint"]
    began = time.monotonic()
    subprocess.run([scripts / "python", *words, constraints, wheel], check=True)
    took_s = time.monotonic() - began
    packages = [*(place / "environment").rglob("*.dist-info")]
    # pip and what a new environment has besides are no packages of the program
    count = len([path for path in packages if path.name.partition("-")[0] not in _OF_VENV])
    size_MB = sum(path.stat().st_size for path in scripts.parent.rglob("*") if path.is_file()) / 1e6
    if count > MOST_PACKAGES:
        sys.exit(f"{count} packages with the program itself; allowed: {MOST_PACKAGES}")
    return scripts, f"{count} packages, {size_MB:.0f} MB, in {took_s:.0f} s"


def programs_without(absent: set[str], place: Path) -> Path:
    """Make a folder with links to all programs of this machine but a few."""
    place.mkdir()
    for folder in os.environ["PATH"].split(os.pathsep):
        for program in Path(folder).glob("*") if folder else ():
            link = place / program.name
            if program.name not in absent and not link.is_symlink():
                link.symlink_to(program)
    return place


def main() -> None:
    """Build, install, run; a line for each step, exit status 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default=getattr(sys, "_base_executable", sys.executable))
    chosen = parser.parse_args()
    if os.name != "posix":
        sys.exit("make wheel needs Linux or macOS.")
    began = time.monotonic()

    def tell(words: str) -> None:
        print(f"{time.monotonic() - began:4.0f} s  {words}", flush=True)

    with tempfile.TemporaryDirectory(prefix="rftfit_wheel_") as folder:
        place = Path(folder).resolve()
        wheel = build(place)
        tell(f"built {wheel.name}, {wheel.stat().st_size / 1e6:.1f} MB")
        scripts, installed = install(wheel, place, chosen.python)
        tell(installed)
        command = [str(scripts / "python"), "-P", "-c", ASK, *SHIPPED]
        done = subprocess.run(command, cwd=place, check=True, capture_output=True, text=True)
        strangers = [line for line in done.stdout.splitlines() if str(scripts.parent) not in line]
        if strangers:
            sys.exit(f"not from the wheel: {strangers}")
        tell("installed; Snakefile, rules, profiles, examples and robot are those of the wheel")
        reader = Reader(place, scripts, str(programs_without(ABSENT, place / "programs")))
        campaign = make_campaign(place / "clone", ("poppy_LP", "yuma"), directions=FEW)
        wheel_campaign = make_campaign(
            reader.top / "campaign", ("poppy_LP", "yuma"), directions=FEW
        )
        for block in blocks_of("README.md"):
            if fate(block) not in ("run", "run by"):
                continue
            if fate(block) == "run by":  # in a campaign that can be run, in place of the empty one
                reader.folder = wheel_campaign.root
            reader.follow(block)
            commands = [line.partition("#")[0].strip() for line in block.text.splitlines()]
            tell(f"README, line {block.line}: {'; '.join(commands)}")
        verify = [str(scripts / "rftfit"), "verify"]
        if subprocess.run(verify, cwd=wheel_campaign.root, check=False).returncode:
            sys.exit("rftfit verify finds a difference")
        done = Folder(campaign.root).rftfit("run")
        if done.returncode:
            sys.exit(done.stdout + done.stderr)
        digests = campaign.digests()
        differ = {*frame.differing_files(digests, wheel_campaign.digests())} - NAMES_COMMIT
        if differ:
            sys.exit(f"other bytes than those of the clone: {', '.join(sorted(differ))}")
        count = len(digests.keys() - NAMES_COMMIT)
        tell(f"{count} files of the campaign: the same bytes as those of the clone")


if __name__ == "__main__":
    main()
