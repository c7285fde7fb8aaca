"""A log that cannot be used is refused with the code of the cause, the file and what was found."""

import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from foreign_logs import lvm, netft
from refusals import refused

from rftfit.campaign.config import ForceLog
from rftfit.errors import InputError
from rftfit.logs import base, rosbag, tdms
from rftfit.logs.base import refuse_large_file
from rftfit.logs.registry import dialect, source_reader

LVM = lvm(3).content
"""A LabVIEW log, in bytes."""
NETFT = netft(3).content
"""A log of an ATI Net F/T transducer, in bytes."""


def refused_content(reader, path, content, code, *values):
    path.write_bytes(content)
    refused(reader, path, code, *values)


def test_lvm_segment_without_an_end(tmp_path, monkeypatch):
    end_mark, last_start = b"***End_of_Header***", LVM.rindex(b"***End_of_Header***")
    assert LVM.index(end_mark) != last_start
    monkeypatch.setattr("rftfit.logs.labview.MAX_LINE", 100)
    content = LVM[:last_start] + b"Notes\tx\n" * 50
    refused_content(dialect("lvm"), tmp_path / "log.lvm", content, "header", "***End_of_Header***")


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


def test_the_dialect_of_described_text_needs_a_description(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"t,F\n1,2\n")
    refused(dialect("delimited"), path, "header", "`text`")
