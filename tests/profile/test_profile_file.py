"""A profile file gives the same alpha to every reader, and each change or damage in it is found.

Profile: alpha as a function of the directions of plate and motion, here with its errors.
"""

import copy
import json
import runpy
import shutil
import subprocess
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import run_command
from numpy.testing import assert_allclose, assert_array_equal

import rftfit
from rftfit.model.profile_schema import main

Z, X = "alpha_z_N_per_cm3", "alpha_x_N_per_cm3"
"""Columns of a profile file."""
DRAWS_Z, DRAWS_X = "draws_z_N_per_cm3", "draws_x_N_per_cm3"
PUSHES = pd.DataFrame(
    {"beta_deg": [0, 60, -30, 12], "gamma_deg": [90, 45, 0, 73], Z: [0.35, 0.2, 0.1, 0.3],
     X: [0, 0.1, 0.2, np.nan], "se_z": [0.01, np.nan, 0.02, 0.03]}
)  # fmt: skip


def small_map(pushes):
    """A map with few draws: its file is read many times below."""
    whole = rftfit.estimate_map(pushes, name="sand")
    return replace(whole, draws=whole.draws[:150])


def table_at(beta_deg, gamma_deg, *, hole=None):
    """Glass beads pushed in these directions, with 30 draws of their errors; one without a number."""
    beta, gamma = np.radians(beta_deg), np.radians(gamma_deg)
    alpha = np.array(rftfit.published_medium("glass3mm_CP").alpha(beta, gamma))
    if hole is not None:
        alpha[:, *hole] = np.nan
    shape = (2, 30, *alpha.shape[1:])
    draws = alpha[:, None] + np.random.default_rng(0).normal(0, 0.01, shape)
    spread = rftfit.TableProfile(*draws, beta, gamma)
    return rftfit.TableProfile(*alpha, beta, gamma, spread=spread)


def lines(*degrees):
    return np.array(degrees, dtype=float)[:, None]


HALF = lines(0, 30, 60, 90), [-90, -45, 0, 45, 90]
KINDS = ("map", "published", "hole", "open", "half", "scattered")


@pytest.fixture(scope="module")
def sources():
    """A map, and tables of every kind: complete, with a hole, without the lines that close it, scattered."""
    *grid, _, _ = rftfit.TableProfile.published("poppy_LP").cells
    paper = np.degrees(grid).reshape(2, 7, 13)
    return {
        "map": small_map(PUSHES),
        "published": rftfit.published_medium("glass0.3mm_LP"),
        "hole": table_at(*paper, hole=(4, 3)),
        "open": table_at(lines(-60, -20, 20, 60), [-80, -40, -10, 10, 40, 80]),
        "half": table_at(*HALF),
        "scattered": table_at(*np.random.default_rng(3).uniform(-90, 90, (2, 40))),
    }


@pytest.fixture(scope="module")
def profiles(sources):
    """The profile of every source."""
    return sources | {"map": sources["map"].profile}


@pytest.fixture(scope="module")
def files(sources, tmp_path_factory):
    folder = tmp_path_factory.mktemp("profile é")
    for kind, source in sources.items():
        rftfit.write_profile(folder / f"{kind}.json", source, title="Sand", window=(1.0, 8.0))
    return folder


def read(path):
    return json.loads(path.read_text("utf-8"))


@pytest.fixture
def content(files):
    return read(files / "map.json")


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """Files of all published media."""
    path = tmp_path_factory.mktemp("published") / "p.json"
    contents = []
    for medium in rftfit.published_shapes().profiles.values():
        rftfit.write_profile(path, medium)
        contents.append(read(path))
    return contents


def plane(step=7.5):
    """Directions all over the plane and beyond one period, degrees."""
    mesh = np.meshgrid(np.arange(-200, 200, step), np.arange(-400, 400, step + 0.1), indexing="ij")
    return np.stack([angles.ravel() for angles in mesh])


@pytest.mark.parametrize(("signs", "se"), [((1, 1, 0), 0.1), ((1, -1, 0), 0.0)])
def test_a_pair_of_mirror_images_is_one_push(signs, se):
    """Their mean is as well known as their common error lets it be."""
    beta, gamma = np.radians([30, -30, 0]), np.radians([90, 90, 45])
    draws = 1 + 0.1 * np.outer([-1, 0, 1], signs)
    spread = rftfit.TableProfile(draws, draws * [1, -1, 0], beta, gamma)
    alpha_x = np.array([0.5, -0.7, 0])
    table = rftfit.TableProfile(np.ones(3), alpha_x, beta, gamma, spread=spread)
    assert_allclose(table.pushed[:, 0], [-30, 90, 1, -0.6, se, se], atol=1e-12)
    assert table.pushed.shape == (6, 2)


