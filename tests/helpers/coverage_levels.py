"""Does the interval of each level, from alpha to the peak error, contain the truth: in memory and through files."""

from dataclasses import dataclass, field, replace
from functools import cache
from itertools import compress
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
import pandas as pd
import paper
from paper import (
    BETA,
    GAMMA,
    NOTHING,
    PAPER,
    Sizes,
    beds,
    delayed,
    enact,
    flat,
    grid,
    paper_values,
    pink,
    power_law,
    session_cm,
    turned,
    unevenness,
)
from scipy.signal import lfilter

from rftfit import Results, TableProfile
from rftfit.campaign.config import ErrorSettings, Fit
from rftfit.compare.legs import extreme, leg_errors, leg_prediction, measured_peak
from rftfit.directions import TOLERANCE_DEG
from rftfit.forces.motion import THETA_DEG, rotation_poses
from rftfit.forces.outlines import leg_outline
from rftfit.forces.plane import force_draws, forces_on
from rftfit.lab.plan import PlannedRun, Segment
from rftfit.lab.truth import rod_law
from rftfit.measure.alpha import alpha_table, bed_spread, column
from rftfit.measure.errors import surface_error
from rftfit.measure.fits import curved
from rftfit.measure.lab_frame import find_zero
from rftfit.measure.laws import LINE_THROUGH_ZERO, DepthLaw, replace_slope
from rftfit.measure.slopes import fit_slope, startup_bias, zero_intercept
from rftfit.model.draws import interval, measured_profile
from rftfit.model.fourier import fit_dft_index, fit_lsq
from rftfit.model.scaling import fit_terms, generic, generic_interval, vertical_penetration
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS, MEDIA, alpha_grid, load
from rftfit.robot.config import paper_robot
from rftfit.robot.intervals import CHOSEN, best_width, coarser, each_draw, speed_widths, speeds_of
from rftfit.robot.run import Condition
from rftfit.robot.sweep import best_of_runs, runs_about_best
from rftfit.workflow import measure as measure_stages

# --- Forces on a turning leg without intervals, for tests and benchmarks ------------------------------------------


def poses_of_turn(theta=None, *path, **options):
    """Poses at angles theta, rad; by default -135 to 135 degrees by 1. `path`: height of the hip and rate."""
    theta = np.radians(THETA_DEG) if theta is None else theta
    return rotation_poses(theta, *path, **options)


def sweep(profile, leg, *path, **options):
    """Force and moment about the axle on a leg `poses_of_turn` so, one for each theta."""
    return forces_on(profile, leg, poses_of_turn(*path, **options))


def sweep_draws(profile, leg, *path, **options):
    """`sweep` for a stack of draws of a profile: arrays of shape (draws, theta)."""
    return force_draws(profile, leg, poses_of_turn(*path, **options))


# --- Many simulated campaigns of one medium at once, from samples to alpha tables, for coverage -------------------
# Every run is made as samples (correlated noise, an offset that drifts, an error of the clocks, a bed
# that differs from run to run, the start-up and stick-slip of a horizontal run) and measured by the
# program's own functions: zero, slope, start-up, alpha table. Only the files between them are left out.
# The disturbances are those of `disturbances`; sizes are given by name.

FloatArray = np.ndarray
AREA_CM2, PRECISION_N, DRIFT_N_PER_MIN = 9.6774, 0.05, 0.02
AIR_S, CLOCK_SD_S, SKIP_CM, CORRELATION = 1.9, 0.003, 2.0, 0.7
REPEATS = 3
RUN_TO_RUN = 0.005
"""N/cm^3: the paper's "within 0.005" taken as one standard deviation, the wider reading."""


def paper_config(draws):
    """Return the demonstration's config with another number of draws."""
    return paper.paper_config(
        fourier=paper.paper_config().fourier.model_copy(update={"draws": draws})
    )


