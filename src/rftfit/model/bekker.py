"""Bekker's pressure-sinkage law from pushes straight down: p = (k_c / b + k_phi) z^n, for terramechanics (SCM).

Bekker (1969), Introduction to Terrain-Vehicle Systems: p is the pressure under a level plate of width b at the depth z.
A line of stress over depth is n = 1, and alpha_z(0, 90 deg) then is k = k_c / b + k_phi.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.config import Disc, FlatOutline, Leg, Plate
from rftfit.conventions import FloatArray
from rftfit.directions import is_straight_down
from rftfit.errors import InputError
from rftfit.measure.slopes import normal_quantile, student_quantile

_PA_PER_N_CM2, _M_PER_CM = 1e4, 0.01
"""Pascals of one N/cm^2, and metres of one centimetre."""

_SAME_WIDTH = 1.1
"""Largest ratio of plate widths that count as one: a smaller difference of p is lost in the scatter of the beds."""

_CONFIDENCE = 0.95
"""Level of the interval of n."""


@dataclass(frozen=True)
class PressureSinkage:
    """Pressure p = (k_c / b + k_phi) z^n on level plates of width b that are pushed straight down, in SI units.

    Attributes
    ----------
    n, n_lo, n_hi : float
        Mean exponent of the pushes, and its 95 % interval; the interval is NaN for a single push without an error.
    k_phi : float
        N/m^(n+2).
    k_c : float
        N/m^(n+1); 0 if all plates have one width (see `widths_m`): k_phi then holds for this width alone.
    k_phi_se, k_c_se : float
        Standard errors from the scatter of the pushes about the law, at this exponent; NaN if there are too few pushes.
    widths_m : tuple of float
        Widths b of the plates, as `width_of_plate` defines them.
    n_pushes : int
    depth_m : (float, float)
        Least and greatest depth of the fitted stress. The law is not known at greater depths.
    """

    n: float
    n_lo: float
    n_hi: float
    k_phi: float
    k_c: float
    k_phi_se: float
    k_c_se: float
    widths_m: tuple[float, ...]
    n_pushes: int
    depth_m: tuple[float, float]

    def pressure_Pa(self, sinkage_m: FloatArray, width_m: float) -> FloatArray:
        """Return the pressure under a plate of this width at each sinkage; same shape as `sinkage_m`."""
        return (self.k_c / width_m + self.k_phi) * sinkage_m**self.n

    @property
    def doubt(self) -> str:
        """Sentence on what the pushes leave unknown; empty if plates of several widths were pushed."""
        if len(self.widths_m) > 1:
            return ""
        return "plates of one width cannot tell k_c from k_phi: k_phi is their sum, k_c / b + k_phi, for this width"

    def summary(self) -> str:
        """Format the parameters of the law and the pushes from which they were fitted as one line."""
        interval = "" if math.isnan(self.n_lo) else f" ({self.n_lo:.3g} to {self.n_hi:.3g})"
        widths = ", ".join(f"{width / _M_PER_CM:g}" for width in self.widths_m)
        start, end = (depth / _M_PER_CM for depth in self.depth_m)
        return (
            f"n {self.n:.3g}{interval}, k_phi {self.k_phi:.4g} N/m^(n+2), k_c {self.k_c:.4g} N/m^(n+1); "
            f"{self.n_pushes} pushes, b {widths} cm, {start:.1f} to {end:.1f} cm deep"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the formula of the law and all attributes, for JSON."""
        law = "pressure = (k_c / b + k_phi) z^n; Pa, m, k_phi in N/m^(n+2), k_c in N/m^(n+1)"
        return {"law": law, **asdict(self)}


