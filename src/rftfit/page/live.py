"""The numbers of the live parts of the page, as one JSON object."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.measure.alpha import column, grid
from rftfit.model import reference_kernel
from rftfit.model.fourier import TERMS
from rftfit.model.motion import rotation_poses
from rftfit.model.outlines import leg_outline
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile
from rftfit.model.scaling import GENERIC, Reference, published, reference_from, routine, routines
from rftfit.page.robot import robot_data
from rftfit.page.tables import PROFILES, leg_name
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.page.page import PageInputs


# --- The profiles of a medium as the scripts of the page want them.


def profiles_of(inputs: PageInputs, medium: str) -> dict[str, dict[str, Any]]:
    """Parameters of every profile of a medium.

    Returns by name (``table``, ``fourier``, ``generic``, ``depth_only``); each with its ``kind``
    and what that needs. A natural sand has the generic profile only; a profile whose numbers are
    missing altogether is left out.
    """
    found: dict[str, dict[str, Any]] = {}
    method: str = inputs.config.fourier.method
    if inputs.config.media[medium].role == "laboratory":
        table = TableProfile.from_table(inputs.alpha[medium], inputs.config.media[medium].title)
        found["table"] = {
            "kind": "table",
            "beta": table.beta.tolist(),
            "gamma": table.gamma.tolist(),
            "z": _lists(table.alpha_z),
            "x": _lists(table.alpha_x),
            "reason": table.reason,
        }
        own = used_coefficients(inputs.coefficients, method, medium)
        if np.isfinite(own).all():
            found["fourier"] = {"kind": "fourier", "values": own.tolist()}
    zeta, m0 = zeta_of(inputs, medium), generic_of(inputs, medium)
    if np.isfinite(zeta) and np.isfinite(m0).all():
        found["generic"] = {"kind": "fourier", "values": (zeta * m0).tolist()}
    if "table" in found:
        depth_only = DepthOnlyProfile.of(table).values
        if np.isfinite(depth_only).all():
            found["depth_only"] = {"kind": "depth_only", "values": depth_only.tolist()}
    return found


def zeta_of(inputs: PageInputs, medium: str) -> float:
    """Scaling factor of a medium by the configured method.

    Returns naN where the penetration table has none.
    """
    method: str = inputs.config.fourier.method
    laboratory = inputs.config.media[medium].role == "laboratory"
    names = [method] if laboratory else routines(method)
    table = inputs.penetration
    rows = table[table["method"].isin(names) & (table["medium"] == medium)]
    return float(rows["zeta"].iloc[0]) if len(rows) else float("nan")


def _lists(values: FloatArray) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]


# --- What the field calculator scales a new medium from: this campaign's fits, or the printed ones.


def references_of(inputs: PageInputs) -> list[Reference]:
    """List the references: this campaign's by the configured fit, if it has one; the printed ones.

    Returns the first is what ``rftfit scale --results`` uses, the last what it uses without.
    """
    method = inputs.config.fourier.method
    rows = inputs.penetration[inputs.penetration["method"] == method]
    chi = {
        str(medium): float(value)
        for medium, value in zip(rows["medium"], rows["chi"], strict=True)
        if np.isfinite(value)
    }
    values = {
        medium: used_coefficients(inputs.coefficients, method, medium) for medium in (GENERIC, *chi)
    }
    whole = all(np.isfinite(own).all() for own in values.values())
    found = (
        [reference_from(f"this campaign, method {method}", chi, values)]
        if whole and len(chi) > 1
        else []
    )
    return [*found, published()]


def generic_of(inputs: PageInputs, medium: str) -> FloatArray:
    """Find the generic coefficients that a medium is scaled from, by the configured fit.

    Returns shape (9,): NaN where there are none.
    """
    method = inputs.config.fourier.method
    if medium in scaled_from_print(inputs):
        return published().m0
    return used_coefficients(inputs.coefficients, method, GENERIC)


def scaled_from_print(inputs: PageInputs) -> list[str]:
    """List the natural sands that were scaled with the published media.

    Returns empty where the campaign has a usable medium of its own.
    """
    rows = inputs.penetration
    method = routine(inputs.config.fourier.method, printed=True)
    return [str(medium) for medium in rows.loc[rows["method"] == method, "medium"]]


def used_coefficients(table: pd.DataFrame, method: str, medium: str) -> FloatArray:
    """Nine coefficients of a medium; a dropped term counts as 0.

    `table`: Coefficients, long. Returns shape (9,): N/cm^3; NaN where the table has none.
    """
    rows = table[(table["method"] == method) & (table["medium"] == medium)]
    found = {
        # read back from csv, the column may hold text
        str(row["coefficient"]): 0.0
        if str(row["kept"]).strip().lower() == "false"
        else float(row["value_N_per_cm3"])
        for row in rows.to_dict("records")
    }
    return np.array([found.get(term, np.nan) for term in TERMS])


# --- Why the nine-term fit may lift the reversed c-leg above the flat leg: the numbers of this run.


FLAT, REVERSED = "flat_leg", "reversed_c_leg"
_MEASURED = "measured"


@dataclass(frozen=True)
class Deep:
    """What a profile says of the deepest elements of a leg.

    `alpha_z_N_per_cm3`: Mean over them, weighted with depth and area.
    """

    lift_N: float
    alpha_z_N_per_cm3: float


@dataclass(frozen=True)
class Reversal:
    """Peak lift of the two legs in one medium.

    `peaks`: N, by (``measured``, ``table`` or ``fourier``; leg).
    `theta_deg`: Where the reversed leg's lift by the nine terms is largest.
    `deep`: The deepest third of its elements there, by profile (``table``, ``fourier``).
    `beta_deg`, `gamma_deg`: Smallest and largest attack and intrusion angle of these elements.
    """

    medium: str
    peaks: dict[tuple[str, str], float]
    theta_deg: float
    deep: dict[str, Deep]
    beta_deg: tuple[float, float]
    gamma_deg: tuple[float, float]

    def above(self, source: str) -> bool | None:
        """Tell whether the reversed leg's peak is above the flat leg's; None if not known.

        `source`: ``measured``, ``table`` or ``fourier``.
        """
        pair = self.peaks.get((source, REVERSED)), self.peaks.get((source, FLAT))
        return None if pair[0] is None or pair[1] is None else pair[0] > pair[1]


def reversals(inputs: PageInputs) -> list[Reversal]:
    """Compare the two legs in every laboratory medium.

    Returns of the media that have both legs by both profiles.
    """
    leg = inputs.config.intruders.get(REVERSED)
    found = []
    for medium in inputs.media:
        peaks = _peaks(inputs, medium)
        needed = [(source, name) for source in ("table", "fourier") for name in (FLAT, REVERSED)]
        if isinstance(leg, Leg) and all(key in peaks for key in needed):
            theta = _theta_of_peak(inputs.predicted, medium)
            found.append(Reversal(medium, peaks, theta, *_deep(inputs, medium, leg, theta)))
    return found


def _peaks(inputs: PageInputs, medium: str) -> dict[tuple[str, str], float]:
    peaks: dict[tuple[str, str], float] = {}
    if inputs.predicted.empty:
        return peaks
    own = inputs.predicted[inputs.predicted["medium"] == medium]
    for (profile, leg), part in own.groupby(["profile", "leg"]):
        if not part["force_z_N"].isna().any():
            peaks[str(profile), str(leg)] = float(part["force_z_N"].max())
    if not inputs.legs.empty:
        for leg, part in inputs.legs[inputs.legs["medium"] == medium].groupby("leg"):
            if part["force_z_N"].notna().any():
                peaks[_MEASURED, str(leg)] = float(part["force_z_N"].max())
    return peaks


def _theta_of_peak(predicted: pd.DataFrame, medium: str) -> float:
    here = (predicted["medium"] == medium) & (predicted["leg"] == REVERSED)
    rows = predicted[here & (predicted["profile"] == "fourier")]
    return float(rows["theta_deg"].iloc[int(rows["force_z_N"].to_numpy(float).argmax())])


def _deep(
    inputs: PageInputs, medium: str, leg: Leg, theta_deg: float
) -> tuple[dict[str, Deep], tuple[float, float], tuple[float, float]]:
    outline = leg_outline(leg)
    poses = rotation_poses(np.radians([theta_deg]), leg.hip_height_cm)
    elements = reference_kernel.place(outline.body, outline.width_cm, poses)
    coefficients = used_coefficients(inputs.coefficients, inputs.config.fourier.method, medium)
    profiles: dict[str, Profile] = {
        "table": TableProfile.from_table(inputs.alpha[medium]),
        "fourier": FourierProfile(coefficients),
    }
    deepest = np.argsort(elements[0, :, 1])[: len(outline.body) // 3]
    load = float(reference_kernel.submerged(elements)[0][0, deepest].sum())
    found = {}
    for name, profile in profiles.items():
        lift = float(reference_kernel.element_forces(profile, elements)[0, deepest, 0].sum())
        found[name] = Deep(lift, lift / load)
    beta, gamma = (np.degrees(angle[0, deepest]) for angle in reference_kernel.angles(elements))
    ends = [(float(angle.min()), float(angle.max())) for angle in (beta, gamma)]
    return found, ends[0], ends[1]


# --- The numbers of the live parts of the page, as one JSON object.


CURVE_DIGITS = 6
"""Significant digits of curves, as in the csv tables. Profiles and outlines keep all of theirs."""


def live_data(inputs: PageInputs) -> dict[str, Any]:
    """Collect what the scripts of the page work on.

    Returns of what JSON can write; NaN is None.
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
    """Write JSON that can stand inside a script element: nothing in it can end the element."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def numbers(values: FloatArray, digits: int | None = None) -> list[Any]:
    """Turn an array into (nested) lists, NaN into None.

    `digits`: Significant ones to round to.
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
