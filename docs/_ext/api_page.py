"""The page of the Python API, made from the docstrings of what `import rftfit` offers."""

from __future__ import annotations

import inspect
import re

GROUPS = {
    "Campaigns and results": (
        "open",
        "Results",
        "Medium",
        "check",
        "run",
        "compare_media",
        "Comparison",
    ),
    "Media": (
        "published_medium",
        "KnownMedium",
        "Profile",
        "TableProfile",
        "FourierProfile",
        "DepthOnlyProfile",
        "scaled_generic",
        "rft3d_profile",
        "read_profile",
        "write_profile",
    ),
    "The paper's scaling": ("scale_by_paper", "ScaledMedium", "Reference", "published_reference"),
    "One push, or a few": (
        "scale",
        "estimate_map",
        "Map",
        "Shapes",
        "published_shapes",
        "plan",
        "Plan",
        "Rig",
    ),
    "Forces on bodies as measurements": ("Contact", "BodyError", "learn_body_error"),
    "Forces": (
        "predict",
        "find_peaks",
        "Peak",
        "beyond_measured",
        "Outline",
        "model_leg",
        "arc",
        "polyline",
        "Motion",
        "rotation",
        "path",
        "Mesh",
        "Motion3D",
        "wheel",
        "WheelAnswer",
        "draw_wheel",
        "Ground",
        "simulate",
    ),
    "Logs and tables": ("read_log", "fit_slope", "published_table"),
    "Errors and warnings": ("RftfitError", "LimitWarning"),
}

_SECTION = re.compile(r"^(\w[\w ]*)\n-+\n", re.MULTILINE)


def api() -> str:
    """Every public name with its signature, docstring and public members."""
    import rftfit

    documented = [name for names in GROUPS.values() for name in names]
    if sorted(documented) != sorted(rftfit.__all__):
        raise ValueError(f"the page lacks {set(rftfit.__all__) ^ set(documented)}")
    text = ""
    for group, names in GROUPS.items():
        text += f"## {group}\n\n"
        for name in names:
            thing = getattr(rftfit, name)
            text += f"### `{name}`\n\n{_signature(f'rftfit.{name}', thing)}{_body(thing)}"
            if inspect.isclass(thing):
                text += "".join(_member(*pair) for pair in vars(thing).items())
    return text


def _signature(name: str, thing: object) -> str:
    if isinstance(thing, type) and (inspect.isabstract(thing) or issubclass(thing, Exception)):
        return ""
    shown = inspect.signature(thing)  # type: ignore[arg-type]
    bare = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in shown.parameters.values()
        if parameter.name not in ("self", "cls")
    ]
    plain = shown.replace(parameters=bare, return_annotation=inspect.Signature.empty)
    return f"```python\n{name}{plain}\n```\n\n"


def _member(name: str, thing: object) -> str:
    if name.startswith("_"):
        return ""
    inner = getattr(thing, "__func__", thing)
    if inspect.isfunction(inner):
        return f"#### `.{name}`\n\n{_signature(f'.{name}', inner)}{_body(inner)}"
    if isinstance(thing, property) or hasattr(thing, "attrname"):
        return f"#### `.{name}`\n\n{_body(thing)}"
    return ""


def _body(thing: object) -> str:
    """Make Markdown of a numpydoc docstring."""
    parts = _SECTION.split(inspect.getdoc(thing) or "")
    text = _prose(parts[0])
    for title, content in zip(parts[1::2], parts[2::2], strict=True):
        if title == "Examples":
            text += f"```python\n{re.sub(r'  # doctest:.*', '', content).strip()}\n```\n\n"
        else:
            text += f"{title}:\n\n{_entries(content)}\n"
    return text


def _entries(content: str) -> str:
    text = ""
    for entry in re.split(r"\n(?=\S)", content.strip()):
        head, _, description = entry.partition("\n")
        name, _, kind = head.partition(" : ")
        text += f"- `{name}`{kind and f' ({kind})'}"
        text += f": {_line(description)}\n" if description.strip() else "\n"
    return text


def _prose(text: str) -> str:
    return "".join(
        f"{_line(paragraph)}\n\n" for paragraph in text.split("\n\n") if paragraph.strip()
    )


def _line(text: str) -> str:
    words = " ".join(text.replace("``", "`").split())
    # a star or a brace outside code is no markup here
    return re.sub(r"(`[^`]*`)|([*_<$\[])", lambda m: m[1] or f"\\{m[2]}", words)
