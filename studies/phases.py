"""How much the starting phase of the legs changes a steady speed, under every measured condition."""

from __future__ import annotations

from rftfit.model.profiles import published_medium
from rftfit.robot.config import paper_robot
from rftfit.robot.run import Condition
from rftfit.robot.speeds import published_speeds
from rftfit.robot.sweep import PHASES_TURNS, run_all, speed_table

if __name__ == "__main__":
    measured = published_speeds("poppy_LP")
    places = zip(measured["frequency_Hz"], measured["curvature_times_R"], strict=True)
    conditions = [Condition(hz, bend, turns) for hz, bend in places for turns in PHASES_TURNS]
    runs = speed_table(run_all(paper_robot(), published_medium("poppy_LP"), conditions))
    speed = runs.groupby(["curvature_times_R", "frequency_Hz"])["speed_cm_per_s"]
    spread = speed.max() - speed.min()
    print(f"{len(runs)} runs, {int((runs['outcome'] == 'steady').sum())} steady")
    print(f"change of speed, cm/s: median {spread.median():.4f}, largest {spread.max():.3f}")
