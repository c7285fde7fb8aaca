"""How much the predicted peaks of legs depend on details of the legs' shape that are not stated."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.compare.legs import COMPONENTS, WITHIN_PERCENT, extreme
from rftfit.model.forces import forces_on
from rftfit.model.motion import THETA_DEG, rotation
from rftfit.model.outlines import arc_of, leg_outline
from rftfit.results import Medium

SENSITIVITY_COLUMNS = [
    "medium", "leg", "profile", "arc_deg", "arc_step_deg", "hip_height_cm", "hip_step_cm", "lead_cm",
    "peak_z_N", "peak_x_N", "peak_error_z_percent", "peak_error_x_percent",
]  # fmt: skip

ARC_STEPS_DEG = (0, -15, 15, 30)
HIP_STEPS_CM = (0, -0.2, 0.2)


def leg_sensitivity(
    media: Iterable[Medium], measured: pd.DataFrame, errors: pd.DataFrame
) -> pd.DataFrame:
    """Predict the peaks of every leg in every medium with other arcs, hip heights and faces.

    The arc of a curved leg is varied at its maximal length; the face is the middle line, or half the
    thickness ahead of it. By the measured table, in natural sands by the scaled generic profile.
    `measured`: Curves of the leg stage, whose theta is compared. `errors`: Has the measured peaks.
    """
    names = ["medium", "leg", "profile", "component"]
    peaks = errors.set_index(names)["peak_measured_N"].to_dict()
    theta = {name: part["theta_deg"] for name, part in measured.groupby(["medium", "leg"])}
    rows = []
    for medium in media:
        config = medium.results.config
        kind = "table" if medium.name in medium.results.laboratory else "generic"
        profile = medium.profile(kind, draws=False)
        if profile.reason and kind != "table":
            continue
        for name, leg in config.legs.items():
            sweep = np.unique(np.asarray(theta.get((medium.name, name), THETA_DEG), float))
            arcs = [arc for arc in ARC_STEPS_DEG if arc_of(leg) + arc > 0] if arc_of(leg) else [0]
            for arc, hip, lead in product(arcs, HIP_STEPS_CM, [0.0, leg.thickness_cm / 2]):
                arc_deg, hip_cm = arc_of(leg) + arc, leg.hip_height_cm + hip
                outline = leg_outline(leg, name, arc_deg=arc_deg, lead_cm=lead)
                motion = rotation(sweep, hip_cm, config.arm.leg_speed_rad_per_s)
                found = forces_on(profile, outline, motion.poses)
                forces = [getattr(found, f"force_{c}_N") for c in COMPONENTS]
                ours = [one[extreme(one, c)] for one, c in zip(forces, COMPONENTS, strict=True)]
                theirs = [peaks.get((medium.name, name, kind, c), np.nan) for c in COMPONENTS]
                off = 100 * (np.array(ours) / theirs - 1)
                rows.append((medium.name, name, kind, arc_deg, arc, hip_cm, hip, lead, *ours, *off))
    return pd.DataFrame(rows, columns=SENSITIVITY_COLUMNS)


class Shape(NamedTuple):
    """Number of peaks within 33 % where all legs are changed alike, and the worst error of a lift, percent."""

    name: str
    lifts: int
    thrusts: int
    of: int
    worst: float


def shapes(table: pd.DataFrame) -> list[Shape]:
    """Sum up the laboratory media: arcs with either face, then other hips; the stated shape first.

    `table`: Of `leg_sensitivity`. Empty where no leg was measured in a laboratory medium.
    """
    own = table[(table["profile"] == "table") & table["peak_error_z_percent"].notna()]
    lead = own["lead_cm"] > 0
    found = []
    for arc, hip, ahead in [
        *((arc, 0, ahead) for ahead in (False, True) for arc in ARC_STEPS_DEG),
        *((0, hip, False) for hip in HIP_STEPS_CM if hip),
    ]:
        bent = own["arc_step_deg"] == arc
        part = own[(bent | (own["arc_deg"] == 0)) & (own["hip_step_cm"] == hip) & (lead == ahead)]
        arcs = own.loc[bent & (own["arc_deg"] > 0), "arc_deg"].round(1).unique()
        if part.empty or (arc and not len(arcs)):
            continue
        name = f"arc of {arcs[0]:g} deg" if len(arcs) == 1 else f"arcs {arc:+d} deg"
        name = f"hip 2 mm {'higher' if hip > 0 else 'lower'}" if hip else name
        off = part[["peak_error_z_percent", "peak_error_x_percent"]].to_numpy(float)
        lifts, thrusts = (int(one) for one in (np.abs(off) <= WITHIN_PERCENT).sum(axis=0))
        worst = float(off[np.abs(off[:, 0]).argmax(), 0])
        found.append(
            Shape(f"{name}, face ahead" if ahead else name, lifts, thrusts, len(part), worst)
        )
    return found
