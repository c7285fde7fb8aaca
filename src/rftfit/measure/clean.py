"""Rows whose time cannot be right, and gaps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.logs.base import Log, LogError

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

DUPLICATE = "duplicated row"
BACKWARDS = "time runs backwards"


def clean(log: Log) -> Log:
    """Drop duplicated rows and rows whose time does not increase.

    Parameters
    ----------
    log : Log
        Must have a column ``time``.

    Returns
    -------
    Log
        Time strictly increasing; what was dropped is counted.

    Raises
    ------
    LogError
        If half of the rows or more would go: such a clock cannot be trusted.
    """
    time = log.columns["time"]
    if time.size == 0:
        raise LogError("no_good_row", f"{log.path}: no usable row among {log.rows}", log.rows)
    if (time[1:] > time[:-1]).all():
        return log
    values = np.stack(list(log.columns.values()))
    repeated = np.zeros(time.size, dtype=bool)
    repeated[1:] = (values[:, 1:] == values[:, :-1]).all(axis=0)
    log = log.take(~repeated, DUPLICATE)
    time = log.columns["time"]
    latest = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    forward = time > latest
    if np.count_nonzero(forward) * 2 <= forward.size:
        raise LogError(
            "time",
            f"{log.path}: time does not increase in {np.count_nonzero(~forward)} of {time.size} rows; "
            "are several recordings in one file?",
            log.rows,
        )
    return log.take(forward, BACKWARDS)


def gaps(time: FloatArray, longest_s: float) -> FloatArray:
    """Start and end of every step longer than `longest_s`.

    Parameters
    ----------
    time : numpy.ndarray, shape (n,)
        s, increasing.
    longest_s : float

    Returns
    -------
    numpy.ndarray, shape (k, 2)
        s.
    """
    late = np.flatnonzero(np.diff(time) > longest_s)
    return np.stack([time[late], time[late + 1]], axis=1)
