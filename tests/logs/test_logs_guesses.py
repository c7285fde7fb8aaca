"""The quantity of a log column is proposed from its header, and no wrong quantity is proposed."""

import random
from pathlib import Path

import numpy as np
import pytest
from seeds import seeds

import rftfit
from rftfit.logs.base import Log
from rftfit.logs.inspect import config_block, survey

Header = list[tuple[str, str, str]]
"""Of each column: name, unit, and the quantity that it holds (empty: none of the chain's)."""


def proposed(path, header, unit_style):
    """Quantities of a text with this header, by the place of the column that is proposed."""
    names = [
        f"{name} [{unit}]" if unit and unit_style == "brackets" else name
        for name, unit, _ in header
    ]
    unit_rows = ["\t".join(unit for _, unit, _ in header)] if unit_style == "row" else []
    rows = ["\t".join(f"{row}.{k}5" for k in range(len(names))) for row in range(3)]
    path.write_text("\n".join(["\t".join(names), *unit_rows, *rows]) + "\n", "utf-8")
    log = rftfit.read_log(path)
    return {
        quantity: list(log.columns).index(name)
        for quantity, name in survey([log]).quantities.items()
    }


TIMES = [
    ("time", "s"),
    ("Running Time", "s"),
    ("timestamp", ""),
    ("Zeit", "s"),
    ("Temps", "s"),
    ("Tiempo", "s"),
    ("Total Time", "sec"),
    ("t", "ms"),
]
LOADS = [
    ("Load", "kN"),
    ("Standard force", "N"),
    ("Kraft", "N"),
    ("Standardkraft", "kN"),
    ("Fuerza", "N"),
    ("Force", "g"),
    ("Carga", "kg"),
    ("Axial Force", "lbf"),
]
HEIGHTS = [
    ("Extension", "mm"),
    ("Standard travel", "mm"),
    ("Weg", "mm"),
    ("Tiefe", "mm"),
    ("Profondeur", "cm"),
    ("Distance", "mm"),
    ("Position (z)", "mm"),
    ("Desplazamiento", "mm"),
    ("z", "mm"),
    ("data.z", "mm"),
]
OTHERS = [
    ("Strain", "%"),
    ("Temperature", "°C"),
    ("Speed", "mm/min"),
    ("imu.orientation.x", ""),
    ("Batch", "V"),
    ("imu.angular_velocity.z", ""),
    ("Elapsed Cycles", ""),
    ("Sollweg", "mm"),
    ("target_TCP_force_2", "N"),
    ("joint_position_0", "rad"),
    ("Friction force", "N"),
    ("Energy", "kN*mm"),
    ("cmd.pose.z", "m"),
    ("F_max", "N"),
    ("phase angle", "deg"),
    ("T", ""),
    ("wheel.velocity.x", ""),
]
WRENCHES = [
    "actual_TCP_force_{}",
    "F_ext[{}]",
    "O_F_ext_hat_K[{}]",
    "wrench_{}",
    "Kraft {}",
    "force.{}",
]
AXES = [
    "F{}",
    "force_{}",
    "Kraft {}",
    "wrench.force.{}",
    "Force ({})",
    "tool.wrench.force.{}",
    "Fuerza {}",
]


