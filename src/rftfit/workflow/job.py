"""``python -P -m rftfit.workflow.job STATE``: one job of the workflow, from its inputs to its outputs and its record.

People use the ``rftfit`` command instead.
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
from rftfit.workflow.records import Record, maker_of, read_fingerprint, split
from rftfit.workflow.state import States, job_of, read_states


def main(words: Sequence[str] | None = None, states: States | None = None) -> int:
    """Do one job; return 0, or the exit code of the error that it reports.

    `states`: Of the campaign, where it was read already.
    """
    parser = argparse.ArgumentParser("python -P -m rftfit.workflow.job", allow_abbrev=False)
    parser.add_argument("state", help="file of the job's state, which names rule and medium")
    parser.add_argument("--config", type=Path, default=Path("config/config.yaml"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--reads", nargs="*", default=[])
    parser.add_argument("--writes", nargs="+", required=True)
    job = parser.parse_args(words)
    # figures and tables are many objects that live long: to look for garbage among them took a tenth
    # of the time
    gc.set_threshold(50_000, 20, 50)
    try:
        do_job(states or read_states(job.config)[0], job.reads, job.writes, job.threads)
    except RftfitError as error:
        _say(f"rftfit {' '.join(job_of(job.state)).rstrip()}: {error}\n")
        return error.exit_code
    return 0


def do_job(states: States, reads: Sequence[str], writes: Sequence[str], threads: int = 1) -> None:
    """Do a job and record it: its state has to be the planned one before the work and after it."""
    results = Results(states.campaign)
    planned, inputs = split(reads)
    rule, key = job_of(planned)
    if not states.has(rule, key):
        raise InputError(f"{planned}: this campaign has no such job")
    stage, word = states.stage(rule, key)
    state = states.of(rule, key)
    _check_state(results.root / planned, state)
    digests = _checked_inputs(results.root, inputs)
    module, _, name = stage.run.partition(":")
    function = getattr(import_module(module), name)
    arguments: dict[str, Any] = {"threads": threads, "states": states}
    function_arguments = {
        word: arguments[word] for word in arguments if word in function.__annotations__
    }
    output = function(results.only(inputs), *([word] if word else []), **function_arguments)
    # code that was imported meanwhile, or a log that was read, may be another by now
    source_digests.cache_clear()
    plugin_digest.cache_clear()
    _check_state(results.root / planned, States(states.campaign).of(rule, key))
    written = write_all(results, writes, output)
    Record(rule, key, state, digests, digests_of_files(results.root, written)).save(results.root)


def _check_state(path: Path, now: dict[str, str]) -> None:
    """Refuse to work in another state than that which was planned."""
    planned = read_fingerprint(path)
    changed = [what for what in now if now[what] != planned.get(what)]
    if changed:
        raise RftfitError(
            f"while the workflow ran, this changed: {', '.join(changed)}. Nothing was written, since "
            "nobody could say what it was made from; run again"
        )


def _checked_inputs(root: Path, paths: Sequence[str]) -> dict[str, str]:
    """SHA-256 of what a job reads; a result that no job wrote as it is now is refused."""
    digests = digests_of_files(root, paths)
    written: dict[str, str] = {}
    for path in paths:
        if path not in written and (record := maker_of(root, path)):
            written |= record.writes
        if written.get(path, "") != digests[path]:
            raise InputError(
                f"{path}: not as the job that made it wrote it (edited or damaged); "
                "`rftfit run` makes it again"
            )
    return digests


def write_all(results: Results, writes: Sequence[str], output: Any) -> list[str]:
    """Write what a job made. Returns the paths from the campaign's folder."""
    base, _, ending = writes[0].rpartition(".")
    if ending in (*SCREEN, *PAPER):
        about = (
            "Made from simulated logs, not from recordings." if results.campaign.reenacted else ""
        )
        endings = SCREEN if ending in SCREEN else PAPER
        return save_pages(output, results.root, base, about, endings)
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
    """Do a job in a process forked from one that has imported `rftfit.workflow.preload`; end as its parent ends."""
    preloaded = sys.modules["rftfit.workflow.preload"]
    starter = parent_process()
    assert starter is not None
    assert starter.pid is not None
    end_with(starter.pid)
    os.chdir(folder)
    with open_growing(log) as errors:
        os.dup2(errors.fileno(), 2)
    status = 1
    try:
        status = main(words, preloaded.campaign_states())
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:  # noqa: BLE001
        sys.excepthook(*sys.exc_info())
    finally:
        # to take down what was imported takes half a second, and nobody needs it
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


def _say(message: str) -> None:
    """Write to standard error; where that is a file on a full disk, to whoever listens."""
    try:
        sys.stderr.write(message)
        sys.stderr.flush()
    except OSError:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.write(message)
            sys.stdout.flush()
            # what waits in the stream is tried again at the very end, which would change the exit status
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


if __name__ == "__main__":
    end_with_parent()
    sys.exit(main())
