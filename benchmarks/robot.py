"""How fast the robot runs: simulated seconds a second, beside a plain numpy stepper, and the sweep.

Everything is measured in this one process, in turns; the median of the turns counts. Times of one core
are processor times, which other programs disturb less. The plain stepper is that of
`tests/helpers`, which gives the same motion. ``--sweep`` adds the paper's whole sweep (3,978 runs) in two threads.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import numpy as np
from robotsteps import plain_steps, step

from rftfit import reference
from rftfit.model.fourier import as_array
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile
from rftfit.robot.body import assemble
from rftfit.robot.config import paper_robot
from rftfit.robot.run import simulate
from rftfit.robot.sweep import paper_conditions, run_all

if TYPE_CHECKING:
    from rftfit.model.profiles import Profile

TURNS = 7
STEP_S = 1e-4
STEPS = 20_000
PLAIN_STEPS = 100
CURVATURES = {"c-leg": 1.0, "flat leg": 0.0, "reversed c-leg": -1.0}
FREQUENCY_HZ = 2.0
PAPER_S_PER_S = 10.0
THREADS = 2
RESULT = Path(__file__).parent / "results" / "robot.md"


def settled_state(profile: Profile, curvature: float) -> np.ndarray:
    """State at the beginning of a stride in steady running."""
    robot = paper_robot()
    run = simulate(robot, profile, FREQUENCY_HZ, curvature, samples_per_stride=1, strides=4)
    assert run.series is not None
    return np.asarray(run.series.states[-1])


def speeds(profile: Profile, curvature: float) -> tuple[float, float, float]:
    """Take simulated seconds a second, compiled and plain, and their ratio."""
    parts, rate = assemble(paper_robot(), curvature), 2 * math.pi * FREQUENCY_HZ
    start = settled_state(profile, curvature)
    assert len(parts.group) * parts.bodies.shape[1] == 270

    def compiled() -> float:
        begin = time.thread_time()
        step(profile, parts, start, 0.0, rate, STEP_S, STEPS)
        return STEPS * STEP_S / (time.thread_time() - begin)

    def numpy() -> float:
        begin = time.thread_time()
        plain_steps(profile, parts, start, 0.0, rate, STEP_S, PLAIN_STEPS)
        return PLAIN_STEPS * STEP_S / (time.thread_time() - begin)

    compiled()
    turns = [(compiled(), numpy()) for _ in range(TURNS)]
    compiled_speed, numpy_speed = (statistics.median(turn[k] for turn in turns) for k in range(2))
    return compiled_speed, numpy_speed, statistics.median(turn[0] / turn[1] for turn in turns)


def sweep_s(profile: Profile) -> tuple[float, float]:
    """Take seconds of the clock, and of the processors together."""
    begin, used = time.perf_counter(), time.process_time()
    runs = run_all(paper_robot(), profile, paper_conditions(), THREADS)
    assert len(runs) == 3978
    return time.perf_counter() - begin, time.process_time() - used


def main() -> None:
    table = TableProfile.published("poppy_LP")
    nine = FourierProfile(as_array(reference.coefficients("poppy_LP")))
    profiles: dict[str, Profile] = {
        "nine terms": nine,
        "table": table,
        "depth-only": DepthOnlyProfile.of(table),
    }
    what = f"270 elements, step {STEP_S:g} s, {FREQUENCY_HZ:g} Hz, one core"
    lines = [
        f"| {what} | legs | simulated s per s | plain numpy | ratio | ratio to the paper's 0.1 |",
        "|---|---|---|---|---|---|",
    ]
    for name, profile in profiles.items():
        for leg, curvature in CURVATURES.items():
            compiled_speed, numpy_speed, ratio = speeds(profile, curvature)
            lines.append(
                f"| {name} | {leg} | {compiled_speed:.0f} | {numpy_speed:.3f} | {ratio:.0f} | "
                f"{compiled_speed * PAPER_S_PER_S:.0f} |"
            )
    if "--sweep" in sys.argv[1:]:
        head = f"| the paper's sweep, 3,978 runs, {THREADS} threads | s | processor time, s |"
        lines += ["", head, "|---|---|---|"]
        for name in ("nine terms", "table"):
            taken, used = sweep_s(profiles[name])
            lines.append(f"| {name} | {taken:.0f} | {used:.0f} |")
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
