"""How far the speed and best curvature of the robot depend on the errors of alpha, of its legs' arc and of the model.

A speed is nearly linear in alpha and depends on dozens of its cells, so its error is close to normal:
a few draws of alpha give its width, with Student's t for as many degrees of freedom. Speeds of the
draws are compared with that of the profile itself at the same coarser time step, whose own error
cancels. A run on a draw starts as that on the profile ends: it has no transient from rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.forces.model_error import has_model_error
from rftfit.measure.flags import Remark, reason_cells, remark
from rftfit.measure.slopes import GIVEN_DOF, student_quantile
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, Profile, TableProfile
from rftfit.outputs.dictionary import columns_of
from rftfit.robot.config import Robot
from rftfit.robot.run import Condition
from rftfit.robot.sweep import BEST_AT_HZ, BEST_CURVATURES, best_of_runs, run_all, runs_about_best

SPEED_DRAWS = 8
"""For speeds, in dozens of conditions: a half width is then known to a quarter of itself."""

BEST_DRAWS = 40
"""For the best curvature, of which there is one."""

MODEL_POINTS = 4
"""Pairs of factors of lift and thrust that stand for the model's own error."""

COARSER = 4
"""How many times longer the time step of the draws is."""

WIDTH_COLUMNS = columns_of("robot/intervals.csv")
"""Columns of the table of half widths; quantity `SPEED`, `SPEED_MODEL` (cm/s) or `BEST` (R'/r)."""

SPEED, SPEED_MODEL, BEST = "speed", "speed with the model's own error", "best curvature"

_OF_SPEED = ["profile", "curvature_times_R", "frequency_Hz"]
_KEYS = {SPEED: _OF_SPEED, SPEED_MODEL: _OF_SPEED, BEST: ["profile", "frequency_Hz"]}


@dataclass(frozen=True)
class Width:
    """Half the width of an interval, from so many draws; NaN with a reason where it is unknown."""

    half: float
    draws: int
    why: tuple[Remark, ...] = ()

    @property
    def cells(self) -> tuple[object, ...]:
        """Cells of the table of half widths."""
        return self.half, self.draws, *reason_cells(self.why)


def half_widths(widths: pd.DataFrame | None, quantity: str) -> dict[Any, float]:
    """Half widths of a quantity by profile, curvature (of speeds) and frequency, from their table."""
    if widths is None:
        return {}
    widths_of_quantity = widths[widths["quantity"] == quantity].set_index(_KEYS[quantity])
    return widths_of_quantity["half_width"].astype(float).to_dict()


def each_draw(stack: Profile, count: int) -> list[Profile]:
    """Split the first draws off a stack: profiles with a leading axis of draws."""
    if isinstance(stack, TableProfile):
        alphas = zip(stack.alpha_z[:count], stack.alpha_x[:count], strict=True)
        return [_with_alpha(stack, alpha_z, alpha_x) for alpha_z, alpha_x in alphas]
    if isinstance(stack, FourierProfile):
        return [FourierProfile(values) for values in stack.coefficients[:count]]
    if isinstance(stack, DepthOnlyProfile):
        return [DepthOnlyProfile(values) for values in stack.values[:count]]
    raise TypeError(f"no draws of a {type(stack).__name__}")


def with_model_error(profile: Profile, eps: float) -> list[Profile]:
    """A profile whose lift and thrust have the model's own error, each one factor exp(eps N) common to all legs.

    The pairs of normal numbers N lie evenly on a circle: both have mean 0 and variance 1 and do not correlate.
    """
    angles = 2 * np.pi * (np.arange(MODEL_POINTS) + 0.5) / MODEL_POINTS
    lifts, thrusts = np.exp(eps * np.sqrt(2) * np.stack([np.cos(angles), np.sin(angles)]))
    return [
        _scaled(profile, float(lift), float(thrust))
        for lift, thrust in zip(lifts, thrusts, strict=True)
    ]


def _scaled(profile: Profile, lift: float, thrust: float) -> Profile:
    """A profile whose alpha_z and alpha_x are larger by a factor each."""
    if isinstance(profile, TableProfile):
        return _with_alpha(profile, lift * profile.alpha_z, thrust * profile.alpha_x)
    raise TypeError(f"no model's error of a {type(profile).__name__}")


