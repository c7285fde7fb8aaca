"""Loads of the faces of a solid body: faces that lead bear the whole, those that move along themselves a half.

The alpha of a plate holds the stress on both of its faces. Of a solid body the face in front bears it all and the face
behind nothing. Where a body moves along two faces, as the sole and the top of a foot that is dragged level or the walls
of a block that sinks, each bears half: the two together bear what a plate does, and no rounding of an angle decides.
The rim of a wheel that is pushed along its axle moves along itself: its measured side forces are predicted with an
error of 4.2 N by this rule, and of 5.6 N without such faces (`tests/space/test_space_wheel.py`; 96 runs at seven slip
angles).
"""

from __future__ import annotations

import numpy as np

from rftfit.conventions import FloatArray

ALONG_ITSELF = 1e-4
"""Speed along the normal over the speed (0.006 deg) up to which a face moves along itself: no rig knows an angle better."""


def share_of_face(outward: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the share of the load of a plate that a face of a solid body bears: 1 in front, 0 behind, 0 at rest.

    Where the speed along the normal is at most `ALONG_ITSELF` of the whole speed, the share grows linearly from 0
    (inward) over a half (along itself) to 1 (outward): a jump would let rounding decide. `outward`: speed of the face
    along its outward normal, negative inward. `speed`: its whole speed, in the same unit.
    """
    moves = speed > 0
    relative = np.divide(outward, 2 * ALONG_ITSELF * speed, where=moves, out=np.zeros_like(speed))
    return np.where(moves, np.clip(0.5 + relative, 0.0, 1.0), 0.0)
