"""The campaign: configuration and run sheet together, and the paths of their files."""

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
from rftfit.campaign.config import PLATE_SHAPES, Config, Leg, RigidContact, RobotRuns
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

_SHAPES = (*PLATE_SHAPES, "leg")


@dataclass(frozen=True)
class Campaign:
    """A checked campaign; its runs are in the order of the sheet.

    `raw`, `sheet`: Paths of the raw folder and the run sheet. `numbers`: For a campaign that is a table, run_id to
    its columns, each of shape (n,), as in `TablePush`; else empty. `read_from`: SHA-256 of config and run sheet before
    they were read, by path from `root`.
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
        """Whether config and run sheet have not changed since they were read."""
        return digests_of_files(self.root, self.read_from) == self.read_from

    @cached_property
    def reenacted(self) -> bool:
        """Whether the logs are re-enacted: the marker in the raw folder says so."""
        return (self.raw / REENACTED).is_file()

    @cached_property
    def by_id(self) -> dict[str, Run]:
        """The runs by their run_id."""
        return {run.run_id: run for run in self.runs}

    @cached_property
    def calibration(self) -> Calibration | None:
        """The calibration that the configuration names, if it names one."""
        calibration_file = self.config.force_log.calibration
        return None if calibration_file is None else read_calibration(self.raw / calibration_file)

    @cached_property
    def digests(self) -> dict[str, str]:
        """For a campaign that is a table, run_id to the digest of the rows of the run; else empty."""
        return {name: digest_of_numbers(columns) for name, columns in self.numbers.items()}

    def summary(self) -> str:
        """Describe the campaign: a heading, and a table of the runs and logs of each medium."""
        rows = []
        sizes: dict[str, int | None] = {}
        for medium in (*self.media_with_runs, ""):
            runs = [run for run in self.runs if run.medium == medium]
            if not runs:
                continue
            # a set, as one file may hold force and motion of a run
            names = {name for run in runs for name in (run.force_log, run.motion_log)}
            size_of_log = {name: self.size_of(name) for name in names}
            sizes_known = [size for size in size_of_log.values() if size is not None]
            sizes |= size_of_log
            counts = [sum(run.kind == kind for run in runs) for kind in KINDS]
            counts += [
                sum(run.excluded for run in runs),
                len(sizes_known),
                len(size_of_log) - len(sizes_known),
            ]
            rows.append([medium or "(in air)", *map(str, counts), f"{sum(sizes_known) / 1e6:.1f}"])
        header = ["medium", *KINDS, "excluded", "logs", "missing", "MB"]
        total = sum(filter(None, sizes.values()))
        runs_and_logs = f"{count(len(self.runs), 'run')}, {count(len(sizes), 'log')}"
        return f"{self.config.title}: {runs_and_logs}, {megabytes(total)}\n{table(header, rows)}"

    def count_level_depths(self, medium: str) -> int:
        """Count the depths at which a plate is to be pushed horizontally in a medium.

        The config states them, or else the horizontal runs of the sheet have them, at least two.
        """
        fit = self.config.fit
        planned_cm = [
            run.depth_cm
            for run in self.runs
            if run.medium == medium and run.kind == "plate" and run.direction == "horizontal"
        ]
        known_cm = np.array([depth for depth in planned_cm if np.isfinite(depth)], dtype=float)
        if "horizontal_depths_cm" in fit.model_fields_set or not known_cm.size:
            return len(fit.horizontal_depths_cm)
        # one depth cannot show that stress is proportional to depth
        return max(2, len(set(number_depths(known_cm).tolist())))

    def runs_of(self, medium: str) -> tuple[Run, ...]:
        """Return all runs of a medium, also excluded ones, and the in-air runs that its legs name as tare.

        Sorted by run_id, so that the order of the sheet does not matter.
        """
        if medium not in self.config.media:
            raise KeyError(medium)
        runs_of_medium = {run.run_id: run for run in self.runs if run.medium == medium}
        air_runs = {
            run.tare_run for run in runs_of_medium.values() if run.kind == "leg" and run.tare_run
        }
        runs_of_medium |= {name: self.by_id[name] for name in air_runs}
        return tuple(runs_of_medium[name] for name in sorted(runs_of_medium))

    def size_of(self, log: str) -> int | None:
        """Return the bytes of a log; None where the file does not exist."""
        try:
            return (self.raw / log).stat().st_size
        except OSError:
            return None

    def holds_tare(self, run: Run) -> bool:
        """Return whether the forces of a run still include the force on rod and mount, or on a leg in air."""
        rodless = bool(self.numbers) or self.config.fit.missing_tare == "none"
        return not run.tare_run and not rodless

    @cached_property
    def media_with_runs(self) -> tuple[str, ...]:
        """The media that have runs, in the order of the configuration."""
        used = {run.medium for run in self.runs}
        return tuple(medium for medium in self.config.media if medium in used)

    def plates_to_measure(self, medium: str) -> list[Run]:
        """Return the plate runs of a medium before its first log exists; empty once there is a log."""
        runs = [run for run in self.runs if run.medium == medium and run.kind == "plate"]
        planned = [run for run in runs if not run.excluded]
        logs = {name for run in planned for name in (run.force_log, run.motion_log)}
        return [] if any(self.size_of(name) is not None for name in logs) else planned

    def of_role(self, role: str = "") -> tuple[str, ...]:
        """Return the media with runs that have a role, ``laboratory`` or ``natural_sand``; default: any role."""
        media = self.config.media
        return tuple(name for name in self.media_with_runs if role in ("", media[name].role))

    def media_with_logs(self, role: str = "") -> tuple[str, ...]:
        """Return the media of a role whose runs have logs; empty for a campaign that is a table."""
        return () if self.numbers else self.of_role(role)

    def media_with_samples(self, role: str = "") -> tuple[str, ...]:
        """Return the media of a role with stress against depth; empty for a campaign that is a table of alpha."""
        table = self.config.table
        return () if table is not None and table.holds == "alpha" else self.of_role(role)

    def with_legs(self, role: str) -> tuple[str, ...]:
        """Return the media of a role in which legs were turned."""
        legged = {run.medium for run in self.runs if run.kind == "leg"}
        return tuple(name for name in self.of_role(role) if name in legged)

    @cached_property
    def robot_medium(self) -> str:
        """Medium on which the robot of the campaign runs; empty without a robot, or where the medium has no runs."""
        medium = self.config.robot.medium if self.config.robot else ""
        return medium if medium in self.of_role("laboratory") else ""

    @cached_property
    def titles(self) -> dict[str, str]:
        """Titles of the media."""
        return {name: medium.title for name, medium in self.config.media.items()}

    @cached_property
    def unassigned_air_runs(self) -> tuple[Run, ...]:
        """In-air runs that no leg names as tare, so that they belong to no medium; sorted by run_id."""
        air_runs_of_legs = {run.tare_run for run in self.runs if run.kind == "leg"}
        loose = [run for run in self.runs if not run.medium and run.run_id not in air_runs_of_legs]
        return tuple(sorted(loose, key=lambda run: run.run_id))


def load_campaign(config_path: Path) -> Campaign:
    """Read a campaign; raises CampaignError if it has any error."""
    campaign, problems = check_campaign(config_path)
    if campaign is None:
        raise CampaignError(problems)
    return campaign


def check_campaign(
    config_path: Path, table: TableRead | None = None, *, good_rows: bool = False
) -> tuple[Campaign | None, list[Problem]]:
    """Read a campaign and find everything that is wrong with it.

    `table`: Content of the table of the campaign, if it was read before. `good_rows`: Leave out rows with errors, and
    runs that name them as tare, instead of refusing the campaign. Returns the campaign, or None where an error is left,
    and all problems: of the configuration in the order of its lines, then of the run sheet in the order of its rows.
    """
    if (no_campaign := miss_campaign(config_path)) is not None:
        return None, [no_campaign]
    folder, root = Path(config_path).absolute().parent, root_of(config_path)
    in_config = folder.name == "config" and root != folder
    name = f"config/{Path(config_path).name}" if in_config else Path(config_path).name
    digests = digests_of_files(root, [os.path.relpath(Path(config_path).absolute(), root)])
    file = read_model(Path(config_path), Config, name)
    if file.data is None:
        return None, file.problems
    written = file.data.get("raw") if isinstance(file.data, dict) else ""
    within = campaign_folder(root, written if isinstance(written, str) else "")
    raw = _locate(file, within, "raw")
    sheet = _locate(file, within, "run_sheet")
    logs = Folder(root / raw) if raw else None
    digests |= digests_of_files(root, [sheet] if sheet and not table else [])
    if file.model is not None and logs is not None:
        _check_rigid_contact(file, file.model.rigid_contact, file.model.clock.method, logs)
        _check_calibration(file, file.model.force_log.calibration, logs)
    runs: list[Run] = []
    sheet_problems: list[Problem] = []
    pushes: list[TablePush] = []
    if sheet and file.model is not None and file.model.table is not None:
        pushes, sheet_problems, *_ = table or _read_table(file.model, root, raw, sheet)
        runs = [push.run for push in pushes]
    elif sheet and not (isinstance(file.data, dict) and file.data.get("table")):
        runs, sheet_problems = read_sheet(root / sheet, sheet, _vocabulary(file), logs)
    if file.model is not None:
        if logs is not None:
            _check_robot(file, file.model.robot, within, logs, runs)
        _warn_of_near_walls(file, file.model, runs)
        sheet_problems += _warn_of_missing_profile(file.model, sheet, runs)
        sheet_problems += _warn_of_alike_labels(sheet, runs)
    if good_rows:
        runs, tare_problems = _drop_untared(sheet, runs)
        sheet_problems += tare_problems
    problems = sorted(file.problems, key=lambda problem: problem.place.line or 0)
    problems += sheet_problems
    decisive = file.problems if good_rows else problems
    if file.model is None or any(problem.severity == "error" for problem in decisive):
        return None, problems
    numbers = {push.run.run_id: push.columns for push in pushes}
    return Campaign(
        root, root / raw, root / sheet, file.model, tuple(runs), numbers, digests
    ), problems


def _drop_untared(sheet: str, runs: list[Run]) -> tuple[list[Run], list[Problem]]:
    """Return the runs whose tare is one of the runs, or that name none, and a problem for each other run."""
    names = {run.run_id for run in runs} | {""}
    allowed = "a run whose own row has no error"
    lost = [
        Problem("sheet.tare-row", Place(sheet, run.row, "tare_run"), run.tare_run, allowed)
        for run in runs
        if run.tare_run not in names
    ]
    return [run for run in runs if run.tare_run in names], lost


def _warn_of_alike_labels(sheet: str, runs: list[Run]) -> list[Problem]:
    """Return a warning for each label that differs from another one in capitals, spaces or marks alone."""
    problems: dict[tuple[str, str], Problem] = {}
    for column in LABELS:
        first_rows: dict[str, tuple[str, int]] = {}
        for run in runs:
            label = str(getattr(run, column))
            plain = "".join(filter(str.isalnum, label.casefold()))
            like, row = first_rows.setdefault(plain, (label, run.row))
            if plain and like != label and (column, label) not in problems:
                place = Place(sheet, run.row, column)
                allowed = f"'{shown(like)}' as in row {row}, if the same is meant: labels that differ in any letter are two"
                alike = Problem("sheet.label-alike", place, label, allowed, severity="warning")
                problems[column, label] = alike
    return [*problems.values()]


def _warn_of_near_walls(file: ModelFile[Config], config: Config, runs: list[Run]) -> None:
    """Warn of each setting by which readings count where the plate was nearer to a wall than its own length."""
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
    kept_cm: dict[KeyPath, float] = {}
    if not box.is_open:
        kept_cm["fit", "wall_clearance_cm"] = fit.wall_clearance_cm
    if fit.max_depth_cm is not None:
        kept_cm["fit", "max_depth_cm"] = box.depth_cm - fit.max_depth_cm
    widths_cm = [getattr(plate, "width_cm", plate.length_cm) for plate in plates]
    kept_cm["container", "width_cm"] = (box.width_cm - max(widths_cm)) / 2
    for key, distance_cm in kept_cm.items():
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
    """Return a warning for each medium whose runs give no profile: only legs, or only level plates straight down."""
    problems = []
    for name, medium in config.media.items():
        pushes = [run for run in runs if run.medium == name and run.kind == "plate"]
        place = Place(f"{sheet}, medium {name}")
        if not pushes and any(run.medium == name and run.kind == "leg" for run in runs):
            text = (
                "a plate run of each medium; without one there is no alpha, and nothing to compare "
                "the forces on its legs with"
            )
            problems.append(Problem("sheet.no-plate", place, "only legs", text, severity="warning"))
        level = all(
            is_straight_down(run.beta_deg, run.gamma_deg, config.grid.angle_tolerance_deg)
            for run in pushes
        )
        if pushes and level and medium.role == "laboratory":
            text = (
                "role natural_sand, in which one push scales the generic profile; a profile of its own "
                "needs other directions too"
            )
            only = "nothing but level plates pushed straight down"
            problems.append(
                Problem("sheet.only-straight-down", place, only, text, severity="warning")
            )
    return problems


def _read_table(
    config: Config, root: Path, raw: str, sheet: str
) -> tuple[list[TablePush], list[Problem]]:
    """Read the table that replaces run sheet and logs; return its runs and problems."""
    assert config.table is not None
    if not inside(sheet, raw):
        allowed = (
            f"a table inside the raw folder, {raw}: it is the record that all results come from"
        )
        return [], [Problem("table.not-in-raw", Place(sheet), None, allowed)]
    within = sheet[len(raw) + 1 :]
    tolerance = config.grid.angle_tolerance_deg
    return read_pushes(root / sheet, sheet, config.table, config.media, within, tolerance)[:2]


def read_layout(config_path: Path) -> Campaign:
    """Read a campaign without its runs: raw folder and run sheet need not exist yet."""
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

    `key`: ``raw`` or ``run_sheet``. `exists`: Whether the path has to exist.
    """
    written = file.data.get(key) if isinstance(file.data, dict) else None
    if not isinstance(written, str):
        return ""
    entry = root.look_up(written)
    code, allowed = _path_fault(root, key, entry, exists=exists)
    if code:
        file.note((key,), code, written, allowed, entry.nearest)
    return "" if code and code != "in-results" else entry.path


