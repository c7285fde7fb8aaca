"""The error of the model has its stated size and correlation and widens every interval of force.

Model error: what resistive force theory itself gets wrong, beside the errors of alpha.
"""

import numpy as np
import pandas as pd
import pytest

import rftfit
from rftfit import find_peaks
from rftfit.forces import model_error as errors

POPPY = rftfit.TableProfile.published("poppy_LP")
LEG = rftfit.model_leg("reversed_c_leg")
TURN = rftfit.rotation()
ONE_PUSH = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.35]})
"""Straight down."""


def ends_of(table, quantity, interval):
    """Lower and upper end of an interval, ``model`` or ``next``, of a force or moment in each pose."""
    what, unit = quantity.split("_N")
    return [table[f"{what}_{interval}_{end}_N{unit}"].to_numpy() for end in ("lo", "hi")]


def paths(progress, count=4000, step=10**6):
    return np.concatenate([*errors.error_paths(np.asarray(progress), count, 1, step)], axis=-1)[
        :, 0
    ]


def test_the_process_has_variance_one_and_the_correlation_of_matern():
    g = paths([0.0, 0.25, 1.0, 3.0], 20_000)
    np.testing.assert_allclose(g.std(axis=0), 1, atol=0.03)
    np.testing.assert_allclose(g.mean(axis=0), 0, atol=1e-12)
    for place_of, distance in ((1, 0.25), (2, 1.0), (3, 3.0)):
        expected = (1 + np.sqrt(3) * distance) * np.exp(-np.sqrt(3) * distance)
        assert np.corrcoef(g[:, 0], g[:, place_of])[0, 1] == pytest.approx(expected, abs=0.02)


def test_the_correlation_hangs_on_the_way_and_not_on_the_number_of_poses():
    fine = paths(np.linspace(0, 1, 101), 20_000)
    expected = (1 + np.sqrt(3)) * np.exp(-np.sqrt(3))
    assert np.corrcoef(fine[:, 0], fine[:, -1])[0, 1] == pytest.approx(expected, abs=0.02)
    np.testing.assert_array_equal(
        paths(np.linspace(0, 1, 101)), paths(np.linspace(0, 1, 101), step=7)
    )
    still = paths([0.0, 0.0, 1.0])
    np.testing.assert_array_equal(still[:, 0], still[:, 1])


def test_a_length_is_30_degrees_of_turn_or_half_a_body():
    assert errors.outline_progress(LEG, rftfit.rotation([0, 30, 90]).poses) == pytest.approx(
        [0, 1, 3]
    )
    plate = rftfit.polyline([(-4, 0), (4, 0)], 5.0)
    down = rftfit.path([0, 1, 2], [0, 0, 0], [0, -4, -10], [0, 0, 0])
    assert errors.outline_progress(plate, down.poses) == pytest.approx([0, 1, 2.5], rel=0.01)
    mesh = rftfit.Mesh.extrude(rftfit.polyline([(-4, 0), (4, 0)], 3.0))
    moved = rftfit.Motion3D.path([0, 1, 2], [[0, 0, 0]] * 3, [[0, 0, 0], [0, 30, 0], [0, 90, 0]])
    assert errors.frames_progress(mesh.vertices_cm, moved.frames) == pytest.approx([0, 1, 3])


def bare_loads():
    """Load without cancellation in each pose, element by element."""
    parts = [rftfit.Outline(LEG.body[k : k + 1], LEG.width_cm) for k in range(len(LEG.body))]
    forces = [rftfit.predict(POPPY, part, TURN, model_error=0) for part in parts]
    load_z, load_x = (
        np.sum([np.abs(table[name]) for table in forces], axis=0)
        for name in ("force_z_N", "force_x_N")
    )
    return np.hypot(load_z, load_x)


def test_the_error_is_eps_times_the_load_without_cancellation():
    table = rftfit.predict(POPPY, LEG, TURN)
    loads = bare_loads()
    expected = 1.96 * 0.28 * np.hypot(loads, 0.2 * loads.max()) * (loads > 0)
    for name in ("force_z_N", "force_x_N"):
        lo, hi = ends_of(table, name, "model")
        np.testing.assert_allclose((hi - lo) / 2, expected, rtol=0.02, atol=1e-12)
        np.testing.assert_allclose((hi + lo) / 2, table[name], atol=1e-9)


def test_the_next_bed_is_looser_or_denser_as_a_whole():
    profile = rftfit.estimate_map(ONE_PUSH).profile
    profile.bed_spread = 0.1
    table, peaks = rftfit.predict(profile, LEG), find_peaks(profile, LEG)
    for name in ("force_z_N", "force_x_N"):
        value, (lo, hi) = table[name].to_numpy(), ends_of(table, name, "model")
        low, high = ends_of(table, name, "next")
        np.testing.assert_allclose(high, value + np.hypot(hi - value, 0.196 * value), rtol=1e-3)
        np.testing.assert_allclose(
            low, value - np.hypot(lo - value, 0.196 * value), rtol=1e-3, atol=1e-9
        )
    for peak in peaks:
        assert peak.model_lo < peak.value < peak.model_hi
        for of_bed, of_mean in ((peak.next_lo, peak.model_lo), (peak.next_hi, peak.model_hi)):
            # an end at 0 stays there: the greatest force of one sign is none of the other one
            wider = abs(of_bed - peak.value) > abs(of_mean - peak.value)
            assert wider or of_bed == of_mean == 0
    assert sum(0 not in (peak.model_lo, peak.model_hi) for peak in peaks) >= 2


