"""Figures of the robot draw the values of the tables, or say why there are none."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from numpy.testing import assert_allclose
from pages import figure_faults
from result_tables import memory

import rftfit
from rftfit.figures import style
from rftfit.figures.animation import animation_frames
from rftfit.figures.registry import figures
from rftfit.robot.motion import ElementSeries

PROFILES = ("table", "generic", "depth_only")
NAMES = ("speed", "errors", "optimum", "motion", "strides", "stances")


@pytest.fixture
def tables(small_root):
    """Tables of the robot of a campaign, by name."""
    results = rftfit.open(small_root)
    return {name: results.table(f"robot/{name}.csv").copy() for name in NAMES}


def shown(tables, **changed):
    """Results with these tables of the robot; `changed` in place of others."""
    return memory({f"robot/{name}.csv": table for name, table in (tables | changed).items()})


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


def xy(line):
    return np.array(line.get_data(), dtype=float)


def inside(figure):
    """Faults of the texts of a figure."""
    style.content(figure, "svg")
    return figure_faults(figure)


def test_speeds_are_those_of_the_tables(tables):
    errors, runs = tables["errors"], tables["speed"]
    errors["calibrated"] = np.where(errors["frequency_Hz"].between(1.9, 2.1), "yes", "no")
    names = ("{medium}_speed", "{medium}_profiles")
    figure, grid = (draw(name, shown(tables), "robot") for name in names)
    assert (len(figure.axes), len(grid.axes)) == (1, 2 * len(PROFILES))
    assert inside(figure) == inside(grid) == []
    panels = [*figure.axes, *grid.axes[::2]]
    for axes, profile in zip(panels, ("table", *PROFILES), strict=True):
        points = [
            (round(x, 3), line.get_markerfacecolor() == "white")
            for line in axes.lines
            if line.get_marker() not in ("None", None, "|", "_", 2, 3, "x")
            if line.get_markersize() < 5
            for x in xy(line)[0].tolist()
        ]
        errors_of_profile = errors[errors["profile"] == profile]
        assert len(points) == len(errors_of_profile) == 42
        is_calibrated = errors_of_profile["calibrated"] == "yes"
        frequencies = errors_of_profile.loc[is_calibrated, "frequency_Hz"].round(3)
        assert sorted(x for x, is_hollow in points if is_hollow) == sorted(frequencies)
        runs_of_profile = runs[(runs["profile"] == profile) & (runs["curvature_times_R"] == -1)]
        speeds = runs_of_profile.sort_values("frequency_Hz")["speed_cm_per_s"]
        curves = [xy(line)[1] for line in axes.lines if xy(line).shape[1] == len(speeds) + 1]
        assert any(np.allclose(curve, [0, *speeds]) for curve in curves)


def test_a_robot_upside_down_is_marked(tables):
    runs = tables["speed"]
    is_over = (runs["profile"] == "depth_only") & (runs["curvature_times_R"] == 1.0)
    runs.loc[:, "outcome"] = "steady"
    runs.loc[is_over, ["speed_cm_per_s", "outcome"]] = np.nan, "tipped"
    page = draw("{medium}_profiles", shown(tables), "robot")
    crosses = [xy(line).T.tolist() for line in page.axes[5].lines if line.get_marker() == "x"]
    assert {(x, y) for points in crosses for x, y in points} == {(1.0, 0.0)}
    assert "turned upside down" in [text.get_text() for text in page.legends[0].get_texts()]
    assert not any(xy(line).size for line in page.axes[1].lines if line.get_marker() == "x")


def test_optimum_is_drawn_where_it_is(tables):
    runs, best = tables["speed"], tables["optimum"]
    figure = draw("{medium}_curvature", shown(tables), "robot")
    assert inside(figure) == []
    best = best[best["profile"] == "table"]
    curve = [best["best_curvature_times_R"].to_numpy(), best["frequency_Hz"].to_numpy()]
    right = figure.axes[1]
    assert any(
        np.allclose(xy(line), curve) for line in right.lines if xy(line).shape[1] == len(best)
    )
    fastest = runs[runs["profile"] == "table"]["speed_cm_per_s"].max()
    assert right.collections[0].get_array().max() == pytest.approx(fastest)


def test_a_sweep_without_a_steady_run_says_why(tables):
    runs, best = tables["speed"], tables["optimum"]
    why = "no alpha at (beta, gamma) in degrees (30, 90)"
    runs.loc[runs["profile"] == "table", ["speed_cm_per_s", "reason"]] = np.nan, why
    lost = shown(tables, optimum=best[best["profile"] != "table"])
    figure = draw("{medium}_curvature", lost, "robot")
    assert inside(figure) == []
    assert any("(30, 90)" in text.get_text() for text in figure.texts)
    nothing = shown(tables, errors=tables["errors"].iloc[:0])
    assert inside(draw("{medium}_speed", nothing, "robot")) == []


def first_run(tables):
    motion = tables["motion"]
    return motion[motion["curvature_times_R"] == 1.0].reset_index(drop=True)


def test_forces_are_means_over_ten_milliseconds(tables):
    first = first_run(tables)
    fine = first.assign(time_s=np.arange(len(first)) / 1000, force_z_belly_N=0.0)
    fine.loc[50, "force_z_belly_N"] = 11.0
    figure = draw("robot_motion", shown(tables, motion=fine, strides=tables["strides"].iloc[:0]))
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


def test_reaction_of_both_tripods(tables):
    figure = draw("robot_reaction", shown(tables))
    assert inside(figure) == []
    assert len(figure.axes) == 2 * 2
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["tripod 1", "tripod 2"]
    assert [line.get_linestyle() for line in figure.axes[0].lines][:2] == ["-", "--"]
    # they take turns
    first = first_run(tables)
    first_tripod, second_tripod = (first[f"force_z_tripod_{n}_N"].to_numpy(float) for n in (1, 2))
    half = first["time_s"].searchsorted(0.25)
    middle = slice(half, 3 * half)
    assert_allclose(
        np.roll(first_tripod, half)[middle], second_tripod[middle], atol=0.05 * first_tripod.max()
    )


def test_stance_shows_the_forces_of_one_tripod(tables):
    figure = draw("robot_stance", shown(tables))
    assert inside(figure) == []
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["c-leg, 2 Hz", "reversed c-leg, 2.2 Hz"]
    elements = tables["stances"].query("group == 'tripod_1' and curvature_times_R == 1.0")
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
