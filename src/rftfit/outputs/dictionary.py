"""The dictionary of outputs: the toml files beside this module, read and checked.

Nothing in the chain reads it, so that a better wording makes no result out of date. The documentation
is generated from it, and tests hold it against the files of real runs, in both directions.
"""

from __future__ import annotations

import itertools
import re
import tomllib
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from rftfit.campaign.columns import COLUMNS
from rftfit.errors import InputError

PARTS = ("measure", "profile", "predict", "robot", "run", "commands")
"""The toml files, in the order of the data's way."""

KINDS = ("text", "yes or no", "count", "number", "list", "object")
"""What a column, or a key of a json file, can hold."""

_BRACES = re.compile(r"\{([^{}]*)\}")
_ANY = re.compile(r"<[^<>]+>")


@dataclass(frozen=True)
class Column:
    """One column, or a few that differ by a word of their name only.

    `name`: ``{a,b}`` stands for either word, ``<x>`` for any.
    `kind`: One of `KINDS`.
    `quantity`, `meaning`: In Markdown.
    `unit`: Empty for text and for what has none. ``as ...`` where another column decides.
    `when`: Under which condition it is there; empty: always.
    """

    name: str
    kind: str
    quantity: str
    meaning: str
    unit: str = ""
    when: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """The names it stands for, braces written out."""
        return alternatives(self.name)


@dataclass(frozen=True)
class Output:
    """One file, or one for each medium and the like.

    `file`: Path from the campaign's folder, with ``<x>`` for any word and ``{a,b}`` for either.
    `stage`: What writes it.
    `about`: In Markdown.
    `when`: Under which condition it is written; empty: always.
    `row`: What a row stands for; empty for files that are no tables.
    `part`: Which of `PARTS` describes it.
    """

    file: str
    stage: str
    about: str
    when: str = ""
    row: str = ""
    columns: tuple[Column, ...] = ()
    part: str = ""

    @cached_property
    def exact(self) -> dict[str, Column]:
        """Columns by each of their names; those with ``<x>`` by that pattern."""
        return {name: one for one in self.columns for name in one.names}

    def matches(self, path: str) -> bool:
        """Whether this describes a file; `path`: from the campaign's folder, with slashes."""
        # <path> may hold slashes, every other word is one part of the path
        return any(_regex(name).fullmatch(path) for name in alternatives(self.file))


@cache
def alternatives(pattern: str) -> tuple[str, ...]:
    """Write out the braces of a pattern as ``alpha_{z,x}_{lo,hi}``; the first brace varies slowest."""
    parts = _BRACES.split(pattern)
    words = [part.split(",") if place % 2 else [part] for place, part in enumerate(parts)]
    return tuple("".join(choice) for choice in itertools.product(*words))


@cache
def _regex(pattern: str) -> re.Pattern[str]:
    fixed, words = _ANY.split(pattern), _ANY.findall(pattern)
    regex = re.escape(fixed[0])
    for word, rest in zip(words, fixed[1:], strict=True):
        regex += {"<path>": ".+", "<number>": "[0-9]+"}.get(word, "[^/]+") + re.escape(rest)
    return re.compile(regex)


@cache
def outputs() -> tuple[Output, ...]:
    """Read the dictionary: of each part its tables, then its other files."""
    common = {entry["name"]: Column(**entry) for entry in _read("common")["column"]}
    found: list[Output] = []
    models: dict[str, str] = {}
    for part in PARTS:
        data = _read(part)
        for entry in data.get("table", []):
            if "like" in entry:
                models[entry["file"]] = entry.pop("like")
            found.append(_table(part, entry, common))
        found += [Output(**entry, part=part) for entry in data.get("file", [])]
    columns = {one.file: one.columns for one in found}
    if lost := set(models.values()) - set(columns):
        raise InputError(f"outputs: no table {', '.join(sorted(lost))} to be like")
    return tuple(
        replace(one, columns=columns[models[one.file]]) if one.file in models else one
        for one in found
    )


def _table(part: str, entry: dict[str, Any], common: dict[str, Column]) -> Output:
    given = entry.pop("columns", [])
    try:
        if given == "run sheet":
            return Output(**entry, columns=_sheet_columns(), part=part)
        columns = (common[one] if isinstance(one, str) else Column(**one) for one in given)
        return Output(**entry, columns=tuple(columns), part=part)
    except (KeyError, TypeError) as error:
        raise InputError(f"outputs/{part}.toml: {entry.get('file')}: {error}") from error


def _sheet_columns() -> tuple[Column, ...]:
    """Columns of the run sheet, from the definition that also reads it."""
    kinds = {"number": "number"}
    # a note changes no result, so the record leaves it out
    return tuple(
        Column(one.name, kinds.get(one.form, "text"), "as in the run sheet", one.meaning, one.unit)
        for one in COLUMNS
        if one.name != "note"
    )


def _read(part: str) -> dict[str, Any]:
    path = Path(__file__).with_name(f"{part}.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


@cache
def describe(path: str) -> Output | None:
    """Find what is known of a file; where several entries fit, the one that leaves least open."""
    fitting = [one for one in outputs() if one.matches(path)]
    return max(fitting, key=lambda one: len(_ANY.sub("", one.file)), default=None)


def column_of(output: Output, name: str) -> Column | None:
    """Find what is known of a column; where several entries fit, the one that leaves least open."""
    if (exact := output.exact.get(name)) is not None:
        return exact
    fitting = [one for one in output.columns if any(_regex(p).fullmatch(name) for p in one.names)]
    return max(fitting, key=lambda one: len(_ANY.sub("", one.name)), default=None)
