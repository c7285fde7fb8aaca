"""Every message that the program can show, read from its source.

A message is found where it is made: in the text given to an error or to a `Problem`, and in the
reason or flag of a row of a table. What is filled in at run time becomes a name in angle brackets.
Nothing is imported or run.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from message_flow import Flow, either, pairs
from message_texts import last_name, template, words_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

_PROBLEMS: dict[str, tuple[int, int, str]] = {
    "Problem": (4, 5, ""),
    "_at": (4, 2, ""),
    "_Refused": (3, 1, ""),
    "Odd": (2, 0, ""),
    ".error": (2, 3, ""),
    ".warn": (2, 3, ""),
    "problem": (1, 0, "<area>."),
    "refuse": (1, 0, "config."),
    "self.error": (1, 2, "robot-sheet."),
}
"""Calls that make a problem: places of its text and its code among the arguments, start of the code."""

_TEXT_AT = {"LogError": 1, "StrokeError": 1, "Assessment": 1, "Width": 2}
"""Calls whose text is not their first argument."""

_SAID = {"warn", "BadParameter", "refuse", "Assessment", "Width", "draw_missing"}
"""Calls, other than of errors, whose text is shown."""

_BUILTIN = {"ValueError", "OSError", "TypeError"}
_FOR_PROGRAMMERS = ("lab", "predict", "reference", "report", "store")
"""Rooms whose built-in errors tell a programmer of a wrong call and reach no user."""

_UNTOLD = ("lab", "report")
"""Rooms whose notes are no messages but parts of drawings, or of the re-enacted sheet."""

_TOLD = re.compile(r"_?(reasons?|why|flags?|problems|wrong|warning|doubts?|faults?)")
"""Names under which a text goes into a table, the ledger or a list of problems."""

_TELLERS = re.compile(
    r"_?(why|reason|note|doubt)(_\w+)?|_damage|_linearity_flags|_lock_text|failure_text|_notes"
    r"|_summary|_no_rate|faults|refusal|_terms|leg_speed_warning|hips_outside|plain_path|_without_words|crash_message|why_not_defined|without_a_fit"
)
"""Functions that return such a text."""

_LISTS = {
    "_TEXT",
    "CUT",
    "CELLS",
    "NUMBER",
    "FINITE",
    "LOST",
    "REPEATED",
    "DEVICE",
    "MISFIT",
    "_REGROUPED",
    "STATUS",
    "GROUPED",
    "OTHER_CHANNELS",
    "DUPLICATE",
    "BACKWARDS",
    "NO_TARE_FLAG",
    "_AT_END",
}
"""Constants of a module that are such texts."""

_CODE = re.compile(r"[a-z<>-]+\.[a-z<>_-]+")


@dataclass(frozen=True)
class Site:
    """One place in the source where a message is made.

    Attributes
    ----------
    file : str
        Relative to the package, with ``/``.
    first, last : int
        Lines in which the text is made; a test that ran one of them has made the message.
    inside : bool
        Whether the place is in a function; other lines are run by every import.
    text : str
        With ``<name>`` for what is filled in.
    code : str
        Stable name of a problem; empty for other messages.
    """

    file: str
    first: int
    last: int
    inside: bool
    text: str
    code: str

    @property
    def message(self) -> str:
        """Code and text."""
        return f"{self.code}: {self.text}" if self.code else self.text


def find_sites(package: Path) -> list[Site]:
    """Find every place that makes a message.

    Parameters
    ----------
    package : Path
        Folder of the package's source.

    Returns
    -------
    list of Site
        By file and line.
    """
    modules = [
        _Module(path.relative_to(package).as_posix(), ast.parse(path.read_text(encoding="utf-8")))
        for path in sorted(package.rglob("*.py"))
    ]
    errors = _error_classes(modules)
    found = {site for module in modules for site in module.sites(errors)}
    return sorted(found, key=lambda site: (site.file, site.first, site.message))


def by_message(sites: Iterable[Site]) -> dict[str, list[Site]]:
    """Group places that make the same message.

    Parameters
    ----------
    sites : iterable of Site

    Returns
    -------
    dict of str to list of Site
    """
    found: defaultdict[str, list[Site]] = defaultdict(list)
    for site in sites:
        found[site.message].append(site)
    return dict(found)


def _error_classes(modules: Iterable[_Module]) -> set[str]:
    """Names of the package's own exceptions, however far from `Exception`."""
    bases = {
        node.name: {last_name(base) for base in node.bases}
        for module in modules
        for node in module.nodes
        if isinstance(node, ast.ClassDef)
    }
    known = {"Exception", "ValueError"}
    while more := {name for name, of in bases.items() if of & known} - known:
        known |= more
    return known - {"Exception", "ValueError"}


