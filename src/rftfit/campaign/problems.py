"""What is wrong with the user's input: a problem is an object until it is printed, and printed here."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Literal

from rftfit.errors import InputError

Severity = Literal["error", "warning"]
_LONGEST_SHOWN = 80
_LONGEST_COMPARED = 64
_SEPARATORS = str.maketrans("- ", "__")


@dataclass(frozen=True, slots=True)
class Place:
    """A file, or a place in it: row and column of a table, line and key or column of a text.

    `row` counts as a spreadsheet does (header: 1); `file` is the name that the user knows, and is
    empty where the message stands beside it.
    """

    file: str
    row: int | None = None
    column: str | None = None
    line: int | None = None
    key: str | None = None

    def __str__(self) -> str:
        parts = [self.file] if self.file else []
        for name in ("line", "row", "key", "column"):
            value = getattr(self, name)
            if value is not None:
                parts.append(f"{name} {shown(str(value))}")
        return ", ".join(parts)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong.

    `code`: Stable name of this sort of problem, for example ``sheet.unknown-word``.
    `found`: The text that is wrong; None where there is none, and `allowed` is the whole message.
    `allowed`: What would be right.
    `nearest`: The valid word that was probably meant.
    """

    code: str
    place: Place
    found: str | None
    allowed: str
    nearest: str | None = None
    severity: Severity = "error"

    def __str__(self) -> str:
        where = str(self.place)
        text = f"{where}: " if where else ""
        if self.found is None:
            text += self.allowed
        else:
            text += f"found '{shown(self.found)}'; allowed: {self.allowed}"
        if self.nearest is not None:
            text += f"; did you mean '{shown(self.nearest)}'?"
        # names of media and parser messages may hold what a terminal would act on
        return escaped(text)


def in_lines(problems: Iterable[Problem]) -> list[str]:
    """Write a problem a line; what is wrong alike in several rows or columns of a file is one line."""
    rows_of: dict[Problem, list[int]] = {}
    for problem in problems:
        everywhere = replace(problem, place=replace(problem.place, row=None))
        rows_of.setdefault(everywhere, []).extend(filter(None, [problem.place.row]))
    columns_of: dict[tuple[Problem, tuple[int, ...]], list[str]] = {}
    for problem, rows in rows_of.items():
        place = problem.place
        alike = replace(problem, place=replace(place, column=None)), tuple(sorted({*rows}))
        columns_of.setdefault(alike, []).extend(filter(None, [place.column]))
    return [
        str(_at_rows(_at_columns(problem, columns), rows))
        for (problem, rows), columns in columns_of.items()
    ]


def _at_columns(problem: Problem, columns: Sequence[str]) -> Problem:
    """A problem of one column, of many as ``columns a, b``, or of none."""
    place = problem.place
    if len(columns) < 2:
        return replace(problem, place=replace(place, column=columns[0] if columns else None))
    names = join_words(map(shown, columns), most=None)
    return replace(problem, place=replace(place, file=f"{place.file}, columns {names}"))


def _at_rows(problem: Problem, rows: Sequence[int]) -> Problem:
    """A problem at one row, or at many as ``rows 2 to 5, 9``."""
    place = problem.place
    if len(rows) < 2:
        return replace(problem, place=replace(place, row=rows[0] if rows else None))
    ranges: list[str] = []
    for _, members in groupby(enumerate(rows), lambda counted: counted[1] - counted[0]):
        together = [row for _, row in members]
        is_range = len(together) > 2
        ranges += [f"{together[0]} to {together[-1]}"] if is_range else map(str, together)
    return replace(problem, place=replace(place, file=f"{place.file}, rows {join_words(ranges)}"))


class CampaignError(InputError):
    """Files of a user cannot be used; the text is every problem, a line each, errors first."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        lines: list[str] = []
        for severity in ("error", "warning"):
            of_this = [problem for problem in self.problems if problem.severity == severity]
            if of_this:
                plural = "" if len(of_this) == 1 else "s"
                lines += [f"{len(of_this)} {severity}{plural}:", *in_lines(of_this)]
        return "\n".join(lines)


def unknown_word(what: str, word: str, allowed: Iterable[str]) -> str:
    """Say that a word, which stands at `what`, is not allowed, and which one was probably meant."""
    words = tuple(allowed)
    place, nearest = Place(what), did_you_mean(word, words)
    return str(Problem("word.unknown", place, word, join_words(words) or "none", nearest))


def did_you_mean(word: str, choices: Iterable[str]) -> str | None:
    """Find the choice that was probably meant; case, blanks and hyphens count for little."""
    return _nearest(word[:_LONGEST_COMPARED], tuple(choices))


@lru_cache(maxsize=1024)
def _nearest(word: str, choices: tuple[str, ...]) -> str | None:
    plain = {_plain(choice): choice for choice in reversed(choices)}
    close_words = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=0.6)
    return plain[close_words[0]] if close_words else None


def _plain(word: str) -> str:
    return word.strip().casefold().translate(_SEPARATORS)


def join_words(words: Iterable[str], most: int | None = 12) -> str:
    """Write words as ``a, b, c``, the first `most` of them; None: all."""
    words = list(words)
    rest = 0 if most is None else len(words) - most
    return ", ".join(words[:most]) + (f" and {rest} more" if rest > 0 else "")


def shown(text: str) -> str:
    """Make text fit to be shown: long text cut, control characters escaped."""
    if len(text) > _LONGEST_SHOWN:
        text = text[: _LONGEST_SHOWN - 3] + "..."
    return escaped(text)


def escaped(text: str) -> str:
    """Write control characters of a text as escapes."""
    escapes = {
        character: character.encode("unicode_escape").decode("ascii") for character in {*text}
    }
    return "".join(
        character if character.isprintable() else escapes[character] for character in text
    )


def choose(what: str, word: str, allowed: Sequence[str], hint: str = "") -> str:
    """Check a word against the allowed ones and return it; `hint` is said after the allowed words."""
    if word not in allowed:
        raise InputError(unknown_word(what, word, allowed) + (hint and f" ({hint})"))
    return word
