"""Many commands in one child: Python starts once, as `rftfit` does, and imports once what they need."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from waiting import LONGEST_S

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
