"""The free surface found from force and depth: where the force leaves zero and grows from there.

Near the surface the lift is zero above it and k u + q u^2 at u below it, the zero-intercept growth
of Eq. 1 with a first bend. The depth of the change is found over a window; what two other windows
say, and the scatter of the readings, give its error. A force that never grows has no surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.autocorrelation import weighted_sum_variance
from rftfit.measure.slope import student_quantile

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

WINDOWS = (0.7, 1.0, 1.4)
"""Windows that are tried, relative to the one asked for; the middle one counts."""

_MIN_AIR = 8
_MIN_BELOW = 12
_RISE_TO_NOISE = 10.0
_T = 5.0
_PASSES = 5
_LARGEST_AIR = 0.15
_GRID = 120
_NOT_IN_AIR = (
    "surface not found: the force grows from the first reading on; the log must begin in air"
)


class SurfaceError(ValueError):
    """No free surface can be told from the force; the message says why."""


@dataclass(frozen=True)
class Surface:
    """The free surface as found.

    Parameters
    ----------
    depth_cm : float
        On the depth axis that was given: to be subtracted from it.
    se_cm : float
        Standard error.
    dof : float
        Degrees of freedom of `se_cm`.
    growth_N_per_cm : float
        Slope of the force just below the surface.
    air_N : float
        Force in air, next to the surface.
    depth, force, fitted : numpy.ndarray, shape (n,)
        Readings of the window: cm, N, and the model's force, N.
    """

    depth_cm: float
    se_cm: float
    dof: float
    growth_N_per_cm: float
    air_N: float
    depth: FloatArray
    force: FloatArray
    fitted: FloatArray

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of the surface.

        Parameters
        ----------
        confidence : float
            Between 0 and 1.

        Returns
        -------
        lo, hi : float
            cm.
        """
        half = float(student_quantile(confidence, self.dof)) * self.se_cm
        return self.depth_cm - half, self.depth_cm + half


def find_surface(
    depth: FloatArray,
    force: FloatArray,
    window_cm: float,
    noise_N: float,
    depth_sd: float = 0.0,
    toe_cm: float = 0.0,
) -> Surface:
    """Find the free surface on the way down.

    Parameters
    ----------
    depth : numpy.ndarray, shape (n,)
        From any zero, growing downward, in the order of recording, cm.
    force : numpy.ndarray, shape (n,)
        Lift, N; any constant may be in it.
    window_cm : float
        How far above and below the surface readings are used.
    noise_N : float
        Standard deviation of one reading by the transducer's own statement; what the readings in
        air show counts where it is larger.
    depth_sd : float, optional
        Standard error of the depth next to the surface (of the clocks), cm.
    toe_cm : float, optional
        Half the thickness of the plate: as long as it is partly in air the force is not yet that of
        its depth, so readings this near to the surface are passed over.

    Returns
    -------
    Surface

    Raises
    ------
    SurfaceError
        If the force never grows, or grows from the first reading on, or too few readings lie on
        either side.
    """
    deeper = depth >= np.maximum.accumulate(depth) - 0.02
    down = np.arange(depth.size) <= int(np.argmax(force))
    depth, force = depth[deeper & down], force[deeper & down]
    onset, noise = _onset(depth, force, noise_N)
    fits = [_fit(depth, force, onset, share * window_cm) for share in WINDOWS]
    if toe_cm > 0:
        for _ in range(_PASSES):
            fits = [
                None
                if fit is None
                else _fit(depth, force, onset, share * window_cm, fit[0], toe_cm)
                for share, fit in zip(WINDOWS, fits, strict=True)
            ]
    best = fits[1]
    if best is None:
        raise SurfaceError(
            f"surface not found: fewer than {_MIN_BELOW} readings within {window_cm:g} cm below the "
            f"depth at which the force begins, or {_MIN_AIR} above it"
        )
    place, se, dof, terms, part, fitted = best
    rise = float(fitted.max() - terms[0])
    if terms[1] <= 0 or rise < _RISE_TO_NOISE * noise or terms[1] < _T * terms[3]:
        raise SurfaceError(
            f"surface not found: below {place:.2f} cm the force grows by {rise:.2f} N within "
            f"{window_cm:g} cm, which its noise of {noise:.2f} N could do as well"
        )
    air = depth[part] < place
    if np.count_nonzero(air) < _MIN_AIR:
        raise SurfaceError(_NOT_IN_AIR)
    in_air = float(np.polyfit(depth[part][air], force[part][air], 1)[0])
    if in_air > _LARGEST_AIR * terms[1]:
        raise SurfaceError(
            f"surface not found: above {place:.2f} cm the force grows too, by {in_air:.1f} N/cm against "
            f"{terms[1]:.1f} N/cm below; the log must begin in air"
        )
    others = [fit[0] for fit in fits if fit is not None]
    spread = float(np.var(others, ddof=1)) if len(others) > 1 else 0.0
    return Surface(
        place, math.sqrt(se**2 + spread + depth_sd**2), dof, terms[1], terms[0],
        depth[part], force[part], fitted,
    )  # fmt: skip


