"""Remarks: flags, reasons and uses of rows. Each is a code with numbers, and becomes a sentence when written.

- A *flag* is a doubt about a number that counts all the same; a *reason* says why a number is missing; a *use* says for
  what rows of a log served; a *mark* says at each number of a medium that the medium fails checks.
- In tables a remark has two cells, words to be read and codes to decide by: columns `REASON` or `MARKS`.
- Flags have a table of their own (`flag_table`), which `Flags` reads.

The sentence of each code stands in `rftfit.measure.sentences`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd

from rftfit.measure.sentences import FLAGS, SENTENCES
from rftfit.table.parse import BLANK, CUT, NAN_OR_INFINITE, NO_NUMBER, OTHER_SOURCE, WRONG_CELLS

# why rows of a log are left out: words that the ledger shows, keys of `Log.dropped` and `Log.stretches`
DUPLICATE = "duplicated row"
BACKWARDS = "time runs backwards"
HELD = "repeats the position before, while the arm moves"
NO_DATA = "holds a value that means no data (`missing` in the config)"
LONE = "stands alone, far from the readings before and after it"
AWAY = "away from the readings before and after them, entered and left by a jump"
HELD_READING = "repeats the reading before until a jump makes up for it: no new reading came"
SET_BACK = "clock set back by whole hours"
ON_ARRIVAL = "stamped on arrival, several rows at once"
REPEATED = "repeats the reading before (transducer slower than its logger)"
AVERAGED = "went into the mean of its neighbours: the log has more rows than are kept"

_ROW_CODES = {
    CUT: "cut-rows",
    WRONG_CELLS: "wrong-cells",
    NO_NUMBER: "not-numbers",
    NAN_OR_INFINITE: "not-finite",
    BLANK: "blank-cells",
    DUPLICATE: "duplicated-rows",
    BACKWARDS: "time-backwards",
    HELD: "held-positions",
    OTHER_SOURCE: "other-source",
    LONE: "lone-readings",
    AWAY: "readings-away",
    HELD_READING: "held-readings",
    NO_DATA: "no-data",
    REPEATED: "repeated-rows",
    AVERAGED: "averaged-rows",
}
"""Codes of the reasons for which rows of a log are left out."""


@dataclass(frozen=True)
class Remark:
    """A flag, a reason, a use of rows or a mark of a medium.

    `code`: Its name, a key of `SENTENCES`, or that of an error; several names if it was read from a table.
    `values`: Numbers, words and further remarks that stand in the sentence, by the name in its braces.
    `run_id`: Run that the remark is about, where remarks on several runs stand together.
    `words`: The sentence, if it does not follow from the code: the text of an error, or the cell of a table.
    `cell`: Beta and gamma of the cell that a flag is about, degrees.
    """

    code: str
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)
    run_id: str = ""
    words: str = ""
    cell: tuple[float, float] | None = None

    def __str__(self) -> str:
        """Return the sentence, without the name of the run."""
        return self.words or SENTENCES[self.code].format(**self.values)

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of this remark, then those of the remarks in its values."""
        inner = (value for value in self.values.values() if isinstance(value, Remark))
        return (*self.code.split(), *(code for flag in inner for code in flag.codes))


class Refused(ValueError):
    """A run, a stroke or a tare that cannot be used; `remark` is the reason in ledger, table and report.

    `code`, `values`: Those of the remark.
    """

    def __init__(self, code: str, **values: Any) -> None:
        self.remark = remark(code, **values)
        super().__init__(str(self.remark))


def remark(
    code: str, cell: tuple[float, float] | None = None, /, run_id: str = "", **values: Any
) -> Remark:
    """Make a remark; its numbers are rounded to six digits, as in a table, so that it is the same when read again.

    `code`: Key of `SENTENCES`. `cell`, `run_id`, `values`: Fields of `Remark`.
    """
    if code not in SENTENCES:
        raise KeyError(code)
    plain_values = {name: _plain_value(value) for name, value in values.items()}
    return Remark(code, plain_values, run_id, cell=cell)


def _plain_value(value: Any) -> Any:
    """Return a number without its numpy type, with six digits; other values unchanged."""
    if isinstance(value, np.generic):
        value = value.item()
    return float(f"{value:.6g}") if isinstance(value, float) else value


