"""`rftfit inspect` counts the rows, gaps and damage of a log, or says why a file is not a log."""

import numpy as np
import pytest

from rftfit import read_log
from rftfit.figures.log_plot import draw_log

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


def test_panels_have_no_line_over_a_gap(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],F1,F2 [N]\n5,5,1\n6,6,2\n7,7,3\n8,8,4\n35,35,31\n36,36,32\n")
    panels = draw_log(read_log(path)).axes
    assert [panel.get_ylabel() for panel in panels] == ["F1", "F2 (N)"]
    x, y = np.asarray(panels[1].lines[0].get_data())
    np.testing.assert_array_equal(x, [0, 1, 2, 3, np.nan, 30, 31])
    np.testing.assert_array_equal(y, [1, 2, 3, 4, np.nan, 31, 32])
