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

FIRST = (("alpha_maps", "estimated_maps"), ("legs", "stress_of_runs", "penetration"))
"""Figures beside the findings: of each group the first that is there."""


FEWEST = 4
"""Directions that make a map."""


@dataclass(frozen=True)
class Picture:
    """One figure.

    `name`: Of its files. `data`: The preview, as an address. `width`, `height`: Of the preview.
    `files`: Ending and path from the page of each file to open.
    """

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
    """The figures beside the findings: what was estimated where few directions were measured."""
    known = [int(one.alpha["alpha_z_N_per_cm3"].notna().sum()) for one in results]
    few = max(known, default=0) < FEWEST
    shown = []
    for names in FIRST:
        ordered = names[::-1] if few else names
        fitting = [
            one for name in ordered for one in found if f"{one.name}_".startswith(f"{name}_")
        ]
        # that of one medium rather than of all
        fitting.sort(key=lambda one: one.name in names and not few)
        shown += fitting[:1]
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
