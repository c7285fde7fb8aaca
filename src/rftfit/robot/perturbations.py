"""What the paper does not say of the robot: where the hips are, and the belly."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rftfit.robot.config import Robot

if TYPE_CHECKING:
    from collections.abc import Callable


def _hips_apart(data: dict[str, Any], change: float) -> None:
    hips = data["legs"]["hips"]
    middle = sum(hip["x_cm"] for hip in hips) / len(hips)
    reach = max(abs(hip["x_cm"] - middle) for hip in hips)
    for hip in hips:
        hip["x_cm"] = middle + (hip["x_cm"] - middle) * ((reach + change) / reach if reach else 1)


def _hips_ahead(data: dict[str, Any], change: float) -> None:
    for hip in data["legs"]["hips"]:
        hip["x_cm"] += change


def _hips_up(data: dict[str, Any], change: float) -> None:
    for hip in data["legs"]["hips"]:
        hip["z_cm"] += change


def _ends_up(data: dict[str, Any], change: float, which: Callable[[list[float]], float]) -> None:
    ends = [
        (plate, end) for plate in data["body"]["plates"].values() for end in ("from_cm", "to_cm")
    ]
    level = which([plate[end][1] for plate, end in ends])
    for plate, end in ends:
        x, z = plate[end]
        if abs(z - level) < 1e-9:
            plate[end] = (x, z + change)


def _belly_up(data: dict[str, Any], change: float) -> None:
    _ends_up(data, change, min)


def _plates_taller(data: dict[str, Any], change: float) -> None:
    _ends_up(data, change, max)


def _centre_of_mass_up(data: dict[str, Any], change: float) -> None:
    _hips_up(data, -change)
    for plate in data["body"]["plates"].values():
        for end in ("from_cm", "to_cm"):
            plate[end] = (plate[end][0], plate[end][1] - change)


def _plates_wider(data: dict[str, Any], change: float) -> None:
    for plate in data["body"]["plates"].values():
        plate["width_cm"] += change


UNKNOWNS: dict[str, Callable[[dict[str, Any], float], None]] = {
    "hips_apart_cm": _hips_apart,
    "hips_ahead_cm": _hips_ahead,
    "hips_up_cm": _hips_up,
    "belly_up_cm": _belly_up,
    "centre_of_mass_up_cm": _centre_of_mass_up,
    "plates_wider_cm": _plates_wider,
    "plates_taller_cm": _plates_taller,
}
"""What can be moved: the outermost hips away from the middle one; all hips forward; all hips up;
the belly (lowest ends of all plates) up against hips and centre of mass; the centre of mass up against
both; all plates wider; the highest ends of all plates up."""


def changed(robot: Robot, changes: dict[str, float]) -> Robot:
    """Change some of what is unknown of a robot.

    `changes`: Of `UNKNOWNS`, cm.
    """
    data = robot.model_dump()
    for name, change in changes.items():
        UNKNOWNS[name](data, change)
    try:
        return Robot.model_validate(data)
    except ValidationError as error:
        texts = [str(detail["msg"]) for detail in error.errors(include_url=False)]
        raise ValueError("; ".join(texts).replace("Value error, ", "")) from error
