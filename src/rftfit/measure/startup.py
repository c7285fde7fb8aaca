"""What the start-up of a horizontal run has left inside the window that is averaged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.conventions import FloatArray

_LEAST = 8
_SLOWEST = 0.5


def unfinished_start(
    path: FloatArray, stress: FloatArray, steady: npt.NDArray[np.bool_], skip_cm: float
) -> FloatArray:
    """Estimate by how much the start-up still moves the mean over the steady part.

    The force of a horizontal run approaches its steady value gradually, so that leaving out a fixed
    length never leaves out all of it. How far the second and the last third of that length lie from
    the steady mean shows how fast it dies away, and so what remains: with d2 and d3 and q = d3 / d2,
    an exponential leaves d3 q / (1 - q) times a third of the skipped length. The first third also
    knows what the pause before has left, and is not used. The mean is not corrected (the published
    values are plain means); the interval is widened by what is left.

    Parameters
    ----------
    path : numpy.ndarray, shape (n,)
        Length travelled, cm.
    stress : numpy.ndarray, shape (k, n)
        N/cm^2; NaN where not known.
    steady : numpy.ndarray of bool, shape (n,)
        Samples that are averaged.
    skip_cm : float
        Length left out at the start of the stroke.

    Returns
    -------
    numpy.ndarray, shape (k,)
        Mean over the steady part less the steady value, N/cm^2; 0 where fewer than 8 samples in
        either third tell nothing.
    """
    third = skip_cm / 3
    known = np.isfinite(stress).all(axis=0)
    second = known & (path >= third) & (path < 2 * third)
    last = known & (path >= 2 * third) & (path < skip_cm)
    nothing = np.zeros(stress.shape[0])
    if min(np.count_nonzero(part) for part in (second, last, steady)) < _LEAST:
        return nothing
    length = float(np.ptp(path[steady]))
    mean = stress[:, steady].mean(axis=1)
    early, late = (stress[:, part].mean(axis=1) - mean for part in (second, last))
    # noise must not pass for a start-up that never ends
    share = np.clip(np.divide(late, early, out=nothing, where=early != 0), 0, _SLOWEST)
    left: FloatArray = late * share / (1 - share) * third / length
    return left
