"""`rftfit check`: a campaign checked before it is run: configuration, run sheet, logs, robot; as text and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.campaign.presence import miss_campaign
from rftfit.campaign.problems import Place, Problem, in_lines
from rftfit.errors import InputError
from rftfit.measure.verdict_words import ACCEPTED, FAILED
from rftfit.store.text import count, table

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.checks.verdict import Verdict
    from rftfit.compare.protocol import PlanPower
    from rftfit.robot.tracks import RobotCheck


@dataclass(frozen=True)
class Diagnosis:
    """Outcome of the physical checks, which ask whether the numbers of the logs can be believed.

    `checks`: Rows of the table of checks, one a medium and check, by column: ``medium``, ``check``, ``verdict``, ``found``,
    ``effect`` (what a failure means for the results), ``sentence`` (what to look at). `verdicts`: By medium. `untold`:
    Mistakes that no check can show, whatever the data are.
    """

    checks: list[dict[str, Any]]
    verdicts: Mapping[str, Verdict]
    untold: list[str]

    def summary(self) -> str:
        """Format the checks, what to look at where a check fails, the verdicts, and what no check can tell."""
        names = ("medium", "check", "verdict", "found")
        rows = [[str(check[name]) for name in names] for check in self.checks]
        verdicts = [f"{verdict.on(medium)}." for medium, verdict in self.verdicts.items()]
        failures = format_failures(self.checks)
        untold = ["No check can tell:", *(f"  {mistake}" for mistake in self.untold)]
        return "\n".join([table(names, rows), "", *failures, *verdicts, "", *untold])


def format_failures(checks: Iterable[Mapping[str, str]]) -> list[str]:
    """Say for each failed check what the failure means and what to look at, also where the config accepts the failure.

    `checks`: Rows as in `Diagnosis.checks`; rows that were read from a csv file serve as well.
    """
    return [
        f"{check['medium']}, {check['effect'] or check['verdict']}: {check['sentence']}"
        for check in checks
        if check.get("verdict") in (FAILED, ACCEPTED)
    ]


_SEVERITIES = ("error", "warning")
"""Values of `Problem.severity`, in the order of the answer."""


@dataclass
class Checked:
    """Answer of `rftfit check`.

    `problems`: Errors and warnings. `campaign`: None where its config or run sheet cannot be used. `robot`: What the check
    of its files found; None where nothing was read. `not_opened`: Number of runs with a log that is too large to be opened
    here. `plan`: For each medium, which errors that many runs share the planned runs could show; empty without plate runs.
    `diagnosis`: Outcome of the physical checks; None where they were not asked for, or an error came before.
    """

    problems: list[Problem]
    campaign: Campaign | None = None
    robot: RobotCheck | None = None
    not_opened: int = 0
    plan: tuple[PlanPower, ...] = ()
    diagnosis: Diagnosis | None = None

    @property
    def errors(self) -> int:
        """Number of the problems that are errors; the others are warnings."""
        return sum(problem.severity == "error" for problem in self.problems)

    @property
    def warnings(self) -> int:
        """Number of the problems that are no errors."""
        return len(self.problems) - self.errors

    @property
    def failed_checks(self) -> int | None:
        """Number of the physical checks that failed; None where they were not done."""
        if self.diagnosis is None:
            return None
        return [check["verdict"] for check in self.diagnosis.checks].count(FAILED)

    def summary(self) -> str:
        """Format the answer for people, in paragraphs: errors, warnings, diagnosis, campaign with robot, plan, totals.

        A paragraph without content is left out.
        """
        paragraphs = [_format_problems(self.problems, severity) for severity in _SEVERITIES]
        if self.diagnosis is not None:
            paragraphs.append(self.diagnosis.summary())
        if self.campaign is not None:
            lines = [self.campaign.summary()]
            if self.robot and self.robot.medium:
                lines.append(self.robot.summary())
            if self.not_opened:
                from rftfit.measure.preview import LARGEST_BYTES

                runs = count(self.not_opened, "run")
                largest_mb = LARGEST_BYTES / 1e6
                lines.append(f"{runs} with a log of more than {largest_mb:g} MB, not opened")
            paragraphs.append("\n".join(lines))
        if self.plan:
            paragraphs.append(_format_plan(self.plan))
        if self.diagnosis is None and not self.errors:
            paragraphs.append(
                "Not checked here: signs, units, exchanged runs (rftfit check --diagnose)."
            )
        totals = [count(self.errors, "error"), count(self.warnings, "warning")]
        if self.failed_checks is not None:
            totals.append(count(self.failed_checks, "failed check"))
        return "\n\n".join([*filter(None, paragraphs), f"{', '.join(totals)}."])

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, words and lists, for ``--json``; null for what was not done."""
        return {
            "campaign": self.campaign and self.campaign.config.title,
            "errors": self.errors,
            "warnings": self.warnings,
            "failed_checks": self.failed_checks,
            "problems": [asdict(problem) | {"message": str(problem)} for problem in self.problems],
            "checks": self.diagnosis and self.diagnosis.checks,
            "verdicts": self.diagnosis
            and {medium: verdict._asdict() for medium, verdict in self.diagnosis.verdicts.items()},
            "untold": self.diagnosis and self.diagnosis.untold,
            "plan": [rating._asdict() | {"message": rating.sentence} for rating in self.plan],
        }


