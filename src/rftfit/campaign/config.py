"""Models of ``config/config.yaml``: its sections and keys with types, ranges, defaults and what each key means.

They are the one source of its validation, schema and documentation. A class is a section, a field is a key, and the
text below a field describes the key to users (`rftfit.campaign.schema`): what its default means, None above all, stands
there. A name ends in its unit. What single ranges cannot say is checked by methods, each of which raises ValueError
with words for the user; pydantic collects these. `Config` is the whole.
"""

from __future__ import annotations

import codecs
import math
from typing import Annotated, Any, Generic, Literal, TypeVar, get_args

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
from rftfit.directions import TOLERANCE_DEG, same_direction
from rftfit.table.units import ANGLE_TO_DEG, FORCE_TO_N, LENGTH_TO_CM, TIME_TO_S, TORQUE_TO_N_M

LARGEST = 1e6
"""Largest number of most settings: no length in cm, force in N or time in s of a laboratory is larger."""
LARGEST_OF_FILES = 1e20
"""Largest factor or offset for the values of a file, which may be counts, or nanoseconds since 1970."""
LARGEST_PARAMETER = 1e3
"""Largest stated alpha, N/cm^3: alpha of dense sand is below 10."""

# ranges that several keys share; those of one key stand beside it
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0, le=LARGEST)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST)]
OfFile = Annotated[float, Field(ge=-LARGEST_OF_FILES, le=LARGEST_OF_FILES)]
"""Number in the units of a file."""
Percent = Annotated[float, Field(ge=0, le=100)]
AngleDeg = Annotated[float, Field(ge=-90, le=90)]
AngleError = Annotated[float, Field(ge=0, le=90)]
Share = Annotated[float, Field(gt=0, le=1)]
ColumnNumber = Annotated[int, Field(ge=1, le=1_000_000)]
"""Place of a column in a file, from 1."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64)]
"""Name that the user chooses; it becomes part of names of files."""


class Model(BaseModel):
    """A section of the configuration: unknown keys are errors, values never change."""

    # strict: "24" in quotes and `yes` are no numbers, and the user is told.
    # deferred: building validators is slow; a command builds only those that it needs
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True
    )


# --- How force and motion are brought together: clocks, free surface, and the yielding of the machine.


class ClockSettings(Model):
    """How the clocks of the force log and of the motion log are brought together."""

    method: Literal["sync_line", "same_clock", "estimate"] = "sync_line"
    """sync_line: the force log records when the arm moves; same_clock: one clock; estimate: from the
    force, which grows only where the intruder goes deeper

    The force log and the motion log are often written by two computers whose clocks differ by
    seconds. With `sync_line` each edge of the line gives the offset; it needs a column `arm_moving`
    in the force log. With `estimate` the offset of each push straight down is fitted so that the
    force grows where the intruder goes deeper; offset and drift of a session (column `session` of
    the run sheet) are found from all of its pushes and used for all of its runs. Example:
    `clock: {method: same_clock}` where force and motion are columns of one file.
    """
    max_residual_s: Positive = 0.05
    """a run whose edges agree no better than this is refused, s"""
    max_gap_s: Positive = 0.1
    """a step between samples longer than this, and than 1.5 usual steps, is a gap, s

    A gap is a stretch of time without samples, for example of lost packets. It is flagged, and no
    number is made up for it. Raise it for a slow logger: at 5 Hz the usual step is 0.2 s, and 0.5 s
    is sensible. Example: `clock: {max_gap_s: 0.5}`.
    """
    max_se_s: Positive = 0.1
    """a run whose estimated offset has a larger standard error is refused, s"""
    max_drift: Share = 1e-3
    """how much the rates of the clocks may differ, as a standard deviation, relative; for estimate

    Two crystals differ by some 0.01 percent, loggers on a busy computer by up to 0.1 percent: in
    100 s that is 0.1 s. The estimate may stretch one clock by about that much, and its uncertainty
    goes into the interval of alpha. Example: `clock: {method: estimate, max_drift: 1e-4}` for two
    instruments with good clocks.
    """


class FreeSurface(Model):
    """Where the free surface lies."""

    method: Literal["given", "find"] = "given"
    """given: surface_z_mm of the sheet or the arm; find: where the force begins to grow, in each push
    straight down whose row of the sheet gives no surface_z_mm

    Depth is counted from the free surface, so that an error of 1 mm changes alpha of a shallow push
    by several percent. Use `given` where you measured the height of each bed, `find` where nobody
    wrote it down. Example: `surface: {method: find}`.
    """
    window_cm: Positive = 1.5
    """how far above and below the surface the force is looked at, cm

    Enough readings are needed on both sides: raise it for a slow logger, lower it where stress soon
    bends with depth. The motion must begin at least that far above the surface. Example: `surface:
    {method: find, window_cm: 3}`.
    """
    max_se_cm: Positive = 0.1
    """a run whose surface has a larger standard error is refused, cm"""


class RigidContact(Model):
    """A push of the bare machine against something rigid: how far it yields under load."""

    force_log: str
    """force log, relative to the raw folder"""
    motion_log: str
    """motion log, relative to the raw folder"""


# --- What is pushed through a medium: plates of any outline, and legs.


class Plate(Model):
    """A flat plate; its length lies in the x-z plane."""

    shape: Literal["plate"]
    """a flat plate"""
    length_cm: Positive
    """side that lies in the x-z plane, cm"""
    width_cm: Positive
    """side across, along y, cm"""
    thickness_cm: Positive
    """thickness, cm"""

    @property
    def area_cm2(self) -> float:
        """Area of one face, cm^2."""
        return self.length_cm * self.width_cm


class Leg(Model):
    """A thin leg turned about an axle above the surface."""

    shape: Literal["leg"]
    """a thin leg turned about an axle"""
    curvature_times_R: float = Field(ge=-1, le=1)
    """R/r: 1 c-leg, 0 flat, -1 reversed c-leg (2R is the maximal length)

    r is the radius of the leg's arc and R half of `max_length_cm`. A half circle has r = R, so 1; a
    straight strip has an infinite r, so 0. With -1 the half circle is mounted the other way round.
    Example: `curvature_times_R: 0.5` for an arc of twice the radius.
    """
    max_length_cm: Positive
    """largest distance from axle to tip, 2R, cm"""
    width_cm: Positive
    """side along the axle, cm"""
    thickness_cm: Positive
    """thickness, cm"""
    hip_height_cm: Number
    """height of the axle above the free surface, cm

    The axle stands still while the leg turns; the leg dips into the medium by `max_length_cm` less
    this height. Example: `hip_height_cm: 2` with `max_length_cm: 7.62` reaches 5.62 cm deep.
    """


class Disc(Model):
    """A flat circular plate."""

    shape: Literal["disc"]
    """a flat circular plate"""
    diameter_cm: Positive
    """diameter, cm"""
    thickness_cm: Positive
    """thickness, cm"""

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

    shape: Literal["flat"]
    """a flat plate of any outline"""
    area_cm2: Positive
    """area of one face, cm^2"""
    length_cm: Positive
    """extent in the x-z plane, cm

    It decides how far the plate reaches to both sides, and so which part of a stroke is wholly
    below the surface and away from the walls. Example: `{shape: flat, area_cm2: 7.1, length_cm: 4,
    thickness_cm: 0.3}` for a triangle.
    """
    thickness_cm: Positive
    """thickness, cm"""


AnyPlate = Plate | Disc | FlatOutline
PLATE_SHAPES = ("plate", "disc", "flat")
Intruder = Annotated[AnyPlate | Leg, Field(discriminator="shape")]


# --- How the logs of a campaign are written: dialect, text format, and which column is which quantity.


ForceQuantity = Literal["time", "arm_moving", "F1", "F2", "F3", "T1", "T2", "T3"]
MotionQuantity = Literal["time", "x", "z", "angle", "along"]
QUANTITIES = (*get_args(ForceQuantity), "x", "z", "angle")
"""Quantities that a column of a log can hold; torques T1 to T3 are read, and no result uses them.

