"""``rftfit init``: options of a new campaign, and what is said of the next steps; `rftfit.campaign` writes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import print_line
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.campaign.tables import TableRead


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the new campaign; made if need be.")
    ],
    stress_table: Annotated[
        Path | None, options.file_option("The data are this table of stress against depth.")
    ] = None,
    alpha_table: Annotated[
        Path | None, options.file_option("The data are this table of alpha, long or in blocks.")
    ] = None,
) -> None:
    """Make a new campaign: configuration, empty run sheet, and a README that says what goes where.

    With a table the campaign needs no logs and is ready to run. Nothing that is there is ever
    overwritten.
    """
    if stress_table is not None and alpha_table is not None:
        raise InputError("--stress-table and --alpha-table: a campaign is one table, not two")
    from rftfit.campaign.new_campaign import init_campaign, init_from_table

    table = stress_table or alpha_table
    # read: the table, with the columns and units that were found in it
    if table:
        written, read = init_from_table(folder, table, "stress" if stress_table else "alpha")
    else:
        written = init_campaign(folder)
    print_line(f"A new campaign is in {folder}:")
    for path in sorted(written):
        print_line(f"  {path.relative_to(folder).as_posix()}")
    print_line()
    # quoted where it has blanks, so that it can be pasted into a shell
    shown = f'"{folder}"' if " " in str(folder) else str(folder)
    if table:
        print_line(f"read as: {read.units}\n" if read.units else "")
        _print_next_steps(folder, shown, read)
        return
    print_line("Next:")
    print_line(
        f"  1. describe transducer, arm, intruders and media in {folder / 'config/config.yaml'}"
    )
    print_line(f"  2. put the logs into {folder / 'raw'} and one row per run into")
    print_line(f"     {folder / 'config/runs.csv'} ({folder / 'README.md'} has example rows)")
    print_line(f"  3. cd {shown}, then rftfit check until all is well, then rftfit run")


def _print_next_steps(folder: Path, shown: str, read: TableRead) -> None:
    """Print what to do next in a campaign that was made from a table, with the problems of the table.

    `shown`: Its folder as a shell reads it. `read`: The table, so that it need not be read again.
    """
    from rftfit.campaign.load import check_campaign
    from rftfit.campaign.problems import in_lines

    campaign, problems = check_campaign(folder / "config/config.yaml", read)
    for line in in_lines(problems)[:20]:
        print_line(f"  {line}")
    if campaign is not None:
        print_line(campaign.summary())
        print_line()
        print_line(f"Next: cd {shown}, then rftfit run")
        return
    print_line()
    print_line(
        "Next: names and units of the table's columns go under `table` in config/config.yaml; then"
    )
    print_line(f"cd {shown}, rftfit check until all is well, then rftfit run")
