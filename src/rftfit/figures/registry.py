"""Declarations of figures, each beside the function that draws it: rules, captions, page and documentation use them.

A figure is a function of `Results` (and of a medium, where it is drawn for one) that returns a
matplotlib figure, or several pages of one. ``@figure(...)`` gives it its name, what it reads, where
it exists, its caption and its place in the paper. `figures` lists the declarations of all modules. A medium is named by
its key in the config; its title is its name for people.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, wraps
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError
from rftfit.figures.labels import usable_media
from rftfit.figures.style import mark, missing, stamp, styled
from rftfit.measure.flags import format_remarks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.results import Results

MODULES = ("first", "protocol", "plates", "quality", "maps", "generic", "legs", "sands", "robot")
"""Modules of this package with figures, in the order in which the figures are shown."""


def single(campaign: Campaign) -> tuple[str, ...]:  # noqa: ARG001
    """List the media of a figure that is drawn once in every campaign: one empty name, for `DeclaredFigure.media`."""
    return ("",)


def when(condition: Callable[[Campaign], object]) -> Callable[[Campaign], tuple[str, ...]]:
    """Make the function `DeclaredFigure.media` of a figure that is drawn once, and only where the condition holds.

    `condition`: Function of the campaign; anything but 0, None or an empty list counts as True.
    """
    return lambda campaign: ("",) if condition(campaign) else ()


@dataclass(frozen=True)
class DeclaredFigure:
    """Declaration of one figure, made by ``@figure(...)``. Plain functions stand for what depends on the campaign.

    `name`: Name of its files, by what it shows; the medium is appended where the figure is drawn for one, unless
        ``{medium}`` stands in the name.
    `draw`: Function of results and, where the figure is drawn for a medium, of its name, that draws the figure in the
        common style, with marks and stamp, or says what is lacking.
    `reads`: Paths of the files it reads, below ``results/``. ``{medium}`` is the medium of the figure; ``{media}``,
        ``{laboratory}`` and ``{sands}`` stand for one file of each such medium.
    `caption`: What the figure shows and what good data look like, at most 40 words: numbers stand in tables.
        ``{medium}`` becomes the title of the medium, ``{method}`` the name of the fit. Or a function of results and medium.
    `section`: Section of the page.
    `media`: Function that lists the media it is drawn for; ``("",)`` for a figure of the whole campaign, empty for none.
    `paper`: Number of the figure in the paper that it is made after, empty where there is none.
    `lacking`: Function of results and medium that says why there is nothing to draw, empty where there is something. The
        figure then shows these sentences and has no caption.
    `stamped`: Function that says what in the figure is simulated, where logs are; default: all, since it draws only logs.
    `settings`: Sections of the configuration that it depends on.
    `logs`: True where it reads logs.
    `folder`: Its folder below ``results/``.
    `on_demand`: True where ``rftfit sweep`` makes it, and not ``rftfit run``.
    """

    name: str
    draw: Callable[..., Any]
    reads: tuple[str, ...]
    caption: str | Callable[[Results, str], str]
    section: str
    media: Callable[[Campaign], tuple[str, ...]] = single
    paper: str = ""
    lacking: Callable[[Results, str], Sequence[str]] = lambda results, medium: ()  # noqa: ARG005
    stamped: Callable[[Results], str] = lambda results: "simulated logs"  # noqa: ARG005
    settings: tuple[str, ...] = ()
    logs: bool = False
    folder: str = "figures"
    on_demand: bool = False

    @property
    def module(self) -> str:
        """Name of the module in this package that draws it."""
        return self.draw.__module__.rpartition(".")[2]

    @property
    def run(self) -> str:
        """``module:function`` that draws it, by which a job of the workflow finds it."""
        return f"{self.draw.__module__}:{self.draw.__name__}"

    def file(self, medium: str = "") -> str:
        """Return the path of its files below ``results/``, without the ending."""
        if "{medium}" in self.name:
            return f"{self.folder}/{self.name.format(medium=medium)}"
        return f"{self.folder}/{'_'.join(filter(None, (self.name, medium)))}"

    def title_of(self, results: Results, medium: str = "") -> str:
        """Write its name with spaces, and the title of the medium it is drawn for."""
        spaced_name = self.name.replace("{medium}", "").replace("_", " ").strip()
        return ", ".join(filter(None, (spaced_name, results.campaign.titles.get(medium, medium))))

    def caption_of(self, results: Results, medium: str = "") -> str:
        """Write the caption of the figure of these results, as plain text; empty where there is nothing to draw.

        A declared text gets its words in braces replaced and its quantities written with Greek letters; a function has
        written all by itself.
        """
        paper = f" After {self.paper} of the paper." if self.paper else ""
        # where a table is missing or damaged, the caption stays as it is declared
        with suppress(InputError, LookupError, ValueError, TypeError):
            if self.lacking(results, medium):
                return ""
            if callable(self.caption):
                return self.caption(results, medium) + paper
        replacements = {
            "{medium}": results.campaign.titles.get(medium, medium),
            "{method}": results.config.fourier.method,
        }
        # a title may have braces of its own
        caption = greek(str(self.caption)) + paper
        return re.sub(r"\{\w+\}", lambda match: replacements[match[0]], caption)


# `greek` and what it replaces

_GREEK = {
    "alpha": "\u03b1",
    "beta": "\u03b2",
    "gamma": "\u03b3",
    "zeta": "\u03b6",
    "theta": "\u03b8",
    "chi": "\u03c7",
}
_SIGNS = (
    (r"cm\^3", "cm\u00b3"),
    (r"cm\^2", "cm\u00b2"),
    (r"(?<=\d) deg\b", "\u00b0"),
    (r"\+-(?=[ :])", "\u00b1"),
    (r"(?<=[\dm]) x (?=\d)", " \u00d7 "),
)
_QUANTITY = re.compile(rf"\b({'|'.join(_GREEK)})(?![a-z])")
"""A Greek quantity as a word of its own, or before another sign than a small letter: in "alpha_z", not in "alphabet"."""


def greek(text: str) -> str:
    """Write quantities and units with Greek letters and signs, as the figures do."""
    for plain, sign in _SIGNS:
        text = re.sub(plain, sign, text)
    return _QUANTITY.sub(lambda match: _GREEK[match[1]], text)


_DECLARED: list[DeclaredFigure] = []
"""Figures declared so far, in the order in which their modules were imported; `figure` adds to it."""


def figure(
    name: str, *, settings: Sequence[str] = (), **fields: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Declare the decorated function as a figure; `name`, `settings`, `fields`: fields of `DeclaredFigure`.

    Returns a decorator. The function then draws in the common style, adds marks (sentences on media that fail a check)
    and stamps (what is simulated), and says what is lacking instead of drawing. The declaration is added to
    `_DECLARED`.
    """

    def declare(draw: Callable[..., Any]) -> Callable[..., Any]:
        """Declare a function; returns the function that draws in its place, which the declaration holds, too."""

        @styled()
        @wraps(draw)
        def draw_in_style(results: Results, *medium: str) -> Any:
            # `medium`: one name, or none for a figure of the whole campaign
            if sentences := declared.lacking(results, *(medium or ("",))):
                pages = missing(sentences[0], sentences[1:])
            else:
                pages = draw(results, *medium)
            if marks := _describe_marks(results, declared.section, *medium):
                mark(pages, marks)
            if results.campaign.reenacted:
                stamp(pages, declared.stamped(results))
            return pages

        # every figure names the media that fail a check, which depends on section media
        all_settings = tuple(dict.fromkeys([*settings, "media"]))
        declared = DeclaredFigure(name, draw_in_style, settings=all_settings, **fields)
        _DECLARED.append(declared)
        return draw_in_style

    return declare


