"""The numbers of the live parts of the page, as one JSON object."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.config import Leg
from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, beta_apart
from rftfit.figures.labels import PROFILES, name_of, usable_media
from rftfit.figures.maps import cells_of_map, kept_coefficients, lies_on_grid
from rftfit.forces.motion import THETA_DEG, rotation
from rftfit.forces.outlines import leg_outline
from rftfit.forces.peaks import Peak
from rftfit.forces.planning import plan
from rftfit.forces.prediction import predict_with_peaks
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags, Remark, format_remarks, reason_of
from rftfit.measure.lab_frame import measures_force_x
from rftfit.measure.slopes import student_quantile
from rftfit.model import scaling
from rftfit.model.fourier import TERMS
from rftfit.model.profiles import (
    FAR_DEG,
    DepthOnlyProfile,
    FourierProfile,
    Profile,
    TableProfile,
    scaled_generic,
)
from rftfit.model.shapes import Map, Pushes, estimate, usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG
from rftfit.results import Results

CURVE_DIGITS = 6
"""Significant digits of curves, as in the csv tables. Profiles and outlines keep all of theirs."""

END_DIGITS = 3
"""Significant digits of the ends of intervals along a curve: finer than a line is drawn."""

TABLE_DIGITS = 9
"""Significant digits of the reference media's alpha, which only intervals hang on."""

SAME_LINE_DEG = 0.01
"""Tables have angles of fewer digits than the grid."""


# What the page asks of profiles and of the scaling routine.


def live_profiles(results: Results, medium: str) -> dict[str, Profile]:
    """Profiles of a medium whose numbers are known; of a natural sand the map and the generic one."""
    profile_by_name: dict[str, Profile] = {}
    if len(map_table := results.map_table(medium)):
        profile_by_name["map"] = TableProfile.from_table(
            map_table, f"map of {results[medium].title}"
        )
    if results[medium].settings.role == "laboratory":
        table = TableProfile.from_table(results[medium].alpha, results[medium].title)
        profile_by_name["table"] = table
        profile_by_name["fourier"] = FourierProfile(kept_coefficients(results, medium))
        profile_by_name["depth_only"] = DepthOnlyProfile.of(table)
    if medium in scaled_from_print(results):
        m0 = scaling.published(results.config.fourier.method).m0
    else:
        m0 = kept_coefficients(results, scaling.GENERIC)
    profile_by_name["generic"] = scaled_generic(zeta(results, medium), m0)
    # a measured table may have holes, and says why
    is_complete = {
        name: name == "table"
        or all(np.isfinite(parameter).all() for parameter in profile.parameters)
        for name, profile in profile_by_name.items()
    }
    return {name: profile_by_name[name] for name in PROFILES if is_complete.get(name)}


def zeta(results: Results, medium: str) -> float:
    """Scaling factor of the fit of a medium by the configured method; NaN where it has none."""
    return fitted_scale(results, medium)["zeta"][0]


Scale = Mapping[str, tuple[float, float, float]]
"""``zeta`` and ``chi`` of a medium with their intervals; NaN where there is none."""


def fitted_scale(results: Results, medium: str) -> Scale:
    """Return zeta and chi of the fit to the measured directions by the configured method."""
    method = results.config.fourier.method
    table = results.table("penetration.csv")
    is_of_medium = table["method"].isin([method, *scaling.routines(method)]) & (
        table["medium"] == medium
    )
    rows = table[is_of_medium].head(1)
    scale = {}
    for name in ("zeta", "chi"):
        ends = (rows[f"{name}{end}"].astype(float) for end in ("", "_lo", "_hi"))
        value, lo, hi = (float(column.iloc[0]) if len(column) else math.nan for column in ends)
        scale[name] = value, lo, hi
    return scale


def scale_in_all_directions(results: Results, medium: str) -> Scale:
    """Return zeta and chi of a medium as they stand beside those of the paper, which are of all directions.

    They are those of the fit, or where directions of the published grid lack a push those of the map.
    """
    if has_scale_of_map(results, medium):
        medium_map = results[medium].map()
        return {"zeta": medium_map.zeta, "chi": medium_map.chi}
    return fitted_scale(results, medium)


def has_scale_of_map(results: Results, medium: str) -> bool:
    """Whether zeta and chi are those of the map, whose nine terms are fitted by least squares."""
    is_least_squares = results.config.fourier.method == "lsq"
    return is_least_squares and lacks_directions(results, medium) and not results.map_reason(medium)


