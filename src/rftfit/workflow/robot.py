"""Stages of the robot: measured speeds, sweep, intervals, motion, pictures."""

from __future__ import annotations

import json
import math
import shutil
import sys
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.compare.legs import laboratory_candidates
from rftfit.compare.robot import optima
from rftfit.errors import InputError, RftfitError
from rftfit.measure.ledger import COLUMNS as LEDGER_COLUMNS
from rftfit.measure.ledger import DROPPED, USED
from rftfit.model.fourier import TERMS
from rftfit.model.outlines import arc
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic
from rftfit.model.scaling import fit_media, vertical_penetration
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
    PHASES_TURNS,
    RUN_COLUMNS,
    mean_speed,
    paper_conditions,
    run_all,
    share,
    speed_table,
)
from rftfit.robot.tracks import TrackError, pace, read_track, read_trials
from rftfit.store import read_csv, write_csv, write_text
from rftfit.store.digests import code_digest, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config, RobotRuns
    from rftfit.campaign.load import Campaign
    from rftfit.compare.legs import Candidate
    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun
    from rftfit.robot.tracks import Trial


# --- The robot: measured speeds from marker tracks, and how those of the sweep compare.


TRIALS = [
    "run_id", "condition", "medium", "curvature_times_R", "frequency_Hz", "frequency_from",
    "speed_cm_per_s", "stride_sd_cm_per_s", "strides", "rows", "rows_used", "status", "flags",
    "reason",
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
    """Read the robot's run sheet.

    Returns empty where the config names no sheet.
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

    `trials`, `measured`, `ledger`: Written: a row for each track, for each condition, and where
    every row of the tracks went.
    """
    import pandas as pd

    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    calibrated = list(CALIBRATED_ON.values()) if robot == paper_robot() else []
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

    `runs`: Read: measured conditions, and the runs of each profile. `intervals`: Read: half widths
    of the intervals (`rftfit.workflow.robot`). `speed`, `optimum`, `errors`: Written: a row for
    each run, frequency and measured condition of each profile.
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


# --- The force profiles that the robot runs on, from the tables of the earlier stages.


PROFILES = ("table", "generic", "depth_only")
"""Measured table, scaled generic coefficients, depth-only model: those of the paper's Fig. S13."""

_GENERIC = "generic"


def robot_profile(
    name: str, medium: str, alpha: pd.DataFrame, coefficients: pd.DataFrame, method: str
) -> Profile:
    """Make one profile of the robot's medium.

    `name`: One of `PROFILES`, or ``fourier``: the medium's own nine terms. `alpha`: Alpha table of
    the medium. `coefficients`: Coefficients of all media and M0. `method`: Of the nine-term fit.
    Returns one that is NaN, with a reason, where the tables have no number.
    """
    if name == "table":
        return TableProfile.from_table(alpha, f"measured table of {medium}")
    if name == "depth_only":
        return DepthOnlyProfile.of(TableProfile.from_table(alpha))
    if name not in ("fourier", _GENERIC):
        raise InputError(f"profile: found {name!r}; allowed: {', '.join(PROFILES)}, fourier")
    own, reason = _terms(coefficients, medium, method)
    if name == "fourier":
        return FourierProfile(own, f"nine terms ({method}) of {medium}", reason)
    m0, why = _terms(coefficients, _GENERIC, method)
    zeta = float(vertical_penetration(own))
    told = f"generic ({method}) times zeta = {zeta:.4f} of {medium}"
    if not np.isfinite(own).all() or not np.isfinite(m0).all():
        return FourierProfile(np.full(9, np.nan), told, reason or why)
    return scaled_generic(zeta, m0, told)


def _terms(coefficients: pd.DataFrame, medium: str, method: str) -> tuple[FloatArray, str]:
    """Nine coefficients, a dropped term being 0; NaN and a reason where there are none."""
    rows = coefficients[
        (coefficients["method"] == method) & (coefficients["medium"] == medium)
    ].drop_duplicates("coefficient")
    rows = rows.set_index("coefficient").reindex(list(TERMS))
    if rows["method"].isna().any():
        return np.full(9, np.nan), f"no nine-term fit ({method}) of {medium}"
    kept = (rows["kept"].astype(str).str.lower() != "false").to_numpy()
    value = np.where(kept, rows["value_N_per_cm3"].to_numpy(float), 0.0)
    reasons = [
        str(text) for text in dict.fromkeys(rows["reason"]) if isinstance(text, str) and text
    ]
    reason = "; ".join(reasons) or f"a coefficient of {medium} is missing"
    return value, "" if np.isfinite(value).all() else reason


# --- Finished runs of a sweep, kept as they come, so that an interrupted sweep goes on from there.


FLUSH_S = 2.0
"""What is finished is written at least this often: a killed sweep loses no more."""

_TEXTS = ("outcome", "reason", "warning")


@dataclass
class Store:
    """A folder with one table for each curvature.

    `folder`: Its name carries a digest of all that the runs depend on but their conditions.
    `rows`: Curvature, frequency (Hz) and phase (turns) of a finished run to its row of the table.
    """

    folder: Path
    rows: dict[tuple[float, float, float], tuple[object, ...]] = field(default_factory=dict)

    @classmethod
    def load(cls, folder: Path) -> Store:
        """Read what is finished.

        `folder`: It need not exist. A damaged table counts as not finished.
        """
        store = cls(folder)
        for path in sorted(folder.glob("*.csv")):
            try:
                table = read_csv(path)
            except InputError:
                continue
            if list(table.columns) == list(RUN_COLUMNS):
                store.add(table)
        return store

    def add(self, table: pd.DataFrame) -> None:
        """Take in finished runs.

        `table`: Columns of `rftfit.robot.sweep.speed_table`.
        """
        table = table.fillna(dict.fromkeys(_TEXTS, ""))
        for row in table.itertuples(index=False, name=None):
            self.rows[key_of(*row[:3])] = row

    def write(self, curvatures: set[float]) -> None:
        """Write the tables of some curvatures."""
        for curvature in sorted(curvatures):
            own = [self.rows[key] for key in sorted(self.rows) if key[0] == curvature]
            write_csv(_frame(own), self.folder / f"curvature_{curvature:+.6g}.csv")

    def table(self, conditions: Sequence[Condition]) -> pd.DataFrame:
        """Table of some runs, all of them finished."""
        return _frame([self.rows[key(one)] for one in conditions])


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
    threads: int | None = None,
    on_done: Callable[[int, int], None] | None = None,
) -> None:
    """Run what is not finished yet, and keep it as it comes.

    `on_done`: Told how many of how many runs are done, before the first and after each.
    """
    waiting = [one for one in conditions if key(one) not in store.rows]
    done, unsaved, saved_at = len(conditions) - len(waiting), set[float](), time.monotonic()
    if on_done is not None:
        on_done(done, len(conditions))

    def keep(_: int, run: RobotRun) -> None:
        nonlocal done, saved_at
        store.add(speed_table([run]))
        unsaved.add(key(run.condition)[0])
        done += 1
        if on_done is not None:
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
    """Remove stores of the same profile that belong to another robot, profile or program.

    `folder`: The store to keep; its name is ``<profile>-<digest>``.
    """
    stem = folder.name.rpartition("-")[0]
    for other in folder.parent.glob(f"{stem}-*"):
        if other != folder and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)


