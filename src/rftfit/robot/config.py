"""The model behind ``config/robot.yaml``: any robot in the plane, its gait and the numerics."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator

from rftfit.campaign.model import Model, Name, NotNegative, Positive

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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

    Parameters
    ----------
    hips : mapping of int to (float, float)
        x, z (cm) of each, by its number from 0.
    ends : sequence of (float, float)
        Of the plates, x, z (cm); the body is the box around them.

    Returns
    -------
    dict of int to str
        What is wrong with each that is outside.
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
