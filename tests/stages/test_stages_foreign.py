"""The chain on other programs' logs: the same numbers as on the rig's own, and the same checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import yaml
from foreign_logs import netft
from rigroom import Results, Room, chain

from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError

if TYPE_CHECKING:
    from pathlib import Path

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


def table(content: bytes) -> np.ndarray:
    lines = [line for line in content.decode().splitlines() if line and not line.startswith("#")]
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])


def as_instron(content: bytes) -> bytes:
    lines = ["Zeit;Sync;Kx;Ky;Kz", "(ms);();(mN);(mN);(mN)"]
    for time, line, *forces in table(content).tolist():
        x, y, z = (1e3 * force for force in forces)
        lines.append(f"{1e3 * time:.6f};{line:.0f};{x:.6f};{y:.6f};{-z:.6f}".replace(".", ","))
    return ("\r\n".join(lines) + "\r\n").encode("cp1252")


def as_blanks(content: bytes) -> bytes:
    lines = ["made by the arm"]
    for number, (time, x, z, _) in enumerate(table(content).tolist()):
        lines.append(f"  {number}\t{time:.9f}  {x / 1e3:.9f} {z / 1e3:.9f}")
    return ("\n".join(lines) + "\n").encode()


def room_of(folder: Path) -> Room:
    room = Room(folder).add(RUN)
    config = yaml.safe_load(room.config)
    config.pop("robot", None)  # its own runs are not in this room
    room.config = yaml.safe_dump(config, sort_keys=False)
    return room


def converted(room: Room) -> Room:
    for name, content in list(room.logs.items()):
        assert content is not None
        room.logs[name] = as_instron(content) if "force" in name else as_blanks(content)
    room.config += SECTIONS
    return room


@pytest.fixture
def rig(tmp_path: Path) -> Results:
    (tmp_path / "rig").mkdir()
    return room_of(tmp_path / "rig").chain()


@pytest.fixture
def other(tmp_path: Path) -> Room:
    (tmp_path / "other").mkdir()
    return converted(room_of(tmp_path / "other"))


def test_the_same_traces(rig: Results, other: Room) -> None:
    got = other.chain()
    assert got.run(RUN)["status"] == "read", got.run(RUN)["reason"]
    for name in ("time_s", "x_cm", "depth_cm", "force_z_N", "force_x_N"):
        np.testing.assert_allclose(got.traces[name], rig.traces[name], rtol=0, atol=1e-6)
    # the rig measures the angle, with its noise; here it is the run sheet's
    np.testing.assert_allclose(got.traces["angle_deg"], rig.traces["angle_deg"], atol=0.2)
    assert got.fit(RUN)["alpha_z_N_per_cm3"] == pytest.approx(
        rig.fit(RUN)["alpha_z_N_per_cm3"], rel=1e-3
    )


def test_every_row_is_accounted_for(other: Room) -> None:
    """With rows cut out, damaged and cut short."""
    force = next(name for name in other.logs if "force" in name and RUN in name)

    def damage(text: str) -> str:
        lines = text.split("\n")
        lines[100] = lines[100].replace(";", ",")
        lines[200] = "x" + lines[200]
        return "\n".join(lines[:-2]) + "\n" + lines[-2][:9]

    other.change(force, damage)
    got = other.chain()
    rows = len(other.logs[force].splitlines()) - 2  # type: ignore[union-attr]
    fates = got.fates(f"{force}")
    assert sum(fates.values()) == rows
    for reason in ("wrong number of cells", "not a number", "cut in mid-row"):
        assert fates["dropped", reason] == 1
    assert "1 rows of" in got.run(RUN)["flags"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("column: Kx, unit: mN", "column: Kx", "F1 in mN, but the config says N"),
        ("column: Kx, unit: mN", "column: Kx, unit: lbf", "the file says mN, the config lbf"),
        ("column: Kx", "column: Ky2", "found no column 'Ky2'; allowed: Zeit, Sync, Kx"),
        ("column: Kx", "column: kx", "did you mean 'Kx'"),
        ("    F2: {column: Ky, unit: mN}\n", "", "no column for F2; name it under force_log.columns"),
        ("x: {column: 3, unit: m}", "x: 3", "the file states no unit: add `unit:`, one of um, mm"),
        ("x: {column: 3, unit: m}", "x: {column: 3, unit: s}", "s is no unit of x; allowed: um"),
        ("x: {column: 3, unit: m}\n", "\n", "no column for x"),
        ("z: {column: 4, unit: m}\n", "\n", "no column for z, angle; name it under motion_log.columns"),
    ],
)  # fmt: skip
def test_what_is_refused(other: Room, old: str, new: str, said: str) -> None:
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
def test_config_is_checked(other: Room, old: str, new: str, said: str) -> None:
    assert old in other.config
    other.config = other.config.replace(old, new)
    with pytest.raises(CampaignError) as caught:
        load_campaign(other.write())
    assert said in str(caught.value)


def test_lost_packets_reach_the_ledger(tmp_path: Path) -> None:
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
    assert fates["lost", "lost packets (gap in the RDT sequence)"] == 40
    assert "40 rows of" in got.run(RUN)["flags"] or got.run(RUN)["status"] == "refused"
    steps = np.diff(got.traces.loc[got.traces["run_id"] == RUN, "time_s"])
    if steps.size:
        assert steps.max() == pytest.approx(0.41)


def as_netft(content: bytes, lost: range) -> bytes:
    values = table(content)
    made = netft(1)
    lines = [
        f'"0x0","{n}","{8 * n}","{x!r}","{y!r}","{z!r}","0.0","0.0","0.0","now"\r\n'
        for n, (_, _, x, y, z) in enumerate(values.tolist())
        if n not in lost
    ]
    return made.header + "".join(lines).encode()


def from_zero(content: bytes) -> bytes:
    """The motion log on a clock that starts with the force log's first row."""
    values = table(content)
    lines = ["time_s,x_mm,z_mm,angle_deg"]
    lines += [f"{t - values[0, 0]:.4f},{x!r},{z!r},{a!r}" for t, x, z, a in values.tolist()]
    return ("\n".join(lines) + "\n").encode()
