"""Verdicts on a medium: what a check reads, what it says, what follows, and how tables carry that.

``docs/theory/checks.md`` says what each check rests on and where its threshold is from.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, get_args

import pandas as pd

from rftfit.campaign.config import CheckName, Config, MediumSettings
from rftfit.campaign.sheet import Run
from rftfit.measure.flags import Flags, Remark, remark
from rftfit.measure.sentences import CHECK_WORDS
from rftfit.measure.verdict_words import ACCEPTED, DOUBTFUL, FAILED, NOT_CHECKED, PASSED, UNUSABLE


class Rule(NamedTuple):
    """What follows for a medium that fails a check, what good and what bad data do, and what must be put right before.

    A failure of one of `after` comes first: the check's own would be another name of it. `quotes_found`: Whether a
    failure is told by what was found, and not by `fault`.
    """

    effect: str
    good: str
    fault: str
    after: tuple[CheckName, ...] = ()
    quotes_found: bool = False


_LOGS: tuple[CheckName, ...] = ("channels", "rods", "drift")
_ALPHA: tuple[CheckName, ...] = (*_LOGS, "work")
CHECKS: dict[str, Rule] = {
    "channels": Rule(
        UNUSABLE,
        "no force channel is dead, frozen, clipped, reversed or exchanged in several runs",
        "a force channel is dead, frozen, clipped, reversed or exchanged",
    ),
    "rods": Rule(
        UNUSABLE,
        "the force on rods is smaller than on plates",
        "the force on rods is as large as on plates",
        ("channels",),
    ),
    "work": Rule(
        UNUSABLE, "the medium takes energy", "the medium seems to give energy to the plates", _LOGS
    ),
    "axes": Rule(
        UNUSABLE,
        "the axes of the force fit the shape of known media",
        "other axes than the given ones fit the shape of known media",
        _ALPHA,
    ),
    "symmetry": Rule(
        UNUSABLE,
        "plates straight down are not pushed to one side",
        "plates straight down are pushed to one side",
        _ALPHA,
    ),
    "up_down": Rule(
        DOUBTFUL, "down is harder than up", "up is harder than down for a level plate", _ALPHA
    ),
    "drift": Rule(
        DOUBTFUL,
        "the zero of the force stays where it is",
        "the zero of the force drifts",
        ("channels", "rods"),
    ),
    "surface": Rule(
        DOUBTFUL,
        "stress begins at the surface in all runs alike",
        "stress does not begin at the stated surface",
        _LOGS,
    ),
    "linearity": Rule(
        DOUBTFUL,
        "stress is proportional to depth",
        "stress is not proportional to depth",
        (*_LOGS, "surface"),
    ),
    "steadiness": Rule(
        DOUBTFUL, "horizontal runs are steady", "horizontal runs are not steady", _LOGS
    ),
    "repeats": Rule(
        DOUBTFUL,
        "each run agrees with the others",
        "single runs disagree with the others",
        (*_ALPHA, "symmetry", "surface"),
    ),
    "shared": Rule(
        DOUBTFUL,
        "no gain, turn or angle is off in many runs",
        "a gain, a turn or an angle is off in many runs",
        (*_ALPHA, "axes"),
        quotes_found=True,
    ),
    "same_logs": Rule(UNUSABLE, "no log or run is there twice", "a log or run is there twice"),
    "size": Rule(
        UNUSABLE, "alpha is as large as expected", "alpha is not as large as expected", _LOGS
    ),
}
assert tuple(CHECKS) == get_args(CheckName)

NEEDED: tuple[CheckName, ...] = ("shared", "axes")
"""Checks without which a fault of 20 % or more in many runs would pass; no medium is sound that lacks one of them."""

COLUMNS = ["medium", "check", "verdict", "effect", "code", "found", "allowed", "sentence"]


@dataclass(frozen=True, eq=False)
class MediumMeasurements:
    """What checks read of one medium.

    `sheet`: Its runs by run_id. `tables`: ``runs``, ``tares``, ``fits``, ``peers``, ``causes``, ``axes``, ``alpha``,
    ``tared`` and ``windows``. `copies`: Of `copies_of`. `flags`: Of the runs, by their own logs.
    """

    config: Config
    medium: MediumSettings
    sheet: Mapping[str, Run]
    tables: Mapping[str, pd.DataFrame]
    copies: Mapping[str, Collection[str]]
    flags: Flags = field(default_factory=Flags)


@dataclass(frozen=True)
class Check:
    """Outcome of one check of one medium; its words stand in `CHECK_WORDS`.

    `code`: Row of that table. `values`: Numbers, words and remarks that its words name. `flags`: Of single runs.
    `why_accepted`: What the config says of a failure that it accepts.
    """

    check: CheckName
    verdict: str
    code: str
    values: Mapping[str, Any] = field(default_factory=dict)
    flags: tuple[Remark, ...] = ()
    why_accepted: str = ""

    @classmethod
    def judge(
        cls,
        check: CheckName,
        passed: bool,
        flags: Iterable[Remark] = (),
        code: str = "",
        **values: Any,
    ) -> Check:
        """Pass a medium, or fail it; default of `code`: the name of the check."""
        return cls(check, PASSED if passed else FAILED, code or check, values, tuple(flags))

    @classmethod
    def skip(cls, check: CheckName, code: str, **values: Any) -> Check:
        """Leave a medium unchecked for a reason."""
        return cls(check, NOT_CHECKED, code, values)

    @property
    def found(self) -> str:
        """What was found, or why nothing was checked."""
        return CHECK_WORDS[self.code].found.format(**self.values)

    @property
    def allowed(self) -> str:
        """What would pass."""
        return CHECK_WORDS[self.code].allowed.format(**self.values)

    @property
    def sentence(self) -> str:
        """The likely cause of a failure and where to look, or what was not checked; empty where a medium passes."""
        words = CHECK_WORDS[self.code].cause
        if self.verdict == PASSED or not words:
            return ""
        texts = {**self.values, "found": self.found}
        sentence = words.format(**{"allowed": self.allowed, **texts})
        sentence = sentence[0].upper() + sentence[1:]
        return f"{sentence} Accepted: {self.why_accepted}" if self.why_accepted else sentence

    @property
    def effect(self) -> str:
        """What follows for the medium."""
        return CHECKS[self.check].effect if self.verdict == FAILED else ""

    def row(self, medium: str) -> dict[str, str]:
        """Row of the table of checks: columns `COLUMNS`."""
        return {"medium": medium} | {name: getattr(self, name) for name in COLUMNS[1:]}


def flags_on(runs: Iterable[str], code: str, **values: Any) -> list[Remark]:
    """One flag on each of some runs."""
    return [remark(code, run_id=run, **values) for run in runs]


def as_sentence(words: str) -> str:
    """Begin with a capital letter and end with a full stop."""
    return f"{words[0].upper()}{words[1:]}."


MOST_NAMED = 6
"""So many rows or runs are named in a sentence."""


def describe_rows(runs: Iterable[str], sheet: Mapping[str, Run]) -> str:
    """Rows of the run sheet of some runs, in few words: ``rows 2 to 34 and 40``; rods between them do not count."""
    run_ids = set(runs)
    spans: list[list[int]] = []
    is_open = False
    for run in sorted(sheet.values(), key=lambda run: run.row):
        if run.run_id in run_ids:
            spans = spans if is_open else [*spans, [run.row, run.row]]
            spans[-1][1] = run.row
        is_open = run.run_id in run_ids or (is_open and run.kind not in ("plate", "leg"))
    words = [f"{first} to {last}" if last > first else f"{first}" for first, last in spans]
    if len(words) > MOST_NAMED:
        words = [*words[: MOST_NAMED - 1], f"others to {spans[-1][1]}"]
    listed = " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))
    return f"{'rows' if len(run_ids) > 1 else 'row'} {listed} of the run sheet"


def faults_of(checks: pd.DataFrame) -> str:
    """What failed checks, rows of the table, say of a medium, in words."""
    rows = zip(checks["check"], checks["found"], strict=True)
    return " and ".join(
        words if CHECKS[check].quotes_found else CHECKS[check].fault for check, words in rows
    )


def marks_of(checks: pd.DataFrame, media: Mapping[str, MediumSettings]) -> dict[str, list[Remark]]:
    """What stands wherever a medium appears that fails a check, by medium; `checks`: the table."""
    warnings = {}
    for medium, rows in checks.groupby("medium", sort=False):
        marks = []
        for effect in (UNUSABLE, DOUBTFUL):
            failed = rows[rows["effect"] == effect]
            marks += [remark(effect, faults=faults_of(failed))] if len(failed) else []
        # by the config as it is now, which may be newer than the table
        accept: dict[Any, str] = media[str(medium)].accept
        for check, row in rows[rows["verdict"] == ACCEPTED].groupby("check", sort=False):
            why = accept.get(check, "")
            marks.append(remark(ACCEPTED, fault=faults_of(row), why=why))
        if marks:
            warnings[str(medium)] = marks
    return warnings
