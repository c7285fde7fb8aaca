"""Command of one job of the workflow, from its inputs to its files and record; Snakemake starts it, not people.

A job is a rule (such as ``slopes``) with one value of its wildcard, here called key (such as a medium). Its *state* is a
dict from ``code``, ``settings``, ``rows``, ``order``, ``logs``, ``robot files`` to a digest: what its results depend on
besides the files that it reads. When Snakemake plans the job, the state of that moment is written to
``results/state/RULE/KEY.json``. The *record* of a finished job holds its state and the SHA-256 of all files that it read and
wrote. A record has to be true: so a job refuses inputs that were edited, and a state that changed since it was planned.

Paths of inputs and outputs are text, relative to the campaign's folder, as ``results/runs/poppy_LP.csv``.
"""

from __future__ import annotations

import os

# the bytes of a result must not depend on how many threads linear algebra has; jobs share the cores anyway
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import contextlib
import gc
import sys
from collections.abc import Sequence
from importlib import import_module
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import pandas as pd

from rftfit.errors import InputError, RftfitError
from rftfit.figures.style import PAPER, SCREEN, save_pages
from rftfit.results import Results
from rftfit.store import open_growing, write_bytes, write_csv, write_parquet, write_text
from rftfit.store.digests import digests_of_files, plugin_digest, source_digests
from rftfit.workflow.processes import end_with, end_with_parent
from rftfit.workflow.records import Record, maker_of, read_state, split_inputs
from rftfit.workflow.state import States, job_of, read_states


