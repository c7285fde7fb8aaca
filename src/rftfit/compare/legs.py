"""Predicted beside measured forces on legs: curves over theta, peaks, and their errors (`leg_errors.csv`).

A *curve* is a table of the force on one leg in one medium, a row a pose: ``theta_deg``, the leg angle, with
``force_z_N`` (lift) and ``force_x_N`` (thrust, or drag below 0); a predicted one (`PREDICTED_COLUMNS`) is by one profile
of the medium and also has intervals. A *component* is ``z`` or ``x``. The peak of z is the largest lift, that of x the
largest force of either sign. `model_error` is the relative error of the force model for the intervals; None: the usual
one, or that of the campaign's legs if it is larger.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.config import Arm, Config, Leg
from rftfit.compare.leg_angle import common_offset, offset_of_curve
from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.forces.model_error import has_model_error, larger_model_error, outline_load
from rftfit.forces.motion import Motion, rotation
from rftfit.forces.outlines import Outline, arc_of, leg_outline
from rftfit.forces.peaks import OTHER_FORM, STEEP, STEEP_DEG, Peak
from rftfit.forces.plane import force_draws, forces_on
from rftfit.forces.prediction import predict_with_peaks
from rftfit.measure.alpha import alpha_columns, directions, flagged
from rftfit.measure.errors import shares
from rftfit.measure.flags import (
    REASON,
    Flags,
    Remark,
    reason_columns,
    reason_of,
    remark,
    with_reasons,
)
from rftfit.measure.levels import sd_by_median
from rftfit.measure.slopes import COSINES, GIVEN_DOF, student_quantile
from rftfit.model.draws import (
    end_names,
    errors_behind,
    errors_known,
    model_end_names,
    next_end_names,
    widen,
)
from rftfit.model.profiles import Profile, TableProfile
from rftfit.outputs.dictionary import columns_of
from rftfit.results import Medium
from rftfit.store.chosen import chosen

PREDICTED_COLUMNS = [
    "medium",
    "leg",
    "profile",
    "theta_deg",
    *(
        f"force_{c}{end}_N"
        for c in COMPONENTS
        for end in ("", "_lo", "_hi", "_model_lo", "_model_hi", "_next_lo", "_next_hi")
    ),
    "moment_N_cm",
    *REASON,
]
"""Columns of predicted curves: the force with its interval of alpha, with the model's own error, and of the next bed."""
WITHIN_PERCENT = 33.0
"""Largest error of a peak with the verdict `WITHIN`: the paper states it for all its legs and media."""

WITHIN, OFF, FAR_OFF, NOT_TESTED = "within", "off", "far-off", "not-tested"
"""Verdicts on the model by one peak, the mildest first: `judge`."""

COLUMNS = columns_of("leg_errors.csv")
_CHOSEN = chosen("compare", "legs")

_ZERO_DOF = 2 * COSINES
"""Degrees of freedom of the zeros of a leg's run and of its tare together."""

WITH_MODEL_ERROR = ("table", "map")
"""Profiles whose intervals contain the model's own error, which was measured by them."""

Ends = tuple[float, float]
"""Lower and upper end of an interval."""

FORCES = {"z": "force_z_N", "x": "force_x_N"}
"""Column of the force by component."""


class PeakEnds(NamedTuple):
    """A predicted peak, N: its value, interval of alpha, interval with the model's own error.

    `withheld`: why there is no interval of alpha although the errors of alpha are known.
    """

    value: float
    of_alpha: Ends
    of_model: Ends
    withheld: tuple[Remark, ...] = ()


Peaks = dict[tuple[str, str, str, str], PeakEnds]
"""Predicted peaks by medium, leg, profile and component."""


