"""Two folders of results beside each other: which numbers changed, by how much, and because of what."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.errors import InputError
from rftfit.outputs.dictionary import describe_file
from rftfit.results import FOLDER, Tables
from rftfit.store.digests import sha256_of
from rftfit.store.text import count, first_of, table
from rftfit.workflow.changed_cells import find_changed_cells, share_of_change
from rftfit.workflow.provenance import Change, changes_between, format_changes, read_provenance
from rftfit.workflow.records import read_record

NOT_SAME = 1e-5
"""Tables keep six digits: a smaller relative change is none."""

_KEYS = {
    "alpha": ("medium", "beta_deg", "gamma_deg"),
    "alpha_at_depth": ("medium", "beta_deg", "gamma_deg", "depth_cm"),
    "coefficients": ("method", "medium", "coefficient"),
    "penetration": ("method", "medium"),
    "contacts": ("medium", "leg", "component", "lesson", "learned_from"),
    "leg_errors": ("medium", "leg", "profile", "component"),
    "sands": ("medium", "run_id", "window"),
}
"""Tables that are compared number by number, and the columns that name a row."""


@dataclass(frozen=True)
class Difference:
    """One number that is different, by so many half widths of the first interval; NaN without one."""

    file: str
    row: str
    quantity: str
    was: float
    now: float
    half_widths: float


@dataclass(frozen=True)
class ResultsDiff:
    """What two folders of results differ in.

    `numbers`: zeta and alpha_z(0, 90 deg) first, then those with an interval, the largest change first.
    `changes`: In logs, runs, settings, code and versions. `alone`: Tables and columns that only one folder has.
    `unrecorded`: Tables that are not as the record of their folder says, so that it does not tell what they were
    made from. `since`: What jobs of a folder were done with that is not as in its record: rows, logs, settings, code.
    """

    numbers: list[Difference]
    changes: list[Change]
    alone: list[str]
    unrecorded: list[Path]
    since: dict[Path, list[str]]

    def as_dict(self) -> dict[str, Any]:
        """Give everything as plain numbers, words and lists, as ``rftfit diff --json`` prints it."""
        return {
            "changed": [vars(difference) for difference in self.numbers],
            "because": [vars(change) for change in self.changes],
            "only_in_one": self.alone,
            "not_as_recorded": self.unrecorded,
            "since_the_record": {str(folder): names for folder, names in self.since.items()},
        }

    def summary(self, most: int | None = None) -> str:
        """Format the differences for people: at most so many of each sort; default: all."""
        lines = self._list_numbers(most)
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
        changes = map(str, self.changes) if most is None else format_changes(self.changes)
        lines += first_of([f"  {change}" for change in changes], most)
        if any(change.sort in ("code", "version") for change in self.changes):
            lines.append(
                "What a version of the program changed, and why, stands in its CHANGELOG.md."
            )
        return "\n".join(lines)

    def _list_numbers(self, most: int | None) -> list[str]:
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
    """Compare two folders of results."""
    first_folder, second_folder = (_folder(folder) for folder in (first, second))
    folders = first_folder, second_folder
    names = [
        {path.relative_to(folder).as_posix() for path in folder.rglob("*.csv")}
        for folder in folders
    ]
    stems = {name: name.partition("/")[0].removesuffix(".csv") for name in names[0] | names[1]}
    compared = {name: _KEYS[stem] for name, stem in stems.items() if stem in _KEYS}
    differences: list[Difference] = []
    alone = []
    for name, keys in sorted(compared.items()):
        if name in names[0] and name in names[1]:
            # one of them may be from a version of the program with other columns
            before, after = (Tables(folder).as_written(name) for folder in folders)
            differences += _differences(name, before, after, keys)
            alone += [f"{name}, column {column}" for column in sorted({*before} ^ {*after})]
        else:
            alone.append(name)
    differences.sort(
        key=lambda difference: (
            not _is_head(difference),
            np.isnan(difference.half_widths),
            -_size(difference),
        )
    )
    records = [read_provenance(folder) for folder in folders]
    unrecorded = []
    since = {}
    for folder, (_, record), names_of_folder in zip(folders, records, names, strict=True):
        jobs = record["jobs"].values()
        written = {path: digest for job in jobs for path, digest in job["writes"].items()}
        if later := _later(folder, record["jobs"]):
            since[folder] = later
        unrecorded += [
            folder / name
            for name in sorted(names_of_folder.intersection(compared))
            if written.get(f"{FOLDER}/{name}") != sha256_of(folder / name)
        ]
    changes = changes_between(*(state for state, _ in records))
    return ResultsDiff(differences, changes, alone, unrecorded, since)


def _later(folder: Path, jobs: dict[str, Any]) -> list[str]:
    """What jobs were done with after the whole run that wrote the record, by their own records."""
    changed: set[str] = set()
    for name, job in jobs.items():
        now = read_record(folder / "records" / f"{name}.json")
        state = {} if now is None else now.state
        changed |= {what for what, digest in state.items() if job["state"].get(what) != digest}
    return sorted(changed)


def _folder(folder: Path) -> Path:
    """The folder of results in a campaign's folder, or itself."""
    for place in (folder / FOLDER, folder):
        if (place / "provenance.json").is_file():
            return place.resolve()
    raise InputError(f"{folder}: no results of `rftfit run` there (no provenance.json)")


