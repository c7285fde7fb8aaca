"""Campaigns with mistakes in sheet, config and logs or in a table: the stages refuse nothing that `check` passed.

    make mutations                           200 campaigns, measured
    make mutations ARGS="--whole --count 50" with figures and pages
    make mutations ARGS="--seed 7 --count 1" that one again

The first campaign for which it does not hold is kept and ends the run.
"""

from __future__ import annotations

import argparse
import copy
import random
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from campaigns import Folder, RigRoom
from mistakes import MEASURED, RUNS, Case, Written, compare, make

from rftfit.campaign.load import REENACTED
from rftfit.lab.truth import table_s5


def main():
    """Try campaigns, print how many went which way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=2013, help="of the first campaign")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--base", choices=list(bases()), help="one campaign only, such as table")
    parser.add_argument("--whole", action="store_true", help="all stages, not those that measure")
    words = parser.parse_args()
    ways: Counter[str] = Counter()
    for seed in range(words.seed, words.seed + words.count):
        campaign = mutated(random.Random(seed), words.base)
        folder = Folder(Path(tempfile.mkdtemp(prefix="rftfit_mutation_")))
        try:
            campaign.write(folder.root)
            ways[compare(folder, () if words.whole else MEASURED)] += 1
        except BaseException:
            print(f"seed {seed}: {campaign.mistakes}; kept in {folder.root}", file=sys.stderr)
            raise
        shutil.rmtree(folder.root)
    print(", ".join(f"{count} {way}" for way, count in sorted(ways.items())))


# --- Campaigns that are right, and one to three mistakes in one of them ---------------------------------------------


@cache
def bases():
    """Small campaigns that are right: the paper's protocol with a leg and a sand, and two others."""
    campaigns = {}
    with TemporaryDirectory() as folder:
        RigRoom(Path(folder)).add(*RUNS).write()
        campaigns["paper"] = Written.read(Path(folder))
    for protocol in ("one-file", "separate-zero"):
        with TemporaryDirectory() as folder:
            make(Path(folder), Case("one-push", protocol))
            campaigns[protocol] = Written.read(Path(folder))
    campaigns["table"] = Written(
        {
            "title": "a table",
            "raw": "raw/paper",
            "run_sheet": "raw/paper/stress.csv",
            "table": {
                "holds": "stress",
                "angle_unit": "deg",
                "depth_unit": "cm",
                "stress_unit": "N/cm^2",
            },
            "media": {
                "sand": {"title": "sand", "role": "laboratory"},
                "dune": {"title": "dune", "role": "natural_sand"},
            },
            "fit": {"submergence_cm": 0.5, "max_depth_cm": 7.0},
            "fourier": {"draws": 200},
        },
        [],
        {"stress.csv": _stress().encode()},
    )
    return campaigns


def _stress():
    """A table of stress of two media: pushes, one with its way back, pulls, a level run, and one left out."""
    lines = [
        "medium,beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,run_id,excluded,reason"
    ]
    cells = [("sand", b, g) for b in (-60, 0, 30, 60) for g in (-90, -45, 45, 90)] + [
        ("dune", 0, 90)
    ]
    for number, (medium, beta, gamma) in enumerate(cells):
        depths_down = [0.5 * step for step in range(1, 17)]
        depths = (
            depths_down + depths_down[::-1]
            if number == 2
            else depths_down[:: 1 if gamma > 0 else -1]
        )
        end = ",yes,a stone" if number == 5 else ",,"
        alpha = table_s5("poppy_LP", beta, gamma)
        for place, depth in enumerate(depths):
            noise = 0.004 * ((7 * place) % 5 - 2)
            stress = ",".join(f"{a * depth + noise:.4f}" for a in alpha)
            lines.append(f"{medium},{beta},{gamma},{depth},{stress},r{number}{end}")
    return "\n".join(lines) + "\n"


def mutated(luck, base=None):
    """Make one to three mistakes in one of the campaigns."""
    written = copy.deepcopy(bases()[base or luck.choice(list(bases()))])
    for _ in range(luck.choice([1, 1, 2, 3])):
        kinds = [_of_log, _of_log, _of_log, _of_cell if written.rows else _of_log, _of_setting]
        written.mistakes.append(luck.choice(kinds)(luck, written))
    return written


