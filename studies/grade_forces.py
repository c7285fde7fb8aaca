"""Predicted forces against measured ones and exact laws: what lies inside the intervals, scores, widths.

    python studies/grade_forces.py [PART ...] --rows FOLDER [--tilt SHARE]

A quarter of an hour on one core; `--tilt` grades the map with another share of its full tilt.

legs      Fig. S5: table, maps of 91, 16, 6 and 1 pushes and rivals, five media x three legs x lift, thrust
sands     Fig. S12: natural sands from one push
friction  3D-RFT: the friction with the least error on the laboratory legs
speeds    Fig. 4C: 42 speeds of the robot by each model
reversed  lift of the reversed c-leg with all directions pushed, by spacing of the lines
laws      alpha and meshes of media with an exact law, in random directions between the lines
front     48 measured peaks by `rftfit predict --leg L --alpha X`
wheels    96 runs of a wheel

Percent of the measured peak; poses from -110 to 110 degrees with load; the material is left out of the map, leg
shape and material are left out of the model's error. Errors are clustered by medium.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import zlib
from contextlib import chdir
from copy import copy
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any

import frame
import numpy as np
import pandas as pd
import side_slip
from exact_laws import exact_laws, forces_in_space
from force_scores import (
    crps,
    interval_score,
    learn_error,
    loads_of,
    mean_by_cluster,
    moved_peaks,
    percent_inside,
    smooth_errors,
)
from frame import Part, Row, Tables, named
from shapes import MATERIALS, SE, reference_without

import rftfit
from rftfit.compare.legs import extreme, measured_peak
from rftfit.forces.plane import force_draws, forces_on
from rftfit.forces.reference_kernel import place, submerged
from rftfit.forces.space import mesh_draws
from rftfit.model import shapes as shapes_of_map
from rftfit.model.draws import end_names, interval
from rftfit.model.fourier import fit_lsq
from rftfit.model.shapes import usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS, MEDIA, SANDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    from exact_laws import Law

    from rftfit.conventions import FloatArray

    Directions = list[tuple[float, float]]

STATED_ERROR = 0.28
"""Model's own error that the program states (`../shared/forces.md`), for parts that learn none."""
COMPONENTS = ("z", "x")
CONFIDENCE = 0.95
LAST_DEG = 110.0
DRAWS = 1000
LOAD_STEP = 4
"""Poses between two in which the load of all draws is calculated."""
LINEAR_CM = {"yuma": 2.0, "palms29": 3.0, "palms29_sieved": 3.0}
DOWN = (0.0, 90.0)
_MESH = np.meshgrid(np.radians(BETA_DEG[1:]), np.radians(GAMMA_DEG), indexing="ij")
NODES = _MESH[0].ravel(), _MESH[1].ravel()
"""The published directions, whatever the nodes of a map are; a plate at -90 degrees is the one at 90."""
EVERY: Directions = [*zip(*(np.degrees(angle).tolist() for angle in NODES), strict=True)]


# --- Pushes and maps


def push_table(
    directions: Directions, alpha: FloatArray, error: FloatArray | float
) -> pd.DataFrame:
    """Pushes as `rftfit.estimate_map` takes them; alpha and its error of shape (2, n)."""
    beta_deg, gamma_deg = np.transpose(directions)
    errors = np.broadcast_to(np.asarray(error, float), alpha.shape)
    return pd.DataFrame(
        {
            "beta_deg": beta_deg,
            "gamma_deg": gamma_deg,
            "alpha_z_N_per_cm3": alpha[0],
            "alpha_x_N_per_cm3": alpha[1],
            "se_z": errors[0],
            "se_x": errors[1],
        }
    )


def pushed_map(medium: str, directions: Directions, beta_deg: npt.ArrayLike = ()) -> rftfit.Map:
    """Map of a published medium whose material is not known, with the errors that the paper states.

    `beta_deg`: more lines of the map.
    """
    table = rftfit.published_medium(medium)
    beta, gamma = np.radians(np.transpose(directions))
    alpha = np.stack(table.alpha(beta, gamma))
    shapes = rftfit.published_shapes(MATERIALS[medium])
    return rftfit.estimate_map(push_table(directions, alpha, SE), shapes, beta_deg=beta_deg)


@cache
def planned_directions(medium: str) -> tuple[tuple[float, float], ...]:
    """Directions that `rftfit plan` chooses for the whole map, the push straight down first."""
    steps = rftfit.plan("map", pushed_map(medium, [DOWN]), count=30).steps
    return tuple(dict.fromkeys([DOWN, *(place for step in steps for place in step.directions)]))


