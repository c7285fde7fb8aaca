"""`import rftfit` loads fast, and every name is documented and gives the results of its module."""

import ast
import doctest
import importlib
import inspect
import json
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from coverage_levels import sweep_draws
from numpy.testing import assert_allclose, assert_array_equal
from paper import BETA, flat
from paper import GAMMA_OF_FILE as GAMMA
from result_tables import LABORATORY, SAND, make_campaign, one_cell

import rftfit
from rftfit import reference
from rftfit.measure.alpha import directions
from rftfit.model.draws import alpha_draws, interval
from rftfit.model.fourier import fit_dft_index, fit_lsq, kept_terms
from rftfit.model.profiles import FourierProfile, Profile, TableProfile
from rftfit.model.scaling import ScaledMedium, generic, vertical_penetration

MEASURED_MEDIA = ("poppy_LP", "poppy_CP", "glass3mm_CP")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    alpha = {medium: reference.alpha_grid(medium) for medium in MEASURED_MEDIA} | {
        "sand": one_cell(0.7)
    }
    roles = dict.fromkeys(MEASURED_MEDIA, LABORATORY) | {"sand": SAND}
    return rftfit.open(make_campaign(tmp_path_factory.mktemp("api") / "c", roles, alpha))


def test_import_loads_nothing():
    code = "import sys; before = set(sys.modules); import rftfit; print(*set(sys.modules) - before)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    light = {"importlib", "importlib._bootstrap", "importlib._bootstrap_external", "warnings"}
    assert set(loaded) <= {"rftfit", "rftfit.version", *light}


def test_every_name_is_there_and_typed():
    tree = ast.parse(inspect.getsource(rftfit))
    typed = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rftfit")
        for alias in node.names
    }
    assert typed - {"__version__"} == set(rftfit.__all__)
    assert set(rftfit.__all__) == {name for name in dir(rftfit) if not name.startswith("__")}
    for name in rftfit.__all__:
        assert callable(getattr(rftfit, name))
    with pytest.raises(AttributeError, match="no_such"):
        rftfit.no_such  # noqa: B018


