"""What is pushed through a medium: plates of any outline, and legs."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from rftfit.campaign.model import Model, Positive


class Plate(Model):
    """A flat plate; its length lies in the x-z plane."""

    shape: Literal["plate"] = Field(description="a flat plate")
    length_cm: Positive = Field(description="side that lies in the x-z plane, cm")
    width_cm: Positive = Field(description="side across, along y, cm")
    thickness_cm: Positive = Field(description="thickness, cm")

    @property
    def area_cm2(self) -> float:
        """Area of one face, cm^2."""
        return self.length_cm * self.width_cm


class Leg(Model):
    """A thin leg turned about an axle above the surface."""

    shape: Literal["leg"] = Field(description="a thin leg turned about an axle")
    curvature_times_R: float = Field(
        ge=-1,
        le=1,
        description="R/r: 1 c-leg, 0 flat, -1 reversed c-leg (2R is the maximal length)",
    )
    max_length_cm: Positive = Field(description="largest distance from axle to tip, 2R, cm")
    width_cm: Positive = Field(description="side along the axle, cm")
    thickness_cm: Positive = Field(description="thickness, cm")
    hip_height_cm: float = Field(description="height of the axle above the free surface, cm")


class Disc(Model):
    """A flat circular plate."""

    shape: Literal["disc"] = Field(description="a flat circular plate")
    diameter_cm: Positive = Field(description="diameter, cm")
    thickness_cm: Positive = Field(description="thickness, cm")

    @property
    def area_cm2(self) -> float:
        """Area of one face, cm^2."""
        return math.pi * self.diameter_cm**2 / 4

    @property
    def length_cm(self) -> float:
        """Extent in the x-z plane, cm."""
        return self.diameter_cm


class FlatOutline(Model):
    """A flat plate of any other outline."""

    shape: Literal["flat"] = Field(description="a flat plate of any outline")
    area_cm2: Positive = Field(description="area of one face, cm^2")
    length_cm: Positive = Field(description="extent in the x-z plane, cm")
    thickness_cm: Positive = Field(description="thickness, cm")


AnyPlate = Plate | Disc | FlatOutline
PLATE_SHAPES = ("plate", "disc", "flat")
Intruder = Annotated[Plate | Disc | FlatOutline | Leg, Field(discriminator="shape")]
