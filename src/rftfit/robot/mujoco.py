"""Any robot in MuJoCo on a measured medium: forces on its geoms at each step.

`attach` cuts the geoms (the shapes of MuJoCo's bodies) into meshes and puts them on a `Ground`, which calculates the
forces; `MujocoGround` hands poses and forces to and fro. MuJoCo has SI units, `Ground` has cm: hence the factors of
100.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.forces.mesh import Mesh
from rftfit.model.profiles import KnownMedium
from rftfit.robot.ground import ALONG_Y, Ground


class MujocoGround:
    """A medium under a robot of MuJoCo, returned by `attach`; `step` advances the robot.

    `model`, `data`: of MuJoCo. `bodies`: MuJoCo's numbers of the bodies on which the medium acts. `frames`, `forces`
    and `rules` of these bodies, in this order: as in `Ground`, in cm and N. `n_faces`: number of triangles of all
    bodies.
    """

    def __init__(self, model: Any, data: Any, bodies: Sequence[int], ground: Ground) -> None:
        self.model, self.data = model, data
        self.bodies = np.array(bodies)
        self._ground = ground
        self.frames, self.forces = ground.frames, ground.forces
        self.n_faces = ground.n_faces
        self.rules = ground.rules
        ground.check_time_step(float(model.opt.timestep))

    def step(self) -> None:
        """Advance the robot by one time step with the forces of the medium.

        The forces are written to ``data.xfrc_applied`` of the bodies on which the medium acts.
        """
        import mujoco

        mujoco.mj_step1(self.model, self.data)
        self.apply()
        mujoco.mj_step2(self.model, self.data)

    def apply(self) -> None:
        """Write the forces at the present places and velocities to ``data.xfrc_applied``, for who steps MuJoCo himself.

        Call it once a step between ``mj_step1``, which finds places and velocities, and ``mj_step2``, which moves on.
        """
        model, data, bodies = self.model, self.data, self.bodies
        # cvel: angular velocity, then velocity
        rate = data.cvel[bodies, :3]
        # cvel is the velocity at the centre of mass of the whole tree: moved to the origin of each body
        arm = data.xpos[bodies] - data.subtree_com[model.body_rootid[bodies]]
        velocity = data.cvel[bodies, 3:] + np.cross(rate, arm)
        rotation = data.xmat[bodies].reshape(-1, 3, 3)
        forces = self._ground.step(
            100 * data.xpos[bodies], rotation, 100 * velocity, rate, float(model.opt.timestep)
        )
        # xfrc_applied acts at the centre of mass of a body, the forces are about its origin
        force, arm = forces[:, :3], data.xpos[bodies] - data.xipos[bodies]
        moment = forces[:, 3:] / 100 + np.cross(arm, force)
        data.xfrc_applied[bodies] = np.hstack([force, moment])


def attach(
    model: Any,
    data: Any,
    medium: KnownMedium | str | Path,
    geoms: Sequence[str] | None = None,
    *,
    meshes: Mapping[str, Mesh] | None = None,
    law: str = "measured",
    friction: float | None = None,
    triangle_cm: float = 0.5,
    delta_mm: float = 0.3,
    tau_s: float = 0.002,
    wheels: Sequence[str] = (),
    track: bool = True,
) -> MujocoGround:
    """Put a robot on a measured medium, whose surface is z = 0 of MuJoCo's world.

    Parameters
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        As for `Ground`.
    geoms : sequence of str, optional
        Names of geoms on which the medium acts. Default: all that collide and move; none if `meshes` are given.
    meshes : mapping of str to Mesh, optional
        Further shapes by name of the body, in its frame, for example sheets.
    law, friction : optional
        As for `predict`.
    triangle_cm : float, optional
        Longest edge of a triangle.
    delta_mm, tau_s : float, optional
        Elastic displacement of a face, and time for which its velocity is extrapolated: with these a robot at rest does
        not creep. 0: the plain law. No measurement gives delta: compare results with a third of it and with three times
        it.
    wheels : sequence of str, optional
        Names of bodies that are wheels. The axle is the hinge of the body, which must go through its origin; for a body
        without a hinge it is y of its frame. A wheel that is not convex leaves a rut, as in `Ground`.
    track : bool, optional
        As for `Ground`.

    Returns
    -------
    MujocoGround

    Raises
    ------
    InputError
        If mujoco is missing, a name is unknown, a plane or height field would carry the geoms too, the integrator is
        RK4, or the time step is too long (``tau_s`` times the step: at most 2e-6 s^2; a step of at most 1 ms is
        advised).
    """
    try:
        import mujoco
    except ImportError:
        raise InputError("robots in MuJoCo need it: pip install 'rftfit[mujoco]'") from None
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise InputError(
            "integrator RK4 does not step in two halves; allowed: Euler, implicit, implicitfast"
        )
    # `chosen`: numbers of the geoms on which the medium acts
    names = {model.geom(number).name: number for number in range(model.ngeom)}
    if geoms is None and meshes is None:
        collides = (model.geom_contype | model.geom_conaffinity) != 0
        # a body that is welded to the world does not move
        moves = model.body_weldid[model.geom_bodyid] != 0
        chosen = np.flatnonzero(collides & moves).tolist()
    else:
        chosen = [names[choose("geom", name, tuple(names))] for name in geoms or ()]
    # a floor of MuJoCo would carry the robot besides the medium
    flat = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    floors = np.flatnonzero(np.isin(model.geom_type, flat))
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    for floor, geom in product(floors, chosen):
        # MuJoCo's condition for a contact of two geoms
        if contype[floor] & conaffinity[geom] | contype[geom] & conaffinity[floor]:
            raise InputError(
                f"geom {model.geom(floor).name or floor} is a floor that would carry geom "
                f"{model.geom(geom).name or geom} too: take it out, or set its contype and conaffinity to 0"
            )
    # meshes in the frame of their body, by number of the body
    bodies: dict[int, list[Mesh]] = {}
    for geom in chosen:
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        shape = _mesh_of_geom(mujoco.mjtGeom, model, geom)
        placed = shape.moved(rotation.reshape(3, 3), 100 * model.geom_pos[geom])
        bodies.setdefault(int(model.geom_bodyid[geom]), []).append(placed)
    for name, mesh in (meshes or {}).items():
        body = choose("body", name, tuple(model.body(number).name for number in range(model.nbody)))
        bodies.setdefault(model.body(body).id, []).append(mesh)
    if not bodies:
        raise InputError("no geom that collides and moves; allowed: geoms=[...], by name")
    # `Ground` counts only these bodies: its number of a body is the place of MuJoCo's number in this list
    numbers = sorted(bodies)
    body_names = tuple(model.body(number).name for number in numbers)
    chosen_wheels = [
        numbers[body_names.index(choose("wheel", name, body_names))] for name in wheels
    ]
    axles = {numbers.index(body): _find_axle(mujoco, model, body) for body in chosen_wheels}
    ground = Ground(
        medium,
        [bodies[number] for number in numbers],
        law=law,
        friction=friction,
        triangle_cm=triangle_cm,
        delta_mm=delta_mm,
        tau_s=tau_s,
        wheels=axles,
        track=track,
    )
    return MujocoGround(model, data, numbers, ground)


def _find_axle(mujoco: Any, model: Any, body: int) -> FloatArray:
    """Return the direction of the axle of a wheel, shape (3,), in the frame of its body: the axis of its only hinge.

    Without a hinge it is y. `mujoco`: the module. `body`: MuJoCo's number of the body. Raises InputError for several
    hinges or one beside the body's origin, since `Ground` puts the axle through the origin.
    """
    first, count = model.body_jntadr[body], model.body_jntnum[body]
    joints = range(first, first + count)
    hinges = [joint for joint in joints if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE]
    if not hinges:
        return np.array(ALONG_Y)
    name = model.body(body).name
    if len(hinges) > 1:
        raise InputError(f"wheel {name} has {len(hinges)} hinges; allowed: one, its axle")
    axis, anchor = model.jnt_axis[hinges[0]], model.jnt_pos[hinges[0]]
    rounding_m = 1e-6
    if np.linalg.norm(np.cross(anchor, axis)) > rounding_m:
        raise InputError(
            f"wheel {name}: its hinge does not go through the body's origin; set pos of the joint to 0 and move the body"
        )
    return np.asarray(axis, dtype=float)


_FACETS = 17
"""Latitudes of a round geom: odd, so that a capsule is a sphere whose halves are moved apart."""


def _mesh_of_geom(kinds: Any, model: Any, geom: int) -> Mesh:
    """Return the mesh of a geom in its frame, cm, since `Ground` takes only meshes.

    `kinds`: ``mujoco.mjtGeom``, which names the kinds of geom. `geom`: MuJoCo's number of it. Raises InputError for a
    kind without a closed shape, such as a plane. In MuJoCo a cylinder or capsule lies along z, and ``geom_size`` has
    half lengths: of a box along x, y, z; of an ellipsoid the half axes; of the others radius, then half the height.
    """
    kind, size = kinds(int(model.geom_type[geom])), 100 * model.geom_size[geom]
    name = model.geom(geom).name or f"geom {geom}"
    if kind == kinds.mjGEOM_MESH:
        # the meshes of all geoms stand one after the other in two arrays, corners and faces
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        start, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        try:
            return Mesh(
                100 * model.mesh_vert[first : first + count],
                model.mesh_face[start : start + faces],
                name,
            )
        except ValueError as error:
            raise InputError(f"geom {name}: {error}") from None
    if kind == kinds.mjGEOM_BOX:
        corners = size * np.array(list(product((-1, 1), repeat=3)))
        # two triangles for each side, by number of the corner, counted so that their normals point outward
        faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                 [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
        return Mesh(corners, faces, name)
    if kind == kinds.mjGEOM_CYLINDER:
        along_y = Mesh.cylinder(size[0], 2 * size[1], 4 * _FACETS)
        # turned from y to z
        return along_y.moved(np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3))
    ball = Mesh.sphere(1.0, _FACETS)
    if kind == kinds.mjGEOM_ELLIPSOID:
        return Mesh(ball.vertices_cm * size, ball.faces, name)
    if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE):
        # half the length of the straight part of a capsule
        half = size[1] if kind == kinds.mjGEOM_CAPSULE else 0.0
        points = size[0] * ball.vertices_cm
        return Mesh(points + [0, 0, half] * np.sign(points[:, 2:]), ball.faces, name)
    raise InputError(f"geom {name} is of a kind without a shape: meshes={{...}} gives its body one")
