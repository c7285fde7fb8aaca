"""Comparison of each run with the alpha that the other runs of its medium give for its direction.

Three runs of one direction or more are compared with one another, in units of how repeats of this medium
differ. A single run is compared with what all other runs and the shape that granular media share
(`rftfit.model.shapes`) say of its direction. A medium that is rougher than the known ones differs more in
every direction, so the unit is the spread of these differences in this medium.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.measure.alpha import SAME_DEPTH_CM, SAME_DIRECTION_DEG, column
from rftfit.model.shapes import published_shapes

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
REPEATS, MAP = "repeats", "map"
"""What a run is compared with: runs of its direction, or the map of all others."""

_BED, _LEAST = 0.05, 0.05
"""Ordinary scatter of a run: relative to its alpha, and to the largest alpha of its medium."""
_LEAST_REPEATS = 0.08
"""Weak directions differ more than in proportion to alpha: of the largest alpha of the medium."""
_SWITCHES_WITHIN_DEG = 2.0
"""Errors of angle of an ordinary rig add up to less."""
_FEW_RUNS, _ORDINARY = 24, 0.06
"""Fewer repeats than this do not tell how much repeats of this medium differ: relative to alpha, half of them by so much."""
_REPEATS_APART: tuple[tuple[float, float], ...] = (6.3, 0.25), (8.0, 0.10)
"""Times the median difference, and relative to alpha: the smaller a difference is, the clearer it has to be."""
_TIMES_MAP, _LEAST_MAP, _TAIL, _FEWEST = 7.0, 0.13, 0.95, 10
"""Of the map: where each run is left out in turn, the published media differ from the map of the others by up to
0.12 of their largest alpha and 4.1 times the 95 % quantile of all differences, with beds 5 % apart 4.4 times; in
1008 sound tables of 20 to 54 directions with such beds, two runs are farther than both limits."""


def compare_runs(fits: pd.DataFrame, medium: str) -> pd.DataFrame:
    """Compare each run that has alpha with the others of its medium; a row a run.

    `off_z_ratio`, `off_x_ratio`: difference from the others, relative to the largest alpha of the medium.
    `known_z_ratio`, `known_x_ratio`: the least that all published media feel in this direction, relative to
    their alpha_z at (0, 90) deg, with its sign; 0 where they differ in sign. `times_spread`: the larger
    difference in units of the spread of such differences. `apart`: whether that is more than chance
    explains; a difference below `seen_from_ratio`, relative to the largest alpha, never is.
    """
    names = [column(c) for c in "zx"]
    known = fits[np.isfinite(fits[names].to_numpy(float)).any(axis=1)].reset_index(drop=True)
    if known.empty:
        return pd.DataFrame(columns=COLUMNS)
    alpha = known[names].to_numpy(float).T
    groups = directions_of(known)
    others, times, apart, seen = _compare_with_repeats(alpha, groups, may_switch(known))
    single = np.array([(groups == own).sum() < 3 for own in groups])
    if single.any():
        said, of_map, far, least = (part[..., single] for part in _compare_with_map(known, alpha))
        others[:, single], times[single], apart[single], seen[single] = said, of_map, far, least
    # of a medium without any force nothing is relative
    largest = float(np.nanmax(np.abs(alpha))) or math.nan
    off = (alpha - others) / largest
    rows = {
        "medium": medium,
        "run_id": known["run_id"],
        "beta_deg": known["beta_deg"],
        "gamma_deg": known["gamma_deg"],
        "n_others": [(groups == own).sum() - 1 for own in groups],
        "beside": np.where(single, MAP, REPEATS),
        "off_z_ratio": off[0],
        "off_x_ratio": off[1],
        "times_spread": times,
        "apart": apart,
        "seen_from_ratio": seen / largest,
    }
    smallest = _smallest_published(
        *(np.radians(known[f"{name}_deg"].to_numpy(float)) for name in ("beta", "gamma"))
    )
    for place, c in enumerate("zx"):
        rows |= {f"known_{c}_ratio": smallest[place]}
        rows |= {f"alpha_{c}_N_per_cm3": alpha[place], f"others_{c}_N_per_cm3": others[place]}
    return pd.DataFrame(rows)[COLUMNS]


def _smallest_published(beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Smallest alpha of all published media, with its sign, shape (2, n); 0 where the signs differ."""
    shapes = published_shapes()
    level = shapes.of_media(np.zeros(1), np.full(1, math.pi / 2))[:, :1]
    ratios = np.stack(np.split(shapes.of_media(beta, gamma), 2, axis=1)) / level
    alike = np.abs(np.sign(ratios).sum(axis=1)) == ratios.shape[1]
    return np.where(alike, np.sign(ratios[:, 0]) * np.abs(ratios).min(axis=1), 0.0)


