"""Intervals of speed and best curvature of the robot, from the errors of alpha, of its legs' arc and of the model.

A speed is nearly linear in alpha and depends on dozens of its cells, so its error is close to normal:
a few draws of alpha give its width, with Student's t for as many degrees of freedom. Speeds on the
draws are compared with the speed on the profile at the same, longer time step, so that the error of this step
cancels. A run on a draw starts in the last state of the run on the profile: it has no transient from rest.

A profile gives alpha (stress per depth, N/cm^3) of a medium in every direction; a draw is a profile whose alpha is
changed at random within its errors. A condition is a leg curvature R'/r and a stride frequency. A `Remark` is a
reason as a code, which becomes a sentence; in tables it has two cells, words and code (`reason_cells`).
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
from rftfit.robot.sweep import (
    BEST_AT_HZ,
    BEST_CURVATURES,
    best_of_runs,
    measured_conditions,
    run_all,
    runs_about_best,
)
from rftfit.store.chosen import chosen

CHOSEN = chosen("robot", "intervals")
"""Chosen numbers of this module, with their reasons in ``chosen.toml``: how many draws, and how much longer the time step."""

SPEED, SPEED_MODEL, BEST = "speed", "speed with the model's own error", "best curvature"
"""Quantities that have an interval: a speed by the errors of alpha and of the arc (cm/s), the same with the error of
the force model too (cm/s), and the curvature of the fastest legs (R'/r)."""

WIDTH_COLUMNS = columns_of("robot/intervals.csv")
"""Columns of the table of half widths: medium, profile, quantity (`SPEED`, ...), curvature R'/r and frequency (Hz) of
the condition, half width in the unit of the quantity, number of draws behind it, and why it is not known."""

_SPEED_KEYS = ["profile", "curvature_times_R", "frequency_Hz"]
_KEYS = {SPEED: _SPEED_KEYS, SPEED_MODEL: _SPEED_KEYS, BEST: ["profile", "frequency_Hz"]}
"""Columns that name one half width of a quantity in the table of one medium."""


@dataclass(frozen=True)
class Width:
    """Half width of an interval, in the unit of its quantity, and the number of draws of alpha behind it.

    `half`: NaN if it is not known. `why`: the reasons; empty if it is known.
    """

    half: float
    draws: int
    why: tuple[Remark, ...] = ()

    @property
    def cells(self) -> tuple[object, ...]:
        """Last cells of its row in the table of half widths: half width, draws, reason in words and as code."""
        return self.half, self.draws, *reason_cells(self.why)


def half_widths(widths: pd.DataFrame | None, quantity: str) -> dict[Any, float]:
    """Return the half widths of a quantity (`SPEED`, ...), by the columns of `_KEYS`; empty without a table.

    `widths`: table with `WIDTH_COLUMNS` of one medium. Keys are tuples in the order of `_KEYS`: for a speed profile,
    R'/r and frequency (Hz). A half width that is not known is NaN.
    """
    if widths is None:
        return {}
    widths_of_quantity = widths[widths["quantity"] == quantity].set_index(_KEYS[quantity])
    return widths_of_quantity["half_width"].astype(float).to_dict()


def each_draw(stack: Profile, count: int) -> list[Profile]:
    """Return the first `count` draws of a stack as profiles of their own, since the robot runs on one profile at a time.

    `stack`: a profile whose parameters have a leading axis of draws. Raises TypeError for a form without draws.
    """
    if isinstance(stack, TableProfile):
        alphas = zip(stack.alpha_z[:count], stack.alpha_x[:count], strict=True)
        return [_with_alpha(stack, alpha_z, alpha_x) for alpha_z, alpha_x in alphas]
    if isinstance(stack, FourierProfile):
        return [FourierProfile(values) for values in stack.coefficients[:count]]
    if isinstance(stack, DepthOnlyProfile):
        return [DepthOnlyProfile(values) for values in stack.values[:count]]
    raise TypeError(f"no draws of a {type(stack).__name__}")


def with_model_error(profile: Profile, eps: float) -> list[Profile]:
    """Return `model_points` profiles whose alpha_z and alpha_x are multiplied by an error of the force model, exp(eps N).

    `eps`: relative error of the force model. The factors are the same in all directions; alpha_z has one number N,
    alpha_x another. The pairs of numbers lie evenly on a circle of radius sqrt(2): like two independent normal numbers,
    both have mean 0 and variance 1 and are not correlated, but a few pairs are enough where random ones would have to
    be many.
    """
    if not isinstance(profile, TableProfile):
        raise TypeError(f"no model's error of a {type(profile).__name__}")
    angles = 2 * np.pi * (np.arange(CHOSEN.model_points) + 0.5) / CHOSEN.model_points
    # a row for each profile: factor on alpha_z, factor on alpha_x
    factors = np.exp(eps * np.sqrt(2) * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return [
        _with_alpha(profile, factor_z * profile.alpha_z, factor_x * profile.alpha_x)
        for factor_z, factor_x in factors
    ]


def _with_alpha(table: TableProfile, alpha_z: FloatArray, alpha_x: FloatArray) -> TableProfile:
    """Return a copy of a table with other alpha at its nodes.

    `alpha_z`, `alpha_x`: N/cm^3, shape (nodes of beta, nodes of gamma) as in the table, where symmetry has filled in
    all nodes: a new `TableProfile` would fill them in again.
    """
    changed = copy(table)
    changed.__dict__.pop("pack", None)  # the cached arrays for the kernel hold the old alpha
    changed.alpha_z, changed.alpha_x = alpha_z, alpha_x
    return changed


def coarser(robot: Robot) -> Robot:
    """Return the robot with the longer time step of runs on draws: dozens of runs need not be as exact as one.

    A speed on a draw counts only by its difference from the speed on the profile at the same step.
    """
    numerics = robot.numerics
    longer = numerics.model_copy(update={"step_s": CHOSEN.coarser * numerics.step_s})
    return robot.model_copy(update={"numerics": longer})


def speeds_of(
    robot: Robot,
    profile: Profile,
    near_profiles: Sequence[Profile],
    conditions: Sequence[Condition],
    threads: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the speeds on a profile (conditions,) and on profiles near it (profiles, conditions), cm/s, to be compared.

    A speed is NaN if the run is not steady. All runs start in the last states of first runs on the profile, so that the
    remaining transient of these is the same in all and cancels: the run on the profile is made twice for this reason.
    `threads`: as in `run_all`.
    """
    settled_runs = run_all(robot, profile, conditions, threads)
    speeds = [
        [run.speed_cm_per_s for run in run_all(robot, medium, conditions, threads, settled_runs)]
        for medium in (profile, *near_profiles)
    ]
    on_profile, on_near_profiles = np.split(np.array(speeds, dtype=float), [1])
    return on_profile[0], on_near_profiles


def half_width_of_draws(values: FloatArray, best_value: float, confidence: float) -> Width:
    """Return the half width of an interval: Student's t times the root mean square of the deviations of a few draws.

    `values`: a speed or best curvature on each draw, shape (draws,), NaN if the draw has none. `best_value`: that on
    the profile, from which deviations count. `confidence`: level of the interval, 0 to 1. The half width is NaN if a
    draw has no value: without this draw the interval would be too narrow.
    """
    if not math.isfinite(best_value):
        return Width(math.nan, values.size, (remark("no-speed"),))
    lost = int(np.isnan(values).sum())
    if lost or not values.size:
        return Width(math.nan, values.size, (remark("draws-lost", lost=lost, draws=values.size),))
    spread = math.sqrt(float(((values - best_value) ** 2).mean()))
    return Width(float(student_quantile(confidence, values.size)) * spread, values.size)


def speed_widths(
    robot: Robot,
    profile: Profile,
    draws: Sequence[Profile],
    conditions: Sequence[Condition],
    confidence: float,
    threads: int | None = None,
    arc_percent: float = 0.0,
) -> tuple[list[Width], list[Width]]:
    """Return half widths of the speed's interval (cm/s) in each condition, without and with the model's error.

    The first list contains the errors of alpha and of the arc; the second adds the error of the force model, and is NaN
    with a reason for a profile whose model error is not known. `draws`: draws of the profile within the errors of
    alpha. `confidence`: level of the intervals, 0 to 1. `threads`: as in `run_all`. `arc_percent`: standard deviation
    of the angle of the legs' arc, % of it, an error common to all legs; 0: none.
    """
    robot = coarser(robot)
    is_known = has_model_error(profile)
    eps = profile.model_error if is_known else 0.0
    with_error = with_model_error(profile, eps) if eps else []
    # one call for draws and model errors, so that both start from the same settled runs
    speeds, speeds_near = speeds_of(robot, profile, [*draws, *with_error], conditions, threads)
    speeds_of_draws, speeds_with_error = np.split(speeds_near, [len(draws)])
    of_alpha = [
        half_width_of_draws(speeds_of_condition, float(speed), confidence)
        for speeds_of_condition, speed in zip(speeds_of_draws.T, speeds, strict=True)
    ]
    if arc_percent:
        # one run with an arc that is one standard deviation longer: the speed is nearly linear in so small a change
        longer = [with_arc_scaled(condition, 1 + arc_percent / 100) for condition in conditions]
        change = speeds_of(robot, profile, (), longer, threads)[0] - speeds
        of_alpha = add_error(of_alpha, change, confidence, remark("arc-lost"))
    if not is_known:
        unknown = Width(math.nan, len(draws), (remark("model-error-unknown", form=profile.form),))
        return of_alpha, [unknown] * len(of_alpha)
    if not with_error:
        return of_alpha, of_alpha
    of_model = np.sqrt(((speeds_with_error - speeds) ** 2).mean(axis=0))
    return of_alpha, add_error(of_alpha, of_model, confidence, remark("no-speed"))


def add_error(
    widths: Sequence[Width], errors: FloatArray, confidence: float, lost: Remark
) -> list[Width]:
    """Return half widths with an independent error added: their squares add.

    `errors`: a standard deviation of either sign for each width, NaN where it is not known. `lost`: the reason then
    given for a half width that has none yet.
    """
    # `GIVEN_DOF`: degrees of freedom of an error that is stated, not estimated from the data
    halves = (float(student_quantile(confidence, GIVEN_DOF)) * errors).tolist()
    return [
        Width(math.hypot(width.half, half), width.draws, width.why or (lost,) * math.isnan(half))
        for width, half in zip(widths, halves, strict=True)
    ]


def with_arc_scaled(condition: Condition, factor: float) -> Condition:
    """Return a condition whose legs have an arc of `factor` times the angle, at the same distance of hip and tip.

    R'/r is the sine of half the angle of the arc. A c-leg is a half circle, where R'/r cannot grow: a larger factor
    makes it smaller.
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
    """Return the half width of the interval of the best curvature R'/r at 5 Hz, from the best curvature on each draw.

    It is NaN if the fastest curvature is the first or the last that was tried, since a draw whose best lies beyond
    would look the same. Parameters as in `speed_widths`.
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
    """Return half widths of the speed in every measured condition and of the best curvature, on each profile of a medium.

    `profiles`: by name; the `spread` of each must be a stack of draws. `measured`: table of measured speeds, of which
    only ``curvature_times_R`` and ``frequency_Hz`` count. `confidence`, `arc_percent`: as in `speed_widths`. Returns
    the columns `WIDTH_COLUMNS` without the medium.
    """
    conditions = measured_conditions(measured)
    rows: list[tuple[object, ...]] = []
    for name, profile in profiles.items():
        stack, bare = profile.spread, copy(profile)
        assert isinstance(stack, Profile)
        bare.spread = bare.beside = None  # the runs do not need draws, nor the profile shown beside
        draws = each_draw(stack, CHOSEN.speed_draws)
        both_widths = speed_widths(robot, bare, draws, conditions, confidence, threads, arc_percent)
        for quantity, speed_width in zip((SPEED, SPEED_MODEL), both_widths, strict=True):
            rows += [
                (name, quantity, condition.curvature_times_R, condition.frequency_Hz, *width.cells)
                for condition, width in zip(conditions, speed_width, strict=True)
            ]
        best_draws = each_draw(stack, CHOSEN.best_draws)
        best = best_width(robot, bare, best_draws, confidence, threads)
        rows.append((name, BEST, math.nan, BEST_AT_HZ, *best.cells))
    return pd.DataFrame(rows, columns=WIDTH_COLUMNS[1:])
