"""The shape of the package: what it loads, who imports whom, sizes, versions, docstrings."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import yaml

import rftfit
from rftfit.reference import CITATION

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "rftfit"
MODULES = sorted(PACKAGE.rglob("*.py"))

HEAVY = ("matplotlib", "numba", "pandas", "pyarrow", "scipy", "scipy.stats", "snakemake")

Function = ast.FunctionDef | ast.AsyncFunctionDef


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def report(problems: list[str]) -> str:
    return f"{len(problems)} problems:\n" + "\n".join(problems)


def test_import_is_light() -> None:
    code = "import sys, rftfit; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert "rftfit" in loaded
    assert [name for name in HEAVY if name in loaded] == []


def test_versions_agree() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert project["version"] == rftfit.__version__ == citation["version"]
    assert project["license"] == citation["license"]


def test_citation_names_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    paper = citation["references"][0]
    assert paper["doi"] in CITATION
    assert paper["title"] in CITATION


# --- imports between rooms -----------------------------------------------------------------------


def documented_order() -> list[set[str]]:
    """Read the rooms, upper first, from the chain in docs/architecture.md."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    chain = re.search(r"Imports run downward only:\s*`([^`]+)`", text)
    assert chain, "docs/architecture.md no longer states the order of the rooms"
    return [{room.strip() for room in level.split(",")} for level in chain[1].split("->")]


def documented_lab_rooms() -> set[str]:
    """Read from docs/architecture.md which rooms the lab may import."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    sentence = re.search(r"`lab` imports only ([^.]+)\.", text)
    assert sentence, "docs/architecture.md no longer states what the lab may import"
    return set(re.findall(r"`(\w+)`", sentence[1]))


def room_of(path: Path) -> str:
    """First name below the package: rftfit/logs/rig.py is in logs, rftfit/stages.py in stages."""
    first = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return "cli" if first == "__main__" else first


def imported_rooms(path: Path) -> Iterator[tuple[int, str]]:
    """Line and room of every import of the package's own modules, also inside functions."""
    package = ["rftfit", *path.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(parse(path)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            names = [f"{module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            parts = name.split(".")
            if parts[0] == "rftfit" and len(parts) > 1:
                yield node.lineno, parts[1]


def test_imports_run_downward() -> None:
    order = documented_order()
    rank = {room: len(order) - i for i, level in enumerate(order) for room in level}
    assert all(rank[next(iter(a))] > rank[next(iter(b))] for a, b in pairwise(order))
    # any room may raise the program's errors and ask for its version
    rank |= {"errors": 0, "__version__": 0, "__init__": 0}
    lab = documented_lab_rooms() | {"errors", "lab", "__version__"}
    problems = []
    for path in MODULES:
        here = room_of(path)
        if here not in rank and here != "lab":
            problems.append(f"{relative(path)}: room {here} is not in docs/architecture.md")
            continue
        for line, room in imported_rooms(path):
            if here == "lab":
                allowed = room in lab
            elif room == "lab":
                allowed = here in {"cli", "stages"}
            else:
                allowed = room == here or rank.get(room, 99) < rank[here]
            if not allowed:
                problems.append(f"{relative(path)}:{line}: {here} imports {room}")
    assert not problems, report(problems)


# --- sizes and the lock file ---------------------------------------------------------------------


def test_modules_are_short() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    problems = [f"{relative(path)}: {n} lines" for path, n in lengths.items() if n > 350]
    assert not problems, report(problems)


def test_tracked_files_are_small() -> None:
    command = ["git", "-C", str(ROOT), "ls-files", "-z"]
    try:
        listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"this copy is no git checkout: {error}")
    tracked = [ROOT / name for name in listing.split("\0") if name]
    assert ROOT / "pyproject.toml" in tracked
    sizes = {path: path.stat().st_size for path in tracked if path.is_file()}
    problems = [f"{relative(path)}: {n} bytes" for path, n in sizes.items() if n > 1_000_000]
    assert not problems, report(problems)


def test_lock_file_has_hashes_and_no_addresses() -> None:
    text = (ROOT / "requirements" / "lock.txt").read_text(encoding="utf-8")
    entries = re.sub(r"\\\n\s*", "", re.sub(r"(?m)^\s*#.*\n?", "", text)).splitlines()
    assert len(entries) > 50
    problems = [entry for entry in entries if not re.match(r"[\w.-]+==\S+ .*--hash=sha256:", entry)]
    problems += re.findall(r".*(?:https?:|file:|--index-url|--extra-index|--find-links).*", text)
    assert not problems, report(problems)


# --- docstrings ----------------------------------------------------------------------------------


def section(docstring: str, title: str) -> set[str]:
    """Names that a numpydoc section describes; those of one line are split at commas."""
    names: set[str] = set()
    inside = False
    lines = docstring.splitlines()
    for line, after in pairwise([*lines, ""]):
        if after and set(after) == {"-"}:
            inside = line == title
        elif inside and line and not line[0].isspace() and set(line) != {"-"}:
            names |= {name.strip().lstrip("*") for name in line.split(" : ")[0].split(",")}
    return names


def parameters(function: Function) -> set[str]:
    args = function.args
    named = [*args.posonlyargs, *args.args, *args.kwonlyargs]
    named += [arg for arg in (args.vararg, args.kwarg) if arg]
    return {arg.arg for arg in named if arg.arg not in {"self", "cls"} and arg.arg[0] != "_"}


def decorators(node: Function | ast.ClassDef) -> list[str]:
    return [ast.unparse(decorator) for decorator in node.decorator_list]


def is_command(path: Path, function: Function) -> bool:
    """Tell a command of the shell: its text is shown by --help and its options say what they are."""
    marks = [*decorators(function), ast.unparse(function.args)]
    return room_of(path) == "cli" and any(
        word in mark for mark in marks for word in (".command", ".callback", "typer.")
    )


def is_derived(function: Function) -> bool:
    """Overloads, properties' setters and overriding methods repeat what another docstring says."""
    return any(mark.endswith(("overload", ".setter", "override")) for mark in decorators(function))


def check(where: str, node: Function | ast.ClassDef, wanted: set[str]) -> Iterator[str]:
    docstring = ast.get_docstring(node) or ""
    if not docstring:
        yield f"{where}: no docstring"
        return
    described = section(docstring, "Parameters")
    if isinstance(node, ast.ClassDef):
        described |= section(docstring, "Attributes") & wanted
    if missing := sorted(wanted - described):
        yield f"{where}: Parameters lacks {', '.join(missing)}"
    if unknown := sorted(described - wanted):
        yield f"{where}: Parameters describes {', '.join(unknown)}, which it does not take"


def fields(node: ast.ClassDef) -> set[str]:
    """Public fields of a dataclass or named tuple that no text of their own follows."""
    bases = [ast.unparse(base) for base in node.bases]
    if not any("dataclass" in mark for mark in decorators(node)) and "NamedTuple" not in bases:
        return set()
    found = set()
    for statement, after in pairwise([*node.body, ast.Pass()]):
        told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            name = statement.target.id
            if not told and not name.startswith("_") and "ClassVar" not in ast.unparse(statement):
                found.add(name)
    return found


def check_class(where: str, node: ast.ClassDef) -> Iterator[str]:
    wanted = fields(node)
    for member in node.body:
        if not isinstance(member, Function):
            continue
        if member.name == "__init__":
            wanted |= parameters(member)
        elif not member.name.startswith("_") and not is_derived(member):
            yield from check(f"{where}.{member.name}", member, parameters(member))
    yield from check(where, node, wanted)


def test_public_interface_is_documented() -> None:
    problems: list[str] = []
    checked = 0
    for path in MODULES:
        for node in parse(path).body:
            if not isinstance(node, Function | ast.ClassDef) or node.name.startswith("_"):
                continue
            where = f"{relative(path)}:{node.lineno} {node.name}"
            checked += 1
            if isinstance(node, ast.ClassDef):
                problems += check_class(where, node)
            elif not is_command(path, node) and not is_derived(node):
                problems += check(where, node, parameters(node))
    assert checked > 20
    assert not problems, report(problems)


SAMPLE = '''
def right(a, b, *, c=1, **rest):
    """One.

    Parameters
    ----------
    a, b : float
        Two.
    c : int
    **rest
        Passed on.

    Returns
    -------
    float
    """
def wrong(a, b):
    """One.

    Parameters
    ----------
    a : float
    z : float
    """
def bare(a): ...
'''


def test_the_docstring_check_itself() -> None:
    found: list[str] = []
    for node in ast.parse(SAMPLE).body:
        assert isinstance(node, Function)
        found += check(node.name, node, parameters(node))
    assert found == [
        "wrong: Parameters lacks b",
        "wrong: Parameters describes z, which it does not take",
        "bare: no docstring",
    ]
