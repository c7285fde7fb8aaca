"""The notebook runs in a fresh clone."""

import json
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

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
    assert "chi = " in said
    forces = names["forces"]
    assert np.isfinite(forces["force_z_hi_N"]).all()
