"""``rftfit verify``: what results were made from, and whether it is still the same."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.campaign.problems import did_you_mean, listed
from rftfit.cli import options
from rftfit.cli.main import NOT_AS_RECORDED
from rftfit.cli.output import count, json_text, say
from rftfit.cli.run import others_line
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.workflow.plan import Finding, Plan, Task

_MOST = 5


def verify(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RESULT]...", help="Files or folders below results/; default: all of them."
        ),
    ] = None,
    config: options.ConfigFile = options.CONFIG,
    all_: Annotated[
        bool, typer.Option("--all", help="List everything, however long the lists are.")
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Tell what results were made from, and whether all of it is still the same.

    Every log and every result is read and its SHA-256 compared with the records of the stages; so are
    the rows of the run sheet, the values of the configuration and the program's own code. Ends with
    exit code 5 when anything differs.
    """
    from rftfit.results import FOLDER
    from rftfit.workflow.plan import Plan
    from rftfit.workflow.provenance import RECORD, changes_between, present_state, read_state

    plan = Plan(config, fresh=True)
    recorded, data = read_state(plan.root / FOLDER)
    changes = changes_between(recorded, present_state(plan))
    most = 10**9 if all_ else _MOST
    stale = _stale(plan)
    known = [path for name in plan.default for path in plan.outputs(name)]
    chosen = _chosen(results or [], plan.root, known)
    wanted = chosen or known
    differ = [name for name in wanted if plan.maker[name] in stale]
    why = list(dict.fromkeys(_told(finding) for found in stale.values() for finding in found))
    if as_json:
        facts = {name: name not in differ for name in wanted}
        said = {"changed": [str(one) for one in changes], "why": why}
        said["others"] = plan.others()
        say(json_text({"as_recorded": facts, **said, "versions": recorded.versions}))
    else:
        for name in chosen:
            say("\n".join(_chain(plan, name, stale, most)))
            say()
        _say_some([f"Changed: {change}." for change in changes], most, "more changes")
        if differ:
            _say_some(why, most, "more")
            say(
                f"{len(differ)} of {count(len(wanted), 'result')} not as recorded; `rftfit run` makes "
                f"them again. (Recorded in {RECORD} and results/records.)"
            )
        else:
            made = f", made with rftfit {recorded.versions.get('rftfit', '')}"
            made += f" at commit {data['commit']}" if data.get("commit") else ""
            say(f"{count(len(wanted), 'result')}: all as recorded{made}.")
        for line in others_line(plan):
            say(line)
    if differ:
        raise typer.Exit(NOT_AS_RECORDED)


def _say_some(lines: list[str], most: int, more: str) -> None:
    for line in lines[:most]:
        say(line)
    if len(lines) > most:
        say(f"and {len(lines) - most} {more} (--all lists them)")


def _stale(plan: Plan) -> dict[Task, list[Finding]]:
    """Tasks that are out of date, or read what such a task writes, with what was found about them."""
    stale: dict[Task, list[Finding]] = {}
    touched: set[str] = set()
    for name in plan.default:
        for task in plan.stages[name]:
            found = plan.findings(task)
            if found or touched.intersection(task.reads):
                stale[task] = found
                touched.update(task.writes)
    return stale


def _told(finding: Finding) -> str:
    match finding.sort:
        case "edited" | "missing":
            how = "edited or damaged" if finding.sort == "edited" else "not there"
            return f"result {finding.what}: {how}; was sha256 {finding.was[:12]}"
        case "new":
            return f"{finding.task}: never finished"
        case "input":
            return f"{finding.task}: {finding.what} is another than it was made from"
        case _:
            return f"{finding.task}: made with other {finding.what}"


def _chosen(words: list[Path], root: Path, known: list[str]) -> list[str]:
    """Paths from the campaign's folder of the results that are asked for."""
    chosen: dict[str, None] = {}
    for word in words:
        places = [(Path.cwd() / word).resolve(), (root / word).resolve()]
        names = [path.relative_to(root).as_posix() for path in places if path.is_relative_to(root)]
        found = [
            one for name in names for one in known if one == name or one.startswith(f"{name}/")
        ]
        if not found:
            nearest = did_you_mean(word.as_posix(), known)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InputError(
                f"{word}: not among the {len(known)} results that are recorded, so nobody can say "
                f"what it was made from{hint}"
            )
        chosen |= dict.fromkeys(found)
    return list(chosen)


def _chain(plan: Plan, name: str, stale: dict[Task, list[Finding]], most: int) -> list[str]:
    """Say what a result was made from, stage by stage."""
    tasks: dict[Task, None] = {}
    waiting = [plan.maker[name]]
    while waiting:
        task = waiting.pop()
        if task not in tasks:
            tasks[task] = None
            waiting += [plan.maker[path] for path in task.reads]
    record = plan.records(plan.maker[name].stage).tasks.get(plan.maker[name].key)
    digest = record.writes.get(name, "") if record else ""
    state = "not as recorded" if plan.maker[name] in stale else "as recorded"
    lines = [f"{name}: {state}", f"  sha256 {digest or 'not recorded'}", "  stages:"]
    for stage, of_stage in plan.stages.items():
        if own := [task for task in of_stage if task in tasks]:
            keys = [task.key for task in own if task.key]
            lines.append(f"    {stage}{' of ' + listed(keys, most) if keys else ''}")
    media = dict.fromkeys(task.medium for task in tasks if "logs" in task.depends)
    logs = list(dict.fromkeys(log for medium in media for log in plan.logs(medium)))
    runs = {run.run_id for medium in media if medium for run in plan.campaign.runs_of(medium)}
    depends = dict.fromkeys(what for task in tasks for what in task.depends)
    lines += [
        f"  {count(len(logs), 'log')}: {listed(logs, most)}",
        f"  {count(len(runs), 'row')} of the run sheet: {listed(sorted(runs), most)}",
        f"  depends on: {', '.join(depends)}",
    ]
    found = [finding for task in tasks for finding in stale.get(task, [])]
    return lines + [f"  {_told(finding)}" for finding in found[:most]]
