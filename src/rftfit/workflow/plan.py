"""The tasks of one campaign: what each reads, writes and depends on, and which are out of date.

One answer serves the Snakefile, the jobs, ``rftfit run`` and ``rftfit verify``: a task is up to date when
its record names the files, digests and contents that are there now. The records of a stage are one
small file, ``results/records/STAGE.json``, written anew after each task, so that a killed stage goes on
from what it has finished.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.campaign.files import BAG
from rftfit.campaign.load import Campaign, check_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.figures.registry import figures
from rftfit.figures.style import FORMATS
from rftfit.results import FOLDER
from rftfit.store import write_text
from rftfit.store.digests import Seen, code_digest, digest_of
from rftfit.workflow.stages import ALL, ON_DEMAND, STAGES, Stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from rftfit.campaign.sheet import Run
    from rftfit.figures.registry import Declared
    from rftfit.logs.registry import Origin

_WORD = re.compile(r"\{(\w+)\}")
_LEFT_OUT = ("row", "note")
"""Columns of the run sheet: the number of a row, and what nobody computes with."""

_KEPT = tuple(f"{FOLDER}/{name}/" for name in ("records", "logs", "robot/parts"))
"""Folders of what is no result: records of tasks, logs of jobs, finished runs of a sweep."""


@dataclass(frozen=True)
class Record:
    """One finished task: digests of code, settings, rows, logs; SHA-256 by path from the campaign's folder."""

    depends: dict[str, str]
    reads: dict[str, str]
    writes: dict[str, str]


@dataclass
class Records:
    """Records of the finished tasks of one stage, by their key."""

    path: Path
    tasks: dict[str, Record] = field(default_factory=dict)

    @classmethod
    def load(cls, root: Path, stage: str) -> Records:
        """Read the records of a stage; one that is damaged counts as not there."""
        path = root / FOLDER / "records" / f"{stage}.json"
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            tasks = {key: Record(**record) for key, record in data.items()}
            for record in tasks.values():
                for part in (record.depends, record.reads, record.writes):
                    if not all(isinstance(word, str) for pair in part.items() for word in pair):
                        raise TypeError
        except (OSError, ValueError, TypeError, AttributeError):
            tasks = {}
        return cls(path, tasks)

    def save(self) -> None:
        """Write the records of the tasks there are."""
        data = {key: asdict(self.tasks[key]) for key in sorted(self.tasks)}
        write_text(self.path, json.dumps(data, indent=1, sort_keys=True) + "\n")


@dataclass(frozen=True)
class Task:
    """One unit of work of a stage: its `key` is the medium or figure; paths are from the campaign's folder.

    `run`: ``module:function``. `state`: Finds `depends`.
    """

    stage: str
    key: str
    run: str
    medium: str = ""
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    state: Callable[[], dict[str, str]] = field(default=dict, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.stage} {self.key}".rstrip()

    def __getstate__(self) -> dict[str, object]:
        # a process that does the task needs its files only
        return {name: value for name, value in self.__dict__.items() if name != "state"}

    @cached_property
    def depends(self) -> dict[str, str]:
        """Digest of everything else that its results depend on, by what it is."""
        return self.state()


@dataclass(frozen=True)
class Finding:
    """One thing about a task that is not as recorded.

    `sort`: ``new``, ``edited`` or ``missing`` (a result), ``input`` (a result it read) or ``changed``.
    `what`: The path, or what its results depend on. `was`: The recorded digest.
    """

    task: Task
    sort: str
    what: str = ""
    was: str = ""


def _with_stages(task: Task, found: Mapping[str, Sequence[Task]]) -> dict[str, str]:
    """What a task depends on that tells what all earlier tasks depend on, whatever their results."""
    others = [
        [str(other), other.depends]
        for name, tasks in found.items()
        if name not in ON_DEMAND
        for other in tasks
    ]
    return task.depends | {"stages": digest_of(others)}


