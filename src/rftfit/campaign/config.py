"""The models behind ``config/config.yaml``: one source for validation, schema and documentation."""

from __future__ import annotations

import codecs
import math
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from rftfit.campaign.files import DEVICE, is_device


def key(default: Any, description: str, **limits: Any) -> Any:
    """Declare a key with a default; the description is for messages and pages."""
    return Field(default=default, description=description, **limits)


def need(description: str, **limits: Any) -> Any:
    """Declare a key that must be given."""
    return Field(description=description, **limits)


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64)]


class Model(BaseModel):
    """A section of the configuration: unknown keys are errors, values never change."""

    # strict: "24" in quotes or `yes` is no number, and the user should hear of it
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


# --- How force and motion are brought together: clocks, free surface, and the yielding of the machine.


class Clock(Model):
    """How the clocks of the force log and of the motion log are brought together."""

    method: Literal["sync_line", "same_clock", "estimate"] = key(
        "sync_line",
        "sync_line: the force log records when the arm moves; same_clock: one clock; "
        "estimate: from the force, which grows only where the intruder goes deeper",
    )
    max_residual_s: Positive = key(
        0.05, "a run whose edges agree no better than this is refused, s"
    )
    max_gap_s: Positive = key(
        0.1, "a step between samples longer than this, and than 1.5 usual steps, is a gap, s"
    )
    max_se_s: Positive = key(
        0.1, "a run whose estimated offset has a larger standard error is refused, s"
    )
    max_drift: Positive = key(
        1e-3,
        "how much the rates of the clocks may differ, as a standard deviation, relative; "
        "for estimate",
    )


class FreeSurface(Model):
    """Where the free surface lies."""

    method: Literal["given", "find"] = key(
        "given",
        "given: surface_z_mm of the sheet or the arm; find: where the force begins to "
        "grow, in each push straight down whose row of the sheet gives no surface_z_mm",
    )
    window_cm: Positive = key(1.5, "how far above and below the surface the force is looked at, cm")
    max_se_cm: Positive = key(0.1, "a run whose surface has a larger standard error is refused, cm")


class RigidContact(Model):
    """A push of the bare machine against something rigid: how far it yields under load."""

    force_log: str = need("force log, relative to the raw folder")
    motion_log: str = need("motion log, relative to the raw folder")


# --- What is pushed through a medium: plates of any outline, and legs.


class Plate(Model):
    """A flat plate; its length lies in the x-z plane."""

    shape: Literal["plate"] = need("a flat plate")
    length_cm: Positive = need("side that lies in the x-z plane, cm")
    width_cm: Positive = need("side across, along y, cm")
    thickness_cm: Positive = need("thickness, cm")

    @property
    def area_cm2(self) -> float:
        """Area of one face, cm^2."""
        return self.length_cm * self.width_cm


class Leg(Model):
    """A thin leg turned about an axle above the surface."""

    shape: Literal["leg"] = need("a thin leg turned about an axle")
    curvature_times_R: float = need(
        "R/r: 1 c-leg, 0 flat, -1 reversed c-leg (2R is the maximal length)", ge=-1, le=1
    )
    max_length_cm: Positive = need("largest distance from axle to tip, 2R, cm")
    width_cm: Positive = need("side along the axle, cm")
    thickness_cm: Positive = need("thickness, cm")
    hip_height_cm: float = need("height of the axle above the free surface, cm")


class Disc(Model):
    """A flat circular plate."""

    shape: Literal["disc"] = need("a flat circular plate")
    diameter_cm: Positive = need("diameter, cm")
    thickness_cm: Positive = need("thickness, cm")

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

    shape: Literal["flat"] = need("a flat plate of any outline")
    area_cm2: Positive = need("area of one face, cm^2")
    length_cm: Positive = need("extent in the x-z plane, cm")
    thickness_cm: Positive = need("thickness, cm")


