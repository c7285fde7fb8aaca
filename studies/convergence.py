"""How the speed of a run depends on the time step and the method.

``python studies/convergence.py`` prints it for the paper's robot on loosely packed poppy seeds.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from rftfit.robot.run import Condition, simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot

STEPS_S = (8e-4, 4e-4, 2e-4, 1e-4, 5e-5)
METHODS = ("semi_implicit_euler", "rk4")


def step_convergence(
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition],
    steps_s: Sequence[float] = STEPS_S,
    finest_s: float = 2.5e-5,
) -> pd.DataFrame:
    """Run each condition with both methods and several steps, and compare with the finest.

    The force jumps where an element's velocity turns, so that no method of fixed step converges
    faster than in proportion to the step; RK4 is better where the motion is smooth. The speeds are
    compared with that of a run by RK4 with the step `finest_s`.
    """
    import pandas as pd

    rows = []
    for condition in conditions:
        where = (condition.frequency_Hz, condition.curvature_times_R, condition.phase_turns)
        best = simulate(with_numerics(robot, "rk4", finest_s), profile, *where)
        for method in METHODS:
            for step in steps_s:
                run = simulate(with_numerics(robot, method, step), profile, *where)
                off = 100 * (run.speed_cm_per_s / best.speed_cm_per_s - 1)
                rows.append((*where, method, step, run.speed_cm_per_s, run.outcome, off))
    names = [
        "frequency_Hz",
        "curvature_times_R",
        "phase_turns",
        "method",
        "step_s",
        "speed_cm_per_s",
        "outcome",
        "difference_percent",
    ]
    return pd.DataFrame(rows, columns=names)


def with_numerics(robot: Robot, method: str, step_s: float) -> Robot:
    """Return the robot with another method and time step."""
    numerics = robot.numerics.model_copy(update={"method": method, "step_s": step_s})
    return robot.model_copy(update={"numerics": numerics})


def main() -> None:
    """Print the difference, in percent, from the speed with the finest step."""
    from rftfit.model.profiles import TableProfile
    from rftfit.robot.config import paper_robot

    conditions = [Condition(*where) for where in product((0.4, 2.0, 5.0), (1.0, 0.0, -1.0))]
    table = step_convergence(paper_robot(), TableProfile.published("poppy_LP"), conditions)
    wide = table.pivot_table(
        index=["frequency_Hz", "curvature_times_R", "method"],
        columns="step_s",
        values="difference_percent",
    )
    print(wide.round(2).to_string())


if __name__ == "__main__":
    main()
