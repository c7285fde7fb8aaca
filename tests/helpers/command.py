"""The command `rftfit` in this process: the one inner name that contract, laws and golden may use."""

import contextlib
import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rftfit.cli.main import main


@dataclass(frozen=True)
class Answer:
    """What a command has printed, and its exit code."""

    code: int
    out: str
    error: str

    @property
    def content(self) -> Any:
        """Standard output as JSON; numbers that JSON does not know are refused."""
        return json.loads(self.out, parse_constant=_refuse)


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")


def rftfit_command(*words: object, folder: Path | None = None) -> Answer:
    """Run a command, from a folder if one is given; no traceback is ever printed."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.ExitStack() as around:
        if folder is not None:
            around.callback(os.chdir, Path.cwd())
            os.chdir(folder)
        around.enter_context(contextlib.redirect_stdout(out))
        around.enter_context(contextlib.redirect_stderr(error))
        code = main([str(word) for word in words])
    answer = Answer(code, out.getvalue(), error.getvalue())
    assert "Traceback" not in answer.out + answer.error
    return answer
