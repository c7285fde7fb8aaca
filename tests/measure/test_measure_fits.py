"""The fit of one plate run gives the exact slope and window of its stroke, or the right reason.

Stroke: the part of a run in which the plate moves through the sand. No logs are read.
"""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from pushes import plate_run

from rftfit.campaign.config import ForceLog, TableSettings
from rftfit.measure.fits import Stroke, fit_run
from rftfit.measure.flags import codes_of, remark
from rftfit.measure.lab_frame import lacks_force_x
from rftfit.measure.ledger import RowStatus

AREA = 3.81 * 2.54
"""Of the plate, cm^2."""
ALPHA_Z, ALPHA_X = 0.31, 0.12


def run(direction="intrusion", beta=30.0, gamma=45.0, **facts):
    return plate_run(direction=direction, beta_deg=beta, gamma_deg=gamma, **facts)


def stroke(depth, stress_z=None, **columns):
    """Samples without noise, by default of a stress that is exactly linear in depth."""
    stress = np.stack([ALPHA_Z * depth, ALPHA_X * depth])
    if stress_z is not None:
        stress[0] = stress_z
    nothing = np.zeros((2, 2))
    values: dict[str, Any] = {
        "x": np.zeros(depth.size),
        "path": np.abs(depth - depth[0]),
        "force": AREA * stress,
        "why": np.zeros(depth.size, dtype=np.int8),
        "zero_variance": nothing,
        "zero_dof": np.full((2, 2), 12.0),
    }
    return Stroke(depth, **values | columns)


DOWN = np.linspace(0.0, 9.0, 901)


def alpha(run_fit):
    assert run_fit.slope is not None, run_fit.reason
    return run_fit.slope.alpha


def with_fit(config, **settings):
    """The same config with other settings of the fit."""
    return config.model_copy(update={"fit": config.fit.model_copy(update=settings)})


def reasons(codes):
    why = np.zeros(DOWN.size, dtype=np.int8)
    for place, code in codes.items():
        why[place] = code
    return why


def test_one_saturated_sample_of_the_window_is_too_many(paper_config):
    outside = fit_run(run(), stroke(DOWN, why=reasons({50: RowStatus.SATURATED})), paper_config)
    np.testing.assert_allclose(alpha(outside), [ALPHA_Z, ALPHA_X], rtol=1e-12)
    assert RowStatus(outside.why[50]) == RowStatus.SATURATED
    spoilt = stroke(DOWN, why=reasons({50: RowStatus.SATURATED, 500: RowStatus.SATURATED}))
    run_fit = fit_run(run(), spoilt, paper_config)
    assert run_fit.slope is None
    assert run_fit.reason == (remark("window-saturated", count=1),)
    assert (run_fit.beta_deg, run_fit.gamma_deg, run_fit.flags) == (30, 45, ())
    assert math.isnan(run_fit.depth_from_cm)
    assert math.isnan(run_fit.depth_to_cm)
    assert RowStatus(run_fit.why[500]) == RowStatus.SATURATED


def test_how_much_of_a_tare_may_be_missing(paper_config):
    # the window has 655 samples: 0.02 of them and two more are 15.1
    for missing, has_alpha in ((15, True), (16, False)):
        why = reasons(dict.fromkeys(range(200, 200 + missing), RowStatus.UNTARED))
        run_fit = fit_run(run(), stroke(DOWN, why=why), paper_config)
        assert (run_fit.slope is not None) == has_alpha
        assert run_fit.reason == (() if has_alpha else (remark("tare-short", count=missing),))
        if run_fit.slope is not None:
            assert run_fit.slope.points == 655 - missing


@pytest.mark.parametrize(("min_points", "least"), [(30, 30), (3, 8)])
def test_too_few_points(paper_config, min_points, least):
    config = with_fit(paper_config, min_points=min_points)
    enough = fit_run(run(), stroke(np.linspace(2, 7, least)), config)
    np.testing.assert_allclose(alpha(enough), [ALPHA_Z, ALPHA_X], rtol=1e-12)
    run_fit = fit_run(run(), stroke(np.linspace(2, 7, least - 1)), config)
    assert run_fit.slope is None
    assert run_fit.reason[0] == remark("few-points", found=least - 1, wanted=least)


def test_a_path_outside_of_the_container_is_told_as_that(paper_config):
    # an arm whose x counts from somewhere else
    run_fit = fit_run(run(), stroke(DOWN[::100], x=np.linspace(41, 32, 10)), paper_config)
    assert codes_of(run_fit.reason) == "few-points most-beyond-wall wall"
    values = run_fit.reason[1].values
    assert (values["count"], values["size"], values["first"], values["last"]) == (6, 10, 41, 32)
    assert values["high"] == -values["low"] == pytest.approx(4.2, abs=0.05)


def test_a_window_that_covers_too_little_depth_gives_no_alpha(paper_config):
    for end, has_alpha in ((2.37, False), (2.3805, False), (2.39, True)):
        run_fit = fit_run(run(), stroke(np.linspace(2.0, end, 400)), paper_config)
        assert (run_fit.slope is not None) == has_alpha
        assert codes_of(run_fit.reason[:1]) == ("" if has_alpha else "short-window")
        if not has_alpha:
            values = run_fit.reason[0].values
            assert (values["found"], values["wanted"]) == (pytest.approx(end - 2), 0.381)
    config = with_fit(paper_config, min_depth_cm=0.3)
    assert fit_run(run(), stroke(np.linspace(2.0, 2.37, 400)), config).reason == ()
    run_fit = fit_run(run(), stroke(np.linspace(2.0, 2.29, 400)), config)
    expected_values = {"found": 0.29, "wanted": 0.3, "least": "fit.min_depth_cm"}
    assert run_fit.reason[0].values == expected_values
    # level motion has one depth, by its nature
    level = stroke(np.full(400, 5.08), path=np.linspace(0, 8, 400))
    assert fit_run(run("horizontal", gamma=0.0, depth_cm=5.08), level, paper_config).reason == ()


