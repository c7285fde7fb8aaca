"""What a text in the source will look like: fixed words as they are, the rest as ``<name>``."""

from __future__ import annotations

import ast
import re

Constants = dict[str, ast.expr]


def last_name(node: ast.AST) -> str:
    """Name, or last part of a dotted one; of ``row["reason"]`` the word in brackets."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.Subscript):
        named = isinstance(node.slice, ast.Constant)
        return str(node.slice.value) if named else last_name(node.value)  # type: ignore[attr-defined]
    return ""


def template(node: ast.expr, constants: Constants) -> str | None:
    """Text of an expression, with names for what is filled in.

    Parameters
    ----------
    node : ast.expr
    constants : dict of str to ast.expr
        Of the module.

    Returns
    -------
    str or None
        None where the expression is no text.
    """
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        parts = [
            str(part.value) if isinstance(part, ast.Constant) else _place(part.value, constants)  # type: ignore[attr-defined]
            for part in node.values
        ]
        return "".join(parts)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = template(node.left, constants), template(node.right, constants)
        if left is None and right is None:
            return None
        return (_place(node.left, constants) if left is None else left) + (
            _place(node.right, constants) if right is None else right
        )
    if isinstance(node, ast.Name) and node.id.isupper() and node.id in constants:
        return template(constants[node.id], constants)
    return None


def whole(node: ast.expr, constants: Constants) -> str:
    """Text of an expression; a name where it is none."""
    text = template(node, constants)
    return _place(node, constants) if text is None else text


def _place(node: ast.expr, constants: Constants) -> str:
    """Name what stands for an expression in a text."""
    if isinstance(node, ast.IfExp):
        one, other = template(node.body, constants), template(node.orelse, constants)
        if one is not None and other is not None:
            return f"({one}|{other})" if one and other else f"[{one or other}]"
        if (one or other) == "":
            return f"[{_place(node.orelse if one == '' else node.body, constants)}]"
        return _place(node.body, constants)
    if isinstance(node, ast.BoolOp):
        first, last = _place(node.values[0], constants), template(node.values[-1], constants)
        return f"({first}|{last})" if last else first
    if isinstance(node, ast.Name) and node.id in constants:
        text = template(constants[node.id], constants)
        return f"<{node.id.strip('_').lower()}>" if text is None else text
    fixed = template(node, constants)
    if fixed is not None:
        return fixed
    if isinstance(node, ast.Call):
        owner = node.func.value if isinstance(node.func, ast.Attribute) else None
        library = isinstance(owner, ast.Name) and owner.id in ("np", "math", "re", "textwrap")
        joined = owner is not None and node.args and last_name(node.func) == "join"
        if owner is not None and not (library or joined):
            return _place(owner, constants)
        return _place(node.args[0], constants) if node.args else f"<{last_name(node.func)}>"
    if isinstance(node, ast.BinOp) and isinstance(node.left, ast.Constant):
        return _place(node.right, constants)
    inner = {
        ast.BinOp: "left", ast.UnaryOp: "operand", ast.Subscript: "value", ast.Starred: "value",
    }.get(type(node))  # fmt: skip
    if inner:
        return _place(getattr(node, inner), constants)
    if isinstance(node, (ast.GeneratorExp, ast.ListComp)):
        return _place(node.generators[0].iter, constants)
    return f"<{last_name(node).strip('_').lower() or 'value'}>"


def words_of(text: str) -> list[str]:
    """Words of a text that are not filled in."""
    return re.findall(r"[a-z]{2,}", re.sub(r"<[^<>]*>", "", text))
