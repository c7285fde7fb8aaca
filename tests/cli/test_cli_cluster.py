"""`--cluster` selects a Snakemake profile and names each program or package that is missing."""

from importlib.machinery import ModuleSpec

import pytest


@pytest.fixture
def snakefile(tmp_path):
    for name, text in [("default", "cores: all\n"), ("slurm", "executor: slurm\n")]:
        (tmp_path / "top" / "profiles" / name).mkdir(parents=True)
        (tmp_path / "top" / "profiles" / name / "config.yaml").write_text(text, "utf-8")
    path = tmp_path / "top" / "Snakefile"
    path.touch()
    return path


@pytest.fixture
def installed(monkeypatch):
    monkeypatch.setattr("rftfit.workflow.run.find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr("sys.executable", "/usr/bin/python")


@pytest.fixture
def told(refusal, campaign, snakefile):
    """What is said by a run on a cluster that is refused before anything is started."""

    def call(cluster):
        text = refusal("run --snakefile", snakefile, "--cluster", cluster)
        assert not (campaign / ".snakemake").exists()
        return text

    return call


@pytest.mark.usefixtures("installed", "campaign")
def test_the_projects_profile_and_an_own_one(rftfit, snakefile, tmp_path, monkeypatch):
    commands = []

    def listen(words, *_, **__):
        commands.append(words)
        return 0

    monkeypatch.setattr("rftfit.workflow.run.run_snakemake", listen)
    site_profile = tmp_path / "my site"
    site_profile.mkdir()
    (site_profile / "config.yaml").write_text("executor: local\n", "utf-8")
    for words in ("slurm",), ("slurm --cores 8",), (site_profile,):
        rftfit("run --snakefile", snakefile, "--cluster", *words)
    shipped_profile = snakefile.parent / "profiles" / "slurm"
    for words, profile in zip(
        commands, (shipped_profile, shipped_profile, site_profile), strict=True
    ):
        assert words[words.index("--workflow-profile") + 1] == str(profile)
    assert ["--cores" in words for words in commands] == [False, True, False]
    assert commands[1][commands[1].index("--cores") + 1] == "8"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("text", "words"), [("a: [", "cannot be read"), ("- a\n", "must hold keys and values")]
)
def test_a_profile_that_cannot_be_read(told, tmp_path, text, words):
    (tmp_path / "config.yaml").write_text(text, "utf-8")
    assert words in told(tmp_path)
    assert "found 'default'; allowed: slurm, or a folder" in told("default")


def test_what_is_missing_is_named(told, monkeypatch):
    for sign in " $'(":
        monkeypatch.setattr("sys.executable", f"/home/my{sign}lab/.venv/bin/python")
        assert "cannot start a Python whose path has a" in told("slurm")
    # letters of other languages are letters
    monkeypatch.setattr("sys.executable", "/home/été/.venv/bin/python3.11")
    monkeypatch.setattr("rftfit.workflow.run.find_spec", lambda _: None)
    assert "pip install snakemake-executor-plugin-slurm" in told("slurm")
    monkeypatch.setattr("rftfit.workflow.run.find_spec", lambda name: ModuleSpec(name, None))
    monkeypatch.setattr("shutil.which", lambda _: None)
    assert "no program sbatch here" in told("slurm")
