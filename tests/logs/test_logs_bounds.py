"""Logs that read other files or unpack to too much memory are refused before they do so."""

import gzip
import io
import sqlite3
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import make_campaign, run_rules
from log_files import ROS1_TYPE, refused, wrench, write_ros1, write_ros2
from makers import answer_of, read_rows

import rftfit
from rftfit.logs.registry import dialect

h5py = pytest.importorskip("h5py")

HUGE, MOST_MB = 250_000_000, 200
"""Numbers that a small file claims to hold, and the memory that reading may take."""
ZEROS = bytes(1 << 22)


# --- Files that name others


def external(file, name="F"):
    file.create_dataset(name, (8,), "f8", external=[("secret.bin", 0, 64)])


def virtual(file, name, *source):
    layout = h5py.VirtualLayout((8,), "f8")
    layout[:] = h5py.VirtualSource(*source, (8,))
    file.create_virtual_dataset(name, layout)


def virtual_through_a_link(file):
    file["way"] = h5py.ExternalLink("secret.h5", "/")
    virtual(file, "F", ".", "way/F")


def virtual_of_hidden_external(file):
    external(file, "#refs#/a")
    virtual(file, "F", ".", "#refs#/a")


@pytest.mark.parametrize("name", ["a.h5", "a.mat"])
@pytest.mark.parametrize(
    ("make", "dataset", "source"),
    [
        (external, "F", "secret.bin"),
        (lambda file: virtual(file, "run/F", "secret.h5", "F"), "run/F", "secret.h5"),
        (virtual_through_a_link, "F", "way/F"),
        (virtual_of_hidden_external, "#refs#/a", "secret.bin"),
    ],
)
def test_hdf5_that_reads_other_files(tmp_path, monkeypatch, make, dataset, source, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret.bin").write_bytes(np.arange(8.0).tobytes())
    with h5py.File("secret.h5", "w") as file:
        file["F"] = np.arange(8.0)
    with h5py.File(name, "w", userblock_size=512) as file:
        file["time"] = np.arange(8.0)
        make(file)
    with (tmp_path / name).open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(512))
    refused(dialect("arrays"), tmp_path / name, "other_file", f" '{dataset}' ", f" '{source}';")


def test_inspect_check_and_run_refuse_it(tmp_path):
    directions = ((0.0, 90.0),)
    folder = make_campaign(tmp_path / "lab", ("poppy_CP",), plates_only=True, directions=directions)
    values = yaml.safe_load(folder.config.read_text("utf-8"))
    values["force_log"] = {"dialect": "arrays"}
    folder.config.write_text(yaml.safe_dump(values), "utf-8")
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.arange(8.0).tobytes())
    raw = folder.root / "raw" / "paper"
    for row in read_rows(raw / "runs.csv"):
        path = raw / row["force_log"]
        path.unlink()
        with h5py.File(path, "w") as file:
            file.create_dataset("F", (8,), "f8", external=[(str(secret), 0, 64)])
    error = refused(dialect("arrays"), path, "other_file", " 'F' ", f" '{secret}';")
    code, _, printed = answer_of("inspect", path)
    assert code == 2
    assert str(error) in printed
    process = folder.rftfit("check")
    assert process.returncode == 2
    assert str(error).removeprefix(str(path)) in process.stdout
    run_rules(folder.config, "ingest")
    runs = folder.table("runs/poppy_CP.csv")
    assert set(runs["status"]) == {"refused"}
    assert set(runs["reason_code"]) == {"other-file"}


def test_hdf5_that_reads_itself(tmp_path):
    """Virtual datasets of the file's own; links to other files are not followed, as before."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["raw/F"] = np.arange(8.0)
        file["way"] = h5py.ExternalLink("secret.h5", "/")
        file["soft"] = h5py.SoftLink("/way/F")
        file["nothing"] = h5py.Empty("f8")
        virtual(file, "F", ".", "/raw/F")
    log = dialect("arrays").load(tmp_path / "a.h5")
    assert set(log.columns) == {"F", "raw.F"}
    np.testing.assert_array_equal(log.columns["F"], np.arange(8.0))


# --- Small files of huge content


def h5_fill(path):
    with h5py.File(path, "w") as file:
        for name in ("time", "F"):
            file.create_dataset(name, (HUGE // 2,), "f8", chunks=(1 << 20,), compression="gzip")


def h5_small_numbers(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("F", (HUGE,), "i1", chunks=(1 << 20,))


def h5_large_block(path):
    """A block of which the dataset has the first rows only."""
    with h5py.File(path, "w") as file:
        file.create_dataset("F", (8,), "f8", maxshape=(None,), chunks=(HUGE,), compression="gzip")


def deflated(count, head=b""):
    packer = zlib.compressobj(1)
    parts = [packer.compress(head), *(packer.compress(ZEROS) for _ in range(count))]
    return b"".join([*parts, packer.flush()])


def h5_lie(path):
    """A block that unpacks to more than its size."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("F", (400,), "f8", chunks=(400,), compression="gzip")
        data.id.write_direct_chunk((0,), deflated(128))


