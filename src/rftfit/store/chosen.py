"""Numbers that were chosen by hand: ``chosen.toml`` of a room names what each decides, the study that grades it, and the date."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import Any


@cache
def read_toml(room: str, file: str) -> Mapping[str, Any]:
    """Read a data file of a room."""
    return tomllib.loads(files("rftfit").joinpath(room, file).read_text(encoding="utf-8"))


def chosen(room: str, question: str) -> SimpleNamespace:
    """Numbers of one question of a room, by name."""
    return SimpleNamespace(**read_toml(room, "chosen.toml")[question])
