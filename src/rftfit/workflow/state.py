"""The state of each job: digests of what its results depend on besides its input files: code, settings, rows, logs.

Snakemake sees a state as one small file a job, ``results/state/RULE/NAME.json``, which is an input of the
job and is written anew only when the state changes.
"""

from __future__ import annotations

import json
import math
import os
import pickle
from collections.abc import Callable, Mapping
from contextlib import suppress
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
from rftfit.workflow.stages import ALL, EVERY, FOLDER_BY_RULE, LAST, OWN, PRINT_RULES, STAGES, Stage

STATES = f"{RESULTS}/state"
HANDED = "RFTFIT_CAMPAIGN"
"""Environment variable: path of the file with the campaign that `rftfit run` has read, a space, the seal of its bytes."""

LEAST_MB = 1000
"""Memory that a cluster gives at least to a stage of a medium; `rftfit run` says where one needs more."""

_FIELDS_LEFT_OUT = ("row", "note", "lacks_force_x", "rows_without_data")
"""Fields of a run that its state leaves out: the number of its row, its note, and what the digest of a table tells."""


def job_name(rule: str, key: str) -> str:
    """Name a job by its rule and, where the rule has a wildcard, the value of it: the stem of the files it writes."""
    return f"{rule}/{key}" if key else rule


def state_file(name: str) -> str:
    """Return the path of the file of a job's state, from the campaign's folder; `name`: as `job_name`."""
    return f"{STATES}/{name}.json"


def job_of(path: str) -> tuple[str, str]:
    """Return rule and key of a job by the path of the file of its state."""
    rule, _, key = path.removeprefix(f"{STATES}/").removesuffix(".json").partition("/")
    return rule, key


class States:
    """States of the jobs of one campaign, as they are now; each log is read once.

    A state is a dict from ``code``, ``settings``, ``rows``, ``order``, ``logs``, ``robot files`` to a digest, as far as
    the results of the job depend on them. A job is named by its rule and its key, the value of the rule's wildcard.
    """

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self._state: Callable[[str, str], dict[str, str]] = cache(self._make_state)
        self._rows = cache(lambda medium: digest_of(medium, sheet_cells(campaign, medium)))
        self._log_digests: dict[str, str] = {}

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
        """Return the stage of a job, and the argument that its function takes besides `Results`: most often a medium."""
        if rule in FOLDER_BY_RULE:
            figure, medium = self.figures[f"{FOLDER_BY_RULE[rule]}/{key}"]
            logs = OWN if figure.logs else ""
            on_demand = figure.on_demand or rule in PRINT_RULES
            stage = Stage(figure.run, "figures", figure.settings, logs=logs, on_demand=on_demand)
            return stage, medium
        return STAGES[rule], key

    def has(self, rule: str, key: str) -> bool:
        """Tell whether the campaign has this job, by the same conditions as ``workflow/rules``."""
        if rule in FOLDER_BY_RULE:
            return f"{FOLDER_BY_RULE[rule]}/{key}" in self.figures
        stage = STAGES.get(rule)
        if not stage or (stage.robot and rule != LAST and not self.campaign.robot_medium):
            return False
        if stage.estimated and self.campaign.config.clock.method != "estimate":
            return False
        if stage.wildcard == "runs":
            return key.removeprefix("runs_") in PROFILES
        return key in (self.campaign.media_with_runs if stage.wildcard else ("",))

    @cached_property
    def printed(self) -> list[str]:
        """Paths of the files for a paper of all figures of a whole run, from the campaign's folder."""
        return [
            f"{RESULTS}/{path}.{ending}"
            for path, (figure, _) in self.figures.items()
            if not figure.on_demand
            for ending in PAPER
        ]

    def on_demand(self, name: str) -> bool:
        """Tell whether a job belongs to ``rftfit sweep`` or ``rftfit run --print``, and not to every ``rftfit run``."""
        rule, _, key = name.partition("/")
        return self.stage(rule, key)[0].on_demand

    def of(self, rule: str, key: str) -> dict[str, str]:
        """Return the state of a job, made once."""
        return self._state(rule, key)

    def _make_state(self, rule: str, key: str) -> dict[str, str]:
        """Make the state of a job: a digest of each thing that its stage depends on."""
        stage, word = self.stage(rule, key)
        medium = word if word in self.campaign.config.media else ""
        state = {"code": self.code(stage)}
        if stage.settings:
            sections = self.config if ALL in stage.settings else stage.settings
            state["settings"] = digest_of({name: self.config[name] for name in sections})
        if stage.rows:
            state["rows"] = self._rows(medium)
        if stage.order:
            state["order"] = digest_of(plate_run_order(self.campaign, medium))
        if stage.logs:
            logs = self.all_logs if stage.logs == EVERY else self.logs(medium)
            state["logs"] = digest_of(sorted(logs.items()))
        if stage.robot and self.campaign.robot_medium:
            state["robot files"] = digest_of(sorted(self.robot_files.items()))
        return state

    def input_of(self, rule: str) -> Callable[[Mapping[str, str]], str]:
        """Return the input function of a rule: it writes the state of a job where it differs, and returns the file's path."""

        def write_state(wildcards: Mapping[str, str]) -> str:
            key = next(iter(dict(wildcards).values()), "")
            data = (json.dumps(self.of(rule, key), indent=1, sort_keys=True) + "\n").encode()
            name = state_file(job_name(rule, key))
            path = self.campaign.root / name
            # bytes: a damaged file may be no text
            if not path.is_file() or path.read_bytes() != data:
                write_bytes(path, data)
            return name

        return write_state

    def code(self, stage: Stage) -> str:
        """Compute the digest of the code that a stage uses; dialects of other packages count where it reads logs."""
        module = stage.run.partition(":")[0].split(".")[1:]
        code = code_digest(stage.room, f"{'/'.join(module)}.py")
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

    def logs(self, medium: str) -> dict[str, str]:
        """Compute SHA-256 of the logs of a medium by name, empty for a file that is not there; `medium` ``""``: runs of none."""
        names = log_names(self.campaign, medium)
        new = [name for name in names if name not in self._log_digests]
        self._log_digests |= digests_of_files(self.campaign.raw, new)
        return {name: self._log_digests[name] for name in names}

    def memory(self, medium: str) -> MemoryNeed:
        """Estimate the memory that stages need which read the logs of a medium, or the samples of these logs."""
        return memory_need(self.campaign.raw, log_names(self.campaign, medium))

    @cached_property
    def all_logs(self) -> dict[str, str]:
        """SHA-256 of every log that the campaign names."""
        media = (*self.campaign.media_with_runs, "")
        return {name: digest for medium in media for name, digest in self.logs(medium).items()}

    @cached_property
    def robot_files(self) -> dict[str, str]:
        """SHA-256 of the robot's file, sheet and tracks, by path from the campaign's folder."""
        return digests_of_files(self.campaign.root, robot_files(self.campaign))


