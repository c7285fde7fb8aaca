"""The gallery: every declared figure from campaigns that were run before, and their pages.

``make gallery`` runs the campaigns into ``docs/_campaigns``; without them the page says so.
"""

from __future__ import annotations

import inspect
import re
import shutil
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from campaigns import FOLDER
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.application import Sphinx

    from rftfit.figures.registry import Declared
    from rftfit.results import Results

SHOWN = {
    "demonstration": "the demonstration: re-enacted logs of the paper's whole campaign",
    "cmu-sand": "the sand example: nine recorded pushes of three round plates, two clocks, no tare",
    "one-push": "one push: the campaign of the tutorial",
}
_ADDRESS = re.compile(r"""(?:href|src)="(?![a-z]+:|#|/)([^"#?]+)""")


class Picture(NamedTuple):
    """A figure of a campaign."""

    campaign: str
    results: Results
    medium: str
    file: str


def campaigns() -> dict[str, Results]:
    """Results of the campaigns that were run to their end."""
    import rftfit

    there = [name for name in SHOWN if (FOLDER / name / "results" / "report.html").is_file()]
    return {name: rftfit.open(FOLDER / name) for name in there}


def pictures(declared: Declared, found: dict[str, Results]) -> list[Picture]:
    """A figure in the campaigns that have it, for the first of the media that it is drawn for."""
    made = []
    for name, results in found.items():
        for medium in declared.media(results.campaign)[:1]:
            file = f"{declared.file(medium)}.webp"
            if (FOLDER / name / "results" / file).is_file():
                made.append(Picture(name, results, medium, file))
    return made


def preview(picture: Picture, folder: Path) -> str:
    """Copy the preview of a figure beside the pages; return its path."""
    source = FOLDER / picture.campaign / "results" / picture.file
    target = folder / f"{picture.campaign}_{source.name}"
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    return f"/_build/gallery/{target.name}"


def text(folder: Path) -> str:
    """Write the page; previews go into `folder`."""
    from rftfit.figures.registry import figures

    found = campaigns()
    made = "## Pages of three campaigns\n\n| campaign | its page |\n|---|---|\n"
    for name, about in SHOWN.items():
        page = f'<a href="campaigns/{name}/report.html">open the page</a>'
        made += f"| {about} | {page if name in found else 'not run here: `make gallery`'} |\n"
    # a figure of the robot is declared for the short sweep and for the full one
    each = {one.run: one for one in reversed(figures())}
    by_section: dict[str, list[Declared]] = {}
    for one in reversed(each.values()):
        by_section.setdefault(one.section, []).append(one)
    made += "\n## Which figure is which\n\n| figure | drawn for | in the paper |\n|---|---|---|\n"
    for one in (one for group in by_section.values() for one in group):
        per = "each medium" if _medium(one) == "medium" else "the campaign"
        made += f"| `{_name(one)}` | {per} | {one.paper or 'not there'} |\n"
    if not found:
        return f"{made}\nTheir pictures are shown where `make gallery` was run before the site was built.\n"
    for section, group in by_section.items():
        shown = [_entry(one, drawn, folder) for one in group if (drawn := pictures(one, found))]
        made += f"\n## {section}\n\n" + "\n".join(shown) if shown else ""
    return made


def _entry(one: Declared, drawn: list[Picture], folder: Path) -> str:
    first = drawn[0]
    titles = [SHOWN[picture.campaign].partition(":")[0] for picture in drawn]
    others = f"; also in {' and '.join(titles[1:])}" if titles[1:] else ""
    medium = f', "{first.medium}"' if _medium(one) else ""
    return f"""### `{_name(one)}`

![{_name(one)}]({preview(first, folder)})

{_plain(one.caption_of(first.results, first.medium))}

From {titles[0]}{others}.

```sh
rftfit run results/{first.file.removesuffix(".webp")}.png
```

```python
import rftfit
from rftfit.figures.{one.module} import {one.draw.__name__}

{one.draw.__name__}(rftfit.open("."){medium})
```
"""


def _name(declared: Declared) -> str:
    word = "<medium>" if _medium(declared) == "medium" else "robot"
    return f"{declared.folder}/{declared.name}".format(medium=word)


def _medium(declared: Declared) -> str:
    """Name of the second argument of what draws a figure; empty if it has none."""
    return next(iter(list(inspect.signature(declared.draw).parameters)[1:]), "")


def _plain(caption: str) -> str:
    return re.sub(r"([*_<$\[\]`|])", r"\\\1", escape(caption, quote=False))


class Gallery(SphinxDirective):
    """Put the gallery where it stands."""

    def run(self) -> list[nodes.Node]:
        """Make the text and parse it as a part of the page."""
        folder = Path(self.env.srcdir) / "_build" / "gallery"
        return self.parse_text_to_nodes(text(folder), allow_section_headings=True)


def _copy(app: Sphinx, error: Exception | None) -> None:
    """Copy the pages of the campaigns, and the files that they link to, into the site."""
    if error is not None or app.builder.format != "html":
        return
    for name in campaigns():
        results = FOLDER / name / "results"
        page = (results / "report.html").read_text(encoding="utf-8")
        linked = {one for one in _ADDRESS.findall(page) if (results / one).is_file()}
        for one in ("report.html", *sorted(linked)):
            target = Path(app.outdir) / "campaigns" / name / one
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(results / one, target)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive; Sphinx calls this."""
    app.add_directive("gallery", Gallery)
    app.connect("env-get-outdated", lambda *_: ["gallery"])
    app.connect("build-finished", _copy, priority=400)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
