"""What the shape of a leg does to its predicted peaks."""

import math

import numpy as np
import pandas as pd
import pytest
from light_campaign import alpha_frame, one_cell, results_of
from turning import sweep

from rftfit.campaign.config import Leg
from rftfit.compare.legs import leg_errors, predicted_curves
from rftfit.compare.sensitivity import SENSITIVITY_COLUMNS, leg_sensitivity, shapes
from rftfit.model.outlines import arc_of, leg_outline, model_leg
from rftfit.reference import LEGS, MEDIA, alpha_grid, load


@pytest.fixture(scope="module")
def results(paper_config):
    """With few draws: no peak depends on them."""
    few = paper_config.fourier.model_copy(update={"draws": 200})
    tables = [alpha_frame(medium, alpha_grid(medium)) for medium in MEDIA]
    return results_of(tables, paper_config.model_copy(update={"fourier": few}))


@pytest.fixture(scope="module")
def errors(results):
    predicted = pd.concat(predicted_curves(medium)[0] for medium in results)
    return leg_errors(load("fig_s5"), predicted)


@pytest.fixture(scope="module")
def table(results, errors):
    return leg_sensitivity(list(results), load("fig_s5"), errors)


def leg_of(config, name):
    leg = config.intruders[name]
    assert isinstance(leg, Leg)
    return leg


@pytest.mark.parametrize("arc_deg", [120.0, 165.0, 180.0, 210.0, 270.0])
@pytest.mark.parametrize("name", ["c_leg", "reversed_c_leg"])
@pytest.mark.parametrize("lead_cm", [0.0, 0.32])
def test_a_bent_leg_is_an_arc_of_the_stated_length(paper_config, name, arc_deg, lead_cm):
    leg = leg_of(paper_config, name)
    half = math.radians(arc_deg) / 2
    radius = 3.81 / math.sin(half) if arc_deg < 180 else 3.81
    side = leg.curvature_times_R
    x, z, _, _, part = leg_outline(leg, elements=2000, arc_deg=arc_deg, lead_cm=lead_cm).body.T
    # its face lies ahead: outward of the c-leg's circle, inward of the reversed one's
    face = radius + side * lead_cm
    middle = radius * math.cos(half) * side
    tip = -2 * radius * math.sin(half)
    np.testing.assert_allclose(np.hypot(x - middle, z - tip / 2), face, rtol=1e-9)
    assert 2 * part.sum() == pytest.approx(2 * half * face)
    if not lead_cm:
        np.testing.assert_allclose([x[0], z[0]], [0, 0], atol=0.02)
        np.testing.assert_allclose([x[-1], z[-1]], [0, tip], atol=0.02)
        assert np.hypot(x, z).max() == pytest.approx(7.62, abs=5e-3)


def test_a_straight_leg_has_a_face_ahead_and_no_arc(paper_config):
    leg = leg_of(paper_config, "flat_leg")
    assert arc_of(leg) == 0
    middle, ahead = (leg_outline(leg, lead_cm=lead).body for lead in (0.0, 0.32))
    # the way that a leg sweeps: backward below the axle
    np.testing.assert_allclose(ahead - middle, np.tile([-0.32, 0, 0, 0, 0], (30, 1)), atol=1e-12)
    np.testing.assert_array_equal(leg_outline(leg, arc_deg=40).body, middle)


def test_the_stated_shape_has_the_errors_of_the_other_table(table, errors):
    assert list(table.columns) == SENSITIVITY_COLUMNS
    own = table[
        (table["arc_step_deg"] == 0) & (table["hip_step_cm"] == 0) & (table["lead_cm"] == 0)
    ]
    own = own.set_index(["medium", "leg"])
    assert len(own) == 15
    for c in "zx":
        part = errors[(errors["profile"] == "table") & (errors["component"] == c)]
        part = part.set_index(["medium", "leg"]).loc[own.index]
        np.testing.assert_allclose(own[f"peak_{c}_N"], part["peak_predicted_N"])
        np.testing.assert_allclose(own[f"peak_error_{c}_percent"], part["peak_error_percent"])
    assert len(table) == 5 * (2 * 4 + 1) * 3 * 2


