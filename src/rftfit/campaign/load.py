"""The campaign: configuration and run sheet together, read and checked, and which media and runs it has.

A campaign has logs and a run sheet, or it *is a table*: a table of stress or alpha stands in place of both (`table` in
the config). Paths in a `Run` are relative to the raw folder, the folder of the logs.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rftfit.campaign.calibration import Calibration, read_calibration
from rftfit.campaign.columns import KINDS, LABELS
from rftfit.campaign.config import PLATE_SHAPES, Config, Leg, RobotRuns
from rftfit.campaign.files import Entry, Folder, campaign_folder, folded, inside
from rftfit.campaign.presence import miss_campaign, root_of
from rftfit.campaign.problems import CampaignError, Place, Problem, shown
from rftfit.campaign.reading import ModelFile, read_model
from rftfit.campaign.schema import KeyPath
from rftfit.campaign.sheet import Run, Vocabulary, read_sheet, same_file_needs_one_clock
from rftfit.campaign.tables import TablePush, TableRead, read_pushes
from rftfit.directions import is_straight_down, number_depths
from rftfit.errors import InputError
from rftfit.store.digests import digest_of_numbers, digests_of_files
from rftfit.store.links import RESULTS
from rftfit.store.text import count, megabytes, table

REENACTED = "REENACTED.txt"
"""File in the raw folder of logs that were computed from published results."""


@dataclass(frozen=True)
class Campaign:
    """A checked campaign; its runs are in the order of the sheet.

    `root`, `raw`, `sheet`: Paths of its folder, of the raw folder and of the run sheet or the table in its place.
    `numbers`: For a campaign that is a table, run_id to its columns, each of shape (n,), as in `TablePush`; else empty.
    `read_from`: SHA-256 of config and run sheet before they were read, by path from `root`; by it a change is noticed.
    """

    root: Path
    raw: Path
    sheet: Path
    config: Config
    runs: tuple[Run, ...]
    numbers: Mapping[str, Mapping[str, npt.NDArray[Any]]] = field(default_factory=dict)
    read_from: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_as_read(self) -> bool:
        """True if config and run sheet have not changed since they were read."""
        return digests_of_files(self.root, self.read_from) == self.read_from

    @cached_property
    def reenacted(self) -> bool:
        """True if the logs were computed from published results, as a marker in the raw folder says."""
        return (self.raw / REENACTED).is_file()

    @cached_property
    def by_id(self) -> dict[str, Run]:
        """The runs by their run_id."""
        return {run.run_id: run for run in self.runs}

    @cached_property
    def calibration(self) -> Calibration | None:
        """Calibration of the force sensor that the configuration names; None if it names none. Reads its file once."""
        calibration_file = self.config.force_log.calibration
        return None if calibration_file is None else read_calibration(self.raw / calibration_file)

    @cached_property
    def digests(self) -> dict[str, str]:
        """For a campaign that is a table, run_id to a digest of its rows, by which changes are noticed; else empty."""
        return {name: digest_of_numbers(columns) for name, columns in self.numbers.items()}

    def summary(self) -> str:
        """Return, as text, a heading and a table of the runs and logs of each medium, with the in-air runs last."""
        rows = []
        size_of_log: dict[str, int | None] = {}
        for medium in (*self.media_with_runs, ""):
            runs = [run for run in self.runs if run.medium == medium]
            if not runs:
                continue
            # a dictionary, as one file may hold force and motion of a run
            sizes = {
                log: self.size_of(log) for run in runs for log in (run.force_log, run.motion_log)
            }
            size_of_log |= sizes
            existing = [size for size in sizes.values() if size is not None]
            counts = [sum(run.kind == kind for run in runs) for kind in KINDS]
            counts += [sum(run.excluded for run in runs), len(existing), len(sizes) - len(existing)]
            rows.append([medium or "(in air)", *map(str, counts), f"{sum(existing) / 1e6:.1f}"])
        header = ["medium", *KINDS, "excluded", "logs", "missing", "MB"]
        total = sum(filter(None, size_of_log.values()))
        runs_and_logs = f"{count(len(self.runs), 'run')}, {count(len(size_of_log), 'log')}"
        return f"{self.config.title}: {runs_and_logs}, {megabytes(total)}\n{table(header, rows)}"

    def count_level_depths(self, medium: str) -> int:
        """Count the depths at which a plate is to be pushed horizontally in a medium.

        Alpha of a horizontal direction is a slope over these depths, so it is complete only with all of them. The
        config states them, or else the horizontal runs of the sheet have them, at least two.
        """
        fit = self.config.fit
        # only horizontal runs have a depth
        depths_cm = np.array(
            [run.depth_cm for run in self.runs if run.medium == medium and run.kind == "plate"]
        )
        depths_cm = depths_cm[np.isfinite(depths_cm)]
        if "horizontal_depths_cm" in fit.model_fields_set or not depths_cm.size:
            return len(fit.horizontal_depths_cm)
        # one depth cannot show that stress is proportional to depth
        return max(2, 1 + int(number_depths(depths_cm).max()))

    def runs_of(self, medium: str) -> tuple[Run, ...]:
        """Return all runs of a medium, also excluded ones, and the in-air runs that its legs name as tare.

        Sorted by run_id, so that the order of the sheet does not matter. Raises KeyError for an unknown medium.
        """
        if medium not in self.config.media:
            raise KeyError(medium)
        runs = {run.run_id: run for run in self.runs if run.medium == medium}
        tares_of_legs = {run.tare_run for run in runs.values() if run.kind == "leg"} - {""}
        runs |= {name: self.by_id[name] for name in tares_of_legs}
        return tuple(runs[name] for name in sorted(runs))

    def size_of(self, log: str) -> int | None:
        """Return the bytes of a log; None where the file does not exist."""
        try:
            return (self.raw / log).stat().st_size
        except OSError:
            return None

    def holds_tare(self, run: Run) -> bool:
        """Return whether the forces of a run still include the force on rod and mount, or on a leg in air.

        So it is where the run names no tare to be subtracted, unless there is no rod: in a table, or by the config.
        """
        rodless = bool(self.numbers) or self.config.fit.missing_tare == "none"
        return not run.tare_run and not rodless

    @cached_property
    def media_with_runs(self) -> tuple[str, ...]:
        """The media that have runs, in the order of the configuration."""
        used = {run.medium for run in self.runs}
        return tuple(medium for medium in self.config.media if medium in used)

    def plates_to_measure(self, medium: str) -> list[Run]:
        """Return the plate runs, without excluded ones, of a medium without any log yet; empty once there is one."""
        runs = [run for run in self.runs if run.medium == medium and run.kind == "plate"]
        planned = [run for run in runs if not run.excluded]
        logs = {log for run in planned for log in (run.force_log, run.motion_log)}
        return [] if any(self.size_of(log) is not None for log in logs) else planned

    def of_role(self, role: str = "") -> tuple[str, ...]:
        """Return the media with runs that have a role, ``laboratory`` or ``natural_sand``; default: any role."""
        media = self.config.media
        return tuple(name for name in self.media_with_runs if role in ("", media[name].role))

    def media_with_logs(self, role: str = "") -> tuple[str, ...]:
        """Return the media of a role, as in `of_role`, whose runs have logs; empty for a campaign that is a table."""
        return () if self.numbers else self.of_role(role)

    def media_with_samples(self, role: str = "") -> tuple[str, ...]:
        """Return the media of a role, as in `of_role`, with stress by depth; none in a table of alpha."""
        table = self.config.table
        return () if table is not None and table.holds == "alpha" else self.of_role(role)

    def with_legs(self, role: str) -> tuple[str, ...]:
        """Return the media of a role, as in `of_role`, in which legs were turned."""
        media_of_legs = {run.medium for run in self.runs if run.kind == "leg"}
        return tuple(name for name in self.of_role(role) if name in media_of_legs)

    @cached_property
    def robot_medium(self) -> str:
        """Medium on which the robot of the campaign runs; empty without a robot, or where the medium has no runs."""
        medium = self.config.robot.medium if self.config.robot else ""
        return medium if medium in self.of_role("laboratory") else ""

    @cached_property
    def titles(self) -> dict[str, str]:
        """Key of each medium, to its title in tables and figures."""
        return {name: medium.title for name, medium in self.config.media.items()}

    @cached_property
    def unassigned_air_runs(self) -> tuple[Run, ...]:
        """In-air runs that no leg names as tare, so that they belong to no medium; sorted by run_id."""
        tares_of_legs = {run.tare_run for run in self.runs if run.kind == "leg"}
        unassigned = (
            run for run in self.runs if not run.medium and run.run_id not in tares_of_legs
        )
        return tuple(sorted(unassigned, key=lambda run: run.run_id))


def load_campaign(config_path: Path) -> Campaign:
    """Read a campaign; raises CampaignError, with all problems, if it has any error."""
    campaign, problems = check_campaign(config_path)
    if campaign is None:
        raise CampaignError(problems)
    return campaign


def check_campaign(
    config_path: Path, table: TableRead | None = None, *, good_rows: bool = False
) -> tuple[Campaign | None, list[Problem]]:
    """Read a campaign and find everything that is wrong with it.

    `table`: Content of the table of the campaign, if it was read before; None: it is read here, if the config names
    one.
    `good_rows`: Leave out rows with errors, and runs that name them as tare, instead of refusing the campaign, as while
    the sheet is being filled in. Returns the campaign, or None where an error is left, and all problems: of the
    configuration in the order of its lines, then of the run sheet in the order of its rows.
    """
    if (no_campaign := miss_campaign(config_path)) is not None:
        return None, [no_campaign]
    path, root = config_path.absolute(), root_of(config_path)
    in_config = path.parent.name == "config" and root != path.parent
    file = read_model(path, Config, f"config/{path.name}" if in_config else path.name)
    # of the files as they are before they are read
    digests = digests_of_files(root, [os.path.relpath(path, root)])
    if file.data is None:
        return None, file.problems
    config, raw_as_written = file.model, file.written("raw")
    within = campaign_folder(root, raw_as_written if isinstance(raw_as_written, str) else "")
    # paths from the folder of the campaign, empty where they cannot be used; what can be checked without them still is
    raw = _locate(file, within, "raw")
    sheet = _locate(file, within, "run_sheet")
    logs = Folder(root / raw) if raw else None
    digests |= digests_of_files(root, [sheet] if sheet and not table else [])
    if config is not None and logs is not None:
        _check_rigid_contact(file, config, logs)
        _check_calibration(file, config.force_log.calibration, logs)
    runs: list[Run] = []
    sheet_problems: list[Problem] = []
    pushes: list[TablePush] = []
    if sheet and config is not None and config.table is not None:
        pushes, sheet_problems, *_ = table or _read_table(config, root, raw, sheet)
        runs = [push.run for push in pushes]
    elif sheet and not file.written("table"):
        # the sheet is checked even where the config has errors, by the words that can be read in it
        runs, sheet_problems = read_sheet(root / sheet, sheet, _vocabulary(file), logs)
    if config is not None:
        if logs is not None:
            _check_robot(file, config.robot, within, logs, runs)
        _warn_of_near_walls(file, config, runs)
        sheet_problems += _warn_of_missing_profile(config, sheet, runs)
        sheet_problems += _warn_of_alike_labels(sheet, runs)
    if good_rows:
        runs, tare_problems = _drop_untared(sheet, runs)
        sheet_problems += tare_problems
    problems = sorted(file.problems, key=lambda problem: problem.place.line or 0)
    problems += sheet_problems
    # with `good_rows` the rows with errors are left out already, so that only the config decides
    decisive = file.problems if good_rows else problems
    if config is None or any(problem.severity == "error" for problem in decisive):
        return None, problems
    numbers = {push.run.run_id: push.columns for push in pushes}
    campaign = Campaign(root, root / raw, root / sheet, config, tuple(runs), numbers, digests)
    return campaign, problems


def _drop_untared(sheet: str, runs: list[Run]) -> tuple[list[Run], list[Problem]]:
    """Return the runs whose tare is one of the runs, or that name none, and a problem for each other run.

    `sheet`: Its name for the user. The row of a missing tare had an error, so that it is not among the runs.
    """
    names = {run.run_id for run in runs} | {""}
    allowed = "a run whose own row has no error"
    lost = [
        Problem("sheet.tare-row", Place(sheet, run.row, "tare_run"), run.tare_run, allowed)
        for run in runs
        if run.tare_run not in names
    ]
    return [run for run in runs if run.tare_run in names], lost


def _warn_of_alike_labels(sheet: str, runs: list[Run]) -> list[Problem]:
    """Return a warning for each label, as of a rod, that differs from another in capitals, spaces or marks alone.

    Runs with one label may share an error, so that two spellings of one label would hide it.
    """
    problems: dict[tuple[str, str], Problem] = {}
    for column in LABELS:
        # letters and digits of a label, to the first label with these and its row
        first_labels: dict[str, tuple[str, int]] = {}
        for run in runs:
            label = str(getattr(run, column))
            letters = "".join(filter(str.isalnum, label.casefold()))
            first_label, row = first_labels.setdefault(letters, (label, run.row))
            if letters and first_label != label and (column, label) not in problems:
                place = Place(sheet, run.row, column)
                allowed = f"'{shown(first_label)}' as in row {row}, if the same is meant: labels that differ in any letter are two"
                alike = Problem("sheet.label-alike", place, label, allowed, severity="warning")
                problems[column, label] = alike
    return [*problems.values()]


def _warn_of_near_walls(file: ModelFile[Config], config: Config, runs: list[Run]) -> None:
    """Add a warning for each setting by which readings count with the plate nearer to a wall than its own length."""
    pushed = {
        run.intruder
        for run in runs
        if run.kind == "plate" and config.media[run.medium].role == "laboratory"
    }
    intruders = [config.intruders[name] for name in pushed]
    plates = [intruder for intruder in intruders if not isinstance(intruder, Leg)]
    if config.table is not None or not plates:
        return
    length_cm = max(plate.length_cm for plate in plates)
    box, fit = config.container, config.fit
    # key of a setting, to the distance between plate and walls or bottom that it allows
    distances_cm: dict[KeyPath, float] = {}
    if not box.is_open:
        distances_cm["fit", "wall_clearance_cm"] = fit.wall_clearance_cm
    if fit.max_depth_cm is not None:
        distances_cm["fit", "max_depth_cm"] = box.depth_cm - fit.max_depth_cm
    widths_cm = [getattr(plate, "width_cm", plate.length_cm) for plate in plates]
    distances_cm["container", "width_cm"] = (box.width_cm - max(widths_cm)) / 2
    for key, distance_cm in distances_cm.items():
        if distance_cm < length_cm:
            allowed = (
                f"at least the plate's length, {length_cm:g} cm, between plate and walls or bottom: nearer, they carry force, "
                "and alpha is too high by an amount that no check sees; push one direction in a larger bed and compare"
            )
            place, distance = file.place(key), f"{distance_cm:g} cm"
            file.problems.append(
                Problem("config.near-walls", place, distance, allowed, severity="warning")
            )


def _warn_of_missing_profile(config: Config, sheet: str, runs: list[Run]) -> list[Problem]:
    """Return a warning for each medium whose runs give no profile: only legs, or only level plates straight down.

    A profile is alpha in all directions, and needs pushes in several.
    """
    problems = []
    for name, medium in config.media.items():
        pushes = [run for run in runs if run.medium == name and run.kind == "plate"]
        all_straight_down = all(
            is_straight_down(run.beta_deg, run.gamma_deg, config.grid.angle_tolerance_deg)
            for run in pushes
        )
        if not pushes and any(run.medium == name and run.kind == "leg" for run in runs):
            code, runs_found = "no-plate", "only legs"
            allowed = (
                "a plate run of each medium; without one there is no alpha, and nothing to compare "
                "the forces on its legs with"
            )
        elif pushes and all_straight_down and medium.role == "laboratory":
            code, runs_found = "only-straight-down", "nothing but level plates pushed straight down"
            allowed = (
                "role natural_sand, in which one push scales the generic profile; a profile of its own "
                "needs other directions too"
            )
        else:
            continue
        place = Place(f"{sheet}, medium {name}")
        problems.append(Problem(f"sheet.{code}", place, runs_found, allowed, severity="warning"))
    return problems


def _read_table(
    config: Config, root: Path, raw: str, sheet: str
) -> tuple[list[TablePush], list[Problem]]:
    """Read the table that replaces run sheet and logs; return its runs and problems.

    `raw`, `sheet`: Paths of the raw folder and the table from `root`.
    """
    assert config.table is not None
    if not inside(sheet, raw):
        allowed = (
            f"a table inside the raw folder, {raw}: it is the record that all results come from"
        )
        return [], [Problem("table.not-in-raw", Place(sheet), None, allowed)]
    path_in_raw = sheet[len(raw) + 1 :]
    tolerance = config.grid.angle_tolerance_deg
    return read_pushes(root / sheet, sheet, config.table, config.media, path_in_raw, tolerance)[:2]


def read_layout(config_path: Path) -> Campaign:
    """Read a campaign without its runs, as before its first run: raw folder and run sheet need not exist yet.

    Raises CampaignError if the config has any error.
    """
    root = root_of(config_path)
    file = read_model(config_path, Config, config_path.as_posix())
    within = Folder(root)
    raw, sheet = (_locate(file, within, key, exists=False) for key in ("raw", "run_sheet"))
    if file.model is None or file.problems:
        raise CampaignError(file.problems)
    logs, runs = Path(within.base, raw).resolve(), Path(within.base, sheet).resolve()
    return Campaign(root, logs, runs, file.model, ())


def _locate(file: ModelFile[Config], root: Folder, key: str, *, exists: bool = True) -> str:
    """Return the path in a key of the config, relative to the folder of the campaign; empty if it cannot be used.

    `key`: ``raw`` or ``run_sheet``. `exists`: Whether the raw folder has to exist. Adds the problem of the path to
    `file`.
    """
    written = file.written(key)
    if not isinstance(written, str):
        return ""
    entry = root.look_up(written)
    code, allowed = _path_fault(root, key, entry, exists=exists)
    if code:
        file.note((key,), code, written, allowed, entry.nearest)
    # what lies in the folder of results can be read, and then has all its problems in one report
    return "" if code and code != "in-results" else entry.path


def _path_fault(root: Folder, key: str, entry: Entry, *, exists: bool) -> tuple[str, str]:
    """Return code and allowed words of the problem with the path of raw folder or run sheet; both empty without one.

    `key`, `exists`: As in `_locate`. `entry`: What lies at the path in `root`.
    """
    if entry.code:
        what = "a folder" if key == "raw" else "a file"
        return entry.code, f"the path of {what} inside the campaign's folder; {entry.why}"
    if key == "raw" and entry.path == ".":
        why = "so that results never lie among the logs"
        return "raw-is-root", f"a folder below the campaign's own, {why}"
    # for a sheet that is missing or no file, its reader makes the problem
    if key == "raw" and exists and entry.status != "folder":
        return "raw-missing", "a folder that exists, relative to the folder of the campaign"
    real, results = (os.path.realpath(f"{root.base}/{path}") for path in (entry.path, RESULTS))
    # neither may lie in the folder of results, nor this folder among the logs
    if not inside(real, results) and not (key == "raw" and inside(results, real)):
        return "", ""
    # there the program would overwrite the sheet, or write among the logs
    allowed = f"a place outside of {RESULTS}/, which the program writes and anybody may delete"
    if not inside(entry.path, RESULTS):
        allowed += f"; a link brings the two together: {RESULTS} is {results}"
    return "in-results", allowed


def _check_rigid_contact(file: ModelFile[Config], config: Config, logs: Folder) -> None:
    """Check that the two logs of the push against something rigid can be used, as the sheet does for those of a run.

    `logs`: The raw folder. Problems are added to `file`.
    """
    contact, clock_method = config.rigid_contact, config.clock.method
    if contact is None:
        return
    force_log, motion_log = (
        _need_file(file, ("rigid_contact", key), written, logs, "raw", "rigid-contact")
        for key, written in (("force_log", contact.force_log), ("motion_log", contact.motion_log))
    )
    key = ("rigid_contact", "motion_log")
    if force_log and force_log == motion_log:
        if clock_method != "same_clock":
            allowed = same_file_needs_one_clock(clock_method)
            file.note(key, "one-file", contact.motion_log, allowed)
    elif force_log and folded(force_log) == folded(motion_log):
        allowed = f"a file of its own; force_log names it as {force_log}: some disks treat both names as one"
        file.note(key, "shared-file", contact.motion_log, allowed)


def _check_calibration(file: ModelFile[Config], calibration_file: str | None, logs: Folder) -> None:
    """Check that the calibration file exists in the raw folder `logs` and can be read; problems are added to `file`."""
    if calibration_file is None:
        return
    key = ("force_log", "calibration")
    if path := _need_file(file, key, calibration_file, logs, "raw", "calibration-file"):
        try:
            read_calibration(Path(logs.base) / path)
        except InputError as error:
            allowed = f"a table without faults; there: {error}"
            file.note(key, "calibration", calibration_file, allowed)


def _check_robot(
    file: ModelFile[Config], robot: RobotRuns | None, root: Folder, logs: Folder, runs: list[Run]
) -> None:
    """Check that the files that the section `robot` names exist in the campaign's folder or the raw folder `logs`."""
    # without runs in its medium, as in a part of a re-enactment, the robot is not used
    if robot is None or not any(run.medium == robot.medium for run in runs):
        return
    if robot.file is not None:
        _need_file(file, ("robot", "file"), robot.file, root, "campaign's", "robot-file")
    if robot.runs is not None:
        _need_file(file, ("robot", "runs"), robot.runs, logs, "raw", "robot-file")


