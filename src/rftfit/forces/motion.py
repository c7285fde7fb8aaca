"""Motions of an outline: a leg that turns about its axle, a body moved along any path, files of paths.

A pose is a row of six numbers: x, z of the reference point (cm, z = 0 at the free surface), angle (rad, from z toward
x), and the rates of these three (cm/s, rad/s). The angle is beta of a plate along x, theta of a leg.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import CampaignError, Place, Problem
from rftfit.campaign.rows import Schema, TableColumn, read_rows
from rftfit.conventions import FloatArray


@dataclass(frozen=True)
class Motion:
    """Poses of a body, and the columns that tell them apart: made by `rotation` or `path`.

    Parameters
    ----------
    name : str
        For people.
    poses : numpy.ndarray, shape (p, 6)
        Reference point x, z (cm; z = 0 is the free surface), angle (rad, from z toward x), and their
        rates (per s).
    columns : dict of str to numpy.ndarray, shape (p,)
        ``theta_deg``, or ``t_s, x_cm, z_cm, angle_deg``; the first one tells the poses apart.
    rates_of_steps : numpy.ndarray, shape (2, p, 3), optional
        Rates of a path over the step before each pose and over the one after it, by which its corners are found
        (`rftfit.forces.corners`). None: the rates in `poses` are certain, as for a turning leg.

    Examples
    --------
    >>> import rftfit
    >>> len(rftfit.rotation().poses)
    271
    """

    name: str
    poses: FloatArray
    columns: dict[str, FloatArray]
    rates_of_steps: FloatArray | None = None

    def at_poses(self, numbers: Sequence[int]) -> Motion:
        """Return some poses alone, by their indices, with their rates: not those of a path through these poses."""
        columns = {name: column[numbers] for name, column in self.columns.items()}
        return Motion(self.name, self.poses[numbers], columns)

    def at_rates(self, rates: FloatArray) -> Motion:
        """Return the same poses at other rates of x, z (cm/s) and angle (rad/s), shape (p, 3)."""
        return replace(self, poses=np.concatenate([self.poses[:, :3], rates], axis=-1))


# --- A leg that turns about a fixed axle above the surface: the paper's rotation trials.


THETA_DEG = np.arange(-135.0, 136.0)
"""Leg angles of the sweep of the paper, deg: from the front (+x) down and backward."""

HIP_HEIGHT_CM = 2.0
"""Height of the axle above the surface in the paper's rotation trials (Fig. 3)."""
RATE_RAD_PER_S = 0.2
"""Angular speed of these trials."""


