"""What may befall a run and its files: nothing is left half-written, and `rftfit run` goes on to the same bytes.

    make killed       SIGKILL at a random moment to a stage, Snakemake, `rftfit run`, or all of them
    make fulldisk     disks that are too small or read-only (Linux, where anybody may have a mount namespace)
    make samebytes    cores, line ends of the run sheet, folder, locale, time zone, hash seed, rights, threads
    make largelogs    a log of 1 GB through `rftfit run` (ARGS="--count 200": of 200 MB)

A small campaign is run undisturbed once; `faults` of a row is empty where all is well.
"""

from __future__ import annotations

import csv
import os
import random
import re
import shutil
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import frame
import numpy as np
import pandas as pd
import yaml
from campaigns import Folder, make_campaign
from frame import Part, Row
from harm import (
    KINDS,
    STAGE,
    change,
    compare_results,
    fresh,
    kill,
    mount,
    on_own_disks,
    room,
    run,
    seconds_until_quiet,
    start,
    state,
    unmount,
    why_not,
)
from makers import GOLDEN, LONGEST_S, MadePush, MadePushes, write_campaign
from scale import watched

_FOLDER = TemporaryDirectory(prefix="rftfit_damage_")
PLACE = Path(_FOLDER.name).resolve()


class Undisturbed(NamedTuple):
    """A campaign that was run without disturbance, the digests of its results, and the seconds that this took."""

    folder: Any
    digests: dict[str, str]
    seconds: float


@cache
def undisturbed(medium: str, plates_only: bool = False) -> Undisturbed:
    """Write a campaign and run it."""
    folder = make_campaign(PLACE / medium, (medium,), plates_only=plates_only)
    begin = time.monotonic()
    code, printed = run_and_read(folder)
    if code:
        sys.exit(printed)
    return Undisturbed(folder, folder.digests(), time.monotonic() - begin)


def run_and_read(folder: Any, *words: str) -> tuple[int, str]:
    """Exit status of `rftfit run`, and what it printed."""
    output = PLACE / "printed.txt"
    code = run(folder, output, *words)
    return code, output.read_text(encoding="utf-8", errors="replace")


def copy_campaign(folder: Any, name: str) -> Any:
    """A copy under another name."""
    root = PLACE / name
    shutil.rmtree(root, ignore_errors=True)
    shutil.copytree(folder.root, root)
    return Folder(root)


def faults_of_results(folder: Any, whole: dict[str, str], code: int, printed: str) -> list[str]:
    """What is wrong with a run that should have the results of the undisturbed one."""
    if code:
        return [f"exit status {code}: {printed[-500:]}"]
    names = frame.differing_files(folder.digests(), whole)
    return [f"other bytes: {', '.join(names)}"] if names else []


report = frame.list_rows("Faults are empty where all is well")


def is_good(rows: pd.DataFrame) -> bool:
    """Whether no row has a fault."""
    return bool(rows["faults"].isna().all())


# --- Killed


QUIET_S, TRIES = 15.0, 5


def grade_kill(seed: int, number: int) -> list[Row]:
    """Kill a run that began with nothing, look at what is left, and go on."""
    folder, whole, seconds = undisturbed("yuma")
    kind = KINDS[number % len(KINDS)]
    luck, output = random.Random(f"{seed} {number}"), PLACE / "killed.txt"
    for _ in range(TRIES):
        fresh(folder)
        child = start(folder, output)
        begin = time.monotonic()
        time.sleep(luck.uniform(0.02, 0.98) * seconds)
        is_hit, stages = kill(child, kind, luck.random())
        if is_hit:
            break
    else:
        raise RuntimeError("the run was over before it could be killed, again and again")
    after_s = time.monotonic() - begin
    # the other stages of a killed one go on, and then the run ends by itself
    quiet_s = seconds_until_quiet(folder.root, 10 * seconds if kind == STAGE else QUIET_S)
    code, before = child.wait(), state(folder)
    time.sleep(1)
    faults = ["orphans"] * (quiet_s == float("inf"))
    faults += ["written after the end"] * (state(folder) != before)
    left = compare_results(folder, whole)
    faults += [f"partial {name}" for name in left.partial]
    printed = output.read_text(encoding="utf-8")
    if kind == STAGE and (code != 4 or "killed (SIGKILL)" not in printed):
        faults.append(f"exit status {code}: {printed[-300:]}")
    code, printed = run_and_read(folder)
    lock = "cleared by itself" if "its lock is cleared" in printed else "none"
    if "rftfit run --unlock" in printed:
        lock = "after --unlock"
        run_and_read(folder, "--unlock")
        code, printed = run_and_read(folder)
    faults += faults_of_results(folder, whole, code, printed)
    return [
        {
            "killed": kind,
            "after, s": after_s,
            "stages then": ", ".join(stages),
            "complete files": f"{left.complete} of {len(whole)}",
            "unfinished": left.rests,
            "others ended after, s": quiet_s,
            "lock": lock,
            "faults": "; ".join(faults),
        }
    ]


