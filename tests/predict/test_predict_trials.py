"""Forces on rotating legs agree with a slow integral."""

import math

import numpy as np
import pytest

import rftfit

BULGES = {"c_leg": -1, "flat_leg": 0, "reversed_c_leg": 1}
"""Side of x to which each leg bulges when it hangs down."""


def slow_integral(profile, leg, theta):
    """Force z, x and moment on a leg, from its own geometry and scipy's quadrature."""
    from scipy.integrate import quad_vec

    r, hip, width, side = 3.81, 2.0, 2.54, BULGES[leg]

    def point(s):
        """At the part s of the leg's length, leg hanging straight down and then turned by theta."""
        if side:
            x, z = side * r * math.sin(math.pi * s), -r * (1 - math.cos(math.pi * s))
        else:
            x, z = 0.0, -2 * r * s
        c, n = math.cos(theta), math.sin(theta)
        return x * c + z * n, z * c - x * n

    length = math.pi * r if side else 2 * r

    def density(s):
        x, z = point(s)
        if z + hip >= 0:
            return np.zeros(3)
        (x0, z0), (x1, z1) = point(s - 1e-6), point(s + 1e-6)
        beta = math.atan2(z0 - z1, x1 - x0)
        # as theta grows the leg turns clockwise seen with x to the right
        gamma = math.atan2(x, -z)
        alpha_z, alpha_x = (float(alpha) for alpha in profile.alpha(beta, gamma))
        force = -(z + hip) * width * length * np.array([alpha_z, alpha_x])
        return np.array([*force, z * force[1] - x * force[0]])

    return np.asarray(quad_vec(density, 0, 1, epsabs=1e-5, epsrel=1e-6, limit=400)[0])


BY_TABLE = [(leg, "table", ((120, 1e-3), (30, 2e-2))) for leg in BULGES]
FORCES = ["force_z_N", "force_x_N", "moment_N_cm"]


@pytest.mark.parametrize(
    ("leg", "kind", "cases"),
    [
        *BY_TABLE,
        ("c_leg", "fourier", ((120, 1e-3), (30, 2e-3))),
        # steps where the motion turns from down to up: elements see it coarsely
        ("reversed_c_leg", "depth_only", ((3000, 1e-3),)),
    ],
)
def test_agrees_with_a_slow_integral(leg, kind, cases):
    profile = rftfit.published_medium("poppy_LP", kind)
    theta_deg = np.array([-95.0, -70.0, -52.0, -33.0, -11.0, 6.0, 27.0, 49.0, 71.0])
    slow = np.array([slow_integral(profile, leg, angle) for angle in np.radians(theta_deg)])
    peaks = rftfit.predict(profile, rftfit.model_leg(leg), model_error=0)[FORCES].abs().max()
    for elements, tolerance in cases:
        outline, turn = rftfit.model_leg(leg, elements), rftfit.rotation(theta_deg)
        fast = rftfit.predict(profile, outline, turn, model_error=0)[FORCES].to_numpy()
        assert (np.abs(fast - slow) / peaks.to_numpy()).max() < tolerance
