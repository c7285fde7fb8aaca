"""Make ``results/report.html``: facts and texts of its template, pictures, navigation, script; it needs no network.

`page` fills the template ``page.html`` with the values of `context`: texts, tables (`rftfit.page.tables`), findings,
pictures and facts by which the template chooses its sentences. Style, script and the numbers that the script draws
stand in the page.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run). `column("z", "_lo")` is
the name ``alpha_z_lo_N_per_cm3``.
"""

from __future__ import annotations

import base64
import hashlib
import re
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from math import isfinite
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from rftfit.campaign.config import Leg, MediumSettings
from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.errors import InputError
from rftfit.figures import labels
from rftfit.figures.labels import beds_of_intervals, names_of_zero_errors, of_method
from rftfit.figures.registry import DeclaredFigure, figures, greek
from rftfit.figures.style import format_number, level, size_of_preview
from rftfit.forces.limits import Reach, reach_below_measured
from rftfit.forces.motion import rotation
from rftfit.forces.outlines import leg_outline
from rftfit.measure.alpha import column
from rftfit.measure.flags import describe_shared
from rftfit.measure.lab_frame import measured_channel
from rftfit.measure.samples import split_runs
from rftfit.measure.verdict_words import SOUND
from rftfit.model.fourier import METHODS
from rftfit.model.profiles import EPS
from rftfit.model.scaling import GENERIC, published
from rftfit.page import tables
from rftfit.page.findings import ON_FIRST_SCREEN, findings, list_in_words
from rftfit.page.live import as_json, lacks_directions, live_data, scaled_from_print
from rftfit.page.methods import cited_references, constants, paragraphs, settings_digest
from rftfit.page.outcome import (
    Outcome,
    describe_lacking_map,
    format_sentence,
    most_serious_flag,
    outcome_of_runs,
    summary_of_checks,
    verdicts_on_legs,
)
from rftfit.page.robot import robot_data, robot_facts, robot_tables
from rftfit.results import Results
from rftfit.store.environment import versions
from rftfit.store.text import count

NAVIGATION = {
    "summary": "Summary",
    "believed": "Checks",
    "measurement": "Measurement",
    "maps": "Maps of \N{GREEK SMALL LETTER ALPHA}",
    "coefficients": "Coefficients",
    "scaling": "Scaling",
    "viewer": "Leg viewer",
    "calculator": "Field calculator",
    "legs": "Legs",
    "sands": "Sands",
    "robot": "Robot",
    "reproduction": "Reproduction",
    "dropped": "Dropped runs",
    "methods": "Methods",
    "provenance": "Provenance",
}
"""Names of sections by id, in the order of the navigation; ``page.html`` has the order of the page."""

NARROW = 500
"""Largest width of a figure, pixels, of which two stand beside one another."""


def report(results: Results) -> tuple[str, pd.DataFrame]:
    """Make the page (html), and the table of findings with columns ``finding`` and ``section``; a stage of the workflow."""
    return page(results), pd.DataFrame(findings(results), columns=["finding", "section"])


def page(results: Results) -> str:
    """Make the page: one html document with its style, its script and its numbers inside.

    Texts of the user are escaped. A content security policy, which names script and style by their digests, forbids
    every other script, and fetching anything: the page is safe to open wherever it comes from.
    """
    from jinja2 import Environment, StrictUndefined

    style, script = _read_file("page.css"), _join_scripts()
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["quantities"] = quantities
    template = environment.from_string(_read_file("page.html"))
    data = live_data(results)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    numbers = as_json(data | {"robot": robot_data(results)})
    return template.render(
        context(results), push=data["push"], data=numbers, style=style, script=script, policy=policy
    )


