"""The profile for a Slurm cluster gives every rule of the workflow its resources and a group."""

import os
import re
import shutil
import subprocess
import sys

import pytest
import yaml
from campaigns import FEW, make_campaign
from paper import PROJECT

PROFILE = PROJECT / "profiles" / "slurm" / "config.yaml"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def profile():
    return yaml.safe_load(PROFILE.read_text("utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return make_campaign(
        tmp_path_factory.mktemp("cluster") / "campaign", ("poppy_LP",), directions=FEW
    )


def test_every_rule_has_a_place(profile, folder):
    rules = set(folder.snakemake("--list-rules").stdout.split())
    assert rules == {*profile["groups"], "stage", "all", "printed"}
    assert set(profile["set-resources"]) <= rules
    assert set(profile["groups"].values()) == set(profile["group-components"])


def test_every_job_has_memory_and_time(profile):
    assert profile["default-resources"].keys() == {"mem_mb", "runtime"}
    assert profile["executor"] == "slurm"
    # a job that a dying node takes with it goes back into the queue
    assert profile["slurm-requeue"] is True
    assert "retries" not in profile
    for rule, resources in profile["set-resources"].items():
        assert resources.keys() <= {"mem_mb", "runtime"}, rule
        for key, value in resources.items():
            assert value > profile["default-resources"][key], (rule, key)


def test_groups_make_no_circle(profile, folder, tmp_path):
    # all but what only the plugin understands, which need not be installed here
    settings = {k: v for k, v in profile.items() if k != "executor" and not k.startswith("slurm-")}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(settings), "utf-8")
    text = folder.run("--dry-run", "all", "--workflow-profile", str(tmp_path))
    groups = re.findall(r"Group job (\w+) ", text)
    # the clocks of this campaign are not estimated
    assert {*groups} == {*profile["groups"].values()} - {"clocks"}
    assert len(groups) <= 12


IMPORTED = "import rftfit.workflow.preload, sys; print('matplotlib' in sys.modules, 'pandas' in sys.modules)"


@pytest.mark.parametrize(("rules", "draws"), [("ingest tare slopes", "False"), ("figure", "True")])
def test_a_batch_job_imports_what_its_rules_need(rules, draws):
    command = [sys.executable, "-P", "-c", IMPORTED]
    done = subprocess.run(
        command,
        env=os.environ | {"RFTFIT_RULES": rules},
        check=True,
        capture_output=True,
        text=True,
    )
    assert done.stdout.split() == [draws, "True"]


def test_the_jobs_of_a_batch_job_are_forked_and_make_the_same(folder):
    """Snakemake, started as an executor of a cluster starts it on a node."""
    stages = ("ingest", "tare", "slopes", "checks")
    targets = [f"{stage}:medium=poppy_LP" for stage in stages]
    folder.run("results/checks/poppy_LP.csv")
    expected = folder.digests()
    shutil.rmtree(folder.root / "results")
    words = ["--mode", "remote", "--force", "--nolock", "--local-groupid", "batch"]
    written = folder.snakemake(
        "--target-jobs", *targets, "--allowed-rules", *stages, *words, "--executor", "local"
    )
    assert written.returncode == 0, written.stderr
    assert folder.digests().items() <= expected.items()
    assert (folder.root / "results" / "checks" / "poppy_LP.csv").is_file()
