"""Media that nobody tuned on: 3D-RFT (Agarwal, Goldman and Kamrin 2023) of a plate in the plane of its motion."""

from __future__ import annotations

from functools import partial
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING
from unittest import mock

import numpy as np

from rftfit.lab import truth

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    Truth = Callable[[str, float, float], tuple[float, float]]
    """alpha_z and alpha_x, N/cm^3, of a medium at beta and gamma, deg."""

_COEFFICIENTS = np.array([
    [0.00212, -0.02320, -0.20890, -0.43083, -0.00259, 0.48872, -0.00415, 0.07204, -0.02750, -0.08772,
     0.01992, -0.45961, 0.40799, -0.10107, -0.06576, 0.05664, -0.09269, 0.01892, 0.01033, 0.15120],
    [-0.06796, -0.10941, 0.04725, -0.06914, -0.05835, -0.65880, -0.11985, -0.25739, -0.26834, 0.02692,
     -0.00736, 0.63758, 0.08997, 0.21069, 0.04748, 0.20406, 0.18589, 0.04934, 0.13527, -0.33207],
    [-0.02634, -0.03436, 0.45256, 0.00835, 0.02553, -1.31290, -0.05532, 0.06790, -0.16404, 0.02287,
     0.02927, 0.95406, -0.00131, -0.11028, 0.01487, -0.02730, 0.10911, -0.04097, 0.07881, -0.27519],
])  # fmt: skip
_FACTORS = [(), (0,), (1,), (2,), (0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0), (0, 0, 0), (1, 1, 1),
            (2, 2, 2), (0, 1, 1), (1, 0, 0), (1, 2, 2), (2, 1, 1), (2, 0, 0), (0, 2, 2), (0, 1, 2)]  # fmt: skip
"""Which of v.g, m.g and m.v stand in each of the 20 terms."""
assert {tuple(sorted(one)) for one in _FACTORS} == {
    one for n in range(4) for one in combinations_with_replacement(range(3), n)
}


def law(normal: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Stress over depth on a face, x and z, where the size xi is 1; unit vectors of shape (2,)."""
    down = np.array([0.0, -1.0])
    turned = normal if normal @ down >= 0 else -normal
    x = (velocity @ down, turned @ down, turned @ velocity)
    f = _COEFFICIENTS @ [np.prod([x[k] for k in one]) for one in _FACTORS]
    return np.asarray(f[0] * turned + f[1] * velocity + f[2] * down)


def slice_3drft(
    friction: float, size: float, _: str, beta_deg: float, gamma_deg: float
) -> tuple[float, float]:
    """alpha_z and alpha_x of a plate, N/cm^3, along its face at most `friction` of what is across it."""
    beta, gamma = np.radians([beta_deg, gamma_deg])
    velocity = -np.array([np.cos(gamma), np.sin(gamma)])
    normal = np.array([np.sin(beta), np.cos(beta)])
    if normal @ velocity < 1e-9 and (normal @ velocity < -1e-9 or normal[1] > 0):
        normal = -normal
    stress = size * law(normal, velocity)
    # a medium does not pull at a face, nor drive it along
    across = -abs(stress @ normal) * normal
    along = stress - (stress @ normal) * normal
    along *= -1 if along @ velocity > 0 else 1
    most = friction * np.linalg.norm(across)
    along *= min(1.0, most / max(float(np.linalg.norm(along)), 1e-12))
    x, z = across + along
    return float(z), float(x)


SLICES: dict[str, Truth] = {
    "3D-RFT, friction 0.2": partial(slice_3drft, 0.2, 0.4),
    "3D-RFT, friction 0.8": partial(slice_3drft, 0.8, 0.9),
}


def lab_in(found: Truth) -> AbstractContextManager[object]:
    """Let the re-enacted lab push plates into this medium whatever published one is asked for."""
    return mock.patch.object(truth, "table_s5", found)
