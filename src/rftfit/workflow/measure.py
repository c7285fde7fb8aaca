"""Stages of the measurement chain: ingest, tare, slopes, legs, ledger."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import RftfitError
from rftfit.logs.base import LogError
from rftfit.measure.alpha import Row, alpha_table
from rftfit.measure.clocks import HOUR_S
from rftfit.measure.fits import COMPONENTS, RunFit, Stroke, filed_under, fit_run
from rftfit.measure.ingest import PHASES, RunRefused, Trace, find_compliance, ingest_run
from rftfit.measure.ledger import COLUMNS, DROPPED, LOST, USED, Ledger, Why
from rftfit.measure.pairs import load_pairs, one_table, readers
from rftfit.measure.strokes import Samples, abscissa_of, split_runs, strokes
from rftfit.measure.tare import NO_TARE_FLAG, Tare, TareError, subtract

if TYPE_CHECKING:
    from collections.abc import Collection

    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.results import Results


# --- Stage 1: the logs of one medium to traces in the lab frame.


def ingest(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Read all logs of a medium: samples, a row for each run, counts of rows."""
    samples, table, book = ingest_medium(results.campaign, medium)
    return samples, table, book.table()


def ingest_medium(campaign: Campaign, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Read all logs of a medium, keeping what is wrong with the bad ones.

    Returns `samples`: One row per force sample (docs/architecture.md). Returns `runs`: One row per
    run: status, reason, flags, clock and zero. Returns `ledger`: Everything but the good rows of
    the strokes.
    """
    import pandas as pd

    good, rows, ledger = ingest_traces(campaign, medium)
    return samples_of(good), pd.DataFrame(rows, columns=list(RUN_COLUMNS)), ledger


def ingest_traces(
    campaign: Campaign, medium: str
) -> tuple[list[Trace], list[dict[str, object]], Ledger]:
    """Read all logs of a medium and keep what clocks and surface were estimated from.

    Returns `traces`: Of the runs that could be read. Returns `rows`: One for each run of the
    medium, see `ingest_medium`. Returns `ledger`: Everything but the good rows of the strokes.
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
            refused = {"run_id": run.run_id, "kind": run.kind, "status": "refused"}
            rows.append(RUN_COLUMNS | refused | {"reason": str(refusal)})
        else:
            good.append(trace)
            rows.append(_run_row(config, run, trace))
    return good, rows, ledger


RUN_COLUMNS: dict[str, object] = {
    **dict.fromkeys(("run_id", "kind", "status", "reason", "flags", "note"), ""),
    **dict.fromkeys(("rows_force", "rows_motion"), 0),
    **dict.fromkeys(
        ("sample_step_s", "clock_offset_s", "clock_residual_s", "clock_se_s", "zero_var_z_N2",
         "zero_var_x_N2", "zero_dof", "clock_hours", "clock_rest_s", "clock_drift",
         "clock_drift_se", "clock_explained", "surface_z_mm", "surface_se_mm",
         "surface_growth_N_per_cm"), np.nan
    ),
}  # fmt: skip
"""Columns of the table of runs, and what stands where nothing is known."""


def _run_row(config: Config, run: Run, trace: Trace) -> dict[str, object]:
    clock, step = trace.clock, trace.step_s
    row = {
        "run_id": run.run_id, "kind": run.kind, "status": "read", "flags": "; ".join(trace.flags),
        "note": trace.note, "rows_force": trace.rows[0], "rows_motion": trace.rows[1],
        "sample_step_s": step, "clock_offset_s": clock.offset_s,
        "clock_residual_s": clock.residual_s, "clock_se_s": clock.offset_se(step),
        "zero_var_z_N2": trace.zero_variance[0], "zero_var_x_N2": trace.zero_variance[1],
        "zero_dof": trace.zero_dof,
    }  # fmt: skip
    if trace.alignment is not None:
        found, hours = trace.alignment, clock.whole_hours
        # in a table of six digits hours would hide the rest
        row |= {
            "clock_hours": hours, "clock_rest_s": clock.offset_s - HOUR_S * hours,
            "clock_drift": found.drift, "clock_drift_se": found.drift_se,
            "clock_explained": found.explained,
        }  # fmt: skip
    if trace.surface is not None:
        found_at = trace.surface
        row |= {
            "surface_z_mm": config.arm.surface_z_mm - 10 * found_at.depth_cm,
            "surface_se_mm": 10 * found_at.se_cm,
            "surface_growth_N_per_cm": found_at.growth_N_per_cm,
        }
    return RUN_COLUMNS | row


def samples_of(traces: list[Trace]) -> pd.DataFrame:
    """Put the samples of all runs into one long table.

    Returns names as categories, so that a million rows stay small.
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


# --- Stage 2: subtract rod-only runs at equal depth and in-air runs at equal theta.


TARE_KINDS = ("rod", "leg_air")


def tare(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Subtract the tare of every plate and leg run of a medium: forces, tares, counts of rows."""
    samples, table, book = tare_medium(
        results.campaign, medium,
        results.table(f"traces/{medium}.parquet"), results.table(f"runs/{medium}.csv"),
    )  # fmt: skip
    return samples, table, book.table()


def tare_medium(
    campaign: Campaign, medium: str, traces: pd.DataFrame, status: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Subtract the tares of one medium.

    `traces`, `status`: From the ingest stage. Returns `samples`: One row per sample of a stroke:
    granular force and tare. Returns `tares`: One row per plate or leg run: its tare, valid range,
    and why there is none. Returns `ledger`: Rows of the tare runs, and of runs that have no tare.
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
        data[column] = np.concatenate([part[column] for _, part in parts]) if parts else np.empty(0)
    return pd.DataFrame(data, copy=False)  # these arrays are nobody else's


# --- Stage 3: zero-intercept slopes of one medium, and its alpha table.


def slopes(
    results: Results, medium: str
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Fit every plate run of a medium and combine the fits into its alpha table.

    Returns fits, alpha, why each sample of `tared` was fitted or not, counts of rows.
    """
    table, why, book = fit_medium(
        results.campaign, medium, results.table(f"runs/{medium}.csv"),
        results.table(f"tared/{medium}.parquet"), results.table(f"tares/{medium}.csv"),
    )  # fmt: skip
    fit = results.config.fit
    depths = len(fit.horizontal_depths_cm)
    cells = alpha_table(table, medium, fit.confidence, depths, fit.run_to_run_N_per_cm3)
    return table, cells, why, book.table()


def fit_medium(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame, tares: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Fit every plate run of a medium.

    `status`, `tared`, `tares`: From the ingest and tare stages. Returns `fits`: One row per plate
    run of the sheet, also of those that give no alpha. Returns `windows`: `run_id, why`: the rows
    of `tared`, `Why` a sample was not fitted. Returns `ledger`: The rows of the strokes that were
    handed on.
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
            lost = RunFit(beta, gamma, flags=flags, reason=reason)
            rows.append(_slopes_row(run, lost, confidence) | {"note": fact["note"]})
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
        rows.append(_slopes_row(run, fit, confidence) | {"note": fact["note"]})
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
    # a stated surface has no error
    surface_se_mm = float(np.nan_to_num(run["surface_se_mm"]))
    return Stroke(
        depth, columns["x_cm"][part], columns["path_cm"][part], force[:, part],
        columns["why"][part],
        np.array([[fact["zero_var_z_N2"], fact["zero_var_x_N2"]] for fact in pair], dtype=float),
        np.array([[fact["zero_dof"]] * 2 for fact in pair], dtype=float),
        # so does an error of the surface, where that had to be found
        math.hypot(speed * float(run["clock_se_s"]), surface_se_mm / 10),
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


def _slopes_row(run: Run, fit: RunFit, confidence: float) -> dict[str, object]:
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


# --- Leg rotation: tared force against theta, on a regular grid.


STEP_DEG = 1.0


def legs(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Average the tared force of every leg run of a medium over steps of one degree."""
    table, book = leg_curves(
        results.campaign, medium,
        results.table(f"runs/{medium}.csv"), results.table(f"tared/{medium}.parquet"),
    )  # fmt: skip
    return table, book.table()


def leg_curves(
    campaign: Campaign, medium: str, status: pd.DataFrame, tared: pd.DataFrame
) -> tuple[pd.DataFrame, Ledger]:
    """Force on each leg of a medium against theta.

    `status`, `tared`: From the ingest and tare stages. Returns `curves`: `medium, leg, run_id,
    theta_deg, force_z_N, force_x_N, samples, zero_se_z_N, zero_se_x_N, flags`; the errors of the
    zero are the same along a curve.
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
        pair = [facts[name] for name in (run.run_id, run.tare_run) if name]
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
                    "flags": "" if run.tare_run else NO_TARE_FLAG,
                }
            )
        )
    columns = ["medium", "leg", "run_id", "theta_deg", "force_z_N", "force_x_N", "samples",
               "zero_se_z_N", "zero_se_x_N", "flags"]  # fmt: skip
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=columns)
    return table, ledger


# --- The ledger of the whole campaign: every row of every log, used or dropped with a reason.


_FAULT = "this is a fault of the program, please report it"


def ledger(results: Results) -> pd.DataFrame:
    """Join the ledgers of all stages and media, and check that the rows add up."""
    campaign = results.campaign
    unclaimed = Ledger()
    for run in campaign.unclaimed:
        _drop_unclaimed(campaign, run, unclaimed)
    parts = [
        results.table(f"ledger/{stage}/{medium}.csv")
        for stage in ("ingest", "tare", "slopes", "legs")
        for medium in results.media
    ]
    if campaign.robot_medium:
        parts.append(results.table("ledger/robot.csv"))
    book = join([*parts, unclaimed.table()])
    absent = sorted(set(campaign.by_id) - set(book["run_id"]))
    if absent:
        raise RftfitError(f"{len(absent)} runs are not in the ledger, first {absent[0]}: {_FAULT}")
    once = {run.run_id for run in campaign.runs if one_table(campaign.config, run)}
    check(book, results.joined("runs/{medium}.csv"), once)
    return book


def _drop_unclaimed(campaign: Campaign, run: Run, book: Ledger) -> None:
    """Account for an in-air run that no leg names; it belongs to no medium and no stage reads it."""
    files = (run.force_log, run.motion_log)
    counts = []
    for file, reader in zip(files, readers(campaign.config), strict=True):
        try:
            counts.append(sum(log.rows for log in reader.stream(campaign.raw / file)))
        except LogError as error:
            counts.append(error.rows)
    if one_table(campaign.config, run) and counts[0] == counts[1]:
        counts.pop()
    for file, rows in zip(files, counts, strict=False):
        book.add(run, file, DROPPED, "in-air run that no leg run names as its tare", rows)


def join(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """Join ledgers; a run in air that serves several media is read for each but counted once."""
    import pandas as pd

    book = pd.concat([part.fillna({"medium": ""}) for part in parts], ignore_index=True)
    in_air = book["kind"] == "leg_air"
    once = pd.concat([book[~in_air], book[in_air].drop_duplicates()])
    return once.sort_values(COLUMNS).reset_index(drop=True)[COLUMNS]


def check(book: pd.DataFrame, runs: pd.DataFrame, once: Collection[str] = ()) -> None:
    """Compare the ledger with the number of rows in each log that was read.

    `runs`: Of the ingest stage. `once`: Runs with force and motion in one table: lines that both
    have are counted once.
    """
    read = runs[runs["status"] == "read"].drop_duplicates("run_id").set_index("run_id")
    # lost samples are no lines of any file
    lines = book[book["fate"] != LOST]
    counted = lines.groupby("run_id")["rows"].sum().reindex(read.index)
    twice = read.index.isin(list(once)) & (read["rows_force"] == read["rows_motion"])
    wanted = read["rows_force"] + read["rows_motion"].mask(twice, 0)
    wrong = counted[counted != wanted]
    if not wrong.empty:
        name = wrong.index[0]
        raise RftfitError(
            f"the ledger does not add up in {len(wrong)} runs, first {name}: {counted[name]} rows "
            f"counted, {wanted[name]} in the logs: {_FAULT}"
        )