def read_states(config: Path) -> tuple[States, int]:
    """Check a campaign, unless one was handed over; return its states and the number of warnings."""
    if handed := handed_over(config):
        return handed
    campaign, problems = check_campaign(config)
    if campaign is None:
        raise CampaignError(problems)
    return States(campaign), len(problems)


def hand_over(states: States, warnings: int, file: IO[bytes]) -> str:
    """Write a campaign for child processes; return their value of `HANDED`, which holds while the file is open."""
    data = pickle.dumps((states.campaign, warnings), protocol=5)
    with suppress(OSError):  # on a full disk the children read the campaign themselves
        file.write(data)
    return f"/proc/{os.getpid()}/fd/{file.fileno()} {seal(data)}"


def guard_written(campaign: Campaign) -> None:
    """Prevent that a run writes into files of somebody else: refuse links, replace files with second names by copies."""
    root = campaign.root
    refuse_links(root)
    files = [path for path in root.iterdir() if path.is_file()]
    folders = {(root / name).parent for name in campaign.read_from} - {root}
    cut_shared_files(root, [campaign.raw, campaign.sheet, *files, *folders])


def handed_over(config: Path | None = None) -> tuple[States, int] | None:
    """Return the states that were handed over, and the number of warnings; None where there are none that fit.

    They fit where they are of this config (default: any), and config, run sheet and code are still the same.
    """
    name, _, digest = os.environ.get(HANDED, "").rpartition(" ")
    with suppress(OSError):
        if Path(name).is_file() and seal(data := Path(name).read_bytes()) == digest:
            # the seal proves that these bytes are from this process's parent: they are safe to unpickle
            campaign, warnings = pickle.loads(data)  # noqa: S301
            config_path = Path(campaign.root, next(iter(campaign.read_from)))
            if campaign.is_as_read and (config is None or config_path.samefile(config)):
                return States(campaign), warnings
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
    bags = [name.removesuffix(BAG) for name in names if name.endswith(f"/{BAG}")]
    parts = (bag + path.name for bag in bags for path in (campaign.raw / bag).glob("*.*"))
    return sorted(names.union(parts))


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
    # one cell more in the state of the whole sheet: are the logs recordings at all
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    digests = campaign.digests
    return origin + sorted([*cells(run).values(), digests.get(run.run_id, "")] for run in runs)


def plate_run_order(campaign: Campaign, medium: str) -> list[str]:
    """List plate runs of a medium by run_id in the order of the run sheet, taken as the order of measurement."""
    plates = (run for run in campaign.runs_of(medium) if run.kind == "plate")
    return [run.run_id for run in sorted(plates, key=lambda run: run.row)]


def cells(run: Run) -> dict[str, str]:
    """Return the fields of a run that its results depend on, as text by column."""
    names = [name for name in run.__dataclass_fields__ if name not in _FIELDS_LEFT_OUT]
    return {name: _format_cell(getattr(run, name)) for name in names}


def _format_cell(value: object) -> str:
    """Write a value as a cell: empty for None, NaN and False, "yes" for True."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
