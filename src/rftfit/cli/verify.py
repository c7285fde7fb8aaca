"""``rftfit verify``: what results were made from, and whether it is still the same."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.campaign.problems import did_you_mean, join_words
from rftfit.cli import options
from rftfit.cli.exit_codes import NOT_AS_RECORDED
from rftfit.cli.output import json_text, print_line, say_some
from rftfit.cli.run import others_line, shown_jobs
from rftfit.errors import InputError
from rftfit.store.text import count

if TYPE_CHECKING:
    from rftfit.workflow.records import OutdatedResult, Record, Recorded

_MOST = 5


def verify(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RESULT", help="Files or folders below results/; default: all of them."
        ),
    ] = None,
    config: options.CampaignConfig = options.CONFIG,
    all_: Annotated[
        bool, typer.Option("--all", help="List everything, however long the lists are.")
    ] = False,
    again: Annotated[
        bool,
        typer.Option(
            "--again",
            help="Make all results again in a temporary folder and compare them byte by byte; takes as long as a run.",
        ),
    ] = False,
    cores: Annotated[
        int | None, typer.Option(min=1, help="With --again: jobs at once; default: all cores.")
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Tell what results were made from, and whether all of it is still the same.

    Every log and every result is read and its SHA-256 compared with the records of the stages; so are
    the rows of the run sheet, the values of the configuration and the program's own code. Ends with
    exit code 5 when anything differs.

    Whoever changes a result can change its record too: with --again nothing is taken from records.
    """
    from rftfit.results import FOLDER
    from rftfit.workflow.provenance import (
        RECORD,
        changes_between,
        format_changes,
        present_provenance,
        read_provenance,
    )
    from rftfit.workflow.records import Recorded
    from rftfit.workflow.state import read_states

    now = Recorded(read_states(config)[0])
    if again:
        if results:
            raise InputError(
                f"--again: found {results[0]}; allowed: no results, since all of them are made again"
            )
        _make_again(now, cores, None if all_ else _MOST, as_json)
        return
    recorded, data = read_provenance(now.root / FOLDER)
    changes = changes_between(recorded, present_provenance(now.states))
    most = None if all_ else _MOST
    stale = _stale(now)
    recorded_paths = [path for record in now.results().values() for path in record.writes]
    chosen = _chosen(results or [], now.root, recorded_paths)
    paths = chosen or recorded_paths
    differ = [name for name in paths if now.maker[name].name in stale]
    findings = [finding for findings_of_job in stale.values() for finding in findings_of_job]
    if not recorded_paths:
        findings = now.findings_of()
    why = list(dict.fromkeys(map(_text_of, findings)))
    if as_json:
        facts = {name: name not in differ for name in paths}
        answer = {"changed": [str(change) for change in changes], "why": why}
        answer["others"] = now.list_foreign_files()
        print_line(json_text({"as_recorded": facts, **answer, "versions": recorded.versions}))
    else:
        for name in chosen:
            print_line("\n".join(_chain(now, name, stale, most)))
            print_line()
        lines = map(str, changes) if all_ else format_changes(changes)
        say_some([f"Changed: {line}." for line in lines], most, "more changes")
        if findings or differ:
            say_some(why, most, "more")
            print_line(
                f"{len(differ)} of {count(len(paths), 'result')} not as recorded; `rftfit run` makes "
                f"them again. (Recorded in {RECORD} and results/records.)"
            )
        else:
            origin_words = f", made with rftfit {recorded.versions.get('rftfit', '')}"
            origin_words += f" at commit {data['commit']}" if data.get("commit") else ""
            print_line(f"{count(len(paths), 'result')}: all as recorded{origin_words}.")
        for line in others_line(now):
            print_line(line)
    if differ or not recorded_paths:
        raise typer.Exit(NOT_AS_RECORDED)


