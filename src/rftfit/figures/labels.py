"""How captions and page write percentages, intervals, and names of profiles, legs and errors, as plain text.

Two intervals of alpha stand in the tables: ``_lo``, ``_hi`` for the mean of many beds prepared alike, and ``_lo_next``,
``_hi_next`` for one further bed. Where the config states that beds do not scatter, the first does not hold this
scatter. A cell is a row of the table of alpha, one direction (beta, gamma) of a medium.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction). `column("z", "_lo")` is the name
``alpha_z_lo_N_per_cm3``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.figures.style import format_number
from rftfit.measure.alpha import cell_down, column
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
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any

    import pandas as pd

    from rftfit.results import Results

PROFILE_NAMES = {
    "table": "measured table",
    "map": "map",
    "fourier": "nine-term fit",
    "generic": "generic \N{MULTIPLICATION SIGN} \N{GREEK SMALL LETTER ZETA}",
    "depth_only": "depth-only",
}
"""Names of the profiles (ways to get alpha in all directions) for people, in the order in which they are shown."""

LEG_NAMES = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}
"""Names of the paper's legs for people."""


def name_of(key: str) -> str:
    """Return the name of a profile or of a leg for people; a key without name stays as it is."""
    return (PROFILE_NAMES | LEG_NAMES).get(key, key)


def percent(value: float | None) -> str:
    """Write a percentage with its sign and about two digits; enough digits to see on which side of the limit it lies.

    The limit is `WITHIN_PERCENT`, the largest error that the paper states for a peak. "no value" for None, NaN or
    infinity.
    """
    if value is None or not math.isfinite(value):
        return "no value"
    digits = 0 if abs(value) >= 10 else 1
    # a number that would be rounded to the limit `WITHIN_PERCENT` keeps a digit
    if float(format_number(abs(value), 0)) == WITHIN_PERCENT != abs(value):
        digits = 1
    number = format_number(value, digits)
    return f"+{number} %" if value > 0 and float(number) > 0 else f"{number} %"


def format_interval(low: float | None, high: float | None, digits: int = 3) -> str:
    """Write an interval as "low to high"; empty where an end is missing (None, NaN, infinite) or both are equal.

    `digits`: Digits after the point, at least; more where the ends would else be written alike.
    """
    if low is None or high is None or not math.isfinite(high - low) or low == high:
        return ""
    while (ends := (format_number(low, digits), format_number(high, digits)))[0] == ends[1]:
        digits += 1
    return " to ".join(ends)


def in_brackets(text: str) -> str:
    """Write a text in brackets behind a space; empty where the text is empty."""
    return f" ({text})" if text else ""


_MEAN_OF_BEDS, _ONE_BED = "mean of beds", "without scatter between beds"
"""What the interval of alpha is of: of many beds; or, where the config states no scatter between beds, without it."""


def name_of_mean(cell: Mapping[Any, Any]) -> str:
    """Say whether the interval of alpha of a cell, a row of the table of alpha, holds the scatter between beds.

    Column ``spread`` names the source of that scatter; `AS_PREPARED`: the config states that none is included.
    """
    return _ONE_BED if cell["spread"] == AS_PREPARED else _MEAN_OF_BEDS


def cell_straight_down(results: Results, medium: str) -> pd.Series[Any] | None:
    """Return the row of the table of alpha of a flat push straight down; None where there was none."""
    return cell_down(results[medium].alpha, results.config.grid.angle_tolerance_deg)


def beds_of_intervals(results: Results, media: Sequence[str]) -> str:
    """Say whether the intervals of alpha, zeta and chi hold the scatter between beds, and in which of `media` they do not.

    The cell of the flat push straight down decides, on which chi rests; a medium without it counts as holding the
    scatter.
    """
    titles_of_one_bed = []
    for name in media:
        cell = cell_straight_down(results, name)
        if cell is not None and cell["spread"] == AS_PREPARED:
            titles_of_one_bed.append(results.titles[name])
    if len(titles_of_one_bed) == len(media):
        return _ONE_BED
    exceptions = f", in {', '.join(titles_of_one_bed)} {_ONE_BED}" if titles_of_one_bed else ""
    return f"of the {_MEAN_OF_BEDS}{exceptions}"


NAMES_OF_ERRORS = {
    "surface_run_mm": "surface from run to run",
    "surface_session_mm": "surface of all runs",
    "angle_deg": "angles",
    "turn_deg": "turn of the mount",
    "tare_percent": "force on the rod",
    "hip_cm": "height of the axle",
    "arc_percent": "arc of the legs",
}
"""Names of the errors in section `errors` of the config, by key; `name_of_mean` names the scatter between beds."""


def names_of_zero_errors(results: Results) -> str:
    """Name the errors that the config itself sets to 0, so that no interval holds them, with commas between.

    Empty where there are none, and where alpha has no interval at all. In a campaign that gives a table of stress or
    alpha instead of logs only the errors of legs count: the others were made before the table.
    """
    if results.joined("alpha/{medium}.csv")["alpha_z_se_N_per_cm3"].isna().all():
        return ""
    errors = results.config.errors
    errors_of_legs = {"hip_cm", "arc_percent"}
    # `model_fields_set`: keys that stand in the config, not those with a default
    stated = {key for key in errors.model_fields_set if getattr(errors, key) == 0}
    if not results.config.legs:
        stated -= errors_of_legs
    if results.config.table is not None:
        stated &= errors_of_legs
    return ", ".join(name for key, name in NAMES_OF_ERRORS.items() if key in stated)


