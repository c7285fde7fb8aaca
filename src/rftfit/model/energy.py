"""Energy that a medium takes from a plate that moves through it: no medium gives any back.

Alpha at n nodes is an array (..., 2, n), z then x, N/cm^3. A plate that moves in the direction gamma goes down by sin
gamma and toward -x by cos gamma of its way, against alpha_z up and alpha_x toward +x.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.observations import Angles
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "energy")


def work(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the energy that a medium takes, per area, depth and distance moved, N/cm^3, shape (..., n).

    `alpha`: shape (..., 2, n). `gamma`: shape (n,), rad.
    """
    return alpha[..., 0, :] * np.sin(gamma) + alpha[..., 1, :] * np.cos(gamma)


def takes_energy(
    alpha: FloatArray, gamma: FloatArray, largest: FloatArray, is_pushed: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Return True for media that take energy in every direction that was not pushed, shape (draws,).

    A share `least_work` of `largest` (chosen.toml) may be given back and still counts as taking energy: rounding, and
    the interpolation between nodes. `alpha`: of the media, shape (draws, 2, n). `largest` (draws,): largest alpha of
    each medium, by which rounding is judged. `is_pushed` (n,): True for directions that were pushed, whose alpha has
    the error of a measurement.
    """
    takes = (work(alpha, gamma) >= -_CHOSEN.least_work * largest[:, None]) | is_pushed
    return np.asarray(takes.all(axis=-1))


def mean_effort(alpha: FloatArray, nodes: Angles) -> FloatArray:
    """Return the effort of media: the mean of `work` over n nodes of the published grid over alpha_z(0, 90 deg), (draws,).

    `alpha`: shape (draws, 2, n). `nodes`: beta and gamma, rad. The effort is infinite if a medium does not resist a
    plate that is pushed straight down.
    """
    down = np.argmin(np.abs(nodes[0]) + np.abs(nodes[1] - np.pi / 2))
    alpha_z_down = alpha[:, 0, down]
    resists = alpha_z_down > 0
    effort = work(alpha, nodes[1]).mean(axis=-1) / np.where(resists, alpha_z_down, 1.0)
    return np.where(resists, effort, np.inf)
