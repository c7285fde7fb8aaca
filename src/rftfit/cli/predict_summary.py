"""Peaks of predicted forces, for people and as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.cli.output import count, table

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.cli.predict_inputs import Motion
    from rftfit.cli.predict_intervals import Prediction

_LONGEST_REASON = 300

_PEAKS = (
    ("lift", "force_z_N", 1),
    ("suction", "force_z_N", -1),
    ("thrust", "force_x_N", 1),
    ("drag", "force_x_N", -1),
    ("moment", "moment_N_cm", 1),
    ("moment_negative", "moment_N_cm", -1),
)
_IN_WORDS = {
    "lift": "peak lift (up)",
    "suction": "peak suction (down)",
    "thrust": "peak thrust (toward +x)",
    "drag": "peak drag (toward -x)",
    "moment": "peak moment (z toward x)",
    "moment_negative": "peak moment (x toward z)",
}


@dataclass(frozen=True)
class Peak:
    """Greatest force of one sign, with its interval there.

    Parameters
    ----------
    name, quantity : str
    value, lo, hi : float
        Unit of the quantity; NaN where no interval is known.
    at : float
        Where: theta_deg or t_s.
    """

    name: str
    quantity: str
    value: float
    lo: float
    hi: float
    at: float


def find_peaks(motion: Motion, prediction: Prediction) -> list[Peak]:
    """Find the greatest force and moment of each sign; poses with NaN are left out.

    Parameters
    ----------
    motion : Motion
    prediction : Prediction

    Returns
    -------
    list of Peak
        Only those that exist: no lift where nothing pushes up.
    """
    found = []
    for name, quantity, sign in _PEAKS:
        values = sign * prediction.values[quantity]
        if np.isnan(values).all() or not np.nanmax(values) > 0:
            continue
        index = int(np.nanargmax(values))
        ends = prediction.ends.get(quantity)
        lo, hi = (float(end[index]) for end in ends) if ends else (math.nan, math.nan)
        value, at = prediction.values[quantity][index], motion.columns[motion.key][index]
        found.append(Peak(name, quantity, float(value), lo, hi, float(at)))
    return found


def shortened(reason: str) -> str:
    """Cut a reason that names dozens of cells after a whole one.

    Parameters
    ----------
    reason : str

    Returns
    -------
    str
    """
    if len(reason) <= _LONGEST_REASON:
        return reason
    parts = reason.split("; ")
    kept = [parts[0][:_LONGEST_REASON]]
    while len("; ".join(kept)) + len(parts[len(kept)]) < _LONGEST_REASON:
        kept.append(parts[len(kept)])
    return f"{'; '.join(kept)} and {len(parts) - len(kept)} more"


def as_text(motion: Motion, prediction: Prediction, peaks: list[Peak], confidence: float) -> str:
    """Peaks as a table for people.

    Parameters
    ----------
    motion : Motion
    prediction : Prediction
    peaks : list of Peak
    confidence : float

    Returns
    -------
    str
    """
    known = bool(prediction.ends)
    header = ["", "value", *(["lo", "hi"] if known else []), "unit", motion.key]
    rows = []
    for peak in peaks:
        numbers = [peak.value, *([peak.lo, peak.hi] if known else [])]
        unit = "N cm" if peak.quantity.endswith("cm") else "N"
        rows.append(
            [_IN_WORDS[peak.name], *(f"{number:.4g}" for number in numbers), unit, f"{peak.at:g}"]
        )
    text = table(header, rows) if rows else "  no force"
    if prediction.unknown:
        # the greatest of a curve with gaps need not be its peak, and must not pass for it
        there = count(len(motion.poses) - prediction.unknown, "pose")
        text = f"Of the {there} with a number only:\n\n{text}"
    if not rows:
        return text
    if known:
        return f"{text}\n\nlo, hi: {100 * confidence:g} % interval, pose by pose."
    return f"{text}\n\nNo intervals: the errors of this profile are not known."


def as_json(
    names: dict[str, str], motion: Motion, prediction: Prediction, peaks: list[Peak],
    confidence: float, output: Path,
) -> str:  # fmt: skip
    """Peaks as JSON; what is not known is null.

    Peaks are those of the poses with a number; ``peaks_complete`` says whether these are all.

    Parameters
    ----------
    names : dict of str to str
        What was predicted.
    motion : Motion
    prediction : Prediction
    peaks : list of Peak
    confidence : float
    output : Path
        File of the forces.

    Returns
    -------
    str
    """
    by_name = {peak.name: peak for peak in peaks}

    def entry(name: str, quantity: str) -> dict[str, Any] | None:
        if name not in by_name:
            return None
        peak = by_name[name]
        numbers = {quantity: peak.value, "lo": peak.lo, "hi": peak.hi, motion.key: peak.at}
        return {key: value if math.isfinite(value) else None for key, value in numbers.items()}

    content: dict[str, Any] = {
        **names,
        "confidence": confidence if prediction.ends else None,
        "rows": len(motion.poses),
        "rows_unknown": prediction.unknown,
        "reason": prediction.reason,
        "peaks_complete": prediction.unknown == 0,
        "peaks": {name: entry(name, quantity) for name, quantity, _ in _PEAKS},
        "forces": str(output),
    }
    return json.dumps(content, indent=2)
