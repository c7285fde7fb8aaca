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

import pytest
from result_tables import SAND, make_campaign, one_cell

import rftfit


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
    if name in ("Profile", "RftfitError", "LimitWarning"):
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


def test_run_returns_what_it_did_and_prints_nothing(tmp_path, monkeypatch, capfd):
    folder = make_campaign(tmp_path / "c", {"sand": SAND}, {"sand": one_cell(0.7)})
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

    monkeypatch.setattr("rftfit.workflow.run.run_snakemake", listen)
    report = rftfit.run(folder, ["results/coefficients.csv"], cores=3)
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
