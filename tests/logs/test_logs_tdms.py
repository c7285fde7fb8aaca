"""TDMS files: the real one, written ones, and cut ones."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rftfit.logs.base import LogError
from rftfit.logs.tdms import CUT, TdmsReader

nptdms: Any = pytest.importorskip("nptdms")

REAL = Path(__file__).parents[3] / "shared" / "data" / "logs" / "tdms" / "raw1.tdms"
needs_real = pytest.mark.skipif(not REAL.is_file(), reason="tdms of ../shared/data is absent")


def write(path, **groups):
    with nptdms.TdmsWriter(path) as writer:
        for group, channels in groups.items():
            writer.write_segment(
                [
                    nptdms.ChannelObject(group, name, values, properties)
                    for name, (values, properties) in channels.items()
                ]
            )
    return path


@needs_real
def test_the_real_one():
    log = TdmsReader().load(REAL)
    assert log.rows == log.size == 2000
    assert len(log.columns) == 8
    assert np.all(np.diff(log.columns["time"]) > 0)
    expected = nptdms.TdmsFile.read(REAL)["Layer Data"]["Fifth Chan"][:]
    np.testing.assert_array_equal(log.columns["Fifth Chan"], expected)


@needs_real
def test_cut_at_many_places(tmp_path, capfd):
    content, whole = REAL.read_bytes(), TdmsReader().load(REAL)
    path = tmp_path / "cut.tdms"
    counted = 0
    for length in range(0, len(content), 997):
        path.write_bytes(content[:length])
        try:
            log = TdmsReader().load(path)
        except LogError as error:
            told = str(error)
            assert "cut.tdms" in told
            continue
        assert log.rows == log.size + log.dropped.get(CUT, 0)
        counted += CUT in log.dropped
        for name, values in log.columns.items():
            np.testing.assert_array_equal(values, whole.columns[name][: log.size])
    assert counted > 10
    assert CUT == "cut in mid-segment"
    assert capfd.readouterr().err == ""


def test_time_of_the_waveform_and_units(tmp_path):
    wave = {"wf_increment": 0.01, "wf_start_offset": 2.0, "unit_string": "N"}
    path = write(tmp_path / "a.tdms", rig={"Fz": (np.arange(5.0), wave)})
    log = TdmsReader().load(path)
    np.testing.assert_allclose(log.columns["time"], 2 + 0.01 * np.arange(5))
    assert log.units["Fz"] == "N"


def test_a_channel_of_time(tmp_path):
    channels: dict[str, Any] = {
        "Time": (np.array([0.0, 0.5, 1.5]), {}),
        "Fz": (np.array([1, 2, 3]), {}),
    }
    log = TdmsReader().load(write(tmp_path / "a.tdms", rig=channels))
    assert log.columns["time"].tolist() == [0, 0.5, 1.5]
    none = TdmsReader().load(write(tmp_path / "b.tdms", rig={"Fz": (np.arange(3.0), {})}))
    assert "time" not in none.columns
    assert "no time" in none.notes[0]


STAMP = np.datetime64("2026-01-02T03:04:05.250000")
WAVE = {"wf_start_time": STAMP, "wf_increment": 0.01, "wf_start_offset": 0.0}


def two_clocks(path, **other):
    """Fx and Fz on one clock, z on another."""
    values = np.arange(5.0)
    channels = {"Fx": (values, WAVE), "Fz": (values, WAVE), "z": (-values, {**WAVE, **other})}
    return write(path, rig=channels)


@pytest.mark.parametrize(
    ("other", "told"),
    [
        ({"wf_start_time": STAMP + np.timedelta64(500, "ms")}, "'z' from 0.5 s, every 0.01 s"),
        ({"wf_start_offset": 0.5}, "'z' from 0.5 s, every 0.01 s"),
        ({"wf_start_offset": -0.01}, "'Fz' from 0.01 s, every 0.01 s"),
        ({"wf_increment": 0.02}, "'z' from 0 s, every 0.02 s"),
    ],
)
def test_channels_on_clocks_of_their_own(tmp_path, other, told):
    path = two_clocks(tmp_path / "a.tdms", **other)
    with pytest.raises(LogError) as caught:
        TdmsReader().load(path)
    assert (caught.value.code, caught.value.rows) == ("clocks", 5)
    assert told in str(caught.value)
    assert "channels were not sampled at the same times" in str(caught.value)
    # each half gets its own time
    start, step = (other.get(key, WAVE[key]) for key in ("wf_start_time", "wf_increment"))
    own = (start - STAMP) / np.timedelta64(1, "s") + other.get("wf_start_offset", 0.0)
    force, motion = (TdmsReader().only(names).load(path) for names in ({"Fx", "Fz"}, {"z"}))
    assert (list(force.columns), list(motion.columns)) == (["time", "Fx", "Fz"], ["time", "z"])
    began = force.columns["time"][0]
    np.testing.assert_allclose(force.columns["time"] - began, 0.01 * np.arange(5), atol=1e-6)
    np.testing.assert_allclose(motion.columns["time"] - began, own + step * np.arange(5), atol=1e-6)


def test_clocks_are_the_same_to_the_microsecond(tmp_path):
    log = TdmsReader().load(two_clocks(tmp_path / "a.tdms", wf_start_offset=2e-7))
    assert log.size == 5
    with pytest.raises(LogError, match="not sampled at the same times"):
        TdmsReader().load(two_clocks(tmp_path / "b.tdms", wf_start_offset=2e-6))
    channels: dict[str, Any] = {"Fz": (np.arange(5.0), WAVE), "z": (np.arange(5.0), {})}
    log = TdmsReader().load(write(tmp_path / "c.tdms", rig=channels))
    assert "time" not in log.columns  # nobody knows when z was


def test_a_channel_of_time_does_not_hide_clocks_that_differ(tmp_path):
    late = {**WAVE, "wf_start_offset": 0.5}
    values = np.arange(5.0)
    channels: dict[str, Any] = {"Time": (values, {}), "Fz": (values, WAVE), "z": (values, late)}
    path = write(tmp_path / "a.tdms", rig=channels)
    with pytest.raises(LogError, match="not sampled at the same times"):
        TdmsReader().load(path)
    assert list(TdmsReader().only({"z"}).load(path).columns) == ["time", "Time", "z"]


def test_only_the_channels_asked_for_must_be_of_one_length(tmp_path):
    channels = {"F": (np.arange(3.0), WAVE), "G": (np.zeros(9), WAVE)}
    path = write(tmp_path / "a.tdms", one=channels)
    assert TdmsReader().only({"F", "time"}).load(path).size == 3
    assert TdmsReader().only({"G", "time"}).load(path).size == 9
    with pytest.raises(LogError, match="3 to 9 values"):
        TdmsReader().only({"F", "H"}).load(path)  # H is not there: all are looked at


def test_groups_and_lengths(tmp_path):
    path = write(tmp_path / "a.tdms", one={"F": (np.arange(3.0), {})}, two={"F": (np.zeros(4), {})})
    with pytest.raises(LogError, match=r"several groups.*one, two"):
        TdmsReader().load(path)
    assert TdmsReader().with_options({"group": "two"}).load(path).size == 4
    uneven = write(tmp_path / "b.tdms", one={"F": (np.arange(3.0), {}), "G": (np.zeros(9), {})})
    with pytest.raises(LogError, match="3 to 9 values"):
        TdmsReader().load(uneven)
    with pytest.raises(ValueError, match="allowed: group"):
        TdmsReader().with_options({"topic": "x"})


@pytest.mark.parametrize("content", [b"", b"TDSm", b"TDSm" + bytes(200), b"abc" * 40])
def test_no_tdms(tmp_path, content):
    path = tmp_path / "a.tdms"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"a\.tdms"):
        TdmsReader().load(path)


def test_a_rate_for_channels_that_state_no_step(tmp_path):
    path = write(tmp_path / "a.tdms", rig={"Fz": (np.arange(5.0), {})})
    assert "time" not in TdmsReader().load(path).columns
    log = TdmsReader().with_options({"rate_Hz": 100, "group": "rig"}).load(path)
    np.testing.assert_allclose(log.columns["time"], 0.01 * np.arange(5))
    assert log.units["time"] == "s"
    with pytest.raises(ValueError, match="rate_Hz: found -1"):
        TdmsReader().with_options({"rate_Hz": -1})
