"""Stage 1: the logs of one medium to traces in the lab frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.ingest import PHASES, RunRefused, Trace, ingest_run
from rftfit.measure.ledger import Ledger
from rftfit.measure.pair import load_pairs
from rftfit.store import write_csv, write_parquet

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

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
    campaign = load_campaign(config)
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

    ledger = Ledger()
    good: list[Trace] = []
    rows: list[dict[str, object]] = []
    for run, pair in load_pairs(campaign, campaign.runs_of(medium)):
        try:
            trace = ingest_run(campaign.config, run, pair, ledger)
        except RunRefused as refusal:
            rows.append(_row(run, reason=str(refusal)))
        else:
            good.append(trace)
            rows.append(_row(run, trace))
    return _samples(good), pd.DataFrame(rows), ledger


def _row(run: Run, trace: Trace | None = None, reason: str = "") -> dict[str, object]:
    known = trace is not None
    step = trace.step_s if trace else np.nan
    return {
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


def _samples(traces: list[Trace]) -> pd.DataFrame:
    """One long table; names as categories, so that a million rows stay small."""
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
        }
    )