def _describe_marks(results: Results, section: str, medium: str = "") -> list[str]:
    """Write a sentence about each medium that a figure may show and that fails a check, for `style.mark`.

    `section`: Section of the page with the figure, which tells which media a figure of the whole campaign may show.
    `medium`: Medium of the figure; default: a figure of the whole campaign. Figures of the robot's sweeps give the name
    of a sweep, which is no medium.
    """
    campaign, marks = results.campaign, results.marks
    titles, shown_media = campaign.titles, [*marks]
    if medium in titles:
        shown_media = [medium]
    elif section == "Robot":
        shown_media = [campaign.robot_medium]
    elif section == "Natural sands":
        shown_media = [*campaign.of_role("natural_sand")]
    elif section == "summary" and usable_media(results, titles):
        # the first screen shows unusable media only where no medium is usable
        shown_media = usable_media(results, marks)
    return [
        f"{titles[name]}: {format_remarks(marks[name])}" for name in shown_media if name in marks
    ]


@cache
def figures() -> tuple[DeclaredFigure, ...]:
    """Return all declared figures, in the order in which they are shown; imports the modules that declare them."""
    for module in MODULES:
        import_module(f"rftfit.figures.{module}")
    # sorted by module, since other code may have imported a module earlier
    return tuple(sorted(_DECLARED, key=lambda declared: MODULES.index(declared.module)))
