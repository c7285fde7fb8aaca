"""What the joint model of all runs tells: false alarms, power and coverage, on slopes that it did not make.

    make shared                                200 sound campaigns, all faults, axes
    make shared ARGS="--sound 400 --seed 7"    more of them, others
    make shared ARGS="--faults gain-1.2 --directions 40 --repeats 1"
    make shared ARGS="--files 10"              the faults through logs and run sheet, 10 seeds in each of three media
    make shared ARGS="--slips 20"              after how many pushes a mount that slips is told
    make shared ARGS="--power 5"               share told against size, by design, 5 seeds in each of four kinds of media

Media: the published tables (left out of the known shapes), the same warped, 3D-RFT of small and of large friction, and
nine Fourier terms that are 15 % off the generic ones. Each run has a bed of its own, a patch of 3 %, angles, a surface and noise.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pool
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from mistakes import CHANNELS, change, enacted, judged, plates
from paper import sizes_of

from rftfit.campaign.sheet import Run
from rftfit.compare.axes import axes_evidence
from rftfit.compare.causes import describe_change
from rftfit.compare.joint import FALSE_ALARMS, JointModel, RunSlopes, find_causes
from rftfit.compare.misplaced import find_misplaced
from rftfit.compare.peers import compare_runs
from rftfit.measure.alpha import column
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import MEDIA

KINDS = ("published", "warped", "frictional", "3D-RFT", "nine terms")
GENERIC = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)
Medium = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Campaign:
    """Runs of one medium; `without`: the published medium that the known shapes leave out."""

    kind: str
    beta: np.ndarray
    gamma: np.ndarray
    alpha: np.ndarray
    se: np.ndarray
    without: tuple[str, ...]

    @property
    def side(self) -> np.ndarray:
        """-1 for pulls, of which alpha_x is stored with the other sign."""
        return np.where(self.gamma < 0, -1.0, 1.0)

    def slopes(self, alpha: np.ndarray | None = None, **labels: np.ndarray) -> RunSlopes:
        """As the model takes them."""
        alpha = self.alpha if alpha is None else alpha
        order = np.arange(self.beta.size)
        return RunSlopes(self.beta, self.gamma, alpha, self.se, self.gamma < 0, order, labels)


def make_medium(kind: str, random: np.random.Generator) -> tuple[Medium, tuple[str, ...], float]:
    """Draw a medium: alpha of directions in degrees, whom to leave out, and alpha_z(0, 90 deg)."""
    size = float(10 ** random.uniform(-1.2, 0.3))
    name = str(random.choice(MEDIA))
    without = (name,) if kind in ("published", "warped") else ()
    profile = TableProfile.published(name)
    friction = random.uniform(0.6, 1.2) if kind == "frictional" else random.uniform(0.1, 0.9)
    terms = np.array(GENERIC) * random.normal(1, 0.15, 9)
    warp, pulls, along_x = random.normal(0, (0.10, 0.15, 0.15))
    level, fourth = random.normal(0, 0.08, 2)

    def shape(beta_deg: np.ndarray, gamma_deg: np.ndarray) -> np.ndarray:
        beta, gamma = np.radians(beta_deg), np.radians(gamma_deg)
        if kind in ("frictional", "3D-RFT"):
            return np.stack(alpha_3drft(beta, gamma, friction))
        if kind == "nine terms":
            a00, a10, b11, b01, bm11, c11, c01, cm11, d10 = terms
            z = a00 + a10 * np.cos(2 * beta) + b11 * np.sin(2 * beta + gamma)
            z = z + b01 * np.sin(gamma) + bm11 * np.sin(gamma - 2 * beta)
            x = c11 * np.cos(2 * beta + gamma) + c01 * np.cos(gamma)
            x = x + cm11 * np.cos(gamma - 2 * beta) + d10 * np.sin(2 * beta)
            return np.stack([z, x])
        z, x = profile.alpha(beta, gamma)
        if kind == "published":
            return np.stack([z, x])
        common = 1 + warp * np.cos(2 * beta) + level * np.cos(gamma) ** 2
        common = (common + fourth * np.cos(4 * beta) / 2) * np.where(gamma < 0, 1 + pulls, 1.0)
        return np.stack([z * common, x * common * (1 + along_x)])

    top = float(shape(np.zeros(1), np.full(1, 90.0))[0, 0])
    return lambda beta, gamma: size * shape(beta, gamma) / top, without, size


def draw_design(
    random: np.random.Generator, directions: int, repeats: int, is_sorted: bool, on_grid: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Directions of all runs in their order, degrees; the level plate straight down is one of them."""
    if on_grid:
        pool = [(b, g) for b in range(-90, 90, 15) for g in range(-90, 91, 15)]
        chosen = random.choice(len(pool), min(directions, len(pool)), replace=False)
        beta, gamma = np.array(pool, dtype=float)[chosen].T
    else:
        beta = np.round(random.uniform(-90, 90, directions))
        down = random.random(directions) < 0.7
        gamma = np.round(
            np.where(down, random.uniform(0, 90, directions), random.uniform(-90, 0, directions))
        )
    beta[0], gamma[0] = 0, 90
    if is_sorted:
        order = np.lexsort((gamma, beta))
        return np.repeat(beta[order], repeats), np.repeat(gamma[order], repeats)
    order = random.permutation(np.tile(np.arange(beta.size), repeats))
    return beta[order], gamma[order]


