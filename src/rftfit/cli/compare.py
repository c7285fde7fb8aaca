"""``rftfit compare``: whether two media, sessions or folders of results are different."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_picture, count, json_text, say
from rftfit.store.text import table

if TYPE_CHECKING:
    from rftfit.compare.contrast import Comparison

_DRAWN = "drawn by rftfit compare"
_MOST = 5


def compare(
    first: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="Medium of the campaign in this folder, FOLDER:MEDIUM, FOLDER with one medium, or one of these with "
            "@LABEL for a session.",
        ),
    ],
    second: Annotated[str, typer.Argument(metavar="B", help="The same.")],
    confidence: options.Level = 0.95,
    figure: Annotated[Path | None, options.file("Also a figure: png, svg or pdf.")] = None,
    all_: Annotated[bool, typer.Option("--all", help="List every common direction.")] = False,
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Tell whether two media, two sessions or two folders of results differ, in size and in shape.

    Compares single runs in common directions. Prints the ratio of sizes and the difference of shape, each with its
    interval and p value, and the least differences that these runs would show.
    """
    options.check_confidence(confidence)
    ending = check_picture(figure, "--figure", _DRAWN, force) if figure is not None else ""
    found = rftfit.compare_media(first, second, confidence)
    say(_as_json(found) if as_json else _as_text(found, 10**9 if all_ else _MOST))
    if figure is not None:
        from rftfit.figures.comparison import draw
        from rftfit.figures.style import content
        from rftfit.store import write_bytes

        write_bytes(figure, content(draw(found), ending, _DRAWN))
        if not as_json:
            say(f"Figure: {figure}")


def _as_json(found: Comparison) -> str:
    facts = vars(found) | {"sentence": found.sentence}
    facts["directions"] = found.directions.to_dict("records")
    return json_text(facts)


def _as_text(found: Comparison, most: int) -> str:
    level = f"{100 * found.confidence:g} % interval"
    rows = [
        [
            "ratio of sizes, B/A",
            f"{found.ratio:.4g}",
            f"{found.ratio_lo:.4g} to {found.ratio_hi:.4g}",
            _p(found.size_p),
            f"{found.least_ratio:.3g}",
        ]
    ]
    if not math.isnan(found.shape_p):
        rows.append(
            [
                "difference of shape, rms",
                f"{found.shape_percent:.2g} %",
                f"{found.shape_lo_percent:.2g} to {found.shape_hi_percent:.2g} %",
                _p(found.shape_p),
                f"{found.least_shape_percent:.2g} %",
            ]
        )
    lines = [
        found.sentence,
        "",
        f"A: {found.a}\nB: {found.b}",
        table(["", "", level, "p of no difference", "least detected"], rows),
    ]
    if len(found.directions):
        shown = count(len(found.directions), "common direction")
        along, across = (
            f"{100 * part:.2g} %" for part in (found.scatter_along, found.scatter_across)
        )
        lines.append(
            f"{shown}, {found.runs_a} and {found.runs_b} runs; scatter of a run: {along} along the force, {across} across"
        )
    lines += [f"Note: {note}" for note in found.notes]
    if len(found.directions):
        lines += ["", _directions(found, most)]
    return "\n".join(lines)


def _directions(found: Comparison, most: int) -> str:
    """List the directions that differ most."""
    head = [
        "beta",
        "gamma",
        "depth",
        "B/ratio - A: alpha_z",
        "interval",
        "alpha_x",
        "interval",
        "p",
    ]
    rows = []
    for row in found.directions.head(most).to_dict("records"):
        numbers = [f"{row['beta_deg']:g}", f"{row['gamma_deg']:.4g}", _number(row["depth_cm"], "g")]
        for c in "zx":
            names = (f"difference_{c}{end}_N_per_cm3" for end in ("", "_lo", "_hi"))
            middle, low, high = (row[name] for name in names)
            numbers.append(_number(middle, ".3g"))
            numbers.append("" if math.isnan(low) else f"{low:.2g} to {high:.2g}")
        rows.append([*numbers, _p(row["p"])])
    text = table(head, rows)
    title = "Directions that differ most (degrees, cm, N/cm^3; intervals hold together):"
    more = len(found.directions) - len(rows)
    return f"{title}\n{text}" + (f"\n  and {more} more (--all lists them)" if more > 0 else "")


def _number(value: float, how: str) -> str:
    return "" if math.isnan(value) else format(value, how)


def _p(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.2g}"
