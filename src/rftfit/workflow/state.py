"""The state of each job: digests of what its results depend on besides its input files: code, settings, rows, logs.

Snakemake sees a state as one small file a job, ``results/state/RULE/NAME.json``, which is an input of the
job and is written anew only when the state changes.
"""

from __future__ import annotations

import json
import math
import os
import pickle
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import cache, cached_property
from pathlib import Path
from typing import IO, Any

from rftfit.campaign.files import BAG
from rftfit.campaign.load import REENACTED, Campaign, check_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.campaign.sheet import Run
from rftfit.figures.registry import DeclaredFigure, figures
from rftfit.figures.style import PAPER
from rftfit.logs.registry import DialectOrigin, origins
from rftfit.measure.long_logs import MemoryNeed, memory_need
from rftfit.robot import PROFILES
from rftfit.store import write_bytes
from rftfit.store.digests import code_digest, digest_of, digests_of_files, plugin_digest, seal
from rftfit.store.links import RESULTS, cut_shared_files, refuse_links
from rftfit.workflow.stages import (
    ALL,
    ALL_LOGS,
    FOLDER_BY_RULE,
    LAST,
    MEDIUM_LOGS,
    PRINT_RULES,
    STAGES,
    Stage,
)

STATES = f"{RESULTS}/state"
HANDED = "RFTFIT_CAMPAIGN"
"""Environment variable: path of the file with the campaign that `rftfit run` has read, a space, the seal of its bytes."""

LEAST_MB = 1000
"""Memory that a cluster gives at least to a stage of a medium; `rftfit run` says where one needs more."""

_FIELDS_LEFT_OUT = ("row", "note", "lacks_force_x", "rows_without_data")
"""Fields of a run that its state leaves out: the number of its row, its note, and two that the digest of a table covers."""


def job_name(rule: str, key: str) -> str:
    """Name a job by its rule and, where the rule has a wildcard, the value of it: the stem of the files it writes."""
    return f"{rule}/{key}" if key else rule


def state_file(name: str) -> str:
    """Return the path of the file of a job's state, from the campaign's folder; `name`: as `job_name` makes it."""
    return f"{STATES}/{name}.json"


def job_of(path: str) -> tuple[str, str]:
    """Return rule and key of a job by the path of the file of its state."""
    rule, _, key = path.removeprefix(f"{STATES}/").removesuffix(".json").partition("/")
    return rule, key


