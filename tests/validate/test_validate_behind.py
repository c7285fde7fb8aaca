"""Errors and flagged cells have the right shares in the predicted peaks of forces on legs."""

from typing import Any

import numpy as np
import pytest
from coverage_levels import sweep
from result_tables import alpha_frame, results_of

from rftfit.compare.legs import errors_of_peaks, extreme, shape_errors
from rftfit.forces.outlines import leg_outline, model_leg
from rftfit.measure.alpha import column
from rftfit.model.profiles import TableProfile
from rftfit.reference import GAMMA_DEG, LEGS, alpha_grid

MEDIUM = "poppy_LP"
PROFILE = TableProfile.published(MEDIUM)


@pytest.fixture(scope="module")
def table():
    return alpha_frame(MEDIUM, alpha_grid(MEDIUM))


def with_errors(config, **errors):
    return config.model_copy(update={"errors": config.errors.model_copy(update=errors)})


def medium_of(table, config):
    return results_of([table], config)[str(table["medium"].iloc[0])]


def shares(shares_text):
    """Percent by the name of the error."""
    pairs = (share.removesuffix(" %").rsplit(" ", 1) for share in shares_text.split(", "))
    return {name: float(percent) for name, percent in pairs}


def alphas(table, end=""):
    """Columns of alpha and its errors."""
    names = [str(name) for name in table]
    return [name for name in names if name.startswith("alpha_") and name.endswith(end)]


def exact(table):
    """The same alpha with errors that are next to nothing."""
    table = table.copy()
    for c in "zx":
        for source in ("_se", "_noise"):
            table[column(c, source)] = 1e-9
        for end, sign in (("_lo", -1), ("_hi", 1)):
            table[column(c, end)] = table[column(c)] + sign * 1.96e-9
    return table


def test_noise_is_all_there_is_where_the_legs_are_exact(table, paper_config):
    peak_errors = errors_of_peaks(
        medium_of(table, with_errors(paper_config, hip_cm=0, arc_percent=0))
    )
    assert set(peak_errors) == {(leg, c) for leg in LEGS for c in "zx"}
    assert {share for share, _ in peak_errors.values()} == {"noise 100 %"}
    assert [percent for _, percent in peak_errors.values()] == pytest.approx([0.0] * 6)


def test_hip_and_arc_share_the_variance_that_exact_cells_leave(table, paper_config):
    """The flat leg has no arc; the shares of the others are those of a leg turned anew."""
    config = with_errors(paper_config, hip_cm=0.05, arc_percent=2.0)
    peak_errors = errors_of_peaks(medium_of(exact(table), config))
    assert {peak_errors["flat_leg", c][0] for c in "zx"} == {"hip 100 %"}
    for name in ("c_leg", "reversed_c_leg"):
        leg: Any = config.intruders[name]
        forces = [
            sweep(PROFILE, outline, hip_height_cm=hip)
            for outline, hip in (
                (model_leg(name), 2.0),
                (model_leg(name), 2.05),
                (leg_outline(leg, arc_deg=183.6), 2.0),
            )
        ]
        for c in "zx":
            plain, hip, arc = (getattr(force, f"force_{c}_N") for force in forces)
            row = extreme(plain, c)
            of_hip, of_arc = ((moved - plain)[row] ** 2 for moved in (hip, arc))
            expected = {"hip": of_hip, "arc": of_arc}
            for error, percent in shares(peak_errors[name, c][0]).items():
                assert percent == pytest.approx(100 * expected[error] / (of_hip + of_arc), abs=0.51)


def test_the_surface_of_the_plates_moves_the_axle_too(paper_config):
    """Hip and surface errors of 0.03 and 0.4, 1.2 mm are one of 1.3 mm."""
    leg: Any = paper_config.intruders["c_leg"]
    plain = sweep(PROFILE, model_leg("c_leg"))
    best = {"z": plain.force_z_N, "x": plain.force_x_N}
    apart = {"hip_cm": 0.03, "surface_run_mm": 0.4, "surface_session_mm": 1.2}
    changes = shape_errors(PROFILE, leg, with_errors(paper_config, **apart), best)
    raised = sweep(PROFILE, model_leg("c_leg"), hip_height_cm=2.13)
    np.testing.assert_allclose(changes["hip"]["z"], raised.force_z_N - best["z"], atol=1e-9)
    np.testing.assert_allclose(changes["hip"]["x"], raised.force_x_N - best["x"], atol=1e-9)


def flagged(table, where):
    return table.assign(flagged=where)


def test_the_part_from_flagged_cells_is_that_of_the_lift_and_not_of_a_larger_suction(paper_config):
    """Without the cells that are flagged, the lift of the flat leg is that of the others alone."""
    z, x = alpha_grid(MEDIUM)
    z = np.where(GAMMA_DEG < 0, 30 * z, z)
    table = alpha_frame(MEDIUM, (z, x))
    some = (table["beta_deg"] >= 0) & (table["gamma_deg"] > 0)
    peak_errors = errors_of_peaks(medium_of(flagged(table, some), paper_config))
    bare = [np.where(some, 0, grid.ravel()).reshape(7, 13) for grid in (z, x)]
    whole, unflagged = (
        sweep(TableProfile(up, along), model_leg("flat_leg")).force_z_N
        for up, along in ((z, x), bare)
    )
    row = int(whole.argmax())
    assert whole.min() < -whole[row] < -1
    assert peak_errors["flat_leg", "z"][1] == pytest.approx(100 * (1 - unflagged[row] / whole[row]))


def test_only_the_legs_that_meet_an_empty_cell_are_left_out(table, paper_config):
    """The lowest part of a bent leg is level as it moves level, no part of a flat leg ever is."""
    empty = (table["beta_deg"] == 0) & (table["gamma_deg"] == 0)
    lacking = table.copy()
    lacking.loc[empty, alphas(table)] = np.nan
    whole = errors_of_peaks(medium_of(table, paper_config))
    peak_errors = errors_of_peaks(medium_of(lacking, paper_config))
    assert {leg for leg, _ in whole} == set(LEGS)
    assert set(peak_errors) == {("flat_leg", "z"), ("flat_leg", "x")}
    assert shares(peak_errors["flat_leg", "z"][0]).keys() == {"hip", "noise"}


def test_a_table_without_errors_and_a_sand_tell_nothing(table, paper_config):
    silent, nothing = table.copy(), table.copy()
    silent[alphas(table, "_hi_N_per_cm3")] = np.nan
    nothing[alphas(table)] = np.nan
    for table_of_medium in (silent, nothing, table.assign(medium="yuma")):
        assert errors_of_peaks(medium_of(table_of_medium, paper_config)) == {}