def context(results: Results) -> dict[str, Any]:
    """Collect the values that the template prints, by their names there; a name that is missing is an error.

    Tables are `PageTable`, facts True or False, all else texts; lists of (medium or title, text) are small print. An
    empty table or text leaves its paragraph out.
    """
    config = results.config
    outcome = outcome_of_runs(results)
    scaling, other_scaling = tables.tabulate_scaling(results)
    counts, not_the_same, reproduction = tables.tabulate_reproduction(results)
    page_pictures, errors = drawn_figures(results), tables.tabulate_leg_errors(results)
    # True for sections with content; those that are not named here are always shown
    shown_sections = {
        "measurement": any(
            picture.section in ("Measurement", "quality") for picture in page_pictures
        ),
        "viewer": any(isinstance(intruder, Leg) for intruder in config.intruders.values()),
        "legs": bool(results.table("leg_errors.csv")["peak_measured_N"].notna().any()),
        "sands": bool(results.sands),
        "robot": bool(results.campaign.robot_medium),
        "reproduction": bool(reproduction.rows),
    }
    names = {key: name for key, name in NAVIGATION.items() if shown_sections.get(key, True)}
    # of each medium its most serious flag, empty for none, and the number of flags
    flags = [(medium, *most_serious_flag(results, medium.name)) for medium in results]
    coefficients = of_method(results, "coefficients.csv")
    chi_by_method = {name: published(name).chi for name in METHODS}
    return {
        "title": config.title,
        "measured": _describe_runs(results, outcome),
        "findings": findings(results),
        "pictures": page_pictures,
        "narrow": NARROW,
        "first": [picture for picture in page_pictures if picture.section == "summary"],
        "first_sentences": ON_FIRST_SCREEN,
        "legs_judged": results.table("leg_errors.csv")["peak_error_percent"].notna().any(),
        "usual_model_error": format_number(EPS, 2),
        "lacks_x": config.table is None and measured_channel(config, "x") is None,
        "names": names,
        "origin_of_logs": _describe_origin_of_logs(results),
        "maps_judged": any(
            profile == "map"
            for medium in results.media
            for profile, *_ in verdicts_on_legs(results, medium)
        ),
        "reenacted": results.campaign.reenacted,
        "level": level(results),
        "has_published_media": any(medium.settings.published_as for medium in results),
        "intervals": any(medium.alpha["alpha_z_lo_N_per_cm3"].notna().any() for medium in results),
        "method": config.fourier.method,
        "media": (media_table := tables.tabulate_media(results, outcome)),
        "lacks_zeta": any(not isfinite(row["zeta"]) for row in media_table.rows),
        "believed": summary_of_checks(results),
        "notes": [
            (medium.title, ". ".join(facts))
            for medium in config.media.values()
            if (facts := _list_facts(medium))
        ],
        "flags": [
            (medium.name, medium.title, f"{flag} ({count(number, 'flag')} in all)")
            for medium, flag, number in flags
            if flag
        ],
        "doubts": [
            (medium.title, medium.verdict.reason)
            for medium in results
            if medium.verdict.word == SOUND and medium.verdict.reason
        ]
        + [
            (medium.title, doubt)
            for medium in results
            if (doubt := describe_lacking_map(results, medium.name))
        ],
        "of_all": [
            (medium.title, ". ".join(sentences))
            for medium in results
            if (sentences := describe_shared(medium.flags.shared(medium.fits)))
        ],
        "near": f"{WITHIN_PERCENT:g}",
        "of_beds": beds_of_intervals(results, results.media),
        "zero_errors": names_of_zero_errors(results),
        "alphas": tables.tabulate_alphas(results),
        "at_depths": tables.tabulate_at_depths(results),
        "coefficients": {
            name: tables.tabulate_coefficients(results, name)
            for name in tables.tabulate_methods(results)
        },
        "generic": GENERIC in set(coefficients["medium"]) and coefficients["medium"].nunique() > 2,
        "nine_terms": bool(coefficients["value_N_per_cm3"].notna().any()),
        "dropped_terms": not coefficients["kept"].all(),
        "zeta_errors": scaling,
        "lack_directions": [
            medium.title for medium in results if lacks_directions(results, medium.name)
        ],
        "chi_of": {name: f"{chi.mean():.2f}" for name, chi in chi_by_method.items()},
        "ends_of_chi": {
            name: f"{chi.min():.2f} to {chi.max():.2f}" for name, chi in chi_by_method.items()
        },
        "other_scaling": other_scaling,
        "from_print": [
            tables.medium_title(results, medium) for medium in scaled_from_print(results)
        ],
        "leg_errors": errors,
        "model_error": _model_error_facts(results),
        "contacts": tables.tabulate_contacts(results),
        "sands": tables.tabulate_sands(results),
        "sand_windows": _describe_windows_of_sands(results),
        "corrections": tables.tabulate_corrections(results),
        "robot": robot_tables(results),
        "robot_is": robot_facts(results),
        "verdicts": counts,
        "not_the_same": not_the_same,
        "reproduction": reproduction,
        "dropped": tables.tabulate_dropped(results, outcome),
        "runs_used": outcome.runs_used,
        "rows_of_logs": tables.tabulate_logs(results),
        "methods": (methods := paragraphs(results, outcome)),
        "references": cited_references(methods),
        "constants": constants(results),
        "versions": versions(),
        "settings": settings_digest(config),
    }


