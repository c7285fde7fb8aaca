"""The reader of models: strict YAML with the line of every key, checked; all problems at once."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from rftfit.campaign.files import read_text, unshowable
from rftfit.campaign.problems import CampaignError, Place, Problem, did_you_mean, escaped
from rftfit.campaign.rows import COMMA
from rftfit.campaign.schema import TAG, Key, KeyPath, keys_at, tags_of
from rftfit.store.tables import NUMBER

MAX_BYTES = 1_000_000
MAX_DEPTH = 16
MAX_NODES = 20_000
_TOO_LARGE = f"more than {MAX_DEPTH} levels and {MAX_NODES} entries"
_NESTING = "maximum nesting depth"
"""Words of PyYAML's own limit, since 6.0.4: its scanner reads ahead of the parser below."""

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_CONSTANTS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_TYPE_ERRORS = re.compile(r".*(_type|_parsing|from_float)$")
_NAME = "letters A-Z a-z, digits, and . _ -, at most 64, beginning with a letter or digit"

M = TypeVar("M", bound=BaseModel)


@dataclass
class ModelFile(Generic[M]):
    """A file as read.

    `model`: None when there is any problem.
    `data`: What is written in it, good or not; None when the file is no YAML.
    `lines`: Line of every key and list entry.
    """

    name: str
    model: M | None = None
    data: Any = None
    lines: dict[KeyPath, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def place(self, path: KeyPath) -> Place:
        """Place of a key, at the line of the nearest section around it; lists count from 1."""
        around = path
        while around and around not in self.lines:
            around = around[:-1]
        key = ".".join(str(part + 1) if isinstance(part, int) else part for part in path)
        return Place(self.name, line=self.lines.get(around), key=key or None)

    def note(
        self, path: KeyPath, code: str, found: str | None, allowed: str, nearest: str | None = None
    ) -> None:
        """Note what is wrong at a key."""
        self.problems.append(Problem(f"config.{code}", self.place(path), found, allowed, nearest))


def read_model(path: Path, model: type[M], name: str = "") -> ModelFile[M]:
    """Read a YAML file, in messages called by `name` or else its path, and check it against a model."""
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
    """Check the data of a file against its model; problems are in the order of the lines."""
    try:
        checked = model.model_validate(file.data)
    except ValidationError as error:
        # a value that may be of several types has an error for each: the last is the nearest
        details = {_path(each["loc"], file.data): each for each in error.errors(include_url=False)}
        for at, detail in details.items():
            _translate(detail, at, model, file)
    else:
        file.model = None if file.problems else checked
    file.problems.sort(key=lambda problem: problem.place.line or 0)


def parse_yaml(text: str, file: ModelFile[Any]) -> None:
    """Fill in data and lines; syntax errors, refused features and keys given twice are problems."""
    try:
        file.data = _Parser(file, yaml.parse(text, Loader=_LOADER)).document()
    except CampaignError as error:
        file.problems += error.problems
    except yaml.YAMLError as error:
        place = Place(file.name)
        mark = error.problem_mark if isinstance(error, yaml.MarkedYAMLError) else None
        if mark is not None:
            place = _mark(file, mark)
        elif isinstance(error, yaml.reader.ReaderError):
            place = Place(file.name, line=text.count("\n", 0, error.position) + 1)
        parts = (getattr(error, name, None) for name in ("context", "problem", "reason"))
        why = " ".join(filter(None, parts)) or str(error)
        if _NESTING in why:
            file.problems.append(Problem("config.too-large", place, None, _TOO_LARGE))
            return
        allowed = f"this is not YAML: {why}; look here and in the line before"
        file.problems.append(Problem("config.not-yaml", place, None, allowed))


class _Parser:
    """Turns the events of one YAML document into plain data."""

    def __init__(self, file: ModelFile[Any], events: Iterator[Any]) -> None:
        self.file, self.events, self.nodes = file, events, 0

    def document(self) -> Any:
        next(self.events)  # start of the stream
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return None
        data = self.node(next(self.events), ())
        next(self.events)  # end of the document
        if not isinstance(after := next(self.events), yaml.StreamEndEvent):
            text = "one document only: a second one starts here after ---"
            raise self.refusal(after, "not-yaml", text)
        return data

    def node(self, event: Any, path: KeyPath) -> Any:
        self.nodes += 1
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            found = f"{'*' if isinstance(event, yaml.AliasEvent) else '&'}{event.anchor}"
            text = "values written out; anchors (&) and aliases (*) are not"
            raise self.refusal(event, "alias", text, found)
        if event.tag is not None:
            raise self.refusal(event, "tag", "plain values; tags (!) are not", str(event.tag))
        if len(path) > MAX_DEPTH or self.nodes > MAX_NODES:
            raise self.refusal(event, "too-large", _TOO_LARGE)
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(path)
        if sign := unshowable(event.value):
            text = "text without control characters, also when they are written as escapes"
            raise self.refusal(event, "control", text, escaped(sign))
        return _scalar(event.value) if event.implicit[0] else event.value

    def mapping(self, path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise self.refusal(event, "not-yaml", "a key must be a single word")
            # a key is a name, whatever it looks like: a medium may be called 2013 or no
            key, here = event.value, (*path, event.value)
            self.node(event, here)
            mark: Any = event.start_mark
            line = mark.line + 1
            first = self.file.lines.setdefault(here, line)
            value = self.node(next(self.events), here)
            if key in data:
                place = Place(self.file.name, line=line, key=self.file.place(here).key)
                text = f"each key once; line {first} already has it"
                self.file.problems.append(Problem("config.duplicate-key", place, key, text))
            data.setdefault(key, value)
        return data

    def sequence(self, path: KeyPath) -> list[Any]:
        data: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            here = (*path, len(data))
            self.file.lines[here] = event.start_mark.line + 1
            data.append(self.node(event, here))
        return data

    def refusal(
        self, event: Any, code: str, allowed: str, found: str | None = None
    ) -> CampaignError:
        place = _mark(self.file, event.start_mark)
        return CampaignError([Problem(f"config.{code}", place, found, allowed)])


def _mark(file: ModelFile[Any], mark: Any) -> Place:
    return Place(file.name, line=mark.line + 1, column=str(mark.column + 1))


def _scalar(text: str) -> Any:
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if NUMBER.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", "").lower())
    return text


def _path(location: tuple[str | int, ...], data: Any) -> KeyPath:
    """Path in the file of an error's location, without what pydantic adds for keys and unions."""
    path: KeyPath = ()
    tagged = False
    for part in location:
        if part == "[key]":
            continue
        if isinstance(data, dict) and not tagged and data.get(TAG) == part:
            tagged = True
            continue
        if not isinstance(data, dict | list):
            break
        path, tagged = (*path, part), False
        if isinstance(data, dict):
            data = data.get(part)
        else:
            data = data[part] if isinstance(part, int) and part < len(data) else None
    return path


def _translate(detail: Any, path: KeyPath, model: type[BaseModel], file: ModelFile[Any]) -> None:
    """Note one error of a model, in the user's terms."""
    sort: str = detail["type"]
    value = detail["input"]
    if sort == "missing" and path and isinstance(path[-1], int):
        # a list that is too short: speak of the list
        sort, path = "tuple_type", path[:-1]
    around = file.data
    for part in path[:-1]:
        around = around[part]
    tag = str(around.get(TAG, "")) if isinstance(around, dict) else ""
    keys = {key.name: key for key in keys_at(model, path[:-1], tag)} if path else {}
    name = str(path[-1]) if path else ""
    key = keys.get(name)
    if sort == "extra_forbidden":
        file.note(path, "unknown-key", name, f"one of {', '.join(keys)}", did_you_mean(name, keys))
    elif sort == "missing":
        text = f"this key is missing; it is needed: {_described(key)}"
        file.note(path, "missing-key", None, text)
    elif sort in ("union_tag_not_found", "union_tag_invalid"):
        tags, found = tags_of(model, path), value.get(TAG)
        nearest = did_you_mean(found, tags) if isinstance(found, str) else None
        file.note((*path, TAG), TAG, _words(found), f"one of {', '.join(tags)}", nearest)
    elif "[key]" in detail["loc"] and sort == "literal_error":
        words = re.findall(r"'([^']*)'", detail["ctx"]["expected"])
        text = f"one of {', '.join(words)}"
        file.note(path, "unknown-key", name, text, did_you_mean(name, words))
    elif "[key]" in detail["loc"]:
        file.note(path, "bad-name", name, _NAME)
    elif sort == "value_error":
        text = str(detail["msg"]).removeprefix("Value error, ")
        file.note(path, "inconsistent", None, text)
    elif sort == "literal_error":
        words = re.findall(r"'([^']*)'", detail["ctx"]["expected"])
        text = _described(key) if key else f"one of {', '.join(words)}"
        file.note(path, "unknown-word", _words(value), text, did_you_mean(str(value), words))
    else:
        code = "wrong-type" if _TYPE_ERRORS.match(sort) else "out-of-range"
        if key is None and path and isinstance(path[-1], int):
            # an entry of a list, or of a list of lists: the list's own words
            names = path
            while isinstance(names[-1], int):
                names = names[:-1]
            key = next((k for k in keys_at(model, names[:-1]) if k.name == names[-1]), None)
        message = str(detail["msg"]).lower()
        section = "a section with keys of its own" if "dictionary" in message else message
        text = (_described(key) if key else section) + _quotes(sort, value)
        comma = isinstance(value, str) and COMMA.fullmatch(value)
        file.note(path, code, _words(value), text, value.replace(",", ".") if comma else None)


def _described(key: Key | None) -> str:
    return f"{key.allowed} ({key.description})" if key else "a value"


def _quotes(sort: str, value: Any) -> str:
    if sort == "string_type" and isinstance(value, int | float):
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
