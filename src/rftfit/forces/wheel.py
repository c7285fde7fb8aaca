"""A rolling wheel at a given load or sinkage: drawbar, torque, sinkage and their intervals, from one function.

A wheel rolls toward +x about an axle along y. Slip: 1 less travel over rim speed where it drives, 0 to 1; negative
where it brakes. Drawbar is the force of the medium toward +x (N), load that upward (N), torque that of the drive (N
cm), all means over one turn; sinkage is the depth of the lowest point of the rim (cm). The rim is the radius to which
slip and sinkage belong, between lugs or over them. Slip sinkage: a wheel that slips digs, as if alpha were larger or
smaller by a factor, whose range was found on measured rigs (wheels.toml of the room reference).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.problems import CampaignError, Place, Problem, choose
from rftfit.campaign.rows import Schema, TableColumn, read_rows
from rftfit.conventions import FloatArray
from rftfit.errors import LimitWarning
from rftfit.forces.faces import as_table
from rftfit.forces.fineness import fine_enough
from rftfit.forces.limits import depth_measured, describe_depth
from rftfit.forces.mesh import Mesh, Motion3D, describe_triangles
from rftfit.forces.model_error import check_model_error, has_model_error, is_tested
from rftfit.forces.rolling import RULES, Rim, describe_friction, find_rim, measure_radius
from rftfit.forces.space import MeshInMotion, compiled_mesh_forces, mesh_draws
from rftfit.measure.errors import half_width_of_bed
from rftfit.model.draws import (
    SEED_OF_SLIP_SINKAGE,
    choose_evenly,
    end_names,
    interval,
    model_end_names,
    widen,
)
from rftfit.model.known import profile_of
from rftfit.model.profiles import KnownMedium, Profile, TableProfile
from rftfit.store.chosen import chosen, read_toml
from rftfit.store.text import table as format_table

_CHOSEN = chosen("forces", "wheel")

QUANTITIES = ("load_N", "sinkage_cm", "drawbar_N", "torque_N_cm")
"""Columns of an answer that may have intervals."""

_FACTS = (
    "mesh",
    "medium",
    "given",
    "rule",
    "friction",
    "triangles",
    "triangles_given",
    "rim_cm",
    "rim_from",
    "confidence",
    "model_error",
    "torque_error",
    "slip_sinkage",
)
"""Attributes of an answer that `WheelAnswer.facts` contains, beside the notes."""


def wheel_numbers() -> Mapping[str, Any]:
    """Read the model's errors on wheels, and the range of slip sinkage, found on measured rigs (``wheels.toml``).

    ``rig``: a list of rigs, each with ``laboratory``, ``shape`` (smooth or lugged), ``runs``, ``radius_cm``, ``load_N``
    and the errors of ``drawbar`` and ``torque`` below ``plain`` and ``friction``. ``slip_sinkage``: ``least`` and
    ``most``.
    """
    return read_toml("reference", "wheels.toml")


def _average_turn(forces: FloatArray) -> FloatArray:
    """Return drawbar (N), load (N) and torque of the drive (N cm), the means over a turn, shape (3, ...).

    `forces`: from `compiled_mesh_forces` in the p poses of the turn, shape (..., p, 19); columns 0 and 2 are force x
    and z, column 4 is the moment about y.
    """
    mean = forces.mean(axis=-2)
    # the medium turns the wheel back: the drive gives the opposite moment
    return np.stack([mean[..., 0], mean[..., 2], -mean[..., 4]])


@dataclass(frozen=True, eq=False)
class WheelAnswer:
    """A rolling wheel at some slips: made by `wheel`.

    Parameters
    ----------
    table : pandas.DataFrame
        One row a slip: ``slip``, ``load_N``, ``sinkage_cm``, ``drawbar_N`` (toward +x), ``torque_N_cm`` (of the drive), and
        after each its intervals: ``drawbar_lo_N, drawbar_hi_N`` of alpha, ``drawbar_model_lo_N, drawbar_model_hi_N`` with
        the model's own error on wheels; ``alpha_N_per_cm3``, alpha_z(0, 90 deg) of the medium, and
        ``alpha_of_load_N_per_cm3``, that which carries the load at the sinkage; ``reason``, why there is no number.
    rule : str
        ``own-track`` where faces in the wheel's own track do not count, else ``none``.
    friction : float or None
        Friction as given; None: off.
    given : str
        Numbers that were given beside the slip: ``sinkage``, ``load`` or ``sinkage and load``.
    mesh, medium : str
        Names of mesh and medium.
    rim_cm : float
        Radius to which slip and sinkage belong.
    confidence : float
        Level of the intervals.
    model_error : float
        Root mean square error of the drawbar over the load, on measured rigs; NaN where none is known.
    torque_error : float
        Root mean square error of the torque over load times radius, on measured rigs; NaN where none is known.
    slip_sinkage : tuple of float or None
        Least and greatest factor of alpha by slip sinkage, where the sinkage is solved.
    notes : tuple of str
        Sentences on the medium, the load and the limits of the prediction.
    has_alpha_error : bool
        True where an error of alpha is known of the medium; the intervals then contain it.
    rim_from : str
        ``given`` or ``farthest-point``: where the radius of the rim was taken from.
    triangles, triangles_given : int
        Number of triangles on which forces were predicted, and number in the mesh as it was given: a coarse mesh is
        refined.

    Examples
    --------
    >>> import rftfit
    >>> smooth = rftfit.Mesh.cylinder(radius_cm=6.25, width_cm=6, facets=24)
    >>> answer = rftfit.wheel(rftfit.published_medium("poppy_LP"), smooth, 0.2, sinkage_cm=2)
    >>> [row["slip"] for row in answer.as_dict()["rows"]]
    [0.2]
    """

    table: pd.DataFrame = field(repr=False)
    rule: str
    friction: float | None
    given: str
    mesh: str
    medium: str
    rim_cm: float
    confidence: float
    model_error: float
    torque_error: float
    slip_sinkage: tuple[float, float] | None
    notes: tuple[str, ...]
    has_alpha_error: bool = True
    rim_from: str = "given"
    triangles: int = 0
    triangles_given: int = 0

    @property
    def interval_of(self) -> str:
        """Name the errors in the intervals without the model's own error.

        Returns
        -------
        str
        """
        # times False leaves a name out
        held = ["alpha"] * self.has_alpha_error
        held += ["slip sinkage"] * (self.slip_sinkage is not None)
        return " and ".join(held)

    @property
    def facts(self) -> dict[str, Any]:
        """Everything but the table, by name.

        Returns
        -------
        dict of str to object
        """
        return {name: getattr(self, name) for name in _FACTS} | {"notes": list(self.notes)}

    @property
    def lines(self) -> list[str]:
        """Lines on mesh, medium, options and the meaning of the intervals.

        Returns
        -------
        list of str
        """
        percent = f"{100 * self.confidence:g} % interval"
        of_alpha = f"lo, hi: {percent} of {self.interval_of}, of the mean over beds"
        if self.slip_sinkage is not None:
            low, high = self.slip_sinkage
            of_alpha += f" (alpha {low:g} to {high:g} of itself)"
        lines = [
            f"Mesh: {self.mesh}, {describe_triangles(self.triangles, self.triangles_given)}",
            f"Rim: {Rim(self.rim_cm, self.rim_from).describe()}",
            f"Medium: {self.medium}",
            f"Given: slip and {self.given}",
            f"Rule: {self.rule}: {RULES[self.rule]}",
            f"Friction: {describe_friction(self.friction)}",
        ]
        if "drawbar_lo_N" in self.table:
            lines.append(of_alpha)
        if "drawbar_model_lo_N" in self.table:
            lines.append(
                f"model lo, hi: {percent} with the model's own error on wheels, of the mean over beds (drawbar {self.model_error:g} of the load, "
                f"torque {self.torque_error:g} of load times radius, from measured rigs)"
            )
        return lines

    def summary(self) -> str:
        """Format the answer for people.

        Returns
        -------
        str
        """
        head, columns = ["slip"], [[f"{slip:g}" for slip in self.table["slip"]]]
        for column in QUANTITIES:
            quantity, _, unit = column.partition("_")
            head.append(f"{quantity}, {unit.replace('_', ' ')}")
            columns.append([_format_number(number) for number in self.table[column]])
            for kind, heading in (("", "lo to hi"), ("model_", "model lo to hi")):
                ends = list(end_names(column, kind))
                if ends[0] in self.table:
                    head.append(heading)
                    pairs = self.table[ends].to_numpy()
                    deepest = _CHOSEN.axle * self.rim_cm if column == "sinkage_cm" else math.inf
                    columns.append([_format_interval(low, high, deepest) for low, high in pairs])
        rows = [*zip(*columns, strict=True)]
        return "\n".join([*self.lines, "", format_table(head, rows), "", *self.notes]).rstrip()

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, words and lists, as ``rftfit wheel --json`` prints it.

        Returns
        -------
        dict of str to object
            `facts`, and ``rows``: a dict for each row of the table.
        """
        return self.facts | {"rows": self.table.to_dict("records")}


