"""The demonstration campaign gives back the paper's numbers and accounts for every log row (`make pages`)."""

import numpy as np
import pytest
from pages import figure_faults, untrue
from paper import grid

import rftfit
from rftfit.figures.registry import figures
from rftfit.reference import LEGS, MEDIA, alpha_grid

SANDS = ("yuma", "palms29", "palms29_sieved")

pytestmark = [pytest.mark.slow, pytest.mark.page]


def test_alpha_is_table_s5(whole_campaign):
    off = []
    for medium in MEDIA:
        table = whole_campaign.table(f"alpha/{medium}.csv")
        assert (table["n_runs"] == np.where(table["gamma_deg"] == 0, 3, 1)).all()
        for component, paper in zip("zx", alpha_grid(medium), strict=True):
            off.append(np.abs(grid(table, f"alpha_{component}_N_per_cm3") - paper).ravel())
    errors = np.concatenate(off)
    assert errors.size == 5 * 7 * 13 * 2
    assert np.isfinite(errors).all()
    assert np.mean(errors <= 0.005) >= 0.95
    assert errors.max() <= 0.01


def test_intervals_cover_table_s5(whole_campaign):
    inside = []
    for medium in MEDIA:
        table = whole_campaign.table(f"alpha/{medium}.csv")
        for component, paper in zip("zx", alpha_grid(medium), strict=True):
            low, high = (grid(table, f"alpha_{component}_{end}_N_per_cm3") for end in ("lo", "hi"))
            # beta = -90 repeats +90
            inside.append(((low <= paper) & (paper <= high))[1:].ravel())
    share = np.concatenate(inside).mean()
    # 780 cells: three standard errors about 95 %
    assert 0.925 <= share <= 0.975


def test_coefficients_are_table_s2(whole_campaign):
    table = whole_campaign.table("coefficients.csv").set_index(["method", "medium", "coefficient"])
    printed = rftfit.published_table("table_s2").query("value != 0 and coefficient != 'zeta'")
    assert {*printed["medium"]} == {*MEDIA, "generic"}
    for row in printed.to_dict("records"):
        place = "dft-index, printed terms", row["medium"], row["coefficient"]
        tolerance = 0.003 if row["medium"] == "generic" else 0.002
        assert abs(table.loc[place, "value_N_per_cm3"] - row["value"]) <= tolerance, place


def test_chi_is_table_s3(whole_campaign):
    table = whole_campaign.table("penetration.csv").set_index(["method", "medium"])
    printed = (
        rftfit.published_table("table_s3").set_index(["medium", "quantity"])["value"].astype(float)
    )
    for medium in MEDIA:
        row = table.loc[("dft-index, printed terms", medium)]
        assert abs(row["chi"] - printed[medium, "chi"]) <= 0.02
        assert row["chi_lo"] <= row["chi"] <= row["chi_hi"]


def test_sands_are_scaled(whole_campaign):
    table = whole_campaign.table("penetration.csv").set_index("medium")
    for sand, slope in zip(SANDS, (0.69, 0.88, 0.76), strict=True):
        row = table.loc[sand]
        # slope of Fig. S11 over the stated linear regime
        assert row["alpha_z_measured_N_per_cm3"] == pytest.approx(slope, abs=0.01)
        assert row["zeta"] == pytest.approx(
            row["alpha_z_measured_N_per_cm3"] / row["chi"], rel=1e-4
        )
    # independent of the program: zero-intercept fit of the published curve itself
    curve = rftfit.published_table("fig_s11").query("medium == 'yuma' and depth_cm <= 2")
    depth, stress = curve["depth_cm"].to_numpy(), curve["stress_z_N_per_cm2"].to_numpy()
    alpha = (
        whole_campaign.table("alpha/yuma.csv").query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    )
    assert alpha["alpha_z_N_per_cm3"] == pytest.approx(stress @ depth / (depth @ depth), abs=0.01)
    assert abs(alpha["alpha_x_N_per_cm3"]) < 0.01


def bin_deviation(samples):
    """Standard deviation of the mean of so many samples of the lab's noise, run minus tare, N."""
    lags = np.arange(1, 40)
    result = []
    for n in samples:
        inner = lags[lags < n]
        # 0.05 N, correlated by 0.7 from sample to sample
        total = n + 2 * np.sum((n - inner) * 0.7**inner)
        result.append(0.05 * np.sqrt(2 * total) / n)
    return np.array(result)


