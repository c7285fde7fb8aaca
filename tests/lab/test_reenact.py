"""The simulated lab writes the same log files for the same seed, and faults only where asked."""

from __future__ import annotations

import errno
import io
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns import FEW

from rftfit.errors import InputError, OutputError
from rftfit.lab.enact import prepare, reenact, run_logs
from rftfit.lab.marker import MARKER, remove
from rftfit.lab.plan import plan_runs, plate_of
from rftfit.lab.rig import FAULTS, resolve

SANDS = ["yuma", "palms29", "palms29_sieved"]


@pytest.fixture(scope="module")
def runs(config):
    return {run.run_id: run for run in plan_runs(config)}


def _contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != MARKER)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def _table(content):
    assert content is not None
    return pd.read_csv(io.BytesIO(content), comment="#")


def test_same_seed_same_bytes(config, tmp_path):
    first_folder, second_folder, sand_folder = (
        tmp_path / name for name in ("one", "two parts", "part")
    )
    selection: Any = {"media": ["poppy_LP"], "directions": FEW}
    planned, run_count = len(plan_runs(config, **selection)), len(plan_runs(config))
    assert run_count == 933
    sizes = reenact(config, first_folder, first_folder / "runs.csv", **selection)
    reenact(config, second_folder, second_folder / "runs.csv", **selection)
    reenact(config, sand_folder, sand_folder / "runs.csv", media=["yuma"])
    marker = (first_folder / MARKER).read_text(encoding="utf-8")
    assert "seed 2013, media: poppy_LP, faults: none, grid: " in marker
    assert f"{(first_folder / 'runs.csv').stat().st_size} runs.csv\n" in marker
    assert marker == (second_folder / MARKER).read_text(encoding="utf-8")
    contents = _contents(first_folder)
    assert contents == _contents(second_folder)
    air = {name: data for name, data in _contents(sand_folder).items() if name.startswith("air/")}
    assert len(air) == 6
    assert air.items() <= contents.items()
    # logs and their sheet, tracks and theirs
    assert len(sizes) == len(contents) == 2 * planned + 1 + 126 + 1
    assert sorted(sizes) == sorted(map(len, contents.values()))
    assert sum(sizes) / planned * run_count < 150e6


def test_another_seed_other_bytes(config, runs):
    run = runs["yuma_c_leg"]
    logs_1, logs_2 = run_logs(run, config, 1), run_logs(run, config, 2)
    assert all(logs_1[name] != logs_2[name] for name in logs_1)


def test_form_of_the_logs(config, runs):
    run = runs["poppy_CP_bp30_g34_in"]
    logs = run_logs(run, config, 2013)
    force, motion = _table(logs[run.force_log]), _table(logs[run.motion_log])
    assert list(force) == ["time_s", "arm_moving", "F1_N", "F2_N", "F3_N"]
    assert list(motion) == ["time_s", "x_mm", "z_mm", "angle_deg"]
    content = logs[run.force_log] or b""
    assert b"\r" not in content
    assert content.startswith(b"#")
    assert b"-0.00000" not in content
    assert np.diff(force["time_s"]) == pytest.approx(0.01)
    # rest 2 s, approach, pause 2 s, stroke of 8 cm in x, rest 1 s
    stroke = 8 / np.cos(np.radians(run.gamma_deg or 0.0))
    approach = 1.905 * 0.5 + 0.32 * np.cos(np.pi / 6) + 1.6
    assert len(force) == pytest.approx(100 * (5 + approach + stroke + 0.1), abs=2)
    assert len(motion) == pytest.approx(len(force) / 2, abs=6)
    steps = force["F3_N"] * 160
    assert np.abs(steps - steps.round()).max() < 1e-6
    assert set(force["arm_moving"]) == {0, 1}
    assert np.abs(motion["angle_deg"] - 30).max() < 0.15


