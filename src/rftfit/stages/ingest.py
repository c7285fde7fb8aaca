"""Stage 1: the logs of one medium to traces in the lab frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.clock import HOUR_S
from rftfit.measure.ingest import PHASES, RunRefused, Trace, ingest_run
from rftfit.measure.ledger import Ledger
from rftfit.measure.pair import load_pairs
from rftfit.measure.rigid import find_compliance
from rftfit.store import write_csv, write_parquet

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run


def ingest(config: Path, medium: str, traces: Path, runs: Path, ledger: Path) -> None:
    """Read all logs of a medium.

    Parameters
    ----------
    config : Path
        The campaign's configuration.
    medium : str
    traces, runs, ledger : Path
        Written: samples (Parquet), one row per run, and counts of rows (csv).

    Raises
    ------
    RftfitError
        If the campaign is not valid or a result cannot be written.
    """
    campaign = load_campaign(config, medium)
    samples, table, book = ingest_medium(campaign, medium)
    write_parquet(samples, traces)
    write_csv(table, runs)
    write_csv(book.table(), ledger)


def ingest_medium(campaign: Campaign, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Read all logs of a medium, keeping what is wrong with the bad ones.

    Parameters
    ----------
    campaign : Campaign
    medium : str

    Returns
    -------
    samples : pandas.DataFrame
        One row per force sample (docs/architecture.md).
    runs : pandas.DataFrame
        One row per run: status, reason, flags, clock and zero.
    ledger : Ledger
        Everything but the good rows of the strokes.
    """
    import pandas as pd

    good, rows, ledger = ingest_traces(campaign, medium)
    return samples_of(good), pd.DataFrame(rows), ledger


def ingest_traces(
    campaign: Campaign, medium: str
) -> tuple[list[Trace], list[dict[str, object]], Ledger]:
    """Read all logs of a medium and keep what clocks and surface were estimated from.

    Parameters
    ----------
    campaign : Campaign
    medium : str

    Returns
    -------
    traces : list of Trace
        Of the runs that could be read.
    rows : list of dict
        One for each run of the medium, see `ingest_medium`.
    ledger : Ledger
        Everything but the good rows of the strokes.
    """
    ledger = Ledger()
    good: list[Trace] = []
    rows: list[dict[str, object]] = []
    config = campaign.config
    runs = campaign.runs_of(medium)
    compliance = find_compliance(campaign, runs[0]) if config.rigid_contact and runs else None
    for run, pair in load_pairs(campaign, runs):
        try:
            trace = ingest_run(config, run, pair, ledger, compliance)
        except RunRefused as refusal:
            rows.append(_row(config, run, reason=str(refusal)))
        else:
            good.append(trace)
            rows.append(_row(config, run, trace))
    return good, rows, ledger


def _row(
    config: Config, run: Run, trace: Trace | None = None, reason: str = ""
) -> dict[str, object]:
    known = trace is not None
    step = trace.step_s if trace else np.nan
    row: dict[str, object] = {
        "run_id": run.run_id,
        "kind": run.kind,
        "status": "read" if known else "refused",
        "reason": reason,
        "flags": "; ".join(trace.flags) if trace else "",
        "note": trace.note if trace else "",
        "rows_force": trace.rows[0] if trace else 0,
        "rows_motion": trace.rows[1] if trace else 0,
        "sample_step_s": step,
        "clock_offset_s": trace.clock.offset_s if trace else np.nan,
        "clock_residual_s": trace.clock.residual_s if trace else np.nan,
        "clock_se_s": trace.clock.offset_se(step) if trace else np.nan,
        "zero_var_z_N2": trace.zero_variance[0] if trace else np.nan,
        "zero_var_x_N2": trace.zero_variance[1] if trace else np.nan,
        "zero_dof": trace.zero_dof if trace else np.nan,
    }
    # campaigns that do not ask for these keep their table as it was
    if config.clock.method == "estimate":
        found = trace.alignment if trace else None
        # in a table of six digits hours would hide the rest
        hours = trace.clock.whole_hours if trace else 0
        row["clock_hours"] = hours if trace else np.nan
        row["clock_rest_s"] = trace.clock.offset_s - HOUR_S * hours if trace else np.nan
        row["clock_drift"] = found.drift if found else np.nan
        row["clock_drift_se"] = found.drift_se if found else np.nan
        row["clock_explained"] = found.explained if found else np.nan
    if config.surface.method == "find":
        surface = trace.surface if trace else None
        row["surface_z_mm"] = config.arm.surface_z_mm - 10 * surface.depth_cm if surface else np.nan
        row["surface_se_mm"] = 10 * surface.se_cm if surface else np.nan
        row["surface_growth_N_per_cm"] = surface.growth_N_per_cm if surface else np.nan
    return row


def samples_of(traces: list[Trace]) -> pd.DataFrame:
    """Put the samples of all runs into one long table.

    Parameters
    ----------
    traces : list of Trace

    Returns
    -------
    pandas.DataFrame
        Names as categories, so that a million rows stay small.
    """
    import pandas as pd

    def joined(parts: list[np.ndarray]) -> np.ndarray:
        return np.concatenate(parts) if parts else np.empty(0)

    sizes = [trace.time.size for trace in traces]
    names = [trace.run.run_id for trace in traces]
    return pd.DataFrame(
        {
            "run_id": pd.Categorical.from_codes(
                np.repeat(np.arange(len(traces)), sizes), categories=pd.Index(names)
            ),
            "time_s": joined([trace.time for trace in traces]),
            "phase": pd.Categorical.from_codes(
                joined([trace.phase for trace in traces]).astype(int), categories=pd.Index(PHASES)
            ),
            "x_cm": joined([trace.x for trace in traces]),
            "depth_cm": joined([-trace.z for trace in traces]),
            "angle_deg": joined([np.degrees(trace.angle) for trace in traces]),
            "force_z_N": joined([trace.force[0] for trace in traces]),
            "force_x_N": joined([trace.force[1] for trace in traces]),
            "why": joined([trace.why for trace in traces]),
        },
        copy=False,  # these arrays are nobody else's
    )
