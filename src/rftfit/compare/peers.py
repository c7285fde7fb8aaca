"""Comparison of each run with alpha in its direction by the other runs of its medium: which runs stand apart.

Three or more runs of one direction are compared with one another, in units of how repeats of this medium differ; two
runs are compared with how all pairs differ. A single run is compared with alpha in its direction by a map of all other
runs with the shape that granular media share (`rftfit.model.shapes`). In a medium that is rougher than the known ones
single runs differ more in every direction, so the unit is the spread of these differences in this medium. A run is
*apart* if its difference is more than chance explains.

n is the number of runs; alpha has shape (2, n), z and x, N/cm^3; `groups` is the number of the direction of each run.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, is_straight_down, number_directions
from rftfit.measure.alpha import alpha_columns, column, directions
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.measure.levels import sd_by_median
from rftfit.measure.repeats import unit_vectors
from rftfit.measure.verdict_words import MAP, PAIR, REPEATS
from rftfit.model.shapes import published_shapes
from rftfit.store.chosen import chosen

COLUMNS = [
    "medium",
    "run_id",
    "beta_deg",
    "gamma_deg",
    "n_others",
    "beside",
    *(f"{name}_{c}_N_per_cm3" for c in "zx" for name in ("alpha", "others")),
    "off_z_ratio",
    "off_x_ratio",
    "times_spread",
    "apart",
    "seen_from_ratio",
    "known_z_ratio",
    "known_x_ratio",
]
_CHOSEN = chosen("compare", "peers")

APART_FROM = {REPEATS: _CHOSEN.apart[0][0], PAIR: _CHOSEN.pair_second, MAP: _CHOSEN.times_map}
"""Least difference, in units of the spread, at which a run can stand apart, by what it is compared with: for figures."""


def compare_runs(
    fits: pd.DataFrame, medium: str, tolerance_deg: float = TOLERANCE_DEG
) -> pd.DataFrame:
    """Compare each run that has alpha with the others of its medium; returns a row of `COLUMNS` for each run.

    `fits`: Table of fits. `tolerance_deg`: Difference of each angle up to which runs are repeats.

    Columns: `beside`: what the run is compared with, `REPEATS`, `PAIR` or `MAP`. ``others_z_N_per_cm3``: alpha by the
    others. `off_z_ratio`, `off_x_ratio`: difference from it, relative to the largest alpha of the medium.
    `times_spread`: the larger difference in units of the spread of such differences. `apart`: whether the difference is
    more than chance explains; one below `seen_from_ratio`, relative to the largest alpha, never is. `known_z_ratio`,
    `known_x_ratio`: least alpha of all published media in this direction, relative to their alpha_z at (0, 90) deg,
    with its sign; 0 where they differ in sign.
    """
    has_alpha = np.isfinite(alpha_columns(fits)).any(axis=0)
    runs = fits.iloc[np.flatnonzero(has_alpha)].reset_index(drop=True)
    if runs.empty:
        return pd.DataFrame(columns=COLUMNS)
    alpha = np.stack(alpha_columns(runs))
    beta_deg, gamma_deg, depth_cm = (
        runs[name].to_numpy(float) for name in ("beta_deg", "gamma_deg", "depth_from_cm")
    )
    groups = number_directions(beta_deg, gamma_deg, tolerance_deg, depth_cm)
    compared_alpha = _turn_to_one_side(alpha, gamma_deg, may_switch(runs, tolerance_deg))
    compared = _compare_with_repeats(alpha, groups, compared_alpha)
    # runs of the direction of each run
    run_count = np.bincount(groups)[groups]
    # fewer than three runs: by the map first, then the runs of a pair by each other
    is_by_map = run_count < 3
    if is_by_map.any():
        compared = _choose(is_by_map, _compare_with_map(runs, alpha), compared)
    beside = np.where(is_by_map, MAP, REPEATS)
    is_of_pair = run_count == 2
    if is_of_pair.any():
        by_pair = _compare_pairs(compared_alpha, groups, is_of_pair)
        # a run that differs from its pair no more than by chance may still differ from the map of all others
        is_by_pair = is_of_pair & ~(compared.apart & ~by_pair.apart)
        beside = np.where(is_by_pair, PAIR, beside)
        # both differ from one another: the map says from which side, where there is one
        lacks_map = is_by_pair & np.isnan(compared.others)
        others = np.where(lacks_map, by_pair.others, compared.others)
        compared = _choose(is_by_pair, by_pair, compared)._replace(others=others)
    # without any force there is nothing to be relative to
    largest = float(np.nanmax(np.abs(alpha))) or math.nan
    off_z, off_x = (alpha - compared.others) / largest
    columns = {
        "medium": medium,
        "run_id": runs["run_id"],
        "beta_deg": runs["beta_deg"],
        "gamma_deg": runs["gamma_deg"],
        "n_others": run_count - 1,
        "beside": beside,
        "off_z_ratio": off_z,
        "off_x_ratio": off_x,
        "times_spread": compared.times_spread,
        "apart": compared.apart,
        "seen_from_ratio": compared.seen_from / largest,
    }
    # alpha of known media, for the checks of channels
    smallest = _smallest_published(*directions(runs))
    for component, c in enumerate("zx"):
        columns[f"known_{c}_ratio"] = smallest[component]
        columns[f"alpha_{c}_N_per_cm3"] = alpha[component]
        columns[f"others_{c}_N_per_cm3"] = compared.others[component]
    return pd.DataFrame(columns)[COLUMNS]


class _Compared(NamedTuple):
    """Runs compared with others of their medium; NaN and False where there is nothing to compare a run with.

    `others`: alpha by the other runs, (2, n). `times_spread`: difference from it in units of the spread of such
    differences, (n,). `apart`: whether the difference is more than chance explains, (n,). `seen_from`: least difference
    that would stand apart, N/cm^3, (n,).
    """

    others: FloatArray
    times_spread: FloatArray
    apart: npt.NDArray[np.bool_]
    seen_from: FloatArray


def _choose(is_first: npt.NDArray[np.bool_], first: _Compared, second: _Compared) -> _Compared:
    """Take the comparison of each run from the first where `is_first`, else from the second."""
    return _Compared(*(np.where(is_first, *pair) for pair in zip(first, second, strict=True)))


def _smallest_published(beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the smallest alpha of all published media, with its sign, shape (2, n); `beta`, `gamma`: rad.

    It is relative to their alpha_z(0, 90 deg), and 0 where the signs differ: any granular medium has at least so much.
    """
    shapes = published_shapes()
    # `of_media` returns alpha of media, shape (media, 2 n), z first; level: alpha_z straight down of each
    level = shapes.of_media(np.zeros(1), np.full(1, math.pi / 2))[:, :1]
    # shape (2, media, n)
    ratios = np.stack(np.split(shapes.of_media(beta, gamma), 2, axis=1)) / level
    same_sign = np.abs(np.sign(ratios).sum(axis=1)) == ratios.shape[1]
    return np.where(same_sign, np.sign(ratios[:, 0]) * np.abs(ratios).min(axis=1), 0.0)