def make_campaign(
    kind: str,
    random: np.random.Generator,
    directions: int | None = None,
    repeats: int | None = None,
    beds: float | None = None,
    grid: list[tuple[float, float]] | None = None,
) -> Campaign:
    """Draw a sound campaign."""
    alpha, without, size = make_medium(kind, random)
    is_any = directions is None
    directions = directions or int(random.integers(12, 77))
    repeats = repeats or int(random.choice([1, 3]))
    is_sorted = bool(is_any and random.random() < 0.5)
    on_grid = bool(not is_any or random.random() < 0.5)
    beta, gamma = draw_design(random, directions, repeats, is_sorted, on_grid)
    if grid is not None:
        beta, gamma = np.array(grid * repeats, dtype=float).T
    count = beta.size
    bed = beds or random.uniform(0.03, 0.08)
    off_beta, off_gamma = random.normal(0, 0.3, count), random.normal(0, 0.2, count)
    slopes = alpha(beta + off_beta, gamma + off_gamma) * random.normal(1, bed, count)
    slopes += random.normal(0, 0.03, (2, count)) * np.hypot(*slopes)
    se = 0.003 * size * random.uniform(0.5, 1.5, (2, count))
    slopes += random.standard_normal((2, count)) * se
    # the surface of each run and of all: 0.5 mm over some 5 cm
    slopes = slopes * random.normal(1, 0.012, count) * random.normal(1, 0.012)
    return Campaign(kind, beta, gamma, slopes, se, without)


def turn(campaign: Campaign, degrees: float) -> np.ndarray:
    """Forces by a mount that is turned."""
    angle = np.radians(degrees) * campaign.side
    z, x = campaign.alpha
    return np.stack([z * np.cos(angle) + x * np.sin(angle), x * np.cos(angle) - z * np.sin(angle)])


def _late(campaign: Campaign, share: float, faulty: np.ndarray) -> np.ndarray:
    progress = np.arange(campaign.beta.size) / campaign.beta.size
    return np.where(progress >= share, faulty, campaign.alpha)


FAULTS = {
    "gain-1.1": (("gain",), 0.1),
    "gain-1.2": (("gain",), 0.2),
    "gain-1.4": (("gain",), 0.4),
    "trend-0.4": (("gain",), 0.4),
    "plate-0.75": (("gain",), -0.25),
    "session-1.15": (("gain",), 0.15),
    "session-1.3": (("gain",), 0.3),
    "mount-5": (("turn",), 5.0),
    "crosstalk-0.08": (("crosstalk", "turn"), 0.08),
}
"""Kinds of the cause by which each fault is told, and its size: of a gain the runs after over those before, less 1."""


def put_fault(campaign: Campaign, fault: str, random: np.random.Generator) -> RunSlopes:
    """The runs with a fault."""
    size, alpha = FAULTS[fault][1], campaign.alpha
    count = campaign.beta.size
    name = fault.partition("-")[0]
    if name == "session":
        wet = random.random(count) < 0.35
        return campaign.slopes(
            alpha * np.where(wet, 1 + size, 1.0), session=np.where(wet, "wet", "dry")
        )
    if name == "trend":
        return campaign.slopes(alpha * (1 + size * np.arange(count) / count))
    if name == "mount":
        return campaign.slopes(_late(campaign, 0.5, turn(campaign, size)))
    if name == "crosstalk":
        return campaign.slopes(np.stack([alpha[0], alpha[1] + size * campaign.side * alpha[0]]))
    return campaign.slopes(_late(campaign, 0.7 if name == "plate" else 0.5, (1 + size) * alpha))


