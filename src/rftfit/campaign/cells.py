"""From one row of text cells to checked values, by the definitions in `columns`."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rftfit.campaign.columns import BY_NAME, COLUMNS, DIRECTION_WORDS, KINDS, NO, YES, Column
from rftfit.campaign.files import plain_path
from rftfit.campaign.names import DEVICE, is_device, unshowable
from rftfit.campaign.problems import Problem, did_you_mean, listed

if TYPE_CHECKING:
    from rftfit.campaign.table import Odd

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_COMMA = re.compile(r"[-+]?[0-9]*,[0-9]+")
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class Known:
    """What the configuration says about words; None where the configuration itself is unclear.

    Attributes
    ----------
    media : tuple of str or None
    shapes : dict of str to str, or None
        Shape of each intruder.
    depths_cm : tuple of float or None
        Depths of the horizontal runs, cm.
    missing_tare : str
        What becomes of a run without a tare: ``refuse`` or ``flag``.
    """

    media: tuple[str, ...] | None = None
    shapes: dict[str, str] | None = None
    depths_cm: tuple[float, ...] | None = None
    missing_tare: str = "refuse"

    def words(self, column: Column) -> tuple[str, ...] | None:
        """List the words that a choice column may hold.

        Parameters
        ----------
        column : Column
            Of the form ``choice``.

        Returns
        -------
        tuple of str or None
            None where the configuration's section of these words is unclear.
        """
        if column.section == "media":
            return self.media
        if column.section == "intruders":
            return None if self.shapes is None else tuple(self.shapes)
        return column.choices


@dataclass(slots=True, eq=False)
class Draft:
    """A row while it is being checked.

    Attributes
    ----------
    file : str
    row : int
    text : dict of str to str
        Good cells as text; blank and bad ones are empty.
    number : dict of str to float
        Good cells of number columns.
    bad : set of str
        Columns whose cell has an error, or that a needed cell is missing from.
    problems : list of Problem
    """

    file: str
    row: int
    text: dict[str, str] = field(default_factory=dict)
    number: dict[str, float] = field(default_factory=dict)
    bad: set[str] = field(default_factory=set)
    problems: list[Problem] = field(default_factory=list)

    def error(
        self, column: str, found: str | None, allowed: str, code: str, nearest: str | None = None
    ) -> None:
        """Note an error at one cell, whose column then counts as bad.

        Parameters
        ----------
        column : str
        found : str or None
            What stands in the cell; None where it is blank.
        allowed : str
            What would be right; the whole message where `found` is None.
        code : str
            Of the problem, for example ``sheet.unknown-word``.
        nearest : str or None
            The valid word that was probably meant.
        """
        self.bad.add(column)
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, code, nearest=nearest)
        )

    def warn(
        self, column: str, found: str | None, allowed: str, code: str, nearest: str | None = None
    ) -> None:
        """Note a warning at one cell, whose value stays good.

        Parameters
        ----------
        column, found, allowed, code, nearest
            As for `error`.
        """
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, code, "warning", nearest)
        )

    def yes(self, column: str) -> bool:
        """Whether a flag is set.

        Parameters
        ----------
        column : str
            Of the form ``flag``.

        Returns
        -------
        bool
            False also where the cell is blank or bad.
        """
        return self.text.get(column) == "yes"


def read_row(
    file: str, row: int, cells: dict[str, str], odd: dict[str, Odd], known: Known
) -> Draft:
    """Check every cell of one row on its own.

    Parameters
    ----------
    file : str
    row : int
        As a spreadsheet numbers it.
    cells : dict of str to str
        By column; columns that the sheet does not have are left out.
    odd : dict of str to Odd
        Cells that a workbook reader found to be not what they look like.
    known : Known

    Returns
    -------
    Draft
    """
    draft = Draft(file, row)
    kind, direction = cells.get("kind", ""), cells.get("direction", "")
    for column in COLUMNS:
        name = column.name
        cell = cells.get(name, "")
        draft.text[name] = ""
        # where kind or direction are themselves wrong, a cell is given the benefit of the doubt
        clear = kind in KINDS and (not column.direction or direction in DIRECTION_WORDS)
        used = not clear or (
            kind in column.kinds and (not column.direction or direction == column.direction)
        )
        strange = odd.get(name)
        if strange and not (column.form == "text" and strange.code == "sheet.date"):
            draft.error(name, strange.found, strange.allowed, strange.code)
        elif not cell:
            if used and column.need != "no":
                _blank(draft, column, cells, said=clear or column.need == "always")
        elif not used:
            who = kind if kind not in column.kinds else f"{kind} run that is not {column.direction}"
            draft.warn(name, cell, f"nothing: a {who} does not use this cell", "sheet.ignored")
        else:
            _READERS[column.form](draft, column, cell, known)
    return draft


def _blank(draft: Draft, column: Column, cells: dict[str, str], *, said: bool) -> None:
    draft.bad.add(column.name)
    # a column that is missing altogether is one problem of the header, not one of each row
    if said and (column.name in cells or not column.header_needed):
        allowed = f"this cell must not be blank; allowed: {column.allowed}"
        draft.error(column.name, None, allowed, "sheet.required")


def _name(draft: Draft, column: Column, cell: str, _: Known) -> None:
    if is_device(cell):
        draft.error(column.name, cell, DEVICE, "sheet.reserved-name")
    elif _NAME.fullmatch(cell):
        draft.text[column.name] = cell
    else:
        allowed = f"{BY_NAME['run_id'].allowed}, at most 100, not beginning with . or -"
        draft.error(column.name, cell, allowed, "sheet.bad-name")


def _choice(draft: Draft, column: Column, cell: str, known: Known) -> None:
    words = known.words(column)
    if words is None:
        # the configuration's own problem; nothing can be said about this cell
        draft.bad.add(column.name)
    elif cell in words:
        draft.text[column.name] = cell
    else:
        draft.error(
            column.name,
            cell,
            f"one of {listed(words)}",
            "sheet.unknown-word",
            did_you_mean(cell, words),
        )


def _number(draft: Draft, column: Column, cell: str, _: Known) -> None:
    code, nearest = "", None
    if _COMMA.fullmatch(cell):
        code, nearest = "sheet.decimal-comma", cell.replace(",", ".")
    elif _NOT_FINITE.fullmatch(cell):
        code = "sheet.not-finite"
    elif not _NUMBER.fullmatch(cell):
        code = "sheet.not-a-number"
        # the minus of a word processor
        plain = cell.replace("\N{MINUS SIGN}", "-").replace("\N{EN DASH}", "-")
        nearest = plain if _NUMBER.fullmatch(plain) else None
    elif not math.isfinite(value := float(cell)):
        code = "sheet.not-finite"
    elif (
        (column.low is not None and value < column.low)
        or (column.high is not None and value > column.high)
        or (column.above is not None and value <= column.above)
    ):
        code = "sheet.out-of-range"
    else:
        draft.text[column.name] = cell
        draft.number[column.name] = value + 0.0  # never -0
        return
    point = "; with a decimal point" if code == "sheet.decimal-comma" else ""
    draft.error(column.name, cell, column.allowed + point, code, nearest)


def _path(draft: Draft, column: Column, cell: str, _: Known) -> None:
    path, fault, nearest = plain_path(cell)
    if fault:
        code, allowed = fault.split(": ", 1)
        draft.error(column.name, cell, f"{column.allowed}; {allowed}", f"sheet.{code}", nearest)
    else:
        draft.text[column.name] = path


def _flag(draft: Draft, column: Column, cell: str, _: Known) -> None:
    word = cell.casefold()
    if word in YES or word in NO:
        draft.text[column.name] = "yes" if word in YES else ""
    else:
        allowed = f"{column.allowed} (also true, false, 1, 0)"
        draft.error(column.name, cell, allowed, "sheet.bad-flag", did_you_mean(cell, ("yes", "no")))


def _text(draft: Draft, column: Column, cell: str, _: Known) -> None:
    if sign := unshowable(cell):
        allowed = "text without control characters: it is printed in tables and figures"
        draft.error(column.name, sign, allowed, "sheet.control")
    else:
        draft.text[column.name] = cell


_READERS = {
    "name": _name,
    "choice": _choice,
    "number": _number,
    "path": _path,
    "flag": _flag,
    "text": _text,
}
