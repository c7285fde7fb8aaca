"""Reads the run sheet and checks each row, each run with its tare, and all rows together.

A row is checked as a `DraftRow`: `text` and `number` have its good cells by column (a blank or bad cell is an empty
text, and has no number), `bad` the columns with errors, and `note` adds a problem. "Refuse" in the checks below means
to add a problem that is an error, so that the row makes no run; "warn", one that is a warning. A row without errors
becomes a `Run`.

The *tare* of a plate is a run of its rod alone on the same path (kind rod), that of a leg the leg turned in air
(leg_air): its force is subtracted.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from rftfit.campaign.columns import COLUMNS, DIRECTIONS, OF_SOURCES
from rftfit.campaign.config import PLATE_SHAPES, Arm, Config, ForceQuantity, MotionQuantity
from rftfit.campaign.files import MOST_SEARCHES, Folder, folded
from rftfit.campaign.problems import Problem, did_you_mean, join_words, unknown_word
from rftfit.campaign.rows import DraftRow, Schema, read_rows
from rftfit.conventions import file_extraction, motion_gamma_deg
from rftfit.directions import same_direction
from rftfit.store.chosen import chosen

SCHEMA = Schema("sheet", COLUMNS, rows="runs")
_CHOSEN = chosen("campaign", "sheet")

# kind of run, to the shapes of intruders that it can have
_SHAPES = {"plate": PLATE_SHAPES, "rod": PLATE_SHAPES, "leg": ("leg",), "leg_air": ("leg",)}
_LOGS = tuple(column for column in COLUMNS if column.form == "path" and column.needed)
_ZERO_LOG = next(column for column in COLUMNS if column.name == "zero_log")
# name of a column, to its place in the sheet
_ORDER = {column.name: index for index, column in enumerate(COLUMNS)}
_TARE_OF = {"plate": "rod", "leg": "leg_air"}
"""Kind of run, to the kind of its tare."""
_WITHOUT_TARE = {
    "refuse": "as NaN, with that as its reason",
    "flag": "with the force on rod and mount in it, flagged",
}
"""Setting `fit.missing_tare`, to how a run without a tare comes out; with another setting it needs none."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the campaign: a row of the run sheet after it has been checked.

    `medium`: Key of the configuration's ``media``; empty for ``leg_air``.
    `intruder`: Key of the configuration's ``intruders``.
    `beta_deg`, `gamma_deg`: Angle of the plate, and of the path on the way down; NaN for legs. Beta is NaN also for a
        rod that is the tare of plates at any angle.
    `depth_cm`: Depth of a horizontal run; NaN for all others.
    `force_log`, `motion_log`: Paths relative to the raw folder, with ``/`` and without ``.`` or ``..``.
    `tare_run`: run_id of the run to subtract; empty if there is none.
    `tare_shared`: True if that tare is meant to serve several runs.
    `surface_z_mm`: Arm z of the free surface; None: as the configuration states.
    `zero_log`: Force log without load that gives the zero; empty: the run's own rest in air.
    `stroke`: Number of the stroke along the path, from 1; None: the only one.
    `force_where`, `motion_where`, `force_columns`, `motion_columns`: Rows and columns of the logs that
        belong to the run, as the sheet writes them; empty: as the configuration states.
    `session`, `operator`, `plate`, `rod`: Labels that runs share; empty: not stated.
    `lacks_force_x`: True if the run is from a table without stress along x; no column of a run sheet.
    `rows_without_data`: Number of rows of a table left out for a value of `table.missing`; no column of a sheet either.
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
    row: int
    tare_run: str = ""
    tare_shared: bool = False
    surface_z_mm: float | None = None
    excluded: bool = False
    reason: str = ""
    note: str = ""
    zero_log: str = ""
    stroke: int | None = None
    force_where: str = ""
    motion_where: str = ""
    force_columns: str = ""
    motion_columns: str = ""
    session: str = ""
    operator: str = ""
    plate: str = ""
    rod: str = ""
    lacks_force_x: bool = False
    rows_without_data: int = 0

    @property
    def motion_gamma_deg(self) -> float:
        """Angle gamma of the motion itself: an extraction goes back along a path that is stated on the way down."""
        return motion_gamma_deg(self.direction, self.gamma_deg)

    def surface_of(self, arm: Arm) -> float:
        """Arm z of the free surface, mm: that of the row, else that of the configuration."""
        return arm.surface_z_mm if self.surface_z_mm is None else self.surface_z_mm


