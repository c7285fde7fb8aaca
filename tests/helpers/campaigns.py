"""Campaigns in folders of their own: small ones to be put wrong, of the re-enacted lab, of the home rig, of a watch."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import pandas as pd
import yaml
from makers import read_rows, run_command, write_rows, write_yaml
from matplotlib.axis import Axis
from pages import blocks_of, figure_faults, untrue, words
from paper import NOTHING, PROJECT, enact, few_draws, paper_values
from snakemake.api import SnakemakeApi
from snakemake.settings.types import (
    ConfigSettings,
    DAGSettings,
    OutputSettings,
    Quietness,
    ResourceSettings,
)

from rftfit.bench.watch import Watch
from rftfit.campaign.config import Config
from rftfit.campaign.load import check_campaign, load_campaign
from rftfit.figures import style
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import PlannedRun, plan_runs
from rftfit.lab.write import sheet_text
from rftfit.results import open_results
from rftfit.store.digests import digests_of_files
from rftfit.workflow.job import do_job
from rftfit.workflow.records import Record, Recorded, record_holds, split_inputs
from rftfit.workflow.stages import FIGURE_RULES, RULES
from rftfit.workflow.state import job_of, read_states

# --- Jobs of the workflow as Snakemake plans them, done in this process -------------------------------------------

SNAKEFILE = Path(__file__).resolve().parents[2] / "Snakefile"


@dataclass(frozen=True)
class Job:
    """One planned job; paths are from the campaign's folder, the file of its state among the inputs."""

    rule: str
    key: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]


def planned_jobs(config, targets=()):
    """All jobs that some results need, or all results, in an order in which they can be done.

    Their states are written. Snakemake plans campaigns once that are alike in all that the rules look at.
    """
    states = read_states(config)
    campaign = states.campaign
    plan_key = (
        campaign.media_with_runs,
        campaign.of_role("laboratory"),
        campaign.of_role("natural_sand"),
        campaign.robot_medium,
        campaign.config.clock.method,
        tuple((path, figure_state[1]) for path, figure_state in states.figures.items()),
        tuple(targets),
    )
    if plan_key not in _PLANS:
        _PLANS[plan_key] = _plan(config, campaign.root, targets)
    for job in _PLANS[plan_key]:
        states.write_state(job.rule, {"": job.key})
    return _PLANS[plan_key]


_PLANS: dict[tuple[object, ...], list[Job]] = {}


def _plan(config, root, targets):
    before, environment = Path.cwd(), dict(os.environ)
    try:
        quiet = OutputSettings(quiet={Quietness.ALL})
        with SnakemakeApi(quiet) as api:
            settings = ConfigSettings(
                config={"campaign": config.resolve().relative_to(root).as_posix()}
            )
            api_workflow = api.workflow(
                ResourceSettings(cores=1), settings, snakefile=SNAKEFILE, workdir=root
            )
            api_workflow.dag(DAGSettings(targets=set(targets), forceall=True))
            workflow: Any = api_workflow._workflow
            workflow.dag_settings = DAGSettings(targets=set(targets), forceall=True)
            workflow._prepare_dag(forceall=True, ignore_incomplete=True, lock_warn_only=True)
            workflow._build_dag()
            jobs_of_dag = [job for level in workflow.dag.toposorted() for job in level]
    finally:
        os.chdir(before)
        os.environ.clear()
        os.environ.update(environment)
    return [
        Job(
            job.rule.name,
            next(iter(job.wildcards), ""),
            tuple(map(str, job.input)),
            tuple(map(str, job.output)),
        )
        for job in jobs_of_dag
        if job.rule.name != "all"
    ]


def run_rules(config, *rules, last="", drawn=None):
    """Do the jobs of some rules (default: of all up to one) that are out of date; how many were done.

    `drawn`: names of the figures that are drawn, the others are files without content; default: all.
    """
    jobs, done_count = planned_jobs(config), 0
    if last:
        jobs = [job for job in jobs if RULES.index(job.rule) <= RULES.index(last)]
    states = read_states(config)
    root = states.campaign.root
    # a process that was forked digests the code once more after its job; no test of jobs in here edits code
    with patch("rftfit.workflow.job.source_digests"):
        for job in jobs:
            if (rules and job.rule not in rules) or record_holds(root, job.reads, job.writes):
                continue
            if job.rule in FIGURE_RULES and drawn is not None and _name(job) not in drawn:
                leave_blank(root, states, job)
            else:
                do_job(states, job.reads, job.writes)
            done_count += 1
    return done_count


