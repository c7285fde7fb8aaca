"""Run sheet and marker tracks of the robot: readers, and stride frequency and mean speed of each trial.

A trial is one run of the real robot. Its marker track is a table of time (s) and of x and z (cm) of a point of the
body, read off a film. Four parts: the sheet (`read_trials`), the tracks (`read_track`), the speed of a trial
(`mean_stride_speed`), and the check of all these files before any result is calculated (`check_robot`).

A `Remark` is a reason or a doubt: a code with numbers, which becomes a sentence. Problems of a sheet or file have a
place, and are collected, so that a user sees all at once.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from rftfit.campaign.config import Config, RobotRuns
from rftfit.campaign.files import Folder, campaign_folder, folded
from rftfit.campaign.presence import root_of
from rftfit.campaign.problems import CampaignError, Problem
from rftfit.campaign.reading import read_model
from rftfit.campaign.rows import DraftRow, Schema, TableColumn, read_rows
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.measure.flags import Remark, remark
from rftfit.robot.config import read_robot
from rftfit.store.chosen import chosen
from rftfit.store.text import count

_CHOSEN = chosen("robot", "tracks")
"""Chosen limits and numbers of this module, explained in ``chosen.toml``."""

# --- The robot's run sheet, which names condition and marker track of each trial.

_CURVATURE = "R'/r of the legs, -1 (reversed c-leg) to 1 (c-leg)"
_FREQUENCY = "stride frequency; blank: taken from the track"
_FILE = TableColumn(
    "track", "path", "file of the marker track, relative to the folder of this sheet"
)
COLUMNS = (
    TableColumn("run_id", "text", "unique name of the trial"),
    TableColumn("condition", "text", "name shared by the trials of one condition"),
    TableColumn("medium", "choice", "the medium that the config's robot runs on"),
    TableColumn("curvature_times_R", meaning=_CURVATURE, low=-1, high=1),
    TableColumn("frequency_Hz", meaning=_FREQUENCY, needed=False, above=0, high=100, unit="Hz"),
    _FILE,
    TableColumn("note", "text", "free text", needed=False),
)
"""Columns of the robot's run sheet, a row for each trial."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial, a row of the robot's run sheet.

    `condition`: name shared by trials that were run alike. `curvature_times_R`: R'/r of the legs. `frequency_Hz`:
    stride frequency; NaN: found in the track. `track`: path of the marker track, relative to the folder of the sheet.
    """

    run_id: str
    condition: str
    medium: str
    curvature_times_R: float
    frequency_Hz: float
    track: str


def read_trials(
    path: Path,
    file: str,
    medium: str,
    taken: Collection[str],
    tracks: tuple[Folder, str] | None = None,
) -> tuple[list[Trial], list[Problem]]:
    """Return the trials in rows of a robot's run sheet without an error, and all problems, in order.

    `path`: the sheet; `file`: its name in messages. `medium`: the only medium allowed, that of the config's section
    ``robot``. `taken`: names of the campaign's runs, which a trial must not have, since results are named by run.
    `tracks`: the raw folder, and in it the folder of the sheet, to check that the tracks exist; None: not checked.
    """
    columns = [
        replace(column, choices=(medium,)) if column.form == "choice" else column
        for column in COLUMNS
    ]
    drafts, problems = read_rows(path, Schema("robot-sheet", tuple(columns), "trials"), file)
    # number of the row where a name first stands, by column and name without case
    first_row: dict[tuple[str, str], int] = {}
    # first trial of each condition
    conditions: dict[str, DraftRow] = {}
    # `draft.note` adds a problem to `problems`, and makes the row bad
    for draft in drafts:
        for name in ("run_id", "track"):
            cell = draft.text[name]
            # names become parts of file names: two must not differ in case alone. `row`: the first with this name
            row = first_row.setdefault((name, folded(cell)), draft.row)
            if cell and row != draft.row:
                allowed = f"a {name} of its own; row {row} has this one"
                draft.note(name, "repeated", cell, allowed)
        if draft.text["run_id"] in taken:
            allowed = "a name that no run of the campaign's run sheet has"
            draft.note("run_id", "taken", draft.text["run_id"], allowed)
        if not draft.bad:
            _check_condition(draft, conditions)
        if tracks is not None:
            draft.check_file(_FILE, tracks[0], "this trial will be dropped", tracks[1])
    problems.sort(key=lambda problem: problem.place.row or 0)
    return [_make_trial(draft) for draft in drafts if not draft.bad], problems


def _check_condition(draft: DraftRow, conditions: dict[str, DraftRow]) -> None:
    """Note a problem if the curvature of a trial differs from that of the first trial of its condition.

    A condition has one mean speed, so its trials must have the same legs. `conditions`: first trial of each condition,
    to which that of a new condition is added.
    """
    name = "curvature_times_R"
    first_draft = conditions.setdefault(draft.text["condition"], draft)
    if first_draft.number[name] != draft.number[name]:
        allowed = f"{first_draft.number[name]:g}, as in row {first_draft.row} of the same condition"
        draft.note(name, "condition", draft.text[name], f"{allowed} {draft.text['condition']}")


def _make_trial(draft: DraftRow) -> Trial:
    """Make the trial of a row of the sheet without an error; a blank frequency becomes NaN."""
    # later dicts win: texts, NaN for a blank frequency, then the numbers of the cells that are not blank
    cells: dict[str, Any] = draft.text | {"frequency_Hz": math.nan} | draft.number
    return Trial(**{field.name: cells[field.name] for field in fields(Trial)})


# --- Marker tracks of the robot: read with every row accounted for, or refused with a reason.


_MARKER = (
    TableColumn("time_s", meaning="time", unit="s", names_with_unit=("t",)),
    TableColumn("x_cm", meaning="x of the marker", unit="cm"),
    TableColumn("z_cm", meaning="z of the marker, upward", unit="cm"),
)
_TRACK = Schema(
    "track", _MARKER, comments=True, others="ignored", lenient=True, most_rows=2_000_000
)
"""Format of a marker track; a bad cell (`lenient`) only marks its row, which is then left out and counted."""


class TrackError(InputError):
    """A track that cannot be used: `reason` as a remark, and `rows`, the data lines of the file; 0 if not yet counted."""

    def __init__(self, code: str, reason: str, rows: int = 0) -> None:
        self.reason, self.rows = Remark(code, words=reason), rows
        super().__init__(reason)


@dataclass(frozen=True)
class Track:
    """Usable rows of a marker track, arrays of shape (n,); time counts from the first of them and grows.

    `x_cm`: forward. `z_cm`: upward, from any height. `rows`: number of data lines of the file. `dropped`: number of
    unusable lines by reason.
    """

    time_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    rows: int
    dropped: dict[Remark, int] = field(default_factory=dict)


def read_track(path: Path) -> Track:
    """Read a marker track, a table of time, x and z, each with its unit in the header.

    Lines that start with ``#`` are comments. A row with a blank cell or one that is no number is left out and counted.
    Raises TrackError for a track that cannot be used: not such a table, no good row, or a time that does not grow from
    row to row (two tracks in one file, or rows out of order, would give a wrong speed).
    """
    names = [column.name for column in _TRACK.columns]
    rows, problems = read_rows(path, _TRACK, "")
    if problems:
        raise TrackError("track-unreadable", "; ".join(map(str, problems)), len(rows))
    good = [row for row in rows if not row.bad]
    if not good:
        empty = f"none of the {len(rows)} rows has a time, x and z"
        raise TrackError("track-empty", empty, len(rows))
    # a row without a number in several columns counts once, by the first of them
    first_bad = (next(name for name in names if name in row.bad) for row in rows if row.bad)
    dropped = Counter(remark("no-number", column=name) for name in first_bad)
    time, x, z = np.array([[row.number[name] for name in names] for row in good]).T
    # indices of rows whose next row is no later
    not_after = np.flatnonzero(np.diff(time) <= 0)
    if not_after.size:
        first = not_after[0]
        before, row = good[first], good[first + 1]
        fault = "stands still" if time[first + 1] == time[first] else "runs backwards"
        again = f", and {not_after.size - 1} times more" if not_after.size > 1 else ""
        description = f"time {fault} in row {row.row}: {row.text['time_s']} after {before.text['time_s']}{again}"
        allowed = "allowed: time that grows from row to row"
        raise TrackError("time-backwards", f"{description}; {allowed}", len(rows))
    return Track(time - time[0], x, z, len(rows), dict(dropped))


# --- Stride frequency and mean speed of a trial, from its marker track.


STRIDE_SAMPLES = 50
"""Moments of the mean stride, evenly spaced, for which its velocity is calculated."""


@dataclass(frozen=True)
class StrideSpeed:
    """Mean forward speed of a track, its standard deviation between strides, and the stride frequency.

    `frequency_from`: "sheet" or "track". `strides`: duration of the track in strides, with a fraction.
    `velocity_cm_per_s`: forward velocity over the mean stride, shape (`STRIDE_SAMPLES`,), which begins at the first
    moment of the track. `flags`: doubts about the frequency, missing rows, a speed that changes.
    """

    speed_cm_per_s: float
    stride_sd_cm_per_s: float
    frequency_Hz: float
    frequency_from: str
    strides: float
    velocity_cm_per_s: FloatArray
    flags: tuple[Remark, ...] = ()


def mean_stride_speed(track: Track, frequency_Hz: float, tripods: int) -> StrideSpeed:
    """Measure the mean speed of a trial; a stride frequency of NaN is found in the track.

    The speed is the slope of x over time, fitted together with four harmonics of the stride, so that it does not depend
    on the moments of a stride at which the track begins and ends. `tripods`: groups of legs that alternate, 1 or more;
    the body bobs once for each in a stride. Raises TrackError for a track that is too short, has too long a gap, or has
    no clear frequency.
    """
    if len(track.time_s) < _CHOSEN.fewest_rows:
        shortage = f"{len(track.time_s)} usable rows; a track has at least {_CHOSEN.fewest_rows}"
        raise TrackError("few-rows", shortage)
    flags: list[Remark] = []
    source = "sheet"
    if math.isnan(frequency_Hz):
        frequency_Hz, doubt = stride_frequency(track, tripods)
        source, flags = "track", [doubt] if doubt else []
    time, x = track.time_s, track.x_cm
    strides = float(time[-1] * frequency_Hz)
    if strides < _CHOSEN.fewest_strides - 1e-6:
        shortage = f"{strides:.3g} strides of {frequency_Hz:.3g} Hz in {time[-1]:.3g} s"
        least = f"at least {_CHOSEN.fewest_strides} are needed for a mean speed"
        raise TrackError("few-strides", f"{shortage}; {least}")
    flags += _flag_gaps(track, frequency_Hz)
    # the harmonics have mean 0 over the stride: what is left is the slope
    velocity = _fit_mean_stride(time, x, frequency_Hz)
    speed = float(velocity.mean())
    whole_strides = int(strides + 1e-6)
    # whole strides that end with the track: what is left over lies at the start, where the robot may accelerate
    ends = time[-1] - np.arange(whole_strides, -1, -1) / frequency_Hz
    speeds = np.diff(np.interp(ends, time, x)) * frequency_Hz
    # a speed that differs between the halves is no steady one; below 1 cm/s the change counts as at 1 cm/s
    half = whole_strides // 2
    first, last = float(speeds[:half].mean()), float(speeds[-half:].mean())
    if abs(last - first) > _CHOSEN.drift_share * max(abs(speed), 1.0):
        flags.append(remark("speed-changes", first=first, last=last))
    return StrideSpeed(
        speed,
        float(speeds.std(ddof=1)),
        float(frequency_Hz),
        source,
        strides,
        velocity,
        tuple(flags),
    )


def stride_frequency(track: Track, tripods: int) -> tuple[float, Remark | None]:
    """Find the stride frequency (Hz) from the bobbing of the body, for a trial whose sheet does not state it.

    Each tripod lifts the body once in a stride, so the body bobs with `tripods` times the stride frequency. That is the
    highest peak in the periodogram of the height z, or of x if z has no clear peak. Trend and outliers are removed
    before, and values are interpolated to even time steps. The frequency is refined by least squares with one overtone.
    Returns the stride frequency, and a doubt if it may be wrong by a factor, else None. Raises TrackError without a
    clear peak.
    """
    time = track.time_s
    duration, step = time[-1], float(np.median(np.diff(time)))
    even = np.arange(0, duration + step / 2, step)
    # `grid`: frequencies of the periodogram, Hz; padded with zeros to `size` samples, so that they lie closer
    size = _CHOSEN.finer * even.size
    grid = np.fft.rfftfreq(size, step)
    # at least two bobs in the track; below the greatest frequency that the frame rate can show
    is_visible = (grid >= 2 / duration) & (grid <= 0.45 / step)
    grid = grid[is_visible]
    for name, coordinate in (("z", track.z_cm), ("x", track.x_cm)):
        if grid.size < 3:
            break
        detrended = _detrend(time, coordinate)
        if not detrended.any():
            continue
        evenly = np.interp(even, time, detrended)
        # share of the variance that a sine of this frequency explains
        power = np.abs(np.fft.rfft(evenly, size))[is_visible] ** 2
        share = 2 * power / (even.size * (evenly @ evenly))
        top = int(np.argmax(share))
        if share[top] < _CHOSEN.least_share:
            continue
        bob = _refine_frequency(time, detrended, float(grid[top]), 1 / (10 * duration))
        # index in the grid of twice the frequency
        twice = int(np.argmin(np.abs(grid - 2 * bob)))
        doubt = None
        # much power at twice this frequency may come from unequal bobs of two tripods: then `bob` is the stride itself
        if tripods > 1 and grid[-1] > 2 * bob and share[twice] > _CHOSEN.uneven_share * share[top]:
            stride = bob / tripods
            doubt = remark("stride-doubled", name=name, bob=bob, twice=2 * bob, stride=stride)
        return bob / tripods, doubt
    raise TrackError(
        "no-stride", "no stride frequency shows in z or x; give frequency_Hz in the sheet"
    )


def _detrend(time: FloatArray, coordinate: FloatArray) -> FloatArray:
    """Subtract a parabola over time (s) from a coordinate (cm), and clip outliers; return zeros if only rounding is left.

    The forward run and a slow rise would hide the bobbing in the periodogram, and so would single false positions.
    """
    # times up to 1 keep the fit well conditioned
    scaled = time / time[-1]
    residuals = coordinate - np.polyval(np.polyfit(scaled, coordinate, 2), scaled)
    middle = float(np.median(residuals))
    # 1.4826 times the median deviation is the standard deviation of a normal
    limit = _CHOSEN.outlier_sd * 1.4826 * float(np.median(np.abs(residuals - middle)))
    clipped = np.clip(residuals, middle - limit, middle + limit) if limit > 0 else residuals
    # the trend again, which outliers had moved
    detrended: FloatArray = clipped - np.polyval(np.polyfit(scaled, clipped, 2), scaled)
    moves = detrended.std() > 1e-9 * (1 + np.abs(coordinate).max())
    return detrended if moves else np.zeros_like(detrended)


def _refine_frequency(time: FloatArray, heights: FloatArray, near: float, step: float) -> float:
    """Return the frequency (Hz), at most `step` from `near`, whose wave and overtone fit the heights (cm) best.

    The periodogram alone is too coarse: over many strides a small error of the frequency adds up.
    """
    from scipy.optimize import minimize_scalar

    def misfit(frequency: float) -> float:
        """Return the sum of the squares of the residuals."""
        waves = _waves(time, frequency, 2)
        residuals = heights - waves @ np.linalg.lstsq(waves, heights, rcond=None)[0]
        return float(residuals @ residuals)

    minimum = minimize_scalar(misfit, bounds=(near - step, near + step), method="bounded")
    return float(minimum.x)


def _waves(time: FloatArray, frequency: float, count: int) -> FloatArray:
    """Return columns for least squares, shape (times, 1 + 2 count): 1, the cosines of `count` harmonics, their sines."""
    angle = 2 * np.pi * frequency * np.outer(time, np.arange(1, count + 1))
    return np.column_stack([np.ones_like(time), np.cos(angle), np.sin(angle)])


def _fit_mean_stride(time: FloatArray, x: FloatArray, frequency: float) -> FloatArray:
    """Fit x (cm) by a line and harmonics of the stride; return the velocity over one stride, (`STRIDE_SAMPLES`,), cm/s.

    `frequency`: of the stride, Hz. The velocity is the derivative of the fit: differences of x would be mostly noise.
    """
    design = np.column_stack([time, _waves(time, frequency, _CHOSEN.harmonics)])
    # coefficients of time, of 1 (not needed), and of the waves
    slope, _, *amplitudes = np.linalg.lstsq(design, x, rcond=None)[0]
    of_cos, of_sin = np.split(np.array(amplitudes), 2)
    order = np.arange(1, _CHOSEN.harmonics + 1)
    phase = 2 * np.pi * np.outer(np.arange(STRIDE_SAMPLES) / STRIDE_SAMPLES, order)
    # derivative of a cos(w t) + b sin(w t): w (b cos(w t) - a sin(w t)), with w as `rates`
    rates = 2 * np.pi * frequency * order
    return np.asarray(slope + (np.cos(phase) * of_sin - np.sin(phase) * of_cos) @ rates)


def _flag_gaps(track: Track, frequency: float) -> list[Remark]:
    """Return a flag if rows are missing; raise TrackError if they are missing over a large part of a stride.

    `frequency`: of the stride, Hz. Over a long gap the fit of the mean stride would not be held by data.
    """
    steps = np.diff(track.time_s)
    gaps = steps[steps > _CHOSEN.gap_steps * np.median(steps)]
    if not gaps.size:
        return []
    longest = float(gaps.max())
    flag = remark("track-gaps", gaps=count(gaps.size, "gap"), seconds=longest)
    if longest * frequency > _CHOSEN.longest_gap_strides:
        description = f"{flag}, {longest * frequency:.2g} of a stride"
        raise TrackError(
            "track-gaps", f"{description}; allowed: up to {_CHOSEN.longest_gap_strides:g} of one"
        )
    return [flag]


# --- Everything that is wrong with a campaign's robot: its own file, its sheet, the tracks in it.


@dataclass(frozen=True)
class RobotCheck:
    """Result of `check_robot`, for the command that checks a campaign.

    `medium`: of the config's section ``robot``; empty without a robot. `trials`: those without an error. `problems`: of
    the robot's file and of its sheet. A missing track is a warning: its trial is dropped.
    """

    medium: str = ""
    trials: tuple[Trial, ...] = ()
    problems: tuple[Problem, ...] = ()

    def summary(self) -> str:
        """Describe the robot in one line."""
        if not self.trials:
            return f"robot on {self.medium}: no trials of its own"
        conditions = count(len({trial.condition for trial in self.trials}), "condition")
        return f"robot on {self.medium}: {count(len(self.trials), 'trial')} of {conditions}"


def check_robot(config_path: Path) -> RobotCheck:
    """Check the robot of a campaign, its file and its sheet, even if other parts of the campaign are not valid.

    `config_path`: the campaign's ``config.yaml``. Errors of the configuration are not reported here. Missing files that
    its section ``robot`` names count among them (`rftfit.campaign.load`).
    """
    root = root_of(config_path)
    config = read_model(config_path, Config).model
    section = config.robot if config is not None else None
    if config is None or section is None:
        return RobotCheck()
    folder = campaign_folder(root, config.raw)
    names, media = _read_runs_and_media(folder, config.run_sheet)
    # a part of a campaign, without runs on the robot's medium, has no robot
    if media and section.medium not in media:
        return RobotCheck()
    problems = _check_robot_file(folder, section)
    trials: list[Trial] = []
    # without a sheet in the config the path is empty, which is no file: there are no trials
    raw = Folder(root / config.raw)
    sheet = raw.look_up(section.runs or "")
    if sheet.status == "file":
        name = f"{config.raw.rstrip('/')}/{sheet.path}"
        tracks = raw, sheet.path.rpartition("/")[0]
        trials, problems_of_trials = read_trials(
            root / config.raw / sheet.path, name, section.medium, names, tracks
        )
        problems = sorted(problems + problems_of_trials, key=lambda problem: problem.place.file)
    return RobotCheck(section.medium, tuple(trials), tuple(problems))


def _read_runs_and_media(folder: Folder, run_sheet: str) -> tuple[set[str], set[str]]:
    """Return the names of runs and of media in the run sheet of the campaign, valid or not; empty without a sheet.

    The campaign's own reader would refuse a sheet with a fault, which must not hide the problems of the robot.
    """
    entry = folder.look_up(run_sheet)
    if entry.status != "file":
        return set(), set()
    columns = TableColumn("run_id", "text"), TableColumn("medium", "text", needed=False)
    rows, _ = read_rows(Path(folder.base, entry.path), Schema("sheet", columns, others="ignored"))
    # of each column its different texts; blank cells are empty texts
    ids, media = ({row.text[column.name] for row in rows} - {""} for column in columns)
    return ids, media


def _check_robot_file(folder: Folder, section: RobotRuns) -> list[Problem]:
    """Return the problems of the robot's file; empty if it is missing, which is reported elsewhere, or none is named."""
    entry = folder.look_up(section.file or "")
    if entry.status == "file":
        try:
            read_robot(Path(folder.base, entry.path), entry.path)
        except CampaignError as error:
            return list(error.problems)
    return []
