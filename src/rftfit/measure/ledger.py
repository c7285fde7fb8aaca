"""Why a row of a log is not used, and the ledger that accounts for every row."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Self

import numpy as np

from rftfit.errors import RftfitError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    import pandas as pd

    from rftfit.campaign.sheet import Run


class RowStatus(IntEnum):
    """Why a row must not be used, and its text in the ledger; small enough to be kept for every sample."""

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Make a member of its number and its text."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member

    GOOD = 0, ""
    MOTION_GAP = 1, "gap in the motion log"
    NO_MOTION = 2, "outside the motion log"
    SATURATED = 3, "transducer saturated"
    NO_TARE = 4, "outside the tare's range"
    APPROACH = 5, "approach"
    PAUSE = 6, "pause at the surface"
    ELSEWHERE = 7, "before or after the stroke"
    ABOVE = 8, "outside the window: plate not wholly submerged"
    BOTTOM = 9, "outside the window: too near the bottom"
    WALL = 10, "outside the window: too near a wall"
    STARTUP = 11, "outside the window: start of the stroke, force still building up"
    NONLINEAR = 12, "outside the window: beyond the linear regime"
    YIELDED = 13, "force beyond that of the push against something rigid: depth not known"
    TOO_DEEP = 14, "outside the window: deeper than fit.max_depth_cm of the config"
    TOO_SHALLOW = 15, "outside the window: above fit.submergence_cm of the config"


USED, DROPPED, LOST = "used", "dropped", "lost"
COLUMNS = ["run_id", "medium", "kind", "file", "fate", "reason", "rows"]
_FAULT = "this is a fault of the program, please report it"


@dataclass
class Ledger:
    """Number of rows by run_id, medium, kind, file, fate and reason."""

    counts: dict[tuple[str, str, str, str, str, str], int] = field(
        default_factory=lambda: defaultdict(int)
    )

    def add(self, run: Run, file: str, fate: str, reason: str, rows: int) -> None:
        """Count `rows` lines of one file, 0 of a missing one; `LOST`: the instrument alone counted them."""
        self.counts[run.run_id, run.medium, run.kind, file, fate, reason] += int(rows)

    def add_rows(self, run: Run, why: np.ndarray, used_as: str) -> None:
        """Count the rows of a force log by the `RowStatus` of each; `used_as` is the use of good rows."""
        for code, count in enumerate(np.bincount(why)):
            if count:
                status = RowStatus(code)
                fate = USED if status is RowStatus.GOOD else DROPPED
                self.add(run, run.force_log, fate, status.text or used_as, count)

    def table(self) -> pd.DataFrame:
        """Return the counts as a sorted table with the columns `COLUMNS`."""
        import pandas as pd

        rows = [(*key, count) for key, count in sorted(self.counts.items())]
        return pd.DataFrame(rows, columns=COLUMNS)


def join(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Join ledgers; a run in air that serves several media is read for each but counted once."""
    import pandas as pd

    book = pd.concat([part.fillna({"medium": ""}) for part in parts], ignore_index=True)
    in_air = book["kind"] == "leg_air"
    once = pd.concat([book[~in_air], book[in_air].drop_duplicates()])
    return once.sort_values(COLUMNS).reset_index(drop=True)[COLUMNS]


def check(
    book: pd.DataFrame,
    runs: pd.DataFrame,
    one_table: Collection[str] = (),
    expected: Iterable[str] = (),
) -> None:
    """Compare the ledger with the run sheet, and with the number of rows in each log that was read.

    `runs`: Table of the ingest stage. `one_table`: Runs with force and motion in one table, where
    lines that hold both are counted once. `expected`: Runs that must be in the ledger.
    """
    absent = sorted(set(expected) - set(book["run_id"]))
    if absent:
        raise RftfitError(f"{len(absent)} runs are not in the ledger, first {absent[0]}: {_FAULT}")
    read = runs[runs["status"] == "read"].drop_duplicates("run_id").set_index("run_id")
    # lost samples are no lines of any file
    lines = book[book["fate"] != LOST]
    counted = lines.groupby("run_id")["rows"].sum().reindex(read.index)
    twice = read.index.isin(list(one_table)) & (read["rows_force"] == read["rows_motion"])
    wanted = read["rows_force"] + read["rows_motion"].mask(twice, 0)
    wrong = counted[counted != wanted]
    if not wrong.empty:
        name = wrong.index[0]
        raise RftfitError(
            f"the ledger does not add up in {len(wrong)} runs, first {name}: {counted[name]} rows "
            f"counted, {wanted[name]} in the logs: {_FAULT}"
        )
