"""The granular force inside the logs: the published measurements, and nothing else.

Written from section 2 of the design alone. Nothing here is shared with the analysis, so that a
wrong sign there cannot be cancelled by the same wrong sign here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit import reference
from rftfit.lab.curves import leg_law, sand_law, sand_stress
from rftfit.lab.path import CLEARANCE_CM, FloatArray, half_extents
from rftfit.lab.plan import plate_of

if TYPE_CHECKING:
    from rftfit.campaign.config import Config, Plate
    from rftfit.lab.contact import Forces, Law
    from rftfit.lab.path import Segment
    from rftfit.lab.plan import Run

_STICK_SLIP, _STICK_SLIP_CM = 0.015, 0.37


def table_s5(medium: str, beta_deg: float, gamma_deg: float) -> tuple[float, float]:
    """One cell of Table S5.

    Parameters
    ----------
    medium : str
    beta_deg, gamma_deg : float
        Of the published grid.

    Returns
    -------
    alpha_z, alpha_x : float
        N/cm^3.
    """
    alpha_z, alpha_x = reference.alpha_grid(medium)
    row = int(np.argmin(np.abs(reference.BETA_DEG - beta_deg)))
    column = int(np.argmin(np.abs(reference.GAMMA_DEG - gamma_deg)))
    return float(alpha_z[row, column]), float(alpha_x[row, column])


def pull_alpha(medium: str, beta_deg: float, path_gamma_deg: float) -> tuple[float, float]:
    """Stress per depth that a plate feels when it is pulled back along a path.

    The plate keeps its tangent (cos beta, -sin beta) and moves along (cos gamma, sin gamma), gamma
    being the path's angle on the way down. Seen in a mirror (x into -x) the tangent is that of
    -beta and the velocity (-cos gamma, sin gamma) that of -gamma, a cell of the table; the mirror
    keeps the vertical force and turns the horizontal one.

    Parameters
    ----------
    medium : str
    beta_deg, path_gamma_deg : float

    Returns
    -------
    alpha_z, alpha_x : float
        N/cm^3, in the lab frame (z up, +x).
    """
    alpha_z, alpha_x = table_s5(medium, -beta_deg, -path_gamma_deg)
    return alpha_z, -alpha_x


def alpha_of(run: Run, phase: str) -> tuple[float, float]:
    """Stress per depth (z, x), N/cm^3, of a plate run in one of its moving phases.

    Parameters
    ----------
    run : Run
    phase : str
        approach, stroke or lift.

    Returns
    -------
    alpha_z, alpha_x : float
    """
    beta, gamma = run.beta_deg or 0.0, run.gamma_deg or 0.0
    if phase == "approach":
        return table_s5(run.published, beta, 90.0)
    if phase == "lift":
        return pull_alpha(run.published, beta, 90.0)
    if run.direction == "extraction":
        return pull_alpha(run.published, beta, gamma)
    return table_s5(run.published, beta, gamma)


def submerged_depth(depth_cm: FloatArray, half_z_cm: float) -> FloatArray:
    """Mean depth of the submerged part of a plate times its share of the plate, cm.

    Parameters
    ----------
    depth_cm : numpy.ndarray
        Of the plate's centre.
    half_z_cm : float
        Half the vertical extent of the plate.

    Returns
    -------
    numpy.ndarray
        `depth_cm` itself where the plate is wholly submerged, 0 where it is wholly in air. Where it
        is partly submerged the bed is free to heave, so the force is somewhat smaller still.
    """
    wet = np.clip((depth_cm + half_z_cm) / (2 * half_z_cm), 0.0, 1.0)
    partly = half_z_cm * wet**2 * (1 - 0.25 * (1 - wet) ** 2)
    return np.where(depth_cm >= half_z_cm, depth_cm, partly)


def near_walls(
    config: Config, x_cm: FloatArray, depth_cm: FloatArray, beta_deg: float
) -> FloatArray:
    """Factor by which walls and bottom within 6 cm of the plate raise the force.

    Parameters
    ----------
    config : Config
    x_cm, depth_cm : numpy.ndarray
        Of the plate's centre.
    beta_deg : float

    Returns
    -------
    numpy.ndarray
        1 where walls and bottom are farther away.
    """
    half_x, half_z = half_extents(plate_of(config)[1], beta_deg)
    factor = np.ones_like(depth_cm)
    for clearance in (
        config.container.depth_cm - depth_cm - half_z,
        config.container.length_cm / 2 - np.abs(x_cm) - half_x,
    ):
        factor *= 1 + 0.3 * np.clip(1 - clearance / CLEARANCE_CM, 0.0, 1.0) ** 2
    return factor


def plate_law(run: Run, config: Config, bed: tuple[float, float] = (0.0, 0.0)) -> Law:
    """Force on the plate of a laboratory run: alpha of Table S5 times depth times area.

    Parameters
    ----------
    run : Run
    config : Config
    bed : (float, float)
        What alpha_z and alpha_x of this run's bed are off by, N/cm^3.

    Returns
    -------
    Law
    """
    plate: Plate = plate_of(config)[1]
    beta = run.beta_deg or 0.0
    _, half_z = half_extents(plate, beta)

    def law(part: Segment, x_cm: FloatArray, z_cm: FloatArray, _: FloatArray) -> Forces:
        alpha_z, alpha_x = (a + b for a, b in zip(alpha_of(run, part.phase), bed, strict=True))
        load = plate.area_cm2 * submerged_depth(-z_cm, half_z)
        if run.direction == "horizontal" and part.phase == "stroke":
            # the published value IS the mean over the steady part, so no wall factor here
            load = load * (1 + _STICK_SLIP * np.sin(2 * np.pi * x_cm / _STICK_SLIP_CM))
        else:
            load = load * near_walls(config, x_cm, -z_cm, beta)
        return alpha_z * load, alpha_x * load

    return law


def scaled_law(law: Law, factor: float) -> Law:
    """Multiply a law by a number: the same force in a bed that is denser as a whole.

    Parameters
    ----------
    law : Law
    factor : float

    Returns
    -------
    Law
    """

    def scaled(part: Segment, x: FloatArray, z: FloatArray, angle: FloatArray) -> Forces:
        force_z, force_x = law(part, x, z, angle)
        return factor * force_z, factor * force_x

    return scaled


def push_alpha(run: Run) -> float:
    """alpha_z of a level plate pushed straight down into the medium of a run, N/cm^3.

    Parameters
    ----------
    run : Run

    Returns
    -------
    float
        Table S5; of a natural sand, the first centimetre of Fig. S11.
    """
    if run.natural:
        return float(sand_stress(run.published, np.array([1.0]))[0])
    return table_s5(run.published, 0.0, 90.0)[0]


def granular_law(run: Run, config: Config, bed: tuple[float, float] = (0.0, 0.0)) -> Law | None:
    """Force of the medium on the intruder of any run; None where there is no intruder in a medium.

    Parameters
    ----------
    run : Run
    config : Config
    bed : (float, float)
        What alpha_z and alpha_x of this run's bed are off by, N/cm^3. Published curves (legs,
        natural sands) are multiplied by what that makes of a straight push.

    Returns
    -------
    Law or None
    """
    if run.kind == "plate" and not run.natural:
        return plate_law(run, config, bed)
    if run.kind not in ("leg", "plate"):
        return None
    law = leg_law(run) if run.kind == "leg" else sand_law(run, config)
    return scaled_law(law, 1 + bed[0] / push_alpha(run)) if bed[0] else law
