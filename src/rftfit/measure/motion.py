"""What the arm did: stretches of motion, and which of them is the stroke."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.conventions import direction, intrusion_angle
from rftfit.measure.clock import moving_spans

if TYPE_CHECKING:
    from rftfit.campaign.config import Arm
    from rftfit.campaign.runs import Run
    from rftfit.conventions import FloatArray

UNDERGROUND_CM = 0.3
DEPTH_TOLERANCE_CM = 0.1


class StrokeError(ValueError):
    """The motion log holds no stroke as the run sheet describes it.

    Parameters
    ----------
    code : str
        Short stable name of the cause.
    text : str
        What was found and what the sheet says.
    """

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True)
class Motion:
    """Path of the intruder on the motion log's clock; arrays of shape (n,).

    Parameters
    ----------
    time : numpy.ndarray
        s, increasing.
    x, z : numpy.ndarray
        Reference point in the lab frame, cm.
    angle : numpy.ndarray
        beta of a plate or theta of a leg, rad.
    """

    time: FloatArray
    x: FloatArray
    z: FloatArray
    angle: FloatArray

    def spans(self, arm: Arm) -> FloatArray:
        """Start and end of every stretch in which the arm moves or turns.

        Parameters
        ----------
        arm : Arm
            Half its speed is the edge of a stretch.

        Returns
        -------
        numpy.ndarray, shape (k, 2)
            s, on the motion log's clock.
        """
        if self.time.size < 3:
            return np.empty((0, 2))
        step = self.time[2:] - self.time[:-2]
        # central differences, so that an edge is not seen half a step late
        speed = np.hypot(self.x[2:] - self.x[:-2], self.z[2:] - self.z[:-2])
        turning = np.abs(self.angle[2:] - self.angle[:-2])
        relative = np.maximum(speed / arm.speed_cm_per_s, turning / arm.leg_speed_rad_per_s)
        return moving_spans(self.time[1:-1], relative / step, 0.5)

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position and angle at other times, linear between samples.

        Parameters
        ----------
        time : numpy.ndarray, shape (m,)
            s, on the motion log's clock, within the log.

        Returns
        -------
        x, z, angle : numpy.ndarray, shape (m,)
            cm, cm, rad.
        """
        return (
            np.interp(time, self.time, self.x),
            np.interp(time, self.time, self.z),
            np.interp(time, self.time, self.angle),
        )


def find_stroke(motion: Motion, spans: FloatArray, run: Run, arm: Arm) -> tuple[float, float]:
    """Find the stretch that is the run's stroke, and refuse one that the sheet does not describe.

    Parameters
    ----------
    motion : Motion
    spans : numpy.ndarray, shape (k, 2)
        From `Motion.spans`.
    run : Run
        One row of the run sheet.
    arm : Arm

    Returns
    -------
    start, end : float
        s, on the motion log's clock.

    Raises
    ------
    StrokeError
        If the surface is never reached, or the path or the plate's angle is not the sheet's.
    """
    if run.kind in ("leg", "leg_air"):
        return _rotation(motion, spans)
    if motion.z.min() > -UNDERGROUND_CM:
        raise StrokeError(
            "surface_not_reached",
            f"surface not reached: the lowest point of the path is z = {motion.z.min():+.2f} cm",
        )
    gamma = math.radians(run.gamma_deg)
    wanted_x, wanted_z = (float(part) for part in direction(gamma))
    if run.direction == "extraction":
        wanted_x, wanted_z = -wanted_x, -wanted_z
    best: tuple[float, float, float] | None = None
    seen: list[str] = []
    for start, end in spans:
        (x0, x1), (z0, z1), _ = motion.at(np.array([start, end]))
        if min(z0, z1) > -UNDERGROUND_CM:
            continue
        length = math.hypot(x1 - x0, z1 - z0)
        if length < 0.2:
            continue
        angle = float(intrusion_angle(x1 - x0, z1 - z0))
        cosine = ((x1 - x0) * wanted_x + (z1 - z0) * wanted_z) / length
        seen.append(f"{math.degrees(angle):.1f}")
        if cosine < math.cos(math.radians(arm.angle_tolerance_deg)):
            continue
        underground = length if run.direction == "horizontal" else abs(min(z0, 0) - min(z1, 0))
        if best is None or underground > best[0]:
            best = (underground, float(start), float(end))
    if best is None:
        way = math.degrees(float(intrusion_angle(wanted_x, wanted_z)))
        raise StrokeError(
            "wrong_path",
            f"below the surface the arm moved along gamma = {', '.join(seen) or 'nothing'} deg; the "
            f"sheet's {run.direction} at gamma {run.gamma_deg:g} is along {way:.1f} deg",
        )
    _check_plate(motion, best[1], best[2], run, arm)
    return best[1], best[2]


def _check_plate(motion: Motion, start: float, end: float, run: Run, arm: Arm) -> None:
    """Refuse a plate at another angle, or a horizontal run at another depth, than the sheet says."""
    inside = (motion.time >= start) & (motion.time <= end)
    beta = math.degrees(float(np.median(motion.angle[inside])))
    off = (beta - run.beta_deg + 90) % 180 - 90
    if abs(off) > arm.angle_tolerance_deg:
        raise StrokeError(
            "wrong_beta",
            f"the arm log shows the plate at beta = {beta:.1f} deg, the sheet says {run.beta_deg:g}",
        )
    if run.direction == "horizontal":
        depth = -float(np.median(motion.z[inside]))
        if abs(depth - run.depth_cm) > DEPTH_TOLERANCE_CM:
            raise StrokeError(
                "wrong_depth",
                f"the arm log shows a depth of {depth:.2f} cm, the sheet says {run.depth_cm:g}",
            )


def _rotation(motion: Motion, spans: FloatArray) -> tuple[float, float]:
    """Longest turn of a leg."""
    turns = [float(np.diff(np.interp(span, motion.time, motion.angle))[0]) for span in spans]
    if not turns or max(turns, key=abs) < 0 or max(turns) < math.radians(10):
        seen = ", ".join(f"{math.degrees(turn):+.0f}" for turn in turns) or "nothing"
        raise StrokeError(
            "no_rotation",
            f"the leg turned by {seen} deg; a rotation turns it by +10 deg or more in one stretch, "
            "from negative theta to positive",
        )
    start, end = spans[int(np.argmax(turns))]
    return float(start), float(end)
