"""Forces on an outline with their intervals: the spread of a profile carried through the integral."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.cli.predict_sources import FurtherMedium

if TYPE_CHECKING:
    from rftfit.cli.predict_sources import Source
    from rftfit.conventions import FloatArray
    from rftfit.predict.forces import Forces
    from rftfit.predict.outline import Outline
    from rftfit.profile.base import Profile

QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")

_MOST_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Prediction:
    """Forces by pose, with intervals where the profile has a spread.

    Parameters
    ----------
    values : dict of str to numpy.ndarray, shape (p,)
        By name, see `QUANTITIES`.
    ends : dict of str to tuple of numpy.ndarray, shape (p,)
        Lower and upper end of the interval of each; empty if no error is known.
    reason : str
        Why there is NaN; empty if there is none.
    """

    values: dict[str, FloatArray]
    ends: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    reason: str = ""

    @property
    def unknown(self) -> int:
        """Number of poses with NaN."""
        return int(np.count_nonzero(np.isnan(np.stack(list(self.values.values()))).any(axis=0)))


def predict_forces(
    source: Source, outline: Outline, poses: FloatArray, confidence: float
) -> Prediction:
    """Integrate the forces over an outline in each pose, with intervals.

    Parameters
    ----------
    source : Source
    outline : Outline
    poses : numpy.ndarray, shape (p, 6)
        As for `rftfit.predict.forces.forces_on`.
    confidence : float

    Returns
    -------
    Prediction
        Intervals are pointwise, each pose for itself.
    """
    from rftfit.predict.forces import forces_on

    best = forces_on(source.profile, outline, poses)
    values = _named(best)
    if source.spread is None:
        return Prediction(values, reason=best.reason)
    if isinstance(source.spread, FurtherMedium):
        ends = _of_further_medium(source.spread, outline, poses, confidence)
    else:
        ends = _of_draws(source.spread, outline, poses, confidence)
    return Prediction(values, ends, best.reason)


def _of_further_medium(
    spread: FurtherMedium, outline: Outline, poses: FloatArray, confidence: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    from rftfit.predict.forces import force_draws, forces_on
    from rftfit.profile.new_medium import with_interval
    from rftfit.profile.nine_terms import FourierProfile

    unit = _named(forces_on(FourierProfile(spread.reference.m0), outline, poses))
    each = _named(force_draws(FourierProfile(spread.reference.scaled), outline, poses))
    return {
        name: with_interval(spread.scaled, unit[name], each[name], confidence)[1:]
        for name in QUANTITIES
    }


def _of_draws(
    spread: Profile, outline: Outline, poses: FloatArray, confidence: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    from rftfit.predict.forces import force_draws
    from rftfit.profile.bootstrap import interval

    # a long path with every draw of every pose at once would not fit into the memory
    step = max(1, _MOST_AT_ONCE // spread.parameters[0].shape[0])
    parts: dict[str, list[tuple[FloatArray, FloatArray]]] = {name: [] for name in QUANTITIES}
    for start in range(0, len(poses), step):
        many = _named(force_draws(spread, outline, poses[start : start + step]))
        for name in QUANTITIES:
            parts[name].append(interval(many[name], confidence))
    return {
        name: (np.concatenate([lo for lo, _ in part]), np.concatenate([hi for _, hi in part]))
        for name, part in parts.items()
    }


def _named(forces: Forces) -> dict[str, FloatArray]:
    return {name: getattr(forces, name) for name in QUANTITIES}
