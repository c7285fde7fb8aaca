"""One run of the robot: at one stride frequency, leg curvature and starting phase."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot.parts import assemble
from rftfit.robot.series import Series
from rftfit.robot.steady import Verdict, fallen, irregular, settled

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.parts import Parts
    from rftfit.robot.steady import Outcome

FASTEST_LEG_CM_PER_S = 100.0
"""Beyond about 1 m/s the medium's inertia counts, and resistive forces no longer hold."""

STANDING_STRIDE_S = 0.5
"""What stands for a stride where the legs do not turn."""

HIGHEST_FREQUENCY_HZ = 100.0


@dataclass(frozen=True)
class Condition:
    """What is varied from run to run.

    Parameters
    ----------
    frequency_Hz : float
        Stride frequency; negative where the legs turn backward.
    curvature_times_R : float
        R'/r of the legs, from -1 (reversed c-leg) over 0 (flat) to 1 (c-leg).
    phase_turns : float, optional
        By how much of a turn all legs are ahead at the start.

    Raises
    ------
    ValueError
        If a number is out of its range; all of them.
    """

    frequency_Hz: float
    curvature_times_R: float
    phase_turns: float = 0.0

    def __post_init__(self) -> None:
        wrong = []
        if not abs(self.frequency_Hz) <= HIGHEST_FREQUENCY_HZ:
            wrong.append(
                f"frequency: found {self.frequency_Hz:g}; allowed: 0 to {HIGHEST_FREQUENCY_HZ:g} Hz"
            )
        if not abs(self.curvature_times_R) <= 1:
            wrong.append(
                f"curvature R'/r: found {self.curvature_times_R:g}; allowed: -1 (reversed c-leg) to 1"
            )
        if not math.isfinite(self.phase_turns):
            wrong.append(f"phase: found {self.phase_turns:g}; allowed: a number of turns")
        if wrong:
            raise ValueError("; ".join(wrong))


@dataclass(frozen=True)
class Run:
    """What came of a run.

    Parameters
    ----------
    condition : Condition
    speed_cm_per_s : float
        Mean over the averaged strides; NaN unless steady.
    speed_sd_cm_per_s : float
        Standard deviation between those strides; NaN for one stride or none.
    outcome : {"steady", "tipped", "buried", "not steady"}
    reason : str
        Why it is not steady, or that it is so without being regular.
    warning : str
        That the legs are faster than the model holds for; else empty.
    strides, averaged : int
        Strides in all; the last ones that were averaged.
    stride_speeds_cm_per_s : numpy.ndarray, shape (strides,)
    series : Series or None
        Motion and forces over time, where asked for.
    """

    condition: Condition
    speed_cm_per_s: float
    speed_sd_cm_per_s: float
    outcome: Outcome
    reason: str
    warning: str
    strides: int
    averaged: int
    stride_speeds_cm_per_s: FloatArray = field(repr=False)
    series: Series | None = field(default=None, repr=False)


def simulate(
    robot: Robot,
    profile: Profile,
    frequency_Hz: float,
    curvature_times_R: float,
    phase_turns: float = 0.0,
    *,
    samples_per_stride: int = 0,
    strides: int = 0,
) -> Run:
    """Let a robot run until its speed is steady, or is seen not to become so.

    It starts at rest, level, its lowest point at the surface (``numerics.drop_cm`` above it).

    Parameters
    ----------
    robot : Robot
    profile : Profile
        Of the medium.
    frequency_Hz, curvature_times_R, phase_turns : float
        See `Condition`.
    samples_per_stride : int, optional
        How often motion and forces are kept; 0 for not at all.
    strides : int, optional
        Run just so many, whatever happens; by default as many as are needed.

    Returns
    -------
    Run

    Raises
    ------
    ValueError
        If a number is out of its range, or the profile is a stack of draws.
    """
    condition = Condition(frequency_Hz, curvature_times_R, phase_turns)
    parts = assemble(robot, curvature_times_R)
    numerics = robot.numerics
    walk = _Walk(robot, profile, parts, condition, samples_per_stride)
    stretch = max(1, math.ceil(numerics.stretch_s / walk.stride_s - 1e-9))
    most = strides or stretch * numerics.most_stretches
    verdict = None
    while len(walk.ends) - 1 < most and (strides or verdict is None):
        walk.stride()
        ends = np.array(walk.ends)
        verdict = verdict or fallen(parts, ends, numerics)
        whole = (len(ends) - 1) % stretch == 0
        if verdict is None and whole and settled(ends, stretch, walk.stride_s, numerics):
            verdict = Verdict("steady", averaged=stretch)
    speeds = np.diff(np.array(walk.ends)[:, 0]) / walk.stride_s
    verdict = verdict or irregular(speeds, numerics)
    mean = speeds[len(speeds) - verdict.averaged :]
    reason = verdict.reason
    if reason and profile.reason and not np.isfinite(walk.state).all():
        reason = f"{reason}: {profile.reason}"
    return Run(
        condition,
        float(mean.mean()) if mean.size else math.nan,
        float(mean.std(ddof=1)) if mean.size > 1 else math.nan,
        verdict.outcome,
        reason,
        leg_speed_warning(parts, frequency_Hz),
        len(speeds),
        verdict.averaged,
        speeds,
        walk.series() if samples_per_stride else None,
    )