@dataclass(frozen=True)
class Vocabulary:
    """Words of the configuration that a sheet may use; None where errors of the configuration hide them.

    `media`: Keys of the media. `shapes`: Key of each intruder, to its shape, empty where that has an error. `config`:
    The whole configuration, if it has no error. Checks that need what is None are left out.
    """

    media: tuple[str, ...] | None = None
    shapes: Mapping[str, str] | None = None
    config: Config | None = None

    @property
    def schema(self) -> Schema:
        """Format of the sheet, with the media and intruders of this configuration as choices."""
        shapes = None if self.shapes is None else tuple(self.shapes)
        words = {"media": self.media, "intruders": shapes}
        columns = tuple(
            replace(column, choices=words[column.section]) if column.section else column
            for column in COLUMNS
        )
        return replace(SCHEMA, columns=columns)


def read_sheet(
    path: Path, file: str, vocabulary: Vocabulary, logs: Folder | None
) -> tuple[list[Run], list[Problem]]:
    """Read and check a run sheet.

    `file`: Name of the sheet for the user. `logs`: The raw folder; None if it is not known: log files are not checked
    then. Returns the rows without an error, in the order of the sheet, and all problems, in the order of the rows.
    """
    drafts, problems = read_rows(path, vocabulary.schema, file)
    for draft in drafts:
        _check_direction(draft)
        _check_intruder(draft, vocabulary)
        _check_gamma(draft)
        _check_direction_is_planned(draft, vocabulary)
        _check_depth(draft, vocabulary)
        _check_stroke(draft)
        _check_sources(draft)
        check_excluded(draft)
        if logs is not None:
            lost = "" if draft.yes("excluded") else "this run will be dropped"
            for column in (*_LOGS, _ZERO_LOG):
                draft.check_file(column, logs, lost)
    _check_ids(drafts)
    _check_files(drafts, vocabulary)
    _check_tares(drafts, vocabulary)
    problems.sort(
        key=lambda problem: (problem.place.row or 0, _ORDER.get(problem.place.column or "", -1))
    )
    return merge_rods([_make_run(draft) for draft in drafts if not draft.bad]), problems


def _make_run(draft: DraftRow) -> Run:
    """Make a run of a row without errors."""
    values: dict[str, Any] = {**draft.text, "row": draft.row}
    for column in COLUMNS:
        if column.form == "number":
            values[column.name] = draft.number.get(column.name, float("nan"))
        elif column.form == "flag":
            values[column.name] = draft.yes(column.name)
    stroke = draft.number.get("stroke")
    values["surface_z_mm"] = draft.number.get("surface_z_mm")
    values["stroke"] = None if stroke is None else int(stroke)
    return Run(**values)


# --- Checks within one row


def _check_direction(draft: DraftRow) -> None:
    """Refuse a direction that the kind of run cannot have."""
    kind, direction = draft.text["kind"], draft.text["direction"]
    if kind and direction and direction not in DIRECTIONS[kind]:
        allowed = f"{' or '.join(DIRECTIONS[kind])} for a {kind} run"
        draft.note("direction", "direction-kind", direction, allowed)


def _check_intruder(draft: DraftRow, vocabulary: Vocabulary) -> None:
    """Refuse an intruder whose shape does not fit the kind of run."""
    kind, intruder, shapes = draft.text["kind"], draft.text["intruder"], vocabulary.shapes
    if not kind or not intruder or shapes is None:
        return
    shapes_allowed = _SHAPES[kind]
    if shapes[intruder] and shapes[intruder] not in shapes_allowed:
        fitting = [name for name, shape in shapes.items() if shape in shapes_allowed]
        allowed = f"an intruder with shape {' or '.join(shapes_allowed)} for a {kind} run: "
        allowed += join_words(fitting) or "the config has none"
        draft.note("intruder", "intruder-kind", intruder, allowed)


def _check_gamma(draft: DraftRow) -> None:
    """Refuse an angle of the path that contradicts the direction."""
    gamma, direction = draft.number.get("gamma_deg"), draft.text["direction"]
    if gamma is None:
        return
    gamma_text = draft.text["gamma_deg"]
    if direction == "horizontal" and gamma != 0:
        draft.note("gamma_deg", "gamma-not-zero", gamma_text, "0 for a horizontal run")
    elif direction in ("intrusion", "extraction") and gamma == 0:
        allowed = f"above 0 for an {direction}; a path at gamma 0 is a horizontal run"
        draft.note("gamma_deg", "gamma-zero", gamma_text, allowed)
    elif direction == "intrusion" and gamma < 0:
        allowed = "above 0 for an intrusion; a motion up at a negative gamma is an extraction"
        draft.note("gamma_deg", "gamma-up", gamma_text, allowed)


