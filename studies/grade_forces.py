"""Predicted forces against measured ones and exact laws: what lies inside the intervals, scores, widths.

    python studies/grade_forces.py [PART ...] --rows FOLDER

A quarter of an hour on one core.

legs      Fig. S5: table, maps of 91, 16, 6 and 1 pushes and rivals, five media x three legs x lift, thrust
sands     Fig. S12: natural sands from one push
friction  3D-RFT: the friction with the least error on the laboratory legs
speeds    Fig. 4C: 42 speeds of the robot by each model
laws      alpha and meshes of media with an exact law, in random directions between the lines

Percent of the measured peak; poses from -110 to 110 degrees with load; the material is left out of the map, leg
shape and material are left out of the model's error. Errors are clustered by medium.
"""

from __future__ import annotations

import sys
import zlib
from copy import copy
from functools import cache, partial
from itertools import product
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from exact_laws import MATERIALS, exact_laws, forces_in_space
from force_scores import (
    COMPONENTS,
    CONFIDENCE,
    learn_error,
    mean_by_cluster,
    peak_of,
    percent_inside,
    score_alpha,
    score_curve,
    smooth_errors,
)
from frame import Part, Row, Tables, list_rows, named

import rftfit
from rftfit.forces.space import mesh_draws
from rftfit.model.draws import end_names, interval
from rftfit.model.fourier import fit_lsq
from rftfit.model.pushes import usual_error
from rftfit.model.scaling import Reference
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS, MEDIA, SANDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from exact_laws import Law

    from rftfit.conventions import FloatArray

    Directions = list[tuple[float, float]]

SE = 0.005
"""Error of alpha from run to run that the paper states, N/cm^3."""
READING = 0.02
"""Error of a reading of Figs. S5 and S12 over the largest force of its curve."""

LAST_DEG = 110.0
DRAWS = 1000
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


def pushed_map(medium: str, directions: Directions) -> rftfit.Map:
    """Map of a published medium whose material is not known, with the errors that the paper states."""
    beta, gamma = np.radians(np.transpose(directions))
    alpha = np.stack(rftfit.published_medium(medium).alpha(beta, gamma))
    shapes = rftfit.published_shapes(MATERIALS[medium])
    return rftfit.estimate_map(push_table(directions, alpha, SE), shapes)


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


def reference_without(left_out: tuple[str, ...]) -> Reference:
    """The published media less some, for the paper's routine."""
    full_reference = rftfit.published_reference()
    included = [i for i, name in enumerate(full_reference.media) if name not in left_out]
    scaled = full_reference.scaled[included]
    media = tuple(full_reference.media[i] for i in included)
    name = f"without {', '.join(left_out)}"
    return Reference(name, media, full_reference.chi[included], scaled.mean(axis=0), scaled)


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


@cache
def measured_curves() -> dict[tuple[str, str], pd.DataFrame]:
    """Measured curves of Figs. S5 and S12 by medium and leg, from -110 to 110 degrees."""
    figure_rows = pd.concat([rftfit.published_table(name) for name in ("fig_s5", "fig_s12")])
    figure_rows = figure_rows[figure_rows["theta_deg"].abs() <= LAST_DEG]
    return {
        (str(medium), str(leg)): rows
        for (medium, leg), rows in figure_rows.groupby(["medium", "leg"])
    }


@cache
def contact_of(
    medium: str, leg_name: str, body_error: rftfit.BodyError | None = None, step: int = 1
) -> rftfit.Contact:
    """Measured curve of a published leg, every so many poses."""
    rows = measured_curves()[medium, leg_name].iloc[::step]
    motion = rftfit.rotation(rows["theta_deg"].to_numpy(float))
    error = READING * float(rows["force_z_N"].abs().max())
    leg = rftfit.model_leg(leg_name)
    return rftfit.Contact(leg, motion, rows, error, body_error or rftfit.BodyError())


