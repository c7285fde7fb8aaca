"""Does the interval of each level, from alpha to the peak error, contain the truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from ensembles import AREA_CM2, RUN_TO_RUN, one_log
from paper_grid import BETA, GAMMA, flat, grid
from turning import sweep

from rftfit.compare.legs import bed_spread, leg_errors, leg_prediction
from rftfit.measure.alpha import column
from rftfit.model.draws import interval, measured_profile
from rftfit.model.fourier import fit_dft_index, fit_lsq
from rftfit.model.motion import THETA_DEG
from rftfit.model.outlines import leg_outline
from rftfit.model.profiles import TableProfile
from rftfit.model.scaling import (
    MediumFit,
    fit_media,
    generic,
    generic_interval,
    vertical_penetration,
)
from rftfit.reference import LEGS, alpha_grid
from rftfit.robot.config import paper_robot
from rftfit.robot.intervals import (
    BEST_DRAWS,
    DRAWS,
    best_width,
    coarser,
    each_draw,
    speed_widths,
    speeds_of,
)
from rftfit.robot.run import Condition
from rftfit.robot.sweep import optimum

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ensembles import Ensemble

    from rftfit.campaign.config import Config
    from rftfit.model.profiles import Profile

    FloatArray = np.ndarray
    Inside = dict[str, FloatArray]

SAMPLES_PER_DEG = 9
TRUE_RATIO = 1.12
"""Measured over predicted force of the simulated legs: the model is wrong by as much."""

LEVEL = 0.95


def within(lo: FloatArray, truth: FloatArray, hi: FloatArray) -> FloatArray:
    return np.asarray((lo <= truth) & (truth <= hi))


def alpha_inside(table: pd.DataFrame) -> Inside:
    """Every cell of the grid; beta = -90 degrees repeats 90."""
    found: dict[str, list[FloatArray]] = {"alpha, slanted": [], "alpha, horizontal": []}
    for c, truth in zip("zx", alpha_grid(str(table["medium"].iloc[0])), strict=True):
        inside = within(grid(table, column(c, "_lo")), truth, grid(table, column(c, "_hi")))[1:]
        found["alpha, slanted"].append(np.delete(inside, 6, axis=1).ravel())
        found["alpha, horizontal"].append(inside[:, 6])
    return {name: np.concatenate(parts) for name, parts in found.items()}


def true_fit(fit: MediumFit) -> FloatArray:
    """Coefficients of the true table by the same method, with the same terms."""
    alpha = flat(alpha_grid(fit.medium))
    if fit.method == "lsq":
        return fit_lsq(BETA, GAMMA, *alpha, fit.keep)
    return np.where(fit.keep, fit_dft_index(BETA, GAMMA, *alpha), 0.0)


def medium_inside(fit: MediumFit) -> Inside:
    """Coefficients, zeta and chi of one medium."""
    true = true_fit(fit)
    lo, hi = interval(fit.draws, LEVEL)
    zeta = float(vertical_penetration(true))
    chi = alpha_grid(fit.medium)[0][3, -1] / zeta
    own = (np.array([zeta]), *interval(fit.zeta_draws[:, None], LEVEL))
    ratio = (np.array([chi]), *interval((fit.alpha_z_draws / fit.zeta_draws)[:, None], LEVEL))
    return {
        f"M ({fit.method})": within(lo, true, hi)[fit.keep],
        f"zeta ({fit.method})": within(own[1], own[0], own[2]),
        f"chi ({fit.method})": within(ratio[1], ratio[0], ratio[2]),
    }


def generic_inside(fits: Sequence[MediumFit]) -> Inside:
    """Coefficients of M0, of the fits of all media by one method."""
    true = generic(np.stack([true_fit(fit) for fit in fits]))
    lo, hi = generic_interval(fits, LEVEL)
    return {f"M0 ({fits[0].method})": within(lo, true, hi)[true != 0]}


def true_curve(medium: str, leg: str, config: Config) -> dict[str, FloatArray]:
    """Force on a leg by the true table."""
    item = config.intruders[leg]
    assert item.shape == "leg"
    rate = config.arm.leg_speed_rad_per_s
    force = sweep(TableProfile.published(medium), leg_outline(item), None, item.hip_height_cm, rate)
    return {"z": force.force_z_N, "x": force.force_x_N}


def measured_leg(
    true: dict[str, FloatArray], medium: str, leg: str, random: np.random.Generator, spread: float
) -> pd.DataFrame:
    """Curve of one leg run less its tare, as the leg stage makes it; one bed for the whole run."""
    count = THETA_DEG.size * SAMPLES_PER_DEG
    parts = [one_log(random, 2, count) for _ in ("run", "tare")]
    readings = AREA_CM2 * (parts[0][0] - parts[1][0]).reshape(2, THETA_DEG.size, -1).mean(axis=2)
    se = AREA_CM2 * np.sqrt(parts[0][1] + parts[1][1])
    bed = TRUE_RATIO * (1 + random.normal(0, spread))
    curve = {"medium": medium, "leg": leg, "theta_deg": THETA_DEG}
    for i, c in enumerate("zx"):
        curve |= {f"force_{c}_N": bed * true[c] + readings[i], f"zero_se_{c}_N": se[i]}
    return pd.DataFrame(curve)


def leg_inside(
    table: pd.DataFrame,
    own: MediumFit,
    config: Config,
    random: np.random.Generator,
    run_to_run: float,
    leg: str,
) -> Inside:
    """Force on a leg against theta by the measured table, and its peak error."""
    item = config.intruders[leg]
    assert item.shape == "leg"
    true = true_curve(own.medium, leg, config)
    curve = leg_prediction(measured_profile(table, config), item, config)
    inside = []
    for c in "zx":
        lo, hi = (curve[f"force_{c}_{end}_N"].to_numpy() for end in ("lo", "hi"))
        inside.append(within(lo, true[c], hi)[hi - lo > 1e-6])
    spread = run_to_run / float(alpha_grid(own.medium)[0][3, -1])
    measured = measured_leg(true, own.medium, leg, random, spread)
    ours = curve.assign(medium=own.medium, leg=leg, profile="table")
    errors = leg_errors(measured, ours, {own.medium: bed_spread(table)}, LEVEL)
    lo, hi = (errors[f"peak_error_{end}_percent"].to_numpy() for end in ("lo", "hi"))
    truth = np.full(len(errors), 100 * (1 / TRUE_RATIO - 1))
    return {"leg force": np.concatenate(inside), "peak error": within(lo, truth, hi)}


ROBOT_CONDITIONS = tuple(
    Condition(frequency, curvature)
    for frequency, curvature in (
        (2.0, 1.0), (4.9, -0.92), (1.0, 0.5), (3.5, 0.0), (2.2, -1.0), (4.9, 0.92), (0.6, 0.0),
        (3.0, -0.5), (1.5, -0.5), (4.0, 0.3),
    )
)  # fmt: skip
"""Over the range of curvature and stride frequency that was measured."""

BEST_IN = "poppy_LP"
"""The medium in which the fastest leg is curved less than the most."""


@cache
def true_speed(medium: str, condition: Condition) -> float:
    """Speed on the true table, at the time step that all simulated campaigns have."""
    truth = TableProfile.published(medium)
    return float(speeds_of(coarser(paper_robot()), [truth], [condition], 1)[0, 0])


@cache
def true_best(medium: str) -> float:
    """Best curvature at 5 Hz on the true table."""
    return optimum(coarser(paper_robot()), TableProfile.published(medium), 1)[0]


def robot_draws(
    table: pd.DataFrame, config: Config, count: int = DRAWS
) -> tuple[Profile, list[Profile]]:
    """The measured table and draws of it, as the stage takes them."""
    best = measured_profile(table, config)
    assert isinstance(best.spread, TableProfile)
    return best, each_draw(best.spread, count)


def robot_inside(
    table: pd.DataFrame, own: MediumFit, config: Config, conditions: Sequence[Condition]
) -> Inside:
    """Speed of the paper's robot under some conditions, by the measured table."""
    profile, draws = robot_draws(table, config)
    found = speeds_of(coarser(paper_robot()), [profile], conditions, 1)[0]
    widths = speed_widths(paper_robot(), profile, draws, conditions, LEVEL, 1)
    assert not any(width.reason for width in widths), widths
    half = np.array([width.half for width in widths])
    truth = np.array([true_speed(own.medium, condition) for condition in conditions])
    return {"robot speed": within(found - half, truth, found + half)}


