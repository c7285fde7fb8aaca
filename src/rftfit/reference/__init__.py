"""Published numbers of Li, Zhang and Goldman (2013), as printed, each with its table or figure.

Every file is a tidy csv whose leading ``#`` lines name the table or figure and the source.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.resources import files

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

BETA_DEG = np.array([-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0])
"""Attack angles of Table S5."""

_TANGENTS = np.array([0.0, 1 / 3, 2 / 3, 1.0, 3 / 2, 3.0])
_GAMMA_UP = np.append(np.degrees(np.arctan(_TANGENTS)), 90.0)
GAMMA_DEG = np.concatenate([-_GAMMA_UP[:0:-1], _GAMMA_UP])
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


def _content(name: str) -> bytes:
    """Return the lines of a table without those that name its source."""
    lines = files(__name__).joinpath(f"{name}.csv").read_bytes().splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith(b"#"))


@cache
def _read(name: str) -> pd.DataFrame:
    return read_csv(_content(name), lambda _: "")


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


def alpha_grid(medium: str) -> tuple[np.ndarray, np.ndarray]:
    """Measured alpha of one medium on the published grid (Table S5).

    `medium`: One of `MEDIA`. Returns `alpha_z`, `alpha_x` of shape (7, 13): In N/cm^3, rows in the
    order of `BETA_DEG`, columns in that of `GAMMA_DEG`.
    """
    alpha_z, alpha_x = _grid(medium)
    return alpha_z.copy(), alpha_x.copy()


@cache
def _grid(medium: str) -> tuple[np.ndarray, np.ndarray]:
    if medium not in MEDIA:
        raise KeyError(f"Table S5 has no medium {medium!r}; it has {', '.join(MEDIA)}")
    columns = alpha_columns_of(medium)
    order = np.lexsort([columns["gamma_deg"], columns["beta_deg"]])
    alpha_z, alpha_x = (
        columns[f"alpha_{component}_N_per_cm3"][order].reshape(BETA_DEG.size, GAMMA_DEG.size)
        for component in "zx"
    )
    return alpha_z, alpha_x


def alpha_columns_of(medium: str) -> dict[str, np.ndarray]:
    """Table S5 of one medium as printed, without pandas: angles and alpha by the name of their column, shape (91,)."""
    (_, *names), *rows = read_cells(_content("table_s5"))
    numbers = np.array([row[1:] for row in rows if row[0] == medium], float)
    return dict(zip(names, numbers.T, strict=True))


def coefficients(medium: str) -> dict[str, float]:
    """Coefficients (and ``zeta``) of one medium or of ``generic`` as printed in Table S2.

    `medium`: One of `MEDIA`, or ``generic``. Returns N/cm^3; dimensionless for ``generic`` and
    ``zeta``.
    """
    table = _read("table_s2")
    rows = table[table["medium"] == medium]
    if rows.empty:
        raise KeyError(f"Table S2 has no medium {medium!r}")
    return dict(zip(rows["coefficient"], rows["value"].astype(float), strict=True))


def running_speeds() -> Iterator[tuple[float, int, float, float]]:
    """Yield the conditions of Fig. 4C in which the robot runs: curvature, number within it, frequency in Hz and speed in cm/s."""
    speeds = load("fig_4c")
    running = speeds[speeds["stride_frequency_Hz"] > 0.01]
    for curvature, rows in running.groupby(running["curvature_times_Rprime"].astype(float)):
        pairs = rows[["stride_frequency_Hz", "speed_cm_per_s"]].itertuples(index=False)
        for number, (frequency, speed) in enumerate(pairs, start=1):
            yield float(curvature), number, frequency, speed
