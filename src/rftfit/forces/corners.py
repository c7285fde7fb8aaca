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
    corners: list[int] = []
    changes: list[str] = []
    for target in moving.peak_targets(forces):
        size, pose = _largest(target, forces)
        size_by_steps, pose_by_steps = max(_largest(target, by_step) for by_step in forces_of_steps)
        if abs(size_by_steps - size) <= SAME_SHARE * _largest_of_kind(target, forces):
            continue
        corners.append(pose if size > size_by_steps else pose_by_steps)
        name, _, unit = target.quantity.replace("_", " ").partition(" N")
        changes.append(
            f"the largest {name} has {target.sign * size:.4g} N{unit} in the table and "
            f"{target.sign * size_by_steps:.4g} by the steps alone"
        )
    if not changes:
        return []
    key, positions = next(iter(motion.columns.items()))
    near = join_words(dict.fromkeys(f"{positions[pose]:g}" for pose in corners))
    sentence = (
        f"the path has a corner near {key} {near}, where a pose moves as the mean of the steps beside it: "
        f"{'; '.join(changes)}; quote the larger, or round the corner off by a few poses"
    )
    return [sentence]


def _largest_of_kind(target: PeakTarget, forces: ForcesByName) -> float:
    """Return the largest of all forces where the peak is a force, else of all moments; infinite where all are 0."""
    kind = target.quantity.partition("_")[0]
    sizes = [np.abs(forces[name]) for name in forces if name.startswith(kind)]
    return float(np.nanmax(sizes, initial=0.0)) or np.inf


def _largest(target: PeakTarget, forces: ForcesByName) -> tuple[float, int]:
    """Return the size of the largest force of the peak's sign, and the number of its pose."""
    sizes: FloatArray = np.nan_to_num(target.sign * forces[target.quantity])
    return float(sizes.max(initial=0.0)), int(sizes.argmax())
