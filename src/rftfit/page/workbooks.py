"""Workbooks in the layouts of Tables S5 and S2, the same bytes every time."""

from __future__ import annotations

import contextlib
import datetime as dt
import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

import rftfit
from rftfit import reference
from rftfit.figures.maps import half_width, pivot
from rftfit.store import atomic_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    import pandas as pd
    from xlsxwriter.format import Format
    from xlsxwriter.workbook import Workbook
    from xlsxwriter.worksheet import Worksheet


# --- Writing xlsx workbooks that are the same bytes every time and never hold a formula by accident.


# the file's own date; a real one would make every file differ
_CREATED = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)

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


class Book:
    """An open workbook and its formats."""

    def __init__(self, workbook: Workbook) -> None:
        self.workbook = workbook
        self.formats: dict[str, Format] = {
            name: workbook.add_format(how) for name, how in _FORMATS.items()
        }
        self._names: set[str] = set()

    def sheet(self, name: str) -> Worksheet:
        """Add a sheet under a name that spreadsheet programs accept.

        `name`: Cut to 31 characters and freed from brackets, colons, slashes and the like;
        numbered if taken.
        """
        clean = re.sub(r"[\[\]:*?/\\]", "_", name).strip("'")[:31] or "sheet"
        unique, count = clean, 1
        # the name "history" is kept by spreadsheet programs for themselves
        while unique.casefold() in self._names | {"history"}:
            count += 1
            unique = f"{clean[: 30 - len(str(count))]}_{count}"
        self._names.add(unique.casefold())
        return self.workbook.add_worksheet(unique)

    def text(self, sheet: Worksheet, row: int, column: int, text: str, form: str = "text") -> None:
        """Write text as text, whatever it begins with.

        `form`: Name of a format.
        """
        # write() would take "=..." for a formula and "http..." for a link
        sheet.write_string(row, column, text, self.formats[form])

    def value(
        self,
        sheet: Worksheet,
        row: int,
        column: int,
        value: float,
        form: str = "number",
        missing: tuple[str, str] = ("no value", ""),
    ) -> None:
        """Write a number in full precision, or, for NaN, a word with its reason as a comment.

        `form`: Name of a format. `missing`: Word and reason for NaN; no comment if the reason is
        empty.
        """
        if math.isfinite(value):
            sheet.write_number(row, column, value, self.formats[form])
            return
        self.text(sheet, row, column, missing[0], "missing")
        if missing[1]:
            sheet.write_comment(row, column, missing[1], {"x_scale": 2, "author": "rftfit"})

    def about(self, title: str, lines: list[str]) -> None:
        """Add the first sheet: what this is, and which version of the program made it."""
        sheet = self.sheet("About")
        sheet.set_column(0, 0, 110)
        self.text(sheet, 0, 0, title, "title")
        made = f"Made by rftfit {rftfit.__version__}."
        for row, line in enumerate([made, *lines], start=2):
            self.text(sheet, row, 0, line)


@contextlib.contextmanager
def new_book(target: str | Path) -> Iterator[Book]:
    """Open a workbook that appears at `target` when the block ends without an error."""
    import xlsxwriter
    from xlsxwriter.exceptions import FileCreateError

    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False}
    with atomic_path(target) as path:
        workbook = xlsxwriter.Workbook(str(path), options)
        workbook.set_properties({"created": _CREATED, "author": "rftfit"})
        yield Book(workbook)
        try:
            workbook.close()
        except FileCreateError as error:
            # so that the caller sees the one error of all failed writing
            raise OSError(str(error)) from error


# --- Workbooks in the layout of the paper: alpha as Table S5, coefficients as Table S2.


TERMS = ("A00", "A10", "B11", "B01", "Bm1", "C11", "C01", "Cm1", "D10")
GENERIC = "generic"

_ALPHA = (
    "Resistive-force measurements: vertical and horizontal stress per depth, alpha_z and alpha_x, "
    "over attack angle beta and intrusion angle gamma."
)
_METHODS = (
    "lsq: least squares at the true angles. dft-index: the discrete transform on the index grid; "
    "that the paper's Table S2 was made so is inferred from its numbers."
)
_SIGNS = (
    "Signs: alpha_z > 0 pushes up, alpha_x > 0 pushes toward +x. Plate tangent (cos beta, "
    "-sin beta); velocity direction (-cos gamma, -sin gamma), gamma = 90 degrees being straight down."
)


