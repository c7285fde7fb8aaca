"""Predicted beside measured forces on legs: curves, peaks and errors over theta."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.config import Arm, Config, Leg
from rftfit.conventions import FloatArray
from rftfit.measure.alpha import alpha_columns, cell_at, column, directions, flagged
from rftfit.measure.errors import shares
from rftfit.measure.flags import (
    REASON,
    Remark,
    flags_of,
    reason_columns,
    reason_of,
    remark,
    with_reasons,
)
from rftfit.measure.slopes import GIVEN_DOF, student_quantile
from rftfit.model.draws import errors_behind, errors_known, interval
from rftfit.model.forces import force_draws, forces_on
from rftfit.model.motion import Motion, rotation
from rftfit.model.outlines import arc_of, leg_outline
from rftfit.model.prediction import peaks_of_draws, predict
from rftfit.model.profiles import Profile, TableProfile
from rftfit.results import Medium

PREDICTED_COLUMNS = [
    "medium", "leg", "profile", "theta_deg", "force_z_N", "force_z_lo_N", "force_z_hi_N",
    "force_x_N", "force_x_lo_N", "force_x_hi_N", "moment_N_cm", *REASON,
]  # fmt: skip
COMPONENTS = ("z", "x")
WITHIN_PERCENT = 33.0
"""What the paper states of the peaks of all its legs and media."""
TOO_HIGH_PERCENT, TOO_LOW_PERCENT = 100.0, -50.0
"""A factor of two: no usual margin of safety covers it."""

WITHIN, OFF, FAR_OFF, NOT_TESTED = "within", "off", "far-off", "not-tested"
"""Verdicts on the model, the mildest first."""

NUMBERS = ("peak_measured_N", "peak_predicted_N", "peak_predicted_lo_N", "peak_predicted_hi_N",
           "peak_error_percent", "peak_error_lo_percent", "peak_error_hi_percent", "peak_late_deg",
           "rms_error_N", "rms_relative_to_peak", "r2", "theta_from_deg", "theta_to_deg")  # fmt: skip
COLUMNS = ["medium", "leg", "profile", "component", "verdict", *NUMBERS, "peak_errors", "peak_on_flagged_percent",
           *REASON]  # fmt: skip
FULL_RANGE_DEG = 240.0
"""The published curves span 250 to 260 degrees: a shorter one stopped early."""

_ZERO_DOF = 24
"""Of the zeros of a leg's run and of its tare, twelve each (`rftfit.measure.slopes.COSINES`)."""

HALF_WIDTH_DEG = 5.0
"""Of the parabola: the published curves are one within 0.5 % of their peaks."""

_SMOOTH = 7
_BLOCK = 3
_LEAST = 6


Peaks = dict[tuple[str, str, str, str], tuple[float, float, float]]
"""Value, lower and upper end of a predicted peak, N, by medium, leg, profile and component."""


def leg_prediction(
    profile: Profile, leg: Leg, config: Config
) -> tuple[pd.DataFrame, dict[str, tuple[float, float, float]]]:
    """Force on a turning leg against theta, one row per degree, with the intervals of the profile.

    What the leg's own shape may be off by is in the intervals, where the profile has any. Returns also
    the peak by component, where the profile has draws: mean and interval of the draws' own peaks.
    """
    motion = _turned(leg, config.arm)
    level = config.fit.confidence
    # of the moment nothing is measured
    names = {"z": "force_z_N", "x": "force_x_N"}
    forces = predict(profile, leg_outline(leg), motion, level, quantities=[*names.values()])
    if "force_z_lo_N" not in forces:
        return forces, {}
    wide = float(student_quantile(level, GIVEN_DOF))
    best = {c: forces[name].to_numpy(float) for c, name in names.items()}
    moved = shape_errors(profile, leg, config, best)
    # a leg that is moved a little may reach cells that are missing
    shape = {}
    for c, name in names.items():
        shape[c] = wide * np.sqrt(sum(np.nan_to_num(part[c]) ** 2 for part in moved.values()))
        lo, hi = (f"force_{c}_{end}_N" for end in ("lo", "hi"))
        forces[lo], forces[hi] = _wider(forces[name], forces[lo], forces[hi], shape[c])
    if not isinstance(profile.spread, Profile) or not np.isfinite([*best.values()]).all():
        return forces, {}
    drawn = peaks_of_draws(profile.spread, leg_outline(leg), motion.poses)
    peaks = {}
    for c, force in best.items():
        at = extreme(force, c)
        own = drawn["lift" if c == "z" else "thrust" if force[at] > 0 else "drag"]
        if not np.isfinite(own).all():
            continue
        value = float(own.mean())
        below, above = _wider(value, *interval(own, level), shape[c][at])
        peaks[c] = value, float(below), float(above)
    return forces, peaks


