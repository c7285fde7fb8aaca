"""A new campaign from a template, never over anything that is there."""

from __future__ import annotations

import os
from importlib.resources import files
from typing import TYPE_CHECKING

from rftfit.campaign.columns import COLUMNS
from rftfit.campaign.schema import json_schema, reference_markdown
from rftfit.errors import InputError
from rftfit.store import write_text

if TYPE_CHECKING:
    from pathlib import Path


def init_campaign(folder: Path) -> list[Path]:
    """Write the files of a new campaign.

    Parameters
    ----------
    folder : Path
        Made if need be. It may hold other files.

    Returns
    -------
    list of Path
        What was written: the configuration with its schema and reference, an empty run sheet, and
        two READMEs, one of them with example rows.

    Raises
    ------
    InputError
        If any of these files is there already; nothing is written then.
    OutputError
        If a file cannot be written.
    """
    header = ",".join(column.name for column in COLUMNS)
    # the configuration last: with it the folder is a campaign
    texts = {
        "raw/README.md": _template("raw.md"),
        "README.md": _template("README.md").replace("@HEADER@", header),
        "config/README.md": reference_markdown(),
        "config/config.schema.json": json_schema(),
        "config/runs.csv": header + "\n",
        "config/config.yaml": _template("config.yaml"),
    }
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"{folder}: this is not a folder; name a new one or one that exists")
    # lexists: a link that leads nowhere is there too
    there = [name for name in texts if os.path.lexists(folder / name)]
    if there:
        raise InputError(
            f"{folder}: {', '.join(there)} would be overwritten, so nothing was written; name a "
            "new folder or move these files away"
        )
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in texts]


def _template(name: str) -> str:
    return files("rftfit.campaign").joinpath("template", name).read_text(encoding="utf-8")
