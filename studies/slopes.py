"""Two runs of a direction that no model of the program made: wrong runs beside their repeat.

    make pairs

Media: the published tables, 3D-RFT, and nine Fourier terms off the generic ones. Each run has a bed of its own and noise.
"""

from __future__ import annotations

import sys
import zlib
from itertools import product
from types import SimpleNamespace

import frame
import numpy as np
import pandas as pd
from frame import Part, Row, Tables

from rftfit.checks.declared import MediumMeasurements
from rftfit.checks.runs import check_repeats
from rftfit.compare.peers import compare_runs
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import column
from rftfit.measure.verdict_words import FAILED, PAIR, PASSED
from rftfit.model.profiles import FourierProfile, TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import MEDIA

Random = np.random.Generator

GENERIC = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)
"""Nine terms of the generic profile, in the order of `FourierProfile`."""


def drawn_directions(count: int, random: Random) -> np.ndarray:
    """Random directions, deg, shape (2, count), two thirds of them pushed down; the first is straight down."""
    beta = np.round(random.uniform(-90, 90, count))
    gamma = np.round(random.uniform(0, 90, count)) * np.where(random.random(count) < 2 / 3, 1, -1)
    beta[0], gamma[0] = 0, 90
    return np.stack([beta, gamma])


def tabulate_fits(
    names: list[str],
    beta_deg: np.ndarray,
    gamma_deg: np.ndarray,
    alpha: np.ndarray,
    se: np.ndarray | float,
) -> pd.DataFrame:
    """Table of fits as the stages make it; alpha and its error of shape (2, runs)."""
    fits = pd.DataFrame({"run_id": names, "beta_deg": beta_deg, "gamma_deg": gamma_deg})
    for component, of_runs, errors in zip(
        "zx", alpha, np.broadcast_to(se, alpha.shape), strict=True
    ):
        fits[column(component)] = of_runs
        fits[column(component, "_se")] = errors
    return fits.assign(depth_from_cm=np.nan)


DIRECTIONS, PAIR_NOISE, WET = 20, 0.003, 1.5
BEDS = ("3 % normal", "5 % normal", "8 % normal", "3 % t5", "5 % t5")
PAIR_FAULTS = (
    "none",
    "one filed elsewhere",
    "two exchanged",
    "wet in 4 of 40",
    "middle third x 1.3",
)
OFF = 0.2
"""Error of a cell, relative to its alpha, that must not pass in silence."""


def draw_beds(name: str, count: int, random: Random) -> np.ndarray:
    """Factors of beds, shape (count,), whose standard deviation is as named."""
    size, kind = float(name.split(maxsplit=1)[0]) / 100, name.split()[2]
    normals = random.standard_normal(count)
    return 1 + size * (random.standard_t(5, count) / np.sqrt(5 / 3) if kind == "t5" else normals)


def true_alpha(number: int, directions_deg: np.ndarray, random: Random) -> np.ndarray:
    """Alpha of the directions, z and x, of one of seven kinds of media."""
    angles = np.radians(directions_deg)
    kind = number % 7
    if kind < len(MEDIA):
        return np.stack(TableProfile.published(MEDIA[kind]).alpha(*angles))
    if kind == len(MEDIA):
        return np.stack(alpha_3drft(angles[0], angles[1], random.uniform(0.2, 0.9)))
    nine_terms = np.array(GENERIC) * random.normal(1, 0.1, 9)
    return np.stack(FourierProfile(nine_terms).alpha(*angles))


def as_measured(fits: pd.DataFrame, peers: pd.DataFrame) -> MediumMeasurements:
    """What the check of repeats reads, of slopes without logs."""
    config = SimpleNamespace(grid=SimpleNamespace(angle_tolerance_deg=TOLERANCE_DEG))
    sheet = {
        run_id: SimpleNamespace(run_id=run_id, row=row, kind="plate")
        for row, run_id in enumerate(fits["run_id"])
    }
    tables = {"fits": fits, "peers": peers}
    return MediumMeasurements(config, SimpleNamespace(), sheet, tables, {})  # type: ignore[arg-type]