def _with_alpha(table: TableProfile, alpha_z: FloatArray, alpha_x: FloatArray) -> TableProfile:
    """Take a table with other numbers at its nodes: a new one would symmetrise and extend again what is extended already."""
    changed = copy(table)
    changed.__dict__.pop("pack", None)
    changed.alpha_z, changed.alpha_x = alpha_z, alpha_x
    return changed


def coarser(robot: Robot) -> Robot:
    """Return the robot with the time step of the draws."""
    numerics = robot.numerics
    longer = numerics.model_copy(update={"step_s": COARSER * numerics.step_s})
    return robot.model_copy(update={"numerics": longer})


def speeds_of(
    robot: Robot,
    profile: Profile,
    near_profiles: Sequence[Profile],
    conditions: Sequence[Condition],
    threads: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Speeds on a profile (conditions,) and on some near it (profiles, conditions), cm/s; NaN where a run is not steady.

    All start from the settled runs of the profile, so that what these have left of their transient cancels.
    """
    settled_runs = run_all(robot, profile, conditions, threads)
    runs, *runs_near = (
        run_all(robot, medium, conditions, threads, settled_runs)
        for medium in (profile, *near_profiles)
    )
    speeds = [[run.speed_cm_per_s for run in runs_of_profile] for runs_of_profile in runs_near]
    shape = len(near_profiles), len(conditions)
    return np.array([run.speed_cm_per_s for run in runs]), np.array(speeds, float).reshape(shape)


def half_width_of_draws(values: FloatArray, best_value: float, confidence: float) -> Width:
    """Half the width of an interval from the values of a few draws, which scatter about `best_value`.

    It is unknown where a draw has no value: without that draw the interval would be too narrow.
    """
    from scipy.special import stdtrit

    if not math.isfinite(best_value):
        return Width(math.nan, values.size, (remark("no-speed"),))
    lost = int(np.isnan(values).sum())
    if lost or not values.size:
        return Width(math.nan, values.size, (remark("draws-lost", lost=lost, draws=values.size),))
    spread = math.sqrt(float(((values - best_value) ** 2).mean()))
    return Width(float(stdtrit(values.size, 0.5 + confidence / 2)) * spread, values.size)


def speed_widths(
    robot: Robot,
    profile: Profile,
    draws: Sequence[Profile],
    conditions: Sequence[Condition],
    confidence: float,
    threads: int | None = None,
    arc_percent: float = 0.0,
) -> tuple[list[Width], list[Width]]:
    """Half widths of the intervals of the speed (cm/s) in each condition: of alpha, and with the model's own error.

    Of a profile of which no error of the model is known the latter are NaN, with the reason. `draws`: of the profile, under the errors of alpha. `arc_percent`: Standard deviation of the arc
    that all legs have in common.
    """
    robot = coarser(robot)
    is_known = has_model_error(profile)
    eps = profile.model_error if is_known else 0.0
    shifted = with_model_error(profile, eps) if eps else []
    speeds, speeds_near = speeds_of(robot, profile, [*draws, *shifted], conditions, threads)
    moved = moved_by_arc(robot, profile, speeds, conditions, arc_percent, threads)
    of_alpha = widths_of_draws(speeds, speeds_near[: len(draws)], moved, confidence)
    if not is_known:
        unknown = Width(math.nan, len(draws), (remark("model-error-unknown", form=profile.form),))
        return of_alpha, [unknown] * len(of_alpha)
    if not shifted:
        return of_alpha, of_alpha
    return of_alpha, model_widths(of_alpha, speeds, speeds_near[len(draws) :], confidence)


def moved_by_arc(
    robot: Robot,
    profile: Profile,
    speeds: FloatArray,
    conditions: Sequence[Condition],
    arc_percent: float,
    threads: int | None,
) -> FloatArray:
    """Change of the speeds (conditions,) by one standard deviation of the arc, cm/s."""
    if not arc_percent:
        return np.zeros(len(conditions))
    longer = [with_arc_scaled(condition, 1 + arc_percent / 100) for condition in conditions]
    return np.asarray(speeds_of(robot, profile, (), longer, threads)[0] - speeds)


def widths_of_draws(
    speeds: FloatArray, drawn: FloatArray, moved_by_arc: FloatArray, confidence: float
) -> list[Width]:
    """Half widths in each condition from speeds of the profile (conditions,), of its draws, and their change by the arc."""
    widths = [
        half_width_of_draws(column, float(speed), confidence)
        for column, speed in zip(drawn.T, speeds, strict=True)
    ]
    off = (float(student_quantile(confidence, GIVEN_DOF)) * moved_by_arc).tolist()
    arc = (remark("arc-lost"),)
    return [
        Width(math.hypot(width.half, shift), width.draws, width.why or arc * math.isnan(shift))
        for width, shift in zip(widths, off, strict=True)
    ]


def model_widths(
    of_alpha: Sequence[Width], speeds: FloatArray, shifted: FloatArray, confidence: float
) -> list[Width]:
    """Half widths with the model's own error, which is independent of the errors `of_alpha`.

    `shifted`: speeds of the profiles of `with_model_error`, each (conditions,).
    """
    of_model = np.sqrt(((shifted - speeds) ** 2).mean(axis=0))
    halves = float(student_quantile(confidence, GIVEN_DOF)) * of_model
    return [
        Width(
            math.hypot(width.half, half),
            width.draws,
            width.why or (remark("no-speed"),) * math.isnan(half),
        )
        for width, half in zip(of_alpha, halves.tolist(), strict=True)
    ]


def with_arc_scaled(condition: Condition, factor: float) -> Condition:
    """Return a condition whose legs have an arc of so many times the degrees, at the same distance of hip and tip.

    The arc of a half circle cannot grow: it becomes shorter.
    """
    curvature = math.sin(math.asin(condition.curvature_times_R) * factor)
    return replace(condition, curvature_times_R=curvature)


def best_width(
    robot: Robot,
    profile: Profile,
    draws: Sequence[Profile],
    confidence: float,
    threads: int | None = None,
) -> Width:
    """Half the width of the interval of the best curvature R'/r at 5 Hz.

    It is unknown where the fastest curvature is the first or the last that was tried.
    """
    longer = coarser(robot)
    settled_runs = runs_about_best(longer, profile, threads)
    best, *best_of_draws = (
        best_of_runs(runs_about_best(longer, medium, threads, settled_runs))[0]
        for medium in (profile, *draws)
    )
    if best in (BEST_CURVATURES[0], BEST_CURVATURES[-1]):
        return Width(math.nan, len(draws), (remark("best-at-end"),))
    return half_width_of_draws(np.array(best_of_draws), best, confidence)


def widths(
    robot: Robot,
    profiles: Mapping[str, Profile],
    measured: pd.DataFrame,
    confidence: float,
    threads: int | None = None,
    arc_percent: float = 0.0,
) -> pd.DataFrame:
    """Half widths for every measured condition, and of the best curvature, on each profile.

    The spread of each profile is a stack of draws. Returns `WIDTH_COLUMNS` without the medium.
    """
    with_frequency = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    places = zip(with_frequency["frequency_Hz"], with_frequency["curvature_times_R"], strict=True)
    conditions = [Condition(*place) for place in dict.fromkeys(places)]
    rows: list[tuple[object, ...]] = []
    for name, profile in profiles.items():
        stack, bare = profile.spread, copy(profile)
        assert isinstance(stack, Profile)
        bare.spread = bare.beside = None  # the processes need not carry them
        draws = each_draw(stack, SPEED_DRAWS)
        of_speed = speed_widths(robot, bare, draws, conditions, confidence, threads, arc_percent)
        for quantity, half in zip((SPEED, SPEED_MODEL), of_speed, strict=True):
            rows += [
                (name, quantity, condition.curvature_times_R, condition.frequency_Hz, *width.cells)
                for condition, width in zip(conditions, half, strict=True)
            ]
        many = each_draw(stack, BEST_DRAWS)
        best = best_width(robot, bare, many, confidence, threads)
        rows.append((name, BEST, math.nan, BEST_AT_HZ, *best.cells))
    return pd.DataFrame(rows, columns=WIDTH_COLUMNS[1:])
