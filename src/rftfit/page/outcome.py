"""What became of the runs and of the rows of their logs, and what to doubt about those in use."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rftfit.measure.checks import (
    ACCEPTED,
    CHECKS,
    DOUBTFUL,
    FAILED,
    GIVES_BACK,
    NO_SCALE,
    NOT_CHECKED,
    PASSED,
    UNUSABLE,
)
from rftfit.measure.fits import flags_of_all, without
from rftfit.measure.ledger import DROPPED, USED, RowStatus
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.page.cells import records

if TYPE_CHECKING:
    from rftfit.results import Results

SOUND, NOTHING = "sound", "no result"
"""Verdicts on a medium, besides those of the checks."""

USED_AS = {
    "plate": "slope",
    "leg": "leg curve",
    "rod": "tare",
    "leg_air": "tare",
    "robot": "mean speed",
}
"""What rows of each kind of run are used for, as the ledger says it."""

_EXPECTED = {
    why.text
    for why in RowStatus
    if why not in (RowStatus.GOOD, RowStatus.SATURATED, RowStatus.MOTION_GAP)
}
"""Reasons for which rows of every good run are dropped."""

_GRAVEST_FIRST = (
    GIVES_BACK,
    "saturated",
    "motion log begins or ends",
    "lacks",
    "cut in mid-row",
    "gap",
    "time runs backwards",
    "NaN or infinite",
    "duplicated",
    " depths",
    "not linear",
    "different plates",
    "zero drifted",
)
"""Parts of the flags that stages write."""


@dataclass(frozen=True)
class Outcome:
    """What became of the runs of a campaign.

    `used`: Number of runs that gave a result, by medium; those in air, which serve all, under ``""``.
    `dropped`: The others: ``run_id, medium, kind, rows`` of its logs, and all ``reasons``.
    """

    used: Counter[str]
    dropped: list[dict[str, Any]]

    @property
    def runs_used(self) -> int:
        """Number of runs that gave a result."""
        return sum(self.used.values())


def outcome_of_runs(results: Results) -> Outcome:
    """Tell runs that gave a slope, a leg curve, a tare or a speed from those that gave nothing."""
    ledger = results.table("ledger.csv")
    wanted = ledger["reason"] == ledger["kind"].map(USED_AS)
    good = set(ledger.loc[(ledger["fate"] == USED) & wanted & (ledger["rows"] > 0), "run_id"])
    outcome = Outcome(Counter(), [])
    for run_id, rows in ledger.groupby("run_id", sort=True):
        medium, kind = str(rows["medium"].iloc[0]), str(rows["kind"].iloc[0])
        if run_id in good:
            outcome.used[medium] += 1
            continue
        reasons = list(dict.fromkeys(rows.loc[rows["fate"] == DROPPED, "reason"]))
        special = [reason for reason in reasons if reason not in _EXPECTED]
        why = "; ".join(special or reasons) or "no row was used; the ledger gives no reason"
        outcome.dropped.append(
            {
                "run_id": run_id,
                "medium": medium,
                "kind": kind,
                "rows": rows["rows"].sum(),
                "reasons": why,
            }
        )
    return outcome


def rows_by_reason(results: Results) -> list[dict[str, Any]]:
    """Add up the rows of all logs by fate and reason; reasons that name one run are put together.

    Returns ``fate, reason, runs, rows``, the largest number of rows first within each fate.
    """
    ledger = results.table("ledger.csv")
    special = (ledger["fate"] == DROPPED) & ~ledger["reason"].isin([why.text for why in RowStatus])
    # a note about the clocks may follow what the rows were used for
    reason = ledger["reason"].str.split(";").str[0].mask(special, "the whole run, or damaged rows")
    table = ledger.assign(reason=reason).groupby(["fate", "reason"])
    sums = table.agg(runs=("run_id", "nunique"), rows=("rows", "sum")).reset_index()
    return records(sums.sort_values(["fate", "rows"], ascending=[False, False]))


def gravest_doubt(results: Results, medium: str) -> tuple[str, int]:
    """Find the gravest doubt about what is in use of one medium, and count runs and cells with one."""
    own = results[medium]
    told = flags_of_all(own.fits)
    doubts = [
        (str(run), f"{run}: {rest}")
        for table in (own.runs, own.fits)
        for run, flags in zip(table["run_id"], table["flags"], strict=True)
        if (rest := without(flags, told))
    ]
    # flags of a cell that name a run are told of the run already
    runs = set(own.fits["run_id"])
    of_cells = (flag for flags in own.alpha["flags"] for flag in without(flags, told).split("; "))
    doubts += [(flag, flag) for flag in of_cells if flag and flag.partition(": ")[0] not in runs]
    empty = int(own.alpha["alpha_z_N_per_cm3"].isna().sum())
    if empty and own.settings.role == "laboratory":
        return f"{empty} of {len(own.alpha)} cells have no alpha", len(doubts) + empty
    if not doubts:
        return "", 0
    return min((flag for _, flag in doubts), key=_rank), len({who for who, _ in doubts})


def verdict_of(results: Results, medium: str) -> tuple[str, str]:
    """Verdict on a medium in one word, and why."""
    table = results.checks
    rows = table[(table["medium"] == medium) & table["verdict"].isin([FAILED, ACCEPTED])]
    failed = ", ".join(rows["check"])
    for word in (UNUSABLE, DOUBTFUL):
        if (rows["effect"] == word).any():
            return word, f"fails {failed}"
    if len(rows):
        return DOUBTFUL, f"fails {failed}, which the config accepts"
    if not results[medium].alpha["alpha_z_N_per_cm3"].notna().any():
        return NOTHING, "no run gave a slope"
    if NO_TARE_FLAG in flags_of_all(results[medium].fits):
        return DOUBTFUL, NO_TARE_FLAG
    return SOUND, ""


def believed(results: Results) -> dict[str, Any]:
    """What the checks come to: failed ones by medium, what all media passed, what was not checked."""
    table, titles = results.checks, results.campaign.titles
    failed = table[table["verdict"].isin([FAILED, ACCEPTED])]
    good = table[(table["verdict"] == PASSED) & ~table["check"].isin(failed["check"])]
    unchecked = []
    for check, rows in table[table["verdict"] == NOT_CHECKED].groupby("check", sort=False):
        where = ", ".join(titles[medium] for medium in rows["medium"])
        everywhere = len(rows) == len(results.media)
        unchecked.append(CHECKS[str(check)][1] + ("" if everywhere else f" ({where})"))
    return {
        "failed": [
            (row["medium"], titles[row["medium"]], row["effect"] or row["verdict"], row["sentence"])
            for row in records(failed)
        ],
        "passed": [CHECKS[check][1] for check in dict.fromkeys(good["check"])],
        "unchecked": unchecked,
        "no_scale": (table["sentence"] == NO_SCALE).any(),
    }


def _rank(flag: str) -> int:
    return next((i for i, part in enumerate(_GRAVEST_FIRST) if part in flag), len(_GRAVEST_FIRST))
