"""``rftfit plan``: options of a plan of the next pushes; its target, and the map of what was pushed already.

The *target* is what is to be known well: the map (alpha in all directions), zeta (the size of alpha), or forces on a body.
Directions are angles of the plate, beta, and of its path, gamma, in degrees.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.output import check_picture, check_target, print_answer, print_line, write_picture
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.forces.planning import Target
    from rftfit.model.maps import Map

_DRAWN = "drawn by rftfit plan"
"""Mark in a figure: only figures with it are overwritten unasked."""

TARGETS = ("map", "zeta", "legs", "robot")
"""Values of --target."""


@options.grouped
def plan(
    *,
    target: Annotated[
        str | None,
        typer.Option(
            help="What is to be known: map (default), zeta, legs (the three model legs), robot (the "
            "paper's, at 2 Hz); or a leg, an outline or a mesh, by the options of rftfit predict."
        ),
    ] = None,
    body: options.BodyOptions,
    mesh_options: options.MeshOptions,
    push_options: options.PushOptions,
    results: Annotated[
        Path | None,
        options.word_option("DIR", "What was pushed already: a medium of a campaign's results."),
    ] = None,
    medium: Annotated[str | None, options.word_option("NAME", "Medium of --results.")] = None,
    beta: Annotated[
        str | None,
        options.word_option(
            "DEG,DEG", "Angles of the plate that the rig can hold; default: the paper's."
        ),
    ] = None,
    gamma: Annotated[
        str | None,
        options.word_option(
            "DEG,DEG", "Angles of the path that the rig can make; default: the paper's."
        ),
    ] = None,
    pairs: Annotated[
        bool, typer.Option("--pairs", help="The way back along each path is measured too.")
    ] = False,
    depths: Annotated[
        int, typer.Option(min=1, max=20, help="Runs that a horizontal direction takes.")
    ] = 3,
    error_percent: Annotated[
        float, options.number_option("PERCENT", "Standard error of a push, of its alpha.")
    ] = 5.0,
    turn: Annotated[
        list[str] | None,
        options.word_option(
            "LEG",
            "Weigh one turn of this model leg beside the pushes, if its force can be measured; may be repeated.",
        ),
    ] = None,
    number: Annotated[int, typer.Option("--count", min=1, max=60, help="Pushes to plan.")] = 8,
    confidence: options.Level = 0.95,
    output: Annotated[Path, options.file_option("File of the rows for a run sheet.")] = Path(
        "plan.csv"
    ),
    figure: Annotated[Path | None, options.file_option("Also a figure: png, svg or pdf.")] = None,
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Choose which pushes to make next, so that a force, zeta or the whole map is known best.

    Prints the pushes in their order, with the half width of the target's interval after each, and writes
    rows for a run sheet.
    """
    from rftfit.forces.planning import SHEET_COLUMNS, reachable, run_sheet_rows
    from rftfit.reference import LEGS
    from rftfit.store import write_text

    options.check_confidence(confidence)
    if not 0 < error_percent <= 100:
        raise InputError(f"--error-percent: found {error_percent:g}; allowed: above 0, up to 100")
    read = (*push_options.files, body.outline, body.path, mesh_options.mesh)
    check_target(output, SHEET_COLUMNS, "rows of the run sheet", force, read)
    check_picture(figure, _DRAWN, force)
    turns = [
        (rftfit.model_leg(choose("--turn", leg, LEGS)), rftfit.rotation()) for leg in turn or ()
    ]
    aim = find_target(target, body, mesh_options)
    betas, gammas = _read_angles("--beta", beta), _read_angles("--gamma", gamma)
    # what is known of the medium before the planned pushes
    before = _estimate_present_map(push_options, results, medium, (betas, gammas), confidence)
    limits = rftfit.Rig(reachable(before, betas, gammas), pairs, depths, error_percent)
    try:
        plan_made = rftfit.plan(aim, before, limits, number, confidence, turns)
    except ValueError as error:
        raise InputError(str(error)) from error
    print_answer(plan_made, as_json, run_sheet_rows=str(output))
    write_text(output, run_sheet_rows(plan_made))
    if figure is not None:
        from rftfit.figures.plan import draw_plan

        write_picture(figure, draw_plan(plan_made, before), _DRAWN)
    if not as_json:
        print_line(f"Rows for a run sheet: {output}" + (f"; figure: {figure}" if figure else ""))
        if any(gamma == 0 for step in plan_made.steps for _, gamma in step.directions):
            print_line(
                "Their level runs lie at the paper's depths: take others where your pushes or your body go less deep."
            )


