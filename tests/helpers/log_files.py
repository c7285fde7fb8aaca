"""Small logs in the dialects of other programs, random and damaged bytes, and how a reader refuses them."""

from __future__ import annotations

import csv
import datetime as dt
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from rftfit.campaign.config import TextFormat
from rftfit.logs.base import LogError, Reader
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.registry import dialect

# --- Problems in short, to be compared as a whole: one line for each ----------------------------------------------


def told(problems):
    """Code, row, column or key, what was found, and behind ~ what was meant."""
    return [" ".join(_parts(problem)) for problem in problems]


def _parts(problem):
    place = problem.place
    yield problem.code
    yield from (str(part) for part in (place.row, place.column, place.key) if part is not None)
    if problem.found is not None:
        yield repr(problem.found)
    if problem.nearest:
        yield f"~{problem.nearest}"


# --- A log that is refused: its code, its file, and the values that its error names -------------------------------


def refused(reader, path, code, *values):
    """Return the error of a log that is refused: it has this code and names the file and these values."""
    with pytest.raises(LogError) as caught:
        reader.load(path)
    assert caught.value.code == code
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    for value in values:
        assert value in text.removeprefix(f"{path}: ")
    return caught.value


# --- Small logs in the dialects of other programs, written from numbers: for tests, fuzzing, benchmarks -----------


@dataclass(frozen=True)
class Foreign:
    """A log as bytes, and what it holds.

    Attributes
    ----------
    name : str
    reader : Reader
    header : bytes
    lines : list of bytes
        Data lines with their ends.
    raw : list of str
        Names of the columns that come straight out of the cells, in the order of `cells`.
    cells : callable
        The values of those columns in one line, read in the simplest way; raises on a bad line.
    """

    name: str
    reader: Reader
    header: bytes
    lines: list[bytes]
    raw: list[str]
    cells: Callable[[str], list[float]]

    @property
    def content(self):
        """The whole file."""
        return self.header + b"".join(self.lines)


def _split(separator, places, width, decimal="."):
    def cells(line):
        parts = [cell.strip(' \t"') for cell in line.split(separator)]
        if not width - 1 <= len(parts) <= width:
            raise ValueError(line)
        return [float(parts[place].replace(decimal, ".")) for place in places]

    return cells


def _quoted(line):
    parts = next(csv.reader([line]))
    if len(parts) != 10:
        raise ValueError(line)
    return [float(cell) for cell in parts[1:9]]


def _blanks(line):
    parts = line.split()
    if len(parts) != 3:
        raise ValueError(line)
    return [float(cell) for cell in parts]


def _numbers(rows, columns, seed=1):
    return np.random.default_rng(seed).normal(scale=5, size=(rows, columns)).round(6)