def test_a_moment_errs_as_the_forces_at_the_centre_of_the_load():
    """A small plate at the end of a long arm: its moment is its force times the arm."""
    blade = rftfit.polyline([(9.99, 0), (10.01, 0)], 2.0)
    down = rftfit.path([0, 1, 2], [0, 0, 0], [-1, -2, -3], [0, 0, 0])
    table = rftfit.predict(POPPY, blade, down)
    ends = ends_of(table, "moment_N_cm", "model")
    force_ends = ends_of(table, "force_z_N", "model")
    for end, force_end in zip(ends, force_ends[::-1], strict=True):
        np.testing.assert_allclose(end, -10 * force_end, rtol=1e-3)


def test_a_peak_is_the_top_of_the_best_curve_and_inside_its_intervals():
    profile = rftfit.estimate_map(ONE_PUSH).profile
    leg = rftfit.model_leg("c_leg")
    table, peaks = rftfit.predict(profile, leg), find_peaks(profile, leg)
    lift = next(peak for peak in peaks if peak.name == "lift")
    row = int(table["force_z_N"].argmax())
    assert (lift.value, lift.position) == (table["force_z_N"][row], table["theta_deg"][row])
    assert lift.model_lo < lift.lo < lift.value < lift.hi < lift.model_hi


def test_the_interval_of_a_peak_does_not_grow_with_the_number_of_noisy_poses():
    """A flat curve with independent draws in every pose: their maxima lie above it, their interval does not."""
    from rftfit.forces.peaks import DrawStatistics, PeakTarget

    random = np.random.default_rng(0)
    lift = PeakTarget("lift", "force_z_N", 1)
    spread = DrawStatistics(["force_z_N"], [lift], 0.95)
    spread.add({"force_z_N": 10 + random.standard_normal((1000, 300))}, np.ones(300, bool))
    lo, hi = spread.peak_ends(lift, 10.0)
    assert (lo + hi) / 2 == pytest.approx(10, abs=0.2)
    assert lo < 10 < hi


def with_hole(beta_deg, gamma_deg):
    beta, gamma, alpha_z, alpha_x = POPPY.cells
    off_deg = np.abs(np.degrees([beta, gamma]).T - (beta_deg, gamma_deg)).max(axis=1)
    hole = np.where(off_deg < 1, np.nan, 1.0)
    return rftfit.TableProfile(hole * alpha_z, hole * alpha_x, beta, gamma)


def test_no_peak_where_a_pose_without_a_number_may_hold_it():
    leg = rftfit.model_leg("c_leg")
    whole = {peak.name: peak for peak in find_peaks(POPPY, leg)}
    assert {*whole} == {"lift", "suction", "thrust", "moment_negative"}
    for hole, lost in (((30, -56), {"suction"}), ((0, 0), {*whole}), ((60, 34), set())):
        holed = with_hole(*hole)
        table, peaks = rftfit.predict(holed, leg), find_peaks(holed, leg)
        assert table["force_z_N"].isna().any()
        assert {*whole} - {peak.name for peak in peaks} == lost
        for peak in peaks:
            assert (peak.value, peak.position) == (
                whole[peak.name].value,
                whole[peak.name].position,
            )


def test_a_mesh_has_no_peak_where_a_pose_is_missing():
    poses = rftfit.Motion3D(np.array([[0, 0, -1], [0, 0, np.nan], [0, 0, 5.0]]), [0, 0, -1])
    assert find_peaks(POPPY, rftfit.Mesh.sphere(1, 8), poses) == []
    poses = rftfit.Motion3D(np.array([[0, 0, -1], [0, 0, 5.0]]), [0, 0, -1])
    lift = next(
        peak
        for peak in find_peaks(POPPY, rftfit.Mesh.sphere(1, 8), poses)
        if peak.name == "force_z"
    )
    assert 0 < lift.model_lo < lift.value < lift.model_hi


def test_a_wrong_error_is_refused():
    for eps in (-0.1, np.nan, np.inf):
        with pytest.raises(ValueError, match=f" {eps:g}$"):
            rftfit.predict(POPPY, LEG, TURN, model_error=eps)


def test_rounding_is_no_peak():
    """A plate pushed straight down by its middle has a lift and no moment, whatever its elements add up to."""
    plate = rftfit.polyline([[-4.0, 0.0], [4.0, 0.0]], width_cm=5.0)
    down = rftfit.path([0.0, 1.0], [0.0, 0.0], [1.0, -5.0], [0.0, 0.0])
    peaks = find_peaks(POPPY, plate, down)
    assert [peak.name for peak in peaks] == ["lift"]
