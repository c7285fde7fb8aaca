"""Figures of the robot: what is drawn is what the tables say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from memory import memory

from rftfit.compare.robot import optima
from rftfit.figures.registry import figures
from rftfit.figures.robot import (
    curvature_looks,
    draw_motion,
    draw_optimum,
    draw_speeds,
    group_names,
    profiles,
    robot_reaction,
    speed,
)
from rftfit.figures.style import save
from rftfit.model.profiles import TableProfile
from rftfit.robot.config import paper_robot
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON
from rftfit.workflow.robot import last_strides

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

PROFILES = ("table", "generic", "depth_only")


def speeds() -> pd.DataFrame:
    rows = [
        (
            profile,
            "poppy_LP",
            round(k, 2),
            f,
            0.0,
            f * (8 + 6 * k - 3 * k * k) * (1 + at / 5),
            "steady",
        )
        for at, profile in enumerate(PROFILES)
        for k in [*np.arange(-1, 1.01, 0.2), -0.92, 0.92]
        for f in (1.0, 2.0, 5.0)
    ]
    names = ["profile", "medium", "curvature_times_R", "frequency_Hz", "phase_turns",
             "speed_cm_per_s", "outcome"]  # fmt: skip
    return pd.DataFrame(rows, columns=names)


def compared() -> pd.DataFrame:
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    parts = []
    for profile in PROFILES:
        speed = measured["speed_cm_per_s"] * 1.1
        parts.append(
            pd.DataFrame(
                {"profile": profile, "curvature_times_R": measured["curvature_times_R"],
                 "frequency_Hz": measured["frequency_Hz"], "speed_cm_per_s": speed,
                 "speed_lo_cm_per_s": speed, "speed_hi_cm_per_s": speed, "reason": ""}
            )
        )  # fmt: skip
    return speed_errors(measured, pd.concat(parts))


@pytest.fixture(scope="module")
def motion() -> pd.DataFrame:
    profile = TableProfile.published("poppy_LP")
    parts = [
        last_strides(paper_robot(), profile, 4.0, k, 50).assign(profile=name)
        for name in ("table", "depth_only")
        for k in (1.0, -1.0)
    ]
    return pd.concat(parts, ignore_index=True)


def xy(line: Any) -> Any:
    return np.array(line.get_data(), dtype=float)


def inside(figure: Figure) -> list[str]:
    """Texts that stick out of the figure."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    box = figure.bbox
    # ticks beyond the ends of an axis are there and not drawn
    ticks = {
        label
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for label in axis.get_ticklabels(which="both")
    }
    out = []
    for text in figure.findobj(Text):
        if text in ticks or not (text.get_visible() and text.get_text().strip()):
            continue
        extent = text.get_window_extent(canvas.get_renderer())
        if extent.width and (
            extent.x0 < box.x0 - 1 or extent.x1 > box.x1 + 1
            or extent.y0 < box.y0 - 1 or extent.y1 > box.y1 + 1
        ):  # fmt: skip
            out.append(text.get_text())
    return out


@pytest.mark.parametrize("profiles", [("table",), PROFILES])
def test_speeds_are_those_of_the_tables(profiles: tuple[str, ...]) -> None:
    errors, runs = compared(), speeds()
    figure = draw_speeds(runs, errors, profiles)
    assert len(figure.axes) == len(profiles)
    assert inside(figure) == []
    for axes, profile in zip(figure.axes, profiles, strict=True):
        drawn = [
            (x, y, line.get_markerfacecolor() == "white")
            for line in axes.lines
            if line.get_marker() not in ("None", None, "|", "_", 2, 3)
            for x, y in xy(line).T
        ]
        own = errors[errors["profile"] == profile]
        assert len(drawn) == len(own) == 42
        assert sum(hollow for *_, hollow in drawn) == 3
        hollow = {round(float(x), 3) for x, _, white in drawn if white}
        assert hollow == {round(f, 3) for _, f in CALIBRATED_ON.values()}
        texts = [text.get_text() for text in axes.texts]
        assert "within 20 %: 42 of 42\nwithin 35 %: 42 of 42" in texts
        curve = next(line for line in axes.lines if xy(line).shape[1] == 4)
        part = runs[(runs["profile"] == profile) & (runs["curvature_times_R"] == -1.0)]
        np.testing.assert_allclose(xy(curve)[1, 1:], part["speed_cm_per_s"])
        np.testing.assert_allclose(xy(curve)[:, 0], 0)


def test_speeds_without_a_measurement() -> None:
    figure = draw_speeds(speeds(), compared().iloc[:0])
    assert inside(figure) == []
    assert len(figure.axes) == 3
    (told,) = draw_speeds(speeds().iloc[:0], compared()).texts
    assert "no simulated speed" in told.get_text()


def test_curvatures_look_different() -> None:
    looks = curvature_looks([-1, -0.92, -0.6, 0, 0.6, 0.92, 1])
    assert len(set(looks.values())) == 7
    assert len({colour for colour, _ in looks.values()}) == 7
    red, blue = (int(looks[1][0][i : i + 2], 16) for i in (1, 5))
    assert red > blue


