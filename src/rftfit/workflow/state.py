"""The state of each job: digests of what its results depend on besides its input files: code, settings, rows, logs.

A job is a rule (such as ``slopes``) with one value of its wildcard, here called key: a medium, a figure, a table of the
robot's runs; it is empty for a rule without a wildcard. Its state is a dict from ``code``, ``settings``, ``rows`` (of the
run sheet), ``order`` (of the runs), ``logs``, ``robot files`` to a digest, with those entries alone that its results depend on.
Snakemake goes by files: so each state is also written as one small file, ``results/state/RULE/KEY.json``, which is an input
of the job and is written anew only when the state changes. Then Snakemake does the job again.
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
"""Folder of the files of states, from the campaign's folder."""

LEAST_MB = 1000
"""Memory that a cluster gives at least to a stage of a medium, MB; `rftfit run` says where one needs more."""


def job_name(rule: str, key: str) -> str:
    """Name a job by its rule and key, as ``slopes/poppy_LP``; by its rule alone where it has no key."""
    return f"{rule}/{key}" if key else rule


def state_file(name: str) -> str:
    """Return the path of the file of a job's state, from the campaign's folder; `name`: name of the job (`job_name`)."""
    return f"{STATES}/{name}.json"


def job_of(path: str) -> tuple[str, str]:
    """Return rule and key of a job, by the path of the file of its state from the campaign's folder."""
    rule, _, key = path.removeprefix(f"{STATES}/").removesuffix(".json").partition("/")
    return rule, key


