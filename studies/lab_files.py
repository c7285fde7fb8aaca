"""What the checks say of campaigns in files, sound ones and ones with a mistake, without figures and pages.

    make sound          sound campaigns of ten designs
    make mixups         each mistake in base A (20 directions three times, beds of 5 %) and base B (28 twice, 4 %)
    make reliability    false alarms, and mistakes of several sizes; rows are kept in studies/rows

Published media and 3D-RFT of two frictions take turns, with the errors of an ordinary lab: surface, patches, 1/f noise, beds.
A mistake is told where a check fails; else the verdict may be open ("not checked"), or the mistake is one that no data can
tell, as the page lists them. Where the angle of the plate is not measured, rods have no angle of their own.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from itertools import product
from typing import Any, NamedTuple
from unittest import mock

import frame
import numpy as np
import pandas as pd
from campaigns import FEW
from coverage_levels import as_disturbed, slow_noise
from frame import Part, Row, Tables, Unit
from mistakes import (
    CASES,
    CHANNELS,
    GRIDS,
    LOGS,
    Case,
    Written,
    change,
    copied,
    dead,
    enacted,
    judged,
    of_logs,
    one_off,
    plates,
    some,
    surface,
    turned,
)
from paper import sizes_of

from rftfit.campaign.config import Config
from rftfit.errors import InputError
from rftfit.lab import truth
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import PlannedRun, parse_directions
from rftfit.measure.verdict_words import FAILED, NOT_CHECKED, SOUND
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import MEDIA

Luck = np.random.Generator

OF_BED = ("surface=0.5", "surface-session=0.5", "patches=3", "pink=0.05")
"""Errors of a lab without a fault, but for what differs from bed to bed; bias, drift and noise are in every campaign."""


SLICES = {"3D-RFT, friction 0.2": (0.2, 0.35), "3D-RFT, friction 0.8": (0.8, 0.7875)}
"""Friction and alpha_z(0, 90 deg), N/cm^3, of media that nobody tuned on."""


def enact_in(bed: str, other: str, *settings: Any) -> Written:
    """Re-enact a campaign in a published medium, or in a slice of 3D-RFT in the place of another one."""
    if bed not in SLICES:
        return enacted(bed if bed in MEDIA else other, *settings)
    friction, size = SLICES[bed]

    def slice_3drft(_: str, beta_deg: float, gamma_deg: float) -> tuple[float, float]:
        z, x = alpha_3drft(np.radians(beta_deg), np.radians(gamma_deg), friction)
        return size * float(z), size * float(x)

    with mock.patch.object(truth, "table_s5", slice_3drft):
        return enacted(other, *settings)


# --- Sound campaigns


class Design(NamedTuple):
    """How many directions are pushed how often, and whether the sheet is sorted by direction."""

    directions: int
    repeats: int
    is_sorted: bool

    def __str__(self) -> str:
        order = "sorted" if self.is_sorted else "random"
        return f"{self.directions} directions, {self.repeats} each, {order}"


DESIGNS = (
    Design(9, 1, False),
    Design(20, 1, False),
    Design(40, 1, True),
    Design(78, 1, False),
    Design(12, 2, False),
    Design(28, 2, False),
    Design(12, 3, True),
    Design(20, 3, False),
    Design(20, 4, True),
    Design(12, 5, False),
)
GRID = [*product(np.arange(-75.0, 91.0, 15.0).tolist(), (-75.0, -60.0, -45.0, -30.0, 30.0, 45.0, 60.0, 75.0, 90.0))]  # fmt: skip
MOST_FAILED = 0.02
"""Share of the sound campaigns of which a check may fail."""


def grade_sound(seed: int, number: int) -> list[Row]:
    """Verdict on a sound campaign, and the codes of the checks that fail."""
    random = np.random.default_rng([seed, number])
    design = DESIGNS[number % len(DESIGNS)]
    beds = (*MEDIA, *SLICES)
    bed = beds[int(random.integers(len(beds)))]
    chosen = random.choice(len(GRID), design.directions, replace=False)
    directions = [GRID[place] for place in chosen]
    if (0.0, 90.0) not in directions:
        directions[0] = (0.0, 90.0)
    beds_percent = random.uniform(3, 8)
    sizes = sizes_of([*OF_BED, f"spread-percent={beds_percent:g}"])
    other = "" if bed in MEDIA else str(random.choice(MEDIA))
    campaign = enact_in(bed, other, 1000 * seed + number, None, directions, design.repeats, sizes)
    if design.is_sorted:
        campaign.rows.sort(
            key=lambda row: (row["kind"], float(row["beta_deg"]), float(row["gamma_deg"]))
        )
    else:
        shuffle_rows(campaign, random)
    judgement = judged(campaign)
    checks, verdict = judgement.checks, judgement.verdict
    failed = checks[checks["verdict"] == FAILED]
    return [
        {
            "design": str(design),
            "bed": bed,
            "beds_percent": beds_percent,
            "word": verdict.word,
            "failed": " ".join(failed["code"]),
            "sentence": " ".join(failed["found"]),
            "open": verdict.reason if verdict.word == NOT_CHECKED else "",
        }
    ]


def shuffle_rows(campaign: Written, random: Luck) -> None:
    """Put the rows of the sheet into random order."""
    campaign.rows = [campaign.rows[place] for place in random.permutation(len(campaign.rows))]


def report_sound(rows: pd.DataFrame) -> Tables:
    """Verdicts by design, and every failure."""
    words = pd.crosstab(rows["design"], rows["word"]).reset_index()
    failures = rows[rows["failed"].notna()]
    columns = ["unit", "design", "bed", "beds_percent", "failed", "sentence"]
    title = f"Checks failed in {len(failures)} of {len(rows)} sound campaigns"
    return [("Verdicts", words), (title, failures[columns])]


# --- Mistakes in the logs of plates


class Base(NamedTuple):
    """Directions, how often each is pushed, and how far beds differ, in percent."""

    directions: list[tuple[float, float]]
    repeats: int
    beds_percent: float


BASES = {
    "A": Base([*product((-60.0, -30.0, 0.0, 30.0, 60.0), (-45.0, 30.0, 60.0, 90.0))], 3, 5),
    "B": Base([*product(range(-75, 76, 25), (-45, 30, 60, 90))], 2, 4),
}
BED_DRAWS = 4
"""Runs of which an operator keeps the strongest."""


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
        factor = matrix_of(place, len(rows), luck)
        matrix = factor if isinstance(factor, np.ndarray) else np.eye(2) * factor

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


def between(
    begin: float, end: float, change_of_force: np.ndarray | float
) -> Callable[..., np.ndarray | float]:
    """Factor or matrix of the force in a part of the order of runs."""
    return lambda place, count, _luck: (
        change_of_force if begin * count <= place < end * count else 1.0
    )


def strongest(beds_percent: float) -> Callable[..., float]:
    """Factor of the strongest of some beds."""
    return lambda _place, _count, luck: (
        1 + beds_percent / 100 * luck.standard_normal(BED_DRAWS).max()
    )


def crosstalk(degrees: float = 0.0, x_in_z: float = 0.0, z_in_x: float = 0.0) -> np.ndarray:
    """Turned mount, then a share of a force in the other channel; x comes first."""
    angle = np.radians(degrees)
    mount = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.array([[1.0, z_in_x], [x_in_z, 1.0]]) @ mount


def of_cell(matrix: np.ndarray) -> Callable[[Written, Luck], None]:
    """Mistake of the force cell, which rods show, too."""
    return partial(transform_runs, matrix_of=between(0, 1, matrix), kinds=("plate", "rod"))


def wet_session(campaign: Written, luck: Luck, factor: float) -> None:
    """Let a third of the runs be made in wet sand, which column `session` of the sheet names."""
    wet = iter(luck.random(len(plates(campaign))) < 0.35)
    for row in campaign.rows:
        row["session"] = "" if row["kind"] != "plate" else "wet" if next(wet) else "dry"
    sessions = [row["session"] for row in plates(campaign)]
    transform_runs(
        campaign, luck, lambda place, _count, _luck: factor if sessions[place] == "wet" else 1.0
    )


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


def turn_beta(campaign: Written, _: Luck, directions: tuple[str, ...]) -> None:
    """Give beta of all runs of some directions, of their rods and of the arm the other sign."""
    for row in campaign.rows:
        if row["direction"] in directions and row["kind"] in ("plate", "rod"):
            beta_deg = -float(row["beta_deg"])
            row["beta_deg"] = f"{beta_deg:g}"

            def turn_back(log: np.ndarray) -> None:
                log[3] *= -1

            change(campaign, row["motion_log"], turn_back)


ALL_DIRECTIONS = ("intrusion", "horizontal", "extraction")


def mirror_rig(campaign: Written, luck: Luck) -> None:
    """Give beta and the force along x of all runs the other sign, as if the rig was seen from behind."""
    turn_beta(campaign, luck, ALL_DIRECTIONS)
    of_cell(np.array([[-1.0, 0.0], [0.0, 1.0]]))(campaign, luck)


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

    of_logs(campaign, [row for row in campaign.rows if row["kind"] == "rod"], enlarge)


IS_OPEN = " but for what it names"
"""Words for a sound verdict that names what these runs do not tell."""


class Mixup(NamedTuple):
    """Mistake, with codes of checks or problems that name its cause.

    `listed`: Whether the page lists it among what no data can tell. `has_angle`: Whether the angle of the plate is measured.
    `one_file`: Whether force and motion are in one file. `cause`, `size`: Of the shared cause that it is.
    """

    make: Callable[[Written, Luck], object]
    named_by: tuple[str, ...] = ()
    listed: bool = False
    has_angle: bool = True
    one_file: bool = False
    cause: str = ""
    size: float = np.nan


SHARED = ("shared-told",)


def late_gain(begin: float, end: float, factor: float) -> Mixup:
    """Another gain in a part of the order of runs."""
    make = partial(transform_runs, matrix_of=between(begin, end, factor))
    return Mixup(make, SHARED, cause="gain", size=factor - 1)


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
    "gain x 1.3 in the middle third": late_gain(1 / 3, 2 / 3, 1.3),
    "gain x 1.1 from half on": late_gain(0.5, 1, 1.1),
    "gain x 1.2 from half on": late_gain(0.5, 1, 1.2),
    "gain x 1.4 from half on": late_gain(0.5, 1, 1.4),
    "plate of 0.75 area in the last 30 %": late_gain(0.7, 1, 0.75),
    "bed settles, + 40 % over the campaign": Mixup(
        partial(transform_runs, matrix_of=lambda place, count, _luck: 1 + 0.4 * place / count),
        SHARED,
        cause="gain",
        size=0.4,
    ),
    "wet x 1.3 in a named session": Mixup(
        partial(wet_session, factor=1.3), SHARED, cause="gain", size=0.3
    ),
    "mount turned 5 deg from half on": Mixup(
        partial(transform_runs, matrix_of=between(0.5, 1, crosstalk(degrees=5.0))),
        SHARED,
        cause="turn",
        size=5.0,
    ),
    "wet x 1.5 in scattered 10 %": Mixup(
        partial(transform_runs, matrix_of=scattered(0.1, 1.5)), ("repeats",)
    ),
    **{
        f"{name} in all runs": Mixup(of_cell(np.array(matrix)), ("axes-others", "work-axes"))
        for name, matrix in (
            ("z reversed", [[1.0, 0.0], [0.0, -1.0]]),
            ("x reversed", [[-1.0, 0.0], [0.0, 1.0]]),
            ("x and z exchanged", [[0.0, 1.0], [1.0, 0.0]]),
        )
    },
    "8 % of z in the channel of x": Mixup(
        of_cell(crosstalk(z_in_x=0.08)), SHARED, cause="crosstalk", size=0.08
    ),
    "15 % of x in the channel of z": Mixup(of_cell(crosstalk(x_in_z=0.15)), SHARED, listed=True),
    "turn 4 deg and crosstalk 8 % that cancel": Mixup(
        of_cell(crosstalk(degrees=4.0, z_in_x=0.08)), SHARED, listed=True
    ),
    **{
        f"largest force {percent} % too small": Mixup(
            partial(compress, missing=percent / 100), ("compression-told",)
        )
        for percent in (10, 15, 20)
    },
    "beta of pulls with the other sign": Mixup(
        partial(turn_beta, directions=("extraction",)), ("axes-pulls",)
    ),
    "beta of all runs with the other sign": Mixup(
        partial(turn_beta, directions=ALL_DIRECTIONS), ("axes-others", "work-axes")
    ),
    "beta and x of all runs reversed": Mixup(mirror_rig, ("axes-others", "work-axes")),
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
    sizes = sizes_of([*OF_BED, f"spread-percent={base.beds_percent:g}"])
    protocol = "one-file" if one_file else "paper"
    campaign = enacted(medium, seed, None, base.directions, base.repeats, sizes, protocol)
    shuffle_rows(campaign, np.random.default_rng(seed))
    return campaign


def grade_mixup(seed: int, number: int, base: str, name: str) -> list[Row]:
    """What is said of a campaign with a mistake, and how many of its cells are wrong."""
    mixup = MIXUPS[name]
    campaign = enact_base(base, MEDIA[number % len(MEDIA)], 1000 * seed + number, mixup.one_file)
    if not mixup.has_angle:
        campaign.config["arm"]["angle_tolerance_deg"] = 90
        for row in campaign.rows:
            if row["kind"] == "rod":
                row["beta_deg"] = ""
    mixup.make(campaign, np.random.default_rng([seed, number]))
    answer: Row = {"base": base, "mistake": name, "listed": mixup.listed}
    try:
        judgement = judged(campaign)
    except InputError as error:
        codes = {problem.code for problem in getattr(error, "problems", ())}
        return [answer | {"word": "refused", "by its cause": bool(codes & {*mixup.named_by})}]
    checks = judgement.checks
    failed = checks[checks["verdict"] == FAILED]
    codes = {*failed["code"]}
    # the causes of one check, of channels, have codes in its words alone
    causes_of_channels = " ".join(failed.loc[failed["check"] == "channels", "found"])
    if "x and z exchanged" in causes_of_channels:
        codes.add("cause-axes")
    is_open = judgement.verdict.word == SOUND and judgement.verdict.reason
    answer |= {
        "word": judgement.verdict.word + IS_OPEN * bool(is_open),
        "by its cause": bool(codes & {*mixup.named_by}),
        "size inside": holds_size(judgement.causes, mixup.cause, mixup.size),
        "failed": " ".join(failed["code"]),
        "wrong cells": len(judgement.wrong()),
        "cells": len(judgement.alpha),
    }
    return [answer]


def holds_size(causes: pd.DataFrame, kind: str, size: float) -> float:
    """Whether the interval of the told cause holds its size; NaN where none of the kind is told."""
    told = causes[(causes["verdict"] == "told") & (causes["kind"] == kind)]
    if told.empty:
        return np.nan
    low, high, place = told.iloc[0][["size_lo", "size_hi", "place"]]
    # of a label the other one may be named
    if place == "dry":
        low, high = 1 / (1 + high) - 1, 1 / (1 + low) - 1
    return float(low <= size <= high)


def report_mixups(rows: pd.DataFrame) -> Tables:
    """Campaigns of each base and mistake that are told by their cause, verdicts, and codes of failed checks."""
    lines = []
    for (base, mistake), of_mistake in rows.groupby(["base", "mistake"], sort=False):
        codes = of_mistake["failed"].dropna().str.split().explode().value_counts()
        lines.append(
            {
                "base": base,
                "mistake": mistake,
                "campaigns": len(of_mistake),
                "by its cause": int(of_mistake["by its cause"].sum()),
                "size inside": f"{of_mistake['size inside'].sum():.0f} of {of_mistake['size inside'].count()}",
                "verdicts": _counts(of_mistake["word"].value_counts()),
                "failed": _counts(codes),
                "wrong cells": of_mistake["wrong cells"].mean(),
                "listed": "yes" if of_mistake["listed"].any() else "",
            }
        )
    return [("Mistakes through files", pd.DataFrame(lines))]


def _counts(counts: pd.Series) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())


# --- False alarms and power, by sizes; the rows are kept


ORDINARY = (*OF_BED[:2], "spread-percent=5", *OF_BED[2:])
CURVED = "depth^1.1"
RELIABILITY_BEDS = (*MEDIA, CURVED, *SLICES)
RIGHT = {CURVED: {"linearity"}}
"""Checks that rightly doubt a medium."""
NO_FAULT = "no-fault"
FALSE_ALARMS = 0.01


def _dead(campaign: Written, luck: Luck, share: float) -> list[str]:
    axis, where = "xz"[luck.integers(2)], ("random", "stretch")[luck.integers(2)]
    return list(dead(campaign, luck, axis, share, where))


def _step(campaign: Written, luck: Luck, mm: float) -> list[str]:
    return list(surface(campaign, luck, mm, 0.5, "stretch"))


class Kind(NamedTuple):
    """Campaigns of one kind.

    `sizes`, `campaigns`: of each size so many. `make`: puts the mistake into files. `told`: the check that names it.
    `least`: so many of 50 campaigns of a size, of either sign, must be told.
    """

    sizes: tuple[float, ...]
    campaigns: int
    make: Callable[..., list[str]] | None = None
    told: str = ""
    least: dict[float, int] = {}  # noqa: RUF012


KINDS = {
    NO_FAULT: Kind((0,), 200),
    "dead": Kind((0.3, 0.6, 1), 50, _dead, "channels", {1: 48}),
    "turned": Kind((-7, -4, -2, 2, 4, 7), 25, turned, "symmetry", {7: 48}),
    "step": Kind((-5, -3, -2, -1, 1, 2, 3, 5), 25, _step, "surface", {3: 34, 5: 40}),
    "repeat": Kind((-40, -20, -10, 10, 20, 40), 25, one_off, "repeats", {40: 45}),
}
"""Sizes: share of logs with a dead, noisy channel; turn of the mount, deg; step of the surface, mm; one of three repeats off, %."""

FEW_THRICE, PAPER_ONCE = Case("few", "paper"), Case("paper", "paper")


def grade_kind(name: str, size: float, seed: int) -> list[Row]:
    """Make a mistake in the files of a campaign, and check it."""
    kind = KINDS[name]
    luck = np.random.default_rng([seed, [*KINDS].index(name), round(100 * abs(size))])
    case = FEW_THRICE
    if kind.make is None and luck.random() < 0.5:
        case = CASES[luck.integers(len(CASES))] if luck.random() < 0.5 else PAPER_ONCE
    campaign = copied(without_fault(seed, case))
    if kind.make is not None:
        kind.make(campaign, luck, size)
    judgement = judged(campaign)
    effects = {*judgement.checks["effect"]}
    return [
        {
            "size": size,
            "told": "stated" if is_stated(seed) else "default",
            "bed": bed_of(seed),
            "design": str(case),
            "verdict": next((word for word in ("unusable", "doubtful") if word in effects), SOUND),
            "failed": " ".join(judgement.failed),
            "flags": " ".join(sorted(judgement.flags)),
        }
    ]


def bed_of(seed: int) -> str:
    """Return the medium that a campaign is made in."""
    return RELIABILITY_BEDS[seed // 2 % len(RELIABILITY_BEDS)]


def is_stated(seed: int) -> bool:
    """Whether the sizes of its errors are stated."""
    return seed % 2 == 1


@lru_cache(maxsize=1)
def without_fault(seed: int, case: Case) -> Written:
    """Re-enact a campaign in which nothing is wrong; those of one seed with other mistakes are the same."""
    bed, luck = bed_of(seed), np.random.default_rng(seed)
    directions: list[tuple[float, float]] | None = [*FEW] if case == FEW_THRICE else None
    if case.grid in GRIDS:
        directions = parse_directions(GRIDS[case.grid], seed)
    sizes = sizes_of([*ORDINARY, *(["power=1.1"] if bed == CURVED else [])])
    errors = as_disturbed(sizes).model_dump(exclude_none=True) if is_stated(seed) else None
    other = "" if bed in MEDIA else str(luck.choice(MEDIA))
    repeats = 3 if case == FEW_THRICE else 1
    campaign = enact_in(
        bed, other, seed, errors, directions, repeats, sizes, case.protocol, case.tare
    )
    if is_stated(seed):
        campaign.config["transducer"]["slow_noise_N"] = slow_noise(sizes)
    return campaign


def false_alarms(rows: pd.DataFrame) -> pd.DataFrame:
    """Campaigns without a fault of which a check fails that should not."""
    failed = rows["failed"].fillna("").str.split()
    is_wrong = [
        bool({*names} - RIGHT.get(bed, set()))
        for names, bed in zip(failed, rows["bed"], strict=True)
    ]
    return rows[is_wrong]


def report_no_fault(rows: pd.DataFrame) -> Tables:
    """False alarms, and how many curved media are told to be curved."""
    doubted, curved = false_alarms(rows), rows[rows["bed"] == CURVED]
    told = (curved["verdict"] != SOUND).sum()
    title = f"{len(doubted)} of {len(rows)} doubted; {told} of {len(curved)} of {CURVED} told to be curved"
    return [(title, doubted[["unit", "bed", "design", "told", "failed"]])]


def tell(name: str, rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of a kind with the size without its sign, and whether the mistake is told by its check."""
    is_told = [KINDS[name].told in cell.split() for cell in rows["failed"].fillna("")]
    return rows.assign(by=rows["size"].abs(), told=is_told, doubted=rows["verdict"] != SOUND)


