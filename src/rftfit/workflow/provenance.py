"""Provenance, the record of a whole run (what results were made from): written, read, compared.

The last stage of a run writes it as three files below ``results/``: ``provenance.json`` (settings, digests of code, versions,
and the record of each job, which holds the SHA-256 of the files that the job read and wrote), ``manifest.sha256`` (digests
of the logs) and ``run_sheet.csv``. `rftfit verify` and `rftfit diff` compare two of them. A fourth file describes all tables
as a data package, a standard of archives.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any

import pandas as pd

from rftfit.errors import InputError, RftfitError
from rftfit.page.datapackage import ResultFile, package_text
from rftfit.results import Results
from rftfit.store import csv_bytes, read_cells
from rftfit.store.digests import plugin_digest, read_sums, source_digests, sums_text
from rftfit.store.environment import PACKAGE, versions
from rftfit.store.tables import unguarded
from rftfit.workflow.records import Recorded
from rftfit.workflow.state import States, cells_of_run

FORMAT = 3
"""Number of the form of `RECORD`; a file with another one is refused."""
RECORD, SUMS, SHEET = "results/provenance.json", "results/manifest.sha256", "results/run_sheet.csv"
"""Paths of the three files, from the campaign's folder."""


@dataclass(frozen=True)
class Provenance:
    """Everything that results depend on: as it was recorded, or as it is now.

    `logs`: SHA-256 of logs and of the robot's files, by path from the campaign's folder. `rows`: For each run_id the cells
    of its row in the run sheet, by column. `settings`: The configuration, by section. `modules`: Digests of source files, by
    path in the package. `versions`: Versions of Python and packages by name, also of packages whose dialects (readers of a
    log format) are used. `commit`: Commit of the program, empty without one. `jobs`: Records of all jobs by name, each a
    dict with the fields of `rftfit.workflow.records.Record`; empty in a provenance of now, which is of no run.
    """

    logs: dict[str, str]
    rows: dict[str, dict[str, str]]
    settings: dict[str, Any]
    modules: dict[str, str]
    versions: dict[str, str]
    commit: str = ""
    jobs: dict[str, dict[str, Any]] = field(default_factory=dict)


def present_provenance(states: States) -> Provenance:
    """Collect what results of a campaign would depend on if they were made now; `states`: the campaign, read and checked."""
    campaign = states.campaign
    raw = campaign.raw.relative_to(campaign.root).as_posix()
    logs = {f"{raw}/{name}": digest for name, digest in states.all_log_digests.items() if digest}
    runs = sorted(campaign.runs, key=lambda run: run.run_id)
    digests_of_plugins = {origin.module: plugin_digest(origin.module) for origin in states.dialects}
    versions_of_plugins = {origin.package: origin.version for origin in states.dialects}
    return Provenance(
        logs=logs | {name: digest for name, digest in states.robot_digests.items() if digest},
        rows={run.run_id: cells_of_run(run) for run in runs},
        settings=states.config,
        modules=source_digests() | digests_of_plugins,
        versions=versions() | versions_of_plugins,
    )


def commit() -> str:
    """Return the commit of the checkout that holds this program, with ``+`` where files differ from it; empty without one."""
    words = ["git", "-C", str(PACKAGE), "describe", "--always", "--abbrev=12"]
    words += ["--dirty=+", "--exclude=*"]
    with suppress(OSError, subprocess.SubprocessError):
        # no word of this command comes from outside
        return subprocess.check_output(  # noqa: S603
            words, stderr=subprocess.DEVNULL, text=True, timeout=10
        ).strip()
    return ""