def main(words: Sequence[str] | None = None, states: States | None = None) -> int:
    """Do the job that the command line names; return 0, or the exit code of the error that it reports.

    `words`: Arguments of the command; default: those of this process. `states`: The campaign with the states of its jobs,
    where the process has read it already; None: it is read from ``--config``.
    """
    parser = argparse.ArgumentParser("python -P -m rftfit.workflow.job", allow_abbrev=False)
    parser.add_argument("state", help="file of the job's state, which names rule and medium")
    parser.add_argument("--config", type=Path, default=Path("config/config.yaml"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--reads", nargs="*", default=[])
    parser.add_argument("--writes", nargs="+", required=True)
    job = parser.parse_args(words)
    # figures and tables are many objects that live long: looking for garbage among them took a tenth of the time
    gc.set_threshold(50_000, 20, 50)
    try:
        do_job(states or read_states(job.config), job.reads, job.writes, job.threads)
    except RftfitError as error:
        _report(f"rftfit {' '.join(job_of(job.state)).rstrip()}: {error}\n")
        return error.exit_code
    return 0


def _report(message: str) -> None:
    """Write to standard error; where that is a file on a full disk, to standard output."""
    try:
        sys.stderr.write(message)
        sys.stderr.flush()
    except OSError:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.write(message)
            sys.stdout.flush()
            # at its exit Python tries again to write what is left in the stream: a failure would change the exit status
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def do_job(states: States, reads: Sequence[str], writes: Sequence[str], threads: int = 1) -> None:
    """Do a job: call its stage, write the files, then the record.

    Nothing is written where an input is not as recorded, or the state is not the planned one before or after the work.
    `reads`: Paths of its inputs, one of which is the file of its state. `writes`: Paths of its outputs. `threads`: Most
    threads that the stage may use.
    """
    results = Results(states.campaign)
    state_path, inputs = split_inputs(reads)
    rule, key = job_of(state_path)
    if not states.has_job(rule, key):
        raise InputError(f"{state_path}: this campaign has no such job")
    stage, wildcard_value = states.stage(rule, key)
    state = states.state_of(rule, key)
    _refuse_other_state(results.root / state_path, state)
    digests = _refuse_edited_inputs(results.root, inputs)
    module, _, function_name = stage.run.partition(":")
    function = getattr(import_module(module), function_name)
    # few stages take these: those that name them among their parameters
    offered: dict[str, Any] = {"threads": threads, "states": states}
    arguments = {name: value for name, value in offered.items() if name in function.__annotations__}
    # a stage can read nothing but the inputs that its rule names: else its record would lack a file
    output = function(results.only(inputs), *filter(None, [wildcard_value]), **arguments)
    # code that was imported, or a log that was read, may have been edited during the work: all digests are made again
    source_digests.cache_clear()
    plugin_digest.cache_clear()
    _refuse_other_state(results.root / state_path, States(states.campaign).state_of(rule, key))
    written = write_all(results, writes, output)
    Record(rule, key, state, digests, digests_of_files(results.root, written)).save(results.root)


def _refuse_other_state(path: Path, now: dict[str, str]) -> None:
    """Raise where the state of a job, as it is `now`, is not the planned one, which the file at `path` holds."""
    planned = read_state(path)
    changed = [what for what in now if now[what] != planned.get(what)]
    if changed:
        raise RftfitError(
            f"while the workflow ran, this changed: {', '.join(changed)}. Nothing was written, since "
            "nobody could say what it was made from; run again"
        )


def _refuse_edited_inputs(root: Path, paths: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of the results that a job reads, by path; refuse one that is not as the job that wrote it recorded.

    So a table that was edited by hand cannot get into later results.
    """
    digests = digests_of_files(root, paths)
    # by path: digests from the records of the jobs that wrote these files
    recorded: dict[str, str] = {}
    for path in paths:
        if path not in recorded and (record := maker_of(root, path)):
            recorded |= record.writes
        if recorded.get(path, "") != digests[path]:
            raise InputError(
                f"{path}: not as the job that made it wrote it (edited or damaged); "
                "`rftfit run` makes it again"
            )
    return digests


def write_all(results: Results, writes: Sequence[str], output: Any) -> list[str]:
    """Write the output of a stage, and return the paths written.

    `writes`: Paths of the rule's outputs. `output`: What the stage returned: for a rule that draws, a figure or its pages,
    else one content (bytes, text or table), or a tuple with one for each path. Pages of a figure may be more files than
    `writes` names.
    """
    base, _, ending = writes[0].rpartition(".")
    if ending in (*SCREEN, *PAPER):
        is_simulated = results.campaign.reenacted
        note = "Made from simulated logs, not from recordings." if is_simulated else ""
        return save_pages(output, results.root, base, note, SCREEN if ending in SCREEN else PAPER)
    contents = output if isinstance(output, tuple) else (output,)
    for path, content in zip(writes, contents, strict=True):
        target = results.root / path
        if isinstance(content, bytes):
            write_bytes(target, content)
        elif isinstance(content, str):
            write_text(target, content)
        elif isinstance(content, pd.DataFrame):
            (write_parquet if target.suffix == ".parquet" else write_csv)(content, target)
        else:
            raise TypeError(f"{path}: cannot write {type(content).__name__}")
    return list(writes)


def run_forked(words: Sequence[str], log: str, folder: str) -> None:
    """Do a job in this process, which was forked from one that has imported `rftfit.workflow.preload`; then end it.

    A forked process need not import anything, which takes longer than most jobs. Never returns: the process ends with the
    exit status of `main`, with 1 after an unexpected error, or when Snakemake, which has asked for the job, ends.

    `words`: Arguments as in `main`. `log`: Path of the file for standard error. `folder`: The campaign's folder.
    """
    preloaded = sys.modules["rftfit.workflow.preload"]
    starter = parent_process()
    assert starter is not None
    assert starter.pid is not None
    end_with(starter.pid)
    os.chdir(folder)
    with open_growing(log) as errors:
        # 2 is the number of standard error
        os.dup2(errors.fileno(), 2)
    status = 1
    try:
        status = main(words, preloaded.campaign_states())
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:  # noqa: BLE001
        sys.excepthook(*sys.exc_info())
    finally:
        # a normal exit would spend half a second on clearing up imported modules
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


if __name__ == "__main__":
    end_with_parent()
    sys.exit(main())
