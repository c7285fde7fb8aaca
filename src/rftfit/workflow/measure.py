"""Stages from logs to alpha, one function a rule: clocks, ingest, tare, slopes, checks, legs, ledger.

A stage takes `Results`, the access to the tables of earlier stages, and the name of a medium; it returns the tables that its
rule writes, in the order of the rule. It only calls what `rftfit.measure` and `rftfit.checks` do, so that the watch and
`rftfit check` can do the same without files. These tables pass through (columns: `rftfit.outputs`):

- traces, tared: a row for each sample of each run, with time (s), place (cm) and force (N) in the lab frame; in traces with
  the force on the rod that holds the plate, in tared without it (the tare)
- runs: a row for each run, read or refused; tares: what was subtracted from a run
- fits: a row for each plate run, with its alpha (slope of stress over depth, N/cm^3); windows: for each sample of tared
  whether the fit used it
- alpha: a row for each cell, a direction (beta, gamma), with the mean of its runs
- flags: doubts about runs or cells; ledger: how many rows of each log were used or dropped, and why
"""

from __future__ import annotations

import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.checks.declared import COLUMNS
from rftfit.checks.medium import check_medium, marks_of
from rftfit.checks.verdict import Verdict, verdict_on
from rftfit.compare.causes import compare_all_runs
from rftfit.compare.peers import compare_runs, outlier_differences
from rftfit.measure.alpha import alpha_table, flags_of_cells, with_flagged
from rftfit.measure.copies import copies_of, counted_once
from rftfit.measure.depths import alpha_at_depths
from rftfit.measure.errors import SurfaceError, errors_of
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import OF_CHECKS, Flags, flag_table, mark_columns
from rftfit.measure.ingest import account_unassigned_air_runs, ingest_medium
from rftfit.measure.laws import DepthLaw
from rftfit.measure.ledger import check_ledger, join
from rftfit.measure.leg_curves import leg_curves
from rftfit.measure.read import same_table
from rftfit.measure.session_clocks import align_medium
from rftfit.measure.tables import fit_alpha_table, ingest_table
from rftfit.measure.tare import tare_medium
from rftfit.model.common_errors import covariance_table
from rftfit.model.shapes import published_shapes
from rftfit.results import Results

FLAGGING = ("ingest", "tare", "slopes")
"""Stages that flag runs by their own logs, in their order; each writes ``flags/STAGE/MEDIUM.csv``."""


def clocks(results: Results, medium: str) -> pd.DataFrame:
    """Align the force log and the motion log of each push straight down in a medium: a row for each push.

    The two logs have clocks of their own. From these rows of all media `ingest` finds the offset of each session.
    """
    return align_medium(results.campaign, medium)


def ingest(results: Results, medium: str) -> tuple[pd.DataFrame, ...]:
    """Read all logs of a medium, or its rows of a table of numbers; return traces, runs, ledger, flags."""
    # a campaign may be a table of stress or of alpha that somebody else made, instead of logs
    if results.campaign.numbers:
        samples, runs, book = ingest_table(results.campaign, medium)
    else:
        samples, runs, book = ingest_medium(results.campaign, medium, results.session_clocks)
    return samples, runs, book.table(), flag_table(medium, "ingest", book.flags)


def tare(results: Results, medium: str) -> tuple[pd.DataFrame, ...]:
    """Subtract the tare from each run of a medium; return tared, tares, ledger, flags.

    The tare of a plate is a run of the rod alone, at equal depth; that of a leg, which turns, a turn in air, at equal angle.
    """
    traces, runs = results.table(f"traces/{medium}.parquet"), results.table(f"runs/{medium}.csv")
    samples, tares, book = tare_medium(results.campaign, medium, traces, runs)
    return samples, tares, book.table(), flag_table(medium, "tare", book.flags)


