"""Every row of every log is accounted for: used, or dropped with a reason."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.runs import Run

USED, DROPPED = "used", "dropped"
COLUMNS = ["run_id", "medium", "kind", "file", "fate", "reason", "rows"]


@dataclass
class Ledger:
    """Counts of rows by run, file, fate and reason."""

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
            `USED` or `DROPPED`.
        reason : str
        rows : int
            0 is kept where a whole file is missing.
        """
        self.counts[run.run_id, run.medium, run.kind, file, fate, reason] += int(rows)

    def add_reasons(self, run: Run, file: str, reasons: np.ndarray, used_as: str) -> None:
        """Count the rows of one file by the reason each of them carries.

        Parameters
        ----------
        run : Run
        file : str
        reasons : numpy.ndarray of str, shape (n,)
            Empty where the row is used.
        used_as : str
            What the rows with an empty reason are used for.
        """
        names, counts = np.unique(reasons.astype(str), return_counts=True)
        for name, count in zip(names, counts, strict=True):
            fate = DROPPED if name else USED
            self.add(run, file, fate, str(name) or used_as, int(count))

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
