"""What measured forces on legs and wheels tell of a medium, and of the same body in another medium.

    python studies/contacts.py [PART ...] --rows FOLDER    ten minutes on one core

constants  sizes of what the model gets wrong on a leg, by their likelihood on the other legs: those that are stated are larger
carried    the same leg in media of the other material (Fig. S5) and in natural sands (Fig. S12): forces with what the model
           gets wrong on that leg, beside those without, and plain scaling of the measured curves
alone      alpha from the forces on one leg, without any plate; the leg calibrated in no, in one and in all other media
wrong      the same with theta 5 deg, the radius 5 %, the hip 2 mm off
wheels     alpha from half of the 96 runs of a wheel, tested on the other half and on each speed left out
simulated  200 media drawn from the program's own knowledge and 200 with an exact law, with the model's error: coverage

Percent of the measured peak; poses from -110 to 110 degrees. The material of a medium is left out of its map and of what
is learned of a leg.
"""

from __future__ import annotations

import sys
import time
import zlib
from functools import cache
from itertools import product
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
import side_slip
from exact_laws import exact_laws, forces_in_plane
from force_scores import crps, interval_score, moved_peaks, percent_inside, smooth_errors
from frame import Part, Row, Tables, named
from grade_forces import EVERY, NODES, measured_curves, profile_of, push_table, vertical_alpha
from scipy.linalg import block_diag
from scipy.optimize import minimize
from shapes import MATERIALS, SE

import rftfit
from rftfit.compare.legs import extreme, measured_peak
from rftfit.forces.body_error import COMMON, JITTER, PER_MEDIUM, correlation
from rftfit.forces.contacts import error_curve
from rftfit.forces.planning import prior_map
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.model.draws import interval
from rftfit.reference import LEGS, MEDIA, SANDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray

COMPONENTS = ("z", "x")
CONFIDENCE = 0.95
READING = 0.02
"""Error of a reading of Figs. S5 and S12 over the largest force of its curve."""
DRAWS = 1000
THIN = 3
"""Every third degree of a curve is a pose of a contact."""


# --- Sizes of the error of a body


def grade_constants(left_out: str) -> list[Row]:
    """Most likely sizes of c and o on the legs of five media, one leg left out, or none."""
    legs = [leg for leg in LEGS if leg != left_out]
    systems = [system for leg in legs for system in systems_of(leg)]

    def loss(logarithms: FloatArray) -> float:
        common, per_medium = np.exp(logarithms)
        total = 0.0
        for values, alike, in_medium, noise in systems:
            covariance = common**2 * alike + per_medium**2 * in_medium + noise
            root = np.linalg.cholesky(covariance + JITTER * np.eye(values.size))
            total += 2 * float(np.log(np.diag(root)).sum())
            total += float((np.linalg.solve(root, values) ** 2).sum())
        return total

    best = minimize(loss, np.log([COMMON, PER_MEDIUM]), method="Nelder-Mead", tol=0.05)
    common, per_medium = np.exp(best.x)
    return [{"common": 100 * common, "per_medium": 100 * per_medium}]


def systems_of(leg_name: str) -> list[tuple[FloatArray, ...]]:
    """Errors of the model on a leg, by component: values, how alike their states are, in one medium, and noise."""
    curves = [
        error_curve(
            contact_of(medium, leg_name), calibration_profile(medium, "map", MATERIALS[medium])
        )
        for medium in MEDIA
    ]
    states = np.concatenate([curve.states for curve in curves])
    medium = np.concatenate([np.full(len(curve.states), k) for k, curve in enumerate(curves)])
    alike = correlation(states, states)
    in_medium = alike * (medium[:, None] == medium)
    return [
        (
            np.concatenate([curve.residuals[component] for curve in curves]),
            alike,
            in_medium,
            block_diag(*(curve.noise[component] for curve in curves)),
        )
        for component in range(len(COMPONENTS))
    ]


def report_constants(rows: pd.DataFrame) -> Tables:
    """Sizes over the load, by the leg that was left out."""
    return [
        (
            f"Percent of the load; stated are {100 * COMMON:g} and {100 * PER_MEDIUM:g}",
            rows[["unit", "common", "per_medium"]],
        )
    ]


