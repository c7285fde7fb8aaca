"""The live parts of the report page in a real browser, with real clicks and keys.

One browser serves all tests. Those that ask for numbers share one page; those that move something
open it anew.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from chromium import Chromium, find
from page_inputs import FRAMES, HOLED, empty_grid_results, page_results, sand_results
from scipy.special import gammaincc, ndtri

from rftfit.campaign.config import Leg
from rftfit.measure.alpha import column
from rftfit.measure.slopes import GIVEN_DOF, student_quantile
from rftfit.model.forces import force_draws, forces_on
from rftfit.model.fourier import evaluate
from rftfit.model.motion import THETA_DEG, rotation_poses
from rftfit.model.outlines import leg_outline
from rftfit.model.planning import plan
from rftfit.model.profile_file import write_profile
from rftfit.model.profiles import FourierProfile, TableProfile
from rftfit.model.reference_kernel import element_forces, place, pose_forces
from rftfit.model.scaling import published, scale_new_medium, vertical_penetration
from rftfit.model.shapes import estimate_map, grid
from rftfit.page.live import profiles, references
from rftfit.page.page import page

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.model.scaling import Interval
    from rftfit.results import Results

PROGRAM = find()
pytestmark = pytest.mark.skipif(
    PROGRAM is None, reason="no Chromium on this machine, so the live parts are not tested"
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return page_results(tmp_path_factory.mktemp("campaign"), robot=True)


@pytest.fixture(scope="module")
def address(results: Results) -> str:
    target = results.root / "report.html"
    target.write_text(page(results), encoding="utf-8")
    return target.as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    assert PROGRAM is not None
    with Chromium(PROGRAM, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def browser(chromium: Chromium, address: str) -> Iterator[Chromium]:
    """The page as it opens."""
    chromium.open(address)
    yield chromium
    assert chromium.complaints() == []
    assert chromium.requests() == [address]


@pytest.fixture
def numbers(chromium: Chromium, address: str) -> Chromium:
    """The page as another test may have left it: for its functions and numbers."""
    if chromium.evaluate("location.href") != address:
        chromium.open(address)
    return chromium


@pytest.fixture
def pasting(numbers: Chromium) -> Iterator[Chromium]:
    """The page as another test may have left it, with one good push in its calculator."""
    paste(numbers, "0,90,0.35")
    assert numbers.evaluate(MESSAGE) == ""
    yield numbers
    assert numbers.complaints() == []


SLOW = 4
"""How much slower than a desktop a machine may be that runs the tests beside others."""


def array(values: Any) -> FloatArray:
    """Nested lists of the page as an array; what JSON has no word for comes back as None."""
    return np.array(values, dtype=float)


def legs(results: Results) -> dict[str, Leg]:
    return {name: one for name, one in results.config.intruders.items() if isinstance(one, Leg)}


@pytest.mark.parametrize("medium", ["poppy_LP", HOLED, "yuma"])
def test_forces_on_every_element_equal_those_of_the_library(
    numbers: Chromium, results: Results, medium: str
) -> None:
    theta = np.radians(THETA_DEG)
    unknown = set()
    for name, leg in legs(results).items():
        outline, poses = leg_outline(leg), rotation_poses(theta, leg.hip_height_cm)
        elements = place(outline.body, outline.width_cm, poses)
        for profile, ours in profiles(results, medium).items():
            found = numbers.evaluate(
                f"(() => {{ const r = window.rftfit, p = r.data.profiles['{medium}']['{profile}'];"
                f" const leg = r.data.legs['{name}'];"
                " const at = [...Array(271).keys()].map((i) => ((i - 135) * Math.PI) / 180);"
                " const all = at.map((t) => r.elementForces(p, leg, t, r.data.rate));"
                " return {each: all, net: all.map((e) => r.netForce(e, leg))}; })()"
            )
            each = element_forces(ours, elements)
            np.testing.assert_allclose(array(found["each"]), each, atol=1e-9, rtol=0)
            net = pose_forces(ours, outline.body, outline.width_cm, outline.solid, poses)
            np.testing.assert_allclose(array(found["net"]), net, atol=1e-9, rtol=0)
            if np.isnan(net).any():
                unknown.add(profile)
    # a table with holes must leave some unknown, or this would not have tested them
    assert unknown == ({"table"} if medium == HOLED else set())


def test_alpha_on_the_whole_torus_equals_that_of_the_library(
    numbers: Chromium, results: Results
) -> None:
    rng = np.random.default_rng(1)
    angles = np.concatenate(
        [
            rng.uniform([-4, -7], [4, 7], (300, 2)),
            # nodes and the seams of the torus
            [[b, g] for b in (-np.pi / 2, 0, np.pi / 2) for g in (-np.pi, -np.pi / 2, 0, np.pi)],
        ]
    )
    for profile, ours in profiles(results, "poppy_CP").items():
        found = numbers.evaluate(
            f"{json.dumps(angles.tolist())}.map(([b, g]) =>"
            f" window.rftfit.alphaOf(window.rftfit.data.profiles.poppy_CP.{profile}, b, g))"
        )
        wanted = np.stack(ours.alpha(angles[:, 0], angles[:, 1]), axis=-1)
        np.testing.assert_allclose(array(found), wanted, atol=1e-9)


@pytest.mark.parametrize("se", [0.0, 0.03])
@pytest.mark.parametrize("which", ["campaign", "print"])
def test_calculator_equals_the_scaling_routine(
    numbers: Chromium, results: Results, which: str, se: float
) -> None:
    reference = published() if which == "print" else references(results)[0]
    scaled = scale_new_medium(0.42, se, reference.chi, 0.95)

    def scale(of: Callable[[FloatArray], FloatArray]) -> Interval:
        each = np.stack([of(own) for own in reference.scaled])
        return scaled.with_interval(of(reference.m0), each)

    beta, gamma = (
        grid.ravel()
        for grid in np.meshgrid(np.radians([-60, 0, 30]), np.radians([-45, 0, 90]), indexing="ij")
    )
    found = numbers.evaluate(
        "(() => { const r = window.rftfit;"
        f" const ref = r.data.references[{1 if which == 'print' else 0}];"
        f" const s = r.scaleNewMedium(0.42, {se}, ref, 0.95);"
        " const legs = Object.values(r.data.legs).map((leg) =>"
        " r.scaledSweep(s, ref, leg, [...Array(271).keys()].map((i) => i - 135), r.data.rate));"
        f" const at = {json.dumps(np.stack([beta, gamma], -1).tolist())};"
        " return {s, m: r.scaledCoefficients(s, ref), legs: legs.map((f) => [f.z, f.x]),"
        " alpha: at.map(([b, g]) => r.scaledAlpha(s, ref, b, g))}; })()"
    )
    zeta = [scaled.zeta, scaled.zeta_lo, scaled.zeta_hi]
    np.testing.assert_allclose(found["s"]["zeta"], zeta, rtol=1e-9)
    chi = [scaled.chi, scaled.chi_lo, scaled.chi_hi]
    np.testing.assert_allclose(found["s"]["chi"], chi, rtol=1e-9)
    np.testing.assert_allclose(array(found["m"]), np.stack(scale(np.copy), -1), atol=1e-9)
    both = scale(lambda own: np.stack(evaluate(own, beta, gamma), -1))
    np.testing.assert_allclose(array(found["alpha"]), np.stack(both, -1), atol=1e-9)
    for leg, curves in zip(legs(results).values(), found["legs"], strict=True):
        outline = leg_outline(leg)
        poses = rotation_poses(np.radians(THETA_DEG), leg.hip_height_cm)

        def sweep(own: FloatArray, outline: Any = outline, poses: FloatArray = poses) -> FloatArray:
            profile: Profile = FourierProfile(own)
            forces = pose_forces(profile, outline.body, outline.width_cm, outline.solid, poses)
            return forces[:, :2].T

        np.testing.assert_allclose(array(curves), np.stack(scale(sweep), -1), atol=1e-6)


def test_calculator_equals_rftfit_scale_for_any_error(numbers: Chromium) -> None:
    random = np.random.default_rng(7)
    alpha, relative = 10 ** random.uniform(-1, 0.7, 100), 10 ** random.uniform(-4, 0, 100)
    confidence = random.uniform(0.6, 0.99, 100)
    tests = np.stack([alpha, alpha * relative, confidence], -1).tolist()
    found = numbers.evaluate(
        f"{json.dumps(tests)}.map(([alpha, se, level]) => window.rftfit.scaleNewMedium("
        "alpha, se, window.rftfit.data.references[1], level).zeta)"
    )
    reference = published()
    scaled = [scale_new_medium(one, se, reference.chi, level) for one, se, level in tests]
    wanted = [[one.zeta, one.zeta_lo, one.zeta_hi] for one in scaled]
    np.testing.assert_allclose(array(found), wanted, rtol=1e-9)


@pytest.mark.parametrize("confidence", [0.6, 0.95, 0.999])
def test_student_quantile(numbers: Chromium, confidence: float) -> None:
    dof = [1.0, 2.7, 4.0, 30.5, 1000.0]
    found = numbers.evaluate(f"{dof}.map((n) => window.rftfit.studentQuantile({confidence}, n))")
    wanted = [float(student_quantile(confidence, n)) for n in dof]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_policy_stops_a_foreign_script(chromium: Chromium, address: str) -> None:
    chromium.open(address)
    chromium.evaluate(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 1';"
        " document.body.append(s); })()"
    )
    assert chromium.evaluate("window.hacked") is None


def test_keys_move_the_cell_of_a_map(browser: Chromium) -> None:
    label = "document.querySelector('#map-pair svg').getAttribute('aria-label')"
    assert "β 0°, γ 90°: 0.35" in browser.evaluate(label)
    browser.evaluate("document.querySelector('#map-pair svg').focus()")
    browser.press("ArrowUp")
    browser.press("ArrowLeft", 2)
    assert "β 30°, γ 56.3°" in browser.evaluate(label)
    # no further than the edge
    browser.press("ArrowDown", 20)
    assert "β \N{MINUS SIGN}90°" in browser.evaluate(label)


def test_click_chooses_a_cell_and_a_hole_says_why(browser: Chromium) -> None:
    browser.evaluate(
        "(() => { const s = document.querySelector('#map-medium');"
        f" s.value = '{HOLED}'; s.dispatchEvent(new Event('change')); }})()"
    )
    browser.click('#map-pair svg[data-component="x"] rect[data-row="2"][data-col="9"]')
    readout = browser.evaluate("document.querySelector('#map-readout').textContent")
    assert "β = \N{MINUS SIGN}30°, γ = 45°" in readout
    assert "no tare: rod_p_017 is too short" in readout
    rows = browser.evaluate("document.querySelectorAll('#map-readout tr').length")
    assert rows == 5  # measured, and four profiles


def test_map_of_a_sand_is_shown_with_its_intervals(browser: Chromium, results: Results) -> None:
    browser.evaluate(
        "(() => { const s = document.querySelector('#map-medium');"
        " s.value = 'yuma'; s.dispatchEvent(new Event('change')); })()"
    )
    assert browser.evaluate("document.querySelector('#map-profile').value") == "map"
    browser.click('#map-pair svg[data-component="z"] rect[data-row="5"][data-col="9"]')
    readout = browser.evaluate("document.querySelector('#map-readout').innerText")
    table = results.table("maps/yuma.csv").query("beta_deg == 60 and abs(gamma_deg - 45) < 0.1")
    for c in "zx":
        for end in ("", "_lo", "_hi"):
            number = f"{table[column(c, end)].iloc[0]:.4f}".replace("-", "\N{MINUS SIGN}")
            assert number in readout
    assert readout.endswith("estimated")
    # a level plate on its way down
    browser.click('#map-pair svg[data-component="x"] rect[data-row="3"][data-col="12"]')
    assert "0.0000\nby symmetry" in browser.evaluate(
        "document.querySelector('#map-readout').innerText"
    )


def test_slider_turns_the_leg_by_key_and_by_mouse(browser: Chromium, results: Results) -> None:
    scene = "document.querySelector('#viewer-scene').innerHTML"
    before = browser.evaluate(scene)
    browser.evaluate("document.querySelector('#viewer-theta').focus()")
    browser.press("ArrowLeft", 40)
    out = browser.evaluate("document.querySelector('#viewer-theta-out').value")
    assert out == "\N{MINUS SIGN}40°"
    assert browser.evaluate(scene) != before
    arrows = browser.evaluate("document.querySelectorAll('#viewer-scene .arrow').length")
    assert arrows > 15
    rows = results.table("predicted.csv").query(
        "medium == 'poppy_LP' and leg == 'c_leg' and theta_deg == -40 and profile == 'table'"
    )
    readout = browser.evaluate("document.querySelector('#viewer-readout').textContent")
    assert f"{rows['force_z_N'].iloc[0]:.2f}" in readout
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


def field_pushes(count: int) -> pd.DataFrame:
    """Pushes of a truth in scattered directions: alpha_x, errors and some of both not stated."""
    random = np.random.default_rng(count)
    beta, gamma = random.uniform(-90, 90, (2, count))
    beta[0], gamma[0] = 0, 90
    if count > 2:  # a node, its mirror image, and once more
        beta[1:3], gamma[1:3] = [30, 30], [90, 90]
        beta[-1], gamma[-1] = -30, 90
    alpha = TableProfile.published("poppy_LP").alpha(np.radians(beta), np.radians(gamma))
    z, x = np.stack(alpha) * random.normal(1, 0.1, (2, count))
    x[::3] = np.nan
    se = np.where(
        random.uniform(size=(2, count)) < 0.5, np.nan, random.uniform(0, 0.03, (2, count))
    )
    names = [
        "beta_deg",
        "gamma_deg",
        column("z"),
        column("x"),
        column("z", "_se"),
        column("x", "_se"),
    ]
    return pd.DataFrame(dict(zip(names, (beta, gamma, z, x, *se), strict=True)))


def in_page(pushes: pd.DataFrame) -> str:
    """Pushes as the functions of the page take them."""
    rows = [
        {"beta_deg": b, "gamma_deg": g, "alpha": [z, x], "se": [se_z, se_x]}
        for b, g, z, x, se_z, se_x in pushes.to_numpy().tolist()
    ]
    return json.dumps(rows)  # JavaScript knows NaN


@pytest.mark.parametrize("count", [1, 3, 6, 12])
def test_map_of_pushes_equals_that_of_the_library(
    numbers: Chromium, results: Results, count: int
) -> None:
    pushes = field_pushes(count)
    found = numbers.evaluate(
        "(() => { const r = window.rftfit, d = r.data, shapes = d.shapes;"
        " const grid = r.makeGrid(shapes, d.beta_deg, d.gamma_deg);"
        f" const map = r.estimateMap(shapes, grid, {in_page(pushes)});"
        " const theta = [...Array(271).keys()].map((i) => i - 135);"
        " return {...map, covariance: map.covariance.map((row) => [...row]),"
        " next: r.nextPush(shapes, grid, map), zeta: r.zetaOfMap(grid, map),"
        " legs: Object.values(d.legs).map((leg) => [1, -1].map((way) =>"
        " r.sweepMap(grid, map, leg, theta, way * d.rate)))}; })()"
    )
    ours = estimate_map(pushes)
    scale = np.abs(ours.alpha).max()
    np.testing.assert_allclose(found["alpha"], ours.alpha.ravel(), atol=1e-6 * scale, rtol=0)
    rows = ours.factor.reshape(len(ours.factor), -1)
    covariance = array(found["covariance"])
    np.testing.assert_allclose(covariance, rows.T @ rows, atol=1e-6 * np.abs(covariance).max())
    deviation = np.sqrt(np.diag(rows.T @ rows))
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation, atol=1e-6 * scale, rtol=0)
    assert found["measured"] == ours.measured.tolist()
    assert found["dof"] == ours.dof
    for name in ("size", "distance", "horizontal", "belongs"):
        wanted = getattr(ours, name)
        assert array(found[name]) == pytest.approx(wanted, rel=1e-5, nan_ok=True), name
    assert ours.farthest is not None
    worst, place = found["farthest"], found["farthest"]["place"]
    at = np.degrees([place["beta"], place["gamma"]])
    np.testing.assert_allclose(at, [ours.farthest.beta_deg, ours.farthest.gamma_deg])
    expected = [worst["value"] - worst["off"], worst["error"]]
    np.testing.assert_allclose(expected, [ours.farthest.expected, ours.farthest.error], rtol=1e-5)

    terms = ours.coefficients(np.concatenate([ours.alpha[None], ours.factor]))
    zeta = vertical_penetration(terms)
    wanted = [zeta[0], np.sqrt(np.sum(zeta[1:] ** 2))]
    np.testing.assert_allclose(found["zeta"], wanted, rtol=1e-6)

    steps = plan("map", ours, count=1).steps
    at = np.degrees([found["next"]["beta"], found["next"]["gamma"]])
    np.testing.assert_allclose(at, steps[1].directions[0], atol=1e-9)
    assert found["next"]["runs"] == steps[1].runs
    wide = float(student_quantile(0.95, GIVEN_DOF))
    half = [wide * found["next"][when] for when in ("before", "after")]
    np.testing.assert_allclose(half, [step.typical for step in steps], rtol=1e-6)

    best = TableProfile(ours.alpha[0], ours.alpha[1], ours.beta, ours.gamma)
    parts = TableProfile(ours.factor[:, 0], ours.factor[:, 1], ours.beta, ours.gamma)
    for leg, ways in zip(legs(results).values(), found["legs"], strict=True):
        outline = leg_outline(leg)
        for way, curves in zip((1, -1), ways, strict=True):  # backward: directions behind the grid
            poses = rotation_poses(np.radians(THETA_DEG), leg.hip_height_cm, way)
            force, each = forces_on(best, outline, poses), force_draws(parts, outline, poses)
            for c in "zx":
                value, errors = getattr(force, f"force_{c}_N"), getattr(each, f"force_{c}_N")
                wanted = np.stack([value, np.sqrt((errors**2).sum(axis=0))], -1)
                np.testing.assert_allclose(array(curves[c]), wanted, atol=1e-5, rtol=0)


def test_a_horizontal_push_counts_the_runs_that_it_takes(numbers: Chromium) -> None:
    """Where all other directions were pushed a horizontal one is next."""
    beta, gamma = (np.degrees(angle) for angle in grid())
    use = gamma != 0
    alpha = TableProfile.published("poppy_LP").alpha(*np.radians([beta[use], gamma[use]]))
    columns = (beta[use], gamma[use], *alpha, *np.full((2, use.sum()), 1e-4))
    pushes = field_pushes(1).iloc[:0].reindex(range(use.sum()))
    pushes[:] = np.stack(columns, axis=1)
    found = numbers.evaluate(
        "(() => { const r = window.rftfit, d = r.data, shapes = d.shapes;"
        " const grid = r.makeGrid(shapes, d.beta_deg, d.gamma_deg);"
        f" return r.nextPush(shapes, grid, r.estimateMap(shapes, grid, {in_page(pushes)})); }})()"
    )
    step = plan("map", estimate_map(pushes), count=1).steps[1]
    assert step.directions[0][1] == 0
    assert (np.degrees(found["beta"]), found["gamma"]) == pytest.approx(step.directions[0])
    assert found["runs"] == step.runs > 1


def test_quantiles_and_chances(numbers: Chromium) -> None:
    at = [(0.5, 1e-9), (0.5, 0.3), (0.5, 40.0), (1.0, 2.0), (2.5, 2.4), (11.5, 30.0), (90.0, 80.0),
          (90.0, 140.0), (2.0, 800.0)]  # fmt: skip
    found = numbers.evaluate(f"{json.dumps(at)}.map(([a, x]) => window.rftfit.upperGamma(a, x))")
    np.testing.assert_allclose(found, gammaincc(*np.transpose(at)), rtol=1e-9)
    levels = [0.5, 0.9, 0.95, 0.999]
    found = numbers.evaluate(f"{levels}.map((level) => window.rftfit.normalQuantile(level))")
    np.testing.assert_allclose(found, ndtri(0.5 + np.array(levels) / 2), rtol=1e-9)


RESULT = "document.querySelector('#calc-result').innerText"
MESSAGE = "document.querySelector('#calc-message').textContent"
HIDDEN = "document.querySelector('#calc-result').hidden"
INPUTS = "[...document.querySelectorAll('#calc-rows tr')].map((r) => [...r.querySelectorAll('input')].map((b) => b.value))"
FOCUS = "document.activeElement.getAttribute('aria-label') || document.activeElement.id"


def test_field_calculator_by_keyboard(browser: Chromium, results: Results) -> None:
    assert browser.evaluate(HIDDEN) is False  # one push works at once
    assert "One number tells how strong the medium is" in browser.evaluate(RESULT)
    browser.click("#calc-rows input")
    browser.press("Tab", 2)
    assert browser.evaluate(FOCUS) == "Push 1, α_z"
    browser.type_text("0.689")
    reference = references(results)[-1]
    scaled = scale_new_medium(0.689, 0.0, reference.chi, 0.95)
    ours = estimate_map(pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], column("z"): [0.689]}))
    text = browser.evaluate(RESULT)
    for value in (scaled.zeta, scaled.zeta_lo, scaled.zeta_hi, ours.zeta[0]):
        assert f"{value:.4f}" in text
    browser.type_text("0,689")
    assert "Write a decimal point: 0.689" in browser.evaluate(MESSAGE)
    assert browser.evaluate(HIDDEN) is True
    browser.type_text("689")
    assert "another unit" in browser.evaluate(MESSAGE)
    browser.type_text("0.35")
    assert browser.evaluate(MESSAGE) == ""

    browser.press("Tab", 4)  # the only row cannot be removed
    assert browser.evaluate(FOCUS) == "calc-add"
    browser.press(" ")
    assert browser.evaluate(FOCUS) == "Push 2, β, \N{DEGREE SIGN}"
    assert browser.evaluate(HIDDEN) is False  # an empty row is no push yet
    for text in ("30", "45", "0.2"):
        browser.type_text(text)
        browser.press("Tab")
    browser.type_text("0.08")
    assert "for 2, and alpha_x is" in browser.evaluate(RESULT)
    browser.press("Tab", 3)
    assert browser.evaluate(FOCUS) == "Remove push 2"
    browser.press(" ")
    assert browser.evaluate(INPUTS) == [["0", "90", "0.35", "", "", ""]]
    assert browser.evaluate(FOCUS) == "Push 1, β, \N{DEGREE SIGN}"


def test_next_push_is_added_to_the_table(browser: Chromium) -> None:
    one = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], column("z"): [0.35]})
    beta, gamma = plan("map", estimate_map(one), count=1).steps[1].directions[0]
    browser.click("#calc-next")
    added = browser.evaluate(INPUTS)[1]
    np.testing.assert_allclose([float(text) for text in added[:2]], [beta, gamma], atol=0.005)
    assert browser.evaluate(FOCUS) == "Push 2, α_z"


def test_a_medium_that_does_not_belong_is_told_so(pasting: Chromium) -> None:
    paste(pasting, "0,90,0.35\n60,10,0.05,0.9\n90,0,0.02,0.8\n30,45,0.2,0.7")
    assert "do not trust what is estimated" in pasting.evaluate(RESULT)
    # and one without the push straight down has no routine to stand beside
    paste(pasting, "30,45,0.2,0.08")
    assert "needs a push at β 0" in pasting.evaluate(RESULT)
    assert pasting.evaluate("document.querySelector('#calc-terms').hidden") is True


def paste(browser: Chromium, text: str) -> None:
    browser.evaluate(
        f"(() => {{ document.querySelector('#calc-paste').value = {json.dumps(text)};"
        " document.querySelector('#calc-take').click(); })()"
    )


NAMES = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3,se_z,se_x"


@pytest.mark.parametrize(
    "text",
    [
        "0,90,0.35,,0.01,\n-30,45,0.2,0.08",
        f"# made by hand\n{NAMES}\r\n0,90,0.35,,0.01,\r\n\r\n-30,45,0.2,0.08,,\r\n",
        "0\t90\t0.35\t\t0.01\n\N{MINUS SIGN}30\t45\t0.2\t0.08",
        'alpha_z_N_per_cm3;gamma_deg;of;beta_deg;"alpha_x_N_per_cm3";se_z\n0.35;90;a;0;;0.01\n0.2;45;b;-30;0.08;',
    ],
)
def test_tables_that_are_pasted(pasting: Chromium, text: str) -> None:
    paste(pasting, text)
    rows = [
        [cell.replace("\N{MINUS SIGN}", "-") for cell in row] for row in pasting.evaluate(INPUTS)
    ]
    assert rows == [["0", "90", "0.35", "", "0.01", ""], ["-30", "45", "0.2", "0.08", "", ""]]
    assert pasting.evaluate(MESSAGE) == ""
    assert pasting.evaluate(HIDDEN) is False


def test_profile_file_fills_the_rows(browser: Chromium, tmp_path: Path) -> None:
    pushes = pd.DataFrame(
        [[0.0, 90.0, 0.35, np.nan, 0.01, np.nan], [30.0, 45.0, 0.2, 0.1, np.nan, np.nan]],
        columns=["beta_deg", "gamma_deg", *(f"alpha_{c}_N_per_cm3" for c in "zx"),
                 *(f"alpha_{c}_se_N_per_cm3" for c in "zx")],
    )  # fmt: skip
    write_profile(tmp_path / "profile.json", estimate_map(pushes))
    text = (tmp_path / "profile.json").read_text(encoding="utf-8")
    browser.evaluate(
        "(() => { const files = new DataTransfer(), input = document.querySelector('#calc-file');"
        f" files.items.add(new File([{json.dumps(text)}], 'profile.json')); input.files = files.files;"
        " input.dispatchEvent(new Event('change')); })()"
    )
    shown = browser.evaluate(
        "new Promise((done) => setTimeout(() => done([...document.querySelectorAll('#calc-rows tr')]"
        ".map((row) => [...row.querySelectorAll('input')].map((one) => one.value))), 300))"
    )
    assert [row[:4] for row in shown] == [["0", "90", "0.35", ""], ["30", "45", "0.2", "0.1"]]
    assert shown[0][4] == "0.01"
    browser.evaluate("document.querySelector('#calc-paste').value = '{\"pushes\": 1}'")
    browser.evaluate("document.querySelector('#calc-take').click()")
    assert "no profile" in browser.evaluate("document.querySelector('#calc-pasted').textContent")


def test_a_table_pasted_into_a_cell_fills_the_rows(pasting: Chromium) -> None:
    pasting.evaluate(
        "(() => { const clipboardData = new DataTransfer();"
        " clipboardData.setData('text', '0,90,0.35\\n30,45,0.2,0.08\\n');"
        " document.querySelector('#calc-rows input').dispatchEvent("
        "new ClipboardEvent('paste', {clipboardData, bubbles: true, cancelable: true})); })()"
    )
    assert [row[2] for row in pasting.evaluate(INPUTS)] == ["0.35", "0.2"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "Found no row"),
        (NAMES, "Found no row"),
        ("beta_deg,gamma_deg\n0,90", "no column alpha_z_N_per_cm3"),
        ("0,90,0.35\n" * 200, "Found 200 rows; at most 100"),
        ("0,90,abc", 'Push 1, α_z: found "abc"; a number from \N{MINUS SIGN}1000 to 1000'),
        ("0,90,0.3\n0,450,0.3", 'Push 2, γ, \N{DEGREE SIGN}: found "450"'),
        ("0,90,NaN", 'found "NaN"'),
        ("0,90,1e999", 'found "1e999"'),
        ("0,90,0x10", 'found "0x10"'),
        ("0,90,0.3,,-1", 'error of z: found "-1"; a number from 0 to 1000, or nothing'),
        ("0;90;0,35", "Write a decimal point: 0.35"),
        ("0,90,-0.35", "meet no resistance"),
        ("0,90,0", "meet no resistance"),
        ("0,90,1e-300", "meet no resistance"),
        ("0,90,,0.3", "Push 1, α_z"),
        ("<img src=x onerror=window.hacked=1>,90,1", 'found "<img src=x onerror=window.hacked=1>"'),
        (",,,,,\n,,,,,", "Type α_z of at least one push"),
    ],
)
def test_pasted_nonsense_is_told_in_words(pasting: Chromium, text: str, told: str) -> None:
    paste(pasting, text)
    words = pasting.evaluate(f"document.querySelector('#calc-pasted').textContent + {MESSAGE}")
    assert told in words
    assert pasting.evaluate("window.hacked") is None


def test_any_pushes_give_a_map_or_words(numbers: Chromium) -> None:
    """Extreme but allowed numbers: repeats without an error, and sizes far apart."""
    made = numbers.evaluate(
        "(() => { const r = window.rftfit, d = r.data;"
        " const grid = r.makeGrid(d.shapes, d.beta_deg, d.gamma_deg); let seed = 1;"
        " const any = (of) => of[(seed = (seed * 48271) % 2147483647) % of.length];"
        " const push = () => [any(['0', '90', '-90', '33.3']), any(['90', '-90', '0', '-12']),"
        " any(['1000', '1e-9', '-1', '0', '0.3']), any(['', '1e3', '-1e-12', '0.1']),"
        " any(['', '0', '1000', '1e-200']), any(['', '0', '0.01'])];"
        " return [...Array(60).keys()].map((i) => {"
        " const { pushes, wrong } = r.pushesOf([...Array(1 + (i % 9)).keys()].map(push));"
        " const map = wrong.length ? null : r.estimateMap(d.shapes, grid, pushes);"
        " if (!map) return 'none';"
        " const all = [...map.alpha, ...map.covariance.map((row, k) => row[k]), r.nextPush(d.shapes, grid, map).after];"
        " return all.every(Number.isFinite) ? 'map' : JSON.stringify(pushes); }); })()"
    )
    assert set(made) <= {"map", "none"}
    assert made.count("map") > 20


def test_robot_by_keyboard(browser: Chromium) -> None:
    assert browser.evaluate("document.querySelectorAll('#robot-chart circle').length") == 42
    assert browser.evaluate("document.querySelectorAll('#robot-chart path').length") == 7
    lines = "[...document.querySelectorAll('#robot-scene .leg.first')].map((l) => l.getAttribute('d')).join()"
    before = browser.evaluate(lines)
    browser.evaluate("document.getElementById('robot-frame').focus()")
    browser.press("ArrowRight", 9)
    assert browser.evaluate("document.getElementById('robot-frame').value") == "9"
    assert browser.evaluate(lines) != before
    run = next(r for r in FRAMES["runs"] if (r["curvature"], r["frequency_Hz"]) == (0, 2))
    arrows = run["arrows"][9]
    drawn = browser.evaluate("document.querySelectorAll('#robot-scene .arrow').length")
    assert drawn == len(arrows) // 4
    text = browser.evaluate("document.getElementById('robot-readout').innerText")
    assert f"{run['speed_cm_per_s']:.1f} cm/s" in text
    assert f"{sum(arrows[3::4]) / 1000:.2f}" in text
    pressed = "document.getElementById('robot-play').getAttribute('aria-pressed')"
    for wanted in ("true", "false"):
        browser.evaluate("document.getElementById('robot-play').click()")
        assert browser.evaluate(pressed) == wanted


def test_long_table_is_filtered_and_sorted(browser: Chromium, results: Results) -> None:
    errors = results.table("leg_errors.csv")
    rows = "[...document.querySelectorAll('#legs tbody tr:not([hidden])')]"
    browser.click("#legs input[type=search]")
    browser.type_text("loose flat table")
    known = errors["leg"].eq("flat_leg") & errors["profile"].eq("table")
    wanted = known & errors["medium"].isin(["poppy_LP", "glass0.3mm_LP"])
    assert browser.evaluate(f"{rows}.length") == wanted.sum() == 4
    assert browser.evaluate(
        "document.querySelector('#legs .filter [role=status]').textContent"
    ) == (f"4 of {len(errors)} rows")
    browser.evaluate("document.querySelector('#legs input[type=search]').focus()")
    browser.type_text("")
    head = "#legs thead th:nth-child(6) button"
    shown = f"{rows}.map((row) => row.cells[5].firstChild.textContent)"
    for order, least in (("ascending", "min"), ("descending", "max")):
        browser.click(head)
        assert browser.evaluate(f"document.querySelector('{head}').parentElement.ariaSort") == order
        first, last = browser.evaluate(
            f"(() => {{ const all = {shown}; return [all[0], all.at(-1)]; }})()"
        )
        found = float(
            (first if least == "min" else last)
            .replace("\N{MINUS SIGN}", "-")
            .replace("no value", "nan")
        )
        if least == "min":
            assert found == pytest.approx(errors["peak_predicted_N"].min(), abs=0.005)
    assert browser.evaluate(f"{rows}.length") == len(errors)


def test_columns_below_a_common_heading_are_sorted_by_their_own(browser: Chromium) -> None:
    browser.evaluate("[...document.querySelectorAll('#summary thead button')].at(-1).click()")
    texts = browser.evaluate(
        "[...document.querySelectorAll('#summary tbody tr')].map((row) => row.cells[row.cells.length - 1].textContent)"
    )
    known = [
        float(text.split()[0].replace("\N{MINUS SIGN}", "-"))
        for text in texts
        if text[:1] in "+\N{MINUS SIGN}0"
    ]
    assert len(known) >= 4
    assert known == sorted(known)


def test_first_paint_and_print(browser: Chromium) -> None:
    painted = browser.evaluate(
        "new Promise((done) => { const told = performance.getEntriesByName('first-contentful-paint');"
        " if (told.length) done(told[0].startTime); else new PerformanceObserver((list) =>"
        " done(list.getEntries()[0].startTime)).observe({type: 'paint', buffered: true}); })"
    )
    assert 0 < painted < 1000 * SLOW
    browser.call("Emulation.setEmulatedMedia", media="print")
    hidden = (
        "[...document.querySelectorAll('.tall, .controls, #viewer, #calculator, details')]"
        ".every((one) => one.offsetParent === null)"
    )
    assert browser.evaluate(hidden)
    assert browser.evaluate("document.querySelector('.findings').offsetHeight") > 0
    browser.call("Emulation.setEmulatedMedia", media="")


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


@pytest.mark.parametrize("make", [sand_results, empty_grid_results])
def test_live_parts_start_where_most_is_lacking(
    chromium: Chromium, make: Callable[[Path], Results], tmp_path: Path
) -> None:
    target = tmp_path / "report.html"
    target.write_text(page(make(tmp_path)), encoding="utf-8")
    chromium.open(target.as_uri())
    assert chromium.evaluate("document.querySelectorAll('#map-pair svg').length") == 2
    assert chromium.complaints() == []


def test_script_in_a_title_does_not_run(chromium: Chromium, tmp_path: Path) -> None:
    target = tmp_path / "nasty.html"
    target.write_text(page(page_results(tmp_path, nasty=True)), encoding="utf-8")
    chromium.open(target.as_uri())
    assert chromium.evaluate("window.hacked") is None
    assert "</script>" in chromium.evaluate("document.querySelector('#map-medium').textContent")
    assert chromium.complaints() == []
