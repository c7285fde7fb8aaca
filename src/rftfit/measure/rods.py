"""Test whether rod runs and plate runs have the same rods, by the force at right angles to that on the plate.

The *tare* of a plate run is the force of its rod alone, measured in a run of its own and subtracted. If that run was
made with another rod, all forces are wrong by a share of the tare. `estimate_share_too_much` finds this share without
knowing the right rod. Forces are z, then x, N; ``depth``: cm. A *direction* is (beta, gamma), a *path* is gamma alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.conventions import BoolArray, FloatArray
from rftfit.directions import number_rows
from rftfit.measure.ledger import RowStatus
from rftfit.measure.samples import split_runs
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `rods`, says what each decides
_CHOSEN = chosen("measure", "rods")


class TareShare(NamedTuple):
    """Share of the subtracted tares that was too much, its standard error and the degrees of freedom of that.

    The share is 0.6 for a rod whose force is 2.5 times that of the right rod.
    """

    share: float
    se: float
    dof: int


class _Profile(NamedTuple):
    """Means of a push or pull in k steps of depth, each ``step_cm`` high.

    `direction`, `path`: Numbers of its direction and of its path; equal numbers mean the same. `tare_run`: run_id of
    its tare.
    `depth`: cm, shape (k,). `force`, `tare`: Granular force and subtracted tare, z and x, N, shape (2, k).
    `has_samples`: True for steps with enough samples, shape (k,).
    """

    direction: int
    path: int
    tare_run: str
    depth: FloatArray
    force: FloatArray
    tare: FloatArray
    has_samples: BoolArray


def estimate_share_too_much(
    fits: pd.DataFrame, tared: pd.DataFrame, windows: pd.DataFrame, tolerance_deg: float
) -> TareShare | None:
    """Estimate which share of the tares should not have been subtracted; None where the pushes do not show it.

    `fits`: A row a plate run: ``run_id``, ``tare_run``, ``direction`` (intrusion: a push, extraction: a pull), angles.
    `tared`: A row a sample, in the order of runs: ``run_id``, ``depth_cm``, ``force_{z,x}_N`` without the tare,
    ``tare_{z,x}_N``. `windows`: Of the same rows, ``why``: `RowStatus`, GOOD where the sample was fitted.
    `tolerance_deg`: Difference of each angle up to which directions are one, of the campaign's grid.

    The force on a plate keeps its direction at all depths, whatever the law of depth and the packing of the bed. The
    force on a rod grows by another law, as more and more of the rod is in the bed: its curve over depth bends. So where
    a tare is too large, some of this bend is left in the force at right angles to that on the plate. The expected bend
    is taken from other rods on the same path, because the noise of the tare of the run is also in its granular force.
    Pulls show most, since the force on a pulled plate is weak compared with that on its rod.
    """
    profiles = _make_profiles(fits, tared, windows, tolerance_deg)
    first = _estimate_once(profiles)
    if first is None:
        return None
    # a wrong tare turns the force a little, and with it the direction across: correct it and estimate again
    corrected = [
        profile._replace(force=profile.force + first.share * profile.tare) for profile in profiles
    ]
    second = _estimate_once(corrected)
    return None if second is None else second._replace(share=first.share + second.share)


def _estimate_once(profiles: list[_Profile]) -> TareShare | None:
    """Estimate the share from the forces as they are; None where the profiles do not show it.

    Let a, b and r be the bends of the force, of its tare and of other rods. The share is -sum(a r) / sum(b r).
    """
    # by path and tare run: one profile with this tare
    tares: dict[int, dict[str, _Profile]] = {}
    for profile in profiles:
        tares.setdefault(profile.path, {})[profile.tare_run] = profile
    sums: dict[int, FloatArray] = {}
    for profile in profiles:
        others = [tare for name, tare in tares[profile.path].items() if name != profile.tare_run]
        if others and (products := _bend_products(profile, others)) is not None:
            sums[profile.direction] = sums.get(profile.direction, np.zeros(3)) + products
    if len(sums) < _CHOSEN.fewest_directions:
        return None
    force_others, tare_others, others_others = np.stack([*sums.values()], axis=1)
    if not tare_others.sum() > 0:
        return None
    slope = float(force_others.sum() / tare_others.sum())
    # repeats share a tare, so each direction counts as one measurement; its variance is in proportion to sum(r^2)
    dof = force_others.size - 1
    scatter = float(((force_others - slope * tare_others) ** 2 / others_others).sum()) / dof
    se = float(np.sqrt(scatter * others_others.sum()) / tare_others.sum())
    return TareShare(-slope, se, dof)


def _make_profiles(
    fits: pd.DataFrame, tared: pd.DataFrame, windows: pd.DataFrame, tolerance_deg: float
) -> list[_Profile]:
    """Make the profiles of all pushes and pulls that have a tare; see `estimate_share_too_much` for the tables.

    Only samples that were fitted count. A run without such samples has no profile.
    """
    is_good = windows["why"].to_numpy() == RowStatus.GOOD
    rows_of_run = split_runs(tared)
    names = ["depth_cm", "force_z_N", "force_x_N", "tare_z_N", "tare_x_N"]
    samples = tared[names].to_numpy(float).T
    steep = fits[fits["direction"].isin(["intrusion", "extraction"]) & (fits["tare_run"] != "")]
    # number of the direction of each run, and of its path: that of a direction with beta left out
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
        # number of the step of depth that holds each sample
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
                has_samples=counts >= _CHOSEN.fewest_samples,
            )
        )
    return profiles


def _bend_products(profile: _Profile, others: list[_Profile]) -> FloatArray | None:
    """Return sums over depths of a r, b r and r r, divided by the variance of a bend, shape (3,): see `_estimate_once`.

    Bend: the component across the force on the plate, less its line through zero of depth. None where too few steps of
    depth are common, or where the plate has no force.
    """
    size = min(profile.depth.size, *(other.depth.size for other in others))
    is_common = np.all([some.has_samples[:size] for some in (profile, *others)], axis=0)
    if is_common.sum() < _CHOSEN.fewest_steps:
        return None
    depth = profile.depth[:size][is_common]
    mean_of_others = np.mean([other.tare[:, :size][:, is_common] for other in others], axis=0)
    force, tare = (values[:, :size][:, is_common] for values in (profile.force, profile.tare))
    slope_z, slope_x = force @ depth / (depth @ depth)
    strength = math.hypot(slope_z, slope_x)
    if not strength > 0:
        return None
    across = np.array([-slope_x, slope_z]) / strength
    bend_of_others, bend_of_force, bend_of_tare = (
        _without_line(across @ values, depth) for values in (mean_of_others, force, tare)
    )
    variance = (_CHOSEN.across * strength * depth.max()) ** 2 + _CHOSEN.zero_n**2
    bends = np.stack([bend_of_force, bend_of_tare, bend_of_others])
    return np.asarray(bends @ bend_of_others / variance)


def _without_line(values: FloatArray, depth: FloatArray) -> FloatArray:
    """Subtract from `values` the line through zero of depth that fits best, shape (k,): what is left is the bend."""
    return values - values @ depth / (depth @ depth) * depth
