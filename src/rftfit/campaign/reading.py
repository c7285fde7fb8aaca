"""Reads a YAML file and checks it against a model; all problems at once, each with the line of its key.

The way: text -> tokens of PyYAML (`_refuse_features`) -> nodes -> plain data with the line of each key (`_plain_data`)
-> pydantic model -> its errors in words for the user (`_add_problem`). A *path* is the keys, and the indices of entries
of lists, that lead to a value: ``("arm", "speed_cm_per_s")``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from rftfit.campaign.config import units_of
from rftfit.campaign.files import read_text, unshowable
from rftfit.campaign.problems import CampaignError, Place, Problem, did_you_mean, escaped
from rftfit.campaign.schema import TAG, Key, KeyPath, keys_at, tags_of
from rftfit.store.tables import NUMBER
from rftfit.table.numbers import COMMA

MAX_BYTES = 1_000_000
"""Most bytes of a file."""
MAX_DEPTH = 16
"""Most levels of sections within sections."""
MAX_NODES = 20_000
"""Most keys, values and list entries."""
_TOO_LARGE = f"more than {MAX_DEPTH} levels and {MAX_NODES} entries"
_NESTING = "maximum nesting depth"
"""Words in the error of PyYAML's limit of depth (since 6.0.4), which may come before `MAX_DEPTH` is reached."""

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_CONSTANTS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_TYPE_ERRORS = re.compile(r".*(_type|_parsing|from_float)$")
"""Types of errors of pydantic for a value of a wrong type."""
_NAME = "letters A-Z a-z, digits, and . _ -, at most 64, beginning with a letter or digit"
"""Words for a name that the user chooses as a key."""

M = TypeVar("M", bound=BaseModel)


