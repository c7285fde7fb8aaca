"""Keys of a ``profile.json``: the one definition from which its checks, its schema and its page are made."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from rftfit.campaign.config import Model, NotNegative, Positive
from rftfit.campaign.files import unshowable
from rftfit.campaign.schema import json_schema
from rftfit.conventions import QUASI_STATIC_CM_PER_S
from rftfit.errors import RftfitError
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.model.profiles import EPS
from rftfit.reference import CITATION
from rftfit.store import write_text

FORMAT: Literal["rftfit-profile"] = "rftfit-profile"
VERSION: Literal[3] = 3


def _refuse_control_characters(text: str) -> str:
    """Return a text that can be shown; raise ValueError for others."""
    if unshowable(text):
        raise ValueError("text without control characters")
    return text


# types of keys: words, a finite number, an angle in degrees, columns of angles or of numbers (None: not known), and
# rows of draws
Text = Annotated[str, Field(max_length=20_000), AfterValidator(_refuse_control_characters)]
Number = Annotated[float, Field(ge=-1e6, le=1e6)]
# fail_fast: a message names only the first wrong entry of a list
Angle = Annotated[float, Field(ge=-360, le=360)]
Angles = Annotated[list[Angle], Field(max_length=10_000, fail_fast=True)]
MaybeColumn = Annotated[list[Number | None], Field(max_length=10_000, fail_fast=True)]
Rows = Annotated[list[MaybeColumn], Field(min_length=2, max_length=10_000, fail_fast=True)]


class About(Model):
    """The medium, in words."""

    name: Text = ""
    """of the medium"""
    title: Text = ""
    """for figures and tables"""
    notes: Text = ""
    """whatever a user of the file has to know"""


class Conventions(Model):
    """Axes, signs and angles, in words; the golden value says the same in numbers."""

    axes: Text = "x is horizontal, z is up, z = 0 is the flat free surface"
    """the frame"""
    force: Text = (
        "of the medium on the body; alpha_z > 0 is up, alpha_x > 0 is toward +x; an element of area "
        "dA at depth |z| feels dF_z = alpha_z |z| dA and dF_x = alpha_x |z| dA, above the surface nothing"
    )
    """what alpha is, and its signs"""
    beta: Text = (
        "attack angle of a plate element, whose tangent is (cos beta, -sin beta) in (x, z); 0 is level; "
        "period 180 degrees"
    )
    """the first angle"""
    gamma: Text = (
        "intrusion angle of its motion, whose direction is (-cos gamma, -sin gamma) in (x, z); 90 is "
        "straight down, -90 straight up, 0 toward -x, 180 toward +x; period 360 degrees"
    )
    """the second angle"""
    symmetry: Text = (
        "alpha_z(beta, gamma) = alpha_z(-beta, 180 - gamma), alpha_x(beta, gamma) = -alpha_x(-beta, "
        "180 - gamma): each direction is listed once, its mirror image follows"
    )
    """what alpha obeys"""
    interpolation: Text = (
        "with their mirror images the directions are a whole grid, which the periods close: bilinear in beta and "
        "gamma between its lines; where a node with a weight above 0 is null, alpha is not known"
    )
    """how alpha follows from the directions"""


class Units(Model):
    """Units of the numbers."""

    angle: Text = "degrees"
    """of beta and gamma"""
    alpha: Text = "N/cm^3"
    """of alpha and its errors: stress in N/cm^2 per cm"""
    length: Text = "cm"
    """of depths"""


class Golden(Model):
    """One direction between the lines, to test one's own evaluation and its signs against."""

    beta_deg: Angle
    """degrees"""
    gamma_deg: Angle
    """degrees"""
    alpha_z_N_per_cm3: float
    """interpolated"""
    alpha_x_N_per_cm3: float
    """interpolated"""


class Validity(Model):
    """Where the profile holds."""

    depth_from_cm: NotNegative | None = None
    """least depth behind alpha; null: not known"""
    depth_to_cm: NotNegative | None = None
    """greatest depth behind alpha; null: not known"""
    speed_to_cm_per_s: Positive = QUASI_STATIC_CM_PER_S
    """up to here granular forces hardly depend on it"""
    media: Text = (
        "dry granular media with a flat surface, grains much smaller than the body, far from walls"
    )
    """what the model is for"""
    without_number: Text = ""
    """why alpha is null somewhere"""
    marks: Text = ""
    """physical checks that the medium fails"""