def judge_sound(job: tuple[int, int]) -> dict[str, object]:
    """Whether a sound campaign has a false alarm."""
    seed, number = job
    random = np.random.default_rng([seed, number])
    campaign = make_campaign(KINDS[number % len(KINDS)], random)
    started = time.process_time()
    runs = campaign.slopes()
    told_causes, _ = find_causes(JointModel(runs, without=campaign.without))
    evidence = axes_evidence(runs, campaign.without)
    names = [f"r{run}" for run in range(runs.size)]
    fits = pd.DataFrame({"run_id": names, "beta_deg": runs.beta_deg, "gamma_deg": runs.gamma_deg})
    for place, component in enumerate("zx"):
        fits[column(component)] = runs.alpha[place]
        fits[column(component, "_se")] = runs.se[place]
    apart = compare_runs(fits.assign(depth_from_cm=np.nan), "medium")["apart"]
    misplaced = find_misplaced(runs, names, _sheet_of(names, runs), "medium", campaign.without)
    return {
        "misplaced": misplaced["log_bayes_factor"].max() if len(misplaced) else 0.0,
        "kind": campaign.kind,
        "runs": runs.size,
        "seconds": time.process_time() - started,
        "shared cause": bool(told_causes),
        "run apart": bool(apart.any()),
        "axes": max(evidence.values()) > 4,
        "what": " ".join(f"{cause.cause.kind}/{cause.cause.group}" for cause in told_causes),
    }


def _sheet_of(names: list[str], runs: RunSlopes) -> dict[str, Run]:
    """Run sheet of slopes without logs, in their order; a path downward or upward is that of a push."""
    logs_and_notes = ("", "", "", False, None, False, "", "")
    return {
        name: Run(
            name,
            "plate",
            "m",
            "plate",
            "intrusion",
            float(beta),
            float(gamma),
            math.nan,
            *logs_and_notes,
            row,
        )
        for row, (name, beta, gamma) in enumerate(
            zip(names, runs.beta_deg, runs.gamma_deg, strict=True), 2
        )
    }


def judge_fault(job: tuple[int, int, str, int, int]) -> dict[str, object]:
    """Whether a fault is told, by its cause, and whether its size is inside the interval."""
    seed, number, fault, directions, repeats = job
    random = np.random.default_rng([seed, number, len(fault)])
    kind = ("published", "warped", "3D-RFT")[number % 3]
    campaign = make_campaign(kind, random, directions, repeats, 0.05)
    model = JointModel(put_fault(campaign, fault, random), without=campaign.without)
    told_causes, scan = find_causes(model)
    kinds, size = FAULTS[fault]
    by_cause = [cause for cause in told_causes if cause.cause.kind in kinds]
    row: dict[str, object] = {
        "fault": fault,
        "told": bool(told_causes),
        "by its cause": bool(by_cause),
    }
    if by_cause and by_cause[0].cause.kind == kinds[0]:
        low, high = describe_change(by_cause[0])[1:]
        # of a label the other one may be named
        if by_cause[0].cause.place == "dry":
            low, high = 1 / (1 + high) - 1, 1 / (1 + low) - 1
        row["inside"] = low <= size <= high
    gains = [
        least
        for cause, least in zip(scan.causes, scan.least_seen, strict=True)
        if (cause.kind, cause.group) == ("gain", "from-run")
    ]
    return row | {"least gain": float(np.median(gains)) if gains else np.nan}


def judge_axes(job: tuple[int, int, str]) -> dict[str, object]:
    """Which axes are told of a small downward grid."""
    seed, number, name = job
    random = np.random.default_rng([seed, number, len(name)])
    campaign = make_campaign(KINDS[number % len(KINDS)], random, 12, 1, grid=GRIDS[name])
    row: dict[str, object] = {"grid": name}
    z, x = campaign.alpha
    faulty = {"as-given": (z, x), "x-reversed": (z, -x), "z-reversed": (-z, x), "exchanged": (x, z)}
    for axes, alpha in faulty.items():
        evidence = axes_evidence(campaign.slopes(np.stack(alpha)), campaign.without)
        best = max(evidence, key=lambda candidate: evidence[candidate])
        is_told = best != "as-given" and evidence[best] > 4
        row[axes] = (best == axes and is_told) if axes != "as-given" else is_told
    return row


