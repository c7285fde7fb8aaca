"""Natural sands: the linear regime, corrections on trial, plates of several sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.slopes import (
    Spread,
    mean_of_repeats,
    spread_of_runs,
    student_quantile,
    zero_intercept,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from rftfit.conventions import FloatArray


# --- Penetration of natural sands: where the linear regime ends, and the slope up to there.


BEND = 0.10
"""Largest bend of a regime that is called linear: see `bend_of`."""

SHALLOWEST_CM = 1.0
STEP_CM = 0.05


def bend_of(depth: FloatArray, stress: FloatArray) -> float:
    """Bend of a curve through zero: how far a parabola leaves the line at the end, relative to it.

    `depth`, `stress`: shape (n,); cm, N/cm^2. Returns positive where the curve steepens.
    """
    design = np.stack([depth, depth**2], axis=1)
    (slope, curve), *_ = np.linalg.lstsq(design, stress, rcond=None)
    end = float(depth.max())
    line = float(zero_intercept(depth, stress[None])[0][0]) * end
    return float(slope * end + curve * end**2 - line) / line if line else float("nan")


def linear_end(depth: FloatArray, stress: FloatArray, bend: float = BEND) -> float:
    """Find the depth to which a penetration curve is linear.

    The regime grows from `SHALLOWEST_CM` as long as its bend stays within `bend`.

    `depth`, `stress`: shape (n,); cm, N/cm^2; tared. Returns cm; NaN if even the shallowest part
    is bent more, or there are too few samples.
    """
    good = np.isfinite(stress) & (depth > 0)
    depth, stress = depth[good], stress[good]
    found = float("nan")
    for end in np.arange(SHALLOWEST_CM, float(depth.max(initial=0.0)) + STEP_CM / 2, STEP_CM):
        part = depth <= end
        if np.count_nonzero(part) < 8 or abs(bend_of(depth[part], stress[part])) > bend:
            return found
        found = float(end)
    return found


# --- A step past the paper: factors on the scaled generic profile in angular sands, on trial.


MODELS = ("none", "one factor", "factors for z and x")
WORTH = 0.10
"""A model earns its place by an error at least this much smaller in cross-validation."""


def corrections(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Fit and cross-validate every model in every medium.

    `measured`: Leg curves of the natural sands. `predicted`: Their predictions by the scaled
    generic profile. Returns `medium, model, factor_z, factor_x, rms_fit_N, rms_cv_N,
    gain_cv_percent, earns_its_place`. A medium with fewer than three legs has no cross-validation:
    NaN.
    """
    import pandas as pd

    columns = ["medium", "model", "factor_z", "factor_x", "rms_fit_N", "rms_cv_N",
               "gain_cv_percent", "earns_its_place"]  # fmt: skip
    if measured.empty or predicted.empty:
        return pd.DataFrame(columns=columns)
    both = measured.merge(
        predicted, on=["medium", "leg", "theta_deg"], suffixes=("_measured", "")
    ).dropna(subset=["force_z_N", "force_x_N"])
    rows: list[dict[str, object]] = []
    for medium, part in both.groupby("medium", sort=True):
        legs = [_pair(leg) for _, leg in part.groupby("leg", sort=True)]
        plain = _rms(legs, [np.ones(2)] * len(legs))
        for model in MODELS:
            factors = _fit(legs, model)
            crossed = np.nan
            if len(legs) >= 3:
                held_out = [_fit(legs[:i] + legs[i + 1 :], model) for i in range(len(legs))]
                crossed = _rms(legs, held_out)
            gain = 1 - crossed / plain if plain else np.nan
            rows.append(
                {
                    "medium": medium,
                    "model": model,
                    "factor_z": factors[0],
                    "factor_x": factors[1],
                    "rms_fit_N": _rms(legs, [factors] * len(legs)),
                    "rms_cv_N": crossed,
                    "gain_cv_percent": 100 * gain,
                    "earns_its_place": bool(model != "none" and gain >= WORTH),
                }
            )
    return pd.DataFrame(rows, columns=columns)