def outlier_differences(peers: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Alpha of each outlier minus the alpha that the other runs give, z and x, N/cm^3."""
    rows = peers[peers["apart"].astype(bool)]
    z, x = (rows[column(c)] - rows[f"others_{c}_N_per_cm3"] for c in "zx")
    return dict(zip(rows["run_id"].astype(str), zip(z, x, strict=True), strict=True))


def directions_of(runs: pd.DataFrame) -> FloatArray:
    """Number of the direction of each run; a level run also has a depth, since no depth is like another."""
    beta, gamma, depth = (
        runs[name].to_numpy(float) for name in ("beta_deg", "gamma_deg", "depth_from_cm")
    )
    near = np.abs((beta - beta[:, None] + 90) % 180 - 90) <= SAME_DIRECTION_DEG
    near &= np.abs(gamma - gamma[:, None]) <= SAME_DIRECTION_DEG
    level = (gamma == 0) & np.isfinite(depth)
    near &= ~level[:, None] | (np.abs(depth - depth[:, None]) <= SAME_DEPTH_CM)
    return np.asarray(near.argmax(axis=1), dtype=float)


def may_switch(runs: pd.DataFrame) -> npt.NDArray[np.bool_]:
    """Whether a small error of an angle decides to which side of the plate the grains flow.

    So it is where a plate moves along itself or along its normal: 3D-RFT (Agarwal et al., PNAS 120, e2214017120, 2023)
    has two values there, of one size. Straight down and up a level plate has one by symmetry.
    """
    beta, gamma = (runs[f"{name}_deg"].to_numpy(float) for name in ("beta", "gamma"))
    from_plate = np.abs((beta + gamma + 45) % 90 - 45)
    is_level = (np.abs(beta) <= SAME_DIRECTION_DEG) & (np.abs(gamma) > 90 - SAME_DIRECTION_DEG)
    return np.asarray((from_plate <= _SWITCHES_WITHIN_DEG) & ~is_level)


def _compare_with_repeats(
    alpha: FloatArray, groups: FloatArray, switches: npt.NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Median of the other runs of a direction; distance of each run; whether it is an outlier; smallest distance detected."""
    # a component that nobody measured makes no difference
    felt = alpha.copy()
    felt[1] = np.where(np.isfinite(alpha[0]) & np.isnan(alpha[1]), 0.0, alpha[1])
    weakest = _LEAST_REPEATS * np.nanmax(np.abs(felt))

    def beside(here: npt.NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Median of the others, and the difference from it relative to its size."""
        said = np.stack([np.median(felt[:, here[here != one]], axis=1) for one in here], axis=1)
        # beds differ by so many percent of both components; the weakest directions by more
        level = np.hypot(np.hypot(*said), weakest)
        distance = np.hypot(*(felt[:, here] - said))
        sizes = np.hypot(*felt[:, here])
        others_size = np.array([np.median(sizes[here != run]) for run in here])
        distance = np.where(switches[here], np.abs(sizes - others_size), distance)
        return said, distance / level

    others, (off, level) = np.full(alpha.shape, math.nan), np.full((2, groups.size), math.nan)
    each = (np.flatnonzero(groups == own) for own in np.unique(groups))
    members = [here for here in each if here.size > 2]
    for here in members:
        others[:, here], off[here] = beside(here)
        level[here] = np.hypot(np.hypot(*others[:, here]), weakest)
    known = off[np.isfinite(off)]
    unit = max(float(np.median(known)), 0.01) if known.size >= _FEW_RUNS else _ORDINARY
    far = np.zeros(groups.size, dtype=bool)
    for here in members:
        # where runs are wrong, the others differ from their median too: the farthest goes first
        rest = here
        while 2 * (here.size - rest.size + 1) < here.size:
            own = beside(rest)[1]
            at = int(own.argmax())
            if not any(own[at] > max(clear * unit, least) for clear, least in _REPEATS_APART):
                break
            far[rest[at]] = True
            rest = np.delete(rest, at)
    seen = level * min(max(clear * unit, least) for clear, least in _REPEATS_APART)
    others[np.isnan(alpha)] = math.nan
    return others, np.nan_to_num(off / unit), far, seen


def _compare_with_map(
    runs: pd.DataFrame, alpha: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Alpha of each run by a map of all others; distance; whether it is an outlier; smallest distance detected."""
    beta, gamma = (np.radians(runs[f"{name}_deg"].to_numpy(float)) for name in ("beta", "gamma"))
    se = np.stack([runs[column(c, "_se")].to_numpy(float) for c in "zx"])
    largest = float(np.nanmax(np.abs(alpha)))
    far = np.zeros(beta.size, dtype=bool)

    def beside(given: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        said, error = _predict_from_others(beta, gamma, np.where(given, alpha, math.nan), alpha, se)
        return said, np.nan_to_num(np.abs(alpha - said) / error), error

    said, times, error = beside(~far)
    while True:
        farthest = int(np.where(far, 0, times.max(axis=0)).argmax())
        rest = ~far & (np.arange(beta.size) != farthest)
        if rest.sum() < max(_FEWEST, 2 * far.sum()):
            break
        # a wrong run distorts the map near itself, so the limit is estimated without this run
        without, apart, its_error = beside(rest)
        unit = max(float(np.quantile(apart[:, rest], _TAIL)), 0.1)
        off = np.nan_to_num(np.abs(alpha - without)[:, farthest]).max()
        if apart[:, farthest].max() < _TIMES_MAP * unit or off < _LEAST_MAP * largest:
            seen = np.fmax(_LEAST_MAP * largest, np.fmax(*error) * _TIMES_MAP * unit)
            return said, times.max(axis=0) / unit, far, seen
        far[farthest] = True
        said, times, error = without, apart, its_error
    # too few runs, or too many outliers, to estimate a limit
    unknown = np.full(beta.size, math.nan)
    return said, unknown, np.zeros(beta.size, dtype=bool), unknown


def _predict_from_others(
    beta: FloatArray, gamma: FloatArray, given: FloatArray, alpha: FloatArray, se: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What the `given` runs but itself say of each run: alpha, N/cm^3, and its error, shape (2, n)."""
    count = beta.size
    mean, prior = published_shapes().moments(beta, gamma)
    known = np.flatnonzero(np.isfinite(given.ravel()))
    values, noise = alpha.ravel()[known], np.nan_to_num(se.ravel()[known])
    size = float(np.abs(values).sum() / np.abs(mean[known]).sum())
    for _ in range(3):
        own = np.hypot(_BED * mean, _LEAST * np.abs(mean).max()) * size
        covariance = size**2 * prior + np.diag(own**2)
        within = covariance[np.ix_(known, known)] + np.diag(noise**2)
        inverse = np.linalg.inv(within)
        weight = mean[known] @ inverse
        size = max(float(weight @ values) / float(weight @ mean[known]), 1e-9)
    off = inverse @ (values - size * mean[known])
    said, error = np.full((2, 2 * count), math.nan)
    for run in range(count):
        # both components of a run are left out together
        here = np.flatnonzero(known % count == run)
        if here.size:
            block = np.linalg.inv(inverse[np.ix_(here, here)])
            said[known[here]] = values[here] - block @ off[here]
            error[known[here]] = np.sqrt(np.diag(block))
            continue
        both = np.array([run, count + run])
        towards = covariance[np.ix_(both, known)]
        said[both] = size * mean[both] + towards @ off
        left = covariance[np.ix_(both, both)] - towards @ inverse @ towards.T
        error[both] = np.sqrt(np.diag(left))
    return said.reshape(2, count), error.reshape(2, count)