def wheel(
    medium: KnownMedium | str | Path,
    mesh: Mesh,
    slip: npt.ArrayLike,
    *,
    sinkage_cm: npt.ArrayLike | None = None,
    load_N: npt.ArrayLike | None = None,
    friction: float | None = None,
    track: bool = True,
    rim_cm: float | None = None,
    confidence: float = 0.95,
    model_error: float | None = None,
    left_out: str | None = None,
) -> WheelAnswer:
    """Predict drawbar, torque and sinkage of a wheel that rolls straight ahead under a load, or at a sinkage.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        Medium, as `predict` takes it.
    mesh : Mesh
        The axle lies along y through (0, 0, 0).
    slip : float or array_like, shape (s,)
        Slip as `Motion3D.roll` defines it; each has a row in the answer.
    sinkage_cm : float or array_like, shape (s,), optional
        Depth of the lowest point of the rim. Without it the sinkage is solved from the load.
    load_N : float or array_like, shape (s,), optional
        Load that the wheel carries. With a sinkage: the medium is taken as strong as it must be to carry the load
        there. Without a load it is predicted.
    friction : float, optional
        Friction as in `predict`; default: off. 0.4 was tried on measured rigs.
    track : bool, optional
        True where a wheel that is not convex leaves a rut, see `Motion3D.roll`.
    rim_cm : float, optional
        Radius to which sinkage and slip belong. Default: to the farthest point of the mesh, over the lugs.
    confidence : float, optional
        Level of the intervals.
    model_error : float, optional
        Error of the model on wheels: of the drawbar over the load and of the torque over load times radius. Default: as on
        measured rigs, for smooth and for lugged wheels, with and without friction. 0: none.
    left_out : str, optional
        Laboratory whose rigs are left out of that default: for a wheel that is one of these rigs.

    Returns
    -------
    WheelAnswer

    Raises
    ------
    ValueError
        If neither sinkage nor load is given, a number is impossible, or the mesh is no wheel about y.

    Warns
    -----
    LimitWarning
        Where the wheel, its load or its depth leaves what was measured; the `notes` contain these sentences, too.

    Examples
    --------
    >>> import rftfit
    >>> smooth = rftfit.Mesh.cylinder(radius_cm=6.25, width_cm=6, facets=48)
    >>> answer = rftfit.wheel(rftfit.scale(0.85), smooth, [0.1, 0.3], load_N=20)
    >>> answer.rule
    'none'
    """
    cases = _check_numbers(slip, sinkage_cm, load_N, friction, confidence)
    if left_out is not None:
        if model_error is not None:
            raise ValueError("found left_out beside model_error; allowed: one of them")
        choose("left_out", left_out, laboratories())
    check_model_error(model_error)
    roll = partial(Motion3D.roll, mesh, track=track, rim_cm=rim_cm)
    radius = measure_radius(mesh.vertices_cm)
    rim = find_rim(mesh.vertices_cm, rim_cm, mesh.lowest_radius_cm)
    # a fault of the mesh, its rim or its slips is raised here, before any work
    motions = [
        roll(
            rim.radius_cm / 2 if case.sinkage_cm is None else case.sinkage_cm,
            case.slip,
            _CHOSEN.poses,
        )
        for case in cases
    ]
    mesh = fine_enough(mesh, motions[0])
    profile = profile_of(medium, partial(has_number, mesh=mesh, friction=friction))
    rolling = _Wheel(profile, mesh, roll, friction, rim.radius_cm)
    errors = _model_errors(profile, mesh, friction, model_error, left_out)
    rows = []
    for case in cases:
        if case.sinkage_cm is None:
            solved = _solve_sinkage(rolling, case)
        else:
            solved = _predict_at_sinkage(rolling, case, case.sinkage_cm)
        rows.append(_make_row(solved, case.slip, rolling, confidence, errors, radius))
    is_given = {"sinkage": sinkage_cm is not None, "load": load_N is not None}
    given = " and ".join(name for name, is_present in is_given.items() if is_present)
    answer_table = pd.DataFrame(rows)
    limits = _list_limits(answer_table, profile, mesh, errors, rim, radius)
    for limit in limits:
        warnings.warn(limit, LimitWarning, stacklevel=2)
    sentences = [f"{limit[0].upper()}{limit[1:]}." for limit in limits]
    return WheelAnswer(
        answer_table[[name for name in answer_table if name != "reason"] + ["reason"]],
        motions[0].rule,
        friction,
        given,
        mesh.name,
        profile.name,
        rim.radius_cm,
        confidence,
        *errors,
        _slip_range() if sinkage_cm is None else None,
        (*_list_notes(answer_table, given, profile, errors, rim), *sentences),
        isinstance(profile.spread, Profile),
        rim.taken_from,
        len(mesh.faces),
        mesh.triangles_given,
    )


