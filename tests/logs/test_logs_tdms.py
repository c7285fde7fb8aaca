"""A TDMS file gives each channel with its own time, and a cut file gives its complete rows.

TDMS: the binary log format of LabVIEW.
"""

from typing import Any

import numpy as np
import pytest
from log_files import refused
from numpy.testing import assert_allclose, assert_array_equal
from third_party import LOGS, needs

import rftfit
from rftfit.logs.registry import dialect

nptdms: Any = pytest.importorskip("nptdms")

TDMS = dialect("tdms")
REAL = LOGS / "tdms" / "raw1.tdms"
needs_real = needs(REAL)
STAMP = np.datetime64("2026-01-02T03:04:05.250000")
WAVE = {"wf_start_time": STAMP, "wf_increment": 0.01, "wf_start_offset": 0.0}
"""Properties of a channel that state its clock."""


def write(path, **groups):
    with nptdms.TdmsWriter(path) as writer:
        for group, channels in groups.items():
            parts = [
                nptdms.ChannelObject(group, name, *channel) for name, channel in channels.items()
            ]
            writer.write_segment(parts)
    return path


@needs_real
def test_the_real_one():
    log = TDMS.load(REAL)
    assert (log.rows, log.size, len(log.columns)) == (2000, 2000, 8)
    assert np.all(np.diff(log.columns["time"]) > 0)
    expected = nptdms.TdmsFile.read(REAL)["Layer Data"]["Fifth Chan"][:]
    assert_array_equal(log.columns["Fifth Chan"], expected)


@needs_real
def test_cut_at_many_places(tmp_path, capfd):
    content, whole_log = REAL.read_bytes(), TDMS.load(REAL)
    path = tmp_path / "cut.tdms"
    counted = 0
    for length in range(0, len(content), 997):
        path.write_bytes(content[:length])
        try:
            log = TDMS.load(path)
        except rftfit.RftfitError as error:
            message = str(error)
            assert "cut.tdms" in message
            continue
        assert log.rows == log.size + sum(log.dropped.values())
        counted += len(log.dropped)
        for name, values in log.columns.items():
            assert_array_equal(values, whole_log.columns[name][: log.size])
    assert counted > 10

    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("channels", "options", "time"),
    [
        ({"Fz": {"wf_increment": 0.01, "wf_start_offset": 2.0}}, {}, 2 + 0.01 * np.arange(5)),
        ({"Time": {}, "Fz": {}}, {}, np.arange(5.0)),
        ({"Fz": {}}, {"rate_Hz": 100, "group": "rig"}, 0.01 * np.arange(5)),
        ({"Fz": {}}, {}, None),
        ({"Fz": WAVE, "z": {}}, {}, None),  # nobody knows when z was
    ],
)
def test_where_the_time_comes_from(tmp_path, channels, options, time):
    channels_of_file = {name: (np.arange(5.0), words) for name, words in channels.items()}
    channels_of_file["Fz"][1]["unit_string"] = "N"
    log = TDMS.with_options(options).load(write(tmp_path / "a.tdms", rig=channels_of_file))
    assert log.units["Fz"] == "N"
    if time is None:
        assert "time" not in log.columns
        assert "no time" in log.notes[0]
    else:
        assert_allclose(log.columns["time"], time)
        assert log.units["time"] == "s"


def two_clocks(path, **second_clock):
    """Fx and Fz on one clock, z on another."""
    values = np.arange(5.0)
    channels = {
        "Fx": (values, WAVE),
        "Fz": (values, WAVE),
        "z": (-values, {**WAVE, **second_clock}),
    }
    return write(path, rig=channels)


def test_clocks_are_the_same_to_the_microsecond(tmp_path):
    assert TDMS.load(two_clocks(tmp_path / "a.tdms", wf_start_offset=2e-7)).size == 5
    late, values = {**WAVE, "wf_start_offset": 0.5}, np.arange(5.0)
    # a channel of time does not hide clocks that differ
    channels: dict[str, Any] = {"Time": (values, {}), "Fz": (values, WAVE), "z": (values, late)}
    timed = write(tmp_path / "b.tdms", rig=channels)
    for path in (two_clocks(tmp_path / "c.tdms", wf_start_offset=2e-6), timed):
        refused(TDMS, path, "clocks")
    assert list(TDMS.only({"z"}).load(timed).columns) == ["time", "Time", "z"]


def test_groups_and_lengths(tmp_path):
    path = write(tmp_path / "a.tdms", one={"F": (np.arange(3.0), {})}, two={"F": (np.zeros(4), {})})
    refused(TDMS, path, "group", "{group: ...}", "one, two")
    refused(TDMS.with_options({"group": "Other"}), path, "group", "'Other'", ": one, two")
    assert TDMS.with_options({"group": "two"}).load(path).size == 4
    for words in ({"topic": "x"}, {"rate_Hz": -1}):
        with pytest.raises(ValueError, match=r"allowed: group|rate_Hz: found -1"):
            TDMS.with_options(words)
    # only the channels asked for must be of one length
    channels = {"F": (np.arange(3.0), WAVE), "G": (np.zeros(9), WAVE)}
    uneven = write(tmp_path / "b.tdms", one=channels)
    assert TDMS.only({"F", "time"}).load(uneven).size == 3
    assert TDMS.only({"G", "time"}).load(uneven).size == 9
    for reader in (TDMS, TDMS.only({"F", "H"})):  # no H: all are looked at
        assert refused(reader, uneven, "lengths", " 3 to 9 ").rows == 9
