"""What the arm did: stretches of motion, the stroke among them, and its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.conventions import direction, intrusion_angle
from rftfit.measure.clocks import moving_spans
from rftfit.measure.flags import Refused

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from rftfit.campaign.config import Arm
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray


UNDERGROUND_CM = 0.3
DEPTH_TOLERANCE_CM = 0.1
SHORTEST_CM = 0.2
BOTTOM_CM = 0.02
_STROKE_SHARE = 0.5
_CORNER_CM, _CORNER_DEG = 0.1, 10.0


@dataclass(frozen=True)
class Motion:
    """Path of the intruder on the motion log's clock; arrays of shape (n,).

    `time` (s) increases; `x`, `z` (cm) of the reference point in the lab frame; `angle` (rad): beta of a
    plate or theta of a leg.
    """

    time: FloatArray
    x: FloatArray
    z: FloatArray
    angle: FloatArray

    def spans(self, arm: Arm) -> FloatArray:
        """Start and end, s, of every stretch in which the arm is faster than half its speed: (k, 2)."""
        if self.time.size < 3:
            return np.empty((0, 2))
        step = self.time[2:] - self.time[:-2]
        # central differences, so that an edge is not seen half a step late
        speed = np.hypot(self.x[2:] - self.x[:-2], self.z[2:] - self.z[:-2])
        turning = np.abs(self.angle[2:] - self.angle[:-2])
        relative = np.maximum(speed / arm.speed_cm_per_s, turning / arm.leg_speed_rad_per_s)
        return moving_spans(self.time[1:-1], relative / step, 0.5)

    def fastest_below(self) -> float:
        """Largest speed below the surface, cm/s, over a tenth of the samples there at least."""
        below = self.z < 0
        if np.count_nonzero(below) < 3:
            return 0.0
        speed = np.hypot(*(np.gradient(part, self.time) for part in (self.x, self.z)))
        return float(np.quantile(speed[below], 0.9))

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return x, z (cm) and angle (rad) at other times, linear between samples."""
        return (
            np.interp(time, self.time, self.x),
            np.interp(time, self.time, self.z),
            np.interp(time, self.time, self.angle),
        )


def find_stroke(motion: Motion, spans: FloatArray, run: Run, arm: Arm) -> tuple[float, float]:
    """Find start and end of a run's stroke, s, in the spans of its motion, or refuse it."""
    if run.kind in ("leg", "leg_air"):
        return _rotation(motion, spans)
    if arm.drive != "steady" and run.direction == "intrusion" and run.gamma_deg == 90:
        return _uneven_push(motion)
    if (lowest := float(motion.z.min())) > -UNDERGROUND_CM:
        upside_down = motion.z[0] < min(lowest + 0.1, motion.z.max() - 1)
        code = "upside-down" if upside_down else "surface-not-reached"
        raise Refused(code, lowest=lowest)
    start, end = _longest_along(motion, spans, run, arm)
    _check_plate(motion, start, end, run, arm)
    return start, end


def _longest_along(motion: Motion, spans: FloatArray, run: Run, arm: Arm) -> tuple[float, float]:
    """Longest stretch below the surface along the path that the sheet names."""
    wanted_x, wanted_z = (float(part) for part in direction(math.radians(run.gamma_deg)))
    if run.direction == "extraction" and run.gamma_deg > 0:
        wanted_x, wanted_z = -wanted_x, -wanted_z
    along: list[tuple[float, float, float]] = []
    seen: list[str] = []
    parts = [part for first, last in spans for part in _straight(motion, float(first), float(last))]
    for first, last in parts:
        start, end = _below(motion, first, last)
        (x0, x1), (z0, z1), _ = motion.at(np.array([start, end]))
        length = math.hypot(x1 - x0, z1 - z0)
        if min(z0, z1) > -UNDERGROUND_CM or length < SHORTEST_CM:
            continue
        seen.append(f"{math.degrees(float(intrusion_angle(x1 - x0, z1 - z0))):.1f}")
        cosine = ((x1 - x0) * wanted_x + (z1 - z0) * wanted_z) / length
        if cosine >= math.cos(math.radians(arm.angle_tolerance_deg)):
            underground = length if run.direction == "horizontal" else abs(min(z0, 0) - min(z1, 0))
            along.append((underground, float(start), float(end)))
    if not seen:
        fastest = motion.fastest_below()
        raise Refused("too-slow", least=SHORTEST_CM, stated=arm.speed_cm_per_s, fastest=fastest)
    if not along:
        way = math.degrees(float(intrusion_angle(wanted_x, wanted_z)))
        raise Refused(
            "other-direction",
            seen=", ".join(seen),
            direction=run.direction,
            gamma=run.gamma_deg,
            way=way,
        )
    longest = max(along, key=lambda one: one[0])
    if run.stroke is None:
        return longest[1:]
    # in the order of time; a stretch much shorter than the others is no stroke
    strokes = [one for one in along if one[0] > _STROKE_SHARE * longest[0]]
    if run.stroke > len(strokes):
        raise Refused("no-such-stroke", wanted=run.stroke, found=len(strokes))
    return strokes[run.stroke - 1][1:]


