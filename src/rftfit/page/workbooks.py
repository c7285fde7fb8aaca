"""Workbooks in the layouts of the paper's Tables S5 (alpha) and S2 (coefficients); equal results give equal bytes.

`Book` wraps the library that writes xlsx files; rows and columns of a sheet count from 0. Functions that write a block
of a sheet take the row where it begins, and return the next free row.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium, such as ``alpha`` (a row a direction).
"""

from __future__ import annotations

import datetime as dt
import io
import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import pandas as pd
from xlsxwriter.worksheet import Worksheet

from rftfit import reference
from rftfit.figures.labels import alpha_half_width
from rftfit.figures.maps import lies_on_grid, pivot
from rftfit.figures.style import level
from rftfit.measure.flags import format_remarks
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import GENERIC
from rftfit.results import Results
from rftfit.version import __version__

# a fixed date of creation: the real one would make each file differ
_CREATED = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)

_TITLE_ROWS = 2
"""Number of rows at the head of each sheet: its title, and remarks."""

_A4 = 9
"""Number of the paper size in Excel."""

_FORMATS: dict[str, dict[str, Any]] = {
    "title": {"bold": True, "font_size": 12},
    "block": {"bold": True},
    "head": {"bold": True, "bottom": 1, "align": "right"},
    "side": {"bold": True, "align": "right"},
    "angle": {"bold": True, "bottom": 1, "num_format": "0.##"},
    "angle_side": {"bold": True, "num_format": "0.##"},
    "number": {"num_format": "0.0000"},
    "grey": {"num_format": "0.0000", "font_color": "#9A9A9A", "italic": True},
    "missing": {"font_color": "#C00000", "align": "right"},
    "text": {},
}
"""Formats of cells: options of the library by our name, the `form` of a cell."""


class Book:
    """A workbook and its formats, in memory; no text of the user becomes a formula or a link. `close` returns its bytes."""

    def __init__(self) -> None:
        import xlsxwriter

        self._file = io.BytesIO()
        options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False}
        self.workbook = xlsxwriter.Workbook(self._file, options)
        self.workbook.set_properties({"created": _CREATED, "author": "rftfit"})
        self.formats = {
            name: self.workbook.add_format(properties) for name, properties in _FORMATS.items()
        }
        self._names: set[str] = set()

    def add_sheet(self, name: str) -> Worksheet:
        """Add an empty sheet with the settings of all sheets; its name is changed so that spreadsheet programs accept it.

        They accept at most 31 letters, without some signs, and different from other names without regard to case.
        """
        clean = re.sub(r"[\[\]:*?/\\]", "_", name).strip("'")[:31] or "sheet"
        unique, count = clean, 1
        # spreadsheet programs reserve the name "history"
        while unique.casefold() in self._names | {"history"}:
            count += 1
            unique = f"{clean[: 30 - len(str(count))]}_{count}"
        self._names.add(unique.casefold())
        sheet = self.workbook.add_worksheet(unique)
        # title rows and first column stay visible on screen, and are repeated on each printed page
        sheet.freeze_panes(_TITLE_ROWS, 1)
        sheet.repeat_rows(0, _TITLE_ROWS - 1)
        sheet.repeat_columns(0)
        sheet.set_landscape()
        sheet.set_paper(_A4)
        sheet.fit_to_pages(1, 0)
        sheet.set_footer("&L&A&Rpage &P of &N")
        return sheet

    def put_text(
        self, sheet: Worksheet, row: int, column: int, text: str, form: str = "text"
    ) -> None:
        """Write text into a cell as text, whatever its first letters are; `form`: key of `_FORMATS`."""
        # sheet.write would make "=..." a formula and "http..." a link
        sheet.write_string(row, column, text, self.formats[form])

    def write_number(
        self,
        sheet: Worksheet,
        row: int,
        column: int,
        value: float,
        form: str = "number",
        reason: str = "",
    ) -> None:
        """Write a number into a cell in full precision; its format shows fewer digits.

        NaN becomes "no value", or with a `reason` "no run" and the reason as a comment.
        """
        if math.isfinite(value):
            sheet.write_number(row, column, value, self.formats[form])
            return
        self.put_text(sheet, row, column, "no run" if reason else "no value", "missing")
        if reason:
            sheet.write_comment(row, column, reason, {"x_scale": 2, "author": "rftfit"})

    def add_about(self, title: str, lines: list[str]) -> None:
        """Add the first sheet, "About": title, version of the program, and lines about the content."""
        sheet = self.add_sheet("About")
        sheet.freeze_panes(_TITLE_ROWS, 0)
        sheet.set_column(0, 0, 110)
        self.put_text(sheet, 0, 0, title, "title")
        version_line = f"Made by rftfit {__version__}."
        for row, line in enumerate([version_line, *lines], start=2):
            self.put_text(sheet, row, 0, line)

    def close(self) -> bytes:
        """End the workbook; return the bytes of its file."""
        self.workbook.close()
        return self._file.getvalue()


# lines of the sheets "About"