def _describe_origin_of_logs(results: Results) -> str:
    """Say from which results of the paper the logs were simulated, and which comparisons therefore mean something.

    Alpha of simulated logs returns what was put in; forces on legs and speeds of the robot were measured by the paper
    independently of it. Empty where logs were recorded.
    """
    if not results.campaign.reenacted:
        return ""

    def name_sources(kind: str, of_laboratory: str, of_sands: str) -> list[str]:
        """List the table or figures of the paper from which runs of a kind (``plate``, ``leg``) were simulated.

        `of_laboratory`, `of_sands`: The source for media of each role.
        """
        media = {run.medium for run in results.campaign.runs if run.kind == kind}
        sources = {of_laboratory: results.laboratory, of_sands: results.sands}
        return [source for source, source_media in sources.items() if media & {*source_media}]

    sentences = []
    if plate_sources := name_sources("plate", "Table S5", "Fig. S11"):
        sentences.append(f"Alpha returns what was put in ({list_in_words(plate_sources)}).")
    measured_by_paper = name_sources("leg", "Fig. S5", "Fig. S12")
    bodies = ["legs"] * bool(measured_by_paper)
    if results.campaign.robot_medium and (
        results.table("robot/measured.csv")["speed_cm_per_s"].notna().any()
    ):
        bodies.append("the robot")
        measured_by_paper.append("Fig. 4C")
    if bodies:
        sentences.append(
            f"Errors of {list_in_words(bodies)} compare predictions with what the paper measured ({list_in_words(measured_by_paper)})."
        )
    return " ".join(sentences)


def _describe_windows_of_sands(results: Results) -> str:
    """Say which alpha of a natural sand to quote, how much it depends on the window, and how deep the legs reach below it.

    The window is the range of depth of a push over which its slope was fitted: ``stated`` in the config, and
    ``detected`` from the push. Returns sentences; of sands without alpha they only say so.
    """
    table = results.table("sands.csv").dropna(subset=["alpha_z_N_per_cm3"])
    # a row a push, a column a window
    by_window = table.pivot_table(
        index=["medium", "run_id"], columns="window", values="alpha_z_N_per_cm3"
    )
    sentences = []
    if table.empty:
        sentences.append(
            "No push shows where its linear beginning ends: alpha and zeta above are of all readings in the windows of the pushes."
        )
    elif "stated" in by_window:
        sentences.append("Quote alpha of the stated window, which all predictions use.")
        if "detected" in by_window:
            changes = (100 * (by_window["detected"] / by_window["stated"] - 1)).dropna()
            ends = dict.fromkeys(map(labels.percent, (changes.min(), changes.max())))
            if len(changes):
                sentences.append(
                    f"The detected one changes it by {' to '.join(ends)}: no interval holds the choice of the window. Where no "
                    "end of the linear regime was found, it is the whole push, linear or not."
                )
    elif len(by_window):
        sentences.append("No window is stated: predictions use alpha of the whole push.")
    reaches = {
        str(medium): reach
        for medium in dict.fromkeys(table["medium"])
        if (reach := _deepest_reach(results, medium)) and reach.share_below > 0
    }
    if reaches:
        measured_depths = list_in_words(
            f"{reach.measured_to_cm:.1f} cm in {results.titles[medium]} ({100 * reach.share_below:.0f} % of depth times area lies below)"
            for medium, reach in reaches.items()
        )
        deepest = max(reach.deepest_cm for reach in reaches.values())
        sentences.append(
            f"The legs reach {deepest:.1f} cm; alpha is known down to {measured_depths}."
        )
    stresses = [
        f"{stress} in {results.titles[medium]}"
        for medium, reach in reaches.items()
        if (stress := _describe_stress_below(results, medium, reach.deepest_cm))
    ]
    if stresses:
        sentences.append(
            f"Stress over depth of the same pushes where the legs go: {list_in_words(stresses)}. Forces are predicted by alpha of "
            "the window all the same, so a peak that agrees is no test of alpha at that depth."
        )
    return " ".join(sentences)


