"""MATLAB files of version 5 (``save -v6``, ``-v7``), read by scipy in a child process (`base.run_in_child`).

The library believes the sizes that a file states, and a damaged file may end the process that reads it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rftfit.logs.base import (
    BOUNDS,
    MOST_UNPACKED,
    check_unpacked,
    limited_memory,
    refuse_large_file,
)

_NO_ARRAYS = {
    "MatlabObject": "an object",
    "MatlabOpaque": "an object: a MATLAB table or timeseries",
    "MatlabFunction": "a function",
}
"""Type of scipy for a content without numbers, to the words for the user."""

_MOST_MEMORY = 2 * MOST_UNPACKED
"""Most memory for reading one file, bytes: its content, and a copy while it is unpacked."""

MOST_EXPANSION = 1032 * 8
"""Most bytes of content for one byte of file: deflate unpacks it to 1032, and each may hold a number of 8 bytes."""


class NoArray(NamedTuple):
    """Content of a MATLAB file that is no array of numbers; `what`: the words for it."""

    what: str


def load_mat5(path: Path) -> dict[str, Any]:
    """Read the variables of a file: name, to array; a struct is an array of records, a cell array one of objects.

    Contents without numbers are `NoArray`. Raises `LogError` for a file that unpacks to more than is allowed, and
    whatever the library raises on a damaged one.
    """
    from scipy.io import loadmat, whosmat

    refuse_large_file(path)
    most_bytes = MOST_EXPANSION * path.stat().st_size + BOUNDS.library_bytes
    try:
        with limited_memory(min(most_bytes, _MOST_MEMORY)):
            variables = loadmat(path, chars_as_strings=False)
    except Exception:
        # a file that states too large sizes is refused as too large, not as damaged
        with limited_memory(_MOST_MEMORY):
            shapes = [shape for _, shape, _ in whosmat(path)]
        check_unpacked(path, sum(8 * math.prod(shape) for shape in shapes))
        raise
    sizes = [value.size for value in variables.values() if isinstance(value, np.ndarray)]
    check_unpacked(path, 8 * sum(sizes))
    return {
        name: _without_objects(value)
        for name, value in variables.items()
        if not name.startswith("__")
    }


def _without_objects(value: Any) -> Any:
    """Return numbers, texts, records and cells unchanged, but anything else in them as `NoArray`."""
    if (name := type(value).__name__) in _NO_ARRAYS:
        return NoArray(_NO_ARRAYS[name])
    if not isinstance(value, np.ndarray):
        return NoArray("a sparse matrix")
    if value.dtype.kind == "c":
        return NoArray("complex numbers")
    if not value.dtype.hasobject:
        return value
    values = np.empty(value.shape, value.dtype)
    for index, cell in np.ndenumerate(value):
        is_record = value.dtype.names is not None
        values[index] = tuple(map(_without_objects, cell)) if is_record else _without_objects(cell)
    return values