def leg_prediction(
    profile: Profile, leg: Leg, config: Config, model_error: float | None = None
) -> tuple[pd.DataFrame, dict[str, PeakEnds]]:
    """Predict the force on a turning leg against theta, one row per degree, with the intervals of the profile.

    The intervals include the error of the leg's shape. Returned with the peak of each component, by component: the top
    of the curve and its interval. There is no peak where the profile has no draws, or the curve has holes.
    """
    level = config.fit.confidence
    # moments are not measured
    curves, tops = predict_with_peaks(
        profile,
        leg_outline(leg),
        _rotation_of_leg(leg, config.arm),
        level,
        quantities=[*FORCES.values()],
        model_error=model_error if has_model_error(profile) else None,
    )
    quantile = float(student_quantile(level, GIVEN_DOF))
    force = {c: curves[name].to_numpy(float) for c, name in FORCES.items()}
    # by error, then by component
    changes = shape_errors(profile, leg, config, force)
    # half width of the interval by the leg's shape; a leg that is moved a little may reach cells
    # that are missing
    half_width = {
        c: quantile * np.sqrt(sum(np.nan_to_num(change[c]) ** 2 for change in changes.values()))
        for c in COMPONENTS
    }
    for c, name in FORCES.items():
        for lo, hi in (end_names(name), model_end_names(name), next_end_names(name)):
            if lo in curves:
                ends = curves[lo], curves[hi]
                curves[lo], curves[hi] = widen(force[c], ends, half_width[c])
    if not np.isfinite([*force.values()]).all():
        return curves, {}
    peaks: dict[str, PeakEnds] = {}
    for c in COMPONENTS:
        pose = extreme(force[c], c)
        # of the peaks of x only that of the sign of the larger force counts
        name = "lift" if c == "z" else "thrust" if force[c][pose] > 0 else "drag"
        for top in (peak for peak in tops if peak.name == name):
            of_alpha, of_model = (
                widen(top.value, ends_of_top, half_width[c][pose])
                for ends_of_top in ((top.lo, top.hi), (top.model_lo, top.model_hi))
            )
            peaks[c] = PeakEnds(top.value, of_alpha, of_model, _why_withheld(top))
    return curves, peaks


def error_of_legs(media: Sequence[Medium]) -> float:
    """Return the model's own error on the measured legs of laboratory media; NaN where none was measured.

    The error is measured less predicted force over the load without cancellation (`rftfit.forces.model_error`), root
    mean square over poses with load and both components, by the measured table, or by the map where the table has
    holes. It includes errors of alpha and of the readings.
    """
    relative_errors = [np.zeros(0)]
    for medium in media:
        profile = medium.profile("table", draws=False)
        curves = medium.legs
        if not len(curves):
            continue
        if profile.reason:
            profile = medium.profile("map")
        for name, curve in curves.groupby("leg"):
            config = medium.results.config
            if profile.reason:
                continue
            leg = config.legs[str(name)]
            theta = curve["theta_deg"].to_numpy(float)
            motion = rotation(theta, leg.hip_height_cm, config.arm.leg_speed_rad_per_s)
            outline = leg_outline(leg)
            whole = outline_load(profile, outline, motion.poses, with_centre=False)
            load = whole.interpolate(0, theta.size)
            # N; NaN in the air
            size = np.where(load.loaded > 0, load.size[0], np.nan)
            for c, predicted in _force_on(profile, outline, motion).items():
                relative_errors.append((curve[FORCES[c]].to_numpy(float) - predicted) / size)
    errors = np.concatenate(relative_errors)
    errors = errors[np.isfinite(errors)]
    return float(np.sqrt((errors**2).mean())) if errors.size else math.nan


def _force_on(profile: Profile, outline: Outline, motion: Motion) -> dict[str, FloatArray]:
    """Return the force on a leg in each of the p poses of a motion, N, shape (p,), by component."""
    forces = forces_on(profile, outline, motion.poses)
    return {"z": forces.force_z_N, "x": forces.force_x_N}


def _why_withheld(peak: Peak) -> tuple[Remark, ...]:
    """Say why a peak has no interval of alpha although its errors are known; nothing where it has one."""
    numbers: dict[str, dict[str, Any]] = {
        STEEP: {"percent": 100 * peak.steepness, "degrees": STEEP_DEG},
        OTHER_FORM: {"beside": peak.beside},
    }
    return (remark(peak.withheld, **numbers[peak.withheld]),) if peak.withheld else ()


def _rotation_of_leg(leg: Leg, arm: Arm, hip_cm: float = 0.0) -> Motion:
    """Return the whole rotation of a leg, a pose a degree, with its hip `hip_cm` above the stated height."""
    return rotation(None, leg.hip_height_cm + hip_cm, arm.leg_speed_rad_per_s)


