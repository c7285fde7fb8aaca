"""How often `rftfit compare` tells two sessions, two sizes and two shapes apart.

    make compare    100 pairs of several designs

The runs do not come from the program's own models:
alpha of a published table, beds looser or denser by 5 % as a whole, patches of 3 % in each component, a free surface
that is off by 0.5 mm from run to run and by 0.5 mm in a session, and noise.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from frame import Part, Row

from rftfit import reference
from rftfit.compare.contrast import Comparison, RunSet, compare_run_sets

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

SURFACE_CM, NOISE = 0.05, 0.003
"""Error of the free surface, of a run and of a session; noise of alpha, relative to its largest."""

DEPTHS_CM = (3.0, 7.0)
"""Depths that runs reach, by direction: the deeper, the less the surface matters."""

SIZE, SHAPE, LEVEL = 0.08, 0.10, 0.05
"""Differences of size and of shape (rms) that the study makes; p below which they are told."""

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
) -> Comparison:
    """Compare two sessions of one published medium; B is `ratio` times as strong and of another `shape`."""
    rng = np.random.default_rng(seed)
    count, repeats = design
    published_alpha = published(str(rng.choice(reference.MEDIA)))
    truth = published_alpha[:, rng.permutation(published_alpha.shape[1])[:count]]
    depth = rng.uniform(*DEPTHS_CM, count)
    truth_b = other_shape(truth, shape, rng) if shape else truth.copy()
    truth_b = np.vstack([truth_b[:2], ratio * truth_b[2:]])
    runs_a, runs_b = (
        RunSet(name, runs_of(alpha, depth, repeats, rng, beds or Beds()), SURFACE_CM)
        for name, alpha in (("A", truth), ("B", truth_b))
    )
    return compare_run_sets(runs_a, runs_b)


def grade(pairs: int, design: tuple[int, int], beds: Beds | None = None) -> dict[str, float]:
    """Shares, in percent, of pairs by what the comparison says of them."""

    def compare_pairs(ratio: float, shape: float = 0.0) -> list[Comparison]:
        return [compare_pair(seed, design, ratio, shape, beds) for seed in range(pairs)]

    same_pairs, larger = compare_pairs(1), compare_pairs(1 + SIZE)
    formed = compare_pairs(1, SHAPE)
    covered = [
        pair.ratio_lo <= ratio <= pair.ratio_hi
        for ratio, of_ratio in ((1, same_pairs), (1 + SIZE, larger))
        for pair in of_ratio
    ]
    holds = (pair.shape_lo_percent <= 100 * SHAPE <= pair.shape_hi_percent for pair in formed)
    return {
        "size, false": percent(pair.size_p < LEVEL for pair in same_pairs),
        "shape, false": percent(pair.shape_p < LEVEL for pair in same_pairs),
        "ratio covered": percent(covered),
        "8 % of size": percent(pair.size_p < LEVEL for pair in larger),
        "10 % of shape": percent(pair.shape_p < LEVEL for pair in formed),
        "shape covered": percent(holds),
        "least ratio": float(np.median([pair.least_ratio for pair in same_pairs])),
        "least shape": float(np.median([pair.least_shape_percent for pair in same_pairs])),
    }


def grade_design(count: int, repeats: int, bed: float, patches: float, pairs: int) -> list[Row]:
    """Shares of one design."""
    design: Row = {"directions": count, "repeats": repeats, "bed": bed, "patches": patches}
    return [design | grade(pairs, (count, repeats), Beds(bed, patches))]


def percent(true: object) -> float:
    """Share of what is true."""
    return 100 * float(np.mean(list(true)))  # type: ignore[call-overload]


PARTS = {
    "designs": Part(
        lambda count, _seed: [(*design, count) for design in DESIGNS],
        grade_design,
        frame.list_rows("Pairs of sessions of one published medium; shares in percent"),
        100,
    )
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
