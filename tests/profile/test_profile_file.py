"""The profile file: what goes in comes out, in three languages; what was changed is found."""

from __future__ import annotations

import copy
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from light_campaign import alpha_frame
from paper_grid import BETA, GAMMA, by_hand

import rftfit
from rftfit import reference
from rftfit.campaign.schema import all_keys
from rftfit.errors import InputError
from rftfit.model.draws import interval, measured_profile
from rftfit.model.profile_file import read_content
from rftfit.model.profile_schema import ProfileFile, main
from rftfit.reference import MEDIA

Z, X = "alpha_z_N_per_cm3", "alpha_x_N_per_cm3"
PUSHES = pd.DataFrame(
    {"beta_deg": [0, 60, -30, 12], "gamma_deg": [90, 45, 0, 73], Z: [0.35, 0.2, 0.1, 0.3],
     X: [0, 0.1, 0.2, np.nan]}
)  # fmt: skip
OUTLINES = ("c_leg", "reversed_c_leg")


def small_map(pushes):
    """A map with few draws: its file is read many times below."""
    whole = rftfit.estimate_map(pushes, name="sand")
    return replace(whole, draws=whole.draws[:150])


@pytest.fixture(scope="module")
def sand():
    return small_map(PUSHES)


@pytest.fixture(scope="module")
def written(sand, tmp_path_factory):
    path = tmp_path_factory.mktemp("profile") / "sand é.json"
    rftfit.write_profile(path, sand, title="Sand", notes="dry", window=(1.0, 8.0))
    return path


def read(path, **changes):
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content | changes


def plane(step=7.5):
    """Directions all over the plane and beyond one period."""
    mesh = np.meshgrid(np.arange(-200, 200, step), np.arange(-400, 400, step + 0.1), indexing="ij")
    return mesh[0].ravel(), mesh[1].ravel()


def same_forces(own, other, tolerance=1e-6):
    for name in OUTLINES:
        wanted, found = (
            rftfit.predict(one, rftfit.model_leg(name)).drop(columns="reason")
            for one in (own, other)
        )
        assert list(found) == list(wanted)
        assert np.isfinite(wanted).all(axis=None)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=tolerance)


# --- there and back


def test_a_map_comes_back_with_its_intervals(sand, written):
    found, own = rftfit.read_profile(written), sand.profile
    same_forces(own, found)
    assert (found.name, found.window) == (own.name, (1.0, 8.0))
    assert found.spread is not None
    angles = np.radians(plane(23))
    for a, b in zip(own.alpha(*angles), found.alpha(*angles), strict=True):
        np.testing.assert_allclose(b, a, atol=1e-10)


def test_the_file_says_what_the_map_says(sand, written):
    content = read_content(written)
    assert content.medium.model_dump() == {"name": "sand", "title": "Sand", "notes": "dry"}
    assert content.zeta is not None
    assert content.nine_terms is not None
    np.testing.assert_allclose(
        [content.zeta.value, content.zeta.lo or 0, content.zeta.hi or 0], sand.zeta, rtol=1e-9
    )
    terms = [*content.nine_terms.model_dump().values()]
    np.testing.assert_allclose(terms, sand.coefficients(), rtol=1e-9, atol=1e-12)
    assert content.origin.pushes == 4
    assert content.origin.known_media == ", ".join(MEDIA)
    # three of the four lie on the grid: one level, its own mirror image, and two with theirs; beta = 60
    # and -30 are lines inside
    assert sum(map(sum, content.nodes.measured)) == 5 + 1
    assert written.stat().st_size < 400_000


def test_standard_errors_are_those_of_the_draws(sand, written):
    sampled_errors(sand.profile, written)


def test_another_program_may_count_the_signs_the_other_way(written, tmp_path):
    content = read(written, digest="")
    errors = content["errors"]
    errors["sign_x"] = turned(errors["sign_x"])
    errors["draws_x_N_per_cm3"] = turned(errors["draws_x_N_per_cm3"])
    (tmp_path / "p.json").write_text(json.dumps(content), encoding="utf-8")
    same_forces(rftfit.read_profile(written), rftfit.read_profile(tmp_path / "p.json"))


