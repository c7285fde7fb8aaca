"""The live page: what a watch knows, as html that is sent to every browser that looks at it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from urllib.parse import parse_qs, urlencode

import numpy as np

from rftfit.bench.medium import LiveMedium
from rftfit.bench.pictures import draw_heat, draw_stress
from rftfit.bench.watch import REFUSED, Watch
from rftfit.compare.joint import list_untold
from rftfit.measure.alpha import column
from rftfit.measure.fits import filed_under

_HEAD = ("row", "run", "state", "beta", "gamma", "alpha_z", "alpha_x", "flags, or why not")


def page_of(watch: Watch, query: str) -> str:
    """Everything below the heading of the page; `query` names the medium and the run looked at."""
    if not watch.media:
        return "<p>No run of the run sheet has its logs yet.</p>" + _problems(watch)
    asked = {key: values[-1] for key, values in parse_qs(query).items()}
    newest = max(watch.media.values(), key=lambda medium: medium.measured_at)
    medium = watch.media.get(asked.get("medium", ""), newest)
    run = asked["run"] if asked.get("run") in medium.runs else medium.last
    tabs = "".join(
        _link(watch.campaign.titles[name], medium is tab_medium, medium=name)
        for name, tab_medium in watch.media.items()
    )
    parts = (
        _problems(watch),
        _push(watch, medium, run),
        _map(watch, medium),
        _runs(watch, medium, run),
    )
    return f'<nav aria-label="Media">{tabs}</nav>{"".join(parts)}'


def _link(words: str, is_here: bool, **query: str) -> str:
    """A link to another view of the page; it keeps the focus when the page is sent anew."""
    where, current_mark = escape(urlencode(query)), " aria-current=true" if is_here else ""
    return f'<a id="{where}" href="?{where}"{current_mark}>{escape(words)}</a>'


def _items(words: Iterable[str], kind: str = "") -> str:
    return "".join(f'<li class="{kind}">{escape(text)}</li>' for text in words if text)


def _problems(watch: Watch) -> str:
    loose = (
        f"{facts['file']}: no row names it"
        + (f"; a row for it has {_cells_in_words(facts['row'])}" if facts["row"] else "")
        for facts in watch.unnamed.values()
        if facts
    )
    lines = _items(watch.problems, "bad") + _items(loose)
    return f"<h2>To be put right</h2><ul>{lines}</ul>" if lines else ""


def _push(watch: Watch, medium: LiveMedium, name: str) -> str:
    """The push that is looked at: its stress, its numbers, its flags, and repeats beside it."""
    if not name or "fits" not in medium.runs[name].rows:
        return ""
    facts, run, measured = watch.facts(medium, name), watch.campaign.by_id[name], medium.runs[name]
    plate = watch.campaign.config.intruders[run.intruder]
    assert plate.shape != "leg"
    cells = {
        key: _cell_of(candidate.rows["fits"])
        for key, candidate in medium.runs.items()
        if "fits" in candidate.rows
    }
    same = [key for key, cell in cells.items() if cell == cells[name] and key != name]
    drawn = draw_stress(
        measured, plate.area_cm2, filed_under(run)[2], [medium.runs[key] for key in same]
    )
    numbers = "".join(
        f'<li class="{c}">alpha_{c} = {facts[column(c)]:.4g} '
        f"[{facts[column(c, '_lo')]:.4g}, {facts[column(c, '_hi')]:.4g}] N/cm³</li>"
        for c in "zx"
        if np.isfinite(facts[column(c)])
    )
    bad = _items([*(flag["text"] for flag in facts["flags"]), facts["reason"]], "bad")
    late = np.isfinite(medium.seconds) and name == medium.last
    soft = f"Shown after {medium.seconds:.1f} s." if late else ""
    soft += f" Repeats, dashed: {', '.join(same)}." if same else ""
    what = "Last push" if name == medium.last else "Push"
    return (
        f"<h2>{what}: {escape(name)}, {facts['state']}</h2><div class=row><div>{drawn}</div><div>"
        f"<p>beta {facts['beta_deg']:g}, gamma {facts['gamma_deg']:.4g} deg, {facts['direction']}</p>"
        f"<ul>{numbers}{bad}</ul><p class=soft>{escape(soft)}</p></div></div>"
    )


def _cells_in_words(row: Mapping[str, object]) -> str:
    """Cells of a row of the run sheet, each with its column."""
    cells = (
        f"{name} {cell:.4g}" if isinstance(cell, float) else f"{name} {cell}"
        for name, cell in row.items()
        if cell not in ("", None)
    )
    return ", ".join(cells)


def _cell_of(fit: dict[str, float]) -> tuple[object, ...]:
    return round(fit["beta_deg"]), round(fit["gamma_deg"]), fit["direction"]


def _map(watch: Watch, medium: LiveMedium) -> str:
    """How well the target is known, the verdict, the map with its interval, failed checks, and the next pushes."""
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
    if abs(medium.before - medium.width) > 0:  # not where one is NaN
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
        f"<h2>{escape(summary['target'])} of {escape(medium.name)}</h2><ul>{_items(checks, 'bad')}</ul>"
        f"<p>{escape(summary['verdict'])}</p><p>{untold}</p><p>{width}.</p><div class=maps>{pictures}</div><h2>Next pushes, as rows for the run sheet</h2>"
        f'<pre class="wide" tabindex="0" role="region" aria-label="Next pushes">{escape(sheet)}</pre>'
    )


def _runs(watch: Watch, medium: LiveMedium, shown: str) -> str:
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
        link = _link(name, name == shown, medium=medium.name, run=name) if fit else escape(name)
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
