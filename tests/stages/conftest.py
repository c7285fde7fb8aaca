"""Whole media of the re-enacted lab, measured once per session."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest
from rigroom import CONFIG, Results, Room, chain, data_lines, digests, paper

from rftfit.campaign.load import load_campaign
from rftfit.lab import reenact

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

WHOLE = ("poppy_LP", "glass3mm_CP", "yuma", "palms29", "palms29_sieved")
"""Two laboratory media, one with its clocks an hour apart, and the three sands."""


@pytest.fixture
def room(tmp_path: Path) -> Room:
    return Room(tmp_path)


class Lab:
    """The folder of the whole media, read-only while it is measured."""

    def __init__(self, folder: Path) -> None:
        self.config = folder / "config" / "config.yaml"
        self.raw = folder / "raw" / "paper"
        self.config.parent.mkdir()
        shutil.copy(CONFIG, self.config)
        reenact(paper(), self.raw, self.raw / "runs.csv", media=WHOLE, workers=2)
        self.before = digests(folder / "raw")
        for path in [*self.raw.rglob("*"), self.raw]:
            path.chmod(0o555 if path.is_dir() else 0o444)
        campaign = load_campaign(self.config)
        self.results = {medium: chain(campaign, medium) for medium in WHOLE}
        self.after = digests(folder / "raw")
        self.campaign = campaign

    def counted(self, medium: str) -> dict[str, int]:
        return {
            file: data_lines((self.raw / file).read_bytes())
            for run in self.campaign.runs_of(medium)
            for file in (run.force_log, run.motion_log)
        }

    def unlock(self) -> None:
        for path in [self.raw, *self.raw.rglob("*")]:
            path.chmod(0o755 if path.is_dir() else 0o644)


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    made = Lab(tmp_path_factory.mktemp("lab"))
    yield made
    made.unlock()


@pytest.fixture(scope="session", params=["poppy_LP", "glass3mm_CP"])
def medium(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def results(lab: Lab, medium: str) -> Results:
    return lab.results[medium]
