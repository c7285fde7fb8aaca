"""What a stage says when there is nothing to draw, fit or compare."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from rftfit.workflow.figures import stress_runs

from rftfit.errors import InputError
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.store import write_csv, write_parquet
from rftfit.workflow import figures, validate

if TYPE_CHECKING:
    from pathlib import Path


def campaign(*named: str, **fit: Any) -> Any:
    """A campaign with one horizontal run."""
    run = SimpleNamespace(run_id="a", kind="plate", direction="horizontal", medium="sand")
    config = SimpleNamespace(
        figures=SimpleNamespace(stress_runs=named),
        media={"sand": SimpleNamespace(title="sand")},
        fit=SimpleNamespace(**fit),
    )
    return SimpleNamespace(config=config, by_id={"a": run}, runs_of=lambda _: (run,))


def test_runs_of_the_figure_of_stress() -> None:
    with pytest.raises(
        InputError, match=r"figures.stress_runs: found b, c; allowed: run_id of the"
    ):
        stress_runs(campaign("a", "b", "c"))
    assert stress_runs(campaign()) == []


def test_clocks_that_were_not_estimated(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(figures, "load_campaign", lambda _: campaign())
    monkeypatch.setattr(figures, "ingest_traces", lambda *_: ([SimpleNamespace(alignment=None)],))
    figures.figure_clocks(tmp_path / "config.yaml", "sand", tmp_path / "a.png")
    assert "no run whose clocks were estimated" in (tmp_path / "a.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("reason", ["no tare: t cannot be used", ""])
def test_figures_without_a_run(
    reason: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(figures, "load_campaign", lambda _: campaign("a"))
    monkeypatch.setattr(figures, "stress_samples", lambda *_: pd.DataFrame({"run_id": []}))
    table, rows = tmp_path / "table.csv", tmp_path / "rows.parquet"
    row = {"run_id": "a", "abscissa": "depth_cm", "valid_to": np.nan, "reason": reason}
    write_csv(pd.DataFrame([row]), table)
    write_parquet(pd.DataFrame({"run_id": ["a"]}), rows)
    figures.figure_stress(tmp_path, [rows], [rows], [table], tmp_path / "stress.png")
    figures.figure_tare(tmp_path, "sand", rows, table, tmp_path / "tare.png")
    assert f"a: {reason}" in (tmp_path / "stress.svg").read_text(encoding="utf-8")
    assert (reason or NO_TARE_FLAG) in (tmp_path / "tare.svg").read_text(encoding="utf-8")


def test_a_sand_without_a_linear_regime() -> None:
    depth = np.linspace(0, 1, 20)
    zero = (np.zeros(1), np.ones(1))
    row = validate._fit(depth, depth, 5.0, zero, np.array([1.2, 1.3]), campaign(min_points=50))
    assert row["reason"] == "no linear regime with enough samples"


def test_figures_without_a_fit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from rftfit.workflow import figures

    drawn: list[str] = []
    config = SimpleNamespace(fourier=SimpleNamespace(method="lsq"))
    for stage in (figures, figures):
        monkeypatch.setattr(stage, "load_campaign", lambda _: SimpleNamespace(config=config))
        monkeypatch.setattr(stage, "draw_missing", lambda what, _: drawn.append(what))
        monkeypatch.setattr(stage, "save", lambda *_: None)
    columns = ["method", "medium", "coefficient", "value_N_per_cm3", "zeta", "reason"]
    table = tmp_path / "table.csv"
    write_csv(pd.DataFrame(columns=columns), table)
    figures.figure_fit(tmp_path, [table], table, tmp_path / "a.png")
    figures.figure_generic(tmp_path, [table], table, table, tmp_path / "a.png")
    figures.figure_generic_forces(tmp_path, table, [table], table, tmp_path / "a.png")
    assert drawn == [
        "no nine-term fit by lsq",
        "no generic profile by lsq",
        "no zeta by lsq, so forces cannot be scaled",
    ]
