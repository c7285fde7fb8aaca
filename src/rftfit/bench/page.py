"""The live page: the state of a watch as html, which is sent to every browser that shows the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from urllib.parse import parse_qs, urlencode

import numpy as np
import pandas as pd

from rftfit.bench.medium import LiveMedium
from rftfit.bench.pictures import draw_heat, draw_stress
from rftfit.bench.watch import REFUSED, Watch
from rftfit.compare.joint import list_untold
from rftfit.directions import number_rows
from rftfit.measure.alpha import column
from rftfit.measure.fits import filed_under

_HEAD = ("row", "run", "state", "beta", "gamma", "alpha_z", "alpha_x", "flags, or why not")


def page_of(watch: Watch, query: str) -> str:
    """Format everything below the heading of the page as html; `query` names the medium and the run to show."""
    if not watch.media:
        return "<p>No run of the run sheet has its logs yet.</p>" + _format_problems(watch)
    asked = {key: values[-1] for key, values in parse_qs(query).items()}
    newest = max(watch.media.values(), key=lambda medium: medium.measured_at)
    medium = watch.media.get(asked.get("medium", ""), newest)
    run = asked["run"] if asked.get("run") in medium.runs else medium.last
    tabs = "".join(
        _format_link(watch.campaign.titles[name], medium is tab_medium, medium=name)
        for name, tab_medium in watch.media.items()
    )
    parts = (
        _format_problems(watch),
        _format_push(watch, medium, run),
        _format_map(watch, medium),
        _format_runs(watch, medium, run),
    )
    return f'<nav aria-label="Media">{tabs}</nav>{"".join(parts)}'


def _format_link(words: str, is_here: bool, **query: str) -> str:
    """Format a link to another view of the page; by its id it keeps the focus when the page is sent anew."""
    where, current_mark = escape(urlencode(query)), " aria-current=true" if is_here else ""
    return f'<a id="{where}" href="?{where}"{current_mark}>{escape(words)}</a>'


def _format_items(words: Iterable[str], kind: str = "") -> str:
    """Format texts as items of a list, empty ones left out; `kind`: class of their style."""
    return "".join(f'<li class="{kind}">{escape(text)}</li>' for text in words if text)


def _format_problems(watch: Watch) -> str:
    """Format problems of config and run sheet, and files that no row names; empty if there are none."""
    loose = (
        f"{facts['file']}: no row names it"
        + (f"; a row for it has {_format_cells(facts['row'])}" if facts["row"] else "")
        for facts in watch.unnamed.values()
        if facts
    )
    lines = _format_items(watch.problems, "bad") + _format_items(loose)
    return f"<h2>To be put right</h2><ul>{lines}</ul>" if lines else ""


def _format_push(watch: Watch, medium: LiveMedium, name: str) -> str:
    """Format the shown push: a picture of its stress with its repeats, its numbers and its flags."""
    if not name or "fits" not in medium.runs[name].rows:
        return ""
    facts, run, measured = watch.facts(medium, name), watch.campaign.by_id[name], medium.runs[name]
    plate = watch.campaign.config.intruders[run.intruder]
    assert plate.shape != "leg"
    same = name_repeats(medium, name, watch.campaign.config.grid.angle_tolerance_deg)
    drawn = draw_stress(
        measured, plate.area_cm2, filed_under(run)[2], [medium.runs[key] for key in same]
    )
    numbers = "".join(
        f'<li class="{c}">alpha_{c} = {facts[column(c)]:.4g} '
        f"[{facts[column(c, '_lo')]:.4g}, {facts[column(c, '_hi')]:.4g}] N/cm³</li>"
        for c in "zx"
        if np.isfinite(facts[column(c)])
    )
    bad = _format_items([*(flag["text"] for flag in facts["flags"]), facts["reason"]], "bad")
    has_delay = np.isfinite(medium.seconds) and name == medium.last
    soft = f"Shown after {medium.seconds:.1f} s." if has_delay else ""
    soft += f" Repeats, dashed: {', '.join(same)}." if same else ""
    what = "Last push" if name == medium.last else "Push"
    return (
        f"<h2>{what}: {escape(name)}, {facts['state']}</h2><div class=row><div>{drawn}</div><div>"
        f"<p>beta {facts['beta_deg']:g}, gamma {facts['gamma_deg']:.4g} deg, {facts['direction']}</p>"
        f"<ul>{numbers}{bad}</ul><p class=soft>{escape(soft)}</p></div></div>"
    )


def _format_cells(row: Mapping[str, object]) -> str:
    """Format the cells of a row of the run sheet, each after the name of its column."""
    cells = (
        f"{name} {cell:.4g}" if isinstance(cell, float) else f"{name} {cell}"
        for name, cell in row.items()
        if cell not in ("", None)
    )
    return ", ".join(cells)


def name_repeats(medium: LiveMedium, name: str, tolerance_deg: float) -> list[str]:
    """Name the other runs of the direction and kind of motion of a run."""
    fits = {key: run.rows["fits"] for key, run in medium.runs.items() if "fits" in run.rows}
    number = number_rows(pd.DataFrame([*fits.values()]), tolerance_deg)
    cells = {
        key: (int(number[index]), fit["direction"]) for index, (key, fit) in enumerate(fits.items())
    }
    return [key for key, cell in cells.items() if cell == cells[name] and key != name]


def _format_map(watch: Watch, medium: LiveMedium) -> str:
    """Format the target and its interval, failed checks, the verdict, the map, and the next pushes."""
    summary = watch.summary(medium)
    checks = (
        f"{check['check']}, {check['effect']}: {check['sentence']}" for check in summary["checks"]
    )
    plates = sum(run.kind == "plate" for run in watch.campaign.runs_of(medium.name))
    untold = escape(f"No check can tell: {'; '.join(list_untold(plates))}.")
    width, pictures = "No push tells of it yet", ""
    if np.isfinite(medium.width):
        width = f"Half width of the interval: +-{medium.width:.2g} %".replace(
            "+-", "\N{PLUS-MINUS SIGN}"
        )
    if abs(medium.before - medium.width) > 0:  # False if one is NaN
        change = "narrowed" if medium.width < medium.before else "widened"
        width += f"; the last push {change} it from {medium.before:.2g} %"
    if medium.map is not None:
        table = medium.map.table()
        for error in (False, True):
            pictures += "".join(
                draw_heat(table, c, None if error else medium.plan, error=error) for c in "zx"
            )
    rows = summary["next"]
    sheet = "\n".join(
        [",".join(row) for row in rows[:1]] + [",".join(row.values()) for row in rows]
    )
    return (
        f"<h2>{escape(summary['target'])} of {escape(medium.name)}</h2><ul>{_format_items(checks, 'bad')}</ul>"
        f"<p>{escape(summary['verdict'])}</p><p>{untold}</p><p>{width}.</p><div class=maps>{pictures}</div><h2>Next pushes, as rows for the run sheet</h2>"
        f'<pre class="wide" tabindex="0" role="region" aria-label="Next pushes">{escape(sheet)}</pre>'
    )


def _format_runs(watch: Watch, medium: LiveMedium, shown: str) -> str:
    """Format the table of runs, the last row of the run sheet first; `shown`: run that the page shows."""
    rows = []
    for name, row in sorted(
        watch.rows[medium.name].items(), key=lambda name_and_row: -name_and_row[1].run.row
    ):
        state, measured = watch.state(medium.name, name), medium.runs.get(name)
        fit = measured.rows.get("fits", {}) if measured else {}
        words = "; ".join(measured.doubts) or measured.why if measured else ""
        numbers = (
            fit.get(key, np.nan) for key in ("beta_deg", "gamma_deg", column("z"), column("x"))
        )
        cells = [f"{value:.4g}" if np.isfinite(value) else "" for value in numbers]
        link = (
            _format_link(name, name == shown, medium=medium.name, run=name) if fit else escape(name)
        )
        kind = ' class="bad"' if words or state == REFUSED else ""
        rows.append(
            f"<tr><td>{row.run.row}<td>{link}<td{kind}>{state}<td>{'<td>'.join(cells)}"
            f'<td class="words">{escape(words)}'
        )
    head = "".join(f'<th scope="col">{heading}</th>' for heading in _HEAD)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    return (
        f'<h2>Runs</h2><div class="wide" tabindex="0" role="region" aria-label="Runs">{table}</div>'
    )
