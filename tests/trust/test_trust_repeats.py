"""The run-to-run spread: found from repeats or stated, and where it goes."""

import math

import numpy as np
import pandas as pd
import pytest
from ensembles import paper_config
from rigroom import paper, planned

from rftfit.campaign.config import Errors
from rftfit.compare.coefficients import sand_row
from rftfit.compare.legs import leg_errors, measured_peak
from rftfit.lab.enact import run_logs
from rftfit.measure.alpha import alpha_table, column
from rftfit.measure.errors import (
    AS_PREPARED,
    ASSUMED,
    LEAST_DOF,
    REPEATS,
    STATED,
    Part,
    bed_of_mean,
    half_width,
    spread_of_beds,
)
from rftfit.measure.slopes import GIVEN_DOF, student_quantile
from rftfit.model.draws import interval, interval_of_sum, typical_dof
from rftfit.model.scaling import published

SPREAD = 0.005


def pairs(count, seed, se=0.001):
    random = np.random.default_rng(seed)
    deviation = math.hypot(SPREAD, se)
    return [(random.normal(0.3, deviation, 2), np.full(2, se)) for _ in range(count)]


def test_spread_from_repeats_by_hand():
    groups = [(np.array([0.30, 0.31]), np.array([0.001, 0.002]))] * LEAST_DOF
    found = spread_of_beds([[*groups, (np.array([9.0]), np.array([0.1]))]])[0]
    # each pair has the sum of squares 2 x 0.005^2 and one degree of freedom
    between, own = 5e-5, (1e-6 + 4e-6) / 2
    assert found.source == REPEATS
    part = found.part(0.305)
    assert part.sd == pytest.approx(math.sqrt(between - own))
    assert part.dof == pytest.approx(LEAST_DOF * ((between - own) / between) ** 2)


def test_spread_from_repeats_is_unbiased():
    found = [spread_of_beds([pairs(12, seed)])[0].part(0.3).sd ** 2 for seed in range(400)]
    assert np.mean(found) == pytest.approx(SPREAD**2, rel=0.06)


@pytest.mark.parametrize(("a", "b"), [(0.004, 0.0), (0.0, 0.05), (0.002, 0.03)])
def test_a_spread_that_grows_with_alpha_is_found(a, b):
    random = np.random.default_rng(3)
    alphas = np.tile([0.01, 0.05, 0.1, 0.2, 0.35], 12)
    sizes, inside = [], []
    for _ in range(60):
        own = np.full(3, 0.0005)
        groups = [
            (alpha + random.normal(0, math.hypot(a, b * alpha, 0.0005), 3), own) for alpha in alphas
        ]
        found = spread_of_beds([groups])[0]
        sizes.append(found.size)
        true = math.hypot(a, b * 0.35)
        one_more = random.normal(0, true)
        inside.append(abs(one_more) <= half_width([found.part(0.35)], 0.95))
    mean = np.mean(sizes, axis=0)
    # what is 0 can only be found too large
    np.testing.assert_allclose(np.sqrt(mean), [a, b], rtol=0.15, atol=0.0008 if a == 0 else 0.006)
    assert np.mean(inside) > 0.88


def test_where_no_repeat_is_near_the_interval_is_wide_and_not_endless():
    """Four cells of three runs each: there a^2 may be found small, with a large error."""
    random = np.random.default_rng(1)
    ratios, inside = [], []
    for _ in range(300):
        groups = [
            (alpha * (1 + random.normal(0, 0.04, 3)), np.full(3, 0.0001))
            for alpha in (0.6, 0.45, 0.22, 0.15)
        ]
        part = spread_of_beds([groups])[0].part(0.02)
        half = half_width([part], 0.95)
        ratios.append(half / 0.0008)
        inside.append(abs(random.normal(0, 0.0008)) <= half)
    assert max(ratios) < 100
    assert np.mean(inside) > 0.93


def test_repeats_speak_before_the_config_and_few_do_not():
    few, many = pairs(LEAST_DOF - 1, 1), pairs(LEAST_DOF, 1)
    assert spread_of_beds([few], (0.003, 0.0))[0].source == STATED
    assert spread_of_beds([few], (0.003, 0.01))[0].part(0.4).sd == pytest.approx(0.005)
    assert spread_of_beds([few], (0.0, 0.0))[0].source == AS_PREPARED
    # nothing known is not nothing: beds are then taken to differ by 5 %
    assert spread_of_beds([few])[0].source == ASSUMED
    assert spread_of_beds([few])[0].part(0.4).sd == pytest.approx(0.02)
    assert spread_of_beds([many], (0.003, 0.0))[0].source == REPEATS
    assert spread_of_beds([[]], (0.0, 0.0))[0].part(0.3).sd == 0


