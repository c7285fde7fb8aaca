"""Predicted beside measured forces on legs: curves, peaks and errors over theta."""

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
from rftfit.forces.outlines import arc_of, leg_outline
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
    "force_z_N",
    "force_z_lo_N",
    "force_z_hi_N",
    "force_z_model_lo_N",
    "force_z_model_hi_N",
    "force_z_next_lo_N",
    "force_z_next_hi_N",
    "force_x_N",
    "force_x_lo_N",
    "force_x_hi_N",
    "force_x_model_lo_N",
    "force_x_model_hi_N",
    "force_x_next_lo_N",
    "force_x_next_hi_N",
    "moment_N_cm",
    *REASON,
]
WITHIN_PERCENT = 33.0
"""Largest error of a peak that is within: the paper states it for all its legs and media."""

WITHIN, OFF, FAR_OFF, NOT_TESTED = "within", "off", "far-off", "not-tested"
"""Verdicts on the model, the mildest first."""

COLUMNS = columns_of("leg_errors.csv")
_CHOSEN = chosen("compare", "legs")

_ZERO_DOF = 2 * COSINES
"""Degrees of freedom of the zeros of a leg's run and of its tare together."""


WITH_MODEL_ERROR = ("table", "map")
"""Profiles whose intervals contain the model's own error, which was measured by them."""

