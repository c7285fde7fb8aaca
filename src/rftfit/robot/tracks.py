"""The robot's run sheet and marker tracks: stride frequency and mean speed of each trial."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import root_of
from rftfit.campaign.problems import CampaignError, Problem, did_you_mean
from rftfit.campaign.reading import Folder, decode, plain_path, read_bytes, read_config
from rftfit.campaign.rows import read_table
from rftfit.errors import InputError
from rftfit.robot.config import read_robot

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable
    from pathlib import Path

    from rftfit.campaign.config import RobotRuns
    from rftfit.campaign.rows import Table
    from rftfit.conventions import FloatArray


# --- The robot's run sheet: which marker track is a trial of which condition.


COLUMNS = {
    "run_id": "unique name of the trial",
    "condition": "name shared by the trials of one condition",
    "medium": "the medium that the config's robot runs on",
    "curvature_times_R": "R'/r of the legs, -1 (reversed c-leg) to 1 (c-leg)",
    "frequency_Hz": "stride frequency; blank: taken from the track",
    "track": "file of the marker track, relative to the folder of this sheet",
    "note": "free text",
}
"""Columns of the sheet, with their meanings."""

_NEEDED = ("run_id", "condition", "medium", "curvature_times_R", "track")
_HIGHEST_HZ = 100.0


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial of the robot.

    `curvature_times_R`: R'/r of its legs.
    `frequency_Hz`: Stride frequency; NaN where it is to be taken from the track.
    `track`: Path relative to the folder of the sheet, with ``/``.
    `row`: As a spreadsheet numbers it.
    """

    run_id: str
    condition: str
    medium: str
    curvature_times_R: float
    frequency_Hz: float
    track: str
    note: str
    row: int


def read_trials(
    path: Path, file: str, medium: str, taken: Collection[str] = ()
) -> tuple[list[Trial], list[Problem]]:
    """Read and check a robot run sheet.

    `path`: csv, tsv or xlsx. `file`: Its name, for problems. `medium`: The one that the robot runs
    on. `taken`: Names of the runs of the campaign's own run sheet, which a trial may not have too.
    Returns `trials`: The rows without an error, in the order of the sheet. Returns `problems`: All
    of them, in the order of the rows.
    """
    table, problems = read_table(path, file)
    if table is None:
        return [], problems
    problems += _header(table, file)
    if any(problem.severity == "error" for problem in problems):
        return [], problems
    places = {name: at for at, name in enumerate(table.header) if name in COLUMNS}
    rows = [
        (row, {name: cells[at] if at < len(cells) else "" for name, at in places.items()})
        for row, cells in table.rows
    ]
    if not rows:
        allowed = "no trials yet: the sheet needs one row for each track below its header"
        problems.append(Problem(file, None, None, None, allowed, "robot-sheet.empty"))
    found: list[Trial] = []
    seen: dict[tuple[str, str], int] = {}
    conditions: dict[str, Trial] = {}
    for row, cells in rows:
        check = _Row(file, row, cells)
        trial = check.trial(medium, taken, seen, conditions)
        problems += check.problems
        if trial is not None:
            found.append(trial)
    return found, problems


def _header(table: Table, file: str) -> list[Problem]:
    row, problems = table.header_row, []
    missing = [name for name in COLUMNS if name not in table.header]
    for at, name in enumerate(table.header):
        if name in table.header[:at] and name:
            allowed = "each column once"
            problems.append(Problem(file, row, name, name, allowed, "robot-sheet.duplicate-column"))
        elif name and name not in COLUMNS:
            allowed, near = f"one of {', '.join(COLUMNS)}", did_you_mean(name, missing)
            problems.append(
                Problem(file, row, name, name, allowed, "robot-sheet.unknown-column", nearest=near)
            )
    for name in missing:
        if name in _NEEDED:
            allowed = f"this column is missing; it is needed: {COLUMNS[name]}"
            problems.append(Problem(file, row, name, None, allowed, "robot-sheet.missing-column"))
    return problems


