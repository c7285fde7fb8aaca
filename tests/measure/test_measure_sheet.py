"""Runs in wrong rows of the sheet, with other axes than most, and rods that are not those of the plates."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mistakes import Written, enacted, judged
from scipy.stats import t

import rftfit
from rftfit import TableProfile, reference
from rftfit.checks.declared import CHECKS, MediumMeasurements
from rftfit.compare.joint import RunSlopes
from rftfit.compare.misplaced import find_misplaced
from rftfit.measure.ledger import RowStatus

DIRECTIONS = [(b, g) for b in (-60.0, -30.0, 0.0, 30.0, 60.0) for g in (30.0, 60.0, 75.0, 90.0)]


def slopes_in_rows(medium="poppy_LP"):
    """Slopes of a published medium in beds of 5 %, in random order, and their run sheet."""
    random = np.random.default_rng(1)
    beta_deg, gamma_deg = random.permutation(DIRECTIONS * 2).T
    alpha = np.stack(
        TableProfile.published(medium).alpha(np.radians(beta_deg), np.radians(gamma_deg))
    )
    alpha = alpha * random.normal(1, 0.05, beta_deg.size)
    run_ids = [f"r{number}" for number in range(beta_deg.size)]
    sheet: dict[str, Any] = {
        run_id: SimpleNamespace(
            run_id=run_id,
            row=row,
            kind="plate",
            direction="intrusion",
            beta_deg=beta,
            gamma_deg=gamma,
            motion_gamma_deg=gamma,
        )
        for row, (run_id, beta, gamma) in enumerate(
            zip(run_ids, beta_deg, gamma_deg, strict=True), 2
        )
    }
    return alpha, run_ids, sheet


def likeliest_mistake(alpha, run_ids, sheet, medium):
    """First row of the table of misplaced runs; None where no mistake explains several runs better."""
    angles = np.array([(run.beta_deg, run.gamma_deg) for run in sheet.values()]).T
    count = alpha.shape[1]
    runs = RunSlopes(
        *angles, alpha, np.full(alpha.shape, 0.001), np.zeros(count, dtype=bool), np.arange(count)
    )
    without_medium = partial(rftfit.published_shapes, without=(medium,))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rftfit.model.run_model.published_shapes", without_medium)
        table = find_misplaced(runs, run_ids, sheet, "m")
    return table.iloc[0] if len(table) else None


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_a_sound_sheet_has_no_likelier_rows(medium):
    mistake = likeliest_mistake(*slopes_in_rows(medium), medium)
    assert mistake is None or mistake["log_bayes_factor"] < 4


@pytest.mark.parametrize("shift", [1, -1])
@pytest.mark.parametrize("first", [0, 15])
def test_logs_a_row_away_from_their_angles(shift, first):
    """From a row on, as where a row is missing."""
    medium = reference.MEDIA[0]
    alpha, run_ids, sheet = slopes_in_rows(medium)
    shifted = alpha.copy()
    shifted[:, first:] = np.roll(alpha[:, first:], shift, axis=1)
    mistake = likeliest_mistake(shifted, run_ids, sheet, medium)
    assert (mistake["mistake"], mistake["rows"]) == ("rows", shift)
    assert mistake["log_bayes_factor"] > 10
    named = {*mistake["run_ids"].split()}
    assert len(named & {*run_ids[first:]}) > 0.7 * (len(run_ids) - first)
    assert len(named & {*run_ids[:first]}) <= 2


def test_beta_alone_a_row_away():
    medium = reference.MEDIA[0]
    alpha, run_ids, sheet = slopes_in_rows(medium)
    betas = np.roll([run.beta_deg for run in sheet.values()], -1)
    for run, beta_deg in zip(sheet.values(), betas, strict=True):
        run.beta_deg = beta_deg
    mistake = likeliest_mistake(alpha, run_ids, sheet, medium)
    assert (mistake["mistake"], mistake["rows"]) == ("beta-rows", 1)


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_x_and_z_exchanged_in_a_part_of_the_runs(medium):
    alpha, run_ids, sheet = slopes_in_rows(medium)
    exchanged = np.random.default_rng(2).random(len(run_ids)) < 0.3
    alpha[:, exchanged] = alpha[::-1, exchanged]
    mistake = likeliest_mistake(alpha, run_ids, sheet, medium)
    assert (mistake["mistake"], mistake["rows"]) == ("exchanged", 0)
    right = {run_id for run_id, is_one in zip(run_ids, exchanged, strict=True) if not is_one}
    # where both forces are alike nothing tells
    assert len(right & {*mistake["run_ids"].split()}) <= 2


def test_two_exchanged_runs_are_single_mistakes():
    medium = reference.MEDIA[0]
    alpha, run_ids, sheet = slopes_in_rows(medium)
    alpha[:, [3, 9]] = alpha[::-1, [3, 9]]
    assert likeliest_mistake(alpha, run_ids, sheet, medium) is None


# --- by the motion logs


def judge(name, sheet, tables, **settings):
    """Outcome of a check of the medium of a run sheet, by the sections of the config that it reads."""
    config: Any = SimpleNamespace(grid=SimpleNamespace(angle_tolerance_deg=0.5), **settings)
    medium: Any = SimpleNamespace()
    return CHECKS[name].check(MediumMeasurements(config, medium, sheet, tables, {}))


def check_refused(sheet, seen, size_of_alpha=20):
    """Check of runs that are refused since their logs show other angles, by run_id: (beta, gamma), NaN: not asked."""
    rows = [
        {"run_id": run_id, "seen_beta_deg": beta, "seen_gamma_deg": gamma}
        for run_id, (beta, gamma) in seen.items()
    ]
    tables = {
        "runs": pd.DataFrame(rows, columns=["run_id", "seen_beta_deg", "seen_gamma_deg"]),
        "misplaced": pd.DataFrame(),
        "peers": pd.DataFrame(index=range(size_of_alpha)),
    }
    return judge("sheet", sheet, tables, arm=SimpleNamespace(angle_tolerance_deg=2.0))


@pytest.mark.parametrize("shift", [1, -1, 2, -2])
def test_logs_that_show_the_angles_of_other_rows(shift):
    _, run_ids, sheet = slopes_in_rows()
    runs = [*sheet.values()]
    seen = {
        run_ids[place]: (runs[place - shift].beta_deg, np.nan) for place in range(4, len(runs) - 4)
    }
    check = check_refused(sheet, seen)
    assert (check.verdict, check.code) == ("failed", "sheet-logs")
    assert check.values["count"] == check.values["size"] == len(seen)


def test_a_few_refused_runs_or_wrong_angles_of_no_other_row_are_no_shift():
    _, run_ids, sheet = slopes_in_rows()
    two = dict.fromkeys(run_ids[4:6], (17.0, np.nan))
    assert check_refused(sheet, two).verdict == "passed"
    assert check_refused(sheet, dict.fromkeys(run_ids, (17.0, np.nan))).code == "sheet"
    assert check_refused(sheet, {}, size_of_alpha=2).code == "sheet-few"


# --- through files


@pytest.fixture(scope="module")
def campaign():
    written = enacted("poppy_LP", 3, None, [*DIRECTIONS, (0.0, -45.0), (30.0, -45.0)])
    order = np.random.default_rng(1).permutation(len(written.rows))
    written.rows = [written.rows[place] for place in order]
    return written


def shifted(written, columns):
    """Copy of a campaign whose plates have these cells of the row above."""
    rows = [dict(row) for row in written.rows]
    of_plates = [row for row in rows if row["kind"] == "plate"]
    cells = [{column: row[column] for column in columns} for row in of_plates]
    for row, moved in zip(of_plates, [cells[-1], *cells[:-1]], strict=True):
        row.update(moved)
    return Written(written.config, rows, dict(written.logs))


def test_a_shifted_column_of_beta_is_told_before_anything_is_measured(campaign):
    with pytest.raises(rftfit.RftfitError) as caught:
        judged(shifted(campaign, ("beta_deg",)))
    error: Any = caught.value
    problems = {problem.code: problem for problem in error.problems}
    assert problems["sheet.column-shifted"].place.column == "beta_deg"


# --- rods


def samples_of(share):
    """Fits, tared samples and windows of pushes of which a share of the tare was too much."""
    random = np.random.default_rng(4)
    fits, tared = [], []
    for number, (beta, gamma) in enumerate(DIRECTIONS):
        depth = np.linspace(1, 8, 200)
        force = np.array([0.3, 0.004 * beta]) * (1 + gamma / 90)
        rod = np.array([0.02 * np.sin(np.radians(gamma)), 0.02 * np.cos(np.radians(gamma))])
        true_tare = rod[:, None] * depth**2
        tare = true_tare / (1 - share) + 0.03 * random.standard_normal((2, depth.size))
        noise = 0.03 * random.standard_normal((2, depth.size))
        # a depth law and patches of the bed bend both components alike
        net = (
            force[:, None] * depth**1.1 * (1 + 0.03 * np.sin(depth + number))
            + true_tare
            - tare
            + noise
        )
        run_id = f"r{number:02}"
        fits.append((run_id, "intrusion", f"rod{number}", beta, gamma))
        tared.append(
            pd.DataFrame(
                {
                    "run_id": run_id,
                    "depth_cm": depth,
                    **{f"force_{c}_N": net[i] for i, c in enumerate("zx")},
                    **{f"tare_{c}_N": tare[i] for i, c in enumerate("zx")},
                }
            )
        )
    table = pd.concat(tared, ignore_index=True)
    table["run_id"] = table["run_id"].astype("category")
    names = ["run_id", "direction", "tare_run", "beta_deg", "gamma_deg"]
    windows = pd.DataFrame({"why": np.full(len(table), int(RowStatus.GOOD))})
    return pd.DataFrame(fits, columns=names), table, windows


def rods(fits, tared, windows, confidence=0.95):
    """Check of rods, none of which is stronger than its plate."""
    tares = fits.assign(tare_rms_N=1.0, force_rms_N=2.0)
    tables = {"fits": fits, "tared": tared, "windows": windows, "tares": tares}
    sheet: Any = {name: SimpleNamespace(run_id=name, kind="plate") for name in fits["run_id"]}
    return judge("rods", sheet, tables, fit=SimpleNamespace(confidence=confidence))


@pytest.mark.parametrize(
    ("share", "code"),
    [(-1.5, "rods-other-small"), (0.0, "rods"), (0.3, "rods-other"), (0.6, "rods-other")],
)
def test_share_of_the_tares_that_is_too_much(share, code):
    """Whatever the law of depth: rods of 0.4, 1, 1.4 and 2.5 times the force."""
    check = rods(*samples_of(share))
    assert check.code == code
    if share:
        assert check.values["share"] == pytest.approx(abs(share), rel=0.15)
        assert check.values["high"] - check.values["low"] < 0.4


def test_other_rods_are_told_with_an_interval_of_the_confidence_of_the_campaign():
    """Of Student's t, as few directions show the scatter."""
    checks = [rods(*samples_of(0.6), confidence) for confidence in (0.8, 0.95)]
    narrow, wide = (check.values["high"] - check.values["low"] for check in checks)
    for check in checks:
        middle = (check.values["low"] + check.values["high"]) / 2
        assert middle == pytest.approx(check.values["share"])
    freedom = np.arange(1, len(DIRECTIONS))
    assert np.isclose(wide / narrow, t.ppf(0.975, freedom) / t.ppf(0.9, freedom)).any()
    assert wide / narrow > t.ppf(0.975, 1e6) / t.ppf(0.9, 1e6)


def test_nothing_tells_the_rods_where_all_runs_share_one_or_go_straight_down():
    fits, tared, windows = samples_of(0.6)
    for alike in (fits.assign(tare_run="one"), fits[fits["gamma_deg"] == 90]):
        assert rods(alike, tared, windows).code == "rods"
    assert rods(fits.assign(tare_run=""), tared, windows).code == "rods-no-tare"
