"""The search over all lags between two logs for the one at which the force follows the depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.clock import ClockError
from rftfit.measure.smooth import contact_depth, smooth_basis

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray

_KNOTS = 8
_READINGS = 300
_LAGS = 1500
_FINEST_S = 0.05
_BARRIER = 2.0
_RIVAL = 2.0


@dataclass(frozen=True)
class Profile:
    """How much of the force no smooth function of depth explains, over lags.

    Parameters
    ----------
    lag : numpy.ndarray, shape (m,)
        Motion clock minus force clock, s, increasing.
    unexplained : numpy.ndarray, shape (m,)
        Share of the force's variance, 0 to 1.
    """

    lag: FloatArray
    unexplained: FloatArray

    @property
    def best(self) -> int:
        """Place of the smallest unexplained share."""
        return int(np.argmin(self.unexplained))

    def rivals(self) -> list[float]:
        """Find other lags that do about as well as the best, with worse ones in between.

        Returns
        -------
        list of float
            s; at most three, the best of each valley.
        """
        lowest = float(self.unexplained[self.best])
        others = self.unexplained.copy()
        others[self._valley(self.best)] = np.inf
        found: list[float] = []
        while len(found) < 3:
            second = int(np.argmin(others))
            if not others[second] < _RIVAL * lowest + 1e-3:
                break
            found.append(float(self.lag[second]))
            others[self._valley(second)] = np.inf
        return found

    def _valley(self, place: int) -> slice:
        """Lags around a place up to the nearest clearly worse ones."""
        high = self.unexplained > _BARRIER * self.unexplained[place] + 1e-4
        left, right = np.flatnonzero(high[:place]), np.flatnonzero(high[place:])
        return slice(
            int(left[-1]) if left.size else 0, place + int(right[0]) if right.size else high.size
        )


def search_lags(
    time: FloatArray,
    force: FloatArray,
    motion_time: FloatArray,
    depth: FloatArray,
    starts: Sequence[float],
) -> Profile:
    """Try every lag at which the logs overlap by half of the shorter.

    Parameters
    ----------
    time, force : numpy.ndarray, shape (n,)
        Readings of the push: s, N.
    motion_time, depth : numpy.ndarray, shape (m,)
        s, cm.
    starts : sequence of float
        Offsets that lags are counted from, s.

    Returns
    -------
    Profile

    Raises
    ------
    ClockError
        If there is no lag to try.
    """
    lag = _lags(time, motion_time, starts)
    every = -(-time.size // _READINGS)
    count = time.size // every
    # means of neighbours: the search needs no more readings than the function has bends
    time = time[: count * every].reshape(count, every).mean(axis=1)
    force = force[: count * every].reshape(count, every).mean(axis=1)
    total = float(((force - force.mean()) ** 2).sum())
    share = np.ones(lag.size)
    for place, offset in enumerate(lag):
        there = np.interp(time + offset, motion_time, depth)
        contact = contact_depth(there, force)
        # in air the force says nothing, and bends of the function would be lost on it
        there = np.maximum(there, contact - 0.1 * (there.max() - contact))
        if np.ptp(there) <= 0:
            continue
        basis = smooth_basis(there, _KNOTS)
        # a trace of ridge, as not every basis function is visited at every lag
        normal = basis.T @ basis + 1e-9 * np.eye(basis.shape[1])
        moment = basis.T @ force
        explained = float(moment @ np.linalg.solve(normal, moment))
        share[place] = min(max((float(force @ force) - explained) / total, 0.0), 1.0)
    return Profile(lag, share)


def _lags(time: FloatArray, motion_time: FloatArray, starts: Sequence[float]) -> FloatArray:
    half = min(np.ptp(time), np.ptp(motion_time)) / 2
    first = motion_time[0] - time[-1] + half
    last = motion_time[-1] - time[0] - half
    step = max(_FINEST_S, (last - first) / _LAGS)
    # counted from the given offsets, so that an offset of exactly some hours is among them
    near = min(starts, key=lambda start: abs(start - (first + last) / 2))
    low, high = int(np.ceil((first - near) / step)), int(np.floor((last - near) / step))
    if high < low:
        raise ClockError("force and motion log do not overlap at any offset")
    lags: FloatArray = near + step * np.arange(low, high + 1)
    return lags