def slopes(results: Results, medium: str) -> tuple[pd.DataFrame, ...]:
    """Fit alpha to every plate run of a medium; return fits, windows, ledger, flags.

    Copies are runs with the same readings under several run_ids: the first keeps its alpha, since they are one measurement.
    """
    tared, tares = results.table(f"tared/{medium}.parquet"), results.table(f"tares/{medium}.csv")
    runs = results.table(f"runs/{medium}.csv")
    table = results.config.table
    # a table of alpha has nothing to fit
    if table is not None and table.holds == "alpha":
        fits, windows, book = fit_alpha_table(results.campaign, medium, tared)
    else:
        fits, windows, book = fit_medium(results.campaign, medium, runs, tared, tares)
    sheet = {run.run_id: run for run in results.campaign.runs_of(medium)}
    tolerance_deg = results.config.grid.angle_tolerance_deg
    copies = copies_of(sheet, runs, fits, tared, tolerance_deg)
    fits, left_out = counted_once(fits, copies, tolerance_deg)
    book.leave_out(left_out)
    return fits, windows, book.table(), flag_table(medium, "slopes", book.flags)


def checks(results: Results, medium: str) -> tuple[pd.DataFrame, ...]:
    """Average the runs of a medium to its table of alpha, one cell a direction, and do the physical checks.

    Checks and alpha are one stage because each needs the other: checks look at the cells, and cells of a medium that fails
    are marked. Returns seven tables: verdicts of the checks; alpha; covariance of the errors of alpha; alpha at several
    depths, where stress is no line; each run compared with the other runs of its direction (peers); errors that many runs
    share, such as a turned axis (causes); all flags, those of the earlier stages included.
    """
    config = results.config
    # by name, the tables that checks may read; alpha and the comparisons of runs are added below
    tables = {name: results.table(f"{name}/{medium}.csv") for name in ("runs", "tares", "fits")}
    tables |= {name: results.table(f"{name}/{medium}.parquet") for name in ("tared", "windows")}
    sheet = {run.run_id: run for run in results.campaign.runs_of(medium)}
    tolerance_deg, fits = config.grid.angle_tolerance_deg, tables["fits"]
    # by run_id the run_ids of its copies
    copies = copies_of(sheet, tables["runs"], fits, tables["tared"], tolerance_deg)
    peers = compare_runs(fits, medium, tolerance_deg)
    # errors that no log shows: of angles, tare and bed by the config, and of the free surface
    errors, surface_error = errors_of(fits, config)
    # number of depths at which a horizontal direction is pushed
    depths = results.campaign.count_level_depths(medium)
    # by run_id of a run that stands apart: its alpha less that of the others, which widens the interval of its cell
    outliers = outlier_differences(peers)

    def average_runs(fits: pd.DataFrame, law: DepthLaw, surface: SurfaceError) -> pd.DataFrame:
        """Average fits to the table of alpha, without copies: for the law of the config, and for others (`alpha_at_depths`).

        `law`: How stress grows with depth. `surface`: Error of the free surface, and so of every depth, under this law.
        """
        return alpha_table(
            counted_once(fits, copies, tolerance_deg)[0],
            medium,
            config.fit.confidence,
            depths,
            errors=errors,
            grid=config.grid_of(medium),
            surface=surface,
            law=law,
            outliers=outliers,
            shape=published_shapes().slopes,
        )

    fits_without_copies, _ = counted_once(fits, copies, tolerance_deg)
    # axes, misplaced: axes of the transducer and rows of the sheet by which the runs would agree better, for the checks
    causes, axes, misplaced = compare_all_runs(
        fits_without_copies, medium, sheet, config.errors.angle_deg, tolerance_deg
    )
    unmarked_alpha = average_runs(fits, DepthLaw(config.fit.law), surface_error)
    tables |= {"alpha": unmarked_alpha, "peers": peers, "causes": causes}
    tables |= {"axes": axes, "misplaced": misplaced}
    flags_of_runs = [results.table(f"flags/{stage}/{medium}.csv") for stage in FLAGGING]
    # the outcome of each check, with its flags
    checked = check_medium(results.campaign, medium, tables, copies, Flags(*flags_of_runs))
    verdicts = pd.DataFrame([check.row(medium) for check in checked], columns=COLUMNS)
    cell_flags = flags_of_cells(unmarked_alpha, Flags(*flags_of_runs), depths)
    check_flags = [flag for check in checked for flag in check.flags]
    new_flags = flag_table(medium, OF_CHECKS, [*check_flags, *cell_flags])
    flags = pd.concat([*flags_of_runs, new_flags], ignore_index=True)
    # columns that say in each row which checks the medium fails
    marks = mark_columns(marks_of(verdicts, config.media).get(medium, ()))
    alpha = with_flagged(unmarked_alpha, Flags(flags)).assign(**marks)
    # alpha by other laws of depth: the runs are averaged again for each
    at_depth = alpha_at_depths(
        results.campaign, medium, tables | {"checks": verdicts}, average_runs
    )
    return (
        verdicts,
        alpha,
        covariance_table(alpha),
        at_depth.assign(**marks),
        peers,
        causes,
        flags,
    )


