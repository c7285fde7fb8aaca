"""Curves of turning legs: tared force against theta, on a regular grid, with which predicted forces are compared.

theta is the angle of a leg, from straight down to the line from axle to tip, degrees; forces are those of the medium on
the leg, z upward and x forward, N, without those in air.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.conventions import COMPONENTS
from rftfit.measure.flags import mark_columns, remark
from rftfit.measure.lab_frame import measured_channel
from rftfit.measure.ledger import USED, Ledger, RowStatus
from rftfit.measure.samples import split_runs
from rftfit.outputs.dictionary import columns_of

STEP_DEG = 1.0
"""Step of theta over which the force is averaged."""


def leg_curves(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame
) -> tuple[pd.DataFrame, Ledger]:
    """Average the tared force of every leg run of a medium over steps of theta.

    `status`: Table of runs, with ``run_id`` and the variances of their zeros, ``zero_var_{z,x}_N2``.
    `tared`: Samples of the strokes: ``run_id``, ``angle_deg`` (theta), ``force_{z,x}_N``, ``why`` (`RowStatus`).

    Returns a row for each run and step of theta (mean forces, number of samples, and the standard error of the zeros,
    which is the same along a curve), and the ledger of the used rows.
    """
    ledger = Ledger()
    rows_by_run = split_runs(tared)
    facts = {row["run_id"]: row for row in status.to_dict("records")}
    curves = []
    for run in campaign.runs_of(medium):
        if run.kind != "leg" or run.run_id not in rows_by_run:
            continue
        stroke_rows = tared.iloc[rows_by_run[run.run_id]]
        stroke_rows = stroke_rows[stroke_rows["why"] == RowStatus.GOOD]
        ledger.add(run, run.force_log, USED, len(stroke_rows), remark("leg-curve"))
        step = np.round(stroke_rows["angle_deg"].to_numpy() / STEP_DEG).astype(int)
        grouped = stroke_rows.groupby(step)[["force_z_N", "force_x_N"]]
        curve = grouped.mean().assign(samples=grouped.size())
        curve["theta_deg"] = curve.index * STEP_DEG
        # the zeros of the run and of its tare
        facts_of_zeros = [facts[name] for name in (run.run_id, run.tare_run) if name]
        for c in COMPONENTS:
            variance = sum(fact[f"zero_var_{c}_N2"] for fact in facts_of_zeros)
            curve[f"zero_se_{c}_N"] = math.sqrt(variance)
        if measured_channel(campaign.config, "x") is None:
            curve[["force_x_N", "zero_se_x_N"]] = math.nan
        curves.append(
            curve.assign(medium=medium, leg=run.intruder, run_id=run.run_id, **mark_columns())
        )
    columns = columns_of("legs/{medium}.csv")
    table = pd.concat(curves, ignore_index=True) if curves else pd.DataFrame(columns=columns)
    return table[columns], ledger
