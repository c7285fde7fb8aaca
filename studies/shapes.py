"""How well a few pushes tell a whole medium: the published media, left out one by one and by material.

    python studies/shapes.py             the tables of docs/theory/map.md, five minutes
    python studies/shapes.py --choose 600    look ten minutes for a better variation, and print it

A medium is estimated from pushes that `rftfit.plan` chose, with mean and covariance made without it, and
without its material: both poppy seeds, or all glass. The variation in `reference/shapes.toml` was found by
``--choose``: least mean interval score (Gneiting & Raftery 2007) over both cases and 1 to 30 pushes; then
`floor` and `share` were raised together until 95 % intervals held in 90 % with the material left out.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import TYPE_CHECKING

import numpy as np

import rftfit
from rftfit.model.fourier import evaluate, fit_lsq
from rftfit.model.planning import blank
from rftfit.model.prediction import find_peaks
from rftfit.model.profiles import TableProfile
from rftfit.model.scaling import generic, vertical_penetration
from rftfit.model.shapes import Pushes, Shapes, Variation, estimate, grid, published_shapes
from rftfit.reference import LEGS, MEDIA, SANDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rftfit.conventions import FloatArray
    from rftfit.model.shapes import Map

COUNTS = (1, 2, 4, 6, 8, 12, 16, 30, 78)
MATERIALS = {name: tuple(m for m in MEDIA if m[:5] == name[:5]) for name in MEDIA}
SE = 0.005  # N/cm^3, run to run, as the paper states
NODES = grid()
BETA_DEG, GAMMA_DEG = np.degrees(NODES)


def truth(medium: str) -> FloatArray:
    """Table S5 of a medium at the nodes, shape (2, n)."""
    return np.stack(TableProfile.published(medium).alpha(*NODES))


def cases(variation: Variation | None = None) -> Iterator[tuple[str, str, Shapes]]:
    """Each medium with what is known without it, and without its material."""
    for case in ("medium", "material"):
        for medium in MEDIA:
            left_out = (medium,) if case == "medium" else MATERIALS[medium]
            shapes = published_shapes(without=left_out)
            yield case, medium, Shapes(shapes.profiles, variation) if variation else shapes


def pushed(alpha: FloatArray, places: list[int]) -> Pushes:
    """Pushes at nodes, without noise of our own: the table has its."""
    return Pushes.of(BETA_DEG[places], GAMMA_DEG[places], alpha[:, places], SE)


def chosen(shapes: Shapes, count: int) -> list[int]:
    """Nodes that `rftfit.plan` would push, the level plate straight down first."""
    first = int(np.flatnonzero((BETA_DEG.round() == 0) & (GAMMA_DEG.round() == 90))[0])
    start = blank(shapes)
    known = estimate(Pushes.of([0], [90], start.alpha[:, [first]], 0.03), shapes)
    rig = rftfit.Rig(error_percent=2.0)
    steps = rftfit.plan("map", known, rig, count - 1).steps[1:]
    own = list(zip(BETA_DEG.round(3), GAMMA_DEG.round(3), strict=True))
    found = [own.index((round(b, 3), round(g, 3))) for s in steps for b, g in s.directions]
    return list(dict.fromkeys([first, *found]))


def score(found: Map, alpha: FloatArray) -> tuple[float, float, float, float]:
    """Error (rms), coverage, mean interval score and half width (rms), of alpha; % of the largest, and %."""
    table = found.table()
    lo, hi = (table[[f"alpha_{c}_{e}_N_per_cm3" for c in "zx"]].to_numpy().T for e in ("lo", "hi"))
    free = hi - lo > 1e-9
    inside = (lo <= alpha) & (alpha <= hi)
    miss = np.maximum(lo - alpha, 0) + np.maximum(alpha - hi, 0)
    largest = np.abs(alpha).max() / 100
    return (
        float(np.sqrt(np.mean((found.alpha - alpha) ** 2)) / largest),
        100 * float(inside[free].mean()),
        float((hi - lo + 40 * miss)[free].mean() / largest),
        float(np.sqrt(np.mean((hi - lo)[free] ** 2)) / 2 / largest),
    )


def legs(found: Map, alpha: FloatArray) -> list[tuple[float, bool, float]]:
    """Error of each leg's largest lift and thrust, %, whether the interval holds it, its half width, %."""
    rows = []
    true = TableProfile(alpha[0], alpha[1], *NODES)
    for name in LEGS:
        leg = rftfit.model_leg(name)
        best = {p.name: p.value for p in find_peaks(rftfit.predict(true, leg))}
        for peak in find_peaks(rftfit.predict(found.profile, leg)):
            if peak.name in ("lift", "thrust"):
                there = best[peak.name]
                half = 50 * (peak.hi - peak.lo) / abs(there)
                rows.append((100 * (peak.value / there - 1), peak.lo <= there <= peak.hi, half))
    return rows


