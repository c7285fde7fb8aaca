"""The live page: what a watch knows, as html that is sent to every browser that looks at it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlencode

import numpy as np
import pandas as pd

from rftfit.bench.pictures import heat, stress
from rftfit.bench.watch import REFUSED
from rftfit.measure.alpha import column
from rftfit.measure.fits import filed_under

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.bench.medium import Medium
    from rftfit.bench.watch import Watch


def page_of(watch: Watch, query: str) -> str:
    """Everything below the heading of the page; `query` names the medium and the run that are looked at."""
    asked = {key: values[-1] for key, values in parse_qs(query).items()}
    campaign = watch.campaign
    if not watch.media:
        return "<p>No run of the run sheet has its logs yet.</p>" + _problems(watch)
    newest = max(watch.media.values(), key=lambda one: one.heard)
    medium = watch.media.get(asked.get("medium", ""), newest)
    run = asked.get("run", "")
    run = run if run in medium.runs else medium.last
    tabs = "".join(
        f'<a href="?{urlencode({"medium": one.name})}" id="m-{escape(one.name)}"'
        f"{' aria-current=page' if one is medium else ''}>{escape(campaign.titles[one.name])}</a>"
        for one in watch.media.values()
    )
    return (
        f'<nav aria-label="Media">{tabs}</nav>{_problems(watch)}{_push(watch, medium, run)}'
        f"{_map(watch, medium)}{_runs(watch, medium, run)}"
    )


def _table(head: Iterable[str], rows: Iterable[Iterable[str]], name: str) -> str:
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in rows)
    heads = "".join(f'<th scope="col">{one}</th>' for one in head)
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{name}"><table><thead><tr>{heads}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"<td>{value:.4g}</td>" if np.isfinite(value) else "<td></td>"
    return f"<td>{escape(str(value))}</td>"


def _problems(watch: Watch) -> str:
    lines = [f'<li class="bad">{escape(text)}</li>' for text in watch.problems]
    lines += [
        f"<li>{escape(one['file'])}: no row names it; {escape(' and '.join(one['kinds']) or one['refused'])}. "
        f"A row for it: <code>{escape(str(one['row']))}</code></li>"
        for one in watch.unnamed.values()
    ]
    return f"<h2>To be put right</h2><ul>{''.join(lines)}</ul>" if lines else ""


def _push(watch: Watch, medium: Medium, run: str) -> str:
    if not run or "fits" not in medium.runs[run].rows:
        return ""
    one, facts = medium.runs[run], watch.facts(medium, run)
    plate = watch.campaign.config.intruders[watch.campaign.by_id[run].intruder]
    assert plate.shape != "leg"
    same = [
        name
        for name, other in medium.runs.items()
        if name != run and "fits" in other.rows and _cell_of(other) == _cell_of(one)
    ]
    columns = [column(c) for c in "zx"]
    others = pd.DataFrame([medium.runs[name].rows["fits"] for name in same], columns=[*columns])
    drawn = stress(one, plate.area_cm2, others, filed_under(watch.campaign.by_id[run])[2])
    numbers = "".join(
        f'<li><span class="{c}">alpha_{c}</span> = {facts[column(c)]:.4g} '
        f"[{facts[column(c, '_lo')]:.4g}, {facts[column(c, '_hi')]:.4g}] N/cm³</li>"
        for c in "zx"
        if np.isfinite(facts[column(c)])
    )
    flags = "".join(f'<li class="bad">{escape(flag["text"])}</li>' for flag in facts["flags"])
    why = f'<p class="bad">{escape(facts["reason"])}</p>' if facts["reason"] else ""
    heard = (
        f'<p class="soft">On the screen {medium.seconds:.1f} s after its last change.</p>'
        if run == medium.last and np.isfinite(medium.seconds)
        else ""
    )
    beside = f"<p>Repeats of this direction, dashed: {escape(', '.join(same))}</p>" if same else ""
    return (
        f"<h2>{'Last push' if run == medium.last else 'Push'}: {escape(run)}, {facts['state']}</h2>"
        f'<div class="row"><div>{drawn}</div><div><p>beta {facts["beta_deg"]:g}, gamma '
        f"{facts['gamma_deg']:.4g} deg, {facts['direction']}</p><ul>{numbers}{flags}</ul>{why}{beside}{heard}</div></div>"
    )


def _cell_of(one: Any) -> tuple[Any, ...]:
    fit = one.rows["fits"]
    return round(fit["beta_deg"]), round(fit["gamma_deg"]), fit["direction"]


def _map(watch: Watch, medium: Medium) -> str:
    told = watch.summary(medium)
    checks = "".join(
        f'<li class="bad">{escape(str(one["check"]))}, {escape(str(one["effect"]))}: {escape(str(one["sentence"]))}</li>'
        for one in told["checks"]
    )
    width = "No push tells of it yet."
    if medium.map is not None:
        width = f"Known to {medium.width:.2g} % (half of the interval)"
        if np.isfinite(medium.before) and medium.before != medium.width:
            change = "narrowed" if medium.width < medium.before else "widened"
            width += f"; the last push {change} it from {medium.before:.2g} %"
    pictures = ""
    if medium.map is not None:
        table = medium.map.table()
        pictures = "".join(
            heat(table, c, None if error else medium.plan, error=error)
            for error in (False, True)
            for c in "zx"
        )
        pictures = f'<div class="row">{pictures}</div>'
    rows = told["next"]
    sheet = (
        "\n".join([",".join(rows[0]), *(",".join(row.values()) for row in rows)]) if rows else ""
    )
    return (
        f"<h2>{escape(told['target'] or 'map')} of {escape(medium.name)}</h2><ul>{checks}</ul><p>{width}.</p>{pictures}"
        f"<h2>Next pushes, as rows for the run sheet</h2>"
        f'<pre class="wide" tabindex="0" role="region" aria-label="Rows of the next pushes">{escape(sheet)}</pre>'
    )


def _runs(watch: Watch, medium: Medium, shown: str) -> str:
    rows = []
    for name, row in sorted(watch.rows[medium.name].items(), key=lambda item: -item[1].run.row):
        state = watch.state(medium.name, name)
        link = escape(name)
        fit = medium.runs[name].rows.get("fits", {}) if name in medium.runs else {}
        if fit:
            current = " aria-current=true" if name == shown else ""
            where = urlencode({"medium": medium.name, "run": name})
            link = f'<a id="r-{link}" href="?{escape(where)}"{current}>{link}</a>'
        flags = str(fit.get("flags") or "") if fit else ""
        why = medium.runs[name].why if name in medium.runs else ""
        bad = " class=bad" if state == REFUSED or flags else ""
        rows.append([
            f"<td>{row.run.row}</td><td>{link}</td><td{bad}>{state}</td>",
            *(_cell(fit.get(key, "")) for key in ("beta_deg", "gamma_deg", column("z"), column("x"))),
            f'<td class="words">{escape(flags or why)}</td>',
        ])  # fmt: skip
    head = (
        "row",
        "run",
        "state",
        "beta",
        "gamma",
        "alpha_z",
        "alpha_x",
        "flags, or why there is no number",
    )
    return f"<h2>Runs</h2>{_table(head, rows, 'Runs')}"
