"""``rftfit verify``: what results were made from, and whether it is still the same."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.exit_codes import NOT_AS_RECORDED
from rftfit.cli.output import count, say
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.cli.verify_compare import Comparison, Finding
    from rftfit.stages.provenance_record import Record

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
    from rftfit.cli.verify_compare import compare
    from rftfit.stages.provenance_record import (
        RECORD,
        SHEET,
        SUMS,
        digests_of_results,
        present_state,
        read_record,
    )
    from rftfit.store.manifest import Seen

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
