"""The build fails where a page would ask the network for a script, a style, a picture or a font."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphinx.errors import ExtensionError

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_TAG = re.compile(r"<(?:script|img|link|iframe|source|video|audio)\b[^>]*>", re.IGNORECASE)
_FAR = re.compile(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", re.IGNORECASE)
_STYLE = re.compile(r"""(?:@import\s+["']?|url\(\s*["']?)(?:https?:)?//[^)"';]+""", re.IGNORECASE)


def far_addresses(folder: Path) -> list[str]:
    """Find what the pages of a folder would fetch from elsewhere; links to follow do not count.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of str
        File and tag or rule.
    """
    found = []
    for path in sorted(folder.rglob("*")):
        if path.suffix == ".html":
            text = path.read_text(encoding="utf-8")
            found += [f"{path.name}: {tag}" for tag in _TAG.findall(text) if _FAR.search(tag)]
        elif path.suffix == ".css":
            text = path.read_text(encoding="utf-8")
            found += [f"{path.name}: {rule}" for rule in _STYLE.findall(text)]
    return found


def _check(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html" and (far := far_addresses(Path(app.outdir))):
        raise ExtensionError("pages would need the network: " + "; ".join(far[:5]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Check when all is written; Sphinx calls this."""
    app.connect("build-finished", _check)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