def shape_errors(
    profile: Profile, leg: Leg, config: Config, best: Mapping[str, FloatArray]
) -> dict[str, dict[str, FloatArray]]:
    """Calculate the change of the force against theta, N, by one standard deviation of hip height and of arc.

    `best`: force on the leg as stated, by component. The error of the height includes that of the surface, which is the
    same as for plates. Returned by error, ``hip`` or ``arc``, then by component; 0 for the arc of a leg that is no arc.
    """
    errors, arc = config.errors, arc_of(leg)
    # in cm
    surface = (errors.surface_run_mm or 0.0) / 10, (errors.surface_session_mm or 0.0) / 10
    higher = _rotation_of_leg(leg, config.arm, math.hypot(errors.hip_cm, *surface))
    outline = leg_outline(leg)
    longer = leg_outline(leg, arc_deg=arc * (1 + errors.arc_percent / 100)) if arc else outline
    moved = {
        "hip": _force_on(profile, outline, higher),
        "arc": _force_on(profile, longer, _rotation_of_leg(leg, config.arm)),
    }
    return {error: {c: force[c] - best[c] for c in COMPONENTS} for error, force in moved.items()}


class _LegPeak(NamedTuple):
    """The peak of a component of the force on a leg: the leg, its pose at the peak, and errors of the peak.

    `pose`: row of `Motion.poses`, shape (1, 6). `flagged_percent`: part of the peak from flagged cells. `shape_errors`:
    change of the peak by one standard deviation of each error of the leg's shape, N.
    """

    outline: Outline
    pose: FloatArray
    flagged_percent: float
    shape_errors: dict[str, float]


