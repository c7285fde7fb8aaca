"""How a force builds up when the arm starts, and stays when it stops."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rftfit.lab.path import FloatArray, Motion, Segment

Forces = tuple[FloatArray, FloatArray]
"""Force (z, x) on the intruder in N, z up, x toward +x."""

Law = Callable[[Segment, FloatArray, FloatArray, FloatArray], Forces]
"""Fully developed force at places (x cm, z cm, angle deg) of one segment, arrays of shape (n,)."""

BUILD_UP = 0.02
"""Travel (cm; rad for a leg) within which a force is fully developed: within the speed ramp."""

START_UP_CM = 0.4
"""Decay length of the start-up of a horizontal run."""

_LET_GO_CM = 0.6
_KEPT, _RELAX_S = 0.9, 0.6


def felt(law: Law, parts: tuple[Segment, ...], motion: Motion, level: bool = False) -> Forces:
    """Force over a whole run: the law while moving, the last force (relaxing a little) at rest.

    Parameters
    ----------
    law : Law
    parts : tuple of Segment
    motion : Motion
        Of n samples.
    level : bool
        A horizontal run, whose stroke starts up over `START_UP_CM`.

    Returns
    -------
    force_z, force_x : numpy.ndarray, shape (n,)
        N. A medium prepared around a resting intruder exerts none before the first move.
    """
    force = np.zeros((2, motion.elapsed_s.size))
    last = np.zeros(2)
    began = 0.0
    for number, part in enumerate(parts):
        here = motion.segment == number
        if part.moving:
            travel = motion.travel[here]
            grown = _share(travel, BUILD_UP)
            given = grown
            if level and part.phase == "stroke":
                grown, given = 1 - np.exp(-travel / START_UP_CM), _share(travel, _LET_GO_CM)
            places = (motion.x_cm[here], motion.z_cm[here], motion.angle_deg[here])
            developed = np.array(law(part, *places))
            force[:, here] = grown * developed + (1 - given) * last[:, None]
            x, z, angle = (np.array([value]) for value in part.end)
            last = np.array(law(part, x, z, angle))[:, 0]
        else:
            age = motion.elapsed_s[here] - began
            force[:, here] = last[:, None] * (_KEPT + (1 - _KEPT) * np.exp(-age / _RELAX_S))
            last = _KEPT * last
        began += part.duration_s
    return force[0], force[1]


def _share(travel: FloatArray, length: float) -> FloatArray:
    """Grow smoothly from 0 to exactly 1 over `length`."""
    return 1 - np.clip(1 - travel / length, 0.0, 1.0) ** 2
