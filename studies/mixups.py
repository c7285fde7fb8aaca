"""What the verdict says of campaigns with a mistake, and by which cause, through whole files.

    make mixups                                        10 campaigns of each mistake, on bases A and B
    make mixups ARGS="30 --seed 5 --base A"            others
    make mixups ARGS="10 --mistakes sound compression" some mistakes alone

Base A: 20 directions three times, beds of 5 %; base B: 28 directions twice, 4 %; rows in random order, five published media,
ordinary errors. A mistake is told where a check fails; else the verdict may be open ("not checked"), or the mistake is one that
no data can tell, as the page lists them. Where the angle of the plate is not measured, rods have no angle of their own.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from mistakes import CHANNELS, Written, change, enacted, judged, of_logs, plates, some
from paper import sizes_of
from shared_causes import FILE_DIRECTIONS

from rftfit.campaign.config import Config
from rftfit.checks.verdict import verdict_on
from rftfit.errors import InputError
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import PlannedRun
from rftfit.reference import MEDIA

Luck = np.random.Generator


class Base(NamedTuple):
    """Directions, how often each is pushed, and how far beds differ, in percent."""

    directions: list[tuple[float, float]]
    repeats: int
    beds_percent: float


BASES = {
    "A": Base(FILE_DIRECTIONS, 3, 5),
    "B": Base([(b, g) for b in range(-75, 76, 25) for g in (-45, 30, 60, 90)], 2, 4),
}
BED_DRAWS = 4
"""Runs of which an operator keeps the strongest."""


# --- Mistakes in the logs of plates


def transform_runs(
    campaign: Written,
    luck: Luck,
    matrix_of: Callable[[int, int, Luck], np.ndarray | float],
    kinds: tuple[str, ...] = ("plate",),
) -> None:
    """Transform the forces (x, z) of each run by a matrix or factor of its place, the number of runs, and chance."""
    rows = [row for row in campaign.rows if row["kind"] in kinds]
    channels = [CHANNELS["x"], CHANNELS["z"]]
    for place, row in enumerate(rows):
        matrix = np.eye(2) * matrix_of(place, len(rows), luck)

        def transform(log: np.ndarray, matrix: np.ndarray = matrix) -> None:
            zero = log[channels, :100].mean(axis=1, keepdims=True)
            log[channels] = zero + matrix @ (log[channels] - zero)

        if not np.array_equal(matrix, np.eye(2)):
            change(campaign, row["force_log"], transform)


def scattered(share: float, factor: float) -> Callable[..., float]:
    """Factor of the force in a scattered share of the runs."""
    return lambda _place, _count, luck: factor if luck.random() < share else 1.0


def in_blocks(place: int, _count: int, _luck: Luck) -> float:
    """Factor of the force in every other block of five runs."""
    return 1.3 if place // 5 % 2 else 1.0


def in_middle(place: int, count: int, _luck: Luck) -> float:
    """Factor of the force in the middle third."""
    return 1.3 if count / 3 <= place < 2 * count / 3 else 1.0


def strongest(beds_percent: float) -> Callable[..., float]:
    """Factor of the strongest of some beds."""
    return lambda _place, _count, luck: (
        1 + beds_percent / 100 * luck.standard_normal(BED_DRAWS).max()
    )


def crosstalk(
    _place: int,
    _count: int,
    _luck: Luck,
    degrees: float = 0.0,
    x_in_z: float = 0.0,
    z_in_x: float = 0.0,
) -> np.ndarray:
    """Turned mount, then a share of a force in the other channel; x comes first."""
    angle = np.radians(degrees)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.array([[1.0, z_in_x], [x_in_z, 1.0]]) @ turned


def compress(campaign: Written, _: Luck, missing: float) -> None:
    """Let an amplifier show the largest force of the campaign too small, by a share, and smaller ones less."""
    channels = [*CHANNELS.values()]
    largest = []

    def look(log: np.ndarray) -> None:
        force = np.abs(log[channels] - log[channels, :100].mean(axis=1, keepdims=True))
        largest.append(float(np.quantile(force, 0.999)))

    def shrink(log: np.ndarray) -> None:
        zero = log[channels, :100].mean(axis=1, keepdims=True)
        force = log[channels] - zero
        log[channels] = zero + force * (1 - missing * np.abs(force) / max(largest))

    of_logs(campaign, plates(campaign), look)
    of_logs(campaign, [row for row in campaign.rows if row.get("force_log")], shrink)


def hold_askew(campaign: Written, luck: Luck, degrees: float) -> None:
    """Let all plates with beta above 0 be turned farther than sheet and arm say."""
    config = Config.model_validate(campaign.config)
    for row in plates(campaign):
        beta_deg = float(row["beta_deg"])
        if beta_deg <= 0:
            continue
        run = PlannedRun(
            row["run_id"],
            "plate",
            row["medium"],
            row["medium"],
            "plate",
            row["direction"],
            beta_deg + degrees,
            float(row["gamma_deg"]),
            clock_s=50_000.0 + 40 * int(luck.integers(1000)),
        )
        logs = run_logs(run, config, int(luck.integers(1000)))
        for name in LOGS:
            campaign.logs[row[name]] = logs[getattr(run, name)] or b""

        def set_back(log: np.ndarray) -> None:
            log[3] -= degrees

        change(campaign, row["motion_log"], set_back)


def turn_pulls(campaign: Written, _: Luck) -> None:
    """Give beta of all pulls, of their rods and of the arm the other sign."""
    for row in campaign.rows:
        if row["direction"] == "extraction" and row["kind"] in ("plate", "rod"):
            beta_deg = -float(row["beta_deg"])
            row["beta_deg"] = f"{beta_deg:g}"

            def turn_back(log: np.ndarray) -> None:
                log[3] *= -1

            change(campaign, row["motion_log"], turn_back)


def drift_in_strokes(campaign: Written, luck: Luck, newtons: float, ends_in_air: bool) -> None:
    """Let the zero of z drift within each stroke; logs of one file, which go on into air as the arm returns."""
    surface_mm = Config.model_validate(campaign.config).arm.surface_z_mm
    x, z, height = 3, 4, 6

    def drift(log: np.ndarray) -> np.ndarray:
        begins_in_air = log[height, 0] > log[height, -1]
        if ends_in_air and begins_in_air:
            log = _with_return(log, (x, z), luck)
        inside = (log[1] > 0) & (log[height] < surface_mm)
        inside[np.flatnonzero(inside)[0] + _stroke_rows(inside) :] = False
        log[z] += newtons * np.cumsum(inside) / max(inside.sum(), 1)
        return log

    of_logs(campaign, plates(campaign), drift)


def _stroke_rows(inside: np.ndarray) -> int:
    """Length of the first stretch of samples."""
    ends = np.flatnonzero(~inside[np.flatnonzero(inside)[0] :])
    return int(ends[0]) if ends.size else inside.size


def _with_return(log: np.ndarray, forces: tuple[int, int], luck: Luck) -> np.ndarray:
    """Log of one file that goes on while the arm goes back the way it came and rests in air."""
    back = log[:, ::-1].copy()
    back[0] = log[0, -1] + (log[0, -1] - back[0]) + np.median(np.diff(log[0]))
    for channel in forces:
        zero = log[channel, :100].mean()
        noise = luck.permutation(log[channel, :100] - zero)
        back[channel] = zero + np.resize(noise, back.shape[1])
        pulled = (log[channel, ::-1] - zero) * (log[6, ::-1] < log[6, 0] - 1)
        back[channel] -= 0.2 * pulled
    return np.concatenate([log, back], axis=1)


# --- Mistakes with cables, rows and rods


def exchange_cables(campaign: Written, luck: Luck, where: str) -> None:
    """Exchange the cables of F2 and F3 in 30 % of the plate runs."""
    both = [*CHANNELS.values()]

    def exchange(log: np.ndarray) -> None:
        log[both] = log[both[::-1]]

    of_logs(campaign, some(plates(campaign), 0.3, luck, where), exchange)


def shift_columns(campaign: Written, _: Luck, columns: tuple[str, ...], first: float = 0.0) -> None:
    """Move cells of plate rows down by one row, in the last part of the sheet from a share `first` on."""
    rows = plates(campaign)
    rows = rows[round(first * len(rows)) :]
    cells = [{column: row[column] for column in columns} for row in rows]
    for row, moved in zip(rows, [cells[-1], *cells[:-1]], strict=True):
        row.update(moved)


def take_other_rods(campaign: Written, _: Luck, factor: float) -> None:
    """Let the rods of the rod runs bear so many times the force."""

    def enlarge(log: np.ndarray) -> None:
        zero = log[2:, :100].mean(axis=1, keepdims=True)
        log[2:] = zero + (log[2:] - zero) * factor

    for row in campaign.rows:
        if row["kind"] == "rod":
            change(campaign, row["force_log"], enlarge)


class Mixup(NamedTuple):
    """Mistake, with codes of checks or problems that name its cause.

    `listed`: Whether the page lists it among what no data can tell. `has_angle`: Whether the angle of the plate is measured.
    `one_file`: Whether force and motion are in one file.
    """

    make: Callable[[Written, Luck], object]
    named_by: tuple[str, ...] = ()
    listed: bool = False
    has_angle: bool = True
    one_file: bool = False


LOGS = ("force_log", "motion_log")
SHARED = ("shared-told",)
MIXUPS = {
    "sound": Mixup(lambda _campaign, _luck: None),
    "plate of 0.8 area in a scattered half": Mixup(
        partial(transform_runs, matrix_of=scattered(0.5, 0.8)), listed=True
    ),
    "beta > 0 really 8 deg more": Mixup(partial(hold_askew, degrees=8.0), listed=True),
    "highest of 4 kept": Mixup(partial(transform_runs, matrix_of=strongest(5)), listed=True),
    "gain x 1.3 in blocks of 5 runs": Mixup(
        partial(transform_runs, matrix_of=in_blocks), listed=True
    ),
    "gain x 1.3 in the middle third": Mixup(partial(transform_runs, matrix_of=in_middle), SHARED),
    "wet x 1.5 in scattered 10 %": Mixup(
        partial(transform_runs, matrix_of=scattered(0.1, 1.5)), ("repeats",)
    ),
    "15 % of x in the channel of z": Mixup(
        partial(transform_runs, matrix_of=partial(crosstalk, x_in_z=0.15), kinds=("plate", "rod")),
        SHARED,
        listed=True,
    ),
    "turn 4 deg and crosstalk 8 % that cancel": Mixup(
        partial(
            transform_runs,
            matrix_of=partial(crosstalk, degrees=4.0, z_in_x=0.08),
            kinds=("plate", "rod"),
        ),
        SHARED,
        listed=True,
    ),
    **{
        f"largest force {percent} % too small": Mixup(
            partial(compress, missing=percent / 100), ("compression-told",)
        )
        for percent in (10, 15, 20)
    },
    "beta of pulls with the other sign": Mixup(turn_pulls, ("axes-pulls",)),
    "zero drifts 2 N in strokes, end in air": Mixup(
        partial(drift_in_strokes, newtons=2.0, ends_in_air=True), ("drift-between",), one_file=True
    ),
    "zero drifts 2 N in strokes, end in bed": Mixup(
        partial(drift_in_strokes, newtons=2.0, ends_in_air=False), listed=True, one_file=True
    ),
    "F2 and F3 exchanged in 30 %, scattered": Mixup(
        partial(exchange_cables, where="random"), ("cause-axes",)
    ),
    "F2 and F3 exchanged in 30 %, in a row": Mixup(
        partial(exchange_cables, where="stretch"), ("cause-axes",)
    ),
    "logs shifted by a row": Mixup(partial(shift_columns, columns=LOGS), ("sheet-logs",)),
    "logs shifted by a row in the last half": Mixup(
        partial(shift_columns, columns=LOGS, first=0.5), ("sheet-logs",)
    ),
    "logs shifted by a row, no angle": Mixup(
        partial(shift_columns, columns=LOGS), ("sheet-logs", "sheet-rows"), has_angle=False
    ),
    "beta shifted by a row": Mixup(
        partial(shift_columns, columns=("beta_deg",)), ("sheet.column-shifted", "sheet-logs")
    ),
    "beta shifted by a row, no angle": Mixup(
        partial(shift_columns, columns=("beta_deg",)), ("sheet-beta",), has_angle=False
    ),
    "rods of 2.5 times the force": Mixup(partial(take_other_rods, factor=2.5), ("rods-other",)),
    "rods of 0.4 times the force": Mixup(
        partial(take_other_rods, factor=0.4), ("rods-other-small",)
    ),
}


def enact_base(name: str, medium: str, seed: int, one_file: bool = False) -> Written:
    """Re-enact a base with ordinary errors, the rows of the sheet in random order."""
    base = BASES[name]
    ordinary = ("surface=0.5", "surface-session=0.5", "patches=3", "pink=0.05")
    sizes = sizes_of([*ordinary, f"spread-percent={base.beds_percent:g}"])
    protocol = "one-file" if one_file else "paper"
    campaign = enacted(medium, seed, None, base.directions, base.repeats, sizes, protocol)
    order = np.random.default_rng(seed).permutation(len(campaign.rows))
    campaign.rows = [campaign.rows[place] for place in order]
    return campaign


def judge(job: tuple[int, int, str, str]) -> dict[str, Any]:
    """What is said of a campaign with a mistake, and how many of its cells are wrong."""
    seed, number, base, name = job
    mixup = MIXUPS[name]
    campaign = enact_base(base, MEDIA[number % len(MEDIA)], 1000 * seed + number, mixup.one_file)
    if not mixup.has_angle:
        campaign.config["arm"]["angle_tolerance_deg"] = 90
        for row in campaign.rows:
            if row["kind"] == "rod":
                row["beta_deg"] = ""
    mixup.make(campaign, np.random.default_rng([seed, number]))
    answer: dict[str, Any] = {"base": base, "mistake": name}
    try:
        judgement = judged(campaign)
    except InputError as error:
        codes = {problem.code for problem in getattr(error, "problems", ())}
        return answer | {
            "word": "refused",
            "by its cause": bool(codes & {*mixup.named_by}),
            "failed": "",
        }
    checks = judgement.checks
    failed = checks[checks["verdict"] == "failed"]
    named = {*failed["code"]}
    # the causes of one check, of channels, have codes in its words alone
    causes_of_channels = " ".join(failed.loc[failed["check"] == "channels", "found"])
    if "x and z exchanged" in causes_of_channels:
        named.add("cause-axes")
    wrong = judgement.wrong()
    return answer | {
        "word": verdict_on(checks).word,
        "by its cause": bool(named & {*mixup.named_by}),
        "failed": " ".join(failed["code"]),
        "wrong cells": len(wrong),
        "cells": len(judgement.alpha),
    }


def main() -> int:
    """Print a row of each base and mistake."""
    parser = argparse.ArgumentParser(prog="make mixups", description=__doc__)
    parser.add_argument("campaigns", type=int, nargs="?", default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--base", choices=[*BASES], nargs="*", default=[*BASES])
    parser.add_argument("--mistakes", nargs="*", default=[*MIXUPS], help="parts of their names")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    names = [name for name in MIXUPS if any(part in name for part in options.mistakes)]
    jobs = [
        (options.seed, number, base, name)
        for base in options.base
        for name in names
        for number in range(options.campaigns)
    ]
    with Pool(options.processes) as pool:
        answers = pool.imap(judge, jobs)
        for base, name in product(options.base, names):
            of_mistake = pd.DataFrame([next(answers) for _ in range(options.campaigns)])
            words = of_mistake["word"].value_counts()
            codes = of_mistake["failed"].str.split().explode().value_counts()
            print(
                f"{base} {name:40} by its cause {of_mistake['by its cause'].sum():3} of {len(of_mistake)}; "
                + ", ".join(f"{word} {count}" for word, count in words.items())
                + f"; cells wrong {of_mistake.get('wrong cells', pd.Series([0.0])).mean():.1f}"
                + ("; listed" if MIXUPS[name].listed else "")
                + "".join(f"; {code} {count}" for code, count in codes.items()),
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
