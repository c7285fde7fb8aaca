"""Measured speeds of the robot by condition, and the differences of simulated speeds from them.

A trial is one run of the real robot, filmed: its marker track gives a speed (`trial_row`). Trials with the same leg
curvature R'/r and nominal stride frequency are a condition (`measured_speeds`; the paper's by `published_speeds`). The
robot is simulated at each condition, and both speeds are set beside each other (`speed_errors`). Unknown lengths of the
paper's robot were fitted to a few conditions: these are marked as ``calibrated``, since agreement there proves nothing.

A `Remark` is a reason or a doubt: a code with numbers, which becomes a sentence. In tables it has two columns,
``reason`` (words) and ``reason_code``: `reason_cells` and `reason_columns` write them, `reason_of` reads them.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.errors import RftfitError
from rftfit.measure.flags import Remark, attach_run, reason_cells, reason_columns, reason_of, remark
from rftfit.measure.ledger import DROPPED, USED
from rftfit.outputs.dictionary import columns_of
from rftfit.reference import running_speeds
from rftfit.robot import tracks
from rftfit.robot.intervals import SPEED, SPEED_MODEL, half_widths
from rftfit.robot.run import spread
from rftfit.robot.sweep import is_at_condition

TRIALS = columns_of("robot/tracks.csv")
"""Columns of the table of trials: names of run, condition and medium, curvature and frequency, ``speed_cm_per_s``,
numbers of strides and rows, and ``status``: "used", or "refused" with a reason."""

MEASURED = columns_of("robot/measured.csv")
"""Columns of the table of measured speeds, a row for each condition: name, medium, curvature, mean frequency and its
standard deviation over trials, the same of the speed, number of trials used, ``calibrated`` (yes or no), source,
reason."""

ERRORS = columns_of("robot/errors.csv")
"""Columns of the table of errors, a row for each condition on each profile: measured and simulated speed (cm/s), and
``error_percent``. Intervals: ``from_alpha`` by the errors of alpha and of the arc, ``model`` with the error of the
force model too, ``lowest`` and ``highest`` over the starting phases."""


def trial_row(
    trial: tracks.Trial, folder: Path, tripods: int
) -> tuple[dict[str, Any], dict[tuple[str, Remark], int], list[float], list[Remark]]:
    """Measure the speed of a trial from its marker track, and account for every row of the track's file.

    `folder`: folder of the robot's run sheet, to which the path of the track is relative. `tripods`: groups of legs
    that alternate. Returns four things: the row of the table of trials as a dict; the counts of the rows of the file by
    use (`USED` or `DROPPED`) and reason, for the ledger; the forward velocity over the mean stride (cm/s, a number for
    each of `tracks.STRIDE_SAMPLES` moments); and the flags. A track that cannot be used gives a row with the status
    "refused" and a reason, and no velocities.
    """
    names = ("run_id", "condition", "medium", "curvature_times_R", "frequency_Hz")
    row = {name: getattr(trial, name) for name in names}
    counts: dict[tuple[str, Remark], int] = {}
    rows = 0
    try:
        track = tracks.read_track(folder / trial.track)
        rows = track.rows
        counts = {(DROPPED, why): count for why, count in track.dropped.items()}
        stride_speeds = tracks.mean_stride_speed(track, trial.frequency_Hz, tripods)
    except tracks.TrackError as error:
        # rows that were read, else as many as the error counted; all that were not dropped already fall to its reason
        rows = rows or error.rows
        counts[DROPPED, error.reason] = rows - sum(counts.values())
        row |= {"strides": 0, "rows": rows, "rows_used": 0, "status": "refused"}
        return row | reason_columns([error.reason]), counts, [], []
    used = len(track.time_s)
    counts[USED, remark("mean-speed")] = used
    if sum(counts.values()) != rows:
        raise RftfitError(
            f"the rows of {trial.track} do not add up: {sum(counts.values())} counted, {rows} in "
            "the file: this is a fault of the program, please report it"
        )
    names = ("frequency_Hz", "frequency_from", "speed_cm_per_s", "stride_sd_cm_per_s", "strides")
    row |= {name: getattr(stride_speeds, name) for name in names}
    row |= {"rows": rows, "rows_used": used, "status": "used"}
    flags = attach_run(trial.run_id, stride_speeds.flags)
    return row, counts, stride_speeds.velocity_cm_per_s.tolist(), flags


def measured_speeds(
    trials: pd.DataFrame, calibrated: Collection[tuple[float, float]] = ()
) -> pd.DataFrame:
    """Return means and standard deviations over the used trials of each condition, with the columns `MEASURED`.

    `trials`: table with the columns `TRIALS`. `calibrated`: curvature and frequency (Hz) of the conditions on which the
    robot was calibrated. Refused trials give their reasons; with none used the mean is NaN.
    """
    rows = []
    for name, trials_of_condition in trials.groupby("condition", sort=False):
        is_used = trials_of_condition["status"] == "used"
        good, refused = trials_of_condition[is_used], trials_of_condition[~is_used]
        speed, frequency = good[["speed_cm_per_s", "frequency_Hz"]].to_numpy(float).T
        reason = [
            remark_of_trial
            for row in refused.to_dict("records")
            for remark_of_trial in attach_run(row["run_id"], reason_of(row))
        ]
        curvature = float(trials_of_condition["curvature_times_R"].iloc[0])
        mean_frequency = rounded(float(frequency.mean())) if frequency.size else math.nan
        mean = float(speed.mean()) if speed.size else math.nan
        head = (
            name,
            trials_of_condition["medium"].iloc[0],
            curvature,
            mean_frequency,
            spread(frequency),
        )
        is_calibrated = is_at_condition(calibrated, curvature, mean_frequency)
        origin = "yes" if is_calibrated else "no", "marker tracks"
        rows.append((*head, mean, spread(speed), len(good), *origin, *reason_cells(reason)))
    return pd.DataFrame(rows, columns=MEASURED)


def published_speeds(medium: str, calibrated: Collection[tuple[float, float]] = ()) -> pd.DataFrame:
    """Return the measured speeds of Fig. 4C in the form of `measured_speeds`, for a campaign without tracks.

    The robot standing still is left out. The figure shows means of three trials; their scatter was not read. `medium`:
    name of the campaign's medium, which stands in the table; the speeds are on the paper's poppy seeds.
    """
    rows = []
    for curvature_times_R, number, frequency, speed in running_speeds():
        name = f"{curvature_times_R:+.2f}_{number}"
        frequency_Hz = rounded(frequency)
        is_calibrated = is_at_condition(calibrated, curvature_times_R, frequency_Hz)
        origin = "yes" if is_calibrated else "no", "Fig. 4C"
        condition = name, medium, curvature_times_R, frequency_Hz, math.nan
        rows.append((*condition, float(speed), math.nan, 3, *origin, *reason_cells([])))
    return pd.DataFrame(rows, columns=MEASURED)


def speed_errors(
    measured: pd.DataFrame, speed: pd.DataFrame, widths: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Compare simulated speeds with measured ones: a row for each profile and measured condition, columns `ERRORS`.

    `measured`: columns `MEASURED`. `speed`: of each profile the table of `rftfit.robot.sweep.mean_speed`, with a column
    ``profile``. `widths`: half widths of the intervals (`rftfit.robot.intervals`); None: no intervals. Every measured
    condition was simulated at exactly its curvature and frequency: nothing is interpolated. The error is 100 % times
    (simulated / measured - 1), NaN with a reason if one of both speeds is not known or the measured one is not
    positive.
    """
    rows = []
    # half width (cm/s) by (profile, curvature, frequency)
    half, half_of_model = (half_widths(widths, quantity) for quantity in (SPEED, SPEED_MODEL))
    for profile, rows_of_profile in speed.groupby("profile", sort=False):
        keys = zip(
            rows_of_profile["curvature_times_R"], rows_of_profile["frequency_Hz"], strict=True
        )
        by_condition: dict[Any, Any] = dict(zip(keys, rows_of_profile.itertuples(), strict=True))
        row: Any
        for row in measured.itertuples():
            # the row of the simulated speed; `lo`, `hi`: its least and greatest value over the starting phases
            run = by_condition.get((row.curvature_times_R, row.frequency_Hz))
            lo = hi = simulated_speed = math.nan
            reasons: list[Remark] = []
            if math.isnan(row.speed_cm_per_s):
                reasons = [remark("speed-unmeasured", why=next(iter(reason_of(row._asdict())), ""))]
            if run is not None:
                simulated_speed, lo, hi = (
                    run.speed_cm_per_s,
                    run.speed_lo_cm_per_s,
                    run.speed_hi_cm_per_s,
                )
                reasons += reason_of(run._asdict()) if math.isnan(simulated_speed) else ()
            elif not reasons:
                reasons.append(remark("not-simulated"))
            error = math.nan
            if row.speed_cm_per_s > 0 and not math.isnan(simulated_speed):
                error = 100 * (simulated_speed / row.speed_cm_per_s - 1)
            elif not reasons:
                reasons.append(remark("speed-not-positive"))
            condition = (row.curvature_times_R, row.frequency_Hz)
            # lower and upper end by the errors of alpha, then both with the error of the force model too
            intervals = [
                simulated_speed + sign * half_widths_by_key.get((profile, *condition), math.nan)
                for half_widths_by_key in (half, half_of_model)
                for sign in (-1, 1)
            ]
            names = (row.medium, profile, row.condition, *condition)
            measured_cells = (row.speed_cm_per_s, row.speed_sd_cm_per_s, row.trials)
            simulated_cells = (simulated_speed, *intervals, lo, hi, error, row.calibrated)
            rows.append((*names, *measured_cells, *simulated_cells, *reason_cells(reasons)))
    return pd.DataFrame(rows, columns=ERRORS)