# --- The same leg elsewhere


@cache
def contact_of(
    medium: str,
    leg_name: str,
    body_error: rftfit.BodyError | None = None,
    *,
    step: int = 1,
    theta_off_deg: float = 0.0,
    radius: float = 1.0,
    hip_off_cm: float = 0.0,
) -> rftfit.Contact:
    """Measured curve of a published leg; the last arguments are mistakes of whoever describes it."""
    rows = measured_curves()[medium, leg_name].iloc[::step]
    leg = rftfit.model_leg(leg_name)
    if radius != 1.0:
        body = leg.body.copy()
        body[:, [0, 1, 4]] *= radius
        leg = rftfit.Outline(body, leg.width_cm, leg.name)
    theta = rows["theta_deg"].to_numpy(float) + theta_off_deg
    motion = rftfit.rotation(theta, 2.0 + hip_off_cm)
    error = READING * float(rows["force_z_N"].abs().max())
    return rftfit.Contact(leg, motion, rows, error, body_error or rftfit.BodyError())


@cache
def calibration_profile(medium: str, kind: str, left_out: tuple[str, ...]) -> rftfit.Profile:
    """Table or map of all directions of a medium in which a leg was calibrated."""
    table = rftfit.published_medium(medium)
    if kind == "table":
        return table
    pushes = push_table(EVERY, np.stack(table.alpha(*NODES)), SE)
    return rftfit.estimate_map(pushes, rftfit.published_shapes(left_out)).profile


@cache
def body_error_of(
    leg_name: str, kind: str, left_out: tuple[str, ...], media: tuple[str, ...] = MEDIA
) -> rftfit.BodyError:
    """What the model gets wrong on a leg, learned in media that are not left out."""
    used = [medium for medium in media if medium not in left_out]
    return rftfit.learn_body_error(
        [
            (contact_of(medium, leg_name), calibration_profile(medium, kind, left_out))
            for medium in used
        ]
    )


def scaled_curves(medium: str, leg_name: str, left_out: Sequence[str]) -> FloatArray:
    """Curves measured elsewhere times the ratio of alpha_z(0, 90 deg), shape (media, 2, p)."""
    theta = contact_of(medium, leg_name).motion.columns["theta_deg"]
    curves = []
    for other in MEDIA:
        if other in left_out:
            continue
        contact = contact_of(other, leg_name)
        angles = contact.motion.columns["theta_deg"]
        force = np.stack([np.interp(theta, angles, curve) for curve in contact.measured])
        curves.append(force * vertical_alpha(medium) / vertical_alpha(other))
    return np.stack(curves)


MODELS = ("table", "map 91", "map 16", "map 6", "map 1")


