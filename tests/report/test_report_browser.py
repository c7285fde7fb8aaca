"""In a real browser, the report page gives the library's numbers and obeys clicks and keys.

One browser serves all tests. Those that ask for numbers share one page; those that move something
open it anew.
"""

import json
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chromium import Chromium, find
from numpy.testing import assert_allclose
from result_tables import FRAMES, HOLED, empty_grid_results, page_results, sand_results

from rftfit import FourierProfile, ScaledMedium, estimate_map, find_peaks, plan, predict, rotation
from rftfit.campaign.config import Leg
from rftfit.forces.motion import THETA_DEG, rotation_poses
from rftfit.forces.outlines import leg_outline
from rftfit.forces.reference_kernel import element_forces, place, pose_forces
from rftfit.measure.alpha import column
from rftfit.model.draws import interval
from rftfit.model.scaling import published, scale_new_medium
from rftfit.model.shapes import grid
from rftfit.page.live import live_profiles, scale_in_all_directions, scaling_references
from rftfit.page.page import page

PROGRAM = find()
pytestmark = [
    pytest.mark.page,
    pytest.mark.skipif(
        PROGRAM is None, reason="no Chromium on this machine, so the live parts are not tested"
    ),
]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return page_results(tmp_path_factory.mktemp("campaign"), robot=True)