def sand_slope(sand: str) -> float:
    """Slope of the penetration test of Fig. S11 over its linear part, N/cm^3."""
    curve = rftfit.published_table("fig_s11")
    curve = curve[(curve["medium"] == sand) & (curve["depth_cm"] <= LINEAR_CM[sand])]
    return float(rftfit.fit_slope(curve["depth_cm"], curve["stress_z_N_per_cm2"]).alpha[0])


def vertical_alpha(medium: str) -> float:
    """alpha_z(0, 90 deg) of a laboratory medium or a sand, N/cm^3."""
    if medium in SANDS:
        return sand_slope(medium)
    return float(rftfit.published_medium(medium).alpha(0.0, np.pi / 2)[0])


# --- Models of a medium


MAPS = {"map 91": len(EVERY), "map 16": 16, "map 6": 6, "map 1": 1}
RIVALS = ("3D-RFT 0.4", "3D-RFT 0.6", "nine terms", "generic", "depth-only")
MODELS = ("table", *MAPS, *RIVALS)
OF_ONE_PUSH = ("map 1", "3D-RFT 0.4", "3D-RFT 0.6", "generic")


@cache
def profile_of(medium: str, model: str) -> rftfit.Profile:
    """Profile of a medium by a model that does not know its material."""
    alpha = vertical_alpha(medium)
    left_out = MATERIALS.get(medium, ())
    error = SE if medium in MEDIA else 0.05 * alpha
    if model.startswith("3D-RFT"):
        return rftfit.rft3d_profile(alpha, float(model.split()[1]))
    if model == "generic":
        return rftfit.scale_by_paper(alpha, error, reference_without(left_out)).profile
    if model == "map 1" and medium in SANDS:
        push = push_table([DOWN], np.array([[alpha], [np.nan]]), error)
        return rftfit.estimate_map(push, rftfit.published_shapes(left_out)).profile
    table = rftfit.published_medium(medium)
    if model == "nine terms":
        return rftfit.FourierProfile(fit_lsq(*NODES, *table.alpha(*NODES)))
    if model == "depth-only":
        return rftfit.DepthOnlyProfile.of(table)
    if model == "table":
        return table
    if model == "map 91":
        return pushed_map(medium, EVERY).profile
    return pushed_map(medium, [*planned_directions(medium)[: MAPS[model]]]).profile


def error_family(model: str) -> str:
    """Model whose differences teach the error: a map has that of the map of all pushes."""
    return "map 91" if model in MAPS else model


# --- Curves of force on legs


@dataclass(frozen=True)
class Curve:
    """Predicted and measured force on a leg, z and x, N.

    `draws`: shape (draws, 2, poses); `loads`: the same draws' loads, shape (draws, poses); `mean`, `measured`:
    shape (2, poses); `loaded`: whether the leg reaches into the medium.
    """

    theta_deg: FloatArray
    loaded: npt.NDArray[np.bool_]
    draws: FloatArray
    loads: FloatArray
    mean: FloatArray
    measured: FloatArray


@cache
def measured_curves() -> dict[tuple[str, str], pd.DataFrame]:
    """Measured curves of Figs. S5 and S12 by medium and leg, from -110 to 110 degrees."""
    figure_rows = pd.concat([rftfit.published_table(name) for name in ("fig_s5", "fig_s12")])
    figure_rows = figure_rows[figure_rows["theta_deg"].abs() <= LAST_DEG]
    return {
        (str(medium), str(leg)): rows
        for (medium, leg), rows in figure_rows.groupby(["medium", "leg"])
    }


def quantile_draws(
    profile: rftfit.Profile, leg: rftfit.Outline, motion: rftfit.Motion, mean: FloatArray
) -> FloatArray:
    """Equally likely forces of a profile that has intervals and no draws, shape (draws, 2, poses)."""
    sides = []
    for tail in np.arange(0.0125, 0.25, 0.025):
        forces = rftfit.predict(profile, leg, motion, 1 - 2 * tail, model_error=0)
        sides.append([[forces[name] for name in end_names(f"force_{c}_N")] for c in COMPONENTS])
    ends = np.moveaxis(np.array(sides, dtype=float), 2, 0)
    shares = np.arange(1, 11)[:, None, None] / 10.5
    inner = [side[-1] + shares * (mean - side[-1]) for side in ends]
    return np.concatenate([*ends, *inner])


