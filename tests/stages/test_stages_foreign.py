"""The chain on other programs' logs: the same numbers as on the rig's own, and the same checks."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
import yaml
from foreign_logs import netft
from jobs import run_rules
from rigroom import Room, chain

from rftfit.campaign.load import check_campaign, load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.cli.main import main
from rftfit.measure.flags import flags_of
from rftfit.results import open_results
from rftfit.workflow.state import log_names, read_states

RUN = "poppy_LP_bp30_g45_in"
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


def room_of(folder):
    room = Room(folder).add(RUN)
    config = yaml.safe_load(room.config)
    config.pop("robot", None)  # its own runs are not in this room
    room.config = yaml.safe_dump(config, sort_keys=False)
    return room


def converted(room):
    for name, content in list(room.logs.items()):
        assert content is not None
        room.logs[name] = as_instron(content) if "force" in name else as_blanks(content)
    room.config += SECTIONS
    return room


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "rig").mkdir()
    return room_of(tmp_path / "rig").chain()


@pytest.fixture
def other(tmp_path):
    (tmp_path / "other").mkdir()
    return converted(room_of(tmp_path / "other"))


def test_the_same_traces(rig, other):
    got = other.chain()
    assert got.run(RUN)["status"] == "read", got.run(RUN)["reason"]
    for name in ("time_s", "x_cm", "depth_cm", "force_z_N", "force_x_N"):
        np.testing.assert_allclose(got.traces[name], rig.traces[name], rtol=0, atol=1e-6)
    # the rig measures the angle, with its noise; here it is the run sheet's
    np.testing.assert_allclose(got.traces["angle_deg"], rig.traces["angle_deg"], atol=0.2)
    assert got.fit(RUN)["alpha_z_N_per_cm3"] == pytest.approx(
        rig.fit(RUN)["alpha_z_N_per_cm3"], rel=1e-3
    )


def test_every_row_is_accounted_for(other):
    """With rows cut out, damaged and cut short."""
    force = next(name for name in other.logs if "force" in name and RUN in name)

    def damage(text):
        lines = text.split("\n")
        lines[100] = lines[100].replace(";", ",")
        lines[200] = "x" + lines[200]
        return "\n".join(lines[:-2]) + "\n" + lines[-2][:9]

    other.change(force, damage)
    got = other.chain()
    rows = len(other.logs[force].splitlines()) - 2
    fates = got.fates(f"{force}")
    assert sum(fates.values()) == rows
    codes = {"wrong-cells", "not-numbers", "cut-rows"}
    assert {code: fates["dropped", code] for code in codes} == dict.fromkeys(codes, 1)
    assert codes <= {*got.run(RUN)["flag_codes"].split()}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("column: Kx, unit: mN", "column: Kx", "F1 in mN, but the config says N"),
        ("column: Kx, unit: mN", "column: Kx, unit: lbf", "the file says mN, the config lbf"),
        ("column: Kx", "column: Ky2", "column: found 'Ky2'; allowed: Zeit, Sync, Kx"),
        ("column: Kx", "column: kx", "did you mean 'Kx'"),
        ("    F2: {column: Ky, unit: mN}\n", "", "no column for F2; name it under force_log.columns"),
        ("x: {column: 3, unit: m}", "x: 3", "the file states no unit: add `unit:`, one of um, mm"),
        ("x: {column: 3, unit: m}", "x: {column: 3, unit: s}", "s is no unit of x; allowed: um"),
        ("x: {column: 3, unit: m}\n", "\n", "no column for x"),
        ("z: {column: 4, unit: m}\n", "\n", "no column for z, angle; name it under motion_log.columns"),
    ],
)  # fmt: skip
def test_what_is_refused(other, old, new, said):
    assert old in other.config
    other.config = other.config.replace(old, new)
    got = other.chain()
    assert got.run(RUN)["status"] == "refused"
    assert said in got.run(RUN)["reason"]
    assert (got.book["fate"] == "dropped").all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("unit: mN, factor: -1", "unit: MN", "allowed: one of N, mN, kN"),
        ("    F1: {", "    F4: {", "found 'F4'; allowed: one of time, arm_moving, F1, F2, F3"),
        ("skip_lines: 1}", "skip_line: 1}", "did you mean 'skip_lines'"),
        ("dialect: instron", "text: {delimiter: x}", "allowed: one of ,, ;, tab, blank, bar"),
        ("{column: Kx, unit: mN}", "{unit: mN}", "needs either a column or a constant"),
        ("  text: {", "  dialect: rig\n  text: {", "goes with the dialect delimited, found rig"),
    ],
)
def test_config_is_checked(other, old, new, said):
    assert old in other.config
    other.config = other.config.replace(old, new)
    with pytest.raises(CampaignError) as caught:
        load_campaign(other.write())
    assert said in str(caught.value)


def test_lost_packets_reach_the_ledger(tmp_path):
    """As samples that no line of the file is, with the time of the others unchanged."""
    room = room_of(tmp_path)
    force = next(name for name in room.logs if "force" in name and RUN in name)
    for name, content in list(room.logs.items()):
        if "force" in name and content is not None:
            room.logs[name] = as_netft(content, lost=range(300, 340) if name == force else range(0))
    config = yaml.safe_load(room.config)
    config["clock"]["method"] = "same_clock"
    config["force_log"] = {
        "dialect": "ati-netft",
        "options": {"rate_Hz": 100},
        "columns": {"F1": "Fx", "F2": "Fy", "F3": "Fz"},
    }
    room.config = yaml.safe_dump(config)
    for name, content in list(room.logs.items()):
        if "motion" in name and content is not None:
            room.logs[name] = from_zero(content)
    got = chain(load_campaign(room.write()), "poppy_LP")
    fates = got.fates(force)
    assert fates["lost", "damaged-rows"] == 40
    assert "damaged-rows" in got.run(RUN)["flag_codes"] or got.run(RUN)["status"] == "refused"
    steps = np.diff(got.traces.loc[got.traces["run_id"] == RUN, "time_s"])
    if steps.size:
        assert steps.max() == pytest.approx(0.41)


def as_netft(content, lost):
    values = table(content)
    made = netft(1)
    lines = [
        f'"0x0","{n}","{8 * n}","{x!r}","{y!r}","{z!r}","0.0","0.0","0.0","now"\r\n'
        for n, (_, _, x, y, z) in enumerate(values.tolist())
        if n not in lost
    ]
    return made.header + "".join(lines).encode()


def from_zero(content):
    """The motion log on a clock that starts with the force log's first row."""
    values = table(content)
    lines = ["time_s,x_mm,z_mm,angle_deg"]
    lines += [f"{t - values[0, 0]:.4f},{x!r},{z!r},{a!r}" for t, x, z, a in values.tolist()]
    return ("\n".join(lines) + "\n").encode()


