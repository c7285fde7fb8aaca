"""The dictionary of outputs: the toml files beside this module, read and checked.

Tables are read and made with the columns that it states. The documentation is generated from it, and tests hold it
against the files of real runs, in both directions.
"""

from __future__ import annotations

import itertools
import re
import tomllib
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, get_args

from rftfit.campaign.columns import COLUMNS
from rftfit.campaign.config import CheckName
from rftfit.errors import InputError

SECTIONS = ("measure", "profile", "predict", "robot", "run", "commands")
"""The toml files, in the order of the data's way."""

KINDS = ("text", "yes or no", "count", "number", "list", "object")
"""What a column, or a key of a json file, can hold."""

_BRACES = re.compile(r"\{([^{}]*)\}")
_ANY = re.compile(r"<[^<>]+>")


@dataclass(frozen=True)
class OutputColumn:
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
    `section`: Which of `SECTIONS` describes it.
    """

    file: str
    stage: str
    about: str
    when: str = ""
    row: str = ""
    columns: tuple[OutputColumn, ...] = ()
    section: str = ""

    @cached_property
    def exact(self) -> dict[str, OutputColumn]:
        """Columns by each of their names; those with ``<x>`` by that pattern."""
        return {name: column for column in self.columns for name in column.names}

    def matches(self, path: str) -> bool:
        """Whether this describes a file; `path`: from the campaign's folder, with slashes."""
        # <path> may hold slashes, every other word is one part of the path
        return any(_regex(name).fullmatch(path) for name in alternatives(self.file))


@cache
def alternatives(pattern: str) -> tuple[str, ...]:
    """Write out the braces of a pattern as ``alpha_{z,x}_{lo,hi}``; the first brace varies slowest."""
    texts = _BRACES.split(pattern)
    words = [text.split(",") if index % 2 else [text] for index, text in enumerate(texts)]
    return tuple("".join(choice) for choice in itertools.product(*words))


@cache
def _regex(pattern: str) -> re.Pattern[str]:
    fixed_texts, words = _ANY.split(pattern), _ANY.findall(pattern)
    regex = re.escape(fixed_texts[0])
    for word, fixed_text in zip(words, fixed_texts[1:], strict=True):
        regex += {"<path>": ".+", "<number>": "[0-9]+"}.get(word, "[^/]+") + re.escape(fixed_text)
    return re.compile(regex)


@cache
def outputs() -> tuple[Output, ...]:
    """Read the dictionary: of each section its tables, then its other files."""
    common = {entry["name"]: OutputColumn(**entry) for entry in _read("common")["column"]}
    all_outputs: list[Output] = []
    models: dict[str, str] = {}
    for section in SECTIONS:
        content = _read(section)
        for entry in content.get("table", []):
            if "like" in entry:
                models[entry["file"]] = entry.pop("like")
            all_outputs.append(_table(section, entry, common))
        all_outputs += [Output(**entry, section=section) for entry in content.get("file", [])]
    columns = {output.file: output.columns for output in all_outputs}
    if lost := set(models.values()) - set(columns):
        raise InputError(f"outputs: no table {', '.join(sorted(lost))} to be like")
    return tuple(
        replace(output, columns=columns[models[output.file]]) if output.file in models else output
        for output in all_outputs
    )


def _table(section: str, entry: dict[str, Any], common: dict[str, OutputColumn]) -> Output:
    stated_columns = entry.pop("columns", [])
    try:
        if stated_columns == "run sheet":
            return Output(**entry, columns=_sheet_columns(), section=section)
        columns = (
            common[column] if isinstance(column, str) else OutputColumn(**column)
            for column in stated_columns
        )
        return Output(**entry, columns=tuple(columns), section=section)
    except (KeyError, TypeError) as error:
        raise InputError(f"outputs/{section}.toml: {entry.get('file')}: {error}") from error


def _sheet_columns() -> tuple[OutputColumn, ...]:
    """Columns of the run sheet, from the definition that also reads it."""
    kind_of_form = {"number": "number"}
    # a note changes no result, so the record leaves it out
    return tuple(
        OutputColumn(
            column.name,
            kind_of_form.get(column.form, "text"),
            "as in the run sheet",
            column.meaning,
            column.unit,
        )
        for column in COLUMNS
        if column.name != "note"
    )


def _read(section: str) -> dict[str, Any]:
    dictionary = Path(__file__).with_name(f"{section}.toml").read_text(encoding="utf-8")
    names = ", ".join(f"`{name}`" for name in get_args(CheckName))
    return tomllib.loads(dictionary.replace("<names of checks>", names))


@cache
def describe_file(path: str) -> Output | None:
    """Find what is known of a file; where several entries fit, the one that leaves least open."""
    fitting = [output for output in outputs() if output.matches(path)]
    return max(fitting, key=lambda output: len(_ANY.sub("", output.file)), default=None)


def columns_of(name: str) -> list[str]:
    """List the columns of a table of the results, in its order; `name`: path below ``results/``."""
    output = describe_file(f"results/{name}")
    assert output is not None
    return [column for entry in output.columns for column in entry.names]


def column_of(output: Output, name: str) -> OutputColumn | None:
    """Find what is known of a column; where several entries fit, the one that leaves least open."""
    if (exact := output.exact.get(name)) is not None:
        return exact
    fitting = [
        column
        for column in output.columns
        if any(_regex(pattern).fullmatch(name) for pattern in column.names)
    ]
    return max(fitting, key=lambda column: len(_ANY.sub("", column.name)), default=None)