def netft(rows, *, lost=0):
    """ATI Net F/T; `lost` packets are missing after every tenth row."""
    head = (
        "Start Time: 1/2/26 3:04 PM\r\nRDT Sample Rate: 125\r\n"
        '"PLEASE NOTE: read when the program starts."\r\nForce Units: N\r\n'
        "Counts per Unit Force: 1000000.0\r\nTorque Units: Nm\r\n"
        "Counts per Unit Torque: 1000000.0\r\n"
        "Status (hex), RDT Sequence, F/T Sequence, Fx, Fy, Fz, Tx, Ty, Tz, Time\r\n"
    )
    lines = []
    for row, values in enumerate(_numbers(rows, 6)):
        number = 26049 + row + lost * (row // 10)
        cells = ["0x0", str(number), str(8 * number), *map(repr, values.tolist())]
        lines.append(",".join(f'"{cell}"' for cell in [*cells, "Jan 2, 2026 3:04:05 PM"]) + "\r\n")
    names = ["RDT Sequence", "F/T Sequence", "Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
    return _foreign("ati-netft", head, lines, names, _quoted)


def daq(rows):
    """ATI through NI DAQ at 150 Hz."""
    head = (
        "First line indicates sampling freq [Hz], samples per channel, QTimer [ms] ,,,\n"
        "Fx, Fy, Fz, Mz, My, Mz \n150,75,500,23.72,835,0\n"
    )
    lines = [",".join(map(repr, values.tolist())) + "\n" for values in _numbers(rows, 6)]
    names = ["Fx", "Fy", "Fz", "Mz", "My", "Mz_2"]
    return _foreign("ati-daq", head, lines, names, _split(",", range(6), 6))


def rostopic(rows):
    """One wrench topic at 125 Hz."""
    forces = [f"field.wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id," + ",".join(forces)
    lines = []
    for row, values in enumerate(_numbers(rows, 6)):
        stamp = 1_700_000_000_123_456_789 + 8_000_000 * row
        cells = [str(stamp + 400_000), str(500 + row), str(stamp), "", *map(repr, values.tolist())]
        lines.append(",".join(cells) + "\n")
    names = ["header.seq", *(name.removeprefix("field.") for name in forces)]
    return _foreign("rostopic", head + "\n", lines, names, _split(",", [1, *range(4, 10)], 10))


def lvm(rows, *, segments=1, comment=True):
    """LabVIEW with decimal commas and no X column."""
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
        "Decimal_Separator\t,\nMulti_Headings\tYes\nX_Columns\tNo\nTime_Pref\tAbsolute\n"
        "Date\t2026/01/02\nTime\t03:04:05,25\n***End_of_Header***\t\n\t\n"
    )
    lines: list[str] = []
    for segment in range(segments):
        segment_head = (
            f"Channels\t2\t\t\nSamples\t{rows}\t{rows}\t\nDate\t2026/01/02\t2026/01/02\t\n"
            f"Time\t03:04:{5 + 10 * segment:02d},25\t03:04:{5 + 10 * segment:02d},25\t\n"
            "Y_Unit_Label\tNewtons\tmm\t\nX_Dimension\tTime\tTime\t\n"
            "X0\t0,0000E+0\t0,0000E+0\t\nDelta_X\t1,000000E-2\t1,000000E-2\t\n"
            "***End_of_Header***\t\t\t\nX_Value\tForce z\tz\tComment\n"
        )
        body = []
        for row, values in enumerate(_numbers(rows, 2, seed=segment)):
            end = "\tstart" if comment and row == 0 else ""
            body.append(f"\t{values[0]:.6f}\t{values[1]:.6f}{end}\n".replace(".", ","))
        if segment == 0:
            head += segment_head
        else:
            body[0] = segment_head + body[0]
        lines += body

    def cells(line):
        parts = line.split("\t")
        if not 3 <= len(parts) <= 4:
            raise ValueError(line)
        return [float(cell.strip().replace(",", ".")) for cell in parts[1:3]]

    return _foreign("lvm", head, lines, ["Force z", "z"], cells)


def instron(rows):
    """Semicolons, decimal commas, units in brackets."""
    head = "Time;Displacement;Force\r\n(s);(mm);(kN)\r\n"
    lines = [
        f"{0.02 * row:.2f};{values[0]:.4f};{values[1]:.4f}\r\n".replace(".", ",")
        for row, values in enumerate(_numbers(rows, 2))
    ]
    names = ["Time", "Displacement", "Force"]
    return _foreign("instron", head, lines, names, _split(";", range(3), 3, ","))


def delimited(rows):
    """Blanks between cells, a comment and a row of names."""
    head = "# made by hand\ntime_s  x_mm z_mm\n"
    lines = [
        f" {0.02 * row:.2f}\t{values[0]:.4f}   {values[1]:.4f}\n"
        for row, values in enumerate(_numbers(rows, 2))
    ]
    text = TextFormat(delimiter="blank", comment="#")
    foreign = _foreign("delimited", head, lines, ["time", "x", "z"], _blanks)
    reader = DelimitedReader(text)
    return Foreign(foreign.name, reader, foreign.header, foreign.lines, foreign.raw, foreign.cells)


def dated(rows):
    """Commas between cells, the time as a date of ISO 8601."""
    head = "Time,Fz [N]\n"
    start = dt.datetime(2026, 1, 2, 23, 59, 59, tzinfo=dt.UTC)
    times = [start + dt.timedelta(milliseconds=10 * row) for row in range(rows)]
    lines = [
        f"{time:%Y-%m-%dT%H:%M:%S.%f}Z,{values[0]:.4f}\n"
        for time, values in zip(times, _numbers(rows, 1), strict=True)
    ]

    def cells(line):
        parts = [cell.strip(' \t"') for cell in next(csv.reader([line]))]
        whole, _, fraction_and_zone = parts[0].replace(",", ".").partition(".")
        zone = fraction_and_zone.lstrip("0123456789")
        # a year of two digits, others of one, and more blanks are as clear
        whole = re.sub(r"(?<=\d)[T ] *(?=\d)", "T", whole)
        whole = re.sub(r"^\d\d(?=-)", "20\\g<0>", whole)
        whole = re.sub(r"(?<=-)\d(?=[-T ])", lambda digit: digit[0].zfill(2), whole)
        whole = re.sub(r"(?<=[T: ])\d(?=:|$)", lambda digit: digit[0].zfill(2), whole)
        time = dt.datetime.fromisoformat(whole + zone)
        time = time if time.tzinfo else time.replace(tzinfo=dt.UTC)
        if len(parts) != 2:
            raise ValueError(line)
        return [
            int(time.timestamp()) + float(f"0.{fraction_and_zone.removesuffix(zone)}"),
            float(parts[1]),
        ]

    foreign = _foreign("delimited", head, lines, ["Time", "Fz"], cells)
    reader = DelimitedReader(TextFormat())
    return Foreign("dated", reader, foreign.header, foreign.lines, foreign.raw, foreign.cells)


def rig(rows):
    """The rig's own force log."""
    head = "# a comment\ntime_s,arm_moving,F1_N,F2_N,F3_N\n"
    lines = [
        ",".join([f"{0.01 * row:.2f}", str(row % 2), *map(repr, values.tolist())]) + "\n"
        for row, values in enumerate(_numbers(rows, 3))
    ]
    names = ["time", "arm_moving", "F1", "F2", "F3"]
    return _foreign("rig", head, lines, names, _split(",", range(5), 5))


def _foreign(name, head, lines, raw, cells):
    return Foreign(name, dialect(name), head.encode(), [x.encode() for x in lines], raw, cells)


TEXTS: dict[str, Callable[[int], Foreign]] = {
    "rig": rig,
    "ati-netft": netft,
    "ati-daq": daq,
    "rostopic": rostopic,
    "lvm": lvm,
    "instron": instron,
    "delimited": delimited,
    "dated": dated,
}
"""Every dialect of text, and text with dates."""


# --- Small logs that libraries of other people read, written from numbers: for tests and fuzzing ------------------

WRENCH = "geometry_msgs/msg/WrenchStamped"
ROS1_TYPE = "float64[3] force\nuint32 count\n"


def write_ros1(path, definition, raw, *, packed=None, count=1):
    """A bag of ROS 1 with one message some times; gives its path."""
    from rosbags import rosbag1

    bag = rosbag1.Writer(path)
    if packed:
        bag.set_compression(packed)
    with bag:
        topic = bag.add_connection("/force", "lab/msg/Force", msgdef=definition, md5sum="0" * 32)
        for index in range(count):
            bag.write(topic, (index + 1) * 10**9, raw)
    return path


def write_ros2(path, raws, plugin="MCAP", kind=WRENCH, topics=("/wrench",), mode="NONE"):
    """Messages on topics in turn, 10 ms apart; gives the file of the recording."""
    from rosbags import rosbag2

    bag = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin])
    if mode != "NONE":
        bag.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)
    with bag:
        added = [bag.add_connection(topic, kind, typestore=ros2_store()) for topic in topics]
        for index, raw in enumerate(raws):
            bag.write(added[index % len(added)], 5 * 10**9 + index * 10**7, raw)
    return next(path.glob("*.mcap" if plugin == "MCAP" else "*.db3*"))


