"""`rftfit diff`: two folders of results compared: which numbers changed, by how much, and because of what.

Names of tables are paths in a folder of results, as ``alpha/poppy_LP.csv``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.errors import InputError
from rftfit.results import Tables
from rftfit.store.digests import sha256_of
from rftfit.store.links import RESULTS
from rftfit.store.text import count, first_of, table
from rftfit.workflow.changed_cells import find_changed_cells, share_of_change
from rftfit.workflow.provenance import Change, changes_between, format_changes, read_provenance
from rftfit.workflow.records import read_record


@dataclass(frozen=True)
class Difference:
    """One number that differs between the first folder (`was`) and the second (`now`).

    `file`: Name of the table. `row`: Cells that name the row, with blanks between. `quantity`: Column. `half_widths`: The
    change over the half width of the number's interval in the first folder, so that 1 is as much as its error; NaN without
    an interval.
    """

    file: str
    row: str
    quantity: str
    was: float
    now: float
    half_widths: float


@dataclass(frozen=True)
class ResultsDiff:
    """Differences between two folders of results. The record of a folder says what its last whole run was made from.

    `numbers`: Numbers that differ: zeta and alpha_z(0, 90 deg) first, then those with an interval, the largest change
    first. `changes`: Changes in logs, runs, settings, code and versions between both records. `alone`: Names of tables and
    columns that only one folder has. `unrecorded`: Paths of tables that are not as the record of their folder says, so that
    it does not tell what they were made from. `since`: By folder, what differed when single jobs were done again after its
    last whole run: of ``code``, ``settings``, ``rows``, ``logs``.
    """

    numbers: list[Difference]
    changes: list[Change]
    alone: list[str]
    unrecorded: list[Path]
    since: dict[Path, list[str]]

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, words and lists, as ``rftfit diff --json`` prints it."""
        return {
            "changed": [vars(difference) for difference in self.numbers],
            "because": [vars(change) for change in self.changes],
            "only_in_one": self.alone,
            "not_as_recorded": self.unrecorded,
            "since_the_record": {str(folder): names for folder, names in self.since.items()},
        }

    def summary(self, most: int | None = None) -> str:
        """Format the differences for people: numbers, then what lacks, then what may be the cause.

        `most`: Most entries of each list; None: all. The records are a sure answer to what the results were made from only
        where all tables are as recorded, and no job was done again since.
        """
        lines = self._describe_numbers(most)
        lines += first_of([f"Only in one of them: {name}" for name in self.alone], most)
        lines += [
            f"Not as recorded (edited, or its run was not finished): {path}"
            for path in self.unrecorded
        ]
        lines += [
            f"Made further after the last whole run of {folder}, with other {', '.join(names)}."
            for folder, names in self.since.items()
        ]
        is_sure = not self.unrecorded and not self.since
        if self.changes or is_sure:
            verdict = "differs in:" if self.changes else "is the same."
            origin = "What" if is_sure else "By their records, what"
            lines.append(f"{origin} they were made from {verdict}")
        else:
            lines.append(
                "What they were made from is not in their records; a whole `rftfit run` writes it."
            )
        lines += first_of([f"  {line}" for line in format_changes(self.changes, most)], most)
        if any(change.sort in ("code", "version") for change in self.changes):
            lines.append(
                "What a version of the program changed, and why, stands in its CHANGELOG.md."
            )
        return "\n".join(lines)

    def _describe_numbers(self, most: int | None) -> list[str]:
        """Format the changed numbers as lines: how many, and a table of them with at most `most` rows; None: all."""
        if not self.numbers:
            return ["No alpha, coefficient, zeta or peak is different."]
        rows = [
            [
                difference.file,
                difference.row,
                difference.quantity,
                f"{difference.was:.6g}",
                f"{difference.now:.6g}",
                f"{difference.half_widths:.2g}" if math.isfinite(difference.half_widths) else "",
            ]
            for difference in self.numbers[:most]
        ]
        files = dict.fromkeys(difference.file for difference in self.numbers)
        lines = [
            f"{count(len(self.numbers), 'number')} changed, in {', '.join(files)}; the largest first:",
            table(["table", "row", "quantity", "A", "B", "half widths"], rows),
        ]
        if (rest := len(self.numbers) - len(rows)) > 0:
            lines.append(f"  and {rest} more (--all lists them)")
        return lines