class _Row:
    """Checks the cells of one row."""

    def __init__(self, file: str, row: int, cells: dict[str, str]) -> None:
        self.file, self.row, self.cells = file, row, cells
        self.problems: list[Problem] = []

    def error(self, column: str, allowed: str, code: str, nearest: str | None = None) -> None:
        found = self.cells.get(column) or None
        allowed = allowed if found else f"this cell is blank; it is needed: {allowed}"
        code = code if found else "blank"
        self.problems.append(
            Problem(self.file, self.row, column, found, allowed, f"robot-sheet.{code}",
                    nearest=nearest)
        )  # fmt: skip

    def number(self, column: str, low: float, high: float, allowed: str) -> float:
        text = self.cells.get(column, "")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if "_" in text or not low <= value <= high:
            self.error(column, allowed, "number")
            return math.nan
        return value

    def trial(
        self,
        medium: str,
        taken: Collection[str],
        seen: dict[tuple[str, str], int],
        conditions: dict[str, Trial],
    ) -> Trial | None:
        text = self.cells.get
        for name in ("run_id", "condition"):
            if not text(name):
                self.error(name, COLUMNS[name], "blank")
        if text("medium") != medium:
            self.error("medium", f"{medium}, the config's robot.medium", "medium", medium)
        curvature = self.number("curvature_times_R", -1, 1, "-1 to 1")
        frequency = math.nan
        if text("frequency_Hz"):
            lowest = math.ulp(0.0)
            allowed = f"above 0, up to {_HIGHEST_HZ:g} Hz, or blank: taken from the track"
            frequency = self.number("frequency_Hz", lowest, _HIGHEST_HZ, allowed)
        track, fault, nearest = plain_path(text("track") or "")
        if fault or not text("track"):
            wanted = "the path of a file in the folder of this sheet or below, with /"
            self.error("track", wanted, "path", nearest)
        self.once("run_id", text("run_id") or "", seen)
        self.once("track", track, seen)
        if text("run_id") in taken:
            self.error("run_id", "a name that no run of the campaign's run sheet has", "taken")
        if self.problems:
            return None
        found = Trial(
            text("run_id") or "", text("condition") or "", medium, curvature, frequency, track,
            text("note") or "", self.row,
        )  # fmt: skip
        first = conditions.setdefault(found.condition, found)
        if first.curvature_times_R != curvature:
            self.error(
                "curvature_times_R",
                f"{first.curvature_times_R:g}, as in row {first.row} of the same condition "
                f"{found.condition}",
                "condition",
            )
            return None
        return found

    def once(self, column: str, word: str, seen: dict[tuple[str, str], int]) -> None:
        # names become part of file names and ledgers: case alone must not tell them apart
        first = seen.setdefault((column, word.casefold()), self.row)
        if word and first != self.row:
            what = "a name" if column == "run_id" else "a track"
            self.error(column, f"{what} of its own; row {first} has this one", "repeated")


# --- Marker tracks of the robot: read with every row accounted for, or refused with a reason.


SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}

_MAX_BYTES = 50_000_000
_HEADER = re.compile(
    r"^(?P<what>time|t|x|z)(?:_(?P<unit>[a-z]+)|\s*[\[(]\s*(?P<in>[a-z]+)\s*[\])])$"
)
_ALLOWED = (
    "a header row with a time, x and z, each with its unit, such as time_s,x_cm,z_cm "
    f"(time: {', '.join(SECONDS)}; x, z: {', '.join(CENTIMETRES)})"
)


class TrackError(InputError):
    """A track that cannot be used.

    `reason`: Why, without the file's name.
    `rows`: Data lines of the file, so far as they could be counted.
    """

    def __init__(self, reason: str, file: str = "", rows: int = 0) -> None:
        self.reason, self.rows = reason, rows
        super().__init__(f"{file}: {reason}" if file else reason)


@dataclass(frozen=True)
class Track:
    """A marker track.

    `time_s`, `x_cm`, `z_cm`: shape (n,); The usable rows; time counts from the first of them and
        only grows.
    `rows`: Data lines of the file.
    `dropped`: Reason to number of rows left out; with the usable ones they add up to `rows`.
    """

    time_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)