# --- Full disks


DISKS = [
    *(("results", share) for share in (0.0, 0.002, 0.02, 0.1, 0.4, 0.7, 0.9, 0.98)),
    ("results, read-only", 1.0),
    # what Snakemake itself keeps is on the same disk
    *(("campaign", share) for share in (0.003, 0.5)),
]
"""What is on a disk, and its room as a share of what all results need."""
INSIDE = "RFTFIT_ON_OWN_DISKS"


def grade_disk(what: str, share: float) -> list[Row]:
    """Run on a disk that refuses a file, then on one that does not."""
    source, whole, _ = undisturbed("yuma")
    needed = room(source.root / "results")
    folder = copy_campaign(source, "disk")
    fresh(folder)
    disk = folder.root / "results"
    if what == "campaign":
        shutil.move(folder.root, PLACE / "moved")
        disk = folder.root
        mount(disk, 4 * needed)
        shutil.copytree(PLACE / "moved", disk, dirs_exist_ok=True)
        shutil.rmtree(PLACE / "moved")
        change(disk, f"size={room(disk) + int(share * needed)}")
    else:
        mount(disk, max(int(share * needed), 4096))
        change(disk, "ro" if share == 1 else "rw")
    code, printed = run_and_read(folder)
    left = compare_results(folder, whole)
    faults = [f"partial {name}" for name in left.partial] + ["unfinished"] * bool(left.rests)
    is_told = code == 3 and "cannot write" in printed and "run again" in printed
    if not is_told or "Traceback" in printed:
        faults.append(f"exit status {code}: {printed[-400:]}")
    change(disk, "rw", "size=500m")
    faults += faults_of_results(folder, whole, *run_and_read(folder))
    unmount(disk)
    refused = re.search(r"results/(\S+): cannot write", printed)
    return [
        {
            "disk": f"{what}, {share:.1%} of the room",
            "exit status": code,
            "the message names": refused[1] if refused else "",
            "complete files": f"{left.complete} of {len(whole)}",
            "half-written": left.rests + len(left.partial),
            "faults": "; ".join(faults),
        }
    ]


# --- Other circumstances


SHEET = Path("raw") / "paper" / "runs.csv"
ACCENTS = "été 2013 ü"
CIRCUMSTANCES: dict[str, dict[str, Any]] = {
    "1 core, hash seed 1, umask 077": {"cores": 1, "umask": 0o077, "PYTHONHASHSEED": "1"},
    "folder with accents, sheet with CRLF": {"folder": ACCENTS, "line_end": "\r\n"},
    # the encoding of files is ASCII then, unless the program says what it is
    "ASCII, folder with accents": {
        "folder": ACCENTS,
        "LC_ALL": "C",
        "PYTHONUTF8": "0",
        "PYTHONCOERCECLOCALE": "0",
    },
    **{f"{n} threads of OpenBLAS": {"OPENBLAS_NUM_THREADS": n} for n in "124"},
    "Turkish, Kathmandu": {"LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu"},
    "German in Latin-1, St. John's": {
        "LC_ALL": "de_DE.ISO-8859-1",
        "PYTHONUTF8": "0",
        "TZ": "America/St_Johns",
    },
}


def grade_circumstances(name: str) -> list[Row]:
    """Run a copy of the campaign in other circumstances."""
    source, whole, _ = undisturbed("poppy_LP", plates_only=True)
    case = CIRCUMSTANCES[name]
    environment = {key: value for key, value in case.items() if key.isupper()}
    if not make_locale(environment.get("LC_ALL", "C")):
        return [{"circumstances": name, "files": "skipped: no such locale here", "faults": ""}]
    folder = copy_campaign(source, case.get("folder", "copy"))
    fresh(folder)
    rows = (folder.root / SHEET).read_text(encoding="utf-8").splitlines()
    (folder.root / SHEET).write_bytes(case.get("line_end", "\n").join([*rows, ""]).encode())
    before, rights = dict(os.environ), os.umask(case.get("umask", 0o022))
    os.environ.update(environment, LOCPATH=str(PLACE / "locales"))
    try:
        code, printed = run_and_read(folder, "--cores", str(case.get("cores", 2)))
    finally:
        os.umask(rights)
        os.environ.clear()
        os.environ.update(before)
    faults = faults_of_results(folder, whole, code, printed)
    return [{"circumstances": name, "files": len(whole), "faults": "; ".join(faults)}]


