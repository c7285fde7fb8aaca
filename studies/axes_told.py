"""Verdicts on the axes of campaigns whose media made none of the known shapes: right axes, z or x reversed, and by a third of the runs.

    make axes                      40 media of each row
    make axes ARGS="--media 10"    fewer

Designs: the paper's grid (6 attack angles, 6 angles of pushes and of pulls, level pushes at three depths: 78 directions, 90
runs), 25 and 44 directions. Media: nine Fourier terms that are 10 % off the generic ones; the published tables, left out of
the known shapes; 3D-RFT with friction from 0.2 to 0.9. Each run has a bed of 5 % and noise of 1 % of the largest alpha. A row
with "x" or "pulls" multiplies these by a factor; with "wrong runs" a tenth of the runs has both signs reversed.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from multiprocessing import Pool
from typing import Any

import numpy as np
import pandas as pd
from shared_causes import GENERIC

from rftfit.checks.shared import CLEAR
from rftfit.compare.axes import axes_evidence
from rftfit.compare.joint import RunSlopes
from rftfit.measure.verdict_words import PULLS
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import GAMMA_DEG, MEDIA

Alpha = Callable[[np.ndarray, np.ndarray], Any]

BED, NOISE = 0.05, 0.01
WRONG_SHARE = 0.1
ANGLES_UP = GAMMA_DEG[GAMMA_DEG > 0]
REVERSED = {"z-reversed": (-1, 1), "x-reversed": (1, -1)}


def papers_grid() -> np.ndarray:
    """Beta and gamma of the runs of the paper's campaign in one medium, deg, shape (2, 90)."""
    beta = np.arange(-60.0, 91.0, 30.0)
    gamma = np.concatenate([-ANGLES_UP, ANGLES_UP, np.zeros(3)])
    return np.array([angles.ravel() for angles in np.meshgrid(beta, gamma)])


def drawn_directions(count: int, random: np.random.Generator) -> np.ndarray:
    """Random directions, deg, shape (2, count), two thirds of them pushed down; the first is straight down."""
    beta = np.round(random.uniform(-90, 90, count))
    gamma = np.round(random.uniform(0, 90, count)) * np.where(random.random(count) < 2 / 3, 1, -1)
    beta[0], gamma[0] = 0, 90
    return np.stack([beta, gamma])


