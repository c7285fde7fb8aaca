"""Captions of Snakemake's own report: every template renders, with the run's own numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from docutils.core import publish_parts  # type: ignore[import-untyped]
from jinja2 import Environment, StrictUndefined
from page_inputs import NASTY, page_inputs

from rftfit.report.captions import measured, modelled
from rftfit.report.captions.run import NUMBERS, Captions
from rftfit.report.captions.words import escaped, rst

if TYPE_CHECKING:
    from rftfit.report.page.inputs import PageInputs

ROOT = Path(__file__).resolve().parents[2]
TEMPLATES = sorted((ROOT / "workflow" / "report").glob("*.rst"))


def whole_inputs(nasty: bool = False) -> PageInputs:
    """Those of the page's tests, with every column of the fit and coefficient tables."""
    found = page_inputs(nasty)
    fits = pd.concat(found.alpha.values(), ignore_index=True)
    fits = fits.assign(
        run_id=[f"run_{i:04d}" for i in range(len(fits))],
        nonlinear_z_ratio=np.linspace(-0.1, 0.1, len(fits)),
        flags=NASTY if nasty else "",
    )
    return replace(
        found, fits=fits, coefficients=found.coefficients.assign(misfit_rms_N_per_cm3=0.034)
    )


@pytest.fixture(scope="module")
def inputs() -> PageInputs:
    return whole_inputs()


def captions(inputs: PageInputs) -> Captions:
    made = Captions("config/config.yaml", inputs.media, shown=list(inputs.fits["run_id"][:2]))
    made.inputs = inputs
    return made


def render(template: Path, inputs: PageInputs, **wildcards: str) -> str:
    """Do what Snakemake does, but complain about every name that is not there."""
    env = Environment(trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    job = SimpleNamespace(config={"captions": captions(inputs)}, wildcards=Wildcards(wildcards))
    source = env.from_string(template.read_text(encoding="utf-8")).render(snakemake=job)
    body: str = publish_parts(source, writer="html", settings_overrides={"report_level": 1})["body"]
    assert "system-message" not in body, body
    return " ".join(re.sub("<[^>]+>", " ", body).split())


class Wildcards(dict[str, str]):
    def __getattr__(self, name: str) -> str:
        return self[name]


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_every_caption_renders_and_tells_a_number(template: Path, inputs: PageInputs) -> None:
    text = render(template, inputs, medium="poppy_LP")
    assert re.search(r"\d", text)
    assert "{{" not in text


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_what_a_user_wrote_is_printed_and_no_markup(template: Path) -> None:
    text = render(template, whole_inputs(nasty=True), medium="poppy_LP")
    assert "<script" not in text


def test_titles_are_escaped() -> None:
    for nasty in (NASTY, "a*b* `c` |d| e_ [1]_ \\", "-2 mm <x>", "glass_", ".. raw:: html"):
        body = publish_parts("Sand " + rst(nasty) + " end", writer="html")["body"]
        assert "system-message" not in body
        assert "<script" not in body
    assert escaped({"a_": ["b_", 1, {"c": "d*"}]}) == {"a_": ["b\\_", 1, {"c": "d\\*"}]}


def test_each_caption_is_used_and_each_used_one_is_there() -> None:
    rules = "".join(
        path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk")
    )
    used = set(re.findall(r'"\.\./report/(\w+)\.rst"', rules))
    there = {path.stem for path in TEMPLATES}
    assert used - there == set()
    assert there - used <= {"page"}  # that rule may leave its report out


def test_scaling_caption_has_zeta_and_chi_of_every_medium(inputs: PageInputs) -> None:
    text = render(ROOT / "workflow" / "report" / "fig_s7_generic.rst", inputs)
    rows = inputs.penetration.query("method == 'lsq'")
    assert len(rows) == 5
    for row in rows.to_dict("records"):
        title = inputs.titles[row["medium"]]
        assert f"{title}: zeta {row['zeta']:.4f}" in text
        assert f"chi {row['chi']:.4f}" in text


def test_leg_caption_has_the_peak_errors(inputs: PageInputs) -> None:
    text = render(ROOT / "workflow" / "report" / "fig_3_legs.rst", inputs, medium="poppy_LP")
    errors = inputs.leg_errors.query("medium == 'poppy_LP' and component == 'z'")
    best = errors.query("profile == 'table' and leg == 'c_leg'")["peak_error_percent"].iloc[0]
    found = re.search(r"measured table: c-leg ([+\u2212]?[\d.]+) %", text)
    assert found
    assert float(found[1].replace("\u2212", "-")) == pytest.approx(best, abs=0.5)
    rows = {row["profile"]: row for row in modelled.peaks(inputs, "poppy_LP")}
    assert rows["measured table"]["number"] == 3
    within = (errors.query("profile == 'table'")["peak_error_percent"].abs() <= 33).sum()
    assert rows["measured table"]["within_33"] == within


def test_ledger_caption_counts_runs_and_rows(inputs: PageInputs) -> None:
    fates = measured.fates(inputs)
    assert fates["rows_used"] + fates["rows_dropped"] == inputs.ledger["rows"].sum()
    text = render(ROOT / "workflow" / "report" / "ledger.rst", inputs)
    assert f"{fates['runs_used']} runs were used and {fates['runs_dropped']} dropped" in text
    assert fates["dropped"]
    for run in fates["dropped"]:
        assert run["run_id"].replace("\\", "") in text


def test_slopes_sum_up_the_fit_table(inputs: PageInputs) -> None:
    found = measured.slopes(inputs, "poppy_LP")
    own = inputs.fits[inputs.fits["medium"] == "poppy_LP"]
    assert found["runs"] == len(own)
    assert found["good"] == own["alpha_z_N_per_cm3"].notna().sum()
    assert measured.slopes(inputs, "moon")["runs"] == 0
    cells = measured.cells(inputs, "glass3mm_CP")
    assert [row["good"] for row in cells] == [89]
    table = inputs.alpha["glass3mm_CP"]["alpha_z_N_per_cm3"]
    assert cells[0]["high"] == f"{np.nanmax(table):.3f}"


def test_nothing_is_read_before_a_caption_asks(tmp_path: Path) -> None:
    made = Captions(tmp_path / "no_config.yaml", ["poppy_LP"], ["run"], tmp_path / "no_results")
    assert made.shown == ["run"]
    with pytest.raises(AttributeError, match="no 'moon' of a run; allowed: summary, fates"):
        made.moon  # noqa: B018
    assert "inputs" not in vars(made)


def test_templates_ask_for_what_there_is() -> None:
    own = {"title", "level", "method", "shown"}
    for path in TEMPLATES:
        asked: set[Any] = set(re.findall(r"\brun\.(\w+)", path.read_text(encoding="utf-8")))
        assert asked <= own | set(NUMBERS), path.name
