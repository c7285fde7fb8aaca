"""``rftfit verify``: options, and when it ends with exit code 5; see `rftfit.workflow.verify`, ``remake``."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli import options
from rftfit.cli.exit_codes import NOT_AS_RECORDED
from rftfit.cli.output import print_answer
from rftfit.cli.run import shown_jobs
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.workflow.remake import Remade
    from rftfit.workflow.verify import Verified


def verify(
    results: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RESULT", help="Files or folders below results/; default: all of them."
        ),
    ] = None,
    config: options.CampaignConfig = options.CONFIG,
    all_: Annotated[
        bool, typer.Option("--all", help="List everything, however long the lists are.")
    ] = False,
    again: Annotated[
        bool,
        typer.Option(
            "--again",
            help="Make all results again in a temporary folder and compare them byte by byte; takes as long as a run.",
        ),
    ] = False,
    cores: Annotated[
        int | None, typer.Option(min=1, help="With --again: jobs at once; default: all cores.")
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Tell what results were made from, and whether all of it is still the same.

    Every log and every result is read and its SHA-256 compared with the records of the stages; so are
    the rows of the run sheet, the values of the configuration and the program's own code. Ends with
    exit code 5 when anything differs.

    Whoever changes a result can change its record too: with --again nothing is taken from records.
    """
    from rftfit.workflow.records import Recorded
    from rftfit.workflow.state import read_states

    now = Recorded(read_states(config))
    if again:
        if results:
            raise InputError(
                f"--again: found {results[0]}; allowed: no results, since all of them are made again"
            )
        from rftfit.workflow.remake import remake

        with nullcontext(lambda *_: None) if as_json else shown_jobs() as on_job:
            answer: Verified | Remade = remake(now, cores, on_job)
    else:
        from rftfit.workflow.verify import verify_results

        answer = verify_results(now, results or [])
    print_answer(answer, as_json, None if all_ else 5)
    if not answer.is_as_recorded:
        raise typer.Exit(NOT_AS_RECORDED)
