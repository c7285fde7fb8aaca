"""Natural sands: the linear regime of penetration tests, and corrections of the generic profile on trial."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.conventions import FloatArray
from rftfit.directions import is_straight_down
from rftfit.measure.alpha import bed_spread, cell_down, column
from rftfit.measure.errors import ErrorTerm, SurfaceError, combined_half_width, errors_of
from rftfit.measure.fits import Row, fit_medium
from rftfit.measure.flags import Remark, quoted, reason_columns, reason_of, remark
from rftfit.measure.samples import split_runs
from rftfit.measure.slopes import FEWEST, GIVEN_DOF, student_quantile, zero_intercept
from rftfit.model.scaling import scale_new_medium
from rftfit.outputs.dictionary import columns_of
from rftfit.store.chosen import chosen

SAND_COLUMNS = columns_of("sands.csv")
CORRECTION_COLUMNS = columns_of("sand_correction.csv")

_CHOSEN = chosen("compare", "sands")

_NO_LINEAR_REGIME = remark(
    "no-linear-regime",
    depth_cm=_CHOSEN.shallowest_cm,
    wanted=FEWEST,
    bend_percent=100 * _CHOSEN.bend,
)
"""Reason of a push whose shallowest regime is not linear, or cannot be judged."""


def bend_of(depth: FloatArray, stress: FloatArray) -> float:
    """Return the bend of a curve through zero: distance of a fitted parabola from the line at its end, over the line.

    Positive where the curve steepens; NaN where there are not two depths.
    """
    if depth.size < 2 or not np.ptp(depth) > 0:
        return math.nan
    (slope, curvature), *_ = np.linalg.lstsq(np.stack([depth, depth**2], axis=1), stress, None)
    end = float(depth.max())
    line = float(zero_intercept(depth, stress[None])[0][0]) * end
    return float(slope * end + curvature * end**2 - line) / line if line else math.nan


def linear_end(depth: FloatArray, stress: FloatArray) -> float:
    """Find the depth, cm, to which a tared penetration curve is linear.

    The regime grows step by step as long as its bend stays small; NaN if even the shallowest part is bent more, or
    there are too few samples.
    """
    good = np.isfinite(stress) & (depth > 0)
    depth, stress = depth[good], stress[good]
    linear_cm = math.nan
    step_cm = _CHOSEN.step_cm
    deepest = float(depth.max(initial=0.0))
    for end in np.arange(_CHOSEN.shallowest_cm, deepest + step_cm / 2, step_cm):
        within = depth <= end
        bend = bend_of(depth[within], stress[within])
        if np.count_nonzero(within) < FEWEST or abs(bend) > _CHOSEN.bend:
            return linear_cm
        linear_cm = float(end)
    return linear_cm


def penetration_rows(
    campaign: Campaign, medium: str, tables: Mapping[str, pd.DataFrame], chi: FloatArray
) -> list[dict[str, object]]:
    """Make rows of `SAND_COLUMNS`: slope and zeta of every penetration test of a natural sand over its linear regime.

    A test has a row for the detected regime, and one for the stated regime where the config states one. A test without
    a tared stroke has one row with the reason. `tables`: ``runs``, ``tares``, ``fits``, ``alpha`` and ``tared`` of the
    sand. `chi`: those of the reference media.
    """
    config, tared = campaign.config, tables["tared"]
    tolerance_deg = config.grid.angle_tolerance_deg
    row_of_run = {str(row["run_id"]): row for row in tables["runs"].to_dict("records")}
    tests = [
        run
        for run in map(campaign.by_id.__getitem__, sorted(row_of_run))
        if (run.kind, run.direction) == ("plate", "intrusion")
        and is_straight_down(run.beta_deg, run.gamma_deg, tolerance_deg)
    ]
    samples = split_runs(tared)
    depth_cm, force_N = (tared[name].to_numpy(float) for name in ("depth_cm", "force_z_N"))
    detected_cm = {
        run.run_id: linear_end(depth_cm[samples[run.run_id]], force_N[samples[run.run_id]])
        for run in tests
        if run.run_id in samples
    }
    fits = tables["fits"]
    if detected_cm:
        fits = fit_medium(campaign, medium, tables["runs"], tared, tables["tares"], detected_cm)[0]
    # ends of the regimes by run, and fits over them, by the name of the window
    windows = {"detected": (detected_cm, fits)}
    if stated_cm := config.media[medium].linear_to_cm:
        stated = dict.fromkeys(detected_cm, stated_cm), tables["fits"]
        windows = {"stated": stated} | windows
    fit_of_run = {
        window: table.set_index("run_id").to_dict("index") for window, (_, table) in windows.items()
    }
    surface = errors_of(tables["fits"], config)[1]
    bed_and_rod = _bed_and_rod_error(tables["alpha"], tolerance_deg)
    rows: list[dict[str, object]] = []
    untested_rows: list[dict[str, object]] = []
    for run in tests:
        key: dict[str, object] = {"medium": medium, "run_id": run.run_id}
        if run.run_id not in detected_cm:
            code = "no-curve" if campaign.numbers else "no-tared-stroke"
            why = reason_of(row_of_run[run.run_id]) or [remark(code, tare=run.tare_run)]
            untested_rows.append(key | {"window": next(iter(windows))} | reason_columns(why))
            continue
        deepest_cm = np.nanmax(depth_cm[samples[run.run_id]])
        for window, (ends_cm, _) in windows.items():
            end_cm, fit = ends_cm[run.run_id], fit_of_run[window][run.run_id]
            numbers: dict[str, float] = {}
            reason: tuple[Remark, ...] = (_NO_LINEAR_REGIME,)
            if end_cm > 0:
                numbers, reason = _slope_and_zeta(
                    fit, config.fit.confidence, chi, surface, bed_and_rod
                )
            if window == "detected" and end_cm > deepest_cm - _CHOSEN.step_cm:
                reason += (remark("no-linear-end"),)
            if campaign.holds_tare(run):
                reason += (remark("no-tare"),)
            row = key | {"window": window, "linear_to_cm": end_cm} | numbers
            rows.append(row | reason_columns(reason))
    return rows + untested_rows


def _bed_and_rod_error(alpha: pd.DataFrame, tolerance_deg: float) -> float:
    """Return the relative error of a single test by its bed and by the bed of its rod, which no window changes."""
    cell = cell_down(alpha, tolerance_deg)
    if cell is None:
        return 0.0
    rod = float(cell.get(column("z", "_rod"), 0.0)) / (float(cell[column("z")]) or math.nan)
    return math.hypot(bed_spread(alpha, tolerance_deg), rod if math.isfinite(rod) else 0.0)


def _slope_and_zeta(
    fit: Row, confidence: float, chi: FloatArray, surface: SurfaceError, bed_and_rod: float
) -> tuple[dict[str, float], tuple[Remark, ...]]:
    """Return the slope over one linear regime with the errors of a single test, and zeta from it, or why there is none.

    `fit`: row of the table of fits. `chi`: those of the reference media. `surface`: error of its height.
    `bed_and_rod`: from `_bed_and_rod_error`.
    """
    if why := reason_of(fit):
        return {}, why
    alpha, se = float(fit[column("z")]), float(fit[column("z", "_se")])
    # change of alpha by 1 cm of the surface
    by_surface = alpha * float(fit["lever_per_cm"])
    parts = [
        ErrorTerm(se, float(fit["alpha_z_dof"])),
        ErrorTerm(by_surface * surface.run, surface.dof),
    ]
    parts += [ErrorTerm(by_surface * surface.session), ErrorTerm(alpha * bed_and_rod)]
    half = combined_half_width(parts, confidence) if math.isfinite(se) else math.nan
    row = {column("z"): alpha, column("z", "_lo"): alpha - half, column("z", "_hi"): alpha + half}
    row["nonlinear_z_ratio"] = float(fit["nonlinear_z_ratio"])
    se = half / float(student_quantile(confidence, GIVEN_DOF))
    try:
        scaled = scale_new_medium(alpha, se, chi, confidence)
    except ValueError as error:
        return row, (quoted(error, "no-zeta"),)
    ends = {"zeta": scaled.zeta, "zeta_lo": scaled.zeta_lo, "zeta_hi": scaled.zeta_hi}
    return row | ends, ()


MODELS = ("none", "one factor", "factors for z and x")
"""Models of a correction of the generic profile in a sand."""

WORTH: float = _CHOSEN.worth
"""Least part by which factors must reduce the error in cross-validation to be worth using."""


def fit_corrections(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Fit factors on the scaled generic profile in every natural sand, and cross-validate them.

    `measured` and `predicted` are leg curves of the natural sands and their predictions by the
    scaled generic profile. With fewer than three legs there is no cross-validation.
    """
    if measured.empty or predicted.empty:
        return pd.DataFrame(columns=CORRECTION_COLUMNS)
    both = measured.merge(
        predicted, on=["medium", "leg", "theta_deg"], suffixes=("_measured", "")
    ).dropna(subset=["force_z_N", "force_x_N"])
    rows = []
    for medium, rows_of_medium in both.groupby("medium"):
        legs = [_forces_of_leg(leg) for _, leg in rows_of_medium.groupby("leg")]
        unchanged = _rms(legs, [np.ones(2)] * len(legs))
        is_cross_validated = len(legs) >= 3
        reason = [] if is_cross_validated else [remark("few-legs", found=len(legs))]
        for model in MODELS:
            factors = _fit_factors(legs, model)
            rms_cv = math.nan
            if is_cross_validated:
                # each leg by the factors of the others
                factors_of_others = [
                    _fit_factors(legs[:i] + legs[i + 1 :], model) for i in range(len(legs))
                ]
                rms_cv = _rms(legs, factors_of_others)
            gain = 1 - rms_cv / unchanged if unchanged else math.nan
            rows.append(
                {
                    "medium": medium,
                    "model": model,
                    "factor_z": factors[0],
                    "factor_x": factors[1],
                    "rms_fit_N": _rms(legs, [factors] * len(legs)),
                    "rms_cv_N": rms_cv,
                    "gain_cv_percent": 100 * gain,
                    "earns_its_place": bool(model != "none" and gain >= WORTH),
                    **reason_columns(reason),
                }
            )
    return pd.DataFrame(rows, columns=CORRECTION_COLUMNS)


