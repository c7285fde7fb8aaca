"""Write ``results/report.html``: everything of a run on one page that needs no network."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from rftfit.campaign.config import Leg
from rftfit.campaign.load import load_campaign
from rftfit.page import tables
from rftfit.page.live import FLAT, REVERSED, as_json, live_data, reversals, scaled_from_print
from rftfit.page.methods import Provenance, paragraphs, provenance_of, references
from rftfit.page.robot import RobotTables, read_robot_tables, robot_tables
from rftfit.page.tables import leg_name, row_fates, run_fates, span, value
from rftfit.store import read_csv, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config


# --- What the report page is made from: the tables of a run, its configuration, its provenance.


@dataclass(frozen=True)
class PageInputs:
    """Everything that the page shows; columns of the tables as in ``docs/architecture.md``.

    `alpha`: Alpha table by medium, natural sands too.
    `runs`, `fits`: Of all media. A medium's own run table gives its flags, so `runs` has a column
        ``medium``.
    `legs`: Measured leg curves of all media.
    `predicted`, `leg_errors`, `sands`, `sand_correction`: Of the trials.
    `robot`: None where the campaign has no robot.
    """

    config: Config
    alpha: Mapping[str, pd.DataFrame]
    coefficients: pd.DataFrame
    penetration: pd.DataFrame
    reproduction: pd.DataFrame
    ledger: pd.DataFrame
    runs: pd.DataFrame
    fits: pd.DataFrame
    legs: pd.DataFrame
    predicted: pd.DataFrame
    leg_errors: pd.DataFrame
    sands: pd.DataFrame
    sand_correction: pd.DataFrame
    provenance: Provenance
    robot: RobotTables | None = None

    @property
    def media(self) -> list[str]:
        """Media that have an alpha table, in the order of the configuration."""
        return [name for name in self.config.media if name in self.alpha]

    @property
    def titles(self) -> dict[str, str]:
        """Title of every medium of the configuration, as the user wrote it."""
        return {name: medium.title for name, medium in self.config.media.items()}


def read_inputs(
    config: Path,
    *,
    alpha: Sequence[Path],
    coefficients: Path,
    penetration: Path,
    reproduction: Path,
    ledger: Path,
    runs: Sequence[Path],
    fits: Sequence[Path],
    legs: Sequence[Path],
    predicted: Sequence[Path],
    leg_errors: Path,
    sands: Path,
    sand_correction: Path,
    code: str,
    digests: Mapping[str, str],
    robot: Sequence[Path] = (),
) -> PageInputs:
    """Read the tables of a run.

    `alpha`, `fits`, `legs`: One per medium. `runs`: One per medium, named after it
    (``runs/<medium>.csv``). `predicted`: One, or one per medium. `code`: Digest of the program's
    source, for the provenance. `digests`: Of settings and run sheet, for the provenance. `robot`:
    See `rftfit.page.robot.read_robot_tables`.
    """
    campaign = load_campaign(config)
    tables = [read_csv(path) for path in alpha]
    return PageInputs(
        config=campaign.config,
        alpha={str(table["medium"].iloc[0]): table for table in tables if len(table)},
        coefficients=read_csv(coefficients),
        penetration=read_csv(penetration),
        reproduction=read_csv(reproduction),
        ledger=read_csv(ledger),
        # the run tables do not say their medium, their names do
        runs=_joined([read_csv(path).assign(medium=path.stem) for path in runs]),
        fits=_joined([read_csv(path) for path in fits]),
        legs=_joined([read_csv(path) for path in legs]),
        predicted=_joined([read_csv(path) for path in predicted]),
        leg_errors=read_csv(leg_errors),
        sands=read_csv(sands),
        sand_correction=read_csv(sand_correction),
        provenance=provenance_of(code, digests),
        robot=read_robot_tables(robot),
    )


def _joined(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    import pandas as pd

    filled = [table for table in tables if len(table)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()


# --- Write ``results/report.html``: everything of a run on one page that needs no network.


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

    `target`: Of the html file.
    """
    write_text(target, render(inputs))


def render(inputs: PageInputs) -> str:
    """Make the page; the same inputs give the same text.

    Returns one html document with its style, its script and its numbers inside. Text of the user's
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
    """Collect what the template prints."""
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