class _Case(NamedTuple):
    """Slip of a row of the answer, and the sinkage and load that are given with it.

    Without a sinkage it is solved from the load; without a load it is predicted; with both the medium is scaled.
    """

    slip: float
    sinkage_cm: float | None
    load_N: float | None


def _check_numbers(
    slip: npt.ArrayLike,
    sinkage_cm: npt.ArrayLike | None,
    load_N: npt.ArrayLike | None,
    friction: float | None,
    confidence: float,
) -> list[_Case]:
    """Return the case of each row of the answer; raises ValueError where a number is impossible. Arguments of `wheel`."""
    if sinkage_cm is None and load_N is None:
        raise ValueError("found neither sinkage nor load; allowed: one of them or both")
    slips = np.atleast_1d(np.asarray(slip, dtype=float))
    if slips.ndim != 1 or not slips.size:
        raise ValueError(f"slip: a number or a list of numbers wanted, found shape {slips.shape}")
    if friction is not None and not 0 <= friction < np.inf:
        raise ValueError(f"friction: 0 or a positive number wanted, found {friction:g}")
    if not 0.5 < confidence < 1:
        raise ValueError(f"confidence: above 0.5 and below 1 wanted, found {confidence:g}")
    sinkages = _one_a_slip("sinkage_cm", sinkage_cm, slips)
    loads = _one_a_slip("load_N", load_N, slips)
    return [_Case(*numbers) for numbers in zip(slips.tolist(), sinkages, loads, strict=True)]


