"""Public functions that have no room of their own: check and run a campaign, read a log, fit a slope, run the robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from rftfit.campaign.problems import Problem
    from rftfit.logs.base import Log
    from rftfit.measure.slopes import Slope
    from rftfit.model.profiles import KnownMedium
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun
    from rftfit.workflow.run import RunReport


def check(folder: str | Path = ".") -> list[Problem]:
    """Find everything that is wrong with a campaign: configuration, run sheet, logs, robot.

    The problems are those that ``rftfit check`` prints: logs are opened and measured.

    Parameters
    ----------
    folder : str or Path, optional
        As for `open`.

    Returns
    -------
    list of Problem
        Each with `code`, `severity` (``error`` or ``warning``), `place` (`file`, `row`, `column`, `line`, `key`), `found`,
        `allowed`, `nearest`; ``str(problem)`` is a sentence.

    Raises
    ------
    InputError
        If there is no campaign.

    Examples
    --------
    >>> import rftfit
    >>> for problem in rftfit.check("my_campaign"):  # doctest: +SKIP
    ...     print(problem)
    """
    from rftfit.campaign.presence import config_of
    from rftfit.workflow.check import check_all

    return check_all(config_of(folder)).problems


def run(
    folder: str | Path = ".", targets: Sequence[str] = (), cores: int | None = None
) -> RunReport:
    """Make all results of a campaign that are missing or out of date, as the command ``rftfit run`` does.

    Nothing is printed.

    Parameters
    ----------
    folder : str or Path, optional
        As for `open`.
    targets : sequence of str, optional
        Results to make, as paths from the campaign's folder; default: all.
    cores : int, optional
        Most jobs that run at the same time; default: all cores.

    Returns
    -------
    RunReport
        Names of the jobs that were `made` and `skipped`, and the `reasons` why results were made again; all
        three are empty if there was nothing to do.

    Raises
    ------
    RftfitError
        If the campaign is not valid, or a job fails. The error of failed jobs has a `report`, a `RunReport`
        whose `failed` gives the reason for each job.

    Examples
    --------
    >>> import rftfit
    >>> report = rftfit.run("my_campaign")  # doctest: +SKIP
    >>> report.made  # doctest: +SKIP
    """
    from rftfit.campaign.presence import config_of
    from rftfit.workflow.run import Workflow

    workflow = Workflow(config_of(folder), targets, cores=cores)
    return workflow.report(workflow.run())


def read_log(
    path: str | Path,
    dialect: str | None = None,
    text: Mapping[str, object] | None = None,
    options: Mapping[str, object] | None = None,
) -> Log:
    """Read one log of a force transducer or of a motion.

    Parameters
    ----------
    path : str or Path
        Path of the file, or of the folder of a rosbag2 recording.
    dialect : str, optional
        Name of the reader, such as ``rig``, ``tdms`` or ``ros-bag``; default: the reader that recognises the
        content.
    text : mapping of str to object, optional
        Layout of a delimited text, with the keys of ``text`` in the configuration; default: guessed from the
        content, as ``rftfit inspect`` does.
    options : mapping of str to object, optional
        Options of the dialect, with the keys of ``options`` in the configuration, such as the ``sheet`` of a
        workbook; for delimited text further keys of `text`.

    Returns
    -------
    Log
        Its `columns` (dict of str to numpy.ndarray, shape (n,), NaN in blank cells), their `units` (dict of
        str to str, empty where the file states none), and counts of what became of every data line.

    Raises
    ------
    InputError
        If the file cannot be used, or no reader knows it.

    Examples
    --------
    >>> import rftfit
    >>> log = rftfit.read_log("raw/plate_01_force.csv")  # doctest: +SKIP
    >>> log.columns["Fz"], log.units["Fz"]  # doctest: +SKIP
    """
    from rftfit.logs.inspect import recognised, recording

    file = recording(Path(path))
    recognition = recognised(file, dialect, text, options)
    log = recognition.reader.load(file)
    if recognition.text is None or text is not None:
        return log
    return replace(
        log, notes=(*log.notes, f"no dialect knows this text; read as {recognition.text}")
    )


def fit_slope(depth_cm: npt.ArrayLike, stress_N_per_cm2: npt.ArrayLike) -> Slope:
    """Fit the line stress = alpha times depth through zero, with a standard error that allows for autocorrelation.

    Parameters
    ----------
    depth_cm : array_like, shape (n,)
        |z|, positive below the surface, in the order of recording; at least 8 samples.
    stress_N_per_cm2 : array_like, shape (n,) or (k, n)
        Force on the plate over its area, tared; one or k components.

    Returns
    -------
    Slope
        Arrays of shape (k,): `alpha` and its standard error `se`, both in N/cm^3, and the degrees of freedom
        `dof` of `se`; ``interval(confidence)`` returns the lower and upper end of the interval of alpha.

    Raises
    ------
    ValueError
        If there are fewer than 8 samples, all lie at depth zero, or a number is not finite.

    Examples
    --------
    >>> import numpy as np, rftfit
    >>> depth = np.linspace(0.1, 7, 500)
    >>> slope = rftfit.fit_slope(depth, 0.35 * depth + 0.01 * np.sin(40 * depth))
    >>> round(float(slope.alpha[0]), 2)
    0.35
    """
    from rftfit.measure.slopes import fit_slope as fit

    depth = np.asarray(depth_cm, dtype=float)
    stress = np.atleast_2d(np.asarray(stress_N_per_cm2, dtype=float))
    if depth.ndim != 1 or stress.shape[-1] != depth.size:
        raise ValueError(f"depth {depth.shape} and stress {stress.shape} do not fit together")
    if not (np.isfinite(depth).all() and np.isfinite(stress).all()):
        raise ValueError("depth and stress must be finite; leave out what is missing")
    # the caller's stress is already tared: its zero has no error, whatever its degrees of freedom
    zero_variance = np.zeros((1, len(stress)))
    return fit(depth, stress, zero_variance, zero_dof=np.ones_like(zero_variance))


def simulate(
    medium: KnownMedium | str | Path,
    frequency_Hz: float,
    curvature_times_R: float = 1.0,
    robot: Robot | str | Path | None = None,
    *,
    phase_turns: float = 0.0,
    samples_per_stride: int = 0,
) -> RobotRun:
    """Run the legged robot on a medium until its speed is steady, or it is clear that it will not become steady.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        As for `predict`. For a medium of a campaign its measured table, or its map if the table has holes.
    frequency_Hz : float
        Stride frequency, -100 to 100 Hz; below 0 the legs turn backward.
    curvature_times_R : float, optional
        Curvature R'/r of the legs: 1 for the c-leg, 0 for a flat leg, -1 for the reversed c-leg.
    robot : Robot, str or Path, optional
        A robot, or the path of its file; default: the robot of the paper.
    phase_turns : float, optional
        Angle of the legs at the start, in turns.
    samples_per_stride : int, optional
        Samples of motion and forces that are kept for each stride (`series`); 0 keeps none.

    Returns
    -------
    RobotRun
        `speed_cm_per_s` (NaN without a steady speed), `outcome`, `reason`, `warning`, `series`.

    Raises
    ------
    ValueError
        If a number is out of its range.
    InputError
        If the robot's file is not valid.

    Examples
    --------
    >>> import rftfit
    >>> run = rftfit.simulate(rftfit.published_medium("poppy_LP"), 2.0)
    >>> run.outcome
    'steady'
    """
    from rftfit.model.known import profile_of
    from rftfit.robot import config
    from rftfit.robot.run import simulate as walk

    if robot is None:
        robot = config.paper_robot()
    elif not isinstance(robot, config.Robot):
        robot = config.read_robot(Path(robot))
    return walk(
        robot,
        profile_of(medium),
        frequency_Hz,
        curvature_times_R,
        phase_turns,
        samples_per_stride=samples_per_stride,
    )
