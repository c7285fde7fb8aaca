"""Executor plug-in of Snakemake, ``--executor rftfit``: how jobs are started here, and which are not done again.

A job of rftfit is one use of a rule, done by the command `rftfit.workflow.job`. To import what it needs takes longer than
most jobs: so jobs are forked from a process that has imported it (`rftfit.workflow.preload`). A planned job whose record
still holds, because its inputs are newer and yet the same, is skipped. On a cluster a batch job, in which Snakemake runs
once more, may hold several jobs (a group): these are forked, too. Snakemake finds its plug-ins by the name of this package.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing import connection, get_context
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from snakemake.exceptions import WorkflowError
from snakemake.executors.local import Executor as LocalExecutor
from snakemake.executors.local import common_settings
from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry
from snakemake_interface_executor_plugins.settings import ExecutorSettingsBase

from rftfit.store.files import set_time
from rftfit.workflow.job import run_forked
from rftfit.workflow.records import record_holds
from rftfit.workflow.stages import RULES_TO_COME
from rftfit.workflow.state import HANDED, States, hand_over

__all__ = ["Executor", "ExecutorSettings", "common_settings", "fork_in_batch_jobs"]


@dataclass
class ExecutorSettings(ExecutorSettingsBase):  # type: ignore[misc]
    """Holds no setting. Snakemake makes the settings early, so the process to fork from begins its imports here."""

    def __post_init__(self) -> None:
        # not at the top: Windows, where Snakemake imports this module too, does not have it
        from multiprocessing import forkserver

        get_context("forkserver").set_forkserver_preload(["rftfit.workflow.preload"])
        forkserver.ensure_running()


_COMMAND = ["python", "-P", "-m", "rftfit.workflow.job"]
"""First words of the shell command of a job of rftfit, as the rules state it."""


class Executor(LocalExecutor):  # type: ignore[misc]
    """Runs jobs as Snakemake's local executor does, but forks or skips those of rftfit."""

    def run_single_job(self, job: Any) -> Future[None]:
        """Fork a job of rftfit, or skip it where its record still holds; run any other job in a shell.

        `job`: As Snakemake has planned it. Snakemake waits for the returned future; an error in it is a failed job.
        """
        words = shlex.split(job.shellcmd or "")
        if words[: len(_COMMAND)] != _COMMAND:
            return super().run_single_job(job)  # type: ignore[no-any-return]
        # paths of its outputs as plain texts
        outputs = job.output._plainstrings()
        if not self.dag.reason(job).forced and record_holds(Path(), map(str, job.input), outputs):
            for path in outputs:
                set_time(path)  # a new time, so that Snakemake does not plan the job again
            self.logger.info("still right", extra={"skipped": job.jobid})
            finished = Future[None]()
            finished.set_result(None)
            return finished
        # as before any job: folders of its outputs are made, and old outputs are deleted
        self.workflow.async_run(job.prepare())
        log, folder = str(job.log[0]), str(Path.cwd())
        # what stands before the redirection of errors to the log: arguments of the command
        job_words = words[len(_COMMAND) : words.index("2>")]
        forked: Future[None] = self.pool.submit(_fork_and_wait, job_words, log, folder)
        return forked


class BatchExecutor(Executor):
    """Runs jobs inside of a batch job of a cluster: forks those of a group, and runs a single one in a shell."""

    states: States
    """States of the campaign that Snakemake has read, so that the jobs need not read it again."""

    def __post_init__(self) -> None:
        """Start the process that the jobs of a group are forked from; a single job is started faster by itself."""
        super().__post_init__()
        targets = self.workflow.dag_settings.target_jobs
        self.forks = sys.platform == "linux" and len(targets) > 1
        if self.forks:
            self.campaign_file = TemporaryFile(buffering=0)  # noqa: SIM115
            os.environ[HANDED] = hand_over(self.states, self.campaign_file)
            os.environ[RULES_TO_COME] = " ".join(dict.fromkeys(job.rulename for job in targets))
            # starts that process
            ExecutorSettings()

    def run_single_job(self, job: Any) -> Future[None]:
        """Fork a job where the batch job holds several; else run it in a shell; `job`, result: as in `Executor`."""
        executor = Executor if self.forks else LocalExecutor
        return executor.run_single_job(self, job)


def fork_in_batch_jobs(states: States) -> None:
    """Make the Snakemake inside of a batch job fork the jobs of rftfit, too: replace its local executor.

    There Snakemake takes its local executor, whatever ``--executor`` said. `states`: The campaign, as Snakemake has read it.
    """
    BatchExecutor.states = states
    ExecutorPluginRegistry().get_plugin("local").executor = BatchExecutor


_LOCK = threading.Lock()
"""Held while a process is started or joined: `multiprocessing` polls all children when it starts one."""


def _fork_and_wait(words: list[str], log: str, folder: str) -> None:
    """Fork one job and wait for its end; raise where it fails.

    `words`: Arguments of its command. `log`: Path of the file for its errors. `folder`: The campaign's folder.
    """
    with _LOCK:
        child = get_context("forkserver").Process(target=run_forked, args=(words, log, folder))
        child.start()
    connection.wait([child.sentinel])
    with _LOCK:
        child.join()
    if child.exitcode:
        command = shlex.join([*_COMMAND, *words])
        raise WorkflowError(str(subprocess.CalledProcessError(child.exitcode, command)))