def _wider(value: Any, lo: Any, hi: Any, half: Any) -> tuple[Any, Any]:
    """An interval with one more independent error of this half width."""
    return value - np.hypot(value - lo, half), value + np.hypot(hi - value, half)


def _turned(leg: Leg, arm: Arm, hip_cm: float = 0.0) -> Motion:
    return rotation(None, leg.hip_height_cm + hip_cm, arm.leg_speed_rad_per_s)


def shape_errors(
    profile: Profile, leg: Leg, config: Config, best: Mapping[str, FloatArray]
) -> dict[str, dict[str, FloatArray]]:
    """Change of the force against theta, N, by one standard deviation of hip height and arc.

    `best`: By component, the force on the leg as stated. The surface that the axle stands above is as
    well known as that of the plates, where that is stated.
    """
    errors, arc = config.errors, arc_of(leg)
    surface = (errors.surface_run_mm or 0.0, errors.surface_session_mm or 0.0)
    hip_cm = math.hypot(errors.hip_cm, *(one / 10 for one in surface))
    plain, motion = leg_outline(leg), _turned(leg, config.arm)
    longer = leg_outline(leg, arc_deg=arc * (1 + errors.arc_percent / 100)) if arc else plain
    moved = {"hip": (plain, _turned(leg, config.arm, hip_cm)), "arc": (longer, motion)}
    found = {name: forces_on(profile, body, way.poses) for name, (body, way) in moved.items()}
    return {
        name: {"z": one.force_z_N - best["z"], "x": one.force_x_N - best["x"]}
        for name, one in found.items()
    }


def errors_of_peaks(medium: Medium) -> dict[tuple[str, str], tuple[str, float]]:
    """What a leg's peak by the measured table rests on, by leg and component.

    Share of each error in its variance, and part of it, percent, that comes from flagged cells.
    """
    config, table = medium.results.config, medium.alpha
    if medium.name not in medium.results.laboratory or not errors_known(table):
        return {}
    profile = medium.profile("table", draws=False)
    alpha = np.where(flagged(table), 0.0, alpha_columns(table))
    sound = TableProfile(alpha[0], alpha[1], *directions(table))
    shown, rests = {}, {}
    for name, leg in config.legs.items():
        motion = _turned(leg, config.arm)
        best = forces_on(profile, leg_outline(leg), motion.poses)
        forces = {"z": best.force_z_N, "x": best.force_x_N}
        if not np.isfinite(forces["z"]).all():
            continue
        at = {c: extreme(force, c) for c, force in forces.items()}
        shown[name] = leg_outline(leg), motion.poses, at, shape_errors(profile, leg, config, forces)
        without = forces_on(sound, leg_outline(leg), motion.poses)
        for c, left in (("z", without.force_z_N), ("x", without.force_x_N)):
            rests[name, c] = 100 * (1 - float(left[at[c]] / forces[c][at[c]]))

    def peaks(alpha: tuple[FloatArray, FloatArray]) -> FloatArray:
        many = TableProfile(*alpha, *directions(table))
        drawn = []
        for outline, poses, at, _ in shown.values():
            forces = force_draws(many, outline, poses[[at["z"], at["x"]]])
            drawn += [forces.force_z_N[:, 0], forces.force_x_N[:, 1]]
        return np.stack(drawn)

    behind = errors_behind(table, config, peaks) if shown else {}
    found = {}
    for place, (name, c) in enumerate((name, c) for name in shown for c in COMPONENTS):
        _, _, at, moved = shown[name]
        parts = {source: float(sd[place]) for source, sd in behind.items()}
        parts |= {source: float(one[c][at[c]]) for source, one in moved.items()}
        found[name, c] = (shares(parts), rests[name, c])
    return found


