"""``rostopic echo -p``: the messages of one topic as comma-separated text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from rftfit.logs.base import PacketCount, ns_to_s
from rftfit.logs.delimited import kinds_of
from rftfit.logs.text import Kind, Layout, Plan, TextReader, lines_of, readable
from rftfit.logs.units import unique

if TYPE_CHECKING:
    import numpy as np

RECEIVED = "received"
STAMP = "header.stamp"
COUNT = "header.seq"
LOST = "lost messages (gap in header.seq)"

_UNITS = (
    (re.compile(r"(^|\.)force\.[xyz]$"), "N"),
    (re.compile(r"(^|\.)torque\.[xyz]$"), "N m"),
    (re.compile(r"(^|\.)(position|translation)\.[xyz]$"), "m"),
    (re.compile(r"(^|\.)angular(_velocity)?\.[xyz]$"), "rad/s"),
    (re.compile(r"(^|\.)linear_acceleration\.[xyz]$"), "m/s^2"),
)


class RostopicReader(TextReader):
    """The first column is ``%time`` in ns; all others are named ``field.`` and their place."""

    name = "rostopic"
    evidence = "its first column %time and the names that begin with field."

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "csv of `rostopic echo -p`; time is the header's stamp, else the time of receipt"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return readable(head[:256]).startswith(b"%time,field.")

    def plan(self, head: bytes) -> Plan:
        """Read the names."""
        lines = lines_of(head, 1)
        if not lines or not lines[0].whole or not lines[0].text.startswith("%time"):
            raise ValueError("no row of names that begins with %time and has an end: cut short?")
        cells = lines[0].text.split(",")
        names = unique([RECEIVED, *(cell.removeprefix("field.") for cell in cells[1:])])
        start = lines[0].stop
        kinds = kinds_of(head, start, len(names), ",", ".")
        counted = COUNT in names and kinds[names.index(COUNT)] == "number"
        packets = PacketCount() if counted else None
        clock = STAMP if _stamped(head[start:], names) else RECEIVED

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            if packets is not None:
                packets.follow(columns[COUNT], index)
            received = ns_to_s(columns.pop(RECEIVED))
            time = ns_to_s(columns.pop(STAMP)) if clock == STAMP else received
            return {"time": time, RECEIVED: received, **columns}

        return Plan(
            Layout(names, tuple(_kind(*pair, clock) for pair in zip(names, kinds, strict=True))),
            {RECEIVED: "s", **{name: _unit(name) for name in names if name != RECEIVED}},
            start,
            derive,
            packets,
            LOST,
            keep=frozenset({RECEIVED, clock} | ({COUNT} if counted else set())),
            notes=(f"time is {STAMP if clock == STAMP else '%time'}",),
        )


def _kind(name: str, kind: Kind, clock: str) -> Kind:
    if name == STAMP and clock != STAMP:
        return "skip"
    return "integer" if name in (RECEIVED, STAMP) else kind


def _stamped(data: bytes, names: tuple[str, ...]) -> bool:
    """Whether the first message has a stamp of its own; nobody set it where it is 0."""
    if STAMP not in names:
        return False
    place = names.index(STAMP)
    for line in lines_of(data, 20):
        cells = line.text.split(",")
        if line.whole and len(cells) == len(names):
            return cells[place].strip().isdigit() and int(cells[place]) > 0
    return False


def _unit(name: str) -> str:
    return next((unit for pattern, unit in _UNITS if pattern.search(name)), "")
