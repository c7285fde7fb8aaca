"""The tables of a run as a Frictionless data package: paths, digests, and each column with unit and meaning.

A data package is a file of metadata beside published tables (``datapackage.json``), which other programs can read.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from rftfit.campaign.config import Publishing
from rftfit.outputs.dictionary import Output, OutputColumn, column_of, describe_file

PROFILE = "https://datapackage.org/profiles/2.0/datapackage.json"
"""Address of the standard that `package_text` follows."""

_TYPES = {"text": "string", "yes or no": "boolean", "count": "integer", "number": "number"}
"""Type of a column in the standard, by its kind in the dictionary of results."""


@dataclass(frozen=True)
class ResultFile:
    """One csv table of the results.

    `path`: Path from the campaign's folder. `sha256`, `size`: Digest and length (bytes) of its content. `columns`:
    Names.
    """

    path: str
    sha256: str
    size: int
    columns: tuple[str, ...]


_LICENSES = "https://spdx.org/licenses"
"""Address below which each licence has a page, by its SPDX name."""
_OF_LOGS = {"title": "logs of the campaign, with their SHA-256", "path": "manifest.sha256"}


def package_text(
    title: str, about: str, files: Iterable[ResultFile], publish: Publishing, origin: str = ""
) -> str:
    """Describe the csv tables of a run as ``datapackage.json``; the same files give the same text.

    `files`: Tables in any order; one that the dictionary of results does not know is left out. `title`, `about`: Title
    and description of the campaign. `publish`: What its config says about a publication. `origin`: Address of the
    results from which its logs were simulated; empty for recorded logs.
    """
    resources: list[dict[str, Any]] = []
    names: set[str] = set()
    for file in sorted(files, key=lambda file: file.path):
        if (output := describe_file(file.path)) is not None:
            resources.append(_describe_table(file, output, names))
    package = {
        "$schema": PROFILE,
        "name": "rftfit-results",
        "title": title,
        "description": about,
        **_describe_rights(publish, origin),
        "resources": resources,
    }
    return json.dumps(package, indent=1, ensure_ascii=False) + "\n"


def _describe_rights(publish: Publishing, origin: str) -> dict[str, Any]:
    """Describe version, licence, contributors and sources of the tables; a fact that is not stated is left out.

    `publish`, `origin`: As for `package_text`.
    """
    addresses = [address for address in (publish.source, origin) if address]
    sources = [_OF_LOGS, *({"title": address, "path": address} for address in addresses)]
    rights: dict[str, Any] = {"version": publish.version} if publish.version else {}
    if publish.license:
        path = f"{_LICENSES}/{publish.license}"
        rights["licenses"] = [{"name": publish.license, "path": path}]
    if publish.contributors:
        rights["contributors"] = [{"title": name} for name in publish.contributors]
    return rights | {"sources": sources}


def _describe_table(file: ResultFile, output: Output, names: set[str]) -> dict[str, Any]:
    """Describe one table: path, digest and columns.

    `output`: Its entry in the dictionary of results. `names`: Names that other tables of the package have, to which its
    own is added.
    """
    path = PurePosixPath(file.path).relative_to("results")
    fields = [_describe_column(name, column_of(output, name)) for name in file.columns]
    return {
        "name": _free_name(path, names),
        "type": "table",
        "path": path.as_posix(),
        "title": output.row,
        "description": output.about,
        "format": "csv",
        "mediatype": "text/csv",
        "encoding": "utf-8",
        "bytes": file.size,
        "hash": f"sha256:{file.sha256}",
        "schema": {"fields": fields, "missingValues": [""]},
    }


def _free_name(path: PurePosixPath, names: set[str]) -> str:
    """Return a new name of small letters for a file, with a number where needed: two media may differ by case alone.

    The standard allows only small letters. `names`: Names that are taken, to which the new one is added.
    """
    base = re.sub(r"[^a-z0-9._-]+", "-", path.with_suffix("").as_posix().lower())
    name = base
    number = 1
    while name in names:
        number += 1
        name = f"{base}-{number}"
    names.add(name)
    return name


def _describe_column(name: str, column: OutputColumn | None) -> dict[str, Any]:
    """Describe a column: type, unit and meaning; `column`: its entry in the dictionary, without which its type is any."""
    if column is None:
        return {"name": name, "type": "any"}
    field: dict[str, Any] = {
        "name": name,
        "type": _TYPES.get(column.kind, "any"),
        "title": column.quantity,
        "description": column.meaning,
    }
    if column.kind == "yes or no":
        field |= {"trueValues": ["True"], "falseValues": ["False"]}
    if column.unit:
        field["unit"] = column.unit
    return field
