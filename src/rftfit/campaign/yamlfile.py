"""A small, strict YAML: plain data with the line of every key, and nothing that can surprise.

Read from the parser's events, so that nothing is built before it is known to be harmless. Numbers
and true/false are those of YAML 1.2 (``010`` is ten, ``no`` is a word). Anchors, aliases and tags
are refused, as are keys given twice.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import yaml

from rftfit.campaign.names import unshowable
from rftfit.campaign.problems import Problem, escaped

if TYPE_CHECKING:
    from collections.abc import Iterator

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

    Attributes
    ----------
    data : object
        Nested dict, list, str, int, float, bool and None; None where the text is no YAML.
    lines : dict
        Line (from 1) of every key and list entry, by its path.
    problems : list of Problem
    """

    data: Any = None
    lines: dict[KeyPath, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def line_of(self, path: KeyPath) -> int | None:
        """Line of a key, or of the nearest section around it.

        Parameters
        ----------
        path : tuple of str or int
            Names of keys, and places in lists.

        Returns
        -------
        int or None
            From 1; None where neither the key nor a section around it is in the text.
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

    Parameters
    ----------
    text : str
    file : str
        Name used in the problems.

    Returns
    -------
    Document
        Its problems are syntax errors, refused features and keys given twice.
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
