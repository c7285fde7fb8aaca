"""Files of arrays: MATLAB (.mat), HDF5 (.h5), NumPy (.npy, .npz); a column is named by its path inside.

The way: each array of the file -> its columns (`_columns_of_array`; in HDF5 scaled as its attributes say,
`_columns_of_dataset`) -> those of one length -> `Log`. An array may be a column itself, a *table* of two dimensions, or
*records* with named fields. Sizes that a file states are checked before anything is read, and MATLAB and HDF5 files are
read in a child process: a damaged file may crash the library.
"""

from __future__ import annotations

import math
import re
import warnings
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rftfit.conventions import FloatArray
from rftfit.logs import base
from rftfit.logs.labels import heed_labels, may_be_labels
from rftfit.logs.mat5 import MOST_EXPANSION, NoArray, load_mat5
from rftfit.logs.quantities import units_by_name
from rftfit.table.stamps import datetimes_to_s
from rftfit.table.units import canonical_unit, units_like

_BOUNDS = base.BOUNDS

_HDF5, _NPY, _NPZ, _MAT5, _MAT7 = (
    b"\x89HDF\r\n\x1a\n",
    b"\x93NUMPY",
    b"PK\x03\x04",
    b"MATLAB 5.0",
    b"MATLAB 7.3",
)
"""First bytes of the kinds of files."""

_NUMBER_KINDS = "biuf"
"""Kinds of numpy types that hold numbers: bool, integer, unsigned integer and float; V is a record, M a date."""


class ArrayColumn(NamedTuple):
    """Values of a column, shape (n,), and what the attributes of the file say about them.

    `unit`: As the file states it; empty: not. `note`: Sentence on how the attributes were applied; empty: no need of
    one.
    `has_blanks`: Whether some values are NaN because the file says that the stored number stands for no value.
    `unapplied`: Scaling that the file states under a name that is no convention, and that was not applied; empty: none.
    """

    values: np.ndarray
    unit: str
    note: str = ""
    has_blanks: bool = False
    unapplied: str = ""


NamedColumns = Iterator[tuple[str, ArrayColumn | str]]
"""Name and column; for an array that is no column, name and a few words on what the array is."""


