"""Checks of a medium, declared once beside the functions that do them: order, verdicts, tables and page follow.

``docs/theory/checks.md`` says what each check rests on and where its threshold is from.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

import pandas as pd

from rftfit.campaign.config import CheckName, Config, MediumSettings
from rftfit.campaign.sheet import Run
from rftfit.measure.flags import Flags, Remark, remark
from rftfit.measure.verdict_words import FAILED, NOT_CHECKED, PASSED
from rftfit.outputs.dictionary import columns_of

CheckFunction = TypeVar("CheckFunction", bound="Callable[[MediumMeasurements], Check]")


def declare_check(name: CheckName, **facts: Any) -> Callable[[CheckFunction], CheckFunction]:
    """Declare a check beside the function that does it; `facts`: the other fields of `DeclaredCheck`."""

    def declare(check: CheckFunction) -> CheckFunction:
        assert name not in CHECKS, name
        CHECKS[name] = DeclaredCheck(check, **facts)
        return check

    return declare


class Words(NamedTuple):
    """What a check says: what it found, what is allowed, and where it fails the likely cause and the cure.

    `fault`: What the data do in this outcome, where the check's own `fault` does not say it.
    """

    found: str
    allowed: str = ""
    cause: str = ""
    fault: str = ""


@dataclass(frozen=True)
class DeclaredCheck:
    """A check as its module declares it.

    `check`: Function that does it. `title`: Its name for people. `effect`: On a medium that fails it. `good`, `fault`:
    What good and what bad data do. `outcomes`: Words of each outcome, by code. `after`: Checks whose failure comes
    first: a failure of this one would be another name of it. `needed`: Whether an error of 20 % or more in many runs
    would pass without it, so that no medium is sound that lacks it. `quotes_found`: Whether a failure is told by what
    was found, and not by `fault`.
    """

    check: Callable[[MediumMeasurements], Check]
    title: str
    effect: str
    good: str
    fault: str
    outcomes: Mapping[str, Words]
    after: tuple[CheckName, ...] = ()
    needed: bool = False
    quotes_found: bool = False

    def fault_of(self, code: str) -> str:
        """What data do that fail with this outcome."""
        return self.outcomes[code].fault or self.fault


CHECKS: dict[str, DeclaredCheck] = {}
"""Declared checks by name; complete, since `rftfit.checks` imports all modules that declare one."""

SOUND_LOGS: tuple[CheckName, ...] = ("sheet", "channels", "rods", "drift")
"""Checks without which no force is to be believed."""

SOUND_ALPHA: tuple[CheckName, ...] = (*SOUND_LOGS, "work")
"""Checks without which no alpha is to be believed."""

WAITS = "waits"
_WAITING = Words("not before the check {first} passes")

COLUMNS = columns_of("checks/{medium}.csv")


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
    """Outcome of one check of one medium.

    `code`: Of its words in the declaration. `values`: Numbers, words and remarks that its words name. `flags`: Of single runs.
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
    def words(self) -> Words:
        """Words of this outcome, without its values."""
        return _WAITING if self.code == WAITS else CHECKS[self.check].outcomes[self.code]

    @property
    def found(self) -> str:
        """What was found, or why nothing was checked."""
        return self.words.found.format(**self.values)

    @property
    def allowed(self) -> str:
        """What would pass."""
        return self.words.allowed.format(**self.values)

    @property
    def sentence(self) -> str:
        """The likely cause of a failure and where to look, or what was not checked; empty where a medium passes."""
        cause = self.words.cause
        if self.verdict == PASSED or not cause:
            return ""
        texts = {**self.values, "found": self.found}
        sentence = cause.format(**{"allowed": self.allowed, **texts})
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


MOST_NAMED = 6
"""Most rows or runs named in a sentence."""


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
