"""Why the nine-term fit may lift the reversed c-leg above the flat leg: the numbers of this run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.predict import plain
from rftfit.predict.outline import leg_outline
from rftfit.predict.rotation import rotation_poses
from rftfit.profile.nine_terms import FourierProfile
from rftfit.profile.table import TableProfile
from rftfit.report.page.references import used_coefficients

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.profile.base import Profile
    from rftfit.report.page.inputs import PageInputs

FLAT, REVERSED = "flat_leg", "reversed_c_leg"
_MEASURED = "measured"


@dataclass(frozen=True)
class Deep:
    """What a profile says of the deepest elements of a leg.

    Parameters
    ----------
    lift_N : float
    alpha_z_N_per_cm3 : float
        Mean over them, weighted with depth and area.
    """

    lift_N: float
    alpha_z_N_per_cm3: float


@dataclass(frozen=True)
class Reversal:
    """Peak lift of the two legs in one medium.

    Parameters
    ----------
    medium : str
    peaks : dict of (str, str) to float
        N, by (``measured``, ``table`` or ``fourier``; leg).
    theta_deg : float
        Where the reversed leg's lift by the nine terms is largest.
    deep : dict of str to Deep
        The deepest third of its elements there, by profile (``table``, ``fourier``).
    beta_deg, gamma_deg : tuple of float
        Smallest and largest attack and intrusion angle of these elements.
    """

    medium: str
    peaks: dict[tuple[str, str], float]
    theta_deg: float
    deep: dict[str, Deep]
    beta_deg: tuple[float, float]
    gamma_deg: tuple[float, float]

    def above(self, source: str) -> bool | None:
        """Tell whether the reversed leg's peak is above the flat leg's; None if not known.

        Parameters
        ----------
        source : str
            ``measured``, ``table`` or ``fourier``.

        Returns
        -------
        bool or None
        """
        pair = self.peaks.get((source, REVERSED)), self.peaks.get((source, FLAT))
        return None if pair[0] is None or pair[1] is None else pair[0] > pair[1]


def reversals(inputs: PageInputs) -> list[Reversal]:
    """Compare the two legs in every laboratory medium.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    list of Reversal
        Of the media that have both legs by both profiles.
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
    elements = plain.place(outline.body, outline.width_cm, poses)
    coefficients = used_coefficients(inputs.coefficients, inputs.config.fourier.method, medium)
    profiles: dict[str, Profile] = {
        "table": TableProfile.from_table(inputs.alpha[medium]),
        "fourier": FourierProfile(coefficients),
    }
    deepest = np.argsort(elements[0, :, 1])[: len(outline.body) // 3]
    load = float(plain.submerged(elements)[0][0, deepest].sum())
    found = {}
    for name, profile in profiles.items():
        lift = float(plain.element_forces(profile, elements)[0, deepest, 0].sum())
        found[name] = Deep(lift, lift / load)
    beta, gamma = (np.degrees(angle[0, deepest]) for angle in plain.angles(elements))
    ends = [(float(angle.min()), float(angle.max())) for angle in (beta, gamma)]
    return found, ends[0], ends[1]
