"""The run sheet: its columns, its cells, and what must hold between its rows."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rftfit.campaign.columns import (
    BY_NAME,
    COLUMNS,
    DIRECTION_WORDS,
    DIRECTIONS,
    KINDS,
    NO,
    YES,
    Column,
)
from rftfit.campaign.config import PLATE_SHAPES
from rftfit.campaign.problems import (
    DEVICE,
    Problem,
    did_you_mean,
    folded,
    is_device,
    listed,
    unshowable,
)
from rftfit.campaign.reading import plain_path
from rftfit.campaign.rows import Table, read_table

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.reading import Folder
    from rftfit.campaign.rows import Odd


# --- One run: a row of the run sheet after it has been checked.


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the campaign.

    `run_id`: Unique name.
    `kind`: ``plate``, ``rod``, ``leg`` or ``leg_air``.
    `medium`: Key of the configuration's ``media``; empty for ``leg_air``.
    `intruder`: Key of the configuration's ``intruders``.
    `direction`: ``intrusion``, ``extraction``, ``horizontal`` or ``rotation``.
    `beta_deg`, `gamma_deg`: Angle of the plate, and of the path on the way down, degrees; NaN for
        legs.
    `depth_cm`: Depth of a horizontal run, cm; NaN for all others.
    `force_log`, `motion_log`: Paths relative to the raw folder, with ``/`` and without ``.`` or
        ``..``.
    `tare_run`: run_id of the run to subtract; empty if there is none.
    `tare_shared`: Whether that tare is meant to serve several runs.
    `surface_z_mm`: Arm z of the free surface, mm; None means the configuration's.
    `excluded`: Whether the run is left out.
    `reason`: Why it is left out.
    `note`: Free text.
    `row`: Row as a spreadsheet numbers it; the header is row 1.
    """

    run_id: str
    kind: str
    medium: str
    intruder: str
    direction: str
    beta_deg: float
    gamma_deg: float
    depth_cm: float
    force_log: str
    motion_log: str
    tare_run: str
    tare_shared: bool
    surface_z_mm: float | None
    excluded: bool
    reason: str
    note: str
    row: int


# --- From one row of text cells to checked values, by the definitions in `columns`.


_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_COMMA = re.compile(r"[-+]?[0-9]*,[0-9]+")
_NOT_FINITE = re.compile(r"[-+]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class Known:
    """What the configuration says about words; None where the configuration itself is unclear.

    `shapes`: Shape of each intruder.
    `depths_cm`: Depths of the horizontal runs, cm.
    `missing_tare`: What becomes of a run without a tare: ``refuse`` or ``flag``.
    `clock_method`: How the clocks of force and motion log are brought together.
    """

    media: tuple[str, ...] | None = None
    shapes: dict[str, str] | None = None
    depths_cm: tuple[float, ...] | None = None
    missing_tare: str = "refuse"
    clock_method: str | None = None

    def words(self, column: Column) -> tuple[str, ...] | None:
        """List the words that a choice column may hold.

        `column`: Of the form ``choice``. Returns none where the configuration's section of these
        words is unclear.
        """
        if column.section == "media":
            return self.media
        if column.section == "intruders":
            return None if self.shapes is None else tuple(self.shapes)
        return column.choices


@dataclass(slots=True, eq=False)
class Draft:
    """A row while it is being checked.

    `text`: Good cells as text; blank and bad ones are empty.
    `number`: Good cells of number columns.
    `bad`: Columns whose cell has an error, or that a needed cell is missing from.
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

        `found`: What stands in the cell; None where it is blank. `allowed`: What would be right;
        the whole message where `found` is None. `code`: Of the problem, for example
        ``sheet.unknown-word``. `nearest`: The valid word that was probably meant.
        """
        self.bad.add(column)
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, code, nearest=nearest)
        )

    def warn(
        self, column: str, found: str | None, allowed: str, code: str, nearest: str | None = None
    ) -> None:
        """Note a warning at one cell, whose value stays good.

        `column`, `found`, `allowed`, `code`, `nearest`: As for `error`.
        """
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, code, "warning", nearest)
        )

    def yes(self, column: str) -> bool:
        """Whether a flag is set.

        `column`: Of the form ``flag``. Returns false also where the cell is blank or bad.
        """
        return self.text.get(column) == "yes"