def _make_again(now: Recorded, cores: int | None, most: int | None, as_json: bool) -> None:
    """Make the results again, and say which of those that are there differ."""
    from rftfit.workflow.remake import remake

    with nullcontext(_quiet) if as_json else shown_jobs(lambda _: None) as on_job:
        remade = remake(now, cores, on_job)
    if as_json:
        facts = {
            "same": remade.same,
            "unlike": {unlike_file.path: unlike_file.difference for unlike_file in remade.unlike},
            "not_made_again": remade.not_made,
            "others": now.list_foreign_files(),
        }
        print_line(json_text(facts))
    else:
        say_some([str(unlike_file) for unlike_file in remade.unlike], most, "more that differ")
        if remade.unlike:
            findings = [
                finding for findings_of_job in _stale(now).values() for finding in findings_of_job
            ]
            say_some(list(dict.fromkeys(map(_text_of, findings))), most, "more reasons")
        count_made = len(remade.same) + len(remade.unlike)
        print_line(
            f"{count(count_made, 'result')} made again: {len(remade.same)} with the same bytes, "
            f"{len(remade.unlike)} otherwise."
        )
        if remade.not_made:
            print_line(
                f"Not made again, since rftfit run does not make them: {join_words([*remade.not_made], _MOST)}."
            )
        for line in others_line(now):
            print_line(line)
    if remade.unlike:
        raise typer.Exit(NOT_AS_RECORDED)


def _quiet(*_: object) -> None:
    """Show nothing of a run."""


def _stale(now: Recorded) -> dict[str, list[OutdatedResult]]:
    """Jobs of the results that are out of date, with what was found about each of them itself."""
    return {name: now.findings(name) for name in now.results() if name in now.outdated}


def _text_of(finding: OutdatedResult) -> str:
    job = finding.job.replace("/", " ")
    match finding.sort:
        case "edited" | "missing":
            fault = "edited or damaged" if finding.sort == "edited" else "not there"
            return f"result {finding.what}: {fault}; was sha256 {finding.was[:12]}"
        case "new":
            return f"{job}: never finished"
        case "input":
            return f"{job}: {finding.what} is another than it was made from"
        case _:
            return f"{job}: made with other {finding.what}"


def _chosen(words: list[Path], root: Path, recorded_paths: list[str]) -> list[str]:
    """Paths from the campaign's folder of the results that are asked for."""
    chosen: dict[str, None] = {}
    for word in words:
        places = [(Path.cwd() / word).resolve(), (root / word).resolve()]
        names = [path.relative_to(root).as_posix() for path in places if path.is_relative_to(root)]
        chosen_paths = [
            path
            for name in names
            for path in recorded_paths
            if path == name or path.startswith(f"{name}/")
        ]
        if not chosen_paths:
            nearest = did_you_mean(word.as_posix(), recorded_paths)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InputError(
                f"{word}: not among the {len(recorded_paths)} results that are recorded, so nobody can say "
                f"what it was made from{hint}"
            )
        chosen |= dict.fromkeys(chosen_paths)
    return list(chosen)


def _chain(
    now: Recorded, name: str, stale: dict[str, list[OutdatedResult]], most: int | None
) -> list[str]:
    """Say what a result was made from, job by job."""
    jobs = now.results(now.maker[name])
    state = "not as recorded" if now.maker[name].name in stale else "as recorded"
    lines = [f"{name}: {state}", f"  sha256 {now.maker[name].writes[name]}", "  made by:"]
    rules: dict[str, list[str]] = {}
    for job in reversed(jobs.values()):
        rules.setdefault(job.rule, []).extend(filter(None, [job.key]))
    lines += [
        f"    {rule}{' of ' + join_words(keys, most) if keys else ''}"
        for rule, keys in rules.items()
    ]
    media = [
        medium for job in jobs.values() if "logs" in job.state if (medium := _medium(now, job))
    ]
    logs = list(dict.fromkeys(log for medium in media for log in now.states.logs(medium)))
    runs = {run.run_id for medium in media for run in now.states.campaign.runs_of(medium)}
    depends = dict.fromkeys(what for job in jobs.values() for what in job.state)
    lines += [
        f"  {count(len(logs), 'log')}: {join_words(logs, most)}",
        f"  {count(len(runs), 'row')} of the run sheet: {join_words(sorted(runs), most)}",
        f"  depends on: {', '.join(depends)}",
    ]
    findings_of_chain = [finding for job in jobs for finding in stale.get(job, [])]
    return lines + [f"  {_text_of(finding)}" for finding in findings_of_chain[:most]]


def _medium(now: Recorded, job: Record) -> str:
    word = now.states.stage(job.rule, job.key)[1]
    return word if word in now.states.campaign.config.media else ""
