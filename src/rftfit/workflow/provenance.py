"""The last stage: what every result was made from, so that `rftfit verify` can tell what has changed."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import rftfit
from rftfit import reference
from rftfit.campaign.load import load_campaign
from rftfit.errors import InputError, RftfitError
from rftfit.page.methods import provenance_of
from rftfit.store import write_csv, write_text
from rftfit.store.digests import (
    Seen,
    code_digest,
    digest_of,
    module_digests,
    read_sums,
    sha256_of,
    workflow_digests,
    write_sums,
)
from rftfit.store.tables import unguarded

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.logs.registry import Origin


# --- What the results of a campaign hang on, as it is now: logs, rows of the run sheet, settings.


OWN_DIALECT = "rig"
"""The one that is read where the config names none."""

# the number of a row, and what nobody computes with
_LEFT_OUT = ("row", "note")


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """List the logs that a medium is measured from.

    `medium`: Empty for the runs that belong to none. Returns relative to the raw folder, sorted;
    some may not exist.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unclaimed
    names = {name for run in runs for name in (run.force_log, run.motion_log)}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    return sorted(names)


def all_log_names(campaign: Campaign) -> list[str]:
    """List all logs that the campaign names.

    Returns relative to the raw folder, sorted.
    """
    media = (*campaign.media_with_runs, "")
    return sorted({name for medium in media for name in log_names(campaign, medium)})


def logs_seen(campaign: Campaign) -> Seen:
    """Return what is remembered of the campaign's logs.

    Returns kept in Snakemake's own folder: state of the workflow, not a result.
    """
    return Seen(campaign.root / ".snakemake" / "rftfit" / "logs_seen.tsv")


def digests_of_logs(campaign: Campaign, names: Iterable[str], seen: Seen) -> dict[str, str]:
    """Digest logs.

    `names`: Relative to the raw folder. `seen`: What is known of them. Returns SHA-256 by name;
    empty where there is no such file.
    """
    paths = {f"{campaign.raw}/{name}": name for name in names}
    return {paths[path]: digest for path, digest in seen.digests(paths).items()}


def foreign_dialects(config: Config) -> dict[str, Origin]:
    """Say which dialects of other packages a campaign's logs are read with.

    Returns by dialect.
    """
    named = {config.dialect, config.force_log.dialect, config.motion_log.dialect} - {
        None,
        OWN_DIALECT,
    }
    if not named:
        return {}
    # slow to import, and most campaigns have the rig's own logs
    from rftfit.logs.registry import origins

    return origins(name for name in named if name is not None)


def raw_digest(media: Sequence[str], digests: Mapping[str, str]) -> str:
    """Digest of the content of some logs.

    `media`: Whose they are. `digests`: SHA-256 by name. Returns 16 hexadecimal digits.
    """
    # with the media, so that no two lists of them share a digest
    return digest_of(list(media), sorted(digests.items()))


def rows_digest(campaign: Campaign, media: Sequence[str]) -> str:
    """Digest of some media's rows of the run sheet; their order and numbers do not count.

    `media`: All rows when none is named. Returns 16 hexadecimal digits.
    """
    runs = [run for medium in media for run in campaign.runs_of(medium)] if media else campaign.runs
    return digest_of(list(media), sorted([*cells(run).values()] for run in runs))


def cells(run: Run) -> dict[str, str]:
    """Return what counts of a row of the run sheet, as text.

    Returns by column; empty where there is nothing.
    """
    values = {
        name: getattr(run, name) for name in run.__dataclass_fields__ if name not in _LEFT_OUT
    }
    return {name: _text(value) for name, value in values.items()}


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)


def settings_digest(config: Config, sections: Sequence[str]) -> str:
    """Digest of sections of the configuration.

    `sections`: All when none is named. Returns 16 hexadecimal digits.
    """
    whole = config.model_dump(mode="json")
    return digest_of({name: whole[name] for name in sections or whole})


# --- Which step makes which result from what: the workflow's own rules, in a form that can be kept.


OWN = "own"
"""Stands for the value of the step's own wildcard."""

Values = str | tuple[str, ...]
Job = tuple[str, str]

WILDCARD = re.compile(r"\{(\w+)[^{}]*\}")
"""A wildcard in braces, with the constraint that Snakemake adds to it."""


