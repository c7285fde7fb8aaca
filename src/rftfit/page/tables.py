"""The tables of the page, each spelled once: its columns, where they come from, how they are printed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from rftfit.compare.legs import FAR_OFF, NOT_TESTED, OFF, WITHIN
from rftfit.compare.published import EVIDENCE, NOT_MEASURED, SAME, TEXT, VERDICTS
from rftfit.compare.sensitivity import shapes
from rftfit.figures.labels import PROFILES, in_brackets, name_of, percent, span
from rftfit.figures.maps import lies_on_grid, pivot
from rftfit.figures.registry import greek
from rftfit.figures.style import degrees, number
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.depths import power_of
from rftfit.measure.fits import shared_flags
from rftfit.measure.flags import codes_of
from rftfit.measure.verdicts import DOUBTFUL
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import GENERIC, routines
from rftfit.page.cells import Cell, Column, Row, Table, number_column, records, share, text_column
from rftfit.page.outcome import (
    NOTHING,
    SOUND,
    VERDICT_WORDS,
    Outcome,
    most_serious_flag,
    rows_by_reason,
    verdict_of,
    verdicts_on_legs,
)
from rftfit.results import Results

ALPHA_Z, ALPHA_X = (Markup(f"\N{GREEK SMALL LETTER ALPHA}<sub>{c}</sub>") for c in "zx")
ANGLES = {"\N{GREEK SMALL LETTER BETA}": "beta", "\N{GREEK SMALL LETTER GAMMA}": "gamma"}
ZETA, CHI = "\N{GREEK SMALL LETTER ZETA}", "\N{GREEK SMALL LETTER CHI}"
PER_CM3 = "N/cm\N{SUPERSCRIPT THREE}"
DEGREE = "\N{DEGREE SIGN}"


def title_of(results: Results, medium: str) -> str:
    """Title of a medium as the user wrote it."""
    own = {"": "in air", GENERIC: "generic, no unit"}
    return (own | results.titles).get(medium, medium)


def summary(results: Results, outcome: Outcome) -> Table:
    """One row a medium: how far its data and the model on its legs can be trusted."""
    dropped = Counter(run["medium"] for run in outcome.dropped)

    def title(row: Row) -> Cell:
        used, lost = outcome.used[row["medium"]], dropped[row["medium"]]
        told = [f"{used} run{'s' * (used != 1)}"]
        told = ["natural sand"] * (row["medium"] in results.sands) + told
        # the verdict stands beside it
        return Cell(
            results.campaign.titles[row["medium"]],
            (", ".join([*told, f"{lost} dropped"] if lost else told),),
        )

    def data(row: Row) -> Cell:
        word, why = verdict_of(results, row["medium"])
        count = most_serious_flag(results, row["medium"])[1]
        flags = f"{count} flag{'s' * (count != 1)}" if count and word == SOUND else ""
        places = {SOUND: "", NOTHING: "#dropped"}
        look = {SOUND: "same", DOUBTFUL: "doubtful"}.get(word, "differs")
        return Cell(
            word, (why, flags), f"verdict {look}", places.get(word, f"#checks-{row['medium']}")
        )

    def on_legs(row: Row) -> Cell:
        _, code, note = verdicts_on_legs(results, row["medium"])[0]
        look = {WITHIN: "same", OFF: "doubtful", FAR_OFF: "differs"}.get(code, "faint")
        section = "#sands" if row["medium"] in results.sands else "#legs"
        link = "" if code == NOT_TESTED else section
        return Cell(VERDICT_WORDS[code], (note,), f"verdict {look}", link)

    model = [Column("Model on legs", on_legs)] if results.config.legs else []
    return Table(
        "Summary table",
        [Column("Medium", title), Column("Data", data), *model],
        [{"medium": medium} for medium in results.media],
    )


def alphas(results: Results) -> list[tuple[str, Table]]:
    """Alpha of every medium with its interval, for paper: rows of beta, columns of gamma, or a list of directions."""
    found = []
    for one in results:
        known = one.alpha[one.alpha[column("z")].notna()]
        if not lies_on_grid(one.alpha):
            columns = [
                number_column(f"{name}, {DEGREE}", f"{key}_deg", 1) for name, key in ANGLES.items()
            ]
            columns += [
                number_column({"z": ALPHA_Z, "x": ALPHA_X}[c], column(c), ends=column(c, "_{}"))
                for c in "zx"
            ]
            found.append(
                (f"{one.title}, {PER_CM3}", Table(f"Alpha, {one.title}", columns, records(known)))
            )
            continue
        for c in "zx" if len(known) else "":
            beta, gamma, _ = pivot(one.alpha, column(c))
            cells = {end: pivot(one.alpha, column(c, end))[2] for end in ("", "_lo", "_hi")}
            rows = [
                {"beta": angle}
                | {f"{end}{k}": cells[end][i, k] for end in cells for k in range(len(gamma))}
                for i, angle in enumerate(beta)
            ]
            columns = [
                number_column(
                    "\N{GREEK SMALL LETTER BETA} \\ \N{GREEK SMALL LETTER GAMMA}", "beta", 0
                )
            ]
            columns += [
                number_column(degrees(angle), str(k), ends=f"_{{}}{k}")
                for k, angle in enumerate(gamma)
            ]
            label = Markup("{}, {}, {}").format({"z": ALPHA_Z, "x": ALPHA_X}[c], one.title, PER_CM3)
            found.append((label, Table(f"alpha_{c}, {one.title}", columns, rows)))
    return found


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
    rows = _without_repeated_reasons(results, "penetration.csv")
    own = (method, *routines(method))
    return (
        Table("Scaling table", columns, [row for row in rows if row["method"] in own]),
        Table(
            "Scaling by the other methods",
            columns,
            [row for row in rows if row["method"] not in own],
        ),
    )


def shapes_of_legs(results: Results) -> Table:
    """Peaks within the paper's bound by the measured table, with the legs as stated and with other shapes."""
    found = [one._asdict() for one in shapes(results.table("leg_sensitivity.csv"))]
    return Table(
        "Peaks by the shape of the legs",
        [
            text_column(
                "Shape (face ahead: by half the thickness)", lambda row: greek(row["name"])
            ),
            text_column("Lifts", lambda row: f"{row['lifts']} of {row['of']}", look="num"),
            text_column("Thrusts", lambda row: f"{row['thrusts']} of {row['of']}", look="num"),
            number_column("Worst lift", "worst", show=percent),
        ],
        found,
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

    rows = _without_repeated_reasons(results, "leg_errors.csv")
    return Table(
        "Leg errors",
        [
            _medium(results),
            text_column("Leg", lambda row: name_of(row["leg"])),
            text_column("Profile", lambda row: name_of(row["profile"])),
            text_column("Force", lambda row: Markup(f"F<sub>{row['component']}</sub>")),
            number_column("Peak measured, N", "peak_measured_N", 2, note="reason"),
            number_column(
                "Peak predicted, N",
                "peak_predicted_N",
                2,
                ends="peak_predicted_{}_N",
                note="peak_errors",
            ),
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
        _without_repeated_reasons(results, "sands.csv"),
    )


def _without_repeated_reasons(results: Results, name: str) -> list[dict[str, Any]]:
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

    def item(row: Row) -> Cell:
        return Cell(row["item"], (row["where"],))

    def paper(row: Row) -> Cell:
        within = _significant(row["tolerance"])
        reason = row["tolerance_reason"]
        return Cell(
            _significant(row["paper"]),
            (f"\N{PLUS-MINUS SIGN} {within}{in_brackets(reason)}" if within else "",),
        )

    def ours(row: Row) -> Cell:
        ends = _significant(row["lo"]), _significant(row["hi"])
        return Cell(_significant(row["ours"]), (" to ".join(ends) if all(ends) else "",))

    def verdict(row: Row) -> Cell:
        return Cell(
            row["verdict"],
            (row["evidence"], row["why"]),
            "verdict " + row["verdict"].replace(" ", "-"),
        )

    columns = [
        Column("Item", item),
        Column("Paper", paper, "num"),
        Column("Ours", ours, "num"),
        Column("Verdict", verdict),
    ]
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
        Table("Items that are not the same", columns, others, tall=True),
        Table("All items", columns, rows, tall=True),
    )


def dropped(results: Results, outcome: Outcome) -> Table:
    """Runs that gave no result, and why."""
    return Table(
        "Runs that gave no result",
        [
            text_column("Run", "run_id"),
            _medium(results),
            text_column("Kind", "kind"),
            text_column("Rows", "rows", look="num"),
            text_column("Reason", "reasons", look="why"),
        ],
        outcome.dropped,
        tall=True,
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
