"""Finds rows of several sources (two sensors, say) in one log, so that they are never read as one.

A column of labels tells sources apart if the readings jump where the label changes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
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
    codes = np.array([number_by_label.setdefault(label, len(number_by_label)) for label in labels])
    if len(number_by_label) < 2 or codes.size < _CHOSEN.rows * len(number_by_label):
        return []
    starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]]))
    stretches = np.bincount(codes[starts])
    if np.count_nonzero(stretches >= _CHOSEN.stretches) < 2:
        return []
    for column in readings:
        values = np.asarray(column, dtype=float)
        is_finite = np.isfinite(values)
        if _follows_label(codes[is_finite], values[is_finite], np.flatnonzero(is_finite)):
            return sorted(number_by_label)
    return []


def _follows_label(codes: np.ndarray, values: FloatArray, row: np.ndarray) -> bool:
    """Return whether readings continue the line of their own label, and not the line of the rows just before.

    `codes`, `values`, `row`: Number of the label, reading, and row in the log, shape (n,), of all finite readings.
    """
    changes = np.flatnonzero(codes[1:] != codes[:-1]) + 1
    if changes.size < _CHOSEN.jumps:
        return False
    changes = changes[
        np.linspace(0, changes.size - 1, min(changes.size, _CHOSEN.changes)).astype(int)
    ]
    # sorted by label, the last readings of a label stand side by side; rank: place there of each reading
    order = np.argsort(codes, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    lines = _Lines(codes[order], values[order], row[order].astype(float))
    with_own, is_own = lines.departure(rank[changes], changes, values, row)
    with_other, is_other = lines.departure(rank[changes - 1] + 1, changes, values, row)
    both = is_own & is_other
    with_own, with_other = with_own[both], with_other[both]
    if with_own.size < _CHOSEN.jumps:
        return False
    # a label may be a threshold of the readings: each label then has half of the noise, and departures are too small
    # the second difference of white noise has sqrt(6) times its standard deviation
    second_difference = float(np.median(np.abs(np.diff(lines.values, n=2)))) / math.sqrt(6)
    noise = max(
        float(np.median(with_own)) / _MEDIAN_OF_NORMAL,
        second_difference / _MEDIAN_OF_NORMAL,
        _CHOSEN.range * float(np.ptp(values)),
    )
    # where a force begins to grow, neither line fits
    decides = np.maximum(with_own, with_other) > _CHOSEN.times_noise * noise
    jumps = int(np.count_nonzero(decides & (with_other > _CHOSEN.times_closer * with_own)))
    continuations = int(np.count_nonzero(decides & (with_own > _CHOSEN.times_closer * with_other)))
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
        place = np.arange(codes.size)
        # for each reading, the place of the first reading of its label, and of its stretch of rows
        self.first = np.maximum.accumulate(np.where(is_first, place, 0))
        is_gap = is_first | np.concatenate([[True], np.diff(row) > 1])
        self.stretch = np.maximum.accumulate(np.where(is_gap, place, 0))

    def departure(
        self, ends: np.ndarray, changes: np.ndarray, values: FloatArray, row: np.ndarray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Return how far the readings at `changes` are from the lines that end before `ends`, and if there is a line.

        The distance is divided by the standard error of the extrapolated line for noise of 1, so that it is comparable
        with the noise. A line exists where there are enough readings. `ends`: Places in the order of labels; `changes`:
        places in `values` and `row`, which are in the order of the log; all results have the shape of `changes`.
        """
        last = np.maximum(ends - 1, 0)
        wanted = np.clip(ends - self.stretch[last], _CHOSEN.fewest_fitted, _CHOSEN.most_fitted)
        places = ends[:, None] - 1 - np.arange(_CHOSEN.most_fitted)
        is_used = (places >= self.first[last][:, None]) & (
            np.arange(_CHOSEN.most_fitted) < wanted[:, None]
        )
        # before the first reading of a label stands a reading of another label
        is_used &= (ends[:, None] > 0) & (places >= 0)
        count = is_used.sum(axis=1)
        safe = np.maximum(count, 1)
        places = np.maximum(places, 0)
        x = np.where(is_used, self.row[places] - row[changes][:, None], 0.0)
        y = np.where(is_used, self.values[places], 0.0)
        mean_x, mean_y = x.sum(axis=1) / safe, y.sum(axis=1) / safe
        away = np.where(is_used, x - mean_x[:, None], 0.0)
        spread = np.maximum((away**2).sum(axis=1), 1e-300)
        slope = (away * y).sum(axis=1) / spread
        departure = values[changes] - (mean_y - slope * mean_x)
        scale = np.sqrt(1 + 1 / safe + mean_x**2 / spread)
        return np.abs(departure) / scale, count >= _CHOSEN.fewest_fitted - 1


def describe_several_sources(column: str, sources: Sequence[str]) -> str:
    """Return the sentence for the user: rows are of several sources, and the config can choose one."""
    listed = join_words(map(repr, sources), 8)
    return (
        f"rows of several sources: the column {column} says {listed} in turn, and readings jump where it changes; "
        f"say which are meant, in force_log and in motion_log of the config: `where: {{{column}: {sources[0]}}}` "
        "(a list where several are one source)"
    )


def refuse_several_sources(
    path: Path | None,
    columns: Mapping[str, Sequence[str]],
    where: Iterable[str],
    readings: Sequence[npt.ArrayLike],
    rows: int = 0,
) -> None:
    """Refuse a log whose rows are of several sources in turn, unless the config chose among them.

    `columns`: Column to its label of each row. `where`: Columns by which the config chose. `readings`: Columns of
    readings, with as many rows as there are labels. `rows`: Data lines in the file.
    """
    chosen = {*where}
    for column, labels in columns.items():
        if column not in chosen and (sources := sources_in_turn(labels, readings)):
            before = f"{path}: " if path else ""
            raise LogError(
                "several-sources", before + describe_several_sources(column, sources), rows
            )


def places_of(
    where: Mapping[str, tuple[str, ...]], names: Sequence[str]
) -> tuple[tuple[int, tuple[str, ...]], ...]:
    """Return the place of each column that the config names under `where`, and the words that choose rows.

    Raises
    ------
    LogError
        If there is no such column.
    """
    if unknown := [name for name in where if name not in names]:
        listed = "; ".join(unknown_word("column", name, names) for name in unknown)
        raise LogError("where", f"`where` of the config: {listed}")
    return tuple((names.index(name), words) for name, words in where.items())
