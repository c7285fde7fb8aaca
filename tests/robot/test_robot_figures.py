"""Figures of the robot draw the values of the tables, or say why there are none."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb
from numpy.testing import assert_allclose
from pages import figure_faults
from result_tables import memory

from rftfit import TableProfile
from rftfit.compare.robot import optima
from rftfit.figures import style
from rftfit.figures.animation import animation_frames
from rftfit.figures.registry import figures
from rftfit.robot.config import paper_robot
from rftfit.robot.motion import ElementSeries, stance_of, tail_of
from rftfit.robot.run import simulate
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON

PROFILES = ("table", "generic", "depth_only")


def speeds():
    rows = [
        (profile, "poppy_LP", round(k, 2), f, 0.0, f * (8 + 6 * k - 3 * k * k) * factor, "steady")
        for profile, factor in zip(PROFILES, (1, 1.2, 1.4), strict=True)
        for k in [*np.arange(-1, 1.01, 0.2), -0.92, 0.92]
        for f in (1.0, 2.0, 5.0)
    ]
    names = [
        "profile",
        "medium",
        "curvature_times_R",
        "frequency_Hz",
        "phase_turns",
        "speed_cm_per_s",
        "outcome",
    ]
    return pd.DataFrame(rows, columns=names)


def compared():
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    speed = measured["speed_cm_per_s"] * 1.1
    ends = dict.fromkeys(("speed_cm_per_s", "speed_lo_cm_per_s", "speed_hi_cm_per_s"), speed)
    simulated = measured[["curvature_times_R", "frequency_Hz"]].assign(**ends, reason="")
    parts = [simulated.assign(profile=profile) for profile in PROFILES]
    return speed_errors(measured, pd.concat(parts))


@pytest.fixture(scope="module")
def every():
    """The runs of Fig. 4B, coarse in time."""
    robot, profile = paper_robot(), TableProfile.published("poppy_LP")
    curvatures_and_frequencies = ((1.0, 2.0), (-1.0, 2.2))
    return [
        simulate(robot, profile, frequency, curvature, samples_per_stride=50)
        for curvature, frequency in curvatures_and_frequencies
    ]


@pytest.fixture(scope="module")
def motion(every):
    return pd.concat([tail_of(run, 50) for run in every], ignore_index=True)


def swept(runs, errors, best=None):
    """Results of a sweep."""
    tables = {"robot/speed.csv": runs, "robot/errors.csv": errors}
    return memory(tables if best is None else tables | {"robot/optimum.csv": best})


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


def xy(line):
    return np.array(line.get_data(), dtype=float)


def inside(figure):
    """Faults of the texts of a figure."""
    style.content(figure, "svg")
    return figure_faults(figure)


def test_speeds_are_those_of_the_tables():
    errors, runs = compared(), speeds()
    names = ("{medium}_speed", "{medium}_profiles")
    figure, grid = (draw(name, swept(runs, errors), "robot") for name in names)
    assert (len(figure.axes), len(grid.axes)) == (1, 2 * len(PROFILES))
    assert inside(figure) == inside(grid) == []
    panels = [*figure.axes, *grid.axes[::2]]
    for axes, profile in zip(panels, ("table", *PROFILES), strict=True):
        marked = [
            line
            for line in axes.lines
            if line.get_marker() not in ("None", None, "|", "_", 2, 3, "x")
        ]
        drawn = [
            (round(x, 3), line.get_markerfacecolor() == "white")
            for line in marked
            if line.get_markersize() < 5
            for x in xy(line)[0].tolist()
        ]
        assert len(drawn) == (errors["profile"] == profile).sum() == 42
        hollow = [x for x, white in drawn if white]
        assert sorted(hollow) == sorted(round(f, 3) for _, f in CALIBRATED_ON.values())
        (rings,) = (xy(line) for line in axes.lines if line.get_markersize() > 5)
        assert_allclose(sorted(rings[0]), [1.954, 2.246])
        texts = [text.get_text() for text in axes.texts]
        assert [line for line in texts if line.count("42 of 42") == 2]
        curve = next(xy(line) for line in axes.lines if xy(line).shape[1] == 4)
        runs_of_curve = runs[(runs["profile"] == profile) & (runs["curvature_times_R"] == -1.0)]
        assert_allclose(curve[1], [0, *runs_of_curve["speed_cm_per_s"]])
        assert curve[0, 0] == 0


def test_a_robot_upside_down_is_marked():
    runs = speeds()
    over = (runs["profile"] == "depth_only") & (runs["curvature_times_R"] == 1.0)
    runs.loc[over, ["speed_cm_per_s", "outcome"]] = np.nan, "tipped"
    page = draw("{medium}_profiles", swept(runs, compared()), "robot")
    crosses = [xy(line).T.tolist() for line in page.axes[5].lines if line.get_marker() == "x"]
    assert [point for points in crosses for point in points] == [[1.0, 0.0]] * 3
    assert "turned upside down" in [text.get_text() for text in page.legends[0].get_texts()]
    assert not any(xy(line).size for line in page.axes[1].lines if line.get_marker() == "x")


def test_optimum_is_drawn_where_it_is():
    runs = speeds()
    best = optima(runs)
    figure = draw("{medium}_curvature", swept(runs, compared(), best), "robot")
    assert inside(figure) == []
    right = figure.axes[1]
    line = next(line for line in right.lines if xy(line).shape[1] == 3)
    best_of_table = best[best["profile"] == "table"]
    assert_allclose(xy(line), [best_of_table["best_curvature_times_R"].tolist(), [1, 2, 5]])
    fastest = runs[runs["profile"] == "table"]["speed_cm_per_s"].max()
    assert right.collections[0].get_array().max() == pytest.approx(fastest)


def test_a_sweep_without_a_steady_run_says_why():
    runs, best = speeds(), optima(speeds())
    lost = runs["profile"] == "table"
    why = "no alpha at (beta, gamma) in degrees (30, 90)"
    runs.loc[lost, ["speed_cm_per_s", "reason"]] = np.nan, why
    figure = draw(
        "{medium}_curvature", swept(runs, compared(), best[best["profile"] != "table"]), "robot"
    )
    assert inside(figure) == []
    assert any("(30, 90)" in text.get_text() for text in figure.texts)
    assert inside(draw("{medium}_speed", swept(runs, compared().iloc[:0]), "robot")) == []


def test_forces_are_means_over_ten_milliseconds(motion):
    first = motion[motion["curvature_times_R"] == 1.0].reset_index(drop=True)
    fine = first.assign(time_s=np.arange(len(first)) / 1000, force_z_belly_N=0.0)
    fine.loc[50, "force_z_belly_N"] = 11.0
    strides = pd.DataFrame(columns=["run_id", "curvature_times_R", "frequency_Hz"])
    tables = {"robot/motion.csv": fine, "robot/strides.csv": strides}
    figure = draw("robot_motion", memory(tables))
    legend = figure.legends[0]
    names = [text.get_text() for text in legend.get_texts()]
    handle = legend.legend_handles[names.index("belly")]
    (line,) = [
        line
        for line in figure.axes[3].lines
        if (line.get_color(), line.get_linestyle()) == (handle.get_color(), handle.get_linestyle())
    ]
    belly = xy(line)[1]
    assert_allclose(belly[45:56], 1.0)
    assert belly.sum() == pytest.approx(11)


def test_reaction_of_both_tripods(motion):
    figure = draw("robot_reaction", memory({"robot/motion.csv": motion}))
    assert inside(figure) == []
    assert len(figure.axes) == 2 * 2
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["tripod 1", "tripod 2"]
    assert [line.get_linestyle() for line in figure.axes[0].lines][:2] == ["-", "--"]
    # they take turns
    first = motion[motion["curvature_times_R"] == 1.0]
    first_tripod, second_tripod = (first[f"force_z_tripod_{n}_N"].to_numpy(float) for n in (1, 2))
    assert_allclose(
        np.roll(first_tripod, 25)[25:75], second_tripod[25:75], atol=0.02 * first_tripod.max()
    )


def test_stance_shows_the_forces_of_one_tripod(every):
    robot, profile = paper_robot(), TableProfile.published("poppy_LP")
    table = pd.concat([stance_of(robot, profile, run, 50) for run in every])
    figure = draw("robot_stance", memory({"robot/stances.csv": table}))
    assert inside(figure) == []
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["c-leg, 2 Hz", "reversed c-leg, 2.2 Hz"]
    elements = table.query("group == 'tripod_1' and curvature_times_R == 1.0")
    # the tips hang below the hips
    ends = elements[["x1_cm", "z1_cm", "x2_cm", "z2_cm"]].to_numpy(float).reshape(3, -1, 4)
    assert_allclose(ends[:, 0, 0], ends[:, -1, 2], atol=0.5)
    assert (ends[:, 0, 1] > ends[:, -1, 3]).all()
    arrows = figure.axes[0].collections[-1]
    assert 0 < len(np.asarray(arrows.get_offsets())) <= len(elements)
    above = elements[elements["at_z_cm"] >= 0]
    assert not above[["force_z_N", "force_x_N"]].any(axis=None)


def test_arrows_of_an_animation_begin_at_the_loaded_elements():
    """Two elements 16 cm apart, each under the largest force, whose arrow is 4 cm; 50.8 pixels are 2.58 cm."""
    x = np.array([[[-8.0, 8.0]]])
    ends = np.stack([x - 0.5, x + 0.5], axis=-1)
    level = np.full_like(x, -2.0)
    series = ElementSeries(ends, np.full_like(ends, -2.0), 0 * x, np.ones_like(x), x, level)
    (picture,) = animation_frames({"tripod_0": series}, np.zeros(1), np.zeros(1), "")
    red = np.abs(picture - 255 * np.array(to_rgb(style.MARK))).max(axis=-1) < 40
    columns, rows = (np.flatnonzero(red.any(axis=axis)) for axis in (0, 1))
    pixels_per_cm = 5.5 / 11 * 100 / 2.54
    assert np.diff(columns).max() == pytest.approx(16 * pixels_per_cm, abs=3)
    assert np.ptp(rows) == pytest.approx(4 * pixels_per_cm, abs=3)
