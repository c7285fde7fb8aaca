"""Results whose tables are at hand instead of in files, for tests of what is made from them."""

from pathlib import Path
from types import SimpleNamespace

import pandas as pd
from paper import paper_config

from rftfit import reference
from rftfit.campaign.load import Campaign
from rftfit.errors import InputError
from rftfit.measure.flags import FLAG_COLUMNS
from rftfit.measure.ledger import RowStatus
from rftfit.results import Results

PLATE_CM2 = 3.81 * 2.54


class Memory(Results):
    """Tables by their names; one of several media stands under ``folder/{medium}.csv``."""

    def __init__(self, campaign, tables):
        super().__init__(campaign)
        self.tables = tables

    def table(self, name):
        for pattern, table in self.tables.items():
            head, _, tail = pattern.partition("{medium}")
            if name == pattern:
                return table.copy(deep=False)
            if tail and name.startswith(head) and name.endswith(tail):
                medium = name.removeprefix(head).removesuffix(tail)
                rows_of_medium = table[table["medium"] == medium]
                return (
                    rows_of_medium.drop(columns="medium") if tail == ".parquet" else rows_of_medium
                )
        raise InputError(f"{name}: there is no such table")


def memory(tables, media=reference.MEDIA, runs=(), **settings):
    """The demonstration campaign with these media and tables, its settings changed by section."""
    every = [*runs] or [
        run(f"{medium}_{kind}", medium, kind) for medium in media for kind in ("plate", "leg")
    ]
    # results of the folder in which the tests run must not be found
    no_folder = Path("no campaign is here")
    return Memory(
        Campaign(no_folder, no_folder, no_folder, paper_config(**settings), tuple(every)), tables
    )


def run(run_id, medium, kind="plate", direction="intrusion"):
    """A row of the run sheet."""
    return SimpleNamespace(
        run_id=run_id,
        medium=medium,
        kind=kind,
        direction=direction,
        tare_run="",
        intruder={"leg": "c_leg"}.get(kind, kind),
        beta_deg=0.0,
        gamma_deg=90.0,
        excluded=False,
        session="",
    )


def of_runs(traces, fits, **settings):
    """Results of plate runs: their samples as the tare and slope stages leave them.

    `traces`: Stress in the lab frame, as `chain_tables.one_run` makes it.
    """
    medium = traces["run_id"].map(fits.drop_duplicates("run_id").set_index("run_id")["medium"])
    tared = traces[["run_id", "depth_cm", "path_cm"]].assign(medium=medium)
    for c in "zx":
        tared[f"force_{c}_N"] = traces[f"stress_{c}_N_per_cm2"] * PLATE_CM2
        tared[f"tare_{c}_N"] = traces[f"tare_{c}_N_per_cm2"] * PLATE_CM2
    windows = traces[["run_id"]].assign(medium=medium, why=int(RowStatus.ABOVE))
    windows["why"] = windows["why"].where(~traces["in_window"], int(RowStatus.GOOD))
    rows = fits.drop_duplicates("run_id").to_dict("records")
    runs = [run(str(r["run_id"]), str(r["medium"]), direction=str(r["direction"])) for r in rows]
    tables = {
        "tared/{medium}.parquet": tared,
        "windows/{medium}.parquet": windows,
        "fits/{medium}.csv": fits,
        "flags/{medium}.csv": pd.DataFrame(columns=FLAG_COLUMNS),
    }
    return memory(tables, runs=runs, **settings)
