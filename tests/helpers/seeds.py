"""How many random campaigns, media or pushes a test of statistics makes.

A few in `make test`, with limits as wide as so few allow; all of them in `make statistics`.
"""

import math

import numpy as np

ALL = False
"""Whether every seed is asked for: `--all-seeds`, which `tests/conftest.py` reads."""


def seeds(every, reduced):
    """`every` where all seeds are asked for, else `reduced`."""
    return every if ALL else reduced


def example_count(every):
    """Examples of a Hypothesis test: all of them, or a tenth, but two at least."""
    return seeds(every, max(every // 10, 2))


def assert_share(inside, least, most):
    """The mean of shares lies between two limits; of few seeds give or take three standard errors."""
    shares = np.asarray(inside, dtype=float)
    error = 0.0 if ALL else 3 * float(shares.std()) / math.sqrt(shares.size)
    assert least - error <= shares.mean() <= most + error
