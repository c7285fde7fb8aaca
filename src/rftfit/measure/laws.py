"""Other laws of stress over depth than a line through zero: a line with a free intercept, and a power of depth.

They serve for two purposes. Where ``fit.law`` or ``fit.depths_cm`` of the config ask
for it, alpha is by such a law (`replace_slope`). Else
they are compared with the line through zero (`other_laws`): laws that differ at the end of the window show that alpha
depends on the law. `find_crust` finds a third shape, a peak near the surface, which no law here describes.

``depth``: cm, positive, shape (n,). ``stress``: N/cm^2, shape (k, n) for k components, or (n,) for one. A *gain* is the
derivative of a fitted number by the stress of each sample: fitted number = sum(gain x stress), from which its error
follows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.measure.slopes import (
    FEWEST,
    Slope,
    combine_dof,
    free_intercept,
    level_path,
    weighted_sum_variance,
)
from rftfit.store.chosen import chosen

if TYPE_CHECKING:
    from rftfit.campaign.config import ErrorSettings

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `laws`, says what each decides
_CHOSEN = chosen("measure", "laws")


class DepthLaw(NamedTuple):
    """Law by which stress grows with depth.

    `name`: A line through zero, a line with a free intercept, or a power of depth.
    `at_cm`: Depth at which alpha is stress over depth, cm. With an infinite depth alpha is the slope of a line; a power
    of depth has no such slope, so it needs a finite one.
    """

    name: Literal["through_zero", "free_intercept", "power"] = "through_zero"
    at_cm: float = math.inf

    def fit(self, depth: FloatArray, stress: FloatArray) -> list[Fitted]:
        """Fit each component of stress, N/cm^2, shape (k, n), at depths in cm, shape (n,); not for ``through_zero``."""
        if self.name == "power":
            return [power_fit(depth, component, self.at_cm) for component in stress]
        return intercept_fits(depth, stress, self.at_cm)

    def weights(self, depth: FloatArray, stress: FloatArray) -> FloatArray:
        """Weights of the n level runs of a cell, shape (n,): alpha is the sum of weight x (stress / depth).

        Each level run is at one depth, so the law is fitted to the runs. `depth`, `stress`: of each, cm and N/cm^2,
        shape (n,), at two depths or more.
        """
        if self.name == "through_zero":
            return depth**2 / max(float(depth @ depth), 1e-9)
        return depth * self.fit(depth, stress[None])[0].gain


LINE_THROUGH_ZERO = DepthLaw()


@dataclass(frozen=True)
class Fitted:
    """A law with two parameters, fitted to one component of stress.

    `alpha`: Stress over depth at the depth where the laws are compared, `DepthLaw.at_cm`, N/cm^3.
    `gain`: Derivatives of `alpha` by the stress of each sample, 1/cm, shape (n,).
    `design`: Derivatives of the stress by each parameter, shape (2, n).
    `residual`: Residuals, N/cm^2, shape (n,).
    `exponent`: Exponent of depth; NaN where no power fits, 1 for a line.
    `lever`: Relative change of `alpha` for depths that are 1 cm off, 1/cm.
    `exponent_gain`: Derivatives of `exponent` by the stress of each sample, cm^2/N, shape (n,); None for a line, or
    without stress.
    """

    alpha: float
    gain: FloatArray
    design: FloatArray
    residual: FloatArray
    exponent: float = 1.0
    lever: float = 0.0  # a free intercept absorbs a surface that is off
    exponent_gain: FloatArray | None = None

    @property
    def exponent_se(self) -> float:
        """Standard error of the exponent from the scatter of samples; NaN where no power fits or samples are few."""
        if self.exponent_gain is None or self.residual.size < FEWEST or math.isnan(self.exponent):
            return math.nan
        variance, _ = weighted_sum_variance(self.residual[None], self.exponent_gain, self.design)
        return math.sqrt(float(variance[0]))


class Laws(NamedTuple):
    """Fits of two other laws; each list holds one fit for each component of stress, z and x."""

    free_intercept: list[Fitted]
    power: list[Fitted]


def other_laws(depth: FloatArray, stress: FloatArray, at_cm: float) -> Laws | None:
    """Fit a line with a free intercept and a power of depth; None along a level path.

    `depth`: cm, shape (n,). `stress`: N/cm^2, shape (k, n). `at_cm`: Depth at which the laws are compared.
    """
    if level_path(depth):
        return None
    return Laws(
        DepthLaw("free_intercept", at_cm).fit(depth, stress),
        DepthLaw("power", at_cm).fit(depth, stress),
    )


def intercept_fits(depth: FloatArray, stress: FloatArray, at_cm: float) -> list[Fitted]:
    """Fit lines with a free intercept, one for each row of `stress`, shape (k, n).

    Alpha is intercept / at + slope, the stress over depth at `at_cm`; if that is infinite, alpha is the slope.
    """
    intercepts, slopes = free_intercept(depth, stress)
    design, centred = np.stack([np.ones_like(depth), depth]), depth - depth.mean()
    gain_of_slope = centred / (centred @ centred)
    gain_of_intercept = 1 / depth.size - depth.mean() * gain_of_slope
    gain = gain_of_slope + gain_of_intercept / at_cm
    return [
        Fitted(float(start / at_cm + slope), gain, design, measured - start - slope * depth)
        for start, slope, measured in zip(intercepts, slopes, stress, strict=True)
    ]


_ONE_DEPTH = 1e-10
"""Share of the squared derivative by the exponent that is orthogonal to the power, up to which it is rounding.

