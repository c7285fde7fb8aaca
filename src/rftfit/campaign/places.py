"""Where the files of a campaign may lie, beyond each path on its own."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.campaign.files import Folder, plain_path
from rftfit.campaign.problems import Problem

if TYPE_CHECKING:
    from rftfit.campaign.configfile import ConfigFile

RESULTS = "results"


def check_places(file: ConfigFile, root: Folder, raw: str, sheet: str) -> list[Problem]:
    """Find what the program would overwrite, and what leads out of the raw folder.

    Parameters
    ----------
    file : ConfigFile
    root : Folder
        The campaign's.
    raw, sheet : str
        Raw folder and run sheet, relative to it; empty where they cannot be used.

    Returns
    -------
    list of Problem
    """
    problems = []
    results = os.path.realpath(f"{root.base}/{RESULTS}")
    for key, path in (("raw", raw), ("run_sheet", sheet)):
        place = os.path.realpath(f"{root.base}/{path}")
        if path and (_inside(place, results) or (key == "raw" and _inside(results, place))):
            allowed = (
                f"a place apart from {RESULTS}/, which the program writes and anybody may delete"
            )
            if not _inside(path, RESULTS):
                allowed += f"; a link brings the two together: {RESULTS} is {results}"
            problems.append(
                Problem(file.name, file.document.line_of((key,)), key, path, allowed, "config.in-results")
            )  # fmt: skip
    contact = file.config.rigid_contact if file.config is not None else None
    if contact is not None and raw:
        logs = Folder(Path(root.base) / raw)
        for key, written in (("force_log", contact.force_log), ("motion_log", contact.motion_log)):
            path, fault, nearest = plain_path(written)
            status = "missing" if fault else logs.status(path)
            if status == "file":
                continue
            allowed = "a log that exists, as a path inside the raw folder"
            allowed += f"; {fault.partition(': ')[2]}" if fault else ""
            allowed += "; a link leads out of it" if status == "outside" else ""
            nearest = nearest or (logs.nearest(path) if not fault else None)
            line = file.document.line_of(("rigid_contact", key))
            problems.append(
                Problem(file.name, line, f"rigid_contact.{key}", written, allowed, "config.rigid-contact", nearest=nearest)
            )  # fmt: skip
    return problems


def _inside(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip("/\\") + os.sep)