def _path_fault(root: Folder, key: str, entry: Entry, *, exists: bool) -> tuple[str, str]:
    """Return code and text of the problem with the path of raw folder or run sheet; empty texts without one."""
    if entry.code:
        what = "a folder" if key == "raw" else "a file"
        return entry.code, f"the path of {what} inside the campaign's folder; {entry.why}"
    if key == "raw" and entry.path == ".":
        why = "so that results never lie among the logs"
        return "raw-is-root", f"a folder below the campaign's own, {why}"
    # for a sheet that is missing or no file, its reader makes the problem
    if key == "raw" and exists and entry.status != "folder":
        return "raw-missing", "a folder that exists, relative to the folder of the campaign"
    place, results = (os.path.realpath(f"{root.base}/{path}") for path in (entry.path, RESULTS))
    if not inside(place, results) and not (key == "raw" and inside(results, place)):
        return "", ""
    # there the program would overwrite the sheet, or write among the logs
    text = f"a place outside of {RESULTS}/, which the program writes and anybody may delete"
    if not inside(entry.path, RESULTS):
        text += f"; a link brings the two together: {RESULTS} is {results}"
    return "in-results", text


def _check_rigid_contact(
    file: ModelFile[Config], contact: RigidContact | None, clock: str, logs: Folder
) -> None:
    """Check that the two logs of the push against something rigid can be used, as the sheet does for those of a run."""
    if contact is None:
        return
    paths = [
        _need_file(
            file, ("rigid_contact", key), getattr(contact, key), logs, "raw", "rigid-contact"
        )
        for key in ("force_log", "motion_log")
    ]
    section = ("rigid_contact", "motion_log")
    if paths[0] and paths[0] == paths[1]:
        if clock != "same_clock":
            file.note(section, "one-file", contact.motion_log, same_file_needs_one_clock(clock))
    elif paths[0] and folded(paths[0]) == folded(paths[1]):
        allowed = f"a file of its own; force_log names it as {paths[0]}: some disks "
        file.note(section, "shared-file", contact.motion_log, f"{allowed}treat both names as one")