def lacks_directions(results: Results, medium: str) -> bool:
    """Whether nine terms were fitted to pushes that leave directions of the published grid far from every push."""
    if medium not in results.laboratory or not math.isfinite(zeta(results, medium)):
        return False
    table = TableProfile.from_table(results[medium].alpha)
    beta, gamma = np.radians(np.meshgrid(BETA_DEG, GAMMA_DEG))
    # a single lost direction is no farther from those beside it than that and the tolerance of angles
    is_far = table.far_from_pushes(beta.ravel(), gamma.ravel(), FAR_DEG + TOLERANCE_DEG)
    return bool(is_far.any())


def scaled_from_print(results: Results) -> list[str]:
    """Natural sands that were scaled with the published media: the campaign has too few of its own."""
    table = results.table("penetration.csv")
    method = scaling.routine(results.config.fourier.method, printed=True)
    return [str(medium) for medium in table.loc[table["method"] == method, "medium"]]


def scaling_references(results: Results) -> list[scaling.Reference]:
    """What a further medium is scaled from: this campaign's media, where there are two; the printed ones."""
    method = results.config.fourier.method
    table = results.table("penetration.csv")
    is_finite = np.isfinite(table["chi"].to_numpy(float))
    is_usable = is_finite & table["medium"].isin(usable_media(results, table["medium"]))
    rows = table[(table["method"] == method) & is_usable]
    chi = dict(zip(rows["medium"].map(str), rows["chi"].map(float), strict=True))
    values = {medium: kept_coefficients(results, medium) for medium in (scaling.GENERIC, *chi)}
    if len(chi) < 2 or not np.isfinite(list(values.values())).all():
        return [scaling.published(method)]
    return [
        scaling.reference_from(
            f"this campaign, method {method}",
            chi,
            values,
            tables={medium: TableProfile.from_table(results[medium].alpha) for medium in chi},
        ),
        scaling.published(method),
    ]


# The JSON object that the scripts work on.


def live_data(results: Results) -> dict[str, Any]:
    """Collect what the scripts of the page work on; NaN is None."""
    config = results.config
    predicted = results.table("predicted.csv")
    return {
        "media": [
            {"key": medium.name, "title": medium.title, "role": medium.settings.role}
            for medium in results
        ],
        "terms": list(TERMS),
        "legs": {name: _leg(leg) for name, leg in config.legs.items()},
        "leg_names": {name: name_of(name) for name in config.intruders},
        "profile_names": PROFILES,
        "rate": config.arm.leg_speed_rad_per_s,
        "beta_deg": BETA_DEG.tolist(),
        "gamma_deg": GAMMA_DEG.tolist(),
        "confidence": config.fit.confidence,
        "profiles": {
            medium: {
                name: _parameters(profile)
                for name, profile in live_profiles(results, medium).items()
            }
            for medium in results.media
        },
        "alpha": {
            medium.name: _cells(
                medium.alpha,
                medium.flags,
                medium.flags.shared(medium.fits),
                _runs_without_force_x(results),
            )
            for medium in results
        },
        "maps": {
            medium.name: _cells(_on_lines(map_table, medium.alpha).assign(reason=_of_map))
            for medium in results
            if len(map_table := results.map_table(medium.name))
        },
        "measured": {
            medium.name: {
                str(leg): _measured_curve(curve_rows)
                for leg, curve_rows in medium.legs.groupby("leg")
            }
            for medium in results
        },
        "predicted": {
            str(medium): {
                str(leg): {
                    str(name): _ends_along(curve_rows, END_DIGITS)
                    for name, curve_rows in rows_of_leg.groupby("profile")
                }
                for leg, rows_of_leg in rows.groupby("leg")
            }
            for medium, rows in predicted.groupby("medium")
        },
        "zeta": {
            medium: as_lists(
                np.array(scale_in_all_directions(results, medium)["zeta"]), CURVE_DIGITS
            )
            for medium in results.media
        },
        "push": _unit_push(results),
        "references": [
            _reference(reference, config.fit.confidence)
            for reference in scaling_references(results)
        ],
    }


def _runs_without_force_x(results: Results) -> set[str]:
    """Runs whose force along x nothing measured."""
    config = results.config
    return {run.run_id for run in results.campaign.runs if not measures_force_x(config, run)}


def _of_map(cells: pd.DataFrame) -> pd.Series:
    return "map: " + cells["source"]


def _on_lines(map_table: pd.DataFrame, measured: pd.DataFrame | None = None) -> pd.DataFrame:
    """Cells of a map on the lines of the published grid, and of the measured one: those between are too small to tap."""
    on_lines = np.ones(len(map_table), dtype=bool)
    for name, lines in (("beta_deg", BETA_DEG), ("gamma_deg", GAMMA_DEG)):
        measured_deg = np.zeros(0) if measured is None else measured[name].to_numpy(float)
        distances = np.abs(
            map_table[name].to_numpy(float)[:, None] - np.union1d(lines, measured_deg)
        )
        on_lines &= distances.min(axis=1) < SAME_LINE_DEG
    return map_table[on_lines]


