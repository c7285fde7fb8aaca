"""The findings of a campaign: sentences, each with its number, its interval and the section that shows it.

Each function ``_find_...`` yields the findings on one question, none where the campaign has no answer; `findings` asks
all. Errors of peaks are in percent of the measured peak, rows of ``results/leg_errors.csv``: one for each medium, leg,
profile (which alpha was used: ``table``, ``map``, ``generic`` ...) and component (z: lift). Intervals are by the errors
of alpha, axle and arc; after the word "model" with the force model's own error too. A medium is usable if it fails no
check that forbids its use.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``legs`` (measured forces).
`column("z", "_lo")` is the name ``alpha_z_lo_N_per_cm3``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from rftfit.checks.declared import CHECKS, WAITS
from rftfit.checks.verdict import Verdict
from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.directions import is_straight_down
from rftfit.figures import labels
from rftfit.figures.style import format_number, level
from rftfit.forces.peaks import STEEP
from rftfit.measure.alpha import column
from rftfit.measure.depths import steep_pushes
from rftfit.page.cells import ALPHA_DIGITS, Row, records
from rftfit.page.live import lacks_directions
from rftfit.page.outcome import describe_other_kind, format_sentence, media_that_passed
from rftfit.results import Results
from rftfit.robot.speeds import share_within
from rftfit.robot.sweep import RANGE_IN_VIEW
from rftfit.store.text import count

_MOST_MEDIA = 3
"""Most media that a sentence names; more are counted."""

ON_FIRST_SCREEN = 2
"""Number of findings on the first screen; the others are printed at the head of their sections."""

FLAT, REVERSED = "flat_leg", "reversed_c_leg"
"""Legs whose order by peak lift the nine terms may exchange."""


class PageFinding(NamedTuple):
    """One finding: sentences, and the id of the section of the page with the results behind them."""

    text: str
    section: str


def findings(results: Results) -> list[PageFinding]:
    """List the findings, most important first: the measurement, the predictions and their errors, then the rest.

    The first `ON_FIRST_SCREEN` stand on the first screen of the page, the others in their sections.
    """
    finders = (
        _find_verdicts,
        _find_media_of_another_kind,
        _find_errors_on_legs,
        _find_error_of_theta,
        _find_simulated_speed,
        _find_explanation,
        _find_lifts_of_maps,
        _find_errors_in_sands,
        _find_errors_of_robot,
        _find_misfit,
        _find_reversed_order,
    )
    return [finding for finder in finders for finding in finder(results)]


def _find_verdicts(results: Results) -> Iterable[PageFinding]:
    """Say how many checks passed, the verdict on each medium, and alpha_z of a flat plate pushed straight down.

    Also how small an error of a run would not be seen, and which pushes straight down were lost.
    """
    # without the verdict that `results.titles` adds in brackets
    titles = results.campaign.titles
    titles_by_verdict: dict[Verdict, list[str]] = {}
    for medium in results:
        titles_by_verdict.setdefault(medium.verdict, []).append(titles[medium.name])
    sentences = [_describe_checks(results)]
    for verdict, same_verdict in titles_by_verdict.items():
        # many media are only counted: the table names them
        subject = f"{len(same_verdict)} of {len(results.media)} media"
        if len(same_verdict) <= _MOST_MEDIA:
            subject = list_in_words(same_verdict)
        sentences.append(verdict.on(subject, len(same_verdict) > 1))
    sentences += _describe_unseen_difference(results)
    # row of the table of alpha for the push straight down, by medium
    cells = {}
    for name in labels.usable_media(results, results.media):
        cell = labels.cell_straight_down(results, name)
        if cell is not None and math.isfinite(cell[column("z")]):
            cells[name] = cell.to_dict()
    ascending = sorted(cells, key=lambda name: cells[name][column("z")])
    sizes = []
    # the weakest and the strongest medium
    for name in ascending[:: max(len(cells) - 1, 1)]:
        intervals = ""
        # of several media, the table has the intervals
        if len(cells) == 1:
            intervals = _format_mean_and_next_bed(cells[name], results.config.fit.confidence)
        alpha = format_number(cells[name][column("z")], ALPHA_DIGITS)
        window = _describe_window_of_sand(results, name)
        sizes.append(f"{alpha} N/cm^3{labels.in_brackets(intervals)} in {titles[name]}{window}")
    if sizes:
        ends = f"{'between ' * (len(sizes) > 1)}{' and '.join(sizes)}"
        sentences.append(f"Straight down, stress per depth alpha_z is {ends}")
    sentences += _describe_lost_pushes(results)
    yield PageFinding(" ".join(map(format_sentence, sentences)), "believed")


def _describe_unseen_difference(results: Results) -> Iterable[str]:
    """Say how far a single run may be off in media whose runs agree: what is smaller is not told from chance.

    ``seen_from_ratio`` is for each run the least difference, relative to the largest alpha, that would be noticed.
    Yields a clause or none.
    """
    percents = []
    for medium in media_that_passed(results).get("repeats", ()):
        peers = results.table(f"peers/{medium}.csv")
        seen_from = peers.loc[peers["times_spread"].notna(), "seen_from_ratio"]
        percents.append(100 * seen_from.median())
    if percents:
        ends = dict.fromkeys(format_number(end, 0) for end in (min(percents), max(percents)))
        span = " to ".join(ends)
        yield f"a single run that is off by less than {span} % of the largest alpha (median of runs) is not seen"


def _find_media_of_another_kind(results: Results) -> Iterable[PageFinding]:
    """Name each medium that lies far from the shape of the known ones: no check sees an angle that all its runs share."""
    for medium in results:
        if sentence := describe_other_kind(results, medium.name):
            yield PageFinding(f"{results.titles[medium.name]}: {sentence}.", "believed")


def _describe_window_of_sand(results: Results, medium: str) -> str:
    """Say to which depth the slope of a natural sand was fitted, on which it depends; empty for other media."""
    if results.config.media[medium].role != "natural_sand":
        return ""
    ends_cm = steep_pushes(results[medium].fits)["depth_to_cm"].dropna()
    return f" (down to {format_number(ends_cm.max(), 2)} cm)" if len(ends_cm) else ""


def _describe_lost_pushes(results: Results) -> Iterable[str]:
    """Name the media whose pushes straight down were all dropped, each with the most frequent reason; a clause for each."""
    for name in results.media:
        fits = results[name].fits
        is_down = is_straight_down(
            fits["beta_deg"], fits["gamma_deg"], results.config.grid.angle_tolerance_deg
        )
        pushes = fits[is_down]
        if pushes.empty or pushes[column("z")].notna().any():
            continue
        reason = pushes["reason"].mode().iloc[0]
        lost = "the only push was" if len(pushes) == 1 else f"all {len(pushes)} pushes were"
        yield (
            f"straight down, alpha_z of {results.titles[name]} is left out, since {lost} dropped{labels.in_brackets(reason)}"
        )


def _format_mean_and_next_bed(cell: Mapping[Any, Any], confidence: float) -> str:
    """Write both intervals of alpha_z of a cell, of the mean of beds and of the next bed, each with its name.

    `cell`: Row of the table of alpha. `confidence`: Level of the intervals, 0 to 1. Empty where none is known.
    """
    intervals = []
    scatter = labels.scatter_of_beds(cell, confidence)
    next_bed = f"next bed, {scatter}," if scatter else "next bed"
    for suffix, name in (("", labels.name_of_mean(cell)), ("_next", next_bed)):
        low, high = (cell.get(column("z", f"_{end}{suffix}")) for end in ("lo", "hi"))
        if span := labels.format_interval(low, high, ALPHA_DIGITS):
            intervals.append(f"{name} {span}")
    return ", ".join(intervals)


_MOST_NAMED = 3
"""Most checks that are named among those that no medium allows; more are counted, and the section of checks lists them."""


def _describe_checks(results: Results) -> str:
    """Count the checks that all media passed and those that some did; name the others by why they did not pass.

    They failed, wait for another check that fails, or are possible in no medium. Returns a clause.
    """
    passed_in = media_that_passed(results)
    waiting = set(results.checks.loc[results.checks["code"] == WAITS, "check"])
    titles: dict[str, list[str]] = {
        "failed": [],
        "not made while another fails": [],
        "not possible here": [],
    }
    passed, passed_partly = 0, 0
    for check in results.checks["check"].unique():
        if passed_in.get(check):
            everywhere = {*results.media} <= passed_in[check]
            passed += everywhere
            passed_partly += not everywhere
        elif check not in passed_in:
            titles["failed"].append(CHECKS[check].title)
        else:
            outcome = "not made while another fails" if check in waiting else "not possible here"
            titles[outcome].append(CHECKS[check].title)
    checks_passed = passed + passed_partly
    sentence = f"{count(checks_passed, 'check') if checks_passed else 'no checks'} passed"
    if passed_partly:
        sentence += f" where they could be made ({passed or 'none'} in all media)"
    for outcome, checks in titles.items():
        is_named = outcome == "failed" or len(checks) <= _MOST_NAMED
        names_of_checks = f": {', '.join(checks)}" if is_named else ""
        sentence += f", {len(checks)} {outcome}{names_of_checks}" if checks else ""
    return sentence


def _find_errors_on_legs(results: Results) -> Iterable[PageFinding]:
    """Say how far the peak lift on legs of laboratory media is off, predicted with measured alpha or else with the map.

    For each leg the worst of all media, and whether it is within what the paper states (`WITHIN_PERCENT`).
    """
    profile, lift = _select_lifts_of_legs(results)
    if lift.empty:
        return
    legs: dict[str, list[str]] = {"within": [], "not within": []}
    for leg, errors_of_leg in lift.groupby("leg", sort=False):
        worst_error = _find_worst(errors_of_leg)["peak_error_percent"]
        worst = "worst " * (len(errors_of_leg) > 1)
        name = f"{labels.name_of(str(leg))} ({worst}{labels.percent(worst_error)})"
        legs["within" if abs(worst_error) <= WITHIN_PERCENT else "not within"].append(name)
    clauses = [
        f"{within} {WITHIN_PERCENT:g} % on the {list_in_words(names)}"
        for within, names in legs.items()
        if names
    ]
    source = "the measured alpha" if profile == "table" else "the map"
    finding = f"Predicted with {source}, the peak lift is {', '.join(clauses)}."
    if len(lift) > 1:
        sizes = lift["peak_error_percent"].abs()
        median, largest = (format_number(size, 0) for size in (sizes.median(), sizes.max()))
        finding += (
            f" Errors of these {len(lift)} peak lifts: median {median} %, largest {largest} %."
        )
    yield PageFinding(finding, "legs")


def _find_explanation(results: Results) -> Iterable[PageFinding]:
    """Say which errors explain the largest error of a peak lift; nothing where that is within `WITHIN_PERCENT`.

    An interval explains the error if it includes zero (`labels.explanation_of`).
    """
    profile, lift = _select_lifts_of_legs(results)
    if lift.empty or abs((worst := _find_worst(lift))["peak_error_percent"]) <= WITHIN_PERCENT:
        return
    explanation = labels.explanation_of(
        worst, chosen_on_these_legs=labels.is_chosen_on_these_legs(results)
    )
    if not explanation:
        return
    source = "" if profile == "table" else " of the map"
    ends = _format_two_intervals(worst, "peak_error_{}_percent", 0, " %")
    error = labels.percent(worst["peak_error_percent"]) + labels.in_brackets(ends)
    yield PageFinding(
        f"The largest error{source}, {error} on the {labels.name_of(worst['leg'])}, is {explanation}."
        f"{_explain_intervals(results, [ends])}",
        "legs",
    )


def _find_lifts_of_maps(results: Results) -> Iterable[PageFinding]:
    """Say which peak lift the map predicts for media without a measured leg: no error can be stated there.

    For `_MOST_MEDIA` usable media at most. After media with one push a sentence says why intervals are wide.
    """
    predicted = results.table("predicted.csv")
    any_single_push = False
    for name in labels.usable_media(results, results.media)[:_MOST_MEDIA]:
        medium = results[name]
        if len(medium.legs):
            continue
        lifts, intervals = [], []
        rows_of_map = predicted[(predicted["medium"] == name) & (predicted["profile"] == "map")]
        with_force = rows_of_map.dropna(subset="force_z_N")
        for leg, rows_of_leg in with_force.groupby("leg", sort=False):
            top = max(records(rows_of_leg), key=lambda row: float(row["force_z_N"]))
            ends = _format_two_intervals(top, "force_z_{}_N", 1)
            peak = f"{format_number(top['force_z_N'], 1)} N{labels.in_brackets(ends)}"
            lifts.append(f"{peak} on the {labels.name_of(str(leg))}")
            intervals.append(ends)
        if lifts:
            direction_count = int(medium.alpha[column("z")].notna().sum())
            any_single_push |= direction_count == 1
            pushes = "one push" if direction_count == 1 else f"{direction_count} directions"
            yield PageFinding(
                f"From {pushes} in {results.titles[name]}, the map predicts a peak lift of {list_in_words(lifts)}."
                f"{_explain_intervals(results, intervals)}",
                "viewer",
            )
    if any_single_push:
        yield PageFinding(
            "Why these intervals are wide: one push tells how strong a medium is, not whether it has the shape of known "
            "media; rftfit plan names the next best push.",
            "calculator",
        )


def _find_errors_in_sands(results: Results) -> Iterable[PageFinding]:
    """Say how far the peak lift on legs in natural sands is off, predicted from few pushes by the map and by the routine.

    The routine is the paper's: generic alpha times zeta from the push straight down. Both are stated, so that a reader
    can compare them.
    """
    media = labels.usable_media(results, results.sands)
    starts = {
        "map": f"Predicted by the map from {_name_pushes_of_sands(results)}",
        "generic": "Predicted by the paper's routine, generic alpha scaled to the push straight down",
    }
    for profile, start in starts.items():
        lifts, intervals, steep = [], [], []
        lift = lift_errors(results, media, profile)
        for leg, errors_of_leg in lift.groupby("leg", sort=False):
            leg_name, worst = labels.name_of(str(leg)), _find_worst(errors_of_leg)
            ends = _format_two_intervals(worst, "peak_error_{}_percent", 0, " %")
            error = labels.percent(worst["peak_error_percent"]) + labels.in_brackets(ends)
            lifts.append(f"{error} on the {leg_name}")
            intervals.append(ends)
            steep += [leg_name] * (STEEP in worst["reason_code"].split())
        if lifts:
            note = _explain_intervals(results, intervals)
            if steep:
                note += (
                    f" None of alpha on the {list_in_words(steep)}, whose peak changes so fast with the attack angle that "
                    "the pushes do not tell it."
                )
            yield PageFinding(
                f"{start}, the peak lift is off by at most {list_in_words(lifts)}.{note}", "sands"
            )


def _name_pushes_of_sands(results: Results) -> str:
    """Say by which pushes the natural sands were measured."""
    alpha_tables = (results[name].alpha.dropna(subset=column("z")) for name in results.sands)
    angles = {(*table["beta_deg"], *table["gamma_deg"]) for table in alpha_tables if len(table)}
    return "one push straight down" if angles == {(0, 90)} else "a few pushes"


def _format_two_intervals(row: Mapping[str, Any], ends: str, digits: int, unit: str = "") -> str:
    """Write the interval of alpha, then "model" and the interval with the model's own error; empty where neither is known.

    `ends`: Names of the columns with the ends, braces in place of ``lo``, ``hi``, ``model_lo`` and ``model_hi``.
    `digits`: After the point. `unit`: Written behind each interval, with its space.
    """
    intervals = []
    for prefix in ("", "model_"):
        low, high = (row[ends.format(prefix + end)] for end in ("lo", "hi"))
        if interval := labels.format_interval(low, high, digits):
            intervals.append(f"{prefix.replace('_', ' ')}{interval}{unit}")
    return ", ".join(intervals)


def _explain_intervals(results: Results, intervals: Iterable[str]) -> str:
    """Write the sentence that explains the intervals in brackets, with a space before; empty where there are none.

    `intervals`: As `_format_two_intervals` writes them.
    """
    written = [interval for interval in intervals if interval]
    held_errors = []
    if any(not interval.startswith("model") for interval in written):
        held_errors.append("with the errors of alpha, axle and arc")
    if any("model" in interval for interval in written):
        held_errors.append('after "model" with the model\'s own error too')
    if not held_errors:
        return ""
    return f" In brackets: its {level(results)} interval {', '.join(held_errors)}."


def _find_simulated_speed(results: Results) -> Iterable[PageFinding]:
    """Say how fast the simulated robot runs at most, where no speed was measured; without legs too fast for the model."""
    if not results.campaign.robot_medium:
        return
    errors, speeds = (results.table(f"robot/{name}.csv") for name in ("errors", "speed"))
    # rows have a warning where legs turn too fast for resistive forces
    slow = speeds[speeds["speed_cm_per_s"].notna() & (speeds["warning"] == "")]
    if len(slow) and errors["measured_cm_per_s"].isna().all():
        profile = next(name for name in labels.PROFILE_NAMES if name in set(slow["profile"]))
        rows = records(slow[slow["profile"] == profile])
        row = max(rows, key=lambda row: float(row["speed_cm_per_s"]))
        yield PageFinding(
            f"Simulated with the {labels.name_of(profile)}, the robot runs at up to {format_number(row['speed_cm_per_s'], 0)} cm/s (at "
            f"{row['frequency_Hz']:.3g} Hz, R'/r = {format_number(row['curvature_times_R'], 2)}) where its legs are slow enough for "
            "resistive forces; no speed was measured.",
            "robot",
        )


def _find_error_of_theta(results: Results) -> Iterable[PageFinding]:
    """Say that the zero of the angle theta of all legs is off, where the interval of this error does not hold zero.

    All rows have the same ``theta_error_deg``: by how much forces begin at another theta than legs reach the surface.
    """
    errors = results.table("leg_errors.csv")
    for row in records(errors.dropna(subset=["theta_error_deg"]).head(1)):
        lo, hi = row["theta_error_lo_deg"], row["theta_error_hi_deg"]
        if lo <= 0 <= hi:
            return
        size_word = "larger" if lo > 0 else "smaller"
        yield PageFinding(
            f"Forces on the legs begin at a {size_word} theta than the legs reach the surface, by "
            f"{format_number(row['theta_error_deg'], 1)} degrees{labels.in_brackets(labels.format_interval(lo, hi, 1))}, more than "
            "sound published curves explain: look at the zero of theta; the errors of the model on legs contain that.",
            "legs",
        )


def _find_errors_of_robot(results: Results) -> Iterable[PageFinding]:
    """Say in how many conditions the simulated speed of the robot is near the measured one, on the table, else the map."""
    if not results.campaign.robot_medium:
        return
    errors = results.table("robot/errors.csv")
    for profile, source in (("table", "with the measured alpha"), ("map", "with the map")):
        measured_rows = errors[(errors["profile"] == profile) & errors["measured_cm_per_s"].notna()]
        if measured_rows["error_percent"].notna().any():
            # speeds on which lengths of the robot were calibrated are no test of it
            calibrated_rows = measured_rows["calibrated"] == "yes"
            count, total = share_within(measured_rows[~calibrated_rows], 20)
            apart = ""
            if calibrated_rows.any():
                apart = f" on which it was not calibrated; {RANGE_IN_VIEW}"
            yield PageFinding(
                f"Simulated {source}, the robot's speed is within 20 % of the measured one in {count} of {total} conditions{apart}.",
                "robot",
            )
            return


def _find_misfit(results: Results) -> Iterable[PageFinding]:
    """Say how far the nine terms are from measured alpha_z, in media pushed in all directions of the published grid.

    Fitted to a part of them the terms are nearer, and say less of the medium. The misfit is a root mean square over
    directions, in percent of the largest alpha_z.
    """
    rows = labels.of_method(results, "coefficients.csv")
    rows = rows[(rows["coefficient"] == "A00") & rows["misfit_rms_N_per_cm3"].notna()]
    misfits_percent, counts = [], []
    for row in records(rows[rows["medium"].isin(labels.usable_media(results, results.laboratory))]):
        if lacks_directions(results, row["medium"]):
            continue
        alpha = results[row["medium"]].alpha["alpha_z_N_per_cm3"].dropna()
        misfits_percent.append(100 * row["misfit_rms_N_per_cm3"] / alpha.abs().max())
        counts.append(len(alpha))
    if misfits_percent:
        least, largest = min(misfits_percent), max(misfits_percent)
        ends = dict.fromkeys(format_number(end, 0) for end in (least, largest))
        share = " to ".join(ends) if largest >= 1 else "less than 1"
        directions = " to ".join(map(str, dict.fromkeys((min(counts), max(counts)))))
        yield PageFinding(
            f"The nine terms fitted to alpha in {directions} directions miss alpha_z there by {share} % of its largest value (root mean square).",
            "coefficients",
        )


def _find_reversed_order(results: Results) -> Iterable[PageFinding]:
    """Say in how many media nine terms predict more lift for the reversed leg than for the flat one, but the table does not.

    Who chooses a leg by nine terms would choose the wrong one.
    """
    table = results.table("predicted.csv")
    table = table[table["medium"].isin(labels.usable_media(results, results.laboratory))]
    # peak lift in each medium: columns (profile, leg)
    lift = table.pivot_table(
        index="medium", columns=["profile", "leg"], values="force_z_N", aggfunc="max"
    )
    needed = [(profile, leg) for profile in ("fourier", "table") for leg in (REVERSED, FLAT)]
    lift = lift.reindex(columns=needed).dropna()
    reversed_is_higher = {
        profile: lift[profile, REVERSED] > lift[profile, FLAT] for profile in ("fourier", "table")
    }
    has_other_order = reversed_is_higher["fourier"] & ~reversed_is_higher["table"]
    if has_other_order.any():
        where = f"In {has_other_order.sum()} of {len(lift)} media"
        if len(lift) == 1:
            where = f"In {results.titles[lift.index[0]]}"
        yield PageFinding(
            f"{where} the nine terms put the reversed c-leg's peak lift above the flat leg's, and "
            "the measured table does not: nine smooth terms overestimate alpha_z where its deepest elements drag along themselves.",
            "coefficients",
        )


def _select_lifts_of_legs(results: Results) -> tuple[str, pd.DataFrame]:
    """Select errors of peak lift in laboratory media, by the measured table or, where it predicts none, by the map.

    Returns the name of the profile, ``table`` or ``map``, and the rows.
    """
    media = labels.usable_media(results, results.laboratory)
    lifts = {profile: lift_errors(results, media, profile) for profile in ("table", "map")}
    profile = "map" if lifts["table"].empty else "table"
    return profile, lifts[profile]


def lift_errors(results: Results, media: Sequence[str], profile: str) -> pd.DataFrame:
    """Select the rows of ``leg_errors.csv`` with an error of peak lift, predicted in `media` by one profile."""
    table = results.table("leg_errors.csv")
    is_selected = table["medium"].isin(list(media)) & (table["profile"] == profile)
    return table[is_selected & (table["component"] == "z") & table["peak_error_percent"].notna()]


def _find_worst(errors: pd.DataFrame) -> Row:
    """Return the row with the largest error of a peak, of either sign; `errors` is not empty."""
    return max(records(errors), key=lambda row: abs(row["peak_error_percent"]))


def _remove_brackets(text: str) -> str:
    """Remove brackets and what is inside them, also nested ones: each pass removes the innermost."""
    while (shorter := re.sub(r"\([^()]*\)", "", text)) != text:
        text = shorter
    return text


def list_in_words(entries: Iterable[str]) -> str:
    """Write a list in words, with commas and "and", or with semicolons where an entry has a comma outside brackets."""
    *leading, last = entries = list(entries)
    if not leading:
        return last
    if any(", " in _remove_brackets(entry) for entry in entries):
        return f"{'; '.join(leading)}; and {last}"
    return f"{', '.join(leading)} and {last}"
