"""A marker track gives the robot's speed or a reason, and each row of it is accounted for."""

import re
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import run_rules
from makers import write_rows, write_yaml
from numpy.testing import assert_allclose
from paper import PROJECT

import rftfit
from rftfit.workflow.state import States, read_states

RUNS = (
    "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
    "p1,plate,poppy_LP,plate,intrusion,0,90,p1_f.csv,p1_m.csv\n"
)
"""Sheet of the campaign's own runs."""
GOOD_HEAD = "time_s,x_cm,z_cm"


def running(frequency=2.0, speed=25.0, strides=6.4, uneven=0.03, noise=0.02, rate=100.0):
    """A robot whose body bobs twice a stride and surges."""
    rng = np.random.default_rng(5)
    time = np.arange(int(strides / frequency * rate)) / rate
    turn = 2 * np.pi * frequency * time + 0.7
    x = speed * time + 1.1 * np.sin(2 * turn) + rng.normal(0, noise, time.size)
    z = 2 + 0.3 * np.cos(2 * turn) + uneven * np.cos(turn) + rng.normal(0, noise, time.size)
    return pd.DataFrame({"time_s": time, "x_cm": x, "z_cm": z})


def changed(**columns):
    """A track whose columns are calculated from those of a robot that runs."""
    return running().assign(**columns)


def cut(start_s, length_s):
    track = running()
    return track[(track["time_s"] < start_s) | (track["time_s"] >= start_s + length_s)]


def damaged():
    """Text of a track of which five rows cannot be used."""
    lines = running().to_csv(index=False).splitlines()
    lines[20:26] = ["0.19,nan,1", "0.2,,1", "0.21,3,x", "0.22,2,1", "0.23,3", ",3,1"]
    return "\n".join(lines)


def lost_markers(z):
    lost = np.random.default_rng(3).random(z.size) < 0.04
    return z + 30.0 * lost


NOISE = np.random.default_rng(1).normal(0, 1, (2, 400))
LENGTHS = (3.2, 3.35, 3.6, 3.85, 5.3, 11.7)
"""Of tracks, in strides."""
FREQUENCIES_HZ = (0.343, 1.2, 2.0, 4.9)
COMING_BACK = {
    f"f{f}_{length}": (f, running(f, strides=length)) for f in FREQUENCIES_HZ for length in LENGTHS
}
TRACKS = {name: track for name, (_, track) in COMING_BACK.items()} | {
    "plain": running(),
    "outliers": changed(z_cm=lambda t: t["z_cm"] + 30.0 * (np.arange(len(t)) % 37 == 0)),
    "still": changed(z_cm=2.0),
    # one row in 25, at random, is 30 cm off; the body does not surge, so that x tells nothing
    "height": changed(x_cm=lambda t: 25.0 * t["time_s"], z_cm=lambda t: lost_markers(t["z_cm"])),
    "uneven": running(uneven=0.5),
    "faster": changed(x_cm=lambda t: t["x_cm"] + 6.0 * t["time_s"] ** 2),
    "small_gap": cut(1.0, 0.1),
    "units": running()
    .assign(time_s=lambda t: 1000 * t["time_s"], x_cm=lambda t: 10 * t["x_cm"])
    .assign(z_cm=lambda t: t["z_cm"] / 2.54)
    .set_axis(["Time [ms]", "X (mm)", "z_in"], axis="columns"),
    "damaged": damaged(),
}
"""Tracks by run: tables, or texts."""
REFUSED = {
    "short": ((running(1.0, strides=2.5), "1"), "few-strides", "2.49 .* 1 Hz .* 3 "),
    "shorter": ((running(2.0, strides=0.7), "2"), "few-strides", "0.68 .* 2 Hz .* 3 "),
    "few": ((running(2.0, strides=0.1), "2"), "few-rows", "5 .* 30"),
    "noise": (
        (pd.DataFrame({"time_s": np.arange(400) / 100, "x_cm": NOISE[0], "z_cm": NOISE[1]}), ""),
        "no-stride",
        "frequency_Hz",
    ),
    "gap": ((cut(1.0, 0.3), ""), "track-gaps", r"0\.62 .* 0\.25 "),
    "empty": (("", ""), "track-unreadable", ""),
    "binary": ((b"\xff\xfe\x00\x01", ""), "track-unreadable", ""),
    "absent": ((None, ""), "track-unreadable", ""),
} | {
    f"bad_{number}": (("\n".join(["# a comment", header, *rows, ""]), ""), code, values)
    for number, (header, rows, code, values) in enumerate(
        [
            (GOOD_HEAD, ["0,0,0", "0.2,1,1", "0.1,2,1"], "time-backwards", "row 5: 0.1 after 0.2"),
            (GOOD_HEAD, ["0,0,0", "0,1,1"], "time-backwards", "row 4: 0 after 0"),
            (GOOD_HEAD, ["nan,0,0", ",1,1"], "track-empty", " 2 rows"),
            (GOOD_HEAD, [], "track-unreadable", "no rows"),
            ("time_s,x_cm", ["0,0,0,0"], "track-unreadable", "row 2, column z_cm: "),
            (
                "time_s,x_furlong,z_cm",
                ["0,0,0,0"],
                "track-unreadable",
                "'x_furlong'; allowed: x_cm in um, mm, cm, m, in",
            ),
            (
                "t,x,z",
                ["0,0,0,0"],
                "track-unreadable",
                "column time_s: .*column x_cm: .*column z_cm: ",
            ),
            (
                "time_s,x_cm,x_mm,z_cm",
                ["0,0,0,0"],
                "track-unreadable",
                "row 2, column x_mm: .*number 2",
            ),
        ]
    )
}
"""Track and frequency in the sheet by run; code and words of the reason for which it gives no speed."""