def rotation_poses(
    theta: npt.ArrayLike,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> FloatArray:
    """Return the poses (p, 6) of `Motion` for a leg on a fixed axle at x = 0; arguments as in `rotation`, `theta` in rad."""
    theta = np.asarray(theta, dtype=float)
    poses = np.zeros((theta.size, 6))
    poses[:, 1], poses[:, 2], poses[:, 5] = hip_height_cm, theta, rate_rad_per_s
    return poses


def rotation(
    theta_deg: npt.ArrayLike | None = None,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> Motion:
    """Turn a leg about a fixed axle: the paper's rotation trials.

    Parameters
    ----------
    theta_deg : array_like, shape (p,), optional
        Angle from straight down to the direction from axle to tip: the tip lies at 2R (-sin theta, -cos
        theta), so negative theta is in front (+x). Default: -135 to 135 deg by 1.
    hip_height_cm : float, optional
        Height of the axle above the free surface.
    rate_rad_per_s : float, optional
        Rate of theta; forces depend on its sign alone.

    Returns
    -------
    Motion

    Examples
    --------
    >>> import rftfit
    >>> motion = rftfit.rotation([-30, 0, 30], hip_height_cm=1)
    """
    theta = THETA_DEG.copy() if theta_deg is None else np.asarray(theta_deg, dtype=float)
    name = f"turned about an axle {hip_height_cm:g} cm above the surface"
    poses = rotation_poses(np.radians(theta), hip_height_cm, rate_rad_per_s)
    return Motion(name, poses, {"theta_deg": theta})


# --- A body moved along any path: a csv of time, position and angle.


_COLUMNS = (
    TableColumn("t_s", meaning="time", unit="s"),
    TableColumn("x_cm", meaning="x of the reference point", unit="cm"),
    TableColumn("z_cm", meaning="z of the reference point, 0 at the surface", unit="cm"),
    TableColumn("angle_deg", meaning="angle from z toward x", unit="degrees"),
)
SCHEMA = Schema("path", _COLUMNS, comments=True, others="ignored", most_rows=2_000_000)
"""Columns of a file with a path, by which it is read, checked and described."""

MOST_SHOWN = 20
"""Most problems of a file that are reported."""


def path(
    time_s: npt.ArrayLike, x_cm: npt.ArrayLike, z_cm: npt.ArrayLike, angle_deg: npt.ArrayLike
) -> Motion:
    """Move a body along any path; the velocity of a pose is the mean over the steps before and after it.

    Parameters
    ----------
    time_s : array_like, shape (p,)
        Increasing times, at least two.
    x_cm, z_cm : array_like, shape (p,)
        Reference point; z = 0 is the free surface, up is positive.
    angle_deg : array_like, shape (p,)
        Angle from z toward x: beta of a plate along x, theta of a leg. A step of more than half a turn is
        taken for the shorter way round.

    Returns
    -------
    Motion

    Raises
    ------
    ValueError
        If there are fewer than two times, or time does not increase.

    Examples
    --------
    >>> import rftfit
    >>> down = rftfit.path([0, 1, 2], [0, 0, 0], [0, -1, -2], [0, 0, 0])
    """
    time = as_increasing(time_s)
    x, z, angle = (np.asarray(series, dtype=float) for series in (x_cm, z_cm, angle_deg))
    coordinates = np.stack([x, z, np.unwrap(np.radians(angle))], axis=-1)
    poses = np.concatenate([coordinates, np.gradient(coordinates, time, axis=0)], axis=-1)
    columns = {"t_s": time, "x_cm": x, "z_cm": z, "angle_deg": np.degrees(poses[:, 2])}
    name = f"a path of {time.size} poses"
    return Motion(name, poses, columns, rates_of_steps(coordinates, time))


def rates_of_steps(coordinates: FloatArray, time_s: FloatArray) -> FloatArray:
    """Return the rates of a path over the step before each pose and over the step after it, shape (2, p, k).

    `coordinates`: positions (cm) and angles (rad), shape (p, k). `time_s`: shape (p,). Index 0 is the step before, 1
    the step after; the first and the last pose have one step alone, which counts as both.
    """
    rates = np.diff(coordinates, axis=0) / np.diff(time_s)[:, None]
    before = np.concatenate([rates[:1], rates])
    after = np.concatenate([rates, rates[-1:]])
    return np.stack([before, after])


def as_increasing(time_s: npt.ArrayLike) -> FloatArray:
    """Return the times of a path as an array (p,), s; raises ValueError where they are fewer than two or do not increase."""
    time = np.asarray(time_s, dtype=float)
    if time.size < 2 or not (np.diff(time) > 0).all():
        raise ValueError("a path needs at least two times, and time must increase")
    return time


def read_path(file: Path) -> Motion:
    """Read the motion of an outline from a table with the columns ``t_s``, ``x_cm``, ``z_cm``, ``angle_deg``.

    Raises CampaignError with the problems of the file.
    """
    return replace(path(*read_path_columns(file, SCHEMA)), name=f"along {file}")


def read_path_columns(file: Path, schema: Schema) -> FloatArray:
    """Read the columns of `schema` from a table of at least two rows, in their order and units: shape (columns, rows).

    The first of them is ``t_s``, which must increase. Raises CampaignError with every cell that is wrong, and every
    time that does not increase.
    """
    rows, problems = read_rows(file, schema)
    if not problems and len(rows) < 2:
        fault = f"{len(rows)} row; a velocity needs at least two"
        problems = [Problem("path.too-short", Place(str(file), rows[0].row), None, fault)]
    for before, row in pairwise([row for row in rows if not row.bad]):
        time, earlier = row.number["t_s"], before.number["t_s"]
        if time <= earlier:
            code = "path.repeated-time" if time == earlier else "path.backward-time"
            allowed = f"later than the {earlier:.10g} s of row {before.row}"
            cell = Place(str(file), row.row, "t_s")
            problems.append(Problem(code, cell, f"{time:.10g}", allowed))
    if problems:
        raise CampaignError(problems[:MOST_SHOWN])
    return np.array([[row.number[column.name] for row in rows] for column in schema.columns])
