"""Files of arrays: MATLAB (.mat), HDF5 (.h5), NumPy (.npy, .npz); a column is named by its path inside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import (
    Log,
    LogError,
    RatedReader,
    check_size,
    file_errors,
    ns_to_s,
    package_needed,
)
from rftfit.logs.units import names_and_units, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rftfit.conventions import FloatArray

MOST_COLUMNS = 64
"""A table with more columns than this is a picture or a field, no log."""

_HDF5, _NPY, _NPZ, _MAT5, _MAT7 = (
    b"\x89HDF\r\n\x1a\n", b"\x93NUMPY", b"PK\x03\x04", b"MATLAB 5.0", b"MATLAB 7.3",
)  # fmt: skip

Column = tuple[np.ndarray, str]
"""Values, of shape (n,), and the unit that the file states."""


class ArraysReader(RatedReader):
    """Every array of numbers is a column, every column of a table too; `rate_Hz` where no time is."""

    name = "arrays"
    description = "arrays of MATLAB (.mat), HDF5 (.h5) or NumPy (.npy, .npz), by their paths"
    evidence = "the first bytes of a MATLAB, HDF5 or NumPy file"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        numpy_archive = head.startswith(_NPZ) and b".npy" in head[:400]
        return head.startswith((_HDF5, _NPY, _MAT5, _MAT7)) or numpy_archive

    def load(self, path: Path) -> Log:
        """Read the arrays that are asked for; without being asked, those of the most frequent length."""
        with file_errors(path), path.open("rb") as file:
            check_size(path)
            head = file.read(16)
        try:
            found = dict(_columns(path, head))
        except LogError:
            raise
        except Exception as error:  # each library has errors of its own for a damaged file
            why = str(error) or type(error).__name__
            raise LogError("damaged", f"{path}: damaged, or no file of arrays: {why}") from error
        return self._log(path, found)

    def _log(self, path: Path, found: dict[str, Column]) -> Log:
        names, in_names = names_and_units(found)
        pairs = zip(found.values(), in_names, strict=True)
        units = [stated or unit for (_, stated), unit in pairs]
        columns = dict(zip(names, (values for values, _ in found.values()), strict=True))
        if not columns:
            text = "no array of numbers with more than one value; objects (a MATLAB table or timeseries) "
            raise LogError("header_only", f"{path}: {text}have to be saved as plain arrays")
        wanted = self.wanted(columns)
        sizes = {name: values.size for name, values in columns.items() if name in wanted}
        size = max(sizes.values(), key=lambda n: (list(sizes.values()).count(n), n), default=0)
        others = [f"{name} ({n})" for name, n in sizes.items() if n != size]
        if others and set(wanted) != set(columns):
            same = ", ".join(name for name, n in sizes.items() if n == size)
            raise LogError(
                "lengths",
                f"{path}: the columns of a log have one length, found {size} values of {same}, and "
                f"others: {', '.join(others)}",
                max(sizes.values()),
            )
        notes = [f"arrays of another length, left out: {', '.join(others)}"] if others else []
        kept = {n: columns[n].astype(float, copy=False) for n, k in sizes.items() if k == size}
        stated = {name: unit for name, unit in zip(names, units, strict=True) if name in kept}
        if self._rate and "time" not in kept:
            kept, stated = {"time": np.arange(size) / self._rate, **kept}, {"time": "s", **stated}
            notes.append(f"time is the place in the array / {self._rate:g} Hz (the config)")
        return Log(path, kept, stated, size, notes=tuple(notes)).finite()


def _columns(path: Path, head: bytes) -> Iterator[tuple[str, Column]]:
    if head.startswith(_MAT5):
        from scipy.io import loadmat

        # as they were saved: structs as records, nothing squeezed
        for name, value in loadmat(path).items():
            if not name.startswith("__"):
                yield from _of_array(name, value)
    elif head.startswith((_NPY, _NPZ)):
        with path.open("rb") as file:
            content = np.load(file, allow_pickle=False)
            single = isinstance(content, np.ndarray)
            for name in [""] if single else content.files:
                yield from _of_array(name, content if single else content[name])
    elif head.startswith((_HDF5, _MAT7)):
        yield from _of_hdf5(path)
    else:
        raise LogError("header", f"{path}: neither a MATLAB (5 or 7.3), HDF5 nor NumPy file")


def _of_hdf5(path: Path) -> Iterator[tuple[str, Column]]:
    try:
        import h5py
    except ImportError:
        what = "HDF5 files and .mat of version 7.3"
        raise package_needed(path, what, "h5py", "hdf5") from None
    datasets: list[tuple[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        # MATLAB keeps what its references lead to in a group of its own
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            datasets.append((name, item))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
        for name, item in datasets:
            kind = item.attrs.get("MATLAB_class", b"")
            table = len(item.shape) == 1 or min(item.shape, default=0) in range(1, MOST_COLUMNS + 1)
            if table and item.dtype.kind in "biufV" and kind != b"char":
                unit = item.attrs.get("unit", item.attrs.get("units", ""))
                text = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
                yield from _of_array(name.replace("/", "."), item[()], unit_word(text))


def _of_array(path: str, value: Any, unit: str = "") -> Iterator[tuple[str, Column]]:
    """Yield the columns of an array: itself, its fields, the columns of a table."""
    array = np.asarray(value)
    if array.dtype.names:
        for name in array.dtype.names:
            yield from _of_array(f"{path}.{name}" if path else name, array[name], unit)
        return
    if array.dtype == object:
        # the record of a MATLAB struct, one of each; cells and lists of several are no columns
        if array.size == 1 and isinstance(array.flat[0], np.ndarray):
            yield from _of_array(path, array.flat[0], unit)
        return
    if array.dtype.kind not in "biufM" or array.size < 2:
        return
    if array.dtype.kind == "M":
        array, unit = ns_to_s(array.astype("datetime64[ns]").astype(np.int64)), "s"
    shape = [length for length in array.shape if length > 1]
    if len(shape) == 1:
        yield path or "column 1", (array.ravel(), unit)
    elif len(shape) == 2 and min(shape) <= MOST_COLUMNS:
        table: FloatArray = array.reshape(shape)
        # samples are more than columns: MATLAB and HDF5 lay a table differently
        for number, values in enumerate(table if shape[0] < shape[1] else table.T, start=1):
            yield f"{path} column {number}".strip(), (values, unit)
