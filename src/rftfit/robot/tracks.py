"""Marker tracks of the robot: read with every row accounted for, or refused with a reason."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.problems import Problem
from rftfit.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.conventions import FloatArray

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}

_MAX_BYTES = 50_000_000
_HEADER = re.compile(
    r"^(?P<what>time|t|x|z)(?:_(?P<unit>[a-z]+)|\s*[\[(]\s*(?P<in>[a-z]+)\s*[\])])$"
)
_ALLOWED = (
    "a header row with a time, x and z, each with its unit, such as time_s,x_cm,z_cm "
    f"(time: {', '.join(SECONDS)}; x, z: {', '.join(CENTIMETRES)})"
)


class TrackError(InputError):
    """A track that cannot be used.

    Parameters
    ----------
    reason : str
        Why, without the file's name.
    file : str, optional
    rows : int, optional
        Data lines of the file, so far as they could be counted.
    """

    def __init__(self, reason: str, file: str = "", rows: int = 0) -> None:
        self.reason, self.rows = reason, rows
        super().__init__(f"{file}: {reason}" if file else reason)


@dataclass(frozen=True)
class Track:
    """A marker track.

    Attributes
    ----------
    time_s, x_cm, z_cm : numpy.ndarray, shape (n,)
        The usable rows; time counts from the first of them and only grows.
    rows : int
        Data lines of the file.
    dropped : dict of str to int
        Reason to number of rows left out; with the usable ones they add up to `rows`.
    """

    time_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)


def read_track(path: Path) -> Track:
    """Read a marker track.

    Comma-, semicolon- or tab-separated text, UTF-8; lines that start with ``#`` are comments. A row
    with a cell that is blank or no number is left out and counted.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Track

    Raises
    ------
    TrackError
        If the file cannot be read, a column or its unit is missing, time stands still or runs
        backwards, or no row is usable.
    """
    file = path.name
    data = read_bytes(path, file, "track", _MAX_BYTES)
    text = data if isinstance(data, Problem) else decode(data, file, "track")
    if isinstance(text, Problem):
        raise TrackError(text.allowed if text.found is None else f"found {text.found}", file)
    lines = [
        (row, line)
        for row, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise TrackError("the file has no rows; export the track again", file)
    delimiter = max(",;\t", key=lines[0][1].count)
    places, scales = _columns(_cells(lines[0][1], delimiter), file, lines[0][0], len(lines) - 1)
    good: list[list[float]] = []
    numbers: list[int] = []
    dropped: Counter[str] = Counter()
    for row, line in lines[1:]:
        cells = _cells(line, delimiter)
        values = [_number(cells[at]) if at < len(cells) else math.nan for at in places]
        missing = [name for name, value in zip("txz", values, strict=True) if math.isnan(value)]
        if missing:
            what = "time" if missing[0] == "t" else missing[0]
            dropped[f"no number for {what}"] += 1
        else:
            good.append(values)
            numbers.append(row)
    rows = len(lines) - 1
    if not good:
        raise TrackError(f"none of the {rows} rows has a time, x and z", file, rows)
    table = np.array(good) * scales
    back = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if back.size:
        first = int(back[0])
        how = "stands still" if table[first + 1, 0] == table[first, 0] else "runs backwards"
        more = f", and {back.size - 1} times more" if back.size > 1 else ""
        raise TrackError(
            f"time {how} in row {numbers[first + 1]}: {good[first + 1][0]:g} after "
            f"{good[first][0]:g}{more}; allowed: time that grows from row to row",
            file,
            rows,
        )
    time = table[:, 0] - table[0, 0]
    return Track(time, table[:, 1], table[:, 2], rows, dict(dropped))


def _columns(names: list[str], file: str, row: int, rows: int) -> tuple[list[int], FloatArray]:
    """Places of time, x and z, and what their units are in s and cm."""
    places: dict[str, tuple[int, float]] = {}
    for at, name in enumerate(names):
        found = _HEADER.match(name.strip().lower())
        if not found:
            continue
        what = "t" if found["what"] in ("t", "time") else found["what"]
        units = SECONDS if what == "t" else CENTIMETRES
        unit = found["unit"] or found["in"]
        if unit not in units:
            raise TrackError(
                f"row {row}, column {name}: no such unit; allowed: {_ALLOWED}", file, rows
            )
        if what in places:
            raise TrackError(f"row {row}: two columns for {what}; allowed: {_ALLOWED}", file, rows)
        places[what] = at, units[unit]
    lacking = [{"t": "time"}.get(name, name) for name in "txz" if name not in places]
    if lacking:
        found_names = ", ".join(names)[:80]
        raise TrackError(
            f"row {row}: no column for {' and '.join(lacking)} in '{found_names}'; allowed: {_ALLOWED}",
            file,
            rows,
        )
    ordered = [places[name] for name in "txz"]
    return [at for at, _ in ordered], np.array([scale for _, scale in ordered])


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=delimiter), [])]


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) and "_" not in text else math.nan
