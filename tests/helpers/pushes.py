"""Pushes with a known truth: on two clocks, with what sand and cables do to readings, by machines and arms."""

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.campaign.config import Arm
from rftfit.campaign.sheet import Run
from rftfit.conventions import direction
from rftfit.logs.base import Log, LogError
from rftfit.measure.alignment import estimate_clocks
from rftfit.measure.flags import Refused
from rftfit.measure.lab_frame import path_in_lab_frame
from rftfit.measure.readings import clean, without_holds, without_lone_positions
from rftfit.measure.strokes import IntruderPath, find_stroke

# --- The row of a run sheet ---------------------------------------------------------------------------------------


def plate_run(run_id="r1", **cells):
    """A plate of the paper that is pushed straight down, with nothing else said, but for some cells."""
    values: dict[str, Any] = {
        "kind": "plate",
        "medium": "poppy_LP",
        "intruder": "plate",
        "direction": "intrusion",
        "beta_deg": 0.0,
        "gamma_deg": 90.0,
        "depth_cm": math.nan,
        "force_log": f"{run_id}.csv",
        "motion_log": "b.csv",
        "row": 2,
    }
    return Run(run_id, **values | cells)


# --- Pushes into sand on two clocks, from a known truth, for tests of clocks and surface --------------------------


@dataclass(frozen=True)
class Push:
    """What the two logs hold, and the truth: motion time = force time + offset + drift x (t - t0)."""

    force_time: np.ndarray
    force: np.ndarray
    motion_time: np.ndarray
    depth: np.ndarray
    offset_s: float
    drift: float
    surface_cm: float

    def offset_at(self, time):
        """Return the true offset at a time of the force log."""
        return self.offset_s + self.drift * (time - float(self.force_time[0]))


def make_push(
    seed,
    *,
    offset_s=0.0,
    drift=0.0,
    stiffness=25.0,
    bend=0.0,
    by_hand=True,
    rate_Hz=100.0,
    noise_N=0.05,
    medium_N=0.3,
    memory_s=0.15,
    start_s=1.6e9,
):
    """Go down 3 cm in air and 4 cm into a medium; by hand, or at 1 cm/s with a pause at the surface."""
    random = np.random.default_rng(seed)
    fine = np.arange(0, 24, 0.002)
    if by_hand:
        pushes = np.interp(fine, np.arange(0, 26, 0.7), random.gamma(1.2, 1.0, 38))
        speed = np.where((fine > 2) & (fine < 20), pushes, 0.0)
        depth = np.cumsum(speed)
        depth = depth / depth[-1] * 7.0
    else:
        depth = np.interp(fine, [3, 6, 8, 12], [0.0, 3.0, 3.0, 7.0])
    surface = 3.0 + 0.1 * random.standard_normal() if by_hand else 3.0
    length = int(22 * rate_Hz)
    moments = 1.0 + np.arange(length) / rate_Hz
    # grains rearrange: their force has a memory, and grows with the force itself
    keep = np.exp(-1 / (rate_Hz * memory_s))
    grains = np.zeros(length)
    kicks = random.standard_normal(length) * np.sqrt(1 - keep**2)
    for index in range(1, length):
        grains[index] = keep * grains[index - 1] + kicks[index]
    under = np.maximum(np.interp(moments, fine, depth) - surface, 0.0)
    lift = stiffness * under + bend * under**2
    force = (
        lift
        + medium_N * grains * np.minimum(under, 1.0)
        + noise_N * random.standard_normal(length)
        - 1.5
    )
    rows = np.arange(0.0, 24.0, 0.019) + random.uniform(0, 0.003, 1264)
    motion = np.interp(rows, fine, depth) + 0.0005 * random.standard_normal(rows.size)
    shift = start_s + offset_s + drift * (rows - moments[0])
    return Push(
        start_s + moments,
        np.round(force, 4),
        rows + shift,
        np.round(motion, 4),
        offset_s,
        drift,
        surface,
    )


