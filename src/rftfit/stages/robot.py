"""The robot: measured speeds from marker tracks, the sweep, and how the two compare."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.errors import InputError, RftfitError
from rftfit.measure.ledger import COLUMNS as LEDGER_COLUMNS
from rftfit.measure.ledger import DROPPED, USED
from rftfit.robot.calibrate import NAMED
from rftfit.robot.configfile import paper_robot, read_robot
from rftfit.robot.errors import measured_speeds, published_speeds, speed_errors
from rftfit.robot.run import Condition
from rftfit.robot.sensitivity import BEST_AT_HZ
from rftfit.robot.sheet import read_trials
from rftfit.robot.strides import pace
from rftfit.robot.sweep import PHASES_TURNS, mean_speed, paper_conditions
from rftfit.robot.tracks import TrackError, read_track
from rftfit.stages.robot_profiles import robot_profile
from rftfit.stages.robot_store import Store, fill, forget_others
from rftfit.store import read_csv, write_csv
from rftfit.store.digest import code_digest, digest_of
from rftfit.validate.robot_optimum import optima

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import RobotRuns
    from rftfit.campaign.load import Campaign
    from rftfit.robot.config import Robot
    from rftfit.robot.sheet import Trial

SWEEPS = ("robot", "robot_full")
"""Folders of results: the reduced sweep of every run of the workflow, and the paper's own."""

TRIALS = [
    "run_id", "condition", "medium", "curvature_times_R", "frequency_Hz", "frequency_from",
    "speed_cm_per_s", "stride_sd_cm_per_s", "strides", "rows", "rows_used", "status", "flags",
    "reason",
]  # fmt: skip
"""Columns of the table of trials."""

EVERY = 4
"""The reduced sweep takes every fourth curvature and frequency."""

_FINE_FROM = 0.4


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


def conditions_of(sweep: str, measured: pd.DataFrame) -> list[Condition]:
    """Conditions of a sweep: its grid, and every measured condition.

    The full sweep has three starting phases. The reduced one has one (on the published measured
    table the others change the speed of no measured condition by 1 %), every fourth curvature and
    frequency, and at 5 Hz every curvature above 0.4, where the paper's best one lies.

    Parameters
    ----------
    sweep : str
        One of `SWEEPS`.
    measured : pandas.DataFrame
        Measured conditions.

    Returns
    -------
    list of Condition
        Each once, by curvature, frequency and phase.
    """
    if sweep not in SWEEPS:
        raise InputError(f"sweep: found {sweep!r}; allowed: {', '.join(SWEEPS)}")
    grid = paper_conditions(1)
    phases: tuple[float, ...] = PHASES_TURNS
    if sweep == SWEEPS[0]:
        phases = PHASES_TURNS[:1]
        fine = [
            c for c in grid if c.frequency_Hz == BEST_AT_HZ and c.curvature_times_R > _FINE_FROM
        ]
        grid = [c for c in [*paper_conditions(EVERY), *fine] if c.phase_turns in phases]
    known = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    grid += [
        Condition(frequency, curvature, phase)
        for curvature, frequency in zip(
            known["curvature_times_R"], known["frequency_Hz"], strict=True
        )
        for phase in phases
    ]
    order = {(c.curvature_times_R, c.frequency_Hz, c.phase_turns): c for c in grid}
    return [order[place] for place in sorted(order)]


def robot_sweep(
    config: Path, profile: str, sweep: str, alpha: Path, coefficients: Path, measured: Path,
    runs: Path,
) -> None:  # fmt: skip
    """Run the robot at every condition of a sweep on one profile.

    Finished runs are kept in ``parts`` beside the result, so that an interrupted sweep goes on.

    Parameters
    ----------
    config : Path
    profile, sweep : str
        One of `rftfit.stages.robot_profiles.PROFILES` and of `SWEEPS`.
    alpha, coefficients, measured : Path
        Read: alpha table of the robot's medium, coefficients of all, measured conditions.
    runs : Path
        Written: a row for each run.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    # into the log of the job: how far it is
    shown = -1

    def say(done: int, total: int) -> None:
        nonlocal shown
        if total and 10 * done // total > shown:
            shown = 10 * done // total
            sys.stderr.write(f"{profile}: {done} of {total} runs\n")
            sys.stderr.flush()

    write_csv(swept(config, profile, sweep, alpha, coefficients, measured, say), runs)


def swept(
    config: Path, profile: str, sweep: str, alpha: Path, coefficients: Path, measured: Path,
    on_done: Callable[[int, int], None] | None = None, threads: int | None = None,
) -> pd.DataFrame:  # fmt: skip
    """Do the work of `robot_sweep`; for whoever wants to see how far it is.

    Parameters
    ----------
    config : Path
    profile, sweep : str
    alpha, coefficients, measured : Path
        As for `robot_sweep`.
    on_done : callable, optional
        Told how many of how many runs are done.
    threads : int, optional
        Default: one for each core.

    Returns
    -------
    pandas.DataFrame
        `profile, medium`, then the columns of `rftfit.robot.sweep.speed_table`.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    method = campaign.config.fourier.method
    made = robot_profile(profile, section.medium, read_csv(alpha), read_csv(coefficients), method)
    conditions = conditions_of(sweep, read_csv(measured))
    digest = digest_of(
        robot.model_dump(mode="json"),
        [part.tobytes().hex() for part in made.parameters],
        code_digest("rftfit.robot.sweep"),
    )
    store = Store.load(campaign.root / "results" / "robot" / "parts" / f"{profile}-{digest}")
    fill(store, robot, made, conditions, threads, on_done)
    forget_others(store.folder)
    table = store.table(conditions)
    table.insert(0, "profile", profile)
    table.insert(1, "medium", section.medium)
    return table


def robot_tables(
    config: Path, measured: Path, runs: list[Path], speed: Path, optimum: Path, errors: Path
) -> None:
    """Join the sweeps of all profiles, find the best curvatures, compare with what was measured.

    Parameters
    ----------
    config : Path
    measured : Path
    runs : list of Path
        Read: measured conditions, and the runs of each profile.
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
    write_csv(optima(whole, [BEST_AT_HZ] if own else [], level), optimum)
    means = [
        mean_speed(table.fillna({"reason": ""})).assign(profile=table["profile"].iloc[0])
        for table in tables
    ]
    write_csv(speed_errors(seen, pd.concat(means, ignore_index=True)), errors)
