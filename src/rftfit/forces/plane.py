"""Forces of a profile on an outline in given poses; one profile, or a stack of draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.forces import reference_kernel
from rftfit.forces.outlines import Outline
from rftfit.model.compiling import is_worth_compiling
from rftfit.model.profiles import Profile, weighted_sum

_MOST_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Forces:
    """Net force and moment on an outline by pose, shape (..., p); leading axes are draws.

    Forces are up and toward +x positive; the moment is about the reference point (a leg's axle), positive
    from z toward x: in the sense of the angle, so that moment times its rate is power. `reason`: why
    there is NaN; empty if there is none.
    """

    force_z_N: FloatArray
    force_x_N: FloatArray
    moment_N_cm: FloatArray
    reason: str = ""


def forces_on(profile: Profile, outline: Outline, poses: FloatArray) -> Forces:
    """Integrate the forces over an outline in each pose (Eq. 2); `poses` (p, 6) as of a `Motion`."""
    poses = _checked(poses)
    body, width_cm, solid = outline.body, outline.width_cm, outline.solid
    if is_worth_compiling(len(poses) * len(body)):
        from rftfit.model.kernel import pose_forces

        net = pose_forces(profile.pack, body, width_cm, solid, poses)
    else:
        net = reference_kernel.pose_forces(profile, body, width_cm, solid, poses)
    force_z, force_x, moment = net.T.copy()
    return Forces(force_z, force_x, moment, "" if np.isfinite(net).all() else _why(profile))


def force_draws(profile: Profile, outline: Outline, poses: FloatArray) -> Forces:
    """Carry a stack of draws through the integral.

    Every profile is linear in its parameters: the geometry gives the weight of each parameter in
    each pose once, all draws are then one matrix product. Returns arrays of shape (draws, ..., p).
    """
    poses = _checked(poses)
    values_z, values_x = profile.parameters
    per_pose = max(1, len(outline.body) * max(values_z.shape[-1], values_x.shape[-1]))
    step = max(1, _MOST_AT_ONCE // per_pose)
    # of force, of force times its arm in x, in z: shape (3, p, parameters)
    parts = [
        _weights(profile, outline, poses[start : start + step])
        for start in range(0, len(poses), step)
    ]
    if not parts:
        nothing = np.zeros((*values_z.shape[:-1], 0))
        return Forces(nothing, nothing, nothing)
    weights_z, weights_x = (np.concatenate(weights, axis=1) for weights in zip(*parts, strict=True))
    moment = weighted_sum(values_x, weights_x[2]) - weighted_sum(values_z, weights_z[1])
    why = "" if np.isfinite(moment).all() else _why(profile)
    return Forces(
        weighted_sum(values_z, weights_z[0]), weighted_sum(values_x, weights_x[0]), moment, why
    )


def _weights(
    profile: Profile, outline: Outline, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    elements = reference_kernel.place(outline.body, outline.width_cm, poses)
    load, centre = reference_kernel.submerged(elements, outline.solid)
    arm = centre - poses[:, None, :2]
    scaled = load * np.stack([np.ones_like(load), arm[..., 0], arm[..., 1]])
    beta, gamma = (np.where(load == 0, 0.0, angle) for angle in reference_kernel.angles(elements))
    basis_z, basis_x = profile.basis(beta, gamma)
    by_pose = scaled.transpose(1, 0, 2)
    weights_z = (by_pose @ basis_z).transpose(1, 0, 2)
    if basis_x is basis_z:
        return weights_z, weights_z
    return weights_z, (by_pose @ basis_x).transpose(1, 0, 2)


def _checked(poses: FloatArray) -> FloatArray:
    poses = np.ascontiguousarray(poses, dtype=float)
    if poses.ndim != 2 or poses.shape[1] != 6:
        raise ValueError(f"poses of shape (p, 6) wanted, found {poses.shape}")
    return poses


def _why(profile: Profile) -> str:
    return profile.reason or "a position, angle or velocity is missing"
