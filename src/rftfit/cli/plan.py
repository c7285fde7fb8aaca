"""``rftfit plan``: which pushes to make next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_picture, check_target, count, json_text, say, table
from rftfit.cli.predict import make_motion, make_outline
from rftfit.cli.scale import told_by
from rftfit.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.model.planning import Plan, Target
    from rftfit.model.shapes import Map

MARK = "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,depth_cm"
"""How the first line of such rows begins: only these are overwritten unasked."""

_DRAWN = "drawn by rftfit plan"

TARGETS = ("map", "zeta", "legs", "robot")
_DEPTHS_CM = (2.54, 5.08, 7.62)
_MOST = 60


def plan(
    target: Annotated[
        str | None,
        typer.Option(
            help="What is to be known: map (default), zeta, legs (the three model legs), robot (the "
            "paper's, at 2 Hz); or a body, by the options of rftfit predict."
        ),
    ] = None,
    leg: options.LegName = None,
    outline: Annotated[Path | None, options.file("Any outline: csv with x_cm, z_cm.")] = None,
    width: Annotated[float | None, options.number("cm", "Width of the outline.")] = None,
    hip: Annotated[
        float | None, options.number("cm", "Height that it turns about; default 2.")
    ] = None,
    path: Annotated[
        Path | None, options.file("Move it along a path: csv with t_s, x_cm, z_cm, angle_deg.")
    ] = None,
    pushes: Annotated[
        Path | None, options.file("What was pushed already: as for rftfit scale --pushes.")
    ] = None,
    profile_file: Annotated[
        Path | None,
        options.file(
            "What was pushed already: behind a profile of rftfit export, alone or with --pushes."
        ),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="What was pushed already: a medium of a campaign's results."
        ),
    ] = None,
    medium: Annotated[str | None, typer.Option(metavar="NAME", help="Medium of --results.")] = None,
    beta: Annotated[
        str | None,
        typer.Option(
            metavar="DEG,DEG",
            help="Angles of the plate that the rig can hold; default: the paper's.",
        ),
    ] = None,
    gamma: Annotated[
        str | None,
        typer.Option(
            metavar="DEG,DEG",
            help="Angles of the path that the rig can make; default: the paper's.",
        ),
    ] = None,
    pairs: Annotated[
        bool, typer.Option("--pairs", help="The way back along each path is measured too.")
    ] = False,
    depths: Annotated[
        int, typer.Option(min=1, max=20, help="Runs that a horizontal direction takes.")
    ] = 3,
    error_percent: Annotated[
        float, options.number("PERCENT", "Standard error of a push, of its alpha.")
    ] = 5.0,
    number: Annotated[int, typer.Option("--count", min=1, max=_MOST, help="Pushes to plan.")] = 8,
    confidence: options.Level = 0.95,
    output: Annotated[Path, options.file("File of the rows for a run sheet.")] = Path("plan.csv"),
    figure: Annotated[Path | None, options.file("Also a figure: png, svg or pdf.")] = None,
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Choose which pushes to make next, so that a force, zeta or the whole map is known best.

    Prints the pushes in their order, with the half width of the target's interval after each, and writes
    rows for a run sheet.
    """
    import numpy as np

    from rftfit.model.shapes import grid
    from rftfit.store import write_text

    if not 0.5 < confidence < 1:
        raise InputError(f"--confidence: found {confidence:g}; allowed: above 0.5 and below 1")
    if not 0 < error_percent <= 100:
        raise InputError(f"--error-percent: found {error_percent:g}; allowed: above 0, up to 100")
    check_target(
        output, MARK, "rows of the run sheet", force, (pushes, profile_file, outline, path)
    )
    ending = check_picture(figure, "--figure", _DRAWN, force) if figure is not None else ""
    aim = wanted(target, leg, outline, width, hip, path)
    betas, gammas = _angles("--beta", beta), _angles("--gamma", gamma)
    nodes = grid(betas, gammas)
    known = _known((pushes, profile_file), results, medium, nodes, confidence)
    directions = tuple(
        (b, g)
        for b, g in zip(*(np.degrees(part).round(4).tolist() for part in nodes), strict=True)
        if (not betas or any(abs(b - one) < 0.5 for one in betas))
        and (not gammas or any(abs(g - one) < 0.5 for one in gammas))
    )
    rig = rftfit.Rig(directions, pairs, depths, error_percent)
    try:
        found = rftfit.plan(aim, known, rig, number, confidence)
    except ValueError as error:
        raise InputError(str(error)) from error
    say(_as_json(found, output) if as_json else _as_text(found, known))
    write_text(output, _rows(found))
    if figure is not None:
        from rftfit.figures.style import content
        from rftfit.store import write_bytes

        write_bytes(figure, content(draw(found, known), ending, _DRAWN))
    if not as_json:
        say(f"Rows for a run sheet: {output}" + (f"; figure: {figure}" if figure else ""))


def wanted(
    target: str | None, leg: str | None = None, outline: Path | None = None, width: float | None = None,
    hip: float | None = None, path: Path | None = None,
) -> Target | str:  # fmt: skip
    """What is to be known, by the options of the command line."""
    from rftfit.campaign.problems import choose
    from rftfit.model.outlines import CURVATURES
    from rftfit.model.planning import peaks

    if leg is not None or outline is not None:
        if target is not None:
            raise InputError("found --target and a body; allowed: one of them")
        return peaks([make_outline(leg, None, outline, width, 30)], make_motion(hip, path))
    if path is not None or hip is not None or width is not None:
        raise InputError("--hip, --path and --width belong to a body: --leg or --outline")
    choose("--target", target or "map", TARGETS)
    if target == "legs":
        return peaks([rftfit.model_leg(name) for name in CURVATURES])
    if target == "robot":
        from rftfit.robot.config import paper_robot
        from rftfit.robot.sweep import speed_target

        return speed_target(paper_robot(), [(1.0, 2.0), (0.0, 2.0), (-1.0, 2.0)])
    return target or "map"


