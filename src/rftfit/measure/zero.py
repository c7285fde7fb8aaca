"""The transducer's zero: what it reads while the whole intruder is in air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rftfit.campaign import config
from rftfit.conventions import FloatArray
from rftfit.measure.fits import half_extent
from rftfit.measure.flags import Refused
from rftfit.measure.lab_frame import sensor_to_lab
from rftfit.measure.slopes import GIVEN_DOF, weighted_sum_variance

MIN_SAMPLES = 50
_FEWEST = 10


@dataclass(frozen=True)
class Zero:
    """Zero of the forces (z, x) of one run, to be subtracted.

    `force`, N: (2, n), a straight line in time between two stretches in air; else constant, (2, 1).
    `variance` (2,) of its error, N^2, allows for autocorrelation. `drift_N`: largest change between the
    two stretches; NaN if there is but one. `trend_N` (2,): what a straight line through the only stretch
    would add until the stroke; NaN if there are two or if it is not known.
    """

    force: FloatArray
    variance: FloatArray
    dof: float
    drift_N: float
    trend_N: tuple[float, float] = (math.nan, math.nan)


def height_needed(
    intruder: config.AnyPlate | config.Leg, angle: FloatArray, clearance: float
) -> FloatArray:
    """Height of the reference point, cm, at which the whole intruder is clear of the surface.

    A leg counts as the circle around its chord, which every model leg lies within; `angle` (n,) in rad.
    """
    if isinstance(intruder, config.Leg):
        half_length = intruder.max_length_cm / 2
        # the tip lies at max_length x (-sin theta, -cos theta) from the axle
        return half_length * np.cos(angle) + half_length + clearance
    _, half_z = half_extent(intruder, float(angle.mean()))
    return np.full(angle.size, half_z + clearance)


def find_zero(
    time: FloatArray,
    force: FloatArray,
    at_rest: np.ndarray,
    stroke_time: float,
    drift_N_per_min: float,
    least_cm: float = 0.0,
) -> Zero:
    """Estimate the zero from the samples `at_rest` in air, at least `least_cm` above the surface.

    Refused if there are fewer of them than half a second holds, at most `MIN_SAMPLES`. `force` (2, n): z, x,
    N; `time` and `stroke_time`, the middle of the stroke, in s. Where the intruder is in air at one end
    of the run only, the zero may have moved by `drift_N_per_min` until the stroke, and nothing in the
    log would show it.
    """
    rest_rows = np.flatnonzero(at_rest)
    fewest = _fewest(time)
    breaks = np.flatnonzero(np.diff(rest_rows) > 1) + 1
    row_groups = [rows for rows in np.split(rest_rows, breaks) if rows.size >= fewest]
    if not row_groups:
        raise Refused("no-zero", least=least_cm)
    rests = [(float(time[rows].mean()), rows) for rows in row_groups]
    if rests[0][0] > stroke_time or rests[-1][0] < stroke_time:
        # a rest cut in two by a gap is one rest still: it shows nothing of the drift to the stroke
        rests = [max(rests, key=lambda rest_in_air: rest_in_air[1].size)]
    (t0, rows_before), (t1, rows_after) = rests[0], rests[-1]
    mean_before, variance, dof = _mean(force[:, rows_before])
    if len(rests) == 1:
        # any drift up to the largest is equally likely
        unseen = (drift_N_per_min / 60 * abs(stroke_time - t0)) ** 2 / 3
        away = time[rows_before] - t0
        trend = force[:, rows_before] @ away / float(away @ away) * (stroke_time - t0)
        return Zero(mean_before[:, None], variance + unseen, dof, math.nan, (trend[0], trend[1]))
    mean_after, last_variance, last_dof = _mean(force[:, rows_after])
    share = np.clip((time - t0) / (t1 - t0), 0, 1)
    line = mean_before[:, None] * (1 - share) + mean_after[:, None] * share
    # the larger of the two: an upper bound for any mix of the two means
    variance = np.maximum(variance, last_variance)
    return Zero(line, variance, min(dof, last_dof), float(np.abs(mean_after - mean_before).max()))


def zero_of_log(force: FloatArray, drift_N_per_min: float, age_min: float) -> Zero:
    """Take the zero of a run from another log, recorded without load.

    `force`: shape (2, n), N. Since then the zero may have drifted, for `age_min` at most.
    """
    if force.shape[1] < _FEWEST:
        raise Refused("short-zero-log", found=force.shape[1], wanted=_FEWEST)
    mean, variance, dof = _mean(force)
    unseen = (drift_N_per_min * age_min) ** 2 / 3
    return Zero(mean[:, None], variance + unseen, dof, math.nan)


def stated_zero(stated: config.Zero, transducer: config.Transducer) -> Zero:
    """The zero that the config states, the same in every run."""
    force = (sensor_to_lab(transducer) @ np.array(stated.readings_N))[::-1]
    variance = np.full(2, (stated.sd_N or 0.0) ** 2)
    return Zero(force[:, None], variance, GIVEN_DOF, math.nan)


def _fewest(time: FloatArray) -> int:
    """Count the samples in half a second of a slow transducer; `MIN_SAMPLES` at 100 Hz and faster."""
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return max(_FEWEST, min(MIN_SAMPLES, round(0.5 / step))) if step > 0 else MIN_SAMPLES


def _mean(force: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    mean = force.mean(axis=1)
    count = force.shape[1]
    variance, dof = weighted_sum_variance(force - mean[:, None], np.ones(count))
    return mean, variance / count**2, dof
