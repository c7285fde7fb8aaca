"""Why a row of a log is not used, and the ledger that accounts for every row."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.sheet import Run


# --- Why a row of a log is not used: the same short list from the first stage to the ledger.


class Why(IntEnum):
    """Reason of one row, small enough to be kept for every sample; `GOOD` rows may be used."""

    GOOD = 0
    MOTION_GAP = 1
    NO_MOTION = 2
    SATURATED = 3
    NO_TARE = 4
    APPROACH = 5
    PAUSE = 6
    ELSEWHERE = 7
    ABOVE = 8
    BOTTOM = 9
    WALL = 10
    STARTUP = 11
    NONLINEAR = 12
    YIELDED = 13

    @property
    def text(self) -> str:
        """What the ledger says."""
        return _TEXT[self]


_TEXT = {
    Why.GOOD: "",
    Why.MOTION_GAP: "gap in the motion log",
    Why.NO_MOTION: "outside the motion log",
    Why.SATURATED: "transducer saturated",
    Why.NO_TARE: "outside the tare's range",
    Why.APPROACH: "approach",
    Why.PAUSE: "pause at the surface",
    Why.ELSEWHERE: "before or after the stroke",
    Why.ABOVE: "outside the window: plate not wholly submerged",
    Why.BOTTOM: "outside the window: too near the bottom",
    Why.WALL: "outside the window: too near a wall",
    Why.STARTUP: "outside the window: start of the stroke, force still building up",
    Why.NONLINEAR: "outside the window: beyond the linear regime",
    Why.YIELDED: "force beyond that of the push against something rigid: depth not known",
}


# --- Every row of every log is accounted for: used, or dropped with a reason.


USED, DROPPED, LOST = "used", "dropped", "lost"
COLUMNS = ["run_id", "medium", "kind", "file", "fate", "reason", "rows"]


@dataclass
class Ledger:
    """Counts of rows by run, file, fate and reason.

    `counts`: (run_id, medium, kind, file, fate, reason) to number of rows.
    """

    counts: dict[tuple[str, str, str, str, str, str], int] = field(
        default_factory=lambda: defaultdict(int)
    )

    def add(self, run: Run, file: str, fate: str, reason: str, rows: int) -> None:
        """Count `rows` lines of one file of a run.

        `file`: As in the run sheet. `fate`: `USED`, `DROPPED`, or `LOST` for what the instrument
        counted and the file lacks. `rows`: 0 is kept where a whole file is missing.
        """
        self.counts[run.run_id, run.medium, run.kind, file, fate, reason] += int(rows)

    def add_rows(self, run: Run, file: str, why: np.ndarray, used_as: str) -> None:
        """Count the rows of one file by the reason each of them carries.

        `why`: shape (n,); `Why` of each row. `used_as`: What the good rows are used for.
        """
        for code, count in enumerate(np.bincount(why)):
            if count:
                good = code == Why.GOOD
                reason = used_as if good else Why(code).text
                self.add(run, file, USED if good else DROPPED, reason, int(count))

    def table(self) -> pd.DataFrame:
        """Return the counts as a table, sorted.

        Returns columns `COLUMNS`.
        """
        import pandas as pd

        rows = [(*key, count) for key, count in sorted(self.counts.items())]
        return pd.DataFrame(rows, columns=COLUMNS)
