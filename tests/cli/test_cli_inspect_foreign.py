"""`rftfit inspect` prints config lines that read the logs of other programs.

Where it cannot, it says what the file looks like.
"""

import numpy as np
import pandas as pd
import pytest
import yaml
from log_files import TEXTS, lvm, netft
from numpy.testing import assert_allclose, assert_array_equal

from rftfit import read_log
from rftfit.campaign.config import ForceLog, MotionLog
from rftfit.logs.inspect import survey, survey_file
from rftfit.logs.registry import dialect, source_reader
from rftfit.measure.log_columns import columns_asked, map_columns

UNITS = {
    **dict.fromkeys(("F1", "F2", "F3"), "N"),
    "time": "s",
    "x": "mm",
    "z": "mm",
    "angle": "deg",
    "arm_moving": "",
}
"""Units in which the program wants each quantity."""


def block(output):
    """The lines for config.yaml, as YAML."""
    _, _, text = output.out.partition("for config.yaml")
    lines = [line[2:] for line in text.splitlines()[1:] if line.startswith("  ")]
    config = yaml.safe_load("\n".join(lines))
    assert isinstance(config, dict)
    return config


@pytest.mark.parametrize("name", [name for name in TEXTS if name != "rig"])
def test_the_proposed_config_reads_the_log(name, rftfit, tmp_path):
    """What inspect prints, pasted as it is, gives the quantities that it names."""
    path = tmp_path / "log.txt"
    path.write_bytes(TEXTS[name](30).content)
    output = rftfit("inspect", path)
    assert output.err == ""
    recognised = "none recognises it" if name in ("delimited", "dated") else name
    assert f"dialect: {recognised}" in output.out
    config = block(output)
    has_both_logs = {"force_log", "motion_log"} <= config.keys()
    assert config.pop("clock", {}) == ({"method": "same_clock"} if has_both_logs else {})
    assert config
    for key, values in config.items():
        source = (ForceLog if key == "force_log" else MotionLog).model_validate(values)
        log = map_columns(source_reader(source, "rig", key).load(path), source, UNITS, key)
        assert log.size == 30
        assert set(log.columns) <= set(UNITS) or not source.columns
        assert (np.diff(log.columns["time"]) > 0).all()
        assert all(log.units[name] == UNITS[name] for name in set(log.columns) & set(UNITS))


@pytest.mark.parametrize("names", ["t_s,Fz_N,z_mm", "t_s,sync,Fz_N,z_mm"])
def test_one_file_for_both_has_one_clock(names, rftfit, tmp_path):
    path = tmp_path / "log.csv"
    cells = names.count(",")
    rows = "".join(f"{row / 10}" + f",{row % 2}" * cells + "\n" for row in range(20))
    path.write_text(f"{names}\n{rows}", "utf-8")
    output = rftfit("inspect", path)
    assert block(output)["clock"] == {"method": "same_clock"}
    assert "estimate" not in output.out
    assert "the motion log of the same run" not in output.out


def test_mixed_clocks_are_shown_clock_by_clock(rftfit, tmp_path):
    """The file is no log as it stands, and each half of it is one."""
    path = tmp_path / "log.lvm"
    content = lvm(30).content.replace(b"X0\t0,0000E+0\t0,0000E+0", b"X0\t0,0000E+0\t0,5000E+0")
    path.write_bytes(content)
    reader = dialect("lvm")
    (force, motion), refused = survey_file(reader, path)
    assert refused is not None
    assert refused.code == "clocks"
    assert [list(survey.units.items()) for survey in (force, motion)] == [
        [("time", "s"), ("Force z", "N")],
        [("time", "s"), ("z", "mm")],
    ]
    assert (force.used, motion.used) == (30, 30)
    output = rftfit("inspect", path, "--plot", tmp_path / "log.png")
    assert output.err == ""
    assert "refused as one log: its channels were not sampled at the same times" in output.out
    assert output.out.count("rows: 30, of which 30 ") == 2
    assert (tmp_path / "log.png").read_bytes().startswith(b"\x89PNG")
    config = block(output)
    assert config.pop("clock") == {"method": "same_clock"}
    times = []
    for key, model in (("force_log", ForceLog), ("motion_log", MotionLog)):
        source = model.model_validate(config[key])
        log = source_reader(source, "rig", key).only(columns_asked(source)).load(path)
        times.append(map_columns(log, source, UNITS, key).columns["time"])
    assert_allclose(times[1] - times[0], 0.5)


def test_a_survey_in_blocks_is_that_of_the_whole(tmp_path, monkeypatch):
    path = tmp_path / "log"
    foreign_log = netft(3000, lost=7)
    path.write_bytes(foreign_log.content)
    whole_survey = survey([foreign_log.reader.load(path)])
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 40_000)
    blocks = list(foreign_log.reader.stream(path))
    assert len(blocks) > 5
    block_survey = survey(blocks)
    assert (block_survey.rows, block_survey.used, block_survey.missing) == (
        whole_survey.rows,
        whole_survey.used,
        whole_survey.missing,
    )
    assert block_survey.clock is not None
    assert whole_survey.clock is not None
    assert block_survey.clock.gaps == whole_survey.clock.gaps
    assert block_survey.clock.duration == whole_survey.clock.duration
    for column, whole_column in zip(block_survey.columns, whole_survey.columns, strict=True):
        assert (column.name, column.lowest, column.highest) == (
            whole_column.name,
            whole_column.lowest,
            whole_column.highest,
        )


def test_a_long_log_needs_no_more_memory_than_a_short_one(tmp_path, monkeypatch):
    """Arrays and texts that Python knows of; 4 MB against 12 MB, in blocks of 1 MB."""
    import tracemalloc

    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 1_000_000)

    foreign_log = netft(5000)
    body = b"".join(foreign_log.lines)
    path = tmp_path / "log"
    peaks = []
    for times in (7, 21):
        path.write_bytes(foreign_log.header + body * times)
        tracemalloc.start()
        rows = survey(foreign_log.reader.stream(path)).rows
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert rows == 5000 * times
    # three times the rows; how many blocks are in memory at once depends on how busy the machine is
    assert peaks[1] < 1.6 * peaks[0]


def test_german_columns_and_a_depth(rftfit, tmp_path):
    """Force and path of the axes are proposed; z points up, so a depth is turned."""
    path = tmp_path / "Prüfung 1.csv"
    rows = [f"{n},5;1,5;{n},25;0,5;-2,5\n" for n in range(9)]
    head = "Zeit [s];Weg x [mm];Tiefe [mm];Kraft x [N];Kraft z [N]\n"
    path.write_bytes((head + "".join(rows)).encode("cp1252"))
    config = block(rftfit("inspect", path))
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
    assert block(output)["motion_log"]["columns"]


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
    source = ForceLog.model_validate(block(output)["force_log"])
    log = read_log(path, options=options)
    config_log = source_reader(source, "rig", "force_log").load(path)
    assert_array_equal(config_log.columns["Fz"], np.arange(9.0))
    assert_array_equal(log.columns["Fz"], np.arange(9.0))
    assert ("time" in config_log.columns) == ("rate_Hz" in options)
