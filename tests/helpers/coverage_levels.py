"""Does the interval of each level, from alpha to the peak error, contain the truth."""

from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from disturbances import NOTHING, Sizes, beds, delayed, power_law, turned, unevenness
from ensembles import AREA_CM2, EXACT, RUN_TO_RUN, one_log
from paper_grid import BETA, GAMMA, flat, grid
from turning import sweep

from rftfit.campaign.config import ErrorSettings
from rftfit.compare.legs import leg_errors, leg_prediction
from rftfit.forces.motion import THETA_DEG
from rftfit.forces.outlines import leg_outline
from rftfit.measure.alpha import bed_spread, column
from rftfit.model.draws import interval, measured_profile
from rftfit.model.fourier import fit_dft_index, fit_lsq
from rftfit.model.profiles import TableProfile
from rftfit.model.scaling import fit_terms, generic, generic_interval, vertical_penetration
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

FloatArray = np.ndarray

SAMPLES_PER_DEG, LEG_RATE = 9, 0.2
TRUE_RATIO = 1.12
"""Measured over predicted force of the simulated legs: the model is wrong by as much."""

LEVEL = 0.95
STRESS_DEPTHS_CM = (2.0, 4.0, 6.0)


class Held(NamedTuple):
    """Intervals of one level: whether each contains the truth, and how wide it is."""

    inside: FloatArray
    width: FloatArray


Inside = dict[str, Held]


def within(lo, truth, hi):
    return Held(np.asarray((lo <= truth) & (truth <= hi)), np.asarray(hi - lo))


def alpha_inside(table):
    """Every cell of the grid; beta = -90 degrees repeats 90."""
    lo, truth, hi = alpha_cells(table)
    level = np.zeros_like(truth, dtype=bool)
    level[:, :, 6] = True
    return {
        name: within(lo[cells], truth[cells], hi[cells])
        for name, cells in (("alpha, slanted", ~level), ("alpha, horizontal", level))
    }


def alpha_cells(table):
    """Lower end, truth, upper end of alpha_z and alpha_x, N/cm^3, each of shape (2, 6, 13)."""
    truth = np.stack(alpha_grid(str(table["medium"].iloc[0])))
    lo, hi = (np.stack([grid(table, column(c, end)) for c in "zx"]) for end in ("_lo", "_hi"))
    return lo[:, 1:], truth[:, 1:], hi[:, 1:]


QUARTERS = ("weakest quarter", "second quarter", "third quarter", "strongest quarter")


def quarters_inside(table):
    """Quarters of all cells of both components by the size of the true alpha."""
    lo, truth, hi = (values.ravel() for values in alpha_cells(table))
    quarters = np.array_split(np.abs(truth).argsort(kind="stable"), 4)
    return {
        f"alpha, {name}": within(lo[cells], truth[cells], hi[cells])
        for name, cells in zip(QUARTERS, quarters, strict=True)
    }


def stress_inside(table, power):
    """Stress at some depths where it goes as a power of the depth."""
    lo, truth, hi = alpha_cells(table)
    return {
        f"stress at {depth:g} cm": within(
            lo * depth, truth * power_law(np.array(depth), power), hi * depth
        )
        for depth in STRESS_DEPTHS_CM
    }


def true_fit(fit):
    """Coefficients of the true table by the same method, with the same terms."""
    alpha = flat(alpha_grid(fit.medium))
    if fit.method == "lsq":
        return fit_lsq(BETA, GAMMA, *alpha, fit.keep)
    return np.where(fit.keep, fit_dft_index(BETA, GAMMA, *alpha), 0.0)


def medium_inside(fit):
    """Coefficients, zeta and chi of one medium."""
    true = true_fit(fit)
    lo, hi = interval(fit.draws, LEVEL)
    zeta = float(vertical_penetration(true))
    chi = alpha_grid(fit.medium)[0][3, -1] / zeta
    zeta_interval = (np.array([zeta]), *interval(fit.zeta_draws[:, None], LEVEL))
    ratio = (np.array([chi]), *interval((fit.alpha_z_draws / fit.zeta_draws)[:, None], LEVEL))
    return {
        f"M ({fit.method})": within(lo[fit.keep], true[fit.keep], hi[fit.keep]),
        f"zeta ({fit.method})": within(zeta_interval[1], zeta_interval[0], zeta_interval[2]),
        f"chi ({fit.method})": within(ratio[1], ratio[0], ratio[2]),
    }


