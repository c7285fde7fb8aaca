"""The running robot as moving pictures, the force on every element an arrow (movies S5 and S6); their gif and mp4.

A picture is an array (height, width, 3) of bytes: red, green, blue.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import style

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.motion import ElementSeries
    from rftfit.robot.run import RobotRun

    Picture = npt.NDArray[np.uint8]


def animate_run(
    robot: Robot, profile: Profile, run: RobotRun, title: str
) -> tuple[list[Picture], float]:
    """Draw the last two strides of a run. Returns the pictures, and the time that each is shown, s.

    `run`: On this robot and profile, with `rftfit.robot.motion.SAMPLES` samples for each stride. `title`: Above the
    pictures; where they are slower than life, this is added.
    """
    from rftfit.robot.motion import SAMPLES, STRIDES, element_series

    assert run.series is not None
    pictures_in_stride = 25
    every = SAMPLES // pictures_in_stride
    # forces are computed for the shown strides alone
    tail = run.series.last(STRIDES * SAMPLES)
    elements = element_series(robot, profile, run.condition, tail, every)
    x, time = tail.x_cm[::every], tail.time_s[::every]
    step_s = float(time[1] - time[0])
    # a picture is shown for at least 30 ms, so that a stride of 5 Hz can be followed; no motion is slowed down more than
    # four times
    slowed = max(1.0, min(4.0, 0.03 / step_s))
    if slowed > 1:
        title += f", {slowed:.2g} times slower than life"
    return animation_frames(elements, x, time, title), step_s * slowed


_BODY = "#444444"
"""Colour of the elements of the body."""
_TRIPODS = ("blue", "sky blue", "bluish green", "reddish purple")
"""Colours of the tripods, which are the legs of one phase together; from the fifth on they repeat."""


@style.styled()
def animation_frames(
    elements: Mapping[str, ElementSeries], x_cm: FloatArray, time_s: FloatArray, title: str
) -> list[Picture]:
    """Draw a picture of each sample of a run; the picture moves along with the robot.

    `elements`: Ends of the elements and forces on them, arrays (samples, members, elements), by name of the group: a
    plate of the body, or ``tripod_1``, ... `x_cm`, `time_s`: Position of the robot along x, and time, shape (samples,).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Rectangle

    figure = style.new_figure(15.0, 7.0, dpi=100)
    canvas: Any = FigureCanvasAgg(figure)
    axes = style.axes_cm(figure, 1.1, 0.6, 13.7, 5.5)
    axes.set(aspect="equal", ylim=(-4, 7), xlabel="x (cm)", ylabel="z (cm)")
    axes.set_title(style.plain(title), fontsize=7, loc="left")
    sand = Rectangle((0, -100), 48, 100, facecolor=style.SAND, edgecolor="none")
    axes.add_patch(sand)
    clock = axes.text(0.99, 0.96, "", transform=axes.transAxes, ha="right", va="top", fontsize=7)
    strongest = max(
        float(np.hypot(series.force_x_N, series.force_z_N).max(initial=0.0))
        for series in elements.values()
    )
    # length of the arrow of the strongest force, in the picture's cm
    longest_cm = 4.0
    cm_per_N = longest_cm / strongest if strongest > 0 else 0.0
    shades = cycle(style.OKABE_ITO[name] for name in _TRIPODS)
    lines, arrows = {}, {}
    for name in elements:
        colour = next(shades) if name.startswith("tripod") else _BODY
        lines[name] = LineCollection([], colors=colour, linewidths=2.2, capstyle="round")
        arrows[name] = LineCollection([], colors=style.MARK, linewidths=0.7)
        axes.add_collection(lines[name])
        axes.add_collection(arrows[name])
    scale = f"arrows: force on an element, the longest {1000 * strongest:.0f} mN"
    axes.text(0.01, 0.03, scale, transform=axes.transAxes, fontsize=6)
    shots = []
    # the artists are made once and moved for each picture, which is much faster than to draw all anew
    for index, (x, time) in enumerate(zip(x_cm, time_s, strict=True)):
        axes.set_xlim(x - 12, x + 12)
        sand.set_x(x - 24)
        clock.set_text(f"{time:.2f} s")
        for name, series in elements.items():
            # (members, elements, ends, x and z) to segments (n, ends, x and z)
            ends = np.stack([series.ends_x_cm[index], series.ends_z_cm[index]], axis=-1)
            lines[name].set_segments(list(ends.reshape(-1, 2, 2)))
            starts = np.column_stack([series.at_x_cm[index].ravel(), series.at_z_cm[index].ravel()])
            forces = np.column_stack(
                [series.force_x_N[index].ravel(), series.force_z_N[index].ravel()]
            )
            segments = np.stack([starts, starts + cm_per_N * forces], axis=1)
            arrows[name].set_segments(list(segments[np.hypot(*forces.T) > 0]))
        canvas.draw()
        shots.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return shots


def gif_bytes(shots: Sequence[Picture], frame_s: float) -> bytes:
    """Join pictures to a gif that repeats for ever; `frame_s`: time of a picture, rounded to the hundredths of a gif."""
    from PIL import Image

    # a gif has at most 256 colours: one palette for all pictures, taken from about four, so that colours do not flicker
    palette_image = Image.fromarray(np.concatenate(shots[:: max(1, len(shots) // 4)])).quantize(64)
    first_frame, *later_frames = (
        Image.fromarray(shot).quantize(palette=palette_image, dither=Image.Dither.NONE)
        for shot in shots
    )
    buffer, duration_ms = io.BytesIO(), max(20, 10 * round(100 * frame_s))
    first_frame.save(
        buffer, "GIF", save_all=True, append_images=later_frames, loop=0, duration=duration_ms
    )
    return buffer.getvalue()


def mp4_bytes(shots: Sequence[Picture], frame_s: float) -> bytes | None:
    """Join pictures to an mp4 by the program ffmpeg; None where ffmpeg is not installed, or fails.

    `frame_s`: Time that a picture is shown, s.
    """
    import tempfile
    from pathlib import Path

    program = shutil.which("ffmpeg")
    if program is None:
        return None
    # the encoder accepts only even sizes
    height, width = (size // 2 * 2 for size in shots[0].shape[:2])
    raw = b"".join(np.ascontiguousarray(shot[:height, :width]).tobytes() for shot in shots)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "animation.mp4"
        shape = f"-pix_fmt rgb24 -s {width}x{height} -r {1 / frame_s:.4f}"
        options = f"-loglevel error -f rawvideo {shape} -i - -pix_fmt yuv420p".split()
        # the ffmpeg that the user has installed; no part of this command comes from outside
        process = subprocess.run(  # noqa: S603
            [program, *options, target], input=raw, check=False, capture_output=True
        )
        return target.read_bytes() if process.returncode == 0 and target.is_file() else None
