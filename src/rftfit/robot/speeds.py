"""Measured speeds by condition, and how far the simulated ones are from them."""

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

TRIALS = columns_of("robot/tracks.csv")
"""Columns of the table of trials."""

MEASURED = columns_of("robot/measured.csv")
"""Columns of the table of measured speeds."""

ERRORS = columns_of("robot/errors.csv")
"""Columns of the table of errors: from_alpha is what the errors of alpha and of the arc alone leave open,
model is the interval with the model's own error too, lowest and highest those of the starting phases."""

SIGNIFICANT = 6
"""Digits that a condition keeps in every table, so that its measured and simulated rows meet."""

_NEAR_HZ = 0.05


def trial_row(
    trial: tracks.Trial, folder: Path, tripods: int
) -> tuple[dict[str, Any], dict[tuple[str, Remark], int], list[float], list[Remark]]:
    """Row of the table of trials, where the rows of its file went, its mean stride, cm/s, and its flags."""
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
    """Join the trials of each condition: columns `MEASURED`, means over trials and their deviations.

    `calibrated`: Curvature and frequency (Hz) of the conditions that the robot was calibrated on.
    """
    rows = []
    for name, trials_of_condition in trials.groupby("condition", sort=False):
        good, refused = (
            trials_of_condition[trials_of_condition["status"] == "used"],
            trials_of_condition[trials_of_condition["status"] != "used"],
        )
        speed, frequency = good[["speed_cm_per_s", "frequency_Hz"]].to_numpy(float).T
        lost = refused.to_dict("records")
        reason = [
            remark_of_trial
            for row in lost
            for remark_of_trial in attach_run(row["run_id"], reason_of(row))
        ]
        curvature = float(trials_of_condition["curvature_times_R"].iloc[0])
        middle = rounded(float(frequency.mean())) if frequency.size else math.nan
        mean = float(speed.mean()) if speed.size else math.nan
        place = (name, trials_of_condition["medium"].iloc[0], curvature, middle, spread(frequency))
        is_calibrated_and_source = is_calibrated(curvature, middle, calibrated), "marker tracks"
        rows.append(
            (
                *place,
                mean,
                spread(speed),
                len(good),
                *is_calibrated_and_source,
                *reason_cells(reason),
            )
        )
    return pd.DataFrame(rows, columns=MEASURED)


def published_speeds(medium: str, calibrated: Collection[tuple[float, float]] = ()) -> pd.DataFrame:
    """Measured speeds of Fig. 4C, for a campaign without tracks of its own: as `measured_speeds`.

    Standing still is left out. The figure shows means of three trials; their scatter was not read.
    """
    rows = []
    for curvature_times_R, number, frequency, speed in running_speeds():
        name = f"{curvature_times_R:+.2f}_{number}"
        frequency_Hz = rounded(frequency)
        origin = is_calibrated(curvature_times_R, frequency_Hz, calibrated), "Fig. 4C"
        condition = name, medium, curvature_times_R, frequency_Hz, math.nan
        rows.append((*condition, float(speed), math.nan, 3, *origin, *reason_cells([])))
    return pd.DataFrame(rows, columns=MEASURED)


def speed_errors(
    measured: pd.DataFrame, speed: pd.DataFrame, widths: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Compare simulated speeds (`mean_speed`, by profile) with measured ones: columns `ERRORS`.

    Every measured condition is simulated at its own curvature and frequency: nothing is
    interpolated. NaN with a reason where either speed is not known.
    """
    rows = []
    half, half_of_model = (half_widths(widths, quantity) for quantity in (SPEED, SPEED_MODEL))
    for profile, rows_of_profile in speed.groupby("profile", sort=False):
        keys = zip(
            rows_of_profile["curvature_times_R"], rows_of_profile["frequency_Hz"], strict=True
        )
        by_condition: dict[Any, Any] = dict(zip(keys, rows_of_profile.itertuples(), strict=True))
        row: Any
        for row in measured.itertuples():
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
            wide = half.get((profile, *condition), math.nan)
            place = (row.medium, profile, row.condition, *condition)
            head = (*place, row.speed_cm_per_s, row.speed_sd_cm_per_s, row.trials)
            wider = half_of_model.get((profile, *condition), math.nan)
            of_model = simulated_speed - wider, simulated_speed + wider
            simulated = (
                simulated_speed,
                simulated_speed - wide,
                simulated_speed + wide,
                *of_model,
                lo,
                hi,
                error,
            )
            rows.append((*head, *simulated, row.calibrated, *reason_cells(reasons)))
    return pd.DataFrame(rows, columns=ERRORS)


def share_within(errors: pd.DataFrame, percent: float) -> tuple[int, int]:
    """Count conditions of one profile whose simulated speed is close to the measured one, and all.

    One without a simulated speed is not close; one that was not measured is not counted.
    """
    compared = errors[np.isfinite(errors["measured_cm_per_s"].to_numpy(float))]
    off = np.abs(compared["error_percent"].to_numpy(float))
    return int((np.nan_to_num(off, nan=np.inf) <= percent).sum()), len(compared)


def count_within_alpha_error(errors: pd.DataFrame) -> tuple[int, int]:
    """Count measured speeds that lie in what the errors of alpha alone leave open, and those with such ends."""
    return _count_between(errors, "simulated_from_alpha")


def count_within_model_error(errors: pd.DataFrame) -> tuple[int, int]:
    """Count measured speeds that lie in the interval with the model's own error, and those with such ends."""
    return _count_between(errors, "simulated_model")


def _count_between(errors: pd.DataFrame, ends: str) -> tuple[int, int]:
    names = ("measured", f"{ends}_lo", f"{ends}_hi")
    measured, lo, hi = (errors[f"{name}_cm_per_s"].to_numpy(float) for name in names)
    return int(((lo <= measured) & (measured <= hi)).sum()), int(np.isfinite(measured + lo).sum())


def is_calibrated(
    curvature: float, frequency: float, calibrated: Collection[tuple[float, float]]
) -> str:
    """Whether a condition is one of those that the robot was calibrated on: ``yes`` or ``no``."""
    near = (abs(curvature - c) < 1e-6 and abs(frequency - f) < _NEAR_HZ for c, f in calibrated)
    return "yes" if any(near) else "no"


def rounded(value: float) -> float:
    """Round to the digits that tables keep."""
    return float(f"{value:.{SIGNIFICANT}g}")


def spread(values: np.ndarray) -> float:
    """Standard deviation of a few trials; NaN where there are fewer than two."""
    return float(values.std(ddof=1)) if values.size > 1 else math.nan