class _Module(Flow):
    """Finds the places of one module."""

    def __init__(self, file: str, tree: ast.Module) -> None:
        super().__init__(tree)
        self.file = file
        room = file.partition("/")[0]
        self.said = _SAID | (set() if room in _FOR_PROGRAMMERS else _BUILTIN)
        self.told = room not in _UNTOLD

    def sites(self, errors: set[str]) -> Iterator[Site]:
        self.said |= errors
        for node in self.nodes:
            if isinstance(node, ast.Call):
                yield from self._call(node)
            elif not self.told:
                continue
            elif isinstance(node, (ast.Assign, ast.AnnAssign, ast.AugAssign)):
                for name, value in pairs(node):
                    if _TOLD.fullmatch(name):
                        yield from self._texts(value)
                    elif name in self.constants and name in _LISTS:
                        values = node.value.values if isinstance(node.value, ast.Dict) else [value]
                        for one in values:
                            yield from self._texts(one)
            elif isinstance(node, ast.Subscript) and last_name(node.value) == "dropped":
                yield from self._texts(node.slice)
            elif isinstance(node, ast.Dict):
                for key, value in zip(node.keys, node.values, strict=True):
                    if isinstance(key, ast.Constant) and _TOLD.fullmatch(str(key.value)):
                        yield from self._texts(value)
            elif isinstance(node, (ast.Return, ast.Yield)) and node.value is not None:
                if _TELLERS.fullmatch(self.function_name(node)):
                    yield from self._texts(node.value)
                elif isinstance(node.value, ast.Tuple) and len(node.value.elts) == 2:
                    # a function that finds text and code of a problem
                    text, code = node.value.elts
                    if _CODE.fullmatch(template(code, self.constants) or ""):
                        yield from self._texts(text, (code, ""))

    def _call(self, node: ast.Call) -> Iterator[Site]:
        name = last_name(node.func)
        owner = last_name(node.func.value) if isinstance(node.func, ast.Attribute) else ""
        method = f"{owner if owner == 'self' else ''}.{name}" if owner else name
        makes = _PROBLEMS.get(method)
        if makes is not None and len(node.args) > max(makes[:2]):
            text, code, start = makes
            yield from self._texts(node.args[text], (node.args[code], start))
        elif (name in self.said and not owner) or name == "BadParameter":
            for value in node.args[_TEXT_AT.get(name, 0) :]:
                yield from self._texts(value)
        if not self.told:
            return
        for word in node.keywords:
            if word.arg is not None and _TOLD.fullmatch(word.arg):
                yield from self._texts(word.value)
        own = node.func.value if isinstance(node.func, ast.Attribute) else node
        spoken = _TOLD.fullmatch(last_name(own)) or _TELLERS.fullmatch(self.function_name(node))
        if (name == "append" and spoken) or (name == "add" and owner == "book"):
            for value in node.args:
                yield from self._texts(value)

    def _texts(self, value: ast.expr, code: tuple[ast.expr, str] | None = None) -> Iterator[Site]:
        """Make places of the texts that an expression can be."""
        parts: list[ast.expr] = []
        if isinstance(value, (ast.Tuple, ast.List)):
            parts = value.elts
        elif isinstance(value, ast.BoolOp):
            parts = value.values
        elif isinstance(value, ast.IfExp):
            parts = [value.body, value.orelse]
        elif isinstance(value, (ast.ListComp, ast.GeneratorExp)):
            parts = [value.elt]
        elif isinstance(value, (ast.DictComp, ast.Starred)):
            parts = [value.value]
        elif isinstance(value, ast.Call) and last_name(value.func) in ("join", "tuple", "say"):
            parts = value.args
        for part in parts:
            yield from self._texts(part, code)
        if parts:
            return
        if isinstance(value, ast.Name) and (
            assigned := self.assigned(value, put_together=code is not None)
        ):
            for node, text in assigned:
                if text == "<allowed>" and code:
                    yield from (self._made(at, text, name) for name, at in self._codes(node, *code))
                else:
                    yield from self._site(text, node, code)
        elif isinstance(value, ast.Name) and (lists := self.lists(value)):
            for one in lists:
                yield from self._texts(one, code)
        elif (text := self.text(value)) is not None:
            yield from self._site(text, value, code)
        elif code and not (isinstance(value, ast.Name) and self.is_handed_on(value)):
            # what is allowed is put together elsewhere: one place for each code
            for name, node in self._codes(value, *code):
                if name != "<code>":
                    yield self._made(node, "<allowed>", name)

    def _site(self, text: str, place: ast.AST, code: tuple[ast.expr, str] | None) -> Iterator[Site]:
        if len(words_of(text)) < 2 - bool(code) or (not code and re.fullmatch(r"\w+", text)):
            return
        name = self._code(place, *code) if code else ""
        if self.function_name(place) == "plain_path":
            name, _, text = f"<area>.{text}".partition(": ")
        yield self._made(place, text, name)

    def _made(self, place: ast.AST, text: str, code: str) -> Site:
        at: ast.expr | ast.stmt = place  # type: ignore[assignment]
        inside = bool(self.function_name(place))
        return Site(self.file, at.lineno, at.end_lineno or at.lineno, inside, text, code)

    def _code(self, place: ast.AST, value: ast.expr, start: str) -> str:
        """Code of the problem whose text stands at `place`."""
        return " or ".join(dict.fromkeys(name for name, _ in self._codes(place, value, start)))

    def _codes(self, place: ast.AST, value: ast.expr, start: str) -> list[tuple[str, ast.AST]]:
        """Codes that a problem can have, with the places that choose them."""
        text = None if isinstance(value, ast.Name) else template(value, self.constants)
        if isinstance(value, ast.IfExp):
            return [(template(part, self.constants) or "", value) for part in either(value)]
        if text is not None and not text.endswith("<code>"):
            return [(text if "." in text else start + text, value)]
        if text is not None:
            start = text.removesuffix("<code>")
        found = self.beside(place, value.id if isinstance(value, ast.Name) else "code")
        return [
            (name if "." in name else start + name, node)
            for name, node in found or [("<code>", value)]
            if name
        ]
