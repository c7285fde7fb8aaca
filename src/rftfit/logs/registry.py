"""Registry of all dialects, also those of other packages; finds the dialect of a file.

A *dialect* is the format of one program, and has a `Reader`. A file is in the first dialect, in the order of
`_BUILTIN`, whose reader detects it in its first 64 kB (the *head*). Other packages add dialects by entry points of the
group `GROUP`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, NamedTuple, Self

from rftfit.campaign.config import AnyLog
from rftfit.campaign.problems import unknown_word
from rftfit.errors import InputError
from rftfit.logs.arrays import ArraysReader
from rftfit.logs.ati import AtiDaqReader, AtiNetftReader
from rftfit.logs.base import HEAD_BYTES, Log, LogError, Reader
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.instron import InstronReader
from rftfit.logs.labview import LvmReader
from rftfit.logs.presets import presets
from rftfit.logs.rosbag import RosBagReader
from rftfit.logs.rostopic import RostopicReader
from rftfit.logs.tabular import ParquetReader, XlsxReader
from rftfit.logs.tdms import TdmsReader
from rftfit.logs.text import opened, unpacking_errors

GROUP = "rftfit.dialects"
"""Group of entry points by which other packages add dialects."""

_BUILTIN: tuple[Reader, ...] = (
    *presets(),
    AtiNetftReader(),
    AtiDaqReader(),
    RostopicReader(),
    RosBagReader(),
    TdmsReader(),
    LvmReader(),
    InstronReader(),
    XlsxReader(),
    ParquetReader(),
    ArraysReader(),
    DelimitedReader(),
)

DIALECTS: dict[str, Reader] = {dialect.name: dialect for dialect in _BUILTIN}
"""Dialects of the program itself: name to reader."""


def dialects() -> dict[str, Reader]:
    """Return all readers by name: the program's own, then those of other packages under other names."""
    return DIALECTS | {
        name: reader for name, reader in sorted(plugins().readers.items()) if name not in DIALECTS
    }


def dialect(name: str) -> Reader:
    """Return the reader of the dialect `name`; raises InputError if there is none."""
    # looking for other packages is slow, and most campaigns need none
    readers = DIALECTS if name in DIALECTS else dialects()
    if name in readers:
        return readers[name]
    if name in plugins().faults:
        raise InputError(plugins().faults[name])
    raise InputError(unknown_word("log dialect", name, sorted(readers)))


def source_reader(source: AnyLog, default: str, key: str) -> Reader:
    """Return the reader for the section ``force_log`` or ``motion_log`` of the config.

    `source`: The section, whose name is `key`. `default`: Dialect of the campaign, for a section without one. Raises
    InputError if the dialect is unknown, or does not support what the section asks of it.
    """
    if source.text is not None:
        reader: Reader = DelimitedReader(source.text)
    else:
        reader = dialect(source.dialect or default)
    try:
        reader = reader.with_options(source.options)
    except ValueError as error:
        raise InputError(f"config, {key}.options: {error}") from None
    try:
        return reader.of_source(source.where_words)
    except ValueError as error:
        raise InputError(f"config, {key}.where: {error}") from None


def read_head(path: Path) -> bytes:
    """Read the first 64 kB of a file, unpacked if it is packed by gzip; raises InputError if that fails."""
    try:
        with unpacking_errors(path), opened(path) as handle:
            return handle.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}") from error


def claimants(head: bytes) -> list[Reader]:
    """Return every reader whose dialect fits the first 64 kB of a file; the first of these readers is used."""
    return [reader for reader in dialects().values() if reader.detect(head)]


def load_each(requests: Sequence[tuple[Reader, Path]]) -> list[Log | LogError]:
    """Read many files, each by its reader; return a log, or the error that refuses it, in the order of the requests."""
    logs: list[Log | LogError] = []
    for reader, path in requests:
        try:
            logs.append(reader.load(path))
        except LogError as error:
            # the traceback would keep the file open, and `logs` in memory
            error.__cause__ = error.__context__ = None
            logs.append(error.with_traceback(None))
    return logs


# --- Dialects of other packages: found by their entry points; an error in one does not stop the program


class DialectOrigin(NamedTuple):
    """Where a dialect is from: package, its version (empty if unknown), and the module of the entry point."""

    package: str
    version: str
    module: str


class Plugins(NamedTuple):
    """Dialects of other packages: name of an entry point, to its reader, or to the sentence why it cannot be used.

    A name may be in both: the first package that has it is used, and the second one is a fault.
    """

    readers: dict[str, PluginReader]
    faults: dict[str, str]