Ends = tuple[float, float]


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

    The intervals include the error of the leg's shape. Returned with the peak of each component, where the profile has
    draws: the top of the curve and its interval.
    """
    motion = _rotation_of_leg(leg, config.arm)
    level = config.fit.confidence
    # moments are not measured
    names = {"z": "force_z_N", "x": "force_x_N"}
    forces, tops = predict_with_peaks(
        profile,
        leg_outline(leg),
        motion,
        level,
        quantities=[*names.values()],
        model_error=model_error if has_model_error(profile) else None,
    )
    quantile = float(student_quantile(level, GIVEN_DOF))
    best = {c: forces[name].to_numpy(float) for c, name in names.items()}
    moved = shape_errors(profile, leg, config, best)
    # a leg that is moved a little may reach cells that are missing
    shape = {}
    for c, name in names.items():
        shape[c] = quantile * np.sqrt(
            sum(np.nan_to_num(change[c]) ** 2 for change in moved.values())
        )
        for lo, hi in (end_names(name), model_end_names(name), next_end_names(name)):
            if lo in forces:
                lower, upper = forces[lo].to_numpy(float), forces[hi].to_numpy(float)
                forces[lo], forces[hi] = widen(best[c], (lower, upper), shape[c])
    if not np.isfinite([*best.values()]).all():
        return forces, {}
    peaks: dict[str, PeakEnds] = {}
    for c, force in best.items():
        row = extreme(force, c)
        name = "lift" if c == "z" else "thrust" if force[row] > 0 else "drag"
        for top in (peak for peak in tops if peak.name == name):
            half = shape[c][row]
            of_alpha = widen(top.value, (top.lo, top.hi), half)
            of_model = widen(top.value, (top.model_lo, top.model_hi), half)
            peaks[c] = PeakEnds(
                top.value, _as_floats(of_alpha), _as_floats(of_model), _why_withheld(top)
            )
    return forces, peaks


def error_of_legs(media: Sequence[Medium]) -> float:
    """Return the model's own error on the measured legs of laboratory media; NaN where none was measured.

    The error is measured less predicted force over the load without cancellation, root mean square over poses with
    load, by the measured table, or by the map where the table has holes. It includes errors of alpha and of the
    readings.
    """
    squares = []
    for medium in media:
        table = medium.profile("table", draws=False)
        curves = medium.legs
        if not len(curves):
            continue
        profile = medium.profile("map") if table.reason else table
        for name, curve in curves.groupby("leg"):
            leg = medium.results.config.legs.get(str(name))
            if leg is None or profile.reason:
                continue
            theta = curve["theta_deg"].to_numpy(float)
            motion = rotation(
                theta, leg.hip_height_cm, medium.results.config.arm.leg_speed_rad_per_s
            )
            forces = forces_on(profile, leg_outline(leg), motion.poses)
            whole = outline_load(profile, leg_outline(leg), motion.poses, with_centre=False)
            load = whole.between(0, theta.size)
            size = np.where(load.loaded > 0, load.size[0], np.nan)
            for c, predicted in (("z", forces.force_z_N), ("x", forces.force_x_N)):
                squares.append(((curve[f"force_{c}_N"].to_numpy(float) - predicted) / size) ** 2)
    relative_squares = np.concatenate([np.zeros(0), *squares])
    relative_squares = relative_squares[np.isfinite(relative_squares)]
    return float(np.sqrt(relative_squares.mean())) if relative_squares.size else math.nan


def _why_withheld(peak: Peak) -> tuple[Remark, ...]:
    """Say why a peak has no interval of alpha although its errors are known; nothing where it has one."""
    numbers: dict[str, dict[str, Any]] = {
        STEEP: {"percent": 100 * peak.steepness, "degrees": STEEP_DEG},
        OTHER_FORM: {"beside": peak.beside},
    }
    return (remark(peak.withheld, **numbers[peak.withheld]),) if peak.withheld else ()


def _as_floats(ends: tuple[Any, Any]) -> Ends:
    return float(ends[0]), float(ends[1])


def _rotation_of_leg(leg: Leg, arm: Arm, hip_cm: float = 0.0) -> Motion:
    """Return the rotation of a leg, with its hip `hip_cm` above the stated height."""
    return rotation(None, leg.hip_height_cm + hip_cm, arm.leg_speed_rad_per_s)


def shape_errors(
    profile: Profile, leg: Leg, config: Config, best: Mapping[str, FloatArray]
) -> dict[str, dict[str, FloatArray]]:
    """Calculate the change of the force against theta, N, by one standard deviation of hip height and of arc.

    `best`: force on the leg as stated, by component. The error of the height includes that of the surface, which is the
    same as for plates.
    """
    errors, arc = config.errors, arc_of(leg)
    surface = (errors.surface_run_mm or 0.0, errors.surface_session_mm or 0.0)
    hip_cm = math.hypot(errors.hip_cm, *(error_mm / 10 for error_mm in surface))
    plain, motion = leg_outline(leg), _rotation_of_leg(leg, config.arm)
    longer = leg_outline(leg, arc_deg=arc * (1 + errors.arc_percent / 100)) if arc else plain
    moved = {"hip": (plain, _rotation_of_leg(leg, config.arm, hip_cm)), "arc": (longer, motion)}
    moved_forces = {
        name: forces_on(profile, body, way.poses) for name, (body, way) in moved.items()
    }
    return {
        name: {"z": forces.force_z_N - best["z"], "x": forces.force_x_N - best["x"]}
        for name, forces in moved_forces.items()
    }


def errors_of_peaks(medium: Medium) -> dict[tuple[str, str], tuple[str, float]]:
    """Split the peak of each leg by the measured table, by leg and component.

    Returns the share of each error in the variance of the peak, and the part of the peak, percent, from flagged cells.
    """
    config, table = medium.results.config, medium.alpha
    if medium.name not in medium.results.laboratory or not errors_known(table):
        return {}
    profile = medium.profile("table", draws=False)
    alpha = np.where(flagged(table), 0.0, alpha_columns(table))
    sound = TableProfile(alpha[0], alpha[1], *directions(table))
    legs, flagged_percent = {}, {}
    for name, leg in config.legs.items():
        motion = _rotation_of_leg(leg, config.arm)
        best = forces_on(profile, leg_outline(leg), motion.poses)
        forces = {"z": best.force_z_N, "x": best.force_x_N}
        if not np.isfinite(forces["z"]).all():
            continue
        peak_rows = {c: extreme(force, c) for c, force in forces.items()}
        legs[name] = (
            leg_outline(leg),
            motion.poses,
            peak_rows,
            shape_errors(profile, leg, config, forces),
        )
        without = forces_on(sound, leg_outline(leg), motion.poses)
        for c, sound_force in (("z", without.force_z_N), ("x", without.force_x_N)):
            flagged_percent[name, c] = 100 * (
                1 - float(sound_force[peak_rows[c]] / forces[c][peak_rows[c]])
            )

    def peaks(alpha: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Forces of all legs in the poses of their peaks, by each of many alpha, shape (peaks, many)."""
        many = TableProfile(*alpha, *directions(table))
        drawn = []
        for outline, poses, peak_rows, _ in legs.values():
            forces = force_draws(many, outline, poses[[peak_rows["z"], peak_rows["x"]]])
            drawn += [forces.force_z_N[:, 0], forces.force_x_N[:, 1]]
        return np.stack(drawn)

    behind = errors_behind(table, config, peaks) if legs else {}
    peak_errors = {}
    for place, (name, c) in enumerate((name, c) for name in legs for c in COMPONENTS):
        _, _, peak_rows, moved = legs[name]
        parts = {source: float(sd[place]) for source, sd in behind.items()}
        parts |= {source: float(change[c][peak_rows[c]]) for source, change in moved.items()}
        peak_errors[name, c] = (shares(parts), flagged_percent[name, c])
    return peak_errors


