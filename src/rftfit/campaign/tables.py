"""Reads campaigns without logs: a table of stress against depth, or a finished table of alpha.

Columns and units are those of `STRESS` and `ALPHA` (`rftfit.campaign.formats`): angles beta_deg and gamma_deg of a push
in deg, depth_cm, stress_z_N_per_cm2 and stress_x_N_per_cm2, alpha_z_N_per_cm3 and alpha_x_N_per_cm3 with their standard
errors se_z and se_x, positive upward and toward +x. The config's section `table` may say other names and units.

The way: file -> `TableRows`, its rows as columns -> checks that mark rows as bad (`_CheckedRows`) -> one `TablePush` a
run. A table of alpha may also stand in *blocks*, as Table S5 of the paper does: one block a component, its rows by
beta, its columns by gamma.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.columns import LABELS
from rftfit.campaign.config import UNIT_AREA, TableSettings
from rftfit.campaign.formats import ALPHA, OTHER_SENSE, RUN_ID, STRESS
from rftfit.campaign.problems import CampaignError, Place, Problem, join_words
from rftfit.campaign.rows import (
    BAD,
    Columns,
    DraftRow,
    HeaderCell,
    Line,
    Schema,
    TableColumn,
    TableRows,
    read_sheets,
    read_table_columns,
    same_angle,
)
from rftfit.campaign.sheet import Run, check_excluded
from rftfit.campaign.spikes import MOST_LONE_ROWS, find_spikes
from rftfit.conventions import BoolArray, FloatArray, IndexArray
from rftfit.directions import SAME_DEPTH_CM, TOLERANCE_DEG, number_depths, same_direction
from rftfit.store.chosen import chosen
from rftfit.table.numbers import number_of
from rftfit.table.units import ALPHA_TO_N_PER_CM3, folded_name, units_like

_Sheet = tuple[str, list[Line]]
"""Name of a sheet, and its filled rows."""

_UNIT_KEYS = {
    **dict.fromkeys(("beta_deg", "gamma_deg"), "angle_unit"),
    "depth_cm": "depth_unit",
    **dict.fromkeys(("stress_z_N_per_cm2", "stress_x_N_per_cm2"), "stress_unit"),
    **dict.fromkeys(("alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "se_z", "se_x"), "alpha_unit"),
}
"""Column, to the key of `table` in the config that states its unit."""

_ALPHA_Z, _ALPHA_X = "alpha_z_N_per_cm3", "alpha_x_N_per_cm3"

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
"""Columns of numbers of both tables, without the angles."""


@dataclass(frozen=True)
class TablePush:
    """Rows of the table that belong to one run, in their order.

    `columns`: Those of `_NUMBERS` that the table has, shape (n,). With stress also two masks: ``other_sense``, True
    where depth changes opposite to gamma; and ``alone``, True where depth or stress is far from the rows before and
    after. Rows marked by them are to be left out.
    """

    run: Run
    columns: Columns


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
    path_in_raw: str,
    tolerance_deg: float = TOLERANCE_DEG,
) -> TableRead:
    """Read the table of a campaign: a row for each depth or direction; or, for alpha, in blocks as in Table S5.

    `file`: Name of the table for messages. `table`: The section `table` of the config. `media`: Keys of the media of
    the config; empty: those that the table names. `path_in_raw`: Path relative to the raw folder, which the runs have
    in place of logs. `tolerance_deg`: Angles this close to 90 are 90.
    """
    schema = _schema_of(table, file)
    problems: list[Problem] = []
    headers: dict[str, HeaderCell] = {}
    sheets = _read_sheets(path, schema) if table.holds == "alpha" else []
    titles = {key: key for key in media} or _media_of_blocks(sheets)
    drafts = _rows_of_blocks(sheets, schema, table, tuple(titles), problems)
    if drafts is None:  # no blocks: a row for each depth or direction, below one header
        rows, headers, problems = read_table_columns(path, schema, file)
        _add_lines_of_config(problems, schema)
        for column, header in headers.items():
            place, stated_unit = Place(file, column=header.name), header.unit * header.is_stated
            problems += _other_unit(column, header.name, stated_unit, table, place, schema.area)
        for column, name_in_file in table.columns.items() if headers else ():
            if column not in headers or headers[column].name != name_in_file:
                allowed = (
                    f"a column of the file: table.columns of the config gives {column} this name"
                )
                whole_table = DraftRow(schema, 0, problems)
                whole_table.note(name_in_file, "missing-column", name_in_file, allowed)
    else:
        schema = replace(schema, columns=(*schema.columns, RUN_ID))
        rows = TableRows.of(drafts, schema, {})
    media_named = [medium for medium in rows.texts["medium"] if medium not in ("", BAD)]
    titles = titles or {key: key for key in media_named or [key_of(path.stem) or "medium"]}
    checked = _CheckedRows(rows, schema, problems)
    checked.warn_of_no_data()
    checked.check_numbers({header.unit for header in headers.values()}, tolerance_deg)
    checked.number_media(tuple(titles))
    pushes = checked.group_runs(tuple(titles), path_in_raw)
    ids = {push.run.run_id for push in pushes}
    if len(ids) < len(pushes):  # runs of two media have one name
        runs = (replace(push.run, run_id=f"{push.run.medium}_{push.run.run_id}") for push in pushes)
        pushes = [replace(push, run=run) for push, run in zip(pushes, runs, strict=True)]
    problems.sort(key=lambda problem: problem.place.row or 0)
    units = [
        f"{header.name} in {header.unit}" for name, header in headers.items() if name in _UNIT_KEYS
    ]
    pushes = sorted(pushes, key=lambda push: push.run.run_id)
    return TableRead(pushes, problems, titles, ", ".join(units))


def pushes_in(path: Path) -> tuple[pd.DataFrame, list[Problem]]:
    """Read a table of alpha of one medium; return it in the form for `rftfit.estimate_map`, and warnings.

    The frame has a row for each push that is not excluded, with beta_deg, gamma_deg, alpha, its standard errors
    (alpha_z_se_N_per_cm3, alpha_x_se_N_per_cm3) and the other columns of the table. A component may be missing: a
    penetrometer measures only the force along its path, a load cell behind a blade only the drag. Raises CampaignError
    with all problems if there is an error.
    """
    schema = _schema_of(TableSettings(holds="alpha"), str(path))
    rows, headers, problems = read_table_columns(path, schema, str(path))
    if _ALPHA_X in headers:
        # with alpha_x alpha_z may be missing, which the schema of a campaign does not allow
        columns = [replace(c, needed=c.needed and c.name != _ALPHA_Z) for c in schema.columns]
        schema = replace(schema, columns=tuple(columns))
        rows, headers, problems = read_table_columns(path, schema, str(path))
    checked = _CheckedRows(rows, schema, problems)
    checked.check_has_alpha()
    checked.check_numbers({header.unit for header in headers.values()}, TOLERANCE_DEG)
    medium = next((name for name in rows.texts["medium"] if name), "")
    checked.number_media((medium,))
    pushes = checked.group_runs((medium,), "")
    if any(problem.severity == "error" for problem in problems):
        raise CampaignError(problems)
    names = {"se_z": "alpha_z_se_N_per_cm3", "se_x": "alpha_x_se_N_per_cm3"}
    directions = [
        {"beta_deg": push.run.beta_deg, "gamma_deg": push.run.gamma_deg}
        | {names.get(name, name): float(values[0]) for name, values in push.columns.items()}
        for push in pushes
        if not push.run.excluded
    ]
    return pd.DataFrame(directions), problems


def _schema_of(table: TableSettings, file: str) -> Schema:
    """Return the format of a table, with names, units, and numbers that mean no data, as the config states them."""
    schema = STRESS if table.holds == "stress" else ALPHA
    names_in_file = {str(column): (name,) for column, name in table.columns.items()}
    columns = []
    for column in schema.columns:
        unit_key = _UNIT_KEYS.get(column.name)
        unit = str(getattr(table, unit_key)) if unit_key else ""
        names = (*column.also, *names_in_file.get(column.name, ()))
        columns.append(replace(column, also=names, default=unit))
    missing = dict.fromkeys(_NUMBERS, tuple(table.missing))
    return replace(schema, columns=tuple(columns), missing=missing, file=file)


def _add_lines_of_config(problems: list[Problem], schema: Schema) -> None:
    """Add lines of config to the problem of a missing column, if the file has it under a name without a unit.

    With these lines the program can read the column. `problems`: Those of the header; entries are replaced.
    """
    # headers in the file that no column of the schema has
    unread = [
        problem.place.column or ""
        for problem in problems
        if problem.code.endswith(".unknown-column")
    ]
    columns = {column.name: column for column in schema.columns if column.name in _UNIT_KEYS}
    for index, problem in enumerate(problems):
        column = columns.get(problem.place.column or "")
        if not problem.code.endswith(".missing-column") or column is None:
            continue
        header = next((header for header in unread if folded_name(header) in column.stems), None)
        if header is not None:
            key = _UNIT_KEYS[column.name]
            line = f'table: {{columns: {{{column.name}: "{header}"}}, {key}: ...}}'
            allowed = (
                f"{problem.allowed}, or in the config, one of {', '.join(column.units)}: {line}"
            )
            problems[index] = replace(problem, allowed=allowed, nearest=None)


def _other_unit(
    column: str, header: str, stated_unit: str, table: TableSettings, place: Place, area: str
) -> list[Problem]:
    """Return the problem of a header that states another unit than the config, in a list; empty without one.

    `column`, `header`: Name of the column here and in the file. `stated_unit`: Unit in the header; empty: none. `area`:
    First part of the code of the problem.
    """
    key = _UNIT_KEYS.get(column, "")
    # a unit of the config is a contradiction only if the user wrote it, not as a default
    if not stated_unit or key not in table.model_fields_set:
        return []
    unit_in_config = str(getattr(table, key))
    # two spellings of one unit have the factor 1
    if units_like(stated_unit)[unit_in_config] == 1:
        return []
    allowed = f"a column in {unit_in_config}, as {key} of `table` in the config says; set {key}: {stated_unit}, or convert the column and rename it"
    return [Problem(f"{area}.other-unit", place, header, allowed)]


@dataclass
class _CheckedRows:
    """Rows of a table while they are checked: any number of rows with the same fault make one problem.

    Checks add to `problems`, mark bad rows in the column ``bad`` of `rows`, and correct values there.
    """

    rows: TableRows
    schema: Schema
    problems: list[Problem]

    def note(
        self, is_wrong: BoolArray, column: str, code: str, value_found: str | None, allowed: str
    ) -> None:
        """Mark the rows where `is_wrong`, of shape (n,), as bad, and add one problem at the first of them.

        `value_found`: Text with `{}` for the value of the first row; None: no value is shown. `code` (without the area
        of the schema), `allowed`: As in `Problem`.
        """
        columns, wrong = self.rows.columns, np.flatnonzero(is_wrong)
        if not wrong.size:
            return
        columns["bad"] |= is_wrong
        value_found = value_found and value_found.format(columns[column][wrong[0]])
        allowed += f"; this is the first of {wrong.size} rows" if wrong.size > 1 else ""
        self.draft_of(int(wrong[0])).note(column, code, value_found, allowed)

    def draft_of(self, index: int) -> DraftRow:
        """Make a row to which problems of the row with this index can be added; its cells are not in it."""
        return DraftRow(self.schema, int(self.rows.columns["row"][index]), self.problems)

    def warn_of_no_data(self) -> None:
        """Warn of the rows with a number that means no data: they are left out later, and until then it is 0."""
        without_data = np.flatnonzero(self.rows.columns["no_data"])
        if without_data.size:
            allowed = f"values other than those of table.missing in the config; {without_data.size} rows are left out"
            draft = self.draft_of(int(without_data[0]))
            draft.note("depth_cm", "no-data", None, allowed, severity="warning")

    def check_has_alpha(self) -> None:
        """Mark the rows that have neither alpha_z nor alpha_x as bad."""
        columns = self.rows.columns
        alpha = [columns[name] for name in (_ALPHA_Z, _ALPHA_X) if name in columns]
        lacks_alpha = np.isnan(alpha).all(axis=0) & ~columns["bad"]
        allowed = f"this row has no alpha; allowed: a number in {_ALPHA_Z}, {_ALPHA_X} or both"
        self.note(lacks_alpha, _ALPHA_X, "no-alpha", None, allowed)

    def check_numbers(self, units: Collection[str], tolerance_deg: float) -> None:
        """Check angles, depths and the size of alpha; angles close to 90 or -90 deg become 90 or -90.

        `units`: Units of the columns in the file. `tolerance_deg`: What counts as close.
        """
        columns = self.rows.columns
        angles = [columns["beta_deg"], columns["gamma_deg"]]
        largest = max(np.abs(np.nan_to_num(angle)).max(initial=0) for angle in angles)
        if "deg" in units and largest <= _CHOSEN.largest_rad and np.unique(angles).size > 1:
            value_found = f"no angle larger than {largest:g}"
            allowed = "degrees; looks like rad: set angle_unit: rad in `table` of the config"
            whole_table = DraftRow(self.schema, 0, self.problems)
            whole_table.note("gamma_deg", "looks-like-rad", value_found, allowed)
        for name in ("beta_deg", "gamma_deg"):
            angle = columns[name]
            is_upright = same_direction(0.0, np.abs(angle), 0.0, 90.0, tolerance_deg)
            is_beyond = (np.abs(angle) > 90) & ~is_upright
            allowed = "-90 to 90 deg"
            if name == "gamma_deg":
                allowed += "; seen from behind, (beta, gamma) is (-beta, 180 deg - gamma) with the other sign of x"
            elif is_beyond.any():
                allowed += same_angle(float(angle[is_beyond][0]), 180, -90)[1]
            self.note(is_beyond, name, "out-of-range", "{:g}", allowed)
            columns[name] = np.where(is_upright, np.copysign(90, angle), angle)
        if "depth_cm" in columns:
            allowed = "0 or more: depth grows downward from the free surface"
            self.note(columns["depth_cm"] < 0, "depth_cm", "negative-depth", "{:g} cm", allowed)
        alpha = np.abs(columns.get(_ALPHA_Z, np.empty(0)))
        alpha = alpha[np.isfinite(alpha)]
        if alpha.size and np.median(alpha) > _CHOSEN.largest_alpha_N_per_cm3:
            value_found = f"{np.median(alpha):.6g} N/cm^3 in the middle of all rows"
            allowed = (
                "less than a hundred for sand and soil; is it in another unit? Set alpha_unit of `table` in "
                f"the config to one of {', '.join(ALPHA_TO_N_PER_CM3)}"
            )
            whole_table = DraftRow(self.schema, 0, self.problems)
            whole_table.note(_ALPHA_Z, "large-alpha", value_found, allowed, severity="warning")
        if "n" in columns:
            self.note(columns["n"] % 1 > 0, "n", "not-whole", "{:g}", "a whole number of runs")

    def number_media(self, media: tuple[str, ...]) -> None:
        """Replace names of media by their indices in `media`, -1 for a bad one; of a single medium it may be blank."""
        # `indices`: by the code of a name, its index in `media`
        codes, indices = self.rows.columns["medium"], []
        for name, code in self.rows.texts["medium"].items():
            medium = name or (media[0] if len(media) == 1 else "")
            if medium not in (*media, BAD):
                allowed = f"one of {join_words(media)} (media in the config)"
                self.note(codes == code, "medium", "unknown-medium", name or None, allowed)
            indices.append(media.index(medium) if medium in media else -1)
        self.rows.columns["medium"] = np.array(indices, dtype=np.int32)[codes]

    def group_runs(self, media: tuple[str, ...], file: str) -> list[TablePush]:
        """Group the rows into runs: each row of alpha, or the rows of stress with one run_id or one direction.

        Bad rows, and rows without data, are left out; a run without any row with data gets a warning in place of a
        push.
        `file`: Path of the table in the raw folder.
        """
        columns = self.rows.columns
        if columns["bad"].any():
            columns = {name: values[~columns["bad"]] for name, values in columns.items()}
        order, first_rows = _order_by_run(columns, self.rows.texts)
        columns = {name: values[order] for name, values in columns.items()}
        texts_by_code = {
            name: [*codes] for name, codes in self.rows.texts.items() if name != "medium"
        }
        problems: list[Problem] = []
        pushes = []
        for start, stop in pairwise([*first_rows.tolist(), columns["row"].size]):
            all_rows = {name: values[start:stop] for name, values in columns.items()}
            has_data = ~all_rows.pop("no_data")
            columns_of_run = {name: values[has_data] for name, values in all_rows.items()}
            if not has_data.any():
                draft = DraftRow(self.schema, int(all_rows["row"][0]), problems)
                allowed = "one row or more with data in each run; this one is left out"
                draft.note("depth_cm", "run-without-data", None, allowed, severity="warning")
                continue
            first_texts = {
                name: texts[columns_of_run[name][0]] for name, texts in texts_by_code.items()
            }
            draft = DraftRow(self.schema, int(columns_of_run["row"][0]), problems, first_texts)
            push = _make_push(columns_of_run, draft, media[columns_of_run["medium"][0]], file)
            without_data = int(np.count_nonzero(~has_data))
            pushes.append(replace(push, run=replace(push.run, rows_without_data=without_data)))
        # the same problem of several runs is told once
        for code in dict.fromkeys(problem.code for problem in problems):
            first, *others = (problem for problem in problems if problem.code == code)
            more = f"; this is the first of {1 + len(others)} runs" if others else ""
            self.problems.append(replace(first, allowed=first.allowed + more))
        return pushes


def _order_by_run(
    columns: Columns, texts: Mapping[str, Mapping[str, int]]
) -> tuple[IndexArray | slice, IndexArray]:
    """Return an order that puts the rows of a run together, and the index of the first row of each run in this order.

    Rows of one medium and run_id are a run; without a run_id, those of one direction. `columns`, `texts`: As in
    `TableRows`. The order is an index for a column: indices, or a slice of all, which copies nothing.
    """
    as_they_stand, size = slice(None), columns["row"].size
    if "depth_cm" not in columns:  # in a table of alpha each row is a run
        return as_they_stand, np.arange(size)
    # code of the run_id of each row, and the code of a blank one, or -1
    run, unnamed = columns["run_id"], texts["run_id"].get("", -1)
    keys = [columns["medium"], run]
    if unnamed >= 0:
        angles = (columns["beta_deg"], columns["gamma_deg"])
        keys += [np.where(run == unnamed, angle.round(4), 0.0) for angle in angles]
    # the rows of a run mostly stand together, so only the first row of each stretch is compared
    changes = [values[1:] != values[:-1] for values in keys]
    stretches = np.flatnonzero(np.append(size > 0, np.any(changes, axis=0)))
    keys_of_stretch = pd.DataFrame(dict(enumerate(values[stretches] for values in keys)))
    run_of_stretch = keys_of_stretch.groupby([*keys_of_stretch], sort=False).ngroup().to_numpy()
    if np.unique(run_of_stretch).size == run_of_stretch.size:
        return as_they_stand, stretches
    run_of_row = np.repeat(run_of_stretch, np.diff(stretches, append=size))
    order = np.argsort(run_of_row, kind="stable")
    return order, np.flatnonzero(np.diff(run_of_row[order], prepend=-1))


def _make_push(columns_of_run: Columns, draft: DraftRow, medium: str, file: str) -> TablePush:
    """Make a run of its rows, and add its problems.

    `columns_of_run`: Columns of the rows with data. `draft`: First of these rows, with its texts, to which problems are
    added; its number is set to the row of each. `file`: Path of the table in the raw folder, which stands for both
    logs.
    """
    beta, gamma = (float(columns_of_run[f"{angle}_deg"][0]) for angle in ("beta", "gamma"))
    row, texts, depth_of_level_run = draft.row, draft.text, math.nan
    lacks_force_x = False
    # a table of alpha has no run_id: its runs are named by their rows
    stated_name = texts.get("run_id", f"row{row:05d}")
    name = stated_name or _name_of_direction(beta, gamma)
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
            depth_of_level_run = float(depth[0])
        columns["stress_x_N_per_cm2"], lacks_force_x = _stress_x(columns, draft)
        columns["alone"] = _rows_alone(columns)
        kept = np.flatnonzero(~columns["alone"])
        columns["other_sense"] = np.zeros(depth.size, dtype=bool)
        columns["other_sense"][kept], second_start = rows_against_gamma(depth[kept], gamma)
        # from an index among the kept rows to one among all rows of the run
        second_start = second_start and int(kept[second_start])
        if not draft.yes("excluded"):
            rows = columns_of_run | columns
            _note_depths(draft, rows, second_start, name, has_run_id=bool(stated_name))
    direction = "intrusion" if math.isnan(depth_of_level_run) else "horizontal"
    labels: dict[str, Any] = {label: texts[label] for label in LABELS}
    run = Run(
        run_id=name,
        kind="plate",
        medium=medium,
        intruder=UNIT_AREA,
        direction="extraction" if gamma < 0 else direction,
        beta_deg=beta,
        gamma_deg=gamma,
        depth_cm=depth_of_level_run,
        force_log=file,
        motion_log=file,
        row=row,
        excluded=draft.yes("excluded"),
        reason=texts["reason"],
        lacks_force_x=lacks_force_x,
        **labels,
    )
    return TablePush(run, columns)


def _stress_x(columns: Columns, draft: DraftRow) -> tuple[FloatArray, bool]:
    """Return stress along x, N/cm^2, shape (n,), 0 for a run without it, and whether it is such a run.

    Adds a problem to `draft` for a run with it in some rows only.
    """
    stress = columns.get("stress_x_N_per_cm2", np.full(columns["depth_cm"].size, math.nan))
    is_blank = np.isnan(stress)
    if is_blank.any() and not is_blank.all():
        allowed = f"a number in all rows of a run, or in none; {np.count_nonzero(is_blank)} rows are blank"
        draft.note("stress_x_N_per_cm2", "blank", None, allowed)
    # a column of zeros may have been filled in for a channel that was not measured
    return np.nan_to_num(stress), bool(is_blank.any() or not stress.any())


def _rows_alone(columns: Columns) -> BoolArray:
    """Return a mask of the rows whose depth or stress is far from that of the rows before and after, shape (n,).

    Such rows are false readings or typing errors. In a longer push, longer stretches of its stress may be such.
    """
    stress = [columns[f"stress_{c}_N_per_cm2"] for c in "zx"]
    most_rows = max(MOST_LONE_ROWS, int(_CHOSEN.most_away * stress[0].size))
    alone = [find_spikes(columns["depth_cm"], times=_CHOSEN.times_step_of_depth)]
    alone += [find_spikes(values, most_rows, ends_in_push=True) for values in stress]
    return np.asarray(np.any(alone, axis=0))


def _note_depths(
    draft: DraftRow, columns_of_run: Columns, second_start: int, name: str, *, has_run_id: bool
) -> None:
    """Add the problems that the depths of a run show: several pushes in one run, or rows that are left out.

    `second_start`: Index of the row where a second push starts; 0: none. `name`: Name of the run: its run_id if it
    `has_run_id` in the table, else one of its direction.
    """
    depth, other_sense = columns_of_run["depth_cm"], columns_of_run["other_sense"]
    cure = "give each push a run_id of its own"
    if not has_run_id:
        cure = "which column identifies the runs? Its name is run_id, or is given as run_id in table.columns of the config"
    if (alone := np.flatnonzero(columns_of_run["alone"])).size:
        draft.row = int(columns_of_run["row"][alone[0]])
        depth_found = f"{depth[alone[0]]:g} cm"
        allowed = f"depth and stress near those of the rows before and after; {alone.size} rows of the run {name} are left out"
        draft.note("depth_cm", "stands-alone", depth_found, allowed, severity="warning")
    # lengths of the stretches of rows with one depth
    times = np.diff(np.flatnonzero(np.diff(depth, prepend=-1, append=-1)))
    if second_start:
        draft.row = int(columns_of_run["row"][second_start])
        allowed = f"depth that changes one way in the run {name}; here another push starts: {cure}; rows of one push stand in the order of depth"
        draft.note("depth_cm", "starts-again", f"{depth[second_start]:g} cm", allowed)
        return
    if 1 < times[0] <= _CHOSEN.most_repeats and (times == times[0]).all():
        allowed = f"each depth of the run {name} occurs {times[0]} times; if these are so many pushes: {cure}"
        draft.note("depth_cm", "depths-repeated", None, allowed, severity="warning")
    if other_sense.any():
        draft.row = int(columns_of_run["row"][other_sense][0])
        allowed = f"from here on {np.count_nonzero(other_sense)} rows of the run {name} are left out: {OTHER_SENSE}"
        draft.note("depth_cm", "other-sense", None, allowed, severity="warning")


def rows_against_gamma(depth: FloatArray, gamma: float) -> tuple[BoolArray, int]:
    """Return where depth changes opposite to gamma (deg), bool of shape (n,), and the row where a second push starts.

    Row 0: there is none. Depth must grow where gamma > 0 and shrink where gamma < 0: other rows are the way back, or
    another push. A run whose depth changes in one sense only has no wrong row, whatever its gamma, since tables may be
    sorted by depth. `depth`: cm, of a single run, shape (n,).
    """
    is_wrong = np.zeros(depth.size, dtype=bool)
    if gamma == 0:
        # a second push comes back to a depth
        depth_number = number_depths(depth)
        starts = np.flatnonzero(np.diff(depth_number, prepend=-1))
        _, first = np.unique(depth_number[starts], return_index=True)
        returns = np.setdiff1d(np.arange(starts.size), first)
        return is_wrong, int(starts[returns[0]]) if returns.size else 0
    # a *way* leads from one turn to the next; `sign`: of the change of depth on it
    turns, sign = _find_turns(depth, gamma)
    ways_along_gamma = 0
    for start, stop in pairwise([0, *turns, depth.size - 1]) if turns else ():
        is_along_gamma = sign * gamma > 0
        ways_along_gamma += is_along_gamma
        # a second push starts after a jump back within one row, or with a second way in the sense of gamma
        if stop == start + 1:
            return is_wrong, stop
        if is_along_gamma and ways_along_gamma > 1:
            return is_wrong, start
        # the row of a turn belongs to the way before it
        is_wrong[start + (start > 0) : stop + 1] = not is_along_gamma
        sign = -sign
    return is_wrong, 0


def _find_turns(depth: FloatArray, gamma: float) -> tuple[list[int], int]:
    """Return the rows where depth turns by more than noise, the first ones, and the sign of its change at the start.

    Rows of a pause at a turn count to the way against the sense of gamma. `depth`, `gamma`: As in `rows_against_gamma`.
    """
    least = _CHOSEN.least_turn * float(depth.max() - depth.min())
    # rows in which depth is first larger, or smaller, than before by more than noise; 0: never
    grown, shrunk = (
        int(np.argmax(way - np.minimum.accumulate(way) > least)) for way in (depth, -depth)
    )
    first_sign = sign = 1 if grown and (grown < shrunk or not shrunk) else -1
    # from each turn on: the first row that is back by more than noise; the turn is the farthest row before it
    turns = [0]
    while len(turns) <= _CHOSEN.most_turns:
        ahead = sign * depth[turns[-1] :]
        is_back = np.maximum.accumulate(ahead) - ahead > least
        if not is_back.any():
            break
        way = ahead[: int(np.argmax(is_back))]
        farthest = np.flatnonzero(way == way.max())
        turns.append(turns[-1] + int(farthest[0 if sign * gamma > 0 else -1]))
        sign = -sign
    return turns[1:], first_sign


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
    sheets: list[_Sheet],
    schema: Schema,
    table: TableSettings,
    media: tuple[str, ...],
    problems: list[Problem],
) -> list[DraftRow] | None:
    """Return the rows, one for each direction, of a table in blocks; None where the file has no blocks.

    A block has a head that names alpha_z or alpha_x, in its corner or above it; gamma along its first
    row; and beta down its first column. The name of a sheet, or a line with nothing but the key of a medium,
    says of which medium the blocks below are. `media`: Keys of the media. Problems of cells are added to `problems`.
    """
    # key of the medium, beta and gamma, as the table writes them, to the row of this direction
    drafts: dict[tuple[str, float, float], DraftRow] = {}
    columns = {column.name: column for column in schema.columns}
    # factor from the unit of angles in the file
    to_deg = columns["beta_deg"].units[columns["beta_deg"].default]
    for sheet, rows in sheets:
        medium = next((key for key in media if key == key_of(sheet)), "")
        # of the block that a row lies in
        column: TableColumn | None = None  # of its component; None: outside of a block
        scale = 1.0  # factor to N/cm^3
        gammas: dict[int, float] = {}  # by the index of their column; empty before its first row
        width = max((len(cells) for _, cells in rows), default=0)
        component_of_row = _find_components(rows)
        for row, cells in rows:
            texts = [cell.strip() for cell in cells] + [""] * (width - len(cells))
            first_cell, beta = texts[0], _finite_number(texts[0])
            numbers = {i: _finite_number(text) for i, text in enumerate(texts) if i > 0}
            has_numbers = any(number is not None for number in numbers.values())
            if (lone_medium := key_of("".join(texts))) in media:
                medium, column, gammas = lone_medium, None, {}
            elif row in component_of_row:
                column, gammas = columns[f"alpha_{component_of_row[row]}_N_per_cm3"], {}
                unit, place = column.unit_in(first_cell), Place(schema.file, row)
                problems += _other_unit(column.name, first_cell, unit, table, place, schema.area)
                scale = column.units[unit or column.default]
            elif first_cell and beta is None and not has_numbers:
                # a line of words ends a block
                column, gammas = None, {}
            if column and not gammas and beta is None:
                # the first row of the block
                gammas = {i: number for i, number in numbers.items() if number is not None}
                gammas = gammas if len(gammas) > 1 else {}
            elif column and gammas and beta is not None:
                # a further row: alpha at its beta and each gamma
                name = column.name
                for i, gamma in gammas.items():
                    key, cell, alpha = (medium, beta, gamma), texts[i], numbers[i]
                    draft = drafts.setdefault(key, DraftRow(schema, row, problems))
                    if name in draft.number:
                        allowed = f"each direction once; row {draft.row} has it"
                        DraftRow(schema, row, problems).note(name, "twice", cell, allowed)
                    draft.text |= {"medium": medium, "run_id": _name_of_direction(beta, gamma)}
                    draft.number |= {"beta_deg": beta * to_deg, "gamma_deg": gamma * to_deg}
                    if alpha is not None:
                        is_missing = alpha in table.missing
                        draft.no_data |= is_missing
                        draft.number[name] = 0.0 if is_missing else alpha * scale
                    elif cell:
                        allowed = "a number, or nothing where none was measured"
                        draft.note(name, "not-a-number", cell, allowed)
    both = {_ALPHA_Z, _ALPHA_X}
    if not any(both <= {*draft.number} for draft in drafts.values()):
        return None
    # a direction without either was not measured
    measured = [draft for draft in drafts.values() if both & {*draft.number} or draft.bad]
    for draft in measured:
        components = both & {*draft.number}
        for name in both - components - draft.bad if components else ():
            beta, gamma = draft.number["beta_deg"], draft.number["gamma_deg"]
            allowed = f"a number at beta {beta:g}, gamma {gamma:g}, where the block of the other component has one"
            draft.note(name, "one-component", None, allowed)
    return measured


def key_of(name: str) -> str:
    """Return a key for the config, made of the name of a sheet, a file or a medium: letters that a key may have.

    It may be empty, where the name has none of these.
    """
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name.strip()).strip("_.-")[:64]


def _media_of_blocks(sheets: list[_Sheet]) -> dict[str, str]:
    """Return key, to title, of the media in a table of blocks, in its order; empty for a table without blocks."""
    titles: dict[str, str] = {}
    for sheet, rows in sheets:
        if not _find_components(rows):
            continue
        # media are named by lines with a single cell, or by the sheets
        single_cells = [cells[0] for _, cells in rows if sum(map(bool, map(str.strip, cells))) == 1]
        names = [
            cell
            for cell in single_cells
            if not _COMPONENT.fullmatch(cell) and _finite_number(cell) is None
        ]
        if len(sheets) > 1 or not names:
            names = [sheet]
        titles |= {key_of(name): name.strip() for name in names}
    titles.pop("", None)
    return titles


def _find_components(rows: list[Line]) -> dict[int, str]:
    """Return row of the head of each block in a sheet, to the component of the block, x or z.

    Two blocks without heads are z and x, as in the paper, each with the row of its gammas.
    """
    components: dict[int, str] = {}
    # rows of gammas, with nothing in their first cell
    corners: list[int] = []
    for row, (first_cell, *cells) in rows:
        if head := _COMPONENT.fullmatch(first_cell.strip()):
            components[row] = head[1].lower()
        are_numbers = all(_finite_number(cell) is not None for cell in cells if cell.strip())
        if not first_cell.strip() and len(cells) > 1 and are_numbers:
            corners.append(row)
    return components or (dict(zip(corners, "zx", strict=True)) if len(corners) == 2 else {})


def _read_sheets(path: Path, schema: Schema) -> list[_Sheet]:
    """Return name and filled rows of each sheet of a table; empty where it cannot be read."""
    try:
        return list(read_sheets(path, schema))
    except CampaignError:
        return []  # `read_table_columns`, called next, makes the problem


def _finite_number(text: str) -> float | None:
    """Return a cell as a number; None where it is no finite one."""
    number = number_of(text)
    return number if math.isfinite(number) else None
