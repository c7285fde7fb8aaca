"""Used and dropped runs and rows, in numbers and reasons; flags, verdicts on legs and the sum of the checks in words.

The ledger counts the rows of every log by run and fate (used, or dropped for a reason). A flag is a doubt about a run
or a cell of the table of alpha that is used all the same. A verdict is one word on a medium, made of its checks; other
verdicts judge the force model on legs (`VERDICT_WORDS`).

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags`` (doubts on runs).

Flags and reasons are `Remark`: a code with numbers, which becomes a sentence.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rftfit.checks.declared import CHECKS
from rftfit.compare.joint import list_untold
from rftfit.compare.legs import FAR_OFF, NOT_TESTED, OFF, WITHIN, WITHIN_PERCENT, worst_peak
from rftfit.figures.labels import format_interval, in_brackets, name_of, percent
from rftfit.measure.flags import Remark, attach_run, format_remarks, remark
from rftfit.measure.ledger import DROPPED, RowStatus, runs_with_result
from rftfit.measure.sentences import FLAGS
from rftfit.measure.verdict_words import ACCEPTED, DOUBTFUL, FAILED, NOT_CHECKED, PASSED, UNUSABLE
from rftfit.model.maps import NOT_ALIKE
from rftfit.page.cells import records
from rftfit.results import Results

VERDICT_WORDS = {
    WITHIN: f"within {WITHIN_PERCENT:g} %",
    OFF: "off",
    FAR_OFF: "far off",
    NOT_TESTED: "not tested",
}
"""Words for the verdicts on the force model on legs, by the size of the error of the worst peak."""

_ROW_CODES = {status.code for status in RowStatus}
"""Codes of the reasons that concern single rows, not the whole run."""
_EXPECTED_CODES = _ROW_CODES - {RowStatus.SATURATED.code, RowStatus.MOTION_GAP.code}
"""Codes of the reasons for which rows of every good run are dropped, such as rows outside of the stroke."""


@dataclass(frozen=True)
class Outcome:
    """The runs of a campaign with and without a result.

    `used`: Number of runs that gave a result, by medium; runs in air, which serve all media, under ``""``.
    `used_by_kind`: Number of these runs by kind of run.
    `dropped`: Each run without a result: ``run_id, medium, kind``, number of ``rows`` of its logs, ``reasons``, and whether
        the run sheet ``excluded`` it on purpose.
    """

    used: Counter[str]
    used_by_kind: Counter[str]
    dropped: list[dict[str, Any]]

    @property
    def runs_used(self) -> int:
        """Number of runs that gave a result."""
        return sum(self.used.values())

    def count_lost(self, *, excluded: bool) -> int:
        """Count the runs without a result: those that the run sheet excludes if `excluded`, else all others."""
        return sum(run["excluded"] == excluded for run in self.dropped)


def outcome_of_runs(results: Results) -> Outcome:
    """Divide the runs into those with a result (slope, leg curve, tare or speed) and those without, with reasons.

    By the ledger: a run has a result if any of its rows went into one.
    """
    ledger = results.table("ledger.csv")
    good_runs = runs_with_result(ledger)
    outcome = Outcome(Counter(), Counter(), [])
    for run_id, rows in ledger.groupby("run_id", sort=True):
        medium, kind = str(rows["medium"].iloc[0]), str(rows["kind"].iloc[0])
        if run_id in good_runs:
            outcome.used[medium] += 1
            outcome.used_by_kind[kind] += 1
            continue
        lost = rows[rows["fate"] == DROPPED]
        # reasons that every good run has say little: they count only where there is no other
        unusual = lost[~lost["reason_code"].isin(_EXPECTED_CODES)]
        reasons = dict.fromkeys((lost if unusual.empty else unusual)["reason"])
        outcome.dropped.append(
            {
                "run_id": run_id,
                "medium": medium,
                "kind": kind,
                "excluded": bool((lost["reason_code"] == "excluded").any()),
                "rows": rows["rows"].sum(),
                "reasons": "; ".join(reasons) or "no row was used; the ledger gives no reason",
            }
        )
    return outcome


def rows_by_reason(results: Results) -> list[dict[str, Any]]:
    """Add up the rows of all logs by fate and reason; reasons that concern a whole run become one.

    Returns dicts of ``fate, reason, runs, rows`` (numbers of both), in each fate the largest number of rows first. For
    the page: every row of every log is in one of these sums.
    """
    ledger = results.table("ledger.csv")
    is_of_run = (ledger["fate"] == DROPPED) & ~ledger["reason_code"].isin(_ROW_CODES)
    reason = ledger["reason"].mask(is_of_run, "the whole run, or damaged rows")
    # the reason "path" may be followed by a note about the clocks: both become one reason
    is_path = ledger["reason_code"].isin(["path", "path clock-hours"])
    table = ledger.assign(reason=reason.mask(is_path, str(remark("path"))))
    groups = table.groupby(["fate", "reason"])
    sums = groups.agg(runs=("run_id", "nunique"), rows=("rows", "sum")).reset_index()
    return records(sums.sort_values(["fate", "rows"], ascending=[False, False]))


def most_serious_flag(results: Results, medium: str) -> tuple[str, int]:
    """Find the most serious flag of the used runs and cells of one medium, and the number of runs and cells with a flag.

    Returns it in words, empty without a flag, and the number. Flags that all runs share are left out, as the page names
    them once. In a laboratory medium cells without alpha are the most serious.
    """
    medium_results = results[medium]
    flags, alpha = medium_results.flags, medium_results.alpha
    shared = flags.shared(medium_results.fits)
    flags_of_runs = [
        attach_run(run_id, [flag for flag in flags.of_run(run_id) if flag not in shared])
        for run_id in medium_results.runs["run_id"]
    ]
    # flags that no run of the cell has, each as a list of its own
    flags_of_cells = [
        [flag] for cell in alpha.to_dict("records") for flag in flags.of_cell_alone(cell)
    ]
    # one list of flags for each run or cell that has any
    doubts = [*filter(None, flags_of_runs), *flags_of_cells]
    empty_cells = int(alpha["alpha_z_N_per_cm3"].isna().sum())
    if empty_cells and medium_results.settings.role == "laboratory":
        return f"{empty_cells} of {len(alpha)} cells have no alpha", len(doubts) + empty_cells
    if not doubts:
        return "", 0
    return format_remarks(max(doubts, key=_severity)), len(doubts)


def describe_lacking_map(results: Results, medium: str) -> str:
    """Say why a medium with alpha in some direction has no map; empty where it has one, or no alpha at all."""
    reason = results.map_reason(medium)
    if reason and results[medium].alpha["alpha_z_N_per_cm3"].notna().any():
        return f"alpha could not be estimated in directions without a push: {reason}"
    return ""


def describe_other_kind(results: Results, medium: str) -> str:
    """Say how rarely a medium of the known kind lies as far from their shape as this one; empty where that is not rare.

    By ``chance_if_it_belongs`` of the map, a probability, below `NOT_ALIKE`; empty also without a map (NaN).
    """
    chance = results.map_table(medium)["chance_if_it_belongs"].min()
    if not chance < NOT_ALIKE:
        return ""
    # one in so many media, with one significant digit
    media = float(f"{1 / max(chance, 1e-9):.1g}")
    worst = results[medium].map().farthest
    farthest = f"; farthest from their shape is {worst.describe()}" if worst else ""
    return (
        f"only one in {media:,.0f} media of the known kind lies so far from their shape: the medium is "
        "of another kind, or a sign or an angle of the run sheet is wrong; the intervals of its zeta and of directions that "
        f"nobody pushed hold for media of the known kind alone{farthest}"
    )


def verdicts_on_legs(results: Results, medium: str) -> list[tuple[str, str, str]]:
    """Judge the model on the legs of a medium, for each profile that a user would choose.

    Returns tuples of profile, verdict (a key of `VERDICT_WORDS`), and the worst peak in words; one tuple without
    profile where no leg can be judged, with the reason instead of a peak.
    """
    if results[medium].verdict.word == UNUSABLE:
        return [("", NOT_TESTED, "the data are unusable")]
    errors, verdicts = results.table("leg_errors.csv"), []
    for profile in ("map", "generic") if medium in results.sands else ("table", "map"):
        worst = worst_peak(errors, medium, profile)
        if worst:
            # the interval with the model's own error, by which the verdict was made
            ends = format_interval(
                worst["peak_error_model_lo_percent"], worst["peak_error_model_hi_percent"], 0
            )
            ends = f"{ends} %".replace(" ", "\N{NO-BREAK SPACE}") if ends else ""
            peak = f"{name_of(profile)}: {_describe_peak_error(worst)}{in_brackets(ends)}"
            verdicts.append((profile, worst["verdict"], peak))
    reason = "no leg was measured" if results.config.legs else ""
    return verdicts or [("", NOT_TESTED, reason)]


def worst_of_nine_terms(results: Results, medium: str) -> str:
    """Name the worst error of a peak on legs of a medium by the nine terms, which define zeta; empty without such an error.

    It stands beside `verdicts_on_legs`, which judge other profiles: so a reader sees what zeta rests on.
    """
    worst = worst_peak(results.table("leg_errors.csv"), medium, "fourier")
    if not worst or results[medium].verdict.word == UNUSABLE:
        return ""
    return f"{name_of('fourier')} ({results.config.fourier.method}): {_describe_peak_error(worst)}"


def _describe_peak_error(row: Mapping[str, Any]) -> str:
    """Write leg, force (lift or thrust) and error of a peak; `row`: row of ``results/leg_errors.csv``."""
    force = "lift" if row["component"] == "z" else "thrust"
    return f"{name_of(row['leg'])}, {force} {percent(row['peak_error_percent'])}"


def media_that_passed(results: Results) -> dict[str, set[str]]:
    """List, by check, the media that passed it; without checks that failed in any medium.

    The set of media is empty where a check could be made in none.
    """
    return {
        str(check): {*rows.loc[rows["verdict"] == PASSED, "medium"]}
        for check, rows in results.checks.groupby("check", sort=False)
        if rows["verdict"].isin([PASSED, NOT_CHECKED]).all()
    }


def summary_of_checks(results: Results) -> dict[str, Any]:
    """Sum up the checks for the page.

    Returns ``failed``: (medium, title, effect, sentence) of each failed check, and of each doubt that no check reports;
    ``passed``: clauses on what is good in all media; ``passed_partly``, ``unchecked``: sentences; ``untold``: mistakes
    that no check can tell; ``no_scale``: True if the scale of forces could not be checked in a medium.
    """
    table, titles = results.checks, results.campaign.titles
    failed = table[table["verdict"].isin([FAILED, ACCEPTED])]
    passed_in = media_that_passed(results)
    # checks with the same number of passing media and the same unchecked media share one sentence
    # (number of media that passed, titles of the others) to clauses on what is good (`CHECKS[...].good`)
    good_if_passed_partly: dict[tuple[int, str], list[str]] = {}
    for check, checked_media in passed_in.items():
        unchecked_titles = [titles[name] for name in results.media if name not in checked_media]
        if checked_media and unchecked_titles:
            key = len(checked_media), ", ".join(unchecked_titles)
            good_if_passed_partly.setdefault(key, []).append(CHECKS[check].good)
    passed_partly = [
        f"Passed in {count} of {len(results.media)} media, not checked in {media}: {'; '.join(good)}."
        for (count, media), good in sorted(good_if_passed_partly.items(), reverse=True)
    ]
    # the same for checks that no medium allowed or passed, by the media where they were not made; empty for all
    good_if_unchecked: dict[str, list[str]] = {}
    passed_anywhere = [check for check, media in passed_in.items() if media]
    not_checked = table[(table["verdict"] == NOT_CHECKED) & ~table["check"].isin(passed_anywhere)]
    for name, rows in not_checked.groupby("check", sort=False):
        everywhere = len(rows) == len(results.media)
        media = ", ".join(titles[medium] for medium in rows["medium"])
        where = "" if everywhere else f" in {media}"
        good_if_unchecked.setdefault(where, []).append(CHECKS[str(name)].good)
    unchecked = [
        f"Not checked{where}: whether {'; '.join(good)}."
        for where, good in sorted(good_if_unchecked.items())
    ]
    faults = [
        (row["medium"], titles[row["medium"]], row["effect"] or row["verdict"], row["sentence"])
        for row in records(failed)
    ]
    for medium in results:
        word, reason = medium.verdict
        # doubts that no check reports
        if word == DOUBTFUL and medium.name not in {*failed["medium"]}:
            faults.append((medium.name, titles[medium.name], word, format_sentence(reason)))
    return {
        "failed": faults,
        "passed": [
            CHECKS[check].good
            for check, checked_media in passed_in.items()
            if {*results.media} <= checked_media
        ],
        "passed_partly": passed_partly,
        "unchecked": unchecked,
        "untold": list_untold(max(len(results[medium].fits) for medium in results.media)),
        # among checks that were not made, only the one of the scale of forces has a sentence
        "no_scale": ((table["verdict"] == NOT_CHECKED) & (table["sentence"] != "")).any(),
    }


def format_sentence(words: str) -> str:
    """Make words a sentence: with a capital letter and a full stop."""
    return f"{words[0].upper()}{words[1:]}."


def _severity(flags: Iterable[Remark]) -> int:
    """Return the severity of the most serious of some flags, a number; the larger, the more serious."""
    return max(FLAGS[flag.code].severity for flag in flags)
