"""``rftfit simulate`` and ``rftfit sweep``: runs of the robot."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_target, comments, json_text, print_line, warn
from rftfit.errors import InputError, OutputError
from rftfit.store.links import refuse_target_by_link
from rftfit.store.text import count, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun


MOTION = "motion.csv"
MARK = "# motion written by rftfit simulate"
"""How the first line of a table of motion begins: only these are overwritten unasked."""

FIGURE = "motion.png"
OTHERS = (FIGURE, "animation.gif", "animation.mp4")


def check_folder(folder: Path, force: bool) -> None:
    """Refuse a folder with files that an earlier run did not write, unless the user said `force`."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; name a folder for the results")
    check_target(folder / MOTION, MARK, "motion", force)
    for name in OTHERS:
        refuse_target_by_link(folder / name)
    existing = [name for name in OTHERS if (folder / name).exists()]
    # beside a table of our own they are our own
    if existing and not force and not (folder / MOTION).exists():
        raise InputError(
            f"{folder}: {', '.join(existing)} would be overwritten and no {MOTION} of rftfit simulate "
            "is beside it; name another folder with --output, or add --force"
        )


def write_motion(folder: Path, run: RobotRun, tail: pd.DataFrame, notes: Sequence[str]) -> None:
    """Write motion and forces of the whole run as csv, and a figure of its last two strides, the tail."""
    from rftfit.figures.robot import draw_motion
    from rftfit.figures.style import content
    from rftfit.store import write_bytes, write_text

    assert run.series is not None
    speed = f"{run.speed_cm_per_s:.6g} cm/s" if math.isfinite(run.speed_cm_per_s) else "none"
    outcome = f"outcome: {run.outcome}; speed: {speed}"
    head = comments(MARK, [*notes, outcome, "pitch: nose up is positive"])
    body = run.series.table().to_csv(index=False, float_format="%.9g", lineterminator="\n")
    write_text(folder / MOTION, head + body)
    figure = draw_motion(tail)
    # one format: three would take longer than the run
    write_bytes(folder / FIGURE, content(figure, "png"))


def write_animation(
    folder: Path, robot: Robot, profile: Profile, run: RobotRun, samples: int, title: str
) -> list[Path]:
    """Write the last two strides as a gif, and as mp4 where ffmpeg is at hand; the files written."""
    from rftfit.figures.animation import animation_frames, gif_bytes, mp4_bytes
    from rftfit.robot.motion import element_series
    from rftfit.store import write_bytes

    assert run.series is not None
    every = samples // 25  # pictures in a stride
    tail = run.series.last(2 * samples)  # only what is shown is worked out
    elements = element_series(robot, profile, run.condition, tail, every)
    x, time = tail.x_cm[::every], tail.time_s[::every]
    step = float(time[1] - time[0])
    # up to four times slower than life, so that a stride of 5 Hz can be followed
    slower = max(1.0, min(4.0, 0.03 / step))
    if slower > 1:
        title += f", {slower:.2g} times slower than life"
    shots = animation_frames(elements, x, time, title)
    write_bytes(folder / "animation.gif", gif_bytes(shots, step * slower))
    movie = mp4_bytes(shots, step * slower)
    if movie is None:
        return [folder / "animation.gif"]
    write_bytes(folder / "animation.mp4", movie)
    return [folder / "animation.gif", folder / "animation.mp4"]