def find_target(
    target: str | None, body: options.BodyOptions, mesh_options: options.MeshOptions
) -> Target | str:
    """Return the target of a plan, or its name where it is ``map`` or ``zeta``, by the options of the command line.

    `target`: Value of --target; None: not given, then a body given by options is the target, or else the map.
    """
    from rftfit.forces.outlines import CURVATURES
    from rftfit.forces.planning import peaks

    mesh_options.check(body, has_figure=False)
    if mesh_options.mesh is not None:
        if target is not None:
            raise InputError("found --target and --mesh; allowed: one of them")
        options.check_friction(mesh_options.friction)
        mesh = options.read_mesh(mesh_options.mesh, str(mesh_options.unit), mesh_options.sheet)
        return peaks([mesh], mesh_options.make_motion(mesh, body.path), mesh_options.friction)
    if body.outlines_given:
        if target is not None:
            raise InputError("found --target and a body; allowed: one of them")
        return peaks([body.make_outline()], body.make_motion())
    if body.path is not None or body.hip is not None or body.width is not None:
        raise InputError(
            "--hip, --path and --width belong to a body: --leg, --curvature or --outline"
        )
    choose("--target", target or "map", TARGETS)
    if target == "legs":
        return peaks([rftfit.model_leg(name) for name in CURVATURES])
    if target == "robot":
        from rftfit.robot.config import paper_robot
        from rftfit.robot.sweep import speed_target

        # curvature of the legs R'/r and stride frequency, Hz: c-legs, flat and reversed legs
        return speed_target(paper_robot(), [(1.0, 2.0), (0.0, 2.0), (-1.0, 2.0)])
    return target or "map"


def _read_angles(option: str, text: str | None) -> tuple[float, ...]:
    """Read a list of angles, degrees, the value of the option that `option` names; empty where it was not given."""
    if text is None:
        return ()
    angles = tuple(options.parse_numbers(option, text))
    if wrong := [angle for angle in angles if not abs(angle) <= 90]:
        raise InputError(f"{option}: found {wrong[0]:g}; allowed: -90 to 90 degrees")
    return angles


def _estimate_present_map(
    pushes: options.PushOptions,
    results: Path | None,
    medium: str | None,
    angles: tuple[tuple[float, ...], tuple[float, ...]],
    confidence: float,
) -> Map:
    """Estimate the map from the pushes that were made; without any, return the map of all known media.

    `pushes`: Options of tables of pushes. `results`, `medium`: A medium of a campaign instead; None: not given. `angles`:
    Angles beta of the plate and gamma of the path that the rig can have, degrees; empty: the paper's.
    """
    from rftfit.forces.planning import prior_map
    from rftfit.model.maps import estimate, map_nodes
    from rftfit.model.pushes import pushes_of

    # nodes: directions of the map, which have to be those that the rig can push
    nodes, name = map_nodes(*angles), str(medium)
    if (results is None) != (medium is None) or (results is not None and pushes):
        raise InputError(
            "allowed: --pushes FILE, --profile-file FILE or both; or --results DIR with --medium NAME; or none "
            "of them"
        )
    try:
        if pushes:
            name, table = pushes.read()
            beta_deg, gamma_deg = angles
            return rftfit.estimate_map(
                table,
                confidence=confidence,
                name=Path(name).stem,
                beta_deg=beta_deg,
                gamma_deg=gamma_deg,
            )
        if results is None:
            return prior_map(nodes=nodes)
        campaign = rftfit.open(results)
        pushes_made = pushes_of(campaign[name].alpha, campaign.config)
        return estimate(pushes_made, campaign.shapes(name), nodes, confidence=confidence, name=name)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error