MEASURED = (
    (ingest, ("traces/{}.parquet", "runs/{}.csv", "ledger/ingest/{}.csv", "flags/ingest/{}.csv")),
    (tare, ("tared/{}.parquet", "tares/{}.csv", "ledger/tare/{}.csv", "flags/tare/{}.csv")),
    (slopes, ("fits/{}.csv", "windows/{}.parquet", "ledger/slopes/{}.csv", "flags/slopes/{}.csv")),
)
"""Stages from the logs to the slopes of single runs, each with the names of its tables below ``results/``; {}: the medium."""


def measure_logs(results: Results, medium: str) -> None:
    """Measure the logs of a medium up to the slopes; the tables are put into `results`, and no file is written."""
    for stage, names in MEASURED:
        for name, table in zip(names, stage(results, medium), strict=True):
            results.hold(name.format(medium), table)


def measure_and_check(campaign: Campaign) -> tuple[pd.DataFrame, dict[str, Verdict]]:
    """Measure all logs of a campaign and do the physical checks, for `rftfit check --diagnose`; no file is written.

    Returns the table of checks of all media, a row for each medium and check, and the verdict on each medium by its name.
    """
    results = Results(campaign)
    checks_of_media, verdicts = [], {}
    # the clock of a session is found from pushes in all media, so all are aligned before the first is measured
    if campaign.config.clock.method == "estimate":
        for medium in results.media:
            results.hold(f"clocks/{medium}.parquet", clocks(results, medium))
    for medium in results.media:
        measure_logs(results, medium)
        checks_of_medium, *_, flags = checks(results, medium)
        checks_of_media.append(checks_of_medium)
        fits = results.table(f"fits/{medium}.csv")
        verdicts[medium] = verdict_on(checks_of_medium, fits, Flags(flags))
    return pd.concat(checks_of_media, ignore_index=True), verdicts


def legs(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Average the tared force (N) of every leg run of a medium over steps of theta, the leg's angle; return curves, ledger.

    The force model is tested by these curves.
    """
    runs, tared = results.table(f"runs/{medium}.csv"), results.table(f"tared/{medium}.parquet")
    curves, book = leg_curves(results.campaign, medium, runs, tared)
    marks = marks_of(results.table(f"checks/{medium}.csv"), results.config.media).get(medium, ())
    return curves.assign(**mark_columns(marks)), book.table()


def ledger(results: Results) -> pd.DataFrame:
    """Join the ledgers of all stages and media; raise an error unless each row of each log is counted exactly once.

    A row of a ledger counts rows of one log with one fate (used, dropped) and one reason.
    """
    campaign = results.campaign
    ledgers = [
        results.table(f"ledger/{stage}/{medium}.csv")
        for stage in ("ingest", "tare", "slopes", "legs")
        for medium in results.media
    ]
    if campaign.robot_medium:
        ledgers.append(results.table("ledger/robot.csv"))
    book = join([*ledgers, account_unassigned_air_runs(campaign).table()])
    runs_with_one_log = {run.run_id for run in campaign.runs if same_table(campaign.config, run)}
    check_ledger(book, results.joined("runs/{medium}.csv"), runs_with_one_log, campaign.by_id)
    return book
