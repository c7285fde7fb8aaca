"""Natural sands (`sands.csv`, `sand_correction.csv`): linear regime and zeta of penetration tests, corrections on trial.

A penetration test is a push of a level plate straight down, the only plate run of a natural sand. Its *regime* is the
range of depth, from 0, over which its stress is a line. zeta scales the generic profile M0 to the sand; chi, of the
reference media, is measured alpha_z(0, 90 deg) over zeta.
"""

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

    Positive where the curve steepens; NaN where there are not two depths. `depth`: cm, `stress`: in any unit, (n,).
    """
    if depth.size < 2 or not np.ptp(depth) > 0:
        return math.nan
    (slope, curvature), *_ = np.linalg.lstsq(np.stack([depth, depth**2], axis=1), stress, None)
    end = float(depth.max())
    # stress by the line at the deepest sample
    line = float(zero_intercept(depth, stress[None])[0][0]) * end
    return float(slope * end + curvature * end**2 - line) / line if line else math.nan


def linear_end(depth: FloatArray, stress: FloatArray) -> float:
    """Find the depth, cm, to which a tared penetration curve is linear.

    The regime grows step by step as long as its bend stays small; NaN if even the shallowest part is bent more, or
    there are too few samples. `depth`: cm, `stress`: in any unit, NaN where unknown, shape (n,).
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

    A test has a row for the detected regime, and one for the stated regime where the config states one, told apart by
    the column `window`. A test without a tared stroke has one row with the reason, behind the others. `tables`:
    ``runs``, ``tares``, ``fits``, ``alpha`` and ``tared`` of the sand. `chi`: those of the reference media, shape (media,).
    """
    config = campaign.config
    tolerance_deg = config.grid.angle_tolerance_deg
    row_of_run = {str(row["run_id"]): row for row in tables["runs"].to_dict("records")}
    tests = [
        run
        for run in map(campaign.by_id.__getitem__, sorted(row_of_run))
        if (run.kind, run.direction) == ("plate", "intrusion")
        and is_straight_down(run.beta_deg, run.gamma_deg, tolerance_deg)
    ]
    regimes = _fit_regimes(campaign, medium, tables, [run.run_id for run in tests])
    deepest_cm = tables["tared"].groupby("run_id", observed=True)["depth_cm"].max()
    # error of the height of the surface
    surface = errors_of(tables["fits"], config)[1]
    bed_and_rod = _bed_and_rod_error(tables["alpha"], tolerance_deg)
    rows: list[dict[str, object]] = []
    untested_rows: list[dict[str, object]] = []
    for run in tests:
        key: dict[str, object] = {"medium": medium, "run_id": run.run_id}
        if run.run_id not in regimes["detected"]:
            code = "no-curve" if campaign.numbers else "no-tared-stroke"
            why = reason_of(row_of_run[run.run_id]) or [remark(code, tare=run.tare_run)]
            untested_rows.append(key | {"window": next(iter(regimes))} | reason_columns(why))
            continue
        for window, regime_of_run in regimes.items():
            end_cm, fit = regime_of_run[run.run_id]
            numbers: dict[str, float] = {}
            reason: tuple[Remark, ...] = (_NO_LINEAR_REGIME,)
            if end_cm > 0:
                numbers, reason = _slope_and_zeta(
                    fit, config.fit.confidence, chi, surface, bed_and_rod
                )
            if window == "detected" and end_cm > deepest_cm[run.run_id] - _CHOSEN.step_cm:
                reason += (remark("no-linear-end"),)
            if campaign.holds_tare(run):
                reason += (remark("no-tare"),)
            row = key | {"window": window, "linear_to_cm": end_cm} | numbers
            rows.append(row | reason_columns(reason))
    return rows + untested_rows


def _fit_regimes(
    campaign: Campaign, medium: str, tables: Mapping[str, pd.DataFrame], run_ids: list[str]
) -> dict[str, dict[str, tuple[float, Row]]]:
    """Find the linear regimes of penetration tests, and the fits over them.

    Returns, for the regime ``stated`` where the config states one, then for ``detected``: by run_id, for each test with a
    tared stroke, the end of the regime, cm, and its row of fits. `run_ids`: of the tests. `tables`: as in
    `penetration_rows`.
    """
    tared, fits = tables["tared"], tables["fits"]
    # rows of the samples of each run
    samples = split_runs(tared)
    depth_cm, force_N = (tared[name].to_numpy(float) for name in ("depth_cm", "force_z_N"))
    detected_cm = {
        run_id: linear_end(depth_cm[samples[run_id]], force_N[samples[run_id]])
        for run_id in run_ids
        if run_id in samples
    }
    regimes = {}
    if stated_cm := campaign.config.media[medium].linear_to_cm:
        row_of_run = fits.set_index("run_id").to_dict("index")
        regimes["stated"] = {run_id: (stated_cm, row_of_run[run_id]) for run_id in detected_cm}
    if detected_cm:
        # slopes again, each over its detected regime
        fits = fit_medium(campaign, medium, tables["runs"], tared, tables["tares"], detected_cm)[0]
    row_of_run = fits.set_index("run_id").to_dict("index")
    regimes["detected"] = {
        run_id: (end_cm, row_of_run[run_id]) for run_id, end_cm in detected_cm.items()
    }
    return regimes


def _bed_and_rod_error(alpha: pd.DataFrame, tolerance_deg: float) -> float:
    """Return the relative error of a single test by its bed and by the bed of its rod, which no window changes.

    `alpha`: Alpha table of the sand; 0 where it does not have the cell (0, 90) deg.
    """
    cell = cell_down(alpha, tolerance_deg)
    if cell is None:
        return 0.0
    rod = float(cell.get(column("z", "_rod"), 0.0)) / (float(cell[column("z")]) or math.nan)
    return math.hypot(bed_spread(alpha, tolerance_deg), rod if math.isfinite(rod) else 0.0)


def _slope_and_zeta(
    fit: Row, confidence: float, chi: FloatArray, surface: SurfaceError, bed_and_rod: float
) -> tuple[dict[str, float], tuple[Remark, ...]]:
    """Return the slope over one linear regime with the errors of a single test, and zeta from it, or why there is none.

    Returns columns of `SAND_COLUMNS` and the reasons for those that are missing. `fit`: row of the table of fits. `chi`:
    those of the reference media. `surface`: error of its height. `bed_and_rod`: from `_bed_and_rod_error`.
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
    # half width of the interval of alpha
    half = combined_half_width(parts, confidence) if math.isfinite(se) else math.nan
    row = {column("z"): alpha, column("z", "_lo"): alpha - half, column("z", "_hi"): alpha + half}
    row["nonlinear_z_ratio"] = float(fit["nonlinear_z_ratio"])
    # the standard error that a nearly normal interval as wide has
    se = half / float(student_quantile(confidence, GIVEN_DOF))
    try:
        scaled = scale_new_medium(alpha, se, chi, confidence)
    except ValueError as error:
        return row, (quoted(error, "no-zeta"),)
    ends = {"zeta": scaled.zeta, "zeta_lo": scaled.zeta_lo, "zeta_hi": scaled.zeta_hi}
    return row | ends, ()


