"""`rftfit inspect` counts the rows, gaps and damage of a log, or says why a file is not a log."""

from pathlib import Path

import numpy as np
import pytest

from rftfit.figures.log_plot import draw_log
from rftfit.logs.base import Log

FORCE = "raw/paper/yuma/yuma_bp00_g90_in_force.csv"
"""A force log of the simulated campaign."""
HEADER = "time_s,arm_moving,F1_N,F2_N,F3_N"
"""Header of a force log of the rig."""


def force_log(path, rows, header=HEADER, end="\n"):
    path.write_text("\n".join([header, *rows]) + end, "utf-8")
    return path


@pytest.mark.parametrize(("first", "is_lacking"), [(1, True), (0, False)])
def test_a_sync_line_that_never_changes(rftfit, tmp_path, first, is_lacking):
    log = force_log(tmp_path / "a.csv", [f"0,{first},0,0,0", "1,1,0,0,0", "2,1,0,0,0"])
    assert ("a change of arm_moving" in rftfit("inspect", log).out) is is_lacking


def test_no_usable_row(rftfit, tmp_path):
    output = rftfit("inspect", force_log(tmp_path / "a.csv", ["x,x,x,x,x", "y,y,y,y,y"]))
    assert "rows: 2, of which 0 " in output.out
    assert "at least two usable rows" in output.out


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_a_picture_of_somebody_else_is_left_as_it_is(rftfit, refusal, campaign, ending):
    picture = campaign / f"rig.{ending}"
    picture.write_bytes(b"a photograph of the rig")
    err = refusal("inspect", FORCE, "--plot", picture.name)
    assert "was not written by rftfit inspect" in err
    assert "--plot, or add --force" in err
    assert picture.read_bytes() == b"a photograph of the rig"
    rftfit("inspect", FORCE, "--plot", picture.name, "--force")
    drawn_bytes = picture.read_bytes()
    # its own it draws anew unasked
    rftfit("inspect", FORCE, "--plot", picture.name)
    assert picture.read_bytes() == drawn_bytes


def test_panels_have_no_line_over_a_gap():
    time = np.array([5.0, 6, 7, 8, 35, 36])
    log = Log(
        Path("a.csv"), {"time": time, "F1": time, "F2": time - 4}, {"time": "s", "F2": "N"}, 6
    )
    panels = draw_log(log).axes
    assert [panel.get_ylabel() for panel in panels] == ["F1", "F2 (N)"]
    x, y = np.asarray(panels[1].lines[0].get_data())
    np.testing.assert_array_equal(x, [0, 1, 2, 3, np.nan, 30, 31])
    np.testing.assert_array_equal(y, [1, 2, 3, 4, np.nan, 31, 32])
