"""``rostopic echo -p``: messages of one topic as comma-separated text; units of the fields of any ROS message."""

from __future__ import annotations

import re

import numpy as np

from rftfit.logs.base import FIRST, PacketCount
from rftfit.logs.delimited import judge_columns
from rftfit.logs.text import ReadingPlan, TextReader
from rftfit.table.numbers import NO_VALUE
from rftfit.table.parse import Layout
from rftfit.table.stamps import ns_to_s
from rftfit.table.text import decode_first_lines, text_head, unique_names

# columns of a log: time of receipt, time by the sender, and number of the message by the sender
RECEIVED = "received"
STAMP = "header.stamp"
COUNT = "header.seq"
LOST = "lost messages (gap in header.seq)"

# advice for the output of rostopic echo without -p, and what such a text begins with
ECHO = (
    "these are messages as `rostopic echo` shows them: record with -p (rostopic echo -p TOPIC > log.csv), "
    "or record a bag"
)
_ECHO = re.compile(rb"\w+:.*\n(?:[ \w-].*\n)*?---\r?\n")

UNITS = {
    "force": ("geometry_msgs/msg/Wrench", "N"),
    "torque": ("geometry_msgs/msg/Wrench", "N m"),
    "position": ("geometry_msgs/msg/Pose", "m"),
    "translation": ("geometry_msgs/msg/Transform", "m"),
    "angular": ("geometry_msgs/msg/Twist", "rad/s"),
    "angular_velocity": ("sensor_msgs/msg/Imu", "rad/s"),
    "linear_acceleration": ("sensor_msgs/msg/Imu", "m/s^2"),
}
"""Name of a vector in a message, to the message type that lays down its unit, and the unit."""


class RostopicReader(TextReader):
    """The first column is ``%time`` in ns; all others are named ``field.`` and their path in the message."""

    name = "rostopic"
    description = "csv of `rostopic echo -p`; time is the header's stamp, else the time of receipt"
    evidence = "its first column %time and the names that begin with field."

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        return text_head(head[:256]).startswith(b"%time,field.")

    def plan(self, head: bytes) -> ReadingPlan:
        """Read the names, and choose the clock by the first row: the sender's stamp, if it was set, else the receipt.

        Times are read as whole numbers of ns and become s. Raises ValueError without a row of names.
        """
        lines = decode_first_lines(head, 1)
        if not lines or not lines[0].whole or not lines[0].text.startswith("%time"):
            text = "no row of names that begins with %time and has an end"
            raise ValueError(f"{text}: {ECHO if is_echo(head) else 'cut short?'}")
        start = lines[0].stop
        cells = lines[0].text.split(",")
        names = unique_names([RECEIVED, *(cell.removeprefix("field.") for cell in cells[1:])])
        first_lines = decode_first_lines(head[start:], FIRST.rows)
        rows = [line.text.split(",") for line in first_lines if line.whole]
        seen = judge_columns(rows, names)
        kinds = dict(zip(names, seen.kinds, strict=True))
        packets = PacketCount(LOST) if kinds.get(COUNT) == "number" else None
        # a stamp of 0 was never set: then the time of receipt is the clock
        first_row = next((row for row in rows if len(row) == len(names)), ())
        stamp = dict(zip(names, first_row, strict=False)).get(STAMP, "").strip()
        is_stamped = stamp.isdigit() and int(stamp) > 0
        kinds[RECEIVED] = "integer"
        if STAMP in kinds:
            kinds[STAMP] = "integer" if is_stamped else "skip"
        clock = STAMP if is_stamped else RECEIVED

        def derive(
            columns: dict[str, np.ndarray], line_numbers: np.ndarray
        ) -> dict[str, np.ndarray]:
            """Count lost messages, and convert the times from ns to s."""
            if packets is not None:
                # a row with a damaged number was received all the same: it is not counted as lost
                is_counted = np.isfinite(columns[COUNT])
                packets.follow(columns[COUNT][is_counted], line_numbers[is_counted])
            times = {name: ns_to_s(columns.pop(name)) for name in {RECEIVED, clock}}
            return {"time": times[clock], RECEIVED: times[RECEIVED], **columns}

        return ReadingPlan(
            Layout(names, tuple(kinds.values()), no_value=NO_VALUE, mixed=seen.mixed),
            {name: _unit(name) for name in names},
            start,
            derive,
            packets,
            keep=frozenset({RECEIVED, clock, *([COUNT] if packets else [])}),
            notes=(f"time is {STAMP if is_stamped else '%time'}",),
            unread=seen.unread,
        )


def is_echo(head: bytes) -> bool:
    """Return whether a text shows messages as `rostopic echo` without -p prints them, which is no table."""
    return bool(_ECHO.match(text_head(head)))


def _unit(name: str) -> str:
    """Return the unit that ROS lays down for a field, by its name; empty: none."""
    if name == RECEIVED:
        return "s"
    *_, vector, axis = ("", *name.split("."))
    return UNITS[vector][1] if vector in UNITS and axis in ("x", "y", "z") else ""