Without `along`, the one position of a rig that has only one: x and z are made of it.
"""
Unit = Literal[
    "N",
    "mN",
    "cN",
    "daN",
    "kN",
    "lbf",
    "klbf",
    "kgf",
    "gf",
    "N m",
    "N mm",
    "um",
    "mm",
    "cm",
    "m",
    "in",
    "deg",
    "rad",
    "s",
    "ms",
    "us",
    "ns",
    "min",
    "h",
    "d",
    "kg",
    "g",
]
UNIT_OF_WEIGHT = {"kg": "kgf", "g": "gf"}
"""Unit of mass, to the unit of force that it means in a column of forces: the weight of the mass."""

UNITS_OF: dict[str, tuple[str, ...]] = {
    "time": (*TIME_TO_S,),
    "F": (*FORCE_TO_N, *UNIT_OF_WEIGHT),
    "T": (*TORQUE_TO_N_M,),
    **dict.fromkeys(("x", "z", "along"), (*LENGTH_TO_CM,)),
    "angle": (*ANGLE_TO_DEG,),
}
"""Quantity, by its name or the first letter of its name, to its units."""


def units_of(quantity: str) -> tuple[str, ...]:
    """Return the units of a quantity of a log; empty for `arm_moving`, which has none."""
    return UNITS_OF.get(quantity, UNITS_OF.get(quantity[0], ()))


class TextFormat(Model):
    """Any delimited text, described; the file is then read by the dialect ``delimited``."""

    delimiter: Literal[",", ";", "tab", "blank", "bar"] = ","
    """what stands between cells; blank: any number of blanks and tabs; bar: the vertical bar"""
    decimal: Literal[".", ","] = "."
    """decimal mark of the numbers"""
    skip_lines: int = Field(default=0, ge=0, le=1000)
    """lines in front of the row of names, or of the data

    Count the lines above the row of names, blank ones too; without a row of names those above the
    first row of numbers. `rftfit inspect LOG` proposes the number. Example: `text: {delimiter: tab,
    skip_lines: 12}`.
    """
    names: bool = True
    """whether a row of names follows; else columns go by number, from 1"""
    units: bool = False
    """whether a row of units follows that"""
    dates: Literal["", "year first", "day first", "month first"] = ""
    """order of dates such as 03/04/2026 1:00:36 PM, where the first rows do not show it

    03/04/2026 is the third of April in Europe and the fourth of March in the United States. Where a
    day above 12 stands in the first rows the file itself decides. Example: `text: {dates: day
    first}`.
    """
    comment: str = Field(default="", max_length=8)
    """lines that begin with this are no data, for example #"""
    encoding: str = ""
    """of the names; default: UTF-8, or else Windows-1252"""
    rate_Hz: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """rows a second, where no column holds the time, Hz

    Time is then the number of the row over this rate. A row that cannot be read keeps its place, so
    the rows below keep their time. Example: `text: {delimiter: ";", rate_Hz: 1000}`.
    """

    @field_validator("encoding")
    @classmethod
    def _encoding_exists(cls, name: str) -> str:
        """Refuse an encoding that Python does not have."""
        try:
            codecs.lookup(name or "utf-8")
        except LookupError:
            raise ValueError(
                f"no encoding is called {name!r}; common ones: utf-8, cp1252, latin-1, shift_jis"
            ) from None
        return name


class NamedColumn(Model):
    """A column of a log."""

    column: str | ColumnNumber | None = None
    """its name as rftfit inspect shows it, or its number in the file, from 1"""
    unit: Unit | None = None
    """its unit; needed where the file states none"""


class SecondColumn(NamedColumn):
    """A column whose values are added to those of another."""

    @model_validator(mode="after")
    def _names_a_column(self) -> SecondColumn:
        """Refuse an entry without a column."""
        if self.column is None:
            raise ValueError("needs a column: the one whose values are added")
        return self