def provenance(results: Results, states: States) -> tuple[str, str, pd.DataFrame, str]:
    """Record what every result was made from: the last stage. `results`: Access to all results.

    Returns the contents of four files: the records of all jobs with settings, code and versions, as JSON; the digests
    of logs; the run sheet; the description of all tables as a data package.
    """
    recorded = Recorded(states)
    state = present_provenance(states)
    makers = [recorded.maker[path] for path in sorted(results.allowed) if path in recorded.maker]
    records = {record.name: record for record in makers}
    # what is written here has to be true of results that were made minutes or hours ago
    if changed := dict.fromkeys(
        finding.what for name in records for finding in recorded.findings_of_job(name)
    ):
        raise RftfitError(
            f"while the workflow ran, these changed: {', '.join(changed)}. What the results were made "
            "from cannot be told; run again: what depends on them is made again"
        )
    data = {
        "format": FORMAT,
        "reenacted": results.campaign.reenacted,
        "settings": state.settings,
        "modules": state.modules,
        "versions": state.versions,
        "commit": commit(),
        "jobs": {name: asdict(record) for name, record in sorted(records.items())},
    }
    record_of_run = json.dumps(data, indent=1, sort_keys=True, ensure_ascii=False) + "\n"
    sheet = pd.DataFrame([*state.rows.values()])
    digests = {path: digest for record in makers for path, digest in record.writes.items()}
    package = data_package(results, digests, csv_bytes(sheet))
    return record_of_run, sums_text(state.logs), sheet, package


_PAPER = "https://doi.org/10.1126/science.1229163"


def data_package(results: Results, digests: Mapping[str, str], sheet: bytes) -> str:
    """Describe as a data package, in JSON, the tables that the last job reads and the run sheet that it writes.

    `digests`: SHA-256 of results by path. `sheet`: Content of the file of the run sheet, which is not written yet.
    """

    def describe_table(path: str, digest: str, size: int, header: bytes) -> ResultFile:
        """Describe a csv table; `size`: its bytes; `header`: its first line, which names the columns."""
        (columns,) = read_cells(header)
        return ResultFile(path, digest, size, tuple(columns))

    files = []
    for path in sorted(digests):
        if path in results.allowed and path.endswith(".csv"):
            file = results.root / path
            with file.open("rb") as handle:
                header = handle.readline()
            files.append(describe_table(path, digests[path], file.stat().st_size, header))
    header = sheet.partition(b"\n")[0]
    files.append(describe_table(SHEET, sha256(sheet).hexdigest(), len(sheet), header))
    description = (
        "Force-transducer logs of plates and legs, and the resistive-force model made from them."
    )
    if results.campaign.reenacted:
        description += " The logs were simulated from published results: they are no recordings."
    origin = _PAPER if results.campaign.reenacted else ""
    return package_text(results.config.title, description, files, results.config.publish, origin)


def read_provenance(folder: Path) -> Provenance:
    """Read from a folder of results what they depended on, as the stage `provenance` has recorded it.

    Raises InputError where there is no such record, or it is damaged or of another format.
    """
    path, sums, sheet = (folder / PurePosixPath(name).name for name in (RECORD, SUMS, SHEET))
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["format"] != FORMAT:
            raise InputError(
                f"{RECORD} was written by another version of rftfit (format {data['format']}); "
                "`rftfit run` writes it again"
            )
        header, *table = read_cells(sheet.read_bytes())
        sheet_rows = [dict(zip(header, map(unguarded, texts), strict=True)) for texts in table]
        rows = {row["run_id"]: row for row in sheet_rows}
        settings, modules, versions, jobs = (
            data[name] for name in ("settings", "modules", "versions", "jobs")
        )
        commit = data.get("commit", "")
        return Provenance(read_sums(sums), rows, settings, modules, versions, commit, jobs)
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no record of what the results were made from; a whole `rftfit run` "
            "writes it at its end"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path}: the record, {sums.name} or {sheet.name} beside it is damaged ({type(error).__name__}: {error}); "
            "`rftfit run` makes them again"
        ) from error


# --- what has changed since


@dataclass(frozen=True)
class Change:
    """One thing that results depend on and that differs between two provenances, such as recorded and now.

    `sort`: ``log``, ``run`` (a row of the run sheet), ``setting``, ``code`` or ``version``. `name`: Path of the file, run_id,
    key of the config or name of the package. `was`, `now`: Both values as text: first digits of a digest, cells of the row,
    the setting or version; "not there" where it is absent.
    """

    sort: str
    name: str
    was: str
    now: str

    def __str__(self) -> str:
        what = {"log": "file", "run": "run", "setting": "config key", "code": "code of"}
        return f"{what.get(self.sort, self.sort)} {self.name}: was {self.was}, is {self.now}"