class PluginReader(Reader):
    """A reader of another package; any error inside becomes one readable error.

    `inner`: Object of the package with the methods ``describe``, ``detect`` and ``load`` or ``stream``.
    """

    def __init__(self, name: str, origin: DialectOrigin, inner: Any) -> None:
        self.name = name
        self.origin = origin
        self.evidence = str(getattr(inner, "evidence", "") or Reader.evidence)
        self._inner = inner

    def describe(self) -> str:
        """Return the description that the package gives, and the name of the package."""
        try:
            text = str(self._inner.describe())
        except Exception as error:  # noqa: BLE001  # foreign code may raise anything
            text = f"describe() failed: {_describe_error(error)}"
        return f"{text} (package {self.origin.package})"

    def detect(self, head: bytes) -> bool:
        """Return what ``detect`` of the package returns; False where it fails."""
        try:
            return bool(self._inner.detect(head))
        except Exception:  # noqa: BLE001  # foreign code may raise anything
            return False

    def with_options(self, options: Mapping[str, object]) -> Self:
        """Return a reader with the options of the config, passed on to the package."""
        if not options or not hasattr(self._inner, "with_options"):
            return super().with_options(options)
        return self._changed(_inner=self._inner.with_options(options))

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file through ``stream`` of the package, or through ``load`` as one block."""
        inner = self._inner
        try:
            # a class derived from `Reader` has both methods: the one that it defines counts
            whole = not hasattr(inner, "stream") or type(inner).__dict__.get("load") is not None
            for log in [inner.load(path)] if whole else inner.stream(path):
                if not isinstance(log, Log):
                    raise TypeError(f"load gave a {type(log).__name__}, not a rftfit.logs.base.Log")
                yield log
        except (LogError, GeneratorExit):
            raise
        except Exception as error:  # foreign code may raise anything
            text = f"{path}: the dialect {self.name} of package {self.origin.package} failed: {_describe_error(error)}"
            raise LogError("plugin", f"{text}; tell its author") from error


@cache
def plugins() -> Plugins:
    """Find the dialects of other packages; once, as the search is slow. Callers must not change the result."""
    from importlib.metadata import entry_points

    plugin_set = Plugins({}, {})
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, _package_of(p))):
        name, package = point.name, _package_of(point)
        if name in plugin_set.readers:
            plugin_set.faults[name] = (
                f"the dialect {name} is in package {plugin_set.readers[name].origin.package} and in package {package}; the first "
                "is used: uninstall one of them"
            )
            continue
        try:
            inner = _load_plugin(point)
        except Exception as error:  # noqa: BLE001  # foreign code may raise anything
            plugin_set.faults[name] = (
                f"the dialect {name} of package {package} ({point.value}) cannot be loaded: "
                f"{_describe_error(error)}; other dialects are not affected"
            )
            continue
        version = point.dist.version if point.dist else ""
        plugin_set.readers[name] = PluginReader(
            name, DialectOrigin(package, version, point.module), inner
        )
    return plugin_set


def _load_plugin(point: EntryPoint) -> Any:
    """Load the reader of an entry point, a class or an object; raises TypeError if it lacks a method."""
    loaded = point.load()
    inner = loaded() if isinstance(loaded, type) else loaded

    def lacks(method: str) -> bool:
        """Return whether the object has no such method."""
        return not callable(getattr(inner, method, None))

    missing = [method for method in ("describe", "detect") if lacks(method)]
    if lacks("load") and lacks("stream"):
        missing.append("load")
    if missing:
        raise TypeError(f"it has no {', '.join(missing)}")
    return inner


def origins(names: Iterable[str]) -> dict[str, DialectOrigin]:
    """Return name, to origin, of those of the dialects `names` that another package adds, sorted by name."""
    foreign_names = sorted(set(names) - DIALECTS.keys())
    readers = plugins().readers if foreign_names else {}
    return {name: readers[name].origin for name in foreign_names if name in readers}


def faults() -> list[str]:
    """Return a sentence for each dialect of another package that cannot be used."""
    taken = [
        f"the dialect {name} of package {reader.origin.package} has the name of one of the program's own: it is "
        "not used; rename its entry point"
        for name, reader in sorted(plugins().readers.items())
        if name in DIALECTS
    ]
    return [*plugins().faults.values(), *taken]


def _package_of(point: EntryPoint) -> str:
    """Return the name of the package of an entry point."""
    return point.dist.name if point.dist else "unknown"


def _describe_error(error: Exception) -> str:
    """Return type and text of an error of foreign code, for messages."""
    return f"{type(error).__name__}: {error}"
