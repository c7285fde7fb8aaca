"""Measured against predicted legs: errors by hand, intervals by simulation, the paper's statements."""

import math

import numpy as np
import pandas as pd
import pytest
import yaml
from light_campaign import alpha_frame, one_cell, results_of
from paper import PROJECT
from turning import sweep

from rftfit.campaign.config import Config, Leg
from rftfit.compare.legs import (
    FAR_OFF,
    NOT_TESTED,
    OFF,
    PREDICTED_COLUMNS,
    WITHIN,
    judge,
    leg_errors,
    leg_prediction,
    predicted_curves,
    shape_errors,
    worst_peak,
)
from rftfit.compare.published import FROM_LOGS, leg_claims
from rftfit.measure.alpha import column
from rftfit.model.draws import measured_profile
from rftfit.model.outlines import model_leg
from rftfit.model.profiles import TableProfile
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS, MEDIA, alpha_grid, load

SE = 0.001


@pytest.fixture(scope="module")
def config():
    """The demonstration's, with few draws: the best values do not depend on them."""
    text = (PROJECT / "config" / "config.yaml").read_text(encoding="utf-8")
    values = yaml.safe_load(text)
    values["fourier"]["draws"] = 200
    return Config.model_validate(values)


def alpha_of(medium, noise=None):
    """Alpha table as the slope stage makes it, of the published values, with errors if asked."""
    beta, gamma = np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij")
    table = pd.DataFrame({"medium": medium, "beta_deg": beta.ravel(), "gamma_deg": gamma.ravel()})
    for component, true in zip("zx", alpha_grid(medium), strict=True):
        error = np.zeros(true.shape) if noise is None else noise.normal(0, SE, true.shape)
        error[0] = error[-1]
        values = true + error
        table[column(component)] = values.ravel()
        table[column(component, "_se")] = SE
        table[column(component, "_lo")] = values.ravel() - 1.959964 * SE
        table[column(component, "_hi")] = values.ravel() + 1.959964 * SE
    return table.assign(reason="")


@pytest.fixture(scope="module")
def predicted(config):
    tables = [alpha_of(medium) for medium in MEDIA]
    return pd.concat([predicted_curves(medium)[0] for medium in results_of(tables, config)])


def test_every_leg_and_profile_is_predicted(predicted):
    assert sorted(predicted.columns) == sorted(PREDICTED_COLUMNS)
    counts = predicted.groupby(["medium", "leg", "profile"]).size()
    assert len(counts) == len(MEDIA) * len(LEGS) * 4
    assert (counts == 271).all()
    table = predicted[predicted["profile"] == "table"]
    for medium in MEDIA:
        for leg in LEGS:
            ours = table[(table["medium"] == medium) & (table["leg"] == leg)]
            truth = sweep(TableProfile.published(medium), model_leg(leg))
            np.testing.assert_allclose(ours["force_z_N"], truth.force_z_N, atol=1e-9)
            np.testing.assert_allclose(ours["force_x_N"], truth.force_x_N, atol=1e-9)


def test_intervals_cover_the_truth_at_their_rate(config):
    """Simulated campaigns: the force by true alpha lies in 93 to 97 % of the intervals."""
    random = np.random.default_rng(5)
    truth = {leg: sweep(TableProfile.published("poppy_LP"), model_leg(leg)) for leg in LEGS}
    legs = {name: leg for name, leg in config.intruders.items() if isinstance(leg, Leg)}
    few = config.fourier.model_copy(update={"draws": 300})
    exact = config.errors.model_copy(update={"hip_cm": 0, "arc_percent": 0})
    quick = config.model_copy(update={"fourier": few, "errors": exact})
    inside = []
    for _ in range(100):
        profile = measured_profile(alpha_of("poppy_LP", random), quick)
        for name, leg in legs.items():
            own = leg_prediction(profile, leg, quick)[0]
            for c, force in (("z", truth[name].force_z_N), ("x", truth[name].force_x_N)):
                low, high = (own[f"force_{c}_{end}_N"].to_numpy() for end in ("lo", "hi"))
                wide = high - low > 1e-6
                inside.append(((low <= force) & (force <= high))[wide].mean())
    assert 0.93 <= np.mean(inside) <= 0.97