def _straight(motion: Motion, start: float, end: float) -> list[tuple[float, float]]:
    """Part a stretch at its corners: an arm may change its direction without a pause."""
    inside = (motion.time > start) & (motion.time < end)
    x, z = motion.x[inside], motion.z[inside]
    if x.size < 3:
        return [(start, end)]
    dx, dz = x[-1] - x[0], z[-1] - z[0]
    off = np.abs(dx * (z - z[0]) - dz * (x - x[0])) / max(math.hypot(dx, dz), SHORTEST_CM)
    corner = int(off.argmax())
    ends = np.array([[x[0], x[corner], x[-1]], [z[0], z[corner], z[-1]]])
    before, after = np.diff(ends).T
    lengths = float(np.hypot(*before)), float(np.hypot(*after))
    if off[corner] < _CORNER_CM or min(lengths) < SHORTEST_CM:
        return [(start, end)]
    cosine = float(before @ after) / (lengths[0] * lengths[1])
    if cosine > math.cos(math.radians(_CORNER_DEG)):
        return [(start, end)]
    at = float(motion.time[inside][corner])
    return _straight(motion, start, at) + _straight(motion, at, end)


def _below(motion: Motion, start: float, end: float) -> tuple[float, float]:
    """Part of a stretch below the surface, of an arm that does not stop there: its times, s."""
    inside = motion.time[(motion.time > start) & (motion.time < end)]
    time = np.concatenate([[start], inside, [end]])
    z = motion.at(time)[1]
    above, below = np.flatnonzero(z > 0), np.flatnonzero(z <= 0)
    if not above.size or not below.size:
        return start, end

    def crossing(one: int, other: int) -> float:
        share = z[one] / (z[one] - z[other])
        return float(time[one] + share * (time[other] - time[one]))

    # a little above the surface is where strokes begin that pause there
    if z[0] > UNDERGROUND_CM and z[-1] < 0:
        start = crossing(above[-1], above[-1] + 1)
    elif z[-1] > UNDERGROUND_CM and z[0] < 0:
        end = crossing(above[0], above[0] - 1)
    return start, end


def _uneven_push(motion: Motion) -> tuple[float, float]:
    """Stroke of an arm that is not driven steadily: from the surface straight down to the bottom."""
    lowest = float(motion.z.min())
    above = np.flatnonzero(motion.z > 0)
    if lowest > -5 * BOTTOM_CM or not above.size:
        raise Refused("surface-not-crossed", highest=motion.z.max(), lowest=lowest)
    end = int(np.argmax(motion.z <= lowest + BOTTOM_CM))
    before = above[above < end]
    if not before.size:
        raise Refused("begins-below")
    return float(motion.time[before[-1]]), float(motion.time[end])


def _check_plate(motion: Motion, start: float, end: float, run: Run, arm: Arm) -> None:
    """Refuse a plate at another angle, or a horizontal run at another depth, than the sheet says."""
    inside = (motion.time >= start) & (motion.time <= end)
    beta = math.degrees(float(np.median(motion.angle[inside])))
    off = (beta - run.beta_deg + 90) % 180 - 90
    if abs(off) > arm.angle_tolerance_deg:
        raise Refused("other-angle", found=beta, stated=run.beta_deg)
    if run.direction == "horizontal":
        depth = -float(np.median(motion.z[inside]))
        if abs(depth - run.depth_cm) > DEPTH_TOLERANCE_CM:
            raise Refused("other-depth", found=depth, stated=run.depth_cm)


def _rotation(motion: Motion, spans: FloatArray) -> tuple[float, float]:
    """Longest turn of a leg."""
    turns = [float(np.diff(np.interp(span, motion.time, motion.angle))[0]) for span in spans]
    if not turns or max(turns, key=abs) < 0 or max(turns) < math.radians(10):
        seen = ", ".join(f"{math.degrees(turn):+.0f}" for turn in turns) or "nothing"
        raise Refused("no-rotation", seen=seen)
    start, end = spans[int(np.argmax(turns))]
    return float(start), float(end)


@dataclass(frozen=True)
class Samples:
    """Samples of one run's stroke, in the order of recording; arrays of shape (n,), `force` (2, n) z, x, N.

    `depth`, `x`, `path` (length travelled since the stroke's start) in cm; `why`: `RowStatus`.
    """

    depth: FloatArray
    x: FloatArray
    angle_deg: FloatArray
    path: FloatArray
    force: FloatArray
    why: np.ndarray

    def position(self, abscissa: str) -> FloatArray:
        """Position at which a tare is subtracted: ``depth_cm``, ``path_cm`` or ``angle_deg``."""
        return {"depth_cm": self.depth, "path_cm": self.path, "angle_deg": self.angle_deg}[abscissa]


def split_runs(table: pd.DataFrame) -> dict[str, slice]:
    """Find the rows of each run in a table whose categorical column ``run_id`` is sorted by run."""
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


def join_runs(
    parts: Mapping[str, Mapping[str, np.ndarray]], columns: Sequence[str]
) -> pd.DataFrame:
    """Put columns of several runs into one long table; names are categories, which keeps it small."""
    import pandas as pd

    sizes = [part[columns[0]].size for part in parts.values()]
    codes = np.repeat(np.arange(len(parts)), sizes)
    data: dict[str, object] = {
        "run_id": pd.Categorical.from_codes(codes, categories=pd.Index(list(parts)))
    }
    for name in columns:
        arrays = [part[name] for part in parts.values()]
        data[name] = np.concatenate(arrays) if arrays else np.empty(0)
    return pd.DataFrame(data, copy=False)  # these arrays are nobody else's


def strokes(samples: pd.DataFrame) -> dict[str, Samples]:
    """Take the stroke of every run, by run_id, out of the samples of the ingest stage."""
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
