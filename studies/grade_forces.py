"""Predicted forces against measured ones and exact laws: what lies inside the intervals, scores, widths.

    python studies/grade_forces.py PART [PART ...] --rows FOLDER [--against FOLDER]

Each part writes FOLDER/PART.csv, goes on where it stopped, and prints its table; `--against` prints the same table
of another version beside it. All parts take about a quarter of an hour on one core; `all` makes them in order.
`--tilt SHARE` grades the map with another share of its full tilt.

legs      Fig. S5: table, maps of 91, 16, 6 and 1 pushes and rivals, five media x three legs x lift, thrust
reversed  lift of the reversed c-leg with all directions pushed, by spacing of the lines
laws      alpha, legs and meshes of media with an exact law, in random directions between the lines
sands     Fig. S12: natural sands from one push
front     48 measured peaks by `rftfit predict --leg L --alpha X`, and a foot pressed straight down
wheels    96 runs of a wheel
alpha     interval score and error of alpha at the published nodes; six planned pushes beside nine terms

Percent of the measured peak; poses from -110 to 110 degrees with load; the material is left out of the map, leg
shape and material are left out of the model's error. Errors are clustered by medium.
"""

from __future__ import annotations

import argparse
import inspect
import json
import os
import sys
import tempfile
import time
import zlib
from contextlib import chdir
from copy import copy
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pandas as pd
import side_slip
from exact_laws import exact_laws, forces_in_plane, forces_in_space
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
from shapes import MATERIALS, SE, reference_without
from space_coverage import bodies

import rftfit
from rftfit.compare.legs import extreme, measured_peak
from rftfit.forces.plane import force_draws, forces_on
from rftfit.forces.reference_kernel import place, submerged
from rftfit.forces.space import mesh_draws
from rftfit.model import shapes as shapes_of_map
from rftfit.model.draws import end_names, interval
from rftfit.model.fourier import evaluate, fit_lsq
from rftfit.model.rft3d import alpha_3drft
from rftfit.model.shapes import usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS, MEDIA, SANDS
from rftfit.store import write_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    import numpy.typing as npt
    from exact_laws import Law

    from rftfit.conventions import FloatArray

    Row = dict[str, object]
    Directions = list[tuple[float, float]]

HAS_MODEL_ERROR = "model_error" in inspect.signature(rftfit.predict).parameters
WITHOUT_MODEL_ERROR: dict[str, Any] = {"model_error": 0} if HAS_MODEL_ERROR else {}
STATED_ERROR = 0.28
"""Model's own error that the program states (`../shared/forces.md`), for parts that learn none."""
COMPONENTS = ("z", "x")
CONFIDENCE = 0.95
LAST_DEG = 110.0
DRAWS = 1000
QUICK = "--quick" in sys.argv
"""A third of the draws, a tenth for bodies in space, one set of pushes a law, no check of the program's own ends."""
LOAD_STEP = 8 if QUICK else 4
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
WIDTH_FACTORS = tuple(round(0.1 * tenth, 1) for tenth in range(4, 17))
"""By which the widths of intervals with the model's error are multiplied, to see which have the least score."""
OF_ONE_PUSH = ("map 1", "3D-RFT 0.4", "3D-RFT 0.6", "generic")


@cache
def profile_of(medium: str, model: str) -> rftfit.Profile:
    """Profile of a medium by a model that does not know its material; `--quick` takes a third of its draws."""
    profile = full_profile(medium, model)
    if QUICK and isinstance(profile.spread, rftfit.TableProfile):
        profile = with_some_draws(profile, 3)
    return profile


def with_some_draws(profile: rftfit.Profile, step: int) -> rftfit.Profile:
    """The same profile with every `step`-th of its draws."""
    assert isinstance(profile.spread, rftfit.TableProfile)
    beta, gamma, alpha_z, alpha_x = profile.spread.cells
    fewer = copy(profile)
    fewer.spread = rftfit.TableProfile(alpha_z[::step], alpha_x[::step], beta, gamma)
    return fewer


def full_profile(medium: str, model: str) -> rftfit.Profile:
    """Profile of a medium by a model, with all draws."""
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
        forces = rftfit.predict(profile, leg, motion, 1 - 2 * tail, **WITHOUT_MODEL_ERROR)
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


