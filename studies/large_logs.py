"""Files that would take much more than they hold: memory and time until they are refused or read, ``make largelogs``.

Each is given to ``rftfit inspect`` in a process of its own, beside a small file of the same dialect. Then a campaign with a
log of 1 GB goes through ``rftfit run``, whose largest process is to take less memory than was said before it starts.
``ARGS="--run 200"`` does that alone, with a log of 200 MB.
"""

from __future__ import annotations

import argparse
import csv
import io
import os
import re
import sqlite3
import subprocess
import sys
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml

for folder in ("tests/helpers", "benchmarks"):
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / folder))

from log_files import wrench, write_ros2
from makers import GOLDEN, LONGEST_S, MadePush, MadePushes, write_campaign
from scale import watched

MOST_MB, MOST_S = 300, 2.0
"""Memory of the whole process, MB, and processor time beyond that of a small file, s, that no file may take."""
_NAMESPACE = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
_HEADER = '<row r="1"><c t="inlineStr"><is><t>time_s</t></is></c><c t="inlineStr"><is><t>F1_N</t></is></c></row>'
ROW = "<row><c><v>{0}</v></c><c><v>1</v></c></row>"


def small_bag(folder: Path) -> Path:
    """Bag of ROS 2 with 20 wrenches."""
    return write_ros2(folder, [wrench(index) for index in range(20)], "SQLITE3")


def bag_with_blob(megabytes: int) -> Callable[[Path], Path]:
    """Bag of ROS 2 of which one message is large."""

    def make(folder: Path) -> Path:
        path = small_bag(folder)
        with closing(sqlite3.connect(path)) as connection, connection:
            connection.execute(
                "UPDATE messages SET data = zeroblob(?) WHERE id = 7", (megabytes * 10**6,)
            )
        return path

    return make


def mcap_with_blob(megabytes: int) -> Callable[[Path], Path]:
    """MCAP file of which one message is large."""
    return lambda folder: write_ros2(
        folder, [*(wrench(index) for index in range(20)), bytes(megabytes * 10**6)]
    )


def workbook(rows: int, row: str) -> Callable[[Path], Path]:
    """Workbook of one sheet whose rows are alike."""

    def make(folder: Path) -> Path:
        from openpyxl import Workbook  # type: ignore[import-untyped]

        plain, path = io.BytesIO(), folder / "log.xlsx"
        folder.mkdir()
        Workbook().save(plain)
        sheet_name = "xl/worksheets/sheet1.xml"
        with zipfile.ZipFile(plain) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
            for name in old.namelist():
                if name != sheet_name:
                    new.writestr(name, old.read(name))
            with new.open(sheet_name, "w") as sheet:
                sheet.write(f"<worksheet {_NAMESPACE}><sheetData>{_HEADER}".encode())
                for first in range(0, rows, 10_000):
                    numbers = range(first, min(first + 10_000, rows))
                    sheet.write("".join(row.format(number) for number in numbers).encode())
                sheet.write(b"</sheetData></worksheet>")
        return path

    return make


_TO_XFD = '<row><c><v>{0}</v></c><c><v>1</v></c><c r="XFD1"><v>7</v></c></row>'


def archive(count: int) -> Callable[[Path], Path]:
    """NumPy archive of arrays."""

    def make(folder: Path) -> Path:
        folder.mkdir()
        path = folder / "log.npz"
        arrays: dict[str, Any] = {f"channel_{index}": np.arange(5.0) for index in range(count)}
        np.savez(path, **arrays)
        return path

    return make


def hdf5(count: int) -> Callable[[Path], Path]:
    """HDF5 file of arrays."""

    def make(folder: Path) -> Path:
        import h5py

        folder.mkdir()
        path = folder / "log.h5"
        with h5py.File(path, "w") as file:
            for index in range(count):
                file[f"channel_{index}"] = np.arange(5.0)
        return path

    return make