def grade_carried(medium: str) -> list[Row]:
    """One row a leg, model and component of a medium."""
    left_out = MATERIALS.get(medium, ())
    rows: list[Row] = []
    for leg_name in LEGS:
        contact = contact_of(medium, leg_name)
        scaled = scaled_curves(medium, leg_name, left_out).mean(axis=0)
        for component in range(2):
            rows.append(
                curve_row(contact, component, scaled[component][None], "scaled curve", leg_name)
            )
        for model in MODELS if medium in MEDIA else ("map 1",):
            kind = "table" if model == "table" else "map"
            body = body_error_of(leg_name, kind, left_out)
            profile = profile_of(medium, model)
            spread = profile.spread if isinstance(profile.spread, rftfit.Profile) else profile
            times = -(-DRAWS // len(np.atleast_2d(spread.parameters[0])))
            plain = np.tile(contact.force_draws(spread), (times, 1, 1))[:DRAWS]
            load = np.tile(contact.moving.load_size(spread), (times, 1))[:DRAWS]
            drawn = body.paths(contact.states, 2, DRAWS)[1]
            with_body = plain + load[:, None] * drawn
            for component in range(2):
                size = {"own": body.per_medium}
                force = with_body[:, component]
                rows += [
                    curve_row(contact, component, plain[:, component], f"{model}, alone", leg_name),
                    curve_row(contact, component, force, model, leg_name) | size,
                ]
    return rows


def curve_row(
    contact: rftfit.Contact, component: int, draws: FloatArray, model: str, leg_name: str
) -> Row:
    """Scores of the draws (m, p) of a force on a leg."""
    theta, c = contact.motion.columns["theta_deg"], COMPONENTS[component]
    measured, poses = contact.measured[component], contact.touches
    top = measured_peak(theta, measured, c).force_N
    peak = abs(top)
    mean = draws.mean(axis=0)
    highest = extreme(mean, c)
    row: Row = {
        "leg": leg_name,
        "component": c,
        "model": model,
        "peak_percent": 100 * (abs(mean[highest]) / peak - 1),
        "rms": 100 * np.sqrt(np.mean((mean - measured) ** 2)) / peak,
        "rms_loaded": 100 * np.sqrt(np.mean((mean - measured)[poses] ** 2)) / peak,
    }
    if len(draws) == 1:
        return row
    lo, hi = interval(draws, CONFIDENCE)
    sign = np.sign(mean[highest])
    peak_lo, peak_hi = interval(moved_peaks(sign * draws, sign * mean), CONFIDENCE)
    return row | {
        "inside": percent_inside(lo[poses], hi[poses], measured[poses]),
        "peak_in": float(peak_lo <= sign * top <= peak_hi),
        "crps": (100 * crps(draws, measured) / peak)[poses].mean(),
        "score": 100 * interval_score(lo[poses], hi[poses], measured[poses]) / peak,
        "width": 100 * np.mean((hi - lo)[poses]) / peak,
    }


def report_carried(rows: pd.DataFrame) -> Tables:
    """Scores by model, and errors of the peaks by leg, of media and of sands."""
    tables = []
    for title, media in (("Laboratory media, material left out", MEDIA), ("Natural sands", SANDS)):
        chosen = rows[rows["unit"].isin(media)]
        if chosen.empty:
            continue
        chosen = chosen.assign(off=chosen["peak_percent"].abs())
        scores = chosen.groupby("model", sort=False).agg(
            curves=("off", "size"),
            inside=("inside", "mean"),
            peaks_inside=("peak_in", "sum"),
            peak_median=("off", "median"),
            peak_worst=("off", "max"),
            rms=("rms", "mean"),
            rms_loaded=("rms_loaded", "mean"),
            crps=("crps", "mean"),
            score=("score", "mean"),
            width=("width", "mean"),
        )
        tables.append((title, scores.reset_index()))
        of_models = chosen[chosen["model"].isin(["table, alone", "scaled curve", *MODELS])]
        peaks = of_models.pivot_table(
            "peak_percent", ["leg", "component"], "model", aggfunc="median", sort=False
        )
        tables.append((f"{title}: error of the peak, median, %", peaks.reset_index()))
    return tables


# --- A leg alone


USES = (("c_leg",), ("flat_leg",), ("c_leg", "flat_leg"))
CALIBRATED = ("never", "in one medium", "in all others")


def grade_alone(medium: str) -> list[Row]:
    """One row a choice of legs and of calibration."""
    left_out = MATERIALS[medium]
    rows: list[Row] = []
    for use, calibrated in product(USES, CALIBRATED):
        media = tuple(name for name in MEDIA if name not in left_out)
        if calibrated == "in one medium":
            media = media[:1]
        contacts = [
            contact_of(
                medium,
                leg,
                None if calibrated == "never" else body_error_of(leg, "map", left_out, media),
                step=THIN,
            )
            for leg in use
        ]
        unused = [leg for leg in LEGS if leg not in use]
        rows.append(
            {"use": " + ".join(use), "calibrated": calibrated}
            | row_of_map(medium, contacts, left_out, unused)
            | {"push_rms": legs_of_map(medium, profile_of(medium, "map 1"), unused)["legs_rms"]}
        )
    return rows


def row_of_map(
    medium: str, contacts: list[rftfit.Contact], left_out: Sequence[str], unused: Sequence[str] = ()
) -> Row:
    """Alpha of a map from contacts alone, over that of the plates."""
    start = time.process_time()
    estimate = rftfit.estimate_map(shapes=rftfit.published_shapes(left_out), contacts=contacts)
    seconds = time.process_time() - start
    truth = np.stack(rftfit.published_medium(medium).alpha(*NODES))
    return (
        alpha_row(estimate.profile, truth)
        | legs_of_map(medium, estimate.profile, unused)
        | {"estimate_s": seconds}
    )


def alpha_row(profile: rftfit.Profile, truth: FloatArray) -> Row:
    """alpha_z(0, 90 deg) over the truth with its interval, and coverage of the published nodes (2, n)."""
    assert isinstance(profile.spread, rftfit.Profile)
    down = int(np.argmin(np.hypot(NODES[0], NODES[1] - np.pi / 2)))
    mean = np.stack(profile.alpha(*NODES))
    drawn = np.stack(profile.spread.alpha(*NODES), axis=1)
    lo, hi = interval(drawn, CONFIDENCE)
    level = truth[0, down]
    # symmetry leaves alpha_x of a level plate that moves straight no freedom
    free = hi - lo > 1e-9
    return {
        "ratio": 100 * mean[0, down] / level,
        "ratio_lo": 100 * lo[0, down] / level,
        "ratio_hi": 100 * hi[0, down] / level,
        "holds": float(lo[0, down] <= level <= hi[0, down]),
        "half_width": 50 * (hi - lo)[0, down] / mean[0, down],
        "nodes_inside": percent_inside(lo[free], hi[free], truth[free]),
        "map_rms": 100 * np.sqrt(np.mean((mean - truth) ** 2)) / level,
    }


def legs_of_map(medium: str, profile: rftfit.Profile, legs: Sequence[str]) -> Row:
    """Rms error of the forces on legs over their measured peaks, %."""
    errors = []
    for leg_name, (component, c) in product(legs, enumerate(COMPONENTS)):
        contact = contact_of(medium, leg_name)
        force = contact.force_draws(profile)[0, component]
        measured = contact.measured[component]
        top = measured_peak(contact.motion.columns["theta_deg"], measured, c).force_N
        errors.append(100 * np.sqrt(np.mean((force - measured) ** 2)) / abs(top))
    return {"legs_rms": float(np.mean(errors)) if errors else np.nan}


def report_alone(rows: pd.DataFrame) -> Tables:
    """Ratio to the plates, intervals and coverage by choice, and each medium."""
    groups = rows.groupby(["use", "calibrated"], sort=False, dropna=False)
    summary = groups.agg(
        media=("ratio", "count"),
        ratio=("ratio", "mean"),
        sd=("ratio", "std"),
        holds=("holds", "sum"),
        half_width=("half_width", "mean"),
        nodes_inside=("nodes_inside", "mean"),
        map_rms=("map_rms", "mean"),
        legs_rms=("legs_rms", "mean"),
        push_rms=("push_rms", "mean"),
    )
    each = rows.dropna(subset=["ratio"])[
        ["unit", "use", "calibrated", "ratio", "ratio_lo", "ratio_hi"]
    ]
    return [
        ("alpha_z(0, 90 deg) over the plate's, %", summary.reset_index()),
        ("Each medium", each),
    ]


# --- What mistakes do


MISTAKES: dict[str, dict[str, float]] = {
    "none": {},
    "theta + 5 deg": {"theta_off_deg": 5.0},
    "theta - 5 deg": {"theta_off_deg": -5.0},
    "radius + 5 %": {"radius": 1.05},
    "radius - 5 %": {"radius": 0.95},
    "hip + 2 mm": {"hip_off_cm": 0.2},
    "hip - 2 mm": {"hip_off_cm": -0.2},
}


def grade_wrong(medium: str) -> list[Row]:
    """Alpha from the c-leg that is described with a mistake, beside that without."""
    left_out = MATERIALS[medium]
    rows: list[Row] = []
    for name, mistake in MISTAKES.items():
        contact = contact_of(medium, "c_leg", step=THIN, **mistake)
        rows.append({"mistake": name} | row_of_map(medium, [contact], left_out))
    return rows


def report_wrong(rows: pd.DataFrame) -> Tables:
    """How far alpha moves, %."""
    right = rows[rows["mistake"] == "none"].set_index("unit")["ratio"]
    moved = 100 * (rows["ratio"] / rows["unit"].map(right) - 1)
    table = rows.assign(moved=moved).groupby("mistake", sort=False)["moved"]
    return [("alpha_z(0, 90 deg) moves by, %", table.agg(["mean", "min", "max"]).reset_index())]


# --- Wheels


def grade_wheel(unit: str) -> list[Row]:
    """Alpha from some of the runs of a wheel, and the others predicted from it."""
    runs = pd.read_csv(side_slip.RUNS)
    if unit.startswith("half"):
        number = np.random.default_rng(int(unit.split()[1])).permutation(len(runs))
        taught = np.isin(np.arange(len(runs)), number[: len(runs) // 2])
    else:
        taught = (runs["rim_speed_mm_per_s"] != float(unit.split()[1])).to_numpy()
    mesh = rftfit.Mesh.cylinder(side_slip.RADIUS_CM, width_cm=6, facets=24)

    # from bed to bed as usual, and the sensor
    whole = np.sqrt(sum(runs[f"force_{axis}_N"] ** 2 for axis in "xyz"))
    runs["error_N"] = np.hypot(1.0, USUAL_BED_SPREAD * whole)

    def contact_with(
        chosen: pd.DataFrame, body_error: rftfit.BodyError | None = None
    ) -> rftfit.Contact:
        motion = side_slip.at_depth(chosen, chosen.sinkage_mm / 10)
        forces = {f"force_{axis}_N": chosen[f"force_{axis}_N"].to_numpy(float) for axis in "xyz"}
        errors = {name: chosen["error_N"].to_numpy(float) for name in forces}
        return rftfit.Contact(mesh, motion, forces, errors, body_error or rftfit.BodyError())

    lesson, test = contact_with(runs[taught]), contact_with(runs[~taught])
    estimate = rftfit.estimate_map(contacts=[lesson])
    profile = estimate.profile
    assert isinstance(profile.spread, rftfit.Profile)
    down = [float(x) for x in interval(profile.spread.alpha(0, np.pi / 2)[0], CONFIDENCE)]
    body = rftfit.learn_body_error([(lesson, profile)])
    forces = {
        "map of the wheel": rftfit.predict(profile, mesh, test.motion),
        "and its own error": rftfit.predict(profile, mesh, test.motion, body_error=body),
    }
    rows: list[Row] = []
    for model, table in forces.items():
        for axis in "xyz":
            name = f"force_{axis}_N"
            measured = test.measured["xyz".index(axis)]
            lo, hi = (table[f"force_{axis}_model_{end}_N"].to_numpy(float) for end in ("lo", "hi"))
            rows.append(
                {
                    "model": model,
                    "axis": axis,
                    "alpha": float(profile.alpha(0, np.pi / 2)[0]),
                    "alpha_lo": down[0],
                    "alpha_hi": down[1],
                    "inside": percent_inside(lo, hi, measured),
                    "rms_N": float(np.sqrt(np.mean((table[name] - measured) ** 2))),
                    "largest_N": float(np.abs(measured).max()),
                    "width_N": float(np.mean(hi - lo)),
                }
            )
    return rows


def wheel_units() -> list[str]:
    """Halves of the runs, and each speed of the rim left out."""
    speeds = sorted(pd.read_csv(side_slip.RUNS)["rim_speed_mm_per_s"].unique())
    return ["half 1", "half 2", *(f"speed {speed:g}" for speed in speeds)]


def report_wheels(rows: pd.DataFrame) -> Tables:
    """Alpha by what was taught, and the runs that were left out."""
    alpha = rows.groupby("unit", sort=False)[["alpha", "alpha_lo", "alpha_hi"]].first()
    scores = rows.groupby(["model", "axis"], sort=False)[
        ["inside", "rms_N", "largest_N", "width_N"]
    ].mean()
    return [
        ("alpha_z(0, 90 deg) from a wheel, N/cm^3", alpha.reset_index()),
        ("Runs that were left out", scores.reset_index()),
    ]


# --- Simulated contacts


SIMULATED = 200
THETA_DEG = np.arange(-110.0, 111.0, 5.0)
LAWS = ("3D-RFT 0.3", "3D-RFT 0.6", "frictional 0.3", "frictional 0.6", "bilinear poppy_LP")


def grade_simulated(kind: str, medium: int) -> list[Row]:
    """Coverage of a medium whose legs are simulated with the model's error; `kind`: own, or laws."""
    random = np.random.default_rng([zlib.crc32(kind.encode()), medium])
    left_out: tuple[str, ...] = ()
    law = None
    if kind == "own":
        size = float(np.exp(random.uniform(-2, 0.5)))
        truth_z, truth_x = size * medium_of_prior(medium)
        name = "drawn from the known media"
        exact = rftfit.TableProfile(truth_z, truth_x, prior_map().beta, prior_map().gamma)
        at_nodes = np.stack(exact.alpha(*NODES))
    else:
        name = LAWS[medium % len(LAWS)]
        law = exact_laws(MATERIALS)[name]
        left_out = law.material
        at_nodes = law.alpha(*NODES)
        exact = rftfit.TableProfile(at_nodes[0], at_nodes[1], *NODES)
    contacts = []
    for leg_name in LEGS[: 1 + medium % 3]:
        leg, motion = rftfit.model_leg(leg_name), rftfit.rotation(THETA_DEG)
        nothing = {column: np.zeros(THETA_DEG.size) for column in ("force_z_N", "force_x_N")}
        blank = rftfit.Contact(leg, motion, nothing, 1.0)
        force = blank.force_draws(exact)[0]
        if law is not None:
            force = forces_in_plane(law, leg, motion.poses)
        load = blank.load(exact)
        seed = int(random.integers(1 << 30))
        force = force + 0.28 * load * smooth_errors(THETA_DEG, (2,), seed)
        error = READING * float(np.abs(force).max())
        force = force + error * random.standard_normal(force.shape)
        measured = {"force_z_N": force[0], "force_x_N": force[1]}
        contacts.append(rftfit.Contact(leg, motion, measured, error))
    row: Row = {"kind": kind, "medium": name, "legs": len(contacts)}
    try:
        shapes = rftfit.published_shapes(left_out)
        estimate = rftfit.estimate_map(shapes=shapes, contacts=contacts)
    except ValueError as problem:
        return [row | {"refused": str(problem)[:60]}]
    return [row | alpha_row(estimate.profile, at_nodes) | {"belongs": estimate.belongs}]


@cache
def passive_media() -> FloatArray:
    """Media of the prior that take energy everywhere, shape (media, 2, n)."""
    from rftfit.model.shapes import LEAST_WORK, work

    draws = prior_map()
    largest = np.abs(draws.draws).max(axis=(1, 2))
    takes = (work(draws.draws, draws.gamma) > -LEAST_WORK * largest[:, None]).all(axis=1)
    return draws.draws[takes]


def medium_of_prior(number: int) -> FloatArray:
    """A medium of the prior that takes energy everywhere, of size 1."""
    media = passive_media()
    return np.asarray(media[number % len(media)])


def report_simulated(rows: pd.DataFrame) -> Tables:
    """Coverage of alpha_z(0, 90 deg) and of the nodes."""
    tables = []
    for by in ("medium", "legs"):
        groups = rows.groupby(["kind", by], sort=False)
        table = groups.agg(
            media=("medium", "size"),
            ratio=("ratio", "mean"),
            holds=("holds", "mean"),
            half_width=("half_width", "mean"),
            nodes_inside=("nodes_inside", "mean"),
            map_rms=("map_rms", "mean"),
        )
        table["refused"] = groups["refused"].count() if "refused" in rows else 0
        table["holds"] *= 100
        tables.append((f"Coverage by {by}", table.reset_index()))
    return tables


PARTS = {
    "constants": Part(named(["none", *LEGS]), grade_constants, report_constants),
    "carried": Part(named([*MEDIA, *SANDS]), grade_carried, report_carried),
    "alone": Part(named(MEDIA), grade_alone, report_alone),
    "wrong": Part(named(MEDIA), grade_wrong, report_wrong),
    "wheels": Part(named(wheel_units()), grade_wheel, report_wheels),
    "simulated": Part(
        lambda count, _seed: [*product(("own", "laws"), range(count))],
        grade_simulated,
        report_simulated,
        SIMULATED,
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