def campaign_of(root, tracks):
    """Write a campaign of these tracks and frequencies; the path of its config."""
    (root / "config").mkdir(parents=True)
    shutil.copy(PROJECT / "config" / "config.yaml", root / "config")
    folder = root / "raw" / "paper" / "robot"
    folder.mkdir(parents=True)
    (folder.parent / "runs.csv").write_text(RUNS, "utf-8")
    sheet = []
    for name, (track, frequency) in tracks.items():
        sheet.append({"run_id": name, "condition": name, "medium": "poppy_LP"})
        sheet[-1] |= {"curvature_times_R": 1, "frequency_Hz": frequency, "track": f"{name}.csv"}
        path = folder / f"{name}.csv"
        if isinstance(track, pd.DataFrame):
            path.write_text("# a comment\n" + track.to_csv(index=False, sep=";"), "utf-8")
        elif track is not None:
            path.write_bytes(track if isinstance(track, bytes) else track.encode())
    write_rows(folder / "runs.csv", sheet)
    return root / "config" / "config.yaml"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Trials by run, flags, and where the rows went."""
    tracks = {name: (track, "") for name, track in TRACKS.items()}
    tracks |= {name: track for name, (track, _, _) in REFUSED.items()}
    config = campaign_of(tmp_path_factory.mktemp("tracks"), tracks)
    run_rules(config, "robot_measured")
    results = rftfit.open(config)
    flags = results.table("robot/flags.csv")
    trials = results.table("robot/tracks.csv").set_index("run_id")
    speeds = results.table("robot/measured.csv").set_index("condition")
    ledger = results.table("ledger/robot.csv")
    return SimpleNamespace(trials=trials, speeds=speeds, flags=flags, ledger=ledger)


def flags_of(measured, run_id):
    """Sentences of the flags of a run by their codes."""
    flags = measured.flags[measured.flags["run_id"] == run_id]
    return dict(zip(flags["code"], flags["words"], strict=True))


def test_frequency_and_speed_come_back(measured):
    trials = measured.trials.loc[[*COMING_BACK]]
    assert set(trials["frequency_from"]) == {"track"}
    assert_allclose(trials["frequency_Hz"], [f for f, _ in COMING_BACK.values()], rtol=0.01)
    # a plain end-to-end slope would be off by up to 10 %: the surge is 1.1 cm
    assert_allclose(trials["speed_cm_per_s"], 25.0, rtol=0.01)
    assert not any(flags_of(measured, name) for name in COMING_BACK)


def test_a_trial_near_the_frequency_of_a_calibration_is_of_it(measured):
    """1.955 Hz at R'/r = 1; a tenth of a hertz around it."""
    calibrated = measured.speeds.loc[["plain", "f1.2_11.7", "noise"], "calibrated"]
    assert calibrated.tolist() == ["yes", "no", "no"]


@pytest.mark.parametrize("name", ["outliers", "still", "height"])
def test_outliers_do_not_change_the_frequency_and_x_serves_where_z_is_still(measured, name):
    assert measured.trials.loc[name, "frequency_Hz"] == pytest.approx(2.0, rel=0.01)


def test_an_uneven_gait_is_doubted(measured):
    assert measured.trials.loc["uneven", "frequency_Hz"] == pytest.approx(1.0, rel=0.02)
    words = flags_of(measured, "uneven")["stride-doubled"]
    ((bob_Hz, stride_Hz),) = re.findall(r"is ([\d.]+) and not ([\d.]+) Hz", words)
    assert (float(bob_Hz), float(stride_Hz)) == pytest.approx((2.0, 1.0), rel=0.02)


