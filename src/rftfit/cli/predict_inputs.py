"""What is moved and how, from the words of the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.cli.predict_sources import choose
from rftfit.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.conventions import FloatArray
    from rftfit.predict.outline import Outline

_MOST_ELEMENTS = 10_000
_WIDTH_CM = 2.54
_MOST_CM = 1000.0


@dataclass(frozen=True)
class Motion:
    """Poses, and the columns that say which is which.

    Parameters
    ----------
    name : str
        For people.
    poses : numpy.ndarray, shape (p, 6)
    columns : dict of str to numpy.ndarray, shape (p,)
        In the order of the table; the first one tells the poses apart.
    """

    name: str
    poses: FloatArray
    columns: dict[str, FloatArray]

    @property
    def key(self) -> str:
        """Name of the column that tells the poses apart: ``theta_deg`` or ``t_s``."""
        return next(iter(self.columns))


def make_outline(
    leg: str | None,
    curvature: float | None,
    points: Path | None,
    width_cm: float | None,
    elements: int,
) -> Outline:
    """Make the outline that was asked for.

    Parameters
    ----------
    leg : str or None
        A model leg.
    curvature : float or None
        R/r of a leg of the model legs' length.
    points : Path or None
        csv of points.
    width_cm : float or None
        Needed with points; that of the model legs by default with a curvature.
    elements : int

    Returns
    -------
    Outline

    Raises
    ------
    InputError
        If not just one of leg, curvature and points is given, or it is not valid.
    """
    from rftfit.predict.outline import CURVATURES, arc, model_leg
    from rftfit.predict.outline_file import read_outline

    given = {"--leg": leg, "--curvature": curvature, "--outline": points}
    named = [option for option, value in given.items() if value is not None]
    if len(named) != 1:
        raise InputError(
            f"found {' and '.join(named) or 'no outline'}; allowed: one of --leg "
            f"({', '.join(CURVATURES)}), --curvature R/r, --outline FILE with --width"
        )
    if not 1 <= elements <= _MOST_ELEMENTS:
        raise InputError(f"--elements: found {elements}; allowed: 1 to {_MOST_ELEMENTS}")
    if width_cm is not None and not 0 < width_cm <= _MOST_CM:
        raise InputError(f"--width: found {width_cm:g}; allowed: above 0, up to {_MOST_CM:g} cm")
    if leg is not None:
        choose("--leg", leg, tuple(CURVATURES))
        if width_cm is not None:
            raise InputError(
                f"--width: the model legs are {_WIDTH_CM:g} cm wide; allowed with --curvature "
                f"(c_leg is --curvature {CURVATURES['c_leg']:g}) and --outline"
            )
        return model_leg(leg, elements)
    if curvature is not None:
        if not -1 <= curvature <= 1:
            raise InputError(
                f"--curvature: found {curvature:g}; allowed: R/r from -1 (reversed c-leg) over 0 "
                "(flat) to 1 (c-leg)"
            )
        name = f"leg of curvature R/r = {curvature:g}"
        return arc(curvature, width_cm=width_cm or _WIDTH_CM, elements=elements, name=name)
    assert points is not None
    if width_cm is None:
        raise InputError("--outline needs --width, in cm: how wide the body is across the plane")
    return read_outline(points, width_cm, elements)


def make_motion(hip_cm: float | None, path: Path | None) -> Motion:
    """Make the motion that was asked for.

    Parameters
    ----------
    hip_cm : float or None
        Height of the axle of a rotation; that of the paper by default.
    path : Path or None
        csv of a free path.

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If both are given or one is not valid.
    """
    from rftfit.predict.path import read_path
    from rftfit.predict.rotation import HIP_HEIGHT_CM, THETA_DEG, rotation_poses

    if path is None:
        height = HIP_HEIGHT_CM if hip_cm is None else hip_cm
        if not abs(height) <= _MOST_CM:
            raise InputError(f"--hip: found {height:g}; allowed: -{_MOST_CM:g} to {_MOST_CM:g} cm")
        name = f"turned about an axle {height:g} cm above the surface"
        theta = THETA_DEG.copy()
        return Motion(name, rotation_poses(np.radians(theta), height), {"theta_deg": theta})
    if hip_cm is not None:
        raise InputError("--hip is for a rotation; with --path the height is in the file's z_cm")
    time, poses = read_path(path)
    columns = {
        "t_s": time,
        "x_cm": poses[:, 0],
        "z_cm": poses[:, 1],
        "angle_deg": np.degrees(poses[:, 2]),
    }
    return Motion(f"along {path}", poses, columns)
