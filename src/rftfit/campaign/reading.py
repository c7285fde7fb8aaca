"""Reading YAML models: small strict files, every problem at once."""

from __future__ import annotations

import os
import posixpath
import re
import stat
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import yaml
from pydantic import ValidationError

from rftfit.campaign.config import PLATE_SHAPES, Config
from rftfit.campaign.problems import DEVICE, Problem, did_you_mean, escaped, is_device, unshowable
from rftfit.campaign.schema import Key, keys_at

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


# --- Reading small text files, and keeping paths where they belong.


Status = Literal["file", "folder", "other", "missing", "outside"]

_NEAREST_SEARCHES = 20
_MOST_NAMES = 2000


def read_bytes(path: Path, file: str, area: str, limit: int) -> bytes | Problem:
    """Read a regular file of a sensible size.

    `file`: Its name in the problem. `area`: First part of the problem's code. `limit`: Largest
    size, bytes.
    """

    def problem(code: str, text: str) -> Problem:
        return Problem(file, None, None, None, text, f"{area}.{code}")

    try:
        state = path.stat()
        # a pipe or device would be read for ever
        if not stat.S_ISREG(state.st_mode):
            return problem("not-a-file", "this is a folder or device, not a file")
        if state.st_size > limit:
            size, most = state.st_size / 1e6, limit / 1e6
            return problem(
                "too-large", f"{size:.1f} MB are too large; at most {most:g} MB are read"
            )
        return path.read_bytes()
    except FileNotFoundError:
        return problem("missing", "the file does not exist")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        return problem("unreadable", f"the file cannot be read: {why}")