def quoted(error: Exception, code: str = "refused") -> Remark:
    """Make the remark of an error, with its text as the sentence; `code` is used if the error has none."""
    if isinstance(error, Refused):
        return error.remark
    return Remark(getattr(error, "code", code).replace("_", "-"), words=str(error))


def dropped_rows(reason: str) -> Remark:
    """Make the remark of a `reason` for which rows of a log are left out, a key of `Log.dropped`."""
    return Remark(_ROW_CODES.get(reason, "damaged-rows"), words=reason)


def format_remarks(remarks: Iterable[Remark]) -> str:
    """Format some remarks as one line; those on one run stand together behind its name."""
    parts: list[str] = []
    for run, group in groupby(remarks, key=lambda flag: flag.run_id):
        sentences = [str(flag) for flag in group]
        parts += [f"{run}: {', '.join(sentences)}"] if run else sentences
    return "; ".join(parts)


def codes_of(remarks: Iterable[Remark]) -> str:
    """Join the codes of some remarks for a cell of a table, each code once."""
    return " ".join(dict.fromkeys(code for flag in remarks for code in flag.codes))


def attach_run(run_id: str, remarks: Iterable[Remark]) -> list[Remark]:
    """Return the remarks with the run that they are about, for a place where remarks on several runs stand together."""
    return [replace(flag, run_id=run_id) for flag in remarks]


# --- Remarks in tables: words to be read, codes to decide by.


REASON = ("reason", "reason_code")
"""Columns of the reason why a number is missing: words and codes."""
MARKS = ("checks", "checks_code")
"""Columns of the marks of a medium that fails checks: words and codes."""


def reason_cells(reasons: Collection[Remark]) -> tuple[str, str]:
    """Format reasons, or marks of a medium, as two cells of a table: words and codes."""
    return format_remarks(reasons), codes_of(reasons)


def reason_columns(reasons: Collection[Remark]) -> dict[str, str]:
    """Format reasons as the columns `REASON` of a row."""
    return dict(zip(REASON, reason_cells(reasons), strict=True))


def mark_columns(marks: Collection[Remark] = ()) -> dict[str, str]:
    """Format the marks of a medium as the columns `MARKS` of a row."""
    return dict(zip(MARKS, reason_cells(marks), strict=True))


def reason_of(row: Mapping[Any, Any]) -> tuple[Remark, ...]:
    """Read the columns `REASON` of a row of a table as one remark that holds their words; empty if there is none."""
    words = row.get("reason")
    if not (words and isinstance(words, str)):
        return ()
    return (Remark(str(row.get("reason_code", "")), words=words),)


def with_reasons(table: pd.DataFrame, added: Iterable[Iterable[Remark]]) -> pd.DataFrame:
    """Return a table with remarks added to the reason of each row; `added`: the remarks of each row, in their order."""
    stated = table.filter([*REASON]).to_dict("records")
    rows = zip(stated, added, strict=True)
    reasons = [reason_columns([*reason_of(row), *remarks]) for row, remarks in rows]
    return table.assign(**{name: [reason[name] for reason in reasons] for name in REASON})


def has(row: Mapping[Any, Any], code: str) -> bool:
    """Return True if the reason of a row of a table has `code` among its codes (column `reason_code`)."""
    return code in str(row.get("reason_code", "")).split()


# --- Flags: a table of their own, a row each, to which the stages append.


FLAG_COLUMNS = ["medium", "run_id", "beta_deg", "gamma_deg", "stage", "code", "values", "words"]
"""Columns of a table of flags; the angles are those of a flag about a cell of an alpha table, ``values`` is JSON."""
OF_CHECKS = "checks"
"""Stage whose flags come from a comparison with other runs; flags of earlier stages come from the logs of the run."""


def flag_table(medium: str, stage: str, flags: Iterable[Remark]) -> pd.DataFrame:
    """Make the table of the flags of one stage of the workflow, each flag once: columns `FLAG_COLUMNS`.

    `stage`: ``ingest``, ``tare``, ``slopes`` or `OF_CHECKS`.
    """
    rows = [
        (
            medium,
            flag.run_id,
            *(flag.cell or (np.nan, np.nan)),
            stage,
            flag.code,
            json.dumps(dict(flag.values)),
            str(flag),
        )
        for flag in dict.fromkeys(flags)
    ]
    return pd.DataFrame(rows, columns=FLAG_COLUMNS)


