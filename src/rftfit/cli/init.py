"""``rftfit init``: a new campaign from the template."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rftfit.cli import options
from rftfit.cli.output import print_line
from rftfit.errors import InputError
from rftfit.store import copy_file, write_text
from rftfit.store.links import refuse_links, refuse_target_by_link

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.campaign.tables import TableRead

_UNREADABLE = (".not-text", ".web-page", ".not-a-workbook", ".too-large", ".unreadable")
"""Ends of codes of problems with a file of which nothing can be read."""


def init_campaign(folder: Path) -> list[Path]:
    """Write the files of a new campaign and list them."""
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
    return _write(folder, texts, {})


def _write(folder: Path, texts: Mapping[str, str], copied: Mapping[str, Path]) -> list[Path]:
    """Copy and write files by name into a folder and list them; nothing that is there is overwritten."""
    names = [*copied, *texts]
    refuse_target_by_link(folder)
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"{folder}: this is not a folder; name a new one or one that exists")
    # lexists: a link that leads nowhere is there too
    existing = [name for name in names if os.path.lexists(folder / name)]
    if existing:
        raise InputError(
            f"{folder}: {', '.join(existing)} would be overwritten, so nothing was written; name a "
            "new folder or move these files away"
        )
    refuse_links(folder, names)
    for name, source in copied.items():
        copy_file(source, folder / name)
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in names]


def _template(name: str) -> str:
    return files("rftfit.campaign").joinpath("template", name).read_text(encoding="utf-8")


def init_from_table(
    folder: Path, table: Path, holds: Literal["stress", "alpha"]
) -> tuple[list[Path], TableRead]:
    """Write a campaign whose data are a table of stress or alpha, copied into its raw folder."""
    from rftfit.campaign.config import TableSettings
    from rftfit.campaign.problems import CampaignError, Place
    from rftfit.campaign.schema import json_schema, reference_markdown
    from rftfit.campaign.tables import read_pushes

    if not table.is_file():
        raise InputError(f"{table}: there is no such file; allowed: a table as csv, tsv or xlsx")
    name = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "_" for c in table.name)
    read = read_pushes(table, f"raw/{name}", TableSettings(holds=holds), (), name)
    if unreadable := [problem for problem in read.problems if problem.code.endswith(_UNREADABLE)]:
        where = Place(str(table), line=unreadable[0].place.line)
        raise CampaignError([replace(unreadable[0], place=where)])
    cells: dict[str, set[tuple[float, float]]] = {key: set() for key in read.media}
    for push in read.pushes:
        cells[push.run.medium].add((push.run.beta_deg, push.run.gamma_deg))
    media = "\n".join(_medium(key, title, cells[key]) for key, title in read.media.items())
    config = _template("table.yaml").replace("@FILE@", f"raw/{name}").replace("@HOLDS@", holds)
    texts = {
        "config/README.md": reference_markdown(),
        "config/config.schema.json": json_schema(),
        "config/config.yaml": config.replace("@MEDIA@", media),
    }
    return _write(folder, texts, {f"raw/{name}": table}), read


def _medium(key: str, title: str, cells: set[tuple[float, float]]) -> str:
    """One line of the config: what the table says of a medium."""
    from rftfit.reference import MEDIA, SANDS

    facts = [f"title: {json.dumps(title)}"]
    if cells == {(0.0, 90.0)}:
        facts.append("role: natural_sand")
    if key in (*MEDIA, *SANDS):
        facts.append(f"published_as: {key}")
    return f"  {key}: {{{', '.join(facts)}}}"


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the new campaign; made if need be.")
    ],
    stress_table: Annotated[
        Path | None, options.file("The data are this table of stress against depth.")
    ] = None,
    alpha_table: Annotated[
        Path | None, options.file("The data are this table of alpha, long or in blocks.")
    ] = None,
) -> None:
    """Make a new campaign: configuration, empty run sheet, and a README that says what goes where.

    With a table the campaign needs no logs and is ready to run. Nothing that is there is ever
    overwritten.
    """
    if stress_table is not None and alpha_table is not None:
        raise InputError("--stress-table and --alpha-table: a campaign is one table, not two")
    table = stress_table or alpha_table
    if table:
        written, read = init_from_table(folder, table, "stress" if stress_table else "alpha")
    else:
        written = init_campaign(folder)
    print_line(f"A new campaign is in {folder}:")
    for path in sorted(written):
        print_line(f"  {path.relative_to(folder).as_posix()}")
    print_line()
    # as it can be pasted into a shell, also with blanks
    shown = f'"{folder}"' if " " in str(folder) else str(folder)
    if table:
        print_line(f"read as: {read.units}\n" if read.units else "")
        _say_next_of_table(folder, shown, read)
        return
    print_line("Next:")
    print_line(
        f"  1. describe transducer, arm, intruders and media in {folder / 'config/config.yaml'}"
    )
    print_line(f"  2. put the logs into {folder / 'raw'} and one row per run into")
    print_line(f"     {folder / 'config/runs.csv'} ({folder / 'README.md'} has example rows)")
    print_line(f"  3. cd {shown}, then rftfit check until all is well, then rftfit run")


def _say_next_of_table(folder: Path, shown: str, read: TableRead) -> None:
    from rftfit.campaign.load import check_campaign
    from rftfit.cli.check import describe_campaign

    campaign, problems = check_campaign(folder / "config/config.yaml", read)
    for problem in problems[:20]:
        print_line(f"  {problem}")
    if campaign is not None:
        print_line(describe_campaign(campaign))
        print_line()
        print_line(f"Next: cd {shown}, then rftfit run")
        return
    print_line()
    print_line(
        "Next: names and units of the table's columns go under `table` in config/config.yaml; then"
    )
    print_line(f"cd {shown}, rftfit check until all is well, then rftfit run")
