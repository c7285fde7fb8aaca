"""The verdict on the data of a medium by its checks: one word and why, in the same words wherever it stands."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from rftfit.checks.declared import CHECKS
from rftfit.checks.medium import faults_of
from rftfit.measure.flags import remark
from rftfit.measure.verdict_words import ACCEPTED, DOUBTFUL, FAILED, NOT_CHECKED, SOUND, UNUSABLE

_OPEN_QUESTIONS = {"repeats-single": "single-runs", "axes-pulls-open": "pulls-open"}
"""Codes of checks that pass and leave something open, and the words for it."""


class Verdict(NamedTuple):
    """One of `UNUSABLE`, `DOUBTFUL`, `NOT_CHECKED`, `SOUND`, and why; of sound data: what is open."""

    word: str
    reason: str

    def __str__(self) -> str:
        return f"{self.word} ({self.reason})" if self.reason else self.word


def verdict_on(checks: pd.DataFrame) -> Verdict:
    """Verdict on a medium; `checks`: its rows of the table of checks."""
    failed = checks[checks["verdict"].isin([FAILED, ACCEPTED])]
    for word in (UNUSABLE, DOUBTFUL):
        if (failed["effect"] == word).any():
            return Verdict(word, faults_of(failed))
    if len(failed):
        return Verdict(DOUBTFUL, f"{faults_of(failed)}, which the config accepts")
    unchecked = checks[checks["verdict"] == NOT_CHECKED].set_index("check")["found"]
    # of two needed ones the later waits for the earlier, and says more
    for check in reversed(unchecked.index):
        if CHECKS[str(check)].needed:
            return Verdict(NOT_CHECKED, str(unchecked[check]))
    codes = set(checks["code"])
    open_questions = [
        str(remark(words)) for code, words in _OPEN_QUESTIONS.items() if code in codes
    ]
    return Verdict(SOUND, "; ".join(open_questions))
