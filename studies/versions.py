"""The tests with the oldest and the newest version of every package that `pyproject.toml` allows: ``make matrix``.

    make matrix                                         the whole suite in both environments
    make matrix ARGS="-m 'not page and not slow'"       words for pytest: a part of the suite
    make matrix ARGS="--only oldest"                    one environment

Each lower bound is installed as it is stated, so it must be a version that was published; packages that
others need are chosen by pip. The environments are kept in `.versions`. The newest Python on the PATH
runs the newest versions, the oldest one that is allowed the oldest.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / ".versions"
OLDEST, NEWEST = "oldest", "newest"
GROUPS = ("build", "test")
"""Dependency groups without which the tests do not run."""
PYTHONS = ("3.11", "3.12", "3.13")
PIP = ("-m", "pip", "--disable-pip-version-check")
PYTEST = ("-m", "pytest", "-q", "--dist", "loadfile", "--no-loadscope-reorder")
# an old package that uses what a new one deprecates says nothing of this program
DEPRECATED = ("-W", "ignore::DeprecationWarning", "-W", "ignore::PendingDeprecationWarning")


def read_requirements() -> list[Requirement]:
    """Read what the program, its extras and its tests need, by name; of two entries the first."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    settings = tomllib.loads(text)
    extras = settings["project"]["optional-dependencies"]
    lines = [
        *settings["project"]["dependencies"],
        *(line for extra in extras.values() for line in extra),
    ]
    lines += [line for group in GROUPS for line in settings["dependency-groups"][group]]
    requirements: dict[str, Requirement] = {}
    for requirement in map(Requirement, lines):
        requirements.setdefault(canonicalize_name(requirement.name), requirement)
    return [requirements[name] for name in sorted(requirements)]


def lower_bound(requirement: Requirement) -> str:
    """Return the lowest version that a requirement allows."""
    bounds = [
        specifier.version for specifier in requirement.specifier if specifier.operator == ">="
    ]
    if len(bounds) != 1:
        sys.exit(f"{requirement}: one lower bound is needed, such as {requirement.name}>=1.2")
    return bounds[0]


@dataclass(frozen=True)
class Environment:
    """A virtual environment with one choice of versions."""

    name: str
    python: str

    @property
    def folder(self) -> Path:
        """Where it lies."""
        return PLACE / self.name

    @property
    def program(self) -> Path:
        """Its Python."""
        return self.folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"

    def words(self, requirements: list[Requirement]) -> list[str]:
        """Return what pip is asked for."""
        if self.name == OLDEST:
            return [
                f"{requirement.name}=={lower_bound(requirement)}" for requirement in requirements
            ]
        return ["--upgrade", "--upgrade-strategy=eager", *map(str, requirements)]

    def make(self, requirements: list[Requirement]) -> None:
        """Install the packages and the project; what is there with the same words is kept, but brought up to date."""
        words = self.words(requirements)
        stamp, stamp_text = self.folder / "made-from", "\n".join([self.python, *words])
        is_current = stamp.is_file() and stamp.read_text(encoding="utf-8") == stamp_text
        if is_current and self.name == OLDEST:
            return
        if not is_current:
            subprocess.run([self.python, "-m", "venv", "--clear", str(self.folder)], check=True)
        print(
            f"{self.name}: installing {len(requirements)} packages and what they need ...",
            flush=True,
        )
        self.pip(*words)
        self.pip("--no-deps", "--no-build-isolation", "--editable", str(ROOT))
        stamp.write_text(stamp_text, encoding="utf-8")

    def run(
        self, *words: str, check: bool = False, **options: Any
    ) -> subprocess.CompletedProcess[str]:
        """Run its Python."""
        return subprocess.run([str(self.program), *words], check=check, text=True, **options)

    def pip(self, *words: str) -> None:
        """Install."""
        if self.run(*PIP, "install", "--quiet", *words).returncode:
            sys.exit(f"{self.name}: pip cannot install what pyproject.toml allows; see above")

    def installed(self) -> dict[str, str]:
        """Return the version of every package."""
        done = self.run(*PIP, "list", "--format=freeze", check=True, capture_output=True)
        pairs = (line.split("==") for line in done.stdout.splitlines() if "==" in line)
        return {canonicalize_name(name): version for name, version in pairs}

    def test(self, words: list[str]) -> tuple[int, str]:
        """Run the tests; exit status and pytest's last line. Their output is kept beside the environment."""
        log = PLACE / f"{self.name}.txt"
        ignored = DEPRECATED if self.name == OLDEST else ()
        with log.open("wb") as out:
            code = self.run(
                *PYTEST, *ignored, *words, cwd=ROOT, stdout=out, stderr=subprocess.STDOUT
            ).returncode
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
        for line in lines:
            if re.match(r"(FAILED|ERROR) ", line):
                print(f"{self.name}: {line}")
        last = next((line for line in reversed(lines) if line), "no output")
        return code, last.strip("= ")


def find_pythons() -> list[str]:
    """Find Pythons that the project allows, older first; this one at least."""
    programs = []
    for version in PYTHONS:
        program = shutil.which(f"python{version}")
        if (
            program
            and not subprocess.run([program, "-c", ""], check=False, capture_output=True).returncode
        ):
            programs.append(program)
    return programs or [sys.executable]


def main() -> None:
    """Make the environments, run the tests in each, print two tables; exit status 1 if a test fails."""
    pythons = find_pythons()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--only", choices=(OLDEST, NEWEST))
    parser.add_argument("--oldest-python", default=pythons[0], help="default: %(default)s")
    parser.add_argument("--newest-python", default=pythons[-1], help="default: %(default)s")
    parser.add_argument("--workers", default="2", help="processes that run tests")
    chosen, words = parser.parse_known_args()
    requirements = read_requirements()
    environments = [
        Environment(OLDEST, chosen.oldest_python),
        Environment(NEWEST, chosen.newest_python),
    ]
    environments = [
        environment for environment in environments if chosen.only in (None, environment.name)
    ]
    PLACE.mkdir(exist_ok=True)
    for environment in environments:
        environment.make(requirements)
    installed = [environment.installed() for environment in environments]
    names = [environment.name for environment in environments]
    print(f"| package | allowed | {' | '.join(names)} |\n|---|---|{'---|' * len(names)}")
    for requirement in requirements:
        name = canonicalize_name(requirement.name)
        versions = " | ".join(installed_versions.get(name, "-") for installed_versions in installed)
        print(f"| {name} | {requirement.specifier} | {versions} |", flush=True)
    # what the command line says comes last, so that it wins
    pytest_words = ["-n", chosen.workers, "-m", "not page", *words]
    print("\n| versions | Python | tests |\n|---|---|---|", flush=True)
    failed = False
    for environment in environments:
        version = environment.run("--version", check=True, capture_output=True).stdout.split()[1]
        code, summary = environment.test(pytest_words)
        failed |= code != 0
        print(f"| {environment.name} | {version} | {summary} |", flush=True)
    sys.exit(int(failed))


if __name__ == "__main__":
    main()
