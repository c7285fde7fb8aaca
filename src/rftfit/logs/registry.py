"""The dialects there are, those of other packages included, and which one a file is of."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rftfit.campaign.problems import unknown_word
from rftfit.errors import InputError
from rftfit.logs.ati import AtiDaqReader, AtiNetftReader
from rftfit.logs.base import HEAD_BYTES, Log, LogError, Reader
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.instron import InstronReader
from rftfit.logs.labview import LvmReader
from rftfit.logs.rig import RigDialect
from rftfit.logs.rosbag import RosBagReader
from rftfit.logs.rostopic import RostopicReader
from rftfit.logs.tabular import ParquetReader, XlsxReader
from rftfit.logs.tdms import TdmsReader

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from importlib.metadata import EntryPoint
    from pathlib import Path

    from rftfit.campaign.config import AnyLog


# --- Dialects of other packages: found by their entry points, and kept from breaking anything.


GROUP = "rftfit.dialects"
_NEEDED = ("describe", "detect")
_UNKNOWN = "an unknown package"


class Origin(NamedTuple):
    """Where a dialect is from.

    `package`: As it was installed; "an unknown package" where nobody says.
    `version`: Of the package; empty where nobody says.
    `module`: That the entry point names.
    """

    package: str
    version: str
    module: str


class Plugins(NamedTuple):
    """What was found.

    `readers`: By the name of the entry point.
    `faults`: The same of those that cannot be used, and why.
    `origins`: Of the readers.
    """

    readers: dict[str, PluginReader]
    faults: dict[str, str]
    origins: dict[str, Origin]


class PluginReader(Reader):
    """A reader of another package; whatever goes wrong inside becomes one readable error.

    `name`: Of the entry point.
    `origin`: The package, for messages.
    `inner`: With ``describe``, ``detect`` and ``load`` or ``stream``.
    """

    def __init__(self, name: str, origin: str, inner: Any) -> None:
        self.name = name
        self.origin = origin
        self.evidence = str(getattr(inner, "evidence", "") or Reader.evidence)
        self._inner = inner

    def describe(self) -> str:
        """Return the package's one line, and the package."""
        try:
            text = str(self._inner.describe())
        except Exception as error:  # noqa: BLE001  # foreign code may raise anything
            text = f"describe() failed: {_words(error)}"
        return f"{text} ({self.origin})"

    def detect(self, head: bytes) -> bool:
        """Ask the package; a reader that fails knows nothing."""
        try:
            return bool(self._inner.detect(head))
        except Exception:  # noqa: BLE001  # foreign code may raise anything
            return False

    def with_options(self, options: Mapping[str, object]) -> Reader:
        """Hand the options of the config on."""
        if not options or not hasattr(self._inner, "with_options"):
            return super().with_options(options)
        return PluginReader(self.name, self.origin, self._inner.with_options(options))

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in the package's blocks, or as one."""
        inner = self._inner
        try:
            whole = not hasattr(inner, "stream") or type(inner).__dict__.get("load") is not None
            for log in [inner.load(path)] if whole else inner.stream(path):
                if not isinstance(log, Log):
                    raise TypeError(f"load gave a {type(log).__name__}, not a rftfit.logs.base.Log")
                yield log
        except (LogError, GeneratorExit):
            raise
        except Exception as error:  # foreign code may raise anything
            text = f"{path}: the dialect {self.name} of {self.origin} failed: {_words(error)}"
            raise LogError("plugin", f"{text}; tell its author") from error