def _is_head(difference: Difference) -> bool:
    """Whether a number tells how strong a medium is."""
    penetration = difference.file.startswith("alpha/") and difference.row.endswith(" 0 90")
    return difference.quantity == ("alpha_z_N_per_cm3" if penetration else "zeta")


def _size(difference: Difference) -> float:
    if np.isfinite(difference.half_widths):
        return difference.half_widths
    share = share_of_change(difference.was, difference.now)
    return share if np.isfinite(share) else np.inf


def _differences(
    name: str, first: pd.DataFrame, second: pd.DataFrame, keys: tuple[str, ...]
) -> list[Difference]:
    output = describe_file(f"{FOLDER}/{name}")
    assert output is not None
    index = [key for key in keys if key in first and key in second]
    if not index:
        raise InputError(f"{name}: no column {', '.join(keys)} in both folders to compare rows by")
    before, after = (table.drop_duplicates(index).set_index(index) for table in (first, second))
    rows = before.index.union(after.index)
    before, after = before.reindex(rows), after.reindex(rows)
    quantities = [
        quantity
        for quantity in before.columns.intersection(after.columns)
        if before[quantity].dtype.kind in "if" and not _is_end(quantity)
    ]
    halves, nothing = _half_widths(before), np.full(len(rows), np.nan)
    differences = []
    for cell in find_changed_cells(before[quantities], after[quantities], NOT_SAME):
        labels = rows[cell.row] if isinstance(rows[cell.row], tuple) else (rows[cell.row],)
        words = " ".join(f"{word:g}" if isinstance(word, float) else str(word) for word in labels)
        half = halves.get(cell.column, nothing)[cell.row]
        ratio = abs(cell.now - cell.was) / half if half > 0 else np.nan
        differences.append(
            Difference(name, words, cell.column, float(cell.was), float(cell.now), ratio)
        )
    return differences


def _is_end(quantity: str) -> bool:
    return not {"se", "lo", "hi", "dof"}.isdisjoint(quantity.split("_"))


def _half_widths(table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Half widths of the intervals of a table, shape (rows,), by the quantity."""
    half = {}
    for low in table:
        words = str(low).split("_")
        if "lo" in words:
            place = words.index("lo")
            high = "_".join([*words[:place], "hi", *words[place + 1 :]])
            if high not in table:
                continue
            quantity = "_".join(words[:place] + words[place + 1 :]) or "value_N_per_cm3"
            half[quantity] = (table[high].to_numpy(float) - table[low].to_numpy(float)) / 2
    if "relative_to_A00" in table:
        # the same interval in units of A00
        unit = table["value_N_per_cm3"].abs() / table["relative_to_A00"]
        half["relative_to_A00"] = half["value_N_per_cm3"] / unit.to_numpy(float)
    return half
