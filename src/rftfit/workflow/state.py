"""What the results of a campaign depend on besides the files that a rule reads: code, settings, rows, logs.

Snakemake sees it as one small file a job, ``results/state/RULE/NAME.json``, which is an input of the
job and is written anew only when it changes.
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
from rftfit.figures.registry import Declared, figures
from rftfit.figures.style import PAPER
from rftfit.logs.registry import DialectOrigin, origins
from rftfit.measure.long_logs import MemoryNeed, memory_need
from rftfit.results import FOLDER
from rftfit.robot import PROFILES
from rftfit.store import write_bytes
from rftfit.store.digests import code_digest, digest_of, digests_of_files, plugin_digest, seal
from rftfit.store.links import cut_shared_files, refuse_links
from rftfit.workflow.stages import ALL, EVERY, FOLDER_BY_RULE, LAST, OWN, PRINT_RULES, STAGES, Stage

STATES = f"{FOLDER}/state"
HANDED = "RFTFIT_CAMPAIGN"
"""Environment variable: the file with the campaign that `rftfit run` has read, and its seal."""

_LEFT_OUT = ("row", "note", "lacks_force_x", "rows_without_data")
"""The number of a row, what nobody computes with, and what the digest of a table tells."""


def job_name(rule: str, key: str) -> str:
    """Name of a job: its rule and, where the rule has a wildcard, its value: the stem of the files it writes."""
    return f"{rule}/{key}" if key else rule


def state_file(name: str) -> str:
    """Path of the file of a job's state, from the campaign's folder."""
    return f"{STATES}/{name}.json"


def job_of(path: str) -> tuple[str, str]:
    """Rule and key of a job by the file of its state."""
    rule, _, key = path.removeprefix(f"{STATES}/").removesuffix(".json").partition("/")
    return rule, key


class States:
    """States of the jobs of one campaign, as they are now; each log is read once.

    A state is a dict: ``code``, ``settings``, ``rows``, ``logs``, ``robot files`` to a digest.
    """

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self._of: Callable[[str, str], dict[str, str]] = cache(self._find)
        self._rows = cache(lambda name: digest_of(name, sheet_cells(campaign, name)))
        self._logs: dict[str, str] = {}

    @cached_property
    def config(self) -> dict[str, Any]:
        """Settings by section."""
        return self.campaign.config.model_dump(mode="json")

    @cached_property
    def figures(self) -> dict[str, tuple[Declared, str]]:
        """Figures by their path below ``results/``, each with its medium, where it has one."""
        return {
            figure.file(medium): (figure, medium)
            for figure in figures()
            for medium in figure.media(self.campaign)
        }

    def stage(self, rule: str, key: str) -> tuple[Stage, str]:
        """What a job calls, and with which word: its medium, most often."""
        if rule in FOLDER_BY_RULE:
            figure, medium = self.figures[f"{FOLDER_BY_RULE[rule]}/{key}"]
            logs = OWN if figure.logs else ""
            on_demand = figure.on_demand or rule in PRINT_RULES
            stage = Stage(figure.run, "figures", figure.settings, logs=logs, on_demand=on_demand)
            return stage, medium
        return STAGES[rule], key

    def has(self, rule: str, key: str) -> bool:
        """Whether the campaign has a job of a rule, as ``workflow/rules`` would plan it."""
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
        """Figures of a whole run as files for a paper, by path from the campaign's folder."""
        return [
            f"{FOLDER}/{path}.{ending}"
            for path, (figure, _) in self.figures.items()
            if not figure.on_demand
            for ending in PAPER
        ]

    def on_demand(self, name: str) -> bool:
        """Whether a job is one of ``rftfit sweep`` or of ``rftfit run --print``, not of every ``rftfit run``."""
        rule, _, key = name.partition("/")
        return self.stage(rule, key)[0].on_demand

    def of(self, rule: str, key: str) -> dict[str, str]:
        """State of a job by now."""
        return self._of(rule, key)

    def _find(self, rule: str, key: str) -> dict[str, str]:
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
        """Input function of a rule: writes the state of a job where it differs, and returns its path."""

        def state(wildcards: Mapping[str, str]) -> str:
            key = next(iter(dict(wildcards).values()), "")
            data = (json.dumps(self.of(rule, key), indent=1, sort_keys=True) + "\n").encode()
            name = state_file(job_name(rule, key))
            path = self.campaign.root / name
            # bytes: a damaged file may be no text
            if not path.is_file() or path.read_bytes() != data:
                write_bytes(path, data)
            return name

        return state

    def code(self, stage: Stage) -> str:
        """Digest of the code that a stage uses, dialects of other packages included."""
        module = stage.run.partition(":")[0].split(".")[1:]
        code = code_digest(stage.room, f"{'/'.join(module)}.py")
        if not stage.logs or not self.dialects:
            return code
        dialects = self.dialects
        return digest_of(
            code,
            [
                f"{dialect.package} {dialect.version} {plugin_digest(dialect.module)}"
                for dialect in dialects
            ],
        )

    @cached_property
    def dialects(self) -> list[DialectOrigin]:
        """Dialects of other packages that the logs are read with."""
        config = self.campaign.config
        dialect_names = {config.dialect, config.force_log.dialect, config.motion_log.dialect}
        return [*origins(filter(None, dialect_names)).values()]

    def logs(self, medium: str) -> dict[str, str]:
        """SHA-256 of the logs of a medium, empty where there is none; of runs of no medium for ``""``."""
        names = log_names(self.campaign, medium)
        new = [name for name in names if name not in self._logs]
        self._logs |= digests_of_files(self.campaign.raw, new)
        return {name: self._logs[name] for name in names}

    def memory(self, medium: str) -> MemoryNeed:
        """Memory that the stages need which read the logs of a medium, or their samples."""
        return memory_need(self.campaign.raw, log_names(self.campaign, medium))

    @cached_property
    def all_logs(self) -> dict[str, str]:
        """SHA-256 of every log that the campaign names."""
        media = (*self.campaign.media_with_runs, "")
        return {name: digest for medium in media for name, digest in self.logs(medium).items()}

    @cached_property
    def robot_files(self) -> dict[str, str]:
        """SHA-256 of the robot's own file, sheet and tracks, from the campaign's folder."""
        return digests_of_files(self.campaign.root, robot_files(self.campaign))