def nine_terms(random: np.random.Generator) -> Alpha:
    """A medium of nine Fourier terms, each 10 % off the generic one."""
    a00, a10, b11, b01, bm11, c11, c01, cm11, d10 = np.array(GENERIC) * random.normal(1, 0.1, 9)

    def alpha(beta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
        z = a00 + a10 * np.cos(2 * beta) + b11 * np.sin(2 * beta + gamma)
        z = z + b01 * np.sin(gamma) + bm11 * np.sin(gamma - 2 * beta)
        x = c11 * np.cos(2 * beta + gamma) + c01 * np.cos(gamma)
        return np.stack([z, x + cm11 * np.cos(gamma - 2 * beta) + d10 * np.sin(2 * beta)])

    return alpha


def make_runs(row: str, number: int, seed: int) -> tuple[RunSlopes, tuple[str, ...]]:
    """Runs of one campaign, and the published media that the known shapes leave out."""
    random = np.random.default_rng([seed, number, zlib.crc32(row.encode())])
    design, kind, change = row.split(", ")
    directions_deg = papers_grid()
    if design != "paper's grid":
        directions_deg = drawn_directions(int(design.split()[0]), random)
    without: tuple[str, ...] = ()
    if kind == "published":
        without = (MEDIA[number % len(MEDIA)],)
        medium: Alpha = TableProfile.published(without[0]).alpha
    elif kind == "3D-RFT":
        medium = partial(alpha_3drft, friction=random.uniform(0.2, 0.9))
    else:
        medium = nine_terms(random)
    beta_deg, gamma_deg = directions_deg
    alpha = np.stack(medium(*np.radians(directions_deg)))
    if change == "x free":
        alpha[1] *= np.exp(random.normal(0, 0.4))
    elif change not in {"as it is", "wrong runs"}:
        what, factor = change.split(" x ")
        alpha *= np.where([[False], [True]] if what == "x" else gamma_deg < 0, float(factor), 1.0)
    count = beta_deg.size
    alpha = alpha * random.normal(1, BED, count)
    noise = NOISE * np.abs(alpha).max()
    alpha = alpha + noise * random.standard_normal(alpha.shape)
    if change == "wrong runs":
        alpha[:, random.choice(count, round(WRONG_SHARE * count), replace=False)] *= -1
    se = np.full_like(alpha, noise)
    return RunSlopes(beta_deg, gamma_deg, alpha, se, gamma_deg < 0, np.arange(count)), without


def part_of(runs: RunSlopes, is_taken: np.ndarray) -> RunSlopes:
    """Some of the runs."""
    names = ("beta_deg", "gamma_deg", "mirrored", "order")
    of_runs = {name: getattr(runs, name)[is_taken] for name in names}
    return RunSlopes(alpha=runs.alpha[:, is_taken], se=runs.se[:, is_taken], **of_runs)


def best_rival(evidence: dict[str, float]) -> float:
    """Largest logarithm of the Bayes factor of other axes against the given ones."""
    return max(value for name, value in evidence.items() if name not in ("as-given", PULLS))


def told_of_pulls(runs: RunSlopes, without: tuple[str, ...]) -> str:
    """What is said of the sign of beta in pulls."""
    evidence = axes_evidence(runs, without).get(PULLS, 0.0)
    return "wrong" if evidence > CLEAR else "right" if evidence < -CLEAR else "open"


def judge(job: tuple[str, int, int]) -> dict[str, object]:
    """Verdict on the right axes, whether reversed ones are told, and the evidence by all runs less that by the best third."""
    row, number, seed = job
    runs, without = make_runs(row, number, seed)
    rival = best_rival(axes_evidence(runs, without))
    verdict = "unusable" if rival > CLEAR else "open" if rival > -CLEAR else "passed"
    answer: dict[str, object] = {"row": row, "verdict": verdict}
    for axes, signs in REVERSED.items():
        reversed_runs = RunSlopes(
            runs.beta_deg,
            runs.gamma_deg,
            runs.alpha * np.array(signs)[:, None],
            runs.se,
            runs.mirrored,
            runs.order,
        )
        evidence = axes_evidence(reversed_runs, without)
        best = max(evidence, key=lambda name: evidence[name])
        answer[axes] = best == axes and evidence[best] > CLEAR
    with_wrong_pulls = replace(
        runs, beta_deg=np.where(runs.gamma_deg < 0, -runs.beta_deg, runs.beta_deg)
    )
    answer["pulls"] = told_of_pulls(runs, without)
    answer["pulls reversed"] = told_of_pulls(with_wrong_pulls, without)
    place = np.arange(runs.beta_deg.size)
    thirds = [part_of(runs, place % 3 == third) for third in range(3)]
    best_third = min(best_rival(axes_evidence(third, without)) for third in thirds)
    answer["not below a third"] = rival <= best_third + 0.5
    return answer


ROWS = (
    "paper's grid, nine terms, as it is",
    "25 directions, nine terms, as it is",
    "44 directions, nine terms, as it is",
    "paper's grid, published, as it is",
    "25 directions, published, as it is",
    "paper's grid, 3D-RFT, as it is",
    "paper's grid, nine terms, x free",
    "25 directions, nine terms, x free",
    "44 directions, nine terms, x free",
    "paper's grid, nine terms, x x 0.5",
    "paper's grid, nine terms, x x 2",
    "paper's grid, nine terms, pulls x 0.5",
    "paper's grid, nine terms, pulls x 2",
    "paper's grid, nine terms, wrong runs",
    "25 directions, nine terms, wrong runs",
)


def main() -> None:
    """Print one line a row."""
    parser = argparse.ArgumentParser(prog="make axes", description=__doc__)
    parser.add_argument("--media", type=int, default=40, help="of each row")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    jobs = [(row, number, options.seed) for row in ROWS for number in range(options.media)]
    with Pool() as pool:
        answers = pd.DataFrame(pool.map(judge, jobs, chunksize=4))
    table = pd.crosstab(answers["row"], answers["verdict"]).reindex(ROWS)
    table = table.reindex(columns=["passed", "open", "unusable"], fill_value=0)
    told = answers.groupby("row")[[*REVERSED, "not below a third"]].sum().reindex(ROWS)
    print(pd.concat([table, told], axis=1).to_string())
    print("\nSign of beta in pulls, as it is and reversed")
    pulls = pd.concat(
        [pd.crosstab(answers["row"], answers[name]) for name in ("pulls", "pulls reversed")],
        axis=1,
        keys=["as it is", "reversed"],
    )
    print(pulls.reindex(ROWS).to_string())


if __name__ == "__main__":
    main()