def _check_direction_is_planned(draft: DraftRow, vocabulary: Vocabulary) -> None:
    """Refuse a plate run in a direction that the config's grid does not plan: most often a typing error."""
    config, medium = vocabulary.config, draft.text["medium"]
    beta, gamma = draft.number.get("beta_deg"), draft.number.get("gamma_deg")
    if config is None or not medium or beta is None or gamma is None:
        return
    grid, role = config.grid, config.media[medium].role
    if not grid.planned or role != "laboratory":
        return
    if draft.text["kind"] != "plate" or draft.yes("excluded"):
        return
    # the direction (beta, gamma) in the table of alpha, where an extraction stands under another one than in the sheet
    cell = (beta, gamma)
    if draft.text["direction"] == "extraction":
        cell = file_extraction(beta, gamma)[:2]
    if not any(grid.same(cell, planned) for planned in grid.planned):
        nearest = min(grid.planned, key=lambda planned_cell: math.dist(planned_cell, cell))
        allowed = (
            f"a direction planned in the config's grid, within {grid.angle_tolerance_deg:g} deg; this run "
            f"measures the cell (beta, gamma) = ({cell[0]:g}, {cell[1]:g}), the nearest planned one is "
            f"({nearest[0]:g}, {nearest[1]:g})"
        )
        angles_text = f"{draft.text['beta_deg']}, {draft.text['gamma_deg']}"
        draft.note("gamma_deg", "cell-unplanned", angles_text, allowed)


def _check_stroke(draft: DraftRow) -> None:
    """Refuse a stroke that is no whole number."""
    stroke = draft.number.get("stroke")
    if stroke is not None and stroke != int(stroke):
        draft.note("stroke", "not-whole", draft.text["stroke"], "a whole number, from 1")


def _check_sources(draft: DraftRow) -> None:
    """Refuse cells on rows and columns of the logs that are no assignments; the logs themselves are not looked at."""
    for name in OF_SOURCES:
        cell, form = draft.text[name], "column=value; column=value"
        try:
            if name.endswith("_where"):
                read_assignments(cell)
            else:
                form = "quantity=column; ..."
                read_log_columns(cell, "force" if name == "force_columns" else "motion")
        except ValueError as error:
            draft.note(name, "assignment", cell, f"{form}; {error}")


def _check_depth(draft: DraftRow, vocabulary: Vocabulary) -> None:
    """Warn of a horizontal run at a depth that the config does not list."""
    depth, config = draft.number.get("depth_cm"), vocabulary.config
    # the default lists the depths of the paper, which need not hold here
    if depth is None or config is None or "horizontal_depths_cm" not in config.fit.model_fields_set:
        return
    listed_cm = config.fit.horizontal_depths_cm
    if all(abs(depth - listed) > _CHOSEN.same_depth_cm for listed in listed_cm):
        depths, cell = ", ".join(f"{listed:g}" for listed in listed_cm), draft.text["depth_cm"]
        allowed = f"one of {depths} cm (fit.horizontal_depths_cm in the config)"
        draft.note("depth_cm", "depth-unlisted", cell, allowed, severity="warning")


def check_excluded(draft: DraftRow) -> None:
    """Refuse an excluded run without a reason, and warn of a reason for a run that is used."""
    if "excluded" in draft.bad or "reason" in draft.bad:
        return
    excluded, reason = draft.yes("excluded"), draft.text["reason"]
    if excluded and not reason:
        allowed = "an excluded run needs its reason, in words: it goes into the ledger"
        draft.note("reason", "excluded-without-reason", None, allowed)
    elif reason and not excluded:
        allowed = "a reason only where excluded is yes; this run is used"
        draft.note("reason", "reason-without-excluded", reason, allowed, severity="warning")


# --- Checks between rows


