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
from rftfit.conventions import FloatArray
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.space import IN_SPACE, mesh_draws
from rftfit.model.draws import interval
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import Nodes, Pushes, estimate, published_shapes, usual_error

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


def weights(mesh: Mesh, motion: Motion3D) -> FloatArray:
    """Force and moment for an alpha of 1 at each node, z and x: shape (2 n, 6); the measured law is linear in alpha."""
    unit, count = np.eye(2 * BETA_DEG.size), BETA_DEG.size
    return mesh_draws(
        TableProfile(unit[:, :count], unit[:, count:], *NODES), mesh, motion, "measured", None
    )[:, 0, :6]


def coverage(trials: int = TRIALS) -> None:
    """How often the 95 % interval holds the force, where the law in space is that of the truth."""
    shapes, inside = published_shapes(), {name: np.zeros((trials, 6)) for name in bodies()}
    linear = {name: weights(*body) for name, body in bodies().items()}
    for trial in range(trials):
        random = np.random.default_rng([33, trial])
        truth = first_that_takes_energy(lambda random=random: from_prior(shapes, random))  # type: ignore[misc]
        error = usual_error(truth)
        seen = truth + error * random.standard_normal(truth.shape)
        places = random.permutation(BETA_DEG.size)[:PUSHES]
        pushes = Pushes.of(BETA_DEG[places], GAMMA_DEG[places], seen[:, places], error[:, places])
        medium_map = estimate(pushes, shapes, Nodes(*NODES, BETA_DEG.size))
        draws = medium_map.draws.reshape(len(medium_map.draws), -1)
        for name, body in bodies().items():
            lo, hi = interval(draws @ linear[name], 0.95)
            force = truth.reshape(-1) @ linear[name]
            inside[name][trial] = (lo <= force) & (force <= hi)
            if trial == 0:  # the program's own draws and sums give the same
                table = rftfit.predict(medium_map.profile, *body)
                for end, values in (("lo", lo), ("hi", hi)):
                    predicted_ends = table[
                        [column.replace("_N", f"_{end}_N", 1) for column in IN_SPACE]
                    ].to_numpy()[0]
                    np.testing.assert_allclose(values, predicted_ends, atol=1e-6)
    print(f"coverage of 95 % intervals, %, {trials} media, {PUSHES} pushes each")
    for name, is_inside in inside.items():
        shares = ", ".join(
            f"{what} {100 * share:.1f}"
            for what, share in zip(IN_SPACE, is_inside.mean(axis=0), strict=True)
        )
        print(f"{name}: {shares}; all {100 * is_inside.mean():.1f}")
    print(f"all: {100 * np.mean(list(inside.values())):.1f}")


if __name__ == "__main__":
    coverage(*map(int, sys.argv[1:]))
