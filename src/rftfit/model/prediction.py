"""Forces on an outline with their intervals: the spread of a profile carried through the integral."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.conventions import FloatArray
from rftfit.model.draws import end_names, interval
from rftfit.model.faces import moving_faces
from rftfit.model.forces import Forces, force_draws, forces_on
from rftfit.model.mesh import Mesh, Motion3D
from rftfit.model.mesh_prediction import IN_SPACE, predict_mesh
from rftfit.model.motion import Motion, rotation
from rftfit.model.outlines import Outline
from rftfit.model.profiles import FourierProfile, Profile
from rftfit.model.reference_kernel import place, submerged
from rftfit.model.scaling import ScaledMedium

QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")

Ends = dict[str, tuple["FloatArray", "FloatArray"]]
"""Lower and upper end of an interval of each quantity, by pose."""

_MOST_AT_ONCE = 2_000_000


def predict(
    profile: Profile,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    quantities: Sequence[str] = QUANTITIES,
    law: str = "measured",
    friction: float | None = None,
) -> pd.DataFrame:
    """Force and moment on a body that moves through a medium, with intervals.

    Parameters
    ----------
    profile : Profile
        Of the medium: `published_medium`, `Medium.profile` of a campaign, ``scale(...).profile``.
    outline : Outline or Mesh
        The body: `model_leg`, `arc`, `polyline` in the plane, a `Mesh` in space.
    motion : Motion or Motion3D, optional
        `rotation` (default: that of the paper's trials) or `path`; of a mesh a `Motion3D`.
    confidence : float, optional
        Level of the intervals, which are pointwise: each pose for itself.
    quantities : sequence of str, optional
        Which of ``force_z_N``, ``force_x_N``, ``moment_N_cm`` get an interval; default all. Of an outline.
    law : str, optional
        Of a mesh: ``measured``, the whole map, or ``3d-rft``, which takes its alpha_z(0, 90 deg) alone.
    friction : float, optional
        Of a mesh: stress along a face is at most this times the stress across it, and no face is pulled or
        driven. Default: as the law gives it; the surface of the measured plates is in their map.

    Returns
    -------
    pandas.DataFrame
        One row per pose: the columns of `motion`; ``force_z_N`` (up is positive), ``force_x_N``
        (toward +x), ``moment_N_cm`` about the reference point (from z toward x); after each its
        interval, as ``force_z_lo_N, force_z_hi_N``, where the profile has a spread; ``reason``, why
        there is no number. Of a mesh: ``x_cm, y_cm, z_cm``, forces and moments about the reference point in
        three directions (axes of the world), and ``closure_N``: the error of a force if the law in space errs
        alike on all faces that leave their plane (measured law). It is not in the interval, because no
        measurement in the plane contains it.

    Raises
    ------
    TypeError
        If the motion of a mesh is no `Motion3D`, or that of an outline is one.

    Examples
    --------
    >>> import rftfit
    >>> forces = rftfit.predict(rftfit.published_medium("poppy_LP"), rftfit.model_leg("c_leg"))
    >>> round(float(forces["force_z_N"].max()), 1)
    8.9
    """
    if isinstance(outline, Mesh):
        if not isinstance(motion, Motion3D):
            raise TypeError("a mesh moves in space: its motion is a Motion3D")
        return predict_mesh(profile, outline, motion, confidence, law, friction)
    if isinstance(motion, Motion3D):
        raise TypeError("an outline moves in the plane; Mesh.extrude makes a mesh of it")
    motion = rotation() if motion is None else motion
    best = forces_on(profile, outline, motion.poses)
    ends: Ends = {}
    if isinstance(profile.spread, Profile):
        ends = _of_draws(profile.spread, outline, motion.poses, confidence, quantities)
    elif isinstance(profile.spread, ScaledMedium):
        ends = _of_further_medium(profile.spread.at(confidence), outline, motion.poses, quantities)
    columns: dict[str, object] = dict(motion.columns)
    numbers = _named(best, QUANTITIES)
    for name, values in numbers.items():
        columns[name] = values
        if name in ends:
            columns |= dict(zip(end_names(name), ends[name], strict=True))
    unknown = np.isnan(np.stack(list(numbers.values()))).any(axis=0)
    return pd.DataFrame(columns | {"reason": np.where(unknown, best.reason, "")})


def _of_further_medium(
    medium: ScaledMedium, outline: Outline, poses: FloatArray, quantities: Sequence[str]
) -> Ends:
    reference = medium.reference
    unit = _named(forces_on(FourierProfile(reference.m0), outline, poses), quantities)
    each = _named(force_draws(FourierProfile(reference.scaled), outline, poses), quantities)
    return {name: medium.with_interval(unit[name], each[name])[1:] for name in quantities}


def _of_draws(
    draws: Profile,
    outline: Outline,
    poses: FloatArray,
    confidence: float,
    quantities: Sequence[str],
) -> Ends:
    parts: dict[str, list[FloatArray]] = {name: [] for name in quantities}
    for many in _at_once(draws, outline, poses):
        for name, values in _named(many, quantities).items():
            parts[name].append(np.stack(interval(values, confidence)))
    whole = {name: np.concatenate(part, axis=1) for name, part in parts.items()}
    return {name: (lo, hi) for name, (lo, hi) in whole.items()}


def _at_once(draws: Profile, outline: Outline, poses: FloatArray) -> Iterator[Forces]:
    """Forces of all draws, of so many poses as fit into the memory."""
    step = max(1, _MOST_AT_ONCE // draws.parameters[0].shape[0])
    for start in range(0, len(poses), step):
        yield force_draws(draws, outline, poses[start : start + step])


def _named(forces: Forces, quantities: Sequence[str]) -> dict[str, FloatArray]:
    return {name: getattr(forces, name) for name in quantities}


QUASI_STATIC_CM_PER_S = 50.0
"""Up to about this speed granular forces hardly depend on it (Li et al. 2013, text)."""

_NOTICED = 0.1
"""Part of the force on a body that is worth a word."""


def beyond_measured(
    profile: Profile, outline: Outline | Mesh, motion: Motion | Motion3D | None = None,
    config: Config | None = None,
) -> list[str]:  # fmt: skip
    """Where a prediction leaves what was measured, or what the model is for.

    Parameters
    ----------
    profile : Profile
        Its `window` says over which depths alpha was measured.
    outline : Outline or Mesh
    motion : Motion or Motion3D, optional
        Default: the rotation of the paper's trials.
    config : Config, optional
        Its container, in whose middle the motion is taken to be, and `fit.wall_clearance_cm`.
        Default: a bed without walls.

    Returns
    -------
    list of str
        A sentence for each limit that is left: deeper or shallower than the window, faster than
        quasi-static, near walls or bottom. The share is that of depth times area, summed over all poses.

    Examples
    --------
    >>> import rftfit
    >>> leg = rftfit.model_leg("c_leg")
    >>> rftfit.beyond_measured(rftfit.published_medium("poppy_LP"), leg)
    []
    """
    load, depth, speed, *level = _pieces(outline, rotation() if motion is None else motion)
    total = float(np.nansum(load))
    if not total > 0:
        return []
    found = []
    shallowest, deepest = profile.window

    def share(where: np.ndarray) -> float:
        return float(np.nansum(load[where])) / total

    if (deeper := depth[load > 0].max()) > deepest:
        found.append(
            f"deeper than measured: down to {deeper:.1f} cm, alpha is from {deepest:.1f} cm at most "
            f"({100 * share(depth > deepest):.0f} % of depth times area lies below)"
        )
    if (part := share(depth < shallowest)) > _NOTICED:
        found.append(
            f"nearer to the surface than measured: {100 * part:.0f} % of depth times area lies above "
            f"{shallowest:.1f} cm"
        )
    if (fastest := float(speed[load > 0].max())) > QUASI_STATIC_CM_PER_S:
        part = share(speed > QUASI_STATIC_CM_PER_S)
        found.append(
            f"faster than quasi-static: up to {fastest:.0f} cm/s ({100 * part:.0f} % of depth times area "
            f"above {QUASI_STATIC_CM_PER_S:g} cm/s), where the inertia of the grains counts too"
        )
    if config is not None:
        box, clear = config.container, config.fit.wall_clearance_cm
        near = depth > box.depth_cm - clear
        for place_cm, size in zip(level, (box.length_cm, box.width_cm), strict=False):
            wet = place_cm[load > 0]
            near |= np.abs(place_cm - (wet.max() + wet.min()) / 2) > size / 2 - clear
        if isinstance(outline, Outline):
            near |= outline.width_cm > box.width_cm - 2 * clear
        if (part := float(np.nansum(load[near])) / total) > _NOTICED:
            found.append(
                f"near the container: {100 * part:.0f} % of depth times area lies within {clear:g} cm of "
                "its walls or bottom, even in its middle; alpha was measured farther from them"
            )
    return found


def _pieces(outline: Outline | Mesh, motion: Motion | Motion3D) -> list[FloatArray]:
    """Of elements in all poses: depth times area (cm^3), depth (cm), speed, and x (of a mesh also y)."""
    if isinstance(outline, Mesh) and isinstance(motion, Motion3D):
        parts = []
        for frame in motion.frames:
            _, load, _, moves, arm = moving_faces(outline, frame)
            x, y, z = (frame[:3] + arm).T
            parts.append(np.stack([load, -z, np.linalg.norm(moves, axis=-1), x, y]))
        return list(np.hstack(parts))
    if isinstance(outline, Mesh) or isinstance(motion, Motion3D):
        raise TypeError("a mesh moves by a Motion3D, an outline by a Motion")
    elements = place(outline.body, outline.width_cm, motion.poses)
    load, centre = submerged(elements, outline.solid)
    speed = np.hypot(elements[..., 6], elements[..., 7])
    return [load, -centre[..., 1], speed, centre[..., 0]]


PEAKS = (
    ("lift", "force_z_N", 1),
    ("suction", "force_z_N", -1),
    ("thrust", "force_x_N", 1),
    ("drag", "force_x_N", -1),
    ("moment", "moment_N_cm", 1),
    ("moment_negative", "moment_N_cm", -1),
)
"""Name, quantity and sign of the peaks of a prediction."""


@dataclass(frozen=True)
class Peak:
    """Greatest force of one sign, with its interval (NaN where none is known), at theta_deg or t_s.

    Where the profile has draws, number and interval are mean and quantiles of the draws' own peaks; at
    is the place of the peak of their mean.
    """

    name: str
    quantity: str
    value: float
    lo: float
    hi: float
    at: float


def find_peaks(
    profile: Profile, outline: Outline, motion: Motion | None = None, confidence: float = 0.95
) -> list[Peak]:
    """Find the greatest force and moment of each sign on a body that moves, as `predict` takes them.

    Poses with NaN are left out. Returns only those that exist: no lift where nothing pushes up.
    """
    motion = rotation() if motion is None else motion
    table = predict(profile, outline, motion, confidence)
    own: dict[str, FloatArray] = {}
    known = table["force_z_N"].notna().to_numpy()
    if isinstance(profile.spread, Profile) and known.any():
        own = peaks_of_draws(profile.spread, outline, motion.poses[known])
    found = []
    at = table.iloc[:, 0].to_numpy(float)
    for name, quantity, sign in PEAKS:
        values = table[quantity].to_numpy(float)
        if np.isnan(values).all() or not np.nanmax(sign * values) > 0:
            continue
        row = int(np.nanargmax(sign * values))
        # where alpha has no error, neither has the peak
        if name in own and np.isfinite(own[name]).all():
            lo, hi = map(float, interval(own[name], confidence))
            value = float(own[name].mean())
        else:
            lo, hi = (float(table.iloc[row].get(end, math.nan)) for end in end_names(quantity))
            value = float(values[row])
        found.append(Peak(name, quantity, value, lo, hi, float(at[row])))
    return found


def largest_in_space(table: pd.DataFrame, key: str) -> list[Peak]:
    """Largest value of each force and moment in a table of `predict` of a mesh, with the interval of its row."""
    found = []
    for quantity in IN_SPACE:
        size = table[quantity].abs().fillna(0.0).to_numpy()
        if not size.max() > 0:
            continue
        row = table.iloc[int(size.argmax())]
        lo, hi = (float(row.get(end, math.nan)) for end in end_names(quantity))
        name = quantity.partition("_N")[0]
        found.append(Peak(name, quantity, float(row[quantity]), lo, hi, float(row[key])))
    return found


def peaks_of_draws(draws: Profile, outline: Outline, poses: FloatArray) -> dict[str, FloatArray]:
    """Greatest value of each of `PEAKS` in every draw, shape (draws,); NaN in a draw that lacks a pose."""
    parts: dict[str, list[FloatArray]] = {name: [] for name, *_ in PEAKS}
    for many in _at_once(draws, outline, poses):
        for name, quantity, sign in PEAKS:
            parts[name].append((sign * getattr(many, quantity)).max(axis=1))
    signs = {name: sign for name, _, sign in PEAKS}
    return {name: signs[name] * np.max(part, axis=0) for name, part in parts.items()}
