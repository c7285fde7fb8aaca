"""An error of the leg angle theta that all legs share is found from where their forces begin."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from coverage_levels import paper_config
from result_tables import alpha_frame, results_of
from scipy.stats import norm

from rftfit.compare.leg_angle import common_offset, offset_of_curve
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
    curves = measured.groupby(["medium", "leg"])
    return {place: offset_of_curve(curve, maps[place]) for place, curve in curves}


def test_constants_are_not_smaller_than_what_published_curves_show(published, predicted):
    of_curves = offsets(published, predicted)
    table = pd.DataFrame(
        {leg: {medium: of_curves[medium, leg] for medium in MEDIA} for leg in LEGS}
    )
    assert table.shape == (5, len(LEGS))
    of_legs = table.mean()
    assert 1.5 < of_legs.std(ddof=1) <= 2.3
    of_media = (table - of_legs).mean(axis=1)
    rest = (table - of_legs).sub(of_media, axis=0).to_numpy()
    of_rest = np.sqrt((rest**2).sum() / (4 * (len(LEGS) - 1)))
    assert of_rest == pytest.approx(1.1, abs=0.1)
    # the mean over the legs of a medium holds a part of the rest
    of_media_alone = np.sqrt(of_media.var(ddof=1) - of_rest**2 / len(LEGS))
    assert of_media_alone == pytest.approx(1.9, abs=0.1)


def test_published_curves_of_one_medium_or_of_all_show_no_error_of_theta(published, predicted):
    of_curves = offsets(published, predicted)
    assert not common_offset(of_curves).is_off
    for medium in MEDIA:
        of_medium = {place: of_curves[place] for place in of_curves if place[0] == medium}
        assert not common_offset(of_medium).is_off


def test_legs_of_one_medium_tell_less_than_as_many_curves_of_several():
    media = ["a", "b", "c"]
    in_one = common_offset({("a", leg): 1.0 for leg in LEGS})
    in_three = common_offset(dict.fromkeys(zip(media, LEGS, strict=True), 1.0))
    half_widths = [common.hi_deg - common.offset_deg for common in (in_one, in_three)]
    by_hand = [
        norm.ppf(0.975) * np.sqrt(variance)
        for variance in (1.9**2 + (2.3**2 + 1.1**2) / 3, (1.9**2 + 2.3**2 + 1.1**2) / 3)
    ]
    np.testing.assert_allclose(half_widths, by_hand)


@pytest.mark.parametrize("off_deg", [-OFF_DEG, OFF_DEG])
def test_logs_of_all_legs_with_another_zero_of_theta_are_told(published, predicted, off_deg):
    """Three legs tell 5 degrees; the peaks of sound curves are off by up to 15 all the same."""
    before = offsets(published, predicted)
    after = offsets(turned(published, off_deg), predicted)
    for place, offset in before.items():
        assert after[place] - offset == pytest.approx(off_deg, abs=0.3)
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
    assert np.isnan(
        common_offset({("poppy_LP", "c_leg"): offset_of_curve(begun, curve)}).offset_deg
    )
    assert not common_offset({}).is_off