def _need_file(
    file: ModelFile[Config], key: KeyPath, written: str, folder: Folder, name: str, code: str
) -> str:
    """Return the path of a file that must exist; empty, and a problem at the key, where it cannot be used.

    `written`: Path as the key has it, from `folder`. `name`: Name of that folder in messages. `code`: Code of the
    problem, without ``config.``.
    """
    entry = folder.look_up(written)
    if entry.status == "file":
        return entry.path
    why = f"; {entry.why}" if entry.why else ""
    allowed = f"a file that exists, as a path inside the {name} folder{why}"
    file.note(key, code, written, allowed, entry.nearest)
    return ""


def _vocabulary(file: ModelFile[Config]) -> Vocabulary:
    """Return the words of the configuration that the sheet may use: its media, and its intruders with their shapes.

    They are taken from its plain data, as it may have errors elsewhere.
    """
    media, intruders = (
        section if isinstance(section := file.written(key), dict) else {}
        for key in ("media", "intruders")
    )
    shapes = {name: _shape(intruder) for name, intruder in intruders.items()}
    return Vocabulary(tuple(media) or None, shapes or None, file.model)


def _shape(intruder: Any) -> str:
    """Return the shape of an intruder in the plain data; empty where it is not valid."""
    shape = intruder.get("shape", "") if isinstance(intruder, dict) else ""
    return shape if shape in (*PLATE_SHAPES, "leg") else ""
