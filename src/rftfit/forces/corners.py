"""Corners of a path: a pose there moves as the mean of two steps, and its force may be far from that in either."""

from __future__ import annotations

import numpy as np

from rftfit.campaign.problems import join_words
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
    """Say which largest forces a corner of a path changes; no sentence where there are none.

    Each pose moves as the mean of the steps before and after it. The forces are calculated again with the velocity of
    either step, and a peak that differs by more than `SAME_SHARE` is named.
    """
    if motion.rates_of_steps is None:
        return []
    moving = set_in_motion(body, motion)
    forces = moving.best(profile).forces
    forces_of_steps = [
        set_in_motion(body, motion.at_rates(rates)).best(profile).forces
        for rates in motion.rates_of_steps
    ]
    poses: list[int] = []
    changes: list[str] = []
    for target in moving.peak_targets(forces):
        of_poses = _largest(target, forces)
        of_steps = max(_largest(target, of_step) for of_step in forces_of_steps)
        if abs(of_steps[0] - of_poses[0]) <= SAME_SHARE * _largest_of_kind(target, forces):
            continue
        poses.append(max(of_poses, of_steps)[1])
        name, _, unit = target.quantity.replace("_", " ").partition(" N")
        changes.append(
            f"the largest {name} has {target.sign * of_poses[0]:.4g} N{unit} in the table and "
            f"{target.sign * of_steps[0]:.4g} by the steps alone"
        )
    if not changes:
        return []
    key, places = next(iter(motion.columns.items()))
    near = join_words(dict.fromkeys(f"{places[pose]:g}" for pose in poses))
    listed = "; ".join(changes)
    sentence = (
        f"the path has a corner near {key} {near}, where a pose moves as the mean of the steps beside it: {listed}; quote the "
        "larger, or round the corner off by a few poses"
    )
    return [sentence]


def _largest_of_kind(target: PeakTarget, forces: ForcesByName) -> float:
    """Largest of all forces where the peak is a force, else of all moments; infinite where all are 0."""
    kind = target.quantity.partition("_")[0]
    sizes = [np.abs(numbers) for name, numbers in forces.items() if name.startswith(kind)]
    return float(np.nanmax(sizes, initial=0.0)) or np.inf


def _largest(target: PeakTarget, forces: ForcesByName) -> tuple[float, int]:
    """Largest force of the sign that the peak has, and the number of its pose."""
    sizes: FloatArray = np.nan_to_num(target.sign * forces[target.quantity])
    return float(sizes.max(initial=0.0)), int(sizes.argmax())
