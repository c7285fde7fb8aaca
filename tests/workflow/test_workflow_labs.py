"""Simulated campaigns of other labs pass through every stage to a report page.

Golden campaigns are labs of further kinds; `make reliability` checks the logs of all grids and protocols.
"""

import pytest
from campaigns import Folder
from mistakes import Case, judge, make
from seeds import seeds

pytestmark = pytest.mark.slow

CASES = [
    Case("one-push", "one-file", tare=False, legs=True),
    Case("straight-down", "constant-speed", dialect="lvm"),
    Case("one-row", "cyclic"),
    Case("no-vertical", "separate-zero", dialect="arrays"),
]


@pytest.mark.statistics
@pytest.mark.parametrize("case", seeds(CASES, CASES[:1]), ids=str)
def test_another_lab_gets_to_a_page(case, tmp_path):
    make(tmp_path / "campaign", case)
    folder = Folder(tmp_path / "campaign")
    folder.run_here(drawn=("alpha_maps_poppy_CP",))
    report, wrong = judge(folder.root, case, [])
    assert not wrong, report
    marks = {
        "report.html": b"Simulated, not measured",
        "provenance.json": b'"reenacted": true',
        "figures/alpha_maps_poppy_CP.png": b"simulated logs",
    }
    for name, words in marks.items():
        assert words in (folder.root / "results" / name).read_bytes(), name
    assert folder.table("legs/poppy_CP.csv").empty != case.legs