@pytest.mark.parametrize("case", ["grid", "holes", "scattered"])
def test_nine_terms_are_those_of_what_was_measured(case, tmp_path):
    """Neither what symmetry completes nor what is interpolated between the cells has a weight."""
    random = np.random.default_rng(8)
    truth = [0.2, 0.15, 0.2, 0.35, 0.06, -0.1, 0.25, 0.05, 0.1]
    cells = np.array([BETA, GAMMA]) if case != "scattered" else random.uniform(-1.5, 1.5, (2, 60))
    alpha = random.normal(rftfit.FourierProfile(truth).alpha(*cells), 0.01)
    if case == "holes":
        alpha[:, [0, 12, 13, 40, 90]] = np.nan
    first, again = tmp_path / "first.json", tmp_path / "again.json"
    table = rftfit.TableProfile(*alpha, *cells)
    table.spread = rftfit.TableProfile(*np.stack([alpha, 1.1 * alpha, 0.9 * alpha], axis=1), *cells)
    rftfit.write_profile(first, table)
    wanted = by_hand(*cells, *alpha)
    np.testing.assert_allclose([*read(first)["nine_terms"].values()], wanted, rtol=1e-6)
    assert read(first)["zeta"]["value"] == pytest.approx(wanted[:5].sum(), rel=1e-6)
    assert read(first)["zeta"]["hi"] == pytest.approx(1.095 * wanted[:5].sum(), rel=1e-6)
    if case == "grid":
        rftfit.write_profile(again, rftfit.read_profile(first))
        np.testing.assert_allclose([*read(again)["nine_terms"].values()], wanted, rtol=1e-6)


def test_a_measured_table_comes_back(paper_config, tmp_path):
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    own = measured_profile(table, paper_config)
    path = tmp_path / "table.json"
    rftfit.write_profile(path, own)
    found = rftfit.read_profile(path)
    outline = rftfit.model_leg("c_leg")
    wanted, forces = rftfit.predict(own, outline), rftfit.predict(found, outline)
    for name in ("force_z", "force_x"):
        np.testing.assert_allclose(forces[f"{name}_N"], wanted[f"{name}_N"], atol=1e-9)
        half, other = (
            (one[f"{name}_hi_N"] - one[f"{name}_lo_N"]).to_numpy(float) / 2
            for one in (wanted, forces)
        )
        # drawn anew from the covariance of the draws: as wide, within the error of 1,000 draws
        assert abs(other.sum() / half.sum() - 1) < 0.04
    sampled_errors(own, path)
    assert path.stat().st_size < 4_000_000


def test_holes_stay_holes(paper_config, tmp_path):
    z, x = (one.copy() for one in reference.alpha_grid("poppy_CP"))
    z[4, 3] = x[4, 3] = np.nan
    own = measured_profile(alpha_frame("poppy_CP", (z, x)), paper_config)
    path = tmp_path / "holes.json"
    rftfit.write_profile(path, own)
    found, angles = rftfit.read_profile(path), np.radians(plane(9.3))
    for a, b in zip(own.alpha(*angles), found.alpha(*angles), strict=True):
        assert 0 < np.isnan(a).sum() < a.size / 10
        np.testing.assert_allclose(b, a, atol=1e-10)
    assert found.reason == own.reason != ""
    assert isinstance(own.spread, rftfit.TableProfile)
    assert isinstance(found.spread, rftfit.TableProfile)
    np.testing.assert_array_equal(
        np.isnan(found.spread.alpha_z[0]), np.isnan(own.spread.alpha_z[0])
    )


def sampled_errors(own, path):
    """Standard errors in the file are those of the draws."""
    golden = read_content(path).golden
    at = np.radians(golden.beta_deg), np.radians(golden.gamma_deg)
    assert isinstance(own.spread, rftfit.TableProfile)
    z, x = own.spread.alpha(*at)
    found = [golden.se_z_N_per_cm3, golden.se_x_N_per_cm3, golden.covariance_zx]
    wanted = [z.std(ddof=1), x.std(ddof=1), np.cov(z, x)[0, 1]]
    np.testing.assert_allclose(np.array(found, dtype=float), wanted, rtol=1e-4, atol=1e-10)