def make_header(luck):
    """Make a header as some program could write it, with what each column holds."""
    header: Header = [(*luck.choice(TIMES), "time")] if luck.random() < 0.9 else []
    style = luck.randrange(5)
    if style == 0:  # a vector with its torques, from 0 or 1
        name, start = luck.choice(WRENCHES), luck.randrange(2)
        for k, quantity in enumerate(("F1", "F2", "F3", "T1", "T2", "T3")):
            header.append((name.format(k + start), "", quantity))
    elif style == 1:
        name, start = luck.choice(["force_{}", "load {}", "Kraft_{}"]), luck.randrange(2)
        header += [(name.format(k + start), "N", f"F{k + 1}") for k in range(3)]
    elif style == 2:
        name = luck.choice(AXES)
        header += [(name.format(axis), "N", f"F{k + 1}") for k, axis in enumerate("xyz")]
    elif style == 3:
        header.append((*luck.choice(LOADS), "F3"))
    else:  # four load cells are no axes
        header += [(f"force_{k}", "N", "") for k in range(1, 5)]
    place = luck.randrange(3)
    if place == 0:
        header.append((*luck.choice(HEIGHTS), "z"))
    elif place == 1:
        path = luck.choice(["pose.position.{}", "base.translation.{}", "Weg {}", "position_{}"])
        header += [
            (path.format(axis), "mm", quantity)
            for axis, quantity in (("x", "x"), ("y", ""), ("z", "z"))
        ]
    else:
        start, count = luck.randrange(2), luck.choice([6, 7])
        names = ["x", "", "z", *[""] * (count - 3)]
        header += [(f"tcp_pose_{k + start}", "", names[k]) for k in range(count)]
    if luck.random() < 0.3:  # a second specimen
        header += [column for column in header if column[2] not in ("", "time")]
    for other_column in luck.sample(OTHERS, luck.randrange(5)):
        header.insert(luck.randrange(len(header) + 1), (*other_column, ""))
    return header


@pytest.mark.statistics
def test_no_wrong_quantity_is_proposed(tmp_path):
    luck = random.Random(20)
    wrong, right_count, quantity_count = [], 0, 0
    for _ in range(seeds(300, 80)):
        header = make_header(luck)
        unit_style = (
            luck.choice(["brackets", "row"]) if any(unit for _, unit, _ in header) else "none"
        )
        if unit_style == "row" and sum(bool(unit) for _, unit, _ in header) * 2 <= len(header):
            unit_style = "brackets"
        columns_proposed = proposed(tmp_path / "a.tab", header, unit_style)
        wrong += [
            (q, header[k], unit_style) for q, k in columns_proposed.items() if header[k][2] != q
        ]
        truth = {quantity for _, _, quantity in header if quantity}
        right_count += len(truth & columns_proposed.keys())
        quantity_count += len(truth)
    assert wrong == []
    assert right_count >= 0.95 * quantity_count, (right_count, quantity_count)


@pytest.mark.parametrize(
    ("bad", "proposed"),
    [
        ({100: -9999, 900: -9999}, "missing: [-9999] #"),
        ({100: -9999, 900: -9999, 905: 8388607, 2000: 8388607}, "missing: [-9999, 8388607] #"),
        ({100: -9999}, ""),  # one reading alone is no code
        (dict.fromkeys(range(2500, 3000), 12.0), ""),  # cut off at the range
        (dict.fromkeys(range(5, 3000, 50), 0.0), ""),
    ],
)
@pytest.mark.parametrize("parts", [1, 3])
def test_a_value_that_recurs_outside_of_all_others_is_proposed_as_missing(bad, proposed, parts):
    """Of a force that rises to 20 N in 3,000 rows, read in one block or in several."""
    luck = np.random.default_rng(1)
    time = np.arange(3000) / 100
    force = np.round(luck.normal(0, 0.05, 3000) + np.clip(time - 10, 0, None), 3)
    force[[*bad]] = [*bad.values()]
    cells = zip(np.array_split(time, parts), np.array_split(force, parts), strict=True)
    units = {"time": "s", "F3": "N"}
    blocks = [Log(Path("a"), {"time": t, "F3": f}, units, t.size) for t, f in cells]
    lines = [line.strip() for line in config_block(survey(blocks), "delimited")]
    missing = [line for line in lines if line.startswith("missing")]
    assert missing == [] if not proposed else missing[0].startswith(proposed)


def test_columns_whose_unit_could_be_that_of_a_missing_quantity_are_named():
    time = np.arange(100) / 10
    columns = {"time": time, "F3": time, "cell left": 2 * time, "lamp": 3 * time}
    units = {"time": "s", "F3": "N", "cell left": "mN", "lamp": "V"}
    lines = config_block(survey([Log(Path("a"), columns, units, time.size)]), "delimited")
    assert "    # F2: no column looks like it; with such a unit: cell left" in lines
    assert "lamp" not in "".join(lines)