TEXT = {"delimiter": ";"}
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


def on_one_clock(room, rig):
    """Force and position of each run, together at the times of the force log."""
    found = {}
    for run in room.runs:
        force, motion = (table(room.logs[log] or b"") for log in (run.force_log, run.motion_log))
        own = motion[:, 0] - rig.run(run.run_id)["clock_offset_s"]
        force = force[(force[:, 0] >= own[0]) & (force[:, 0] <= own[-1])]
        at = [np.interp(force[:, 0], own, motion[:, column]) for column in (1, 2)]
        found[run.run_id] = np.column_stack([force[:, 0], force[:, 2:5], *at])
    return found


def one_file_a_run(room, config, ending):
    """Name one file for each run twice; the files are still to be made."""
    room.logs.clear()
    for run in room.runs:
        file = f"one/{run.run_id}.{ending}"
        room.set(run.run_id, force_log=file, motion_log=file)
    whole = yaml.safe_load(room.config)
    whole["clock"]["method"] = "same_clock"
    room.config = yaml.safe_dump({**whole, **config}, sort_keys=False)
    return [f"one/{run.run_id}.{ending}" for run in room.runs]


def as_table(values):
    lines = [";".join(NAMES), *(";".join(f"{cell:.7f}" for cell in row) for row in values.tolist())]
    return ("\n".join(lines) + "\n").encode()