def _check_calibration(file: ModelFile[Config], calibration_file: str | None, logs: Folder) -> None:
    """Check that the calibration file exists and can be read."""
    if calibration_file is None:
        return
    section = ("force_log", "calibration")
    if path := _need_file(file, section, calibration_file, logs, "raw", "calibration-file"):
        try:
            read_calibration(Path(logs.base) / path)
        except InputError as error:
            file.note(
                section, "calibration", calibration_file, f"a table without faults; there: {error}"
            )


def _check_robot(
    file: ModelFile[Config], robot: RobotRuns | None, root: Folder, logs: Folder, runs: list[Run]
) -> None:
    """Check that the files that the section `robot` names exist."""
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
    """Return the path of a file that must exist; empty, and a problem at the key, where it cannot be used."""
    entry = folder.look_up(written)
    if entry.status == "file":
        return entry.path
    why = f"; {entry.why}" if entry.why else ""
    allowed = f"a file that exists, as a path inside the {name} folder{why}"
    file.note(key, code, written, allowed, entry.nearest)
    return ""


def _vocabulary(file: ModelFile[Config]) -> Vocabulary:
    """Return the words of the configuration that the sheet may use; where it has errors, from its plain data."""
    config = file.model
    if config is not None:
        shapes = {name: item.shape for name, item in config.intruders.items()}
        return Vocabulary(tuple(config.media), shapes, config)
    media, intruders = (_section(file.data, key) for key in ("media", "intruders"))
    shapes_found: dict[str, str] = {name: _shape(item) for name, item in intruders.items()}
    return Vocabulary(tuple(media) or None, shapes_found or None)


def _section(data: Any, key: str) -> dict[str, Any]:
    """Return a section of the plain data; empty where it is none."""
    section = data.get(key) if isinstance(data, dict) else None
    return section if isinstance(section, dict) else {}


def _shape(item: Any) -> str:
    """Return the shape of an intruder in the plain data; empty where it is unknown."""
    shape = item.get("shape") if isinstance(item, dict) else None
    return shape if shape in _SHAPES else ""
