"""What is said of a log that cannot be used: each message once, with the file's name in it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest
from foreign_logs import daq, instron, lvm, netft, rostopic

from rftfit.campaign.config import ForceLog, TextFormat
from rftfit.errors import InputError
from rftfit.logs import rosbag, tabular, tdms
from rftfit.logs.base import LogError
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.registry import dialect, source_reader
from rftfit.logs.text import CELLS, CUT, FINITE, NUMBER

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.logs.base import Reader

LVM = lvm(3).content
NETFT = netft(3).content


def refused(reader: Reader, path: Path, content: bytes) -> str:
    path.write_bytes(content)
    with pytest.raises(LogError) as caught:
        reader.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("ati-daq", b"".join(daq(3).content.splitlines(keepends=True)[:2]),
         "the file ends within its three lines of header: cut short?"),
        ("ati-netft", NETFT[: NETFT.index(b"Status")],
         "no row of names that begins with 'Status (hex)"),
        ("ati-netft", NETFT.replace(b"Status (hex), RDT Sequence", b"Status (hex), RDT Sequences"),
         "no column 'RDT Sequence', found "),
        ("instron", re.sub(rb"\([A-Za-z]+\)", b"", instron(3).content),
         "no row of units in brackets, like (s);(mm);(kN), below one of names"),
        ("lvm", b"Time,Force\n1,2\n", "found 'Time,Force'; allowed: 'LabVIEW Measurement' first"),
        ("lvm", LVM[: LVM.index(b"***End_of_Header***")],
         "the file header has no end (***End_of_Header***): cut short?"),
        ("lvm", re.sub(rb"Delta_X[^\r\n]*", b"Delta_X\t0\t0", lvm(3).content),
         "found Delta_X 0; allowed: a step above 0 for each channel"),
        ("rostopic", rostopic(3).content.replace(b"%time", b"time"),
         "no row of names that begins with %time and has an end: cut short?"),
    ],
)  # fmt: skip
def test_header_of_a_dialect(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    assert said in refused(dialect(name), tmp_path / "log.txt", content)


def test_lvm_segment_without_an_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = b"***End_of_Header***", LVM.rindex(b"***End_of_Header***")
    assert LVM.index(first) != last
    monkeypatch.setattr("rftfit.logs.labview.MAX_LINE", 100)
    said = refused(dialect("lvm"), tmp_path / "log.lvm", LVM[:last] + b"Notes\tx\n" * 50)
    assert "a segment's header has no end (***End_of_Header***)" in said


def test_netft_that_never_reached_its_transducer(tmp_path: Path) -> None:
    content = re.sub(rb"RDT Sample Rate: *[0-9]+", b"RDT Sample Rate: 0", NETFT)
    said = refused(dialect("ati-netft"), tmp_path / "log.csv", content)
    assert "found RDT Sample Rate: 0 and Force Units: " in said
    assert "set options: {rate_Hz: ...}" in said


@pytest.mark.parametrize(
    ("text", "content", "said"),
    [
        ({"skip_lines": 5}, b"t,F\n1,2\n",
         "no row of names below the first 5 lines (skip_lines)"),
        ({"units": True}, b"t,F\n", "no row of units below the row of names (units: true)"),
    ],
)  # fmt: skip
def test_described_text(tmp_path: Path, text: dict[str, Any], content: bytes, said: str) -> None:
    reader = DelimitedReader(TextFormat.model_validate({"delimiter": ",", **text}))
    assert said in refused(reader, tmp_path / "log.csv", content)


def test_delimited_without_a_description(tmp_path: Path) -> None:
    said = refused(dialect("delimited"), tmp_path / "log.csv", b"t,F\n1,2\n")
    assert "the dialect delimited needs `text` in the config: the format" in said


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("rig", {"sheet": 1}, "config, force_log.options: the dialect rig has no options, found sheet"),
        ("xlsx", {"page": 1}, "config, force_log.options: .*sheet.*page|.*page.*sheet"),
        ("tdms", {"group": 3}, "config, force_log.options: group: found 3; allowed: a text"),
        ("tdms", {"channel": "a"}, "found the option 'channel'; allowed: group"),
        ("ati-daq", {"rate_Hz": -1}, "rate_Hz: found -1; allowed: a number above 0, in Hz"),
    ],
)  # fmt: skip
def test_options(name: str, options: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        source_reader(
            ForceLog.model_validate({"dialect": name, "options": options}), "rig", "force_log"
        )


def test_workbooks_and_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pandas as pd

    book, table = tmp_path / "log.xlsx", tmp_path / "log.parquet"
    pd.DataFrame([[1.0, 2.0], [3.0, 4.0]]).to_excel(book, index=False, header=False)
    said = refused(dialect("xlsx"), book, book.read_bytes())
    assert "no row of names above the numbers of the sheet" in said
    monkeypatch.setattr(tabular, "MAX_UNPACKED", 100)
    said = refused(dialect("xlsx"), book, book.read_bytes())
    assert "MB when unpacked; at most 0.0001 MB are read: export it as .csv" in said
    pd.DataFrame({"name": ["a", "b"]}).to_parquet(table)
    said = refused(dialect("parquet"), table, table.read_bytes())
    assert "no column of this table holds numbers" in said


def test_tdms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nptdms = pytest.importorskip("nptdms")
    import numpy as np

    path = tmp_path / "log.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("Data", "F", np.arange(3.0))])
    content = path.read_bytes()
    said = refused(tdms.TdmsReader("Other"), path, content)
    assert "no group 'Other'; the file has: Data" in said
    monkeypatch.setattr(tdms, "_MAX_BYTES", 10)
    assert "larger than 0 MB; split it" in refused(tdms.TdmsReader(), path, content)
    monkeypatch.setitem(__import__("sys").modules, "nptdms", None)
    said = refused(tdms.TdmsReader(), path, content)
    assert "TDMS files are read with the package npTDMS; install it: pip install" in said


def test_rosbag_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rosbags")
    monkeypatch.setattr(rosbag, "_MAX_BYTES", 10)
    said = refused(rosbag.RosBagReader(), tmp_path / "log.bag", bytes(11))
    assert "larger than 0 MB; split it" in said


def test_lines_that_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s,x_mm,z_mm,angle_deg\n0,0,0,0\n1,0,0\n2,a,0,0\n3,nan,0,0\n4,0,0,0\n5,0")
    log = dialect("rig").load(path)
    assert log.dropped == {
        "wrong number of cells": 1, "not a number": 1, "NaN or infinite": 1, "cut in mid-row": 1,
    }  # fmt: skip
    assert set(log.dropped) == {CELLS, NUMBER, FINITE, CUT}
    assert log.size + sum(log.dropped.values()) == log.rows == 6


def test_samples_that_were_lost(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_bytes(netft(20, lost=7).content)
    assert dialect("ati-netft").load(path).missing == {"lost packets (gap in the RDT sequence)": 7}


def test_messages_that_were_lost(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    lines = rostopic(20).content.splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:5], *lines[8:]]))
    assert dialect("rostopic").load(path).missing == {"lost messages (gap in header.seq)": 3}


def test_numbers_with_two_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{row},5;1,5\n" for row in range(30)]
    path.write_text("time;force\n" + "".join([*rows, "30,5;1,114,200\n"]))
    text = TextFormat.model_validate({"delimiter": ";", "decimal": ","})
    log = DelimitedReader(text).load(path)
    assert "force: numbers with two decimal commas: a spreadsheet has regrouped" in log.notes[0]
