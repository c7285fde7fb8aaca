"""Tests of contract, laws and golden use only what a user has; each public name is used here.

Golden tables are described by the dictionary of outputs, which users have as `datapackage.json`.
"""

import ast
import re
from pathlib import Path

import pytest

import rftfit

TESTS = Path(__file__).resolve().parents[1]
ROOMS = ("contract", "laws", "golden")
FILES = sorted(path for room in ROOMS for path in (TESTS / room).rglob("*.py"))
INNER_NAME = re.compile(r"rftfit(\.\w+)+")
DICTIONARY = "rftfit.outputs.dictionary"
HELPERS = ("makers", "seeds", "waiting")
"""Helpers that these rooms may use: they import nothing of the program, but for its public names."""


def inner_imports(path):
    """Modules and names of the program that a file imports beside its public names."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.startswith("rftfit."))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "rftfit":
            for alias in node.names:
                if node.module != "rftfit" or alias.name not in rftfit.__all__:
                    yield f"{node.module}.{alias.name}"
        elif isinstance(node, ast.Constant) and INNER_NAME.fullmatch(str(node.value)):
            # a module that is patched or imported by its name
            yield str(node.value)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_file_imports_public_names_alone(path):
    assert [name for name in inner_imports(path) if not name.startswith(DICTIONARY)] == []


@pytest.mark.parametrize("name", HELPERS)
def test_a_helper_imports_public_names_alone(name):
    assert [*inner_imports(TESTS / "helpers" / f"{name}.py")] == []


def uses(path):
    """Public names that a file uses as `rftfit.NAME`."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "rftfit":
            yield node.attr


def test_each_public_name_is_used_by_the_contract():
    used = {name for path in FILES if path.parent.name == "contract" for name in uses(path)}
    assert set(rftfit.__all__) - used == set()
