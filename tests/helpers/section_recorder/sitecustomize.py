"""Record which sections of the configuration a stage reads; put on PYTHONPATH by a test.

Python imports a module of this name on its own when it starts. Each ``python -m rftfit STAGE`` then
leaves a file in the folder that RFTFIT_SECTIONS names: its words, and the sections that were read after
the campaign was loaded (loading checks them all).
"""

from __future__ import annotations

import atexit
import json
import os
import sys
from pathlib import Path
from typing import Any


def record(folder: Path, words: list[str]) -> None:
    from rftfit.campaign import load
    from rftfit.campaign.config import Config

    sections, read = frozenset(Config.model_fields), set[str]()
    loading = 0
    plain, check, runs_of = Config.__getattribute__, load.check_campaign, load.Campaign.runs_of

    def look(self: Config, name: str) -> Any:
        if name in sections and not loading:
            read.add(name)
        elif name in ("__dict__", "model_dump") and not loading:
            read.update(sections)
        return plain(self, name)

    def checked(*words: Any, **more: Any) -> Any:
        nonlocal loading
        loading += 1
        try:
            return check(*words, **more)
        finally:
            loading -= 1

    def runs(self: Any, medium: str) -> Any:
        # which media there are is only looked at to refuse one that there is not
        nonlocal loading
        loading += 1
        try:
            return runs_of(self, medium)
        finally:
            loading -= 1

    load.Campaign.runs_of = runs  # type: ignore[method-assign]
    Config.__getattribute__ = look  # type: ignore[method-assign, assignment]
    load.check_campaign = checked

    def leave() -> None:
        text = json.dumps({"words": words, "read": sorted(read)})
        (folder / f"{os.getpid()}.json").write_text(text, encoding="utf-8")

    atexit.register(leave)


if "RFTFIT_SECTIONS" in os.environ and sys.orig_argv[1:3] == ["-m", "rftfit"]:
    record(Path(os.environ["RFTFIT_SECTIONS"]), sys.orig_argv[3:])
