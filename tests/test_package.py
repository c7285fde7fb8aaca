"""The package imports downward only, its versions and citations agree, and its files are small."""

import ast
import fnmatch
import json
import re
import shutil
import subprocess
import tomllib
from importlib.metadata import distribution
from itertools import pairwise
from pathlib import Path

import pytest
import release
import yaml
from packaging.requirements import Requirement
from seams import declared_names, used_names

import rftfit
from rftfit import reference

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "rftfit"
MODULES = sorted(PACKAGE.rglob("*.py"))
MOST_PACKAGES = 80
"""Packages of an install without extras, the program among them."""


def relative(path):
    return path.relative_to(ROOT).as_posix()


def parse(path):
    return ast.parse(path.read_text("utf-8"), filename=str(path))


def test_versions_and_citation_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert project["version"] == rftfit.__version__
    assert project["license"] == citation["license"]
    paper = citation["references"][0]
    assert paper["doi"] in reference.CITATION
    assert paper["title"] in reference.CITATION
    codemeta = json.loads((ROOT / "codemeta.json").read_text("utf-8"))
    assert codemeta["license"] == f"https://spdx.org/licenses/{project['license']}"
    assert codemeta["keywords"] == project["keywords"] == citation["keywords"]
    assert codemeta["referencePublication"]["@id"] == project["urls"]["Method"]
    assert project["urls"]["Method"] == f"https://doi.org/{paper['doi']}"


def tracked_files():
    command = ["git", "-C", str(ROOT), "ls-files", "-z"]
    try:
        listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"this copy is no git checkout: {error}")
    return [name for name in listing.split("\0") if name]


def test_version_and_date_are_those_of_the_newest_section_of_the_changelog():
    assert release.disagreements(ROOT) == []
    sections = re.findall(
        r"(?m)^## \[([\d.]+)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text("utf-8")
    )
    numbers = [tuple(map(int, version.split("."))) for version, _ in sections]
    assert numbers == sorted(numbers, reverse=True)
    dates = [date for _, date in sections]
    assert dates == sorted(dates, reverse=True)


def test_a_tagged_commit_has_nothing_unreleased():
    command = ["git", "-C", str(ROOT), "tag", "--points-at", "HEAD"]
    completed = subprocess.run(command, check=False, capture_output=True, text=True)
    tags = [tag for tag in completed.stdout.split() if tag.startswith("v")]
    if not tags:
        pytest.skip("this commit has no tag of a release")
    assert tags == [f"v{rftfit.__version__}"]
    assert release.unreleased_changes(ROOT) == []


@pytest.fixture
def project_copy(tmp_path):
    """Files that state version or date, in a folder of their own."""
    for name in {*release.VERSIONS, *release.DATES, release.CHANGELOG}:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_a_prepared_release_agrees_and_has_what_was_unreleased(project_copy):
    path = project_copy / release.CHANGELOG
    text = path.read_text("utf-8")
    heading = f"{release.UNRELEASED}\n"
    path.write_text(text.replace(heading, f"{heading}\n### Added\n\n- A word.\n", 1), "utf-8")
    assert "- A word." in release.unreleased_changes(project_copy)
    release.prepare(project_copy, "9.8.7", "2126-01-02")
    assert release.disagreements(project_copy) == []
    assert release.unreleased_changes(project_copy) == []
    assert "## [9.8.7] - 2126-01-02\n\n### Added\n\n- A word.\n" in path.read_text("utf-8")
    assert "0.1.0" not in (project_copy / "README.md").read_text("utf-8")


@pytest.mark.parametrize("name", [*release.VERSIONS, *release.DATES])
def test_a_file_with_another_version_or_date_disagrees(project_copy, name):
    path = project_copy / name
    patterns = {**release.VERSIONS, **release.DATES}
    line = re.search(patterns[name], path.read_text("utf-8"), re.MULTILINE)
    assert line is not None
    stated = line[1]
    path.write_text(path.read_text("utf-8").replace(stated, stated[:-1] + "9"), "utf-8")
    assert [problem.split(":")[0] for problem in release.disagreements(project_copy)][:1] == [name]


NAMED_PATH = re.compile(
    r"(?<![\w/.<>-])((?:\.ci|\.github|\.test|benchmarks|docs|examples|profiles|requirements|src"
    r"|studies|tests|workflow)/[\w.*/-]*\w)"
)
"""A path from the project's folder, or a pattern of such paths."""