def outlier_differences(peers: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Return alpha of each run apart minus alpha by the other runs, z and x, N/cm^3, by run_id.

    The alpha table widens the intervals of their cells by it. `peers`: Table of `compare_runs`.
    """
    rows = peers[peers["apart"].astype(bool)]
    z, x = (rows[column(c)] - rows[f"others_{c}_N_per_cm3"] for c in "zx")
    return dict(zip(rows["run_id"].astype(str), zip(z, x, strict=True), strict=True))


def may_switch(runs: pd.DataFrame, tolerance_deg: float) -> npt.NDArray[np.bool_]:
    """Return True for runs of which a small error of an angle decides to which side of the plate the grains flow, (n,).

    Repeats may then have opposite forces across the motion, and are no outliers. These are plates that move along
    themselves or along their normal: 3D-RFT (Agarwal et al., PNAS 120, e2214017120, 2023) has two values of one size
    there. A level plate that moves straight down or up has one value by symmetry.

    `runs`: Rows of the table of fits. `tolerance_deg`: Difference of each angle up to which directions are the same.
    """
    beta_deg, gamma_deg = (runs[name].to_numpy(float) for name in ("beta_deg", "gamma_deg"))
    # the plate moves along itself where beta + gamma is 0, along its normal where it is 90 degrees
    off_deg = np.abs((beta_deg + gamma_deg + 45) % 90 - 45)
    is_level = is_straight_down(beta_deg, np.abs(gamma_deg), tolerance_deg)
    return np.asarray((off_deg <= _CHOSEN.switches_within_deg) & ~is_level)


def _turn_to_one_side(
    alpha: FloatArray, gamma_deg: FloatArray, switches: npt.NDArray[np.bool_]
) -> FloatArray:
    """Turn the force across the motion to one and the same side where grains may flow to either; returns alpha, (2, n).

    The force along the motion stays: grains resist on either side. `switches`: From `may_switch`.
    """
    gamma = np.radians(gamma_deg)
    # unit vectors, z and x: of the motion and at right angles to it
    along = np.stack([-np.sin(gamma), -np.cos(gamma)])
    across = np.stack([along[1], -along[0]])
    turned = (alpha * along).sum(axis=0) * along + np.abs((alpha * across).sum(axis=0)) * across
    return np.where(switches & np.isfinite(alpha).all(axis=0), turned, alpha)


def _compare_with_repeats(
    alpha: FloatArray, groups: npt.NDArray[np.intp], compared_alpha: FloatArray
) -> _Compared:
    """Compare runs with the median of the others of their direction, where it has three or more.

    `compared_alpha`: alpha whose distances count, from `_turn_to_one_side`, (2, n); `alpha` states the median.
    """
    # a component that nobody measured makes no difference
    filled_alpha, compared_alpha = (
        np.stack([of_z, np.where(np.isfinite(of_z) & np.isnan(of_x), 0.0, of_x)])
        for of_z, of_x in (alpha, compared_alpha)
    )
    # alpha that is added to that of each direction, N/cm^3
    weakest = _CHOSEN.least_repeats * np.nanmax(np.abs(filled_alpha))

    def compare_group(members: npt.NDArray[np.intp]) -> tuple[FloatArray, FloatArray, float]:
        """Compare the k runs of a direction, or some of them, by their indices.

        Return the median of the others of each, (2, k), its distance from it relative to the size of alpha in the
        direction, (k,), and this size, N/cm^3.
        """
        median, compared_median = (
            np.stack([np.median(of_runs[:, members[members != run]], axis=1) for run in members], 1)
            for of_runs in (filled_alpha, compared_alpha)
        )
        # beds differ by a percentage of both components together; the weakest directions by more
        sizes = np.hypot(*filled_alpha[:, members])
        # by the median of all runs: the others of a right run may have a wrong one among them
        level = math.hypot(float(np.median(sizes)), weakest)
        distance = np.hypot(*(compared_alpha[:, members] - compared_median))
        return median, distance / level, level

    # first all runs beside their others, which gives the unit; off: relative to the size, level
    others = np.full(alpha.shape, math.nan)
    off, level = np.full(alpha.shape, math.nan)
    all_members = (np.flatnonzero(groups == group) for group in np.unique(groups))
    large_groups = [members for members in all_members if members.size > 2]
    for members in large_groups:
        others[:, members], off[members], level[members] = compare_group(members)
    finite_off = off[np.isfinite(off)]
    unit = (
        max(float(np.median(finite_off)), 0.01)
        if finite_off.size >= _CHOSEN.few_runs
        else _CHOSEN.ordinary
    )
    # distances, relative to the size of alpha, of which one has to be exceeded: a smaller one has to be
    # clearer in units of the spread
    limits = [max(clear * unit, least) for clear, least in _CHOSEN.apart]
    apart = np.zeros(groups.size, dtype=bool)
    # then, in these units, the runs apart; they stay less than half of their direction
    for members in large_groups:
        # a wrong run moves the median of the others, which then seem wrong: only the farthest is
        # left out at a time
        remaining = members
        while 2 * (members.size - remaining.size + 1) < members.size:
            distances = compare_group(remaining)[1]
            farthest = int(distances.argmax())
            if not distances[farthest] > min(limits):
                break
            apart[remaining[farthest]] = True
            remaining = np.delete(remaining, farthest)
    others[np.isnan(alpha)] = math.nan
    return _Compared(others, np.nan_to_num(off / unit), apart, level * min(limits))


def _compare_pairs(
    compared_alpha: FloatArray, groups: npt.NDArray[np.intp], is_of_pair: npt.NDArray[np.bool_]
) -> _Compared:
    """Compare the two runs of each direction, in standard errors by how all such pairs differ.

    Which of the two is wrong stays open: both are apart, or none. `compared_alpha`: see `_compare_with_repeats`.
    `is_of_pair`: True for the runs of a direction with two runs, (n,).
    """
    filled_alpha = np.nan_to_num(compared_alpha)
    runs = np.flatnonzero(is_of_pair)
    # indices of the two runs of each of the k pairs
    first, second = runs[np.argsort(groups[runs], kind="stable")].reshape(-1, 2).T
    sizes = (np.hypot(*filled_alpha[:, first]) + np.hypot(*filled_alpha[:, second])) / 2
    level = np.hypot(sizes, _CHOSEN.least_repeats * np.hypot(*filled_alpha).max())
    # a component that one of the two runs lacks makes no difference
    relative_difference = (
        np.nan_to_num(compared_alpha[:, first] - compared_alpha[:, second]) / level
    )
    # beds differ along the force more than across it
    along_and_across = unit_vectors(filled_alpha[:, first] + filled_alpha[:, second])
    # along and across, relative to the size of alpha, shape (2, k)
    differences = np.abs((along_and_across * relative_difference).sum(axis=1))
    usual = np.array([[USUAL_BED_SPREAD], [_CHOSEN.pair_across]])
    unit = _unit_of_pairs(differences, usual)
    # noise and small errors of an angle are a larger part of alpha in the weakest directions
    weak = _CHOSEN.pair_floor * np.hypot(*filled_alpha).max() / level
    unit = np.sqrt(unit**2 + 2 * weak**2)
    # the larger of both, in standard errors, shape (k,)
    of_pair = (differences / unit).max(axis=0)
    ranked = np.sort(of_pair)[::-1]
    # the clearest pair has to pass a higher limit where it is the only clear one
    limit = _CHOSEN.pair_largest
    if ranked.size > 1 and ranked[1] > _CHOSEN.pair_second:
        limit = _CHOSEN.pair_second
    least = np.array(_CHOSEN.pair_least)[:, None]
    is_apart = ((differences > limit * unit) & (differences > least)).any(axis=0)
    seen_from = np.maximum(_CHOSEN.pair_largest * unit, least).max(axis=0)
    # of pairs back to runs
    n = groups.size
    others, apart = np.full((2, n), math.nan), np.zeros(n, dtype=bool)
    times_spread, seen = np.full((2, n), math.nan)
    for runs_of_pairs, partners in ((first, second), (second, first)):
        others[:, runs_of_pairs] = compared_alpha[:, partners]
        times_spread[runs_of_pairs] = of_pair
        apart[runs_of_pairs] = is_apart
        seen[runs_of_pairs] = level * seen_from
    return _Compared(others, times_spread, apart, seen)


def _unit_of_pairs(differences: FloatArray, usual: FloatArray) -> FloatArray:
    """Estimate the standard deviation of the difference of each of k pairs by all other pairs, along and across, (2, k).

    A wrong pair does not show how pairs differ, so it is left out of its own unit. The squares of the others are capped
    at two standard deviations: their mean is as safe from a few wrong pairs as a median, with half the error.
    `differences`: sizes, relative to alpha, (2, k). `usual`: spread of single runs, shape (2, 1), which counts as a few
    more pairs; the difference of two runs has twice its variance.
    """
    count = differences.shape[1]
    other_pairs = count - 1
    squares = np.zeros(differences.shape)
    if other_pairs:
        is_other = ~np.eye(count, dtype=bool)
        # squares of the others of each pair, shape (2, k, k - 1)
        of_others = np.square(differences)[:, np.nonzero(is_other)[1]].reshape(
            2, count, other_pairs
        )
        squares = sd_by_median(np.sqrt(of_others)) ** 2
        for _ in range(20):
            capped = np.minimum(of_others, _CHOSEN.pair_cap**2 * squares[:, :, None])
            squares = capped.mean(axis=2) / _CHOSEN.pair_capped_square
    variance = _CHOSEN.pair_dof * 2 * usual**2 + other_pairs * squares
    return np.asarray(np.sqrt(variance / (_CHOSEN.pair_dof + other_pairs)))


def _compare_with_map(runs: pd.DataFrame, alpha: FloatArray) -> _Compared:
    """Compare each run with alpha by a map of all others; NaN and False where too few are left to find outliers.

    The farthest run is left out of the map, then the next one, until the next one is no farther than by chance. `runs`:
    Rows of the table of fits.
    """
    beta, gamma = directions(runs)
    se = np.stack(alpha_columns(runs, "_se"))
    largest = float(np.nanmax(np.abs(alpha)))
    apart = np.zeros(beta.size, dtype=bool)

    def predict_from(is_used: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Alpha of each run by the used ones but itself, its difference in errors, and the error; each (2, n)."""
        predicted, error = _predict_from_others(
            beta, gamma, np.where(is_used, alpha, math.nan), alpha, se
        )
        return predicted, np.nan_to_num(np.abs(alpha - predicted) / error), error

    predicted, times, error = predict_from(~apart)
    while True:
        # the farthest run that is no outlier yet is tried next
        farthest = int(np.where(apart, 0, times.max(axis=0)).argmax())
        remaining = ~apart & (np.arange(beta.size) != farthest)
        if remaining.sum() < max(_CHOSEN.fewest, 2 * apart.sum()):
            break
        # a wrong run distorts the map near itself, so the limit is estimated without this run
        new_predicted, new_times, new_error = predict_from(remaining)
        # how many errors ordinary runs of this medium differ by
        unit = max(float(np.quantile(new_times[:, remaining], _CHOSEN.tail)), 0.1)
        off = np.nan_to_num(np.abs(alpha - new_predicted)[:, farthest]).max()
        is_usual = new_times[:, farthest].max() < _CHOSEN.times_map * unit
        if is_usual or off < _CHOSEN.least_map * largest:
            seen = np.fmax(_CHOSEN.least_map * largest, np.fmax(*error) * _CHOSEN.times_map * unit)
            return _Compared(predicted, times.max(axis=0) / unit, apart, seen)
        apart[farthest] = True
        predicted, times, error = new_predicted, new_times, new_error
    # too few runs, or too many outliers, to estimate a limit
    unknown = np.full(beta.size, math.nan)
    return _Compared(predicted, unknown, np.zeros_like(apart), unknown)


def _predict_from_others(
    beta: FloatArray, gamma: FloatArray, used_alpha: FloatArray, alpha: FloatArray, se: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Predict alpha of each run and its error, (2, n), N/cm^3, by all others that have a number in `used_alpha`.

    The prior is the shape of known media, scaled to the size of this one. `beta`, `gamma`: rad, (n,). `used_alpha`:
    `alpha` with NaN for runs that are left out of all predictions, (2, n). `se`: standard error of `alpha`, (2, n).
    """
    count = beta.size
    mean, prior = published_shapes().moments(beta, gamma)
    # indices of the used numbers among the 2 n of all runs, z first
    used = np.flatnonzero(np.isfinite(used_alpha.ravel()))
    data, noise = alpha.ravel()[used], np.nan_to_num(se.ravel()[used])
    # of the medium, the factor on the known shape; the scatter depends on it, so it is found in rounds
    size = float(np.abs(data).sum() / np.abs(mean[used]).sum())
    for _ in range(3):
        scatter = np.hypot(USUAL_BED_SPREAD * mean, _CHOSEN.least * np.abs(mean).max()) * size
        covariance = size**2 * prior + np.diag(scatter**2)
        within = covariance[np.ix_(used, used)] + np.diag(noise**2)
        inverse = np.linalg.inv(within)
        weight = mean[used] @ inverse
        size = max(float(weight @ data) / float(weight @ mean[used]), 1e-9)
    off = inverse @ (data - size * mean[used])
    predicted, error = np.full((2, 2 * count), math.nan)
    for run in range(count):
        # both components of a run are left out together; a block of the inverse does this without a
        # new inverse (C. E. Rasmussen & C. K. I. Williams, Gaussian Processes, 2006, Eq. 5.12)
        components = np.flatnonzero(used % count == run)
        if components.size:
            block = np.linalg.inv(inverse[np.ix_(components, components)])
            predicted[used[components]] = data[components] - block @ off[components]
            error[used[components]] = np.sqrt(np.diag(block))
            continue
        # a run that is not used, by all that are
        both = np.array([run, count + run])
        towards = covariance[np.ix_(both, used)]
        predicted[both] = size * mean[both] + towards @ off
        conditional = covariance[np.ix_(both, both)] - towards @ inverse @ towards.T
        error[both] = np.sqrt(np.diag(conditional))
    return predicted.reshape(2, count), error.reshape(2, count)