@dataclass(frozen=True)
class Plan:
    """One run of every campaign; depth and travel in cm, of the samples of its stroke."""

    run_id: str
    beta_deg: float
    gamma_deg: float
    depth: FloatArray
    travel: FloatArray
    alpha: tuple[float, float]
    number: int = 0

    @property
    def level(self):
        """Whether it is a horizontal run."""
        return self.gamma_deg == 0

    @property
    def direction(self):
        """As in the run sheet."""
        return "horizontal" if self.level else "intrusion" if self.gamma_deg > 0 else "extraction"


def plan(medium, repeats=1):
    """Runs of the paper's protocol; the straight pushes and pulls are made `repeats` times."""
    truth = alpha_grid(medium)
    runs = []
    for i, beta in enumerate(BETA_DEG):
        if beta == -90:
            continue
        half_z = 1.905 * abs(np.sin(np.radians(beta))) + 0.32 * abs(np.cos(np.radians(beta)))
        for j, gamma in enumerate(GAMMA_DEG):
            alpha = (float(truth[0][i, j]), float(truth[1][i, j]))
            name = f"b{beta:+03.0f}_g{gamma:+06.2f}"
            if gamma == 0:
                travel = np.arange(640) / 100
                runs += [
                    Plan(f"{name}_h{depth}", beta, 0.0, np.full(640, depth), travel, alpha)
                    for depth in (2.54, 5.08, 7.62)
                ]
                continue
            steep = abs(np.sin(np.radians(gamma)))
            reach = 8.0 * np.tan(np.radians(abs(gamma))) if abs(gamma) < 89 else 99.0
            deep = min(9.0 - half_z, reach)
            depth = np.arange(half_z, max(deep, half_z + 0.7), steep / 100)
            depth = depth if gamma > 0 else depth[::-1]
            count = repeats if abs(gamma) == 90 else 1
            travel = np.abs(depth - depth[0])
            runs += [
                Plan(f"{name}_{number}", beta, gamma, depth, travel, alpha, number)
                for number in range(count)
            ]
    return runs


def noise(random, k, n):
    """First-order correlated noise of the transducer's precision, N/cm^2, shape (k, n)."""
    white = random.standard_normal((k, n + 20))
    scale = PRECISION_N / AREA_CM2 * np.sqrt(1 - CORRELATION**2)
    return np.asarray(lfilter([scale], [1, -CORRELATION], white, axis=1)[:, 20:])


def one_log(random, k, n, sizes=NOTHING, odd=None, slow_noise_N=0.0):
    """Noise of a stroke whose drifting zero has been removed; variance and dof of that zero.

    `odd`: Random numbers of disturbances, so that all else is the same with and without them.
    `slow_noise_N`: What is stated of it.
    """
    air = np.arange(round(100 * AIR_S)) / 100
    stroke = AIR_S + 4.0 + np.arange(n) / 100
    drift = random.uniform(-1, 1, (k, 1)) * DRIFT_N_PER_MIN / 60 / AREA_CM2
    record = noise(random, k, air.size) + drift * air
    later = noise(random, k, n) + drift * stroke
    if odd and sizes.get("pink"):
        hum = sizes["pink"] / AREA_CM2 * pink(odd, k, air.size + 400 + n)
        record, later = record + hum[:, : air.size], later + hum[:, -n:]
    everywhere = np.ones(air.size, dtype=bool)
    zero = find_zero(air, record, everywhere, float(stroke.mean()), DRIFT_N_PER_MIN / AREA_CM2)
    variance = zero.variance + (slow_noise_N / AREA_CM2) ** 2
    return later - zero.force[:, :1], variance, zero.dof


def rod_stress(run, medium):
    """Force on rod and mount along a run over the area of the plate, filed as the run is, shape (2, n)."""
    gamma, back = np.radians(abs(run.gamma_deg)), -1 if run.gamma_deg < 0 else 1
    held = back * run.beta_deg if run.beta_deg != 90 else 90.0
    rod = PlannedRun("", "rod", medium, medium, "plate", run.direction, held, abs(run.gamma_deg))
    ahead = (-back * np.cos(gamma), -back * np.sin(gamma), held)
    stroke = Segment("stroke", (0.0, 0.0, held), ahead, 1.0, 1.0, 1.0)
    force_z, force_x = rod_law(rod)(stroke, run.travel, -run.depth, run.travel)
    return np.array([force_z, back * force_x]) / AREA_CM2