MODELS = ("none", "one factor", "factors for z and x")
"""Models of a correction of the generic profile in a sand: factors on the predicted forces z and x."""

WORTH: float = _CHOSEN.worth
"""Least part by which factors must reduce the error in cross-validation to be worth using."""


def fit_corrections(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Fit factors on the scaled generic profile in every natural sand, and cross-validate them.

    The paper asks for such factors; a factor is worth using only if it reduces the error on a leg that it was not fitted
    to. Returns a row of `CORRECTION_COLUMNS` for each sand and model. `measured` and `predicted` are leg curves of the
    natural sands (medium, leg, theta_deg, force_z_N, force_x_N) and their predictions by the scaled generic profile.
    With fewer than three legs there is no cross-validation.
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
    """Return measured and predicted force of one leg, N, each of shape (2, n), z and x."""
    measured = leg[["force_z_N_measured", "force_x_N_measured"]].to_numpy(float).T
    return measured, leg[["force_z_N", "force_x_N"]].to_numpy(float).T


def _fit_factors(legs: list[tuple[FloatArray, FloatArray]], model: str) -> FloatArray:
    """Fit factors of the predicted forces z and x, shape (2,): sum of measured times predicted over squares.

    That is least squares. `legs`: measured and predicted force of each leg. `model`: one of `MODELS`.
    """
    if model == "none":
        return np.ones(2)
    products = np.sum([(measured * predicted).sum(axis=1) for measured, predicted in legs], axis=0)
    squares = np.sum([(predicted**2).sum(axis=1) for _, predicted in legs], axis=0)
    if model == "one factor":
        products, squares = np.full(2, products.sum()), np.full(2, squares.sum())
    return np.asarray(np.divide(products, squares, out=np.ones(2), where=squares > 0))


def _rms(legs: list[tuple[FloatArray, FloatArray]], factors: list[FloatArray]) -> float:
    """Return the root mean square of factor times predicted less measured force, N, over all legs and both components.

    `factors`: of z and x, shape (2,), for each of the `legs`.
    """
    squares = [
        ((factor[:, None] * predicted - measured) ** 2).ravel()
        for (measured, predicted), factor in zip(legs, factors, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(squares))))
