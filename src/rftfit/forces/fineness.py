"""Fineness of a body: the longest edge that its elements or triangles may have for its motion, and the cut to it.

The force on a part of a body (an element or a triangle) is that of its middle, and acts there. Where the body turns,
the velocity differs along a long part, and the force is wrong: on a box of 12 triangles by a factor. Where it does not
turn the force is exact, but it acts below the middle, since stress grows with depth: of a slanted sole of two triangles
the moment is wrong by a factor. An outline has many elements, so its moment is right without a cut.

The cut depends on the body, and on whether it turns: a pose has the same forces whatever the other poses are.
"""

from __future__ import annotations

from typing import TypeVar, cast

import numpy as np

from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.outlines import Outline

Body = TypeVar("Body", bound=Outline | Mesh)

EDGES_ACROSS_OUTLINE = 12
"""Fewest elements along the longer side of an outline: peaks of boxes and plates that turn are then within 2.5 % of finer ones."""

EDGES_ACROSS_MESH = 5
"""Fewest edges along the second longest side of a mesh, because a mesh may turn about the longest one: within 2.5 %, as
above (`tests/space/test_space_fineness.py`).

Errors of many faces cancel more than those of a line of elements do.
"""


EDGES_ACROSS_ROOT_OF_AREA = 12
"""Fewest edges along the root of the area of a mesh that does not turn: a size that is the same however the mesh lies.
Moments of a wedge are then within 0.5 % of those of finer ones (`tests/space/test_space_fineness.py`)."""


def fine_enough(body: Body, motion: Motion | Motion3D) -> Body:
    """Return a body whose edges are halved until none is too long for its motion; one that is fine enough as it is.

    Edges are the elements of an outline, or the sides of the triangles of a mesh.
    """
    rates = motion.frames[:, 6:9] if isinstance(motion, Motion3D) else motion.poses[:, 5]
    if rates.any():
        longest_cm = longest_edge_allowed_cm(body)
    elif isinstance(body, Mesh):
        longest_cm = float(np.sqrt(body.area_cm2)) / EDGES_ACROSS_ROOT_OF_AREA
    else:
        return body
    if not (body.edges_cm > longest_cm).any():
        return body
    return cast("Body", body.refined(longest_cm))


def longest_edge_allowed_cm(body: Outline | Mesh) -> float:
    """Return the longest edge that a body may have where it turns, cm: a share of its second longest extent."""
    # from the shortest: the second of two sides is the longer one, the second of three the middle one
    second_side_cm = float(np.sort(np.ptp(body.points_cm, axis=0))[1])
    return second_side_cm / (EDGES_ACROSS_MESH if isinstance(body, Mesh) else EDGES_ACROSS_OUTLINE)
