"""Problems of the user's input, as objects, and their sentences: place, what was found, allowed and nearest word.

Readers collect `Problem` objects and go on, so that a user sees all that is wrong at once; `CampaignError` holds them.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Any, Literal

from rftfit.errors import InputError

Severity = Literal["error", "warning"]
"""An error stops the command; a warning is printed, and the input is used."""
_LONGEST_SHOWN = 80
"""Most characters of a user's text in a message."""
_LONGEST_COMPARED = 64
"""Most characters of a word for which a similar word is searched."""


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
        """Format as ``runs.csv, row 3, column depth_cm``, without what is None."""
        parts = [self.file] if self.file else []
        for name in ("line", "row", "key", "column"):
            value = getattr(self, name)
            if value is not None:
                parts.append(f"{name} {shown(str(value))}")
        return ", ".join(parts)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong.

    `code`: Stable name of this sort of problem, for scripts, for example ``sheet.unknown-word``: area and reason.
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
        """Format as a sentence: place, what was found, what is allowed, the word that was probably meant."""
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
    """Format each problem as a line; the same problem in several rows or columns of a file becomes one line.

    First the rows of each problem are joined, then the columns of those problems that stand in the same rows.
    """
    # problem without its row, to the rows
    rows_by_problem: dict[Problem, list[int]] = {}
    for problem in problems:
        rows = rows_by_problem.setdefault(_move(problem, row=None), [])
        rows += filter(None, [problem.place.row])
    # problem without its columns, and its rows, to the columns
    columns_by_problem: dict[tuple[Problem, tuple[int, ...]], list[str]] = {}
    for problem, rows in rows_by_problem.items():
        key = _move(problem, column=None), tuple(sorted({*rows}))
        columns = columns_by_problem.setdefault(key, [])
        columns += filter(None, [problem.place.column])
    return [
        str(_at_rows(_at_columns(problem, columns), rows))
        for (problem, rows), columns in columns_by_problem.items()
    ]


def _move(problem: Problem, **place: Any) -> Problem:
    """Return the problem with some fields of its `Place` replaced."""
    return replace(problem, place=replace(problem.place, **place))


def _at_columns(problem: Problem, columns: Sequence[str]) -> Problem:
    """Return the problem with the columns in its place: one, several as ``columns a, b``, or none.

    Words for several stand behind the name of the file, as a place has only one column.
    """
    if len(columns) < 2:
        return _move(problem, column=columns[0] if columns else None)
    names = join_words(map(shown, columns), most=None)
    return _move(problem, file=f"{problem.place.file}, columns {names}")


def _at_rows(problem: Problem, rows: Sequence[int]) -> Problem:
    """Return the problem with the rows in its place: one, or several as ``rows 2 to 5, 9``."""
    if len(rows) < 2:
        return _move(problem, row=rows[0] if rows else None)
    ranges: list[str] = []
    # in a range of rows, row less its index in the list stays the same
    for _, members in groupby(enumerate(rows), lambda counted: counted[1] - counted[0]):
        range_rows = [row for _, row in members]
        is_range = len(range_rows) > 2
        ranges += [f"{range_rows[0]} to {range_rows[-1]}"] if is_range else map(str, range_rows)
    return _move(problem, file=f"{problem.place.file}, rows {join_words(ranges)}")


class CampaignError(InputError):
    """Files of a user cannot be used; the text has a line for each problem, errors first, both groups with a count."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        """Format as two groups of lines, errors and warnings, each below its number."""
        lines: list[str] = []
        for severity in ("error", "warning"):
            problems = [problem for problem in self.problems if problem.severity == severity]
            if problems:
                plural = "" if len(problems) == 1 else "s"
                lines += [f"{len(problems)} {severity}{plural}:", *in_lines(problems)]
        return "\n".join(lines)


def unknown_word(what: str, word: str, allowed: Iterable[str]) -> str:
    """Return the sentence that a word is not allowed, with the word that was probably meant.

    `what`: What the word names, such as "medium", or where it stands.
    """
    words = tuple(allowed)
    nearest = did_you_mean(word, words)
    return str(Problem("word.unknown", Place(what), word, join_words(words) or "none", nearest))


def did_you_mean(word: str, choices: Iterable[str]) -> str | None:
    """Return the choice that was probably meant, None if none is similar; case, blanks and hyphens do not matter."""
    return _nearest(word[:_LONGEST_COMPARED], tuple(choices))


@lru_cache(maxsize=1024)
def _nearest(word: str, choices: tuple[str, ...]) -> str | None:
    """Return the most similar choice, or None; cached, as a comparison is slow and tables repeat a misspelling."""
    # of choices that are equal but for case, the first
    plain = {_plain(choice): choice for choice in reversed(choices)}
    close_words = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=0.6)
    return plain[close_words[0]] if close_words else None


def _plain(word: str) -> str:
    """Return a word in small letters, with underscores for blanks and hyphens."""
    return word.strip().casefold().replace("-", "_").replace(" ", "_")


def join_words(words: Iterable[str], most: int | None = 12) -> str:
    """Format words as ``a, b, c``: at most the first `most`, and the number of the others; None: all."""
    words = list(words)
    omitted = len(words[most:]) if most else 0
    return ", ".join(words[:most]) + (f" and {omitted} more" if omitted else "")


def shown(text: str) -> str:
    """Return a user's text as a message can show it: cut if it is long, control characters escaped."""
    if len(text) > _LONGEST_SHOWN:
        text = text[: _LONGEST_SHOWN - 3] + "..."
    return escaped(text)


def escaped(text: str) -> str:
    """Return a text with its control characters as escapes, which a terminal would obey."""
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def choose(what: str, word: str, allowed: Sequence[str], hint: str = "") -> str:
    """Return a word if it is allowed, else raise InputError.

    `what`: As in `unknown_word`. `hint`: Words in brackets at the end of the message.
    """
    if word not in allowed:
        raise InputError(unknown_word(what, word, allowed) + (hint and f" ({hint})"))
    return word