def predicted_curves(
    medium: Medium, model_error: float | None = None
) -> tuple[pd.DataFrame, Peaks]:
    """Predict the force on all legs in one medium by every profile of the medium, and the peaks.

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
    """Find the pose of the largest lift (component ``z``), or horizontal force (``x``) of either sign."""
    return int(np.argmax(force if component == "z" else np.abs(force)))


def measured_peak(theta_deg: FloatArray, force_N: FloatArray, component: str) -> MeasuredPeak:
    """Fit a parabola around the highest reading and take its highest point: the reading is too high by its noise.

    Readings are in order, one a degree. Where fewer than 6 lie around the highest one, this is the peak.
    """
    row = extreme(force_N, component)
    window = _CHOSEN.smooth
    if force_N.size >= 2 * window:
        # where the curve is highest, not where the noise is
        smooth = np.convolve(force_N, np.full(window, 1 / window), mode="valid")
        row = extreme(smooth, component) + window // 2
    fine = np.linspace(-_CHOSEN.half_width_deg, _CHOSEN.half_width_deg, 101)
    for _ in range(2):
        # a second time, around the peak of the first parabola, where this peak lies near its end
        centre = theta_deg[row]
        near = np.abs(theta_deg - centre) <= _CHOSEN.half_width_deg
        if np.count_nonzero(near) < _CHOSEN.fewest_readings:
            return MeasuredPeak(float(force_N[row]), math.nan, float(centre))
        offset = theta_deg[near] - centre
        design = np.vander(offset, 3)
        weights = np.linalg.pinv(design)
        inside = fine[(fine >= offset.min()) & (fine <= offset.max())]
        values = np.vander(inside, 3) @ weights @ force_N[near]
        top = extreme(values, component)
        if abs(inside[top]) <= _CHOSEN.half_width_deg / 2:
            break
        row = int(np.argmin(np.abs(theta_deg - centre - inside[top])))
    share = np.vander(inside[top : top + 1], 3)[0] @ weights
    scatter = _long_run_variance(force_N)
    se = math.sqrt(scatter * float(share @ share))
    return MeasuredPeak(float(values[top]), se, float(centre + inside[top]))


def _long_run_variance(force: FloatArray) -> float:
    """Estimate the variance of readings, including the correlation of neighbours, from third differences of means.

    Means of three readings are hardly correlated, a leg's curve is smooth over four of them, and the median ignores
    the corners of the curve.
    """
    block = 3
    count = force.size // block
    if count < 2 * _CHOSEN.fewest_readings:
        return math.nan
    means = np.convolve(force, np.full(block, 1 / block), mode="valid")
    third = np.concatenate([np.diff(means[start::block], 3) for start in range(block)])
    # the squares of the weights 1, 3, 3, 1 add up to 20
    return block * float(sd_by_median(third)) ** 2 / 20


def leg_errors(
    measured: pd.DataFrame,
    predicted: pd.DataFrame,
    bed_spread: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    behind: Mapping[tuple[str, str, str], tuple[str, float]] | None = None,
    peaks: Peaks | None = None,
    error_by_legs: float = math.nan,
    flags: Mapping[str, Flags] | None = None,
) -> pd.DataFrame:
    """Compare every predicted curve with its measured one, over the theta that both have.

    A predicted curve without a measured one has a reason instead of numbers, and a curve that stopped
    early near its highest point has no peak. The interval of the peak error includes the errors of alpha,
    of the leg's readings, of their zero and of the parabola through its peak, and the spread of
    beds, because a leg is measured in one bed. `bed_spread`, `flags`: by medium. `behind`: from `errors_of_peaks`, by
    medium, leg and component. `peaks`: from `predicted_curves`. `error_by_legs`: from `error_of_legs`.
    """
    errors_of_model = {
        "model_error": larger_model_error(error_by_legs),
        "model_error_of_legs": error_by_legs,
    }
    keys = ["medium", "leg"]
    curves = dict(iter(measured.groupby(keys)))
    flags_of_legs = {place: _flags_of_leg(curve, flags) for place, curve in curves.items()}
    rows = []
    for (medium, leg, profile), predicted_curve in predicted.groupby([*keys, "profile"], sort=True):
        measured_curve = curves.get((medium, leg))
        both = (
            None
            if measured_curve is None
            else measured_curve.merge(predicted_curve, on="theta_deg", suffixes=("_measured", ""))
        )
        spread = (bed_spread or {}).get(str(medium), 0.0)
        for component in COMPONENTS:
            drawn_peak = (peaks or {}).get((str(medium), str(leg), str(profile), component))
            numbers, why = _compare_component(both, component, spread, confidence, drawn_peak)
            reason = reason_columns([*why, *flags_of_legs.get((medium, leg), ())])
            name = {"medium": medium, "leg": leg, "profile": profile, "component": component}
            name["verdict"] = judge(numbers)
            parts = (behind or {}).get((str(medium), str(leg), component)) or ("", math.nan)
            parts = parts if profile == "table" else ("", math.nan)
            of_peak = dict(zip(("peak_errors", "peak_on_flagged_percent"), parts, strict=True))
            of_model = errors_of_model if profile in WITH_MODEL_ERROR else {}
            rows.append(name | numbers | of_model | of_peak | reason)
    table = pd.DataFrame(rows, columns=COLUMNS)
    return table.assign(**_errors_of_theta(table, curves, predicted))


def _errors_of_theta(
    errors: pd.DataFrame, curves: Mapping[Any, pd.DataFrame], predicted: pd.DataFrame
) -> dict[str, Any]:
    """Return the columns on theta: its offset in each curve, by the beginning of the curve, and its common error."""
    maps = dict(iter(predicted[predicted["profile"] == "map"].groupby(["medium", "leg"])))
    offsets = {
        place: offset_of_curve(curve, maps[place])
        for place, curve in curves.items()
        if place in maps
    }
    common = common_offset(offsets)
    places = zip(errors["medium"], errors["leg"], strict=True)
    return {
        "theta_offset_deg": [offsets.get(place, math.nan) for place in places],
        "theta_error_deg": common.offset_deg,
        "theta_error_lo_deg": common.lo_deg,
        "theta_error_hi_deg": common.hi_deg,
    }


def _flags_of_leg(curve: pd.DataFrame, flags: Mapping[str, Flags] | None) -> Iterable[Remark]:
    """Collect the flags of the runs of a measured curve that every comparison with this curve repeats."""
    if flags is None:
        return ()
    of_medium = flags[str(curve["medium"].iloc[0])]
    of_runs = [of_medium.of_run(run_id) for run_id in curve["run_id"].unique()]
    return dict.fromkeys(flag for of_run in of_runs for flag in of_run if flag.code in _OF_CURVE)


_OF_CURVE = ("no-tare", "no-force-x")
"""Codes of flags that are repeated with each comparison of a curve."""


def _compare_component(
    both: pd.DataFrame | None,
    component: str,
    spread: float,
    confidence: float,
    drawn: PeakEnds | None,
) -> tuple[dict[str, float], list[Remark]]:
    """Compare one component of a predicted curve with the measured one; returns columns of `leg_errors` and remarks.

    `both`: predicted and measured rows of the same theta, None without a measured curve. `spread`: of beds, relative.
    `drawn`: peak of the whole predicted curve by its draws.
    """
    if both is None:
        return {}, [remark("not-measured")]
    if both.empty:
        return {}, [remark("no-common-theta")]
    theta, ours, truth = _curves(both, component)
    why: list[Remark] = []
    row = {"theta_from_deg": float(theta.min()), "theta_to_deg": float(theta.max())}
    if not np.isfinite(ours).all():
        lost = both.drop_duplicates("reason").to_dict("records")
        return row, [why for lost_row in lost for why in reason_of(lost_row)] or [
            remark("not-predicted")
        ]
    off = ours - truth
    rms = float(np.sqrt(np.mean(off**2)))
    scatter = float(np.sum((truth - truth.mean()) ** 2))
    row |= {"rms_error_N": rms, "r2": 1 - float(off @ off) / scatter if scatter else math.nan}
    if np.ptp(theta) < _CHOSEN.full_range_deg:
        ends = {"first": theta.min(), "last": theta.max()}
        if _is_highest_at_end(theta, ours, component) or _is_highest_at_end(
            theta, truth, component
        ):
            return row, [remark("short-at-peak", **ends)]
        why = [remark("short-curve", **ends)]
        drawn = None  # its peak may lie where nothing was measured
    elif drawn is not None:
        why = [*drawn.withheld]
    return row | _peak_errors(both, component, rms, spread, confidence, drawn), why


def _peak_errors(
    both: pd.DataFrame,
    component: str,
    rms: float,
    spread: float,
    confidence: float,
    drawn: PeakEnds | None,
) -> dict[str, float]:
    """Return the columns of `leg_errors` on the peak; see `_compare_component`. `rms`: error of the curve, N."""
    theta, ours, truth = _curves(both, component)
    row, measured = extreme(ours, component), measured_peak(theta, truth, component)
    peak, best = measured.force_N, float(ours[row])
    name = f"force_{component}_N"
    ends, model_ends = (
        tuple(float(both[end].iloc[row]) if end in both else math.nan for end in pair)
        for pair in (end_names(name), model_end_names(name))
    )
    zero = (
        float(both[f"zero_se_{component}_N"].iloc[row]) if f"zero_se_{component}_N" in both else 0
    )
    # the prediction has no noise: what the parabola changes there is an error of the measured peak,
    # too
    smooth = measured_peak(theta, ours, component)
    shape = (smooth.force_N / best - 1) * peak if best else 0.0
    if drawn is not None:
        best, ends, model_ends, _ = drawn
    error = math.hypot(measured.se_N, zero, spread * peak, shape)
    lo, hi = _error_interval(best, ends, peak, error, confidence)
    model_lo, model_hi = _error_interval(best, model_ends, peak, error, confidence)
    off, relative = (100 * (best / peak - 1), rms / abs(peak)) if peak else (math.nan, math.nan)
    return {
        "peak_measured_N": peak,
        "peak_predicted_N": best,
        "peak_predicted_lo_N": ends[0],
        "peak_predicted_hi_N": ends[1],
        "peak_predicted_model_lo_N": model_ends[0],
        "peak_predicted_model_hi_N": model_ends[1],
        "peak_error_percent": off,
        "peak_error_lo_percent": lo,
        "peak_error_hi_percent": hi,
        "peak_error_model_lo_percent": model_lo,
        "peak_error_model_hi_percent": model_hi,
        "peak_late_deg": smooth.theta_deg - measured.theta_deg,
        "rms_relative_to_peak": relative,
    }


def judge(numbers: Mapping[str, float]) -> str:
    """Judge the model by the size of the error of one peak; `numbers`: columns of `leg_errors`.

    The interval of the error tells whether chance explains it.
    """
    error = numbers.get("peak_error_percent", math.nan)
    if not math.isfinite(error):
        return NOT_TESTED
    if abs(error) <= WITHIN_PERCENT:
        return WITHIN
    # a factor of two is far off: no usual margin of safety covers it
    return FAR_OFF if error > 100 or error < -50 else OFF


def worst_peak(errors: pd.DataFrame, medium: str, profile: str) -> dict[Any, Any] | None:
    """Find the row of `leg_errors` that decides the verdict on a profile; None where no leg was measured."""
    errors_of_profile = errors[(errors["medium"] == medium) & (errors["profile"] == profile)]
    rows = errors_of_profile[errors_of_profile["verdict"] != NOT_TESTED].to_dict("records")
    order = (WITHIN, OFF, FAR_OFF)
    bad = [(order.index(row["verdict"]), abs(row["peak_error_percent"])) for row in rows]
    return rows[bad.index(max(bad))] if rows else None


def _curves(both: pd.DataFrame, component: str) -> list[FloatArray]:
    """Return theta, deg, with predicted and measured force, N."""
    names = ("theta_deg", f"force_{component}_N", f"force_{component}_N_measured")
    return [both[name].to_numpy(float) for name in names]


def _is_highest_at_end(theta: FloatArray, force: FloatArray, component: str) -> bool:
    """Tell whether a curve that stopped early is highest near an end, so that the whole curve may be higher."""
    top = theta[extreme(force, component)]
    return bool(min(top - theta.min(), theta.max() - top) <= _CHOSEN.half_width_deg)


def _error_interval(
    predicted: float, ends: Sequence[float], peak: float, error: float, confidence: float
) -> tuple[float, float]:
    """Return the interval of 100 (predicted / peak - 1), where the errors of both are independent.

    `ends`: interval of `predicted`, N. `error`: standard error of the measured `peak`, N.
    """
    if not peak or not predicted:
        return math.nan, math.nan
    ratio = predicted / peak
    # errors of the ratio, relative; the lower end of the ratio has the higher measured peak
    below, above = sorted(end / predicted - 1 for end in ends)
    half_width = float(student_quantile(confidence, _ZERO_DOF)) * abs(error / peak)
    lo, hi = (
        ratio * (1 - math.hypot(below, half_width)),
        ratio * (1 + math.hypot(above, half_width)),
    )
    lo, hi = sorted((lo, hi))
    return 100 * (lo - 1), 100 * (hi - 1)