_SCATTER_OF_BEDS = {
    REPEATS: "with the scatter of repeats",
    OF_CELL: "with the scatter of the repeats of this direction",
    FEW_REPEATS: f"with the scatter of few repeats and an assumed one of {100 * USUAL_BED_SPREAD:g} %",
    STATED: "with the stated scatter",
    ASSUMED: f"with an assumed scatter of {100 * USUAL_BED_SPREAD:g} %",
}
"""Source of the scatter between beds, in words, by the word in column ``spread`` of the table of alpha."""


def scatter_of_beds(cell: Mapping[Any, Any], confidence: float) -> str:
    """Name the source of the scatter between beds in the interval of the next bed; empty where that interval adds none.

    `cell`: Row of the table of alpha. `confidence`: Level of the interval, from 0 to 1. Where ``spread`` does not name
    the source, the interval of the next bed is wider by an assumed scatter, if it is wider by so much at all.
    """
    if cell["spread"] != AS_PREPARED:
        return _SCATTER_OF_BEDS.get(str(cell["spread"]), "")
    alpha, high, high_next = (float(cell[column("z", end)]) for end in ("", "_hi", "_hi_next"))
    # independent errors add by their squares, so what the next bed adds is a difference of squares
    added_square = (high_next - alpha) ** 2 - (high - alpha) ** 2
    # a row of a table may be the mean of runs in several beds: then nothing is assumed, and less was added
    assumed = 0.99 * half_width_of_bed(USUAL_BED_SPREAD, confidence) * abs(alpha)
    return _SCATTER_OF_BEDS[ASSUMED] if added_square >= assumed**2 else ""


def is_chosen_on_these_legs(results: Results) -> bool:
    """Return True if the model's own error was chosen by the same forces on laboratory legs that this campaign compares.

    An interval with an error chosen on these legs contains them by construction, which proves nothing.
    """
    # an error other than the default was estimated from these legs; a simulated campaign repeats the legs of the paper,
    # by which the default was chosen
    return results.model_error != EPS or results.campaign.reenacted


def explanation_of(row: Mapping[str, Any], *, chosen_on_these_legs: bool = False) -> str:
    """Say whether the errors of alpha, or the model's own error, explain the error of a peak; empty without an interval.

    An interval of the error of a peak (predicted less measured) explains it if it includes zero. `row`: Row of
    ``results/leg_errors.csv``: ``peak_error_lo_percent`` and ``_hi_`` by the errors of alpha, axle and arc,
    ``peak_error_model_lo_percent`` and ``_hi_`` with the model's own too. `chosen_on_these_legs`: As
    `is_chosen_on_these_legs` returns it.
    """

    def includes_zero(ends: str) -> bool | None:
        """Return True if an interval includes zero; None where there is no interval. `ends`: empty or ``_model``."""
        low, high = (row[f"peak_error{ends}_{end}_percent"] for end in ("lo", "hi"))
        return low <= 0 <= high if format_interval(low, high, 0) else None

    by_alpha, by_model = includes_zero(""), includes_zero("_model")
    if by_alpha:
        return "within the errors of alpha, axle and arc"
    if by_model is False:
        return "larger than the errors of alpha, axle, arc and model explain"
    # empty if there is no interval by the errors of alpha
    beyond_alpha = "larger than the errors of alpha, axle and arc explain" * (by_alpha is False)
    if by_model is None:
        return beyond_alpha
    within = "within the error of the model on other legs"
    if chosen_on_these_legs:
        within = "within the model's own error, which was chosen on these same legs"
    return "; ".join(filter(None, (beyond_alpha, within)))


def alpha_half_width(table: pd.DataFrame, component: str, suffix: str = "") -> pd.Series[float]:
    """Return half the width of the interval of alpha_z or alpha_x in each row, N/cm^3; `suffix`: ``_next`` for the next bed.

    `table`: Of alpha, or of a map, with one row for each direction. `component`: ``z`` or ``x``.
    """
    high = table[column(component, f"_hi{suffix}")].astype(float)
    return (high - table[column(component, f"_lo{suffix}")].astype(float)) / 2


def usable_media(results: Results, media: Iterable[str]) -> list[str]:
    """Select the media that fail no check that makes a medium unusable; others may be marked for lesser failures."""
    marks = {name: codes_of(results.marks.get(name, ())) for name in media}
    return [name for name, codes in marks.items() if UNUSABLE not in codes.split()]


def predicted_by(results: Results) -> dict[str, list[str]]:
    """List for each profile the media in which it gave a complete curve of the force on any leg, without a missing point."""
    media_of_profile: dict[str, list[str]] = {}
    curves = results.table("predicted.csv").groupby(["profile", "medium", "leg"])["force_z_N"]
    keys: Any
    for keys, force in curves:
        profile, medium, _ = map(str, keys)
        if force.notna().all() and medium not in media_of_profile.setdefault(profile, []):
            media_of_profile[profile].append(medium)
    return {profile: media for profile, media in media_of_profile.items() if media}


def of_method(results: Results, name: str) -> pd.DataFrame:
    """Read the rows of a table of fits, such as ``coefficients.csv``, that are by the configured method (``fourier.method``).

    Two methods of fitting nine terms write into the same tables; figures show one.
    """
    table = results.table(name)
    return table[table["method"] == results.config.fourier.method]
