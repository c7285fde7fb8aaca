"""The campaign: configuration and run sheet together, and where their files lie."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.campaign.config import PLATE_SHAPES
from rftfit.campaign.problems import CampaignError, Problem
from rftfit.campaign.reading import ConfigFile, Folder, plain_path, read_config
from rftfit.campaign.sheet import Known, read_sheet

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.campaign.sheet import Run


# --- Where the files of a campaign may lie, beyond each path on its own.


RESULTS = "results"


def check_places(file: ConfigFile, root: Folder, raw: str, sheet: str) -> list[Problem]:
    """Find what the program would overwrite, and what leads out of the raw folder.

    `root`: The campaign's. `raw`, `sheet`: Raw folder and run sheet, relative to it; empty where
    they cannot be used.
    """
    problems = []
    results = os.path.realpath(f"{root.base}/{RESULTS}")
    for key, path in (("raw", raw), ("run_sheet", sheet)):
        place = os.path.realpath(f"{root.base}/{path}")
        if path and (_inside(place, results) or (key == "raw" and _inside(results, place))):
            allowed = (
                f"a place apart from {RESULTS}/, which the program writes and anybody may delete"
            )
            if not _inside(path, RESULTS):
                allowed += f"; a link brings the two together: {RESULTS} is {results}"
            problems.append(
                Problem(file.name, file.document.line_of((key,)), key, path, allowed, "config.in-results")
            )  # fmt: skip
    contact = file.config.rigid_contact if file.config is not None else None
    if contact is not None and raw:
        logs = Folder(Path(root.base) / raw)
        for key, written in (("force_log", contact.force_log), ("motion_log", contact.motion_log)):
            path, fault, nearest = plain_path(written)
            status = "missing" if fault else logs.status(path)
            if status == "file":
                continue
            allowed = "a log that exists, as a path inside the raw folder"
            allowed += f"; {fault.partition(': ')[2]}" if fault else ""
            allowed += "; a link leads out of it" if status == "outside" else ""
            nearest = nearest or (logs.nearest(path) if not fault else None)
            line = file.document.line_of(("rigid_contact", key))
            problems.append(
                Problem(file.name, line, f"rigid_contact.{key}", written, allowed, "config.rigid-contact", nearest=nearest)
            )  # fmt: skip
    return problems


def _inside(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip("/\\") + os.sep)


# --- The campaign: configuration and run sheet together, and where their files lie.


_SHAPES = (*PLATE_SHAPES, "leg")


@dataclass(frozen=True)
class Campaign:
    """A checked campaign.

    `root`: The campaign's folder.
    `raw`: The folder of the logs.
    `sheet`: The run sheet.
    `runs`: In the order of the sheet.
    """

    root: Path
    raw: Path
    sheet: Path
    config: Config
    runs: tuple[Run, ...]

    @cached_property
    def by_id(self) -> dict[str, Run]:
        """The runs by their run_id."""
        return {run.run_id: run for run in self.runs}

    def runs_of(self, medium: str) -> tuple[Run, ...]:
        """List the runs that belong to one medium, excluded ones too.

        `medium`: Key of the configuration's ``media``. Returns its plates, rods and legs, and the
        in-air runs that its legs name, sorted by run_id so that the order of the sheet does not
        matter.
        """
        if medium not in self.config.media:
            raise KeyError(medium)
        own = {run.run_id: run for run in self.runs if run.medium == medium}
        named = {run.tare_run for run in own.values() if run.kind == "leg" and run.tare_run}
        own |= {name: self.by_id[name] for name in named}
        return tuple(own[name] for name in sorted(own))

    @cached_property
    def media_with_runs(self) -> tuple[str, ...]:
        """The media that have runs, in the order of the configuration."""
        used = {run.medium for run in self.runs}
        return tuple(medium for medium in self.config.media if medium in used)

    def of_role(self, role: str) -> tuple[str, ...]:
        """Media with runs that play a role: ``laboratory`` or ``natural_sand``."""
        return tuple(name for name in self.media_with_runs if self.config.media[name].role == role)

    def with_legs(self, role: str) -> tuple[str, ...]:
        """Media of a role in which legs were turned."""
        legged = {run.medium for run in self.runs if run.kind == "leg"}
        return tuple(name for name in self.of_role(role) if name in legged)

    @cached_property
    def robot_medium(self) -> str:
        """Medium that the campaign's robot runs on; empty where there is none or no run on it."""
        robot = self.config.robot
        return (
            robot.medium if robot is not None and robot.medium in self.of_role("laboratory") else ""
        )

    @cached_property
    def titles(self) -> dict[str, str]:
        """Titles of the media."""
        return {name: medium.title for name, medium in self.config.media.items()}

    @cached_property
    def unclaimed(self) -> tuple[Run, ...]:
        """The in-air runs that no leg names, so that they belong to no medium, by run_id."""
        named = {run.tare_run for run in self.runs if run.kind == "leg"}
        loose = [run for run in self.runs if not run.medium and run.run_id not in named]
        return tuple(sorted(loose, key=lambda run: run.run_id))


def load_campaign(config_path: Path, medium: str = "") -> Campaign:
    """Read a campaign that must be right.

    `config_path`: ``config.yaml``. `medium`: Only the rows of this medium and those of none are
    read and checked. A job that measures one medium need not look at ten thousand rows of others,
    which were checked when it was planned.
    """
    campaign, problems = check_campaign(config_path, medium)
    if campaign is None:
        raise CampaignError(problems)
    return campaign


