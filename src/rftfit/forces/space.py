"""Forces on a mesh in space, and the error of the law in space, which no measurement in the plane contains.

The faces of a mesh are its triangles, m of them. Frames are the poses of a motion, shape (p, 18): position (3, cm),
velocity (3, cm/s), rate of turning (3, rad/s), rotation matrix (9, row by row). The compiled kernel returns 19 sums
over the faces for each pose: columns 0 to 5 force and moment (`MESH_QUANTITIES`), 6 depth times area (cm^3) of the
faces that move out of the plane of their normal and the vertical, 7 to 9 the sizes of vertical parts, horizontal parts
and whole forces (N), 10 to 12 whole sizes times the arm (N cm), 13 to 18 the sum of f f^T / |f| over forces f (xx, yy,
zz, xy, xz, yz, N). A stack of draws is a profile whose parameters have a leading axis: alpha drawn within its errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray
from rftfit.forces import model_error as errors
from rftfit.forces.body_error import frame_states
from rftfit.forces.faces import (
    LAWS,
    LoadedFaces,
    as_table,
    face_alpha,
    moving_faces,
    share_read_near_pushes,
    turn_normals,
)
from rftfit.forces.mesh import IntArray, Mesh, Motion3D, area_vectors
from rftfit.forces.moving import (
    BestForces,
    BodyInMotion,
    DrawnForces,
    ForcesByName,
    WetParts,
    has_forces,
)
from rftfit.forces.peaks import ROUNDING, STEEP_DEG, BoundsByName, Peak, PeakTarget
from rftfit.model import rft3d
from rftfit.model.draws import end_names
from rftfit.model.packs import Pack
from rftfit.model.profiles import Profile, TableProfile

MESH_QUANTITIES = (
    *(f"force_{axis}_N" for axis in "xyz"),
    *(f"moment_{axis}_N_cm" for axis in "xyz"),
)
"""Columns of the forces on a mesh and of the moments about its reference point."""

CLOSURE = 0.044
"""Error of the measured law on a face that moves out of the plane of its normal and the vertical: root mean square of a
component over the largest alpha, on random leading faces, where 3D-RFT is the truth."""

NO_ELASTICITY = (0.0, 0.0, 0.0)
"""Argument `elastic` of `face_kernel.face_forces` for the plain law."""


def face_rows(mesh: Mesh) -> FloatArray:
    """Describe the faces to the compiled kernel, in the axes of the mesh, shape (m, 17).

    Columns: three corners (9, cm), centroid (3, cm), outward unit normal (3), area (cm^2), 1 for a sheet or 0 for a
    solid.
    """
    triangles = mesh.triangles
    normals = area_vectors(triangles)
    area = np.linalg.norm(normals, axis=-1)[:, None]
    unit = np.divide(normals, area, where=area > 0, out=np.zeros_like(normals))
    sheet = np.full_like(area, mesh.sheet)
    return np.hstack([triangles.reshape(-1, 9), triangles.mean(axis=1), unit, area, sheet])


def law_of(profile: Profile, law: str) -> tuple[Pack, float, FloatArray]:
    """Return the first arguments of `face_kernel.face_forces`: map, alpha_x(0, 0), and the coefficients of 3D-RFT.

    `law`: ``measured`` or ``3d-rft``. The arguments of the other law are empty or 0: by the shape of the coefficients,
    (3, 20) or (0, 0), the kernel knows which law to use.
    """
    choose("law", law, LAWS)
    if law == "measured":
        return as_table(profile).pack, float(profile.alpha(0.0, 0.0)[1]), np.zeros((0, 0))
    no_map = TableProfile(np.zeros((7, 13)), np.zeros((7, 13))).pack
    return no_map, 0.0, float(rft3d.level_of(profile)) * rft3d.COEFFICIENTS


def compiled_mesh_forces(
    profile: Profile,
    mesh: Mesh,
    motion: Motion3D,
    law: str = "measured",
    friction: float | None = None,
) -> FloatArray:
    """Return the sums over the faces in each pose by one profile, (p, 19), with the columns of the head of this module.

    `law`, `friction`: as in `rftfit.predict`; friction None: as the law states it.
    """
    faces = face_rows(mesh)
    return _sum_compiled(law_of(profile, law), faces, _all_faces(faces, motion), motion, friction)


def _all_faces(faces: FloatArray, motion: Motion3D) -> IntArray:
    """Return first row and the row behind the last of all faces for each pose, shape (p, 2): every pose sums every face."""
    return np.tile(np.array([0, len(faces)]), (len(motion.frames), 1))


def _sum_compiled(
    law: tuple[Pack, float, FloatArray],
    faces: FloatArray,
    ranges: IntArray,
    motion: Motion3D,
    friction: float | None,
) -> FloatArray:
    """Call the compiled kernel for the poses of a motion, and return its sums, shape (p, 19).

    `law`: from `law_of`. `faces`: rows of `face_rows`. `ranges`: first row of each pose and the row behind its last,
    (p, 2).
    """
    from rftfit.forces.face_kernel import face_forces

    frames = motion.frames
    sums = np.empty((len(frames), 19))
    limit = -1.0 if friction is None else float(friction)
    # the kernel writes into its last argument
    face_forces(
        *law, limit, faces, ranges, frames, motion.rolling, NO_ELASTICITY, np.zeros((0, 3)), sums
    )
    return sums


def mesh_draws(
    draws: Profile, mesh: Mesh, motion: Motion3D, law: str, friction: float | None
) -> FloatArray:
    """Return `compiled_mesh_forces` for each of a stack of draws, shape (draws, p, 19), with the columns of this module."""
    stack = as_table(draws)
    faces, ranges = _wet_faces(mesh, motion)
    shape = (-1, *stack.alpha_z.shape[-2:])
    sums = []
    # the kernel takes one table at a time
    for alpha in zip(stack.alpha_z.reshape(shape), stack.alpha_x.reshape(shape), strict=True):
        law_of_draw = law_of(TableProfile.of_nodes(stack.beta, stack.gamma, alpha), law)
        sums.append(_sum_compiled(law_of_draw, faces, ranges, motion, friction))
    return np.stack(sums)


def _wet_faces(mesh: Mesh, motion: Motion3D) -> tuple[FloatArray, IntArray]:
    """Return `face_rows` of the faces that reach below the surface, pose after pose, and the range of each pose, (p, 2).

    Most of a rolling wheel is dry, and need not be tested again for each draw. A face that is wet in several poses has
    a row for each. Where the rows would be too many for memory, or a frame lacks a number, all faces of all poses are
    summed.
    """
    faces, frames = face_rows(mesh), motion.frames
    if len(faces) * len(frames) > errors.MOST_AT_ONCE or not np.isfinite(frames).all():
        return faces, _all_faces(faces, motion)
    # the last row of a rotation, frame[15:], gives the height of a corner above the reference point, frame[2]
    lowest = np.stack([(mesh.triangles @ frame[15:]).min(axis=1) + frame[2] for frame in frames])
    # a corner at the surface by rounding, 1e-6 cm above it, stays in
    poses, wet = np.nonzero(lowest < 1e-6)
    return np.ascontiguousarray(faces[wet]), ranges_of(np.bincount(poses, minlength=len(frames)))


def ranges_of(counts: npt.ArrayLike) -> IntArray:
    """Return first row and the row behind the last of groups of rows that follow one another, shape (groups, 2).

    `counts`: rows of each group.
    """
    ends = np.cumsum(counts)
    return np.stack([ends - np.asarray(counts), ends], axis=-1)


class MeshInMotion(BodyInMotion):
    """A mesh that moves in space; `law` and `friction` as in `rftfit.predict`. Methods: see `BodyInMotion`."""

    with_interval = MESH_QUANTITIES
    force_names = MESH_QUANTITIES[:3]

    def __init__(
        self, mesh: Mesh, motion: Motion3D, law: str = "measured", friction: float | None = None
    ) -> None:
        self.mesh, self.motion, self.law, self.friction = mesh, motion, law, friction
        self.poses, self.columns = motion.frames, motion.columns

    def _sum_faces(self, profile: Profile) -> FloatArray:
        """Return the sums over the faces by one profile, shape (p, 19), with the columns of the head of this module."""
        return compiled_mesh_forces(profile, self.mesh, self.motion, self.law, self.friction)

    def best(self, profile: Profile) -> BestForces:
        """Integrate the forces by one profile in all poses, N and N cm, shape (p,)."""
        sums = self._sum_faces(profile)
        forces = _by_name(sums)
        why = profile.reason or "a position, rotation or velocity is missing"
        return BestForces(forces, "" if has_forces(forces).all() else why, sums[:, 6])

    def best_with_load(self, profile: Profile) -> DrawnForces:
        """Integrate the forces by one profile, with their load: in the form of a single draw, shape (1, p)."""
        return self._with_load(self._sum_faces(profile)[None])

    def draw(self, stack: Profile, *, with_load: bool) -> Iterator[DrawnForces]:
        """Integrate the forces by each of a stack of draws, over all poses at once: one item."""
        sums = mesh_draws(stack, self.mesh, self.motion, self.law, self.friction)
        yield self._with_load(sums) if with_load else DrawnForces(0, _by_name(sums))

    def _with_load(self, sums: FloatArray) -> DrawnForces:
        """Split sums over faces, shape (draws, p, 19), into forces and load; of a solid also the load by direction."""
        by_direction = None if self.mesh.sheet else _loads_by_direction(sums)
        return DrawnForces(0, _by_name(sums), _load_of(sums), by_direction)

    def poses_at_once(self, draws: int) -> int:
        """Return the number of poses whose draws are held in memory together."""
        # the load of a pose is a share of the largest of the whole motion, which is calculated at once
        return max(1, len(self.poses))

    def wet_parts(self) -> WetParts:
        """Return the load, depth, speed and position of the faces of all poses."""
        # of each pose an array (5, faces that bear a load): load, depth, speed, x, y
        columns_of_poses = []
        for frame, rolling in zip(self.poses, self.motion.rolling, strict=True):
            faces = moving_faces(self.mesh, frame, rolling)
            x, y, z = (frame[:3] + faces.arm_cm).T
            speed = np.linalg.norm(faces.velocity, axis=-1)
            columns_of_poses.append(np.stack([faces.load_cm3, -z, speed, x, y]))
        load, depth, speed, *horizontal = np.hstack(columns_of_poses)
        return WetParts(load, depth, speed, tuple(horizontal))

    @property
    def points_cm(self) -> FloatArray:
        """Points that span the body, shape (n, 3)."""
        return self.mesh.points_cm

    @property
    def states(self) -> FloatArray:
        """Turn, height and direction of motion in each pose, in correlation lengths of a body's error, shape (p, f)."""
        return frame_states(self.points_cm, self.poses)

    @property
    def progress(self) -> FloatArray:
        """Distance of each pose along the motion, in correlation lengths of the model's error, shape (p,)."""
        return errors.frames_progress(self.points_cm, self.poses)

    def model_errors(self, drawn: DrawnForces, paths: FloatArray, eps: float) -> ForcesByName:
        """Calculate errors of the force model by draw; `paths`: errors over eps and the load, shape (draws, 3, p)."""
        assert drawn.load is not None
        # a sheet errs as an outline does, on which the error was found; of a solid the error depends on the direction
        if self.mesh.sheet:
            return _by_name(errors.space_errors(drawn.load, paths, eps))
        assert drawn.by_direction is not None
        return _by_name(errors.directed_errors(drawn.load, drawn.by_direction, paths, eps))

    def body_errors(self, drawn: DrawnForces, paths: FloatArray) -> ForcesByName:
        """Calculate errors on a body that was measured before; `paths`: errors over the load, shape (draws, 3, p)."""
        assert drawn.load is not None
        return _by_name(errors.space_errors(drawn.load, paths, 1.0))

    def peak_targets(self, best: ForcesByName) -> list[PeakTarget]:
        """List the peaks to find: the largest size of each force and moment, with its sign."""
        return [
            PeakTarget(name.partition("_N")[0], name, _sign_of_largest(best[name]))
            for name in MESH_QUANTITIES
        ]

    def bounds(self, profile: Profile) -> BoundsByName:
        """Return for each quantity 0, and the most that it may be in each pose, (p,): no face counts as known.

        Every face bears at most its load (depth times area) times the largest alpha of the profile. NaN in poses whose
        frame lacks a number.
        """
        load, moment = np.full((2, len(self.poses)), np.nan)
        for pose in np.flatnonzero(np.isfinite(self.poses).all(axis=1)):
            faces = moving_faces(self.mesh, self.poses[pose], self.motion.rolling[pose])
            load[pose] = faces.load_cm3.sum()
            moment[pose] = faces.load_cm3 @ np.linalg.norm(faces.arm_cm, axis=-1)
        nothing, largest = np.zeros_like(load), _largest_alpha(profile)
        return {
            name: (nothing, largest * (load if name in self.force_names else moment))
            for name in MESH_QUANTITIES
        }

    def finish_columns(
        self, columns: dict[str, FloatArray], profile: Profile, best: BestForces
    ) -> dict[str, FloatArray]:
        """Return the columns of a prediction, each (p,), with rounding set to 0 and with ``closure_N``.

        Forces that symmetry cancels are not exactly 0 as sums over faces. ``closure_N``: error of a force if the
        measured law errs alike on all faces that leave the plane of their normal and the vertical; NaN by 3D-RFT.
        """
        finished = {
            name: np.where(np.abs(values) < self._least_size(name, best.forces), 0.0, values)
            for name, values in columns.items()
        }
        assert best.leaving_cm3 is not None
        closure = CLOSURE if self.law == "measured" else np.nan
        # + 0.0 so that nothing is called -0
        finished["closure_N"] = closure * _largest_alpha(profile) * (best.leaving_cm3 + 0.0)
        return finished

    def finish_peak(
        self, peak: Peak, profile: Profile, best: ForcesByName, columns: Mapping[str, FloatArray]
    ) -> Peak:
        """Return a peak without numbers that are rounding of the sum over faces, and withheld where it is steep.

        Rounding becomes 0. An end of an interval that is 0, or is cut off there because a peak has one sign, is moved
        to the farthest end of this interval in any pose: the largest force of a mesh may have either sign.
        """
        quantity = peak.quantity
        least = self._least_size(quantity, best)
        # column of the table for each end, by the field of `Peak`: lo, hi, model_lo, model_hi, next_lo, next_hi
        columns_of_ends: dict[str, str] = {}
        for kind in ("", "model_", "next_"):
            lo_column, hi_column = end_names(quantity, kind)
            columns_of_ends |= {f"{kind}lo": lo_column, f"{kind}hi": hi_column}
        changes: dict[str, Any] = {
            field: 0.0 for field in ("value", *columns_of_ends) if abs(getattr(peak, field)) < least
        }
        peak = replace(peak, **changes)
        for field, column in columns_of_ends.items():
            if getattr(peak, field) == 0 and column in columns:
                farthest = np.nanmin if field.endswith("lo") else np.nanmax
                changes[field] = float(farthest(columns[column], initial=0.0)) + 0.0
        peak = replace(peak, **changes)
        # by 3D-RFT alpha in one direction alone counts, and how it runs between pushes does not
        return self.withhold_if_steep(peak, profile, best) if self.law == "measured" else peak

    def turned_forces(self, profile: TableProfile, quantity: str, pose: int) -> FloatArray:
        """Integrate a force in one pose with all faces turned by -`STEEP_DEG` and by `STEEP_DEG`, N, shape (2, 2).

        Rows: turned about the axis x, about the axis y.
        """
        faces = moving_faces(self.mesh, self.poses[pose], self.motion.rolling[pose])
        either_way = [turn_normals(faces.area_vectors, sign * STEEP_DEG) for sign in (-1, 1)]
        forces = self._forces_along(quantity, profile, faces, np.stack(either_way, axis=1))
        return np.asarray(forces.sum(axis=-1))

    def sizes_near_pushes(
        self, profile: TableProfile, quantity: str, pose: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return sizes of a force on faces, N, and the share that is read near a push, shape (faces,)."""
        faces = moving_faces(self.mesh, self.poses[pose], self.motion.rolling[pose])
        forces = self._forces_along(quantity, profile, faces, faces.area_vectors)
        near = share_read_near_pushes(profile, faces.area_vectors, faces.velocity)
        return np.abs(forces), near

    def _forces_along(
        self, quantity: str, profile: TableProfile, faces: LoadedFaces, normals: FloatArray
    ) -> FloatArray:
        """Return the force of one column on each face, N, shape (..., faces).

        `normals`: those by which the map is read, shape (..., faces, 3), which may be turned; area and motion are not.
        """
        stress = face_alpha(
            profile,
            faces.area_vectors,
            faces.velocity,
            friction=self.friction,
            normal_of_map=normals,
        )
        return np.asarray(faces.load_cm3 * stress[..., self.force_names.index(quantity)])

    def _least_size(self, name: str, best: ForcesByName) -> float:
        """Return the size below which a force (N) or a moment (N cm) is rounding; 0 for another column.

        `name`: a column of the table. `best`: all forces and moments, shape (p,).
        """
        # the largest force and the largest moment of the motion
        force, moment = (
            float(np.fmax.reduce(np.abs([best[each] for each in names]), axis=None, initial=0.0))
            for names in (MESH_QUANTITIES[:3], MESH_QUANTITIES[3:])
        )
        if name.startswith("force"):
            return ROUNDING * force
        # all moments may be rounding: then the largest force at the farthest point is their measure
        reach_cm = float(np.linalg.norm(self.mesh.vertices_cm, axis=1).max())
        return ROUNDING * max(moment, force * reach_cm) if name.startswith("moment") else 0.0


def _largest_alpha(profile: Profile) -> float:
    """Largest hypot(alpha_z, alpha_x) of a profile over all directions, N/cm^3, those without a number left out."""
    table = as_table(profile)
    return float(np.fmax.reduce(np.hypot(table.alpha_z, table.alpha_x), axis=None))


def _by_name(forces: FloatArray) -> dict[str, FloatArray]:
    """Return the first six columns of sums over faces, or of errors, (..., 6 or 19), by their names, `MESH_QUANTITIES`."""
    return {name: forces[..., k] for k, name in enumerate(MESH_QUANTITIES)}


def _sign_of_largest(values: FloatArray) -> int:
    """Return 1 or -1, the sign of the value that is largest in size; NaN do not count."""
    sizes = np.nan_to_num(np.abs(values))
    return -1 if sizes.size and values[sizes.argmax()] < 0 else 1


def _load_of(sums: FloatArray) -> errors.Load:
    """Read the load without cancellation, and its centre, from sums over faces, shape (draws, p, 19)."""
    # sizes of vertical parts, of horizontal parts, of whole forces; then whole sizes times the arm x, y, z
    sizes = np.nan_to_num(sums[..., 7:13])
    total_load = sizes[..., 2]
    centre = sizes[..., 3:] / np.where(total_load > 0, total_load, 1.0)[..., None]
    loaded = (total_load > 0).any(axis=0).astype(float)
    size = errors.size_of(np.hypot(sizes[..., 0], sizes[..., 1])) * loaded
    return errors.Load(np.arange(sums.shape[1]), size, centre, loaded)


def _loads_by_direction(sums: FloatArray) -> FloatArray:
    """Read the sum of f f^T / |f| over forces f of faces, (draws, p, 3, 3), N, from sums over faces, (draws, p, 19)."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(np.nan_to_num(sums[..., 13:]), -1, 0)
    rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