def few_pushes() -> None:
    """Print errors, coverage and widths over the number of pushes, beside what else there is."""
    rows: dict[tuple[str, int], list[tuple[float, ...]]] = {}
    beside: dict[str, list[tuple[float, float, float]]] = {}
    for case, medium, shapes in cases():
        alpha, places = truth(medium), chosen(shapes, max(COUNTS))
        for count in COUNTS:
            found = estimate(pushed(alpha, places[:count]), shapes)
            peaks = legs(found, alpha)
            rows.setdefault((case, count), []).append(
                (*score(found, alpha), *(float(np.mean([abs(p[i]) for p in peaks])) for i in range(3)))
            )
        beside.setdefault(case, []).append(others(alpha, shapes))
    for case in ("medium", "material"):
        print(f"\none {case} left out: mean over the five media\n")
        print("| pushes | rms error % | coverage % (least) | half width % | peaks: error % | coverage % | half width % |")
        print("|---|---|---|---|---|---|---|")
        for count in COUNTS:
            own = np.array(rows[case, count])
            mean = own.mean(axis=0)
            print(
                f"| {count} | {mean[0]:.1f} | {mean[1]:.0f} ({own[:, 1].min():.0f}) | {mean[3]:.1f} | {mean[4]:.0f} | "
                f"{100 * mean[5]:.0f} | {mean[6]:.0f} |"
            )
        names = ("nine terms, all 78", "generic nine terms, one push", "mean shape scaled, one push")
        told = np.mean(beside[case], axis=0)
        print("; ".join(f"{name}: {value:.1f} %" for name, value in zip(names, told, strict=True)))


def others(alpha: FloatArray, shapes: Shapes) -> tuple[float, float, float]:
    """rms error, % of the largest alpha, of nine terms, of generic nine terms and of the mean shape."""
    down = int(np.flatnonzero((BETA_DEG.round() == 0) & (GAMMA_DEG.round() == 90))[0])
    own = np.stack(evaluate(fit_lsq(*NODES, *alpha), *NODES))
    known = [np.stack(p.alpha(*NODES)) for p in shapes.profiles.values()]
    fits = np.stack([fit_lsq(*NODES, *one) for one in known])
    chi = np.mean([one[0, down] / vertical_penetration(fit) for one, fit in zip(known, fits, strict=True)])
    paper = alpha[0, down] / chi * np.stack(evaluate(generic(fits), *NODES))
    mean = shapes.moments(*NODES)[0].reshape(2, -1)
    scaled = mean * alpha[0, down] / mean[0, down]
    largest = np.abs(alpha).max() / 100
    errors = [np.sqrt(np.mean((one - alpha) ** 2)) / largest for one in (own, paper, scaled)]
    return float(errors[0]), float(errors[1]), float(errors[2])


def choose(seconds: float) -> None:
    """Search at random around the best variation so far."""
    random, end = np.random.default_rng(2013), time.monotonic() + seconds
    best = published_shapes().variation
    least = np.inf
    trial = best
    while time.monotonic() < end:
        found = interval_score(trial)
        if found < least:
            least, best = found, trial
            print(f"{least:.4f}", best, flush=True)
        moved = np.array(best) * np.exp(0.15 * random.standard_normal(len(best)))
        trial = Variation(*moved)._replace(smooth=min(moved[2], 1.0))


def interval_score(variation: Variation) -> float:
    """Mean logarithm of the interval score over cases and counts."""
    scores = []
    for _, medium, shapes in cases(variation):
        alpha, places = truth(medium), chosen(shapes, 30)
        for count in (1, 2, 4, 6, 12, 30):
            scores.append(np.log(score(estimate(pushed(alpha, places[:count]), shapes), alpha)[2]))
    return float(np.mean(scores))


def main() -> int:
    """Print the tables, or search."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--choose", type=float, metavar="SECONDS")
    options = parser.parse_args()
    if options.choose:
        choose(options.choose)
        return 0
    few_pushes()
    return 0


if __name__ == "__main__":
    sys.exit(main())
