"""The tables of the page, each spelled once: its columns, where they come from, how they are printed."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from rftfit.compare.legs import FAR_OFF, NOT_TESTED, OFF, WITHIN
from rftfit.compare.lessons import summary_of_lessons
from rftfit.compare.published import (
    EVIDENCE,
    NOT_MEASURED,
    SAME,
    TEXT,
    VERDICTS,
    is_zeta_of_terms,
    sum_of_terms,
)
from rftfit.compare.sands import MODELS, WORTH
from rftfit.figures.labels import (
    PROFILES,
    format_interval,
    in_brackets,
    name_of,
    percent,
    scatter_of_beds,
)
from rftfit.figures.maps import lies_on_grid, pivot
from rftfit.figures.style import degrees, format_number
from rftfit.forces.peaks import OTHER_FORM, STEEP
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.depths import curved_law
from rftfit.measure.flags import codes_of
from rftfit.measure.verdict_words import DOUBTFUL, NOT_CHECKED, NOTHING, SOUND
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import AS_PRINTED, GENERIC, routines
from rftfit.page.cells import Cell, Note, PageColumn, PageTable, Row, numbers, records, share, texts
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
    most_serious_flag,
    rows_by_reason,
    verdicts_on_legs,
    worst_of_nine_terms,
)
from rftfit.reference import MEDIA, coefficients, load
from rftfit.results import Medium, Results

ALPHA_Z, ALPHA_X = (Markup("\N{GREEK SMALL LETTER ALPHA}<sub>{}</sub>").format(c) for c in "zx")
ALPHA_OF = {"z": ALPHA_Z, "x": ALPHA_X}
BETA, GAMMA = "\N{GREEK SMALL LETTER BETA}", "\N{GREEK SMALL LETTER GAMMA}"
ZETA, CHI = "\N{GREEK SMALL LETTER ZETA}", "\N{GREEK SMALL LETTER CHI}"
PER_CM3 = "N/cm\N{SUPERSCRIPT THREE}"
DEGREE = "\N{DEGREE SIGN}"


def medium_title(results: Results, medium: str) -> str:
    """Title of a medium as the user wrote it."""
    special_titles = {"": "in air", GENERIC: "generic, no unit"}
    return (special_titles | results.titles).get(medium, medium)


NO_FAULT = "no fault found"
"""Of a medium that fails nothing and lacks a check which it needs to be sound."""

ALPHA_DIGITS = 4
"""Digits after the point of alpha, zeta and chi in the tables of the page."""


def tabulate_media(results: Results, outcome: Outcome) -> PageTable:
    """One row a medium: how far its data and the model on its legs can be trusted, and the numbers that came out."""
    words_of_lost = {False: "dropped", True: "excluded"}
    lost = Counter((run["medium"], words_of_lost[run["excluded"]]) for run in outcome.dropped)

    def title(row: Row) -> Cell:
        runs_used = outcome.used[row["medium"]]
        words = [f"{runs_used} run{'s' * (runs_used != 1)}"]
        words = ["natural sand"] * (row["medium"] in results.sands) + words
        for word in words_of_lost.values():
            if count := lost[row["medium"], word]:
                words.append(f"{count} {word}")
        # beside pushes a sand has their rods and legs
        if row["medium"] in results.sands and 0 < row["pushes"] < runs_used:
            words.append(f"{row['pushes']} push{'es' * (row['pushes'] != 1)}")
        if row["directions"] > 1:
            words.append(f"{row['directions']} directions")
        return Cell(results.campaign.titles[row["medium"]], (", ".join(words),))

    def data_verdict(row: Row) -> Cell:
        word, reason = results[row["medium"]].verdict
        count = most_serious_flag(results, row["medium"])[1]
        is_faultless = word in (SOUND, NOT_CHECKED)
        flags = f"{count} flag{'s' * (count != 1)}" if count and is_faultless else ""
        link_by_word = {SOUND: "", NOTHING: "#dropped", NOT_CHECKED: "#believed"}
        link = link_by_word.get(word, f"#checks-{row['medium']}")
        css_class = {SOUND: "same", DOUBTFUL: "doubtful", NOT_CHECKED: "faint"}.get(word, "differs")
        # what holds for all of a kind is said above the table
        why = {SOUND: "", NOT_CHECKED: "but not all checked"}.get(word, reason)
        notes = (why, Note(flags, f"#notes-{row['medium']}") if flags else "")
        title = NO_FAULT if word == NOT_CHECKED else word
        return Cell(title, notes, f"verdict {css_class}", link)

    def on_legs(row: Row) -> Cell:
        verdicts = verdicts_on_legs(results, row["medium"])
        code = verdicts[0][1]
        css_class = {WITHIN: "same", OFF: "doubtful", FAR_OFF: "differs"}.get(code, "faint")
        section = "#sands" if row["medium"] in results.sands else "#legs"
        link = "" if code == NOT_TESTED else section
        notes_of_models = [note for _, _, note in verdicts]
        notes = (*notes_of_models, worst_of_nine_terms(results, row["medium"]))
        return Cell(VERDICT_WORDS[code], notes, f"verdict {css_class}", link)

    def next_bed(row: Row) -> Cell:
        low, high = (row.get(column("z", f"_{end}_next")) for end in ("lo", "hi"))
        interval_text = format_interval(low, high, ALPHA_DIGITS)
        confidence = results.config.fit.confidence
        return Cell(interval_text, (scatter_of_beds(row, confidence) if interval_text else "",))

    def scale_number(name: str) -> PageColumn:
        numbers_of_method = numbers("", name, ALPHA_DIGITS, ends=f"{name}_{{}}")

        def cell(row: Row) -> Cell:
            of_method = numbers_of_method.cell(row)
            return Cell(of_method.text, (*of_method.notes, row.get(f"{name}_note", "")))

        symbol = ZETA if name == "zeta" else CHI
        return PageColumn(f"{symbol}, {results.config.fourier.method}", cell, "num")

    columns = [PageColumn("Medium", title), PageColumn("Data", data_verdict)]
    columns += [PageColumn("Model on legs, worst peak", on_legs)] if results.config.legs else []
    columns += [
        numbers(
            ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}",
            column("z"),
            ALPHA_DIGITS,
            ends=column("z", "_{}"),
            note="other_window",
        ),
        PageColumn(f"next bed, {PER_CM3}", next_bed, "num"),
        scale_number("zeta"),
        scale_number("chi"),
    ]
    rows = _numbers_of_media(results)
    return PageTable("Numbers of the media", columns, rows)


ERRORS = {
    "startup": "start of the motion",
    "surface": "surface height of a run",
    "bed": "bed to bed",
    "rod": "force on the rod",
    "session": "surface height and clocks of the day",
    "turn": "turn of the mount",
    "hip": "height of the axle",
    "arc": "arc of the legs",
}
"""Errors of alpha and of forces whose names in tables need words."""


def errors_in_words(shares: str) -> str:
    """Name the errors of a list of shares, as ``session 44 %``, for people."""
    return re.sub(r"[a-z_]+", lambda name: ERRORS.get(name[0], name[0].replace("_", " ")), shares)


def tabulate_alphas(results: Results) -> list[tuple[str, PageTable]]:
    """Alpha of every medium with its interval, for paper: rows of beta, columns of gamma, or a list of directions."""
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
        # a single direction is in the table of numbers
        for c in "zx" if len(cells_with_alpha) > 1 else "":
            beta, gamma, _ = pivot(medium.alpha, column(c))
            cells = {end: pivot(medium.alpha, column(c, end))[2] for end in ("", "_lo", "_hi")}
            rows = []
            for i, angle in enumerate(beta):
                values_of_row = {
                    f"{end}{k}": v for end in cells for k, v in enumerate(cells[end][i])
                }
                rows.append({"beta": angle} | values_of_row)
            columns = [numbers(f"{BETA} \\ {GAMMA}", "beta", 0)]
            columns += [numbers(degrees(g), str(k), ends=f"_{{}}{k}") for k, g in enumerate(gamma)]
            label = Markup("{}, {}, {}").format(ALPHA_OF[c], medium.title, PER_CM3)
            titled_tables.append((label, PageTable(f"alpha_{c}, {medium.title}", columns, rows)))
    return titled_tables


def tabulate_at_depths(results: Results) -> PageTable:
    """One row a medium whose stress is curved: alpha of a level plate straight down at depths in its window."""
    depths, rows = results.config.fit.depths_cm, []
    for medium in results:
        law = curved_law(
            medium.fits,
            results.table(f"checks/{medium.name}.csv"),
            results.config.grid.angle_tolerance_deg,
        )
        row: dict[str, Any] = {"medium": medium.name, "law": str(law)}
        if law is None:
            continue
        for depth, table in medium.alpha_at_depth.groupby("depth_cm"):
            cell = cell_at(table, 0, 90)
            if cell is not None and math.isfinite(cell[column("z")]):
                row |= {f"{end}{depth:g}": cell[column("z", end)] for end in ("", "_lo", "_hi")}
        rows += [row] if len(row) > 2 else []
    head = ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}, at "
    columns = [_medium(results), texts("Stress grows as", "law")]
    columns += [
        numbers(head + f"{depth:g} cm", f"{depth:g}", ends=f"_{{}}{depth:g}") for depth in depths
    ]
    return PageTable("Alpha at stated depths", columns, rows)


def _numbers_of_media(results: Results) -> list[Row]:
    """What was measured of each medium, and the numbers that came out by the configured method."""
    rows: list[Row] = []
    for medium in results:
        cells = medium.alpha[medium.alpha[column("z")].notna()]
        row: dict[str, Any] = {"directions": len(cells), "pushes": int(cells["n_runs"].sum())}
        push = cell_at(medium.alpha, 0, 90)
        row |= {} if push is None else {str(name): value for name, value in push.items()}
        row["other_window"] = _other_window(results, row) if medium.name in results.sands else ""
        for name, with_ends in scale_in_all_directions(results, medium.name).items():
            row |= {
                f"{name}{end}": number
                for end, number in zip(("", "_lo", "_hi"), with_ends, strict=True)
            }
        notes = _numbers_of_paper(results, medium)
        if lacks_directions(results, medium.name):
            notes = _numbers_of_pushes(results, medium.name, len(cells), notes)
        if medium.name in results.sands and math.isfinite(row.get("chi", math.nan)):
            is_published = medium.name in scaled_from_print(results)
            notes["chi_note"] = f"from the {'published' if is_published else 'other'} media"
        rows.append(row | notes | {"medium": medium.name})
    return rows


def _other_window(results: Results, cell: Row) -> str:
    """Write alpha over the detected window of the same pushes where it leaves the interval over the stated one."""
    table = results.table("sands.csv")
    is_of_cell = table["run_id"].isin(str(cell.get("run_ids", "")).split())
    windows = table[is_of_cell].groupby("window")[["alpha_z_N_per_cm3", "linear_to_cm"]].mean()
    if not {"stated", "detected"} <= {*windows.index}:
        return ""
    alpha, to_cm = map(float, windows.loc["detected"].to_numpy(float))
    low, high = (float(cell.get(column("z", end), math.nan)) for end in ("_lo", "_hi"))
    if not math.isfinite(alpha) or not (alpha < low or alpha > high):
        return ""
    detected = f"{format_number(alpha, ALPHA_DIGITS)} down to {to_cm:.1f} cm"
    return f"by the detected window {detected}: no interval holds this choice"


def _numbers_of_pushes(
    results: Results, medium: str, directions: int, notes: Mapping[str, str]
) -> dict[str, str]:
    """Say which directions zeta and chi of a medium are of that was not pushed in all; before the `notes` that they have."""
    of_pushes = {}
    for name, (value, *_) in fitted_scale(results, medium).items():
        words = f"of the {directions} pushed directions alone, not comparable with the paper's"
        if has_scale_of_map(results, medium):
            number = format_number(value, ALPHA_DIGITS)
            words = f"of the map; of the {directions} pushed directions alone: {number}"
        key = f"{name}_note"
        of_pushes[key] = "; ".join(filter(None, (words, notes.get(key, ""))))
    return of_pushes


def _numbers_of_paper(results: Results, medium: Medium) -> dict[str, str]:
    """Say what the paper prints as zeta and chi of a medium, and what its transform gives here; nothing of other media."""
    published_as = medium.settings.published_as
    if published_as not in MEDIA:
        return {}
    table_s3 = load("table_s3").set_index(["medium", "quantity"])["value"].astype(float)
    printed = {
        "zeta": coefficients(published_as)["zeta"],
        "chi": float(table_s3[published_as, "chi"]),
    }
    penetration = results.table("penetration.csv")
    is_of_medium = (penetration["medium"] == medium.name) & (penetration["method"] == AS_PRINTED)
    of_transform = penetration[is_of_medium]
    terms = coefficients(published_as)
    sum_text = "" if is_zeta_of_terms(terms) else f"its terms add up to {sum_of_terms(terms):.3f}"
    notes = {}
    for name, digits, why in (("zeta", 3, sum_text), ("chi", 2, "")):
        transformed = of_transform[name].dropna()
        by_transform = (
            f"; by the transform of the paper {format_number(float(transformed.iloc[0]), ALPHA_DIGITS)}"
            if len(transformed)
            else ""
        )
        notes[f"{name}_note"] = (
            f"the paper prints {format_number(printed[name], digits)}{in_brackets(why)}{by_transform}"
        )
    return notes


def tabulate_coefficients(results: Results, method: str) -> PageTable:
    """Coefficients of all media by one method, dropped ones in brackets, and what nine terms miss."""
    table = results.table("coefficients.csv")
    rows = records(table[table["method"] == method])
    fit_rows = {(row["medium"], row["coefficient"]): row for row in rows}
    reasons: dict[str, set[str]] = {}
    for row in rows:
        reasons.setdefault(row["medium"], set()).add(row["reason"])

    def column_of(medium: str) -> PageColumn:
        def cell(row: Row) -> Cell:
            if "of" in row:
                fit_row = fit_rows.get((medium, row["of"]), {})
                return Cell(format_number(fit_row.get("misfit_rms_N_per_cm3"), 4))
            fit_row = fit_rows.get((medium, row["term"]), {})
            text = format_number(fit_row.get("value_N_per_cm3"), 4)
            # a reason of the whole medium stands once
            reason = (
                fit_row.get("reason", "")
                if len(reasons[medium]) > 1 or row["term"] == TERMS[0]
                else ""
            )
            notes = (format_interval(fit_row.get("lo"), fit_row.get("hi"), 4), reason)
            if fit_row.get("kept", True):
                return Cell(text, notes)
            return Cell(f"[{text}]", notes, "faint")

        return PageColumn(medium_title(results, medium), cell, "num")

    media = dict.fromkeys(str(row["medium"]) for row in rows)
    if len(media) == 2:
        # the generic profile of one medium is this medium over its zeta
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

    def of_term(term: Row) -> PageColumn:
        return PageColumn(term["term"], lambda row: columns[row["medium"]].cell(term), "num")

    # a single medium lies down: a tall table would leave the page empty beside it
    by_medium = [_medium(results), *(of_term(term) for term in terms)]
    return PageTable(label, by_medium, [{"medium": medium} for medium in media])


def tabulate_spreads(results: Results) -> list[tuple[str, str]]:
    """Where the spread from run to run of each medium is known from."""
    titled_spreads = []
    for medium in results:
        spread = medium.alpha.loc[medium.alpha["alpha_z_se_N_per_cm3"].notna(), "spread"]
        if len(spread):
            titled_spreads.append((medium.title, ", ".join(dict.fromkeys(filter(None, spread)))))
    titled_spreads = [(title, words) for title, words in titled_spreads if words]
    if len(titled_spreads) > 1 and len({words for _, words in titled_spreads}) == 1:
        return [("all media", titled_spreads[0][1])]
    return titled_spreads


def tabulate_methods(results: Results) -> list[str]:
    """Methods that gave coefficients, the configured one first."""
    table = results.table("coefficients.csv")
    fitted_methods = dict.fromkeys(map(str, table.loc[table["value_N_per_cm3"].notna(), "method"]))
    return sorted(fitted_methods, key=lambda method: method != results.config.fourier.method)


def tabulate_scaling(results: Results) -> tuple[PageTable, PageTable]:
    """Where zeta of every medium is from, by the configured method, and all numbers by the other methods."""

    def fit(row: Row) -> Cell:
        if row["medium"] in results.sands:
            return Cell("not fitted: one test only")
        return fitted.cell(row)

    fitted = numbers("", "alpha_z_fit_N_per_cm3", ends="alpha_z_fit_{}_N_per_cm3")
    medium_and_method = [_medium(results), texts("Method", "method", note="reason")]
    columns = [
        *medium_and_method,
        PageColumn(ALPHA_Z + f" fit, {PER_CM3}", fit, "num"),
        numbers(CHI, "chi", ALPHA_DIGITS, ends="chi_{}"),
        numbers(ZETA, "zeta", ALPHA_DIGITS, ends="zeta_{}"),
    ]
    errors = texts("Share of its variance", lambda row: errors_in_words(row["zeta_errors"]))
    method = results.config.fourier.method
    parts: dict[bool, list[Row]] = {True: [], False: []}
    for row in _without_repeated_reasons(results, "penetration.csv"):
        parts[row["method"] in (method, *routines(method))].append(row)
    other_scaling = PageTable("Scaling by the other methods", columns, parts[False])
    rows_with_errors = [row for row in parts[True] if row["zeta_errors"]]
    return PageTable(
        f"Errors behind {ZETA}", [*medium_and_method, errors], rows_with_errors
    ), other_scaling


_RMS_OVER_PEAK = numbers(
    "RMS over peak", "rms_relative_to_peak", show=lambda x: share(x).lstrip("+")
)


def tabulate_leg_errors(results: Results) -> PageTable:
    """Peak and shape errors of every leg, medium and profile."""
    order: dict[str, Sequence[str]] = {
        "medium": list(results.config.media),
        "leg": list(results.config.intruders),
        "profile": list(PROFILES),
        "component": ["z", "x"],
    }

    def place(row: Row) -> list[int]:
        return [[*names, row[name]].index(row[name]) for name, names in order.items()]

    rows = []
    for row in _without_repeated_reasons(results, "leg_errors.csv"):
        in_words = errors_in_words(row["peak_errors"])
        about_peak = {"peak_errors": in_words and f"variance: {in_words}"}
        codes = row["reason_code"].split()
        if STEEP in codes:
            about_peak = {"peak_errors": row["reason"], "reason": ""}
        elif codes == [OTHER_FORM]:
            about_peak["reason"] = ""  # said of all nine terms above the table
        rows.append(row | about_peak)
    predicted = "peak_predicted_N", 2, "peak_predicted_{}_N", "peak_errors"
    columns = [
        _medium(results),
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
    return PageTable("Leg errors", columns, sorted(rows, key=place), tall=True)


LESSON_WORDS = {
    "plates": "plates of this medium",
    "other-leg": "plates and another leg",
    "same-leg-elsewhere": "plates, and this leg in other media",
}


def tabulate_contacts(results: Results) -> PageTable:
    """Errors of the legs by what their prediction was learned from, of laboratory media and of sands."""
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
    """Penetration of the natural sands, by the stated and by the detected linear regime."""
    alpha = "alpha_z_N_per_cm3", 4, "alpha_z_{}_N_per_cm3"
    columns = [
        _medium(results, "Sand"),
        texts("Run", "run_id"),
        texts("Window", "window"),
        numbers("Fitted to, cm", "linear_to_cm", 2),
        numbers(ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}", *alpha),
        numbers("Departure from a line", "nonlinear_z_ratio", note="reason", show=share),
    ]
    rows = _without_repeated_reasons(results, "sands.csv")
    for row in rows:
        cell = cell_at(results[row["medium"]].alpha, 0, 90)
        # the same push over the same window: one interval, not two that differ by their degrees of freedom
        if cell is not None and row["window"] == "stated" and cell["run_ids"] == row["run_id"]:
            row |= {name: cell[name] for name in (column("z", "_lo"), column("z", "_hi"))}
    return PageTable("Penetration of natural sands", columns, rows)


def _without_repeated_reasons(results: Results, name: str) -> list[dict[str, Any]]:
    """Rows of a table, without the reasons that the page says once."""
    shared_codes = {
        medium.name: codes_of(medium.flags.shared(medium.fits)).split() for medium in results
    }
    rows = records(results.table(name))
    for row in rows:
        if {*row["reason_code"].split()} <= {
            "published-media",
            *shared_codes.get(row["medium"], ()),
        }:
            row["reason"] = ""
    return rows


def tabulate_corrections(results: Results) -> PageTable:
    """Factors on the predicted forces in natural sands, and whether they help on a leg left out."""

    def earns(row: Row) -> str:
        if row["model"] == MODELS[0]:
            return ""
        return "yes" if row["earns_its_place"] else "no"

    columns = [
        _medium(results, "Sand"),
        texts("Correction", "model"),
        numbers(Markup("factor of F<sub>z</sub>"), "factor_z", 2),
        numbers(Markup("factor of F<sub>x</sub>"), "factor_x", 2),
        numbers("RMS error, fitted, N", "rms_fit_N", 2),
        numbers("RMS error, cross-validated, N", "rms_cv_N", 2),
        numbers("Gain", "gain_cv_percent", show=percent),
        texts(f"Gains {100 * WORTH:g} % or more", earns, "reason"),
    ]
    return PageTable("Corrections", columns, records(results.table("sand_correction.csv")))


_MEDIA_CODES = re.compile(rf"\b(?:{'|'.join(map(re.escape, MEDIA))})\b")


def tabulate_reproduction(results: Results) -> tuple[dict[str, str], PageTable, PageTable]:
    """Ours beside the paper's: verdicts counted by their evidence, what is not the same, and all of it.

    What was not measured is left out, and all of it where that is the most of what the data could meet.
    """
    titles = {
        medium.settings.published_as or medium.name: medium.title.replace(",", "")
        for medium in results
    }

    def with_titles(text: Any) -> Any:
        """Write media by their titles; a comma parts the entries of a list."""
        return _MEDIA_CODES.sub(lambda code: titles.get(code[0], code[0]), str(text))

    def item(row: Row) -> Cell:
        return Cell(with_titles(row["item"]), (row["where"],))

    def paper(row: Row) -> Cell:
        within, reason = _significant(row["tolerance"]), in_brackets(row["tolerance_reason"])
        note = f"\N{PLUS-MINUS SIGN} {within}{reason}" if within else ""
        return Cell(with_titles(_significant(row["paper"])), (note,))

    def ours(row: Row) -> Cell:
        ends = _significant(row["lo"]), _significant(row["hi"])
        interval_text = " to ".join(ends) if all(ends) else ""
        return Cell(with_titles(_significant(row["ours"])), (interval_text,))

    def verdict(row: Row) -> Cell:
        css_classes = "verdict " + row["verdict"].replace(" ", "-")
        return Cell(row["verdict"], (row["evidence"], with_titles(row["why"])), css_classes)

    columns = [
        PageColumn("Item", item),
        PageColumn("Paper", paper, "num"),
        PageColumn("Ours", ours, "num"),
    ]
    columns += [PageColumn("Verdict", verdict)]
    all_rows = records(results.table("reproduction.csv"))
    rows = [row for row in all_rows if row["verdict"] != NOT_MEASURED]
    met, possible = (
        sum(row["evidence"] != TEXT for row in counted_rows) for counted_rows in (rows, all_rows)
    )
    rows = [] if 2 * met < possible else rows
    of_each = Counter((row["evidence"], row["verdict"]) for row in rows)
    sums = {
        evidence: [
            f"{of_each[evidence, verdict_word]} {verdict_word}"
            for verdict_word in VERDICTS
            if of_each[evidence, verdict_word]
        ]
        for evidence in EVIDENCE
    }
    counts = {evidence: ", ".join(words) for evidence, words in sums.items() if words}
    differing_rows = [row for row in rows if row["verdict"] != SAME]
    different = PageTable("Items that are not the same", columns, differing_rows, tall=True)
    return counts, different, PageTable("All items", columns, rows, tall=True)


def tabulate_dropped(results: Results, outcome: Outcome) -> PageTable:
    """Runs that gave no result, and why."""
    columns = [texts("Run", "run_id"), _medium(results), texts("Kind", "kind")]
    columns += [
        texts("Rows", "rows", css_classes="num"),
        texts("Reason", "reasons", css_classes="why"),
    ]
    return PageTable("Runs that gave no result", columns, outcome.dropped, tall=True)


def tabulate_logs(results: Results) -> PageTable:
    """What became of the rows of all logs."""
    columns = [texts("Fate", "fate"), texts("Reason or use", "reason")]
    columns += [texts("Runs", "runs", css_classes="num"), texts("Rows", "rows", css_classes="num")]
    return PageTable("Rows by fate", columns, rows_by_reason(results))


def _medium(results: Results, heading: str = "Medium") -> PageColumn:
    return texts(heading, lambda row: medium_title(results, row["medium"]))


def _significant(x: Any) -> str:
    """Print a number with four significant digits; text as it is, nothing where there is none."""
    try:
        number = float(x)
    except ValueError:
        return str(x)
    return "" if math.isnan(number) else f"{number:.4g}".replace("-", "\N{MINUS SIGN}")