def quantile_draws(
    profile: rftfit.Profile, contact: rftfit.Contact, mean: FloatArray
) -> FloatArray:
    """Equally likely forces of a profile that has intervals and no draws, shape (draws, 2, poses)."""
    sides = []
    for tail in np.arange(0.0125, 0.25, 0.025):
        forces = rftfit.predict(profile, contact.body, contact.motion, 1 - 2 * tail, model_error=0)
        sides.append([[forces[name] for name in end_names(f"force_{c}_N")] for c in COMPONENTS])
    ends = np.moveaxis(np.array(sides, dtype=float), 2, 0)
    shares = np.arange(1, 11)[:, None, None] / 10.5
    inner = [side[-1] + shares * (mean - side[-1]) for side in ends]
    return np.concatenate([*ends, *inner])


@cache
def forces_by(medium: str, leg_name: str, model: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draws of the force z and x on a leg (draws, 2, poses), N, their loads (draws, poses), and the best force (2, poses)."""
    contact, profile = contact_of(medium, leg_name), profile_of(medium, model)
    mean = contact.force_draws(profile)[0]
    if isinstance(profile.spread, rftfit.Profile):
        return contact.force_draws(profile.spread), contact.moving.load_size(profile.spread), mean
    draws = mean[None]
    if profile.spread is not None:
        draws = quantile_draws(profile, contact, mean)
    return draws, np.tile(contact.load(profile), (len(draws), 1)), mean


@cache
def learned_error(medium: str, leg_name: str, model: str) -> float:
    """Model's own error over the load, from the other legs in the media of the other material."""
    family = error_family(model)
    training_media = [name for name in MEDIA if name not in MATERIALS.get(medium, ())]
    differences, variances, loads = [], [], []
    for training_medium, leg in product(training_media, LEGS):
        if leg == leg_name:
            continue
        draws, load, mean = forces_by(training_medium, leg, family)
        contact = contact_of(training_medium, leg)
        differences += [*(contact.measured - mean)[:, contact.touches]]
        variances += [*draws.var(axis=0)[:, contact.touches]]
        loads += 2 * [load.mean(axis=0)[contact.touches]]
    return learn_error(differences, variances, loads)


def with_error(draws: FloatArray, loads: FloatArray, size: float, paths: FloatArray) -> FloatArray:
    """Draws of force with the model's own error: its size over the load times paths of variance 1, shape (m, 2, poses)."""
    times = -(-len(paths) // len(draws))
    draws, loads = (np.tile(x, (times, *[1] * (x.ndim - 1))) for x in (draws, loads))
    return np.asarray(draws[: len(paths)] + size * loads[: len(paths), None] * paths)


def grade_legs(models: Sequence[str], medium: str) -> list[Row]:
    """One row a leg, model and component of a medium."""
    rows: list[Row] = []
    for leg_name, model in product(LEGS, models):
        draws, loads, mean = forces_by(medium, leg_name, model)
        error = learned_error(medium, leg_name, model)
        contact = contact_of(medium, leg_name)
        theta_deg = contact.motion.columns["theta_deg"]
        seed = zlib.crc32(f"{medium} {leg_name} {model}".encode())
        draws_with_error = with_error(
            draws, loads, error, smooth_errors(theta_deg, (DRAWS, 2), seed)
        )
        for component in COMPONENTS:
            row: Row = {"leg": leg_name, "model": model, "component": component, "error": error}
            for name, drawn in (("alpha", draws), ("model", draws_with_error)):
                scores = score_curve(contact, component, drawn, mean)
                row |= {f"{key}_{name}": value for key, value in scores.items()}
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
    peaks = rows.pivot_table(
        "peak_percent_model", ["component", "leg"], "model", aggfunc="median", sort=False
    )
    return [*tables, ("Error of the peak, median, %", peaks.reset_index())]


def summarize_model(rows: pd.DataFrame, model: str) -> Row:
    """What lies inside, peaks, errors and scores of a model."""
    of_model = rows[rows["model"] == model]
    off = of_model["peak_percent_model"].abs()
    by_leg = rows.pivot_table("crps_model", ["unit", "leg"], "model")
    less = by_leg[model] - by_leg[BASE]
    difference, error = mean_by_cluster(less.to_numpy(float), [*less.index.get_level_values(0)])
    return {
        "model": model,
        "inside": of_model["inside_model"].mean(),
        "least leg": of_model.groupby(["leg", "component"])["inside_model"].mean().min(),
        "peaks": int(of_model["peak_in_model"].sum()),
        "peaks, alpha": int(of_model["peak_in_alpha"].sum()),
        "peak median": off.median(),
        "peak worst": off.max(),
        "CRPS less 3D-RFT's": difference,
        "its se": error,
        "width": of_model["width_model"].mean(),
        "error": of_model["error"].mean(),
    }


def summarize_component(rows: pd.DataFrame, model: str, component: str) -> Row:
    """Peaks, curves and scores of lift or thrust by a model."""
    chosen = rows[(rows["model"] == model) & (rows["component"] == component)]
    score, error = mean_by_cluster(chosen["crps_model"].to_numpy(float), [*chosen["unit"]])
    return {
        "model": model,
        "component": component,
        "peak, median": chosen["peak_percent_model"].median(),
        "peak, rms": float(np.sqrt((chosen["peak_percent_model"] ** 2).mean())),
        "curve": chosen["rms_model"].mean(),
        "CRPS": score,
        "its se": error,
        "interval score": chosen["score_model"].mean(),
    }


# --- Friction of 3D-RFT, and speeds of the robot


def grade_friction(friction: str) -> list[Row]:
    """Mean absolute error of 3D-RFT on the laboratory legs, over the measured peak."""
    errors = []
    for medium, leg in product(MEDIA, LEGS):
        contact, mean = contact_of(medium, leg), forces_by(medium, leg, f"3D-RFT {friction}")[2]
        for component, off in zip(COMPONENTS, np.abs(mean - contact.measured), strict=True):
            errors.append(off[contact.touches].mean() / abs(peak_of(contact, component)))
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
    law = exact_laws()[law_name]
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
        row: Row = {"law": law_name, "count": count}
        try:
            pushes = push_table(directions, seen[:, places], error[:, places])
            profile = rftfit.estimate_map(pushes, shapes).profile
        except ValueError as problem:
            rows.append(row | {"refused": str(problem)[:60]})
            continue
        assert isinstance(profile.spread, rftfit.Profile)
        drawn = np.stack(profile.spread.alpha(*angles))
        mean = np.stack(profile.alpha(*angles))
        row |= score_alpha(drawn.swapaxes(0, 1), between, mean, np.abs(between).max())
        if law.stress is not None:
            row |= meshes_by_law(law, profile)
        rows.append(row)
    return rows


def meshes_by_law(law: Law, profile: rftfit.Profile) -> Row:
    """Percent of force components on bodies in space inside, with the error of the law, and the width of the interval."""
    assert isinstance(profile.spread, rftfit.Profile)
    inside, widths = [], []
    for mesh, motion in bodies().values():
        true = forces_in_space(law, mesh, motion)
        drawn = mesh_draws(profile.spread, mesh, motion, "measured", None)[..., :3]
        lo, hi = interval(drawn, CONFIDENCE)
        closure = mesh_closure(profile, mesh, motion)
        inside.append(percent_inside(lo - closure, hi + closure, true))
        widths.append(100 * np.mean(hi - lo + 2 * closure) / np.abs(true).max())
    return {"mesh_closure": np.mean(inside), "mesh_width": np.mean(widths)}


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
        ("Forces on meshes inside, closure added, %", "mesh_closure"),
        ("Width of forces on meshes, % of the largest component", "mesh_width"),
    ):
        table = rows.pivot_table(column, "law", "count", aggfunc="mean", sort=False)
        table.loc["all"] = table.mean()
        tables.append((title, table.reset_index()))
    return tables


FRICTIONS = ("0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8")
PARTS = {
    "legs": Part(named(MEDIA), partial(grade_legs, MODELS), report_legs),
    "sands": Part(named(SANDS), partial(grade_legs, OF_ONE_PUSH), report_legs),
    "friction": Part(named(FRICTIONS), grade_friction, list_rows("Laboratory legs")),
    "speeds": Part(named(MODELS), grade_speeds, report_speeds),
    "laws": Part(
        lambda count, _seed: [*product(exact_laws(), range(count))], grade_law, report_laws, SETS
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
