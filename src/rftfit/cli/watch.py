"""``rftfit watch``: measure while the campaign is recorded, and say which push to make next."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from functools import partial
from threading import Event as Signal
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rftfit.cli import options
from rftfit.cli.output import json_text, print_line
from rftfit.cli.plan import TARGETS, wanted

if TYPE_CHECKING:
    from collections.abc import Mapping

_POLL_S = 0.5


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
    from rftfit.bench.page import page_of
    from rftfit.bench.server import LivePage
    from rftfit.bench.watch import Watch

    watched = Watch(config, wait, wanted(target, options.BodyOptions()))
    page = None if no_page else LivePage(port)
    asked = page.asked if page else Signal()

    def tell(kind: str, facts: Mapping[str, Any]) -> None:
        text = (
            json_text({"event": kind, **facts}, indent=None)
            if as_json
            else format_event(kind, facts)
        )
        if text:
            print_line(text)

    if page:
        tell("page", {"address": page.address})
    with suppress(KeyboardInterrupt):
        while True:
            for event in watched.step():
                tell(event.kind, event.facts)
                if page and not event.facts.get("first"):
                    page.show(partial(page_of, watched), changed=True)
            if page:
                page.show(partial(page_of, watched), changed=False)
            media = watched.media.values()
            if stop is not None and media and all(medium.width <= stop for medium in media):
                return
            asked.wait(_POLL_S)


def format_event(kind: str, facts: Mapping[str, Any]) -> str:
    """Tell an event to people; empty where it is not worth a line."""
    lines: list[str] = []
    if kind == "page":
        lines = [f"live page, for this machine alone: {facts['address']}"]
    elif kind == "problem":
        lines = [f"{'solved' if facts['solved'] else facts['severity']}: {facts['text']}"]
    elif kind == "file":
        lines = [f"{facts['file']}: no row of the run sheet names it, so it is not opened"]
        lines += [f"a row for it has {facts['row']}"] if facts["row"] else []
    elif kind == "withdrawn":
        lines = [f"{facts['run_id']}: withdrawn, {facts['why']}"]
    elif kind == "push" and not facts["first"]:
        text = f"{facts['run_id']} (row {facts['row']}): {facts['state']}"
        for c in "zx":
            alpha, low, high = (facts[f"alpha_{c}{end}_N_per_cm3"] for end in ("", "_lo", "_hi"))
            text += (
                f", alpha_{c} {alpha:.4g} [{low:.4g}, {high:.4g}]" if math.isfinite(alpha) else ""
            )
        late = facts["seconds_since_change"]
        text += f"; {late:.1f} s after its last change" if math.isfinite(late) else ""
        lines = [text, *(f"flag: {flag['text']}" for flag in facts["flags"]), facts["reason"]]
    elif kind == "medium":
        states = ", ".join(f"{number} {state}" for state, number in facts["states"].items())
        width, before = facts["half_width_percent"], facts["before_percent"]
        text = f"{facts['medium']}: {states}"
        text += f"; {facts['target']} +-{width:.2g} %" if math.isfinite(width) else ""
        text += f", before {before:.2g} %" if math.isfinite(before) else ""
        pushes = dict.fromkeys(f"({row['beta_deg']}, {row['gamma_deg']})" for row in facts["next"])
        next_pushes = f"next (beta, gamma), deg: {', '.join(pushes)}" if pushes else ""
        lines = [text, facts["verdict"], next_pushes]
        lines += [
            f"check {check['check']} fails, {check['effect']}: {check['sentence']}"
            for check in facts["checks"]
        ]
    return time.strftime("%H:%M:%S  ") + "\n          ".join(filter(None, lines)) if lines else ""
