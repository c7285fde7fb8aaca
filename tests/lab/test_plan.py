"""The simulated campaign has every run of the paper, each with its tare and a usable fit window."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rftfit import reference
from rftfit.campaign.columns import LABELS, OF_SOURCES
from rftfit.campaign.config import Container
from rftfit.errors import InputError
from rftfit.lab.plan import (
    half_extents,
    motion_at,
    parse_directions,
    plan_runs,
    plate_of,
    segments,
    submerged_depths,
)
from rftfit.lab.write import SHEET_COLUMNS, sheet_text


@pytest.fixture(scope="module")
def runs(config):
    return plan_runs(config)


def test_every_cell_of_table_s5_is_measured(runs):
    cells = set()
    for run in runs:
        if run.kind == "plate" and run.medium == "poppy_LP":
            assert run.beta_deg is not None
            assert run.gamma_deg is not None
            sign = -1 if run.direction == "extraction" else 1
            # one plate for -90 and 90 degrees
            for beta in {run.beta_deg, -run.beta_deg if run.beta_deg == 90 else run.beta_deg}:
                cells.add((sign * beta, round(sign * run.gamma_deg, 2)))
    assert cells == {
        (beta, round(gamma, 2)) for beta in reference.BETA_DEG for gamma in reference.GAMMA_DEG
    }


def test_tares(runs):
    by_id = {run.run_id: run for run in runs}
    users = Counter(run.tare_run for run in runs if run.tare_run)
    for run in runs:
        if run.kind in ("rod", "leg_air"):
            assert not run.tare_run
            continue
        tare = by_id[run.tare_run]
        assert run.tare_shared == (users[run.tare_run] > 1) == (run.kind == "leg")
        assert tare.intruder == run.intruder
        if run.kind == "plate":
            assert replace(run, run_id="", kind="", tare_run="", note="", clock_s=0) == replace(
                tare, run_id="", kind="", tare_run="", note="", clock_s=0
            )


def test_subset_has_the_same_runs(config, runs):
    subset = plan_runs(config, ["yuma", "poppy_LP"])
    assert len(subset) == 183 + 5 + 3
    assert set(subset) <= set(runs)


def test_unknown_medium(config):
    with pytest.raises(InputError, match="did you mean 'poppy_LP'"):
        plan_runs(config, ["popy_LP"])


def test_sheet(runs):
    lines = sheet_text(runs, {}).split("\n")
    assert lines[0] == ",".join(
        name for name in SHEET_COLUMNS if name not in ("zero_log", "stroke", *LABELS, *OF_SOURCES)
    )
    assert len(lines) == 935
    assert lines[-1] == ""
    row = next(line for line in lines if line.startswith("poppy_LP_bm60_g18_ex,"))
    assert row == (
        "poppy_LP_bm60_g18_ex,plate,poppy_LP,plate,extraction,-60,18.4349,,"
        "poppy_LP/poppy_LP_bm60_g18_ex_force.csv,poppy_LP/poppy_LP_bm60_g18_ex_motion.csv,"
        "poppy_LP_bm60_g18_ex_rod,,,,,re-enacted from Table S5"
    )
    air = next(line for line in lines if line.startswith("air_c_leg,"))
    assert air.startswith("air_c_leg,leg_air,,c_leg,rotation,,,,air/air_c_leg_force.csv")
    leg = next(line for line in lines if line.startswith("yuma_c_leg,"))
    assert ",air_c_leg,yes," in leg


def test_every_path_leaves_a_window(config, runs):
    for run in runs:
        if run.kind == "plate" and run.direction != "horizontal":
            shallow, deep = submerged_depths(run, config)
            assert deep - shallow >= 0.5


def test_paths_stay_in_the_box(config, runs):
    plate = plate_of(config.intruders)[1]
    for run in runs:
        if run.kind != "plate" or run.medium not in ("poppy_LP", "yuma"):
            continue
        assert run.beta_deg is not None
        half_x, half_z = half_extents(plate, run.beta_deg)
        path_segments = segments(run, config)
        motion = motion_at(path_segments, np.arange(0, 40, 0.01))
        assert np.all(np.abs(motion.x_cm) + half_x <= config.container.length_cm / 2 - 6 + 1e-9)
        assert motion.z_cm.min() - half_z >= 4 - config.container.depth_cm
        stroke = next(segment for segment in path_segments if segment.phase == "stroke")
        dx, dz = (np.subtract(stroke.end, stroke.start) / stroke.distance)[:2]
        gamma = math.radians(run.gamma_deg or 0.0)
        sign = -1 if run.direction == "extraction" else 1
        assert (dx, dz) == pytest.approx((-sign * math.cos(gamma), -sign * math.sin(gamma)))
        air = path_segments[-1] if run.direction == "extraction" else path_segments[0]
        assert air.phase == "rest"
        assert air.duration_s == 2
        assert air.start[1] - half_z >= 1.5
        assert [p.duration_s for p in path_segments if p.phase == "pause"] == [2.0]
        speed = np.hypot(np.diff(motion.x_cm), np.diff(motion.z_cm)) / 0.01
        assert speed.max() <= config.arm.speed_cm_per_s + 1e-6


def test_too_small_a_container(config):
    small = config.model_copy(
        update={"container": Container(length_cm=17, width_cm=22, depth_cm=15)}
    )
    with pytest.raises(InputError, match="no fit window"):
        segments(plan_runs(small, ["poppy_LP"])[20], small)


@pytest.mark.parametrize(("count", "apart_deg"), [(40, 6.0), (250, 6.0), (500, 3.0)])
def test_scattered_directions_are_apart(count, apart_deg):
    """No two are taken for one, and straight down is among them."""
    beta, gamma = np.array(parse_directions(f"scattered:{count}", 7)).T
    assert (beta[0], gamma[0]) == (0, 90)
    beta_apart = np.abs((beta - beta[:, None] + 90) % 180 - 90)
    apart = np.maximum(beta_apart, np.abs(gamma - gamma[:, None]))
    assert apart[~np.eye(count, dtype=bool)].min() >= apart_deg


def test_more_directions_than_there_is_room_for_are_refused():
    with pytest.raises(InputError, match="scattered"):
        parse_directions("scattered:501", 7)
