"""Campaigns that are a table of stress or alpha instead of logs: the tables of samples and fits from its rows.

``campaign.numbers`` holds the rows of each run, arrays of shape (n,) by column. Of a table of stress: ``depth_cm``,
``stress_{z,x}_N_per_cm2``, and the masks ``other_sense`` and ``alone`` of rows that must not count. Of a table of
alpha, one row a run: ``alpha_{z,x}_N_per_cm3``, ``se_{z,x}`` (standard errors), ``n`` (number of runs whose mean it
is), ``depth_from_cm``, ``depth_to_cm``. The tables that are made have the columns of those from logs, so that later
stages need not know from where they come.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.measure.alpha import N_REPEATS, column
from rftfit.measure.fits import FIT_COLUMNS, RunFit, filed_under, make_fit_row
from rftfit.measure.flags import NO_DATA, dropped_rows, reason_columns, remark
from rftfit.measure.ingest import RUN_COLUMNS
from rftfit.measure.lab_frame import is_symmetric, readings_digest
from rftfit.measure.ledger import DROPPED, USED, Ledger, RowStatus
from rftfit.measure.samples import PHASES, samples_table
from rftfit.measure.slopes import GIVEN_DOF, student_quantile

_FEWEST_READINGS = 8
"""Fewest different stresses of a run by which copies are found: fewer, of two or three digits, may agree by chance."""


def ingest_table(campaign: Campaign, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Make the tables of `measure.ingest.ingest_medium` from a table: a sample for each row of stress, none for alpha.

    Forces of the samples are stresses: the plate of such runs has an area of 1 cm^2. Times are row numbers.
    """
    samples: dict[str, tuple[np.ndarray, ...]] = {}
    ledger = Ledger()
    rows = []
    for run in campaign.runs_of(medium):
        table = campaign.numbers[run.run_id]
        size = len(next(iter(table.values())))
        lines = size + run.rows_without_data
        row = RUN_COLUMNS | {
            "run_id": run.run_id,
            "kind": run.kind,
            "status": "read",
            "rows_force": lines,
            "rows_motion": lines,
            "sample_step_s": 1.0,
            # a table states forces without a zero, and depths without a clock
            "zero_var_z_N2": 0.0,
            "zero_var_x_N2": 0.0,
            "zero_dof": GIVEN_DOF,
            "clock_se_s": 0.0,
        }
        rows.append(row)
        if count := run.rows_without_data:
            ledger.flag(run, remark("no-data", count=count, file=run.force_log, why=NO_DATA))
            ledger.add(run, run.force_log, DROPPED, count, dropped_rows(NO_DATA))
        if run.excluded:
            reason = remark("excluded", why=run.reason)
            ledger.add(run, run.force_log, DROPPED, size, reason)
            row |= {"status": "refused"} | reason_columns([reason])
        if run.excluded or "depth_cm" not in table:
            continue
        stress = np.stack([table[f"stress_{c}_N_per_cm2"] for c in "zx"])
        if np.unique(stress[stress != 0]).size >= _FEWEST_READINGS:
            row["readings"] = readings_digest(np.vstack([table["depth_cm"], stress]))
        why = np.full(size, RowStatus.GOOD, dtype=np.int8)
        why[table["other_sense"]] = RowStatus.OTHER_SENSE
        why[table["alone"]] = RowStatus.ALONE
        for status in (RowStatus.OTHER_SENSE, RowStatus.ALONE):
            if n_rows := int(np.count_nonzero(why == status)):
                ledger.flag(run, remark(f"rows-{status.code}", count=n_rows))
                ledger.add(run, run.force_log, DROPPED, n_rows, remark(status.code))
        phase = np.where(why == RowStatus.GOOD, PHASES.index("stroke"), PHASES.index("other"))
        # in the order of `SAMPLE_COLUMNS`: time, phase, x, depth, angle, force
        samples[run.run_id] = (
            np.arange(size, dtype=float),
            phase,
            np.zeros(size),
            table["depth_cm"],
            np.full(size, run.beta_deg),
            *stress,
            why,
        )
    return samples_table(samples), pd.DataFrame(rows, columns=list(RUN_COLUMNS)), ledger


def fit_alpha_table(
    campaign: Campaign, medium: str, tared: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Make the tables of `measure.fits.fit_medium` from the slopes of a table of alpha.

    `tared`: Samples, of which there are none. The table of fits has the further column `N_REPEATS`.
    """
    ledger, level = Ledger(), campaign.config.fit.confidence
    rows = []
    for run in campaign.runs_of(medium):
        numbers = {name: float(values[0]) for name, values in campaign.numbers[run.run_id].items()}
        beta, gamma, _ = filed_under(run)
        excluded = [remark("excluded", why=run.reason)] if run.excluded else []
        window = numbers["depth_from_cm"], numbers["depth_to_cm"]
        fit = RunFit(beta, gamma, *window, reason=tuple(excluded))
        row = make_fit_row(run, fit, 0.0, campaign.config, note="")
        # the errors that the table states include that of the surface
        row |= {"mirrored": False, "lever_per_cm": 0.0, N_REPEATS: 1}
        rows.append(row)
        if excluded:
            continue
        if math.isnan(numbers["alpha_x_N_per_cm3"]):
            ledger.flag(run, remark("no-force-x"))
            if is_symmetric(run):
                numbers["alpha_x_N_per_cm3"] = 0.0
        runs = int(np.nan_to_num(numbers["n"]))
        row[N_REPEATS] = max(runs, 1)
        dof = runs - 1.0 if runs > 1 else GIVEN_DOF
        for c in "zx":
            alpha, se = numbers[f"alpha_{c}_N_per_cm3"], numbers[f"se_{c}"]
            half_interval = float(student_quantile(level, dof)) * se
            numbers_of_component = {
                "": alpha,
                "_se": se,
                "_lo": alpha - half_interval,
                "_hi": alpha + half_interval,
                **dict.fromkeys(("_startup", "_tare", "_curvature", "_rod"), 0.0),
            }
            row |= {column(c, name): number for name, number in numbers_of_component.items()}
            row[f"alpha_{c}_dof"] = dof
        ledger.add(run, run.force_log, USED, 1, remark("slope"))
    windows = tared[["run_id", "why"]]
    return pd.DataFrame(rows, columns=[*FIT_COLUMNS, N_REPEATS]), windows, ledger
