"""Stage 3: zero-intercept slopes of one medium, and its alpha table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import Row, alpha_table
from rftfit.measure.fits import COMPONENTS, Fit, Stroke, filed_under, fit_run
from rftfit.measure.ledger import DROPPED, USED, Ledger
from rftfit.measure.rows import Why
from rftfit.measure.strokes import split_runs
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.store import read_csv, read_parquet, write_csv, write_parquet

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run


def slopes(
    config: Path, medium: str, runs: Path, tared: Path, tares: Path,
    fits: Path, alpha: Path, windows: Path, ledger: Path,
) -> None:  # fmt: skip
    """Fit every plate run of a medium and combine the fits into its alpha table.

    Parameters
    ----------
    config : Path
    medium : str
    runs, tared, tares : Path
        Read: from the ingest and tare stages.
    fits, alpha, windows, ledger : Path
        Written: one row per plate run, one per cell of the grid, why each sample was fitted or
        not (Parquet, the rows of `tared`), counts of rows.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config, medium)
    table, why, book = fit_medium(
        campaign, medium, read_csv(runs), read_parquet(tared), read_csv(tares)
    )
    fit = campaign.config.fit
    write_csv(table, fits)
    depths = len(fit.horizontal_depths_cm)
    cells = alpha_table(table, medium, fit.confidence, depths, fit.run_to_run_N_per_cm3)
    write_csv(cells, alpha)
    write_parquet(why, windows)
    write_csv(book.table(), ledger)


def fit_medium(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame, tares: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Fit every plate run of a medium.

    Parameters
    ----------
    campaign : Campaign
    medium : str
    status, tared, tares : pandas.DataFrame
        From the ingest and tare stages.

    Returns
    -------
    fits : pandas.DataFrame
        One row per plate run of the sheet, also of those that give no alpha.
    windows : pandas.DataFrame
        `run_id, why`: the rows of `tared`, `Why` a sample was not fitted.
    ledger : Ledger
        The rows of the strokes that were handed on.
    """
    import pandas as pd

    ledger = Ledger()
    where = split_runs(tared)
    columns = {name: tared[name].to_numpy() for name in ("depth_cm", "x_cm", "path_cm", "why")}
    force = tared[["force_z_N", "force_x_N"]].to_numpy().T
    facts: dict[str, Row] = {row["run_id"]: row for row in status.to_dict("records")}
    no_tare = dict(zip(tares["run_id"], tares["reason"], strict=True))
    confidence = campaign.config.fit.confidence
    rows = []
    plates = {run.intruder for run in campaign.runs_of(medium) if run.kind == "plate"}
    why = columns["why"].copy()
    for run in campaign.runs_of(medium):
        if run.kind != "plate":
            continue
        fact = facts[run.run_id]
        flags = tuple(filter(None, str(fact["flags"]).split("; ")))
        if not run.tare_run and run.run_id in where:
            flags += (NO_TARE_FLAG,)
        if len(plates) > 1:
            flags += (f"{run.intruder}, one of {len(plates)} plates in this medium",)
        if run.run_id not in where:
            reason = str(fact["reason"]) or no_tare.get(run.run_id, "")
            beta, gamma, _ = filed_under(run)
            lost = Fit(beta, gamma, flags=flags, reason=reason)
            rows.append(_row(run, lost, confidence) | {"note": fact["note"]})
            continue
        part = where[run.run_id]
        stroke = _stroke(columns, force, part, fact, facts.get(run.tare_run), flags)
        fit = fit_run(run, stroke, campaign.config)
        why[part] = fit.why
        # rows dropped by an earlier stage are in that stage's ledger already
        handed_on = fit.why[stroke.why == Why.GOOD]
        ledger.add_rows(run, run.force_log, handed_on[handed_on != Why.GOOD], "")
        fate = (DROPPED, f"no alpha: {fit.reason}") if fit.reason else (USED, "slope")
        good = int(np.count_nonzero(handed_on == Why.GOOD))
        if good:
            ledger.add(run, run.force_log, *fate, good)
        rows.append(_row(run, fit, confidence) | {"note": fact["note"]})
    windows = pd.DataFrame({"run_id": tared["run_id"], "why": why})
    return pd.DataFrame(rows, columns=_row_names()), windows, ledger


def _stroke(
    columns: dict[str, np.ndarray], force: np.ndarray, part: slice,
    run: Row, tare: Row | None, flags: tuple[str, ...],
) -> Stroke:  # fmt: skip
    """Put together what the fit of one run needs."""
    depth = columns["depth_cm"][part]
    pair = (run,) if tare is None else (run, tare)
    # depth changes in a stroke at this speed; an error of the clocks shifts it by speed x error
    seconds = depth.size * float(run["sample_step_s"])
    speed = float(np.ptp(depth)) / seconds
    return Stroke(
        depth, columns["x_cm"][part], columns["path_cm"][part], force[:, part],
        columns["why"][part],
        np.array([[fact["zero_var_z_N2"], fact["zero_var_x_N2"]] for fact in pair], dtype=float),
        np.array([[fact["zero_dof"]] * 2 for fact in pair], dtype=float),
        # so does an error of the surface, where that had to be found
        math.hypot(speed * float(run["clock_se_s"]), float(run.get("surface_se_mm", 0.0)) / 10),
        flags,
    )  # fmt: skip


def _names_of(c: str) -> list[str]:
    """Columns of one component, in the order of `_row`'s values."""
    return [f"alpha_{c}_N_per_cm3", f"alpha_{c}_se_N_per_cm3", f"alpha_{c}_lo_N_per_cm3",
            f"alpha_{c}_hi_N_per_cm3", f"alpha_{c}_dof", f"alpha_{c}_ols_se_N_per_cm3",
            f"alpha_{c}_startup_N_per_cm3", f"intercept_{c}_N_per_cm2",
            f"free_slope_{c}_N_per_cm3", f"nonlinear_{c}_p", f"nonlinear_{c}_ratio"]  # fmt: skip


def _row_names() -> list[str]:
    names = ["run_id", "medium", "beta_deg", "gamma_deg", "direction", "tare_run",
             "depth_from_cm", "depth_to_cm", "n_points"]  # fmt: skip
    return [*names, *(name for c in COMPONENTS for name in _names_of(c)), "flags", "note", "reason"]


def _row(run: Run, fit: Fit, confidence: float) -> dict[str, object]:
    row: dict[str, object] = dict.fromkeys(_row_names(), np.nan)
    row |= {
        "run_id": run.run_id, "medium": run.medium, "beta_deg": fit.beta_deg,
        "gamma_deg": fit.gamma_deg, "direction": run.direction, "tare_run": run.tare_run,
        "depth_from_cm": fit.depth_from_cm, "depth_to_cm": fit.depth_to_cm, "n_points": 0,
        "flags": "; ".join(fit.flags), "reason": fit.reason,
    }  # fmt: skip
    slope = fit.slope
    if slope is None:
        return row
    row["n_points"] = slope.points
    lo, hi = slope.interval(confidence)
    for i, c in enumerate(COMPONENTS):
        values = (slope.alpha, slope.se, lo, hi, slope.dof, slope.ols_se, slope.startup,
                  slope.intercept, slope.free_slope, slope.nonlinear_p, slope.nonlinear_ratio)  # fmt: skip
        row |= {name: value[i] for name, value in zip(_names_of(c), values, strict=True)}
    return row
