"""``rftfit watch``: options; the loop that looks, prints events and sends the live page; see `rftfit.bench`."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from threading import Event as Signal
from typing import Annotated

import typer

from rftfit.cli import options
from rftfit.cli.output import json_text, print_line
from rftfit.cli.plan import TARGETS, find_target

_POLL_S = 0.5
"""Longest time between two readings of the folders, s."""


def watch(
    config: options.CampaignConfig = options.CONFIG,
    target: Annotated[
        str, typer.Option(help=f"What the next pushes are to tell: {', '.join(TARGETS)}.")
    ] = "map",
    wait: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=60,
            metavar="SECONDS",
            help="A log counts when its files have not changed for so long.",
        ),
    ] = 1.0,
    stop: Annotated[
        float | None,
        options.number_option(
            "PERCENT", "End when the target is known so well in every medium: half of its interval."
        ),
    ] = None,
    no_page: Annotated[bool, typer.Option("--no-page", help="Without the live page.")] = False,
    port: Annotated[
        int,
        typer.Option(
            min=0, max=65535, show_default=False, help="Port of the live page; default: a free one."
        ),
    ] = 0,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print a JSON object a line, for a program that runs the rig."),
    ] = False,
) -> None:
    """Watch a campaign while it is recorded: each push is judged as soon as its logs are still, and the next one is chosen.

    Nothing is written below `results/`; `rftfit run` makes the same numbers later. The live page is for
    this machine alone. Ctrl-C ends it.
    """
    from rftfit.bench.events import Event
    from rftfit.bench.page import page_of
    from rftfit.bench.server import LivePage
    from rftfit.bench.watch import Watch

    watched = Watch(config, wait, find_target(target, options.BodyOptions(), options.MeshOptions()))
    page = None if no_page else LivePage(port)
    # set by the page's server when a browser asks; without a page never
    page_is_asked = page.asked if page else Signal()

    def print_event(event: Event) -> None:
        """Print an event as a sentence, or as one line of JSON."""
        # empty for an event that needs no line
        sentence = json_text(event.as_dict(), indent=None) if as_json else event.summary()
        if sentence:
            print_line(sentence)

    if page:
        print_event(Event("page", {"address": page.address}))
    with suppress(KeyboardInterrupt):
        while True:
            for event in watched.step():
                print_event(event)
                # pushes before the first alpha of a medium may be many: the page shows them
                # together, below
                if page and not event.facts.get("first"):
                    page.show(partial(page_of, watched), changed=True)
            if page:
                page.show(partial(page_of, watched), changed=False)
            media = watched.media.values()
            if stop is not None and media and all(medium.width <= stop for medium in media):
                return
            # a browser that asks for the page is not kept waiting
            page_is_asked.wait(_POLL_S)
