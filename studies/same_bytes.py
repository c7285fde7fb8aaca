"""Run one campaign under different circumstances and compare all results: ``make samebytes``.

Cores, order and line ends of the run sheet, the folder's name, locale and encoding, time zone, hash
seed, rights of new files, threads of linear algebra: none of them may change a byte of `results/` (its logs apart).
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from campaigns import Folder, make_campaign
from kills import run

SHEET = Path("raw") / "paper" / "runs.csv"
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
"""The encoding of files is ASCII then, unless the program says what it is."""


@dataclass(frozen=True)
class Circumstances:
    """One way to run the campaign."""

    name: str
    folder: str = "campaign"
    cores: int = 2
    umask: int = 0o022
    line_end: str = "\n"
    environment: dict[str, str] = field(default_factory=dict)


def circumstances(locales):
    """All of them; the first is what the others are compared with."""
    made = {"LOCPATH": str(locales)}
    return [
        Circumstances("as it is, 2 cores", environment={"PYTHONHASHSEED": "0"}),
        Circumstances(
            "1 core, hash seed 1, umask 077",
            cores=1,
            umask=0o077,
            environment={"PYTHONHASHSEED": "1"},
        ),
        Circumstances("folder `été 2013 ü`, sheet with CRLF", "été 2013 ü", line_end="\r\n"),
        Circumstances(
            "`LC_ALL=C`, `PYTHONUTF8=0` (ASCII), folder with accents",
            "été 2013 ü",
            environment=ASCII,
        ),
        *(
            Circumstances(f"`OPENBLAS_NUM_THREADS={n}`", environment={"OPENBLAS_NUM_THREADS": n})
            for n in ("1", "2", "4")
        ),
        Circumstances(
            "`LC_ALL=tr_TR.UTF-8`, `TZ=Asia/Kathmandu`",
            environment={**made, "LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu"},
        ),
        Circumstances(
            "`LC_ALL=de_DE.ISO-8859-1`, `PYTHONUTF8=0`, `TZ=America/St_Johns`",
            environment={
                **made,
                "LC_ALL": "de_DE.ISO-8859-1",
                "PYTHONUTF8": "0",
                "TZ": "America/St_Johns",
            },
        ),
    ]


def make_locale(place, name):
    """Make a locale where this system does not have it; whether it is there now."""
    language, _, encoding = name.partition(".")
    words = ["localedef", "-i", language, "-f", encoding, str(place / name)]
    if shutil.which("localedef") is None:
        return False
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


def missing(one, locales):
    """Tell why a circumstance cannot be had here, or nothing."""
    name = one.environment.get("LC_ALL", "C")
    return "" if name == "C" or make_locale(locales, name) else f"skipped: no locale {name} here"


def arrange(one, source, place):
    """A copy of the campaign, as the circumstances want it."""
    root = place / one.folder
    shutil.copytree(source.root, root)
    rows = (root / SHEET).read_text(encoding="utf-8").splitlines()
    text = one.line_end.join([*rows, ""])
    (root / SHEET).write_bytes(text.encode())
    return Folder(root)


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--whole", action="store_true", help="with legs, sand and robot")
    chosen = parser.parse_args()
    media = ("poppy_LP", "yuma") if chosen.whole else ("poppy_LP",)
    faults, first = [], dict[str, str]()
    before = dict(os.environ)
    with tempfile.TemporaryDirectory(prefix="rftfit_same_bytes_") as folder:
        place = Path(folder).resolve()
        source = make_campaign(place / "source", media, plates_only=not chosen.whole)
        config = source.root / "config" / "config.yaml"
        titled = config.read_text(encoding="utf-8").replace("title: ", "title: été ß Ω ", 1)
        config.write_text(titled, encoding="utf-8")
        print("| circumstances | seconds | results |\n|---|---|---|", flush=True)
        for one in circumstances(place / "locales"):
            (place / "locales").mkdir(exist_ok=True)
            if why := missing(one, place / "locales"):
                print(f"| {one.name} | - | {why} |", flush=True)
                continue
            there = arrange(one, source, place)
            os.environ.update(one.environment)
            rights = os.umask(one.umask)
            began = time.monotonic()
            code = run(there, place / "said.txt", "--cores", str(one.cores))
            seconds = time.monotonic() - began
            os.umask(rights)
            os.environ.clear()
            os.environ.update(before)
            found = there.digests()
            first = first or found
            other = sorted(name for name in first | found if first.get(name) != found.get(name))
            said = (place / "said.txt").read_text(encoding="utf-8", errors="replace")
            told = (
                f"exit status {code}: {said[-500:]}" if code else f"{len(found)} files, same bytes"
            )
            told = f"other bytes: {', '.join(other)}" if other and not code else told
            faults += [f"{one.name}: {told}"] if other or code else []
            print(f"| {one.name} | {seconds:.0f} | {told} |", flush=True)
            shutil.rmtree(there.root)
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
