"""Numbers of a run as captions tell them: plain text, empty where nothing is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.figures.style import format_number
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.errors import (
    AS_PREPARED,
    ASSUMED,
    FEW_REPEATS,
    OF_CELL,
    REPEATS,
    STATED,
    USUAL_BED_SPREAD,
    half_width_of_bed,
)
from rftfit.measure.flags import codes_of
from rftfit.measure.verdict_words import UNUSABLE
from rftfit.model.profiles import EPS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from typing import Any

    import pandas as pd

    from rftfit.results import Results

PROFILES = {
    "table": "measured table",
    "map": "map",
    "fourier": "nine-term fit",
    "generic": "generic \N{MULTIPLICATION SIGN} \N{GREEK SMALL LETTER ZETA}",
    "depth_only": "depth-only",
}
"""Names of the profiles for people, in the order in which figures and page show them."""

LEGS = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}


def name_of(key: str) -> str:
    """Name of a profile or of a leg for people."""
    return (PROFILES | LEGS).get(key, key)


def percent(value: float | None) -> str:
    """Write a percentage with its sign."""
    if value is None or not math.isfinite(value):
        return "no value"
    digits = 0 if abs(value) >= 10 else 1
    if float(format_number(abs(value), 0)) == WITHIN_PERCENT != abs(value):
        digits = 1  # on which side of the limit it lies
    text = format_number(value, digits)
    return f"+{text} %" if value > 0 and float(text) > 0 else f"{text} %"


def format_interval(low: float | None, high: float | None, digits: int = 3) -> str:
    """Write an interval with the digits that its width needs; nothing where an end or the width is missing."""
    if low is None or high is None or not math.isfinite(high - low) or low == high:
        return ""
    while (ends := (format_number(low, digits), format_number(high, digits)))[0] == ends[1]:
        digits += 1
    return " to ".join(ends)


def in_brackets(text: str) -> str:
    """Write what follows a number in brackets, nothing where there is nothing."""
    return f" ({text})" if text else ""


def name_of_mean(cell: Mapping[Any, Any]) -> str:
    """Name the interval of alpha of a cell by whether it holds how beds differ."""
    return "without scatter between beds" if cell["spread"] == AS_PREPARED else "mean of beds"


def beds_of_intervals(results: Results, media: Iterable[str]) -> str:
    """Say what the intervals of alpha, zeta and chi are of, and in which of the media they hold no scatter between beds."""
    cells = {name: cell_at(results[name].alpha, 0.0, 90.0) for name in media}
    without = [
        results.titles[name]
        for name, cell in cells.items()
        if cell is not None and cell["spread"] == AS_PREPARED
    ]
    if len(without) == len(cells):
        return name_of_mean({"spread": AS_PREPARED})
    beds = f"of the {name_of_mean({'spread': ''})}"
    if without:
        return f"{beds}, in {', '.join(without)} {name_of_mean({'spread': AS_PREPARED})}"
    return beds


NAMES_OF_ERRORS = {
    "surface_run_mm": "surface from run to run",
    "surface_session_mm": "surface of all runs",
    "angle_deg": "angles",
    "turn_deg": "turn of the mount",
    "tare_percent": "force on the rod",
    "hip_cm": "height of the axle",
    "arc_percent": "arc of the legs",
}
"""Words for the errors of section `errors` of the config, by key; `name_of_mean` has the scatter between beds."""


def errors_stated_as_zero(results: Results) -> list[str]:
    """Keys of `NAMES_OF_ERRORS` that the config states as 0, so that no interval holds them; none that is a default.

    Nothing where alpha has no interval. A table of stress or alpha has no errors but those of the legs.
    """
    if results.joined("alpha/{medium}.csv")["alpha_z_se_N_per_cm3"].isna().all():
        return []
    errors = results.config.errors
    of_legs = {"hip_cm", "arc_percent"}
    stated = {key for key in errors.model_fields_set if getattr(errors, key) == 0}
    if not results.config.legs:
        stated -= of_legs
    if results.config.table is not None:
        stated &= of_legs
    return [key for key in NAMES_OF_ERRORS if key in stated]


def names_of_zero_errors(results: Results) -> str:
    """Name the errors that the config states as 0, with commas; empty where it states none."""
    return ", ".join(NAMES_OF_ERRORS[key] for key in errors_stated_as_zero(results))


_SCATTER_OF_BEDS = {
    REPEATS: "with the scatter of repeats",
    OF_CELL: "with the scatter of the repeats of this direction",
    FEW_REPEATS: f"with the scatter of few repeats and an assumed one of {100 * USUAL_BED_SPREAD:g} %",
    STATED: "with the stated scatter",
    ASSUMED: f"with an assumed scatter of {100 * USUAL_BED_SPREAD:g} %",
}
"""Words for where the scatter between beds is known from."""


def scatter_of_beds(cell: Mapping[Any, Any], confidence: float) -> str:
    """Say where the scatter of the interval of the next bed is from; empty where that interval adds none."""
    if cell["spread"] != AS_PREPARED:
        return _SCATTER_OF_BEDS.get(str(cell["spread"]), "")
    alpha, high, high_next = (float(cell[column("z", end)]) for end in ("", "_hi", "_hi_next"))
    added_square = (high_next - alpha) ** 2 - (high - alpha) ** 2
    # runs behind each row of a table hold their beds: then nothing is assumed
    assumed = 0.99 * half_width_of_bed(USUAL_BED_SPREAD, confidence) * abs(alpha)
    return _SCATTER_OF_BEDS[ASSUMED] if added_square >= assumed**2 else ""


def is_chosen_on_these_legs(results: Results) -> bool:
    """Whether the model's own error was chosen on the same forces on laboratory legs that this campaign compares."""
    return results.model_error != EPS or results.campaign.reenacted


