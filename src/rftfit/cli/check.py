"""``rftfit check``: everything that is wrong with config and run sheet, or what the campaign holds."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rftfit.campaign.presence import miss_campaign
from rftfit.campaign.problems import in_lines
from rftfit.cli import options
from rftfit.cli.exit_codes import INPUT_NOT_VALID
from rftfit.cli.output import json_text, print_line
from rftfit.store.text import count, megabytes, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.problems import Problem
    from rftfit.checks.verdict import Verdict
    from rftfit.robot.tracks import RobotCheck
    from rftfit.workflow.check import Checked

_KINDS = ("plate", "rod", "leg", "leg_air")


def check(
    config: options.ConfigFile = options.CONFIG,
    strict: Annotated[bool, typer.Option("--strict", help="Count warnings as errors.")] = False,
    diagnose: Annotated[
        bool,
        typer.Option(
            "--diagnose", help="Check, too, whether the numbers of the logs can be believed."
        ),
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Check configuration, run sheet and logs, and the robot's file, sheet and tracks; print every problem at once.

    Every log of up to 20 MB is measured as `rftfit run` measures it. With --diagnose the physical checks of `rftfit run` are made, and what
    fails is told with its likely cause: each counts as a warning. Ends with exit code 2 when there are errors, with 0 when there
    are warnings only.
    """
    if (no_campaign := miss_campaign(config)) is not None:
        # before anything is imported that reads a campaign
        if as_json:
            facts = _facts([no_campaign], 1, 0) | {"plan": []}
            print_line(json_text({"campaign": None} | facts))
        else:
            _print_problems([no_campaign])
            print_line(_total(1, 0))
        raise typer.Exit(INPUT_NOT_VALID)
    from rftfit.measure.verdict_words import FAILED
    from rftfit.workflow.check import check_all

    checked = check_all(config)
    campaign, problems, errors = checked.campaign, checked.problems, checked.errors
    warnings = len(problems) - errors
    checks, verdicts = None, None
    if diagnose and campaign is not None and not errors:
        from rftfit.page.cells import records
        from rftfit.workflow.measure import measure_and_check

        table_of_checks, verdicts = measure_and_check(campaign)
        checks = records(table_of_checks)
    warnings += sum(row["verdict"] == FAILED for row in checks or ())
    if as_json:
        facts = _facts(problems, errors, warnings, checks, verdicts)
        facts["plan"] = [rating._asdict() | {"message": rating.sentence} for rating in checked.plan]
        print_line(json_text({"campaign": campaign and campaign.config.title} | facts))
    else:
        _print(checked, checks, verdicts or {})
        print_line(_total(errors, warnings))
    if campaign is None or errors or (strict and warnings):
        raise typer.Exit(INPUT_NOT_VALID)


def _facts(
    problems: Sequence[Problem],
    errors: int,
    warnings: int,
    checks: list[dict[str, Any]] | None = None,
    verdicts: Mapping[str, Verdict] | None = None,
) -> dict[str, Any]:
    sentences = [asdict(problem) | {"message": str(problem)} for problem in problems]
    return {
        "errors": errors,
        "warnings": warnings,
        "problems": sentences,
        "checks": checks,
        "verdicts": verdicts
        and {medium: verdict._asdict() for medium, verdict in verdicts.items()},
    }


def _total(errors: int, warnings: int) -> str:
    return f"{count(errors, 'error')}, {count(warnings, 'warning')}."


def _print_problems(problems: Sequence[Problem]) -> None:
    for severity in ("error", "warning"):
        chosen = [problem for problem in problems if problem.severity == severity]
        if chosen:
            print_line(f"{count(len(chosen), severity)}:")
            print_line("\n".join(f"  {line}" for line in in_lines(chosen)) + "\n")


def _print(
    checked: Checked, checks: list[dict[str, Any]] | None, verdicts: Mapping[str, Verdict]
) -> None:
    _print_problems(checked.problems)
    if checked.campaign is not None:
        if checks is not None:
            _print_diagnosis(checks, verdicts, checked.campaign)
        print_line(describe_campaign(checked.campaign))
        if checked.robot.medium:
            print_line(of_robot(checked.robot))
        if checked.not_opened:
            print_line(
                f"{count(checked.not_opened, 'run')} with a log of more than 20 MB, not opened"
            )
        print_line()
    if checked.plan:
        print_line("Errors that many runs share, as planned, in beds that differ by 5 %:")
        media: dict[str, list[str]] = {}
        for rating in checked.plan:
            media.setdefault(rating.sentence, []).append(rating.medium)
        print_line(
            "\n".join(f"  {', '.join(names)}: {text}" for text, names in media.items()) + "\n"
        )


def _print_diagnosis(
    rows: list[dict[str, Any]], verdicts: Mapping[str, Verdict], campaign: Campaign
) -> None:
    """Print the physical checks, what to look at where one fails, the verdict on each medium, and what no check can tell."""
    from rftfit.checks.verdict import list_untold
    from rftfit.measure.verdict_words import ACCEPTED, FAILED

    names = ("medium", "check", "verdict", "found")
    print_line(table(list(names), [[str(row[name]) for name in names] for row in rows]))
    print_line()
    failing = [row for row in rows if row["verdict"] in (FAILED, ACCEPTED)]
    for row in failing:
        print_line(f"{row['medium']}, {row['effect'] or row['verdict']}: {row['sentence']}")
    for medium, verdict in verdicts.items():
        print_line(f"{verdict.on(medium)}.")
    plates_of_media = Counter(run.medium for run in campaign.runs if run.kind == "plate")
    most_plates = max(plates_of_media.values(), default=0)
    print_line("\nNo check can tell:")
    print_line("\n".join(f"  {untold}" for untold in list_untold(most_plates)))
    print_line()


def describe_campaign(campaign: Campaign) -> str:
    """Describe a campaign: a heading, and a table of the runs and logs of each medium."""
    rows = []
    sizes: dict[str, int | None] = {}
    for medium in (*campaign.media_with_runs, ""):
        runs = [run for run in campaign.runs if run.medium == medium]
        if not runs:
            continue
        # one file may hold force and motion of a run; two runs never share one
        names = {name for run in runs for name in (run.force_log, run.motion_log)}
        size_of_log = {name: campaign.size_of(name) for name in names}
        sizes_known = [size for size in size_of_log.values() if size is not None]
        sizes |= size_of_log
        counts = [sum(run.kind == kind for run in runs) for kind in _KINDS]
        counts += [
            sum(run.excluded for run in runs),
            len(sizes_known),
            len(size_of_log) - len(sizes_known),
        ]
        rows.append([medium or "(in air)", *map(str, counts), f"{sum(sizes_known) / 1e6:.1f}"])
    header = ["medium", *_KINDS, "excluded", "logs", "missing", "MB"]
    total = sum(filter(None, sizes.values()))
    runs_and_logs = f"{count(len(campaign.runs), 'run')}, {count(len(sizes), 'log')}"
    return f"{campaign.config.title}: {runs_and_logs}, {megabytes(total)}\n{table(header, rows)}"


def of_robot(robot: RobotCheck) -> str:
    """Describe the campaign's robot in one line."""
    trials = robot.trials
    if not trials:
        return f"robot on {robot.medium}: no trials of its own"
    conditions = len({trial.condition for trial in trials})
    return f"robot on {robot.medium}: {count(len(trials), 'trial')} of {count(conditions, 'condition')}"