class ColumnEntry(NamedColumn):
    """The column of a quantity."""

    factor: OfFile = 1.0
    """multiplied onto the values, for example -1 where down is positive; with `unit`, units of the
    quantity for one of a file's own (V, counts)

    A displacement that grows downward becomes z with `factor: -1`. A bridge amplifier with 250 N a
    volt: `F3: {column: bridge, unit: N, factor: 250, offset: -12.5}`. Value used = value in the
    file x factor + offset.
    """
    offset: OfFile = 0.0
    """added after that, in `unit`"""
    constant: OfFile | None = None
    """value of a quantity that no column holds and that stays the same

    For a channel that nobody measured, as the sideways forces on a testing machine. Without a
    measured force along x, alpha_x of plates that are not level or upright is blank. Examples: `F1: {constant: 0, unit: N}`, `x: {constant: 0, unit: mm}`.
    """
    rate: OfFile | None = None
    """change per second of a quantity that no column holds, from `constant` at the first row on: an
    actuator of known speed

    For a log without a position, of an actuator of known speed: 1 mm/s downward from 20 mm above
    the arm's zero is `z: {constant: 20, rate: -1, unit: mm}`.
    """

    plus: SecondColumn | None = None
    """a second column whose values are added, as nanoseconds to seconds, or the time of day to the date

    Example: `time: {column: sec, unit: s, plus: {column: nanosec, unit: ns}}`.
    """

    @model_validator(mode="after")
    def _column_or_constant(self) -> ColumnEntry:
        """Refuse an entry with both a column and a constant, or neither; a rate without a constant; a factor of 0."""
        if (self.column is None) == (self.constant is None):
            raise ValueError("needs either a column or a constant")
        if self.rate is not None and self.constant is None:
            raise ValueError("a rate needs a constant: the value at the first row")
        if self.factor == 0:
            raise ValueError("a factor of 0 would erase the column")
        return self


def _full_column_entry(entry: Any) -> Any:
    """Return the section of a column for a bare name or number, as in ``F3: Kraft``; a section comes back unchanged."""
    is_bare = isinstance(entry, str | int) and not isinstance(entry, bool)
    return {"column": entry} if is_bare else entry


ColumnOrEntry = Annotated[
    ColumnEntry,
    BeforeValidator(_full_column_entry, json_schema_input_type=ColumnEntry | str | ColumnNumber),
]
Q = TypeVar("Q", bound=str)
"""Type of the quantities that a kind of log can have: those of force logs or of motion logs."""


class Source(Model, Generic[Q]):
    """How one kind of log is written."""

    dialect: Name | None = None
    """default: the campaign's; delimited where `text` is given"""
    text: TextFormat | None = None
    """the format, for the dialect delimited"""
    options: dict[Name, str | int | float | bool] = {}
    """what the dialect can be told, see its documentation

    For example the sheet of a workbook, the topic of a ROS bag, or the rate of arrays without a
    time; `docs/dialects.md` lists them. Examples: `options: {sheet: "Values *"}`, `options: {topic:
    /ft_sensor/wrench}`, `options: {rate_Hz: 500}`.
    """
    where: dict[str, str | float | list[str | float]] = {}
    """which rows are meant where a log holds those of several sources: column to the word or number that they hold there

    For two sensors on one topic or in one long table. In a ROS bag the column is a text of the message, as
    `header.frame_id`, `transforms0.child_frame_id` or `name0`. Examples: `where: {sensor: ft_plate}`,
    `where: {header.frame_id: [tool0, tool0_controller]}`.
    """
    missing: list[float] = []
    """values that mean no data, as the file has them, before factor and offset

    A row with such a value in a column that is used is left out and counted. Example: `missing: [-9999, -999999]`.
    """
    columns: dict[Q, ColumnOrEntry] = {}
    """quantity: column; default: the columns are named by the quantities

    Needed where the columns of the file have other names than `time`, `F1`, `x`, `z`. `rftfit
    inspect LOG` proposes the lines. Example: `columns: {time: Zeit, F3: {column: Standardkraft,
    unit: N, factor: -1}}`.
    """

    @property
    def where_words(self) -> dict[str, tuple[str, ...]]:
        """Column of `where`, to the words of which a cell must hold one for its row to be read; numbers as text."""
        words_of_column = {}
        for column, stated in self.where.items():
            words = stated if isinstance(stated, list) else [stated]
            as_text = (f"{word:g}" if isinstance(word, float) else word for word in words)
            words_of_column[column] = tuple(as_text)
        return words_of_column

    @field_validator("columns")
    @classmethod
    def _units_fit(cls, columns: dict[Q, ColumnEntry]) -> dict[Q, ColumnEntry]:
        """Refuse units that the quantity cannot have."""
        faults = []
        for quantity, entry in columns.items():
            allowed = units_of(quantity)
            stated = {"unit": entry.unit, "plus.unit": entry.plus and entry.plus.unit}
            faults += [
                f"{quantity}.{key}: found {unit!r}; allowed: one of {', '.join(allowed)}"
                for key, unit in stated.items()
                if unit and allowed and unit not in allowed
            ]
        if faults:
            raise ValueError("; ".join(faults))
        return columns

    @model_validator(mode="after")
    def _text_is_delimited(self) -> Source[Q]:
        """Refuse `text` with another dialect than ``delimited``, and this dialect without `text`."""
        if self.text is not None and self.dialect not in (None, "delimited"):
            raise ValueError(f"`text` goes with the dialect delimited, found {self.dialect}")
        if self.text is None and self.dialect == "delimited":
            raise ValueError("the dialect delimited needs `text`, the description of the format")
        return self


class ForceLog(Source[ForceQuantity]):
    """How force logs are written."""

    calibration: str | None = None
    """csv inside the raw folder that makes loads of a transducer's gauges: the columns load (F1 to T3),
    unit, and one for each gauge by its name in the log; load = sum of value x gauge

    For a transducer whose gauges were logged in volts. Each row of the csv is one load; a load is
    the sum of gauge x number over its row. Example of a file: `load,unit,G0,G1` / `F1,N,12.1,-0.3`
    / `F2,N,0.2,11.8` / `F3,N,0,31.0`.
    """


