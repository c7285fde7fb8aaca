"""One problem of the input, said so that a student can act on it."""

from __future__ import annotations

import difflib
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


# --- Names that some file systems cannot tell apart or will not have; text that nothing can show.


_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$"]
    + [f"{port}{number}" for port in ("com", "lpt") for number in "0123456789\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}"]
)  # fmt: skip
DEVICE = "a name that is no device of Windows, where it could not be a file"
"""What is allowed instead."""


def is_device(name: str) -> bool:
    """Whether Windows takes a name, whatever its ending, for a device and not a file.

    `name`: Without a folder.
    """
    return name.partition(".")[0].rstrip(" ").casefold() in _DEVICES


def folded(path: str) -> str:
    """Return what names have in common that some disks take for the same.

    Returns without the difference of upper and lower case, and of accents written in one or two
    signs.
    """
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def unshowable(text: str) -> str:
    """Find the first sign that neither a page nor a drawing can show.

    Returns A control character (tabs and line ends are none here) or half a pair; empty if there
    is none.
    """
    if text.isprintable():
        return ""
    signs = (
        sign for sign in text if sign not in "\t\n" and unicodedata.category(sign) in ("Cc", "Cs")
    )
    return next(signs, "")


# --- One problem of the configuration or the run sheet, said so that a student can act on it.


_LONGEST_SHOWN = 80
_LONGEST_COMPARED = 64
_LINE_AND_COLUMN = frozenset({"config.not-yaml", "config.alias", "config.tag", "config.control"})
_JOINTS = str.maketrans("- ", "__")


@dataclass(frozen=True)
class Problem:
    """What is wrong at one place.

    `file`: Path as the user knows it, relative to the campaign's folder where possible.
    `row`: Row of the run sheet as a spreadsheet numbers it (header: 1), or line of the
        configuration.
    `column`: Column of the run sheet, key of the configuration, or column of a YAML syntax error.
    `found`: The offending text; None where there is none.
    `allowed`: What would be right; the whole message where `found` is None.
    `code`: Stable name of this sort of problem, for example ``sheet.unknown-word``.
    `nearest`: The valid word that was probably meant.
    """

    file: str
    row: int | None
    column: str | None
    found: str | None
    allowed: str
    code: str
    severity: Literal["error", "warning"] = "error"
    nearest: str | None = None

    def __str__(self) -> str:
        in_config = self.code.startswith("config.")
        place = self.file
        if self.row is not None:
            place += f", {'line' if in_config else 'row'} {self.row}"
        if self.column is not None:
            is_key = in_config and self.code not in _LINE_AND_COLUMN
            place += f", {'key' if is_key else 'column'} {shown(self.column)}"
        if self.found is None:
            text = f"{place}: {self.allowed}"
        else:
            text = f"{place}: found '{shown(self.found)}'; allowed: {self.allowed}"
        if self.nearest is not None:
            text += f"; did you mean '{shown(self.nearest)}'?"
        # names of media and parser messages too may hold what a terminal would act on
        return escaped(text)


class CampaignError(InputError):
    """The campaign cannot be used; the text is every problem, a line each.

    `problems`: Errors and warnings, in the order in which they are to be shown.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        lines: list[str] = []
        for severity in ("error", "warning"):
            of_this = [str(problem) for problem in self.problems if problem.severity == severity]
            if of_this:
                plural = "" if len(of_this) == 1 else "s"
                lines += [f"{len(of_this)} {severity}{plural}:", *of_this]
        return "\n".join(lines)


def shown(text: str) -> str:
    """Make `text` fit to be shown: long text cut, control characters escaped."""
    if len(text) > _LONGEST_SHOWN:
        text = text[: _LONGEST_SHOWN - 3] + "..."
    return escaped(text)


def escaped(text: str) -> str:
    """Write control characters of `text` as escapes."""
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode("ascii")
        for char in text
    )


def listed(words: Iterable[str], most: int = 12) -> str:
    """Write `words` as ``a, b, c``, the first `most` of them."""
    words = list(words)
    rest = len(words) - most
    return ", ".join(words[:most]) + (f" and {rest} more" if rest > 0 else "")


def did_you_mean(word: str, choices: Iterable[str]) -> str | None:
    """Find the choice that was probably meant by `word`.

    Returns none when nothing comes near; case, blanks and hyphens count for little.
    """
    return _nearest(word[:_LONGEST_COMPARED], tuple(choices))


@lru_cache(maxsize=1024)
def _nearest(word: str, choices: tuple[str, ...]) -> str | None:
    plain = {_plain(choice): choice for choice in reversed(choices)}
    found = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=0.6)
    return plain[found[0]] if found else None


def _plain(word: str) -> str:
    return word.strip().casefold().translate(_JOINTS)


def choose(what: str, word: str, allowed: Sequence[str], more: str = "") -> str:
    """Check a word against the allowed ones, and return it.

    `what`: Its option or name, for the message. `more`: Said after the allowed words.
    """
    if word in allowed:
        return word
    nearest = did_you_mean(word, allowed)
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    raise InputError(
        f"{what}: found '{shown(word)}'; allowed: {listed(allowed)}{hint}{more and f' ({more})'}"
    )