_ALPHA = (
    "Resistive-force measurements: vertical and horizontal stress per depth, alpha_z and alpha_x, "
    "over attack angle beta and intrusion angle gamma."
)
_METHODS = (
    "lsq: least squares at the true angles, one weight for each measured direction. dft-index: the "
    "discrete transform on the index grid; "
    "that the paper's Table S2 was made so is inferred from its numbers."
)
_SIGNS = (
    "Signs: alpha_z > 0 pushes up, alpha_x > 0 pushes toward +x. Plate tangent (cos beta, "
    "-sin beta); velocity direction (-cos gamma, -sin gamma), gamma = 90 degrees being straight down."
)


def workbooks(results: Results) -> tuple[bytes, bytes]:
    """Make the bytes of both workbooks: of alpha in the layout of Table S5, and of coefficients in that of Table S2."""
    return alpha_workbook(results), coefficient_workbook(results)


def alpha_workbook(results: Results) -> bytes:
    """Make the workbook of alpha, one sheet per medium: alpha_z, alpha_x (rows beta, columns gamma), then half widths.

    Half widths are those of the interval of the mean of beds, then of the next push into a fresh bed.
    """
    confidence = level(results)
    book = Book()
    lines = [
        _ALPHA,
        f"Layout of additional Table S5 of {reference.CITATION}.",
        "Units: alpha in N/cm^3, angles in degrees.",
        _SIGNS,
        f"Below alpha stand half widths of {confidence} intervals, (upper - lower) / 2.",
        "Interval of alpha: of the mean of the medium over prepared beds.",
        "Interval of the next push: where a single one into a freshly prepared bed will fall.",
        'A cell "no run" has no usable run; its comment says why.',
        "Sheets:",
    ]
    book.add_about(
        "alpha tables", [*lines, *(f"{medium.name}: {medium.title}" for medium in results)]
    )
    for medium in results:
        sheet = book.add_sheet(medium.name)
        sheet.set_column(0, 0, 24)
        sheet.set_column(1, 20, 10)
        book.put_text(sheet, 0, 0, medium.title, "title")
        book.put_text(sheet, 1, 0, format_remarks(results.marks.get(medium.name, ())))
        row, table = 2, medium.alpha
        for c in "zx":
            head = f"alpha_{c} (N/cm^3)"
            row = _write_alpha_block(book, sheet, row, head, table, f"alpha_{c}_N_per_cm3")
        for suffix, label in (("", "alpha_{}"), ("_next", "the next push, alpha_{}")):
            for c in "zx":
                head = f"half width of the {confidence} interval of {label.format(c)} (N/cm^3)"
                widths = table.assign(half=alpha_half_width(table, c, suffix))
                row = _write_alpha_block(book, sheet, row, head, widths, "half")
    return book.close()


def _write_alpha_block(
    book: Book, sheet: Worksheet, row: int, title: str, table: pd.DataFrame, column: str
) -> int:
    """Write one column of an alpha table, as a grid or a list, from a row of the sheet on. Returns the next free row.

    `table`: A row a direction (beta, gamma) of the medium; a list where its directions lie on no grid. `title`: Head of
    the block. A cell without a number gets the reason of its row.
    """
    if not lies_on_grid(table):
        return _write_alpha_list(book, sheet, row, title, table, column)
    beta, gamma, values = pivot(table, column)
    # modulo 180: a plate at beta = -90 degrees is the same plate as at 90
    directions = zip(table["beta_deg"].round(2) % 180, table["gamma_deg"].round(2), strict=True)
    reasons = dict(zip(directions, table["reason"], strict=True))
    book.put_text(sheet, row, 0, title, "block")
    book.put_text(sheet, row + 1, 0, "beta \\ gamma (degrees)", "head")
    for j, angle in enumerate(gamma):
        sheet.write_number(row + 1, j + 1, angle, book.formats["angle"])
    for i, angle in enumerate(beta):
        sheet.write_number(row + 2 + i, 0, angle, book.formats["angle_side"])
        for j, gamma_angle in enumerate(gamma):
            reason = reasons.get((angle % 180, gamma_angle)) or "no reason was recorded"
            book.write_number(sheet, row + 2 + i, j + 1, float(values[i, j]), reason=reason)
    return row + beta.size + 3


def _write_alpha_list(
    book: Book, sheet: Worksheet, row: int, title: str, table: pd.DataFrame, column: str
) -> int:
    """Write one column of an alpha table of scattered directions as a list, a row a direction. Returns the next free row."""
    for j, head in enumerate(("beta (degrees)", "gamma (degrees)", title)):
        book.put_text(sheet, row, j, head, "head")
    rows = zip(table["beta_deg"], table["gamma_deg"], table[column], table["reason"], strict=True)
    for i, (beta, gamma, value, reason) in enumerate(rows, start=row + 1):
        sheet.write_number(i, 0, beta, book.formats["angle_side"])
        sheet.write_number(i, 1, gamma, book.formats["angle_side"])
        book.write_number(sheet, i, 2, value, reason=reason or "no reason was recorded")
    return row + len(table) + 2


