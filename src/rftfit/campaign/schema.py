"""Describes each key of a model in words: for messages, the JSON schema and the generated reference page.

The models of `rftfit.campaign.config` and the columns of the run sheet are the source. A *node* is a part of a JSON
schema: the description of a section or of one value. A section that can have several models, as an intruder is a plate
or a leg, says by its *tag*, the key ``shape``, which one it has.
"""

from __future__ import annotations

import ast
import inspect
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from rftfit.campaign.columns import COLUMNS, DIRECTIONS, KINDS, SheetColumn
from rftfit.campaign.config import Config, Model
from rftfit.errors import RftfitError
from rftfit.store import write_text

KeyPath = tuple[str | int, ...]
"""Keys, and indices of entries of lists, that lead to a value in a file."""
TAG = "shape"
"""Key whose value says which of several models a section has."""

NAME, NUMBER = "<name>", "<number>"
"""Steps in the path of a key that stand for a name that the user chooses, and for an entry of a list."""

_UNITS = (
    ("_N_per_min", "N/min"),
    ("_cm_per_s", "cm/s"),
    ("_rad_per_s", "rad/s"),
    ("_cm", "cm"),
    ("_mm", "mm"),
    ("_deg", "degrees"),
    ("_N", "N"),
    ("_Hz", "Hz"),
    ("_s", "s"),
)
"""End of the name of a key, to its unit; the first that fits counts."""
_PATTERNS = {
    "^[+-]F[123]$": "one of +F1, -F1, +F2, -F2, +F3, -F3 (in quotes)",
    "^[A-Za-z0-9][A-Za-z0-9._-]*$": "letters A-Z a-z, digits, and . _ -, at most 64",
}
"""Regular expression of a text, to the words for it."""
_TYPES = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
}


@dataclass(frozen=True)
class Key:
    """One key of a model, described in words.

    `path`: Its steps are `NAME` or `NUMBER` where the user chooses. `tag`: Tag of the sections that have the key;
    empty: all have it. `type`, `unit`, `allowed`: Words. `default`: ``required`` where there is none. `description`:
    One sentence, for messages and tables. `more`: What the reference page adds, with an example.
    """

    path: tuple[str, ...]
    tag: str
    type: str
    unit: str
    default: str
    allowed: str
    description: str
    more: str = ""

    @property
    def name(self) -> str:
        """Last step of its path."""
        return self.path[-1]

    def fits(self, path: KeyPath) -> bool:
        """Return whether a path in a file leads to this key."""
        return len(path) == len(self.path) and all(
            pattern in (name, NUMBER if isinstance(name, int) else NAME)
            for pattern, name in zip(self.path, path, strict=True)
        )


@cache
def schema(model: type[BaseModel] = Config) -> dict[str, Any]:
    """Return the JSON schema of a model, in which the text below a key in its class describes the key.

    The result is cached, as it is slow to make: callers must not change it.
    """
    page = model.model_json_schema()
    module = sys.modules[model.__module__]
    # by the name of its class, the node of the whole and those of its sections
    for name, section in {model.__name__: page, **page.get("$defs", {})}.items():
        classes = [cls for cls in getattr(module, name).__mro__ if issubclass(cls, Model)]
        # a class describes its keys anew where its base describes them, too
        for cls in reversed(classes):
            for key, description in _descriptions(cls.__module__).get(cls.__name__, {}).items():
                section["properties"][key]["description"] = description
    return page


@cache
def _descriptions(module: str) -> dict[str, dict[str, str]]:
    """Return the text below each key in the source of a module with models: name of the class, to key, to text.

    pydantic can read these texts, too, but would do so at every start of the program.
    """
    statements = ast.parse(inspect.getsource(sys.modules[module])).body
    return {
        cls.name: {
            ast.unparse(key.target): inspect.cleandoc(ast.literal_eval(text.value))
            for key, text in pairwise(cls.body)
            if isinstance(key, ast.AnnAssign) and isinstance(text, ast.Expr)
        }
        for cls in statements
        if isinstance(cls, ast.ClassDef)
    }


@cache
def all_keys(model: type[BaseModel] = Config) -> tuple[Key, ...]:
    """Return every key of a model, in the order of the model."""
    return tuple(_walk_keys(schema(model), (), schema(model).get("$defs", {})))


def keys_at(model: type[BaseModel], parent: KeyPath, tag: str = "") -> list[Key]:
    """Return the keys that the section at a path can have; `tag`: of the section; empty: unknown, so those of all."""
    keys = [key for key in all_keys(model) if key.fits((*parent, key.name))]
    return [key for key in keys if not (tag and key.tag and key.tag != tag)]