def make_locale(name: str) -> bool:
    """Make a locale where this system does not have it; whether it is there now."""
    (PLACE / "locales").mkdir(exist_ok=True)
    language, _, encoding = name.partition(".")
    words = ["localedef", "-i", language, "-f", encoding, str(PLACE / "locales" / name)]
    if name == "C" or shutil.which("localedef") is None:
        return name == "C"
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


# --- A log of 1 GB


BYTES_OF_ROW, ROWS_AT_ONCE = 32, 1 << 20


def write_long_log(folder: Path, megabytes: float) -> Path:
    """Write a campaign of two pushes, and let the force log of one be that of a fast transducer; the long log."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    config = yaml.safe_load((GOLDEN / "home-rig" / "config.yaml").read_text(encoding="utf-8"))
    for channel in ("F1", "F3"):
        config["force_log"]["columns"][channel]["unit"] = "N"
    names = {"intruder": "plate", "medium": "sand", "direction": "intrusion", "beta_deg": "0"}
    tare = {"kind": "plate", "tare_run": "rod", "tare_shared": "yes"}
    rows = [
        names
        | {"run_id": run_id, "kind": "rod", "gamma_deg": "90"}
        | (tare if run_id != "rod" else {})
        | {"force_log": f"{run_id}.csv", "motion_log": f"{run_id}_stage.csv"}
        for run_id in ("rod", "push", "slow")
    ]
    write_campaign(folder, config, rows=rows, pushes=MadePushes(clock_offset_s={"": 3.0}))
    path = folder / config["raw"] / "push.csv"
    # the push begins when the one that it replaces does
    start_s = float(path.read_text(encoding="utf-8").splitlines()[1].split(",")[0])
    random_numbers = np.random.default_rng(5)
    n_rows = int(megabytes * 1e6 / BYTES_OF_ROW)
    with path.open("wb") as file:
        file.write(b"time_s,force_x,force_z\n")
        for first in range(0, n_rows, ROWS_AT_ONCE):
            time_s = np.arange(first, min(first + ROWS_AT_ONCE, n_rows)) * (LONGEST_S / n_rows)
            force_N = 0.02 * random_numbers.standard_normal((2, time_s.size))
            force_N[1] += (0.36 * 15 + 0.06) * np.maximum(MadePush().way_at(time_s), 0)
            columns = np.round([start_s + time_s, *force_N], 6)
            table = pa.table(dict(zip("txz", map(pa.array, columns), strict=True)))
            pacsv.write_csv(table, file, pacsv.WriteOptions(include_header=False))
    return path


def grade_long_log(megabytes: float) -> list[Row]:
    """Memory of the largest process of a run with a long log, beside what was said before it started."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        size_MB = write_long_log(folder, megabytes).stat().st_size / 1e6
        with (folder / "printed.txt").open("w+b") as output:
            words = [sys.executable, "-P", "-m", "rftfit", "run"]
            _, processor_s, memory_MB = watched(words, folder, output)
            output.seek(0)
            stated = re.search(r"up to (\d+) MB", output.read().decode("utf-8", "replace"))
        with (folder / "results" / "fits" / "sand.csv").open(encoding="utf-8") as table:
            faults = [f"{row['run_id']}: {row['reason']}" for row in csv.DictReader(table)]
    faults = [fault for fault in faults if not fault.endswith(": ")]
    if stated is None or memory_MB > float(stated[1]):
        faults.append("takes more than was said")
    return [
        {
            "size, MB": size_MB,
            "memory, MB": memory_MB,
            "said before": stated[1] if stated else "",
            "processor time, s": processor_s,
            "faults": "; ".join(faults),
        }
    ]


PARTS = {
    "killed": Part(frame.numbered, grade_kill, report, 20, is_good),
    "fulldisk": Part(DISKS, grade_disk, report, is_good=is_good),
    "samebytes": Part(frame.named([*CIRCUMSTANCES]), grade_circumstances, report, is_good=is_good),
    "longlog": Part(lambda count, _seed: [(count,)], grade_long_log, report, 1000, is_good),
}

if __name__ == "__main__":
    if "fulldisk" in sys.argv and INSIDE not in os.environ:
        if why_not():
            sys.exit(f"skipped: {why_not()}")
        words = [sys.executable, *sys.argv]
        sys.exit(on_own_disks(words, env={**os.environ, INSIDE: "yes"}).returncode)
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
