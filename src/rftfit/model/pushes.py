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
from rftfit.model.draws import draw_as_configured, errors_known

if TYPE_CHECKING:
    from rftfit.campaign.config import Config


class Pushes(NamedTuple):
    """Measured pushes of plates, n of them, from which a map is estimated.

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
        """Make pushes in n directions (degrees) with independent errors.

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
"""Pushes of a map that is estimated from contacts alone."""

USUAL_PERCENT, LEAST_PERCENT = 100 * USUAL_BED_SPREAD, 1.0
"""Parts of an error that is not stated: relative to alpha of the push (scatter of beds), and to the largest alpha."""


def usual_error(
    alpha: FloatArray, percent: float = USUAL_PERCENT, least_percent: float = LEAST_PERCENT
) -> FloatArray:
    """Return the standard error of pushes whose error is not known, N/cm^3, in the shape of `alpha`.

    `percent` of alpha and `least_percent` of the largest alpha, added in squares.
    """
    largest = float(np.nanmax(np.abs(alpha), initial=0.0))
    return np.hypot(percent / 100 * alpha, least_percent / 100 * largest)


def sorted_pushes(pushes: Columns) -> Pushes:
    """Return the pushes of a table for `estimate_map`, sorted, so that the order of its rows has no effect.

    `pushes`: columns as in `estimate_map`, with any names that ``rftfit scale --pushes`` accepts.
    """
    angles_deg, alpha, se = _read_columns(pushes)
    order = np.lexsort([alpha[1], alpha[0], angles_deg[1], angles_deg[0]])
    beta_deg, gamma_deg = angles_deg[:, order]
    return Pushes.of(beta_deg, gamma_deg, alpha[:, order], se[:, order])


