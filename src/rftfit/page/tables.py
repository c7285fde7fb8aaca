"""The tables of the page, each spelled once: its columns, where they come from, how they are printed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from rftfit.compare.legs import FAR_OFF, NOT_TESTED, OFF, WITHIN
from rftfit.compare.published import EVIDENCE, NOT_MEASURED, SAME, TEXT, VERDICTS
from rftfit.figures.labels import PROFILES, lift_errors, name_of, percent, span
from rftfit.figures.style import number
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.depths import power_of
from rftfit.measure.fits import shared_flags
from rftfit.measure.flags import codes_of
from rftfit.measure.verdicts import DOUBTFUL
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import GENERIC, routines
from rftfit.page.cells import Cell, Column, Row, Table, number_column, records, share, text_column
from rftfit.page.findings import misfits
from rftfit.page.outcome import (
    NOTHING,
    SOUND,
    VERDICT_WORDS,
    Outcome,
    gravest_doubt,
    rows_by_reason,
    verdict_of,
    verdicts_on_legs,
)
from rftfit.page.reversal import FLAT, REVERSED, Reversal, reversals
from rftfit.results import Results

ALPHA_Z = Markup("\N{GREEK SMALL LETTER ALPHA}<sub>z</sub>")
ZETA, CHI = "\N{GREEK SMALL LETTER ZETA}", "\N{GREEK SMALL LETTER CHI}"
PER_CM3 = "N/cm\N{SUPERSCRIPT THREE}"
DEGREE = "\N{DEGREE SIGN}"


def title_of(results: Results, medium: str) -> str:
    """Title of a medium as the user wrote it."""
    own = {"": "in air", GENERIC: "generic, no unit"}
    return (own | results.titles).get(medium, medium)


def summary(results: Results, outcome: Outcome) -> Table:
    """One row a medium: what a reader wants to know first."""
    method = results.config.fourier.method
    rows = _untold(results, "penetration.csv")
    own = [row for row in rows if row["method"] in (method, *routines(method))]
    scaled = {str(row["medium"]): row for row in reversed(own)}
    dropped = Counter(run["medium"] for run in outcome.dropped)
    lift = {
        (row["medium"], row["leg"], row["profile"]): percent(row["peak_error_percent"])
        for row in records(lift_errors(results, results.media))
        if math.isfinite(row["peak_measured_N"])
    }
    legs = [leg for leg in results.config.intruders if any(leg == name for _, name, _ in lift)]

    shares, (_, of_map) = misfits(results), peaks_from(results)
    # a campaign without legs has no word of them
    model = "model on legs" if results.config.legs else "model"

    def title(row: Row) -> Cell:
        return Cell(title_of(results, row["medium"]), ("natural sand",) if row["sand"] else ())

    def verdict(row: Row) -> Cell:
        word, why = verdict_of(results, row["medium"])
        flag, count = gravest_doubt(results, row["medium"])
        more = f"{flag} ({count} flags in all)" if count > 1 else flag
        notes = (why,) if why and word != NOTHING else (why, more, row.get("reason", ""))
        places = {SOUND: "", NOTHING: "#dropped"}
        link = places.get(word, f"#checks-{row['medium']}")
        look = {SOUND: "same", DOUBTFUL: "doubtful"}.get(word, "differs")
        return Cell(word, notes, f"verdict {look}", link)

    def on_legs(row: Row) -> Cell:
        found = verdicts_on_legs(results, row["medium"])
        (_, code, note), *others = found
        more = (f"{name_of(kind)}: {VERDICT_WORDS[one]}; {why}" for kind, one, why in others)
        look = {WITHIN: "same", OFF: "doubtful", FAR_OFF: "differs"}.get(code, "faint")
        link = "" if code == NOT_TESTED else "#sands" if row["sand"] else "#legs"
        return Cell(VERDICT_WORDS[code], (note, *more), f"verdict of-model {look}", link)

    def chi(row: Row) -> Cell:
        cell = number_column("", "chi", ends="chi_{}").cell(row)
        borrowed = row["sand"] and math.isfinite(row.get("chi", math.nan))
        return Cell(cell.text, (*cell.notes, "not measured" if borrowed else ""))

    def misfit(row: Row) -> Cell:
        share = shares.get(row["medium"])
        return Cell("" if share is None else f"{number(share, 1)} %")

    def runs(row: Row) -> Cell:
        count = dropped[row["medium"]]
        note = f"{count} dropped" if count else ""
        return Cell(str(outcome.used[row["medium"]]), (note,), "bad" if count else "")

    def peak(leg: str) -> Column:
        def cell(row: Row) -> Cell:
            profile = "map" if row["medium"] in of_map else "table"
            return Cell(lift.get((row["medium"], leg, profile), "not measured"))

        name = name_of(leg)
        return Column(name, cell, "num", "Error of peak lift", f"peak lift, {name}")

    return Table(
        "Summary table",
        [
            Column("Medium", title),
            Column("data", verdict, group="Verdict on", label="verdict on the data"),
            Column(model, on_legs, group="Verdict on", label=f"verdict on the {model}"),
            Column("Runs", runs, "num"),
            number_column(ZETA, "zeta", ends="zeta_{}"),
            Column(CHI, chi, "num"),
            Column("Nine terms miss", misfit, "num"),
            *(peak(leg) for leg in legs),
        ],
        [
            {**scaled.get(medium, {}), "medium": medium, "sand": medium in results.sands}
            for medium in results.media
        ],
        cards=True,
    )  # fmt: skip


def peaks_from(results: Results) -> tuple[list[str], list[str]]:
    """Media whose peak lift is predicted from the measured table, and those where that is not whole, from the map."""
    errors = lift_errors(results, results.media)
    known = errors[errors["peak_error_percent"].notna()]
    table, of_map = (known.loc[known["profile"] == name, "medium"] for name in ("table", "map"))
    return list(table), list(of_map[~of_map.isin(table)])


def at_depths(results: Results) -> Table:
    """One row a medium whose stress is curved: alpha of a level plate straight down at depths in its window."""
    depths, rows = results.config.fit.depths_cm, []
    for medium in results:
        power = power_of(medium.fits, results.table(f"checks/{medium.name}.csv"))
        row: dict[str, Any] = {"medium": medium.name, "power": power}
        if math.isnan(power):
            continue
        for at, table in medium.alpha_at_depth.groupby("depth_cm"):
            cell = cell_at(table, 0, 90)
            if cell is not None and math.isfinite(cell[column("z")]):
                row |= {f"{end}{at:g}": cell[column("z", end)] for end in ("", "_lo", "_hi")}
        rows += [row] if len(row) > 2 else []
    head = ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}, at "
    return Table(
        "Alpha at stated depths",
        [
            _medium(results),
            number_column("Power of depth", "power", 2),
            *(number_column(head + f"{at:g} cm", f"{at:g}", ends=f"_{{}}{at:g}") for at in depths),
        ],
        rows,
    )


def coefficients(results: Results, method: str) -> Table:
    """Coefficients of all media by one method, dropped ones in brackets, and what nine terms miss."""
    table = results.table("coefficients.csv")
    rows = records(table[table["method"] == method])
    found = {(row["medium"], row["coefficient"]): row for row in rows}

    def of(medium: str) -> Column:
        def cell(row: Row) -> Cell:
            if "of" in row:
                return Cell(
                    number(found.get((medium, row["of"]), {}).get("misfit_rms_N_per_cm3"), 4)
                )
            one = found.get((medium, row["term"]), {})
            text = number(one.get("value_N_per_cm3"), 4)
            notes = (span(one.get("lo"), one.get("hi"), 4), one.get("reason", ""))
            if one.get("kept", True):
                return Cell(text, notes)
            return Cell(f"[{text}]", notes, "faint")

        return Column(title_of(results, medium), cell, "num")

    media = dict.fromkeys(str(row["medium"]) for row in rows)
    columns = [text_column("Term", "term"), *(of(medium) for medium in media)]
    rows = [{"term": term} for term in TERMS]
    if any(math.isfinite(one["misfit_rms_N_per_cm3"]) for one in found.values()):
        rows += [
            {"term": Markup(f"misfit of \N{GREEK SMALL LETTER ALPHA}<sub>{c}</sub>, rms"), "of": of}
            for c, of in (("z", "A00"), ("x", "C11"))
        ]
    return Table(f"Coefficients by {method}", columns, rows)


def spreads(results: Results) -> list[tuple[str, str]]:
    """Where the spread from run to run of each medium is known from."""
    found = []
    for one in results:
        known = one.alpha.loc[one.alpha["alpha_z_se_N_per_cm3"].notna(), "spread"]
        if len(known):
            found.append((one.title, ", ".join(dict.fromkeys(filter(None, known)))))
    found = [(title, words) for title, words in found if words]
    if len(found) > 1 and len({words for _, words in found}) == 1:
        return [("all media", found[0][1])]
    return found


def methods(results: Results) -> list[str]:
    """Methods that gave coefficients, the configured one first."""
    table = results.table("coefficients.csv")
    found = dict.fromkeys(map(str, table.loc[table["value_N_per_cm3"].notna(), "method"]))
    return sorted(found, key=lambda method: method != results.config.fourier.method)


def scaling(results: Results) -> tuple[Table, Table]:
    """Penetration, zeta and chi of every medium by the configured method, and by the others."""

    def fit(row: Row) -> Cell:
        if row["medium"] in results.sands:
            return Cell("not fitted: one test only")
        return fitted.cell(row)

    fitted = number_column("", "alpha_z_fit_N_per_cm3", ends="alpha_z_fit_{}_N_per_cm3")
    columns = [
        _medium(results),
        text_column("Method", "method", note="reason"),
        number_column(
            ALPHA_Z + f" measured, {PER_CM3}", "alpha_z_measured_N_per_cm3",
            ends="alpha_z_measured_{}_N_per_cm3",
        ),
        Column(ALPHA_Z + f" fit, {PER_CM3}", fit, "num"),
        number_column(CHI, "chi", ends="chi_{}"),
        number_column(ZETA, "zeta", ends="zeta_{}"),
        text_column(f"Errors behind {ZETA}, share of the variance", "zeta_errors"),
    ]  # fmt: skip
    method = results.config.fourier.method
    rows = _untold(results, "penetration.csv")
    own = (method, *routines(method))
    return (
        Table("Scaling table", columns, [row for row in rows if row["method"] in own]),
        Table(
            "Scaling by the other methods",
            columns,
            [row for row in rows if row["method"] not in own],
        ),
    )


def reversal(results: Results) -> Table:
    """Peak lift of flat and reversed leg, and what the deepest elements of the latter say of it."""

    def peak(source: str, leg: str, group: str) -> Column:
        def cell(row: Row) -> Cell:
            found: Reversal = row["found"]
            text = number(found.peaks.get((source, leg)), 2)
            above = leg == REVERSED and found.above(source)
            return Cell(text, ("above the flat leg",), "bad") if above else Cell(text)

        return Column("flat leg" if leg == FLAT else "reversed", cell, "num", group)

    def deep(row: Row) -> Cell:
        found: Reversal = row["found"]
        alpha, lift = found.alpha_z_N_per_cm3, found.lift_N
        mean = f": nine terms {number(alpha['fourier'])}, table {number(alpha['table'])}"
        note = (
            f"lift {number(lift['fourier'], 2)} N and {number(lift['table'], 2)} N; "
            f"\N{GREEK SMALL LETTER THETA} {number(found.theta_deg, 0)}{DEGREE}, "
            f"\N{GREEK SMALL LETTER BETA} {span(*found.beta_deg, 0)}{DEGREE}, \N{GREEK SMALL LETTER GAMMA} {span(*found.gamma_deg, 0)}{DEGREE}"
        )
        return Cell(ALPHA_Z + mean, (note,))

    sources = {
        "measured": "Experiment, N",
        "table": "By the table, N",
        "fourier": "By nine terms, N",
    }
    pairs = [
        peak(source, leg, group) for source, group in sources.items() for leg in (FLAT, REVERSED)
    ]
    return Table(
        "Peak lift of flat and reversed leg",
        [_medium(results), *pairs, Column("Deepest third of the reversed c-leg", deep, "why")],
        [{"medium": found.medium, "found": found} for found in reversals(results)],
    )


def leg_errors(results: Results) -> Table:
    """Peak and shape errors of every leg, medium and profile."""
    order: dict[str, Sequence[str]] = {
        "medium": list(results.config.media),
        "leg": list(results.config.intruders),
        "profile": list(PROFILES),
        "component": ["z", "x"],
    }

    def place(row: Row) -> list[int]:
        return [
            names.index(row[name]) if row[name] in names else len(names)
            for name, names in order.items()
        ]

    rows = _untold(results, "leg_errors.csv")
    return Table(
        "Leg errors",
        [
            _medium(results),
            text_column("Leg", lambda row: name_of(row["leg"])),
            text_column("Profile", lambda row: name_of(row["profile"])),
            text_column("Force", lambda row: Markup(f"F<sub>{row['component']}</sub>")),
            number_column("Peak measured, N", "peak_measured_N", 2, note="reason"),
            number_column("Peak predicted, N", "peak_predicted_N", 2, ends="peak_predicted_{}_N"),
            number_column("Error of peak", "peak_error_percent", show=percent),
            number_column("Peak late, \N{DEGREE SIGN}", "peak_late_deg", 1),
            number_column("RMS error, N", "rms_error_N", 2),
            number_column(
                "RMS over peak", "rms_relative_to_peak", show=lambda x: share(x).lstrip("+")
            ),
            number_column("R\N{SUPERSCRIPT TWO}", "r2", 2),
        ],
        sorted(rows, key=place),
        tall=True,
    )


def sands(results: Results) -> Table:
    """Penetration of the natural sands, by the stated and by the detected linear regime."""
    return Table(
        "Penetration of natural sands",
        [
            _medium(results, "Sand"),
            text_column("Run", "run_id"),
            text_column("Window", "window", note="reason"),
            number_column("Linear to, cm", "linear_to_cm", 2),
            number_column(
                ALPHA_Z + f"(0, 90{DEGREE}), {PER_CM3}",
                "alpha_z_N_per_cm3",
                ends="alpha_z_{}_N_per_cm3",
            ),
            number_column("Departure from a line", "nonlinear_z_ratio", show=share),
            number_column(ZETA, "zeta", ends="zeta_{}"),
        ],
        _untold(results, "sands.csv"),
        cards=True,
    )


def _untold(results: Results, name: str) -> list[dict[str, Any]]:
    """Rows of a table, without the reasons that the page says once."""
    once = {one.name: codes_of(shared_flags(one.fits)).split() for one in results}
    rows = records(results.table(name))
    for row in rows:
        if {*row["reason_code"].split()} <= {"published-media", *once.get(row["medium"], ())}:
            row["reason"] = ""
    return rows


def corrections(results: Results) -> Table:
    """Factors on the predicted forces in natural sands, and whether they help on a leg left out."""
    return Table(
        "Corrections",
        [
            _medium(results, "Sand"),
            text_column("Correction", "model"),
            number_column(Markup("factor of F<sub>z</sub>"), "factor_z", 2),
            number_column(Markup("factor of F<sub>x</sub>"), "factor_x", 2),
            number_column("RMS error, fitted, N", "rms_fit_N", 2),
            number_column("RMS error, cross-validated, N", "rms_cv_N", 2),
            number_column("Gain", "gain_cv_percent", show=percent),
            text_column(
                "Earns its place",
                lambda row: "yes" if row["earns_its_place"] else "no",
                note="reason",
            ),
        ],
        records(results.table("sand_correction.csv")),
    )


def reproduction(results: Results) -> tuple[dict[str, str], Table, Table]:
    """Ours beside the paper's: verdicts counted by their evidence, what is not the same, and all of it.

    What was not measured is left out, and all of it where that is the most of what the data could meet.
    """

    def ours(row: Row) -> Cell:
        ends = _significant(row["lo"]), _significant(row["hi"])
        return Cell(_significant(row["ours"]), (" to ".join(ends) if all(ends) else "",))

    def verdict(row: Row) -> Cell:
        return Cell(row["verdict"], look="verdict " + row["verdict"].replace(" ", "-"))

    columns = [
        text_column("Item", "item"),
        text_column("Where", "where"),
        text_column("Paper", lambda row: _significant(row["paper"]), look="num"),
        Column("Ours", ours, "num"),
        text_column(
            "Tolerance", lambda row: _significant(row["tolerance"]), look="num",
            note="tolerance_reason",
        ),
        Column("Verdict", verdict),
        text_column("Evidence", "evidence"),
        text_column("Why", "why", look="why"),
    ]  # fmt: skip
    every = records(results.table("reproduction.csv"))
    rows = [row for row in every if row["verdict"] != NOT_MEASURED]
    if 2 * sum(row["evidence"] != TEXT for row in rows) < sum(
        row["evidence"] != TEXT for row in every
    ):
        rows = []
    of_each = Counter((row["evidence"], row["verdict"]) for row in rows)
    told = {
        evidence: [f"{of_each[evidence, one]} {one}" for one in VERDICTS if of_each[evidence, one]]
        for evidence in EVIDENCE
    }
    counts = {evidence: ", ".join(words) for evidence, words in told.items() if words}
    others = [row for row in rows if row["verdict"] != SAME]
    return (
        counts,
        Table("Items that are not the same", columns, others, tall=True, cards=True),
        Table("All items", columns, rows, tall=True, cards=True),
    )


def dropped(results: Results, outcome: Outcome) -> Table:
    """Runs that gave no result, and why."""
    return Table(
        "Dropped runs",
        [
            text_column("Run", "run_id"),
            _medium(results),
            text_column("Kind", "kind"),
            text_column("Rows", "rows", look="num"),
            text_column("Reason", "reasons", look="why"),
        ],
        outcome.dropped,
        tall=True,
        cards=True,
    )


def rows_of_logs(results: Results) -> Table:
    """What became of the rows of all logs."""
    return Table(
        "Rows by fate",
        [
            text_column("Fate", "fate"),
            text_column("Reason or use", "reason"),
            text_column("Runs", "runs", look="num"),
            text_column("Rows", "rows", look="num"),
        ],
        rows_by_reason(results),
    )


def _medium(results: Results, heading: str = "Medium") -> Column:
    return text_column(heading, lambda row: title_of(results, row["medium"]))


def _significant(x: Any) -> str:
    """Print a number with four significant digits; text as it is, nothing where there is none."""
    try:
        number = float(x)
    except ValueError:
        return str(x)
    return "" if math.isnan(number) else f"{number:.4g}".replace("-", "\N{MINUS SIGN}")
