"""An error of the leg angle theta that all legs share is found from where their forces begin."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from coverage_levels import paper_config
from result_tables import alpha_frame, results_of

from rftfit.compare.leg_angle import (
    BETWEEN_CURVES_DEG,
    BETWEEN_LEGS_DEG,
    common_offset,
    offset_of_curve,
)
from rftfit.compare.legs import leg_errors, leg_prediction
from rftfit.reference import LEGS, MEDIA, alpha_grid, load

OFF_DEG = 5.0
"""Error of theta that the logs of all legs have."""


@pytest.fixture(scope="module")
def predicted():
    """Curves of the published media by their maps, each a table, by medium and leg."""
    config = paper_config(200)
    tables = [alpha_frame(medium, np.stack(alpha_grid(medium))) for medium in MEDIA]
    curves = []
    for medium in results_of(tables, config):
        profile = medium.profile("map", draws=False)
        for name, leg in config.legs.items():
            curve, _ = leg_prediction(profile, leg, config)
            curves.append(curve.assign(medium=medium.name, leg=name, profile="map"))
    return pd.concat(curves)


@pytest.fixture(scope="module")
def published():
    """Measured curves of the laboratory media, Fig. S5."""
    return load("fig_s5")


@pytest.fixture
def curve(predicted):
    """Of one leg in one medium."""
    return predicted.query("medium == 'poppy_LP' and leg == 'c_leg'").dropna(subset=["force_z_N"])


def turned(curves, degrees):
    return curves.assign(theta_deg=curves["theta_deg"] + degrees)


def offsets(measured, predicted):
    maps = dict(iter(predicted.groupby(["medium", "leg"])))
    by_leg: dict[str, list[float]] = {}
    for (medium, leg), curve in measured.groupby(["medium", "leg"]):
        by_leg.setdefault(leg, []).append(offset_of_curve(curve, maps[medium, leg]))
    return by_leg


def test_constants_are_not_smaller_than_what_published_curves_show(published, predicted):
    by_leg = offsets(published, predicted)
    assert {leg: len(curves) for leg, curves in by_leg.items()} == dict.fromkeys(LEGS, 5)
    within = np.sqrt(np.mean([np.var(curves, ddof=1) for curves in by_leg.values()]))
    assert within == pytest.approx(BETWEEN_CURVES_DEG, abs=0.3)
    means = np.array([np.mean(curves) for curves in by_leg.values()])
    assert 1.5 < means.std(ddof=1) <= BETWEEN_LEGS_DEG
    assert not common_offset(by_leg).is_off


@pytest.mark.parametrize("off_deg", [-OFF_DEG, OFF_DEG])
def test_logs_of_all_legs_with_another_zero_of_theta_are_told(published, predicted, off_deg):
    """Three legs tell 5 degrees; the peaks of sound curves are off by up to 15 all the same."""
    before = offsets(published, predicted)
    after = offsets(turned(published, off_deg), predicted)
    for leg, curves in before.items():
        np.testing.assert_allclose(np.array(after[leg]) - curves, off_deg, atol=0.3)
    assert not common_offset(before).is_off
    common = common_offset(after)
    assert common.is_off
    assert common.lo_deg < off_deg < common.hi_deg
    table = leg_errors(turned(published, off_deg), predicted)
    (in_table,) = table["theta_error_deg"].unique()
    assert in_table == pytest.approx(common.offset_deg)


def test_size_of_the_force_does_not_move_the_beginning(curve):
    random = np.random.default_rng(4)
    forces = ["force_z_N", "force_x_N"]
    for factor in (0.3, 1.0, 2.0):
        noisy = turned(curve, 3.0)
        noisy[forces] = factor * noisy[forces] + random.normal(0, 0.02, (len(curve), 2))
        assert offset_of_curve(noisy, curve) == pytest.approx(3.0, abs=0.7)


@pytest.mark.parametrize("first_deg", [-115.0, -60.0])
def test_a_curve_that_begins_under_load_tells_nothing(curve, first_deg):
    begun = curve[curve["theta_deg"] >= first_deg]
    assert np.isnan(offset_of_curve(begun, curve))
    assert np.isnan(common_offset({"c_leg": [offset_of_curve(begun, curve)]}).offset_deg)
    assert not common_offset({}).is_off
