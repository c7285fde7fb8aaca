"""Why the nine-term fit may lift the reversed c-leg above the flat leg: the numbers of a campaign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.figures.labels import lift_errors
from rftfit.model import reference_kernel
from rftfit.model.motion import rotation_poses
from rftfit.model.outlines import leg_outline
from rftfit.page.live import profiles
from rftfit.results import Results

FLAT, REVERSED = "flat_leg", "reversed_c_leg"
_BY_MODEL = ("table", "fourier")

Ends = tuple[float, float]


@dataclass(frozen=True)
class Reversal:
    """Peak lift of the two legs in one medium.

    `peaks`: N, by (``measured``, ``table`` or ``fourier``; leg).
    `theta_deg`: Where the reversed leg's lift by the nine terms is largest.
    `lift_N`: Of the deepest third of its elements there, by profile (``table``, ``fourier``).
    `alpha_z_N_per_cm3`: Their mean, weighted with depth and area, by profile.
    `beta_deg`, `gamma_deg`: Smallest and largest attack and intrusion angle of these elements.
    """

    medium: str
    peaks: dict[tuple[str, str], float]
    theta_deg: float
    lift_N: dict[str, float]
    alpha_z_N_per_cm3: dict[str, float]
    beta_deg: Ends
    gamma_deg: Ends

    def above(self, source: str) -> bool:
        """Whether the reversed leg's peak is known to be above the flat leg's."""
        ours, flat = (self.peaks.get((source, leg)) for leg in (REVERSED, FLAT))
        return ours is not None and flat is not None and ours > flat


def reversals(results: Results) -> list[Reversal]:
    """Compare the two legs in every medium that has a prediction of both by table and nine terms."""
    leg = results.config.intruders.get(REVERSED)
    if not isinstance(leg, Leg):
        return []
    needed = {(source, name) for source in _BY_MODEL for name in (FLAT, REVERSED)}
    found = []
    for medium in results.laboratory:
        peaks, theta_deg = _peaks(results, medium)
        if needed <= set(peaks):
            found.append(
                Reversal(medium, peaks, theta_deg, *_deep(results, medium, leg, theta_deg))
            )
    return found


def _peaks(results: Results, medium: str) -> tuple[dict[tuple[str, str], float], float]:
    """Peak lift by source and leg, and where the reversed leg's is, by the nine terms."""
    peaks: dict[tuple[str, str], float] = {}
    theta_deg = np.nan
    predicted = results.table("predicted.csv")
    for (profile, leg), part in predicted[predicted["medium"] == medium].groupby(
        ["profile", "leg"]
    ):
        force = part["force_z_N"].to_numpy(float)
        if not np.isnan(force).any():
            peaks[str(profile), str(leg)] = float(force.max())
            if (profile, leg) == ("fourier", REVERSED):
                theta_deg = float(part["theta_deg"].iloc[int(force.argmax())])
    known = lift_errors(results, [medium]).dropna(subset=["peak_measured_N"])
    peaks |= {
        ("measured", str(leg)): float(peak)
        for leg, peak in zip(known["leg"], known["peak_measured_N"], strict=True)
    }
    return peaks, theta_deg


def _deep(
    results: Results, medium: str, leg: Leg, theta_deg: float
) -> tuple[dict[str, float], dict[str, float], Ends, Ends]:
    outline = leg_outline(leg)
    poses = rotation_poses(np.radians([theta_deg]), leg.hip_height_cm)
    elements = reference_kernel.place(outline.body, outline.width_cm, poses)
    deepest = np.argsort(elements[0, :, 1])[: len(outline.body) // 3]
    load = float(reference_kernel.submerged(elements)[0][0, deepest].sum())
    own = profiles(results, medium)
    lift = {
        name: float(reference_kernel.element_forces(own[name], elements)[0, deepest, 0].sum())
        for name in _BY_MODEL
    }
    alpha_z = {name: one / load for name, one in lift.items()}
    beta, gamma = (np.degrees(angle[0, deepest]) for angle in reference_kernel.angles(elements))
    return lift, alpha_z, (beta.min(), beta.max()), (gamma.min(), gamma.max())