def test_the_shape_of_a_leg_is_in_the_intervals(config):
    """The force of a leg with another hip and arc lies where one standard deviation says."""
    random = np.random.default_rng(5)
    profile, leg = measured_profile(alpha_of("poppy_LP", random), config), config.intruders["c_leg"]
    assert isinstance(leg, Leg)
    lower = leg.model_copy(update={"hip_height_cm": leg.hip_height_cm + config.errors.hip_cm})
    exact = config.model_copy(
        update={"errors": config.errors.model_copy(update={"hip_cm": 0, "arc_percent": 0})}
    )
    wide, plain = leg_prediction(profile, leg, config)[0], leg_prediction(profile, leg, exact)[0]
    other = leg_prediction(profile, lower, exact)[0]
    best = {c: plain[f"force_{c}_N"].to_numpy() for c in "zx"}
    moved = shape_errors(profile, leg, config, best)
    np.testing.assert_allclose(
        other["force_z_N"] - plain["force_z_N"], moved["hip"]["z"], atol=1e-9
    )
    for c in "zx":
        top = int(plain[f"force_{c}_N"].abs().argmax())
        extra = 1.96 * math.hypot(*(part[c][top] for part in moved.values()))
        for end in ("lo", "hi"):
            own, whole = (
                abs(one[f"force_{c}_{end}_N"][top] - one[f"force_{c}_N"][top])
                for one in (plain, wide)
            )
            assert whole == pytest.approx(math.hypot(own, extra), rel=1e-3)
        assert extra > 0.01 * abs(plain[f"force_{c}_N"][top])


def curve(theta, z, x, **names):
    frame = pd.DataFrame({"theta_deg": theta, "force_z_N": z, "force_x_N": x}).assign(**names)
    for c in "zx":
        frame[f"force_{c}_lo_N"] = frame[f"force_{c}_N"] - 0.1
        frame[f"force_{c}_hi_N"] = frame[f"force_{c}_N"] + 0.1
    return frame.assign(reason="")


def test_errors_by_hand():
    theta = np.arange(-130.0, 131.0)
    bell = np.exp(-((theta / 40) ** 2))
    measured = curve(theta, 10 * bell, -4 * bell, medium="m", leg="c_leg")
    ours = curve(theta, 12 * bell, -3 * bell, medium="m", leg="c_leg", profile="table")
    table = leg_errors(measured, ours).set_index("component")
    assert table.loc["z", "peak_error_percent"] == pytest.approx(20, abs=0.02)
    assert table.loc["x", "peak_error_percent"] == pytest.approx(-25, abs=0.02)
    assert table.loc["x", "peak_measured_N"] == pytest.approx(-4, abs=0.001)
    assert table.loc["z", "peak_predicted_lo_N"] == pytest.approx(11.9)
    assert table.loc["z", "peak_predicted_hi_N"] == pytest.approx(12.1)
    rms = 2 * math.sqrt(np.mean(bell**2))
    assert table.loc["z", "rms_error_N"] == pytest.approx(rms)
    r2 = 1 - np.sum((2 * bell) ** 2) / np.sum((10 * (bell - bell.mean())) ** 2)
    assert table.loc["z", "r2"] == pytest.approx(r2)
    assert (table["reason"] == "").all()


def test_a_leg_log_that_stops_early_is_said():
    theta = np.arange(-130.0, 131.0)
    short = theta[:120]
    measured = curve(short, np.cos(short), np.cos(short), medium="m", leg="c_leg")
    ours = curve(theta, np.cos(theta), np.cos(theta), medium="m", leg="c_leg", profile="table")
    table = leg_errors(measured, ours)
    assert (table["theta_to_deg"] == -11).all()
    assert table["reason"].str.contains("only theta -130 to -11").all()


def test_no_measured_curve_and_no_number_are_said():
    theta = np.arange(-130.0, 131.0)
    measured = curve(theta, np.cos(theta), np.cos(theta), medium="m", leg="c_leg")
    other = curve(theta, np.cos(theta), np.cos(theta), medium="m", leg="flat_leg", profile="table")
    hole = curve(theta, np.cos(theta), np.cos(theta), medium="m", leg="c_leg", profile="table")
    hole.loc[7, ["force_z_N", "force_x_N"]] = np.nan
    hole.loc[7, "reason"] = "no run at (0, 90)"
    table = leg_errors(measured, pd.concat([other, hole])).set_index(["leg", "component"])
    assert table.loc[("flat_leg", "z"), "reason"] == "no measured curve"
    assert table.loc[("c_leg", "z"), "reason"] == "no run at (0, 90)"
    assert table["peak_error_percent"].isna().all()


