"""Events that a watch reports, their kinds and facts: as text for people, as a dictionary for programs."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from rftfit.conventions import COMPONENTS
from rftfit.measure.alpha import column


class Event(NamedTuple):
    """Something new in a campaign that is watched; the keys of `facts` depend on `kind`.

    ``page``: the live page is there: ``address``. ``problem``: of config or run sheet, new or ``solved`` (bool): ``text``,
    ``severity``, ``code``, ``row``. ``file``: one that no row names: ``file``, and ``row``, cells that would name it.
    ``push``: a run was measured: `Watch.facts`, and ``first``, True for a run that was there when the watch began.
    ``withdrawn``: the result of a run is not valid any more: ``medium``, ``run_id``, ``why``. ``medium``: a medium has new
    runs: `Watch.summary`.
    """

    kind: str
    facts: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return kind and facts in one dictionary."""
        return {"event": self.kind, **self.facts}

    def summary(self) -> str:
        """Format an event for people as one text, its first line with the time of day; empty for an event that needs none."""
        kind, facts = self
        lines: list[str] = []
        if kind == "page":
            lines = [f"live page, for this machine alone: {facts['address']}"]
        elif kind == "problem":
            lines = [f"{'solved' if facts['solved'] else facts['severity']}: {facts['text']}"]
        elif kind == "file":
            lines = [f"{facts['file']}: no row of the run sheet names it, so it is not opened"]
            lines += [f"a row for it has {format_cells(facts['row'])}"] if facts["row"] else []
        elif kind == "withdrawn":
            lines = [f"{facts['run_id']}: withdrawn, {facts['why']}"]
        # a push that was already there when the watch began needs no line: its medium has one
        elif kind == "push" and not facts["first"]:
            lines = _describe_push(facts)
        elif kind == "medium":
            lines = _describe_medium(facts)
        if not lines:
            return ""
        return time.strftime("%H:%M:%S  ") + "\n          ".join(filter(None, lines))


def _describe_push(facts: Mapping[str, Any]) -> list[str]:
    """Format the result of a push as lines: state and alpha, each flag, and why it has no number (empty: it has)."""
    result = f"{facts['run_id']} (row {facts['row']}): {facts['state']}"
    result += "".join(f", alpha_{c} {alpha}" for c, alpha in format_alpha(facts).items())
    delay_s = facts["seconds_since_change"]
    result += f"; {delay_s:.1f} s after its last change" if math.isfinite(delay_s) else ""
    return [result, *(f"flag: {flag['text']}" for flag in facts["flags"]), facts["reason"]]


def _describe_medium(facts: Mapping[str, Any]) -> list[str]:
    """Format the state of a medium as lines: its runs and target, verdict, next pushes, and failed checks; some are empty."""
    states = ", ".join(f"{number} {state}" for state, number in facts["states"].items())
    width, before = facts["half_width_percent"], facts["before_percent"]
    state = f"{facts['medium']}: {states}"
    state += f"; {facts['target']} +-{width:.2g} %" if math.isfinite(width) else ""
    state += f", before {before:.2g} %" if math.isfinite(before) else ""
    # a push and its tare, or several depths, have one direction
    directions = dict.fromkeys(f"({row['beta_deg']}, {row['gamma_deg']})" for row in facts["next"])
    next_pushes = f"next (beta, gamma), deg: {', '.join(directions)}" if directions else ""
    failed_checks = (
        f"check {check['check']} fails, {check['effect']}: {check['sentence']}"
        for check in facts["checks"]
    )
    return [state, facts["verdict"], next_pushes, *failed_checks]


def format_alpha(facts: Mapping[str, Any]) -> dict[str, str]:
    """Format alpha of a push and its interval, N/cm^3, by component, z and x; a component without a number is left out.

    `facts`: Those of an event on a push.
    """
    numbers = {c: [facts[column(c, end)] for end in ("", "_lo", "_hi")] for c in COMPONENTS}
    return {
        c: f"{alpha:.4g} [{low:.4g}, {high:.4g}]"
        for c, (alpha, low, high) in numbers.items()
        if math.isfinite(alpha)
    }


def format_cells(row: Mapping[str, str]) -> str:
    """Format the cells of a row of the run sheet, each after the name of its column, as "run_id p01, kind plate"."""
    return ", ".join(f"{name} {cell}" for name, cell in row.items())
