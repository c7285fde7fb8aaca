"""Peaks of predicted forces, and intervals of poses and of peaks from draws of a whole motion.

A body moves through p poses. Its quantities are named as their columns: forces (``force_z_N``, N) and moments
(``moment_N_cm``, N cm) that the medium exerts on the body. The best curve of a quantity, shape (p,), is that by the
profile itself; a draw is the same curve by alpha drawn within its errors. Each quantity has up to three intervals: of
alpha (`lo`, `hi`) and with the force model's own error (`model_lo`, `model_hi`), both of the mean over many beds that
are prepared alike, and of the next bed, one more of these, which is looser or denser as a whole (`next_lo`, `next_hi`).

The value of a peak is everywhere the top of the best curve. A draw has noise in every pose, so that its largest value
lies above the top of the best curve on average. The interval is that of the peaks of the draws, moved by this
difference, so that value and interval are of the same quantity.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.model.draws import interval, widen
from rftfit.store.chosen import chosen

_CHOSEN = chosen("forces", "peaks")

Ends = dict[str, tuple[FloatArray, FloatArray]]
"""Lower and upper end of an interval in each pose, each of shape (p,), by name of the quantity."""

BoundsByName = dict[str, tuple[FloatArray, FloatArray]]
"""In each pose the sum over all parts of a body whose force has a number, and the most that the other parts may add to
its size (0 or more); each of shape (p,), by name of the quantity."""


class PeakTarget(NamedTuple):
    """A peak to find: the largest value of a quantity where `sign` is 1, the least (most negative) where it is -1.

    `name`: of the peak, such as ``lift``. `quantity`: the column in which it is found, such as ``force_z_N``.
    """

    name: str
    quantity: str
    sign: int


@dataclass(frozen=True)
class Peak:
    """Greatest force or moment of one sign, with its intervals (NaN where none is known): made by `find_peaks`.

    Parameters
    ----------
    name : str
        ``lift``, ``suction``, ``thrust``, ``drag``, ``moment`` ...
    quantity : str
        Column of `predict`, such as ``force_z_N``.
    value : float
        Top of the best curve, N or N cm; negative for a peak of the negative sign, such as ``drag``.
    lo, hi : float
        Interval of alpha, of the mean over beds.
    position : float
        theta_deg or t_s of the pose: the first column of the motion.
    model_lo, model_hi : float
        Interval with the model's own error too.
    next_lo, next_hi : float
        Interval of the next bed.
    beside : float
        For a profile of nine terms: the same peak by the table of the same medium, or its map.
    withheld : str
        Why there is no interval of alpha although its errors are known. ``other-form``: the peak `beside` lies outside of
        it; ``steep``: the force changes with the attack angle faster than pushes around can tell.
    steepness : float
        Relative change of the force with 5 degrees of the attack angle; of a mesh all faces are turned alike, about the
        horizontal axis with which the force changes most.

    Examples
    --------
    >>> import rftfit
    >>> lift, *others = rftfit.find_peaks(rftfit.scale(0.35), rftfit.model_leg("reversed_c_leg"))
    >>> lift.withheld
    'steep'
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
    beside: float = math.nan
    withheld: str = ""
    steepness: float = math.nan


OTHER_FORM = "other-form"
"""`Peak.withheld` of a peak by nine terms whose interval of alpha does not contain the peak by the table of the same
medium, or its map: the error of nine terms is then larger than that of alpha."""

STEEP = "steep"
"""`Peak.withheld` of a peak whose force changes with the attack angle faster than pushes on both sides can show."""

STEEP_DEG: float = _CHOSEN.steep_deg
"""Change of the attack angle, degrees, over which the steepness of a peak is taken."""

STEEPEST: float = _CHOSEN.steepest
"""Relative change of a peak with `STEEP_DEG` above which its interval of alpha is withheld."""

NOTICED: float = _CHOSEN.noticed
"""Share of the force on a body above which it is said that this share lies outside of what was measured."""


def unit_of(name: str) -> str:
    """Return the unit of a force or a moment, by the name of its column or of its peak."""
    return "N cm" if name.startswith("moment") else "N"


def pose_of(peak: Peak, curve: FloatArray) -> int:
    """Return the index of the pose of a peak, from the best curve of its quantity, shape (p,)."""
    return int(np.nanargmax(curve if peak.value > 0 else -curve))


