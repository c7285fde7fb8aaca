"""Tables as csv for people and Parquet for traces; the same table gives the same bytes."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.store.atomic import atomic_path, write_bytes
from rftfit.store.formulas import guard_table, unguard_table

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

TEXT_COLUMNS = frozenset(
    [
        "run_id",
        "run_ids",
        "medium",
        "kind",
        "status",
        "direction",
        "tare_run",
        "abscissa",
        "leg",
        "file",
        "fate",
        "flags",
        "note",
        "reason",
        "method",
        "coefficient",
        "term",
        "item",
        "where",
        "verdict",
        "why",
        "profile",
        "condition",
        "outcome",
        "warning",
        "calibrated",
        "frequency_from",
    ]
)
"""Columns of names and words in the tables of this program; all others are numbers or yes and no."""

FLOAT_FORMAT = "%.6g"
"""Six significant digits: far beyond any measurement here, and short enough to read."""


def write_csv(table: pd.DataFrame, target: str | Path) -> None:
    r"""Write a table as csv: UTF-8, ``\\n``, six significant digits, NaN as an empty cell.

    Text that a spreadsheet would calculate gets an apostrophe in front (`rftfit.store.formulas`).

    Parameters
    ----------
    table : pandas.DataFrame
        The index is not written.
    target : str or Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    buffer = io.StringIO()
    guard_table(table).to_csv(buffer, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
    write_bytes(target, buffer.getvalue().encode("utf-8"))


def read_csv(source: str | Path) -> pd.DataFrame:
    """Read a table written by `write_csv`.

    Parameters
    ----------
    source : str or Path

    Returns
    -------
    pandas.DataFrame
        Empty text cells of text columns come back as empty strings, of number columns as NaN.

    Raises
    ------
    InputError
        If the file is missing or is no table.
    """
    import pandas as pd

    try:
        names = pd.read_csv(source, encoding="utf-8", nrows=0).columns
        table = pd.read_csv(
            source,
            encoding="utf-8",
            # a run may be called 007 or NA: what is text stays the text it is
            dtype={name: str for name in names if name in TEXT_COLUMNS},
            keep_default_na=False,
            na_values={name: [""] for name in names if name not in TEXT_COLUMNS},
        )
        return unguard_table(table)
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as a table: {error}") from error


def write_parquet(table: pd.DataFrame, target: str | Path) -> None:
    """Write a table as Parquet.

    Parameters
    ----------
    table : pandas.DataFrame
    target : str or Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    with atomic_path(target) as path:
        table.to_parquet(path, index=False, compression="zstd")


def read_parquet(source: str | Path, columns: list[str] | None = None) -> pd.DataFrame:
    """Read a table written by `write_parquet`.

    Parameters
    ----------
    source : str or Path
    columns : list of str, optional
        Only these.

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    import pandas as pd

    try:
        return pd.read_parquet(source, columns=columns)
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as Parquet: {error}") from error