@dataclass
class ModelFile(Generic[M]):
    """A YAML file, its content and its problems; the functions of this module fill it step by step.

    `name`: Name of the file for the user.
    `model`: The checked content; None where there is any problem.
    `data`: The content as written, right or wrong; None where the file cannot be read, is empty or is no YAML.
    `lines`: Path of a key or list entry, to its line.
    """

    name: str
    model: M | None = None
    data: Any = None
    lines: dict[KeyPath, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def written(self, key: str) -> Any:
        """Return the value of a key of the first level as it is written; None without one."""
        return self.data.get(key) if isinstance(self.data, dict) else None

    def place(self, path: KeyPath) -> Place:
        """Return the place of a key; a key without a line has the line of its section; list entries count from 1."""
        with_line = path
        while with_line and with_line not in self.lines:
            with_line = with_line[:-1]
        key = ".".join(str(step + 1) if isinstance(step, int) else step for step in path)
        return Place(self.name, line=self.lines.get(with_line), key=key or None)

    def note(
        self,
        path: KeyPath,
        code: str,
        value_found: str | None,
        allowed: str,
        nearest: str | None = None,
    ) -> None:
        """Add an error at the key with this path; other arguments as in `Problem`, but `code` without ``config.``."""
        self.problems.append(
            Problem(f"config.{code}", self.place(path), value_found, allowed, nearest)
        )


def read_model(path: Path, model: type[M], name: str = "") -> ModelFile[M]:
    """Read a YAML file and check it against a model; whatever is wrong is among the problems of the result.

    `name`: Name of the file for the user; empty: its path.
    """
    file = ModelFile[M](name or str(path))
    try:
        text = read_text(path, file.name, "config", MAX_BYTES)
    except CampaignError as error:
        file.problems += error.problems
        return file
    parse_yaml(text, file)
    if file.data is None and not file.problems:
        file.note(
            (), "empty", None, "the file is empty; start from one that comes with the program"
        )
    if file.data is None:
        return file
    check_model(file, model)
    return file


def check_model(file: ModelFile[M], model: type[M]) -> None:
    """Check the data of a file against its model: set `file.model`, or add problems, in the order of the lines."""
    try:
        checked = model.model_validate(file.data)
    except ValidationError as error:
        # a value that may have several types has an error for each type: the last is the most specific
        details = {
            _path_of_error(detail["loc"], file.data): detail
            for detail in error.errors(include_url=False)
        }
        for path, detail in details.items():
            _add_problem(detail, path, model, file)
    else:
        file.model = None if file.problems else checked
    file.problems.sort(key=lambda problem: problem.place.line or 0)


def parse_yaml(text: str, file: ModelFile[Any]) -> None:
    """Set data and lines of a file from its text; add problems for wrong syntax, refused features and repeated keys.

    Where syntax or a feature is refused, the data stay None.
    """
    try:
        _refuse_features(text, file)
        file.data = _plain_data(yaml.compose(text, Loader=_LOADER), (), file)
    except CampaignError as error:
        file.problems += error.problems
    except yaml.YAMLError as error:
        place = Place(file.name)
        mark = error.problem_mark if isinstance(error, yaml.MarkedYAMLError) else None
        if mark is not None:
            place = _place_of(mark, file)
        elif isinstance(error, yaml.reader.ReaderError):
            place = Place(file.name, line=text.count("\n", 0, error.position) + 1)
        messages = (getattr(error, name, None) for name in ("context", "problem", "reason"))
        why = " ".join(filter(None, messages)) or str(error)
        code, allowed = "not-yaml", f"this is not YAML: {why}; look here and in the line before"
        if _NESTING in why:
            code, allowed = "too-large", _TOO_LARGE
        file.problems.append(Problem(f"config.{code}", place, None, allowed))


_REFUSED_TOKENS: dict[type, tuple[str, str, str]] = {
    yaml.AnchorToken: ("alias", "&", "values written out; anchors (&) and aliases (*) are not"),
    yaml.AliasToken: ("alias", "*", "values written out; anchors (&) and aliases (*) are not"),
    yaml.TagToken: ("tag", "", "plain values; tags (!) are not"),
}
"""Features of YAML that a file may not use: code, sign before the name, and what is allowed."""

_ENTRIES = (yaml.ScalarToken, yaml.BlockEntryToken, yaml.FlowEntryToken)
"""Tokens that are counted as keys, values and entries of lists."""
_STARTS = (
    yaml.BlockMappingStartToken,
    yaml.BlockSequenceStartToken,
    yaml.FlowMappingStartToken,
    yaml.FlowSequenceStartToken,
)
"""Tokens that begin a section or list, and below those that end one."""
_ENDS = (yaml.BlockEndToken, yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)


def _refuse_features(text: str, file: ModelFile[Any]) -> None:
    """Raise CampaignError for forbidden features of YAML and for too many levels or entries, before data are built.

    Aliases within aliases make a small file grow without limit, and tags can call code.
    """
    depth = entries = 0
    tokens: Iterator[Any] = yaml.scan(text, Loader=_LOADER)
    for token in tokens:
        if refused := _REFUSED_TOKENS.get(type(token)):
            code, sign, allowed = refused
            # the value of a tag has two parts, of which the first may be missing
            name = token.value if sign else "".join(filter(None, token.value))
            raise _refusal(token, file, code, allowed, sign + name)
        depth += isinstance(token, _STARTS) - isinstance(token, _ENDS)
        entries += isinstance(token, _ENTRIES)
        if depth > MAX_DEPTH + 1 or entries > MAX_NODES:
            raise _refusal(token, file, "too-large", _TOO_LARGE)


def _plain_data(node: Any, path: KeyPath, file: ModelFile[Any]) -> Any:
    """Return the plain data of a node of YAML at a path: dict, list, text, number, True, False or None.

    The lines of keys and entries are stored in `file`.
    """
    if node is None:
        return None
    if isinstance(node, yaml.MappingNode):
        return _section_data(node, path, file)
    if isinstance(node, yaml.SequenceNode):
        items = [((*path, index), item) for index, item in enumerate(node.value)]
        file.lines |= {item_path: item.start_mark.line + 1 for item_path, item in items}
        return [_plain_data(item, item_path, file) for item_path, item in items]
    if sign := unshowable(node.value):
        allowed = "text without control characters, also when they are written as escapes"
        raise _refusal(node, file, "control", allowed, escaped(sign))
    return node.value if node.style else _scalar_value(node.value)


def _section_data(node: yaml.MappingNode, path: KeyPath, file: ModelFile[Any]) -> dict[str, Any]:
    """Return the plain data of a section; a repeated key is a problem, and its first value counts."""
    data: dict[str, Any] = {}
    for key_node, value_node in node.value:
        if not isinstance(key_node, yaml.ScalarNode):
            raise _refusal(key_node, file, "not-yaml", "a key must be a single word")
        # a key is always a text, not a number or yes/no: a medium may be called 2013 or no
        key, key_path = key_node.value, (*path, key_node.value)
        _plain_data(key_node, key_path, file)  # only to refuse control characters in it
        line = key_node.start_mark.line + 1
        first_line = file.lines.setdefault(key_path, line)
        value = _plain_data(value_node, key_path, file)
        if key in data:
            place = replace(file.place(key_path), line=line)
            allowed = f"each key once; line {first_line} already has it"
            file.problems.append(Problem("config.duplicate-key", place, key, allowed))
        data.setdefault(key, value)
    return data


def _refusal(
    node: Any, file: ModelFile[Any], code: str, allowed: str, value_found: str | None = None
) -> CampaignError:
    """Make the error, to be raised, that refuses a file because of a node or token; other arguments as in `note`."""
    place = _place_of(node.start_mark, file)
    return CampaignError([Problem(f"config.{code}", place, value_found, allowed)])


def _place_of(mark: Any, file: ModelFile[Any]) -> Place:
    """Return line and column of a mark of PyYAML, from 1."""
    return Place(file.name, line=mark.line + 1, column=str(mark.column + 1))


def _scalar_value(text: str) -> Any:
    """Return the value of a text without quotes: null, true or false, a number, or the text itself."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if NUMBER.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", "").lower())
    return text


def _path_of_error(location: tuple[str | int, ...], data: Any) -> KeyPath:
    """Return the path in the file for a location of pydantic, without the steps that it adds for keys and unions.

    `location`: Steps from the whole file to the value with the error. `data`: Plain data of the file.
    """
    path: KeyPath = ()
    is_tag_passed = False
    for step in location:
        if step == "[key]":
            continue
        if isinstance(data, dict) and not is_tag_passed and data.get(TAG) == step:
            # not a key but the tag of the section, by which pydantic names its model
            is_tag_passed = True
            continue
        # a step into a value names one of its types
        if not isinstance(data, dict | list):
            break
        path, is_tag_passed = (*path, step), False
        if isinstance(data, dict):
            data = data.get(step)
        else:
            data = data[step] if isinstance(step, int) and step < len(data) else None
    return path


def _add_problem(detail: Any, path: KeyPath, model: type[BaseModel], file: ModelFile[Any]) -> None:
    """Add the problem for one error of pydantic at a path, in words for the user.

    `detail`: Dictionary of pydantic with the type, the input, the location and the message of the error. The words are
    those by which the model describes the key: what it allows and means.
    """
    error_type: str = detail["type"]
    value = detail["input"]
    if error_type == "missing" and path and isinstance(path[-1], int):
        # an entry is missing: the problem is that of the list, which is too short
        error_type, path = "tuple_type", path[:-1]
    # an entry of a list, or of a list of lists, has the key of the list
    names = path
    while names and isinstance(names[-1], int):
        names = names[:-1]
    # the section that has the key, the keys that it may have, and the key with its words
    section = file.data
    for step in names[:-1]:
        section = section[step]
    tag = str(section.get(TAG, "")) if isinstance(section, dict) else ""
    keys = {key.name: key for key in keys_at(model, names[:-1], tag)} if names else {}
    name = str(names[-1]) if names else ""
    key = keys.get(name)
    # words that a literal can be, in the message of pydantic
    words = re.findall(r"'([^']*)'", detail.get("ctx", {}).get("expected", ""))
    if error_type == "extra_forbidden":
        file.note(path, "unknown-key", name, _one_of(keys), did_you_mean(name, keys))
    elif error_type == "missing":
        allowed = f"this key is missing; it is needed: {_describe_key(key)}"
        file.note(path, "missing-key", None, allowed)
    elif error_type in ("union_tag_not_found", "union_tag_invalid"):
        tags, tag_value = tags_of(model, path), value.get(TAG)
        nearest = did_you_mean(tag_value, tags) if isinstance(tag_value, str) else None
        file.note((*path, TAG), TAG, _describe_value(tag_value), _one_of(tags), nearest)
    elif "[key]" in detail["loc"] and error_type == "literal_error":
        file.note(path, "unknown-key", name, _one_of(words), did_you_mean(name, words))
    elif "[key]" in detail["loc"]:
        file.note(path, "bad-name", name, _NAME)
    elif error_type == "value_error":
        file.note(path, "inconsistent", None, str(detail["msg"]).removeprefix("Value error, "))
    elif error_type == "literal_error":
        allowed = _describe_key(key) if key else _one_of(words)
        if name == "unit" and "columns" in path[:-1]:
            # only the units of this quantity
            words = [*units_of(str(path[path.index("columns") + 1]))]
            allowed = _one_of(words)
        nearest = did_you_mean(str(value), words)
        file.note(path, "unknown-word", _describe_value(value), allowed, nearest)
    else:
        code = "wrong-type" if _TYPE_ERRORS.match(error_type) else "out-of-range"
        message = str(detail["msg"]).lower()
        if "dictionary" in message:
            message = "a section with keys of its own"
        allowed = (_describe_key(key) if key else message) + _describe_quotes(error_type, value)
        has_comma = isinstance(value, str) and COMMA.fullmatch(value)
        nearest = value.replace(",", ".") if has_comma else None
        file.note(path, code, _describe_value(value), allowed, nearest)


def _one_of(words: Iterable[str]) -> str:
    """Return the words on what is allowed, where a value must be one of some words."""
    return f"one of {', '.join(words)}"


def _describe_key(key: Key | None) -> str:
    """Return the words on what a key allows and means; None: a key that the model does not describe."""
    return f"{key.allowed} ({key.description})" if key else "a value"


def _describe_quotes(error_type: str, value: Any) -> str:
    """Return the advice to add or remove quotes, where that is the cure; `error_type`: of pydantic."""
    if error_type == "string_type" and isinstance(value, int | float):
        return "; put it in quotes"
    is_number = re.fullmatch(r"[-+]?[0-9]+(\.[0-9]*)?", str(value))
    return "; without quotes" if error_type in ("float_type", "int_type") and is_number else ""


def _describe_value(value: Any) -> str:
    """Return a wrong value as the user would write it; a section or a list only as such, as it may be long."""
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else str(value)
