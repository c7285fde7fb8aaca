"""Runs of one medium in a watch: measured once, and kept until one of their files or rows of the run sheet changes.

They are measured by the functions of the stages of a run (ingest, tare, slopes), some runs at a time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.checks.verdict import Verdict
from rftfit.forces.planning import Plan
from rftfit.logs.base import NO_HANDLE
from rftfit.measure.fits import FIT_COLUMNS, Row, fit_medium
from rftfit.measure.flags import Remark, flag_table, format_remarks, has, reason_of
from rftfit.measure.ingest import RUN_COLUMNS, ingest_medium
from rftfit.measure.samples import join_runs, split_runs
from rftfit.measure.session_clocks import SessionClocks
from rftfit.measure.tare import TARE_COLUMNS, tare_medium
from rftfit.model.maps import Map
from rftfit.results import Results
from rftfit.workflow.measure import FLAGGING

_TABLE_COLUMNS = {"runs": [*RUN_COLUMNS], "tares": TARE_COLUMNS, "fits": FIT_COLUMNS}
"""Tables with at most one row for each run, and their columns: reading of the logs, tare, fit with alpha."""


class MeasuredRun(NamedTuple):
    """Results of one run.

    `rows`: Its row in each table of `_TABLE_COLUMNS` that has one, by name of the table.
    `tared`: Columns of its samples on the stroke, the way through the medium, tare subtracted: as ``depth_cm``,
        ``force_z_N``, shape (samples,) each. ``why`` is the `RowStatus` of each sample (0: good) after the tare stage,
        ``window`` that after the fit: 0 where alpha is fitted.
    `flags`: Flags (doubts) by the stage that found them, one of `FLAGGING`.
    """

    rows: dict[str, Row]
    tared: dict[str, np.ndarray]
    flags: dict[str, list[Remark]]

    @property
    def is_read(self) -> bool:
        """True if its logs could be used."""
        return bool(self.rows["runs"]["status"] == "read")

    @property
    def lacked_handle(self) -> bool:
        """True if its logs could not be read only because the machine had too many open files: it is tried again."""
        # a code of a remark is written with - in tables
        return has(self.rows["runs"], NO_HANDLE.replace("_", "-"))

    @property
    def doubts(self) -> list[str]:
        """Sentences of its flags."""
        return [str(flag) for flags in self.flags.values() for flag in flags]

    @property
    def why(self) -> str:
        """Reason why it has no number, in words; empty if it has one. That of the fit is the last word, if there is one."""
        reasons = (
            reason_of(self.rows[name]) for name in ("fits", "runs", "tares") if name in self.rows
        )
        return format_remarks(next(filter(None, reasons), ()))


@dataclass
class LiveMedium:
    """One medium at this moment.

    `runs`: Measured runs by run_id.
    `keys`: By run_id the inputs from which it was measured (cells of its row, stamps of its files, both of its tare, number
        of plates in the medium, clocks), to see whether they changed.
    `alpha`, `checks`: Tables as `rftfit run` writes them; empty before the first check.
    `verdict`: None before the first check.
    `map`: None while no push has alpha.
    `plan`: Next pushes; None if the target has no number in this medium.
    `width`, `before`: Half width of the interval of the target, percent, now and before the last push; NaN: none.
    `last`: run_id of the plate run that was measured last; empty: none. That was at `measured_at` (s since 1970),
        `seconds` after its files changed; NaN if it was there when the watch began.
    """

    name: str
    runs: dict[str, MeasuredRun] = field(default_factory=dict)
    keys: dict[str, Any] = field(default_factory=dict)
    alpha: pd.DataFrame = field(default_factory=pd.DataFrame)
    checks: pd.DataFrame = field(default_factory=pd.DataFrame)
    verdict: Verdict | None = None
    map: Map | None = None
    plan: Plan | None = None
    width: float = np.nan
    before: float = np.nan
    last: str = ""
    measured_at: float = 0.0
    seconds: float = np.nan


def measure(
    campaign: Campaign,
    medium: str,
    run_ids: Collection[str],
    moving: Collection[str],
    clocks: SessionClocks | None,
) -> Iterator[tuple[str, MeasuredRun]]:
    """Measure some runs of a medium, and yield each with its run_id; runs are measured in batches, which limits memory.

    `run_ids`: Runs to measure. `moving`: Runs whose files still change; such a tare counts as missing. `clocks`: Clocks of
    the sessions; None: logs have one clock.
    """
    runs_of_medium, ids_to_measure = campaign.runs_of(medium), [*run_ids]
    tare_of = {run.run_id: run.tare_run for run in runs_of_medium}
    at_a_time = 256
    for first in range(0, len(ids_to_measure), at_a_time):
        batch = ids_to_measure[first : first + at_a_time]
        tares_of_batch = {tare_of[run_id] for run_id in batch}.difference(["", *moving])
        runs = tuple(run for run in runs_of_medium if run.run_id in tares_of_batch.union(batch))
        batch_campaign = replace(campaign, runs=runs)
        # each table goes through the form of its csv file, so that numbers are those of `rftfit run`
        results = Results(batch_campaign)
        # books: the ledger of each stage with its flags
        samples, status, book_of_ingest = ingest_medium(batch_campaign, medium, clocks)
        status = results.hold_as_csv(f"runs/{medium}.csv", status)
        tared, tares, book_of_tare = tare_medium(batch_campaign, medium, samples, status)
        tares = results.hold_as_csv(f"tares/{medium}.csv", tares)
        fits, windows, book_of_slopes = fit_medium(
            campaign, medium, status, tared, tares, only=batch
        )
        fits = results.hold_as_csv(f"fits/{medium}.csv", fits)
        tables = dict(zip(_TABLE_COLUMNS, (status, tares, fits), strict=True))
        rows_by_run: defaultdict[str, dict[str, Row]] = defaultdict(dict)
        for table_name, table in tables.items():
            for row in table.to_dict("records"):
                rows_by_run[str(row["run_id"])][table_name] = row
        samples_of_run = split_runs(tared)
        strokes = tared.assign(window=windows["why"]).drop(columns="run_id")
        books = dict(zip(FLAGGING, (book_of_ingest, book_of_tare, book_of_slopes), strict=True))
        for run_id in batch:
            flags = {
                stage: [flag for flag in book.flags if flag.run_id == run_id]
                for stage, book in books.items()
            }
            stroke = strokes.iloc[samples_of_run.get(run_id, slice(0))]
            tared_columns = {str(key): values.to_numpy().copy() for key, values in stroke.items()}
            yield run_id, MeasuredRun(rows_by_run[run_id], tared_columns, flags)


def hold(results: Results, medium: LiveMedium, runs: Collection[Run]) -> None:
    """Put the tables of measured runs into `results`, as if `rftfit run` had written them, for the stage ``checks``.

    `runs`: Runs of the medium, all measured.
    """
    measured_runs = {run.run_id: medium.runs[run.run_id] for run in runs}
    for name, columns in _TABLE_COLUMNS.items():
        rows = [run.rows[name] for run in measured_runs.values() if name in run.rows]
        results.hold_as_csv(f"{name}/{medium.name}.csv", pd.DataFrame(rows, columns=columns))
    for stage in FLAGGING:
        flags = [flag for run in measured_runs.values() for flag in run.flags[stage]]
        table = flag_table(medium.name, stage, flags)
        results.hold_as_csv(f"flags/{stage}/{medium.name}.csv", table)
    strokes = {run_id: run.tared for run_id, run in measured_runs.items() if run.tared["why"].size}
    tared = join_runs(strokes, [*next(iter(measured_runs.values())).tared])
    windows = tared[["run_id"]].assign(why=tared["window"])
    results.hold(f"tared/{medium.name}.parquet", tared.drop(columns="window"))
    results.hold(f"windows/{medium.name}.parquet", windows)