def _frame(rows: list[tuple[object, ...]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(rows, columns=list(RUN_COLUMNS))


# --- The robot's sweep: one profile over all its conditions, whole or as batches.


SWEEPS = ("robot", "robot_full")
"""Folders of results: the reduced sweep of every run of the workflow, and the paper's own."""

EVERY = 4
"""The reduced sweep takes every fourth curvature and frequency."""

WHOLE = "1-of-1"
"""The batch that is the whole sweep."""

_FINE_FROM = 0.4


def conditions_of(sweep: str, measured: pd.DataFrame) -> list[Condition]:
    """Conditions of a sweep: its grid, and every measured condition.

    The full sweep has three starting phases. The reduced one has one (on the published measured
    table the others change the speed of no measured condition by 1 %), every fourth curvature and
    frequency, and at 5 Hz every curvature above 0.4, where the paper's best one lies.

    `sweep`: One of `SWEEPS`. `measured`: Measured conditions. Returns each once, by curvature,
    frequency and phase.
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
    config: Path, profile: str, sweep: str, batch: str, threads: str, alpha: Path,
    coefficients: Path, measured: Path, parts: list[Path], runs: Path,
) -> None:  # fmt: skip
    """Run the robot at every condition of a sweep, or of a batch of it, on one profile.

    Finished runs are kept in ``results/robot/parts``, so that an interrupted sweep goes on.

    `profile`, `sweep`: One of `rftfit.workflow.robot.PROFILES` and of `SWEEPS`. `batch`:
    ``3-of-17``: only this share of the conditions; ``1-of-1``: all of them. `threads`: Runs at
    once. `alpha`, `coefficients`, `measured`: Read: alpha table of the robot's medium,
    coefficients of all, measured conditions. `parts`: Read: tables of batches that are done, whose
    runs are not made again. `runs`: Written: a row for each run.
    """
    # into the log of the job: how far it is
    shown = -1

    def say(done: int, total: int) -> None:
        nonlocal shown
        if total and 10 * done // total > shown:
            shown = 10 * done // total
            sys.stderr.write(f"{profile}: {done} of {total} runs\n")
            sys.stderr.flush()

    if not (threads.isdecimal() and int(threads)):
        raise InputError(f"threads: found {threads!r}; allowed: 1, 2, 3 ...")
    made = swept(
        config, profile, sweep, alpha, coefficients, measured, say, int(threads), batch, parts
    )
    write_csv(made, runs)


def swept(
    config: Path, profile: str, sweep: str, alpha: Path, coefficients: Path, measured: Path,
    on_done: Callable[[int, int], None] | None = None, threads: int | None = None,
    batch: str = WHOLE, parts: Sequence[Path] = (),
) -> pd.DataFrame:  # fmt: skip
    """Do the work of `robot_sweep`; for whoever wants to see how far it is.

    `alpha`, `coefficients`, `measured`: As for `robot_sweep`. `on_done`: Told how many of how many
    runs are done. `threads`: Default: one for each core. `parts`: As for `robot_sweep`. Returns
    `profile, medium`, then the columns of `rftfit.robot.sweep.speed_table`.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    method = campaign.config.fourier.method
    made = robot_profile(profile, section.medium, read_csv(alpha), read_csv(coefficients), method)
    conditions = share(conditions_of(sweep, read_csv(measured)), batch)
    digest = digest_of(
        robot.model_dump(mode="json"),
        [part.tobytes().hex() for part in made.parameters],
        code_digest("rftfit.robot.sweep"),
    )
    store = Store.load(campaign.root / "results" / "robot" / "parts" / f"{profile}-{digest}")
    for path in parts:
        store.add(read_csv(path)[list(RUN_COLUMNS)])
    fill(store, robot, made, conditions, threads, on_done)
    forget_others(store.folder)
    table = store.table(conditions)
    table.insert(0, "profile", profile)
    table.insert(1, "medium", section.medium)
    return table


# --- Half widths of the intervals of the robot's speed and best curvature, from the errors of alpha.


INTERVAL_PROFILES = ("table", "generic")
"""On which speeds are predicted in earnest; depth-only is the baseline that they are held against."""


def robot_intervals(config: Path, alpha: list[Path], measured: Path, intervals: Path) -> None:
    """Run the robot on draws of alpha, under every measured condition and for its best curvature.

    `alpha`: Read: alpha tables of all laboratory media. `measured`: Read: measured conditions.
    `intervals`: Written: half widths, `rftfit.robot.intervals.WIDTH_COLUMNS`.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    candidates = _candidates(campaign.config, section.medium, [read_csv(path) for path in alpha])
    level = campaign.config.fit.confidence
    found = widths(robot, candidates, read_csv(measured), level)
    found.insert(0, "medium", section.medium)
    write_csv(found[WIDTH_COLUMNS], intervals)


def _candidates(config: Config, medium: str, tables: list[pd.DataFrame]) -> list[Candidate]:
    """Profiles of the robot's medium with draws."""
    method = config.fourier.method
    fits = [fit for fit in fit_media(tables, config) if fit.method == method]
    table = next(table for table in tables if table["medium"].iloc[0] == medium)
    own = next(fit for fit in fits if fit.medium == medium)
    found = laboratory_candidates(table, own, [fit for fit in fits if not fit.reason], config)
    return sorted(
        (one for one in found if one.name in INTERVAL_PROFILES),
        key=lambda one: INTERVAL_PROFILES.index(one.name),
    )


def widths(
    robot: Robot,
    candidates: list[Candidate],
    measured: pd.DataFrame,
    confidence: float,
    threads: int | None = None,
) -> pd.DataFrame:
    """Half widths for every measured condition, and of the best curvature, on each profile.

    `candidates`: Profiles and their draws. `measured`: Measured conditions. `threads`: Default:
    one for each core. Returns columns `rftfit.robot.intervals.WIDTH_COLUMNS` without the medium.
    """
    import pandas as pd

    known = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    places = zip(known["frequency_Hz"], known["curvature_times_R"], strict=True)
    conditions = [Condition(*place) for place in dict.fromkeys(places)]
    rows: list[tuple[object, ...]] = []
    for one in candidates:
        draws = each_draw(one.draws, DRAWS)
        found = speed_widths(robot, one.profile, draws, conditions, confidence, threads)
        rows += [
            (one.name, SPEED, at.curvature_times_R, at.frequency_Hz, w.half, w.draws, w.reason)
            for at, w in zip(conditions, found, strict=True)
        ]
        many = each_draw(one.draws, BEST_DRAWS)
        best = best_width(robot, one.profile, many, confidence, threads)
        rows.append((one.name, BEST, math.nan, BEST_AT_HZ, best.half, best.draws, best.reason))
    return pd.DataFrame(rows, columns=WIDTH_COLUMNS[1:])


# --- Pictures of the running robot for the report page: poses and the force on every element.


FREQUENCIES_HZ = (1.0, 2.0, 5.0)
CURVATURES = (1.0, 0.86, 0.0, -1.0)
FRAMES = 36
"""Of one stride, the last of the run."""

_SMALLEST_N = 5e-4


def robot_frames(config: Path, alpha: Path, coefficients: Path, frames: Path) -> None:
    """Run a few conditions on the measured table and keep their last stride as pictures.

    `alpha`, `coefficients`: Read: alpha table of the robot's medium, coefficients of all.
    `frames`: Written (json): see `frames_of`.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    profile = robot_profile(
        "table", section.medium, read_csv(alpha), read_csv(coefficients),
        campaign.config.fourier.method,
    )  # fmt: skip
    data = frames_of(robot, profile)
    data["medium"] = section.medium
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    write_text(frames, text + "\n")


def frames_of(robot: Robot, profile: Profile) -> dict[str, Any]:
    """Make the pictures of every condition.

    Returns ``title``; ``plates`` (ends, cm) and ``hips`` (x, z, cm; phase, turns) in the body's
    frame; ``legs``: points of a leg about its hip at theta = 0, by curvature; ``runs``: of each
    condition frequency, curvature, speed, outcome, warning, time of a stride, and by frame `pose`
    (x from the first frame, z, pitch in rad, theta in rad) and `arrows` (x from the centre of
    mass, z, force x, force z for each loaded element; cm and mN).
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
    last = slice(-FRAMES, None)
    columns: dict[str, Any] = {
        name: {key: part[last] for key, part in values.items()}
        if isinstance(values, dict)
        else values[last]
        for name, values in vars(run.series).items()
        if name != "groups"
    }
    series = replace(run.series, **columns)
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
