"""Plans of the next pushes: those that narrow the interval of a target most, for each run that they cost.

Forces are weights times alpha, so how far a push narrows them is known before it is made: the joint
covariance of target and alpha at all nodes, conditioned on one push after the other.

A map has n nodes, directions in which it estimates alpha; alpha is an array (2, n) of alpha_z and alpha_x, N/cm^3. The
first `Map.lines` nodes lie on the lines of angles that a rig pushes. Beta is the angle of the plate, gamma that of its
path; both in degrees unless rad is said.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.config import Fit
from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, angle_apart, same_direction
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.contacts import Contact
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion, rotation
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import QUANTITIES, forces_on
from rftfit.measure.slopes import GIVEN_DOF, student_quantile
from rftfit.model.draws import DRAWS, SEED_OF_MAPS
from rftfit.model.maps import Map, Nodes, map_nodes
from rftfit.model.observations import ObservedSystem
from rftfit.model.prior import root
from rftfit.model.profiles import TableProfile
from rftfit.model.pushes import LEAST_PERCENT, USUAL_PERCENT, usual_error
from rftfit.model.scaling import vertical_penetration
from rftfit.model.shapes import Shapes, published_shapes
from rftfit.store.text import table as format_table

Numbers = Callable[[FloatArray, Map], FloatArray]
"""Function of alpha (..., 2, n) at the nodes of a map and of this map that returns the t numbers of a target, (..., t).

