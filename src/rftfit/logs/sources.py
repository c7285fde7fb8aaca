"""Finds rows of several sources (two sensors, say) in one log, so that they are never read as one.

A *source* is a sensor, or anything else of which a label in each row tells its rows from others. A column of labels
names sources if the readings jump where the label changes; else it may name a state, as "loading" and "unloading".
Shapes: n rows, m changes of the label. Numbers such as ``_CHOSEN.jumps`` stand in ``chosen.toml``, in the table
``sources``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import join_words, unknown_word
from rftfit.conventions import FloatArray
from rftfit.logs.base import LogError
from rftfit.store.chosen import chosen

# --- Do readings jump where the label changes, and continue where the same label stopped before?


_CHOSEN = chosen("logs", "sources")
_MEDIAN_OF_NORMAL = 0.6745
"""Median of the absolute value of normal noise, in standard deviations; converts a median to a standard deviation."""


def sources_in_turn(labels: Sequence[str], readings: Iterable[npt.ArrayLike]) -> list[str]:
    """Return the sources that a column of labels tells apart in the rows of a log.

    At each change of the label two lines are fitted: one through the rows just before, one through the last rows of
    the label that begins again. The readings of one source continue the first line, even if the label (of a state,
    for example) changes; the readings of several sources continue the second line.

    Parameters
    ----------
    labels : sequence of str
        Label of each row, n of them.
    readings : iterable of array_like
        Columns of readings, shape (n,) each, NaN where there is none.

    Returns
    -------
    list of str
        Labels in alphabetical order; empty where the rows are of one source.
    """
    number_by_label: dict[str, int] = {}
    # number of the label of each row
    codes = np.array([number_by_label.setdefault(label, len(number_by_label)) for label in labels])
    if len(number_by_label) < 2 or codes.size < _CHOSEN.rows * len(number_by_label):
        return []
    # stretches of rows with one label, counted by label: sources take turns, so that two labels have several each
    starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]]))
    stretches = np.bincount(codes[starts])
    if np.count_nonzero(stretches >= _CHOSEN.stretches) < 2:
        return []
    for column in readings:
        values = np.asarray(column, dtype=float)
        is_finite = np.isfinite(values)
        if _follow_label(codes[is_finite], values[is_finite], np.flatnonzero(is_finite)):
            return sorted(number_by_label)
    return []


def _follow_label(codes: np.ndarray, values: FloatArray, row: np.ndarray) -> bool:
    """Return whether readings, where the label changes, continue the earlier rows of the label and not the rows before.

    `codes`, `values`, `row`: Number of the label, reading, and row in the log, shape (n,), of all finite readings.
    """
    # index of the first reading behind each change of the label; of many changes some, evenly over the log
    changes = np.flatnonzero(codes[1:] != codes[:-1]) + 1
    if changes.size < _CHOSEN.jumps:
        return False
    changes = changes[
        np.linspace(0, changes.size - 1, min(changes.size, _CHOSEN.changes)).astype(int)
    ]
    # sorted by label, the earlier readings of a label stand just before; rank: index there of each reading
    order = np.argsort(codes, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    lines = _Lines(codes[order], values[order], row[order].astype(float))
    # how far the first reading behind a change is from the line of its label, and from that of the rows before
    from_label, has_label = lines.departure(rank[changes], values[changes], row[changes])
    from_rows, has_rows = lines.departure(rank[changes - 1] + 1, values[changes], row[changes])
    # the first reading of a label continues no line: the readings sorted before it are of another label
    has_label &= lines.first[rank[changes]] < rank[changes]
    has_both = has_label & has_rows
    from_label, from_rows = from_label[has_both], from_rows[has_both]
    if from_label.size < _CHOSEN.jumps:
        return False
    # a label may be a threshold of the readings: each label then has half of the noise, and departures are too small
    # the second difference of white noise has sqrt(6) times its standard deviation
    second_difference = float(np.median(np.abs(np.diff(lines.values, n=2)))) / math.sqrt(6)
    noise = max(
        float(np.median(from_label)) / _MEDIAN_OF_NORMAL,
        second_difference / _MEDIAN_OF_NORMAL,
        _CHOSEN.range * float(np.ptp(values)),
    )
    # where both lines fit, a change shows nothing
    decides = np.maximum(from_label, from_rows) > _CHOSEN.times_noise * noise
    jumps = int(np.count_nonzero(decides & (from_rows > _CHOSEN.times_closer * from_label)))
    continuations = int(np.count_nonzero(decides & (from_label > _CHOSEN.times_closer * from_rows)))
    # where a force begins to grow, neither line fits: such a change is neither a jump nor a continuation
    n_decides = int(np.count_nonzero(decides))
    share = _CHOSEN.share if n_decides > _CHOSEN.few_changes else _CHOSEN.share_of_few
    fewest: float = max(_CHOSEN.jumps, _CHOSEN.share * (jumps + continuations), share * n_decides)
    return jumps >= fewest


class _Lines:
    """Readings sorted by label, and straight lines through the last readings of a label.

    `codes`, `values`, `row`: Number of the label, reading and row in the log, shape (n,), sorted by label.
    """

    def __init__(self, codes: np.ndarray, values: FloatArray, row: FloatArray) -> None:
        self.values, self.row = values, row
        is_first = np.concatenate([[True], codes[1:] != codes[:-1]])
        index = np.arange(codes.size)
        # for each reading, the index of the first reading of its label, and of its stretch of rows without a gap
        self.first = np.maximum.accumulate(np.where(is_first, index, 0))
        is_after_gap = is_first | np.concatenate([[True], np.diff(row) > 1])
        self.stretch = np.maximum.accumulate(np.where(is_after_gap, index, 0))

    def departure(
        self, ends: np.ndarray, values: FloatArray, row: np.ndarray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Return how far m readings are from m lines that are extrapolated to them, and which lines exist, shape (m,).

        Line i is fitted by least squares, reading over row, through the last sorted readings before index ``ends[i]``:
        those of its stretch of rows, but at least `fewest_fitted` and at most `most_fitted`, all of the label of reading
        ``ends[i] - 1``. It exists where one less than `fewest_fitted` are there. The distance
        is divided by the standard error of a new reading at the extrapolated line for noise of 1, so that it is
        comparable with the noise. `values`, `row`: Readings and their rows in the log, shape (m,).
        """
        # the last reading that each line may have, and how many readings it is to have
        last = np.maximum(ends - 1, 0)
        n_wanted = np.clip(ends - self.stretch[last], _CHOSEN.fewest_fitted, _CHOSEN.most_fitted)
        steps_back = np.arange(_CHOSEN.most_fitted)
        fitted = ends[:, None] - 1 - steps_back  # indices, shape (m, most_fitted)
        is_used = (fitted >= self.first[last][:, None]) & (steps_back < n_wanted[:, None])
        # before the first reading stands none
        is_used &= fitted >= 0
        n_used = is_used.sum(axis=1)
        divisor = np.maximum(n_used, 1)
        fitted = np.maximum(fitted, 0)
        # x: rows from the reading, so that the line is extrapolated to x = 0
        x = np.where(is_used, self.row[fitted] - row[:, None], 0.0)
        y = np.where(is_used, self.values[fitted], 0.0)
        mean_x, mean_y = x.sum(axis=1) / divisor, y.sum(axis=1) / divisor
        centred_x = np.where(is_used, x - mean_x[:, None], 0.0)
        sum_of_squares = np.maximum((centred_x**2).sum(axis=1), 1e-300)
        slope = (centred_x * y).sum(axis=1) / sum_of_squares
        departure = values - (mean_y - slope * mean_x)
        standard_error = np.sqrt(1 + 1 / divisor + mean_x**2 / sum_of_squares)
        return np.abs(departure) / standard_error, n_used >= _CHOSEN.fewest_fitted - 1


