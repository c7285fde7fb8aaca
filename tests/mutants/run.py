"""Mutation check of the physics: change the code in small ways and see whether a test notices.

    make mutants                                   a sample of all modules, as docs/reliability.md tells
    make mutants ARGS="--share 1 --only profile"   every mutant of a room or module
    make mutants ARGS=--again                      the survivors, after new tests
    make mutants ARGS=--table                      what the last runs found
    make mutants ARGS="--show NAME"                what a mutant changes

mutmut makes the mutants; one copy of the program holds them all, and a variable of the environment
says which one is awake. This script runs them, one on each core: each in a child of one process that has
numpy, scipy and pandas loaded, with the tests that `modules.toml` names, quickest first, to the first failure.
mutmut's own runner would need the compiled kernels left out, because its switch does not compile: in
the copy they are plain Python (the decorators are taken off), and everything else is as it is.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tomllib
import traceback
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
PLAN = tomllib.loads((HERE / "modules.toml").read_text(encoding="utf-8"))
SHARE: dict[str, float] = PLAN["share"]
ROOT = HERE.parents[1]
TREE = ROOT / ".mutants"
RESULT = TREE / "result.json"
COPIED = ("src", "tests", "config", "docs", "examples", "profiles", "studies", "workflow")
PRELOADED = (
    "numpy",
    "scipy.special",
    "pandas",
    "hypothesis",
    "numba",
    "pydantic",
    "yaml",
    "pytest",
)
KERNELS = ("model/kernel.py",)
COMPILED = re.compile(r"^( *)@(?:_compiled|_step)\n", re.MULTILINE)
# what a message says is not physics: that there is an error is, and its tests ask for it
MESSAGE = re.compile(r"^\s*raise \w+Error\(")
MEMORY_BYTES = 8 * 2**30


def copy():
    """Copy the program, as it is."""
    for name in COPIED:
        shutil.rmtree(TREE / name, ignore_errors=True)
        shutil.copytree(
            ROOT / name, TREE / name, ignore=shutil.ignore_patterns("__pycache__", "_build")
        )
    for name in ("pyproject.toml", "Snakefile", "README.md"):
        shutil.copy(ROOT / name, TREE / name)


def build(modules):
    """Put all mutants of some modules into the copy; give their names by module."""
    mutmut: Any = importlib.import_module("mutmut.mutation.file_mutation")
    names = {}
    for module in KERNELS:
        shutil.copy(ROOT / "src/rftfit" / module, TREE / "src/rftfit" / module)
    for module in modules:
        source = (ROOT / "src/rftfit" / module).read_text(encoding="utf-8")
        if module in KERNELS:
            source = as_plain_python(source)
        made = mutmut.mutate_file_contents(module, source, None, message_lines(source))
        (TREE / "src/rftfit" / module).write_text(made.code, encoding="utf-8")
        names[module] = [f"{dotted(module)}.{name}" for name in made.mutant_names]
    return names


def as_plain_python(source):
    """Turn a compiled module into one that Python runs, with numpy's arithmetic as when compiled."""
    return COMPILED.sub("", source).replace("import math\n", "import numpy as math\n", 1)


def dotted(module):
    """Name under which a module is imported."""
    return "rftfit." + module.removesuffix(".py").replace("/", ".")


def message_lines(source):
    """Lines of the statements that raise an error with a message."""
    lines = source.splitlines()
    found: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Raise) and MESSAGE.match(lines[node.lineno - 1]):
            found |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return found


def show(name):
    """Tell the difference that a mutant of the last build makes."""
    module, _, function = name.rpartition(".")
    text = (TREE / "src" / (module.replace(".", "/") + ".py")).read_text(encoding="utf-8")
    ends = f"{function.partition('__mutmut_')[0]}__mutmut_orig", function
    found = {
        end: (ast.get_source_segment(text, node) or "").splitlines()[1:]
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef)
        for end in ends
        if node.name.endswith(end)
    }
    now, mutant = (found[end] for end in ends)
    return "\n".join(difflib.unified_diff(now, mutant, lineterm="", n=1))


def judged(names, tests, limit_s):
    """Judge mutants, as many at once as there are cores: name, verdict and the processor's seconds."""
    waiting, running = [*reversed(names)], dict[int, str]()
    while waiting or running:
        while waiting and len(running) < (os.cpu_count() or 1):
            name = waiting.pop()
            running[started(name, tests, limit_s)] = name
        child, status, used = os.wait4(-1, 0)
        yield running.pop(child), verdict_of(status), used.ru_utime + used.ru_stime