def test_scattered_directions_come_back(tmp_path):
    random = np.random.default_rng(3)
    beta, gamma = np.radians(random.uniform(-90, 90, (2, 40)))
    z, x = rftfit.published_medium("glass3mm_CP").alpha(beta, gamma)
    many_z, many_x = (one + random.normal(0, 0.01, (30, 40)) for one in (z, x))
    spread = rftfit.TableProfile(many_z, many_x, beta, gamma)
    own = rftfit.TableProfile(z, x, beta, gamma, spread=spread)
    path = tmp_path / "s.json"
    rftfit.write_profile(path, own)
    found, angles = rftfit.read_profile(path), np.radians(plane(9.3))
    for a, b in zip(own.alpha(*angles), found.alpha(*angles), strict=True):
        np.testing.assert_allclose(b, a, atol=1e-10)
    assert not np.any(read_content(path).nodes.measured)
    sampled_errors(own, path)


def test_lines_that_close_a_grid_are_not_called_measured(tmp_path):
    medium, lines = rftfit.published_medium("poppy_LP"), np.radians([-60, -20, 20, 60])
    gamma = np.radians([-80, -40, -10, 10, 40, 80])
    own = rftfit.TableProfile(*medium.alpha(lines[:, None], gamma), lines[:, None], gamma)
    rftfit.write_profile(tmp_path / "p.json", own)
    nodes = read_content(tmp_path / "p.json").nodes
    rows = dict(zip(nodes.beta_deg, nodes.measured, strict=True))
    assert not any(rows[-90]) | any(rows[90])
    assert sum(rows[-60]) == 12
    same_forces(own, rftfit.read_profile(tmp_path / "p.json"))


def test_exact_pushes_have_no_error(tmp_path):
    rows = rftfit.published_table("table_s5")
    rows = rows[rows["medium"] == "poppy_LP"].assign(
        **{f"alpha_{c}_se_N_per_cm3": 0.0 for c in "zx"}
    )
    rftfit.write_profile(tmp_path / "p.json", rftfit.estimate_map(rows))
    spread = rftfit.read_profile(tmp_path / "p.json").spread
    assert isinstance(spread, rftfit.TableProfile)
    lo, hi = interval(spread.alpha_z, 0.95)
    assert (hi - lo).max() < 1e-5


def test_the_same_map_gives_the_same_bytes(written, tmp_path):
    again = small_map(PUSHES.iloc[::-1])
    rftfit.write_profile(tmp_path / "a", again, title="Sand", notes="dry", window=(1.0, 8.0))
    assert (tmp_path / "a").read_bytes() == written.read_bytes()


def test_what_is_no_table_is_refused(tmp_path):
    fourier: Any = rftfit.published_medium("poppy_LP", "fourier")
    with pytest.raises(
        InputError, match=r"write_profile\(path, profile\): found a str; allowed: a map"
    ):
        rftfit.write_profile(rftfit.TableProfile.published("poppy_LP"), "p.json")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"found a FourierProfile; allowed: a map or a table"):
        rftfit.write_profile(tmp_path / "p.json", fourier)
    z = np.full((7, 13), np.nan)
    z[3, 12] = 0.5
    with pytest.raises(InputError, match="too few directions"):
        rftfit.write_profile(tmp_path / "p.json", rftfit.TableProfile(z, 0 * z))
    table: Any = rftfit.published_medium("poppy_LP")
    with pytest.raises(InputError, match=r"title: text without control characters"):
        rftfit.write_profile(tmp_path / "p.json", table, title="\x1b[2J")
    assert not (tmp_path / "p.json").exists()


def test_a_file_that_none_would_read_is_not_written(tmp_path):
    random = np.random.default_rng(0)
    beta, gamma = random.uniform(-1.5, 1.5, (2, 150))
    z, x = random.normal(0.3, 0.01, (2, 150))
    many_z, many_x = random.normal(0.3, 0.01, (2, 900, 150))
    spread = rftfit.TableProfile(many_z, many_x, beta, gamma)
    own = rftfit.TableProfile(z, x, beta, gamma, spread=spread)
    with pytest.raises(
        InputError, match=r"found .* MB with the errors of 2701 nodes; allowed: 20 MB"
    ):
        rftfit.write_profile(tmp_path / "p.json", own)
    assert not (tmp_path / "p.json").exists()


