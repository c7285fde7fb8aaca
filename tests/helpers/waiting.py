"""Waiting for other processes: for what they do, for what one of them makes for all, for commands in one child."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

# --- Waiting for what another process does: for long, since a busy machine is no fault of the program -------------

LONGEST_S = 600
"""Longest that a test waits for what takes a second on a quiet machine."""

ASLEEP_S = 900
"""How long a process sleeps that has to be ended by others before."""


def wait_for(condition):
    """Wait until a condition holds; an error if it does not in time."""
    deadline = time.monotonic() + LONGEST_S
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


# --- What one process of pytest-xdist makes and all read ----------------------------------------------------------


def make_once(tmp_path_factory, name, make):
    """Make a folder by ``make(folder)`` in the first process that asks for it; the others wait.

    Returns
    -------
    Path
        The folder, which nobody changes.
    """
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    folder, finished = base / name, base / f"{name} made"
    try:
        (base / f"{name} begun").mkdir()
    except FileExistsError:
        wait_for(finished.exists)
    else:
        make(folder)
        finished.touch()
    return folder


# --- Many commands in one child: Python starts once, as `rftfit` does, and imports once what they need ------------

RFTFIT = Path(sys.executable).with_name("rftfit")
"""The program as it is installed."""

_SCRIPT = """\
import contextlib, io, json, os, sys
from rftfit.cli.main import main
here = os.getcwd()
for words in json.loads(sys.argv[1]):
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = main(words)
    os.chdir(here)
    print(json.dumps([code, out.getvalue(), error.getvalue()]), flush=True)
"""


def run_commands(commands, cwd, script_folder, env=None):
    """Run commands one after the other in one child; code, stdout and stderr of each.

    `script_folder`: of the script that is started, which Python searches first, as it does that of `rftfit`.
    """
    script = script_folder / "commands.py"
    script_folder.mkdir(exist_ok=True)
    script.write_text(_SCRIPT, encoding="utf-8")
    completed = subprocess.run(
        [
            sys.executable,
            str(script),
            json.dumps([[str(word) for word in words] for words in commands]),
        ],
        cwd=cwd,
        env=env,
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=LONGEST_S,
    )
    assert completed.returncode == 0, completed.stdout + completed.stderr
    assert "Traceback" not in completed.stdout
    answers = [json.loads(line) for line in completed.stdout.splitlines()]
    assert len(answers) == len(commands)
    return [SimpleNamespace(returncode=c, stdout=out, stderr=error) for c, out, error in answers]
