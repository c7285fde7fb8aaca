"""The free surface found from force and depth, and how far the machine yields."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.slopes import student_quantile, weighted_sum_variance

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray


# --- The free surface found from force and depth: where the force leaves zero and grows from there.


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

    `depth_cm`: On the depth axis that was given: to be subtracted from it.
    `se_cm`: Standard error.
    `dof`: Degrees of freedom of `se_cm`.
    `growth_N_per_cm`: Slope of the force just below the surface.
    `air_N`: Force in air, next to the surface.
    `depth`, `force`, `fitted`: shape (n,); Readings of the window: cm, N, and the model's force,
        N.
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

        `confidence`: Between 0 and 1. Returns `lo`, `hi`: cm.
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

    `depth`: shape (n,); From any zero, growing downward, in the order of recording, cm. `force`:
    shape (n,); Lift, N; any constant may be in it. `window_cm`: How far above and below the
    surface readings are used. `noise_N`: Standard deviation of one reading by the transducer's own
    statement; what the readings in air show counts where it is larger. `depth_sd`: Standard error
    of the depth next to the surface (of the clocks), cm. `toe_cm`: Half the thickness of the
    plate: as long as it is partly in air the force is not yet that of its depth, so readings this
    near to the surface are passed over.
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


# --- How far the machine itself yields under load, from a push against something rigid.


_BINS = 20
_MIN_READINGS = 30
_COMPLIANCE_RISE_TO_NOISE = 20.0


class ComplianceError(ValueError):
    """A push against something rigid that shows no yielding; the message says why."""


@dataclass(frozen=True)
class Compliance:
    """Travel that the machine swallows, as a curve over the lift; it never extrapolates.

    `force`: shape (k,); N, increasing from 0.
    `travel`: shape (k,); cm, 0 at no force, never falling.
    """

    force: FloatArray
    travel: FloatArray

    def at(self, force: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Travel at other forces.

        `force`: shape (n,); Lift, N; a pull counts as none. Returns `travel` of shape (n,): cm;
        that at the largest known force where the force is larger still. Returns `known` of shape
        (n,): False beyond the largest known force.
        """
        return np.interp(force, self.force, self.travel), force <= self.force[-1]

    def mean_cm_per_N(self) -> float:
        """Return travel over force at the largest known force.

        Returns cm/N.
        """
        return float(self.travel[-1] / self.force[-1])


def compliance_of(depth: FloatArray, force: FloatArray, noise_N: float) -> Compliance:
    """Take the yielding of the machine from a push against something rigid.

    `depth`: shape (n,); From any zero, growing downward, in the order of recording, cm. `force`:
    shape (n,); Lift, N; the recording must begin out of contact. `noise_N`: Standard deviation of
    one reading.
    """
    if force.size < _MIN_READINGS:
        raise ComplianceError(f"{force.size} readings are too few; {_MIN_READINGS} at least")
    lift = force - float(np.median(force[: max(8, force.size // 20)]))
    peak = int(np.argmax(lift))
    depth, lift = depth[: peak + 1], lift[: peak + 1]
    if lift[-1] < _COMPLIANCE_RISE_TO_NOISE * noise_N:
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
