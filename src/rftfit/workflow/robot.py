"""Stages of the robot: measured speeds, sweep, intervals, motion, pictures."""

from __future__ import annotations

import json
import math
import shutil
import sys
import time
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.problems import CampaignError
from rftfit.compare.robot import optima
from rftfit.errors import InputError, RftfitError
from rftfit.measure.flags import FLAGS, REASON, Remark, flag_columns, reason_cells, remark
from rftfit.measure.ledger import COLUMNS as LEDGER_COLUMNS
from rftfit.measure.ledger import DROPPED, USED
from rftfit.model.outlines import arc
from rftfit.model.profiles import Profile
from rftfit.robot.body import element_series
from rftfit.robot.config import paper_robot, read_robot
from rftfit.robot.intervals import (
    BEST,
    BEST_DRAWS,
    DRAWS,
    SPEED,
    WIDTH_COLUMNS,
    best_width,
    each_draw,
    speed_widths,
)
from rftfit.robot.run import Condition, simulate
from rftfit.robot.speeds import measured_speeds, published_speeds, speed_errors
from rftfit.robot.sweep import (
    BEST_AT_HZ,
    CALIBRATED_ON,
    MOTION,
    MOTION_NEAR_HZ,
    PHASES_TURNS,
    RUN_COLUMNS,
    mean_speed,
    paper_conditions,
    row_of,
    run_all,
    speed_table,
)
from rftfit.robot.tracks import STRIDE_SAMPLES, TrackError, pace, read_track, read_trials
from rftfit.store import read_csv, write_csv
from rftfit.store.digests import code_digest, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import RobotRuns
    from rftfit.campaign.load import Campaign
    from rftfit.results import Results
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun
    from rftfit.robot.tracks import Trial


# --- The robot: measured speeds from marker tracks, and how those of the sweep compare.


TRIALS = [
    "run_id", "condition", "medium", "curvature_times_R", "frequency_Hz", "frequency_from",
    "speed_cm_per_s", "stride_sd_cm_per_s", "strides", "rows", "rows_used", "status", *FLAGS,
    *REASON,
]  # fmt: skip
"""Columns of the table of trials."""


def robot_of(campaign: Campaign) -> tuple[RobotRuns, Robot]:
    """Read the robot of a campaign."""
    section = campaign.config.robot
    if section is None:
        raise InputError("config: there is no section robot, so there is no robot to run")
    robot = paper_robot() if section.file is None else read_robot(campaign.root / section.file)
    return section, robot


def trials_of(campaign: Campaign) -> list[Trial]:
    """Read the robot's run sheet; none where the config names no sheet."""
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


MEAN_STRIDE = ["run_id", "curvature_times_R", "frequency_Hz", "stride", "velocity_x_cm_per_s"]
"""Columns of the table of mean strides."""


