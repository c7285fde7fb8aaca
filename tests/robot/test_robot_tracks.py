"""A marker track gives the robot's speed or a reason, and each row of it is accounted for."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rftfit import RftfitError
from rftfit.measure.flags import codes_of, remark
from rftfit.robot.speeds import trial_row
from rftfit.robot.tracks import Track, TrackError, mean_stride_speed, read_track, stride_frequency

GOOD_HEAD = "time_s,x_cm,z_cm"


def running(frequency=2.0, speed=25.0, strides=6.4, uneven=0.03, noise=0.02, rate=100.0):
    """A robot whose body bobs twice a stride and surges."""
    rng = np.random.default_rng(5)
    time = np.arange(int(strides / frequency * rate)) / rate
    turn = 2 * np.pi * frequency * time + 0.7
    x = speed * time + 1.1 * np.sin(2 * turn) + rng.normal(0, noise, time.size)
    z = 2 + 0.3 * np.cos(2 * turn) + uneven * np.cos(turn) + rng.normal(0, noise, time.size)
    return Track(time, x, z, time.size)


def written(folder, rows, header=GOOD_HEAD):
    path = folder / "track.csv"
    path.write_text("# a comment\n" + "\n".join([header, *rows]) + "\n", "utf-8")
    return path


@pytest.mark.parametrize("frequency", [0.343, 1.2, 2.0, 4.9])
@pytest.mark.parametrize("strides", [3.2, 3.35, 3.6, 3.85, 5.3, 11.7])
def test_frequency_and_speed_come_back(frequency, strides):
    stride_speed = mean_stride_speed(running(frequency, strides=strides))
    assert (stride_speed.frequency_from, stride_speed.flags) == ("track", ())
    assert stride_speed.frequency_Hz == pytest.approx(frequency, rel=0.01)
    # a plain end-to-end slope would be off by up to 10 %: the surge is 1.1 cm
    assert stride_speed.speed_cm_per_s == pytest.approx(25.0, rel=0.01)


def test_a_given_frequency_is_taken():
    stride_speed = mean_stride_speed(running(2.0), frequency_Hz=1.9)
    assert (stride_speed.frequency_Hz, stride_speed.frequency_from) == (1.9, "sheet")


@pytest.mark.parametrize(
    "change", [lambda z: z + 30.0 * (np.arange(z.size) % 37 == 0), lambda z: 0 * z + 2]
)
def test_outliers_do_not_change_the_frequency_and_x_serves_where_z_is_still(change):
    track = running(2.0)
    track.z_cm[:] = change(track.z_cm)
    assert stride_frequency(track)[0] == pytest.approx(2.0, rel=0.01)


def test_height_alone_tells_the_frequency_though_markers_are_lost():
    """One row in 25, at random, is 30 cm off; the body does not surge, so that x tells nothing."""
    track = running(2.0)
    lost = np.random.default_rng(3).random(track.rows) < 0.04
    track.z_cm[lost] += 30.0
    track.x_cm[:] = 25.0 * track.time_s
    assert stride_frequency(track)[0] == pytest.approx(2.0, rel=0.01)


def test_an_uneven_gait_is_doubted():
    frequency, doubt = stride_frequency(running(2.0, uneven=0.5))
    assert frequency == pytest.approx(1.0, rel=0.02)
    assert doubt is not None
    assert doubt.code == "stride-doubled"
    assert (doubt.values["bob"], doubt.values["stride"]) == pytest.approx((2.0, 1.0), rel=0.02)


def test_a_robot_that_speeds_up_is_flagged():
    track = running(2.0)
    track.x_cm[:] += 6.0 * track.time_s**2
    assert codes_of(mean_stride_speed(track).flags) == "speed-changes"


NOISE = np.random.default_rng(1).normal(0, 1, (2, 400))


@pytest.mark.parametrize(
    ("track", "frequency", "code", "values"),
    [
        (running(1.0, strides=2.5), 1.0, "few-strides", "2.49 .* 1 Hz .* 3 "),
        (running(2.0, strides=0.7), 2.0, "few-strides", "0.68 .* 2 Hz .* 3 "),
        (running(2.0, strides=0.1), 2.0, "few-rows", "5 .* 30"),
        (Track(np.arange(400) / 100, *NOISE, 400), math.nan, "no-stride", "frequency_Hz"),
    ],
)
def test_no_mean_speed(track, frequency, code, values):
    with pytest.raises(TrackError, match=values) as error:
        mean_stride_speed(track, frequency)
    assert error.value.reason.code == code


def cut(track, start_s, length_s):
    keep = (track.time_s < start_s) | (track.time_s >= start_s + length_s)
    return Track(track.time_s[keep], track.x_cm[keep], track.z_cm[keep], track.rows)


def test_gaps():
    small = mean_stride_speed(cut(running(2.0), 1.0, 0.1))
    assert small.speed_cm_per_s == pytest.approx(25.0, rel=0.01)
    assert small.flags == (remark("track-gaps", gaps="1 gap", seconds=0.11),)
    with pytest.raises(TrackError, match=r"0\.62 .* 0\.25 ") as error:
        mean_stride_speed(cut(running(2.0), 1.0, 0.3))
    assert error.value.reason.code == "track-gaps"


def test_units_of_the_header(tmp_path):
    rows = [f"{10 * i};{i};{2 * i}" for i in range(3)]
    track = read_track(written(tmp_path, rows, "Time [ms];X (mm);z_in"))
    columns = [track.time_s, track.x_cm, track.z_cm]
    np.testing.assert_allclose(columns, np.outer([0.01, 0.1, 5.08], range(3)))


def test_every_row_is_accounted_for(tmp_path):
    rows = ["0,0,1", "0.1,nan,1", "0.2,,1", "0.3,1,x", "0.4,2,1", "0.5,3", ",3,1", "0.7,4,1"]
    track = read_track(written(tmp_path, rows))
    assert track.rows == 8
    lost = {why.values["column"]: count for why, count in track.dropped.items()}
    assert lost == {"x_cm": 2, "z_cm": 2, "time_s": 1}
    assert track.time_s.size + sum(track.dropped.values()) == track.rows


ROW = ["0,0,0,0"]
UNREADABLE = "track-unreadable"


@pytest.mark.parametrize(
    ("header", "rows", "code", "values"),
    [
        (GOOD_HEAD, ["0,0,0", "0.2,1,1", "0.1,2,1"], "time-backwards", "row 5: 0.1 after 0.2"),
        (GOOD_HEAD, ["0,0,0", "0,1,1"], "time-backwards", "row 4: 0 after 0"),
        (GOOD_HEAD, ["nan,0,0", ",1,1"], "track-empty", " 2 rows"),
        (GOOD_HEAD, [], "track-unreadable", "no rows"),
        ("time_s,x_cm", ROW, UNREADABLE, "row 2, column z_cm: "),
        (
            "time_s,x_furlong,z_cm",
            ROW,
            UNREADABLE,
            "'x_furlong'; allowed: x_cm in um, mm, cm, m, in",
        ),
        ("t,x,z", ROW, UNREADABLE, "column time_s: .*column x_cm: .*column z_cm: "),
        ("time_s,x_cm,x_mm,z_cm", ROW, UNREADABLE, "row 2, column x_mm: .*number 2"),
    ],
)
def test_bad_tracks_are_refused(tmp_path, header, rows, code, values):
    with pytest.raises(TrackError, match=values) as error:
        read_track(written(tmp_path, rows, header))
    assert error.value.reason.code == code
    assert header != GOOD_HEAD or error.value.rows == len(rows)


def test_files_that_are_none(tmp_path):
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    for name in ("empty.csv", "binary.csv", "none.csv"):
        with pytest.raises(TrackError) as error:
            read_track(tmp_path / name)
        assert error.value.reason.code == UNREADABLE


def test_rows_of_a_track_that_do_not_add_up(tmp_path, monkeypatch):
    trial: Any = SimpleNamespace(
        run_id="a",
        condition="c",
        medium="sand",
        curvature_times_R=1.0,
        frequency_Hz=2.0,
        track="a.csv",
    )
    track = SimpleNamespace(rows=10, dropped={"no number for x": 1}, time_s=np.arange(8.0))
    monkeypatch.setattr("rftfit.robot.tracks.read_track", lambda _: track)
    without_flags = SimpleNamespace(flags=())
    monkeypatch.setattr("rftfit.robot.tracks.mean_stride_speed", lambda *_: without_flags)
    with pytest.raises(RftfitError, match=r" a\.csv .* 9 .* 10 "):
        trial_row(trial, tmp_path, 2)
