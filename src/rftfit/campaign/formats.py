"""Formats of tables of alpha, and of tables of stress against depth: `ALPHA` and `STRESS`, with all names of columns.

Such a table can be the data of a campaign, in place of run sheet and logs. Angles in deg, depth in cm, stress in
N/cm^2, alpha and its standard error in N/cm^3. Stress and alpha are those of the medium on the plate, positive upward
(z) and toward +x (x).
"""

from __future__ import annotations

from functools import partial

from rftfit.campaign.columns import COLUMNS as SHEET_COLUMNS
from rftfit.campaign.columns import LABELS
from rftfit.campaign.rows import Schema, TableColumn

OTHER_SENSE = "with gamma > 0 depth grows, with gamma < 0 it shrinks"
"""Rule by which rows of a table of stress are left out if they contradict it, in words for messages."""

_optional = partial(TableColumn, needed=False)
_ANGLES = tuple(
    TableColumn(f"{name}_deg", "number", meaning, unit="degrees", also=(name,))
    for name, meaning in (
        ("beta", "attack angle of the plate"),
        ("gamma", "intrusion angle of its motion: 90 straight down, -90 straight up"),
    )
)
RUN_ID = _optional("run_id", "name", "rows of one push")
# columns that mean the same as those of a run sheet, in both tables
_COLUMNS_OF_RUN = (
    _optional("medium", "name", "key of the config's media"),
    _optional("excluded", "flag", "yes leaves the run out"),
    _optional("reason", "text", "why the run is left out; needed where excluded is yes"),
    *(column for column in SHEET_COLUMNS if column.name in LABELS),
)


_NAMES_WITH_UNIT = {
    "depth": ("sinkage", "penetration", "tiefe", "einsinkung"),
    "stress_z": (
        *("sigma_z", "sigma_zz", "sigma", "pressure", "stress", "normal_stress"),
        *("qc", "cone_resistance", "druck"),
    ),
    "stress_x": ("sigma_x", "sigma_xz", "tau", "shear_stress"),
}
"""Column, to names that other programs give it in headers with a unit, such as ``Sinkage (mm)``."""


def _alpha_columns(component: str) -> tuple[TableColumn, TableColumn]:
    """Return the columns of alpha and of its standard error; `component`: x or z. Only alpha_z is needed."""
    name, error = f"alpha_{component}", f"se_{component}"
    return (
        TableColumn(
            f"{name}_N_per_cm3",
            "number",
            "stress per depth" + "; blank where no force along x was measured" * (component == "x"),
            needed=component == "z",
            unit="N/cm^3",
            also=(name,),
            names_with_unit=("alpha",) if component == "z" else (),
        ),
        _optional(
            error,
            "number",
            f"standard error of {name}",
            low=0,
            unit="N/cm^3",
            also=(f"{name}_se_N_per_cm3", f"{error}_N_per_cm3"),
        ),
    )


ALPHA = Schema(
    "alpha-table",
    (
        *_ANGLES,
        *_alpha_columns("z"),
        *_alpha_columns("x"),
        _optional("n", "number", "number of runs behind it", low=1, also=("n_runs",)),
        _optional("depth_from_cm", "number", "least depth behind it", low=0, unit="cm"),
        _optional("depth_to_cm", "number", "largest depth behind it", low=0, unit="cm"),
        *_COLUMNS_OF_RUN,
    ),
    others="warned",
)
STRESS = Schema(
    "stress-table",
    (
        *_ANGLES,
        TableColumn(
            "depth_cm",
            "number",
            "depth of the plate's centre, growing downward",
            unit="cm",
            also=("depth",),
            names_with_unit=_NAMES_WITH_UNIT["depth"],
        ),
        *(
            TableColumn(
                f"stress_{c}_N_per_cm2",
                "number",
                "force of the medium over the plate's area"
                + "; blank where no force along x was measured" * (c == "x"),
                needed=c == "z",
                unit="N/cm^2",
                also=(f"stress_{c}",),
                names_with_unit=_NAMES_WITH_UNIT[f"stress_{c}"],
            )
            for c in "zx"  # the two components
        ),
        RUN_ID,
        *_COLUMNS_OF_RUN,
    ),
    others="warned",
)
