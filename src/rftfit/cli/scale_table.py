"""The alpha table of a scaled medium as a file, never over a file of somebody else's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import rftfit
from rftfit.cli.scale_intervals import alpha_with_interval
from rftfit.errors import InputError, OutputError
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.cli.scale_sources import Reference
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


def check_target(path: Path, force: bool) -> None:
    """Refuse a path whose file is not one of ours.

    Parameters
    ----------
    path : Path
    force : bool
        Whether the user said that it may be overwritten.

    Raises
    ------
    InputError
        If there is such a file.
    OutputError
        If it cannot be looked at, or is a folder.
    """
    if path.is_dir():
        raise OutputError(f"{path}: this is a folder; name a file for the alpha table")
    try:
        with path.open("rb") as handle:
            ours = handle.read(len(MARK)) == MARK.encode()
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(f"{path}: cannot be looked at: {error.strerror or error}") from error
    if not ours and not force:
        raise InputError(
            f"{path}: this file is there and was not written by rftfit scale, so it is left as it "
            "is; name another with --output, or add --force to overwrite it"
        )