def test_folder_that_cannot_be_written(config, tmp_path):
    blocked = tmp_path / "raw"
    blocked.write_text("a file, no folder", encoding="utf-8")
    with pytest.raises(OutputError, match="cannot write"):
        reenact(config, blocked, tmp_path / "runs.csv", media=["poppy_LP"])
    assert not (tmp_path / "runs.csv").exists()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("gapp", "did you mean 'gap'"),
        ("gap:poppy_LP_c_lag", "did you mean"),
        ("flipped_beta:yuma_bp00_g90_in", "same with -beta"),
        ("never_touches:yuma_c_leg", "is a leg"),
    ],
)
def test_fault_that_cannot_be(config, tmp_path, fault, words):
    media = ["poppy_LP", "yuma"]
    with pytest.raises(InputError, match=words):
        reenact(config, tmp_path, tmp_path / "runs.csv", media=media, faults=[fault])
    assert not list(tmp_path.iterdir())


def test_default_runs_exist(runs):
    endings = {ending for ending, _ in FAULTS.values()}
    assert len(endings) == len(FAULTS)
    for ending in endings:
        assert runs[f"poppy_LP_{ending}"].kind == "plate"


def test_faults_in_a_campaign(config, tmp_path):
    whole_folder, broken_folder = tmp_path / "whole", tmp_path / "broken"
    reenact(config, whole_folder, whole_folder / "runs.csv", media=SANDS)
    reenact(config, broken_folder, broken_folder / "runs.csv", media=SANDS)
    asked = [
        "missing_tare",
        "missing_log:palms29_c_leg",
        "wrong_medium_tare:palms29_bp00_g90_in",
        "gap:yuma_flat_leg",
    ]
    campaign = prepare(config, media=SANDS, faults=asked)
    sizes = campaign.write(broken_folder, broken_folder / "runs.csv")
    contents_whole, contents_broken = _contents(whole_folder), _contents(broken_folder)
    assert set(contents_whole) - set(contents_broken) == {
        "yuma/yuma_bp00_g90_in_rod_force.csv",
        "yuma/yuma_bp00_g90_in_rod_motion.csv",
        "palms29/palms29_c_leg_force.csv",
    }
    assert {name for name in contents_broken if contents_broken[name] != contents_whole[name]} == {
        "runs.csv",
        "yuma/yuma_flat_leg_force.csv",
    }
    sheets = [
        pd.read_csv(folder / "runs.csv", dtype=str) for folder in (whole_folder, broken_folder)
    ]
    changed = sheets[0].compare(sheets[1])
    assert changed.shape == (1, 2)
    assert sheets[1].loc[changed.index[0], "run_id"] == "palms29_bp00_g90_in"
    assert sheets[1].loc[changed.index[0], "tare_run"] == "palms29_sieved_bp00_g90_in_rod"
    assert [(f.name, f.run_id, f.changed) for f in campaign.faults] == [
        ("missing_tare", "yuma_bp00_g90_in", "yuma_bp00_g90_in_rod"),
        ("missing_log", "palms29_c_leg", "palms29_c_leg"),
        ("wrong_medium_tare", "palms29_bp00_g90_in", "palms29_bp00_g90_in"),
        ("gap", "yuma_flat_leg", "yuma_flat_leg"),
    ]
    assert len(sizes) == len(contents_broken)


def test_a_tare_of_another_medium_needs_one(config):
    runs = {run.run_id: run for run in plan_runs(config) if run.medium in ("poppy_LP", "")}
    with pytest.raises(InputError, match="has no tare of another medium among these runs; name a"):
        resolve(["wrong_medium_tare"], runs, "poppy_LP")


def test_a_config_without_a_plate(config):
    legs = {
        name: intruder for name, intruder in config.intruders.items() if intruder.shape == "leg"
    }
    with pytest.raises(InputError, match=r"intruders .* plate"):
        plate_of(legs)


def test_a_log_that_cannot_be_removed(monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OutputError, match=r"a\.csv: .*: Permission denied"):
        remove(tmp_path / "a.csv")