class ArraysReader(base.Reader):
    """Each array of numbers is a column, and so is each column of a table; `rate_Hz` replaces a column of times."""

    name = "arrays"
    description = "arrays of MATLAB (.mat), HDF5 (.h5) or NumPy (.npy, .npz), by their paths"
    takes = ("rate_Hz",)
    evidence = "the first bytes of a MATLAB, HDF5 or NumPy file"

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        numpy_archive = head.startswith(_NPZ) and b".npy" in head[:400]
        return head.startswith((_HDF5, _NPY, _MAT5, _MAT7)) or numpy_archive

    def load(self, path: Path) -> base.Log:
        """Read the arrays that are asked for, or, where none is, those of the most frequent length.

        Raises `LogError` where those asked for differ in length.
        """
        with base.library_errors(path, "damaged, or no file of arrays"), warnings.catch_warnings():
            # scipy and numpy warn of old versions of a format
            warnings.simplefilter("ignore")
            base.refuse_large_file(path)
            with path.open("rb") as file:
                head = file.read(16)
            array_columns: dict[str, ArrayColumn] = {}
            omitted = []
            contents = _read_columns(path, head)
            for count, (name, content) in enumerate(contents, start=1):
                _refuse_many(path, count)
                if isinstance(content, str):
                    omitted.append(f"{name} ({content})")
                else:
                    array_columns[name] = content
        return self._log(path, array_columns, omitted)

    def _log(
        self, path: Path, array_columns: dict[str, ArrayColumn], omitted: list[str]
    ) -> base.Log:
        """Make a log of the columns of one length, with their units, blanks and labels.

        `array_columns`: Name of each column in the file, to the column. `omitted`: Contents of the file that are no
        columns, in words. Raises `LogError` where there is no column, or those asked for differ in length.
        """
        if not array_columns:
            listed = f"; found {', '.join(omitted)}: save plain arrays" if omitted else ""
            raise base.LogError(
                "header_only", f"{path}: no array of numbers with more than one value{listed}"
            )
        # names without units, to the unit in the name, which counts where the file states none elsewhere
        units_in_names = units_by_name(array_columns)
        columns = dict(zip(units_in_names, array_columns.values(), strict=True))
        notes = [column.note for column in columns.values() if column.note]
        if omitted:
            notes.append(f"no arrays of numbers, left out: {', '.join(omitted)}")
        columns_to_read = self.choose_columns(columns)
        sizes = {name: columns[name].values.size for name in columns if name in columns_to_read}
        size = base.most_frequent([*sizes.values()])
        other_sizes = [f"{name} ({n})" for name, n in sizes.items() if n != size]
        # columns that the config names must not be left out
        if other_sizes and set(columns_to_read) != set(columns):
            same = ", ".join(name for name, n in sizes.items() if n == size)
            raise base.LogError(
                "lengths",
                f"{path}: the columns of a log have one length, found {size} values of {same}, and "
                f"others: {', '.join(other_sizes)}",
                max(sizes.values()),
            )
        if other_sizes:
            notes.append(f"arrays of another length, left out: {', '.join(other_sizes)}")
        read = {name: columns[name] for name, n in sizes.items() if n == size}
        numbers = {name: column.values.astype(float, copy=False) for name, column in read.items()}
        blank = {
            name: is_nan
            for name, values in numbers.items()
            if _are_blanks(is_nan := np.isnan(values)) or read[name].has_blanks
        }
        units = {name: column.unit or units_in_names[name] for name, column in read.items()}
        if self.rate:
            numbers["time"], units["time"] = np.arange(size) / self.rate, "s"
            blank.pop("time", None)
            notes.append(f"time is the place in the array / {self.rate:g} Hz (the config)")
        # columns of few whole numbers that are not read may say which of several sensors a row is from
        labels = {
            name: np.array([f"{value:g}" for value in column.values], dtype=object)
            for name, column in columns.items()
            if name not in sizes
            and column.values.size == size
            and may_be_labels(column.values.astype(float))
        }
        log = base.Log(
            path,
            numbers,
            units,
            size,
            notes=tuple(notes),
            names_in_file=tuple(columns),
            labels=labels,
            unapplied={name: column.unapplied for name, column in read.items() if column.unapplied},
        )
        log = log.without_blanks(blank, keeps_blanks=self.keeps_blanks)
        log = heed_labels(log, self)
        return log.without_blank_columns() if self.keeps_blanks and blank else log


def _refuse_many(path: Path, count: int) -> None:
    """Raise `LogError` for a file with more arrays than a log may have."""
    if count > _BOUNDS.arrays:
        problem = f"more than {_BOUNDS.arrays} arrays, which no log of a run has"
        raise base.LogError("too_large", f"{path}: {problem}: save those of one run")


def _are_blanks(is_nan: np.ndarray) -> bool:
    """Return whether the NaN of a column are so many that they stand for no value; a rarer NaN is damage.

    `is_nan`: Where they are, bool of shape (n,).
    """
    is_often = np.count_nonzero(is_nan) * base.FIRST.blank_by_share >= is_nan.size > 0
    return bool(is_often and not is_nan.all())


