"""What a log is before any run sheet names it, and the config lines that it needs."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import TextFormat
from rftfit.errors import InputError
from rftfit.logs.base import Log, LogError, added
from rftfit.logs.delimited import DelimitedReader, encoding_of, first_lines, look
from rftfit.logs.registry import dialects, faults
from rftfit.logs.units import MEANING, guess, guesses

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Reader


# --- What can be said of a log on its own: columns, clock, resolution, damage, what it lacks.


GAP_STEPS = 5.0
"""A step longer than this many median steps is shown as a gap."""

_MOST_GAPS = 10_000


@dataclass(frozen=True)
class Column:
    """One column of a log.

    `lowest`, `highest`: NaN if there is no usable row.
    `resolution`: Smallest step between two distinct values; NaN if there are not two.
    """

    name: str
    quantity: str
    unit: str
    lowest: float
    highest: float
    resolution: float


@dataclass(frozen=True)
class Clock:
    """The time column of a log, in its own unit.

    `duration`: From the first to the last usable row.
    `step`, `jitter`: Median step between rows that go forward, and the median departure from it;
        NaN if there are fewer than two rows. Of a file that is read in blocks: those of the first
        block.
    `gaps`: Start and length of every step longer than `GAP_STEPS` median steps.
    `repeated`, `backwards`: Rows whose time is that of the row before, or earlier.
    """

    duration: float
    step: float
    jitter: float
    gaps: tuple[tuple[float, float], ...]
    repeated: int
    backwards: int

    @property
    def rate(self) -> float:
        """Rows per unit of time."""
        return 1 / self.step if self.step > 0 else float("nan")


@dataclass
class ClockMeter:
    """The clock of a log that comes in blocks.

    `gaps`: The first ten thousand.
    """

    step: float = float("nan")
    jitter: float = float("nan")
    gaps: list[tuple[float, float]] = field(default_factory=list)
    repeated: int = 0
    backwards: int = 0
    _low: float = float("inf")
    _high: float = float("-inf")
    _last: float | None = None

    def add(self, time: FloatArray) -> None:
        """Go on with the next rows.

        `time`: shape (n,).
        """
        if time.size == 0:
            return
        steps = np.diff(time) if self._last is None else np.diff(time, prepend=self._last)
        starts = time[:-1] if self._last is None else np.concatenate([[self._last], time[:-1]])
        forward = steps[steps > 0]
        if forward.size and not self.step > 0:
            self.step = float(np.median(forward))
            self.jitter = float(np.median(np.abs(forward - self.step)))
        if self.step > 0:
            late = np.flatnonzero(steps > GAP_STEPS * self.step)[: _MOST_GAPS - len(self.gaps)]
            self.gaps += [(float(starts[i]), float(steps[i])) for i in late]
        self.repeated += int(np.count_nonzero(steps == 0))
        self.backwards += int(np.count_nonzero(steps < 0))
        self._low, self._high = min(self._low, time.min()), max(self._high, time.max())
        self._last = float(time[-1])

    def clock(self) -> Clock:
        """Return what was seen so far."""
        duration = float(self._high - self._low) if self._last is not None else 0.0
        return Clock(
            duration, self.step, self.jitter, tuple(self.gaps), self.repeated, self.backwards
        )


@dataclass(frozen=True)
class Survey:
    """Everything that one pass over a log tells.

    `first`: The first block.
    `clock`: None where no column is the time.
    `quantities`: Guessed: quantity to column.
    `rows`, `used`: Data lines, and those that can be read.
    `moving`: Number of values, at most two, that the sync line takes; 0 where there is none.
    """

    first: Log
    columns: list[Column]
    clock: Clock | None
    time_unit: str
    quantities: dict[str, str]
    rows: int
    used: int
    dropped: dict[str, int]
    missing: dict[str, int]
    notes: tuple[str, ...]
    moving: int


def survey(blocks: Iterable[Log]) -> Survey:
    """Look at a log, block by block, so that memory stays bounded.

    `blocks`: At least one.
    """
    meter = ClockMeter()
    first: Log | None = None
    columns: list[Column] = []
    rows = used = 0
    dropped: dict[str, int] = {}
    missing: dict[str, int] = {}
    lines: set[float] = set()
    for log in blocks:
        found = columns_of(log)
        if first is None:
            quantities = guesses(log)
            first, columns = log, _named(found, quantities)
        else:
            columns = [_both(*pair) for pair in zip(columns, found, strict=True)]
        if "time" in quantities:
            meter.add(log.columns[quantities["time"]])
        if "arm_moving" in quantities and len(lines) < 2:
            lines.update(np.unique(log.columns[quantities["arm_moving"]])[:2].tolist())
        rows, used = rows + log.rows, used + log.size
        dropped, missing = added(dropped, log.dropped), added(missing, log.missing)
    assert first is not None
    unit = first.units.get(quantities.get("time", ""), "")
    clock = meter.clock() if "time" in quantities else None
    return Survey(
        first, columns, clock, unit, quantities, rows, used, dropped, missing, first.notes, len(lines)
    )  # fmt: skip


def columns_of(log: Log) -> list[Column]:
    """Describe every column.

    Returns in the order of the file.
    """
    return [_column(name, values, log.units.get(name, "")) for name, values in log.columns.items()]


def _column(name: str, values: FloatArray, unit: str) -> Column:
    quantity = MEANING.get(guess(name, unit), "-")
    if values.size == 0:
        return Column(name, quantity, unit, np.nan, np.nan, np.nan)
    steps = np.diff(np.unique(values))
    resolution = float(steps.min()) if steps.size else np.nan
    return Column(name, quantity, unit, float(values.min()), float(values.max()), resolution)


def _named(columns: list[Column], quantities: dict[str, str]) -> list[Column]:
    """Say of each column what it was guessed to be in the end."""
    meant = {column: MEANING[quantity] for quantity, column in quantities.items()}
    return [replace(column, quantity=meant.get(column.name, "-")) for column in columns]


def _both(one: Column, other: Column) -> Column:
    return Column(
        one.name,
        one.quantity,
        one.unit,
        float(np.fmin(one.lowest, other.lowest)),
        float(np.fmax(one.highest, other.highest)),
        float(np.fmin(one.resolution, other.resolution)),
    )


def clock_of(log: Log) -> Clock:
    """Describe the clock.

    `log`: With a column ``time``.
    """
    meter = ClockMeter()
    meter.add(log.columns["time"])
    return meter.clock()


# --- What a log still lacks, and the lines of config that make it fit for ingest.


FORCE = ("time", "F1", "F2", "F3")
MOTION = ("time", "x", "z", "angle")
_USUAL = {"time": "s", "x": "mm", "z": "mm", "angle": "deg"}
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./ ]*[A-Za-z0-9_]|[A-Za-z]")
_WORDS = frozenset({"y", "n", "yes", "no", "on", "off", "true", "false", "null"})


def kinds(found: Survey) -> list[str]:
    """Tell what sort of log a file is.

    Returns of ``force``, ``motion``; both for a file that holds both, none where nothing tells.
    """
    force = any(f"F{number}" in found.quantities for number in (1, 2, 3))
    motion = any(name in found.quantities for name in ("x", "z", "angle"))
    return [kind for kind, there in (("force", force), ("motion", motion)) if there]


def lacking(found: Survey) -> list[str]:
    """Say what the measurement chain needs beyond this file.

    Returns A sentence each; the first names the other half of the pair.
    """
    sorts = kinds(found)
    needs = []
    if sorts != ["force", "motion"]:
        other = "the motion log of the same run (time, x, z, angle)"
        if sorts == ["motion"]:
            other = "the force log of the same run (time, arm_moving, F1, F2, F3)"
        needs.append(other)
    needs.append("a row of the run sheet that names both")
    if not sorts:
        needs.append("which columns are forces or positions: name them in the config")
    if "time" not in found.quantities:
        needs.append("a time: the column that holds it, or the rate (text: {rate_Hz: ...})")
    for kind, wanted in (("force", FORCE), ("motion", MOTION)):
        if kind in sorts:
            gone = [name for name in wanted[1:] if name not in found.quantities]
            needs += [f"{name}: {MEANING[name]}; {_instead(name)}" for name in gone]
    unknown = [
        column
        for quantity, column in found.quantities.items()
        if quantity != "arm_moving" and not found.first.units.get(column)
    ]
    if unknown:
        needs.append(f"the unit of {', '.join(unknown)}: the file does not state it")
    if "force" in sorts:
        needs.append("transducer range, axes and turn, in config.yaml")
        if "arm_moving" not in found.quantities:
            needs.append(
                "no sync line: set clock.method in config.yaml to estimate, or to same_clock where "
                "force and motion have one clock"
            )
        elif found.moving == 1:
            needs.append("a change of arm_moving: without one the two clocks cannot be joined")
    if "motion" in sorts:
        needs.append("the arm z of the free surface, in config.yaml or the run sheet")
    if found.used < 2:
        needs.append("at least two usable rows")
    return needs


def _instead(name: str) -> str:
    if name == "angle":
        return "without it beta is taken from the run sheet"
    if name == "x":
        return "without it only vertical paths can be used"
    if name.startswith("F"):
        return (
            "a channel that nobody measured: {constant: 0, unit: N}, and its direction counts for 0"
        )
    return "name its column"


def config_block(found: Survey, dialect: str, text: Mapping[str, Any] | None = None) -> list[str]:
    """Write the lines of config for a log.

    `text`: Format, where the dialect is ``delimited``. Returns lines of YAML; what is a guess says
    so.
    """
    if dialect == "rig":
        return ["dialect: rig"]
    lines = []
    sorts = kinds(found)
    if not sorts:
        lines.append("# force_log: for a log of forces; write motion_log: for one of positions")
    for kind in sorts or ["force"]:
        lines.append(f"{kind}_log:")
        if text is None:
            lines.append(f"  dialect: {dialect}")
        else:
            inside = ", ".join(f"{key}: {scalar(value)}" for key, value in text.items())
            lines.append(f"  text: {{{inside}}}")
        begin = len(lines)
        wanted: tuple[str, ...] = FORCE if kind == "force" else MOTION
        if kind == "force" and "arm_moving" in found.quantities:
            wanted = (*wanted, "arm_moving")
        lines += [line for name in wanted for line in _line(found, name)]
        chosen = [line for line in lines[begin:] if not line.lstrip().startswith("#")]
        if chosen or begin < len(lines):
            # a section of comments only would be an empty one
            example = "  columns:" if chosen else "  columns: {} # quantity: column, a line each"
            lines.insert(begin, example)
    return lines


def _line(found: Survey, quantity: str) -> list[str]:
    column = found.quantities.get(quantity)
    if column is None:
        return [f"    # {quantity}: no column looks like it"]
    unit = found.first.units.get(column, "")
    if column == quantity and (unit or quantity == "arm_moving"):
        return []
    number = re.fullmatch(r"column (\d+)", column)
    name = number[1] if number else scalar(column)
    if unit or quantity == "arm_moving":
        declared = f", unit: {unit}" if _converted(quantity, unit) else ""
        return [
            f"    {quantity}: {{column: {name}{declared}}}"
            if declared
            else f"    {quantity}: {name}"
        ]
    usual = _USUAL.get(quantity, "N")
    return [f"    {quantity}: {{column: {name}, unit: {usual}}} # the file states no unit: check"]


def _converted(quantity: str, unit: str) -> bool:
    """Whether the unit is another than the chain's usual one: then it has to be declared."""
    return quantity not in ("time", "arm_moving") and unit != _USUAL.get(quantity, "N")


