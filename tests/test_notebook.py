"""The quickstart notebook runs in a fresh clone and prints the expected numbers."""

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt

NOTEBOOK = Path(__file__).parents[1] / "examples" / "quickstart.ipynb"


@pytest.mark.page
def test_in_a_fresh_clone(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    names: dict[str, Any] = {}
    figures = 0
    with mpl.rc_context():
        for cell in json.loads(NOTEBOOK.read_text("utf-8"))["cells"]:
            if cell["cell_type"] == "code":
                assert cell["outputs"] == []
                exec("".join(cell["source"]), names)  # noqa: S102
                figures += len(plt.get_fignums())
                plt.close("all")
    assert figures == 4
    printed = capsys.readouterr().out
    assert "zeta = 0.574" in printed
    assert "chi = " in printed
    assert np.isfinite(names["forces"]["force_z_hi_N"]).all()