def errors_of_peaks(medium: Medium) -> dict[tuple[str, str], tuple[str, float]]:
    """Split the peak of each leg by the measured table, by leg and component: what its error is made of.

    Returns the share of each error in the variance of the peak, as text, and the part of the peak, percent, from flagged
    cells. Empty where alpha has no errors, and for a natural sand, which has no table of many directions.
    """
    config, table = medium.results.config, medium.alpha
    if medium.name not in medium.results.laboratory or not errors_known(table):
        return {}
    peaks = _find_leg_peaks(medium, table)

    def forces_at_peaks(alpha: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Forces at all peaks, N, by each of many draws of alpha, shape (peaks, many)."""
        many = TableProfile(*alpha, *directions(table))
        drawn = [
            getattr(force_draws(many, peak.outline, peak.pose), FORCES[c])[:, 0]
            for (_, c), peak in peaks.items()
        ]
        return np.stack(drawn)

    sd_by_error = errors_behind(table, config, forces_at_peaks) if peaks else {}
    peak_errors = {}
    for number, (leg_and_component, peak) in enumerate(peaks.items()):
        sd_of_peak = {error: float(sd[number]) for error, sd in sd_by_error.items()}
        peak_errors[leg_and_component] = (
            shares(sd_of_peak | peak.shape_errors),
            peak.flagged_percent,
        )
    return peak_errors


def _find_leg_peaks(medium: Medium, table: pd.DataFrame) -> dict[tuple[str, str], _LegPeak]:
    """Find the peaks of all legs by the measured table of a medium, by leg and component; none where it has holes."""
    config, profile = medium.results.config, medium.profile("table", draws=False)
    alpha = np.where(flagged(table), 0.0, alpha_columns(table))
    without_flagged = TableProfile(alpha[0], alpha[1], *directions(table))
    peaks: dict[tuple[str, str], _LegPeak] = {}
    for name, leg in config.legs.items():
        outline, motion = leg_outline(leg), _rotation_of_leg(leg, config.arm)
        force = _force_on(profile, outline, motion)
        if not np.isfinite(force["z"]).all():
            continue
        sound_force = _force_on(without_flagged, outline, motion)
        changes = shape_errors(profile, leg, config, force)
        for c in COMPONENTS:
            pose = extreme(force[c], c)
            peaks[name, c] = _LegPeak(
                outline,
                motion.poses[[pose]],
                100 * (1 - float(sound_force[c][pose] / force[c][pose])),
                {error: float(change[c][pose]) for error, change in changes.items()},
            )
    return peaks


def predicted_curves(
    medium: Medium, model_error: float | None = None
) -> tuple[pd.DataFrame, Peaks]:
    """Predict the force on all legs in one medium by every profile of the medium; returns the curves and the peaks.

    A natural sand has the map and the generic profile, and none where its penetration test has no number;
    the penetration table says why. A medium without a nine-term fit has no profile that needs one.
    """
    config, sand = medium.results.config, medium.name in medium.results.sands
    parts = []
    peaks: Peaks = {}
    for kind in medium.kinds:
        if sand and kind == "table":
            continue
        profile = medium.profile(kind)
        if profile.reason and kind not in ("table", "depth_only"):
            continue
        for name, leg in config.legs.items():
            curve, leg_peaks = leg_prediction(profile, leg, config, model_error)
            peaks |= {(medium.name, name, kind, c): peak for c, peak in leg_peaks.items()}
            parts.append(curve.assign(medium=medium.name, leg=name, profile=kind))
    if not parts:
        return pd.DataFrame(columns=PREDICTED_COLUMNS), {}
    # where the table lacks a number, or its errors, no profile made from it has an interval
    curves = pd.concat(parts, ignore_index=True).reindex(columns=PREDICTED_COLUMNS)
    curves["reason_code"] = np.where(curves["reason"] == "", "", "alpha-missing")
    if sand:
        is_noted = (curves["reason_code"] == "") & (curves["profile"] == "generic")
        remarks = medium.results.reference().remarks
        curves = with_reasons(curves, (remarks if noted else () for noted in is_noted))
    return curves, peaks


@dataclass(frozen=True)
class MeasuredPeak:
    """Peak of a curve of force against theta, with its standard error by the scatter of the readings.

    `se_N` is NaN where the curve is too short to show its scatter; the error of the zero is not included.
    """

    force_N: float
    se_N: float
    theta_deg: float


def extreme(force: FloatArray, component: str) -> int:
    """Find the pose, its index in `force`, of the largest lift (``z``), or horizontal force (``x``) of either sign."""
    return int(np.argmax(force if component == "z" else np.abs(force)))


def measured_peak(theta_deg: FloatArray, force_N: FloatArray, component: str) -> MeasuredPeak:
    """Fit a parabola around the highest reading and take its highest point: the reading is too high by its noise.

    Readings are in order, one a degree, shape (n,). Where fewer than 6 lie around the highest one, this is the peak.
    `component`: decides which reading is the highest (`extreme`).
    """
    highest = extreme(force_N, component)
    window = _CHOSEN.smooth
    if force_N.size >= 2 * window:
        # where the curve is highest, not where the noise is
        smooth = np.convolve(force_N, np.full(window, 1 / window), mode="valid")
        highest = extreme(smooth, component) + window // 2
    # angles from the centre of the parabola at which its top is looked for
    fine_deg = np.linspace(-_CHOSEN.half_width_deg, _CHOSEN.half_width_deg, 101)
    for _ in range(2):
        # a second time, around the peak of the first parabola, where this peak lies near its end
        centre_deg = theta_deg[highest]
        is_near = np.abs(theta_deg - centre_deg) <= _CHOSEN.half_width_deg
        if np.count_nonzero(is_near) < _CHOSEN.fewest_readings:
            return MeasuredPeak(float(force_N[highest]), math.nan, float(centre_deg))
        offset_deg = theta_deg[is_near] - centre_deg
        # least squares: coefficients of the parabola by the readings
        coefficients_by_reading = np.linalg.pinv(np.vander(offset_deg, 3))
        inside_deg = fine_deg[(fine_deg >= offset_deg.min()) & (fine_deg <= offset_deg.max())]
        # the parabola at each of these angles is a sum of the readings with these weights
        weights = np.vander(inside_deg, 3) @ coefficients_by_reading
        parabola = weights @ force_N[is_near]
        top = extreme(parabola, component)
        top_deg = inside_deg[top]
        if abs(top_deg) <= _CHOSEN.half_width_deg / 2:
            break
        highest = int(np.argmin(np.abs(theta_deg - centre_deg - top_deg)))
    se = math.sqrt(_long_run_variance(force_N) * float(weights[top] @ weights[top]))
    return MeasuredPeak(float(parabola[top]), se, float(centre_deg + top_deg))


def _long_run_variance(force: FloatArray) -> float:
    """Estimate the variance of readings, N^2, including the correlation of neighbours, from third differences of means.

    NaN for a curve that is too short. A sum of correlated readings has a larger error than of independent ones. Means of three readings are hardly correlated, a leg's curve is smooth over four of them, and the median ignores
    the corners of the curve.
    """
    block = 3
    count = force.size // block
    if count < 2 * _CHOSEN.fewest_readings:
        return math.nan
    # means of neighbouring blocks that do not overlap, from each of the three readings at which the first can start
    means = np.convolve(force, np.full(block, 1 / block), mode="valid")
    third = np.concatenate([np.diff(means[start::block], 3) for start in range(block)])
    # the squares of the weights 1, 3, 3, 1 add up to 20
    return block * float(sd_by_median(third)) ** 2 / 20


_NOTHING: Mapping[Any, Any] = {}
"""Default of parameters of `leg_errors` of which nothing is known: no spread, no peak by draws, no flag."""


def leg_errors(
    measured: pd.DataFrame,
    predicted: pd.DataFrame,
    bed_spread: Mapping[str, float] = _NOTHING,
    confidence: float = 0.95,
    behind: Mapping[tuple[str, str, str], tuple[str, float]] = _NOTHING,
    peaks: Mapping[tuple[str, str, str, str], PeakEnds] = _NOTHING,
    error_by_legs: float = math.nan,
    flags: Mapping[str, Flags] = _NOTHING,
) -> pd.DataFrame:
    """Compare every predicted curve with its measured one, over the theta that both have: the table `leg_errors.csv`.

    A predicted curve without a measured one has a reason instead of numbers, and a curve that stopped
    early near its highest point has no peak. The interval of the peak error includes the errors of alpha,
    of the leg's readings, of their zero and of the parabola through its peak, and the spread of
    beds, because a leg is measured in one bed.

    `measured`, `predicted`: curves of all legs and media, with columns `medium` and `leg`, a predicted one also
    `profile`. `bed_spread`: relative, by medium. `confidence`: level of the intervals. `behind`: from `errors_of_peaks`,
    by medium, leg and component. `peaks`: from `predicted_curves`; without, the highest pose is the peak.
    `error_by_legs`: from `error_of_legs`. `flags`: of the runs, by medium.
    """
    errors_of_model = {
        "model_error": larger_model_error(error_by_legs),
        "model_error_of_legs": error_by_legs,
    }
    keys = ["medium", "leg"]
    curves = dict(iter(measured.groupby(keys)))
    flags_of_curves = {key: _flags_of_leg(curve, flags) for key, curve in curves.items()}
    rows = []
    for (medium, leg, profile), predicted_curve in predicted.groupby([*keys, "profile"], sort=True):
        curve = curves.get((medium, leg))
        both = None
        if curve is not None:
            both = curve.merge(predicted_curve, on="theta_deg", suffixes=("_measured", ""))
        for component in COMPONENTS:
            numbers, why = _compare_component(
                both,
                component,
                bed_spread.get(str(medium), 0.0),
                confidence,
                peaks.get((str(medium), str(leg), str(profile), component)),
            )
            row: dict[str, Any] = {
                "medium": medium,
                "leg": leg,
                "profile": profile,
                "component": component,
            }
            row |= numbers | {"verdict": judge(numbers), "peak_errors": ""}
            if profile in WITH_MODEL_ERROR:
                row |= errors_of_model
            if profile == "table":
                key = (str(medium), str(leg), component)
                row["peak_errors"], row["peak_on_flagged_percent"] = behind.get(key, ("", math.nan))
            reason = reason_columns([*why, *flags_of_curves.get((medium, leg), ())])
            rows.append(row | reason)
    table = pd.DataFrame(rows, columns=COLUMNS)
    return table.assign(**_errors_of_theta(table, curves, predicted))


def _errors_of_theta(
    errors: pd.DataFrame, curves: Mapping[Any, pd.DataFrame], predicted: pd.DataFrame
) -> dict[str, Any]:
    """Return the columns of `errors` on theta: its offset in each curve, by the curve's beginning, and its common error.

    Theta is that of the logs: an error shifts all curves. `errors`: rows of `leg_errors`. `curves`: measured curves by
    medium and leg. `predicted`: curves of all profiles, of which the map's are compared.
    """
    by_map = dict(iter(predicted[predicted["profile"] == "map"].groupby(["medium", "leg"])))
    offsets = {
        key: offset_of_curve(curve, by_map[key]) for key, curve in curves.items() if key in by_map
    }
    error_deg, error_lo_deg, error_hi_deg = common_offset(offsets)
    keys = zip(errors["medium"], errors["leg"], strict=True)
    return {
        "theta_offset_deg": [offsets.get(key, math.nan) for key in keys],
        "theta_error_deg": error_deg,
        "theta_error_lo_deg": error_lo_deg,
        "theta_error_hi_deg": error_hi_deg,
    }


_OF_CURVE = ("no-tare", "no-force-x")
"""Codes of flags that are repeated with each comparison of a curve."""


def _flags_of_leg(curve: pd.DataFrame, flags: Mapping[str, Flags]) -> Iterable[Remark]:
    """Collect the flags of the runs of a measured curve that every comparison with this curve repeats: `_OF_CURVE`.

    `curve`: rows of one leg in one medium, of one run or several. `flags`: by medium.
    """
    flags_of_medium = flags.get(str(curve["medium"].iloc[0]))
    if flags_of_medium is None:
        return ()
    return dict.fromkeys(
        flag
        for run_id in curve["run_id"].unique()
        for flag in flags_of_medium.of_run(run_id)
        if flag.code in _OF_CURVE
    )


def _compare_component(
    both: pd.DataFrame | None,
    component: str,
    bed_spread: float,
    confidence: float,
    peak_by_draws: PeakEnds | None,
) -> tuple[dict[str, float], list[Remark]]:
    """Compare one component of a predicted curve with the measured one; returns columns of `leg_errors` and remarks.

    The remarks say why columns are missing. `both`: predicted and measured rows of the same theta, the measured force
    with the ending ``_measured``; None without a measured curve. `bed_spread`: relative. `peak_by_draws`: peak of the
    whole predicted curve by its draws; None: the highest pose of the curve is the peak.
    """
    if both is None:
        return {}, [remark("not-measured")]
    if both.empty:
        return {}, [remark("no-common-theta")]
    theta, predicted, measured = _curves(both, component)
    row = {"theta_from_deg": float(theta.min()), "theta_to_deg": float(theta.max())}
    if not np.isfinite(predicted).all():
        rows_by_reason = both.drop_duplicates("reason").to_dict("records")
        why = [reason for row_of_pose in rows_by_reason for reason in reason_of(row_of_pose)]
        return row, why or [remark("not-predicted")]
    off = predicted - measured
    rms = float(np.sqrt(np.mean(off**2)))
    squares_about_mean = float(np.sum((measured - measured.mean()) ** 2))
    row["rms_error_N"] = rms
    row["r2"] = 1 - float(off @ off) / squares_about_mean if squares_about_mean else math.nan
    why = []
    if np.ptp(theta) < _CHOSEN.full_range_deg:
        ends = {"first": theta.min(), "last": theta.max()}
        if any(_is_highest_at_end(theta, force, component) for force in (predicted, measured)):
            return row, [remark("short-at-peak", **ends)]
        why = [remark("short-curve", **ends)]
        peak_by_draws = None  # it may lie where nothing was measured
    elif peak_by_draws is not None:
        why = [*peak_by_draws.withheld]
    peak_errors = _peak_errors(both, component, bed_spread, confidence, peak_by_draws)
    peak = abs(peak_errors["peak_measured_N"])
    return row | peak_errors | {"rms_relative_to_peak": rms / peak if peak else math.nan}, why


def _peak_errors(
    both: pd.DataFrame,
    component: str,
    bed_spread: float,
    confidence: float,
    peak_by_draws: PeakEnds | None,
) -> dict[str, float]:
    """Return the columns of `leg_errors` on the peak, and their intervals; parameters as in `_compare_component`."""
    theta, predicted, measured = _curves(both, component)
    pose = extreme(predicted, component)
    predicted_peak, measured_top = float(predicted[pose]), measured_peak(theta, measured, component)
    peak = measured_top.force_N

    at_peak, name = both.iloc[pose], FORCES[component]
    ends, model_ends = (
        (float(at_peak.get(lo, math.nan)), float(at_peak.get(hi, math.nan)))
        for lo, hi in (end_names(name), model_end_names(name))
    )
    zero_se = float(at_peak.get(f"zero_se_{component}_N", 0.0))
    # the prediction has no noise: what the parabola changes there is an error of the measured peak,
    # too
    predicted_top = measured_peak(theta, predicted, component)
    parabola = (predicted_top.force_N / predicted_peak - 1) * peak if predicted_peak else 0.0
    if peak_by_draws is not None:
        predicted_peak, ends, model_ends, _ = peak_by_draws
    se = math.hypot(measured_top.se_N, zero_se, bed_spread * peak, parabola)
    lo, hi = _error_interval(predicted_peak, ends, peak, se, confidence)
    model_lo, model_hi = _error_interval(predicted_peak, model_ends, peak, se, confidence)
    return {
        "peak_measured_N": peak,
        "peak_predicted_N": predicted_peak,
        "peak_predicted_lo_N": ends[0],
        "peak_predicted_hi_N": ends[1],
        "peak_predicted_model_lo_N": model_ends[0],
        "peak_predicted_model_hi_N": model_ends[1],
        "peak_error_percent": 100 * (predicted_peak / peak - 1) if peak else math.nan,
        "peak_error_lo_percent": lo,
        "peak_error_hi_percent": hi,
        "peak_error_model_lo_percent": model_lo,
        "peak_error_model_hi_percent": model_hi,
        "peak_late_deg": predicted_top.theta_deg - measured_top.theta_deg,
    }


def judge(numbers: Mapping[str, float]) -> str:
    """Judge the model by the size of the error of one peak; `numbers`: columns of `leg_errors`.

    The interval of the error tells whether chance explains it.
    """
    error_percent = numbers.get("peak_error_percent", math.nan)
    if not math.isfinite(error_percent):
        return NOT_TESTED
    if abs(error_percent) <= WITHIN_PERCENT:
        return WITHIN
    # a factor of two is far off: no usual margin of safety covers it
    return FAR_OFF if error_percent > 100 or error_percent < -50 else OFF


def worst_peak(errors: pd.DataFrame, medium: str, profile: str) -> dict[Any, Any] | None:
    """Find the row of `leg_errors` with the worst peak of a profile in a medium; None where no leg was measured."""
    is_tested = errors["verdict"] != NOT_TESTED
    tested = errors[is_tested & (errors["medium"] == medium) & (errors["profile"] == profile)]
    # by verdict, then by size
    order = (WITHIN, OFF, FAR_OFF)
    return max(
        tested.to_dict("records"),
        key=lambda row: (order.index(row["verdict"]), abs(row["peak_error_percent"])),
        default=None,
    )


def _curves(both: pd.DataFrame, component: str) -> list[FloatArray]:
    """Return theta, deg, with predicted and measured force, N, each of shape (n,); `both`: as in `_compare_component`."""
    names = ("theta_deg", f"force_{component}_N", f"force_{component}_N_measured")
    return [both[name].to_numpy(float) for name in names]


def _is_highest_at_end(theta: FloatArray, force: FloatArray, component: str) -> bool:
    """Return True if a curve that stopped early is highest near an end, so that the whole curve may be higher."""
    top = theta[extreme(force, component)]
    return bool(min(top - theta.min(), theta.max() - top) <= _CHOSEN.half_width_deg)


def _error_interval(
    predicted: float, ends: Ends, measured: float, se: float, confidence: float
) -> Ends:
    """Return the interval of 100 (predicted / measured - 1), where the errors of both are independent.

    `ends`: interval of `predicted`, N. `se`: standard error of `measured`, N. NaN where either peak is 0.
    """
    if not measured or not predicted:
        return math.nan, math.nan
    ratio = predicted / measured
    # errors of the ratio, relative; the lower end of the ratio has the higher measured peak
    below, above = sorted(end / predicted - 1 for end in ends)
    half_width = float(student_quantile(confidence, _ZERO_DOF)) * abs(se / measured)
    lo, hi = sorted(
        ratio * (1 + sign * math.hypot(end, half_width)) for sign, end in ((-1, below), (1, above))
    )
    return 100 * (lo - 1), 100 * (hi - 1)
