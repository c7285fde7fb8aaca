"""Directives of the site that a plain Markdown viewer cannot read stand in comments of the pages.

``<!-- site``, the directive, ``-->``: the build takes the directive for the comment. Other viewers
show what stands around it. The live report lies beside the pages, as in the sources. A link to a
page outside ``docs``, which the site lacks, becomes its text.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_COMMENT = re.compile(r"^<!-- site\n(.*?)^-->\n", re.MULTILINE | re.DOTALL)


_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#\s:]+\.md)\)")


def _adapt_source(app: Sphinx, page: str, source: list[str]) -> None:
    docs = Path(app.srcdir).resolve()
    folder = (docs / page).parent

    def keep_or_unlink(link: re.Match[str]) -> str:
        return link[0] if (folder / link[2]).resolve().is_relative_to(docs) else f"`{link[1]}`"

    source[0] = _LINK.sub(keep_or_unlink, _COMMENT.sub(r"\1", source[0]))


def _copy_live_report(app: Sphinx) -> None:
    if app.builder.format == "html":
        source, target = Path(app.srcdir) / "live", Path(app.outdir) / "live"
        shutil.copytree(source, target, dirs_exist_ok=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register both steps; Sphinx calls this."""
    app.connect("source-read", _adapt_source)
    app.connect("builder-inited", _copy_live_report)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