def measure(run, campaigns, random, medium, sizes, odd, session, slow_noise_N=0.0, at_cm=None):
    """Simulate and fit one run in every campaign; all z, then all x, shape (2 campaigns,).

    `at_cm`: Where alpha is wanted by a power of depth, not by the line.
    """
    k, n = 2 * campaigns, run.depth.size
    parts = [one_log(random, k, n, sizes, odd, slow_noise_N) for _ in ("run", "tare")]
    alpha = np.repeat(run.alpha, campaigns)
    depth_sd = CLOCK_SD_S * abs(np.sin(np.radians(run.gamma_deg)))
    late_s = sizes.get("lag", 0.0)
    up, factor = (np.tile(values, 2)[:, None] for values in beds(sizes, lambda _: odd, campaigns))
    effective_depth = (
        run.depth - 100 * late_s * np.gradient(run.depth) + random.normal(0, depth_sd, (k, 1))
    )
    effective_depth = power_law(
        effective_depth + up + np.tile(session, 2)[:, None], sizes.get("power", 1.0)
    )
    if run.level:
        travel = np.maximum(run.travel - late_s, 0)  # 1 cm/s
        period, phase = random.uniform(0.25, 0.5, (k, 1)), random.uniform(0, 2 * np.pi, (k, 1))
        effective_depth = effective_depth * (1 - np.exp(-travel / 0.4))
        effective_depth = effective_depth * (
            1 + 0.015 * np.sin(2 * np.pi * travel / period + phase)
        )
    effective_depth = (
        effective_depth * factor * unevenness(sizes, lambda _: odd, run.travel, campaigns)
    )
    stress = alpha[:, None] * effective_depth
    if sizes.get("tare-bed"):
        rod = np.repeat(rod_stress(run, medium), campaigns, axis=0)
        stress = stress - sizes["tare-bed"] / 100 * rod
    # filed in a mirror, an extraction is turned the other way
    turn = sizes.get("turn", 0.0) * (-1 if run.gamma_deg < 0 else 1)
    stress = np.concatenate(turned(stress[:campaigns], stress[campaigns:], turn))
    stress = stress + parts[0][0] - parts[1][0]
    variance = np.stack([log[1] for log in parts])
    dof = np.stack([np.full(k, log[2]) for log in parts])
    if not run.level:
        slope = fit_slope(run.depth, stress, variance, dof, depth_sd, tare_stress=parts[1][0])
        if at_cm is None:
            return slope
        return replace_slope(slope, DepthLaw("power", at_cm).fit(run.depth, stress))
    steady = run.travel >= SKIP_CM
    startup = startup_bias(run.travel, stress, steady, SKIP_CM)
    # the arm's log has its noise in the depth of a horizontal run too
    depth = run.depth[steady] + random.normal(0, 3e-4, int(steady.sum()))
    tare_stress = parts[1][0][:, steady]
    return fit_slope(depth, stress[:, steady], variance, dof, depth_sd, startup, tare_stress)


COLUMNS = {
    "alpha": "alpha_{}_N_per_cm3",
    "se": "alpha_{}_se_N_per_cm3",
    "dof": "alpha_{}_dof",
    "startup": "alpha_{}_startup_N_per_cm3",
    "intercept": "intercept_{}_N_per_cm2",
    "free_slope": "free_slope_{}_N_per_cm3",
    "nonlinear_p": "nonlinear_{}_p",
    "nonlinear_ratio": "nonlinear_{}_ratio",
    "tare": "alpha_{}_tare_N_per_cm3",
    "curvature": "alpha_{}_curvature_N_per_cm3",
    "offset": "offset_{}",
    "offset_se": "offset_se_{}",
}
"""What is kept of a slope, and its column in the table of fits."""