def _forces_of_leg(leg: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Return measured and predicted force of one leg, each of shape (2, n), z and x."""
    measured = leg[["force_z_N_measured", "force_x_N_measured"]].to_numpy(float).T
    return measured, leg[["force_z_N", "force_x_N"]].to_numpy(float).T


def _fit_factors(legs: list[tuple[FloatArray, FloatArray]], model: str) -> FloatArray:
    """Fit factors of the predicted forces z and x by least squares: sum of measured times predicted over squares.

    `legs`: measured and predicted force of each. `model`: one of `MODELS`.
    """
    if model == "none":
        return np.ones(2)
    products = np.sum([(measured * predicted).sum(axis=1) for measured, predicted in legs], axis=0)
    squares = np.sum([(predicted**2).sum(axis=1) for _, predicted in legs], axis=0)
    if model == "one factor":
        products, squares = np.full(2, products.sum()), np.full(2, squares.sum())
    return np.asarray(np.divide(products, squares, out=np.ones(2), where=squares > 0))


def _rms(legs: list[tuple[FloatArray, FloatArray]], factors: list[FloatArray]) -> float:
    """Return the root mean square of factor times predicted less measured force, over all legs and both components."""
    squares = [
        ((factor[:, None] * predicted - measured) ** 2).ravel()
        for (measured, predicted), factor in zip(legs, factors, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(squares))))
