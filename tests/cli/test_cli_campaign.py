"""`rftfit init` makes a campaign and overwrites nothing, and `rftfit check` lists all problems."""

import json
import re
from pathlib import Path

import pytest

import rftfit as package


def test_init(rftfit, tmp_path):
    folder = tmp_path / "new é one"
    output = rftfit("init", folder)
    for name in ("config/config.yaml", "config/runs.csv", "raw/README.md"):
        assert f"  {name}\n" in output.out
    assert f'cd "{folder}"' in output.out


def test_check(rftfit, campaign):
    output = rftfit("check")
    assert output.err == ""
    lines = {line.split()[0]: line.split()[1:] for line in output.out.splitlines() if line.strip()}
    # plate, rod, leg, leg_air, excluded, logs, missing
    assert lines["yuma"][:7] == ["1", "1", "3", "0", "0", "10", "0"]
    assert lines["(in"][1:8] == ["0", "0", "0", "3", "0", "6", "0"]
    size = sum(path.stat().st_size for path in (campaign / "raw").rglob("*_*.csv"))
    assert f"8 runs, 16 logs, {size / 1e6:.1f} MB" in output.out
    assert output.out.endswith("0 errors, 0 warnings.\n")


def test_check_from_another_folder(rftfit, campaign, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert "8 runs" in rftfit("check --config", campaign / "config" / "config.yaml").out


def test_check_warnings(rftfit, campaign):
    (campaign / "raw/paper/yuma/yuma_bp00_g90_in_force.csv").unlink()
    output = rftfit("check")
    assert output.out.endswith("0 errors, 1 warning.\n")
    assert "1 warning:\n" in output.out
    assert "yuma_bp00_g90_in_force.csv" in output.out
    row = next(line for line in output.out.splitlines() if line.startswith("  yuma "))
    assert row.split()[6:8] == ["9", "1"]
    rftfit("check --strict", code=2)


def test_check_shows_every_problem(rftfit, campaign):
    sheet = campaign / "raw/paper/runs.csv"
    sheet.write_text(
        sheet.read_text("utf-8")
        .replace(",yuma,plate,", ",yumma,plate,")
        .replace("rotation", "rotatoin"),
        "utf-8",
    )
    problems = package.check(campaign)
    output = rftfit("check", code=2)
    assert len(problems) > 5
    assert "did you mean 'yuma'?" in output.out
    assert f"{len(problems)} errors, 0 warnings." in output.out
    report = json.loads(rftfit("check --json", code=2).out)
    messages = [problem["message"] for problem in report["problems"]]
    assert messages == [str(problem) for problem in problems]
    assert (report["errors"], report["warnings"], report["campaign"]) == (len(problems), 0, None)
    word = next(problem for problem in report["problems"] if problem["nearest"] == "yuma")
    assert (word["found"], word["place"]["column"]) == ("yumma", "medium")


@pytest.mark.parametrize("command", ["check", "run", "verify", "sweep"])
def test_outside_a_campaign_the_near_ones_are_named(command, rftfit, campaign, monkeypatch):
    for start_folder, campaign_path in ((campaign / "raw", ".."), (campaign.parent, campaign.name)):
        monkeypatch.chdir(start_folder)
        output = rftfit(command, code=2)
        assert f"({campaign_path})" in output.out + output.err


def test_a_file_that_may_not_be_read(rftfit, work_folder, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied", "config.yaml")

    (work_folder / "config.yaml").write_text("title: a\n")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    output = rftfit("check --config config.yaml", code=2)
    assert re.search("config.yaml: .*: Permission denied", output.out)
