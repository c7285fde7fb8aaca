"""How fast forces in space are: a submerged triangle by both laws, beside plain numpy and the plane's kernel.

Everything is measured in this one process, in turns, in processor time; the quickest turn of each counts.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import numpy as np
from meshforces import mesh_forces

from rftfit.forces import faces
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import rotation_poses
from rftfit.forces.outlines import model_leg
from rftfit.forces.plane import forces_on
from rftfit.forces.space import compiled_mesh_forces
from rftfit.model.profiles import TableProfile

if TYPE_CHECKING:
    from collections.abc import Callable

TURNS = 15
DEEP_CM = -9.0
RESULT = Path(__file__).parent / "results" / "space.md"


def seconds(function: Callable[[], object]) -> float:
    """Processor time of one call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def main() -> None:
    table = TableProfile.published("poppy_LP")
    ball, leg = Mesh.sphere(2, 64), model_leg("c_leg")
    motions = Motion3D(np.tile([0, 0, DEEP_CM], (40, 1)), [1, 0.3, -0.5], [0.1, 0.4, -0.2])
    single_motion = Motion3D([0, 0, DEEP_CM], [1, 0.3, -0.5], [0.1, 0.4, -0.2])
    theta = np.radians(np.arange(-135, 135, 0.05))
    poses = rotation_poses(theta, DEEP_CM)
    triangles, elements = len(ball.faces), theta.size * len(leg.body)
    tasks: dict[str, tuple[Callable[[], object], int]] = {
        "plane: element of a leg, table": (lambda: forces_on(table, leg, poses), elements)
    }
    for law in faces.LAWS:
        friction = None if law == "measured" else 0.4
        of_law = partial(compiled_mesh_forces, table, ball, motions, law, friction)
        of_law_in_numpy = partial(mesh_forces, table, ball, single_motion, law, friction)
        tasks |= {
            f"space: {law}": (of_law, 40 * triangles),
            f"space, numpy: {law}": (of_law_in_numpy, triangles),
        }
    for function, _ in tasks.values():
        function()  # compiled, or read from disk, before the clock starts
    turns = [{name: seconds(task[0]) for name, task in tasks.items()} for _ in range(TURNS)]
    ns_each = {
        name: 1e9 * min(turn[name] for turn in turns) / task[1] for name, task in tasks.items()
    }
    plane = next(iter(ns_each.values()))
    lines = [
        "| submerged piece, half of the ball's lead | ns each | over the plane's |",
        "|---|---|---|",
    ]
    lines += [f"| {name} | {value:.0f} | {value / plane:.1f} |" for name, value in ns_each.items()]
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
