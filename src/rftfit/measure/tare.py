"""Tare: the force of rod and mount (or of a leg in air) as an object with a valid range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray


NO_TARE_FLAG = "no tare subtracted: force on rod and mount is in it"


class TareError(ValueError):
    """A tare is asked for what it does not know."""


@dataclass(frozen=True)
class Tare:
    """Force to be subtracted at equal position; it never extrapolates.

    `run_id`: The rod-only or in-air run it comes from.
    `abscissa`: What equal position means: ``depth_cm``, ``path_cm`` (horizontal runs) or
        ``angle_deg``.
    `position`: shape (n,); Increasing, unit of the abscissa.
    `force`: shape (2, n); z, x; N.
    `longest_step`: A wider step between positions is a hole, not to be bridged.
    """

    run_id: str
    abscissa: str
    position: FloatArray
    force: FloatArray
    longest_step: float

    @classmethod
    def from_samples(
        cls, run_id: str, abscissa: str, position: FloatArray, force: FloatArray
    ) -> Tare:
        """Make a tare from the samples of a stroke.

        `position`: shape (n,); In the order of recording. `force`: shape (2, n); z, x; N.
        """
        if position.size < 2:
            raise TareError(f"tare {run_id}: {position.size} samples are no tare")
        order = np.argsort(position, kind="stable")
        position = position[order]
        # ten ordinary steps: wider than any jitter, narrower than any hole worth the name
        typical = (position[-1] - position[0]) / (position.size - 1)
        return cls(run_id, abscissa, position, force[:, order], 10 * float(typical))

    @property
    def valid_from(self) -> float:
        """Smallest position the tare knows."""
        return float(self.position[0])

    @property
    def valid_to(self) -> float:
        """Largest position the tare knows."""
        return float(self.position[-1])

    def covers(self, position: FloatArray) -> np.ndarray:
        """Tell at which positions the tare is known.

        `position`: shape (m,); Unit of the abscissa. Returns shape (m,): False outside the valid
        range and inside holes of the tare's own log.
        """
        inside = (position >= self.valid_from) & (position <= self.valid_to)
        after = np.clip(np.searchsorted(self.position, position), 1, self.position.size - 1)
        step = self.position[after] - self.position[after - 1]
        return np.asarray(inside & (step <= self.longest_step))

    def at(self, position: FloatArray) -> FloatArray:
        """Force of the tare, linear between its samples.

        `position`: shape (m,); Unit of the abscissa. Returns shape (2, m): z, x; N.
        """
        known = self.covers(position)
        if not known.all():
            beyond = position[~known]
            raise TareError(
                f"tare {self.run_id} is known from {self.valid_from:.3f} to {self.valid_to:.3f} "
                f"{self.abscissa}; asked for {beyond.min():.3f} to {beyond.max():.3f}"
            )
        return np.stack([np.interp(position, self.position, part) for part in self.force])


def subtract(
    position: FloatArray, force: FloatArray, tare: Tare
) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Subtract a tare at equal position, where it is known.

    `position`: shape (n,); Unit of the tare's abscissa. `force`: shape (2, n); z, x; N. Returns
    `granular` of shape (2, n): N; NaN where the tare is not known. Returns `tare_force` of shape
    (2, n): N; NaN likewise. Returns `known` of shape (n,).
    """
    known = tare.covers(position)
    tare_force = np.full(force.shape, np.nan)
    if known.any():
        tare_force[:, known] = tare.at(position[known])
    return force - tare_force, tare_force, known