def decode(data: bytes, file: str, area: str) -> str | Problem:
    """Decode UTF-8, with or without a byte order mark; all line ends become line feeds.

    `file`, `area`: As for `read_bytes`. Returns the problem names the row of the first byte that
    is not UTF-8.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            row, found = None, "UTF-16"
        else:
            row = len(re.findall(rb"\r\n|\r|\n", data[: error.start])) + 1
            found = f"byte {data[error.start]:#04x}"
        allowed = "UTF-8 text; in a spreadsheet save as 'CSV UTF-8', in an editor choose UTF-8"
        return Problem(file, row, None, found, allowed, f"{area}.not-utf8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def plain_path(text: str) -> tuple[str, str, str | None]:
    """Judge a relative path as it is written.

    Returns `path`, `fault`, `nearest`: The path without ``.`` parts; why it is refused (empty if
    it is not: otherwise the last part of a problem's code, a colon and what is allowed); and what
    was probably meant.
    """
    if "\\" in text:
        return text, "backslash: write / and not backslashes", text.replace("\\", "/")
    if not text.isprintable():
        return text, "path: without control characters", None
    if text.startswith(("/", "~")) or re.match(r"[A-Za-z]:", text):
        return text, "path-outside: a relative path, not an absolute one", None
    if ".." in text.split("/"):
        return text, "path-outside: it must stay inside, without ..", None
    if any(is_device(part) for part in text.split("/")):
        return text, f"reserved-name: {DEVICE}", None
    return posixpath.normpath(text), "", None


class Folder:
    """A folder and what lies inside it, with the look-ups remembered.

    `base`: The folder; links in it are resolved.
    """

    def __init__(self, base: Path) -> None:
        self.base = os.path.realpath(base)
        self._parents: dict[str, str] = {}
        self._names: dict[str, tuple[str, ...]] = {}
        self._searches = 0

    def status(self, path: str) -> Status:
        """Say what lies at a relative path.

        `path`: As returned by `plain_path`. Returns ``outside`` if links lead out of the folder.
        """
        head, _, name = path.rpartition("/")
        # one resolution per folder, not per file: a campaign has thousands of logs in a few folders
        if head not in self._parents:
            self._parents[head] = os.path.realpath(f"{self.base}/{head}") if head else self.base
        full = f"{self._parents[head]}/{name}"
        try:
            mode = os.lstat(full).st_mode
            if stat.S_ISLNK(mode):
                full = os.path.realpath(full)
                mode = os.stat(full).st_mode if self._inside(full) else 0  # noqa: PTH116
        except (OSError, ValueError):
            mode = None
        if not self._inside(full):
            return "outside"
        if mode is None:
            return "missing"
        if stat.S_ISREG(mode):
            return "file"
        return "folder" if stat.S_ISDIR(mode) else "other"

    def nearest(self, path: str) -> str | None:
        """Find the file beside a missing one that was probably meant.

        Returns none too after many searches: a folder with nothing in it needs one message, not
        hints.
        """
        self._searches += 1
        if self._searches > _NEAREST_SEARCHES:
            return None
        head, _, name = path.rpartition("/")
        if head not in self._names:
            self._names[head] = self._list(head)
        found = did_you_mean(name, self._names[head])
        return None if found is None else f"{head}/{found}" if head else found

    def _inside(self, full: str) -> bool:
        return full == self.base or full.startswith(self.base.rstrip("/\\") + os.sep)

    def _list(self, head: str) -> tuple[str, ...]:
        try:
            names = sorted(os.listdir(f"{self.base}/{head}"))  # noqa: PTH208
        except (OSError, ValueError):
            return ()
        return tuple(names) if len(names) <= _MOST_NAMES else ()


# --- A small, strict YAML: plain data with the line of every key, and nothing that can surprise.


MAX_DEPTH = 16
MAX_NODES = 20_000

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, bool | None] = {
    "": None,
    "~": None,
    **dict.fromkeys(("null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")

KeyPath = tuple[str | int, ...]


@dataclass
class Document:
    """What was read.

    `data`: Nested dict, list, str, int, float, bool and None; None where the text is no YAML.
    `lines`: Line (from 1) of every key and list entry, by its path.
    """

    data: Any = None
    lines: dict[KeyPath, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def line_of(self, path: KeyPath) -> int | None:
        """Line of a key, or of the nearest section around it.

        `path`: Names of keys, and places in lists. Returns from 1; None where neither the key nor
        a section around it is in the text.
        """
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path)


class _Refused(Exception):
    def __init__(self, mark: Any, code: str, found: str | None, allowed: str) -> None:
        super().__init__(allowed)
        self.mark, self.code, self.found, self.allowed = mark, code, found, allowed


def parse_yaml(text: str, file: str) -> Document:
    """Read YAML text.

    `file`: Name used in the problems. Returns its problems are syntax errors, refused features and
    keys given twice.
    """
    document = Document()
    events = yaml.parse(text, Loader=_LOADER)
    try:
        data = _Builder(document, events, file).document()
    except _Refused as refused:
        document.problems.append(
            _at(file, refused.mark, refused.code, refused.found, refused.allowed)
        )
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        allowed = f"YAML text; a character that YAML does not know stands here ({error.reason})"
        document.problems.append(Problem(file, line, None, None, allowed, "config.not-yaml"))
    except yaml.MarkedYAMLError as error:
        mark: Any = error.problem_mark or error.context_mark
        why = " ".join(filter(None, [error.context, error.problem]))
        allowed = f"this is not YAML: {why}; look here and in the line before"
        document.problems.append(_at(file, mark, "config.not-yaml", None, allowed))
    except yaml.YAMLError as error:
        document.problems.append(
            Problem(file, None, None, None, f"this is not YAML: {error}", "config.not-yaml")
        )
    else:
        document.data = data
    return document


def _at(file: str, mark: Any, code: str, found: str | None, allowed: str) -> Problem:
    line, column = (None, None) if mark is None else (mark.line + 1, str(mark.column + 1))
    return Problem(file, line, column, found, allowed, code)


class _Builder:
    """Turns the events of one document into plain data."""

    def __init__(self, document: Document, events: Iterator[Any], file: str) -> None:
        self.out, self.events, self.file = document, events, file
        self.nodes = 0

    def document(self) -> Any:
        next(self.events)  # start of the stream
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return None
        data = self.node(next(self.events), ())
        next(self.events)  # end of the document
        after = next(self.events)
        if not isinstance(after, yaml.StreamEndEvent):
            allowed = "one document only: a second one starts here after ---"
            raise _Refused(after.start_mark, "config.not-yaml", None, allowed)
        return data

    def node(self, event: Any, path: KeyPath) -> Any:
        self.nodes += 1
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            sign = "*" if isinstance(event, yaml.AliasEvent) else "&"
            allowed = "values written out; anchors (&) and aliases (*) are not"
            raise _Refused(event.start_mark, "config.alias", f"{sign}{event.anchor}", allowed)
        if event.tag is not None:
            allowed = "plain values; tags (!) are not"
            raise _Refused(event.start_mark, "config.tag", str(event.tag), allowed)
        if len(path) > MAX_DEPTH or self.nodes > MAX_NODES:
            limit = f"{MAX_DEPTH} levels and {MAX_NODES} entries"
            raise _Refused(event.start_mark, "config.too-large", None, f"more than {limit}")
        if isinstance(event, yaml.ScalarEvent) and (sign := unshowable(event.value)):
            allowed = "text without control characters, also when they are written as escapes"
            raise _Refused(event.start_mark, "config.control", escaped(sign), allowed)
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(path)
        return _scalar(event.value) if event.implicit[0] else event.value

    def mapping(self, path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise _Refused(
                    event.start_mark, "config.not-yaml", None, "a key must be a single word"
                )
            self.node(event, (*path, event.value))
            # a key is a name, whatever it looks like: a medium may be called 2013 or no
            mark: Any = event.start_mark
            key, line = event.value, mark.line + 1
            here = (*path, key)
            if key in data:
                dotted = ".".join(map(str, here))
                allowed = f"each key once; line {self.out.lines[here]} already has it"
                self.out.problems.append(
                    Problem(self.file, line, dotted, key, allowed, "config.duplicate-key")
                )
            else:
                self.out.lines[here] = line
            value = self.node(next(self.events), here)
            data.setdefault(key, value)
        return data

    def sequence(self, path: KeyPath) -> list[Any]:
        data: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            here = (*path, len(data))
            self.out.lines[here] = event.start_mark.line + 1
            data.append(self.node(event, here))
        return data


def _scalar(text: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _NUMBER.fullmatch(text):
        return float(text)
    if _INFINITE.fullmatch(text):
        return float(text.replace(".", "").lower())
    return text


# --- From ``config.yaml`` to the checked configuration, or to everything that is wrong with it.


MAX_BYTES = 1_000_000

_SHAPES = (*PLATE_SHAPES, "leg")
_BRANCHES = frozenset({"str", "int", "float", "bool", "constrained-int"})
"""What pydantic adds to the path of a value that may be of several types."""

_TYPE_ERRORS = re.compile(r".*(_type|_parsing|from_float)$")


@dataclass(frozen=True)
class ConfigFile:
    """A configuration file as read.

    `name`: Of the file, for problems.
    `config`: None when there is any error.
    `data`: The plain data, good or not; None when the file is no YAML.
    `document`: Knows the line of each key.
    """

    name: str
    config: Config | None = None
    data: Any = None
    document: Document = field(default_factory=Document)


def read_config(path: Path, name: str) -> tuple[ConfigFile, list[Problem]]:
    """Read and check a configuration.

    `name`: Of the file, for problems. Returns `problems`: In the order of the lines.
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
