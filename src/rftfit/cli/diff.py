"""``rftfit diff``: which numbers of two folders of results are different, and because of what."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import count, json_text, say, table

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

    A change is counted in half widths of the first interval; numbers without one come last. Logs, rows of the run sheet, settings,
    code and versions that are different are listed: one of them is the cause.
    """
    from rftfit.workflow.diff import compare

    found = compare(first, second)
    differences, changes = found.numbers, found.changes
    if as_json:
        changed, because = ([vars(one) for one in part] for part in (differences, changes))
        facts = {"changed": changed, "because": because, "only_in_one": found.alone}
        say(json_text(facts | {"not_as_recorded": found.unrecorded}))
        return
    if not differences:
        say("No alpha, coefficient, zeta or peak is different.")
    else:
        files = Counter(one.file for one in differences)
        say(
            f"{count(len(differences), 'number')} changed, in {', '.join(files)}; the largest first:"
        )
        shown = differences if all_ else differences[:_MOST]
        rows = [
            [one.file, one.row, one.quantity, f"{one.was:.6g}", f"{one.now:.6g}",
             f"{one.half_widths:.2g}" if math.isfinite(one.half_widths) else ""]
            for one in shown
        ]  # fmt: skip
        say(table(["table", "row", "quantity", "A", "B", "half widths"], rows))
        if len(differences) > len(shown):
            say(f"  and {len(differences) - len(shown)} more (--all lists them)")
    for name in found.alone:
        say(f"Only in one of them: {name}")
    for path in found.unrecorded:
        say(f"Not as recorded (edited, or its run was not finished): {path}")
    recorded = "By their records, what" if found.unrecorded else "What"
    say(f"{recorded} they were made from {'differs in:' if changes else 'is the same.'}")
    for change in changes if all_ else changes[:_MOST]:
        say(f"  {change}")
    if not all_ and len(changes) > _MOST:
        say(f"  and {len(changes) - _MOST} more (--all lists them)")