EXACT = ErrorSettings(
    surface_run_mm=0,
    surface_session_mm=0,
    angle_deg=0,
    turn_deg=0,
    tare_percent=0,
    bed_percent=0,
    hip_cm=0,
    arc_percent=0,
)
"""Stated to be none."""


@dataclass(frozen=True)
class Ensemble:
    """What every run of many campaigns gave.

    `quantities`: By name in `COLUMNS`, shape (runs, 2, campaigns), z and x. `levers`: Of the runs, 1/cm. `sizes`:
    Of the disturbances. `session`: shape (campaigns,); Error of the surface common to the runs of a campaign,
    cm. `at_cm`: Depth of alpha by a power of depth; None for that by the line.
    """

    medium: str
    runs: list[Plan]
    quantities: dict[str, FloatArray]
    levers: list[float]
    sizes: Sizes
    session: FloatArray
    at_cm: float | None = None

    def as_medium(self, medium):
        """Give another medium's truth the errors of this one, each campaign those of the next.

        Errors of most disturbances are in proportion to the force, so they cannot be handed on.
        """
        assert not self.sizes
        runs = plan(medium, REPEATS)
        ours, theirs = (
            np.array([run.alpha for run in planned_runs])[:, :, None]
            for planned_runs in (self.runs, runs)
        )
        rolled = {name: np.roll(values, 1, axis=2) for name, values in self.quantities.items()}
        for name in ("alpha", "free_slope"):
            rolled[name] = rolled[name] - ours + theirs
        assert (self.quantities["curvature"] == 0).mean() > 0.9  # of noise
        rolled["nonlinear_ratio"] = rolled["nonlinear_ratio"] * ours / theirs
        return replace(self, medium=medium, runs=runs, quantities=rolled)

    def fits(self, seed, run_to_run=0.0, repeats=1, repeated=(90.0, -90.0)):
        """Table of fits of every campaign, as far as the slope stage makes it of samples.

        Beds differ from run to run with that deviation; cells at the `repeated` gammas are measured
        `repeats` times, all others once.
        """
        random = np.random.default_rng([seed, *self.medium.encode()])
        beds_off = random.normal(0, run_to_run, self.quantities["alpha"].shape)
        is_kept = [run.number < (repeats if run.gamma_deg in repeated else 1) for run in self.runs]
        kept = [*compress(self.runs, is_kept)]
        rows = [
            {
                "run_id": run.run_id,
                "beta_deg": run.beta_deg,
                "gamma_deg": run.gamma_deg,
                "direction": run.direction,
                "mirrored": run.gamma_deg < 0,
                "tare_run": f"{run.run_id}_rod",
                "depth_from_cm": run.depth.min(),
                "depth_to_cm": run.depth.max(),
            }
            for run in kept
        ]
        levers = [*compress(self.levers, is_kept)]
        fixed = pd.DataFrame(rows).assign(medium=self.medium, lever_per_cm=levers, reason="")
        rods = [zero_intercept(run.depth, rod_stress(run, self.medium))[0] for run in kept]
        fixed = fixed.assign(
            alpha_z_rod_N_per_cm3=[rod[0] for rod in rods],
            alpha_x_rod_N_per_cm3=[rod[1] for rod in rods],
        )
        numbers = self.quantities | {"alpha": self.quantities["alpha"] + beds_off}
        deepest = fixed["depth_to_cm"].to_numpy()
        for j in range(beds_off.shape[2]):
            columns = {
                COLUMNS[name].format(c): values[is_kept, i, j]
                for i, c in enumerate("zx")
                for name, values in numbers.items()
            }
            bent = []
            for c in "zx":
                p, ratio, alpha = (
                    columns[COLUMNS[name].format(c)]
                    for name in ("nonlinear_p", "nonlinear_ratio", "alpha")
                )
                bent.append(curved(p, ratio, alpha, deepest, PRECISION_N / AREA_CM2))
            offset = {"offset_cm": columns["offset_z"], "offset_se_cm": columns["offset_se_z"]}
            yield fixed.assign(**columns, **offset).assign(bent=np.any(bent, axis=0))

    def tables(self, seed, run_to_run=0.0, errors=EXACT, repeats=1, repeated=(90.0, -90.0)):
        """Alpha table of every campaign, as the slope stage makes it of `fits` with stated `errors`."""
        for fits in self.fits(seed, run_to_run, repeats, repeated):
            offset, se = (fits[name].to_numpy(float) for name in ("offset_cm", "offset_se_cm"))
            surface = surface_error(offset, se, errors)
            law = DepthLaw("power", self.at_cm) if self.at_cm else LINE_THROUGH_ZERO
            alpha = alpha_table(fits, self.medium, 0.95, 3, errors, PAPER, surface, law)
            bent = {*fits.loc[fits["bent"], "run_id"]}
            weak = [not bent.isdisjoint(runs.split()) for runs in alpha["run_ids"]]
            yield alpha.assign(flagged=weak)


