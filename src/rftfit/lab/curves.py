"""Forces published as curves: penetration of natural sands (Fig. S11), legs (Figs. S5, S12)."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from rftfit import reference
from rftfit.lab.path import FloatArray, half_extents
from rftfit.lab.plan import plate_of

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.lab.contact import Forces, Law
    from rftfit.lab.path import Segment
    from rftfit.lab.plan import Run

_TAPER_DEG = 3.0


@cache
def _penetration(sand: str) -> tuple[FloatArray, FloatArray]:
    table = reference.load("fig_s11")
    rows = table[table["medium"] == sand].sort_values("depth_cm")
    return rows["depth_cm"].to_numpy(float), rows["stress_z_N_per_cm2"].to_numpy(float)


def sand_stress(sand: str, depth_cm: FloatArray) -> FloatArray:
    """Vertical stress on a level plate pushed into a natural sand (Fig. S11), N/cm^2.

    Parameters
    ----------
    sand : str
    depth_cm : numpy.ndarray
        Clamped to the published range, 0 to 6 cm.

    Returns
    -------
    numpy.ndarray
    """
    depths, stresses = _penetration(sand)
    return np.interp(depth_cm, depths, stresses)


def sand_law(run: Run, config: Config) -> Law:
    """Force on the level plate of a penetration test: Fig. S11 times area.

    Parameters
    ----------
    run : Run
    config : Config

    Returns
    -------
    Law
    """
    plate = plate_of(config)[1]
    _, half_z = half_extents(plate, run.beta_deg or 0.0)

    def law(_part: Segment, _x: FloatArray, z_cm: FloatArray, _angle: FloatArray) -> Forces:
        touching = np.clip(1 - z_cm / half_z, 0.0, 1.0)
        force_z = plate.area_cm2 * touching * sand_stress(run.published, -z_cm)
        return force_z, np.zeros_like(force_z)

    return law


@cache
def _rotation(name: str, medium: str, leg: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    table = reference.load(name)
    rows = table[(table["medium"] == medium) & (table["leg"] == leg)].sort_values("theta_deg")
    theta, force_z, force_x = (
        rows[column].to_numpy(float) for column in ("theta_deg", "force_z_N", "force_x_N")
    )
    return theta, force_z, force_x


def leg_law(run: Run) -> Law:
    """Force on a leg turned in a medium (Fig. S5, natural sands Fig. S12) against theta.

    Parameters
    ----------
    run : Run

    Returns
    -------
    Law
        Interpolated; outside the published range the end value fades to 0 within 3 degrees.
    """
    figure = "fig_s12" if run.natural else "fig_s5"
    theta, *published = _rotation(figure, run.published, run.leg)

    def law(_part: Segment, _x: FloatArray, _z: FloatArray, angle_deg: FloatArray) -> Forces:
        outside = np.maximum(theta[0] - angle_deg, angle_deg - theta[-1])
        fade = np.clip(1 - outside / _TAPER_DEG, 0.0, 1.0)
        force_z, force_x = (fade * np.interp(angle_deg, theta, curve) for curve in published)
        return force_z, force_x

    return law
