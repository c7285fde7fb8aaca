"""Stage 4: the symmetry extension of the alpha tables to all intrusion angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column, grid
from rftfit.profile.symmetry import extend, symmetrise
from rftfit.reference import BETA_DEG, GAMMA_DEG
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from pathlib import Path


COLUMNS = ["medium", "beta_deg", "gamma_deg", column("z"), column("x")]


def symmetry(alpha: list[Path], extended: Path) -> None:
    """Symmetrise and extend the alpha table of every medium.

    Parameters
    ----------
    alpha : list of Path
        Read: alpha tables.
    extended : Path
        Written: `medium, beta_deg, gamma_deg, alpha_z_N_per_cm3, alpha_x_N_per_cm3` with gamma
        from -180 to 180 degrees; without rows where no medium was measured over the grid.

    Raises
    ------
    RftfitError
        If a table cannot be read or the result not be written.
    """
    import pandas as pd

    parts = []
    for path in alpha:
        table = read_csv(path)
        pair = symmetrise(grid(table, column("z")), grid(table, column("x")))
        gamma, alpha_z, alpha_x = extend(np.radians(GAMMA_DEG), *pair)
        beta_deg, gamma_deg = np.meshgrid(BETA_DEG, np.degrees(gamma), indexing="ij")
        parts.append(
            pd.DataFrame(
                {
                    "medium": table["medium"].iloc[0],
                    "beta_deg": beta_deg.ravel(),
                    "gamma_deg": gamma_deg.ravel(),
                    column("z"): alpha_z.ravel(),
                    column("x"): alpha_x.ravel(),
                }
            )
        )
    nothing = pd.DataFrame(columns=COLUMNS)
    write_csv(pd.concat(parts, ignore_index=True) if parts else nothing, extended)
