"""Where along a stroke the stress is proportional to depth, and therefore fitted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.rows import Why

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.campaign.config import AnyPlate, Container, Fit
    from rftfit.conventions import FloatArray


def half_extent(plate: AnyPlate, beta: float) -> tuple[float, float]:
    """Half the size of a plate along x and z when it is held at `beta`.

    Parameters
    ----------
    plate : Plate, Disc or FlatOutline
    beta : float
        rad.

    Returns
    -------
    half_x, half_z : float
        cm.
    """
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    cosine, sine = abs(math.cos(beta)), abs(math.sin(beta))
    return length * cosine + thickness * sine, length * sine + thickness * cosine


def slanted_window(
    depth: FloatArray, x: FloatArray, plate: AnyPlate, beta: float, container: Container, fit: Fit
) -> npt.NDArray[np.int8]:
    """Tell for each sample of a slanted stroke why it is not fitted, design section 2.

    Parameters
    ----------
    depth, x : numpy.ndarray, shape (n,)
        Of the plate's centre, cm; x = 0 in the middle of the container.
    plate : Plate, Disc or FlatOutline
    beta : float
        rad.
    container : Container
    fit : Fit
        Clearance, and overrides of both ends of the window.

    Returns
    -------
    numpy.ndarray of int8, shape (n,)
        `Why`; GOOD where the sample is fitted.
    """
    half_x, half_z = half_extent(plate, beta)
    shallowest = half_z if fit.submergence_cm is None else fit.submergence_cm
    deepest = container.depth_cm - fit.wall_clearance_cm - half_z
    if fit.max_depth_cm is not None:
        deepest = fit.max_depth_cm
    widest = container.length_cm / 2 - fit.wall_clearance_cm - half_x
    # the outermost reason is tested last, so that it wins
    reason = np.full(depth.size, Why.GOOD, dtype=np.int8)
    reason[np.abs(x) > widest] = Why.WALL
    reason[depth > deepest] = Why.BOTTOM
    reason[depth < shallowest] = Why.ABOVE
    return reason


def horizontal_window(
    travel: FloatArray, x: FloatArray, plate: AnyPlate, beta: float, container: Container, fit: Fit
) -> npt.NDArray[np.int8]:
    """Tell for each sample of a horizontal stroke why it is not averaged.

    Parameters
    ----------
    travel : numpy.ndarray, shape (n,)
        Length of the path so far, cm.
    x : numpy.ndarray, shape (n,)
        cm.
    plate : Plate, Disc or FlatOutline
    beta : float
        rad.
    container : Container
    fit : Fit

    Returns
    -------
    numpy.ndarray of int8, shape (n,)
        `Why`; GOOD where the sample is averaged.
    """
    half_x, _ = half_extent(plate, beta)
    reason = np.full(travel.size, Why.GOOD, dtype=np.int8)
    reason[np.abs(x) > container.length_cm / 2 - fit.wall_clearance_cm - half_x] = Why.WALL
    reason[travel < fit.horizontal_skip_cm] = Why.STARTUP
    return reason


def linear_window(depth: FloatArray, linear_to_cm: float) -> npt.NDArray[np.int8]:
    """Tell for each sample of a natural sand's penetration test why it is not fitted.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        cm.
    linear_to_cm : float
        End of the linear regime.

    Returns
    -------
    numpy.ndarray of int8, shape (n,)
        `Why`; GOOD where the sample is fitted.
    """
    reason = np.full(depth.size, Why.GOOD, dtype=np.int8)
    reason[depth > linear_to_cm] = Why.NONLINEAR
    reason[depth < 0] = Why.ABOVE
    return reason
