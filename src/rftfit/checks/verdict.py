"""The verdict on the data of a medium by its checks: one word and a reason, the same wherever it is shown."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from rftfit.checks.declared import CHECKS
from rftfit.checks.medium import faults_of
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags, remark
from rftfit.measure.verdict_words import (
    ACCEPTED,
    DOUBTFUL,
    FAILED,
    NOT_CHECKED,
    NOTHING,
    SOUND,
    UNUSABLE,
)

_OPEN_QUESTIONS = {
    "repeats-single": "single-runs",
    "axes-pulls-open": "pulls-open",
    "axes-beta-open": "beta-open",
    "shared-labels-open": "labels-open",
}
"""Codes of checks that pass but leave a question open, each with the code of that question."""


class Verdict(NamedTuple):
    """Verdict on a medium.

    `word`: `UNUSABLE`, `DOUBTFUL`, `NOTHING` (no run gave a number), `NOT_CHECKED` or `SOUND`. `reason`: Faults, or why
    not all was checked; of sound data open questions, or nothing. ``str(verdict)`` has both.
    """

    word: str
    reason: str

    def __str__(self) -> str:
        if not self.reason:
            return self.word
        return f"{self.word}{', but ' if self.word == SOUND else ': '}{self.reason}"

    def on(self, media: str, are_several: bool = False) -> str:
        """Format the verdict as a sentence without a full stop: ``poppy_LP is sound``.

        `media`: Name of a medium, or names of several. `are_several`: True: the verb is in the plural.
        """
        if self.word == NOT_CHECKED:
            # say that some checks passed, which is less than sound but more than nothing
            verb = "show" if are_several else "shows"
            return f"{media} {verb} no fault, but not all was checked ({self.reason})"
        verbs = ("has", "have") if self.word == NOTHING else ("is", "are")
        return f"{media} {verbs[are_several]} {self}"


def verdict_on(checks: pd.DataFrame, fits: pd.DataFrame, flags: Flags) -> Verdict:
    """Judge a medium by its checks and by what its runs lack; page, terminal, `check` and `watch` use this function.

    The first that applies decides: failed checks, no slope at all, no tare in half of the runs, energy that the medium
    gives back, needed checks that were not done.

    Parameters
    ----------
    checks, fits : DataFrame
        Rows of the medium in the table of checks (`rftfit.checks.declared.COLUMNS`), and the table of fits of its runs.
    flags : Flags
        Flags of its runs and cells.

    Returns
    -------
    Verdict
    """
    failed = checks[checks["verdict"].isin([FAILED, ACCEPTED])]
    for word in (UNUSABLE, DOUBTFUL):
        if (failed["effect"] == word).any():
            return Verdict(word, faults_of(failed))
    if len(failed):
        return Verdict(DOUBTFUL, f"{faults_of(failed)}, which the config accepts")
    used_runs = fits.loc[fits[column("z")].notna(), "run_id"]
    if used_runs.empty:
        return Verdict(NOTHING, "no run gave a slope")
    without_tare = len(flags.runs_with("no-tare").keys() & set(used_runs))
    if without_tare and 2 * without_tare >= len(used_runs):
        is_in_all = without_tare == len(used_runs)
        runs = "" if is_in_all else f"in {without_tare} of {len(used_runs)} runs "
        return Verdict(DOUBTFUL, f"{runs}{remark('no-tare')}")
    # too few runs to fail the check of work, but each is a doubt
    if giving := len(flags.runs_flagged_by_checks("gives-back")):
        runs = f"in {giving} of {len(used_runs)} runs"
        return Verdict(DOUBTFUL, f"{runs} {CHECKS['work'].fault}")
    unchecked = checks[checks["verdict"] == NOT_CHECKED].set_index("check")["found"]
    # a later check waits for the earlier ones, so the last needed check gives the reason
    for check in reversed(unchecked.index):
        if CHECKS[str(check)].needed:
            return Verdict(NOT_CHECKED, str(unchecked[check]))
    codes = set(checks["code"])
    open_questions = [
        str(remark(asked)) for code, asked in _OPEN_QUESTIONS.items() if code in codes
    ]
    return Verdict(SOUND, "; ".join(open_questions))