def predicted_curves(medium: Medium) -> tuple[pd.DataFrame, Peaks]:
    """Predict the force on all legs in one medium by every profile that it has, and its peaks.

    A natural sand has the map and the generic one, and none where its penetration test gives no number,
    which the penetration table says. A medium without a nine-term fit has no profile that needs one, and
    one that was pushed in every direction no map.
    """
    config, sand = medium.results.config, medium.name in medium.results.sands
    parts = []
    peaks: Peaks = {}
    # a medium that was pushed in every direction has its table for a map
    whole = not sand and not medium.profile("table", draws=False).reason
    for kind in medium.kinds:
        if kind == ("table" if sand else "map" if whole else ""):
            continue
        profile = medium.profile(kind)
        if profile.reason and kind not in ("table", "depth_only"):
            continue
        for name, leg in config.legs.items():
            curve, own = leg_prediction(profile, leg, config)
            peaks |= {(medium.name, name, kind, c): peak for c, peak in own.items()}
            parts.append(curve.assign(medium=medium.name, leg=name, profile=kind))
    if not parts:
        return pd.DataFrame(columns=PREDICTED_COLUMNS), {}
    # no profile of a table without a number, or without errors, has an interval
    curves = pd.concat(parts, ignore_index=True).reindex(columns=PREDICTED_COLUMNS)
    curves["reason_code"] = np.where(curves["reason"] == "", "", "alpha-missing")
    if sand:
        alone = (curves["reason_code"] == "") & (curves["profile"] == "generic")
        note = medium.results.reference().remarks
        curves = with_reasons(curves, (note * one for one in alone))
    return curves, peaks


def bed_spread(table: pd.DataFrame) -> float:
    """Relative spread of forces from one prepared bed of a medium to the next; 0 where not known.

    A bed is looser or denser as a whole: its spread is that of alpha_z(0, 90 deg), relative.
    """
    cell = cell_at(table, 0, 90)
    if cell is None:
        return 0.0
    alpha, spread = float(cell[column("z")]), float(cell.get("run_to_run_z_N_per_cm3", 0.0))
    return spread / alpha if alpha > 0 and spread > 0 else 0.0


@dataclass(frozen=True)
class Peak:
    """Peak of a curve of force against theta, with what the scatter of the readings leaves uncertain.

    `se_N` is NaN where the curve is too short to show its scatter; an error of the zero is not in it.
    """

    force_N: float
    se_N: float
    theta_deg: float


def extreme(force: FloatArray, component: str) -> int:
    """Place of the largest lift (component ``z``), or horizontal force (``x``) of either sign."""
    return int(np.argmax(force if component == "z" else np.abs(force)))


def measured_peak(theta_deg: FloatArray, force_N: FloatArray, component: str) -> Peak:
    """Fit a parabola around the highest reading and take its highest point: the reading is too high.

    One reading a degree, in order. Where fewer than 6 lie around the highest, it is the peak itself.
    """
    at = extreme(force_N, component)
    if force_N.size >= 2 * _SMOOTH:
        # where the curve is highest, not where the noise is
        smooth = np.convolve(force_N, np.full(_SMOOTH, 1 / _SMOOTH), mode="valid")
        at = extreme(smooth, component) + _SMOOTH // 2
    fine = np.linspace(-HALF_WIDTH_DEG, HALF_WIDTH_DEG, 101)
    for _ in range(2):
        # once more around the peak of the first parabola where that lies near its end
        centre = theta_deg[at]
        near = np.abs(theta_deg - centre) <= HALF_WIDTH_DEG
        if np.count_nonzero(near) < _LEAST:
            return Peak(float(force_N[at]), math.nan, float(centre))
        offset = theta_deg[near] - centre
        design = np.vander(offset, 3)
        weights = np.linalg.pinv(design)
        inside = fine[(fine >= offset.min()) & (fine <= offset.max())]
        values = np.vander(inside, 3) @ weights @ force_N[near]
        top = extreme(values, component)
        if abs(inside[top]) <= HALF_WIDTH_DEG / 2:
            break
        at = int(np.argmin(np.abs(theta_deg - centre - inside[top])))
    share = np.vander(inside[top : top + 1], 3)[0] @ weights
    scatter = _long_run_variance(force_N)
    se = math.sqrt(scatter * float(share @ share))
    return Peak(float(values[top]), se, float(centre + inside[top]))