def generic_inside(fits):
    """Coefficients of M0, of the fits of all media by one method."""
    true = generic(np.stack([true_fit(fit) for fit in fits]))
    lo, hi = generic_interval(fits, LEVEL)
    is_nonzero = true != 0
    return {f"M0 ({fits[0].method})": within(lo[is_nonzero], true[is_nonzero], hi[is_nonzero])}


def true_curve(medium, leg, config):
    """Force on a leg by the true table."""
    intruder = config.intruders[leg]
    assert intruder.shape == "leg"
    rate = config.arm.leg_speed_rad_per_s
    force = sweep(
        TableProfile.published(medium), leg_outline(intruder), None, intruder.hip_height_cm, rate
    )
    return {"z": force.force_z_N, "x": force.force_x_N}


def measured_leg(true, medium, leg, random, spread, sizes, odd, session, intruder, slow_noise_N):
    """Curve of one leg run less its tare, as the leg stage makes it; one bed for the whole run.

    `sizes`: Of the disturbances, which go with the force as in logs; `odd`: their random
    numbers; `session`: of the campaign's surface, cm.
    """
    count = THETA_DEG.size * SAMPLES_PER_DEG
    parts = [one_log(random, 2, count, sizes, odd, slow_noise_N) for _ in ("run", "tare")]
    readings = AREA_CM2 * (parts[0][0] - parts[1][0]).reshape(2, THETA_DEG.size, -1).mean(axis=2)
    se = AREA_CM2 * np.sqrt(parts[0][1] + parts[1][1])
    up, factor = (float(values[0]) for values in beds(sizes, lambda _: odd))
    bed = TRUE_RATIO * (1 + random.normal(0, spread)) * factor
    if up + session:
        hip_cm = intruder.hip_height_cm - up - session
        turning = sweep(
            TableProfile.published(medium), leg_outline(intruder), None, hip_cm, LEG_RATE
        )
        true = {"z": turning.force_z_N, "x": turning.force_x_N}
    way = intruder.max_length_cm * np.radians(np.arange(count) / SAMPLES_PER_DEG)
    uneven = unevenness(sizes, lambda _: odd, way).reshape(2, THETA_DEG.size, -1).mean(axis=2)
    force = bed * np.array([true["z"], true["x"]]) * uneven
    # 0.2 rad/s and a degree between the angles
    force = delayed(force, sizes.get("lag", 0.0) * np.degrees(LEG_RATE))
    force = np.array(turned(force[0], force[1], sizes.get("turn", 0.0))) + readings
    curve = {"medium": medium, "leg": leg, "theta_deg": THETA_DEG}
    for i, c in enumerate("zx"):
        curve |= {f"force_{c}_N": force[i], f"zero_se_{c}_N": se[i]}
    return pd.DataFrame(curve)


def leg_inside(
    table,
    fit,
    config,
    random,
    run_to_run,
    leg,
    sizes=NOTHING,
    odd=None,
    session=0.0,
    stated_errors=EXACT,
    slow_noise_N=0.0,
):
    """Force on a leg against theta by the measured table, its peaks, and its peak error."""
    intruder = config.intruders[leg]
    assert intruder.shape == "leg"
    true = true_curve(fit.medium, leg, config)
    spread = run_to_run / float(alpha_grid(fit.medium)[0][3, -1])
    measured = measured_leg(
        true, fit.medium, leg, random, spread, sizes, odd or random, session, intruder, slow_noise_N
    )
    config = config.model_copy(update={"errors": stated_errors})
    too_low = 100 * (1 / TRUE_RATIO - 1)
    return peaks_inside(table, leg, config, measured, true, (too_low, too_low))


