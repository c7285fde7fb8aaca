"""Stages of the measurement chain: ingest, tare, slopes, legs, ledger."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import errors_of
from rftfit.measure.fits import fit_medium
from rftfit.measure.ingest import account_unclaimed, ingest_medium
from rftfit.measure.ledger import check, join
from rftfit.measure.legs import leg_curves
from rftfit.measure.pairs import one_table
from rftfit.measure.tables import fit_alpha_table, ingest_table
from rftfit.measure.tare import tare_medium

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.results import Results


def ingest(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Read all logs of a medium: samples, a row for each run, counts of rows."""
    if results.campaign.numbers:
        return ingest_table(results.campaign, medium)
    samples, runs, book = ingest_medium(results.campaign, medium)
    return samples, runs, book.table()


def tare(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Subtract rod-only runs at equal depth, in-air runs at equal theta: forces, tares, counts."""
    traces, runs = results.table(f"traces/{medium}.parquet"), results.table(f"runs/{medium}.csv")
    samples, tares, book = tare_medium(results.campaign, medium, traces, runs)
    return samples, tares, book.table()


def slopes(
    results: Results, medium: str
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Fit every plate run of a medium: fits, its alpha table, windows of the fits, counts of rows."""
    tared, tares = results.table(f"tared/{medium}.parquet"), results.table(f"tares/{medium}.csv")
    runs = results.table(f"runs/{medium}.csv")
    table = results.config.table
    if table is not None and table.holds == "alpha":
        fits, windows, book = fit_alpha_table(results.campaign, medium, tared)
    else:
        fits, windows, book = fit_medium(results.campaign, medium, runs, tared, tares)
    config = results.config
    errors, surface = errors_of(fits, config)
    depths = len(config.fit.horizontal_depths_cm)
    level, grid = config.fit.confidence, config.grid_of(medium)
    alpha = alpha_table(fits, medium, level, depths, errors, grid, surface)
    return fits, alpha, windows, book.table()


def legs(results: Results, medium: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Average the tared force of every leg run of a medium over steps of theta: curves, counts."""
    runs, tared = results.table(f"runs/{medium}.csv"), results.table(f"tared/{medium}.parquet")
    curves, book = leg_curves(results.campaign, medium, runs, tared)
    return curves, book.table()


def ledger(results: Results) -> pd.DataFrame:
    """Join the ledgers of all stages and media, and check that the rows add up."""
    campaign = results.campaign
    parts = [
        results.table(f"ledger/{stage}/{medium}.csv")
        for stage in ("ingest", "tare", "slopes", "legs")
        for medium in results.media
    ]
    if campaign.robot_medium:
        parts.append(results.table("ledger/robot.csv"))
    book = join([*parts, account_unclaimed(campaign).table()])
    once = {run.run_id for run in campaign.runs if one_table(campaign.config, run)}
    check(book, results.joined("runs/{medium}.csv"), once, campaign.by_id)
    return book
