"""Which small changes of the program there are, and how some of them are drawn.

A mutant of a line swaps an operator, a number, a word or a branch of a function's code. Left out are errors that are
raised, sentences, decorators, and what stands outside functions. A mutant of a column changes what a stage returns: a
published column takes the values of its sibling, is scaled, or mirrored (`false_columns.py`).
"""

from __future__ import annotations

import ast
import copy
import difflib
import itertools
import random
import re
import subprocess
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "rftfit"
COLUMNS = "columns"
"""Room of the mutants of columns."""


def both_ways(pairs: Sequence[tuple[Any, Any]]) -> dict[Any, Any]:
    """Each of two by the other one."""
    return dict(pairs) | {second: first for first, second in pairs}


OPERATOR_PAIRS = (
    (ast.Lt, ast.LtE),
    (ast.Gt, ast.GtE),
    (ast.Eq, ast.NotEq),
    (ast.Is, ast.IsNot),
    (ast.In, ast.NotIn),
    (ast.Add, ast.Sub),
    (ast.Mult, ast.Div),
    (ast.BitAnd, ast.BitOr),
    (ast.And, ast.Or),
)
OPERATORS: dict[type[ast.AST], type[ast.AST]] = both_ways(OPERATOR_PAIRS) | {
    ast.FloorDiv: ast.Div,
    ast.Mod: ast.Div,
    ast.Pow: ast.Mult,
}
"""Operators by those that they replace."""
SIBLINGS = (
    ("lo", "hi"),
    ("lower", "upper"),
    ("z", "x"),
    ("min", "max"),
    ("minimum", "maximum"),
    ("argmin", "argmax"),
    ("nanmin", "nanmax"),
    ("any", "all"),
    ("floor", "ceil"),
    ("sin", "cos"),
    ("first", "last"),
    ("begin", "end"),
    ("measured", "predicted"),
    ("beta", "gamma"),
)
"""Words of a name that are taken for each other."""
SIBLING = both_ways(SIBLINGS)
SAFEGUARDS = {"strict", "encoding", "copy", "deep", "ignore_index", "maxsize", "check", "newline"}
"""Arguments that guard against what does not happen, so that a change of them seldom has an effect."""


@dataclass
class Mutant:
    """A passage of a module that is replaced, and what came of it."""

    room: str
    module: str
    line: int
    """First line of its statement, which tests must run to notice it."""
    last_line: int
    begin: int
    """Place of the passage in the module, characters."""
    removed: str
    added: str
    looks_equivalent: bool = False
    verdict: str = ""
    """``noticed``, ``equivalent-looking`` or ``live``."""
    noticed_by: str = ""
    tests: int = 0
    """Tests that were run, the final ones too."""
    tests_of_line: int = 0
    """Tests that run its statement; the slowest are left out where all take too long."""

    @property
    def identity(self) -> tuple[str, int, str, str]:
        """What tells it from others."""
        return self.module, self.begin, self.removed, self.added

    @property
    def statement(self) -> range:
        """Lines of its statement."""
        return range(self.line, self.last_line + 1)

    @property
    def is_column(self) -> bool:
        """Whether it changes a published column."""
        return self.room == COLUMNS

    @property
    def difference(self) -> str:
        """The lines that it changes, as a diff."""
        source = (PACKAGE / self.module).read_text(encoding="utf-8")
        before, after = source.splitlines(), self.mutated(source).splitlines()
        compared = difflib.unified_diff(before, after, n=0, lineterm="")
        return "\n".join(line for line in compared if line[:3] not in ("---", "+++", "@@ "))

    def mutated(self, source: str) -> str:
        """The module's source with the mutant in it."""
        end = self.begin + len(self.removed)
        if source[self.begin : end] != self.removed:
            raise ValueError(f"{self.module} was changed since the mutant was drawn: draw again")
        return source[: self.begin] + self.added + source[end:]

    def __str__(self) -> str:
        """Verdict and place."""
        source = (PACKAGE / self.module).read_text(encoding="utf-8")
        line = source.count("\n", 0, self.begin) + 1
        place = f"{self.verdict} src/rftfit/{self.module}:{line} {self.noticed_by}"
        return f"{place}({self.tests} tests, {self.tests_of_line} run the line)"


def rooms_of_package() -> list[str]:
    """Folders and modules below the package."""
    paths = (path for path in PACKAGE.iterdir() if path.suffix == ".py" or any(path.glob("*.py")))
    return sorted(path.name for path in paths)