class Plan:
    """One campaign as its workflow sees it.

    `config`: The campaign's configuration.
    `fresh`: Read every log anew, instead of trusting size and times of those seen before.
    """

    def __init__(self, config: str | Path, *, fresh: bool = False) -> None:
        self.config = Path(config)
        campaign, problems = check_campaign(self.config)
        if campaign is None:
            raise CampaignError(problems)
        self.campaign: Campaign = campaign
        self.warnings = len(problems)
        self.root = self.campaign.root
        self._seen = Seen(None if fresh else self.root / ".snakemake/rftfit/logs_seen.tsv")
        self._digests: dict[str, str] = {}
        self._rows: dict[str, str] = {}
        self._results = Seen(None)
        self._records: dict[str, Records] = {}

    @cached_property
    def names(self) -> dict[str, tuple[str, ...]]:
        """What the words in braces of a stage's files stand for."""
        campaign = self.campaign
        return {
            "media": campaign.media_with_runs,
            "laboratory": campaign.of_role("laboratory"),
            "sands": campaign.of_role("natural_sand"),
            "robot": (campaign.robot_medium,) if campaign.robot_medium else (),
        }

    @cached_property
    def stages(self) -> dict[str, list[Task]]:
        """Tasks of every stage, stages in the order of the data's way."""
        written: dict[str, str] = {}
        found: dict[str, list[Task]] = {}

        def add(name: str, tasks: list[Task]) -> None:
            found[name] = tasks
            written.update((path, name) for task in tasks for path in task.writes)

        for stage in STAGES:
            if stage.name == "page":
                for group, tasks in self._figure_tasks(written).items():
                    add(group, tasks)
            media = self.names[stage.each] if stage.each else ("",)
            if stage.robot and not self.names["robot"]:
                media = ()
            tasks = [self._task(stage, medium, written) for medium in media]
            if stage.name == "provenance":
                earlier = found.copy()
                tasks = [
                    replace(task, state=partial(_with_stages, task, earlier)) for task in tasks
                ]
            add(stage.name, tasks)
        return found

    @cached_property
    def default(self) -> list[str]:
        """Stages of a whole run."""
        return [name for name in self.stages if name not in ON_DEMAND]

    def _task(self, stage: Stage, medium: str, written: dict[str, str]) -> Task:
        return Task(
            stage.name, medium, stage.run, medium,
            self._filled(stage.reads, medium, written), self._filled(stage.writes, medium, None),
            partial(self._depends, stage, medium),
        )  # fmt: skip

    def _depends(self, stage: Stage | Declared, medium: str) -> dict[str, str]:
        depends = {"code": self.code(stage.run, logs=stage.logs)}
        if stage.settings:
            whole = self.campaign.config.model_dump(mode="json")
            sections = whole if ALL in stage.settings else stage.settings
            depends["settings"] = digest_of({name: whole[name] for name in sections})
        if isinstance(stage, Stage) and stage.rows:
            depends["rows"] = self.rows(medium)
        if stage.logs:
            # a stage of the whole campaign reads the logs of runs that belong to no medium
            depends["logs"] = digest_of(sorted(self.logs(medium).items()))
        if isinstance(stage, Stage) and stage.robot:
            depends["robot files"] = digest_of(sorted(self.robot_digests.items()))
        return depends

    def _figure_tasks(self, written: dict[str, str]) -> dict[str, list[Task]]:
        groups: dict[str, list[Task]] = {}
        for figure in figures():
            for medium in figure.media(self.campaign):
                name = figure.file(medium)
                task = Task(
                    figure.group, name, figure.run, medium,
                    self._filled(("checks/{media}.csv", *figure.reads), medium, written),
                    tuple(f"{FOLDER}/{name}.{ending}" for ending in FORMATS),
                    partial(self._depends, figure, medium),
                )  # fmt: skip
                groups.setdefault(figure.group, []).append(task)
        return groups

    def _filled(
        self, patterns: Sequence[str], medium: str, written: dict[str, str] | None
    ) -> tuple[str, ...]:
        found: list[str] = []
        for pattern in patterns:
            if pattern.startswith("*"):
                earlier = (path for path, by in (written or {}).items() if by not in ON_DEMAND)
                found += sorted(path for path in earlier if path.endswith(pattern[1:]))
                continue
            word = _WORD.search(pattern)
            values = (self.names | {"medium": (medium,)})[word[1]] if word else ("",)
            found += [f"{FOLDER}/{_WORD.sub(value, pattern)}" for value in values]
        return tuple(path for path in found if written is None or path in written)

    def logs(self, medium: str) -> dict[str, str]:
        """SHA-256 of the logs of a medium, empty where there is none; of runs of no medium for ``""``."""
        names = log_names(self.campaign, medium)
        new = [name for name in names if name not in self._digests]
        self._digests |= digests_of_files(self.campaign.raw, new, self._seen)
        return {name: self._digests[name] for name in names}

    def rows(self, medium: str) -> str:
        """Digest of the rows of a medium, or of all."""
        if medium not in self._rows:
            self._rows[medium] = digest_of(medium, rows_of(self.campaign, medium))
        return self._rows[medium]

    @cached_property
    def all_logs(self) -> dict[str, str]:
        """SHA-256 of every log that the campaign names."""
        media = (*self.names["media"], "")
        return {name: digest for medium in media for name, digest in self.logs(medium).items()}

    @cached_property
    def robot_digests(self) -> dict[str, str]:
        """SHA-256 of the robot's own file, sheet and tracks."""
        return digests_of_files(self.root, robot_files(self.campaign), self._seen)

    def code(self, run: str, *, logs: bool = False) -> str:
        """Digest of the code of a function and all that it imports."""
        origins = [*self.dialects.values()] if logs else []
        code = code_digest(run.partition(":")[0], *(one.module for one in origins))
        return digest_of(code, [f"{one.package} {one.version}" for one in origins])

    @cached_property
    def dialects(self) -> dict[str, Origin]:
        """Dialects of other packages that the logs are read with."""
        config = self.campaign.config
        named = {config.dialect, config.force_log.dialect, config.motion_log.dialect}
        wanted = [name for name in named if name not in (None, "rig")]
        if not wanted:
            return {}
        # slow to import, and most campaigns have the rig's own logs
        from rftfit.logs.registry import origins

        return origins(wanted)

    def save(self) -> None:
        """Remember the digests of the logs for the next run."""
        self._seen.save()

    # --- what Snakemake asks

    def inputs(self, stage: str) -> list[str]:
        """Results that a stage reads. Logs are not among them: they are watched by content."""
        return list(
            dict.fromkeys(path for task in self.stages.get(stage, []) for path in task.reads)
        )

    def outputs(self, stage: str) -> list[str]:
        """Results that a stage writes."""
        return [path for task in self.stages.get(stage, []) for path in task.writes]

    def state(self, stage: str) -> str:
        """Digest of everything that the results of a stage depend on besides its inputs."""
        return digest_of([[task.key, task.depends] for task in self.stages.get(stage, [])])

    # --- what is out of date

    def records(self, stage: str) -> Records:
        """Records of the tasks of a stage."""
        if stage not in self._records:
            self._records[stage] = Records.load(self.root, stage)
        return self._records[stage]

    def digests(self, paths: Sequence[str]) -> dict[str, str]:
        """SHA-256 of results as they are now; empty for one that is not there."""
        return digests_of_files(self.root, paths, self._results)

    def findings(self, task: Task) -> list[Finding]:
        """What is not as recorded about a task; empty where its results are up to date."""
        record = self.records(task.stage).tasks.get(task.key)
        if record is None:
            return [Finding(task, "new")]
        now = self.digests([*record.writes, *task.reads])
        found = [
            Finding(task, "edited" if now[path] else "missing", path, digest)
            for path, digest in record.writes.items()
            if now[path] != digest
        ]
        found += [
            Finding(task, "changed", what, was)
            for what in dict.fromkeys([*record.depends, *task.depends])
            if (was := record.depends.get(what, "")) != task.depends.get(what, "")
        ]
        if set(record.reads) != set(task.reads) or set(task.writes) - set(record.writes):
            found.append(Finding(task, "changed", "files"))
        found += [
            Finding(task, "input", path, digest)
            for path, digest in record.reads.items()
            if path in now and now[path] != digest
        ]
        return found

    def all_findings(self) -> Iterator[Finding]:
        """Findings of every task, in the order of the data's way."""
        for name in self.default:
            for task in self.stages[name]:
                yield from self.findings(task)

    @cached_property
    def maker(self) -> dict[str, Task]:
        """The task that writes each result."""
        return {
            path: task for tasks in self.stages.values() for task in tasks for path in task.writes
        }

    def others(self) -> list[str]:
        """Files below ``results/`` that no task writes: of a medium or figure of before, or a user's own."""
        ours = set(self.maker)
        for name, tasks in self.stages.items():
            records = Records.load(self.root, name).tasks  # of now: jobs may have written since
            # a figure of several pages writes more than it promises
            ours.update(
                path for task in tasks if (one := records.get(task.key)) for path in one.writes
            )
        found = (self.root / FOLDER).rglob("[!.]*")
        files = (path for path in found if path.is_file())
        names = (path.relative_to(self.root).as_posix() for path in files)
        return sorted(name for name in names if name not in ours and not name.startswith(_KEPT))


