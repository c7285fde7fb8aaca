"""Answer of one run of the robot to a user (`simulate`): its speed, its motion and forces in the last strides.

The same facts as lines of text (`SimulationAnswer.summary`), and as plain values for JSON (`as_dict`).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from rftfit.robot.motion import tail_of
from rftfit.robot.run import RobotRun
from rftfit.store.text import count, table

_FACTS = (
    "speed_cm_per_s",
    "speed_sd_cm_per_s",
    "outcome",
    "reason",
    "warning",
    "strides",
    "averaged",
)
"""Attributes of `RobotRun` that the answer states."""


@dataclass(frozen=True)
class SimulationAnswer:
    """A run of a robot on a medium, with `rftfit.robot.motion.SAMPLES` samples for each stride.

    `robot`: title of the robot. `profile`: name of the profile of the medium.
    """

    robot: str
    profile: str
    run: RobotRun

    @property
    def condition(self) -> str:
        """Stride frequency and curvature of the legs as text, for headings."""
        condition = self.run.condition
        return f"{condition.frequency_Hz:g} Hz, R'/r = {condition.curvature_times_R:g}"

    @cached_property
    def tail(self) -> pd.DataFrame:
        """Motion and forces in the last two strides, one row for each sample: the table of `rftfit.robot.motion.tail_of`."""
        return tail_of(self.run)

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and greatest velocity, height, pitch and tripod forces in the last two strides, by column of `tail`."""
        names = ["velocity_x_cm_per_s", "z_cm", "pitch_deg"]
        tripods = ("force_z_tripod", "force_x_tripod")
        # of the table's columns, those of the forces of each tripod, however many the robot has
        names += [name for name in map(str, self.tail) if name.startswith(tripods)]
        return {
            name: (float(self.tail[name].min()), float(self.tail[name].max())) for name in names
        }

    @property
    def doubts(self) -> list[str]:
        """Warnings for the user: legs too fast for the model, or no steady speed."""
        unsteady = self.run.outcome != "steady"
        no_speed = f"no steady speed: {self.run.outcome}" if unsteady else ""
        return [doubt for doubt in (self.run.warning, no_speed) if doubt]

    @property
    def notes(self) -> list[str]:
        """Lines above the table of the motion in its file: what was run, its outcome, the sign of pitch."""
        speed = self.run.speed_cm_per_s
        speed_text = f"{speed:.6g} cm/s" if math.isfinite(speed) else "none"
        outcome = f"outcome: {self.run.outcome}; speed: {speed_text}"
        return [self.robot, self.condition, self.profile, outcome, "pitch: nose up is positive"]

    def summary(self) -> str:
        """Format the result of the run and the ranges of its last two strides as text."""
        run, speed = self.run, "none"
        if run.outcome == "steady":
            sd = run.speed_sd_cm_per_s
            between = f", s.d. between strides {sd:.2g}" if math.isfinite(sd) else ""
            last = count(run.averaged, "stride")
            speed = f"{run.speed_cm_per_s:.4g} cm/s (mean of the last {last}{between})"
        why = f": {run.reason}" if run.reason else ""
        rows = [[name, f"{low:.4g}", f"{high:.4g}"] for name, (low, high) in self.ranges.items()]
        return (
            f"Robot: {self.robot}, {self.condition}\nProfile: {self.profile}\n\nSpeed: {speed}\n"
            f"Outcome: {run.outcome} after {count(run.strides, 'stride')}{why}\n\n"
            + table(["last two strides", "least", "greatest"], rows)
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain numbers, texts and lists, for JSON."""
        return {
            "robot": self.robot,
            "profile": self.profile,
            **asdict(self.run.condition),
            **{name: getattr(self.run, name) for name in _FACTS},
            "last_two_strides": self.ranges,
        }
