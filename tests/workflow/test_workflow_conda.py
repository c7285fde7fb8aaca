"""`snakemake --sdm conda` gives its jobs the project, also from a clone that is not installed.

Instead of conda a small program makes the environments, from the packages that are here; it knows
the words that Snakemake gives.
"""

import os
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import pytest
import yaml
from campaigns import make_campaign
from paper import PROJECT

CONDA = """#!/bin/sh
case "$1 $2" in
"info --json") echo '{"conda_prefix": "@BASE@", "platform": "linux-64"}' ;;
"config --get") echo '{"get": {"channel_priority": "strict"}}' ;;
"--version ") echo "conda 26.1.0" ;;
"clean -y") ;;
"env create")
    for word; do case "$word" in "$PWD"/*.yaml) file=$word ;; esac; done
    "@PYTHON@" -m venv --without-pip "${file%.yaml}"
    echo "@PACKAGES@" > "$(echo "${file%.yaml}"/lib/python*/site-packages)/packages.pth"
    ;;
*) echo "not expected: $*" >&2; exit 1 ;;
esac
"""
ACTIVATE = 'export PATH="$1/bin:$PATH"\n'
"""Script that makes an environment current."""
NOT_OF_JOBS = {"rich", "snakemake", "typer"}
"""What only the command line and Snakemake need."""


@pytest.fixture
def clone(tmp_path):
    """A copy of the project, and a Python with all that it needs but the project; a program in place of conda."""
    folder = tmp_path / "clone"
    folder.mkdir()
    names = ["Snakefile", "config", "profiles", "src", "workflow"]
    subprocess.run(["cp", "-r", *(str(PROJECT / name) for name in names), folder], check=True)
    packages = tmp_path / "packages"
    packages.mkdir()
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if "rftfit" not in path.name:
            (packages / path.name).symlink_to(path)
    python = tmp_path / "python"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", python], check=True)
    (place,) = python.glob("lib/python*/site-packages")
    (place / "packages.pth").write_text(f"{packages}\n", "utf-8")
    programs = tmp_path / "conda" / "bin"
    programs.mkdir(parents=True)
    text = CONDA.replace("@BASE@", str(programs.parent)).replace("@PACKAGES@", str(packages))
    (programs / "conda").write_text(text.replace("@PYTHON@", sys.executable), "utf-8")
    (programs / "conda").chmod(0o755)
    (programs / "activate").write_text(ACTIVATE, "utf-8")
    return folder


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="the program in place of conda is for a shell")
def test_jobs_in_an_environment_of_their_own_find_the_project(clone, tmp_path):
    campaign = make_campaign(tmp_path / "campaign", ("yuma",), plates_only=True)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment["PATH"] = f"{tmp_path / 'conda' / 'bin'}{os.pathsep}{os.environ['PATH']}"
    python = tmp_path / "python" / "bin" / "python"

    def run(*words):
        return subprocess.run(
            [str(python), *words],
            cwd=campaign.root,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    assert "ModuleNotFoundError" in run("-c", "import rftfit").stderr
    target = "results/runs/yuma.csv"
    words = [target, "--snakefile", str(clone / "Snakefile"), "--cores", "1", "--sdm", "conda"]
    process = run("-m", "snakemake", *words)
    assert process.returncode == 0, process.stdout + process.stderr
    assert (campaign.root / target).is_file()
    (linked,) = campaign.root.glob(".snakemake/conda/*/lib/python*/site-packages/rftfit")
    assert linked.resolve() == clone / "src" / "rftfit"


def test_the_environment_has_what_the_project_needs():
    """Each package of pyproject.toml with the same lowest version."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]
    file = PROJECT / "workflow" / "envs" / "rftfit.yaml"
    words = yaml.safe_load(file.read_text("utf-8"))["dependencies"]
    versions = {word.partition(" ")[0]: word.partition(" ")[2] for word in words}
    needed = dict(word.split(">=") for word in project["dependencies"])
    for name in NOT_OF_JOBS:
        del needed[name]
    lowest = {name: versions.get(name, "").removeprefix(">=") for name in needed}
    assert lowest == needed
