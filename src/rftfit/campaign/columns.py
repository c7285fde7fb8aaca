"""Columns of the run sheet: the one definition for the reader, the documentation and the template.

A run is one motion with its logs, a row of the sheet. Which cells a row must fill depends on the kind of run and on its
direction: a leg has no attack angle, and only a horizontal run has a depth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from rftfit.campaign.rows import TableColumn

KINDS = ("plate", "rod", "leg", "leg_air")
"""Kinds of run: a plate, its rod alone, a leg in the medium, the leg turned in air; rod and leg_air are tares."""
_ALONG_PATHS, _TURNING = ("intrusion", "extraction", "horizontal"), ("rotation",)
"""Words for the motion along a straight path, and for that of a leg."""
_DIRECTION_WORDS = (*_ALONG_PATHS, *_TURNING)

DIRECTIONS = {"plate": _ALONG_PATHS, "rod": _ALONG_PATHS, "leg": _TURNING, "leg_air": _TURNING}
"""Kind of run, to the directions that it can have."""


@dataclass(frozen=True)
class SheetColumn(TableColumn):
    """A column of the run sheet.

    `kinds`: Kinds of run that use the column. `direction`: The only direction of motion whose runs use the column;
    empty: all do. `section`: Section of the configuration whose keys are the words of a choice; empty: `choices` has
    them.
    `may_be_blank`: Kinds of run for which a needed cell may be blank.
    """

    kinds: tuple[str, ...] = KINDS
    direction: str = ""
    section: str = ""
    may_be_blank: tuple[str, ...] = ()

    @property
    def header_needed(self) -> bool:
        """True if a sheet without this column cannot be read; one for some directions alone may be missing."""
        return self.needed and not self.direction

    @property
    def allowed(self) -> str:
        """Words on what a cell may hold."""
        if self.section:
            return f"a key of `{self.section}` in the config"
        return super().allowed

    def is_needed_in(self, cells: Mapping[str, str]) -> bool:
        """Return whether the cell of a row must be filled; `cells`: cells of the row by name of column."""
        return self.needed and cells.get("kind", "") not in self.may_be_blank

    def why_unused(self, cells: Mapping[str, str]) -> str | None:
        """Return why a run does not use this column; empty: it does; None: unknown, as its kind or direction is wrong.

        `cells`: As in `is_needed_in`.
        """
        if self.kinds is KINDS and not self.direction:
            return ""
        kind, direction = cells.get("kind", ""), cells.get("direction", "")
        if kind not in KINDS or (self.direction and direction not in _DIRECTION_WORDS):
            return None
        if kind not in self.kinds:
            return f"a {kind} does not use this cell"
        if self.direction and direction != self.direction:
            return f"a {kind} run that is not {self.direction} does not use this cell"
        return ""


_PLATES = ("plate", "rod")
"""Kinds of run along a straight path."""
_MEASURED = ("plate", "leg")
"""Kinds of run from which a tare is subtracted."""

# makers of columns: of one that may be blank, and of an angle of a straight path
_optional = partial(SheetColumn, needed=False)
_angle = partial(SheetColumn, kinds=_PLATES, low=-90, high=90, unit="degrees")

COLUMNS = (
    SheetColumn("run_id", "name", "unique name of the run"),
    SheetColumn(
        "kind",
        "choice",
        "plate; rod: rod and mount only, no plate; leg; leg_air: the leg turned in air",
        choices=KINDS,
    ),
    SheetColumn(
        "medium", "choice", "the granular medium", kinds=("plate", "rod", "leg"), section="media"
    ),
    SheetColumn(
        "intruder",
        "choice",
        "the plate or leg; for a rod or in-air run, the one whose tare it is",
        section="intruders",
    ),
    SheetColumn(
        "direction",
        "choice",
        "how it moved",
        choices=_DIRECTION_WORDS,
        hint="rotation for legs, the others for plates and rods",
    ),
    _angle(
        "beta_deg",
        "number",
        "angle at which the plate is held; blank of a rod that is the tare of plates at any angle",
        period=180,
        may_be_blank=("rod",),
    ),
    _angle(
        "gamma_deg",
        "number",
        "angle of the path: 90 straight down, 0 horizontal",
        hint="the angle of the path on the way down, also for an extraction that goes back along it; "
        "negative: of an extraction up toward -x, as in the table of alpha",
    ),
    SheetColumn(
        "depth_cm",
        "number",
        "depth of a horizontal run",
        kinds=_PLATES,
        direction="horizontal",
        above=0,
        unit="cm",
    ),
    SheetColumn("force_log", "path", "file of the force log"),
    SheetColumn("motion_log", "path", "file of the motion log"),
    _optional(
        "tare_run",
        "name",
        "run_id of the rod run (for a leg: of the leg_air run) to subtract",
        kinds=_MEASURED,
        hint="the run_id of another row",
    ),
    _optional("tare_shared", "flag", "yes when that tare serves several runs", kinds=_MEASURED),
    _optional(
        "surface_z_mm",
        "number",
        "arm z of the free surface; blank: arm.surface_z_mm of the config",
        unit="mm",
    ),
    _optional("excluded", "flag", "yes leaves the run out"),
    _optional("reason", "text", "why the run is left out; needed where excluded is yes"),
    _optional("note", "text", "free text"),
    _optional(
        "zero_log",
        "path",
        "force log without load: the zero of this run, in place of its own rest in air",
    ),
    _optional(
        "stroke",
        "number",
        "which stroke along the path, in the order of time from 1; needed where one log holds several",
        low=1,
        high=10000,
    ),
    _optional(
        "force_where",
        "text",
        "rows of the force log that belong to this run, as in sensor=ft_plate; Run=2",
        hint="column=value, several with ; between them, several values of one column with a comma between them; "
        "goes before force_log.where of the config",
    ),
    _optional(
        "motion_where",
        "text",
        "rows of the motion log that belong to this run",
        hint="as force_where",
    ),
    _optional(
        "force_columns",
        "text",
        "columns of the force log of this run, as in time=Time (s) Run #2; F3=Force (N) Run #2",
        hint="quantity=column, several with ; between them; unit, factor and all else stay those of "
        "force_log.columns in the config",
    ),
    _optional(
        "motion_columns", "text", "columns of the motion log of this run", hint="as force_columns"
    ),
    _optional(
        "session",
        "text",
        "label of the runs made under the same conditions, as of one day, and between two settings of the clocks",
    ),
    _optional("operator", "text", "who made the run"),
    _optional("plate", "text", "label of the plate itself, where there are several of one size"),
    _optional("rod", "text", "label of the rod or mount itself"),
)

OF_SOURCES = ("force_where", "motion_where", "force_columns", "motion_columns")
"""Columns that say which rows and columns of its logs belong to a run."""

LABELS = ("session", "operator", "plate", "rod")
"""Columns of labels: runs with the same label may share an error."""
