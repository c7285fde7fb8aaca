"""Find when the arm moves, and the stroke among its motions; refuse another path, angle or depth than stated.

When does the arm move (`IntruderPath.spans`)? Which of its motions is the push, pull or turn that the row of the run
sheet means (`find_stroke`)? Is it along the stated path, with the plate at the stated angle? A run that is not is
refused.

x, z: reference point of the intruder (centre of a plate, axle of a leg), cm, z upward, 0 at the free surface;
``angle``: beta of a plate or theta of a leg, rad. A *stretch* of motion is its start and end, s, on the clock of the
motion log; k of them are an array of shape (k, 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rftfit.campaign.config import Arm
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray, direction, intrusion_angle, mirror, wrap_gamma
from rftfit.directions import SAME_DEPTH_CM, beta_apart
from rftfit.measure.clocks import is_encoder_noise, moving_spans
from rftfit.measure.flags import Refused
from rftfit.measure.levels import median
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `strokes`, says what each decides
_CHOSEN = chosen("measure", "strokes")

UNDERGROUND_CM: float = _CHOSEN.underground_cm
"""Smallest depth that a stroke must reach to count, and smallest height above the surface that counts as air."""
SHORTEST_CM: float = _CHOSEN.shortest_cm
"""Length of the shortest stroke."""


@dataclass(frozen=True)
class IntruderPath:
    """Path of the intruder on the motion log's clock; arrays of shape (n,).

    `time`: Increasing, s.
    `x`, `z`: Reference point of the intruder in the lab frame, cm.
    `angle`: Beta of a plate or theta of a leg, rad.
    """

    time: FloatArray
    x: FloatArray
    z: FloatArray
    angle: FloatArray

    def spans(self, arm: Arm) -> FloatArray:
        """Start and end, s, of every stretch in which the arm is faster than half its stated speed, shape (k, 2).

        The speed is a difference over some readings before and behind. Their number doubles until most stretches are
        longer than the noise of an encoder makes them.
        """
        if self.time.size < 3:
            return np.empty((0, 2))
        usual_step_s = median(np.diff(self.time))
        mean, noise_cm = self.averaged(arm)
        index = np.arange(self.time.size)
        most_steps = (index.size - 1) // 2
        # speed is taken over a time in which noise makes less than a tenth of it
        least_s = math.sqrt(2) * noise_cm / (0.1 * arm.speed_cm_per_s)
        steps = min(max(math.ceil(least_s / (2 * usual_step_s)), 1), most_steps)
        while True:
            # differences from `steps` readings before to `steps` behind, so that an edge is not seen half a step late
            start = np.clip(index - steps, 0, index.size - 1 - 2 * steps)
            # of each reading: time between both, s, and changes of x and z, cm, and of the angle, rad
            step_s, *changes = (
                coordinate[start + 2 * steps] - coordinate[start]
                for coordinate in (mean.time, mean.x, mean.z, mean.angle)
            )
            # relative to the stated speed
            speed = _time_at_stated_speed(arm, *changes) / step_s
            is_last = 4 * steps * usual_step_s > _CHOSEN.longest_step_s or 2 * steps > most_steps
            if is_last or not is_encoder_noise(self.time, speed):
                spans = moving_spans(self.time, speed)
                return self._join_spans(spans, arm, 2 * steps * usual_step_s)
            steps *= 2

    def _join_spans(self, spans: FloatArray, arm: Arm, least_s: float) -> FloatArray:
        """Join neighbouring stretches without a clear rest between them.

        In a clear rest the arm travels little, for longer than `least_s`, s, over which speeds are measured, and some
        positions were read: without them the clock may have been set forward. `spans`: Start and end of each stretch,
        s, shape (n, 2); returned with n rows or fewer.
        """
        if not spans.size:
            return spans
        # from the end of each stretch to the start of the next one
        rests = np.stack([spans[:-1, 1], spans[1:, 0]])
        changes = (np.diff(coordinate, axis=0)[0] for coordinate in self.pose_at(rests))
        travel_s = _time_at_stated_speed(arm, *changes)
        rest_s = rests[1] - rests[0]
        first, last = np.searchsorted(self.time, rests)
        is_rest = (
            (rest_s > least_s)
            & (travel_s < 0.5 * rest_s)
            & (last - first >= _CHOSEN.fewest_at_rest)
        )
        # a joined stretch begins with the first one or behind a rest, and ends before a rest or with the last one
        starts = spans[np.append(True, is_rest), 0]
        ends = spans[np.append(is_rest, True), 1]
        return np.column_stack([starts, ends])

    @cached_property
    def noise_cm(self) -> float:
        """Standard deviation of a position, cm, from the deviations from the line between its neighbours."""
        share = (self.time[1:-1] - self.time[:-2]) / (self.time[2:] - self.time[:-2])
        deviations = [
            coordinate[1:-1] - coordinate[:-2] - share * (coordinate[2:] - coordinate[:-2])
            for coordinate in (self.x, self.z)
        ]
        # the noisier axis counts. The median size of such a deviation is 0.826 standard deviations of a position:
        # 0.6745 times the square root of 1.5
        return max(median(np.abs(deviation)) for deviation in deviations) / 0.826

    @cached_property
    def flicker_cm(self) -> float:
        """Distance that a position may flicker because of the resolution of the sensor, cm: no turn of the arm."""
        steps = np.abs(np.concatenate([np.diff(self.x), np.diff(self.z)]))
        resolution = float(steps[steps > 0].min(initial=np.inf))
        return _CHOSEN.times_resolution * resolution if math.isfinite(resolution) else 0.0

    def averaged(self, arm: Arm) -> AveragedPath:
        """Average positions over neighbouring readings, so that their noise hides no turn of the path.

        The average extends over a distance of at most about the size of the noise, as it also smooths turns. Where the
        noise hides no turn longer than ``turn_cm``, nothing is averaged.
        """
        noise_cm = self.noise_cm
        hidden_cm = _CHOSEN.times_noise * noise_cm
        count = 1
        if hidden_cm > _CHOSEN.turn_cm:
            step_cm = arm.speed_cm_per_s * median(np.diff(self.time))
            # the noise of a mean of n readings is smaller by sqrt(n)
            enough_readings = (hidden_cm / _CHOSEN.turn_cm) ** 2
            # over `most_readings` the arm moves twice as far as the remaining noise
            most_readings = (hidden_cm / (2 * step_cm)) ** (2 / 3)
            count = max(int(min(enough_readings, most_readings, self.time.size / 4)), 1)
        if count == 1:
            return AveragedPath(self, noise_cm)
        mean = replace(self, x=_moving_mean(self.x, count), z=_moving_mean(self.z, count))
        return AveragedPath(mean, noise_cm / math.sqrt(count))

    def heading_se(self, start: float, end: float, length_cm: float) -> float:
        """Standard error of the direction that `heading` gives, rad, for a stretch of the length `length_cm`.

        That is the direction between the means of two halves of the readings, half the length apart: each mean of n / 2
        readings has the error noise sqrt(2 / n), their difference noise 2 / sqrt(n), over half the length.
        """
        readings = max(int(np.count_nonzero((self.time >= start) & (self.time <= end))), 1)
        return 4 * self.noise_cm / (length_cm * math.sqrt(readings))

    def heading(self, start: float, end: float) -> tuple[float, float]:
        """Unit vector (x, z) of the direction of a straight stretch from `start` to `end`, s.

        It goes from the mean position of the first half to that of the second, over which noise averages out.
        """
        halves = np.linspace([start, (start + end) / 2], [(start + end) / 2, end], 101)
        x, z, _ = self.pose_at(halves)
        (x,), (z,) = np.diff(x.mean(axis=0)), np.diff(z.mean(axis=0))
        length = math.hypot(x, z)
        return x / length, z / length

    def fastest_below(self) -> float:
        """Speed, cm/s, that a tenth of the samples below the surface exceed; 0 if there are fewer than three.

        A message names it where no motion is as fast as the config states.
        """
        below = self.z < 0
        if np.count_nonzero(below) < 3:
            return 0.0
        speed = np.hypot(*(np.gradient(coordinate, self.time) for coordinate in (self.x, self.z)))
        return float(np.quantile(speed[below], 0.9))

    def pose_at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return x, z (cm) and angle (rad) at other times, linear between samples."""
        x, z, angle = (
            np.interp(time, self.time, coordinate) for coordinate in (self.x, self.z, self.angle)
        )
        return x, z, angle


