"""Numbers of the interactive parts of the page (maps, leg viewer, field calculator), as one JSON object for scripts.

`live_data` collects them; NaN becomes None, and numbers are rounded to what can be seen. The scripts calculate forces
on legs themselves, by profiles; only intervals are written along curves. Zeta of a medium is its fitted alpha_z
straight down; chi is measured over fitted. A reference is a set of media by which the calculator scales a new one
(`scaling.Reference`).

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags``, ``legs`` (measured
forces). `column("z", "_lo")` is the name ``alpha_z_lo_N_per_cm3``.

Flags and reasons are `Remark`: a code with numbers, which becomes a sentence.
"""

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
from rftfit.directions import beta_apart
from rftfit.figures.labels import PROFILE_NAMES, cell_straight_down, name_of, usable_media
from rftfit.figures.maps import cells_of_map, kept_coefficients, lies_on_grid
from rftfit.forces.motion import THETA_DEG, rotation
from rftfit.forces.outlines import leg_outline
from rftfit.forces.peaks import Peak
from rftfit.forces.planning import plan
from rftfit.forces.prediction import predict_with_peaks
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags, Remark, format_remarks, reason_of
from rftfit.measure.lab_frame import measures_force_x
from rftfit.measure.slopes import normal_quantile, student_quantile
from rftfit.model import scaling
from rftfit.model.fourier import TERMS
from rftfit.model.maps import Map, estimate
from rftfit.model.profiles import (
    FAR_DEG,
    DepthOnlyProfile,
    FourierProfile,
    Profile,
    TableProfile,
    scaled_generic,
)
from rftfit.model.pushes import Pushes, usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG
from rftfit.results import Results

CURVE_DIGITS = 6
"""Significant digits of curves, as in the csv tables. Profiles and outlines keep all digits."""

END_DIGITS = 3
"""Significant digits of the ends of intervals along a curve: finer than can be seen in a drawing."""

TABLE_DIGITS = 9
"""Significant digits of alpha of the reference media, on which only intervals depend."""

SAME_LINE_DEG = 0.01
"""Angles that differ by less are the same line of a grid: tables have fewer digits than the grid."""


# Numbers of profiles and of the scaling routine for the page.


def live_profiles(results: Results, medium: str) -> dict[str, Profile]:
    """Collect the profiles of a medium that have numbers, by name; of a natural sand only the map and the generic one.

    In the order of `PROFILE_NAMES`. The generic profile is M0 of this campaign times zeta; M0 of the paper for a sand
    that was scaled by the published media.
    """
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
    # the measured table is kept also with holes, whose reasons it holds
    complete = {
        name: profile
        for name, profile in profile_by_name.items()
        if name == "table" or all(np.isfinite(numbers).all() for numbers in profile.parameters)
    }
    return {name: complete[name] for name in PROFILE_NAMES if name in complete}


def zeta(results: Results, medium: str) -> float:
    """Return zeta of a medium by the configured method; NaN where it has none."""
    return fitted_scale(results, medium)["zeta"][0]


Scale = Mapping[str, tuple[float, float, float]]
"""``zeta`` and ``chi`` of a medium, each as value, lower and upper end of its interval; NaN where there is none."""


def fitted_scale(results: Results, medium: str) -> Scale:
    """Return zeta and chi of the fit to the measured directions by the configured method, or by the paper's routine.

    The routine, by which natural sands are scaled, has names of its own in the column ``method``.
    """
    method = results.config.fourier.method
    table = results.table("penetration.csv")
    is_of_medium = table["method"].isin([method, *scaling.routines(method)]) & (
        table["medium"] == medium
    )
    # the first row; a row of NaN where there is none
    rows = table[is_of_medium].reset_index(drop=True).reindex([0])
    return {
        name: (float(rows[name][0]), float(rows[f"{name}_lo"][0]), float(rows[f"{name}_hi"][0]))
        for name in ("zeta", "chi")
    }


def scale_in_all_directions(results: Results, medium: str) -> Scale:
    """Return zeta and chi of a medium that can be compared with the paper's, which are from all directions.

    They are from the fit, or from the map where directions of the published grid lack a push.
    """
    if has_scale_of_map(results, medium):
        medium_map = results[medium].map()
        return {"zeta": medium_map.zeta, "chi": medium_map.chi}
    return fitted_scale(results, medium)


