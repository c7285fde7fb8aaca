"""Offset and drift of two unrelated clocks by the force of one push: it grows only where the intruder goes deeper.

Two programs that log force and motion on unrelated clocks share no event but the push itself. `estimate_clocks` finds
the *offset* (time of the motion log minus time of the force log, s) at which the force is best explained as one smooth
function of depth, and its *drift* (change of the offset per s). First `search_lags` tries all offsets, here *lags*, by
a coarse function; then `_refine_offset` refines the best ones by least squares.

``time``, ``force``: readings on the force clock, s and N (lift plus any constant), shape (n,), in the order of time.
``motion_time``, ``depth``: readings on the motion clock, s and cm, growing downward from any zero, shape (m,).
*Explained* is the share of the variance of the force that the function of depth gives, 0 to 1; the rest is unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.measure.clocks import HOUR_S, ClockFit
from rftfit.measure.flags import Refused
from rftfit.measure.lab_frame import new_readings
from rftfit.measure.slopes import weighted_sum_variance
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `alignment`, says what each decides
_CHOSEN = chosen("measure", "alignment")


def smooth_basis(depth: FloatArray, knots: int, span: FloatArray | None = None) -> FloatArray:
    """Values of the cubic B-splines on even knots (at least 2) at each depth, shape (n, knots + 2).

    Weighted sums of the columns are smooth functions of depth, so least squares of the force on them asks no law of
    depth.

    `span`: Depths, cm, whose range the knots cover, by default `depth`. A depth beyond the range counts as its nearest
    end.
    """
    abscissa = depth if span is None else span
    low, high = float(abscissa.min()), float(abscissa.max())
    width = (high - low) / (knots - 1) or 1.0
    position = np.clip((depth - low) / width, 0, (knots - 1) * (1 - 1e-12))
    # interval between two knots that holds the depth, and the position in it, from 0 to 1
    interval = position.astype(int)
    u = position - interval
    # six times the four B-splines that are not 0 in an interval
    splines = ((1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3)
    basis = np.zeros((depth.size, knots + 2))
    rows = np.arange(depth.size)
    for column, spline in enumerate(splines):
        basis[rows, interval + column] = spline / 6
    return basis


def contact_basis(depth: FloatArray, surface: float, deepest: float, knots: int) -> FloatArray:
    """Basis of a force that is constant above the surface and, below it, its depth times a smooth function of that.

    With the surface in it, the offset and the surface can be told apart. Shape (n, knots + 3): first the constant.
    `surface`: Depth of the surface, cm. `deepest`: Largest depth, cm.
    """
    depth_below = np.maximum(depth - surface, 0.0)
    inner = smooth_basis(depth_below, knots, np.array([0.0, max(deepest - surface, 1e-6)]))
    return np.column_stack([np.ones(depth.size), depth_below[:, None] * inner])


def contact_depth(depth: FloatArray, force: FloatArray) -> float:
    """Depth of the last reading at which the force has made less than a small share of its rise, cm: about the surface.

    `depth`, `force`: Readings at the same times, in the order of time, the largest force last.
    """
    start = float(np.median(force[: max(8, force.size // 50)]))
    below = np.flatnonzero(force < start + _CHOSEN.first_share * (force[-1] - start))
    last_row = int(below[-1]) if below.size else 0
    return float(depth[last_row])


@dataclass(frozen=True)
class LagProfile:
    """Share of the force that no smooth function of depth explains, for each lag that was tried.

    A clear push has one deep minimum. `best`, `ends` and `rivals` are the lags from which the offset is refined, as the
    coarse search may rank them wrongly.

    `lag`: Motion clock minus force clock, s, increasing, shape (k,).
    `unexplained`: Share of the force's variance, 0 to 1, shape (k,).
    """

    lag: FloatArray
    unexplained: FloatArray

    @property
    def best(self) -> int:
        """Index of the smallest unexplained share."""
        return int(np.argmin(self.unexplained))

    def ends(self) -> list[float]:
        """First and last lag, s, that explain about as much as the best lag; a weak force leaves them far apart."""
        good = self.lag[self.unexplained <= _CHOSEN.as_good * self.unexplained[self.best]]
        return [float(good[0]), float(good[-1])]

    def rivals(self) -> list[float]:
        """Find up to three other lags, s, about as good as the best, with worse ones in between."""
        lowest = float(self.unexplained[self.best])
        misfits = self.unexplained.copy()
        misfits[self._valley(self.best)] = np.inf
        rival_lags: list[float] = []
        while len(rival_lags) < 3:
            second = int(np.argmin(misfits))
            if not misfits[second] < _CHOSEN.rival * lowest + 1e-3:
                break
            rival_lags.append(float(self.lag[second]))
            misfits[self._valley(second)] = np.inf
        return rival_lags

    def _valley(self, index: int) -> slice:
        """Lags around an index that belong to the same minimum: up to the nearest clearly worse ones on both sides."""
        high = self.unexplained > _CHOSEN.barrier * self.unexplained[index] + 1e-4
        left, right = np.flatnonzero(high[:index]), np.flatnonzero(high[index:])
        return slice(
            int(left[-1]) if left.size else 0, index + int(right[0]) if right.size else high.size
        )


def search_lags(
    time: FloatArray,
    force: FloatArray,
    motion_time: FloatArray,
    depth: FloatArray,
    starts: Sequence[float],
) -> LagProfile:
    """Try every lag at which the logs overlap by at least half of the shorter log, by a spline of force over depth.

    `starts`: Offsets, s; the steps of the lags are counted from the one nearest to their middle.
    """
    lag = _make_lags(time, motion_time, starts)
    # means of neighbours: the search needs no more readings than the function has bends
    block_size = math.ceil(time.size / _CHOSEN.readings)
    used = time.size - time.size % block_size
    time, force = (
        readings[:used].reshape(-1, block_size).mean(axis=1) for readings in (time, force)
    )
    # sum of squares about the mean, of which the spline leaves a share unexplained
    total = float(((force - force.mean()) ** 2).sum())
    share = np.ones(lag.size)
    if not total > 0:
        return LagProfile(lag, share)
    for index, offset in enumerate(lag):
        depth_now = np.interp(time + offset, motion_time, depth)
        contact = contact_depth(depth_now, force)
        # in air the force has no information, and knots of the function would be wasted there
        depth_now = np.maximum(depth_now, contact - 0.1 * (depth_now.max() - contact))
        if np.ptp(depth_now) <= 0:
            continue
        basis = smooth_basis(depth_now, _CHOSEN.knots)
        # the ridge keeps it regular, as at some lags no reading lies where a basis function is not 0
        normal = basis.T @ basis + 1e-9 * np.eye(basis.shape[1])
        moment = basis.T @ force
        explained = float(moment @ np.linalg.solve(normal, moment))
        share[index] = min(max((float(force @ force) - explained) / total, 0.0), 1.0)
    return LagProfile(lag, share)


def _make_lags(time: FloatArray, motion_time: FloatArray, starts: Sequence[float]) -> FloatArray:
    """Evenly spaced lags, s, shape (k,), at which the logs overlap by at least half of the shorter log.

    Refused where no lag makes them overlap so far. `starts`: see `search_lags`.
    """
    half_length = min(np.ptp(time), np.ptp(motion_time)) / 2
    first_lag = motion_time[0] - time[-1] + half_length
    last_lag = motion_time[-1] - time[0] - half_length
    step = max(_CHOSEN.finest_s, (last_lag - first_lag) / _CHOSEN.lags)
    # counted from the given offsets, so that an offset of exactly some hours is among them
    nearest_start = min(starts, key=lambda start: abs(start - (first_lag + last_lag) / 2))
    first_step = math.ceil((first_lag - nearest_start) / step)
    last_step = math.floor((last_lag - nearest_start) / step)
    if last_step < first_step:
        raise Refused("no-overlap")
    return np.asarray(nearest_start + step * np.arange(first_step, last_step + 1))


BUILD_UP_S: float = _CHOSEN.build_up_s
"""Standard error of the offset by the lag of the force, s: it needs some travel to build up, and relaxes at rest."""


@dataclass(frozen=True)
class Alignment:
    """Estimated offset and drift of two clocks, with the readings behind them; what `estimate_clocks` returns.

    `clock`: Offset and drift; its whole hours are 0 where the clocks have unrelated zeros.
    `drift_se`: Standard error of the drift.
    `explained`: Share of the force's variance that one smooth function of depth explains.
    `profile`: Share that is not explained, for all lags that were tried; a figure shows it.
    `time` (force clock, s), `force` (N), `depth` at that time (cm), `fitted` (N): The n readings used.
    `candidates`: Offsets (s) at which the fit ended from each of k starts, and the share not explained there, shape (2,
    k); the offset with the smallest share counts.
    """

    clock: ClockFit
    drift_se: float
    explained: float
    profile: LagProfile
    time: FloatArray
    force: FloatArray
    depth: FloatArray
    fitted: FloatArray
    candidates: FloatArray


class _OffsetFit(NamedTuple):
    """Offset (s), drift and reference time (s) by least squares; depth (cm) and fitted force (N) of each reading.

    Motion time = force time + offset + drift x (force time - reference), as in `ClockFit`. The variances, s^2 and 1,
    are those of offset and drift.
    """

    offset: float
    drift: float
    reference: float
    offset_variance: float
    drift_variance: float
    depth: FloatArray
    fitted: FloatArray


def estimate_clocks(
    force_time: FloatArray,
    force: FloatArray,
    motion_time: FloatArray,
    depth: FloatArray,
    max_drift: float,
    max_se_s: float,
) -> Alignment:
    """Estimate offset and drift between the clocks of a force and a motion log, from one push into the medium.

    Refused are a push whose force shows no clear rise, is not explained by depth, fits two offsets, or leaves the
    offset uncertain.

    `max_drift`: Standard deviation of the relative difference of two clocks' rates, known beforehand.
    `max_se_s`: Largest standard error of the offset, s; a less certain offset is refused.
    """
    time, pushed = _cut_to_push(force_time, force)
    if motion_time.size < _CHOSEN.min_readings or np.ptp(depth) <= 0:
        raise Refused("no-motion-in-depth", rows=motion_time.size)
    origins, are_hours = _find_starts(time, motion_time)
    profile = search_lags(time, pushed, motion_time, depth, origins)
    if profile.unexplained[profile.best] > 1 - _CHOSEN.explained:
        share = 100 * (1 - profile.unexplained[profile.best])
        raise Refused("force-not-depth", percent=share, least=100 * _CHOSEN.explained)
    # in a clear push these starts are the same lag
    starts = dict.fromkeys([float(profile.lag[profile.best]), *profile.ends(), *profile.rivals()])
    refine = partial(_refine_offset, time, pushed, motion_time, depth, max_drift)
    # the middle number of knots counts, the others show its bias
    few_knots, usual_knots, many_knots = _CHOSEN.knots_of_fit
    candidates = [refine(start, usual_knots) for start in starts]
    best_fit = _choose_best_fit(candidates, pushed)
    fits = [refine(best_fit.offset, few_knots), best_fit, refine(best_fit.offset, many_knots)]
    # the right number of knots is unknown: how the offsets differ with it is part of the error
    spread = float(np.var([fit.offset for fit in fits], ddof=1))
    se = math.sqrt(best_fit.offset_variance + spread + BUILD_UP_S**2)
    if not se <= max_se_s:
        raise Refused("clocks-uncertain", seconds=se, most=max_se_s)
    residual = pushed - best_fit.fitted
    rise, noise = float(np.ptp(best_fit.fitted)), float(residual.std())
    if rise < _CHOSEN.rise_to_slow_noise * noise:
        raise Refused("no-rise", newtons=rise, noise=noise)
    whole_hours = round(best_fit.offset / HOUR_S) if are_hours else 0
    shares = [float(((pushed - fit.fitted) ** 2).mean() / pushed.var()) for fit in candidates]
    return Alignment(
        ClockFit(best_fit.offset, best_fit.drift, best_fit.reference, se_s=se, hours=whole_hours),
        drift_se=math.sqrt(best_fit.drift_variance),
        explained=1 - float(residual.var() / pushed.var()),
        profile=profile,
        time=time,
        force=pushed,
        depth=best_fit.depth,
        fitted=best_fit.fitted,
        candidates=np.array([[fit.offset for fit in candidates], shares]),
    )


def _choose_best_fit(candidates: list[_OffsetFit], force: FloatArray) -> _OffsetFit:
    """Return the fit with the smallest sum of squared residuals; refuse if one at another offset is about as good.

    `candidates`: Fits from several starts. `force`: The readings that they fit, N, shape (n,).
    """
    misfit = [float(((force - fit.fitted) ** 2).sum()) for fit in candidates]
    best = candidates[int(np.argmin(misfit))]
    for fit, size in zip(candidates, misfit, strict=True):
        is_apart = abs(fit.offset - best.offset) > max(0.2, 4 * math.sqrt(best.offset_variance))
        if is_apart and size < _CHOSEN.as_good * min(misfit):
            first, second = sorted((fit.offset, best.offset))
            raise Refused("two-offsets", first=first, second=second)
    return best


def _cut_to_push(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return time and force of the push alone, which ends at the largest force; refuse a force that shows no push.

    A value that the log repeats counts once. What follows the largest force, a rest or a pull, depends on depth in
    another way.
    """
    fresh = new_readings(force[None])
    time, force = time[fresh], force[fresh]
    if time.size < _CHOSEN.min_readings:
        raise Refused("few-readings", found=time.size, wanted=_CHOSEN.min_readings)
    # the median size of the difference of two normal numbers is 0.954 standard deviations: 0.6745 sqrt(2)
    noise = float(np.median(np.abs(np.diff(force)))) / 0.954 + 1e-12
    start = float(np.median(force[: max(8, force.size // 50)]))
    peak = int(np.argmax(force))
    if force[peak] - start < _CHOSEN.rise_to_noise * noise:
        fall = start - float(force.min())
        if fall >= _CHOSEN.rise_to_noise * noise:
            raise Refused("force-falls", newtons=fall)
        raise Refused("no-rise", newtons=force[peak] - start, noise=noise)
    if peak + 1 < _CHOSEN.min_readings:
        raise Refused("begins-in-push", found=peak + 1, wanted=_CHOSEN.min_readings)
    # readings of a fast transducer are averaged: the motion log is no faster than these means
    block_size = math.ceil((peak + 1) / _CHOSEN.most_readings)
    # the last block ends with the largest force
    push = slice((peak + 1) % block_size, peak + 1)
    time, force = (
        readings[push].reshape(-1, block_size).mean(axis=1) for readings in (time, force)
    )
    return time, force


def _find_starts(time: FloatArray, motion_time: FloatArray) -> tuple[list[float], bool]:
    """Return offsets, s, from which lags are counted, and True if they are whole hours.

    Whole hours count if they make the logs overlap by half of the shorter one. Else the clocks have unrelated zeros,
    and the logs are taken to start together.
    """
    # from the middle of the force log to that of the motion log
    between = (motion_time[0] + motion_time[-1] - time[0] - time[-1]) / 2
    # half the longer log
    most_apart = max(float(np.ptp(time)), float(np.ptp(motion_time))) / 2
    nearest_hour = round(between / HOUR_S)
    offsets = [
        hour * HOUR_S
        for hour in (nearest_hour - 1, nearest_hour, nearest_hour + 1)
        # clocks of time zones differ by a day and two hours at most
        if abs(hour) <= 26 and abs(between - hour * HOUR_S) < most_apart
    ]
    return offsets or [float(motion_time[0] - time[0])], bool(offsets)


def _refine_offset(
    time: FloatArray,
    force: FloatArray,
    motion_time: FloatArray,
    depth: FloatArray,
    max_drift: float,
    offset: float,
    knots: int,
) -> _OffsetFit:
    """Refine an offset by least squares (Gauss-Newton) of offset, drift and surface.

    The force at time t is a smooth function of depth(t + offset + drift x (t - reference)), the basis of which
    `contact_basis` gives. Its weights are fitted in each step and projected out of the derivatives (variable
    projection).

    `offset`: Start, s. `knots`: Number of knots of the function. `max_drift`: see `estimate_clocks`.
    """
    drift, reference = 0.0, float(time.mean())
    surface = contact_depth(np.interp(time + offset, motion_time, depth), force)
    # in each step: force fitted at the present offset, its derivatives, least squares, and a new offset
    for _ in range(12):
        on_motion = time + offset + drift * (time - reference)
        depth_now, ahead, behind = np.interp(
            on_motion + np.array([[0.0], [_CHOSEN.step_s], [-_CHOSEN.step_s]]), motion_time, depth
        )
        deepest = float(depth_now.max())
        surface = min(surface, deepest - 0.05)
        basis_at = partial(contact_basis, deepest=deepest, knots=knots)
        basis = basis_at(depth_now, surface)
        weights = np.linalg.lstsq(basis, force, rcond=None)[0]
        fitted = basis @ weights
        residual = force - fitted
        # derivatives of the fitted force by the offset (s) and by the depth of the surface (cm)
        difference = basis_at(ahead, surface) - basis_at(behind, surface)
        change_per_s = difference @ weights / (2 * _CHOSEN.step_s)
        difference = basis_at(depth_now, surface + _CHOSEN.step_cm)
        difference -= basis_at(depth_now, surface - _CHOSEN.step_cm)
        change_per_cm = difference @ weights / (2 * _CHOSEN.step_cm)
        power = float(change_per_s @ change_per_s)
        if power <= 0:
            raise Refused("force-constant")
        basis_columns, _ = np.linalg.qr(basis)
        free_change_per_s = change_per_s - basis_columns @ (basis_columns.T @ change_per_s)
        # time about which a drift does not change the offset: the mean, weighted by what shows the offset
        new_reference = float(
            (free_change_per_s**2 @ time)
            / max(float(free_change_per_s @ free_change_per_s), 1e-300)
        )
        offset += drift * (new_reference - reference)
        reference = new_reference
        # derivatives by offset, drift and surface, without what a change of the weights would do as well
        jacobian = np.stack([change_per_s, change_per_s * (time - reference), change_per_cm])
        jacobian -= (jacobian @ basis_columns) @ basis_columns.T
        lever = jacobian[1]
        # a prior of standard deviation max_drift keeps the drift small unless the data show one
        variance = float(weighted_sum_variance(residual[None], lever)[0][0])
        # standard deviations known before of offset (s), drift and surface (cm): none but that of the drift matters
        prior_sd = np.array([1e3, max_drift, 1.0])
        prior_weights = variance / max(float(lever @ lever), 1e-300) / prior_sd**2
        normal = jacobian @ jacobian.T + np.diag(prior_weights + 1e-12 * power)
        pseudo_inverse = np.linalg.solve(normal, jacobian)
        prior_pull = np.array([0.0, prior_weights[1] * drift, 0.0])
        step = pseudo_inverse @ residual - np.linalg.solve(normal, prior_pull)
        step[[0, 2]] = np.clip(step[[0, 2]], -0.1, 0.1)
        offset, drift = offset + float(step[0]), drift + float(step[1])
        surface += float(step[2])
        if abs(step[0]) < 1e-4 and abs(step[2]) < 1e-3:
            break
    scatter = float(weighted_sum_variance(residual[None], pseudo_inverse[0])[0][0])
    scatter *= _fitted_terms_factor(residual, pseudo_inverse[0], scatter, basis.shape[1] + 3)
    of_drift = float(weighted_sum_variance(residual[None], pseudo_inverse[1])[0][0])
    # the prior holds the drift near 0: the error of the offset by that is added
    shrunk = np.linalg.solve(normal, [0.0, prior_weights[1] * max_drift, 0.0])
    return _OffsetFit(
        offset,
        drift,
        reference,
        offset_variance=scatter + float(shrunk[0] ** 2),
        drift_variance=of_drift + float(shrunk[1] ** 2),
        depth=depth_now,
        fitted=fitted,
    )


def _fitted_terms_factor(
    residual: FloatArray, weight: FloatArray, variance: float, terms: int
) -> float:
    """Factor m / (m - terms), at most 3, by which a variance grows because `terms` terms were fitted to the residuals.

    m is the number of independent residuals: autocorrelated ones count as fewer. `variance`: Variance of the sum of
    weight times residual.
    """
    if_independent = float(residual.var()) * float(weight @ weight)
    independent = residual.size * min(if_independent / max(variance, 1e-300), 1.0)
    return max(1.0, independent / max(independent - terms, independent / 3))