class MotionLog(Source[MotionQuantity]):
    """How motion logs are written.

    `along` is for a rig with one position along its path: x and z follow from gamma in the row of the sheet, and from
    the depth of a horizontal run; it is 0 where the plate's centre is at the surface, and grows on the way in.
    """


AnyLog = ForceLog | MotionLog


# --- The sections of the configuration, and the whole of it.


Channel = Annotated[str, Field(pattern=r"^[+-]F[123]$")]
T = TypeVar("T")
LengthUnit = Literal["mm", "cm", "m", "in"]
ForceUnit = Literal["N", "mN", "cN", "daN", "kN", "lbf", "klbf", "kgf", "gf"]


def _weight_unit(unit: Any) -> Any:
    """Return the unit of weight for a unit of mass; any other unit comes back unchanged."""
    return UNIT_OF_WEIGHT.get(unit, unit) if isinstance(unit, str) else unit


class Axes(Model):
    """Which signed sensor channel lies along each axis of the mount."""

    x: Channel
    """channel along mount x, for example -F2"""
    y: Channel
    """channel along mount y"""
    z: Channel
    """channel along mount z; a push from below must come out positive

    The mount is the frame fixed to the arm; at `transducer.turn_deg: 0` its x and z are those of
    the lab. Each axis is a channel with a sign. To find the sign of z, press against the plate from
    below with a finger: z must become positive. Example: `axes: {x: "-F2", y: "+F1", z: "-F3"}`.
    """

    @model_validator(mode="after")
    def _each_channel_once(self) -> Axes:
        """Refuse a channel that lies along two axes."""
        used = [self.x[1:], self.y[1:], self.z[1:]]
        if len(set(used)) < 3:
            raise ValueError(f"each of F1, F2, F3 must be used once, found {', '.join(used)}")
        return self


class Transducer(Model):
    """The force sensor and how it is mounted."""

    name: str
    """make and model, for the report"""
    force_unit: Annotated[
        ForceUnit,
        BeforeValidator(_weight_unit, json_schema_input_type=ForceUnit | Literal["kg", "g"]),
    ] = "N"
    """unit of the force columns of the logs; kg and g mean kgf and gf"""
    range_N: tuple[Positive, Positive, Positive] = Field(strict=False)
    """largest force that channels F1, F2, F3 can measure, N"""
    precision_N: Positive = 0.05
    """standard deviation of one sample, N

    Take the standard deviation of one channel while nothing touches the sensor. It says which
    forces are noise, in the search for the free surface and in the checks; intervals take the noise
    from each log itself. Example: `precision_N: 0.02`.
    """
    axes: Axes
    """which signed sensor channel lies along each axis of the mount"""
    turn_deg: float = Field(default=0.0, ge=-180, le=180)
    """turn of the mount about y, from z toward x, degrees

    With t = turn_deg, force_x = s_x cos t + s_z sin t and force_z = -s_x sin t + s_z cos t. To
    measure it, hang a weight on the mount: the tangent of t is then -s_x / s_z. Example: `turn_deg:
    4`.
    """
    drift_N_per_min: NotNegative = 0.02
    """largest drift of the zero within a run, N/min; enters the intervals

    The zero of strain gauges moves with temperature. Where a log has a rest in air at both ends the
    drift is seen and taken off; where it has one, this number times the duration enters the
    interval. A log at rest over ten minutes shows it. Example: `drift_N_per_min: 0.05`.
    """
    slow_noise_N: NotNegative = 0.0
    """how far the zero of a channel moves by itself from the rest in air to the stroke (1/f noise),
    standard deviation, N; enters the intervals; default: not beyond what rest and stroke show

    An amplifier with 1/f noise wanders while it seems to rest. Record a log without load; take the
    mean over a stretch as long as the stroke less the mean over one as long as the rest before it,
    many times: the standard deviation of these differences is this number. Example: `slow_noise_N:
    0.01`.
    """
    max_drift_N: Positive = 0.2
    """a run whose force zero moves by more than this is flagged, N"""
    repeats: Literal["keep", "drop"] = "keep"
    """drop: rows in which all channels repeat the row before are the last reading of a transducer slower
    than its logger, and are left out

    A transducer of 100 Hz in a logger of 1000 Hz gives each reading ten times. Such rows are no
    independent samples: kept, they make the noise look smaller than it is. Example: `repeats:
    drop`.
    """


class ZeroSettings(Model):
    """What the transducer reads without load."""

    method: Literal["air", "stated"] = "air"
    """air: the intruder's rest in air within each log; stated: the readings below, for logs without such a
    rest. A `zero_log` of the run sheet goes before both

    Each run should begin with some seconds in air: their mean is the zero. Logs that begin at
    contact have no such rest; then state the reading, or name a log without load in the column
    `zero_log` of the run sheet. Example: `zero: {method: stated, readings_N: [0, 0, 0], sd_N:
    0.02}` for a machine that was set to zero before each push.
    """
    readings_N: tuple[Number, Number, Number] = Field(default=(0.0, 0.0, 0.0), strict=False)
    """what channels F1, F2, F3 read without load, for stated; 0 for logs whose zero was taken off"""
    sd_N: NotNegative | None = None
    """standard error of a stated reading; enters the intervals, so stated needs it"""
    log_age_min: NotNegative = 10.0
    """longest time between a zero_log and its run, min: the zero may drift for so long. Where both logs state a date or a time
    of day it drifts for the time between them, and a longer one is flagged"""

    @model_validator(mode="after")
    def _stated_has_an_error(self) -> ZeroSettings:
        """Refuse a stated reading without its standard error."""
        if self.method == "stated" and self.sd_N is None:
            raise ValueError("method stated needs sd_N: how far the zero may be off, N")
        return self


