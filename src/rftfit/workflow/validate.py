"""Stages that test the force model: by legs, natural sands, published numbers."""

from __future__ import annotations

from typing import Any

import pandas as pd

from rftfit.compare.legs import (
    NOT_TESTED,
    PREDICTED_COLUMNS,
    error_of_legs,
    errors_of_peaks,
    leg_errors,
    predicted_curves,
)
from rftfit.compare.lessons import lesson_rows
from rftfit.compare.published import (
    BY_CONSTRUCTION,
    EVIDENCE,
    FROM_LOGS,
    ITEM_COLUMNS,
    MEASURED,
    VERDICTS,
    compare_alpha,
    compare_coefficients,
    compare_penetration,
    discrepancies,
    leg_claims,
)
from rftfit.compare.robot import robot_claims
from rftfit.compare.sands import SAND_COLUMNS, fit_corrections, penetration_rows
from rftfit.errors import InputError
from rftfit.forces.model_error import larger_model_error
from rftfit.measure.alpha import bed_spread, column
from rftfit.measure.flags import (
    MARKS,
    REASON,
    Remark,
    format_remarks,
    mark_columns,
    quoted,
    reason_columns,
    with_reasons,
)
from rftfit.model.scaling import published, routine
from rftfit.results import Results

MAP_COLUMNS = [
    "medium",
    "beta_deg",
    "gamma_deg",
    *(column(c, end) for c in "zx" for end in ("", "_lo", "_hi", "_lo_next", "_hi_next")),
    "source",
    "known_media",
    "chance_if_it_belongs",
    "horizontal",
    *MARKS,
    *REASON,
]


def legs_predicted(results: Results) -> tuple[pd.DataFrame, ...]:
    """Predict the force on every leg in every medium, and compare with what was measured.

    Returns tables: the predicted curves with intervals; their errors against the measured curves; the error on other
    legs, and on the same leg in other media, if the model learns from one measured leg (lessons); then the map of each
    medium. The maps are returned here because some of the curves need them: another job would estimate them once more.
    """
    media = [results[name] for name in (*results.laboratory, *results.sands)]
    error_by_legs = error_of_legs([results[name] for name in results.laboratory])
    model_error = larger_model_error(error_by_legs)
    predictions = [predicted_curves(medium, model_error) for medium in media]
    tables_with_rows = [table for table, _ in predictions if len(table)]
    peaks = {
        key: peak for _, peaks_of_medium in predictions for key, peak in peaks_of_medium.items()
    }
    no_curve = pd.DataFrame(columns=PREDICTED_COLUMNS)
    curves = pd.concat(tables_with_rows or [no_curve], ignore_index=True)
    tolerance_deg = results.config.grid.angle_tolerance_deg
    spread = {medium.name: bed_spread(medium.alpha, tolerance_deg) for medium in media}
    measured = results.joined("legs/{medium}.csv")
    errors_of_measured_peaks = {
        (medium.name, *key): errors
        for medium in media
        for key, errors in errors_of_peaks(medium).items()
    }
    level = results.config.fit.confidence
    flags = {medium.name: medium.flags for medium in results}
    compared = leg_errors(
        measured, curves, spread, level, errors_of_measured_peaks, peaks, error_by_legs, flags
    )
    # the map of a medium cannot be tested by a leg whose force it was estimated from
    taught = (compared["profile"] == "map") & compared["leg"].isin(results.config.maps.use_legs)
    compared.loc[taught, "verdict"] = NOT_TESTED
    # a generic curve may be made from the published media: its errors get the same note
    is_generic = compared["medium"].isin(results.sands) & (compared["profile"] == "generic")
    note = results.reference().remarks if is_generic.any() else ()
    compared = _add_note(compared, note, is_generic)
    lessons = lesson_rows(results, model_error)
    tables = [results.marked(table) for table in (curves, compared, lessons)]
    return (*tables, *(estimated_map_rows(results, medium.name) for medium in media))