def robot_measured(
    results: Results,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Turn marker tracks into mean speeds; without tracks, take those of Fig. 4C.

    Returns a row for each track, for each condition, for each moment of the mean strides of the
    tracks that belong to `MOTION`, and where every row of the tracks went.
    """
    import pandas as pd

    campaign = results.campaign
    section, robot = robot_of(campaign)
    calibrated = list(CALIBRATED_ON.values()) if robot == paper_robot() else []
    listed = trials_of(campaign)
    tripods = len({hip.phase_turns for hip in robot.legs.hips})
    folder = (campaign.raw / (section.runs or "")).parent
    rows, book, strides = [], [], list[tuple[object, ...]]()
    for trial in sorted(listed, key=lambda one: one.run_id):
        row, counts, velocity = _measure(trial, folder, tripods)
        rows.append(row)
        head = (trial.run_id, trial.curvature_times_R, row[TRIALS.index("frequency_Hz")])
        strides += [(*head, at / STRIDE_SAMPLES, speed) for at, speed in enumerate(velocity)]
        file = (folder / trial.track).relative_to(campaign.raw).as_posix()
        book += [
            (trial.run_id, trial.medium, "robot", file, fate, *reason_cells([why]), count)
            for (fate, why), count in sorted(counts.items(), key=lambda one: [*map(str, one[0])])
        ]
    table = pd.DataFrame(rows, columns=TRIALS)
    published = campaign.config.media[section.medium].published_as
    if listed:
        speeds = measured_speeds(table, calibrated)
    else:
        speeds = published_speeds(section.medium, calibrated)
        # the figure is of one medium
        speeds = speeds if published == "poppy_LP" else speeds.iloc[:0]
    book_of = pd.DataFrame(book, columns=LEDGER_COLUMNS)
    return table, speeds, pd.DataFrame(strides, columns=MEAN_STRIDE), book_of


def _measure(
    trial: Trial, folder: Path, tripods: int
) -> tuple[tuple[object, ...], dict[tuple[str, Remark], int], list[float]]:
    """Row of the table of trials, where the rows of its file went, and its mean stride if in `MOTION`."""
    nan = float("nan")
    head = (trial.run_id, trial.condition, trial.medium, trial.curvature_times_R)
    counts: dict[tuple[str, Remark], int] = {}
    rows = 0
    try:
        track = read_track(folder / trial.track)
        rows = track.rows
        counts = {(DROPPED, why): count for why, count in track.dropped.items()}
        found = pace(track, trial.frequency_Hz, tripods)
    except TrackError as error:
        rest = (rows or error.rows) - sum(counts.values())
        counts[DROPPED, error.reason] = rest
        return (
            *head, trial.frequency_Hz, "", nan, nan, nan, rows or error.rows, 0, "refused",
            *flag_columns([]).values(), *reason_cells([error.reason]),
        ), counts, []  # fmt: skip
    used = len(track.time_s)
    counts[USED, remark("mean-speed")] = used
    if sum(counts.values()) != rows:
        raise RftfitError(
            f"the rows of {trial.track} do not add up: {sum(counts.values())} counted, {rows} in "
            "the file: this is a fault of the program, please report it"
        )
    shown = any(
        abs(trial.curvature_times_R - curvature) < 1e-6
        and abs(found.frequency_Hz - frequency) < MOTION_NEAR_HZ
        for curvature, frequency in MOTION
    )
    return (
        *head, found.frequency_Hz, found.frequency_from, found.speed_cm_per_s,
        found.stride_sd_cm_per_s, found.strides, rows, used, "used",
        *flag_columns(found.flags).values(), *reason_cells([]),
    ), counts, found.velocity_cm_per_s.tolist() if shown else []  # fmt: skip


def _sweep_tables(
    results: Results, runs: dict[str, pd.DataFrame], widths: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Join the runs of all profiles, find the best curvatures, compare with what was measured.

    Returns a row for each run, for each frequency and for each measured condition of each profile.
    """
    import pandas as pd

    _, robot = robot_of(results.campaign)
    measured = results.table("robot/measured.csv")
    whole = pd.concat([one for one in runs.values() if len(one)], ignore_index=True)
    marked = measured[measured["calibrated"] == "yes"]
    places = set(zip(marked["curvature_times_R"], marked["frequency_Hz"], strict=True))
    here = zip(whole["curvature_times_R"], whole["frequency_Hz"], strict=True)
    whole["calibrated"] = ["yes" if place in places else "no" for place in here]
    best_at = [BEST_AT_HZ] if robot == paper_robot() else []
    best = optima(whole, best_at, results.config.fit.confidence, widths)
    means = [mean_speed(table).assign(profile=profile) for profile, table in runs.items()]
    errors = speed_errors(measured, pd.concat(means, ignore_index=True), widths)
    return results.marked(whole), results.marked(best), results.marked(errors)


# --- The force profiles that the robot runs on, from the tables of the earlier stages.


PROFILES = ("table", "map", "generic", "depth_only")
"""Measured table, scaled generic coefficients, depth-only model: those of the paper's Fig. S13. The map
is run on where the table has holes: of a medium that was pushed in every direction they are one."""


def profiles_of(results: Results) -> tuple[str, ...]:
    """Profiles of the robot's medium that differ."""
    holes = robot_profile(results, "table").reason
    return tuple(name for name in PROFILES if holes or name != "map")


def robot_profile(results: Results, name: str) -> Profile:
    """Profile of the robot's medium: one of `PROFILES`; NaN, with a reason, where there is no number."""
    return results[results.campaign.robot_medium].profile(name, draws=False)


# --- Finished runs of a sweep, kept as they come, so that an interrupted sweep goes on from there.


FLUSH_S = 2.0
"""What is finished is written at least this often: a killed sweep loses no more."""

_TEXTS = ("outcome", *REASON, "warning")


@dataclass
class Store:
    """A folder with one table for each curvature, and a digest of what the runs depend on in its name.

    `rows`: By curvature, frequency (Hz) and phase (turns) of a finished run.
    """

    folder: Path
    rows: dict[tuple[float, float, float], tuple[object, ...]] = field(default_factory=dict)

    @classmethod
    def load(cls, folder: Path) -> Store:
        """Read what is finished; a damaged table counts as not there, and so does the folder."""
        store = cls(folder)
        for path in sorted(folder.glob("*.csv")):
            try:
                table = read_csv(path, lambda name: "text" if name in _TEXTS else "")
            except InputError:
                continue
            if list(table.columns) == list(RUN_COLUMNS):
                table = table.fillna(dict.fromkeys(_TEXTS, ""))
                for row in table.itertuples(index=False, name=None):
                    store.rows[key_of(*row[:3])] = row
        return store

    def write(self, curvatures: set[float]) -> None:
        """Write the tables of some curvatures."""
        for curvature in sorted(curvatures):
            own = [self.rows[key] for key in sorted(self.rows) if key[0] == curvature]
            write_csv(speed_table(own), self.folder / f"curvature_{curvature:+.6g}.csv")

    def table(self, conditions: Sequence[Condition]) -> pd.DataFrame:
        """Table of some runs, all of them finished."""
        return speed_table(self.rows[key(one)] for one in conditions)


def key(condition: Condition) -> tuple[float, float, float]:
    """Name of a run in the store."""
    return key_of(condition.curvature_times_R, condition.frequency_Hz, condition.phase_turns)


def key_of(*numbers: float) -> tuple[float, float, float]:
    """Round curvature, frequency and phase to what a table keeps."""
    curvature, frequency, phase = (float(f"{number:.6g}") + 0.0 for number in numbers)
    return curvature, frequency, phase


def fill(
    store: Store,
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition],
    threads: int,
    on_done: Callable[[int, int], None],
) -> None:
    """Run what is not finished yet, and keep it as it comes; `on_done` is told how many of how many are."""
    waiting = [one for one in conditions if key(one) not in store.rows]
    done, unsaved, saved_at = len(conditions) - len(waiting), set[float](), time.monotonic()
    on_done(done, len(conditions))

    def keep(run: RobotRun) -> None:
        nonlocal done, saved_at
        store.rows[key(run.condition)] = row_of(run)
        unsaved.add(key(run.condition)[0])
        done += 1
        on_done(done, len(conditions))
        if time.monotonic() - saved_at > FLUSH_S:
            store.write(unsaved)
            unsaved.clear()
            saved_at = time.monotonic()

    try:
        run_all(robot, profile, waiting, threads, keep)
    finally:
        # also where it was interrupted
        store.write(unsaved)