def test_curves_that_share_no_angle():
    names = {"medium": "sand", "leg": "flat", "force_z_N": 1.0, "force_x_N": 1.0}
    measured = pd.DataFrame([{**names, "theta_deg": 0.0}])
    predicted = pd.DataFrame([{**names, "theta_deg": 90.0, "profile": "table", "reason": ""}])
    for row in leg_errors(measured, predicted).to_dict("records"):
        assert row["reason"] == "measured and predicted curve share no theta"
        assert math.isnan(row["rms_error_N"])


def test_the_papers_statements_are_met_or_named(config, predicted):
    tables = [alpha_of(medium) for medium in MEDIA]
    slopes = {"yuma": 0.69, "palms29": 0.88, "palms29_sieved": 0.76}
    for sand, slope in slopes.items():
        tables.append(alpha_of("poppy_LP").assign(medium=sand))
        tables[-1][column("z")] = slope
    results = results_of(tables, config)
    everything = pd.concat([predicted, *(predicted_curves(results[sand])[0] for sand in slopes)])
    measured = pd.concat([load("fig_s5"), load("fig_s12")])
    scaled = pd.DataFrame(
        {"medium": medium, "alpha_z_measured_N_per_cm3": slope, "zeta": results[medium].zeta}
        for medium, slope in slopes.items()
    )
    claims = leg_claims(leg_errors(measured, everything), measured, scaled)
    items = {item.item: item for item in claims}
    by_table = "media with the reversed c-leg's predicted peak lift below the flat leg's (table)"
    assert items[by_table].verdict == "same"
    assert (
        items[
            "media with the reversed c-leg's predicted peak lift below the flat leg's (nine terms)"
        ].ours
        == 0
    )
    depth_only = items["depth-only: largest overprediction of peak lift, %"]
    assert isinstance(depth_only.ours, float)
    assert 1300 < depth_only.ours < 1600
    assert (
        items["reversed c-leg: media with downward force (below -0.2 N) while it leaves"].ours == 8
    )
    assert items["palms29: drop of measured c-leg peak lift by sieving, %"].verdict == "same"
    # one statement: 35 % rests on zeta = 0.89 alpha; by the text's 0.8 it is 25 to 26 %
    (over,) = (one for one in claims if "overpredicted" in one.item)
    assert isinstance(over.ours, float)
    assert 24.5 < over.ours < 26.5
    assert over.verdict == "differs"
    assert "zeta = 0.889 alpha_z, ours: palms29 +3" in over.why
    # both components count, as the paper's sentence has them
    within = items["c-leg: media with peak lift and thrust within 10 % (measured table)"]
    assert (within.ours, within.verdict) == (1, "differs")
    share = items["all legs and media: peaks of lift and thrust within 33 % (measured table), %"]
    assert share.ours == pytest.approx(80.0)
    assert share.why.startswith("10 of 15 lifts, 14 of 15 thrusts")
    assert (
        items["scaled generic: largest error of the c-leg's peaks in laboratory media, %"].verdict
        == "differs"
    )
    # what the logs hold, and what is predicted
    logged = {item.item for item in claims if item.evidence == FROM_LOGS}
    assert logged == {
        "media whose measured peak lift falls from c-leg to flat to reversed",
        "reversed c-leg: media with downward force (below -0.2 N) while it leaves",
        "palms29: drop of alpha_z(0, 90 deg) by sieving, %",
        "palms29: drop of measured c-leg peak lift by sieving, %",
    }
    alike = "depth-only: reversed c-leg's predicted peak lift against the c-leg's, farthest, %"
    assert items[alike].verdict == "same"


