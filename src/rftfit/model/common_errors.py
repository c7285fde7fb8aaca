"""Errors that cells of an alpha table share (session, turn, rod, tare), and the covariance of all errors.

An alpha table has n rows, one for each cell: angles ``beta_deg``, ``gamma_deg``, and for z and x alpha with its
standard error ``alpha_z_se_...`` and a part of it for each source, such as ``alpha_z_rod_...``; ``tare_runs``, the
rod-only runs behind a cell. Errors with a common cause move many cells together and do not average out over cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.alpha import column

COVARIANCE_INDEX = ["beta_deg", "gamma_deg", "component"]
"""Columns that name one number of an alpha table: the angles of its cell, and its component, ``z`` or ``x``."""


@dataclass(frozen=True)
class CommonError:
    """An error that n cells share, as a sum over independent causes of standard deviation 1.

    A cause of 1 changes alpha of a cell by `size` times its `share`. `size`: standard error of each component in each
    cell (n,), N/cm^3, with the sign in which a common cause moves the cell. `share` (causes, n): the squares of the
    shares in a cell add up to 1 if it has the error. `joint`: True if one cause moves both components, False if each
    component has its separate causes.
    """

    size: dict[str, FloatArray]
    share: FloatArray
    joint: bool

    def draw(self, draws: int, random: np.random.Generator) -> dict[str, FloatArray]:
        """Draw the error of each component, ``z`` and ``x``, in each cell, shape (draws, n), N/cm^3."""

        def draw_share() -> FloatArray:
            """Draw the causes, and sum their shares in each cell, (draws, n)."""
            return random.standard_normal((draws, len(self.share))) @ self.share

        share_z = draw_share()
        share_x = share_z if self.joint else draw_share()
        return {"z": self.size["z"] * share_z, "x": self.size["x"] * share_x}


def common_errors(table: pd.DataFrame) -> dict[str, CommonError]:
    """Return the errors that cells of a table share, by source: three with one cause for all runs, and tares.

    ``rod``, ``session`` and ``turn`` are always there, if with size 0; ``tare`` where the table names the tares of its
    cells: cells with the same rod-only run share its error.
    """
    one_cause_for_all = np.ones((1, len(table)))
    shared = {
        source: CommonError(error_sizes(table, source), one_cause_for_all, joint=True)
        for source in ("rod", "session", "turn")
    }
    tare_cells = table["tare_runs"].fillna("").to_numpy(str) if "tare_runs" in table else ()
    tares_of_cell = [str(run_ids).split() for run_ids in tare_cells]
    size = error_sizes(table, "tare")
    if any(size[c].any() for c in COMPONENTS) and tares_of_cell:
        all_tares = sorted({tare for tares in tares_of_cell for tare in tares})
        # the table does not say how much each tare of a cell adds to its error: equal parts
        share = [
            [1 / len(tares) ** 0.5 if tare in tares else 0.0 for tares in tares_of_cell]
            for tare in all_tares
        ]
        shared["tare"] = CommonError(size, np.array(share), joint=False)
    return shared


def error_sizes(table: pd.DataFrame, source: str) -> dict[str, FloatArray]:
    """Return the standard error from one source, by component, in each cell (n,), N/cm^3; 0 where the table has none.

    It has the sign in which a common cause moves the cell.
    """
    names = {c: column(c, f"_{source}") for c in COMPONENTS}
    return {
        c: np.asarray(np.nan_to_num(table[name].to_numpy(float)))
        if name in table
        else np.zeros(len(table))
        for c, name in names.items()
    }


def equivalent_rows(table: pd.DataFrame) -> npt.NDArray[np.intp]:
    """Return for each row the index of the last row of the same direction, (n,): beta = -90 and 90 degrees are one plate.

    Last by beta, so that both rows of a plate have the error that is drawn for the row at 90 degrees.
    """
    keys = list(zip((table["beta_deg"] % 180).round(3), table["gamma_deg"].round(3), strict=True))
    order = np.argsort(table["beta_deg"].to_numpy(float), kind="stable")
    last = {keys[row]: int(row) for row in order}
    return np.array([last[key] for key in keys], dtype=np.intp)


def covariance_of(table: pd.DataFrame) -> pd.DataFrame:
    """Return the covariance of the errors of the means of an alpha table, both components, (N/cm^3)^2.

    Errors with a common cause are correlated, with its sign; the rest of an error is independent in each cell and
    component. Rows of the same plate (beta = -90 and 90 degrees) have the same error. A number without a standard error
    has no row. Index and columns: `COVARIANCE_INDEX`.
    """
    from scipy.linalg import block_diag

    n, row_of_plate = len(table), equivalent_rows(table)
    se = np.concatenate([table[column(c, "_se")].to_numpy(float) for c in COMPONENTS])
    total, common_variance = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    for error in common_errors(table).values():
        by_component = [error.share * error.size[c] for c in COMPONENTS]
        # change of each number of the table, z then x, by each cause: shape (causes, 2 n)
        changes = np.hstack(by_component) if error.joint else block_diag(*by_component)
        total += changes.T @ changes
        common_variance += np.square(changes).sum(axis=0)
    # what remains of each error belongs to the plate alone
    alone = np.sqrt(np.maximum(se**2 - common_variance, 0.0))
    plate = np.concatenate([row_of_plate, row_of_plate + n])
    total += np.outer(alone, alone) * (plate[:, None] == plate)
    names = [
        (beta, gamma, c)
        for c in COMPONENTS
        for beta, gamma in zip(table["beta_deg"], table["gamma_deg"], strict=True)
    ]
    index = pd.MultiIndex.from_tuples(names, names=COVARIANCE_INDEX)
    has_error = np.isfinite(se)
    square = pd.DataFrame(total, index=index, columns=index)
    covariance: pd.DataFrame = square.loc[has_error, has_error]
    # pandas looks up a cell by beta and gamma alone only in a sorted index
    return covariance.sort_index().sort_index(axis=1)


def covariance_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return `covariance_of` an alpha table as the table of a file.

    Columns: ``medium``, those of `COVARIANCE_INDEX`, and one for each row, in the same order, such as
    ``covariance_z_0_90_N2_per_cm6``.
    """
    square = covariance_of(table)
    names = [f"covariance_{c}_{beta:g}_{gamma:g}_N2_per_cm6" for beta, gamma, c in square.index]
    rows = square.set_axis(names, axis=1).reset_index()
    rows.insert(0, "medium", next(iter(table["medium"]), ""))
    return rows
