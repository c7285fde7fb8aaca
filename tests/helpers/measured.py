"""A medium of a campaign, measured by the stages in this process, with every table between."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from rftfit.measure.alpha import alpha_table, with_flagged
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import Flags, flag_table
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.ledger import check_ledger, join
from rftfit.measure.leg_curves import leg_curves
from rftfit.measure.tare import tare_medium


def row_of_run(table, run_id):
    """Return the only row of a run."""
    rows = table[table["run_id"] == run_id]
    assert len(rows) == 1
    return rows.iloc[0]


@dataclass(frozen=True)
class Results:
    """What the stages made of one medium."""

    traces: pd.DataFrame
    runs: pd.DataFrame
    tared: pd.DataFrame
    tares: pd.DataFrame
    fits: pd.DataFrame
    alpha: pd.DataFrame
    curves: pd.DataFrame
    book: pd.DataFrame
    flags: Flags

    def fit(self, run_id):
        return row_of_run(self.fits, run_id)

    def run(self, run_id):
        return row_of_run(self.runs, run_id)

    def codes(self, run_id):
        """Codes of the flags of a run."""
        return [flag.code for flag in self.flags.of_run(run_id)]

    def cell(self, beta_deg, gamma_deg):
        is_cell = (self.alpha["beta_deg"] == beta_deg) & (
            (self.alpha["gamma_deg"] - gamma_deg).abs() < 0.1
        )
        assert is_cell.sum() == 1
        return self.alpha[is_cell].iloc[0]

    def fates(self, file):
        rows = self.book[self.book["file"] == file]
        return dict(
            zip(zip(rows["fate"], rows["reason_code"], strict=True), rows["rows"], strict=True)
        )

    def check_ledger(self, counted, one_file=()):
        """Every line of every file is in the ledger, once; `one_file`: runs with a single log."""
        check_ledger(self.book, self.runs, list(one_file))
        assert self.book.groupby("file")["rows"].sum().to_dict() == counted
        dropped = self.book[self.book["fate"] == "dropped"]
        assert (dropped["reason"] != "").all()
        assert set(self.book["fate"]) <= {"used", "dropped"}


def chain(campaign, medium):
    """Ingest, tare, slopes, alpha table, legs and ledger of one medium."""
    traces, runs, *_, book1 = ingest_medium(campaign, medium)
    tared, tares, *_, book2 = tare_medium(campaign, medium, traces, runs)
    fits, *_, book3 = fit_medium(campaign, medium, runs, tared, tares)
    curves, *_, book4 = leg_curves(campaign, medium, runs, tared)
    fit = campaign.config.fit
    alpha = alpha_table(fits, medium, fit.confidence, len(fit.horizontal_depths_cm))
    books = (book1, book2, book3, book4)
    book = join([ledger.table() for ledger in books])
    flags = Flags(*(flag_table(medium, "", ledger.flags) for ledger in books))
    alpha = with_flagged(alpha, flags)
    return Results(traces, runs, tared, tares, fits, alpha, curves, book, flags)