def withhold(peak: Peak, code: str) -> Peak:
    """Return a peak without its interval of alpha; `code`: why, `OTHER_FORM` or `STEEP`.

    The interval of the next bed is made from that with the model's own error, which stays valid, or where there is none
    from that of alpha: then it goes, too.
    """
    withheld = replace(peak, lo=math.nan, hi=math.nan, withheld=code)
    if math.isnan(peak.model_lo):
        return replace(withheld, next_lo=math.nan, next_hi=math.nan)
    return withheld


def set_beside(
    peaks: Iterable[Peak], targets: Iterable[PeakTarget], beside: Mapping[str, FloatArray]
) -> list[Peak]:
    """Return peaks by nine terms with their `Peak.beside`, from the curves `beside` by the table or map of the same medium.

    `targets`: those of the peaks, which give their signs. `beside`: shape (p,), by quantity; a gap makes the peak NaN.
    Where `Peak.beside` lies outside of the interval of alpha, this interval is withheld.
    """
    signs = {target.name: target.sign for target in targets}
    compared = []
    for peak in peaks:
        sign = signs[peak.name]
        # a curve that never has this sign has the peak 0; + 0.0 makes 0.0 of -0.0
        top = sign * max(float((sign * beside[peak.quantity]).max()), 0.0) + 0.0
        with_beside = replace(peak, beside=top)
        if math.isfinite(peak.lo) and not peak.lo <= top <= peak.hi:
            with_beside = withhold(with_beside, OTHER_FORM)
        compared.append(with_beside)
    return compared


def keep_true_intervals(ends: Ends, beside: Mapping[str, FloatArray]) -> Ends:
    """Return intervals of alpha by nine terms, NaN in poses where they miss the force by the table or map of the same medium.

    `ends`: the intervals. `beside`: that force, shape (p,), by quantity. Where it is missed, nine terms err by more
    than alpha does.
    """
    kept = {}
    for name, (lo, hi) in ends.items():
        holds = (lo <= beside[name]) & (beside[name] <= hi)
        kept[name] = np.where(holds, lo, np.nan), np.where(holds, hi, np.nan)
    return kept


SAME_SHARE = USUAL_BED_SPREAD
"""Relative difference up to which two peaks are nearly the same: one bed differs from the next by as much."""


def describe_beside(peak: Peak, form: str, form_beside: str) -> str:
    """Say how far a peak by nine terms lies from the same peak by the table or the map; empty without one.

    `form`, `form_beside`: names of the two forms of the profile, as they are printed.
    """
    if math.isnan(peak.beside):
        return ""
    unit = unit_of(peak.quantity)
    numbers = (
        f"{form} {peak.value:.3g} {unit}, {form_beside} of the same medium {peak.beside:.3g} {unit}"
    )
    if math.isfinite(peak.lo):
        return f"{numbers}, within the interval of alpha"
    near = abs(peak.value - peak.beside) <= SAME_SHARE * abs(peak.beside)
    return f"{numbers}, nearly the same" if near else f"{numbers}: no error of alpha explains this"


class DrawStatistics:
    """Intervals by pose, and the peaks of every draw, collected over the poses of a motion, some poses at a time.

    Draws of a whole motion may be too large for memory: `add` takes those of some poses and keeps the intervals of
    these poses and the peak of each draw so far. `quantities`: names of those that get an interval. `targets`: peaks
    that are collected, where their quantity is one of these.
    """

    def __init__(
        self, quantities: Sequence[str], targets: Iterable[PeakTarget], confidence: float
    ) -> None:
        """Begin without a draw; `confidence`: level of the intervals."""
        self.confidence = confidence
        self._targets = [target for target in targets if target.quantity in quantities]
        self._intervals: dict[str, list[FloatArray]] = {name: [] for name in quantities}
        # largest value of each draw so far, times the sign of the peak, by name of the peak
        self._tops: dict[str, FloatArray] = {}

    def add(self, draws: Mapping[str, FloatArray], is_finite: npt.NDArray[np.bool_]) -> None:
        """Add draws of the quantities in the next k poses, shape (draws, k).

        `is_finite`: shape (k,), True for poses whose best forces all have a number. Only these can hold a peak.
        """
        for name, intervals in self._intervals.items():
            intervals.append(np.stack(interval(draws[name], self.confidence)))
        if not is_finite.any():
            return
        for name, quantity, sign in self._targets:
            values = draws[quantity] if is_finite.all() else draws[quantity][:, is_finite]
            top = values.max(axis=1) if sign > 0 else -values.min(axis=1)
            self._tops[name] = np.maximum(self._tops[name], top) if name in self._tops else top

    @property
    def ends(self) -> Ends:
        """Interval of each quantity in all poses that were added."""
        ends = {}
        for name, intervals in self._intervals.items():
            if intervals:
                lo, hi = np.concatenate(intervals, axis=1)
                ends[name] = lo, hi
        return ends

    def peak_ends(self, target: PeakTarget, value: float) -> tuple[float, float] | None:
        """Return the interval of the peak of a target whose best value is `value`.

        None where the quantity has no draws, or a draw has no number in some pose.
        """
        tops = self._tops.get(target.name)
        if tops is None or not np.isfinite(tops).all():
            return None
        # the mean of the draws' tops lies above the best value: see the head of this module
        moved = target.sign * value + tops - tops.mean()
        ends = interval(moved, self.confidence)
        return _cut_at_zero(target.sign, (target.sign * end for end in ends))


