"""Pushes of plates as measured numbers: read from tables, with the errors that repeats show, each direction once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.formats import ALPHA
from rftfit.conventions import FloatArray, mirror
from rftfit.directions import TOLERANCE_DEG, same_direction
from rftfit.errors import InputError
from rftfit.measure.alpha import Columns, alpha_columns, column, directions, flagged
from rftfit.measure.errors import (
    USUAL_BED_SPREAD,
    ErrorTerm,
    bed_of_mean,
    bed_of_next,
    combined_half_width,
    half_width_of_bed,
    scatter_of_runs,
    spread_of_beds,
)
from rftfit.model.draws import draws_of, errors_known

if TYPE_CHECKING:
    from rftfit.campaign.config import Config


class Pushes(NamedTuple):
    """Measured pushes.

    `beta`, `gamma`: shape (n,), rad. `alpha`: shape (2, n); z and x, N/cm^3, NaN where not measured.
    `covariance`: of the errors of alpha, (N/cm^3)^2, shape (2 n, 2 n), z first.
    """

    beta: FloatArray
    gamma: FloatArray
    alpha: FloatArray
    covariance: FloatArray

    @classmethod
    def of(
        cls,
        beta_deg: npt.ArrayLike,
        gamma_deg: npt.ArrayLike,
        alpha: npt.ArrayLike,
        se: npt.ArrayLike = np.nan,
    ) -> Pushes:
        """Make pushes with independent errors.

        `alpha`, `se`: shape (2, n), N/cm^3; a standard error of NaN is not known and replaced by `usual_error`.
        """
        beta, gamma = (
            np.radians(np.ravel(np.asarray(angles_deg, float)))
            for angles_deg in (beta_deg, gamma_deg)
        )
        alpha = np.asarray(alpha, dtype=float).reshape(2, beta.size)
        error = np.broadcast_to(np.asarray(se, dtype=float), alpha.shape)
        error = np.where(np.isnan(error), usual_error(alpha), error)
        return cls(beta, gamma, alpha, np.diag(error.ravel() ** 2))


NO_PUSHES = Pushes(np.zeros(0), np.zeros(0), np.zeros((2, 0)), np.zeros((0, 0)))

USUAL_PERCENT, LEAST_PERCENT = 100 * USUAL_BED_SPREAD, 1.0
"""Parts of an error that is not stated: relative to alpha of the push (scatter of beds), and to the largest alpha."""


def usual_error(
    alpha: FloatArray, percent: float = USUAL_PERCENT, least_percent: float = LEAST_PERCENT
) -> FloatArray:
    """Return the standard error of pushes whose error is not known, N/cm^3, in the shape of `alpha`."""
    largest = float(np.nanmax(np.abs(alpha), initial=0.0))
    return np.hypot(percent / 100 * alpha, least_percent / 100 * largest)


def sorted_pushes(pushes: Columns) -> Pushes:
    """Return the pushes of a table for `estimate_map`, sorted, so that the order of its rows has no effect."""
    angles_deg, alpha, se = _read_columns(pushes)
    order = np.lexsort([alpha[1], alpha[0], angles_deg[1], angles_deg[0]])
    beta_deg, gamma_deg = angles_deg[:, order]
    return Pushes.of(beta_deg, gamma_deg, alpha[:, order], se[:, order])


def _read_columns(pushes: Columns) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return angles (deg), alpha and standard errors (N/cm^3) of n pushes, each of shape (2, n); NaN: not stated."""
    name_of_alias = {name: column.name for column in ALPHA.columns for name in column.also}
    columns = {name_of_alias.get(str(name), str(name)): pushes[name] for name in pushes}
    if len(columns) < len([*pushes]):
        raise InputError(
            f"pushes: two columns have one meaning; found: {', '.join(map(str, pushes))}"
        )
    if missing := {"beta_deg", "gamma_deg", column("z")} - {*columns}:
        raise InputError(
            f"pushes: no column {', '.join(sorted(missing))}; found: {', '.join(columns)}"
        )
    not_stated = np.full(np.size(columns["beta_deg"]), np.nan)

    def stack(*names: str) -> FloatArray:
        arrays = (np.atleast_1d(columns.get(name, not_stated)) for name in names)
        return np.stack([array.astype(float) for array in arrays])

    return (stack("beta_deg", "gamma_deg"), stack(column("z"), column("x")), stack("se_z", "se_x"))


def push_straight_down(pushes: Columns, confidence: float) -> tuple[float, float] | None:
    """Find alpha_z(0, 90 deg) among pushes, and its standard error, N/cm^3; None if no plate was pushed straight down.

    The error of a single push is the stated error, or 0 if none is stated. For several pushes it is the error of their
    mean, calculated as for a map.
    """
    angles_deg, alpha, se = _read_columns(pushes)
    places, _ = same_direction_or_mirror(0.0, math.pi / 2, *np.radians(angles_deg))
    places = places[np.isfinite(alpha[0, places])]
    if not places.size:
        return None
    if places.size == 1:
        return float(alpha[0, places[0]]), float(np.nan_to_num(se[0, places[0]]))
    beta_deg, gamma_deg = angles_deg[:, places]
    down = Pushes.of(beta_deg, gamma_deg, alpha[:, places], se[:, places])
    mean = merged(with_scatter_of_repeats(down, confidence))
    return float(mean.alpha[0, 0]), float(np.sqrt(mean.covariance[0, 0]))


