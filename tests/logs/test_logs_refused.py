"""A log that cannot be used is refused with the code of the cause, the file and what was found."""

import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from log_files import refused

from rftfit.logs import base, rosbag, tdms
from rftfit.logs.base import refuse_large_file
from rftfit.logs.registry import dialect


def test_workbooks_and_tables(tmp_path, monkeypatch):

    book, table = tmp_path / "log.xlsx", tmp_path / "log.parquet"
    pd.DataFrame([[1.0, 2.0], [3.0, 4.0]]).to_excel(book, index=False, header=False)
    refused(dialect("xlsx"), book, "header")
    pd.DataFrame({"time_s": [0.0], "F1_N": [1.0]}).to_excel(tmp_path / "one.xlsx", index=False)
    assert dialect("xlsx").load(tmp_path / "one.xlsx").rows == 1
    pd.DataFrame(columns=["time_s", "F1_N"]).to_excel(tmp_path / "none.xlsx", index=False)
    refused(dialect("xlsx"), tmp_path / "none.xlsx", "header_only")
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


def test_a_text_that_is_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.logs.text.MAX_BYTES", 10)
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 50)
    path = tmp_path / "log.csv"
    path.write_text("time_s,arm_moving,F1_N,F2_N,F3_N\n" + "0.01,0,1.5,-2.25,3\n" * 3)
    refused(dialect("rig"), path, "too_large")


def test_the_dialect_of_described_text_needs_a_description(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"t,F\n1,2\n")
    refused(dialect("delimited"), path, "header", "`text`")
