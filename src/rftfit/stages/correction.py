"""Cross-validated correction of the scaled generic profile in natural sands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.store import read_csv, write_csv
from rftfit.validate.correction import corrections

if TYPE_CHECKING:
    from pathlib import Path


def correction(legs: list[Path], predicted: Path, correction: Path) -> None:
    """Fit and cross-validate corrections in every natural sand.

    Parameters
    ----------
    legs : list of Path
        Read: measured leg curves of the sands.
    predicted : Path
        Read: predictions of the trials stage.
    correction : Path
        Written.

    Raises
    ------
    RftfitError
        If an input cannot be read or the result not be written.
    """
    import pandas as pd

    curves = read_csv(predicted)
    empty = pd.DataFrame(columns=["medium", "leg", "theta_deg", "force_z_N", "force_x_N"])
    measured = pd.concat([read_csv(path) for path in legs]) if legs else empty
    write_csv(corrections(measured, curves[curves["profile"] == "generic"]), correction)