def test_a_robot_that_speeds_up_is_flagged(measured):
    assert [*flags_of(measured, "faster")] == ["speed-changes"]


def test_a_small_gap_is_flagged(measured):
    assert measured.trials.loc["small_gap", "speed_cm_per_s"] == pytest.approx(25.0, rel=0.01)
    flags = flags_of(measured, "small_gap")
    assert [*flags] == ["track-gaps"]
    assert re.search(r"1 gap.* 0\.11 s", flags["track-gaps"])


def test_units_of_the_header(measured):
    columns = ["frequency_Hz", "speed_cm_per_s", "stride_sd_cm_per_s", "strides"]
    plain, of_units = (measured.trials.loc[name, columns] for name in ("plain", "units"))
    assert_allclose(of_units.astype(float), plain.astype(float), rtol=1e-4)


def test_every_row_is_accounted_for(measured):
    trial = measured.trials.loc["damaged"]
    assert (trial["rows"], trial["rows_used"]) == (len(running()), len(running()) - 5)
    ledger = measured.ledger[measured.ledger["run_id"] == "damaged"]
    dropped = ledger[ledger["fate"] == "dropped"].set_index("reason")["rows"].to_dict()
    by_column = {re.findall("x_cm|z_cm|time_s", why)[0]: rows for why, rows in dropped.items()}
    assert by_column == {"x_cm": 2, "z_cm": 2, "time_s": 1}
    assert ledger["rows"].sum() == trial["rows"]


@pytest.mark.parametrize("name", REFUSED)
def test_tracks_that_give_no_speed_say_why(measured, name):
    (track, _), code, words = REFUSED[name]
    trial = measured.trials.loc[name]
    assert (trial["status"], trial["reason_code"]) == ("refused", code)
    assert re.search(words, trial["reason"])
    rows = measured.ledger[measured.ledger["run_id"] == name]["rows"].sum()
    assert rows == trial["rows"]
    if code in ("time-backwards", "track-empty"):
        assert rows == track.count("\n") - 2


def test_rows_of_a_track_that_do_not_add_up(tmp_path, monkeypatch):
    track = SimpleNamespace(rows=10, dropped={"no number for x": 1}, time_s=np.arange(8.0))
    monkeypatch.setattr("rftfit.robot.tracks.read_track", lambda _: track)
    without_flags = SimpleNamespace(flags=())
    monkeypatch.setattr("rftfit.robot.tracks.mean_stride_speed", lambda *_: without_flags)
    config = campaign_of(tmp_path, {"a": (running(), "")})
    with pytest.raises(rftfit.RftfitError, match=r" a\.csv .* 9 .* 10 "):
        run_rules(config, "robot_measured")


def test_simulated_trials_have_the_published_speeds(small_root):
    """Tracks of three trials of each condition of Fig. 4C, scattered about its speed."""
    speeds = pd.read_csv(small_root / "results" / "robot" / "measured.csv")
    figure = rftfit.published_table("fig_4c").query("stride_frequency_Hz > 0.01")
    assert (len(speeds), {*speeds["trials"]}, {*speeds["source"]}) == (42, {3}, {"marker tracks"})
    published = sorted(figure["speed_cm_per_s"])
    assert_allclose(sorted(speeds["speed_cm_per_s"]), published, rtol=0.03)
    assert (speeds["speed_sd_cm_per_s"] > 0).all()


def test_without_tracks_the_figure_stands_in_for_its_medium_alone(tmp_path):
    config = campaign_of(tmp_path, {})
    for medium, conditions in (("poppy_LP", 42), ("poppy_CP", 0)):
        write_yaml(
            config, yaml.safe_load(config.read_text("utf-8")) | {"robot": {"medium": medium}}
        )
        (tmp_path / "raw" / "paper" / "runs.csv").write_text(RUNS.replace("poppy_LP", medium))
        run_rules(config, "robot_measured")
        speeds = rftfit.open(config).table("robot/measured.csv")
        assert speeds["source"].tolist() == ["Fig. 4C"] * conditions


def test_a_track_is_an_input_of_its_stage(tmp_path):
    config = campaign_of(tmp_path, {"a": (running(), "")})
    states = read_states(config)
    assert len(states.robot_digests) == 2
    track = config.parents[1] / "raw" / "paper" / "robot" / "a.csv"
    track.write_bytes(track.read_bytes() + b"# end\n")
    before, after = (
        of_campaign.state_of("robot_measured", "")
        for of_campaign in (states, States(states.campaign))
    )
    assert [what for what in after if after[what] != before[what]] == ["robot files"]