@dataclass(frozen=True)
class Step:
    """One rule of the workflow.

    `name`: Of the rule.
    `values`: Of its wildcard, for which it is run; an empty word where it has none.
    `makes`: Files, with the wildcard in braces.
    `reads`: Results that it reads, each with the values that stand for the wildcard in it: `OWN`
        or a list, empty where there is no wildcard.
    `raw`, `rows`: The media whose logs and rows of the run sheet it reads: `OWN` or a list; an
        empty name stands for runs that belong to no medium.
    `settings`: Sections of the configuration.
    `modules`: Whose code, with all they import, it runs.
    `code`: Digest of that code, as the workflow knew it.
    `files`: What else it reads of the campaign: neither results nor logs of runs.
    """

    name: str
    values: tuple[str, ...] = ("",)
    makes: tuple[str, ...] = ()
    reads: tuple[tuple[str, Values], ...] = ()
    raw: Values = ()
    rows: Values = ()
    settings: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    code: str = ""
    files: tuple[str, ...] = ()

    def outputs(self, value: str) -> list[str]:
        """List the files of one job.

        `value`: Of the wildcard.
        """
        return [filled(pattern, value) for pattern in self.makes]

    def inputs(self, value: str) -> list[str]:
        """List the results that one job reads.

        `value`: Of the wildcard.
        """
        found = []
        for pattern, chosen in self.reads:
            values = (value,) if chosen == OWN else chosen or ("",)
            found += [filled(pattern, each) for each in values]
        return found

    def media(self, what: Values, value: str) -> tuple[str, ...]:
        """Name the media whose logs or rows one job reads.

        `what`: `raw` or `rows`. `value`: Of the wildcard.
        """
        return (value,) if isinstance(what, str) else what


@dataclass(frozen=True)
class Graph:
    """All steps that lead to some results.

    `steps`: By name.
    `makers`: Step and wildcard that make a file.
    """

    steps: dict[str, Step]
    makers: dict[str, Job] = field(init=False)

    def __post_init__(self) -> None:
        makers = {
            file: (step.name, value)
            for step in self.steps.values()
            for value in step.values
            for file in step.outputs(value)
        }
        object.__setattr__(self, "makers", makers)

    def parents(self, job: Job) -> list[Job]:
        """Name the jobs whose results a job reads."""
        name, value = job
        files = self.steps[name].inputs(value)
        return list(dict.fromkeys(self.makers[file] for file in files if file in self.makers))

    def chain(self, file: str) -> list[Job]:
        """Name all jobs behind a result, the one that makes it last.

        Returns each after all jobs whose results it reads.
        """
        done: dict[Job, None] = {}
        waiting = [(self.makers[file], False)]
        while waiting:
            job, ready = waiting.pop()
            if ready:
                done.setdefault(job)
            elif job not in done:
                waiting.append((job, True))
                waiting += [(parent, False) for parent in self.parents(job) if parent not in done]
        return list(done)

    def packed(self) -> dict[str, Any]:
        """Return the graph as plain data; lists that occur often are given names.

        Returns ``lists`` and ``steps``; `unpacked` takes it back.
        """
        names: dict[tuple[str, ...], str] = {}

        def short(values: Values) -> str | list[str]:
            if isinstance(values, str) or len(values) < 2:
                return values if isinstance(values, str) else list(values)
            return names.setdefault(values, f"list {len(names) + 1}")

        steps = {
            step.name: {
                "for": short(step.values),
                "makes": list(step.makes),
                "reads": [[pattern, short(values)] for pattern, values in step.reads],
                "raw": short(step.raw),
                "rows": short(step.rows),
                "settings": list(step.settings),
                "modules": list(step.modules),
                "code": step.code,
                "files": list(step.files),
            }
            for step in self.steps.values()
        }
        return {"lists": {name: list(values) for values, name in names.items()}, "steps": steps}


def unpacked(data: Mapping[str, Any]) -> Graph:
    """Take back what `Graph.packed` gave."""
    lists = data["lists"]

    def whole(values: str | list[str]) -> Values:
        if values == OWN:
            return OWN
        return tuple(lists[values] if isinstance(values, str) else values)

    return Graph(
        {
            name: Step(
                name,
                tuple(whole(step["for"])),
                tuple(step["makes"]),
                tuple((pattern, whole(values)) for pattern, values in step["reads"]),
                whole(step["raw"]),
                whole(step["rows"]),
                tuple(step["settings"]),
                tuple(step["modules"]),
                str(step["code"]),
                tuple(step["files"]),
            )
            for name, step in data["steps"].items()
        }
    )