def started(name, tests, limit_s):
    """Wake one mutant up in a child process, which runs the tests; give its number."""
    child = os.fork()
    if child == 0:
        code = 70
        try:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
            signal.signal(signal.SIGPROF, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_PROF, limit_s)
            os.environ["MUTANT_UNDER_TEST"] = name
            import pytest

            if name:  # the run without a mutant says what it finds
                nothing = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nothing, 1)
                os.dup2(nothing, 2)
            options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short",
                       "--no-showlocals", "-W", "ignore::pytest.PytestAssertRewriteWarning"]  # fmt: skip
            code = int(pytest.main([*options, *tests]))
        except Exception:  # noqa: BLE001 - a child never goes on as its parent would
            traceback.print_exc()
        finally:
            os._exit(code)
    return child


def verdict_of(status):
    """What the end of a child process says of its mutant."""
    if os.WIFSIGNALED(status):
        return "timeout" if os.WTERMSIG(status) == signal.SIGPROF else "crash"
    # 1: a test failed; 2: tests could not even be collected
    return {0: "survived", 1: "killed", 2: "killed"}.get(os.WEXITSTATUS(status), "crash")


def parse():
    """Read the command line."""
    parser = argparse.ArgumentParser(description="Mutation check of the physics modules.")
    parser.add_argument("--share", type=float, help="of the mutants of each module, 0 to 1")
    parser.add_argument("--seed", type=int, default=2013, help="of the choice of mutants")
    parser.add_argument("--only", default="", help="modules whose path has this in it")
    parser.add_argument("--again", action="store_true", help="run the survivors of the last time")
    parser.add_argument("--show", metavar="NAME", help="print what a mutant changes")
    parser.add_argument("--table", action="store_true", help="print what the last runs found")
    return parser.parse_args()


def chosen(names, module, options, before):
    """Take the mutants that are run: the last survivors, or the same sample every time."""
    if options.again:
        return [name for name in names if before.get(name) == "survived"]
    share = options.share or SHARE.get(module, SHARE["default"])
    order = random.Random(f"{options.seed} {module}")
    return sorted(order.sample(names, max(round(share * len(names)), min(10, len(names)))))


def main():
    """Run the check and print one line per module, then the survivors."""
    options = parse()
    if options.table:
        print(table())
        return 0
    if options.show:
        copy()
        build([one for one in PLAN["tests"] if dotted(one) == options.show.rpartition(".")[0]])
        print(show(options.show))
        return 0
    threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    os.environ |= dict.fromkeys((*threads, "PYTHONDONTWRITEBYTECODE"), "1")
    os.environ["NUMBA_CACHE_DIR"] = str(TREE / "numba")
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(TREE / "hypothesis")
    sys.dont_write_bytecode = True
    every = {module: tests for module, tests in PLAN["tests"].items() if options.only in module}
    # the compiled kernels are taken apart only while it is their turn: others need them quick
    copy()
    names = build([module for module in every if module not in KERNELS])
    os.chdir(TREE)
    sys.path.insert(0, str(TREE / "src"))
    for module in PRELOADED:
        importlib.import_module(module)
    result = found_before()
    print(f"{'module':32}{'mutants':>8}{'run':>6}{'killed':>8}{'cpu s':>8}")
    for module, tests in every.items():
        if module in KERNELS:
            names |= build([module])
        before = result.get(module, {}).get("verdicts", {})
        sample = chosen(names[module], module, options, before)
        if not sample:
            continue
        paths = [f"tests/{test}" if test.endswith(".py") else test for test in tests]
        if module in KERNELS:
            paths += ["-W", "ignore::RuntimeWarning"]  # as compiled code, which warns of nothing
        for _ in range(2):  # the first time may compile
            _, verdict, clean_s = next(judged([""], paths, 600))
            if verdict != "survived":
                print(f"{module}: the tests fail without a mutant ({verdict})", file=sys.stderr)
                return 1
        verdicts, spent = dict.fromkeys(sample, ""), 0.0
        for name, verdict, taken in judged(sample, paths, 10 + 8 * clean_s):
            verdicts[name] = verdict
            spent += taken
        alive = sum(verdict == "survived" for verdict in verdicts.values())
        line = f"{module:32}{len(names[module]):8}{len(sample):6}{len(sample) - alive:8}"
        print(f"{line}{spent:8.0f}", flush=True)
        verdicts = before | verdicts if options.again else verdicts
        result[module] = {"made": len(names[module]), "verdicts": verdicts}
        RESULT.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print(table())
    return 0


def found_before():
    """Read what earlier runs found, by module."""
    return json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}


def table():
    """Tell mutants, score and survivors of all modules that were run so far."""
    lines = ["| module | mutants | run | killed | survived |", "|---|---|---|---|---|"]
    alive, every = list[str](), 0
    for module, found in found_before().items():
        left = [name for name, verdict in found["verdicts"].items() if verdict == "survived"]
        run = len(found["verdicts"])
        lines.append(f"| `{module}` | {found['made']} | {run} | {run - len(left)} | {len(left)} |")
        alive, every = alive + left, every + run
    lines.append(f"score {100 * (1 - len(alive) / max(every, 1)):.1f} % of {every}; survivors:")
    return "\n".join(lines + alive)


if __name__ == "__main__":
    sys.exit(main())
