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
from rftfit.cli.output import json_text, say
from rftfit.cli.plan import TARGETS, wanted

if TYPE_CHECKING:
    from collections.abc import Mapping

_POLL_S = 0.5


def watch(
    config: options.ConfigFile = options.CONFIG,
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
        options.number(
            "PERCENT", "End when the target is known so well in every medium: half of its interval."
        ),
    ] = None,
    no_page: Annotated[bool, typer.Option("--no-page", help="Without the live page.")] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the live page; default: a free one.")
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
    from rftfit.bench.server import Page
    from rftfit.bench.watch import Watch

    found = Watch(config, wait, wanted(target))
    page = None if no_page else Page(found.config.parent, port)
    asked = page.asked if page else Signal()

    def tell(kind: str, facts: Mapping[str, Any]) -> None:
        text = json_text({"event": kind, **facts}, indent=None) if as_json else as_text(kind, facts)
        if text:
            say(text)

    if page:
        tell("page", {"address": page.address})
    with suppress(KeyboardInterrupt):
        while True:
            for event in found.step():
                tell(event.kind, event.facts)
                if page and not event.facts.get("first"):
                    page.show(partial(page_of, found), changed=True)
            if page:
                page.show(partial(page_of, found), changed=False)
            widths = [medium.width for medium in found.media.values()]
            if stop is not None and widths and max(widths) <= stop:
                return
            asked.wait(_POLL_S)


def as_text(kind: str, facts: Mapping[str, Any]) -> str:
    """Tell an event to people; empty where it is not worth a line."""
    told = {
        "page": _page,
        "problem": _problem,
        "file": _file,
        "push": _push,
        "withdrawn": _withdrawn,
        "medium": _medium,
    }
    text = told[kind](facts)
    return f"{time.strftime('%H:%M:%S')}  {text}" if text else ""


def _page(facts: Mapping[str, Any]) -> str:
    return f"live page, for this machine alone: {facts['address']}"


def _problem(facts: Mapping[str, Any]) -> str:
    return f"{'solved' if facts['solved'] else facts['severity']}: {facts['text']}"


def _file(facts: Mapping[str, Any]) -> str:
    what = " and ".join(facts["kinds"]) or facts["refused"]
    return f"{facts['file']}: no row of the run sheet names it; {what} log. A row for it has {facts['row']}"


def _withdrawn(facts: Mapping[str, Any]) -> str:
    return f"{facts['run_id']}: withdrawn, {facts['why']}"


def _push(facts: Mapping[str, Any]) -> str:
    from rftfit.measure.alpha import column

    if facts["first"]:
        return ""
    text = f"{facts['run_id']} (row {facts['row']}): {facts['state']}"
    for c in "zx":
        alpha, low, high = (facts[column(c, end)] for end in ("", "_lo", "_hi"))
        if math.isfinite(alpha):
            text += f", alpha_{c} {alpha:.4g} [{low:.4g}, {high:.4g}]"
    if math.isfinite(facts["seconds_since_change"]):
        text += f"; {facts['seconds_since_change']:.1f} s after its last change"
    told = [f"flag: {flag['text']}" for flag in facts["flags"]]
    return "\n".join([text, *(f"          {one}" for one in [*told, facts["reason"]] if one)])


def _medium(facts: Mapping[str, Any]) -> str:
    states = ", ".join(f"{number} {state}" for state, number in facts["states"].items())
    text = f"{facts['medium']}: {states}; {facts['target']} known to {facts['half_width_percent']:.2g} %"
    if math.isfinite(facts["before_percent"]):
        text += f", before {facts['before_percent']:.2g} %"
    pushes = dict.fromkeys(f"({row['beta_deg']}, {row['gamma_deg']})" for row in facts["next"])
    lines = [f"next (beta, gamma), deg: {', '.join(pushes)}"] if pushes else []
    lines += [
        f"check {one['check']} fails, {one['effect']}: {one['sentence']}" for one in facts["checks"]
    ]
    return "\n".join([text, *(f"          {line}" for line in lines)])