class Directions(Model):
    """Alpha over all directions: each is listed once, its mirror image is not."""

    beta_deg: Angles
    """attack angle, degrees; with mirror images the lines of a grid, -90 or 90 among them"""
    gamma_deg: Angles
    """intrusion angle, degrees; -180 or 180 is one of the lines, or 0"""
    alpha_z_N_per_cm3: MaybeColumn
    """N/cm^3, up positive; null: not known"""
    alpha_x_N_per_cm3: MaybeColumn
    """N/cm^3, toward +x positive; null: not known"""


class ProfileErrors(Model):
    """Errors of alpha: draws of it within its errors, whose quantiles are intervals of all that follows."""

    draws_z_N_per_cm3: Rows
    """of alpha_z in each direction, N/cm^3, one row a draw; null: not known"""
    draws_x_N_per_cm3: Rows
    """of alpha_x in each direction, N/cm^3, one row a draw; null: not known"""


class ForceErrors(Model):
    """What a measured force has beside the errors of alpha."""

    model_error: NotNegative | None = EPS
    """relative error of the force model itself, over the load without cancellation; null: not known"""
    bed_spread: NotNegative = USUAL_BED_SPREAD
    """relative standard deviation of forces from one prepared bed to the next"""


class Made(Model):
    """Pushes behind the profile, an entry a direction: with more of them the map is made again."""

    beta_deg: Angles
    """attack angle of each push, degrees"""
    gamma_deg: Angles
    """intrusion angle, degrees"""
    alpha_z_N_per_cm3: MaybeColumn
    """as measured, N/cm^3; null: not measured"""
    alpha_x_N_per_cm3: MaybeColumn
    """as measured, N/cm^3; null: not measured"""
    se_z: MaybeColumn
    """standard error of alpha_z, N/cm^3; null: not known"""
    se_x: MaybeColumn
    """standard error of alpha_x, N/cm^3; null: not known"""


class ProfileOrigin(Model):
    """What the profile was made from."""

    program: Text = ""
    """that wrote the file, and its version"""
    profile: Text = ""
    """what the profile is"""
    kind: Literal["table", "map"]
    """table: measured; map: estimated from pushes"""
    pushes: int | None = None
    """number of pushes behind a map"""
    known_media: Text = ""
    """media whose shape a map has"""
    belongs: float | None = None
    """how often a medium of that shape has pushes as far from it as these"""
    made_from: dict[Text, Text] = Field(default={})
    """SHA-256 of files behind it"""
    citation: Text = CITATION
    """of the model"""


class ProfileFile(Model):
    """The whole of ``profile.json``."""

    format: Literal["rftfit-profile"]
    """what this file is"""
    version: Literal[3]
    """of the format"""
    medium: About = Field(default_factory=About)
    """the medium"""
    conventions: Conventions = Field(default_factory=Conventions)
    """axes, signs and angles in words"""
    units: Units = Field(default_factory=Units)
    """units of the numbers"""
    golden: Golden
    """a value to test one's own signs against"""
    validity: Validity = Field(default_factory=Validity)
    """where the profile holds"""
    directions: Directions
    """alpha over all directions"""
    errors: ProfileErrors | None = None
    """errors of alpha; null: not known"""
    force_errors: ForceErrors = Field(default_factory=ForceErrors)
    """what a measured force has beside the errors of alpha"""
    pushes: Made | None = None
    """what was measured; null: just the directions that have a number"""
    origin: ProfileOrigin
    """what it was made from"""
    digest: Text = ""
    """of all but the medium's texts, as this program makes it; empty: not checked"""


def main(folder: Path) -> None:
    """Write the JSON schema of the file, usually into ``examples/profile``."""
    write_text(folder / "profile.schema.json", json_schema(ProfileFile))


if __name__ == "__main__":
    try:
        main(Path("examples/profile"))
    except RftfitError as error:
        sys.exit(str(error))
