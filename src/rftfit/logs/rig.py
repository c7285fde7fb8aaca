"""The rig's own csv pair: a force log and a motion log (docs/dialects.md)."""

from __future__ import annotations

import re

from rftfit.logs.text import ReadingPlan, TextReader
from rftfit.table.parse import Layout
from rftfit.table.text import Line, as_utf8, each_line

FORCE_COLUMNS = ("time", "arm_moving", "F1", "F2", "F3")
MOTION_COLUMNS = ("time", "x", "z", "angle")

_NAME_UNIT = re.compile(r"(time|F[123]|x|z|angle)_([A-Za-z]+)")


class RigReader(TextReader):
    """Comma-separated text with ``#`` comments, one header row and the unit in each name."""

    name = "rig"
    description = "force and motion csv pair of the rig, one header row, units in the column names"
    evidence = "its header row of the rig's own names"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        return not self.plan(as_utf8(head)).refusal

    def plan(self, head: bytes) -> ReadingPlan:
        """Read the header row: the first line that is neither blank nor a comment."""
        lines = (line for line in each_line(head) if line.text.strip()[:1] not in ("", "#"))
        line = next(lines, Line("", len(head), whole=False))
        header = line.text.strip()
        units: dict[str, str] = {}
        names = []
        for cell in (text.strip() for text in header.split(",")):
            match = _NAME_UNIT.fullmatch(cell)
            name, unit = (match[1], match[2]) if match else (cell, "")
            names.append(name)
            units[name] = unit
        layout = Layout(tuple(names), comment="#")
        return ReadingPlan(layout, units, line.stop, refusal=_refusal(header, layout.names))


def _refusal(header: str, names: tuple[str, ...]) -> str:
    """Say what is wrong with the header row; empty: nothing."""
    if ";" in header or "\t" in header:
        separators = "semicolons" if ";" in header else "tabs"
        return (
            f"the header row is separated by {separators}; this dialect wants commas between cells and "
            "points in numbers: export the log again that way"
        )
    if names not in (FORCE_COLUMNS, MOTION_COLUMNS, (*FORCE_COLUMNS, *MOTION_COLUMNS[1:])):
        return (
            f"found the header {header[:120]!r}; allowed: 'time_s,arm_moving,F1_N,F2_N,F3_N' for a "
            "force log, 'time_s,x_mm,z_mm,angle_deg' for a motion log, or the columns of both in one"
        )
    return ""