def _one_a_slip(name: str, numbers: npt.ArrayLike | None, slips: FloatArray) -> list[Any]:
    """Return a positive number for each of the slips (s,): the one given for all, or one given for each; else None for each.

    `name`: of the argument, for messages.
    """
    if numbers is None:
        return [None] * slips.size
    of_slips = np.asarray(numbers, dtype=float)
    if of_slips.shape not in ((), slips.shape):
        raise ValueError(
            f"{name}: one number, or one for each of {slips.size} slips wanted, found shape {of_slips.shape}"
        )
    if not (np.isfinite(of_slips) & (of_slips > 0)).all():
        raise ValueError(f"{name}: positive numbers wanted, found {of_slips.tolist()}")
    return list(np.broadcast_to(of_slips, slips.shape).tolist())


def has_number(table: Profile, mesh: Mesh, friction: float | None) -> bool:
    """Tell whether a table has a number in every direction of a wheel that is sunk to its axle, at any slip.

    While the sinkage is solved a wheel may get there; else the map of the medium is taken instead of the table.
    """
    radius = measure_radius(mesh.vertices_cm)
    motions = [
        Motion3D.roll(mesh, radius, slip, _CHOSEN.poses, track=False)
        for slip in _CHOSEN.tried_slips
    ]
    return all(
        MeshInMotion(mesh, motion, friction=friction).is_covered_by(table) for motion in motions
    )


class _Wheel:
    """A wheel in a medium: means over a turn (`_average_turn`) at a slip and a sinkage, by the medium and by its draws.

    `roll`: function of sinkage (cm), slip and number of poses that makes the motion of a turn. `friction`: None: off.
    `rim_cm`: radius. `draws`: some draws of alpha as a stack, or None where its errors are not known. `alpha`:
    alpha_z(0, 90 deg), N/cm^3.
    """

    def __init__(
        self, profile: Profile, mesh: Mesh, roll: Any, friction: float | None, rim_cm: float
    ) -> None:
        self.profile, self.mesh, self.roll = profile, mesh, roll
        self.friction, self.rim_cm = friction, rim_cm
        self.draws = _some_draws(profile)
        self.alpha = float(profile.alpha(0.0, np.pi / 2)[0])

    def turn(self, slip: float, sinkage_cm: float) -> FloatArray:
        """Return drawbar, load and torque at a slip and a sinkage by the medium itself, shape (3,)."""
        return _average_turn(self._forces(self.roll(sinkage_cm, slip, _CHOSEN.poses)))

    def turns_of_draws(self, slip: float, sinkages_cm: Sequence[float]) -> FloatArray:
        """Return drawbar, load and torque by each draw at each sinkage, shape (3, draws, sinkages).

        A medium without draws counts as one draw. The difference of a draw from the medium itself is calculated in a
        few poses, and added to the mean over all poses: hundreds of draws in all poses would take minutes.
        """
        turns = [self.turn(slip, sinkage) for sinkage in sinkages_cm]
        in_all_poses = np.stack(turns, axis=-1)[:, None]
        if self.draws is None:
            return in_all_poses
        motion = _join(
            [self.roll(sinkage, slip, _CHOSEN.poses_of_draws) for sinkage in sinkages_cm]
        )
        shape = (len(sinkages_cm), _CHOSEN.poses_of_draws)
        in_few_poses = _average_turn(self._forces(motion).reshape(*shape, -1))[:, None]
        forces = mesh_draws(self.draws, self.mesh, motion, "measured", self.friction)
        of_draws = _average_turn(forces.reshape(len(forces), *shape, -1))
        return of_draws + (in_all_poses - in_few_poses)

    def _forces(self, motion: Motion3D) -> FloatArray:
        """Return the sums over the faces by the medium itself, shape (p, 19), as `compiled_mesh_forces` has them."""
        return compiled_mesh_forces(self.profile, self.mesh, motion, "measured", self.friction)


