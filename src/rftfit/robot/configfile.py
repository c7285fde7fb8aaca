"""From ``robot.yaml`` to the checked robot, or to everything that is wrong with the file."""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.problems import CampaignError, Problem, did_you_mean
from rftfit.campaign.yamlfile import Document, parse_yaml
from rftfit.robot.config import Body, BodyPlate, Hip, Legs, Numerics, Robot, hips_outside

if TYPE_CHECKING:
    from rftfit.campaign.yamlfile import KeyPath

MAX_BYTES = 1_000_000

_SECTIONS: dict[KeyPath, type[BaseModel]] = {
    (): Robot,
    ("body",): Body,
    ("body", "plates", "*"): BodyPlate,
    ("legs",): Legs,
    ("legs", "hips", "*"): Hip,
    ("numerics",): Numerics,
}
_WRONG_TYPE = re.compile(r".*(_type|_parsing|from_float)$")
_TYPES = {
    "float": "a number, without quotes",
    "int": "a whole number",
    "string": "text",
    "tuple": "a list",
    "too_short": "a list that is not empty",
    "dict": "a section of entries by name",
    "model": "a section with keys of its own",
    "finite": "a finite number",
}
_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def paper_robot() -> Robot:
    """Robot of the paper: the file ``config/robot.yaml`` that comes with the program.

    Returns
    -------
    Robot

    Raises
    ------
    CampaignError
        If the file has been changed and is no longer right.
    """
    return read_robot(paper_robot_path())


def paper_robot_path() -> Path:
    """Where the robot of the paper stands: in a clone, or beside the installed package.

    Returns
    -------
    Path
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "_workflow" / "config" / "robot.yaml"
    return installed if installed.is_file() else package.parents[1] / "config" / "robot.yaml"


def read_robot(path: Path, name: str = "") -> Robot:
    """Read and check a robot.

    Parameters
    ----------
    path : Path
    name : str, optional
        What messages call it; default: the path.

    Returns
    -------
    Robot

    Raises
    ------
    CampaignError
        If the file cannot be read or anything in it is wrong: all problems, with their lines.
    """
    name = name or str(path)
    data = read_bytes(path, name, "config", MAX_BYTES)
    text = data if isinstance(data, Problem) else decode(data, name, "config")
    if isinstance(text, Problem):
        raise CampaignError([text])
    document = parse_yaml(text, name)
    problems = list(document.problems)
    if document.data is None and not problems:
        text = "the file is empty; start from config/robot.yaml, the robot of the paper"
        problems.append(Problem(name, None, None, None, text, "config.empty"))
    if document.data is not None:
        try:
            robot = Robot.model_validate(document.data)
        except ValidationError as error:
            details = error.errors(include_url=False)
            hips = _hips(document, name)  # looked for here too, whatever else is wrong
            problems += hips + [
                _translate(detail, document, name)
                for detail in details
                if detail["loc"] or not hips
            ]
    if problems:
        raise CampaignError(sorted(problems, key=lambda problem: problem.row or 0))
    return robot


def _hips(document: Document, name: str) -> list[Problem]:
    """Hips off the body, as far as the places of hips and plates can be read."""
    try:
        plates = document.data["body"]["plates"].values()
        ends = [_point(plate[key]) for plate in plates for key in ("from_cm", "to_cm")]
        hips = {}
        for index, hip in enumerate(document.data["legs"]["hips"]):
            with contextlib.suppress(KeyError, TypeError, ValueError):
                hips[index] = _point((hip["x_cm"], hip["z_cm"]))
    except (AttributeError, KeyError, TypeError, ValueError):
        return []
    return [
        Problem(
            name, document.line_of(("legs", "hips", index)), f"legs.hips.{index + 1}", None, text,
            "config.inconsistent",
        )
        for index, text in hips_outside(hips, ends or [(0.0, 0.0)]).items()
    ]  # fmt: skip


def _point(value: Any) -> tuple[float, float]:
    x, z = value
    if not all(isinstance(part, (int, float)) and math.isfinite(part) for part in (x, z)):
        raise ValueError("no numbers")
    return float(x), float(z)


def _translate(detail: Any, document: Document, name: str) -> Problem:
    """One error of the models, in the user's terms."""
    sort: str = detail["type"]
    path: KeyPath = tuple(part for part in detail["loc"] if part != "[key]")
    fields = _fields(path[:-1])
    key = fields.get(str(path[-1])) if path else None
    what = f" ({key.description})" if key is not None else ""
    found: str | None = _words(detail["input"])
    nearest = None
    if sort == "extra_forbidden":
        code, found, allowed = "unknown-key", str(path[-1]), f"one of {', '.join(fields)}"
        nearest = did_you_mean(found, fields)
    elif sort == "missing":
        code, found, allowed = "missing-key", None, f"this key is missing; it is needed{what}"
    elif "[key]" in detail["loc"]:
        code, found = "bad-name", str(path[-1])
        allowed = "letters A-Z a-z, digits, and . _ -, at most 64, beginning with a letter or digit"
    elif sort == "value_error":
        code, found = "inconsistent", None
        allowed = str(detail["msg"]).removeprefix("Value error, ")
    elif sort == "literal_error":
        code, allowed = "unknown-word", f"one of {detail['ctx']['expected']}{what}".replace("'", "")
        words = re.findall(r"'([^']+)'", detail["ctx"]["expected"])
        nearest = did_you_mean(str(detail["input"]), words)
    else:
        code = "wrong-type" if _WRONG_TYPE.match(sort) else "out-of-range"
        bounds = [f"{_BOUNDS[k]} {v:g}" for k, v in detail.get("ctx", {}).items() if k in _BOUNDS]
        expected = next(
            (t for k, t in _TYPES.items() if sort.startswith(k)), str(detail["msg"]).lower()
        )
        allowed = (", ".join(bounds) or expected) + what
    dotted = ".".join(str(part + 1) if isinstance(part, int) else part for part in path)
    return Problem(
        name, document.line_of(path), dotted or None, found, allowed, f"config.{code}",
        nearest=nearest,
    )  # fmt: skip


def _fields(section: KeyPath) -> dict[str, Any]:
    for pattern, model in _SECTIONS.items():
        same = len(pattern) == len(section) and all(
            own in ("*", part) for own, part in zip(pattern, section, strict=True)
        )
        if same:
            return dict(model.model_fields)
    return {}


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return "a section"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else str(value)