@pytest.fixture
def single(rig, tmp_path):
    """The same runs as tables of a testing machine, force and motion in each."""
    (tmp_path / "single").mkdir()
    room = room_of(tmp_path / "single")
    together = on_one_clock(room, rig)
    config: dict[str, object] = {
        "force_log": {"text": dict(TEXT), "columns": FORCE},
        "motion_log": {"text": dict(TEXT), "columns": MOTION},
    }
    for file, values in zip(one_file_a_run(room, config, "csv"), together.values(), strict=True):
        room.logs[file] = as_table(values)
    return room


def runs_of(room):
    return [run.run_id for run in room.runs]


def test_force_and_motion_in_one_file(single, rig, capfd):
    """From `check` to alpha, with every line counted once."""
    path = single.write()
    assert main(["check", "--config", str(path)]) == 0
    got = single.chain()
    for component in "zx":
        name = f"alpha_{component}_N_per_cm3"
        assert got.fit(RUN)[name] == pytest.approx(rig.fit(RUN)[name], rel=2e-3)
        assert got.cell(30, 45)[name] == pytest.approx(rig.cell(30, 45)[name], rel=2e-3)
    got.check_ledger(single.counted, runs_of(single))
    assert (got.run(RUN)["rows_force"], got.run(RUN)["rows_motion"]) == (
        (single.counted[f"one/{RUN}.csv"],) * 2
    )
    campaign = load_campaign(path)
    sums = {name: hashlib.sha256(log or b"").hexdigest() for name, log in single.logs.items()}
    assert read_states(path)[0].all_logs == sums
    capfd.readouterr()
    assert main(["inspect", str(campaign.raw / f"one/{RUN}.csv")]) == 0
    _, _, block = capfd.readouterr().out.partition("for config.yaml")
    proposed = yaml.safe_load(block.partition("\n")[2])
    assert [proposed[key]["columns"] for key in ("force_log", "motion_log")] == [FORCE, MOTION]


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
    got = single.chain()
    got.check_ledger(single.counted, runs_of(single))
    # a line without a position still has its force
    fates = got.fates(file)
    assert (fates["dropped", "not-numbers"], fates["dropped", "wrong-cells"]) == (2, 1)
    flags = [
        (one.code, one.values["count"], one.values["file"]) for one in flags_of({**got.run(RUN)})
    ]
    assert sorted(flags) == [
        ("not-numbers", 2, f"{RUN}.csv (force)"), ("not-numbers", 2, f"{RUN}.csv (motion)"),
        ("wrong-cells", 1, f"{RUN}.csv"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("fault", "status"),
    [("excluded", "excluded: too wet"), ("column", "column: found 'load F4'"), ("gone", "missing")],
)
def test_a_refused_run_of_one_file_is_counted_once(single, fault, status):
    if fault == "excluded":
        single.set(RUN, excluded="yes", reason="too wet")
    elif fault == "column":
        single.config = single.config.replace("load F2", "load F4")
    else:
        single.logs[f"one/{RUN}.csv"] = None
    got = single.chain()
    assert status in got.run(RUN)["reason"]
    got.check_ledger(single.counted, runs_of(single))


def test_force_columns_that_nobody_named(single):
    config = yaml.safe_load(single.config)
    for name in ("F1", "F2", "F3"):
        del config["force_log"]["columns"][name]
    single.config = yaml.safe_dump(config, sort_keys=False)
    reason = single.chain().run(RUN)["reason"]
    assert "no column for F1, F2, F3; name it under force_log.columns" in reason
    assert "swapped" not in reason


def test_the_ledger_of_a_campaign_with_one_file_a_run(single):
    path = single.write()
    run_rules(path, "ingest", "tare", "slopes", "checks", "legs", "ledger")
    book = open_results(path).table("ledger.csv")
    assert book.groupby("file")["rows"].sum().to_dict() == single.counted


def test_two_tables_in_one_file(rig, tmp_path):
    """Groups of a TDMS file have lines of their own: those of both are counted."""
    pytest.importorskip("nptdms")
    (tmp_path / "tdms").mkdir()
    room = room_of(tmp_path / "tdms")
    together = on_one_clock(room, rig)
    config: dict[str, object] = {
        "force_log": {"dialect": "tdms", "options": {"group": "load"}, "columns": FORCE},
        "motion_log": {"dialect": "tdms", "options": {"group": "path"}, "columns": MOTION},
    }
    files = one_file_a_run(room, config, "tdms")
    counted = {}
    for file, values in zip(files, together.values(), strict=True):
        half = values[::2]
        force: Channels = {name: (values[:, at], {}) for at, name in enumerate(NAMES[:4])}
        motion: Channels = {
            name: (half[:, at], {}) for at, name in ((0, "t"), (4, "pos x"), (5, "pos z"))
        }
        room.logs[file] = tdms(tmp_path / "made.tdms", load=force, path=motion)
        counted[file] = len(values) + len(half)
    got = room.chain()
    assert got.fit(RUN)["alpha_z_N_per_cm3"] == pytest.approx(
        rig.fit(RUN)["alpha_z_N_per_cm3"], rel=2e-3
    )
    got.check_ledger(counted, runs_of(room))


@pytest.mark.parametrize("late_s", [0.0, 0.5])
def test_channels_that_began_apart_keep_their_own_time(rig, tmp_path, late_s):
    """Force recorded later than the position, in one group: the clock of each is its own."""
    pytest.importorskip("nptdms")
    (tmp_path / "tdms").mkdir()
    room = room_of(tmp_path / "tdms")
    together = on_one_clock(room, rig)
    # the channels hold no time: it comes from their waveforms
    columns = [{k: v for k, v in part.items() if k != "time"} for part in (FORCE, MOTION)]
    config: dict[str, object] = {
        key: {"dialect": "tdms", "columns": part}
        for key, part in zip(("force_log", "motion_log"), columns, strict=True)
    }
    files = one_file_a_run(room, config, "tdms")
    counted = {}
    for file, values in zip(files, together.values(), strict=True):
        step = float(np.median(np.diff(values[:, 0])))
        start, shift = values[0, 0], round(late_s / step)
        even = np.arange(start, values[-1, 0], step)
        table = [np.interp(even, values[:, 0], values[:, at]) for at in range(6)]
        size = even.size - shift
        wave = {"wf_start_time": np.datetime64("2026-01-02T03:04:05"), "wf_increment": step}
        force = {name: (table[at][shift:], {**wave, "wf_start_offset": shift * step})
                 for at, name in enumerate(NAMES[:4]) if at}  # fmt: skip
        motion = {name: (table[at][:size], {**wave, "wf_start_offset": 0.0})
                  for at, name in enumerate(NAMES) if at > 3}  # fmt: skip
        room.logs[file] = tdms(tmp_path / "made.tdms", all=force | motion)
        counted[file] = size
    got = room.chain()
    assert got.run(RUN)["status"] == "read", got.run(RUN)["reason"]
    for component in "zx":
        name = f"alpha_{component}_N_per_cm3"
        assert got.fit(RUN)[name] == pytest.approx(rig.fit(RUN)[name], rel=5e-3)
    got.check_ledger(counted, runs_of(room))


Channels = dict[str, tuple[np.ndarray, dict[str, object]]]


def tdms(file, **groups):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(file) as writer:
        for group, channels in groups.items():
            writer.write_segment(
                [ChannelObject(group, name, *made) for name, made in channels.items()]
            )
    return file.read_bytes()


def gauges_of(room):
    """Write each force log as four gauges in mV; return the loads that each gauge stands for, N."""
    matrix = np.random.default_rng(3).normal(size=(3, 4))
    back = np.linalg.pinv(matrix)
    for name, content in room.logs.items():
        if "force" in name and content is not None:
            values = table(content)
            gauges = values[:, 2:] @ back.T
            rows = np.column_stack([values[:, :2], gauges]).tolist()
            lines = ["t [s],moving,G0 [mV],G1 [mV],G2 [mV],G3 [mV]"]
            lines += [",".join(f"{cell:.9f}" for cell in row) for row in rows]
            room.logs[name] = ("\n".join(lines) + "\n").encode()
    return matrix


def test_gauges_and_a_calibration_give_what_the_loads_give(rig, tmp_path):
    room = room_of(tmp_path / "gauges")
    matrix = gauges_of(room)
    room.config += (
        "force_log: {text: {}, columns: {time: t, arm_moving: moving}, calibration: gauges.csv}\n"
    )
    path = room.write()
    rows = [f"F{k},N,{','.join(f'{cell:.15g}' for cell in row)}" for k, row in enumerate(matrix, 1)]
    calibration = path.parents[1] / "raw" / "paper" / "gauges.csv"
    calibration.write_text("\n".join(["load,unit,G0,G1,G2,G3", *rows]) + "\n")
    found = chain(load_campaign(path), "poppy_LP").fit(RUN)
    for name in ("alpha_z_N_per_cm3", "alpha_z_se_N_per_cm3", "alpha_x_N_per_cm3"):
        assert found[name] == pytest.approx(rig.fit(RUN)[name], rel=1e-5)
    assert "gauges.csv" in log_names(load_campaign(path), "poppy_LP")
    calibration.write_text("load,unit\n")
    with pytest.raises(CampaignError, match=r"calibration.*row 1: found load, unit"):
        load_campaign(path)
    calibration.unlink()
    with pytest.raises(CampaignError, match=r"gauges\.csv.*a file that exists"):
        load_campaign(path)


def test_a_folder_of_ros2_is_named_by_its_folder(tmp_path):
    """The sheet names the folder; what belongs to the recording is every file in it."""
    room = room_of(tmp_path)
    path = room.write()
    raw = path.parents[1] / "raw" / "paper"
    bag = raw / "bags" / "one"
    bag.mkdir(parents=True)
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (bag / "one_0.db3").write_bytes(b"x")
    sheet = raw / "runs.csv"
    text = sheet.read_text()
    sheet.write_text(text.replace(f"poppy_LP/{RUN}_force.csv", "bags/one"))
    campaign = load_campaign(path)
    assert (
        next(run for run in campaign.runs if run.run_id == RUN).force_log
        == "bags/one/metadata.yaml"
    )
    assert {"bags/one/metadata.yaml", "bags/one/one_0.db3"} <= set(log_names(campaign, "poppy_LP"))
    (bag / "metadata.yaml").unlink()
    with pytest.raises(CampaignError, match="this is a folder"):
        load_campaign(path)


def test_level_pushes_alone_are_told_of_the_other_role(tmp_path):
    room = Room(tmp_path).add("poppy_LP_bp00_g90_in")
    config = yaml.safe_load(room.config)
    config.pop("robot", None)
    room.config = yaml.safe_dump(config, sort_keys=False)
    _, problems = check_campaign(room.write())
    (told,) = [str(problem) for problem in problems if "natural_sand" in str(problem)]
    assert "medium poppy_LP" in told
    room.add(RUN)
    _, problems = check_campaign(room.write())
    assert not [problem for problem in problems if "natural_sand" in str(problem)]
