"""Digests, records and csv texts come back unchanged, and changed code touches the right jobs.

They are the parts behind provenance and `rftfit verify`. Digest: the SHA-256 sum of a file.
"""

import csv
import hashlib
import os
import random
from pathlib import Path

import pandas as pd
import pytest

from rftfit.store import digests, read_csv, write_csv
from rftfit.store.digests import digests_of_files
from rftfit.workflow.state import read_states

PACKAGE = Path(digests.__file__).parents[1]
SIGNS = "=+-@\t\r\n\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH COMMERCIAL AT}"
"""First characters that make a spreadsheet take text for a formula."""


# --- digests -------------------------------------------------------------------------------------------


@pytest.mark.skipif(os.name != "posix", reason="names are text on Windows")
def test_pipes_devices_folders_and_nothing_are_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    odd = os.fsdecode(b"caf\xe9.csv")
    (tmp_path / odd).write_bytes(b"1")
    digests_found = digests_of_files(tmp_path, ["pipe", "folder", "absent", "a\0b", odd])
    assert digests_found == dict.fromkeys(("pipe", "folder", "absent", "a\0b"), "") | {
        odd: hashlib.sha256(b"1").hexdigest()
    }


# --- digests of code ---------------------------------------------------------------------------------


JOBS = [("ingest", "poppy_LP"), ("tare", "poppy_LP"), ("fourier", "")]
JOBS += [("robot_runs", "runs_table"), ("page", "")]


def code_by_rule(config):
    digests.source_digests.cache_clear()
    states = read_states(config)
    return {rule: states.state_of(rule, key)["code"] for rule, key in JOBS}


@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("measure/slopes.py", {"ingest", "tare", "fourier", "robot_runs", "page"}),
        ("reference/table_s3.csv", {"ingest", "tare", "fourier", "robot_runs", "page"}),
        ("workflow/job.py", {"ingest", "tare", "fourier", "robot_runs", "page"}),
        ("model/shapes.py", {"fourier", "robot_runs", "page"}),
        ("workflow/profiles.py", {"fourier"}),
        ("page/page.js", {"page"}),
        ("config/robot.yaml", {"fourier", "robot_runs", "page"}),
        ("cli/run.py", set()),
    ],
)
def test_which_jobs_a_changed_file_of_the_program_touches(
    robot_campaign, monkeypatch, file, changed
):
    config = robot_campaign / "config" / "config.yaml"
    codes_before, plain = code_by_rule(config), digests.sha256_of

    def sha256_changed(path):
        return "0" * 64 if str(path).endswith(f"/{file}") else plain(path)

    monkeypatch.setattr(digests, "sha256_of", sha256_changed)
    codes_after = code_by_rule(config)
    monkeypatch.undo()
    digests.source_digests.cache_clear()
    assert {rule for rule in codes_before if codes_before[rule] != codes_after[rule]} == changed


# --- the robot ---------------------------------------------------------------------------------------


@pytest.fixture
def robot_campaign(tmp_path):
    """One plate run, one trial of the robot, a robot of its own."""
    root = tmp_path / "campaign"
    (root / "raw" / "paper" / "robot").mkdir(parents=True)
    (root / "config").mkdir()
    config_folder = PACKAGE.parents[1] / "config"
    text = (config_folder / "config.yaml").read_text("utf-8")
    text = text.replace("robot:", "robot:\n  file: config/mine.yaml", 1)
    (root / "config" / "config.yaml").write_text(text, "utf-8")
    (root / "config" / "mine.yaml").write_bytes((config_folder / "robot.yaml").read_bytes())
    (root / "raw" / "paper" / "runs.csv").write_text(
        "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
        "p1,plate,poppy_LP,plate,intrusion,0,90,f.csv,m.csv\n",
        "utf-8",
    )
    (root / "raw" / "paper" / "robot" / "runs.csv").write_text(
        "run_id,condition,medium,curvature_times_R,frequency_Hz,track\na1,a,poppy_LP,1,2,a1.csv\n",
        "utf-8",
    )
    (root / "raw" / "paper" / "robot" / "a1.csv").write_text("t_s,x_cm,z_cm\n0,0,0\n", "utf-8")
    return root


def test_the_robots_files_are_watched(robot_campaign):
    states = read_states(robot_campaign / "config" / "config.yaml")
    names = {"config/mine.yaml", "raw/paper/robot/runs.csv", "raw/paper/robot/a1.csv"}
    assert names == states.robot_digests.keys()
    for name in sorted(names):
        path = robot_campaign / name
        content = path.read_bytes()
        # the sheet has to stay readable, a track and a comment need not
        new = (
            content.replace(b",1,2,", b",1,3,")
            if name.endswith("runs.csv")
            else content + b"# changed\n"
        )
        path.write_bytes(new)
        changed = read_states(robot_campaign / "config" / "config.yaml")
        for job, watches in (
            (("robot_measured", ""), True),
            (("robot_runs", "runs_table"), True),
            (("fourier", ""), False),
        ):
            assert (states.state_of(*job) != changed.state_of(*job)) is watches, job
        path.write_bytes(content)


# --- text that a spreadsheet would calculate ---------------------------------------------------------


WRITTEN = {
    "=1+1": "'=1+1",
    "+SUM(A1)": "'+SUM(A1)",
    "-2+3": "'-2+3",
    "@A1": "'@A1",
    "\t=1": "'\t=1",
    "\r=1": "'\n=1",
    "'=1": "''=1",
    "-": "'-",
    "-5": "-5",
    "+0.25": "+0.25",
    "-1e-3": "-1e-3",
    "a=1": "a=1",
    "it's": "it's",
    "": "",
}
"""How a text stands in a csv."""


def test_text_is_guarded_numbers_are_left_and_tables_come_back(tmp_path):
    pick = random.Random(3)
    signs = [*SIGNS, *"'\",;1a "]
    texts = [*WRITTEN, *("".join(pick.choices(signs, k=pick.randint(1, 6))) for _ in range(600))]
    table = pd.DataFrame(
        {
            "run_id": [f"r{i}" for i in range(len(texts))],
            "note": texts,
            "kind": pd.Categorical(texts),
            "force_N": [-i / 7 for i in range(len(texts))],
        }
    )
    write_csv(table, tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
        cells = [row["note"] for row in csv.DictReader(file)]
    assert dict(zip(WRITTEN, cells, strict=False)) == WRITTEN
    plain_texts = [text.replace("\r\n", "\n").replace("\r", "\n") for text in texts]
    for cell, plain in zip(cells, plain_texts, strict=True):
        assert cell[:1] not in SIGNS or not cell or float(cell) == float(plain)
    table_read = read_csv(tmp_path / "t.csv", lambda name: "" if name == "force_N" else "text")
    assert table_read["note"].tolist() == table_read["kind"].tolist() == plain_texts
    assert table_read["force_N"].to_numpy() == pytest.approx(table["force_N"].to_numpy(), rel=1e-5)
