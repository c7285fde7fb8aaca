"""Dialects of other packages: found by their entry points, and kept from breaking anything."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rftfit.logs.base import Log, LogError, Reader

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from importlib.metadata import EntryPoint
    from pathlib import Path

GROUP = "rftfit.dialects"
_NEEDED = ("describe", "detect")
_UNKNOWN = "an unknown package"


class Origin(NamedTuple):
    """Where a dialect is from.

    Attributes
    ----------
    package : str
        As it was installed; "an unknown package" where nobody says.
    version : str
        Of the package; empty where nobody says.
    module : str
        That the entry point names.
    """

    package: str
    version: str
    module: str


class Plugins(NamedTuple):
    """What was found.

    Attributes
    ----------
    readers : dict of str to PluginReader
        By the name of the entry point.
    faults : dict of str to str
        The same of those that cannot be used, and why.
    origins : dict of str to Origin
        Of the readers.
    """

    readers: dict[str, PluginReader]
    faults: dict[str, str]
    origins: dict[str, Origin]


class PluginReader(Reader):
    """A reader of another package; whatever goes wrong inside becomes one readable error.

    Parameters
    ----------
    name : str
        Of the entry point.
    origin : str
        The package, for messages.
    inner : object
        With ``describe``, ``detect`` and ``load`` or ``stream``.
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
        """Ask the package; a reader that fails knows nothing.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
        """
        try:
            return bool(self._inner.detect(head))
        except Exception:  # noqa: BLE001  # foreign code may raise anything
            return False

    def with_options(self, options: Mapping[str, object]) -> Reader:
        """Hand the options of the config on.

        Parameters
        ----------
        options : mapping of str to object

        Returns
        -------
        Reader

        Raises
        ------
        ValueError
            If the dialect takes no options, or not these.
        """
        if not options or not hasattr(self._inner, "with_options"):
            return super().with_options(options)
        return PluginReader(self.name, self.origin, self._inner.with_options(options))

    def stream(self, path: Path) -> Iterator[Log]:
        """Read a file in the package's blocks, or as one.

        Parameters
        ----------
        path : Path

        Yields
        ------
        Log

        Raises
        ------
        LogError
            If the file cannot be used, or the package fails.
        """
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
    """Find the dialects of other packages, once.

    Returns
    -------
    Plugins
    """
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
