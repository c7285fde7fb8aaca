"""The ledger: every row of every log with its use or the reason why not (`RowStatus`), and the flags of runs.

Each stage enters the rows that it uses for good or leaves out; the good rows that it hands on are entered by a later
stage. In the end the rows of a run add up to the lines of its logs (`check_ledger`): none is lost silently.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.sheet import Run
from rftfit.errors import RftfitError
from rftfit.measure.flags import REASON, Remark, attach_run, reason_cells, remark


class RowStatus(IntEnum):
    """Reason why a row must not be used, as a small number that is kept for every sample: the column or array `why`.

    Its `code` has a sentence in `rftfit.measure.sentences`.
    """

    GOOD = 0  # no reason
    MOTION_GAP = 1  # within a gap of the motion log
    NO_MOTION = 2  # before or after the motion log
    SATURATED = 3  # the transducer or its amplifier is at its end
    UNTARED = 4  # no tare at this position
    # the next three are good readings that are in no stroke
    APPROACH = 5
    PAUSE = 6
    ELSEWHERE = 7
    # the next five, and the two too deep and too shallow, are outside the window of the fit
    ABOVE = 8  # the plate is partly in air
    BOTTOM = 9
    WALL = 10
    STARTUP = 11
    NONLINEAR = 12  # beyond the linear regime
    YIELDED = 13  # more force than when the yield of the machine was measured: depth not known
    TOO_DEEP = 14
    TOO_SHALLOW = 15
    # rows of a table of stress
    OTHER_SENSE = 16
    ALONE = 17
    OTHER_ZERO = 18  # at rest, but with another zero than the stroke

    @property
    def code(self) -> str:
        """Code of this status in the ledger."""
        return self.name.lower().replace("_", "-")


StatusArray = npt.NDArray[np.int8]
"""`RowStatus` of each sample, shape (n,)."""

USED, DROPPED, LOST = "used", "dropped", "lost"
"""Fates of rows; the instrument counted lost rows, but they are in no file."""
COLUMNS = ["run_id", "medium", "kind", "file", "fate", *REASON, "rows"]
"""Columns of the table of the ledger; ``rows`` is their number, the reason says also what used rows were used for."""


@dataclass
class Ledger:
    """Number of rows by run_id, medium, kind, file, fate and remarks (`counts`), and flags of the runs.

    The stages fill it by its methods, which change it.
    """

    counts: dict[tuple[str, str, str, str, str, tuple[Remark, ...]], int] = field(
        default_factory=lambda: defaultdict(int)
    )
    flags: list[Remark] = field(default_factory=list)

    def add(self, run: Run, file: str, fate: str, rows: int, *reason: Remark) -> None:
        """Count `rows` lines of one file, 0 for a missing file.

        `fate`: `USED`, `DROPPED`, or `LOST` for rows that the instrument counted but the file lacks. `reason`: Why, or
        the use of used rows.
        """
        self.counts[run.run_id, run.medium, run.kind, file, fate, reason] += int(rows)

    def flag(self, run: Run, *flags: Remark) -> None:
        """Keep flags of a run: doubts that do not make it useless."""
        self.flags += attach_run(run.run_id, flags)

    def add_rows(self, run: Run, why: StatusArray, used_as: str) -> None:
        """Count the rows of a force log by their `RowStatus`, `why`, shape (n,).

        `used_as`: Code of the use of good rows; empty where there are none.
        """
        for number, count in enumerate(np.bincount(why)):
            if count:
                status = RowStatus(number)
                fate, code = (DROPPED, status.code) if number else (USED, used_as)
                self.add(run, run.force_log, fate, count, remark(code))

    def leave_out(self, runs: Mapping[str, Remark]) -> None:
        """Count the used rows of some runs as dropped; `runs`: run_ids, each with its reason."""
        for key in [key for key in self.counts if key[0] in runs and key[4] == USED]:
            rows = self.counts.pop(key)
            self.counts[*key[:4], DROPPED, (runs[key[0]],)] += rows

    def table(self) -> pd.DataFrame:
        """Return the counts as a sorted table with the columns `COLUMNS`."""
        rows = ((*key, *reason_cells(why), n) for (*key, why), n in self.counts.items())
        return pd.DataFrame(sorted(rows), columns=COLUMNS)


def join(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Join ledgers; a run in air that serves several media is read for each medium but counted once."""
    rows = pd.concat([ledger.fillna({"medium": ""}) for ledger in parts], ignore_index=True)
    in_air = rows["kind"] == "leg_air"
    counted_once = pd.concat([rows[~in_air], rows[in_air].drop_duplicates()])
    return counted_once.sort_values(COLUMNS).reset_index(drop=True)[COLUMNS]


_FAULT = "this is a fault of the program, please report it"


def check_ledger(
    book: pd.DataFrame,
    runs: pd.DataFrame,
    same_table: Collection[str] = (),
    expected: Iterable[str] = (),
) -> None:
    """Compare the ledger with the run sheet, and with the rows of each log that was read; raise if they differ.

    `book`: Table of the ledger, of all stages.
    `runs`: Table of runs of the ingest stage: ``run_id``, ``status``, ``rows_force``, ``rows_motion``.
    `same_table`: run_ids of runs with force and motion in the same lines of one file, which are counted once.
    `expected`: run_ids that must be in the ledger.
    """
    absent = sorted(set(expected) - set(book["run_id"]))
    if absent:
        raise RftfitError(f"{len(absent)} runs are not in the ledger, first {absent[0]}: {_FAULT}")
    read = runs[runs["status"] == "read"].drop_duplicates("run_id").set_index("run_id")
    # lost samples are no lines of any file
    lines = book[book["fate"] != LOST]
    counted = lines.groupby("run_id")["rows"].sum().reindex(read.index)
    twice = read.index.isin(list(same_table)) & (read["rows_force"] == read["rows_motion"])
    rows_read = read["rows_force"] + read["rows_motion"].mask(twice, 0)
    wrong = counted[counted != rows_read]
    if not wrong.empty:
        name = wrong.index[0]
        raise RftfitError(
            f"the ledger does not add up in {len(wrong)} runs, first {name}: {counted[name]} rows "
            f"counted, {rows_read[name]} in the logs: {_FAULT}"
        )


USED_AS = {
    "plate": "slope",
    "leg": "leg-curve",
    "rod": "tare",
    "leg_air": "tare",
    "robot": "mean-speed",
}
"""Main use of the rows of each kind of run, as a code of the ledger."""


def runs_with_result(ledger: pd.DataFrame) -> set[str]:
    """Return the run_ids in a table of a ledger that have rows used as `USED_AS` says: in a slope, a leg curve, ..."""
    is_main_use = ledger["reason_code"] == ledger["kind"].map(USED_AS)
    return {*ledger.loc[(ledger["fate"] == USED) & is_main_use & (ledger["rows"] > 0), "run_id"]}