def test_repeats_that_agree_show_no_spread():
    same = [(np.array([0.3, 0.3]), np.full(2, 0.002))] * LEAST_DOF
    found = spread_of_beds([same], (0.005, 0.0))[0]
    assert (found.part(0.3).sd, found.source) == (0, REPEATS)


def test_mean_of_one_run_has_the_spread_of_others():
    spread = spread_of_beds([pairs(20, 3)])[0]
    noise, bed, source = bed_of_mean(np.array([0.2]), np.ones(1), Part(0.001, 30.0), spread)
    assert (noise.sd, source) == (0.001, REPEATS)
    assert bed == spread.part(0.2)
    assert bed.dof < 25


def fits(run_to_run):
    rows = [
        {
            "run_id": f"{beta}_{gamma}_{depth}", "beta_deg": beta, "gamma_deg": gamma,
            "depth_from_cm": depth, "depth_to_cm": depth, "flags": "", "reason": "",
            **{f"alpha_{c}{q}": v for c in "zx" for q, v in (
                ("_N_per_cm3", 0.1), ("_se_N_per_cm3", 0.0002), ("_dof", GIVEN_DOF),
                ("_startup_N_per_cm3", 0.0001 if gamma == 0 else 0.0))},
        }
        for beta, gamma, depth in ((0, 90, 5.0), (0, 0, 2.54), (0, 0, 5.08), (0, 0, 7.62))
    ]  # fmt: skip
    errors = Errors(angle_deg=0, turn_deg=0, tare_percent=0, bed_N_per_cm3=run_to_run or 0)
    return alpha_table(pd.DataFrame(rows), "m", 0.95, 3, errors)


def test_stated_spread_in_the_alpha_table():
    with_it, without = fits(SPREAD), fits(None)
    np.testing.assert_array_equal(with_it[column("z")], without[column("z")])
    cell = with_it[(with_it["beta_deg"] == 0) & (with_it["gamma_deg"] == 90)].iloc[0]
    assert cell["spread"] == STATED
    assert cell["run_to_run_x_N_per_cm3"] == pytest.approx(SPREAD)
    assert cell[column("z", "_se")] == pytest.approx(math.hypot(SPREAD, 0.0002))
    level = with_it[(with_it["beta_deg"] == 0) & (with_it["gamma_deg"] == 0)].iloc[0]
    depth = np.array([2.54, 5.08, 7.62])
    share = depth**2 / (depth @ depth)
    # scatter and beds of the depths are independent; their start-up is the same and adds up
    own = (0.0002**2 - 0.0001**2 + SPREAD**2) * share @ share + (0.0001 * share.sum()) ** 2
    assert level[column("z", "_se")] == pytest.approx(math.sqrt(own))
    assert set(without["spread"]) == {AS_PREPARED}
    assert without["run_to_run_z_N_per_cm3"].isna().all()


def test_interval_of_a_sum_has_more_degrees_of_freedom():
    random = np.random.default_rng(4)
    wide = float(student_quantile(0.95, 6)) / 1.959964
    terms = [wide * random.standard_normal((40000, 1)) for _ in range(5)]
    lo, hi = interval_of_sum(terms, [6.0] * 5, 0.95)
    half = math.sqrt(5) * float(student_quantile(0.95, 30))
    assert (hi - lo)[0] / 2 == pytest.approx(half, rel=0.02)
    # alone it is the Student interval that the draws were made for
    np.testing.assert_allclose(interval_of_sum(terms[:1], [6.0], 0.95), interval(terms[0], 0.95))


def test_typical_dof():
    table = fits(None)
    for c in "zx":
        half = float(student_quantile(0.95, 8.0)) * table[column(c, "_se")]
        table[column(c, "_lo")], table[column(c, "_hi")] = -half, half
    assert typical_dof(table, 0.95) == pytest.approx(8.0)
    assert typical_dof(fits(None), 0.95) == GIVEN_DOF
    assert math.isnan(typical_dof(fits(None).iloc[:0], 0.95))