def estimate(push, max_se_s=0.2, max_drift=1e-3):
    """Align the two clocks of a push by its force."""
    return estimate_clocks(
        push.force_time, push.force, push.motion_time, push.depth, max_drift, max_se_s
    )


# --- Readings of one push at constant speed, and what sand and a loose cable do to them ---------------------------

RATE_HZ, SPEED_CM_PER_S, N_PER_CM, NOISE_N = 50.0, 0.5, 20.0, 0.02


def push(random, seconds=14.0):
    """Time, height (cm) and force (N) of a push at constant speed after a second of rest in air."""
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    height = 1.0 - SPEED_CM_PER_S * np.clip(time - 1.0, 0, None)
    force = N_PER_CM * np.clip(-height, 0, None)
    return time, height, force + NOISE_N * random.normal(size=time.size)


def stick_slip(random, time):
    """Force that rises by springs of some stiffness and slips by a part of itself, at a few to 30 Hz."""
    rate_hz = random.uniform(2, 30)
    phase = (time * rate_hz + random.random()) % 1
    return random.uniform(0.02, 0.3) * (phase - 0.5)


def irregular_slip(random, time):
    """Force that rises and slips by a part of itself between a third and all, after times that differ."""
    step_s, slips_per_s = time[1] - time[0], random.uniform(2, 15)
    growth_per_s = random.uniform(0.02, 0.3) * slips_per_s
    level, parts, next_slip_s = 0.0, [], random.exponential(1 / slips_per_s)
    for now_s in step_s * np.arange(1, time.size + 1):
        level += growth_per_s * step_s
        if now_s > next_slip_s:
            level *= 1 - random.uniform(1 / 3, 1.0)
            next_slip_s = now_s + random.gamma(2, 0.5 / slips_per_s)
        parts.append(level)
    return np.array(parts) - np.mean(parts)


def slip_among_stones(random, time):
    """Force that slips while stones are pushed aside."""
    return stick_slip(random, time) + stones(random, time)


def crust(random, time):
    """Force that falls by half within one reading, and rises again."""
    breaks = random.uniform(4, 10)
    return np.where(time < breaks, 0.5 * np.exp(-((time - breaks) ** 2)), 0.0)


def stones(random, time):
    """Some stones that are pushed aside, each over 0.06 to 0.3 s."""
    bumps = np.zeros(time.size)
    for middle in random.uniform(3, time[-1], 6):
        bumps += random.uniform(0.05, 0.4) * np.exp(
            -(((time - middle) / random.uniform(0.06, 0.3)) ** 2)
        )
    return bumps


# --- Motions of testing machines and arms, with the strokes that are truly in them --------------------------------

AIR_CM = 2.0
UNDERGROUND_CM, SHORTEST_CM = 0.1, 0.3
"""Least depth and least length of a stroke that counts."""
LONE_CM = 0.5, 3.0
"""Least and largest distance of a lone reading from the path."""
NAN = float("nan")
RIGHT, WRONG, REFUSED = "right", "wrong", "refused"


def row(gamma_deg, stroke=None, way="", depth_cm=NAN):
    """A row of a run sheet: an intrusion or a horizontal run, unless it says extraction."""
    way = way or ("intrusion" if gamma_deg else "horizontal")
    return plate_run(direction=way, gamma_deg=gamma_deg, depth_cm=depth_cm, stroke=stroke)


