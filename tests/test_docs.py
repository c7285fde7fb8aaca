"""The commands of the documentation do what it says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def blocks(page: str) -> list[str]:
    """Shell blocks of a page, in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(r"^```sh\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_tutorial_runs_in_an_empty_folder(tmp_path: Path) -> None:
    found = blocks("tutorial.md")
    assert len(found) == 3
    here = Path(sys.executable).parent
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", "\n".join(found)],
        cwd=tmp_path,
        env={**os.environ, "PATH": f"{here}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # an empty campaign is not ready, and says why; the field commands give their numbers
    assert "not yet" in done.stdout
    assert "zeta" in done.stdout
    assert "Traceback" not in done.stderr
    assert (tmp_path / "mylab" / "config" / "runs.csv").is_file()
