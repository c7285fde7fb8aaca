"""What a campaign found: sentences, each with its number, its interval and the section that shows it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.figures.labels import (
    PROFILES,
    in_brackets,
    name_of,
    of_method,
    percent,
    pushes_of_sands,
    span,
    with_span,
)
from rftfit.figures.style import number
from rftfit.figures.traces import alpha_of
from rftfit.measure.alpha import cell_at
from rftfit.measure.fits import shared_flags
from rftfit.measure.flags import codes_of, remark
from rftfit.measure.verdicts import UNUSABLE
from rftfit.page.cells import records
from rftfit.results import Results
from rftfit.robot.speeds import share_within

_MOST_MEDIA = 3


class Finding(NamedTuple):
    """One sentence, and the id of the section of the page that shows where it comes from."""

    text: str
    section: str


def findings(results: Results) -> list[Finding]:
    """What was found, the most important first; nothing is said of what the campaign lacks."""
    parts = (_doubts, _legs, _sands, _robot, _pushes, _size, _misfit)
    return [one for part in parts for one in part(results)]


def usable(results: Results, media: Iterable[str]) -> list[str]:
    """Those of the media that fail no check that makes them unusable."""
    marks = {name: codes_of(results.marks.get(name, ())) for name in media}
    return [name for name, codes in marks.items() if UNUSABLE not in codes.split()]


def _doubts(results: Results) -> Iterable[Finding]:
    """What must be known before any number is read."""
    good = usable(results, results.media)
    bad = [results.campaign.titles[name] for name in results.media if name not in good]
    if bad:
        yield Finding(f"Not usable, by checks that need no model: {listed(bad)}.", "believed")
    bare = [one.title for one in results if remark("no-tare") in shared_flags(one.fits)]
    if bare:
        yield Finding(
            f"No tare was subtracted in {listed(bare)}: the force on rod and mount is in every number of it.",
            "dropped",
        )


def _legs(results: Results) -> Iterable[Finding]:
    """How far the measured table can be trusted: the worst error of peak lift of every leg."""
    errors = _peaks(results, usable(results, results.laboratory), "table")
    told, where = _worst(results, errors, "media")
    if told:
        near = int((errors["peak_error_percent"].abs() <= WITHIN_PERCENT).sum())
        yield Finding(
            f"Peak lift predicted from the measured table is off by at most {told} ({where}). Within "
            f"{WITHIN_PERCENT:g} % are {near} of {len(errors)} peaks of lift and thrust.",
            "legs",
        )


def _sands(results: Results) -> Iterable[Finding]:
    """How far one push straight down goes in natural sands."""
    media = usable(results, results.sands)
    for profile, start in (
        ("map", f"From {pushes_of_sands(results)}, peak lift predicted by the map is"),
        (
            "generic",
            "By the paper's routine, the generic profile scaled to the push straight down, peak lift is",
        ),
    ):
        told, where = _worst(results, _peaks(results, media, profile), "sands")
        if told:
            yield Finding(f"{start} off by at most {told} ({where}).", "sands")


def _worst(results: Results, errors: pd.DataFrame, kind: str) -> tuple[str, str]:
    """The largest error of peak lift of every leg with its interval, and where."""
    lift = errors[errors["component"] == "z"]
    told = []
    for leg, part in lift.groupby("leg", sort=False):
        worst = max(records(part), key=lambda row: abs(row["peak_error_percent"]))
        ends = span(worst["peak_error_lo_percent"], worst["peak_error_hi_percent"], 0)
        off = percent(worst["peak_error_percent"])
        told.append(f"{off}{in_brackets(ends)} for the {name_of(str(leg))}")
    media = list(dict.fromkeys(lift["medium"]))
    where = results.titles[media[0]] if len(media) == 1 else f"{len(media)} {kind}"
    return listed(told) if told else "", where


def _robot(results: Results) -> Iterable[Finding]:
    """How near the simulated robot comes."""
    if not results.campaign.robot_medium:
        return
    errors = results.table("robot/errors.csv")
    for profile in ("table", "map"):
        own = errors[(errors["profile"] == profile) & errors["measured_cm_per_s"].notna()]
        if not own["error_percent"].notna().any():
            continue
        near, rough = share_within(own, 20), share_within(own, 35)
        top = max(records(own), key=lambda row: float(row["measured_cm_per_s"]))
        ends = span(
            top["simulated_from_alpha_lo_cm_per_s"], top["simulated_from_alpha_hi_cm_per_s"], 1
        )
        ends = f"{ends} by the errors of alpha alone" if ends else ""
        yield Finding(
            f"On the {PROFILES[profile]} the robot runs within 20 % of its measured speed in {near[0]} of {near[1]} "
            f"conditions and within 35 % in {rough[0]}; the fastest, measured at {number(top['measured_cm_per_s'], 1)} cm/s, "
            f"is simulated at {number(top['simulated_cm_per_s'], 1)} cm/s{in_brackets(ends)}.",
            "robot",
        )
        return


def _pushes(results: Results) -> Iterable[Finding]:
    """What few pushes say of a medium of which no leg was measured."""
    predicted = results.table("predicted.csv")
    for name in usable(results, results.media)[:_MOST_MEDIA]:
        medium = results[name]
        own = predicted[(predicted["medium"] == name) & (predicted["profile"] == "map")]
        if len(medium.legs) or not len(own):
            continue
        known = int(medium.alpha["alpha_z_N_per_cm3"].notna().sum())
        told = []
        for leg, part in own.groupby("leg", sort=False):
            known_force = part[part["force_z_N"].notna()]
            if len(known_force):
                top = max(records(known_force), key=lambda row: float(row["force_z_N"]))
                ends = span(top["force_z_lo_N"], top["force_z_hi_N"], 1)
                told.append(
                    f"{number(top['force_z_N'], 1)} N{in_brackets(ends)} on the {name_of(str(leg))}"
                )
        if told:
            pushes = "one push" if known == 1 else f"{known} directions"
            yield Finding(
                f"From {pushes} in {results.titles[name]}, the map predicts a peak lift of {listed(told)}.",
                "viewer",
            )


def _size(results: Results) -> Iterable[Finding]:
    """How hard the media are to a level plate pushed straight down."""
    found = []
    for name in usable(results, results.media):
        cell = cell_at(results[name].alpha, 0.0, 90.0)
        if cell is not None and math.isfinite(cell["alpha_z_N_per_cm3"]):
            found.append((float(cell["alpha_z_N_per_cm3"]), name, cell))
    found.sort(key=lambda one: one[0])
    told = [
        f"{with_span(*alpha_of(cell.to_dict(), 'z'), 3)} N/cm^3 in {results.titles[name]}"
        for _, name, cell in (found if len(found) < 3 else [found[0], found[-1]])
    ]
    if told:
        yield Finding(f"Straight down, alpha_z(0, 90 deg) is {' to '.join(told)}.", "maps")


def _misfit(results: Results) -> Iterable[Finding]:
    """What nine terms miss, beside what was measured."""
    shares = misfits(results)
    known = {name: share for name, share in shares.items() if name in usable(results, shares)}
    if known:
        sizes = dict.fromkeys(number(end(known.values()), 0) for end in (min, max))
        size = " to ".join(sizes)
        yield Finding(
            f"Nine Fourier terms miss {size} % of the largest alpha_z (root mean square over the "
            "directions); no interval of measurement contains this.",
            "coefficients",
        )


def misfits(results: Results) -> dict[str, float]:
    """Root mean square of what nine terms miss of alpha_z over the largest, percent, by medium."""
    table = of_method(results, "coefficients.csv")
    found = {}
    for row in records(table[table["coefficient"] == "A00"]):
        name = str(row["medium"])
        if name in results.media and math.isfinite(row["misfit_rms_N_per_cm3"]):
            largest = float(np.nanmax(np.abs(results[name].alpha["alpha_z_N_per_cm3"])))
            found[name] = 100 * row["misfit_rms_N_per_cm3"] / largest
    return found


def _peaks(results: Results, media: Sequence[str], profile: str) -> pd.DataFrame:
    table = results.table("leg_errors.csv")
    known = table["medium"].isin(list(media)) & (table["profile"] == profile)
    return table[known & table["peak_error_percent"].notna()]


def listed(parts: Iterable[str]) -> str:
    """A list in words."""
    *most, last = parts
    return f"{', '.join(most)} and {last}" if most else last