def test_peak_of_a_noisy_curve_is_not_the_highest_reading():
    random = np.random.default_rng(5)
    theta = np.arange(-130.0, 131.0)
    curve = 3 * np.cos(np.radians(theta - 7.3))
    found = [measured_peak(theta, curve + random.normal(0, 0.05, theta.size), "z")
             for _ in range(300)]  # fmt: skip
    peaks = np.array([peak.force_N for peak in found])
    # a very flat peak: what is left is within one standard error, the highest reading three above
    se = float(np.mean([peak.se_N for peak in found]))
    assert abs(np.mean(peaks) - 3) < se < 0.03
    assert 0.5 * se < np.std(peaks) < 1.1 * se
    raw = [float((curve + random.normal(0, 0.05, theta.size)).max()) for _ in range(300)]
    assert np.mean(raw) > 3.07
    down = measured_peak(theta, -curve, "x")
    assert down.force_N == pytest.approx(-3, abs=0.005)


def test_a_short_curve_has_its_highest_reading():
    short = measured_peak(np.arange(4.0), np.array([1.0, 3.0, 2.0, 1.0]), "z")
    assert short.force_N == 3
    assert math.isnan(short.se_N)


def test_bed_spread_widens_the_peak_error():
    theta = np.arange(-130.0, 131.0)
    force = 10 * np.cos(np.radians(theta))
    measured = pd.DataFrame({"theta_deg": theta, "force_z_N": force, "force_x_N": force,
                             "zero_se_z_N": 0.01, "zero_se_x_N": 0.01}).assign(medium="m", leg="l")  # fmt: skip
    ours = measured.assign(profile="table", reason="")
    for c in "zx":
        ours[f"force_{c}_lo_N"], ours[f"force_{c}_hi_N"] = force - 0.1, force + 0.1
    narrow = leg_errors(measured, ours).iloc[0]
    wide = leg_errors(measured, ours, {"m": 0.02}).iloc[0]
    assert narrow["peak_error_lo_percent"] == pytest.approx(-1, abs=0.1)
    assert narrow["peak_error_hi_percent"] == pytest.approx(1, abs=0.1)
    assert wide["peak_error_hi_percent"] == pytest.approx(math.hypot(1, 2.0639 * 2), abs=0.1)
    assert wide["peak_error_percent"] == narrow["peak_error_percent"]


def test_beds_of_the_reenacted_lab_differ_by_what_is_asked():
    """Force of runs with a spread less that of the same runs without: alpha times depth and area."""
    found = []
    for run in list(planned().values())[:400]:
        if run.kind != "plate" or run.gamma_deg != 90 or run.beta_deg != 0 or run.natural:
            continue
        logs = (run_logs(run, paper(), 3, spread=s)[run.force_log] for s in (0.0, 0.05))
        plain, spread = (np.genfromtxt(log.decode().splitlines()[3:], delimiter=",")  # type: ignore[union-attr]
                         for log in logs)  # fmt: skip
        push = -(spread - plain)[:, 4] / 9.6774
        found.append(np.abs(push).max() / 8.7 * np.sign(push[np.abs(push).argmax()]))
    assert len(found) >= 2
    assert 0.005 < np.std(found) < 0.2
    run = planned()["poppy_LP_c_leg"]
    same = run_logs(run, paper(), 3), run_logs(run, paper(), 3, spread=0.0)
    assert same[0] == same[1]
    assert run_logs(run, paper(), 3, spread=0.05) != same[0]


def test_the_demonstration_has_alike_beds_unless_asked():
    assert paper_config(300).errors.bed == (0, 0)


def test_zeta_of_a_sand_knows_how_few_pushes_there_were():
    """Two pushes that differ by 8 %: the interval of alpha is half of it, and zeta rests on it."""
    half = float(student_quantile(0.95, 1)) * 0.036
    row = {"alpha_z_N_per_cm3": 0.936, "alpha_z_se_N_per_cm3": 0.036, "alpha_z_lo_N_per_cm3": 0.936 - half,
           "alpha_z_hi_N_per_cm3": 0.936 + half}  # fmt: skip
    row |= {name.replace("_z_", "_x_"): 0.0 for name in row}
    place = {"medium": "dune", "beta_deg": 0.0, "gamma_deg": 90.0, "flags": "", "reason": ""}
    found = sand_row(pd.DataFrame([place | row]), published(), paper_config(200))
    assert found["zeta_hi"] > found["zeta"] * (1 + half / 0.936)  # type: ignore[operator]
