"""Reads numbers that were chosen by hand from ``chosen.toml`` of a room (a subpackage of rftfit).

That file says what each number decides, by which study it was graded, and when.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import Any


@cache
def read_toml(room: str, file: str) -> Mapping[str, Any]:
    """Read a toml file of a room, such as ``checks``; cached, so that callers must not change it."""
    return tomllib.loads(files("rftfit").joinpath(room, file).read_text(encoding="utf-8"))


def chosen(room: str, question: str) -> SimpleNamespace:
    """Return the numbers of one table of the ``chosen.toml`` of a room as attributes.

    `question`: Name of the table, which is that of the module that uses it.
    """
    return SimpleNamespace(**read_toml(room, "chosen.toml")[question])
