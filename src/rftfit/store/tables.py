"""Tables as csv for people and Parquet for traces; the same table gives the same bytes."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.store.atomic import atomic_path, write_bytes

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

FLOAT_FORMAT = "%.6g"
"""Six significant digits: far beyond any measurement here, and short enough to read."""


def write_csv(table: pd.DataFrame, target: str | Path) -> None:
    r"""Write a table as csv: UTF-8, ``\\n``, six significant digits, NaN as an empty cell.

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
    table.to_csv(buffer, index=False, float_format=FLOAT_FORMAT, lineterminator="\n")
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
        table = pd.read_csv(source, encoding="utf-8")
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as a table: {error}") from error
    for name in ("run_ids", "flags", "reason", "tare_run", "note"):
        if name in table.columns:
            table[name] = table[name].fillna("").astype(str)
    return table


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