def _angles(option: str, text: str | None) -> tuple[float, ...]:
    """Angles of a list on the command line, degrees."""
    if text is None:
        return ()
    angles = tuple(options.number_of(part.strip()) for part in text.split(","))
    if wrong := [one for one in angles if not abs(one) <= 90]:
        raise InputError(f"{option}: found {wrong[0]:g}; allowed: -90 to 90 degrees")
    return angles


def _known(
    files: tuple[Path | None, Path | None], results: Path | None, medium: str | None,
    nodes: tuple[FloatArray, FloatArray], confidence: float,
) -> Map:  # fmt: skip
    """What was measured already, on the nodes that the rig can push."""
    from rftfit.model.planning import blank
    from rftfit.model.shapes import estimate, pushes_of, sorted_pushes

    many, name = any(files), str(medium)
    if (results is None) != (medium is None) or (results is not None and many):
        raise InputError(
            "allowed: --pushes FILE, --profile-file FILE or both; or --results DIR with --medium NAME; or none "
            "of them"
        )
    try:
        if many:
            name, table = told_by(*files)
            told = sorted_pushes(table)
            return estimate(told, None, nodes, confidence=confidence, name=Path(name).stem)
        if results is not None:
            campaign = rftfit.open(results)
            own = campaign[str(medium)]
            told = pushes_of(own.alpha, campaign.config)
            return estimate(
                told, campaign.shapes(own.name), nodes, confidence=confidence, name=own.name
            )
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error
    return blank(nodes=nodes)


def _as_text(found: Plan, known: Map) -> str:
    rows = []
    for row in found.table().to_dict("records"):
        where = ["now", "", ""]
        if row["push"]:
            way = "down and back" if row["way_back"] else ""
            where = [f"({row['beta_deg']:g}, {row['gamma_deg']:.4g})", way, f"{row['runs']}"]
        rows.append([str(row["push"]), *where, f"{row['half_width_percent']:.1f} %"])
    head = ["push", "(beta, gamma), deg", "", "runs so far", "half width"]
    width = [100 * step.typical for step in found.steps]
    told = ""
    for limit in (30, 20, 15, 10, 5):
        if width[0] > limit and min(width) <= limit:
            enough = next(i for i, one in enumerate(width) if one <= limit)
            told = f"\n{count(enough, 'push').replace('pushs', 'pushes')} are enough for {found.target} within {limit} %."
    have = f"{known.pushes} made already" if known.pushes else "none made yet"
    return (
        f"Pushes for {found.target}, {have}\n\n{table(head, rows)}\n\n"
        f"Half width of the {100 * found.confidence:g} % interval, relative, root mean square over "
        f"{', '.join(found.parts)}.{told}"
    )


def _as_json(found: Plan, output: Path) -> str:
    rows = found.table().to_dict("records")
    for row in rows:
        row |= {name: None for name in ("beta_deg", "gamma_deg") if row["push"] == 0}
    content = {"target": found.target, "parts": list(found.parts), "confidence": found.confidence}
    return json_text(content | {"pushes": rows, "run_sheet_rows": str(output)})


def _rows(found: Plan) -> str:
    """Rows of a run sheet; medium, intruder and logs are left to be filled in."""
    from rftfit.model.planning import push_rows

    lines = [f"{MARK},force_log,motion_log"]
    for number, step in enumerate(found.steps[1:], start=1):
        rows = push_rows(step, _DEPTHS_CM)
        for part, row in enumerate(rows, start=1):
            name = f"plan{number:02d}" + (f"_{part}" if len(rows) > 1 else "")
            lines.append(f"{name},plate,,,{','.join(row.values())},,")
    return "\n".join(lines) + "\n"


def draw(found: Plan, known: Map) -> Figure:
    """Half width over the number of pushes, and where they lie."""
    import numpy as np

    from rftfit.figures import style
    from rftfit.figures.maps import angle_axes

    page = style.new_figure(15.0, 7.2)
    left = style.axes_cm(page, 1.5, 0.9, 5.6, 4.9)
    width = [100 * step.typical for step in found.steps]
    left.plot(range(len(width)), width, "o-", color=style.OKABE_ITO["blue"], markersize=3)
    left.set(xlabel="further pushes", ylabel="half width (%)", yscale="log")
    left.set_yticks(
        [v for v in (1, 2, 5, 10, 20, 50, 100, 200) if min(width) / 2 < v < 2 * max(width)]
    )
    left.yaxis.set_major_formatter("{x:g}")
    left.minorticks_off()
    style.text_cm(page, 1.5, 0.1, found.target, va="top", weight="bold")
    right = style.axes_cm(page, 9.0, 0.9, 5.6, 4.9)
    angle_axes(right)
    if known.measured.any():
        at = np.degrees(known.gamma[known.measured]), np.degrees(known.beta[known.measured])
        right.plot(*at, "s", color="#888888", markersize=4, clip_on=False)
    for number, step in enumerate(found.steps[1:], start=1):
        for way, (beta, gamma) in enumerate(step.directions):
            right.plot(gamma, beta, "o", markersize=9, fillstyle="none" if way else "full",
                       color=style.OKABE_ITO["sky blue"], clip_on=False)  # fmt: skip
            right.text(gamma, beta, str(number), ha="center", va="center", fontsize=6)
    style.text_cm(page, 9.0, 0.1, "where they lie", va="top", weight="bold")
    told = "open: on the way back; square: pushed already"
    style.text_cm(page, 9.0, 0.5, told, va="top", fontsize=6)
    return page
