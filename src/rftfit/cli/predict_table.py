"""The predicted forces as a file, never over a file of somebody else's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import rftfit
from rftfit.cli.predict_intervals import QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.cli.predict_inputs import Motion
    from rftfit.cli.predict_intervals import Prediction
    from rftfit.conventions import FloatArray

MARK = "# forces written by rftfit predict"
"""How the first line of such a file begins: only these are overwritten unasked."""


def end_names(quantity: str) -> tuple[str, str]:
    """Names of the columns of an interval: ``force_z_N`` to ``force_z_lo_N``, ``force_z_hi_N``.

    Parameters
    ----------
    quantity : str

    Returns
    -------
    lo, hi : str
    """
    what, unit = quantity.rsplit("_N", maxsplit=1)
    return f"{what}_lo_N{unit}", f"{what}_hi_N{unit}"


def table_text(motion: Motion, prediction: Prediction, notes: Sequence[str]) -> str:
    """Write forces by pose as csv.

    Parameters
    ----------
    motion : Motion
    prediction : Prediction
    notes : sequence of str
        Comment lines: what was predicted, from what.

    Returns
    -------
    str
        Comment lines, a header row, a row for each pose; an empty cell is NaN.
    """
    # twelve digits, so that whoever takes the numbers further loses nothing; intervals need fewer
    columns: dict[str, list[str]] = {
        name: _cells(values, 10) for name, values in motion.columns.items()
    }
    for name in QUANTITIES:
        columns[name] = _cells(prediction.values[name], 12)
        if name in prediction.ends:
            for end, values in zip(end_names(name), prediction.ends[name], strict=True):
                columns[end] = _cells(values, 9)
    lines = [f"{MARK} (rftfit {rftfit.__version__})"]
    # a comment is one line, whatever a file name holds
    lines += [f"# {' '.join(note.split())}" for note in notes if note]
    lines.append(",".join(columns))
    lines += [",".join(row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(lines) + "\n"


def _cells(values: FloatArray, digits: int) -> list[str]:
    # + 0.0 so that nothing is called -0
    return ["" if math.isnan(value) else f"{value + 0.0:.{digits}g}" for value in values.tolist()]
