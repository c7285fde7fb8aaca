"""The models behind ``config/config.yaml``: one source for validation, schema and documentation."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import Field, ValidationInfo, field_validator, model_validator

from rftfit.campaign.clocks import Clock, FreeSurface, RigidContact
from rftfit.campaign.model import Model, Name, NotNegative, Positive
from rftfit.campaign.names import DEVICE, is_device
from rftfit.campaign.shapes import (
    PLATE_SHAPES,
    AnyPlate,
    Disc,
    FlatOutline,
    Intruder,
    Leg,
    Plate,
)
from rftfit.campaign.sources import ForceLog, MotionLog

__all__ = ["PLATE_SHAPES", "AnyPlate", "Config", "Disc", "FlatOutline", "Leg", "Model", "Plate"]

Channel = Annotated[str, Field(pattern=r"^[+-]F[123]$")]
T = TypeVar("T")
LengthUnit = Literal["mm", "cm", "m", "in"]
ForceUnit = Literal["N", "mN", "kN", "lbf"]


class Axes(Model):
    """Which signed sensor channel lies along each axis of the mount."""

    x: Channel = Field(description="channel along mount x, for example -F2")
    y: Channel = Field(description="channel along mount y")
    z: Channel = Field(
        description="channel along mount z; a push from below must come out positive"
    )

    @model_validator(mode="after")
    def _each_channel_once(self) -> Axes:
        used = [self.x[1:], self.y[1:], self.z[1:]]
        if len(set(used)) < 3:
            raise ValueError(f"each of F1, F2, F3 must be used once, found {', '.join(used)}")
        return self


class Transducer(Model):
    """The force sensor and how it is mounted."""

    name: str = Field(description="make and model, for the report")
    force_unit: ForceUnit = Field(default="N", description="unit of the force columns of the logs")
    range_N: tuple[Positive, Positive, Positive] = Field(
        strict=False,  # YAML knows lists only; the numbers inside stay strict
        description="largest force that channels F1, F2, F3 can measure, N",
    )
    precision_N: Positive = Field(default=0.05, description="standard deviation of one sample, N")
    axes: Axes = Field(description="which signed sensor channel lies along each axis of the mount")
    turn_deg: float = Field(
        default=0.0,
        ge=-180,
        le=180,
        description="turn of the mount about y, from z toward x, degrees",
    )
    drift_N_per_min: NotNegative = Field(
        default=0.02,
        description="largest drift of the zero within a run, N/min; enters the intervals",
    )
    max_drift_N: Positive = Field(
        default=0.2, description="a run whose force zero moves by more than this is flagged, N"
    )
    repeats: Literal["keep", "drop"] = Field(
        default="keep",
        description="drop: rows in which all channels repeat the row before are the last reading of "
        "a transducer slower than its logger, and are left out",
    )


class Arm(Model):
    """The robot arm that moves the intruder."""

    position_unit: LengthUnit = Field(default="mm", description="unit of the position columns")
    surface_z_mm: float = Field(
        default=0.0, description="arm z of the free surface unless the sheet says, mm"
    )
    speed_cm_per_s: Positive = Field(default=1.0, description="speed along the stroke, cm/s")
    leg_speed_rad_per_s: Positive = Field(
        default=0.2, description="speed of a leg's rotation, rad/s"
    )
    angle_tolerance_deg: Positive = Field(
        default=2.0,
        description="largest difference between sheet and log, of beta and of the path, degrees",
    )
    drive: Literal["steady", "uneven"] = Field(
        default="steady",
        description="uneven: the speed varies within a stroke, as by hand; a straight push down is "
        "then all the way from the surface to the deepest point",
    )


class Container(Model):
    """The box that holds the medium; x = 0 at its middle."""

    length_cm: Positive = Field(description="inner size along x, cm")
    width_cm: Positive = Field(description="inner size across, cm")
    depth_cm: Positive = Field(description="depth of the medium, cm")


class Fit(Model):
    """Which part of a stroke is fitted, and how intervals are made."""

    wall_clearance_cm: NotNegative = Field(
        default=6.0,
        description="distance that the plate keeps from walls and bottom in the window, cm",
    )
    submergence_cm: float | None = Field(
        default=None,
        description="smallest depth of the window, cm; default: the plate wholly submerged",
    )
    max_depth_cm: Positive | None = Field(
        default=None, description="largest depth of the window, cm; default: from the container"
    )
    horizontal_depths_cm: tuple[Positive, ...] = Field(
        default=(2.54, 5.08, 7.62),
        strict=False,
        min_length=1,
        description="depths of the horizontal runs, cm",
    )
    horizontal_skip_cm: NotNegative = Field(
        default=2.0, description="start-up length left out of a horizontal run, cm"
    )
    extraction_skip_cm: NotNegative = Field(
        default=0.1,
        description="length left out where an extraction starts, before its force has built up, cm",
    )
    air_clearance_cm: Positive = Field(
        default=0.5,
        description="how far the whole intruder must be above the surface to count as in air, cm",
    )
    min_points: int = Field(
        default=30, ge=3, description="fewer samples in the window give no alpha"
    )
    confidence: float = Field(default=0.95, gt=0.5, lt=1, description="level of all intervals")
    run_to_run_N_per_cm3: NotNegative | None = Field(
        default=None,
        description="standard deviation of alpha from one prepared bed to the next, N/cm^3, used "
        "where the run sheet has too few repeats to show it; default: not known, intervals are "
        "those of one bed as prepared",
    )
    missing_tare: Literal["refuse", "flag"] = Field(
        default="refuse",
        description="flag: a run for which the sheet names no tare_run is used as it is, with the "
        "force on rod and mount in it, and says so",
    )


class Fourier(Model):
    """The nine-term fit."""

    method: Literal["lsq", "dft-index"] = Field(
        default="lsq", description="the fit that zeta and chi of new media are taken from"
    )
    threshold: NotNegative = Field(
        default=0.05, description="a term is kept above this fraction of A00"
    )
    draws: int = Field(
        default=2000, ge=200, le=1_000_000, description="bootstrap draws for the intervals"
    )
    seed: int = Field(
        default=2013, ge=0, description="seed of the bootstrap: same seed, same intervals"
    )


class Figures(Model):
    """What the figures show."""

    stress_runs: tuple[str, ...] = Field(
        default=(),
        description="runs in the stress figure; default: the flat plate, down and up, of the first medium",
    )


class Medium(Model):
    """One granular medium."""

    title: str = Field(description="name in tables and figures")
    role: Literal["laboratory", "natural_sand"] = Field(
        default="laboratory",
        description="laboratory: measured over the grid; natural_sand: one penetration",
    )
    compaction: str = Field(
        default="", description="how the bed was prepared, for example LP or CP"
    )
    note: str = Field(default="", description="free text")
    published_as: str | None = Field(
        default=None, description="key of this medium in the published tables, for comparison"
    )
    linear_to_cm: Positive | None = Field(
        default=None, description="end of the linear regime of a penetration test, cm"
    )


class RobotRuns(Model):
    """A legged robot that runs on one of the media."""

    medium: Name = Field(description="the medium it runs on: one that was measured over the grid")
    file: str | None = Field(
        default=None,
        description="the robot's own file, relative to the campaign's folder; default: the paper's "
        "robot, config/robot.yaml of the program",
    )
    runs: str | None = Field(
        default=None,
        description="sheet of its marker tracks, relative to the raw folder; default: the speeds of "
        "Fig. 4C where the medium is the paper's loose poppy seeds, else nothing is compared",
    )


class Publication(Model):
    """Who makes the results known; stands in ``results/ro-crate-metadata.json``."""

    date: str = Field(
        default="",
        pattern=r"^([0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01]))?$",
        description="day of publication as yyyy-mm-dd, in quotes; no date of a computer enters any result",
    )
    license: str = Field(
        default="",
        pattern=r"^(https?://\S+)?$",
        description="address of the licence of the results",
    )
    authors: tuple[str, ...] = Field(
        default=(), strict=False, description="names of those who measured and evaluated"
    )


class Config(Model):
    """The whole of ``config/config.yaml``."""

    title: str = Field(description="name of the campaign, for the report")
    raw: str = Field(description="folder of the logs, relative to the campaign's folder")
    run_sheet: str = Field(description="csv, tsv or xlsx, relative to the campaign's folder")
    dialect: Name = Field(default="rig", description="log dialect, see rftfit inspect --help")
    force_log: ForceLog = Field(
        default=ForceLog(), description="how force logs are written; for other logs than the rig's"
    )
    motion_log: MotionLog = Field(
        default=MotionLog(), description="how motion logs are written; may be the same file"
    )
    transducer: Transducer = Field(description="the force sensor and how it is mounted")
    arm: Arm = Field(default=Arm(), description="the robot arm that moves the intruder")
    clock: Clock = Field(
        default=Clock(), description="how the clocks of the two logs are brought together"
    )
    surface: FreeSurface = Field(default=FreeSurface(), description="where the free surface lies")
    rigid_contact: RigidContact | None = Field(
        default=None,
        description="a push against something rigid; the yielding of the machine that it shows is "
        "taken off every depth",
    )
    container: Container = Field(description="the box that holds the medium")
    intruders: dict[Name, Intruder] = Field(
        min_length=1, description="plates and legs, by the name that the run sheet uses"
    )
    media: dict[Name, Medium] = Field(
        min_length=1, description="granular media, by the name that the run sheet uses"
    )
    fit: Fit = Field(default=Fit(), description="which part of a stroke is fitted")
    fourier: Fourier = Field(default=Fourier(), description="the nine-term fit")
    figures: Figures = Field(default=Figures(), description="what the figures show")
    publication: Publication = Field(
        default=Publication(), description="who makes the results known, and when"
    )
    robot: RobotRuns | None = Field(
        default=None, description="a legged robot on one of the media; default: no robot"
    )

    @field_validator("robot")
    @classmethod
    def _robot_on_known_medium(
        cls, robot: RobotRuns | None, info: ValidationInfo
    ) -> RobotRuns | None:
        media = info.data.get("media")
        if robot is not None and media is not None:
            grid = [name for name, medium in media.items() if medium.role == "laboratory"]
            if robot.medium not in grid:
                raise ValueError(
                    f"medium: found {robot.medium!r}; allowed: a medium of the role laboratory, "
                    f"one of {', '.join(grid) or 'which there is none'}"
                )
        return robot

    @field_validator("intruders", "media")
    @classmethod
    def _names_differ(cls, section: dict[str, T]) -> dict[str, T]:
        # names become file names, and not every disk tells case apart
        names: dict[str, str] = {}
        for name in section:
            twin = names.setdefault(name.casefold(), name)
            if twin != name:
                raise ValueError(f"the names {twin!r} and {name!r} differ by case only")
            if is_device(name):
                raise ValueError(f"found the name {name!r}; allowed: {DEVICE}")
        return section
