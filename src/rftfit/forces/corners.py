"""Corners of a path: a pose there moves as the mean of two steps, and its force may be far from that of either."""

from __future__ import annotations

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.moving import ForcesByName
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import SAME_SHARE, PeakTarget
from rftfit.model.profiles import Profile


def describe_corners(
    profile: Profile, body: Outline | Mesh, motion: Motion | Motion3D
) -> list[str]:
    """Name the force that a corner of a path hides most: by the step before or after a pose it is larger than in any pose."""
    if motion.rates_of_steps is None:
        return []
    moving = set_in_motion(body, motion)
    forces = moving.best(profile).forces
    forces_of_steps = [
        set_in_motion(body, motion.at_rates(rates)).best(profile).forces
        for rates in motion.rates_of_steps
    ]
    hidden = []
    for target in moving.peak_targets(forces):
        for step, of_step in zip(("before", "after"), forces_of_steps, strict=True):
            size, pose = _largest(target, of_step)
            excess = size - _largest(target, forces)[0]
            share = excess / _largest_of_kind(target, forces)
            hidden.append((share, excess, target.quantity, step, pose))
    share, excess, quantity, step, pose = max(hidden)
    if not share > SAME_SHARE:
        return []
    name, _, unit = quantity.partition("_N")
    key, places = next(iter(motion.columns.items()))
    return [
        (
            f"a corner of the path hides the largest {name.replace('_', ' ')}: a pose moves as the mean of the steps beside it, "
            f"and by the step {step} the pose at {key} {places[pose]:g} it is {excess:.3g} N{unit.replace('_', ' ')} larger than in "
            "any pose; put a pose shortly before and one shortly after that corner"
        )
    ]


def _largest_of_kind(target: PeakTarget, forces: ForcesByName) -> float:
    """Largest force or moment of all poses, of what a peak is one of."""
    kind = target.quantity.partition("_")[0]
    sizes = [np.abs(numbers) for name, numbers in forces.items() if name.startswith(kind)]
    return float(np.nanmax(sizes, initial=0.0)) or np.inf


def _largest(target: PeakTarget, forces: ForcesByName) -> tuple[float, int]:
    """Largest force of the sign of a peak, and its pose."""
    sizes: FloatArray = np.nan_to_num(target.sign * forces[target.quantity])
    return float(sizes.max(initial=0.0)), int(sizes.argmax())