SOUND = "sound"
ORDINARY = ("surface=0.5", "surface-session=0.5", "spread-percent=5", "patches=3", "pink=0.05")
FILE_MEDIA = ("poppy_LP", "glass0.3mm_CP", "glass3mm_CP")
FILE_DIRECTIONS = [
    (b, g) for b in (-60.0, -30.0, 0.0, 30.0, 60.0) for g in (-45.0, 30.0, 60.0, 90.0)
]


def judge_files(job: tuple[int, int, str, str]) -> dict[str, object]:
    """Whether a fault in the logs of plates is told, 20 directions three times, rows in random order."""
    seed, number, fault, medium = job
    random = np.random.default_rng([seed, number])
    campaign = enacted(
        medium, 1000 * seed + number, None, FILE_DIRECTIONS, 3, sizes_of([*ORDINARY])
    )
    campaign.rows = [campaign.rows[place] for place in random.permutation(len(campaign.rows))]
    rows, name = plates(campaign), fault.partition("-")[0]
    size = 0.0 if fault == SOUND else FAULTS[fault][1]
    wet = random.random(len(rows)) < 0.35
    for place, row in enumerate(rows):
        progress, is_wet = place / len(rows), bool(wet[place])
        factor, turn_deg, into_x = 1.0, 0.0, 0.0
        if name == "session":
            row["session"] = "wet" if is_wet else "dry"
            factor = 1 + size * is_wet
        elif name == "trend":
            factor = 1 + size * progress
        elif name == "mount":
            turn_deg = size * (progress >= 0.5)
        elif name == "crosstalk":
            into_x = size
        elif name in ("gain", "plate"):
            factor = 1 + size * (progress >= (0.7 if name == "plate" else 0.5))

        def spoil(
            log: np.ndarray,
            factor: float = factor,
            degrees: float = turn_deg,
            share: float = into_x,
        ) -> None:
            x, z = (log[CHANNELS[axis]].copy() for axis in "xz")
            zero_x, zero_z = x[:100].mean(), z[:100].mean()
            x, z = factor * (x - zero_x), factor * (z - zero_z)
            angle = np.radians(degrees)
            turned_x = np.cos(angle) * x - np.sin(angle) * z + share * z
            log[CHANNELS["x"]] = zero_x + turned_x
            log[CHANNELS["z"]] = zero_z + np.sin(angle) * x + np.cos(angle) * z

        if (factor, turn_deg, into_x) != (1.0, 0.0, 0.0):
            change(campaign, row["force_log"], spoil)
    if name == "crosstalk":
        # that of the cell itself: rods show it, too
        for row in campaign.rows:
            if row["kind"] == "rod":
                change(
                    campaign, row["force_log"], partial(spoil, factor=1.0, degrees=0.0, share=size)
                )
    if name == "session":
        for row in campaign.rows:
            row.setdefault("session", "")
    judgement = judged(campaign)
    checks = judgement.checks.set_index("check")
    kinds = () if fault == SOUND else FAULTS[fault][0]
    told_causes = judgement.causes[judgement.causes["verdict"] == "told"]
    kinds_beside = {
        words.split()[0]
        for cell in told_causes["inseparable"]
        for words in cell.split("; ")
        if words
    }
    return {
        "fault": fault,
        "medium": medium,
        "told": checks.loc["shared", "verdict"] == "failed",
        "by its cause": not told_causes.empty and any(told_causes["kind"].isin(kinds)),
        "printed beside": not told_causes.empty and bool(kinds_beside & {*kinds}),
        "inside": _holds_size(judgement.causes, kinds, size),
        "another check": " ".join(
            check for check in checks.index[checks["verdict"] == "failed"] if check != "shared"
        ),
        "words": checks.loc["shared", "found"],
    }


def _holds_size(causes: pd.DataFrame, kinds: tuple[str, ...], size: float) -> float:
    """Whether the interval of the told cause holds its size; NaN where it is not told by its own kind."""
    told_causes = causes[(causes["verdict"] == "told") & causes["kind"].isin(kinds[:1])]
    if told_causes.empty:
        return np.nan
    low, high, place = told_causes.iloc[0][["size_lo", "size_hi", "place"]]
    if place == "dry":
        low, high = 1 / (1 + high) - 1, 1 / (1 + low) - 1
    return float(low <= size <= high)


