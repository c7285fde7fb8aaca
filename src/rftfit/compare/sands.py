"""Natural sands: the linear regime, corrections on trial, plates of several sizes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.compare.legs import bed_spread
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.errors import (
    Part,
    Spread,
    SurfaceError,
    bed_of_mean,
    errors_of,
    half_width,
    spread_of_beds,
)
from rftfit.measure.fits import linear_window, too_short
from rftfit.measure.ledger import RowStatus
from rftfit.measure.slopes import (
    GIVEN_DOF,
    combine_dof,
    fit_few,
    fit_slope,
    student_quantile,
    zero_intercept,
)
from rftfit.measure.strokes import split_runs
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.model.scaling import scale_new_medium

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from rftfit.campaign.config import AnyPlate
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray

SAND_COLUMNS = ["medium", "run_id", "window", "linear_to_cm", "alpha_z_N_per_cm3", "lo", "hi", "bend",
                "zeta", "zeta_lo", "zeta_hi", "reason"]  # fmt: skip
CORRECTION_COLUMNS = ["medium", "model", "factor_z", "factor_x", "rms_fit_N", "rms_cv_N",
                      "gain_cv_percent", "earns_its_place"]  # fmt: skip

BEND = 0.10
"""Largest bend of a regime that is called linear: see `bend_of`."""

SHALLOWEST_CM = 1.0
STEP_CM = 0.05


def bend_of(depth: FloatArray, stress: FloatArray) -> float:
    """Bend of a curve through zero: how far a parabola leaves the line at the end, relative to it.

    Positive where the curve steepens.
    """
    design = np.stack([depth, depth**2], axis=1)
    (slope, curve), *_ = np.linalg.lstsq(design, stress, rcond=None)
    end = float(depth.max())
    line = float(zero_intercept(depth, stress[None])[0][0]) * end
    return float(slope * end + curve * end**2 - line) / line if line else float("nan")


def linear_end(depth: FloatArray, stress: FloatArray, bend: float = BEND) -> float:
    """Find the depth, cm, to which a tared penetration curve is linear.

    The regime grows from `SHALLOWEST_CM` as long as its bend stays within `bend`; NaN if even the
    shallowest part is bent more, or there are too few samples.
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


def penetration_rows(
    campaign: Campaign,
    tared: pd.DataFrame,
    runs: pd.DataFrame,
    fits: pd.DataFrame,
    alpha: pd.DataFrame,
    chi: FloatArray,
) -> list[dict[str, object]]:
    """Slope and zeta of every penetration test of a natural sand over its linear regime.

    Two rows a test, one for the stated and one for the detected regime; one with the reason for a
    test that has no tared stroke. `tared`, `runs`, `fits` and `alpha` are the sand's tables of the
    earlier stages, `chi` that of the reference media.
    """
    surface, others = errors_of(fits, campaign.config)[1], _of_any_window(alpha)
    facts = {str(row["run_id"]): row for row in runs.to_dict("records")}
    where = split_runs(tared)
    rows: list[dict[str, object]] = []
    lost: list[dict[str, object]] = []
    for name in sorted(facts):
        run = campaign.by_id[name]
        if (run.kind, run.direction, run.beta_deg, run.gamma_deg) != ("plate", "intrusion", 0, 90):
            continue
        if name in where:
            rows += _windows(campaign, run, tared.iloc[where[name]], facts, chi, surface, others)
            continue
        reason = facts[name]["reason"]
        if campaign.numbers:
            reason = reason or "a slope from a table: no curve of stress against depth"
        reason = reason or f"it has no stroke, or its tare {run.tare_run} is of no use"
        lost.append({"medium": run.medium, "run_id": name, "window": "stated", "reason": reason})
    return rows + lost


def _windows(
    campaign: Campaign,
    run: Run,
    samples: pd.DataFrame,
    facts: Mapping[str, Any],
    chi: FloatArray,
    surface: SurfaceError,
    others: float,
) -> list[dict[str, object]]:
    """Fit one penetration test over the stated and over the detected linear regime."""
    plate = campaign.config.intruders[run.intruder]
    assert plate.shape != "leg"
    depth = samples["depth_cm"].to_numpy(float)
    stress = samples["force_z_N"].to_numpy(float) / plate.area_cm2
    pair = [facts[name] for name in (run.run_id, run.tare_run) if name]
    variance = np.array([[fact["zero_var_z_N2"]] for fact in pair], dtype=float)
    zero = (variance / plate.area_cm2**2, np.array([[fact["zero_dof"]] for fact in pair]))
    stated = campaign.config.media[run.medium].linear_to_cm
    ends = {"stated": math.nan if stated is None else stated, "detected": linear_end(depth, stress)}
    rows = []
    for window, end in ends.items():
        row: dict[str, object] = {"medium": run.medium, "run_id": run.run_id, "window": window}
        inside = linear_window(depth, end, campaign.config.fit) == RowStatus.GOOD
        # without an end, which is NaN then, there is no window
        part = np.isfinite(stress) & (depth > 0) & (depth <= end) & inside
        samples_of = depth[part], stress[part]
        row |= {"linear_to_cm": end} | _slope(
            campaign, plate, *samples_of, zero, chi, surface, others
        )
        if campaign.holds_tare(run):
            row["reason"] = "; ".join(filter(None, (str(row["reason"]), NO_TARE_FLAG)))
        rows.append(row)
    return rows


