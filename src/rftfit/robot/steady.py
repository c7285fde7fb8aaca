"""Whether a run is steady, and over which strides its speed is averaged."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.robot.config import Numerics
    from rftfit.robot.parts import Parts

Outcome = Literal["steady", "tipped", "buried", "not steady"]
OUTCOMES: tuple[Outcome, ...] = ("steady", "tipped", "buried", "not steady")

SETTLED_Z_CM = 0.05
SETTLED_PITCH = math.radians(1.0)
"""Height and pitch at the ends of two settled stretches differ by no more."""


@dataclass(frozen=True)
class Verdict:
    """What became of a run.

    Parameters
    ----------
    outcome : {"steady", "tipped", "buried", "not steady"}
    reason : str
        Why it is not steady, or that it is so without being regular; else empty.
    averaged : int
        Strides, the last ones of the run, that the speed is the mean of; 0 where not steady.
    """

    outcome: Outcome
    reason: str = ""
    averaged: int = 0


def fallen(parts: Parts, ends: FloatArray, numerics: Numerics) -> Verdict | None:
    """Judge whether the robot has fallen over or gone under.

    Parameters
    ----------
    parts : Parts
    ends : numpy.ndarray, shape (n + 1, 6)
        State before the first stride and after each.
    numerics : Numerics

    Returns
    -------
    Verdict or None
        None where neither.
    """
    state, number = ends[-1], len(ends) - 1
    if not np.isfinite(state).all():
        return Verdict("not steady", f"a force is unknown in stride {number}")
    pitch = math.degrees(state[2])
    if abs(pitch) > numerics.tipped_deg:
        return Verdict("tipped", f"pitch {pitch:.0f} degrees after stride {number}")
    if highest_point(parts, state) < 0:
        return Verdict("buried", f"the whole body is below the surface after stride {number}")
    return None


def highest_point(parts: Parts, state: FloatArray) -> float:
    """Height of the highest end of a plate of the body above the surface.

    Parameters
    ----------
    parts : Parts
    state : numpy.ndarray, shape (6,)

    Returns
    -------
    float
        cm.
    """
    rows = [
        shape for shape, turned in zip(parts.members(), parts.turns, strict=True) if not turned[0]
    ]
    body = np.concatenate(rows)
    ends = np.concatenate([body[:, :2] + s * body[:, 4:5] * body[:, 2:4] for s in (-1, 1)])
    return float(
        state[1] + (ends[:, 1] * math.cos(state[2]) - ends[:, 0] * math.sin(state[2])).max()
    )


def settled(ends: FloatArray, stretch: int, stride_s: float, numerics: Numerics) -> bool:
    """Whether the last two stretches are alike: in speed, and in height and pitch at their ends.

    The first stretch is never one of them: it holds the transient.

    Parameters
    ----------
    ends : numpy.ndarray, shape (n + 1, 6)
    stretch : int
        Strides.
    stride_s : float
    numerics : Numerics

    Returns
    -------
    bool
    """
    if len(ends) - 1 < 3 * stretch:
        return False
    before, middle, last = ends[-1 - 2 * stretch], ends[-1 - stretch], ends[-1]
    first, second = (
        (b[0] - a[0]) / (stretch * stride_s) for a, b in ((before, middle), (middle, last))
    )
    near = max(numerics.settled_share * abs(second), numerics.settled_cm_per_s)
    return bool(
        abs(second - first) <= near
        and abs(last[1] - middle[1]) <= SETTLED_Z_CM
        and abs(last[2] - middle[2]) <= SETTLED_PITCH
    )


def irregular(speeds: FloatArray, numerics: Numerics) -> Verdict:
    """Judge a run that has reached its longest without settling.

    Its first third is left out. The other two are compared: a bouncing or stumbling robot has a
    mean speed although no two strides are alike; one that still speeds up has none.

    Parameters
    ----------
    speeds : numpy.ndarray, shape (n,)
        Mean speed of each stride, cm/s.
    numerics : Numerics

    Returns
    -------
    Verdict
    """
    third = len(speeds) // 3
    if third == 0:
        return Verdict("not steady", f"too short: {len(speeds)} strides, at least 3 are needed")
    middle, last = speeds[-2 * third : -third].mean(), speeds[-third:].mean()
    near = max(numerics.steady_share * abs(last), numerics.settled_cm_per_s)
    text = f"second and last third of {len(speeds)} strides: {middle:.3g} and {last:.3g} cm/s"
    if abs(last - middle) <= near:
        return Verdict("steady", f"irregular strides; {text}", 2 * third)
    return Verdict("not steady", text)