def _name(job):
    return Path(job.writes[0]).stem


def _write_file(path, content):
    """Write a file in place of what is there, which may be a link to another one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.write_bytes(content)


def leave_blank(root, states, job):
    """Write the files of a figure without content, and their record."""
    planned, inputs = split_inputs(job.reads)
    for path in job.writes:
        _write_file(root / path, b"")
    digests = digests_of_files(root, inputs), digests_of_files(root, job.writes)
    Record(*job_of(planned), states.state_of(*job_of(planned)), *digests).save(root)


# --- A small campaign on disk that is right, to be put wrong in one place -----------------------------------------

CONFIG = """\
title: Test
raw: raw
run_sheet: runs.csv
transducer:
  name: sensor
  range_N: [65, 65, 200]
  axes: {x: "-F2", y: "+F1", z: "-F3"}
container: {length_cm: 24, width_cm: 22, depth_cm: 15}
intruders:
  plate: {shape: plate, length_cm: 3.81, width_cm: 2.54, thickness_cm: 0.64}
  disc: {shape: plate, length_cm: 2, width_cm: 2, thickness_cm: 0.64}
  c_leg: {shape: leg, curvature_times_R: 1, max_length_cm: 7.62, width_cm: 2.54, thickness_cm: 0.64, hip_height_cm: 2}
  flat_leg: {shape: leg, curvature_times_R: 0, max_length_cm: 7.62, width_cm: 2.54, thickness_cm: 0.64, hip_height_cm: 2}
media:
  poppy_LP: {title: "poppy seeds, loose"}
  poppy_CP: {title: "poppy seeds, close"}
