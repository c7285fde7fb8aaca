"""The simulated lab writes the same log files for the same seed, and faults only where asked."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import pytest
from campaigns import FEW

from rftfit.errors import InputError, OutputError
from rftfit.lab.enact import prepare
from rftfit.lab.marker import MARKER, remove
from rftfit.lab.plan import plan_runs, plate_of
from rftfit.lab.rig import FAULTS


def _contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != MARKER)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_same_seed_same_bytes(config, tmp_path):
    first_folder, second_folder, sand_folder = (
        tmp_path / name for name in ("one", "two parts", "part")
    )
    selection: Any = {"media": ["poppy_LP"], "directions": FEW}
    planned, run_count = len(plan_runs(config, **selection)), len(plan_runs(config))
    assert run_count == 933
    sizes = prepare(config, **selection).write(first_folder, first_folder / "runs.csv")
    prepare(config, **selection).write(second_folder, second_folder / "runs.csv")
    prepare(config, media=["yuma"]).write(sand_folder, sand_folder / "runs.csv")
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


def test_folder_that_cannot_be_written(config, tmp_path):
    blocked = tmp_path / "raw"
    blocked.write_text("a file, no folder", encoding="utf-8")
    with pytest.raises(OutputError, match="cannot write"):
        prepare(config, media=["poppy_LP"]).write(blocked, tmp_path / "runs.csv")
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
        prepare(config, media=media, faults=[fault]).write(tmp_path, tmp_path / "runs.csv")
    assert not list(tmp_path.iterdir())


def test_default_runs_exist(runs):
    endings = {ending for ending, _ in FAULTS.values()}
    assert len(endings) == len(FAULTS)
    for ending in endings:
        assert runs[f"poppy_LP_{ending}"].kind == "plate"


def test_a_tare_of_another_medium_needs_one(config):
    with pytest.raises(InputError, match="has no tare of another medium among these runs; name a"):
        prepare(config, media=["poppy_LP"], faults=["wrong_medium_tare"])


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