It is also called with errors of alpha: of a linear target it returns the errors of the numbers.
"""


@dataclass(frozen=True)
class Target:
    """The t numbers that are to be known well, which follow from alpha at the nodes of a map.

    `parts`: names of the numbers. `numbers`: function that returns them for some alpha and a map. `divisor`: function
    that takes the numbers by the map's own alpha, (t,), and returns what the half width of each is divided by, (t,);
    `divisor_name` says it. `linear`: True where the numbers are linear in alpha. `of_model`: True where the numbers are
    those of the force model, whose own error no push makes smaller. `components`: how many numbers in turn are components
    of one force, whose errors add in squares.
    """

    name: str
    parts: tuple[str, ...]
    numbers: Numbers
    divisor: Callable[[FloatArray], FloatArray]
    divisor_name: str
    linear: bool = True
    of_model: bool = True
    components: int = 1


def largest_size(numbers: FloatArray) -> FloatArray:
    """Return, in the shape of `numbers`, the largest absolute value along the last axis: a divisor of `Target`.

    So a number that is near 0 weighs no more than the others.
    """
    return np.broadcast_to(np.abs(numbers).max(axis=-1, keepdims=True), numbers.shape)


@dataclass(frozen=True)
class Rig:
    """Cost and error of the pushes of a rig.

    Parameters
    ----------
    directions : tuple of (float, float), optional
        (beta, gamma) that the rig can push, degrees; default: those on the lines of the map, by default the published
        grid.
    pairs : bool, optional
        True where the plate is pulled back along its path and measured on this way, too: (beta, gamma)
        and (-beta, -gamma) come together.
    depths : int, optional
        Runs that a horizontal direction takes.
    error_percent, least_percent : float, optional
        Standard error of one push: part of its own alpha, and least part of the largest alpha.

    Examples
    --------
    >>> import rftfit
    >>> rig = rftfit.Rig(pairs=True, error_percent=5)
    """

    directions: tuple[tuple[float, float], ...] = ()
    pairs: bool = False
    depths: int = 3
    error_percent: float = USUAL_PERCENT
    least_percent: float = LEAST_PERCENT


def prior_map(shapes: Shapes | None = None, nodes: Nodes | None = None) -> Map:
    """Return the map of a medium that belongs to the known ones and was not pushed: size 1, error 100 %.

    `shapes`: what known media share; default: the published five. `nodes`: directions of the map; default: those of
    every map. Its draws of alpha are made such that their mean and covariance are exact.
    """
    shapes, nodes = shapes or published_shapes(), nodes or map_nodes()
    mean, covariance = shapes.moments(nodes.beta, nodes.gamma)
    # the first row lets the size vary by 100 %, the others the shape
    rows = np.vstack([mean, root(covariance)])
    normals = np.random.default_rng(SEED_OF_MAPS).standard_normal((DRAWS, len(rows)))
    # normal numbers with a mean of exactly 0 and a covariance of exactly 1, so that a plan does not depend on chance
    even = np.linalg.qr(normals - normals.mean(axis=0))[0] * np.sqrt(DRAWS - 1)
    draws = mean + even @ rows
    return Map(
        name="",
        beta=nodes.beta,
        gamma=nodes.gamma,
        draws=draws.reshape(DRAWS, 2, -1),
        measured=np.zeros(nodes.beta.size, dtype=bool),
        not_passive=0.0,
        size=1.0,
        distance=0.0,
        dof=0,
        pushes=0,
        known_media=shapes.name,
        lines=nodes.lines,
    )


def _alpha_on_lines(alpha: FloatArray, medium_map: Map) -> FloatArray:
    """Return the numbers of the target `map`, (..., 2 `lines`): alpha of both components at the nodes on its lines.

    Only on these a push can be planned, and alpha between them follows from theirs. `alpha`: shape (..., 2, n).
    """
    on_lines = alpha[..., : medium_map.lines]
    return on_lines.reshape(*alpha.shape[:-2], -1)


def _zeta(alpha: FloatArray, medium_map: Map) -> FloatArray:
    """Return the number of the target `zeta`, shape (..., 1), by the nine terms of `alpha` (..., 2, n).

    Zeta is alpha_z(0, 90 deg) of nine terms fitted to the map, a linear function of alpha.
    """
    return vertical_penetration(medium_map.coefficients(alpha))[..., None]


WHOLE_MAP = Target(
    "map",
    ("alpha in all directions",),
    _alpha_on_lines,
    largest_size,
    "the largest alpha",
    of_model=False,
)
"""Target of alpha in every direction."""

ZETA = Target("zeta", ("zeta",), _zeta, np.abs, "zeta", of_model=False)
"""Target of the one number that says how strong a medium is."""


def peaks(
    bodies: Sequence[Outline | Mesh],
    motion: Motion | Motion3D | None = None,
    friction: float | None = None,
) -> Target:
    """Make a target of the largest lift and the largest horizontal force on each body along a motion, N.

    `motion`: default: the rotation of the paper's trials, for outlines. `friction`: of meshes, as in `rftfit.predict`;
    with it forces are not linear in alpha.
    """
    motion = rotation() if motion is None else motion

    def numbers(alpha: FloatArray, medium_map: Map) -> FloatArray:
        """Forces by `alpha` (..., 2, n) in the poses where those by the map's own alpha are largest, (..., 2 bodies)."""
        best = _profile_at_nodes(medium_map.alpha, medium_map)
        stack = _profile_at_nodes(alpha.reshape(-1, *medium_map.alpha.shape), medium_map)
        peak_forces = [_peak_forces(body, motion, friction, stack, best) for body in bodies]
        return np.concatenate(peak_forces, axis=-1).reshape(*alpha.shape[:-2], -1)

    def largest_of_body(peak_forces: FloatArray) -> FloatArray:
        """Largest of both forces on each body, twice: for its lift and its horizontal force."""
        return largest_size(peak_forces.reshape(-1, 2)).reshape(-1)

    names = [body.name for body in bodies]
    return Target(
        name=f"peak forces on {', '.join(names)}",
        parts=tuple(f"{name}, {part}" for name in names for part in ("lift", "horizontal")),
        numbers=numbers,
        divisor=largest_of_body,
        divisor_name="the largest force on each body",
        linear=friction is None,
        components=2,
    )


def _profile_at_nodes(alpha: FloatArray, medium_map: Map) -> TableProfile:
    """Return the profile with alpha (2, n), or the stack of k profiles with alpha (k, 2, n), at the nodes of a map."""
    return TableProfile(alpha[..., 0, :], alpha[..., 1, :], medium_map.beta, medium_map.gamma)