class Arm(Model):
    """The robot arm that moves the intruder."""

    position_unit: LengthUnit = "mm"
    """unit of the position columns"""
    surface_z_mm: Number = 0.0
    """arm z of the free surface unless the sheet says, mm

    Depth is this height less the z of the plate's centre. Lower the plate until it touches the
    levelled bed, and read z of the arm. A column of this name in the run sheet goes before it.
    Example: `surface_z_mm: 150`.
    """
    middle_x_mm: Number = 0.0
    """arm x of the middle of the container, mm"""
    speed_cm_per_s: Positive = 1.0
    """speed along the stroke, cm/s

    The stroke is found where the arm moves straight at half of this speed or faster. State the
    speed of your pushes; a run that is slower is refused. Example: `speed_cm_per_s: 0.5`.
    """
    leg_speed_rad_per_s: Positive = 0.2
    """speed of a leg's rotation, rad/s"""
    angle_tolerance_deg: Annotated[float, Field(gt=0, le=90)] = 2.0
    """largest difference between sheet and log, of beta and of the path, degrees

    A run whose log shows another angle than its row of the run sheet is refused: one of the two is
    wrong. Raise it for a mount set by eye. Example: `angle_tolerance_deg: 5`.
    """
    drive: Literal["steady", "uneven"] = "steady"
    """uneven: the speed varies within a stroke, as by hand; a straight push down is then all the way from
    the surface to the deepest point

    By hand, or by a motor that stops on the way, a push has no single speed. Example: `arm: {drive:
    uneven}`.
    """


OPEN_CM = 500.0
"""Length and width of a container, cm, from which it stands for open ground: a config states no walls by large numbers."""


class Container(Model):
    """The box that holds the medium; its middle along x lies at ``arm.middle_x_mm``."""

    length_cm: Positive
    """inner size along x, cm"""
    width_cm: Positive
    """inner size across, cm"""
    depth_cm: Positive
    """depth of the medium, cm"""

    @property
    def is_open(self) -> bool:
        """True for open ground, without walls."""
        return min(self.length_cm, self.width_cm) >= OPEN_CM


Direction = tuple[float, float]
"""Attack angle beta and intrusion angle gamma of a cell, degrees."""


class Grid(Model):
    """Directions in which a medium of the role laboratory is to be measured."""

    beta_deg: tuple[AngleDeg, ...] = Field(default=(), strict=False)
    """planned attack angles, degrees; each with every gamma_deg is a cell

    A run in a direction that is not planned is an error, most often a typing error; a planned
    direction without a run is listed as missing. Example: `grid: {beta_deg: [-60, -30, 0, 30, 60,
    90], gamma_deg: [-90, -60, -30, 0, 30, 60, 90]}`.
    """
    gamma_deg: tuple[AngleDeg, ...] = Field(default=(), strict=False)
    """planned intrusion angles, degrees, up to the sides negative"""
    angle_tolerance_deg: Annotated[float, Field(ge=0, le=10)] = TOLERANCE_DEG
    """directions that differ by no more in both angles are one cell, degrees

    Runs of one cell are averaged. With 0.5, runs at (30, 45) and (30.4, 45) are repeats of one
    cell, and (31, 45) is another. Example: `grid: {angle_tolerance_deg: 1}`.
    """

    @model_validator(mode="after")
    def _both_or_none(self) -> Grid:
        """Refuse a grid with only one of its two angles."""
        if bool(self.beta_deg) != bool(self.gamma_deg):
            raise ValueError("needs both beta_deg and gamma_deg, or neither: cells are their pairs")
        return self

    @property
    def planned(self) -> tuple[Direction, ...]:
        """Planned directions (beta, gamma), degrees, sorted; empty where the run sheet alone decides."""
        return tuple(
            (beta, gamma) for beta in sorted(self.beta_deg) for gamma in sorted(self.gamma_deg)
        )

    def same(self, first: Direction, second: Direction) -> bool:
        """Return whether two directions are one cell; a plate at -90 degrees is the same as at 90."""
        return bool(same_direction(*first, *second, self.angle_tolerance_deg))


Law = Literal["through_zero", "free_intercept"]


class Fit(Model):
    """Which part of a stroke is fitted, and how intervals are made."""

    wall_clearance_cm: NotNegative = 6.0
    """distance that the plate keeps from walls and bottom in the window, cm

    Walls and bottom carry force, so that stress near them is too high. Samples within this distance
    are left out; a small container may leave no window at all. Example: `fit: {wall_clearance_cm:
    4}`.
    """
    submergence_cm: NotNegative | None = None
    """smallest depth of the window, cm; default: the plate wholly submerged

    A plate that is half in air has less than its area in the medium. Example: `fit:
    {submergence_cm: 1}` leaves out all that is shallower than 1 cm.
    """
    max_depth_cm: Positive | None = None
    """largest depth of the window, cm; default: from the container

    Stress grows in proportion to depth only so far; deeper, it bends. Example: `fit: {max_depth_cm:
    7}`.
    """
    horizontal_depths_cm: tuple[Positive, ...] = Field(
        default=(2.54, 5.08, 7.62), strict=False, min_length=1
    )
    """depths of the horizontal runs, cm

    A horizontal run stays at one depth: alpha is the slope over the mean stresses of runs at
    several depths. Where the list is stated, a run at a depth that is not listed is read, and warned
    about. Example: `fit: {horizontal_depths_cm: [2, 4, 6]}`.
    """
    horizontal_skip_cm: NotNegative = 2.0
    """start-up length left out of a horizontal run, cm

    A plate that starts to move sideways first builds up a heap in front; its force grows over some
    plate thicknesses. Example: `fit: {horizontal_skip_cm: 3}` for a large plate.
    """
    extraction_skip_cm: NotNegative = 0.1
    """length left out where an extraction starts, before its force has built up, cm"""
    air_clearance_cm: Positive = 0.5
    """how far the whole intruder must be above the surface to count as in air, cm"""
    min_points: int = Field(default=30, ge=3, le=1_000_000)
    """fewer samples in the window give no alpha"""
    min_depth_cm: NotNegative | None = None
    """a window that covers less depth gives no alpha, cm; default: a tenth of the plate's length"""
    confidence: float = Field(default=0.95, gt=0.5, lt=1)
    """level of all intervals

    Of 100 intervals of level 0.95, some 95 hold the true value. Example: `fit: {confidence: 0.68}`
    for one standard error.
    """
    law: Law = "through_zero"
    """what alpha is: the slope of the line through zero (Eq. 1), or of the line with a free_intercept,
    which takes the surface for unknown

    The paper's Eq. 1 says stress = alpha x depth, a line through zero: keep it unless the surface
    is known badly, for which `free_intercept` fits stress = c + alpha x depth. Where stress is
    curved, no slope holds: `results/alpha_at_depth` has stress over depth at `depths_cm`. Example:
    `fit: {law: free_intercept}`.
    """
    depths_cm: tuple[Positive, ...] = Field(default=(2.5, 5.0, 7.0), strict=False, min_length=1)
    """depths at which stress over depth is also given where stress is found to be curved, by the law that is found, cm"""
    flagged: Literal["keep", "leave_out"] = "keep"
    """cells flagged as not linear, or of too few depths, in the nine-term fits: keep, with the larger
    errors that they have, or leave_out

    A flag is a doubt about a cell, not a proof. Leaving cells out costs directions: the nine terms
    need cells all around. Example: `fit: {flagged: leave_out}`.
    """
    missing_tare: Literal["refuse", "flag", "none"] = "refuse"
    """flag: a run for which the sheet names no tare_run is used as it is, with the force on rod and mount
    in it, and says so; none: so it is, and there is no such force, as in a simulation

    The rod above the plate is pushed too; a run of the rod alone, named as `tare_run` in the run
    sheet, is subtracted. Without it alpha is too large. Example: `fit: {missing_tare: flag}` to see
    numbers before the rod was measured.
    """