class Flags:
    """Flags of the runs and cells of one medium, read from their tables.

    Parameters
    ----------
    tables : DataFrame
        Tables of `flag_table`, in the order of the stages.
    """

    def __init__(self, *tables: pd.DataFrame) -> None:
        self._of_runs: dict[str, list[Remark]] = {}
        self._of_checks: dict[str, list[Remark]] = {}
        self._of_cells: dict[tuple[float, float], list[Remark]] = {}
        for row in (row for table in tables for row in table.to_dict("records")):
            flag = Remark(row["code"], json.loads(row["values"]))
            if row["run_id"]:
                of_stage = self._of_checks if row["stage"] == OF_CHECKS else self._of_runs
                of_stage.setdefault(str(row["run_id"]), []).append(flag)
            else:
                cell = float(row["beta_deg"]), float(row["gamma_deg"])
                self._of_cells.setdefault(cell, []).append(flag)

    def of_run(self, run_id: str) -> list[Remark]:
        """Flags of a run that come from its logs."""
        return self._of_runs.get(run_id, [])

    def of_run_by_checks(self, run_id: str) -> list[Remark]:
        """Flags of a run that come from the checks, which compare it with other runs."""
        return self._of_checks.get(run_id, [])

    def of_cell(self, cell: Mapping[Any, Any], without: Collection[Remark] = ()) -> list[Remark]:
        """Flags of the runs of a cell of an alpha table, then those of the cell; leaves out the flags `without`.

        `cell`: Row of the alpha table. The flags of runs that give the cell no number count too, but not what checks
        say of these.
        """
        runs = [*cell["run_ids"].split(), *cell["lost_run_ids"].split()]
        flags: list[Remark] = []
        for run_id in sorted(runs):
            of_run = [flag for flag in self.of_run(run_id) if flag not in without]
            flags += attach_run(run_id, of_run)
        for run_id in cell["run_ids"].split():
            flags += attach_run(run_id, self.of_run_by_checks(run_id))
        return flags + self.of_cell_alone(cell)

    def of_cell_alone(self, cell: Mapping[Any, Any]) -> list[Remark]:
        """Flags of a cell that concern no single run."""
        return self._of_cells.get((float(cell["beta_deg"]), float(cell["gamma_deg"])), [])

    def runs_with(self, code: str) -> dict[str, Remark]:
        """Runs that have the flag `code` from their logs, each with this flag, in the order of the table."""
        return {
            run_id: flag
            for run_id, flags in self._of_runs.items()
            for flag in flags
            if flag.code == code
        }

    def runs_flagged_by_checks(self, code: str) -> list[str]:
        """Runs that have the flag `code` from a check."""
        of_checks = self._of_checks.items()
        return [run_id for run_id, flags in of_checks if any(flag.code == code for flag in flags)]

    def shared(self, fits: pd.DataFrame) -> tuple[Remark, ...]:
        """Flags of how a medium was measured, which are reported once for all runs instead of for each.

        `FLAGS` says which these are: always, or where all runs have them. `fits`: Plate runs, ``run_id`` and
        ``reason``.
        """
        rows = zip(map(str, fits["run_id"]), fits["reason"], strict=True)
        # a run that was never read has no flag of this sort
        flags_of_runs = [
            self.of_run(run_id) for run_id, reason in rows if self.of_run(run_id) or not reason
        ]
        shared = []
        for flag in dict.fromkeys(flag for flags in flags_of_runs for flag in flags):
            rule = FLAGS[flag.code].shared
            if rule == "always" or (rule and all(flag in flags for flags in flags_of_runs)):
                shared.append(flag)
        return tuple(shared)


def describe_shared(shared: Collection[Remark]) -> list[str]:
    """Describe the flags of `Flags.shared`, in one sentence each for all runs together."""
    sentences = [
        f"all runs: {flag}" for flag in shared if FLAGS[flag.code].shared == "if all runs have it"
    ]
    sentences += [str(flag) for flag in shared if flag.code == "no-force-x"]
    plates = [flag.values["plate"] for flag in shared if flag.code == "several-plates"]
    return sentences + ([f"runs with {len(plates)} plates: {', '.join(plates)}"] if plates else [])