def compare_folders(first: Path, second: Path) -> ResultsDiff:
    """Compare two folders of results, or of campaigns: `first` before, `second` after.

    First the tables that both have, number by number; then the records of both last whole runs, which say what may be the
    cause; and for each folder whether its tables are those of its record. InputError for a folder without results.
    """
    folders = _find_results(first), _find_results(second)
    # of each folder: by table the columns that name a row
    keys_by_table = [_list_compared_tables(folder) for folder in folders]
    differences: list[Difference] = []
    alone = []
    for name, keys in sorted((keys_by_table[0] | keys_by_table[1]).items()):
        if name in keys_by_table[0] and name in keys_by_table[1]:
            # a folder may be from a version of the program with other columns
            before, after = (Tables(folder).as_written(name) for folder in folders)
            differences += _compare_tables(name, before, after, keys)
            # ^: columns of one of both
            alone += [f"{name}, column {column}" for column in sorted({*before} ^ {*after})]
        else:
            alone.append(name)
    differences.sort(
        # False comes before True
        key=lambda difference: (
            not _is_strength(difference),
            np.isnan(difference.half_widths),
            -_sort_size(difference),
        )
    )
    provenances = [read_provenance(folder) for folder in folders]
    unrecorded = []
    since = {}
    for folder, provenance, tables in zip(folders, provenances, keys_by_table, strict=True):
        jobs = provenance.jobs.values()
        # SHA-256 of each result of the last whole run, by path
        written = {path: digest for job in jobs for path, digest in job["writes"].items()}
        if changed_since := _list_changed_since(folder, provenance.jobs):
            since[folder] = changed_since
        unrecorded += [
            folder / name
            for name in sorted(tables)
            if written.get(f"{RESULTS}/{name}") != sha256_of(folder / name)
        ]
    return ResultsDiff(differences, changes_between(*provenances), alone, unrecorded, since)


def _find_results(folder: Path) -> Path:
    """Return the folder of results: the one in a campaign's folder, or the folder itself; InputError where neither is one."""
    for candidate in (folder / RESULTS, folder):
        if (candidate / "provenance.json").is_file():
            return candidate.resolve()
    raise InputError(f"{folder}: no results of `rftfit run` there (no provenance.json)")


_KEYS = {
    "alpha": ("medium", "beta_deg", "gamma_deg"),
    "alpha_at_depth": ("medium", "beta_deg", "gamma_deg", "depth_cm"),
    "coefficients": ("method", "medium", "coefficient"),
    "penetration": ("method", "medium"),
    "contacts": ("medium", "leg", "component", "lesson", "learned_from"),
    "leg_errors": ("medium", "leg", "profile", "component"),
    "sands": ("medium", "run_id", "window"),
}
"""Columns that name a row, by table that is compared: ``NAME.csv``, or each table in the folder ``NAME``."""


def _list_compared_tables(folder: Path) -> dict[str, tuple[str, ...]]:
    """List the tables of a folder that are compared: by name, the columns that name a row."""
    names = (path.relative_to(folder) for path in folder.rglob("*.csv"))
    # the key in `_KEYS` of a table: its own name, or that of its folder
    stems = {name.as_posix(): name.parts[0].removesuffix(".csv") for name in names}
    return {name: _KEYS[stem] for name, stem in stems.items() if stem in _KEYS}


NOT_SAME = 1e-5
"""Relative change below which two numbers are the same: tables keep six digits."""