class ErrorSettings(Model):
    """Standard deviations of what no single log shows; each enters the intervals under its name."""

    surface_run_mm: NotNegative | None = None
    """free surface, from run to run, mm; default: what the runs of a medium show, whose lines with a free
    intercept meet zero stress at other depths; below five such runs, mixed with 1 mm

    Each bed is levelled anew, so each run has a surface of its own. State it where you know it, for
    example 0.2 for a bed scraped with a rail. An error of the surface shifts depth, so it counts
    most in shallow pushes. Example: `errors: {surface_run_mm: 0.2}`.
    """
    surface_session_mm: NotNegative | None = None
    """free surface, the same error in all runs of a medium, mm; default: the median of these depths

    The zero of the arm's z may be wrong by the same amount all day; repeats do not show that.
    Example: `errors: {surface_session_mm: 0.5}` for a surface found by eye, once.
    """
    angle_deg: AngleError = 0.5
    """attack angle and direction of motion of a run, degrees; default: a quarter of what
    arm.angle_tolerance_deg lets pass

    How well one run is set: a clamp with a scale gives about 1, a servo about 0.1. Example:
    `errors: {angle_deg: 1}`.
    """
    turn_deg: AngleError = 0.5
    """transducer.turn_deg, the same error in all runs, degrees; default: a mount set by eye"""
    bed_N_per_cm3: Annotated[float, Field(ge=0, le=LARGEST_PARAMETER)] | None = None
    """alpha from one prepared bed to the next, N/cm^3, used where the run sheet has too few repeats to
    show it; 0 for intervals without the scatter between beds

    Two beds prepared in the same way differ. With repeats (runs of one direction) the spread is
    measured, and this is not needed. With one run a direction, state what you know from earlier.
    Example: `errors: {bed_N_per_cm3: 0.005}`, as the paper states.
    """
    bed_percent: Percent | None = None
    """the part of it that grows with alpha, percent; the two add in squares; default: 5 where neither is
    stated, beds poured or tapped by hand"""
    tare_percent: Percent = 10.0
    """force on the rod alone, the same error in all runs, percent; default: rods pushed into beds of
    another day

    The force on the rod is subtracted; its own error stays. Example: `errors: {tare_percent: 0}`
    for a simulation of the plate alone.
    """

    hip_cm: NotNegative = 0.1
    """hip_height_cm of a leg, cm; default: an axle set with a ruler against a levelled bed"""
    arc_percent: Percent = 1.5
    """arc of a curved leg, percent; default: 0.7 mm on the rim of a half circle of 7.6 cm"""

    @property
    def bed(self) -> tuple[float, float] | None:
        """Stated scatter of alpha between beds: in N/cm^3, and relative to alpha; None where neither is stated."""
        if self.bed_N_per_cm3 is None and self.bed_percent is None:
            return None
        return self.bed_N_per_cm3 or 0.0, (self.bed_percent or 0.0) / 100


TableColumn = Literal[
    "medium",
    "run_id",
    "beta_deg",
    "gamma_deg",
    "depth_cm",
    "stress_z_N_per_cm2",
    "stress_x_N_per_cm2",
    "alpha_z_N_per_cm3",
    "alpha_x_N_per_cm3",
    "se_z",
    "se_x",
    "n",
    "excluded",
    "reason",
]


class TableSettings(Model):
    """A table in place of a run sheet and its logs: ``run_sheet`` names it, inside the raw folder."""

    holds: Literal["stress", "alpha"]
    """stress: stress on a plate against depth, rows of many depths; alpha: finished slopes, a row a
    direction, or the blocks of the paper's Table S5

    For data from a paper, a simulation or a spreadsheet. A table of stress:
    `beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2`, many rows a direction. A
    table of alpha: `beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3`, one row a direction.
    Example: `table: {holds: alpha}`.
    """
    columns: dict[TableColumn, str] = {}
    """our name: the name that the file has; default: as ours

    Example: `columns: {beta_deg: tilt, alpha_z_N_per_cm3: "kz (MPa/m)"}`. A column that is not
    named here and has another name is not read, and you are warned.
    """
    missing: list[float] = []
    """values of depth, stress and alpha that mean no data, as the file has them: such rows are left out and counted"""
    angle_unit: Literal["deg", "rad"] = "deg"
    """unit of beta and gamma"""
    depth_unit: Literal["cm", "mm", "m", "in"] = "cm"
    """unit of the depth"""
    stress_unit: Literal["N/cm^2", "Pa", "kPa", "MPa", "psi"] = "N/cm^2"
    """unit of the stress"""
    alpha_unit: Literal["N/cm^3", "N/m^3", "Pa/m", "kPa/m", "MPa/m", "kPa/cm"] = "N/cm^3"
    """unit of alpha and its errors"""


