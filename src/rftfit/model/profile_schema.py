"""What stands in a ``profile.json``: the one definition behind its checks, its schema and its page."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from rftfit.campaign.config import Model, NotNegative, Positive
from rftfit.campaign.files import unshowable
from rftfit.campaign.schema import json_schema
from rftfit.errors import RftfitError
from rftfit.model.prediction import QUASI_STATIC_CM_PER_S
from rftfit.reference import CITATION
from rftfit.store import write_text

FORMAT: Literal["rftfit-profile"] = "rftfit-profile"


def _plain(text: str) -> str:
    if unshowable(text):
        raise ValueError("text without control characters")
    return text


Text = Annotated[str, Field(max_length=20_000), AfterValidator(_plain)]
Number = Annotated[float, Field(ge=-1e6, le=1e6)]
# of the wrong entries of a table the first is told
_FIRST = Field(fail_fast=True)
Lines = Annotated[list[float], Field(min_length=2, max_length=1000, fail_fast=True)]
Row = Annotated[list[Number], _FIRST]
Rows = Annotated[list[Row], Field(min_length=2, max_length=10_000, fail_fast=True)]
MaybeRow = Annotated[list[Number | None], _FIRST]
Grid = Annotated[list[MaybeRow], _FIRST]


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
    interpolation: Text = (
        "bilinear in beta and gamma between the nodes, which cover all directions: bring beta into "
        "-90 to 90 and gamma into -180 to 180 degrees first; where a node with a weight above 0 is "
        "null, alpha is not known"
    )
    """how alpha follows from the nodes"""
    symmetry: Text = (
        "alpha_z(beta, gamma) = alpha_z(-beta, 180 - gamma), alpha_x(beta, gamma) = -alpha_x(-beta, "
        "180 - gamma); the nodes have it, nothing is left to do"
    )
    """what the nodes obey"""


class Units(Model):
    """Units of the numbers."""

    angle: Text = "degrees"
    """of beta and gamma"""
    alpha: Text = "N/cm^3"
    """of alpha, its errors and the nine terms: stress in N/cm^2 per cm"""
    length: Text = "cm"
    """of depths"""
    zeta: Text = "none: the number of N/cm^3"
    """of zeta"""


class Golden(Model):
    """One direction between the nodes, to test one's own evaluation and its signs against."""

    beta_deg: float
    """degrees"""
    gamma_deg: float
    """degrees"""
    alpha_z_N_per_cm3: float
    """interpolated between the nodes"""
    alpha_x_N_per_cm3: float
    """interpolated between the nodes"""
    nine_terms_z_N_per_cm3: float | None = None
    """alpha_z of the nine terms"""
    nine_terms_x_N_per_cm3: float | None = None
    """alpha_x of the nine terms"""
    se_z_N_per_cm3: float | None = None
    """standard error of alpha_z"""
    se_x_N_per_cm3: float | None = None
    """standard error of alpha_x"""
    covariance_zx: float | None = None
    """of the two errors, (N/cm^3)^2"""


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


class Nodes(Model):
    """Alpha over all directions; rows in the order of beta_deg, columns in that of gamma_deg."""

    beta_deg: Lines
    """lines of the grid, rising from -90 to 90, which are one plate"""
    gamma_deg: Lines
    """lines of the grid, rising from -180 to 180, which are one motion"""
    alpha_z_N_per_cm3: Grid
    """N/cm^3, up positive; null: not known"""
    alpha_x_N_per_cm3: Grid
    """N/cm^3, toward +x positive; null: not known"""
    measured: Annotated[list[Annotated[list[bool], _FIRST]], _FIRST]
    """whether the node, or its mirror image, was measured; else it is estimated or interpolated"""


class Made(Model):
    """Pushes behind the profile, an entry a direction: with more of them the map is made again."""

    beta_deg: list[float]
    """attack angle of each push, degrees"""
    gamma_deg: list[float]
    """intrusion angle, degrees"""
    alpha_z_N_per_cm3: list[float | None]
    """as measured, N/cm^3; null: not measured"""
    alpha_x_N_per_cm3: list[float | None]
    """as measured, N/cm^3; null: not measured"""
    se_z: list[float | None]
    """standard error of alpha_z, N/cm^3; null: not known"""
    se_x: list[float | None]
    """standard error of alpha_x, N/cm^3; null: not known"""


class Errors(Model):
    """Errors of alpha: draws of it within its errors, whose quantiles are intervals of all that follows."""

    cell: Annotated[list[Annotated[list[int | None], _FIRST]], _FIRST]
    """column of the draws, from 0, that belongs to a node; null: its error is not known"""
    sign_x: Annotated[list[Annotated[list[int], _FIRST]], _FIRST]
    """1 or -1, by which draws_x is multiplied at a node"""
    draws_z_N_per_cm3: Rows
    """of alpha_z, N/cm^3, one row a draw"""
    draws_x_N_per_cm3: Rows
    """of alpha_x, N/cm^3, one row a draw"""


class Terms(Model):
    """Nine terms fitted by least squares to what was measured, of a map to its nodes, N/cm^3; 0: below 0.05 A00."""

    A00: float
    """alpha_z: constant"""
    A10: float
    """alpha_z: cos 2 beta"""
    B11: float
    """alpha_z: sin(2 beta + gamma)"""
    B01: float
    """alpha_z: sin gamma"""
    Bm1: float
    """alpha_z: sin(-2 beta + gamma)"""
    C11: float
    """alpha_x: cos(2 beta + gamma)"""
    C01: float
    """alpha_x: cos gamma"""
    Cm1: float
    """alpha_x: cos(-2 beta + gamma)"""
    D10: float
    """alpha_x: sin 2 beta"""


class Zeta(Model):
    """Scaling factor: alpha_z of the nine terms at (0, 90) degrees."""

    value: float
    """the number of N/cm^3"""
    lo: float | None = None
    """lower end of its interval"""
    hi: float | None = None
    """upper end of its interval"""
    confidence: float = Field(default=0.95, gt=0, lt=1)
    """level of the interval"""


class Origin(Model):
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
    version: Literal[2]
    """of the format"""
    medium: About = About()
    """the medium"""
    conventions: Conventions = Conventions()
    """axes, signs and angles in words"""
    units: Units = Units()
    """units of the numbers"""
    golden: Golden
    """a value to test one's own signs against"""
    validity: Validity = Validity()
    """where the profile holds"""
    nodes: Nodes
    """alpha over all directions"""
    errors: Errors | None = None
    """errors of alpha; null: not known"""
    pushes: Made
    """what was measured"""
    nine_terms: Terms | None = None
    """the nine terms; null: there are too few nodes for them"""
    zeta: Zeta | None = None
    """scaling factor"""
    origin: Origin
    """what it was made from"""
    digest: Text = ""
    """of nodes, errors, pushes, nine terms and zeta, as this program makes it; empty: not checked"""


def main(folder: Path) -> None:
    """Write the JSON schema of the file, usually into ``examples/profile``."""
    write_text(folder / "profile.schema.json", json_schema(ProfileFile))


if __name__ == "__main__":
    try:
        main(Path("examples/profile"))
    except RftfitError as error:
        sys.exit(str(error))