@pytest.mark.parametrize(
    ("settings", "cause"),
    [({"max_depth_cm": 1.0}, "too-deep"), ({"submergence_cm": 8.8}, "too-shallow")],
)
def test_a_window_of_the_users_own_is_not_called_the_containers(paper_config, settings, cause):
    run_fit = fit_run(run(), stroke(DOWN), with_fit(paper_config, **settings))
    assert run_fit.reason[1].codes == ("most-samples", cause)


@pytest.mark.parametrize(
    ("direction", "beta", "gamma", "lacks"),
    [
        ("intrusion", 0, 90, False),
        ("extraction", 90, 90, False),
        ("intrusion", -90, 90, False),
        ("intrusion", 30, 90, True),
        ("intrusion", 0, 45, True),
        ("horizontal", 0, 0, True),
    ],
)
def test_a_force_along_x_that_nobody_measured(paper_config, direction, beta, gamma, lacks):
    sheet_run = run(direction, beta, gamma)
    assert not lacks_force_x(paper_config, sheet_run)
    # the paper's mount has F2 along x
    for channel, expected in (("F2", lacks), ("F1", False)):
        log = ForceLog.model_validate({"columns": {channel: {"constant": 0.0, "unit": "N"}}})
        assert (
            lacks_force_x(paper_config.model_copy(update={"force_log": log}), sheet_run) == expected
        )


def test_a_depth_of_0_alone_has_no_slope(paper_config):
    config = paper_config.model_copy(update={"table": TableSettings(holds="stress")})
    run_fit = fit_run(run(), stroke(np.zeros(2), np.ones(2)), config)
    assert codes_of(run_fit.reason) == "zero-depths"


@pytest.mark.parametrize(
    ("gamma", "direction", "signs", "code"),
    [
        (90.0, "intrusion", (1, 1), ""),
        (90.0, "intrusion", (-1, 1), "gives-back"),
        (45.0, "intrusion", (1, 1), ""),
        (45.0, "intrusion", (-1, 1), "gives-back"),
        (45.0, "intrusion", (1, -1), ""),
        (0.0, "horizontal", (1, 1), ""),
        (0.0, "horizontal", (1, -1), "gives-back"),
        (90.0, "extraction", (-1, 1), ""),
        (90.0, "extraction", (1, 1), "gives-back"),
    ],
)
def test_a_force_with_the_wrong_sign_is_flagged(paper_config, gamma, direction, signs, code):
    depth = np.full(701, 5.08) if direction == "horizontal" else DOWN
    samples = stroke(depth, path=np.linspace(0, 7, depth.size))
    turned = dataclasses.replace(samples, force=samples.force * np.array(signs)[:, None])
    assert codes_of(fit_run(run(direction, 0.0, gamma), turned, paper_config).flags) == code
    in_check = fit_run(run(direction, 0.0, gamma), turned, paper_config, verdicts_only=True)
    assert codes_of(in_check.flags) == code
    # within the noise it is no sign
    for size in (0.1, 10.0) if code else ():
        noise = size * np.abs(turned.force).max() * np.random.default_rng(3).normal(size=depth.size)
        noisy = dataclasses.replace(turned, force=turned.force + noise)
        # as `run` fits it, and as `check` does
        for verdicts_only in (False, True):
            flags = fit_run(
                run(direction, 0.0, gamma), noisy, paper_config, verdicts_only=verdicts_only
            ).flags
            assert ("gives-back" in codes_of(flags)) == (size < 1)


def test_a_curve_is_told_with_its_size_and_sign(paper_config):
    used = DOWN[123:778]
    # a parabola lies Z / S - 1 above its own line at the end Z, S = sum z^3 / sum z^2
    percent = 100 * (used[-1] / ((used**3).sum() / (used**2).sum()) - 1)
    run_fit = fit_run(run(), stroke(DOWN, 0.05 * DOWN**2), paper_config)
    (flag,) = run_fit.flags
    assert (flag.code, flag.values["component"]) == ("not-linear", "z")
    assert flag.values["percent"] == pytest.approx(percent, abs=0.5)
    # the same curve below the noise of one sample, 0.05 N, bends nothing that could be measured
    small = 0.05 / AREA / (percent / 100) / used[-1] * (used**2).sum() / (used**3).sum()
    for factor, told_of in ((0.95, False), (1.05, True)):
        faint = fit_run(run(), stroke(DOWN, factor * small * DOWN**2), paper_config)
        assert bool(faint.flags) == told_of
    # and one that lifts the end by less than 10 %: half parabola, half line
    share = 0.1 / (percent / 100)
    line = (used**3).sum() / (used**2).sum()
    for factor, told_of in ((0.97, False), (1.03, True)):
        mixed = factor * share * DOWN**2 / line + (1 - factor * share) * DOWN
        assert bool(fit_run(run(), stroke(DOWN, mixed), paper_config).flags) == told_of


@pytest.mark.parametrize(
    ("direction", "code"), [("intrusion", "not-linear"), ("extraction", "pull-not-linear")]
)
def test_a_bent_curve_of_a_pull_has_a_flag_of_its_own_which_names_its_start(
    paper_config, direction, code
):
    depth = DOWN if direction == "intrusion" else DOWN[::-1]
    bent = fit_run(run(direction), stroke(depth, ALPHA_Z * depth**1.5), paper_config)
    assert bent.flags[0].code == code
