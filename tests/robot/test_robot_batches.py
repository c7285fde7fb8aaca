"""A sweep as batches: every condition in one of them, and the same bytes as in one piece."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from rftfit import reference
from rftfit.errors import InputError
from rftfit.robot.run import Condition
from rftfit.robot.sweep import paper_conditions, share
from rftfit.store import write_csv
from rftfit.workflow import robot

PROJECT = Path(__file__).parents[2]
FEW = [Condition(5.0, k, phase) for k in (0.4, 0.6, 0.8) for phase in (0.0, 1 / 3)]


@pytest.mark.parametrize("of", [1, 2, 13, 50, 51, 52, 200])
def test_every_condition_is_in_one_batch(of: int) -> None:
    whole = paper_conditions()
    dealt = [share(whole, f"{item}-of-{of}") for item in range(1, of + 1)]
    assert sorted(map(repr, whole)) == sorted(repr(one) for batch in dealt for one in batch)
    # one folder of finished runs serves all batches, a file for each curvature
    curvatures = [{one.curvature_times_R for one in batch} for batch in dealt]
    assert sum(map(len, curvatures)) == 51
    sizes = [len(found) for found in curvatures]
    assert max(sizes) - min(sizes) <= 1
    for batch in dealt:
        places = [whole.index(one) for one in batch[:40]]
        assert places == sorted(places)


@pytest.mark.parametrize("batch", ["", "1", "0-of-2", "3-of-2", "1-of-0", "-1-of-2", "a-of-b"])
def test_no_such_batch(batch: str) -> None:
    with pytest.raises(InputError, match=r"batch: found .* allowed: 1-of-N to N-of-N"):
        share(FEW, batch)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "config").mkdir()
    values = yaml.safe_load((PROJECT / "config" / "config.yaml").read_text("utf-8"))
    values["robot"].pop("runs", None)
    (tmp_path / "config" / "config.yaml").write_text(yaml.safe_dump(values), encoding="utf-8")
    (tmp_path / "raw" / "paper").mkdir(parents=True)
    (tmp_path / "raw" / "paper" / "runs.csv").write_text(
        "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
        "p1,plate,poppy_LP,plate,intrusion,0,90,p1_f.csv,p1_m.csv\n",
        encoding="utf-8",
    )
    alpha = reference.load("table_s5")
    write_csv(alpha[alpha["medium"] == "poppy_LP"].assign(reason=""), tmp_path / "alpha.csv")
    write_csv(
        pd.DataFrame({"curvature_times_R": [0.6], "frequency_Hz": [np.nan]}),
        tmp_path / "measured.csv",
    )
    names = ["method", "medium", "coefficient", "value_N_per_cm3", "kept", "reason"]
    write_csv(pd.DataFrame([], columns=names), tmp_path / "coefficients.csv")
    return tmp_path


def test_batches_have_the_bytes_of_the_whole(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot, "conditions_of", lambda *_: FEW)

    def table(name: str, batch: str, threads: str = "1", parts: tuple[Path, ...] = ()) -> Path:
        robot.robot_sweep(
            root / "config" / "config.yaml", "depth_only", "robot_full", batch, threads,
            root / "alpha.csv", root / "coefficients.csv", root / "measured.csv", list(parts),
            root / name,
        )  # fmt: skip
        return root / name

    kept = root / "results" / "robot" / "parts"
    whole = table("whole.csv", "1-of-1", "2").read_bytes()
    assert whole.count(b"\n") == 1 + len(FEW)
    finished = {path.name: path.read_bytes() for path in kept.rglob("*.csv")}
    shutil.rmtree(kept)
    parts = [table(f"{item}.csv", f"{item}-of-4") for item in (3, 1, 4, 2)]
    assert [path.read_text("utf-8").count("\n") - 1 for path in parts] == [2, 2, 0, 2]
    assert {path.name: path.read_bytes() for path in kept.rglob("*.csv")} == finished
    shutil.rmtree(kept)
    # the batches' tables are enough: nothing is run again
    monkeypatch.setattr(robot, "run_all", lambda *words: [] if not words[2] else 1 / 0)
    assert table("gathered.csv", "1-of-1", parts=tuple(parts)).read_bytes() == whole
    with pytest.raises(InputError, match="threads: found '0'"):
        table("none.csv", "1-of-1", "0")
