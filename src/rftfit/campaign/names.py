"""Names that some file systems cannot tell apart or will not have; text that nothing can show."""

from __future__ import annotations

import unicodedata

_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$"]
    + [f"{port}{number}" for port in ("com", "lpt") for number in "0123456789\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}"]
)  # fmt: skip
DEVICE = "a name that is no device of Windows, where it could not be a file"
"""What is allowed instead."""


def is_device(name: str) -> bool:
    """Whether Windows takes a name, whatever its ending, for a device and not a file.

    Parameters
    ----------
    name : str
        Without a folder.

    Returns
    -------
    bool
    """
    return name.partition(".")[0].rstrip(" ").casefold() in _DEVICES


def folded(path: str) -> str:
    """Return what names have in common that some disks take for the same.

    Parameters
    ----------
    path : str

    Returns
    -------
    str
        Without the difference of upper and lower case, and of accents written in one or two signs.
    """
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def unshowable(text: str) -> str:
    """Find the first sign that neither a page nor a drawing can show.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
        A control character (tabs and line ends are none here) or half a pair; empty if there is none.
    """
    if text.isprintable():
        return ""
    signs = (
        sign for sign in text if sign not in "\t\n" and unicodedata.category(sign) in ("Cc", "Cs")
    )
    return next(signs, "")
