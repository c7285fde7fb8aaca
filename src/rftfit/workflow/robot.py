"""Stages of the legged robot, one function a rule: measured speeds, sweep, intervals, motion, pictures.

A stage takes `Results`, the access to the tables of earlier stages, and returns the tables that its rule writes, in the
order of the rule. The robot runs on a profile of its medium, a function alpha(beta, gamma), by its name in `PROFILES`:
``table`` (as measured), ``map`` (estimated in all directions), ``generic`` (scaled), ``depth_only`` (a baseline). A
condition is a curvature of the legs, R'/r (``curvature_times_R``: 1 c-leg, 0 flat, -1 reversed), with a stride frequency
(``frequency_Hz``); a run of the simulated robot also has a phase of the legs at its start. A sweep is one run for each.
"""

from __future__ import annotations

import json

import pandas as pd

from rftfit.campaign.config import RobotRuns
from rftfit.campaign.load import Campaign
from rftfit.campaign.problems import CampaignError
from rftfit.compare.robot import optima
from rftfit.errors import InputError
from rftfit.measure.flags import Remark, flag_table, reason_cells
from rftfit.measure.ledger import COLUMNS as LEDGER_COLUMNS
from rftfit.model.profiles import Profile
from rftfit.outputs.dictionary import columns_of
from rftfit.results import Results
from rftfit.robot import PROFILES, sweep, tracks
from rftfit.robot.config import Robot, paper_robot, read_robot
from rftfit.robot.intervals import WIDTH_COLUMNS, widths
from rftfit.robot.motion import SAMPLES, frames_of, stance_of, tail_of
from rftfit.robot.run import simulate
from rftfit.robot.speeds import TRIALS, measured_speeds, published_speeds, speed_errors, trial_row

# --- The robot, and measured speeds from marker tracks.


def robot_of(campaign: Campaign) -> tuple[RobotRuns, Robot]:
    """Return the section ``robot`` of the config, and the robot: described in a file that it names, else the paper's."""
    section = campaign.config.robot
    if section is None:
        raise InputError("config: there is no section robot, so there is no robot to run")
    robot = paper_robot() if section.file is None else read_robot(campaign.root / section.file)
    return section, robot


def trials_of(campaign: Campaign) -> list[tracks.Trial]:
    """Read the trials, recorded runs of the real robot, from the robot's run sheet; none where the config names no sheet."""
    section = campaign.config.robot
    if section is None or section.runs is None:
        return []
    # as messages name it
    name = f"{campaign.config.raw.rstrip('/')}/{section.runs}"
    sheet = campaign.raw / section.runs
    trials, problems = tracks.read_trials(sheet, name, section.medium, set(campaign.by_id))
    if any(problem.severity == "error" for problem in problems):
        raise CampaignError(problems)
    return trials