def _peak_forces(
    body: Outline | Mesh,
    motion: Motion | Motion3D,
    friction: float | None,
    stack: TableProfile,
    best: TableProfile,
) -> FloatArray:
    """Return lift and horizontal force by each of k profiles, N, (k, 2), in the poses where those by `best` are largest.

    `stack`: the k profiles. The poses are chosen once, so that forces are linear in alpha. The horizontal force of a
    mesh is taken along its direction by `best`.
    """
    moving = set_in_motion(body, motion, friction=friction, quantities=QUANTITIES[:2])
    forces = moving.best(best).forces
    horizontal_names = [name for name in moving.force_names if name != "force_z_N"]
    horizontal = np.stack([forces[name] for name in horizontal_names])
    size = np.linalg.norm(horizontal, axis=0)
    # the pose of the lift, and that of the horizontal force
    poses = [int(np.argmax(np.abs(forces["force_z_N"]))), int(np.argmax(size))]
    along = np.eye(len(horizontal))[0]
    if size.any():
        along = horizontal[:, poses[1]] / size[poses[1]]
    at_peaks = set_in_motion(
        body, motion.at_poses(poses), friction=friction, quantities=QUANTITIES[:2]
    )
    force_of_draw = np.moveaxis(at_peaks.force_draws(stack), 1, 0)
    drawn = dict(zip(at_peaks.force_names, force_of_draw, strict=True))
    drawn_along = sum(
        share * drawn[name][:, 1] for name, share in zip(horizontal_names, along, strict=True)
    )
    return np.stack([drawn["force_z_N"][:, 0], drawn_along], axis=-1)


@dataclass(frozen=True)
class Step:
    """One more push of a plan, or one turn of a body, with the `runs` that it takes.

    `directions`: (beta, gamma) in degrees, one, or two where the way back is measured too; empty for a turn, and for
    the state before the first push. `half_width`: half width of the interval of each number of the target after this
    step, over the target's divisor, (t,). `components`: as in `Target`. `turn`: name of the body that is turned; empty
    for a push.
    """

    directions: tuple[tuple[float, float], ...]
    runs: int
    half_width: FloatArray
    components: int = 1
    turn: str = ""

    @property
    def overall(self) -> float:
        """One number for all of the target: root mean square over its bodies, directions or speeds.

        The components of a force add: their mean would halve the square of a foot pressed down, without force sideways.
        """
        return math.sqrt(self.components * float(np.mean(self.half_width**2)))


