"""``rftfit compare``: whether two media, sessions or folders of results are different."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_picture, json_text, print_line
from rftfit.store.text import count, table

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
            "@LABEL for a session; or a profile file of rftfit export.",
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
    comparison = rftfit.compare_media(first, second, confidence)
    print_line(_as_json(comparison) if as_json else _as_text(comparison, 10**9 if all_ else _MOST))
    if figure is not None:
        from rftfit.figures.comparison import draw_comparison
        from rftfit.figures.style import content
        from rftfit.store import write_bytes

        write_bytes(figure, content(draw_comparison(comparison), ending, _DRAWN))
        if not as_json:
            print_line(f"Figure: {figure}")


def _as_json(comparison: Comparison) -> str:
    facts = vars(comparison) | {"sentence": comparison.sentence}
    facts["directions"] = comparison.directions.to_dict("records")
    return json_text(facts)


def _as_text(comparison: Comparison, most: int) -> str:
    level = f"{100 * comparison.confidence:g} % interval"
    rows = [
        [
            "ratio of sizes, B/A",
            f"{comparison.ratio:.4g}",
            f"{comparison.ratio_lo:.4g} to {comparison.ratio_hi:.4g}",
            _p(comparison.size_p),
            f"{comparison.least_ratio:.3g}",
        ]
    ]
    if not math.isnan(comparison.shape_p):
        rows.append(
            [
                "difference of shape, rms",
                f"{comparison.shape_percent:.2g} %",
                f"{comparison.shape_lo_percent:.2g} to {comparison.shape_hi_percent:.2g} %",
                _p(comparison.shape_p),
                f"{comparison.least_shape_percent:.2g} %",
            ]
        )
    lines = [
        comparison.sentence,
        "",
        f"A: {comparison.a}\nB: {comparison.b}",
        table(["", "", level, "p of no difference", "least detected"], rows),
    ]
    if len(comparison.directions):
        shown = count(len(comparison.directions), "common direction")
        along, across = (
            f"{100 * share:.2g} %"
            for share in (comparison.scatter_along, comparison.scatter_across)
        )
        lines.append(
            f"{shown}, {comparison.runs_a} and {comparison.runs_b} runs; scatter of a run: {along} along the force, {across} across"
        )
    lines += [f"Note: {note}" for note in comparison.notes]
    if len(comparison.directions):
        lines += ["", _directions(comparison, most)]
    return "\n".join(lines)


def _directions(comparison: Comparison, most: int) -> str:
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
    for row in comparison.directions.head(most).to_dict("records"):
        numbers = [f"{row['beta_deg']:g}", f"{row['gamma_deg']:.4g}", _number(row["depth_cm"], "g")]
        for c in "zx":
            names = (f"difference_{c}{end}_N_per_cm3" for end in ("", "_lo", "_hi"))
            middle, low, high = (row[name] for name in names)
            numbers.append(_number(middle, ".3g"))
            numbers.append("" if math.isnan(low) else f"{low:.2g} to {high:.2g}")
        rows.append([*numbers, _p(row["p"])])
    text = table(head, rows)
    title = "Directions that differ most (degrees, cm, N/cm^3; intervals hold together):"
    rows_left = len(comparison.directions) - len(rows)
    return f"{title}\n{text}" + (
        f"\n  and {rows_left} more (--all lists them)" if rows_left > 0 else ""
    )


def _number(value: float, number_format: str) -> str:
    return "" if math.isnan(value) else format(value, number_format)


def _p(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.2g}"
