"""Coverage of the intervals of forces in space where the law in space is that of the truth.

``python studies/space_coverage.py [TRIALS]``: a wheel, a ball and a leg in media drawn from the prior of the map, with 6
pushes in random directions each; minutes on one core.
"""

from __future__ import annotations

import sys

import numpy as np
from grade_map import first_that_takes_energy, from_prior
from shapes import BETA_DEG, GAMMA_DEG, NODES

import rftfit
from rftfit.model.mesh import Mesh, Motion3D
from rftfit.model.mesh_prediction import IN_SPACE, mesh_forces
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import Pushes, estimate, published_shapes, usual_error

TRIALS, PUSHES = 400, 6


def bodies() -> dict[str, tuple[Mesh, Motion3D]]:
    """A wheel that slips aside, a ball that turns as it sinks, a leg that is pushed aside."""
    angle = np.radians(15)
    wheel = Motion3D([0, 0, 3.25], [np.cos(angle), np.sin(angle), 0], [0, 1 / 6.25, 0])
    ball = Motion3D([0, 0, -1], [1, 0.3, -0.5], [0.1, 0.4, -0.2])
    leg = Motion3D([0, 0, 2], [0, 0.3, 0], [0, 0.2, 0])
    return {
        "wheel": (Mesh.cylinder(6.25, 6, 48), wheel),
        "ball": (Mesh.sphere(2, 16), ball),
        "leg": (Mesh.extrude(rftfit.model_leg("c_leg")), leg),
    }


def coverage(trials: int = TRIALS) -> None:
    """How often the 95 % interval holds the force, where the law in space is that of the truth."""
    shapes, inside = published_shapes(), {name: np.zeros((trials, 6)) for name in bodies()}
    for trial in range(trials):
        random = np.random.default_rng([33, trial])
        truth = first_that_takes_energy(lambda random=random: from_prior(shapes, random))  # type: ignore[misc]
        error = usual_error(truth)
        seen = truth + error * random.standard_normal(truth.shape)
        places = random.permutation(BETA_DEG.size)[:PUSHES]
        pushes = Pushes.of(BETA_DEG[places], GAMMA_DEG[places], seen[:, places], error[:, places])
        found, own = estimate(pushes, shapes).profile, TableProfile(truth[0], truth[1], *NODES)
        for name, (mesh, motion) in bodies().items():
            table = rftfit.predict(found, mesh, motion)
            force = mesh_forces(own, mesh, motion)[0]
            ends = [table[[one.replace("_N", f"_{end}_N", 1) for one in IN_SPACE]].to_numpy()[0]
                    for end in ("lo", "hi")]  # fmt: skip
            inside[name][trial] = (ends[0] <= force[:6]) & (force[:6] <= ends[1])
    print(f"coverage of 95 % intervals, %, {trials} media, {PUSHES} pushes each")
    for name, one in inside.items():
        each = ", ".join(f"{what} {100 * share:.1f}" for what, share in zip(IN_SPACE, one.mean(axis=0), strict=True))  # fmt: skip
        print(f"{name}: {each}; all {100 * one.mean():.1f}")
    print(f"all: {100 * np.mean(list(inside.values())):.1f}")


if __name__ == "__main__":
    coverage(*map(int, sys.argv[1:]))
