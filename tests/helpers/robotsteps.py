"""The compiled stepper as a function of a state."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.robot import kernel

if TYPE_CHECKING:
    from rftfit.model.profiles import Profile
    from rftfit.robot.body import Parts

NOTHING = np.empty((0, 0))


def step(
    profile: Profile, parts: Parts, state: np.ndarray, turn: float, rate: float, step_s: float,
    steps: int, rk4: bool = False, every: int = 0, samples: np.ndarray = NOTHING,
) -> np.ndarray:  # fmt: skip
    """State after some steps."""
    state = np.array(state, dtype=float)
    kernel.advance(
        profile.pack, parts.shape, parts.groups, parts.turns, parts.places, parts.inertia, state,
        turn, rate, step_s, steps, rk4, every, samples,
    )  # fmt: skip
    return state
