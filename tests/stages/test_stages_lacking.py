"""Stages of a campaign that lacks runs say so in their tables and figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest
from rftfit.workflow.figures import quality

from rftfit.store import read_csv, write_csv
from rftfit.workflow.measure import ingest, slopes, tare
from rftfit.workflow.validate import sands

if TYPE_CHECKING:
    from pathlib import Path

    from rigroom import Room

TEST = "yuma_bp00_g90_in"


def measured(room: Room, medium: str) -> dict[str, Path]:
    """Ingest, tare and fit one medium; paths of the results."""
    config = room.write()
    names = {name: room.folder / f"{name}.csv" for name in ("runs", "tares", "fits", "alpha")}
    names |= {name: room.folder / f"{name}.parquet" for name in ("traces", "tared", "windows")}
    book = room.folder / "ledger.csv"

    def of(*wanted: str) -> dict[str, Path]:
        return {name: names[name] for name in wanted}

    ingest(config, medium, **of("traces", "runs"), ledger=book)
    tare(config, medium, **of("traces", "runs", "tared", "tares"), ledger=book)
    parts = of("runs", "tared", "tares", "fits", "alpha", "windows")
    slopes(config, medium, **parts, ledger=book)
    return names | {"config": config}


@pytest.mark.parametrize(
    ("cells", "reason"),
    [({"excluded": "yes", "reason": "bed was disturbed"}, "bed was disturbed"),
     ({"tare_run": ""}, "its tare")],
)  # fmt: skip
def test_a_penetration_test_that_gave_nothing(
    room: Room, cells: dict[str, str], reason: str
) -> None:
    room.add(TEST).set(TEST, **cells)
    paths = measured(room, "yuma")
    penetration, found = room.folder / "penetration.csv", room.folder / "sands.csv"
    write_csv(pd.DataFrame({"method": ["lsq"], "chi": [np.nan]}), penetration)
    sands(paths["config"], [paths["runs"]], [paths["tared"]], penetration, found)
    row = read_csv(found).iloc[0]
    assert (row["medium"], row["run_id"]) == ("yuma", TEST)
    assert np.isnan(row["zeta"])
    assert reason in row["reason"]


def test_a_medium_of_legs_alone_has_a_quality_sheet_that_says_so(room: Room) -> None:
    paths = measured(room.add("poppy_LP_c_leg"), "poppy_LP")
    png = room.folder / "sheet.png"
    parts = {name: paths[name] for name in ("tared", "windows", "fits")}
    quality(paths["config"], "poppy_LP", **parts, png=png)
    assert "the run sheet has no plate run" in png.with_suffix(".svg").read_text(encoding="utf-8")


def test_a_table_without_rows_joins_as_numbers(tmp_path: Path) -> None:
    """Else theta of every other medium would become words, which no stage can join by."""
    rows = pd.DataFrame({"medium": ["m"], "theta_deg": [1.5], "force_z_N": [2.0]})
    for name, part in {"some": rows, "none": rows.iloc[:0]}.items():
        write_csv(part, tmp_path / name)
    joined = pd.concat([read_csv(tmp_path / name) for name in ("some", "none")])
    assert joined["theta_deg"].dtype == np.float64
    assert list(joined["medium"]) == ["m"]