def _join(motions: Sequence[Motion3D]) -> Motion3D:
    """Return one motion with the poses of all, one after another, so that one pass through the draws serves all motions."""
    joined = copy(motions[0])
    joined.frames = np.concatenate([motion.frames for motion in motions])
    joined.rolling = np.concatenate([motion.rolling for motion in motions])
    return joined


def _some_draws(profile: Profile) -> TableProfile | None:
    """Return a stack of at most `draws` (chosen.toml) of a profile's draws, evenly chosen; None where it has none.

    A profile by nine terms is read into a table first, as the law in space needs it.
    """
    if not isinstance(profile.spread, Profile):
        return None
    stack = as_table(profile.spread)
    chosen_draws = choose_evenly(len(stack.alpha_z), _CHOSEN.draws)
    alpha = stack.alpha_z[chosen_draws], stack.alpha_x[chosen_draws]
    return TableProfile.of_nodes(stack.beta, stack.gamma, alpha)


class _Solved(NamedTuple):
    """Numbers at one slip, from which a row of the answer is made.

    `best`: by the medium itself, for each of `QUANTITIES`. `draws`: by its draws, shape (draws,), for those that were
    not given. `factor`: factor of alpha with which the medium carries the given load at the given sinkage; 1 where not
    both are given, NaN where no factor does. `reason`: why a number is missing, else empty.
    """

    best: dict[str, float]
    draws: dict[str, FloatArray]
    factor: float
    reason: str


def _name_columns(turn: FloatArray, sinkage_cm: float) -> dict[str, Any]:
    """Return the means over a turn, drawbar, load, torque, shape (3, ...), and the sinkage by their columns, `QUANTITIES`."""
    drawbar, load, torque = turn
    numbers = load, np.asarray(sinkage_cm), drawbar, torque
    return dict(zip(QUANTITIES, numbers, strict=True))


def _predict_at_sinkage(rolling: _Wheel, case: _Case, sinkage_cm: float) -> _Solved:
    """Predict the forces at a given sinkage; with a load, in a medium as strong as it must be to carry the load there.

    `case`: slip, and load or None. `sinkage_cm`: that of the case, which is given.
    """
    turn = rolling.turn(case.slip, sinkage_cm)
    load_N, factor = case.load_N, 1.0
    if load_N is not None:
        _, load_there, _ = turn
        if not load_there > 0:
            return _not_carried(load_N, sinkage_cm, f"at {sinkage_cm:g} cm the wheel is not lifted")
        # forces grow with alpha
        factor = float(load_N / load_there)
        turn = factor * turn
    best = {name: float(number) for name, number in _name_columns(turn, sinkage_cm).items()}
    draws: dict[str, FloatArray] = {}
    if rolling.draws is not None:
        of_draws = rolling.turns_of_draws(case.slip, [sinkage_cm])[..., 0]
        # what is given has no draws; with both given each draw is scaled to the load
        given = ["sinkage_cm"]
        if load_N is not None:
            _, loads, _ = of_draws
            of_draws = of_draws[:, loads > 0] * (load_N / loads[loads > 0])
            given.append("load_N")
        draws = _name_columns(of_draws, sinkage_cm)
        draws = {name: numbers for name, numbers in draws.items() if name not in given}
    reason = "" if np.isfinite(list(best.values())).all() else rolling.profile.reason
    return _Solved(best, draws, factor, reason)


def _not_carried(load_N: float, sinkage_cm: float, reason: str) -> _Solved:
    """Return the numbers of a slip at which the wheel does not carry its load: drawbar and torque are NaN, with a reason.

    `load_N`: as given. `sinkage_cm`: as given, or NaN where none carries the load.
    """
    best = {"load_N": load_N, "sinkage_cm": sinkage_cm}
    best |= dict.fromkeys(("drawbar_N", "torque_N_cm"), np.nan)
    return _Solved(best, {}, np.nan, reason)