def check_campaign(config_path: Path, medium: str = "") -> tuple[Campaign | None, list[Problem]]:
    """Read a campaign and find everything that is wrong with it.

    `config_path`: ``config.yaml``. Its folder is the campaign's, or the folder above if it is
    named ``config``. `medium`: As for `load_campaign`. Returns `campaign`: None when there is any
    error. Returns `problems`: Errors and warnings: of the configuration in the order of its lines,
    then of the run sheet in the order of its rows.
    """
    folder, root = Path(config_path).absolute().parent, root_of(config_path)
    name = _shown_path(Path(config_path), folder, root)
    file, problems = read_config(Path(config_path), name)
    if file.data is None:
        return None, problems
    inside = Folder(root)
    raw = _locate(file, inside, "raw", problems)
    sheet = _locate(file, inside, "run_sheet", problems)
    problems += check_places(file, inside, raw, sheet)
    runs: list[Run] = []
    if sheet:
        logs = Folder(root / raw) if raw else None
        runs, of_sheet = read_sheet(root / sheet, sheet, _known(file), logs, medium)
        problems += of_sheet
    problems += _robot_files(file, inside, raw, runs)
    if file.config is None or any(problem.severity == "error" for problem in problems):
        return None, problems
    return Campaign(root, root / raw, root / sheet, file.config, tuple(runs)), problems


def root_of(config_path: Path) -> Path:
    """Say which folder is the campaign's.

    `config_path`: ``config.yaml``. Returns its folder, or the one above if that is named
    ``config``.
    """
    folder = Path(config_path).absolute().parent
    return (folder.parent if folder.name == "config" else folder).resolve()


def _robot_files(file: ConfigFile, root: Folder, raw: str, runs: list[Run]) -> list[Problem]:
    """Make problems of files that the robot's section names and that are not there."""
    robot = file.config.robot if file.config is not None else None
    # a campaign without runs on its medium (a part of a re-enactment) has no robot either
    if robot is None or not any(run.medium == robot.medium for run in runs):
        return []
    found = []
    places = {
        "file": (robot.file, root, "campaign's"),
        "runs": (robot.runs, Folder(Path(root.base) / raw), "raw"),
    }
    for key, (written, folder, name) in places.items():
        if written is None:
            continue
        path, fault, nearest = plain_path(written)
        status = "missing" if fault else folder.status(path)
        if status != "file":
            allowed = f"a file that exists, relative to the {name} folder"
            found.append(
                Problem(
                    file.name, file.document.line_of(("robot", key)), f"robot.{key}", written,
                    allowed, "config.robot-file", nearest=nearest or folder.nearest(path),
                )
            )  # fmt: skip
    return found


def _shown_path(path: Path, folder: Path, root: Path) -> str:
    if not path.exists():
        # the user needs to know where it was looked for
        return path.as_posix()
    return f"config/{path.name}" if folder.name == "config" and root != folder else path.name


def _locate(file: ConfigFile, root: Folder, key: str, problems: list[Problem]) -> str:
    """Path that one key gives, relative to the campaign's folder; empty if it cannot be used."""
    written = file.data.get(key) if isinstance(file.data, dict) else None
    if not isinstance(written, str):
        return ""

    def refuse(code: str, allowed: str, nearest: str | None = None) -> str:
        line = file.document.line_of((key,))
        problems.append(
            Problem(file.name, line, key, written, allowed, f"config.{code}", nearest=nearest)
        )
        return ""

    what = "a folder" if key == "raw" else "a file"
    path, fault, nearest = plain_path(written)
    if fault or not written.strip():
        code, allowed = fault.split(": ", 1) if fault else ("path", "not blank")
        return refuse(code, f"the path of {what} inside the campaign's folder; {allowed}", nearest)
    status = root.status(path)
    if status == "outside":
        allowed = f"{what} inside the campaign's folder; a link leads out of it"
        return refuse("path-outside", allowed)
    if key == "raw" and path == ".":
        allowed = "a folder below the campaign's own, so that results never lie among the logs"
        return refuse("raw-is-root", allowed)
    if key == "raw" and status != "folder":
        allowed = "a folder that exists, relative to the folder of the campaign"
        return refuse("raw-missing", allowed, root.nearest(path))
    # a sheet that is missing or no file is said by its reader, in the sheet's own name
    return path


def _known(file: ConfigFile) -> Known:
    """Words of the configuration; from the plain data where it has errors, so far as they are clear."""
    if file.config is not None:
        return Known(
            media=tuple(file.config.media),
            shapes={name: item.shape for name, item in file.config.intruders.items()},
            depths_cm=file.config.fit.horizontal_depths_cm,
            missing_tare=file.config.fit.missing_tare,
            clock_method=file.config.clock.method,
        )
    media, intruders = (_section(file.data, key) for key in ("media", "intruders"))
    return Known(
        media=tuple(media) if media else None,
        shapes={name: _shape(item) for name, item in intruders.items()} if intruders else None,
    )


def _section(data: Any, key: str) -> dict[str, Any]:
    section = data.get(key) if isinstance(data, dict) else None
    return section if isinstance(section, dict) else {}


def _shape(item: Any) -> str:
    shape = item.get("shape") if isinstance(item, dict) else None
    return shape if shape in _SHAPES else ""