def test_many_directions(monkeypatch, tmp_path):
    """More nodes than 5,000 are read as well; what none would read is not written."""
    path = tmp_path / "p.json"

    def fine(betas, gammas):
        return table_at(lines(*np.linspace(-88, 90, betas)), np.linspace(-90, 90, gammas))

    rftfit.write_profile(path, fine(90, 60))
    assert rftfit.read_profile(path).alpha_z.size > 5_000
    path.unlink()
    refused = problems_of(lambda: rftfit.write_profile(path, fine(179, 181)))
    assert {problem.place.key for problem in refused} >= {f"directions.{Z}"}
    monkeypatch.setattr("rftfit.model.profile_file._MOST_BYTES", 10_000)
    with pytest.raises(rftfit.RftfitError, match=r" 26 .* 0\.01 MB$"):
        rftfit.write_profile(path, table_at(*HALF))
    assert not path.exists()


# --- other readers


@pytest.mark.parametrize("kind", KINDS)
def test_a_reader_in_numpy(kind, profiles, files, pytestconfig):
    names = runpy.run_path(str(pytestconfig.rootpath / "examples" / "profile" / "alpha.py"))
    expected = np.array(profiles[kind].alpha(*np.radians(plane())))
    assert np.nanmax(np.abs(expected), axis=1).min() > 0.05
    alpha = names["alpha"](read(files / f"{kind}.json"), *plane())
    assert_allclose(alpha, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["map", "hole"])
def test_a_reader_in_octave(kind, profiles, files, pytestconfig, tmp_path):
    if (octave := shutil.which("octave")) is None:
        pytest.skip("no octave on this machine")
    script = tmp_path / "run.m"
    script.write_text(
        f"addpath('{pytestconfig.rootpath / 'examples' / 'profile'}'); words = argv();\n"
        "a = fscanf(stdin, '%f', [2 Inf])';\n"
        "[z, x] = alpha_of(jsondecode(fileread(words{end})), a(:, 1), a(:, 2));\n"
        "printf('%.17g %.17g\\n', [z x]');\n",
        "utf-8",
    )
    angles = plane(9.3)
    command = [octave, "--no-gui", "--quiet", "--norc", str(script), str(files / f"{kind}.json")]
    text = "".join(f"{beta!r} {gamma!r}\n" for beta, gamma in angles.T.tolist())
    done = subprocess.run(
        command, input=text, capture_output=True, text=True, check=True, timeout=120
    )
    alpha = np.array(
        [[float(word) for word in line.split()] for line in done.stdout.splitlines()]
    ).T
    assert_allclose(alpha, profiles[kind].alpha(*np.radians(angles)), rtol=0, atol=1e-8)


# --- what was changed on the way


def problems_of(call):
    """Problems for which something is refused."""
    with pytest.raises(rftfit.RftfitError) as caught:
        call()
    assert caught.value.exit_code == 2
    return getattr(caught.value, "problems", ())


def problems(path, content):
    """Code and place of every problem of a file."""
    path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
    found = problems_of(lambda: rftfit.read_profile(path))
    assert all(str(path) in str(problem) for problem in found)
    return [(problem.code.partition(".")[2], problem.place.key) for problem in found]


def turned(values):
    return [None if value is None else -value for value in values]


def other_way(*names):
    """A change of directions: these columns with the other sign."""
    return lambda d: {name: turned(d[name]) for name in names}


@pytest.mark.parametrize(
    ("misread", "wrong"),
    [
        (other_way(Z), [Z]),
        (other_way(X), [X]),
        (other_way(Z, X), [Z, X]),
        (lambda d: {Z: d[X], X: d[Z]}, [Z, X]),
        (other_way("beta_deg"), [Z, X]),
        (other_way("gamma_deg"), [Z, X]),
        (other_way("beta_deg", "gamma_deg"), [Z, X]),
    ],
    ids=["alpha_z", "alpha_x", "both", "swapped", "beta", "gamma", "beta and gamma"],
)
def test_another_convention_shows_at_the_golden_value(misread, wrong, published, tmp_path):
    for content in published:
        directions = content["directions"] | misread(content["directions"])
        changed = content | {"digest": "", "directions": directions}
        expected = [("golden", f"directions.{name}") for name in wrong]
        assert problems(tmp_path / "p.json", changed) == expected


@pytest.mark.parametrize(("off", "is_told"), [(2e-7, False), (1e-6, True)])
def test_the_golden_value_agrees_to_a_millionth_of_the_largest_alpha(off, is_told, tmp_path):
    """That of loose poppy seeds is 0.35 N/cm^3."""
    medium = rftfit.TableProfile.published("poppy_LP")
    rftfit.write_profile(tmp_path / "p.json", medium)
    content = read(tmp_path / "p.json") | {"digest": ""}
    content["golden"][Z] += off
    if is_told:
        assert problems(tmp_path / "p.json", content) == [("golden", f"directions.{Z}")]
        return
    (tmp_path / "p.json").write_text(json.dumps(content), "utf-8")
    alpha_z = rftfit.read_profile(tmp_path / "p.json").alpha_z
    assert_allclose(alpha_z, medium.alpha_z, rtol=1e-12)


