"""A small campaign, and a way to run the command as a user would."""

import shlex
import shutil
from pathlib import Path

import pytest
from paper import few_draws
from result_tables import LABORATORY, SAND, make_campaign, one_cell

from rftfit import reference
from rftfit.cli.main import main

ROOT = Path(__file__).parents[2]
MEASURED = ("poppy_LP", "poppy_CP", "glass3mm_CP")


@pytest.fixture(autouse=True)
def _few_draws():
    """What commands print is tested here, and not how well intervals hold."""
    with few_draws():
        yield


@pytest.fixture
def rftfit(capfd):
    """Run a command that ends with a code; whatever happens, no traceback may be shown.

    Text is split into words as by a shell; anything else, as a path, is one word.
    """

    def call(*parts, code=0):
        line = " ".join(part if isinstance(part, str) else shlex.quote(str(part)) for part in parts)
        exit_code = main(shlex.split(line))
        output = capfd.readouterr()
        assert exit_code == code, output.out + output.err
        assert "Traceback" not in output.out + output.err
        return output

    return call


@pytest.fixture
def refusal(rftfit):
    """What is said by a command that ends because of wrong input."""
    return lambda *parts: rftfit(*parts, code=2).err


@pytest.fixture
def work_folder(tmp_path, monkeypatch):
    """An empty folder, as the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def results(work_folder):
    """Results of a campaign: three published media and a sand with one cell."""
    return make_campaign(
        work_folder / "results é",
        dict.fromkeys(MEASURED, LABORATORY) | {"sand": SAND},
        {medium: reference.alpha_grid(medium) for medium in MEASURED} | {"sand": one_cell(0.7)},
    )


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """One sand's campaign in a folder with a blank and an accent, re-enacted once."""
    root = tmp_path_factory.mktemp("camp é", numbered=True)
    (root / "config").mkdir()
    shutil.copy(ROOT / "config" / "config.yaml", root / "config" / "config.yaml")
    config = str(root / "config" / "config.yaml")
    assert main(["reenact", "--config", config, "--media", "yuma"]) == 0
    return root


@pytest.fixture
def campaign(made_once, tmp_path, monkeypatch):
    """A copy of it, as the current folder."""
    root = tmp_path / "my campaign é"
    shutil.copytree(made_once, root)
    monkeypatch.chdir(root)
    return root