def ranges(tail: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Least and greatest of what matters over the last two strides, by column."""
    names = ["velocity_x_cm_per_s", "z_cm", "pitch_deg"]
    names += [n for n in tail.columns if n.startswith(("force_z_tripod", "force_x_tripod"))]
    return {name: (float(tail[name].min()), float(tail[name].max())) for name in names}


def format_run(run: RobotRun, tail: pd.DataFrame) -> str:
    """Write a run, and its last two strides, for people."""
    if run.outcome == "steady":
        sd = run.speed_sd_cm_per_s
        between = f", s.d. between strides {sd:.2g}" if math.isfinite(sd) else ""
        speed = f"{run.speed_cm_per_s:.4g} cm/s (mean of the last {count(run.averaged, 'stride')}{between})"
    else:
        speed = "none"
    lines = [f"Speed: {speed}", f"Outcome: {run.outcome} after {count(run.strides, 'stride')}"]
    if run.reason:
        lines[-1] += f": {run.reason}"
    rows = [[name, f"{low:.4g}", f"{high:.4g}"] for name, (low, high) in ranges(tail).items()]
    return "\n".join(lines) + "\n\n" + table(["last two strides", "least", "greatest"], rows)


def run_as_json(
    names: dict[str, str], run: RobotRun, tail: pd.DataFrame, files: dict[str, str]
) -> str:
    """Write a run as JSON."""
    condition = asdict(run.condition)
    facts = (
        "speed_cm_per_s",
        "speed_sd_cm_per_s",
        "outcome",
        "reason",
        "warning",
        "strides",
        "averaged",
    )
    facts_of_run = {name: getattr(run, name) for name in facts}
    return json_text(
        names | condition | facts_of_run | {"last_two_strides": ranges(tail), "files": files}
    )


@options.grouped
def simulate(
    frequency: Annotated[float, options.number_option("Hz", "Stride frequency.")],
    curvature: Annotated[
        float, options.number_option("R'/r", "Legs: 1 c-leg, 0 flat, -1 reversed c-leg.")
    ],
    medium_options: options.MediumOptions,
    se: options.ErrorOfTest = None,
    robot: Annotated[Path | None, options.file("Robot; default: the paper's.")] = None,
    phase: Annotated[float, options.number_option("TURNS", "Turn of the legs at the start.")] = 0.0,
    output: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results.")] = Path(
        "simulation"
    ),
    animation: Annotated[
        bool, typer.Option("--animation/--no-animation", help="Two strides, with the forces.")
    ] = True,
    as_json: options.AsJson = False,
    force: Annotated[
        bool, typer.Option("--force", help="Overwrite files that rftfit did not write.")
    ] = False,
) -> None:
    """Run the legged robot until its speed is steady.

    Prints speed and outcome. Writes motion and ground reaction forces of both tripods over time as
    csv, a figure of the last two strides, and an animation with the force on every element as an
    arrow. x is forward, z up; a pitch above 0 is nose up.
    """
    medium_options.check(se)
    from rftfit.robot.config import paper_robot, read_robot
    from rftfit.robot.motion import SAMPLES, tail_of

    body = paper_robot() if robot is None else read_robot(robot)
    source = medium_options.find(se)
    check_folder(output, force)
    try:
        run = rftfit.simulate(
            source, frequency, curvature, body, phase_turns=phase, samples_per_stride=SAMPLES
        )
    except ValueError as error:
        raise InputError(str(error)) from error
    tail = tail_of(run, SAMPLES)
    names = {"robot": body.title, "profile": source.name}
    condition = f"{frequency:g} Hz, R'/r = {curvature:g}"
    files = {"motion": str(output / MOTION), "figure": str(output / FIGURE)}
    if animation:
        files["animation"] = str(output / "animation.gif")
    if as_json:
        print_line(run_as_json(names, run, tail, files))
    else:
        print_line(
            f"Robot: {body.title}, {condition}\nProfile: {source.name}\n\n{format_run(run, tail)}\n"
        )
    if run.warning:
        warn(f"warning: {run.warning}")
    if run.outcome != "steady":
        warn(f"warning: no steady speed: {run.outcome}")
    # after the numbers are out: a folder that cannot be written must not hide them
    write_motion(output, run, tail, [body.title, condition, source.name])
    if not as_json:
        print_line(f"Motion and forces: {files['motion']}\nFigure: {files['figure']}")
    if animation:
        animation_path = write_animation(
            output, body, source, run, SAMPLES, f"{body.title}, {condition}"
        )
        if not as_json:
            print_line(f"Animation: {', '.join(map(str, animation_path))}")


SWEEP = tuple(f"results/robot_full/{name}.csv" for name in ("speed", "optimum", "errors"))
SWEEP_FIGURES = ("speed", "profiles", "curvature")


def sweep(
    config: options.CampaignConfig = options.CONFIG,
    cores: Annotated[
        int | None, typer.Option(min=1, help="Jobs at once; default: all cores.")
    ] = None,
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
