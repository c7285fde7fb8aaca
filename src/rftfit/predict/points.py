"""Small csv files of numbers that a user makes by hand: outlines and paths."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.problems import CampaignError, Problem, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rftfit.conventions import FloatArray

_MAX_BYTES = 50_000_000
_DELIMITERS = (",", ";", "\t")


def read_points(
    path: Path, columns: Sequence[str], kind: str
) -> tuple[FloatArray, list[int], list[Problem]]:
    """Read named columns of finite numbers.

    Parameters
    ----------
    path : Path
        csv: lines starting with ``#`` are comments, then one header row; comma, semicolon or tab.
    columns : sequence of str
        Wanted; others are left alone.
    kind : str
        First part of the code of problems, for example ``outline``.

    Returns
    -------
    values : numpy.ndarray, shape (n, len(columns))
        The rows without a problem.
    rows : list of int
        Their numbers, as a spreadsheet counts.
    problems : list of Problem
        One for each bad cell.

    Raises
    ------
    InputError
        If the file cannot be read, or a column is missing.
    """
    file = str(path)
    data = read_bytes(path, file, kind, _MAX_BYTES)
    text = data if isinstance(data, Problem) else decode(data, file, kind)
    if isinstance(text, Problem):
        raise CampaignError([text])
    lines = [
        (row, line)
        for row, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    header_row, header = lines[0] if lines else (1, "")
    delimiter = max(_DELIMITERS, key=lambda mark: sum(c in _cells(header, mark) for c in columns))
    names = _cells(header, delimiter)
    missing = [column for column in columns if column not in names]
    if missing:
        allowed = f"a header row with the columns {', '.join(columns)}"
        raise CampaignError(
            [
                Problem(
                    file,
                    header_row,
                    column,
                    None,
                    f"missing; {allowed}",
                    f"{kind}.no-column",
                    nearest=did_you_mean(column, [n for n in names if n not in columns]),
                )
                for column in missing
            ]
        )
    places = [names.index(column) for column in columns]
    good: list[list[float]] = []
    rows: list[int] = []
    problems: list[Problem] = []
    for row, line in lines[1:]:
        cells = _cells(line, delimiter)
        values = []
        for column, index in zip(columns, places, strict=True):
            found = cells[index] if index < len(cells) else ""
            value = _number(found)
            if value is None:
                allowed = "a finite number with a decimal point"
                problems.append(Problem(file, row, column, found, allowed, f"{kind}.not-a-number"))
            else:
                values.append(value)
        if len(values) == len(columns):
            good.append(values)
            rows.append(row)
    return np.array(good, dtype=float).reshape(-1, len(columns)), rows, problems


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=delimiter), [])]


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    # Python would take 1_0 for 10
    return value if math.isfinite(value) and "_" not in text else None