def robot_measured(results: Results) -> tuple[pd.DataFrame, ...]:
    """Turn marker tracks into mean speeds; without tracks, return the published speeds of Fig. 4C.

    A track holds the places of a marker on the real robot over time. Returns five tables: a row for each track; a row for
    each condition with its measured speed; a row for each moment of the mean stride of recorded tracks at the conditions
    of `sweep.MOTION`, whose motion is drawn; the ledger of all rows of the tracks; flags of the tracks. The motion of the
    robot within a stride was never published, so a simulated track has no mean stride.
    """
    campaign = results.campaign
    section, robot = robot_of(campaign)
    # conditions whose measured speeds were used to choose lengths of the paper's robot: they are no test of it
    calibrated_on = list(sweep.CALIBRATED_ON.values()) if robot == paper_robot() else []
    trials = trials_of(campaign)
    # legs of the same phase are a tripod
    tripods = len({hip.phase_turns for hip in robot.legs.hips})
    folder = (campaign.raw / (section.runs or "")).parent
    rows, ledger_rows = [], []
    stride_rows: list[tuple[object, ...]] = []
    flags: list[Remark] = []
    for trial in sorted(trials, key=lambda trial: trial.run_id):
        # counts: number of rows of the track by fate (used, dropped) and reason; velocity over the mean stride, cm/s
        row, counts, velocity, flags_of_trial = trial_row(trial, folder, tripods)
        rows.append(row)
        flags += flags_of_trial
        condition = trial.curvature_times_R, row["frequency_Hz"]
        if velocity and not campaign.reenacted and sweep.is_at_condition(sweep.MOTION, *condition):
            stride_rows += [
                (trial.run_id, *condition, sample / tracks.STRIDE_SAMPLES, speed)
                for sample, speed in enumerate(velocity)
            ]
        file = (folder / trial.track).relative_to(campaign.raw).as_posix()
        ledger_rows += [
            (
                trial.run_id,
                trial.medium,
                "robot",
                file,
                fate,
                *reason_cells([why]),
                counts[fate, why],
            )
            # by their words, as reasons themselves have no order
            for fate, why in sorted(counts, key=lambda fate_and_why: [*map(str, fate_and_why)])
        ]
    table = pd.DataFrame(rows, columns=TRIALS)
    published_as = campaign.config.media[section.medium].published_as
    if trials:
        speeds = measured_speeds(table, calibrated_on)
    else:
        speeds = published_speeds(section.medium, calibrated_on)
        # Fig. 4C shows one robot on one medium; other settings of a robot, such as the time step, do not matter
        paper = paper_robot()
        is_paper_robot = (robot.body, robot.legs) == (paper.body, paper.legs)
        if not is_paper_robot or published_as != "poppy_LP":
            speeds = speeds.iloc[:0]
    strides = pd.DataFrame(stride_rows, columns=columns_of("robot/strides.csv"))
    ledger = pd.DataFrame(ledger_rows, columns=LEDGER_COLUMNS)
    return table, speeds, strides, ledger, flag_table(section.medium, "robot_measured", flags)


# --- The force profiles that the robot runs on, from the tables of the earlier stages.


def profiles_of(results: Results) -> tuple[str, ...]:
    """List the profiles that the robot runs on: the map only where the measured table has holes, which it fills.

    Without holes the map has the same alpha as the table, so its runs would be the same.
    """
    # a table with holes states them as the reason why it has no number there
    has_holes = robot_profile(results, "table").reason
    return tuple(name for name in PROFILES if has_holes or name != "map")


def robot_profile(results: Results, name: str) -> Profile:
    """Return a profile of the robot's medium, by its name in `PROFILES`, without draws, as one run needs none.

    Where there is no number the profile gives NaN, and its `reason` says why.
    """
    return results[results.campaign.robot_medium].profile(name, draws=False)


# --- The robot's sweep: one profile over all its conditions; then the runs on all profiles, compared with measured speeds.


def robot_runs(results: Results, runs: str, threads: int) -> pd.DataFrame:
    """Run the robot at every condition of the reduced sweep on one profile: a row for each run.

    `runs`: Name of the table, ``runs_`` and the profile, as ``runs_table``. `threads`: Runs at once.
    """
    return _run_sweep(results, runs, threads, full=False)


def robot_full_runs(results: Results, runs: str, threads: int) -> pd.DataFrame:
    """Run the robot at every condition of the paper's whole sweep on one profile; `runs`, `threads`: as in `robot_runs`."""
    return _run_sweep(results, runs, threads, full=True)


def _run_sweep(results: Results, runs: str, threads: int, *, full: bool) -> pd.DataFrame:
    """Run the robot on one profile at the conditions of a sweep: a row for each run; none on a map equal to the table.

    `runs`, `threads`: As in `robot_runs`. `full`: True for the paper's whole sweep.
    """
    name = runs.removeprefix("runs_")
    section, robot = robot_of(results.campaign)
    conditions = sweep.conditions_of(results.table("robot/measured.csv"), full=full)
    if name not in profiles_of(results):
        conditions = []
    profile_runs = sweep.run_all(robot, robot_profile(results, name), conditions, threads)
    table = sweep.speed_table(profile_runs)
    table.insert(0, "profile", name)
    table.insert(1, "medium", section.medium)
    return table


def robot_speeds(results: Results) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Make the tables of the reduced sweep, which every run makes: speeds, best curvatures, errors (`_sweep_tables`)."""
    return _sweep_tables(results, "robot")


def robot_full_speeds(results: Results) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Make the tables of the paper's whole sweep, of ``rftfit sweep``: speeds, best curvatures, errors (`_sweep_tables`)."""
    return _sweep_tables(results, "robot_full")