def read_row(
    file: str, row: int, cells: dict[str, str], odd: dict[str, Odd], known: Known
) -> Draft:
    """Check every cell of one row on its own.

    `row`: As a spreadsheet numbers it. `cells`: By column; columns that the sheet does not have
    are left out. `odd`: Cells that a workbook reader found to be not what they look like.
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


# --- What must hold within one row, beyond each cell on its own.


DEPTH_TOLERANCE_CM = 0.005
"""Depths closer than this are the same depth: sheets are written to a hundredth of a centimetre."""

_SHAPES_OF = {
    "plate": PLATE_SHAPES, "rod": PLATE_SHAPES, "leg": ("leg",), "leg_air": ("leg",),
}  # fmt: skip


def check_row(draft: Draft, known: Known) -> None:
    """Add the problems of one row to it.

    `draft`: As read by `cells.read_row`.
    """
    _check_direction(draft)
    _check_intruder(draft, known)
    _check_gamma(draft)
    _check_depth(draft, known)
    _check_excluded(draft)


def check_logs(draft: Draft, logs: Folder) -> None:
    """Add the problems of a row's two log files on disk to it.

    `logs`: The raw folder.
    """
    for column in ("force_log", "motion_log"):
        path = draft.text[column]
        if not path:
            continue
        status = logs.status(path)
        if status == "outside":
            allowed = f"{BY_NAME[column].allowed}; a link leads out of it"
            draft.error(column, path, allowed, "sheet.path-outside")
        elif status in ("folder", "other"):
            what = "a folder" if status == "folder" else "no regular file"
            draft.error(column, path, f"a log file; this is {what}", "sheet.log-not-a-file")
        elif status == "missing" and not draft.yes("excluded"):
            allowed = "a file that exists in the raw folder; this run will be dropped"
            draft.warn(column, path, allowed, "sheet.log-missing", logs.nearest(path))


def _check_direction(draft: Draft) -> None:
    kind, direction = draft.text["kind"], draft.text["direction"]
    if kind and direction and direction not in DIRECTIONS[kind]:
        allowed = f"{' or '.join(DIRECTIONS[kind])} for a {kind} run"
        draft.error("direction", direction, allowed, "sheet.direction-kind")


def _check_intruder(draft: Draft, known: Known) -> None:
    kind, intruder = draft.text["kind"], draft.text["intruder"]
    if not kind or not intruder or known.shapes is None:
        return
    shape, wanted = known.shapes[intruder], _SHAPES_OF[kind]
    if shape and shape not in wanted:
        fitting = [name for name, other in known.shapes.items() if other in wanted]
        allowed = f"an intruder with shape {' or '.join(wanted)} for a {kind} run: "
        allowed += listed(fitting) or "the config has none"
        draft.error("intruder", intruder, allowed, "sheet.intruder-kind")


def _check_gamma(draft: Draft) -> None:
    gamma, direction = draft.number.get("gamma_deg"), draft.text["direction"]
    if gamma is None:
        return
    found = draft.text["gamma_deg"]
    if direction == "horizontal" and gamma != 0:
        draft.error("gamma_deg", found, "0 for a horizontal run", "sheet.gamma-not-zero")
    elif direction in ("intrusion", "extraction") and gamma == 0:
        allowed = f"above 0 for an {direction}; a path at gamma 0 is a horizontal run"
        draft.error("gamma_deg", found, allowed, "sheet.gamma-zero")


def _check_depth(draft: Draft, known: Known) -> None:
    depth = draft.number.get("depth_cm")
    if depth is None or known.depths_cm is None:
        return
    if all(abs(depth - other) > DEPTH_TOLERANCE_CM for other in known.depths_cm):
        depths = ", ".join(f"{other:g}" for other in known.depths_cm)
        allowed = f"one of {depths} cm (fit.horizontal_depths_cm in the config)"
        draft.warn("depth_cm", draft.text["depth_cm"], allowed, "sheet.depth-unlisted")


def _check_excluded(draft: Draft) -> None:
    if "excluded" in draft.bad or "reason" in draft.bad:
        return
    excluded, reason = draft.yes("excluded"), draft.text["reason"]
    if excluded and not reason:
        allowed = "an excluded run needs its reason, in words: it goes into the ledger"
        draft.error("reason", None, allowed, "sheet.excluded-without-reason")
    elif reason and not excluded:
        allowed = "a reason only where excluded is yes; this run is used"
        draft.warn("reason", reason, allowed, "sheet.reason-without-excluded")


# --- What must hold between a run and its tare.


ANGLE_TOLERANCE_DEG = 0.05
"""Angles closer than this are the same in a sheet, where 18.43 and 18.435 both stand for atan 1/3."""

_TARE_OF = {"plate": "rod", "leg": "leg_air"}
_WORDS = {"rod": "a rod run", "leg_air": "a leg_air run"}
_SEARCHES = 20
_WITHOUT = {
    "refuse": "as NaN, with that as its reason",
    "flag": "with the force on rod and mount in it, flagged",
}


def check_tares(drafts: list[Draft], known: Known) -> None:
    """Add to each row the problems of its tare.

    `drafts`: All rows of the sheet, in its order.
    """
    by_id: dict[str, Draft] = {}
    for draft in drafts:
        by_id.setdefault(draft.text["run_id"], draft)
    by_id.pop("", None)
    ids_of = {
        kind: tuple(sorted(name for name, one in by_id.items() if one.text["kind"] == kind))
        for kind in _WORDS
    }
    users: defaultdict[str, list[Draft]] = defaultdict(list)
    named: set[str] = set()
    searches = 0
    for draft in drafts:
        kind, name = draft.text["kind"], draft.text["tare_run"]
        named.add(name)
        if kind not in _TARE_OF or "tare_run" in draft.bad:
            continue
        excluded = draft.yes("excluded")
        if not name:
            if not excluded:
                allowed = "no tare: this run will come out "
                allowed += _WITHOUT[known.missing_tare] + "; name "
                allowed += f"{_WORDS[_TARE_OF[kind]]} to subtract"
                draft.warn("tare_run", None, allowed, "sheet.tare-missing")
            continue
        if name not in by_id:
            # a search looks at every id, so not for each of thousands of rows
            searches += 1
            nearest = did_you_mean(name, ids_of[_TARE_OF[kind]]) if searches <= _SEARCHES else None
            allowed = f"the run_id of {_WORDS[_TARE_OF[kind]]} in this sheet"
            draft.error("tare_run", name, allowed, "sheet.tare-unknown", nearest)
            continue
        if not excluded and by_id[name].text["kind"] == _TARE_OF[kind]:
            users[name].append(draft)
        _match(draft, by_id[name])
    for name, several in users.items():
        _check_shared(name, several)
    for name, tare in by_id.items():
        if tare.text["kind"] in _WORDS and name not in named and not tare.yes("excluded"):
            allowed = f"a tare that some run names; no run names {name}"
            tare.warn("run_id", name, allowed, "sheet.tare-unused")


def _check_shared(name: str, several: list[Draft]) -> None:
    if len(several) < 2:
        return
    rows = ", ".join(str(draft.row) for draft in several[:5]) + (", ..." if several[5:] else "")
    for draft in several:
        if not draft.yes("tare_shared") and "tare_shared" not in draft.bad:
            allowed = (
                f"this must be yes on each run that uses {name} (rows {rows}); or give each run a "
            )
            allowed += "tare of its own"
            draft.error("tare_shared", None, allowed, "sheet.tare-shared")


def _match(draft: Draft, tare: Draft) -> None:
    """Compare a run with its tare, one message for each difference."""
    kind, name = draft.text["kind"], draft.text["tare_run"]
    where = f"{name} (row {tare.row})"
    if not tare.text["kind"]:
        return
    if tare.text["kind"] != _TARE_OF[kind]:
        allowed = f"{_WORDS[_TARE_OF[kind]]} for a {kind} run; {where} is a {tare.text['kind']} run"
        draft.error("tare_run", name, allowed, "sheet.tare-kind")
        return
    for column in ("medium", "intruder", "direction", "beta_deg", "gamma_deg", "depth_cm"):
        own, other = draft.text[column], tare.text[column]
        if not own or not other or column in draft.bad or column in tare.bad:
            continue
        if not _same(column, draft, tare):
            allowed = f"the tare must match: {column} is {own} here and {other} in {where}"
            code = f"sheet.tare-{column.split('_', maxsplit=1)[0]}"
            draft.error("tare_run", name, allowed, code)
    if tare.yes("excluded") and not draft.yes("excluded"):
        allowed = f"a tare that is used; {where} is excluded, so this run will have none"
        draft.warn("tare_run", name, allowed, "sheet.tare-excluded")


def _same(column: str, draft: Draft, tare: Draft) -> bool:
    if column not in draft.number:
        return draft.text[column] == tare.text[column]
    difference = abs(draft.number[column] - tare.number[column])
    if column == "beta_deg":
        # -90 and 90 are one and the same plate
        difference = min(difference, 180 - difference)
    return difference <= (DEPTH_TOLERANCE_CM if column == "depth_cm" else ANGLE_TOLERANCE_DEG)


# --- From the run sheet to checked runs, or to everything that is wrong with it.


def read_sheet(
    path: Path, file: str, known: Known, logs: Folder | None, medium: str = ""
) -> tuple[list[Run], list[Problem]]:
    """Read and check a run sheet.

    `file`: Its name, for problems. `known`: What the configuration says about words. `logs`: The
    raw folder; None if it is not known, and log files are not looked for. `medium`: Pass over the
    rows of other media. Returns `runs`: The rows without an error, in the order of the sheet.
    Returns `problems`: In the order of the rows.
    """
    table, problems = read_table(path, file)
    if table is None:
        return [], problems
    places, of_header = _places(table, file)
    problems += of_header
    if not table.rows:
        allowed = "no runs yet: the sheet needs one row for each run below its header"
        problems.append(Problem(file, None, None, None, allowed, "sheet.empty"))
    drafts: list[Draft] = []
    for row, cells in table.rows:
        width = len(cells)
        named = {name: cells[at] if at < width else "" for name, at in places.items()}
        if medium and named.get("medium") not in (None, "", medium):
            continue
        odd = {name: table.odd[row, at] for name, at in places.items() if (row, at) in table.odd}
        drafts.append(read_row(file, row, named, odd if table.odd else {}, known))
        problems += _beyond(table, file, row, cells)
    for draft in drafts:
        check_row(draft, known)
        if logs is not None:
            check_logs(draft, logs)
    _check_ids(drafts)
    _check_files(drafts, known)
    check_tares(drafts, known)
    problems += [problem for draft in drafts for problem in draft.problems]
    order = {column.name: place for place, column in enumerate(COLUMNS)}
    problems.sort(key=lambda each: (each.row or 0, order.get(each.column or "", -1)))
    return [_run(draft) for draft in drafts if not draft.bad], problems


def _places(table: Table, file: str) -> tuple[dict[str, int], list[Problem]]:
    """Position of each column, and what is wrong with the header."""
    places: dict[str, int] = {}
    problems: list[Problem] = []
    unknown: list[str] = []
    row = table.header_row
    for at, name in enumerate(table.header):
        if name in places:
            allowed = f"each column once; it is also column number {places[name] + 1}"
            problems.append(Problem(file, row, name, name, allowed, "sheet.duplicate-column"))
        elif name in BY_NAME:
            places[name] = at
        elif name:
            unknown.append(name)
    missing = [name for name in BY_NAME if name not in places]
    for name in unknown:
        # first among those that are not there yet, so that two misspellings get two answers
        nearest = did_you_mean(name, missing) or did_you_mean(name, BY_NAME)
        allowed = f"one of {', '.join(BY_NAME)}"
        problems.append(
            Problem(file, row, name, name, allowed, "sheet.unknown-column", nearest=nearest)
        )
    for name in missing:
        if BY_NAME[name].header_needed:
            allowed = f"this column is missing; it is needed: {BY_NAME[name].meaning}"
            problems.append(Problem(file, row, name, None, allowed, "sheet.missing-column"))
    return places, problems


def _beyond(table: Table, file: str, row: int, cells: list[str]) -> list[Problem]:
    """Make problems of filled cells that stand under no header."""
    header = table.header
    return [
        Problem(
            file,
            row,
            f"number {at + 1}",
            cell,
            "nothing where the header is blank; a comma in a note or a decimal comma cuts a row in "
            "the wrong place: put such a cell in quotes, write numbers with a point",
            "sheet.no-header",
        )
        for at, cell in enumerate(cells)
        if cell and (at >= len(header) or not header[at])
    ]


def _check_ids(drafts: list[Draft]) -> None:
    first: dict[str, Draft] = {}
    for draft in drafts:
        name = draft.text["run_id"]
        if not name:
            continue
        other = first.setdefault(name.casefold(), draft)
        if other is draft:
            continue
        if other.text["run_id"] == name:
            allowed = f"a name that no other run has; row {other.row} has it"
            draft.error("run_id", name, allowed, "sheet.duplicate-id")
        else:
            allowed = f"a name that differs by more than case from {other.text['run_id']}"
            draft.error("run_id", name, f"{allowed} in row {other.row}", "sheet.case-id")


def _check_files(drafts: list[Draft], known: Known) -> None:
    first: dict[str, tuple[Draft, str]] = {}
    for draft in drafts:
        for column in ("force_log", "motion_log"):
            path = draft.text[column]
            if not path:
                continue
            other, use = first.setdefault(folded(path), (draft, column))
            same_row = other is draft and use != column and other.text[use] == path
            if same_row and known.clock_method not in (None, "same_clock"):
                allowed = "a file of its own; or, where this one holds force and motion, "
                allowed += f"clock.method same_clock in the config, found {known.clock_method}"
                draft.error(column, path, allowed, "sheet.one-file")
            elif (other, use) != (draft, column) and not same_row:
                where = "of this row" if other is draft else f"of row {other.row}"
                allowed = f"a file of its own; {use} {where} names this one"
                if other.text[use] != path:
                    allowed += f", as {other.text[use]}: not every disk tells the two apart"
                draft.error(column, path, allowed, "sheet.shared-file")


def _run(draft: Draft) -> Run:
    text, number = draft.text, draft.number
    nan = float("nan")
    return Run(
        run_id=text["run_id"],
        kind=text["kind"],
        medium=text["medium"],
        intruder=text["intruder"],
        direction=text["direction"],
        beta_deg=number.get("beta_deg", nan),
        gamma_deg=number.get("gamma_deg", nan),
        depth_cm=number.get("depth_cm", nan),
        force_log=text["force_log"],
        motion_log=text["motion_log"],
        tare_run=text["tare_run"],
        tare_shared=draft.yes("tare_shared"),
        surface_z_mm=number.get("surface_z_mm"),
        excluded=draft.yes("excluded"),
        reason=text["reason"],
        note=text["note"],
        row=draft.row,
    )