@cache
def plugins() -> Plugins:
    """Find the dialects of other packages, once."""
    from importlib.metadata import entry_points

    found = Plugins({}, {}, {})
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, _origin(p))):
        if point.name in found.readers:
            found.faults[point.name] = (
                f"the dialect {point.name} is in {found.readers[point.name].origin} and in "
                f"{_origin(point)}; the first is used: uninstall one of them"
            )
            continue
        try:
            loaded = point.load()
            inner = loaded() if isinstance(loaded, type) else loaded
            missing = [part for part in _NEEDED if not callable(getattr(inner, part, None))]
            if not any(callable(getattr(inner, part, None)) for part in ("load", "stream")):
                missing.append("load")
            if missing:
                raise TypeError(f"it has no {', '.join(missing)}")
        except Exception as error:  # noqa: BLE001  # foreign code may raise anything
            found.faults[point.name] = (
                f"the dialect {point.name} of {_origin(point)} ({point.value}) cannot be loaded: "
                f"{_words(error)}; other dialects are not affected"
            )
        else:
            found.readers[point.name] = PluginReader(point.name, _origin(point), inner)
            package, version = (
                (point.dist.name, point.dist.version) if point.dist else (_UNKNOWN, "")
            )
            found.origins[point.name] = Origin(package, version, point.module)
    return found


def _origin(point: EntryPoint) -> str:
    return f"package {point.dist.name}" if point.dist else _UNKNOWN


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


# --- The dialects there are, and which one a file is of.


_BUILTIN: tuple[Reader, ...] = (
    RigDialect(),
    AtiNetftReader(),
    AtiDaqReader(),
    RostopicReader(),
    RosBagReader(),
    TdmsReader(),
    LvmReader(),
    InstronReader(),
    XlsxReader(),
    ParquetReader(),
    DelimitedReader(),
)

DIALECTS: dict[str, Reader] = {dialect.name: dialect for dialect in _BUILTIN}
"""Those that come with the program."""


def dialects() -> dict[str, Reader]:
    """Return all readers: the program's own, then those of other packages.

    Returns by name. A package cannot take the name of one of the program's own.
    """
    others = plugins().readers
    return {**DIALECTS, **{name: others[name] for name in sorted(others) if name not in DIALECTS}}


def origins(names: Iterable[str]) -> dict[str, Origin]:
    """Say where those dialects are from that do not come with the program.

    Returns by dialect, sorted; without those that cannot be used.
    """
    # looking for other packages is slow, and most campaigns need none
    others = sorted(set(names) - DIALECTS.keys())
    found = plugins().origins if others else {}
    return {name: found[name] for name in others if name in found}


def faults() -> list[str]:
    """Say which dialects of other packages cannot be used, and why.

    Returns A sentence each.
    """
    taken = [
        f"the dialect {name} of {reader.origin} has the name of one of the program's own: it is "
        "not used; rename its entry point"
        for name, reader in sorted(plugins().readers.items())
        if name in DIALECTS
    ]
    return [*plugins().faults.values(), *taken]


def dialect(name: str) -> Reader:
    """Return the reader of that name."""
    if name in DIALECTS:
        return DIALECTS[name]
    known = dialects()
    if name in known:
        return known[name]
    if name in plugins().faults:
        raise InputError(plugins().faults[name])
    raise InputError(unknown_word("log dialect", name, sorted(known)))


def source_reader(source: AnyLog, default: str, key: str) -> Reader:
    """Return the reader that a section of the config asks for.

    `default`: Dialect of the campaign. `key`: Of the section, for the message.
    """
    if source.text is not None:
        reader: Reader = DelimitedReader().described(source.text)
    else:
        reader = dialect(source.dialect or default)
    if source.options:
        try:
            reader = reader.with_options(source.options)
        except ValueError as error:
            raise InputError(f"config, {key}.options: {error}") from None
    return reader


def head_of(path: Path) -> bytes:
    """Read the beginning of a file.

    Returns the first 64 kB.
    """
    try:
        with path.open("rb") as handle:
            return handle.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}") from error


def claimants(head: bytes) -> list[Reader]:
    """Return every reader that knows a file.

    `head`: The first 64 kB of it. Returns the program's own first; the first one reads it.
    """
    return [reader for reader in dialects().values() if reader.detect(head)]


def detect(path: Path) -> Reader | None:
    """Tell from its content which dialect a file is of.

    Returns none when no reader knows it.
    """
    head = head_of(path)
    own = next((reader for reader in DIALECTS.values() if reader.detect(head)), None)
    return own or next((reader for reader in dialects().values() if reader.detect(head)), None)