def peaks_inside(table, leg, config, measured, true, true_error_percent):
    """Force on a leg by a measured table, its peaks, and their errors against its measured curve.

    `true`: Force by the true table. `true_error_percent`: Of its peaks, z and x.
    """
    medium = str(table["medium"].iloc[0])
    intruder = config.intruders[leg]
    assert intruder.shape == "leg"
    curve, drawn = leg_prediction(measured_profile(table, config), intruder, config)
    parts, peaks = [], []
    for c in "zx":
        lo, hi = (curve[f"force_{c}_{end}_N"].to_numpy() for end in ("lo", "hi"))
        wide = hi - lo > 1e-6
        parts.append((lo[wide], true[c][wide], hi[wide]))
        peak = true[c][np.abs(true[c]).argmax()]
        peaks.append(
            tuple(np.array([force_N]) for force_N in (drawn[c][1][0], peak, drawn[c][1][1]))
        )
    ours = curve.assign(medium=medium, leg=leg, profile="table")
    peak_intervals = {(medium, leg, "table", c): drawn_peak for c, drawn_peak in drawn.items()}
    spread = {medium: bed_spread(table)}
    errors = leg_errors(measured, ours, spread, LEVEL, peaks=peak_intervals).set_index("component")
    lo, hi = (
        errors.loc[["z", "x"], f"peak_error_{end}_percent"].to_numpy(float) for end in ("lo", "hi")
    )
    return {
        "leg force": within(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True))),
        "leg peak": within(*(np.concatenate(arrays) for arrays in zip(*peaks, strict=True))),
        "peak error": within(lo, np.array(true_error_percent), hi),
    }


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
def true_speed(medium, condition):
    """Speed on the true table, at the time step that all simulated campaigns have."""
    truth = TableProfile.published(medium)
    return float(speeds_of(coarser(paper_robot()), [truth], [condition], 1)[0, 0])


@cache
def true_best(medium):
    """Best curvature at 5 Hz on the true table."""
    return optimum(coarser(paper_robot()), TableProfile.published(medium), 1)[0]


def robot_draws(table, config, count=DRAWS):
    """The measured table and draws of it, as the stage takes them."""
    best = measured_profile(table, config)
    assert isinstance(best.spread, TableProfile)
    return best, each_draw(best.spread, count)


def robot_inside(table, fit, config, conditions):
    """Speed of the paper's robot under some conditions, by the measured table."""
    profile, draws = robot_draws(table, config)
    speed = speeds_of(coarser(paper_robot()), [profile], conditions, 1)[0]
    widths, _ = speed_widths(paper_robot(), profile, draws, conditions, LEVEL, 1)
    assert not any(width.why for width in widths), widths
    half = np.array([width.half for width in widths])
    truth = np.array([true_speed(fit.medium, condition) for condition in conditions])
    return {"robot speed": within(speed - half, truth, speed + half)}


def best_inside(table, fit, config):
    """Best curvature of its legs at 5 Hz."""
    profile, draws = robot_draws(table, config, BEST_DRAWS)
    curvature = np.array([optimum(coarser(paper_robot()), profile, 1)[0]])
    width = best_width(paper_robot(), profile, draws, LEVEL, 1)
    assert not width.why, width
    truth = np.array([true_best(fit.medium)])
    return {"best curvature": within(curvature - width.half, truth, curvature + width.half)}


METHODS = ("lsq", "dft-index")


def fits_by_method(tables, config, methods=METHODS):
    """Nine-term fits of all media; the paper's own selection of terms is left to its own tests."""
    return {m: [fit_terms(table, config, m) for table in tables] for m in methods}


def stated(**sizes):
    """What is stated to the program, all else to be exact."""
    return EXACT.model_copy(update=sizes)


STATED_AS = {
    "surface": "surface_run_mm",
    "surface-session": "surface_session_mm",
    "turn": "turn_deg",
    "spread-percent": "bed_percent",
    "tare-bed": "tare_percent",
}
"""Disturbances whose sizes can be stated, and the keys that do."""


def as_disturbed(sizes):
    """State every disturbance at its true size (`slow_noise` that of 1/f noise); the rest is left to the runs."""
    stated_sizes = {key: sizes[name] for name, key in STATED_AS.items() if name in sizes}
    shown = (
        {"surface_run_mm": None, "surface_session_mm": None}
        if {*sizes} - {*STATED_AS, "pink"}
        else {}
    )
    return stated(**{**shown, **stated_sizes})