AnyPlate = Plate | Disc | FlatOutline
PLATE_SHAPES = ("plate", "disc", "flat")
Intruder = Annotated[Plate | Disc | FlatOutline | Leg, Field(discriminator="shape")]


# --- How the logs of a campaign are written: dialect, text format, and which column is which quantity.


ForceQuantity = Literal["time", "arm_moving", "F1", "F2", "F3", "T1", "T2", "T3"]
MotionQuantity = Literal["time", "x", "z", "angle"]
QUANTITIES = ("time", "arm_moving", "F1", "F2", "F3", "T1", "T2", "T3", "x", "z", "angle")
"""What a column of a log can be; T1 to T3 are read and not used by the chain."""
Unit = Literal[
    "N", "mN", "kN", "lbf", "klbf", "kgf", "gf", "N m", "N mm", "um", "mm", "cm", "m", "in",
    "deg", "rad", "s", "ms", "us", "ns", "min", "h",
]  # fmt: skip
Q = TypeVar("Q", bound=str)


class TextFormat(Model):
    """Any delimited text, described; the file is then read by the dialect ``delimited``."""

    delimiter: Literal[",", ";", "tab", "blank", "bar"] = key(
        ",",
        "what stands between cells; blank: any number of blanks and tabs; bar: the vertical bar",
    )
    decimal: Literal[".", ","] = key(".", "decimal mark of the numbers")
    skip_lines: int = key(0, "lines in front of the row of names, or of the data", ge=0, le=1000)
    names: bool = key(True, "whether a row of names follows; else columns go by number, from 1")
    units: bool = key(False, "whether a row of units follows that")
    dates: Literal["", "year first", "day first", "month first"] = key(
        "", "order of dates such as 03/04/2026 1:00:36 PM, where the first rows do not show it"
    )
    comment: str = key("", "lines that begin with this are no data, for example #", max_length=8)
    encoding: str = key("", "of the names; default: UTF-8, or else Windows-1252")
    rate_Hz: Positive | None = key(None, "rows a second, where no column holds the time, Hz")

    @field_validator("encoding")
    @classmethod
    def _known(cls, name: str) -> str:
        try:
            codecs.lookup(name or "utf-8")
        except LookupError:
            raise ValueError(
                f"no encoding is called {name!r}; common ones: utf-8, cp1252, latin-1, shift_jis"
            ) from None
        return name


