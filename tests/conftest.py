"""What several rooms' tests share."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from rftfit.campaign.config import Config

ROOT = Path(__file__).parents[1]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with whole workflows: one of them at the end would leave the other processor idle."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(scope="session")
def paper_config() -> Config:
    """The configuration of the demonstration campaign."""
    text = (ROOT / "config" / "config.yaml").read_text(encoding="utf-8")
    return Config(**yaml.safe_load(text))
