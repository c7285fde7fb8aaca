"""`rftfit check` opens the logs and reports every run that `rftfit run` would drop or flag."""

import json
from collections.abc import Callable

import pytest
from campaigns import Folder
from mistakes import MEDIUM, Case, make

import rftfit


@pytest.fixture
def folder(tmp_path):
    make(tmp_path / "c", Case("one-row", "paper"))
    return Folder(tmp_path / "c")


def check(folder):
    process = folder.rftfit("check")
    return process.returncode, process.stdout + process.stderr


def change(folder, old, new):
    text = folder.config.read_text("utf-8")
    assert old in text
    folder.config.write_text(text.replace(old, new), "utf-8")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("force_unit: N", "force_unit: kN", "F1 in N, but the config says kN"),
        ("position_unit: mm", "position_unit: cm", "in mm, but the config says cm"),
        ("surface_z_mm: 150.0", "surface_z_mm: 20.0", "surface not reached"),
        ("method: sync_line", "method: estimate", "from the pushes straight down that show it, 1:"),
    ],
)
def test_what_holds_for_every_run_is_one_error(folder, old, new, words):
    change(folder, old, new)
    code, output = check(folder)
    assert words in output
    assert code == 2
    drop_lines = [line for line in output.splitlines() if "would be dropped" in line]
    assert 1 <= len(drop_lines) <= 4
    assert " of 12 " in drop_lines[0]
    assert f" {MEDIUM}_" in drop_lines[0]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("raw: raw/paper", "raw: raw/paper"),  # nothing is wrong
        ("z: -F3", "z: +F3"),  # runs are flagged
        ("force_unit: N", "force_unit: kN"),  # logs cannot be used
        ("published_as: ", "publish_as: "),  # an error in the config
        ("dialect: rig", "dialect: ricg"),
    ],
)
def test_the_api_returns_what_the_command_prints(folder, old, new):
    change(folder, old, new)
    answer = json.loads(folder.rftfit("check", "--json").stdout)
    messages = [problem["message"] for problem in answer["problems"]]
    assert messages == [str(problem) for problem in rftfit.check(folder.root)]
    assert bool(messages) == (old != new)
    # with a log there is something better to say than what a plan can tell
    assert answer["plan"] == []


def test_a_turned_sign_is_told(folder):
    change(folder, "z: -F3", "z: +F3")
    code, output = check(folder)
    assert code == 0
    assert "runs would be flagged" in output
    assert "the medium would push the plate along: check the signs in transducer.axes" in output


def test_what_a_run_would_drop_is_what_check_tells(folder):
    """Several damages at once: each is told, the run drops the same runs, and nothing else."""
    raw = folder.root / "raw" / "paper" / MEDIUM
    damages: dict[str, Callable[[str], str]] = {
        f"{MEDIUM}_bp00_g90_in": lambda text: text[: len(text) // 2],
        f"{MEDIUM}_bp00_g60_in": lambda text: text.replace(",", ";"),
        f"{MEDIUM}_bp00_g30_ex": lambda _: "",
        f"{MEDIUM}_bp00_g30_in": lambda text: "\n".join(text.splitlines()[:4]),
    }
    for name, damage in damages.items():
        path = raw / f"{name}_force.csv"
        path.write_text(damage(path.read_text("utf-8")), "utf-8")
    code, output = check(folder)
    assert code == 0
    damaged_runs = {name for name in damages if f"{name} (row" in output}
    folder.run_here("checks")
    fits = folder.table(f"fits/{MEDIUM}.csv")
    lost = set(fits.loc[fits["alpha_z_N_per_cm3"].isna(), "run_id"])
    flagged = set(folder.table(f"flags/{MEDIUM}.csv")["run_id"])
    assert damaged_runs == set(damages)
    assert lost | flagged == damaged_runs
    assert len(lost) >= 3


def test_a_log_that_is_too_large_is_left_to_the_run(folder, monkeypatch):
    monkeypatch.setattr("rftfit.measure.preview.LARGEST_BYTES", 1000)
    code, output = check(folder)
    assert code == 0
    assert "12 runs with a log of more than 0.001 MB, not opened" in output


def test_an_unknown_dialect_is_told_before_any_job(folder):
    text = folder.config.read_text("utf-8")
    folder.config.write_text(f"{text}\nforce_log: {{dialect: ricg}}\n", "utf-8")
    for command in ("check", "run"):
        process = folder.rftfit(command)
        assert process.returncode == 2
        assert "log dialect: found 'ricg'; allowed: " in process.stdout + process.stderr
    assert not (folder.root / "results" / "runs").exists()
