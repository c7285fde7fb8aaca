"""``rftfit verify``: what results were made from, and whether it is still the same."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rftfit.cli.main import NOT_AS_RECORDED
from rftfit.cli.output import count, say
from rftfit.errors import InputError
from rftfit.store.digests import closure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rftfit.workflow.provenance import Graph, Job, Record, State


# --- What has changed since results were made, and which of them hang on it.


_SHOWN = 8


@dataclass(frozen=True)
class Finding:
    """One thing that is not as recorded.

    `sort`: ``log``, ``row``, ``setting``, ``code`` or ``result``.
    `name`: Of the log, run, key, module or result.
    `was`, `now`: What it was and is, in words.
    """

    sort: str
    name: str
    was: str
    now: str

    def __str__(self) -> str:
        what = {"log": "file", "row": "run", "setting": "config key", "code": "code of"}
        return f"{what.get(self.sort, 'result')} {self.name}: was {self.was}, is {self.now}"


@dataclass(frozen=True)
class Comparison:
    """Record and present, side by side.

    `of_result`: What each result that does not match hangs on.
    `notes`: What may but need not matter.
    """

    findings: tuple[Finding, ...]
    of_result: dict[str, tuple[Finding, ...]]
    notes: tuple[str, ...]

    def touched(self, finding: Finding) -> list[str]:
        """List the results that hang on something."""
        return [name for name, found in self.of_result.items() if finding in found]


def compare(record: Record, now: State, results: Mapping[str, str]) -> Comparison:
    """Compare a record with what is there.

    `results`: SHA-256 of the results there are.
    """
    was = record.state
    logs = {name: found for name in _names(was.logs, now.logs) if (found := _log(name, was, now))}
    rows = {name: found for name in _names(was.rows, now.rows) if (found := _row(name, was, now))}
    keys: defaultdict[str, list[Finding]] = defaultdict(list)
    for key, before, after in _leaves("", was.settings, now.settings):
        keys[key.split(".", 1)[0]].append(Finding("setting", key, before, after))
    code = {
        name: Finding("code", name, was.modules.get(name, "not there"), digest)
        for name in _names(was.modules, now.modules)
        if (digest := now.modules.get(name, "not there")) != was.modules.get(name)
    }
    own = {
        name: Finding("result", name, _short(digest), _short(results.get(name, "")))
        for name, digest in record.results.items()
        if results.get(name, "") != digest
    }
    direct: dict[Job, list[Finding]] = {}
    for step in record.graph.steps.values():
        modules = closure(*step.modules) if code else []
        of_step = [code[name] for name in modules if name in code]
        # a module that is there no more is in nobody's imports now
        of_step += [found for name, found in code.items() if name not in now.modules]
        of_step += [found for section in step.settings for found in keys[section]]
        for value in step.values:
            raw, sheet = step.media(step.raw, value), step.media(step.rows, value)
            files = {file for medium in raw for state in (was, now) for file in state.logs_of.get(medium, ())}  # fmt: skip
            runs = {run for medium in sheet for state in (was, now) for run in state.runs_of.get(medium, ())}  # fmt: skip
            direct[step.name, value] = [
                *of_step,
                *(logs[file] for file in step.files if file in logs),
                *(logs[file] for file in sorted(files & logs.keys())),
                *(rows[run] for run in sorted(runs & rows.keys())),
            ]
    behind = _spread(record.graph, direct, own)
    of_result = {}
    for name in record.results:
        maker = record.graph.makers.get(name)
        touching = [own[name]] if name in own else []
        touching += [found for found in (behind[maker] if maker else ()) if found not in touching]
        if touching:
            of_result[name] = tuple(touching)
    used = {finding for found in of_result.values() for finding in found}
    every = [*logs.values(), *rows.values(), *(f for found in keys.values() for f in found), *code.values(), *own.values()]  # fmt: skip
    return Comparison(
        tuple(f for f in every if f in used),
        of_result,
        tuple(_notes(was, now, [f for f in every if f not in used])),
    )


def _spread(
    graph: Graph, direct: Mapping[Job, list[Finding]], own: Mapping[str, Finding]
) -> dict[Job, dict[Finding, None]]:
    """Join the findings of each job with those of all jobs behind it and of the results it reads."""
    behind: dict[Job, dict[Finding, None]] = {}
    for file in graph.makers:
        for job in [] if graph.makers[file] in behind else graph.chain(file):
            if job in behind:
                continue
            name, value = job
            found = dict.fromkeys(direct[job])
            for read in graph.steps[name].inputs(value):
                if read in own:
                    found.setdefault(own[read])
            for parent in graph.parents(job):
                found |= behind[parent]
            behind[job] = found
    return behind


def _names(*groups: Mapping[str, object]) -> list[str]:
    return sorted({name for group in groups for name in group})


def _short(digest: str) -> str:
    return f"sha256 {digest[:12]}" if digest else "not there"


def _log(name: str, was: State, now: State) -> Finding | None:
    before, after = was.logs.get(name, ""), now.logs.get(name, "")
    return None if before == after else Finding("log", name, _short(before), _short(after))


def _row(name: str, was: State, now: State) -> Finding | None:
    before, after = was.rows.get(name), now.rows.get(name)
    if before == after:
        return None
    if before is None or after is None:
        there = ("not there", "there") if before is None else ("there", "not there")
        return Finding("row", name, *there)
    columns = [key for key in _names(before, after) if before.get(key, "") != after.get(key, "")]
    return Finding(
        "row",
        name,
        ", ".join(f"{key} '{before.get(key, '')}'" for key in columns),
        ", ".join(f"{key} '{after.get(key, '')}'" for key in columns),
    )


def _leaves(path: str, was: Any, now: Any) -> Iterator[tuple[str, str, str]]:
    """Keys of the configuration whose values differ."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in _names(was, now):
            here = f"{path}.{key}" if path else key
            yield from _leaves(here, was.get(key), now.get(key))
    elif was != now:
        yield path, _value(was), _value(now)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return f"a section of {len(value)}"
    return "none" if value is None else str(value)


