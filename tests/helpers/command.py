"""The command `rftfit` in this process, as the installed program declares it: no inner name is imported."""

import json
from pathlib import Path

from campaign_maker import run_command


def answer_of(*words, folder=None):
    """Run a command; its exit code, standard output and standard error. It never prints a traceback."""
    completed = run_command(folder or Path.cwd(), *map(str, words))
    return completed.returncode, completed.stdout, completed.stderr


def json_of(*words, folder=None):
    """Run a command with ``--json`` that has to end with 0; what it prints, which must be JSON proper."""
    code, out, error = answer_of(*words, "--json", folder=folder)
    assert code == 0, error
    return json.loads(out, parse_constant=_refuse)


def refused(*words, folder=None):
    """Run a command whose input is refused: exit code 2, nothing on standard output; its message."""
    code, out, error = answer_of(*words, folder=folder)
    assert (code, out) == (2, ""), (code, out, error)
    assert error
    return error


def _refuse(constant):
    raise ValueError(f"{constant} is no JSON")
