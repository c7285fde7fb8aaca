"""A full or read-only disk ends a command with a clear message, and no locale changes a byte.

`make fulldisk` and `make samebytes` do the same with the real workflow.
"""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from harm import on_own_disks, why_not

from rftfit.cli.main import main
from rftfit.errors import OutputError
from rftfit.store import atomic_path

FULL = Path("/dev/full")
"""A device that has no room for a byte."""
NO_ROOM = os.strerror(errno.ENOSPC)
SCALE = "-m rftfit scale --alpha 0.9"
PREDICT = "-m rftfit predict --leg c_leg --medium poppy_LP --output"
STAGE = """
import sys
from rftfit.errors import OutputError
import rftfit.workflow.job as program
def fails(*_):
    raise OutputError("results/alpha.csv: full")
program.read_states = fails
sys.exit(program.main(["results/state/slopes.json", "--writes", "results/alpha.csv"]))
"""
DRAWING = """
import pathlib, resource, signal, sys
from matplotlib.figure import Figure
from rftfit.errors import OutputError
from rftfit.figures.style import save
figure = Figure(figsize=(0.3, 0.3), dpi=20)
figure.add_subplot().plot([n % 7 for n in range(9000)], [n % 11 + n / 9000 for n in range(9000)])
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))
try:
    save(figure, pathlib.Path(sys.argv[1]), endings=("png", "pdf"))
except OutputError as error:
    print(error)
"""
CIRCUMSTANCES = {
    "LC_ALL": "C",
    "PYTHONUTF8": "0",
    "PYTHONCOERCECLOCALE": "0",
    "PYTHONHASHSEED": "1",
    "TZ": "Asia/Kathmandu",
}
"""Another locale, hash seed and time zone."""


def call(words, *arguments, **environment):
    return subprocess.run(
        [sys.executable, *words.split(), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
        encoding="utf-8",
    )


@pytest.mark.skipif(os.name != "posix", reason="limits of file sizes are Unix's")
def test_a_pdf_that_is_refused_is_no_fault_of_the_program(tmp_path):
    """There, what matplotlib raises while it closes the file is no error of a file."""
    process = call("-c", DRAWING, tmp_path / "figure")
    assert process.returncode == 0, process.stderr
    assert re.search(f"figure.pdf: .*: {os.strerror(errno.EFBIG)}", process.stdout)
    assert [path.name for path in tmp_path.iterdir()] == ["figure.png"]


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full, a device of Linux")
def test_an_answer_that_nobody_has_room_for():
    with FULL.open("w") as full:
        process = subprocess.run(
            [sys.executable, *SCALE.split()],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert process.returncode == 3
    assert re.fullmatch(f"rftfit: standard output: .*: {NO_ROOM}; .*\n", process.stderr)


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full, a device of Linux")
def test_a_stage_whose_log_is_on_the_full_disk_is_heard():
    """Its message goes to standard output, which `rftfit run` reads; the exit status is kept."""
    with FULL.open("w") as full:
        process = subprocess.run(
            [sys.executable, "-c", STAGE],
            stdout=subprocess.PIPE,
            stderr=full,
            text=True,
            check=False,
        )
    assert process.returncode == 3
    assert process.stdout == "rftfit slopes: results/alpha.csv: full\n"


@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_a_disk_that_refuses_a_result(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    process = on_own_disks(
        [
            "sh",
            "-c",
            'mount -t tmpfs -o size=8k tmpfs "$0" && "$@" "$0/leg.csv"; told=$?; ls -A "$0"; exit $told',
            str(disk),
            sys.executable,
            *PREDICT.split(),
        ],
        capture_output=True,
    )
    assert process.returncode == 3
    assert re.search(f"rftfit: {disk}/leg.csv: .*: {NO_ROOM}\\. ", process.stderr)
    assert "Traceback" not in process.stdout + process.stderr
    # ls finds nothing, not even an unfinished file
    assert not process.stdout.endswith("csv\n")


def test_the_reason_is_the_systems_own(tmp_path):
    def write():
        with atomic_path(tmp_path / "traces.parquet"):
            raise OSError(errno.ENOSPC, "Error writing bytes to file. Detail: [errno 28] No space")

    with pytest.raises(OutputError, match=rf"traces\.parquet: .*: {NO_ROOM}\. "):
        write()
    assert list(tmp_path.iterdir()) == []


def test_same_bytes_in_any_locale_and_time_zone(tmp_path):
    first_csv, second_csv = tmp_path / "here.csv", tmp_path / "été ü" / "leg.csv"
    assert main([*PREDICT.split()[2:], str(first_csv)]) == 0
    process = call(PREDICT, second_csv, **CIRCUMSTANCES)
    assert process.returncode == 0, process.stderr
    assert first_csv.read_bytes() == second_csv.read_bytes()
