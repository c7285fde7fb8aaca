"""Where the arm goes: the segments of a run and the position at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rftfit.campaign.config import Config, Leg
from rftfit.errors import InputError
from rftfit.lab.plan import plate_of

if TYPE_CHECKING:
    from rftfit.campaign.shapes import AnyPlate
    from rftfit.lab.plan import Run

FloatArray = npt.NDArray[np.float64]

CLEARANCE_CM = 6.0
"""Nearer to walls and bottom than this, the force departs from depth times area (paper)."""

RAMP_S = 0.05
SAND_DEPTH_CM = 6.0
THETA_END_DEG = 135.0
_AIR_CM = 1.6
_LEAST_WINDOW_CM = 0.5
_LEAST_TO_BOTTOM_CM = 4.0
_REST_AIR_S, _REST_S, _PAUSE_S = 2.0, 1.0, 2.0


@dataclass(frozen=True)
class Segment:
    """One rest, one straight move, or one turn of a leg.

    Attributes
    ----------
    phase : {"rest", "approach", "pause", "stroke", "lift"}
    start, end : (float, float, float)
        x in cm, z in cm and angle in degrees.
    duration_s : float
    distance, speed : float
        cm and cm/s, rad and rad/s for a leg; 0 at rest. Ramps of `RAMP_S` begin and end a move.
    """

    phase: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    duration_s: float
    distance: float = 0.0
    speed: float = 0.0

    @property
    def moving(self) -> bool:
        """Whether the arm moves."""
        return self.distance > 0


@dataclass(frozen=True)
class Motion:
    """Position of the intruder's reference point at n samples; every array has shape (n,).

    Attributes
    ----------
    elapsed_s : numpy.ndarray
        Since the start of the run, kept between 0 and the run's duration.
    x_cm, z_cm, angle_deg : numpy.ndarray
        Lab frame; the angle is beta of a plate, theta of a leg.
    travel : numpy.ndarray
        Since the start of the sample's own segment: cm, rad for a leg.
    segment : numpy.ndarray of int
        Number of that segment in its run, from 0.
    moving : numpy.ndarray of bool
    """

    elapsed_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    angle_deg: FloatArray
    travel: FloatArray
    segment: npt.NDArray[np.intp]
    moving: npt.NDArray[np.bool_]


def half_extents(plate: AnyPlate, beta_deg: float) -> tuple[float, float]:
    """Half the size of a tilted plate along x and along z, thickness included.

    Parameters
    ----------
    plate : Plate, Disc or FlatOutline
    beta_deg : float

    Returns
    -------
    half_x_cm, half_z_cm : float
    """
    c, s = abs(math.cos(math.radians(beta_deg))), abs(math.sin(math.radians(beta_deg)))
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    return length * c + thickness * s, length * s + thickness * c


def window(run: Run, config: Config) -> tuple[float, float]:
    """Depths between which the plate is wholly submerged and clear of walls and bottom.

    Parameters
    ----------
    run : Run
        A plate or rod run along a sloping path.
    config : Config

    Returns
    -------
    from_cm, to_cm : float
    """
    _, half_z = half_extents(plate_of(config)[1], run.beta_deg or 0.0)
    _, (_, z_end) = _stroke(run, config)
    return half_z, min(-z_end, config.container.depth_cm - CLEARANCE_CM - half_z)


def _stroke(run: Run, config: Config) -> tuple[tuple[float, float], tuple[float, float]]:
    """Upper and lower end of the path, or right and left end of a horizontal one."""
    box, (_, plate) = config.container, plate_of(config)
    diagonal = math.hypot(plate.length_cm, plate.thickness_cm) / 2
    # whole millimetres, and the same path for every beta
    half_span = math.floor(10 * (box.length_cm / 2 - CLEARANCE_CM - diagonal)) / 10
    deepest = math.floor(10 * (box.depth_cm - CLEARANCE_CM - plate.thickness_cm / 2)) / 10
    _, half_z = half_extents(plate, run.beta_deg or 0.0)
    deepest = min(deepest, box.depth_cm - _LEAST_TO_BOTTOM_CM - half_z)
    if run.natural:
        deepest = SAND_DEPTH_CM
    if run.direction == "horizontal":
        reach, depth = 0.8 * half_span, run.depth_cm or 0.0
        return (reach, -depth), (-reach, -depth)
    gamma = math.radians(run.gamma_deg or 0.0)
    steep = math.isclose(gamma, math.pi / 2)
    depth = deepest if steep else min(deepest, 2 * half_span * math.tan(gamma))
    reach = 0.0 if steep else depth / math.tan(gamma) / 2
    return (reach, 0.0), (-reach, -depth)


def _check_room(run: Run, config: Config) -> None:
    if run.direction == "horizontal":
        right, left = _stroke(run, config)
        enough = right[0] - left[0] > config.fit.horizontal_skip_cm + _LEAST_WINDOW_CM
    else:
        shallow, deep = window(run, config)
        enough = deep - shallow >= _LEAST_WINDOW_CM
    if not enough:
        raise InputError(
            f"{run.run_id}: container and plate of the config leave no fit window of "
            f"{_LEAST_WINDOW_CM} cm that keeps {CLEARANCE_CM:g} cm from walls and bottom"
        )


def _move(
    phase: str, start: tuple[float, float, float], end: tuple[float, float, float], speed: float
) -> Segment:
    distance = math.hypot(end[0] - start[0], end[1] - start[1])
    distance = distance or math.radians(abs(end[2] - start[2]))
    return Segment(phase, start, end, distance / speed + RAMP_S, distance, speed)


def segments(run: Run, config: Config, raised: bool = False) -> tuple[Segment, ...]:
    """Rests and moves of a run, in the order of docs/architecture.md.

    Parameters
    ----------
    run : Run
    config : Config
    raised : bool
        True lifts the whole path into the air (a run that never touches the surface).

    Returns
    -------
    tuple of Segment

    Raises
    ------
    InputError
        If plate and container leave no room for the path.
    """
    intruder = config.intruders[run.intruder]
    if isinstance(intruder, Leg):
        first = (0.0, intruder.hip_height_cm, -THETA_END_DEG)
        last = (0.0, intruder.hip_height_cm, THETA_END_DEG)
        turn = _move("stroke", first, last, config.arm.leg_speed_rad_per_s)
        return (
            Segment("rest", first, first, _REST_AIR_S),
            turn,
            Segment("rest", last, last, _REST_S),
        )
    _check_room(run, config)
    beta, speed = run.beta_deg or 0.0, config.arm.speed_cm_per_s
    (x0, z0), (x1, z1) = _stroke(run, config)
    _, half_z = half_extents(intruder, beta)
    top = half_z + _AIR_CM
    lift = top - z1 if raised else 0.0
    air = (x0, top + lift, beta)
    begin, end = (x0, z0 + lift, beta), (x1, z1 + lift, beta)
    if run.direction == "extraction":
        return (
            Segment("rest", end, end, _REST_S),
            _move("stroke", end, begin, speed),
            Segment("pause", begin, begin, _PAUSE_S),
            _move("lift", begin, air, speed),
            Segment("rest", air, air, _REST_AIR_S),
        )
    return (
        Segment("rest", air, air, _REST_AIR_S),
        _move("approach", air, begin, speed),
        Segment("pause", begin, begin, _PAUSE_S),
        _move("stroke", begin, end, speed),
        Segment("rest", end, end, _REST_S),
    )


def duration(parts: tuple[Segment, ...]) -> float:
    """Duration of a run in s.

    Parameters
    ----------
    parts : tuple of Segment

    Returns
    -------
    float
    """
    return sum(part.duration_s for part in parts)


def _travelled(part: Segment, time_s: FloatArray) -> FloatArray:
    """Distance since the segment's start: trapezoidal speed with ramps of `RAMP_S`."""
    if not part.moving:
        return np.zeros_like(time_s)
    gain = part.speed / RAMP_S
    left = part.duration_s - time_s
    cruise = part.speed * (time_s - RAMP_S / 2)
    speeding, braking = gain * time_s**2 / 2, part.distance - gain * left**2 / 2
    return np.where(time_s < RAMP_S, speeding, np.where(left < RAMP_S, braking, cruise))


def motion_at(parts: tuple[Segment, ...], elapsed_s: FloatArray) -> Motion:
    """Position of the intruder's reference point at the given times.

    Parameters
    ----------
    parts : tuple of Segment
    elapsed_s : numpy.ndarray, shape (n,)
        s since the start of the run; beyond the end the arm stays where it is.

    Returns
    -------
    Motion
    """
    ends = np.cumsum([part.duration_s for part in parts])
    clipped = np.clip(elapsed_s, 0.0, ends[-1])
    index = np.minimum(np.searchsorted(ends, clipped, side="right"), len(parts) - 1)
    place = np.empty((3, clipped.size))
    travel = np.zeros(clipped.size)
    for number, part in enumerate(parts):
        here = index == number
        travel[here] = _travelled(part, clipped[here] - (ends[number] - part.duration_s))
        share = travel[here] / part.distance if part.moving else 0.0
        for row, (first, last) in enumerate(zip(part.start, part.end, strict=True)):
            place[row, here] = first + (last - first) * share
    moving = np.array([part.moving for part in parts])[index]
    return Motion(clipped, place[0], place[1], place[2], travel, index, moving)
