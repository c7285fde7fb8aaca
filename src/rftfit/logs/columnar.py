"""Logs in Parquet files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.base import Log, LogError, Reader
from rftfit.logs.numbers import FINITE
from rftfit.logs.unitwords import split_unit, unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_AT_A_TIME = 1 << 22  # numbers, so that a table of many columns takes no more memory
_MAGIC = b"PAR1"


class ParquetReader(Reader):
    """Every column of numbers; units from the names, or from the field's metadata ``unit``."""

    name = "parquet"
    evidence = "its first four bytes, PAR1"

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "Parquet table; units in the column names (force_N, Force [N]) or their metadata"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
        """
        return head.startswith(_MAGIC)

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a table, some million numbers at a time.

        Parameters
        ----------
        path : Path

        Yields
        ------
        Log

        Raises
        ------
        LogError
            If the file is no Parquet file, is cut, or has no column of numbers.
        """
        import pyarrow.parquet as pq

        if not path.is_file():
            raise LogError("missing", f"{path}: log missing")
        rows = 0
        try:
            with pq.ParquetFile(path) as file:
                chosen = _columns(file.schema_arrow)
                if not chosen:
                    raise LogError("header", f"{path}: no column of this table holds numbers")
                at_a_time = max(1, _AT_A_TIME // len(chosen))
                for batch in file.iter_batches(at_a_time, columns=list(chosen)):
                    rows += batch.num_rows
                    if batch.num_rows:
                        yield _log(path, chosen, batch)
        except (LogError, GeneratorExit):
            raise
        # the library raises whatever its parsers do on a damaged file
        except Exception as error:  # noqa: BLE001
            text = f"{path}: this Parquet file cannot be read ({error}); is it cut short? Its list "
            text += "of contents stands at its end, so a cut file gives no row"
            raise LogError("unreadable", text, rows) from None
        if rows == 0:
            raise LogError("header_only", f"{path}: a header and no data")


def _columns(schema: Any) -> dict[str, tuple[str, str]]:
    """Column of the file to the name and unit that it has here."""
    import pyarrow.types as kinds

    fields = [
        field
        for field in schema
        if kinds.is_integer(field.type)
        or kinds.is_floating(field.type)
        or kinds.is_timestamp(field.type)
        or kinds.is_boolean(field.type)
    ]
    split = [split_unit(field.name) for field in fields]
    names = unique([name for name, _ in split])
    chosen = {}
    for field, name, (_, unit) in zip(fields, names, split, strict=True):
        metadata = field.metadata or {}
        stated = metadata.get(b"unit") or metadata.get(b"units") or b""
        unit = "s" if kinds.is_timestamp(field.type) else unit  # noqa: PLW2901
        chosen[field.name] = (name, unit or unit_word(stated.decode("utf-8", "replace")))
    return chosen


def _log(path: Path, chosen: dict[str, tuple[str, str]], batch: Any) -> Log:
    columns = {}
    units = {}
    for source, (name, unit) in chosen.items():
        columns[name] = _numbers(batch.column(source))
        units[name] = unit
    log = Log(path, columns, units, batch.num_rows)
    finite = np.ones(log.size, dtype=bool)
    for values in columns.values():
        finite &= np.isfinite(values)
    return log.take(finite, FINITE)


def _numbers(array: Any) -> np.ndarray:
    import pyarrow as pa
    import pyarrow.types as kinds

    from rftfit.logs.timing import ns_to_s

    if kinds.is_timestamp(array.type):
        missing = np.asarray(array.is_null())
        stamps = array.cast(pa.timestamp("ns", array.type.tz)).cast(pa.int64()).fill_null(0)
        return np.where(missing, np.nan, ns_to_s(stamps.to_numpy(zero_copy_only=False)))
    return np.asarray(array.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)