def forget_others(folder: Path) -> None:
    """Keep this store, ``<profile>-<digest>``, of those of its profile: others are of another robot."""
    stem = folder.name.rpartition("-")[0]
    for other in folder.parent.glob(f"{stem}-*"):
        if other != folder and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)


# --- The robot's sweep: one profile over all its conditions.


EVERY = 4
"""The reduced sweep takes every fourth curvature and frequency."""

_FINE_FROM = 0.4


def conditions_of(measured: pd.DataFrame, *, full: bool) -> list[Condition]:
    """Conditions of a sweep: its grid, and every measured condition.

    The reduced sweep has one starting phase of three (on the published table the others change no
    measured speed by 1 %), every fourth curvature and frequency, and at 5 Hz every curvature above 0.4,
    where the paper's best one lies.
    """
    grid = paper_conditions()
    phases = PHASES_TURNS if full else PHASES_TURNS[:1]
    if not full:
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


def robot_sweep(results: Results, threads: int) -> tuple[pd.DataFrame, ...]:
    """Run the robot at every condition of the reduced sweep on every profile, and on draws of alpha.

    Returns the runs of each profile, half widths of the intervals, and the tables of the sweep.
    """
    runs = _swept(results, threads, full=False)
    half_widths = robot_intervals(results, threads)
    return *runs.values(), half_widths, *_sweep_tables(results, runs, half_widths)


