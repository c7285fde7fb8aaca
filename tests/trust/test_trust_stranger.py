"""No command executes anything that lies in the folder of a stranger's campaign."""

import os
import shutil
import subprocess
import sys

import pytest
from paper import PROJECT
from waiting import RFTFIT, run_commands

from rftfit.store.environment import child_environment

MODULES = (
    "numpy",
    "json",
    "yaml",
    "pandas",
    "numba",
    "matplotlib",
    "pyarrow",
    "scipy",
    "typer",
    "pickle",
    "sitecustomize",
    "usercustomize",
    "snakemake",
    "rftfit",
    "ourlab_dialect",
)
"""Names of modules that Python, Snakemake or numba would import from a folder."""
CODE = "import pathlib\npathlib.Path({marker!r}).mkdir(exist_ok=True)\n(pathlib.Path({marker!r}) / {name!r}).touch()\n"
"""A module that leaves a file when it is executed."""
PROFILE = """\
__use_yte__: true
__definitions__:
  - import pathlib
  - pathlib.Path({marker!r}).mkdir(exist_ok=True)
  - (pathlib.Path({marker!r}) / {name!r}).touch()
cores: 1
"""
PLUGIN = "[rftfit.dialects]\nours = ourlab_dialect:Dialect\n"
"""Entry point of a package that offers a dialect of logs."""
MEDIUM = "poppy_LP"
TARGETS = ("results/penetration.csv", f"results/quality/{MEDIUM}.png", "results/robot/motion.csv")
"""Results that are asked for."""
DIALECT = """
class Dialect:
    def describe(self): return "our logs"
    def detect(self, head): return head.startswith(b"OURS")
    def load(self, path): raise OSError
"""
pytestmark = pytest.mark.skipif(os.name != "posix", reason="the program lies elsewhere on Windows")


def make_hostile(root, marker):
    """Put into a campaign's folder whatever Python, Snakemake or numba might execute."""

    def write(path, text):
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(
            text.format(marker=str(marker), name=path.replace("/", ":")), encoding="utf-8"
        )

    for name in MODULES:
        write(f"{name}.py", CODE)
    for name in ("rftfit", "snakemake"):
        write(f"{name}/__init__.py", CODE)
        write(f"{name}/__main__.py", CODE)
    write("snakemake_logger_plugin_x.py", CODE)
    write("ourlab-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: ourlab\nVersion: 1.0\n")
    write("ourlab-1.0.dist-info/entry_points.txt", PLUGIN)
    for folder in ("default", "profiles/default", "slurm", "site"):
        write(f"{folder}/config.yaml", PROFILE)
    # compiled functions are unpickled from there
    write(".numba_config.yaml", f"cache_dir: {marker}/numba\n")
    write("matplotlibrc", "text.usetex: True\nsvg.fonttype: path\naxes.facecolor: red\n")


def call(cwd, *words, **environment):
    return subprocess.run(
        [str(RFTFIT), *words],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        env={**os.environ, **environment},
    )


def executed(marker):
    return sorted(str(path.relative_to(marker)) for path in marker.rglob("*"))


@pytest.fixture
def hostile(small, tmp_path):
    """Folder of a campaign that has no logs yet, and where everything executed leaves a file."""
    root, marker = tmp_path / "strange", tmp_path / "executed"
    shutil.copytree(small.root / "config", root / "config")
    make_hostile(root, marker)
    return root, marker