class AveragedPath(NamedTuple):
    """Path whose positions are means of neighbouring readings, and the standard deviation of such a mean, cm."""

    path: IntruderPath
    noise_cm: float


def _time_at_stated_speed(arm: Arm, x: FloatArray, z: FloatArray, angle: FloatArray) -> FloatArray:
    """Time that the arm needs for changes of position, cm, and angle, rad, at the speeds of the config, s, shape (n,).

    So turns of a leg and moves of a plate can be measured by one number.
    """
    return np.asarray(
        np.maximum(np.hypot(x, z) / arm.speed_cm_per_s, np.abs(angle) / arm.leg_speed_rad_per_s)
    )


def _moving_mean(values: FloatArray, count: int) -> FloatArray:
    """Mean of the `count` values around each of `values`, shape (n,); of fewer near the ends."""
    # sum of the first k values, so that a sum over neighbours is a difference of two
    total = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(values.size)
    start = np.maximum(index - count // 2, 0)
    end = np.minimum(index - count // 2 + count, values.size)
    return np.asarray((total[end] - total[start]) / (end - start))


_MOST_HIDDEN_CM = 2 * SHORTEST_CM
"""Largest noise of the position: a motion back that noise hides could be the end of a stroke."""


def find_stroke(motion: IntruderPath, spans: FloatArray, run: Run, arm: Arm) -> tuple[float, float]:
    """Find start and end of the stroke of a run, s, on the clock of `motion`, or refuse the run.

    A leg turns, and an arm that is not driven steadily goes down to its lowest point. All others move straight below
    the surface along the stated path, at the stated speed, with the plate as stated.

    `spans`: Stretches of motion, from `IntruderPath.spans`.
    """
    if run.kind in ("leg", "leg_air"):
        return _select_stroke(_find_rotations(motion, spans), run, "deg")
    if arm.drive != "steady" and run.direction == "intrusion" and run.gamma_deg == 90:
        return _select_stroke(_find_uneven_pushes(motion), run, "cm")
    mean, noise_cm = motion.averaged(arm)
    if (hidden := _CHOSEN.times_noise * noise_cm) > _MOST_HIDDEN_CM:
        noise_mm = 10 * motion.noise_cm
        raise Refused("noisy-position", noise_mm=noise_mm, hidden=hidden, most=_MOST_HIDDEN_CM)
    if (lowest := float(mean.z.min())) > -UNDERGROUND_CM:
        # a path that begins at its lowest point and goes up by more than 1 cm has z downward
        upside_down = mean.z[0] < min(lowest + 0.1, mean.z.max() - 1)
        code = "upside-down" if upside_down else "surface-not-reached"
        raise Refused(code, lowest=lowest, least=-UNDERGROUND_CM)
    least_turn_cm = max(hidden, motion.flicker_cm)
    strokes = _stretches_along_path(motion, mean, least_turn_cm, spans, run, arm)
    start, end = _select_stroke(strokes, run, "cm", _cure_of_several(strokes, motion, run))
    _check_plate(motion, start, end, run, arm)
    return start, end


_StrokeSpan = tuple[float, float, float]
"""A possible stroke: its length, cm (deg for a leg), its start and its end, s."""


def _cure_of_several(strokes: Sequence[_StrokeSpan], motion: IntruderPath, run: Run) -> str:
    """Return a hint for the message "several strokes", if they may be one push at a varying speed; else no text.

    `strokes`: Those that were found at the stated speed.
    """
    if len(strokes) < 2 or run.direction != "intrusion" or run.gamma_deg != 90:
        return ""
    try:
        is_one = len(_find_uneven_pushes(motion)) == 1
    except Refused:
        return ""
    return "; if it is one push at a speed that varies: arm.drive: uneven" if is_one else ""


_MOST_NAMED = 6
"""Most lengths of strokes named in one message."""


def _select_stroke(
    strokes: Sequence[_StrokeSpan], run: Run, unit: str, cure: str = ""
) -> tuple[float, float]:
    """Return start and end of the stroke whose number the run sheet names, or of the only stroke.

    Refused if the sheet names none of several, or one that is not there. `unit`: Of the lengths, for the message.
    `cure`: Hint that ends the message if there are several strokes and the sheet names none.
    """
    if run.stroke is None and len(strokes) > 1:
        lengths = [f"{length:.1f}" for length, _, _ in strokes]
        if len(set(lengths)) == 1:
            lengths = lengths[:1]
        elif len(lengths) > _MOST_NAMED:
            lengths = [*lengths[:_MOST_NAMED], "..."]
        raise Refused(
            "several-strokes", count=len(strokes), lengths=", ".join(lengths), unit=unit, cure=cure
        )
    number = run.stroke or 1
    if number > len(strokes):
        raise Refused("no-such-stroke", wanted=run.stroke, found=len(strokes))
    return strokes[number - 1][1:]


MIRRORED_CURE = (
    ". Seen from behind the rig it is that way: mirror what the logs of these runs say along x (x of the motion log, the channel of "
    "the transducer, beta)"
)
"""Cure of a run that moved to the other side."""


def _stretches_along_path(
    motion: IntruderPath,
    mean: IntruderPath,
    least_turn_cm: float,
    spans: FloatArray,
    run: Run,
    arm: Arm,
) -> list[_StrokeSpan]:
    """Find straight stretches below the surface along the path that the run sheet names; refuse if there are none.

    `motion`: The path as read. `mean`: The same path with positions that are means of neighbouring readings.
    `least_turn_cm`: Way back or aside, cm, up to which it is noise. `spans`: Stretches of motion, s, shape (k, 2).
    """
    wanted_x, wanted_z = (
        float(component) for component in direction(math.radians(run.motion_gamma_deg))
    )
    tolerance = math.radians(arm.angle_tolerance_deg)
    along: list[_StrokeSpan] = []
    # length, cm, and gamma, degrees, of every straight stretch below the surface
    seen: list[tuple[float, float]] = []
    stretches: list[tuple[float, float]] = []
    for first, last in spans.tolist():
        stretches += _split_at_turns(mean, first, last, least_turn_cm)
    for first, last in stretches:
        start, end = _part_below_surface(mean, first, last)
        (x0, x1), (z0, z1), _ = mean.pose_at(np.array([start, end]))
        length = math.hypot(x1 - x0, z1 - z0)
        if min(z0, z1) > -UNDERGROUND_CM or length < SHORTEST_CM:
            continue
        along_x, along_z = mean.heading(start, end)
        seen.append((length, math.degrees(float(intrusion_angle(along_x, along_z)))))
        allowed = max(tolerance, _CHOSEN.times_heading * motion.heading_se(start, end, length))
        if along_x * wanted_x + along_z * wanted_z >= math.cos(allowed):
            along.append((length, float(start), float(end)))
    if not seen:
        fastest = motion.fastest_below()
        raise Refused("too-slow", least=SHORTEST_CM, stated=arm.speed_cm_per_s, fastest=fastest)
    if not along:
        # would the mirror image of a stretch be along the path?
        gamma = np.radians([angle_deg for _, angle_deg in seen])
        _, mirrored_gamma = mirror(np.zeros(gamma.size), gamma)
        off = np.abs(wrap_gamma(mirrored_gamma - math.radians(run.motion_gamma_deg)))
        raise Refused(
            "other-direction",
            cure=MIRRORED_CURE if (off <= tolerance).any() else "",
            seen=", ".join(f"{angle_deg:.1f}" for _, angle_deg in seen),
            seen_deg=max(seen)[1],
            tolerance=arm.angle_tolerance_deg,
            direction=run.direction,
            gamma=run.gamma_deg,
            way=run.motion_gamma_deg,
        )
    return along


def _split_at_turns(
    motion: IntruderPath, start: float, end: float, least_cm: float
) -> list[tuple[float, float]]:
    """Split a stretch of motion, `start` to `end`, s, where it turns back or aside by more than `least_cm`.

    An arm may turn without a pause, so that one stretch holds a push and the pull behind it. Each part is split again
    until none turns. Returns start and end of each part, s.
    """
    inside = slice(
        np.searchsorted(motion.time, start), np.searchsorted(motion.time, end, side="right")
    )
    time, x, z = motion.time[inside], motion.x[inside], motion.z[inside]
    if x.size < 3:
        return [(start, end)]
    turns = _find_reversals(x - x.mean(), z - z.mean(), max(_CHOSEN.turn_cm, least_cm))
    turns = turns or _find_corner(x, z, max(_CHOSEN.corner_cm, least_cm))
    if not turns:
        return [(start, end)]
    stretches: list[tuple[float, float]] = []
    for begin, stop in pairwise([start, *time[turns].tolist(), end]):
        stretches += _split_at_turns(motion, begin, stop, least_cm)
    return stretches


def _find_reversals(x: FloatArray, z: FloatArray, least_cm: float) -> list[int]:
    """Return the rows at which a path turns back along its main direction by more than `least_cm`.

    A turn is the farthest position before the path has come back by `least_cm`, so noise below that makes none.

    `x`, `z`: Positions relative to their means, cm, shape (n,).
    """
    # angle of the axis of largest variance
    main = math.atan2(2 * float(x @ z), float(x @ x - z @ z)) / 2
    along_cm = x * math.cos(main) + z * math.sin(main)
    backward_cm = [
        float((np.maximum.accumulate(position) - position).max())
        for position in (along_cm, -along_cm)
    ]
    turns: list[int] = []
    if min(backward_cm) <= least_cm:
        return turns
    # rows of the lowest and highest position since the last turn; None: the path has not moved by `least_cm` yet
    low = high = 0
    rising: bool | None = None
    positions = along_cm.tolist()
    for row, position in enumerate(positions):
        low = row if position < positions[low] else low
        high = row if position > positions[high] else high
        if not rising and position - positions[low] > least_cm:
            turns += [] if rising is None else [low]
            rising, high = True, row
        elif rising is not False and positions[high] - position > least_cm:
            turns += [] if rising is None else [high]
            rising, low = False, row
    return turns


def _find_corner(x: FloatArray, z: FloatArray, least_cm: float) -> list[int]:
    """Return the row farthest from the chord of a path, if it is a corner more than `least_cm` from it; else no row.

    The chord is the line from the first to the last position. A corner changes the direction by ``corner_deg`` or more.
    """
    dx, dz = x[-1] - x[0], z[-1] - z[0]
    distance_cm = np.abs(dx * (z - z[0]) - dz * (x - x[0])) / max(math.hypot(dx, dz), SHORTEST_CM)
    corner = int(distance_cm.argmax())
    ends = np.array([[x[0], x[corner], x[-1]], [z[0], z[corner], z[-1]]])
    before, after = np.diff(ends).T
    lengths = float(np.hypot(*before)), float(np.hypot(*after))
    if distance_cm[corner] < least_cm or min(lengths) < SHORTEST_CM:
        return []
    cosine = float(before @ after) / (lengths[0] * lengths[1])
    return [] if cosine > math.cos(math.radians(_CHOSEN.corner_deg)) else [corner]


def _part_below_surface(motion: IntruderPath, start: float, end: float) -> tuple[float, float]:
    """Cut a stretch at the surface, if the arm crosses it without a stop; return start and end of the part below, s."""
    inside = motion.time[(motion.time > start) & (motion.time < end)]
    time = np.concatenate([[start], inside, [end]])
    z = np.interp(time, motion.time, motion.z)
    above, below = np.flatnonzero(z > 0), np.flatnonzero(z <= 0)
    if not above.size or not below.size:
        return start, end

    def crossing(above: int, below: int) -> float:
        """Interpolate the time at which z is 0 between two rows, s."""
        share = z[above] / (z[above] - z[below])
        return float(time[above] + share * (time[below] - time[above]))

    # a stretch that begins or ends only slightly above the surface has a pause there, and is kept whole
    if z[0] > UNDERGROUND_CM and z[-1] < 0:
        start = crossing(above[-1], above[-1] + 1)
    elif z[-1] > UNDERGROUND_CM and z[0] < 0:
        end = crossing(above[0], above[0] - 1)
    return start, end


def _find_uneven_pushes(motion: IntruderPath) -> list[_StrokeSpan]:
    """Find the pushes of an arm that is not driven steadily: from the surface straight down to the lowest point.

    Its speed says nothing, as a hand stops and starts on the way, so the depth alone decides.
    """
    z = motion.z
    if (lowest := float(z.min())) > -5 * _CHOSEN.bottom_cm or z.max() < -_CHOSEN.contact_cm:
        raise Refused("surface-not-crossed", highest=z.max(), lowest=lowest)
    # first row of every stay below the surface, and its lowest z; a stay counts if it is as deep as a stroke, or the deepest
    start_rows = np.flatnonzero((z <= 0) & np.append(True, z[:-1] > 0))
    lows = np.minimum.reduceat(z, start_rows)
    is_deep = lows <= max(lowest, -UNDERGROUND_CM)
    begins_at_contact = bool(z[0] >= -_CHOSEN.contact_cm)
    if start_rows[0] == 0 and lows[0] == lowest and not begins_at_contact:
        raise Refused("begins-below")
    pushes = []
    for start_row, low in zip(start_rows[is_deep], lows[is_deep], strict=True):
        end = start_row + int(np.argmax(z[start_row:] <= low + _CHOSEN.bottom_cm))
        if start_row > 0 or begins_at_contact:
            start = float(motion.time[max(start_row - 1, 0)])
            pushes.append((-float(low), start, float(motion.time[end])))
    return pushes


def _check_plate(motion: IntruderPath, start: float, end: float, run: Run, arm: Arm) -> None:
    """Refuse a plate at another angle, or a horizontal run at another depth, than the run sheet states.

    `start`, `end`: Of the stroke, s; the medians of angle and depth over it count.
    """
    inside = (motion.time >= start) & (motion.time <= end)
    beta = math.degrees(median(motion.angle[inside]))
    angle_error_deg = abs(float(beta_apart(beta, run.beta_deg)))
    if math.isfinite(run.beta_deg) and angle_error_deg > arm.angle_tolerance_deg:
        tolerance = arm.angle_tolerance_deg
        raise Refused("other-angle", found=beta, stated=run.beta_deg, tolerance=tolerance)
    if run.direction == "horizontal":
        depth = -median(motion.z[inside])
        if abs(depth - run.depth_cm) > SAME_DEPTH_CM:
            raise Refused("other-depth", found=depth, stated=run.depth_cm)


def _find_rotations(motion: IntruderPath, spans: FloatArray) -> list[_StrokeSpan]:
    """Find the stretches of motion in which a leg turns far enough toward positive theta; refuse if there are none.

    Refused, too, if the largest turn is the other way. Lengths are in degrees.
    """
    _, _, theta = motion.pose_at(spans)
    turns = np.degrees(np.diff(theta)).ravel().tolist()
    least_deg = _CHOSEN.least_turn_deg
    if not turns or max(turns, key=abs) < 0 or max(turns) < least_deg:
        seen = ", ".join(f"{turn:+.0f}" for turn in turns) or "nothing"
        raise Refused("no-rotation", seen=seen, least=least_deg)
    strokes = zip(turns, spans.tolist(), strict=True)
    return [(turn, start, end) for turn, (start, end) in strokes if turn >= least_deg]