@dataclass(frozen=True)
class ProgramEnds:
    """Interval with the model's error of a component as the program makes it: by pose, and of the peak."""

    lo: FloatArray
    hi: FloatArray
    peak_lo: float
    peak_hi: float


def program_ends(medium: str, leg_name: str, model: str, error: float) -> dict[str, ProgramEnds]:
    """Intervals that the program makes, by component; empty where it has none with the model's error."""
    if not HAS_MODEL_ERROR:
        return {}
    from rftfit.forces import prediction

    make: Any = prediction
    theta_deg = measured_curves()[medium, leg_name]["theta_deg"].to_numpy(float)
    forces, peaks = make.predict_with_peaks(
        profile_of(medium, model),
        rftfit.model_leg(leg_name),
        rftfit.rotation(theta_deg),
        CONFIDENCE,
        quantities=[f"force_{c}_N" for c in COMPONENTS],
        model_error=error,
    )
    tops = {peak.name: peak for peak in peaks}
    ends = {}
    for c, name in zip(COMPONENTS, ("lift", "thrust"), strict=True):
        lo, hi = (forces[f"force_{c}_model_{end}_N"].to_numpy(float) for end in ("lo", "hi"))
        ends[c] = ProgramEnds(lo, hi, tops[name].model_lo, tops[name].model_hi)
    return ends


def leg_rows(medium: str, models: Iterable[str]) -> list[Row]:
    """One row a leg, model and component of a medium."""
    rows: list[Row] = []
    for leg_name, model in product(LEGS, models):
        curve = curve_of(medium, leg_name, model)
        error = learned_error(medium, leg_name, model)
        seed = zlib.crc32(f"{medium} {leg_name} {model}".encode())
        draws_with_error = with_model_error(curve, error, seed)
        of_program = {}
        if not QUICK and error_family(model) in ("table", "map 91"):
            of_program = program_ends(medium, leg_name, model, error)
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
                    f"pose_in_{name}": 100 * float(low[highest] <= sign * top <= high[highest]),
                }
            for factor in WIDTH_FACTORS:
                low, high = (mean + factor * (end - mean) for end in (model_lo, model_hi))
                score = interval_score(low[poses], high[poses], measured[poses])
                row[f"score_of_width_{factor:.1f}"] = 100 * score / peak
            if c in of_program:
                ends = of_program[c]
                row["inside_program"] = percent_inside(
                    ends.lo[poses], ends.hi[poses], measured[poses]
                )
                apart = np.abs(np.stack([ends.lo - model_lo, ends.hi - model_hi]))[:, poses]
                row["program_apart"] = 100 * apart.mean() / peak
                row["peak_in_program"] = 100 * float(ends.peak_lo <= peak <= ends.peak_hi)
            rows.append(row)
    return rows


def best_width(of_model: pd.DataFrame) -> Row:
    """Factor of the widths with the least interval score over all curves, and the score as it is over that least one."""
    scores = of_model.filter(like="score_of_width_").mean()
    return {
        "best factor": float(str(scores.idxmin()).rpartition("_")[2]),
        "score over least": of_model["score_model"].mean() / scores.min(),
    }


def summary_of_legs(rows: pd.DataFrame, models: Sequence[str]) -> pd.DataFrame:
    """One row a model: what lies inside, peaks, errors and scores; errors clustered by medium."""
    lines = []
    for model in models:
        of_model = rows[rows["model"] == model]
        if of_model.empty:
            continue
        least = of_model.groupby(["leg", "component"])["inside_model"].mean().min()
        off = of_model["peak_percent"].abs()
        line: Row = {
            "model": model,
            "inside, alpha": of_model["inside_alpha"].mean(),
            "inside": of_model["inside_model"].mean(),
            "least leg": least,
            "peaks": of_model["peak_in_model"].sum() / 100,
            "at pose": of_model["pose_in_model"].sum() / 100,
            "peaks, alpha": of_model["peak_in_alpha"].sum() / 100,
            "peak median": off.median(),
            "peak worst": off.max(),
            "rms": of_model["rms"].mean(),
            "CRPS": of_model["crps_model"].mean(),
            "CRPS se": mean_by_cluster(of_model["crps_model"].to_numpy(), [*of_model["unit"]])[1],
            "CRPS, alpha": of_model["crps_alpha"].mean(),
            "rms all": of_model["rms_all"].mean(),
            "CRPS all": of_model["crps_all_model"].mean(),
            "CRPS all, alpha": of_model["crps_all_alpha"].mean(),
            "score": of_model["score_model"].mean(),
            "score, alpha": of_model["score_alpha"].mean(),
            "width": of_model["width_model"].mean(),
            "width, alpha": of_model["width_alpha"].mean(),
            "error": of_model["error"].mean(),
            **best_width(of_model),
        }
        if "inside_program" in of_model:
            line["inside, program"] = of_model["inside_program"].mean()
            line["ends apart"] = of_model["program_apart"].mean()
            line["peaks, program"] = of_model["peak_in_program"].sum() / 100
        lines.append(line)
    return pd.DataFrame(lines)