def _read_columns(pushes: Columns) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return angles (deg), alpha and standard errors (N/cm^3) of n pushes, each of shape (2, n); NaN: not stated.

    Rows: beta and gamma; z and x; z and x. Raises InputError where a column is missing or there twice.
    """
    name_of_alias = {name: column.name for column in ALPHA.columns for name in column.also}
    columns = {name_of_alias.get(str(name), str(name)): pushes[name] for name in pushes}
    if len(columns) < len([*pushes]):
        raise InputError(
            f"pushes: two columns have one meaning; found: {', '.join(map(str, pushes))}"
        )
    needed = {"beta_deg", "gamma_deg", *({column("z")} if column("x") not in columns else ())}
    if missing := needed - {*columns}:
        raise InputError(
            f"pushes: no column {', '.join(sorted(missing))}; found: {', '.join(columns)}"
        )
    not_stated = np.full(np.size(columns["beta_deg"]), np.nan)

    def stack(*names: str) -> FloatArray:
        """Return columns as the rows of an array; one that is missing is NaN."""
        arrays = (np.atleast_1d(columns.get(name, not_stated)) for name in names)
        return np.stack([array.astype(float) for array in arrays])

    return (stack("beta_deg", "gamma_deg"), stack(column("z"), column("x")), stack("se_z", "se_x"))


def push_straight_down(pushes: Columns, confidence: float) -> tuple[float, float] | None:
    """Return alpha_z(0, 90 deg) of pushes, and its standard error, N/cm^3; None if no plate was pushed straight down.

    The error of a single push is the stated error, or 0 if none is stated. For several pushes it is the error of their
    mean, calculated as for a map.
    """
    angles_deg, alpha, se = _read_columns(pushes)
    pushes_down, _ = same_direction_or_mirror(0.0, math.pi / 2, *np.radians(angles_deg))
    pushes_down = pushes_down[np.isfinite(alpha[0, pushes_down])]
    beta_deg, gamma_deg = angles_deg[:, pushes_down]
    alpha, se = alpha[:, pushes_down], se[:, pushes_down]
    if not beta_deg.size:
        return None
    if beta_deg.size == 1:
        return float(alpha[0, 0]), float(np.nan_to_num(se[0, 0]))
    down = Pushes.of(beta_deg, gamma_deg, alpha, se)
    mean = merged(with_scatter_of_repeats(down, confidence))
    return float(mean.alpha[0, 0]), float(np.sqrt(mean.covariance[0, 0]))


def one_push(alpha: float, se: float | None) -> Columns:
    """Return the columns of a table with one push straight down, as `estimate_map` takes them.

    `alpha`: alpha_z(0, 90 deg); `se`: its standard error, None: not known; N/cm^3.
    """
    columns = {"beta_deg": [0.0], "gamma_deg": [90.0], column("z"): [alpha]}
    return columns | {column("z", "_se"): [np.nan if se is None else se]}


def describe_push(alpha: float, se: float | None) -> str:
    """Describe one push straight down, by alpha and its error, N/cm^3 (None: not known), in words."""
    error = "" if se is None else f" (se {se:g})"
    return f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3{error}"


def pushes_of(table: pd.DataFrame, config: Config) -> Pushes:
    """Return the cells of an alpha table as pushes, with the covariance of their errors, from draws of the table.

    A plate at beta = -90 degrees that is also at 90 counts once. Flagged cells are left out where the config says so
    (`fit.flagged`). A table that lacks an error has the usual ones.
    """
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
    draws = np.concatenate([drawn[:, use] for drawn in draw_as_configured(table, config)], axis=1)
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
    """One component, z or x, of n pushes of the same direction, of which there are at least two.

    `rows`: their rows in `Pushes.covariance`. `alpha`: shape (n,), N/cm^3, with signs as if all were in the direction
    of the first push.
    """

    rows: npt.NDArray[np.intp]
    alpha: FloatArray


def _repeats_of(pushes: Pushes) -> Iterator[_Repeats]:
    """Yield each component of each direction that was measured by two pushes or more."""
    for same_pushes, signs in _by_direction(pushes):
        for component, alpha in enumerate(signs * pushes.alpha[:, same_pushes]):
            is_known = np.isfinite(alpha)
            if np.count_nonzero(is_known) > 1:
                rows = component * pushes.beta.size + same_pushes[is_known]
                yield _Repeats(rows, alpha[is_known])


def with_scatter_of_repeats(pushes: Pushes, confidence: float) -> Pushes:
    """Return pushes whose errors are as large as the scatter of pushes in one direction shows.

    Pushes without a stated error get the error of `spread_of_beds`, as the runs of a campaign do. Pushes with a stated
    error get the error by their scatter if it is larger than their errors explain. The scatter of few pushes is poorly
    known: the error is enlarged so that the normal interval is as wide as Student's. `confidence`: level of that
    interval.
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
    for rows, alpha in repeats:
        # no push of these has a stated error: then the error of their mean is that of a campaign's repeats
        if (variance[rows] == usual_variance[rows]).all():
            component, first = divmod(int(rows[0]), pushes.beta.size)
            mean_alpha = pushes.alpha[:, first].copy()
            mean_alpha[component] = alpha.mean()
            error_of_one_bed = spread.error_at(mean_alpha, component)
            share = np.full(alpha.size, 1 / alpha.size)
            bed = bed_of_mean(alpha, share, ErrorTerm(0.0), error_of_one_bed, spread.source)[1]
            # variance of one push, whose mean over the pushes has the error of the mean
            variance[rows] = alpha.size * _normal_error(bed, confidence) ** 2
        else:
            scatter = scatter_of_runs(alpha)
            stated_variance_of_mean = 1 / np.sum(1 / np.maximum(variance[rows], 1e-300))
            if scatter.sd**2 / alpha.size > stated_variance_of_mean:
                variance[rows] = _normal_error(scatter, confidence) ** 2
    if np.array_equal(variance, np.diag(pushes.covariance)):
        return pushes
    return pushes._replace(covariance=np.diag(variance))


