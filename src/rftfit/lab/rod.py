"""The rod that holds the plate, and the mount above it: their own force in the medium."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.lab.curves import sand_stress
from rftfit.lab.truth import table_s5

if TYPE_CHECKING:
    from rftfit.lab.contact import Forces, Law
    from rftfit.lab.path import FloatArray, Segment
    from rftfit.lab.plan import Run

_ALPHA_OF_STRENGTH_ONE = 0.35
_MOUNT_FROM_CM = 3.0


def strength(run: Run) -> float:
    """Strength of a medium relative to loose poppy seeds: its vertical alpha of a level plate.

    Parameters
    ----------
    run : Run

    Returns
    -------
    float
    """
    if run.natural:
        alpha = float(sand_stress(run.published, np.array([2.0]))[0]) / 2.0
    else:
        alpha, _ = table_s5(run.published, 0.0, 90.0)
    return alpha / _ALPHA_OF_STRENGTH_ONE


def rod_law(run: Run) -> Law:
    """Force of the medium on rod and mount, the same in a plate run and in its rod-only run.

    A thin rod feels a force that grows with the square of the depth; from 3 cm on the mount is in
    the medium too. The force opposes the motion; a level move meets more of the rod than a steep
    one, a pull meets less than a push, and a tilted mount is pushed a little sideways.

    Parameters
    ----------
    run : Run
        A plate or rod run.

    Returns
    -------
    Law
    """
    size = strength(run)
    beta = math.radians(run.beta_deg or 0.0)

    def law(part: Segment, _x: FloatArray, z_cm: FloatArray, _angle: FloatArray) -> Forces:
        vx, vz = (
            (last - first) / part.distance
            for first, last in zip(part.start[:2], part.end[:2], strict=True)
        )
        depth = np.maximum(-z_cm, 0.0)
        mount = np.maximum(depth - _MOUNT_FROM_CM, 0.0)
        load = size * (0.007 * depth**2 + 0.009 * mount**2) * (1 + 0.06 * math.sin(beta) ** 2)
        if vz > 0:
            load = 0.55 * load
        force_z = -vz * load + 0.04 * math.cos(beta) * load
        force_x = -1.2 * vx * load + 0.06 * math.sin(beta) * load
        return force_z, force_x

    return law
