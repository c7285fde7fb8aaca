"""The tables of the page: each a list of rows of ready text, for the template."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.figures.style import number
from rftfit.measure.ledger import DROPPED, USED, RowStatus
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import PRINTED_NOTE, routines

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from rftfit.page.page import PageInputs


# --- Numbers, names and intervals as the page prints them.


PROFILES = {
    "table": "measured table",
    "fourier": "nine terms",
    "generic": "zeta \N{MULTIPLICATION SIGN} generic",
    "depth_only": "depth-only",
}
"""Names of the profiles for people."""

LEGS = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}


def leg_name(leg: str) -> str:
    """Name of a leg for people.

    `leg`: Key of the configuration.
    """
    return LEGS.get(leg, leg)


def profile_name(profile: str) -> str:
    """Name of a profile for people."""
    return PROFILES.get(profile, profile)


def value(x: object, digits: int = 3) -> str:
    """Write a number, "no value" where it is missing.

    `x`: A number, or None. `digits`: After the point.
    """
    return number(as_float(x), digits)


def span(lo: object, hi: object, digits: int = 3) -> str:
    """Write an interval, nothing where either end is missing."""
    ends = as_float(lo), as_float(hi)
    if not all(math.isfinite(end) for end in ends):
        return ""
    return f"{number(ends[0], digits)} to {number(ends[1], digits)}"


def percent(x: object) -> str:
    """Write a signed percentage."""
    found = as_float(x)
    if not math.isfinite(found):
        return "no value"
    text = number(found, 0 if abs(found) >= 10 else 1)
    return f"+{text} %" if found > 0 and float(f"{found:.1f}") > 0 else f"{text} %"


def as_float(x: object) -> float:
    """Turn a cell of a table into a number, NaN where it is none."""
    try:
        return float(x)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return math.nan


def text(x: object) -> str:
    """Turn a cell of a table into text, an empty one into nothing."""
    if x is None or (isinstance(x, float) and math.isnan(x)):
        return ""
    return str(x)


# --- Which runs were used and which were dropped, and why; and the doubts about those in use.


_USED_AS = {
    "plate": "slope",
    "leg": "leg curve",
    "rod": "tare",
    "leg_air": "tare",
    "robot": "mean speed",
}
_ROUTINE = {
    why.text
    for why in RowStatus
    if why not in (RowStatus.GOOD, RowStatus.SATURATED, RowStatus.MOTION_GAP)
}  # fmt: skip
# what is worst first; each is a part of the text that the ingest and slope stages write
_SEVERITY = (
    "saturated",
    "motion log begins or ends",
    "lacks",
    "cut in mid-row",
    "gap",
    "time runs backwards",
    "NaN or infinite",
    "duplicated",
    " depths",
    "not linear",
    "zero drifted",
)


@dataclass(frozen=True)
class Dropped:
    """A run that gave no result.

    `reasons`: All that the ledger says, joined.
    `rows`: Rows of its logs.
    """

    run_id: str
    medium: str
    kind: str
    reasons: str
    rows: int


def run_fates(ledger: pd.DataFrame) -> tuple[dict[str, int], list[Dropped]]:
    """Tell used runs from dropped ones.

    A run is used when at least one row of it went into what runs of its kind are for: a slope, a
    leg curve, a tare.

    Returns `used`: Number of used runs by medium ("" for those in air, which serve all media).
    Returns `dropped`: In the order of their names.
    """
    used: dict[str, int] = {}
    dropped: list[Dropped] = []
    if ledger.empty:
        return used, dropped
    wanted = ledger["kind"].map(_USED_AS)
    good = ledger[(ledger["fate"] == USED) & (ledger["reason"] == wanted) & (ledger["rows"] > 0)]
    good_runs = set(good["run_id"])
    for run_id, rows in ledger.groupby("run_id", sort=True):
        medium, kind = _text(rows["medium"].iloc[0]), str(rows["kind"].iloc[0])
        if run_id in good_runs:
            used[medium] = used.get(medium, 0) + 1
            continue
        reasons = list(dict.fromkeys(rows.loc[rows["fate"] == DROPPED, "reason"].map(str)))
        special = [reason for reason in reasons if reason not in _ROUTINE]
        why = "; ".join(special or reasons) or "no row was used; the ledger gives no reason"
        dropped.append(Dropped(str(run_id), medium, kind, why, int(rows["rows"].sum())))
    return used, dropped


def row_fates(ledger: pd.DataFrame) -> list[dict[str, object]]:
    """Add up the rows of all logs by fate and reason; reasons that name one run are put together.

    Returns ``fate, reason, runs, rows``, the largest number of rows first within each fate.
    """
    if ledger.empty:
        return []
    known = _ROUTINE | {RowStatus.SATURATED.text, RowStatus.MOTION_GAP.text}
    rest = (ledger["fate"] == DROPPED) & ~ledger["reason"].isin(known)
    # a note about the clocks may follow what the rows were used for
    short = ledger["reason"].str.split(";").str[0].mask(rest, "the whole run, or damaged rows")
    table = ledger.assign(reason=short).groupby(["fate", "reason"])
    sums = table.agg(runs=("run_id", "nunique"), rows=("rows", "sum")).reset_index()
    sums = sums.sort_values(["fate", "rows"], ascending=[False, False])
    return [{str(key): cell for key, cell in row.items()} for row in sums.to_dict("records")]


def worst_flag(inputs: PageInputs, medium: str) -> tuple[str, int]:
    """Find the gravest doubt about what is in use of one medium.

    Returns `flag`: Empty if there is none. Returns `count`: How many runs and cells have a flag.
    """
    flags: list[str] = []
    for table in (inputs.runs, inputs.fits):
        if not table.empty:
            own = table[table["medium"] == medium]
            flags += [
                f"{r}: {f}" for r, f in zip(own["run_id"], own["flags"], strict=True) if _text(f)
            ]
    alpha = inputs.alpha[medium]
    flags += [flag for flag in alpha["flags"].map(_text) if flag and ":" not in flag]
    if inputs.config.media[medium].role == "laboratory":
        empty = int(alpha["alpha_z_N_per_cm3"].isna().sum())
        if empty:
            return f"{empty} of {len(alpha)} cells have no alpha", len(flags) + empty
    if not flags:
        return "", 0
    return min(flags, key=_rank), len({flag.split(":")[0] for flag in flags})


def _rank(flag: str) -> int:
    return next((i for i, part in enumerate(_SEVERITY) if part in flag), len(_SEVERITY))


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


# --- The tables of the page: each a list of rows of ready text, for the template.


Row = dict[Any, Any]

VERDICTS = ("same", "differs", "paper inconsistent")


def summary(inputs: PageInputs) -> list[Row]:
    """One row per medium: what a reader wants to know first.

    Returns ``title, role, used, dropped, zeta, chi, peaks, flag, flags``; `peaks` maps a leg to
    the error of its peak lift by the best profile there is (table, else generic).
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

    Returns ``method, media`` (titles)`, rows`: each with `term` and `cells` (value, span, kept).
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
    """Penetration, zeta and chi of every medium by every method, the configured one first."""
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
    """Peak and shape errors of every leg, medium and profile."""
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
    """Penetration of the natural sands, by the stated and by the detected linear regime."""
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
    """Factors on the predicted force in natural sands, and whether they earn their place."""
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

    Returns ``rows``, ``others`` (not the same) and ``counts`` by verdict.
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
