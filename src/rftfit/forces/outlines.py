"""Outlines in the plane: arcs, the model legs, polylines, files of points and what is wrong with them.

x is forward, z up, in cm. An outline is a row of straight elements: their centre, tangent and half-length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rftfit.campaign.config import Leg
from rftfit.campaign.problems import CampaignError, Place, Problem
from rftfit.campaign.rows import Schema, TableColumn, read_rows
from rftfit.conventions import FloatArray
from rftfit.forces.motion import MOST_SHOWN

IntArray = npt.NDArray[np.int64]

# --- Thin outlines in the plane: arcs of any curvature, the model legs, any line of points.


ELEMENTS = 30
"""Number of elements of a leg in the paper.

Each has its middle, tangent and length on the arc itself, and is clipped at the surface. What is left
at 30 elements comes from the measured table, which has no jump but bends at its nodes: a half circle
is six degrees an element, so that at every sixth degree of theta all bends in beta (30 degrees
apart) lie in the middle of an element. The lift is then off by 0.02 to 0.07 N on either curved leg:
up to 0.4 % of the c-leg's peak and, its peak being five times smaller, 2 % of the reversed c-leg's.
As many Gauss points leave more than half of this error; 120 elements leave less than 0.1 % in all five
media. The nine terms have no bends and are within 0.1 % at 30.
"""

CURVATURES = {"c_leg": 1.0, "flat_leg": 0.0, "reversed_c_leg": -1.0}
"""R/r of the three model legs: half of the distance from axle to tip, over the radius of the arc."""


@dataclass(frozen=True)
class Outline:
    """A thin body in the plane, cut into straight elements, at angle 0 about its reference point.

    Turned by an angle from z toward x, a point (x, z) goes to (x cos + z sin, z cos - x sin): the
    angle of a plate along x is its beta, that of a leg hanging straight down its theta.

    Parameters
    ----------
    body : numpy.ndarray, shape (n, 5)
        Centre x, z (cm), unit tangent x, z, half-length (cm) of each element.
    width_cm : float
        Width across the plane.
    name : str, optional
    solid : bool, optional
        True for the skin of a solid body, running counterclockwise: then the medium acts only on elements
        that move outward, into it. False for a thin plate, on which the medium acts from either side.

    Raises
    ------
    ValueError
        If the array has another shape, is not finite, or the width is not positive.

    Examples
    --------
    >>> import numpy as np, rftfit
    >>> plate = rftfit.Outline(np.array([[0.0, 0.0, 1.0, 0.0, 1.27]]), width_cm=3.81)
    >>> round(plate.area_cm2, 2)
    9.68
    """

    body: FloatArray
    width_cm: float
    name: str = "outline"
    solid: bool = False

    def __post_init__(self) -> None:
        """Check elements and width, and make the elements one block of numbers, as the compiled kernel needs them."""
        body = np.ascontiguousarray(self.body, dtype=float)
        if body.ndim != 2 or body.shape[1] != 5 or not np.isfinite(body).all():
            raise ValueError(f"finite elements of shape (n, 5) wanted, found {body.shape}")
        if not 0 < self.width_cm < np.inf:
            raise ValueError(f"the width must be positive, found {self.width_cm:g} cm")
        object.__setattr__(self, "body", body)

    @property
    def area_cm2(self) -> float:
        """Area of one face."""
        return float(2 * self.body[:, 4].sum() * self.width_cm)

    @property
    def edges_cm(self) -> FloatArray:
        """Length of each element, shape (n,)."""
        return 2 * self.body[:, 4]

    @property
    def points_cm(self) -> FloatArray:
        """Ends of the elements, shape (2 n, 2)."""
        centre, tangent, half = self.body[:, :2], self.body[:, 2:4], self.body[:, 4:]
        return np.concatenate([centre - half * tangent, centre + half * tangent])

    def refined(self, longest_cm: float) -> Outline:
        """Return the same outline with elements halved until none is longer: they then move more nearly as their middles.

        Parameters
        ----------
        longest_cm : float
            Greatest length of an element.

        Returns
        -------
        Outline
        """
        halvings = np.log2(np.maximum(self.edges_cm / longest_cm, 1.0))
        # pieces of each old element; 1e-9: one that is just long enough is not halved by rounding
        count = 2 ** np.ceil(halvings - 1e-9).astype(int)
        element, within = _number_pieces(count)
        # from the middle of the old element to that of the new one, in half-lengths of the old one: between -1 and 1
        shift = ((2 * within + 1) / count[element] - 1)[:, None]
        centre, tangent, half = np.split(self.body[element], [2, 4], axis=1)
        body = np.hstack([centre + shift * half * tangent, tangent, half / count[element][:, None]])
        return replace(self, body=body)


def _number_pieces(counts: IntArray) -> tuple[IntArray, IntArray]:
    """Return for each piece, where line i is cut into `counts[i]` of them, the index i and its index on this line from 0.

    For counts 2, 1: lines 0, 0, 1 and indices 0, 1, 0.
    """
    line = np.repeat(np.arange(len(counts)), counts)
    return line, np.arange(len(line)) - np.repeat(np.cumsum(counts) - counts, counts)


def arc(
    curvature_times_R: float,
    max_length_cm: float = 7.62,
    width_cm: float = 2.54,
    elements: int = ELEMENTS,
    name: str = "arc",
) -> Outline:
    """Make an arc of any curvature through the axle (0, 0) and the tip (0, -2R): a leg at theta = 0.

    Parameters
    ----------
    curvature_times_R : float
        R/r from -1 to 1. 1 is the c-leg, a half circle that bulges toward -x, the way a leg sweeps as
        theta grows, so that its convex side leads; 0 is straight; -1 is the mirror image of the c-leg.
    max_length_cm : float, optional
        2R, from axle to tip.
    width_cm : float, optional
        Width across the plane.
    elements : int, optional
        Number of elements, which are equally long.
    name : str, optional

    Returns
    -------
    Outline

    Raises
    ------
    ValueError
        If a number is out of its range.

    Examples
    --------
    >>> import rftfit
    >>> leg = rftfit.arc(0.5, max_length_cm=4.1, width_cm=1.0)
    """
    if not -1 <= curvature_times_R <= 1:
        raise ValueError(f"R/r must lie between -1 and 1, found {curvature_times_R:g}")
    if not (0 < max_length_cm < np.inf and elements >= 1):
        raise ValueError("the length and the number of elements must be positive")
    phi = float(np.arcsin(curvature_times_R))
    return _bent(phi, max_length_cm, width_cm, elements, name)


def _bent(phi: float, max_length_cm: float, width_cm: float, elements: int, name: str) -> Outline:
    """Make an arc that spans 2 `phi` (rad, positive for a c-leg) from the axle (0, 0) to the tip straight below.

    `max_length_cm`: from axle to tip, or the diameter of the circle where the arc is more than half of it. For an arc
    of radius r, sin(phi) = R / r with 2R from axle to tip.
    """
    bend = float(np.sin(phi))
    chord = max_length_cm * (abs(bend) if abs(phi) > np.pi / 2 else 1)
    # middle of each element, as a share of the arc from the axle
    along = (np.arange(elements) + 0.5) / elements
    psi = phi * (1 - 2 * along)  # tangent from straight down
    # distance from the axle over the chord; a straight leg is the limit: sin(k phi) / sin(phi) -> k
    above = np.sin(phi * along) / bend if bend else along
    x = -chord * np.sin(phi * (1 - along)) * above
    z = -chord * np.cos(phi * (1 - along)) * above
    length = chord * (phi / bend if bend else 1.0)
    half = np.full(elements, length / elements / 2)
    return Outline(np.stack([x, z, -np.sin(psi), -np.cos(psi), half], axis=-1), width_cm, name)


def model_leg(name: str, elements: int = ELEMENTS) -> Outline:
    """Return one of the paper's three model legs (2R = 7.62 cm, width 2.54 cm).

    Parameters
    ----------
    name : str
        ``c_leg``, ``flat_leg`` or ``reversed_c_leg``.
    elements : int, optional

    Returns
    -------
    Outline

    Raises
    ------
    KeyError
        If there is no such leg.

    Examples
    --------
    >>> import rftfit
    >>> leg = rftfit.model_leg("c_leg")
    """
    if name not in CURVATURES:
        raise KeyError(f"no model leg {name!r}; there are {', '.join(CURVATURES)}")
    return arc(CURVATURES[name], elements=elements, name=name)


def arc_of(leg: Leg) -> float:
    """Return the angle that a leg's arc spans, deg: 180 for the c-legs, 0 for the flat leg."""
    return float(2 * np.degrees(np.arcsin(abs(leg.curvature_times_R))))


