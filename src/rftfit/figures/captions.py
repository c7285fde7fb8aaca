"""Numbers of a run as captions tell them: plain text, empty where nothing is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures.registry import greek
from rftfit.figures.style import number
from rftfit.measure.flags import flagged_with

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy.typing as npt
    import pandas as pd

    from rftfit.figures.registry import Words
    from rftfit.results import Results

PROFILES = {
    "table": "measured table",
    "map": "map",
    "fourier": "nine-term fit",
    "generic": "generic \N{MULTIPLICATION SIGN} \N{GREEK SMALL LETTER ZETA}",
    "depth_only": "depth-only",
}
"""Names of the profiles for people, in the order in which figures and page show them."""

_MANY = 20
"""A twentieth of fewer runs is less than one."""

LEGS = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}


def name_of(key: str) -> str:
    """Name of a profile or of a leg for people."""
    return (PROFILES | LEGS).get(key, key)


def percent(value: float | None) -> str:
    """Write a percentage with its sign."""
    if value is None or not math.isfinite(value):
        return "no value"
    text = number(value, 0 if abs(value) >= 10 else 1)
    return f"+{text} %" if value > 0 and float(text) > 0 else f"{text} %"


def span(low: float | None, high: float | None, digits: int = 3) -> str:
    """Write an interval with the digits that its width needs; nothing where an end or the width is missing."""
    if low is None or high is None or not math.isfinite(high - low) or low == high:
        return ""
    while (ends := (number(low, digits), number(high, digits)))[0] == ends[1]:
        digits += 1
    return " to ".join(ends)


def in_brackets(text: str) -> str:
    """Write what follows a number in brackets, nothing where there is nothing."""
    return f" ({text})" if text else ""


def with_span(value: float, low: float, high: float, digits: int) -> str:
    """Write a number with its interval in brackets."""
    return number(value, digits) + in_brackets(span(low, high, digits))


def quantile(values: npt.ArrayLike, share: float, digits: int) -> str:
    """Write a quantile of what is known, nothing where nothing is."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    return number(float(np.quantile(known, share)), digits) if known.size else ""


def half_width(table: pd.DataFrame, component: str) -> pd.Series[float]:
    """Half the width of the interval of alpha_z or alpha_x, N/cm^3."""
    high = table[f"alpha_{component}_hi_N_per_cm3"].astype(float)
    return (high - table[f"alpha_{component}_lo_N_per_cm3"].astype(float)) / 2


def median_half_width(table: pd.DataFrame, digits: int) -> str:
    """Write the median half width of both components in a table of fits or cells, N/cm^3."""
    return quantile([half_width(table, c) for c in "zx"], 0.5, digits)


def tared(results: Results, runs: pd.DataFrame) -> bool:
    """Whether a tare was taken off any of the runs of a table."""
    with_tare = [run.run_id for run in results.campaign.runs if run.tare_run]
    known = runs["run_id"].isin(with_tare) & ~flagged_with(runs, "no-tare")
    return bool(known.any())


def predicted_by(results: Results) -> dict[str, list[str]]:
    """Media in which each profile gave a whole curve of the force on a leg."""
    table = results.table("predicted.csv")
    whole = table["force_z_N"].notna().groupby([table[n] for n in ("profile", "medium", "leg")])
    known = whole.all().loc[lambda one: one].index.to_frame(index=False)
    return {str(n): list(dict.fromkeys(part["medium"])) for n, part in known.groupby("profile")}


def plates(results: Results, medium: str) -> Words | None:
    """Sum up the plate runs of a medium, or of all laboratory media; None where there is none.

    `bend`, `bend_most`: departure of a parabola from the line at the end of the window, percent of
    the vertical stress there; median and, of twenty runs or more, 95th percentile.
    """
    fits = results.joined("fits/{medium}.csv", (medium,) if medium else results.laboratory)
    if fits.empty:
        return None
    bend = 100 * fits["nonlinear_z_ratio"].abs()
    many = bend.notna().sum() >= _MANY
    found: Words = {
        "runs": str(len(fits)),
        "good": str(int(fits["alpha_z_N_per_cm3"].notna().sum())),
        "half": median_half_width(fits, 4),
        "slanted": str(int(bend.notna().sum())),
        "bend": quantile(bend, 0.5, 1),
        "bend_most": quantile(bend, 0.95, 1) if many else "",
        "doubts": str(flagged_with(fits, "not-linear").sum()),
        "tared": tared(results, fits),
    }
    return found | {
        name: bool((fits["direction"] == name).any()) for name in ("extraction", "horizontal")
    }


