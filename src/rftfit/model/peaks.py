"""Peaks of predicted forces, and intervals by pose and of peaks from draws of a whole motion.

One definition everywhere: the value of a peak is the top of the best curve. The largest value of a draw, which
has its noise in every pose, lies above it on average; the interval is that of the draws' own peaks, moved by this
difference, so that value and interval are of the same thing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.draws import interval

Ends = dict[str, tuple[FloatArray, FloatArray]]
"""Lower and upper end of an interval of each quantity, by pose."""


class PeakTarget(NamedTuple):
    """A peak that is looked for: the largest value of a quantity, or with sign -1 the least."""

    name: str
    quantity: str
    sign: int


@dataclass(frozen=True)
class Peak:
    """Greatest force of one sign, with its intervals (NaN where none is known), at `position`: theta_deg or t_s.

    `value` is the top of the best curve. `lo`, `hi`: interval of alpha; `model_lo`, `model_hi`: with the model's own error;
    both of the mean over beds. `next_lo`, `next_hi`: of the next bed, with both errors.
    """

    name: str
    quantity: str
    value: float
    lo: float
    hi: float
    position: float
    model_lo: float = math.nan
    model_hi: float = math.nan
    next_lo: float = math.nan
    next_hi: float = math.nan


class DrawStatistics:
    """Intervals by pose, and the peaks of every draw, collected over the parts of a motion.

    `quantities` get an interval; `extremes` are collected of these quantities, over the poses that have a best value.
    """

    def __init__(
        self, quantities: Sequence[str], extremes: Iterable[PeakTarget], confidence: float
    ) -> None:
        self.confidence = confidence
        self._extremes = [extreme for extreme in extremes if extreme.quantity in quantities]
        self._parts: dict[str, list[FloatArray]] = {name: [] for name in quantities}
        self._tops: dict[str, FloatArray] = {}

    def add(self, draws: Mapping[str, FloatArray], is_finite: npt.NDArray[np.bool_]) -> None:
        """Draws of the quantities in the next poses, shape (draws, p); `is_finite`: which poses have a best value."""
        for name, parts in self._parts.items():
            parts.append(np.stack(interval(draws[name], self.confidence)))
        if not is_finite.any():
            return
        for name, quantity, sign in self._extremes:
            of_known = draws[quantity] if is_finite.all() else draws[quantity][:, is_finite]
            top = of_known.max(axis=1) if sign > 0 else -of_known.min(axis=1)
            self._tops[name] = np.maximum(self._tops[name], top) if name in self._tops else top

    @property
    def ends(self) -> Ends:
        """Intervals by pose."""
        intervals = {
            name: np.concatenate(parts, axis=1) for name, parts in self._parts.items() if parts
        }
        return {name: (lo, hi) for name, (lo, hi) in intervals.items()}

    def peak_ends(self, extreme: PeakTarget, value: float) -> tuple[float, float] | None:
        """Interval of a peak whose best value is `value`; None where a draw has no number in some pose."""
        tops = self._tops.get(extreme.name)
        if tops is None or not np.isfinite(tops).all():
            return None
        moved = extreme.sign * value + tops - tops.mean()
        lo, hi = np.maximum(interval(moved, self.confidence), 0.0)
        lo, hi = sorted((extreme.sign * float(lo) + 0.0, extreme.sign * float(hi) + 0.0))
        return lo, hi


_ROUNDING = 1e-9
"""Share of the largest force (N) or moment (N cm) below which a value is rounding and no peak."""


def pick_peaks(
    best: Mapping[str, FloatArray],
    extremes: Iterable[PeakTarget],
    places: FloatArray,
    bounds: Mapping[str, tuple[FloatArray, FloatArray]],
    alpha: DrawStatistics | None,
    model: DrawStatistics | None,
    of_alpha: Ends,
    of_model: Ends,
    bed: float,
) -> list[Peak]:
    """Peaks of the best curves.

    `places`: what tells the poses apart. `bounds`: by pose, the part of a force that has a number and the most that
    the rest may add: where both are more than the peak, the peak may be there and none is stated. `of_alpha`, `of_model`: intervals by pose, for
    peaks without draws. `bed`: half width of the interval of a bed, relative.
    """
    peaks = []
    largest = max((float(np.nanmax(np.abs(v), initial=0.0)) for v in best.values()), default=0.0)
    for extreme in extremes:
        values = extreme.sign * best[extreme.quantity]
        is_finite = np.isfinite(values)
        if not is_finite.any() or not values[is_finite].max() > _ROUNDING * largest:
            continue
        row = int(np.nanargmax(values))
        if not is_finite.all():
            alpha_bounds, most = bounds[extreme.quantity]
            if not ((extreme.sign * alpha_bounds + most)[~is_finite] <= values[row]).all():
                continue
        value = float(best[extreme.quantity][row])
        ends = []
        for spread, by_pose in ((alpha, of_alpha), (model, of_model)):
            of_draws = None if spread is None else spread.peak_ends(extreme, value)
            if of_draws is None and extreme.quantity in by_pose:
                lo, hi = by_pose[extreme.quantity]
                of_draws = float(lo[row]), float(hi[row])
            ends.append(of_draws or (math.nan, math.nan))
        widest = ends[1] if math.isfinite(ends[1][0]) else ends[0]
        of_bed = extreme.sign * np.array(of_next_bed(value, widest, bed))
        # the greatest force of one sign is none of the other one
        lo, hi = sorted(extreme.sign * np.maximum(of_bed, 0.0) + 0.0)
        model_and_bed_ends = *ends[1], float(lo), float(hi)
        peaks.append(
            Peak(
                extreme.name,
                extreme.quantity,
                value,
                *ends[0],
                float(places[row]),
                *model_and_bed_ends,
            )
        )
    return peaks


def of_next_bed(value: Any, ends: tuple[Any, Any], bed: float) -> tuple[Any, Any]:
    """Interval of the force in the next bed, from that of the mean over beds; `bed`: half width, relative.

    A bed is looser or denser as a whole, independently of what is not known of the mean: distances add in squares.
    """
    below, above = (np.hypot(end - value, bed * value) for end in ends)
    return value - below, value + above


def half_width_of_bed(spread: float, confidence: float) -> float:
    """Half the interval of a bed, relative, from the standard deviation between beds."""
    from scipy.special import ndtri

    return float(ndtri(0.5 + confidence / 2)) * spread


def unknown_peaks(
    best: Mapping[str, FloatArray], extremes: Iterable[PeakTarget], peaks: Iterable[Peak]
) -> list[str]:
    """Names of peaks that may lie in a pose without a number, and are therefore not stated."""
    present_names = {peak.name for peak in peaks}
    return [
        extreme.name
        for extreme in extremes
        if extreme.name not in present_names and np.isnan(best[extreme.quantity]).any()
    ]


def joined(
    value: FloatArray,
    first_ends: tuple[FloatArray, FloatArray],
    second_ends: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Interval with two independent errors: the distances of their ends add in squares."""
    below = np.hypot(value - first_ends[0], value - second_ends[0])
    above = np.hypot(first_ends[1] - value, second_ends[1] - value)
    return value - below, value + above