def read_states(config: Path) -> tuple[States, int]:
    """Check a campaign, or take it as handed over; its states, and how many warnings there are."""
    if handed := handed_over(config):
        return handed
    campaign, problems = check_campaign(config)
    if campaign is None:
        raise CampaignError(problems)
    return States(campaign), len(problems)


def hand_over(states: States, warnings: int, file: IO[bytes]) -> str:
    """Write a campaign for processes that this one starts; `HANDED` for them, while the file is open."""
    data = pickle.dumps((states.campaign, warnings), protocol=5)
    with suppress(OSError):  # they read the campaign themselves
        file.write(data)
    return f"/proc/{os.getpid()}/fd/{file.fileno()} {seal(data)}"


def guard_written(campaign: Campaign) -> None:
    """Make sure before a run that no file of somebody else is written: refuse links, cut second names of files."""
    root = campaign.root
    refuse_links(root)
    files = [path for path in root.iterdir() if path.is_file()]
    folders = {(root / name).parent for name in campaign.read_from} - {root}
    cut_shared_files(root, [campaign.raw, campaign.sheet, *files, *folders])


def handed_over(config: Path | None = None) -> tuple[States, int] | None:
    """What was handed over, if it is of this config, and config, run sheet and code are the same."""
    name, _, digest = os.environ.get(HANDED, "").rpartition(" ")
    with suppress(OSError):
        if Path(name).is_file() and seal(data := Path(name).read_bytes()) == digest:
            # bytes of this process's parent, known by its seal
            campaign, warnings = pickle.loads(data)  # noqa: S301
            config_path = Path(campaign.root, next(iter(campaign.read_from)))
            if campaign.is_as_read and (config is None or config_path.samefile(config)):
                return States(campaign), warnings
    return None


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """Logs that a medium is measured from, relative to the raw folder; some may not exist.

    `medium`: Empty for the runs that belong to none.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unassigned_air_runs
    names = {name for run in runs for name in (run.force_log, run.motion_log, run.zero_log)} - {""}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    if names and campaign.config.force_log.calibration is not None:
        names.add(campaign.config.force_log.calibration)
    bags = [name.removesuffix(BAG) for name in names if name.endswith(f"/{BAG}")]
    parts = (bag + path.name for bag in bags for path in (campaign.raw / bag).glob("*.*"))
    return sorted(names.union(parts))


def robot_files(campaign: Campaign) -> list[str]:
    """The robot's own file, its sheet and its tracks, and whether they are re-enacted, as far as they exist."""
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
    """Cells of a medium's rows of the run sheet, or of all; order and numbers of rows do not count."""
    runs = campaign.runs_of(medium) if medium else campaign.runs
    # whether they are recordings at all is told beside the whole
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    digests = campaign.digests
    return origin + sorted([*cells(run).values(), digests.get(run.run_id, "")] for run in runs)


def plate_run_order(campaign: Campaign, medium: str) -> list[str]:
    """Plate runs of a medium in the order of the run sheet, which stands for the order in which they were made."""
    plates = (run for run in campaign.runs_of(medium) if run.kind == "plate")
    return [run.run_id for run in sorted(plates, key=lambda run: run.row)]


def cells(run: Run) -> dict[str, str]:
    """What counts of a row of the run sheet, as text by column."""
    names = [name for name in run.__dataclass_fields__ if name not in _LEFT_OUT]
    return {name: _text(getattr(run, name)) for name in names}


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
