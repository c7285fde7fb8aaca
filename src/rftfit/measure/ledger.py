"""Every row of every log is accounted for: used, or dropped with a reason."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.rows import Why

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.runs import Run

USED, DROPPED, LOST = "used", "dropped", "lost"
COLUMNS = ["run_id", "medium", "kind", "file", "fate", "reason", "rows"]


@dataclass
class Ledger:
    """Counts of rows by run, file, fate and reason.

    Attributes
    ----------
    counts : dict
        (run_id, medium, kind, file, fate, reason) to number of rows.
    """

    counts: dict[tuple[str, str, str, str, str, str], int] = field(
        default_factory=lambda: defaultdict(int)
    )

    def add(self, run: Run, file: str, fate: str, reason: str, rows: int) -> None:
        """Count `rows` lines of one file of a run.

        Parameters
        ----------
        run : Run
        file : str
            As in the run sheet.
        fate : str
            `USED`, `DROPPED`, or `LOST` for what the instrument counted and the file lacks.
        reason : str
        rows : int
            0 is kept where a whole file is missing.
        """
        self.counts[run.run_id, run.medium, run.kind, file, fate, reason] += int(rows)

    def add_rows(self, run: Run, file: str, why: np.ndarray, used_as: str) -> None:
        """Count the rows of one file by the reason each of them carries.

        Parameters
        ----------
        run : Run
        file : str
        why : numpy.ndarray of int, shape (n,)
            `Why` of each row.
        used_as : str
            What the good rows are used for.
        """
        for code, count in enumerate(np.bincount(why)):
            if count:
                good = code == Why.GOOD
                reason = used_as if good else Why(code).text
                self.add(run, file, USED if good else DROPPED, reason, int(count))

    def table(self) -> pd.DataFrame:
        """Return the counts as a table, sorted.

        Returns
        -------
        pandas.DataFrame
            Columns `COLUMNS`.
        """
        import pandas as pd

        rows = [(*key, count) for key, count in sorted(self.counts.items())]
        return pd.DataFrame(rows, columns=COLUMNS)