def _check_ids(drafts: list[DraftRow]) -> None:
    """Refuse a run_id that an earlier row has, also one that differs only in case."""
    first_drafts: dict[str, DraftRow] = {}
    for draft in drafts:
        name = draft.text["run_id"]
        first = first_drafts.setdefault(name.casefold(), draft)
        if first is draft or not name:
            continue
        if first.text["run_id"] == name:
            allowed = f"a name that no other run has; row {first.row} has it"
            draft.note("run_id", "duplicate-id", name, allowed)
        else:
            allowed = f"a name that differs by more than case from {first.text['run_id']}"
            draft.note("run_id", "case-id", name, f"{allowed} in row {first.row}")


def same_file_needs_one_clock(method: str) -> str:
    """Return the words on what is allowed where one file is both logs of a run, and `method` is not same_clock.

    `method`: Setting `clock.method`. One file has one clock: to bring two together would find an offset of noise.
    """
    return (
        "a file of its own; or, where this one holds force and motion, clock.method same_clock in "
        f"the config, found {method}"
    )


def _check_files(drafts: list[DraftRow], vocabulary: Vocabulary) -> None:
    """Refuse a log that two rows name, unless they are different strokes, rows or columns of it, or one rod.

    One log for two runs is mostly a typing error, and would count one push twice. Each use of a file, by a row as its
    force_log or motion_log, is compared with the first use of this file and with all uses of the same stroke, rows and
    columns of it: any other use differs in these.
    """
    config = vocabulary.config
    method = "same_clock" if config is None else config.clock.method
    tolerance_deg = (config.arm if config else Arm()).angle_tolerance_deg
    # file, to its first use; file, stroke, rows and columns, to all uses: each is a row and the column of the log
    first_uses: dict[str, tuple[DraftRow, str]] = {}
    equal_uses: defaultdict[object, list[tuple[DraftRow, str]]] = defaultdict(list)
    for draft in drafts:
        for log in ("force_log", "motion_log"):
            path = draft.text[log]
            if not path:
                continue
            selected = _rows_and_columns(draft, log)
            equal_uses_of_file = equal_uses[path, draft.number.get("stroke"), selected]
            first_use = first_uses.setdefault(folded(path), (draft, log))
            for earlier, earlier_log in [first_use, *equal_uses_of_file]:
                if earlier is draft and earlier_log == log:
                    continue
                path_there = earlier.text[earlier_log]
                # the row names this file as both of its logs
                has_both_logs = earlier is draft and path_there == path
                if has_both_logs and method != "same_clock":
                    draft.note(log, "one-file", path, same_file_needs_one_clock(method))
                    break
                kinds = draft.text["kind"], earlier.text["kind"]
                are_rods = earlier is not draft and kinds == ("rod", "rod")
                differences = _differences(draft, earlier) if are_rods else []
                # allowed: they take different parts of the file, or are one run
                if path_there == path and (
                    has_both_logs
                    or _rows_and_columns(earlier, earlier_log) != selected
                    or _are_different_strokes(draft, earlier, tolerance_deg)
                    or (are_rods and not differences)
                ):
                    continue
                where = "of this row" if earlier is draft else f"of row {earlier.row}"
                allowed = f"a file of its own; {earlier_log} {where} names this one"
                if are_rods:
                    allowed += f". Rows of one rod log must agree in {', '.join(differences)}"
                if path_there != path:
                    allowed += f", as {path_there}: some disks treat both names as one"
                draft.note(log, "shared-file", path, allowed)
                break
            equal_uses_of_file.append((draft, log))


def _rows_and_columns(draft: DraftRow, log: str) -> tuple[str, str]:
    """Return the rows and columns of a log that belong to a run, as its row states; `log`: force_log or motion_log."""
    kind = log.removesuffix("_log")
    return draft.text[f"{kind}_where"], draft.text[f"{kind}_columns"]


def _are_different_strokes(first_row: DraftRow, second_row: DraftRow, tolerance_deg: float) -> bool:
    """Return whether two rows name different strokes of one log.

    Strokes are counted for each direction of motion: a push and its pull back may both be number 1. `tolerance_deg`:
    The arm's, between the direction of a row and that of its log.
    """
    first, second = first_row.number.get("stroke"), second_row.number.get("stroke")
    # a row without a number takes the whole log, so that it differs from none
    if first is None or second is None or first != second:
        return None not in (first, second)
    first_gamma, second_gamma = (
        motion_gamma_deg(row.text["direction"], row.number.get("gamma_deg", 0))
        for row in (first_row, second_row)
    )
    # motions closer than twice the tolerance of the arm could not be told apart
    return abs((first_gamma - second_gamma + 180) % 360 - 180) > 2 * tolerance_deg


