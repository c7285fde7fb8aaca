"""What a check is: how it is declared beside its function, what it reads (`MediumMeasurements`), its outcome (`Check`).

Each other module of this room has functions that do a check, each with its declaration: words, verdict, and checks to
wait for. Tables, verdicts and page follow from the declarations; the order is that of ``CheckName`` of the config.
``docs/theory/checks.md`` describes the basis of each check and the source of its threshold. A *remark* is a sentence with
a code (`rftfit.measure.flags`), a *flag* a remark on one run.
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


class Sentences(NamedTuple):
    """Sentences of one outcome of a check, for `str.format` with the values of the outcome (`Check.values`).

    `found`: What was found, or why nothing was checked.
    `allowed`: What would pass; empty: nothing is compared.
    `cause`: Likely cause of a failure, and the cure; may name ``{found}`` and ``{allowed}``. Empty: nothing is said.
    `fault`: Fault of the data in this outcome, if it is another than the `fault` of the check.
    """

    found: str
    allowed: str = ""
    cause: str = ""
    fault: str = ""


@dataclass(frozen=True)
class DeclaredCheck:
    """A check as its module declares it.

    `check`: Function that does the check.
    `title`: Name for people.
    `effect`: Verdict on a medium that fails, `UNUSABLE` or `DOUBTFUL`.
    `good`, `fault`: What is said of data that pass and of data that fail, as ``the medium takes energy``.
    `outcomes`: Sentences of each outcome, by its code (`Check.code`).
    `after`: Checks that must pass before: if one fails, a failure of this check would only repeat it.
    `needed`: True if a medium is not sound without this check, as an error of 20 % or more in many runs would pass.
    `quotes_found`: True if the fault of a failure is its `Sentences.found`, not `fault`.
    """

    check: Callable[[MediumMeasurements], Check]
    title: str
    effect: str
    good: str
    fault: str
    outcomes: Mapping[str, Sentences]
    after: tuple[CheckName, ...] = ()
    needed: bool = False
    quotes_found: bool = False

    def fault_of(self, code: str) -> str:
        """Sentence about the fault of data that fail with the outcome `code`."""
        return self.outcomes[code].fault or self.fault


CHECKS: dict[str, DeclaredCheck] = {}
"""Declared checks by name; complete, as `rftfit.checks` imports all modules that declare one."""

CheckFunction = TypeVar("CheckFunction", bound="Callable[[MediumMeasurements], Check]")


def declare_check(name: CheckName, **facts: Any) -> Callable[[CheckFunction], CheckFunction]:
    """Decorate the function that does a check: adds the check to `CHECKS`, and leaves the function as it is.

    `name`: Of the check, in config and tables. `facts`: the fields of `DeclaredCheck` but the first.
    """

    def declare(check: CheckFunction) -> CheckFunction:
        """Add the declaration of the decorated function."""
        assert name not in CHECKS, name
        CHECKS[name] = DeclaredCheck(check, **facts)
        return check

    return declare


SOUND_LOGS: tuple[CheckName, ...] = ("sheet", "channels", "rods", "drift")
"""Checks that must pass before forces are trusted."""

SOUND_ALPHA: tuple[CheckName, ...] = (*SOUND_LOGS, "work")
"""Checks that must pass before alpha is trusted."""

WAITS = "waits"
"""Code of a check that was left out because a check before it failed."""
_WAITING = Sentences("not before the check {first} passes")
"""Sentences of `WAITS`, for any check."""


@dataclass(frozen=True, eq=False)
class MediumMeasurements:
    """All data of one medium that checks read.

    `sheet`: Runs of the medium by run_id.
    `tables`: Results by name, whose columns ``rftfit.outputs`` describes. A row for each run: ``runs`` (logs, zeros and
    channels), ``tares`` (forces with and without plate), ``fits`` (slopes). By comparing runs: ``peers`` (each run
    beside the others of its direction), ``causes`` (errors that many runs share), ``axes`` (evidence for other axes),
    ``misplaced`` (evidence for other rows of the sheet). A row for each direction: ``alpha``. A row for each sample:
    ``tared`` (depth, path and force) and ``windows`` (which of these the fit uses, in the same order).
    `copies`: run_ids of the copies of each run that can be compared (`rftfit.measure.copies`).
    `flags`: Flags of the runs from their logs.
    """

    config: Config
    medium: MediumSettings
    sheet: Mapping[str, Run]
    tables: Mapping[str, pd.DataFrame]
    copies: Mapping[str, Collection[str]]
    flags: Flags = field(default_factory=Flags)

    @property
    def tolerance_deg(self) -> float:
        """Difference of each angle, deg, up to which two directions are the same: ``grid.angle_tolerance_deg``."""
        return self.config.grid.angle_tolerance_deg

    @property
    def likeliest_mistake(self) -> dict[Any, Any]:
        """Row of the table ``misplaced`` with the likeliest mistake in angles or axes of some runs; empty without one.

        Keys: `mistake`, `rows`, `log_bayes_factor`, `n_runs`, `run_ids`.
        """
        # the likeliest comes first in the table
        return next(iter(self.tables["misplaced"].to_dict("records")), {})


COLUMNS = columns_of("checks/{medium}.csv")


@dataclass(frozen=True)
class Check:
    """Outcome of one check of one medium: made by `judge` or `skip`, changed by `rftfit.checks.medium` alone.

    `check`: Name of the check. `verdict`: `PASSED`, `FAILED`, `NOT_CHECKED` or `ACCEPTED`.
    `code`: Code of the outcome in the declaration of the check, which has its sentences.
    `values`: Numbers, words and remarks that these sentences name.
    `flags`: Flags of single runs that the check found, whatever the verdict on the medium.
    `why_accepted`: Reason that the config gives for accepting a failure; empty where it does not.
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
        """Make the outcome of a medium that passes or fails.

        `flags`: Of single runs. `code`: Default: the name of the check, the code of its ordinary outcome. `values`: Those
        of its sentences.
        """
        return cls(check, PASSED if passed else FAILED, code or check, values, tuple(flags))

    @classmethod
    def skip(cls, check: CheckName, code: str, **values: Any) -> Check:
        """Make the outcome of a medium that is not checked; `code`: outcome whose sentence `found` says why."""
        return cls(check, NOT_CHECKED, code, values)

    @property
    def sentences(self) -> Sentences:
        """Sentences of this outcome, before its values are put in."""
        return _WAITING if self.code == WAITS else CHECKS[self.check].outcomes[self.code]

    @property
    def found(self) -> str:
        """Sentence on what was found, or why nothing was checked."""
        return self.sentences.found.format(**self.values)

    @property
    def allowed(self) -> str:
        """Sentence on what would pass."""
        return self.sentences.allowed.format(**self.values)

    @property
    def sentence(self) -> str:
        """Likely cause of a failure and its cure, or what was not checked; empty if the medium passes.

        Of an accepted failure the reason of the config follows.
        """
        cause = self.sentences.cause
        if self.verdict == PASSED or not cause:
            return ""
        sentence = cause.format(**{"allowed": self.allowed, **self.values, "found": self.found})
        sentence = sentence[0].upper() + sentence[1:]
        return f"{sentence} Accepted: {self.why_accepted}" if self.why_accepted else sentence

    @property
    def effect(self) -> str:
        """Verdict on the medium if the check failed, `UNUSABLE` or `DOUBTFUL`; else empty."""
        return CHECKS[self.check].effect if self.verdict == FAILED else ""

    def row(self, medium: str) -> dict[str, str]:
        """Row of the table of checks; its columns but the medium are fields and properties of this class."""
        return {"medium": medium} | {name: getattr(self, name) for name in COLUMNS[1:]}


