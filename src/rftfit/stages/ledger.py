"""The ledger of the whole campaign: every row of every log, used or dropped with a reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.errors import RftfitError
from rftfit.logs.base import LogError
from rftfit.measure.ledger import COLUMNS, DROPPED, LOST, Ledger
from rftfit.measure.pair import readers
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run

_FAULT = "this is a fault of the program, please report it"


def ledger(config: Path, parts: list[Path], runs: list[Path], ledger: Path) -> None:
    """Join the ledgers of all stages and media, and check that the rows add up.

    Parameters
    ----------
    config : Path
    parts : list of Path
        Read: ledgers of the stages, one medium each.
    runs : list of Path
        Read: run tables of the ingest stage, which know how many rows each log has.
    ledger : Path
        Written.

    Raises
    ------
    RftfitError
        If the rows of any log do not add up: a fault of the program, never of the data.
    """
    import pandas as pd

    campaign = load_campaign(config)
    unclaimed = Ledger()
    for run in campaign.unclaimed:
        _drop_unclaimed(campaign, run, unclaimed)
    book = join([*(read_csv(path) for path in parts), unclaimed.table()])
    absent = sorted(set(campaign.by_id) - set(book["run_id"]))
    if absent:
        raise RftfitError(f"{len(absent)} runs are not in the ledger, first {absent[0]}: {_FAULT}")
    check(book, pd.concat([read_csv(path) for path in runs]))
    write_csv(book, ledger)


def _drop_unclaimed(campaign: Campaign, run: Run, book: Ledger) -> None:
    """Account for an in-air run that no leg names; it belongs to no medium and no stage reads it."""
    for file, reader in zip((run.force_log, run.motion_log), readers(campaign.config), strict=True):
        try:
            rows = sum(log.rows for log in reader.stream(campaign.raw / file))
        except LogError as error:
            rows = error.rows
        book.add(run, file, DROPPED, "in-air run that no leg run names as its tare", rows)


def join(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """Join ledgers; a run in air that serves several media is read for each but counted once.

    Parameters
    ----------
    parts : list of pandas.DataFrame

    Returns
    -------
    pandas.DataFrame
    """
    import pandas as pd

    book = pd.concat([part.fillna({"medium": ""}) for part in parts], ignore_index=True)
    in_air = book["kind"] == "leg_air"
    once = pd.concat([book[~in_air], book[in_air].drop_duplicates()])
    return once.sort_values(COLUMNS).reset_index(drop=True)[COLUMNS]


def check(book: pd.DataFrame, runs: pd.DataFrame) -> None:
    """Compare the ledger with the number of rows in each log that was read.

    Parameters
    ----------
    book : pandas.DataFrame
    runs : pandas.DataFrame
        Of the ingest stage.

    Raises
    ------
    RftfitError
        If they differ anywhere.
    """
    read = runs[runs["status"] == "read"].drop_duplicates("run_id").set_index("run_id")
    # lost samples are no lines of any file
    lines = book[book["fate"] != LOST]
    counted = lines.groupby("run_id")["rows"].sum().reindex(read.index)
    wanted = read["rows_force"] + read["rows_motion"]
    wrong = counted[counted != wanted]
    if not wrong.empty:
        name = wrong.index[0]
        raise RftfitError(
            f"the ledger does not add up in {len(wrong)} runs, first {name}: {counted[name]} rows "
            f"counted, {wanted[name]} in the logs: {_FAULT}"
        )
