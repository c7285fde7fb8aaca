"""Body and motion put together as a `BodyInMotion`, in the plane or in space."""

from __future__ import annotations

from collections.abc import Sequence

from rftfit.forces.fineness import fine_enough
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion, rotation
from rftfit.forces.moving import BodyInMotion
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import QUANTITIES, OutlineInMotion
from rftfit.forces.space import MeshInMotion


def set_in_motion(
    body: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    law: str = "measured",
    friction: float | None = None,
    quantities: Sequence[str] = QUANTITIES,
) -> BodyInMotion:
    """Return an outline with its `Motion` (default: the rotation of the paper's trials) or a mesh with its `Motion3D`.

    The body is cut as finely as its forces and moments need (`fine_enough`). `law`: for a mesh, ``measured`` (alpha in
    all directions) or ``3d-rft`` (from alpha_z(0, 90 deg) alone). `friction`: for a mesh, most stress along a face over
    that across it; None: as the law states it. `quantities`: columns of forces and moment of an outline that get an
    interval; a mesh has intervals of all. Raises TypeError where body and motion do not go together.
    """
    if isinstance(body, Mesh):
        if not isinstance(motion, Motion3D):
            raise TypeError("a mesh moves in space: its motion is a Motion3D")
        return MeshInMotion(fine_enough(body, motion), motion, law, friction)
    if isinstance(motion, Motion3D):
        raise TypeError("an outline moves in the plane; Mesh.extrude makes a mesh of it")
    motion = rotation() if motion is None else motion
    return OutlineInMotion(fine_enough(body, motion), motion, quantities)