_RIG_OF_TABLES: dict[str, Any] = {
    "transducer": {
        "name": "not stated",
        "range_N": [LARGEST] * 3,
        "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
    },
    "container": dict.fromkeys(("length_cm", "width_cm", "depth_cm"), LARGEST),
}
"""Values, without effect, of the keys that a campaign with logs needs and one that is a table leaves out."""

UNIT_AREA = "unit_area"
"""Intruder of a campaign that is a table: a plate of 1 cm^2, so that its force is the stress of the table."""


class Fourier(Model):
    """The nine-term fit."""

    method: Literal["lsq", "dft-index"] = "lsq"
    """the fit that zeta and chi of new media are taken from

    `lsq` is least squares at the true angles. `dft-index` is the discrete transform behind the
    paper's Table S2, for comparison with it. Both are always made and every table says which.
    Example: `fourier: {method: dft-index}`.
    """
    threshold: Annotated[float, Field(ge=0, le=1)] = 0.05
    """a term is kept above this fraction of A00

    The paper keeps the nine terms above 0.05 of the mean A00. A lower number keeps more terms in
    the table of coefficients. Example: `fourier: {threshold: 0.03}`.
    """
    draws: int = Field(default=2000, ge=200, le=1_000_000)
    """bootstrap draws for the intervals

    Each draw repeats the fit with errors added to every cell. 2000 give the ends of an interval to
    some 2 percent of its width; time grows in proportion. Example: `fourier: {draws: 500}` while
    you try things.
    """
    seed: int = Field(default=2013, ge=0, le=2**63 - 1)
    """seed of the bootstrap: same seed, same intervals"""


class Maps(Model):
    """Alpha in every direction from the pushes that there are."""

    own_media: bool = False
    """media of this campaign that were pushed in every direction are known shapes for its others, beside
    the published ones

    The map of a medium with few pushes is drawn toward shapes that are known: the published ones,
    and with this those of your own media with a whole grid. Use it where your media are much alike.
    Example: `maps: {own_media: true}`.
    """
    use_legs: tuple[str, ...] = Field(default=(), strict=False)
    """legs whose measured forces teach the map of their medium, beside its plates

    A leg that teaches the map is no test of it any more: its prediction knows its own forces. The table
    `results/contacts.csv` shows beforehand what each leg teaches of the others. Default: none.
    Example: `maps: {use_legs: [c_leg]}`.
    """


class Figures(Model):
    """What the figures show."""

    stress_runs: tuple[str, ...] = ()
    """runs in the stress figure; default: a push and its pull nearest to (30, 45) degrees, of the first
    medium"""


class Publishing(Model):
    """What `results/datapackage.json` says of whose the tables are; nothing is stated by default."""

    version: str = ""
    """version of the tables as they are published, for example 1.0"""
    license: str = ""
    """licence of the tables, by its SPDX name

    Without a licence nobody may use your tables. Example: `publish: {license: CC-BY-4.0}`.
    """
    contributors: tuple[Annotated[str, Field(min_length=1)], ...] = Field(default=(), strict=False)
    """who measured, by name

    Example: `publish: {contributors: [A. Miller, B. Sato]}`.
    """
    source: str = ""
    """address of the logs, where they are published: a DOI or another link"""


CheckName = Literal[
    "sheet",
    "channels",
    "rods",
    "work",
    "axes",
    "symmetry",
    "up_down",
    "drift",
    "surface",
    "linearity",
    "compression",
    "steadiness",
    "repeats",
    "shared",
    "same_logs",
    "size",
]
"""Checks of `rftfit.checks`, in the order of their table."""