def put(*path, value):
    def change(content):
        *around, last = path
        for key in around:
            content = content[key]
        content[last] = value(content[last]) if callable(value) else value

    return change


def cut(*path):
    return put(*path, value=lambda values: values[:-1])


def each_column(changed):
    """A change of every column of directions."""
    return put("directions", value=lambda d: {name: changed(d[name]) for name in d})


@pytest.mark.parametrize(
    ("change", "code", "place"),
    [
        (put("directions", Z, 3, value=1e300), "out-of-range", f"directions.{Z}.4"),
        (put("directions", Z, value=[["deep"]]), "wrong-type", f"directions.{Z}.1"),
        (put("directions", "beta_deg", 0, value=None), "wrong-type", "directions.beta_deg.1"),
        (put("directions", "beta_deg", 0, value=1e6), "out-of-range", "directions.beta_deg.1"),
        (put("directions", "beta_deg", value=[0] * 10_001), "out-of-range", "directions.beta_deg"),
        (cut("directions", X), "length", f"directions.{X}"),
        (cut("pushes", "se_x"), "length", "pushes.se_x"),
        (cut("errors", DRAWS_X), "length", f"errors.{DRAWS_X}"),
        (cut("errors", DRAWS_Z, 1), "length", f"errors.{DRAWS_Z}.2"),
        (put("errors", DRAWS_Z, value=[]), "out-of-range", f"errors.{DRAWS_Z}"),
        (each_column(lambda v: [*v, v[0]]), "twice", "directions.gamma_deg.291"),
        (each_column(lambda v: v[:-1]), "grid", "directions"),
        (put("directions", "gamma_deg", 5, value=-17), "grid", "directions"),
        (
            put("errors", DRAWS_X, value=lambda rows: [turned(row) for row in rows]),
            "draws",
            f"errors.{DRAWS_X}.1.7",
        ),
        (put("errors", DRAWS_Z, 7, 4, value=None), "draws", f"errors.{DRAWS_Z}.1.5"),
        (put("golden", X, value=lambda x: x + 1e-4), "golden", f"directions.{X}"),
        (put("golden", "beta_deg", value=None), "wrong-type", "golden.beta_deg"),
        (put("version", value=2), "unknown-word", "version"),
        (put("medium", value={"nmae": "x"}), "unknown-key", "medium.nmae"),
        (put("medium", "title", value="\x1b[2J"), "inconsistent", "medium.title"),
        (put("medium", "title", value="\ud800"), "out-of-range", "medium.title"),
        (put("golden", value={}), "missing-key", "golden.beta_deg"),
        (put("validity", "depth_to_cm", value=-1), "out-of-range", "validity.depth_to_cm"),
    ],
)
def test_what_is_wrong_is_named(change, code, place, content, tmp_path):
    content["digest"] = ""
    content["errors"] = {name: [row[:] for row in rows] for name, rows in content["errors"].items()}
    for name, rows in content["errors"].items():
        content["errors"][name] = rows[:20] if code == "length" else rows
    change(content)
    if place.startswith("directions") and code in ("twice", "grid"):
        content["errors"] = None
    assert (code, place) in problems(tmp_path / "p.json", content)


def test_all_that_is_wrong_is_told_at_once(content, tmp_path):
    content["medium"]["nmae"] = ""
    del content["origin"]
    content["directions"]["beta_deg"] = "none"
    told = problems(tmp_path / "p.json", content | {"version": 7})
    assert {place for _, place in told} == {
        "version",
        "medium.nmae",
        "origin",
        "directions.beta_deg",
    }


def test_numbers_are_sealed_and_texts_are_not(files, content, tmp_path):
    path, whole = tmp_path / "p.json", rftfit.read_profile(files / "map.json")
    for place in (
        ("directions", Z, 20),
        ("errors", DRAWS_X, 3, 5),
        ("pushes", "se_z", 0),
        ("validity", "depth_to_cm"),
    ):
        changed = copy.deepcopy(content)
        put(*place, value=lambda value: value + 1e-4)(changed)
        assert ("digest", "digest") in problems(path, changed)
    content["medium"]["notes"] = "as I found it"
    path.write_text(json.dumps(content), "utf-8")
    assert_array_equal(rftfit.read_profile(path).alpha_z, whole.alpha_z)


