"""Any robot in the plane: the model behind ``config/robot.yaml``, its reader and its checks."""

from __future__ import annotations

import contextlib
import json
import math
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from rftfit.campaign.config import Model, Name, NotNegative, Positive
from rftfit.campaign.problems import CampaignError, Problem, did_you_mean
from rftfit.campaign.reading import Document, decode, parse_yaml, read_bytes
from rftfit.errors import RftfitError
from rftfit.store import write_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rftfit.campaign.reading import KeyPath


# --- The model behind ``config/robot.yaml``: any robot in the plane, its gait and the numerics.


Point = Annotated[tuple[float, float], Field(strict=False)]
STANDARD_GRAVITY_CM_PER_S2 = 980.665
_INSIDE_CM = 1e-9


class BodyPlate(Model):
    """A thin straight plate of the body, across the plane."""

    from_cm: Point = Field(description="one end: x, z from the centre of mass, cm")
    to_cm: Point = Field(description="the other end: x, z from the centre of mass, cm")
    width_cm: Positive = Field(description="across the plane, cm")

    @model_validator(mode="after")
    def _has_length(self) -> BodyPlate:
        if self.from_cm == self.to_cm:
            raise ValueError("the two ends of a plate must differ")
        return self


class Body(Model):
    """The rigid body; the origin of its frame is its centre of mass, x forward, z up."""

    mass_g: Positive = Field(description="mass of the whole robot, g")
    inertia_g_cm2: Positive = Field(description="moment of inertia in pitch, g cm^2")
    plates: dict[Name, BodyPlate] = Field(
        min_length=1, description="plates that may touch the medium, by name"
    )


class Hip(Model):
    """An axle with its leg."""

    x_cm: float = Field(description="ahead of the centre of mass, cm")
    z_cm: float = Field(description="above the centre of mass, cm")
    phase_turns: float = Field(
        ge=0, lt=1, description="how far ahead of the first this leg is turned, 0 to 1"
    )


class Legs(Model):
    """The legs: equal arcs through hip and tip, without mass."""

    max_length_cm: Positive = Field(description="2R', from hip to tip, cm")
    width_cm: Positive = Field(description="along the axle, cm")
    hips: tuple[Hip, ...] = Field(
        strict=False, min_length=1, description="one entry for each leg: x_cm, z_cm, phase_turns"
    )


class Numerics(Model):
    """How a run is stepped and judged."""

    method: Literal["semi_implicit_euler", "rk4"] = Field(
        default="semi_implicit_euler", description="explicit, of fixed step"
    )
    step_s: float = Field(
        default=1e-4, gt=0, le=0.01, description="longest step; a stride is a whole number of them"
    )
    elements: int = Field(default=30, ge=1, le=1000, description="of each plate and each leg")
    gravity_cm_per_s2: NotNegative = Field(default=STANDARD_GRAVITY_CM_PER_S2, description="cm/s^2")
    drop_cm: float = Field(
        default=0.0, description="height of the robot's lowest point above the surface at the start"
    )
    stretch_s: NotNegative = Field(
        default=0.6, description="shortest stretch of whole strides whose mean speed is judged, s"
    )
    most_stretches: int = Field(
        default=16, ge=4, le=1000, description="longest run, in such stretches"
    )
    settled_share: Positive = Field(
        default=0.005, description="settled: two stretches differ less in speed, as a share"
    )
    settled_cm_per_s: Positive = Field(
        default=0.05, description="or differ less in speed than this, cm/s"
    )
    steady_share: Positive = Field(
        default=0.05,
        description="irregular, yet steady: two thirds of a longest run differ less, as a share",
    )
    tipped_deg: float = Field(
        default=90.0, gt=0, le=180, description="a pitch beyond this is a fall, degrees"
    )


class Robot(Model):
    """The whole of ``config/robot.yaml``."""

    title: str = Field(description="name of the robot, for tables and captions")
    body: Body = Field(description="mass, inertia and plates")
    legs: Legs = Field(description="legs and the axles they turn on")
    numerics: Numerics = Field(default=Numerics(), description="how a run is stepped and judged")

    @field_validator("body")
    @classmethod
    def _names_differ(cls, body: Body) -> Body:
        seen: dict[str, str] = {}
        for name in body.plates:
            twin = seen.setdefault(name.casefold(), name)
            if twin != name:
                raise ValueError(f"the names {twin!r} and {name!r} differ by case only")
        return body

    @model_validator(mode="after")
    def _hips_on_body(self) -> Robot:
        ends = [end for plate in self.body.plates.values() for end in (plate.from_cm, plate.to_cm)]
        hips = {index: (hip.x_cm, hip.z_cm) for index, hip in enumerate(self.legs.hips)}
        outside = hips_outside(hips, ends)
        if outside:
            first, *more = outside.values()
            raise ValueError(first + (f"; and {len(more)} hips more" if more else ""))
        return self


def hips_outside(
    hips: Mapping[int, tuple[float, float]], ends: Sequence[tuple[float, float]]
) -> dict[int, str]:
    """Find the hips that are not on the body.

    `hips`: x, z (cm) of each, by its number from 0. `ends`: Of the plates, x, z (cm); the body is
    the box around them. Returns what is wrong with each that is outside.
    """
    (left, right), (low, high) = ((min(axis), max(axis)) for axis in zip(*ends, strict=True))
    box = f"x from {left:g} to {right:g} and z from {low:g} to {high:g} cm"
    return {
        index: f"hip {index + 1} at x = {x:g}, z = {z:g} cm lies outside the body, which spans {box}"
        for index, (x, z) in hips.items()
        if not (
            left - _INSIDE_CM <= x <= right + _INSIDE_CM
            and low - _INSIDE_CM <= z <= high + _INSIDE_CM
        )
    }


# --- From ``robot.yaml`` to the checked robot, or to everything that is wrong with the file.


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
    """Robot of the paper: the file ``config/robot.yaml`` that comes with the program."""
    return read_robot(paper_robot_path())


def paper_robot_path() -> Path:
    """Where the robot of the paper stands: in a clone, or beside the installed package."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "_workflow" / "config" / "robot.yaml"
    return installed if installed.is_file() else package.parents[1] / "config" / "robot.yaml"


def read_robot(path: Path, name: str = "") -> Robot:
    """Read and check a robot.

    `name`: What messages call it; default: the path.
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


# --- JSON schema of a robot's file, for editors that check while one types.


def json_schema() -> str:
    """Write the schema of ``robot.yaml``.

    Returns the same bytes whenever the models are the same.
    """
    page = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Robot.model_json_schema()}
    return json.dumps(page, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


def main(folder: Path) -> None:
    """Write the schema.

    `folder`: Usually ``config``.
    """
    write_text(folder / "robot.schema.json", json_schema())


if __name__ == "__main__":
    try:
        main(Path("config"))
    except RftfitError as error:
        sys.exit(str(error))