def _onset(depth: FloatArray, force: FloatArray, noise_N: float) -> tuple[float, float]:
    """Depth from which on the force stays above its noise in air, and that noise."""
    if depth.size < _MIN_AIR + _MIN_BELOW:
        raise SurfaceError(f"surface not found: {depth.size} readings on the way down")
    quarter = force[: max(_MIN_AIR, depth.size // 10)]
    air = float(np.median(quarter))
    trend = np.polyval(np.polyfit(np.arange(quarter.size), quarter, 1), np.arange(quarter.size))
    noise = max(noise_N, 1.483 * float(np.median(np.abs(quarter - trend))))
    if force[-1] - air < _RISE_TO_NOISE * noise:
        raise SurfaceError(
            f"surface not found: the force grows by {force[-1] - air:.2f} N on the way down, with a "
            f"noise of {noise:.2f} N: the intruder met no ground"
        )
    quiet = np.flatnonzero(force < air + 4 * noise)
    if quiet.size < _MIN_AIR:
        raise SurfaceError(_NOT_IN_AIR)
    return float(depth[quiet[-1]]), noise


def _fit(
    depth: FloatArray,
    force: FloatArray,
    onset: float,
    window: float,
    near: float = 0.0,
    toe: float = 0.0,
) -> tuple[float, float, float, list[float], np.ndarray, FloatArray] | None:
    """Change point, its standard error and degrees of freedom, terms, readings used, fit.

    The terms are force in air, slope, bend, and the slope's standard error.
    """
    part = (depth > onset - window) & (depth < onset + window)
    if toe > 0:
        part &= np.abs(depth - near) > toe
    d, f = depth[part], force[part]
    if np.count_nonzero(d < onset) < _MIN_AIR or np.count_nonzero(d > onset) < _MIN_BELOW:
        return None
    # from well above the onset to a little below: there the force is above its noise already
    places = np.linspace(onset - 0.6 * window, onset + 0.1 * window + toe, _GRID)
    best = min(places, key=lambda place: _misfit(d, f, place))
    step = float(places[1] - places[0])
    fine = np.linspace(best - step, best + step, 41)
    place = float(min(fine, key=lambda p: _misfit(d, f, p)))
    design = _design(d, place)
    terms = np.linalg.lstsq(design, f, rcond=None)[0]
    fitted = design @ terms
    below = d > place
    gradient = np.where(below, -(terms[1] + 2 * terms[2] * (d - place)), 0.0)
    jacobian = np.column_stack([design, gradient])
    weights = np.linalg.pinv(jacobian)
    residual = f - fitted
    variance, dof = weighted_sum_variance(np.stack([residual, residual]), weights[3])
    of_slope, _ = weighted_sum_variance(residual[None], weights[1])
    slope_se = math.sqrt(float(of_slope[0]))
    return (
        place, math.sqrt(float(variance[0])), dof,
        [float(terms[0]), float(terms[1]), float(terms[2]), slope_se], part, fitted,
    )  # fmt: skip


def _design(depth: FloatArray, place: float) -> FloatArray:
    under = np.maximum(depth - place, 0.0)
    return np.column_stack([np.ones(depth.size), under, under**2])


def _misfit(depth: FloatArray, force: FloatArray, place: float) -> float:
    design = _design(depth, place)
    normal = design.T @ design + 1e-12 * np.eye(3)
    terms = np.linalg.solve(normal, design.T @ force)
    residual = force - design @ terms
    # a force that falls below the surface is no surface
    return float(residual @ residual) if terms[1] > 0 else math.inf
