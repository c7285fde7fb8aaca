"""Published numbers of Li, Zhang and Goldman (2013), as printed, each with its table or figure.

Every file is a tidy csv whose leading ``#`` lines name the table or figure and the source.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.store import read_cells, read_csv

CITATION = (
    "Li, C., Zhang, T. and Goldman, D. I., A Terradynamics of Legged Locomotion on Granular "
    "Media, Science 339, 1408 (2013), DOI 10.1126/science.1229163"
)

MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
"""The five laboratory media, in the order of Tables S1 to S5."""

SANDS = ("yuma", "palms29", "palms29_sieved")
"""The three natural sands of Figs. S11 and S12."""

LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
"""The three model legs."""

BETA_DEG = np.array([-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0])
"""Attack angles of Table S5."""

_GAMMA_DOWN = np.degrees(np.arctan([0.0, 1 / 3, 2 / 3, 1.0, 3 / 2, 3.0, np.inf]))
GAMMA_DEG = np.concatenate([-_GAMMA_DOWN[:0:-1], _GAMMA_DOWN])
"""Intrusion angles of Table S5: tan gamma = 0, 1/3, 2/3, 1, 3/2, 3, infinity, both signs."""

NAMES = (
    "table_s1",
    "table_s2",
    "table_s3",
    "table_s4",
    "table_s5",
    "fig_s5",
    "fig_s11",
    "fig_s12",
    "fig_4c",
    "discrepancies",
)
"""Published tables and figures, as `load` names them."""


def load(name: str) -> pd.DataFrame:
    """One table or figure of Li, Zhang and Goldman (2013), as printed.

    Parameters
    ----------
    name : str
        ``table_s1`` to ``table_s5``, ``fig_s5`` (legs), ``fig_s11`` (penetration of sands), ``fig_s12``
        (legs in sands), ``fig_4c`` (speed of the robot), or ``discrepancies``: statements of the paper
        that its own tables and equations contradict.

    Returns
    -------
    pandas.DataFrame
        A copy of its own; units are in the names of the columns.

    Raises
    ------
    KeyError
        If there is no such table.

    Examples
    --------
    >>> import rftfit
    >>> len(rftfit.published_table("table_s5"))
    455
    """
    if name not in NAMES:
        raise KeyError(f"no published table {name!r}; there are {', '.join(NAMES)}")
    return _read(name).copy()


@cache
def _read(name: str) -> pd.DataFrame:
    """Read a table, with the types that its cells show."""
    return read_csv(_content(name), lambda _: "")


def _content(name: str) -> bytes:
    """Return the lines of a table without those that name its source."""
    lines = files(__name__).joinpath(f"{name}.csv").read_bytes().splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith(b"#"))


@cache
def alpha_grid(medium: str) -> tuple[np.ndarray, np.ndarray]:
    """Return alpha_z and alpha_x of one of `MEDIA` on the published grid (Table S5), N/cm^3, shape (7, 13) each.

    Rows are in the order of `BETA_DEG`, columns in that of `GAMMA_DEG`. The arrays are shared and cannot be changed.
    """
    if medium not in MEDIA:
        raise KeyError(f"Table S5 has no medium {medium!r}; it has {', '.join(MEDIA)}")
    columns = alpha_columns_of(medium)
    order = np.lexsort([columns["gamma_deg"], columns["beta_deg"]])
    grids = np.stack([columns[f"alpha_{c}_N_per_cm3"][order] for c in "zx"])
    grids.flags.writeable = False
    alpha_z, alpha_x = grids.reshape(2, BETA_DEG.size, GAMMA_DEG.size)
    return alpha_z, alpha_x


def alpha_columns_of(medium: str) -> dict[str, np.ndarray]:
    """Return the columns of Table S5 of one medium, angles (deg) and alpha (N/cm^3), by name, shape (91,) each.

    They are read without pandas, whose import takes longer.
    """
    (_, *names), *rows = read_cells(_content("table_s5"))
    numbers = np.array([row[1:] for row in rows if row[0] == medium], float)
    return dict(zip(names, numbers.T, strict=True))


def coefficients(medium: str) -> dict[str, float]:
    """Return the coefficients and ``zeta`` of one of `MEDIA` or of ``generic`` by name, as printed in Table S2.

    Coefficients of a medium are in N/cm^3; those of ``generic``, and zeta, have no unit.
    """
    table = _read("table_s2")
    rows = table[table["medium"] == medium]
    if rows.empty:
        raise KeyError(f"Table S2 has no medium {medium!r}")
    return dict(zip(rows["coefficient"], rows["value"].astype(float), strict=True))


class RunningSpeed(NamedTuple):
    """Speed of the robot of Fig. 4C; `number`: of the point within the curve of its curvature, from 1."""

    curvature_times_R: float
    number: int
    frequency_Hz: float
    speed_cm_per_s: float


def running_speeds() -> Iterator[RunningSpeed]:
    """Yield the points of Fig. 4C in which the robot runs, in the order of curvature."""
    speeds = load("fig_4c")
    running = speeds[speeds["stride_frequency_Hz"] > 0.01]
    for curvature, rows in running.groupby(running["curvature_times_Rprime"].astype(float)):
        points = zip(rows["stride_frequency_Hz"], rows["speed_cm_per_s"], strict=True)
        for number, (frequency_Hz, speed) in enumerate(points, start=1):
            yield RunningSpeed(float(curvature), number, frequency_Hz, speed)
