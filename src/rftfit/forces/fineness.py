"""How finely a body is cut.

The force on a part of a body (an element or a triangle) is that of its middle, and acts there. Where the body does not
turn the force is exact, but it acts below the middle, since stress grows with depth: of two triangles of a slanted sole
the moment is wrong by a factor. Where the body turns, the velocity differs along a long part, and the force is wrong too.

The cut depends on the body alone, not on the motion: a pose has the same forces whatever the other poses are.
"""

from __future__ import annotations

from typing import TypeVar, cast

import numpy as np

from rftfit.forces.mesh import Mesh
from rftfit.forces.outlines import Outline

Body = TypeVar("Body", bound=Outline | Mesh)

EDGES_ACROSS_OUTLINE = 12
"""Fewest elements along the longer side of an outline: peaks of boxes and plates that turn are then within 2.5 % of finer ones."""

EDGES_ACROSS_MESH = 5
"""Fewest edges along the second longest side of a mesh, because a mesh may turn about the longest one: within 2.5 %, as
above (`tests/space/test_space_fineness.py`).

Errors of many faces cancel more than those of a line of elements do.
"""


def fine_enough(body: Body) -> Body:
    """Halve the edges of a body until none is too long; a body that is fine enough is returned as it is."""
    longest_cm = longest_edge_cm(body)
    if not (body.edges_cm > longest_cm).any():
        return body
    return cast("Body", body.refined(longest_cm))


def longest_edge_cm(body: Outline | Mesh) -> float:
    """Return the longest edge that a body may have, cm."""
    # from the shortest: the second of two sides is the longer one, the second of three the middle
    # one
    sides_cm = np.sort(np.ptp(body.points_cm, axis=0))
    if isinstance(body, Mesh):
        return float(sides_cm[1]) / EDGES_ACROSS_MESH
    return float(sides_cm[1]) / EDGES_ACROSS_OUTLINE