@pytest.mark.slow
def test_no_command_executes_what_lies_in_the_folder(small, hostile, tmp_path):
    root, marker = hostile
    # somebody's own profile, of a name that the stranger has guessed
    (tmp_path / "home/snakemake/site").mkdir(parents=True)
    (tmp_path / "home/snakemake/site/config.yaml").write_text("cores: 2\n", encoding="utf-8")
    own_profile = {"SNAKEMAKE_PROFILE": "site", "XDG_CONFIG_HOME": str(tmp_path / "home")}
    shutil.copytree(small.root / "raw", root / "raw")
    # an empty entry of PYTHONPATH is the current folder of each process: the campaign's, in jobs
    config = ("--config", str(root / "config/config.yaml"))
    paths = f"{os.pathsep}{PROJECT / 'src'}"
    process = call(tmp_path, "run", *config, *TARGETS, **own_profile, PYTHONPATH=paths)
    assert (executed(marker), process.returncode) == ([], 0), process.stdout + process.stderr
    # Snakemake started by hand, with nothing from `rftfit run`
    hand = ("--snakefile", str(PROJECT / "Snakefile"), "--directory", str(root), "--cores", "1")
    words = [str(RFTFIT.with_name("snakemake")), *hand, "-f", "results/alpha_extended.csv"]
    process = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True, check=False)
    assert (executed(marker), process.returncode) == ([], 0), process.stderr
    leg = ("--leg", "c_leg", "--output", "forces.csv")
    second_root = tmp_path / "other"
    shutil.copytree(root / "config", second_root / "config")
    commands = {
        "check": ["check"],
        "dry run": ["run", "--dry-run", *TARGETS],
        "scale": ["scale", "--alpha", "0.9"],
        "predict": ["predict", *leg, "--results", "results", "--medium", MEDIUM],
        "verify": ["verify"],
        "reenact": ["reenact", "--media", "yuma", "--config", second_root / "config/config.yaml"],
    }
    env = {**os.environ, **own_profile}
    answers = run_commands(commands.values(), root, tmp_path / "bin", env)
    assert executed(marker) == []
    codes = [answer.returncode for answer in answers]
    assert codes == [0, 0, 0, 0, 2, 0], [answer.stdout + answer.stderr for answer in answers]
    assert "Nothing to do" in answers[1].stdout
    assert (second_root / "raw").is_dir()
    for name in (f"alpha/{MEDIUM}.csv", f"quality/{MEDIUM}.png"):
        ours, expected = (folder / "results" / name for folder in (root, small.root))
        assert ours.read_bytes() == expected.read_bytes(), name


@pytest.mark.slow
def test_packages_that_snakemake_would_import_are_refused(small, tmp_path):
    root = tmp_path / "campaign"
    shutil.copytree(small.root, root, ignore=shutil.ignore_patterns("results", ".snakemake"))
    folder = root / ".snakemake/pip-deployments/snakemake_report_plugin_x"
    folder.mkdir(parents=True)
    marker = tmp_path / "executed"
    text = CODE.format(marker=str(marker), name="plugin")
    (folder / "__init__.py").write_text(text, encoding="utf-8")
    commands = (["run", "-n"], ["run", "--unlock"], ["run"])
    for answer in run_commands(commands, root, tmp_path / "bin"):
        assert answer.returncode == 2
        assert str(folder.parent) in answer.stderr
    assert executed(marker) == []
    assert not (root / "results").exists()


def test_a_dialect_that_is_installed_still_works(tmp_path):
    """Of a package on an absolute path of PYTHONPATH, in a child of a safe environment."""
    site = tmp_path / "site"
    (site / "ourlab-1.0.dist-info").mkdir(parents=True)
    (site / "ourlab-1.0.dist-info/METADATA").write_text("Name: ourlab\nVersion: 1.0\n")
    (site / "ourlab-1.0.dist-info/entry_points.txt").write_text(PLUGIN)
    (site / "ourlab_dialect.py").write_text(DIALECT)
    code = "from rftfit.logs.registry import dialects; print(dialects()['ours'].describe())"
    for paths, is_found in ((str(site), True), (f".{os.pathsep}", False)):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("PYTHONPATH", paths)
            environment = child_environment()
        process = subprocess.run(
            [sys.executable, "-c", code],
            cwd=site,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert ("our logs (package ourlab)" in process.stdout) is is_found, process.stderr
