#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.10.14"]
# ///
"""Sessions for those who prefer nox: each calls the step of the Makefile, in the environment of `make env`."""

from __future__ import annotations

import shlex

import nox

nox.needs_version = ">=2025.10.14"
nox.options.default_venv_backend = "none"


def make(session: nox.Session, step: str) -> None:
    session.run("make", step, f"ARGS={shlex.join(session.posargs)}", external=True)


@nox.session
def tests(session: nox.Session) -> None:
    """Run the tests."""
    make(session, "test")


@nox.session
def lint(session: nox.Session) -> None:
    """Check style, types, the workflow and the shape of the project."""
    make(session, "lint")


@nox.session(default=False)
def docs(session: nox.Session) -> None:
    """Build the documentation site in docs/_build."""
    make(session, "docs")


if __name__ == "__main__":
    nox.main()
