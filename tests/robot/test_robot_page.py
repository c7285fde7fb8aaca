"""The robot on the report page: tables, numbers for the script, and the script in a browser."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from chromium import Chromium, find
from page_inputs import page_inputs

from rftfit.compare.robot import optima
from rftfit.errors import InputError
from rftfit.model.profiles import TableProfile
from rftfit.page.page import render, write_page
from rftfit.page.robot import RobotTables, read_robot_tables, robot_data, robot_tables
from rftfit.robot.config import paper_robot
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON
from rftfit.store import write_csv
from rftfit.workflow.robot import CURVATURES, FRAMES, FREQUENCIES_HZ, frames_of

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def frames() -> dict[str, Any]:
    return frames_of(paper_robot(), TableProfile.published("poppy_LP"))


@pytest.fixture(scope="module")
def robot(frames: dict[str, Any]) -> RobotTables:
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    parts, runs = [], []
    for name, factor in (("table", 1.1), ("depth_only", 2.0)):
        speed = measured["speed_cm_per_s"] * factor
        parts.append(
            pd.DataFrame(
                {"profile": name, "curvature_times_R": measured["curvature_times_R"],
                 "frequency_Hz": measured["frequency_Hz"], "speed_cm_per_s": speed,
                 "speed_lo_cm_per_s": speed, "speed_hi_cm_per_s": speed, "reason": ""}
            )
        )  # fmt: skip
        grid = [(round(k, 2), f) for k in np.arange(-1, 1.01, 0.2) for f in (1.0, 5.0)]
        table = pd.DataFrame(grid, columns=["curvature_times_R", "frequency_Hz"])
        table["speed_cm_per_s"] = (15 - 4 * (table["curvature_times_R"] - 0.5) ** 2) * table[
            "frequency_Hz"
        ]
        runs.append(
            table.assign(profile=name, medium="poppy_LP", phase_turns=0.0, outcome="steady")
        )
    whole = pd.concat(runs, ignore_index=True)
    return RobotTables(whole, speed_errors(measured, pd.concat(parts)), optima(whole), frames)


def test_tables_say_what_the_errors_say(robot: RobotTables) -> None:
    found = robot_tables(robot)
    assert found is not None
    first, second = found["shares"]
    assert (first["profile"], first["all_20"], first["new_20"]) == (
        "measured table", "42 of 42", "39 of 39",
    )  # fmt: skip
    assert second["all_35"] == "0 of 42"
    assert len(found["rows"]) == 42
    assert sum(row["calibrated"] == "yes" for row in found["rows"]) == 3
    assert found["rows"][0]["simulated"]["depth_only"]["error"] == "+100 %"
    assert [row["curvature"] for row in found["best"]] == ["0.40", "0.40"]
    assert (robot_tables(None), robot_data(None)) == (None, None)


def test_numbers_for_the_script(robot: RobotTables) -> None:
    data = robot_data(robot)
    assert data is not None
    json.dumps(data, allow_nan=False)
    assert [one["curvature"] for one in data["curves"]["table"]] == [
        -1,
        -0.92,
        -0.6,
        0,
        0.6,
        0.92,
        1,
    ]
    assert data["curves"]["table"][0] == {"curvature": -1.0, "f": [1.0, 5.0], "v": [6.0, 30.0]}
    assert sum(data["measured"]["calibrated"]) == 3
    assert len(data["measured"]["frequency_Hz"]) == 42


def test_pictures_are_those_of_the_run(frames: dict[str, Any]) -> None:
    assert len(frames["runs"]) == len(CURVATURES) * len(FREQUENCIES_HZ)
    weight = 150 * 980.665 / 1e5
    for run in frames["runs"]:
        assert len(run["pose"]) == len(run["arrows"]) == FRAMES
        lift = np.mean([sum(arrows[3::4]) for arrows in run["arrows"]]) / 1000
        assert lift == pytest.approx(weight, rel=0.15)
        x = run["pose"][-1][0] * FRAMES / (FRAMES - 1)
        assert x * run["frequency_Hz"] == pytest.approx(run["speed_cm_per_s"], rel=0.1)
        # what is loaded lies below the surface
        assert max(z for arrows in run["arrows"] for z in arrows[1::4]) <= 0.01
    ends = np.array(frames["legs"]["1"])
    assert np.hypot(*(ends[-1] - ends[0])) == pytest.approx(4.1, abs=0.01)


def test_section_only_where_there_is_a_robot(robot: RobotTables) -> None:
    page = render(replace(page_inputs(), robot=robot))
    assert '<section id="robot"' in page
    assert len(page) < 10_000_000
    assert '<section id="robot"' not in render(page_inputs())
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_read_from_disk(robot: RobotTables, tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.csv" for name in ("speed", "errors", "optimum")]
    for path in paths:
        write_csv(getattr(robot, path.stem), path)
    (tmp_path / "frames.json").write_text(json.dumps(robot.frames), encoding="utf-8")
    again = read_robot_tables([*paths, tmp_path / "frames.json"])
    assert robot_tables(again) == robot_tables(robot)
    assert read_robot_tables([]) is None
    (tmp_path / "frames.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match=r"frames\.json: cannot be read"):
        read_robot_tables([*paths, tmp_path / "frames.json"])


PROGRAM = find()


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on this machine")
def test_in_a_browser_by_keyboard(robot: RobotTables, tmp_path: Path) -> None:
    assert PROGRAM is not None
    target = tmp_path / "report.html"
    write_page(replace(page_inputs(), robot=robot), target)
    (tmp_path / "profile").mkdir()
    with Chromium(PROGRAM, tmp_path / "profile") as browser:
        browser.open(target.as_uri())
        assert browser.evaluate("document.querySelectorAll('#robot-chart circle').length") == 42
        assert browser.evaluate("document.querySelectorAll('#robot-chart path').length") == 7
        legs = "[...document.querySelectorAll('#robot-scene .leg.first')].map((l) => l.getAttribute('d')).join()"
        before = browser.evaluate(legs)
        browser.evaluate("document.getElementById('robot-frame').focus()")
        browser.press("ArrowRight", 9)
        assert browser.evaluate("document.getElementById('robot-frame').value") == "9"
        assert browser.evaluate(legs) != before
        run = next(r for r in robot.frames["runs"] if (r["curvature"], r["frequency_Hz"]) == (1, 2))
        arrows = run["arrows"][9]
        assert browser.evaluate("document.querySelectorAll('#robot-scene .arrow').length") == (
            len(arrows) // 4
        )
        text = browser.evaluate("document.getElementById('robot-readout').innerText")
        assert f"{run['speed_cm_per_s']:.1f} cm/s" in text
        assert f"{sum(arrows[3::4]) / 1000:.2f}" in text
        # every leg starts at its hip: the first point of a path lies on the body
        browser.evaluate("document.getElementById('robot-play').focus()")
        browser.evaluate("document.getElementById('robot-play').click()")
        pressed = "document.getElementById('robot-play').getAttribute('aria-pressed')"
        assert browser.evaluate(pressed) == "true"
        browser.evaluate("document.getElementById('robot-play').click()")
        assert browser.evaluate(pressed) == "false"
        assert browser.complaints() == []
