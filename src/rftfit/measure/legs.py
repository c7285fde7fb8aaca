"""Force on turning legs: tared force against theta, on a regular grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.ledger import USED, Ledger, RowStatus
from rftfit.measure.strokes import split_runs
from rftfit.measure.tare import NO_TARE_FLAG

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.load import Campaign

STEP_DEG = 1.0
LEG_COLUMNS = ["medium", "leg", "run_id", "theta_deg", "force_z_N", "force_x_N", "samples",
               "zero_se_z_N", "zero_se_x_N", "flags", "checks"]  # fmt: skip


def leg_curves(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame
) -> tuple[pd.DataFrame, Ledger]:
    """Average the tared force of every leg run of a medium over steps of theta.

    `status` and `tared` are tables of the ingest and tare stages. The errors of the zero are the
    same along a curve.
    """
    import pandas as pd

    ledger = Ledger()
    where = split_runs(tared)
    facts = {row["run_id"]: row for row in status.to_dict("records")}
    curves = []
    for run in campaign.runs_of(medium):
        if run.kind != "leg" or run.run_id not in where:
            continue
        part = tared.iloc[where[run.run_id]]
        part = part[part["why"] == RowStatus.GOOD]
        ledger.add(run, run.force_log, USED, "leg curve", len(part))
        step = np.round(part["angle_deg"].to_numpy() / STEP_DEG).astype(int)
        grouped = part.groupby(step)[["force_z_N", "force_x_N"]]
        curve = grouped.mean()
        pair = [facts[name] for name in (run.run_id, run.tare_run) if name]
        curves.append(
            curve.assign(
                medium=medium,
                leg=run.intruder,
                run_id=run.run_id,
                theta_deg=curve.index * STEP_DEG,
                samples=grouped.size(),
                zero_se_z_N=np.sqrt(sum(fact["zero_var_z_N2"] for fact in pair)),
                zero_se_x_N=np.sqrt(sum(fact["zero_var_x_N2"] for fact in pair)),
                flags=NO_TARE_FLAG if campaign.holds_tare(run) else "",
                checks="",
            )
        )
    nothing = pd.DataFrame(columns=LEG_COLUMNS)
    return (pd.concat(curves, ignore_index=True) if curves else nothing)[LEG_COLUMNS], ledger
