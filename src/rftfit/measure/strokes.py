"""What the arm did: stretches of motion, the stroke among them, and its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.conventions import direction, intrusion_angle
from rftfit.measure.clocks import moving_spans

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.config import Arm
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray


# --- What the arm did: stretches of motion, and which of them is the stroke.


UNDERGROUND_CM = 0.3
DEPTH_TOLERANCE_CM = 0.1


class StrokeError(ValueError):
    """The motion log holds no stroke as the run sheet describes it.

    `code`: Short stable name of the cause.
    `text`: What was found and what the sheet says.
    """

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True)
class Motion:
    """Path of the intruder on the motion log's clock; arrays of shape (n,).

    `time`: s, increasing.
    `x`, `z`: Reference point in the lab frame, cm.
    `angle`: beta of a plate or theta of a leg, rad.
    """

    time: FloatArray
    x: FloatArray
    z: FloatArray
    angle: FloatArray

    def spans(self, arm: Arm) -> FloatArray:
        """Start and end of every stretch in which the arm moves or turns.

        `arm`: Half its speed is the edge of a stretch. Returns shape (k, 2): s, on the motion
        log's clock.
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

        `time`: shape (m,); s, on the motion log's clock, within the log. Returns `x`, `z`, `angle`
        of shape (m,): cm, cm, rad.
        """
        return (
            np.interp(time, self.time, self.x),
            np.interp(time, self.time, self.z),
            np.interp(time, self.time, self.angle),
        )


def find_stroke(motion: Motion, spans: FloatArray, run: Run, arm: Arm) -> tuple[float, float]:
    """Find the stretch that is the run's stroke, and refuse one that the sheet does not describe.

    `spans`: shape (k, 2); From `Motion.spans`. `run`: One row of the run sheet. Returns `start`,
    `end`: s, on the motion log's clock.
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


# --- The stroke of each run out of the long table of samples.


@dataclass(frozen=True)
class Samples:
    """Samples of one run's stroke; arrays of shape (n,), in the order of recording.

    `depth`, `x`: cm.
    `path`: Length travelled since the stroke's start, cm.
    `force`: shape (2, n); z, x; N.
    `why`: `Why` a row must not be used; GOOD where it may.
    """

    depth: FloatArray
    x: FloatArray
    angle_deg: FloatArray
    path: FloatArray
    force: FloatArray
    why: np.ndarray

    def position(self, abscissa: str) -> FloatArray:
        """Position that a tare is subtracted at.

        `abscissa`: ``depth_cm``, ``path_cm`` or ``angle_deg``. Returns shape (n,).
        """
        return {"depth_cm": self.depth, "path_cm": self.path, "angle_deg": self.angle_deg}[abscissa]


def abscissa_of(run: Run) -> str:
    """Name of the position at which a run's tare is subtracted.

    Returns depth for slanted strokes, path for horizontal ones (all of one depth), theta for legs.
    """
    if run.direction == "rotation":
        return "angle_deg"
    return "path_cm" if run.direction == "horizontal" else "depth_cm"


def split_runs(table: pd.DataFrame) -> dict[str, slice]:
    """Find the rows of each run in a table sorted by run.

    `table`: With a categorical column ``run_id``, each run's rows together.
    """
    # a table without rows comes back from Parquet without its categories
    run_id = table["run_id"].astype("category")
    codes = run_id.cat.codes.to_numpy()
    names = run_id.cat.categories
    edges = np.flatnonzero(np.diff(codes)) + 1
    starts = np.concatenate([[0], edges]) if codes.size else np.empty(0, dtype=int)
    stops = np.append(edges, codes.size)
    return {
        str(names[codes[a]]): slice(int(a), int(b)) for a, b in zip(starts, stops, strict=False)
    }


def strokes(samples: pd.DataFrame) -> dict[str, Samples]:
    """Take the stroke of every run out of the samples of the ingest stage.

    `samples`: As written by the ingest stage. Returns by run_id.
    """
    part = (samples["phase"] == "stroke").to_numpy()
    columns = {name: samples[name].to_numpy()[part] for name in ("x_cm", "depth_cm", "angle_deg")}
    force = np.stack([samples[name].to_numpy()[part] for name in ("force_z_N", "force_x_N")])
    why = samples["why"].to_numpy()[part]
    found = {}
    for name, rows in split_runs(samples.loc[part, ["run_id"]]).items():
        x, depth = columns["x_cm"][rows], columns["depth_cm"][rows]
        path = np.hypot(x - x[0], depth - depth[0])
        found[name] = Samples(depth, x, columns["angle_deg"][rows], path, force[:, rows], why[rows])
    return found