All depths are equal then.
"""


def power_fit(depth: FloatArray, stress: FloatArray, at_cm: float) -> Fitted:
    """Fit stress = alpha at (depth / at)^p by least squares (Gauss-Newton); at = `at_cm`.

    `depth` and `stress`: cm and N/cm^2, shape (n,). Each step fits stress = a u + b v, with u = (depth / at)^p and its
    derivative by the exponent, v = u log(depth / at), and changes p by b / a. Where no power fits, alpha comes from
    these functions at p = 1, and the exponent is NaN. If all depths are equal, alpha, gain and exponent are NaN.
    """
    above = np.maximum(depth, 1e-6)
    log, p, fits = np.log(above / at_cm), 1.0, True
    # u and v are views of the first two rows, filled anew in each step
    u, v, _ = rows = np.stack([log, log, stress])
    for steps_left in range(_CHOSEN.steps, -1, -1):
        np.multiply(np.exp(p * log, out=u), log, out=v)
        # sums over the samples of u u, u v, u stress, ...
        (uu, uv, u_stress), (_, vv, v_stress) = (rows[:2] @ rows.T).tolist()
        # square of the component of v that is orthogonal to u
        v_across = vv - uv**2 / uu if uu > 0 else 0.0
        if not v_across > _ONE_DEPTH * vv:
            nothing = np.full(depth.size, math.nan)
            return Fitted(math.nan, nothing, rows[:2], nothing, math.nan, math.nan)
        # least squares of both: b by the part of v that u does not explain; `size` is the factor of u without v
        size = u_stress / uu
        b = (v_stress - size * uv) / v_across
        # a component without stress has no exponent
        step = b / size if size else 0.0
        if not fits or abs(step) < _CHOSEN.small or not steps_left:
            break
        p += min(max(step, -0.5), 0.5)
        if not _CHOSEN.least_p < p < _CHOSEN.most_p or (steps_left == 1 and abs(step) >= 0.1):
            fits, p = False, 1.0
    gain = (vv * u - uv * v) / (uu * v_across * at_cm)
    alpha = float(gain @ stress)
    return Fitted(
        alpha,
        gain,
        design=np.stack([u, size * v]),
        residual=stress - alpha * at_cm * u - b * v,
        exponent=p if fits else math.nan,
        # a surface that is 1 cm off changes each stress by its derivative by depth
        lever=float(gain @ (p * size * u / above)) / (alpha or 1.0),
        exponent_gain=(v - u * uv / uu) / (v_across * size) if size else None,
    )


@dataclass(frozen=True)
class Crust:
    """Peak of stress near the surface: its depth, cm, and its relative excess over the line through the deeper part."""

    depth_cm: float
    excess: float


def find_crust(depth: FloatArray, stress: FloatArray) -> Crust | None:
    """Find a peak near the surface, after which stress falls once and then grows to the end; None where there is none.

    With stick-slip or stones stress falls repeatedly by similar amounts: this is no crust.

    `depth`, `stress`: Samples of a push in the order of recording, cm and N/cm^2, shape (n,).
    """
    width = max(depth.size // _CHOSEN.crust_smooth, 3)
    if depth.size < 3 * _CHOSEN.crust_smooth or not depth[-1] > depth[0]:
        return None
    sign = 1.0 if stress[-1] >= 0 else -1.0
    smooth = np.convolve(sign * stress, np.full(width, 1 / width), mode="valid")
    # depth of the middle of each mean
    mean_depth = depth[width // 2 :][: smooth.size]
    # how far stress is below its highest value so far; behind a crust it falls within the upper part of the push
    drop = np.maximum.accumulate(smooth) - smooth
    upper = drop[mean_depth <= depth[-1] * _CHOSEN.crust_depth * 1.5]
    if not upper.size:
        return None
    bottom = int(upper.argmax())
    peak = int(smooth[: bottom + 1].argmax())
    deeper, deeper_stress = mean_depth[bottom:], smooth[bottom:]
    second_drop = float((np.maximum.accumulate(deeper_stress) - deeper_stress).max())
    peak_cm = float(mean_depth[peak])
    is_deep = peak_cm > _CHOSEN.crust_depth * depth[-1]
    if is_deep or drop[bottom] < _CHOSEN.crust_drop * smooth[-1] or second_drop > drop[bottom] / 2:
        return None
    slope = float(deeper_stress @ deeper / (deeper @ deeper))
    return Crust(peak_cm, float(smooth[peak] / (slope * peak_cm) - 1))


PATCHES: float = _CHOSEN.patches
"""Standard deviation of an exponent by denser and looser patches in a bed (3 %, 2 cm wide): 0.04 to 0.06 in windows
of 3 to 8 cm."""

LEVELLED_CM: float = _CHOSEN.levelled_cm
"""Standard deviation of the free surface of a bed that is levelled by a blade, cm."""


def ordinary_surface(errors: ErrorSettings) -> tuple[float, float]:
    """Standard deviations of the free surface from run to run and common to all runs, cm.

    Each is `LEVELLED_CM`, or the stated one if that is larger.
    """
    stated_mm = errors.surface_run_mm or 0.0, errors.surface_session_mm or 0.0
    run_cm, session_cm = (max(LEVELLED_CM, size_mm / 10) for size_mm in stated_mm)
    return run_cm, session_cm


@lru_cache(maxsize=512)
def exponent_lever(top_cm: float, end_cm: float) -> float:
    """Size of the change of the exponent fitted in a window if the surface is 1 cm off, 1/cm.

    A surface that is off makes a line through zero look like a power of depth, most of all in a shallow window. The
    window goes from `top_cm` to `end_cm`.
    """
    depth = np.linspace(max(top_cm, 0.005 * end_cm), end_cm, 60)
    # stress of a line through zero, by depths that are off by half the step
    step_cm = 0.02 * end_cm
    shallower, deeper = (
        power_fit(depth, depth + off_cm, end_cm).exponent for off_cm in (-step_cm / 2, step_cm / 2)
    )
    return abs(shallower - deeper) / step_cm


def replace_slope_of_few(slope: Slope, law_fits: Sequence[Fitted]) -> Slope:
    """Replace alpha and its errors in the slope of a few independent depths by those of another law.

    Two parameters leave no scatter of two depths, so their errors are NaN. `law_fits`: one fit for each component.
    """
    dof = slope.points - 2
    squares = [(fit.residual @ fit.residual) * (fit.gain @ fit.gain) for fit in law_fits]
    se = np.sqrt(np.array(squares) / (dof or math.nan))
    alpha = np.array([fit.alpha for fit in law_fits])
    return replace(
        slope,
        alpha=alpha,
        se=se,
        ols_se=se,
        dof=np.full(alpha.size, max(dof, 1.0)),
        lever=_lever_of(law_fits),
    )


def _lever_of(law_fits: Sequence[Fitted]) -> float:
    """Lever of the component with the larger alpha: a run has one lever for both."""
    return max(law_fits, key=lambda fit: abs(fit.alpha)).lever


def replace_slope(slope: Slope, law_fits: Sequence[Fitted]) -> Slope:
    """Replace alpha and its errors in a slope by those of another law; `law_fits`: one fit for each component.

    Errors by the scatter, the zeros and the tare are carried to the new law by its gain; a curvature is none any more,
    as the law describes it.
    """
    noise = [weighted_sum_variance(fit.residual[None], fit.gain, fit.design) for fit in law_fits]
    scatter = np.array([float(variance[0]) for variance, _ in noise])
    dof = np.array([dof for _, dof in noise])
    # change of alpha if all stresses are off by 1, as by an error of the zero
    change_by_zero = np.array([float(fit.gain.sum()) for fit in law_fits])
    shift = slope.shift * change_by_zero**2
    tare = np.sqrt(slope.tare_share * scatter + slope.shift_of_tare * change_by_zero**2)
    alpha = np.array([fit.alpha for fit in law_fits])
    return replace(
        slope,
        alpha=alpha,
        se=np.sqrt(scatter + shift),
        dof=combine_dof(np.stack([scatter, shift]), np.stack([dof, slope.dof])),
        curvature=np.zeros(alpha.size),
        tare=tare,
        lever=_lever_of(law_fits),
    )
