"""Reads campaigns without logs: a table of stress against depth, or a finished table of alpha."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.config import UNIT_AREA, TableSettings
from rftfit.campaign.formats import ALPHA, OTHER_SENSE, RUN_ID, STRESS
from rftfit.campaign.problems import CampaignError, Place, Problem, join_words
from rftfit.campaign.rows import (
    BAD,
    DraftRow,
    HeaderCell,
    Line,
    Schema,
    TableRows,
    read_sheets,
    read_table_columns,
    same_angle,
)
from rftfit.campaign.sheet import Run, check_excluded
from rftfit.campaign.spikes import FEWEST_ROWS, find_spikes
from rftfit.conventions import FloatArray
from rftfit.directions import SAME_DEPTH_CM, TOLERANCE_DEG, number_depths, same_direction
from rftfit.store.chosen import chosen
from rftfit.table.numbers import number_of
from rftfit.table.units import ALPHA_TO_N_PER_CM3, folded_name, units_like

_Grid = tuple[str, list[Line]]

_UNIT_KEYS = {
    **dict.fromkeys(("beta_deg", "gamma_deg"), "angle_unit"),
    "depth_cm": "depth_unit",
    **dict.fromkeys(("stress_z_N_per_cm2", "stress_x_N_per_cm2"), "stress_unit"),
    **dict.fromkeys(("alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "se_z", "se_x"), "alpha_unit"),
}
"""Column, to the key of `table` in the config that states its unit."""

_CHOSEN = chosen("campaign", "tables")

_NUMBERS = (
    "depth_cm",
    "stress_z_N_per_cm2",
    "stress_x_N_per_cm2",
    "alpha_z_N_per_cm3",
    "alpha_x_N_per_cm3",
    "se_z",
    "se_x",
    "n",
    "depth_from_cm",
    "depth_to_cm",
)


@dataclass(frozen=True)
class TablePush:
    """Rows of the table that belong to one run, in their order.

    `columns`: Name to values, shape (n,), in cm and N: depth and stress, or alpha, error and number of runs; stress
    has also ``other_sense``: whether depth changes opposite to gamma; and ``alone``: whether depth or stress is
    far from the rows before and after.
    """

    run: Run
    columns: Mapping[str, npt.NDArray[Any]]


class TableRead(NamedTuple):
    """Content of a table: its runs, sorted by run_id; problems; media, key to title; units of columns, in words."""

    pushes: list[TablePush]
    problems: list[Problem]
    media: dict[str, str]
    units: str


def read_pushes(
    path: Path,
    file: str,
    table: TableSettings,
    media: Iterable[str],
    within: str,
    tolerance_deg: float = TOLERANCE_DEG,
) -> TableRead:
    """Read the table of a campaign: a row for each depth or direction; or, for alpha, in blocks as in Table S5.

    `file`: Name of the table for messages. `media`: Keys of the media of the config; empty: those that the table names.
    `within`: Path relative to the raw folder. `tolerance_deg`: Angles this close to 90 are 90.
    """
    schema = _schema_of(table, file)
    problems: list[Problem] = []
    headers: dict[str, HeaderCell] = {}
    grids = _read_grids(path, schema) if table.holds == "alpha" else []
    titles = {key: key for key in media} or _media_of_blocks(grids)
    drafts = _rows_of_blocks(grids, schema, table, tuple(titles), problems)
    if drafts is None:
        rows, headers, problems = read_table_columns(path, schema, file)
        _add_lines_of_config(problems, schema)
        for ours, header in headers.items():
            place, stated = Place(file, column=header.name), header.unit * header.is_stated
            problems += _other_unit(ours, header.name, stated, table, place, schema.area)
        for ours, theirs in table.columns.items() if headers else ():
            if ours not in headers or headers[ours].name != theirs:
                place, allowed = Place(file, column=theirs), "a column of the file"
                text = f"{allowed}: table.columns of the config gives {ours} this name"
                problems.append(Problem(f"{schema.area}.missing-column", place, theirs, text))
    else:
        schema = replace(schema, columns=(*schema.columns, RUN_ID))
        rows = TableRows.of(drafts, schema, {})
    media_named = [medium for medium in rows.texts["medium"] if medium not in ("", BAD)]
    titles = titles or {key: key for key in media_named or [key_of(path.stem) or "medium"]}
    media_known = tuple(titles)
    checked = _CheckedRows(rows, schema, problems)
    checked.warn_of_no_data()
    checked.check_numbers({header.unit for header in headers.values()}, tolerance_deg)
    checked.number_media(media_known)
    pushes = checked.group_runs(media_known, within)
    ids = {push.run.run_id for push in pushes}
    if len(ids) < len(pushes):  # runs of two media have one name
        runs = (replace(push.run, run_id=f"{push.run.medium}_{push.run.run_id}") for push in pushes)
        pushes = [replace(push, run=run) for push, run in zip(pushes, runs, strict=True)]
    problems.sort(key=lambda problem: problem.place.row or 0)
    read_as = [
        f"{header.name} in {header.unit}" for name, header in headers.items() if name in _UNIT_KEYS
    ]
    pushes = sorted(pushes, key=lambda push: push.run.run_id)
    return TableRead(pushes, problems, titles, ", ".join(read_as))


def pushes_in(path: Path) -> tuple[pd.DataFrame, list[Problem]]:
    """Read a table of alpha of one medium; return it in the form for `rftfit.estimate_map`, and warnings.

    alpha_x may be missing: a penetrometer measures only the force along its path. Raises CampaignError
    with all problems if there is an error.
    """
    schema = _schema_of(TableSettings(holds="alpha"), str(path))
    rows, headers, problems = read_table_columns(path, schema, str(path))
    checked = _CheckedRows(rows, schema, problems)
    checked.check_numbers({header.unit for header in headers.values()}, TOLERANCE_DEG)
    medium = next((name for name in rows.texts["medium"] if name), "")
    checked.number_media((medium,))
    pushes = checked.group_runs((medium,), "")
    if any(problem.severity == "error" for problem in problems):
        raise CampaignError(problems)
    names = {"se_z": "alpha_z_se_N_per_cm3", "se_x": "alpha_x_se_N_per_cm3"}
    table = [
        {"beta_deg": run.beta_deg, "gamma_deg": run.gamma_deg}
        | {names.get(name, name): float(values[0]) for name, values in push.columns.items()}
        for push in pushes
        if not (run := push.run).excluded
    ]
    return pd.DataFrame(table), problems


def _schema_of(table: TableSettings, file: str) -> Schema:
    """Return the format of a table, with the names and units of columns that the config states."""
    schema = STRESS if table.holds == "stress" else ALPHA
    names_in_file = {str(ours): (theirs,) for ours, theirs in table.columns.items()}
    columns = [
        replace(
            column,
            also=(*column.also, *names_in_file.get(column.name, ())),
            default=str(getattr(table, key)) if (key := _UNIT_KEYS.get(column.name)) else "",
        )
        for column in schema.columns
    ]
    missing = dict.fromkeys(_NUMBERS, tuple(table.missing))
    return replace(schema, columns=tuple(columns), missing=missing, file=file)


def _add_lines_of_config(problems: list[Problem], schema: Schema) -> None:
    """Add lines of config to the problem of a missing column, if the file has it under a name without a unit.

    With these lines the program can read the column.
    """
    unread = [
        problem.place.column or ""
        for problem in problems
        if problem.code.endswith(".unknown-column")
    ]
    columns = {column.name: column for column in schema.columns if column.name in _UNIT_KEYS}
    for place, problem in enumerate(problems):
        column = columns.get(problem.place.column or "")
        if not problem.code.endswith(".missing-column") or column is None:
            continue
        header = next((header for header in unread if folded_name(header) in column.stems), None)
        if header is not None:
            key = _UNIT_KEYS[column.name]
            lines = f'table: {{columns: {{{column.name}: "{header}"}}, {key}: ...}}'
            allowed = (
                f"{problem.allowed}, or in the config, one of {', '.join(column.units)}: {lines}"
            )
            problems[place] = replace(problem, allowed=allowed, nearest=None)


def _other_unit(
    ours: str, header: str, stated: str, table: TableSettings, place: Place, area: str
) -> list[Problem]:
    """Return the problem of a header that states another unit than the config, in a list; empty without one.

    `ours`, `header`: Name of the column here and in the file. `stated`: Unit in the header; empty: none.
    """
    key = _UNIT_KEYS.get(ours, "")
    if not stated or key not in table.model_fields_set:
        return []
    in_config = str(getattr(table, key))
    if units_like(stated)[in_config] == 1:
        return []
    allowed = f"a column in {in_config}, as {key} of `table` in the config says; set {key}: {stated}, or convert the column and rename it"
    return [Problem(f"{area}.other-unit", place, header, allowed)]


@dataclass
class _CheckedRows:
    """Rows of a table while they are checked: any number of rows with the same fault make one problem."""

    rows: TableRows
    schema: Schema
    problems: list[Problem]

    def note(
        self,
        wrong: npt.NDArray[np.bool_],
        column: str,
        code: str,
        value_found: str | None,
        allowed: str,
    ) -> None:
        """Mark the rows `wrong`, bool of shape (n,), as bad, and add one problem at the first of them.

        `value_found`: Text with `{}` for the value of the first row. `code`, `allowed`: As in `Problem`.
        """
        columns, row_indices = self.rows.columns, wrong.nonzero()[0]
        if not row_indices.size:
            return
        columns["bad"] |= wrong
        value_found = value_found and value_found.format(columns[column][row_indices[0]])
        allowed += f"; this is the first of {row_indices.size} rows" if row_indices.size > 1 else ""
        note = DraftRow(self.schema, int(columns["row"][row_indices[0]]), self.problems).note
        note(column, code, value_found, allowed)

    def warn_of_no_data(self) -> None:
        """Warn of the rows with a number that means no data, in whose place the checks see 0."""
        columns = self.rows.columns
        if not (row_indices := np.flatnonzero(columns["no_data"])).size:
            return
        allowed = f"values other than those of table.missing in the config; {row_indices.size} rows are left out"
        draft = DraftRow(self.schema, int(columns["row"][row_indices[0]]), self.problems)
        draft.note("depth_cm", "no-data", None, allowed, severity="warning")

    def check_numbers(self, units: Collection[str], tolerance_deg: float) -> None:
        """Check angles, depths and the size of alpha.

        `units`: Units of the columns in the file. `tolerance_deg`: Angles this close to 90 become 90.
        """
        columns = self.rows.columns
        angles = [columns["beta_deg"], columns["gamma_deg"]]
        largest = max(np.abs(np.nan_to_num(angle)).max(initial=0) for angle in angles)
        if "deg" in units and largest <= _CHOSEN.largest_rad and np.unique(angles).size > 1:
            largest_text = f"no angle larger than {largest:g}"
            allowed = "degrees; looks like rad: set angle_unit: rad in `table` of the config"
            code = f"{self.schema.area}.looks-like-rad"
            place = Place(self.schema.file, column="gamma_deg")
            self.problems.append(Problem(code, place, largest_text, allowed))
        for name in ("beta_deg", "gamma_deg"):
            values = columns[name]
            upright = same_direction(0.0, np.abs(values), 0.0, 90.0, tolerance_deg)
            allowed = "-90 to 90 deg"
            if name == "gamma_deg":
                allowed += "; seen from behind, (beta, gamma) is (-beta, 180 deg - gamma) with the other sign of x"
            beyond = (np.abs(values) > 90) & ~upright
            if name == "beta_deg" and beyond.any():
                allowed += same_angle(float(values[beyond][0]), 180, -90)[1]
            self.note(beyond, name, "out-of-range", "{:g}", allowed)
            columns[name] = np.where(upright, np.copysign(90, values), values)
        if "depth_cm" in columns:
            allowed = "0 or more: depth grows downward from the free surface"
            self.note(columns["depth_cm"] < 0, "depth_cm", "negative-depth", "{:g} cm", allowed)
        alpha = np.abs(columns.get("alpha_z_N_per_cm3", np.empty(0)))
        alpha = alpha[np.isfinite(alpha)]
        if alpha.size and np.median(alpha) > _CHOSEN.largest_alpha_N_per_cm3:
            largest_text = f"{np.median(alpha):.6g} N/cm^3 in the middle of all rows"
            allowed = (
                "less than a hundred for sand and soil; is it in another unit? Set alpha_unit of `table` in "
                f"the config to one of {', '.join(ALPHA_TO_N_PER_CM3)}"
            )
            place = Place(self.schema.file, column="alpha_z_N_per_cm3")
            code = f"{self.schema.area}.large-alpha"
            self.problems.append(Problem(code, place, largest_text, allowed, severity="warning"))
        if "n" in columns:
            self.note(columns["n"] % 1 > 0, "n", "not-whole", "{:g}", "a whole number of runs")

    def number_media(self, media: tuple[str, ...]) -> None:
        """Replace names of media by their places in `media`; with a single medium the name may be blank."""
        codes, places = self.rows.columns["medium"], []
        for name, code in self.rows.texts["medium"].items():
            medium = name or (media[0] if len(media) == 1 else "")
            if medium not in (*media, BAD):
                allowed = f"one of {join_words(media)} (media in the config)"
                self.note(codes == code, "medium", "unknown-medium", name or None, allowed)
            places.append(media.index(medium) if medium in media else -1)
        self.rows.columns["medium"] = np.array(places, dtype=np.int32)[codes]

    def group_runs(self, media: tuple[str, ...], file: str) -> list[TablePush]:
        """Group the rows into runs: each row of alpha, or the rows of stress with one run_id or one direction.

        `file`: Path of the table in the raw folder.
        """
        columns, texts = self.rows.columns, self.rows.texts
        if columns["bad"].any():
            columns = {name: values[~columns["bad"]] for name, values in columns.items()}
        # `order` puts the rows of a run together; `first`: first row of each run in this order
        order: Any = slice(None)
        first = np.arange(columns["row"].size)
        if "depth_cm" in columns:
            run, unnamed = columns["run_id"], texts["run_id"].get("", -1)
            keys = [columns["medium"], run]
            if unnamed >= 0:
                angles = (columns[f"{angle}_deg"] for angle in ("beta", "gamma"))
                keys += [np.where(run == unnamed, angle.round(4), 0.0) for angle in angles]
            # the rows of a run mostly stand together, so only the first row of each stretch is compared
            changes = [values[1:] != values[:-1] for values in keys]
            first = np.flatnonzero(np.append(run.size > 0, np.any(changes, axis=0)))
            heads = pd.DataFrame({place: values[first] for place, values in enumerate(keys)})
            group = heads.groupby([*heads], sort=False).ngroup().to_numpy()
            # some run has several stretches: sort the rows by run
            if np.unique(group).size < group.size:
                rows = np.repeat(group, np.diff(first, append=run.size))
                order = np.argsort(rows, kind="stable")
                first = np.flatnonzero(np.diff(rows[order], prepend=-1))
        columns = {name: values[order] for name, values in columns.items()}
        words = {name: [*texts[name]] for name in texts}
        notes: list[Problem] = []
        pushes = []
        for start, stop in pairwise([*first.tolist(), columns["row"].size]):
            all_rows = {name: values[start:stop] for name, values in columns.items()}
            has_data = ~all_rows.pop("no_data", np.zeros(stop - start, dtype=bool))
            columns_of_run = {name: values[has_data] for name, values in all_rows.items()}
            if not has_data.any():
                draft = DraftRow(self.schema, int(all_rows["row"][0]), notes)
                allowed = "one row or more with data in each run; this one is left out"
                draft.note("depth_cm", "run-without-data", None, allowed, severity="warning")
                continue
            words_of_run = {
                name: words[name][columns_of_run[name][0]] for name in words if name != "medium"
            }
            push = _make_push(
                columns_of_run,
                words_of_run,
                media[columns_of_run["medium"][0]],
                self.schema,
                notes,
                file,
            )
            without_data = int(np.count_nonzero(~has_data))
            pushes.append(replace(push, run=replace(push.run, rows_without_data=without_data)))
        # the same problem of several runs is told once
        for code in dict.fromkeys(problem.code for problem in notes):
            first_problem, *others = (problem for problem in notes if problem.code == code)
            count_words = f"; this is the first of {1 + len(others)} runs" if others else ""
            allowed = first_problem.allowed + count_words
            self.problems.append(replace(first_problem, allowed=allowed))
        return pushes


def _make_push(
    columns_of_run: dict[str, npt.NDArray[Any]],
    words_of_run: dict[str, str],
    medium: str,
    schema: Schema,
    problems: list[Problem],
    file: str,
) -> TablePush:
    """Make a run of its rows, and add its problems.

    `columns_of_run`: Columns of the rows with data. `words_of_run`: Texts of the first row.
    """
    beta, gamma = (float(columns_of_run[f"{angle}_deg"][0]) for angle in ("beta", "gamma"))
    row, level = int(columns_of_run["row"][0]), math.nan
    lacks_force_x = False
    stated_name = words_of_run.get("run_id", f"row{row:05d}")
    name = stated_name or _name_of_direction(beta, gamma)
    draft = DraftRow(schema, row, problems, words_of_run)
    check_excluded(draft)
    for column in ("beta_deg", "gamma_deg", "excluded"):
        # rows without a run_id were grouped by rounded angles, which may differ in the last digits
        most_difference = 1e-6 if stated_name else 1e-3
        differs = abs(columns_of_run[column] - columns_of_run[column][0]) > most_difference
        if differs.any():
            draft.row = int(columns_of_run["row"][differs][0])
            allowed = f"as in row {row}: all rows of the run {name} have one direction, and are excluded or not"
            draft.note(column, "two-in-one", None, allowed)
    columns = {name: columns_of_run[name] for name in _NUMBERS if name in columns_of_run}
    if (depth := columns.get("depth_cm")) is not None:
        if gamma == 0 and depth.max() - depth.min() <= SAME_DEPTH_CM:
            level = float(depth[0])
        columns["stress_x_N_per_cm2"], lacks_force_x = _stress_x(columns, draft)
        columns["alone"] = _rows_alone(columns)
        columns["other_sense"], again = _rows_against_gamma(depth, gamma, columns["alone"])
        if not draft.yes("excluded"):
            _note_depths(
                draft, columns_of_run | columns, columns["other_sense"], again, name, stated_name
            )
    direction = "extraction" if gamma < 0 else "intrusion" if math.isnan(level) else "horizontal"
    run = Run(
        run_id=name,
        kind="plate",
        medium=medium,
        intruder=UNIT_AREA,
        direction=direction,
        beta_deg=beta,
        gamma_deg=gamma,
        depth_cm=level,
        force_log=file,
        motion_log=file,
        tare_run="",
        tare_shared=False,
        surface_z_mm=None,
        excluded=draft.yes("excluded"),
        reason=words_of_run["reason"],
        note="",
        row=row,
        session=words_of_run["session"],
        operator=words_of_run["operator"],
        plate=words_of_run["plate"],
        rod=words_of_run["rod"],
        lacks_force_x=lacks_force_x,
    )
    return TablePush(run, columns)


def _stress_x(columns: Mapping[str, npt.NDArray[Any]], draft: DraftRow) -> tuple[FloatArray, bool]:
    """Return stress along x (0 for a run without) and whether the run has none; refuse one with it in some rows."""
    size = columns["depth_cm"].size
    stress = columns.get("stress_x_N_per_cm2", np.full(size, math.nan))
    blank = np.isnan(stress)
    if blank.any() and not blank.all():
        allowed = (
            f"a number in all rows of a run, or in none; {np.count_nonzero(blank)} rows are blank"
        )
        draft.note("stress_x_N_per_cm2", "blank", None, allowed)
    # a column of zeros may have been filled in for a channel that was not measured
    return np.nan_to_num(stress), bool(blank.any() or not stress.any())


def _rows_alone(columns: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[np.bool_]:
    """Return which rows have a depth or stress far from the rows before and after, bool of shape (n,)."""
    stress = [columns[f"stress_{c}_N_per_cm2"] for c in "zx"]
    most_rows = max(FEWEST_ROWS, int(_CHOSEN.most_away * stress[0].size))
    alone = [find_spikes(columns["depth_cm"], times=_CHOSEN.times_step_of_depth)]
    alone += [find_spikes(values, most_rows, ends_in_push=True) for values in stress]
    return np.asarray(np.any(alone, axis=0))


def _rows_against_gamma(
    depth: FloatArray, gamma: float, alone: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.bool_], int]:
    """Apply `rows_against_gamma` to the rows that do not stand alone."""
    kept = np.flatnonzero(~alone)
    against = np.zeros(depth.size, dtype=bool)
    against[kept], again = rows_against_gamma(depth[kept], gamma)
    return against, int(kept[again]) if again else 0


def _note_depths(
    draft: DraftRow,
    columns_of_run: dict[str, npt.NDArray[Any]],
    differs: npt.NDArray[np.bool_],
    again: int,
    name: str,
    stated_name: str,
) -> None:
    """Add the problems that the depths of a run show: several pushes in one run, or rows that are left out.

    `differs`: Rows in which depth changes in the sense opposite to gamma. `again`: Row where a second push starts;
    0: none. `stated_name`: Name of the run in the table; empty: none.
    """
    depth = columns_of_run["depth_cm"]
    ask = "give each push a run_id of its own"
    if not stated_name:
        ask = "which column identifies the runs? Its name is run_id, or is given as run_id in table.columns of the config"
    if (alone := np.flatnonzero(columns_of_run["alone"])).size:
        draft.row = int(columns_of_run["row"][alone[0]])
        text = f"depth and stress near those of the rows before and after; {alone.size} rows of the run {name} are left out"
        draft.note("depth_cm", "stands-alone", f"{depth[alone[0]]:g} cm", text, severity="warning")
    times = np.diff(np.flatnonzero(np.diff(depth, prepend=-1, append=-1)))
    if again:
        draft.row = int(columns_of_run["row"][again])
        allowed = f"depth that changes one way in the run {name}; here another push starts: {ask}; rows of one push stand in the order of depth"
        draft.note("depth_cm", "starts-again", f"{depth[again]:g} cm", allowed)
    elif 1 < times[0] <= _CHOSEN.most_repeats and (times == times[0]).all():
        text = f"each depth of the run {name} occurs {times[0]} times; if these are so many pushes: {ask}"
        draft.note("depth_cm", "depths-repeated", None, text, severity="warning")
    if differs.any() and not again:
        draft.row = int(columns_of_run["row"][differs][0])
        text = f"from here on {np.count_nonzero(differs)} rows of the run {name} are left out: {OTHER_SENSE}"
        draft.note("depth_cm", "other-sense", None, text, severity="warning")


def rows_against_gamma(depth: FloatArray, gamma: float) -> tuple[npt.NDArray[np.bool_], int]:
    """Return where depth changes opposite to gamma (deg), bool of shape (n,), and the row where a second push starts.

    Row 0: there is none. A run whose depth changes in one sense only has no wrong row, whatever its gamma,
    since tables may be sorted by depth.
    """
    wrong = np.zeros(depth.size, dtype=bool)
    if gamma == 0:
        level = number_depths(depth)
        starts = np.flatnonzero(np.diff(level, prepend=-1))
        _, first = np.unique(level[starts], return_index=True)
        twice = np.setdiff1d(np.arange(starts.size), first)
        return wrong, int(starts[twice[0]]) if twice.size else 0
    turns, sense = _reversals(depth, gamma)
    right_ways = 0
    for place, (start, stop) in enumerate(pairwise([0, *turns, depth.size - 1]) if turns else ()):
        is_right = sense * (-1) ** place * gamma > 0
        right_ways += is_right
        # a second push starts after a jump back within one row, or with a second way in the sense of gamma
        if stop == start + 1 or (is_right and right_ways > 1):
            return wrong, stop if stop == start + 1 else start
        wrong[start + (place > 0) : stop + 1] = not is_right
    return wrong, 0


def _reversals(depth: FloatArray, gamma: float) -> tuple[list[int], int]:
    """Return the rows where depth turns by more than noise, at most some, and the sign of its change at the start.

    Rows of a pause at a turn count to the way against the sense of gamma.
    """
    least = _CHOSEN.least_turn * float(depth.max() - depth.min())
    ways = (depth, -depth)
    grown, shrunk = (int(np.argmax(way - np.minimum.accumulate(way) > least)) for way in ways)
    begins = sense = 1 if grown and (grown < shrunk or not shrunk) else -1
    turns = [0]
    while len(turns) <= _CHOSEN.most_turns:
        ahead = sense * depth[turns[-1] :]
        back = np.maximum.accumulate(ahead) - ahead > least
        if not back.any():
            break
        before = ahead[: int(np.argmax(back))]
        farthest = np.flatnonzero(before == before.max())
        turns.append(turns[-1] + int(farthest[0 if sense * gamma > 0 else -1]))
        sense = -sense
    return turns[1:], begins


def _name_of_direction(beta: float, gamma: float) -> str:
    """Return the name of a run without one, by its direction: ``b30_gm45`` for (30, -45)."""
    return f"b{beta:g}_g{gamma:g}".replace("-", "m")


# --- The layout of Table S5: a block for each component, rows by beta, columns by gamma

_COMPONENT = re.compile(
    r"\W*(?:measured\s+)?(?:alpha|\N{GREEK SMALL LETTER ALPHA})\W*_?\W*([zx])\b[^a-z]{0,4}.{0,24}",
    re.IGNORECASE,
)
"""Head of a block, for example ``alpha_z (N/cm^3)``; its group is the component."""


def _rows_of_blocks(
    grids: list[_Grid],
    schema: Schema,
    table: TableSettings,
    media: tuple[str, ...],
    problems: list[Problem],
) -> list[DraftRow] | None:
    """Return the rows, one for each direction, of a table in blocks; None where the file has no blocks.

    A block has a head that names alpha_z or alpha_x, in its corner or above it; gamma along its first
    row; and beta down its first column. The name of a sheet, or a line with nothing but the key of a medium,
    says of which medium the blocks below are.
    """
    draft_of_direction: dict[tuple[str, float, float], DraftRow] = {}
    columns = {column.name: column for column in schema.columns}
    to_deg = columns["beta_deg"].units[columns["beta_deg"].default]
    for sheet, rows in grids:
        medium = next((key for key in media if key == key_of(sheet)), "")
        component, scale = "", 1.0
        gammas: dict[int, float] = {}
        width = max((len(cells) for _, cells in rows), default=0)
        components = _find_components(rows)
        for number, cells in rows:
            texts = [cell.strip() for cell in cells] + [""] * (width - len(cells))
            first_cell = texts[0]
            numbers = {i: _finite_number(text) for i, text in enumerate(texts) if i > 0}
            has_numbers = any(value is not None for value in numbers.values())
            if (lone := key_of("".join(texts))) in media:
                medium, component, gammas = lone, "", {}
            elif number in components:
                component, gammas = components[number], {}
                column = columns[f"alpha_{component}_N_per_cm3"]
                unit, place = column.unit_in(first_cell), Place(schema.file, number)
                problems += _other_unit(column.name, first_cell, unit, table, place, schema.area)
                scale = column.units[unit or column.default]
            elif first_cell and _finite_number(first_cell) is None and not has_numbers:
                # a line of words ends a block
                component, gammas = "", {}
            if component and not gammas and _finite_number(first_cell) is None:
                # the row of gammas: column to gamma
                gammas = {i: value for i, value in numbers.items() if value is not None}
                gammas = gammas if len(gammas) > 1 else {}
            elif component and gammas and (beta := _finite_number(first_cell)) is not None:
                name = f"alpha_{component}_N_per_cm3"
                for i, gamma in gammas.items():
                    key, text, value = (medium, beta, gamma), texts[i], numbers[i]
                    draft = draft_of_direction.setdefault(key, DraftRow(schema, number, problems))
                    if name in draft.number:
                        allowed = f"each direction once; row {draft.row} has it"
                        DraftRow(schema, number, problems).note(name, "twice", text, allowed)
                    draft.text |= {"medium": medium, "run_id": _name_of_direction(beta, gamma)}
                    draft.number |= {"beta_deg": beta * to_deg, "gamma_deg": gamma * to_deg}
                    if value is not None:
                        is_missing = value in table.missing
                        draft.no_data |= is_missing
                        draft.number[name] = 0.0 if is_missing else value * scale
                    elif text:
                        allowed = "a number, or nothing where none was measured"
                        draft.note(name, "not-a-number", text, allowed)
    both = {"alpha_z_N_per_cm3", "alpha_x_N_per_cm3"}
    if not any(both <= {*draft_row.number} for draft_row in draft_of_direction.values()):
        return None
    for draft in draft_of_direction.values():
        for name in sorted(both - {*draft.number} - draft.bad):
            if both & {*draft.number}:  # a direction without either was not measured
                beta, gamma = (draft.number[f"{angle}_deg"] for angle in ("beta", "gamma"))
                allowed = f"a number at beta {beta:g}, gamma {gamma:g}, where the block of the other component has one"
                draft.note(name, "one-component", None, allowed)
    return [
        draft_row
        for draft_row in draft_of_direction.values()
        if both & {*draft_row.number} or draft_row.bad
    ]


def key_of(name: str) -> str:
    """Return a key for the config, made of the name of a sheet, a file or a medium."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name.strip()).strip("_.-")[:64]


