"""Numbers that were chosen by hand: ``chosen.toml`` of a room names what each decides, the study that grades it, and the date."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from types import SimpleNamespace


@cache
def chosen(room: str, question: str) -> SimpleNamespace:
    """Numbers of one question of a room, by name."""
    text = files("rftfit").joinpath(room, "chosen.toml").read_text(encoding="utf-8")
    return SimpleNamespace(**tomllib.loads(text)[question])