_MAY_DIFFER = ("run_id", "intruder", "beta_deg", "tare_run", "tare_shared", "reason", "note")
"""Columns in which rows of kind rod that name one log may differ, as one rod serves plates at several angles."""
_MUST_AGREE = tuple(
    column.name
    for column in COLUMNS
    if column.name not in (*_MAY_DIFFER, "operator", "plate", "rod")
)


def _differences(first_row: DraftRow, second_row: DraftRow) -> list[str]:
    """Return the columns in which two rows of kind rod differ so that they cannot be one run; empty: they are one."""
    return [
        name
        for name in _MUST_AGREE
        if first_row.number.get(name) != second_row.number.get(name)
        or (name not in first_row.number and first_row.text[name] != second_row.text[name])
    ]


def merge_rods(runs: list[Run]) -> list[Run]:
    """Merge rows of kind rod that name one log, each for plates at another angle, into one run.

    The merged run has the run_id of the first row, and no angle where the rows have different ones. In runs that name
    another of these rows as tare, this run replaces it.
    """
    # cells in which rows must agree, to the first row that has them
    first_rows: dict[tuple[object, ...], Run] = {}
    # run_id of a rod, to that of the first row with the same log
    merged_ids: dict[str, str] = {}
    # run_id of a merged run, to the attack angles of its rows
    angles: defaultdict[str, set[float]] = defaultdict(set)
    for run in runs:
        if run.kind == "rod":
            # as text, since NaN differs from itself
            key = tuple(str(getattr(run, name)) for name in _MUST_AGREE)
            merged_ids[run.run_id] = first_rows.setdefault(key, run).run_id
            angles[merged_ids[run.run_id]].add(run.beta_deg)
    merged = []
    for run in runs:
        if merged_ids.get(run.run_id, run.run_id) != run.run_id:
            continue
        beta_deg = math.nan if len(angles[run.run_id]) > 1 else run.beta_deg
        tare_run = merged_ids.get(run.tare_run, run.tare_run)
        merged.append(replace(run, beta_deg=beta_deg, tare_run=tare_run))
    return merged


def _check_tares(drafts: list[DraftRow], vocabulary: Vocabulary) -> None:
    """Check each run with its tare; warn of runs without a tare, and of tares without a run.

    First each run is compared with the row that it names; then what only all rows show: a shifted column, a tare that
    several runs share without saying so, and tares that no run uses.
    """
    # rows by run_id, the first of several with one
    by_id: dict[str, DraftRow] = {}
    for draft in drafts:
        by_id.setdefault(draft.text["run_id"], draft)
    by_id.pop("", None)
    missing_tare = vocabulary.config.fit.missing_tare if vocabulary.config else "refuse"
    ids_by_kind: defaultdict[str, list[str]] = defaultdict(list)
    for name in sorted(by_id):
        ids_by_kind[by_id[name].text["kind"]].append(name)
    # run_id of a tare, to the rows that use it; and the rows without a tare, with the words for the kind of tare
    users: defaultdict[str, list[DraftRow]] = defaultdict(list)
    untared: list[tuple[DraftRow, str]] = []
    searches = 0  # for a similar run_id
    for draft in drafts:
        kind, name = draft.text["kind"], draft.text["tare_run"]
        if kind not in _TARE_OF or "tare_run" in draft.bad:
            continue
        tare_kind = f"a {_TARE_OF[kind]} run"
        if name in by_id:
            if not draft.yes("excluded") and by_id[name].text["kind"] == _TARE_OF[kind]:
                users[name].append(draft)
            _check_match(draft, by_id[name])
        elif name:
            # a search compares all ids, which takes too long for each of thousands of rows
            searches += 1
            ids = ids_by_kind[_TARE_OF[kind]]
            nearest = did_you_mean(name, ids) if searches <= MOST_SEARCHES else None
            allowed = f"the run_id of {tare_kind} in this sheet"
            draft.note("tare_run", "tare-unknown", name, allowed, nearest)
        elif not draft.yes("excluded") and missing_tare in _WITHOUT_TARE:
            untared.append((draft, tare_kind))
    _report_shifted_column(drafts, by_id)
    _warn_without_tare(untared, missing_tare, none_tared=not users)
    for name, users_of_tare in users.items():
        # a rod with a blank angle is meant for several plates, and needs no `tare_shared`
        if by_id[name].text["kind"] != "rod" or by_id[name].text["beta_deg"]:
            _check_shared(name, users_of_tare)
    tares_in_use = {draft.text["tare_run"] for draft in drafts}
    for name, tare in by_id.items():
        kind, is_used = tare.text["kind"], name in tares_in_use
        if kind in _TARE_OF.values() and not is_used and not tare.yes("excluded"):
            allowed = (
                f"a tare that a run uses; no run uses {kind} {name}: name it under tare_run, of several for one angle "
                "each in a part of the runs, or exclude it"
            )
            tare.note("run_id", "tare-unused", name, allowed, severity="warning")