def _solve_sinkage(rolling: _Wheel, case: _Case) -> _Solved:
    """Find the sinkage at which the wheel carries its load, with the spread of the medium and of slip sinkage.

    `case`: a slip and a load, without a sinkage. The load grows with depth, so that the sinkage is bisected, between
    nearly 0 and the axle. For the draws the forces are calculated at a few sinkages around it, and interpolated by
    `_carry_load`.
    """
    slip, load_N = case.slip, case.load_N
    assert load_N is not None
    shallowest, deepest = float(_CHOSEN.shallowest) * rolling.rim_cm, rolling.rim_cm

    def load_at(depth_cm: float) -> float:
        """Return the load that the wheel carries at a sinkage, N, by the medium itself."""
        return float(rolling.turn(slip, depth_cm)[1])

    def depth_that_carries(factor: float, error: float) -> float:
        """Find the depth by bisection, at most to the axle, in a medium `factor` times as strong.

        Slip sinkage is such a factor. `error`: greatest error of the depth, over the radius of the rim.
        """
        low, high = shallowest, deepest
        if not factor * load_at(deepest) > load_N:
            return deepest
        while high - low > error * rolling.rim_cm:
            middle = (low + high) / 2
            if factor * load_at(middle) < load_N:
                low = middle
            else:
                high = middle
        return (low + high) / 2

    sinkage = depth_that_carries(1.0, _CHOSEN.solved)
    if sinkage >= deepest:
        load_at_axle = load_at(deepest)
        reason = f"down to its axle the wheel carries {load_at_axle:.3g} N"
        if np.isnan(load_at_axle):
            reason = rolling.profile.reason
        return _not_carried(load_N, np.nan, reason)
    turn = rolling.turn(slip, sinkage)
    best = {name: float(number) for name, number in _name_columns(turn, sinkage).items()}
    best["load_N"] = load_N
    least, most = _slip_range()
    # the doubled range leaves room for draws that are stronger or weaker than the medium itself
    ends = [depth_that_carries(factor, _CHOSEN.bracketed) for factor in (2 * most, least / 2)]
    depths = np.geomspace(max(ends[0], shallowest), ends[1], _CHOSEN.sinkages_of_draws)
    of_draws = rolling.turns_of_draws(slip, depths.tolist())
    return _Solved(best, _carry_load(of_draws, depths, load_N), 1.0, "")


def _slip_range() -> tuple[float, float]:
    """Return the least and the greatest factor of alpha by slip sinkage, as measured rigs show them."""
    slip_sinkage = wheel_numbers()["slip_sinkage"]
    return float(slip_sinkage["least"]), float(slip_sinkage["most"])


def _carry_load(turns: FloatArray, depths: FloatArray, load_N: float) -> dict[str, FloatArray]:
    """Return sinkage, drawbar and torque of each draw under a load, by column, (draws,), each with another slip sinkage.

    `turns`: drawbar, load and torque of each draw at each of `depths` (cm), shape (3, draws, depths). The logarithms of
    the factors of slip sinkage are spread evenly over their range and assigned at random. A draw that does not carry
    the load has the deepest of `depths`.
    """
    # a medium without draws is repeated, so that the factors are spread all the same
    drawbar_at_depths, load_at_depths, torque_at_depths = turns
    draws_of_medium = len(load_at_depths)
    count = draws_of_medium if draws_of_medium > 1 else _CHOSEN.draws
    number_of_draw = np.arange(count) % draws_of_medium
    share = (np.random.default_rng(SEED_OF_SLIP_SINKAGE).permutation(count) + 0.5) / count
    least, most = np.log(_slip_range())
    factors = np.exp(least + share * (most - least))
    sinkage, drawbar, torque = np.empty((3, count))
    for draw, number in enumerate(number_of_draw):
        load = np.maximum(load_at_depths[number], 1e-12)
        # never less at a greater depth, which interpolation needs
        lift = np.maximum.accumulate(factors[draw] * load)
        # depth and lift grow as powers of one another
        log_depth = np.interp(np.log(load_N), np.log(lift), np.log(depths))
        sinkage[draw] = np.exp(log_depth)
        # drawbar and torque over the load change slowly with depth, and a factor of alpha cancels
        for numbers, force in ((drawbar, drawbar_at_depths), (torque, torque_at_depths)):
            over_load = force[number] / load
            numbers[draw] = load_N * np.interp(log_depth, np.log(depths), over_load)
    return {"sinkage_cm": sinkage, "drawbar_N": drawbar, "torque_N_cm": torque}


class _ModelErrors(NamedTuple):
    """Errors of the model on wheels: of the drawbar over the load, of the torque over load times radius.

    One standard deviation, on measured rigs; NaN: not known.
    """

    drawbar: float
    torque: float


