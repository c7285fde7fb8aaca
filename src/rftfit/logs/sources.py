"""Rows of several sources in one log: a word, a number or a frame tells them apart, and they are never read as one."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rftfit.campaign.problems import unknown_word
from rftfit.logs.base import LogError

OTHER_SOURCE = "of another source (`where` in the config)"
_MOST_SOURCES = 20
_LEAST_STRETCHES = 3
_SHORTEST = 3.0
"""Where sources take turns, one of them is there for so many rows at a time or fewer; a state stays for longer."""
_MOST_LISTED = 8
IDENTITY = re.compile(
    r"(?i)(^|[\s_.])(sensor|channel|id|device|source|frame|frame_id|topic|node|address|addr|unit|joint|probe|cell|can_id)"
    r"([\s_.]?(id|no|nr|number|name|index))?$"
)
"""Names of columns whose numbers are the names of something, and no readings."""


def sources_of(labels: Sequence[str]) -> list[str]:
    """Name the sources that take turns in the rows of a log.

    Parameters
    ----------
    labels : sequence of str
        What a column says of each row.

    Returns
    -------
    list of str
        Empty where the rows are of one source: all alike, all different, or of one after the other.
    """
    stretches: dict[str, list[int]] = {}
    for label, same in groupby(labels):
        stretches.setdefault(label, []).append(sum(1 for _ in same))
        if len(stretches) > _MOST_SOURCES:
            return []
    often = {label for label, lengths in stretches.items() if len(lengths) >= _LEAST_STRETCHES}
    in_turn = any(float(np.median(stretches[label])) <= _SHORTEST for label in often)
    return sorted(stretches) if len(often) > 1 and in_turn else []


_JUMPS = 1.5
"""Readings of two sources go so many times as far from row to row as within each source, or farther."""


def readings_differ(labels: Sequence[str], readings: Iterable[npt.ArrayLike]) -> bool:
    """Whether readings jump where the label changes, so that it tells sources apart and not states of one.

    `readings`: Of each column of numbers one for each label, NaN where there is none.
    """
    names = np.asarray(labels)
    for column in readings:
        values = np.asarray(column, dtype=float)
        is_finite = np.isfinite(values)
        if np.count_nonzero(is_finite) < _FEWEST_READINGS:
            continue
        within = sum(
            float(np.abs(np.diff(values[is_finite & (names == label)])).sum())
            for label in np.unique(names[is_finite])
        )
        if float(np.abs(np.diff(values[is_finite])).sum()) > _JUMPS * within:
            return True
    return False


_FEWEST_READINGS = 8


def several_sources(column: str, sources: Sequence[str]) -> str:
    """Say that rows are of several sources, and how the config says which are meant."""
    listed = ", ".join(map(repr, sources[:_MOST_LISTED]))
    remainder = f" and {len(sources) - _MOST_LISTED} more" if len(sources) > _MOST_LISTED else ""
    return (
        f"rows of several sources: the column {column} says {listed}{remainder} in turn; say which are meant, in force_log and "
        f"in motion_log of the config: `where: {{{column}: {sources[0]}}}` (a list where several are one source)"
    )


def refuse_several_sources(
    path: Path | None,
    columns: Mapping[str, Sequence[str]],
    where: Iterable[str],
    readings: Callable[[], Iterable[npt.ArrayLike]],
    rows: int = 0,
) -> None:
    """Refuse a log in which a column tells that sources take turns, unless the config chose among them.

    `readings`: Gives those of each column of numbers, as many as there are labels; asked for where labels
    take turns only.
    """
    chosen = {*where}
    for column, labels in columns.items():
        sources = [] if column in chosen else sources_of(labels)
        if sources and readings_differ(labels, readings()):
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


def is_meant(labels: Sequence[object], allowed: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Tell the rows whose label is one of those that are allowed; numbers are compared as numbers."""
    words = {*allowed}
    numbers = {number for word in allowed if (number := _number(word)) is not None}

    def meant(label: object) -> bool:
        text = str(label).strip()
        return text in words or (bool(numbers) and _number(text) in numbers)

    meant_by_label: dict[object, bool] = {}
    return np.array(
        [meant_by_label.setdefault(label, meant(label)) for label in labels], dtype=bool
    )


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
