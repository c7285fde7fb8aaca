"""`rftfit reenact` writes simulated logs and never changes a file that it did not write."""

import errno
import os
import re
from pathlib import Path

import pytest
from makers import read_rows, run_command

import rftfit as program

MARKER = "REENACTED.txt"
"""File that lists what the re-enactment wrote."""
QUICK = "reenact --media yuma"
"""A command line of one medium, which has few runs."""
LOG = "yuma/yuma_bp00_g90_in_force.csv"
"""One of the logs that it writes."""


def contents(folder):
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_what_is_written(campaign):
    raw = campaign / "raw" / "paper"
    files = contents(raw)
    assert len(files) == 2 * 8 + 2
    marker = files.pop(MARKER).decode()
    assert "not original recordings" in marker
    assert "seed 2013, media: yuma, faults: none" in marker
    listed = {}
    for line in marker.split("):\n")[1].splitlines():
        size, name = line.split(" ", 1)
        listed[name] = size
    assert listed == {name: str(len(content)) for name, content in files.items()}


def test_an_empty_folder_gets_the_config_of_the_demonstration(tmp_path):
    (tmp_path / ".git").mkdir()
    written = run_command(tmp_path, *QUICK.split())
    assert written.returncode == 0, written.stderr
    assert "folder was empty: config/config.yaml" in written.stdout
    assert run_command(tmp_path, "check").returncode == 0
    # what is there is never taken for empty, nor written over
    (tmp_path / "config" / "config.yaml").unlink()
    refused = run_command(tmp_path, *QUICK.split())
    assert refused.returncode == 2
    assert "rftfit init FOLDER, or rftfit reenact in an empty folder" in refused.stderr
    assert not (tmp_path / "config" / "config.yaml").exists()


@pytest.fixture(scope="module")
def poppy(tmp_path_factory):
    """Loose poppy seeds without tares and legs: what the command says, rows of the sheet and of the robot's trials."""
    folder = tmp_path_factory.mktemp("poppy")
    written = run_command(folder, "reenact", "--media", "poppy_LP", "--no-tare", "--no-legs")
    raw = folder / "raw" / "paper"
    return written.stdout, read_rows(raw / "runs.csv"), read_rows(raw / "robot" / "runs.csv")


def test_the_trials_of_the_robot_are_counted(poppy):
    said, rows, trials = poppy
    assert f"logs of {len(rows)} runs and {len(trials)} trials of the robot" in said


def test_every_cell_of_table_s5_is_measured(poppy):
    """A pull is the push of the mirror image; a plate at -90 degrees is that at 90."""
    cells = set()
    for row in poppy[1]:
        sign = -1 if row["direction"] == "extraction" else 1
        beta_deg, gamma_deg = float(row["beta_deg"]), sign * float(row["gamma_deg"])
        for same_plate in {beta_deg, -beta_deg if beta_deg == 90 else beta_deg}:
            cells.add((sign * same_plate, round(gamma_deg, 1)))
    table = program.published_table("table_s5").query("medium == 'poppy_LP'")
    assert cells == {*zip(table["beta_deg"], table["gamma_deg"].round(1), strict=True)}


def test_each_fault_has_a_plate_of_its_own(poppy, tmp_path):
    listed = run_command(tmp_path, "reenact", "--list-faults").stdout.splitlines()[1:]
    endings = [line.split()[1] for line in listed]
    assert len(set(endings)) == len(endings) > 10
    assert {f"poppy_LP_{ending}" for ending in endings} <= {row["run_id"] for row in poppy[1]}


def test_again_with_another_seed_and_medium(rftfit, campaign):
    raw = campaign / "raw" / "paper"
    files_before, contents_of_air = contents(raw), contents(raw / "air")
    assert "17 files " in rftfit(QUICK).out
    assert contents(raw) == files_before
    rftfit(QUICK, "--seed 7")
    assert contents(raw)[LOG] != files_before[LOG]
    rftfit("reenact --media palms29")
    assert sorted(path.name for path in raw.iterdir()) == [MARKER, "air", "palms29", "runs.csv"]
    # runs in air are those of any medium
    assert contents(raw / "air") == contents_of_air
    rftfit("check --strict")


def test_faults(rftfit, campaign):
    output = rftfit(QUICK, "--fault empty:yuma_c_leg --fault missing_log")
    assert "fault empty: yuma_c_leg: " in output.out
    raw = campaign / "raw" / "paper"
    assert (raw / "yuma/yuma_c_leg_force.csv").read_bytes() == b""
    assert "faults: empty:yuma_c_leg, missing_log" in (raw / MARKER).read_text("utf-8")
    # files with a fault are of the re-enactment too
    rftfit(QUICK)
    assert (raw / "yuma/yuma_c_leg_force.csv").stat().st_size > 1000


def test_if_missing(rftfit, campaign):
    raw = campaign / "raw" / "paper"
    (raw / "mine.csv").write_text("mine")
    files_before = contents(raw)
    assert "is there already: nothing to do" in rftfit(QUICK, "--if-missing --seed 5").out
    assert contents(raw) == files_before
    (raw / "mine.csv").unlink()
    # stopped half way: the sheet is written last
    (raw / "runs.csv").unlink()
    (raw / LOG).unlink()
    rftfit(QUICK, "--if-missing")
    del files_before["mine.csv"]
    assert contents(raw) == files_before