SLOW_OF_PINK = 0.77
"""Standard deviation of its mean over a stroke less that over the rest before it, relative to its own.

It depends little on how long these are: 0.63 to 0.84 for rests of 1 to 10 s and all strokes.
"""


def slow_noise(sizes):
    """What of 1/f noise is stated at its true size, N."""
    return SLOW_OF_PINK * sizes.get("pink", 0.0)


@dataclass(frozen=True)
class Scenario:
    """How beds differ, what else is disturbed (name and size), and what the program is told of it.

    `slow_noise_N`: As told; the ensemble was measured with it.
    """

    name: str
    run_to_run: float = 0.0
    errors: ErrorSettings = EXACT
    repeats: int = 1
    repeated: tuple[float, ...] = (90.0, -90.0)
    sizes: Sizes = field(default_factory=dict)
    slow_noise_N: float = 0.0


SCENARIOS = (
    Scenario("one bed", 0.0),
    Scenario("spread stated", RUN_TO_RUN, stated(bed_N_per_cm3=RUN_TO_RUN)),
    Scenario("spread from 24 repeats", RUN_TO_RUN, repeats=3),
    Scenario("spread from 6 repeats", RUN_TO_RUN, repeats=2, repeated=(90.0,)),
)


def held(ensembles, scenario, config, seed, legs=True, methods=METHODS):
    """Intervals of every campaign by level.

    One campaign takes each medium once; alpha and legs are those of one medium after the other.
    """
    random, odd = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2])
    assert all(ensemble.sizes == scenario.sizes for ensemble in ensembles)
    many = [
        ensemble.tables(
            seed, scenario.run_to_run, scenario.errors, scenario.repeats, scenario.repeated
        )
        for ensemble in ensembles
    ]
    for number, tables in enumerate(zip(*many, strict=True)):
        turn = number % len(tables)
        fits = fits_by_method(tables, config, methods)
        intervals = alpha_inside(tables[turn])
        intervals |= quarters_inside(tables[turn])
        if "power" in scenario.sizes:
            intervals |= stress_inside(tables[turn], scenario.sizes["power"])
        for group in fits.values():
            intervals |= medium_inside(group[turn])
            intervals |= generic_inside(group) if len(group) > 1 else {}
        if legs:
            leg = LEGS[number // len(tables) % len(LEGS)]
            fit = fits["lsq"][turn]
            session = float(ensembles[turn].session[number])
            intervals |= leg_inside(
                tables[turn],
                fit,
                config,
                random,
                scenario.run_to_run,
                leg,
                scenario.sizes,
                odd,
                session,
                scenario.errors,
                scenario.slow_noise_N,
            )
        yield intervals


def cover(ensembles, scenario, config, seed, legs=True):
    """Share of intervals that contain the truth, by level, shape (campaigns,)."""
    shares_by_level: dict[str, list[float]] = {}
    for intervals_by_level in held(ensembles, scenario, config, seed, legs):
        for level, intervals in intervals_by_level.items():
            shares_by_level.setdefault(level, []).append(float(intervals.inside.mean()))
    return {level: np.array(shares) for level, shares in shares_by_level.items()}


def cover_robot(ensemble, scenario, config, seed, bests=0):
    """The same of the robot, in one medium; two conditions a campaign, shape (campaigns,).

    Running it is slow: the best curvature, in the medium that has one, is looked for in the first
    `bests` campaigns only.
    """
    shares_by_level: dict[str, list[float]] = {"robot speed": []}
    tables = ensemble.tables(
        seed, scenario.run_to_run, scenario.errors, scenario.repeats, scenario.repeated
    )
    for number, table in enumerate(tables):
        fit = fit_terms(table, config, "lsq")
        pair = [ROBOT_CONDITIONS[(number + k) % len(ROBOT_CONDITIONS)] for k in (0, 5)]
        shares_by_level["robot speed"].append(
            float(robot_inside(table, fit, config, pair)["robot speed"].inside.mean())
        )
        if number < bests and fit.medium == BEST_IN:
            inside = best_inside(table, fit, config)["best curvature"].inside
            shares_by_level.setdefault("best curvature", []).append(float(inside[0]))
    return {level: np.array(shares) for level, shares in shares_by_level.items()}