@pytest.mark.parametrize(("figure", "media"), [("fig_s5", MEDIA), ("fig_s12", SANDS)])
def test_leg_curves_are_the_published_ones(whole_campaign, figure, media):
    keys = ["medium", "leg", "theta_deg"]
    for medium in media:
        curves = whole_campaign.table(f"legs/{medium}.csv")
        merged = curves.merge(rftfit.published_table(figure), on=keys, suffixes=("", "_paper"))
        assert set(merged["leg"]) == set(LEGS)
        for _, curve in merged.groupby("leg"):
            assert len(curve) >= 235
            assert curve["samples"].between(7, 10).mean() > 0.95
            noise = bin_deviation(curve["samples"].to_numpy())
            # the ends fade
            inner = curve["theta_deg"].between(-128, 128).to_numpy()
            for c in "zx":
                zero = curve[f"zero_se_{c}_N"].to_numpy()
                assert (zero == zero[0]).all()
                assert 0 < zero[0] < 0.05
                paper = curve[f"force_{c}_N_paper"].to_numpy()
                off = curve[f"force_{c}_N"].to_numpy() - paper
                assert np.sqrt((off**2).mean()) < 0.07
                # a bin of one degree averages the corners of the published curve
                bend = np.abs(np.gradient(np.gradient(paper)))
                allowed = 4 * np.hypot(noise, zero) + bend / 4
                assert (np.abs(off) <= allowed)[inner].all()
                # and it is noise, neither a bias nor a wrong scale
                pull = (off / np.hypot(noise, zero))[inner]
                assert 0.7 < np.sqrt(np.mean(pull**2)) < 1.3
                assert abs(off[inner].mean()) < 3.5 * zero[0] + 0.01


def test_windows_points_and_quality_figures(whole_campaign):
    for medium in MEDIA:
        fits = whole_campaign.table(f"fits/{medium}.csv")
        assert fits["reason"].isna().all()
        assert (fits["n_points"] >= 30).all()
        level = fits["direction"] == "horizontal"
        assert (fits["depth_to_cm"] - fits["depth_from_cm"])[level].between(0, 0.02).all()
        # no plate is fitted nearer than 6 cm to the bottom of 15 cm
        beta = np.radians(fits["beta_deg"])
        half_z = 1.905 * np.abs(np.sin(beta)) + 0.32 * np.abs(np.cos(beta))
        assert (fits["depth_to_cm"] + half_z)[~level].max() <= 9.001
        assert (fits["depth_from_cm"] - half_z)[~level].min() >= -0.001
        names = [
            f"{name}_{c}{unit}"
            for c in "zx"
            for name, unit in (
                ("free_slope", "_N_per_cm3"),
                ("intercept", "_N_per_cm2"),
                ("nonlinear", "_p"),
                ("nonlinear", "_ratio"),
            )
        ]
        assert fits.loc[level, names].isna().all(axis=None)
        assert fits.loc[~level, names].notna().all(axis=None)
        ratio = fits["alpha_z_se_N_per_cm3"] / fits["alpha_z_ols_se_N_per_cm3"]
        assert ratio.median() > 1.5


def test_clocks_and_phases(whole_campaign):
    """Of the medium whose clocks are an hour apart."""
    runs = whole_campaign.table("runs/glass3mm_CP.csv")
    assert (runs["status"] == "read").all()
    assert runs["clock_residual_s"].max() < 0.02
    # the legs in air were logged before the clocks were changed
    late = runs["note"].fillna("").str.contains("clocks differ by -1 h")
    assert (late == ~runs["run_id"].str.startswith("air_")).all()
    traces = rftfit.open(whole_campaign.root).table("traces/glass3mm_CP.parquet")
    seconds = traces.groupby("phase", observed=True).size() / 100 / traces["run_id"].nunique()
    assert seconds["air"] == pytest.approx(1.9, abs=0.2)
    assert seconds["pause"] == pytest.approx(1.2, abs=0.5)
    air = traces[traces["phase"] == "air"].groupby("run_id", observed=True)
    assert air[["force_z_N", "force_x_N"]].mean().abs().max().max() < 0.01


def test_reproduction_table_says_where_the_paper_differs(whole_campaign):
    table = whole_campaign.table("reproduction.csv")
    judged = {"same", "differs", "paper inconsistent"}
    assert judged <= {*table["verdict"]} <= judged | {"not judged", "not measured"}
    assert table["why"].notna().all()
    rows = table[table["where"].isin(["Table S5", "Table S3"])]
    assert (rows["verdict"] == "same").all()


def test_no_medium_of_the_demonstration_fails_a_check(whole_campaign):
    """It has no fault, and its rows are sorted by direction: runs that follow one another are not alike by chance."""
    for medium in (*MEDIA, *SANDS):
        checks = whole_campaign.table(f"checks/{medium}.csv")
        assert "failed" not in set(checks["verdict"]), medium


def test_what_the_demonstration_says_rests_on_its_records(whole_campaign):
    assert untrue(rftfit.open(whole_campaign.root)) == []


@pytest.mark.parametrize(
    "name", [declared.name for declared in figures() if not declared.on_demand]
)
def test_a_reader_finds_everything_in_each_figure(whole_campaign, name):
    """Those of the robot are drawn in `test_robot_figures`: this campaign has none."""
    results = rftfit.open(whole_campaign.root)
    for declared in figures():
        if declared.name != name:
            continue
        for medium in declared.media(results.campaign):
            drawn = declared.draw(results, *filter(None, [medium]))
            for page in drawn if isinstance(drawn, list) else [drawn]:
                assert figure_faults(page) == [], declared.file(medium)