# --- mutants of lines -------------------------------------------------------------------------------------------


def draw_lines(
    seed: int, rooms: Iterable[str], number: int, since: str = "", share: float = 0.0
) -> list[Mutant]:
    """Draw mutants of every room, a share of them from lines changed since a commit, where it has such lines."""
    changed_lines = lines_changed_since(since) if since else {}
    drawn: list[Mutant] = []
    for room in rooms:
        folder = PACKAGE / room
        paths = sorted(folder.rglob("*.py")) if folder.is_dir() else [folder]
        mutants = [mutant for path in paths for mutant in mutants_of_module(room, path)]
        order = random.Random(f"{seed} {room}")
        order.shuffle(mutants)
        recent = [
            mutant
            for mutant in mutants
            if changed_lines.get(mutant.module, set()).intersection(mutant.statement)
        ]
        chosen = recent[: round(share * number)]
        drawn += [*chosen, *(mutant for mutant in mutants if mutant not in chosen)][:number]
    return drawn


def lines_changed_since(commit: str) -> dict[str, set[int]]:
    """Lines of each module that a commit did not have."""
    command = ["git", "diff", "--unified=0", "--relative=src/rftfit", commit, "--", "src/rftfit"]
    printed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    lines: dict[str, set[int]] = defaultdict(set)
    module = ""
    for line in printed.splitlines():
        if line.startswith("+++ "):
            module = line.removeprefix("+++ b/")
        elif hunk := re.match(r"@@ \S+ \+(\d+),?(\d*)", line):
            first, count = int(hunk[1]), int(hunk[2] or 1)
            lines[module] |= set(range(first, first + count))
    return lines


def mutants_of_module(room: str, path: Path) -> list[Mutant]:
    """All mutants of the functions of a module."""
    source = path.read_text(encoding="utf-8")
    line_begins = [0, *itertools.accumulate(map(len, source.splitlines(keepends=True)))]

    def place(number: int, column: int) -> int:
        line = source[line_begins[number - 1] : line_begins[number]]
        return line_begins[number - 1] + len(line.encode()[:column].decode())

    mutants = []
    for statement, node, changed, is_safeguard in changes_of(ast.parse(source)):
        begin = place(node.lineno, node.col_offset)
        end = place(node.end_lineno or 0, node.end_col_offset or 0)
        removed, added = source[begin:end], ast.unparse(changed)
        if isinstance(node, ast.BinOp | ast.BoolOp | ast.Compare | ast.IfExp | ast.UnaryOp):
            added = f"({added})"
        body = getattr(statement, "body", None)
        last_line = max(body[0].lineno - 1, statement.lineno) if body else statement.end_lineno or 0
        module = path.relative_to(PACKAGE).as_posix()
        mutants.append(
            Mutant(room, module, statement.lineno, last_line, begin, removed, added, is_safeguard)
        )
    return mutants