def one_push(alpha: float, se: float | None) -> Columns:
    """Return the columns of a table with one push straight down; an `se` of None becomes NaN."""
    columns = {"beta_deg": [0.0], "gamma_deg": [90.0], column("z"): [alpha]}
    return columns | {column("z", "_se"): [np.nan if se is None else se]}


def describe_push(alpha: float, se: float | None) -> str:
    """Describe one push straight down in words."""
    error = "" if se is None else f" (se {se:g})"
    return f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3{error}"


def pushes_of(table: pd.DataFrame, config: Config) -> Pushes:
    """Return the cells of an alpha table as pushes, with the covariance of their errors."""
    beta_deg = table["beta_deg"].to_numpy(float)
    alpha = np.stack(alpha_columns(table))
    if config.fit.flagged == "leave_out":
        alpha = np.where(flagged(table), np.nan, alpha)
    # rows at beta = -90 degrees that repeat one at 90, the same plate
    is_repeated = (beta_deg == -90) & table["gamma_deg"].isin(
        table.loc[beta_deg == 90, "gamma_deg"]
    )
    use = np.isfinite(alpha).any(axis=0) & ~is_repeated.to_numpy(bool)
    gamma_deg = table["gamma_deg"].to_numpy(float)
    if not errors_known(table):
        return Pushes.of(beta_deg[use], gamma_deg[use], alpha[:, use])
    draws = np.concatenate(
        [draws_of_component[:, use] for draws_of_component in draws_of(table, config)], axis=1
    )
    covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    beta, gamma = directions(table)
    return Pushes(beta[use], gamma[use], alpha[:, use], covariance)


def _by_direction(pushes: Pushes) -> Iterator[tuple[npt.NDArray[np.intp], FloatArray]]:
    """Yield for each direction the indices (n,) of pushes in it or its mirror image, and the signs of z and x, (2, n).

    The signs make alpha comparable with that of the first push: alpha_x of its mirror image has the opposite sign.
    """
    is_left = np.ones(pushes.beta.size, dtype=bool)
    for push in range(pushes.beta.size):
        if is_left[push]:
            same_pushes, sign_x = same_direction_or_mirror(
                pushes.beta[push], pushes.gamma[push], pushes.beta, pushes.gamma
            )
            # a push within the tolerance of two directions counts for the first direction alone
            is_new = is_left[same_pushes]
            same_pushes, sign_x = same_pushes[is_new], sign_x[is_new]
            is_left[same_pushes] = False
            yield same_pushes, np.stack([np.ones(same_pushes.size), sign_x])


class _Repeats(NamedTuple):
    """One component, z or x, of n pushes of the same direction.

    `places`: their rows in `Pushes.covariance`. `alpha`: shape (n,), N/cm^3, with signs as if all were in the direction
    of the first push.
    """

    places: npt.NDArray[np.intp]
    alpha: FloatArray


def _repeats_of(pushes: Pushes) -> Iterator[_Repeats]:
    """Yield each component of each direction that was measured by two pushes or more."""
    for same_pushes, signs in _by_direction(pushes):
        for component, alpha in enumerate(signs * pushes.alpha[:, same_pushes]):
            is_known = np.isfinite(alpha)
            if np.count_nonzero(is_known) > 1:
                places = component * pushes.beta.size + same_pushes[is_known]
                yield _Repeats(places, alpha[is_known])


def with_scatter_of_repeats(pushes: Pushes, confidence: float) -> Pushes:
    """Return pushes whose errors are as large as the scatter of pushes in one direction shows.

    Pushes without a stated error get the error of `spread_of_beds`, as the runs of a campaign do. Pushes with a stated
    error get the error by their scatter if it is larger than their errors explain. The scatter of few pushes is poorly
    known: the error is enlarged so that the normal interval is as wide as Student's.
    """
    repeats = [*_repeats_of(pushes)]
    if not repeats:
        return pushes
    variance = np.diag(pushes.covariance).copy()
    usual_variance = usual_error(pushes.alpha).ravel() ** 2
    spread = spread_of_beds(
        [
            (signs * pushes.alpha[:, same_pushes], np.zeros_like(signs))
            for same_pushes, signs in _by_direction(pushes)
        ]
    )
    for places, alpha in repeats:
        if (variance[places] == usual_variance[places]).all():
            component, first = divmod(int(places[0]), pushes.beta.size)
            mean_alpha = pushes.alpha[:, first].copy()
            mean_alpha[component] = alpha.mean()
            error_of_one_bed = spread.error_at(mean_alpha, component)
            share = np.full(alpha.size, 1 / alpha.size)
            bed = bed_of_mean(alpha, share, ErrorTerm(0.0), error_of_one_bed, spread.source)[1]
            # variance of one push, whose mean over the pushes has the error of the mean
            variance[places] = alpha.size * _normal_error(bed, confidence) ** 2
            continue
        scatter = scatter_of_runs(alpha)
        stated_variance_of_mean = 1 / np.sum(1 / np.maximum(variance[places], 1e-300))
        if scatter.sd**2 / alpha.size > stated_variance_of_mean:
            variance[places] = _normal_error(scatter, confidence) ** 2
    if np.array_equal(variance, np.diag(pushes.covariance)):
        return pushes
    return pushes._replace(covariance=np.diag(variance))


