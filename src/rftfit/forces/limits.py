"""Warnings where a prediction leaves what was measured or what the force model is for: depth, speed, walls, size.

The measured force on a part of a body (an element of an outline, a face of a mesh) is alpha times its depth times its
area. Shares are of depth times area, summed over all parts and poses: nearly shares of the force.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.campaign.config import Config
from rftfit.conventions import QUASI_STATIC_CM_PER_S
from rftfit.forces import model_error as errors
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.corners import describe_corners
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion, rotation
from rftfit.forces.moving import WetParts
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import NOTICED
from rftfit.model.known import profile_of
from rftfit.model.profiles import EPS, PAPER_WINDOW, KnownMedium, Profile


class Reach(NamedTuple):
    """How deep a body moves, and how far below the depths over which alpha was measured; depths are positive.

    `deepest_cm`: depth of the middle of the body's deepest part. `measured_to_cm`: depth to which alpha was measured.
    `share_below`: share of depth times area, summed over all poses, that lies below `measured_to_cm`.
    """

    deepest_cm: float
    measured_to_cm: float
    share_below: float


def reach_below_measured(
    medium: KnownMedium | str | Path, outline: Outline | Mesh, motion: Motion | Motion3D
) -> Reach | None:
    """Compare the depths of a body with those over which alpha was measured; None where it stays above the surface."""
    moving = set_in_motion(outline, motion)
    wet = moving.wet_parts()
    if not np.nansum(wet.load_cm3) > 0:
        return None
    return _reach(wet, depth_measured(profile_of(medium, moving.is_covered_by))[0])


def depth_measured(profile: Profile) -> tuple[float, str]:
    """Return the depth to which alpha was measured, cm, and a clause on it for a sentence.

    Where the pushes do not state their depth, that of the known media stands for it (`PAPER_WINDOW`).
    """
    deepest_cm = profile.window[1]
    if np.isfinite(deepest_cm):
        return deepest_cm, f"alpha is from {deepest_cm:.1f} cm at most"
    deepest_cm = PAPER_WINDOW[1]
    return deepest_cm, (
        f"known media were measured to {deepest_cm:.1f} cm, and how deep the pushes of this one went is not stated"
    )


def describe_depth(deepest_cm: float, clause: str) -> str:
    """Say that a body goes deeper than alpha was measured, down to `deepest_cm`; `clause`: from `depth_measured`."""
    return f"deeper than measured: down to {deepest_cm:.1f} cm, {clause}"


def describe_speed(fastest_cm_per_s: float) -> str:
    """Say that a body moves faster than the model is for: the forces of a slow motion do not depend on its speed."""
    return f"faster than quasi-static: up to {fastest_cm_per_s:.3g} cm/s"


def _reach(wet: WetParts, measured_to_cm: float) -> Reach:
    """Compare the depths of the parts of a body, `wet`, with the depth to which alpha was measured; one part bears a load."""
    share_below = _share(wet, wet.depth_cm > measured_to_cm)
    return Reach(float(wet.depth_cm[wet.load_cm3 > 0].max()), measured_to_cm, share_below)


def _share(wet: WetParts, chosen: npt.NDArray[np.bool_]) -> float:
    """Return the share of depth times area, summed over all poses, of the parts for which `chosen` is True, 0 to 1."""
    return float(np.nansum(wet.load_cm3[chosen]) / np.nansum(wet.load_cm3))


def beyond_measured(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    config: Config | None = None,
) -> list[str]:
    """List where a prediction leaves what was measured, or what the model is for.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        Medium, as `predict` takes it; the `window` of its profile says over which depths alpha was measured.
    outline : Outline or Mesh
    motion : Motion or Motion3D, optional
        Default: the rotation of the paper's trials.
    config : Config, optional
        States the container, in whose middle the motion is taken to be, and `fit.wall_clearance_cm`.
        Default: a bed without walls.

    Returns
    -------
    list of str
        A sentence for each limit that is left: deeper or shallower than the window, faster than
        quasi-static, near walls or bottom, sizes and speeds on which the model's own error was not
        tested; a wheel with lugs that rolls without a given rim; and a corner of a path that hides the largest force. The
        share is that of depth times area, summed over all poses.

    Examples
    --------
    >>> import rftfit
    >>> leg = rftfit.model_leg("c_leg")
    >>> rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), leg)
    []
    """
    motion = rotation() if motion is None else motion
    moving = set_in_motion(outline, motion)
    wet = moving.wet_parts()
    bears_load = wet.load_cm3 > 0
    if not bears_load.any():
        return []
    rim = motion.rim if isinstance(motion, Motion3D) else None
    warnings = [] if rim is None else rim.list_doubts()
    profile = profile_of(medium, moving.is_covered_by)
    warnings += describe_corners(profile, outline, motion)
    shallowest = profile.window[0]
    measured_to_cm, clause = depth_measured(profile)
    reach = _reach(wet, measured_to_cm)
    if reach.deepest_cm > measured_to_cm:
        warnings.append(
            f"{describe_depth(reach.deepest_cm, clause)} ({100 * reach.share_below:.0f} % of depth times area lies below)"
        )
    if (share_shallow := _share(wet, wet.depth_cm < shallowest)) > NOTICED:
        warnings.append(
            f"nearer to the surface than measured: {100 * share_shallow:.0f} % of depth times area lies above "
            f"{shallowest:.1f} cm"
        )
    if (fastest := float(wet.speed_cm_per_s[bears_load].max())) > QUASI_STATIC_CM_PER_S:
        share_fast = _share(wet, wet.speed_cm_per_s > QUASI_STATIC_CM_PER_S)
        warnings.append(
            f"{describe_speed(fastest)} ({100 * share_fast:.0f} % of depth times area "
            f"above {QUASI_STATIC_CM_PER_S:g} cm/s), where the inertia of the grains counts too"
        )
    if config is not None:
        box, clear = config.container, config.fit.wall_clearance_cm
        # parts near the bottom, then those near a wall, with the middle of the motion in the middle of the box
        near = wet.depth_cm > box.depth_cm - clear
        # an outline has x alone
        for position, size_cm in zip(
            wet.horizontal_cm, (box.length_cm, box.width_cm), strict=False
        ):
            loaded = position[bears_load]
            middle = (loaded.max() + loaded.min()) / 2
            near |= np.abs(position - middle) > size_cm / 2 - clear
        if isinstance(outline, Outline):
            near |= outline.width_cm > box.width_cm - 2 * clear
        if (share_near := _share(wet, near)) > NOTICED:
            warnings.append(
                f"near the container: {100 * share_near:.0f} % of depth times area lies within {clear:g} cm of "
                "its walls or bottom, even in its middle; alpha was measured farther from them"
            )
    if not errors.has_model_error(profile):
        return warnings
    eps = errors.EPS_IN_SPACE if errors.is_in_space(outline) else EPS
    return warnings + errors.beyond_tested(errors.longest(moving.points_cm), fastest, eps)
