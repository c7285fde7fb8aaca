"""Stage 2: subtract rod-only runs at equal depth and in-air runs at equal theta."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.ledger import DROPPED, USED, Ledger
from rftfit.measure.rows import Why
from rftfit.measure.strokes import abscissa_of, strokes
from rftfit.measure.tare import Tare, TareError, subtract
from rftfit.store import read_csv, read_parquet, write_csv, write_parquet

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run
from rftfit.measure.strokes import Samples

TARE_KINDS = ("rod", "leg_air")


def tare(
    config: Path, medium: str, traces: Path, runs: Path, tared: Path, tares: Path, ledger: Path
) -> None:
    """Subtract the tare of every plate and leg run of a medium.

    Parameters
    ----------
    config : Path
    medium : str
    traces, runs : Path
        Read: from the ingest stage.
    tared, tares, ledger : Path
        Written: granular forces (Parquet), one row per subtraction, counts of rows (csv).

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config, medium)
    samples, table, book = tare_medium(campaign, medium, read_parquet(traces), read_csv(runs))
    write_parquet(samples, tared)
    write_csv(table, tares)
    write_csv(book.table(), ledger)


def tare_medium(
    campaign: Campaign, medium: str, traces: pd.DataFrame, status: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Subtract the tares of one medium.

    Parameters
    ----------
    campaign : Campaign
    medium : str
    traces, status : pandas.DataFrame
        From the ingest stage.

    Returns
    -------
    samples : pandas.DataFrame
        One row per sample of a stroke: granular force and tare.
    tares : pandas.DataFrame
        One row per plate or leg run: its tare, valid range, and why there is none.
    ledger : Ledger
        Rows of the tare runs, and of runs that have no tare.
    """
    import pandas as pd

    ledger = Ledger()
    found = strokes(traces)
    why_refused = dict(zip(status["run_id"], status["reason"], strict=True))
    runs = {run.run_id: run for run in campaign.runs_of(medium)}
    objects = {
        name: _tare(runs[name], stroke, ledger)
        for name, stroke in found.items()
        if runs[name].kind in TARE_KINDS
    }
    parts, rows = [], []
    for name, stroke in found.items():
        run = runs[name]
        if run.kind in TARE_KINDS:
            continue
        known = objects.get(run.tare_run)
        if not run.tare_run and campaign.config.fit.missing_tare == "flag":
            rows.append({"run_id": name, "tare_run": "", "abscissa": abscissa_of(run),
                         "valid_from": np.nan, "valid_to": np.nan, "reason": ""})  # fmt: skip
            parts.append((name, _untared(stroke)))
            continue
        row = {"run_id": name, "tare_run": run.tare_run, "abscissa": abscissa_of(run),
               "valid_from": np.nan, "valid_to": np.nan, "reason": ""}  # fmt: skip
        if isinstance(known, Tare):
            row |= {"valid_from": known.valid_from, "valid_to": known.valid_to}
            parts.append((name, _subtract(run, stroke, known, ledger)))
        else:
            row["reason"] = reason = _why_no_tare(run, known, why_refused)
            good = int(np.count_nonzero(stroke.why == Why.GOOD))
            ledger.add(run, run.force_log, DROPPED, reason, good)
        rows.append(row)
    columns = ["run_id", "tare_run", "abscissa", "valid_from", "valid_to", "reason"]
    return _table(parts), pd.DataFrame(rows, columns=columns), ledger


def _tare(run: Run, stroke: Samples, ledger: Ledger) -> Tare | TareError:
    good = stroke.why == Why.GOOD
    ledger.add(run, run.force_log, USED, "tare", int(np.count_nonzero(good)))
    abscissa = abscissa_of(run)
    try:
        return Tare.from_samples(
            run.run_id, abscissa, stroke.position(abscissa)[good], stroke.force[:, good]
        )
    except TareError as error:
        return error


def _why_no_tare(run: Run, known: TareError | None, why_refused: dict[str, str]) -> str:
    if not run.tare_run:
        return "no tare: the run sheet names none"
    if known is not None:
        return f"no tare: {known}"
    why = why_refused.get(run.tare_run) or "it has no stroke"
    return f"no tare: {run.tare_run} cannot be used: {why}"


def _untared(stroke: Samples) -> dict[str, np.ndarray]:
    """Force of a stroke as it is, for campaigns that say so."""
    nothing = np.zeros(stroke.depth.size)
    return {
        "depth_cm": stroke.depth, "x_cm": stroke.x, "path_cm": stroke.path,
        "angle_deg": stroke.angle_deg, "force_z_N": stroke.force[0], "force_x_N": stroke.force[1],
        "tare_z_N": nothing, "tare_x_N": nothing, "why": stroke.why,
    }  # fmt: skip


def _subtract(
    run: Run, stroke: Samples, tare_object: Tare, ledger: Ledger
) -> dict[str, np.ndarray]:
    """Granular force of a stroke; rows the tare does not cover are marked and counted."""
    position = stroke.position(tare_object.abscissa)
    granular, tare_force, known = subtract(position, stroke.force, tare_object)
    untared = (stroke.why == Why.GOOD) & ~known
    why = np.where(untared, np.int8(Why.NO_TARE), stroke.why)
    ledger.add_rows(run, run.force_log, why[untared], "")
    return {
        "depth_cm": stroke.depth, "x_cm": stroke.x, "path_cm": stroke.path,
        "angle_deg": stroke.angle_deg, "force_z_N": granular[0], "force_x_N": granular[1],
        "tare_z_N": tare_force[0], "tare_x_N": tare_force[1], "why": why,
    }  # fmt: skip


def _table(parts: list[tuple[str, dict[str, np.ndarray]]]) -> pd.DataFrame:
    import pandas as pd

    names = [name for name, _ in parts]
    sizes = [columns["why"].size for _, columns in parts]
    codes = np.repeat(np.arange(len(parts)), sizes)
    data: dict[str, object] = {
        "run_id": pd.Categorical.from_codes(codes, categories=pd.Index(names))
    }
    for column in ("depth_cm", "x_cm", "path_cm", "angle_deg", "force_z_N", "force_x_N",
                   "tare_z_N", "tare_x_N", "why"):  # fmt: skip
        data[column] = np.concatenate([part[column] for _, part in parts]) if parts else []
    return pd.DataFrame(data, copy=False)  # these arrays are nobody else's
