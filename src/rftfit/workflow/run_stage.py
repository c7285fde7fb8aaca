"""``python -P -m rftfit STAGE``: do those tasks of a stage that are out of date, and record them."""

from __future__ import annotations

import importlib
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from functools import cache
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError
from rftfit.workflow.plan import Plan, Record, Task
from rftfit.workflow.processes import end_with_parent

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rftfit.results import Results


def run_stage(config: Path, stage: str, threads: int = 1) -> int:
    """Bring the results of a stage up to date.

    Returns how many tasks were done; the others were up to date already.
    """
    plan = Plan(config)
    if stage not in plan.stages:
        raise InputError(f"no stage {stage!r}; allowed: {', '.join(plan.stages)}")
    tasks = plan.stages[stage]
    records = plan.records(stage)
    waiting = [task for task in tasks if plan.findings(task)]
    # as they are before the work: a log may change meanwhile
    depends = {task.key: task.depends for task in waiting}
    for task in waiting:
        _check_inputs(plan, task)
    known = {task.key for task in tasks}
    records.tasks = {key: one for key, one in records.tasks.items() if key in known}
    for task, written in _finished(plan, waiting, threads):
        reads = plan.digests(task.reads)
        records.tasks[task.key] = Record(depends[task.key], reads, written)
        records.save()
    if not waiting:
        records.save()
    for task in tasks:
        # what was up to date already counts as made now, so that Snakemake does not ask again
        for path in records.tasks[task.key].writes:
            with suppress(OSError):
                os.utime(plan.root / path)
    return len(waiting)


def _check_inputs(plan: Plan, task: Task) -> None:
    """Refuse a result that no stage wrote: an edit or damage must not be carried on."""
    now = plan.digests(task.reads)
    for path in task.reads:
        maker = plan.maker[path]
        record = plan.records(maker.stage).tasks.get(maker.key)
        if record is None or record.writes.get(path) != now[path]:
            raise InputError(
                f"{path}: not as the stage {maker.stage} wrote it (edited or damaged); "
                "`rftfit run` makes it again"
            )


def _finished(
    plan: Plan, tasks: Sequence[Task], threads: int
) -> Iterator[tuple[Task, dict[str, str]]]:
    """Do tasks, on several processes where there are several of both; the first error ends them."""
    workers = min(threads, len(tasks))
    if workers < 2:
        from rftfit.results import Results

        results = Results(plan.campaign)
        for task in tasks:
            yield task, do_task(results, plan.config, task, threads)
        return
    # where a fork is safe, the children have their imports already
    how = get_context("fork" if sys.platform == "linux" else "spawn")
    pool = ProcessPoolExecutor(workers, how, initializer=end_with_parent)
    # child processes are told which process to outlive not
    os.environ["RFTFIT_PARENT"] = str(os.getpid())
    with pool:
        waiting = {pool.submit(_in_child, plan.config, task): task for task in tasks}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


@cache
def _results(config: Path) -> Results:
    from rftfit.campaign.load import load_campaign
    from rftfit.results import Results

    return Results(load_campaign(config))


def _in_child(config: Path, task: Task) -> dict[str, str]:
    return do_task(_results(config), config, task, 1)


def do_task(results: Results, config: Path, task: Task, threads: int) -> dict[str, str]:
    """Do one task. Returns the SHA-256 of what it wrote, by path from the campaign's folder."""
    from rftfit.store.digests import sha256_of

    results = results.only(task.reads)
    module, _, name = task.run.partition(":")
    function = getattr(importlib.import_module(module), name)
    words: dict[str, Any] = {}
    if "threads" in function.__annotations__:
        words["threads"] = threads
    if "plan" in function.__annotations__:
        words["plan"] = Plan(config)
    made = function(results, *([task.medium] if task.medium else []), **words)
    paths = write_all(results, task, made)
    return {path: sha256_of(results.root / path) for path in paths}


def write_all(results: Results, task: Task, made: Any) -> list[str]:
    """Write what a task made. Returns the paths from the campaign's folder."""
    import pandas as pd

    from rftfit.store import write_bytes, write_csv, write_parquet, write_text

    if task.writes[0].endswith(".png"):
        from rftfit.figures.style import save_pages

        about = (
            "Made from re-enacted logs, not from recordings." if results.campaign.reenacted else ""
        )
        return save_pages(made, results.root, task.writes[0].removesuffix(".png"), about)
    contents = made if isinstance(made, tuple) else (made,)
    for path, content in zip(task.writes, contents, strict=True):
        target = results.root / path
        if isinstance(content, bytes):
            write_bytes(target, content)
        elif isinstance(content, str):
            write_text(target, content)
        elif isinstance(content, pd.DataFrame):
            (write_parquet if target.suffix == ".parquet" else write_csv)(content, target)
        else:
            raise TypeError(f"{task}: {path}: cannot write {type(content).__name__}")
    return list(task.writes)