class FileDigests:
    """SHA-256 of files below a folder, each read once."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._digests: dict[str, str] = {}

    def digests_of(self, paths: Sequence[str]) -> dict[str, str]:
        """Compute SHA-256 of files by their paths from the folder; empty for a file that is not there."""
        unread = [path for path in paths if path not in self._digests]
        self._digests |= digests_of_files(self.root, unread)
        return {path: self._digests[path] for path in paths}


class States:
    """States of the jobs of one campaign, as they are now; each log is read once.

    A state is a dict from ``code``, ``settings``, ``rows``, ``order``, ``logs``, ``robot files`` to a digest, as far as
    the results of the job depend on them; `state_of` returns it by rule and key, the value of the rule's wildcard.
    `warnings`: Number of warnings on the campaign.
    """

    def __init__(self, campaign: Campaign, warnings: int = 0) -> None:
        self.campaign = campaign
        self.warnings = warnings
        self.state_of: Callable[[str, str], dict[str, str]] = cache(self._make_state)
        self._sheet_digest = cache(lambda medium: digest_of(medium, sheet_cells(campaign, medium)))
        self._logs = FileDigests(campaign.raw)

    @cached_property
    def config(self) -> dict[str, Any]:
        """Settings of the campaign by section of the config."""
        return self.campaign.config.model_dump(mode="json")

    @cached_property
    def figures(self) -> dict[str, tuple[DeclaredFigure, str]]:
        """Figures with their medium, empty where they have none, by their path below ``results/`` without ending."""
        return {
            figure.file(medium): (figure, medium)
            for figure in figures()
            for medium in figure.media(self.campaign)
        }

    def stage(self, rule: str, key: str) -> tuple[Stage, str]:
        """Return the stage of a job, and the argument of its function besides `Results`: a medium, a table of runs, or none."""
        if rule in FOLDER_BY_RULE:
            figure, medium = self.figures[f"{FOLDER_BY_RULE[rule]}/{key}"]
            logs = MEDIUM_LOGS if figure.logs else ""
            on_demand = figure.on_demand or rule in PRINT_RULES
            stage = Stage(figure.run, "figures", figure.settings, logs=logs, on_demand=on_demand)
            return stage, medium
        return STAGES[rule], key

    def has_job(self, rule: str, key: str) -> bool:
        """Tell whether the campaign has a job of this rule and key."""
        if rule in FOLDER_BY_RULE:
            return f"{FOLDER_BY_RULE[rule]}/{key}" in self.figures
        if not self.has_rule(rule):
            return False
        keys = {
            "medium": self.campaign.media_with_runs,
            "runs": [f"runs_{name}" for name in PROFILES],
            "": [""],
        }
        return key in keys[STAGES[rule].wildcard]

    def has_rule(self, rule: str) -> bool:
        """Tell whether a rule exists that is no figure's, and the campaign has what it works on: a robot, clocks to estimate."""
        stage = STAGES.get(rule)
        if not stage or (stage.robot and rule != LAST and not self.campaign.robot_medium):
            return False
        return not stage.estimated or self.campaign.config.clock.method == "estimate"

    @cached_property
    def paper_files(self) -> list[str]:
        """Paths of the files for a paper of all figures of a whole run, from the campaign's folder."""
        return [
            f"{RESULTS}/{path}.{ending}"
            for path, (figure, _) in self.figures.items()
            if not figure.on_demand
            for ending in PAPER
        ]

    def on_demand(self, name: str) -> bool:
        """Tell whether a job, by its name, belongs to ``rftfit sweep`` or ``rftfit run --print`` alone."""
        rule, _, key = name.partition("/")
        return self.stage(rule, key)[0].on_demand

    def medium_of(self, rule: str, key: str) -> str:
        """Return the medium that a job works on; empty where it works on none or on all."""
        argument = self.stage(rule, key)[1]
        return argument if argument in self.campaign.config.media else ""

    def _make_state(self, rule: str, key: str) -> dict[str, str]:
        """Make the state of a job: a digest of each thing that its stage depends on."""
        stage, medium = self.stage(rule, key)[0], self.medium_of(rule, key)
        state = {"code": self.code_digest_of(stage)}
        if stage.settings:
            sections = self.config if ALL in stage.settings else stage.settings
            state["settings"] = digest_of({name: self.config[name] for name in sections})
        if stage.rows:
            state["rows"] = self._sheet_digest(medium)
        if stage.order:
            state["order"] = digest_of(plate_run_order(self.campaign, medium))
        if stage.logs:
            logs = self.all_log_digests if stage.logs == ALL_LOGS else self.log_digests(medium)
            state["logs"] = digest_of(sorted(logs.items()))
        if stage.robot and self.campaign.robot_medium:
            state["robot files"] = digest_of(sorted(self.robot_digests.items()))
        return state

    def write_state(self, rule: str, wildcards: Mapping[str, str]) -> str:
        """Write the state of a job where its file holds another one; return the path of the file, an input of the job."""
        key = next(iter(dict(wildcards).values()), "")
        data = (json.dumps(self.state_of(rule, key), indent=1, sort_keys=True) + "\n").encode()
        name = state_file(job_name(rule, key))
        path = self.campaign.root / name
        # bytes: a damaged file may be no text
        if not path.is_file() or path.read_bytes() != data:
            write_bytes(path, data)
        return name

    def code_digest_of(self, stage: Stage) -> str:
        """Compute the digest of the code that a stage uses; dialects of other packages count where it reads logs."""
        module = stage.run.partition(":")[0].removeprefix("rftfit.").replace(".", "/")
        code = code_digest(stage.room, f"{module}.py")
        if not stage.logs or not self.dialects:
            return code
        dialects = [
            f"{dialect.package} {dialect.version} {plugin_digest(dialect.module)}"
            for dialect in self.dialects
        ]
        return digest_of(code, dialects)

    @cached_property
    def dialects(self) -> list[DialectOrigin]:
        """Dialects of other packages by which the logs are read."""
        config = self.campaign.config
        dialect_names = {config.dialect, config.force_log.dialect, config.motion_log.dialect}
        return [*origins(filter(None, dialect_names)).values()]

    def log_digests(self, medium: str) -> dict[str, str]:
        """Compute SHA-256 of the logs of a medium by name, empty for a file that is not there; `medium`: as in `log_names`."""
        return self._logs.digests_of(log_names(self.campaign, medium))

    def memory(self, medium: str) -> MemoryNeed:
        """Estimate the memory of a stage that reads the logs of a medium, or the samples of these logs."""
        return memory_need(self.campaign.raw, log_names(self.campaign, medium))

    @cached_property
    def all_log_digests(self) -> dict[str, str]:
        """SHA-256 of every log that the campaign names."""
        media = (*self.campaign.media_with_runs, "")
        return {
            name: digest for medium in media for name, digest in self.log_digests(medium).items()
        }

    @cached_property
    def robot_digests(self) -> dict[str, str]:
        """SHA-256 of the robot's file, sheet and tracks, by path from the campaign's folder."""
        return digests_of_files(self.campaign.root, robot_files(self.campaign))


