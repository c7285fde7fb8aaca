"""`rftfit inspect` prints config lines that read the logs of other programs.

Where it cannot, it says what the file looks like.
"""

import tracemalloc

import numpy as np
import pandas as pd
import pytest
from log_files import TEXTS, lvm, netft
from makers import json_of
from numpy.testing import assert_allclose, assert_array_equal
from third_party import proposal, read_by

from rftfit import read_log


@pytest.mark.parametrize("name", [name for name in TEXTS if name != "rig"])
def test_the_proposed_config_reads_the_log(name, rftfit, tmp_path):
    """What inspect prints, pasted as it is, gives the quantities that it names."""
    path = tmp_path / "log.txt"
    path.write_bytes(TEXTS[name](30).content)
    output = rftfit("inspect", path)
    assert output.err == ""
    recognised = "none recognises it" if name in ("delimited", "dated") else name
    assert f"dialect: {recognised}" in output.out
    config = proposal(path)
    logs = read_by(path, config)
    assert logs
    assert config.get("clock") == ({"method": "same_clock"} if len(logs) == 2 else None)
    for log in logs.values():
        assert log.size == 30
        assert (np.diff(log.columns["time"]) > 0).all()


@pytest.mark.parametrize("names", ["t_s,Fz_N,z_mm", "t_s,sync,Fz_N,z_mm"])
def test_one_file_for_both_has_one_clock(names, rftfit, tmp_path):
    path = tmp_path / "log.csv"
    cells = names.count(",")
    rows = "".join(f"{row / 10}" + f",{row % 2}" * cells + "\n" for row in range(20))
    path.write_text(f"{names}\n{rows}", "utf-8")
    output = rftfit("inspect", path)
    assert proposal(path)["clock"] == {"method": "same_clock"}
    assert "estimate" not in output.out
    assert "the motion log of the same run" not in output.out


def test_mixed_clocks_are_shown_clock_by_clock(rftfit, tmp_path):
    """The file is no log as it stands, and each half of it is one."""
    path = tmp_path / "log.lvm"
    content = lvm(30).content.replace(b"X0\t0,0000E+0\t0,0000E+0", b"X0\t0,0000E+0\t0,5000E+0")
    path.write_bytes(content)
    answer = json_of("inspect", path)
    names = [[column["name"] for column in clock["columns"]] for clock in answer["clocks"]]
    assert names == [["time", "Force z"], ["time", "z"]]
    output = rftfit("inspect", path, "--plot", tmp_path / "log.png")
    assert output.err == ""
    assert "refused as one log: its channels were not sampled at the same times" in output.out
    assert output.out.count("rows: 30, of which 30 ") == 2
    assert (tmp_path / "log.png").read_bytes().startswith(b"\x89PNG")
    config = proposal(path)
    assert config["clock"] == {"method": "same_clock"}
    force, motion = (log.columns["time"] for log in read_by(path, config).values())
    assert_allclose(motion - force, 0.5)


def test_a_survey_in_blocks_is_that_of_the_whole(tmp_path, monkeypatch):
    path = tmp_path / "log"
    path.write_bytes(netft(3000, lost=7).content)
    whole = json_of("inspect", path)["clocks"][0]
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 40_000)
    assert path.stat().st_size > 5 * 40_000
    (in_blocks,) = json_of("inspect", path)["clocks"]
    for name in ("rows", "used", "missing", "dropped"):
        assert in_blocks[name] == whole[name]
    for column, whole_column in zip(in_blocks["columns"], whole["columns"], strict=True):
        assert column | {"resolution": 0} == whole_column | {"resolution": 0}
    assert in_blocks["clock"]["gaps"] == whole["clock"]["gaps"]
    assert in_blocks["clock"]["duration"] == whole["clock"]["duration"]


