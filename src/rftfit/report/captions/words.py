"""Text of a run as reStructuredText prints it, and small numbers that several captions share."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.page.tables import value

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd

    from rftfit.page.page import PageInputs

    FloatArray = npt.NDArray[np.float64]

Row = dict[str, Any]

_SPECIAL = re.compile(r"([\\*_`|<>\[\]])")


def rst(text: str) -> str:
    """Escape what a user wrote, or a table holds, so that reStructuredText prints it as it is.

    Returns on one line.
    """
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


def escaped(found: Any) -> Any:
    """Escape every text in a nest of lists and dictionaries, the values alone.

    Returns of the same shape.
    """
    if isinstance(found, str):
        return rst(found)
    if isinstance(found, dict):
        return {key: escaped(cell) for key, cell in found.items()}
    return [escaped(cell) for cell in found] if isinstance(found, list) else found


def chosen(table: pd.DataFrame, inputs: PageInputs, medium: str, role: str) -> pd.DataFrame:
    """Rows of one medium, or of the media of one role.

    `table`: With a column ``medium``. `medium`: Empty for all. `role`: ``laboratory`` or
    ``natural_sand``; empty for both.
    """
    media = inputs.config.media
    names = [name for name in media if medium in ("", name) and role in ("", media[name].role)]
    return table[table["medium"].isin(names)] if len(table) else table


def half_widths(table: pd.DataFrame) -> FloatArray:
    """Half widths of the intervals of alpha.

    `table`: Fit or alpha table. Returns shape (2, n): z, x; N/cm^3.
    """
    ends = [
        [table[f"alpha_{c}_{end}_N_per_cm3"].to_numpy(float) for c in "zx"] for end in ("lo", "hi")
    ]
    low, high = np.asarray(ends, dtype=float)
    half: FloatArray = (high - low) / 2
    return half


def quantile(values: FloatArray, q: float, digits: int) -> str:
    """Write a quantile of what is known, "no value" where nothing is.

    `q`: From 0 to 1. `digits`: After the point.
    """
    known = values[np.isfinite(values)]
    return value(np.quantile(known, q) if known.size else np.nan, digits)