def robot_full(results: Results, threads: int) -> tuple[pd.DataFrame, ...]:
    """Tables of the paper's whole sweep, started by ``rftfit sweep``."""
    runs = _swept(results, threads, full=True)
    return *runs.values(), *_sweep_tables(results, runs, results.table("robot/intervals.csv"))


def _swept(results: Results, threads: int, *, full: bool) -> dict[str, pd.DataFrame]:
    """Runs by profile; none of one that is the same as another."""
    import pandas as pd

    names = profiles_of(results)
    nothing = pd.DataFrame(columns=["profile", "medium", *RUN_COLUMNS])
    return {
        name: swept(results, name, threads, full=full) if name in names else nothing
        for name in PROFILES
    }


def swept(
    results: Results, profile: str, threads: int, on_done: Callable[[int, int], None] | None = None,
    *, full: bool,
) -> pd.DataFrame:  # fmt: skip
    """Run the robot at every condition of a sweep on one profile: `profile, medium`, `RUN_COLUMNS`.

    Finished runs are kept in ``results/robot/parts``, so that an interrupted sweep goes on.
    `on_done`: Told how many of how many runs are done; default: into the log of the job.
    """
    shown = -1

    def log(done: int, total: int) -> None:
        nonlocal shown
        if total and 10 * done // total > shown:
            shown = 10 * done // total
            sys.stderr.write(f"{profile}: {done} of {total} runs\n")
            sys.stderr.flush()

    section, robot = robot_of(results.campaign)
    made = robot_profile(results, profile)
    conditions = conditions_of(results.table("robot/measured.csv"), full=full)
    digest = digest_of(
        robot.model_dump(mode="json"),
        [part.tobytes().hex() for part in made.parameters],
        code_digest("rftfit.robot.sweep"),
    )
    folder = results.root / "results" / "robot" / "parts"
    store = Store.load(folder / f"{profile}-{digest}")
    fill(store, robot, made, conditions, threads, on_done or log)
    forget_others(store.folder)
    # as they are kept: a sweep that was interrupted gives the same bytes as one that was not
    table = Store.load(store.folder).table(conditions)
    table.insert(0, "profile", profile)
    table.insert(1, "medium", section.medium)
    return table


# --- Half widths of the intervals of the robot's speed and best curvature, from the errors of alpha.


INTERVAL_PROFILES = ("table", "map", "generic")
"""On which speeds are predicted in earnest; depth-only is the baseline that they are held against."""


def robot_intervals(results: Results, threads: int) -> pd.DataFrame:
    """Half widths of speeds and best curvature, from runs of the robot on draws of alpha."""
    section, robot = robot_of(results.campaign)
    names = [name for name in profiles_of(results) if name in INTERVAL_PROFILES]
    every = {name: results[section.medium].profile(name) for name in names}
    # without a nine-term fit there is no generic profile
    profiles = {name: one for name, one in every.items() if isinstance(one.spread, Profile)}
    measured = results.table("robot/measured.csv")
    level, arc = results.config.fit.confidence, results.config.errors.arc_percent
    found = widths(robot, profiles, measured, level, threads, arc)
    found.insert(0, "medium", section.medium)
    return found[WIDTH_COLUMNS]