_MOST_ROWS = 5
"""Most rows named in one message."""


def _warn_without_tare(
    untared: list[tuple[DraftRow, str]], missing_tare: str, *, none_tared: bool
) -> None:
    """Warn of each run without a tare.

    One warning for all, if they are many, or if no run of the sheet has a tare (`none_tared`) and the config allows it.
    `untared`: Rows without a tare, each with the words for the kind of its tare. `missing_tare`: Setting of the config.
    """
    is_one_warning = none_tared and missing_tare == "flag" and len(untared) > 1
    if is_one_warning or len(untared) > _MOST_ROWS:
        rows = ", ".join(str(draft.row) for draft, _ in untared[:_MOST_ROWS])
        which = f"{len(untared)} runs"
        which = f"any of {which}" if none_tared else f"{which} (rows {rows}, ...)"
        allowed = f"no tare in {which}: they will come out {_WITHOUT_TARE[missing_tare]}"
        untared[0][0].note("tare_run", "tare-missing", None, allowed, severity="warning")
        return
    for draft, tare_kind in untared:
        allowed = f"no tare: this run will come out {_WITHOUT_TARE[missing_tare]}; name {tare_kind} to subtract"
        draft.note("tare_run", "tare-missing", None, allowed, severity="warning")


def _check_shared(tare: str, users: list[DraftRow]) -> None:
    """Refuse a tare that several runs use, where one of them does not state that it is shared."""
    if len(users) < 2:
        return
    rows = ", ".join(str(draft.row) for draft in users[:_MOST_ROWS])
    rows += ", ..." if users[_MOST_ROWS:] else ""
    for draft in users:
        if not draft.yes("tare_shared") and "tare_shared" not in draft.bad:
            allowed = (
                f"this must be yes on each run that uses {tare} (rows {rows}); or give each run a "
                "tare of its own"
            )
            draft.note("tare_shared", "tare-shared", None, allowed)


def _check_match(draft: DraftRow, tare: DraftRow) -> None:
    """Compare a run with its tare; add a problem for each difference: on another path the rod has another force."""
    kind, name = draft.text["kind"], draft.text["tare_run"]
    where = f"{name} (row {tare.row})"
    if not tare.text["kind"]:
        return
    if tare.text["kind"] != _TARE_OF[kind]:
        allowed = f"a {_TARE_OF[kind]} run for a {kind} run; {where} is a {tare.text['kind']} run"
        draft.note("tare_run", "tare-kind", name, allowed)
        return
    for column in ("medium", "intruder", "direction", "beta_deg", "gamma_deg", "depth_cm"):
        cell_of_run, cell_of_tare = draft.text[column], tare.text[column]
        if not cell_of_run or not cell_of_tare or column in draft.bad or column in tare.bad:
            continue
        if not _agree_in(column, draft, tare):
            allowed = (
                f"the tare must match: {column} is {cell_of_run} here and {cell_of_tare} in {where}"
            )
            draft.note("tare_run", f"tare-{column.partition('_')[0]}", name, allowed)
    if tare.yes("excluded") and not draft.yes("excluded"):
        allowed = f"a tare that is used; {where} is excluded, so this run will have none"
        draft.note("tare_run", "tare-excluded", name, allowed, severity="warning")


FEWEST_SHIFTED: int = _CHOSEN.fewest_shifted
"""Fewest contradicted rows, which do not fit their log or tare, that a shift of a column must explain."""


