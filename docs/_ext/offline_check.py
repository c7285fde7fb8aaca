"""The build fails where a page would ask the network for something, or a link of the site leads nowhere."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from sphinx.errors import ExtensionError

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_TAG = re.compile(r"<(?:script|img|link|iframe|source|video|audio)\b[^>]*>", re.IGNORECASE)
_FAR = re.compile(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", re.IGNORECASE)
_STYLE = re.compile(r"""(?:@import\s+["']?|url\(\s*["']?)(?:https?:)?//[^)"';]+""", re.IGNORECASE)


def far_addresses(folder: Path) -> list[str]:
    """Find what the pages of a folder would fetch from elsewhere; links to follow do not count."""
    addresses = []
    for path in sorted(folder.rglob("*")):
        if path.suffix == ".html":
            text = path.read_text(encoding="utf-8")
            addresses += [f"{path.name}: {tag}" for tag in _TAG.findall(text) if _FAR.search(tag)]
        elif path.suffix == ".css":
            text = path.read_text(encoding="utf-8")
            addresses += [f"{path.name}: {rule}" for rule in _STYLE.findall(text)]
    return addresses


_LINK = re.compile(
    r"""<(?:a|img|link|script)\b[^>]*?\b(?:href|src)="(?![a-z]+:|//)([^"?#]*)(?:#([^"]*))?[^"]*\""""
)
_ID = re.compile(r"""\bid="([^"]+)\"""")


def dead_links(folder: Path) -> list[str]:
    """Find the links between the pages of a folder whose file, or place in it, is not there."""
    pages = {path.resolve(): path.read_text(encoding="utf-8") for path in folder.rglob("*.html")}
    places = {
        path: {unescape(place) for place in _ID.findall(text)} for path, text in pages.items()
    }
    dead = []
    for path, text in sorted(pages.items()):
        for address, place in sorted({(link[1], link[2] or "") for link in _LINK.finditer(text)}):
            target = (path.parent / unquote(unescape(address))).resolve() if address else path
            is_there = target.exists() and (
                not place or unescape(place) in places.get(target, {place})
            )
            if not is_there:
                dead.append(f"{path.name}: {address}{place and '#'}{place or ''}")
    return dead


def _check(app: Sphinx, error: Exception | None) -> None:
    if error is not None or app.builder.format != "html":
        return
    if far := far_addresses(Path(app.outdir)):
        raise ExtensionError("pages would need the network: " + "; ".join(far[:5]))
    if dead := dead_links(Path(app.outdir)):
        raise ExtensionError("links that lead nowhere: " + "; ".join(dead[:5]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Check when all is written; Sphinx calls this."""
    app.connect("build-finished", _check)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
