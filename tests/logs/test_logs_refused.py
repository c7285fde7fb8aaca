"""A log that cannot be used is refused with the code of the cause, the file and what was found."""

import re
import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from foreign_logs import daq, instron, lvm, netft, rostopic
from refusals import refused

from rftfit.campaign.config import ForceLog, TextFormat
from rftfit.errors import InputError
from rftfit.logs import base, rosbag, tdms
from rftfit.logs.base import refuse_large_file
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.registry import dialect, source_reader
from rftfit.logs.text import GROUPED

LVM = lvm(3).content
"""A LabVIEW log, in bytes."""
NETFT = netft(3).content
"""A log of an ATI Net F/T transducer, in bytes."""


def refused_content(reader, path, content, code, *values):
    path.write_bytes(content)
    refused(reader, path, code, *values)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("ati-daq", b"".join(daq(3).content.splitlines(keepends=True)[:2]), "cut short"),
        ("ati-netft", NETFT[: NETFT.index(b"Status")], "Status (hex)"),
        (
            "ati-netft",
            NETFT.replace(b"Status (hex), RDT Sequence", b"Status (hex), RDT Sequences"),
            "'RDT Sequence', found Status (hex), RDT Sequences",
        ),
        ("instron", re.sub(rb"\([A-Za-z]+\)", b"", instron(3).content), "(s);(mm);(kN)"),
        ("lvm", b"Time,Force\n1,2\n", "found 'Time,Force'; allowed: 'LabVIEW Measurement'"),
        ("lvm", LVM[: LVM.index(b"***End_of_Header***")], "***End_of_Header***"),
        ("lvm", re.sub(rb"Delta_X[^\r\n]*", b"Delta_X\t0\t0", lvm(3).content), "found Delta_X 0"),
        (
            "lvm",
            re.sub(rb"Delta_X[^\r\n]*", b"Delta_X\tinf\tinf", lvm(3).content),
            "found Delta_X inf",
        ),
        ("rostopic", rostopic(3).content.replace(b"%time", b"time"), "%time"),
    ],
)
def test_header_of_a_dialect(tmp_path, name, content, message):
    refused_content(dialect(name), tmp_path / "log.txt", content, "header", message)


def test_lvm_segment_without_an_end(tmp_path, monkeypatch):
    end_mark, last_start = b"***End_of_Header***", LVM.rindex(b"***End_of_Header***")
    assert LVM.index(end_mark) != last_start
    monkeypatch.setattr("rftfit.logs.labview.MAX_LINE", 100)
    content = LVM[:last_start] + b"Notes\tx\n" * 50
    refused_content(dialect("lvm"), tmp_path / "log.lvm", content, "header", "***End_of_Header***")


def test_netft_that_never_reached_its_transducer(tmp_path):
    content = re.sub(rb"RDT Sample Rate: *[0-9]+", b"RDT Sample Rate: 0", NETFT)
    words = "found RDT Sample Rate: 0", "options: {rate_Hz: ...}"
    refused_content(dialect("ati-netft"), tmp_path / "log.csv", content, "rate", *words)


@pytest.mark.parametrize(
    ("text", "content", "message"),
    [
        ({"skip_lines": 5}, b"t,F\n1,2\n", "5 lines (skip_lines)"),
        ({"units": True}, b"t,F\n", "(units: true)"),
        (None, b"t,F\n1,2\n", "`text`"),
    ],
)
def test_described_text(tmp_path, text, content, message):
    reader = dialect("delimited")
    if text:
        reader = DelimitedReader(TextFormat.model_validate({"delimiter": ",", **text}))
    refused_content(reader, tmp_path / "log.csv", content, "header", message)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("rig", {"sheet": 1}, "config, force_log.options: found the option 'sheet'; allowed: none"),
        ("xlsx", {"page": 1}, "config, force_log.options: .*sheet.*page|.*page.*sheet"),
        ("tdms", {"group": 3}, "config, force_log.options: group: found 3; allowed: a text"),
        ("tdms", {"channel": "a"}, "found the option 'channel'; allowed: group"),
        ("ati-daq", {"rate_Hz": -1}, "rate_Hz: found -1; allowed: a number above 0, in Hz"),
    ],
)
def test_options(name, options, message):
    with pytest.raises(InputError, match=message):
        source_reader(
            ForceLog.model_validate({"dialect": name, "options": options}), "rig", "force_log"
        )


def test_workbooks_and_tables(tmp_path, monkeypatch):

    book, table = tmp_path / "log.xlsx", tmp_path / "log.parquet"
    pd.DataFrame([[1.0, 2.0], [3.0, 4.0]]).to_excel(book, index=False, header=False)
    refused(dialect("xlsx"), book, "header")
    monkeypatch.setattr(base, "MOST_UNPACKED", 100)
    refused(dialect("xlsx"), book, "too_large", "allowed: 0 MB")
    pd.DataFrame({"name": ["a", "b"]}).to_parquet(table)
    refused(dialect("parquet"), table, "header")


def test_tdms_and_rosbag(tmp_path, monkeypatch):
    nptdms, _ = pytest.importorskip("nptdms"), pytest.importorskip("rosbags")
    path = tmp_path / "log.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("Data", "F", np.arange(3.0))])
    reader = tdms.TdmsReader()
    other_group = reader.with_options({"group": "Other"})
    refused(other_group, path, "group", "'Other'", ": Data")
    for module, module_reader in ((base, reader), (rosbag, rosbag.RosBagReader())):
        monkeypatch.setattr(module, "refuse_large_file", partial(refuse_large_file, most=10))
        refused(module_reader, path, "too_large")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    refused(reader, path, "extra", 'pip install "rftfit[tdms]"')


def test_samples_and_messages_that_were_lost(tmp_path):
    path, lines = tmp_path / "log.txt", rostopic(20).content.splitlines(keepends=True)
    for name, content, missing in (
        ("ati-netft", netft(20, lost=7).content, {"lost packets (gap in the RDT sequence)": 7}),
        ("rostopic", b"".join([*lines[:5], *lines[8:]]), {"lost messages (gap in header.seq)": 3}),
    ):
        path.write_bytes(content)
        assert dialect(name).load(path).missing == missing


def test_a_message_without_a_number_is_none_that_was_lost(tmp_path):
    path, lines = tmp_path / "log.txt", rostopic(60).content.splitlines(keepends=True)
    for row in (1, 6, 50):
        stamp, number, other_cells = lines[row].split(b",", 2)
        assert number.isdigit()
        lines[row] = b",".join([stamp, b"", other_cells])
    path.write_bytes(b"".join(lines))
    log = dialect("rostopic").load(path)
    assert (log.size, log.missing) == (60, {})


def test_numbers_with_two_decimal_commas(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{row},5;1,5\n" for row in range(30)]
    path.write_text("time;force\n" + "".join([*rows, "30,5;1,114,200\n"]))
    text = TextFormat.model_validate({"delimiter": ";", "decimal": ","})
    log = DelimitedReader(text).load(path)
    assert log.notes[0].startswith("force: ")
    assert log.dropped == {GROUPED: 1}