class Column(Model):
    """The column of a quantity."""

    column: str | Annotated[int, Field(ge=1)] | None = key(
        None, "its name as rftfit inspect shows it, or its number, from 1"
    )
    unit: Unit | None = key(None, "its unit; needed where the file states none")
    factor: float = key(
        1.0,
        "multiplied onto the values, for example -1 where down is positive; with `unit`, units of the "
        "quantity for one of a file's own (V, counts)",
    )
    offset: float = key(0.0, "added after that, in `unit`")
    constant: float | None = key(
        None, "value of a quantity that no column holds and that stays the same"
    )
    rate: float | None = key(
        None,
        "change per second of a quantity that no column holds, from `constant` at the first row on: "
        "an actuator of known speed",
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> Column:
        if (self.column is None) == (self.constant is None):
            raise ValueError("needs either a column or a constant")
        if self.rate is not None and self.constant is None:
            raise ValueError("a rate needs a constant: the value at the first row")
        if self.factor == 0:
            raise ValueError("a factor of 0 would erase the column")
        return self


def _short(value: Any) -> Any:
    """Turn a bare name or number into a column."""
    plain = isinstance(value, str | int) and not isinstance(value, bool)
    return {"column": value} if plain else value


Chosen = Annotated[Column, BeforeValidator(_short, json_schema_input_type=Column | str | int)]


class Source(Model, Generic[Q]):
    """How one kind of log is written."""

    dialect: Name | None = key(None, "default: the campaign's; delimited where `text` is given")
    text: TextFormat | None = key(None, "the format, for the dialect delimited")
    options: dict[Name, str | int | float | bool] = key(
        {}, "what the dialect can be told, see its documentation"
    )
    columns: dict[Q, Chosen] = key(
        {}, "quantity: column; default: the columns are named by the quantities"
    )

    @model_validator(mode="after")
    def _text_is_delimited(self) -> Source[Q]:
        if self.text is not None and self.dialect not in (None, "delimited"):
            raise ValueError(f"`text` goes with the dialect delimited, found {self.dialect}")
        if self.text is None and self.dialect == "delimited":
            raise ValueError("the dialect delimited needs `text`, the description of the format")
        return self


class ForceLog(Source[ForceQuantity]):
    """How force logs are written."""

    calibration: str | None = key(
        None,
        "csv inside the raw folder that makes loads of a transducer's gauges: the columns load (F1 to "
        "T3), unit, and one for each gauge by its name in the log; load = sum of value x gauge",
    )


class MotionLog(Source[MotionQuantity]):
    """How motion logs are written."""


AnyLog = ForceLog | MotionLog


# --- The sections of the configuration, and the whole of it.


Channel = Annotated[str, Field(pattern=r"^[+-]F[123]$")]
T = TypeVar("T")
LengthUnit = Literal["mm", "cm", "m", "in"]
ForceUnit = Literal["N", "mN", "kN", "lbf"]


class Axes(Model):
    """Which signed sensor channel lies along each axis of the mount."""

    x: Channel = need("channel along mount x, for example -F2")
    y: Channel = need("channel along mount y")
    z: Channel = need("channel along mount z; a push from below must come out positive")

    @model_validator(mode="after")
    def _each_channel_once(self) -> Axes:
        used = [self.x[1:], self.y[1:], self.z[1:]]
        if len(set(used)) < 3:
            raise ValueError(f"each of F1, F2, F3 must be used once, found {', '.join(used)}")
        return self


class Transducer(Model):
    """The force sensor and how it is mounted."""

    name: str = need("make and model, for the report")
    force_unit: ForceUnit = key("N", "unit of the force columns of the logs")
    range_N: tuple[Positive, Positive, Positive] = need(
        "largest force that channels F1, F2, F3 can measure, N",
        strict=False,  # YAML knows lists only; the numbers inside stay strict
    )
    precision_N: Positive = key(0.05, "standard deviation of one sample, N")
    axes: Axes = need("which signed sensor channel lies along each axis of the mount")
    turn_deg: float = key(
        0.0, "turn of the mount about y, from z toward x, degrees", ge=-180, le=180
    )
    drift_N_per_min: NotNegative = key(
        0.02, "largest drift of the zero within a run, N/min; enters the intervals"
    )
    slow_noise_N: NotNegative = key(
        0.0,
        "how far the zero of a channel moves by itself from the rest in air to the stroke (1/f noise), "
        "standard deviation, N; enters the intervals; default: not beyond what rest and stroke show",
    )
    max_drift_N: Positive = key(0.2, "a run whose force zero moves by more than this is flagged, N")
    repeats: Literal["keep", "drop"] = key(
        "keep",
        "drop: rows in which all channels repeat the row before are the last reading of "
        "a transducer slower than its logger, and are left out",
    )


class Zero(Model):
    """What the transducer reads without load."""

    method: Literal["air", "stated"] = key(
        "air",
        "air: the intruder's rest in air within each log; stated: the readings below, for logs "
        "without such a rest. A `zero_log` of the run sheet goes before both",
    )
    readings_N: tuple[float, float, float] = key(
        (0.0, 0.0, 0.0),
        "what channels F1, F2, F3 read without load, for stated; 0 for logs whose zero was taken off",
        strict=False,
    )
    sd_N: NotNegative | None = key(
        None, "standard error of a stated reading; enters the intervals, so stated needs it"
    )
    log_age_min: NotNegative = key(
        10.0, "longest time between a zero_log and its run: the zero may have drifted by then, min"
    )

    @model_validator(mode="after")
    def _stated_has_an_error(self) -> Zero:
        if self.method == "stated" and self.sd_N is None:
            raise ValueError("method stated needs sd_N: how far the zero may be off, N")
        return self


class Arm(Model):
    """The robot arm that moves the intruder."""

    position_unit: LengthUnit = key("mm", "unit of the position columns")
    surface_z_mm: float = key(0.0, "arm z of the free surface unless the sheet says, mm")
    middle_x_mm: float = key(0.0, "arm x of the middle of the container, mm")
    speed_cm_per_s: Positive = key(1.0, "speed along the stroke, cm/s")
    leg_speed_rad_per_s: Positive = key(0.2, "speed of a leg's rotation, rad/s")
    angle_tolerance_deg: Positive = key(
        2.0, "largest difference between sheet and log, of beta and of the path, degrees"
    )
    drive: Literal["steady", "uneven"] = key(
        "steady",
        "uneven: the speed varies within a stroke, as by hand; a straight push down is "
        "then all the way from the surface to the deepest point",
    )


class Container(Model):
    """The box that holds the medium; its middle along x lies at ``arm.middle_x_mm``."""

    length_cm: Positive = need("inner size along x, cm")
    width_cm: Positive = need("inner size across, cm")
    depth_cm: Positive = need("depth of the medium, cm")


Direction = tuple[float, float]
"""Attack angle beta and intrusion angle gamma of a cell, degrees."""


class Grid(Model):
    """Directions in which a medium of the role laboratory is to be measured."""

    beta_deg: tuple[Annotated[float, Field(ge=-90, le=90)], ...] = key(
        (), "planned attack angles, degrees; each with every gamma_deg is a cell", strict=False
    )
    gamma_deg: tuple[Annotated[float, Field(ge=-90, le=90)], ...] = key(
        (), "planned intrusion angles, degrees, up to the sides negative", strict=False
    )
    angle_tolerance_deg: NotNegative = key(
        0.5, "directions that differ by no more in both angles are one cell, degrees", le=10
    )

    @model_validator(mode="after")
    def _both_or_none(self) -> Grid:
        if bool(self.beta_deg) != bool(self.gamma_deg):
            raise ValueError("needs both beta_deg and gamma_deg, or neither: cells are their pairs")
        return self

    @property
    def planned(self) -> tuple[Direction, ...]:
        """The planned cells, by beta, then gamma; none where the run sheet alone says."""
        return tuple(
            (beta, gamma) for beta in sorted(self.beta_deg) for gamma in sorted(self.gamma_deg)
        )

    def same(self, one: Direction, other: Direction) -> bool:
        """Whether two directions are one cell; plates at -90 and 90 degrees are one and the same."""
        # a little more, so that 0.5 is within 0.5 however it is rounded
        most = self.angle_tolerance_deg + 1e-6
        return abs(one[1] - other[1]) <= most and abs((one[0] - other[0] + 90) % 180 - 90) <= most


Law = Literal["through_zero", "free_intercept", "power"]


class Fit(Model):
    """Which part of a stroke is fitted, and how intervals are made."""

    wall_clearance_cm: NotNegative = key(
        6.0, "distance that the plate keeps from walls and bottom in the window, cm"
    )
    submergence_cm: float | None = key(
        None, "smallest depth of the window, cm; default: the plate wholly submerged"
    )
    max_depth_cm: Positive | None = key(
        None, "largest depth of the window, cm; default: from the container"
    )
    horizontal_depths_cm: tuple[Positive, ...] = key(
        (2.54, 5.08, 7.62), "depths of the horizontal runs, cm", strict=False, min_length=1
    )
    horizontal_skip_cm: NotNegative = key(2.0, "start-up length left out of a horizontal run, cm")
    extraction_skip_cm: NotNegative = key(
        0.1, "length left out where an extraction starts, before its force has built up, cm"
    )
    air_clearance_cm: Positive = key(
        0.5, "how far the whole intruder must be above the surface to count as in air, cm"
    )
    min_points: int = key(30, "fewer samples in the window give no alpha", ge=3)
    min_depth_cm: NotNegative | None = key(
        None,
        "a window that covers less depth gives no alpha, cm; default: a tenth of the plate's length",
    )
    confidence: float = key(0.95, "level of all intervals", gt=0.5, lt=1)
    law: Law = key(
        "through_zero",
        "what alpha is: the slope of the line through zero (Eq. 1); that with a free_intercept, which "
        "takes the surface for unknown; or stress over depth at law_depth_cm by a power of depth",
    )
    law_depth_cm: Positive = key(
        5.0, "depth at which the stress by the other laws is compared with that by Eq. 1, cm"
    )
    depths_cm: tuple[Positive, ...] = key(
        (2.5, 5.0, 7.0),
        "depths at which alpha is also given, by a power of depth, where stress is found to be curved, cm",
        strict=False, min_length=1,
    )  # fmt: skip
    flagged: Literal["keep", "leave_out"] = key(
        "keep",
        "cells flagged as not linear, or of too few depths, in the nine-term fits: keep, with the larger "
        "errors that they have, or leave_out",
    )
    missing_tare: Literal["refuse", "flag", "none"] = key(
        "refuse",
        "flag: a run for which the sheet names no tare_run is used as it is, with the "
        "force on rod and mount in it, and says so; none: so it is, and there is no such force, as in "
        "a simulation",
    )


class Errors(Model):
    """Standard deviations of what no single log shows; each enters the intervals under its name."""

    surface_run_mm: NotNegative | None = key(
        None,
        "free surface, from run to run, mm; default: what the runs of a medium show, whose lines with a "
        "free intercept meet zero stress at other depths; below five such runs, mixed with 1 mm",
    )
    surface_session_mm: NotNegative | None = key(
        None,
        "free surface, the same error in all runs of a medium, mm; default: the median of these depths",
    )
    angle_deg: NotNegative = key(
        0.5, "attack angle and direction of motion of a run, degrees; default: a quarter of what "
        "arm.angle_tolerance_deg lets pass",
    )  # fmt: skip
    turn_deg: NotNegative = key(
        0.5, "transducer.turn_deg, the same error in all runs, degrees; default: a mount set by eye"
    )
    bed_N_per_cm3: NotNegative | None = key(
        None,
        "alpha from one prepared bed to the next, N/cm^3, used where the run sheet has too few repeats "
        "to show it; 0 for intervals of one bed as prepared",
    )
    bed_percent: NotNegative | None = key(
        None,
        "the part of it that grows with alpha, percent; the two add in squares; default: 5 where neither "
        "is stated, beds poured or tapped by hand",
    )
    tare_percent: NotNegative = key(
        10.0,
        "force on the rod alone, the same error in all runs, percent; default: rods pushed into beds of "
        "another day",
    )

    hip_cm: NotNegative = key(
        0.1, "hip_height_cm of a leg, cm; default: an axle set with a ruler against a levelled bed"
    )
    arc_percent: NotNegative = key(
        1.5, "arc of a curved leg, percent; default: 0.7 mm on the rim of a half circle of 7.6 cm"
    )

    @property
    def bed(self) -> tuple[float, float] | None:
        """Stated spread of beds: a part in N/cm^3 and one relative to alpha."""
        if self.bed_N_per_cm3 is None and self.bed_percent is None:
            return None
        return self.bed_N_per_cm3 or 0.0, (self.bed_percent or 0.0) / 100


TableColumn = Literal[
    "medium", "run_id", "beta_deg", "gamma_deg", "depth_cm", "stress_z_N_per_cm2",
    "stress_x_N_per_cm2", "alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "se_z", "se_x", "n",
    "excluded", "reason",
]  # fmt: skip


class Table(Model):
    """A table in place of a run sheet and its logs: ``run_sheet`` names it, inside the raw folder."""

    holds: Literal["stress", "alpha"] = need(
        "stress: stress on a plate against depth, rows of many depths; alpha: finished slopes, a row "
        "a direction, or the blocks of the paper's Table S5"
    )
    columns: dict[TableColumn, str] = key(
        {}, "our name: the name that the file has; default: as ours"
    )
    angle_unit: Literal["deg", "rad"] = key("deg", "unit of beta and gamma")
    depth_unit: Literal["cm", "mm", "m", "in"] = key("cm", "unit of the depth")
    stress_unit: Literal["N/cm^2", "Pa", "kPa", "MPa", "psi"] = key("N/cm^2", "unit of the stress")
    alpha_unit: Literal["N/cm^3", "N/m^3", "Pa/m", "kPa/m", "MPa/m", "kPa/cm"] = key(
        "N/cm^3", "unit of alpha and its errors"
    )

    @property
    def angle_scale(self) -> float:
        """Degrees in one unit of the angles."""
        return 1.0 if self.angle_unit == "deg" else math.degrees(1)


_NOT_OF_TABLES: dict[str, Any] = {
    "transducer": {"name": "not stated", "range_N": [1e9] * 3, "axes": {"x": "+F1", "y": "+F2", "z": "+F3"}},
    "container": dict.fromkeys(("length_cm", "width_cm", "depth_cm"), 1e6),
}  # fmt: skip
"""Keys that a campaign with logs must give and a table makes needless."""

UNIT_AREA = "unit_area"
"""Intruder of a table: its stress is the force on 1 cm^2."""


class Fourier(Model):
    """The nine-term fit."""

    method: Literal["lsq", "dft-index"] = key(
        "lsq", "the fit that zeta and chi of new media are taken from"
    )
    threshold: NotNegative = key(0.05, "a term is kept above this fraction of A00")
    draws: int = key(2000, "bootstrap draws for the intervals", ge=200, le=1_000_000)
    seed: int = key(2013, "seed of the bootstrap: same seed, same intervals", ge=0)


class Maps(Model):
    """Alpha in every direction from the pushes that there are."""

    own_media: bool = key(
        False,
        "media of this campaign that were pushed in every direction are known shapes for its others, "
        "beside the published ones",
    )


class Figures(Model):
    """What the figures show."""

    stress_runs: tuple[str, ...] = key(
        (),
        "runs in the stress figure; default: a push and its pull nearest to (30, 45) degrees, of the first medium",
    )


CheckName = Literal[
    "channels", "rods", "work", "symmetry", "up_down", "drift", "surface", "linearity",
    "steadiness", "repeats", "same_logs", "size",
]  # fmt: skip
"""Checks of `rftfit.measure.checks`."""


class Medium(Model):
    """One granular medium."""

    title: str = need("name in tables and figures")
    role: Literal["laboratory", "natural_sand"] = key(
        "laboratory", "laboratory: measured over the grid; natural_sand: one penetration"
    )
    compaction: str = key("", "how the bed was prepared, for example LP or CP")
    note: str = key("", "free text")
    published_as: str | None = key(
        None, "key of this medium in the published tables, for comparison"
    )
    linear_to_cm: Positive | None = key(None, "end of the linear regime of a penetration test, cm")
    expected_alpha: tuple[Positive, Positive] | None = key(
        None,
        "least and largest alpha_z(0, 90 deg) that is possible here, N/cm^3; default: not known, and "
        "the scale of the force is not checked",
        strict=False,
    )
    accept: dict[CheckName, Annotated[str, Field(min_length=1)]] = key(
        {},
        "check: reason why the medium is used although it fails that check; the reason is printed "
        "wherever the medium appears",
    )

    @field_validator("expected_alpha")
    @classmethod
    def _in_order(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        if ends is not None and ends[0] >= ends[1]:
            raise ValueError(
                f"the first must be below the second, found {ends[0]:g} and {ends[1]:g}"
            )
        return ends


class RobotRuns(Model):
    """A legged robot that runs on one of the media."""

    medium: Name = need("the medium it runs on: one that was measured over the grid")
    file: str | None = key(
        None,
        "the robot's own file, relative to the campaign's folder; default: the paper's "
        "robot, config/robot.yaml of the program",
    )
    runs: str | None = key(
        None,
        "sheet of its marker tracks, relative to the raw folder; default: the speeds of "
        "Fig. 4C where the medium is the paper's loose poppy seeds, else nothing is compared",
    )


class Publication(Model):
    """Who makes the results known; stands in ``results/ro-crate-metadata.json``."""

    date: str = key(
        "",
        "day of publication as yyyy-mm-dd, in quotes; no date of a computer enters any result",
        pattern=r"^([0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01]))?$",
    )
    license: str = key("", "address of the licence of the results", pattern=r"^(https?://\S+)?$")
    authors: tuple[str, ...] = key((), "names of those who measured and evaluated", strict=False)


class Config(Model):
    """The whole of ``config/config.yaml``."""

    title: str = need("name of the campaign, for the report")
    raw: str = need("folder of the logs, relative to the campaign's folder")
    run_sheet: str = need("csv, tsv or xlsx, relative to the campaign's folder")
    table: Table | None = key(
        None,
        "the run sheet is itself a table of stress or alpha; transducer, container and intruders are "
        "then not needed",
    )
    dialect: Name = key("rig", "log dialect, see rftfit inspect --help")
    force_log: ForceLog = key(
        ForceLog(), "how force logs are written; for other logs than the rig's"
    )
    motion_log: MotionLog = key(MotionLog(), "how motion logs are written; may be the same file")
    transducer: Transducer = need("the force sensor and how it is mounted")
    zero: Zero = key(Zero(), "what the transducer reads without load")
    arm: Arm = key(Arm(), "the robot arm that moves the intruder")
    clock: Clock = key(Clock(), "how the clocks of the two logs are brought together")
    surface: FreeSurface = key(FreeSurface(), "where the free surface lies")
    rigid_contact: RigidContact | None = key(
        None,
        "a push against something rigid; the yielding of the machine that it shows is "
        "taken off every depth",
    )
    container: Container = need("the box that holds the medium, its middle at arm.middle_x_mm")
    intruders: dict[Name, Intruder] = need(
        "plates and legs, by the name that the run sheet uses", min_length=1
    )
    media: dict[Name, Medium] = need(
        "granular media, by the name that the run sheet uses", min_length=1
    )
    grid: Grid = key(
        Grid(),
        "directions that are to be measured: a run in another one is an error, one without a run "
        "an empty cell; default: those of the run sheet",
    )
    fit: Fit = key(Fit(), "which part of a stroke is fitted")
    errors: Errors = key(Errors(), "errors that no single log shows")
    fourier: Fourier = key(Fourier(), "the nine-term fit")
    maps: Maps = key(Maps(), "alpha in every direction from the pushes that there are")
    figures: Figures = key(Figures(), "what the figures show")
    publication: Publication = key(Publication(), "who makes the results known, and when")
    robot: RobotRuns | None = key(None, "a legged robot on one of the media; default: no robot")

    @model_validator(mode="before")
    @classmethod
    def _table_needs_no_rig(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("table") is not None:
            area = {"shape": "flat", "area_cm2": 1.0, "length_cm": 1.0, "thickness_cm": 1.0}
            own = data.get("intruders", {})
            # legs are welcome, to predict forces on them
            intruders = {**own, UNIT_AREA: area} if isinstance(own, dict) else own
            return {**_NOT_OF_TABLES, **data, "intruders": intruders}
        return data

    @property
    def legs(self) -> dict[str, Leg]:
        """The intruders that are legs, by name."""
        return {name: one for name, one in self.intruders.items() if isinstance(one, Leg)}

    def grid_of(self, medium: str) -> Grid:
        """Directions of one medium: a natural sand has none planned, but the same tolerance."""
        if self.media[medium].role == "laboratory":
            return self.grid
        return Grid(angle_tolerance_deg=self.grid.angle_tolerance_deg)

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