def _unit_push(results: Results) -> dict[str, Any]:
    """What a push of 1 N/cm^3 straight down tells, with the usual error and with none: all of it is proportional to the push."""
    from scipy.special import ndtri

    level = results.config.fit.confidence
    of_usual_error, exact = (_map_of_unit_push(results, se) for se in (math.nan, 0.0))
    step_now, step_after = plan("map", exact, count=1, confidence=level).steps
    return {
        "media": len(exact.known_media.split(", ")),
        "quantile": float(ndtri(0.5 + level / 2)),
        "model_error": results.model_error,
        "usual": float(usual_error(np.ones(1))[0]),
        **_numbers_of_map(results, of_usual_error),
        "exact": _numbers_of_map(results, exact),
        "next": {
            "direction": step_after.directions[0],
            "now": step_now.typical,
            "after": step_after.typical,
        },
    }


def _map_of_unit_push(results: Results, se: float) -> Map:
    """Map of a push of 1 N/cm^3 straight down; `se`: NaN for the usual error."""
    push, level = Pushes.of(0.0, 90.0, [1.0, np.nan], se), results.config.fit.confidence
    try:
        return estimate(push, results.shapes(), confidence=level)
    except ValueError:  # with media of the campaign that hardly take energy
        return estimate(push, confidence=level)


def _numbers_of_map(results: Results, unit_map: Map) -> dict[str, Any]:
    """Alpha, zeta and forces on the legs by a map, with their intervals."""
    config, level = results.config, results.config.fit.confidence
    legs = {}
    for name, leg in config.legs.items():
        motion = rotation(None, leg.hip_height_cm, config.arm.leg_speed_rad_per_s)
        forces, peaks = predict_with_peaks(
            unit_map, leg_outline(leg), motion, level, model_error=results.model_error
        )
        curve = {name: as_lists(forces[name].to_numpy(float), CURVE_DIGITS) for name in _FORCES}
        legs[name] = {
            **curve,
            **_ends_along(forces, CURVE_DIGITS),
            "peaks": {c: _largest(peaks, names) for c, names in _PEAKS.items()},
        }
    return {
        "map": _cells(_on_lines(unit_map.table()).assign(reason="")),
        "zeta": as_lists(np.array(unit_map.zeta), CURVE_DIGITS),
        "legs": legs,
    }


_PEAKS = {"z": ("lift",), "x": ("thrust", "drag")}


def _largest(peaks: Sequence[Peak], names: Sequence[str]) -> list[Any]:
    """Place, value and ends of both intervals of the largest of some peaks; of a leg in the air 0."""
    peak_numbers = [
        (peak.position, peak.value, peak.lo, peak.hi, peak.model_lo, peak.model_hi)
        for peak in peaks
        if peak.name in names
    ]
    largest = max(peak_numbers, key=lambda numbers: abs(numbers[1]), default=(0.0,) * 6)
    return as_lists(np.array(largest), CURVE_DIGITS)


def _reference(reference: scaling.Reference, confidence: float) -> dict[str, Any]:
    """What the scaling routine takes from reference media; half widths are those of the logarithm of zeta."""
    exact, doubtful = (
        scaling.scale_new_medium(1.0, se, reference.chi, confidence) for se in (0.0, 1.0)
    )
    half_chi, half_total = (math.log(scaled.zeta_hi / scaled.zeta) for scaled in (exact, doubtful))
    return {
        "name": reference.name,
        "media": len(reference.media),
        "chi": exact.chi,
        "half_chi": half_chi,
        # of a test whose error is as large as itself
        "half_test": math.sqrt(half_total**2 - half_chi**2),
        "student": float(student_quantile(confidence, reference.chi.size - 1)),
        "m0": reference.m0.tolist(),
        "scaled": reference.scaled.tolist(),
        "tables": [_parameters(table, TABLE_DIGITS) for table in reference.tables],
    }