class MediumSettings(Model):
    """One granular medium."""

    title: str
    """name in tables and figures"""
    role: Literal["laboratory", "natural_sand"] = "laboratory"
    """laboratory: measured over the grid; natural_sand: one penetration

    A laboratory medium gets a profile of its own from many directions. A natural sand is scaled by
    its pushes of a level plate straight down: these times the generic profile are its forces. Pushes
    in other directions get their alpha, and take part in the map of all directions. Leave it out for a natural
    sand that was pushed in many directions: it is measured as a laboratory medium. Example: `{title: Yuma
    sand, role: natural_sand, linear_to_cm: 2}`.
    """
    compaction: str = ""
    """how the bed was prepared, for example LP or CP"""
    note: str = ""
    """free text"""
    published_as: str | None = None
    """key of this medium in the published tables, for comparison"""
    linear_to_cm: Positive | None = None
    """end of the linear regime of a penetration test, cm

    Deeper samples are not used for the slope. Look at the curve and take the depth where it bends;
    default: to the end of the window. Example: `linear_to_cm: 3`.
    """
    expected_alpha: tuple[Positive, Positive] | None = Field(default=None, strict=False)
    """least and largest alpha_z(0, 90 deg) that is possible here, N/cm^3; default: not known, and the
    scale of the force is not checked

    A wrong unit or factor makes all forces wrong alike, and nothing else shows it. Take the range
    from an earlier campaign or a paper. Example: `expected_alpha: [0.05, 0.3]`.
    """
    accept: dict[CheckName, Annotated[str, Field(min_length=1)]] = {}
    """check: reason why the medium is used although it fails that check; the reason is printed wherever
    the medium appears

    A medium that fails a check is not used for profiles, for good reason. Where you know why it
    fails and that it does not matter, say so. Example: `accept: {rods: "the rod is 3 mm thin, its
    force is below the noise"}`.
    """

    @field_validator("expected_alpha")
    @classmethod
    def _in_order(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        """Refuse a range whose ends are equal or exchanged."""
        if ends is not None and ends[0] >= ends[1]:
            raise ValueError(
                f"the first must be below the second, found {ends[0]:g} and {ends[1]:g}"
            )
        return ends


class RobotRuns(Model):
    """A legged robot that runs on one of the media."""

    medium: Name
    """the medium it runs on: one that was measured over the grid"""
    file: str | None = None
    """the robot's own file, relative to the campaign's folder; default: the paper's robot,
    config/robot.yaml of the program"""
    runs: str | None = None
    """sheet of its marker tracks, relative to the raw folder; default: the speeds of Fig. 4C where
    robot and medium are the paper's, else nothing is compared"""


class Config(Model):
    """The whole of ``config/config.yaml``."""

    title: str
    """name of the campaign, for the report"""
    raw: str
    """folder of the logs, relative to the campaign's folder"""
    run_sheet: str
    """csv, tsv or xlsx, relative to the campaign's folder"""
    table: TableSettings | None = None
    """the run sheet is itself a table of stress or alpha; transducer, container and intruders are then not
    needed"""
    dialect: Name = "rig"
    """log dialect, see rftfit inspect --help"""
    force_log: ForceLog = Field(default_factory=ForceLog)
    """how force logs are written; for other logs than the rig's"""
    motion_log: MotionLog = Field(default_factory=MotionLog)
    """how motion logs are written; may be the same file"""
    transducer: Transducer
    """the force sensor and how it is mounted"""
    zero: ZeroSettings = Field(default_factory=ZeroSettings)
    """what the transducer reads without load"""
    arm: Arm = Field(default_factory=Arm)
    """the robot arm that moves the intruder"""
    clock: ClockSettings = Field(default_factory=ClockSettings)
    """how the clocks of the two logs are brought together"""
    surface: FreeSurface = Field(default_factory=FreeSurface)
    """where the free surface lies"""
    rigid_contact: RigidContact | None = None
    """a push against something rigid; the yielding of the machine that it shows is taken off every depth

    Load cell, rod and frame bend under load, so the plate is less deep than the arm says. Press the
    rod against a steel block, slowly, and record both logs; the difference is taken off every run.
    Example: `rigid_contact: {force_log: block/f.csv, motion_log: block/m.csv}`.
    """
    container: Container
    """the box that holds the medium, its middle at arm.middle_x_mm"""
    intruders: dict[Name, Intruder] = Field(min_length=1)
    """plates and legs, by the name that the run sheet uses"""
    media: dict[Name, MediumSettings] = Field(min_length=1)
    """granular media, by the name that the run sheet uses"""
    grid: Grid = Field(default_factory=Grid)
    """directions that are to be measured: a run in another one is an error, one without a run an empty
    cell; default: those of the run sheet"""
    fit: Fit = Field(default_factory=Fit)
    """which part of a stroke is fitted"""
    errors: ErrorSettings = Field(default_factory=ErrorSettings)
    """errors that no single log shows"""
    fourier: Fourier = Field(default_factory=Fourier)
    """the nine-term fit"""
    maps: Maps = Field(default_factory=Maps)
    """alpha in every direction from the pushes that there are"""
    figures: Figures = Field(default_factory=Figures)
    """what the figures show"""
    robot: RobotRuns | None = None
    """a legged robot on one of the media; default: no robot"""
    publish: Publishing = Field(default_factory=Publishing)
    """whose the tables are, for those who publish them"""

    @model_validator(mode="before")
    @classmethod
    def _table_needs_no_rig(cls, data: Any) -> Any:
        """Add the keys that a campaign that is a table need not state: rig, container, and the plate of its pushes."""
        if not isinstance(data, dict) or data.get("table") is None:
            return data
        # other intruders may be legs, whose forces are predicted
        intruders = data.get("intruders", {})
        if isinstance(intruders, dict):
            area = {"shape": "flat", "area_cm2": 1.0, "length_cm": 1.0, "thickness_cm": 1.0}
            intruders = {**intruders, UNIT_AREA: area}
        return {**_RIG_OF_TABLES, **data, "intruders": intruders}

    @property
    def legs(self) -> dict[str, Leg]:
        """The intruders that are legs, by name."""
        return {
            name: intruder for name, intruder in self.intruders.items() if isinstance(intruder, Leg)
        }

    def grid_of(self, medium: str) -> Grid:
        """Return the grid for a medium: for a natural sand one without planned directions, with the same tolerance."""
        if self.media[medium].role == "laboratory":
            return self.grid
        return Grid(angle_tolerance_deg=self.grid.angle_tolerance_deg)

    @field_validator("robot")
    @classmethod
    def _robot_on_known_medium(
        cls, robot: RobotRuns | None, info: ValidationInfo
    ) -> RobotRuns | None:
        """Refuse a robot on a medium that is not measured over the grid."""
        media = info.data.get("media")  # None where the media have an error
        if robot is not None and media is not None:
            laboratory = [name for name, medium in media.items() if medium.role == "laboratory"]
            _need_word("medium", robot.medium, "a medium of the role laboratory", laboratory)
        return robot

    @field_validator("maps")
    @classmethod
    def _teachers_are_legs(cls, maps: Maps, info: ValidationInfo) -> Maps:
        """Refuse a name in `maps.use_legs` that is no leg."""
        intruders = info.data.get("intruders")  # None where the intruders have an error
        if intruders is not None:
            legs = [name for name, intruder in intruders.items() if isinstance(intruder, Leg)]
            for name in maps.use_legs:
                _need_word("use_legs", name, "a leg of intruders", legs)
        return maps

    @field_validator("intruders", "media")
    @classmethod
    def _names_differ(cls, section: dict[str, T]) -> dict[str, T]:
        """Refuse names that cannot be parts of the names of different files."""
        # names become file names, and some disks ignore case
        names: dict[str, str] = {}
        for name in section:
            twin = names.setdefault(name.casefold(), name)
            if twin != name:
                raise ValueError(f"the names {twin!r} and {name!r} differ by case only")
            if is_device(name):
                raise ValueError(f"found the name {name!r}; allowed: {DEVICE}")
        return section


def _need_word(key: str, word: str, kind: str, allowed: list[str]) -> None:
    """Raise ValueError for a word that is not allowed in a key; `kind`: what an allowed word names."""
    if word not in allowed:
        words = ", ".join(allowed) or "which there is none"
        raise ValueError(f"{key}: found {word!r}; allowed: {kind}, one of {words}")
