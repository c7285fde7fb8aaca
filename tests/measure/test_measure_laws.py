"""Lines with a free intercept and powers of depth beside the line through zero."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit.measure.laws import by_law, other_laws
from rftfit.measure.slopes import fit_slope

DEPTH = np.linspace(0.5, 8.0, 700)
NOTHING = np.zeros((1, 1)), np.ones((1, 1))


def test_exact_laws_are_found() -> None:
    power = 0.3 * 5 * (DEPTH / 5) ** 1.25
    late = 0.2 * (DEPTH - 0.3)
    found = other_laws(DEPTH, np.stack([power, late]), 5.0)
    assert found is not None
    assert found["power"][0].exponent == pytest.approx(1.25, abs=1e-5)
    assert found["power"][0].alpha == pytest.approx(0.3, rel=1e-5)
    assert found["free_intercept"][1].alpha == pytest.approx(0.2 * 4.7 / 5, rel=1e-9)
    # a line that begins deeper looks like a power above 1
    assert found["power"][1].exponent > 1.05
    assert other_laws(np.full(700, 5.0), np.ones((1, 700)), 5.0) is None


def test_the_gain_is_that_of_each_sample() -> None:
    """The gain against the fit of a stress in which some samples are raised a little."""
    stress = 0.3 * 5 * (DEPTH / 5) ** 1.1
    before = other_laws(DEPTH, stress[None], 5.0)
    small = np.where(DEPTH > 6, 1e-6, 0.0)
    after = other_laws(DEPTH, (stress + small)[None], 5.0)
    assert before is not None
    assert after is not None
    for law in ("free_intercept", "power"):
        change = after[law][0].alpha - before[law][0].alpha
        assert change == pytest.approx(float(before[law][0].gain @ small), rel=1e-2)


@pytest.mark.parametrize(
    ("law", "truth", "exponent", "offset"),
    [("free_intercept", 0.3, 1.0, 0.3), ("power", 0.3, 1.2, 0.0)],
)
def test_the_chosen_law_covers_what_the_line_misses(
    law: str, truth: float, exponent: float, offset: float
) -> None:
    random = np.random.default_rng(7)
    inside = []
    for _ in range(200):
        stress = 0.3 * (DEPTH - offset) * (DEPTH / 5) ** (exponent - 1)
        stress = stress + random.normal(0, 0.01, DEPTH.size)
        line = fit_slope(DEPTH, stress[None], *NOTHING)
        chosen = by_law(line, other_laws(DEPTH, stress[None], 5.0), law)  # type: ignore[arg-type]
        lo, hi = chosen.interval(0.95)
        at = truth * (1 - offset / 5)
        inside.append(lo[0] <= at <= hi[0])
        assert abs(line.alpha[0] - at) > 5 * line.se[0] or line.curvature[0] > 0
    assert 0.90 <= np.mean(inside) <= 0.995
