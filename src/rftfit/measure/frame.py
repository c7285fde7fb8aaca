"""From the sensor's own channels to the lab frame (docs/architecture.md)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.campaign.config import Transducer
    from rftfit.conventions import FloatArray


def sensor_to_lab(transducer: Transducer) -> FloatArray:
    """Matrix that turns the channels (F1, F2, F3) into the lab's (force_x, force_z).

    Parameters
    ----------
    transducer : Transducer
        Its signed axes say which channel lies along which mount axis; the mount is turned by
        ``turn_deg`` about y, from z toward x.

    Returns
    -------
    numpy.ndarray, shape (2, 3)
    """
    mount = np.zeros((3, 3))
    for row, channel in enumerate((transducer.axes.x, transducer.axes.y, transducer.axes.z)):
        mount[row, int(channel[2]) - 1] = 1.0 if channel[0] == "+" else -1.0
    turn = math.radians(transducer.turn_deg)
    about_y = np.array(
        [[math.cos(turn), 0.0, math.sin(turn)], [-math.sin(turn), 0.0, math.cos(turn)]]
    )
    return np.asarray(about_y @ mount)
