"""The live parts of the report page in a real browser, with real clicks and keys."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from chromium import Chromium, find
from page_inputs import HOLED, page_inputs

from rftfit.campaign.config import Leg
from rftfit.cli.scale import alpha_with_interval, coefficients_with_interval, scale_from
from rftfit.measure.slopes import student_quantile
from rftfit.model.forces import forces_on
from rftfit.model.motion import THETA_DEG, rotation_poses, sweep, sweep_draws
from rftfit.model.outlines import leg_outline
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile
from rftfit.model.reference_kernel import element_forces, place
from rftfit.model.scaling import published, with_interval
from rftfit.page.live import references_of, used_coefficients, zeta_of
from rftfit.page.page import render, write_page

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rftfit.model.profiles import Profile
    from rftfit.page.page import PageInputs

PROGRAM = find()
pytestmark = pytest.mark.skipif(
    PROGRAM is None, reason="no Chromium on this machine, so the live parts are not tested"
)


@pytest.fixture(scope="module")
def inputs() -> PageInputs:
    return page_inputs()


@pytest.fixture(scope="module")
def address(inputs: PageInputs, tmp_path_factory: pytest.TempPathFactory) -> str:
    target = tmp_path_factory.mktemp("page") / "report.html"
    write_page(inputs, target)
    return target.as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    assert PROGRAM is not None
    with Chromium(PROGRAM, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def browser(chromium: Chromium, address: str) -> Iterator[Chromium]:
    chromium.open(address)
    yield chromium
    assert chromium.complaints() == []
    assert chromium.requests() == [address]


def profiles(inputs: PageInputs, medium: str) -> dict[str, Profile]:
    m0 = used_coefficients(inputs.coefficients, "lsq", "generic")
    if medium == "yuma":
        return {"generic": FourierProfile(zeta_of(inputs, medium) * m0)}
    table = TableProfile.from_table(inputs.alpha[medium])
    return {
        "table": table,
        "fourier": FourierProfile(used_coefficients(inputs.coefficients, "lsq", medium)),
        "generic": FourierProfile(zeta_of(inputs, medium) * m0),
        "depth_only": DepthOnlyProfile.of(table),
    }


def numbers(values: Any) -> np.ndarray:
    """Nested lists of the page as an array; what JSON has no word for comes back as None."""
    return np.array(values, dtype=float)


@pytest.mark.parametrize("medium", ["poppy_LP", HOLED, "yuma"])
def test_forces_on_every_element_equal_those_of_the_library(
    browser: Chromium, inputs: PageInputs, medium: str
) -> None:
    theta = np.radians(THETA_DEG)
    unknown = set()
    for name, item in inputs.config.intruders.items():
        if not isinstance(item, Leg):
            continue
        poses = rotation_poses(theta, item.hip_height_cm)
        for profile, ours in profiles(inputs, medium).items():
            leg = leg_outline(item)
            net = forces_on(ours, leg, poses)
            each = element_forces(ours, place(leg.body, leg.width_cm, poses))
            found = browser.evaluate(
                f"(() => {{ const r = window.rftfit, p = r.data.profiles['{medium}']['{profile}'];"
                f" const leg = r.data.legs['{name}'];"
                " const at = [...Array(271).keys()].map((i) => ((i - 135) * Math.PI) / 180);"
                " const all = at.map((t) => r.elementForces(p, leg, t, r.data.rate));"
                " return {each: all, net: all.map((e) => r.netForce(e, leg))}; })()"
            )
            np.testing.assert_allclose(numbers(found["each"]), each, atol=1e-9, rtol=0)
            whole = np.stack([net.force_z_N, net.force_x_N, net.moment_N_cm], axis=-1)
            np.testing.assert_allclose(numbers(found["net"]), whole, atol=1e-9, rtol=0)
            if np.isnan(whole).any():
                unknown.add(profile)
    # a table with holes must leave some unknown, or this would not have tested them
    assert unknown == ({"table"} if medium == HOLED else set())


def test_alpha_on_the_whole_torus_equals_that_of_the_library(
    browser: Chromium, inputs: PageInputs
) -> None:
    rng = np.random.default_rng(1)
    angles = np.concatenate(
        [
            rng.uniform([-4, -7], [4, 7], (300, 2)),
            # nodes and the seams of the torus
            [[b, g] for b in (-np.pi / 2, 0, np.pi / 2) for g in (-np.pi, -np.pi / 2, 0, np.pi)],
        ]
    )
    for profile, ours in profiles(inputs, "poppy_CP").items():
        found = browser.evaluate(
            f"{json.dumps(angles.tolist())}.map(([b, g]) =>"
            f" window.rftfit.alphaOf(window.rftfit.data.profiles.poppy_CP.{profile}, b, g))"
        )
        wanted = np.stack(ours.alpha(angles[:, 0], angles[:, 1]), axis=-1)
        np.testing.assert_allclose(numbers(found), wanted, atol=1e-9)


@pytest.mark.parametrize("se", [0.0, 0.03])
@pytest.mark.parametrize("which", ["campaign", "print"])
def test_calculator_equals_rftfit_scale(
    browser: Chromium, inputs: PageInputs, which: str, se: float
) -> None:
    reference = published() if which == "print" else references_of(inputs)[0]
    scaled = scale_from(reference, 0.42, se, 0.95)
    place = 1 if which == "print" else 0
    beta, gamma = np.meshgrid(np.radians([-60, 0, 30]), np.radians([-45, 0, 90]), indexing="ij")
    found = browser.evaluate(
        f"(() => {{ const r = window.rftfit, ref = r.data.references[{place}];"
        f" const s = r.scaleNewMedium(0.42, {se}, ref, 0.95);"
        " const legs = Object.values(r.data.legs).map((leg) =>"
        " r.scaledSweep(s, ref, leg, [...Array(271).keys()].map((i) => i - 135), r.data.rate));"
        f" const at = {json.dumps(np.stack([beta.ravel(), gamma.ravel()], -1).tolist())};"
        " return {s, m: r.scaledCoefficients(s, ref), legs: legs.map((f) => [f.z, f.x]),"
        " alpha: at.map(([b, g]) => r.scaledAlpha(s, ref, b, g))}; })()"
    )
    zeta = [scaled.zeta, scaled.zeta_lo, scaled.zeta_hi]
    np.testing.assert_allclose(found["s"]["zeta"], zeta, rtol=1e-9)
    chi = [scaled.chi, scaled.chi_lo, scaled.chi_hi]
    np.testing.assert_allclose(found["s"]["chi"], chi, rtol=1e-9)
    wanted = np.stack(coefficients_with_interval(scaled, reference, 0.95), -1)
    np.testing.assert_allclose(numbers(found["m"]), wanted, atol=1e-9)
    pair = alpha_with_interval(scaled, reference, beta.ravel(), gamma.ravel(), 0.95)
    both = np.stack([np.stack(one, -1) for one in pair], 1)
    np.testing.assert_allclose(numbers(found["alpha"]), both, atol=1e-9)
    legs = [item for item in inputs.config.intruders.values() if isinstance(item, Leg)]
    for item, curves in zip(legs, found["legs"], strict=True):
        unit = sweep(FourierProfile(reference.m0), leg_outline(item), None, item.hip_height_cm)
        each = sweep_draws(
            FourierProfile(reference.scaled), leg_outline(item), None, item.hip_height_cm
        )
        forces = [
            with_interval(scaled, unit.force_z_N, each.force_z_N, 0.95),
            with_interval(scaled, unit.force_x_N, each.force_x_N, 0.95),
        ]
        whole = np.stack([np.stack(force, -1) for force in forces])
        np.testing.assert_allclose(numbers(curves), whole, atol=1e-6)


def test_calculator_equals_rftfit_scale_for_any_error(browser: Chromium) -> None:
    random = np.random.default_rng(7)
    alpha, relative = 10 ** random.uniform(-1, 0.7, 100), 10 ** random.uniform(-4, 0, 100)
    confidence = random.uniform(0.6, 0.99, 100)
    tests = np.stack([alpha, alpha * relative, confidence], -1).tolist()
    found = browser.evaluate(
        f"{json.dumps(tests)}.map(([alpha, se, level]) => window.rftfit.scaleNewMedium("
        "alpha, se, window.rftfit.data.references[1], level).zeta)"
    )
    scaled = [scale_from(published(), *test) for test in tests]
    wanted = [[one.zeta, one.zeta_lo, one.zeta_hi] for one in scaled]
    np.testing.assert_allclose(numbers(found), wanted, rtol=1e-9)


@pytest.mark.parametrize("dof", [1.0, 2.7, 4.0, 30.5, 1000.0])
@pytest.mark.parametrize("confidence", [0.6, 0.95, 0.999])
def test_student_quantile(browser: Chromium, dof: float, confidence: float) -> None:
    found = browser.evaluate(f"window.rftfit.studentQuantile({confidence}, {dof})")
    assert found == pytest.approx(float(student_quantile(confidence, dof)), rel=1e-9)


def test_keys_move_the_cell_of_a_map(browser: Chromium) -> None:
    label = "document.querySelector('#map-pair svg').getAttribute('aria-label')"
    assert "beta 0°, gamma 90°: 0.35" in browser.evaluate(label)
    browser.evaluate("document.querySelector('#map-pair svg').focus()")
    browser.press("ArrowUp")
    browser.press("ArrowLeft", 2)
    assert "beta 30°, gamma 56.3°" in browser.evaluate(label)
    readout = browser.evaluate("document.querySelector('#map-readout').textContent")
    for name in ("measured", "nine terms", "zeta \N{MULTIPLICATION SIGN} generic", "depth-only"):
        assert name in readout
    # no further than the edge
    browser.press("ArrowDown", 20)
    assert "beta \N{MINUS SIGN}90°" in browser.evaluate(label)


def test_click_chooses_a_cell_and_a_hole_says_why(browser: Chromium) -> None:
    browser.evaluate(
        "(() => { const s = document.querySelector('#map-medium');"
        f" s.value = '{HOLED}'; s.dispatchEvent(new Event('change')); }})()"
    )
    browser.click('#map-pair svg[data-component="x"] rect[data-row="2"][data-col="9"]')
    readout = browser.evaluate("document.querySelector('#map-readout').textContent")
    assert "beta = \N{MINUS SIGN}30°, gamma = 45°" in readout
    assert "no tare: rod_p_017 is too short" in readout
    assert "no value" in readout


def test_slider_turns_the_leg_by_key_and_by_mouse(browser: Chromium, inputs: PageInputs) -> None:
    scene = "document.querySelector('#viewer-scene').innerHTML"
    before = browser.evaluate(scene)
    browser.evaluate("document.querySelector('#viewer-theta').focus()")
    browser.press("ArrowLeft", 40)
    assert (
        browser.evaluate("document.querySelector('#viewer-theta-out').value") == "\N{MINUS SIGN}40°"
    )
    assert browser.evaluate(scene) != before
    arrows = browser.evaluate("document.querySelectorAll('#viewer-scene .arrow').length")
    assert arrows > 15
    rows = inputs.predicted.query("medium == 'poppy_LP' and leg == 'c_leg' and theta_deg == -40")
    wanted = float(rows.loc[rows["profile"] == "table", "force_z_N"].iloc[0])
    readout = browser.evaluate("document.querySelector('#viewer-readout').textContent")
    assert f"{wanted:.2f}" in readout
    browser.click("#viewer-theta", x_part=0.75)
    assert browser.evaluate("Number(document.querySelector('#viewer-theta').value)") > 50
    browser.click("#viewer-z", x_part=0.5)
    assert abs(browser.evaluate("Number(document.querySelector('#viewer-theta').value)")) < 15


def test_play_turns_the_leg_and_stops(browser: Chromium) -> None:
    value = "Number(document.querySelector('#viewer-theta').value)"
    browser.click("#viewer-play")
    moved = browser.evaluate(
        "new Promise((done) => { const begun = performance.now(); const look = () => "
        f"{value} > 3 || performance.now() - begun > 5000 ? done({value}) : setTimeout(look, 20);"
        " look(); })"
    )
    assert moved > 3
    browser.click("#viewer-play")
    stopped = browser.evaluate(value)
    later = browser.evaluate(f"new Promise((done) => setTimeout(() => done({value}), 200))")
    assert later == stopped


def test_field_calculator_by_keyboard(browser: Chromium, inputs: PageInputs) -> None:
    result = "document.querySelector('#calc-numbers').textContent"
    browser.click("#calc-alpha")
    browser.type_text("0.689")
    scaled = scale_from(references_of(inputs)[0], 0.689, 0.0, 0.95)
    text = browser.evaluate(result)
    assert f"{scaled.zeta:.4f}" in text
    assert f"{scaled.zeta_lo:.4f} to {scaled.zeta_hi:.4f}" in text
    browser.type_text("0,689")
    message = browser.evaluate("document.querySelector('#calc-message').textContent")
    assert message.endswith("Write a decimal point: 0.689")
    assert browser.evaluate("document.querySelector('#calc-result').hidden") is True
    browser.type_text("689")
    message = browser.evaluate("document.querySelector('#calc-message').textContent")
    assert "another unit" in message
    browser.type_text("0.35")
    browser.press("Tab")
    assert browser.evaluate("document.activeElement.id") == "calc-se"
    assert browser.evaluate("document.querySelector('#calc-result').hidden") is False


@pytest.mark.parametrize("width", [360, 1280])
def test_page_is_no_wider_than_the_screen(chromium: Chromium, address: str, width: int) -> None:
    chromium.open(address, width=width)
    assert chromium.evaluate("document.documentElement.scrollWidth") <= width
    small = chromium.evaluate(
        "[...document.querySelectorAll('select, input, button')]"
        ".filter((e) => e.offsetParent && e.type !== 'range' && e.getBoundingClientRect().height < 36).length"
    )
    assert small == 0
    assert chromium.complaints() == []


def test_script_in_a_title_does_not_run(chromium: Chromium, tmp_path: Path) -> None:
    target = tmp_path / "nasty.html"
    target.write_text(render(page_inputs(nasty=True)), encoding="utf-8")
    chromium.open(target.as_uri())
    assert chromium.evaluate("window.hacked") is None
    assert "</script>" in chromium.evaluate("document.querySelector('#map-medium').textContent")
    assert chromium.complaints() == []


def test_policy_stops_a_foreign_script(chromium: Chromium, address: str) -> None:
    chromium.open(address)
    chromium.evaluate(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 1';"
        " document.body.append(s); })()"
    )
    assert chromium.evaluate("window.hacked") is None