def bed_spread_of_repeats(pushes: Pushes, confidence: float) -> float:
    """Return the relative standard deviation of a further bed: the usual one, or the scatter of repeats if larger.

    The scatter is the root mean square over directions and components, weighted by degrees of freedom and by alpha
    squared.
    """
    squares, weights = 0.0, 0.0
    for _, alpha in _repeats_of(pushes):
        mean = abs(float(alpha.mean()))
        usual = ErrorTerm(USUAL_BED_SPREAD * mean)
        next_error = bed_of_next(alpha, usual, confidence, scatter=True)
        squares += (alpha.size - 1) * _normal_error(next_error, confidence) ** 2
        weights += (alpha.size - 1) * mean**2
    return math.sqrt(squares / weights) if weights else USUAL_BED_SPREAD


def _normal_error(error: ErrorTerm, confidence: float) -> float:
    """Return the standard deviation of a normal error whose interval is as wide as the interval of `error`."""
    return combined_half_width([error], confidence) / half_width_of_bed(1.0, confidence)


def merged(pushes: Pushes) -> Pushes:
    """Replace repeated pushes of a direction by their mean, weighted by their errors, with its error."""
    count = pushes.beta.size
    is_known = np.isfinite(pushes.alpha.ravel()) & np.isfinite(np.diag(pushes.covariance))
    covariance = pushes.covariance
    if is_known.all() and all(same.size == 1 for same, _ in _by_direction(pushes)):
        return pushes
    if not is_known.all():
        covariance = np.where(np.outer(is_known, is_known), covariance, 0.0)
    least = (1e-9 * np.abs(np.where(is_known, pushes.alpha.ravel(), 0.0)).max(initial=1e-9)) ** 2
    weight = np.where(is_known, 1 / np.maximum(np.diag(covariance), least), 0.0)
    first_pushes: list[int] = []
    groups: list[npt.NDArray[np.intp]] = []
    shares: list[FloatArray] = []
    for same_pushes, signs in _by_direction(pushes):
        first_pushes.append(int(same_pushes[0]))
        for component, sign in enumerate(signs):
            places = component * count + same_pushes
            total = float(weight[places].sum())
            groups.append(places)
            shares.append(sign * weight[places] / total if total else np.full(places.size, np.nan))
    # z of all directions, then x
    order = [*range(0, len(groups), 2), *range(1, len(groups), 2)]
    places = np.concatenate([groups[group] for group in order])
    share = np.concatenate([shares[group] for group in order])
    starts = np.cumsum([0, *(groups[group].size for group in order)])[:-1]
    not_measured = np.isnan(share[starts]).reshape(2, -1)
    share = np.nan_to_num(share)
    known_alpha = np.where(is_known, pushes.alpha.ravel(), 0.0)
    alpha = np.add.reduceat(share * known_alpha[places], starts).reshape(2, -1)
    # in place: for a thousand pushes each product would be another 32 MB
    merged_covariance = covariance[np.ix_(places, places)]
    merged_covariance *= share[:, None]
    merged_covariance *= share
    if starts.size < places.size:
        row_sums = np.add.reduceat(merged_covariance, starts, axis=0)
        merged_covariance = np.add.reduceat(row_sums, starts, axis=1)
    beta, gamma = pushes.beta[first_pushes], pushes.gamma[first_pushes]
    return Pushes(beta, gamma, np.where(not_measured, np.nan, alpha), merged_covariance)


def same_direction_or_mirror(
    beta: float, gamma: float, betas: FloatArray, gammas: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return indices of directions equal to (beta, gamma), rad, or its mirror image, and the sign of alpha_x."""
    nodes, signs = [], []
    for image, sign in (((beta, gamma), 1.0), (mirror(beta, gamma), -1.0)):
        image_deg = np.degrees([float(angle) for angle in image])
        off_gamma_deg = (np.degrees(gammas) - image_deg[1] + 180) % 360 - 180
        is_near = same_direction(np.degrees(betas), off_gamma_deg, image_deg[0], 0.0, TOLERANCE_DEG)
        nodes.append(np.flatnonzero(is_near))
        signs.append(np.full(nodes[-1].size, sign))
    places, first_places = np.unique(np.concatenate(nodes), return_index=True)
    return places, np.concatenate(signs)[first_places]
