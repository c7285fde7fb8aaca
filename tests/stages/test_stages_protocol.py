"""The stages that draw how forces become slopes, on a measured campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rftfit.campaign.load import load_campaign
from rftfit.figures import protocol
from rftfit.store import write_csv, write_parquet
from rftfit.workflow import figures
from rftfit.workflow.figures import figure_linearity, figure_protocol

if TYPE_CHECKING:
    from pathlib import Path

    from rigroom import Results, Room


@pytest.fixture
def small(room: Room) -> Room:
    return room.add(
        "poppy_LP_bp30_g45_in", "poppy_LP_bp30_g45_ex", "poppy_LP_bp30_g00_h508",
        "poppy_LP_bp30_g00_h762", "poppy_LP_bp00_g90_in", "poppy_LP_c_leg", "poppy_LP_flat_leg",
    )  # fmt: skip


def written(results: Results, folder: Path) -> dict[str, Path]:
    paths = {}
    for name, table in (("traces", results.traces), ("tared", results.tared)):
        paths[name] = folder / f"{name}.parquet"
        write_parquet(table, paths[name])
    for name, table in (("fits", results.fits), ("legs", results.curves), ("alpha", results.alpha)):
        paths[name] = folder / f"{name}.csv"
        write_csv(table, paths[name])
    return paths


def files(room: Room) -> dict[str, Path]:
    from rftfit.measure.fits import fit_medium
    from rftfit.store import read_csv

    results = room.chain()
    paths = written(results, room.folder)
    paths["config"] = room.folder / "config" / "config.yaml"
    campaign = load_campaign(paths["config"])
    write_csv(results.runs, room.folder / "runs.csv")
    tares = room.folder / "tares.csv"
    write_csv(results.tares, tares)
    _, windows, _ = fit_medium(
        campaign, "poppy_LP", read_csv(room.folder / "runs.csv"), results.tared, read_csv(tares)
    )
    paths["windows"] = room.folder / "windows.parquet"
    write_parquet(windows, paths["windows"])
    return paths


def drawn(monkeypatch: pytest.MonkeyPatch) -> list[list[protocol.Protocol]]:
    """Columns that were handed to the drawing function."""
    seen: list[list[protocol.Protocol]] = []

    def draw(columns: list[protocol.Protocol], *rest: object) -> object:
        seen.append(columns)
        return protocol.draw_protocol(columns, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(figures, "draw_protocol", draw)
    return seen


def draw(paths: dict[str, Path], png: Path) -> None:
    parts = {name: paths[name] for name in ("traces", "tared", "windows", "fits", "legs")}
    figure_protocol(paths["config"], "poppy_LP", **parts, png=png)


def test_one_run_of_each_kind(small: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    paths, seen = files(small), drawn(monkeypatch)
    draw(paths, small.folder / "one.png")
    columns = seen[0]
    assert [column.kind for column in columns] == [
        "intrusion", "extraction", "horizontal", "rotation",
    ]  # fmt: skip
    # the deepest of the two horizontal runs, the first leg of the config
    assert columns[2].fit["run_id"] == "poppy_LP_bp30_g00_h762"
    assert columns[3].about.startswith("c-leg")
    assert "(\u221230\u00b0, \u221245\u00b0)" in columns[1].about
    for column in columns:
        assert column.tare
        first, last = column.phases["stroke"]
        assert first == 0.0
        assert last > 5
    # the tare of an intrusion is small beside its force
    assert abs(columns[0].tare["force_z_N"]).max() < 0.1 * columns[0].run["force_z_N"].max()
    for ending in ("png", "pdf", "svg"):
        assert (small.folder / f"one.{ending}").stat().st_size > 5000


def test_a_run_that_gave_no_slope_is_not_shown(
    small: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    small.set("poppy_LP_bp30_g45_in", excluded="yes", reason="dust")
    small.set("poppy_LP_c_leg", excluded="yes", reason="dust")
    paths, seen = files(small), drawn(monkeypatch)
    draw(paths, small.folder / "one.png")
    columns = {column.kind: column for column in seen[0]}
    assert columns["intrusion"].fit["run_id"] == "poppy_LP_bp00_g90_in"
    assert columns["rotation"].about.startswith("flat leg")


def test_all_media_at_a_few_angles(small: Room) -> None:
    paths = files(small)
    lists = {name: [paths[name]] for name in ("tared", "windows", "fits", "alpha")}
    png = small.folder / "all.png"
    figure_linearity(paths["config"], **lists, png=png)
    first = png.read_bytes()
    figure_linearity(paths["config"], **lists, png=png)
    assert png.read_bytes() == first


def test_no_run_at_all_is_said_in_the_figure(small: Room) -> None:
    for run in ("poppy_LP_bp30_g45_in", "poppy_LP_bp30_g45_ex", "poppy_LP_bp30_g00_h508",
                "poppy_LP_bp30_g00_h762", "poppy_LP_bp00_g90_in", "poppy_LP_c_leg",
                "poppy_LP_flat_leg"):  # fmt: skip
        small.set(run, excluded="yes", reason="dust")
    draw(files(small), small.folder / "one.png")
    assert "there is no run of which" in (small.folder / "one.svg").read_text(encoding="utf-8")