def _model_errors(
    profile: Profile,
    mesh: Mesh,
    friction: float | None,
    model_error: float | None,
    left_out: str | None,
) -> _ModelErrors:
    """Return the errors of the model: `model_error`, else those on rigs with wheels of this shape; arguments as in `wheel`.

    NaN for a profile on which no error was measured, as of nine terms; ValueError where one is asked for all the same.
    """
    if not has_model_error(profile):
        if model_error:
            raise ValueError(
                f"found a model's error of {model_error:g} with {profile.name}; allowed: 0: it was told from tables and maps"
            )
        return _ModelErrors(np.nan, np.nan)
    if model_error is not None:
        return _ModelErrors(float(model_error), float(model_error))
    case = "plain" if friction is None else "friction"
    rigs = [rig for rig in _rigs_of_shape(mesh) if rig["laboratory"] != left_out]
    return _ModelErrors(*(_joined_error(rigs, case, name) for name in _ModelErrors._fields))


def _list_limits(
    answer: pd.DataFrame,
    profile: Profile,
    mesh: Mesh,
    errors: _ModelErrors,
    rim: Rim,
    radius_cm: float,
) -> list[str]:
    """List sentences on where a wheel leaves the depths of measured alpha, or the rigs that showed the model's error.

    `answer`: table of the answer, as `WheelAnswer.table`. `radius_cm`: of the farthest point of the mesh.
    """
    limits = []
    lug_cm = radius_cm - rim.radius_cm
    deepest_cm = float(answer["sinkage_cm"].max()) + lug_cm
    measured_to_cm, clause = depth_measured(profile)
    if deepest_cm > measured_to_cm:
        below_rim = f" (lugs of {lug_cm:.2g} cm below the rim)" if lug_cm > 1e-6 * radius_cm else ""
        limits.append(describe_depth(deepest_cm, clause + below_rim))
    if not errors.drawbar > 0:
        return limits
    rigs = _rigs_of_shape(mesh)
    loads = answer["load_N"].dropna()
    tried = (
        ("radius_cm", "a rim of {:.3g} cm", [rim.radius_cm]),
        ("load_N", "a load of {:.3g} N", [loads.min(), loads.max()] if len(loads) else []),
    )
    for name, phrase, numbers in tried:
        of_rigs = [float(rig[name]) for rig in rigs]
        least, most = min(of_rigs), max(of_rigs)
        outside = [number for number in numbers if not is_tested(number, least, most)]
        limits += [
            f"the model's own error on wheels was never tested at {phrase.format(number)}: it is from {least:.3g} to {most:.3g}"
            for number in dict.fromkeys(outside)
        ]
    return limits


def _rigs_of_shape(mesh: Mesh) -> list[Mapping[str, Any]]:
    """Return the measured rigs whose wheel was smooth as this one, or lugged as this one: entries of `wheel_numbers`."""
    shape = "smooth" if mesh.is_convex else "lugged"
    return [rig for rig in wheel_numbers()["rig"] if rig["shape"] == shape]


def laboratories() -> tuple[str, ...]:
    """Return the names of the laboratories on whose rigs the model's own error on wheels was found, each once."""
    return tuple(dict.fromkeys(str(rig["laboratory"]) for rig in wheel_numbers()["rig"]))


def _joined_error(rigs: Sequence[Mapping[str, Any]], case: str, quantity: str) -> float:
    """Return the root mean square error over the runs of all rigs that measured a quantity; NaN where none did.

    `case`: ``plain`` or ``friction``, a key of a rig. `quantity`: ``drawbar`` or ``torque``.
    """
    weighted = [(rig["runs"], rig[case][quantity] ** 2) for rig in rigs if quantity in rig[case]]
    if not weighted:
        return np.nan
    runs, squares = np.array(weighted).T
    return round(float(np.sqrt(runs @ squares / runs.sum())), 3)


def _make_row(
    solved: _Solved,
    slip: float,
    rolling: _Wheel,
    confidence: float,
    errors: _ModelErrors,
    radius_cm: float,
) -> dict[str, Any]:
    """Return one row of the answer's table, as `WheelAnswer.table` has it; `radius_cm`: of the farthest point of the mesh.

    `solved`: numbers at this slip. The interval with the model's own error is that of alpha, widened in squares.
    """
    row: dict[str, Any] = {"slip": slip}
    load = solved.best["load_N"]
    sizes = {"drawbar_N": errors.drawbar * load, "torque_N_cm": errors.torque * load * radius_cm}
    for column in QUANTITIES:
        best = solved.best[column]
        row[column] = best
        ends = (best, best)
        if column in solved.draws:
            low, high = interval(solved.draws[column], confidence)
            ends = min(float(low), best), max(float(high), best)
            row |= dict(zip(end_names(column), ends, strict=True))
        if sizes.get(column, np.nan) > 0:
            with_model = widen(best, ends, half_width_of_bed(sizes[column], confidence))
            row |= dict(zip(model_end_names(column), with_model, strict=True))
    row["alpha_N_per_cm3"] = rolling.alpha
    row["alpha_of_load_N_per_cm3"] = rolling.alpha * solved.factor
    row["reason"] = solved.reason
    return row