def simulate(medium, campaigns, seed, sizes=NOTHING, slow_noise_N=0.0, at_cm=None, repeats=REPEATS):
    """Simulate and measure every run of so many campaigns, cells at gamma = +-90 `repeats` times.

    `sizes`: Of the disturbances; all else is the same with and without them. `slow_noise_N`: What is
    stated of it. `at_cm`: As of `measure`.
    """
    random = np.random.default_rng([seed, *medium.encode()])
    odd = np.random.default_rng([seed, 1, *medium.encode()])
    session = session_cm(sizes, odd, campaigns)
    runs = plan(medium, repeats)
    slopes = [
        measure(run, campaigns, random, medium, sizes, odd, session, slow_noise_N, at_cm)
        for run in runs
    ]
    quantities = {
        name: np.stack([getattr(slope, name).reshape(2, campaigns) for slope in slopes])
        for name in COLUMNS
    }
    levers = [slope.lever for slope in slopes]
    return Ensemble(medium, runs, quantities, levers, sizes, session, at_cm)


# --- Does the interval of each level, from alpha to the peak error, contain the truth -----------------------------

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
    spread = {medium: bed_spread(table, TOLERANCE_DEG)}
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
    return float(speeds_of(coarser(paper_robot()), truth, (), [condition], 1)[0][0])


@cache
def true_best(medium):
    """Best curvature at 5 Hz on the true table."""
    truth = TableProfile.published(medium)
    return best_of_runs(runs_about_best(coarser(paper_robot()), truth, 1))[0]


def robot_draws(table, config, count=CHOSEN.speed_draws):
    """The measured table and draws of it, as the stage takes them."""
    best = measured_profile(table, config)
    assert isinstance(best.spread, TableProfile)
    return best, each_draw(best.spread, count)


def robot_inside(table, fit, config, conditions):
    """Speed of the paper's robot under some conditions, by the measured table."""
    profile, draws = robot_draws(table, config)
    speed, _ = speeds_of(coarser(paper_robot()), profile, (), conditions, 1)
    widths, _ = speed_widths(paper_robot(), profile, draws, conditions, LEVEL, 1)
    assert not any(width.why for width in widths), widths
    half = np.array([width.half for width in widths])
    truth = np.array([true_speed(fit.medium, condition) for condition in conditions])
    return {"robot speed": within(speed - half, truth, speed + half)}


def best_inside(table, fit, config):
    """Best curvature of its legs at 5 Hz."""
    profile, draws = robot_draws(table, config, CHOSEN.best_draws)
    curvature = np.array([best_of_runs(runs_about_best(coarser(paper_robot()), profile, 1))[0]])
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


# --- Does the interval of each level contain the truth in campaigns that are written and read as files ------------

MEASURED = [name for _, names in measure_stages.MEASURED for name in names]