def test_a_lower_hip_and_more_arc_press_harder(table):
    names = ["medium", "leg", "arc_deg", "lead_cm"]
    by_hip = table.pivot_table(index=names, columns="hip_height_cm", values="peak_z_N")
    assert (np.diff(by_hip.to_numpy(), axis=1) < 0).all()
    bent = table[table["leg"] == "reversed_c_leg"]
    names = ["medium", "hip_height_cm", "lead_cm"]
    by_arc = bent.pivot_table(index=names, columns="arc_deg", values="peak_z_N")
    assert (np.diff(by_arc.to_numpy(), axis=1) > 0).all()


def test_what_the_reversed_leg_hangs_on(table):
    """Beside figures of a review by other hands: 165, 180 and 210 deg, and the leading face."""
    found = {one.name: one for one in shapes(table)}
    assert {name: one.lifts for name, one in found.items()} == {
        "arc of 180 deg": 10, "arc of 165 deg": 13, "arc of 195 deg": 9, "arc of 210 deg": 8,
        "arc of 180 deg, face ahead": 11, "arc of 165 deg, face ahead": 14,
        "arc of 195 deg, face ahead": 9, "arc of 210 deg, face ahead": 8,
        "hip 2 mm lower": 9, "hip 2 mm higher": 8,
    }  # fmt: skip
    assert {one.of for one in found.values()} == {15}
    first = next(iter(found.values()))
    assert (first.name, first.thrusts) == ("arc of 180 deg", 14)
    assert first.worst == pytest.approx(101, abs=1)
    bent = table[
        (table["leg"] == "reversed_c_leg") & (table["hip_step_cm"] == 0) & (table["lead_cm"] == 0)
    ]
    for arc_deg, ends in ((180, (28, 101)), (165, (-17, 47)), (210, (281, 393))):
        off = bent.loc[bent["arc_deg"].round(3) == arc_deg, "peak_error_z_percent"]
        assert (off.min(), off.max()) == pytest.approx(ends, abs=10)


def test_without_a_measured_leg_there_is_nothing_to_sum_up(results, errors):
    lost = errors.assign(peak_measured_N=np.nan)
    table = leg_sensitivity([results["poppy_LP"]], load("fig_s5")[:0], lost)
    assert table["peak_z_N"].notna().all()
    assert table["peak_error_z_percent"].isna().all()
    assert shapes(table) == []


def summed_up(rows):
    """What `shapes` says of rows: leg, arc, its step, that of the hip, lead, errors of z and x."""
    names = ["leg", "arc_deg", "arc_step_deg", "hip_step_cm", "lead_cm", "peak_error_z_percent",
             "peak_error_x_percent"]  # fmt: skip
    found = shapes(pd.DataFrame(rows, columns=names).assign(profile="table"))
    return [f"{one.name}: {one.lifts} of {one.of} lifts (worst {one.worst:+.0f} %), {one.thrusts} thrusts"
            for one in found]  # fmt: skip


