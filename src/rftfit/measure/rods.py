"""Whether the rods of the rod runs are those of the plate runs, by how the force across that on the plate grows with depth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.ledger import RowStatus
from rftfit.measure.samples import split_runs
from rftfit.store.chosen import chosen

_CHOSEN = chosen("measure", "rods")


class TareShare(NamedTuple):
    """Share of the subtracted tares that was too much: 0.6 of a rod that bears 2.5 times the right one; standard error, and its dof."""

    share: float
    se: float
    dof: int


class _Profile(NamedTuple):
    """Push or pull by steps of depth: mean depth (k,), granular force and tare (2, k), and where samples are, with the tare's name.

    `direction`, `path`: Numbers of its direction and of the directions of any plate along its path.
    """

    direction: int
    path: int
    tare_run: str
    depth: FloatArray
    force: FloatArray
    tare: FloatArray
    is_there: np.ndarray


def estimate_share_too_much(
    fits: pd.DataFrame, tared: pd.DataFrame, windows: pd.DataFrame, tolerance_deg: float
) -> TareShare | None:
    """Estimate which share of the tares should not have been subtracted; None where the pushes do not tell it.

    The force on a plate keeps its direction at all depths, by whatever law it grows, and however the bed is packed along
    the path. The force on a rod grows otherwise, as more and more of the rod is in the bed. So where a tare is too large, a
    part of the rod's own course is left across the force on the plate. The course is taken from other rods on the same
    path: the noise of the run's own tare is in its granular force, too. Pulls tell most, since the force on a pulled plate
    is weak beside that on its rod.

    Parameters
    ----------
    fits, tared, windows : DataFrame
        Tables of the stage `slopes` and samples of the stage `tare`.
    tolerance_deg : float
        Difference of each angle up to which directions are one, of the campaign's grid.

    Returns
    -------
    TareShare or None
    """
    profiles = _profiles(fits, tared, windows, tolerance_deg)
    first = _estimate(profiles)
    if first is None:
        return None
    # what is left of the rods turns the force a little, so that the plate's own bend is no longer along it
    mended = [
        profile._replace(force=profile.force + first.share * profile.tare) for profile in profiles
    ]
    second = _estimate(mended)
    return None if second is None else second._replace(share=first.share + second.share)


def _estimate(profiles: list[_Profile]) -> TareShare | None:
    """Estimate the share by the force across the force that is left on the plate; None where the profiles do not tell it."""
    by_path: dict[int, list[_Profile]] = {}
    for profile in profiles:
        by_path.setdefault(profile.path, []).append(profile)
    sums: dict[int, FloatArray] = {}
    for profiles_of_path in by_path.values():
        tares = {profile.tare_run: profile for profile in profiles_of_path}
        for profile in profiles_of_path:
            others = [tare for name, tare in tares.items() if name != profile.tare_run]
            if others and (products := _products(profile, others)) is not None:
                sums[profile.direction] = sums.get(profile.direction, np.zeros(3)) + products
    if len(sums) < _CHOSEN.fewest_directions:
        return None
    left, of_tare, of_course = np.stack([*sums.values()], axis=1)
    if not of_tare.sum() > 0:
        return None
    share = float(left.sum() / of_tare.sum())
    # repeats share a tare, so each direction is one witness, with a variance in proportion to that of the course
    dof = left.size - 1
    scatter = float(((left - share * of_tare) ** 2 / of_course).sum()) / dof
    se = float(np.sqrt(scatter * of_course.sum()) / of_tare.sum())
    return TareShare(-share, se, dof)


def _profiles(
    fits: pd.DataFrame, tared: pd.DataFrame, windows: pd.DataFrame, tolerance_deg: float
) -> list[_Profile]:
    """Pushes and pulls that have a tare; straight down or up hardly a force of the rod acts across that on the plate."""
    is_good = windows["why"].to_numpy() == RowStatus.GOOD
    rows_of_run = split_runs(tared)
    names = ["depth_cm", "force_z_N", "force_x_N", "tare_z_N", "tare_x_N"]
    samples = tared[names].to_numpy(float).T
    steep = fits[fits["direction"].isin(["intrusion", "extraction"]) & (fits["tare_run"] != "")]
    numbers = (number_rows(rows, tolerance_deg) for rows in (steep, steep.assign(beta_deg=0.0)))
    names_of_runs = zip(steep["run_id"], steep["tare_run"], strict=True)
    profiles = []
    for (run_id, tare_run), direction, path in zip(names_of_runs, *numbers, strict=True):
        rows = rows_of_run.get(run_id)
        if rows is None:
            continue
        depth, *forces = samples[:, rows][:, is_good[rows]]
        if not depth.size:
            continue
        step = np.maximum((depth / _CHOSEN.step_cm).astype(int), 0)
        counts = np.bincount(step)
        depth_means, *force_means = (
            np.bincount(step, values) / np.maximum(counts, 1) for values in (depth, *forces)
        )
        means = np.array(force_means)
        profiles.append(
            _Profile(
                direction=int(direction),
                path=int(path),
                tare_run=str(tare_run),
                depth=depth_means,
                force=means[:2],
                tare=means[2:],
                is_there=counts >= _CHOSEN.fewest_samples,
            )
        )
    return profiles


def _products(profile: _Profile, others: list[_Profile]) -> FloatArray | None:
    """Products of the course of other rods with the force across, the tare and itself, weighed; None where too few steps are common."""
    size = min(profile.depth.size, *(other.depth.size for other in others))
    is_common = profile.is_there[:size] & np.all(
        [other.is_there[:size] for other in others], axis=0
    )
    if is_common.sum() < _CHOSEN.fewest_steps:
        return None
    depth = profile.depth[:size][is_common]
    course = np.mean([other.tare[:, :size][:, is_common] for other in others], axis=0)
    force, tare = (values[:, :size][:, is_common] for values in (profile.force, profile.tare))
    slopes = force @ depth / (depth @ depth)
    strength = float(np.hypot(*slopes))
    if not strength > 0:
        return None
    across = np.array([-slopes[1], slopes[0]]) / strength
    bend_of_course, bend_of_force, bend_of_tare = (
        _without_line(across @ values, depth) for values in (course, force, tare)
    )
    variance = (_CHOSEN.across * strength * depth.max()) ** 2 + _CHOSEN.zero_n**2
    bends = np.stack([bend_of_force, bend_of_tare, bend_of_course])
    return np.asarray(bends @ bend_of_course / variance)


def _without_line(values: FloatArray, depth: FloatArray) -> FloatArray:
    """Take off the line through zero that fits best."""
    return values - values @ depth / (depth @ depth) * depth