def _long_run_variance(force: FloatArray) -> float:
    """Variance of readings, with that of their neighbours' correlation, from third differences.

    Means of three readings hardly know of one another, a leg's curve is smooth over four of them,
    and the median passes over the corners that it has.
    """
    count = force.size // _BLOCK
    if count < 2 * _LEAST:
        return math.nan
    means = np.convolve(force, np.full(_BLOCK, 1 / _BLOCK), mode="valid")
    third = np.concatenate([np.diff(means[start::_BLOCK], 3) for start in range(_BLOCK)])
    # 1.4826 makes a standard deviation of a median, 1 + 9 + 9 + 1 = 20
    return _BLOCK * (1.4826 * float(np.median(np.abs(third)))) ** 2 / 20


def leg_errors(
    measured: pd.DataFrame,
    predicted: pd.DataFrame,
    bed_spread: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    behind: Mapping[tuple[str, str, str], tuple[str, float]] | None = None,
    peaks: Peaks | None = None,
) -> pd.DataFrame:
    """Compare every predicted curve with its measured one, over the theta that both have.

    A predicted curve without a measured one has a reason instead of numbers, and one that stopped
    early near its highest point has no peak. The interval of the peak error has the errors of alpha,
    of the leg's readings, of their zero and of the parabola through its peak, and the spread of its
    bed: a leg is measured in one bed. `bed_spread` is by medium, `behind` of `errors_of_peaks`, by
    medium, leg and component, `peaks` of `predicted_curves`.
    """
    keys = ["medium", "leg"]
    curves = dict(iter(measured.groupby(keys)))
    flags = {
        place: dict.fromkeys(flag for row in curve.to_dict("records") for flag in flags_of(row))
        for place, curve in curves.items()
    }
    rows = []
    for (medium, leg, profile), part in predicted.groupby([*keys, "profile"], sort=True):
        own = curves.get((medium, leg))
        both = None if own is None else own.merge(part, on="theta_deg", suffixes=("_measured", ""))
        spread = (bed_spread or {}).get(str(medium), 0.0)
        for component in COMPONENTS:
            drawn = (peaks or {}).get((str(medium), str(leg), str(profile), component))
            found, why = _compare(both, component, spread, confidence, drawn)
            reason = reason_columns([*why, *flags.get((medium, leg), ())])
            name = {"medium": medium, "leg": leg, "profile": profile, "component": component}
            name["verdict"] = judge(found)
            flagged = (behind or {}).get((str(medium), str(leg), component)) or ("", math.nan)
            flagged = flagged if profile == "table" else ("", math.nan)
            rests = dict(zip(("peak_errors", "peak_on_flagged_percent"), flagged, strict=True))
            rows.append(name | found | rests | reason)
    return pd.DataFrame(rows, columns=COLUMNS)


def _compare(
    both: pd.DataFrame | None,
    component: str,
    spread: float,
    confidence: float,
    drawn: tuple[float, float, float] | None,
) -> tuple[dict[str, float], list[Remark]]:
    """Errors of one component of a predicted curve, whose rows stand beside those measured, and remarks."""
    if both is None:
        return {}, [remark("not-measured")]
    if both.empty:
        return {}, [remark("no-common-theta")]
    theta, ours, truth = _curves(both, component)
    why: list[Remark] = []
    row = {"theta_from_deg": float(theta.min()), "theta_to_deg": float(theta.max())}
    if not np.isfinite(ours).all():
        lost = both.drop_duplicates("reason").to_dict("records")
        return row, [why for one in lost for why in reason_of(one)] or [remark("not-predicted")]
    off = ours - truth
    rms = float(np.sqrt(np.mean(off**2)))
    scatter = float(np.sum((truth - truth.mean()) ** 2))
    row |= {"rms_error_N": rms, "r2": 1 - float(off @ off) / scatter if scatter else math.nan}
    if np.ptp(theta) < FULL_RANGE_DEG:
        ends = {"first": theta.min(), "last": theta.max()}
        if _at_an_end(theta, ours, component) or _at_an_end(theta, truth, component):
            return row, [remark("short-at-peak", **ends)]
        why = [remark("short-curve", **ends)]
        drawn = None  # its peak may lie where nothing was measured
    return row | _peak_errors(both, component, rms, spread, confidence, drawn), why


