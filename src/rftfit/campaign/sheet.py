"""From the run sheet to checked runs, or to everything that is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.cells import Draft, Known, read_row
from rftfit.campaign.columns import BY_NAME, COLUMNS
from rftfit.campaign.names import folded
from rftfit.campaign.problems import Problem, did_you_mean
from rftfit.campaign.rules import check_logs, check_row
from rftfit.campaign.runs import Run
from rftfit.campaign.table import Table, read_table
from rftfit.campaign.tares import check_tares

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.files import Folder


def read_sheet(
    path: Path, file: str, known: Known, logs: Folder | None, medium: str = ""
) -> tuple[list[Run], list[Problem]]:
    """Read and check a run sheet.

    Parameters
    ----------
    path : Path
    file : str
        Its name, for problems.
    known : Known
        What the configuration says about words.
    logs : Folder or None
        The raw folder; None if it is not known, and log files are not looked for.
    medium : str, optional
        Pass over the rows of other media.

    Returns
    -------
    runs : list of Run
        The rows without an error, in the order of the sheet.
    problems : list of Problem
        In the order of the rows.
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
    _check_files(drafts)
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


def _check_files(drafts: list[Draft]) -> None:
    first: dict[str, tuple[Draft, str]] = {}
    for draft in drafts:
        for column in ("force_log", "motion_log"):
            path = draft.text[column]
            if not path:
                continue
            other, use = first.setdefault(folded(path), (draft, column))
            if (other, use) != (draft, column):
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
