"""The figures on the page: a preview of each, its caption, and where its files are."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.figures.registry import SWEEP, figures
from rftfit.figures.style import FORMATS, size_of_preview

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.figures.registry import Declared
    from rftfit.results import Results

FIRST = (("alpha_maps",), ("legs", "stress_of_runs", "penetration"))
FIRST_OF_FEW = (("estimated_maps",), ("penetration", "stress_of_runs"))
"""Figures beside the findings; what was estimated where few directions were measured."""

FEWEST = 4
"""Directions that make a map."""


@dataclass(frozen=True)
class Picture:
    """One figure: its preview as an address, and ending and path from the page of each file to open."""

    name: str
    caption: str
    section: str
    data: str
    width: int
    height: int
    files: Sequence[tuple[str, str]]


def pictures(results: Results) -> list[Picture]:
    """Every figure that was drawn, in the order in which figures are shown."""
    # their captions are text of the page: a changed one makes it again
    from rftfit.figures import (  # noqa: F401
        generic,
        legs,
        maps,
        plates,
        protocol,
        quality,
        robot,
        sands,
    )

    return [
        _picture(results, one, medium)
        for one in figures()
        if one.group != SWEEP
        for medium in one.media(results.campaign)
        if results.has(f"{one.file(medium)}.webp")
    ]


def first_of(found: Sequence[Picture], results: Results) -> list[Picture]:
    """A map and what was measured, beside the findings: the first that is there of each."""
    known = [int(one.alpha["alpha_z_N_per_cm3"].notna().sum()) for one in results]
    shown = []
    for names in FIRST if max(known, default=0) >= FEWEST else FIRST_OF_FEW:
        # a figure of one medium before that of all
        wanted = [start for name in names for start in (f"{name}_", name)]
        fitting = (one for start in wanted for one in found if one.name.startswith(start))
        shown += [*fitting][:1]
    return shown


def _picture(results: Results, one: Declared, medium: str) -> Picture:
    file = one.file(medium)
    content = results.path(f"{file}.webp").read_bytes()
    width, height = size_of_preview(content)
    return Picture(
        file.rpartition("/")[2],
        one.caption_of(results, medium),
        "quality" if one.folder == "quality" else one.section,
        f"data:image/webp;base64,{base64.b64encode(content).decode()}",
        width,
        height,
        [(ending, f"{file}.{ending}") for ending in FORMATS if ending != "webp"],
    )
