"""How often `rftfit compare` tells two sessions, two sizes and two shapes apart.

    make compare    100 pairs of several designs

The runs do not come from the program's own models:
alpha of a published table, beds looser or denser by 5 % as a whole, patches of 3 % in each component, a free surface
that is off by 0.5 mm from run to run and by 0.5 mm in a session, and noise.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from frame import Part, Row, Tables

from rftfit import reference
from rftfit.compare.contrast import Comparison, RunSet, compare_run_sets

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

SURFACE_CM, NOISE = 0.05, 0.003
"""Error of the free surface, of a run and of a session; noise of alpha, relative to its largest."""

DEPTHS_CM = (3.0, 7.0)
"""Depths that runs reach, by direction: the deeper, the less the surface matters."""

SIZE, SHAPE = 0.08, 0.10
"""Differences of size and of shape (rms) that the study makes."""

DESIGNS = (
    (20, 3, 0.05, 0.03),
    (20, 1, 0.05, 0.03),
    (8, 3, 0.05, 0.03),
    (8, 1, 0.05, 0.03),
    (20, 3, 0.03, 0.02),
    (20, 1, 0.03, 0.02),
    (20, 3, 0.08, 0.05),
    (20, 1, 0.08, 0.05),
)
"""Directions and repeats on each side, scatter of beds and of patches."""


@dataclass(frozen=True)
class Beds:
    """Scatter of single runs: of a bed as a whole, and of its patches."""

    bed: float = 0.05
    patches: float = 0.03


def published(medium: str) -> FloatArray:
    """Angles and alpha of a published table: beta, gamma, z, x; shape (4, 78), each plate once."""
    z, x = reference.alpha_grid(medium)
    beta, gamma = np.meshgrid(reference.BETA_DEG, reference.GAMMA_DEG, indexing="ij")
    table = np.stack([beta, gamma, z, x])[:, 1:]
    return table.reshape(4, -1)


def runs_of(
    truth: FloatArray, depth: FloatArray, repeats: int, rng: np.random.Generator, beds: Beds
) -> pd.DataFrame:
    """Fits of a session: each direction of `truth` (beta, gamma, z, x) pushed several times."""
    session = rng.normal(0, SURFACE_CM)
    beta, gamma, z, x = np.repeat(truth, repeats, axis=1)
    lever = np.repeat(np.where(truth[1] == 0, 1.0, 1.5) / depth, repeats)
    n = beta.size
    bed = 1 + rng.normal(0, beds.bed, n)
    surface = 1 + lever * (session + rng.normal(0, SURFACE_CM, n))
    noise = NOISE * float(np.hypot(truth[2], truth[3]).max())
    length = np.hypot(z, x)
    columns = {
        "run_id": [f"r{place}" for place in range(n)],
        "beta_deg": beta,
        "gamma_deg": gamma,
        "lever_per_cm": lever,
    }
    for name, alpha in (("z", z), ("x", x)):
        patches = rng.normal(0, beds.patches, n) * length
        columns[f"alpha_{name}_N_per_cm3"] = (alpha + patches) * bed * surface + rng.normal(
            0, noise, n
        )
        columns[f"alpha_{name}_se_N_per_cm3"] = noise
    return pd.DataFrame(columns)


def other_shape(truth: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    """The same directions, with alpha of the same size and another shape: `size` is the rms of the difference."""
    alpha = truth[2:]
    # half of them as another medium differs, half by chance in each direction
    change = rng.standard_normal(alpha.shape) * np.hypot(*alpha)
    if rng.random() < 0.5:
        grid = published(str(rng.choice(reference.MEDIA)))
        places = [
            int(np.hypot(grid[0] - beta, grid[1] - gamma).argmin()) for beta, gamma in truth[:2].T
        ]
        change = grid[2:, places]
    change = change - alpha * (change * alpha).sum() / (alpha**2).sum()
    length = float(np.sqrt((change**2).sum()))
    if length < 1e-9:  # it was the same medium
        return other_shape(truth, size, rng)
    return np.vstack([truth[:2], alpha + change * size * np.sqrt((alpha**2).sum()) / length])


def compare_pair(
    seed: int,
    design: tuple[int, int],
    ratio: float = 1.0,
    shape: float = 0.0,
    beds: Beds | None = None,
    of_b: tuple[int, Beds] | None = None,
) -> Comparison:
    """Compare two sessions of one published medium; B is `ratio` times as strong and of another `shape`.

    `of_b`: Repeats and beds of B, where they are not those of A.
    """
    rng = np.random.default_rng(seed)
    count, repeats = design
    published_alpha = published(str(rng.choice(reference.MEDIA)))
    truth = published_alpha[:, rng.permutation(published_alpha.shape[1])[:count]]
    depth = rng.uniform(*DEPTHS_CM, count)
    truth_b = other_shape(truth, shape, rng) if shape else truth.copy()
    truth_b = np.vstack([truth_b[:2], ratio * truth_b[2:]])
    of_a = repeats, beds or Beds()
    runs_a, runs_b = (
        RunSet(name, runs_of(alpha, depth, often, rng, scatter), SURFACE_CM)
        for name, alpha, (often, scatter) in (("A", truth, of_a), ("B", truth_b, of_b or of_a))
    )
    return compare_run_sets(runs_a, runs_b)


def grade(pairs: int, design: tuple[int, int], beds: Beds | None = None) -> dict[str, float]:
    """Shares, in percent, of pairs by what the comparison says of them."""
    same_pairs = [compare_pair(seed, design, beds=beds) for seed in range(pairs)]
    larger = [compare_pair(seed, design, 1 + SIZE, beds=beds) for seed in range(pairs)]
    formed = [compare_pair(seed, design, 1.0, SHAPE, beds=beds) for seed in range(pairs)]
    covered = [(comparison.ratio_lo <= 1 <= comparison.ratio_hi) for comparison in same_pairs]
    covered_larger = [
        (comparison.ratio_lo <= 1 + SIZE <= comparison.ratio_hi) for comparison in larger
    ]
    holds = [
        comparison.shape_lo_percent <= 100 * SHAPE <= comparison.shape_hi_percent
        for comparison in formed
    ]
    return {
        "size, false": percent(comparison.size_p < 0.05 for comparison in same_pairs),
        "shape, false": percent(comparison.shape_p < 0.05 for comparison in same_pairs),
        "ratio covered": percent([*covered, *covered_larger]),
        "8 % of size": percent(comparison.size_p < 0.05 for comparison in larger),
        "10 % of shape": percent(comparison.shape_p < 0.05 for comparison in formed),
        "shape covered": percent(holds),
        "least ratio": float(np.median([comparison.least_ratio for comparison in same_pairs])),
        "least shape": float(
            np.median([comparison.least_shape_percent for comparison in same_pairs])
        ),
    }


def grade_design(count: int, repeats: int, bed: float, patches: float, pairs: int) -> list[Row]:
    """Shares of one design."""
    design: Row = {"directions": count, "repeats": repeats, "bed": bed, "patches": patches}
    return [design | grade(pairs, (count, repeats), Beds(bed, patches))]


def grade_unequal(often: int, pairs: int) -> list[Row]:
    """Shares, in percent, of pairs of one medium whose B scatters three times as much and has fewer repeats."""
    of_b = often, Beds(0.10, 0.06)
    same_pairs = [
        compare_pair(seed, (20, 3), beds=Beds(0.03, 0.02), of_b=of_b) for seed in range(pairs)
    ]
    return [
        {
            "repeats of B": often,
            "size, false": percent(pair.size_p < 0.05 for pair in same_pairs),
            "shape, false": percent(pair.shape_p < 0.05 for pair in same_pairs),
            "ratio covered": percent(pair.ratio_lo <= 1 <= pair.ratio_hi for pair in same_pairs),
        }
    ]


def percent(true: object) -> float:
    """Share of what is true."""
    return 100 * float(np.mean(list(true)))  # type: ignore[call-overload]


def compare_published(repeats: int = 3, seed: int = 0) -> pd.DataFrame:
    """Compare each pair of published media, 20 directions each."""
    rng = np.random.default_rng(seed)
    places = rng.permutation(published(reference.MEDIA[0]).shape[1])[:20]
    depth = rng.uniform(*DEPTHS_CM, places.size)
    sets = {
        medium: RunSet(
            medium, runs_of(published(medium)[:, places], depth, repeats, rng, Beds()), SURFACE_CM
        )
        for medium in reference.MEDIA
    }
    rows = []
    for a, b in combinations(sets, 2):
        comparison = compare_run_sets(sets[a], sets[b])
        rows.append(
            (
                a,
                b,
                comparison.ratio,
                comparison.size_p,
                comparison.shape_percent,
                comparison.shape_p,
            )
        )
    return pd.DataFrame(rows, columns=["a", "b", "ratio", "size_p", "shape_percent", "shape_p"])


def grade_published(repeats: int, seed: int) -> list[Row]:
    """Comparison of each pair of published media."""
    table = compare_published(repeats, seed)
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def report(rows: pd.DataFrame) -> Tables:
    """The rows as they are."""
    return [
        ("Pairs of sessions of one published medium; shares in percent", rows.drop(columns="unit"))
    ]


PARTS = {
    "designs": Part(
        lambda count, _seed: [(*design, count) for design in DESIGNS], grade_design, report, 100
    ),
    "unequal": Part(
        lambda count, _seed: [(often, count) for often in (1, 2, 3)], grade_unequal, report, 100
    ),
    "published": Part(
        lambda count, seed: [(count, seed)],
        grade_published,
        lambda rows: [("Pairs of published media, 20 directions", rows.drop(columns="unit"))],
        3,
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
