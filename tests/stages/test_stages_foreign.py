"""Logs of other programs give the same alpha as the rig's logs and pass the same checks."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import yaml
from campaigns import RigRoom, run_rules
from log_files import netft, told
from makers import answer_of, json_of
from measured import chain

import rftfit
from rftfit.workflow.state import read_states

RUN = "poppy_LP_bp30_g45_in"
FORCE_LOG = f"poppy_LP/{RUN}_force.csv"
SECTIONS = """
force_log:
  dialect: instron
  columns:
    time: {column: Zeit, unit: ms}
    arm_moving: Sync
    F1: {column: Kx, unit: mN}
    F2: {column: Ky, unit: mN}
    F3: {column: Kz, unit: mN, factor: -1}
motion_log:
  text: {delimiter: blank, names: false, skip_lines: 1}
  columns:
    time: {column: 2, unit: s}
    x: {column: 3, unit: m}
    z: {column: 4, unit: m}
"""


def table(content):
    lines = [line for line in content.decode().splitlines() if line and not line.startswith("#")]
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])


def change_config(room, key, value):
    """Set a dotted key; None removes it."""
    config = section = yaml.safe_load(room.config)
    *path, last = key.split(".")
    for name in path:
        section = section[name]
    section.pop(last, None)
    section |= {} if value is None else {last: value}
    room.config = yaml.safe_dump(config, sort_keys=False)


def csv_lines(head, rows):
    return ("\n".join([head, *(",".join(map(repr, row)) for row in rows), ""])).encode()


def as_instron(content):
    lines = ["Zeit;Sync;Kx;Ky;Kz", "(ms);();(mN);(mN);(mN)"]
    for time, line, *forces in table(content).tolist():
        x, y, z = (1e3 * force for force in forces)
        lines.append(f"{1e3 * time:.6f};{line:.0f};{x:.6f};{y:.6f};{-z:.6f}".replace(".", ","))
    return ("\r\n".join(lines) + "\r\n").encode("cp1252")


def as_blanks(content):
    lines = ["made by the arm"]
    for number, (time, x, z, _) in enumerate(table(content).tolist()):
        lines.append(f"  {number}\t{time:.9f}  {x / 1e3:.9f} {z / 1e3:.9f}")
    return ("\n".join(lines) + "\n").encode()


def room_of(folder, **sections):
    """A run with its tare; some sections of its config replaced."""
    room = RigRoom(folder).add(RUN)
    room.config = yaml.safe_dump({**yaml.safe_load(room.config), **sections}, sort_keys=False)
    return room


def assert_same_alpha(row, expected, rel):
    for name in ("alpha_z_N_per_cm3", "alpha_x_N_per_cm3"):
        assert row[name] == pytest.approx(expected[name], rel=rel)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return room_of(tmp_path_factory.mktemp("rig")).chain()


@pytest.fixture
def foreign(tmp_path):
    room = room_of(tmp_path / "other", **yaml.safe_load(SECTIONS))
    for name, content in room.logs.items():
        room.logs[name] = as_instron(content) if "force" in name else as_blanks(content)
    return room


def test_the_same_traces(rig, foreign):
    results = foreign.chain()
    for name in ("time_s", "x_cm", "depth_cm", "force_z_N", "force_x_N"):
        np.testing.assert_allclose(results.traces[name], rig.traces[name], rtol=0, atol=1e-6)
    # the rig measures the angle, with its noise; here it is the run sheet's
    np.testing.assert_allclose(results.traces["angle_deg"], rig.traces["angle_deg"], atol=0.2)
    assert_same_alpha(results.fit(RUN), rig.fit(RUN), 1e-3)


def test_every_row_is_accounted_for(foreign):
    """With rows cut out, damaged and cut short."""

    def damage(text):
        lines = text.split("\n")
        lines[100] = lines[100].replace(";", ",")
        lines[200] = "x" + lines[200]
        return "\n".join(lines[:-2]) + "\n" + lines[-2][:9]

    foreign.change(FORCE_LOG, damage)
    results = foreign.chain()
    fates = results.fates(FORCE_LOG)
    assert sum(fates.values()) == len(foreign.logs[FORCE_LOG].splitlines()) - 2
    codes = {"wrong-cells", "not-numbers", "cut-rows"}
    assert {code: fates["dropped", code] for code in codes} == dict.fromkeys(codes, 1)
    assert codes <= {*results.codes(RUN)}


@pytest.mark.parametrize(
    ("key", "column", "code", "named"),
    [
        # named: what the reason says of the file, and of the config
        ("force_log.columns.F1", "Kx", "other-unit", "F1 mN N"),
        ("force_log.columns.F1", {"column": "Kx", "unit": "lbf"}, "columns", "mN lbf"),
        ("force_log.columns.F1", "Ky2", "columns", "'Ky2' Zeit Sync Kx Ky Kz"),
        ("force_log.columns.F1", "kx", "columns", "'kx' 'Kx'"),
        ("force_log.columns.F2", None, "columns", "F2 force_log.columns"),
        ("motion_log.columns.x", 3, "columns", "unit um mm"),
        ("motion_log.columns.x", None, "columns", "x motion_log.columns"),
        ("motion_log.columns.z", None, "columns", "z angle motion_log.columns"),
    ],
)
def test_what_is_refused(foreign, key, column, code, named):
    change_config(foreign, key, column)
    results = foreign.chain()
    run = results.run(RUN)
    assert (run["status"], run["reason_code"]) == ("refused", code)
    assert {*named.split()} <= {*re.findall(r"[^\s,;:?`]+", run["reason"])}
    assert (results.book["fate"] == "dropped").all()


def test_lost_packets_reach_the_ledger(tmp_path):
    """As samples that no line of the file is, with the time of the others unchanged."""
    room = room_of(tmp_path)
    change_config(room, "clock.method", "same_clock")
    columns = {"F1": "Fx", "F2": "Fy", "F3": "Fz"}
    options = {"rate_Hz": 100}
    change_config(
        room, "force_log", {"dialect": "ati-netft", "options": options, "columns": columns}
    )
    for name, content in room.logs.items():
        if "force" in name:
            lost = range(300, 340) if name == FORCE_LOG else ()
            room.logs[name] = as_netft(content, lost)
        else:  # on a clock that starts with the force log's first row
            values = table(content)
            rows = (values - [values[0, 0], 0, 0, 0]).tolist()
            room.logs[name] = csv_lines("time_s,x_mm,z_mm,angle_deg", rows)
    results = room.chain()
    assert results.fates(FORCE_LOG)["lost", "damaged-rows"] == 40
    assert "damaged-rows" in results.codes(RUN)
    steps = np.diff(results.traces.loc[results.traces["run_id"] == RUN, "time_s"])
    assert steps.max() == pytest.approx(0.41)


def as_netft(content, lost):
    lines = [
        f'"0x0","{n}","{8 * n}","{x!r}","{y!r}","{z!r}","0.0","0.0","0.0","now"\r\n'
        for n, (_, _, x, y, z) in enumerate(table(content).tolist())
        if n not in lost
    ]
    return netft(1).header + "".join(lines).encode()


FORCE = {
    "time": {"column": "t", "unit": "s"},
    **{name: {"column": f"load {name}", "unit": "N"} for name in ("F1", "F2", "F3")},
}
MOTION = {
    "time": dict(FORCE["time"]),
    "x": {"column": "pos x", "unit": "mm"},
    "z": {"column": "pos z", "unit": "mm"},
}
NAMES = ["t", "load F1", "load F2", "load F3", "pos x", "pos z"]


def one_file_a_run(folder, rig, ending, force_log, motion_log):
    """A room whose runs have one log each, still to be made, and force and position at its times."""
    room = room_of(folder, force_log=force_log, motion_log=motion_log)
    change_config(room, "clock.method", "same_clock")
    values_by_file = {}
    for run in room.runs:
        force, motion = (table(room.logs[log]) for log in (run.force_log, run.motion_log))
        motion_s = motion[:, 0] - rig.run(run.run_id)["clock_offset_s"]
        force = force[(force[:, 0] >= motion_s[0]) & (force[:, 0] <= motion_s[-1])]
        positions = [np.interp(force[:, 0], motion_s, motion[:, column]) for column in (1, 2)]
        file = f"one/{run.run_id}.{ending}"
        room.set(run.run_id, force_log=file, motion_log=file)
        values_by_file[file] = np.column_stack([force[:, 0], force[:, 2:5], *positions])
    room.logs.clear()
    return room, values_by_file


@pytest.fixture
def single(rig, tmp_path):
    """The same runs as tables of a testing machine, force and motion in each."""
    logs = [{"text": {"delimiter": ";"}, "columns": columns} for columns in (FORCE, MOTION)]
    room, together = one_file_a_run(tmp_path, rig, "csv", *logs)
    for file, values in together.items():
        rows = csv_lines(",".join(NAMES), values.round(7).tolist())
        room.logs[file] = rows.replace(b",", b";")
    return room


def test_force_and_motion_in_one_file(single, rig):
    """From `check` to alpha and the ledger of all, with every line counted once."""
    path = single.write()
    assert json_of("check", folder=single.folder)["errors"] == 0
    results = single.chain()
    assert_same_alpha(results.fit(RUN), rig.fit(RUN), 2e-3)
    assert_same_alpha(results.cell(30, 45), rig.cell(30, 45), 2e-3)
    assert [*results.run(RUN)[["clock_offset_s", "clock_se_s"]]] == [0, 0]
    results.check_ledger(single.counted, single.names)
    lines = single.counted[f"one/{RUN}.csv"]
    assert [*results.run(RUN)[["rows_force", "rows_motion"]]] == [lines, lines]
    code, out, _ = answer_of("inspect", single.folder / f"raw/paper/one/{RUN}.csv")
    assert code == 0
    _, _, block = out.partition("for config.yaml")
    proposed = yaml.safe_load(block.partition("\n")[2])
    assert [proposed[key]["columns"] for key in ("force_log", "motion_log")] == [FORCE, MOTION]
    run_rules(path, "ingest", "tare", "slopes", "checks", "legs", "ledger")
    book = rftfit.open(single.folder).table("ledger.csv")
    assert book.groupby("file")["rows"].sum().to_dict() == single.counted


def test_damage_to_one_file_is_told_apart(single):
    def damage(text):
        lines = text.split("\n")
        for row, column in ((100, 1), (200, 5), (201, 5), (300, 2)):
            cells = lines[row].split(";")
            cells[column] = "x"
            lines[row] = ";".join(cells)
        lines[400] += ";1"
        return "\n".join(lines)

    file = f"one/{RUN}.csv"
    single.change(file, damage)
    results = single.chain()
    results.check_ledger(single.counted, single.names)
    # a line without a position still has its force
    fates = results.fates(file)
    assert (fates["dropped", "not-numbers"], fates["dropped", "wrong-cells"]) == (2, 1)
    flags = [
        (flag.code, flag.values["count"], flag.values["file"]) for flag in results.flags.of_run(RUN)
    ]
    assert sorted(flags) == [
        ("not-numbers", 2, f"{RUN}.csv (force)"),
        ("not-numbers", 2, f"{RUN}.csv (motion)"),
        ("wrong-cells", 1, f"{RUN}.csv"),
    ]


@pytest.mark.parametrize(
    ("fault", "code", "named"),
    [
        ("excluded", "excluded", "too wet"),
        ("column", "columns", "'load F4'"),
        ("gone", "missing", ""),
        ("unnamed", "columns", "F1, F2, F3"),
    ],
)
def test_a_refused_run_of_one_file_is_counted_once(single, fault, code, named):
    if fault == "excluded":
        single.set(RUN, excluded="yes", reason="too wet")
    elif fault == "column":
        single.config = single.config.replace("load F2", "load F4")
    elif fault == "unnamed":
        change_config(single, "force_log.columns", {"time": FORCE["time"]})
    else:
        single.logs[f"one/{RUN}.csv"] = None
    results = single.chain()
    run = results.run(RUN)
    assert run["reason_code"] == code
    assert named in run["reason"]
    results.check_ledger(single.counted, single.names)


def test_two_tables_in_one_file(rig, tmp_path):
    """Groups of a TDMS file have lines of their own: those of both are counted."""
    logs = [
        {"dialect": "tdms", "options": {"group": group}, "columns": columns}
        for group, columns in (("load", FORCE), ("path", MOTION))
    ]
    room, together = one_file_a_run(tmp_path, rig, "tdms", *logs)
    counted = {}
    for file, values in together.items():
        half = values[::2]
        force: Any = {name: (values[:, column], {}) for column, name in enumerate(NAMES[:4])}
        motion: Any = {NAMES[column]: (half[:, column], {}) for column in (0, 4, 5)}
        room.logs[file] = tdms(tmp_path / "made.tdms", load=force, path=motion)
        counted[file] = len(values) + len(half)
    results = room.chain()
    assert_same_alpha(results.fit(RUN), rig.fit(RUN), 2e-3)
    results.check_ledger(counted, room.names)


def tdms(file, **groups):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(file) as writer:
        for group, channels in groups.items():
            writer.write_segment(
                [nptdms.ChannelObject(group, name, *content) for name, content in channels.items()]
            )
    return file.read_bytes()


def test_gauges_and_a_calibration_give_what_the_loads_give(rig, tmp_path):
    """Each force log as four gauges in mV."""
    columns = {"time": "t", "arm_moving": "moving"}
    sections = {"text": {}, "columns": columns, "calibration": "gauges.csv"}
    room = room_of(tmp_path, force_log=sections)
    matrix = np.random.default_rng(3).normal(size=(3, 4))
    for name, content in room.logs.items():
        if "force" in name:
            values = table(content)
            gauges = np.column_stack([values[:, :2], values[:, 2:] @ np.linalg.pinv(matrix).T])
            head = "t [s],moving,G0 [mV],G1 [mV],G2 [mV],G3 [mV]"
            room.logs[name] = csv_lines(head, gauges.round(9).tolist())
    room.write()
    calibration = tmp_path / "raw" / "paper" / "gauges.csv"
    rows = [f"F{k},N,{','.join(f'{cell:.15g}' for cell in row)}" for k, row in enumerate(matrix, 1)]
    calibration.write_text("\n".join(["load,unit,G0,G1,G2,G3", *rows]) + "\n")
    fit = chain(rftfit.open(tmp_path).campaign, "poppy_LP").fit(RUN)
    for name in ("alpha_z_N_per_cm3", "alpha_z_se_N_per_cm3", "alpha_x_N_per_cm3"):
        assert fit[name] == pytest.approx(rig.fit(RUN)[name], rel=1e-5)
    calibration.unlink()
    (missing,) = told(rftfit.check(tmp_path))
    assert missing.startswith("config.calibration-file force_log.calibration 'gauges.csv'")


def test_a_folder_of_ros2_is_named_by_its_folder(tmp_path):
    """The sheet names the folder; what belongs to the recording is every file in it."""
    room = room_of(tmp_path)
    path = room.write()
    raw = tmp_path / "raw" / "paper"
    bag = raw / "bags" / "one"
    bag.mkdir(parents=True)
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (bag / "one_0.db3").write_bytes(b"x")
    sheet = raw / "runs.csv"
    text = sheet.read_text()
    sheet.write_text(text.replace(f"poppy_LP/{RUN}_force.csv", "bags/one"))
    campaign = rftfit.open(tmp_path).campaign
    assert campaign.by_id[RUN].force_log == "bags/one/metadata.yaml"
    bag_files = {"bags/one/metadata.yaml", "bags/one/one_0.db3"}
    assert bag_files <= read_states(path).all_log_digests.keys()
    (bag / "metadata.yaml").unlink()
    (no_file,) = told(rftfit.check(tmp_path))
    assert re.fullmatch(r"sheet.log-not-a-file \d+ force_log 'bags/one'", no_file)


def test_level_pushes_alone_are_told_of_the_other_role(tmp_path):
    room = RigRoom(tmp_path).add("poppy_LP_bp00_g90_in")
    for count in (1, 0):
        room.write()
        problems = [str(problem) for problem in rftfit.check(tmp_path)]
        assert (
            sum("medium poppy_LP" in problem and "natural_sand" in problem for problem in problems)
            == count
        )
        room.add(RUN)


def test_a_force_along_x_that_nobody_measured_has_no_number(tmp_path, rig):
    """It was 0: alpha_x of a slanted plate, and the thrust of a leg."""
    room = RigRoom(tmp_path).add(RUN, "poppy_LP_c_leg")
    config = yaml.safe_load(room.config)
    config["force_log"] = {"columns": {"F2": {"constant": 0, "unit": "N"}}}
    config["transducer"]["turn_deg"] = 0
    config["errors"] = {"turn_deg": 1.0}
    room.config = yaml.safe_dump(config)
    results = room.chain()
    fit, cell = results.fit(RUN), results.cell(30, 45)
    for row in (fit, cell):
        assert row["alpha_z_N_per_cm3"] == pytest.approx(rig.fit(RUN)["alpha_z_N_per_cm3"], rel=0.1)
        assert row.filter(regex="^alpha_x_(N|se|lo|hi)").isna().all()
        assert row["alpha_z_lo_N_per_cm3"] < row["alpha_z_N_per_cm3"] < row["alpha_z_hi_N_per_cm3"]
    assert results.curves["force_z_N"].max() > 5
    assert results.curves["force_x_N"].isna().all()
    flagged = results.flags.runs_with("no-force-x")
    assert {RUN, *results.curves["run_id"]} <= flagged.keys()
