"""The robot's run sheet: which marker track is a trial of which condition."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.campaign.files import plain_path
from rftfit.campaign.problems import Problem, did_you_mean
from rftfit.campaign.table import read_table

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from rftfit.campaign.table import Table

COLUMNS = {
    "run_id": "unique name of the trial",
    "condition": "name shared by the trials of one condition",
    "medium": "the medium that the config's robot runs on",
    "curvature_times_R": "R'/r of the legs, -1 (reversed c-leg) to 1 (c-leg)",
    "frequency_Hz": "stride frequency; blank: taken from the track",
    "track": "file of the marker track, relative to the folder of this sheet",
    "note": "free text",
}
"""Columns of the sheet, with their meanings."""

_NEEDED = ("run_id", "condition", "medium", "curvature_times_R", "track")
_HIGHEST_HZ = 100.0


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial of the robot.

    Attributes
    ----------
    run_id, condition, medium : str
    curvature_times_R : float
        R'/r of its legs.
    frequency_Hz : float
        Stride frequency; NaN where it is to be taken from the track.
    track : str
        Path relative to the folder of the sheet, with ``/``.
    note : str
    row : int
        As a spreadsheet numbers it.
    """

    run_id: str
    condition: str
    medium: str
    curvature_times_R: float
    frequency_Hz: float
    track: str
    note: str
    row: int


def read_trials(
    path: Path, file: str, medium: str, taken: Collection[str] = ()
) -> tuple[list[Trial], list[Problem]]:
    """Read and check a robot run sheet.

    Parameters
    ----------
    path : Path
        csv, tsv or xlsx.
    file : str
        Its name, for problems.
    medium : str
        The one that the robot runs on.
    taken : collection of str, optional
        Names of the runs of the campaign's own run sheet, which a trial may not have too.

    Returns
    -------
    trials : list of Trial
        The rows without an error, in the order of the sheet.
    problems : list of Problem
        All of them, in the order of the rows.
    """
    table, problems = read_table(path, file)
    if table is None:
        return [], problems
    problems += _header(table, file)
    if any(problem.severity == "error" for problem in problems):
        return [], problems
    places = {name: at for at, name in enumerate(table.header) if name in COLUMNS}
    rows = [
        (row, {name: cells[at] if at < len(cells) else "" for name, at in places.items()})
        for row, cells in table.rows
    ]
    if not rows:
        allowed = "no trials yet: the sheet needs one row for each track below its header"
        problems.append(Problem(file, None, None, None, allowed, "robot-sheet.empty"))
    found: list[Trial] = []
    seen: dict[tuple[str, str], int] = {}
    conditions: dict[str, Trial] = {}
    for row, cells in rows:
        check = _Row(file, row, cells)
        trial = check.trial(medium, taken, seen, conditions)
        problems += check.problems
        if trial is not None:
            found.append(trial)
    return found, problems


def _header(table: Table, file: str) -> list[Problem]:
    row, problems = table.header_row, []
    missing = [name for name in COLUMNS if name not in table.header]
    for at, name in enumerate(table.header):
        if name in table.header[:at] and name:
            allowed = "each column once"
            problems.append(Problem(file, row, name, name, allowed, "robot-sheet.duplicate-column"))
        elif name and name not in COLUMNS:
            allowed, near = f"one of {', '.join(COLUMNS)}", did_you_mean(name, missing)
            problems.append(
                Problem(file, row, name, name, allowed, "robot-sheet.unknown-column", nearest=near)
            )
    for name in missing:
        if name in _NEEDED:
            allowed = f"this column is missing; it is needed: {COLUMNS[name]}"
            problems.append(Problem(file, row, name, None, allowed, "robot-sheet.missing-column"))
    return problems


class _Row:
    """Checks the cells of one row."""

    def __init__(self, file: str, row: int, cells: dict[str, str]) -> None:
        self.file, self.row, self.cells = file, row, cells
        self.problems: list[Problem] = []

    def error(self, column: str, allowed: str, code: str, nearest: str | None = None) -> None:
        found = self.cells.get(column) or None
        allowed = allowed if found else f"this cell is blank; it is needed: {allowed}"
        code = code if found else "blank"
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, f"robot-sheet.{code}",
                    nearest=nearest)
        )  # fmt: skip

    def number(self, column: str, low: float, high: float, allowed: str) -> float:
        text = self.cells.get(column, "")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if "_" in text or not low <= value <= high:
            self.error(column, allowed, "number")
            return math.nan
        return value

    def trial(
        self,
        medium: str,
        taken: Collection[str],
        seen: dict[tuple[str, str], int],
        conditions: dict[str, Trial],
    ) -> Trial | None:
        text = self.cells.get
        for name in ("run_id", "condition"):
            if not text(name):
                self.error(name, COLUMNS[name], "blank")
        if text("medium") != medium:
            self.error("medium", f"{medium}, the config's robot.medium", "medium", medium)
        curvature = self.number("curvature_times_R", -1, 1, "-1 to 1")
        frequency = math.nan
        if text("frequency_Hz"):
            lowest = math.ulp(0.0)
            allowed = f"above 0, up to {_HIGHEST_HZ:g} Hz, or blank: taken from the track"
            frequency = self.number("frequency_Hz", lowest, _HIGHEST_HZ, allowed)
        track, fault, nearest = plain_path(text("track") or "")
        if fault or not text("track"):
            wanted = "the path of a file in the folder of this sheet or below, with /"
            self.error("track", wanted, "path", nearest)
        self.once("run_id", text("run_id") or "", seen)
        self.once("track", track, seen)
        if text("run_id") in taken:
            self.error("run_id", "a name that no run of the campaign's run sheet has", "taken")
        if self.problems:
            return None
        found = Trial(
            text("run_id") or "", text("condition") or "", medium, curvature, frequency, track,
            text("note") or "", self.row,
        )  # fmt: skip
        first = conditions.setdefault(found.condition, found)
        if first.curvature_times_R != curvature:
            self.error(
                "curvature_times_R",
                f"{first.curvature_times_R:g}, as in row {first.row} of the same condition "
                f"{found.condition}",
                "condition",
            )
            return None
        return found

    def once(self, column: str, word: str, seen: dict[tuple[str, str], int]) -> None:
        # names become part of file names and ledgers: case alone must not tell them apart
        first = seen.setdefault((column, word.casefold()), self.row)
        if word and first != self.row:
            what = "a name" if column == "run_id" else "a track"
            self.error(column, f"{what} of its own; row {first} has this one", "repeated")