def _of_any_window(alpha: pd.DataFrame) -> float:
    """Error of a single test by its bed and by that of its rod, relative, whatever its window."""
    cell = cell_at(alpha, 0, 90)
    if cell is None:
        return 0.0
    rod = float(cell.get(column("z", "_rod"), 0.0)) / float(cell[column("z")])
    return math.hypot(bed_spread(alpha), rod if math.isfinite(rod) else 0.0)


def _slope(
    campaign: Campaign,
    plate: AnyPlate,
    depth: FloatArray,
    stress: FloatArray,
    zero: tuple[FloatArray, FloatArray],
    chi: FloatArray,
    surface: SurfaceError,
    others: float = 0.0,
) -> dict[str, object]:
    """Slope over one linear regime, and zeta from it."""
    fit = campaign.config.fit
    of_table = campaign.config.table is not None
    if depth.size < (3 if of_table else fit.min_points):
        return {"reason": "no linear regime with enough samples"}
    if not of_table and (short := too_short(depth, plate, fit)):
        return {"reason": short}
    slope = fit_few(depth, stress[None]) if of_table else fit_slope(depth, stress[None], *zero)
    alpha, se = float(slope.alpha[0]), float(slope.se[0])
    moved = alpha * slope.lever
    parts = [Part(se, float(slope.dof[0])), Part(moved * surface.run, surface.dof)]
    parts += [Part(moved * surface.session), Part(alpha * others)]
    half = half_width(parts, fit.confidence) if math.isfinite(se) else math.nan
    row = {"alpha_z_N_per_cm3": alpha, "lo": alpha - half, "hi": alpha + half}
    row["bend"] = bend_of(depth, stress)
    se = half / float(student_quantile(fit.confidence, GIVEN_DOF))
    try:
        scaled = scale_new_medium(alpha, se, chi, np.zeros(9), fit.confidence)
    except ValueError as error:
        return {**row, "reason": str(error)}
    ends = {"zeta": scaled.zeta, "zeta_lo": scaled.zeta_lo, "zeta_hi": scaled.zeta_hi}
    return {**row, **ends, "reason": ""}


MODELS = ("none", "one factor", "factors for z and x")
WORTH = 0.10
"""A model is worth its factors if its error is at least this much smaller in cross-validation."""


def corrections(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Fit factors on the scaled generic profile in every natural sand, and cross-validate them.

    `measured` and `predicted` are leg curves of the natural sands and their predictions by the
    scaled generic profile. With fewer than three legs there is no cross-validation: NaN.
    """
    import pandas as pd

    if measured.empty or predicted.empty:
        return pd.DataFrame(columns=CORRECTION_COLUMNS)
    both = measured.merge(
        predicted, on=["medium", "leg", "theta_deg"], suffixes=("_measured", "")
    ).dropna(subset=["force_z_N", "force_x_N"])
    rows = []
    for medium, part in both.groupby("medium", sort=True):
        legs = [_pair(leg) for _, leg in part.groupby("leg", sort=True)]
        unchanged = _rms(legs, [np.ones(2)] * len(legs))
        for model in MODELS:
            factors = _fit(legs, model)
            crossed = math.nan
            if len(legs) >= 3:
                held_out = [_fit(legs[:i] + legs[i + 1 :], model) for i in range(len(legs))]
                crossed = _rms(legs, held_out)
            gain = 1 - crossed / unchanged if unchanged else math.nan
            worth = bool(model != "none" and gain >= WORTH)
            rms = _rms(legs, [factors] * len(legs))
            rows.append((medium, model, *factors, rms, crossed, 100 * gain, worth))
    return pd.DataFrame(rows, columns=CORRECTION_COLUMNS)


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
    """Exponent n of stress = k depth^n, least squares of logarithms; NaN below eight positive samples."""
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
    """Combine the runs of each plate; the spread from run to run is pooled over the plates.

    `alphas`: By plate: alpha, standard error (N/cm^3) and degrees of freedom of its runs.
    `exponents`: By plate: `depth_exponent` of its runs.
    """
    (spread,) = spread_of_beds([[(alpha, se) for alpha, se, _ in alphas.values()]])
    results = {}
    for name, (alpha, se, dof) in alphas.items():
        n, mean = alpha.size, float(alpha.mean())
        own = (se / n) ** 2
        noise = Part(math.sqrt(float(own.sum())), float(combine_dof(own, dof)))
        noise, bed, _ = bed_of_mean(alpha, np.full(n, 1 / n), noise, spread)
        half = half_width([noise, bed], confidence)
        results[name] = PlateResult(
            Estimate(mean, math.hypot(noise.sd, bed.sd), mean - half, mean + half),
            n,
            float(np.abs(alpha / mean - 1).max()),
            _of_scatter(exponents[name], confidence),
        )
    return results, spread


def size_exponent(size_cm: Sequence[float], alpha: Sequence[float], confidence: float) -> Estimate:
    """Exponent m of alpha ~ size^m over all runs; 0 where stress does not depend on the size.

    NaN throughout with fewer than three runs or one size only.
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
