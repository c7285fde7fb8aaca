"""A body moved along any path: a csv of time, place and angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.problems import CampaignError, Problem
from rftfit.predict.forces import Forces, forces_on
from rftfit.predict.points import read_points

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.predict.outline import Outline
    from rftfit.profile.base import Profile

COLUMNS = ("t_s", "x_cm", "z_cm", "angle_deg")
_MOST_SHOWN = 20


def path_poses(
    time_s: npt.ArrayLike, x_cm: npt.ArrayLike, z_cm: npt.ArrayLike, angle: npt.ArrayLike
) -> FloatArray:
    """Poses along a path, with velocities by differences between neighbouring times.

    Parameters
    ----------
    time_s : array_like, shape (p,)
        Increasing, at least two.
    x_cm, z_cm : array_like, shape (p,)
        Reference point; z = 0 is the free surface.
    angle : array_like, shape (p,)
        rad, from z toward x (beta of a plate along x, theta of a leg). A step of more than half a
        turn is taken for the shorter way round.

    Returns
    -------
    numpy.ndarray, shape (p, 6)

    Raises
    ------
    ValueError
        If time does not increase or there are fewer than two times.
    """
    time = np.asarray(time_s, dtype=float)
    if time.size < 2 or not (np.diff(time) > 0).all():
        raise ValueError("a path needs at least two times, and time must increase")
    x, z, turned = (np.asarray(part, dtype=float) for part in (x_cm, z_cm, angle))
    place = np.stack([x, z, np.unwrap(turned)], axis=-1)
    return np.concatenate([place, np.gradient(place, time, axis=0)], axis=-1)


def read_path(path: Path) -> tuple[FloatArray, FloatArray]:
    """Read a path from a csv with the columns ``t_s``, ``x_cm``, ``z_cm``, ``angle_deg``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    time_s : numpy.ndarray, shape (p,)
    poses : numpy.ndarray, shape (p, 6)

    Raises
    ------
    InputError
        If the file cannot be read, a cell is no number, there are fewer than two rows, or time
        repeats or runs backward; all problems, with their rows.
    """
    values, rows, problems = read_points(path, COLUMNS, "path")
    time, file = values[:, 0], str(path)
    if not problems and len(rows) < 2:
        text = f"{len(rows)} row{'' if len(rows) == 1 else 's'}; a velocity needs at least two"
        problems.append(
            Problem(file, rows[0] if rows else None, None, None, text, "path.too-short")
        )
    for index in np.flatnonzero(np.diff(time) <= 0):
        same = time[index] == time[index + 1]
        problems.append(
            Problem(
                file,
                rows[index + 1],
                "t_s",
                f"{time[index + 1]:.10g}",
                f"later than the {time[index]:.10g} s of row {rows[index]}",
                "path.repeated-time" if same else "path.backward-time",
            )
        )
    if problems:
        raise CampaignError(problems[:_MOST_SHOWN])
    return time, path_poses(time, values[:, 1], values[:, 2], np.radians(values[:, 3]))


def along_path(
    profile: Profile, outline: Outline, time_s: FloatArray, poses: FloatArray
) -> tuple[pd.DataFrame, Forces]:
    """Force and moment on an outline along a path.

    Parameters
    ----------
    profile : Profile
    outline : Outline
    time_s : numpy.ndarray, shape (p,)
    poses : numpy.ndarray, shape (p, 6)
        From `read_path` or `path_poses`.

    Returns
    -------
    table : pandas.DataFrame
        `t_s, x_cm, z_cm, angle_deg, force_z_N, force_x_N, moment_N_cm`; the moment is about the
        reference point.
    forces : Forces
        The same forces, and why there is NaN among them.

    Raises
    ------
    ValueError
        If the profile is a stack of draws.
    """
    import pandas as pd

    forces = forces_on(profile, outline, poses)
    table = pd.DataFrame(
        {
            "t_s": time_s,
            "x_cm": poses[:, 0],
            "z_cm": poses[:, 1],
            "angle_deg": np.degrees(poses[:, 2]),
            "force_z_N": forces.force_z_N,
            "force_x_N": forces.force_x_N,
            "moment_N_cm": forces.moment_N_cm,
        }
    )
    return table, forces
