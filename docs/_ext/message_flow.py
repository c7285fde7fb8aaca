"""Where the value of a name in the source comes from, as far as it is a text."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from message_texts import Constants, last_name, template, whole, words_of

if TYPE_CHECKING:
    from collections.abc import Iterator


class Flow:
    """One module of the source, and what its names can be.

    Parameters
    ----------
    tree : ast.Module
    """

    def __init__(self, tree: ast.Module) -> None:
        self.tree = tree
        self.nodes = list(ast.walk(tree))
        self.parent = {child: node for node in self.nodes for child in ast.iter_child_nodes(node)}
        self.constants: Constants = {
            target.id: node.value
            for node in tree.body
            if isinstance(node, ast.Assign)
            for target in node.targets
            if isinstance(target, ast.Name)
        }

    def text(self, value: ast.expr, other: str | None = None) -> str | None:
        """Text of an expression; a local name in it that is itself a sentence is written out."""
        text = template(value, self.constants)
        if text is None:
            return other
        if isinstance(value, ast.JoinedStr):
            for part in value.values:
                inner = part.value if isinstance(part, ast.FormattedValue) else None
                if isinstance(inner, ast.Name) and f"<{inner.id}>" in text:
                    found = self.assigned(inner)
                    if len(found) == 1 and len(words_of(found[0][1])) > 2:
                        text = text.replace(f"<{inner.id}>", found[0][1])
        return text

    def is_handed_on(self, name: ast.Name) -> bool:
        """Whether a name is a parameter, so that the text is made where the function is called."""
        function = self.function(name)
        arguments = function.args.args if function is not None else []
        return any(one.arg == name.id for one in arguments)

    def beside(self, place: ast.AST, name: str) -> list[tuple[str, ast.AST]]:
        """Texts that a name gets in the block of `place`, or else anywhere in its function."""
        statement = self.statement(place)
        for nodes in (self.block(statement), list(ast.walk(self.function(place) or self.tree))):
            found: list[tuple[str, ast.AST]] = [
                (text, node)
                for node in nodes
                if isinstance(node, (ast.Assign, ast.AnnAssign))
                for target, value in pairs(node)
                if target == name
                for part in either(value)
                if (text := template(part, self.constants))
            ]
            if found:
                return found
        return []

    def assigned(self, name: ast.Name, *, put_together: bool = False) -> list[tuple[ast.AST, str]]:
        """Texts that a local name can have where it is used, with the statements that give them."""
        statement: ast.AST = self.statement(name)
        added = ""
        found: list[tuple[ast.AST, str]] = []
        while not isinstance(statement, (ast.FunctionDef, ast.Module)):
            block = self.block(statement)
            for node in reversed(block[: block.index(statement)] if statement in block else []):
                if isinstance(node, ast.AugAssign) and last_name(node.target) == name.id:
                    added = whole(node.value, self.constants) + added
                    continue
                if isinstance(node, ast.If) and any(
                    isinstance(inner, ast.AugAssign) and last_name(inner.target) == name.id
                    for inner in node.body
                ):
                    more = [
                        whole(inner.value, self.constants)
                        for inner in node.body
                        if isinstance(inner, ast.AugAssign)
                    ]
                    added = f"[{''.join(more)}]" + added
                    continue
                for inner in ast.walk(node):
                    if isinstance(inner, (ast.Assign, ast.AnnAssign)):
                        found += [
                            (inner, text + added)
                            for target, value in pairs(inner)
                            if target == name.id
                            for part in either(value)
                            if (text := self.text(part, "<allowed>" if put_together else None))
                            is not None
                        ]
                if found and (isinstance(node, ast.Assign) or getattr(node, "orelse", None)):
                    return found
            statement = self.parent[statement]
        return found

    def lists(self, name: ast.Name) -> list[ast.expr]:
        """Find what stands in the lists and comprehensions that a local name is."""
        function = self.function(name)
        values = [
            value
            for node in (ast.walk(function) if function is not None else ())
            if isinstance(node, ast.Assign)
            for target, value in pairs(node)
            if target == name.id
        ]
        listed = [one for value in values if isinstance(value, ast.List) for one in value.elts]
        listed += [value.elt for value in values if isinstance(value, ast.ListComp)]
        # a list that is made longer holds itself
        return [one for one in listed if not isinstance(one, (ast.Starred, ast.Name))]

    def statement(self, node: ast.AST) -> ast.stmt:
        """Find the statement that an expression is part of."""
        while not isinstance(node, ast.stmt):
            node = self.parent[node]
        return node

    def block(self, statement: ast.AST) -> list[ast.AST]:
        """List the statements side by side with one."""
        above = self.parent[statement]
        for field in ("body", "orelse", "finalbody", "handlers"):
            block = getattr(above, field, [])
            if isinstance(block, list) and statement in block:
                return block
        return []

    def function(self, node: ast.AST) -> ast.FunctionDef | None:
        """Find the function around a place."""
        inner: ast.AST | None = node
        while inner is not None and not isinstance(inner, ast.FunctionDef):
            inner = self.parent.get(inner)
        return inner

    def function_name(self, node: ast.AST) -> str:
        """Name the function around a place; empty outside of functions."""
        function = self.function(node)
        return function.name if function is not None else ""


def pairs(node: ast.Assign | ast.AnnAssign | ast.AugAssign) -> Iterator[tuple[str, ast.expr]]:
    """Names that an assignment gives values to, with the values."""
    if node.value is None:
        return
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from (
                (last_name(one), value)
                for one, value in zip(target.elts, node.value.elts, strict=False)
            )
        else:
            yield last_name(target), node.value


def either(value: ast.expr) -> list[ast.expr]:
    """List what an expression can be: both sides of a condition, or itself."""
    return [value.body, value.orelse] if isinstance(value, ast.IfExp) else [value]