def _pair(leg: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Measured and predicted force of one leg, each of shape (2, n), z and x."""
    true = leg[["force_z_N_measured", "force_x_N_measured"]].to_numpy(float).T
    return true, leg[["force_z_N", "force_x_N"]].to_numpy(float).T


def _fit(legs: list[tuple[FloatArray, FloatArray]], model: str) -> FloatArray:
    """Least-squares factors of z and x."""
    if model == "none":
        return np.ones(2)
    across = np.sum([(true * ours).sum(axis=1) for true, ours in legs], axis=0)
    own = np.sum([(ours**2).sum(axis=1) for _, ours in legs], axis=0)
    if model == "one factor":
        across, own = np.full(2, across.sum()), np.full(2, own.sum())
    return np.asarray(np.divide(across, own, out=np.ones(2), where=own > 0))


def _rms(legs: list[tuple[FloatArray, FloatArray]], factors: list[FloatArray]) -> float:
    """Root mean square over all legs, both components, each leg with its own factors."""
    squares = [((factor[:, None] * ours - true) ** 2).ravel()
               for (true, ours), factor in zip(legs, factors, strict=True)]  # fmt: skip
    return float(np.sqrt(np.mean(np.concatenate(squares))))


# --- Repeated penetrations with plates of several sizes: alpha of each, and what RFT takes for granted.


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error and interval."""

    value: float
    se: float
    lo: float
    hi: float

    def holds(self, number: float) -> bool:
        """Tell whether the interval holds a number."""
        return self.lo <= number <= self.hi


@dataclass(frozen=True)
class PlateResult:
    """What the repeated runs with one plate say together.

    `alpha`: alpha_z(0, 90 deg), N/cm^3, for one further bed prepared alike: run-to-run spread
        included.
    `largest_deviation`: Of a run from the mean of its plate, relative.
    `exponent`: n of stress ~ depth^n within the window, from the scatter between runs.
    """

    alpha: Estimate
    runs: int
    largest_deviation: float
    exponent: Estimate


def depth_exponent(depth: FloatArray, stress: FloatArray) -> float:
    """Exponent n of stress = k depth^n, least squares of logarithms.

    `depth`: shape (n,); cm, positive. `stress`: shape (n,); N/cm^2. Returns naN with fewer than
    eight positive samples.
    """
    good = (depth > 0) & (stress > 0)
    if np.count_nonzero(good) < 8:
        return math.nan
    x, y = np.log(depth[good]), np.log(stress[good])
    x = x - x.mean()
    return float(x @ y / (x @ x))


def by_plate(
    alphas: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
    exponents: Mapping[str, FloatArray],
    confidence: float,
) -> tuple[dict[str, PlateResult], Spread]:
    """Combine the runs of each plate.

    `alphas`: By plate; arrays of shape (runs,), N/cm^3. `exponents`: By plate. Returns `spread`:
    From run to run, pooled over the plates.
    """
    spread = spread_of_runs([(alpha, se) for alpha, se, _ in alphas.values()], None)
    results = {}
    for name, (alpha, se, dof) in alphas.items():
        mean, error, freedom = mean_of_repeats(alpha, se, dof, spread)
        results[name] = PlateResult(
            _estimate(mean, error, freedom, confidence),
            alpha.size,
            float(np.abs(alpha / mean - 1).max()),
            _of_scatter(exponents[name], confidence),
        )
    return results, spread


def size_exponent(size_cm: Sequence[float], alpha: Sequence[float], confidence: float) -> Estimate:
    """Exponent m of alpha ~ size^m over all runs; 0 where stress does not depend on the size.

    `size_cm`, `alpha`: One entry a run: cm, N/cm^3. Returns naN throughout with fewer than three
    runs or one size only.
    """
    x, y = np.log(np.asarray(size_cm, float)), np.log(np.asarray(alpha, float))
    if x.size < 3 or np.ptp(x) == 0:
        return Estimate(*[math.nan] * 4)
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    residual = y - slope * x
    se = math.sqrt(float(residual @ residual) / (x.size - 2) / float(x @ x))
    return _estimate(slope, se, x.size - 2, confidence)


def _of_scatter(values: FloatArray, confidence: float) -> Estimate:
    good = values[np.isfinite(values)]
    if good.size < 2:
        mean = float(good.mean()) if good.size else math.nan
        return Estimate(mean, math.nan, math.nan, math.nan)
    se = float(good.std(ddof=1)) / math.sqrt(good.size)
    return _estimate(float(good.mean()), se, good.size - 1, confidence)


def _estimate(value: float, se: float, dof: float, confidence: float) -> Estimate:
    half = float(student_quantile(confidence, dof)) * se
    return Estimate(value, se, value - half, value + half)
