"""Forces on bodies with their intervals: the spread of a profile and the model's own error, carried through the integral."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.conventions import QUASI_STATIC_CM_PER_S, FloatArray
from rftfit.forces import model_error as errors
from rftfit.forces.body_error import BodyError, pose_states
from rftfit.forces.faces import moving_faces
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion, rotation
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import (
    STEEP,
    STEEP_DEG,
    STEEPEST,
    DrawStatistics,
    Ends,
    Peak,
    PeakTarget,
    hold_beside,
    joined,
    of_next_bed,
    only_true,
    pick_peaks,
    withhold,
)
from rftfit.forces.plane import Forces, force_draws, forces_on
from rftfit.forces.reference_kernel import angles, place, submerged
from rftfit.forces.space import compiled_mesh_forces, predict_mesh
from rftfit.measure.errors import half_width_of_bed
from rftfit.model.draws import beside_name, end_names, model_end_names, next_end_names
from rftfit.model.known import profile_of
from rftfit.model.profiles import EPS, FourierProfile, KnownMedium, Profile, TableProfile
from rftfit.model.scaling import ScaledMedium

QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")

PEAKS = (
    PeakTarget("lift", "force_z_N", 1),
    PeakTarget("suction", "force_z_N", -1),
    PeakTarget("thrust", "force_x_N", 1),
    PeakTarget("drag", "force_x_N", -1),
    PeakTarget("moment", "moment_N_cm", 1),
    PeakTarget("moment_negative", "moment_N_cm", -1),
)
"""Peaks of the prediction of an outline."""

_MOST_AT_ONCE = 2_000_000


def predict(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    quantities: Sequence[str] = QUANTITIES,
    law: str = "measured",
    friction: float | None = None,
    model_error: float | None = None,
    body_error: BodyError | None = None,
) -> pd.DataFrame:
    """Force and moment on a body that moves through a medium, with intervals.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        What `scale`, `estimate_map`, `published_medium` or `read_profile` return, a medium of `open` (its table, or its map
        where the table has no number in a direction of the body) or one of its profiles, or the path of a profile file.
    outline : Outline or Mesh
        The body: `model_leg`, `arc`, `polyline` in the plane, a `Mesh` in space.
    motion : Motion or Motion3D, optional
        `rotation` (default: that of the paper's trials) or `path`; of a mesh a `Motion3D`.
    confidence : float, optional
        Level of the intervals, which are pointwise: each pose for itself.
    quantities : sequence of str, optional
        Which of ``force_z_N``, ``force_x_N``, ``moment_N_cm`` get an interval; default all. Of an outline.
    law : str, optional
        Of a mesh: ``measured``, the whole map, or ``3d-rft``, which takes its alpha_z(0, 90 deg) alone.
    friction : float, optional
        Of a mesh: stress along a face is at most this times the stress across it, and no face is pulled or
        driven. Default: as the law gives it; the surface of the measured plates is in their map.
    model_error : float, optional
        Relative error of the model itself, beside that of alpha (`rftfit.forces.model_error`). Default: that of
        the profile, 0.28 as on measured legs or more, of tables and maps (of a solid in space, by direction, 1.39 times
        that); of another profile none is known. 0: none.
    body_error : BodyError, optional
        What the model gets wrong on this body, learned in other media (`learn_body_error`): force and interval are
        blended with it by their errors. It takes the place of `model_error`.

    Returns
    -------
    pandas.DataFrame
        One row per pose: the columns of `motion`; ``force_z_N`` (up is positive), ``force_x_N``
        (toward +x), ``moment_N_cm`` about the reference point (from z toward x); after each two
        intervals: of alpha, as ``force_z_lo_N, force_z_hi_N``, where the profile has a spread, and with the
        model's own error, as ``force_z_model_lo_N, force_z_model_hi_N``, both of the mean over beds; the
        wider of them with the spread of one bed, ``force_z_next_lo_N, force_z_next_hi_N``; ``reason``, why
        there is no number. Of a mesh: ``x_cm, y_cm, z_cm``, forces and moments about the reference point in
        three directions (axes of the world), and ``closure_N``: the error of a force if the law in space errs
        alike on all faces that leave their plane (measured law). It is not in the interval, because no
        measurement in the plane contains it.

    Raises
    ------
    TypeError
        If the motion of a mesh is no `Motion3D`, or that of an outline is one; if there is no medium.
    ValueError
        If `model_error` is stated of a profile of which none is known.

    Examples
    --------
    >>> import rftfit
    >>> forces = rftfit.predict(rftfit.published_medium("poppy_LP"), rftfit.model_leg("c_leg"))
    >>> round(float(forces["force_z_N"].max()), 1)
    8.9
    """
    return predict_with_peaks(
        medium,
        outline,
        motion,
        confidence,
        quantities=quantities,
        law=law,
        friction=friction,
        model_error=model_error,
        body_error=body_error,
    )[0]


def knows_forces(profile: Profile, body: Outline | Mesh, motion: Motion | Motion3D) -> bool:
    """Tell whether a profile has a number in every direction of a body that moves."""
    if isinstance(body, Mesh) and isinstance(motion, Motion3D):
        return bool(np.isfinite(compiled_mesh_forces(profile, body, motion)[:, :6]).all())
    assert isinstance(body, Outline)
    assert isinstance(motion, Motion)
    net = forces_on(profile, body, motion.poses)
    return not np.isnan([net.force_z_N, net.force_x_N, net.moment_N_cm]).any()


def predict_with_peaks(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    quantities: Sequence[str] = QUANTITIES,
    law: str = "measured",
    friction: float | None = None,
    model_error: float | None = None,
    body_error: BodyError | None = None,
) -> tuple[pd.DataFrame, list[Peak]]:
    """Table of `predict` and peaks of `find_peaks`, from one pass through all draws."""
    if body_error is not None and model_error is not None:
        raise ValueError("found model_error and body_error; allowed: one of them")
    if isinstance(outline, Mesh):
        if not isinstance(motion, Motion3D):
            raise TypeError("a mesh moves in space: its motion is a Motion3D")
    elif isinstance(motion, Motion3D):
        raise TypeError("an outline moves in the plane; Mesh.extrude makes a mesh of it")
    motion = rotation() if motion is None else motion
    profile = profile_of(medium, partial(knows_forces, body=outline, motion=motion))
    eps = errors.eps_of(model_error, profile, outline)
    if isinstance(outline, Mesh):
        assert isinstance(motion, Motion3D)
        return predict_mesh(profile, outline, motion, confidence, law, friction, eps, body_error)
    assert isinstance(motion, Motion)
    net = forces_on(profile, outline, motion.poses)
    best = _named(net, QUANTITIES)
    of_body = None
    if body_error is not None:
        of_body = _BodyPaths.of(body_error, profile, outline, motion.poses)
        load = errors.outline_load(profile, outline, motion.poses)
        best = of_body.moved(best, load, 0)
        eps = body_error.per_medium
    alpha = model = None
    ends: Ends = {}
    model_ends: Ends = {}
    if isinstance(profile.spread, Profile):
        alpha, model = _spread_of_draws(
            profile.spread, outline, motion.poses, best, confidence, quantities, eps, of_body
        )
        ends = alpha.ends
    elif isinstance(profile.spread, ScaledMedium):
        ends = _of_further_medium(
            profile.spread.at_confidence(confidence), outline, motion.poses, quantities
        )
    if eps and model is None:
        model = _spread_of_model(
            profile, outline, motion.poses, best, confidence, quantities, eps, of_body
        )
    if model is not None:
        model_ends = model.ends
        if alpha is None and ends:
            model_ends = {
                name: joined(best[name], ends[name], model_ends[name]) for name in quantities
            }
            model = None
    forces_beside = None
    if profile.beside is not None:
        forces_beside = _named(forces_on(profile.beside(), outline, motion.poses), QUANTITIES)
        ends = only_true(ends, forces_beside)
    columns: dict[str, object] = dict(motion.columns)
    bed = half_width_of_bed(profile.bed_spread, confidence)
    for name, values in best.items():
        columns[name] = values
        if forces_beside is not None:
            columns[beside_name(name)] = forces_beside[name]
        if name in ends:
            columns |= dict(zip(end_names(name), ends[name], strict=True))
        if name in model_ends:
            columns |= dict(zip(model_end_names(name), model_ends[name], strict=True))
        if name in model_ends or (name in ends and errors.has_model_error(profile)):
            of_bed = of_next_bed(values, model_ends.get(name) or ends[name], bed)
            columns |= dict(zip(next_end_names(name), of_bed, strict=True))
    unknown = np.isnan(np.stack(list(best.values()))).any(axis=0)
    table = pd.DataFrame(columns | {"reason": np.where(unknown, net.reason, "")})
    places = table.iloc[:, 0].to_numpy(float)
    bounds = _bounds(profile, outline, motion.poses) if unknown.any() else {}
    of_bed_known = model_ends or errors.has_model_error(profile)
    peaks = pick_peaks(
        best, PEAKS, places, bounds, alpha, model, ends, model_ends, bed if of_bed_known else np.nan
    )
    if forces_beside is not None:
        peaks = hold_beside(peaks, PEAKS, forces_beside)
    return table, [_withhold_steep(peak, profile, outline, motion) for peak in peaks]


def _withhold_steep(peak: Peak, profile: Profile, outline: Outline, motion: Motion) -> Peak:
    """Withhold the interval of alpha of a peak that changes fast with the attack angle, between pushes.

    There alpha may have an edge that no push shows, on which the elements of a body err alike.
    """
    has_interval = isinstance(profile, TableProfile) and np.isfinite(peak.lo)
    if not (has_interval and peak.quantity in ("force_z_N", "force_x_N") and peak.value):
        return peak
    assert isinstance(profile, TableProfile)
    pose = int(np.argmin(np.abs(motion.columns[motion.key] - peak.position)))
    elements = place(outline.body, outline.width_cm, motion.poses[pose : pose + 1])
    load = submerged(elements, outline.solid)[0]
    beta, gamma = (np.where(load == 0, 0.0, angle) for angle in angles(elements))
    component = ("force_z_N", "force_x_N").index(peak.quantity)
    turned = np.radians(STEEP_DEG) * np.array([-1.0, 0.0, 1.0])[:, None]
    forces = load * profile.alpha(beta + turned, gamma)[component]
    steepness = abs(float(np.diff(forces[::2].sum(axis=-1))[0])) / 2 / abs(peak.value)
    peak = replace(peak, steepness=steepness)
    if steepness <= STEEPEST:
        return peak
    size = np.abs(forces[1])
    far = profile.far_from_pushes(beta[0], gamma[0])
    if size[far].sum() <= _NOTICED * size.sum():
        return peak
    return withhold(peak, STEEP)


def find_peaks(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    model_error: float | None = None,
) -> list[Peak]:
    """Find the greatest force and moment of each sign on a body that moves, with the intervals that ``rftfit predict`` prints.

    Parameters
    ----------
    medium, outline, motion, confidence, model_error
        As of `predict`.

    Returns
    -------
    list of Peak
        Only those that exist: no lift where nothing pushes up, and none that may lie in a pose without a number. Of a
        mesh: the largest value of each force and moment, of either sign.

    Examples
    --------
    >>> import rftfit
    >>> lift, *others = rftfit.find_peaks(rftfit.scale(0.9), rftfit.model_leg("c_leg"))
    >>> lift.name, round(lift.value, 1)
    ('lift', 27.8)
    """
    return predict_with_peaks(medium, outline, motion, confidence, model_error=model_error)[1]


@dataclass(frozen=True)
class _BodyPaths:
    """What the model gets wrong on a body along a motion, over the load: mean (1, 2, p) and draws (draws, 2, p)."""

    mean: FloatArray
    drawn: FloatArray

    @classmethod
    def of(
        cls, body_error: BodyError, profile: Profile, outline: Outline, poses: FloatArray
    ) -> _BodyPaths:
        draws = errors.DRAWS
        if isinstance(profile.spread, Profile):
            draws = len(profile.spread.parameters[0])
        states = pose_states(errors.outline_points(outline), poses)
        mean, drawn = body_error.paths(states, 2, draws)
        return cls(mean[None], drawn)

    def moved(
        self, forces: dict[str, FloatArray], load: errors.Load, start: int
    ) -> dict[str, FloatArray]:
        """Forces of some poses from `start` on, with the mean error of the body."""
        stop = start + forces["force_z_N"].shape[-1]
        with_mean = _with_error(forces, load, start, self.mean[..., start:stop], 1.0)
        return {
            name: values.reshape(forces[name].shape) if len(values) == 1 else values
            for name, values in with_mean.items()
        }

    def about_mean(self) -> FloatArray:
        """Draws less their mean."""
        return self.drawn - self.mean


def _of_further_medium(
    medium: ScaledMedium, outline: Outline, poses: FloatArray, quantities: Sequence[str]
) -> Ends:
    reference = medium.reference
    unit = _named(forces_on(FourierProfile(reference.m0), outline, poses), quantities)
    forces_of_media = _named(
        force_draws(FourierProfile(reference.scaled), outline, poses), quantities
    )
    tables = [_named(forces_on(table, outline, poses), quantities) for table in reference.tables]
    ends: Ends = {}
    for name in quantities:
        of_media, measured = medium.of_media(
            forces_of_media[name], [forces[name] for forces in tables]
        )
        ends[name] = medium.with_interval(unit[name], of_media, measured=measured)[1:]
    return ends


def _spread_of_draws(
    draws: Profile,
    outline: Outline,
    poses: FloatArray,
    best: dict[str, FloatArray],
    confidence: float,
    quantities: Sequence[str],
    eps: float,
    of_body: _BodyPaths | None = None,
) -> tuple[DrawStatistics, DrawStatistics | None]:
    """Draws of alpha, and these with the model's error."""
    alpha = DrawStatistics(quantities, PEAKS, confidence)
    model = DrawStatistics(quantities, PEAKS, confidence) if eps else None
    count = draws.parameters[0].shape[0]
    step = max(1, _MOST_AT_ONCE // count)
    moment = "moment_N_cm" in quantities
    load = errors.outline_load(draws, outline, poses, with_centre=moment) if eps else None
    paths = _paths(outline, poses, count, step, of_body)
    for start in range(0, len(poses), step):
        chunk = slice(start, start + step)
        forces = _named(force_draws(draws, outline, poses[chunk]), QUANTITIES)
        if of_body is not None and load is not None:
            forces = of_body.moved(forces, load, start)
        is_finite = np.isfinite(best["force_z_N"][chunk])
        alpha.add(forces, is_finite)
        if model is not None and load is not None:
            size = eps if of_body is None else 1.0
            model.add(_with_error(forces, load, start, next(paths), size), is_finite)
    return alpha, model


def _spread_of_model(
    profile: Profile,
    outline: Outline,
    poses: FloatArray,
    best: dict[str, FloatArray],
    confidence: float,
    quantities: Sequence[str],
    eps: float,
    of_body: _BodyPaths | None = None,
) -> DrawStatistics:
    """The model's error alone, about the best curves."""
    model = DrawStatistics(quantities, PEAKS, confidence)
    step = max(1, _MOST_AT_ONCE // errors.DRAWS)
    moment = "moment_N_cm" in quantities
    load = errors.outline_load(profile, outline, poses, with_centre=moment)
    paths = _paths(outline, poses, errors.DRAWS, step, of_body)
    size = eps if of_body is None else 1.0
    for start, path in zip(range(0, len(poses), step), paths, strict=True):
        chunk = slice(start, start + step)
        forces = {name: values[chunk][None] for name, values in best.items()}
        is_finite = np.isfinite(best["force_z_N"][chunk])
        model.add(_with_error(forces, load, start, path, size), is_finite)
    return model


def _paths(
    outline: Outline, poses: FloatArray, count: int, step: int, of_body: _BodyPaths | None
) -> Iterator[FloatArray]:
    """Draws of the error over the load, of `step` poses after another; of a learned body in its own unit."""
    if of_body is None:
        return errors.error_paths(errors.outline_progress(outline, poses), count, 2, step)
    drawn = of_body.about_mean()
    return (drawn[..., start : start + step] for start in range(0, len(poses), step))


def _with_error(
    forces: dict[str, FloatArray], load: errors.Load, start: int, paths: FloatArray, eps: float
) -> dict[str, FloatArray]:
    stop = start + forces["force_z_N"].shape[-1]
    moved = errors.plane_errors(load.between(start, stop), paths, eps)
    # without a centre of the load there is no error of the moment
    return {name: forces[name] + error for name, error in zip(QUANTITIES, moved, strict=False)}


def _bounds(
    profile: Profile, outline: Outline, poses: FloatArray
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """What a force may be in each pose: its sum over elements with a number, and the most that the others may add.

    An element without a number has at most the largest alpha that is known.
    """
    elements = place(outline.body, outline.width_cm, poses)
    load, centre = submerged(elements, outline.solid)
    arm = centre - poses[:, None, :2]
    beta, gamma = (np.where(load == 0, 0.0, angle) for angle in angles(elements))
    largest = [float(np.nanmax(np.abs(values), initial=0.0)) for values in profile.parameters]
    alpha = profile.alpha(beta, gamma)
    z, x = (np.where(load == 0, 0.0, load * values) for values in alpha)
    most_z, most_x = (
        np.where(np.isnan(force), load * most, 0.0)
        for force, most in zip((z, x), largest, strict=True)
    )
    z, x = np.nan_to_num(z), np.nan_to_num(x)
    moment = arm[..., 1] * x - arm[..., 0] * z
    most_moment = np.abs(arm[..., 1]) * most_x + np.abs(arm[..., 0]) * most_z
    parts = (z, most_z), (x, most_x), (moment, most_moment)
    return {
        name: (alpha_bounds.sum(axis=-1), most.sum(axis=-1))
        for name, (alpha_bounds, most) in zip(QUANTITIES, parts, strict=True)
    }


def _named(forces: Forces, quantities: Sequence[str]) -> dict[str, FloatArray]:
    return {name: getattr(forces, name) for name in quantities}


_NOTICED = 0.1
"""Part of the force on a body that is worth a word."""


def beyond_measured(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    config: Config | None = None,
) -> list[str]:
    """Where a prediction leaves what was measured, or what the model is for.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        As of `predict`; the `window` of its profile says over which depths alpha was measured.
    outline : Outline or Mesh
    motion : Motion or Motion3D, optional
        Default: the rotation of the paper's trials.
    config : Config, optional
        Its container, in whose middle the motion is taken to be, and `fit.wall_clearance_cm`.
        Default: a bed without walls.

    Returns
    -------
    list of str
        A sentence for each limit that is left: deeper or shallower than the window, faster than
        quasi-static, near walls or bottom, sizes and speeds on which the model's own error was not
        tested. The share is that of depth times area, summed over all poses.

    Examples
    --------
    >>> import rftfit
    >>> leg = rftfit.model_leg("c_leg")
    >>> rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), leg)
    []
    """
    motion = rotation() if motion is None else motion
    load, depth, speed, *level = _pieces(outline, motion)
    total = float(np.nansum(load))
    if not total > 0:
        return []
    warnings = []
    profile = profile_of(medium, partial(knows_forces, body=outline, motion=motion))
    shallowest, deepest = profile.window

    def share(where: np.ndarray) -> float:
        return float(np.nansum(load[where])) / total

    if (deeper := depth[load > 0].max()) > deepest:
        warnings.append(
            f"deeper than measured: down to {deeper:.1f} cm, alpha is from {deepest:.1f} cm at most "
            f"({100 * share(depth > deepest):.0f} % of depth times area lies below)"
        )
    if (share_above := share(depth < shallowest)) > _NOTICED:
        warnings.append(
            f"nearer to the surface than measured: {100 * share_above:.0f} % of depth times area lies above "
            f"{shallowest:.1f} cm"
        )
    if (fastest := float(speed[load > 0].max())) > QUASI_STATIC_CM_PER_S:
        share_above = share(speed > QUASI_STATIC_CM_PER_S)
        warnings.append(
            f"faster than quasi-static: up to {fastest:.0f} cm/s ({100 * share_above:.0f} % of depth times area "
            f"above {QUASI_STATIC_CM_PER_S:g} cm/s), where the inertia of the grains counts too"
        )
    if config is not None:
        box, clear = config.container, config.fit.wall_clearance_cm
        near = depth > box.depth_cm - clear
        for place_cm, size in zip(level, (box.length_cm, box.width_cm), strict=False):
            wet = place_cm[load > 0]
            near |= np.abs(place_cm - (wet.max() + wet.min()) / 2) > size / 2 - clear
        if isinstance(outline, Outline):
            near |= outline.width_cm > box.width_cm - 2 * clear
        if (share_above := float(np.nansum(load[near])) / total) > _NOTICED:
            warnings.append(
                f"near the container: {100 * share_above:.0f} % of depth times area lies within {clear:g} cm of "
                "its walls or bottom, even in its middle; alpha was measured farther from them"
            )
    if not errors.has_model_error(profile):
        return warnings
    points = outline.vertices_cm if isinstance(outline, Mesh) else errors.outline_points(outline)
    eps = errors.EPS_IN_SPACE if errors.is_in_space(outline) else EPS
    return warnings + errors.beyond_tested(errors.longest(points), fastest, eps)


def _pieces(outline: Outline | Mesh, motion: Motion | Motion3D) -> list[FloatArray]:
    """Of elements in all poses: depth times area (cm^3), depth (cm), speed, and x (of a mesh also y)."""
    if isinstance(outline, Mesh) and isinstance(motion, Motion3D):
        parts = []
        for frame, rolling in zip(motion.frames, motion.rolling, strict=True):
            _, load, _, moves, arm = moving_faces(outline, frame, rolling)
            x, y, z = (frame[:3] + arm).T
            parts.append(np.stack([load, -z, np.linalg.norm(moves, axis=-1), x, y]))
        return list(np.hstack(parts))
    if isinstance(outline, Mesh) or isinstance(motion, Motion3D):
        raise TypeError("a mesh moves by a Motion3D, an outline by a Motion")
    elements = place(outline.body, outline.width_cm, motion.poses)
    load, centre = submerged(elements, outline.solid)
    speed = np.hypot(elements[..., 6], elements[..., 7])
    return [load, -centre[..., 1], speed, centre[..., 0]]