def put_pair_fault(
    fault: str, sizes: np.ndarray, random: Random
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direction whose alpha each run has, its factor, and the wrong runs; sizes of alpha by run."""
    count = sizes.size
    filed, factor = np.arange(count), np.ones(count)
    wrong = np.zeros(0, dtype=int)
    strong = np.flatnonzero(sizes > 0.3 * sizes.max())
    if fault == "one filed elsewhere":
        wrong = random.choice(strong, 1)
        filed[wrong] = random.choice(np.setdiff1d(strong % DIRECTIONS, wrong % DIRECTIONS))
    elif fault == "two exchanged":
        wrong = random.choice(strong[strong < DIRECTIONS], 2, replace=False)
        filed[wrong] = wrong[::-1]
    elif fault == "wet in 4 of 40":
        wrong = random.choice(count, 4, replace=False)
        factor[wrong] = WET
    elif fault == "middle third x 1.3":
        wrong = np.flatnonzero(np.abs(random.permutation(count) - count / 2) < count / 6)
        factor[wrong] = 1.3
    return filed, factor, wrong


def grade_pairs(fault: str, beds: str, number: int, seed: int) -> list[Row]:
    """Whether a campaign passes, its wrong runs are told and named first, and it is silent over a wrong cell."""
    random = np.random.default_rng([seed, number, zlib.crc32(f"{beds} {fault}".encode())])
    directions_deg = drawn_directions(DIRECTIONS, random)
    truth = np.tile(true_alpha(number, directions_deg, random), 2)
    sizes = np.hypot(*truth)
    filed, factor, wrong = put_pair_fault(fault, sizes, random)
    alpha = truth[:, filed] * factor * draw_beds(beds, sizes.size, random)
    noise = PAIR_NOISE * np.abs(alpha).max()
    alpha = alpha + noise * random.standard_normal(alpha.shape)
    names = [f"r{run}" for run in range(sizes.size)]
    beta_deg, gamma_deg = np.tile(directions_deg, 2)
    fits = tabulate_fits(names, beta_deg, gamma_deg, alpha, noise)
    peers = compare_runs(fits, "medium")
    apart = peers["apart"].to_numpy(bool)
    check = check_repeats(as_measured(fits, peers))
    means = alpha.reshape(2, 2, DIRECTIONS).mean(axis=1)
    off = np.hypot(*(means - truth[:, :DIRECTIONS])) / sizes[:DIRECTIONS]
    cells_off = (off > OFF) & (sizes[:DIRECTIONS] > 0.3 * sizes.max())
    is_told_cell = apart.reshape(2, DIRECTIONS).any(axis=0)
    failed = check.verdict == FAILED
    told = failed and (check.code == "repeats-wide" or bool(apart[wrong].any()))
    answer: Row = {
        "fault": fault,
        "beds": beds,
        "passed": float(check.verdict == PASSED),
        "failed": float(failed),
        "told": float(told) if wrong.size else np.nan,
        "silent over": float(cells_off.any() and not failed),
        "unnamed": float((cells_off & ~is_told_cell).any()),
        "named first": np.nan,
    }
    pairs = peers[(peers["beside"] == PAIR) & apart]
    if fault == "one filed elsewhere" and apart[wrong].any() and len(pairs):
        distance = np.hypot(pairs["off_z_ratio"].to_numpy(), pairs["off_x_ratio"].to_numpy())
        answer["named first"] = float(pairs.index[distance.argmax()] == wrong[0])
    return [answer]


def report_pairs(rows: pd.DataFrame) -> Tables:
    """Percent of the campaigns, by fault and beds."""
    columns = ["passed", "failed", "told", "silent over", "unnamed", "named first"]
    table = 100 * rows.groupby(["fault", "beds"], sort=False)[columns].mean()
    return [("Two runs of a direction, %", table.round(0).reset_index())]


PARTS = {
    "pairs": Part(
        lambda count, seed: [
            (fault, beds, number, seed)
            for fault, beds, number in product(PAIR_FAULTS, BEDS, range(count))
        ],
        grade_pairs,
        report_pairs,
        100,
    )
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
