"""Every key of the configuration in words, taken from the models' own JSON schema."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from rftfit.campaign.config import Config

if TYPE_CHECKING:
    from collections.abc import Iterator

NAME = "<name>"
"""Stands for a name that the user chooses, in the path of a key."""

_UNITS = (
    ("_N_per_min", "N/min"),
    ("_cm_per_s", "cm/s"),
    ("_rad_per_s", "rad/s"),
    ("_cm", "cm"),
    ("_mm", "mm"),
    ("_deg", "degrees"),
    ("_N", "N"),
    ("_Hz", "Hz"),
    ("_s", "s"),
)
_PATTERNS = {
    "^[+-]F[123]$": "one of +F1, -F1, +F2, -F2, +F3, -F3 (in quotes)",
    "^([0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01]))?$": "a date as yyyy-mm-dd (in quotes)",
    r"^(https?://\S+)?$": "an address beginning with https:// or http://",
    "^[A-Za-z0-9][A-Za-z0-9._-]*$": "letters A-Z a-z, digits, and . _ -, at most 64",
}
_TYPES = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
}


@dataclass(frozen=True)
class Key:
    """One key of the configuration.

    Attributes
    ----------
    path : tuple of str
        With `NAME` where the user chooses the name.
    shape : str
        The shape of intruder that has this key; empty for all other keys.
    type, unit, default, allowed, description : str
        In words; `default` is ``required`` where there is none.
    """

    path: tuple[str, ...]
    shape: str
    type: str
    unit: str
    default: str
    allowed: str
    description: str

    def fits(self, path: tuple[str | int, ...]) -> bool:
        """Whether a path leads to this key.

        Parameters
        ----------
        path : tuple of str or int
            As met in a file: names of keys, and places in lists.

        Returns
        -------
        bool
        """
        return len(path) == len(self.path) and all(
            own in (NAME, part) for own, part in zip(self.path, path, strict=True)
        )


@cache
def schema() -> dict[str, Any]:
    """JSON schema of the configuration.

    Returns
    -------
    dict
        As made from the models; not to be changed.
    """
    return Config.model_json_schema()


@cache
def all_keys() -> tuple[Key, ...]:
    """Every key of the configuration, in the order of the models.

    Returns
    -------
    tuple of Key
    """
    return tuple(_walk(schema(), ()))


def keys_at(parent: tuple[str | int, ...], shape: str = "") -> list[Key]:
    """Keys that a section can have.

    Parameters
    ----------
    parent : tuple
        Path of the section, as met in a file.
    shape : str
        The shape of the intruder, where it is known.

    Returns
    -------
    list of Key
    """
    found = [key for key in all_keys() if key.fits((*parent, key.path[-1]))]
    return [key for key in found if not (shape and key.shape and key.shape != shape)]


def _walk(node: dict[str, Any], path: tuple[str, ...], shape: str = "") -> Iterator[Key]:
    for name, field in node.get("properties", {}).items():
        target = _follow(field)
        here = (*path, name)
        default = "required" if name in node.get("required", ()) else _default(field)
        yield Key(
            here,
            shape,
            _type(target),
            next((unit for end, unit in _UNITS if name.endswith(end)), ""),
            default,
            _allowed(target),
            field.get("description", ""),
        )
        yield from _walk(target, here)
        # a section whose names the user chooses
        inner = target.get("additionalProperties") or next(
            iter(target.get("patternProperties", {}).values()), None
        )
        if isinstance(inner, dict):
            for variant in inner.get("oneOf", [inner]):
                model = _follow(variant)
                word = model.get("properties", {}).get("shape", {}).get("const", "")
                yield from _walk(model, (*here, NAME), word)


def _follow(node: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in node:
        target: dict[str, Any] = schema()["$defs"][node["$ref"].rsplit("/", 1)[1]]
        return target
    # X | None: the X; X | Y: the first
    for option in node.get("anyOf", ()):
        if option.get("type") != "null":
            nullable = any(other.get("type") == "null" for other in node["anyOf"])
            return {**_follow(option), "nullable": nullable}
    return node


def _type(node: dict[str, Any]) -> str:
    if node.get("type") == "array":
        items = node.get("prefixItems") or [node["items"]]
        count = f"{len(items)} " if "prefixItems" in node else ""
        return f"list of {count}{_type(items[0])}s"
    return _TYPES.get(node.get("type", ""), "section")


def _default(field: dict[str, Any]) -> str:
    value = field.get("default")
    if isinstance(value, dict):
        return "see below"
    if value in (None, ""):
        return "none"
    return ", ".join(f"{part:g}" for part in value) if isinstance(value, list) else str(value)


def _allowed(node: dict[str, Any]) -> str:
    if "const" in node:
        return str(node["const"])
    if "enum" in node:
        return "one of " + ", ".join(map(str, node["enum"]))
    if "pattern" in node:
        return _PATTERNS[node["pattern"]]
    if node.get("type") == "array":
        items = node.get("prefixItems") or [node["items"]]
        what = f"{_type(items[0])}s"
        count = f"{len(items)} {what}" if "prefixItems" in node else f"one or more {what}"
        return f"{count} in [ ], each {_allowed(items[0])}"
    kind = _type(node)
    text = {"text": "text", "section": "a section with keys of its own"}.get(kind, f"a {kind}")
    limits = [
        f"{words} {node[name]:.12g}"
        for name, words in (
            ("exclusiveMinimum", "above"),
            ("minimum", "at least"),
            ("exclusiveMaximum", "below"),
            ("maximum", "at most"),
        )
        if name in node
    ]
    text = " ".join([text, " and ".join(limits)]).strip()
    return text + (" or nothing" if node.get("nullable") else "")
