"""From ``config.yaml`` to the checked configuration, or to everything that is wrong with it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rftfit.campaign.config import PLATE_SHAPES, Config
from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.keys import Key, keys_at
from rftfit.campaign.problems import Problem, did_you_mean
from rftfit.campaign.yamlfile import Document, KeyPath, parse_yaml

if TYPE_CHECKING:
    from pathlib import Path

MAX_BYTES = 1_000_000

_SHAPES = (*PLATE_SHAPES, "leg")
_BRANCHES = frozenset({"str", "int", "float", "bool", "constrained-int"})
"""What pydantic adds to the path of a value that may be of several types."""

_TYPE_ERRORS = re.compile(r".*(_type|_parsing|from_float)$")


@dataclass(frozen=True)
class ConfigFile:
    """A configuration file as read.

    Attributes
    ----------
    name : str
        Of the file, for problems.
    config : Config or None
        None when there is any error.
    data : object
        The plain data, good or not; None when the file is no YAML.
    document : Document
        Knows the line of each key.
    """

    name: str
    config: Config | None = None
    data: Any = None
    document: Document = field(default_factory=Document)


def read_config(path: Path, name: str) -> tuple[ConfigFile, list[Problem]]:
    """Read and check a configuration.

    Parameters
    ----------
    path : Path
    name : str
        Of the file, for problems.

    Returns
    -------
    file : ConfigFile
    problems : list of Problem
        In the order of the lines.
    """
    data = read_bytes(path, name, "config", MAX_BYTES)
    text = data if isinstance(data, Problem) else decode(data, name, "config")
    if isinstance(text, Problem):
        return ConfigFile(name), [text]
    document = parse_yaml(text, name)
    problems = list(document.problems)
    if document.data is None:
        if not problems:
            allowed = "the file is empty; `rftfit init` writes one to start from"
            problems.append(Problem(name, None, None, None, allowed, "config.empty"))
        return ConfigFile(name), problems
    config = None
    try:
        config = Config.model_validate(document.data)
    except ValidationError as error:
        details = error.errors(include_url=False)
        # a value that may be of several types has an error for each: the last is the nearest
        single = {_path(detail["loc"]): detail for detail in details}
        problems += [_translate(detail, document, name) for detail in single.values()]
    problems.sort(key=lambda problem: problem.row or 0)
    return ConfigFile(name, None if problems else config, document.data, document), problems


def _translate(detail: Any, document: Document, name: str) -> Problem:
    """One error of the models, in the user's terms."""
    sort: str = detail["type"]
    path = _path(detail["loc"])
    if sort == "missing" and isinstance(path[-1], int):
        # a list that is too short: speak of the list
        sort, path = "tuple_type", path[:-1]
    parent, shape = path[:-1], ""
    if len(parent) == 2 and parent[0] == "intruders":
        shape = str(document.data["intruders"][parent[1]].get("shape", ""))
    choices = {str(key.path[-1]): key for key in keys_at(parent, shape)} if path else {}
    key = choices.get(str(path[-1])) if path else None
    found: str | None = _words(detail["input"])
    nearest = None
    if sort == "extra_forbidden":
        code, found = "unknown-key", str(path[-1])
        allowed = f"one of {', '.join(choices)}"
        nearest = did_you_mean(found, choices)
    elif sort == "missing":
        code, found = "missing-key", None
        allowed = f"this key is missing; it is needed: {key.description if key else 'a value'}"
        allowed += f" ({key.allowed})" if key else ""
    elif sort in ("union_tag_not_found", "union_tag_invalid"):
        code, path = "shape", (*path, "shape")
        word = detail["input"].get("shape")
        found, allowed = _words(word), f"one of {', '.join(_SHAPES)}"
        nearest = did_you_mean(word, _SHAPES) if isinstance(word, str) else None
    elif "[key]" in detail["loc"] and sort == "literal_error":
        code, found = "unknown-key", str(path[-1])
        words = re.findall(r"'([^']*)'", str(detail["msg"]))
        allowed, nearest = f"one of {', '.join(words)}", did_you_mean(found, words)
    elif "[key]" in detail["loc"]:
        code, found = "bad-name", str(path[-1])
        allowed = "letters A-Z a-z, digits, and . _ -, at most 64, beginning with a letter or digit"
    elif sort == "value_error":
        code, found = "inconsistent", None
        allowed = str(detail["msg"]).removeprefix("Value error, ")
    elif sort == "literal_error":
        code, nearest = "unknown-word", did_you_mean(str(detail["input"]), _words_of(key))
        allowed = key.allowed if key else str(detail["msg"])
    else:
        code = "wrong-type" if _TYPE_ERRORS.match(sort) else "out-of-range"
        allowed, nearest = _expected(path, key, str(detail["msg"])), _with_point(detail["input"])
        allowed += _quotes(sort, detail["input"])
    dotted = ".".join(map(str, path)) or None
    return Problem(
        name, document.line_of(path), dotted, found, allowed, f"config.{code}", nearest=nearest
    )


def _path(location: tuple[str | int, ...]) -> KeyPath:
    path = tuple(part for part in location if part != "[key]")
    while path and path[-1] in _BRANCHES:
        path = path[:-1]
    # pydantic puts the shape between an intruder's name and its keys
    return path[:2] + path[3:] if path[:1] == ("intruders",) else path


def _expected(path: KeyPath, key: Key | None, message: str) -> str:
    if key is None and len(path) > 1 and isinstance(path[-1], int):
        # an entry of a list: the list's own words
        key = next((k for k in keys_at(path[:-2]) if k.path[-1] == path[-2]), None)
    if key is None:
        return "a section with keys of its own" if "dictionary" in message else message.lower()
    return f"{key.allowed} ({key.description})"


def _words_of(key: Key | None) -> list[str]:
    return key.allowed.removeprefix("one of ").split(", ") if key else []


def _with_point(value: Any) -> str | None:
    if isinstance(value, str) and re.fullmatch(r"[-+]?[0-9]*,[0-9]+", value):
        return value.replace(",", ".")
    return None


def _quotes(sort: str, value: Any) -> str:
    if sort == "string_type" and isinstance(value, (int, float)):
        return "; put it in quotes"
    if sort in ("float_type", "int_type") and re.fullmatch(r"[-+]?[0-9]+(\.[0-9]*)?", str(value)):
        return "; without quotes"
    return ""


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else str(value)
