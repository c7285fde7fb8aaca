"""The tables of the page: for each its columns, headings and digits, and from which results its rows are.

Each function ``tabulate_...`` makes one table of the page (`PageTable`: columns, and rows as dicts) from tables of
results. A medium is named by its key in the config. Zeta is its fitted alpha_z straight down on a flat plate, chi
measured over fitted; both exist by several methods of fitting nine terms, of which the config names one. ``_lo``,
``_hi`` are ends of intervals.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run). `column("z", "_lo")` is
the name ``alpha_z_lo_N_per_cm3``.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from rftfit.compare.legs import FAR_OFF, NOT_TESTED, OFF, WITHIN
from rftfit.compare.lessons import summary_of_lessons
from rftfit.compare.published import EVIDENCE, NOT_MEASURED, SAME, TEXT, VERDICTS
from rftfit.compare.sands import MODELS, WORTH
from rftfit.figures.labels import (
    PROFILE_NAMES,
    cell_straight_down,
    format_interval,
    in_brackets,
    name_of,
    percent,
    scatter_of_beds,
    usable_media,
)
from rftfit.figures.maps import lies_on_grid, pivot
from rftfit.figures.style import degrees, format_number
from rftfit.forces.peaks import OTHER_FORM, STEEP
from rftfit.measure.alpha import alpha_columns, cell_down, column
from rftfit.measure.depths import curved_law
from rftfit.measure.flags import codes_of
from rftfit.measure.verdict_words import DOUBTFUL, NOT_CHECKED, NOTHING, SOUND
from rftfit.model.fourier import TERMS
from rftfit.model.maps import fit_terms_of_map
from rftfit.model.scaling import AS_PRINTED, GENERIC, routines, vertical_penetration
from rftfit.page.cells import (
    ALPHA_DIGITS,
    Cell,
    Note,
    PageColumn,
    PageTable,
    Row,
    numbers,
    records,
    share,
    texts,
)
from rftfit.page.live import (
    fitted_scale,
    has_scale_of_map,
    lacks_directions,
    scale_in_all_directions,
    scaled_from_print,
)
from rftfit.page.outcome import (
    VERDICT_WORDS,
    Outcome,
    describe_other_kind,
    most_serious_flag,
    rows_by_reason,
    verdicts_on_legs,
    worst_of_nine_terms,
)
from rftfit.reference import MEDIA, coefficients, load
from rftfit.results import Medium, Results
from rftfit.store.text import count

# symbols and units for headings

ALPHA_Z, ALPHA_X = (Markup("\N{GREEK SMALL LETTER ALPHA}<sub>{}</sub>").format(c) for c in "zx")
ALPHA_OF = {"z": ALPHA_Z, "x": ALPHA_X}
BETA, GAMMA = "\N{GREEK SMALL LETTER BETA}", "\N{GREEK SMALL LETTER GAMMA}"
ZETA, CHI = "\N{GREEK SMALL LETTER ZETA}", "\N{GREEK SMALL LETTER CHI}"
PER_CM3 = "N/cm\N{SUPERSCRIPT THREE}"
DEGREE = "\N{DEGREE SIGN}"


def medium_title(results: Results, medium: str) -> str:
    """Return the title of a medium as the user wrote it; also for runs in air and the generic profile."""
    special_titles = {"": "in air", GENERIC: "generic, no unit"}
    return (special_titles | results.titles).get(medium, medium)


NO_FAULT = "no fault found"
"""Verdict in words on a medium that fails no check, but lacks a check that a sound medium needs."""


def tabulate_media(results: Results, outcome: Outcome) -> PageTable:
    """Tabulate the media, one row each: verdicts on its data and on the model on its legs, and its numbers.

    Rows: `_make_rows_of_media`. `outcome`: Runs with and without a result.
    """
    fates = {False: "dropped", True: "excluded"}
    lost = Counter((run["medium"], fates[run["excluded"]]) for run in outcome.dropped)

    def title(row: Row) -> Cell:
        """Make the cell with the title of the medium, and counts of its runs."""
        runs_used = outcome.used[row["medium"]]
        is_sand = row["medium"] in results.sands
        facts = ["natural sand"] * is_sand
        facts.append(count(runs_used, "run"))
        for fate in fates.values():
            if lost_runs := lost[row["medium"], fate]:
                facts.append(f"{lost_runs} {fate}")
        # most runs of a sand are rods and legs
        if is_sand and 0 < row["pushes"] < runs_used:
            facts.append(count(row["pushes"], "push", "pushes"))
        if row["directions"] > 1:
            facts.append(f"{row['directions']} directions")
        return Cell(results.campaign.titles[row["medium"]], (", ".join(facts),))

    def data_verdict(row: Row) -> Cell:
        """Make the cell with the verdict on the data, its reason, and a link to where the page explains it."""
        word, reason = results[row["medium"]].verdict
        flag_count = most_serious_flag(results, row["medium"])[1]
        is_faultless = word in (SOUND, NOT_CHECKED)
        flags = count(flag_count, "flag") if flag_count and is_faultless else ""
        link_by_word = {SOUND: "", NOTHING: "#dropped", NOT_CHECKED: "#believed"}
        link = link_by_word.get(word, f"#checks-{row['medium']}")
        css_class = {SOUND: "same", DOUBTFUL: "doubtful", NOT_CHECKED: "faint"}.get(word, "differs")
        # the page explains these two verdicts once, above the table
        why = {SOUND: "", NOT_CHECKED: "but not all checked"}.get(word, reason)
        is_of_other_kind = bool(describe_other_kind(results, row["medium"]))
        notes = (
            why,
            Note("of another kind, or a wrong angle", "#summary") if is_of_other_kind else "",
            Note(flags, f"#notes-{row['medium']}") if flags else "",
        )
        verdict = NO_FAULT if word == NOT_CHECKED else word
        return Cell(verdict, notes, f"verdict {css_class}", link)

    def on_legs(row: Row) -> Cell:
        """Make the cell with the verdict on the model on legs, and the worst peaks."""
        verdicts = verdicts_on_legs(results, row["medium"])
        code = verdicts[0][1]
        css_class = {WITHIN: "same", OFF: "doubtful", FAR_OFF: "differs"}.get(code, "faint")
        section = "#sands" if row["medium"] in results.sands else "#legs"
        link = "" if code == NOT_TESTED else section
        notes_of_models = [note for _, _, note in verdicts]
        notes = (*notes_of_models, worst_of_nine_terms(results, row["medium"]))
        return Cell(VERDICT_WORDS[code], notes, f"verdict {css_class}", link)

    def next_bed(row: Row) -> Cell:
        """Make the cell with the interval of alpha_z in the next bed."""
        low, high = (row.get(column("z", f"_{end}_next")) for end in ("lo", "hi"))
        interval = format_interval(low, high, ALPHA_DIGITS)
        confidence = results.config.fit.confidence
        return Cell(interval, (scatter_of_beds(row, confidence) if interval else "",))

    def scale_number(name: str) -> PageColumn:
        """Make the column of zeta or chi (`name`), with its notes."""
        numbers_of_method = numbers("", name, ALPHA_DIGITS, ends=f"{name}_{{}}")

        def cell(row: Row) -> Cell:
            number = numbers_of_method.cell(row)
            return Cell(number.text, (*number.notes, row.get(f"{name}_note", "")))

        symbol = ZETA if name == "zeta" else CHI
        return PageColumn(f"{symbol}, {results.config.fourier.method}", cell, "num")

    columns = [PageColumn("Medium", title), PageColumn("Data", data_verdict)]
    if results.config.legs:
        columns.append(PageColumn("Model on legs, worst peak", on_legs))
    columns += [
        numbers(
            ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}",
            column("z"),
            ALPHA_DIGITS,
            ends=column("z", "_{}"),
            note="alpha_note",
        ),
        PageColumn(f"next bed, {PER_CM3}", next_bed, "num"),
        scale_number("zeta"),
        scale_number("chi"),
    ]
    return PageTable("Numbers of the media", columns, _make_rows_of_media(results))


ERROR_NAMES = {
    "startup": "start of the motion",
    "surface": "surface height of a run",
    "bed": "bed to bed",
    "rod": "force on the rod",
    "session": "surface height and clocks of the day",
    "turn": "turn of the mount",
    "hip": "height of the axle",
    "arc": "arc of the legs",
}
"""Names for people of errors of alpha and of forces, by their names in tables; other names explain themselves."""


def errors_in_words(shares: str) -> str:
    """Write a list of shares of errors, such as ``session 44 %``, with names for people (`ERROR_NAMES`)."""
    return re.sub(
        r"[a-z_]+", lambda name: ERROR_NAMES.get(name[0], name[0].replace("_", " ")), shares
    )


def tabulate_alphas(results: Results) -> list[tuple[str, PageTable]]:
    """Tabulate alpha of every medium with its interval, for print: rows of beta and columns of gamma, or a list of directions.

    Returns title and table of each.
    """
    titled_tables = []
    for medium in results:
        cells_with_alpha = medium.alpha[medium.alpha[column("z")].notna()]
        if not lies_on_grid(medium.alpha):
            columns = [numbers(f"{BETA}, {DEGREE}", "beta_deg", 1)]
            columns += [numbers(f"{GAMMA}, {DEGREE}", "gamma_deg", 1)]
            columns += [numbers(ALPHA_OF[c], column(c), ends=column(c, "_{}")) for c in "zx"]
            table = PageTable(f"Alpha, {medium.title}", columns, records(cells_with_alpha))
            titled_tables.append((f"{medium.title}, {PER_CM3}", table))
            continue
        # a single direction stands in the table of media already
        for c in "zx" if len(cells_with_alpha) > 1 else "":
            # a row a beta, a column a gamma
            beta, gamma, _ = pivot(medium.alpha, column(c))
            rows = [{"beta": angle} for angle in beta]
            # columns of the page's table: "3" is alpha in the fourth direction gamma, "_lo3" and "_hi3" its interval
            for end in ("", "_lo", "_hi"):
                for row, cells in zip(rows, pivot(medium.alpha, column(c, end))[2], strict=True):
                    row |= {f"{end}{j}": number for j, number in enumerate(cells)}
            columns = [numbers(f"{BETA} \\ {GAMMA}", "beta", 0)]
            columns += [
                numbers(degrees(angle), str(j), ends=f"_{{}}{j}") for j, angle in enumerate(gamma)
            ]
            label = Markup("{}, {}, {}").format(ALPHA_OF[c], medium.title, PER_CM3)
            titled_tables.append((label, PageTable(f"alpha_{c}, {medium.title}", columns, rows)))
    return titled_tables


def tabulate_at_depths(results: Results) -> PageTable:
    """Tabulate the media whose stress is no straight line of depth: alpha of a flat push straight down, at several depths.

    The depths are those of the config (``fit.depths_cm``). A table without rows where stress is straight in all media.
    """
    depths, rows = results.config.fit.depths_cm, []
    tolerance_deg = results.config.grid.angle_tolerance_deg
    for medium in results:
        law = curved_law(medium.fits, results.table(f"checks/{medium.name}.csv"), tolerance_deg)
        row: dict[str, Any] = {"medium": medium.name, "law": str(law)}
        if law is None:
            continue
        for depth, table in medium.alpha_at_depth.groupby("depth_cm"):
            cell = cell_down(table, tolerance_deg)
            if cell is not None and math.isfinite(cell[column("z")]):
                row |= {f"{end}{depth:g}": cell[column("z", end)] for end in ("", "_lo", "_hi")}
        # a row without any alpha is left out
        rows += [row] if len(row) > 2 else []
    head = ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}, at "
    columns = [_medium_column(results), texts("Stress grows as", "law")]
    columns += [
        numbers(head + f"{depth:g} cm", f"{depth:g}", ends=f"_{{}}{depth:g}") for depth in depths
    ]
    return PageTable("Alpha at stated depths", columns, rows)


def _make_rows_of_media(results: Results) -> list[Row]:
    """Make the rows of the table of media: numbers of pushes, alpha straight down, zeta and chi by the configured method.

    A row has the cell of the push straight down (columns of the table of alpha), ``directions``, ``pushes``, ``zeta``,
    ``chi`` with ends, and the small print ``alpha_note``, ``zeta_note``, ``chi_note``.
    """
    rows: list[Row] = []
    for medium in results:
        cells = medium.alpha[medium.alpha[column("z")].notna()]
        row: dict[str, Any] = {"directions": len(cells), "pushes": int(cells["n_runs"].sum())}
        push = cell_straight_down(results, medium.name)
        runs_down = ""
        if push is not None:
            row |= {str(name): number for name, number in push.items()}
            runs_down = f"of {count(int(push['n_runs']), 'run')}"
        is_sand = medium.name in results.sands
        other_window = _describe_other_window(results, row) if is_sand else ""
        row["alpha_note"] = "; ".join(filter(None, (runs_down, other_window)))
        for name, numbers_of_scale in scale_in_all_directions(results, medium.name).items():
            row[name], row[f"{name}_lo"], row[f"{name}_hi"] = numbers_of_scale
        notes = _describe_numbers_of_paper(results, medium)
        if lacks_directions(results, medium.name):
            notes = _describe_scale_of_pushes(results, medium.name, len(cells), notes)
        if is_sand and math.isfinite(row.get("zeta", math.nan)):
            notes["zeta_note"] = _format_zeta_of_map(results.map_table(medium.name))
        if is_sand and math.isfinite(row.get("chi", math.nan)):
            is_published = medium.name in scaled_from_print(results)
            notes["chi_note"] = f"from the {'published' if is_published else 'other'} media"
        rows.append(row | notes | {"medium": medium.name})
    return rows


def _format_zeta_of_map(map_table: pd.DataFrame) -> str:
    """Write the zeta of a natural sand by its map; empty where there is none. That in the cell is by the paper's routine.

    The two may differ by much, since the map also uses pushes in other directions.
    """
    if map_table.empty:
        return ""
    beta, gamma = np.radians(map_table[["beta_deg", "gamma_deg"]].to_numpy(float)).T
    alpha = np.stack(alpha_columns(map_table))
    of_map = vertical_penetration(fit_terms_of_map(beta, gamma, alpha, alpha))
    return f"map: {format_number(float(of_map), ALPHA_DIGITS)}"


def _describe_other_window(results: Results, cell: Row) -> str:
    """Write alpha over the detected window, where it lies outside the interval over the stated one; else empty.

    The window is the range of depth over which a slope was fitted; the choice of it is no error in the interval.
    `cell`: Row of the table of alpha for the push straight down, over the stated window.
    """
    table = results.table("sands.csv")
    is_in_cell = table["run_id"].isin(str(cell.get("run_ids", "")).split())
    windows = table[is_in_cell].groupby("window")[["alpha_z_N_per_cm3", "linear_to_cm"]].mean()
    if not {"stated", "detected"} <= {*windows.index}:
        return ""
    alpha, end_cm = map(float, windows.loc["detected"].to_numpy(float))
    low, high = (float(cell.get(column("z", end), math.nan)) for end in ("_lo", "_hi"))
    if not math.isfinite(alpha) or not (alpha < low or alpha > high):
        return ""
    detected = f"{format_number(alpha, ALPHA_DIGITS)} down to {end_cm:.1f} cm"
    return f"by the detected window {detected}: no interval holds this choice"


def _describe_scale_of_pushes(
    results: Results, medium: str, directions: int, notes: Mapping[str, str]
) -> dict[str, str]:
    """Say from which directions zeta and chi were computed, for a medium in which some directions were not pushed.

    `directions`: Number of pushed ones. `notes`: Further notes, ``zeta_note`` and ``chi_note``, which are written
    behind. Returns both notes.
    """
    notes_on_pushes = {}
    is_of_other_kind = bool(describe_other_kind(results, medium))
    whose = (
        "of the map, true of media of the known kind"
        if is_of_other_kind
        else "of the map, to quote"
    )
    for name, numbers_of_fit in fitted_scale(results, medium).items():
        note = f"of the {directions} pushed directions alone, not comparable with the paper's"
        if has_scale_of_map(results, medium):
            value, low, high = (format_number(number, ALPHA_DIGITS) for number in numbers_of_fit)
            note = f"{whose}; pushes alone: {value} ({low} to {high})"
        key = f"{name}_note"
        notes_on_pushes[key] = "; ".join(filter(None, (note, notes.get(key, ""))))
    return notes_on_pushes


def _describe_numbers_of_paper(results: Results, medium: Medium) -> dict[str, str]:
    """Write the paper's zeta and chi of a medium, and those of our data by `AS_PRINTED`; empty for other media.

    `AS_PRINTED` is the method that reproduces the printed coefficients of the paper. Returns ``zeta_note``,
    ``chi_note``.
    """
    published_as = medium.settings.published_as
    if published_as not in MEDIA:
        return {}
    table_s3 = load("table_s3").set_index(["medium", "quantity"])["value"].astype(float)
    chi = format_number(float(table_s3[published_as, "chi"]), 2)
    zeta = format_number(coefficients(published_as)["zeta"], 3)
    penetration = results.table("penetration.csv")
    is_of_medium = (penetration["medium"] == medium.name) & (penetration["method"] == AS_PRINTED)
    notes = {}
    for name, printed in (("zeta", zeta), ("chi", chi)):
        notes[f"{name}_note"] = f"paper {printed}"
        for transformed in penetration.loc[is_of_medium, name].dropna().head(1):
            number = format_number(float(transformed), ALPHA_DIGITS)
            notes[f"{name}_note"] += f"; by {AS_PRINTED} {number}"
    return notes


def tabulate_coefficients(results: Results, method: str) -> PageTable:
    """Tabulate coefficients of all media by one method, dropped terms in brackets, and the misfit of the nine terms.

    A row a term and a column a medium, with the generic profile last; of a single medium the other way round.
    """
    table = results.table("coefficients.csv")
    rows = records(table[table["method"] == method])
    fit_rows = {(row["medium"], row["coefficient"]): row for row in rows}
    # small print of the generic profile, by term
    scatter = {
        term: f"s.d. of media {format_number(deviation, ALPHA_DIGITS)}"
        for term, deviation in _scatter_of_shapes(results, fit_rows, method).items()
    }
    reasons: dict[str, set[str]] = {}
    for row in rows:
        reasons.setdefault(row["medium"], set()).add(row["reason"])

    def column_of(medium: str) -> PageColumn:
        """Make the column of one medium: a coefficient or a misfit for each term."""

        def cell(row: Row) -> Cell:
            # a row of misfits: "of" names the term whose row of results has the misfit of its component
            if "of" in row:
                fit_row = fit_rows.get((medium, row["of"]), {})
                return Cell(format_number(fit_row.get("misfit_rms_N_per_cm3"), ALPHA_DIGITS))
            fit_row = fit_rows.get((medium, row["term"]), {})
            text = format_number(fit_row.get("value_N_per_cm3"), ALPHA_DIGITS)
            # a reason that all terms of a medium share is written at the first term alone
            is_written = len(reasons[medium]) > 1 or row["term"] == TERMS[0]
            reason = fit_row.get("reason", "") if is_written else ""
            interval = format_interval(fit_row.get("lo"), fit_row.get("hi"), ALPHA_DIGITS)
            notes = (interval, scatter.get(row["term"], "") if medium == GENERIC else "", reason)
            if fit_row.get("kept", True):
                return Cell(text, notes)
            return Cell(f"[{text}]", notes, "faint")

        return PageColumn(medium_title(results, medium), cell, "num")

    media = dict.fromkeys(str(row["medium"]) for row in rows)
    if len(media) == 2:
        # of a single medium, the generic profile would be this medium over its zeta
        media.pop(GENERIC, None)
    terms: list[Row] = [{"term": term} for term in TERMS]
    if any(math.isfinite(fit_row["misfit_rms_N_per_cm3"]) for fit_row in fit_rows.values()):
        terms += [
            {"term": Markup("misfit of {}, rms").format(ALPHA_OF[c]), "of": of}
            for c, of in (("z", "A00"), ("x", "C11"))
        ]
    label = f"Coefficients by {method}"
    columns = {medium: column_of(medium) for medium in media}
    if len(media) > 1:
        return PageTable(label, [texts("Term", "term"), *columns.values()], terms)

    def column_of_term(term: Row) -> PageColumn:
        """Make the column of one term, where rows are media."""
        return PageColumn(term["term"], lambda row: columns[row["medium"]].cell(term), "num")

    # a single medium is one row: one column would leave the page empty beside it
    by_medium = [_medium_column(results), *(column_of_term(term) for term in terms)]
    return PageTable(label, by_medium, [{"medium": medium} for medium in media])


def _scatter_of_shapes(
    results: Results, fit_rows: Mapping[tuple[str, str], Row], method: str
) -> dict[str, float]:
    """Compute the standard deviation of each term over zeta between the media behind the generic profile.

    Empty for one medium. `fit_rows`: Rows of the table of coefficients by one method, by medium and term.
    """
    penetration = results.table("penetration.csv")
    zeta_of_medium = (
        penetration[penetration["method"] == method].set_index("medium")["zeta"].dropna()
    )
    media = usable_media(results, dict.fromkeys(medium for medium, _ in fit_rows))
    terms_of_media = pd.DataFrame(
        {
            medium: {
                term: fit_rows[medium, term]["value_N_per_cm3"] / zeta_of_medium[medium]
                for term in TERMS
            }
            for medium in media
            if medium in zeta_of_medium and medium != GENERIC
        }
    )
    deviations = terms_of_media.std(axis=1, ddof=1).dropna()
    return {str(term): float(deviation) for term, deviation in deviations.items()}


def tabulate_methods(results: Results) -> list[str]:
    """List the methods of the fit that gave coefficients, the configured one first."""
    table = results.table("coefficients.csv")
    fitted_methods = dict.fromkeys(map(str, table.loc[table["value_N_per_cm3"].notna(), "method"]))
    return sorted(fitted_methods, key=lambda method: method != results.config.fourier.method)


def tabulate_scaling(results: Results) -> tuple[PageTable, PageTable]:
    """Tabulate the errors behind zeta of every medium by the configured method, and all numbers by the other methods.

    Returns two tables. Zeta itself by the configured method stands in the table of media.
    """

    def fitted_alpha(row: Row) -> Cell:
        """Make the cell of fitted alpha_z(0, 90 deg); a sand was pushed once, so it has no fit."""
        if row["medium"] in results.sands:
            return Cell("not fitted: one test only")
        return fit_column.cell(row)

    fit_column = numbers("", "alpha_z_fit_N_per_cm3", ends="alpha_z_fit_{}_N_per_cm3")
    medium_and_method = [_medium_column(results), texts("Method", "method", note="reason")]
    columns = [
        *medium_and_method,
        PageColumn(ALPHA_Z + f" fit, {PER_CM3}", fitted_alpha, "num"),
        numbers(CHI, "chi", ALPHA_DIGITS, ends="chi_{}"),
        numbers(ZETA, "zeta", ALPHA_DIGITS, ends="zeta_{}"),
    ]
    errors = texts("Share of its variance", lambda row: errors_in_words(row["zeta_errors"]))
    method = results.config.fourier.method
    configured = method, *routines(method)
    rows = _without_repeated_reasons(results, "penetration.csv")
    other_rows = _join_methods(row for row in rows if row["method"] not in configured)
    rows_with_errors = [row for row in rows if row["method"] in configured and row["zeta_errors"]]
    return (
        PageTable(f"Errors behind {ZETA}", [*medium_and_method, errors], rows_with_errors),
        PageTable("Scaling by the other methods", columns, other_rows),
    )


def _join_methods(rows: Iterable[Row]) -> list[Row]:
    """Join rows of a medium whose numbers are the same by several methods; the column of the method names all of these."""
    # texts as keys, since NaN is not equal to NaN
    joined: dict[tuple[str, ...], Row] = {}
    for row in rows:
        numbers_of_row = tuple(f"{row[name]}" for name in ("medium", "zeta", "chi", "reason"))
        first = joined.setdefault(numbers_of_row, row)
        if first is not row:
            methods = f"{first['method']}; {row['method']}"
            joined[numbers_of_row] = {**first, "method": methods}
    return [*joined.values()]


_RMS_OVER_PEAK = numbers(
    "RMS over peak", "rms_relative_to_peak", show=lambda ratio: share(ratio).lstrip("+")
)
"""Column of the error of the shape of a curve of forces, relative to its measured peak."""


def tabulate_leg_errors(results: Results) -> PageTable:
    """Tabulate errors of peak and of shape for every leg, medium, profile and component.

    Rows of ``results/leg_errors.csv``, sorted by medium, leg, profile and component as the config and the page order
    them.
    """
    order: dict[str, Sequence[str]] = {
        "medium": list(results.config.media),
        "leg": list(results.config.intruders),
        "profile": list(PROFILE_NAMES),
        "component": ["z", "x"],
    }

    def rank(row: Row) -> list[int]:
        """Return the place of a row by medium, leg, profile and component; a name that `order` lacks comes last."""
        return [[*names, row[name]].index(row[name]) for name, names in order.items()]

    rows = []
    for row in _without_repeated_reasons(results, "leg_errors.csv"):
        # small print: which errors the interval is made of, or why it is withheld
        in_words = errors_in_words(row["peak_errors"])
        notes = {"peak_errors": in_words and f"variance: {in_words}"}
        codes = row["reason_code"].split()
        if STEEP in codes:
            notes = {"peak_errors": row["reason"], "reason": ""}
        elif codes == [OTHER_FORM]:
            notes["reason"] = ""  # the page says it once, above the table, for all nine-term fits
        rows.append(row | notes)
    predicted = "peak_predicted_N", 2, "peak_predicted_{}_N", "peak_errors"
    columns = [
        _medium_column(results),
        texts("Leg", lambda row: name_of(row["leg"])),
        texts("Profile", lambda row: name_of(row["profile"])),
        texts("Force", lambda row: Markup("F<sub>{}</sub>").format(row["component"])),
        numbers("Peak measured, N", "peak_measured_N", 2, note="reason"),
        numbers("Peak predicted, N", *predicted, ends_of_model="peak_predicted_model_{}_N"),
        numbers("Error of peak", "peak_error_percent", show=percent),
        numbers(f"Predicted peak later by, {DEGREE}", "peak_late_deg", 1),
        numbers("RMS error, N", "rms_error_N", 2),
        _RMS_OVER_PEAK,
        numbers("R\N{SUPERSCRIPT TWO}", "r2", 2),
    ]
    return PageTable("Leg errors", columns, sorted(rows, key=rank), tall=True)


LESSON_WORDS = {
    "plates": "plates of this medium",
    "other-leg": "plates and another leg",
    "same-leg-elsewhere": "plates, and this leg in other media",
}
"""What a prediction was learned from, by column ``lesson`` of ``contacts.csv``."""


def tabulate_contacts(results: Results) -> PageTable:
    """Tabulate errors of predicted forces on legs by the data behind the prediction, in laboratory media and in sands.

    Forces measured on a leg can correct the map; the table shows how much that helps on legs left out.
    """
    table = results.table("contacts.csv")
    rows: list[Row] = []
    for title, media in (
        ("laboratory media", results.laboratory),
        ("natural sands", results.sands),
    ):
        summary = summary_of_lessons(table[table["medium"].isin(media)])
        rows += records(summary.assign(tested_on=title))
    columns = [
        texts("Learned from", lambda row: LESSON_WORDS[row["lesson"]]),
        texts("Tested on legs in", "tested_on"),
        numbers("Curves", "curves", 0),
        numbers("Error of peak, median, %", "peak_error_percent", 0),
        replace(_RMS_OVER_PEAK, heading="RMS over peak, median"),
        numbers("Poses inside, %", "inside_percent", 0),
    ]
    return PageTable("Learned from, tested on", columns, rows)


def tabulate_sands(results: Results) -> PageTable:
    """Tabulate the penetration tests of the natural sands, over the stated and over the detected linear regime.

    A test is a push of a flat plate straight down; the regime is the range of depth in which stress is straight.
    """
    alpha = "alpha_z_N_per_cm3", 4, "alpha_z_{}_N_per_cm3"
    columns = [
        _medium_column(results, "Sand"),
        texts("Run", "run_id"),
        texts("Window", "window"),
        numbers("Fitted to, cm", "linear_to_cm", 2),
        numbers(ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}", *alpha),
        numbers("Departure from a line", "nonlinear_z_ratio", note="reason", show=share),
    ]
    rows = _without_repeated_reasons(results, "sands.csv")
    for row in rows:
        cell = cell_straight_down(results, row["medium"])
        # alpha of the cell is of this push and window alone: print its interval, which differs in degrees of freedom
        if cell is not None and row["window"] == "stated" and cell["run_ids"] == row["run_id"]:
            row |= {name: cell[name] for name in (column("z", "_lo"), column("z", "_hi"))}
    return PageTable("Penetration of natural sands", columns, rows)


def _without_repeated_reasons(results: Results, name: str) -> list[dict[str, Any]]:
    """Read the rows of a table, without reasons that the page gives once for all rows.

    `name`: Of the file of the table, which has ``medium``, ``reason`` and ``reason_code``. Given once are flags that
    all runs of the medium share, and that published media were used.
    """
    shared_codes = {
        medium.name: codes_of(medium.flags.shared(medium.fits)).split() for medium in results
    }
    rows = records(results.table(name))
    for row in rows:
        given_once = {"published-media", *shared_codes.get(row["medium"], ())}
        if {*row["reason_code"].split()} <= given_once:
            row["reason"] = ""
    return rows


def tabulate_corrections(results: Results) -> PageTable:
    """Tabulate corrections of predicted forces in natural sands: their factors, and whether they help on a leg left out.

    A correction multiplies predicted forces by factors fitted to the legs. It earns its place if it makes the error on
    legs left out of the fit smaller by the share `WORTH`.
    """

    def earns_its_place(row: Row) -> str:
        """Say whether a correction gains enough; empty for the model without correction."""
        if row["model"] == MODELS[0]:
            return ""
        return "yes" if row["earns_its_place"] else "no"

    columns = [
        _medium_column(results, "Sand"),
        texts("Correction", "model"),
        numbers(Markup("factor of F<sub>z</sub>"), "factor_z", 2),
        numbers(Markup("factor of F<sub>x</sub>"), "factor_x", 2),
        numbers("RMS error, fitted, N", "rms_fit_N", 2),
        numbers("RMS error, cross-validated, N", "rms_cv_N", 2),
        numbers("Gain", "gain_cv_percent", show=percent),
        texts(f"Gains {100 * WORTH:g} % or more", earns_its_place, "reason"),
    ]
    return PageTable("Corrections", columns, records(results.table("sand_correction.csv")))


_MEDIA_CODES = re.compile(rf"\b(?:{'|'.join(map(re.escape, MEDIA))})\b")
"""Key of a published medium inside a text."""


def tabulate_reproduction(results: Results) -> tuple[dict[str, str], PageTable, PageTable]:
    """Tabulate our numbers beside those of the paper.

    Returns counts of verdicts, in words, by their evidence (`EVIDENCE`: measured, calibrated, by construction, or the
    text alone); the items that are not the same; all items. Items that were not measured are left out. All are left out
    where most items that data could meet were not measured.
    """
    titles = {
        medium.settings.published_as or medium.name: medium.title.replace(",", "")
        for medium in results
    }

    def with_titles(text: Any) -> Any:
        """Replace keys of published media in a text by titles, which hold no comma: a comma separates entries of a list."""
        return _MEDIA_CODES.sub(lambda code: titles.get(code[0], code[0]), str(text))

    def item(row: Row) -> Cell:
        """Make the cell with the name of the item, and where the paper has it."""
        return Cell(with_titles(row["item"]), (row["where"],))

    def paper(row: Row) -> Cell:
        """Make the cell with the paper's number, its tolerance, and the reason for that."""
        within, reason = _format_significant(row["tolerance"]), in_brackets(row["tolerance_reason"])
        note = f"\N{PLUS-MINUS SIGN} {within}{reason}" if within else ""
        return Cell(with_titles(_format_significant(row["paper"])), (note,))

    def ours(row: Row) -> Cell:
        """Make the cell with our number and its interval."""
        ends = _format_significant(row["lo"]), _format_significant(row["hi"])
        interval = " to ".join(ends) if all(ends) else ""
        return Cell(with_titles(_format_significant(row["ours"])), (interval,))

    def verdict(row: Row) -> Cell:
        """Make the cell with the verdict, the evidence behind it, and the reason."""
        css_classes = "verdict " + row["verdict"].replace(" ", "-")
        return Cell(row["verdict"], (row["evidence"], with_titles(row["why"])), css_classes)

    columns = [
        PageColumn("Item", item),
        PageColumn("Paper", paper, "num"),
        PageColumn("Ours", ours, "num"),
        PageColumn("Verdict", verdict),
    ]
    all_rows = records(results.table("reproduction.csv"))
    rows = [row for row in all_rows if row["verdict"] != NOT_MEASURED]
    # items that data could meet: how many were measured, and how many there are
    met, possible = (
        sum(row["evidence"] != TEXT for row in counted_rows) for counted_rows in (rows, all_rows)
    )
    rows = [] if 2 * met < possible else rows
    item_counts = Counter((row["evidence"], row["verdict"]) for row in rows)
    counts = {}
    for evidence in EVIDENCE:
        counts_of_verdicts = [
            f"{number} {word}" for word in VERDICTS if (number := item_counts[evidence, word])
        ]
        if counts_of_verdicts:
            counts[evidence] = ", ".join(counts_of_verdicts)
    differing_rows = [row for row in rows if row["verdict"] != SAME]
    different = PageTable("Items that are not the same", columns, differing_rows, tall=True)
    return counts, different, PageTable("All items", columns, rows, tall=True)


