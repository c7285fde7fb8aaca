"""The alpha table of a scaled medium as a file, never over a file of somebody else's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import rftfit
from rftfit.cli.scale_intervals import alpha_with_interval
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from rftfit.profile.reference_media import Reference
    from rftfit.profile.scaling import Scaled

MARK = "# alpha table written by rftfit scale"
"""How the first line of such a file begins: only these are overwritten unasked."""

COLUMNS = (
    "beta_deg",
    "gamma_deg",
    "alpha_z_N_per_cm3",
    "alpha_z_lo_N_per_cm3",
    "alpha_z_hi_N_per_cm3",
    "alpha_x_N_per_cm3",
    "alpha_x_lo_N_per_cm3",
    "alpha_x_hi_N_per_cm3",
)


def table_text(scaled: Scaled, reference: Reference, confidence: float, how: str) -> str:
    """Alpha on the published grid of 7 x 13 angles as csv.

    Parameters
    ----------
    scaled : Scaled
    reference : Reference
    confidence : float
        Level of the intervals.
    how : str
        From what the table was made, for its second line.

    Returns
    -------
    str
        Three comment lines, a header row, and 91 rows with beta and gamma ascending.
    """
    beta, gamma = (grid.ravel() for grid in np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij"))
    z, x = alpha_with_interval(scaled, reference, np.radians(beta), np.radians(gamma), confidence)
    lines = [
        f"{MARK} (rftfit {rftfit.__version__})",
        f"# {how}",
        f"# _lo and _hi: {100 * confidence:g} % interval for one further medium",
        ",".join(COLUMNS),
    ]
    for row in zip(beta, gamma, *z, *x, strict=True):
        angles, alphas = row[:2], np.round(row[2:], 6) + 0.0
        lines.append(",".join([*(f"{v:.2f}" for v in angles), *(f"{v:.6g}" for v in alphas)]))
    return "\n".join(lines) + "\n"
