"""Writes the files of a new campaign: from the template, of the demonstration, or from a table of stress or alpha."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Literal

from rftfit.campaign.columns import COLUMNS
from rftfit.campaign.config import TableSettings
from rftfit.campaign.problems import CampaignError, Place
from rftfit.campaign.schema import json_schema, reference_markdown
from rftfit.campaign.tables import TableRead, read_pushes
from rftfit.directions import TOLERANCE_DEG, is_straight_down
from rftfit.errors import InputError
from rftfit.reference import MEDIA, SANDS
from rftfit.store import copy_file, write_text
from rftfit.store.environment import shipped
from rftfit.store.links import refuse_links, refuse_target_by_link

_UNREADABLE = (".not-text", ".web-page", ".not-a-workbook", ".too-large", ".unreadable")
"""Ends of the codes of problems with a file that cannot be read at all."""


def init_campaign(folder: Path) -> list[Path]:
    """Write the files of a new campaign from the template into a folder, and return their paths."""
    header = ",".join(column.name for column in COLUMNS)
    # the configuration is written last: with it the folder is a campaign
    contents = {
        "raw/README.md": _template("raw.md"),
        "README.md": _template("README.md").replace("@HEADER@", header),
        "config/runs.csv": header + "\n",
        "config/config.yaml": _template("config.yaml"),
    }
    return _write_files(folder, contents, {})


def init_demonstration(folder: Path) -> list[Path]:
    """Write the configuration of the demonstration into a folder and return the paths of its files.

    Its logs are those of the paper's runs, which `rftfit reenact` then simulates.
    """
    shipped_files = ("config/robot.yaml", "config/robot.schema.json", "config/config.yaml")
    return _write_files(folder, {}, {name: shipped(name) for name in shipped_files})


def _write_files(
    folder: Path, contents: Mapping[str, str], sources: Mapping[str, Path]
) -> list[Path]:
    """Write the files of a campaign, and those that every campaign has; return their paths.

    `contents`: Path in the folder, to content. `sources`: Path in the folder, to the file to be copied. Raises
    InputError before anything is written if a file would be overwritten, or lies behind a link.
    """
    contents = {
        "config/README.md": reference_markdown(),
        "config/config.schema.json": json_schema(),
        **contents,
    }
    names = [*sources, *contents]
    refuse_target_by_link(folder)
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"{folder}: this is not a folder; name a new one or one that exists")
    # lexists is also True for a link that leads nowhere
    existing = [name for name in names if os.path.lexists(folder / name)]
    if existing:
        raise InputError(
            f"{folder}: {', '.join(existing)} would be overwritten, so nothing was written; name a "
            "new folder or move these files away"
        )
    refuse_links(folder, names)
    for name, source in sources.items():
        copy_file(source, folder / name)
    for name, content in contents.items():
        write_text(folder / name, content)
    return [folder / name for name in names]


def _template(name: str) -> str:
    """Return the text of a file of the template, which is part of the package; @WORDS@ in it are to be replaced."""
    return files("rftfit.campaign").joinpath("template", name).read_text(encoding="utf-8")


def init_from_table(
    folder: Path, table: Path, holds: Literal["stress", "alpha"]
) -> tuple[list[Path], TableRead]:
    """Write a campaign whose data are a table of stress or alpha, which is copied into its raw folder.

    The config names the media that the table has. Returns the paths of the files, and the content of the table, whose
    problems, as an unknown unit, the user can mend in the config. Raises CampaignError for a table that cannot be read
    at all.
    """
    if not table.is_file():
        raise InputError(f"{table}: there is no such file; allowed: a table as csv, tsv or xlsx")
    # the name of the copy, of letters that any system and the config can hold
    name = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "_" for c in table.name)
    read = read_pushes(table, f"raw/{name}", TableSettings(holds=holds), (), name)
    for problem in read.problems:
        if problem.code.endswith(_UNREADABLE):
            # the user knows the table by the path that was given, not by that of its copy
            place = Place(str(table), line=problem.place.line)
            raise CampaignError([replace(problem, place=place)])
    # medium, to the (beta, gamma) of its pushes, deg
    directions: dict[str, set[tuple[float, float]]] = {key: set() for key in read.media}
    for push in read.pushes:
        directions[push.run.medium].add((push.run.beta_deg, push.run.gamma_deg))
    media = "\n".join(
        _medium_line(key, title, directions[key]) for key, title in read.media.items()
    )
    config = _template("table.yaml").replace("@FILE@", f"raw/{name}").replace("@HOLDS@", holds)
    contents = {"config/config.yaml": config.replace("@MEDIA@", media)}
    return _write_files(folder, contents, {f"raw/{name}": table}), read


def _medium_line(key: str, title: str, directions: set[tuple[float, float]]) -> str:
    """Return the line of config for a medium of a table.

    A medium pushed only straight down gets the role natural_sand: it has too few directions for a profile of its own.
    `directions`: (beta, gamma) of its pushes, deg.
    """
    settings = [f"title: {json.dumps(title)}"]
    if all(is_straight_down(*direction, TOLERANCE_DEG) for direction in directions):
        settings.append("role: natural_sand")
    if key in (*MEDIA, *SANDS):
        settings.append(f"published_as: {key}")
    return f"  {key}: {{{', '.join(settings)}}}"