def widths(
    robot: Robot,
    profiles: Mapping[str, Profile],
    measured: pd.DataFrame,
    confidence: float,
    threads: int | None = None,
    arc_percent: float = 0.0,
) -> pd.DataFrame:
    """Half widths for every measured condition, and of the best curvature, on each profile.

    The spread of each profile is a stack of draws. Returns `WIDTH_COLUMNS` without the medium.
    """
    import pandas as pd

    known = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    places = zip(known["frequency_Hz"], known["curvature_times_R"], strict=True)
    conditions = [Condition(*place) for place in dict.fromkeys(places)]
    rows: list[tuple[object, ...]] = []
    for name, profile in profiles.items():
        stack, bare = profile.spread, copy(profile)
        assert isinstance(stack, Profile)
        bare.spread = None  # the processes need not carry it
        draws = each_draw(stack, DRAWS)
        found = speed_widths(robot, bare, draws, conditions, confidence, threads, arc_percent)
        rows += [
            (name, SPEED, at.curvature_times_R, at.frequency_Hz, *w.cells)
            for at, w in zip(conditions, found, strict=True)
        ]
        many = each_draw(stack, BEST_DRAWS)
        best = best_width(robot, bare, many, confidence, threads)
        rows.append((name, BEST, math.nan, BEST_AT_HZ, *best.cells))
    return pd.DataFrame(rows, columns=WIDTH_COLUMNS[1:])


# --- Pictures of the running robot for the report page: poses and the force on every element.


FREQUENCIES_HZ = (1.0, 2.0, 5.0)
CURVATURES = (1.0, 0.86, 0.0, -1.0)
FRAMES = 36
"""Of one stride, the last of the run."""

_SMALLEST_N = 5e-4


def robot_motion(results: Results) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    """Run the conditions of `MOTION` and of the page's pictures, on the map where the table has holes.

    Returns the last two strides of each run of `MOTION`, its mid-stance, and the pictures as JSON.
    """
    import pandas as pd

    section, robot = robot_of(results.campaign)
    name = "map" if "map" in profiles_of(results) else "table"
    profile = robot_profile(results, name)
    motion, stances = [], []
    for curvature, frequency in MOTION:
        run = simulate(robot, profile, frequency, curvature, samples_per_stride=SAMPLES)
        motion.append(tail_of(run, SAMPLES))
        stances.append(stance_of(robot, profile, run, SAMPLES))
    tables = [pd.concat(parts, ignore_index=True) for parts in (motion, stances)]
    for table in tables:
        table.insert(0, "profile", name)
    data = frames_of(robot, robot_profile(results, PROFILES[0])) | {"medium": section.medium}
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return *tables, text + "\n"  # type: ignore[return-value]


def frames_of(robot: Robot, profile: Profile) -> dict[str, Any]:
    """Make the pictures of every condition.

    ``plates`` (ends, cm) and ``hips`` (x, z, cm; phase, turns) are in the body's frame; ``legs``: points
    about the hip at theta = 0, by curvature; of each run, by frame, ``pose`` (x from the first frame, z,
    pitch, nose up, and theta in rad) and ``arrows`` (x from the centre of mass, z, force x, force z for
    each loaded element; cm and mN).
    """
    shapes = {}
    for curvature in CURVATURES:
        legs = arc(
            curvature, robot.legs.max_length_cm, robot.legs.width_cm, robot.numerics.elements
        )
        body = legs.body
        ends = np.vstack([body[:, :2] - body[:, 4:5] * body[:, 2:4],
                          body[-1:, :2] + body[-1:, 4:5] * body[-1:, 2:4]])  # fmt: skip
        shapes[f"{curvature:g}"] = np.round(ends, 3).tolist()
    return {
        "title": robot.title,
        "plates": [[*plate.from_cm, *plate.to_cm] for plate in robot.body.plates.values()],
        "hips": [[hip.x_cm, hip.z_cm, hip.phase_turns] for hip in robot.legs.hips],
        "legs": shapes,
        "runs": [
            _run(robot, profile, frequency, curvature)
            for curvature in CURVATURES
            for frequency in FREQUENCIES_HZ
        ],
    }