def report_kind(name: str, rows: pd.DataFrame) -> Tables:
    """Mistakes that are told, by size and by medium."""
    rows = tell(name, rows)
    sizes = rows.groupby("by").agg(
        campaigns=("told", "size"), told=("told", "sum"), doubted=("doubted", "sum")
    )
    media = 100 * rows.pivot_table("told", "bed", "size")
    title = f"{name}: told by `{KINDS[name].told}`"
    return [(title, sizes.reset_index()), (f"{title}, % by medium", media.reset_index())]


def is_told_enough(name: str, rows: pd.DataFrame) -> bool:
    """Whether enough mistakes of each size are told."""
    shares = tell(name, rows).groupby("by")["told"].mean()
    least = KINDS[name].least
    return all(share >= least.get(float(str(size)), 0) / 50 for size, share in shares.items())


def list_kind(name: str, count: int, _seed: int) -> list[Unit]:
    """Campaigns of a kind; those of one seed stand together."""
    kind = KINDS[name]
    seeds = range(1, min(kind.campaigns, count or kind.campaigns) + 1)
    return [(name, size, seed) for seed in seeds for size in kind.sizes]


def list_mixups(names: Iterable[str], count: int, seed: int) -> list[Unit]:
    """Campaigns of each base and mistake."""
    return [(seed, n, base, name) for base in BASES for name in names for n in range(count)]


PARTS = {
    "sound": Part(
        frame.numbered,
        grade_sound,
        report_sound,
        200,
        lambda rows: rows["failed"].notna().sum() <= MOST_FAILED * len(rows),
    ),
    "mixups": Part(partial(list_mixups, MIXUPS), grade_mixup, report_mixups, 10),
    NO_FAULT: Part(
        partial(list_kind, NO_FAULT),
        grade_kind,
        report_no_fault,
        is_good=lambda rows: len(false_alarms(rows)) <= FALSE_ALARMS * len(rows),
    ),
    **{
        name: Part(
            partial(list_kind, name),
            grade_kind,
            partial(report_kind, name),
            is_good=partial(is_told_enough, name),
        )
        for name in [*KINDS][1:]
    },
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
