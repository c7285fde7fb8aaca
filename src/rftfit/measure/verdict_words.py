"""Words of verdicts on a medium, for modules that read tables of checks and do none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

PASSED, FAILED, ACCEPTED, NOT_CHECKED = "passed", "failed", "accepted", "not checked"
UNUSABLE, DOUBTFUL = "unusable", "doubtful"
SOUND, NOTHING = "sound", "no result"

REPEATS, PAIR, MAP = "repeats", "pair", "map"
"""Comparison of a run with two or more runs of its direction, with the other one of two, or with the map of all others."""

FEWEST_RUNS = 8
"""With fewer runs that have both components of alpha, nothing is said of what many runs share."""

NO_RUNS = "no-runs"
"""Reason of the table of causes: fewer than `FEWEST_RUNS`."""

PULLS = "beta-of-pulls"
"""Hypothesis of the table of axes: beta of pulls has the other sign."""

ROWS, BETA_ROWS = "rows", "beta-rows"
"""Mistakes of the table of misplaced runs: all angles, or beta alone, stand in other rows than their logs."""


def is_usable(alpha: pd.DataFrame) -> bool:
    """Whether a medium may enter what is made from several media."""
    return not any(UNUSABLE in str(codes).split() for codes in alpha.get("checks_code", ()))