def _read_columns(path: Path, head: bytes) -> NamedColumns:
    """Yield the columns of a file of any kind; `head`: its first bytes, which say of which kind."""
    if head.startswith(_MAT5):
        # imported before the fork, so that no child has to
        import scipy.io.matlab  # noqa: F401

        yield from base.run_in_child(path, _load_in_child)
    elif head.startswith(_NPY):
        with path.open("rb") as file:
            base.check_unpacked(path, _unpacked_bytes(*_npy_header(file)))
            file.seek(0)
            yield from _columns_of_array("", np.load(file, allow_pickle=False))
    elif head.startswith(_NPZ):
        with zipfile.ZipFile(path) as archive:
            names = [name for name in archive.namelist() if name.endswith(".npy")]
            _refuse_many(path, len(names))
            headers = {}
            for name in names:
                with archive.open(name) as member:
                    headers[name] = _npy_header(member)
            base.check_unpacked(path, sum(_unpacked_bytes(*header) for header in headers.values()))
            for name, (_, dtype) in headers.items():
                column = name.removesuffix(".npy")
                if dtype.hasobject:
                    yield column, "objects of Python, which may run any program"
                    continue
                # reads as many numbers as the header states, even if the archive holds more
                with archive.open(name) as member:
                    array = np.lib.format.read_array(member, allow_pickle=False)
                yield from _columns_of_array(column, array)
    elif head.startswith((_HDF5, _MAT7)):
        with base.needed_package(path, "HDF5 files and .mat of version 7.3", "h5py", "hdf5"):
            import h5py  # noqa: F401
        yield from base.run_in_child(path, _load_in_child)
    else:
        raise base.LogError("header", f"{path}: neither a MATLAB (5 or 7.3), HDF5 nor NumPy file")


def _load_in_child(path: Path) -> list[tuple[str, ArrayColumn | str]]:
    """Read the columns of a MATLAB or HDF5 file, in the child process, as a list, which can be sent back.

    No columns for a file of another kind: it was replaced since its head was read.
    """
    with path.open("rb") as file:
        head = file.read(16)
    if head.startswith(_MAT5):
        variables = load_mat5(path).items()
        return [column for name, value in variables for column in _columns_of_array(name, value)]
    return _load_hdf5(path) if head.startswith((_HDF5, _MAT7)) else []


def _load_hdf5(path: Path) -> list[tuple[str, ArrayColumn | str]]:
    """Read the columns of an HDF5 file in limited memory: the library allocates whatever a damaged file states."""
    import h5py

    with base.limited_memory(_BOUNDS.names_bytes):
        file = h5py.File(path, "r")
    with file:
        with base.limited_memory(_BOUNDS.names_bytes):
            tables = [*_tables_of_hdf5(path, file)]
        stated_bytes = sum(_unpacked_bytes(data.shape, data.dtype) for _, data, _ in tables)
        most_bytes = min(_BOUNDS.array_copies * stated_bytes, MOST_EXPANSION * path.stat().st_size)
        with base.limited_memory(most_bytes + _BOUNDS.library_bytes):
            return [
                column
                for name, dataset, attributes in tables
                for column in _columns_of_dataset(name, dataset, attributes)
            ]


