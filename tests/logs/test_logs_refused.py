"""A log that cannot be used is refused with the code of the cause, the file and what was found."""

import os
import sys

import pandas as pd
import pytest
from log_files import refused

import rftfit
from rftfit.logs.registry import dialect


def test_workbooks_and_tables(tmp_path):
    book, table = tmp_path / "log.xlsx", tmp_path / "log.parquet"
    pd.DataFrame([[1.0, 2.0], [3.0, 4.0]]).to_excel(book, index=False, header=False)
    refused(dialect("xlsx"), book, "header")
    pd.DataFrame({"time_s": [0.0], "F1_N": [1.0]}).to_excel(tmp_path / "one.xlsx", index=False)
    assert dialect("xlsx").load(tmp_path / "one.xlsx").rows == 1
    pd.DataFrame(columns=["time_s", "F1_N"]).to_excel(tmp_path / "none.xlsx", index=False)
    refused(dialect("xlsx"), tmp_path / "none.xlsx", "header_only")
    pd.DataFrame({"name": ["a", "b"]}).to_parquet(table)
    refused(dialect("parquet"), table, "header")


@pytest.mark.parametrize("name", ["tdms", "ros-bag", "arrays", "rig"])
def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path, name):
    path = tmp_path / "log.h5"
    path.write_bytes(b"time_s,arm_moving,F1_N,F2_N,F3_N\n")
    # without content, so that it takes no room
    os.truncate(path, 0x11_0000_0000)
    refused(dialect(name), path, "too_large")


@pytest.mark.parametrize(
    ("name", "package", "extra"), [("tdms", "nptdms", "tdms"), ("ros-bag", "rosbags", "ros")]
)
def test_without_the_library(tmp_path, monkeypatch, name, package, extra):
    path = tmp_path / "log"
    path.write_bytes(b"#ROSBAG V2.0\n")
    monkeypatch.setitem(sys.modules, package, None)
    refused(dialect(name), path, "extra", f'pip install "rftfit[{extra}]"')


@pytest.mark.parametrize(
    ("name", "contents"),
    [
        ("ros-bag", [b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n" + bytes(500), b"\x89MCAP0\r\n"]),
        ("tdms", [b"TDSm", b"TDSm" + bytes(200)]),
    ],
)
def test_a_start_alone_is_no_log(tmp_path, name, contents):
    path = tmp_path / "a.log"
    for content in (b"", b"abc" * 40, *contents):
        path.write_bytes(content)
        with pytest.raises(rftfit.RftfitError, match=r"a\.log"):
            rftfit.read_log(path, name)
    refused(dialect(name), tmp_path / "none", "missing")


def test_the_dialect_of_described_text_needs_a_description(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"t,F\n1,2\n")
    refused(dialect("delimited"), path, "header", "`text`")
