"""Four campaigns of other labs, through every stage; `make matrix` runs all of them by `rftfit run`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from campaigns import Folder
from other_labs import Case, judge, make

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow

CASES = [
    Case("one-row", "cyclic"),
    Case("straight-down", "constant-speed", dialect="lvm"),
    Case("no-vertical", "separate-zero", dialect="arrays"),
    Case("one-push", "one-file", tare=False, legs=True),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_another_lab_gets_to_a_page(case: Case, tmp_path: Path) -> None:
    make(tmp_path / "campaign", case)
    folder = Folder(tmp_path / "campaign")
    folder.run_here()
    told, wrong = judge(folder.root, case, [])
    assert not wrong, told
    page = (folder.root / "results" / "report.html").read_text(encoding="utf-8")
    assert "re-enacted" in page
    assert folder.table("legs/poppy_CP.csv").empty != case.legs
