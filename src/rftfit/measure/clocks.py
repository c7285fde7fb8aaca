"""Two clocks aligned by a sync line, on which the arm starts and stops; the clock of a run as a `ClockFit`.

A force log with a *sync line* (a channel that is 1 while the arm moves) shows the same starts and stops as the motion
log, each on its own clock. `moving_spans` finds them in a log, `align` matches both. A *span* is the start and end of a
stretch of motion, s; k of them have the shape (k, 2). An *edge* is a start or an end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rftfit.conventions import FloatArray, IndexArray
from rftfit.measure.flags import Refused
from rftfit.measure.levels import find_stretches

HOUR_S = 3600.0
LONGEST_RAMP_S = 0.1
"""Longest time in which the arm speeds up or slows down."""


@dataclass(frozen=True)
class ClockFit:
    """Fit of two clocks: motion time = force time + offset + drift x (force time - reference), s.

    By default both logs are on one clock.

    `residual_s`: Root mean square of the edges about the fit.
    `edges`: Number of edges; 0 for logs on one clock, or where the force gave the offset.
    `se_s`, `hours`: Standard error of the offset and whole hours in it, where the force alone gave the offset
    (`measure.alignment`); else None: both follow from the edges and the offset.
    `shared_se_s`: Part of the standard error that all runs of a session have in common, s.
    """

    offset_s: float = 0.0
    drift: float = 0.0
    reference_s: float = 0.0
    residual_s: float = 0.0
    edges: int = 0
    se_s: float | None = None
    hours: int | None = None
    shared_se_s: float = 0.0

    def offset_se(self, step_s: float) -> float:
        """Standard error of the offset, s; 0 for logs on one clock. `step_s`: time between samples of the sync line."""
        if self.se_s is not None:
            return self.se_s
        if self.edges == 0:
            return 0.0
        edge_variance = self.residual_s**2 * self.edges / max(self.edges - 2, 1)
        # an arm that moves for a whole number of samples has all its edges at the same time after a
        # sample: the residuals do not show this error, which has the variance step^2 / 12
        common_variance = max(step_s**2 / 12 - edge_variance, 0.0)
        return math.sqrt(common_variance + edge_variance / self.edges)

    @property
    def whole_hours(self) -> int:
        """Whole hours in the offset: a time zone or daylight saving, when not zero."""
        return round(self.offset_s / HOUR_S) if self.hours is None else self.hours

    def motion_time(self, force_time: FloatArray) -> FloatArray:
        """Turn times of the force log into times of the motion log, s."""
        return force_time + self.offset_s + self.drift * (force_time - self.reference_s)


_MOVING = 0.5
"""Speed above which the arm moves, relative to the stated one; a sync line has 0 and 1."""
_JITTER_S = 0.1
"""Longest motion or rest that counts as jitter, s."""


def moving_spans(time: FloatArray, speed: FloatArray) -> FloatArray:
    """Start and end of every stretch in which the arm moves, s, shape (k, 2).

    An edge is where `speed` crosses `_MOVING`, interpolated between samples; stretches of less than 0.1 s are jitter
    and left out, and so are rests: an arm that changes its direction without a pause does not stop.

    `time`: s, shape (n,). `speed`: Speed relative to the stated one, or a sync line, shape (n,).
    """
    first, stop = find_stretches(speed > _MOVING)
    starts = _interpolate_crossing(time, speed, first - 1, first)
    ends = _interpolate_crossing(time, speed, stop - 1, stop)
    # a stretch ends at its stop if a rest follows, and the next one starts behind that rest
    is_rest = starts[1:] - ends[:-1] > _JITTER_S
    starts = starts[np.append(True, is_rest)[: starts.size]]
    ends = ends[np.append(is_rest, True)[: ends.size]]
    spans: FloatArray = np.array([starts, ends]).T
    return np.asarray(spans[ends - starts > _JITTER_S])


def is_encoder_noise(time: FloatArray, speed: FloatArray) -> bool:
    """Return True if most stretches of motion are so short that they are the noise of an encoder.

    `time`, `speed`: see `moving_spans`. The speed must then be taken over a longer time.
    """
    first, stop = find_stretches(speed > _MOVING)
    short = time[stop - 1] - time[first] < _JITTER_S
    return bool(short.size and short.mean() > 0.5)


def whole_spans(spans: FloatArray, first: float, last: float) -> FloatArray:
    """Leave out stretches whose start or end lies outside a log, which goes from `first` to `last`, s.

    The arm was already moving when such a log began, or still when it ended.
    """
    return spans[(spans[:, 0] > first) & (spans[:, 1] < last)]


def _interpolate_crossing(
    time: FloatArray, speed: FloatArray, before: IndexArray, after: IndexArray
) -> FloatArray:
    """Times between two neighbouring samples at which the speed passes `_MOVING`, s, shape (k,).

    `before`, `after`: Rows of the samples on both sides, shape (k,); -1 or n beyond the ends of the log.
    """
    low, high = np.maximum(before, 0), np.minimum(after, time.size - 1)
    rise = speed[high] - speed[low]
    # at either end of the log there is no neighbour: the log's first or last sample is the edge
    rise[rise == 0] = np.inf
    share = np.minimum(np.maximum((_MOVING - speed[low]) / rise, 0), 1)
    return np.asarray(time[low] + share * (time[high] - time[low]))


def align(force_spans: FloatArray, motion_spans: FloatArray, max_residual_s: float) -> ClockFit:
    """Find offset and drift between two clocks from the spans (k, 2) in which the arm moved, s.

    The two logs see a start or an end at slightly different speeds of the arm; because each stretch has a start and an
    end, this cancels in the offset. A log that was cut short may lack stretches at either end: every shift of the
    shorter list along the longer one is tried, and only one may fit.

    `max_residual_s`: Largest root mean square of the edges about a fit; else the logs are not of one run.
    """
    short, long = sorted((force_spans, motion_spans), key=len)
    if len(short) == 0:
        raise Refused("nothing-to-match", force=len(force_spans), motion=len(motion_spans))
    fits = []
    for shift in range(len(long) - len(short) + 1):
        window = long[shift : shift + len(short)]
        pair = (short, window) if short is force_spans else (window, short)
        fits.append(_fit_edges(pair[0].ravel(), pair[1].ravel()))
    fits.sort(key=lambda fit: fit.residual_s)
    if fits[0].residual_s > max_residual_s:
        raise Refused("clocks-disagree", seconds=fits[0].residual_s, most=max_residual_s)
    if len(fits) > 1 and fits[1].residual_s <= max_residual_s:
        raise Refused("clocks-ambiguous")
    return fits[0]


def _fit_edges(force_edges: FloatArray, motion_edges: FloatArray) -> ClockFit:
    """Fit offset and drift to the times of the same edges on both clocks, s, shape (2 k,): starts and ends in turn."""
    difference = motion_edges - force_edges
    offset = float(difference.mean())
    reference = float(force_edges.mean())
    # rates differ by some 1e-5: over a run of seconds that is far below the error of an edge, so a
    # drift is fitted only to a run of more than ten minutes
    lever = force_edges - reference
    drift = 0.0
    if np.ptp(force_edges) > 600:
        drift = float(lever @ difference / (lever @ lever))
    residual = difference - offset - drift * lever
    # a ramp shifts starts and ends by the same time in opposite directions: that is no disagreement
    edge_pairs = residual.reshape(-1, 2)
    ramp = float((edge_pairs[:, 0] - edge_pairs[:, 1]).mean()) / 2
    if abs(ramp) < LONGEST_RAMP_S:
        residual = (edge_pairs - [ramp, -ramp]).ravel()
    residual_s = float(np.sqrt(np.mean(residual**2)))
    return ClockFit(offset, drift, reference, residual_s, force_edges.size)
