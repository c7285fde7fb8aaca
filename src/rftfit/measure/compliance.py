"""How far the machine itself yields under load, from a push against something rigid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

_BINS = 20
_MIN_READINGS = 30
_RISE_TO_NOISE = 20.0


class ComplianceError(ValueError):
    """A push against something rigid that shows no yielding; the message says why."""


@dataclass(frozen=True)
class Compliance:
    """Travel that the machine swallows, as a curve over the lift; it never extrapolates.

    Parameters
    ----------
    force : numpy.ndarray, shape (k,)
        N, increasing from 0.
    travel : numpy.ndarray, shape (k,)
        cm, 0 at no force, never falling.
    """

    force: FloatArray
    travel: FloatArray

    def at(self, force: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Travel at other forces.

        Parameters
        ----------
        force : numpy.ndarray, shape (n,)
            Lift, N; a pull counts as none.

        Returns
        -------
        travel : numpy.ndarray, shape (n,)
            cm; that at the largest known force where the force is larger still.
        known : numpy.ndarray of bool, shape (n,)
            False beyond the largest known force.
        """
        return np.interp(force, self.force, self.travel), force <= self.force[-1]

    def mean_cm_per_N(self) -> float:
        """Return travel over force at the largest known force.

        Returns
        -------
        float
            cm/N.
        """
        return float(self.travel[-1] / self.force[-1])


def compliance_of(depth: FloatArray, force: FloatArray, noise_N: float) -> Compliance:
    """Take the yielding of the machine from a push against something rigid.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        From any zero, growing downward, in the order of recording, cm.
    force : numpy.ndarray, shape (n,)
        Lift, N; the recording must begin out of contact.
    noise_N : float
        Standard deviation of one reading.

    Returns
    -------
    Compliance

    Raises
    ------
    ComplianceError
        If the force never rises, or too few readings lie in contact.
    """
    if force.size < _MIN_READINGS:
        raise ComplianceError(f"{force.size} readings are too few; {_MIN_READINGS} at least")
    lift = force - float(np.median(force[: max(8, force.size // 20)]))
    peak = int(np.argmax(lift))
    depth, lift = depth[: peak + 1], lift[: peak + 1]
    if lift[-1] < _RISE_TO_NOISE * noise_N:
        raise ComplianceError(
            f"the force rises by {lift[-1]:.2f} N only, with a noise of {noise_N:g} N: no contact"
        )
    free = np.flatnonzero(lift < 5 * noise_N)
    touching = slice(int(free[-1]) + 1, None) if free.size else slice(0, None)
    depth, lift = depth[touching], lift[touching]
    if lift.size < _MIN_READINGS:
        raise ComplianceError(
            f"{lift.size} readings in contact are too few; {_MIN_READINGS} at least"
        )
    edges = np.linspace(0, lift[-1], _BINS + 1)
    place = np.clip(np.digitize(lift, edges) - 1, 0, _BINS - 1)
    filled = np.unique(place)
    levels = np.array([lift[place == one].mean() for one in filled])
    means = np.array([depth[place == one].mean() for one in filled])
    # contact begins where the first two levels point to; from there the travel never falls
    slope = (means[1] - means[0]) / (levels[1] - levels[0]) if levels.size > 1 else 0.0
    start = means[0] - max(slope, 0.0) * levels[0]
    travel = np.maximum.accumulate(np.maximum(means - start, 0.0))
    rest = lift[-1] - levels[-1]
    if rest > 0 and levels.size > 1:
        # from the middle of the last level to its end, as steep as between the last two
        steep = (travel[-1] - travel[-2]) / (levels[-1] - levels[-2])
        levels, travel = np.append(levels, lift[-1]), np.append(travel, travel[-1] + rest * steep)
    return Compliance(np.append(0.0, levels), np.append(0.0, travel))
