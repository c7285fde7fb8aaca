"""Forces on a mesh with their intervals, and beside them what no measurement in the plane contains."""

from __future__ import annotations

import numpy as np
import pandas as pd

from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray
from rftfit.model import rft3d
from rftfit.model.draws import end_names, interval
from rftfit.model.faces import LAWS, as_table
from rftfit.model.mesh import Mesh, Motion3D, area_vectors
from rftfit.model.profiles import FourierProfile, Pack, Profile, TableProfile
from rftfit.model.scaling import ScaledMedium

IN_SPACE = (*(f"force_{axis}_N" for axis in "xyz"), *(f"moment_{axis}_N_cm" for axis in "xyz"))

CLOSURE = 0.044
"""Error of the measured law on a face that leaves its plane, rms of a component over the largest alpha, where
3D-RFT is the truth, over random leading faces."""

NO_ELASTICITY = (0.0, 0.0, 0.0)


def describe(mesh: Mesh) -> FloatArray:
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


def mesh_forces(
    profile: Profile, mesh: Mesh, motion: Motion3D, law: str = "measured", friction: float | None = None,
) -> FloatArray:  # fmt: skip
    """Force (N), moment about the reference point (N cm), and depth times area that leaves its plane: (p, 7)."""
    return _forces(law_of(profile, law), describe(mesh), motion, friction)


def _forces(
    law: tuple[Pack, float, FloatArray], faces: FloatArray, motion: Motion3D, friction: float | None
) -> FloatArray:
    from rftfit.model.face_kernel import face_forces

    frames = motion.frames
    ranges = np.tile(np.array([0, len(faces)]), (len(frames), 1))
    result = np.empty((len(frames), 7))
    limit = -1.0 if friction is None else float(friction)
    face_forces(*law, limit, faces, ranges, frames, NO_ELASTICITY, np.zeros((0, 3)), result)
    return result


def mesh_draws(
    draws: Profile, mesh: Mesh, motion: Motion3D, law: str, friction: float | None
) -> FloatArray:
    """`mesh_forces` for each of a stack of draws, without the last column: (draws, p, 6)."""
    stack, faces = as_table(draws), describe(mesh)
    shape = (-1, *stack.alpha_z.shape[-2:])
    alpha = zip(stack.alpha_z.reshape(shape), stack.alpha_x.reshape(shape), strict=True)
    each = (TableProfile.of_nodes(stack.beta, stack.gamma, one) for one in alpha)
    return np.stack([_forces(law_of(one, law), faces, motion, friction)[:, :6] for one in each])


def predict_mesh(
    profile: Profile, mesh: Mesh, motion: Motion3D, confidence: float = 0.95, law: str = "measured",
    friction: float | None = None,
) -> pd.DataFrame:  # fmt: skip
    """`rftfit.predict` of a mesh."""
    best = mesh_forces(profile, mesh, motion, law, friction)
    ends = None
    if isinstance(profile.spread, Profile):
        ends = interval(mesh_draws(profile.spread, mesh, motion, law, friction), confidence)
    elif isinstance(profile.spread, ScaledMedium):
        medium = profile.spread.at(confidence)
        unit = mesh_forces(FourierProfile(medium.reference.m0), mesh, motion, law, friction)[:, :6]
        each = mesh_draws(FourierProfile(medium.reference.scaled), mesh, motion, law, friction)
        ends = medium.with_interval(unit, each)[1:]
    columns = dict(motion.columns)
    for k, name in enumerate(IN_SPACE):
        columns[name] = best[:, k]
        if ends is not None:
            columns |= {end: ends[side][:, k] for side, end in enumerate(end_names(name))}
    table = as_table(profile)
    largest = float(np.fmax.reduce(np.hypot(table.alpha_z, table.alpha_x), axis=None))
    columns["closure_N"] = (CLOSURE if law == "measured" else np.nan) * largest * best[:, 6]
    unknown = np.isnan(best[:, :6]).any(axis=1)
    why = profile.reason or "a position, rotation or velocity is missing"
    return pd.DataFrame(columns | {"reason": np.where(unknown, why, "")})