DESIGNS = {
    "12 directions once": (12, 1),
    "20 directions once": (20, 1),
    "40 directions once": (40, 1),
    "76 directions once": (76, 1),
    "12 directions 3 times": (12, 3),
    "20 directions 3 times": (20, 3),
}
SIZES = {"gain": (0.05, 0.1, 0.15, 0.2, 0.3, 0.4), "turn": (2.0, 3.0, 5.0, 7.0, 10.0)}
"""Of a change of all forces from half on, and of a mount that is turned from half on, degrees."""


def judge_power(job: tuple[int, int, str, str, float]) -> dict[str, object]:
    """Whether a fault of one size is told by a design, in random order."""
    seed, number, design, kind_of_fault, size = job
    random = np.random.default_rng([seed, number, len(design)])
    kind = ("published", "warped", "frictional", "3D-RFT")[number % 4]
    campaign = make_campaign(kind, random, *DESIGNS[design], 0.05)
    faulty = (1 + size) * campaign.alpha if kind_of_fault == "gain" else turn(campaign, size)
    runs = campaign.slopes(_late(campaign, 0.5, faulty))
    told_causes, _ = find_causes(JointModel(runs, without=campaign.without))
    return {"fault": kind_of_fault, "design": design, "size": size, "told": bool(told_causes)}


def print_power(seed: int, seeds: int) -> None:
    """Print the share told by size and design."""
    jobs = [
        (seed, number, design, kind, size)
        for design in DESIGNS
        for kind, sizes in SIZES.items()
        for size in sizes
        for number in range(4 * seeds)
    ]
    with Pool() as pool:
        judged_rows = pd.DataFrame(pool.map(judge_power, jobs, chunksize=4))
    print(f"told of {4 * seeds} campaigns in four kinds of media, beds of 5 %:")
    for kind, rows in judged_rows.groupby("fault"):
        counts = rows.pivot_table("told", "design", "size", "sum", sort=False)
        print(f"{kind} from half on\n{counts.astype(int).to_string()}")


SLIPS_AT, SLIP_RUNS = 12, 60


def judge_slip(job: tuple[int, int, float]) -> dict[str, object]:
    """After how many further pushes `rftfit watch` tells a mount that slips, if within the campaign."""
    seed, number, degrees = job
    random = np.random.default_rng([seed, number])
    kind = ("published", "warped", "frictional", "3D-RFT")[number % 4]
    campaign = make_campaign(kind, random, 20, 3, 0.05)
    alpha = _late(campaign, SLIPS_AT / campaign.beta.size, turn(campaign, degrees))
    for count in range(SLIPS_AT + 1, SLIP_RUNS + 1):
        runs = RunSlopes(
            campaign.beta[:count],
            campaign.gamma[:count],
            alpha[:, :count],
            campaign.se[:, :count],
            campaign.gamma[:count] < 0,
            np.arange(count),
            {},
        )
        told_causes, _ = find_causes(JointModel(runs, without=campaign.without))
        if told_causes:
            by_turn = any(cause.cause.kind == "turn" for cause in told_causes)
            return {"degrees": degrees, "further": count - SLIPS_AT, "as a turn": by_turn}
    return {"degrees": degrees, "further": np.nan, "as a turn": False}


def print_slips(seed: int, campaigns: int) -> None:
    """Print after how many pushes a mount that slips is told."""
    jobs = [
        (seed, number, degrees) for degrees in (0.0, 5.0, 10.0, 20.0) for number in range(campaigns)
    ]
    with Pool() as pool:
        slips = pd.DataFrame(pool.map(judge_slip, jobs, chunksize=1))
    print(f"mount slips at push {SLIPS_AT} of {SLIP_RUNS}, of {campaigns} campaigns each:")
    for degrees, rows in slips.groupby("degrees"):
        pushes_until_told = rows["further"].dropna()
        middle = f", after {pushes_until_told.median():.0f} pushes (median), {pushes_until_told.max():.0f} at most"
        as_turn = int(rows["as a turn"].sum())
        print(
            f"{degrees:g} degrees: told in {pushes_until_told.size}, as a turn in {as_turn}{middle * bool(pushes_until_told.size)}"
        )


