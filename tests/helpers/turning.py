"""Forces on a turning leg and along a path without intervals, for tests and benchmarks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.model.forces import force_draws, forces_on
from rftfit.model.motion import HIP_HEIGHT_CM, RATE_RAD_PER_S, THETA_DEG, rotation_poses

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.model.forces import Forces
    from rftfit.model.outlines import Outline
    from rftfit.model.profiles import Profile


def turned(
    theta: npt.ArrayLike | None = None,
    hip_height_cm: float = HIP_HEIGHT_CM,
    rate_rad_per_s: float = RATE_RAD_PER_S,
) -> FloatArray:
    """Poses at angles theta, rad; by default -135 to 135 degrees by 1."""
    theta = np.radians(THETA_DEG) if theta is None else theta
    return rotation_poses(theta, hip_height_cm, rate_rad_per_s)


def sweep(profile: Profile, leg: Outline, *path: Any, **how: Any) -> Forces:
    """Force and moment about the axle on a leg `turned` so, one for each theta."""
    return forces_on(profile, leg, turned(*path, **how))


def sweep_draws(profile: Profile, leg: Outline, *path: Any, **how: Any) -> Forces:
    """`sweep` for a stack of draws of a profile: arrays of shape (draws, theta)."""
    return force_draws(profile, leg, turned(*path, **how))


def along_path(
    profile: Profile, outline: Outline, time_s: FloatArray, poses: FloatArray
) -> tuple[pd.DataFrame, Forces]:
    """Force and moment on an outline along a path.

    `time_s`: shape (p,). `poses`: shape (p, 6); From `read_path` or `path_poses`. Returns `table`:
    `t_s, x_cm, z_cm, angle_deg, force_z_N, force_x_N, moment_N_cm`; the moment is about the
    reference point. Returns `forces`: The same forces, and why there is NaN among them.
    """
    import pandas as pd

    forces = forces_on(profile, outline, poses)
    table = pd.DataFrame(
        {
            "t_s": time_s,
            "x_cm": poses[:, 0],
            "z_cm": poses[:, 1],
            "angle_deg": np.degrees(poses[:, 2]),
            "force_z_N": forces.force_z_N,
            "force_x_N": forces.force_x_N,
            "moment_N_cm": forces.moment_N_cm,
        }
    )
    return table, forces