def refuse_several_sources(
    path: Path,
    columns: Mapping[str, Sequence[str]],
    where: Collection[str],
    readings: Sequence[npt.ArrayLike],
    rows: int = 0,
) -> None:
    """Raise `LogError` for a log whose rows are of several sources in turn, unless the config chose among them.

    `columns`: Column, to its label of each row. `where`: Columns by which the config chose. `readings`: Columns of
    readings, with as many rows as there are labels. `rows`: Data lines in the file.
    """
    for column, labels in columns.items():
        if column not in where and (sources := sources_in_turn(labels, readings)):
            listed = join_words(map(repr, sources), 8)
            raise LogError(
                "several-sources",
                f"{path}: rows of several sources: the column {column} says {listed} in turn, and readings jump where it "
                "changes; say which are meant, in force_log and in motion_log of the config: "
                f"`where: {{{column}: {sources[0]}}}` (a list where several are one source)",
                rows,
            )


def check_where(
    path: Path, where: Collection[str], names: Collection[str], noun: str = "column"
) -> None:
    """Raise `LogError` for a log that lacks a column that the config names under `where`.

    `names`: Names of its columns. `noun`: What they are, for the message.
    """
    if unknown := [name for name in where if name not in names]:
        listed = "; ".join(unknown_word(noun, name, [*names]) for name in unknown)
        raise LogError("where", f"{path}: `where` of the config: {listed}")
