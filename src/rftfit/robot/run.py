"""One run of the robot at a stride frequency, leg curvature and starting phase: when it has settled, and its speed.

A stride is one turn of the legs. The run goes on stride by stride until one of these holds (`simulate`):

- the robot tipped over, sank or lost its forces (`tipped_or_buried`): there is no speed;
- its last two stretches agree (`settled`): the speed is the mean of the last stretch. A stretch is the fewest whole
  strides that last ``numerics.stretch_s``;
- the greatest length, ``numerics.most_stretches``, is reached: the speed may be steady all the same (`irregular`).

A state is an array (6,): x, z of the centre of mass (cm, z = 0 at the surface), pitch (rad, from z toward x: nose
down), and their rates (cm/s, rad/s). Results turn the sign of pitch: `Series` has it positive with the nose up.

A `Remark` is a reason or a doubt: a code with numbers, which becomes a sentence (`rftfit.measure.flags`). A profile
gives alpha (stress per depth, N/cm^3) of a medium in every direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.measure.flags import Remark, format_remarks, remark
from rftfit.model.profiles import Profile
from rftfit.robot.body import Parts, assemble
from rftfit.robot.config import Numerics, Robot
from rftfit.store.chosen import chosen


@dataclass(frozen=True)
class Series:
    """Motion of the robot and forces on it over time: every array has shape (n,), one entry for each sample.

    `time_s`: counts from the start of the run.
    `x_cm`, `z_cm`: centre of mass; z = 0 is the free surface.
    `pitch_deg`: positive with the nose up (in states pitch is positive from z toward x, nose down, like every angle).
    `leg_angle_deg`: theta of the legs of phase 0 relative to the body, which is not wrapped at 360 degrees.
    `moment_N_cm`: moment of all granular forces about the centre of mass, positive from z toward x.
    `drive_moment_N_cm`: moment of the drive on all legs, opposite to the moment of the granular forces about the hips.
    `force_z_N`, `force_x_N`: forces of the ground on the robot, by name of the group: the plates of the body, then the
        legs of each phase together, ``tripod_1``, ``tripod_2``, ...
    """

    time_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    pitch_deg: FloatArray
    velocity_x_cm_per_s: FloatArray
    velocity_z_cm_per_s: FloatArray
    pitch_rate_deg_per_s: FloatArray
    leg_angle_deg: FloatArray
    moment_N_cm: FloatArray
    drive_moment_N_cm: FloatArray
    force_z_N: dict[str, FloatArray]
    force_x_N: dict[str, FloatArray]

    def last(self, samples: int) -> Series:
        """Return the series with only the last `samples` samples, for pictures of the last strides."""

        def cut(array: Any) -> Any:
            """Cut an array, or the arrays of all groups."""
            if isinstance(array, dict):
                return {name: cut(array_of_group) for name, array_of_group in array.items()}
            return array[-samples:]

        return Series(**{name: cut(array) for name, array in vars(self).items()})

    @property
    def states(self) -> FloatArray:
        """States (n, 6) as at the head of this module, for `rftfit.robot.body.Parts.place`."""
        columns = (
            self.x_cm,
            self.z_cm,
            -np.radians(self.pitch_deg),
            self.velocity_x_cm_per_s,
            self.velocity_z_cm_per_s,
            -np.radians(self.pitch_rate_deg_per_s),
        )
        return np.stack(columns, axis=1)

    def table(self) -> pd.DataFrame:
        """Return all arrays as a table, with units in the names; forces have names like ``force_z_tripod_1_N``."""
        columns = dict(vars(self))
        force_z, force_x = columns.pop("force_z_N"), columns.pop("force_x_N")
        for name in force_z:
            columns |= {f"force_z_{name}_N": force_z[name], f"force_x_{name}_N": force_x[name]}
        return pd.DataFrame(columns)


Outcome = Literal["steady", "tipped", "buried", "not steady"]
"""How a run ended: with a steady speed, turned over, below the surface, or with none of these."""

_SETTLED = chosen("robot", "settled")
"""Chosen numbers for `settled`: differences of height and pitch, and least numbers of stretches."""


@dataclass(frozen=True)
class Assessment:
    """Judgement of a run: its outcome, and the last strides whose mean is its speed.

    `why`: why the run is not steady, or that it is steady but irregular; empty for a settled run. `averaged`: number of
    last strides whose mean is the speed; 0: there is no speed.
    """

    outcome: Outcome
    why: tuple[Remark, ...] = ()
    averaged: int = 0


def tipped_or_buried(parts: Parts, ends: FloatArray, numerics: Numerics) -> Assessment | None:
    """Assess a robot that has turned over, sunk, or lost its force, after each stride; None if it runs on.

    It has lost its force if alpha is NaN in a direction that it met: its state is NaN from then on. `ends`: states at
    the start and after each of n strides, shape (n + 1, 6).
    """
    state, number = ends[-1], len(ends) - 1
    if not np.isfinite(state).all():
        return Assessment("not steady", (remark("force-unknown", stride=number),))
    pitch = math.degrees(state[2])
    if abs(pitch) > numerics.tipped_deg:
        return Assessment("tipped", (remark("tipped", pitch=-pitch, stride=number),))
    if highest_point(parts, state) < 0:
        return Assessment("buried", (remark("buried", stride=number),))
    return None


def highest_point(parts: Parts, state: FloatArray) -> float:
    """Return the height above the surface of the highest end of a plate of the body in a state (6,), cm.

    Negative if all plates are below the surface; legs are left out, since they come up in every stride.
    """
    c, s = math.cos(state[2]), math.sin(state[2])
    # centre, unit tangent and half-length of the elements, with the body level
    x, z, tx, tz, half = parts.plates.T
    return float(state[1] + (z * c - x * s + half * np.abs(tz * c - tx * s)).max())


def settled(
    ends: FloatArray,
    stretch: int,
    stride_s: float,
    numerics: Numerics,
    fewest: int = _SETTLED.from_rest,
) -> bool:
    """Return True if the last two stretches have nearly the same speed, and the same height and pitch at their ends.

    Height and pitch are compared too: a body that still sinks or tilts has not settled, even at an even speed. `ends`:
    states at the start and after each of n strides, shape (n + 1, 6). `stretch`: strides of a stretch. `stride_s`: time
    of a stride. `fewest`: least number of stretches run; False before.
    """
    if len(ends) - 1 < fewest * stretch:
        return False
    # states at the start of the last but one stretch, between both, and now
    before, middle, last = ends[-1 - 2 * stretch], ends[-1 - stretch], ends[-1]
    # x is the first number of a state, height and pitch are the next two
    earlier_speed, later_speed = (
        (end[0] - start[0]) / (stretch * stride_s)
        for start, end in ((before, middle), (middle, last))
    )
    most_speed_change = max(numerics.settled_share * abs(later_speed), numerics.settled_cm_per_s)
    changes = np.abs([later_speed - earlier_speed, *(last - middle)[1:3]])
    most_pitch_change = math.radians(_SETTLED.pitch_deg)
    return bool((changes <= [most_speed_change, _SETTLED.height_cm, most_pitch_change]).all())


def irregular(speeds: FloatArray, numerics: Numerics) -> Assessment:
    """Assess a run of the greatest length that has not settled, from the speed of each stride, cm/s, shape (strides,).

    The first third is left out. The mean speeds of the other two thirds are compared: a bouncing or stumbling robot has
    a steady mean although no two strides are alike; a robot that still accelerates has none. Returns "steady" with the
    remark "irregular" and both thirds averaged, or "not steady"; three strides are needed.
    """
    third = len(speeds) // 3
    if third == 0:
        return Assessment("not steady", (remark("few-strides", strides=len(speeds)),))
    middle, last = speeds[-2 * third : -third].mean(), speeds[-third:].mean()
    most_change = max(numerics.steady_share * abs(last), numerics.settled_cm_per_s)
    thirds = (remark("thirds", strides=len(speeds), second=middle, last=last),)
    if abs(last - middle) <= most_change:
        return Assessment("steady", (remark("irregular"), *thirds), 2 * third)
    return Assessment("not steady", thirds)


HIGHEST_FREQUENCY_HZ = 100.0
"""Highest stride frequency that is accepted: far beyond any robot, so that a slip of the unit is refused."""


@dataclass(frozen=True)
class Condition:
    """Quantities that are varied from run to run; raises ValueError with all that are out of range.

    `frequency_Hz`: stride frequency, negative if the legs turn backward.
    `curvature_times_R`: R'/r of the legs, from -1 (reversed c-leg) over 0 (flat) to 1 (c-leg).
    `phase_turns`: angle by which all legs are turned ahead at the start, in turns; each leg adds its own phase
        (`rftfit.robot.config.Hip`).
    """

    frequency_Hz: float
    curvature_times_R: float
    phase_turns: float = 0.0

    def __post_init__(self) -> None:
        hz, bend, phase = self.frequency_Hz, self.curvature_times_R, self.phase_turns
        most = HIGHEST_FREQUENCY_HZ
        checks = (
            (abs(hz) <= most, f"frequency: found {hz:g}; allowed: {-most:g} to {most:g} Hz"),
            (abs(bend) <= 1, f"curvature R'/r: found {bend:g}; allowed: -1 (reversed c-leg) to 1"),
            (math.isfinite(phase), f"phase: found {phase:g}; allowed: a number of turns"),
        )
        if wrong := [text for good, text in checks if not good]:
            raise ValueError("; ".join(wrong))


@dataclass(frozen=True)
class RobotRun:
    """Result of a run, returned by `simulate`.

    `speed_cm_per_s`: mean forward speed over the last `averaged` strides; NaN unless the run is steady.
    `speed_sd_cm_per_s`: standard deviation between these strides; NaN for one stride or none.
    `why`: why the run is not steady, or that it is steady but irregular; `reason`: the same in words.
    `warning`: sentence if the legs are too fast for the model, else empty.
    `strides`: number of strides run. `stride_speeds_cm_per_s`: forward speed of each of them.
    `end_state`: state (6,) after the last stride; another run may start in it.
    `series`: motion and forces of the whole run; None if no samples were asked for.
    """

    condition: Condition
    speed_cm_per_s: float
    speed_sd_cm_per_s: float
    outcome: Outcome
    why: tuple[Remark, ...]
    warning: str
    strides: int
    averaged: int
    stride_speeds_cm_per_s: FloatArray = field(repr=False)
    end_state: FloatArray = field(repr=False)
    series: Series | None = field(default=None, repr=False)

    @property
    def reason(self) -> str:
        """Reason why the run is not steady, or a note that it is steady but irregular, in words."""
        return format_remarks(self.why)


def simulate(
    robot: Robot,
    profile: Profile,
    frequency_Hz: float,
    curvature_times_R: float,
    phase_turns: float = 0.0,
    *,
    samples_per_stride: int = 0,
    strides: int = 0,
    start: FloatArray | None = None,
) -> RobotRun:
    """Let a robot run until its speed is steady, or it is clear that it will not become steady (`rftfit.simulate`).

    The robot starts at rest and level, with its lowest point ``numerics.drop_cm`` above the surface.
    `profile`: alpha of the medium. `frequency_Hz`, `curvature_times_R`, `phase_turns`: as in `Condition`.
    `samples_per_stride`: samples of `RobotRun.series`; 0: no series.
    `strides`: exact number of strides, whatever happens; 0: as many as are needed.
    `start`: state (6,) at the start instead of rest, from a settled run of nearly the same robot in this condition: it
    has no transient, so that fewer strides are enough. Raises ValueError for a condition out of range.
    """
    condition = Condition(frequency_Hz, curvature_times_R, phase_turns)
    parts = assemble(robot, curvature_times_R)
    numerics = robot.numerics
    stepper = _Stepper(robot, profile, parts, condition, samples_per_stride, start)
    fewest = _SETTLED.from_rest if start is None else _SETTLED.from_settled
    stretch = max(1, math.ceil(numerics.stretch_s / stepper.stride_s - 1e-9))
    most = strides or stretch * numerics.most_stretches
    assessment = None
    # `assessment` is None until the outcome is known; with a number of strides given the robot runs on after that
    while len(stepper.ends) - 1 < most and (strides or assessment is None):
        stepper.run_stride()
        if assessment is not None:
            continue
        ends = np.array(stepper.ends)
        assessment = tipped_or_buried(parts, ends, numerics)
        # stretches are counted from the start: after any other stride there is nothing new to compare
        ends_stretch = (len(ends) - 1) % stretch == 0
        if (
            assessment is None
            and ends_stretch
            and settled(ends, stretch, stepper.stride_s, numerics, fewest)
        ):
            assessment = Assessment("steady", averaged=stretch)
    speeds = np.diff(np.array(stepper.ends)[:, 0]) / stepper.stride_s
    assessment = assessment or irregular(speeds, numerics)
    averaged_speeds = speeds[len(speeds) - assessment.averaged :]
    why = assessment.why
    # a state without a number comes from a hole in the profile: the reason of that hole is added
    if why and profile.reason and not np.isfinite(stepper.state).all():
        hole = Remark("alpha-missing", words=profile.reason)
        why = (remark("robot-lost", what=why[0], why=hole),)
    return RobotRun(
        condition,
        speed_cm_per_s=float(averaged_speeds.mean()) if averaged_speeds.size else math.nan,
        speed_sd_cm_per_s=spread(averaged_speeds),
        outcome=assessment.outcome,
        why=why,
        warning=leg_speed_warning(parts, frequency_Hz),
        strides=len(speeds),
        averaged=assessment.averaged,
        stride_speeds_cm_per_s=speeds,
        end_state=stepper.state,
        series=stepper.series() if samples_per_stride else None,
    )


def spread(numbers: FloatArray) -> float:
    """Return the standard deviation between a few trials or strides; NaN for fewer than two."""
    return float(numbers.std(ddof=1)) if numbers.size > 1 else math.nan


FASTEST_LEG_CM_PER_S = 100.0
"""Speed of a leg, about 1 m/s, above which the inertia of the medium matters and the model does not hold."""


def leg_speed_warning(parts: Parts, frequency_Hz: float) -> str:
    """Return a warning if the tips of the legs are faster than the model holds for, else an empty text."""
    speed = 2 * math.pi * abs(frequency_Hz) * parts.reach_cm
    if speed <= FASTEST_LEG_CM_PER_S:
        return ""
    return (
        f"leg tips turn at {speed:.0f} cm/s; resistive forces hold up to about "
        f"{FASTEST_LEG_CM_PER_S:g} cm/s"
    )


def start_state(robot: Robot, parts: Parts, phase_turns: float) -> FloatArray:
    """Return the state (6,) at rest and level, with the lowest point ``drop_cm`` above the surface.

    `phase_turns`: as in `Condition`; the lowest point may be the tip of a leg.
    """
    state = np.zeros(6)
    groups = parts.place(state, 2 * math.pi * phase_turns, 0.0)
    # lower end of an element: z of its centre, less half-length times the vertical part of its unit tangent
    lowest = min((e[..., 1] - e[..., 4] * np.abs(e[..., 3])).min() for e in groups)
    state[1] = robot.numerics.drop_cm - lowest
    return state


class _Stepper:
    """A running robot, advanced by one stride at a time; it keeps what the compiled stepper needs and returns.

    `samples_per_stride`: 0 for none. `start`: state (6,), or None for rest.

    `state`: state (6,) now. `ends`: list of states at the start and after each stride. `samples`: an array for each
    stride, with the columns that `series` names. `stride_s`, `steps`: time and time steps of a stride; a sample is
    taken before every `steps_per_sample` of these, 0 for none. `turn`, `rate`: angle at the start of each stride (rad)
    and angular velocity (rad/s) of the legs of phase 0 relative to the body. `pack`: arrays of the profile for the
    stepper.
    """

    def __init__(
        self,
        robot: Robot,
        profile: Profile,
        parts: Parts,
        condition: Condition,
        samples_per_stride: int,
        start: FloatArray | None,
    ) -> None:
        frequency = condition.frequency_Hz
        # legs that do not turn (0 Hz) have no stride: half a second stands in for it
        self.stride_s = 1 / abs(frequency) if frequency else 0.5
        samples = max(1, samples_per_stride)
        # a stride is a whole number of steps, and of samples; 1e-9 keeps rounding from adding a step
        steps_per_sample = math.ceil(self.stride_s / robot.numerics.step_s / samples - 1e-9)
        self.steps = steps_per_sample * samples
        self.steps_per_sample = steps_per_sample if samples_per_stride else 0
        self.samples_per_stride = samples_per_stride
        self.rk4 = robot.numerics.method == "rk4"
        self.rate = 2 * math.pi * frequency
        self.turn = 2 * math.pi * condition.phase_turns
        self.pack, self.parts = profile.pack, parts
        if start is None:
            start = start_state(robot, parts, condition.phase_turns)
        self.state = start.copy()
        self.ends = [self.state.copy()]
        self.samples: list[FloatArray] = []

    def run_stride(self) -> None:
        """Step the robot through one stride: changes `state`, and adds to `ends` and `samples`."""
        # imported here, as the compiler is slow to import
        from rftfit.model.kernel import SAMPLE_HEAD, advance

        parts = self.parts
        samples = np.empty((self.samples_per_stride, SAMPLE_HEAD + 2 * len(parts.names)))
        # each stride starts at the same `turn`: the legs have made whole turns. Writes `state` and `samples`.
        advance(
            self.pack,
            parts.bodies,
            parts.widths_cm,
            parts.group,
            parts.hips,
            parts.inertia,
            self.state,
            self.turn,
            self.rate,
            self.stride_s / self.steps,
            self.steps,
            self.rk4,
            self.steps_per_sample,
            samples,
        )
        self.ends.append(self.state.copy())
        self.samples.append(samples)

    def series(self) -> Series:
        """Return all samples as a `Series`, with its signs and units.

        The columns of a sample: state (6), turn of the legs, moment about the centre of mass, moment of the medium
        about the hips (N cm; the drive exerts the opposite), then force z and x of each group (N).
        """
        rows, groups, degrees = np.concatenate(self.samples), self.parts.names, np.degrees
        time = np.arange(len(rows)) * self.stride_s / self.samples_per_stride
        x, z, pitch, vx, vz, pitch_rate, _, moment, hip_moment = rows[:, :9].T
        force_z = {name: rows[:, 9 + 2 * index] for index, name in enumerate(groups)}
        force_x = {name: rows[:, 10 + 2 * index] for index, name in enumerate(groups)}
        return Series(
            time,
            x,
            z,
            -degrees(pitch),
            vx,
            vz,
            -degrees(pitch_rate),
            degrees(self.turn + self.rate * time),
            moment,
            -hip_moment,
            force_z,
            force_x,
        )
