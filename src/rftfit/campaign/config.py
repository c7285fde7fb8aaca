"""The models behind ``config/config.yaml``: one source for validation, schema and documentation."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Channel = Annotated[str, Field(pattern=r"^[+-]F[123]$")]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64)]
LengthUnit = Literal["mm", "cm", "m", "in"]
ForceUnit = Literal["N", "mN", "kN", "lbf"]


class Model(BaseModel):
    """A section of the configuration: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Axes(Model):
    """Which signed sensor channel lies along each axis of the mount."""

    x: Channel = Field(description="channel along mount x, for example -F2")
    y: Channel = Field(description="channel along mount y")
    z: Channel = Field(description="channel along mount z; a push from below must come out positive")

    @model_validator(mode="after")
    def _each_channel_once(self) -> Axes:
        used = [self.x[1:], self.y[1:], self.z[1:]]
        if len(set(used)) < 3:
            raise ValueError(f"each of F1, F2, F3 must be used once, found {', '.join(used)}")
        return self


class Transducer(Model):
    """The force sensor and how it is mounted."""

    name: str = Field(description="make and model, for the report")
    force_unit: ForceUnit = Field("N", description="unit of the force columns of the logs")
    range_N: tuple[Positive, Positive, Positive] = Field(
        description="largest force that channels F1, F2, F3 can measure, N"
    )
    precision_N: Positive = Field(0.05, description="standard deviation of one sample, N")
    axes: Axes
    turn_deg: float = Field(
        0.0, ge=-180, le=180, description="turn of the mount about y, from z toward x, degrees"
    )
    max_drift_N: Positive = Field(
        0.2, description="a run whose force zero moves by more than this is flagged, N"
    )


class Arm(Model):
    """The robot arm that moves the intruder."""

    position_unit: LengthUnit = Field("mm", description="unit of the position columns")
    surface_z_mm: float = Field(0.0, description="arm z of the free surface unless the sheet says, mm")
    speed_cm_per_s: Positive = Field(1.0, description="speed along the stroke, cm/s")
    leg_speed_rad_per_s: Positive = Field(0.2, description="speed of a leg's rotation, rad/s")
    angle_tolerance_deg: Positive = Field(
        2.0, description="largest difference between sheet and log, of beta and of the path, degrees"
    )


class Clock(Model):
    """How the clocks of the force log and of the motion log are brought together."""

    method: Literal["sync_line", "same_clock"] = Field(
        "sync_line",
        description="sync_line: the force log records when the arm moves; same_clock: one clock",
    )
    max_residual_s: Positive = Field(
        0.05, description="a run whose edges agree no better than this is refused, s"
    )
    max_gap_s: Positive = Field(0.1, description="a longer step between samples is a gap, s")


class Container(Model):
    """The box that holds the medium; x = 0 at its middle."""

    length_cm: Positive = Field(description="inner size along x, cm")
    width_cm: Positive = Field(description="inner size across, cm")
    depth_cm: Positive = Field(description="depth of the medium, cm")


class Plate(Model):
    """A flat plate; its length lies in the x-z plane."""

    shape: Literal["plate"]
    length_cm: Positive
    width_cm: Positive
    thickness_cm: Positive

    @property
    def area_cm2(self) -> float:
        """Area of one face, cm^2."""
        return self.length_cm * self.width_cm


class Leg(Model):
    """A thin leg turned about an axle above the surface."""

    shape: Literal["leg"]
    curvature_times_R: float = Field(
        ge=-1, le=1, description="R/r: 1 c-leg, 0 flat, -1 reversed c-leg (2R is the maximal length)"
    )
    max_length_cm: Positive
    width_cm: Positive
    thickness_cm: Positive
    hip_height_cm: float


Intruder = Annotated[Plate | Leg, Field(discriminator="shape")]


class Fit(Model):
    """Which part of a stroke is fitted, and how intervals are made."""

    wall_clearance_cm: NotNegative = Field(
        6.0, description="distance that the plate keeps from walls and bottom in the window, cm"
    )
    submergence_cm: float | None = Field(
        None, description="smallest depth of the window, cm; default: the plate wholly submerged"
    )
    max_depth_cm: Positive | None = Field(
        None, description="largest depth of the window, cm; default: from the container"
    )
    horizontal_depths_cm: tuple[Positive, ...] = Field(
        (2.54, 5.08, 7.62), description="depths of the horizontal runs, cm"
    )
    horizontal_skip_cm: NotNegative = Field(
        2.0, description="start-up length left out of a horizontal run, cm"
    )
    air_clearance_cm: Positive = Field(
        0.5, description="how far the whole intruder must be above the surface to count as in air, cm"
    )
    min_points: int = Field(30, ge=3, description="fewer samples in the window give no alpha")
    confidence: float = Field(0.95, gt=0.5, lt=1, description="level of all intervals")


class Fourier(Model):
    """The nine-term fit."""

    method: Literal["lsq", "dft-index"] = Field(
        "lsq", description="the fit that zeta and chi of new media are taken from"
    )
    threshold: NotNegative = Field(0.05, description="a term is kept above this fraction of A00")
    draws: int = Field(2000, ge=200, description="bootstrap draws for the intervals")
    seed: int = Field(2013, ge=0)


class Medium(Model):
    """One granular medium."""

    title: str = Field(description="name in tables and figures")
    role: Literal["laboratory", "natural_sand"] = Field(
        "laboratory", description="laboratory: measured over the grid; natural_sand: one penetration"
    )
    compaction: str = ""
    note: str = ""
    published_as: str | None = Field(
        None, description="key of this medium in the published tables, for comparison"
    )
    linear_to_cm: Positive | None = Field(
        None, description="end of the linear regime of a penetration test, cm"
    )


class Config(Model):
    """The whole of ``config/config.yaml``."""

    title: str = Field(description="name of the campaign, for the report")
    raw: str = Field(description="folder of the logs, relative to the campaign's folder")
    run_sheet: str = Field(description="csv, tsv or xlsx, relative to the campaign's folder")
    dialect: Name = Field("rig", description="log dialect, see rftfit inspect --help")
    transducer: Transducer
    arm: Arm = Arm()
    clock: Clock = Clock()
    container: Container
    intruders: dict[Name, Intruder] = Field(min_length=1)
    media: dict[Name, Medium] = Field(min_length=1)
    fit: Fit = Fit()
    fourier: Fourier = Fourier()

    @model_validator(mode="after")
    def _names_differ(self) -> Config:
        for kind in ("intruders", "media"):
            names: dict[str, str] = {}
            for name in getattr(self, kind):
                twin = names.setdefault(name.casefold(), name)
                if twin != name:
                    raise ValueError(f"{kind} {twin!r} and {name!r} differ by case only")
        return self