def leg_outline(
    leg: Leg, name: str = "leg", elements: int = ELEMENTS, *, arc_deg: float | None = None
) -> Outline:
    """Make the outline of a leg of the campaign's configuration.

    `arc_deg`: angle that its arc spans instead, with the same maximal length, to see what an error of it does; without
    effect on a straight leg. `name`: of the outline.
    """
    phi = float(np.arcsin(leg.curvature_times_R))
    if arc_deg is not None:
        phi = float(np.sign(phi) * np.radians(arc_deg) / 2)
    return _bent(phi, leg.max_length_cm, leg.width_cm, elements, name)


def polyline(
    points: npt.ArrayLike, width_cm: float, elements: int = ELEMENTS, name: str = "outline"
) -> Outline:
    """Make an outline along straight lines from point to point.

    Where the last point repeats the first, the outline is the skin of a solid body (`Outline.solid`).

    Parameters
    ----------
    points : array_like, shape (m, 2)
        x, z, cm. Points of a file are checked by `rftfit.forces.outlines.read_outline`.
    width_cm : float
        Width across the plane.
    elements : int, optional
        About how many elements; every straight piece has at least one.
    name : str, optional

    Returns
    -------
    Outline

    Raises
    ------
    ValueError
        If there are fewer than two points or two neighbours are the same.

    Examples
    --------
    >>> import rftfit
    >>> scoop = rftfit.polyline([(-2, 0), (0, -1), (2, 0)], width_cm=5)
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise ValueError(f"at least two points (x, z) wanted, found an array {points.shape}")
    solid = len(points) > 3 and bool((points[0] == points[-1]).all())
    if solid and _turns_clockwise(points):
        points = points[::-1]
    step = np.diff(points, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    if not (length > 0).all():
        raise ValueError("two neighbouring points are the same or not finite")
    count = np.maximum(1, np.round(elements * length / length.sum()).astype(int))
    line, within = _number_pieces(count)
    share = (within + 0.5) / count[line]
    centre = points[line] + share[:, None] * step[line]
    tangent = step[line] / length[line, None]
    half = length[line] / count[line] / 2
    return Outline(np.column_stack([centre, tangent, half]), width_cm, name, solid)


def _turns_clockwise(points: FloatArray) -> bool:
    """Tell whether a closed line of points x, z, shape (m, 2), runs clockwise: its signed area is negative."""
    return bool(_cross(points[:-1], points[1:]).sum() < 0)


# --- A user's own outline from a csv of points, checked before it is used.


_COLUMNS = (
    TableColumn("x_cm", meaning="x of a point", unit="cm"),
    TableColumn("z_cm", meaning="z of a point, upward", unit="cm"),
)
SCHEMA = Schema("outline", _COLUMNS, rows="points", comments=True, others="ignored")
"""Columns of an outline file, by which it is read, checked and described."""

MAX_POINTS = 5000
"""Most points of a file: the check for crossing lines compares every pair of pieces."""


def read_outline(path: Path, width_cm: float, elements: int = ELEMENTS) -> Outline:
    """Read an outline from a table with the columns ``x_cm``, ``z_cm``, points in order.

    The reference point, about which the outline turns, is (0, 0) of the file. Where the last row
    repeats the first, the outline is the skin of a solid body. The outline is named after the file. `elements`: as in
    `polyline`. Raises CampaignError with the problems of the file.
    """
    rows, problems = read_rows(path, SCHEMA)
    if not problems:
        # the shape is checked only where all its rows could be read
        points = np.array([[row.number["x_cm"], row.number["z_cm"]] for row in rows])
        problems = _find_problems(points, [row.row for row in rows], str(path))
    if problems:
        raise CampaignError(problems[:MOST_SHOWN])
    return polyline(points, width_cm, elements, path.stem)


def _find_problems(points: FloatArray, rows: list[int], file: str) -> list[Problem]:
    """List problems of the shape, each with its place in the file: too few or many points, repeated points, crossing lines.

    `points`: x, z, cm, shape (m, 2). `rows`: row of the file of each point, (m,). `file`: its name for messages. The
    first sort of problem that is there hides the later ones, which may follow from it.
    """
    count = len(points)
    if count < 2:
        fault = f"{count} point; an outline has at least two"
        return [Problem("outline.too-short", Place(file, rows[0]), None, fault)]
    if count > MAX_POINTS:
        fault = f"{count} points; at most {MAX_POINTS} are read"
        return [Problem("outline.too-long", Place(file, rows[MAX_POINTS]), None, fault)]
    closed = count > 3 and bool((points[0] == points[-1]).all())
    problems = []
    seen: dict[tuple[float, float], int] = {}
    for index, (x, z) in enumerate((points[:-1] if closed else points).tolist()):
        first_index = seen.setdefault((x, z), index)
        if first_index != index:
            fault = f"every point once; this is the point of row {rows[first_index]} again"
            place = Place(file, rows[index])
            problems.append(Problem("outline.repeated", place, f"{x:g}, {z:g}", fault))
    if problems:
        return problems
    for first_piece, second_piece in crossing_pieces(points):
        fault = (
            f"the outline crosses or touches itself: the line from row {rows[first_piece]} to "
            f"{rows[first_piece + 1]} meets the one from row {rows[second_piece]} to {rows[second_piece + 1]}"
        )
        problems.append(Problem("outline.crossing", Place(file, rows[second_piece]), None, fault))
    return problems


def crossing_pieces(points: FloatArray) -> list[tuple[int, int]]:
    """Return pairs i < j of straight pieces that meet where they should not; piece i runs from point i to i + 1.

    `points`: x, z, shape (m, 2); closed where the last repeats the first. Neighbours may meet in the point they share.
    """
    start, end = points[:-1], points[1:]
    closed = bool((points[0] == points[-1]).all())
    last = len(start) - 1
    pairs = []
    for i in range(last):
        meets = _meet(start[i], end[i], start[i + 1 :], end[i + 1 :])
        # neighbours share a point; they overlap only where the line turns back on itself
        meets[0] = _turns_back(start[i], end[i], end[i + 1])
        if closed and i == 0 and last > 1:
            meets[-1] = _turns_back(start[last], start[0], end[0])
        pairs += [(i, i + 1 + int(j)) for j in np.flatnonzero(meets)]
    return pairs


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product of vectors in the plane, shape (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _turns_back(a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
    """Tell whether the line from a to b goes back on itself to c; points x, z, each of shape (2,)."""
    into, out = b - a, c - b
    size = float(np.hypot(*into) * np.hypot(*out))
    return bool(abs(_cross(into, out)) <= 1e-12 * size and into @ out < 0)


def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> np.ndarray:
    """Tell which of the lines c to d, each (k, 2), have a point in common with the line a to b, each (2,): shape (k,)."""
    along = b - a
    # the sign says on which side of the other line a point lies
    side_c, side_d = _cross(along, c - a), _cross(along, d - a)
    side_a, side_b = _cross(d - c, a - c), _cross(d - c, b - c)
    # pieces of one and the same straight line have all sides 0: then their boxes decide
    on_one_side = (side_c * side_d > 0) | (side_a * side_b > 0)
    low, high = np.minimum(a, b), np.maximum(a, b)
    boxes_overlap = ((np.maximum(c, d) >= low) & (np.minimum(c, d) <= high)).all(axis=-1)
    return ~on_one_side & boxes_overlap