def _list_notes(
    answer: pd.DataFrame, given: str, profile: Profile, errors: _ModelErrors, rim: Rim
) -> list[str]:
    """List sentences on rim, medium and load that a user needs with the numbers.

    `answer`: table of the answer. `given`: ``sinkage``, ``load`` or ``sinkage and load``.
    """
    notes = [f"{doubt[0].upper()}{doubt[1:]}." for doubt in rim.list_doubts()]
    if given == "sinkage and load":
        alpha = float(answer["alpha_N_per_cm3"].iloc[0])
        needed = answer["alpha_of_load_N_per_cm3"].dropna()
        if len(needed):
            least, most = needed.min(), needed.max()
            of_load = f"{least:.3g}" if least == most else f"{least:.3g} to {most:.3g}"
            notes.append(
                f"The load at this sinkage needs alpha {of_load} N/cm^3; the medium has {alpha:.3g}. Where they differ: slip "
                "sinkage, or another bed."
            )
    if given == "load":
        notes.append(
            "Sinkage, drawbar and torque are of a bed that the wheel does not dig out; the intervals hold the digging."
        )
        if "sinkage_hi_cm" in answer:
            to_axle = answer.loc[answer["sinkage_hi_cm"] > _CHOSEN.axle * rim.radius_cm, "slip"]
            notes += [
                f"Slip {slip:g}: it may dig itself in down to its axle, where the calculation ends: its sinkage has no upper limit."
                for slip in to_axle
            ]
    if given == "sinkage" and errors.drawbar > 0:
        notes.append(
            "The load has no interval with the model's own error: that was told from rigs whose load was given. "
            "`rftfit predict --roll` gives one of forces, from legs."
        )
    if not isinstance(profile.spread, Profile):
        notes.append("No error of alpha is known of this profile.")
    if np.isnan(errors.drawbar):
        notes.append(f"No error of the model on wheels is known of {profile.form}.")
    for slip, reason in zip(answer["slip"], answer["reason"], strict=True):
        if reason:
            notes.append(f"Slip {slip:g}: {reason}.")
    return notes


def _format_number(number: float) -> str:
    """Format a number; NaN is empty."""
    return "" if np.isnan(number) else f"{number + 0.0:.3g}"


def _format_interval(low: float, high: float, deepest: float) -> str:
    """Format an interval; NaN is empty. One that ends beyond `deepest`, where the calculation ends, has no upper limit."""
    if np.isnan(low):
        return ""
    return f"{_format_number(low)} to {'the axle' if high > deepest else _format_number(high)}"


_MEASURED = Schema(
    "wheel-runs",
    (
        TableColumn("slip", "number", "slip of the rim", low=-1.0, high=1.0),
        *(
            TableColumn(column, "number", meaning, needed=False, unit=unit)
            for column, meaning, unit in (
                ("drawbar_N", "force of the medium along the travel", "N"),
                ("torque_N_cm", "torque of the drive", "N cm"),
                ("sinkage_cm", "depth of the lowest point of the rim", "cm"),
                ("load_N", "what the wheel carries", "N"),
            )
        ),
    ),
    comments=True,
    others="ignored",
)
"""Columns of a file of measured runs of a wheel."""


def read_measured_runs(file: Path) -> pd.DataFrame:
    """Read measured runs of a wheel: ``slip`` and any of ``drawbar_N``, ``torque_N_cm``, ``sinkage_cm``, ``load_N``.

    One row a run; a column that is empty in all rows is left out. Raises CampaignError with every cell that is wrong,
    or where there is no other column than the slip.
    """
    rows, problems = read_rows(file, _MEASURED)
    columns = [column.name for column in _MEASURED.columns]
    runs = pd.DataFrame([row.number for row in rows], columns=columns).dropna(axis=1, how="all")
    if not problems and runs.shape[1] < 2:
        problems = [
            Problem("wheel-runs.no-quantity", Place(str(file)), None, " or ".join(columns[1:]))
        ]
    if problems:
        raise CampaignError(problems)
    return runs