def tags_of(model: type[BaseModel], section: KeyPath) -> list[str]:
    """Return the values that the tag of the section at a path can have."""
    return list(dict.fromkeys(key.tag for key in keys_at(model, section)))


def _walk_keys(
    node: dict[str, Any], path: tuple[str, ...], defs: dict[str, Any], tag: str = ""
) -> Iterator[Key]:
    """Yield each key below a node of the JSON schema, a section before its own keys.

    `path`, `tag`: Those of the section that the node describes, as in `Key`. `defs`: Name, to a node to which other
    nodes refer.
    """
    for name, field in node.get("properties", {}).items():
        target = _resolve(field, defs)
        key_path = (*path, name)
        yield Key(
            key_path,
            tag,
            _describe_type(target),
            next((unit for end, unit in _UNITS if name.endswith(end)), ""),
            "required" if name in node.get("required", ()) else _describe_default(field),
            _describe_allowed(target),
            *_short_and_more(field.get("description", "")),
        )
        yield from _walk_keys(target, key_path, defs)
        if "items" in target:
            yield from _walk_keys(_resolve(target["items"], defs), (*key_path, NUMBER), defs)
        # a section in which the user chooses the names, each of a section of its own, of one or several kinds
        patterns = target.get("patternProperties", {}).values()
        inner = target.get("additionalProperties") or next(iter(patterns), None)
        if isinstance(inner, dict):
            for variant in inner.get("oneOf", [inner]):
                section = _resolve(variant, defs)
                tag_of_section = section.get("properties", {}).get(TAG, {}).get("const", "")
                yield from _walk_keys(section, (*key_path, NAME), defs, tag_of_section)


def _short_and_more(text: str) -> tuple[str, str]:
    """Return the first paragraph of a text, and all others together, both as a single line."""
    short, _, details = text.partition("\n\n")
    return " ".join(short.split()), " ".join(details.split())


def _resolve(node: dict[str, Any], defs: dict[str, Any]) -> dict[str, Any]:
    """Return the node to which a node refers; of several types the first that is not null, marked if null is allowed.

    `defs`: As in `_walk_keys`. The mark, ``nullable``, is no word of JSON schema: `_describe_allowed` reads it.
    """
    if "$ref" in node:
        target: dict[str, Any] = defs[node["$ref"].rsplit("/", 1)[1]]
        return target
    for option in node.get("anyOf", ()):
        if option.get("type") != "null":
            nullable = any(option.get("type") == "null" for option in node["anyOf"])
            return {**_resolve(option, defs), "nullable": nullable}
    return node


def _describe_type(node: dict[str, Any]) -> str:
    """Return the words for the type of a node, such as "list of 3 numbers"."""
    if node.get("type") == "array":
        items = _items(node)
        count = f"{len(items)} " if "prefixItems" in node else ""
        return f"list of {count}{_describe_types(items[0])}"
    return _TYPES.get(node.get("type", ""), "section")