def pressure_sinkage(
    fits: pd.DataFrame, width_cm_of_run: Mapping[str, float], tolerance_deg: float
) -> PressureSinkage:
    """Fit Bekker's law to the pushes of a medium.

    Parameters
    ----------
    fits : DataFrame
        The table `Medium.fits`; only its pushes at (0, 90 deg) are used.
    width_cm_of_run : mapping of str to float
        Width b of the plate of each run.
    tolerance_deg : float
        Tolerance of angles of the campaign's grid.

    Raises
    ------
    InputError
        If no push straight down has a fitted power of depth.
    """
    is_push = is_straight_down(fits["beta_deg"], fits["gamma_deg"], tolerance_deg)
    # columns of the line with a free intercept; both `_percent` columns compare the stress of a law at the end of the
    # fitted window with the stress of the line through zero
    free_line = ["intercept_z_N_per_cm2", "free_slope_z_N_per_cm3", "free_stress_z_percent"]
    numbers = ["exponent_z", "power_stress_z_percent", *free_line]
    pushes = fits[is_push & np.isfinite(fits[numbers].to_numpy(float)).all(axis=1)]
    if pushes.empty:
        raise InputError(
            "no push of a level plate straight down whose stress follows a power of depth; allowed: one or "
            "more, with 5 samples at different depths"
        )
    # one exponent for all pushes: their mean
    exponents = pushes["exponent_z"].to_numpy(float)
    exponent = float(exponents.mean())
    half = _half_width_of_mean(exponents, pushes["exponent_z_se"])
    end_cm = pushes["depth_to_cm"].to_numpy(float)
    intercept, slope, free_percent = pushes[free_line].to_numpy(float).T
    power_percent = pushes["power_stress_z_percent"].to_numpy(float)
    # stresses at the end of the window, N/cm^2, by the line with a free intercept and by the power law
    free_stress = intercept + slope * end_cm
    power_stress = free_stress * (1 + power_percent / 100) / (1 + free_percent / 100)
    # each push gives one k = k_c / b + k_phi, by its power law at the end of its window and the mean exponent
    k = _PA_PER_N_CM2 * power_stress / (_M_PER_CM * end_cm) ** exponent
    width = _M_PER_CM * np.array([width_cm_of_run[run_id] for run_id in pushes["run_id"]])
    widths_differ = width.max() > _SAME_WIDTH * width.min()
    # of k_phi, and of k_c: plates of one width cannot tell these, and have the first term alone
    terms = np.stack([np.ones(k.size), 1 / width])[: 1 + widths_differ]
    parameters = np.linalg.lstsq(terms.T, k, rcond=None)[0]
    dof = k.size - len(terms)
    errors = np.full(2, math.nan)
    if dof > 0:
        variance = float(((k - parameters @ terms) ** 2).sum()) / dof
        errors[: len(terms)] = np.sqrt(variance * np.diag(np.linalg.inv(terms @ terms.T)))
    # k_c is 0 where it has no term
    k_phi, k_c = (*parameters, 0.0)[:2]
    depths = pushes[["depth_from_cm", "depth_to_cm"]].to_numpy(float)
    return PressureSinkage(
        n=exponent,
        n_lo=exponent - half,
        n_hi=exponent + half,
        k_phi=float(k_phi),
        k_c=float(k_c),
        k_phi_se=float(errors[0]),
        k_c_se=float(errors[1]),
        widths_m=tuple(np.unique(np.round(width, 6)).tolist()),
        n_pushes=k.size,
        depth_m=(_M_PER_CM * depths[:, 0].min(), _M_PER_CM * depths[:, 1].max()),
    )


def width_of_plate(plate: Plate | Disc | FlatOutline | Leg) -> float:
    """Return Bekker's width b of a plate, cm: radius of a disc, else the smaller of length and area / length."""
    if isinstance(plate, Disc):
        return plate.diameter_cm / 2
    if isinstance(plate, Leg):
        raise InputError("a leg has no width b; allowed: plates")
    return min(plate.length_cm, plate.area_cm2 / plate.length_cm)


def _half_width_of_mean(exponents: FloatArray, errors: pd.Series) -> float:
    """Return half of the 95 % interval of the mean exponent, by Student's t; of a single push by its standard error.

    `errors`: standard errors of the exponents, of which only a single push uses its own: the scatter of several
    contains them.
    """
    if exponents.size == 1:
        return normal_quantile(_CONFIDENCE) * float(errors.iloc[0])
    spread = float(exponents.std(ddof=1)) / math.sqrt(exponents.size)
    return float(student_quantile(_CONFIDENCE, exponents.size - 1)) * spread
