"""What of the paper stands beside a campaign: as much as the campaign has of the paper's media."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from page_inputs import page_results, sand_results

from rftfit.compare.published import (
    INCONSISTENT,
    compare_coefficients,
    compare_penetration,
    discrepancies,
)
from rftfit.model.scaling import AS_PRINTED
from rftfit.reference import MEDIA
from rftfit.results import Results
from rftfit.workflow.validate import validate

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd


def as_printed(results: Results, name: str) -> pd.DataFrame:
    return results.table(name).assign(method=AS_PRINTED)


def test_means_of_the_paper_stand_beside_its_five_media_only(tmp_path: Path) -> None:
    own = page_results(tmp_path)
    terms, tests = (as_printed(own, f"{name}.csv") for name in ("coefficients", "penetration"))
    for known, there in ((MEDIA, True), (MEDIA[:4], False)):
        published = {name: name for name in known}
        items = compare_coefficients(terms, published)
        assert any(one.item.startswith("generic") for one in items) == there
        part = tests[tests["medium"].isin(known)]
        items = compare_penetration(part, published)
        assert any(one.item.startswith("chi, mean") for one in items) == there
        assert any(one.item.startswith(f"{known[0]}: chi") for one in items)


def test_misprints_stand_beside_media_of_the_paper_only(tmp_path: Path) -> None:
    own = sand_results(tmp_path)
    printed = {one.item for one in discrepancies()}
    table = validate(own)
    assert printed <= set(table["item"])
    assert INCONSISTENT in set(table["verdict"])
    media = {"yuma": own.config.media["yuma"].model_copy(update={"published_as": None})}
    config = own.config.model_copy(update={"media": media})
    other = validate(Results(dataclasses.replace(own.campaign, config=config)))
    assert other.empty
    assert list(other.columns) == list(table.columns)
