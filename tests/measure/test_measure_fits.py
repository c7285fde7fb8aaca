"""The fit of one plate run gives the exact slope and window of its stroke, or the right reason.

Stroke: the part of a run in which the plate moves through the sand. No logs are read.
"""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from pushes import plate_run

from rftfit.measure.fits import Stroke, fit_run
from rftfit.measure.flags import codes_of
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


def with_fit(config, **settings):
    """The same config with other settings of the fit."""
    return config.model_copy(update={"fit": config.fit.model_copy(update=settings)})


@pytest.mark.parametrize(
    ("status", "rows", "code"),
    [
        # outside of the window, and in it
        (RowStatus.SATURATED, [50], ""),
        (RowStatus.SATURATED, [50, 500], "window-saturated"),
        # the window has 655 samples: 0.02 of them and two more are 15.1
        (RowStatus.UNTARED, range(200, 215), ""),
        (RowStatus.UNTARED, range(200, 216), "tare-short"),
    ],
)
def test_how_much_of_a_window_may_be_lost(paper_config, status, rows, code):
    why = np.zeros(DOWN.size, dtype=np.int8)
    why[[*rows]] = status
    run_fit = fit_run(run(), stroke(DOWN, why=why), paper_config)
    assert codes_of(run_fit.reason) == code
    assert (run_fit.slope is None) == bool(code)
    assert RowStatus(run_fit.why[rows[-1]]) == status
    assert math.isnan(run_fit.depth_to_cm) == bool(code)


def test_a_path_outside_of_the_container_is_told_as_that(paper_config):
    # an arm whose x counts from somewhere else
    run_fit = fit_run(run(), stroke(DOWN[::100], x=np.linspace(41, 32, 10)), paper_config)
    assert codes_of(run_fit.reason) == "few-points most-beyond-wall wall"
    values = run_fit.reason[1].values
    assert (values["count"], values["size"], values["first"], values["last"]) == (6, 10, 41, 32)


@pytest.mark.parametrize(
    ("settings", "end_cm", "size", "code"),
    [
        ({}, 7, 30, ""),
        ({}, 7, 29, "few-points"),
        ({"min_points": 3}, 7, 8, ""),
        ({"min_points": 3}, 7, 7, "few-points"),
        # a tenth of the plate is 0.381 cm
        ({}, 2.39, 400, ""),
        ({}, 2.3805, 400, "short-window"),
        ({"min_depth_cm": 0.3}, 2.31, 400, ""),
        ({"min_depth_cm": 0.3}, 2.29, 400, "short-window"),
    ],
)
def test_how_many_samples_over_how_much_depth_give_alpha(
    paper_config, settings, end_cm, size, code
):
    depth = np.linspace(2, end_cm, size)
    run_fit = fit_run(run(), stroke(depth), with_fit(paper_config, **settings))
    assert codes_of(run_fit.reason[:1]) == code
    if run_fit.slope is not None:
        np.testing.assert_allclose(run_fit.slope.alpha, [ALPHA_Z, ALPHA_X], rtol=1e-12)
    assert (run_fit.slope is None) == bool(code)