def has_scale_of_map(results: Results, medium: str) -> bool:
    """Return True if zeta and chi of a medium are taken from its map: where its pushes lack directions, and it has a map.

    The nine terms of a map are fitted by least squares, so that it stands in for this method alone.
    """
    is_least_squares = results.config.fourier.method == "lsq"
    return is_least_squares and lacks_directions(results, medium) and not results.map_reason(medium)


def lacks_directions(results: Results, medium: str) -> bool:
    """Return True if the nine terms of a medium were fitted though directions of the published grid are far from every push.

    Such terms describe the pushed directions alone. False for sands, and for media without a fit.
    """
    if medium not in results.laboratory or not math.isfinite(zeta(results, medium)):
        return False
    table = TableProfile.from_table(results[medium].alpha)
    beta, gamma = np.radians(np.meshgrid(BETA_DEG, GAMMA_DEG))
    tolerance_deg = results.config.grid.angle_tolerance_deg
    # the neighbours of a single lost direction are near enough: within this angle and the tolerance of angles
    is_far = table.far_from_pushes(beta.ravel(), gamma.ravel(), FAR_DEG + tolerance_deg)
    return bool(is_far.any())


def scaled_from_print(results: Results) -> list[str]:
    """List natural sands that were scaled by the published media, since the campaign has too few laboratory media."""
    table = results.table("penetration.csv")
    method = scaling.routine(results.config.fourier.method, printed=True)
    return [str(medium) for medium in table.loc[table["method"] == method, "medium"]]


def scaling_references(results: Results) -> list[scaling.Reference]:
    """Collect the references by which the page scales a further medium: this campaign's media, if two or more; the published.

    A reference needs several media, whose chi scatter: that scatter is the error of scaling.
    """
    method = results.config.fourier.method
    table = results.table("penetration.csv")
    is_usable = table["medium"].isin(usable_media(results, table["medium"]))
    rows = table[(table["method"] == method) & is_usable].dropna(subset="chi")
    chi = dict(zip(rows["medium"].map(str), rows["chi"].map(float), strict=True))
    coefficients = {
        medium: kept_coefficients(results, medium) for medium in (scaling.GENERIC, *chi)
    }
    if len(chi) < 2 or not np.isfinite(list(coefficients.values())).all():
        return [scaling.published(method)]
    tables = {medium: TableProfile.from_table(results[medium].alpha) for medium in chi}
    name = f"this campaign, method {method}"
    return [scaling.reference_from(name, chi, coefficients, tables), scaling.published(method)]


# The JSON object that the scripts use.