# --- other readers


def evaluated(command, beta, gamma, cwd):
    angles = "".join(f"{b!r} {g!r}\n" for b, g in zip(beta.tolist(), gamma.tolist(), strict=True))
    done = subprocess.run(
        command, input=angles, capture_output=True, text=True, check=True, cwd=cwd, timeout=120
    )
    return np.array([[float(word) for word in line.split()] for line in done.stdout.splitlines()]).T


def needs(tool):
    found = shutil.which(tool)
    if found is None:
        pytest.skip(f"no {tool} on this machine")
    return found


def in_numpy(examples, _):
    return [sys.executable, "-W", "error", str(examples / "alpha.py")]


def in_c(examples, folder):
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1"]
    program = str(folder / "alpha")
    subprocess.run(
        [needs("cc"), *flags, str(examples / "alpha.c"), "-o", program, "-lm"], check=True
    )
    return [program]


def in_octave(examples, folder):
    # the path comes last: argv holds it
    script = folder / "run.m"
    script.write_text(
        f"addpath('{examples}'); words = argv(); a = fscanf(stdin, '%f', [2 Inf])';\n"
        "[z, x] = alpha_of(jsondecode(fileread(words{end})), a(:, 1), a(:, 2));\n"
        "printf('%.17g %.17g\\n', [z x]');\n",
        encoding="utf-8",
    )
    return [needs("octave"), "--no-gui", "--quiet", "--norc", str(script)]


@pytest.mark.parametrize("language", [in_numpy, in_c, in_octave])
@pytest.mark.parametrize("source", ["map", "table"])
def test_other_languages_agree(
    language, source, sand,
    pytestconfig, tmp_path,
):  # fmt: skip
    own: Any = sand if source == "map" else rftfit.published_medium("glass0.3mm_LP")
    rftfit.write_profile(tmp_path / "profile.json", own)
    profile = sand.profile if source == "map" else own
    command = language(pytestconfig.rootpath / "examples" / "profile", tmp_path)
    beta, gamma = plane()
    found = evaluated([*command, "profile.json"], beta, gamma, tmp_path)
    wanted = profile.alpha(np.radians(beta), np.radians(gamma))
    assert np.abs(wanted).max(axis=1).min() > 0.05
    assert (np.abs(gamma) > 90).sum() > 1000
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("language", [in_numpy, in_c, in_octave])
def test_other_languages_know_no_more(language, pytestconfig, tmp_path):
    z, x = (one.copy() for one in reference.alpha_grid("poppy_CP"))
    z[4, 3] = x[4, 3] = np.nan
    own = rftfit.TableProfile(z, x)
    rftfit.write_profile(tmp_path / "profile.json", own)
    command = language(pytestconfig.rootpath / "examples" / "profile", tmp_path)
    beta, gamma = plane(9.3)
    found = evaluated([*command, "profile.json"], beta, gamma, tmp_path)
    wanted = np.array(own.alpha(np.radians(beta), np.radians(gamma)))
    assert np.isnan(wanted).any()
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


# --- what was changed on the way


def refused(tmp_path, content):
    path = tmp_path / "p.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        rftfit.read_profile(path)
    return str(caught.value)


def turned(table):
    return [[-value for value in row] for row in table]


def flip(table):
    return [row[::-1] for row in table]