@pytest.mark.parametrize(
    ("error", "lo", "hi", "verdict"),
    [
        (33.0, 20.0, 40.0, WITHIN),
        (-34.0, -40.0, -30.0, OFF),
        (102.0, 64.0, 139.0, FAR_OFF),
        (-51.0, -60.0, -40.0, FAR_OFF),
        (209.0, -78.0, 574.0, OFF),
        (209.0, math.nan, math.nan, FAR_OFF),
        (math.nan, math.nan, math.nan, NOT_TESTED),
    ],
)
def test_a_verdict_on_the_model_is_a_number_s(error, lo, hi, verdict):
    numbers = dict(zip(("", "lo_", "hi_"), (error, lo, hi), strict=True))
    assert judge({f"peak_error_{end}percent": x for end, x in numbers.items()}) == verdict


def test_a_medium_is_as_its_worst_peak_and_the_peak_comes_late():
    theta = np.arange(-130.0, 131.0)
    shape = [np.cos(np.radians(theta - late)) for late in (0, 12)]
    measured = curve(theta, shape[0], shape[0], medium="m", leg="c_leg")
    predicted = curve(
        theta, 1.2 * shape[1], 2.5 * shape[1], medium="m", leg="c_leg", profile="table"
    )
    table = leg_errors(measured, predicted)
    worst = worst_peak(table, "m", "table")
    assert worst is not None
    assert (worst["component"], worst["verdict"]) == ("x", FAR_OFF)
    assert list(table["verdict"]) == [WITHIN, FAR_OFF]
    assert list(table["peak_late_deg"]) == pytest.approx([12, 12], abs=0.1)
    assert worst_peak(table, "m", "map") is None


def test_a_missing_cell_gives_no_guess(config):
    table = alpha_of("poppy_LP")
    # the lowest part of a c-leg goes through this cell
    cell = (table["beta_deg"] == 0) & (table["gamma_deg"] == 0)
    table.loc[cell, [column("z"), column("x")]] = np.nan
    table.loc[cell, "reason"] = "transducer saturated"
    curves = predicted_curves(results_of([table], config)["poppy_LP"])[0]
    by_table = curves[(curves["profile"] == "table") & (curves["leg"] == "c_leg")]
    unknown = by_table["force_z_N"].isna()
    assert unknown.any()
    assert by_table.loc[unknown, "reason"].str.contains("transducer saturated").all()
    assert (by_table.loc[~unknown, "reason"] == "").all()
    assert curves.loc[curves["profile"] == "fourier", "force_z_N"].notna().all()


def test_a_sand_has_its_map_and_a_generic_profile_of_the_published_media(config):
    sand = results_of([alpha_frame("yuma", one_cell(0.69))], config)["yuma"]
    reasons = predicted_curves(sand)[0].groupby(["profile", "leg"])["reason_code"].unique()
    assert len(reasons) == 2 * len(LEGS)
    assert all(list(found) == ["published-media"] for found in reasons["generic"])
    assert all(list(found) == [""] for found in reasons["map"])


def test_a_sand_without_a_test_has_no_curve_and_all_columns(config):
    sand = results_of([alpha_frame("yuma", one_cell(np.nan))], config)["yuma"]
    curves = predicted_curves(sand)[0]
    assert curves.empty
    assert list(curves.columns) == PREDICTED_COLUMNS


def test_a_map_is_for_a_medium_that_lacks_directions(config):
    """Cells that are too few for nine terms give no profile that needs them."""
    table = alpha_of("poppy_LP")
    cells = (table["beta_deg"] == 0) & ((table["gamma_deg"] > 0) | (table["gamma_deg"] == -90))
    numbers = [name for name in table if str(name).startswith("alpha_")]
    table.loc[~cells, numbers] = np.nan
    curves = predicted_curves(results_of([table], config)["poppy_LP"])[0]
    assert set(curves["profile"]) == {"table", "map", "depth_only"}
    lacking = curves[curves["force_z_N"].isna()]
    assert set(lacking["profile"]) == {"table"}
    assert lacking["reason"].str.startswith("measured table of poppy_LP: no alpha at").all()


def test_prediction_needs_a_leg_of_the_config(config):
    profile = measured_profile(alpha_of("glass3mm_CP"), config)
    leg = config.intruders["flat_leg"]
    assert isinstance(leg, Leg)
    low = leg_prediction(profile, leg.model_copy(update={"hip_height_cm": 9.0}), config)[0]
    # the axle higher than the leg is long: it never touches the sand
    assert (low["force_z_N"] == 0).all()
    assert (low["force_z_hi_N"] == 0).all()