def read_track(path: Path) -> Track:
    """Read a marker track.

    Comma-, semicolon- or tab-separated text, UTF-8; lines that start with ``#`` are comments. A row
    with a cell that is blank or no number is left out and counted.
    """
    file = path.name
    data = read_bytes(path, file, "track", _MAX_BYTES)
    text = data if isinstance(data, Problem) else decode(data, file, "track")
    if isinstance(text, Problem):
        raise TrackError(text.allowed if text.found is None else f"found {text.found}", file)
    lines = [
        (row, line)
        for row, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise TrackError("the file has no rows; export the track again", file)
    delimiter = max(",;\t", key=lines[0][1].count)
    places, scales = _columns(_cells(lines[0][1], delimiter), file, lines[0][0], len(lines) - 1)
    good: list[list[float]] = []
    numbers: list[int] = []
    dropped: Counter[str] = Counter()
    for row, line in lines[1:]:
        cells = _cells(line, delimiter)
        values = [_number(cells[at]) if at < len(cells) else math.nan for at in places]
        missing = [name for name, value in zip("txz", values, strict=True) if math.isnan(value)]
        if missing:
            what = "time" if missing[0] == "t" else missing[0]
            dropped[f"no number for {what}"] += 1
        else:
            good.append(values)
            numbers.append(row)
    rows = len(lines) - 1
    if not good:
        raise TrackError(f"none of the {rows} rows has a time, x and z", file, rows)
    table = np.array(good) * scales
    back = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if back.size:
        first = int(back[0])
        how = "stands still" if table[first + 1, 0] == table[first, 0] else "runs backwards"
        more = f", and {back.size - 1} times more" if back.size > 1 else ""
        raise TrackError(
            f"time {how} in row {numbers[first + 1]}: {good[first + 1][0]:g} after "
            f"{good[first][0]:g}{more}; allowed: time that grows from row to row",
            file,
            rows,
        )
    time = table[:, 0] - table[0, 0]
    return Track(time, table[:, 1], table[:, 2], rows, dict(dropped))


def _columns(names: list[str], file: str, row: int, rows: int) -> tuple[list[int], FloatArray]:
    """Places of time, x and z, and what their units are in s and cm."""
    places: dict[str, tuple[int, float]] = {}
    for at, name in enumerate(names):
        found = _HEADER.match(name.strip().lower())
        if not found:
            continue
        what = "t" if found["what"] in ("t", "time") else found["what"]
        units = SECONDS if what == "t" else CENTIMETRES
        unit = found["unit"] or found["in"]
        if unit not in units:
            raise TrackError(
                f"row {row}, column {name}: no such unit; allowed: {_ALLOWED}", file, rows
            )
        if what in places:
            raise TrackError(f"row {row}: two columns for {what}; allowed: {_ALLOWED}", file, rows)
        places[what] = at, units[unit]
    lacking = [{"t": "time"}.get(name, name) for name in "txz" if name not in places]
    if lacking:
        found_names = ", ".join(names)[:80]
        raise TrackError(
            f"row {row}: no column for {' and '.join(lacking)} in '{found_names}'; allowed: {_ALLOWED}",
            file,
            rows,
        )
    ordered = [places[name] for name in "txz"]
    return [at for at, _ in ordered], np.array([scale for _, scale in ordered])


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=delimiter), [])]


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) and "_" not in text else math.nan


# --- Stride frequency and mean speed of a trial, from its marker track.


FEWEST_STRIDES = 3
LONGEST_GAP_STRIDES = 0.25
HARMONICS = 4
TRIPODS = 2
"""Legs in two alternating groups: the body bobs twice a stride."""

_FEWEST_ROWS = 30
_FINER = 8
_GAP_STEPS = 3.0
_OUTLIER_SD = 5.0
_LEAST_SHARE = 0.2
_UNEVEN_SHARE = 0.25
_DRIFT_SHARE = 0.15


@dataclass(frozen=True)
class Pace:
    """What a track says.

    `speed_cm_per_s`: Mean forward speed.
    `stride_sd_cm_per_s`: Standard deviation of the mean speeds of the single strides.
    `frequency_Hz`: Stride frequency.
    `strides`: Length of the track in strides.
    `flags`: Doubts.
    """

    speed_cm_per_s: float
    stride_sd_cm_per_s: float
    frequency_Hz: float
    frequency_from: str
    strides: float
    flags: tuple[str, ...] = ()


def pace(track: Track, frequency_Hz: float = math.nan, tripods: int = TRIPODS) -> Pace:
    """Mean speed of a trial, over strides.

    The speed is the slope of x against time, fitted together with four harmonics of the stride, so
    that it does not matter at which moments of a stride the track begins and ends.

    `frequency_Hz`: Stride frequency; NaN where it is to be found in the track. `tripods`: Groups
    of legs that take turns: how often the body bobs in a stride.
    """
    if len(track.time_s) < _FEWEST_ROWS:
        raise TrackError(
            f"{len(track.time_s)} usable rows; a track has at least {_FEWEST_ROWS}", rows=track.rows
        )
    flags = []
    source = "sheet"
    if math.isnan(frequency_Hz):
        frequency_Hz, doubt = stride_frequency(track, tripods)
        source, flags = "track", [doubt] if doubt else []
    time, x = track.time_s, track.x_cm
    strides = float(time[-1] * frequency_Hz)
    if strides < FEWEST_STRIDES - 1e-6:
        raise TrackError(
            f"{strides:.3g} strides of {frequency_Hz:.3g} Hz in {time[-1]:.3g} s; at least "
            f"{FEWEST_STRIDES} are needed for a mean speed",
            rows=track.rows,
        )
    flags += _gaps(track, frequency_Hz)
    speed = _slope(time, x, frequency_Hz)
    whole = int(strides + 1e-6)
    # the last strides: a run-up comes first
    ends = time[-1] - np.arange(whole, -1, -1) / frequency_Hz
    each = np.diff(np.interp(ends, time, x)) * frequency_Hz
    half = whole // 2
    first, last = float(each[:half].mean()), float(each[-half:].mean())
    if abs(last - first) > _DRIFT_SHARE * max(abs(speed), 1.0):
        flags.append(f"speed changes along the track from {first:.3g} to {last:.3g} cm/s")
    return Pace(speed, float(each.std(ddof=1)), float(frequency_Hz), source, strides, tuple(flags))