def report_legs(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Tables of the laboratory media or the sands."""
    tables = [("Poses and peaks", summary_of_legs(rows, MODELS))]
    shown = rows[rows["model"].isin(["table", *MAPS, "3D-RFT 0.4"])]
    keys = ["component", "leg"]
    inside = shown.pivot_table("inside_model", keys, "model", aggfunc="mean", sort=False)
    peaks = shown.pivot_table("peak_percent", keys, "model", aggfunc="median", sort=False)
    tables.append(("Poses inside, %", inside.reset_index()))
    tables.append(("Error of the peak, median, %", peaks.reset_index()))
    errors = rows.pivot_table("error", "model", "leg", aggfunc="mean", sort=False)
    tables.append(("Error learned from other legs and material", errors.reset_index()))
    return tables


# --- The reversed leg's lift with all directions pushed


COURSE_FRICTIONS = (0.2, 0.4, 0.8)
SPACINGS_DEG = (30.0, 15.0, 10.0, 5.0, 1.0)


def table_with_course(medium: str, spacing_deg: float) -> rftfit.TableProfile:
    """Table S5 at its lines, between them on finer lines with the course of 3D-RFT: the form, without an estimate."""
    table = rftfit.published_medium(medium)
    beta = np.radians(np.linspace(-90, 90, round(180 / spacing_deg) + 1))
    beta = np.unique(np.concatenate([beta, np.radians(BETA_DEG)]).round(12))
    gamma = np.radians(GAMMA_DEG)
    if spacing_deg < 30:
        # published lines and their midpoints, or more where the spacing asks for them
        counts = np.maximum(2, np.round(np.diff(GAMMA_DEG) / spacing_deg)).astype(int)
        steps = [
            np.linspace(lo, hi, count, endpoint=False)
            for lo, hi, count in zip(gamma[:-1], gamma[1:], counts, strict=True)
        ]
        gamma = np.append(np.concatenate(steps), gamma[-1])
    betas, gammas = np.meshgrid(beta, gamma, indexing="ij")
    published = np.radians(BETA_DEG)[:, None], np.radians(GAMMA_DEG)
    down = float(table.alpha(0.0, np.pi / 2)[0])
    alpha = np.stack(table.alpha(betas, gammas))
    for friction in COURSE_FRICTIONS:
        z, x = alpha_3drft(published[0], published[1], friction)
        bilinear = rftfit.TableProfile(z, x).alpha(betas, gammas)
        law = alpha_3drft(betas, gammas, friction)
        alpha = alpha + down * (np.stack(law) - np.stack(bilinear)) / len(COURSE_FRICTIONS)
    return rftfit.TableProfile(alpha[0], alpha[1], beta[:, None], gamma)


def reversed_rows(medium: str) -> list[Row]:
    """Peak of the reversed leg's lift by table, map of all pushes and the course on lines of several spacings."""
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
    for spacing in SPACINGS_DEG:
        profiles[f"course alone, {spacing:g}"] = table_with_course(medium, spacing)
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


def report_reversed(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Median, least and greatest error of the peak, lateness and rms."""
    groups = rows.groupby("model", sort=False)
    table = groups["peak_percent"].agg(["median", "min", "max"])
    table["worst"] = groups["peak_percent"].agg(lambda x: x.abs().max())
    table["late, deg"] = groups["late_deg"].median()
    table["rms"] = groups["rms"].mean()
    return [("Reversed c-leg's lift, all directions pushed", table.reset_index())]


# --- Exact laws


COUNTS = (1, 4, 8, 16, len(EVERY))
SETS = 1 if QUICK else 6
TEST_DIRECTIONS = 400


def law_rows(name: str) -> list[Row]:
    """Rows of a law and a set of pushes, one a number of pushes: coverage and width of alpha, legs and meshes."""
    law_name, number = name.split(", set ")
    law = exact_laws(MATERIALS)[law_name]
    random = np.random.default_rng([zlib.crc32(law_name.encode()), int(number)])
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
        row |= legs_by_law(law, profile)
        if law.stress is not None:
            row |= meshes_by_law(law, with_some_draws(profile, 10) if QUICK else profile)
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
        "width_strong": np.mean((hi - lo)[strong]) / largest,
    }


def legs_by_law(law: Law, profile: rftfit.Profile) -> Row:
    """Whether the true peaks of lift and thrust lie inside the interval of alpha, by leg."""
    assert isinstance(profile.spread, rftfit.Profile)
    poses = rftfit.rotation(np.arange(-110.0, 111.0, 4.0)).poses
    row: Row = {}
    for leg_name in LEGS:
        leg = rftfit.model_leg(leg_name)
        true = forces_in_plane(law, leg, poses)
        forces = force_draws(profile.spread, leg, poses)
        for component, drawn in enumerate((forces.force_z_N, forces.force_x_N)):
            lo, hi = interval(moved_peaks(drawn, drawn.mean(axis=0)), CONFIDENCE)
            what = f"{('lift', 'thrust')[component]} {leg_name}"
            row[what] = 100 * float(lo <= true[component].max() <= hi)
    return row


def meshes_by_law(law: Law, profile: rftfit.Profile) -> Row:
    """Percent of force components on bodies in space inside: of alpha, and with the closure added."""
    assert isinstance(profile.spread, rftfit.Profile)
    inside: dict[str, list[float]] = {"mesh_alpha": [], "mesh_closure": [], "mesh_normal": []}
    widths = []
    for mesh, motion in bodies().values():
        true = forces_in_space(law, mesh, motion)
        drawn = mesh_draws(profile.spread, mesh, motion, "measured", None)[..., :3]
        lo, hi = interval(drawn, CONFIDENCE)
        closure = mesh_closure(profile, mesh, motion)
        inside["mesh_alpha"].append(percent_inside(lo, hi, true))
        inside["mesh_closure"].append(percent_inside(lo - closure, hi + closure, true))
        middle, half = (lo + hi) / 2, np.hypot((hi - lo) / 2, 1.96 * closure)
        inside["mesh_normal"].append(percent_inside(middle - half, middle + half, true))
        widths.append(float(np.mean(hi - lo + 2 * closure) / np.abs(true).max()))
    row: Row = {name: float(np.mean(values)) for name, values in inside.items()}
    return row | {"mesh_width": 100 * float(np.mean(widths))}


def mesh_closure(profile: rftfit.Profile, mesh: rftfit.Mesh, motion: rftfit.Motion3D) -> FloatArray:
    """Error of the law in space, N, shape (poses, 1)."""
    without_draws = copy(profile)
    without_draws.spread = None
    forces = rftfit.predict(without_draws, mesh, motion, **WITHOUT_MODEL_ERROR)
    return forces[["closure_N"]].to_numpy(float)


def report_laws(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Coverage, strongest quarter, widths and scores by law and number of pushes."""
    tables = []
    for title, column in (
        ("Alpha between the lines inside, %", "inside"),
        ("Strongest quarter inside, %", "inside_strong"),
        ("Width, % of the largest alpha", "width"),
        ("Width of the strongest quarter", "width_strong"),
        ("Interval score, % of the largest alpha", "score"),
        ("Rms error, % of the largest alpha", "rms"),
        ("Forces on meshes inside, of alpha, %", "mesh_alpha"),
        ("Forces on meshes inside, closure added, %", "mesh_closure"),
        ("Forces on meshes inside, closure as a standard error, %", "mesh_normal"),
        ("Width of forces on meshes, % of the largest component", "mesh_width"),
    ):
        table = rows.pivot_table(column, "law", "count", aggfunc="mean", sort=False)
        table.loc["all"] = table.mean()
        tables.append((title, table.reset_index()))
    peaks = [f"{what} {leg}" for what in ("lift", "thrust") for leg in LEGS]
    for family in ("3D-RFT", "frictional", "bilinear"):
        of_family = rows[rows["law"].str.startswith(family)]
        table = of_family.groupby("count")[peaks].mean().T
        tables.append((f"True peaks inside, of alpha, {family}, %", table.reset_index()))
    return tables


# --- The front door


def front_rows(medium: str) -> list[Row]:
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


def foot_rows() -> list[Row]:
    """A flat foot of 8 x 5 cm pressed 5 cm straight down where alpha_z(0, 90 deg) is 0.55 N/cm^3: 110 N."""
    from typer.testing import CliRunner

    from rftfit.cli.app import app

    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("foot.csv").write_text("x_cm,z_cm\n-4,0\n4,0\n")
        Path("down.csv").write_text("t_s,x_cm,z_cm,angle_deg\n0,0,0,0\n5,0,-5,0\n")
        body = ["--outline", "foot.csv", "--width", "5", "--path", "down.csv"]
        words = ["predict", *body, "--alpha", "0.55", "--json"]
        answer = CliRunner().invoke(app, words)
    facts = json.loads(answer.stdout)["peaks"]["lift"]
    return [
        {
            "leg": "foot",
            "peak": "lift",
            "alpha": 0.55,
            "measured_N": 110.0,
            "value_N": facts["force_z_N"],
            "lo_N": facts["lo"],
            "hi_N": facts["hi"],
            "inside": 100 * float(facts["lo"] <= 110 <= facts["hi"]),
            "peak_percent": 100 * (facts["force_z_N"] / 110 - 1),
        }
    ]


def report_front(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """All peaks, and how many lie inside."""
    foot = rows[rows["unit"] == "foot"]
    legs = rows[rows["unit"] != "foot"]
    inside = legs.pivot_table("inside", "leg", "peak", aggfunc=lambda x: x.sum() / 100)
    inside.loc["all"] = inside.sum()
    columns = ["unit", "leg", "peak", "measured_N", "value_N", "lo_N", "hi_N", "inside"]
    return [
        ("Peaks inside, of 8 each", inside.reset_index()),
        ("Every peak", legs[columns]),
        ("Foot", foot[columns]),
        (
            "Width, % of the measured peak, median",
            legs.groupby("leg")["width"].median().reset_index(),
        ),
    ]


# --- Wheels


def wheel_rows(case: str) -> list[Row]:
    """One row a run and component: measured, predicted, and ends of the interval with the model's error."""
    runs = pd.read_csv(side_slip.RUNS)
    alpha = side_slip.CASES["measured law"][0]
    motion = side_slip.at_depth(runs, runs.sinkage_mm / 10)
    mesh = rftfit.Mesh.cylinder(side_slip.RADIUS_CM, width_cm=6, facets=48)
    if case == "mean of the tables":
        profile: rftfit.Profile = rftfit.TableProfile(*(alpha * side_slip.mean_map()))
    elif case == "mean of the tables with the course":
        tables = [table_with_course(medium, 15.0) for medium in MEDIA]
        maps = [np.stack(table.cells[2:]) / table.alpha(0, np.pi / 2)[0] for table in tables]
        beta, gamma = tables[0].cells[:2]
        z, x = alpha * np.mean(maps, axis=0)
        profile = rftfit.TableProfile(z, x, beta, gamma)
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
    for frame in motion.frames:
        _, depth_area, normal, moves, _ = moving_faces(mesh, frame)
        alpha = face_alpha(profile, normal, moves)
        up = np.abs(alpha[:, 2]) @ depth_area
        across = np.hypot(alpha[:, 0], alpha[:, 1]) @ depth_area
        loads.append(np.hypot(up, across) * np.hypot(1, 0.2))
    return np.array(loads)


def report_wheels(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
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


# --- Alpha at the published nodes


ALPHA_COUNTS = (1, 4, 8, 20)
ALPHA_SETS = 1 if QUICK else 3
_FREE_DEG = (np.abs(np.degrees(NODES[1])).round() == 90) & (
    (np.degrees(NODES[0]).round() % 90) == 0
)


def alpha_rows(name: str) -> list[Row]:
    """Rows of a published medium without itself or its material, or of a slice of 3D-RFT, by number of pushes."""
    what, medium = name.split(": ")
    if medium in MEDIA:
        truth = np.stack(rftfit.published_medium(medium).alpha(*NODES))
        left_out = (medium,) if what == "medium out" else MATERIALS[medium]
    else:
        truth = 0.4 * np.stack(alpha_3drft(*NODES, float(medium)))
        left_out = ()
    shapes = rftfit.published_shapes(left_out)
    error = usual_error(truth)
    rows: list[Row] = []
    if what == "planned":
        random = np.random.default_rng([zlib.crc32(medium.encode()), 77])
        steps = rftfit.plan("map", planning_start(shapes), count=6).steps[1:]
        directions = [place for step in steps for place in step.directions]
        for number in range(ALPHA_SETS):
            seen = truth + error * random.standard_normal(truth.shape)
            noise = (seen - truth) / error
            at_places = nodes_of(directions)
            estimate = rftfit.estimate_map(
                push_table(directions, seen[:, at_places], error[:, at_places]), shapes
            )
            nine = np.stack(evaluate(fit_lsq(*NODES, *seen), *NODES))
            largest = np.abs(truth).max() / 100
            mean = np.stack(estimate.profile.alpha(*NODES))
            rows.append(
                {
                    "what": what,
                    "medium": medium,
                    "set": number,
                    "count": 6,
                    "noise": float(noise.std()),
                    "rms": np.sqrt(np.mean((mean - truth) ** 2)) / largest,
                    "nine": np.sqrt(np.mean((nine - truth) ** 2)) / largest,
                }
            )
        return rows
    for number in range(ALPHA_SETS):
        random = np.random.default_rng([zlib.crc32(medium.encode()), number])
        order = random.permutation(len(EVERY))
        seen = truth + error * random.standard_normal(truth.shape)
        for count in ALPHA_COUNTS:
            places = order[:count]
            row: Row = {"what": what, "medium": medium, "set": number, "count": count}
            directions = [EVERY[place] for place in places]
            try:
                profile = rftfit.estimate_map(
                    push_table(directions, seen[:, places], error[:, places]), shapes
                ).profile
            except ValueError as problem:
                rows.append(row | {"refused": str(problem)[:60]})
                continue
            assert isinstance(profile.spread, rftfit.Profile)
            is_unpushed = np.ones(len(EVERY), dtype=bool)
            is_unpushed[places] = False
            angles = NODES[0][is_unpushed], NODES[1][is_unpushed]
            drawn = np.stack(profile.spread.alpha(*angles)).swapaxes(0, 1)
            # symmetry leaves alpha_x of a level plate no freedom
            mean = np.stack(profile.alpha(*angles))
            free = np.stack([np.ones(int(is_unpushed.sum()), dtype=bool), ~_FREE_DEG[is_unpushed]])
            row |= scores_of_alpha(drawn[:, free], truth[:, is_unpushed][free], mean[free])
            rows.append(row)
    return rows


def nodes_of(directions: Directions) -> list[int]:
    """Places of directions among the published ones."""
    rounded = [(round(beta, 2), round(gamma, 2)) for beta, gamma in EVERY]
    return [rounded.index((round(beta, 2), round(gamma, 2))) for beta, gamma in directions]


def planning_start(shapes: rftfit.Shapes) -> Any:
    """What a plan knows before the first push."""
    from rftfit.forces.planning import prior_map

    return prior_map(shapes)


def report_alpha(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Interval score, coverage and error at nodes that were not pushed; planned pushes beside nine terms."""
    tables = []
    nodes = rows[rows["what"] != "planned"]
    for title, column in (
        ("Interval score at nodes, % of the largest alpha", "score"),
        ("Inside at nodes, %", "inside"),
        ("Rms error at nodes, %", "rms"),
        ("Width at nodes, %", "width"),
    ):
        table = nodes.pivot_table(column, "what", "count", aggfunc="mean", sort=False)
        tables.append((title, table.reset_index()))
    planned = rows[rows["what"] == "planned"].groupby("medium", sort=False)[["rms", "nine"]].mean()
    tables.append(
        ("Six planned pushes, and nine terms of all, rms error, %", planned.reset_index())
    )
    return tables


# --- Parts


@dataclass(frozen=True)
class Part:
    """Units in order, the rows that each makes, and the tables of them all."""

    units: Sequence[str]
    make: Callable[[str], list[Row]]
    report: Callable[[pd.DataFrame], list[tuple[str, pd.DataFrame]]]


def parts(models: Sequence[str] = MODELS) -> dict[str, Part]:
    """Parts by name, in the order of `all`; `models`: of the legs."""
    laws = [f"{law}, set {number}" for number in range(SETS) for law in exact_laws(MATERIALS)]
    published = [f"{what}: {m}" for what in ("medium out", "material out") for m in MEDIA]
    planned = [f"planned: {medium}" for medium in ("0.2", "0.4", "0.8", *MEDIA)]
    of_one_push = [model for model in OF_ONE_PUSH if model in models]
    wheels = ["mean of the tables", "mean of the tables with the course", "map of one push"]
    return {
        "legs": Part(MEDIA, lambda medium: leg_rows(medium, models), report_legs),
        "reversed": Part(MEDIA, reversed_rows, report_reversed),
        "sands": Part(SANDS, lambda sand: leg_rows(sand, of_one_push), report_legs),
        "front": Part(
            [*MEDIA, *SANDS, "foot"],
            lambda unit: foot_rows() if unit == "foot" else front_rows(unit),
            report_front,
        ),
        "wheels": Part(wheels, wheel_rows, report_wheels),
        "laws": Part(laws, law_rows, report_laws),
        "alpha": Part([*planned, *published], alpha_rows, report_alpha),
    }


def run(graded_part: Part, file: Path) -> pd.DataFrame:
    """Make the units that the file lacks, one after the other, and read all rows."""
    all_rows = pd.read_csv(file) if file.exists() else pd.DataFrame(columns=["unit"])
    for unit in graded_part.units:
        if unit in set(all_rows["unit"]):
            continue
        start = time.process_time()
        rows = pd.DataFrame(graded_part.make(unit))
        rows.insert(0, "unit", unit)
        rows["unit_s"] = time.process_time() - start
        all_rows = pd.concat([all_rows, rows], ignore_index=True)
        write_text(file, all_rows.to_csv(index=False, float_format="%.6g"))
    return all_rows


def show(title: str, table: pd.DataFrame, earlier_table: pd.DataFrame | None = None) -> None:
    """Print a table as markdown; numbers of another version stand behind a slash."""
    print(f"\n{title}\n\n| {' | '.join(map(str, table.columns))} |")
    print("|" + "---|" * table.shape[1])
    before = {}
    if earlier_table is not None:
        before = {label(line): line for line in earlier_table.to_dict("records")}
    for line in table.to_dict("records"):
        cells = []
        of_other = before.get(label(line), {})
        for column, value in line.items():
            text = shown(column, value)
            if column in of_other and not isinstance(value, str):
                text += f" / {shown(column, of_other[column])}"
            cells.append(text)
        print(f"| {' | '.join(cells)} |")


def label(line: dict[Any, Any]) -> tuple[str, ...]:
    """What tells the lines of a table apart: their words."""
    return tuple(value for value in line.values() if isinstance(value, str))


def shown(column: object, value: object) -> str:
    """A number with one digit, an error of 0.1 to 0.3 with two."""
    if isinstance(value, str):
        return value
    digits = 2 if str(column) == "error" or str(column) in LEGS else 1
    return f"{float(str(value)):.{digits}f}"


def main() -> None:
    """Make the rows of parts and print their tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="+", choices=[*parts(), "all"], metavar="PART")
    parser.add_argument("--rows", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--against", type=Path, metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="fewer draws and sets")
    parser.add_argument("--models", nargs="+", default=MODELS, choices=MODELS, help="of the legs")
    parser.add_argument("--tilt", type=float, metavar="SHARE", help="share of the map's full tilt")
    options = parser.parse_args()
    if options.tilt is not None:
        shapes_of_map.TILT_SHARE = options.tilt
    every = parts(options.models)
    for name in every if "all" in options.parts else options.parts:
        graded_part = every[name]
        rows = run(graded_part, options.rows / f"{name}.csv")
        seconds = rows.groupby("unit")["unit_s"].first().sum()
        print(f"\n## {name}: {seconds:.0f} s of one core")
        earlier_tables: list[pd.DataFrame | None] = []
        if options.against and (options.against / f"{name}.csv").exists():
            before = pd.read_csv(options.against / f"{name}.csv")
            earlier_tables = [table for _, table in graded_part.report(before)]
        tables = graded_part.report(rows)
        for (title, table), earlier_table in zip(
            tables, [*earlier_tables, *[None] * len(tables)], strict=False
        ):
            show(title, table, earlier_table)


if __name__ == "__main__":
    main()