WRITTEN_BY_STEPS = ("docs/_build*", "benchmarks/results*", "src/rftfit/model/__pycache__*")
"""Paths that are there after a step of the Makefile."""


def test_every_path_that_is_named_by_settings_and_documents_exists():
    tracked = tracked_files()
    there = [*tracked, *{str(folder) for name in tracked for folder in Path(name).parents}]
    naming = [name for name in tracked if re.fullmatch(r"\.[\w./-]+|docs/.*\.md|[^/]*", name)]
    naming += [name for name in tracked if name.endswith("/README.md")]
    problems = []
    for name in naming:
        if name.endswith(".csv") or name == "CHANGELOG.md":
            continue
        # regular expressions become patterns of names
        text = (ROOT / name).read_text("utf-8").replace(".*", "*").replace("\\.", ".")
        for path in {*NAMED_PATH.findall(text)}:
            exists = (ROOT / path).exists() or fnmatch.filter(there, path)
            if not exists and not any(fnmatch.fnmatch(path, made) for made in WRITTEN_BY_STEPS):
                problems.append(f"{name}: {path}")
    assert problems == []


def test_every_requirements_file_is_watched_for_updates():
    settings = yaml.safe_load((ROOT / ".github" / "dependabot.yml").read_text("utf-8"))
    folders = {update["directory"] for update in settings["updates"]}
    needed = {f"/{Path(name).parent}" for name in tracked_files() if name.endswith("lock.txt")}
    assert needed
    assert needed <= folders


def test_the_paper_cites_what_its_bibliography_lists():
    text = (ROOT / "paper.md").read_text("utf-8")
    bibliography = (ROOT / "paper.bib").read_text("utf-8")
    assert {*re.findall(r"@(\w+)[;\]]", text)} == {*re.findall(r"(?m)^@\w+\{(\w+),", bibliography)}
    sections = re.findall(r"(?m)^# (.+)$", text)
    for section in ("Summary", "Statement of need", "State of the field", "AI usage disclosure"):
        assert section in sections
    assert len(text.split()) < 1750


# --- imports between rooms -----------------------------------------------------------------------


ARCHITECTURE = (ROOT / "docs" / "architecture.md").read_text("utf-8")


def documented_order():
    """Read the rooms, upper first, from the chain in docs/architecture.md."""
    chain = re.search(r"Imports run downward only:\s*`([^`]+)`", ARCHITECTURE)
    assert chain, "docs/architecture.md no longer states the order of the rooms"
    return [{room.strip() for room in level.split(",")} for level in chain[1].split("->")]


def documented_lab_rooms():
    """Read from docs/architecture.md which rooms the lab may import."""
    sentence = re.search(r"`lab` imports only ([^.]+)\.", ARCHITECTURE)
    assert sentence, "docs/architecture.md no longer states what the lab may import"
    return set(re.findall(r"`(\w+)`", sentence[1]))


def room_of(path):
    """First name below the package: rftfit/logs/text.py is in logs, rftfit/results.py in results."""
    top_name = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return "cli" if top_name == "__main__" else top_name


def imported_rooms(path):
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


def test_imports_run_downward():
    order = documented_order()
    rank = {room: len(order) - i for i, level in enumerate(order) for room in level}
    assert all(rank[next(iter(a))] > rank[next(iter(b))] for a, b in pairwise(order))
    # any room may raise the program's errors and ask for its version
    rank |= {"errors": 0, "version": 0, "__init__": 0}
    lab = documented_lab_rooms() | {"errors", "lab", "version"}
    problems = []
    for path in MODULES:
        importer = room_of(path)
        if importer == "__init__":  # the public API names what is in any room
            continue
        if importer not in rank and importer != "lab":
            problems.append(f"{relative(path)}: room {importer} is not in docs/architecture.md")
            continue
        for line, room in imported_rooms(path):
            if importer == "lab":
                allowed = room in lab
            elif room == "lab":
                allowed = importer == "cli"
            else:
                allowed = room == importer or rank.get(room, 99) < rank[importer]
            if not allowed:
                problems.append(f"{relative(path)}:{line}: {importer} imports {room}")
    assert not problems, "\n".join(problems)


