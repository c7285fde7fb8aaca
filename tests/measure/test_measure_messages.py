"""Why a run gives no number: each reason once, from logs that deserve it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pushes import make_push

from rftfit.campaign.sheet import Run
from rftfit.logs.base import Log, LogError
from rftfit.measure.alignment import estimate_clocks
from rftfit.measure.flags import remark
from rftfit.measure.ingest import ForceReadings, find_clock, place_surface, read_motion
from rftfit.measure.ingest import _flags as stroke_flags
from rftfit.measure.ledger import RowStatus
from rftfit.measure.pairs import completed
from rftfit.measure.strokes import IntruderPath, find_stroke
from rftfit.measure.surface import compliance_of, find_surface

NAN = float("nan")
PUSH = Run(
    "a", "plate", "sand", "plate", "intrusion", 0.0, 90.0, NAN, "a.csv", "b.csv",
    "", False, None, False, "", "", 2,
)  # fmt: skip


def path(depth):
    time = np.linspace(0, 10, depth.size)
    return IntruderPath(time, np.zeros_like(depth), -depth, np.zeros_like(depth))


def changed(config, section, **values):
    part = getattr(config, section).model_copy(update=values)
    return config.model_copy(update={section: part})


def test_a_log_that_begins_at_the_end_of_the_push():
    time = np.arange(0, 10, 0.01)
    force = np.where(time < 0.12, 0.0, 50.0 - time) + np.random.default_rng(0).normal(0, 0.1, 1000)
    with pytest.raises(
        ValueError, match=r"largest at reading \d+ already; \d+ are needed before it"
    ):
        estimate_clocks(time, force, time, np.linspace(0, 5, 1000), 1e-3, 0.1)


def test_a_rigid_push_with_few_readings_in_contact():
    force = np.concatenate([np.zeros(200), np.linspace(10, 200, 8)])
    with pytest.raises(ValueError, match="8 readings in contact are too few; "):
        compliance_of(np.linspace(0, 1, 208), force, 0.05)


def test_a_sync_line_is_needed(paper_config):
    time, depth = np.linspace(0, 10, 200), np.linspace(-2, 5, 200)
    config = changed(paper_config, "clock", method="sync_line")
    readings = ForceReadings(
        time, np.stack([time, time]), None, np.zeros(200, dtype=bool), np.zeros((3, 200))
    )
    with pytest.raises(ValueError, match=r"the force log has no column arm_moving; clock.method"):
        find_clock(config, PUSH, readings, path(depth), np.empty((0, 2)))


def test_a_surface_that_cannot_be_found(paper_config):
    name = next(name for name, one in paper_config.intruders.items() if one.shape == "plate")
    config = changed(paper_config, "surface", method="find", max_se_cm=1e-6)
    run = replace(PUSH, intruder=name)
    tilted = replace(run, beta_deg=30.0)
    push = make_push(2)
    motion = IntruderPath(push.motion_time, push.depth * 0, -push.depth, push.depth * 0)
    with pytest.raises(ValueError, match=r"surface.method find works for flat plates pushed down"):
        place_surface(config, tilted, motion, push.force_time, push.force, 0.0)
    with pytest.raises(ValueError, match=r"surface not found well enough: .* allowed: 1e-06 cm"):
        place_surface(config, run, motion, push.force_time, push.force, 0.0)


def test_a_log_that_counts_downward(paper_config):
    upside_down = path(np.linspace(-3.0, -15.0, 100))
    with pytest.raises(ValueError, match=r"z = \+3.00 cm, where it begins; z points up .*factor"):
        find_stroke(upside_down, np.empty((0, 2)), PUSH, paper_config.arm)


def test_a_path_that_does_not_cross_the_surface(paper_config):
    config = changed(paper_config, "arm", drive="uneven")
    below = path(np.linspace(1.0, 5.0, 100))
    with pytest.raises(ValueError, match=r"the path from -1.00 to -5.00 cm does not cross"):
        find_stroke(below, np.empty((0, 2)), PUSH, config.arm)
    back = path(np.concatenate([np.linspace(5.0, 4.0, 50), np.linspace(4.0, -1.0, 50)]))
    with pytest.raises(ValueError, match="the arm log begins below the surface"):
        find_stroke(back, np.empty((0, 2)), PUSH, config.arm)


def test_x_is_counted_from_the_middle_of_the_container(paper_config):
    config = changed(paper_config, "arm", middle_x_mm=400.0, surface_z_mm=0.0)
    values = {"time": [0.0, 1.0], "x": [410.0, 380.0], "z": [0.0, -10.0], "angle": [0.0, 0.0]}
    columns = {name: np.array(one) for name, one in values.items()}
    units = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
    log = Log(Path("m.csv"), columns, units, 2, {})
    np.testing.assert_allclose(read_motion(config, PUSH, log).x, [1.0, -2.0])
    # a path straight down that nobody logged is at the middle
    without_x = Log(log.path, {n: v for n, v in columns.items() if n != "x"}, units, 2, {})
    whole = completed(without_x, PUSH, units, 40.0)
    np.testing.assert_allclose(read_motion(config, PUSH, whole).x, 0.0)
    # the sheet knows beta of a plate, but no theta of a leg
    without_angle = Log(log.path, {n: v for n, v in columns.items() if n != "angle"}, units, 2, {})
    np.testing.assert_array_equal(completed(without_angle, PUSH, units).columns["angle"], 0.0)
    leg = replace(PUSH, kind="leg", direction="rotation", beta_deg=NAN, gamma_deg=NAN)
    with pytest.raises(LogError, match=r"no column for angle; name it under motion_log\.columns"):
        completed(without_angle, leg, units)


def test_a_rise_that_could_be_noise():
    depth = np.linspace(0, 5, 1000)
    force = np.where(depth > 3, 3.0, 0.0) + np.random.default_rng(1).normal(0, 0.5, 1000)
    with pytest.raises(
        ValueError, match=r"grows by 3\..* N within 1.5 cm; needed: 10 times its noise of 0.4\d N"
    ):
        find_surface(depth, force, 1.5, 0.05)


def test_a_large_rise_is_not_called_noise():
    # 160 N above a noise of 0.07 N, but up and down on the way
    depth = np.linspace(0, 6, 1200)
    under = np.maximum(depth - 3, 0)
    force = 25 * under * (1 + np.sin(14 * depth)) + np.random.default_rng(3).normal(0, 0.07, 1200)
    with pytest.raises(ValueError, match=r"N/cm with a standard error of") as caught:
        find_surface(depth, force, 1.5, 0.07)
    assert "noise" not in str(caught.value)


def test_a_motion_up_toward_minus_x(paper_config):
    time = np.linspace(0, 10, 500)
    up = np.linspace(0, 5, 500)
    motion = IntruderPath(time, 3 - up, up - 6, np.zeros(500))
    run = replace(PUSH, direction="extraction", gamma_deg=-45.0)
    arm = paper_config.arm.model_copy(update={"speed_cm_per_s": 0.7})
    start, end = find_stroke(motion, motion.spans(arm), run, arm)
    assert end - start > 9
    back = IntruderPath(time, up, up - 6, np.zeros(500))
    with pytest.raises(ValueError, match=r"along gamma = -135.0 deg; .* is along -45.0 deg"):
        find_stroke(back, back.spans(arm), run, arm)


def test_an_arm_slower_than_the_config_says(paper_config):
    slow = path(np.linspace(-1.0, 2.0, 200))
    arm = paper_config.arm
    with pytest.raises(ValueError, match=r"half of arm.speed_cm_per_s \(1 cm/s\) or faster; "
                       r"its speed there was 0.3 cm/s at most"):  # fmt: skip
        find_stroke(slow, slow.spans(arm), PUSH, arm)


@pytest.mark.parametrize(
    ("holes", "code", "numbers"),
    [([(3.0, 3.4)], "gap", [0.41]),
     ([(k, k + 0.2) for k in np.arange(1.0, 41.0)] + [(50.0, 50.6)], "gaps", [41, 9.02, 0.62])],
)  # fmt: skip
def test_many_gaps_are_one_flag(paper_config, holes, code, numbers):
    time = np.arange(0, 60, 0.01)
    kept = ~np.any([(time > start) & (time < end) for start, end in holes], axis=0)
    (flag,) = stroke_flags(paper_config, time[kept], 0.0, 0.0)
    assert flag.code == code
    np.testing.assert_allclose([*flag.values.values()], numbers, rtol=0.06)


def test_a_force_that_grows_in_air_too():
    # a cable that tightens all the way down
    depth = np.linspace(0, 5, 1000)
    force = 1.2 * depth + 4.0 * np.maximum(depth - 3, 0)
    force += np.random.default_rng(1).normal(0, 0.3, 1000)
    with pytest.raises(ValueError, match=r"the force grows too, by .*; the log must begin in air"):
        find_surface(depth, force, 1.5, 0.05)


def test_every_row_status_has_its_sentence():
    said = [str(remark(why.code)) for why in RowStatus if why != RowStatus.GOOD]
    assert len(set(said)) == len(RowStatus) - 1
