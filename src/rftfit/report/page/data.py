"""The numbers of the live parts of the page, as one JSON object."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.measure.alpha import column, grid
from rftfit.predict.outline import leg_outline
from rftfit.profile.fourier import TERMS
from rftfit.reference import BETA_DEG, GAMMA_DEG
from rftfit.report.page.profiles import profiles_of
from rftfit.report.page.references import references_of
from rftfit.report.page.robot import robot_data
from rftfit.report.page.words import PROFILES, leg_name

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.report.page.inputs import PageInputs

CURVE_DIGITS = 6
"""Significant digits of curves, as in the csv tables. Profiles and outlines keep all of theirs."""


def live_data(inputs: PageInputs) -> dict[str, Any]:
    """Collect what the scripts of the page work on.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    dict
        Of what JSON can write; NaN is None.
    """
    config = inputs.config
    media = inputs.media
    references = references_of(inputs)
    return {
        "media": [
            {"key": name, "title": config.media[name].title, "role": config.media[name].role}
            for name in media
        ],
        "terms": list(TERMS),
        "legs": {name: _leg(leg) for name, leg in config.intruders.items() if isinstance(leg, Leg)},
        "leg_names": {name: leg_name(name) for name in config.intruders},
        "profile_names": PROFILES,
        "rate": config.arm.leg_speed_rad_per_s,
        "beta_deg": BETA_DEG.tolist(),
        "gamma_deg": GAMMA_DEG.tolist(),
        "confidence": config.fit.confidence,
        "profiles": {name: profiles_of(inputs, name) for name in media},
        "alpha": {name: _cells(inputs.alpha[name]) for name in media},
        "measured": _curves(inputs.legs, ("medium", "leg"), ("force_z_N", "force_x_N")),
        "predicted": _curves(
            inputs.predicted,
            ("medium", "leg", "profile"),
            (
                "force_z_N",
                "force_z_lo_N",
                "force_z_hi_N",
                "force_x_N",
                "force_x_lo_N",
                "force_x_hi_N",
            ),
        ),
        "robot": robot_data(inputs.robot),
        "references": [
            {
                "name": reference.name,
                "media": list(reference.media),
                "chi": reference.chi.tolist(),
                "m0": reference.m0.tolist(),
                "scaled": reference.scaled.tolist(),
            }
            for reference in references
        ],
    }


def as_json(data: dict[str, Any]) -> str:
    """Write JSON that can stand inside a script element: nothing in it can end the element.

    Parameters
    ----------
    data : dict

    Returns
    -------
    str
    """
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def numbers(values: FloatArray, digits: int | None = None) -> list[Any]:
    """Turn an array into (nested) lists, NaN into None.

    Parameters
    ----------
    values : numpy.ndarray
    digits : int, optional
        Significant ones to round to.

    Returns
    -------
    list
    """
    if values.ndim > 1:
        return [numbers(row, digits) for row in values]
    return [_number(float(value), digits) for value in values]


def _number(value: float, digits: int | None) -> float | int | None:
    if not math.isfinite(value):
        return None
    if digits is not None:
        value = float(f"{value:.{digits}g}")
    return int(value) if value == int(value) and abs(value) < 1e6 else value


def _leg(leg: Leg) -> dict[str, Any]:
    outline = leg_outline(leg)
    return {
        "body": outline.body.tolist(),
        "width_cm": outline.width_cm,
        "hip_height_cm": leg.hip_height_cm,
        "max_length_cm": leg.max_length_cm,
        "curvature_times_R": leg.curvature_times_R,
    }


def _cells(table: pd.DataFrame) -> dict[str, Any]:
    """Measured cells of one medium on the grid, with intervals and why one is empty."""
    result: dict[str, Any] = {
        f"{c}{quantity}": numbers(grid(table, column(c, quantity)), CURVE_DIGITS)
        for c in "zx"
        for quantity in ("", "_lo", "_hi")
    }
    notes: dict[str, str] = {}
    beta, gamma = table["beta_deg"].to_numpy(float), table["gamma_deg"].to_numpy(float)
    for b, g, flags, reason in zip(beta, gamma, table["flags"], table["reason"], strict=True):
        note = "; ".join(str(text) for text in (reason, flags) if isinstance(text, str) and text)
        if note:
            row = int(np.abs(BETA_DEG - b).argmin())
            notes[f"{row},{int(np.abs(GAMMA_DEG - g).argmin())}"] = note
    return result | {"notes": notes}


def _curves(table: pd.DataFrame, keys: tuple[str, ...], columns: tuple[str, ...]) -> dict[str, Any]:
    """Nest the curves of a long table by its keys: theta and the columns of each."""
    result: dict[str, Any] = {}
    if table.empty:
        return result
    for names, part in table.groupby(list(keys), sort=True):
        rows = part.sort_values("theta_deg")
        inner = result
        for name in names[:-1]:
            inner = inner.setdefault(str(name), {})
        inner[str(names[-1])] = {
            "theta_deg": numbers(rows["theta_deg"].to_numpy(float), CURVE_DIGITS),
            **{c: numbers(rows[c].to_numpy(float), CURVE_DIGITS) for c in columns},
        }
    return result