@cache
def curve_of(medium: str, leg_name: str, model: str) -> Curve:
    """Curve of a leg in a medium by a model."""
    rows = measured_curves()[medium, leg_name]
    leg, profile = rftfit.model_leg(leg_name), profile_of(medium, model)
    motion = rftfit.rotation(rows["theta_deg"].to_numpy(float))
    columns = [f"force_{c}_N" for c in COMPONENTS]
    net = forces_on(profile, leg, motion.poses)
    mean = np.stack([net.force_z_N, net.force_x_N])
    # loads change slowly with the pose
    some = np.unique(np.append(np.arange(0, len(motion.poses), LOAD_STEP), len(motion.poses) - 1))
    if isinstance(profile.spread, rftfit.Profile):
        forces = force_draws(profile.spread, leg, motion.poses)
        draws = np.stack([forces.force_z_N, forces.force_x_N], axis=1)
        some_loads = loads_of(profile.spread, leg, motion.poses[some])
    else:
        draws = mean[None]
        if profile.spread is not None:
            draws = quantile_draws(profile, leg, motion, mean)
        some_loads = np.tile(loads_of(profile, leg, motion.poses[some]), (len(draws), 1))
    every = np.arange(len(motion.poses))
    shares = np.stack([np.interp(every, some, unit) for unit in np.eye(some.size)])
    measured = rows[columns].to_numpy(float).T
    elements = place(leg.body, leg.width_cm, motion.poses)
    loaded = submerged(elements)[0].sum(axis=1) > 0
    loads = np.where(loaded, some_loads @ shares, 0.0)
    return Curve(rows["theta_deg"].to_numpy(float), loaded, draws, loads, mean, measured)


@cache
def learned_error(medium: str, leg_name: str, model: str) -> float:
    """Model's own error over the load, from the other legs in the media of the other material."""
    family = error_family(model)
    training_media = [name for name in MEDIA if name not in MATERIALS.get(medium, ())]
    differences, variances, loads = [], [], []
    for training_medium, leg in product(training_media, LEGS):
        if leg == leg_name:
            continue
        curve = curve_of(training_medium, leg, family)
        load, loaded = curve.loads.mean(axis=0), curve.loaded
        for component in range(2):
            difference = curve.measured[component] - curve.mean[component]
            differences.append(difference[loaded])
            variances.append(curve.draws[:, component].var(axis=0)[loaded])
            loads.append(load[loaded])
    return learn_error(differences, variances, loads)


