"""Rows of several sources in one log: a column tells them apart where readings jump with it, and they are never read as one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import unknown_word
from rftfit.conventions import FloatArray
from rftfit.logs.base import LogError

_MOST_LISTED = 8


# --- Whether readings jump where a label changes, and go on where each label stopped


_LEAST_STRETCHES = 2
"""Stretches of rows of each of two labels, at least: sources that follow one another are not mixed."""
_LEAST_ROWS = 4
"""Rows of a label on average, at least: a counter has one of each."""
_FEWEST, _MOST = 4, 50
"""Rows of a label through which a line is drawn to the next change."""
_MOST_CHANGES = 4000
"""Changes of the label that are judged, evenly over the log."""
_LEAST_JUMPS = 3
"""Jumps that tell sources apart, at least."""
_LEAST_SHARE = 0.75
"""Share of the changes that tell anything at which the readings are those of sources."""
_FEW_CHANGES, _LEAST_SHARE_OF_FEW = 8, 0.5
"""Of so few changes one or two lie where a force begins to grow, and tell nothing of either."""
_TIMES_NOISE = 4.0
_TIMES_CLOSER = 2.0
"""Readings go on with their own label's line so many times closer than with the line of the rows just before."""
_LEAST_PART = 5e-4
"""Part of the range of readings below which a jump does not matter."""
_OF_NORMAL = 0.6745
"""Median of the absolute value of normal noise, in standard deviations."""


def sources_in_turn(labels: Sequence[str], readings: Iterable[npt.ArrayLike]) -> list[str]:
    """Name the sources that a column tells apart in the rows of a log.

    At each change of the label two lines are drawn: one through the rows just before, one through the last rows of the
    same label. Readings of one source go on with the first, whatever its state is called; those of several go on with
    the second.

    Parameters
    ----------
    labels : sequence of str
        What the column says of each row, n of them.
    readings : iterable of array_like
        Columns of readings, shape (n,) each, NaN where there is none.

    Returns
    -------
    list of str
        Labels in alphabetical order; empty where the rows are of one source.
    """
    number_by_label: dict[str, int] = {}
    codes = np.array([number_by_label.setdefault(label, len(number_by_label)) for label in labels])
    if len(number_by_label) < 2 or codes.size < _LEAST_ROWS * len(number_by_label):
        return []
    starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]]))
    stretches = np.bincount(codes[starts])
    if np.count_nonzero(stretches >= _LEAST_STRETCHES) < 2:
        return []
    for column in readings:
        values = np.asarray(column, dtype=float)
        is_finite = np.isfinite(values)
        if _follows_label(codes[is_finite], values[is_finite], np.flatnonzero(is_finite)):
            return sorted(number_by_label)
    return []


def _follows_label(codes: np.ndarray, values: FloatArray, row: np.ndarray) -> bool:
    """Whether readings go on with the line of their own label, and not with that of the rows just before."""
    changes = np.flatnonzero(codes[1:] != codes[:-1]) + 1
    if changes.size < _LEAST_JUMPS:
        return False
    changes = changes[
        np.linspace(0, changes.size - 1, min(changes.size, _MOST_CHANGES)).astype(int)
    ]
    order = np.argsort(codes, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    lines = _Lines(codes[order], values[order], row[order].astype(float))
    with_own, is_own = lines.departure(rank[changes], changes, values, row)
    with_other, is_other = lines.departure(rank[changes - 1] + 1, changes, values, row)
    both = is_own & is_other
    with_own, with_other = with_own[both], with_other[both]
    if with_own.size < _LEAST_JUMPS:
        return False
    # a state that a threshold makes of the readings themselves parts their noise
    apart = float(np.median(np.abs(np.diff(lines.values, n=2)))) / math.sqrt(6)
    noise = max(
        float(np.median(with_own)) / _OF_NORMAL,
        apart / _OF_NORMAL,
        _LEAST_PART * float(np.ptp(values)),
    )
    tells = np.maximum(with_own, with_other) > _TIMES_NOISE * noise
    # where a force begins to grow neither line tells
    jumps = int(np.count_nonzero(tells & (with_other > _TIMES_CLOSER * with_own)))
    goes_on = int(np.count_nonzero(tells & (with_own > _TIMES_CLOSER * with_other)))
    n_tells = int(np.count_nonzero(tells))
    share = _LEAST_SHARE if n_tells > _FEW_CHANGES else _LEAST_SHARE_OF_FEW
    return jumps >= max(_LEAST_JUMPS, _LEAST_SHARE * (jumps + goes_on), share * n_tells)


class _Lines:
    """Readings in the order of their labels, and straight lines through the last of them."""

    def __init__(self, codes: np.ndarray, values: FloatArray, row: FloatArray) -> None:
        self.values, self.row = values, row
        is_first = np.concatenate([[True], codes[1:] != codes[:-1]])
        place = np.arange(codes.size)
        # first reading of the label, and of the stretch, that a reading is of
        self.first = np.maximum.accumulate(np.where(is_first, place, 0))
        is_gap = is_first | np.concatenate([[True], np.diff(row) > 1])
        self.stretch = np.maximum.accumulate(np.where(is_gap, place, 0))

    def departure(
        self, ends: np.ndarray, changes: np.ndarray, values: FloatArray, row: np.ndarray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Departure of the readings at `changes` from the lines that end before `ends`, in units of their noise.

        Also returns whether enough readings make the line.
        """
        last = np.maximum(ends - 1, 0)
        wanted = np.clip(ends - self.stretch[last], _FEWEST, _MOST)
        places = ends[:, None] - 1 - np.arange(_MOST)
        is_used = (places >= self.first[last][:, None]) & (np.arange(_MOST) < wanted[:, None])
        # before the first reading of a label there is that of another one
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
        return np.abs(departure) / scale, count >= _FEWEST - 1


def several_sources(column: str, sources: Sequence[str]) -> str:
    """Say that rows are of several sources, and how the config says which are meant."""
    listed = ", ".join(map(repr, sources[:_MOST_LISTED]))
    remainder = f" and {len(sources) - _MOST_LISTED} more" if len(sources) > _MOST_LISTED else ""
    return (
        f"rows of several sources: the column {column} says {listed}{remainder} in turn, and readings jump where it changes; "
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
    """Refuse a log in which a column tells that sources take turns, unless the config chose among them.

    `readings`: Columns of readings, as many in each as there are labels.
    """
    chosen = {*where}
    for column, labels in columns.items():
        if column not in chosen and (sources := sources_in_turn(labels, readings)):
            before = f"{path}: " if path else ""
            raise LogError("several-sources", before + several_sources(column, sources), rows)


def places_of(
    where: Mapping[str, tuple[str, ...]], names: Sequence[str]
) -> tuple[tuple[int, tuple[str, ...]], ...]:
    """Places of the columns that the config names under `where`, and their words.

    Raises
    ------
    LogError
        If there is no such column.
    """
    if unknown := [name for name in where if name not in names]:
        listed = "; ".join(unknown_word("column", name, names) for name in unknown)
        raise LogError("where", f"`where` of the config: {listed}")
    return tuple((names.index(name), words) for name, words in where.items())
