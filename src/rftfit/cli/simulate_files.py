"""Files of one run of the robot, never over files of somebody else's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import rftfit
from rftfit.cli.target import check_target
from rftfit.errors import InputError, OutputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import Run

MOTION = "motion.csv"
MARK = "# motion written by rftfit simulate"
"""How the first line of a table of motion begins: only these are overwritten unasked."""

FIGURE = "motion.png"
OTHERS = (FIGURE, "animation.gif", "animation.mp4")

_FRAMES = 25
"""Pictures in a stride."""

_SLOWEST = 4.0
"""Times slower than life, so that a stride of 5 Hz can be followed."""


def check_folder(folder: Path, force: bool) -> None:
    """Refuse a folder with files that an earlier run did not write.

    Parameters
    ----------
    folder : Path
    force : bool
        Whether the user said that they may be overwritten.

    Raises
    ------
    InputError
        If there is a file that must stay.
    OutputError
        If it is no folder.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; name a folder for the results")
    check_target(folder / MOTION, MARK, "motion", force)
    there = [name for name in OTHERS if (folder / name).exists()]
    # beside a table of our own they are our own
    if there and not force and not (folder / MOTION).exists():
        raise InputError(
            f"{folder}: {', '.join(there)} would be overwritten and no {MOTION} of rftfit simulate "
            "is beside it; name another folder with --output, or add --force"
        )


def write_motion(folder: Path, run: Run, tail: pd.DataFrame, notes: Sequence[str]) -> None:
    """Write motion and forces of the whole run as csv, and a figure of its last two strides.

    Parameters
    ----------
    folder : Path
    run : Run
        With a series.
    tail : pandas.DataFrame
        Its last two strides.
    notes : sequence of str
        Comment lines: what ran on what.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    from rftfit.report.robot_motion import draw_motion
    from rftfit.report.saving import content
    from rftfit.store import write_bytes, write_text

    assert run.series is not None
    speed = f"{run.speed_cm_per_s:.6g} cm/s" if math.isfinite(run.speed_cm_per_s) else "none"
    lines = [f"{MARK} (rftfit {rftfit.__version__})"]
    lines += [f"# {' '.join(note.split())}" for note in notes]
    lines += [f"# outcome: {run.outcome}; speed: {speed}", "# pitch: nose down is positive"]
    body = run.series.table().to_csv(index=False, float_format="%.9g", lineterminator="\n")
    write_text(folder / MOTION, "\n".join(lines) + f"\n{body}")
    figure = draw_motion(tail.assign(profile="table"))
    # one format: three would take longer than the run
    write_bytes(folder / FIGURE, content(figure, "png"))


def write_animation(
    folder: Path, robot: Robot, profile: Profile, run: Run, samples: int, title: str
) -> list[Path]:
    """Write the last two strides as a gif, and as mp4 where ffmpeg is at hand.

    Parameters
    ----------
    folder : Path
    robot : Robot
    profile : Profile
    run : Run
        With a series of `samples` a stride.
    samples : int
    title : str

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    from rftfit.report.robot_animation import gif_bytes, mp4_bytes, pictures
    from rftfit.robot.elements import element_series
    from rftfit.store import write_bytes

    assert run.series is not None
    every = samples // _FRAMES
    # only what is shown is worked out
    last = slice(-2 * samples, None)
    columns: dict[str, Any] = {
        name: {key: part[last] for key, part in value.items()}
        if isinstance(value, dict)
        else value[last]
        for name, value in vars(run.series).items()
        if name != "groups"
    }
    tail = replace(run.series, **columns)
    elements = element_series(robot, profile, replace(run, series=tail), every)
    x, time = tail.x_cm[::every], tail.time_s[::every]
    step = float(time[1] - time[0])
    slower = max(1.0, min(_SLOWEST, 0.03 / step))
    if slower > 1:
        title += f", {slower:.2g} times slower than life"
    shots = pictures(elements, x, time, title)
    write_bytes(folder / "animation.gif", gif_bytes(shots, step * slower))
    movie = mp4_bytes(shots, step * slower)
    if movie is None:
        return [folder / "animation.gif"]
    write_bytes(folder / "animation.mp4", movie)
    return [folder / "animation.gif", folder / "animation.mp4"]