GRIDS: dict[str, list[tuple[float, float]]] = {
    "3 x 3": [(b, g) for b in (-30, 0, 30) for g in (30, 60, 90)],
    "4 x 3": [(b, g) for b in (-60, -30, 0, 30) for g in (30, 60, 90)],
    "5 x 2": [(b, g) for b in (-60, -30, 0, 30, 60) for g in (45, 90)],
}


def main() -> int:
    """Make and judge campaigns, and print tables; 1 where sound campaigns have too many false alarms."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--sound", type=int, default=200, help="sound campaigns")
    parser.add_argument("--each", type=int, default=30, help="campaigns of each fault and grid")
    parser.add_argument("--faults", nargs="*", default=[*FAULTS], choices=[*FAULTS])
    parser.add_argument("--directions", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--files", type=int, default=0, help="seeds of each fault through files")
    parser.add_argument("--slips", type=int, default=0, help="campaigns whose mount slips")
    parser.add_argument("--power", type=int, default=0, help="seeds of each size and design")
    chosen = parser.parse_args()
    if chosen.power:
        print_power(chosen.seed, chosen.power)
        return 0
    if chosen.slips:
        print_slips(chosen.seed, chosen.slips)
        return 0
    if chosen.files:
        jobs_of_files = [
            (chosen.seed, number, fault, medium)
            for number in range(chosen.files)
            for fault in (SOUND, *chosen.faults)
            for medium in FILE_MEDIA
        ]
        with Pool() as pool:
            files = pd.DataFrame(pool.map(judge_files, jobs_of_files, chunksize=1))
        files["by either"] = files["by its cause"] | files["printed beside"]
        columns = ["told", "by its cause", "by either", "inside"]
        counts_by_fault = files.groupby("fault", sort=False)[columns].sum()
        counts_by_fault["sized"] = files.groupby("fault", sort=False)["inside"].count()
        print(f"through files, of {chosen.files} seeds in each of {len(FILE_MEDIA)} media:")
        print(counts_by_fault.to_string())
        for row in files[~files["told"]].to_dict("records"):
            print(row["fault"], row["medium"], "not told:", row["another check"], row["words"])
        return 0
    with Pool() as pool:
        sound = pd.DataFrame(
            pool.map(judge_sound, [(chosen.seed, number) for number in range(chosen.sound)])
        )
        design = (chosen.directions, chosen.repeats)
        jobs = [
            (chosen.seed, number, fault, *design)
            for fault in chosen.faults
            for number in range(chosen.each)
        ]
        faults = pd.DataFrame(pool.map(judge_fault, jobs))
        if "inside" in faults:
            faults["inside"] = faults["inside"].astype(float)
        grids = [(chosen.seed, number, name) for name in GRIDS for number in range(chosen.each)]
        axes = pd.DataFrame(pool.map(judge_axes, grids))
    alarms = sound[["shared cause", "run apart", "axes"]].sum() if len(sound) else pd.Series()
    print(f"{len(sound)} sound campaigns, stated rate {FALSE_ALARMS:.0%}:", alarms.to_dict())
    if len(sound):
        print(sound.groupby("kind")[["shared cause", "run apart", "axes"]].sum().to_string())
        largest = sound["misplaced"].nlargest(3).round(1).tolist()
        print(f"log Bayes factors of runs in wrong rows or with other axes, the largest: {largest}")
        print(f"seconds: median {sound['seconds'].median():.2f}, most {sound['seconds'].max():.2f}")
        for what in sound.loc[sound["shared cause"], "what"]:
            print("  false alarm:", what)
    if len(faults):
        columns = [name for name in ("told", "by its cause", "inside") if name in faults]
        print(f"faults, {design[0]} directions x {design[1]}, of {chosen.each}:")
        shares = faults.groupby("fault", sort=False)[columns].sum(min_count=0)
        counts = faults.groupby("fault", sort=False)["inside"].count()
        print(shares.assign(sized=counts).to_string())
        print(f"least gain from one run on, median {faults['least gain'].median():.2f}")
    print(f"axes told, of {chosen.each}:")
    print(axes.groupby("grid", sort=False).sum().to_string())
    most = {"shared cause": 0.01, "run apart": 0.02, "axes": 0.0}
    return int(any(alarms[name] > share * len(sound) for name, share in most.items() if len(sound)))


if __name__ == "__main__":
    sys.exit(main())