def test_peaks_within_a_third_are_counted_by_hand():
    """33 % is within, 33.1 % is not; the worst lift keeps its sign; the straight leg is in every arc."""
    rows = [
        ("c_leg", 180.0, 0, 0.0, 0.0, 33.0, -33.1), ("c_leg", 180.0, 0, 0.0, 0.3, 1.0, 2.0),
        ("c_leg", 195.0, 15, 0.0, 0.0, -33.0, 99.0), ("flat_leg", 0.0, 0, 0.0, 0.0, -50.0, 0.0),
        ("c_leg", 180.0, 0, 0.2, 0.0, 40.0, 3.0), ("c_leg", 180.0, 0, -0.2, 0.0, 4.0, 50.0),
    ]  # fmt: skip
    assert summed_up(rows) == [
        "arc of 180 deg: 1 of 2 lifts (worst -50 %), 1 thrusts",
        "arc of 195 deg: 1 of 2 lifts (worst -50 %), 1 thrusts",
        "arc of 180 deg, face ahead: 1 of 1 lifts (worst +1 %), 1 thrusts",
        "hip 2 mm lower: 1 of 1 lifts (worst +4 %), 0 thrusts",
        "hip 2 mm higher: 0 of 1 lifts (worst +40 %), 1 thrusts",
    ]


def test_legs_of_different_arcs_are_told_by_the_step():
    rows = [
        (leg, arc + step, step, 0.0, 0.0, 5.0, 5.0)
        for leg, arc in (("long", 180.0), ("short", 150.0))
        for step in (0, -15)
    ]
    assert [one.partition(":")[0] for one in summed_up(rows)] == ["arcs +0 deg", "arcs -15 deg"]
    nearly = [(leg, arc, 0, 0.0, 0.0, 5.0, 5.0) for leg, arc in (("a", 150.02), ("b", 149.98))]
    assert summed_up(nearly) == ["arc of 150 deg: 2 of 2 lifts (worst +5 %), 2 thrusts"]


def test_a_natural_sand_is_not_summed_up(table):
    sand = table.assign(profile="generic", peak_error_z_percent=99.0)
    assert shapes(pd.concat([table, sand])) == shapes(table)
    assert shapes(sand) == []


def without_cell(medium):
    """Its published alpha, with no run of a level plate that moves level."""
    z, x = (np.array(grid) for grid in alpha_grid(medium))
    z[3, 6] = x[3, 6] = np.nan
    return alpha_frame(medium, (z, x))


def test_a_missing_cell_takes_the_peaks_of_the_legs_that_meet_it(paper_config, errors):
    """The lowest part of a bent leg is level and moves level."""
    media = list(results_of([without_cell("poppy_LP")], paper_config))
    others = errors[errors["leg"] != "flat_leg"]
    found = leg_sensitivity(media, load("fig_s5"), others)
    assert set(found["leg"]) == set(LEGS)
    known = found["peak_z_N"].notna()
    np.testing.assert_array_equal(known, found["leg"] == "flat_leg")
    # no peak of the flat leg was compared
    assert found["peak_error_z_percent"].isna().all()


def test_a_natural_sand_is_predicted_by_its_scaled_generic_profile(paper_config):
    """A sand twice as stiff has twice the peaks; one without a test has none."""
    stiff = {"yuma": 1.0, "palms29": 0.5, "palms29_sieved": np.nan}
    tables = [alpha_frame(name, one_cell(alpha)) for name, alpha in stiff.items()]
    media = results_of(tables, paper_config)
    names = [(name, leg, "generic", c) for name in stiff for leg in LEGS for c in "zx"]
    measured = pd.DataFrame(names, columns=["medium", "leg", "profile", "component"])
    found = leg_sensitivity(list(media), load("fig_s12")[:0], measured.assign(peak_measured_N=2.0))
    assert set(found["profile"]) == {"generic"}
    peaks = {name: part["peak_z_N"].to_numpy() for name, part in found.groupby("medium")}
    assert set(peaks) == {"yuma", "palms29"}
    np.testing.assert_allclose(peaks["yuma"], 2 * peaks["palms29"])
    np.testing.assert_allclose(found["peak_error_z_percent"], 50 * found["peak_z_N"] - 100)
    first = found[(found["medium"] == "yuma") & (found["leg"] == "c_leg")].iloc[0]
    stated = sweep(media["yuma"].profile("generic"), model_leg("c_leg"))
    assert first["peak_z_N"] == pytest.approx(stated.force_z_N.max(), rel=1e-6)
