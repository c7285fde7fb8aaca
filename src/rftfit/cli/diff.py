"""``rftfit diff``: which numbers of two folders of results are different, and because of what."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import json_text, print_line, say_some
from rftfit.store.text import count, table

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
    from rftfit.workflow.diff import compare_folders
    from rftfit.workflow.provenance import format_changes

    comparison = compare_folders(first, second)
    differences, changes = comparison.numbers, comparison.changes
    most = 10**9 if all_ else _MOST
    if as_json:
        changed, because = (
            [vars(entry) for entry in entries] for entries in (differences, changes)
        )
        facts = {"changed": changed, "because": because, "only_in_one": comparison.alone}
        later = {str(folder): what for folder, what in comparison.since.items()}
        print_line(
            json_text(facts | {"not_as_recorded": comparison.unrecorded, "since_the_record": later})
        )
        return
    if not differences:
        print_line("No alpha, coefficient, zeta or peak is different.")
    else:
        files = Counter(difference.file for difference in differences)
        print_line(
            f"{count(len(differences), 'number')} changed, in {', '.join(files)}; the largest first:"
        )
        rows = [
            [
                difference.file,
                difference.row,
                difference.quantity,
                f"{difference.was:.6g}",
                f"{difference.now:.6g}",
                f"{difference.half_widths:.2g}" if math.isfinite(difference.half_widths) else "",
            ]
            for difference in differences[:most]
        ]
        print_line(table(["table", "row", "quantity", "A", "B", "half widths"], rows))
        if len(differences) > most:
            print_line(f"  and {len(differences) - most} more (--all lists them)")
    say_some([f"Only in one of them: {name}" for name in comparison.alone], most)
    for path in comparison.unrecorded:
        print_line(f"Not as recorded (edited, or its run was not finished): {path}")
    for folder, what in comparison.since.items():
        print_line(
            f"Made further after the last whole run of {folder}, with other {', '.join(what)}."
        )
    sure = not comparison.unrecorded and not comparison.since
    if changes or sure:
        verdict = "differs in:" if changes else "is the same."
        print_line(f"{'What' if sure else 'By their records, what'} they were made from {verdict}")
    else:
        print_line(
            "What they were made from is not in their records; a whole `rftfit run` writes it."
        )
    lines = map(str, changes) if all_ else format_changes(changes)
    say_some([f"  {line}" for line in lines], most)
    if any(change.sort in ("code", "version") for change in changes):
        print_line("What a version of the program changed, and why, stands in its CHANGELOG.md.")
