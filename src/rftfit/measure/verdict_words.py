"""Words of verdicts on a medium and of tables of checks, for modules that read such tables but do no checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

PASSED, FAILED, ACCEPTED, NOT_CHECKED = "passed", "failed", "accepted", "not checked"
"""Verdicts of one check; a failed check that the config accepts is accepted."""
UNUSABLE, DOUBTFUL = "unusable", "doubtful"
"""Marks of a medium that fails checks: it must not, or should not, be used; codes in the column ``checks_code``."""
SOUND, NOTHING = "sound", "no result"
"""What is said of a medium without a mark, and of one without any number."""

REPEATS, PAIR, MAP = "repeats", "pair", "map"
"""Comparisons of a run: with two or more runs of its direction, with a single one, or with the map of all others."""

FEWEST_RUNS = 8
"""Fewest runs with both components of alpha from which causes shared by many runs are judged."""

NO_RUNS = "no-runs"
"""Reason in the table of causes: fewer runs than `FEWEST_RUNS`."""

MIXED_UP = "mixed-up"
"""Reason in the table of causes: an error of these runs cannot be told from alpha in their directions."""

BETA_REVERSED, BETA_AND_X_REVERSED = "beta-reversed", "beta-and-x-reversed"
"""Hypotheses in the table of axes on all runs: the other sign of beta, alone or with x reversed.

The latter is as if seen from behind the rig.
"""

PULLS = "beta-of-pulls"
"""Hypothesis in the table of axes: beta of pulls has the other sign."""

ROWS, BETA_ROWS = "rows", "beta-rows"
"""Mistakes in the table of misplaced runs: all angles, or beta alone, stand in other rows than their logs."""


def is_usable(alpha: pd.DataFrame) -> bool:
    """Return True if a medium may be used in results of several media: it is not marked unusable."""
    return not any(UNUSABLE in str(codes).split() for codes in alpha.get("checks_code", ()))
