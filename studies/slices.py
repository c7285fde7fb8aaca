"""Media that nobody tuned on: 3D-RFT (Agarwal, Goldman and Kamrin 2023) of a plate in the plane of its motion."""

from collections.abc import Callable
from functools import partial
from unittest import mock

import numpy as np

from rftfit.lab import truth
from rftfit.model.rft3d import alpha_3drft

Truth = Callable[[str, float, float], tuple[float, float]]
"""alpha_z and alpha_x, N/cm^3, of a medium at beta and gamma, deg."""


def slice_3drft(friction, size, _, beta_deg, gamma_deg):
    """alpha_z and alpha_x of a plate, N/cm^3, in the medium whose alpha_z(0, 90 deg) is `size`."""
    z, x = alpha_3drft(np.radians(beta_deg), np.radians(gamma_deg), friction)
    return size * float(z), size * float(x)


SLICES: dict[str, Truth] = {
    "3D-RFT, friction 0.2": partial(slice_3drft, 0.2, 0.35),
    "3D-RFT, friction 0.8": partial(slice_3drft, 0.8, 0.7875),
}


def lab_in(table_function):
    """Let the re-enacted lab push plates into this medium whatever published one is asked for."""
    return mock.patch.object(truth, "table_s5", table_function)
