"""Reads the dictionary of outputs, the toml files beside this module: each file of the results and its columns.

Tables are read and made with the columns that it states (`columns_of`). The documentation is generated from it, and
tests hold it against the files of real runs, in both directions.

A *pattern* names several files or columns at once: ``{a,b}`` stands for either word, ``<x>`` for any, as in
``results/alpha/<medium>.csv`` and ``alpha_{z,x}_N_per_cm3``. A *section* is one of the toml files; it lists tables,
which have columns, and other files.
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
"""Toml files of the dictionary, in the order in which data go through the program."""


_BRACES = re.compile(r"\{([^{}]*)\}")
"""Alternatives in a pattern, as ``{z,x}``."""
_ANY = re.compile(r"<[^<>]+>")
"""Placeholder in a pattern, as ``<medium>``."""


@dataclass(frozen=True)
class OutputColumn:
    """A column of an output, or several that differ by a word of their name only.

    `name`: A pattern.
    `kind`: What a cell, or the value of a key of a json file, is: text, yes or no, count, number, list, object.
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
        """Names of the columns, braces written out."""
        return alternatives(self.name)


@dataclass(frozen=True)
class Output:
    """A file that a run writes, or one for each medium and the like.

    `file`: Path from the campaign's folder, a pattern as the name of an `OutputColumn`.
    `stage`: What writes it.
    `about`: What it holds, in Markdown.
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
        """Return whether the pattern `file` fits a path from the campaign's folder, with slashes."""
        # <path> may hold slashes, every other word is one part of the path
        return any(_regex(name).fullmatch(path) for name in alternatives(self.file))


@cache
def alternatives(pattern: str) -> tuple[str, ...]:
    """Write out the braces of a pattern: ``{z,x}_{lo,hi}`` gives z_lo, z_hi, x_lo, x_hi."""
    # `split` returns fixed text and the content of braces in turn
    pieces = _BRACES.split(pattern)
    choices = [piece.split(",") if index % 2 else [piece] for index, piece in enumerate(pieces)]
    return tuple(map("".join, itertools.product(*choices)))


@cache
def _regex(pattern: str) -> re.Pattern[str]:
    """Return the regular expression of a pattern without braces, in which ``<x>`` stands for any word without a slash.

    Other than words: ``<path>`` for any text, ``<number>`` for digits.
    """
    regex = re.escape(pattern)
    for placeholder in _ANY.findall(pattern):
        any_word = {"<path>": ".+", "<number>": "[0-9]+"}.get(placeholder, "[^/]+")
        regex = regex.replace(re.escape(placeholder), any_word)
    return re.compile(regex)


@cache
def outputs() -> tuple[Output, ...]:
    """Read the dictionary: of each section its tables, then its other files; an entry for each.

    A table with ``like = "FILE"`` has the columns of that table.
    """
    common = {entry["name"]: OutputColumn(**entry) for entry in _read("common")["column"]}
    all_outputs: list[Output] = []
    # file of a table to the file of another table, whose columns it has too
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
        replace(output, columns=columns[models.get(output.file, output.file)])
        for output in all_outputs
    )


def _table(section: str, entry: dict[str, Any], common: dict[str, OutputColumn]) -> Output:
    """Make the output of an entry of a toml file.

    A column that several tables have is only named there, and described in `common`, by its name.
    """
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
    """Return the columns of the run sheet, from the definition by which it is read."""
    return tuple(
        OutputColumn(
            c.name,
            "number" if c.form == "number" else "text",
            "as in the run sheet",
            c.meaning,
            c.unit,
        )
        for c in COLUMNS
        if c.name != "note"  # a note changes no result, so the record leaves it out
    )


def _read(section: str) -> dict[str, Any]:
    """Read a toml file of the dictionary, with the names of the checks filled in."""
    dictionary = Path(__file__).with_name(f"{section}.toml").read_text(encoding="utf-8")
    names = ", ".join(f"`{name}`" for name in get_args(CheckName))
    return tomllib.loads(dictionary.replace("<names of checks>", names))


@cache
def describe_file(path: str) -> Output | None:
    """Return the entry that describes a file, of several the one with most fixed text; None without one.

    `path`: From the campaign's folder, with slashes.
    """
    fitting = [output for output in outputs() if output.matches(path)]
    return max(fitting, key=lambda output: len(_ANY.sub("", output.file)), default=None)


def columns_of(name: str) -> list[str]:
    """List the columns of a table of the results, in its order; `name`: path below ``results/``."""
    output = describe_file(f"results/{name}")
    assert output is not None
    return [column for entry in output.columns for column in entry.names]


def column_of(output: Output, name: str) -> OutputColumn | None:
    """Return the entry that describes the column `name`, of several the one with most fixed text; None without one."""
    if (exact := output.exact.get(name)) is not None:
        return exact
    fitting = [
        column
        for column in output.columns
        if any(_regex(pattern).fullmatch(name) for pattern in column.names)
    ]
    return max(fitting, key=lambda column: len(_ANY.sub("", column.name)), default=None)
