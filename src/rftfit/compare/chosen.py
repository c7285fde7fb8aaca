"""Numbers of the comparisons that were chosen by hand, by question: ``chosen.toml`` names the study and the date of each."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from types import SimpleNamespace


@cache
def chosen(question: str) -> SimpleNamespace:
    """Numbers of one question, by name."""
    text = files("rftfit.compare").joinpath("chosen.toml").read_text(encoding="utf-8")
    return SimpleNamespace(**tomllib.loads(text)[question])
