"""``rftfit simulate``: one run of the robot, as numbers, figure and animation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rftfit.cli.output import say, warn
from rftfit.cli.scale import number_of
from rftfit.errors import InputError


def simulate(
    frequency: Annotated[
        float, typer.Option(parser=number_of, metavar="Hz", help="Stride frequency.")
    ],
    curvature: Annotated[
        float,
        typer.Option(
            parser=number_of, metavar="R'/r", help="Legs: 1 c-leg, 0 flat, -1 reversed c-leg."
        ),
    ],
    medium: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Published medium, or with --results one of a campaign."),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            help="table (default: alpha as measured), fourier, generic or depth_only; with --alpha "
            "always generic."
        ),
    ] = None,
    results: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Take the tables of a campaign's results.")
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Fit in those results: lsq (default) or dft-index.")
    ] = None,
    alpha: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="N/cm^3",
            help="A medium known by one vertical penetration test: as for rftfit scale.",
        ),
    ] = None,
    robot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Robot; default: the paper's.")
    ] = None,
    phase: Annotated[
        float,
        typer.Option(parser=number_of, metavar="TURNS", help="Turn of the legs at the start."),
    ] = 0.0,
    output: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")] = Path(
        "simulation"
    ),
    animation: Annotated[
        bool, typer.Option("--animation/--no-animation", help="Two strides, with the forces.")
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a text for people.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Overwrite files that rftfit did not write.")
    ] = False,
) -> None:
    """Run the legged robot until its speed is steady.

    Prints speed and outcome. Writes motion and ground reaction forces of both tripods over time as
    csv, a figure of the last two strides, and an animation with the force on every element as an
    arrow. x is forward, z up; a pitch above 0 is nose down.
    """
    from rftfit.cli.predict import _check_together, _source
    from rftfit.cli.simulate_files import (
        FIGURE,
        MOTION,
        check_folder,
        write_animation,
        write_motion,
    )
    from rftfit.cli.simulate_summary import as_json as json_of
    from rftfit.cli.simulate_summary import as_text
    from rftfit.robot.configfile import paper_robot, read_robot
    from rftfit.robot.run import simulate as run_robot
    from rftfit.stages.robot_figures import SAMPLES, tail_of

    kind = None if profile is None else profile.replace("_", "-")
    _check_together(medium, kind, results, method, alpha, None)
    body = paper_robot() if robot is None else read_robot(robot)
    source = _source(medium, kind, results, method, alpha, 0.0, 0.95)
    check_folder(output, force)
    try:
        run = run_robot(
            body, source.profile, frequency, curvature, phase, samples_per_stride=SAMPLES
        )
    except ValueError as error:
        raise InputError(str(error)) from error
    tail = tail_of(run, SAMPLES)
    names = {"robot": body.title, "profile": source.name}
    told = f"{frequency:g} Hz, R'/r = {curvature:g}"
    files = {"motion": str(output / MOTION), "figure": str(output / FIGURE)}
    if animation:
        files["animation"] = str(output / "animation.gif")
    if as_json:
        say(json_of(names, run, tail, files))
    else:
        say(f"Robot: {body.title}, {told}\nProfile: {source.name}\n\n{as_text(run, tail)}\n")
    if run.warning:
        warn(f"warning: {run.warning}")
    if run.outcome != "steady":
        warn(f"warning: no steady speed: {run.outcome}")
    # after the numbers are out: a folder that cannot be written must not hide them
    write_motion(output, run, tail, [body.title, told, source.name])
    if not as_json:
        say(f"Motion and forces: {files['motion']}\nFigure: {files['figure']}")
    if animation:
        made = write_animation(output, body, source.profile, run, SAMPLES, f"{body.title}, {told}")
        if not as_json:
            say(f"Animation: {', '.join(map(str, made))}")
