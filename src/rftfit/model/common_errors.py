"""What the errors of the cells of an alpha table have in common: causes that move several cells, and their covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.alpha import column

COVARIANCE_INDEX = ["beta_deg", "gamma_deg", "component"]
"""What names a number of an alpha table: a cell and a component, ``z`` or ``x``."""


@dataclass(frozen=True)
class CommonError:
    """An error that cells share, with the standard deviation 1 of each of its independent causes.

    `size`: Of each component by cell, N/cm^3, with the sign of its common cause. `share` (causes, n): of each cause in
    the error of a cell; its squares add up to 1 in each cell that has the error. `joint`: whether a cause moves
    both components; else each component has causes of its own.
    """

    size: dict[str, FloatArray]
    share: FloatArray
    joint: bool


def common_errors(table: pd.DataFrame) -> dict[str, CommonError]:
    """Errors that cells of an alpha table share, by name: those of all runs, and those of runs with one tare."""
    every = np.ones((1, len(table)))
    shared = {
        source: CommonError(error_sizes(table, source), every, joint=True)
        for source in ("rod", "session", "turn")
    }
    names = table["tare_runs"].fillna("").to_numpy(str) if "tare_runs" in table else ()
    of_cells = [str(text).split() for text in names]
    size = error_sizes(table, "tare")
    if any(size[c].any() for c in COMPONENTS) and of_cells:
        tares = sorted({name for cell in of_cells for name in cell})
        # as if the tares of a cell had equal parts in it
        share = [
            [1 / len(cell) ** 0.5 if name in cell else 0.0 for cell in of_cells] for name in tares
        ]
        shared["tare"] = CommonError(size, np.array(share), joint=False)
    return shared


def error_sizes(table: pd.DataFrame, source: str) -> dict[str, FloatArray]:
    """One error by component and cell, N/cm^3; 0 where the table does not have it."""
    names = {c: column(c, f"_{source}") for c in COMPONENTS}
    return {
        c: np.asarray(np.nan_to_num(table[name].to_numpy(float)))
        if name in table
        else np.zeros(len(table))
        for c, name in names.items()
    }


def equivalent_rows(table: pd.DataFrame) -> npt.NDArray[np.intp]:
    """The last row of an alpha table that is the same plate in the same motion, for each row."""
    keys = list(zip((table["beta_deg"] % 180).round(3), table["gamma_deg"].round(3), strict=True))
    order = np.argsort(table["beta_deg"].to_numpy(float), kind="stable")
    last = {keys[row]: int(row) for row in order}
    return np.array([last[key] for key in keys], dtype=np.intp)


def covariance_of(table: pd.DataFrame) -> pd.DataFrame:
    """Covariance of the errors of the means of an alpha table, (N/cm^3)^2, of both components.

    Errors with a common cause are correlated, with its sign; the others are of one cell and component. Rows that are
    one plate (beta = -90 and 90 degrees) have one error. Without numbers that have no standard error. Index and columns:
    `COVARIANCE_INDEX`.
    """
    n, row_of_plate = len(table), equivalent_rows(table)
    se = np.concatenate([table[column(c, "_se")].to_numpy(float) for c in COMPONENTS])
    total, common = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    for error in common_errors(table).values():
        parts = [error.share * error.size[c] for c in COMPONENTS]
        nothing = np.zeros_like(error.share)
        causes = [np.hstack(parts)]
        if not error.joint:
            causes = [np.hstack([parts[0], nothing]), np.hstack([nothing, parts[1]])]
        for cause in causes:
            total += cause.T @ cause
            common += np.square(cause).sum(axis=0)
    alone = np.sqrt(np.maximum(se**2 - common, 0.0))
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
    # in the order of its index a cell is looked up by beta and gamma alone
    return covariance.sort_index().sort_index(axis=1)


def covariance_table(table: pd.DataFrame) -> pd.DataFrame:
    """`covariance_of` an alpha table as the rows of a file: a column for each row, in the same order."""
    square = covariance_of(table)
    places = (square.index.get_level_values(name) for name in COVARIANCE_INDEX)
    names = [
        f"covariance_{c}_{beta:g}_{gamma:g}_N2_per_cm6"
        for beta, gamma, c in zip(*places, strict=True)
    ]
    rows = square.set_axis(names, axis=1).reset_index()
    rows.insert(0, "medium", next(iter(table["medium"]), ""))
    return rows
