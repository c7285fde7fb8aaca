from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from rftfit.campaign.config import Config

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def config():
    text = (ROOT / "config" / "config.yaml").read_text(encoding="utf-8")
    return Config(**yaml.safe_load(text))
