"""Jobs of the workflow as Snakemake plans them, done in this process."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from snakemake.api import SnakemakeApi
from snakemake.settings.types import (
    ConfigSettings,
    DAGSettings,
    OutputSettings,
    Quietness,
    ResourceSettings,
)

from rftfit.campaign.presence import root_of
from rftfit.store import write_bytes
from rftfit.store.digests import digests_of_files
from rftfit.workflow.job import do_job
from rftfit.workflow.records import Record, record_holds, split
from rftfit.workflow.stages import FIGURE_RULES, RULES
from rftfit.workflow.state import job_of, read_states

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
    states = read_states(config)[0]
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
        _PLANS[plan_key] = _plan(config, targets)
    for job in _PLANS[plan_key]:
        states.input_of(job.rule)({"": job.key})
    return _PLANS[plan_key]


_PLANS: dict[tuple[object, ...], list[Job]] = {}


def _plan(config, targets):
    root, before = root_of(config), Path.cwd()
    environment = dict(os.environ)
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
    root, states = root_of(config), read_states(config)[0]
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


def leave_blank(root, states, job):
    """Write the files of a figure without content, and their record."""
    planned, inputs = split(job.reads)
    for path in job.writes:
        write_bytes(root / path, b"")
    digests = digests_of_files(root, inputs), digests_of_files(root, job.writes)
    Record(*job_of(planned), states.of(*job_of(planned)), *digests).save(root)