@dataclass(frozen=True)
class Plan:
    """Pushes to make next, in their order: made by `plan`.

    Parameters
    ----------
    target : str
        Name of the target, which is to be known well.
    parts : tuple of str
        Names of its numbers.
    steps : tuple of Step
        The first has no push: its half widths are those of now.
    confidence : float
    made_already : int, optional
        Pushes that were made before.
    divisor_name : str, optional
        What half widths in percent are percent of.
    of_model : bool, optional
        Whether the model's own error comes on top of these half widths, as with forces and speeds.

    Examples
    --------
    >>> import rftfit
    >>> first = rftfit.plan(rftfit.model_leg("c_leg"), count=3)
    >>> first.table()["half_width_percent"].is_monotonic_decreasing
    True
    """

    target: str
    parts: tuple[str, ...]
    steps: tuple[Step, ...]
    confidence: float
    made_already: int = 0
    divisor_name: str = "its number"
    of_model: bool = False

    def table(self) -> pd.DataFrame:
        """Return the pushes, and the half width after each, as a table.

        Returns
        -------
        pandas.DataFrame
            ``push`` (0: now), ``beta_deg, gamma_deg``, ``way_back`` (whether the plate is also measured
            on its way back), ``runs`` (of the plan so far), ``half_width_percent`` of the target's interval, `Step.overall`; where turns of bodies were offered too ``turn``, the body.
        """
        rows, runs = [], 0
        for number, step in enumerate(self.steps):
            runs += step.runs
            beta, gamma = step.directions[0] if step.directions else (np.nan, np.nan)
            back = len(step.directions) > 1
            rows.append((number, beta, gamma, back, runs, 100 * step.overall))
        names = ["push", "beta_deg", "gamma_deg", "way_back", "runs", "half_width_percent"]
        table = pd.DataFrame(rows, columns=names)
        turns = [step.turn for step in self.steps]
        return table.assign(turn=turns) if any(turns) else table

    def summary(self) -> str:
        """Format the pushes in their order, the half width after each, and how many are enough for a round one."""
        rows = []
        for push in self.table().to_dict("records"):
            # direction, way back and runs
            cells = ["now", "", ""]
            if push.get("turn"):
                cells = [f"turn of {push['turn']}", "", f"{push['runs']}"]
            elif push["push"]:
                way = "down and back" if push["way_back"] else ""
                cells = [f"({push['beta_deg']:g}, {push['gamma_deg']:.4g})", way, f"{push['runs']}"]
            rows.append([str(push["push"]), *cells, f"{push['half_width_percent']:.1f} %"])
        head = ["push", "(beta, gamma), deg", "", "new runs so far", "half width"]
        widths = [100 * step.overall for step in self.steps]
        by_alpha, remainder = "", ""
        if self.of_model:
            by_alpha = ", as far as alpha decides"
            remainder = (
                "\nThis is the interval of alpha. The model's own error and the scatter of the next bed come on top, and no push makes "
                "them smaller: the interval of the next bed, which a prediction prints, has both."
            )
        enough_for = ""
        # the narrowest of these half widths, percent, that the plan reaches
        for limit in (30, 20, 15, 10, 5):
            if widths[0] > limit and min(widths) <= limit:
                enough = next(i for i, half_width in enumerate(widths) if half_width <= limit)
                pushes = "1 more push" if enough == 1 else f"{enough} more pushes"
                runs = sum(step.runs for step in self.steps[: enough + 1])
                in_runs = f" in {runs} runs" if runs > enough else ""
                are = "is" if enough == 1 else "are"
                enough_for = f"\n{pushes}{in_runs} {are} enough for {self.target} within {limit} %{by_alpha}."
        before = f"{self.made_already} made already" if self.made_already else "none made yet"
        now = self.steps[0]
        over = "; ".join(self.parts)
        together = ""
        if now.components > 1:
            together = ", lift and horizontal force together (their squares add)"
            over = "the bodies"
        mean = f", root mean square over {over}" if now.half_width.size > now.components else ""
        return (
            f"Pushes for {self.target}, {before}\n\n{format_table(head, rows)}\n\n"
            f"Half width of the {100 * self.confidence:g} % interval, percent of {self.divisor_name}{together}{mean}."
            f"{enough_for}{remainder}"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return target and pushes as plain numbers, words and lists, as ``rftfit plan --json`` prints them.

        A row without a direction has NaN for angles.
        """
        return {
            "target": self.target,
            "parts": list(self.parts),
            "confidence": self.confidence,
            "pushes": self.table().to_dict("records"),
        }


def push_rows(step: Step, depths_cm: Sequence[float]) -> list[dict[str, str]]:
    """Return the cells of the run sheet for the runs of a push, one dict a run.

    Keys: ``direction``, ``beta_deg``, ``gamma_deg`` and ``depth_cm``, which only a horizontal run has: of `depths_cm`
    the first ones, or empty where they are too few. A run with gamma below 0 is filed as an extraction.
    """
    beta, gamma = step.directions[0]
    ways = [("intrusion", "")] if gamma > 0 else [("extraction", "")]
    if gamma == 0:
        ways = [("horizontal", f"{depth:g}") for depth in depths_cm[: step.runs]]
        ways += [("horizontal", "")] * (step.runs - len(ways))
    elif len(step.directions) > 1:
        ways = [("intrusion", ""), ("extraction", "")]
    angles = {"beta_deg": f"{beta:g}", "gamma_deg": f"{gamma:.6g}"}
    return [{"direction": way, **angles, "depth_cm": depth} for way, depth in ways]


_EXACT = 1e-10
"""Least variance of a push, over the largest variance of alpha in the map."""

_NONE = 1e-30
"""A positive number that stands for 0, where one is divided by."""


class _Candidate(NamedTuple):
    """A measurement that may come next: a push, with its way back where that is measured too, or one turn of a body.

    `observe`: function of the covariance of alpha at the nodes and of the target, (2 n + t, 2 n + t), that returns the
    covariance of these with the k numbers that are measured, (2 n + t, k), and that of the measured numbers, (k, k),
    with the errors of their readings. `runs`: that it takes. `directions`: of a push, (beta, gamma), degrees; empty for
    a turn. `turn`: name of the body; empty for a push.
    """

    observe: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    runs: int
    directions: tuple[tuple[float, float], ...] = ()
    turn: str = ""


def plan(
    target: Target | Outline | Mesh | Sequence[Outline | Mesh] | str = "map",
    current_map: Map | None = None,
    rig: Rig | None = None,
    count: int = 8,
    confidence: float = 0.95,
    turns: Sequence[tuple[Outline, Motion]] = (),
    motion: Motion | Motion3D | None = None,
) -> Plan:
    """Choose pushes one after the other, each the one that narrows the target most for its runs.

    Parameters
    ----------
    target : str, Outline, Mesh or sequence of these, optional
        ``map`` (default): alpha in every direction; ``zeta``; or bodies, whose peak forces along a motion are to be
        known.
    current_map : Map, optional
        Map of what was measured (`estimate_map`); default: nothing was measured yet.
    rig : Rig, optional
        Cost and error of pushes. Its directions are nodes of `current_map`; without a map they may have any angle.
    count : int, optional
        Pushes to plan.
    confidence : float, optional
    turns : sequence of (Outline, Motion), optional
        Bodies whose forces can be measured along a motion, each once and for one run. They are compared with the
        pushes, with the model's own error on a body that was never measured.
    motion : Motion or Motion3D, optional
        Of the bodies; default: the paper's rotation. A mesh needs a `Motion3D`.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        If there is no target of this name.
    ValueError
        If a direction is no node of the map.

    Examples
    --------
    >>> import rftfit
    >>> len(rftfit.plan("zeta", count=2).steps)
    3
    """
    rig, target = rig or Rig(), _find_target(target, motion)
    # without directions the lines are those of every map
    current_map = current_map or prior_map(nodes=map_nodes(*zip(*rig.directions, strict=True)))
    alpha = current_map.alpha
    divisor = target.divisor(np.atleast_1d(target.numbers(alpha, current_map)))
    errors, target_errors = _errors_of_target(target, current_map)
    joint = np.hstack([errors.reshape(len(errors), -1), target_errors / divisor])
    # of alpha at all nodes, in the first `size` rows, and of the target behind them
    covariance, size = joint.T @ joint, alpha.size
    if not np.isfinite(covariance).all():
        raise ValueError(f"{target.name} has no number in this medium")
    quantile = float(student_quantile(confidence, GIVEN_DOF))
    noise = usual_error(alpha.ravel(), rig.error_percent, rig.least_percent) ** 2
    # a push without an error that is repeated would make a matrix without an inverse
    noise = np.maximum(noise, _EXACT * max(float(np.diag(covariance)[:size].max()), _NONE))
    # a body that is named twice is offered once
    turns_by_body = {body.name: _make_turn(current_map, body, motion) for body, motion in turns}
    candidates = [*_list_pushes(current_map, rig, noise), *turns_by_body.values()]
    steps = [Step((), 0, quantile * np.sqrt(np.diag(covariance)[size:]), target.components)]
    for _ in range(count):
        variance = np.diag(covariance)[size:].sum()
        gains = []
        for candidate in candidates:
            across, measured = candidate.observe(covariance)
            gains.append(_log_gain(across[size:], measured, variance) / candidate.runs)
        # rounded, so that of equal candidates the first is chosen on any computer
        best = int(np.argmax(np.round(gains, 9)))
        _, runs, directions, turn = candidates[best]
        # the covariance of everything, conditioned on what the best candidate measures
        across, measured = candidates[best].observe(covariance)
        covariance = covariance - across @ np.linalg.solve(measured, across.T)
        if turn:
            candidates.pop(best)
        variance_left = np.maximum(np.diag(covariance)[size:], 0.0)
        half_width = quantile * np.sqrt(variance_left)
        steps.append(Step(directions, runs, half_width, target.components, turn))
    return Plan(
        target.name,
        target.parts,
        tuple(steps),
        confidence,
        current_map.pushes,
        target.divisor_name,
        target.of_model,
    )


def _errors_of_target(target: Target, medium_map: Map) -> tuple[FloatArray, FloatArray]:
    """Return errors of alpha, (k, 2, n), and the errors of the target by them, (k, t).

    The products of the errors of alpha add up to its covariance. Where the target is not linear in alpha, they are
    along the largest axes of the error of alpha, and those of the target half its change when alpha moves either way.
    """
    errors = medium_map.factor
    if target.linear:
        return errors, target.numbers(errors, medium_map)
    errors = _largest_axes(errors)
    above, below = (
        target.numbers(medium_map.alpha + sign * errors, medium_map) for sign in (1, -1)
    )
    return errors, (above - below) / 2


def _log_gain(across: FloatArray, measured: FloatArray, variance: float) -> float:
    """Return the logarithm of the factor by which a measurement of k numbers narrows the variance of the target.

    `across`: covariance of the target's t numbers with them, (t, k). `measured`: their covariance, (k, k). `variance`:
    of the target before, summed over its numbers.
    """
    less = float(np.sum(across * np.linalg.solve(measured, across.T).T))
    return -math.log(max(1 - less / max(variance, _NONE), 1e-12))


def _make_turn(medium_map: Map, body: Outline, motion: Motion) -> _Candidate:
    """Make the candidate of one turn of a body along a motion, for one run.

    The forces that will be measured are taken to be those by the map. Hundreds of them are combined to k numbers,
    weighted sums of alpha, that say as much of alpha.
    """
    best = medium_map.alpha
    nodes = medium_map.beta, medium_map.gamma
    profile = TableProfile(best[0], best[1], *nodes)
    net = forces_on(profile, body, motion.poses)
    forces = {"force_z_N": net.force_z_N, "force_x_N": net.force_x_N}
    largest = max(float(np.abs(force).max()) for force in forces.values())
    contact = Contact(body, motion, forces, max(USUAL_PERCENT / 100 * largest, _NONE))
    alpha_errors = _largest_axes(medium_map.factor).reshape(-1, best.size)
    rows = ObservedSystem.of([contact], nodes, best.ravel(), alpha_errors).rows(1.0)

    def observe(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Read off the covariance of sums of alpha: the first rows and columns are alpha."""
        across = covariance[:, : best.size] @ rows.weights.T
        return across, rows.weights @ across[: best.size] + np.diag(rows.errors**2)

    return _Candidate(observe, 1, turn=body.name)


_PARTS = 16
"""Number of principal axes of the error of alpha along which a target that is not linear is tried."""


def _largest_axes(factor: FloatArray) -> FloatArray:
    """Return the `_PARTS` largest principal axes of a covariance of alpha, (`_PARTS`, 2, n).

    `factor`: errors, (k, 2, n), whose products add up to it; hundreds of them, for each of which a target that is not
    linear would have to be calculated.
    """
    flat = factor.reshape(len(factor), -1)
    _, sizes, axes = np.linalg.svd(flat, full_matrices=False)
    largest: FloatArray = sizes[:_PARTS, None] * axes[:_PARTS]
    return largest.reshape(-1, *factor.shape[1:])


def _find_target(
    target: Target | Outline | Mesh | Sequence[Outline | Mesh] | str,
    motion: Motion | Motion3D | None,
) -> Target:
    """Return the target of a name, the peak forces on bodies along `motion`, or the target that is given.

    Raises InputError where there is no target of this name.
    """
    if isinstance(target, Target):
        return target
    if isinstance(target, str):
        targets_by_name = {known_target.name: known_target for known_target in (WHOLE_MAP, ZETA)}
        return targets_by_name[choose("target", target, tuple(targets_by_name))]
    return peaks([target] if isinstance(target, Outline | Mesh) else target, motion)


def _list_pushes(medium_map: Map, rig: Rig, noise: FloatArray) -> list[_Candidate]:
    """List the pushes that the rig can make; raises ValueError where a direction is no node of the map.

    `noise`: variance of alpha of a push in each node, alpha_z of all nodes, then alpha_x, (2 n,).
    """
    count = medium_map.beta.size
    nodes_deg = np.column_stack([np.degrees(medium_map.beta), np.degrees(medium_map.gamma)])
    directions = rig.directions or tuple(
        (float(b), float(g)) for b, g in nodes_deg[: medium_map.lines]
    )
    pushes = []
    for beta, gamma in directions:
        ways = [(beta, gamma)]
        # a pair is listed once, by its way down
        if rig.pairs and gamma < 0:
            continue
        if rig.pairs and gamma > 0:
            ways.append((-beta, -gamma))
        beta_deg, gamma_deg = np.transpose(ways)
        nearest = angle_apart(beta_deg[:, None], gamma_deg[:, None], *nodes_deg.T).argmin(axis=1)
        node_beta_deg, node_gamma_deg = nodes_deg[nearest].T
        is_node = same_direction(beta_deg, gamma_deg, node_beta_deg, node_gamma_deg, TOLERANCE_DEG)
        if not is_node.all():
            lost = tuple(round(float(angle), 3) + 0.0 for angle in ways[int(is_node.argmin())])
            raise ValueError(
                f"(beta, gamma) = {lost} degrees is no node of the map; it is one of "
                f"estimate_map(..., beta_deg=[{lost[0]:g}], gamma_deg=[{lost[1]:g}])"
            )
        runs = len(ways) * (rig.depths if gamma == 0 else 1)
        # alpha_z of all nodes comes first, then alpha_x
        nodes = np.stack([nearest, nearest + count], axis=1).ravel().tolist()
        pushes.append(_Candidate(partial(_observe_nodes, nodes, noise), runs, tuple(ways)))
    return pushes


def _observe_nodes(
    nodes: list[int], noise: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return what `_Candidate.observe` returns, for pushes that measure alpha itself at some nodes, by their indices.

    `noise`: variance of a measured alpha at each node, (2 n,). `covariance`: of alpha at the nodes and of the target.
    """
    measured = covariance[np.ix_(nodes, nodes)] + np.diag(noise[nodes])
    return covariance[:, nodes], measured


def reachable(
    medium_map: Map, beta_deg: Sequence[float], gamma_deg: Sequence[float]
) -> tuple[tuple[float, float], ...]:
    """Return the directions on the lines of a map, (beta, gamma) in degrees, with these angles; an empty list allows any.

    `beta_deg`, `gamma_deg`: angles that a rig can hold: `Rig.directions` follow from them.
    """
    angles = np.degrees([medium_map.beta, medium_map.gamma])[:, : medium_map.lines].round(4)
    near = np.ones(angles.shape[1], dtype=bool)
    for angles_of_map, allowed in zip(angles, (beta_deg, gamma_deg), strict=True):
        if len(allowed):
            apart_deg = np.abs(angles_of_map[:, None] - np.asarray(allowed))
            near &= apart_deg.min(axis=1) < TOLERANCE_DEG
    return tuple((beta, gamma) for beta, gamma in angles[:, near].T.tolist())


SHEET_COLUMNS = (
    "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,depth_cm,force_log,motion_log"
)
"""First line of the rows for a run sheet, by which a file of them is known."""

_DEPTHS_CM = Fit().horizontal_depths_cm
"""Depths of horizontal runs by default, cm."""


def run_sheet_rows(plan: Plan) -> str:
    """Format a plan as rows of a run sheet, as csv with `SHEET_COLUMNS`; medium, intruder and logs are left to be filled in."""
    lines = [SHEET_COLUMNS]
    for number, step in enumerate(plan.steps[1:], start=1):
        if step.turn:
            lines.append(f"plan{number:02d},leg,,{step.turn},,,,,,")
            continue
        rows = push_rows(step, _DEPTHS_CM)
        for piece, row in enumerate(rows, start=1):
            name = f"plan{number:02d}" + (f"_{piece}" if len(rows) > 1 else "")
            lines.append(f"{name},plate,,,{','.join(row.values())},,")
    return "\n".join(lines) + "\n"
