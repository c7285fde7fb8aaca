"""Write ``results/report.html``: everything of a run on one page that needs no network."""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from rftfit.campaign.config import Leg
from rftfit.report.page import tables
from rftfit.report.page.data import as_json, live_data
from rftfit.report.page.fates import row_fates, run_fates
from rftfit.report.page.methods import paragraphs, references
from rftfit.report.page.references import scaled_from_print
from rftfit.report.page.reversal import FLAT, REVERSED, reversals
from rftfit.report.page.robot import robot_tables
from rftfit.report.page.words import leg_name, span, value
from rftfit.store import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.report.page.inputs import PageInputs

SCRIPTS = (
    "kernel.js",
    "student.js",
    "scaling.js",
    "drawing.js",
    "maps.js",
    "curves.js",
    "viewer.js",
    "calculator.js",
    "robot.js",
    "page.js",
)
"""Parts of the script, in this order."""


def write_page(inputs: PageInputs, target: Path) -> None:
    """Write the report page.

    Parameters
    ----------
    inputs : PageInputs
    target : Path
        Of the html file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(target, render(inputs))


def render(inputs: PageInputs) -> str:
    """Make the page; the same inputs give the same text.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    str
        One html document with its style, its script and its numbers inside. Text of the user's
        is escaped, and a content security policy lets no other script run and nothing be fetched.
    """
    from jinja2 import Environment, StrictUndefined

    style, script = _part("page.css"), _script()
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_part("page.html"))
    page: str = template.render(
        context(inputs),
        style=style,
        script=script,
        data=as_json(live_data(inputs)),
        policy=(
            f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
            "img-src data:; base-uri 'none'; form-action 'none'"
        ),
    )
    return page


def context(inputs: PageInputs) -> dict[str, Any]:
    """Collect what the template prints.

    Parameters
    ----------
    inputs : PageInputs

    Returns
    -------
    dict
    """
    config = inputs.config
    used, dropped = run_fates(inputs.ledger)
    methods = list(dict.fromkeys(inputs.coefficients["method"]))
    methods.sort(key=lambda method: method != config.fourier.method)
    legs = [name for name, item in config.intruders.items() if isinstance(item, Leg)]
    return {
        "title": config.title,
        "level": f"{100 * config.fit.confidence:g} %",
        "method": config.fourier.method,
        "legs": {name: leg_name(name) for name in legs},
        "summary": tables.summary(inputs),
        "in_air": used.get("", 0),
        "notes": [
            {"title": medium.title, "compaction": medium.compaction, "note": medium.note}
            for medium in config.media.values()
            if medium.note or medium.compaction
        ],
        "coefficients": [tables.coefficient_table(inputs, method) for method in methods],
        "scaling": tables.scaling(inputs),
        "from_print": [inputs.titles[medium] for medium in scaled_from_print(inputs)],
        "leg_errors": tables.leg_table(inputs),
        "sands": tables.sand_table(inputs),
        "corrections": tables.correction_table(inputs),
        "robot": robot_tables(inputs.robot),
        "reproduction": tables.reproduction(inputs.reproduction),
        "reversal": _reversal(inputs),
        "dropped": [
            {**vars(run), "title": inputs.titles.get(run.medium, run.medium or "in air")}
            for run in dropped
        ],
        "runs_used": sum(used.values()),
        "row_fates": row_fates(inputs.ledger),
        "methods": paragraphs(inputs),
        "references": references(inputs),
        "provenance": inputs.provenance,
    }


def _reversal(inputs: PageInputs) -> list[dict[str, Any]]:
    rows = []
    for found in reversals(inputs):
        row: dict[str, Any] = {
            "title": inputs.titles[found.medium],
            "theta": value(found.theta_deg, 0),
            "deep": {
                name: {"lift": value(deep.lift_N, 2), "alpha": value(deep.alpha_z_N_per_cm3)}
                for name, deep in found.deep.items()
            },
            "beta": span(*found.beta_deg, 0),
            "gamma": span(*found.gamma_deg, 0),
        }
        for source in ("measured", "table", "fourier"):
            row[source] = {
                "flat": value(found.peaks.get((source, FLAT)), 2),
                "reversed": value(found.peaks.get((source, REVERSED)), 2),
                "above": found.above(source),
            }
        rows.append(row)
    return rows


def _script() -> str:
    # one scope for all parts, so that nothing leaks into the page
    body = "\n".join(_part(name) for name in SCRIPTS)
    return f'"use strict";\n(() => {{\n{body}\n}})();\n'


def _part(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
