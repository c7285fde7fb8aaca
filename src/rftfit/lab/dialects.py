"""Recordings as the log files of the programs that other labs record with."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rftfit.campaign.config import Config
from rftfit.errors import InputError
from rftfit.lab.write import LogColumn, fixed


def _labels(columns: Sequence[LogColumn]) -> list[str]:
    return [f"{column.name} [{column.unit}]" if column.unit else column.name for column in columns]


def _numbers(columns: Sequence[LogColumn]) -> dict[str, Any]:
    """Arrays as a binary file holds them, rounded as in text, by label."""
    arrays = [np.round(column.values, column.decimals) for column in columns]
    return dict(zip(_labels(columns), arrays, strict=True))


def _rows(columns: Sequence[LogColumn]) -> str:
    return fixed([c.values for c in columns], [c.decimals for c in columns])


def _rig(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    names = (f"{column.name}_{column.unit}" if column.unit else column.name for column in columns)
    lines = [*(f"# {line}" for line in head), ",".join(names)]
    return ("\n".join(lines) + "\n" + _rows(columns)).encode()


def _instron(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    lines = [
        *head,
        ";".join(c.name for c in columns),
        ";".join(f"({c.unit or '-'})" for c in columns),
    ]
    rows = _rows(columns).replace(",", ";").replace(".", ",")
    return ("\n".join(lines) + "\n" + rows).encode()


def _delimited(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    return (",".join(_labels(columns)) + "\n" + _rows(columns)).encode()


def _lvm(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
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
    return ("\n".join(lines) + "\n" + _rows(columns).replace(",", "\t")).encode()


def _xlsx(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
    import xlsxwriter

    file = io.BytesIO()
    with xlsxwriter.Workbook(file, {"in_memory": True}) as book:
        from datetime import UTC, datetime

        book.set_properties({"created": datetime(2013, 3, 22, tzinfo=UTC), "comments": head[0]})
        sheet = book.add_worksheet("log")
        sheet.write_row(0, 0, _labels(columns))
        for place, values in enumerate(_numbers(columns).values()):
            sheet.write_column(1, place, values.tolist())
    return file.getvalue()


def _parquet(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = io.BytesIO()
    pq.write_table(pa.table(_numbers(columns)), file)
    return file.getvalue()


def _tdms(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:
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


def _arrays(columns: Sequence[LogColumn], head: Sequence[str]) -> bytes:  # noqa: ARG001
    buffer = io.BytesIO()
    np.savez(buffer, **_numbers(columns))
    return buffer.getvalue()


class Writer(NamedTuple):
    """Ending of a file's name, and what makes its content of columns and of lines for its head."""

    suffix: str
    content: Callable[[Sequence[LogColumn], Sequence[str]], bytes]


WRITERS = {
    "rig": Writer(".csv", _rig),
    "instron": Writer(".csv", _instron),
    "delimited": Writer(".csv", _delimited),
    "lvm": Writer(".lvm", _lvm),
    "xlsx": Writer(".xlsx", _xlsx),
    "parquet": Writer(".parquet", _parquet),
    "tdms": Writer(".tdms", _tdms),
    "arrays": Writer(".npz", _arrays),
}
"""Dialects that can be written: those in which a column may bear the name of its quantity."""


def dialect_of(config: Config) -> str:
    """Return the dialect that the config would read force and motion logs by, if it can be written."""
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
