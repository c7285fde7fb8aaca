"""Forces on a mesh with their intervals, and beside them what no measurement in the plane contains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray
from rftfit.forces import model_error as errors
from rftfit.forces.body_error import BodyError, frame_states
from rftfit.forces.faces import LAWS, as_table, moving_faces
from rftfit.forces.mesh import IntArray, Mesh, Motion3D, area_vectors
from rftfit.forces.peaks import (
    DrawStatistics,
    Ends,
    Peak,
    PeakTarget,
    hold_beside,
    joined,
    of_next_bed,
    only_true,
    pick_peaks,
)
from rftfit.measure.errors import half_width_of_bed
from rftfit.model import rft3d
from rftfit.model.draws import beside_name, end_names, model_end_names, next_end_names
from rftfit.model.packs import Pack
from rftfit.model.profiles import EPS, FourierProfile, Profile, TableProfile
from rftfit.model.scaling import ScaledMedium

IN_SPACE = (*(f"force_{axis}_N" for axis in "xyz"), *(f"moment_{axis}_N_cm" for axis in "xyz"))

CLOSURE = 0.044
"""Error of the measured law on a face that leaves its plane, rms of a component over the largest alpha, where
3D-RFT is the truth, over random leading faces."""

NO_ELASTICITY = (0.0, 0.0, 0.0)


def face_rows(mesh: Mesh) -> FloatArray:
    """What the compiled kernel needs of faces: corners, centroid, unit normal, area, 1 for a sheet: (m, 17)."""
    triangles = mesh.triangles
    normals = area_vectors(triangles)
    area = np.linalg.norm(normals, axis=-1)[:, None]
    unit = np.divide(normals, area, where=area > 0, out=np.zeros_like(normals))
    sheet = np.full_like(area, mesh.sheet)
    return np.hstack([triangles.reshape(-1, 9), triangles.mean(axis=1), unit, area, sheet])


def law_of(profile: Profile, law: str) -> tuple[Pack, float, FloatArray]:
    """First arguments of `face_kernel.face_forces`: map, alpha_x(0, 0), and the coefficients of 3D-RFT."""
    choose("law", law, LAWS)
    if law == "measured":
        return as_table(profile).pack, float(profile.alpha(0.0, 0.0)[1]), np.zeros((0, 0))
    down = np.array([0.0, 0.0, -1.0])
    xi = float(profile.alpha(0.0, np.pi / 2)[0]) / rft3d.law(down, down)[2]
    nothing = TableProfile(np.zeros((7, 13)), np.zeros((7, 13))).pack
    return nothing, 0.0, xi * rft3d.COEFFICIENTS


def compiled_mesh_forces(
    profile: Profile,
    mesh: Mesh,
    motion: Motion3D,
    law: str = "measured",
    friction: float | None = None,
) -> FloatArray:
    """Force (N), moment about the reference point (N cm), and depth times area that leaves its plane: (p, 7).

    Then what faces bear without cancellation, as of `face_kernel.face_forces`: (p, 19).
    """
    faces = face_rows(mesh)
    ranges = np.tile(np.array([0, len(faces)]), (len(motion.frames), 1))
    return _forces(law_of(profile, law), faces, ranges, motion, friction)


def _forces(
    law: tuple[Pack, float, FloatArray],
    faces: FloatArray,
    ranges: IntArray,
    motion: Motion3D,
    friction: float | None,
) -> FloatArray:
    from rftfit.forces.face_kernel import face_forces

    frames = motion.frames
    forces = np.empty((len(frames), 19))
    limit = -1.0 if friction is None else float(friction)
    face_forces(
        *law, limit, faces, ranges, frames, motion.rolling, NO_ELASTICITY, np.zeros((0, 3)), forces
    )
    return forces


def mesh_draws(
    draws: Profile, mesh: Mesh, motion: Motion3D, law: str, friction: float | None
) -> FloatArray:
    """`compiled_mesh_forces` for each of a stack of draws: (draws, p, 19)."""
    stack = as_table(draws)
    faces, ranges = _wet_faces(mesh, motion)
    shape = (-1, *stack.alpha_z.shape[-2:])
    alpha = zip(stack.alpha_z.reshape(shape), stack.alpha_x.reshape(shape), strict=True)
    profiles = (
        TableProfile.of_nodes(stack.beta, stack.gamma, nodes_of_draw) for nodes_of_draw in alpha
    )
    return np.stack(
        [
            _forces(law_of(profile_of_draw, law), faces, ranges, motion, friction)
            for profile_of_draw in profiles
        ]
    )


_MOST_WET = 2_000_000
"""Most faces in all poses that are sorted out before many draws: 270 MB."""


def _wet_faces(mesh: Mesh, motion: Motion3D) -> tuple[FloatArray, IntArray]:
    """Rows of the faces that reach below the surface, pose after pose, and the range of each pose.

    Most of a rolling wheel is dry, and need not be looked at again for each draw.
    """
    faces, frames = face_rows(mesh), motion.frames
    if len(faces) * len(frames) > _MOST_WET or not np.isfinite(frames).all():
        return faces, np.tile(np.array([0, len(faces)]), (len(frames), 1))
    lowest = np.stack([(mesh.triangles @ frame[15:]).min(axis=1) + frame[2] for frame in frames])
    # a corner at the surface by rounding stays in
    poses, numbers = np.nonzero(lowest < _AT_SURFACE_CM)
    ends = np.cumsum(np.bincount(poses, minlength=len(frames)))
    return np.ascontiguousarray(faces[numbers]), np.stack([np.append(0, ends[:-1]), ends], axis=-1)


_AT_SURFACE_CM = 1e-6
"""Height below which a corner may count as wet."""


def predict_mesh(
    profile: Profile,
    mesh: Mesh,
    motion: Motion3D,
    confidence: float = 0.95,
    law: str = "measured",
    friction: float | None = None,
    eps: float = EPS,
    body_error: BodyError | None = None,
) -> tuple[pd.DataFrame, list[Peak]]:
    """`rftfit.forces.prediction.predict_with_peaks` of a mesh; the peaks are the largest values of either sign."""
    best_forces = compiled_mesh_forces(profile, mesh, motion, law, friction)
    of_body = None
    if body_error is not None:
        states = frame_states(mesh.vertices_cm, motion.frames)
        count = errors.DRAWS
        if isinstance(profile.spread, Profile):
            count = len(profile.spread.parameters[0])
        mean, drawn = body_error.paths(states, 3, count)
        mean = mean[None]
        of_body = drawn - mean
        best_forces = best_forces.copy()
        best_forces[:, :6] += errors.space_errors(_load_of(best_forces[None]), mean, 1.0)[0]
    best = _named(best_forces)
    extremes = extremes_in_space(best)
    is_finite = np.asarray(np.isfinite(best_forces[:, :6]).all(axis=1))
    alpha = model = None
    ends: Ends = {}
    model_ends: Ends = {}
    draws = best_forces[None]
    if isinstance(profile.spread, Profile):
        draws = mesh_draws(profile.spread, mesh, motion, law, friction)
        if of_body is not None:
            draws[..., :6] += errors.space_errors(_load_of(draws), mean, 1.0)
        alpha = DrawStatistics(IN_SPACE, extremes, confidence)
        alpha.add(_named(draws), is_finite)
        ends = alpha.ends
    elif isinstance(profile.spread, ScaledMedium):
        medium = profile.spread.at_confidence(confidence)
        unit = compiled_mesh_forces(
            FourierProfile(medium.reference.m0), mesh, motion, law, friction
        )[:, :6]
        draws_of_media = mesh_draws(
            FourierProfile(medium.reference.scaled), mesh, motion, law, friction
        )
        tables = [
            compiled_mesh_forces(table, mesh, motion, law, friction)[:, :6]
            for table in medium.reference.tables
        ]
        of_media, measured = medium.of_media(draws_of_media[..., :6], tables)
        lo, hi = medium.with_interval(unit, of_media, measured=measured)[1:]
        ends = {name: (lo[:, k], hi[:, k]) for k, name in enumerate(IN_SPACE)}
    if eps or of_body is not None:
        model = DrawStatistics(IN_SPACE, extremes, confidence)
        if of_body is None:
            moved = _model_errors(draws, mesh, motion, eps)
        else:
            moved = errors.space_errors(_load_of(draws), of_body, 1.0)
        model.add(_named(draws[..., :6] + moved), is_finite)
        model_ends = model.ends
        if alpha is None and ends:
            model_ends = {
                name: joined(best[name], ends[name], model_ends[name]) for name in IN_SPACE
            }
            model = None
    forces_beside = None
    if profile.beside is not None:
        forces_beside = _named(
            compiled_mesh_forces(profile.beside(), mesh, motion, law, friction)[:, :6]
        )
        ends = only_true(ends, forces_beside)
    columns = dict(motion.columns)
    bed = half_width_of_bed(profile.bed_spread, confidence)
    for name in IN_SPACE:
        columns[name] = best[name]
        if forces_beside is not None:
            columns[beside_name(name)] = forces_beside[name]
        if name in ends:
            columns |= dict(zip(end_names(name), ends[name], strict=True))
        if name in model_ends:
            columns |= dict(zip(model_end_names(name), model_ends[name], strict=True))
        if name in model_ends or (name in ends and errors.has_model_error(profile)):
            of_bed = of_next_bed(best[name], model_ends.get(name) or ends[name], bed)
            columns |= dict(zip(next_end_names(name), of_bed, strict=True))
    # a force that symmetry cancels is rounding of the sum
    columns = {name: _without_rounding(values, name, best) for name, values in columns.items()}
    table = as_table(profile)
    largest = float(np.fmax.reduce(np.hypot(table.alpha_z, table.alpha_x), axis=None))
    # + 0.0 so that nothing is called -0
    leaving = best_forces[:, 6] + 0.0
    columns["closure_N"] = (CLOSURE if law == "measured" else np.nan) * largest * leaving
    why = profile.reason or "a position, rotation or velocity is missing"
    places = next(iter(motion.columns.values()))
    bounds: dict[str, tuple[FloatArray, FloatArray]] = {}
    if not is_finite.all():
        bounds = _bounds(largest, mesh, motion)
    of_bed_known = model_ends or errors.has_model_error(profile)
    peaks = pick_peaks(
        best,
        extremes,
        places,
        bounds,
        alpha,
        model,
        ends,
        model_ends,
        bed if of_bed_known else np.nan,
    )
    if forces_beside is not None:
        peaks = hold_beside(peaks, extremes, forces_beside)
    peaks = [_peak_without_rounding(peak, best) for peak in peaks]
    return pd.DataFrame(columns | {"reason": np.where(is_finite, "", why)}), peaks


_ROUNDING = 1e-9
"""What is below this part of the largest force, or moment, is rounding."""


def _least_of(name: str, best: Mapping[str, FloatArray]) -> float:
    """Return the least size that counts of a force or a moment; 0 for what is neither."""
    kind = name.partition("_")[0]
    sizes = [np.abs(values) for quantity, values in best.items() if quantity.startswith(kind)]
    if kind not in ("force", "moment") or not sizes:
        return 0.0
    return _ROUNDING * float(np.fmax.reduce(np.concatenate(sizes), initial=0.0))


def _without_rounding(values: FloatArray, name: str, best: Mapping[str, FloatArray]) -> FloatArray:
    return np.where(np.abs(values) < _least_of(name, best), 0.0, values)


def _peak_without_rounding(peak: Peak, best: Mapping[str, FloatArray]) -> Peak:
    least = _least_of(peak.quantity, best)
    ends = ("value", "lo", "hi", "model_lo", "model_hi", "next_lo", "next_hi")
    zeros: dict[str, Any] = {end: 0.0 for end in ends if abs(getattr(peak, end)) < least}
    return replace(peak, **zeros)


def _named(forces: FloatArray) -> dict[str, FloatArray]:
    return {name: forces[..., k] for k, name in enumerate(IN_SPACE)}


def extremes_in_space(best: Mapping[str, FloatArray]) -> list[PeakTarget]:
    """The largest value of each force and moment, of the sign that it has."""
    return [PeakTarget(name.partition("_N")[0], name, _sign(best[name])) for name in IN_SPACE]


def _sign(values: FloatArray) -> int:
    """Sign of the largest of some values."""
    sizes = np.nan_to_num(np.abs(values))
    return -1 if sizes.size and values[sizes.argmax()] < 0 else 1


def _model_errors(draws: FloatArray, mesh: Mesh, motion: Motion3D, eps: float) -> FloatArray:
    """Errors of the model in each draw (draws, p, 19): (draws, p, 6), or of many draws about a single one."""
    poses = draws.shape[1]
    count = len(draws) if len(draws) > 1 else errors.DRAWS
    progress = errors.frames_progress(mesh.vertices_cm, motion.frames)
    paths = next(errors.error_paths(progress, count, 3, poses))
    if mesh.sheet:  # as an outline, on which the error was told
        return errors.space_errors(_load_of(draws), paths, eps)
    return errors.directed_errors(_load_of(draws), _loads_by_direction(draws), paths, eps)


def _load_of(draws: FloatArray) -> errors.Load:
    """Load without cancellation of each draw (draws, p, 19)."""
    bare = np.nan_to_num(draws[..., 7:13])
    total_load = bare[..., 2]
    centre = bare[..., 3:] / np.where(total_load > 0, total_load, 1.0)[..., None]
    loaded = (total_load > 0).any(axis=0).astype(float)
    size = errors.size_of(np.hypot(bare[..., 0], bare[..., 1])) * loaded
    return errors.Load(np.arange(draws.shape[1]), size, centre, loaded)


def _loads_by_direction(draws: FloatArray) -> FloatArray:
    """Sum of f f^T / |f| over the forces f of faces, of each draw (draws, p, 19): (draws, p, 3, 3), N."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(np.nan_to_num(draws[..., 13:]), -1, 0)
    rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _bounds(
    largest: float, mesh: Mesh, motion: Motion3D
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """The most that a force may be in each pose: every face with the largest alpha that is known."""
    force, moment = np.zeros((2, len(motion.frames)))
    for pose, (frame, rolling) in enumerate(zip(motion.frames, motion.rolling, strict=True)):
        _, load, _, _, arm = moving_faces(mesh, frame, rolling)
        is_finite = np.isfinite(frame).all()
        force[pose] = largest * load.sum() if is_finite else np.nan
        moment[pose] = (
            largest * (load * np.linalg.norm(arm, axis=-1)).sum() if is_finite else np.nan
        )
    nothing = np.zeros_like(force)
    return {name: (nothing, moment if name.startswith("moment") else force) for name in IN_SPACE}