def _notes(was: State, now: State, unused: list[Finding]) -> Iterator[str]:
    if rules := [name for name in _names(was.rules, now.rules) if was.rules.get(name) != now.rules.get(name)]:  # fmt: skip
        yield f"the workflow's rules have changed in {', '.join(rules)}; `rftfit run --dry-run` says whether that matters"
    for name in _names(was.versions, now.versions):
        before, after = was.versions.get(name, "not there"), now.versions.get(name, "not there")
        if before != after:
            yield f"made with {name} {before}; here is {after}"
    for finding in unused[:_SHOWN]:
        yield f"{finding}; no result hangs on it"
    if rest := len(unused) - _SHOWN if len(unused) > _SHOWN else 0:
        yield f"{rest} more changes that no result hangs on"


# --- ``rftfit verify``: what results were made from, and whether it is still the same.


_MOST = 5


def verify(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RESULT]...", help="Files or folders below results/; default: all of them."
        ),
    ] = None,
    config: Annotated[Path, typer.Option(help="The campaign's configuration.")] = Path(
        "config/config.yaml"
    ),
    all_: Annotated[
        bool, typer.Option("--all", help="List everything, however long the lists are.")
    ] = False,
) -> None:
    """Tell what results were made from, and whether all of it is still the same.

    Every log and every result is read and its SHA-256 compared with results/provenance.json; so are
    the rows of the run sheet, the values of the configuration and the program's own code. Ends with
    exit code 5 when anything differs.
    """
    from rftfit.campaign.load import load_campaign
    from rftfit.store.digests import Seen
    from rftfit.workflow.provenance import (
        RECORD,
        SHEET,
        SUMS,
        digests_of_results,
        present_state,
        read_record,
    )

    campaign = load_campaign(config)
    record = read_record(campaign.root)
    fresh = Seen(None)
    now = present_state(campaign, record.graph, fresh)
    found = digests_of_results(campaign.root, record.graph, fresh)
    found |= {
        name: digest
        for name in (SUMS, SHEET)
        if (digest := fresh.digests([f"{campaign.root}/{name}"])[f"{campaign.root}/{name}"])
    }
    comparison = compare(record, now, found)
    most = 10**9 if all_ else _MOST
    chosen = _chosen(results or [], campaign.root, record)
    if chosen:
        for name in chosen:
            say("\n".join(_chain(name, record, comparison, most)))
            say()
    wanted = chosen or list(record.results)
    differ = [name for name in wanted if name in comparison.of_result]
    for line in _summary(wanted, differ, record, comparison, most, whole=not chosen):
        say(line)
    for note in comparison.notes:
        say(f"Note: {note}.")
    if differ:
        say(f"(Recorded in {RECORD}.)")
        raise typer.Exit(NOT_AS_RECORDED)


