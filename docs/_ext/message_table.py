"""The page of all messages: cause, message, cure and test, put together when the site is built."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from message_sites import Site, by_message, find_sites

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PLACES = ("config", "sheet", "logs", "measuring", "fits", "forces", "robot", "lab", "results")
"""Data files, in the order of the page."""


@dataclass(frozen=True)
class Row:
    """One message, and what to do about it.

    Attributes
    ----------
    part : str
        Data file, without its ending.
    message, cause, cure : str
    never : str
        Why no user sees the message; empty for those that can be seen.
    test : str
        One that makes the program say it.
    picked : bool
        Whether the test was named by hand, because no recording can find it.
    """

    part: str
    message: str
    cause: str
    cure: str
    never: str
    test: str
    picked: bool


def load_rows(folder: Path) -> list[Row]:
    """Read the data files.

    Parameters
    ----------
    folder : Path
        With ``<part>.toml`` and ``tests.json``.

    Returns
    -------
    list of Row
        In the order of the files.
    """
    record = folder / "tests.json"
    tests = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}
    return [
        Row(
            part,
            message,
            told.get("cause", ""),
            told.get("cure", ""),
            told.get("never", ""),
            told.get("test", "") or tests.get(message, ""),
            "test" in told,
        )
        for part in PLACES
        for message, told in _read(folder / f"{part}.toml").items()
        if isinstance(told, dict)
    ]


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def page(folder: Path, package: Path) -> str:
    """Write the tables.

    Parameters
    ----------
    folder : Path
        Of the data files.
    package : Path
        Source of the package: a message that it no longer makes is not shown.

    Returns
    -------
    str
        Markdown, a heading before each table.
    """
    made = by_message(find_sites(package))
    rows = [row for row in load_rows(folder) if row.message in made and not row.never]
    lines: list[str] = []
    for part in PLACES:
        head = _read(folder / f"{part}.toml")
        lines += [f"## {head['title']}", "", head["text"], ""]
        lines += ["| what happened | message and its test | what to do |", "|---|---|---|"]
        lines += [_line(row, made[row.message]) for row in rows if row.part == part]
        lines.append("")
    return "\n".join(lines)


def _line(row: Row, sites: list[Site]) -> str:
    code, text = sites[0].code, " ".join(sites[0].text.split())
    message = f"**{_plain(code)}**<br>" if code else ""
    if text != "<allowed>":
        fence = "``" if "`" in text else "`"
        message += (
            f"{fence}{' ' if fence == '``' else ''}{text}{' ' if fence == '``' else ''}{fence}"
        )
    # long names may break, or they would leave the other columns no room
    test = row.test.removeprefix("tests/").replace("_", "\\_<wbr>").replace("::", "::<wbr>")
    cells = [row.cause, f"{message}<br><small>{test}</small>", row.cure]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _plain(text: str) -> str:
    return text.replace("<", "&lt;").replace(">", "&gt;")


def _fill(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put the tables where the page asks for them."""
    if docname == "reference/messages":
        root = Path(app.srcdir).parent
        folder = Path(app.srcdir) / "reference" / "messages"
        package = root / "src" / "rftfit"
        source[0] = source[0].replace("{{ tables }}", page(folder, package))
        # the page is made anew when any of these has changed
        for file in (*folder.iterdir(), *package.rglob("*.py")):
            app.env.note_dependency(str(file))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the page; Sphinx calls this."""
    app.connect("source-read", _fill)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