"""


SHEET = """\
run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,depth_cm,tare_run
p1,plate,poppy_LP,plate,intrusion,30,45,,t1
t1,rod,poppy_LP,plate,intrusion,30,45,,
h1,plate,poppy_LP,plate,horizontal,30,0,2.54,th
th,rod,poppy_LP,plate,horizontal,30,0,2.54,
c1,leg,poppy_LP,c_leg,rotation,,,,a1
a1,leg_air,,c_leg,rotation,,,,
"""


@cache
def sheet_columns():
    """Return the columns of the run sheet of a new campaign."""
    with TemporaryDirectory() as folder:
        run_command(folder, "init", "new", expected_code=0)
        return Path(folder, "new", "config", "runs.csv").read_text("utf-8").strip().split(",")


class Room:
    """A campaign's folder; `rows` and `columns` can be changed before `check`."""

    def __init__(self, folder):
        self.folder = folder
        self.config = CONFIG
        self.columns = [*sheet_columns()]
        self.rows = {}
        for row in csv.DictReader(io.StringIO(SHEET)):
            self.rows["new"] = row
            self.add(row["run_id"], "new")
            del self.rows["new"]

    @property
    def path(self):
        return self.folder / "config" / "config.yaml"

    def touch(self, log):
        path = self.folder / "raw" / log
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("", encoding="utf-8")

    def add(self, name, like, **cells):
        """Add a run like another one, with log files of its own."""
        logs = {
            f"{quantity}_log": f"logs/{name}_{quantity}.csv" for quantity in ("force", "motion")
        }
        self.rows[name] = {**self.rows[like], "run_id": name, **logs, **cells}
        for log in logs.values():
            self.touch(log)

    def put(self, change):
        """Change cells of rows by name; ``new<old``: of a new row like an old one; None: without the row."""
        for name, cells in change.items():
            run_id, _, like = name.partition("<")
            if like:
                self.add(run_id, like)
            if cells is None:
                del self.rows[run_id]
            else:
                self.rows[run_id] |= cells

    def list_problems(self):
        """Code, row and column of every problem, and the problems."""
        problems = self.check()
        return [
            (problem.code, problem.place.row, problem.place.column) for problem in problems
        ], problems

    def text(self, delimiter=","):
        out = io.StringIO()
        writer = csv.writer(out, delimiter=delimiter, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows.values():
            writer.writerow([row.get(name, "") for name in self.columns])
        return out.getvalue()

    def write(self, sheet=None, name="runs.csv"):
        self.path.parent.mkdir(exist_ok=True)
        self.path.write_text(self.config.replace("runs.csv", name), encoding="utf-8")
        (self.folder / name).write_bytes(self.text().encode() if sheet is None else sheet)

    def check(self, sheet=None, name="runs.csv"):
        self.write(sheet, name)
        return check_campaign(self.path)[1]

    def only(self, code, sheet=None, name="runs.csv"):
        """The only problem, which must be of this code."""
        problems = self.check(sheet, name)
        assert [problem.code for problem in problems] == [code], "\n".join(map(str, problems))
        return problems[0]

    def campaign(self, sheet=None, name="runs.csv"):
        self.write(sheet, name)
        campaign, problems = check_campaign(self.path)
        assert campaign is not None, "\n".join(map(str, problems))
        return campaign


# --- Small campaigns of the re-enacted lab in a folder, and the chain of stages over them -------------------------

DEMONSTRATION = Path(__file__).parents[2] / "config" / "config.yaml"
# the demonstration's, without its robot: these rooms have no marker tracks
CONFIG_TEXT, _, _ = DEMONSTRATION.read_text(encoding="utf-8").partition("\nrobot:")
CONFIG_TEXT += "\n"
SEED = 2013


@cache
def paper():
    return Config(**yaml.safe_load(CONFIG_TEXT))


@cache
def planned():
    return {run.run_id: run for run in plan_runs(paper())}


def data_lines(content):
    """Data lines of a log: counted here, without the program."""
    if content is None:
        return 0
    lines = [line.strip() for line in content.removeprefix(b"\xef\xbb\xbf").splitlines()]
    return max(sum(bool(line) and not line.startswith(b"#") for line in lines) - 1, 0)


@dataclass
class RigRoom:
    """A campaign's folder with some of the paper's runs; `logs` may be changed before `write`."""

    folder: Path
    logs: dict[str, bytes | None] = field(default_factory=dict)
    runs: list[PlannedRun] = field(default_factory=list)
    cells: dict[str, dict[str, str]] = field(default_factory=dict)
    config: str = CONFIG_TEXT

    def add(self, *names, **faults):
        """Add runs with their tares; `faults` by run_id."""
        run_ids = dict.fromkeys(names)
        run_ids |= dict.fromkeys(planned()[name].tare_run for name in names)
        for name in run_ids:
            if not name or name in {run.run_id for run in self.runs}:
                continue
            run = planned()[name]
            self.runs.append(run)
            self.logs |= run_logs(run, paper(), SEED, faults.get(name, ()))
        return self

    def change(self, log, transform):
        content = self.logs[log]
        assert content is not None
        self.logs[log] = transform(content.decode()).encode()

    def set(self, run, **cells):
        """Change cells of one row of the sheet, named by the plan's run_id."""
        self.cells.setdefault(run, {}).update(cells)

    def rows(self):
        sheet = csv.DictReader(io.StringIO(sheet_text(self.runs, {})))
        return [{**row, **self.cells.get(row["run_id"], {})} for row in sheet]

    def write(self, order=list):
        """Write config, sheet and logs; the path of the config."""
        path = self.folder / "config" / "config.yaml"
        raw = self.folder / "raw" / "paper"
        for folder in (path.parent, raw):
            folder.mkdir(parents=True, exist_ok=True)
        path.write_text(self.config, encoding="utf-8")
        for name, content in self.logs.items():
            target = raw / name
            target.parent.mkdir(exist_ok=True)
            if content is not None:
                target.write_bytes(content)
        write_rows(raw / "runs.csv", order(self.rows()))
        return path

    def chain(self, medium="poppy_LP"):
        from measured import chain

        return chain(load_campaign(self.write()), medium)

    @property
    def names(self):
        return [run.run_id for run in self.runs]

    @property
    def counted(self):
        """Data lines of every log the sheet names."""
        return {name: data_lines(content) for name, content in self.logs.items()}


def digests(folder):
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }


# --- Campaigns in folders of their own, and the real workflow run on them -----------------------------------------

FEW = tuple((beta, gamma) for beta in (-30.0, 0.0, 30.0, 90.0) for gamma in (90.0, -90, 45, -45, 0))
"""Cells (beta, gamma) in degrees that tell the nine terms apart: 20 of the paper's 78."""


@dataclass(frozen=True)
class Folder:
    """A campaign's folder that the workflow runs in."""

    root: Path

    def snakemake(self, *words, cores=2):
        command = [
            sys.executable,
            "-m",
            "snakemake",
            "--snakefile",
            str(PROJECT / "Snakefile"),
            "--directory",
            str(self.root),
            "--cores",
            str(cores),
            *words,
        ]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def run(self, *words, cores=2):
        """Run the workflow by Snakemake alone, each stage in a process of its own."""
        completed = self.snakemake(*words, cores=cores)
        assert completed.returncode == 0, completed.stdout + completed.stderr
        return completed.stdout + completed.stderr

    def run_here(self, last="provenance", drawn=(), real_run=None):
        """Do the jobs up to a rule in this process: the same results, without starting Python for each.

        Only the figures of the names in `drawn` (None: all) are put together, and their words are looked at;
        the files of the others have no content. Of a figure that is put together the png holds its words, and
        the preview nothing; with `real_run`, they are those of `real_run`. What a whole campaign says must
        rest on its records.
        """
        # a campaign whose files are compared with those of a real run has all draws
        of_draws = few_draws() if real_run is None else contextlib.nullcontext()
        with of_draws, patch.object(style, "save", partial(_sketch, self, real_run)):
            run_rules(self.config, last=last, drawn=drawn)
        if last == "provenance":
            false_sentences = untrue(open_results(self.root))
            assert not false_sentences, "\n".join(false_sentences)

    def rftfit(self, *words):
        """Run a command in this process, from the campaign's folder."""
        return run_command(self.root, *map(str, words))

    @property
    def config(self):
        return self.root / "config" / "config.yaml"

    def stale(self):
        """Rules whose jobs are not as recorded by now, with the media or figures of these jobs."""
        keys_by_rule: dict[str, set[str]] = {}
        for finding in Recorded(read_states(self.config)).findings_of_targets():
            rule, _, key = finding.job.partition("/")
            keys_by_rule.setdefault(rule, set()).add(key)
        return keys_by_rule

    def table(self, name):
        """One result as a data frame; untyped, since cells may be of any kind."""
        return pd.read_csv(self.root / "results" / name)

    def digests(self):
        """Every result but logs, by path."""
        of_results = digests(self.root / "results")
        return {
            name: digest for name, digest in of_results.items() if "logs" not in Path(name).parts
        }

    def raw_digests(self):
        return digests(self.root / "raw")


def _sketch(folder, real_run, figure, base, about, endings):
    if real_run is None:
        faults = figure_faults(figure)
        assert not faults, f"{base.name}: {'; '.join(faults)}"
        with patch.object(Axis, "get_children", lambda axis: [axis.label, axis.offsetText]):
            # without the numbers of ticks, which are made when they are asked for
            written = "\n".join([about, *words(figure)]).encode()
    for ending in endings:
        target = base.with_name(f"{base.name}.{ending}")
        if real_run is None:
            content = written if ending == "png" else b""
        else:
            content = (real_run.root / target.relative_to(folder.root)).read_bytes()
        _write_file(target, content)


def make_campaign(
    root, media=(), faults=(), *, plates_only=False, robot=True, directions=None, sizes=NOTHING
):
    """Write the demonstration campaign, or a part of it, into a new folder.

    Parameters
    ----------
    root : Path
    media : tuple of str, optional
        Only these; the robot stays where its medium does, with coarse steps and elements.
    faults : tuple of str, optional
        As for `rftfit.lab.reenact`.
    plates_only : bool, optional
        Without legs and robot.
    robot : bool, optional
        With the robot.
    directions : sequence of (float, float), optional
        (beta, gamma) of the plates, deg; default: all of the paper.
    sizes : dict of float, optional
        Of disturbances, by name.
    """
    values = paper_values()
    values["media"] = {name: values["media"][name] for name in media or values["media"]}
    # a quarter of the draws: how well intervals hold is tested elsewhere
    values["fourier"]["draws"] = 500
    if plates_only or not robot or values["robot"]["medium"] not in values["media"]:
        del values["robot"]
    else:
        robot = yaml.safe_load((PROJECT / "config" / "robot.yaml").read_text(encoding="utf-8"))
        robot["numerics"] |= {"step_s": 0.002, "elements": 8}
        values["robot"]["file"] = "config/robot.yaml"
        write_yaml(root / "config" / "robot.yaml", robot)
    if plates_only:
        shapes = values["intruders"].items()
        values["intruders"] = {name: shape for name, shape in shapes if shape["shape"] == "plate"}
    enact(root, values, sizes, directions=directions, faults=faults)
    return Folder(root)