def test_optimum_is_drawn_where_it_is() -> None:
    runs = speeds()
    best = optima(runs)
    figure = draw_optimum(runs, best)
    assert inside(figure) == []
    own = best[best["profile"] == "table"]
    left = figure.axes[0]
    line = next(line for line in left.lines if xy(line).shape[1] == 3)
    np.testing.assert_allclose(xy(line)[0], own["best_curvature_times_R"])
    np.testing.assert_allclose(xy(line)[1], [1, 2, 5])
    grid = left.collections[0].get_array()
    assert grid is not None
    assert grid.max() == pytest.approx(runs[runs["profile"] == "table"]["speed_cm_per_s"].max())


def test_a_sweep_without_a_steady_run_says_why() -> None:
    runs = speeds()
    lost = runs["profile"] == "table"
    runs.loc[lost, "speed_cm_per_s"] = np.nan
    runs.loc[lost, "reason"] = "no alpha at (beta, gamma) in degrees (30, 90)"
    best = optima(speeds())
    figure = draw_optimum(runs, best[best["profile"] != "table"])
    assert inside(figure) == []
    assert any("(30, 90)" in text.get_text() for text in figure.texts)
    assert inside(draw_speeds(runs, compared().iloc[:0], ["table"])) == []


def test_motion_over_two_strides(motion: pd.DataFrame) -> None:
    figure = draw_motion(motion)
    assert inside(figure) == []
    assert len(figure.axes) == 2 * 5
    first = motion[(motion["profile"] == "table") & (motion["curvature_times_R"] == 1.0)]
    assert first["stride"].iloc[-1] == pytest.approx(2 - 1 / 50)
    pitch = figure.axes[2 * 2].lines[0]
    np.testing.assert_allclose(xy(pitch)[1], first["pitch_deg"])
    assert group_names(motion)[:3] == ["tripod_1", "tripod_2", "belly"]


def test_tripods_take_turns(motion: pd.DataFrame) -> None:
    first = motion[(motion["profile"] == "table") & (motion["curvature_times_R"] == 1.0)]
    one, two = (first[f"force_z_tripod_{n}_N"].to_numpy(float) for n in (1, 2))
    np.testing.assert_allclose(np.roll(one, 25)[25:75], two[25:75], atol=0.02 * one.max())


def test_reaction_by_profile(motion: pd.DataFrame) -> None:
    figure = robot_reaction(memory({"robot/motion.csv": motion}))
    assert inside(figure) == []
    assert len(figure.axes) == 2 * 3
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["measured table", "depth-only"]


def test_each_sweep_has_its_figures_and_captions() -> None:
    errors, runs = compared(), speeds().assign(warning="")
    runs.loc[:2, "outcome"] = "tipped"
    results = memory({"robot_full/errors.csv": errors, "robot_full/speed.csv": runs})
    for draw, panels in ((speed, 1), (profiles, 3)):
        assert len(draw(results, "robot_full").axes) == panels
    own = {one.file(sweep): one for one in figures() for sweep in one.media(results.campaign)}
    told = own["figures/robot_full_speed"].caption_of(results, "robot_full")
    assert "Hollow points (3 of 42)" in told
    assert "within 20 % in 42 and within 35 % in 42 of 42 conditions; of the 39 that" in told
    told = own["figures/robot_full_profiles"].caption_of(results, "robot_full")
    assert f"Of {len(runs)} runs, 3 came to no steady speed" in told
    assert own["figures/robot_speed"].group == "robot_figures"


def test_captions_of_motion_and_curvature(motion: pd.DataFrame) -> None:
    best = optima(speeds())
    results = memory({"robot/motion.csv": motion, "robot/optimum.csv": best})
    own = {one.file(sweep): one for one in figures() for sweep in one.media(results.campaign)}
    first = motion[(motion["profile"] == "table") & (motion["curvature_times_R"] == 1.0)]
    lift = first["force_z_tripod_1_N"].max()
    told = own["figures/robot_motion"].caption_of(results)
    assert f"c-leg at 4.0 Hz: {first['x_cm'].iloc[-1] / first['time_s'].iloc[-1]:.1f} cm/s" in told
    assert f"lift of a tripod up to {lift:.2f} N" in told
    assert "depth-only" not in told
    assert "depth-only, reversed c-leg" in own["figures/robot_reaction"].caption_of(results)
    top = best.query("profile == 'table' and frequency_Hz == 5").iloc[0]
    told = own["figures/robot_curvature"].caption_of(results, "robot")
    assert f"5.0 Hz: fastest at R'/r {top['best_curvature_times_R']:.2f} (read within" in told


def test_same_figure_same_bytes(tmp_path: Path) -> None:
    for name in "ab":
        save(draw_speeds(speeds(), compared()), tmp_path / name)
    for ending in ("png", "pdf", "svg"):
        assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()
