"""Run of an example, step by step: files laid out, commands run, published numbers judged, page written."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd

from rftfit.errors import WorkflowError
from rftfit.store import csv_bytes, write_bytes
from rftfit.store.environment import child_environment
from rftfit.suite.cells import fill_words, look_up
from rftfit.suite.declared import Example, parse_key
from rftfit.suite.files import lay_out
from rftfit.suite.page import PAGE, write_page
from rftfit.suite.verdicts import FILE, judge_example

Say = Callable[[str], None]
"""Function that is called with a line of text for the user."""


def run_example(
    example: Example, folder: Path, origin: str | None, say: Say, is_quiet: bool
) -> pd.DataFrame:
    """Copy or download the data of an example, run its commands, and judge each published number.

    Parameters
    ----------
    example : Example
    folder : Path
        Folder to run in; it becomes an ordinary campaign, or holds the tables that commands write.
    origin : str or None
        Folder, or address of a mirror, that has the data; None: the addresses of the example.
    say : callable
        Called with a line of text for each step.
    is_quiet : bool
        True hides the output of the commands, but not their errors.

    Returns
    -------
    pandas.DataFrame
        Verdicts, the rows of ``verdicts.csv``.

    Raises
    ------
    InputError
        If data are absent or not as published.
    WorkflowError
        If a command fails.
    """
    written = lay_out(example, folder, origin, say)
    if example.settings.files:
        size = sum(file.size for file in written) / 1e6
        files = f"{len(written)} of {len(example.settings.files)} files brought ({size:.1f} MB)"
        say(f"{files}; all are as published, by their sha256.")
    for command in example.commands:
        _run_command(example, folder, command, say, is_quiet)
    verdicts = judge_example(example, folder)
    write_bytes(folder / FILE, csv_bytes(verdicts))
    write_page(folder / PAGE, [example], verdicts)
    return verdicts


def _run_command(example: Example, folder: Path, command: str, say: Say, is_quiet: bool) -> None:
    """Run a command of rftfit in a folder, in a separate process, as a user would; raise WorkflowError if it fails.

    Names in braces in the command are replaced by numbers of earlier results (`settings.given` says where they stand).
    `say`, `is_quiet`: As in `run_example`.
    """
    numbers = {
        name: f"{look_up(folder, given, parse_key(given.key)):.6g}"
        for name, given in example.settings.given.items()
        if f"{{{name}}}" in command
    }
    words = shlex.split(fill_words(command, numbers))
    say(f"rftfit {' '.join(words)}")
    process = subprocess.run(  # noqa: S603
        [sys.executable, "-m", "rftfit", *words],
        cwd=folder,
        env=child_environment(),
        stdout=subprocess.DEVNULL if is_quiet else None,
        check=False,
    )
    if process.returncode:
        raise WorkflowError(
            f"{example.name}: rftfit {words[0]} ended with exit code {process.returncode}; its message stands above. "
            f"No verdict was written to {folder / FILE}"
        )
