"""What ``results/provenance.json`` holds, put together and taken apart again."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError, RftfitError
from rftfit.report.page.provenance import provenance_of
from rftfit.stages.provenance_graph import Graph, unpacked
from rftfit.stages.provenance_state import (
    all_log_names,
    cells,
    digests_of_logs,
    foreign_dialects,
    log_names,
    raw_digest,
    rows_digest,
    settings_digest,
)
from rftfit.store.digest import code_digest, module_digests, workflow_digests
from rftfit.store.formulas import unguarded
from rftfit.store.manifest import read_sums

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from rftfit.campaign.load import Campaign
    from rftfit.store.manifest import Seen

FORMAT = 1
RECORD, SUMS, SHEET = "results/provenance.json", "results/manifest.sha256", "results/run_sheet.csv"


@dataclass(frozen=True)
class State:
    """What results hang on: as it was recorded, or as it is.

    Attributes
    ----------
    logs : dict of str to str
        SHA-256 of each log, and of what else is read, by its path from the campaign's folder;
        without those that are missing.
    rows : dict of str to (dict of str to str)
        Rows of the run sheet by run_id.
    logs_of : dict of str to (list of str)
        Logs by medium; those of runs without a medium under the empty name.
    runs_of : dict of str to (list of str)
        run_id by medium, likewise.
    settings : dict of str to object
        The configuration, every value.
    modules : dict of str to str
        Digest of each module of the program, and of those of packages whose dialects are used.
    rules : dict of str to str
        Digest of each file of the workflow's rules.
    versions : dict of str to str
        Version of the program, of Python, of the libraries and of packages whose dialects are used.
    """

    logs: dict[str, str]
    rows: dict[str, dict[str, str]]
    logs_of: dict[str, list[str]]
    runs_of: dict[str, list[str]]
    settings: dict[str, Any]
    modules: dict[str, str]
    rules: dict[str, str]
    versions: dict[str, str]


@dataclass(frozen=True)
class Record:
    """Results and what they were made from.

    Attributes
    ----------
    state : State
        When they were made.
    graph : Graph
        Which step made which.
    results : dict of str to str
        SHA-256 by path from the campaign's folder.
    """

    state: State
    graph: Graph
    results: dict[str, str]


def present_state(campaign: Campaign, graph: Graph, seen: Seen) -> State:
    """Look at what results hang on now.

    Parameters
    ----------
    campaign : Campaign
    graph : Graph
        Tells which of the program's modules count.
    seen : Seen
        What is known of the logs.

    Returns
    -------
    State
    """
    media = (*campaign.media_with_runs, "")
    raw = campaign.raw.relative_to(campaign.root).as_posix()
    found = digests_of_logs(campaign, all_log_names(campaign), seen)
    others = {
        f"{campaign.root}/{name}": name for step in graph.steps.values() for name in step.files
    }
    logs = {f"{raw}/{name}": digest for name, digest in found.items() if digest}
    logs |= {others[path]: digest for path, digest in seen.digests(others).items() if digest}
    entries = {module for step in graph.steps.values() for module in step.modules}
    runs = {name: campaign.runs_of(name) if name else campaign.unclaimed for name in media}
    versions = dict(provenance_of("", {}).versions)
    for origin in foreign_dialects(campaign.config).values():
        versions[origin.package] = origin.version
    return State(
        logs=logs,
        rows={run.run_id: cells(run) for run in sorted(campaign.runs, key=lambda run: run.run_id)},
        logs_of={name: [f"{raw}/{log}" for log in log_names(campaign, name)] for name in media},
        runs_of={name: [run.run_id for run in of_this] for name, of_this in runs.items()},
        settings=campaign.config.model_dump(mode="json"),
        modules=module_digests(*entries),
        rules=workflow_digests(),
        versions=versions,
    )


def check_still(
    campaign: Campaign, graph: Graph, state: State, *, raw: str, rows: str, settings: str
) -> None:
    """Make sure that nothing has changed since the workflow was planned.

    Parameters
    ----------
    campaign : Campaign
    graph : Graph
        With the digests of the code as planned.
    state : State
        As it is now.
    raw, rows, settings : str
        Digests of all logs, rows and settings as planned.

    Raises
    ------
    RftfitError
        If anything has: nobody could say which results were made from what.
    """
    folder = campaign.raw.relative_to(campaign.root).as_posix()
    logs = {name: state.logs.get(f"{folder}/{name}", "") for name in all_log_names(campaign)}
    changed = {
        "logs": raw != raw_digest((), logs),
        "the run sheet": rows != rows_digest(campaign, ()),
        "the configuration": settings != settings_digest(campaign.config, ()),
        "the program": any(
            step.code != code_digest(*step.modules) for step in graph.steps.values() if step.code
        ),
    }
    if names := [name for name, is_so in changed.items() if is_so]:
        raise RftfitError(
            f"while the workflow ran, {', '.join(names)} changed: what the results were made from "
            "cannot be told. Run again; what is touched is made anew"
        )


def as_json(record: Record) -> str:
    """Write a record as text.

    Parameters
    ----------
    record : Record

    Returns
    -------
    str
        JSON without logs and rows, which stand in files of their own.
    """
    state = record.state
    data = {
        "format": FORMAT,
        "logs": {"sha256": SUMS, "of": state.logs_of},
        "run_sheet": {"copy": SHEET, "of": state.runs_of},
        "settings": state.settings,
        "code": {"modules": state.modules, "rules": state.rules, "versions": state.versions},
        **record.graph.packed(),
        "results": record.results,
    }
    return json.dumps(data, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def read_record(root: Path) -> Record:
    """Read the record of a campaign.

    Parameters
    ----------
    root : Path
        The campaign's folder.

    Returns
    -------
    Record

    Raises
    ------
    InputError
        If there is none, or it is damaged.
    """
    path = root / RECORD
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["format"] != FORMAT:
            raise InputError(
                f"{RECORD} was written by another version of rftfit (format {data['format']}); "
                "`rftfit run` writes it anew"
            )
        state = State(
            logs=read_sums(root / SUMS),
            rows=_read_rows(root / SHEET),
            logs_of=data["logs"]["of"],
            runs_of=data["run_sheet"]["of"],
            settings=data["settings"],
            modules=data["code"]["modules"],
            rules=data["code"]["rules"],
            versions=data["code"]["versions"],
        )
        return Record(state, unpacked(data), data["results"])
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no record of what the results were made from; a whole `rftfit run` "
            "writes it at its end"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path}: the record is damaged ({type(error).__name__}: {error}); delete it and run "
            "`rftfit run`"
        ) from error


def _read_rows(path: Path) -> dict[str, dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as handle:
        rows = [
            {name: unguarded(cell) for name, cell in row.items()} for row in csv.DictReader(handle)
        ]
    return {row["run_id"]: row for row in rows}


def digests_of_results(root: Path, graph: Graph, seen: Seen) -> dict[str, str]:
    """Digest all results there are, but those of the record itself.

    Parameters
    ----------
    root : Path
        The campaign's folder.
    graph : Graph
    seen : Seen

    Returns
    -------
    dict of str to str
        SHA-256 by path from `root`; without those that are missing.
    """
    paths = {f"{root}/{name}": name for name in sorted(graph.makers)}
    found = seen.digests(paths)
    return {name: found[path] for path, name in paths.items() if found[path]}


def sheet_columns(rows: Mapping[str, Mapping[str, str]]) -> dict[str, list[str]]:
    """Turn rows by run into columns.

    Parameters
    ----------
    rows : mapping of str to mapping of str to str

    Returns
    -------
    dict of str to list of str
    """
    names = list(next(iter(rows.values()), {}))
    return {name: [row[name] for row in rows.values()] for name in names}