def written(folder, sizes, number, seed, draws):
    """Write the logs of the plates and legs of one medium; the path of the config.

    `number`: Of the campaign; media take turns.
    """
    medium = MEDIA[number % len(MEDIA)]
    values = paper_values("robot", "errors")
    values["media"] = {medium: values["media"][medium]}
    values["fourier"] = {**values.get("fourier", {}), "draws": draws}
    return enact(folder, values, sizes, seed=seed + number)


def measured(campaign, slow_noise_N=0.0):
    """Measure the logs of a campaign of one medium, all stages up to the slopes."""
    transducer = campaign.config.transducer.model_copy(update={"slow_noise_N": slow_noise_N})
    config = campaign.config.model_copy(update={"transducer": transducer})
    results = Results(replace(campaign, config=config))
    (medium,) = results.media
    measure_stages.measure_logs(results, medium)
    return results


def held_in_files(results, stated_errors, sizes, number):
    """Intervals of a measured campaign by level, of which so much is stated."""
    (medium,) = results.media
    config = results.config.model_copy(update={"errors": stated_errors})
    stated = Results(replace(results.campaign, config=config))
    for name in MEASURED:
        stated.hold(name.format(medium), results.table(name.format(medium)))
    verdicts, alpha, *_ = measure_stages.checks(stated, medium)
    stated.hold(f"checks/{medium}.csv", verdicts)
    intervals = quarters_inside(alpha)
    if "power" in sizes:
        intervals |= stress_inside(alpha, sizes["power"])
    intervals |= medium_inside(fit_terms(alpha, config, "lsq"))
    leg = LEGS[number // len(MEDIA) % len(LEGS)]
    curves, _ = measure_stages.legs(stated, medium)
    true = true_curve(medium, leg, config)
    z, x = (_true_error(medium, leg, c, true[c]) for c in "zx")
    return intervals | peaks_inside(alpha, leg, config, curves, true, (z, x))


def _true_error(medium, leg, component, predicted):
    """Error of the peak that the true table gives, against the published curve, percent."""
    table = load("fig_s5")
    rows = table[(table["medium"] == medium) & (table["leg"] == leg)].sort_values("theta_deg")
    theta, force = (rows[name].to_numpy(float) for name in ("theta_deg", f"force_{component}_N"))
    peak = measured_peak(theta, force, component).force_N
    return 100 * (float(predicted[extreme(predicted, component)]) / peak - 1)


# --- Force at stated depths where stress goes as a power of depth -------------------------------------------------
# Force at stated depths where stress goes as a power of depth: how often intervals hold it, and how wide they are.

DEPTHS_CM = Fit().depths_cm


def forces_held(medium, campaigns, seed, sizes):
    """Coverage and width of the force at each depth, over campaigns and the cells whose windows hold the depth.

    `sizes`: Of the disturbances, ``power`` among them.
    Column ``width``: median over cells of the mean half width over that which the standard deviation of the errors needs.
    """
    rows = {}
    for depth in DEPTHS_CM:
        power = simulate(medium, campaigns, seed, sizes, at_cm=depth, repeats=1)
        tables = power.tables(seed)
        lo, truth, hi = (np.stack(arrays) for arrays in zip(*map(alpha_cells, tables), strict=True))
        is_finite = np.isfinite(lo).all(axis=0)
        lo, hi = lo[:, is_finite], hi[:, is_finite]
        truth = truth[:, is_finite] * power_law(np.array(depth), sizes["power"]) / depth
        inside, half = (lo <= truth) & (truth <= hi), (hi - lo) / 2
        scatter = ((lo + hi) / 2).std(axis=0)
        needed = NormalDist().inv_cdf((1 + LEVEL) / 2) * scatter
        rows[depth] = {
            "cells": int(is_finite.sum()),
            "inside": inside.mean(),
            "worst": np.sort(inside.mean(axis=0))[inside.shape[1] // 20],
            "width": np.median(half.mean(axis=0)[needed > 0] / needed[needed > 0]),
        }
    return pd.DataFrame(rows).T
