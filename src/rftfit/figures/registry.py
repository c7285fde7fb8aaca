"""Figures, declared once beside what draws them: tasks, captions, page and documentation follow.

A figure is a function of `Results` (and of a medium, where it is drawn for one) that returns a
matplotlib figure, or several pages of one. ``@figure(...)`` gives it its name, what it reads, where
it exists, its caption and its place in the paper.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, wraps
from importlib import import_module
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

from rftfit.errors import InputError
from rftfit.figures.labels import usable_media
from rftfit.figures.style import mark, missing, stamp, styled
from rftfit.measure.flags import format_remarks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.results import Results

P = ParamSpec("P")
R = TypeVar("R")

MODULES = ("first", "protocol", "plates", "quality", "maps", "generic", "legs", "sands", "robot")
"""Of this package, in the order in which their figures are shown."""


@dataclass(frozen=True)
class Declared:
    """One figure.

    `name`: Of its files, by what it shows; the medium is added where it is drawn for one, unless
        ``{medium}`` stands in the name.
    `draw`: Function that draws it.
    `reads`: Below ``results/``. ``{medium}`` is the figure's own; ``{media}``, ``{laboratory}`` and ``{sands}``
        stand for all of these.
    `caption`: What is seen and what good looks like, at most 40 words: numbers stand in tables.
        ``{medium}`` is its title, ``{method}`` that of the fit; or a function of results and medium.
    `section`: Of the page.
    `media`: The media it is drawn for; ``("",)`` for a single one, nothing where it does not exist.
    `paper`: Number of the paper's figure that it is made after, empty where there is none.
    `lacking`: Why there is nothing to see, of results and medium, empty where there is something; else the
        figure says so and has no caption.
    `stamped`: What of it is simulated, of results whose logs are; all that it draws is from these logs, unless stated.
    `settings`: Sections of the configuration that it depends on.
    `logs`: Whether it reads logs.
    `folder`: Below ``results/``.
    `on_demand`: Whether ``rftfit sweep`` makes it, and not ``rftfit run``.
    """

    name: str
    draw: Callable[..., Any]
    reads: tuple[str, ...]
    caption: str | Callable[[Results, str], str]
    section: str
    media: Callable[[Campaign], tuple[str, ...]]
    paper: str = ""
    lacking: Callable[[Results, str], Sequence[str]] = lambda results, medium: ()  # noqa: ARG005
    stamped: Callable[[Results], str] = lambda results: "simulated logs"  # noqa: ARG005
    settings: tuple[str, ...] = ()
    logs: bool = False
    folder: str = "figures"
    on_demand: bool = False

    @property
    def module(self) -> str:
        """Name of its module in this package."""
        return self.draw.__module__.rpartition(".")[2]

    @property
    def run(self) -> str:
        """``module:function`` of what draws it."""
        return f"{self.draw.__module__}:{self.draw.__name__}"

    def file(self, medium: str = "") -> str:
        """Path below ``results/`` without the ending."""
        if "{medium}" in self.name:
            return f"{self.folder}/{self.name.format(medium=medium)}"
        name = "_".join(word for word in (self.name, medium) if word)
        return f"{self.folder}/{name}"

    def caption_of(self, results: Results, medium: str = "") -> str:
        """Write the caption for a run, as plain text; empty where there is nothing to see."""
        paper = f" After {self.paper} of the paper." if self.paper else ""
        # no table, or an odd one: the caption stands as it is
        with suppress(InputError, LookupError, ValueError, TypeError):
            if self.lacking(results, medium):
                return ""
            if callable(self.caption):
                return self.caption(results, medium) + paper
        words = {
            "{medium}": results.campaign.titles.get(medium, medium),
            "{method}": results.config.fourier.method,
        }
        # a title may have braces of its own
        return re.sub(r"\{\w+\}", lambda match: words[match[0]], greek(str(self.caption)) + paper)


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


def greek(text: str) -> str:
    """Write quantities and units with Greek letters and signs, as the figures do."""
    for plain, sign in _SIGNS:
        text = re.sub(plain, sign, text)
    return _QUANTITY.sub(lambda match: _GREEK[match[1]], text)


_DECLARED: list[Declared] = []


def single(campaign: Campaign) -> tuple[str, ...]:  # noqa: ARG001
    """The figure exists once in every campaign."""
    return ("",)


def when(condition: Callable[[Campaign], object]) -> Callable[[Campaign], tuple[str, ...]]:
    """The figure exists once in a campaign that has what it shows."""
    return lambda campaign: ("",) if condition(campaign) else ()


def figure(name: str, **facts: Any) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare a figure; the arguments are the fields of `Declared`. It is drawn in the common style."""
    lacking = facts.get("lacking", Declared.lacking)
    stamped = facts.get("stamped", Declared.stamped)

    def declare(draw: Callable[P, R]) -> Callable[P, R]:
        @styled()
        @wraps(draw)
        def inside(*args: P.args, **kwargs: P.kwargs) -> R:
            arguments: Any = args
            results, *medium = arguments
            words = lacking(results, *(medium or [""]))
            drawn_figures = (
                cast("R", missing(words[0], words[1:])) if words else draw(*args, **kwargs)
            )
            if marks := _marks(results, facts["section"], *medium):
                mark(drawn_figures, marks)
            if results.campaign.reenacted:
                stamp(drawn_figures, stamped(results))
            return drawn_figures

        # the media that fail a check are named in every figure
        settings = {"settings": tuple(dict.fromkeys([*facts.get("settings", ()), "media"]))}
        _DECLARED.append(Declared(name=name, draw=inside, **{"media": single} | facts | settings))
        return inside

    return declare


def _marks(results: Results, section: str, medium: str = "") -> list[str]:
    """What is to be said of the media that a figure may show, of those that fail a check."""
    campaign, marks = results.campaign, results.marks
    titles, shown_media = campaign.titles, list(marks)
    if medium in titles:
        shown_media = [medium]
    elif section in ("Robot", "Natural sands"):
        robot = (campaign.robot_medium,)
        shown_media = [*(robot if section == "Robot" else campaign.of_role("natural_sand"))]
    elif section == "summary":
        shown_media = (
            usable_media(results, shown_media)
            if usable_media(results, campaign.titles)
            else shown_media
        )
    return [
        f"{titles[name]}: {format_remarks(marks[name])}" for name in shown_media if name in marks
    ]


@cache
def figures() -> tuple[Declared, ...]:
    """Every figure, in the order in which they are shown."""
    for module in MODULES:
        import_module(f"rftfit.figures.{module}")
    # by module, whichever was imported first
    return tuple(sorted(_DECLARED, key=lambda declared: MODULES.index(declared.module)))