def filled(pattern: str, value: str) -> str:
    """Put a value in the place of the wildcard."""
    return WILDCARD.sub(lambda _: value, pattern)


# --- The steps of the workflow, read off its own rules.


Meaning = Callable[[str, str], tuple[str, ...]]

_DIGESTS = ("raw", "rows", "settings", "code")


def graph_of(
    rules: Iterable[Any], targets: Sequence[str], values: Sequence[str], meaning: Meaning
) -> Graph:
    """Read the steps off the workflow's rules.

    `rules`: Snakemake's; of each ``name``, ``input``, ``output`` and ``params`` are looked at.
    `targets`: Results; what they do not need is left out. `values`: What the wildcard can be.
    `meaning`: Says what a digest among a rule's params is of: called with the param's name
    (``raw``, ``rows``, ``settings``, ``code``) and the digest.
    """
    by_name = {str(rule.name): rule for rule in rules}
    makers: dict[str, tuple[str, str, str]] = {}
    for name, rule in by_name.items():
        for pattern in map(_plain, rule.output):
            for value in values if WILDCARD.search(pattern) else ("",):
                makers.setdefault(filled(pattern, value), (name, value, pattern))
    needed: dict[str, dict[str, None]] = {}
    reads: dict[str, tuple[tuple[str, Values], ...]] = {}
    others: dict[str, tuple[str, ...]] = {}
    waiting = list(targets)
    while waiting:
        name, value, _ = makers.get(waiting.pop(), ("", "", ""))
        if not name or value in needed.setdefault(name, {}):
            continue
        needed[name][value] = None
        if name not in reads:
            reads[name], others[name] = _reads(by_name[name], value, makers)
        waiting += Step(name, reads=reads[name]).inputs(value)
    steps = {}
    for name, rule in by_name.items():
        if name in reads:
            own = tuple(value for value in (*values, "") if value in needed[name])
            given = {key: _given(rule, key, own[0]) for key in _DIGESTS}
            of = {key: meaning(key, digest) if digest else () for key, digest in given.items()}
            raw, rows = (
                OWN if own[0] and of[key] == own[:1] else of[key] for key in ("raw", "rows")
            )
            steps[name] = Step(
                name, own, tuple(map(_plain, rule.output)), reads[name],
                raw, rows, of["settings"], of["code"], given["code"],
                # logs of runs are told by the digest of their content
                () if raw else others[name],
            )  # fmt: skip
    return Graph(steps)


def _reads(
    rule: Any, value: str, makers: Mapping[str, tuple[str, str, str]]
) -> tuple[tuple[tuple[str, Values], ...], tuple[str, ...]]:
    """Results among a rule's input, and what no rule makes."""
    others: dict[str, None] = {}
    found: dict[str, dict[str, None]] = {}
    own: dict[str, None] = {}
    for item in rule.input:
        if callable(item):
            files = item(SimpleNamespace(medium=value))
        elif WILDCARD.search(_plain(item)):
            own.setdefault(_plain(item))
            continue
        else:
            files = [item]
        for file in [files] if isinstance(files, str) else files:
            if str(file) in makers:
                _, chosen, pattern = makers[str(file)]
                found.setdefault(pattern, {}).setdefault(chosen)
            else:
                others.setdefault(str(file))
    lists = [(pattern, tuple(filter(None, chosen))) for pattern, chosen in found.items()]
    return (*((pattern, OWN) for pattern in own), *lists), tuple(sorted(others))


def _given(rule: Any, key: str, value: str) -> str:
    given = dict(rule.params.items()).get(key, "")
    return str(given(SimpleNamespace(medium=value)) if callable(given) else given)


def _plain(pattern: object) -> str:
    """Return a file of a rule without the constraint that Snakemake adds to a wildcard."""
    return WILDCARD.sub(lambda found: f"{{{found[1]}}}", str(pattern))


# --- What ``results/provenance.json`` holds, put together and taken apart again.


FORMAT = 1
RECORD, SUMS, SHEET = "results/provenance.json", "results/manifest.sha256", "results/run_sheet.csv"