def test_a_long_log_needs_no_more_memory_than_a_short_one(tmp_path, monkeypatch):
    """Arrays and texts that Python knows of; 4 MB against 12 MB, in blocks of 1 MB."""
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 1_000_000)
    foreign_log = netft(5000)
    body = b"".join(foreign_log.lines)
    path = tmp_path / "log"
    peaks = []
    for times in (1, 7, 21):  # the first one loads libraries, too
        path.write_bytes(foreign_log.header + body * times)
        tracemalloc.start()
        (clock,) = json_of("inspect", path)["clocks"]
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert clock["rows"] == 5000 * times
    # three times the rows; how many blocks are in memory at once depends on how busy the machine is
    assert peaks[2] < 1.6 * peaks[1]


def test_german_columns_and_a_depth(tmp_path):
    """Force and path of the axes are proposed; z points up, so a depth is turned."""
    path = tmp_path / "Prüfung 1.csv"
    rows = [f"{n},5;1,5;{n},25;0,5;-2,5\n" for n in range(9)]
    head = "Zeit [s];Weg x [mm];Tiefe [mm];Kraft x [N];Kraft z [N]\n"
    path.write_bytes((head + "".join(rows)).encode("cp1252"))
    config = proposal(path)
    assert config["force_log"]["columns"] == {"time": "Zeit", "F1": "Kraft x", "F3": "Kraft z"}
    assert config["motion_log"]["columns"] == {
        "time": "Zeit",
        "x": "Weg x",
        "z": {"column": "Tiefe", "unit": "mm", "factor": -1},
    }


def test_a_text_with_zero_bytes_is_a_damaged_text(rftfit, tmp_path):
    """A logger that lost its power fills the last block of its card with zeros."""
    path = tmp_path / "log.csv"
    rows = [f"{n}.5,{n}.25,0.5\n" for n in range(30)]
    path.write_bytes("".join(["time (s),depth (mm),force (N)\n", *rows]).encode() + bytes(400))
    output = rftfit("inspect", path)
    assert output.err == ""
    assert "rows: 31, of which 30 " in output.out
    assert proposal(path)["motion_log"]["columns"]


WRENCH = """header:
  seq: {0}
  stamp:
    secs: 154698{0}
wrench:
  force:
    x: 0.{0}
    z: -1.5
---
"""


def test_messages_that_nobody_recorded_as_a_table(refusal, tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("".join(WRENCH.format(k) for k in range(9)), "utf-8")
    assert "rostopic echo -p TOPIC" in refusal("inspect", path)
    assert "record with -p" in refusal("inspect", path, "--dialect rostopic")


@pytest.mark.parametrize(
    ("name", "options", "line"),
    [
        ("log.xlsx", {"sheet": "Ru*"}, 'options: {sheet: "Ru*"}'),
        ("log.xlsx", {"sheet": 2}, "options: {sheet: 2}"),
        ("log.npz", {"rate_Hz": 50}, "options: {rate_Hz: 50}"),
        ("log.csv", {"rate_Hz": 50}, 'text: {delimiter: ",", rate_Hz: 50}'),
    ],
)
def test_options_that_were_given_stand_in_the_lines_for_the_config(
    name, options, line, rftfit, tmp_path
):
    """The lines read the log as inspect did, and so does `read_log` with the same options."""
    path = tmp_path / name
    frame = pd.DataFrame({"Fz [N]": np.arange(9.0), "z [mm]": np.arange(9.0)})
    if name.endswith("npz"):
        np.savez(path, **{str(column): frame[column].to_numpy() for column in frame})  # type: ignore[arg-type]
    elif name.endswith("csv"):
        frame.to_csv(path, index=False)
    else:
        with pd.ExcelWriter(path) as book:
            (frame + 1).to_excel(book, sheet_name="Settings", index=False)
            frame.to_excel(book, sheet_name="Run 1", index=False)
    words = [word for key, value in options.items() for word in ("--option", f"{key}={value}")]
    output = rftfit("inspect", path, *words)
    assert line in output.out
    assert_array_equal(read_log(path, options=options).columns["Fz"], np.arange(9.0))
