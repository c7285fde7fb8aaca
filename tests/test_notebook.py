"""The notebook runs in a fresh clone, and with a campaign's results."""

import json
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from light_campaign import LABORATORY, make_campaign

from rftfit.reference import alpha_grid

NOTEBOOK = Path(__file__).parents[1] / "examples" / "quickstart.ipynb"


@pytest.fixture
def names(tmp_path, monkeypatch):
    from matplotlib import pyplot as plt

    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    with mpl.rc_context():
        yield {}
    plt.close("all")


def run_cells(names):
    """Run the code cells in one namespace. Returns how many figures there are."""
    from matplotlib import pyplot as plt

    figures = 0
    for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec("".join(cell["source"]), names)  # noqa: S102
            figures += len(plt.get_fignums())
            plt.close("all")
    return figures


def test_in_a_fresh_clone(names, capsys):
    assert run_cells(names) == 4
    said = capsys.readouterr().out
    assert "zeta = 0.613" in said
    assert "no results" in said


def test_with_a_campaign(names, tmp_path, capsys):
    alpha = {"own": alpha_grid("poppy_CP")}
    make_campaign(tmp_path / "camp", {"own": LABORATORY}, alpha)
    for name in ("config", "raw", "results"):
        (tmp_path / "camp" / name).rename(tmp_path / name)
    run_cells(names)
    assert "no results" not in capsys.readouterr().out
    forces = names["forces"]
    assert "force_z_lo_N" in forces
    assert np.isfinite(forces["force_z_hi_N"]).all()