def _run(robot: Robot, profile: Profile, frequency: float, curvature: float) -> dict[str, Any]:
    run = simulate(robot, profile, frequency, curvature, samples_per_stride=FRAMES)
    assert run.series is not None
    series = run.series.last(FRAMES)
    parts = element_series(robot, profile, replace(run, series=series)).values()
    pose = np.column_stack(
        [
            series.x_cm - series.x_cm[0], series.z_cm, np.radians(series.pitch_deg),
            np.radians(series.leg_angle_deg) % (2 * np.pi),
        ]
    )  # fmt: skip
    arrows = []
    for at, x in enumerate(series.x_cm):
        rows = np.vstack(
            [
                np.column_stack(
                    [one.at_x_cm[at].ravel() - x, one.at_z_cm[at].ravel(),
                     one.force_x_N[at].ravel(), one.force_z_N[at].ravel()]
                )
                for one in parts
            ]
        )  # fmt: skip
        felt = rows[np.hypot(rows[:, 2], rows[:, 3]) > _SMALLEST_N]
        felt[:, 2:] *= 1000
        arrows.append(_short(felt))
    speed = run.speed_cm_per_s
    return {
        "frequency_Hz": frequency,
        "curvature": curvature,
        "speed_cm_per_s": float(f"{speed:.5g}") if np.isfinite(speed) else None,
        "outcome": run.outcome,
        "warning": run.warning,
        "stride_s": 1 / frequency,
        "pose": np.round(np.nan_to_num(pose), 4).tolist(),
        "arrows": arrows,
    }


def _short(rows: np.ndarray) -> list[float]:
    """Places to 0.1 mm, forces to 0.1 mN, one list for all."""
    places, forces = np.round(rows[:, :2], 2), np.round(rows[:, 2:], 1)
    flat: list[float] = (np.hstack([places, forces]) + 0.0).ravel().tolist()
    return flat


# --- The last strides of a run, for figures of its motion.

SAMPLES, STRIDES = 200, 2


def stance_of(robot: Robot, profile: Profile, run: RobotRun, samples: int) -> pd.DataFrame:
    """Place every element, and the force on it, as the legs of phase 0 last hang straight down.

    A row an element; x counts from the centre of mass. `samples`: Of the run's series, in a stride.
    """
    import pandas as pd

    assert run.series is not None
    last = run.series.last(samples)
    hanging = np.cos(np.radians(last.leg_angle_deg - last.pitch_deg))
    shot = run.series.last(len(hanging) - int(np.argmax(hanging)))
    groups = element_series(robot, profile, replace(run, series=shot), len(shot.x_cm))
    parts = []
    for name, one in groups.items():
        (x1, x2), (z1, z2) = (ends[0].reshape(-1, 2).T for ends in (one.ends_x_cm, one.ends_z_cm))
        at_x, at_z, force_x, force_z = (
            values[0].ravel() for values in (one.at_x_cm, one.at_z_cm, one.force_x_N, one.force_z_N)
        )
        x0 = shot.x_cm[0]
        parts.append(
            pd.DataFrame(
                {
                    "curvature_times_R": run.condition.curvature_times_R,
                    "frequency_Hz": run.condition.frequency_Hz, "group": name,
                    "x1_cm": x1 - x0, "z1_cm": z1, "x2_cm": x2 - x0, "z2_cm": z2,
                    "at_x_cm": at_x - x0, "at_z_cm": at_z, "force_z_N": force_z, "force_x_N": force_x,
                }
            )
        )  # fmt: skip
    return pd.concat(parts, ignore_index=True)


def tail_of(run: RobotRun, samples: int) -> pd.DataFrame:
    """Cut the last two strides out of a run with a series; time and x count from the first row.

    Columns `curvature_times_R, frequency_Hz, stride` (0 to 2), and those of `Series.table`.
    """
    assert run.series is not None
    table = run.series.table().iloc[-STRIDES * samples :].reset_index(drop=True)
    for name in ("time_s", "x_cm"):
        table[name] -= table[name].iloc[0]
    table["leg_angle_deg"] -= 360 * np.floor(table["leg_angle_deg"].iloc[0] / 360)
    table.insert(0, "stride", np.arange(len(table)) / samples)
    table.insert(0, "frequency_Hz", run.condition.frequency_Hz)
    table.insert(0, "curvature_times_R", run.condition.curvature_times_R)
    return table