FILES: dict[str, dict[str, Callable[[Path], Path]]] = {
    "ROS 2 bag, database": {
        "20 wrenches": small_bag,
        **{f"one message of {size} MB": bag_with_blob(size) for size in (100, 200, 900)},
    },
    "ROS 2 bag, MCAP": {
        "20 wrenches": lambda folder: write_ros2(folder, [wrench(index) for index in range(20)]),
        **{f"one message of {size} MB": mcap_with_blob(size) for size in (100, 200)},
    },
    "xlsx": {
        "1,000 rows": workbook(1000, ROW),
        "60,000 rows to column XFD": workbook(60_000, _TO_XFD),
        "20,000,000 rows": workbook(20_000_000, ROW),
        "20,000,000 empty rows": workbook(20_000_000, "<row/>"),
    },
    "npz": {"5 arrays": archive(5), "40,000 arrays": archive(40_000)},
    "HDF5": {"5 arrays": hdf5(5), "40,000 arrays": hdf5(40_000)},
}
"""By dialect: a small file first."""


def inspect(path: Path) -> tuple[int, float, float, str]:
    """Inspect a file; exit status, most memory (MB), processor time (s) and the last line that was said."""
    command = [sys.executable, "-P", "-m", "rftfit", "inspect", str(path)]
    with TemporaryDirectory() as folder, (Path(folder) / "said.txt").open("w+b") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        lines = said.read().decode("utf-8", "replace").strip().splitlines()
    processor_s = usage.ru_utime + usage.ru_stime
    return process.returncode, usage.ru_maxrss / 1e3, processor_s, lines[-1] if lines else ""


def made_elsewhere(dialect: str, name: str, folder: Path) -> Path:
    """Make a file in a process of its own: a process begins with the memory of the one that starts it."""
    words = ["make", dialect, name, str(folder)]
    made = subprocess.run(
        [sys.executable, __file__, *words], check=True, capture_output=True, text=True
    )
    return Path(made.stdout.strip())


# --- A long log through the whole workflow.

LONG_LOG_MB = 1000
MOST_OF_RUN_MB = 1000
"""Memory of the largest process of a run with a log of 1 GB."""
_RUNS = (
    {"run_id": "rod", "kind": "rod", "gamma_deg": "90", "beta_deg": "0"},
    {
        "run_id": "push",
        "kind": "plate",
        "gamma_deg": "90",
        "beta_deg": "0",
        "tare_run": "rod",
        "tare_shared": "yes",
    },
    {
        "run_id": "slow",
        "kind": "plate",
        "gamma_deg": "90",
        "beta_deg": "0",
        "tare_run": "rod",
        "tare_shared": "yes",
    },
)
_ROWS_AT_ONCE = 1 << 20


