"""``rftfit example``: the list of examples of the validation suite, or one run and judged (`rftfit.suite`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import json_text, print_line, warn
from rftfit.errors import InputError
from rftfit.store.text import megabytes, table

if TYPE_CHECKING:
    from rftfit.suite.declared import Example


def example(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="Which example (--list), or a folder that holds one, as ./mine."
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Where to; default: a folder of the example's name."),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="DIR or URL",
            help="Take the data from this folder (or below it) or mirror instead of their public addresses.",
        ),
    ] = None,
    list_all: Annotated[bool, typer.Option("--list", help="List the examples and stop.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Run an example of the validation suite: real data, and the authors' own answer beside ours.

    Data are downloaded, checked against their sha256 and run; each published number gets a verdict: inside, outside or
    not comparable, with the reason.
    """
    from rftfit.suite.declared import find_example

    if list_all:
        _list_examples(as_json)
        return
    if name is None:
        raise InputError("found no NAME; allowed: one of rftfit example --list")
    chosen_example = find_example(name)
    _run_and_print(chosen_example, folder or Path(chosen_example.name), origin, as_json)


def _list_examples(as_json: bool) -> None:
    """Print all examples that come with the program, one a line, or as JSON."""
    from rftfit.suite.declared import find_example, list_examples

    examples = [find_example(name) for name in list_examples()]
    facts = [example.as_dict() for example in examples]
    if as_json:
        print_line(json_text(facts))
        return
    rows = [
        [
            fact["name"],
            fact["title"],
            ", ".join(fact["domains"]),
            megabytes(fact["bytes"]),
            ", ".join(fact["licences"]) or "-",
        ]
        for fact in facts
    ]
    print_line(table(["name", "what", "domain", "data", "licence of the data"], rows, indent=""))


def _run_and_print(example: Example, folder: Path, origin: str | None, as_json: bool) -> None:
    """Run an example in a folder and print its verdicts; `origin`: value of --from, None: not given."""
    from rftfit.suite.page import describe_verdicts
    from rftfit.suite.run import run_example
    from rftfit.suite.verdicts import count_verdicts

    # with JSON, lines of the commands that are run go to standard error
    say = warn if as_json else print_line
    verdicts = run_example(example, folder, origin, say, is_quiet=as_json)
    if as_json:
        rows = verdicts.to_dict("records")
        counts = count_verdicts(verdicts)
        print_line(json_text({"example": example.name, "counts": counts, "rows": rows}))
    else:
        print_line(f"\n{describe_verdicts(example, verdicts, folder)}")