def share_within(errors: pd.DataFrame, percent: float) -> tuple[int, int]:
    """Count the conditions whose simulated speed is within `percent` of the measured one, and all measured conditions.

    `errors`: rows of `speed_errors` on one profile. A condition without a simulated speed counts as not within; one
    that was not measured is not counted.
    """
    compared = errors[np.isfinite(errors["measured_cm_per_s"].to_numpy(float))]
    # NaN, no simulated speed, counts as infinitely far off
    off = np.abs(compared["error_percent"].to_numpy(float))
    return int((np.nan_to_num(off, nan=np.inf) <= percent).sum()), len(compared)


def count_inside(errors: pd.DataFrame, interval: str) -> tuple[int, int]:
    """Count the measured speeds inside an interval of the simulated speed, and all that have this interval.

    `interval`: columns of its ends without ``_lo_cm_per_s``: ``simulated_from_alpha`` by the errors of alpha and of the
    arc, ``simulated_model`` with the error of the force model too.
    """
    names = ("measured", f"{interval}_lo", f"{interval}_hi")
    measured, lo, hi = (errors[f"{name}_cm_per_s"].to_numpy(float) for name in names)
    # a comparison with NaN is False; a sum with NaN is NaN
    return int(((lo <= measured) & (measured <= hi)).sum()), int(np.isfinite(measured + lo).sum())


def rounded(value: float) -> float:
    """Round to the digits of a condition in every table, so that its measured and simulated rows have equal keys."""
    return float(f"{value:.6g}")
