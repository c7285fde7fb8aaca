"""Files that would take much more than they hold: memory and time until they are refused or read, ``make largelogs``.

Each is given to ``rftfit inspect`` in a process of its own, beside a small file of the same dialect.
"""

from __future__ import annotations

import io
import os
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

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from binary_logs import wrench, write_ros2

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


def main() -> None:
    """Make and inspect each file; print a table, and what took too much."""
    if sys.argv[1:2] == ["make"]:
        dialect, name, folder = sys.argv[2:]
        print(FILES[dialect][name](Path(folder)))
        return
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
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
