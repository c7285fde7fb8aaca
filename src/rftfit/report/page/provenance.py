"""Where a page comes from: versions of the software, digests of what it was made from."""

from __future__ import annotations

import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import rftfit

if TYPE_CHECKING:
    from collections.abc import Mapping

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "matplotlib", "pyarrow", "snakemake", "jinja2")
"""Libraries whose version may change a result or the page."""


@dataclass(frozen=True)
class Provenance:
    """Software and inputs of a run.

    Parameters
    ----------
    versions : mapping of str to str
        Version by name, the program first.
    code : str
        Digest of the program's source.
    digests : mapping of str to str
        Digest by what it is of: the settings, the rows of the run sheet. They do not depend on
        the order of rows, on comments or on line endings.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    code: str = ""
    digests: Mapping[str, str] = field(default_factory=dict)


def provenance_of(code: str, digests: Mapping[str, str]) -> Provenance:
    """Look up the versions in use.

    Parameters
    ----------
    code : str
    digests : mapping of str to str
        As in `Provenance`.

    Returns
    -------
    Provenance
        Without date and machine: the same inputs give the same page.
    """
    versions = {"rftfit": rftfit.__version__, "Python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return Provenance(versions, code, dict(digests))