def _chosen(words: list[Path], root: Path, record: Record) -> list[str]:
    """Paths from the campaign's folder of the results that are asked for."""
    from rftfit.campaign.problems import did_you_mean

    chosen: dict[str, None] = {}
    for word in words:
        places = [Path.cwd() / word, root / word]
        names = [
            path.resolve().relative_to(root).as_posix()
            for path in places
            if path.resolve().is_relative_to(root)
        ]
        found = [
            one
            for name in names
            for one in record.results
            if one == name or one.startswith(f"{name}/")
        ]
        if not found:
            nearest = did_you_mean(word.as_posix(), record.results)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InputError(
                f"{word}: not among the {len(record.results)} results that are recorded, so nobody "
                f"can say what it was made from{hint}"
            )
        chosen |= dict.fromkeys(found)
    return list(chosen)


def _chain(name: str, record: Record, comparison: Comparison, most: int) -> list[str]:
    """Say what a result was made from, step by step."""
    graph, state = record.graph, record.state
    findings = comparison.of_result.get(name, ())
    lines = [f"{name}: {'not as recorded' if findings else 'as recorded'}"]
    lines.append(f"  sha256 {record.results[name]}")
    if name not in graph.makers:
        return [*lines, "  part of the record itself"]
    logs: dict[str, None] = {}
    runs: dict[str, None] = {}
    others: dict[str, None] = {}
    sections: dict[str, None] = {}
    modules: dict[str, None] = {}
    steps: dict[str, list[str]] = {}
    for step_name, value in graph.chain(name):
        step = graph.steps[step_name]
        steps.setdefault(step_name, []).append(value)
        for medium in step.media(step.raw, value):
            logs |= dict.fromkeys(log for log in state.logs_of.get(medium, ()) if log in state.logs)
        for medium in step.media(step.rows, value):
            runs |= dict.fromkeys(state.runs_of.get(medium, ()))
        others |= dict.fromkeys(step.files)
        sections |= dict.fromkeys(step.settings)
        modules |= dict.fromkeys(step.modules)
    lines.append("  steps:")
    for step_name, values in steps.items():
        of = f" of {_listed(values, most)}" if any(values) else ""
        lines.append(f"    {step_name}{of}")
    sheet = state.settings["run_sheet"]
    if others:
        lines.append(f"  {count(len(others), 'other file')}: {_listed(list(others), most)}")
    lines += [
        f"  {count(len(logs), 'log')}: {_listed(list(logs), most)}",
        f"  {count(len(runs), 'row')} of {sheet}: {_listed(list(runs), most)}",
        f"  config sections: {', '.join(sections) or 'none'}",
        f"  code: {', '.join(modules)} and what they import",
    ]
    if findings:
        lines.append("  not as recorded:")
        lines += [f"    {finding}" for finding in findings[:most]]
        if len(findings) > most:
            lines.append(f"    and {len(findings) - most} more (--all lists them)")
    return lines


def _summary(
    wanted: list[str], differ: list[str], record: Record, comparison: Comparison, most: int, *, whole: bool
) -> list[str]:  # fmt: skip
    state = record.state
    made = (
        f"made from {count(len(state.logs), 'file')} as recorded, {count(len(state.rows), 'row')} of "
        f"{state.settings['run_sheet']}, the config and rftfit {state.versions['rftfit']}"
    )
    if not differ:
        return [f"{count(len(wanted), 'result')}{', ' + made if whole else ''}: all as recorded."]
    lines = []
    if whole:
        lines.append(f"{count(len(comparison.findings), 'thing')} not as recorded:")
        for finding in comparison.findings[:most]:
            lines.append(f"  {finding}")
            lines.append(f"    {_touches(comparison, finding, most)}")
        if len(comparison.findings) > most:
            lines.append(f"  and {len(comparison.findings) - most} more (--all lists them)")
    lines.append(
        f"{len(differ)} of {count(len(wanted), 'result')} not as recorded; `rftfit run` makes anew "
        "what is out of date."
    )
    return lines


def _touches(comparison: Comparison, finding: Finding, most: int) -> str:
    names = comparison.touched(finding)
    return f"touches {count(len(names), 'result')}: {_listed(names, most)}"


def _listed(words: list[str], most: int) -> str:
    rest = len(words) - most
    return ", ".join(words[:most]) + (f" and {rest} more" if rest > 0 else "")