def as_json(data: Mapping[str, Any]) -> str:
    """Write JSON that can stand inside a script element: nothing in it can end the element."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _parameters(profile: Profile, digits: int | None = None) -> dict[str, Any]:
    """A profile as the script's kernel takes it; `digits`: significant ones of a table's alpha, default all."""
    if isinstance(profile, TableProfile):
        angles = {"beta": profile.beta.tolist(), "gamma": profile.gamma.tolist()}
        alpha = {"z": as_lists(profile.alpha_z, digits), "x": as_lists(profile.alpha_x, digits)}
        return {"kind": "table", **angles, **alpha, "reason": profile.reason}
    if isinstance(profile, DepthOnlyProfile):
        return {"kind": "depth_only", "values": profile.values.tolist()}
    assert isinstance(profile, FourierProfile)
    return {"kind": "fourier", "values": profile.coefficients.tolist()}


def as_lists(values: FloatArray, digits: int | None = None) -> list[Any]:
    """Turn an array into nested lists, NaN into None; `digits` are the significant ones to keep."""
    if values.ndim > 1:
        return [as_lists(row, digits) for row in values]
    return [_number(float(value), digits) for value in values]


def _number(value: float, digits: int | None) -> float | int | None:
    if not math.isfinite(value):
        return None
    if digits is not None:
        value = float(f"{value:.{digits}g}")
    return int(value) if value == int(value) and abs(value) < 1e6 else value


def _leg(leg: Leg) -> dict[str, Any]:
    outline = leg_outline(leg)
    facts = leg.model_dump(include={"hip_height_cm", "max_length_cm", "curvature_times_R"})
    return {"body": outline.body.tolist(), "width_cm": outline.width_cm, **facts}


def _cells(
    table: pd.DataFrame,
    flags: Flags | None = None,
    shared: Sequence[Remark] = (),
    runs_without_x: Collection[str] = (),
) -> dict[str, Any]:
    """Measured cells of one medium as a map, with intervals and why one is empty.

    Scattered directions are shown as what is interpolated between them, and as points. `flags`: of
    the medium; `shared`: those that the page says once. `runs_without_x`: runs whose force along x nothing measured;
    ``unmeasured_x`` names the cells that have no other.
    """
    notes: dict[str, str] = {}
    unmeasured_x: list[str] = []
    points = np.empty((0, 4))
    values = {}
    if lies_on_grid(table):
        for c, end in product("zx", ("", "_lo", "_hi")):
            beta_deg, gamma_deg, values[c + end] = cells_of_map(table, column(c, end))
        for row in table.to_dict("records"):
            # a plate at -90 degrees is the one at 90
            lines = np.flatnonzero(np.abs(beta_apart(beta_deg, row["beta_deg"])) < SAME_LINE_DEG)
            column_at = np.abs(gamma_deg - row["gamma_deg"]).argmin()
            cells_of_row = [f"{line},{column_at}" for line in lines]
            flags_of_cell = flags.of_cell(row, without=shared) if flags else []
            if note := format_remarks([*reason_of(row), *flags_of_cell]):
                notes |= dict.fromkeys(cells_of_row, note)
            run_ids = str(row.get("run_ids", "")).split()
            if run_ids and set(run_ids) <= set(runs_without_x):
                unmeasured_x += cells_of_row
    else:
        beta_deg = gamma_deg = np.arange(-90.0, 91.0, 15.0)
        angle_grid = np.meshgrid(np.radians(beta_deg), np.radians(gamma_deg), indexing="ij")
        for c, alpha in zip("zx", TableProfile.from_table(table).alpha(*angle_grid), strict=True):
            unknown = np.full(alpha.shape, np.nan)
            values |= {c: alpha, f"{c}_lo": unknown, f"{c}_hi": unknown}
        points = table[["beta_deg", "gamma_deg", column("z"), column("x")]].to_numpy(float)
    cells = {name: as_lists(grid, CURVE_DIGITS) for name, grid in values.items()}
    angles = {"beta_deg": beta_deg.tolist(), "gamma_deg": gamma_deg.tolist()}
    notes_and_points = {"notes": notes, "points": as_lists(points, CURVE_DIGITS)}
    return cells | angles | notes_and_points | {"unmeasured_x": unmeasured_x}


_FORCES = [f"force_{c}_N" for c in "zx"]
_ENDS = [f"force_{c}_{end}_N" for c in "zx" for end in ("lo", "hi", "model_lo", "model_hi")]


def _measured_curve(rows: pd.DataFrame) -> dict[str, Any]:
    """Forces on a leg over theta."""
    rows = rows.sort_values("theta_deg")
    return {
        name: as_lists(rows[name].to_numpy(float), CURVE_DIGITS) for name in ("theta_deg", *_FORCES)
    }


def _ends_along(rows: pd.DataFrame, digits: int) -> dict[str, Any]:
    """Ends of the intervals over theta; the script calculates the forces, and a turn by 1 deg is its own."""
    rows = rows.sort_values("theta_deg")
    theta_deg = rows["theta_deg"].to_numpy(float)
    curve = {} if np.array_equal(theta_deg, THETA_DEG) else {"theta_deg": theta_deg.tolist()}
    names = [name for name in _ENDS if name in rows and rows[name].notna().any()]
    return curve | {name: as_lists(rows[name].to_numpy(float), digits) for name in names}
