"""An error of the leg angle theta that all legs share is found from where their forces begin."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from paper import few_draws
from scipy.stats import norm

import rftfit
from rftfit.compare.legs import leg_errors

OFF_DEG = 5.0
"""Error of theta that the logs of all legs have."""
MEDIA = rftfit.published_reference().media
LEGS = ("c_leg", "flat_leg", "reversed_c_leg")


@pytest.fixture(scope="module")
def predicted():
    """Curves of the published media by their maps, each a table, by medium and leg."""
    table = rftfit.published_table("table_s5")
    curves = []
    with few_draws():
        for medium in MEDIA:
            profile = rftfit.estimate_map(table[table["medium"] == medium]).profile
            for leg in LEGS:
                forces = rftfit.predict(profile, rftfit.model_leg(leg))
                curves.append(forces.assign(medium=medium, leg=leg, profile="map"))
    return pd.concat(curves)


@pytest.fixture(scope="module")
def published():
    """Measured curves of the laboratory media, Fig. S5."""
    return rftfit.published_table("fig_s5")


@pytest.fixture
def curve(predicted):
    """Of one leg in one medium."""
    return predicted.query("medium == 'poppy_LP' and leg == 'c_leg'")


def turned(curves, degrees):
    return curves.assign(theta_deg=curves["theta_deg"] + degrees)


def offsets_of(measured, predicted):
    """Offset of each curve, media by legs, and the common error of theta: value and ends."""
    table = leg_errors(measured, predicted).query("component == 'z'")
    common = table[[f"theta_error{end}_deg" for end in ("", "_lo", "_hi")]].iloc[0]
    return table.pivot_table("theta_offset_deg", "medium", "leg", dropna=False), common


def test_constants_are_not_smaller_than_what_published_curves_show(published, predicted):
    table, _ = offsets_of(published, predicted)
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
    for media in (MEDIA, *([medium] for medium in MEDIA)):
        _, (_, lo, hi) = offsets_of(published[published["medium"].isin(media)], predicted)
        assert lo < 0 < hi


def test_legs_of_one_medium_tell_less_than_as_many_curves_of_several(published, predicted):
    in_one = published["medium"] == MEDIA[0]
    in_three = (published["medium"] + published["leg"]).isin(
        [medium + leg for medium, leg in zip(MEDIA, LEGS, strict=False)]
    )
    half_widths = []
    for is_measured in (in_one, in_three):
        _, (_, lo, hi) = offsets_of(published[is_measured], predicted)
        half_widths.append((hi - lo) / 2)
    by_hand = [
        norm.ppf(0.975) * np.sqrt(variance)
        for variance in (1.9**2 + (2.3**2 + 1.1**2) / 3, (1.9**2 + 2.3**2 + 1.1**2) / 3)
    ]
    np.testing.assert_allclose(half_widths, by_hand)


@pytest.mark.parametrize("off_deg", [-OFF_DEG, OFF_DEG])
def test_logs_of_all_legs_with_another_zero_of_theta_are_told(published, predicted, off_deg):
    """Three legs tell 5 degrees; the peaks of sound curves are off by up to 15 all the same."""
    before, _ = offsets_of(published, predicted)
    after, (_, lo, hi) = offsets_of(turned(published, off_deg), predicted)
    np.testing.assert_allclose(after - before, off_deg, atol=0.3)
    assert lo < off_deg < hi
    assert lo > 0 or hi < 0


def test_size_of_the_force_does_not_move_the_beginning(curve):
    random = np.random.default_rng(4)
    forces = ["force_z_N", "force_x_N"]
    for factor in (0.3, 1.0, 2.0):
        noisy = turned(curve, 3.0)
        noisy[forces] = factor * noisy[forces] + random.normal(0, 0.02, (len(curve), 2))
        table, _ = offsets_of(noisy, curve)
        assert table.loc["poppy_LP", "c_leg"] == pytest.approx(3.0, abs=0.7)


@pytest.mark.parametrize("first_deg", [-115.0, -60.0])
def test_a_curve_that_begins_under_load_tells_nothing(curve, first_deg):
    table, common = offsets_of(curve[curve["theta_deg"] >= first_deg], curve)
    assert table.isna().all(axis=None)
    assert common.isna().all()
