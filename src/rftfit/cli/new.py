"""``rftfit init``: a new campaign from the template."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003  # typer asks for it at run time
from typing import Annotated

import typer

from rftfit.cli.output import say


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the new campaign; made if need be.")
    ],
) -> None:
    """Make a new campaign: configuration, empty run sheet, and a README that says what goes where.

    Nothing that is there is ever overwritten.
    """
    from rftfit.campaign.template import init_campaign

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