@cache
def ros2_store():
    """Types of ROS 2."""
    from rosbags import typesys

    store: Any = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    return store


def wrench(index, frame="sensor", *, little_endian=True):
    """A message of a transducer, packed."""
    store = ros2_store()
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"]
    stamp = types["builtin_interfaces/msg/Time"](100 + index // 100, index % 100 * 10**7)
    message = types[WRENCH](
        types["std_msgs/msg/Header"](stamp, frame),
        types["geometry_msgs/msg/Wrench"](
            vector(1.0 * index, -2.0, 0.5), vector(0.1, 0.2, 0.3 * index)
        ),
    )
    return store.serialize_cdr(message, WRENCH, little_endian=little_endian)


# --- Random and mutated bytes for every reader, with what must hold for each of them ------------------------------


_MINUS = re.compile(b"(?:\xe2\x88\x92|\xe2\x80\x93|\xef\xb9\xa3|\xef\xbc\x8d)(?=[0-9.,])")
"""Signs of typesetting that stand for a minus before a number."""
_THOUSANDS = re.compile(rb'(?<![^\s"])[+-]?\d{1,3}(?:,\d{3})+\.\d*(?:[eE][+-]?\d+)?(?![^\s"])')
"""A number alone in quotes or between blanks, with separators of thousands and a decimal mark."""


def _with_plain_numbers(line):
    """Rewrite numbers with the minus behind, in brackets as accountants write it, with an exponent of Fortran."""
    has_commas = b";" in line or b"\t" in line
    parts = b'";' if has_commas else b'",'
    number = rb"\d[\d.,]*" if has_commas else rb"\d[\d.]*"
    begins, ends = rb"(?<![^\s%b])" % parts, rb"(?![^\s%b])" % parts
    line = re.sub(begins + rb"(%b)-" % number + ends, rb"-\1", line)
    line = re.sub(begins + rb"\((%b)\)" % number + ends, rb"-\1", line)
    exponent = rb"([+-]?%b)[dD]([+-]?\d{1,3})" % number
    return re.sub(begins + exponent + ends, rb"\1E\2", line)


def check_rows(foreign, log, content):
    """Compare with the plainest reading of each line.

    Parameters
    ----------
    foreign : Foreign
    log : Log
    content : bytes
        Of the file.

    Raises
    ------
    AssertionError
        If a row of the log stands in no line of the file.
    """
    lines = content.splitlines()
    assert log.rows <= len(lines)
    assert not any(np.isinf(values).any() for values in log.columns.values())
    if not content.startswith(foreign.header):
        return  # a damaged header may well say that other cells are meant
    if any(column not in log.columns for column in foreign.raw):
        return  # a column that holds hardly a number any more is left out, and damage to it allowed
    seen = set()
    for line in lines:
        plain = _MINUS.sub(b"-", line)
        plain = _THOUSANDS.sub(lambda number: number[0].replace(b",", b""), plain)
        plain = _with_plain_numbers(plain)
        try:
            seen.add(tuple(foreign.cells(plain.decode("latin-1"))))
        except (ValueError, IndexError, StopIteration):
            continue
    rows = np.stack([log.columns[column] for column in foreign.raw], axis=1)
    for row in rows[~np.isnan(rows).any(axis=1)].tolist():  # NaN stands for a cell without a number
        assert tuple(row) in seen, row