def find_shift(
    rows: Sequence[int], fits: Callable[[int, int], bool]
) -> tuple[int, list[int]] | None:
    """Find the number of rows by which a column is shifted, and the contradicted rows that this shift explains.

    A cell deleted or inserted in a spreadsheet shifts all cells below it in its column. `rows`: Indices of the
    contradicted rows among all rows. `fits`: Function of an index in `rows` and the index of a row: whether the cell in
    that row fits the contradicted row. Returns the shift (positive: cells stand above their row) and indices in `rows`;
    None where no shift explains most of them.
    """
    explained = {
        shift: [index for index, row in enumerate(rows) if fits(index, row - shift)]
        for shift in shifts_of_rows()
    }
    shift = max(explained, key=lambda shift: len(explained[shift]))
    if len(explained[shift]) < max(FEWEST_SHIFTED, _CHOSEN.share_shifted * len(rows)):
        return None
    return shift, explained[shift]


def shifts_of_rows() -> list[int]:
    """Return the shifts to try: rows by which cells stand above their row (positive) or below it, likeliest first."""
    return [sign * count for count in range(1, _CHOSEN.most_shifted_rows + 1) for sign in (1, -1)]


def _report_shifted_column(drafts: list[DraftRow], by_id: Mapping[str, DraftRow]) -> None:
    """Add a problem if a shift of the column of beta explains most plate runs that contradict their tares."""
    plates = [draft for draft in drafts if draft.text["kind"] == "plate"]

    def has_beta_of(index: int, tare: DraftRow) -> bool:
        """Return whether there is a plate run with this index, and it has the beta of a tare."""
        is_stated = 0 <= index < len(plates) and plates[index].text["beta_deg"]
        return bool(is_stated and _agree_in("beta_deg", plates[index], tare))

    # index of each plate run that contradicts its tare, and the tare
    contradictions = [
        (index, tare)
        for index, plate in enumerate(plates)
        if (tare := by_id.get(plate.text["tare_run"])) is not None
        and tare.text["beta_deg"]
        and not has_beta_of(index, tare)
    ]
    likeliest_shift = find_shift(
        [index for index, _ in contradictions],
        lambda contradiction, index: has_beta_of(index, contradictions[contradiction][1]),
    )
    if likeliest_shift is None:
        return
    shift, explained = likeliest_shift
    side = "above" if shift > 0 else "below"
    rows_away = side if abs(shift) == 1 else f"{abs(shift)} rows {side}"
    allowed = (
        f"beta_deg of the row {rows_away} fits the tares of {len(explained)} of {len(contradictions)} plate runs that do not match "
        "theirs: was the column shifted? Look whether a cell or a row is missing or there twice"
    )
    plates[contradictions[0][0]].note("beta_deg", "column-shifted", None, allowed)


def _agree_in(column: str, draft: DraftRow, tare: DraftRow) -> bool:
    """Return whether a run and its tare agree in a column, numbers within what a sheet rounds off."""
    if column not in draft.number:
        return draft.text[column] == tare.text[column]
    of_run, of_tare = draft.number[column], tare.number[column]
    if column == "beta_deg":
        # a plate at -90 deg is the same as at 90
        return bool(same_direction(of_run, 0.0, of_tare, 0.0, _CHOSEN.same_angle_deg))
    same = _CHOSEN.same_depth_cm if column == "depth_cm" else _CHOSEN.same_angle_deg
    return bool(abs(of_run - of_tare) <= same)


# --- Rows and columns of a log that belong to a run


LogKind = Literal["force", "motion"]

# kind of log, to the quantities that its columns can be
_QUANTITIES = {"force": get_args(ForceQuantity), "motion": get_args(MotionQuantity)}


def read_assignments(text: str) -> dict[str, str]:
    """Read ``name=value; name=value`` into a dictionary, empty for a blank text.

    Raises ValueError for another form, or a name given twice.
    """
    assignments: dict[str, str] = {}
    for item in filter(str.strip, text.split(";")):
        name, equals, value = (cell.strip() for cell in item.partition("="))
        if not (name and equals and value):
            raise ValueError(f"found {item.strip()!r}")
        if name in assignments:
            raise ValueError(f"found {name} twice")
        assignments[name] = value
    return assignments


def read_log_columns(text: str, log: LogKind) -> dict[str, str]:
    """Read ``quantity=column; quantity=column`` as assignments; raises ValueError also for an unknown quantity."""
    columns = read_assignments(text)
    for quantity in columns:
        if quantity not in _QUANTITIES[log]:
            raise ValueError(unknown_word("quantity", quantity, _QUANTITIES[log]))
    return columns