def scalar(value: object) -> str:
    """Write a value as YAML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        plain = _PLAIN.fullmatch(value) and value.casefold() not in _WORDS
        return value if plain else json.dumps(value, ensure_ascii=False)
    return str(value)


# --- A log that no dialect knows: what it looks like, and how it may be read all the same.


_TRIED_WHOLE = 1 << 20


def as_text(head: bytes) -> tuple[Reader, dict[str, Any]] | None:
    """Find a description by which a file can be read as delimited text.

    Returns `text`: The description, as keys of `text` in the config.
    """
    found = look(head)
    if found is None:
        return None
    text = found.as_format()
    return DelimitedReader().described(TextFormat.model_validate(text)), text


def tried() -> list[str]:
    """Name the dialects that were tried, and those that could not be."""
    names = ", ".join(name for name in dialects() if name != "delimited")
    return [f"tried: {names}", *(f"not tried: {fault}" for fault in faults())]


def refusal(path: Path, head: bytes) -> InputError:
    """Say why a file cannot be read, and what it looks like."""
    if not head:
        return InputError(f"{path}: the file is empty")
    lines = [f"{path}: no dialect reads this file. The dialects there are:"]
    small = path.stat().st_size <= _TRIED_WHOLE
    for reader in dialects().values():
        why = f": {_reason(reader, path)}" if small and reader.name == "rig" else ""
        lines.append(f"  {reader.name} ({reader.describe()}){why}")
    lines += [f"  {fault}" for fault in faults()]
    lines.append(f"It looks like: {encoding_of(head)}; it begins with")
    lines += [f"  {line}" for line in first_lines(head)]
    if encoding_of(head) != "binary":
        lines.append(
            "No delimiter gives two rows of numbers below each other. If it is a table, describe it "
            "in the config: force_log: {text: {delimiter: ..., skip_lines: ...}}"
        )
    return InputError("\n".join(lines))


def _reason(reader: Reader, path: Path) -> str:
    try:
        reader.load(path)
    except LogError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""