def _alpha_block(
    book: Book, sheet: Worksheet, row: int, title: str, table: pd.DataFrame, column: str
) -> int:
    beta, gamma, values = pivot(table, column)
    keys = zip(table["beta_deg"].round(2), table["gamma_deg"].round(2), strict=True)
    reasons = dict(zip(keys, table["reason"], strict=True)) if "reason" in table.columns else {}
    book.text(sheet, row, 0, title, "block")
    book.text(sheet, row + 1, 0, "beta \\ gamma (degrees)", "head")
    for j, angle in enumerate(gamma):
        sheet.write_number(row + 1, j + 1, angle, book.formats["angle"])
    for i, angle in enumerate(beta):
        sheet.write_number(row + 2 + i, 0, angle, book.formats["angle_side"])
        for j, other in enumerate(gamma):
            reason = reasons.get((angle, other), "")
            why = reason if isinstance(reason, str) and reason else "no reason was recorded"
            book.value(sheet, row + 2 + i, j + 1, float(values[i, j]), missing=("no run", why))
    return row + beta.size + 3


def write_alpha_workbook(
    tables: Mapping[str, pd.DataFrame],
    target: str | Path,
    titles: Mapping[str, str] | None = None,
    confidence: float = 0.95,
) -> None:
    """Write the alpha tables of all media in the layout of the paper's additional Table S5.

    One sheet per medium: alpha_z, then alpha_x, rows beta, columns gamma, then the half widths of
    their intervals. A cell without a value says "no run", with the reason as its comment.

    `tables`: Alpha table by medium. `titles`: Names of the media. `confidence`: Level of the
    intervals in the tables.
    """
    level = f"{100 * confidence:.4g} %"
    with new_book(target) as book:
        names = [f"{medium}: {(titles or {}).get(medium, medium)}" for medium in tables]
        lines = [
            _ALPHA,
            "Layout of additional Table S5 of " + reference.CITATION + ".",
            "Units: alpha in N/cm^3, angles in degrees.",
            _SIGNS,
            f"Below alpha stand the half widths of the {level} intervals, (upper - lower) / 2.",
            'A cell "no run" has no usable run; its comment says why.',
            "Sheets:",
            *names,
        ]
        book.about("alpha tables", lines)
        for medium, table in tables.items():
            sheet = book.sheet(medium)
            sheet.set_column(0, 0, 24)
            sheet.set_column(1, 20, 10)
            title = (titles or {}).get(medium, medium)
            book.text(sheet, 0, 0, title, "title")
            row = 2
            for c in "zx":
                head = f"alpha_{c} (N/cm^3)"
                row = _alpha_block(book, sheet, row, head, table, f"alpha_{c}_N_per_cm3")
            for c in "zx":
                head = f"half width of the {level} interval of alpha_{c} (N/cm^3)"
                widths = table.assign(half=half_width(table, c))
                row = _alpha_block(book, sheet, row, head, widths, "half")


def _heads(book: Book, sheet: Worksheet, row: int, title: str, heads: list[str]) -> None:
    book.text(sheet, row, 0, title, "block")
    book.text(sheet, row + 1, 0, "coefficient", "head")
    for j, head in enumerate(heads, start=1):
        book.text(sheet, row + 1, j, head, "head")


def _rows(
    book: Book,
    sheet: Worksheet,
    row: int,
    terms: list[str],
    columns: Sequence[Mapping[str, float]],
    dropped: list[set[str]],
) -> int:
    for i, term in enumerate(terms, start=row + 2):
        book.text(sheet, i, 0, term, "side")
        for j, values in enumerate(columns):
            form = "grey" if term in dropped[j] else "number"
            book.value(sheet, i, j + 1, float(values.get(term, np.nan)), form)
    return row + len(terms) + 3


