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
from harm import run

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
    locale_path = {"LOCPATH": str(locales)}
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
            environment={**locale_path, "LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu"},
        ),
        Circumstances(
            "`LC_ALL=de_DE.ISO-8859-1`, `PYTHONUTF8=0`, `TZ=America/St_Johns`",
            environment={
                **locale_path,
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


def missing(case, locales):
    """Tell why a circumstance cannot be had here, or nothing."""
    name = case.environment.get("LC_ALL", "C")
    return "" if name == "C" or make_locale(locales, name) else f"skipped: no locale {name} here"


def arrange(case, source, place):
    """A copy of the campaign, as the circumstances want it."""
    root = place / case.folder
    shutil.copytree(source.root, root)
    rows = (root / SHEET).read_text(encoding="utf-8").splitlines()
    text = case.line_end.join([*rows, ""])
    (root / SHEET).write_bytes(text.encode())
    return Folder(root)


def main():
    """Run it, print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--whole", action="store_true", help="with legs, sand and robot")
    chosen = parser.parse_args()
    media = ("poppy_LP", "yuma") if chosen.whole else ("poppy_LP",)
    faults, first_digests = [], dict[str, str]()
    before = dict(os.environ)
    with tempfile.TemporaryDirectory(prefix="rftfit_same_bytes_") as folder:
        place = Path(folder).resolve()
        source = make_campaign(place / "source", media, plates_only=not chosen.whole)
        config = source.root / "config" / "config.yaml"
        titled = config.read_text(encoding="utf-8").replace("title: ", "title: été ß Ω ", 1)
        config.write_text(titled, encoding="utf-8")
        print("| circumstances | seconds | results |\n|---|---|---|", flush=True)
        for case in circumstances(place / "locales"):
            (place / "locales").mkdir(exist_ok=True)
            if why := missing(case, place / "locales"):
                print(f"| {case.name} | - | {why} |", flush=True)
                continue
            campaign = arrange(case, source, place)
            os.environ.update(case.environment)
            rights = os.umask(case.umask)
            began = time.monotonic()
            code = run(campaign, place / "said.txt", "--cores", str(case.cores))
            seconds = time.monotonic() - began
            os.umask(rights)
            os.environ.clear()
            os.environ.update(before)
            digests = campaign.digests()
            first_digests = first_digests or digests
            differing = sorted(
                name
                for name in first_digests | digests
                if first_digests.get(name) != digests.get(name)
            )
            output_text = (place / "said.txt").read_text(encoding="utf-8", errors="replace")
            verdict = (
                f"exit status {code}: {output_text[-500:]}"
                if code
                else f"{len(digests)} files, same bytes"
            )
            verdict = f"other bytes: {', '.join(differing)}" if differing and not code else verdict
            faults += [f"{case.name}: {verdict}"] if differing or code else []
            print(f"| {case.name} | {seconds:.0f} | {verdict} |", flush=True)
            shutil.rmtree(campaign.root)
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
