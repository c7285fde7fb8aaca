"""Mutants change what a function does, one passage at a time, and false columns one column of one table."""

import ast
from types import SimpleNamespace
from typing import Any

import drawn_mutants
import false_columns
import mutants as judging
import pandas as pd
import pytest

MODULE = '''"""Module."""

LIMIT = 3


def convert(depth_lo, depth_hi, unit="µm"):
    """Convert a depth."""
    if unit == "µm" and depth_lo < depth_hi:
        return depth_lo * 2
    raise ValueError(f"no unit {unit} + 1")
'''


@pytest.fixture
def mutants(monkeypatch, tmp_path):
    monkeypatch.setattr(drawn_mutants, "PACKAGE", tmp_path)
    (tmp_path / "units.py").write_text(MODULE, encoding="utf-8")
    return drawn_mutants.mutants_of_module("units.py", tmp_path / "units.py")


def test_each_mutant_is_a_program_that_differs_inside_a_function(mutants):
    before = ast.dump(ast.parse(MODULE))
    for mutant in mutants:
        mutated = mutant.mutated(MODULE)
        assert ast.dump(ast.parse(mutated)) != before
        assert mutated.startswith(MODULE[: MODULE.index("def")])
        assert mutated.endswith(MODULE[MODULE.index("    raise") :])
    assert {(mutant.removed, mutant.added) for mutant in mutants} >= {
        ("depth_lo < depth_hi", "(depth_lo <= depth_hi)"),
        ("depth_lo * 2", "(depth_lo / 2)"),
        ("2", "3"),
    }


def test_a_mutant_of_another_source_is_refused(mutants):
    with pytest.raises(ValueError, match=r"units\.py"):
        mutants[0].mutated(f"# a line more\n{MODULE}")


def test_the_same_seed_draws_the_same_mutants():
    first, second, other = (
        [mutant.identity for mutant in drawn_mutants.draw_columns(seed, 20)] for seed in (1, 1, 2)
    )
    assert first == second
    assert first != other


def test_a_false_column_is_that_of_one_table():
    alpha = pd.DataFrame(
        {"medium": ["sand"], "alpha_z_N_per_cm3": [0.3], "alpha_x_N_per_cm3": [0.1]}
    )
    rows = pd.DataFrame({"alpha_z_N_per_cm3": [1.0]})

    def returned(change):
        file, column = "results/alpha_extended.csv", "alpha_z_N_per_cm3"
        stage = false_columns.change(file, column, change)(lambda: (rows, alpha))
        false_rows, false_alpha = stage()
        pd.testing.assert_frame_equal(false_rows, rows)
        pd.testing.assert_frame_equal(false_alpha.drop(columns=column), alpha.drop(columns=column))
        return false_alpha[column].item()

    assert returned("2 * p") == pytest.approx(0.6)
    assert returned("-p") == pytest.approx(-0.3)
    assert returned("alpha_x_N_per_cm3") == pytest.approx(0.1)


TESTS_OF_A_COPY = """
import rftfit


def test_copy():
    assert rftfit.MADE_FOR_A_TEST
"""


def test_a_mutant_is_judged_by_tests_that_import_the_copy_in_which_it_is(monkeypatch, tmp_path):
    """And not the program of the project, which draws columns before."""
    package = tmp_path / "src" / "rftfit"
    package.mkdir(parents=True)
    (tmp_path / "test_copy.py").write_text(TESTS_OF_A_COPY, encoding="utf-8")
    monkeypatch.setattr(judging, "TREE", tmp_path)
    failures = {}
    for value in ("True", "False"):
        (package / "__init__.py").write_text(f"MADE_FOR_A_TEST = {value}\n", encoding="utf-8")
        nobody: Any = SimpleNamespace(untrusted=())
        failures[value] = judging.Judge._first_failure(nobody, ["test_copy.py"], 5.0)
    assert failures == {"True": "", "False": "test_copy.py::test_copy"}