def _peak_errors(
    both: pd.DataFrame,
    component: str,
    rms: float,
    spread: float,
    confidence: float,
    drawn: tuple[float, float, float] | None,
) -> dict[str, float]:
    theta, ours, truth = _curves(both, component)
    at, found = extreme(ours, component), measured_peak(theta, truth, component)
    peak, best = found.force_N, float(ours[at])
    ends = [float(both[f"force_{component}_{end}_N"].iloc[at]) for end in ("lo", "hi")]
    zero = float(both[f"zero_se_{component}_N"].iloc[at]) if f"zero_se_{component}_N" in both else 0
    # what a parabola does to the prediction, which has no noise, it does to the measured peak
    smooth = measured_peak(theta, ours, component)
    shape = (smooth.force_N / best - 1) * peak if best else 0.0
    if drawn is not None:
        best, *ends = drawn
    error = math.hypot(found.se_N, zero, spread * peak, shape)
    lo, hi = _error_interval(best, ends, peak, error, confidence)
    off, relative = (100 * (best / peak - 1), rms / abs(peak)) if peak else (math.nan, math.nan)
    return {
        "peak_measured_N": peak,
        "peak_predicted_N": best,
        "peak_predicted_lo_N": ends[0],
        "peak_predicted_hi_N": ends[1],
        "peak_error_percent": off,
        "peak_error_lo_percent": lo,
        "peak_error_hi_percent": hi,
        "peak_late_deg": smooth.theta_deg - found.theta_deg,
        "rms_relative_to_peak": relative,
    }


def judge(numbers: Mapping[str, float]) -> str:
    """Verdict on the model by one peak, of `leg_errors`: how large its error is, and whether it is sure.

    An error is sure where its interval does not hold 0; so it is where there is no interval.
    """
    ends = ("", "lo_", "hi_")
    error, lo, hi = (numbers.get(f"peak_error_{end}percent", math.nan) for end in ends)
    if not math.isfinite(error):
        return NOT_TESTED
    if abs(error) <= WITHIN_PERCENT:
        return WITHIN
    doubled = error > TOO_HIGH_PERCENT or error < TOO_LOW_PERCENT
    return FAR_OFF if doubled and not lo <= 0 <= hi else OFF


def worst_peak(errors: pd.DataFrame, medium: str, profile: str) -> dict[Any, Any] | None:
    """Row of `leg_errors` on which the verdict on a profile rests: None where no leg was measured."""
    own = errors[(errors["medium"] == medium) & (errors["profile"] == profile)]
    rows = own[own["verdict"] != NOT_TESTED].to_dict("records")
    order = (WITHIN, OFF, FAR_OFF)
    bad = [(order.index(row["verdict"]), abs(row["peak_error_percent"])) for row in rows]
    return rows[bad.index(max(bad))] if rows else None


def _curves(both: pd.DataFrame, component: str) -> list[FloatArray]:
    """Theta, deg, with predicted and measured force, N."""
    names = ("theta_deg", f"force_{component}_N", f"force_{component}_N_measured")
    return [both[name].to_numpy(float) for name in names]


def _at_an_end(theta: FloatArray, force: FloatArray, component: str) -> bool:
    """Tell whether a part of a curve is highest where it ends: the whole curve may be higher."""
    top = theta[extreme(force, component)]
    return bool(min(top - theta.min(), theta.max() - top) <= HALF_WIDTH_DEG)


def _error_interval(
    predicted: float, ends: list[float], peak: float, error: float, confidence: float
) -> tuple[float, float]:
    """Interval of 100 (predicted / peak - 1), from the errors of both as independent ones."""
    if not peak or not predicted:
        return math.nan, math.nan
    ratio = predicted / peak
    # errors of the ratio, relative; the lower end of the ratio has the higher measured peak
    below, above = sorted(end / predicted - 1 for end in ends)
    own = float(student_quantile(confidence, _ZERO_DOF)) * abs(error / peak)
    lo, hi = ratio * (1 - math.hypot(below, own)), ratio * (1 + math.hypot(above, own))
    lo, hi = sorted((lo, hi))
    return 100 * (lo - 1), 100 * (hi - 1)