def _tables_of_hdf5(path: Path, file: Any) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Yield name, dataset and attributes of each dataset that may be columns.

    Raises `LogError` for a file too large to be read, or with values in another file, which may be any file of the
    user.
    """
    import h5py

    datasets: dict[str, Any] = {}

    def visit(name: str, node: Any) -> bool | None:
        """Collect a dataset; return True after too many, else None. h5py follows no link to another file here."""
        # h5py ends at the first answer but None
        if isinstance(node, h5py.Dataset):
            datasets[name] = node
        return len(datasets) > _BOUNDS.arrays or None

    file.visititems(visit)
    _refuse_many(path, len(datasets))
    for name, dataset in datasets.items():
        if sources := _foreign_sources(dataset, datasets):
            raise base.LogError(
                "other_file",
                f"{path}: the values of {name!r} are in another file, {', '.join(map(repr, sources))}; "
                "allowed: values in the log itself (external storage and virtual datasets: "
                "h5repack -l CONTI OLD NEW)",
            )
    # the group #refs# of MATLAB holds the targets of references, which are no columns
    read = [
        (name, dataset)
        for name, dataset in datasets.items()
        if not name.startswith("#") and _is_table(dataset)
    ]
    base.check_unpacked(
        path, sum(_unpacked_bytes(dataset.shape, dataset.dtype) for _, dataset in read)
    )
    for name, dataset in read:
        # the library unpacks each chunk of a dataset as a whole
        base.check_unpacked(path, math.prod(dataset.chunks or (0,)) * dataset.dtype.itemsize)
        yield name.replace("/", "."), dataset, _attributes_of(dataset)


_PACKING = ("scale_factor", "add_offset", "unitSI")
"""Attributes of netCDF and openPMD: value = stored number x `scale_factor` x `unitSI` + `add_offset`."""
_NO_VALUE = ("_FillValue", "missing_value")
"""Attributes of netCDF: stored numbers that stand for no value."""
_VALID = ("valid_range", "valid_min", "valid_max")
"""Attributes of netCDF: stored numbers below and above these stand for no value."""
_UNSIGNED = "_Unsigned"
"""Attribute of netCDF: stored whole numbers have no sign, whatever their type says."""


def _attributes_of(dataset: Any) -> dict[str, Any]:
    """Return the attributes that may say what the values are; other texts stay unread, as damaged ones raise errors."""
    kinds = {name: dataset.attrs.get_id(name).dtype.kind for name in dataset.attrs}
    return {
        name: dataset.attrs[name]
        for name, kind in kinds.items()
        if kind in _NUMBER_KINDS
        or "unit" in name.casefold()
        or name in (*_PACKING, *_NO_VALUE, *_VALID, _UNSIGNED, *_LISTS_OF_NAMES)
    }


_NO_MEANING = re.compile(r"MATLAB_|_Netcdf4|[A-Z_\d]+$|valid_|actual_range|unit|grid_")
"""Names of attributes of libraries and conventions that do not change what a value means."""
_SCALING = re.compile(
    r"gain|scal|skal|echelle|factor|fakt|slope|coeff|koeff|calib|kalib|etalonn|sensitiv|empfindl|sensib|multipl|conver|umrechn|lsb|"
    r"verst(ae|ä)rk|amplif|offset|bias|versatz|nullpunkt|(newton|n|mm|cm|m|volt|v|unit)s?_?per_",
    re.IGNORECASE,
)
"""Names, in the words of a lab, of attributes that say how values follow from stored numbers."""
_ADDED = re.compile(r"offset|bias|versatz|nullpunkt", re.IGNORECASE)


def _is_scaling(name: str, number: float) -> bool:
    """Return whether an attribute, by its name and number, states a scaling that would change the values."""
    number_without_effect = 0.0 if _ADDED.search(name) else 1.0
    return _SCALING.search(name) is not None and number != number_without_effect


def _columns_of_dataset(name: str, dataset: Any, attributes: dict[str, Any]) -> NamedColumns:
    """Yield the columns of a dataset as its attributes say: scaled, and NaN where a number stands for no value.

    Attributes that look like a scaling, but follow no convention, are named in the columns and not applied.
    """
    stored = dataset[()]
    if stored.dtype.names:
        units = _units_of_fields(attributes, stored.dtype.names)
        for column, content in _columns_of_array(name, stored):
            field = column.removeprefix(f"{name}.").partition(" column ")[0]
            unit = units.get(field, "")
            yield column, content if isinstance(content, str) else content._replace(unit=unit)
        return
    # name and unit of each column of a table; a list of units is no unit of the whole
    listed = _names_of_columns(attributes, stored.shape)
    stated = attributes.get("unit", attributes.get("units", ""))
    unit = "" if listed and np.size(stated) > 1 else canonical_unit(_text_of(stated))
    packing = {key: _number_of(attributes[key]) for key in _PACKING if key in attributes}
    if unclear := [key for key, value in packing.items() if not value and key != "add_offset"]:
        yield name, f"its attribute {unclear[0]} is no number, or 0"
        return
    if "unitSI" in packing:
        unit, in_si = _unit_of_si(attributes, unit, packing["unitSI"] or 1.0)
        if not in_si:
            del packing["unitSI"]
    values, notes, has_blanks = _unpack(stored, attributes, packing)
    # attributes with a number that this program does not know
    unknown = {
        key: number
        for key, value in attributes.items()
        if not _NO_MEANING.match(key)
        and key not in (*_PACKING, *_NO_VALUE, *_VALID, _UNSIGNED)
        and (number := _number_of(value)) is not None
    }
    if unknown:
        what = ", ".join(f"{key} {number:g}" for key, number in unknown.items())
        notes.append(f"attributes that are not applied: {what}")
    note = f"{name}: {'; '.join(notes)}" if notes else ""
    scaling = [f"{key} {number:g}" for key, number in unknown.items() if _is_scaling(key, number)]
    for column, content in listed_columns(_columns_of_array(name, values, unit), name, listed):
        if isinstance(content, str):
            yield column, content
        else:
            unapplied = ", ".join(scaling)
            yield column, content._replace(note=note, has_blanks=has_blanks, unapplied=unapplied)


def _unpack(
    stored: np.ndarray, attributes: Mapping[str, Any], packing: Mapping[str, float | None]
) -> tuple[np.ndarray, list[str], bool]:
    """Return the values that stored numbers mean, phrases on how they follow, and whether some stand for no value.

    Those are NaN. The conventions are those of netCDF and openPMD. `packing`: Those of the attributes `_PACKING` that
    are applied, to their numbers.
    """
    applied = [
        f"x {packing[key]:g} ({key})" for key in ("scale_factor", "unitSI") if key in packing
    ]
    if packing.get("add_offset"):
        applied.append(f"+ {packing['add_offset']:g} (add_offset)")
    notes = [f"stored values {', '.join(applied)}, as the file's attributes say"] if applied else []
    if stored.dtype.kind == "i" and _text_of(attributes.get(_UNSIGNED, "")).casefold() == "true":
        stored = stored.view(stored.dtype.str.replace("i", "u"))
    is_blank = _outside_valid(stored, attributes)
    if n_invalid := np.count_nonzero(is_blank):
        notes.append(
            f"{n_invalid} values outside the range that the file calls valid stand for no value"
        )
    # stored numbers that stand for no value
    codes = [np.ravel(attributes[key]) for key in _NO_VALUE if key in attributes]
    for code in np.unique(np.concatenate(codes)) if codes else ():
        is_code = stored == code
        if is_code.any():
            notes.append(f"{np.count_nonzero(is_code)} times {code:g}, which stands for no value")
            is_blank = is_blank | is_code
    has_blanks = bool(is_blank.any())
    if not (codes or packing or has_blanks):
        return stored, notes, False
    values = np.where(is_blank, np.nan, stored.astype(float))
    values *= packing.get("scale_factor") or 1.0
    values += packing.get("add_offset") or 0.0
    values *= packing.get("unitSI") or 1.0
    return values, notes, has_blanks


_LISTS_OF_NAMES = ("columns", "column_names", "names", "channels", "labels", "fields")
"""Attributes in which programs list the names of the columns of a table."""


def _names_of_columns(attributes: Mapping[str, Any], shape: Sequence[int]) -> list[tuple[str, str]]:
    """Return name and unit of each column of a table, from lists in its attributes; empty where there are none.

    `shape`: Shape of the dataset; the shorter of two lengths is the number of columns.
    """
    width = min((length for length in shape if length > 1), default=0)
    if len(shape) < 2 or not width:
        return []
    texts = {
        key: [_text_of(text) for text in np.ravel(value)]
        for key, value in attributes.items()
        if np.size(value) == width
    }
    names = next((texts[key] for key in _LISTS_OF_NAMES if key in texts), None)
    units = texts.get("units", texts.get("unit"))
    if names is None and units is None:
        return []
    names = names or [f"column {number}" for number in range(1, width + 1)]
    return [*zip(names, map(canonical_unit, units or [""] * width), strict=True)]


def listed_columns(
    columns: NamedColumns, table: str, listed: Sequence[tuple[str, str]]
) -> NamedColumns:
    """Yield the columns of a table with names and units from a list; columns beyond its end as they are.

    `table`: Name of the table, which is put in front. `listed`: Name and unit of each column.
    """
    for number, (column, values) in enumerate(columns):
        if isinstance(values, str) or number >= len(listed):
            yield column, values
            continue
        name, unit = listed[number]
        yield f"{table}.{name}".strip("."), values._replace(unit=unit or values.unit)


def _outside_valid(stored: np.ndarray, attributes: Mapping[str, Any]) -> np.ndarray:
    """Return where stored numbers lie outside the range that the attributes call valid: bool, shape as `stored`."""
    low, high = -math.inf, math.inf
    valid_range = np.ravel(attributes.get("valid_range", ()))
    if valid_range.size == 2 and valid_range.dtype.kind in _NUMBER_KINDS:
        low, high = map(float, valid_range)
    if (least := _number_of(attributes.get("valid_min", ""))) is not None:
        low = least
    if (most := _number_of(attributes.get("valid_max", ""))) is not None:
        high = most
    return np.asarray((stored < low) | (stored > high))


_DIMENSIONS: dict[tuple[float, ...], str] = {
    (1, 1, -2, 0, 0, 0, 0): "N",
    (2, 1, -2, 0, 0, 0, 0): "N m",
    (1, 0, 0, 0, 0, 0, 0): "m",
    (0, 0, 1, 0, 0, 0, 0): "s",
}
"""Powers of length, mass, time and so on, as `unitDimension` of openPMD states them, to the SI unit."""
_SI_UNITS = (*_DIMENSIONS.values(), "rad")
"""SI units of the quantities that a log may have."""


def _unit_of_si(attributes: Any, unit: str, scale: float) -> tuple[str, bool]:
    """Return the unit of the values, and whether to multiply by `unitSI` (`scale`), which makes them SI.

    `unit`: As stated; empty: not. The unit that is returned is that of `unitDimension`, else the SI unit of `unit`. Not
    where the stated unit has the same factor: a stored number in mm with `unitSI` 0.001 is already in mm.
    """
    in_si = {word: (si, factor) for si in _SI_UNITS for word, factor in units_like(si).items()}
    si_unit, factor = in_si.get(unit, ("", math.nan))
    if math.isclose(factor, scale, rel_tol=1e-6):
        return unit, False
    powers = tuple(map(float, np.ravel(attributes.get("unitDimension", ()))))
    return _DIMENSIONS.get(powers, si_unit), True


def _units_of_fields(attributes: Any, fields: Sequence[str]) -> dict[str, str]:
    """Return field, to its unit, for a table of records; fields without a unit are left out.

    The units are in a list with a unit for each field, or in one attribute for each field. A single unit for several
    fields is not used: time and force cannot both have it.
    """
    for key in ("units", "unit"):
        stated = attributes.get(key)
        listed = [_text_of(unit) for unit in np.ravel(stated)] if stated is not None else []
        if len(listed) == 1 and listed[0].count(",") == len(fields) - 1 > 0:
            listed = listed[0].split(",")
        if len(listed) == len(fields):
            return {f: canonical_unit(unit) for f, unit in zip(fields, listed, strict=True)}
    # PyTables numbers the attributes of its fields; h5py's users name them
    return {
        field: canonical_unit(_text_of(attributes[key]))
        for number, field in enumerate(fields)
        for key in (
            f"FIELD_{number}_UNITS",
            f"FIELD_{number}_UNIT",
            f"{field}_unit",
            f"{field}_units",
        )
        if key in attributes
    }


def _text_of(value: Any) -> str:
    """Return an attribute as text; an array of one element counts as this element."""
    value = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _number_of(value: Any) -> float | None:
    """Return an attribute as a number; None where it is no single finite number."""
    numbers = np.ravel(value)
    is_number = (
        numbers.size == 1 and numbers.dtype.kind in _NUMBER_KINDS and np.isfinite(numbers[0])
    )
    return float(numbers[0]) if is_number else None


def _foreign_sources(dataset: Any, names_in_file: Collection[str]) -> list[str]:
    """Return the names of the sources outside its file from which a dataset has its values; empty: all are inside.

    `names_in_file`: Names of the datasets of the file itself.
    """
    sources = [name for name, _, _ in dataset.external or ()]
    for source in dataset.virtual_sources() if dataset.is_virtual else ():
        # also a path within the file may go through a link to another file
        if source.file_name != ".":
            sources.append(source.file_name)
        elif source.dset_name.strip("/") not in names_in_file:
            sources.append(source.dset_name)
    return list(dict.fromkeys(sources))


def _is_table(dataset: Any) -> bool:
    """Return whether a dataset has numbers or records in one column, or in no more columns than a log may have."""
    shape = dataset.shape or ()  # None of a dataset without values
    wide = [length for length in shape if length > 1]
    is_narrow = len(wide) < 2 or (len(wide) == 2 and min(wide) <= _BOUNDS.columns)
    is_numeric = (
        dataset.dtype.kind in f"{_NUMBER_KINDS}V"
        and dataset.attrs.get("MATLAB_class", b"") != b"char"
    )
    return bool(shape) and is_narrow and is_numeric


# --- Memory that arrays will take, computed from shapes and types before they are read


def _unpacked_bytes(shape: Iterable[int], dtype: np.dtype[Any]) -> int:
    """Return the bytes of an array in memory: as stored, or as numbers of eight bytes if these are more."""
    return math.prod(map(int, shape)) * max(dtype.itemsize, 8 * _count_numbers(dtype))


def _count_numbers(dtype: np.dtype[Any]) -> int:
    """Return how many numbers one element has: a record has those of all its fields."""
    if dtype.subdtype:
        inner, shape = dtype.subdtype
        return math.prod(shape) * _count_numbers(inner)
    return sum(_count_numbers(dtype[name]) for name in dtype.names) if dtype.names else 1


def _npy_header(file: Any) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Read shape and type of the array from the header of an open .npy file."""
    npy = np.lib.format
    first_version = npy.read_magic(file) == (1, 0)
    read_header = npy.read_array_header_1_0 if first_version else npy.read_array_header_2_0
    shape, _, dtype = read_header(file)
    return shape, dtype


