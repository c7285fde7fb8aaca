"""`--cluster` selects a Snakemake profile and names each program or package that is missing."""

from importlib.machinery import ModuleSpec

import pytest

from rftfit.errors import InputError
from rftfit.workflow import run
from rftfit.workflow.run import _cluster_words as cluster_words


@pytest.fixture
def snakefile(tmp_path):
    for name, text in [("default", "cores: all\n"), ("slurm", "executor: slurm\n")]:
        (tmp_path / "top" / "profiles" / name).mkdir(parents=True)
        (tmp_path / "top" / "profiles" / name / "config.yaml").write_text(text, "utf-8")
    return tmp_path / "top" / "Snakefile"


@pytest.fixture
def installed(monkeypatch):
    monkeypatch.setattr(run, "find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr("sys.executable", "/usr/bin/python")


@pytest.mark.usefixtures("installed")
def test_the_projects_profile_and_an_own_one(snakefile, tmp_path):
    shipped_profile = snakefile.parent / "profiles" / "slurm"
    assert cluster_words("slurm", snakefile, None) == ["--workflow-profile", str(shipped_profile)]
    assert cluster_words("slurm", snakefile, 8)[2:] == ["--cores", "8"]
    site_profile = tmp_path / "my site"
    site_profile.mkdir()
    (site_profile / "config.yaml").write_text("executor: local\n", "utf-8")
    assert cluster_words(str(site_profile), snakefile, None) == [
        "--workflow-profile",
        str(site_profile),
    ]


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("text", "words"), [("a: [", "cannot be read"), ("- a\n", "must hold keys and values")]
)
def test_a_profile_that_cannot_be_read(snakefile, tmp_path, text, words):
    (tmp_path / "config.yaml").write_text(text, "utf-8")
    with pytest.raises(InputError, match=words):
        cluster_words(str(tmp_path), snakefile, None)
    with pytest.raises(InputError, match="found 'default'; allowed: slurm, or a folder"):
        cluster_words("default", snakefile, None)


def test_what_is_missing_is_named(snakefile, monkeypatch):
    for sign in " $'(":
        monkeypatch.setattr("sys.executable", f"/home/my{sign}lab/.venv/bin/python")
        with pytest.raises(InputError, match="cannot start a Python whose path has a"):
            cluster_words("slurm", snakefile, None)
    # letters of other languages are letters
    monkeypatch.setattr("sys.executable", "/home/été/.venv/bin/python3.11")
    monkeypatch.setattr(run, "find_spec", lambda _: None)
    with pytest.raises(InputError, match="pip install snakemake-executor-plugin-slurm"):
        cluster_words("slurm", snakefile, None)
    monkeypatch.setattr(run, "find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(InputError, match="no program sbatch here"):
        cluster_words("slurm", snakefile, None)


def test_the_command_says_so(rftfit, campaign):
    rftfit("run --cluster nowhere", code=2)
    assert not (campaign / ".snakemake").exists()
