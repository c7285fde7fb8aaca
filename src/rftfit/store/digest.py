"""Digests that let the workflow see what it does not watch itself: code, settings, run sheet."""

from __future__ import annotations

import hashlib
import json
import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_LENGTH = 16
# imports may be indented, and go on over lines in brackets. A syntax tree would say the same (a test
# compares them) but takes a second for all modules, and this is asked on every run
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n(]+)|import[ \t]+([^\n]+))",
    re.MULTILINE,
)
_NAME = re.compile(r"[\w.]+")
_READS = {"rftfit.robot.configfile": "config/robot.yaml"}
"""Files of the program that modules read from outside the package: they count as their source."""

_DATA = (".csv", ".mplstyle", ".html", ".css", ".js")


def digest_of(*values: object) -> str:
    """Digest of values that JSON can write, or that can say what they are.

    Parameters
    ----------
    *values : object

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    text = json.dumps(values, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def code_digest(*modules: str) -> str:
    """Digest of the source of modules of this package and of all they import from it.

    Imports inside functions count. Data files beside an imported package (the published tables,
    the figures' style, the page's template and script) count as its source.

    Parameters
    ----------
    *modules : str
        For example ``rftfit.stages.ingest``.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    total = hashlib.sha256()
    for name in closure(*modules):
        total.update(name.encode())
        total.update(_source_digest(name))
    return total.hexdigest()[:_LENGTH]


def closure(*modules: str) -> list[str]:
    """List modules of this package and all they import from it.

    Parameters
    ----------
    *modules : str

    Returns
    -------
    list of str
        Sorted.
    """
    seen: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += [other for other in _imports(name) if other not in seen]
    # a module of another package may be gone by now
    return sorted(name for name in seen if _path(name) is not None)


def module_digests(*modules: str) -> dict[str, str]:
    """Digest of each module that `code_digest` looks at.

    Parameters
    ----------
    *modules : str

    Returns
    -------
    dict of str to str
        16 hexadecimal digits by module.
    """
    return {name: _source_digest(name).hex()[:_LENGTH] for name in closure(*modules)}


def workflow_digests() -> dict[str, str]:
    """Digest of each file of the workflow's rules.

    Returns
    -------
    dict of str to str
        16 hexadecimal digits by path from the Snakefile's folder: the top of a checkout, or
        ``_workflow`` inside the package where it was installed. Empty where there is no workflow.
    """
    for top in _tops():
        if (top / "Snakefile").is_file():
            files = [top / "Snakefile", *sorted(top.glob("workflow/rules/*.smk"))]
            return {
                file.relative_to(top).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()[:_LENGTH]
                for file in files
            }  # fmt: skip
    return {}


def _tops() -> tuple[Path, Path]:
    """Where the workflow and the program's own config lie: in a checkout, or as installed."""
    package = Path(__file__).resolve().parents[1]
    return package.parents[1], package / "_workflow"


@cache
def _path(module: str) -> Path | None:
    """Source file of a module, found without importing it."""
    root = Path(__file__).resolve().parents[1]
    path = root.joinpath(*module.split(".")[1:])
    if module.split(".", maxsplit=1)[0] != root.name:
        try:
            spec = find_spec(module)
        except (ImportError, ValueError):
            return None
        return Path(spec.origin) if spec and spec.origin and spec.has_location else None
    for candidate in (path / "__init__.py", path.with_suffix(".py")):
        if candidate.is_file():
            return candidate
    return None


@cache
def _source_digest(module: str) -> bytes:
    path = _path(module)
    assert path is not None
    total = hashlib.sha256(path.read_bytes())
    if path.name == "__init__.py":
        beside: Iterable[Path] = sorted(path.parent.iterdir())
        for other in beside:
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
    if path is None or path.suffix != ".py":
        return frozenset()
    package = module.split(".", maxsplit=1)[0]
    names: set[str] = set()
    for home, chosen, whole in _IMPORT.findall(path.read_text(encoding="utf-8")):
        if whole:
            names.update(_NAME.findall(whole))
        else:
            names.add(home)
            # `from package import module` names a module, not a value
            names.update(f"{home}.{name}" for name in _NAME.findall(chosen))
    found: set[str] = set()
    for name in names:
        parts = name.split(".")
        if parts[0] != package:
            continue
        around = [".".join(parts[:count]) for count in range(1, len(parts) + 1)]
        found.update(part for part in around if _path(part) is not None)
    return frozenset(found)
