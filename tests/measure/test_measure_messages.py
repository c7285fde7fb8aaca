"""Why a run gives no number: each reason once, from logs that deserve it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pushes import make_push

from rftfit.campaign.sheet import Run
from rftfit.measure.alignment import estimate_clocks
from rftfit.measure.clocks import ClockError
from rftfit.measure.ingest import ForceReadings, find_clock, place_surface
from rftfit.measure.ledger import RowStatus
from rftfit.measure.strokes import Motion, StrokeError, find_stroke
from rftfit.measure.surface import ComplianceError, SurfaceError, compliance_of, find_surface

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.conventions import FloatArray

NAN = float("nan")
PUSH = Run(
    "a", "plate", "sand", "plate", "intrusion", 0.0, 90.0, NAN, "a.csv", "b.csv",
    "", False, None, False, "", "", 2,
)  # fmt: skip


def path(depth: FloatArray) -> Motion:
    time = np.linspace(0, 10, depth.size)
    return Motion(time, np.zeros_like(depth), -depth, np.zeros_like(depth))


def changed(config: Config, section: str, **values: Any) -> Config:
    part = getattr(config, section).model_copy(update=values)
    return config.model_copy(update={section: part})


def test_a_log_that_begins_at_the_end_of_the_push() -> None:
    time = np.arange(0, 10, 0.01)
    force = np.where(time < 0.12, 0.0, 50.0 - time) + np.random.default_rng(0).normal(0, 0.1, 1000)
    with pytest.raises(
        ClockError, match=r"largest at reading \d+ already; \d+ are needed before it"
    ):
        estimate_clocks(time, force, time, np.linspace(0, 5, 1000), 1e-3, 0.1)


def test_a_rigid_push_with_few_readings_in_contact() -> None:
    force = np.concatenate([np.zeros(200), np.linspace(10, 200, 8)])
    with pytest.raises(ComplianceError, match="8 readings in contact are too few; "):
        compliance_of(np.linspace(0, 1, 208), force, 0.05)


def test_a_sync_line_is_needed(paper_config: Config) -> None:
    time, depth = np.linspace(0, 10, 200), np.linspace(-2, 5, 200)
    config = changed(paper_config, "clock", method="sync_line")
    readings = ForceReadings(time, np.stack([time, time]), None, np.zeros(200, dtype=bool))
    with pytest.raises(ClockError, match=r"the force log has no column arm_moving; clock.method"):
        find_clock(config, PUSH, readings, path(depth), np.empty((0, 2)))


def test_a_surface_that_cannot_be_found(paper_config: Config) -> None:
    name = next(name for name, one in paper_config.intruders.items() if one.shape == "plate")
    config = changed(paper_config, "surface", method="find", max_se_cm=1e-6)
    run = replace(PUSH, intruder=name)
    tilted = replace(run, beta_deg=30.0)
    push = make_push(2)
    motion = Motion(push.motion_time, push.depth * 0, -push.depth, push.depth * 0)
    with pytest.raises(StrokeError, match=r"surface.method find works for flat plates pushed down"):
        place_surface(config, tilted, motion, push.force_time, push.force, 0.0)
    with pytest.raises(StrokeError, match=r"surface not found well enough: .* allowed: 1e-06 cm"):
        place_surface(config, run, motion, push.force_time, push.force, 0.0)


def test_a_path_that_does_not_cross_the_surface(paper_config: Config) -> None:
    config = changed(paper_config, "arm", drive="uneven")
    below = path(np.linspace(1.0, 5.0, 100))
    with pytest.raises(StrokeError, match=r"from -1.00 to -5.00 cm") as caught:
        find_stroke(below, np.empty((0, 2)), PUSH, config.arm)
    assert caught.value.code == "surface_not_reached"
    back = path(np.concatenate([np.linspace(5.0, 4.0, 50), np.linspace(4.0, -1.0, 50)]))
    with pytest.raises(StrokeError) as caught:
        find_stroke(back, np.empty((0, 2)), PUSH, config.arm)
    assert caught.value.code == "wrong_path"


def test_a_rise_that_could_be_noise() -> None:
    depth = np.linspace(0, 5, 1000)
    force = np.where(depth > 3, 3.0, 0.0) + np.random.default_rng(1).normal(0, 0.5, 1000)
    with pytest.raises(
        SurfaceError, match=r"within 1.5 cm, which its noise of .* could do as well"
    ):
        find_surface(depth, force, 1.5, 0.05)


def test_a_force_that_grows_in_air_too() -> None:
    # a cable that tightens all the way down
    depth = np.linspace(0, 5, 1000)
    force = 1.2 * depth + 4.0 * np.maximum(depth - 3, 0)
    force += np.random.default_rng(1).normal(0, 0.3, 1000)
    with pytest.raises(
        SurfaceError, match=r"the force grows too, by .*; the log must begin in air"
    ):
        find_surface(depth, force, 1.5, 0.05)


def test_reasons_of_rows() -> None:
    # the words of the ledger, which people search for and quote
    assert {why.name: why.text for why in RowStatus} == {
        "GOOD": "",
        "MOTION_GAP": "gap in the motion log",
        "NO_MOTION": "outside the motion log",
        "SATURATED": "transducer saturated",
        "NO_TARE": "outside the tare's range",
        "APPROACH": "approach",
        "PAUSE": "pause at the surface",
        "ELSEWHERE": "before or after the stroke",
        "ABOVE": "outside the window: plate not wholly submerged",
        "BOTTOM": "outside the window: too near the bottom",
        "TOO_DEEP": "outside the window: deeper than fit.max_depth_cm of the config",
        "TOO_SHALLOW": "outside the window: above fit.submergence_cm of the config",
        "WALL": "outside the window: too near a wall",
        "STARTUP": "outside the window: start of the stroke, force still building up",
        "NONLINEAR": "outside the window: beyond the linear regime",
        "YIELDED": "force beyond that of the push against something rigid: depth not known",
    }