def npy_head(count):
    head, described = io.BytesIO(), {"descr": "<f8", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(head, described)
    return head.getvalue()


def npz(path):
    archive = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1)
    with archive, archive.open("F.npy", "w") as member:
        member.write(npy_head(HUGE // 2 + 10_000_000))
        for _ in range(HUGE * 4 // len(ZEROS) + 20):
            member.write(ZEROS)


def npy(path):
    path.write_bytes(npy_head(HUGE) + bytes(8000))


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data


def mat5(count, data):
    """A file of one packed variable: doubles, as MATLAB writes whole numbers, in a byte each."""
    flags, name = element(6, struct.pack("<II", 6, 0)), element(1, b"Fx      ")
    inside = flags + element(5, struct.pack("<ii", count, 1)) + name + struct.pack("<II", 2, count)
    packer = deflated(len(data) // len(ZEROS), struct.pack("<II", 14, len(inside) + count) + inside)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    return head + element(15, packer)


def parquet(path):
    pd.DataFrame({"F": np.zeros(140_000_000, bool)}).to_parquet(path)


def gz(path):
    head, rows = b"# rig\ntime_s,x_mm,z_mm,angle_deg\n", b"0,1,2,3\n" * 500_000
    path.write_bytes(gzip.compress(head) + gzip.compress(rows) * 270)


def xlsx(path):
    """Styles without number: each becomes an object that takes a hundred times its text."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("[Content_Types].xml", "")
        archive.writestr("xl/styles.xml", b"<xf/>" * 4_000_000)


BOMBS: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "fill.h5": ("arrays", h5_fill, "too_large"),
    "small.h5": ("arrays", h5_small_numbers, "too_large"),
    "block.h5": ("arrays", h5_large_block, "too_large"),
    "lie.h5": ("arrays", h5_lie, "damaged"),
    "a.npz": ("arrays", npz, "too_large"),
    "a.npy": ("arrays", npy, "too_large"),
    "a.mat": ("arrays", lambda path: path.write_bytes(mat5(HUGE, ZEROS * 60)), "too_large"),
    "cells.mat": ("arrays", lambda path: path.write_bytes(mat5(HUGE, b"")), "too_large"),
    "a.parquet": ("parquet", parquet, "too_large"),
    "a.csv.gz": ("rig", gz, "too_large"),
    "a.xlsx": ("xlsx", xlsx, "too_large"),
}
LOAD = """
import os
import sys
from pathlib import Path
import rftfit
try:
    rftfit.read_log("nothing")  # imports what the children need
except rftfit.RftfitError:
    pass
for dialect, path in zip(sys.argv[1::2], map(Path, sys.argv[2::2])):
    # a process for each, so that none inherits the memory that another one has taken
    if os.fork():
        os.wait()
        continue
    try:
        rftfit.read_log(path, dialect)
    except rftfit.RftfitError as error:
        # not ru_maxrss, which begins with that of the process that starts this one
        status = Path("/proc/self/status").read_text()
        megabytes = int(status.partition("VmHWM:")[2].split()[0]) >> 10
        print(path, getattr(error, "code", ""), megabytes, error, sep=": ", flush=True)
    os._exit(0)
"""


def refuse_apart(dialects):
    """Read files by these dialects, by path; code of the refusal, largest memory in MB, and message."""
    words = [str(word) for path, name in dialects.items() for word in (name, path)]
    command = [sys.executable, "-c", LOAD, *words]
    process = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line.split(": ", 3) for line in process.stdout.splitlines()]
    return {Path(path): (code, int(megabytes), text) for path, code, megabytes, text in lines}


@pytest.fixture(scope="module")
def refusals(tmp_path_factory):
    """What each file is refused with, by its path."""
    folder = tmp_path_factory.mktemp("bombs")
    for name, (_, make, _) in BOMBS.items():
        make(folder / name)
        assert (folder / name).stat().st_size < 30_000_000
    answers = refuse_apart({folder / name: reader for name, (reader, _, _) in BOMBS.items()})
    return {path.name: (path, *answer) for path, answer in answers.items()}


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of memory is read from /proc")
@pytest.mark.parametrize("name", BOMBS)
def test_refused_before_it_takes_memory(refusals, name):
    *_, expected_code = BOMBS[name]
    path, code, megabytes, text = refusals[name]
    assert (code, megabytes < MOST_MB) == (expected_code, True), (megabytes, text)
    assert text.startswith(str(path))
    assert "allowed: 1074 MB" in text or code == "damaged"


@pytest.mark.parametrize("notes", [1, 600])
def test_rows_as_wide_as_a_sheet_can_be(tmp_path, notes):
    """A cell at the far end makes a row of 16,384, of which the library makes up all but three; one is no harm."""
    rows = pd.DataFrame(1.0, index=range(600), columns=["time", "F"])
    far = pd.DataFrame(1.0, index=range(notes), columns=["far"])
    with pd.ExcelWriter(tmp_path / "a.xlsx", engine="xlsxwriter") as book:
        rows.to_excel(book, index=False)
        far.to_excel(book, index=False, header=notes > 1, startrow=40, startcol=16_383)
    if notes > 1:
        refused(dialect("xlsx"), tmp_path / "a.xlsx", "too_large", "column 16384")
    else:
        assert dialect("xlsx").load(tmp_path / "a.xlsx").rows == 600


# --- Limits that are asked before reading


def small_bag(folder):
    """Bag of ROS 2 with 20 wrenches."""
    return write_ros2(folder, [wrench(index) for index in range(20)], "SQLITE3")


def bag_with_blob(folder, megabytes):
    """Bag of ROS 2 of which one message is large."""
    path = small_bag(folder)
    with closing(sqlite3.connect(path)) as connection, connection:
        sizes = (megabytes * 10**6,)
        connection.execute("UPDATE messages SET data = zeroblob(?) WHERE id = 7", sizes)
    return path


def npz_of(path, count):
    arrays: dict[str, Any] = {f"channel_{index}": np.arange(5.0) for index in range(count)}
    np.savez(path, **arrays)


def h5_of(path, count):
    with h5py.File(path, "w") as file:
        for index in range(count):
            file[f"channel_{index}"] = np.arange(5.0)


def test_a_sheet_of_more_rows_than_one_has_is_refused_before_a_row_is_read(tmp_path, monkeypatch):
    tabular = "rftfit.logs.tabular"
    monkeypatch.setattr(f"{tabular}.MOST_ROWS", 900)
    monkeypatch.setattr(f"{tabular}._LEAST_TO_COUNT", 900)
    monkeypatch.setattr(f"{tabular}.XlsxReader._plan", lambda *_: pytest.fail("a row was read"))
    pd.DataFrame({"time_s": range(1000), "F1_N": 1}).to_excel(tmp_path / "a.xlsx", index=False)
    refused(dialect("xlsx"), tmp_path / "a.xlsx", "too_large", "row 900")


@pytest.mark.parametrize(("name", "make"), [("a.npz", npz_of), ("a.h5", h5_of)])
def test_a_file_of_more_arrays_than_a_log_has(tmp_path, name, make):
    make(tmp_path / name, 2001)
    refused(dialect("arrays"), tmp_path / name, "too_large", "2000 arrays")
    make(tmp_path / name, 200)
    assert len(dialect("arrays").load(tmp_path / name).columns) == 200


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of memory is read from /proc")
def test_a_message_of_a_bag_is_asked_for_its_size_before_it_is_read(tmp_path):
    pytest.importorskip("rosbags")
    path = bag_with_blob(tmp_path / "bag", 400)
    code, megabytes, text = refuse_apart({path: "ros-bag"})[path]
    assert (code, megabytes < MOST_MB) == ("too_large", True), (megabytes, text)
    # named by its folder, it is the same bag
    refused(dialect("ros-bag"), path.parent / "metadata.yaml", "too_large")


def test_a_large_record_of_a_bag_is_not_read(tmp_path, monkeypatch):
    pytest.importorskip("rosbags")
    monkeypatch.setattr("rftfit.logs.rosbag.MOST_OF_BLOCK", 100_000)
    ros1 = write_ros1(tmp_path / "a.bag", ROS1_TYPE, bytes(28), count=9000)
    ros2 = write_ros2(tmp_path / "b", [wrench(1)] * 3000)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", lambda _: pytest.fail("the bag was read"))
        for path in (ros1, ros2):
            refused(dialect("ros-bag"), path, "too_large")
    # named by its folder, it is the same bag
    with pytest.raises(rftfit.RftfitError, match=r"\.mcap: .*larger"):
        rftfit.read_log(tmp_path / "b")


def test_messages_of_a_topic_are_counted_by_their_sizes(tmp_path, monkeypatch):
    pytest.importorskip("rosbags")
    path = small_bag(tmp_path / "bag")
    size = 20 * len(wrench(0))
    monkeypatch.setattr("rftfit.logs.rosbag.MOST_OF_MESSAGES", size - 1)
    refused(dialect("ros-bag"), path, "too_large")
    monkeypatch.setattr("rftfit.logs.rosbag.MOST_OF_MESSAGES", size)
    assert dialect("ros-bag").load(path).rows == 20