def with_model_error(curve: Curve, error: float, seed: int) -> FloatArray:
    """Draws of force with the model's own error, shape (draws, 2, poses)."""
    times = -(-DRAWS // len(curve.draws))
    draws, loads = (np.tile(x, (times, *[1] * (x.ndim - 1))) for x in (curve.draws, curve.loads))
    errors = smooth_errors(curve.theta_deg, (len(draws), 2), seed)
    return np.asarray(draws + error * loads[:, None] * errors)


def degrees_late(theta_deg: FloatArray, mean: FloatArray, measured: FloatArray, c: str) -> float:
    """Degrees by which the predicted peak follows the measured one."""
    tops = [measured_peak(theta_deg, force, c).theta_deg for force in (mean, measured)]
    return tops[0] - tops[1]


def grade_legs(models: Sequence[str], medium: str) -> list[Row]:
    """One row a leg, model and component of a medium."""
    rows: list[Row] = []
    for leg_name, model in product(LEGS, models):
        curve = curve_of(medium, leg_name, model)
        error = learned_error(medium, leg_name, model)
        seed = zlib.crc32(f"{medium} {leg_name} {model}".encode())
        draws_with_error = with_model_error(curve, error, seed)
        poses = curve.loaded
        for component, c in enumerate(COMPONENTS):
            measured, mean = curve.measured[component], curve.mean[component]
            peak = abs(measured_peak(curve.theta_deg, measured, c).force_N)
            # a profile without errors has its number for an interval
            lo, hi = interval(curve.draws[:, component], CONFIDENCE)
            model_lo, model_hi = interval(draws_with_error[:, component], CONFIDENCE)
            highest = extreme(mean, c)
            sign = np.sign(mean[highest])
            tops = [
                moved_peaks(sign * x[:, component], sign * mean)
                for x in (curve.draws, draws_with_error)
            ]
            top = sign * measured_peak(curve.theta_deg, measured, c).force_N
            row: Row = {
                "leg": leg_name,
                "model": model,
                "component": c,
                "error": error,
                "peak_N": peak,
                "predicted_N": mean[highest],
                "peak_percent": 100 * (abs(mean[highest]) / peak - 1),
                "late_deg": degrees_late(curve.theta_deg, mean, measured, c),
                "rms": 100 * np.sqrt(np.mean((mean - measured)[poses] ** 2)) / peak,
                "rms_all": 100 * np.sqrt(np.mean((mean - measured) ** 2)) / peak,
            }
            for name, (low, high), draws, peaks in (
                ("alpha", (lo, hi), curve.draws, tops[0]),
                ("model", (model_lo, model_hi), draws_with_error, tops[1]),
            ):
                peak_lo, peak_hi = interval(peaks, CONFIDENCE)
                score = interval_score(low[poses], high[poses], measured[poses])
                crps_of_poses = 100 * crps(draws[:, component], measured) / peak
                row |= {
                    f"inside_{name}": percent_inside(low[poses], high[poses], measured[poses]),
                    f"crps_{name}": crps_of_poses[poses].mean(),
                    f"crps_all_{name}": crps_of_poses.mean(),
                    f"score_{name}": 100 * score / peak,
                    f"width_{name}": 100 * np.mean((high - low)[poses]) / peak,
                    f"peak_in_{name}": 100 * float(peak_lo <= top <= peak_hi),
                }
            rows.append(row)
    return rows


BASE = "3D-RFT 0.4"


def report_legs(rows: pd.DataFrame) -> Tables:
    """Tables of the laboratory media or the sands."""
    models = [model for model in MODELS if model in set(rows["model"])]
    tables = [("Poses and peaks", pd.DataFrame([summarize_model(rows, m) for m in models]))]
    by_component = [
        summarize_component(rows, model, component) for model, component in product(models, "zx")
    ]
    tables.append(("Lift and thrust", pd.DataFrame(by_component)))
    keys = ["component", "leg"]
    by_leg = rows.groupby([*keys, "model"], sort=False)
    for title, series in (
        ("Poses inside, %", by_leg["inside_model"].mean()),
        ("Error of the peak, median, %", by_leg["peak_percent"].median()),
        ("Error learned from other legs and material", by_leg["error"].mean()),
    ):
        table = series.reset_index().pivot_table(series.name, keys, "model", sort=False)
        tables.append((title, table.reset_index()))
    return tables


def summarize_model(rows: pd.DataFrame, model: str) -> Row:
    """What lies inside, peaks, errors and scores of a model."""
    of_model = rows[rows["model"] == model]
    off = of_model["peak_percent"].abs()
    by_leg = rows.pivot_table("crps_model", ["unit", "leg"], "model")
    less = by_leg[model] - by_leg[BASE]
    difference, error = mean_by_cluster(less.to_numpy(float), [*less.index.get_level_values(0)])
    return {
        "model": model,
        "inside, alpha": of_model["inside_alpha"].mean(),
        "inside": of_model["inside_model"].mean(),
        "least leg": of_model.groupby(["leg", "component"])["inside_model"].mean().min(),
        "peaks": int(of_model["peak_in_model"].sum() / 100),
        "peaks, alpha": int(of_model["peak_in_alpha"].sum() / 100),
        "peak median": off.median(),
        "peak worst": off.max(),
        "rms, all poses": of_model["rms_all"].mean(),
        "CRPS, alpha, all poses": of_model["crps_all_alpha"].mean(),
        "CRPS less 3D-RFT's": difference,
        "its se": error,
        "width": of_model["width_model"].mean(),
        "width, alpha": of_model["width_alpha"].mean(),
        "error": of_model["error"].mean(),
    }


def summarize_component(rows: pd.DataFrame, model: str, component: str) -> Row:
    """Peaks, curves and scores of lift or thrust by a model."""
    chosen = rows[(rows["model"] == model) & (rows["component"] == component)]
    score, error = mean_by_cluster(chosen["crps_model"].to_numpy(float), [*chosen["unit"]])
    return {
        "model": model,
        "component": component,
        "peak, median": chosen["peak_percent"].median(),
        "peak, rms": float(np.sqrt((chosen["peak_percent"] ** 2).mean())),
        "curve": chosen["rms"].mean(),
        "CRPS": score,
        "its se": error,
        "interval score": chosen["score_model"].mean(),
    }


# --- Friction of 3D-RFT, and speeds of the robot


def grade_friction(friction: str) -> list[Row]:
    """Mean absolute error of 3D-RFT on the laboratory legs, over the measured peak."""
    errors = []
    for medium, leg in product(MEDIA, LEGS):
        curve = curve_of(medium, leg, f"3D-RFT {friction}")
        for c, measured, mean in zip(COMPONENTS, curve.measured, curve.mean, strict=True):
            peak = abs(measured_peak(curve.theta_deg, measured, c).force_N)
            errors.append(np.abs(mean - measured)[curve.loaded].mean() / peak)
    return [{"friction": friction, "error, %": 100 * float(np.mean(errors))}]


def grade_speeds(model: str) -> list[Row]:
    """Errors of the robot's speeds, percent; without a steady speed they are -100."""
    profile = profile_of("poppy_LP", model)
    points = rftfit.published_table("fig_4c").query("speed_cm_per_s > 1").to_numpy(float)
    rows: list[Row] = []
    for number, (curvature, frequency, speed) in enumerate(points):
        robot = rftfit.simulate(profile, frequency, curvature)
        error = 100 * (float(np.nan_to_num(robot.speed_cm_per_s)) / speed - 1)
        rows.append({"model": model, "speed": number, "error": error})
    return rows


def report_speeds(rows: pd.DataFrame) -> Tables:
    """Median, rms and mean absolute error, its standard error, and speeds within 20 and 35 %."""
    errors = rows.groupby("model", sort=False)["error"]
    off = rows["error"].abs().groupby(rows["model"], sort=False)
    table = errors.agg(["size", "median"])
    table["rms"] = errors.agg(lambda x: np.sqrt((x**2).mean()))
    table["mean"], table["its se"] = off.mean(), off.sem()
    for limit in (20, 35):
        is_within = rows["error"].abs() <= limit
        table[f"within {limit} %"] = is_within.groupby(rows["model"], sort=False).sum()
    return [("Speeds of the robot, %", table.reset_index())]


# --- The reversed leg's lift with all directions pushed


def grade_reversed(medium: str) -> list[Row]:
    """Peak of the reversed leg's lift by table and map of all pushes, whose nodes are 15 or 10 degrees apart."""
    leg = rftfit.model_leg("reversed_c_leg")
    measured = measured_curves()[medium, "reversed_c_leg"]
    theta_deg = measured["theta_deg"].to_numpy(float)
    force = measured["force_z_N"].to_numpy(float)
    peak = measured_peak(theta_deg, force, "z").force_N
    profiles = {
        "table": profile_of(medium, "table"),
        "map 91": profile_of(medium, "map 91"),
        "map 91, lines of 10": pushed_map(
            medium, EVERY, beta_deg=np.arange(-80.0, 81.0, 10.0)
        ).profile,
    }
    rows: list[Row] = []
    for name, profile in profiles.items():
        lift = forces_on(profile, leg, rftfit.rotation(theta_deg).poses).force_z_N
        rows.append(
            {
                "model": name,
                "peak_N": peak,
                "predicted_N": lift.max(),
                "peak_percent": 100 * (lift.max() / peak - 1),
                "late_deg": degrees_late(theta_deg, lift, force, "z"),
                "rms": 100 * np.sqrt(np.mean((lift - force) ** 2)) / peak,
            }
        )
    return rows


def report_reversed(rows: pd.DataFrame) -> Tables:
    """Median, least and greatest error of the peak, lateness and rms."""
    groups = rows.groupby("model", sort=False)
    table = groups["peak_percent"].agg(["median", "min", "max"])
    table["worst"] = groups["peak_percent"].agg(lambda x: x.abs().max())
    table["late, deg"] = groups["late_deg"].median()
    table["rms"] = groups["rms"].mean()
    return [("Reversed c-leg's lift, all directions pushed", table.reset_index())]


# --- Exact laws


def bodies() -> dict[str, tuple[rftfit.Mesh, rftfit.Motion3D]]:
    """A wheel that slips aside, a ball that turns as it sinks, a leg that is pushed aside."""
    angle = np.radians(15)
    wheel = rftfit.Motion3D([0, 0, 3.25], [np.cos(angle), np.sin(angle), 0], [0, 1 / 6.25, 0])
    ball = rftfit.Motion3D([0, 0, -1], [1, 0.3, -0.5], [0.1, 0.4, -0.2])
    leg = rftfit.Motion3D([0, 0, 2], [0, 0.3, 0], [0, 0.2, 0])
    return {
        "wheel": (rftfit.Mesh.cylinder(6.25, 6, 48), wheel),
        "ball": (rftfit.Mesh.sphere(2, 16), ball),
        "leg": (rftfit.Mesh.extrude(rftfit.model_leg("c_leg")), leg),
    }


COUNTS = (1, 4, 8, 16, len(EVERY))
SETS = 6
TEST_DIRECTIONS = 400


def grade_law(law_name: str, number: int) -> list[Row]:
    """Rows of a law and a set of pushes, one a number of pushes: coverage and width of alpha, legs and meshes."""
    law = exact_laws(MATERIALS)[law_name]
    random = np.random.default_rng([zlib.crc32(law_name.encode()), number])
    order = random.permutation(len(EVERY))
    truth = law.alpha(*NODES)
    error = usual_error(truth)
    seen = truth + error * random.standard_normal(truth.shape)
    angles = np.radians(random.uniform(-90, 90, (2, TEST_DIRECTIONS)))
    between = law.alpha(*angles)
    shapes = rftfit.published_shapes(law.material)
    rows: list[Row] = []
    for count in COUNTS:
        places = order[:count]
        directions = [EVERY[place] for place in places]
        start = time.process_time()
        row: Row = {"law": law_name, "count": count}
        try:
            estimate = rftfit.estimate_map(
                push_table(directions, seen[:, places], error[:, places]), shapes
            )
            profile = estimate.profile
        except ValueError as problem:
            rows.append(row | {"refused": str(problem)[:60]})
            continue
        assert isinstance(profile.spread, rftfit.Profile)
        row["estimate_s"] = time.process_time() - start
        drawn = np.stack(profile.spread.alpha(*angles))
        row |= scores_of_alpha(drawn.swapaxes(0, 1), between, np.stack(profile.alpha(*angles)))
        if law.stress is not None:
            row |= meshes_by_law(law, profile)
        rows.append(row)
    return rows


def scores_of_alpha(draws: FloatArray, truth: FloatArray, mean: FloatArray) -> Row:
    """Coverage, interval score, rms and width of alpha, shape (draws, 2, n); strongest quarter of numbers apart."""
    lo, hi = interval(draws, CONFIDENCE)
    largest = np.abs(truth).max() / 100
    strong = np.abs(truth) >= np.quantile(np.abs(truth), 0.75)
    return {
        "inside": percent_inside(lo, hi, truth),
        "inside_strong": percent_inside(lo[strong], hi[strong], truth[strong]),
        "score": interval_score(lo, hi, truth) / largest,
        "rms": np.sqrt(np.mean((mean - truth) ** 2)) / largest,
        "width": np.mean(hi - lo) / largest,
    }


def meshes_by_law(law: Law, profile: rftfit.Profile) -> Row:
    """Percent of force components on bodies in space inside: of alpha, and with the closure added."""
    assert isinstance(profile.spread, rftfit.Profile)
    inside: dict[str, list[float]] = {"mesh_alpha": [], "mesh_closure": []}
    widths = []
    for mesh, motion in bodies().values():
        true = forces_in_space(law, mesh, motion)
        drawn = mesh_draws(profile.spread, mesh, motion, "measured", None)[..., :3]
        lo, hi = interval(drawn, CONFIDENCE)
        closure = mesh_closure(profile, mesh, motion)
        inside["mesh_alpha"].append(percent_inside(lo, hi, true))
        inside["mesh_closure"].append(percent_inside(lo - closure, hi + closure, true))
        widths.append(float(np.mean(hi - lo + 2 * closure) / np.abs(true).max()))
    row: Row = {name: float(np.mean(values)) for name, values in inside.items()}
    return row | {"mesh_width": 100 * float(np.mean(widths))}


def mesh_closure(profile: rftfit.Profile, mesh: rftfit.Mesh, motion: rftfit.Motion3D) -> FloatArray:
    """Error of the law in space, N, shape (poses, 1)."""
    without_draws = copy(profile)
    without_draws.spread = None
    forces = rftfit.predict(without_draws, mesh, motion, model_error=0)
    return forces[["closure_N"]].to_numpy(float)


def report_laws(rows: pd.DataFrame) -> Tables:
    """Coverage, strongest quarter, widths and scores by law and number of pushes."""
    tables = []
    for title, column in (
        ("Alpha between the lines inside, %", "inside"),
        ("Strongest quarter inside, %", "inside_strong"),
        ("Width, % of the largest alpha", "width"),
        ("Interval score, % of the largest alpha", "score"),
        ("Rms error, % of the largest alpha", "rms"),
        ("Forces on meshes inside, of alpha, %", "mesh_alpha"),
        ("Forces on meshes inside, closure added, %", "mesh_closure"),
        ("Width of forces on meshes, % of the largest component", "mesh_width"),
    ):
        table = rows.pivot_table(column, "law", "count", aggfunc="mean", sort=False)
        table.loc["all"] = table.mean()
        tables.append((title, table.reset_index()))
    return tables


# --- The front door


def grade_front(medium: str) -> list[Row]:
    """Peaks of lift and thrust on three legs as the command prints them, its last interval."""
    from typer.testing import CliRunner

    from rftfit.cli.app import app

    alpha = vertical_alpha(medium)
    rows: list[Row] = []
    for leg_name in LEGS:
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            words = ["predict", "--leg", leg_name, "--alpha", f"{alpha:.6g}", "--json"]
            answer = CliRunner().invoke(app, words)
        if answer.exit_code:
            raise RuntimeError(f"{' '.join(words)}: {answer.output}")
        peaks = json.loads(answer.stdout)["peaks"]
        measured = measured_curves()[medium, leg_name]
        theta_deg = measured["theta_deg"].to_numpy(float)
        for component, (c, what) in enumerate(zip(COMPONENTS, ("lift", "thrust"), strict=True)):
            top = measured_peak(theta_deg, measured[f"force_{c}_N"].to_numpy(float), c)
            facts = peaks[what]
            last = "model_" if "model_lo" in facts else ""
            lo, hi, value = facts[f"{last}lo"], facts[f"{last}hi"], facts[f"force_{c}_N"]
            rows.append(
                {
                    "leg": leg_name,
                    "peak": what,
                    "component": component,
                    "alpha": alpha,
                    "measured_N": top.force_N,
                    "value_N": value,
                    "lo_N": lo,
                    "hi_N": hi,
                    "inside": 100 * float(lo <= top.force_N <= hi),
                    "peak_percent": 100 * (value / top.force_N - 1),
                    "width": 100 * (hi - lo) / top.force_N,
                }
            )
    return rows


def report_front(rows: pd.DataFrame) -> Tables:
    """All peaks, and how many lie inside."""
    inside = rows.pivot_table("inside", "leg", "peak", aggfunc=lambda x: x.sum() / 100)
    inside.loc["all"] = inside.sum()
    columns = ["unit", "leg", "peak", "measured_N", "value_N", "lo_N", "hi_N", "inside"]
    return [
        ("Peaks inside, of 8 each", inside.reset_index()),
        ("Every peak", rows[columns]),
        (
            "Width, % of the measured peak, median",
            rows.groupby("leg")["width"].median().reset_index(),
        ),
    ]


# --- Wheels


def grade_wheel(case: str) -> list[Row]:
    """One row a run and component: measured, predicted, and ends of the interval with the model's error."""
    runs = pd.read_csv(side_slip.RUNS)
    alpha = side_slip.CASES["measured law"][0]
    motion = side_slip.at_depth(runs, runs.sinkage_mm / 10)
    mesh = rftfit.Mesh.cylinder(side_slip.RADIUS_CM, width_cm=6, facets=48)
    if case == "mean of the tables":
        profile: rftfit.Profile = rftfit.TableProfile(*(alpha * side_slip.mean_map()))
    else:
        push = push_table([DOWN], np.array([[alpha], [np.nan]]), 0.05 * alpha)
        profile = rftfit.estimate_map(push).profile
    # the program's own error of a solid differs by direction
    forces = rftfit.predict(profile, mesh, motion, CONFIDENCE)
    load = wheel_loads(profile, mesh, motion)
    rows: list[Row] = []
    for axis in "xyz":
        name = f"force_{axis}_N"
        measured, value = runs[name].to_numpy(float), forces[name].to_numpy(float)
        half = 1.96 * STATED_ERROR * load
        if f"force_{axis}_lo_N" in forces:
            below = value - forces[f"force_{axis}_lo_N"].to_numpy(float)
            above = forces[f"force_{axis}_hi_N"].to_numpy(float) - value
        else:
            below = above = np.zeros(value.size)
        columns = {
            "axis": axis,
            "slip": runs["slip"],
            "measured_N": measured,
            "value_N": value,
            "lo_N": value - np.hypot(below, half),
            "hi_N": value + np.hypot(above, half),
            "alpha_lo_N": value - below,
            "alpha_hi_N": value + above,
        }
        for end in ("lo", "hi"):
            if f"force_{axis}_model_{end}_N" in forces:
                columns[f"program_{end}_N"] = forces[f"force_{axis}_model_{end}_N"]
        rows += pd.DataFrame(columns).to_dict("records")  # type: ignore[arg-type]
    return rows


def wheel_loads(profile: rftfit.Profile, mesh: Any, motion: Any) -> FloatArray:
    """Load without cancellation of the mean alpha, both directions, at least 0.2 of itself added: (poses,)."""
    from rftfit.forces.faces import face_alpha, moving_faces

    loads = []
    for pose in motion.frames:
        _, depth_area, normal, moves, _ = moving_faces(mesh, pose)
        alpha = face_alpha(profile, normal, moves)
        up = np.abs(alpha[:, 2]) @ depth_area
        across = np.hypot(alpha[:, 0], alpha[:, 1]) @ depth_area
        loads.append(np.hypot(up, across) * np.hypot(1, 0.2))
    return np.array(loads)


def report_wheels(rows: pd.DataFrame) -> Tables:
    """Components inside and rms by axis; interval score by axis, over that of the best factor of the interval."""
    lines, by_axis = [], []
    for case, of_case in rows.groupby("unit", sort=False):
        measured = of_case["measured_N"].to_numpy(float)
        line: Row = {"case": case}
        for name in ("alpha_", "", "program_"):
            if f"{name}lo_N" in of_case and of_case[f"{name}lo_N"].notna().any():
                lo, hi = (of_case[f"{name}{end}_N"].to_numpy(float) for end in ("lo", "hi"))
                what = name.strip("_") or "model"
                line[f"inside, {what}"] = percent_inside(lo, hi, measured)
                line[f"width, {what}, N"] = float((hi - lo).mean())
        for axis, of_axis in of_case.groupby("axis"):
            off = of_axis["value_N"] - of_axis["measured_N"]
            line[f"rms {axis}, N"] = float(np.sqrt((off**2).mean()))
            for name in ("", "program_"):
                ratio, factor = score_over_best(of_axis, name)
                by_axis.append(
                    {
                        "case": str(case),
                        "interval": "by direction, the program's" if name else "one size",
                        "axis": str(axis),
                        "score over that of the best factor": f"{ratio:.2f}",
                        "best factor": f"{factor:.2f}",
                    }
                )
        lines.append(line)
    return [
        (f"Wheel, model's error {STATED_ERROR}", pd.DataFrame(lines)),
        ("Interval score by direction", pd.DataFrame(by_axis)),
    ]


INTERVAL_FACTORS = np.linspace(0.1, 3, 146)


def score_over_best(rows: pd.DataFrame, name: str) -> tuple[float, float]:
    """Interval score over that of the interval times the best factor, and this factor."""
    value, measured = rows["value_N"].to_numpy(float), rows["measured_N"].to_numpy(float)
    below, above = (np.abs(rows[f"{name}{end}_N"].to_numpy(float) - value) for end in ("lo", "hi"))
    scores = [
        interval_score(value - factor * below, value + factor * above, measured)
        for factor in (1.0, *INTERVAL_FACTORS)
    ]
    best = int(np.argmin(scores[1:]))
    return scores[0] / scores[1 + best], float(INTERVAL_FACTORS[best])


# --- Parts


CASES_OF_WHEEL = ("mean of the tables", "map of one push")
FRICTIONS = ("0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8")
PARTS = {
    "legs": Part(named(MEDIA), partial(grade_legs, MODELS), report_legs),
    "sands": Part(named(SANDS), partial(grade_legs, OF_ONE_PUSH), report_legs),
    "friction": Part(
        named(FRICTIONS),
        grade_friction,
        lambda rows: [("Laboratory legs", rows.drop(columns="unit"))],
    ),
    "speeds": Part(named(MODELS), grade_speeds, report_speeds),
    "reversed": Part(named(MEDIA), grade_reversed, report_reversed),
    "front": Part(named([*MEDIA, *SANDS]), grade_front, report_front),
    "wheels": Part(named(CASES_OF_WHEEL), grade_wheel, report_wheels),
    "laws": Part(
        lambda count, _seed: [*product(exact_laws(MATERIALS), range(count))],
        grade_law,
        report_laws,
        SETS,
    ),
}

if __name__ == "__main__":
    if "--tilt" in sys.argv:
        place_of_share = sys.argv.index("--tilt") + 1
        shapes_of_map.TILT_SHARE = float(sys.argv.pop(place_of_share))
        sys.argv.remove("--tilt")
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
