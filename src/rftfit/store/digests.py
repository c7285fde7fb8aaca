"""Digests of files, of code and of settings: what a result was made from."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import stat
import time
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.errors import InputError, OutputError
from rftfit.store.files import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


# --- SHA-256 of files: of all logs on every run, which is cheap where nothing has changed.


_HEADING = "rftfit logs seen 1"
_SETTLED_NS = 2_000_000_000

State = tuple[int, int, int, int]


def sha256_of(path: str | Path) -> str:
    """Digest of the content of a file."""
    with open(path, "rb") as handle:  # noqa: PTH123 (a hot path: thousands of files)
        return hashlib.file_digest(handle, "sha256").hexdigest()


class Seen:
    """Digests of files, remembered with what a file system says about them.

    A file is read again only where its size, its times (of content and of inode, so that a date put
    back does not deceive) or its inode differ from those it was read with. They are remembered from
    run to run in the file `memory`, which may be deleted at any time; None: in no file.
    """

    def __init__(self, memory: Path | None) -> None:
        self._memory = memory
        self._known = {} if memory is None else _recall(memory)
        self._changed = False

    def digests(self, paths: Iterable[str]) -> dict[str, str]:
        """SHA-256 by absolute path; empty of what is no regular file (never opened) or cannot be read."""
        found: dict[str, str] = {}
        # one after the other: threads were twice as slow on files of 50 kB
        for path in paths:
            state = _state(path)
            if state is None:
                found[path] = ""
            elif path in self._known and self._known[path][0] == state:
                found[path] = self._known[path][1]
            else:
                found[path] = self._read(path, state)
        return found

    def _read(self, path: str, state: State) -> str:
        try:
            digest = sha256_of(path)
        except OSError:
            return ""
        _, modified, changed, _ = state
        # a clock may tick too slowly to tell a change right after reading from none
        settled = max(modified, changed) < time.time_ns() - _SETTLED_NS
        if settled and _state(path) == state:
            self._known[path] = (state, digest)
            self._changed = True
        return digest

    def save(self) -> None:
        """Remember for the next run, where there is a folder to do so; failing is no error."""
        if self._memory is None or not self._changed or not self._memory.parent.parent.is_dir():
            return
        known = sorted(self._known.items())
        rows = ["\t".join((digest, *map(str, state), path)) for path, (state, digest) in known]
        with contextlib.suppress(OutputError):
            # a path may hold bytes that are no text
            data = "\n".join([_HEADING, *rows, ""]).encode("utf-8", "surrogateescape")
            write_bytes(self._memory, data)
            self._changed = False


def _state(path: str) -> State | None:
    try:
        found = os.stat(path)  # noqa: PTH116
    except (OSError, ValueError):
        return None
    if not stat.S_ISREG(found.st_mode):
        return None
    return (found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino)


def _recall(memory: Path) -> dict[str, tuple[State, str]]:
    known: dict[str, tuple[State, str]] = {}
    try:
        heading, *lines = os.fsdecode(memory.read_bytes()).split("\n")
        if heading != _HEADING:
            return {}
        for line in lines[:-1]:
            digest, size, modified, changed, inode, path = line.split("\t", 5)
            known[path] = ((int(size), int(modified), int(changed), int(inode)), digest)
    except (OSError, ValueError):
        return {}
    return known


def sums_text(digests: Mapping[str, str]) -> str:
    """Digests by path, in the form that ``sha256sum --check`` reads; files without one are left out."""
    return "".join(f"{digests[path]}  {path}\n" for path in sorted(digests) if digests[path])


def read_sums(source: str | Path) -> dict[str, str]:
    """Read digests as `sums_text` writes them."""
    try:
        lines = Path(source).read_text(encoding="utf-8").splitlines()
        return {path: digest for digest, path in (line.split("  ", 1) for line in lines)}
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read as a list of digests: {error}") from error


# --- Digests that let the workflow see what it does not watch itself: code, settings, run sheet.


_LENGTH = 16
# imports may be indented, and go on over lines in brackets. A syntax tree would say the same (a test
# compares them) but takes a second for all modules, and this is asked on every run
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n(]+)|import[ \t]+([^\n]+))",
    re.MULTILINE,
)
_NAME = re.compile(r"[\w.]+")
_READS = {"rftfit.robot.config": "config/robot.yaml"}
"""Files of the program that modules read from outside the package: they count as their source."""

_DATA = (".csv", ".mplstyle", ".html", ".css", ".js")


def digest_of(*values: object) -> str:
    """Digest of values that JSON can write, or that can say what they are."""
    text = json.dumps(values, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def code_digest(*modules: str) -> str:
    """Digest of the source of modules of this package and of all they import from it.

    Imports inside functions count. Data files beside an imported package (the published tables,
    the figures' style, the page's template and script) count as its source.
    """
    total = hashlib.sha256()
    for name in closure(*modules):
        total.update(name.encode())
        total.update(_source_digest(name))
    return total.hexdigest()[:_LENGTH]


@cache
def closure(*modules: str) -> tuple[str, ...]:
    """Modules of this package and all they import from it, sorted."""
    seen: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += [other for other in _imports(name) if other not in seen]
    # a module of another package may be gone by now
    return tuple(sorted(name for name in seen if _path(name) is not None))


def module_digests(*modules: str) -> dict[str, str]:
    """Digest of each module that `code_digest` looks at."""
    return {name: _source_digest(name).hex()[:_LENGTH] for name in closure(*modules)}


def _tops() -> tuple[Path, Path]:
    """Where the workflow and the program's own config lie: in a checkout, or as installed."""
    package = Path(__file__).resolve().parents[1]
    return package.parents[1], package / "_workflow"


@cache
def _path(module: str) -> Path | None:
    """Source file of a module, found without importing it."""
    root = Path(__file__).resolve().parents[1]
    top, *parts = module.split(".")
    if top != root.name:
        try:
            spec = find_spec(module)
        except (ImportError, ValueError):
            return None
        return Path(spec.origin) if spec and spec.origin and spec.has_location else None
    path = root.joinpath(*parts)
    files = (path / "__init__.py", path.with_suffix(".py"))
    return next((file for file in files if file.is_file()), None)


@cache
def _source_digest(module: str) -> bytes:
    path = _path(module)
    assert path is not None
    total = hashlib.sha256(path.read_bytes())
    if path.name == "__init__.py":
        for other in sorted(path.parent.iterdir()):
            if other.is_file() and other.suffix in _DATA:
                total.update(other.read_bytes())
    for top in _tops() if module in _READS else ():
        if (top / _READS[module]).is_file():
            total.update((top / _READS[module]).read_bytes())
            break
    return total.digest()


@cache
def _imports(module: str) -> frozenset[str]:
    """Modules of this package that a module's source imports, with the packages around them."""
    path = _path(module)
    package = module.split(".", maxsplit=1)[0]
    # the package itself offers names of every room, and imports none of them
    if path is None or path.suffix != ".py" or module == package:
        return frozenset()
    names: set[str] = set()
    for home, chosen, whole in _IMPORT.findall(path.read_text(encoding="utf-8")):
        if whole:
            names.update(_NAME.findall(whole))
        else:
            names.add(home)
            # `from package import module` names a module, not a value
            names.update(f"{home}.{name}" for name in _NAME.findall(chosen))
    found: set[str] = set()
    for parts in (name.split(".") for name in names if name.partition(".")[0] == package):
        found.update(".".join(parts[:count]) for count in range(1, len(parts) + 1))
    return frozenset(name for name in found if _path(name) is not None)
