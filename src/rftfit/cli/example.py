"""``rftfit example``: a real campaign, from its logs to forces on legs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli.output import say
from rftfit.errors import InputError


def example(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which example: cmu-sand.")],
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Where to; default: a folder of the example's name."),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="DIR or URL",
            help="Take the logs from this folder or mirror instead of the public repository.",
        ),
    ] = None,
) -> None:
    """Run a campaign of real logs: download them, find clocks and surface, fit, scale, predict.

    cmu-sand: nine penetrations of circular plates of three sizes into sand, force in ROS bags and
    motion in text files on another clock (23 MB).
    """
    from rftfit.campaign.problems import did_you_mean
    from rftfit.cli.example_files import EXAMPLES, fetch_logs, lay_out, own_files

    if name not in EXAMPLES:
        nearest = did_you_mean(name, tuple(EXAMPLES))
        hint = f"; did you mean {nearest}?" if nearest else ""
        raise InputError(f"no example {name!r}; allowed: {', '.join(EXAMPLES)}{hint}")
    chosen = EXAMPLES[name]
    target = Path(name) if folder is None else folder
    say(f"{chosen.title.capitalize()}, in {target}")
    source = own_files(name)
    lay_out(source, target)
    fetch_logs(chosen, source, target / "raw", origin)
    say()
    from rftfit.cli.example_plates import run_plates

    say(run_plates(target / "config" / "config.yaml", target / "results"))
