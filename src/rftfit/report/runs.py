"""Traces of single runs, ready to be drawn: as filed, split at gaps, thinned without losing spikes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rftfit import conventions

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Mapping

    import pandas as pd

FloatArray = npt.NDArray[np.float64]
Trace = dict[str, FloatArray]
"""Samples of one run by column."""

DIRECTIONS = ("extraction", "horizontal", "intrusion")
"""Directions of plate runs, in the order of their filed gamma."""


def filed(traces: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """Turn the horizontal stress of extractions as their alpha_x is turned when it is filed.

    Parameters
    ----------
    traces : pandas.DataFrame
        Samples in the lab frame with ``run_id`` and stress columns.
    fits : pandas.DataFrame
        With ``run_id, direction``.

    Returns
    -------
    pandas.DataFrame
        A copy, so that every trace lies along ``alpha * depth`` of its row in `fits`.
    """
    # a sheet may number its runs; a number read from one file is not one read from another
    pulled = fits.loc[fits["direction"] == "extraction", "run_id"].astype(str)
    sign = conventions.file_extraction(0.0, 0.0)[2]
    factor = np.where(traces["run_id"].astype(str).isin(pulled), sign, 1.0)
    names = [name for name in traces.columns if name.endswith("_x_N_per_cm2")]
    return traces.assign(**{name: traces[name].to_numpy(float) * factor for name in names})


def by_run(traces: pd.DataFrame, columns: Iterable[str]) -> dict[str, Trace]:
    """Take the samples of each run as arrays.

    Parameters
    ----------
    traces : pandas.DataFrame
        Rows of one run need not be together, but are in time order.
    columns : iterable of str
        Those to take; a column that is not there is left out.

    Returns
    -------
    dict of str to dict of str to numpy.ndarray
        By run, by column.
    """
    ids, code = np.unique(traces["run_id"].astype(str).to_numpy(str), return_inverse=True)
    order = np.argsort(code, kind="stable")
    cuts = np.flatnonzero(np.diff(code[order])) + 1
    parts: dict[str, list[FloatArray]] = {}
    for name in columns:
        if name in traces.columns:
            parts[name] = np.split(traces[name].to_numpy(float)[order], cuts)
    return {str(run): {name: parts[name][i] for name in parts} for i, run in enumerate(ids)}


def thin(x: FloatArray, y: FloatArray, points: int = 80) -> list[FloatArray]:
    """Polylines of at most about `points` points: smallest and largest sample of each stretch.

    Taking the extremes instead of every n-th sample keeps spikes and the width of the noise.

    Parameters
    ----------
    x, y : numpy.ndarray, shape (n,)
        Samples in time order.
    points : int

    Returns
    -------
    list of numpy.ndarray, shape (m, 2)
        One polyline for each stretch between missing samples.
    """
    good = np.isfinite(x) & np.isfinite(y)
    if not good.any():
        return []
    place = np.flatnonzero(good)
    lines = []
    for part in np.split(place, np.flatnonzero(np.diff(place) > 1) + 1):
        bins = max(1, points * part.size // (2 * place.size))
        if part.size > 2 * bins:
            width = part.size // bins
            bins = part.size // width  # so that less than one stretch is left over
            body = part[: bins * width].reshape(bins, width)
            rows = np.arange(bins)
            low = body[rows, y[body].argmin(axis=1)]
            high = body[rows, y[body].argmax(axis=1)]
            rest = part[bins * width :]
            part = np.unique(np.concatenate([part[:1], low, high, rest, part[-1:]]))  # noqa: PLW2901
        lines.append(np.column_stack([x[part], y[part]]))
    return lines


def nice(value: float) -> float:
    """Smallest of 1, 2 or 5 times a power of ten that is not below a value.

    Parameters
    ----------
    value : float
        Positive.

    Returns
    -------
    float
    """
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in (1, 2, 5, 10) if step * decade >= 0.999 * value))


def span(trace: Trace) -> tuple[float, float]:
    """Round stresses at the bottom and the top of a panel; zero is always inside.

    Parameters
    ----------
    trace : dict of str to numpy.ndarray

    Returns
    -------
    low, high : float
        N/cm^2. The smaller side has at least a fifth of the larger one.
    """
    stresses = [trace[name] for name in trace if name.endswith("_N_per_cm2")]
    every = np.concatenate(stresses) if stresses else np.zeros(1)
    every = every[np.isfinite(every)]
    low, high = (nice(max(side, 1e-3)) for side in (-every.min(initial=0), every.max(initial=0)))
    # less than 0.05 N/cm^2 would blow up mere noise
    most = max(low, high, 0.05)
    return (-max(low, most / 5), most) if high >= low else (-most, max(high, most / 5))


def trouble(fit: Mapping[Hashable, Any]) -> str:
    """Say what is wrong with a run, in few words; empty if nothing is.

    Parameters
    ----------
    fit : mapping
        Row of the fit table.

    Returns
    -------
    str
    """
    parts = [str(fit[name]) for name in ("reason", "flags") if isinstance(fit[name], str)]
    text = "; ".join(part for part in parts if part)
    if not text and not np.isfinite([fit[f"alpha_{c}_N_per_cm3"] for c in "zx"]).all():
        return "no alpha"
    return text