def tabulate_dropped(results: Results, outcome: Outcome) -> PageTable:
    """Tabulate the runs that gave no result, with reasons."""
    columns = [
        texts("Run", "run_id"),
        _medium_column(results),
        texts("Kind", "kind"),
        texts("Rows", "rows", css_classes="num"),
        texts("Reason", "reasons", css_classes="why"),
    ]
    return PageTable("Runs that gave no result", columns, outcome.dropped, tall=True)


def tabulate_logs(results: Results) -> PageTable:
    """Tabulate the rows of all logs by fate and reason."""
    columns = [
        texts("Fate", "fate"),
        texts("Reason or use", "reason"),
        texts("Runs", "runs", css_classes="num"),
        texts("Rows", "rows", css_classes="num"),
    ]
    return PageTable("Rows by fate", columns, rows_by_reason(results))


def _medium_column(results: Results, heading: str = "Medium") -> PageColumn:
    """Make the column with the title of the medium of a row."""
    return texts(heading, lambda row: medium_title(results, row["medium"]))


def _format_significant(cell: Any) -> str:
    """Write a number with four significant digits, empty for NaN; a cell that is no number stays as it is."""
    try:
        number = float(cell)
    except ValueError:
        return str(cell)
    return "" if math.isnan(number) else f"{number:.4g}".replace("-", "\N{MINUS SIGN}")
