"""The file of any robot, ``config/robot.yaml``: mass, plates, legs, hips, time step; its model, reader and checks.

`Robot` is the whole file; the classes before it are its sections. Points are x (forward), z (up) in cm from the centre
of mass. `read_robot` reads a file and reports all its problems at once; `paper_robot` is the robot of the paper.
"""

from __future__ import annotations

import contextlib
import math
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from rftfit.campaign.config import Model, Name, NotNegative, Number, Positive, Share
from rftfit.campaign.problems import CampaignError
from rftfit.campaign.reading import read_model
from rftfit.campaign.schema import json_schema
from rftfit.errors import RftfitError
from rftfit.store import write_text
from rftfit.store.environment import shipped

Point = Annotated[tuple[Number, Number], Field(strict=False)]
"""x, z from the centre of mass, cm; two finite numbers."""


class BodyPlate(Model):
    """A thin straight plate of the body: a line in the plane of motion, and as wide as `width_cm` across this plane."""

    from_cm: Point
    """one end: x, z from the centre of mass, cm"""
    to_cm: Point
    """the other end: x, z from the centre of mass, cm"""
    width_cm: Positive
    """across the plane, cm"""

    @model_validator(mode="after")
    def _has_length(self) -> BodyPlate:
        if self.from_cm == self.to_cm:
            raise ValueError("the two ends of a plate must differ")
        return self


class RobotBody(Model):
    """The rigid body; the origin of its frame is its centre of mass, x forward, z up."""

    mass_g: Annotated[float, Field(gt=0, le=1e9)]
    """mass of the whole robot, g"""
    inertia_g_cm2: Annotated[float, Field(gt=0, le=1e15)]
    """moment of inertia in pitch, g cm^2"""
    plates: dict[Name, BodyPlate] = Field(min_length=1)
    """plates that may touch the medium, by name"""


class Hip(Model):
    """An axle with its leg; legs with the same phase move together (a tripod of the six-legged robot)."""

    x_cm: Number
    """ahead of the centre of mass, cm"""
    z_cm: Number
    """above the centre of mass, cm"""
    phase_turns: float = Field(ge=0, lt=1)
    """how far ahead of a leg of phase 0 this leg is turned, in turns, from 0 to below 1"""


class Legs(Model):
    """The legs: equal arcs of a circle through hip and tip, without mass; their curvature is chosen for each run."""

    max_length_cm: Positive
    """2R', the straight distance from hip to tip, cm; for a half circle R' is its radius"""
    width_cm: Positive
    """along the axle, cm"""
    hips: tuple[Hip, ...] = Field(strict=False, min_length=1)
    """one entry for each leg: x_cm, z_cm, phase_turns"""


class Numerics(Model):
    """How a run is stepped in time, and from when on its speed counts as steady."""

    method: Literal["semi_implicit_euler", "rk4"] = "semi_implicit_euler"
    """explicit, of fixed step; rk4: Runge-Kutta of fourth order"""
    step_s: float = Field(default=1e-4, gt=0, le=0.01)
    """longest step; a stride is a whole number of them"""
    elements: int = Field(default=30, ge=1, le=1000)
    """straight pieces into which each plate and each leg is cut; each piece bears one force"""
    gravity_cm_per_s2: NotNegative = 980.665
    """acceleration of gravity, cm/s^2"""
    drop_cm: Number = 0.0
    """height of the robot's lowest point above the surface at the start"""
    stretch_s: NotNegative = 0.6
    """shortest stretch of whole strides whose mean speed is judged, s"""
    most_stretches: int = Field(default=16, ge=4, le=1000)
    """longest run, in such stretches"""
    settled_share: Share = 0.005
    """settled: two stretches differ at most by this share of the later one's speed"""
    settled_cm_per_s: Positive = 0.05
    """or differ at most by this in speed, cm/s: a share of a speed near 0 would never be reached"""
    steady_share: Share = 0.05
    """irregular, yet steady: the second and last third of a longest run differ at most by this share in mean speed"""
    tipped_deg: float = Field(default=90.0, gt=0, le=180)
    """a pitch beyond this, in either sense, is a fall, degrees"""


