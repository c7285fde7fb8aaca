"""A step past the paper: factors on the scaled generic profile in angular sands, on trial.

The paper's conclusion asks for additional parameters for angular grains. The simplest are factors on
the predicted force, common to all legs. Whether they earn their place is told by cross-validation:
fitted on two legs, judged on the third.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray

MODELS = ("none", "one factor", "factors for z and x")
WORTH = 0.10
"""A model earns its place by an error at least this much smaller in cross-validation."""


def corrections(measured: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Fit and cross-validate every model in every medium.

    Parameters
    ----------
    measured : pandas.DataFrame
        Leg curves of the natural sands.
    predicted : pandas.DataFrame
        Their predictions by the scaled generic profile.

    Returns
    -------
    pandas.DataFrame
        `medium, model, factor_z, factor_x, rms_fit_N, rms_cv_N, gain_cv_percent, earns_its_place`.
        A medium with fewer than three legs has no cross-validation: NaN.
    """
    import pandas as pd

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
    columns = ["medium", "model", "factor_z", "factor_x", "rms_fit_N", "rms_cv_N",
               "gain_cv_percent", "earns_its_place"]  # fmt: skip
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
