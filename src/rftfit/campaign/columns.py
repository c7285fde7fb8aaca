"""The columns of the run sheet: the one definition that reader, documentation and template use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

KINDS = ("plate", "rod", "leg", "leg_air")
DIRECTIONS = {
    "plate": ("intrusion", "extraction", "horizontal"),
    "rod": ("intrusion", "extraction", "horizontal"),
    "leg": ("rotation",),
    "leg_air": ("rotation",),
}
"""The directions that each kind of run can have."""

DIRECTION_WORDS = ("intrusion", "extraction", "horizontal", "rotation")

YES = ("yes", "true", "1")
NO = ("no", "false", "0", "")

Form = Literal["name", "choice", "number", "path", "flag", "text"]
Need = Literal["always", "if used", "no"]


@dataclass(frozen=True, slots=True)
class Column:
    """One column of the run sheet.

    `form`: How a cell is read.
    `need`: Whether a cell may be blank; ``if used``: not for the kinds and direction that use it.
    `kinds`: The kinds of run that use it; elsewhere a filled cell is only warned about.
    `direction`: The one direction that uses it; empty for all.
    `choices`: The words of a ``choice``; empty where they come from `section`.
    `section`: The section of the configuration whose keys are the words.
    `low`, `high`: Inclusive range of a ``number``.
    `above`: Exclusive lower limit of a ``number``.
    `hint`: Added to what is allowed.
    """

    name: str
    form: Form
    meaning: str
    need: Need = "no"
    kinds: tuple[str, ...] = KINDS
    direction: str = ""
    choices: tuple[str, ...] = ()
    section: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    unit: str = ""
    hint: str = ""

    @property
    def header_needed(self) -> bool:
        """Whether a sheet without this column cannot be read."""
        return self.need == "always" or (self.need == "if used" and not self.direction)

    @property
    def allowed(self) -> str:
        """What a cell may hold, in words."""
        if self.form == "choice":
            text = ", ".join(self.choices) or f"a key of `{self.section}` in the config"
        elif self.form == "number":
            text = "a number"
            if self.low is not None and self.high is not None:
                text = f"{self.low:g} to {self.high:g}"
            elif self.above is not None:
                text = f"a number above {self.above:g}"
            text += f" {self.unit}" if self.unit else ""
        else:
            text = {
                "name": "letters A-Z a-z, digits, and . _ -",
                "path": "a path inside the raw folder, with /",
                "flag": "yes, no or blank",
                "text": "any text",
            }[self.form]
        return f"{text}{'; ' if self.hint else ''}{self.hint}"


_PLATES = ("plate", "rod")
_MEASURED = ("plate", "leg")

COLUMNS = (
    Column("run_id", "name", "unique name of the run", "always"),
    Column(
        "kind",
        "choice",
        "plate; rod: rod and mount only, no plate; leg; leg_air: the leg turned in air",
        "always",
        choices=KINDS,
    ),
    Column(
        "medium",
        "choice",
        "the granular medium",
        "if used",
        kinds=("plate", "rod", "leg"),
        section="media",
    ),
    Column(
        "intruder",
        "choice",
        "the plate or leg; for a rod or in-air run, the one whose tare it is",
        "always",
        section="intruders",
    ),
    Column(
        "direction",
        "choice",
        "how it moved",
        "always",
        choices=DIRECTION_WORDS,
        hint="rotation for legs, the others for plates and rods",
    ),
    Column(
        "beta_deg",
        "number",
        "angle at which the plate is held",
        "if used",
        kinds=_PLATES,
        low=-90,
        high=90,
        unit="degrees",
    ),
    Column(
        "gamma_deg",
        "number",
        "angle of the path: 90 straight down, 0 horizontal",
        "if used",
        kinds=_PLATES,
        low=0,
        high=90,
        unit="degrees",
        hint="the angle of the path on the way down, also for an extraction",
    ),
    Column(
        "depth_cm",
        "number",
        "depth of a horizontal run",
        "if used",
        kinds=_PLATES,
        direction="horizontal",
        above=0,
        unit="cm",
    ),
    Column("force_log", "path", "file of the force log", "always"),
    Column("motion_log", "path", "file of the motion log", "always"),
    Column(
        "tare_run",
        "name",
        "run_id of the rod run (for a leg: of the leg_air run) to subtract",
        kinds=_MEASURED,
        hint="the run_id of another row",
    ),
    Column("tare_shared", "flag", "yes when that tare serves several runs", kinds=_MEASURED),
    Column(
        "surface_z_mm",
        "number",
        "arm z of the free surface; blank: arm.surface_z_mm of the config",
        unit="mm",
    ),
    Column("excluded", "flag", "yes leaves the run out"),
    Column("reason", "text", "why the run is left out; needed where excluded is yes"),
    Column("note", "text", "free text"),
)

BY_NAME = {column.name: column for column in COLUMNS}