def _describe_stress_below(results: Results, medium: str, deepest_cm: float) -> str:
    """Write stress over depth of the pushes behind alpha of a sand where legs reach deepest, or where the pushes end.

    Its ratio to alpha follows, which is 1 where stress is in proportion to depth. `deepest_cm`: Depth that the legs
    reach. Empty where the sand has no alpha, or its pushes no samples.
    """
    cell = labels.cell_straight_down(results, medium)
    name = f"tared/{medium}.parquet"
    if cell is None or not isfinite(cell[column("z")]) or not results.has(name):
        return ""
    tared = results.table(name)
    # indices of the samples by run
    samples = split_runs(tared)
    # depth and stress of each push, cm and N/cm^2, ascending in depth
    pushes = []
    for run_id in sorted(set(str(cell["run_ids"]).split()) & {*samples}):
        intruder = results.config.intruders[results.campaign.by_id[run_id].intruder]
        push = tared.iloc[samples[run_id]][["depth_cm", "force_z_N"]].dropna()
        if len(push) and not isinstance(intruder, Leg):
            depth_cm, force_z_N = push.sort_values("depth_cm").to_numpy(float).T
            pushes.append((depth_cm, force_z_N / intruder.area_cm2))
    if not pushes:
        return ""
    at_cm = min(deepest_cm, *(float(depth_cm[-1]) for depth_cm, _ in pushes))
    stress_over_depth = float(np.mean([np.interp(at_cm, *push) for push in pushes])) / at_cm
    times_alpha = stress_over_depth / float(cell[column("z")])
    return f"{stress_over_depth:.2f} N/cm^3 at {at_cm:.1f} cm, {times_alpha:.1f} times alpha,"


def _deepest_reach(results: Results, medium: str) -> Reach | None:
    """Find how far the legs reach below the measured depths of a medium: of the leg whose load lies there most.

    None without legs, or if no leg reaches so deep.
    """
    profile = results[medium].profile("table", draws=False)
    speed = results.config.arm.leg_speed_rad_per_s
    reaches = (
        reach_below_measured(profile, leg_outline(leg), rotation(None, leg.hip_height_cm, speed))
        for leg in results.config.legs.values()
    )
    return max(filter(None, reaches), key=lambda reach: reach.share_below, default=None)


def _list_facts(medium: MediumSettings) -> list[str]:
    """List the compaction and the note that the config states of a medium."""
    compaction = f"compaction {medium.compaction}" if medium.compaction else ""
    return [fact for fact in (compaction, medium.note) if fact]


def _model_error_facts(results: Results) -> dict[str, str]:
    """Collect the numbers about the model's own error for the template, as texts; empty where no interval holds it.

    The error is relative to the load. ``used``: The error in the intervals. ``of_legs``: The error on the legs of this
    campaign, empty without such. ``same_legs``: Not empty where the error was chosen on these legs. ``usual``: The
    default.
    """
    if not results.table("predicted.csv")["force_z_model_lo_N"].notna().any():
        return {}
    error_of_legs = results.error_of_legs
    return {
        "used": format_number(results.model_error, 2),
        "of_legs": format_number(error_of_legs, 2) if isfinite(error_of_legs) else "",
        "same_legs": "yes" if results.campaign.reenacted else "",
        "usual": format_number(EPS, 2),
    }