def best_inside(table: pd.DataFrame, own: MediumFit, config: Config) -> Inside:
    """Best curvature of its legs at 5 Hz."""
    profile, draws = robot_draws(table, config, BEST_DRAWS)
    found = np.array([optimum(coarser(paper_robot()), profile, 1)[0]])
    width = best_width(paper_robot(), profile, draws, LEVEL, 1)
    assert not width.reason, width
    truth = np.array([true_best(own.medium)])
    return {"best curvature": within(found - width.half, truth, found + width.half)}


def fits_by_method(tables: Sequence[pd.DataFrame], config: Config) -> dict[str, list[MediumFit]]:
    """Nine-term fits of all media; the paper's own selection of terms is left to its own tests."""
    groups: dict[str, list[MediumFit]] = {}
    for fit in fit_media(list(tables), config):
        groups.setdefault(fit.method, []).append(fit)
    return {method: groups[method] for method in ("lsq", "dft-index")}


@dataclass(frozen=True)
class Scenario:
    """How beds differ, and what the program is told of it."""

    name: str
    run_to_run: float = 0.0
    stated: float | None = None
    repeats: int = 1
    repeated: tuple[float, ...] = (90.0, -90.0)


SCENARIOS = (
    Scenario("one bed", 0.0),
    Scenario("spread stated", RUN_TO_RUN, RUN_TO_RUN),
    Scenario("spread from 24 repeats", RUN_TO_RUN, repeats=3),
    Scenario("spread from 6 repeats", RUN_TO_RUN, repeats=2, repeated=(90.0,)),
)