class Robot(Model):
    """The whole of ``config/robot.yaml``."""

    title: str
    """name of the robot, for tables and captions"""
    body: RobotBody
    """mass, inertia and plates"""
    legs: Legs
    """legs and the axles they turn on"""
    numerics: Numerics = Numerics()
    """how a run is stepped and judged"""

    @field_validator("body")
    @classmethod
    def _names_differ(cls, body: RobotBody) -> RobotBody:
        """Refuse two plates whose names differ only in upper and lower case: they become names of columns."""
        first_names: dict[str, str] = {}
        for name in body.plates:
            earlier_name = first_names.setdefault(name.casefold(), name)
            if earlier_name != name:
                raise ValueError(f"the names {earlier_name!r} and {name!r} differ by case only")
        return body

    @model_validator(mode="after")
    def _hips_on_body(self) -> Robot:
        """Refuse hips outside the body, which are most often a slip of sign or unit (`_hips_outside`)."""
        if outside := _hips_outside(self.model_dump()):
            raise ValueError("; ".join(outside.values()))
        return self


def paper_robot() -> Robot:
    """Read the robot of the paper, the file ``config/robot.yaml`` that comes with the program."""
    return read_robot(paper_robot_path())


def paper_robot_path() -> Path:
    """Return the path of the file of the paper's robot, in a clone or beside the installed package."""
    return shipped("config/robot.yaml")


def read_robot(path: Path, name: str = "") -> Robot:
    """Read and check the file of a robot (yaml); `name`: name of the file in messages, by default its path.

    Raises CampaignError with all problems of the file, ordered by line.
    """
    file = read_model(path, Robot, name)
    if file.model is None:
        # the schema reports a hip outside the body only if all else is valid: hips are checked here in any case
        outside = _hips_outside(file.data)
        if outside:
            # without the schema's own report on hips, a problem of the whole file: it has no key
            file.problems = [problem for problem in file.problems if problem.place.key]
        for index, fault in outside.items():
            file.note(("legs", "hips", index), "inconsistent", None, fault)
        raise CampaignError(sorted(file.problems, key=lambda problem: problem.place.line or 0))
    return file.model


def _hips_outside(data: Any) -> dict[int, str]:
    """Return a message for each hip outside the box around the ends of all plates, by its index from 0.

    `data`: content of the file as nested dicts and lists. It may be invalid: a hip that cannot be read gives no
    message, nor does any hip if the plates cannot be read, since the schema reports these faults.
    """
    try:
        plates = data["body"]["plates"].values()
        ends = [_point(plate[key]) for plate in plates for key in ("from_cm", "to_cm")]
        # sides of the box around all ends, cm: `zip` turns the points into all x and all z
        (left, right), (low, high) = ((min(axis), max(axis)) for axis in zip(*ends, strict=True))
        hips = [*data["legs"]["hips"]]
    except (AttributeError, KeyError, TypeError, ValueError):
        return {}
    box = f"x from {left:g} to {right:g} and z from {low:g} to {high:g} cm"
    outside = {}
    for index, hip in enumerate(hips):
        with contextlib.suppress(KeyError, TypeError, ValueError):
            x, z = _point((hip["x_cm"], hip["z_cm"]))
            rounding_cm = 1e-9
            if max(left - x, x - right, low - z, z - high) > rounding_cm:
                outside[index] = (
                    f"hip {index + 1} at x = {x:g}, z = {z:g} cm lies outside the body, which spans {box}"
                )
    return outside


def _point(value: Any) -> tuple[float, float]:
    """Return x and z of a point in the file; raise an error if these are not two finite numbers."""
    x, z = value
    if not all(
        isinstance(coordinate, int | float) and math.isfinite(coordinate) for coordinate in (x, z)
    ):
        raise ValueError("no numbers")
    return float(x), float(z)


def main(folder: Path) -> None:
    """Write the JSON schema of a robot's file into a folder, usually ``config``."""
    write_text(folder / "robot.schema.json", json_schema(Robot))


if __name__ == "__main__":
    try:
        main(Path("config"))
    except RftfitError as error:
        sys.exit(str(error))
