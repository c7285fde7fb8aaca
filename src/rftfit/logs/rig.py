"""The rig's own csv pair: a force log and a motion log (docs/architecture.md)."""

from __future__ import annotations

import re
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from rftfit.logs.base import Log, LogError, join
from rftfit.logs.text import Kind, Layout, Parsed, Plan, TextReader, is_data, parse_bodies

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Self

FORCE_COLUMNS = ("time", "arm_moving", "F1", "F2", "F3")
MOTION_COLUMNS = ("time", "x", "z", "angle")
MAX_BYTES = 1 << 36
WHOLE_BYTES = 1 << 24
"""Longer files are read in blocks, so that memory stays bounded."""

_NUMBER: Kind = "number"
_CELL = re.compile(r"^(time|F[123]|x|z|angle)_([A-Za-z]+)$")


class RigDialect(TextReader):
    """Comma-separated text with ``#`` comments, one header row and the unit in each name."""

    name = "rig"
    evidence = "its header row of the rig's own names"

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "force and motion csv pair of the rig, one header row, units in the column names"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect."""
        header, _ = _split(head)
        try:
            _columns(header)
        except ValueError:
            return False
        return True

    def only(self, columns: Collection[str]) -> Self:  # noqa: ARG002
        """Return the same reader: its few columns are all needed."""
        return self

    def plan(self, head: bytes) -> Plan:
        """Read the header row, as files need it that are read in blocks."""
        header, body = _split(head)
        names, units = _columns(header)
        layout = Layout(names, tuple(_NUMBER for _ in names), comment="#")
        return Plan(layout, dict(units), len(head) - len(body))

    def load(self, path: Path) -> Log:
        """Read a force log or a motion log.

        Returns columns ``time, arm_moving, F1, F2, F3`` or ``time, x, z, angle``.
        """
        log = self.load_many([path])[0]
        if isinstance(log, LogError):
            raise log
        return log

    def load_many(self, paths: Sequence[Path]) -> list[Log | LogError]:
        """Read many logs; an unusable one comes back as its error.

        Returns in the order of `paths`.
        """
        long = [_is_long(path) for path in paths]
        if any(long):
            return [
                self._long(path) if alone else self.load_many([path])[0]
                for path, alone in zip(paths, long, strict=True)
            ]
        texts = [_text(path) for path in paths]
        logs: list[Log | LogError | None] = [t if isinstance(t, LogError) else None for t in texts]
        for columns in (FORCE_COLUMNS, MOTION_COLUMNS):
            chosen = [
                (place, text)
                for place, text in enumerate(texts)
                if isinstance(text, _Text) and text.names == columns
            ]
            parsed = parse_bodies([text.body for _, text in chosen], len(columns))
            for (place, text), part in zip(chosen, parsed, strict=True):
                logs[place] = _log(paths[place], text, part)
        return [log for log in logs if log is not None]

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a log in blocks of some megabytes, where it is long."""
        if not _is_long(path):
            yield self.load(path)
            return
        if path.stat().st_size > MAX_BYTES:
            raise LogError(
                "too_large", f"{path}: larger than {MAX_BYTES >> 20} MB; a log holds one run"
            )
        yield from super().stream(path)

    def _long(self, path: Path) -> Log | LogError:
        try:
            return join(self.stream(path))
        except LogError as error:
            return error


class _Text(NamedTuple):
    """A file before its numbers are parsed."""

    names: tuple[str, ...]
    units: dict[str, str]
    body: bytes


def _is_long(path: Path) -> bool:
    try:
        return path.stat().st_size > min(WHOLE_BYTES, MAX_BYTES)
    except OSError:
        return False


def _text(path: Path) -> _Text | LogError:
    try:
        content = _read(path)
        if not content or content.isspace():
            return LogError("empty", f"{path}: the file is empty")
        header, body = _split(content)
        try:
            names, units = _columns(header)
            return _Text(names, dict(units), body)
        except ValueError as error:
            rows = sum(map(is_data, body.splitlines()))
            return LogError("header", f"{path}: {error}", rows)
    except LogError as error:
        return error


def _log(path: Path, text: _Text, parsed: Parsed) -> Log | LogError:
    if parsed.rows == 0:
        return LogError("header_only", f"{path}: a header row and no data", 0)
    columns = dict(zip(text.names, parsed.values, strict=True))
    return Log(path, columns, text.units, parsed.rows, parsed.dropped)


def _read(path: Path) -> bytes:
    try:
        with path.open("rb", buffering=0) as file:
            return file.readall()
    except FileNotFoundError:
        raise LogError("missing", f"{path}: log missing") from None
    except OSError as error:
        raise LogError("unreadable", f"{path}: cannot be read: {error.strerror}") from error


def _split(content: bytes) -> tuple[str, bytes]:
    """Header row, and everything after it; comments and blank lines in front are passed over."""
    start = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    while start < len(content):
        # \n, \r\n or \r alone; the blank line between \r and \n is passed over
        end = content.find(b"\n", start)
        end = len(content) if end < 0 else end
        early = content.find(b"\r", start, end)
        end = end if early < 0 else early
        line = content[start:end].strip()
        start = end + 1
        if line and not line.startswith(b"#"):
            return line.decode("utf-8", "replace"), content[start:]
    return "", b""


@lru_cache(64)
def _columns(header: str) -> tuple[tuple[str, ...], Mapping[str, str]]:
    """Names without units, and the units; `ValueError` says what is wrong with the header."""
    if ";" in header or "\t" in header:
        found = "semicolons" if ";" in header else "tabs"
        raise ValueError(
            f"the header row is separated by {found}; this dialect wants commas between cells and "
            "points in numbers: export the log again that way"
        )
    names: list[str] = []
    units: dict[str, str] = {}
    for cell in (part.strip() for part in header.split(",")):
        match = _CELL.match(cell)
        name = match[1] if match else cell
        names.append(name)
        units[name] = match[2] if match else ""
    found_names = tuple(names)
    if found_names not in (FORCE_COLUMNS, MOTION_COLUMNS):
        raise ValueError(
            f"found the header {header[:120]!r}; allowed: 'time_s,arm_moving,F1_N,F2_N,F3_N' for a "
            "force log, 'time_s,x_mm,z_mm,angle_deg' for a motion log"
        )
    return found_names, MappingProxyType(units)
