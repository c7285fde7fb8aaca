"""The tables of the page: each a list of rows of ready text, for the template."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rftfit.profile.fourier import TERMS
from rftfit.profile.reference_media import PRINTED_NOTE, routines
from rftfit.report.page.fates import run_fates, worst_flag
from rftfit.report.page.words import (
    PROFILES,
    as_float,
    leg_name,
    percent,
    profile_name,
    span,
    text,
    value,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from rftfit.report.page.inputs import PageInputs

Row = dict[Any, Any]

VERDICTS = ("same", "differs", "paper inconsistent")


def summary(inputs: PageInputs) -> list[Row]:
    """One row per medium: what a reader wants to know first.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of dict
        ``title, role, used, dropped, zeta, chi, peaks, flag, flags``; `peaks` maps a leg to the
        error of its peak lift by the best profile there is (table, else generic).
    """
    used, dropped = run_fates(inputs.ledger)
    rows = []
    for medium in inputs.media:
        own = _scaling_row(inputs, medium)
        flag, count = worst_flag(inputs, medium)
        laboratory = inputs.config.media[medium].role == "laboratory"
        rows.append(
            {
                "key": medium,
                "title": inputs.titles[medium],
                "role": "laboratory" if laboratory else "natural sand",
                "used": used.get(medium, 0),
                "dropped": sum(run.medium == medium for run in dropped),
                "zeta": _with_span(own, "zeta"),
                "chi": _with_span(own, "chi"),
                "reason": text(own.get("reason")),
                "profile": profile_name("table" if laboratory else "generic"),
                "peaks": _peak_errors(inputs, medium, "table" if laboratory else "generic"),
                "flag": flag,
                "flags": count,
            }
        )
    return rows


def coefficient_table(inputs: PageInputs, method: str) -> Row:
    """Coefficients of all media by one method, terms downward.

    Parameters
    ----------
    inputs : PageInputs
    method : str

    Returns
    -------
    dict
        ``method, media`` (titles)`, rows`: each with `term` and `cells` (value, span, kept).
    """
    table = inputs.coefficients[inputs.coefficients["method"] == method]
    media = list(dict.fromkeys(table["medium"]))
    cells = {(row["medium"], row["coefficient"]): row for row in table.to_dict("records")}
    rows = [
        {"term": term, "cells": [_coefficient(cells.get((m, term), {})) for m in media]}
        for term in TERMS
    ]
    names = [inputs.titles.get(m, "generic, no unit" if m == "generic" else m) for m in media]
    return {"method": method, "media": names, "rows": rows}


def scaling(inputs: PageInputs) -> list[Row]:
    """Penetration, zeta and chi of every medium by every method, the configured one first.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of dict
    """
    method = inputs.config.fourier.method
    return [
        {
            "method": text(row["method"]),
            "first": row["method"] in (method, *routines(method)),
            "title": inputs.titles.get(str(row["medium"]), text(row["medium"])),
            "measured": _with_span(row, "alpha_z_measured", "_N_per_cm3"),
            "fit": (
                {"value": "not fitted: one test only", "span": ""}
                if text(row["method"]).startswith("scaling routine")
                else _with_span(row, "alpha_z_fit", "_N_per_cm3")
            ),
            "chi": _with_span(row, "chi"),
            "zeta": _with_span(row, "zeta"),
            "reason": text(row.get("reason")),
        }
        for row in inputs.penetration.to_dict("records")
    ]


def leg_table(inputs: PageInputs) -> list[Row]:
    """Peak and shape errors of every leg, medium and profile.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of dict
    """
    return [
        {
            "title": inputs.titles.get(str(row["medium"]), text(row["medium"])),
            "leg": leg_name(str(row["leg"])),
            "profile": profile_name(str(row["profile"])),
            "component": f"F_{row['component']}",
            "measured": value(row["peak_measured_N"], 2),
            "predicted": value(row["peak_predicted_N"], 2),
            "span": span(row["peak_predicted_lo_N"], row["peak_predicted_hi_N"], 2),
            "error": percent(row["peak_error_percent"]),
            "rms": value(row["rms_error_N"], 2),
            "relative": percent(100 * as_float(row["rms_relative_to_peak"])).lstrip("+"),
            "r2": value(row["r2"], 2),
            # what the section on scaling says once for all
            "reason": text(row.get("reason")).replace(PRINTED_NOTE, ""),
        }
        for row in sorted(inputs.leg_errors.to_dict("records"), key=_leg_order(inputs))
    ]


def sand_table(inputs: PageInputs) -> list[Row]:
    """Penetration of the natural sands, by the stated and by the detected linear regime.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of dict
    """
    return [
        {
            "title": inputs.titles.get(str(row["medium"]), text(row["medium"])),
            "window": text(row["window"]),
            "to": value(row["linear_to_cm"], 2),
            "alpha": _value_span(row["alpha_z_N_per_cm3"], row.get("lo"), row.get("hi")),
            "bend": percent(100 * as_float(row.get("bend"))),
            "zeta": _value_span(row["zeta"], row["zeta_lo"], row["zeta_hi"]),
            "reason": text(row.get("reason")),
        }
        for row in inputs.sands.to_dict("records")
    ]


def correction_table(inputs: PageInputs) -> list[Row]:
    """Factors on the predicted force in natural sands, and whether they earn their place.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of dict
    """
    return [
        {
            "title": inputs.titles.get(str(row["medium"]), text(row["medium"])),
            "model": text(row["model"]),
            "factor_z": value(row["factor_z"], 2),
            "factor_x": value(row["factor_x"], 2),
            "fit": value(row["rms_fit_N"], 2),
            "cv": value(row["rms_cv_N"], 2),
            "gain": percent(row["gain_cv_percent"]),
            "earns": "yes" if str(row["earns_its_place"]).strip().lower() == "true" else "no",
        }
        for row in inputs.sand_correction.to_dict("records")
    ]


def reproduction(table: pd.DataFrame) -> Row:
    """Ours beside the paper's, those that are not the same first.

    Parameters
    ----------
    table : pandas.DataFrame

    Returns
    -------
    dict
        ``rows``, ``others`` (not the same) and ``counts`` by verdict.
    """
    rows = [
        {
            "item": text(row["item"]),
            "where": text(row["where"]),
            "paper": _short(row["paper"]),
            "ours": _short(row["ours"]),
            "span": _span_short(row["lo"], row["hi"]),
            "verdict": text(row["verdict"]),
            "why": text(row["why"]),
        }
        for row in table.to_dict("records")
    ]
    counts: dict[str, int] = dict.fromkeys(VERDICTS, 0)
    for found in rows:
        counts[found["verdict"]] = counts.get(found["verdict"], 0) + 1
    others = [found for found in rows if found["verdict"] != "same"]
    return {"rows": rows, "others": others, "counts": counts}


def _leg_order(inputs: PageInputs) -> Callable[[Row], tuple[int, int, int, bool]]:
    media, legs, profiles = list(inputs.config.media), list(inputs.config.intruders), list(PROFILES)

    def place(name: object, names: list[str]) -> int:
        return names.index(str(name)) if name in names else len(names)

    def key(row: Row) -> tuple[int, int, int, bool]:
        return (
            place(row["medium"], media),
            place(row["leg"], legs),
            place(row["profile"], profiles),
            row["component"] != "z",
        )

    return key


def _scaling_row(inputs: PageInputs, medium: str) -> Row:
    method = inputs.config.fourier.method
    table = inputs.penetration[inputs.penetration["medium"] == medium]
    rows = table[table["method"].isin([method, *routines(method)])]
    return dict(rows.iloc[0]) if len(rows) else {}


def _peak_errors(inputs: PageInputs, medium: str, profile: str) -> dict[str, str]:
    errors = inputs.leg_errors
    if errors.empty:
        return {}
    here = (errors["medium"] == medium) & (errors["profile"] == profile)
    rows = errors[here & (errors["component"] == "z")]
    return {
        leg: percent(error)
        for leg, error in zip(rows["leg"], rows["peak_error_percent"], strict=True)
    }


def _coefficient(row: Row) -> Row:
    kept = str(row.get("kept", "True")).strip().lower() != "false"
    return {
        "value": value(row.get("value_N_per_cm3"), 4),
        "span": span(row.get("lo"), row.get("hi"), 4),
        "kept": kept,
        "reason": text(row.get("reason")),
    }


def _with_span(row: Row, name: str, unit: str = "") -> Row:
    return _value_span(
        row.get(f"{name}{unit}"), row.get(f"{name}_lo{unit}"), row.get(f"{name}_hi{unit}")
    )


def _value_span(middle: object, lo: object, hi: object) -> Row:
    return {"value": value(middle, 4), "span": span(lo, hi, 4)}


def _short(x: object) -> str:
    found = as_float(x)
    if math.isnan(found):
        return text(x)
    return f"{found:.4g}".replace("-", "\N{MINUS SIGN}")


def _span_short(lo: object, hi: object) -> str:
    ends = _short(lo), _short(hi)
    return f"{ends[0]} to {ends[1]}" if all(ends) else ""
