"""Logs that cannot be used: the code of each cause, and in the message the file and what was found."""

import re
from functools import partial

import numpy as np
import pandas as pd
import pytest
from foreign_logs import daq, instron, lvm, netft, rostopic

from rftfit.campaign.config import ForceLog, TextFormat
from rftfit.errors import InputError
from rftfit.logs import base, rosbag, tdms
from rftfit.logs.base import FINITE, LogError, check_size
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.registry import dialect, source_reader
from rftfit.logs.text import CELLS, CUT, GROUPED, NUMBER

LVM = lvm(3).content
NETFT = netft(3).content


def refused(reader, path, content, code, *found):
    path.write_bytes(content)
    with pytest.raises(LogError) as caught:
        reader.load(path)
    assert caught.value.code == code
    assert str(caught.value).startswith(f"{path}: ")
    for text in found:
        assert text in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("ati-daq", b"".join(daq(3).content.splitlines(keepends=True)[:2]),
         "cut short"),
        ("ati-netft", NETFT[: NETFT.index(b"Status")],
         "Status (hex)"),
        ("ati-netft", NETFT.replace(b"Status (hex), RDT Sequence", b"Status (hex), RDT Sequences"),
         "'RDT Sequence', found Status (hex), RDT Sequences"),
        ("instron", re.sub(rb"\([A-Za-z]+\)", b"", instron(3).content),
         "(s);(mm);(kN)"),
        ("lvm", b"Time,Force\n1,2\n", "found 'Time,Force'; allowed: 'LabVIEW Measurement'"),
        ("lvm", LVM[: LVM.index(b"***End_of_Header***")],
         "***End_of_Header***"),
        ("lvm", re.sub(rb"Delta_X[^\r\n]*", b"Delta_X\t0\t0", lvm(3).content),
         "found Delta_X 0"),
        ("lvm", re.sub(rb"Delta_X[^\r\n]*", b"Delta_X\tinf\tinf", lvm(3).content),
         "found Delta_X inf"),
        ("rostopic", rostopic(3).content.replace(b"%time", b"time"),
         "%time"),
    ],
)  # fmt: skip
def test_header_of_a_dialect(tmp_path, name, content, found):
    refused(dialect(name), tmp_path / "log.txt", content, "header", found)


def test_lvm_segment_without_an_end(tmp_path, monkeypatch):
    first, last = b"***End_of_Header***", LVM.rindex(b"***End_of_Header***")
    assert LVM.index(first) != last
    monkeypatch.setattr("rftfit.logs.labview.MAX_LINE", 100)
    content = LVM[:last] + b"Notes\tx\n" * 50
    refused(dialect("lvm"), tmp_path / "log.lvm", content, "header", "***End_of_Header***")


def test_netft_that_never_reached_its_transducer(tmp_path):
    content = re.sub(rb"RDT Sample Rate: *[0-9]+", b"RDT Sample Rate: 0", NETFT)
    found = "found RDT Sample Rate: 0", "options: {rate_Hz: ...}"
    refused(dialect("ati-netft"), tmp_path / "log.csv", content, "rate", *found)


@pytest.mark.parametrize(
    ("text", "content", "found"),
    [
        ({"skip_lines": 5}, b"t,F\n1,2\n", "5 lines (skip_lines)"),
        ({"units": True}, b"t,F\n", "(units: true)"),
    ],
)
def test_described_text(tmp_path, text, content, found):
    reader = DelimitedReader(TextFormat.model_validate({"delimiter": ",", **text}))
    refused(reader, tmp_path / "log.csv", content, "header", found)


def test_delimited_without_a_description(tmp_path):
    refused(dialect("delimited"), tmp_path / "log.csv", b"t,F\n1,2\n", "header", "`text`")


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("rig", {"sheet": 1}, "config, force_log.options: found the option 'sheet'; allowed: none"),
        ("xlsx", {"page": 1}, "config, force_log.options: .*sheet.*page|.*page.*sheet"),
        ("tdms", {"group": 3}, "config, force_log.options: group: found 3; allowed: a text"),
        ("tdms", {"channel": "a"}, "found the option 'channel'; allowed: group"),
        ("ati-daq", {"rate_Hz": -1}, "rate_Hz: found -1; allowed: a number above 0, in Hz"),
    ],
)  # fmt: skip
def test_options(name, options, said):
    with pytest.raises(InputError, match=said):
        source_reader(
            ForceLog.model_validate({"dialect": name, "options": options}), "rig", "force_log"
        )


def test_workbooks_and_tables(tmp_path, monkeypatch):

    book, table = tmp_path / "log.xlsx", tmp_path / "log.parquet"
    pd.DataFrame([[1.0, 2.0], [3.0, 4.0]]).to_excel(book, index=False, header=False)
    refused(dialect("xlsx"), book, book.read_bytes(), "header")
    monkeypatch.setattr(base, "MOST_UNPACKED", 100)
    refused(dialect("xlsx"), book, book.read_bytes(), "too_large", "allowed: 0 MB")
    pd.DataFrame({"name": ["a", "b"]}).to_parquet(table)
    refused(dialect("parquet"), table, table.read_bytes(), "header")


def test_tdms(tmp_path, monkeypatch):
    nptdms = pytest.importorskip("nptdms")

    path = tmp_path / "log.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("Data", "F", np.arange(3.0))])
    content = path.read_bytes()
    refused(
        tdms.TdmsReader().with_options({"group": "Other"}),
        path,
        content,
        "group",
        "'Other'; the file has: Data",
    )
    monkeypatch.setattr(tdms, "check_size", partial(check_size, most=10))
    refused(tdms.TdmsReader(), path, content, "too_large")
    monkeypatch.setitem(__import__("sys").modules, "nptdms", None)
    refused(tdms.TdmsReader(), path, content, "extra", 'pip install "rftfit[tdms]"')


def test_rosbag_that_is_too_large(tmp_path, monkeypatch):
    pytest.importorskip("rosbags")
    monkeypatch.setattr(rosbag, "check_size", partial(check_size, most=10))
    refused(rosbag.RosBagReader(), tmp_path / "log.bag", bytes(11), "too_large")


def test_lines_that_are_left_out(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,x_mm,z_mm,angle_deg\n0,0,0,0\n1,0,0\n2,a,0,0\n3,nan,0,0\n4,0,0,0\n5,0")
    log = dialect("rig").load(path)
    assert log.dropped == {
        "wrong number of cells": 1, "not a number": 1, "NaN or infinite": 1, "cut in mid-row": 1,
    }  # fmt: skip
    assert set(log.dropped) == {CELLS, NUMBER, FINITE, CUT}
    assert log.size + sum(log.dropped.values()) == log.rows == 6


def test_samples_that_were_lost(tmp_path):
    path = tmp_path / "log.txt"
    path.write_bytes(netft(20, lost=7).content)
    assert dialect("ati-netft").load(path).missing == {"lost packets (gap in the RDT sequence)": 7}


def test_messages_that_were_lost(tmp_path):
    path = tmp_path / "log.txt"
    lines = rostopic(20).content.splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:5], *lines[8:]]))
    assert dialect("rostopic").load(path).missing == {"lost messages (gap in header.seq)": 3}


def test_numbers_with_two_decimal_commas(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{row},5;1,5\n" for row in range(30)]
    path.write_text("time;force\n" + "".join([*rows, "30,5;1,114,200\n"]))
    text = TextFormat.model_validate({"delimiter": ";", "decimal": ","})
    log = DelimitedReader(text).load(path)
    assert log.notes[0].startswith("force: ")
    assert log.dropped == {GROUPED: 1}
