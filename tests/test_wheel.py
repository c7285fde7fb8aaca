"""The wheel holds everything that an installed program needs.

`make wheel` installs it and runs a campaign.
"""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FIND = "import rftfit; from rftfit.store.environment import shipped; print(rftfit.__file__, shipped('Snakefile'), sep='\\n')"
"""A program that prints the paths of the package and of its Snakefile."""


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    pytest.importorskip("hatchling")
    place = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "-d", str(place)]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    (wheel,) = place.glob("*.whl")
    with zipfile.ZipFile(wheel) as file:
        file.extractall(place / "site")
    return place / "site"


@pytest.mark.parametrize("folder", ["workflow", "profiles", "examples", "src/rftfit"])
def test_every_file_of_a_folder_is_in_the_wheel(unpacked, folder):
    inside = unpacked / folder.removeprefix("src/")
    if not folder.startswith("src/"):
        inside = unpacked / "rftfit" / "_workflow" / folder
    command = ["git", "-C", str(ROOT / folder), "ls-files", "-z"]
    listed = subprocess.run(command, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("this copy is no git checkout")
    names = [name for name in listed.stdout.split("\0") if name]
    assert names
    missing = [
        name for name in names if (ROOT / folder / name).exists() and not (inside / name).exists()
    ]
    assert not missing


def test_the_wheel_runs_its_own_workflow(unpacked, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(unpacked), "PYTHONSAFEPATH": "1"}
    command = [sys.executable, "-c", FIND]
    process = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stderr
    package, snakefile = map(Path, process.stdout.splitlines())
    assert package == unpacked / "rftfit" / "__init__.py"
    assert snakefile == package.parent / "_workflow" / "Snakefile"
    included = [
        line.split('"')[1]
        for line in snakefile.read_text("utf-8").splitlines()
        if line.startswith("include:")
    ]
    assert included
    assert all((snakefile.parent / name).is_file() for name in included)
