"""Stages that test the force model, one function a rule: by legs, natural sands, published numbers.

A stage takes `Results`, the access to the tables of earlier stages, and returns the tables that its rule writes, in the
order of the rule. A leg is a curved or flat plate that turns about an axle through the medium; its force (N) is predicted
by profiles of the medium, functions alpha(beta, gamma): the measured table, the map (alpha in all directions, estimated by
the shape that known media share), nine Fourier terms, the generic profile.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from rftfit.compare.legs import (
    NOT_TESTED,
    PREDICTED_COLUMNS,
    Peaks,
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


def legs_predicted(results: Results) -> tuple[pd.DataFrame, ...]:
    """Predict the force on every leg in every medium, and compare with what was measured.

    Returns tables: the predicted curves, force over the leg's angle, with intervals; their errors against the measured
    curves; the error on other legs, and on the same leg in other media, if the model learns from one measured leg (lessons);
    then the map of each medium. The maps are returned here because some of the curves need them: another job would
    estimate them once more.
    """
    media = [results[name] for name in (*results.laboratory, *results.sands)]
    # relative error that the force model itself has on the campaign's legs; NaN without legs: then the published one counts
    error_by_legs = error_of_legs([results[name] for name in results.laboratory])
    model_error = larger_model_error(error_by_legs)
    tables_with_rows = []
    # by medium, leg, profile and component: ends of the interval of the largest force
    peaks: Peaks = {}
    for medium in media:
        table, peaks_of_medium = predicted_curves(medium, model_error)
        peaks |= peaks_of_medium
        if len(table):
            tables_with_rows.append(table)
    no_curve = pd.DataFrame(columns=PREDICTED_COLUMNS)
    curves = pd.concat(tables_with_rows or [no_curve], ignore_index=True)
    tolerance_deg = results.config.grid.angle_tolerance_deg
    # relative spread of forces from bed to bed, by medium
    spread = {medium.name: bed_spread(medium.alpha, tolerance_deg) for medium in media}
    measured = results.joined("legs/{medium}.csv")
    # by medium, leg and component: shares of the errors in the variance of the peak, and its part from flagged cells
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
"""Columns of the table of a map; what they hold stands in the dictionary of results, ``rftfit/outputs``."""


def estimated_map_rows(results: Results, medium: str) -> pd.DataFrame:
    """Estimate alpha of a medium in every direction by the shape that known media share: a row a direction.

    A direction that was pushed keeps its measured alpha (``source``). ``chance_if_it_belongs``: how often a medium of that
    shape has pushes that lie as far from it. ``horizontal``: how strong alpha_x is beside alpha_z, relative to the known
    media. Where no map can be estimated, one row says why.
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

    In a sand stress grows linearly with depth only over some depths (the linear regime), which the config may state and the
    program detects. Returns two tables: the slope over each with zeta from it (by chi, measured over fitted
    alpha_z(0, 90 deg), of the reference media, which may be the published five); and factors on the predicted forces, with
    their validation.
    """
    table = results.table("penetration.csv")
    method = results.config.fourier.method
    # remarks that numbers by the published media get
    note: tuple[Remark, ...] = ()
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
    """Add remarks to the reasons of the chosen rows of a table (default: all), but only where a row has a number.

    A row has a number where its reason is empty, or only says that the tare is missing: other reasons say why there is none.
    """
    is_noted = chosen & table["reason_code"].isin(["", "no-tare"])
    return with_reasons(table, (note if noted else () for noted in is_noted))


def validate(results: Results) -> pd.DataFrame:
    """Compare every number that the paper states with the campaign's number: the reproduction table.

    Each is an `Item`, a row: published number, ours, verdict. Numbers that differ stand first. The table has no row where no
    medium of the campaign is one of the paper's.
    """
    config = results.config
    # the paper's name of each medium of the campaign that is one of the paper's
    published_as = {
        name: medium.published_as
        for name, medium in config.media.items()
        if medium.published_as is not None
    }
    if not published_as:
        return pd.DataFrame(columns=ITEM_COLUMNS)
    tables = {medium: results[medium].alpha for medium in results.laboratory}
    # zeta and chi of each medium
    scaled = results.table("penetration.csv")
    items = compare_alpha(tables, published_as, config.grid.angle_tolerance_deg)
    items += compare_coefficients(results.table("coefficients.csv"), published_as)
    items += compare_penetration(scaled, published_as)
    predicted_legs = results.table("leg_errors.csv")
    measured_legs = results.joined("legs/{medium}.csv")
    items += leg_claims(predicted_legs, measured_legs, scaled, results.sands)
    if results.campaign.robot_medium:
        errors = results.table("robot/errors.csv")
        # measured speeds are the published ones or from tracks: without any, the robot is not the paper's
        if errors["measured_cm_per_s"].notna().any():
            tables_of_sweep = (results.table(f"robot/{name}.csv") for name in ("optimum", "speed"))
            claims = robot_claims(errors, *tables_of_sweep)
            # their numbers rest on the robot's medium
            items += [claim._replace(media=(results.campaign.robot_medium,)) for claim in claims]
    # numbers of the paper that contradict one another
    if items:
        items += discrepancies()
    # what rests on logs is measured; if these were simulated from the published numbers, it is so by construction
    evidence = BY_CONSTRUCTION if results.campaign.reenacted else MEASURED
    items = [
        item._replace(evidence=evidence) if item.evidence == FROM_LOGS else item for item in items
    ]
    items.sort(key=lambda item: (VERDICTS.index(item.verdict), EVIDENCE.index(item.evidence)))
    doubts = {
        medium: f"{medium} {format_remarks(marks)}" for medium, marks in results.marks.items()
    }
    return pd.DataFrame([item.row(doubts) for item in items], columns=ITEM_COLUMNS)
