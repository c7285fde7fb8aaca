"""Pushes into sand on two clocks, from a known truth, for tests of clocks and surface."""

from dataclasses import dataclass

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.measure.alignment import estimate_clocks


@dataclass(frozen=True)
class Push:
    """What the two logs hold, and the truth: motion time = force time + offset + drift x (t - t0)."""

    force_time: FloatArray
    force: FloatArray
    motion_time: FloatArray
    depth: FloatArray
    offset_s: float
    drift: float
    surface_cm: float

    def offset_at(self, time):
        """Return the true offset at a time of the force log."""
        return self.offset_s + self.drift * (time - float(self.force_time[0]))


def make_push(
    seed,
    *,
    offset_s=0.0,
    drift=0.0,
    stiffness=25.0,
    bend=0.0,
    by_hand=True,
    rate_Hz=100.0,
    noise_N=0.05,
    medium_N=0.3,
    memory_s=0.15,
    start_s=1.6e9,
):
    """Go down 3 cm in air and 4 cm into a medium; by hand, or at 1 cm/s with a pause at the surface."""
    random = np.random.default_rng(seed)
    fine = np.arange(0, 24, 0.002)
    if by_hand:
        pushes = np.interp(fine, np.arange(0, 26, 0.7), random.gamma(1.2, 1.0, 38))
        speed = np.where((fine > 2) & (fine < 20), pushes, 0.0)
        depth = np.cumsum(speed)
        depth = depth / depth[-1] * 7.0
    else:
        depth = np.interp(fine, [3, 6, 8, 12], [0.0, 3.0, 3.0, 7.0])
    surface = 3.0 + 0.1 * random.standard_normal() if by_hand else 3.0
    length = int(22 * rate_Hz)
    moments = 1.0 + np.arange(length) / rate_Hz
    # grains rearrange: their force has a memory, and grows with the force itself
    keep = np.exp(-1 / (rate_Hz * memory_s))
    grains = np.zeros(length)
    kicks = random.standard_normal(length) * np.sqrt(1 - keep**2)
    for index in range(1, length):
        grains[index] = keep * grains[index - 1] + kicks[index]
    under = np.maximum(np.interp(moments, fine, depth) - surface, 0.0)
    lift = stiffness * under + bend * under**2
    force = (
        lift
        + medium_N * grains * np.minimum(under, 1.0)
        + noise_N * random.standard_normal(length)
        - 1.5
    )
    rows = np.arange(0.0, 24.0, 0.019) + random.uniform(0, 0.003, 1264)
    motion = np.interp(rows, fine, depth) + 0.0005 * random.standard_normal(rows.size)
    shift = start_s + offset_s + drift * (rows - moments[0])
    return Push(
        start_s + moments,
        np.round(force, 4),
        rows + shift,
        np.round(motion, 4),
        offset_s,
        drift,
        surface,
    )


def estimate(push, max_se_s=0.2, max_drift=1e-3):
    """Align the two clocks of a push by its force."""
    return estimate_clocks(
        push.force_time, push.force, push.motion_time, push.depth, max_drift, max_se_s
    )
