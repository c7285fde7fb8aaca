"""Content of the live page of a watch, as html: media, the push shown, map, next pushes, table of runs.

It is sent anew to every browser that shows the page (`rftfit.bench.server`) whenever something changes.
"""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from urllib.parse import parse_qsl, urlencode

import numpy as np

from rftfit.bench.events import format_alpha, format_cells
from rftfit.bench.medium import LiveMedium
from rftfit.bench.pictures import draw_heat, draw_stress
from rftfit.bench.watch import REFUSED, Watch
from rftfit.compare.joint import list_untold
from rftfit.figures.traces import cell_of_run
from rftfit.measure.alpha import column
from rftfit.measure.fits import filed_under


def page_of(watch: Watch, query: str) -> str:
    """Format everything below the heading of the page as html.

    `query`: Query of the page's address, ``medium=NAME&run=RUN_ID``: what this browser wants to see; default: the medium
    and the run that were measured last.
    """
    if not watch.media:
        return "<p>No run of the run sheet has its logs yet.</p>" + _format_problems(watch)
    asked = dict(parse_qsl(query))
    newest = max(watch.media.values(), key=lambda medium: medium.measured_at)
    medium = watch.media.get(asked.get("medium", ""), newest)
    run = asked["run"] if asked.get("run") in medium.runs else medium.last
    tabs = "".join(
        _format_link(watch.campaign.titles[name], medium is tab_medium, medium=name)
        for name, tab_medium in watch.media.items()
    )
    return (
        f'<nav aria-label="Media">{tabs}</nav>{_format_problems(watch)}'
        f"{_format_push(watch, medium, run)}{_format_map(watch, medium)}{_format_runs(watch, medium, run)}"
    )


def _format_link(title: str, is_here: bool, **query: str) -> str:
    """Format a link to another view of the page; by its id it keeps the focus when the page is sent anew.

    `is_here`: True where the page shows this view now. `query`: Medium and run of the view.
    """
    address, current_mark = escape(urlencode(query)), " aria-current=true" if is_here else ""
    return f'<a id="{address}" href="?{address}"{current_mark}>{escape(title)}</a>'


def _format_items(sentences: Iterable[str], style: str = "") -> str:
    """Format sentences as items of a list, empty ones left out; `style`: their class in the style sheet."""
    return "".join(f'<li class="{style}">{escape(item)}</li>' for item in sentences if item)


def _format_problems(watch: Watch) -> str:
    """Format problems of config and run sheet, and files that no row names; empty if there are none."""
    unnamed = [
        f"{facts['file']}: no row names it"
        + (f"; a row for it has {format_cells(facts['row'])}" if facts["row"] else "")
        for facts in watch.unnamed.values()
        if facts  # empty while the file still changes
    ]
    items = _format_items(watch.problems, "bad") + _format_items(unnamed)
    return f"<h2>To be put right</h2><ul>{items}</ul>" if items else ""


def _format_push(watch: Watch, medium: LiveMedium, run_id: str) -> str:
    """Format the shown push: a picture of its stress with its repeats (runs of the same cell), its numbers and its flags.

    Empty where there is no push, or it is no plate run with a row in the table of fits.
    """
    if not run_id or "fits" not in medium.runs[run_id].rows:
        return ""
    facts, run, measured = (
        watch.facts(medium, run_id),
        watch.campaign.by_id[run_id],
        medium.runs[run_id],
    )
    plate = watch.campaign.config.intruders[run.intruder]
    assert plate.shape != "leg"
    runs_of_cell = str(cell_of_run(medium.alpha, run_id).get("run_ids", "")).split()
    repeats = {key: medium.runs[key] for key in runs_of_cell if key in medium.runs}
    repeats.pop(run_id, None)
    # 1 or -1: alpha_x of a pull is filed under another direction, with its sign turned
    sign_x = filed_under(run)[2]
    picture = draw_stress(measured, plate.area_cm2, sign_x, [*repeats.values()])
    numbers = "".join(
        f'<li class="{c}">alpha_{c} = {alpha} N/cm³</li>'
        for c, alpha in format_alpha(facts).items()
    )
    doubts = _format_items([*(flag["text"] for flag in facts["flags"]), facts["reason"]], "bad")
    has_delay = np.isfinite(medium.seconds) and run_id == medium.last
    note = f"Shown after {medium.seconds:.1f} s." if has_delay else ""
    note += f" Repeats, dashed: {', '.join(repeats)}." if repeats else ""
    which = "Last push" if run_id == medium.last else "Push"
    return (
        f"<h2>{which}: {escape(run_id)}, {facts['state']}</h2><div class=row><div>{picture}</div><div>"
        f"<p>beta {facts['beta_deg']:g}, gamma {facts['gamma_deg']:.4g} deg, {facts['direction']}</p>"
        f"<ul>{numbers}{doubts}</ul><p class=soft>{escape(note)}</p></div></div>"
    )


