"""Inner names of the program that tests import, and the file that declares them.

`python tests/helpers/seams.py` prints how many are declared; with `--write` it writes those in use.
"""

import argparse
import ast
import sys
import tomllib
from pathlib import Path

import rftfit

TESTS = Path(__file__).resolve().parents[1]
DECLARED = TESTS / "seams.toml"
HEAD = """\
# Inner names that tests import, by module: what a rebuilt module breaks. A name may leave this list, none may join it.
# `python tests/helpers/seams.py` counts them, `--write` takes those out that no test imports any more.

"""


def names_in(path):
    """Yield module and name of each import of the program in a file, but for the public names."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"), filename=str(path))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("rftfit."):
                    yield alias.name, ""
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "rftfit":
            module = node.module or ""
            for alias in node.names:
                if module != "rftfit" or alias.name not in rftfit.__all__:
                    yield module, alias.name


def used_names():
    """Files of tests by the inner name that they import."""
    files: dict[tuple[str, str], list[Path]] = {}
    for path in sorted(TESTS.rglob("*.py")):
        for name in names_in(path):
            files.setdefault(name, []).append(path.relative_to(TESTS))
    return files


def declared_names():
    """Inner names that `seams.toml` declares; a module that is imported as a whole has no name."""
    modules = tomllib.loads(DECLARED.read_text("utf-8"))
    return {(module, name) for module, names in modules.items() for name in names}


def write(names):
    """Write the file that declares inner names, sorted by module."""
    modules: dict[str, list[str]] = {}
    for module, name in sorted(names):
        modules.setdefault(module, []).append(name)
    lines = []
    for module, inner in modules.items():
        quoted = ", ".join(f'"{name}"' for name in inner)
        lines.append(f'"{module}" = [{quoted}]\n')
    DECLARED.write_text(HEAD + "".join(lines), "utf-8")


def main():
    """Count the declared names, or take out those that are no longer used."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--write", action="store_true", help="take out what no test imports")
    if parser.parse_args().write:
        used = used_names()
        write(declared_names() & used.keys() if DECLARED.is_file() else used)
    declared = declared_names()
    modules = {module for module, _ in declared}
    sys.stdout.write(f"{len(declared)} inner names of {len(modules)} modules\n")


if __name__ == "__main__":
    main()