def stride_frequency(track: Track, tripods: int = TRIPODS) -> tuple[float, str]:
    """Find the stride frequency in the bobbing of the body.

    The highest peak of the periodogram of height (brought to even steps, which bridges small gaps;
    freed of its slow trend and of outliers); of x, likewise, where height shows no clear peak. It is
    refined by least squares with one overtone.

    `tripods`: How often the body bobs in a stride. Returns `doubt`: Empty, or why the frequency
    may be wrong by a factor.
    """
    time = track.time_s
    duration, step = time[-1], float(np.median(np.diff(time)))
    even = np.arange(0, duration + step / 2, step)
    size = _FINER * even.size
    grid = np.fft.rfftfreq(size, step)
    # at least two bobs in all; at most what the frame rate can show
    seen = (grid >= 2 / duration) & (grid <= 0.45 / step)
    grid = grid[seen]
    for name, values in (("z", track.z_cm), ("x", track.x_cm)):
        if grid.size < 3:
            break
        steady = _detrended(time, values)
        if not steady.any():
            continue
        smooth = np.interp(even, time, steady)
        # share of the variance that a sine of this frequency explains
        power = np.abs(np.fft.rfft(smooth, size))[seen] ** 2
        share = 2 * power / (even.size * (smooth @ smooth))
        top = int(np.argmax(share))
        if share[top] < _LEAST_SHARE:
            continue
        bob = _refine(time, steady, float(grid[top]), 1 / (10 * duration))
        twice = int(np.argmin(np.abs(grid - 2 * bob)))
        doubt = ""
        if tripods > 1 and grid[-1] > 2 * bob and share[twice] > _UNEVEN_SHARE * share[top]:
            doubt = (
                f"{name} moves at {bob:.3g} and {2 * bob:.3g} Hz: if its two halves of a stride "
                f"differ much, the stride frequency is {bob:.3g} and not {bob / tripods:.3g} Hz; "
                "frequency_Hz of the sheet decides"
            )
        return bob / tripods, doubt
    raise TrackError(
        "no stride frequency shows in z or x; give frequency_Hz in the sheet", rows=track.rows
    )


def _detrended(time: FloatArray, values: FloatArray) -> FloatArray:
    """Take off a slow trend, and bring outliers to the edge of the rest."""
    scaled = time / time[-1]
    rest = values - np.polyval(np.polyfit(scaled, values, 2), scaled)
    middle = float(np.median(rest))
    limit = _OUTLIER_SD * 1.4826 * float(np.median(np.abs(rest - middle)))
    clipped: FloatArray = np.clip(rest, middle - limit, middle + limit) if limit > 0 else rest
    again: FloatArray = clipped - np.polyval(np.polyfit(scaled, clipped, 2), scaled)
    # a marker that does not move leaves rounding only
    return again if again.std() > 1e-9 * (1 + np.abs(values).max()) else np.zeros_like(again)


def _refine(time: FloatArray, values: FloatArray, near: float, step: float) -> float:
    from scipy.optimize import minimize_scalar

    def misfit(frequency: float) -> float:
        waves = _waves(time, frequency, 2)
        rest = values - waves @ np.linalg.lstsq(waves, values, rcond=None)[0]
        return float(rest @ rest)

    found = minimize_scalar(misfit, bounds=(near - step, near + step), method="bounded")
    return float(found.x)


def _waves(time: FloatArray, frequency: float, count: int) -> FloatArray:
    angle = 2 * np.pi * frequency * np.outer(time, np.arange(1, count + 1))
    return np.column_stack([np.ones_like(time), np.cos(angle), np.sin(angle)])


