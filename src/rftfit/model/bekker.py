"""Bekker's pressure-sinkage law from pushes straight down: p = (k_c / b + k_phi) z^n, for terramechanics (SCM).

Bekker (1969), Introduction to Terrain-Vehicle Systems. A line of stress over depth is n = 1, and alpha_z(0, 90 deg) then is k.
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
from rftfit.errors import InputError

_PA_PER_N_CM2, _M_PER_CM = 1e4, 0.01
_SAME_WIDTH = 1.1
"""Plates whose widths differ by less tell k_c from k_phi no better than their beds allow."""


@dataclass(frozen=True)
class PressureSinkage:
    """Pressure p = (k_c / b + k_phi) z^n on level plates of width b that are pushed straight down, in SI units.

    Attributes
    ----------
    n, n_lo, n_hi : float
        Exponent, and the 95 % interval of its mean over beds; NaN where one push has no error.
    k_phi : float
        N/m^(n+2).
    k_c : float
        N/m^(n+1); 0 where all plates have one width, as `widths_m` shows: then k_phi is that of this width.
    k_phi_se, k_c_se : float
        Standard errors by the scatter of the pushes at this exponent; NaN where there are too few.
    widths_m : tuple of float
        Widths b of the plates, as of `width_of_plate`.
    n_pushes : int
    depth_m : (float, float)
        From where to where stress was fitted. The law is not known below.
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
        """Pressure at these depths under a plate of this width, of the shape of `sinkage_m`."""
        return (self.k_c / width_m + self.k_phi) * sinkage_m**self.n

    @property
    def doubt(self) -> str:
        """What these pushes cannot tell, if anything."""
        if len(self.widths_m) > 1:
            return ""
        return "plates of one width cannot tell k_c from k_phi: k_phi is their sum, k_c / b + k_phi, for this width"

    def summary(self) -> str:
        """Format the law, and the pushes that it stands on."""
        interval = "" if math.isnan(self.n_lo) else f" ({self.n_lo:.3g} to {self.n_hi:.3g})"
        widths = ", ".join(f"{width / _M_PER_CM:g}" for width in self.widths_m)
        start, end = (depth / _M_PER_CM for depth in self.depth_m)
        return (
            f"n {self.n:.3g}{interval}, k_phi {self.k_phi:.4g} N/m^(n+2), k_c {self.k_c:.4g} N/m^(n+1); "
            f"{self.n_pushes} pushes, b {widths} cm, {start:.1f} to {end:.1f} cm deep"
        )

    def as_dict(self) -> dict[str, Any]:
        """Give law and numbers."""
        law = "pressure = (k_c / b + k_phi) z^n; Pa, m, k_phi in N/m^(n+2), k_c in N/m^(n+1)"
        return {"law": law, **asdict(self)}


def pressure_sinkage(fits: pd.DataFrame, width_cm_of_run: Mapping[str, float]) -> PressureSinkage:
    """Fit Bekker's law to the pushes of a medium.

    Parameters
    ----------
    fits : DataFrame
        Of `Medium.fits`; the pushes at (0, 90 deg) count.
    width_cm_of_run : mapping of str to float
        Width b of the plate of each run.

    Raises
    ------
    InputError
        If there is no push straight down of which a power of depth is known.
    """
    is_push = (fits["beta_deg"] == 0) & (fits["gamma_deg"] == 90)
    # stress at the end of a window: by the line with a free intercept, and both laws against the line through zero
    free_line = ["intercept_z_N_per_cm2", "free_slope_z_N_per_cm3", "free_stress_z_percent"]
    numbers = ["exponent_z", "power_stress_z_percent", *free_line]
    pushes = fits[is_push & np.isfinite(fits[numbers].to_numpy(float)).all(axis=1)]
    if pushes.empty:
        raise InputError(
            "no push of a level plate straight down whose stress follows a power of depth; allowed: one or "
            "more, with 5 samples at different depths"
        )
    exponents = pushes["exponent_z"].to_numpy(float)
    exponent, half = float(exponents.mean()), _half_width(exponents, pushes["exponent_z_se"])
    end_cm = pushes["depth_to_cm"].to_numpy(float)
    intercept, slope, free_percent = pushes[free_line].to_numpy(float).T
    power_percent = pushes["power_stress_z_percent"].to_numpy(float)
    stress = (intercept + slope * end_cm) * (1 + power_percent / 100) / (1 + free_percent / 100)
    k = _PA_PER_N_CM2 * stress / (_M_PER_CM * end_cm) ** exponent
    width = _M_PER_CM * np.array([width_cm_of_run[run_id] for run_id in pushes["run_id"]])
    differ = width.max() > _SAME_WIDTH * width.min()
    design = np.stack([np.ones(k.size), 1 / width if differ else np.zeros(k.size)])
    terms = design[: 1 + differ]
    parameters = np.linalg.lstsq(terms.T, k, rcond=None)[0]
    dof = k.size - len(terms)
    errors = np.full(2, math.nan)
    if dof > 0:
        variance = float(((k - parameters @ terms) ** 2).sum()) / dof
        errors[: len(terms)] = np.sqrt(variance * np.diag(np.linalg.inv(terms @ terms.T)))
    k_phi, k_c = (*parameters, 0.0)[:2]
    depths = pushes[["depth_from_cm", "depth_to_cm"]].to_numpy(float)
    return PressureSinkage(
        exponent,
        exponent - half,
        exponent + half,
        float(k_phi),
        float(k_c),
        float(errors[0]),
        float(errors[1]),
        tuple(np.unique(np.round(width, 6)).tolist()),
        k.size,
        (_M_PER_CM * depths[:, 0].min(), _M_PER_CM * depths[:, 1].max()),
    )


def width_of_plate(plate: Plate | Disc | FlatOutline | Leg) -> float:
    """Bekker's b of a plate, cm: smaller side, radius of a disc, of another outline its area over its length."""
    if isinstance(plate, Disc):
        return plate.diameter_cm / 2
    if isinstance(plate, Leg):
        raise InputError("a leg has no width b; allowed: plates")
    return min(plate.length_cm, plate.area_cm2 / plate.length_cm)


def _half_width(exponents: FloatArray, errors: pd.Series) -> float:
    """Half of the 95 % interval of the mean exponent; of one push by its own error."""
    from scipy.special import stdtrit

    if exponents.size == 1:
        return 1.96 * float(errors.iloc[0])
    spread = float(exponents.std(ddof=1)) / math.sqrt(exponents.size)
    return float(stdtrit(exponents.size - 1, 0.975)) * spread