def _sweep_tables(results: Results, folder: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Join the runs of a sweep on all profiles, find the best curvatures, and compare speeds with measured ones.

    `folder`: ``robot`` (reduced sweep) or ``robot_full`` (the paper's whole sweep). Returns three tables, for each profile: a
    row for each run (its speed), for each frequency (the curvature at which the robot is fastest), and for each measured
    condition (the difference of speeds).
    """
    _, robot = robot_of(results.campaign)
    measured = results.table("robot/measured.csv")
    half_widths = results.table("robot/intervals.csv")
    runs = {name: results.table(f"{folder}/runs_{name}.csv") for name in PROFILES}
    all_runs = pd.concat([table for table in runs.values() if len(table)], ignore_index=True)
    # runs at a condition on whose measured speed the robot was calibrated are no test of it
    calibrated = measured[measured["calibrated"] == "yes"]
    calibrated_on = {*zip(calibrated["curvature_times_R"], calibrated["frequency_Hz"], strict=True)}
    conditions = zip(all_runs["curvature_times_R"], all_runs["frequency_Hz"], strict=True)
    all_runs["calibrated"] = [
        "yes" if condition in calibrated_on else "no" for condition in conditions
    ]
    best_at = [sweep.BEST_AT_HZ] if robot == paper_robot() else []
    best = optima(all_runs, best_at, results.config.fit.confidence, half_widths)
    means = [sweep.mean_speed(table).assign(profile=profile) for profile, table in runs.items()]
    errors = speed_errors(measured, pd.concat(means, ignore_index=True), half_widths)
    return results.marked(all_runs), results.marked(best), results.marked(errors)


# --- Half widths of the intervals of the robot's speed and best curvature, from the errors of alpha.


INTERVAL_PROFILES = ("table", "map", "generic")
"""Profiles whose predicted speeds have intervals; depth-only has none, since it is only a baseline for comparison."""


def robot_intervals(results: Results, threads: int) -> pd.DataFrame:
    """Estimate half widths of the intervals of speed and best curvature, by runs of the robot on draws of alpha.

    A draw is alpha in all directions with errors as likely as the measured ones. Returns a row for each profile and
    measured condition, columns `WIDTH_COLUMNS`. `threads`: Runs at once.
    """
    section, robot = robot_of(results.campaign)
    profiles = {}
    for name in profiles_of(results):
        if name in INTERVAL_PROFILES:
            profile = results[section.medium].profile(name)
            # `spread` holds the draws: a stack of profiles
            # without draws of alpha there is no interval: the generic profile has none where no nine terms were fitted
            if isinstance(profile.spread, Profile):
                profiles[name] = profile
    measured = results.table("robot/measured.csv")
    confidence = results.config.fit.confidence
    arc_percent = results.config.errors.arc_percent
    half_widths = widths(robot, profiles, measured, confidence, threads, arc_percent)
    half_widths.insert(0, "medium", section.medium)
    return half_widths[WIDTH_COLUMNS]


def robot_motion(results: Results) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    """Run the robot once more at a few conditions, and keep how it moves, for figures and page.

    The profile is the measured table, or the map where that has holes. Returns two tables and a text: over time the last two
    strides of each run at the conditions of `sweep.MOTION`; for each of these runs the elements of the legs and the force
    on each in mid-stance; and the frames of the page's moving pictures, as JSON.
    """
    section, robot = robot_of(results.campaign)
    name = "map" if "map" in profiles_of(results) else "table"
    profile = robot_profile(results, name)
    runs = [
        simulate(robot, profile, frequency, curvature, samples_per_stride=SAMPLES)
        for curvature, frequency in sweep.MOTION
    ]
    motion = pd.concat([tail_of(run) for run in runs], ignore_index=True)
    stances = [stance_of(robot, profile, run) for run in runs]
    stance = pd.concat(stances, ignore_index=True)
    for table in (motion, stance):
        table.insert(0, "profile", name)
    pictures = frames_of(robot, profile) | {"medium": section.medium, "profile": name}
    return motion, stance, json.dumps(pictures, separators=(",", ":"), allow_nan=False) + "\n"