def read_states(config: Path) -> States:
    """Return the states of a campaign: of the one that the parent process has read, else of the config, which is checked."""
    if states := take_over(config):
        return states
    campaign, problems = check_campaign(config)
    if campaign is None:
        raise CampaignError(problems)
    return States(campaign, len(problems))


def hand_over(states: States, file: IO[bytes]) -> str:
    """Write a campaign for child processes; return their value of `HANDED`, which holds while the file is open."""
    data = pickle.dumps((states.campaign, states.warnings), protocol=5)
    with suppress(OSError):  # on a full disk the children read the campaign themselves
        file.write(data)
    return f"/proc/{os.getpid()}/fd/{file.fileno()} {seal(data)}"


def guard_written(campaign: Campaign) -> None:
    """Prevent that a run writes into files of another folder: refuse links, replace files with a second name by copies."""
    root = campaign.root
    refuse_links(root)
    files = [path for path in root.iterdir() if path.is_file()]
    folders = {(root / name).parent for name in campaign.read_from} - {root}
    cut_shared_files(root, [campaign.raw, campaign.sheet, *files, *folders])


def take_over(config: Path | None = None) -> States | None:
    """Return the states of the campaign that `hand_over` has written in a parent process; None where it does not fit.

    It fits where it is of this config (default: any), and config, run sheet and code are still the same.
    """
    file, _, seal_of_file = os.environ.get(HANDED, "").rpartition(" ")
    with suppress(OSError):
        if Path(file).is_file() and seal(data := Path(file).read_bytes()) == seal_of_file:
            # the seal proves that these bytes are from this process's parent: they are safe to unpickle
            campaign, warnings = pickle.loads(data)  # noqa: S301
            config_path = Path(campaign.root, next(iter(campaign.read_from)))
            if campaign.is_as_read and (config is None or config_path.samefile(config)):
                return States(campaign, warnings)
    return None


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """List the logs from which a medium is measured, relative to the raw folder; some may not exist.

    `medium`: Empty for the runs that belong to no medium.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unassigned_air_runs
    names = {name for run in runs for name in (run.force_log, run.motion_log, run.zero_log)} - {""}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    if names and campaign.config.force_log.calibration is not None:
        names.add(campaign.config.force_log.calibration)
    # a recording of ROS is named by its metadata file: all files of its folder belong to it
    bag_folders = [name.removesuffix(BAG) for name in names if name.endswith(f"/{BAG}")]
    names.update(
        bag + path.name for bag in bag_folders for path in (campaign.raw / bag).glob("*.*")
    )
    return sorted(names)


def robot_files(campaign: Campaign) -> list[str]:
    """List the robot's file, its sheet, its tracks and the mark of re-enacted ones, as far as they exist."""
    robot = campaign.config.robot
    if robot is None or not campaign.robot_medium:
        return []
    paths = [campaign.root / robot.file] if robot.file else []
    if robot.runs is not None:
        from rftfit.workflow.robot import trials_of

        sheet = campaign.raw / robot.runs
        tracks = [sheet.parent / trial.track for trial in trials_of(campaign)]
        paths += [campaign.raw / REENACTED, sheet, *tracks]
    names = (os.path.relpath(path, campaign.root) for path in paths if path.is_file())
    return sorted({name.replace(os.sep, "/") for name in names})


def sheet_cells(campaign: Campaign, medium: str) -> list[list[str]]:
    """Return the cells of a medium's rows of the run sheet, or of all rows, sorted: order and numbers do not count."""
    runs = campaign.runs_of(medium) if medium else campaign.runs
    # the state of the whole sheet also says whether the logs are recordings
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    digests = campaign.digests
    return origin + sorted(
        [*cells_of_run(run).values(), digests.get(run.run_id, "")] for run in runs
    )


def plate_run_order(campaign: Campaign, medium: str) -> list[str]:
    """List plate runs of a medium by run_id in the order of the run sheet, taken as the order of measurement."""
    plates = (run for run in campaign.runs_of(medium) if run.kind == "plate")
    return [run.run_id for run in sorted(plates, key=lambda run: run.row)]


def cells_of_run(run: Run) -> dict[str, str]:
    """Return the fields of a run that its results depend on, as text by column."""
    names = (field.name for field in fields(run) if field.name not in _FIELDS_LEFT_OUT)
    return {name: _format_cell(getattr(run, name)) for name in names}


def _format_cell(value: object) -> str:
    """Write a value as a cell: empty for None, NaN and False, "yes" for True."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