def _slope(time: FloatArray, x: FloatArray, frequency: float) -> float:
    parts = np.column_stack([time, _waves(time, frequency, HARMONICS)])
    return float(np.linalg.lstsq(parts, x, rcond=None)[0][0])


def _gaps(track: Track, frequency: float) -> list[str]:
    steps = np.diff(track.time_s)
    gaps = steps[steps > _GAP_STEPS * np.median(steps)]
    if not gaps.size:
        return []
    longest = float(gaps.max())
    text = f"{gaps.size} gap{'s' if gaps.size > 1 else ''}, the longest {longest:.3g} s"
    if longest * frequency > LONGEST_GAP_STRIDES:
        raise TrackError(
            f"{text}, {longest * frequency:.2g} of a stride; allowed: up to "
            f"{LONGEST_GAP_STRIDES:g} of one",
            rows=track.rows,
        )
    return [text]


# --- Everything that is wrong with a campaign's robot: its own file, its sheet, the tracks in it.


@dataclass(frozen=True)
class Checked:
    """What was found.

    `medium`: The one that the robot runs on; empty where the campaign has no robot.
    `trials`: Rows of its sheet without an error.
    `problems`: Errors, and a warning for each track that is not there: such a trial is dropped.
    """

    medium: str = ""
    trials: tuple[Trial, ...] = ()
    problems: tuple[Problem, ...] = ()


def check_robot(config: Path) -> Checked:
    """Check the robot of a campaign, whatever else is wrong with the campaign.

    `config`: ``config.yaml``. Errors of its own are not repeated; files that its section ``robot``
    names and that are not there are errors of the configuration too (`rftfit.campaign.load`).
    """
    root = root_of(config)
    file, _ = read_config(config, config.name)
    section = file.config.robot if file.config is not None else None
    if file.config is None or section is None:
        return Checked()
    runs, media = _of_campaign(root, file.config.run_sheet)
    # a campaign without runs on its medium (a part of a re-enactment) has no robot either
    if media and section.medium not in media:
        return Checked()
    problems = _own_file(root, section)
    if section.runs is None:
        return Checked(section.medium, (), tuple(problems))
    raw, (sheet, fault, _) = root / file.config.raw, plain_path(section.runs)
    if fault or Folder(raw).status(sheet) != "file":
        return Checked(section.medium, (), tuple(problems))
    name = f"{file.config.raw.rstrip('/')}/{sheet}"
    trials, found = read_trials(raw / sheet, name, section.medium, runs)
    problems += found
    problems += _tracks(trials, raw, sheet, name)
    ordered = sorted(problems, key=lambda one: (one.file, one.row or 0))
    return Checked(section.medium, tuple(trials), tuple(ordered))


def _of_campaign(root: Path, run_sheet: str) -> tuple[set[str], set[str]]:
    """Names of runs and media in the campaign's own sheet, right or wrong."""
    path, fault, _ = plain_path(run_sheet)
    if fault or Folder(root).status(path) != "file":
        return set(), set()
    table, _ = read_table(root / path, path)
    if table is None:
        return set(), set()
    at = {name: place for place, name in enumerate(table.header)}
    cells = {
        name: {row[at[name]] for _, row in table.rows if at[name] < len(row)} if name in at else set()
        for name in ("run_id", "medium")
    }  # fmt: skip
    return cells["run_id"] - {""}, cells["medium"] - {""}


def _own_file(root: Path, section: RobotRuns) -> list[Problem]:
    path, fault, _ = plain_path(section.file or "")
    if section.file is None or fault or Folder(root).status(path) != "file":
        return []
    try:
        read_robot(root / path, path)
    except CampaignError as error:
        return list(error.problems)
    return []


def _tracks(trials: Iterable[Trial], raw: Path, sheet: str, name: str) -> list[Problem]:
    inside = Folder(raw)
    above = sheet.rpartition("/")[0]
    found = []
    for trial in trials:
        path = f"{above}/{trial.track}" if above else trial.track
        status = inside.status(path)
        if status == "file":
            continue
        outside = status == "outside"
        allowed = (
            "a file inside the raw folder; a link leads out of it"
            if outside
            else "a file that exists; the trial is dropped while its track is missing"
        )
        found.append(
            Problem(
                name, trial.row, "track", trial.track, allowed,
                "robot-sheet.track-outside" if outside else "robot-sheet.track-missing",
                "error" if outside else "warning",
                nearest=None if outside else _beside(inside.nearest(path), above),
            )
        )  # fmt: skip
    return found


def _beside(path: str | None, above: str) -> str | None:
    """Write a path as the sheet would, from the sheet's own folder."""
    return path.removeprefix(f"{above}/") if path and above else path