def estimated_map_rows(results: Results, medium: str) -> pd.DataFrame:
    """Estimate alpha of a medium in every direction by the shape that known media share: a row a direction.

    A direction that was pushed keeps its measured alpha. Where no map can be estimated, one row says why.
    """
    columns: dict[str, Any] = {"medium": medium} | mark_columns(results.marks.get(medium, ()))
    try:
        estimated = results[medium].map()
        table = estimated.table()
    except InputError as error:
        row = columns | reason_columns([quoted(error, "no-map")])
        return pd.DataFrame([row], columns=MAP_COLUMNS)
    columns |= {"known_media": estimated.known_media, "chance_if_it_belongs": estimated.belongs}
    columns |= {"horizontal": estimated.horizontal} | reason_columns([])
    return table.assign(**columns)[MAP_COLUMNS]


def natural_sands(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Fit the penetration tests of the natural sands, and try corrections of their predicted forces.

    Returns two tables: slopes over the stated and the detected linear regime with zeta from each (by chi of the reference
    media, which may be the published five), and the corrections with their validation.
    """
    table = results.table("penetration.csv")
    method, note = results.config.fourier.method, tuple[Remark, ...]()
    chi = table.loc[table["method"] == method, "chi"].dropna().to_numpy(float)
    if (table["method"] == routine(method, printed=True)).any():
        chi, note = published(method).chi, published(method).remarks
    rows = []
    for medium in results.sands:
        tables = {name: results.table(f"{name}/{medium}.csv") for name in ("runs", "tares", "fits")}
        tables["tared"] = results.table(f"tared/{medium}.parquet")
        tables["alpha"] = results[medium].alpha
        rows += penetration_rows(results.campaign, medium, tables, chi)
    tests = pd.DataFrame(rows, columns=SAND_COLUMNS)
    tests = _add_note(tests, note)
    curves = results.table("predicted.csv")
    measured = results.joined("legs/{medium}.csv", results.sands)
    corrections = fit_corrections(measured, curves[curves["profile"] == "generic"])
    return results.marked(tests), results.marked(corrections)


def _add_note(
    table: pd.DataFrame, note: tuple[Remark, ...], chosen: pd.Series[bool] | bool = True
) -> pd.DataFrame:
    """Add remarks to the chosen rows of a table (default: all), but only where a row has a number.

    A row has a number where it has no reason, or the reason alone that the tare is missing.
    """
    is_noted = chosen & table["reason_code"].isin(["", "no-tare"])
    return with_reasons(table, (note if noted else () for noted in is_noted))


def validate(results: Results) -> pd.DataFrame:
    """Compare every number that the paper states with the campaign's number: the reproduction table.

    Numbers that differ stand first. The table has no row where no medium of the campaign is one of the paper's.
    """
    config = results.config
    published_as = {
        name: medium.published_as
        for name, medium in config.media.items()
        if medium.published_as is not None
    }
    if not published_as:
        return pd.DataFrame(columns=ITEM_COLUMNS)
    tables = {medium: results[medium].alpha for medium in results.laboratory}
    scaled = results.table("penetration.csv")
    items = compare_alpha(tables, published_as, config.grid.angle_tolerance_deg)
    items += compare_coefficients(results.table("coefficients.csv"), published_as)
    items += compare_penetration(scaled, published_as)
    legs = results.table("leg_errors.csv"), results.joined("legs/{medium}.csv")
    items += leg_claims(*legs, scaled, results.sands)
    if results.campaign.robot_medium:
        names = ("errors", "optimum", "speed")
        errors, *sweep_tables = (results.table(f"robot/{name}.csv") for name in names)
        # measured speeds are the published ones or from tracks: without any, the robot is not the paper's
        if errors["measured_cm_per_s"].notna().any():
            claims = robot_claims(errors, *sweep_tables)
            items += [claim._replace(media=(results.campaign.robot_medium,)) for claim in claims]
    if items:
        items += discrepancies()
    # logs that were simulated from the published numbers prove nothing about sand
    evidence = BY_CONSTRUCTION if results.campaign.reenacted else MEASURED
    items = [
        item._replace(evidence=evidence) if item.evidence == FROM_LOGS else item for item in items
    ]
    items.sort(key=lambda item: (VERDICTS.index(item.verdict), EVIDENCE.index(item.evidence)))
    doubts = {
        medium: f"{medium} {format_remarks(marks)}" for medium, marks in results.marks.items()
    }
    return pd.DataFrame([item.row(doubts) for item in items], columns=ITEM_COLUMNS)
