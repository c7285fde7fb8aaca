"""Forces of a measured medium on the bodies of any simulator, calculated at each time step (`Ground`).

Here all is in cm, s and N; z is up and 0 at the surface. The surface of each body is cut into faces, flat triangles. A
wheel leaves a rut if it is not convex: behind its axle there is nothing that its faces could push
(`rftfit.forces.rolling`).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rftfit.conventions import QUASI_STATIC_CM_PER_S, FloatArray
from rftfit.errors import InputError, LimitWarning
from rftfit.forces.limits import depth_measured, describe_depth, describe_speed
from rftfit.forces.mesh import Mesh
from rftfit.forces.rolling import (
    NO_RULE,
    NO_WHEEL,
    TRACK_RULE,
    fills_hull,
    measure_radius,
    rolling_rows,
)
from rftfit.forces.space import face_rows, law_of, ranges_of
from rftfit.model.known import profile_of
from rftfit.model.profiles import KnownMedium, Profile

MOST_TAU_DT_S2 = 2e-6
"""Largest product of `tau_s` and the time step, s^2, with which a robot at rest neither creeps nor shakes."""


class Ground:
    """A medium, below z = 0, under n bodies.

    The forces follow from the mean alpha of the medium, without intervals, because another force would change the
    further motion. For the spread of the result of a simulation, run it in several media: ``profile.spread`` holds
    draws of alpha. For one motion that is known beforehand `predict` gives intervals.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        As for `predict`: what `scale` returns, a medium of `open`, the path of a profile file ... For a medium of a
        campaign its table, or its map if the table has holes.
    bodies : sequence of Mesh, or of sequences of Mesh
        Shape of each body in its own frame, cm: one mesh, or several that move together.
    law, friction : optional
        As for `predict`.
    triangle_cm : float, optional
        Longest edge of a triangle.
    delta_mm, tau_s : float, optional
        Elastic displacement of a face (delta), and time for which its velocity is extrapolated (tau): with these a body at
        rest does not creep. 0: the plain law. No measurement gives delta: compare results with a third of it and with
        three times it.
    wheels : sequence of int, or mapping of int to array_like, shape (3,), optional
        Numbers of the bodies that are wheels. The axle goes through the origin of the body, along y of its frame or
        along the vector of the mapping. A wheel that is not convex leaves a rut, as in `Motion3D.roll`: behind its
        axle, faces that face back do not count.
    track : bool, optional
        False: wheels leave no rut.

    Attributes
    ----------
    frames : ndarray, shape (n, 18)
        Places and motions of the bodies at the last step, as in `Motion3D.frames`: position (3 columns, cm), velocity
        (3, cm/s), angular velocity (3, rad/s), and the rows of the rotation matrix from the body's axes to the world's (9).
    rules : tuple of str
        ``own-track`` (leaves a rut) or ``none``, for each body.
    forces : ndarray, shape (n, 7)
        Force (N), moment about the body's origin (N cm) in the world's axes, and `closure_cm3`, at the last step. The
        last is depth times area of the faces that move out of their own plane, for which no measurement stands.

    Raises
    ------
    InputError
        If there is no body, the law is unknown, or a wheel is not round about its axle.

    Warns
    -----
    LimitWarning
        One warning each, at the first step in which a body in the medium is deeper than alpha was measured, or faster
        than quasi-static (50 cm/s).

    Examples
    --------
    >>> import numpy as np
    >>> import rftfit
    >>> ground = rftfit.Ground(rftfit.published_medium("poppy_LP"), [rftfit.Mesh.sphere(2)])
    >>> for depth_cm in np.linspace(0, 1, 101):
    ...     forces = ground.step([[0, 0, 2 - depth_cm]], np.eye(3), [[0, 0, -10]], [[0, 0, 0]], 0.001)
    >>> round(float(forces[0, 2]), 1)  # N
    1.6
    """

    def __init__(
        self,
        medium: KnownMedium | str | Path,
        bodies: Sequence[Mesh | Sequence[Mesh]],
        *,
        law: str = "measured",
        friction: float | None = None,
        triangle_cm: float = 0.5,
        delta_mm: float = 0.3,
        tau_s: float = 0.002,
        wheels: Sequence[int] | Mapping[int, npt.ArrayLike] = (),
        track: bool = True,
    ) -> None:
        from rftfit.forces.face_kernel import face_forces

        if not bodies:
            raise InputError("no body; allowed: a mesh for each body that touches the medium")
        # meshes of each body, then the faces of each body as rows for the kernel
        shapes = [[body] if isinstance(body, Mesh) else body for body in bodies]
        faces = [
            np.concatenate([face_rows(mesh.refined(triangle_cm)) for mesh in meshes])
            for meshes in shapes
        ]
        # of each body the first row of its faces and the row behind the last, shape (n, 2)
        self._ranges = ranges_of([len(faces_of_body) for faces_of_body in faces])
        self._faces = np.concatenate(faces)
        # elastic displacement of each face, which the kernel keeps up to date
        self._shifts = np.zeros((len(self._faces), 3))
        self._delta_cm, self._tau_s = delta_mm / 10, tau_s
        profile = profile_of(medium)
        self._limits = _Limits(profile, shapes)
        self._law = law_of(profile, law)
        # for the kernel -1 stands for None: the friction of the measured plates
        self._friction = -1.0 if friction is None else float(friction)
        self._kernel: Any = face_forces
        # direction of the axle by number of the body
        axles = wheels if isinstance(wheels, Mapping) else dict.fromkeys(wheels, ALONG_Y)
        self._wheels, self._radii, has_track = _measure_wheels(shapes, axles)
        self._has_track = has_track & track
        # recent horizontal travel of each wheel, see `_follow_wheels`
        self._travel_cm = np.zeros((len(self._wheels), 2))
        # rows of `rolling_rows` for the kernel; 0 for bodies that are no wheels
        self._rolling = np.zeros((len(faces), len(NO_WHEEL)))
        rules = np.full(len(faces), NO_RULE, dtype=object)
        rules[self._wheels[self._has_track]] = TRACK_RULE
        self.rules = tuple(rules)
        self.frames, self.forces = np.zeros((len(faces), 18)), np.zeros((len(faces), 7))

    @property
    def n_faces(self) -> int:
        """Number of triangles of all bodies."""
        return len(self._faces)

    def check_time_step(self, time_step_s: float) -> None:
        """Raise `InputError` if a body at rest would creep or shake with this time step (`MOST_TAU_DT_S2`)."""
        if self._delta_cm > 0 and self._tau_s * time_step_s > MOST_TAU_DT_S2 * (1 + 1e-9):
            raise InputError(
                f"tau_s = {self._tau_s:g} s times the time step of {time_step_s:g} s is too long; allowed: "
                f"a product of {MOST_TAU_DT_S2:g} s^2, as 0.002 s times 0.001 s"
            )

    def step(
        self,
        position_cm: npt.ArrayLike,
        rotation: npt.ArrayLike,
        velocity_cm_per_s: npt.ArrayLike,
        rate_rad_per_s: npt.ArrayLike,
        time_step_s: float,
    ) -> FloatArray:
        """Return the forces of the medium on the bodies in their present places and motions.

        Call this method once for each time step: the elastic displacements of the faces are kept from call to call.

        Parameters
        ----------
        position_cm, velocity_cm_per_s : array_like, shape (n, 3)
            Place and velocity of the origin of each body's frame, in the world's axes; z is up and 0 at the surface.
        rotation : array_like, shape (n, 3, 3)
            Rotation matrix from the body's axes to the world's.
        rate_rad_per_s : array_like, shape (n, 3)
            Angular velocity, in the world's axes.
        time_step_s : float
            Time since the last call.

        Returns
        -------
        ndarray, shape (n, 6)
            Force (N) and moment about the body's origin (N cm), in the world's axes.

        Raises
        ------
        InputError
            If the time step is too long for `tau_s`.
        """
        self.check_time_step(time_step_s)
        count = len(self.frames)
        self.frames[:, :3] = position_cm
        self.frames[:, 3:6] = velocity_cm_per_s
        self.frames[:, 6:9] = rate_rad_per_s
        self.frames[:, 9:] = np.reshape(rotation, (count, 9))
        if self._wheels.size:
            self._follow_wheels(time_step_s)
        self._kernel(
            *self._law,
            self._friction,
            self._faces,
            self._ranges,
            self.frames,
            self._rolling,
            (time_step_s, self._delta_cm, self._tau_s),
            self._shifts,
            self.forces,
        )
        for limit in self._limits.list_new(self.frames, self.forces):
            warnings.warn(limit, LimitWarning, stacklevel=2)
        return self.forces[:, :6].copy()

    def _follow_wheels(self, time_step_s: float) -> None:
        """Update the rows of `_rolling` of all wheels: direction of travel, and how far the rule of the rut holds.

        A wheel nearly at rest trembles, and its velocity points anywhere; a rut that turns with it would keep it in
        motion. So the direction is that of the recent travel, which is kept up to a length of delta. The length of this
        travel as a share of delta, `begun` (0 to 1), is how far the wheel has begun to roll: a wheel at rest has no
        rut, and gets one gradually.
        """
        velocity, rate = self.frames[self._wheels, 3:6].copy(), self.frames[self._wheels, 6:9]
        begun = np.ones(len(velocity))
        if self._delta_cm > 0:
            level = velocity[:, :2].copy()
            self._travel_cm += level * time_step_s
            length = np.linalg.norm(self._travel_cm, axis=1)
            # travel longer than delta is shortened to it
            self._travel_cm /= np.maximum(length / self._delta_cm, 1.0)[:, None]
            # extrapolated by tau as the faces are, which damps; the speed stays the present one
            ahead = self._travel_cm + self._tau_s * level
            length = np.linalg.norm(ahead, axis=1)
            speed = np.linalg.norm(level, axis=1)
            velocity[:, :2] = ahead * (speed / np.where(length > 0, length, 1.0))[:, None]
            begun = np.minimum(length / self._delta_cm, 1.0)
        self._rolling[self._wheels] = rolling_rows(
            velocity, rate, self._radii, begun * self._has_track, begun
        )


class _Limits:
    """Limits of depth and speed of the model, each of which is reported once.

    `most_cm`, `most_cm_per_s`: the limits; infinite from the moment when any body exceeds them. `clause`: on the depth
    to which alpha was measured, for a sentence. `corners_cm`: corners (k, 3) of each body in its frame; `radii_cm`:
    distance of the farthest corner of each from its origin.
    """

    def __init__(self, profile: Profile, shapes: Sequence[Sequence[Mesh]]) -> None:
        self.corners_cm = [
            np.concatenate([mesh.vertices_cm for mesh in meshes]) for meshes in shapes
        ]
        self.radii_cm = np.array(
            [np.linalg.norm(corners, axis=1).max() for corners in self.corners_cm]
        )
        self.most_cm, self.clause = depth_measured(profile)
        self.most_cm_per_s = QUASI_STATIC_CM_PER_S

    def list_new(self, frames: FloatArray, forces: FloatArray) -> list[str]:
        """Return sentences on the limits that a body exceeds for the first time, and lift these limits.

        `frames`, `forces`: of all bodies, as in `Ground`. A body without a force, which is not in the medium, does not
        count.
        """
        # bounds of depth and speed of any point of a body, whatever its rotation: a quick test before all corners
        depths = self.radii_cm - frames[:, 2]
        rates = np.sqrt((frames[:, 6:9] ** 2).sum(axis=1))
        speeds = np.sqrt((frames[:, 3:6] ** 2).sum(axis=1)) + rates * self.radii_cm
        may_exceed = (depths > self.most_cm) | (speeds > self.most_cm_per_s)
        if not may_exceed.any():
            return []
        limits = []
        for body in np.flatnonzero(may_exceed & forces[:, :3].any(axis=1)):
            frame = frames[body]
            # from the origin of the body to its corners, in the world's axes
            arms = self.corners_cm[body] @ frame[9:].reshape(3, 3).T
            depth = -(frame[2] + arms[:, 2])
            speed = np.linalg.norm(frame[3:6] + np.cross(frame[6:9], arms), axis=1)
            deepest, fastest = float(depth.max()), float(speed[depth > 0].max(initial=0.0))
            if deepest > self.most_cm:
                self.most_cm = np.inf
                limits.append(describe_depth(deepest, self.clause))
            if fastest > self.most_cm_per_s:
                self.most_cm_per_s = np.inf
                limits.append(describe_speed(fastest))
        return limits


ALONG_Y = (0.0, 1.0, 0.0)
"""Axle of a wheel for which no other direction is given."""


def _measure_wheels(
    shapes: Sequence[Sequence[Mesh]], axles: Mapping[int, npt.ArrayLike]
) -> tuple[npt.NDArray[np.int64], FloatArray, npt.NDArray[np.bool_]]:
    """Return the numbers of the bodies that are wheels, their radii (cm), and True for wheels that leave a rut.

    `shapes`: meshes of each body. `axles`: direction of the axle by number of the body. A rut is left by a solid wheel
    that does not fill its convex hull; of a sheet, which has no volume, this cannot be told.
    """
    radii, has_track = [], []
    for number, axle in axles.items():
        if not 0 <= number < len(shapes):
            raise InputError(f"wheels: found body {number}; allowed: 0 to {len(shapes) - 1}")
        corners = np.concatenate([mesh.vertices_cm for mesh in shapes[number]])
        try:
            # the radius is measured about y: the corners are turned there
            radii.append(measure_radius(corners @ _turn_to_y(axle).T))
        except ValueError as error:
            raise InputError(f"wheels: body {number}: {error}") from None
        volume = sum(mesh.volume_cm3 for mesh in shapes[number])
        is_solid = not any(mesh.sheet for mesh in shapes[number])
        has_track.append(is_solid and not fills_hull(corners, volume))
    return np.array([*axles], dtype=np.int64), np.array(radii), np.array(has_track, dtype=bool)


def _turn_to_y(axle: npt.ArrayLike) -> FloatArray:
    """Return a rotation matrix that turns the direction of an axle to the y axis; its rows are the turned axes."""
    axis = np.asarray(axle, dtype=float)
    length = float(np.linalg.norm(axis)) if axis.shape == (3,) else 0.0
    if not (length > 0 and np.isfinite(length)):
        raise InputError(f"wheels: an axle of three numbers wanted, found {axle!r}")
    along = axis / length
    # of x, y and z the axis farthest from the axle, so that the cross product, at right angles to both, is not near 0
    farthest_axis = np.eye(3)[np.abs(along).argmin()]
    ahead = np.cross(along, farthest_axis)
    ahead /= np.linalg.norm(ahead)
    return np.stack([ahead, along, np.cross(ahead, along)])