def changes_of(tree: ast.Module) -> Iterator[tuple[ast.stmt, ast.expr, ast.expr, bool]]:
    """Statement, expression, changed expression, and whether it is a safeguard, of each change in functions."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for default in [*function.args.defaults, *filter(None, function.args.kw_defaults)]:
                yield from changes_within(function.body[0], default)
            for statement in function.body:
                yield from changes_of_statement(statement)


def changes_of_statement(
    statement: ast.stmt,
) -> Iterator[tuple[ast.stmt, ast.expr, ast.expr, bool]]:
    """Changes of a statement and of those within it; functions within are found by themselves."""
    if isinstance(statement, ast.Raise | ast.FunctionDef | ast.ClassDef | ast.Assert):
        return
    for name, value in ast.iter_fields(statement):
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.stmt):
                yield from changes_of_statement(node)
            elif isinstance(node, ast.ExceptHandler | ast.match_case):
                for inner in node.body:
                    yield from changes_of_statement(inner)
            elif isinstance(node, ast.withitem):
                yield from changes_within(statement, node.context_expr)
            elif isinstance(node, ast.expr) and name not in ("annotation", "target", "targets"):
                yield from changes_within(statement, node)


def changes_within(
    statement: ast.stmt, expression: ast.expr, *, is_safeguard: bool = False
) -> Iterator[tuple[ast.stmt, ast.expr, ast.expr, bool]]:
    """Changes of an expression and of its parts."""
    if isinstance(expression, ast.JoinedStr):
        return  # sentences; Python 3.11 does not know the places of their parts
    for changed in alternatives_of(expression):
        yield statement, expression, changed, is_safeguard
    for child in ast.iter_child_nodes(expression):
        if isinstance(child, ast.expr):
            yield from changes_within(statement, child, is_safeguard=is_safeguard)
        elif isinstance(child, ast.keyword):
            is_guard = is_safeguard or child.arg in SAFEGUARDS
            yield from changes_within(statement, child.value, is_safeguard=is_guard)
        elif isinstance(child, ast.comprehension):
            for part in (child.iter, *child.ifs):
                yield from changes_within(statement, part, is_safeguard=is_safeguard)


def alternatives_of(node: ast.expr) -> Iterator[ast.expr]:
    """What may stand in the place of an expression, its parts as they are."""

    def with_field(**fields: object) -> ast.expr:
        changed = copy.copy(node)
        vars(changed).update(fields)
        return changed

    match node:
        case ast.Compare(ops=[operator, *others]) if type(operator) in OPERATORS:
            yield with_field(ops=[OPERATORS[type(operator)](), *others])
        case ast.BinOp(op=operator) | ast.BoolOp(op=operator) if type(operator) in OPERATORS:
            yield with_field(op=OPERATORS[type(operator)]())
        case ast.UnaryOp(op=ast.Not() | ast.USub() | ast.Invert(), operand=operand):
            yield operand
        case ast.IfExp(body=body, orelse=orelse):
            yield body
            yield orelse
        case ast.Constant(value=bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(value=int() | float() as value):
            yield ast.Constant(value + 1)
        case ast.Constant(value=str() as value) if value and " " not in value:
            yield ast.Constant(sibling_of(value) or f"{value}-other")
        case ast.Name(id=name) if sibling := sibling_of(name):
            if "_" not in name:  # a function of Python or a variable
                yield ast.Name(sibling)
        case ast.Attribute(attr=name) if sibling := sibling_of(name):
            yield with_field(attr=sibling)
        case ast.Call(keywords=[*_, ast.keyword(arg=str())]):
            yield with_field(keywords=node.keywords[:-1])


def sibling_of(name: str) -> str:
    """Name with one word taken for its sibling, or nothing."""
    words = name.split("_")
    for index, word in enumerate(words):
        if word in SIBLING:
            return "_".join([*words[:index], SIBLING[word], *words[index + 1 :]])
    return ""


# --- mutants of columns -----------------------------------------------------------------------------------------


def draw_columns(seed: int, number: int) -> list[Mutant]:
    """Draw published columns of numbers, and for each what is wrong with it."""
    from rftfit.outputs.dictionary import alternatives, outputs
    from rftfit.workflow.stages import STAGES

    order = random.Random(f"{seed} {COLUMNS}")
    columns = [
        (table, stage, column, name)
        for table in outputs()
        for stage in table.stage.split(", ")
        if stage in STAGES and not STAGES[stage].on_demand and not table.file.endswith(".json")
        for column in table.columns
        if column.kind in ("number", "count", "yes or no") and "<" not in column.name
        for name in alternatives(column.name)
    ]
    mutants = []
    for table, stage, column, name in order.sample(columns, min(number, len(columns))):
        published = {name for column in table.columns for name in column.names}
        is_share = column.quantity in ("share", "probability") or "chance" in name
        changes = ["1 - p"] if is_share else ["-p"]
        changes += ["2 * p", "3 * p"]
        if sibling_of(name) in published:
            changes = [*changes[:2], sibling_of(name)]
        change = "~p" if column.kind == "yes or no" else order.choice(changes)
        mutants.append(mutant_of_stage(STAGES[stage].run, table.file, name, change))
    return mutants


def mutant_of_stage(stage: str, table: str, column: str, change: str) -> Mutant:
    """A decorator above the function of a stage."""
    module, _, name = stage.partition(":")
    path = PACKAGE.parent / f"{module.replace('.', '/')}.py"
    source = path.read_text(encoding="utf-8")
    function = next(
        node
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef) and node.name == name
    )
    begin = source.index(f"\ndef {name}(") + 1
    removed = f"def {name}("
    decorator = f'@__import__("false_columns").change({table!r}, {column!r}, {change!r})\n'
    first, last = function.body[0].lineno, function.end_lineno or 0
    module_path = path.relative_to(PACKAGE).as_posix()
    return Mutant(COLUMNS, module_path, first, last, begin, removed, decorator + removed)
