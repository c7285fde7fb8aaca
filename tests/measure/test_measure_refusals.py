"""Data that allow no number are refused with the code of their cause, tested once for each code.

The codes of units are tested in test_measure_units.py, those of a compliance in test_measure_compliance.py.
"""

from dataclasses import replace

import numpy as np
import pytest
from makers import MadePush
from pushes import estimate, make_push, plate_run

from rftfit.campaign.config import Arm
from rftfit.measure.alignment import estimate_clocks
from rftfit.measure.flags import Refused, remark
from rftfit.measure.ledger import RowStatus
from rftfit.measure.strokes import IntruderPath, find_stroke
from rftfit.measure.surface import find_surface, place_surface

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


def clocks_of(force, time=TIME):
    """Clocks of readings of a push at one speed from the first to the last sample of the motion."""
    return estimate_clocks(time, force, TIME, DEPTH, 1e-3, 0.1)


def surface_of(force, depth=DEPTH, precision_N=0.05):
    return find_surface(depth, force, 1.5, precision_N)


@pytest.mark.parametrize(
    ("measure", "code", "values"),
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
        # the arm moves at one speed: every lag is as good
        (
            lambda: clocks_of(50 * under(0.5)[100:900] + noise(0, 0.1, 800), TIME[100:900]),
            "two-offsets",
            {},
        ),
        (
            lambda: with_force(lambda push: push.force, 9, max_se_s=1e-6),
            "clocks-uncertain",
            {"most": 1e-6},
        ),
        (lambda: clocks_of(DEPTH[:30], TIME[:30]), "few-readings", {"found": 30}),
        # a channel that shows one value
        (lambda: clocks_of(np.ones(1000)), "few-readings", {"found": 1}),
        (
            lambda: clocks_of(np.where(TIME < 0.12, 0.0, 50.0 - TIME) + noise(0, 0.1)),
            "begins-in-push",
            {},
        ),
        # a rise that could be noise; one of 160 N above 0.07 N, but up and down on the way
        (
            lambda: surface_of(np.where(DEPTH > 3, 3.0, 0.0) + noise(1, 0.5)),
            "faint-growth",
            {"window": 1.5, "times": 10},
        ),
        (
            lambda: surface_of(
                25 * under(2.5) * (1 + np.sin(14 * DEPTH)) + noise(3, 0.07), precision_N=0.07
            ),
            "uncertain-growth",
            {},
        ),
        # a cable that tightens all the way down
        (lambda: surface_of(1.2 * DEPTH + 4 * under(3) + noise(1, 0.3)), "grows-in-air", {}),
        # a log that begins in contact, one that ends at the surface, a force of the wrong sign
        (lambda: surface_of(30 * DEPTH + 10), "not-in-air", {}),
        (lambda: surface_of(200 * under(3)[:604], DEPTH[:604]), "few-near-surface", {}),
        (lambda: surface_of(noise(1, 0.05) - 25 * under(3)), "no-ground", {}),
        (lambda: surface_of(np.arange(10.0), DEPTH[:10]), "few-on-the-way-down", {"found": 10}),
    ],
)
def test_what_gives_no_number(measure, code, values):
    with pytest.raises(Refused) as caught:
        measure()
    refusal = caught.value.remark
    assert refusal.code == code
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


@pytest.mark.parametrize(
    ("holes", "code", "numbers"),
    [
        ([(200, 208)], "gap", [0.45]),
        ([*((row, row + 4) for row in range(150, 320, 10)), (325, 337)], "gaps", [18, 4.9, 0.65]),
    ],
)
def test_many_gaps_are_one_flag(measure_push, holes, code, numbers):
    """Of 20 readings a second in the stroke, whose log holds force and motion."""
    lost = [row for first, stop in holes for row in range(first, stop)]
    flags = measure_push(MadePush(faults={"lost": lost})).flags.of_run("p")
    of_gaps = [flag for flag in flags if "gap" in flag.code]
    assert {flag.code for flag in of_gaps} == {code}
    for flag in of_gaps:
        assert [*flag.values.values()][-len(numbers) :] == pytest.approx(numbers, rel=0.02)


def test_every_row_status_has_its_sentence():
    sentences = [str(remark(why.code)) for why in RowStatus if why != RowStatus.GOOD]
    assert len(set(sentences)) == len(RowStatus) - 1
