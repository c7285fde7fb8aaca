"""Stride frequency and mean speed of a trial, from its marker track."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot.tracks import TrackError

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.robot.tracks import Track

FEWEST_STRIDES = 3
LONGEST_GAP_STRIDES = 0.25
HARMONICS = 4
TRIPODS = 2
"""Legs in two alternating groups: the body bobs twice a stride."""

_FEWEST_ROWS = 30
_FINER = 8
_GAP_STEPS = 3.0
_OUTLIER_SD = 5.0
_LEAST_SHARE = 0.2
_UNEVEN_SHARE = 0.25
_DRIFT_SHARE = 0.15


@dataclass(frozen=True)
class Pace:
    """What a track says.

    Attributes
    ----------
    speed_cm_per_s : float
        Mean forward speed.
    stride_sd_cm_per_s : float
        Standard deviation of the mean speeds of the single strides.
    frequency_Hz : float
        Stride frequency.
    frequency_from : {"sheet", "track"}
    strides : float
        Length of the track in strides.
    flags : tuple of str
        Doubts.
    """

    speed_cm_per_s: float
    stride_sd_cm_per_s: float
    frequency_Hz: float
    frequency_from: str
    strides: float
    flags: tuple[str, ...] = ()


def pace(track: Track, frequency_Hz: float = math.nan, tripods: int = TRIPODS) -> Pace:
    """Mean speed of a trial, over strides.

    The speed is the slope of x against time, fitted together with four harmonics of the stride, so
    that it does not matter at which moments of a stride the track begins and ends.

    Parameters
    ----------
    track : Track
    frequency_Hz : float, optional
        Stride frequency; NaN where it is to be found in the track.
    tripods : int, optional
        Groups of legs that take turns: how often the body bobs in a stride.

    Returns
    -------
    Pace

    Raises
    ------
    TrackError
        If the track is shorter than three strides, has a gap longer than a quarter of a stride, or
        shows no stride frequency; the reason names no file.
    """
    if len(track.time_s) < _FEWEST_ROWS:
        raise TrackError(
            f"{len(track.time_s)} usable rows; a track has at least {_FEWEST_ROWS}",
            rows=track.rows,
        )
    flags = []
    source = "sheet"
    if math.isnan(frequency_Hz):
        frequency_Hz, doubt = stride_frequency(track, tripods)
        source, flags = "track", [doubt] if doubt else []
    time, x = track.time_s, track.x_cm
    strides = float(time[-1] * frequency_Hz)
    if strides < FEWEST_STRIDES - 1e-6:
        raise TrackError(
            f"{strides:.3g} strides of {frequency_Hz:.3g} Hz in {time[-1]:.3g} s; at least "
            f"{FEWEST_STRIDES} are needed for a mean speed",
            rows=track.rows,
        )
    flags += _gaps(track, frequency_Hz)
    speed = _slope(time, x, frequency_Hz)
    whole = int(strides + 1e-6)
    # the last strides: a run-up comes first
    ends = time[-1] - np.arange(whole, -1, -1) / frequency_Hz
    each = np.diff(np.interp(ends, time, x)) * frequency_Hz
    half = whole // 2
    first, last = float(each[:half].mean()), float(each[-half:].mean())
    if abs(last - first) > _DRIFT_SHARE * max(abs(speed), 1.0):
        flags.append(f"speed changes along the track from {first:.3g} to {last:.3g} cm/s")
    return Pace(speed, float(each.std(ddof=1)), float(frequency_Hz), source, strides, tuple(flags))


def stride_frequency(track: Track, tripods: int = TRIPODS) -> tuple[float, str]:
    """Find the stride frequency in the bobbing of the body.

    The highest peak of the periodogram of height (brought to even steps, which bridges small gaps;
    freed of its slow trend and of outliers); of x, likewise, where height shows no clear peak. It is
    refined by least squares with one overtone.

    Parameters
    ----------
    track : Track
    tripods : int, optional
        How often the body bobs in a stride.

    Returns
    -------
    frequency_Hz : float
    doubt : str
        Empty, or why the frequency may be wrong by a factor.

    Raises
    ------
    TrackError
        If neither shows a clear peak.
    """
    time = track.time_s
    duration, step = time[-1], float(np.median(np.diff(time)))
    even = np.arange(0, duration + step / 2, step)
    size = _FINER * even.size
    grid = np.fft.rfftfreq(size, step)
    # at least two bobs in all; at most what the frame rate can show
    seen = (grid >= 2 / duration) & (grid <= 0.45 / step)
    grid = grid[seen]
    for name, values in (("z", track.z_cm), ("x", track.x_cm)):
        if grid.size < 3:
            break
        steady = _detrended(time, values)
        if not steady.any():
            continue
        smooth = np.interp(even, time, steady)
        # share of the variance that a sine of this frequency explains
        power = np.abs(np.fft.rfft(smooth, size))[seen] ** 2
        share = 2 * power / (even.size * (smooth @ smooth))
        top = int(np.argmax(share))
        if share[top] < _LEAST_SHARE:
            continue
        bob = _refine(time, steady, float(grid[top]), 1 / (10 * duration))
        twice = int(np.argmin(np.abs(grid - 2 * bob)))
        doubt = ""
        if tripods > 1 and grid[-1] > 2 * bob and share[twice] > _UNEVEN_SHARE * share[top]:
            doubt = (
                f"{name} moves at {bob:.3g} and {2 * bob:.3g} Hz: if its two halves of a stride "
                f"differ much, the stride frequency is {bob:.3g} and not {bob / tripods:.3g} Hz; "
                "frequency_Hz of the sheet decides"
            )
        return bob / tripods, doubt
    raise TrackError(
        "no stride frequency shows in z or x; give frequency_Hz in the sheet", rows=track.rows
    )


def _detrended(time: FloatArray, values: FloatArray) -> FloatArray:
    """Take off a slow trend, and bring outliers to the edge of the rest."""
    scaled = time / time[-1]
    rest = values - np.polyval(np.polyfit(scaled, values, 2), scaled)
    middle = float(np.median(rest))
    limit = _OUTLIER_SD * 1.4826 * float(np.median(np.abs(rest - middle)))
    clipped: FloatArray = np.clip(rest, middle - limit, middle + limit) if limit > 0 else rest
    again: FloatArray = clipped - np.polyval(np.polyfit(scaled, clipped, 2), scaled)
    # a marker that does not move leaves rounding only
    return again if again.std() > 1e-9 * (1 + np.abs(values).max()) else np.zeros_like(again)


def _refine(time: FloatArray, values: FloatArray, near: float, step: float) -> float:
    from scipy.optimize import minimize_scalar

    def misfit(frequency: float) -> float:
        waves = _waves(time, frequency, 2)
        rest = values - waves @ np.linalg.lstsq(waves, values, rcond=None)[0]
        return float(rest @ rest)

    found = minimize_scalar(misfit, bounds=(near - step, near + step), method="bounded")
    return float(found.x)


def _waves(time: FloatArray, frequency: float, count: int) -> FloatArray:
    angle = 2 * np.pi * frequency * np.outer(time, np.arange(1, count + 1))
    return np.column_stack([np.ones_like(time), np.cos(angle), np.sin(angle)])


def _slope(time: FloatArray, x: FloatArray, frequency: float) -> float:
    parts = np.column_stack([time, _waves(time, frequency, HARMONICS)])
    return float(np.linalg.lstsq(parts, x, rcond=None)[0][0])


def _gaps(track: Track, frequency: float) -> list[str]:
    steps = np.diff(track.time_s)
    gaps = steps[steps > _GAP_STEPS * np.median(steps)]
    if not gaps.size:
        return []
    longest = float(gaps.max())
    text = f"{gaps.size} gap{'s' if gaps.size > 1 else ''}, the longest {longest:.3g} s"
    if longest * frequency > LONGEST_GAP_STRIDES:
        raise TrackError(
            f"{text}, {longest * frequency:.2g} of a stride; allowed: up to "
            f"{LONGEST_GAP_STRIDES:g} of one",
            rows=track.rows,
        )
    return [text]
