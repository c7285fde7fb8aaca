"""Marker tracks of the robot, re-enacted from the published speeds (Fig. 4C).

A *track* is the position of a marker on the running robot, x forward and z upward, cm, at the frames of a camera. A
*condition* is a curvature of the legs and a stride frequency; it has `TRIALS` trials, each with a track.
"""

from __future__ import annotations

import csv
import hashlib
import io
import math
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from rftfit import reference
from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.lab.plan import FloatArray
from rftfit.lab.write import format_numbers
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `lab/chosen.toml`, table `tracks`, says what each decides
_CHOSEN = chosen("lab", "tracks")

MEDIUM = "poppy_LP"
"""Published name of the medium that the paper's robot ran on."""

TRIALS: int = _CHOSEN.trials
"""Trials of each condition."""


@dataclass(frozen=True)
class RobotTrial:
    """One trial of the robot.

    `medium`: Name in the config. `condition`: Name of the condition, whose trials have the published speed as their
    mean.
    `curvature_times_R`: Curvature R/r of the legs: 1 c-leg, 0 flat, -1 reversed.
    `frequency_Hz`: Strides a second of this trial. `speed_cm_per_s`: Its mean speed.
    `track`: Path of its track relative to the sheet of tracks.
    """

    run_id: str
    condition: str
    medium: str
    curvature_times_R: float
    frequency_Hz: float
    speed_cm_per_s: float
    track: str


def plan_trials(config: Config, seed: int) -> list[RobotTrial]:
    """List the trials of the robot; none unless the config has a sheet of tracks and the published medium.

    Speeds and frequencies of the trials of a condition scatter about the published ones, which are their means.
    """
    robot = config.robot
    if robot is None or robot.runs is None or config.media[robot.medium].published_as != MEDIUM:
        return []
    trials = []
    for curvature, number, frequency, speed in reference.running_speeds():
        # as k, sign, R/r in percent, number of the frequency
        sign = "m" if curvature < 0 else "p"
        condition = f"k{sign}{abs(100 * curvature):03.0f}_{number}"
        rng = _make_random(seed, condition)
        speed_jitter = rng.normal(0, _CHOSEN.speed_spread, TRIALS)
        trial_speeds = speed * (1 + speed_jitter - speed_jitter.mean())
        jitter = rng.normal(0, _CHOSEN.frequency_spread, TRIALS)
        trial_frequencies = frequency * (1 + jitter - jitter.mean())
        head = condition, robot.medium, curvature
        for letter, hz, cm_per_s in zip(
            "abc", trial_frequencies.tolist(), trial_speeds.tolist(), strict=True
        ):
            run_id = f"robot_{condition}_{letter}"
            trials.append(RobotTrial(run_id, *head, hz, cm_per_s, f"tracks/{run_id}.csv"))
    return trials


def _draw_track(trial: RobotTrial, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Make time (s), x and z (cm) of a marker on the running robot, shape (n,) each, with the noise of a camera.

    The body bobs and surges twice a stride, as two groups of legs take turns, and a little once a stride.
    """
    rng = _make_random(seed, trial.run_id)
    duration = max(_CHOSEN.strides / trial.frequency_Hz, _CHOSEN.shortest_s)
    time = np.arange(int(duration * _CHOSEN.frames_hz) + 1) / _CHOSEN.frames_hz
    turn = 2 * math.pi * trial.frequency_Hz * time + rng.uniform(0, 2 * math.pi)
    surge = _CHOSEN.surge * trial.speed_cm_per_s / (4 * math.pi * trial.frequency_Hz)
    x = trial.speed_cm_per_s * time + surge * np.sin(2 * turn)
    z = (
        2.5
        + _CHOSEN.bob_cm * np.cos(2 * turn + 0.4)
        + _CHOSEN.uneven_cm * np.cos(turn)
        - 0.02 * time
    )
    noise = rng.normal(0, _CHOSEN.marker_sd_cm, (2, time.size))
    return time, x + noise[0], z + noise[1]


_COLUMNS = ("run_id", "condition", "medium", "curvature_times_R", "frequency_Hz", "track", "note")
"""Columns of the sheet of tracks."""


def track_files(config: Config, seed: int) -> dict[str, str]:
    """Make the texts of the tracks and, last, of their sheet (csv), by path relative to raw; empty without trials."""
    trials = plan_trials(config, seed)
    if not trials or config.robot is None or config.robot.runs is None:
        return {}
    folder, files = PurePosixPath(config.robot.runs).parent, {}
    buffer = io.StringIO()
    sheet = csv.writer(buffer, lineterminator="\n")
    sheet.writerow(_COLUMNS)
    for trial in trials:
        head = (
            f"# marker track of trial {trial.run_id}, re-enacted from Fig. 4C\n"
            "# centre of the body, 60 frames/s; x forward, z up\ntime_s,x_cm,z_cm\n"
        )
        rows = format_numbers(list(_draw_track(trial, seed)), [4, 3, 3])
        files[(folder / trial.track).as_posix()] = head + rows
        facts = trial.run_id, trial.condition, trial.medium, f"{trial.curvature_times_R:g}"
        # the frequency is blank, so that the program has to find it in the track
        sheet.writerow([*facts, "", trial.track, "re-enacted from Fig. 4C"])
    return files | {config.robot.runs: buffer.getvalue()}


def _make_random(seed: int, name: str) -> np.random.Generator:
    """Make random numbers that depend on the seed and a name alone."""
    digest = hashlib.sha256(f"{seed} {name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


def lacks_tracks(campaign: Campaign) -> bool:
    """Return True if logs of the robot's medium exist but no tracks: older versions wrote none."""
    robot = campaign.config.robot
    if robot is None or robot.runs is None or not (campaign.raw / robot.medium).is_dir():
        return False
    return not (campaign.raw / robot.runs).is_file()