def flags_on(runs: Iterable[str], code: str, **values: Any) -> list[Remark]:
    """Make the same flag on each of some runs, a remark with the run_id; `runs`: run_ids. `values`: of its sentence."""
    return [remark(code, run_id=run, **values) for run in runs]


MOST_NAMED = 6
"""Most rows or runs named in a sentence."""


def describe_rows(runs: Iterable[str], sheet: Mapping[str, Run]) -> str:
    """Describe the rows of some runs in the run sheet: ``rows 2 to 34 and 40``; rods between them interrupt no span.

    `runs`: run_ids. `sheet`: all runs of the medium by run_id.
    """
    run_ids = set(runs)
    # first and last row of each span
    spans: list[list[int]] = []
    # True while the span goes on: from one of the runs up to the next plate or leg that is none of them
    is_open = False
    for run in sorted(sheet.values(), key=lambda run: run.row):
        if run.run_id in run_ids:
            if not is_open:
                spans.append([run.row, run.row])
            spans[-1][1] = run.row
        is_open = run.run_id in run_ids or (is_open and run.kind not in ("plate", "leg"))
    named = [f"{first} to {last}" if last > first else f"{first}" for first, last in spans]
    if len(named) > MOST_NAMED:
        named = [*named[: MOST_NAMED - 1], f"others to {spans[-1][1]}"]
    listed = " and ".join(filter(None, [", ".join(named[:-1]), *named[-1:]]))
    return f"{'rows' if len(run_ids) > 1 else 'row'} {listed} of the run sheet"
