"""The stroke of each run out of the long table of samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.runs import Run
    from rftfit.conventions import FloatArray


@dataclass(frozen=True)
class Samples:
    """Samples of one run's stroke; arrays of shape (n,), in the order of recording.

    Parameters
    ----------
    depth, x : numpy.ndarray
        cm.
    angle_deg : numpy.ndarray
    path : numpy.ndarray
        Length travelled since the stroke's start, cm.
    force : numpy.ndarray, shape (2, n)
        z, x; N.
    why : numpy.ndarray of int8
        `Why` a row must not be used; GOOD where it may.
    """

    depth: FloatArray
    x: FloatArray
    angle_deg: FloatArray
    path: FloatArray
    force: FloatArray
    why: np.ndarray

    def position(self, abscissa: str) -> FloatArray:
        """Position that a tare is subtracted at.

        Parameters
        ----------
        abscissa : str
            ``depth_cm``, ``path_cm`` or ``angle_deg``.

        Returns
        -------
        numpy.ndarray, shape (n,)
        """
        return {"depth_cm": self.depth, "path_cm": self.path, "angle_deg": self.angle_deg}[abscissa]


def abscissa_of(run: Run) -> str:
    """Name of the position at which a run's tare is subtracted.

    Parameters
    ----------
    run : Run

    Returns
    -------
    str
        Depth for slanted strokes, path for horizontal ones (all of one depth), theta for legs.
    """
    if run.direction == "rotation":
        return "angle_deg"
    return "path_cm" if run.direction == "horizontal" else "depth_cm"


def split_runs(table: pd.DataFrame) -> dict[str, slice]:
    """Find the rows of each run in a table sorted by run.

    Parameters
    ----------
    table : pandas.DataFrame
        With a categorical column ``run_id``, each run's rows together.

    Returns
    -------
    dict of str to slice
    """
    # a table without rows comes back from Parquet without its categories
    run_id = table["run_id"].astype("category")
    codes = run_id.cat.codes.to_numpy()
    names = run_id.cat.categories
    edges = np.flatnonzero(np.diff(codes)) + 1
    starts = np.concatenate([[0], edges]) if codes.size else np.empty(0, dtype=int)
    stops = np.append(edges, codes.size)
    return {
        str(names[codes[a]]): slice(int(a), int(b)) for a, b in zip(starts, stops, strict=False)
    }


def strokes(samples: pd.DataFrame) -> dict[str, Samples]:
    """Take the stroke of every run out of the samples of the ingest stage.

    Parameters
    ----------
    samples : pandas.DataFrame
        As written by the ingest stage.

    Returns
    -------
    dict of str to Samples
        By run_id.
    """
    part = (samples["phase"] == "stroke").to_numpy()
    columns = {name: samples[name].to_numpy()[part] for name in ("x_cm", "depth_cm", "angle_deg")}
    force = np.stack([samples[name].to_numpy()[part] for name in ("force_z_N", "force_x_N")])
    why = samples["why"].to_numpy()[part]
    found = {}
    for name, rows in split_runs(samples.loc[part, ["run_id"]]).items():
        x, depth = columns["x_cm"][rows], columns["depth_cm"][rows]
        path = np.hypot(x - x[0], depth - depth[0])
        found[name] = Samples(depth, x, columns["angle_deg"][rows], path, force[:, rows], why[rows])
    return found
