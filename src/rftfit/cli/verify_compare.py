"""What has changed since results were made, and which of them hang on it."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.store.digest import closure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rftfit.stages.provenance_graph import Graph, Job
    from rftfit.stages.provenance_record import Record, State

_SHOWN = 8


@dataclass(frozen=True)
class Finding:
    """One thing that is not as recorded.

    Attributes
    ----------
    sort : str
        ``log``, ``row``, ``setting``, ``code`` or ``result``.
    name : str
        Of the log, run, key, module or result.
    was, now : str
        What it was and is, in words.
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

    Attributes
    ----------
    findings : tuple of Finding
    of_result : dict of str to (tuple of Finding)
        What each result that does not match hangs on.
    notes : tuple of str
        What may but need not matter.
    """

    findings: tuple[Finding, ...]
    of_result: dict[str, tuple[Finding, ...]]
    notes: tuple[str, ...]

    def touched(self, finding: Finding) -> list[str]:
        """List the results that hang on something.

        Parameters
        ----------
        finding : Finding

        Returns
        -------
        list of str
        """
        return [name for name, found in self.of_result.items() if finding in found]


def compare(record: Record, now: State, results: Mapping[str, str]) -> Comparison:
    """Compare a record with what is there.

    Parameters
    ----------
    record : Record
    now : State
    results : mapping of str to str
        SHA-256 of the results there are.

    Returns
    -------
    Comparison
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
