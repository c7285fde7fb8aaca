"""Dialects of comma-separated text, each described by its header rows in ``presets.toml``, as that of the rig.

Names and units alone make such a dialect: `time_s,F1_N` is time in s and F1 in N, and another unit may stand there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rftfit.logs.quantities import units_by_name
from rftfit.logs.text import ReadingPlan, TextReader
from rftfit.store.chosen import read_toml
from rftfit.table.parse import Layout
from rftfit.table.text import Line, as_utf8, each_line


class PresetReader(TextReader):
    """Comma-separated text whose names are those of a header row in the preset; units may differ.

    `preset`: Its table in ``presets.toml``: description, evidence, the sign of comments, and headers (kind of log, to a
    header row).
    """

    def __init__(self, name: str, preset: Mapping[str, Any]) -> None:
        self.name = name
        self.description = preset["description"]
        self.evidence = preset["evidence"]
        self._comment: str = preset["comment"]
        self._headers: Mapping[str, str] = preset["headers"]
        # the names of each header, without units
        self._names_allowed = {
            tuple(units_by_name(row.split(","))) for row in self._headers.values()
        }

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        return not self.plan(as_utf8(head)).refusal

    def plan(self, head: bytes) -> ReadingPlan:
        """Read the header row: the first line that is neither blank nor a comment.

        Another header is the refusal of the plan, not an error: the rows of the file can still be counted.
        """
        comment_or_blank = ("", self._comment)
        lines = (line for line in each_line(head) if line.text.strip()[:1] not in comment_or_blank)
        line = next(lines, Line("", len(head), whole=False))
        header = line.text.strip()
        units = units_by_name(header.split(","))
        layout = Layout(tuple(units), comment=self._comment)
        refusal = "" if layout.names in self._names_allowed else self._describe_refusal(header)
        return ReadingPlan(layout, units, line.stop, refusal=refusal)

    def _describe_refusal(self, header: str) -> str:
        """Return the sentence on what is wrong with a header row that is none of the preset."""
        if ";" in header or "\t" in header:
            separators = "semicolons" if ";" in header else "tabs"
            return (
                f"the header row is separated by {separators}; this dialect wants commas between cells and "
                "points in numbers: export the log again that way"
            )
        allowed = ", ".join(f"{row!r} for {log}" for log, row in self._headers.items())
        return f"found the header {header[:120]!r}; allowed: {allowed}"


def presets() -> list[PresetReader]:
    """Make a reader of each preset."""
    return [PresetReader(*named) for named in read_toml("logs", "presets.toml").items()]
