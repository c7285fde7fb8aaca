"""The robot: measured speeds from marker tracks, and how those of the sweep compare."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.errors import InputError, RftfitError
from rftfit.measure.ledger import COLUMNS as LEDGER_COLUMNS
from rftfit.measure.ledger import DROPPED, USED
from rftfit.robot.calibrate import NAMED
from rftfit.robot.configfile import paper_robot, read_robot
from rftfit.robot.errors import measured_speeds, published_speeds, speed_errors
from rftfit.robot.sensitivity import BEST_AT_HZ
from rftfit.robot.sheet import read_trials
from rftfit.robot.strides import pace
from rftfit.robot.sweep import mean_speed
from rftfit.robot.tracks import TrackError, read_track
from rftfit.store import read_csv, write_csv
from rftfit.validate.robot_optimum import optima

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.config import RobotRuns
    from rftfit.campaign.load import Campaign
    from rftfit.robot.config import Robot
    from rftfit.robot.sheet import Trial

TRIALS = [
    "run_id", "condition", "medium", "curvature_times_R", "frequency_Hz", "frequency_from",
    "speed_cm_per_s", "stride_sd_cm_per_s", "strides", "rows", "rows_used", "status", "flags",
    "reason",
]  # fmt: skip
"""Columns of the table of trials."""


def robot_of(campaign: Campaign) -> tuple[RobotRuns, Robot]:
    """Read the robot of a campaign.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    section : RobotRuns
    robot : Robot

    Raises
    ------
    InputError
        If the campaign has none, or its file is not valid.
    """
    section = campaign.config.robot
    if section is None:
        raise InputError("config: there is no section robot, so there is no robot to run")
    robot = paper_robot() if section.file is None else read_robot(campaign.root / section.file)
    return section, robot


def trials_of(campaign: Campaign) -> list[Trial]:
    """Read the robot's run sheet.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    list of Trial
        Empty where the config names no sheet.

    Raises
    ------
    CampaignError
        If there is any error in it; with every problem.
    """
    section = campaign.config.robot
    if section is None or section.runs is None:
        return []
    name = f"{campaign.config.raw.rstrip('/')}/{section.runs}"
    trials, problems = read_trials(
        campaign.raw / section.runs, name, section.medium, set(campaign.by_id)
    )
    if any(problem.severity == "error" for problem in problems):
        raise CampaignError(problems)
    return trials


def robot_measured(config: Path, trials: Path, measured: Path, ledger: Path) -> None:
    """Turn marker tracks into mean speeds; without tracks, take those of Fig. 4C.

    Parameters
    ----------
    config : Path
    trials, measured, ledger : Path
        Written: a row for each track, for each condition, and where every row of the tracks went.

    Raises
    ------
    RftfitError
        If the sheet is not valid or a result cannot be written. A track that cannot be used is a
        row with a reason, not an error.
    """
    import pandas as pd

    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    calibrated = list(NAMED.values()) if robot == paper_robot() else []
    listed = trials_of(campaign)
    tripods = len({hip.phase_turns for hip in robot.legs.hips})
    folder = (campaign.raw / (section.runs or "")).parent
    rows, book = [], []
    for trial in sorted(listed, key=lambda one: one.run_id):
        row, counts = _measure(trial, folder, tripods)
        rows.append(row)
        file = (folder / trial.track).relative_to(campaign.raw).as_posix()
        book += [
            (trial.run_id, trial.medium, "robot", file, *fate, count)
            for fate, count in sorted(counts.items())
        ]
    table = pd.DataFrame(rows, columns=TRIALS)
    write_csv(table, trials)
    write_csv(pd.DataFrame(book, columns=LEDGER_COLUMNS), ledger)
    published = campaign.config.media[section.medium].published_as
    if listed:
        speeds = measured_speeds(table, calibrated)
    else:
        speeds = published_speeds(section.medium, calibrated)
        # the figure is of one medium
        speeds = speeds if published == "poppy_LP" else speeds.iloc[:0]
    write_csv(speeds, measured)


def _measure(
    trial: Trial, folder: Path, tripods: int
) -> tuple[tuple[object, ...], dict[tuple[str, str], int]]:
    """Row of the table of trials, and where the rows of its file went."""
    nan = float("nan")
    head = (trial.run_id, trial.condition, trial.medium, trial.curvature_times_R)
    counts: dict[tuple[str, str], int] = {}
    rows = 0
    try:
        track = read_track(folder / trial.track)
        rows = track.rows
        counts = {(DROPPED, reason): count for reason, count in track.dropped.items()}
        found = pace(track, trial.frequency_Hz, tripods)
    except TrackError as error:
        rest = (rows or error.rows) - sum(counts.values())
        counts[DROPPED, error.reason] = rest
        return (
            *head, trial.frequency_Hz, "", nan, nan, nan, rows or error.rows, 0, "refused", "",
            error.reason,
        ), counts  # fmt: skip
    used = len(track.time_s)
    counts[USED, "mean speed"] = used
    if sum(counts.values()) != rows:
        raise RftfitError(
            f"the rows of {trial.track} do not add up: {sum(counts.values())} counted, {rows} in "
            "the file: this is a fault of the program, please report it"
        )
    flags = "; ".join(found.flags)
    return (
        *head, found.frequency_Hz, found.frequency_from, found.speed_cm_per_s,
        found.stride_sd_cm_per_s, found.strides, rows, used, "used", flags, "",
    ), counts  # fmt: skip


def robot_tables(
    config: Path, measured: Path, runs: list[Path], intervals: Path, speed: Path, optimum: Path,
    errors: Path,
) -> None:  # fmt: skip
    """Join the sweeps of all profiles, find the best curvatures, compare with what was measured.

    Parameters
    ----------
    config : Path
    measured : Path
    runs : list of Path
        Read: measured conditions, and the runs of each profile.
    intervals : Path
        Read: half widths of the intervals (`rftfit.stages.robot_intervals`).
    speed, optimum, errors : Path
        Written: a row for each run, frequency and measured condition of each profile.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    _, robot = robot_of(campaign)
    seen = read_csv(measured)
    tables = [read_csv(path) for path in runs]
    whole = pd.concat(tables, ignore_index=True)
    whole = whole.fillna({"reason": "", "warning": "", "outcome": ""})
    own = robot == paper_robot()
    marked = seen[seen["calibrated"] == "yes"]
    places = set(zip(marked["curvature_times_R"], marked["frequency_Hz"], strict=True))
    here = zip(whole["curvature_times_R"], whole["frequency_Hz"], strict=True)
    whole["calibrated"] = ["yes" if place in places else "no" for place in here]
    write_csv(whole, speed)
    level = campaign.config.fit.confidence
    widths = read_csv(intervals)
    write_csv(optima(whole, [BEST_AT_HZ] if own else [], level, widths), optimum)
    means = [
        mean_speed(table.fillna({"reason": ""})).assign(profile=table["profile"].iloc[0])
        for table in tables
    ]
    write_csv(speed_errors(seen, pd.concat(means, ignore_index=True), widths), errors)
