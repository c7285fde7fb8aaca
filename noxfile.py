#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.10.14"]
# ///
"""Sessions for those who prefer nox; `make` runs the same steps."""

from __future__ import annotations

import nox

nox.needs_version = ">=2025.10.14"
nox.options.default_venv_backend = "uv|virtualenv"


def install_locked(session: nox.Session) -> None:
    session.install("--require-hashes", "-r", "requirements/lock.txt")
    session.install("--no-deps", "--no-build-isolation", "-e", ".")


@nox.session(python=["3.11", "3.12", "3.13"])
def tests(session: nox.Session) -> None:
    """Run the test suite."""
    install_locked(session)
    session.run("python", "-m", "pytest", "-n", "2", "--dist", "loadfile", *session.posargs)


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, types, the workflow and the shape of the project."""
    install_locked(session)
    session.run("ruff", "check")
    session.run("ruff", "format", "--check")
    session.run("snakefmt", "--check", "Snakefile", "workflow")
    session.run("mypy")
    session.run("snakemake", "--lint")
    session.run("sp-repo-review", ".")


@nox.session(default=False)
def docs(session: nox.Session) -> None:
    """Build the documentation site in docs/_build."""
    install_locked(session)
    session.run(
        "python", "-m", "sphinx", "-W", "--keep-going", "-b", "html", "docs", "docs/_build/html"
    )


if __name__ == "__main__":
    nox.main()