def coefficient_workbook(results: Results) -> bytes:
    """Make the workbook of coefficients, one sheet per method: coefficients and zeta, their intervals, published numbers.

    A method is a way of fitting nine terms; the sheet "About" says what each is.
    """
    coefficients = results.table("coefficients.csv")
    lines = [
        "Coefficients of the nine-term Fourier fit of alpha_z and alpha_x, one sheet per method.",
        "Layout of Table S2 of " + reference.CITATION + ".",
        _METHODS,
        "alpha_z = A00 + A10 cos 2b + B11 sin(2b + g) + B01 sin g + Bm1 sin(-2b + g)",
        "alpha_x = C11 cos(2b + g) + C01 cos g + Cm1 cos(-2b + g) + D10 sin 2b",
        "b is beta, g is gamma.",
        _SIGNS,
    ]
    if coefficients.empty:
        lines.append("No medium was measured over the grid of angles: there are no coefficients.")
    book = Book()
    book.add_about("Fourier coefficients", lines)
    for method, rows in coefficients.groupby("method", sort=False):
        _write_coefficient_sheet(book, results, str(method), rows)
    return book.close()


def _write_coefficient_sheet(book: Book, results: Results, method: str, rows: pd.DataFrame) -> None:
    """Write the sheet of one method: a column a medium, with ends of intervals below, and the printed numbers last.

    `rows`: Its rows of the table of coefficients, one for each medium and term. A dropped term is grey: it counts as
    zero.
    """
    titles = results.titles | {GENERIC: GENERIC}
    # the generic profile comes last
    media = sorted(rows["medium"].unique(), key=lambda name: name == GENERIC)
    penetration = results.table("penetration.csv")
    zeta = penetration[penetration["method"] == method].set_index("medium")
    not_kept = rows[~rows["kept"].astype(bool)]
    dropped = {name: set(not_kept.loc[not_kept["medium"] == name, "coefficient"]) for name in media}

    def tabulate_terms(column: str, zeta_column: str) -> pd.DataFrame:
        """Arrange a column of the coefficients, and below it one of the scaling: rows of terms and zeta, columns of media."""
        table = rows.pivot_table(index="coefficient", columns="medium", values=column)
        table = table.reindex(index=[*TERMS, "zeta"], columns=media)
        table.loc["zeta"] = zeta[zeta_column].reindex(media)
        return table

    values = tabulate_terms("value_N_per_cm3", "zeta")
    ends = {"lower": tabulate_terms("lo", "zeta_lo"), "upper": tabulate_terms("hi", "zeta_hi")}
    if GENERIC in media:
        # zeta of the generic profile M0 is 1 by definition, so it has no interval
        values.loc["zeta", GENERIC] = 1.0
    sheet = book.add_sheet(method)
    sheet.set_column(0, 0, 14)
    sheet.set_column(1, 2 * len(media), 21)
    book.put_text(sheet, 0, 0, f"Fourier coefficients, method {method}", "title")
    unit = f"(N/cm^3; {GENERIC} and zeta dimensionless)"
    columns = [(titles[name], values[name].to_dict(), dropped[name]) for name in media]
    head = f"coefficients {unit}; grey: term not kept, counts as zero"
    row = _write_term_block(book, sheet, 2, head, columns)
    columns = [
        (f"{titles[name]}, {end}", table[name].to_dict(), dropped[name])
        for name in media
        for end, table in ends.items()
    ]
    row = _write_term_block(book, sheet, row, f"{level(results)} intervals {unit}", columns)
    # key of the paper's medium by ours; empty for media that are not the paper's
    printed = {name: medium.published_as for name, medium in results.config.media.items()}
    printed[GENERIC] = GENERIC
    columns = [
        (f"{titles[name]}, as printed", reference.coefficients(key), set())
        for name in media
        if (key := printed[name]) in (*reference.MEDIA, GENERIC)
    ]
    if columns:
        _write_term_block(book, sheet, row, f"published, Table S2 {unit}", columns)


TermColumn = tuple[str, Mapping[str, float], Collection[str]]
"""Heading, value of each term, and the terms that are written in grey, as they count as zero."""


def _write_term_block(
    book: Book, sheet: Worksheet, row: int, title: str, columns: Sequence[TermColumn]
) -> int:
    """Write columns of terms and zeta, from a row of the sheet on, under a title. Returns the next free row."""
    book.put_text(sheet, row, 0, title, "block")
    book.put_text(sheet, row + 1, 0, "coefficient", "head")
    terms = [*TERMS, "zeta"]
    for i, term in enumerate(terms, start=row + 2):
        book.put_text(sheet, i, 0, term, "side")
    for j, (heading, values, grey) in enumerate(columns, start=1):
        book.put_text(sheet, row + 1, j, heading, "head")
        for i, term in enumerate(terms, start=row + 2):
            book.write_number(
                sheet, i, j, float(values[term]), "grey" if term in grey else "number"
            )
    return row + len(terms) + 3
