"""Leg rotation: tared force against theta, on a regular grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.ledger import USED, Ledger
from rftfit.measure.rows import Why
from rftfit.measure.strokes import split_runs
from rftfit.store import read_csv, read_parquet, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign

STEP_DEG = 1.0


def legs(config: Path, medium: str, runs: Path, tared: Path, curves: Path, ledger: Path) -> None:
    """Average the tared force of every leg run of a medium over steps of one degree.

    Parameters
    ----------
    config : Path
    medium : str
    runs, tared : Path
        Read: from the ingest and tare stages.
    curves, ledger : Path
        Written: force against theta, and counts of rows.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config, medium)
    table, book = leg_curves(campaign, medium, read_csv(runs), read_parquet(tared))
    write_csv(table, curves)
    write_csv(book.table(), ledger)


def leg_curves(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame
) -> tuple[pd.DataFrame, Ledger]:
    """Force on each leg of a medium against theta.

    Parameters
    ----------
    campaign : Campaign
    medium : str
    status, tared : pandas.DataFrame
        From the ingest and tare stages.

    Returns
    -------
    curves : pandas.DataFrame
        `medium, leg, run_id, theta_deg, force_z_N, force_x_N, samples, zero_se_z_N, zero_se_x_N`;
        the errors of the zero are the same along a curve.
    ledger : Ledger
    """
    import pandas as pd

    ledger = Ledger()
    where = split_runs(tared)
    facts = {row["run_id"]: row for row in status.to_dict("records")}
    parts = []
    for run in campaign.runs_of(medium):
        if run.kind != "leg" or run.run_id not in where:
            continue
        part = tared.iloc[where[run.run_id]]
        part = part[part["why"] == Why.GOOD]
        ledger.add(run, run.force_log, USED, "leg curve", len(part))
        step = np.round(part["angle_deg"].to_numpy() / STEP_DEG).astype(int)
        grouped = part.assign(step=step).groupby("step")[["force_z_N", "force_x_N"]]
        mean, count = grouped.mean(), grouped.size()
        pair = (facts[run.run_id], facts[run.tare_run])
        parts.append(
            pd.DataFrame(
                {
                    "medium": medium,
                    "leg": run.intruder,
                    "run_id": run.run_id,
                    "theta_deg": mean.index * STEP_DEG,
                    "force_z_N": mean["force_z_N"].to_numpy(),
                    "force_x_N": mean["force_x_N"].to_numpy(),
                    "samples": count.to_numpy(),
                    "zero_se_z_N": np.sqrt(sum(fact["zero_var_z_N2"] for fact in pair)),
                    "zero_se_x_N": np.sqrt(sum(fact["zero_var_x_N2"] for fact in pair)),
                }
            )
        )
    columns = ["medium", "leg", "run_id", "theta_deg", "force_z_N", "force_x_N", "samples",
               "zero_se_z_N", "zero_se_x_N"]  # fmt: skip
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=columns)
    return table, ledger