def _compare_tables(
    name: str, first: pd.DataFrame, second: pd.DataFrame, keys: tuple[str, ...]
) -> list[Difference]:
    """List the numbers that differ between two tables of one name.

    `name`: That of the table. `first`, `second`: The table in each folder. `keys`: Columns that name a row. A row that one
    table lacks is compared as one of NaN.
    """
    index = [key for key in keys if key in first and key in second]
    # a version of the program may lack some of these columns: then the first of the rows that only they tell apart is compared
    if not index:
        raise InputError(f"{name}: no column {', '.join(keys)} in both folders to compare rows by")
    before, after = (table.drop_duplicates(index).set_index(index) for table in (first, second))
    rows = before.index.union(after.index)
    before, after = before.reindex(rows), after.reindex(rows)
    quantities = [
        quantity
        for quantity in before.columns.intersection(after.columns)
        # columns of integers or floats
        if before[quantity].dtype.kind in "if" and not _is_of_interval(quantity)
    ]
    half_widths, no_interval = _half_widths(before), np.full(len(rows), np.nan)
    differences = []
    # `cell.row` is a place in `rows`, whose entries are the cells of `index`
    for cell in find_changed_cells(before[quantities], after[quantities], NOT_SAME):
        # with one key an entry is the cell itself
        labels = rows[cell.row] if isinstance(rows[cell.row], tuple) else (rows[cell.row],)
        row = " ".join(f"{key:g}" if isinstance(key, float) else str(key) for key in labels)
        half_width = half_widths.get(cell.column, no_interval)[cell.row]
        ratio = abs(cell.now - cell.was) / half_width if half_width > 0 else np.nan
        differences.append(
            Difference(name, row, cell.column, float(cell.was), float(cell.now), ratio)
        )
    return differences


def _is_of_interval(quantity: str) -> bool:
    """Return True for a column of the interval of another: its error, an end, or degrees of freedom.

    The number itself is compared; its interval would be named a second time.
    """
    return not {"se", "lo", "hi", "dof"}.isdisjoint(quantity.split("_"))


def _half_widths(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return by column of a quantity the half widths of its intervals, shape (rows,), in its unit.

    The ends of ``alpha_z_N_per_cm3`` are the columns ``alpha_z_lo_N_per_cm3`` and ``alpha_z_hi_N_per_cm3``.
    """
    half_widths = {}
    for low in table:
        words = str(low).split("_")
        high = "_".join("hi" if word == "lo" else word for word in words)
        if "lo" in words and high in table:
            # coefficients have the columns lo and hi beside their value
            quantity = "_".join(word for word in words if word != "lo") or "value_N_per_cm3"
            half_widths[quantity] = (table[high].to_numpy(float) - table[low].to_numpy(float)) / 2
    if "relative_to_A00" in table:
        # the same interval in units of A00
        unit = table["value_N_per_cm3"].abs() / table["relative_to_A00"]
        half_widths["relative_to_A00"] = half_widths["value_N_per_cm3"] / unit.to_numpy(float)
    return half_widths


def _is_strength(difference: Difference) -> bool:
    """Return True for the strength of a medium: zeta, or alpha_z of a level plate pushed straight down.

    All other numbers of a medium follow a change of it.
    """
    # a row of alpha is named by medium, beta and gamma
    is_flat_push_down = difference.file.startswith("alpha/") and difference.row.endswith(" 0 90")
    return difference.quantity == ("alpha_z_N_per_cm3" if is_flat_push_down else "zeta")


def _sort_size(difference: Difference) -> float:
    """Return the size of a change: in half widths, or relative where there is no interval; inf where a number came or went."""
    if np.isfinite(difference.half_widths):
        return difference.half_widths
    share = share_of_change(difference.was, difference.now)
    return share if np.isfinite(share) else np.inf


def _list_changed_since(folder: Path, jobs: dict[str, Any]) -> list[str]:
    """List what changed between a whole run and later runs of single jobs: of ``code``, ``settings``, ``rows``, ``logs``.

    `jobs`: By name of the job its record, as the whole run wrote it; the job's file in the folder ``records`` is its newest
    record. The state of a record holds a digest of each of these things.
    """
    changed: set[str] = set()
    for name, job in jobs.items():
        newest = read_record(folder / "records" / f"{name}.json")
        state = {} if newest is None else newest.state
        changed |= {what for what, digest in state.items() if job["state"].get(what) != digest}
    return sorted(changed)
