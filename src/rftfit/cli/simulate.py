"""``rftfit simulate`` and ``rftfit sweep``: options and files of a run of the robot, of the whole sweep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_target, print_answer, print_line, warn, write_csv, write_picture
from rftfit.errors import InputError, OutputError
from rftfit.store.links import refuse_target_by_link

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.figures.animation import Picture


MOTION = "motion.csv"
"""File of the table of motion, in the folder of a run."""
MARK = "# motion written by rftfit simulate"
"""Beginning of the first line of a table of motion: only tables with it are overwritten unasked."""

FIGURE = "motion.png"
PICTURES = (FIGURE, "animation.gif", "animation.mp4")
"""Files that a run writes beside the table of motion."""


def check_folder(folder: Path, force: bool) -> None:
    """Refuse to write into a folder with files that an earlier run did not write, unless the user said `force`."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; name a folder for the results")
    check_target(folder / MOTION, MARK, "motion", force)
    for name in PICTURES:
        refuse_target_by_link(folder / name)
    existing = [name for name in PICTURES if (folder / name).exists()]
    # pictures beside a table of motion by this command are by this command, too
    if existing and not force and not (folder / MOTION).exists():
        raise InputError(
            f"{folder}: {', '.join(existing)} would be overwritten and no {MOTION} of rftfit simulate "
            "is beside it; name another folder with --output, or add --force"
        )


def write_animation(folder: Path, shots: Sequence[Picture], seconds: float) -> list[Path]:
    """Write an animation as gif, and as mp4 where ffmpeg is installed; return the files.

    `shots`: Its pictures, in their order. `seconds`: Time for which each is shown.
    """
    from rftfit.figures.animation import gif_bytes, mp4_bytes
    from rftfit.store import write_bytes

    written = [folder / "animation.gif"]
    write_bytes(written[0], gif_bytes(shots, seconds))
    if (movie := mp4_bytes(shots, seconds)) is not None:
        written.append(folder / "animation.mp4")
        write_bytes(written[1], movie)
    return written


@options.grouped
def simulate(
    frequency: Annotated[float, options.number_option("Hz", "Stride frequency.")],
    curvature: Annotated[
        float, options.number_option("R'/r", "Legs: 1 c-leg, 0 flat, -1 reversed c-leg.")
    ],
    medium_options: options.MediumOptions,
    se: options.ErrorOfTest = None,
    robot: Annotated[Path | None, options.file_option("Robot; default: the paper's.")] = None,
    phase: Annotated[float, options.number_option("TURNS", "Turn of the legs at the start.")] = 0.0,
    output: Annotated[Path, options.word_option("DIR", "Folder of the results.")] = Path(
        "simulation"
    ),
    animation: Annotated[
        bool, typer.Option("--animation/--no-animation", help="Two strides, with the forces.")
    ] = True,
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Run the legged robot until its speed is steady.

    Prints speed and outcome. Writes motion and ground reaction forces of both tripods over time as
    csv, a figure of the last two strides, and an animation with the force on every element as an
    arrow. x is forward, z up; a pitch above 0 is nose up.
    """
    medium_options.check(se)
    from rftfit.figures.animation import animate_run
    from rftfit.figures.robot import draw_motion
    from rftfit.robot.answer import SimulationAnswer
    from rftfit.robot.config import paper_robot, read_robot
    from rftfit.robot.motion import SAMPLES

    body = paper_robot() if robot is None else read_robot(robot)
    source = medium_options.find_profile(se)
    check_folder(output, force)
    try:
        run = rftfit.simulate(
            source, frequency, curvature, body, phase_turns=phase, samples_per_stride=SAMPLES
        )
    except ValueError as error:
        raise InputError(str(error)) from error
    answer = SimulationAnswer(body.title, source.name, run)
    files = {"motion": str(output / MOTION), "figure": str(output / FIGURE)}
    if animation:
        files["animation"] = str(output / "animation.gif")
    print_answer(answer, as_json, files=files)
    for doubt in answer.doubts:
        warn(f"warning: {doubt}")
    # after the numbers are out: a folder that cannot be written must not hide them
    assert run.series is not None
    write_csv(output / MOTION, run.series.table(), MARK, answer.notes, digits=9)
    # in one format: to draw three would take longer than the run
    write_picture(output / FIGURE, draw_motion(answer.tail))
    if not as_json:
        print_line(f"\nMotion and forces: {files['motion']}\nFigure: {files['figure']}")
    if animation:
        shots, seconds = animate_run(body, source, run, f"{body.title}, {answer.condition}")
        written = write_animation(output, shots, seconds)
        if not as_json:
            print_line(f"Animation: {', '.join(map(str, written))}")


SWEEP = tuple(f"results/robot_full/{name}.csv" for name in ("speed", "optimum", "errors"))
"""Tables of the whole sweep: a run each, the best curvatures, differences from measured speeds."""
SWEEP_FIGURES = ("speed", "profiles", "curvature")
"""Names of its figures, after ``robot_full_``."""


def sweep(
    config: options.CampaignConfig = options.CONFIG,
    cores: options.Cores = None,
    cluster: options.Cluster = None,
) -> None:
    """Run the robot over the paper's 51 curvatures, 26 frequencies and 3 starting phases.

    Makes the tables that it needs first, as `rftfit run` does; then the tables and figures of the whole
    sweep, in results/robot_full and results/figures. Profiles that are finished are kept when it is stopped:
    start it again to go on.
    """
    from rftfit.campaign.load import load_campaign
    from rftfit.cli.run import run

    campaign = load_campaign(config)
    if not campaign.robot_medium:
        section = campaign.config.robot
        why = (
            "there is no section robot, so there is no robot to run"
            if section is None
            else f"key robot.medium: {section.medium} has no runs, so there is nothing to run on"
        )
        raise InputError(f"config, {why}")
    figures = [f"results/figures/robot_full_{name}.png" for name in SWEEP_FIGURES]
    run([*SWEEP, *figures], config=config, cores=cores, cluster=cluster)