def cover(
    ensembles: Sequence[Ensemble], scenario: Scenario, config: Config, seed: int, legs: bool = True
) -> dict[str, FloatArray]:
    """Share of intervals that contain the truth, by level, shape (campaigns,).

    One campaign takes each medium once; alpha and legs are those of one medium after the other.
    """
    random = np.random.default_rng([seed, 1])
    found: dict[str, list[float]] = {}
    many = [
        ensemble.tables(
            seed, scenario.run_to_run, scenario.stated, scenario.repeats, scenario.repeated
        )
        for ensemble in ensembles
    ]
    for number, tables in enumerate(zip(*many, strict=True)):
        turn = number % len(tables)
        fits = fits_by_method(tables, config)
        parts = [alpha_inside(tables[turn])]
        for group in fits.values():
            parts += [medium_inside(group[turn])]
            parts += [generic_inside(group)] if len(group) > 1 else []
        if legs:
            leg = LEGS[number // len(tables) % len(LEGS)]
            own = fits["lsq"][turn]
            parts.append(leg_inside(tables[turn], own, config, random, scenario.run_to_run, leg))
        for part in parts:
            for level, inside in part.items():
                found.setdefault(level, []).append(float(inside.mean()))
    return {level: np.array(shares) for level, shares in found.items()}


def cover_robot(
    ensemble: Ensemble, scenario: Scenario, config: Config, seed: int, bests: int = 0
) -> dict[str, FloatArray]:
    """The same of the robot, in one medium; two conditions a campaign, shape (campaigns,).

    Running it is slow: the best curvature, in the medium that has one, is looked for in the first
    `bests` campaigns only.
    """
    found: dict[str, list[float]] = {"robot speed": []}
    tables = ensemble.tables(
        seed, scenario.run_to_run, scenario.stated, scenario.repeats, scenario.repeated
    )
    for number, table in enumerate(tables):
        own = fits_by_method([table], config)["lsq"][0]
        pair = [ROBOT_CONDITIONS[(number + k) % len(ROBOT_CONDITIONS)] for k in (0, 5)]
        found["robot speed"].append(
            float(robot_inside(table, own, config, pair)["robot speed"].mean())
        )
        if number < bests and own.medium == BEST_IN:
            inside = best_inside(table, own, config)["best curvature"]
            found.setdefault("best curvature", []).append(float(inside[0]))
    return {level: np.array(shares) for level, shares in found.items()}