WRONG: dict[str, tuple[Callable[[list[Any], list[Any]], tuple[list[Any], list[Any]]], str]] = {
    "lift down": (lambda z, x: (turned(z), x), "the sign of alpha_z is turned"),
    "x backward": (lambda z, x: (z, turned(x)), "the sign of alpha_x is turned"),
    "both": (lambda z, x: (turned(z), turned(x)), "the signs of alpha_z and alpha_x are turned"),
    "swapped": (lambda z, x: (x, z), "alpha_z and alpha_x are swapped"),
    "beta": (lambda z, x: (z[::-1], x[::-1]), "beta counts the other way"),
    "gamma": (lambda z, x: (flip(z), flip(x)), "gamma counts the other way"),
    "beta and gamma": (
        lambda z, x: (flip(z)[::-1], flip(x)[::-1]), "beta and gamma count the other way"
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("medium", MEDIA)
def test_another_convention_is_named(kind, medium, tmp_path):
    own: Any = rftfit.published_medium(medium)
    rftfit.write_profile(tmp_path / "own.json", own)
    content = read(tmp_path / "own.json", digest="")
    change, words = WRONG[kind]
    nodes, golden = content["nodes"], content["golden"]
    right = {Z: golden[Z], X: golden[X]}
    nodes[Z], nodes[X] = change(nodes[Z], nodes[X])
    said = refused(tmp_path, content)
    assert f"in the nodes {words}" in said
    # the component, what was found, and what was expected
    for name in {"lift down": [Z], "x backward": [X]}.get(kind, [Z, X]):
        assert f"allowed: {right[name]:.6g}, the golden value {name}" in said


@pytest.mark.parametrize("name", [Z, X, "nine_terms_z_N_per_cm3", "nine_terms_x_N_per_cm3"])
def test_a_golden_value_that_was_turned_is_seen(name, written, tmp_path):
    content = read(written)
    content["golden"][name] *= -1
    said = refused(tmp_path, content)
    assert said.count(name) == 1
    assert "1 error" in said


@pytest.mark.parametrize("component", "zx")
def test_turned_terms_are_named(component, written, tmp_path):
    content = read(written)
    own = "AB" if component == "z" else "CD"
    terms = content["nine_terms"]
    content["nine_terms"] = {n: -v if n[0] in own else v for n, v in terms.items()}
    said = refused(tmp_path, content)
    assert f"in the nine_terms the sign of alpha_{component} is turned" in said


def test_errors_turned_against_each_other_are_seen(written, tmp_path):
    content = read(written, digest="")
    content["errors"]["draws_x_N_per_cm3"] = turned(content["errors"]["draws_x_N_per_cm3"])
    assert "key errors: found" in (said := refused(tmp_path, content))
    assert "the golden value covariance_zx" in said


def test_every_single_sign_is_seen(written, tmp_path):
    """A node alone breaks the symmetry; the digest is there where it has no mirror image."""
    content = read(written, digest="")
    rows, columns = len(content["nodes"]["beta_deg"]), len(content["nodes"]["gamma_deg"])
    random = np.random.default_rng(1)
    seen = 0
    for name in (Z, X):
        for row, column in zip(
            random.integers(0, rows, 12), random.integers(0, columns, 12), strict=True
        ):
            one = copy.deepcopy(content)
            value = one["nodes"][name][row][column]
            level_push = row == rows // 2 and column in (columns // 4, 3 * columns // 4)
            if abs(value) < 1e-3 or level_push:
                continue
            one["nodes"][name][row][column] = -value
            said = refused(tmp_path, one)
            assert f"nodes.{name}." in said
            assert "by symmetry with" in said
            seen += 1
    assert seen > 12
    pair = read(written)
    pair["nodes"][Z][3][18] *= -1  # a level push is its own mirror image
    assert "key digest" in refused(tmp_path, pair)


def test_text_may_be_changed(written, tmp_path):
    content = read(written)
    content["medium"]["notes"] = "as I found it"
    (tmp_path / "p.json").write_text(json.dumps(content), encoding="utf-8")
    same_forces(rftfit.read_profile(written), rftfit.read_profile(tmp_path / "p.json"), 1e-15)


# --- damaged and hostile files


def test_hostile_texts_are_refused(written, tmp_path):
    text = written.read_text(encoding="utf-8")
    for hostile, words in {
        "": "this is not JSON",
        "hello": "line 1, column 1: this is not JSON",
        "null": "found 'null'; allowed: a profile",
        "[1, 2]": "found 'a list of 2'; allowed: a section",
        "9" * 5000: "thousands of digits",
        "[" * 200_000: "nested too deeply",
        '{"a":' * 100_000: "nested too deeply",
        text[:-500]: "this is not JSON",
        '{"format": 1, "format": 2}': "key format: found 'format'; allowed: each key once",
        json.dumps({str(n): n for n in range(50_000)}): "found '50000 keys'; allowed: at most 100",
        text.replace('"beta_deg": [-90.0', '"beta_deg": [1e999'): "nodes.beta_deg.1: found 'inf'",
        text.replace('"beta_deg": [-90.0', '"beta_deg": [NaN'): "nodes.beta_deg.1: found 'nan'",
        text.replace('"rows"', "x") + "[" * 21_000_000: "at most 20 MB are read",
    }.items():
        assert words in refused(tmp_path, hostile), words
    with pytest.raises(InputError, match="does not exist"):
        rftfit.read_profile(tmp_path / "none.json")
    with pytest.raises(InputError, match="folder or device"):
        rftfit.read_profile(tmp_path)
    (tmp_path / "p.json").write_bytes(b"\xff\xfe{}")
    with pytest.raises(InputError, match="UTF-8 text"):
        rftfit.read_profile(tmp_path / "p.json")


def put(*path, value):
    def change(content):
        *around, last = path
        for part in around:
            content = content[part]
        content[last] = value

    return change


def cut(*path):
    def change(content):
        for part in path:
            content = content[part]
        content.pop()

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (put("nodes", X, 2, 3, value=float("inf")), f"nodes.{X}.3.4: found 'inf'"),
        (put("nodes", Z, 2, 3, value=1e300), "at most 1000000"),
        (put("nodes", Z, 2, 3, value="0.1"), f"nodes.{Z}.3.4: found '0.1'"),
        (put("nodes", Z, 2, 3, value=None), "allowed: null at"),
        (put("nodes", Z, value=[[["deep"]]]), f"key nodes.{Z}.1.1: found 'a list of 1'"),
        (cut("nodes", Z), "found '6 rows'; allowed: 7 rows"),
        (cut("nodes", X, 4), f"nodes.{X}.5: found '24 entries'; allowed: 25 entries"),
        (cut("nodes", "measured", 0), "nodes.measured.1: found '24 entries'"),
        (cut("nodes", "gamma_deg"), "nodes.gamma_deg.24: found '161.565'; allowed: 180"),
        (put("nodes", "gamma_deg", 5, value=-170), "allowed: lines that rise"),
        (put("nodes", "beta_deg", value=[90, 0, -90]), "nodes.beta_deg.2: found '0'; allowed: lines"),
        (put("nodes", "beta_deg", value=[*range(1001)]), "nodes.beta_deg"),
        (cut("errors", "cell", 3), "errors.cell.4: found '24 entries'"),
        (cut("errors", "draws_z_N_per_cm3", 1), "errors.draws_z_N_per_cm3.2: found"),
        (cut("errors", "draws_x_N_per_cm3"), "errors.draws_x_N_per_cm3: found"),
        (put("errors", "draws_z_N_per_cm3", value=[]), "errors.draws_z_N_per_cm3: found"),
        (put("errors", "draws_z_N_per_cm3", value=[[0.1]] * 10**6), "errors.draws_z_N_per_cm3: found"),
        (put("nodes", "beta_deg", value=np.linspace(-90, 90, 999).tolist()), "at most 5000 nodes"),
        (put("errors", "cell", 0, 0, value=9999), "errors.cell: found '0 to 9999'"),
        (put("errors", "cell", 0, 0, value=-1), "errors.cell: found '-1 to"),
        (put("errors", "sign_x", 0, 0, value=2), "errors.sign_x: found '2'; allowed: 1 or -1"),
        (put("golden", "beta_deg", value=None), "golden.beta_deg: found 'nothing'"),
        (put("golden", "se_z_N_per_cm3", value=None), "the golden value se_z_N_per_cm3"),
        (put("version", value=1), "key version: found '1'; allowed: 2"),
        (put("medium", "nmae", value="x"), "did you mean 'name'?"),
        (put("medium", "title", value="\x1b[2J"), "medium.title: text without control"),
        (put("medium", "title", value="\ud800"), "medium.title: found"),
        (put("nine_terms", value={}), "nine_terms.A00: this key is missing"),
        (put("validity", "depth_to_cm", value=-1), "validity.depth_to_cm: found '-1'"),
        (put("zeta", "value", value=1.0), "key digest: found"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(change, words, written, tmp_path):
    content = read(written)
    change(content)
    said = refused(tmp_path, content)
    assert words in said
    assert f"{tmp_path / 'p.json'}, key " in said


def test_all_that_is_wrong_is_told_at_once(written, tmp_path):
    content = read(written, version=7)
    content["medium"]["nmae"] = ""
    del content["origin"]
    content["nodes"]["beta_deg"] = "none"
    said = refused(tmp_path, content)
    assert said.startswith("4 errors:")


def places(content, path=()):
    """Every key and entry of a file."""
    inside: Any = content.items() if isinstance(content, dict) else enumerate(content)
    found = []
    for name, value in inside:
        found.append((*path, name))
        if isinstance(value, dict | list):
            found += places(value, (*path, name))
    return found


ODD: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    7,
    1e308,
    -0.5,
    "",
    "x",
    [],
    {},
    [[]],
    [None],
    {"a": 1},
    10**30,
)


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """A small grid with errors."""
    random = np.random.default_rng(0)
    lines, gamma = np.radians([-45, 0, 45, 90])[:, None], np.radians([-90, -45, 0, 45, 90])
    z, x = rftfit.published_medium("poppy_CP").alpha(lines, gamma)
    drawn_z, drawn_x = (one + random.normal(0, 0.01, (50, *one.shape)) for one in (z, x))
    spread = rftfit.TableProfile(drawn_z, drawn_x, lines, gamma)
    path = tmp_path_factory.mktemp("few") / "few.json"
    rftfit.write_profile(path, rftfit.TableProfile(z, x, lines, gamma, spread=spread))
    return path


def is_as_it_was_or_refused(own, path):
    """Whether a damaged file is refused; else it has to say the same."""
    try:
        found = rftfit.read_profile(path)
    except InputError:
        return True
    angles = np.radians(plane(23))
    for a, b in zip(own.alpha(*angles), found.alpha(*angles), strict=True):
        np.testing.assert_array_equal(a, b)
    assert isinstance(own.spread, rftfit.TableProfile)
    assert isinstance(found.spread, rftfit.TableProfile)
    np.testing.assert_array_equal(found.spread.alpha_x, own.spread.alpha_x)
    return False


def test_no_damage_changes_a_number(few, tmp_path):
    """Entries replaced at random, and bytes."""
    random, own = np.random.default_rng(5), rftfit.read_profile(few)
    data, content, path = few.read_bytes(), read(few), tmp_path / "p.json"
    every = places(content)
    refused = 0
    for place in random.permutation(len(every))[:250]:
        one = copy.deepcopy(content)
        put(*every[place], value=ODD[int(random.integers(len(ODD)))])(one)
        path.write_text(json.dumps(one), encoding="utf-8")
        refused += is_as_it_was_or_refused(own, path)
    assert refused > 200
    for _ in range(250):
        damaged = bytearray(data)
        damaged[random.integers(len(data))] = random.integers(256)
        path.write_bytes(damaged)
        refused += is_as_it_was_or_refused(own, path)
    assert refused > 350


# --- the schema


def test_the_schema_is_in_step(pytestconfig, tmp_path):
    main(tmp_path)
    stored = pytestconfig.rootpath / "examples" / "profile" / "profile.schema.json"
    made = (tmp_path / stored.name).read_text(encoding="utf-8")
    assert stored.read_text(encoding="utf-8") == made, "run python -m rftfit.model.profile_schema"


def test_the_schema_accepts_what_is_written(written, tmp_path):
    jsonschema: Any = pytest.importorskip("jsonschema")
    main(tmp_path)
    schema = json.loads((tmp_path / "profile.schema.json").read_text(encoding="utf-8"))
    check = jsonschema.Draft202012Validator(schema)
    content = read(written)
    assert check.is_valid(content)
    content["nodes"][Z][0][0] = "0.1"
    content["medium"]["nmae"] = ""
    del content["golden"]
    assert len(list(check.iter_errors(content))) == 3


def test_the_page_names_every_key():

    keys = all_keys(ProfileFile)
    assert len(keys) > 60
    assert all(key.description for key in keys)