def sections(exported):
    parts = re.split(r"^(\w[\w ]*)\n-+\n", inspect.getdoc(exported) or "", flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", rftfit.__all__)
def test_every_name_is_documented(name):
    exported = getattr(rftfit, name)
    sections_of_doc = sections(exported)
    assert "Examples" in sections_of_doc
    if name in ("Profile", "RftfitError"):
        return
    signature = inspect.signature(exported)
    listed = re.findall(r"^(\w[\w, ]*) ?:?", sections_of_doc.get("Parameters", ""), re.MULTILINE)
    described = [name.strip() for line in listed for name in line.split(",")]
    assert set(signature.parameters) <= set(described)
    if inspect.isclass(exported):
        public = [
            member for key, member in vars(exported).items() if key[0] != "_" and callable(member)
        ]
        assert all(inspect.getdoc(member) for member in public)
    elif signature.return_annotation != "None":
        assert "Returns" in sections_of_doc


@pytest.mark.parametrize("name", rftfit.__all__)
def test_every_example_runs(name):
    exported = getattr(rftfit, name)
    module = importlib.import_module(exported.__module__)
    examples = doctest.DocTestFinder(recurse=False).find(exported, name, module)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for test in examples:
        runner.run(test)
    assert runner.summarize().failed == 0


def test_a_medium_of_a_campaign(results):
    medium = results["poppy_CP"]
    alpha = flat(reference.alpha_grid("poppy_CP"))
    keep = kept_terms(fit_lsq(BETA, GAMMA, *alpha), 0.05)
    fit = fit_lsq(BETA, GAMMA, *alpha, keep)
    assert_allclose(medium.coefficients(), fit, atol=1e-12)
    assert medium.zeta == pytest.approx(float(vertical_penetration(fit)))
    alpha_down = alpha[0][3 * 13 + 12]
    assert medium.chi == pytest.approx(alpha_down / medium.zeta)
    m0 = generic(np.stack([results[name].coefficients() for name in MEASURED_MEDIA]))
    assert_allclose(results.reference().m0, m0, atol=1e-12)
    scaled = medium.profile("generic")
    assert isinstance(scaled, FourierProfile)
    assert_allclose(scaled.coefficients, medium.zeta * m0, atol=1e-12)
    table = medium.profile()
    slanted = np.abs(GAMMA) < 1.5
    for alpha_of_table, expected in zip(table.alpha(BETA, GAMMA), alpha, strict=True):
        assert_allclose(alpha_of_table[slanted], expected[slanted])
    lift, _ = medium.profile("depth_only").alpha(0, np.pi / 2)
    assert float(lift) == pytest.approx(alpha_down)


@pytest.mark.parametrize("kind", ["table", "map", "fourier", "generic", "depth_only"])
def test_draws_are_made_when_wanted(results, kind):
    medium = results["poppy_LP"]
    assert medium.profile(kind, draws=False).spread is None
    profile = medium.profile(kind)
    assert isinstance(profile.spread, Profile)
    count = 1000 if kind == "map" else 2000
    assert profile.spread.parameters[0].shape[0] == count
    # the profile itself lies in the middle of its draws
    best, draws = (source.alpha(0.5, 1.0)[0] for source in (profile, profile.spread))
    assert abs(float(draws.mean()) - float(best)) < 5 * float(draws.std()) / np.sqrt(2000) + 1e-12


def test_a_sand_is_scaled_from_its_test(results):
    sand = results["sand"]
    by_hand = rftfit.scale_by_paper(0.7, 0.003, results.reference())
    assert (sand.zeta, sand.chi) == (by_hand.zeta, by_hand.chi)
    assert isinstance(sand.profile("generic").spread, ScaledMedium)
    assert sand.kinds == ("table", "map", "generic")
    with pytest.raises(rftfit.RftfitError, match="found 'fourier'; allowed: table, map, gen"):
        sand.profile("fourier")
    assert_array_equal(sand.coefficients(), by_hand.coefficients)


def test_coefficients_by_another_method(results):
    """The transform of even steps finds other terms than least squares."""
    by_index = fit_dft_index(BETA, GAMMA, *flat(reference.alpha_grid("poppy_CP")))
    by_index = np.where(kept_terms(by_index, 0.05), by_index, 0.0)
    for medium, expected in (
        (results["poppy_CP"], by_index),
        (results["sand"], results["sand"].profile("generic", "dft-index").coefficients),
    ):
        assert_allclose(medium.coefficients("dft-index"), expected, atol=1e-12)
        assert np.abs(medium.coefficients() - expected).max() > 0.001


def test_too_few_media_are_scaled_with_the_published_ones(tmp_path):
    alpha = {"a": reference.alpha_grid("poppy_LP"), "s": one_cell(0.7), "t": one_cell(np.nan)}
    roles = {"a": LABORATORY, "s": SAND, "t": SAND}
    campaign = rftfit.open(make_campaign(tmp_path / "c", roles, alpha))
    assert campaign.reference().printed
    assert campaign["s"].zeta == rftfit.scale_by_paper(0.7, 0.003).zeta
    # a test without a number spoils nobody else's
    assert np.isnan(campaign["t"].zeta)
    assert "no run" in campaign["t"].profile("generic").reason
    with pytest.raises(rftfit.RftfitError, match=r"^t: "):
        campaign["t"].scaled()


def test_a_table_with_holes_has_a_reason(tmp_path):
    alpha_of_one_beta = np.where(
        np.arange(7)[:, None] == 0, reference.alpha_grid("poppy_LP"), np.nan
    )
    campaign = rftfit.open(
        make_campaign(
            tmp_path / "c", {"a": LABORATORY}, {"a": (alpha_of_one_beta[0], alpha_of_one_beta[1])}
        )
    )
    for kind in ("table", "fourier", "generic"):
        profile = campaign["a"].profile(kind)
        assert profile.reason
        assert np.isnan(profile.alpha(0.3, 0.5)[0])
    assert np.isnan(campaign.generic()).all()


def test_intervals_of_forces_are_of_the_level_and_quantities_asked_for(results):
    leg = rftfit.model_leg("reversed_c_leg")
    forces = rftfit.predict(results["poppy_LP"].profile(), leg, confidence=0.8)
    table = results["poppy_LP"].alpha
    drawn_forces = sweep_draws(
        TableProfile(*alpha_draws(table, 2000, 2013, 0.95), *directions(table)), leg
    )
    ends = interval(drawn_forces.force_x_N, 0.8)
    assert_allclose(forces[["force_x_lo_N", "force_x_hi_N"]].T, ends, atol=1e-9)
    assert (forces["reason"] == "").all()
    vertical = rftfit.predict(results["poppy_LP"].profile(), leg, quantities=("force_z_N",))
    lower_ends = [name for name in vertical if "_lo_" in str(name)]
    assert lower_ends == ["force_z_lo_N", "force_z_model_lo_N", "force_z_next_lo_N"]


def test_run_returns_what_it_did_and_prints_nothing(results, monkeypatch, capfd):
    events: Any = (
        *(
            {"event": "job_info", "jobid": number, "rule_name": rule, "wildcards": {"m": "sand"}}
            for number, rule in enumerate(("tare", "slopes"))
        ),
        {"skipped": 0},
        {"event": "job_finished", "job_id": 0},
        {"event": "job_finished", "job_id": 1},
    )
    called = []

    def listen(words, _, on_line, **__):
        called.extend(words)
        for event in events:
            on_line(json.dumps({"snakemake": "", **event}))
        return 0

    monkeypatch.setattr("rftfit.workflow.run.listen", listen)
    report = rftfit.run(results.root / "results", ["results/coefficients.csv"], cores=3)
    assert (report.made, report.skipped, report.failed) == (["slopes sand"], ["tare sand"], {})
    assert called[0] == "results/coefficients.csv"
    assert called[called.index("--cores") + 1] == "3"
    assert capfd.readouterr() == ("", "")


def test_the_robot_of_a_file(tmp_path):
    with pytest.raises(rftfit.RftfitError, match=r"none\.yaml"):
        rftfit.simulate(rftfit.published_medium("poppy_LP"), 2.0, robot=tmp_path / "none.yaml")
    with pytest.raises(ValueError, match="0 to 100 Hz"):
        rftfit.simulate(rftfit.published_medium("poppy_LP"), 1000.0)


@pytest.mark.parametrize("words", [("0.55",), (None,), (0.55, "0.1"), ([0.5, 0.6],)])
def test_scale_says_that_it_needs_numbers(words):
    with pytest.raises(TypeError, match="N/cm"):
        rftfit.scale(*words)


def test_meshes_and_motions_describe_themselves():
    wheel = rftfit.Mesh.cylinder(radius_cm=6.25, width_cm=6)
    assert "12.5 x 6 x 12.5 cm" in repr(wheel)
    assert repr(rftfit.Motion3D.press(wheel, 3)) == (
        "<Motion3D pressed straight down, 3 cm deep: 50 poses>"
    )