def explanation_of(row: Mapping[str, Any], *, chosen_on_these_legs: bool = False) -> str:
    """Say whether the errors of alpha, or the model's own, explain an error of a peak; empty where its interval is unknown.

    `row`: of ``results/leg_errors.csv``. `chosen_on_these_legs`: `is_chosen_on_these_legs`.
    """

    def includes_zero(ends: str) -> bool | None:
        low, high = (row[f"peak_error{ends}_{end}_percent"] for end in ("lo", "hi"))
        return low <= 0 <= high if format_interval(low, high, 0) else None

    of_alpha, of_model = includes_zero(""), includes_zero("_model")
    if of_alpha:
        return "within the errors of alpha, axle and arc"
    if of_model:
        beyond_alpha = (
            "larger than the errors of alpha, axle and arc explain; " if of_alpha is False else ""
        )
        if chosen_on_these_legs:
            return (
                f"{beyond_alpha}within the model's own error, which was chosen on these same legs"
            )
        return f"{beyond_alpha}within the error of the model on other legs"
    if of_model is False:
        return "larger than the errors of alpha, axle, arc and model explain"
    return "larger than the errors of alpha, axle and arc explain" if of_alpha is False else ""


def alpha_half_width(table: pd.DataFrame, component: str, suffix: str = "") -> pd.Series[float]:
    """Half the width of the interval of alpha_z or alpha_x, N/cm^3; `suffix`: ``_next`` for that of the next push."""
    high = table[column(component, f"_hi{suffix}")].astype(float)
    return (high - table[column(component, f"_lo{suffix}")].astype(float)) / 2


def usable_media(results: Results, media: Iterable[str]) -> list[str]:
    """Those of the media that fail no check that makes them unusable."""
    marks = {name: codes_of(results.marks.get(name, ())) for name in media}
    return [name for name, codes in marks.items() if UNUSABLE not in codes.split()]


def tared(results: Results, runs: pd.DataFrame) -> bool:
    """Whether a tare was taken off any of the runs of a table."""
    with_tare = {run.run_id for run in results.campaign.runs if run.tare_run}
    return bool(with_tare.intersection(runs["run_id"]) - without_tare(results))


def without_tare(results: Results) -> set[str]:
    """Runs of all media from which no tare was taken off."""
    return {run_id for medium in results for run_id in medium.flags.runs_with("no-tare")}


def predicted_by(results: Results) -> dict[str, list[str]]:
    """Media in which each profile gave a whole curve of the force on a leg."""
    table = results.table("predicted.csv")
    curve_groups = (
        table["force_z_N"].notna().groupby([table[n] for n in ("profile", "medium", "leg")])
    )
    whole_curves = curve_groups.all().loc[lambda is_whole: is_whole].index.to_frame(index=False)
    return {
        str(n): list(dict.fromkeys(rows["medium"])) for n, rows in whole_curves.groupby("profile")
    }


def lift_errors(results: Results, media: Iterable[str]) -> pd.DataFrame:
    """How far predicted lift is from measured lift in some media, a row a leg and profile."""
    table = results.table("leg_errors.csv")
    return table[table["medium"].isin(list(media)) & (table["component"] == "z")]


def pushes_of_sands(results: Results) -> str:
    """Write what is known of each natural sand that was pushed."""
    alpha_tables = (
        results[name].alpha.dropna(subset="alpha_z_N_per_cm3") for name in results.sands
    )
    places = {(*table["beta_deg"], *table["gamma_deg"]) for table in alpha_tables if len(table)}
    return "one push straight down" if places == {(0, 90)} else "a few pushes"


def of_method(results: Results, name: str) -> pd.DataFrame:
    """Rows of a table of fits by the configured method."""
    table = results.table(name)
    return table[table["method"] == results.config.fourier.method]