def _format_map(watch: Watch, medium: LiveMedium) -> str:
    """Format what is known of the shown medium: target with its interval, failed checks, verdict, map, next pushes.

    The target is the quantity that the next pushes shall determine; they stand there as rows to copy into the run sheet.
    """
    summary = watch.summary(medium)
    checks = (
        f"{check['check']}, {check['effect']}: {check['sentence']}" for check in summary["checks"]
    )
    plate_runs = sum(run.kind == "plate" for run in watch.campaign.runs_of(medium.name))
    untold = escape(f"No check can tell: {'; '.join(list_untold(plate_runs))}.")
    width, pictures = "No push tells of it yet", ""
    if np.isfinite(medium.width):
        width = f"Half width of the interval: \N{PLUS-MINUS SIGN}{medium.width:.2g} %"
    if abs(medium.before - medium.width) > 0:  # False if one is NaN
        change = "narrowed" if medium.width < medium.before else "widened"
        width += f"; the last push {change} it from {medium.before:.2g} %"
    if medium.map is not None:
        table = medium.map.table()
        # alpha_z and alpha_x with the next pushes, then the half widths of their intervals
        for error in (False, True):
            pictures += "".join(
                draw_heat(table, c, None if error else medium.plan, error=error) for c in "zx"
            )
    rows = summary["next"]
    # names of the columns, if there is a row
    header = [",".join(row) for row in rows[:1]]
    sheet = "\n".join(header + [",".join(row.values()) for row in rows])
    return (
        f"<h2>{escape(summary['target'])} of {escape(medium.name)}</h2><ul>{_format_items(checks, 'bad')}</ul>"
        f"<p>{escape(summary['verdict'])}</p><p>{untold}</p><p>{width}.</p><div class=maps>{pictures}</div><h2>Next pushes, as rows for the run sheet</h2>"
        f'<pre class="wide" tabindex="0" role="region" aria-label="Next pushes">{escape(sheet)}</pre>'
    )


_HEAD = ("row", "run", "state", "beta", "gamma", "alpha_z", "alpha_x", "flags, or why not")
"""Headings of the table of runs."""


def _format_runs(watch: Watch, medium: LiveMedium, shown: str) -> str:
    """Format the table of runs, the last row of the run sheet first; `shown`: run_id of the run that the page shows."""
    table_rows = []
    runs = [row.run for row in watch.rows[medium.name].values()]
    for run in sorted(runs, key=lambda run: -run.row):
        run_id = run.run_id
        state, measured = watch.state(medium.name, run_id), medium.runs.get(run_id)
        fit = measured.rows.get("fits", {}) if measured else {}
        doubts = "; ".join(measured.doubts) or measured.why if measured else ""
        columns = ("beta_deg", "gamma_deg", column("z"), column("x"))
        numbers = [fit.get(key, np.nan) for key in columns]
        cells = [f"{number:.4g}" if np.isfinite(number) else "" for number in numbers]
        link = escape(run_id)
        if fit:
            link = _format_link(run_id, run_id == shown, medium=medium.name, run=run_id)
        style = ' class="bad"' if doubts or state == REFUSED else ""
        # html needs no end of a row or cell
        table_rows.append(
            f"<tr><td>{run.row}<td>{link}<td{style}>{state}<td>{'<td>'.join(cells)}"
            f'<td class="words">{escape(doubts)}'
        )
    head = "".join(f'<th scope="col">{heading}</th>' for heading in _HEAD)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(table_rows)}</tbody></table>"
    return (
        f'<h2>Runs</h2><div class="wide" tabindex="0" role="region" aria-label="Runs">{table}</div>'
    )