def changes_between(was: Provenance, now: Provenance) -> list[Change]:
    """List what differs between two provenances, in this order: logs, source files, rows of the run sheet, config, versions.

    Each changed file, row, key and package is a `Change`; results of both may still be the same.
    """
    changes = [
        Change(sort, name, _format_digest(old), _format_digest(new))
        for sort, before, after in (("log", was.logs, now.logs), ("code", was.modules, now.modules))
        for name, old, new in _list_different(before, after, "")
    ]
    for name, old, new in _list_different(was.rows, now.rows, None):
        if old is None or new is None:
            presence = ("not there", "there") if old is None else ("there", "not there")
            changes.append(Change("run", name, *presence))
        # of a row the changed cells alone
        elif changed_cells := _list_different(old, new, ""):
            before = ", ".join(f"{column} '{cell}'" for column, cell, _ in changed_cells)
            after = ", ".join(f"{column} '{cell}'" for column, _, cell in changed_cells)
            changes.append(Change("run", name, before, after))
    changes += _list_changed_settings("", was.settings, now.settings)
    versions = _list_different(was.versions, now.versions, "not there")
    return changes + [Change("version", name, old, new) for name, old, new in versions]


def format_changes(changes: Sequence[Change], most: int | None) -> list[str]:
    """Format changes for people, a line each; with a limit, four and more whose names begin alike are one line.

    So an exchanged folder of logs does not hide all else. `most`: Most lines that the caller shows; None: each change has a
    line.
    """
    if most is None:
        return [*map(str, changes)]

    def group_of(change: Change) -> tuple[str, ...]:
        """Return what changes of one line share: sort, name up to the first underscore, old and new value.

        ``raw/a_001.csv`` and ``raw/a_002.csv`` share ``raw/a_*``.
        """
        folder, slash, name = change.name.rpartition("/")
        head, underscore, _ = name.partition("_")
        pattern = f"{folder}{slash}{head}_*" if underscore else change.name
        # digests differ from log to log, which must not part a group
        was, now = (
            "there" if value.startswith("sha256") else value for value in (change.was, change.now)
        )
        return change.sort, pattern, was, "another" if was == now else now

    groups: dict[tuple[str, ...], list[Change]] = {}
    for change in changes:
        groups.setdefault(group_of(change), []).append(change)
    lines: list[str] = []
    for (sort, pattern, was, now), group in groups.items():
        joined = Change(sort, f"{pattern} ({len(group)} of them)", was, now)
        lines += map(str, [joined] if len(group) >= 4 else group)
    return lines


def _list_different(
    was: Mapping[str, Any], now: Mapping[str, Any], absent: Any
) -> list[tuple[str, Any, Any]]:
    """List the keys whose values differ, as (key, old value, new value); `absent` stands for a value that is not there."""
    keys = sorted(was.keys() | now.keys())
    pairs = ((key, was.get(key, absent), now.get(key, absent)) for key in keys)
    return [(key, old, new) for key, old, new in pairs if old != new]


def _format_digest(digest: str) -> str:
    """Format the first digits of a SHA-256; an empty one is of a file that is not there."""
    return f"sha256 {digest[:12]}" if digest else "not there"


def _list_changed_settings(path: str, was: Any, now: Any) -> list[Change]:
    """List the config keys whose values differ, down to single values; `path`: ``section.key`` of both values, empty for all."""
    if isinstance(was, dict) and isinstance(now, dict):
        return [
            change
            for key, old, new in _list_different(was, now, None)
            for change in _list_changed_settings(f"{path}.{key}".lstrip("."), old, new)
        ]
    if was == now:
        return []
    values = (
        f"a section of {len(value)}" if isinstance(value, dict) else value for value in (was, now)
    )
    return [Change("setting", path, *("none" if value is None else str(value) for value in values))]
