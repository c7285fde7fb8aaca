"""Write recordings as log files in the formats of programs that other labs use (dialects).

Each function ``_encode_...`` returns the bytes of a file in one dialect, from columns and from lines of text for its
head. `WRITERS` lists them; `dialect_of` chooses the one that the config reads.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np

from rftfit.campaign.config import Config
from rftfit.errors import InputError
from rftfit.lab.write import LogColumn, format_numbers


def _format_labels(columns: Sequence[LogColumn]) -> list[str]:
    """Format the name of each column with its unit: ``z [mm]``."""
    return [f"{column.name} [{column.unit}]" if column.unit else column.name for column in columns]


def _rounded_arrays(columns: Sequence[LogColumn]) -> dict[str, Any]:
    """Return the numbers of each column by its label, rounded as in a text file."""
    arrays = [np.round(column.values, column.decimals) for column in columns]
    return dict(zip(_format_labels(columns), arrays, strict=True))


def _format_rows(columns: Sequence[LogColumn]) -> str:
    """Format the values of columns as lines of comma-separated numbers."""
    return format_numbers([c.values for c in columns], [c.decimals for c in columns])


def _encode_rig(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    """Encode a csv of the paper's rig: comments, then names such as ``z_mm``, then rows."""
    names = (f"{column.name}_{column.unit}" if column.unit else column.name for column in columns)
    lines = [*(f"# {line}" for line in head), ",".join(names)]
    return ("\n".join(lines) + "\n" + _format_rows(columns)).encode()


def _encode_instron(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    """Encode a csv of an Instron machine: semicolons, decimal commas, a row of names and a row of units."""
    lines = [
        *head,
        ";".join(c.name for c in columns),
        ";".join(f"({c.unit or '-'})" for c in columns),
    ]
    rows = _format_rows(columns).replace(",", ";").replace(".", ",")
    return ("\n".join(lines) + "\n" + rows).encode()


def _encode_delimited(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    """Encode a plain csv with labels such as ``z [mm]``."""
    return (",".join(_format_labels(columns)) + "\n" + _format_rows(columns)).encode()


def _encode_lvm(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    """Encode a measurement file of LabVIEW; the first column is the time."""
    time, *channels = columns
    step = f"{np.median(np.diff(time.values)):.6f}"

    def row(key: str, cells: Sequence[str]) -> str:
        return "\t".join([key, *cells])

    lines = [
        "LabVIEW Measurement",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "X_Columns\tOne",
        row("Description", [head[0]]),
        "Date\t2013/03/22",
        "Time\t00:00:00",
        "***End_of_Header***",
        "",
        row("Channels", [str(len(channels))]),
        row("Y_Unit_Label", [c.unit for c in channels]),
        row("X_Dimension", ["Time"] * len(channels)),
        row("Delta_X", [step] * len(channels)),
        row("Date", ["2013/03/22"] * len(channels)),
        row("Time", ["00:00:00"] * len(channels)),
        "***End_of_Header***",
        row("X_Value", [c.name for c in channels]),
    ]
    return ("\n".join(lines) + "\n" + _format_rows(columns).replace(",", "\t")).encode()


def _encode_xlsx(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    """Encode a workbook with one sheet."""
    import xlsxwriter

    file = io.BytesIO()
    with xlsxwriter.Workbook(file, {"in_memory": True}) as book:
        book.set_properties({"created": datetime(2013, 3, 22, tzinfo=UTC), "comments": head[0]})
        sheet = book.add_worksheet("log")
        sheet.write_row(0, 0, _format_labels(columns))
        for column, numbers in enumerate(_rounded_arrays(columns).values()):
            sheet.write_column(1, column, numbers.tolist())
    return file.getvalue()


def _encode_parquet(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    """Encode a Parquet table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = io.BytesIO()
    pq.write_table(pa.table(_rounded_arrays(columns)), file)
    return file.getvalue()


def _encode_tdms(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    """Encode a TDMS file of National Instruments; needs the optional package npTDMS."""
    try:
        from nptdms import ChannelObject, RootObject, TdmsWriter
    except ImportError:
        raise InputError(
            "TDMS files are written with the package npTDMS; install it: pip install 'rftfit[tdms]'"
        ) from None

    def channel(column: LogColumn) -> Any:
        values = np.round(column.values, column.decimals)
        return ChannelObject("log", column.name, values, {"unit_string": column.unit})

    file = io.BytesIO()
    with TdmsWriter(file) as writer:
        writer.write_segment([RootObject({"description": head[0]}), *map(channel, columns)])
    return file.getvalue()


def _encode_arrays(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    """Encode arrays of numpy, one a column, in an npz file."""
    buffer = io.BytesIO()
    np.savez(buffer, **_rounded_arrays(columns))
    return buffer.getvalue()


class Writer(NamedTuple):
    """Ending of the names of files in a dialect, and the function that makes their bytes from columns and head."""

    suffix: str
    encode: Callable[[Sequence[LogColumn], Sequence[str]], bytes]


WRITERS = {
    "rig": Writer(".csv", _encode_rig),
    "instron": Writer(".csv", _encode_instron),
    "delimited": Writer(".csv", _encode_delimited),
    "lvm": Writer(".lvm", _encode_lvm),
    "xlsx": Writer(".xlsx", _encode_xlsx),
    "parquet": Writer(".parquet", _encode_parquet),
    "tdms": Writer(".tdms", _encode_tdms),
    "arrays": Writer(".npz", _encode_arrays),
}
"""Dialects that can be written: those in which a column may have the name of its quantity."""


def dialect_of(config: Config) -> str:
    """Return the dialect in which the config would read both logs; refuse two, or one that cannot be written."""
    dialect_names = {
        "delimited" if source.text is not None else source.dialect or config.dialect
        for source in (config.force_log, config.motion_log)
    }
    if len(dialect_names) > 1 or not dialect_names <= WRITERS.keys():
        raise InputError(
            f"config, dialect: found {', '.join(sorted(dialect_names))}; allowed in rftfit reenact: one for force "
            f"and motion, of {', '.join(WRITERS)}"
        )
    return dialect_names.pop()