def test_a_level_motion_has_one_depth_by_its_nature(paper_config):
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
    ("gamma", "direction", "signs", "code"),
    [
        (90.0, "intrusion", (1, 1), ""),
        (90.0, "intrusion", (-1, 1), "gives-back"),
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
    force = samples.force * np.array(signs)[:, None]
    noise = np.abs(force).max() * np.random.default_rng(3).normal(size=depth.size)
    # within the noise it is no sign
    for size, expected_code in ((0.0, code), (0.1, code), (10.0, "")):
        turned = dataclasses.replace(samples, force=force + size * noise)
        sheet_run = run(direction, 0.0, gamma)
        flags = fit_run(sheet_run, turned, paper_config).flags
        assert ("gives-back" in codes_of(flags)) == bool(expected_code)


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


# --- The window has the limits that are computed by hand for the paper's plate and container

# plate of 3.81 cm by 0.64 cm in a box of 24 cm by 15 cm: half length 1.905, half thickness 0.32; bottom 15 - 6 = 9, wall 12 - 6 = 6
HAND = [
    (0, 0.32, 8.68, 4.095),
    (30, 1.229628, 7.770372, 4.190222),
    (-30, 1.229628, 7.770372, 4.190222),
    (90, 1.905, 7.095, 5.68),
    (-90, 1.905, 7.095, 5.68),
]
"""Beta, least and greatest depth, greatest distance from the middle, cm."""
EDGE = 1e-6
"""A little more or less than a limit, cm."""


def statuses(config, depth, x=0.0, path=0.0, direction="intrusion", beta=0.0, medium="poppy_LP"):
    """Status of each sample of a stroke."""
    depth = np.array(depth, dtype=float)
    samples = stroke(depth, x=x + 0 * depth, path=path + 0 * depth)
    run_fit = fit_run(run(direction, beta, medium=medium), samples, config)
    return [RowStatus(code).name for code in run_fit.why]


@pytest.mark.parametrize(("beta", "shallow", "deep", "wide"), HAND)
def test_a_plate_is_submerged_and_keeps_off_walls_and_bottom(
    paper_config, beta, shallow, deep, wide
):
    depth = [shallow - EDGE, shallow + EDGE, deep - EDGE, deep + EDGE]
    assert statuses(paper_config, depth, beta=beta) == ["ABOVE", "GOOD", "GOOD", "BOTTOM"]
    across = np.array([-wide - EDGE, -wide + EDGE, wide - EDGE, wide + EDGE])
    assert statuses(paper_config, [4.0] * 4, across, beta=beta) == ["WALL", "GOOD", "GOOD", "WALL"]


@pytest.mark.parametrize(
    ("settings", "depth", "x", "expected_statuses"),
    [
        # above counts before wall and bottom
        ({}, [-1.0, 9.0], 9.0, ["ABOVE", "BOTTOM"]),
        (
            {"submergence_cm": 2.0, "max_depth_cm": 5.0},
            [1.9, 2.1, 4.9, 5.1],
            0.0,
            ["TOO_SHALLOW", "GOOD", "GOOD", "TOO_DEEP"],
        ),
        # who states a greatest depth knows how near the bottom it may be
        ({"max_depth_cm": 9.0}, [8.9, 9.1], 0.0, ["GOOD", "TOO_DEEP"]),
        ({"submergence_cm": 2.0}, [8.9, 9.1], 0.0, ["BOTTOM", "BOTTOM"]),
        ({"wall_clearance_cm": 2.0}, [12.67, 12.69], 0.0, ["GOOD", "BOTTOM"]),
        ({"wall_clearance_cm": 2.0}, [4, 4], np.array([8.09, 8.1]), ["GOOD", "WALL"]),
    ],
)
def test_what_the_config_says_of_the_window(paper_config, settings, depth, x, expected_statuses):
    assert statuses(with_fit(paper_config, **settings), depth, x) == expected_statuses


def test_a_level_run_starts_up_and_ends_at_the_wall(paper_config):
    x, path_cm = np.array([4.0, 2.0, 2.0, -4.1, 4.1]), np.array([0.0, 1.99, 2.01, 7.0, 1.0])
    level = statuses(paper_config, [5.0] * 5, x, path_cm, "horizontal")
    assert level == ["STARTUP", "STARTUP", "GOOD", "WALL", "STARTUP"]


@pytest.mark.parametrize(
    ("settings", "depth", "expected_statuses"),
    [
        ({}, [-0.01, 0, 2.0, 2.01], ["ABOVE", "GOOD", "GOOD", "NONLINEAR"]),
        # it keeps to the stated window
        (
            {"submergence_cm": 0.5, "max_depth_cm": 1.5},
            [0.4, 0.6, 1.4, 1.6, 2.1],
            ["TOO_SHALLOW", "GOOD", "GOOD", "TOO_DEEP", "TOO_DEEP"],
        ),
    ],
)
def test_linear_regime_of_a_sand(paper_config, settings, depth, expected_statuses):
    config = with_fit(paper_config, **settings)
    sand = config.media["yuma"].model_copy(update={"linear_to_cm": 2.0})
    config = config.model_copy(update={"media": {"yuma": sand}})
    assert statuses(config, depth, medium="yuma") == expected_statuses