def lift_errors(results: Results, media: Iterable[str]) -> pd.DataFrame:
    """How far predicted lift is from measured lift in some media, a row a leg and profile."""
    table = results.table("leg_errors.csv")
    return table[table["medium"].isin(list(media)) & (table["component"] == "z")]


def peaks(results: Results, media: Iterable[str]) -> Words:
    """Sum up the errors of the predicted peak lift of every profile."""
    own = lift_errors(results, media)
    own = own[own["peak_error_percent"].notna()]
    told = []
    for profile, name in PROFILES.items():
        error = own.loc[own["profile"] == profile, "peak_error_percent"]
        if len(error):
            told.append(
                f"{name} {percent(error.min())} to {percent(error.max())}, within 10 % in "
                f"{(error.abs() <= 10).sum()} and within 33 % in {(error.abs() <= 33).sum()} of "
                f"{len(error)} cases"
            )
    return {"peaks": "; ".join(told)}


def peaks_by_leg(results: Results, medium: str, profiles: Iterable[str]) -> str:
    """Write the error of the predicted peak lift of every leg in one medium."""
    own = lift_errors(results, [medium])
    told = []
    for profile in profiles:
        part = own[own["profile"] == profile]
        errors = zip(part["leg"], part["peak_error_percent"], strict=True)
        legs = ", ".join(f"{name_of(leg)} {percent(error)}" for leg, error in errors)
        if part["peak_error_percent"].notna().any():
            told.append(f"{PROFILES[profile]}: {legs}")
    return "; ".join(told)


def peaks_by_medium(results: Results, media: Iterable[str], profiles: Sequence[str]) -> Words:
    """Write the error of the predicted peak lift of every leg in several media."""
    found = {medium: peaks_by_leg(results, medium, profiles) for medium in media}
    titles = results.campaign.titles
    return {"peaks": "; ".join(f"{titles[m]}, {text}" for m, text in found.items() if text)}


def errors_behind_peaks(results: Results, medium: str) -> str:
    """Write what the predicted peak lift of every leg by the measured table is uncertain by."""
    own = lift_errors(results, [medium])
    known = own[(own["profile"] == "table") & (own["peak_errors"] != "")]
    return "; ".join(
        f"{name_of(leg)}, {shares}"
        for leg, shares in zip(known["leg"], known["peak_errors"], strict=True)
    )


def pushes_of_sands(results: Results) -> str:
    """Write what is known of each natural sand that was pushed."""
    known = (results[name].alpha.dropna(subset="alpha_z_N_per_cm3") for name in results.sands)
    places = {(*table["beta_deg"], *table["gamma_deg"]) for table in known if len(table)}
    return "one push straight down" if places == {(0, 90)} else "a few pushes"


def of_method(results: Results, name: str) -> pd.DataFrame:
    """Rows of a table of fits by the configured method."""
    table = results.table(name)
    return table[table["method"] == results.config.fourier.method]


def zetas(results: Results) -> Words:
    """Write zeta and chi of every laboratory medium by the configured method."""
    told, titles = [], results.campaign.titles
    for row in of_method(results, "penetration.csv").to_dict("records"):
        zeta, chi = (with_span(row[n], row[f"{n}_lo"], row[f"{n}_hi"], 4) for n in ("zeta", "chi"))
        told.append(
            f"{titles.get(row['medium'], row['medium'])}: {greek(f'zeta {zeta}, chi {chi}')}"
        )
    return {"zetas": "; ".join(told)}
