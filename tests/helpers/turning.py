"""Forces on a turning leg without intervals, for tests and benchmarks."""

import numpy as np

from rftfit.forces.motion import HIP_HEIGHT_CM, RATE_RAD_PER_S, THETA_DEG, rotation_poses
from rftfit.forces.plane import force_draws, forces_on


def turned(theta=None, hip_height_cm=HIP_HEIGHT_CM, rate_rad_per_s=RATE_RAD_PER_S):
    """Poses at angles theta, rad; by default -135 to 135 degrees by 1."""
    theta = np.radians(THETA_DEG) if theta is None else theta
    return rotation_poses(theta, hip_height_cm, rate_rad_per_s)


def sweep(profile, leg, *path, **options):
    """Force and moment about the axle on a leg `turned` so, one for each theta."""
    return forces_on(profile, leg, turned(*path, **options))


def sweep_draws(profile, leg, *path, **options):
    """`sweep` for a stack of draws of a profile: arrays of shape (draws, theta)."""
    return force_draws(profile, leg, turned(*path, **options))