def _items(node: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the nodes of the entries of a list: one for each entry, or a single one for all; null is left out."""
    items = node.get("prefixItems") or [node["items"]]
    return [
        _resolve(item_schema, {}) if "anyOf" in item_schema else item_schema
        for item_schema in items
    ]


def _describe_types(node: dict[str, Any]) -> str:
    """Return the words for the type of a node in the plural."""
    kind = _describe_type(node)
    return f"lists{kind[4:]}" if kind.startswith("list") else f"{kind}s"


def _describe_default(field: dict[str, Any]) -> str:
    """Return the words for the default of a key; `field`: its node, before it is resolved."""
    value = field.get("default")
    # the keys of a section have defaults of their own
    if "$ref" in field or isinstance(value, dict):
        return "see below"
    if value in (None, ""):
        return "none"
    return ", ".join(f"{number:g}" for number in value) if isinstance(value, list) else str(value)


_LIMITS = {
    "exclusiveMinimum": "above",
    "minimum": "at least",
    "exclusiveMaximum": "below",
    "maximum": "at most",
}
"""Word of JSON schema for a limit, to ours."""


def _describe_allowed(node: dict[str, Any]) -> str:
    """Return the words on what a value may be: ``a number above 0 and at most 1e+06``."""
    if "const" in node:
        return str(node["const"])
    if "enum" in node:
        return "one of " + ", ".join(map(str, node["enum"]))
    if "pattern" in node:
        return _PATTERNS[node["pattern"]]
    if node.get("type") == "array":
        items, what = _items(node), _describe_types(_items(node)[0])
        count = f"{len(items)} {what}" if "prefixItems" in node else f"one or more {what}"
        return f"{count} in [ ], each {_describe_allowed(items[0])}"
    kind = _describe_type(node)
    text = kind if kind in ("text", "true or false") else f"a {kind}"
    text += " with keys of its own" if kind == "section" else ""
    limits = [f"{words} {node[name]:.12g}" for name, words in _LIMITS.items() if name in node]
    text = " ".join([text, " and ".join(limits)]).strip()
    return text + (" or nothing" if node.get("nullable") else "")


# --- The reference page: words around its two tables


_INTRO = """\
# Configuration and run sheet

This page is generated from the program's own models by `python -m rftfit.campaign.schema`; do not
edit it. `rftfit check` says what is wrong with an edited file: file, row, column, what was found,
what is allowed and the nearest valid word, all problems at once.

## `config.yaml`

All paths are relative to the campaign's folder: the one above `config/`, or the folder of
`config.yaml` itself where that is not named `config`. They use `/` and stay inside that folder.
`<name>` is a name that you choose, of letters A-Z a-z, digits, and `. _ -`; the run sheet uses it.
Keys given twice, anchors (`&`), aliases (`*`) and tags (`!`) are refused.
"""

_SHEET = """\
## Run sheet

One row for each run, below a header row that names the columns, in any order. The sheet is csv
(UTF-8; comma, semicolon or tab), tsv, or the first sheet of an xlsx workbook. Numbers have a decimal
point, or all of them a decimal comma. Blank rows are skipped. "All" below means all kinds of run; a filled cell that its kind of run
does not use is warned about and ignored.
"""

_NOTES = """\
- `gamma_deg` is always the angle on the way down. An extraction is the pull back along that path;
  the program files it under (-beta, -gamma) itself.
- A tare is a run of the same medium, intruder, direction, beta, gamma and depth without the plate
  (`rod`), or of the same leg in air (`leg_air`). A plate held at -90 and at 90 degrees is the same.
- Where one tare serves several runs, each of them has `tare_shared` set to yes, unless it is
  a rod run with a blank `beta_deg`, which serves plates at every beta.
- Rows of kind rod may name one log, each for plates at another angle: they are one run, under the
  run_id of the first of these rows, and are counted once.
- A run whose log is missing is kept in the ledger and has no result; nor has a run without a tare,
  unless `fit.missing_tare` of the config is `flag` or `none`.
- `yes`, `true` and `1` are the same, and so are `no`, `false`, `0` and blank.
"""


def json_schema(model: type[BaseModel] = Config) -> str:
    """Return the JSON schema of the file of a model, for editors that check while one types; always the same bytes."""
    page = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema(model)}
    return json.dumps(page, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


def reference_markdown() -> str:
    """Return the reference page, with each key of the configuration and each column of the run sheet."""
    head = ("key", "type", "unit", "default", "allowed", "meaning")
    keys = _format_table(head, [_key_row(key) for key in all_keys()])
    head = ("column", "needed for", "used by", "unit", "allowed", "meaning")
    columns = _format_table(head, [_column_row(column) for column in COLUMNS])
    directions = "".join(
        f"- `{kind}` runs: {', '.join(directions_of_kind)}\n"
        for kind, directions_of_kind in DIRECTIONS.items()
    )
    # the two kinds of logs have the same keys: details are printed once
    first = {key.more: ".".join(key.path) for key in reversed(all_keys()) if key.more}
    details = "".join(f"`{path}`: {details}\n\n" for details, path in reversed(first.items()))
    return f"{_INTRO}\n{keys}\n### In more words\n\n{details}{_SHEET}\n{columns}\nDirections:\n\n{directions}\nRules:\n\n{_NOTES}"


def _key_row(key: Key) -> tuple[str, ...]:
    """Return the cells of a key in the table of keys of the reference page."""
    path = f"`{'.'.join(key.path)}`" + (f" ({key.tag})" if key.tag else "")
    return path, key.type, key.unit, key.default, key.allowed, key.description


def _column_row(column: SheetColumn) -> tuple[str, ...]:
    """Return the cells of a column of the run sheet in the table of columns of the reference page."""
    used = "all" if column.kinds == KINDS else ", ".join(column.kinds)
    used += f"; {column.direction} only" if column.direction else ""
    needed = used if column.needed else "may be blank"
    if column.may_be_blank:
        needed = ", ".join(kind for kind in column.kinds if kind not in column.may_be_blank)
    if column.name == "reason":
        needed = "excluded runs"
    return f"`{column.name}`", needed, used, column.unit, column.allowed, column.meaning


def _format_table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Format a table in Markdown."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def main(folder: Path) -> None:
    """Write schema and reference page into a folder, usually ``config``."""
    write_text(folder / "config.schema.json", json_schema())
    write_text(folder / "README.md", reference_markdown())


if __name__ == "__main__":
    try:
        main(Path("config"))
    except RftfitError as error:
        sys.exit(str(error))
