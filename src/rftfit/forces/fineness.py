"""How finely a body that turns is cut.

The force on a part of a body (an element or a triangle) is that of its middle. Where the body does not turn that is
exact; where it turns, the velocity differs along a long part, and the force is wrong: on a box of 12 triangles by a
factor.

The cut depends on the body alone, not on the motion: a pose has the same forces whatever the other poses are.
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


def fine_enough(body: Body, motion: Motion | Motion3D) -> Body:
    """Halve the edges of a body that turns until none is too long; a body that does not turn is returned as it is."""
    rates = motion.frames[:, 6:9] if isinstance(motion, Motion3D) else motion.poses[:, 5]
    longest_cm = longest_edge_cm(body)
    if not rates.any() or not (body.edges_cm > longest_cm).any():
        return body
    return cast("Body", body.refined(longest_cm))


def longest_edge_cm(body: Outline | Mesh) -> float:
    """Return the longest edge that a body may have where it turns, cm."""
    # from the shortest: the second of two sides is the longer one, the second of three the middle
    # one
    sides_cm = np.sort(np.ptp(body.points_cm, axis=0))
    if isinstance(body, Mesh):
        return float(sides_cm[1]) / EDGES_ACROSS_MESH
    return float(sides_cm[1]) / EDGES_ACROSS_OUTLINE