@dataclass(frozen=True)
class State:
    """What results hang on: as it was recorded, or as it is.

    `logs`: SHA-256 of each log, and of what else is read, by its path from the campaign's folder;
        without those that are missing.
    `rows`: Rows of the run sheet by run_id.
    `logs_of`: Logs by medium; those of runs without a medium under the empty name.
    `runs_of`: run_id by medium, likewise.
    `settings`: The configuration, every value.
    `modules`: Digest of each module of the program, and of those of packages whose dialects are
        used.
    `rules`: Digest of each file of the workflow's rules.
    `versions`: Version of the program, of Python, of the libraries and of packages whose dialects
        are used.
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

    `state`: When they were made.
    `graph`: Which step made which.
    `results`: SHA-256 by path from the campaign's folder.
    """

    state: State
    graph: Graph
    results: dict[str, str]


def present_state(campaign: Campaign, graph: Graph, seen: Seen) -> State:
    """Look at what results hang on now.

    `graph`: Tells which of the program's modules count. `seen`: What is known of the logs.
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

    `graph`: With the digests of the code as planned. `state`: As it is now. `raw`, `rows`,
    `settings`: Digests of all logs, rows and settings as planned.
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

    Returns JSON without logs and rows, which stand in files of their own.
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

    `root`: The campaign's folder.
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

    `root`: The campaign's folder. Returns SHA-256 by path from `root`; without those that are
    missing.
    """
    paths = {f"{root}/{name}": name for name in sorted(graph.makers)}
    found = seen.digests(paths)
    return {name: found[path] for path, name in paths.items() if found[path]}


def sheet_columns(rows: Mapping[str, Mapping[str, str]]) -> dict[str, list[str]]:
    """Turn rows by run into columns."""
    names = list(next(iter(rows.values()), {}))
    return {name: [row[name] for row in rows.values()] for name in names}


# --- The results as a Research Object Crate: what is here, and which step made it from what.


PROFILE = "https://w3id.org/ro/crate/1.1"
NAME = "ro-crate-metadata.json"
UNKNOWN_DATE = "1970-01-01"

_FOLDER = "results/"
_PAPER = "https://doi.org/10.1126/science.1229163"
_NO_LICENCE = "None is stated: ask those who measured before you use these results elsewhere."
_PROGRAM, _LOGS = "#rftfit", "#logs"
_FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".parquet": "application/vnd.apache.parquet",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".sha256": "text/plain",
    ".svg": "image/svg+xml",
    ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}

Entity = dict[str, Any]


def crate_text(
    config: Config, graph: Graph, files: Mapping[str, tuple[int, str]], sums: str, logs: int
) -> str:
    """Describe the folder of results.

    `config`: For the title, and the date, authors and licence where it gives them. `graph`: Which
    step made which result. `files`: Size in bytes and SHA-256 of each result, by path from the
    campaign's folder. `sums`: The one of them that lists the logs and their SHA-256. `logs`: How
    many logs there are. Returns ``ro-crate-metadata.json``: the same for the same inputs. The date
    is the config's; where it has none a placeholder stands, since the specification demands a
    date, and says so.
    """
    told = config.publication
    description = (
        "Resistive-force model of granular media from transducer and motion logs. provenance.json "
        "says which logs, rows of the run sheet, settings and code each file was made from; "
        "`rftfit verify` checks whether they are still the same."
    )
    if not told.date:
        description += " The date is a placeholder: the campaign's configuration gives none."
    root: Entity = {
        "@id": "./",
        "@type": "Dataset",
        "name": config.title,
        "description": description,
        "datePublished": told.date or UNKNOWN_DATE,
        "hasPart": [_link(path) for path in sorted(files)],
        "mentions": [{"@id": _action(name)} for name in graph.steps],
        "citation": {"@id": _PAPER},
    }
    others: list[Entity] = []
    root["license"] = {"@id": told.license} if told.license else _NO_LICENCE
    if told.license:
        others.append(
            {
                "@id": told.license,
                "@type": "CreativeWork",
                "name": told.license,
                "description": "The licence that the campaign's configuration names.",
            }
        )
    if told.authors:
        ids = [f"#author-{place}" for place in range(1, len(told.authors) + 1)]
        root["author"] = _one_or_many([{"@id": one} for one in ids])
        others += [
            {"@id": one, "@type": "Person", "name": name}
            for one, name in zip(ids, told.authors, strict=True)
        ]
    entities = [
        {
            "@id": NAME,
            "@type": "CreativeWork",
            "conformsTo": {"@id": PROFILE},
            "about": {"@id": "./"},
        },
        root,
        *(_file(path, *files[path], about=path == sums) for path in sorted(files)),
        *(_create(name, graph, files) for name in graph.steps),
        {
            "@id": _PROGRAM,
            "@type": "SoftwareApplication",
            "name": "rftfit",
            "version": rftfit.__version__,
        },
        {
            "@id": _LOGS,
            "@type": "Collection",
            "name": f"{logs} logs as recorded",
            "description": f"In the folder {config.raw} beside this crate, and not part of it; "
            f"their names and SHA-256 are in {sums.removeprefix(_FOLDER)}.",
        },
        {"@id": _PAPER, "@type": "ScholarlyArticle", "name": reference.CITATION},
        *others,
    ]
    # the 1.1 context was made before schema.org had this term
    context = [f"{PROFILE}/context", {"sha256": "http://schema.org/sha256"}]
    data = {"@context": context, "@graph": entities}
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def _identifier(path: str) -> str:
    return quote(path.removeprefix(_FOLDER))