def _format_problems(problems: Sequence[Problem], severity: str) -> str:
    """Format the problems of one severity below their number; empty where there is none."""
    chosen = [problem for problem in problems if problem.severity == severity]
    lines = [f"  {line}" for line in in_lines(chosen)]
    return "\n".join([f"{count(len(chosen), severity)}:", *lines]) if chosen else ""


def _format_plan(plan: Sequence[PlanPower]) -> str:
    """Format what the planned runs can tell, a line for all media with the same rating.

    `plan`: A rating for each medium, whose sentence says which errors that many runs share, such as a turned axis, its runs
    would show.
    """
    from rftfit.measure.errors import USUAL_BED_SPREAD

    media_by_sentence: dict[str, list[str]] = {}
    for rating in plan:
        media_by_sentence.setdefault(rating.sentence, []).append(rating.medium)
    heading = f"Errors that many runs share, as planned, in beds that differ by {100 * USUAL_BED_SPREAD:g} %:"
    lines = [f"  {', '.join(names)}: {sentence}" for sentence, names in media_by_sentence.items()]
    return "\n".join([heading, *lines])


def check_all(config: Path, *, diagnose: bool = False) -> Checked:
    """Check a campaign: config, run sheet and robot; without an error there its logs, too.

    Each step needs the one before: the first with an error is the last. `config`: Path of the config. `diagnose`: True to
    measure the logs as a run does and do the physical checks, where no log has an error.
    """
    if (no_campaign := miss_campaign(config)) is not None:
        # answered before the slow imports below, which read a campaign
        return Checked([no_campaign])
    from rftfit.campaign.load import check_campaign
    from rftfit.measure.preview import measure_for_check
    from rftfit.robot.tracks import check_robot

    campaign, problems = check_campaign(config)
    robot = check_robot(config)
    checked = Checked([*problems, *robot.problems], campaign, robot)
    if campaign is None:
        return checked
    if any(map(campaign.plates_to_measure, campaign.media_with_runs)):
        # the joint model is slow to import
        from rftfit.compare.protocol import rate_plan

        checked.plan = tuple(rate_plan(campaign))
    if checked.errors:
        return checked
    try:
        logs_of_media = measure_for_check(campaign)
    except InputError as error:
        checked.problems.append(Problem("logs.reader", Place(config.name), None, str(error)))
        return checked
    for logs_of_medium in logs_of_media:
        checked.problems += logs_of_medium.problems
        checked.not_opened += logs_of_medium.passed_over
    if not diagnose or checked.errors:
        return checked
    from rftfit.compare.joint import list_untold
    from rftfit.page.cells import records
    from rftfit.workflow.measure import measure_and_check

    checks, verdicts = measure_and_check(campaign)
    plates_of_media = Counter(run.medium for run in campaign.runs if run.kind == "plate")
    untold = list_untold(max(plates_of_media.values(), default=0))
    checked.diagnosis = Diagnosis(records(checks), verdicts, untold)
    return checked