# --- The columns of one array, of a file of any kind


def _columns_of_array(path: str, value: Any, unit: str = "") -> NamedColumns:
    """Yield the columns of an array: the array itself if it has one dimension, its fields, or the columns of a table.

    `path`: Name of the array in the file. `unit`: Its unit as the file states it. Dates become seconds since 1970.
    """
    if isinstance(value, NoArray):
        yield path, value.what
        return
    array = np.asanyarray(value)
    if array.dtype == object:
        yield from _columns_of_cells(path, f"{path}{{#}}", array, unit)
        return
    for name in array.dtype.names or ():
        yield from _columns_of_cells(
            f"{path}.{name}".strip("."), f"{path}(#).{name}", array[name], unit
        )
    if array.dtype.kind in "SU":
        yield path, "text"
    if array.dtype.kind not in f"{_NUMBER_KINDS}M" or array.size < 2:
        return
    if array.dtype.kind == "M":
        array, unit = datetimes_to_s(array), "s"
    shape = [length for length in array.shape if length > 1]
    if len(shape) == 1:
        yield path or "column 1", ArrayColumn(array.ravel(), unit)
    elif len(shape) == 2 and min(shape) <= _BOUNDS.columns:
        table: FloatArray = array.reshape(shape)
        # a log has more samples than columns; MATLAB and HDF5 transpose each other's tables
        for number, values in enumerate(table if shape[0] < shape[1] else table.T, start=1):
            yield f"{path} column {number}".strip(), ArrayColumn(values, unit)


def _columns_of_cells(path: str, cell_path: str, array: np.ndarray, unit: str) -> NamedColumns:
    """Yield the columns of a cell array, or of a field of a struct array.

    `path`: Name of the whole, for cells of a single number each, which are one column. `cell_path`: Name of one cell,
    with # for its number, for cells with columns of their own.
    """
    if array.dtype != object or array.size == 1:
        yield from _columns_of_array(path, array if array.dtype != object else array.flat[0], unit)
        return
    if any(isinstance(cell, NoArray) for cell in array.flat):
        yield path, "cells with objects"
        return
    cells = [np.asanyarray(cell) for cell in array.flat]
    if all(cell.size == 1 and cell.dtype.kind in _NUMBER_KINDS for cell in cells):
        yield path, ArrayColumn(np.array([cell.item() for cell in cells]), unit)
    elif len(cells) > _BOUNDS.columns:
        yield path, f"a list of {len(cells)} cells, more than {_BOUNDS.columns}"
    else:
        for number, cell in enumerate(cells, start=1):
            yield from _columns_of_array(cell_path.replace("#", str(number)), cell, unit)