class FileDigests:
    """SHA-256 of files below a folder, each read once in the life of this object, since logs are large."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._digests: dict[str, str] = {}

    def digests_of(self, paths: Sequence[str]) -> dict[str, str]:
        """Compute SHA-256 of files by their paths from the folder; empty for a file that is not there."""
        unread = [path for path in paths if path not in self._digests]
        self._digests |= digests_of_files(self.root, unread)
        return {path: self._digests[path] for path in paths}


class States:
    """A campaign and the states of its jobs, as they are now; each log is read once, at the first question about it.

    `campaign`: Config and run sheet, checked. `warnings`: Number of warnings that the check gave. `state_of`: Function from
    rule and key of a job to its state.
    """

    def __init__(self, campaign: Campaign, warnings: int = 0) -> None:
        self.campaign = campaign
        self.warnings = warnings
        self.state_of: Callable[[str, str], dict[str, str]] = cache(self._make_state)
        self._sheet_digest = cache(lambda medium: digest_of(medium, sheet_cells(campaign, medium)))
        self._logs = FileDigests(campaign.raw)

    @cached_property
    def config(self) -> dict[str, Any]:
        """Settings of the campaign by section of the config, as JSON would hold them."""
        return self.campaign.config.model_dump(mode="json")

    @cached_property
    def figures(self) -> dict[str, tuple[DeclaredFigure, str]]:
        """Each figure with its medium, by its path below ``results/`` without ending: ``figures/NAME``, ``quality/NAME``.

        A figure that is drawn for several media stands here once for each; the medium of any other is empty.
        """
        return {
            figure.file(medium): (figure, medium)
            for figure in figures()
            for medium in figure.media(self.campaign)
        }

    def stage(self, rule: str, key: str) -> tuple[Stage, str]:
        """Return the stage of a job (its function and what it depends on), and the argument of that function.

        The argument is what the function takes besides `Results`: a medium, the name of a table of the robot's runs as
        ``runs_map``, or empty for none. Stages of figures are made here from what `rftfit.figures` declares.
        """
        if rule in FOLDER_BY_RULE:
            figure, medium = self.figures[f"{FOLDER_BY_RULE[rule]}/{key}"]
            logs = MEDIUM_LOGS if figure.logs else ""
            on_demand = figure.on_demand or rule in PRINT_RULES
            stage = Stage(figure.run, "figures", figure.settings, logs=logs, on_demand=on_demand)
            return stage, medium
        return STAGES[rule], key

    def has_job(self, rule: str, key: str) -> bool:
        """Return True where the campaign has a job of this rule and key; files of states may be left from an older config."""
        if rule in FOLDER_BY_RULE:
            return f"{FOLDER_BY_RULE[rule]}/{key}" in self.figures
        if not self.has_rule(rule):
            return False
        keys_by_wildcard = {
            "medium": self.campaign.media_with_runs,
            "runs": [f"runs_{name}" for name in PROFILES],
            "": [""],
        }
        return key in keys_by_wildcard[STAGES[rule].wildcard]

    def has_rule(self, rule: str) -> bool:
        """Return True for a rule, other than of figures, for which this campaign has work.

        Rules of the robot need a robot in the config; the rule ``clocks`` needs ``clock.method: estimate``.
        """
        stage = STAGES.get(rule)
        # the last job records the robot's files, too, where there are some
        if not stage or (stage.robot and rule != LAST and not self.campaign.robot_medium):
            return False
        return not stage.estimated or self.campaign.config.clock.method == "estimate"

    @cached_property
    def paper_files(self) -> list[str]:
        """Paths of the files for a paper (pdf) of all figures that a whole run draws, from the campaign's folder."""
        return [
            f"{RESULTS}/{path}.{ending}"
            for path, (figure, _) in self.figures.items()
            if not figure.on_demand
            for ending in PAPER
        ]

    def on_demand(self, name: str) -> bool:
        """Return True for a job that a whole run leaves to ``rftfit sweep`` or ``rftfit run --print``; `name`: of the job."""
        rule, _, key = name.partition("/")
        return self.stage(rule, key)[0].on_demand

    def medium_of(self, rule: str, key: str) -> str:
        """Return the medium that a job works on; empty where it works on none or on all.

        Neither the key of a figure nor that of the robot's runs is a medium, so the argument of the stage is looked at.
        """
        argument = self.stage(rule, key)[1]
        return argument if argument in self.campaign.config.media else ""

    def _make_state(self, rule: str, key: str) -> dict[str, str]:
        """Make the state of a job: a digest of each thing that its stage depends on (`rftfit.workflow.stages.Stage`)."""
        # without a medium, rows and logs are those that belong to no single one
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
        """Write the state of a job to its file, unless this holds it already; return the path of the file.

        A rule calls this for its input, while Snakemake plans. `wildcards`: Names and values of the rule's wildcards: one
        or none.
        """
        key = next(iter(dict(wildcards).values()), "")
        data = (json.dumps(self.state_of(rule, key), indent=1, sort_keys=True) + "\n").encode()
        name = state_file(job_name(rule, key))
        path = self.campaign.root / name
        # bytes: a damaged file may be no text
        if not path.is_file() or path.read_bytes() != data:
            write_bytes(path, data)
        return name

    def code_digest_of(self, stage: Stage) -> str:
        """Compute the digest of the code that a stage uses: its room, all rooms below, and the module of its function.

        Where it reads logs, dialects (readers of a log format) of other packages count, too.
        """
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
        """Dialects (readers of a log format) of other packages that the config names."""
        config = self.campaign.config
        # that of the campaign, and of a sort of logs that states its own
        dialect_names = {config.dialect, config.force_log.dialect, config.motion_log.dialect}
        return [*origins(filter(None, dialect_names)).values()]

    def log_digests(self, medium: str) -> dict[str, str]:
        """Return the SHA-256 of the logs of a medium by name, empty for a file that is not there; `medium`: as in `log_names`.

        Names are relative to the raw folder.
        """
        return self._logs.digests_of(log_names(self.campaign, medium))

    def memory(self, medium: str) -> MemoryNeed:
        """Estimate the memory of a stage that reads the logs of a medium, or the samples of these logs."""
        return memory_need(self.campaign.raw, log_names(self.campaign, medium))

    @cached_property
    def all_log_digests(self) -> dict[str, str]:
        """SHA-256 of every log that the campaign names, by name relative to the raw folder."""
        # the empty name stands for the runs that belong to no medium
        media = (*self.campaign.media_with_runs, "")
        return {
            name: digest for medium in media for name, digest in self.log_digests(medium).items()
        }

    @cached_property
    def robot_digests(self) -> dict[str, str]:
        """SHA-256 of the robot's file, sheet and tracks, by path from the campaign's folder."""
        return digests_of_files(self.campaign.root, robot_files(self.campaign))


