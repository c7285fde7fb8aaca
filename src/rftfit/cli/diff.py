"""``rftfit diff``: which numbers of two folders of results are different, and because of what."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import count, json_text, say, say_some
from rftfit.store.text import table

_MOST = 10


def diff(
    first: Annotated[
        Path, typer.Argument(metavar="A", help="A campaign, or a copy of its results.")
    ],
    second: Annotated[Path, typer.Argument(metavar="B", help="The same, made later or otherwise.")],
    all_: Annotated[bool, typer.Option("--all", help="List every number that changed.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Compare two folders of results: alpha, coefficients, zeta and peaks of legs.

    A change is counted in half widths of the first interval. zeta and alpha_z(0, 90 deg) come first, numbers without an interval last. Logs, rows of the run sheet, settings,
    code and versions that are different are listed: one of them is the cause.
    """
    from rftfit.workflow.diff import compare
    from rftfit.workflow.provenance import lines_of

    found = compare(first, second)
    differences, changes = found.numbers, found.changes
    most = 10**9 if all_ else _MOST
    if as_json:
        changed, because = ([vars(one) for one in part] for part in (differences, changes))
        facts = {"changed": changed, "because": because, "only_in_one": found.alone}
        later = {str(folder): what for folder, what in found.since.items()}
        say(json_text(facts | {"not_as_recorded": found.unrecorded, "since_the_record": later}))
        return
    if not differences:
        say("No alpha, coefficient, zeta or peak is different.")
    else:
        files = Counter(one.file for one in differences)
        say(
            f"{count(len(differences), 'number')} changed, in {', '.join(files)}; the largest first:"
        )
        rows = [
            [
                one.file,
                one.row,
                one.quantity,
                f"{one.was:.6g}",
                f"{one.now:.6g}",
                f"{one.half_widths:.2g}" if math.isfinite(one.half_widths) else "",
            ]
            for one in differences[:most]
        ]
        say(table(["table", "row", "quantity", "A", "B", "half widths"], rows))
        if len(differences) > most:
            say(f"  and {len(differences) - most} more (--all lists them)")
    say_some([f"Only in one of them: {name}" for name in found.alone], most)
    for path in found.unrecorded:
        say(f"Not as recorded (edited, or its run was not finished): {path}")
    for folder, what in found.since.items():
        say(f"Made further after the last whole run of {folder}, with other {', '.join(what)}.")
    sure = not found.unrecorded and not found.since
    if changes or sure:
        said = "differs in:" if changes else "is the same."
        say(f"{'What' if sure else 'By their records, what'} they were made from {said}")
    else:
        say("What they were made from is not in their records; a whole `rftfit run` writes it.")
    lines = map(str, changes) if all_ else lines_of(changes)
    say_some([f"  {line}" for line in lines], most)
    if any(change.sort in ("code", "version") for change in changes):
        say("What a version of the program changed, and why, stands in its CHANGELOG.md.")
