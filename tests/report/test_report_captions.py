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

from rftfit.compare.robot import optima
from rftfit.page.robot import RobotTables
from rftfit.report.captions import measured, modelled, robot
from rftfit.report.captions.run import NUMBERS, Captions
from rftfit.report.captions.words import escaped, rst
from rftfit.robot.intervals import BEST, SPEED
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON

if TYPE_CHECKING:
    from rftfit.page.page import PageInputs

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
        found,
        fits=fits,
        coefficients=found.coefficients.assign(misfit_rms_N_per_cm3=0.034),
        robot=robot_tables_of(nasty),
    )


def robot_tables_of(nasty: bool) -> RobotTables:
    """A sweep on two profiles, 10 % and 100 % faster than measured, three runs of it fallen."""
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    if nasty:
        measured["condition"] = NASTY
    grid = [(round(k, 2), f) for k in np.arange(-1, 1.01, 0.2) for f in (1.0, 5.0)]
    runs, means, widths = [], [], []
    for name, factor in (("table", 1.1), ("depth_only", 2.0)):
        table = pd.DataFrame(grid, columns=["curvature_times_R", "frequency_Hz"])
        top = 15 - 4 * (table["curvature_times_R"] - 0.5) ** 2
        table = table.assign(
            profile=name, medium="poppy_LP", phase_turns=0.0, outcome="steady", warning="",
            speed_cm_per_s=top * table["frequency_Hz"], reason=NASTY if nasty else "",
        )  # fmt: skip
        table.loc[:2, "outcome"] = "tipped"
        table.loc[:2, "speed_cm_per_s"] = np.nan
        table.loc[table["frequency_Hz"] > 4, "warning"] = NASTY if nasty else "leg tips"
        runs.append(table)
        speed = measured["speed_cm_per_s"] * factor
        ends = {f"speed_{end}cm_per_s": speed for end in ("", "lo_", "hi_")}
        at = {key: measured[key] for key in ("curvature_times_R", "frequency_Hz")}
        means.append(pd.DataFrame({"profile": name, **at, **ends, "reason": ""}))
        own = {"medium": "poppy_LP", "profile": name, "draws": 12, "reason": ""}
        widths.append(pd.DataFrame({**own, "quantity": SPEED, **at, "half_width": 0.05 * speed}))
        best = {**own, "quantity": BEST, "frequency_Hz": 5.0, "half_width": 0.03}
        widths.append(pd.DataFrame([best]))
    sweep, half = pd.concat(runs, ignore_index=True), pd.concat(widths, ignore_index=True)
    errors = speed_errors(measured, pd.concat(means), half)
    return RobotTables(sweep, errors, optima(sweep, [5.0], widths=half), {})


def motion() -> pd.DataFrame:
    """Two strides of two legs at 10 and 20 cm/s."""
    time = np.linspace(0, 1, 101)
    parts = [
        pd.DataFrame(
            {"profile": profile, "curvature_times_R": curvature, "frequency_Hz": 2.0, "time_s": time,
             "x_cm": speed * time, "z_cm": 1 + 0.25 * np.cos(4 * np.pi * time),
             "pitch_deg": 3 * np.sin(4 * np.pi * time), "force_z_tripod_1_N": 1.7 * time}
        )
        for profile in ("table", "generic")
        for curvature, speed in ((1.0, 20.0), (-1.0, 10.0))
    ]  # fmt: skip
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def inputs() -> PageInputs:
    return whole_inputs()


def captions(inputs: PageInputs) -> Captions:
    made = Captions("config/config.yaml", inputs.media, shown=list(inputs.fits["run_id"][:2]))
    made.inputs, made.motion = inputs, motion()
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


def test_robot_captions_have_the_shares_and_intervals(inputs: PageInputs) -> None:
    text = render(ROOT / "workflow" / "report" / "fig_4c_robot_speed.rst", inputs)
    assert inputs.robot is not None
    own = inputs.robot.errors.query("profile == 'table'")
    assert "within 20 %: 42 of 42, within 35 %: 42; of the 39 that" in text
    assert f"half widths {0.05 * own['simulated_cm_per_s'].median():.2f} cm/s" in text
    assert "Hollow points (3)" in text
    text = render(ROOT / "workflow" / "report" / "fig_s13_robot_profiles.rst", inputs)
    assert "Of 44 runs, 6 came to no steady speed" in text
    assert "22 have leg tips faster" in text
    assert "depth-only: within 20 %: 0 of 42" in text
    text = render(ROOT / "workflow" / "report" / "fig_4d_robot_curvature.rst", inputs)
    (table, depth) = inputs.robot.optimum.query("frequency_Hz == 5").to_dict("records")
    best = table["best_curvature_times_R"]
    assert f"fastest at R'/r {best:.2f}" in text.replace("\N{RIGHT SINGLE QUOTATION MARK}", "'")
    assert f"95 % interval from alpha {best - 0.03:.3f} to {best + 0.03:.3f}" in text
    assert text.count("the robot was calibrated on this") == 1
    assert (table["calibrated"], depth["calibrated"]) == ("yes", "no")


def test_motion_captions_tell_of_each_leg(inputs: PageInputs) -> None:
    text = render(ROOT / "workflow" / "report" / "fig_4b_robot_motion.rst", inputs)
    assert "c-leg at 2.0 Hz: 20.0 cm/s; its centre of mass rises and falls by 0.50 cm" in text
    assert "pitch by 6.0 degrees, and a tripod lifts with up to 1.70 N" in text
    text = render(ROOT / "workflow" / "report" / "fig_s14_robot_forces.rst", inputs)
    assert text.count("reversed c-leg, 2.0 Hz: 10.0 cm/s") == 2


def test_a_campaign_without_a_robot_has_no_numbers_of_one(inputs: PageInputs) -> None:
    bare = replace(inputs, robot=None)
    assert robot.best_legs(bare) == []
    assert (robot.speeds(bare)["profiles"], robot.speeds(bare)["conditions"]) == ([], 0)


def test_nothing_is_read_before_a_caption_asks(tmp_path: Path) -> None:
    made = Captions(tmp_path / "no_config.yaml", ["poppy_LP"], ["run"], tmp_path / "no_results")
    assert made.shown == ["run"]
    with pytest.raises(AttributeError, match="no 'moon' of a run; allowed: summary, fates"):
        made.moon  # noqa: B018
    assert "inputs" not in vars(made)


def test_templates_ask_for_what_there_is() -> None:
    own = {"title", "level", "method", "shown", "strides"}
    for path in TEMPLATES:
        asked: set[Any] = set(re.findall(r"\brun\.(\w+)", path.read_text(encoding="utf-8")))
        assert asked <= own | set(NUMBERS), path.name
