"""Data that allow no number are refused with the code of their cause, tested once for each code.

The codes of units are tested in test_measure_units.py, those of a compliance in test_measure_compliance.py.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pushes import estimate, make_push, plate_run

from rftfit.campaign.config import Arm
from rftfit.logs.base import Log, LogError
from rftfit.measure.alignment import estimate_clocks
from rftfit.measure.flags import Refused, remark
from rftfit.measure.lab_frame import ForceReadings, path_in_lab_frame
from rftfit.measure.ledger import RowStatus
from rftfit.measure.log_columns import complete_motion_log
from rftfit.measure.session_clocks import find_clock
from rftfit.measure.strokes import IntruderPath, find_stroke
from rftfit.measure.surface import find_surface, place_surface
from rftfit.measure.trace import _flag_gaps

NAN = float("nan")
PUSH = plate_run("a", medium="sand")
"""A row of the run sheet."""
TIME, DEPTH = np.arange(1000) / 100, np.linspace(0, 5, 1000)


def noise(seed, sd, size=1000):
    return np.random.default_rng(seed).normal(0, sd, size)


def under(cm):
    """Depth below a surface that lies at this depth."""
    return np.maximum(DEPTH - cm, 0)


def path(depth):
    """Path of an intruder that goes straight down to these depths in 10 s."""
    time = np.linspace(0, 10, depth.size)
    return IntruderPath(time, np.zeros_like(depth), -depth, np.zeros_like(depth))


def with_force(force, seed=8, depth=None, max_se_s=0.1):
    """Clocks of a push with another force, or another motion."""
    push = make_push(seed)
    changed_push = replace(
        push, force=force(push), depth=push.depth if depth is None else depth(push)
    )
    return estimate(changed_push, max_se_s=max_se_s)


def waves(push):
    """A force that rises and falls many times."""
    time = push.force_time - push.force_time[0]
    return 20 * np.abs(np.sin(3 * time)) + 0.1 * time


@pytest.mark.parametrize(
    ("measure", "codes", "values"),
    [
        (lambda: with_force(lambda push: noise(0, 0.05, push.force.size) + 3, 5), "no-rise", {}),
        (lambda: with_force(lambda push: 10 - push.force, 5), "force-falls", {}),
        (
            lambda: with_force(lambda push: push.force, 6, lambda push: 0 * push.depth),
            "no-motion-in-depth",
            {},
        ),
        # a force of another run
        (lambda: with_force(waves), "force-not-depth", {"least": 90}),
        # from the first to the last sample the arm moves at one speed: every lag is as good
        (
            lambda: estimate_clocks(
                TIME[100:900],
                50 * under(0.5)[100:900] + noise(0, 0.1, 800),
                TIME,
                DEPTH,
                1e-3,
                0.05,
            ),
            "two-offsets clocks-uncertain",
            {},
        ),
        (
            lambda: with_force(lambda push: push.force, 9, max_se_s=1e-6),
            "clocks-uncertain",
            {"most": 1e-6},
        ),
        (
            lambda: estimate_clocks(TIME[:30], DEPTH[:30], TIME, DEPTH, 1e-3, 0.1),
            "few-readings",
            {"found": 30},
        ),
        # a channel that shows one value
        (
            lambda: estimate_clocks(TIME, np.ones(1000), TIME, DEPTH, 1e-3, 0.1),
            "few-readings",
            {"found": 1},
        ),
        (
            lambda: estimate_clocks(
                TIME,
                np.where(TIME < 0.12, 0.0, 50.0 - TIME) + noise(0, 0.1),
                TIME,
                DEPTH,
                1e-3,
                0.1,
            ),
            "begins-in-push",
            {},
        ),
        # a rise that could be noise; one of 160 N above 0.07 N, but up and down on the way
        (
            lambda: find_surface(DEPTH, np.where(DEPTH > 3, 3.0, 0.0) + noise(1, 0.5), 1.5, 0.05),
            "faint-growth",
            {"window": 1.5, "times": 10},
        ),
        (
            lambda: find_surface(
                DEPTH, 25 * under(2.5) * (1 + np.sin(14 * DEPTH)) + noise(3, 0.07), 1.5, 0.07
            ),
            "uncertain-growth",
            {},
        ),
        # a cable that tightens all the way down
        (
            lambda: find_surface(DEPTH, 1.2 * DEPTH + 4 * under(3) + noise(1, 0.3), 1.5, 0.05),
            "grows-in-air",
            {},
        ),
        # a log that begins in contact, one that ends at the surface, a force of the wrong sign
        (lambda: find_surface(DEPTH, 30 * DEPTH + 10, 1.5, 0.05), "not-in-air", {}),
        (
            lambda: find_surface(DEPTH[:604], 200 * under(3)[:604], 1.5, 0.05),
            "few-near-surface",
            {},
        ),
        (lambda: find_surface(DEPTH, noise(1, 0.05) - 25 * under(3), 1.5, 0.05), "no-ground", {}),
        (
            lambda: find_surface(DEPTH[:10], np.arange(10.0), 1.5, 0.05),
            "few-on-the-way-down",
            {"found": 10},
        ),
    ],
)
def test_what_gives_no_number(measure, codes, values):
    with pytest.raises(Refused) as caught:
        measure()
    refusal = caught.value.remark
    assert refusal.code in codes.split()
    assert refusal.values | values == refusal.values


X = np.linspace(0, 5, 500)


@pytest.mark.parametrize(
    ("motion", "run", "arm", "code", "values"),
    [
        # z counted downward
        (path(np.linspace(-3.0, -15.0, 100)), {}, {}, "upside-down", {"lowest": 3}),
        (
            path(np.linspace(1.0, 5.0, 100)),
            {},
            {"drive": "uneven"},
            "surface-not-crossed",
            {"highest": -1, "lowest": -5},
        ),
        (
            path(np.append(np.linspace(5.0, 4.0, 50), np.linspace(4.0, -1.0, 50))),
            {},
            {"drive": "uneven"},
            "begins-below",
            {},
        ),
        (path(np.linspace(-1.0, 2.0, 200)), {}, {}, "too-slow", {"stated": 1, "fastest": 0.3}),
        (
            IntruderPath(2 * X, X, X - 6, 0 * X),
            {"direction": "extraction", "gamma_deg": -45.0},
            {"speed_cm_per_s": 0.7},
            "other-direction",
            {"seen": "-135.0", "way": -45},
        ),
    ],
)
def test_motions_that_hold_no_stroke(motion, run, arm, code, values):
    settings = Arm(**arm)
    with pytest.raises(Refused) as caught:
        find_stroke(motion, motion.spans(settings), replace(PUSH, **run), settings)
    refusal = caught.value.remark
    assert (refusal.code, refusal.values | values) == (code, refusal.values)


def test_a_motion_up_toward_minus_x():
    motion, arm = IntruderPath(2 * X, 3 - X, X - 6, 0 * X), Arm(speed_cm_per_s=0.7)
    run = replace(PUSH, direction="extraction", gamma_deg=-45.0)
    start, end = find_stroke(motion, motion.spans(arm), run, arm)
    assert end - start > 9


def test_a_sync_line_is_needed(paper_config):
    readings = ForceReadings(TIME, np.stack([TIME] * 2), None, TIME < 0, np.stack([TIME] * 3))
    with pytest.raises(Refused) as caught:
        find_clock(paper_config.clock, PUSH, readings, path(DEPTH), np.empty((0, 2)), None)
    assert caught.value.remark.code == "no-sync-line"


def found_surface(config, max_se_cm, beta_deg, clock_se_s, **push_options):
    """The surface as it is found from a push of the plate, of which so large an error is allowed."""
    surface = config.surface.model_copy(update={"method": "find", "max_se_cm": max_se_cm})
    config = config.model_copy(update={"surface": surface})
    run, push = replace(PUSH, beta_deg=beta_deg), make_push(2, **push_options)
    motion = IntruderPath(push.motion_time, push.depth * 0, -push.depth, push.depth * 0)
    return place_surface(config, run, motion, push.force_time, push.force, clock_se_s)[1]


@pytest.mark.parametrize(
    ("beta_deg", "code"), [(30.0, "surface-not-stated"), (0.0, "surface-uncertain")]
)
def test_a_surface_that_cannot_be_found(paper_config, beta_deg, code):
    with pytest.raises(Refused) as caught:
        found_surface(paper_config, 1e-6, beta_deg, 0.0)
    assert caught.value.remark.code == code


def test_a_pause_at_the_surface_does_not_hide_the_error_of_the_clocks(paper_config):
    """The arm goes at 1 cm/s and rests at the surface: clocks 0.1 s apart move the surface by 1 mm."""
    surface = found_surface(paper_config, 1.0, 0.0, 0.1, by_hand=False)
    assert surface is not None
    assert surface.se_cm > 0.09


def test_x_is_counted_from_the_middle_of_the_container():
    arm = Arm(middle_x_mm=400.0)
    values = {"time": [0.0, 1.0], "x": [410.0, 380.0], "z": [0.0, -10.0], "angle": [0.0, 0.0]}
    units = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}

    def log(lacking=""):
        columns = {name: np.array(readings) for name, readings in values.items() if name != lacking}
        return Log(Path("m.csv"), columns, units, 2, {})

    np.testing.assert_allclose(path_in_lab_frame(log(), PUSH, arm).x, [1.0, -2.0])
    # a path straight down that nobody logged is at the middle
    whole = complete_motion_log(log("x"), PUSH, units, 40.0)
    np.testing.assert_allclose(path_in_lab_frame(whole, PUSH, arm).x, 0.0)
    # the sheet knows beta of a plate, but no theta of a leg
    beta = complete_motion_log(log("angle"), PUSH, units).columns["angle"]
    np.testing.assert_array_equal(beta, 0.0)
    leg = replace(PUSH, kind="leg", direction="rotation", beta_deg=NAN, gamma_deg=NAN)
    with pytest.raises(LogError) as caught:
        complete_motion_log(log("angle"), leg, units)
    assert caught.value.code == "columns"


@pytest.mark.parametrize(
    ("holes", "code", "numbers"),
    [
        ([(3.0, 3.4)], "gap", [0.41]),
        ([(k, k + 0.2) for k in np.arange(1.0, 41.0)] + [(50.0, 50.6)], "gaps", [41, 9.02, 0.62]),
    ],
)
def test_many_gaps_are_one_flag(holes, code, numbers):
    time = np.arange(0, 60, 0.01)
    kept = ~np.any([(time > start) & (time < end) for start, end in holes], axis=0)
    (flag,) = _flag_gaps(time[kept], 0.1)
    assert flag.code == code
    np.testing.assert_allclose([*flag.values.values()], numbers, rtol=0.06)


def test_every_row_status_has_its_sentence():
    sentences = [str(remark(why.code)) for why in RowStatus if why != RowStatus.GOOD]
    assert len(set(sentences)) == len(RowStatus) - 1
