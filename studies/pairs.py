"""What two runs of each direction tell: sound campaigns that pass `repeats`, and wrong runs that are told and named first.

    make pairs                      100 campaigns of each row
    make pairs ARGS="--media 20"    fewer

20 directions twice, in random order; the published media in turn, 3D-RFT and nine Fourier terms. Beds differ by 3, 5 and 8 %,
normally or by Student's t with 5 degrees of freedom; noise is 0.3 % of the largest alpha. A run filed elsewhere has the alpha
of another direction, two exchanged runs have each other's, wet runs are 1.5 times as strong. "silent over": campaigns that do not fail and have a
cell that is off by more than 20 %; "unnamed": campaigns with such a cell whose runs are not named.
"""

from __future__ import annotations

import argparse
import zlib
from itertools import product
from multiprocessing import Pool
from types import SimpleNamespace

import numpy as np
import pandas as pd
from axes_told import drawn_directions, nine_terms

from rftfit.checks.declared import MediumMeasurements
from rftfit.checks.runs import check_repeats
from rftfit.compare.peers import compare_runs
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import column
from rftfit.measure.verdict_words import FAILED, PAIR, PASSED
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import MEDIA

DIRECTIONS, NOISE, WET = 20, 0.003, 1.5
BEDS = ("3 % normal", "5 % normal", "8 % normal", "3 % t5", "5 % t5")
FAULTS = ("none", "one filed elsewhere", "two exchanged", "wet in 4 of 40", "middle third x 1.3")
OFF = 0.2
"""Error of a cell, relative to its alpha, that must not pass in silence."""


def draw_beds(name: str, count: int, random: np.random.Generator) -> np.ndarray:
    """Factors of beds, shape (count,), whose standard deviation is as named."""
    size, kind = float(name.split(maxsplit=1)[0]) / 100, name.split()[2]
    normals = random.standard_normal(count)
    return 1 + size * (random.standard_t(5, count) / np.sqrt(5 / 3) if kind == "t5" else normals)


def true_alpha(number: int, directions_deg: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Alpha of the directions, z and x, of one of seven kinds of media."""
    angles = np.radians(directions_deg)
    kind = number % 7
    if kind < len(MEDIA):
        return np.stack(TableProfile.published(MEDIA[kind]).alpha(*angles))
    if kind == len(MEDIA):
        return np.stack(alpha_3drft(angles[0], angles[1], random.uniform(0.2, 0.9)))
    return np.stack(nine_terms(random)(*angles))


def as_measured(fits: pd.DataFrame, peers: pd.DataFrame) -> MediumMeasurements:
    """What the check of repeats reads, of slopes without logs."""
    config = SimpleNamespace(grid=SimpleNamespace(angle_tolerance_deg=TOLERANCE_DEG))
    sheet = {
        run_id: SimpleNamespace(run_id=run_id, row=row, kind="plate")
        for row, run_id in enumerate(fits["run_id"])
    }
    tables = {"fits": fits, "peers": peers}
    return MediumMeasurements(config, SimpleNamespace(), sheet, tables, {})  # type: ignore[arg-type]


def judge(job: tuple[str, str, int, int]) -> dict[str, object]:
    """Whether a campaign passes, whether its wrong runs are told and named first, and whether it is silent over a wrong cell."""
    beds, fault, number, seed = job
    random = np.random.default_rng([seed, number, zlib.crc32(f"{beds} {fault}".encode())])
    directions_deg = drawn_directions(DIRECTIONS, random)
    truth = np.tile(true_alpha(number, directions_deg, random), 2)
    count = 2 * DIRECTIONS
    filed = np.arange(count)
    factor = np.ones(count)
    sizes = np.hypot(*truth)
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
    else:
        wrong = np.zeros(0, dtype=int)
    alpha = truth[:, filed] * factor * draw_beds(beds, count, random)
    noise = NOISE * np.abs(alpha).max()
    alpha = alpha + noise * random.standard_normal(alpha.shape)
    beta_deg, gamma_deg = np.tile(directions_deg, 2)
    fits = pd.DataFrame({"beta_deg": beta_deg, "gamma_deg": gamma_deg, "depth_from_cm": np.nan})
    fits["run_id"] = [f"r{run}" for run in range(count)]
    for component, of_runs in zip("zx", alpha, strict=True):
        fits[column(component)], fits[column(component, "_se")] = of_runs, noise
    peers = compare_runs(fits, "medium")
    apart = peers["apart"].to_numpy(bool)
    check = check_repeats(as_measured(fits, peers))
    means = alpha.reshape(2, 2, DIRECTIONS).mean(axis=1)
    off = np.hypot(*(means - truth[:, :DIRECTIONS])) / sizes[:DIRECTIONS]
    cells_off = (off > OFF) & (sizes[:DIRECTIONS] > 0.3 * sizes.max())
    is_told_cell = apart.reshape(2, DIRECTIONS).any(axis=0)
    failed = check.verdict == FAILED
    answer: dict[str, object] = {"beds": beds, "fault": fault, "failed": failed}
    answer["passed"] = check.verdict == PASSED
    answer["silent over"] = bool(cells_off.any() and not failed)
    answer["unnamed"] = bool((cells_off & ~is_told_cell).any())
    answer["told"] = (
        failed and (check.code == "repeats-wide" or bool(apart[wrong].any()))
        if wrong.size
        else np.nan
    )
    pairs = peers[(peers["beside"] == PAIR) & apart]
    if fault == "one filed elsewhere" and apart[wrong].any() and len(pairs):
        distance = np.hypot(pairs["off_z_ratio"].to_numpy(), pairs["off_x_ratio"].to_numpy())
        answer["named first"] = int(pairs.index[distance.argmax()]) == wrong[0]
    return answer


def main() -> None:
    """Print one line of each kind of beds and faults."""
    parser = argparse.ArgumentParser(prog="make pairs", description=__doc__)
    parser.add_argument("--media", type=int, default=100, help="campaigns of each row")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    jobs = [
        (beds, fault, number, options.seed)
        for fault, beds, number in product(FAULTS, BEDS, range(options.media))
    ]
    with Pool() as pool:
        answers = pd.DataFrame(pool.map(judge, jobs, chunksize=4))
    columns = ["passed", "failed", "told", "silent over", "unnamed", "named first"]
    numbers = answers[columns].apply(pd.to_numeric).groupby([answers["fault"], answers["beds"]])
    print((100 * numbers.mean()).round(0).reindex(product(FAULTS, BEDS)).to_string())


if __name__ == "__main__":
    main()