# --- damaged and hostile files


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "not-json"),
        ("hello", "not-json"),
        ("null", "empty"),
        ("[1, 2]", "wrong-type"),
        ("9" * 5000, "not-json"),
        ("[" * 200_000, "too-deep"),
        ('{"a":' * 100_000, "too-deep"),
        ('{"format": "rftfit-profile", "version": ', "not-json"),
        ('{"format": 1, "format": 2}', "duplicate-key"),
        (json.dumps({str(n): n for n in range(50_000)}), "too-large"),
        ('{"directions": {"beta_deg": [1e999]}}', "out-of-range"),
        ('{"directions": {"beta_deg": [NaN]}}', "out-of-range"),
        ("[" * 21_000_000, "too-large"),
    ],
    ids=range(13),
)
def test_hostile_texts_are_refused(text, code, tmp_path):
    assert code in [problem_code for problem_code, _ in problems(tmp_path / "p.json", text)]


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "p.json").write_bytes(b"\xff\xfe{}")
    for name, code in (("none", "missing"), ("", "not-a-file"), ("p.json", "not-utf8")):
        path = tmp_path / name
        (problem,) = problems_of(lambda path=path: rftfit.read_profile(path))
        assert problem.code == f"profile.{code}"


def places(content, path=()):
    """Every key and entry of a file."""
    inside = content.items() if isinstance(content, dict) else enumerate(content)
    paths = []
    for name, value in inside:
        paths.append((*path, name))
        if isinstance(value, dict | list):
            paths += places(value, (*path, name))
    return paths


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


def test_no_damage_changes_a_number(tmp_path):
    """Entries replaced at random, and bytes: refused, or without effect."""
    path = tmp_path / "p.json"
    rftfit.write_profile(path, table_at(*HALF), window=(1.0, 8.0))
    random, original = np.random.default_rng(5), rftfit.read_profile(path)
    data, content = path.read_bytes(), read(path)
    every = places(content)
    texts = []
    for place in random.permutation(len(every))[:250]:
        changed = copy.deepcopy(content)
        put(*every[place], value=ODD[int(random.integers(len(ODD)))])(changed)
        texts.append(json.dumps(changed).encode())
    for _ in range(250):
        damaged = bytearray(data)
        damaged[random.integers(len(data))] = random.integers(256)
        texts.append(bytes(damaged))
    refused = 0
    for text in texts:
        path.write_bytes(text)
        try:
            profile = rftfit.read_profile(path)
        except rftfit.RftfitError:
            refused += 1
            continue
        pairs: Any = ((profile, original), (profile.spread, original.spread))
        for read_table, original_table in pairs:
            assert_array_equal(read_table.alpha_z, original_table.alpha_z)
            assert_array_equal(read_table.alpha_x, original_table.alpha_x)
        assert_array_equal(profile.pushed, original.pushed)
        assert profile.window == original.window
    assert refused > 400


# --- the schema


def test_the_schema_is_in_step(pytestconfig, content, tmp_path):
    main(tmp_path)
    stored = pytestconfig.rootpath / "examples" / "profile" / "profile.schema.json"
    schema_text = (tmp_path / stored.name).read_text("utf-8")
    # compared as values: older versions of pydantic write 360.0 for 360
    kept = json.loads(stored.read_text("utf-8"))
    assert kept == json.loads(schema_text), "run python -m rftfit.model.profile_schema"
    objects = [kept, *kept["$defs"].values()]
    keys = [key for described in objects for key in described["properties"].values()]
    assert all("description" in key for key in keys)
    check = pytest.importorskip("jsonschema").Draft202012Validator(json.loads(schema_text))
    assert check.is_valid(content)
    content["directions"][Z][0] = "0.1"
    content["medium"]["nmae"] = ""
    del content["golden"]
    assert len(list(check.iter_errors(content))) == 3


def test_what_a_file_states_of_the_data_goes_on(sources, tmp_path):
    """Notes and the verdict on the data stay in a file that is written again; the verdict is a warning where it is used."""
    first, again = tmp_path / "first.json", tmp_path / "again.json"
    marks = "unusable: the signs of forces are wrong"
    rftfit.write_profile(first, sources["map"], name="dune", title="Dune", notes="wet", marks=marks)
    titled = {"name": "dune", "title": "Dune", "notes": "wet"}
    profile = rftfit.read_profile(first)
    assert profile.doubt == marks
    for source in (first, profile):
        rftfit.write_profile(again, source)
        content = read(again)
        assert {name: content["medium"][name] for name in titled} == titled
        assert content["validity"]["marks"] == marks
        assert content["origin"]["made_from"].keys() == {"first.json"}
    rftfit.write_profile(again, first, title="Wet sand")
    assert read(again)["medium"]["title"] == "Wet sand"
    for words in (("predict", "--leg", "c_leg"), ("export", "--output", "new.json")):
        answer = run_command(tmp_path, *words, "--profile-file", "first.json")
        assert marks in answer.stderr
    assert read(tmp_path / "new.json")["validity"]["marks"] == marks