def live_data(results: Results) -> dict[str, Any]:
    """Collect the numbers that the scripts of the page use; NaN becomes None.

    Most entries are by medium: ``profiles`` (parameters, by name), ``alpha`` and ``maps`` (cells of measured and
    estimated maps), ``measured`` (forces by leg), ``predicted`` (ends of intervals by leg and profile), ``zeta`` (value
    and ends), ``down`` (alpha_z straight down). ``push`` and ``references`` are for the field calculator; ``rate``: of
    a leg, rad/s.
    """
    config = results.config
    predicted = results.table("predicted.csv")
    runs_without_x = {
        run.run_id for run in results.campaign.runs if not measures_force_x(config, run)
    }
    return {
        "media": [
            {"key": medium.name, "title": medium.title, "role": medium.settings.role}
            for medium in results
        ],
        "terms": list(TERMS),
        "legs": {name: _leg_facts(leg) for name, leg in config.legs.items()},
        "leg_names": {name: name_of(name) for name in config.intruders},
        "profile_names": PROFILE_NAMES,
        "rate": config.arm.leg_speed_rad_per_s,
        "beta_deg": BETA_DEG.tolist(),
        "gamma_deg": GAMMA_DEG.tolist(),
        "confidence": config.fit.confidence,
        "profiles": {
            medium: {
                name: _profile_parameters(profile)
                for name, profile in live_profiles(results, medium).items()
            }
            for medium in results.media
        },
        "alpha": {
            medium.name: _map_cells(
                medium.alpha,
                config.grid.angle_tolerance_deg,
                medium.flags,
                medium.flags.shared(medium.fits),
                runs_without_x,
            )
            for medium in results
        },
        "maps": {
            medium.name: _map_cells(
                _select_grid_lines(map_table, medium.alpha).assign(
                    reason=lambda cells: "map: " + cells["source"]
                ),
                config.grid.angle_tolerance_deg,
            )
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
                    str(name): _interval_ends(curve_rows, END_DIGITS)
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
        "down": _alpha_straight_down(results),
        "push": _unit_push(results),
        "references": [
            _reference_parameters(reference, config.fit.confidence)
            for reference in scaling_references(results)
        ],
    }


def _alpha_straight_down(results: Results) -> dict[str, Any]:
    """Collect alpha_z, N/cm^3, of the media that were pushed straight down, by medium."""
    cells = {name: cell_straight_down(results, name) for name in results.media}
    return {
        name: _round_number(float(cell[column("z")]), CURVE_DIGITS)
        for name, cell in cells.items()
        if cell is not None
    }


def _select_grid_lines(
    map_table: pd.DataFrame, measured: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Select the cells of a map at angles of the published or the measured grid: cells of the whole map are too small to tap.

    `map_table`: A row a cell, as an alpha table. `measured`: Table of measured alpha; None: only the published grid.
    """
    for name, published_deg in (("beta_deg", BETA_DEG), ("gamma_deg", GAMMA_DEG)):
        measured_deg = np.zeros(0) if measured is None else measured[name].to_numpy(float)
        lines_deg = np.union1d(published_deg, measured_deg)
        distances_deg = np.abs(map_table[name].to_numpy(float)[:, None] - lines_deg)
        map_table = map_table[distances_deg.min(axis=1) < SAME_LINE_DEG]
    return map_table


def _unit_push(results: Results) -> dict[str, Any]:
    """Compute the map that follows from one push straight down with alpha_z = 1 N/cm^3, without error and with the usual one.

    The field calculator multiplies these numbers by the alpha_z that a user measured, as all are proportional to it.
    ``map``, ``zeta``, ``legs``: of `_numbers_of_map`, with the usual error; ``exact``: the same without error, from
    which the script makes intervals for an error that a user states. ``next``: the best further push (beta, gamma), and
    the half width of the map now and after it. ``usual``: the usual error, relative.
    """
    confidence = results.config.fit.confidence
    with_usual_error, exact = (_map_of_unit_push(results, se) for se in (math.nan, 0.0))
    step_now, step_after = plan("map", exact, count=1, confidence=confidence).steps
    return {
        "media": len(exact.known_media.split(", ")),
        "quantile": normal_quantile(confidence),
        "model_error": results.model_error,
        "usual": float(usual_error(np.ones(1))[0]),
        **_numbers_of_map(results, with_usual_error),
        "exact": _numbers_of_map(results, exact),
        "next": {
            "direction": step_after.directions[0],
            "now": step_now.overall,
            "after": step_after.overall,
        },
    }


def _map_of_unit_push(results: Results, se: float) -> Map:
    """Estimate the map from one push straight down with alpha_z = 1 N/cm^3; `se`: its error, NaN for the usual one."""
    push, confidence = Pushes.of(0.0, 90.0, [1.0, np.nan], se), results.config.fit.confidence
    try:
        return estimate(push, results.shapes(), confidence=confidence)
    except ValueError:  # media of the campaign among the known shapes that hardly take energy
        return estimate(push, confidence=confidence)


_PEAK_NAMES = {"z": ("lift",), "x": ("thrust", "drag")}
"""Names of the peaks of each component of the force: a horizontal one may push forward or backward."""


_FORCES = [f"force_{c}_N" for c in "zx"]
_ENDS = [f"force_{c}_{end}_N" for c in "zx" for end in ("lo", "hi", "model_lo", "model_hi")]
"""Columns of a table of predicted forces: the forces, and the ends of their two intervals."""


def _numbers_of_map(results: Results, unit_map: Map) -> dict[str, Any]:
    """Collect alpha, zeta and forces on the legs by a map, with their intervals.

    ``map``: alpha of the cells. ``zeta``: value and ends. ``legs``: of each leg turned by -135 to 135 deg the columns
    of forces and their ends over theta, and ``peaks`` of z and x as `_largest_peak` lists them.
    """
    config, legs = results.config, {}
    for name, leg in config.legs.items():
        motion = rotation(None, leg.hip_height_cm, config.arm.leg_speed_rad_per_s)
        forces, peaks = predict_with_peaks(
            unit_map,
            leg_outline(leg),
            motion,
            config.fit.confidence,
            model_error=results.model_error,
        )
        curve = {
            column: as_lists(forces[column].to_numpy(float), CURVE_DIGITS) for column in _FORCES
        }
        legs[name] = {
            **curve,
            **_interval_ends(forces, CURVE_DIGITS),
            "peaks": {c: _largest_peak(peaks, names) for c, names in _PEAK_NAMES.items()},
        }
    return {
        "map": _map_cells(
            _select_grid_lines(unit_map.table()).assign(reason=""), config.grid.angle_tolerance_deg
        ),
        "zeta": as_lists(np.array(unit_map.zeta), CURVE_DIGITS),
        "legs": legs,
    }


def _largest_peak(peaks: Sequence[Peak], names: Sequence[str]) -> list[Any]:
    """Return the numbers of the largest peak among some names: position (theta, deg), value (N), ends of both intervals (N).

    `names`: Of `_PEAK_NAMES`. Six zeros for a leg in air, which has no peak.
    """
    named_peaks = [peak for peak in peaks if peak.name in names]
    if not named_peaks:
        return [0] * 6
    largest = max(named_peaks, key=lambda peak: abs(peak.value))
    ends = largest.lo, largest.hi, largest.model_lo, largest.model_hi
    return as_lists(np.array([largest.position, largest.value, *ends]), CURVE_DIGITS)


def _reference_parameters(reference: scaling.Reference, confidence: float) -> dict[str, Any]:
    """Return the numbers by which the script scales a new medium to a reference; half widths are of the logarithm of zeta.

    Zeta is the alpha_z of a penetration test over the mean chi. ``half_chi``: half width from the scatter of chi alone.
    ``half_test``: from the test, if its standard error were as large as its alpha; the script multiplies it by the
    relative error that a user states, and adds both as squares. ``student``: quantile of Student's t by which `scaling.js`
    multiplies the scatter of the shapes of the media. ``m0``: nine terms of the generic profile of zeta 1. ``scaled``:
    nine terms of each medium over its zeta, (media, 9). ``tables``: measured alpha of each over zeta, which shows what
    nine terms miss.
    """
    # of tests with alpha_z = 1 N/cm^3, without an error and with one of 1 N/cm^3
    exact, doubtful = (
        scaling.scale_new_medium(1.0, se, reference.chi, confidence) for se in (0.0, 1.0)
    )
    half_chi, half_total = (math.log(scaled.zeta_hi / scaled.zeta) for scaled in (exact, doubtful))
    return {
        "name": reference.name,
        "media": len(reference.media),
        "chi": exact.chi,
        "half_chi": half_chi,
        # the part of a penetration test whose standard error is as large as its alpha
        "half_test": math.sqrt(half_total**2 - half_chi**2),
        "student": float(student_quantile(confidence, reference.chi.size - 1)),
        "m0": reference.m0.tolist(),
        "scaled": reference.scaled.tolist(),
        "tables": [_profile_parameters(table, TABLE_DIGITS) for table in reference.tables],
    }


def as_json(data: Mapping[str, Any]) -> str:
    """Write JSON for the inside of a script element: no text in it can end the element."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _profile_parameters(profile: Profile, digits: int | None = None) -> dict[str, Any]:
    """Return the parameters of a profile for the kernel of the script; `digits`: significant digits of alpha, default: all."""
    if isinstance(profile, TableProfile):
        angles = {"beta": profile.beta.tolist(), "gamma": profile.gamma.tolist()}
        alpha = {"z": as_lists(profile.alpha_z, digits), "x": as_lists(profile.alpha_x, digits)}
        return {"kind": "table", **angles, **alpha, "reason": profile.reason}
    if isinstance(profile, DepthOnlyProfile):
        return {"kind": "depth_only", "values": profile.values.tolist()}
    assert isinstance(profile, FourierProfile)
    return {"kind": "fourier", "values": profile.coefficients.tolist()}


def as_lists(values: FloatArray, digits: int | None = None) -> list[Any]:
    """Turn an array into nested lists, and NaN into None; `digits`: significant digits, default: all."""
    if values.ndim > 1:
        return [as_lists(row, digits) for row in values]
    return [_round_number(float(value), digits) for value in values]


def _round_number(value: float, digits: int | None) -> float | int | None:
    """Round a number to significant digits; whole ones become int, which is shorter in JSON, and NaN None."""
    if not math.isfinite(value):
        return None
    if digits is not None:
        value = float(f"{value:.{digits}g}")
    return int(value) if value == int(value) and abs(value) < 1e6 else value


def _leg_facts(leg: Leg) -> dict[str, Any]:
    """Collect outline and sizes of a leg for the scripts; ``body``: elements (n, 5), as `rftfit.forces.outlines` has them."""
    outline = leg_outline(leg)
    facts = leg.model_dump(include={"hip_height_cm", "max_length_cm", "curvature_times_R"})
    return {"body": outline.body.tolist(), "width_cm": outline.width_cm, **facts}


def _map_cells(
    table: pd.DataFrame,
    tolerance_deg: float,
    flags: Flags | None = None,
    shared: Sequence[Remark] = (),
    runs_without_x: Collection[str] = (),
) -> dict[str, Any]:
    """Collect the cells of one medium for a map: alpha, its intervals, notes with flags and reasons.

    ``z``, ``x`` and these with ``_lo``, ``_hi``: grids (beta, gamma), N/cm^3. ``notes``: text by cell, which is named
    "row,column" of the grid. Scattered directions become an interpolated grid without intervals, and ``points`` (beta,
    gamma, alpha z, alpha x).

    `table`: Table of alpha, or of a map with a column ``reason``. `tolerance_deg`: Tolerance of angles of the
    campaign's grid. `flags`: Flags of the medium; None: no notes on them. `shared`: Flags that the page names once for
    all runs. `runs_without_x`: Runs whose force along x no sensor measured; ``unmeasured_x`` lists the cells that have
    only such runs.
    """
    notes: dict[str, str] = {}
    unmeasured_x: list[str] = []
    points = np.empty((0, 4))
    values = {}
    if lies_on_grid(table):
        for c, end in product("zx", ("", "_lo", "_hi")):
            beta_deg, gamma_deg, values[c + end] = cells_of_map(table, column(c, end))
        for row in table.to_dict("records"):
            # rows of the grid of this beta; two of +-90 degrees, which is the same plate
            lines = np.flatnonzero(np.abs(beta_apart(beta_deg, row["beta_deg"])) < SAME_LINE_DEG)
            column_index = np.abs(gamma_deg - row["gamma_deg"]).argmin()
            cells_of_row = [f"{line},{column_index}" for line in lines]
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
            no_interval = np.full(alpha.shape, np.nan)
            values |= {c: alpha, f"{c}_lo": no_interval, f"{c}_hi": no_interval}
        points = table[["beta_deg", "gamma_deg", column("z"), column("x")]].to_numpy(float)
    return {
        **{name: as_lists(grid, CURVE_DIGITS) for name, grid in values.items()},
        "beta_deg": beta_deg.tolist(),
        "gamma_deg": gamma_deg.tolist(),
        "notes": notes,
        "points": as_lists(points, CURVE_DIGITS),
        "unmeasured_x": unmeasured_x,
        "tolerance_deg": tolerance_deg,
    }


def _measured_curve(rows: pd.DataFrame) -> dict[str, Any]:
    """Collect the measured forces on a leg (N) over theta (deg), as lists."""
    rows = rows.sort_values("theta_deg")
    return {
        name: as_lists(rows[name].to_numpy(float), CURVE_DIGITS) for name in ("theta_deg", *_FORCES)
    }


def _interval_ends(rows: pd.DataFrame, digits: int) -> dict[str, Any]:
    """Collect the ends of the intervals of a predicted curve over theta; intervals without any number are left out.

    The script calculates the forces itself, and knows the usual angles `THETA_DEG`: only other angles are written.
    `rows`: Of one leg and profile.
    """
    rows = rows.sort_values("theta_deg")
    theta_deg = rows["theta_deg"].to_numpy(float)
    curve = {} if np.array_equal(theta_deg, THETA_DEG) else {"theta_deg": theta_deg.tolist()}
    names = [name for name in _ENDS if name in rows and rows[name].notna().any()]
    return curve | {name: as_lists(rows[name].to_numpy(float), digits) for name in names}
