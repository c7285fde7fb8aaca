"""``rftfit init``: a new campaign from the template."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli.output import say
from rftfit.errors import InputError
from rftfit.store import write_text


def init_campaign(folder: Path) -> list[Path]:
    """Write the files of a new campaign into a folder, which may hold other files, and list them.

    They are the configuration with its schema and reference, an empty run sheet, and two READMEs,
    one of them with example rows. Nothing that is there is overwritten.
    """
    # pydantic is slow to import
    from rftfit.campaign.columns import COLUMNS
    from rftfit.campaign.schema import json_schema, reference_markdown

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


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the new campaign; made if need be.")
    ],
) -> None:
    """Make a new campaign: configuration, empty run sheet, and a README that says what goes where.

    Nothing that is there is ever overwritten.
    """
    written = init_campaign(folder)
    say(f"A new campaign is in {folder}:")
    for path in sorted(written):
        say(f"  {path.relative_to(folder).as_posix()}")
    # a folder with blanks has to survive being pasted into a shell
    shown = f'"{folder}"' if " " in str(folder) else str(folder)
    say()
    say("Next:")
    say(f"  1. describe transducer, arm, intruders and media in {folder / 'config/config.yaml'}")
    say(f"  2. put the logs into {folder / 'raw'} and one row per run into")
    say(f"     {folder / 'config/runs.csv'} ({folder / 'README.md'} has example rows)")
    say(f"  3. cd {shown}, then rftfit check until all is well, then rftfit run")