@pytest.fixture(scope="module")
def address(results):
    target = results.root / "report.html"
    target.write_text(page(results), "utf-8")
    return target.as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    assert PROGRAM is not None
    with Chromium(PROGRAM, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def browser(chromium, address):
    """The page as it opens, but for what is folded."""
    chromium.open(address)
    chromium.evaluate(
        "for (const folded of document.querySelectorAll('details.tool')) folded.open = true"
    )
    yield chromium
    assert chromium.complaints() == []
    assert chromium.requests() == [address]


@pytest.fixture
def numbers(chromium, address):
    """The page as another test may have left it: for its functions and numbers."""
    if chromium.evaluate("location.href") != address:
        chromium.open(address)
    return chromium


SLOW = 4
"""How much slower than a desktop a machine may be that runs the tests beside others."""


def array(values):
    """Nested lists of the page as an array; what JSON has no word for comes back as None."""
    return np.array(values, dtype=float)


def legs(results):
    return {
        name: intruder
        for name, intruder in results.config.intruders.items()
        if isinstance(intruder, Leg)
    }


@pytest.mark.parametrize("medium", ["poppy_LP", HOLED, "yuma"])
def test_forces_on_every_element_equal_those_of_the_library(numbers, results, medium):
    theta = np.radians(THETA_DEG)
    unknown = set()
    for name, leg in legs(results).items():
        outline, poses = leg_outline(leg), rotation_poses(theta, leg.hip_height_cm)
        elements = place(outline.body, outline.width_cm, poses)
        for profile, ours in live_profiles(results, medium).items():
            page_forces = numbers.evaluate(
                f"(() => {{ const r = window.rftfit, p = r.data.profiles['{medium}']['{profile}'];"
                f" const leg = r.data.legs['{name}'];"
                " const at = [...Array(271).keys()].map((i) => ((i - 135) * Math.PI) / 180);"
                " const all = at.map((t) => r.elementForces(p, leg, t, r.data.rate));"
                " return {each: all, net: all.map((e) => r.netForce(e, leg))}; })()"
            )
            expected = element_forces(ours, elements)
            assert_allclose(array(page_forces["each"]), expected, atol=1e-9, rtol=0)
            net = pose_forces(ours, outline.body, outline.width_cm, outline.solid, poses)
            assert_allclose(array(page_forces["net"]), net, atol=1e-9, rtol=0)
            if np.isnan(net).any():
                unknown.add(profile)
    # a table with holes must leave some unknown, or this would not have tested them
    assert unknown == ({"table"} if medium == HOLED else set())


def test_alpha_on_the_whole_torus_equals_that_of_the_library(numbers, results):
    rng = np.random.default_rng(1)
    angles = np.concatenate(
        [
            rng.uniform([-4, -7], [4, 7], (300, 2)),
            # nodes and the seams of the torus
            [[b, g] for b in (-np.pi / 2, 0, np.pi / 2) for g in (-np.pi, -np.pi / 2, 0, np.pi)],
        ]
    )
    for profile, ours in live_profiles(results, "poppy_CP").items():
        page_alpha = numbers.evaluate(
            f"{json.dumps(angles.tolist())}.map(([b, g]) =>"
            f" window.rftfit.alphaOf(window.rftfit.data.profiles.poppy_CP.{profile}, b, g))"
        )
        expected = np.stack(ours.alpha(angles[:, 0], angles[:, 1]), axis=-1)
        assert_allclose(array(page_alpha), expected, atol=1e-9)


@pytest.mark.parametrize("se", [0.0, 0.03])
@pytest.mark.parametrize("which", ["campaign", "print"])
def test_calculator_equals_the_scaling_routine(numbers, results, which, se):
    reference = published() if which == "print" else scaling_references(results)[0]
    scaled = scale_new_medium(0.42, se, reference.chi, 0.95)

    def scale(of, of_table=None):
        fitted = [of(terms) for terms in reference.scaled]
        tables = [] if of_table is None else [of_table(table) for table in reference.tables]
        media_values, measured = ScaledMedium.of_media(fitted, tables)
        return scaled.with_interval(of(reference.m0), media_values, measured=measured)

    beta, gamma = (
        grid.ravel()
        for grid in np.meshgrid(np.radians([-60, 0, 30]), np.radians([-45, 0, 90]), indexing="ij")
    )
    page_numbers = numbers.evaluate(
        "(() => { const r = window.rftfit;"
        f" const ref = r.data.references[{1 if which == 'print' else 0}];"
        f" const s = r.scaleNewMedium(0.42, {se}, ref);"
        " const legs = Object.values(r.data.legs).map((leg) =>"
        " r.scaledSweep(s, ref, leg, [...Array(271).keys()].map((i) => i - 135), r.data.rate));"
        f" const at = {json.dumps(np.stack([beta, gamma], -1).tolist())};"
        " return {s, m: r.scaledCoefficients(s, ref), legs: legs.map((f) => [f.z, f.x]),"
        " alpha: at.map(([b, g]) => r.scaledAlpha(s, ref, b, g))}; })()"
    )
    zeta = [scaled.zeta, scaled.zeta_lo, scaled.zeta_hi]
    assert_allclose(page_numbers["s"]["zeta"], zeta, rtol=1e-9)
    chi = [scaled.chi, scaled.chi_lo, scaled.chi_hi]
    assert_allclose(page_numbers["s"]["chi"], chi, rtol=1e-9)
    assert_allclose(array(page_numbers["m"]), np.stack(scale(np.copy), -1), atol=1e-9)
    both = scale(
        lambda terms: np.stack(FourierProfile(terms).alpha(beta, gamma), -1),
        lambda table: np.stack(table.alpha(beta, gamma), -1),
    )
    assert_allclose(array(page_numbers["alpha"]), np.stack(both, -1), atol=1e-8)
    for leg, curves in zip(legs(results).values(), page_numbers["legs"], strict=True):
        outline = leg_outline(leg)
        poses = rotation_poses(np.radians(THETA_DEG), leg.hip_height_cm)

        def sweep(profile, outline=outline, poses=poses):
            forces = pose_forces(profile, outline.body, outline.width_cm, outline.solid, poses)
            return forces[:, :2].T

        expected = scale(lambda terms, sweep=sweep: sweep(FourierProfile(terms)), sweep)
        assert_allclose(array(curves), np.stack(expected, -1), atol=1e-6)


def test_policy_stops_a_foreign_script(chromium, address):
    chromium.open(address)
    chromium.evaluate(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 1';"
        " document.body.append(s); })()"
    )
    assert chromium.evaluate("window.hacked") is None


def test_keys_move_the_cell_of_a_map(browser):
    label = "document.querySelector('#map-pair svg').getAttribute('aria-label')"
    assert "β 0°, γ 90°: 0.35" in browser.evaluate(label)
    readout = "document.querySelector('#map-readout').textContent"
    assert "By symmetry αx is 0 here" in browser.evaluate(readout)
    browser.evaluate("document.querySelector('#map-pair svg').focus()")
    browser.press("ArrowUp")
    assert "By symmetry" not in browser.evaluate(readout)
    browser.press("ArrowLeft", 2)
    assert "β 30°, γ 56.3°" in browser.evaluate(label)
    # no further than the edge
    browser.press("ArrowDown", 20)
    assert "β \N{MINUS SIGN}90°" in browser.evaluate(label)


def test_click_chooses_a_cell_and_a_hole_says_why(browser):
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


def test_map_of_a_sand_is_shown_with_its_intervals(browser, results):
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


def test_slider_turns_the_leg_by_key_and_by_mouse(browser, results):
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


def test_play_turns_the_leg_and_stops(browser):
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


def in_page(numbers, alpha, se):
    """The calculator's map of a push, at the nodes of `grid`, which it shows; se NaN: not known."""
    nodes_deg = np.degrees(grid()).T.round(4).tolist()
    page_map: dict[str, Any] = numbers.evaluate(
        "(() => { const r = window.rftfit;"
        f" const map = r.scaleMap(r.data.push, {alpha}, {'NaN' if np.isnan(se) else se});"
        f" return {{...map, alpha: {json.dumps(nodes_deg)}.map(([b, g]) => map.alpha(b, g))}}; }})()"
    )
    return page_map


def on_lines(estimated):
    """Draws of a map at the nodes that the calculator shows, and which of them were pushed."""
    return estimated.draws[..., : estimated.lines], estimated.measured[: estimated.lines]


def one_push(alpha, se):
    """The library's map of the same push."""
    push = {"beta_deg": [0], "gamma_deg": [90], column("z"): [alpha], column("z", "_se"): [se]}
    return estimate_map(pd.DataFrame(push))


@pytest.mark.parametrize(("alpha", "se"), [(0.35, 0.0), (2.1, 0.0), (0.35, np.nan), (2.1, np.nan)])
def test_map_of_a_push_equals_that_of_the_library(numbers, results, alpha, se):
    page_map, ours = in_page(numbers, alpha, se), one_push(alpha, se)
    close = partial(assert_allclose, rtol=6e-6, atol=1e-9)  # of six digits
    draws, _ = on_lines(ours)
    expected = np.stack([draws.mean(axis=0), *interval(draws, 0.95)], axis=-1)
    close(array(page_map["alpha"]), expected.swapaxes(0, 1))
    close(page_map["zeta"], ours.zeta)
    for name, leg in legs(results).items():
        body, turn = leg_outline(leg), rotation(None, leg.hip_height_cm)
        forces, curves = predict(ours.profile, body, turn), page_map["legs"][name]
        peaks = {peak.name: peak for peak in find_peaks(ours.profile, body, turn)}
        side = max(peaks["thrust"], peaks.get("drag", peaks["thrust"]), key=lambda p: abs(p.value))
        for c, peak, (force, theta) in zip(
            "zx", (peaks["lift"], side), curves["peaks"], strict=True
        ):
            ends = ("", "_lo", "_hi", "_model_lo", "_model_hi")
            of_library = forces[[f"force_{c}{end}_N" for end in ends]].to_numpy()
            # ends near 0 are differences: the value and the distance to it each have six digits
            allowed = 6e-6 * np.abs(of_library) + 1e-5 * np.abs(of_library[:, :1]) + 1e-9
            assert (np.abs(array(curves[c]) - of_library) <= allowed).all()
            of_alpha, of_model = (peak.lo, peak.hi), (peak.model_lo, peak.model_hi)
            # what is no number in the page comes as none
            shown = array(force)
            close([*shown, theta], [peak.value, *of_alpha, *of_model, peak.position])


@pytest.mark.parametrize("percent", [1.0, 3.0])
def test_error_of_the_push_widens_the_map(numbers, percent):
    """Ends from other draws than the library's: alike but for the noise of a quantile of 1000 draws."""
    page_map, ours = in_page(numbers, 0.35, 0.0035 * percent), one_push(0.35, 0.0035 * percent)
    _, lo, hi = array(page_map["alpha"]).T
    draws, down = on_lines(ours)
    ends = interval(draws, 0.95)
    half = (ends[1] - ends[0]) / 2
    free = half > 1e-9
    for end, expected in zip((lo, hi), ends, strict=True):
        off = (end - expected)[free] / half[free]
        assert abs(off.mean()) < 0.08
        assert np.sqrt((off**2).mean()) < 0.15
    # where the error is all there is
    assert_allclose((hi - lo)[0, down] / 2, half[0, down], rtol=0.1)


def test_next_push_is_that_of_the_plan(browser):
    step = plan("map", one_push(1.0, 0.0), count=1).steps[1]
    beta, gamma = step.directions[0]
    words = f"β {beta:.3g}°, γ {gamma:.3g}°. It narrows"
    assert words in browser.evaluate("document.querySelector('#calculator').innerText")


def test_a_large_error_is_told_to_widen_more(numbers):
    page_map, ours = in_page(numbers, 0.35, 0.07), one_push(0.35, 0.07)
    _, lo, hi = array(page_map["alpha"]).T
    ends = interval(on_lines(ours)[0], 0.95)
    free = ends[1] - ends[0] > 1e-9
    assert 1 < ((ends[1] - ends[0])[free] / (hi - lo)[free]).mean() < 1.25


RESULT = "document.querySelector('#calc-result').innerText"
MESSAGE = "document.querySelector('#calc-message').textContent"
HIDDEN = "document.querySelector('#calc-result').hidden"
FOCUS = "document.activeElement.id"


def test_field_calculator_by_keyboard(browser, results):
    assert browser.evaluate(HIDDEN) is False  # a medium of the campaign stands there, with its zeta
    assert browser.evaluate("document.querySelector('#calc-medium').value") == "poppy_LP"
    zeta, *_ = scale_in_all_directions(results, "poppy_LP")["zeta"]
    assert f"{zeta:.4f}" in browser.evaluate(RESULT)
    measured_alpha = results.table("alpha/poppy_LP.csv").query("beta_deg == 0 and gamma_deg == 90")[
        column("z")
    ]
    shown = browser.evaluate("document.querySelector('#calc-alpha').value")
    assert float(shown) == pytest.approx(measured_alpha.iloc[0], abs=5e-5)
    browser.click("#calc-alpha")
    browser.type_text("0.689")
    scaled = scale_new_medium(0.689, 0.0, scaling_references(results)[-1].chi, 0.95)
    assert browser.evaluate("document.querySelector('#calc-medium').value") == ""
    exact = in_page(browser, 0.689, np.nan)["zeta"]
    text = browser.evaluate(RESULT)
    for value in (scaled.zeta, scaled.zeta_lo, scaled.zeta_hi, *exact):
        assert f"{value:.4f}" in text
    browser.press("Tab")
    assert browser.evaluate(FOCUS) == "calc-se"
    browser.type_text("0.05")
    assert f"{in_page(browser, 0.689, 0.05)['zeta'][0]:.4f}" in browser.evaluate(RESULT)
    assert f"{exact[1]:.4f}" not in browser.evaluate(RESULT)
    browser.press("Tab")
    assert browser.evaluate(FOCUS) == "calc-reference"
    # a leg is chosen, and a direction of the map
    before = browser.evaluate("document.querySelector('#calc-z').innerHTML")
    browser.evaluate("document.querySelector('#calc-leg').focus()")
    browser.press("ArrowDown")
    assert browser.evaluate("document.querySelector('#calc-z').innerHTML") != before
    browser.evaluate("document.querySelector('#calc-maps svg').focus()")
    browser.press("ArrowUp")
    assert "β = 30°, γ = 90°" in browser.evaluate(RESULT)


@pytest.mark.parametrize(
    ("alpha", "se", "told"),
    [
        ("", "", "α_z: found nothing; allowed: a number from 0.001 to 1000"),
        ("abc", "", 'α_z: found "abc"; allowed'),
        ("0,35", "", "Write a decimal point: 0.35"),
        ("-0.35", "", 'found "-0.35"; allowed'),
        ("0", "", 'found "0"; allowed'),
        ("1e999", "", 'found "1e999"'),
        ("0x10", "", 'found "0x10"'),
        ("NaN", "", 'found "NaN"'),
        (
            "0.35",
            "-1",
            'Standard error: found "-1"; allowed: a number from 0 to α_z, N/cm³, or nothing',
        ),
        ("0.35", "0.4", 'Standard error: found "0.4"'),
        ("0.35", "0,01", "Write a decimal point: 0.01"),
        ("<img src=x onerror=window.hacked=1>", "", 'found "<img src=x onerror=window.hacked=1>"'),
    ],
)
def test_wrong_input_is_named_and_takes_the_result_away(browser, alpha, se, told):
    for name, text in (("alpha", alpha), ("se", se)):
        browser.evaluate(f"document.querySelector('#calc-{name}').focus()")
        browser.type_text(text)
    assert told in browser.evaluate(MESSAGE)
    assert browser.evaluate(HIDDEN) is True
    invalid = "[...document.querySelectorAll('#calc-form [aria-invalid=true]')].map((b) => b.id)"
    assert browser.evaluate(invalid) == [
        "calc-se" if told.startswith("Standard") or se else "calc-alpha"
    ]
    assert browser.evaluate("window.hacked") is None


@pytest.mark.parametrize(("alpha", "told"), [("689", True), ("0.001", True), ("5", False)])
def test_a_push_in_another_unit_is_asked_about(browser, alpha, told):
    browser.click("#calc-alpha")
    browser.type_text(alpha)
    assert ("is it in another unit?" in browser.evaluate(MESSAGE)) is told
    assert browser.evaluate(HIDDEN) is False


def test_robot_by_keyboard(browser):
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
    for expected in ("true", "false"):
        browser.evaluate("document.getElementById('robot-play').click()")
        assert browser.evaluate(pressed) == expected


def test_long_table_is_filtered_and_sorted(browser, results):
    errors = results.table("leg_errors.csv")
    rows = "[...document.querySelectorAll('#legs .tall tbody tr:not([hidden])')]"
    browser.click("#legs input[type=search]")
    browser.type_text("loose flat table")
    of_flat_leg = errors["leg"].eq("flat_leg") & errors["profile"].eq("table")
    expected = of_flat_leg & errors["medium"].isin(["poppy_LP", "glass0.3mm_LP"])
    assert browser.evaluate(f"{rows}.length") == expected.sum() == 4
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
        shown_value = float(
            (first if least == "min" else last)
            .replace("\N{MINUS SIGN}", "-")
            .replace("no value", "nan")
        )
        if least == "min":
            assert shown_value == pytest.approx(errors["peak_predicted_N"].min(), abs=0.005)
    assert browser.evaluate(f"{rows}.length") == len(errors)


def test_first_paint_and_print(browser):
    painted = browser.evaluate(
        "new Promise((done) => { const told = performance.getEntriesByName('first-contentful-paint');"
        " if (told.length) done(told[0].startTime); else new PerformanceObserver((list) =>"
        " done(list.getEntries()[0].startTime)).observe({type: 'paint', buffered: true}); })"
    )
    assert 0 < painted < 1000 * SLOW
    browser.call("Emulation.setEmulatedMedia", media="print")
    hidden = (
        "[...document.querySelectorAll('.tall, .controls, .on-screen, details')]"
        ".every((one) => one.offsetParent === null)"
    )
    assert browser.evaluate(hidden)
    assert browser.evaluate("document.querySelector('.findings').offsetHeight") > 0
    # small print stays in its column
    assert browser.evaluate(
        "[...document.querySelectorAll('#summary td small')].every((note) => note.scrollWidth <= note.parentElement.clientWidth)"
    )
    browser.call("Emulation.setEmulatedMedia", media="")


def test_a_link_opens_what_is_folded(browser):
    browser.evaluate(
        "for (const folded of document.querySelectorAll('details')) folded.open = false"
    )
    for target, folded in (("notes-poppy_LP", "#notes"), ("calculator", "#calculator details")):
        browser.evaluate(
            f"new Promise((done) => {{ addEventListener('hashchange', () => setTimeout(done, 0), "
            f"{{once: true}}); location.hash = '{target}'; }})"
        )
        assert browser.evaluate(f"document.querySelector('{folded}').open"), target
    browser.evaluate("history.replaceState(null, '', location.pathname)")


def test_the_first_screen_has_alpha_and_zeta_of_every_medium(browser, results):
    rows = "[...document.querySelectorAll('#summary tbody tr')]"
    assert browser.evaluate(f"{rows}.length") == len(results.media)
    heads = browser.evaluate(
        "[...document.querySelectorAll('#summary thead th')].map((head) => head.textContent.trim())"
    )
    assert [head[0] for head in heads if head[0] in "αζχ"] == ["α", "ζ", "χ"]
    bottoms = browser.evaluate(f"{rows}.map((row) => row.getBoundingClientRect().bottom)")
    assert max(bottoms) < 900


def test_no_picture_is_higher_than_the_screen(chromium, address):
    chromium.open(address)
    height = chromium.evaluate(
        "(async () => { const figure = document.createElement('figure'); figure.className = 'picture';"
        " const image = new Image(900, 1600); image.src = 'data:image/svg+xml,"
        '<svg xmlns="http://www.w3.org/2000/svg" width="900" height="1600"/>\';'
        " figure.append(image); document.querySelector('#maps').append(figure); await image.decode();"
        " const height = image.getBoundingClientRect().height; figure.remove(); return height; })()"
    )
    assert 400 < height < 860


@pytest.mark.parametrize("width", [360, 1280])
def test_page_is_no_wider_than_the_screen(chromium, address, width):
    chromium.open(address, width=width)
    assert chromium.evaluate("document.documentElement.scrollWidth") <= width
    small = chromium.evaluate(
        "[...document.querySelectorAll('select, input, button')]"
        ".filter((e) => e.offsetParent && e.type !== 'range' && e.getBoundingClientRect().height < 36).length"
    )
    assert small == 0
    assert chromium.complaints() == []


@pytest.mark.parametrize("make", [sand_results, empty_grid_results])
def test_live_parts_start_where_most_is_lacking(chromium, make, tmp_path):
    target = tmp_path / "report.html"
    target.write_text(page(make(tmp_path)), "utf-8")
    chromium.open(target.as_uri())
    assert chromium.evaluate("document.querySelectorAll('#map-pair svg').length") == 2
    assert chromium.complaints() == []


def test_script_in_a_title_does_not_run(chromium, tmp_path):
    target = tmp_path / "nasty.html"
    target.write_text(page(page_results(tmp_path, nasty=True)), "utf-8")
    chromium.open(target.as_uri())
    assert chromium.evaluate("window.hacked") is None
    assert "</script>" in chromium.evaluate("document.querySelector('#map-medium').textContent")
    assert chromium.complaints() == []
