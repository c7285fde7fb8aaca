"""A user's own outline from a csv of points, checked before it is used."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.problems import CampaignError, Problem
from rftfit.predict.outline import ELEMENTS, Outline, polyline
from rftfit.predict.points import read_points

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.conventions import FloatArray

COLUMNS = ("x_cm", "z_cm")
MAX_POINTS = 5000
_MOST_SHOWN = 20


def read_outline(path: Path, width_cm: float, elements: int = ELEMENTS) -> Outline:
    """Read an outline from a csv with the columns ``x_cm``, ``z_cm``, points in order.

    The reference point, about which the outline turns, is (0, 0) of the file. Where the last row
    repeats the first, the outline is the skin of a solid body.

    Parameters
    ----------
    path : Path
    width_cm : float
        Across the plane, positive.
    elements : int, optional
        About how many; every straight piece has at least one.

    Returns
    -------
    Outline
        Named after the file.

    Raises
    ------
    InputError
        If the file cannot be read, a cell is no number, there are fewer than two points, points
        repeat or the outline crosses itself; all problems, with their rows.
    ValueError
        If the width is not positive.
    """
    points, rows, problems = read_points(path, COLUMNS, "outline")
    file = str(path)
    if not problems:
        # a fault of the shape means nothing while a row is missing from it
        problems = _faults(points, rows, file)
    if problems:
        raise CampaignError(problems[:_MOST_SHOWN])
    return polyline(points, width_cm, elements, path.stem)


def _faults(points: FloatArray, rows: list[int], file: str) -> list[Problem]:
    count = len(points)
    if count < 2:
        text = f"{count} point{'' if count == 1 else 's'}; an outline has at least two"
        return [Problem(file, rows[0] if rows else None, None, None, text, "outline.too-short")]
    if count > MAX_POINTS:
        text = f"{count} points; at most {MAX_POINTS} are read"
        return [Problem(file, rows[MAX_POINTS], None, None, text, "outline.too-long")]
    closed = count > 3 and bool((points[0] == points[-1]).all())
    problems = []
    seen: dict[tuple[float, float], int] = {}
    for index, (x, z) in enumerate((points[:-1] if closed else points).tolist()):
        first = seen.setdefault((x + 0.0, z + 0.0), index)
        if first != index:
            text = f"every point once; this is the point of row {rows[first]} again"
            problems.append(
                Problem(file, rows[index], None, f"{x:g}, {z:g}", text, "outline.repeated")
            )
    if problems:
        return problems
    for one, other in crossings(points):
        text = (
            f"the outline crosses or touches itself: the line from row {rows[one]} to "
            f"{rows[one + 1]} meets the one from row {rows[other]} to {rows[other + 1]}"
        )
        problems.append(Problem(file, rows[other], None, None, text, "outline.crossing"))
    return problems


def crossings(points: FloatArray) -> list[tuple[int, int]]:
    """Pairs of straight pieces that meet where they should not.

    Parameters
    ----------
    points : numpy.ndarray, shape (m, 2)
        No two the same, except that the last may be the first.

    Returns
    -------
    list of (int, int)
        Numbers i < j of pieces, piece i running from point i to i + 1.
    """
    start, end = points[:-1], points[1:]
    closed = bool((points[0] == points[-1]).all())
    last = len(start) - 1
    found = []
    for i in range(last):
        others = np.arange(i + 1, last + 1)
        meets = _meet(start[i], end[i], start[others], end[others])
        # neighbours share a point; they overlap only where the line turns back on itself
        meets[0] = _turns_back(start[i], end[i], end[i + 1])
        if closed and i == 0 and last > 1:
            meets[-1] = _turns_back(start[last], start[0], end[0])
        found += [(i, int(j)) for j in others[meets]]
    return found


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    result: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def _turns_back(a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
    into, out = b - a, c - b
    size = float(np.hypot(*into) * np.hypot(*out))
    return bool(abs(_cross(into, out)) <= 1e-12 * size and into @ out < 0)


def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> np.ndarray:
    """Tell which of the lines c to d have a point in common with the line a to b."""
    along = b - a
    side_c, side_d = _cross(along, c - a), _cross(along, d - a)
    side_a, side_b = _cross(d - c, a - c), _cross(d - c, b - c)
    # lines that lie in one line have all sides 0: then their boxes decide
    apart = (side_c * side_d > 0) | (side_a * side_b > 0)
    low, high = np.minimum(a, b), np.maximum(a, b)
    boxes = ((np.maximum(c, d) >= low) & (np.minimum(c, d) <= high)).all(axis=-1)
    result: np.ndarray = ~apart & boxes
    return result