def test_no_circle_between_modules():
    """Also through `import rftfit`, and by imports for types alone or inside functions."""
    dotted = {path: relative(path)[4:-3].replace("/", ".") for path in MODULES}
    names = {path: name.removesuffix(".__init__") for path, name in dotted.items()}
    imported = {}
    for path, name in names.items():
        modules = set()
        for node in ast.walk(parse(path)):
            if isinstance(node, ast.Import):
                modules |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                parts = {f"{node.module}.{alias.name}" for alias in node.names}
                modules |= {name if name in names.values() else node.module for name in parts}
        imported[name] = modules & {*names.values()} - {name}
    # modules that import no other are taken away, again and again: a circle remains
    while leaves := {name for name, imports in imported.items() if not imports}:
        imported = {name: imported[name] - leaves for name in imported.keys() - leaves}
    assert not imported


def test_third_party_files_are_asked_for_in_one_place():
    """Else a test that lacks its skip fails for a stranger, who has no ../shared/data."""
    places = [
        relative(path)
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if re.search(r"""/ ["']shared["']""", path.read_text("utf-8"))
    ]
    assert places == ["tests/helpers/third_party.py"]


def test_tests_import_no_inner_name_that_is_not_declared():
    """The list only shrinks: what is new is tested by what a user has, and what goes leaves the list."""
    used, declared = used_names(), declared_names()
    undeclared = {".".join(name): files for name, files in used.items() if name not in declared}
    unused = {".".join(name) for name in declared - used.keys()}
    assert (undeclared, unused) == ({}, set()), "python tests/helpers/seams.py --write"
    modules = {module for module, _ in declared}
    stated = f"{len(declared)} inner names of {len(modules)} modules"
    assert stated in (ROOT / "CONTRIBUTING.md").read_text("utf-8")


# --- tracked files and the lock file ---------------------------------------------------------------------


def test_tracked_files_are_small():
    tracked = [ROOT / name for name in tracked_files()]
    assert ROOT / "pyproject.toml" in tracked
    sizes = {path: path.stat().st_size for path in tracked if path.is_file()}
    problems = [f"{relative(path)}: {n} bytes" for path, n in sizes.items() if n > 1_000_000]
    assert not problems, "\n".join(problems)


def packages_needed(name, extras=(), left_out=()):
    """Names of a package and of all that it needs on this machine, but what only those `left_out` need."""
    packages: dict[str, set[str]] = {}
    waiting = [(name, {*extras} or {""})]
    while waiting:
        name, wanted = waiting.pop()
        name = re.sub(r"[-_.]+", "-", name).lower()
        if name in left_out or wanted <= packages.setdefault(name, set()):
            continue
        packages[name] |= wanted
        for line in distribution(name).requires or ():
            requirement = Requirement(line)
            marker = requirement.marker
            if marker is None or any(marker.evaluate({"extra": extra}) for extra in wanted):
                waiting.append((requirement.name, requirement.extras or {""}))
    return {*packages}


def test_a_plain_install_is_small():
    """Linters, documentation, tests and simulators are no part of it; `make wheel` counts what pip installs."""
    packages = packages_needed("rftfit")
    assert packages.isdisjoint({"mujoco", "mypy", "pytest", "ruff", "snakefmt", "sphinx"})
    assert len(packages) <= MOST_PACKAGES
    of_snakemake = packages - packages_needed("rftfit", left_out={"snakemake"})
    text = (ROOT / "docs" / "install.md").read_text("utf-8")
    counts = re.search(r"installs (\d+) packages.* Snakemake needs (\d+) alone", text)
    assert counts is not None
    assert counts.groups() == (str(len(packages)), str(len(of_snakemake)))


def test_lock_file_has_hashes_and_no_addresses():
    text = (ROOT / "requirements" / "lock.txt").read_text("utf-8")
    entries = re.sub(r"\\\n\s*", "", re.sub(r"(?m)^\s*#.*\n?", "", text)).splitlines()
    assert len(entries) > 50
    problems = [entry for entry in entries if not re.match(r"[\w.-]+==\S+ .*--hash=sha256:", entry)]
    problems += re.findall(r".*(?:https?:|file:|--index-url|--extra-index|--find-links).*", text)
    assert not problems, "\n".join(problems)


def test_places_that_the_architecture_names_exist():
    named = re.findall(r"`([\w/]+\.(?:py|js|html|smk|yaml))(?:: (\w+))?`", ARCHITECTURE)
    assert len([name for _, name in named if name]) > 20
    missing = []
    for path, name in named:
        files = [
            base / path for base in (PACKAGE, *PACKAGE.glob("*/"), ROOT) if (base / path).is_file()
        ]
        defined = re.compile(rf"^\s*(?:def |class |)(?:{name})\b\s*[(:=]", re.MULTILINE)
        if not any(not name or defined.search(file.read_text("utf-8")) for file in files):
            missing.append((path, name))
    assert not missing
