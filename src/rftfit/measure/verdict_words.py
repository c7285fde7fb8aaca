"""Words of verdicts on a medium, for modules that read tables of checks and do none."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

PASSED, FAILED, ACCEPTED, NOT_CHECKED = "passed", "failed", "accepted", "not checked"
UNUSABLE, DOUBTFUL = "unusable", "doubtful"


def is_usable(alpha: pd.DataFrame) -> bool:
    """Whether a medium may enter what is made from several media."""
    return not any(UNUSABLE in str(codes).split() for codes in alpha.get("checks_code", ()))