def bed_spread_of_repeats(pushes: Pushes, confidence: float) -> float:
    """Return the relative standard deviation of a further bed: the usual one, or the scatter of repeats if larger.

    The scatter is the root mean square over directions and components, weighted by degrees of freedom and by alpha
    squared. `confidence`: level at which the error of few repeats is as wide as Student's.
    """
    squares, weights = 0.0, 0.0
    for _, alpha in _repeats_of(pushes):
        mean = abs(float(alpha.mean()))
        usual = ErrorTerm(USUAL_BED_SPREAD * mean)
        # the error of one more push in another bed
        next_error = bed_of_next(alpha, usual, confidence, scatter=True)
        squares += (alpha.size - 1) * _normal_error(next_error, confidence) ** 2
        weights += (alpha.size - 1) * mean**2
    return math.sqrt(squares / weights) if weights else USUAL_BED_SPREAD


def _normal_error(error: ErrorTerm, confidence: float) -> float:
    """Return the standard deviation of a normal error whose interval is as wide as the interval of `error`."""
    return combined_half_width([error], confidence) / half_width_of_bed(1.0, confidence)


def merged(pushes: Pushes) -> Pushes:
    """Return pushes with repeats of a direction or its mirror image replaced by their mean, weighted by 1 / variance.

    A number that was not measured or has no error has no weight; a mean of such numbers alone is NaN.
    """
    direction = np.empty(pushes.beta.size, dtype=np.intp)
    first_pushes: list[int] = []
    sign_x = np.empty(pushes.beta.size)
    for same_pushes, signs in _by_direction(pushes):
        direction[same_pushes] = len(first_pushes)
        sign_x[same_pushes] = signs[1]
        first_pushes.append(int(same_pushes[0]))
    alpha, covariance = pushes.alpha.ravel(), pushes.covariance
    is_known = np.isfinite(alpha) & np.isfinite(np.diag(covariance))
    count = len(first_pushes)
    if is_known.all() and count == direction.size:
        return pushes
    if not is_known.all():
        alpha = np.where(is_known, alpha, 0.0)
        covariance = np.where(np.outer(is_known, is_known), covariance, 0.0)
    # index of the mean to which each number belongs: z of all directions, then x
    mean_number = np.concatenate([direction, count + direction])
    least_variance = (1e-9 * np.abs(alpha).max(initial=1e-9)) ** 2
    weight = np.where(is_known, 1 / np.maximum(np.diag(covariance), least_variance), 0.0)
    total = np.bincount(mean_number, weight, minlength=2 * count)
    sign = np.concatenate([np.ones_like(sign_x), sign_x])
    share = sign * weight / np.where(total > 0, total, 1.0)[mean_number]
    mean = np.bincount(mean_number, share * alpha, minlength=2 * count)
    # covariance of the means: sums of the covariance over blocks, with all numbers of one mean beside each other
    order = np.argsort(mean_number, kind="stable")
    starts = np.searchsorted(mean_number[order], np.arange(2 * count))
    # in place: for a thousand pushes each product would be another 32 MB
    mean_covariance = covariance[np.ix_(order, order)]
    mean_covariance *= share[order, None]
    mean_covariance *= share[order]
    if count < direction.size:
        row_sums = np.add.reduceat(mean_covariance, starts, axis=0)
        mean_covariance = np.add.reduceat(row_sums, starts, axis=1)
    return Pushes(
        pushes.beta[first_pushes],
        pushes.gamma[first_pushes],
        np.where(total > 0, mean, np.nan).reshape(2, -1),
        mean_covariance,
    )


def same_direction_or_mirror(
    beta: float, gamma: float, betas: FloatArray, gammas: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return the indices of directions equal to (beta, gamma) or its mirror image, all in rad, and their signs of alpha_x.

    `betas`, `gammas`: the directions, (n,). The sign is -1 for a direction that is the mirror image alone: alpha_x
    there is the negative of that at (beta, gamma). Both results have shape (same,).
    """
    is_near = []
    for image in ((beta, gamma), mirror(beta, gamma)):
        image_deg = np.degrees([float(angle) for angle in image])
        off_gamma_deg = (np.degrees(gammas) - image_deg[1] + 180) % 360 - 180
        is_near.append(
            same_direction(np.degrees(betas), off_gamma_deg, image_deg[0], 0.0, TOLERANCE_DEG)
        )
    indices = np.flatnonzero(np.logical_or(*is_near))
    return indices, np.where(is_near[0][indices], 1.0, -1.0)