def _media_of_blocks(grids: list[_Grid]) -> dict[str, str]:
    """Return key to title of the media in a table of blocks, in its order; empty for a table without blocks."""
    titles: dict[str, str] = {}
    for sheet, rows in grids:
        if not _find_components(rows):
            continue
        # media are named by lines with a single cell, or by the sheets
        alone = [row[0] for _, row in rows if len([c for c in row if c.strip()]) == 1]
        names = [
            cell
            for cell in alone
            if not _COMPONENT.fullmatch(cell) and _finite_number(cell) is None
        ]
        if len(grids) > 1 or not names:
            names = [sheet]
        titles |= {key_of(name): name.strip() for name in names}
    titles.pop("", None)
    return titles


def _find_components(rows: list[Line]) -> dict[int, str]:
    """Return row to component, x or z, of each head of a block in a sheet; two blocks without heads are z and x."""
    heads = {number: row[0].strip() for number, row in rows}
    component_of_row = {
        number: component[1].lower()
        for number, head in heads.items()
        if (component := _COMPONENT.fullmatch(head))
    }
    corners = [
        number
        for number, row in rows
        if not row[0].strip()
        and len(row) > 2
        and all(_finite_number(cell) is not None for cell in row[1:] if cell.strip())
    ]
    return component_of_row or (dict(zip(corners, "zx", strict=True)) if len(corners) == 2 else {})


def _read_grids(path: Path, schema: Schema) -> list[_Grid]:
    """Return name and filled rows of each sheet of a table; empty where it cannot be read."""
    try:
        return list(read_sheets(path, schema))
    except CampaignError:
        return []  # `read_table_columns`, called next, makes the problem


def _finite_number(text: str) -> float | None:
    """Return a cell as a number; None where it is none."""
    value = number_of(text)
    return value if math.isfinite(value) else None
