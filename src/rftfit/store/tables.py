"""Writes and reads tables of results: csv for people, Parquet for samples; the same table gives the same bytes.

Only tables that this program wrote are read here. A text that a spreadsheet would take for a formula is written with an
apostrophe before it (`guarded`), as a table may quote words that a stranger has put into a log.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.store.files import atomic_path, write_bytes

if TYPE_CHECKING:
    import pandas as pd


# --- An apostrophe before text in a csv that a spreadsheet would take for a formula


_SIGNS = "=+\\-@\t\r\n\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH PLUS SIGN}\N{FULLWIDTH HYPHEN-MINUS}\N{FULLWIDTH COMMERCIAL AT}"
_DANGEROUS = re.compile(f"'*[{_SIGNS}]")
"""Beginning of a text that needs an apostrophe, also one that has apostrophes already, so that reading removes one."""
_GUARDED = re.compile(f"'+[{_SIGNS}]")
"""Beginning of a text that `guarded` has changed."""
NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A whole number or decimal, which needs no apostrophe even with a sign."""


def guarded(text: str) -> str:
    """Return text as it is written into a csv: with an apostrophe in front where a spreadsheet would calculate it."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if _DANGEROUS.match(text) and not NUMBER.fullmatch(text):
        return f"'{text}"
    return text


def unguarded(text: str) -> str:
    """Return the text that `guarded` was called with."""
    return text[1:] if _GUARDED.match(text) else text


def _change_texts(table: pd.DataFrame, change: Callable[[str], str]) -> pd.DataFrame:
    """Apply `change` (`guarded` or `unguarded`) to each text of a table; without any change return the table itself.

    Of categories only the texts count, so a changed column of categories becomes one of objects.
    """
    import pandas as pd

    changed: dict[str, pd.Series] = {}
    for position, name in enumerate(table.columns):
        column = table.iloc[:, position]
        if pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column):
            continue
        # few different texts stand in many rows
        texts = [value for value in column.unique() if isinstance(value, str)]
        replacements = {
            text: changed_text for text in texts if (changed_text := change(text)) != text
        }
        if replacements:
            values = [replacements.get(cell, cell) for cell in column]
            dtype = object if isinstance(column.dtype, pd.CategoricalDtype) else column.dtype
            changed[str(name)] = pd.Series(values, table.index, dtype=dtype)
    return table.assign(**changed) if changed else table


# --- Csv and Parquet


FLOAT_FORMAT = "%.6g"
"""Format of numbers in a csv, six significant digits: more precise than any measurement here, and short to read."""


def _round_mixed_columns(table: pd.DataFrame) -> pd.DataFrame:
    """Round the numbers in columns that also hold texts to six digits, as `FLOAT_FORMAT` says.

    pandas applies that format in `to_csv` to columns of numbers only.
    """

    def rounded(value: object) -> object:
        return float(FLOAT_FORMAT % value) if isinstance(value, float) else value

    mixed = {
        str(name): column
        for name, column in table.items()
        if column.dtype == object
        and any(isinstance(value, float) for value in column.dropna().unique())
    }
    return table.assign(**{name: column.map(rounded) for name, column in mixed.items()})


def write_csv(table: pd.DataFrame, target: str | Path) -> None:
    """Write a table as csv, in the form of `csv_bytes`."""
    write_bytes(target, csv_bytes(table))


def csv_bytes(table: pd.DataFrame) -> bytes:
    r"""Return a table as csv: UTF-8, lines end with ``\\n``, six significant digits, NaN is an empty cell.

    Text that a spreadsheet would calculate gets an apostrophe in front. The index is not written.
    """
    safe = _round_mixed_columns(_change_texts(table, guarded))
    text: str = safe.to_csv(None, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    return text.encode("utf-8")


def read_cells(source: str | Path | bytes) -> list[list[str]]:
    """Read the cells of a csv that this program wrote, each row a list; raises OSError or ValueError."""
    content = source if isinstance(source, bytes) else Path(source).read_bytes()
    try:
        return [*csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""))]
    except csv.Error as error:
        raise ValueError(str(error)) from error


_YES_OR_NO = {"True": True, "False": False, "yes": True, "no": False}
"""Cell of a column of the kind ``yes or no``, to its value; a blank cell is not known (NA)."""


def read_csv(source: str | Path | bytes, kind_of: Callable[[str], str]) -> pd.DataFrame:
    """Read a table that `csv_bytes` or `write_csv` made, from its content or path.

    `kind_of`: Function from the name of a column to its kind: ``text``, ``yes or no``, or any other for numbers.
    """
    import pandas as pd

    try:
        content_bytes = source if isinstance(source, bytes) else Path(source).read_bytes()
        content = content_bytes.decode("utf-8-sig")
        names = next(iter(read_cells(content_bytes.partition(b"\n")[0])), [])
        kinds = {name: kind_of(name) for name in names}
        text_columns = {name for name, kind in kinds.items() if kind in ("text", "yes or no")}
        table = pd.read_csv(
            io.StringIO(content, newline=""),
            # a run may be called 007 or NA, which must not become a number or NaN
            dtype=dict.fromkeys(text_columns, str),
            keep_default_na=False,
            na_values={name: [""] for name in names if name not in text_columns},
        )
        for name, kind in kinds.items():
            if kind == "yes or no":
                table[name] = table[name].map(_YES_OR_NO).astype("boolean")
        if table.empty:
            # pandas gives columns without rows the type of texts, which a join would pass on to numbers
            table = table.astype({name: float for name in names if name not in text_columns})
        return _change_texts(table, unguarded) if "'" in content else table
    except (OSError, ValueError) as error:
        name = "" if isinstance(source, bytes) else f"{source}: "
        raise InputError(f"{name}cannot be read as a table: {error}") from error


def write_parquet(table: pd.DataFrame, target: str | Path) -> None:
    """Write a table as Parquet, without its index, with a checksum of each page."""
    # an open file: pyarrow cannot open a path with letters that the encoding of the system lacks
    with atomic_path(target) as path, path.open("wb") as file:
        table.to_parquet(file, index=False, compression="zstd", write_page_checksum=True)


def read_parquet(source: str | Path) -> pd.DataFrame:
    """Read a table written by `write_parquet`; raises `InputError` if its bytes were changed (checksums)."""
    import pandas as pd

    try:
        with open(source, "rb") as file:  # noqa: PTH123
            return pd.read_parquet(file, page_checksum_verification=True)
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as Parquet: {error}") from error