def _cut_at_zero(sign: int, ends: Iterable[Any]) -> tuple[float, float]:
    """Cut the interval of a peak of one sign off at 0, as a peak of the other sign is another peak.

    `ends`: two numbers, or arrays with one number each, in either order.
    """
    lo, hi = sorted(sign * float(np.maximum(sign * end, 0.0)) + 0.0 for end in ends)
    return lo, hi


ROUNDING = 1e-5
"""Share of the largest force (N) or moment (N cm) below which a value is no peak: rounding, or the faces of a body whose
halves are cut differently."""


def pick_peaks(
    best: Mapping[str, FloatArray],
    targets: Iterable[PeakTarget],
    positions: FloatArray,
    bounds: BoundsByName,
    *,
    alpha_draws: DrawStatistics | None,
    model_draws: DrawStatistics | None,
    alpha_ends: Ends,
    model_ends: Ends,
    bed_half_width: float,
) -> list[Peak]:
    """Find the peaks of the best curves, with their intervals; a target whose sign no pose has gives no peak.

    `best`: shape (p,), by quantity. `positions`: theta or time of each pose, shape (p,). `bounds`: needed where some
    poses have no number: where a bound there exceeds the peak, the peak may be there and none is stated. `alpha_draws`,
    `model_draws`: draws of alpha, and of alpha with the model's error; None where there are none. `alpha_ends`,
    `model_ends`: intervals by pose, for peaks without draws. `bed_half_width`: half width of the interval of a bed,
    over the force; NaN where the next bed has none.
    """
    peaks = []
    # forces and moments have different units, but one limit for rounding is enough
    largest = max((float(np.nanmax(np.abs(v), initial=0.0)) for v in best.values()), default=0.0)
    for target in targets:
        name, quantity, sign = target
        sizes = sign * best[quantity]
        is_finite = np.isfinite(sizes)
        if not is_finite.any() or not sizes[is_finite].max() > ROUNDING * largest:
            continue
        pose = int(np.nanargmax(sizes))
        if not is_finite.all():
            with_number, most = bounds[quantity]
            largest_there = (sign * with_number + most)[~is_finite]
            if not (largest_there <= sizes[pose]).all():
                continue
        value = float(best[quantity][pose])
        intervals = []
        for draws, ends in ((alpha_draws, alpha_ends), (model_draws, model_ends)):
            of_peak = None if draws is None else draws.peak_ends(target, value)
            if of_peak is None and quantity in ends:
                of_peak = _cut_at_zero(sign, (end[pose] for end in ends[quantity]))
            intervals.append(of_peak or (math.nan, math.nan))
        of_alpha, of_model = intervals
        widest = of_model if math.isfinite(of_model[0]) else of_alpha
        of_bed = _cut_at_zero(sign, widen(value, widest, bed_half_width * value))
        position = float(positions[pose])
        peaks.append(Peak(name, quantity, value, *of_alpha, position, *of_model, *of_bed))
    return peaks


def unknown_peaks(
    best: Mapping[str, FloatArray], targets: Iterable[PeakTarget], peaks: Iterable[Peak]
) -> list[str]:
    """Return the names of peaks that may lie in a pose without a number, and are therefore not stated.

    `best`: shape (p,), NaN in such poses, by quantity. `targets`: all peaks looked for. `peaks`: those that are stated.
    """
    stated = {peak.name for peak in peaks}
    return [
        target.name
        for target in targets
        if target.name not in stated and np.isnan(best[target.quantity]).any()
    ]