def read_states(config: Path) -> States:
    """Return the states of a campaign: as the parent process has read it, else as the config says, after a check.

    A campaign with an error raises CampaignError.
    """
    if states := take_over(config):
        return states
    campaign, problems = check_campaign(config)
    if campaign is None:
        raise CampaignError(problems)
    return States(campaign, len(problems))


HANDED = "RFTFIT_CAMPAIGN"
"""Environment variable: path of the file with the campaign that `rftfit run` has read, a space, the seal of its bytes.

The seal is a digest of the bytes and of the code of the program.
"""


def hand_over(states: States, file: IO[bytes]) -> str:
    """Write a campaign for child processes, which so need not read and check it again.

    Returns the value that the environment variable `HANDED` has to have for them. It is valid while the file is open.
    """
    data = pickle.dumps((states.campaign, states.warnings), protocol=5)
    with suppress(OSError):  # on a full disk the children read the campaign themselves
        file.write(data)
    return f"/proc/{os.getpid()}/fd/{file.fileno()} {seal(data)}"


def take_over(config: Path | None = None) -> States | None:
    """Return the states of the campaign that `hand_over` has written in a parent process; None where it cannot be used.

    It can where it is of this `config` (default: any), and config, run sheet and code are still the same.
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


def guard_written(campaign: Campaign) -> None:
    """Prevent that a run of this campaign changes files of another folder.

    Raises LinkError where a symbolic link stands where files are written. A file of Snakemake that has a second name, as
    in a backup by ``cp -al``, is replaced by a copy.
    """
    root = campaign.root
    refuse_links(root)
    files = [path for path in root.iterdir() if path.is_file()]
    folders = {(root / name).parent for name in campaign.read_from} - {root}
    cut_shared_files(root, [campaign.raw, campaign.sheet, *files, *folders])


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """List the logs from which a medium is measured, relative to the raw folder; some may not exist.

    These are the logs of its runs, those of the push against a rigid block (which shows how far the rig bends), and the
    calibration of the transducer, where the config names them. `medium`: Empty for the runs that belong to no medium: those
    in air that no leg names as its tare.
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
    """List the files of the robot that exist, from the campaign's folder: its description, its run sheet, its tracks.

    Tracks are recorded positions of markers on it. A further file marks tracks that were simulated. Empty without a robot.
    """
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
    """Return the cells of the run sheet that results of a medium depend on, a list a run; without a medium, of all runs.

    They are sorted, and without the number of the row: to exchange rows makes nothing out of date. The last cell of a run
    is the digest of its numbers, where the campaign is a table of numbers instead of logs.
    """
    runs = campaign.runs_of(medium) if medium else campaign.runs
    # the state of the whole sheet also says whether the logs are recordings
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    digests = campaign.digests
    return origin + sorted(
        [*cells_of_run(run).values(), digests.get(run.run_id, "")] for run in runs
    )


def plate_run_order(campaign: Campaign, medium: str) -> list[str]:
    """List the run_ids of the plate runs of a medium in the order of the run sheet, taken as the order of measurement.

    Checks look for a drift in this order, so for them it does count.
    """
    plates = (run for run in campaign.runs_of(medium) if run.kind == "plate")
    return [run.run_id for run in sorted(plates, key=lambda run: run.row)]


_FIELDS_LEFT_OUT = ("row", "note", "lacks_force_x", "rows_without_data")
"""Fields of a run that its state leaves out: the number of its row, its note, and two that the digest of a table covers."""


def cells_of_run(run: Run) -> dict[str, str]:
    """Return the cells of a run in the run sheet that its results depend on, by column."""
    names = (field.name for field in fields(run) if field.name not in _FIELDS_LEFT_OUT)
    return {name: _format_cell(getattr(run, name)) for name in names}


def _format_cell(value: object) -> str:
    """Format a value as a cell of the run sheet: empty for None, NaN and False, "yes" for True."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
