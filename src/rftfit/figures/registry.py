"""Figures, declared once beside what draws them: rules, captions, page and documentation follow.

A figure is a function of `Results` (and of a medium, where it is drawn for one) that returns a
matplotlib figure, or several pages of one. ``@figure(...)`` gives it its name, what it reads, where
it exists, its caption and its place in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.campaign.load import Campaign

MODULES: tuple[str, ...] = ()
"""Of this package, in the order in which their figures are shown."""


@dataclass(frozen=True)
class Declared:
    """One figure.

    `name`: Of its files, by what it shows; the medium is added where it is drawn for one.
    `draw`: Function that draws it.
    `reads`: Below ``results/``, as `rftfit.workflow.stages.Stage.reads`.
    `media`: The media it is drawn for; ``("",)`` for a single one, nothing where it does not exist.
    `caption`: What is seen and what good looks like; words in braces come from `numbers`.
    `paper`: Number of the paper's figure, empty where it has none.
    `section`: Of the page.
    `settings`, `logs`: As `rftfit.workflow.stages.Stage`.
    `group`: The stage that draws it.
    `folder`: Below ``results/``.
    """

    name: str
    draw: Callable[..., Any]
    reads: tuple[str, ...]
    media: Callable[[Campaign], tuple[str, ...]]
    caption: str
    section: str
    paper: str = ""
    numbers: Callable[..., dict[str, str]] | None = None
    settings: tuple[str, ...] = ()
    logs: bool = False
    group: str = "figures"
    folder: str = "figures"

    @property
    def run(self) -> str:
        """``module:function`` of what draws it."""
        return f"{self.draw.__module__}:{self.draw.__name__}"

    def file(self, medium: str = "") -> str:
        """Path below ``results/`` without the ending."""
        name = "_".join(part for part in (self.name, medium) if part)
        return f"{self.folder}/{name}"


_DECLARED: dict[str, Declared] = {}


def once(campaign: Campaign) -> tuple[str, ...]:  # noqa: ARG001
    """The figure exists once in every campaign."""
    return ("",)


def figure(name: str, **facts: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Declare a figure; the arguments are the fields of `Declared`."""

    def declare(draw: Callable[..., Any]) -> Callable[..., Any]:
        _DECLARED[name] = Declared(name=name, draw=draw, **{"media": once} | facts)
        return draw

    return declare


@cache
def figures() -> tuple[Declared, ...]:
    """Every figure, in the order in which they are shown."""
    for module in MODULES:
        import_module(f"rftfit.figures.{module}")
    return tuple(_DECLARED.values())