@dataclass(frozen=True)
class Pushes:
    """Pushes out and back, one after the other, each along `gamma_deg` and back to where it began.

    `lengths_cm`: of each push. `begins`: at rest in air, at the surface without a rest, or below it; level ones
    begin below. `back`: how much of the way each goes back. `stated`: the speed that the config says, of the true one.
    `dwell_s`: rest at either end. `noise_cm`: standard deviation and step of the encoder. `lone`: positions that
    are 0.5 to 3 cm off, each between two good ones.
    """

    gamma_deg: float = 90.0
    lengths_cm: tuple[float, ...] = (4.0,)
    begins: str = "air"
    back: float = 1.0
    stated: float = 1.0
    rate_Hz: float = 100.0
    speed_cm_per_s: float = 1.0
    dwell_s: float = 0.0
    noise_cm: tuple[float, float] = (0.0, 0.0)
    lone: int = 0
    seed: int = 0

    @property
    def top_cm(self):
        """Where each push begins."""
        if not self.gamma_deg:
            return -3.0
        return {"air": AIR_CM, "contact": 0.0, "below": -1.0}[self.begins]

    @property
    def arm(self):
        return Arm(speed_cm_per_s=self.stated * self.speed_cm_per_s, position_unit="cm")

    def corners(self):
        """Time, s, and way along the path, cm, of every corner: shape (n, 2)."""
        rest_s = 1.0 if self.begins == "air" else 0.0
        corners, time = [(0.0, 0.0)], rest_s
        if rest_s:
            corners.append((time, 0.0))
        for length in self.lengths_cm:
            for way_cm in (length, (1 - self.back) * length):
                time += abs(way_cm - corners[-1][1]) / self.speed_cm_per_s
                corners.append((time, way_cm))
                if self.dwell_s:
                    time += self.dwell_s
                    corners.append((time, way_cm))
        return np.array([*corners, (time + rest_s, corners[-1][1])] if rest_s else corners)

    def motion(self):
        random = np.random.default_rng(self.seed)
        corners = self.corners()
        time = np.arange(0, corners[-1, 0] + 1e-9, 1 / self.rate_Hz)
        way = np.interp(time, *corners.T)
        sd, step = self.noise_cm
        x, z = (
            component * way + random.normal(0, sd, time.size)
            for component in direction(math.radians(self.gamma_deg))
        )
        if step:
            x, z = (
                np.round(x / step) * step,
                np.round((z + self.top_cm) / step) * step - self.top_cm,
            )
        return IntruderPath(time, x, z + self.top_cm, np.zeros(time.size))

    def path_as_read(self):
        """Path after the steps that `rftfit run` takes a motion log through, or why these refuse the log."""
        columns = vars(self.motion())
        random = np.random.default_rng([self.seed, self.lone])
        places: list[int] = []
        for place in random.permutation(columns["time"].size):
            if len(places) < self.lone and all(abs(place - chosen) > 1 for chosen in places):
                places.append(place)
        for place in places:
            off_cm = random.uniform(*LONE_CM) * random.choice([-1, 1])
            columns[random.choice(["x", "z"])][place] += off_cm
        units = {"time": "s", "x": "cm", "z": "cm", "angle": "deg"}
        log = Log(Path("log.csv"), columns, units, columns["time"].size)
        try:
            log = without_holds(without_lone_positions(clean(log)))
        except LogError as error:
            return error
        return path_in_lab_frame(log, row(self.gamma_deg), self.arm)

    def strokes(self, *, back=False):
        """Start and end, s, of each push that goes below the surface, or of each pull."""
        down = -math.sin(math.radians(self.gamma_deg))
        strokes = []
        for (begin, from_cm), (end, to_cm) in pairwise(self.corners()):
            if from_cm == to_cm or (to_cm < from_cm) != back:
                continue
            z = self.top_cm + down * from_cm, self.top_cm + down * to_cm
            if min(z) > -UNDERGROUND_CM:
                continue
            ends = begin, end
            if max(z) > UNDERGROUND_CM:
                crossing = begin + (end - begin) * z[0] / (z[0] - z[1])
                ends = (begin, crossing) if back else (crossing, end)
            if (ends[1] - ends[0]) * self.speed_cm_per_s >= SHORTEST_CM:
                strokes.append(ends)
        return strokes

    def judge(self):
        """What becomes of each row that may be written of this log, and the reason."""
        path, outcomes = self.path_as_read(), []
        if isinstance(path, LogError):
            return [(REFUSED, f"{path}")]
        spans = path.spans(self.arm)
        depth_cm = NAN if self.gamma_deg else 3.0
        for back in (False, True) if self.gamma_deg else (False,):
            true = self.strokes(back=back)
            way = "extraction" if back else ""
            for stroke in (None, *range(1, len(true) + 2)):
                run = row(self.gamma_deg, stroke, way, depth_cm)
                outcomes.append(self._judge(path, spans, run, true))
        return outcomes

    def _judge(self, path, spans, run, true):
        expected_code = "" if len(true) == 1 else "several-strokes"
        if run.stroke is not None:
            expected_code = "" if run.stroke <= len(true) else "no-such-stroke"
        if not true:
            expected_code = "surface-not-reached"
        try:
            stroke = find_stroke(path, spans, run, self.arm)
        except Refused as refusal:
            code = refusal.remark.code
            if code == expected_code:
                number = refusal.remark.values.get("count", refusal.remark.values.get("found"))
                return (RIGHT if number in (None, len(true)) else WRONG), f"{refusal}"
            return REFUSED, f"{refusal}"
        if expected_code:
            return WRONG, f"{stroke}, not {expected_code}"
        way = [np.interp(ends, *self.corners().T) for ends in (stroke, true[(run.stroke or 1) - 1])]
        late = float(np.abs(np.subtract(stroke, true[(run.stroke or 1) - 1])).max())
        off = float(np.abs(way[0] - way[1]).max())
        right = (
            off < self.allowed_cm and late < self.dwell_s + self.allowed_cm / self.speed_cm_per_s
        )
        return (RIGHT if right else WRONG), f"off by {off:.3f} cm, {late:.3f} s"

    @property
    def allowed_cm(self):
        """How far off an end may be: what lies between samples, in noise, or is no stretch of motion of its own."""
        sd, step = self.noise_cm
        return self.speed_cm_per_s * max(0.15, 2.5 / self.rate_Hz) + 6 * sd + 2 * step


