"""Forces on rotating legs agree with a slow integral."""

import math

import numpy as np
import pytest
from coverage_levels import sweep
from paper import BETA, GAMMA, flat

from rftfit import (
    DepthOnlyProfile,
    FourierProfile,
    TableProfile,
    model_leg,
    reference,
    scaled_generic,
)
from rftfit.model.fourier import as_array, fit_lsq

BULGES = {"c_leg": -1, "flat_leg": 0, "reversed_c_leg": 1}
"""Side of x to which each leg bulges when it hangs down."""
GENERIC = as_array(reference.coefficients("generic"))


def table(medium):
    return TableProfile.published(medium)


def nine_terms(medium):
    return FourierProfile(fit_lsq(BETA, GAMMA, *flat(reference.alpha_grid(medium))))


def profiles(medium):
    zeta = reference.coefficients(medium)["zeta"]
    return {
        "table": table(medium),
        "nine terms": nine_terms(medium),
        "generic": scaled_generic(zeta, GENERIC),
        "depth-only": DepthOnlyProfile.of(table(medium)),
    }


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


BY_TABLE = [(leg, "table", ((120, 1e-3), (30, 2e-2))) for leg in reference.LEGS]


@pytest.mark.parametrize(
    ("leg", "kind", "cases"),
    [
        *BY_TABLE,
        ("c_leg", "nine terms", ((120, 1e-3), (30, 2e-3))),
        # steps where the motion turns from down to up: elements see it coarsely
        ("reversed_c_leg", "depth-only", ((3000, 1e-3),)),
    ],
)
def test_agrees_with_a_slow_integral(leg, kind, cases):
    profile = profiles("poppy_LP")[kind]
    theta = np.radians([-95.0, -70.0, -52.0, -33.0, -11.0, 6.0, 27.0, 49.0, 71.0])
    slow = np.array([slow_integral(profile, leg, angle) for angle in theta])
    whole = sweep(profile, model_leg(leg))
    peaks = [np.abs(c).max() for c in (whole.force_z_N, whole.force_x_N, whole.moment_N_cm)]
    for elements, tolerance in cases:
        fast = sweep(profile, model_leg(leg, elements), theta)
        forces = np.column_stack([fast.force_z_N, fast.force_x_N, fast.moment_N_cm])
        assert (np.abs(forces - slow) / peaks).max() < tolerance