def leg_speed_warning(parts: Parts, frequency_Hz: float) -> str:
    """Warn where the legs' tips turn faster than the model holds for.

    Parameters
    ----------
    parts : Parts
    frequency_Hz : float

    Returns
    -------
    str
        Empty where they do not.
    """
    speed = 2 * math.pi * abs(frequency_Hz) * parts.reach_cm
    if speed <= FASTEST_LEG_CM_PER_S:
        return ""
    return (
        f"leg tips turn at {speed:.0f} cm/s; resistive forces hold up to about "
        f"{FASTEST_LEG_CM_PER_S:g} cm/s"
    )


def start_state(robot: Robot, parts: Parts, phase_turns: float) -> FloatArray:
    """At rest and level, the lowest point ``drop_cm`` above the surface.

    Parameters
    ----------
    robot : Robot
    parts : Parts
    phase_turns : float

    Returns
    -------
    numpy.ndarray, shape (6,)
        x, z (cm), pitch (rad), and their rates.
    """
    lowest = []
    for shape, (_, _, place, members), turned in zip(
        parts.members(), parts.groups, parts.turns, strict=True
    ):
        angle = 2 * math.pi * phase_turns + math.atan2(turned[2], turned[1]) if turned[0] else 0.0
        x, z, tx, tz, half = shape[:, :5].T
        height = z * math.cos(angle) - x * math.sin(angle)
        height -= half * np.abs(tz * math.cos(angle) - tx * math.sin(angle))
        lowest.append(height.min() + parts.places[place : place + members, 1].min())
    return np.array([0.0, robot.numerics.drop_cm - min(lowest), 0.0, 0.0, 0.0, 0.0])


class _Walk:
    """Steps a robot stride by stride."""

    def __init__(
        self, robot: Robot, profile: Profile, parts: Parts, condition: Condition, samples: int
    ) -> None:
        frequency = condition.frequency_Hz
        self.stride_s = 1 / abs(frequency) if frequency else STANDING_STRIDE_S
        pieces = max(1, samples)
        per_piece = math.ceil(self.stride_s / robot.numerics.step_s / pieces - 1e-9)
        self.steps, self.every = per_piece * pieces, per_piece if samples else 0
        self.rk4 = robot.numerics.method == "rk4"
        self.rate = 2 * math.pi * frequency
        self.turn = 2 * math.pi * condition.phase_turns
        self.pack, self.parts = profile.pack, parts
        self.state = start_state(robot, parts, condition.phase_turns)
        self.ends = [self.state.copy()]
        self.samples: list[FloatArray] = []
        self.pieces = pieces if samples else 0

    def stride(self) -> None:
        # the compiler is slow to import
        from rftfit.robot.kernel import SAMPLE_HEAD, advance

        parts = self.parts
        samples = np.empty((self.pieces, SAMPLE_HEAD + 2 * len(parts.names)))
        # whole turns add nothing to the legs' place
        advance(
            self.pack, parts.shape, parts.groups, parts.turns, parts.places, parts.inertia,
            self.state, self.turn, self.rate, self.stride_s / self.steps, self.steps, self.rk4,
            self.every, samples,
        )  # fmt: skip
        self.ends.append(self.state.copy())
        self.samples.append(samples)

    def series(self) -> Series:
        rows = np.concatenate(self.samples)
        time = np.arange(len(rows)) * self.stride_s / self.pieces
        turned = self.turn + self.rate * time
        return Series.of(self.parts.names, time, turned, rows)