def any_pushes(seed, noise_cm=None, lone=0):
    """One of all the motions that a machine may make, with the noise of its sensor or another one, and lone readings."""
    random = np.random.default_rng(seed)
    cycles = int(random.integers(1, 6))
    longest = float(random.uniform(1.0, 6.0))
    lengths = (longest,) * cycles
    kind = random.choice(["equal", "growing", "shallow"], p=[0.5, 0.45, 0.05])
    if kind == "growing":
        lengths = tuple(0.8 + longest * k / cycles for k in range(cycles))
    gamma = float(random.choice([90.0, 0.0, *random.uniform(25, 80, 2)]))
    begins = str(random.choice(["air", "contact", "below"]))
    if kind == "shallow":
        gamma, begins, lengths = 90.0, "contact", (float(random.uniform(0.1, 0.25)),) * cycles
    rate = float(np.exp(random.uniform(np.log(5), np.log(500))))
    back, stated = 1.0, float(random.uniform(0.7, 1.5))
    if begins != "air" or not gamma:
        back = float(random.choice([1.0, 0.5]))
    # of fewer than three samples nobody can make a push
    speed = min(
        float(np.exp(random.uniform(np.log(0.05), np.log(2.0)))), back * lengths[0] * rate / 3
    )
    if gamma and begins == "air":
        air_way = AIR_CM / math.sin(math.radians(gamma))
        lengths = tuple(length + air_way for length in lengths)
    sd = float(random.choice([0.0, 0.0002, 0.001, 0.005]))
    step = float(random.choice([0.0, 0.0001, 0.001, 0.01]))
    # an encoder whose step takes the arm a second says nothing of its speed
    return Pushes(
        gamma,
        lengths,
        begins,
        back,
        stated,
        rate,
        speed,
        float(random.choice([0.0, random.uniform(0, 1)])),
        (sd if noise_cm is None else noise_cm, min(step, 0.1 * speed)),
        lone,
        seed,
    )