def refused(refusal, campaign, text, command=QUICK):
    files_before = contents(campaign)
    assert text in refusal(command)
    assert contents(campaign) == files_before


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("--media popy_LP", "did you mean 'poppy_LP'"),
        ("--grid scattered:501", "(1 to 500)"),
        ("--media yuma --fault gapp", "did you mean 'gap'"),
        ("--media poppy_LP --fault gap:poppy_LP_c_lag", "did you mean 'poppy_LP_c_leg'"),
        ("--media yuma --fault flipped_beta:yuma_bp00_g90_in", "same with -beta"),
        ("--media yuma --fault never_touches:yuma_c_leg", "is a leg"),
        ("--media poppy_LP --fault wrong_medium_tare", "no tare of another medium"),
    ],
)
def test_words_that_do_not_fit(refusal, campaign, words, text):
    refused(refusal, campaign, text, f"reenact {words}")


@pytest.mark.parametrize(
    ("file", "added", "words"),
    [
        (MARKER, None, "not from rftfit reenact"),
        ("yuma/mine.csv", "mine", "yuma/mine.csv is not as rftfit reenact wrote them"),
        (LOG, "1,1,1,1,1\n", f"{LOG} is not as"),
        ("runs.csv", "mine\n", "runs.csv is not as"),
        (MARKER, "1 ../../config/config.yaml\n", "this list has been changed"),
        (MARKER, "x y\n", "this list has been changed"),
        (MARKER, "nonsense\n", "this list has been changed"),
    ],
)
def test_files_that_the_reenactment_did_not_write(refusal, campaign, file, added, words):
    path = campaign / "raw" / "paper" / file
    if added is None:
        path.unlink()
    else:
        with path.open("a", encoding="utf-8") as handle:
            handle.write(added)
    refused(refusal, campaign, words)


def test_links_lead_nowhere(refusal, campaign):
    elsewhere = campaign / "elsewhere"
    (campaign / "raw/paper/yuma").rename(elsewhere)
    (campaign / "raw/paper/yuma").symlink_to(elsewhere)
    refused(refusal, campaign, "link-in-the-way")


def test_a_sheet_of_somebody_else(rftfit, refusal, campaign):
    config = campaign / "config" / "config.yaml"
    text = config.read_text("utf-8").replace("raw/paper", "raw/new")
    config.write_text(text.replace("raw/new/runs.csv", "config/runs.csv"), "utf-8")
    sheet = campaign / "config" / "runs.csv"
    sheet.write_text("run_id,kind\np1,plate\n")
    refused(refusal, campaign, "../../config/runs.csv is not from rftfit reenact")
    # one without a run is nobody's work
    sheet.write_text("run_id,kind\n")
    rftfit(QUICK)
    rftfit(QUICK)
    rftfit("check")


def test_a_killed_writer_leaves_a_part(rftfit, campaign):
    raw = campaign / "raw" / "paper"
    files_before = contents(raw)
    partial_file = raw / "yuma" / ".yuma_bp00_g90_in_force.123.part.csv"
    partial_file.write_text("half")
    rftfit(QUICK)
    assert contents(raw) == files_before


def test_stopped_half_way(rftfit, campaign, monkeypatch):
    def stop(*_, **__):
        (campaign / "raw/paper/yuma").mkdir()
        (campaign / "raw/paper" / LOG).write_text("half a log")
        raise KeyboardInterrupt

    files_before = contents(campaign)
    with monkeypatch.context() as patch:
        patch.setattr("rftfit.lab.enact.run_logs", stop)
        rftfit(QUICK, code=130)
    assert sorted(contents(campaign / "raw/paper")) == [MARKER, LOG]
    rftfit(QUICK, "--if-missing")
    assert contents(campaign) == files_before


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("raw: raw/paper", "raw: ../paper", "key raw: found '../paper'"),
        ("raw: raw/paper", "raw: .", "a folder below the campaign's own"),
        ("run_sheet: raw/paper/runs.csv", "run_sheet: runs.xlsx", "a .csv file"),
        ("run_sheet: raw/paper/runs.csv", "run_sheet: /runs.csv", "key run_sheet"),
        (
            "plate, length_cm: 3.81, width_cm: 2.54",
            "disc, diameter_cm: 4",
            "no entry of shape plate",
        ),
        ("dialect: rig", "dialekt: rig", "did you mean 'dialect'?"),
        ("published_as: ", "note: ", "no medium here names published measurements"),
    ],
)
def test_configs_that_cannot_be_used(refusal, campaign, key, value, text):
    config = campaign / "config" / "config.yaml"
    config.write_text(config.read_text("utf-8").replace(key, value), "utf-8")
    refused(refusal, campaign, text, "reenact")


def test_a_container_that_is_too_small(refusal, campaign):
    config = campaign / "config" / "config.yaml"
    config.write_text(config.read_text("utf-8").replace("length_cm: 24,", "length_cm: 17,"))
    refused(refusal, campaign, "no fit window", "reenact")


def test_raw_that_is_a_file(refusal, campaign):
    (campaign / "raw").rename(campaign / "old")
    (campaign / "raw").mkdir()
    (campaign / "raw" / "paper").write_text("")
    refused(refusal, campaign, "this is no folder")


DENIED = PermissionError(errno.EACCES, "Permission denied", "raw/yuma")


def refuse(*_, **__):
    raise DENIED


def test_earlier_logs_that_cannot_be_touched(rftfit, refusal, campaign, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", refuse)
        told = rftfit(QUICK, "--seed 7", code=3).err
        assert re.search(r"runs\.csv: .*: Permission denied", told)
    with monkeypatch.context() as patch:
        patch.setattr(os, "walk", lambda *_, onerror, **__: onerror(DENIED))
        assert re.search(r"raw/yuma: .*: Permission denied", refusal(QUICK))
    (campaign / "raw" / "paper" / MARKER).write_bytes(b"\xff\xfe")
    refused(refusal, campaign, f"{MARKER}: cannot be read: ")