def _link(path: str) -> Entity:
    return {"@id": _identifier(path)}


def _action(step: str) -> str:
    return f"#step-{quote(step)}"


def _one_or_many(entities: list[Entity]) -> Entity | list[Entity]:
    """Return a single entity as itself, as the specification recommends."""
    return entities[0] if len(entities) == 1 else entities


def _file(path: str, size: int, digest: str, *, about: bool) -> Entity:
    kind = PurePosixPath(path).suffix
    entity: Entity = {
        "@id": _identifier(path),
        "@type": "File",
        "name": path.removeprefix(_FOLDER),
        "contentSize": str(size),
        "encodingFormat": _FORMATS.get(kind, "application/octet-stream"),
        "sha256": digest,
    }
    return entity | ({"about": {"@id": _LOGS}} if about else {})


def _create(name: str, graph: Graph, files: Mapping[str, object]) -> Entity:
    step = graph.steps[name]
    made = [path for value in step.values for path in step.outputs(value) if path in files]
    read = dict.fromkeys(path for value in step.values for path in step.inputs(value))
    objects = [_link(path) for path in sorted(read) if path in files]
    if step.raw:
        objects.append({"@id": _LOGS})
    return {
        "@id": _action(name),
        "@type": "CreateAction",
        "name": name,
        "instrument": {"@id": _PROGRAM},
        "object": _one_or_many(objects),
        "result": _one_or_many([_link(path) for path in sorted(made)]),
    }


# --- The last stage: what every result was made from, so that `rftfit verify` can tell what has changed.


def provenance(
    config: Path, steps: str, raw: str, rows: str, settings: str, record: Path, sums: Path,
    sheet: Path, crate: Path,
) -> None:  # fmt: skip
    """Record what every result was made from.

    `steps`: The workflow's steps as JSON (`rftfit.workflow.provenance`). `raw`, `rows`,
    `settings`: Digests of logs, run sheet and settings as the workflow knew them when it was
    planned. `record`: Written: ``provenance.json``. `sums`, `sheet`: Written: SHA-256 of every log
    as ``sha256sum --check`` reads it; the rows of the run sheet as they were understood. `crate`:
    Written: ``ro-crate-metadata.json``.
    """
    import pandas as pd

    campaign = load_campaign(config)
    graph = unpacked(json.loads(steps))
    state = present_state(campaign, graph, logs_seen(campaign))
    check_still(campaign, graph, state, raw=raw, rows=rows, settings=settings)
    write_sums(state.logs, sums)
    write_csv(pd.DataFrame(sheet_columns(state.rows)), sheet)
    results = digests_of_results(campaign.root, graph, Seen(None))
    results |= {name: sha256_of(path) for name, path in ((SUMS, sums), (SHEET, sheet))}
    write_text(record, as_json(Record(state, graph, dict(sorted(results.items())))))
    files = {name: (campaign.root / name, digest) for name, digest in results.items()}
    files |= {SUMS: (sums, results[SUMS]), SHEET: (sheet, results[SHEET]), RECORD: (record, sha256_of(record))}  # fmt: skip
    sizes = {name: (path.stat().st_size, digest) for name, (path, digest) in files.items()}
    write_text(crate, crate_text(campaign.config, graph, sizes, SUMS, len(state.logs)))