def _of_cell(luck, written):
    row = luck.choice(written.rows)
    column = luck.choice(list(row))
    cells_of_column = [sheet_row[column] for sheet_row in written.rows]
    row[column] = luck.choice(
        [
            *cells_of_column,
            "",
            "0",
            "45",
            "-90",
            "90",
            "18.43",
            "1e9",
            "-3",
            "nan",
            "yes",
            "rod",
            "horizontal",
            "extraction",
            luck.choice(list(written.logs)),
        ]
    )
    return f"{row['run_id']}, {column}: {row[column]!r}"


def _of_setting(luck, written):
    section: Any = written.config
    path = []
    while True:
        keys = range(len(section)) if isinstance(section, list) else sorted(section)
        key = luck.choice(
            [candidate for candidate in keys if candidate not in ("title", "raw", "run_sheet")]
        )
        path.append(str(key))
        if not isinstance(section[key], dict | list) or not section[key]:
            break
        section = section[key]
    value = section[key]
    if isinstance(value, bool) or value is None:
        section[key] = luck.choice([True, False, None, 1.0])
    elif isinstance(value, int | float):
        section[key] = luck.choice([0, 0.1, 10, -1, 1000, 1e-6]) * (value or 1)
    else:
        section[key] = luck.choice(
            [
                "N",
                "kN",
                "mm",
                "cm",
                "m",
                "estimate",
                "same_clock",
                "sync_line",
                "stated",
                "air",
                "find",
                "flag",
                "refuse",
                "drop",
                "uneven",
                "+F1",
                "-F1",
                "-F3",
                "natural_sand",
                "dft-index",
            ]
        )
    return f"{'.'.join(path)}: {section[key]!r}"


def _of_log(luck, written):
    name = luck.choice([name for name in written.logs if not name.endswith(REENACTED)])
    damage = luck.choice(DAMAGES)
    text = written.logs[name].decode()
    lines = text.splitlines()
    top = next((i + 1 for i, line in enumerate(lines) if line.startswith(("time", "medium"))), 0)
    if len(lines) - top < 10:
        return f"{name}: spoiled already"
    if damage is _another:
        written.logs[name] = written.logs[luck.choice(list(written.logs))]
    else:
        body = damage(luck, [line.split(",") for line in lines[top:]])
        head = [] if damage is _nothing else lines[:top]
        if damage is _unit:
            old, new = luck.choice(
                [
                    ("_N", "_lbf"),
                    ("_mm", "_cm"),
                    ("time_s", "time_ms"),
                    ("run_id", "run"),
                    ("_deg", ""),
                ]
            )
            head = [line.replace(old, new) for line in head]
        written.logs[name] = "\n".join([*head, *map(",".join, body)]).encode() + b"\n"
    return f"{name}: {damage.__name__.strip('_')}"


Table = list[list[str]]


def _cut(luck, rows):
    return rows[: luck.randrange(len(rows))]


def _late(luck, rows):
    return rows[luck.randrange(len(rows)) :]


def _hole(luck, rows):
    index = luck.randrange(len(rows))
    return rows[:index] + rows[index + luck.choice([1, 30, 300]) :]


def _twice(luck, rows):
    index = luck.randrange(len(rows))
    return rows[:index] + [row for row in rows[index:] for _ in range(2)]


def _swapped(luck, rows):
    first, second = luck.sample(range(len(rows[0])), 2)
    for row in rows:
        row[first], row[second] = row[second], row[first]
    return rows


def _scaled(luck, rows):
    column, factor = luck.randrange(len(rows[0])), luck.choice([-1.0, 0.0, 1000.0, 0.001])
    for row in rows:
        with suppress(ValueError):
            row[column] = repr(float(row[column]) * factor)
    return rows


def _spoiled(luck, rows):
    column, word = (
        luck.randrange(len(rows[0])),
        luck.choice(["nan", "", "x", "1e9", "inf", "1;2", "0"]),
    )
    share = luck.choice([1.0, 0.5, 0.01])
    first = luck.randrange(len(rows))
    for row in rows[first : first + max(1, int(share * len(rows)))]:
        row[column] = word
    return rows


def _backwards(_, rows):
    return rows[::-1]


def _shorter(luck, rows):
    column = luck.randrange(len(rows[0]))
    return [row[:column] + row[column + 1 :] for row in rows]


def _nothing(_luck, _rows):
    return []


def _header(_luck, _rows):
    return []


def _another(_, rows):
    return rows


def _unit(_, rows):
    return rows


DAMAGES: tuple[Callable[[random.Random, Table], Table], ...] = (
    _cut,
    _late,
    _hole,
    _twice,
    _swapped,
    _scaled,
    _spoiled,
    _backwards,
    _shorter,
    _nothing,
    _header,
    _another,
    _unit,
)


if __name__ == "__main__":
    main()