def _describe_runs(results: Results, outcome: Outcome) -> str:
    """Say how many media and runs were measured, how many runs were lost, and whether logs were recorded or simulated."""
    dropped, excluded = outcome.count_lost(excluded=False), outcome.count_lost(excluded=True)
    media = "one medium" if len(results.media) == 1 else f"{len(results.media)} media"
    if results.config.table is not None:
        return f"{media} from a table of stress or alpha.".capitalize()
    runs = "1 run" if outcome.runs_used == 1 else f"{outcome.runs_used:,} runs"
    log_origin = "simulated" if results.campaign.reenacted else "recorded"
    lost = f"{count(dropped, 'run')} dropped" if dropped else "none dropped"
    lost = f"{excluded} excluded, {lost}" if excluded else lost
    return f"{media}, {runs} used, {lost}; logs {log_origin}.".capitalize()


@dataclass(frozen=True)
class Picture:
    """One figure on the page: a small preview inside the page, which leads to its png beside the page.

    `name`: Of its file. `section`: Of the page. `data`: Its preview, as a data address. `width`, `height`: Size of the
    preview, pixels. `png`: Path of its png from the page. `lacking`: Why there is nothing to see; printed instead of
    the picture.
    """

    name: str
    title: str
    caption: str
    section: str
    data: str
    width: int
    height: int
    png: str
    lacking: str


def drawn_figures(results: Results) -> list[Picture]:
    """List every figure of a usual run that was drawn, in the order in which figures are shown."""
    usual_figures = [declared for declared in figures() if not declared.on_demand]
    return [
        _make_picture(results, declared, medium)
        for declared in usual_figures
        for medium in declared.media(results.campaign)
        if results.has(f"{declared.file(medium)}.webp")
    ]


def _make_picture(results: Results, declared: DeclaredFigure, medium: str) -> Picture:
    """Make the picture of a figure that was drawn; `medium`: for which, empty for a figure of the whole campaign."""
    file, caption = declared.file(medium), declared.caption_of(results, medium)
    content = results.path(f"{file}.webp").read_bytes()
    width, height = size_of_preview(content)
    return Picture(
        name=file.rpartition("/")[2],
        title=declared.title_of(results, medium),
        caption=caption,
        section="quality" if declared.folder == "quality" else declared.section,
        data=f"data:image/webp;base64,{base64.b64encode(content).decode()}",
        width=width,
        height=height,
        png=f"{file}.png",
        lacking="" if caption else _describe_lacking(results, declared, medium),
    )


def _describe_lacking(results: Results, declared: DeclaredFigure, medium: str) -> str:
    """Say in one sentence why a figure has nothing to show; empty where its declaration gives no reason.

    Empty, too, where a table that the declaration reads is missing or damaged: the page is made all the same.
    """
    with suppress(InputError, LookupError, ValueError, TypeError):
        head, *reasons = declared.lacking(results, medium)
        sentence = format_sentence(head.rstrip("."))
        return sentence if not reasons else f"{sentence[:-1]}: {'; '.join(reasons)}."
    return ""


# alpha or F with a component, A or M with its index
_SYMBOL_WITH_INDEX = re.compile(r"([\N{GREEK SMALL LETTER ALPHA}F])_([zx])\b|\b([AM])(00?)\b")


def quantities(text: str) -> Markup:
    """Write a plain text as html, as the filter of the template for sentences.

    Quantities get Greek letters and their component as an index, and no line breaks before a percent sign.
    """
    escaped = str(escape(greek(text).replace(" %", "\N{NO-BREAK SPACE}%")))
    # safe, since the text is escaped before the tags are added
    return Markup(_SYMBOL_WITH_INDEX.sub(r"\1\3<sub>\2\4</sub>", escaped))  # noqa: S704


SCRIPTS = (
    "kernel.js",
    "scaling.js",
    "drawing.js",
    "tables.js",
    "maps.js",
    "curves.js",
    "viewer.js",
    "calculator.js",
    "robot.js",
    "page.js",
)
"""Files of the script, in the order in which they are joined."""


def _join_scripts() -> str:
    """Join the files of the script in one scope, so that no name becomes global in the page."""
    body = "\n".join(_read_file(name) for name in SCRIPTS)
    return f'"use strict";\n(() => {{\n{body}\n}})();\n'


def _read_file(name: str) -> str:
    """Read a text file that is installed beside this module."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _hash(source: str) -> str:
    """Return the SHA-256 of a script or style, as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
