"""How far a workflow is: a bar in a terminal, one short line per job in a pipe or file."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Protocol, Self

from rftfit.cli.output import say

if TYPE_CHECKING:
    from types import TracebackType

    from rich.console import Console

    from rftfit.cli.snakemake_output import Job, Watcher


class Display(Protocol):
    """Shows jobs as they finish."""

    def __enter__(self) -> Self:
        """Begin."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End."""

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line.

        Parameters
        ----------
        watcher : Watcher
        finished : Job or None
            The job that this line says is finished.
        """


class Lines:
    """One line per finished job, with its count."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line.

        Parameters
        ----------
        watcher : Watcher
        finished : Job or None
        """
        if finished is not None:
            width = len(str(watcher.total))
            say(f"[{watcher.done:{width}d}/{watcher.total}] {finished.title}")


class Bar:
    """A bar with the count, the time, and the job that finished last.

    Parameters
    ----------
    console : rich.console.Console, optional
        Default: standard output.
    """

    def __init__(self, console: Console | None = None) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
        from rich.progress import TimeElapsedColumn as Elapsed

        self._progress = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            Elapsed(),
            # a medium's name is no markup
            TextColumn("{task.description}", markup=False),
            console=console,
        )
        self._task = self._progress.add_task("looking what has to be done", total=None)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def update(self, watcher: Watcher, finished: Job | None) -> None:
        """Show the state after one line.

        Parameters
        ----------
        watcher : Watcher
        finished : Job or None
        """
        if finished is not None:
            failed = f", {len(watcher.failures)} failed" if watcher.failures else ""
            self._progress.update(self._task, description=f"{finished.title}{failed}")
        if watcher.total:
            self._progress.update(self._task, total=watcher.total, completed=watcher.done)


def display() -> Display:
    """Return the display that suits standard output.

    Returns
    -------
    Display
    """
    return Bar() if sys.stdout.isatty() else Lines()