def campaign_with_long_log(folder: Path, megabytes: float) -> Path:
    """Write a campaign of two pushes, and let the force log of one be that of a fast transducer; the long log."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    config = yaml.safe_load((GOLDEN / "home-rig" / "config.yaml").read_text(encoding="utf-8"))
    for channel in ("F1", "F3"):
        config["force_log"]["columns"][channel]["unit"] = "N"
    names = {"intruder": "plate", "medium": "sand", "direction": "intrusion"}
    rows = [
        {
            **run,
            **names,
            "force_log": f"{run['run_id']}.csv",
            "motion_log": f"{run['run_id']}_stage.csv",
        }
        for run in _RUNS
    ]
    pushes = MadePushes(clock_offset_s={"": 3.0})
    write_campaign(folder, config, rows=rows, pushes=pushes)
    path = folder / config["raw"] / "push.csv"
    # the push begins when the one that it replaces does
    start_s = float(path.read_text(encoding="utf-8").splitlines()[1].split(",")[0])
    random = np.random.default_rng(5)
    n_rows = int(megabytes * 1e6 / _BYTES_OF_ROW)
    with path.open("wb") as file:
        file.write(b"time_s,force_x,force_z\n")
        for first in range(0, n_rows, _ROWS_AT_ONCE):
            time_s = np.arange(first, min(first + _ROWS_AT_ONCE, n_rows)) * (LONGEST_S / n_rows)
            way_cm = MadePush().way_at(time_s)
            force_z_N = 0.36 * 15 * np.maximum(way_cm, 0) + 0.06 * np.maximum(way_cm, 0)
            noise_x_N, noise_z_N = 0.02 * random.standard_normal((2, time_s.size))
            columns = {
                "time": np.round(start_s + time_s, 6),
                "x": np.round(noise_x_N, 6),
                "z": np.round(force_z_N + noise_z_N, 6),
            }
            table = pa.table({name: pa.array(values) for name, values in columns.items()})
            pacsv.write_csv(table, file, pacsv.WriteOptions(include_header=False))
    return path


_BYTES_OF_ROW = 32


def run_with_long_log(megabytes: float) -> list[str]:
    """Run a campaign with a long log; print what was said, the memory and the time it took, and say what is too much."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        log_MB = campaign_with_long_log(folder, megabytes).stat().st_size / 1e6
        output = folder / "said.txt"
        command = [sys.executable, "-P", "-m", "rftfit", "run"]
        with output.open("wb") as said:
            _, processor_s, largest_MB = watched(command, folder, said)
        lines = output.read_text(encoding="utf-8", errors="replace").splitlines()
        with (folder / "results" / "fits" / "sand.csv").open(encoding="utf-8") as table:
            reasons = {row["run_id"]: row["reason"] for row in csv.DictReader(table)}
    stated = [int(match[1]) for line in lines if (match := re.search(r"up to (\d+) MB", line))]
    print(f"| csv through `rftfit run` | {log_MB:.1f} | 0 | {largest_MB:.0f} | {processor_s:.2f} |")
    print("said before:", *[line for line in lines if " MB of memory" in line], sep="\n  ")
    faults = [f"no alpha of {run_id}: {reason}" for run_id, reason in reasons.items() if reason]
    if largest_MB > MOST_OF_RUN_MB or not stated or largest_MB > stated[0]:
        faults.append(f"{largest_MB:.0f} MB were taken, {stated} MB said, {MOST_OF_RUN_MB} allowed")
    return faults


def main() -> None:
    """Make and inspect each file, and run a campaign with a long log; print a table, and what took too much."""
    if sys.argv[1:2] == ["make"]:
        dialect, name, folder = sys.argv[2:]
        print(FILES[dialect][name](Path(folder)))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--run", type=float, metavar="MB", help="a long log through run, and nothing else"
    )
    chosen = parser.parse_args()
    faults = [] if chosen.run else inspect_all()
    faults += run_with_long_log(chosen.run or LONG_LOG_MB)
    if faults:
        sys.exit("\n".join(faults))


def inspect_all() -> list[str]:
    """Make and inspect each file; print a table, and return what took too much."""
    faults = []
    print(
        "| file | size (MB) | exit status | memory (MB) | processor time (s) |\n|---|---|---|---|---|"
    )
    for dialect, makers in FILES.items():
        small_s = 0.0
        for number, name in enumerate(makers):
            with TemporaryDirectory() as folder:
                path = made_elsewhere(dialect, name, Path(folder) / "log")
                size_MB = path.stat().st_size / 1e6
                status, memory_MB, processor_s, line = inspect(path)
            small_s = processor_s if number == 0 else small_s
            print(
                f"| {dialect}: {name} | {size_MB:.1f} | {status} | {memory_MB:.0f} | {processor_s:.2f} |",
                flush=True,
            )
            if memory_MB > MOST_MB or processor_s > small_s + MOST_S or "Traceback" in line:
                faults.append(f"{dialect}: {name}: {line}")
    return faults


if __name__ == "__main__":
    main()
