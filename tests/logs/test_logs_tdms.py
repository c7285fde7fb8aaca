"""TDMS files: the real one, written ones, and cut ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rftfit.logs.base import LogError
from rftfit.logs.tdms import CUT, TdmsReader

nptdms: Any = pytest.importorskip("nptdms")

REAL = Path(__file__).parents[3] / "shared" / "data" / "logs" / "tdms" / "raw1.tdms"
needs_real = pytest.mark.skipif(not REAL.is_file(), reason="tdms of ../shared/data is absent")


def write(path: Path, **groups: dict[str, Any]) -> Path:
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
def test_the_real_one() -> None:
    log = TdmsReader().load(REAL)
    assert log.rows == log.size == 2000
    assert len(log.columns) == 8
    assert np.all(np.diff(log.columns["time"]) > 0)
    expected = nptdms.TdmsFile.read(REAL)["Layer Data"]["Fifth Chan"][:]
    np.testing.assert_array_equal(log.columns["Fifth Chan"], expected)


@needs_real
def test_cut_at_many_places(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
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


def test_time_of_the_waveform_and_units(tmp_path: Path) -> None:
    wave = {"wf_increment": 0.01, "wf_start_offset": 2.0, "unit_string": "N"}
    path = write(tmp_path / "a.tdms", rig={"Fz": (np.arange(5.0), wave)})
    log = TdmsReader().load(path)
    np.testing.assert_allclose(log.columns["time"], 2 + 0.01 * np.arange(5))
    assert log.units["Fz"] == "N"


def test_a_channel_of_time(tmp_path: Path) -> None:
    channels: dict[str, Any] = {
        "Time": (np.array([0.0, 0.5, 1.5]), {}),
        "Fz": (np.array([1, 2, 3]), {}),
    }
    log = TdmsReader().load(write(tmp_path / "a.tdms", rig=channels))
    assert log.columns["time"].tolist() == [0, 0.5, 1.5]
    none = TdmsReader().load(write(tmp_path / "b.tdms", rig={"Fz": (np.arange(3.0), {})}))
    assert "time" not in none.columns
    assert "no time" in none.notes[0]


def test_groups_and_lengths(tmp_path: Path) -> None:
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
def test_no_tdms(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"a\.tdms"):
        TdmsReader().load(path)