def _zeta(penetration: pd.DataFrame | None, method: str, medium: str, part: str = "") -> float:
    if penetration is None:
        return np.nan
    here = (penetration["method"] == method) & (penetration["medium"] == medium)
    name = f"zeta{part}"
    values = penetration.loc[here, name].tolist() if name in penetration.columns else []
    return float(values[0]) if values else np.nan


def _coefficient_sheet(
    book: Book,
    method: str,
    rows: pd.DataFrame,
    penetration: pd.DataFrame | None,
    published: Mapping[str, str],
    titles: Mapping[str, str],
    level: str,
) -> None:
    media = sorted(rows["medium"].unique(), key=lambda name: name == GENERIC)
    found = set(rows["coefficient"])
    terms = [term for term in TERMS if term in found] + sorted(found - set(TERMS))
    names = [str(titles.get(medium, medium)) for medium in media]
    parts: dict[str, list[dict[str, float]]] = {"value_N_per_cm3": [], "lo": [], "hi": []}
    dropped = []
    for medium in media:
        here = rows[rows["medium"] == medium].set_index("coefficient")
        dropped.append({str(term) for term in here.index[~here["kept"].astype(bool)]})
        for part, columns in parts.items():
            zeta = _zeta(penetration, method, medium, {"lo": "_lo", "hi": "_hi"}.get(part, ""))
            columns.append(
                here[part].astype(float).to_dict() | ({"zeta": zeta} if np.isfinite(zeta) else {})
            )
    with_zeta = terms + (["zeta"] if penetration is not None else [])
    if penetration is not None and GENERIC in media:
        # M0 is scaled so that its own zeta is 1, by definition and without an interval
        parts["value_N_per_cm3"][media.index(GENERIC)].setdefault("zeta", 1.0)
    sheet = book.sheet(method)
    sheet.set_column(0, 0, 14)
    sheet.set_column(1, 2 * len(media), 21)
    book.text(sheet, 0, 0, f"Fourier coefficients, method {method}", "title")
    unit = f"(N/cm^3; {GENERIC} and zeta dimensionless)"
    _heads(book, sheet, 2, f"coefficients {unit}; grey: term not kept, counts as zero", names)
    row = _rows(book, sheet, 2, with_zeta, parts["value_N_per_cm3"], dropped)
    both = [f"{name}, {end}" for name in names for end in ("lower", "upper")]
    _heads(book, sheet, row, f"{level} intervals {unit}", both)
    pairs = [side for pair in zip(parts["lo"], parts["hi"], strict=True) for side in pair]
    row = _rows(book, sheet, row, with_zeta, pairs, [drop for drop in dropped for _ in (0, 1)])
    known = [medium for medium in media if published.get(medium)]
    if known:
        heads = [f"{titles.get(medium, medium)}, as printed" for medium in known]
        _heads(book, sheet, row, f"published, Table S2 {unit}", heads)
        printed = [reference.coefficients(published[medium]) for medium in known]
        _rows(book, sheet, row, [*terms, "zeta"], printed, [set() for _ in known])


def write_coefficient_workbook(
    coefficients: pd.DataFrame,
    target: str | Path,
    published: Mapping[str, str] | None = None,
    penetration: pd.DataFrame | None = None,
    titles: Mapping[str, str] | None = None,
    confidence: float = 0.95,
) -> None:
    """Write the coefficients of all media in the layout of Table S2, one sheet per method.

    Below the values stand their intervals, then the published values of the media that have them.
    Terms that are not kept are grey.

    `coefficients`: Long coefficient table. `published`: Key in the published tables by medium
    (``published_as`` of the config); may hold ``generic``. `penetration`: With ``method, medium,
    zeta, zeta_lo, zeta_hi``: adds the row ``zeta``. `titles`: Names of the media. `confidence`:
    Level of the intervals in the tables.
    """
    level = f"{100 * confidence:.4g} %"
    with new_book(target) as book:
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
            lines.append(
                "No medium was measured over the grid of angles: there are no coefficients."
            )
        book.about("Fourier coefficients", lines)
        for method in coefficients["method"].unique():
            rows = coefficients[coefficients["method"] == method]
            _coefficient_sheet(
                book, str(method), rows, penetration, published or {}, titles or {}, level
            )