# --- The home rig of the documentation ----------------------------------------------------------------------------
# The home rig of the documentation: its made logs, its sheet and its config, and what it knows to be true.

PAGE = "docs/howto/home-rig.md"
_BLOCKS = blocks_of(PAGE)
SCRIPT = next(block.text for block in _BLOCKS if block.language == "python")
FILES = {block.marks["file"]: block.text for block in _BLOCKS if "file" in block.marks}


def lay_out_home_rig(folder, monkeypatch, **changes):
    """Follow the page in `folder` up to the config; the campaign's folder, and the names of its script.

    `changes`: Texts of the script and what stands in their place.
    """
    monkeypatch.chdir(folder)
    run_command(folder, "init", "home rig", expected_code=0)
    script = SCRIPT
    for old, new in changes.get("script", {}).items():
        assert old in script
        script = script.replace(old, new)
    names: dict[str, object] = {}
    exec(script, names)  # noqa: S102
    for name, text in FILES.items():
        Path(name).write_text(text, encoding="utf-8")
    return Path(folder, "home rig"), names


# --- A campaign that grows, and a watch that looks at it in a time of its own -------------------------------------

DIRECTIONS = ((0.0, 90.0), (30.0, 45.0), (-30.0, 45.0), (60.0, 90.0), (30.0, -45.0), (0.0, 0.0))
MEDIUM = "poppy_LP"


def lay_bench(root, recorded):
    """A campaign before its first run, for which everything is recorded: no log is there."""
    shutil.copytree(recorded / "config", root / "config")
    (root / "raw" / "paper").mkdir(parents=True)
    return Bench(root, recorded)


class Bench:
    """Rows and logs of `recorded` are put into `root`; `rows` are those of the run sheet, by run_id."""

    def __init__(self, root, recorded):
        self.root, self.config, self.recorded = root, root / "config" / "config.yaml", recorded
        recorded_rows = read_rows(recorded / "raw" / "paper" / "runs.csv")
        self.every = {row["run_id"]: row for row in recorded_rows}
        self.rows = {}
        self.raw, self.time = root / "raw" / "paper", 0.0
        self.sheet = self.raw / "runs.csv"

    @property
    def plates(self):
        return [name for name, row in self.every.items() if row["kind"] == "plate"]

    def write_sheet(self):
        write_rows(self.sheet, self.rows.values(), names=next(iter(self.every.values())))

    def logs(self, name):
        return [self.every[name][f"{kind}_log"] for kind in ("force", "motion")]

    def content(self, log):
        return (self.recorded / "raw" / "paper" / log).read_bytes()

    def put(self, log, content=None):
        path = self.raw / log
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(self.content(log) if content is None else content)

    def push(self, *names, tare=True):
        """Record runs whole: their rows, their logs, and those of their tares."""
        for name in names:
            for run_id in [self.every[name]["tare_run"]] * tare + [name]:
                self.rows[run_id] = dict(self.every[run_id])
                for log in self.logs(run_id):
                    self.put(log)
        self.write_sheet()

    def watch(self):
        self.write_sheet()
        return Watch(self.config)

    def collect_events(self, watch, times=1):
        """Let half a second pass before each look; all events."""
        events = []
        for _ in range(times):
            self.time += 0.5
            events += watch.step(self.time)
        return events

    def settle(self, watch):
        """Look until everything is still: config and sheet, then logs that are asked every fourth time."""
        return self.collect_events(watch, 10)