# --- what results depend on outside of ``results/``


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """Logs that a medium is measured from, relative to the raw folder; some may not exist.

    `medium`: Empty for the runs that belong to none.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unclaimed
    names = {name for run in runs for name in (run.force_log, run.motion_log, run.zero_log)} - {""}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    if names and campaign.config.force_log.calibration is not None:
        names.add(campaign.config.force_log.calibration)
    bags = [name.removesuffix(BAG) for name in names if name.endswith(f"/{BAG}")]
    parts = (bag + path.name for bag in bags for path in (campaign.raw / bag).glob("*.*"))
    return sorted(names.union(parts))


def digests_of_files(folder: Path, names: Iterable[str], seen: Seen) -> dict[str, str]:
    """SHA-256 of files by name, relative to a folder; empty where there is no such file."""
    paths = {f"{folder}/{name}": name for name in names}
    return {paths[path]: digest for path, digest in seen.digests(paths).items()}


def robot_files(campaign: Campaign) -> list[str]:
    """The robot's own file, its sheet and its tracks, so far as they exist, from the campaign's folder."""
    robot = campaign.config.robot
    if robot is None or not campaign.robot_medium:
        return []
    paths = [campaign.root / robot.file] if robot.file else []
    if robot.runs is not None:
        from rftfit.workflow.robot import trials_of

        sheet = campaign.raw / robot.runs
        paths += [sheet, *(sheet.parent / trial.track for trial in trials_of(campaign))]
    return sorted(
        {path.resolve().relative_to(campaign.root).as_posix() for path in paths if path.is_file()}
    )


def rows_of(campaign: Campaign, medium: str) -> list[list[str]]:
    """Cells of a medium's rows of the run sheet, or of all; order and numbers of rows do not count."""
    runs = campaign.runs_of(medium) if medium else campaign.runs
    # whether they are recordings at all is told beside the whole
    origin = [] if medium else [[f"re-enacted: {campaign.reenacted}"]]
    return origin + sorted(
        [*cells(run).values(), *(str(row) for row in campaign.numbers.get(run.run_id, ()))]
        for run in runs
    )


def cells(run: Run) -> dict[str, str]:
    """What counts of a row of the run sheet, as text by column."""
    return {
        name: _text(getattr(run, name))
        for name in run.__dataclass_fields__
        if name not in _LEFT_OUT
    }


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)
